#include "precompute/brick_frames.h"

#include <fmt/core.h>
#include <zstd.h>

#include <algorithm>
#include <memory>
#include <new>
#include <utility>

#include "base/error.h"
#include "precompute/brick_faces.h"
#include "precompute/format.h"

namespace freevoxel {

namespace {

enum class Prediction : uint8_t { none = 0, differences = 1 };

/// On the faces of six real volumes: level 9 gains 2 % and takes five times as long; matches shorter than 7 bytes gain
/// nothing and unpack a quarter slower.
constexpr int kCompressionLevel = 1, kShortestMatch = 7;

struct FreeContext {
  void operator()(ZSTD_CCtx* context) const { ZSTD_freeCCtx(context); }
  void operator()(ZSTD_DCtx* context) const { ZSTD_freeDCtx(context); }
};

/// Contexts are worth keeping: making one costs as much as a small brick.
ZSTD_CCtx* compressor() {
  thread_local const std::unique_ptr<ZSTD_CCtx, FreeContext> context = [] {
    std::unique_ptr<ZSTD_CCtx, FreeContext> made(ZSTD_createCCtx());
    if (!made) throw std::bad_alloc();
    for (const auto& [parameter, value] :
         {std::pair(ZSTD_c_compressionLevel, kCompressionLevel), std::pair(ZSTD_c_minMatch, kShortestMatch)}) {
      check(ZSTD_isError(ZSTD_CCtx_setParameter(made.get(), parameter, value)) == 0, "zstd knows its parameters");
    }
    return made;
  }();
  return context.get();
}
ZSTD_DCtx* decompressor() {
  thread_local const std::unique_ptr<ZSTD_DCtx, FreeContext> context(ZSTD_createDCtx());
  if (!context) throw std::bad_alloc();
  return context.get();
}

Frame compress(std::span<const uint8_t> bytes, Prediction prediction) {
  Frame frame(1 + ZSTD_compressBound(bytes.size()));
  frame[0] = std::byte(prediction);
  const size_t size = ZSTD_compress2(compressor(), frame.data() + 1, frame.size() - 1, bytes.data(), bytes.size());
  check(ZSTD_isError(size) == 0, "compressing into a buffer of the stated bound succeeds");
  frame.resize(1 + size);
  return frame;
}

Frame smaller(Frame a, Frame b) {
  return b.size() < a.size() ? std::move(b) : std::move(a);
}

/// Exactly bytes.size() bytes out of a frame.
std::optional<std::string> decompress(std::span<const std::byte> frame, std::span<uint8_t> bytes,
                                      Prediction& prediction) {
  if (frame.size() < 2) return fmt::format("expected a frame, found {} bytes", frame.size());
  const auto first = std::to_integer<uint8_t>(frame[0]);
  if (first > uint8_t(Prediction::differences)) return fmt::format("expected prediction 0 or 1, found {}", first);
  prediction = Prediction(first);
  const auto body = frame.subspan(1);
  const unsigned long long contents = ZSTD_getFrameContentSize(body.data(), body.size());
  if (contents == ZSTD_CONTENTSIZE_ERROR || contents == ZSTD_CONTENTSIZE_UNKNOWN) {
    return std::string("expected a zstd frame that knows its size, found something else");
  }
  if (contents != bytes.size()) return fmt::format("expected a frame of {} bytes, found {}", bytes.size(), contents);
  if (const size_t used = ZSTD_findFrameCompressedSize(body.data(), body.size()); used != body.size()) {
    return fmt::format("expected one zstd frame of {} bytes, found {}", body.size(),
                       ZSTD_isError(used) != 0 ? ZSTD_getErrorName(used) : fmt::format("{}", used));
  }
  const size_t size = ZSTD_decompressDCtx(decompressor(), bytes.data(), bytes.size(), body.data(), body.size());
  if (ZSTD_isError(size) != 0) return fmt::format("damaged zstd frame: {}", ZSTD_getErrorName(size));
  if (size != bytes.size()) return fmt::format("expected a frame of {} bytes, found {}", bytes.size(), size);
  return std::nullopt;
}

/// Calls f(row, width, above) for every row of the faces of a pass; `above` is false for the first row of a face.
template <class F>
void forEachFaceRow(int pass, int edge, F&& f) {
  size_t at = 0;
  for (int k = 0; k < kDirectionsPerSection; ++k) {
    for (const FaceShape& shape : DirectionFaces(pass * kDirectionsPerSection + k, edge).shapes()) {
      for (int row = 0; row < shape.rows; ++row) {
        f(at, size_t(shape.width), row > 0);
        at += size_t(shape.width);
      }
    }
  }
}

uint32_t folded(uint32_t difference) {
  return (difference << 1 ^ (0 - (difference >> 15 & 1))) & 0xffff;
}
uint32_t unfolded(uint32_t code) {
  return (code >> 1 ^ (0 - (code & 1))) & 0xffff;
}

}  // namespace

uint64_t largestFrame(uint64_t bytes) {
  return 1 + ZSTD_compressBound(bytes);
}

Frame packCodes(std::span<const std::byte> codes, int bytesPerCode) {
  const size_t count = codes.size() / size_t(bytesPerCode);
  std::vector<uint8_t> plain(codes.size()), differences(codes.size());
  if (bytesPerCode == 1) {
    uint8_t before = 0;
    for (size_t i = 0; i < count; ++i) {
      plain[i] = std::to_integer<uint8_t>(codes[i]);
      differences[i] = uint8_t(plain[i] - before);
      before = plain[i];
    }
  } else {
    uint32_t before = 0;
    for (size_t i = 0; i < count; ++i) {
      plain[i] = std::to_integer<uint8_t>(codes[2 * i]);
      plain[count + i] = std::to_integer<uint8_t>(codes[2 * i + 1]);
      const uint32_t code = plain[i] | uint32_t(plain[count + i]) << 8;
      const uint32_t difference = folded((code - before) & 0xffff);
      differences[i] = uint8_t(difference);
      differences[count + i] = uint8_t(difference >> 8);
      before = code;
    }
  }
  return smaller(compress(plain, Prediction::none), compress(differences, Prediction::differences));
}

Frame packFaces(std::span<const uint8_t> planes, std::span<const uint16_t> steps, int pass, int edge) {
  checkEqual(planes.size(), steps.size() * kDirectionsPerSection, "bytes of the planes of a pass");
  std::vector<uint8_t> plain(passFaceBytes(edge)), differences(plain.size());
  size_t at = 0;
  for (int k = 0; k < kDirectionsPerSection; ++k) {
    const int direction = pass * kDirectionsPerSection + k;
    gatherFaces(planes.data() + size_t(k) * steps.size(), steps, direction, edge, plain.data() + at);
    at += DirectionFaces(direction, edge).bytes();
  }
  forEachFaceRow(pass, edge, [&](size_t row, size_t width, bool above) {
    for (size_t i = row; i < row + width; ++i)
      differences[i] = uint8_t(plain[i] - (above ? plain[i - width] : kAttenuationOutside));
  });
  return smaller(compress(plain, Prediction::none), compress(differences, Prediction::differences));
}

std::optional<std::string> unpackCodes(std::span<const std::byte> frame, int bytesPerCode, std::span<std::byte> codes) {
  Prediction prediction{};
  const size_t count = codes.size() / size_t(bytesPerCode);
  if (bytesPerCode == 1) {
    const std::span<uint8_t> bytes(reinterpret_cast<uint8_t*>(codes.data()), codes.size());
    if (auto problem = decompress(frame, bytes, prediction)) return problem;
    if (prediction == Prediction::differences) {
      uint8_t code = 0;
      for (uint8_t& byte : bytes)
        byte = code = uint8_t(code + byte);
    }
    return std::nullopt;
  }
  std::vector<uint8_t> bytes(codes.size());
  if (auto problem = decompress(frame, bytes, prediction)) return problem;
  uint32_t code = 0;
  for (size_t i = 0; i < count; ++i) {
    const uint32_t stored = bytes[i] | uint32_t(bytes[count + i]) << 8;
    code = prediction == Prediction::differences ? code + unfolded(stored) : stored;
    codes[2 * i] = std::byte(code);
    codes[2 * i + 1] = std::byte(code >> 8);
  }
  return std::nullopt;
}

std::optional<std::string> unpackFaces(std::span<const std::byte> frame, int pass, int edge, std::span<uint8_t> faces) {
  checkEqual(faces.size(), passFaceBytes(edge), "bytes of the faces of a pass");
  Prediction prediction{};
  if (auto problem = decompress(frame, faces, prediction)) return problem;
  if (prediction == Prediction::differences) {
    forEachFaceRow(pass, edge, [&](size_t row, size_t width, bool above) {
      uint8_t* bytes = faces.data() + row;
      for (size_t i = 0; i < width; ++i)
        bytes[i] = uint8_t(bytes[i] + (above ? *(bytes + i - width) : kAttenuationOutside));
    });
  }
  return std::nullopt;
}

}  // namespace freevoxel
