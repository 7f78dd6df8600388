#include "volume/nrrd.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <glm/glm.hpp>
#include <map>
#include <optional>
#include <string_view>
#include <utility>

#include "base/error.h"
#include "base/mapped_file.h"
#include "volume/component.h"
#include "volume/file_pattern.h"
#include "volume/text_parsing.h"
#include "volume/world_space.h"

namespace freevoxel {

namespace {

struct Field {
  int line = 0;
  std::string_view text;
};

/// The fields by name, lower case and without spaces ("data file" and "datafile" are one).
struct HeaderText {
  std::string path;
  std::map<std::string, Field> fields;
  std::vector<Field> listedFiles;     ///< lines after `data file: LIST`
  std::optional<uint64_t> blankLine;  ///< byte after the blank line that ends the header

  [[noreturn]] void fail(int line, const std::string& what) const {
    throw InputError(fmt::format("{}: line {}: {}", path, line, what));
  }
  const Field* find(const std::string& name) const {
    const auto found = fields.find(name);
    return found == fields.end() ? nullptr : &found->second;
  }
  const Field& need(const std::string& name) const {
    if (const Field* field = find(name)) return *field;
    throw InputError(fmt::format("{}: the header has no field '{}'", path, name));
  }
};

bool isList(std::string_view text) {
  const std::vector<std::string_view> parts = words(text);
  return !parts.empty() && parts[0] == "LIST";
}

std::string fieldName(std::string_view text) {
  std::string name = lowerCase(trimmed(text));
  std::erase_if(name, [](char c) { return c == ' ' || c == '\t'; });
  if (name == "centerings") name = "centers";
  return name;
}

HeaderText splitHeader(const std::string& path, std::string_view content) {
  HeaderText header;
  header.path = path;
  bool listing = false;
  int line = 0;
  for (size_t next = 0; next < content.size();) {
    const size_t first = next;
    const size_t end = std::min(content.find('\n', first), content.size());
    next = std::min(end + 1, content.size());
    std::string_view text = content.substr(first, end - first);
    if (!text.empty() && text.back() == '\r') text.remove_suffix(1);
    ++line;
    if (listing) {
      if (const std::string_view name = trimmed(text); !name.empty()) header.listedFiles.push_back({line, name});
      continue;
    }
    if (line == 1 || text.starts_with('#')) continue;
    if (text.empty()) {
      if (end < content.size()) header.blankLine = next;
      break;
    }
    const size_t colon = text.find(':');
    if (colon == std::string_view::npos) {
      header.fail(line, "expected 'field: value', 'key:=value' or '# comment', found " + inQuotes(text));
    }
    if (text.substr(colon, 2) == ":=") continue;
    const Field field{line, trimmed(text.substr(colon + 1))};
    const std::string name = fieldName(text.substr(0, colon));
    if (const auto [earlier, isNew] = header.fields.emplace(name, field); !isNew) {
      header.fail(line, fmt::format("field {} is given a second time (first in line {})", inQuotes(name),
                                    earlier->second.line));
    }
    listing = name == "datafile" && isList(field.text);
  }
  return header;
}

void checkMagic(const FileStart& start) {
  if (!start.startsWith("NRRD")) {
    throw InputError(fmt::format("{}: line 1: expected NRRD0001 to NRRD0005", start.path));
  }
  std::string magic;
  for (size_t i = 0; i < std::min<size_t>(start.bytes.size(), 9); ++i)
    magic += char(start.bytes[i]);
  const std::string version = magic.substr(0, 8);
  const bool known = version.starts_with("NRRD000") && version.size() == 8 && version[7] >= '1' && version[7] <= '5';
  if (!known || magic.size() < 9 || (magic[8] != '\n' && magic[8] != '\r')) {
    throw InputError(
        fmt::format("{}: line 1: expected NRRD0001 to NRRD0005, found {}", start.path, inQuotes(trimmed(magic))));
  }
}

StoredType parseType(const HeaderText& header) {
  static const std::map<std::string_view, StoredType> kTypes{
      {"signed char", StoredType::i8},
      {"int8", StoredType::i8},
      {"int8_t", StoredType::i8},
      {"uchar", StoredType::u8},
      {"unsigned char", StoredType::u8},
      {"uint8", StoredType::u8},
      {"uint8_t", StoredType::u8},
      {"short", StoredType::i16},
      {"short int", StoredType::i16},
      {"signed short", StoredType::i16},
      {"signed short int", StoredType::i16},
      {"int16", StoredType::i16},
      {"int16_t", StoredType::i16},
      {"ushort", StoredType::u16},
      {"unsigned short", StoredType::u16},
      {"unsigned short int", StoredType::u16},
      {"uint16", StoredType::u16},
      {"uint16_t", StoredType::u16},
      {"int", StoredType::i32},
      {"signed int", StoredType::i32},
      {"int32", StoredType::i32},
      {"int32_t", StoredType::i32},
      {"uint", StoredType::u32},
      {"unsigned int", StoredType::u32},
      {"uint32", StoredType::u32},
      {"uint32_t", StoredType::u32},
      {"float", StoredType::f32},
      {"double", StoredType::f64},
      {"longlong", StoredType::i64},
      {"long long", StoredType::i64},
      {"long long int", StoredType::i64},
      {"signed long long", StoredType::i64},
      {"signed long long int", StoredType::i64},
      {"int64", StoredType::i64},
      {"int64_t", StoredType::i64},
      {"ulonglong", StoredType::u64},
      {"unsigned long long", StoredType::u64},
      {"unsigned long long int", StoredType::u64},
      {"uint64", StoredType::u64},
      {"uint64_t", StoredType::u64},
  };
  const Field& field = header.need("type");
  const std::string text = lowerCase(field.text);
  std::string name;
  for (const std::string_view word : words(text))
    name += fmt::format("{}{}", name.empty() ? "" : " ", word);
  const auto found = kTypes.find(name);
  if (found == kTypes.end()) {
    header.fail(field.line, "expected a type of plain numbers, found " + inQuotes(field.text));
  }
  return found->second;
}

/// Which axes of the file are those of the volume. Files of four axes have one more: several values side by side for
/// each voxel (axis 0), or several volumes one after the other (axis 3).
struct Axes {
  size_t count = 3;
  size_t first = 0;             ///< the volume's axes are first, first + 1, first + 2
  std::optional<size_t> other;  ///< 0 or 3
};

/// The axis that is not one of space, as `space directions`, or else `kinds`, or else its size tell.
std::optional<size_t> findOtherAxis(const HeaderText& header, const std::vector<std::string_view>& sizes) {
  if (const Field* field = header.find("spacedirections")) {
    const std::string text = lowerCase(field->text);
    if (text.starts_with("none")) return 0;
    if (text.ends_with("none")) return 3;
  }
  if (const Field* field = header.find("kinds")) {
    const std::vector<std::string_view> kinds = words(field->text);
    for (const size_t axis : {size_t(0), size_t(3)}) {
      const std::string kind = kinds.size() == 4 ? lowerCase(kinds[axis]) : "none";
      if (kind != "domain" && kind != "space" && kind != "???" && kind != "none") return axis;
    }
  }
  if (sizes[0] == "1") return 0;
  if (sizes[3] == "1") return 3;
  constexpr int kMostComponents = 9;  // a 3 x 3 tensor
  if (parseNumber<int>(sizes[0]).value_or(0) <= kMostComponents) return 0;
  return std::nullopt;
}

Axes parseAxes(const HeaderText& header) {
  const Field& dimension = header.need("dimension");
  Axes axes;
  if (dimension.text == "3") return axes;
  if (dimension.text != "4") {
    header.fail(dimension.line, fmt::format("expected dimension 3 or 4, found {}", inQuotes(dimension.text)));
  }
  const Field& sizes = header.need("sizes");
  if (words(sizes.text).size() != 4) {
    header.fail(sizes.line, fmt::format("expected 4 sizes, found {}", inQuotes(sizes.text)));
  }
  axes.count = 4;
  axes.other = findOtherAxis(header, words(sizes.text));
  if (!axes.other) {
    header.fail(dimension.line, "expected a field 'kinds' that says which of the four axes are not of space");
  }
  axes.first = *axes.other == 0 ? 1 : 0;
  return axes;
}

int parseSize(const HeaderText& header, const Field& field, std::string_view text) {
  const std::optional<int> size = parseNumber<int>(text);
  if (!size || *size < 1 || *size > kMaxDim) {
    header.fail(field.line, fmt::format("expected a size in 1..{}, found {}", kMaxDim, inQuotes(text)));
  }
  return *size;
}

glm::ivec3 parseSizes(const HeaderText& header, const Axes& axes) {
  const Field& field = header.need("sizes");
  const std::vector<std::string_view> sizes = words(field.text);
  if (sizes.size() != axes.count) {
    header.fail(field.line, fmt::format("expected {} sizes, found {}", axes.count, inQuotes(field.text)));
  }
  glm::ivec3 dims;
  for (size_t axis = 0; axis < 3; ++axis)
    dims[int(axis)] = parseSize(header, field, sizes[axes.first + axis]);
  return dims;
}

enum class Encoding { raw, gzip, text };

Encoding parseEncoding(const HeaderText& header) {
  const Field& field = header.need("encoding");
  const std::string encoding = lowerCase(field.text);
  if (encoding == "raw") return Encoding::raw;
  if (encoding == "gzip" || encoding == "gz") return Encoding::gzip;
  if (encoding == "ascii" || encoding == "text" || encoding == "txt") return Encoding::text;
  header.fail(field.line, fmt::format("expected encoding raw, gzip or ascii, found {}", inQuotes(field.text)));
}

ByteOrder parseByteOrder(const HeaderText& header, StoredType type, Encoding encoding) {
  const Field* field = header.find("endian");
  if (field == nullptr) {
    if (bytesPerValue(type) == 1 || encoding == Encoding::text) return ByteOrder::little;
    throw InputError(fmt::format("{}: the header has no field 'endian', which values of {} bytes need", header.path,
                                 bytesPerValue(type)));
  }
  const std::string order = lowerCase(field->text);
  if (order == "little") return ByteOrder::little;
  if (order == "big") return ByteOrder::big;
  header.fail(field->line, fmt::format("expected endian little or big, found {}", inQuotes(field->text)));
}

/// One number per axis of space; NaN stands for unknown.
std::optional<glm::dvec3> parsePerAxis(const HeaderText& header, const Axes& axes, const std::string& name) {
  const Field* field = header.find(name);
  if (field == nullptr) return std::nullopt;
  const std::vector<std::string_view> numbers = words(field->text);
  if (numbers.size() != axes.count) {
    header.fail(field->line, fmt::format("expected {} numbers, found {}", axes.count, inQuotes(field->text)));
  }
  glm::dvec3 result;
  for (size_t axis = 0; axis < 3; ++axis) {
    const std::string_view text = numbers[axes.first + axis];
    const std::optional<double> number = parseNumber<double>(lowerCase(text));
    if (!number || std::isinf(*number)) {
      header.fail(field->line, fmt::format("expected a finite number or NaN, found {}", inQuotes(text)));
    }
    result[int(axis)] = *number;
  }
  return result;
}

/// `count` vectors "(x,y,z)", blanks allowed anywhere.
std::vector<glm::dvec3> parseVectors(const HeaderText& header, const Field& field, size_t count) {
  std::vector<glm::dvec3> vectors;
  std::string_view rest = trimmed(field.text);
  while (!rest.empty()) {
    const size_t end = rest.find(')');
    if (rest[0] != '(' || end == std::string_view::npos) {
      header.fail(field.line, fmt::format("expected {} of the form (x,y,z), found {}",
                                          count == 1 ? "a vector" : "three vectors", inQuotes(rest)));
    }
    std::string numbers(rest.substr(1, end - 1));
    const auto commas = std::count(numbers.begin(), numbers.end(), ',');
    std::replace(numbers.begin(), numbers.end(), ',', ' ');
    const std::vector<std::string_view> parts = words(numbers);
    glm::dvec3 vector(NAN);
    for (size_t i = 0; i < 3 && parts.size() == 3 && commas == 2; ++i) {
      vector[int(i)] = parseNumber<double>(lowerCase(parts[i])).value_or(NAN);
    }
    if (!std::isfinite(vector.x) || !std::isfinite(vector.y) || !std::isfinite(vector.z)) {
      header.fail(field.line,
                  fmt::format("expected three finite numbers (x,y,z), found {}", inQuotes(rest.substr(0, end + 1))));
    }
    vectors.push_back(vector);
    rest = trimmed(rest.substr(end + 1));
  }
  if (vectors.size() != count) {
    header.fail(field.line, fmt::format("expected {} vectors, found {}", count, vectors.size()));
  }
  return vectors;
}

FileSpace parseSpace(const HeaderText& header) {
  static const std::map<std::string, FileSpace> kSpaces{
      {"right-anterior-superior", FileSpace::ras}, {"ras", FileSpace::ras},
      {"left-anterior-superior", FileSpace::las},  {"las", FileSpace::las},
      {"left-posterior-superior", FileSpace::lps}, {"lps", FileSpace::lps},
      {"scanner-xyz", FileSpace::unnamed},         {"3d-right-handed", FileSpace::unnamed},
      {"3d-left-handed", FileSpace::leftHanded},
  };
  if (const Field* dimension = header.find("spacedimension"); dimension != nullptr && dimension->text != "3") {
    header.fail(dimension->line, fmt::format("expected space dimension 3, found {}", inQuotes(dimension->text)));
  }
  const Field* space = header.find("space");
  if (space == nullptr) return FileSpace::unnamed;
  const auto found = kSpaces.find(lowerCase(space->text));
  if (found == kSpaces.end()) {
    header.fail(space->line,
                fmt::format("expected the name of a three-dimensional space, found {}", inQuotes(space->text)));
  }
  return found->second;
}

/// Position of the first voxel's centre and distance to the next along an axis that is only known by its ends.
void placeByAxisEnds(const HeaderText& header, const Axes& axes, glm::ivec3 dims, bool haveSpacings,
                     Placement& placement) {
  const glm::dvec3 mins = parsePerAxis(header, axes, "axismins").value_or(glm::dvec3(NAN));
  const glm::dvec3 maxs = parsePerAxis(header, axes, "axismaxs").value_or(glm::dvec3(NAN));
  std::vector<std::string_view> centers;
  if (const Field* field = header.find("centers")) centers = words(field->text);
  for (int axis = 0; axis < 3; ++axis) {
    // Ends are those of cells unless said otherwise, as in teem.
    const bool node = centers.size() == axes.count && lowerCase(centers[axes.first + size_t(axis)]) == "node";
    if (std::isnan(mins[axis])) continue;
    const int steps = node ? dims[axis] - 1 : dims[axis];
    if (!haveSpacings && maxs[axis] > mins[axis] && steps > 0)
      placement.spacing[axis] = (maxs[axis] - mins[axis]) / steps;
    placement.origin[axis] = mins[axis] + (node ? 0.0 : 0.5 * placement.spacing[axis]);
  }
}

Placement parseDirections(const HeaderText& header, const Field& field, FileSpace space, const Axes& axes) {
  std::string_view text = trimmed(field.text);
  if (axes.other && lowerCase(text).starts_with("none")) text = trimmed(text.substr(4));
  if (axes.other && lowerCase(text).ends_with("none")) text = trimmed(text.substr(0, text.size() - 4));
  const std::vector<glm::dvec3> directions = parseVectors(header, {field.line, text}, 3);
  const Field* originField = header.find("spaceorigin");
  const glm::dvec3 origin = originField ? parseVectors(header, *originField, 1)[0] : glm::dvec3(0.0);
  return placeInWorld(glm::dmat3(directions[0], directions[1], directions[2]), origin, space,
                      fmt::format("{}: line {}", header.path, field.line));
}

Placement parsePlacement(const HeaderText& header, const Axes& axes, glm::ivec3 dims) {
  const FileSpace space = parseSpace(header);
  const std::optional<glm::dvec3> spacings = parsePerAxis(header, axes, "spacings");
  if (const Field* field = header.find("spacedirections")) return parseDirections(header, *field, space, axes);
  Placement placement;
  for (int axis = 0; spacings && axis < 3; ++axis) {
    if (std::isnan((*spacings)[axis])) continue;
    if ((*spacings)[axis] <= 0.0) {
      header.fail(header.need("spacings").line,
                  fmt::format("expected a positive spacing, found {}", (*spacings)[axis]));
    }
    placement.spacing[axis] = (*spacings)[axis];
  }
  if (const Field* field = header.find("spaceorigin")) {
    placement.origin = parseVectors(header, *field, 1)[0];
  } else {
    placeByAxisEnds(header, axes, dims, spacings.has_value(), placement);
  }
  return placement;
}

/// How many files hold a volume if each holds the first `subdim` axes, or nothing if any number may do.
std::optional<uint64_t> expectedFiles(glm::ivec3 dims, int subdim) {
  if (subdim == 3) return std::nullopt;
  return subdim == 2 ? uint64_t(dims.z) : uint64_t(dims.y) * uint64_t(dims.z);
}

int parseSubdim(const HeaderText& header, const Field& field, std::string_view text) {
  const int subdim = parseNumber<int>(text).value_or(0);
  if (subdim < 1 || subdim > 3) {
    header.fail(field.line, fmt::format("expected 1, 2 or 3 axes per data file, found {}", inQuotes(text)));
  }
  return subdim;
}

void checkFileCount(const HeaderText& header, const Field& field, uint64_t count, glm::ivec3 dims, int subdim) {
  const std::optional<uint64_t> expected = expectedFiles(dims, subdim);
  if (expected ? count == *expected : count > 0 && uint64_t(dims.z) % count == 0) return;
  header.fail(field.line,
              expected ? fmt::format("expected {} data files, found {}", *expected, count)
                       : fmt::format("expected data files that share {} slices evenly, found {}", dims.z, count));
}

std::string besideHeader(const HeaderText& header, std::string_view name) {
  return (std::filesystem::path(header.path).parent_path() / std::filesystem::path(name)).lexically_normal().string();
}

/// `pattern min max step [subdim]`, or nothing if the field is a plain file name.
std::optional<std::vector<std::string>> patternFiles(const HeaderText& header, const Field& field, glm::ivec3 dims) {
  const std::vector<std::string_view> parts = words(field.text);
  if (parts.size() < 4 || parts.size() > 5 || parts[0].find('%') == std::string_view::npos) return std::nullopt;
  std::array<int64_t, 3> numbers{};
  for (size_t i = 0; i < 3; ++i) {
    const std::optional<int> number = parseNumber<int>(parts[i + 1]);
    if (!number) return std::nullopt;
    numbers[i] = *number;
  }
  const auto [first, last, step] = numbers;
  const int subdim = parts.size() == 5 ? parseSubdim(header, field, parts[4]) : 2;
  if (step == 0 || (last - first) / step < 0 || (step > 0) != (last >= first)) {
    header.fail(field.line, fmt::format("expected numbers that lead from {} to {}, found step {}", first, last, step));
  }
  const auto count = uint64_t((last - first) / step + 1);
  checkFileCount(header, field, count, dims, subdim);
  std::vector<std::string> files;
  for (uint64_t i = 0; i < count; ++i) {
    const std::optional<std::string> name = expandPattern(parts[0], int(first + int64_t(i) * step));
    if (!name) header.fail(field.line, fmt::format("expected one %d in the file names, found {}", inQuotes(parts[0])));
    files.push_back(besideHeader(header, *name));
    // A header may claim millions of files: stop at the first that is not there.
    if (!std::filesystem::exists(files.back()))
      header.fail(field.line, "data file " + files.back() + " does not exist");
  }
  return files;
}

std::vector<std::string> listedFiles(const HeaderText& header, const Field& field, glm::ivec3 dims) {
  const std::vector<std::string_view> parts = words(field.text);
  if (parts.size() > 2) header.fail(field.line, "expected LIST or LIST with a number, found " + inQuotes(field.text));
  const int subdim = parts.size() == 2 ? parseSubdim(header, field, parts[1]) : 2;
  checkFileCount(header, field, header.listedFiles.size(), dims, subdim);
  std::vector<std::string> files;
  for (const Field& listed : header.listedFiles) {
    files.push_back(besideHeader(header, listed.text));
    if (!std::filesystem::exists(files.back()))
      header.fail(listed.line, "data file " + files.back() + " does not exist");
  }
  return files;
}

std::vector<std::string> dataFiles(const HeaderText& header, const Field& field, glm::ivec3 dims) {
  if (isList(field.text)) return listedFiles(header, field, dims);
  if (auto files = patternFiles(header, field, dims)) return *files;
  if (field.text.empty()) header.fail(field.line, "expected the name of a data file");
  const std::string file = besideHeader(header, field.text);
  if (!std::filesystem::exists(file)) header.fail(field.line, "data file " + file + " does not exist");
  return {file};
}

void parseSkips(const HeaderText& header, Payload& payload) {
  if (const Field* field = header.find("lineskip")) {
    const std::optional<uint64_t> lines = parseNumber<uint64_t>(field->text);
    if (!lines) header.fail(field->line, "expected a number of lines, found " + inQuotes(field->text));
    payload.lineSkip = *lines;
  }
  const Field* field = header.find("byteskip");
  if (field == nullptr) return;
  if (field->text == "-1") {
    if (payload.compressed || payload.text) header.fail(field->line, "byte skip -1 is for encoding raw only");
    payload.atEnd = true;
    return;
  }
  const std::optional<uint64_t> bytes = parseNumber<uint64_t>(field->text);
  if (!bytes) header.fail(field->line, "expected a number of bytes or -1, found " + inQuotes(field->text));
  payload.byteSkip = *bytes;
}

/// What options say of the fourth axis; that there is none of it where the file has three.
void chooseFromOtherAxis(const HeaderText& header, const Axes& axes, const VolumeOptions& options, Payload& payload) {
  const Field& field = header.need("sizes");
  const int count = axes.other ? parseSize(header, field, words(field.text)[*axes.other]) : 1;
  const bool components = axes.other == std::optional<size_t>(0);
  const size_t component = chooseComponent(numberedComponents(components ? count : 1), options.component, header.path);
  const uint64_t frame = chooseFrame(options.frame, components ? 1 : uint64_t(count), header.path);
  if (components) payload.interleaved = {count, int(component)};
  if (components || count == 1) return;
  if (payload.files.size() > 1 || payload.atEnd || payload.text) {
    header.fail(field.line, "several volumes are read from one binary file only");
  }
  limitToVolume(payload, frame, uint64_t(count), header.path);
}

}  // namespace

bool isNrrd(const FileStart& start) {
  return start.startsWith("NRRD") || start.extension == ".nrrd" || start.extension == ".nhdr";
}

Payload readNrrdHeader(const FileStart& start, const VolumeOptions& options) {
  if (start.compressed) {
    throw InputError(
        fmt::format("{}: the NRRD file is compressed as a whole; gunzip it (inside the file, 'encoding: gzip' is read)",
                    start.path));
  }
  checkMagic(start);
  const MappedFile file(start.path);
  const std::string_view content(reinterpret_cast<const char*>(file.bytes().data()), file.bytes().size());
  const HeaderText header = splitHeader(start.path, content);

  Payload payload;
  const StoredType type = parseType(header);
  const Axes axes = parseAxes(header);
  payload.header.dims = parseSizes(header, axes);
  const Encoding encoding = parseEncoding(header);
  payload.header.placement = parsePlacement(header, axes, payload.header.dims);
  payload.compressed = encoding == Encoding::gzip;
  payload.text = encoding == Encoding::text;
  payload.byteOrder = parseByteOrder(header, type, encoding);
  setStoredType(payload, type);
  if (payload.text) payload.stored.reset();
  parseSkips(header, payload);
  if (const Field* field = header.find("datafile")) {
    payload.files = dataFiles(header, *field, payload.header.dims);
  } else if (header.blankLine) {
    payload.files = {start.path};
    payload.start = *header.blankLine;
  } else {
    throw InputError(
        fmt::format("{}: the header ends without a blank line (values follow) or a field 'data file'", start.path));
  }
  chooseFromOtherAxis(header, axes, options, payload);
  return payload;
}

}  // namespace freevoxel
