// Pins: places and directions towards which an attenuation file holds attenuation beside the 26 directions, swept once
// for lamps that stay where they are or for the eyes of a camera path. Their sections (format.h draws them) come last
// and may be skipped; both layouts have the same ones.
#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>

namespace freevoxel {

struct Pin {
  bool directional = false;
  glm::dvec3 world{0.0};  ///< a position or, if directional, a direction of any length but 0
};

/// Attenuation of a pin is a whole number of 1/65535, the unit that sweeps are rounded to: kept to 16 bits, it is what
/// the sweep said.
inline constexpr uint16_t kPinnedOutside = 65535;  ///< beyond the volume's border
inline constexpr int kPinnedBytes = 2;

struct PinEntry {
  uint32_t kind;  ///< 0 a direction, 1 a position
  uint32_t zero;
  double world[3];
};
static_assert(sizeof(PinEntry) == 32 && offsetof(PinEntry, zero) == 4 && offsetof(PinEntry, world) == 8);

struct PinFrameEntry {
  uint32_t bytes;    ///< in ZPIN; 0: attenuation is the same all over the brick
  uint32_t uniform;  ///< then that attenuation; else 0
};
static_assert(sizeof(PinFrameEntry) == 8 && offsetof(PinFrameEntry, uniform) == 4);

}  // namespace freevoxel
