#include "volume/nifti.h"

#include <array>
#include <cmath>
#include <filesystem>
#include <glm/glm.hpp>

#include "base/error.h"
#include "volume/component.h"
#include "volume/header_reading.h"
#include "volume/text_parsing.h"
#include "volume/world_space.h"

namespace freevoxel {

namespace {

constexpr int kSize1 = 348, kSize2 = 540;

/// The two versions hold the same fields at other places and in other widths.
class NiftiHeader {
 public:
  NiftiHeader(const FileStart& start) : path_(start.path), bytes_(start.bytes) {
    for (const ByteOrder order : {ByteOrder::little, ByteOrder::big}) {
      if (bytes_.size() < 4) break;
      const auto size = numberAt<int32_t>(bytes_, 0, order);
      if (size != kSize1 && size != kSize2) continue;
      order_ = order;
      size_ = size_t(size);
    }
    if (size_ == 0) throw InputError(fmt::format("{}: offset 0: expected a header of 348 or 540 bytes", path_));
    if (bytes_.size() < size_) {
      throw InputError(fmt::format("{}: expected a header of {} bytes, found {}", path_, size_, bytes_.size()));
    }
  }

  [[noreturn]] void fail(size_t offset, const std::string& what) const {
    throw InputError(fmt::format("{}: offset {}: {}", path_, offset, what));
  }

  bool isSecond() const { return size_ == kSize2; }
  size_t size() const { return size_; }
  const std::string& path() const { return path_; }
  ByteOrder order() const { return order_; }
  template <class T>
  T at(size_t offset) const {
    return numberAt<T>(bytes_, offset, order_);
  }
  /// Number `index` of an array of f32 (version 1) or f64 (version 2).
  double real(size_t offset1, size_t offset2, size_t index = 0) const {
    return isSecond() ? at<double>(offset2 + 8 * index) : double(at<float>(offset1 + 4 * index));
  }
  std::string text(size_t offset, size_t length) const {
    std::string found;
    for (size_t i = 0; i < length; ++i)
      found += char(bytes_[offset + i]);
    return found;
  }

  size_t dimOffset() const { return isSecond() ? 16 : 40; }
  int64_t dim(size_t index) const {
    return isSecond() ? at<int64_t>(16 + 8 * index) : int64_t(at<int16_t>(40 + 2 * index));
  }
  double pixdim(size_t index) const { return real(76, 104, index); }
  int transformCode(bool sform) const {
    return isSecond() ? at<int32_t>(sform ? 348 : 344) : int(at<int16_t>(sform ? 254 : 252));
  }
  int units() const { return isSecond() ? at<int32_t>(500) : int(at<uint8_t>(123)); }

 private:
  std::string path_;
  std::span<const std::byte> bytes_;
  ByteOrder order_ = ByteOrder::little;
  size_t size_ = 0;
};

StoredType parseType(const NiftiHeader& header) {
  static const std::map<int, StoredType> kTypes{
      {2, StoredType::u8},     {4, StoredType::i16},    {8, StoredType::i32},   {16, StoredType::f32},
      {64, StoredType::f64},   {256, StoredType::i8},   {512, StoredType::u16}, {768, StoredType::u32},
      {1024, StoredType::i64}, {1280, StoredType::u64},
  };
  const size_t offset = header.isSecond() ? 12 : 70;
  const int code = header.at<int16_t>(offset);
  const auto found = kTypes.find(code);
  if (found == kTypes.end()) {
    header.fail(offset, fmt::format("expected a data type of plain numbers, found code {}{}", code,
                                    code == 128 || code == 2304 ? " (colour)" : ""));
  }
  const size_t bitsOffset = header.isSecond() ? 14 : 72;
  const int bits = header.at<int16_t>(bitsOffset);
  if (bits != 0 && size_t(bits) != 8 * bytesPerValue(found->second)) {
    header.fail(bitsOffset, fmt::format("expected {} bits per value for data type {}, found {}",
                                        8 * bytesPerValue(found->second), code, bits));
  }
  return found->second;
}

/// Millimetres per unit of length.
double unitScale(const NiftiHeader& header) {
  switch (header.units() & 7) {
    case 1:
      return 1000.0;  // metres
    case 3:
      return 0.001;  // micrometres
    default:
      return 1.0;
  }
}

struct Affine {
  glm::dmat3 edges{1.0};  ///< columns: voxel edges
  glm::dvec3 origin{0.0};
};

Affine sform(const NiftiHeader& header) {
  Affine affine;
  for (size_t row = 0; row < 3; ++row) {
    for (size_t column = 0; column < 4; ++column) {
      const double value = header.real(280, 400, 4 * row + column);
      (column < 3 ? affine.edges[int(column)] : affine.origin)[int(row)] = value;
    }
  }
  return affine;
}

/// The rotation of a unit quaternion of which b, c, d are stored, and a reflection of the third axis.
Affine qform(const NiftiHeader& header, glm::dvec3 spacing) {
  const double b = header.real(256, 352), c = header.real(256, 352, 1), d = header.real(256, 352, 2);
  const double squared = 1.0 - (b * b + c * c + d * d);
  double a = squared > 1e-7 ? std::sqrt(squared) : 0.0;
  glm::dvec4 q(a, b, c, d);
  if (a == 0.0) q /= glm::length(q);
  a = q[0];
  const double x = q[1], y = q[2], z = q[3];
  const double mirror = header.pixdim(0) < 0.0 ? -1.0 : 1.0;
  Affine affine;
  affine.edges[0] = spacing.x * glm::dvec3(a * a + x * x - y * y - z * z, 2 * (x * y + a * z), 2 * (x * z - a * y));
  affine.edges[1] = spacing.y * glm::dvec3(2 * (x * y - a * z), a * a + y * y - x * x - z * z, 2 * (y * z + a * x));
  affine.edges[2] =
      mirror * spacing.z * glm::dvec3(2 * (x * z + a * y), 2 * (y * z - a * x), a * a + z * z - y * y - x * x);
  for (size_t i = 0; i < 3; ++i)
    affine.origin[int(i)] = header.real(268, 376, i);
  return affine;
}

Placement parsePlacement(const NiftiHeader& header) {
  const double scale = unitScale(header);
  const size_t sformOffset = header.isSecond() ? 400 : 280;
  const size_t pixdimOffset = header.isSecond() ? 104 : 76;
  const auto place = [&](Affine affine, FileSpace space, size_t offset) {
    for (int axis = 0; axis < 3; ++axis) {
      const glm::dvec3 edge = affine.edges[axis];
      if (!std::isfinite(edge.x + edge.y + edge.z) || !std::isfinite(affine.origin[axis])) {
        header.fail(offset, "expected finite numbers for the place of the voxels");
      }
    }
    return placeInWorld(affine.edges * scale, affine.origin * scale, space,
                        fmt::format("{}: offset {}", header.path(), offset));
  };
  if (header.transformCode(true) > 0) return place(sform(header), FileSpace::ras, sformOffset);
  glm::dvec3 spacing;
  for (size_t axis = 0; axis < 3; ++axis) {
    double length = header.pixdim(axis + 1);
    if (header.dim(axis + 1) == 1 && length == 0.0) length = 1.0;  // a single slice need not have a thickness
    if (!(length > 0.0) || !std::isfinite(length)) {
      header.fail(pixdimOffset, fmt::format("expected a positive spacing of axis {}, found {}", "xyz"[axis], length));
    }
    spacing[int(axis)] = length;
  }
  if (header.transformCode(false) > 0) return place(qform(header, spacing), FileSpace::ras, sformOffset);
  Affine plain;
  for (int axis = 0; axis < 3; ++axis)
    plain.edges[axis] *= spacing[axis];
  return place(plain, FileSpace::unnamed, pixdimOffset);
}

Scaling parseScaling(const NiftiHeader& header) {
  const Scaling scaling{header.real(112, 176), header.real(116, 184)};
  // 0 means that nothing was meant; some writers leave NaN there.
  if (scaling.slope == 0.0 || !std::isfinite(scaling.slope) || !std::isfinite(scaling.intercept)) return {};
  return scaling;
}

/// Sizes of axes 1 to 5; those that are not there are 1.
std::array<int64_t, 5> parseSizes(const NiftiHeader& header) {
  const int64_t count = header.dim(0);
  if (count < 3 || count > 7) {
    header.fail(header.dimOffset(), fmt::format("expected 3 to 5 dimensions, found {}", count));
  }
  std::array<int64_t, 5> sizes{};
  for (size_t i = 0; i < 7; ++i) {
    const int64_t size = int64_t(i) < count ? header.dim(i + 1) : 1;
    if (i < 5) sizes[i] = size;
    if (size < 1 || size > kMaxDim || (i >= 5 && size != 1)) {
      header.fail(header.dimOffset(),
                  fmt::format("expected a size of axis {} in 1..{}, found {}", i + 1, i < 5 ? kMaxDim : 1, size));
    }
  }
  return sizes;
}

/// "a.hdr" and "a.hdr.gz" keep their values in "a.img", compressed or not.
std::string imageBeside(const std::string& path) {
  std::filesystem::path name(path);
  if (lowerCase(name.extension().string()) == ".gz") name.replace_extension();
  const bool upper = name.extension() == ".HDR";
  name.replace_extension(upper ? ".IMG" : ".img");
  for (const std::string& candidate : {name.string(), name.string() + ".gz"}) {
    if (std::filesystem::exists(candidate)) return candidate;
  }
  throw InputError(fmt::format("{}: the values should be in {}, which does not exist", path, name.string()));
}

}  // namespace

bool isNifti(const FileStart& start) {
  if (start.extension == ".nii") return true;
  if (start.bytes.size() < size_t(kSize1)) return false;
  const auto magicAt = [&](size_t offset, std::string_view magic) {
    for (size_t i = 0; i < magic.size(); ++i) {
      if (char(start.bytes[offset + i]) != magic[i]) return false;
    }
    return true;
  };
  return magicAt(344, "n+1") || magicAt(344, "ni1") || magicAt(4, "n+2") || magicAt(4, "ni2");
}

Payload readNiftiHeader(const FileStart& start, const VolumeOptions& options) {
  const NiftiHeader header(start);
  const size_t magicOffset = header.isSecond() ? 4 : 344;
  const std::string magic = header.text(magicOffset, 3);
  const char version = header.isSecond() ? '2' : '1';
  if (magic != std::string("n+") + version && magic != std::string("ni") + version) {
    header.fail(magicOffset, fmt::format("expected n+{0} or ni{0}, found {1}", version, inQuotes(magic)));
  }

  Payload payload;
  const std::array<int64_t, 5> sizes = parseSizes(header);
  payload.header.dims = glm::ivec3(int(sizes[0]), int(sizes[1]), int(sizes[2]));
  setStoredType(payload, parseType(header), parseScaling(header));
  payload.header.placement = parsePlacement(header);
  payload.byteOrder = header.order();
  payload.compressed = start.compressed;
  if (magic[1] == '+') {
    payload.files = {start.path};
  } else {
    payload.files = {imageBeside(start.path)};
    payload.compressed = readFileStart(payload.files[0]).compressed;
  }
  const size_t offsetOffset = header.isSecond() ? 168 : 108;
  const double offset = header.isSecond() ? double(header.at<int64_t>(168)) : double(header.at<float>(108));
  const double least = magic[1] == '+' ? double(header.size() + 4) : 0.0;
  const bool zeroMeansLeast = offset == 0.0;
  if (!zeroMeansLeast && (!(offset >= least) || offset > 1e15 || offset != std::floor(offset))) {
    header.fail(offsetOffset, fmt::format("expected values from byte {} on or later, found {}", least, offset));
  }
  payload.byteSkip = uint64_t(zeroMeansLeast ? least : offset);

  // All volumes of component 0 come first, then those of component 1.
  const size_t component = chooseComponent(numberedComponents(int(sizes[4])), options.component, start.path);
  const uint64_t frame = chooseFrame(options.frame, uint64_t(sizes[3]), start.path);
  limitToVolume(payload, component * uint64_t(sizes[3]) + frame, uint64_t(sizes[3]) * uint64_t(sizes[4]), start.path);
  return payload;
}

}  // namespace freevoxel
