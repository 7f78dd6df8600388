// Adds pins to an attenuation file.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "precompute/pins.h"

namespace freevoxel {

/// Writes a copy of an attenuation file with pins: all its sections, byte for byte, and those of the pins after them.
/// Whole or not at all.
class PinWriter {
 public:
  /// `source`: an attenuation file that was opened and found sound; it has no pins. Throws InputError or MachineError.
  PinWriter(const std::string& source, const std::string& path, std::span<const Pin> pins);
  ~PinWriter();

  /// Attenuation towards the next pin, 65535 standing for 1: of every voxel of the volume, x fastest. Throws
  /// MachineError.
  void add(std::span<const uint16_t> attenuation);
  /// When every pin was added; gives the size of the file. Throws MachineError, or InputError if the source was cut.
  uint64_t commit();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace freevoxel
