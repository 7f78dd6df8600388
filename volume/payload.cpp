#include "volume/payload.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <glm/glm.hpp>

#include "base/error.h"
#include "volume/byte_source.h"
#include "volume/text_values.h"

namespace freevoxel {

namespace {

/// Byte after `count` lines from `offset` on.
uint64_t skipLines(const std::string& path, uint64_t offset, uint64_t count) {
  const std::unique_ptr<ByteSource> file = openPlain(path, offset);
  std::array<std::byte, 4096> buffer{};
  for (uint64_t left = count; left > 0;) {
    const size_t got = file->read(buffer);
    if (got == 0) throw InputError(fmt::format("{}: expected {} lines to skip, found {}", path, count, count - left));
    for (size_t i = 0; i < got && left > 0; ++i, ++offset) {
      if (buffer[i] == std::byte{'\n'}) --left;
    }
  }
  return offset;
}

StoredType storedTypeOf(const Payload& payload) {
  return payload.stored.value_or(storedType(payload.header.type));
}

/// Bytes of all values as the files hold them (text: as the values are handed on).
std::optional<uint64_t> storedBytes(const Payload& payload) {
  const auto values = checkedProduct(payload.header.voxels(), uint64_t(payload.interleaved.count));
  return values ? checkedProduct(*values, bytesPerValue(storedTypeOf(payload))) : std::nullopt;
}

class PayloadSource final : public VolumeSource {
 public:
  explicit PayloadSource(Payload payload)
      : payload_(std::move(payload)),
        stored_(storedTypeOf(payload_)),
        fileBytes_(*storedBytes(payload_) / payload_.files.size()),
        leftInFile_(fileBytes_),
        slicesLeft_(payload_.header.dims.z) {
    // Backwards, so that the first file is the one left open.
    for (size_t i = payload_.files.size(); i-- > 0;)
      source_ = openFile(payload_.files[i]);
  }

  const VolumeHeader& header() const override { return payload_.header; }

  void readSlices(int count, std::span<std::byte> out) override {
    const uint64_t sliceBytes = payload_.header.bytes() / uint64_t(payload_.header.dims.z);
    check(count >= 0 && count <= slicesLeft_, "no more slices are asked for than the volume has");
    checkEqual(uint64_t(out.size()), uint64_t(count) * sliceBytes, "size of the room for slices");
    if (isAsKept()) {
      readStored(out);
      if (!isNative()) swapBytes(out, bytesPerValue(stored_));
    } else {
      readConverted(out);
    }
    slicesLeft_ -= count;
  }

 private:
  bool isNative() const {
    // Numbers in words have no byte order.
    return payload_.text || (payload_.byteOrder == ByteOrder::little) == (std::endian::native == std::endian::little);
  }
  bool isAsKept() const {
    return payload_.interleaved.count == 1 && payload_.scaling.isNone() && stored_ == storedType(payload_.header.type);
  }

  void readConverted(std::span<std::byte> out) {
    constexpr size_t kPortion = size_t(1) << 16;  // values
    const size_t keptBytes = bytesPerValue(payload_.header.type);
    const size_t voxelBytes = bytesPerValue(stored_) * size_t(payload_.interleaved.count);
    const bool little = isNative() == (std::endian::native == std::endian::little);
    const ByteOrder order = little ? ByteOrder::little : ByteOrder::big;
    while (!out.empty()) {
      const std::span<std::byte> part = out.first(std::min(out.size(), kPortion * keptBytes));
      scratch_.resize(part.size() / keptBytes * voxelBytes);
      readStored(scratch_);
      convertValues(scratch_, stored_, order, payload_.interleaved, payload_.scaling, payload_.header.type, part);
      out = out.subspan(part.size());
    }
  }

  /// The next bytes of values, as they lie in the files one after the other.
  void readStored(std::span<std::byte> out) {
    while (!out.empty()) {
      const std::span<std::byte> part = out.first(std::min<uint64_t>(out.size(), leftInFile_));
      readExactly(part);
      out = out.subspan(part.size());
      leftInFile_ -= part.size();
      if (leftInFile_ == 0) finishFile();
    }
  }

  std::string wanted() const {
    const VolumeHeader& h = payload_.header;
    const std::string share =
        payload_.files.size() > 1 ? fmt::format("one of {} equal parts of ", payload_.files.size()) : std::string();
    const std::string each = payload_.interleaved.count > 1 ? fmt::format(" x {}", payload_.interleaved.count) : "";
    return fmt::format("{} bytes ({}{} x {} x {}{} values of type {}{})", fileBytes_, share, h.dims.x, h.dims.y,
                       h.dims.z, each, valueTypeName(h.type), skipText());
  }

  std::unique_ptr<ByteSource> openFile(const std::string& path) const {
    const uint64_t start = skipLines(path, payload_.start, payload_.lineSkip);
    if (payload_.text) return openText(path, start);
    return payload_.compressed ? openCompressed(path, start) : openStored(path, start);
  }

  std::unique_ptr<ByteSource> openText(const std::string& path, uint64_t start) const {
    std::unique_ptr<ByteSource> characters =
        payload_.compressed ? openInflated(path, start) : openPlain(path, start + payload_.byteSkip);
    // A digit and a blank each, but for the last.
    const uint64_t values = fileBytes_ / bytesPerValue(stored_);
    const uint64_t found = characters->atMost();
    if (found / 2 + 1 < values) {
      throw InputError(fmt::format("{}: expected {} numbers as text from byte {} on, found {} bytes{}", path, values,
                                   start + payload_.byteSkip, found, payload_.advice));
    }
    return readText(path, std::move(characters), payload_.header.type);
  }

  std::unique_ptr<ByteSource> openStored(const std::string& path, uint64_t start) const {
    const uint64_t found = openPlain(path, start)->atMost();
    if (payload_.atEnd) {
      if (found >= fileBytes_) return openPlain(path, start + found - fileBytes_);
      throw InputError(fmt::format("{}: expected {} at the end of the file, found {} bytes from byte {} on{}", path,
                                   wanted(), found, start, payload_.advice));
    }
    const uint64_t skip = std::min(payload_.byteSkip, found);
    const uint64_t left = found - skip;
    const bool fits =
        payload_.bytesAfter ? left >= fileBytes_ && left - fileBytes_ == *payload_.bytesAfter : left >= fileBytes_;
    if (skip == payload_.byteSkip && fits) return openPlain(path, start + skip);
    throw InputError(fmt::format("{}: expected {}{} from byte {} on, found {}{}", path, wanted(), afterText(),
                                 start + skip, left, payload_.advice));
  }

  std::unique_ptr<ByteSource> openCompressed(const std::string& path, uint64_t start) const {
    std::unique_ptr<ByteSource> source = openInflated(path, start);
    const std::optional<uint64_t> values = checkedSum(payload_.byteSkip, fileBytes_);
    const std::optional<uint64_t> needed = values ? checkedSum(*values, payload_.bytesAfter.value_or(0)) : std::nullopt;
    if (!needed || *needed > source->atMost()) {
      throw InputError(fmt::format("{}: expected {}{}, but what is compressed there cannot hold more than {} bytes{}",
                                   path, wanted(), afterText(), source->atMost(), payload_.advice));
    }
    if (const uint64_t left = discard(*source, payload_.byteSkip); left > 0) {
      throw InputError(fmt::format("{}: expected {}, the stream ends {} bytes before them{}", path, wanted(), left,
                                   payload_.advice));
    }
    return source;
  }

  /// Reads `count` bytes and forgets them; returns how many were not there.
  static uint64_t discard(ByteSource& source, uint64_t count) {
    std::array<std::byte, 4096> buffer{};
    while (count > 0) {
      const size_t got = source.read(std::span(buffer).first(std::min<uint64_t>(count, buffer.size())));
      if (got == 0) break;
      count -= got;
    }
    return count;
  }

  std::string skipText() const {
    return payload_.compressed && payload_.byteSkip > 0 ? fmt::format(", after {} skipped", payload_.byteSkip)
                                                        : std::string();
  }
  std::string afterText() const {
    return payload_.bytesAfter.value_or(0) > 0 ? fmt::format(" and {} after them", *payload_.bytesAfter)
                                               : std::string();
  }

  void readExactly(std::span<std::byte> out) {
    const size_t got = source_->read(out);
    if (got == out.size()) return;
    throw InputError(fmt::format("{}: expected {}, the stream ends after {}{}", payload_.files[file_], wanted(),
                                 fileBytes_ - leftInFile_ + got, payload_.advice));
  }

  void finishFile() {
    if (payload_.bytesAfter) {
      if (const uint64_t left = discard(*source_, *payload_.bytesAfter); left > 0) {
        throw InputError(fmt::format("{}: expected {}{}, the stream ends {} bytes too early{}", payload_.files[file_],
                                     wanted(), afterText(), left, payload_.advice));
      }
      // Asking for one byte more also has the stream's checksum compared.
      std::byte extra{};
      if (source_->read({&extra, 1}) != 0) {
        throw InputError(fmt::format("{}: expected {}{}, the stream goes on after them{}", payload_.files[file_],
                                     wanted(), afterText(), payload_.advice));
      }
    }
    if (++file_ == payload_.files.size()) return;
    source_ = openFile(payload_.files[file_]);
    leftInFile_ = fileBytes_;
  }

  Payload payload_;
  StoredType stored_;
  uint64_t fileBytes_;  ///< of values in each file
  std::unique_ptr<ByteSource> source_;
  size_t file_ = 0;
  uint64_t leftInFile_;
  int slicesLeft_;
  std::vector<std::byte> scratch_;
};

}  // namespace

void checkVolumeHeader(const std::string& name, const VolumeHeader& header) {
  const glm::ivec3 dims = header.dims;
  if (!validDims(dims)) {
    throw InputError(fmt::format("{}: dims {} x {} x {} are not within 1..{}", name, dims.x, dims.y, dims.z, kMaxDim));
  }
  if (!checkedProduct(header.voxels(), bytesPerValue(header.type))) {
    throw InputError(fmt::format("{}: {} x {} x {} values of type {} are more than 2^64 bytes", name, dims.x, dims.y,
                                 dims.z, valueTypeName(header.type)));
  }
  const Placement& placement = header.placement;
  for (int axis = 0; axis < 3; ++axis) {
    if (!std::isfinite(placement.spacing[axis]) || placement.spacing[axis] <= 0.0) {
      throw InputError(fmt::format("{}: spacing {} of axis {} is not a positive length", name, placement.spacing[axis],
                                   "xyz"[axis]));
    }
    if (!std::isfinite(placement.origin[axis])) {
      throw InputError(
          fmt::format("{}: origin {} of axis {} is not finite", name, placement.origin[axis], "xyz"[axis]));
    }
  }
  const double determinant = glm::determinant(placement.direction);
  if (!(std::abs(determinant) > 1e-6)) {
    throw InputError(fmt::format("{}: the three axis directions lie in one plane", name));
  }
}

void setStoredType(Payload& payload, StoredType stored, Scaling scaling) {
  payload.stored = stored;
  payload.scaling = scaling;
  payload.header.type = scaling.isNone() ? keptType(stored) : ValueType::f32;
}

uint64_t chooseFrame(std::optional<int> frame, uint64_t count, const std::string& where) {
  if (!frame && count > 1) {
    throw InputError(fmt::format("{}: there are {} volumes; choose one with --frame 0 to {}", where, count, count - 1));
  }
  const auto chosen = uint64_t(frame.value_or(0));
  if (chosen >= count) {
    throw InputError(fmt::format("{}: there are {} volumes, numbered from 0: there is no --frame {}", where, count,
                                 frame.value_or(0)));
  }
  return chosen;
}

void limitToVolume(Payload& payload, uint64_t chosen, uint64_t count, const std::string& where) {
  if (count == 1) return;
  const std::optional<uint64_t> each = storedBytes(payload);
  const std::optional<uint64_t> all = each ? checkedProduct(*each, count) : std::nullopt;
  const std::optional<uint64_t> end = all ? checkedSum(*all, payload.byteSkip) : std::nullopt;
  if (!end) throw InputError(fmt::format("{}: {} volumes of that size are more than 2^64 bytes", where, count));
  payload.byteSkip += chosen * *each;
  if (payload.bytesAfter) *payload.bytesAfter += (count - 1 - chosen) * *each;
}

std::unique_ptr<VolumeSource> openPayload(const std::string& name, Payload payload) {
  checkVolumeHeader(name, payload.header);
  const std::optional<uint64_t> bytes = storedBytes(payload);
  if (!bytes) {
    throw InputError(fmt::format("{}: {} x {} x {} x {} values are more than 2^64 bytes", name, payload.header.dims.x,
                                 payload.header.dims.y, payload.header.dims.z, payload.interleaved.count));
  }
  check(!payload.files.empty() && *bytes % payload.files.size() == 0, "a payload's files hold equal shares");
  return std::make_unique<PayloadSource>(std::move(payload));
}

}  // namespace freevoxel
