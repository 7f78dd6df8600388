// The pins of an attenuation file: attenuation swept when it was made, a brick at a time.
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <string>
#include <vector>

#include "precompute/pins.h"

namespace freevoxel {

/// What AttenuationFile found of the sections PINS, PFRM and ZPIN; their checksums but that of ZPIN are right.
struct PinSections {
  struct Section {
    std::span<const std::byte> bytes;
    uint64_t offset = 0;  ///< in the file
    uint64_t items = 0;
  };
  Section pins, directory, frames;
};

/// Const members may be called from many threads.
class PinnedPlanes {
 public:
  /// No pins.
  PinnedPlanes() = default;
  /// `path` is for messages; the sections' bytes must outlive this. Throws InputError naming offset, what was expected
  /// and what was found.
  PinnedPlanes(const std::string& path, const PinSections& sections, glm::ivec3 dims, int edge);

  const std::vector<Pin>& pins() const { return pins_; }
  uint64_t bytes() const { return bytes_; }  ///< that all of it takes in the file
  /// Attenuation towards a pin, 65535 standing for 1, along the curve of the brick at `position` (voxel / edge), stored
  /// or not: edge^3 entries. Voxels outside the volume get any number. Throws InputError if the frame is damaged.
  void unpack(size_t pin, glm::ivec3 position, std::span<uint16_t> attenuation) const;
  /// Unpacks all. Throws as above.
  void verify() const;

 private:
  void readPins(const PinSections::Section& section);
  void readDirectory(const PinSections::Section& section);

  std::string path_;
  glm::ivec3 bricks_{0};
  int edge_ = 0;
  std::vector<Pin> pins_;
  // Copies: what has been checked must not change with the file.
  std::vector<PinFrameEntry> directory_;
  std::vector<uint64_t> offsets_;  ///< of frames, in their section
  std::span<const std::byte> frames_;
  uint64_t framesOffset_ = 0;
  uint64_t bytes_ = 0;
};

}  // namespace freevoxel
