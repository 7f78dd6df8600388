// Pictures and data of the FreeVoxels paper's Figures 2, 4 and 6.
#pragma once

#include <string>

#include "bench/fidelity/scenes.h"

namespace freevoxel::bench {

/// Writes figure2.png, figure4.dat and, of a translucent box and of a thin slab of dense voxels, figure6-*.png,
/// figure6.dat, figure6-slab-*.png and figure6-slab.dat; text files are for plotting, columns named in the first line.
/// Throws MachineError.
void drawFigures(const std::string& folder, const Folders& folders);

}  // namespace freevoxel::bench
