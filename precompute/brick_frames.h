// Frames: what layout compact stores of a brick, compressed. One frame for its codes and one for the faces of each
// pass, so that any brick can be read by itself, and its codes without its faces.
//
// A frame is one byte, the prediction, and one zstd frame that knows the size of its contents:
//   0 none         the bytes as they are
//   1 differences  codes: each less the one before along the curve, the first less 0; of 2 bytes a difference d is
//                  2d, or -2d - 1 if negative. Faces: each byte less the one above it, in the first row of a face less
//                  255. All modulo 256 or 65536.
// Codes of 2 bytes come as all low bytes, then all high ones. Faces come direction by direction (brick_faces.h).
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace freevoxel {

using Frame = std::vector<std::byte>;

/// Largest frame that `bytes` can become, 0 if that is no size at all.
uint64_t largestFrame(uint64_t bytes);

/// `codes`: of one brick along the curve, 1 or 2 bytes each, little-endian. The better prediction of the two.
Frame packCodes(std::span<const std::byte> codes, int bytesPerCode);
/// `planes`: the 13 planes of a pass, of edge^3 bytes each along the curve; `steps`: hilbertSteps of the brick.
Frame packFaces(std::span<const uint8_t> planes, std::span<const uint16_t> steps, int pass, int edge);

/// Undoes packCodes: fills `codes`, or tells what is wrong with the frame. Reads and writes nothing outside whatever
/// the frame holds, and needs no more memory than `codes` twice.
std::optional<std::string> unpackCodes(std::span<const std::byte> frame, int bytesPerCode, std::span<std::byte> codes);
/// Undoes packFaces as far as the faces of each direction, one after another: passFaceBytes(edge) bytes.
std::optional<std::string> unpackFaces(std::span<const std::byte> frame, int pass, int edge, std::span<uint8_t> faces);

}  // namespace freevoxel
