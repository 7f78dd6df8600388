// What parent and child of volume/child_process.h say to each other, in this machine's byte order.
//
//   request   uint64 size, then: uint64 memory, uint64 processor seconds, text path (uint64 size and bytes), and what
//   the
//             kind of reader takes.
//   answer    messages: uint32 kind, uint32 0, uint64 size, `size` bytes. First a header or an error; then values, in
//             order in any portions, or an error; last an end.
//
// Of a volume (volume/child_reader.h) the request goes on with uint32 format, three flags (component, spacing, labels:
// uint32 each), double spacing[3], the texts component, files...; values are its slices.
#pragma once

#include <array>
#include <cstdint>

namespace freevoxel {

enum class ChildMessage : uint32_t { header = 1, values, inputError, machineError, end };

struct MessageStart {
  uint32_t kind = 0;
  uint32_t zero = 0;
  uint64_t size = 0;
};
static_assert(sizeof(MessageStart) == 16);

/// VolumeHeader as it travels.
struct HeaderMessage {
  std::array<int32_t, 3> dims{};
  uint32_t type = 0;
  std::array<double, 3> spacing{}, origin{};
  std::array<double, 9> direction{};
};
static_assert(sizeof(HeaderMessage) == 136);

}  // namespace freevoxel
