// Value codes on disk, for volumes that need not fit memory: written once upwards, read by each pass in its own order.
#pragma once

#include <array>
#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <string>
#include <vector>

#include "base/give_back.h"
#include "precompute/sweep.h"

namespace freevoxel {

/// A file without a name, beside the attenuation file to be, of coding.bytes() bytes per voxel; the system removes it
/// with the last use. Some formats can only be read forwards (gzip), and one pass goes backwards.
class CodeSpool final : public CodePlanes {
 public:
  /// `path`: of the file beside which it lies. Throws MachineError.
  CodeSpool(const std::string& path, glm::ivec3 dims, int bytesPerCode);
  ~CodeSpool() override;
  CodeSpool(const CodeSpool&) = delete;
  CodeSpool& operator=(const CodeSpool&) = delete;

  /// The next planes. Throws MachineError.
  void append(std::span<const uint16_t> codes);
  /// Throws MachineError. Keeps one window for each pass.
  std::span<const uint16_t> planes(int pass, int first, int count) override;
  /// Gives back the memory of a pass's window.
  void release(int pass) override { giveBack(windows_[size_t(pass)]); }

 private:
  uint64_t rowBytes() const { return planeVoxels_ * uint64_t(bytesPerCode_); }

  std::string path_;
  int descriptor_ = -1;
  uint64_t planeVoxels_;
  int bytesPerCode_;
  uint64_t appended_ = 0;        ///< bytes
  std::vector<uint8_t> narrow_;  ///< codes of one byte on their way
  std::array<std::vector<uint16_t>, kSweepPasses> windows_;
};

}  // namespace freevoxel
