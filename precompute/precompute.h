// From a volume and a transfer function to an attenuation file (papers/freevoxels sections 3.1 and 5).
#pragma once

#include <cstdint>
#include <string>

#include "base/progress.h"
#include "precompute/format.h"
#include "precompute/slab_team.h"
#include "volume/read_volume.h"
#include "volume/transfer_function.h"
#include "volume/volume.h"

namespace freevoxel {

struct PrecomputeOptions {
  Classification classification = Classification::preintegrated;
  Layout layout = Layout::dense;
  int brickEdge = 16;   ///< voxels; a power of two, 8, 16 or 32
  std::string command;  ///< recorded in the file
  /// Bytes that precomputing from a VolumeSource may take, 0: as many as there are.
  uint64_t memoryBytes = 0;
  /// The finest included; 0, or more than there can be: until one brick holds the volume. More than one are made by one
  /// process.
  int levels = 1;
  Hierarchy hierarchy = Hierarchy::geometric;  ///< of levels from 1 on
};

struct PrecomputeResult {
  uint64_t voxels = 0;         ///< of the volume
  uint64_t storedVoxels = 0;   ///< in stored bricks
  uint64_t visibleVoxels = 0;  ///< with opacity > 0
  uint64_t bricks = 0;         ///< stored
  uint64_t fileBytes = 0;
  int levels = 1;
  uint64_t levelBytes = 0;       ///< of levels from 1 on, in the file
  uint64_t nonFinite = 0;        ///< NaN and infinities, coded as ValueCoding says
  double largestValueError = 0;  ///< largest loss by quantising values inside the range, data units
  double sweepSeconds = 0;       ///< sweeping and permuting to curve order
  double writeSeconds = 0;       ///< hashing, writing and syncing the file
};

/// Writes `path` whole or not at all; the bytes do not depend on the number of OpenMP threads.
/// Throws InputError or MachineError.
PrecomputeResult precompute(const Volume& volume, const TransferFunction& transfer, const std::string& path,
                            const PrecomputeOptions& options, Progress& progress);

/// The same file from a volume that need not fit memory: what is held at any time, input included, stays below
/// options.memoryBytes. Reads `source` once; its codes wait beside `path` in a file without a name, of one or two bytes
/// per voxel. Throws as above, and MachineError if memoryBytes is less than the least possible, which it names: mainly
/// 13
/// * brickEdge + 36 + 2 * (brickEdge + 1) bytes per voxel of an xy plane, or about twice that if both passes are to run
/// at once.
PrecomputeResult precompute(VolumeSource& source, const TransferFunction& transfer, const std::string& path,
                            const PrecomputeOptions& options, Progress& progress);

/// The same file, written by several processes at once, which all call this with the same arguments, a source of their
/// own, and a folder that they share. A rank reads `source` as far as its own slabs of bricks go, and holds their
/// codes; it sweeps them twice, first for what leaves them (DESIGN section 6). The bytes do not depend on the number of
/// ranks. Every rank is told the whole result. options.memoryBytes bounds every rank. Throws as above on the rank that
/// fails; the team's own exception on the others; no file appears then.
PrecomputeResult precompute(VolumeSource& source, const TransferFunction& transfer, const std::string& path,
                            const PrecomputeOptions& options, SlabTeam& team, Progress& progress);

}  // namespace freevoxel
