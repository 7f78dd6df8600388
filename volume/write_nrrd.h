// NRRD files written slice by slice.
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string>

#include "volume/volume.h"

namespace freevoxel {

/// An attached NRRD file for volumes that need not fit memory; it appears whole with finish(), or not at all.
class NrrdWriter {
 public:
  /// Gzip encoded if `compress`. Throws MachineError.
  NrrdWriter(const std::string& path, const VolumeHeader& header, bool compress);
  ~NrrdWriter();
  NrrdWriter(NrrdWriter&&) noexcept;
  NrrdWriter& operator=(NrrdWriter&&) = delete;

  /// The next values, any number of them, in this machine's byte order. Throws MachineError.
  void append(std::span<const std::byte> values);
  /// Throws MachineError; InternalError unless header.bytes() have been appended.
  void finish();

 private:
  struct Output;
  std::unique_ptr<Output> output_;
};

}  // namespace freevoxel
