// Attenuation swept once and kept in the attenuation file (DESIGN section 3, `pinned`).
#pragma once

#include <optional>
#include <span>
#include <string>

#include "base/progress.h"
#include "hierarchy/attenuation_file.h"
#include "precompute/pins.h"
#include "splat/attenuation_grid.h"

namespace freevoxel {

/// Bytes that pinAttenuation() takes for a volume of so many voxels: codes, one sweep's attenuation, its frames.
constexpr uint64_t pinMemory(uint64_t voxels) {
  return 6 * voxels;
}

/// Copies the attenuation file `source`, which has no pins, to `path`, with attenuation swept towards each pin: what
/// `swept` would give for the same target, to the bit. Gives the size of the new file. Throws InputError or
/// MachineError.
uint64_t pinAttenuation(const std::string& source, std::span<const Pin> pins, const std::string& path,
                        Progress& progress);

Towards towardsPin(const Pin& pin, const Placement& placement);

/// The pin that is the target, if there is one: the same kind, and the same direction or position to nine digits.
std::optional<size_t> findPin(const AttenuationFile& file, const Towards& target);

/// Attenuation of the whole volume towards a pin. Throws InputError if the file is damaged.
AttenuationGrid pinnedAttenuation(const AttenuationFile& file, size_t pin);

}  // namespace freevoxel
