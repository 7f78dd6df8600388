#include "volume/write_nrrd.h"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <bit>
#include <string_view>
#include <vector>

#include "base/atomic_file.h"
#include "base/error.h"
#include "volume/read_volume.h"

namespace freevoxel {

namespace {

std::string_view nrrdType(ValueType type) {
  switch (type) {
    case ValueType::u8:
      return "uint8";
    case ValueType::i8:
      return "int8";
    case ValueType::u16:
      return "uint16";
    case ValueType::i16:
      return "int16";
    case ValueType::u32:
      return "uint32";
    case ValueType::i32:
      return "int32";
    case ValueType::f32:
      return "float";
    case ValueType::f64:
      break;
  }
  return "double";
}

std::string vectorText(glm::dvec3 v) {
  return fmt::format("({},{},{})", v.x, v.y, v.z);
}

std::string headerText(const VolumeHeader& header, bool compress) {
  const Placement& p = header.placement;
  std::string text = "NRRD0004\n";
  text += fmt::format("type: {}\n", nrrdType(header.type));
  text += "dimension: 3\nspace dimension: 3\n";
  text += fmt::format("sizes: {} {} {}\n", header.dims.x, header.dims.y, header.dims.z);
  text += fmt::format("space directions: {} {} {}\n", vectorText(p.direction[0] * p.spacing.x),
                      vectorText(p.direction[1] * p.spacing.y), vectorText(p.direction[2] * p.spacing.z));
  text += fmt::format("space origin: {}\n", vectorText(p.origin));
  text += "kinds: domain domain domain\n";
  text += fmt::format("endian: {}\n", std::endian::native == std::endian::little ? "little" : "big");
  text += fmt::format("encoding: {}\n\n", compress ? "gzip" : "raw");
  return text;
}

/// A gzip stream made piece by piece.
class Deflater {
 public:
  explicit Deflater(const std::string& path) {
    constexpr int kLargestWindow = 15;
    constexpr int kGzip = 16;
    constexpr int kMemoryLevel = 8;
    if (deflateInit2(&stream_, Z_DEFAULT_COMPRESSION, Z_DEFLATED, kLargestWindow + kGzip, kMemoryLevel,
                     Z_DEFAULT_STRATEGY) != Z_OK) {
      throw MachineError(fmt::format("{}: no memory to compress it; close other programs", path));
    }
  }
  Deflater(const Deflater&) = delete;
  Deflater& operator=(const Deflater&) = delete;
  ~Deflater() { deflateEnd(&stream_); }

  /// Calls sink(bytes) with each piece of output; the last call has `flush` Z_FINISH.
  template <class Sink>
  void deflateInto(std::span<const std::byte> input, int flush, Sink&& sink) {
    std::array<std::byte, size_t(1) << 16> buffer;
    stream_.next_in = reinterpret_cast<Bytef*>(const_cast<std::byte*>(input.data()));
    stream_.avail_in = uInt(input.size());
    do {
      stream_.next_out = reinterpret_cast<Bytef*>(buffer.data());
      stream_.avail_out = uInt(buffer.size());
      deflate(&stream_, flush);
      sink(std::span<const std::byte>(buffer).first(buffer.size() - stream_.avail_out));
    } while (stream_.avail_out == 0);
  }

 private:
  z_stream stream_{};
};

}  // namespace

struct NrrdWriter::Output {
  AtomicFile file;
  uint64_t expected;  ///< bytes of values
  uint64_t appended = 0;
  uint64_t offset = 0;  ///< in the file
  std::unique_ptr<Deflater> deflater;

  void write(std::span<const std::byte> bytes) {
    file.writeAt(offset, bytes);
    offset += bytes.size();
  }
};

NrrdWriter::NrrdWriter(const std::string& path, const VolumeHeader& header, bool compress)
    : output_(new Output{.file = AtomicFile(path), .expected = header.bytes(), .deflater = nullptr}) {
  if (compress) output_->deflater = std::make_unique<Deflater>(path);
  output_->write(std::as_bytes(std::span<const char>(headerText(header, compress))));
}

NrrdWriter::~NrrdWriter() = default;
NrrdWriter::NrrdWriter(NrrdWriter&&) noexcept = default;

void NrrdWriter::append(std::span<const std::byte> values) {
  output_->appended += values.size();
  if (!output_->deflater) return output_->write(values);
  constexpr size_t kPortion = size_t(1) << 30;  // zlib counts in 32 bits
  while (!values.empty()) {
    const std::span<const std::byte> part = values.first(std::min(values.size(), kPortion));
    output_->deflater->deflateInto(part, Z_NO_FLUSH, [this](auto bytes) { output_->write(bytes); });
    values = values.subspan(part.size());
  }
}

void NrrdWriter::finish() {
  checkEqual(output_->appended, output_->expected, "bytes of values written");
  if (output_->deflater) output_->deflater->deflateInto({}, Z_FINISH, [this](auto bytes) { output_->write(bytes); });
  output_->file.commit();
}

void writeNrrd(const std::string& path, const Volume& volume, bool compress) {
  NrrdWriter writer(path, volume.header, compress);
  writer.append(volume.data);
  writer.finish();
}

}  // namespace freevoxel
