#include <gdcmAttribute.h>
#include <gdcmImage.h>
#include <gdcmImageHelper.h>
#include <gdcmImageReader.h>
#include <gdcmReader.h>
#include <gdcmStringFilter.h>
#include <gdcmTrace.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <glm/glm.hpp>
#include <limits>

#include "base/error.h"
#include "base/mapped_file.h"
#include "volume/component.h"
#include "volume/header_reading.h"
#include "volume/slice_sink.h"
#include "volume/stored_values.h"
#include "volume/text_parsing.h"
#include "volume/world_space.h"

namespace freevoxel {

namespace {

/// What of a file has to be known before its pixels are read.
struct Slice {
  std::string path, series;
  glm::ivec3 dims{0};
  StoredType stored = StoredType::u8;
  int bitsStored = 8;
  Scaling scaling;
  bool isPlaced = false;  ///< the file says where it lies
  glm::dvec3 position{0.0};
  glm::dvec3 right{1.0, 0.0, 0.0}, down{0.0, 1.0, 0.0};  ///< unit vectors along a row, along a column
  glm::dvec3 spacing{1.0};                               ///< along a row, along a column, of frames
};

const gdcm::Tag kSeries(0x0020, 0x000e), kPosition(0x0020, 0x0032), kOrientation(0x0020, 0x0037);

std::string textOf(const gdcm::DataSet& data, const gdcm::Tag& tag) {
  if (!data.FindDataElement(tag)) return {};
  const gdcm::ByteValue* value = data.GetDataElement(tag).GetByteValue();
  if (value == nullptr) return {};
  std::string text(value->GetPointer(), value->GetLength());
  text.erase(std::find(text.begin(), text.end(), '\0'), text.end());
  return std::string(trimmed(text));
}

StoredType storedTypeOf(const std::string& path, const gdcm::PixelFormat& format) {
  switch (gdcm::PixelFormat::ScalarType(format)) {
    case gdcm::PixelFormat::UINT8:
      return StoredType::u8;
    case gdcm::PixelFormat::INT8:
      return StoredType::i8;
    case gdcm::PixelFormat::UINT12:
    case gdcm::PixelFormat::UINT16:
      return StoredType::u16;
    case gdcm::PixelFormat::INT12:
    case gdcm::PixelFormat::INT16:
      return StoredType::i16;
    case gdcm::PixelFormat::UINT32:
      return StoredType::u32;
    case gdcm::PixelFormat::INT32:
      return StoredType::i32;
    case gdcm::PixelFormat::FLOAT32:
      return StoredType::f32;
    case gdcm::PixelFormat::FLOAT64:
      return StoredType::f64;
    default:
      throw InputError(
          fmt::format("{}: expected pixels of plain numbers, found {}", path, format.GetScalarTypeAsString()));
  }
}

/// GDCM takes the rest of a truncated file for zeros. Where the pixels of `bytes` or, compressed, of unknown length lie
/// is found by their tag; a deflated file hides them and is checked by its inflation.
void checkPixelsComplete(const std::string& path, uint64_t bytes) {
  const MappedFile file(path);
  const std::string_view content(reinterpret_cast<const char*>(file.bytes().data()), file.bytes().size());
  for (const ByteOrder order : {ByteOrder::little, ByteOrder::big}) {
    const std::string_view tag =
        order == ByteOrder::little ? std::string_view("\xe0\x7f\x10\x00", 4) : std::string_view("\x7f\xe0\x00\x10", 4);
    const std::string_view end("\xfe\xff\xdd\xe0", 4);
    for (size_t at = content.find(tag); at != std::string_view::npos; at = content.find(tag, at + 1)) {
      const bool isExplicit = content.substr(at + 4, 2) == "OW" || content.substr(at + 4, 2) == "OB";
      const size_t length = at + (isExplicit ? 8 : 4);
      if (content.size() < length + 4) continue;
      const auto found = numberAt<uint32_t>(file.bytes(), length, order);
      // Behind the mark of the end stands its length, 0.
      const size_t mark = content.rfind(end);
      const bool complete = found == UINT32_MAX
                                ? mark != std::string_view::npos && mark > at && content.size() - mark >= 8
                                : content.size() - length - 4 >= found;
      if (complete) continue;
      if (found == UINT32_MAX || found == bytes || found == bytes + 1) {
        throw InputError(fmt::format("{}: cut short: expected {} bytes of pixels from byte {} on, found {}", path,
                                     bytes, length + 4, content.size() - length - 4));
      }
    }
  }
}

/// Pixels that are not packed fill the size that the header says, but for a byte to make it even. GDCM fills up with
/// zeros or leaves out.
void checkPixelBytes(const std::string& path, const gdcm::DataSet& data, const gdcm::PixelFormat& format,
                     glm::ivec3 dims) {
  const gdcm::Tag tag(0x7fe0, 0x0010);
  if (!data.FindDataElement(tag) || format.GetBitsAllocated() % 8 != 0 || !validDims(dims)) return;
  const gdcm::ByteValue* value = data.GetDataElement(tag).GetByteValue();
  if (value == nullptr) return;  // packed: fragments
  const uint64_t expected = voxelCount(dims) * (format.GetBitsAllocated() / 8u), found = value->GetLength();
  if (found == expected || found == expected + expected % 2) return;
  throw InputError(fmt::format("{}: expected {} bytes of pixels ({} x {} x {} of {} bits), found {}", path, expected,
                               dims.x, dims.y, dims.z, format.GetBitsAllocated(), found));
}

/// PixelSpacing as it stands: GDCM takes 0 for 1.
void checkPixelSpacing(const std::string& path, const gdcm::DataSet& data) {
  std::string text = textOf(data, gdcm::Tag(0x0028, 0x0030));
  std::replace(text.begin(), text.end(), '\\', ' ');
  for (const std::string_view word : words(text)) {
    if (parseNumber<double>(word).value_or(NAN) > 0.0) continue;
    throw InputError(fmt::format("{}: expected a positive pixel spacing, found {}", path, inQuotes(text)));
  }
}

/// ImageOrientationPatient as it stands: GDCM mends it in silence.
void checkOrientation(const std::string& path, const gdcm::DataSet& data) {
  std::string text = textOf(data, kOrientation);
  if (text.empty()) return;
  std::replace(text.begin(), text.end(), '\\', ' ');
  std::vector<double> v;
  for (const std::string_view word : words(text))
    v.push_back(parseNumber<double>(word).value_or(NAN));
  v.resize(6, NAN);
  const glm::dvec3 right(v[0], v[1], v[2]), down(v[3], v[4], v[5]);
  const double area = glm::length(glm::cross(right, down));
  if (std::abs(area - 1.0) < 0.01 && std::abs(glm::length(right) - 1.0) < 0.01) return;
  throw InputError(fmt::format("{}: expected ImageOrientationPatient to hold two perpendicular unit vectors, found {}",
                               path, inQuotes(text)));
}

/// Reads one file, pixels included: GDCM can tell neither size nor placement of every kind of file without.
Slice readFile(const std::string& path, gdcm::ImageReader& reader) {
  reader.SetFileName(path.c_str());
  if (!reader.Read()) throw InputError(fmt::format("{}: damaged, cut short, or no DICOM image", path));
  const gdcm::Image& image = reader.GetImage();
  const gdcm::DataSet& data = reader.GetFile().GetDataSet();
  if (image.GetPixelFormat().GetSamplesPerPixel() != 1 ||
      image.GetPhotometricInterpretation() == gdcm::PhotometricInterpretation::PALETTE_COLOR) {
    throw InputError(
        fmt::format("{}: expected a grey picture, found {}", path, image.GetPhotometricInterpretation().GetString()));
  }
  Slice slice;
  slice.path = path;
  slice.series = textOf(data, kSeries);
  slice.stored = storedTypeOf(path, image.GetPixelFormat());
  slice.bitsStored = image.GetPixelFormat().GetBitsStored();
  slice.scaling = {image.GetSlope(), image.GetIntercept()};
  const unsigned* dims = image.GetDimensions();
  slice.dims = {int(dims[0]), int(dims[1]), image.GetNumberOfDimensions() > 2 ? int(dims[2]) : 1};
  slice.isPlaced = slice.dims.z > 1 || (!textOf(data, kPosition).empty() && !textOf(data, kOrientation).empty());
  for (int i = 0; i < 3; ++i) {
    slice.position[i] = image.GetOrigin(unsigned(i));
    slice.right[i] = image.GetDirectionCosines(unsigned(i));
    slice.down[i] = image.GetDirectionCosines(unsigned(3 + i));
    slice.spacing[i] = image.GetSpacing(unsigned(i));
  }
  for (int i = 0; i < 2; ++i) {
    if (!(slice.spacing[i] > 0.0) || !std::isfinite(slice.spacing[i])) {
      throw InputError(fmt::format("{}: expected a positive pixel spacing, found {}", path, slice.spacing[i]));
    }
  }
  checkOrientation(path, data);
  checkPixelSpacing(path, data);
  checkPixelBytes(path, data, image.GetPixelFormat(), slice.dims);
  if (validDims(slice.dims)) checkPixelsComplete(path, voxelCount(slice.dims) * bytesPerValue(slice.stored));
  return slice;
}

glm::dvec3 normalOf(const Slice& slice) {
  return glm::normalize(glm::cross(slice.right, slice.down));
}

[[noreturn]] void failMixed(const std::string& folder, const Slice& a, const Slice& b, const std::string& how) {
  throw InputError(
      fmt::format("{}: mixed series: {} and {} {}; keep one series in a folder", folder, a.path, b.path, how));
}

void checkAlike(const std::string& folder, const std::vector<Slice>& slices) {
  const Slice& first = slices[0];
  for (const Slice& slice : slices) {
    if (slice.series != first.series) failMixed(folder, first, slice, "belong to different series");
    if (slice.dims != first.dims) failMixed(folder, first, slice, "have different sizes");
    if (slice.stored != first.stored) failMixed(folder, first, slice, "have different types of values");
    if (glm::distance(slice.right, first.right) > 1e-3 || glm::distance(slice.down, first.down) > 1e-3) {
      failMixed(folder, first, slice, "lie in different directions");
    }
    if (glm::distance(glm::dvec2(slice.spacing), glm::dvec2(first.spacing)) > 1e-4 * first.spacing.x) {
      failMixed(folder, first, slice, "have different pixel spacings");
    }
    if (slices.size() > 1 && !slice.isPlaced) {
      throw InputError(fmt::format("{}: says nothing of where it lies (ImagePositionPatient)", slice.path));
    }
    if (slices.size() > 1 && slice.dims.z > 1) {
      throw InputError(fmt::format("{}: holds {} frames; a folder of such files is not read, name one file", slice.path,
                                   slice.dims.z));
    }
  }
}

/// Orders slices along their normal; the edge from one to the next.
glm::dvec3 sortByPosition(const std::string& folder, std::vector<Slice>& slices) {
  const glm::dvec3 normal = normalOf(slices[0]);
  const auto along = [&](const Slice& slice) { return glm::dot(slice.position, normal); };
  std::sort(slices.begin(), slices.end(), [&](const Slice& a, const Slice& b) { return along(a) < along(b); });
  const glm::dvec3 edge = (slices.back().position - slices.front().position) / double(slices.size() - 1);
  std::vector<double> gaps;
  for (size_t i = 1; i < slices.size(); ++i)
    gaps.push_back(along(slices[i]) - along(slices[i - 1]));
  std::vector<double> sorted = gaps;
  std::nth_element(sorted.begin(), sorted.begin() + ptrdiff_t(sorted.size() / 2), sorted.end());
  const double usual = sorted[sorted.size() / 2];
  for (size_t i = 0; i < gaps.size(); ++i) {
    if (gaps[i] < 1e-4 * slices[0].spacing.x) {
      throw InputError(fmt::format("{}: {} and {} lie in one place; keep one volume in a folder", folder,
                                   slices[i].path, slices[i + 1].path));
    }
    if (std::abs(gaps[i] - usual) > 0.05 * usual) {
      throw InputError(fmt::format("{}: slices are missing: they lie {:.6g} mm apart, but {} and {} {:.6g} mm", folder,
                                   usual, slices[i].path, slices[i + 1].path, gaps[i]));
    }
  }
  for (size_t i = 0; i < slices.size(); ++i) {
    const double off = glm::distance(slices[i].position, slices[0].position + edge * double(i));
    if (off > 0.1 * usual + 0.05) {
      throw InputError(fmt::format("{}: {} lies {:.3g} mm off the line of the others", folder, slices[i].path, off));
    }
  }
  return edge;
}

/// How values of a series are kept: as stored, or rescaled to whole numbers wide enough for them, or to floats.
struct Kept {
  ValueType type;
  bool whole = false;  ///< slope and intercept are whole numbers, and do something
};

Kept chooseType(const std::vector<Slice>& slices) {
  const Slice& first = slices[0];
  const bool alike = std::all_of(slices.begin(), slices.end(), [&](const Slice& slice) {
    return slice.scaling.slope == first.scaling.slope && slice.scaling.intercept == first.scaling.intercept;
  });
  const double slope = first.scaling.slope, intercept = first.scaling.intercept;
  if (alike && first.scaling.isNone()) return {keptType(first.stored)};
  const bool integral = !isFloatingPoint(keptType(first.stored)) && bytesPerValue(first.stored) <= 2;
  if (!alike || !integral || slope != std::floor(slope) || intercept != std::floor(intercept)) {
    return {ValueType::f32};
  }
  const bool isSigned = first.stored == StoredType::i8 || first.stored == StoredType::i16;
  const double largest = std::ldexp(1.0, isSigned ? first.bitsStored - 1 : first.bitsStored) - 1.0;
  const double least = isSigned ? -largest - 1.0 : 0.0;
  const double a = slope * least + intercept, b = slope * largest + intercept;
  const bool fits = std::min(a, b) >= -32768.0 && std::max(a, b) <= 32767.0;
  return {fits ? ValueType::i16 : ValueType::i32, true};
}

/// Values of a slice as they are kept.
std::vector<std::byte> rescaled(std::span<const std::byte> stored, const Slice& slice, Kept kept) {
  const size_t count = stored.size() / bytesPerValue(slice.stored);
  std::vector<std::byte> out(count * bytesPerValue(kept.type));
  if (kept.type == keptType(slice.stored) && !kept.whole && slice.scaling.isNone()) {
    std::copy(stored.begin(), stored.end(), out.begin());
    return out;
  }
  Volume whole;  // for its reading of values
  whole.header.type = keptType(slice.stored);
  whole.data.assign(stored.begin(), stored.end());
  const auto store = [&](size_t i, auto number) { std::memcpy(&out[sizeof number * i], &number, sizeof number); };
  for (size_t i = 0; i < count; ++i) {
    const double value = slice.scaling.slope * whole.value(i) + slice.scaling.intercept;
    if (kept.type == ValueType::i16) {
      store(i, int16_t(std::clamp(value, -32768.0, 32767.0)));  // bits beyond those stored may go beyond
    } else if (kept.type == ValueType::i32) {
      store(i, int32_t(value));
    } else {
      store(i, float(value));
    }
  }
  return out;
}

std::vector<std::byte> pixels(const gdcm::Image& image, const Slice& slice) {
  const uint64_t expected = voxelCount(slice.dims) * bytesPerValue(slice.stored);
  const unsigned long found = image.GetBufferLength();
  if (found != expected) {
    throw InputError(fmt::format("{}: expected {} bytes of pixels ({} x {} x {}), found {}", slice.path, expected,
                                 slice.dims.x, slice.dims.y, slice.dims.z, found));
  }
  std::vector<std::byte> bytes(expected);
  if (!image.GetBuffer(reinterpret_cast<char*>(bytes.data()))) {
    throw InputError(fmt::format("{}: damaged or cut short: its pixels cannot be decoded", slice.path));
  }
  return bytes;
}

}  // namespace

void readDicom(const LibraryRequest& request, SliceSink& sink) {
  gdcm::Trace::DebugOff();
  gdcm::Trace::WarningOff();
  // Slices as long as their thickness says would be wrong; positions tell.
  std::vector<Slice> slices;
  for (const std::string& path : request.files) {
    gdcm::ImageReader reader;
    slices.push_back(readFile(path, reader));
    if (!validDims(slices.back().dims)) throw InputError(fmt::format("{}: has no pixels", path));
  }
  chooseComponent(numberedComponents(1), request.component, request.path);
  checkAlike(request.path, slices);
  const Slice first = slices[0];
  glm::dvec3 edge = normalOf(first) * (first.spacing.z > 0.0 ? first.spacing.z : 1.0);
  if (slices.size() > 1) edge = sortByPosition(request.path, slices);

  VolumeHeader header;
  header.dims = {first.dims.x, first.dims.y, slices.size() > 1 ? int(slices.size()) : first.dims.z};
  const Kept kept = chooseType(slices);
  header.type = kept.type;
  header.placement =
      placeInWorld(glm::dmat3(first.right * first.spacing.x, first.down * first.spacing.y, edge), slices[0].position,
                   first.isPlaced ? FileSpace::lps : FileSpace::unnamed, request.path);
  sink.header(header);
  for (const Slice& slice : slices) {
    gdcm::ImageReader reader;
    readFile(slice.path, reader);
    sink.values(rescaled(pixels(reader.GetImage(), slice), slice, kept));
  }
}

}  // namespace freevoxel
