// Volumes whose file runs through z first.
#pragma once

#include <memory>
#include <string>

#include "volume/read_volume.h"

namespace freevoxel {

/// A source of `header` from one whose x is its z and the other way round. Slices of the one need all of the other, so
/// the first readSlices reads it whole. `name` stands in errors.
std::unique_ptr<VolumeSource> withAxesReversed(std::unique_ptr<VolumeSource> source, VolumeHeader header,
                                               std::string name);

}  // namespace freevoxel
