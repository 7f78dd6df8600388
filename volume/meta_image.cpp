#include "volume/meta_image.h"

#include <algorithm>
#include <array>

#include "base/error.h"
#include "base/mapped_file.h"
#include "volume/component.h"
#include "volume/file_pattern.h"
#include "volume/header_reading.h"
#include "volume/text_parsing.h"
#include "volume/world_space.h"

namespace freevoxel {

namespace {

struct MetaHeader : HeaderFields {
  uint64_t end = 0;  ///< byte after the line ElementDataFile, which is the last
};

MetaHeader splitHeader(const std::string& path, std::string_view content) {
  MetaHeader header;
  header.path = path;
  int line = 0;
  for (size_t next = 0; next < content.size();) {
    const size_t end = std::min(content.find('\n', next), content.size());
    const std::string_view text = content.substr(next, end - next);
    next = std::min(end + 1, content.size());
    ++line;
    if (trimmed(text).empty()) continue;
    size_t separator = text.find('=');
    if (separator == std::string_view::npos) separator = text.find(':');
    if (separator == std::string_view::npos) {
      header.fail(line, "expected 'key = value', found " + inQuotes(text));
    }
    const std::string name = lowerCase(trimmed(text.substr(0, separator)));
    const HeaderField field{line, trimmed(text.substr(separator + 1))};
    if (const auto [earlier, isNew] = header.fields.emplace(name, field); !isNew) {
      header.fail(
          line, fmt::format("key {} is given a second time (first in line {})", inQuotes(name), earlier->second.line));
    }
    if (name == "elementdatafile") {
      header.end = next;
      return header;
    }
  }
  throw InputError(fmt::format("{}: the header has no key 'ElementDataFile'", path));
}

bool isTrue(const MetaHeader& header, std::initializer_list<const char*> names, bool otherwise) {
  const HeaderField* field = header.findAny(names);
  if (field == nullptr) return otherwise;
  const std::string text = lowerCase(field->text);
  if (text == "true" || text == "1" || text == "t") return true;
  if (text == "false" || text == "0" || text == "f") return false;
  header.fail(field->line, "expected True or False, found " + inQuotes(field->text));
}

StoredType elementType(const MetaHeader& header) {
  static const std::map<std::string, StoredType> kTypes{
      {"met_char", StoredType::i8},    {"met_uchar", StoredType::u8},      {"met_short", StoredType::i16},
      {"met_ushort", StoredType::u16}, {"met_int", StoredType::i32},       {"met_uint", StoredType::u32},
      {"met_long", StoredType::i32},   {"met_ulong", StoredType::u32},     {"met_float", StoredType::f32},
      {"met_double", StoredType::f64}, {"met_long_long", StoredType::i64}, {"met_ulong_long", StoredType::u64},
  };
  const HeaderField& field = header.need("elementtype");
  std::string name = lowerCase(field.text);
  if (name.ends_with("_array")) name.resize(name.size() - 6);
  const auto found = kTypes.find(name);
  if (found == kTypes.end())
    header.fail(field.line, "expected MET_UCHAR, MET_SHORT, MET_FLOAT or another, found " + inQuotes(field.text));
  return found->second;
}

int parseCount(const MetaHeader& header, const HeaderField& field, int low, int high) {
  const std::optional<int> count = parseNumber<int>(field.text);
  if (!count || *count < low || *count > high) {
    header.fail(field.line, fmt::format("expected a number in {}..{}, found {}", low, high, inQuotes(field.text)));
  }
  return *count;
}

/// A field that holds a number per dimension, or a square of them, cut to the first three.
std::vector<double> firstThree(const MetaHeader& header, const HeaderField& field, size_t dimensions, bool square) {
  const std::vector<double> all = header.numbers(field, square ? dimensions * dimensions : dimensions);
  std::vector<double> values;
  for (size_t row = 0; row < (square ? 3u : 1u); ++row) {
    for (size_t i = 0; i < 3; ++i)
      values.push_back(all[row * dimensions + i]);
  }
  return values;
}

Placement parsePlacement(const MetaHeader& header, size_t dimensions) {
  glm::dvec3 spacing(1.0), origin(0.0);
  int line = 1;
  if (const HeaderField* field = header.findAny({"elementspacing", "elementsize"})) {
    const std::vector<double> values = firstThree(header, *field, dimensions, false);
    for (int axis = 0; axis < 3; ++axis) {
      spacing[axis] = values[size_t(axis)];
      if (!(spacing[axis] > 0.0)) {
        header.fail(field->line, fmt::format("expected a positive spacing, found {}", spacing[axis]));
      }
    }
    line = field->line;
  }
  if (const HeaderField* field = header.findAny({"offset", "position", "origin"})) {
    const std::vector<double> values = firstThree(header, *field, dimensions, false);
    origin = {values[0], values[1], values[2]};
  }
  const HeaderField* matrix = header.findAny({"transformmatrix", "orientation", "rotation"});
  glm::dmat3 edges(1.0);
  if (matrix != nullptr) {
    // Row after row, each the direction of one axis of the array.
    const std::vector<double> values = firstThree(header, *matrix, dimensions, true);
    for (int i = 0; i < 9; ++i)
      edges[i / 3][i % 3] = values[size_t(i)];
    line = matrix->line;
  }
  const std::string where = fmt::format("{}: line {}", header.path, line);
  // The directions are meant to be unit vectors; their lengths are not part of the spacing.
  Placement placement = placeInWorld(edges, origin, matrix != nullptr ? FileSpace::lps : FileSpace::unnamed, where);
  placement.spacing = spacing;
  return placement;
}

/// "name%03d.raw min max step", or nothing.
std::optional<std::vector<std::string>> patternFiles(const MetaHeader& header, const HeaderField& field) {
  const std::vector<std::string_view> parts = words(field.text);
  if (parts.size() < 3 || parts.size() > 4 || !isPattern(parts[0])) return std::nullopt;
  std::array<int64_t, 3> numbers{0, 0, 1};
  for (size_t i = 0; i + 1 < parts.size(); ++i) {
    const std::optional<int> number = parseNumber<int>(parts[i + 1]);
    if (!number) return std::nullopt;
    numbers[i] = *number;
  }
  const auto [first, last, step] = numbers;
  if (step < 1 || last < first) {
    header.fail(field.line, fmt::format("expected numbers that lead from {} to {}, found step {}", first, last, step));
  }
  std::vector<std::string> files;
  const std::string where = fmt::format("{}: line {}", header.path, field.line);
  for (int64_t i = first; i <= last; i += step)
    files.push_back(besideHeader(header.path, *expandPattern(parts[0], int(i)), where));
  return files;
}

std::vector<std::string> listedFiles(const MetaHeader& header, std::string_view content) {
  std::vector<std::string> files;
  int line = header.need("elementdatafile").line;
  for (size_t next = header.end; next < content.size();) {
    const size_t end = std::min(content.find('\n', next), content.size());
    const std::string_view name = trimmed(content.substr(next, end - next));
    next = end + 1;
    ++line;
    if (!name.empty()) files.push_back(besideHeader(header.path, name, fmt::format("{}: line {}", header.path, line)));
  }
  return files;
}

void findFiles(const MetaHeader& header, std::string_view content, Payload& payload) {
  const HeaderField& field = header.need("elementdatafile");
  const std::string name = lowerCase(field.text);
  if (field.text.empty()) header.fail(field.line, "expected LOCAL, LIST or the name of a file");
  if (name == "local") {
    payload.files = {header.path};
    payload.start = header.end;
  } else if (name == "list" || name.starts_with("list ")) {
    payload.files = listedFiles(header, content);
  } else if (auto files = patternFiles(header, field)) {
    payload.files = *files;
  } else {
    payload.files = {besideHeader(header.path, field.text, fmt::format("{}: line {}", header.path, field.line))};
  }
  if (payload.files.empty() || size_t(payload.header.dims.z) % payload.files.size() != 0) {
    header.fail(field.line, fmt::format("expected data files that share {} slices evenly, found {}",
                                        payload.header.dims.z, payload.files.size()));
  }
}

void parseHeaderSize(const MetaHeader& header, Payload& payload) {
  const HeaderField* field = header.find("headersize");
  if (field == nullptr) return;
  const bool local = lowerCase(header.need("elementdatafile").text) == "local";
  if (field->text == "-1") {
    if (payload.compressed || payload.text) header.fail(field->line, "HeaderSize -1 is for raw values only");
    payload.atEnd = true;
    return;
  }
  const std::optional<uint64_t> bytes = parseNumber<uint64_t>(field->text);
  if (!bytes) header.fail(field->line, "expected a number of bytes or -1, found " + inQuotes(field->text));
  if (!local) payload.start = *bytes;
}

}  // namespace

bool isMetaImage(const FileStart& start) {
  return start.startsWith("ObjectType") || start.startsWith("NDims") || start.extension == ".mha" ||
         start.extension == ".mhd";
}

Payload readMetaImageHeader(const FileStart& start, const VolumeOptions& options) {
  if (start.compressed) {
    throw InputError(fmt::format(
        "{}: the MetaImage file is compressed as a whole; gunzip it (inside the file, CompressedData is read)",
        start.path));
  }
  const MappedFile file(start.path);
  const std::string_view content(reinterpret_cast<const char*>(file.bytes().data()), file.bytes().size());
  const MetaHeader header = splitHeader(start.path, content);
  if (const HeaderField* type = header.find("objecttype"); type != nullptr && lowerCase(type->text) != "image") {
    header.fail(type->line, "expected ObjectType = Image, found " + inQuotes(type->text));
  }

  Payload payload;
  const HeaderField& dimensions = header.need("ndims");
  const int count = parseCount(header, dimensions, 3, 4);
  const HeaderField& sizes = header.need("dimsize");
  const std::vector<std::string_view> parts = words(sizes.text);
  if (parts.size() != size_t(count)) {
    header.fail(sizes.line, fmt::format("expected {} sizes, found {}", count, inQuotes(sizes.text)));
  }
  const size_t three = size_t(parts[2].data() + parts[2].size() - sizes.text.data());
  payload.header.dims = header.sizes({sizes.line, sizes.text.substr(0, three)});
  setStoredType(payload, elementType(header));
  payload.header.placement = parsePlacement(header, size_t(count));
  payload.text = !isTrue(header, {"binarydata"}, true);
  payload.compressed = isTrue(header, {"compresseddata"}, false);
  const bool bigEndian = isTrue(header, {"binarydatabyteordermsb", "elementbyteordermsb"}, false);
  payload.byteOrder = bigEndian ? ByteOrder::big : ByteOrder::little;
  if (const HeaderField* channels = header.find("elementnumberofchannels")) {
    payload.interleaved.count = parseCount(header, *channels, 1, 1000);
  }
  payload.interleaved.chosen =
      int(chooseComponent(numberedComponents(payload.interleaved.count), options.component, start.path));
  if (payload.text) payload.stored.reset();
  findFiles(header, content, payload);
  parseHeaderSize(header, payload);
  const std::string where = fmt::format("{}: line {}", header.path, sizes.line);
  int frames = 1;
  if (count == 4) frames = parseCount(header, {sizes.line, parts[3]}, 1, kMaxDim);
  if (frames > 1 && (payload.files.size() > 1 || payload.atEnd || payload.text)) {
    header.fail(sizes.line, "several volumes are read from one binary file only");
  }
  limitToVolume(payload, chooseFrame(options.frame, uint64_t(frames), where), uint64_t(frames), where);
  return payload;
}

}  // namespace freevoxel
