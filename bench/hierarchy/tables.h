// The tables of docs/results/hierarchy.md. Each function measures one scene, or one file, and adds its rows.
#pragma once

#include <string>
#include <vector>

#include "bench/fidelity/scenes.h"
#include "bench/fidelity/table.h"

namespace freevoxel::bench {

struct TableOptions {
  Folders folders;
  int views = 4;
  int imageSize = 256;             ///< pixels an edge; of levels the voxels decide
  int repeats = 5;                 ///< of what is timed; the median counts
  std::vector<std::string> files;  ///< of size: attenuation files of one object, coarse to fine
};

/// An attenuation file with so many levels, 0 for all, made anew; for use as long as the scene is.
AttenuationFile levelFile(const Scene& scene, Hierarchy hierarchy, int levels, const Folders& folders);

/// Level k against the finest one, low-passed to one pixel per voxel of level k: rows.
void addLevels(Table& table, const Scene& scene, const TableOptions& options);

/// Pictures while they are refined (Splatter::refine), against the last: a row.
void addRefinement(Table& table, const Scene& scene, const TableOptions& options);

/// Frame time and PSNR against --lod 0, over --lod: a row each.
void addDetail(Table& table, const Scene& scene, const TableOptions& options);

/// Cost and PSNR of one object over the size of its volume, the image staying as it is: a row.
void addVolumeSize(Table& table, const std::string& file, const TableOptions& options);

/// Cost of one volume over the size of the image: rows.
void addImageSize(Table& table, const std::string& file, const TableOptions& options);

}  // namespace freevoxel::bench
