// From a volume and a transfer function to an attenuation file (papers/freevoxels sections 3.1 and 5).
#pragma once

#include <cstdint>
#include <string>

#include "base/progress.h"
#include "precompute/format.h"
#include "volume/transfer_function.h"
#include "volume/volume.h"

namespace freevoxel {

struct PrecomputeOptions {
  Classification classification = Classification::preintegrated;
  Layout layout = Layout::dense;
  int brickEdge = 16;   ///< voxels; a power of two, 8, 16 or 32
  std::string command;  ///< recorded in the file
};

struct PrecomputeResult {
  uint64_t voxels = 0;         ///< of the volume
  uint64_t storedVoxels = 0;   ///< in stored bricks
  uint64_t visibleVoxels = 0;  ///< with opacity > 0
  uint64_t bricks = 0;         ///< stored
  uint64_t fileBytes = 0;
  uint64_t nonFinite = 0;        ///< NaN and infinities, coded as ValueCoding says
  double largestValueError = 0;  ///< largest loss by quantising values inside the range, data units
  double sweepSeconds = 0;       ///< sweeping and permuting to curve order
  double writeSeconds = 0;       ///< hashing, writing and syncing the file
};

/// Writes `path` whole or not at all; the bytes do not depend on the number of OpenMP threads.
/// Throws InputError or MachineError.
PrecomputeResult precompute(const Volume& volume, const TransferFunction& transfer, const std::string& path,
                            const PrecomputeOptions& options, Progress& progress);

}  // namespace freevoxel
