#include "volume/dat_header.h"

#include <algorithm>
#include <glm/glm.hpp>

#include "base/error.h"
#include "base/mapped_file.h"
#include "volume/component.h"
#include "volume/header_reading.h"
#include "volume/text_parsing.h"
#include "volume/world_space.h"

namespace freevoxel {

namespace {

HeaderFields splitHeader(const std::string& path, std::string_view content) {
  HeaderFields header;
  header.path = path;
  int line = 0;
  for (size_t next = 0; next < content.size();) {
    const size_t end = std::min(content.find('\n', next), content.size());
    const std::string_view text = trimmed(content.substr(next, end - next));
    next = end + 1;
    ++line;
    if (text.empty() || text.starts_with('#')) continue;
    const size_t colon = text.find_first_of(":=");
    if (colon == std::string_view::npos) header.fail(line, "expected 'Key: value', found " + inQuotes(text));
    const std::string name = lowerCase(trimmed(text.substr(0, colon)));
    const HeaderField field{line, trimmed(text.substr(colon + 1))};
    const auto [earlier, isNew] = header.fields.emplace(name, field);
    if (!isNew && (name == "objectfilename" || name == "rawfile")) {
      header.fail(line, "several data files (a time series) are not read; write a header for each");
    }
    if (!isNew) {
      header.fail(
          line, fmt::format("key {} is given a second time (first in line {})", inQuotes(name), earlier->second.line));
    }
  }
  return header;
}

StoredType parseFormat(const HeaderFields& header) {
  static const std::map<std::string, StoredType> kTypes{
      {"uchar", StoredType::u8},    {"char", StoredType::i8},     {"ushort", StoredType::u16},
      {"short", StoredType::i16},   {"uint", StoredType::u32},    {"int", StoredType::i32},
      {"float", StoredType::f32},   {"double", StoredType::f64},  {"ushort_12", StoredType::u16},
      {"uint8", StoredType::u8},    {"int8", StoredType::i8},     {"uint16", StoredType::u16},
      {"int16", StoredType::i16},   {"uint32", StoredType::u32},  {"int32", StoredType::i32},
      {"uint64", StoredType::u64},  {"int64", StoredType::i64},   {"float16", StoredType::f16},
      {"float32", StoredType::f32}, {"float64", StoredType::f64},
  };
  const HeaderField& field = header.need("format");
  const auto found = kTypes.find(lowerCase(field.text));
  if (found == kTypes.end()) {
    header.fail(field.line, "expected UCHAR, USHORT, FLOAT or another format, found " + inQuotes(field.text));
  }
  return found->second;
}

int parseChannels(const HeaderFields& header) {
  static const std::map<std::string, int> kModels{{"i", 1}, {"la", 2}, {"rg", 2}, {"rgb", 3}, {"rgba", 4}};
  const HeaderField* field = header.find("objectmodel");
  if (field == nullptr) return 1;
  const auto found = kModels.find(lowerCase(field->text));
  if (found == kModels.end()) header.fail(field->line, "expected I, LA, RGB or RGBA, found " + inQuotes(field->text));
  return found->second;
}

uint64_t parseBytes(const HeaderFields& header, const HeaderField* field) {
  if (field == nullptr) return 0;
  const std::optional<uint64_t> bytes = parseNumber<uint64_t>(field->text);
  if (!bytes) header.fail(field->line, "expected a number of bytes, found " + inQuotes(field->text));
  return *bytes;
}

ByteOrder parseOrder(const HeaderFields& header) {
  const HeaderField* field = header.findAny({"byteorder", "endianness"});
  if (field == nullptr) return ByteOrder::little;
  const std::string order = lowerCase(field->text);
  if (order == "littleendian" || order == "little") return ByteOrder::little;
  if (order == "bigendian" || order == "big") return ByteOrder::big;
  header.fail(field->line, "expected LittleEndian or BigEndian, found " + inQuotes(field->text));
}

/// Inviwo gives the three edges of the whole box and its lower corner; Voreen the distance of slices.
Placement parsePlacement(const HeaderFields& header, glm::ivec3 dims) {
  Placement placement;
  if (const HeaderField* field = header.findAny({"slicethickness", "spacing"}))
    placement.spacing = header.lengths(*field);
  const HeaderField* first = header.find("basisvector1");
  if (first == nullptr) return placement;
  glm::dmat3 edges;
  for (int axis = 0; axis < 3; ++axis) {
    const std::vector<double> v = header.numbers(header.need(fmt::format("basisvector{}", axis + 1)), 3);
    edges[axis] = glm::dvec3(v[0], v[1], v[2]) / double(dims[axis]);
  }
  glm::dvec3 corner = -0.5 * (edges * glm::dvec3(dims));  // Inviwo's default is a box round 0
  if (const HeaderField* offset = header.find("offset")) {
    const std::vector<double> v = header.numbers(*offset, 3);
    corner = {v[0], v[1], v[2]};
  }
  return placeInWorld(edges, corner + edges * glm::dvec3(0.5), FileSpace::unnamed,
                      fmt::format("{}: line {}", header.path, first->line));
}

}  // namespace

bool isDatHeader(const FileStart& start) {
  if (start.extension != ".dat") return false;
  // Many things are called .dat; this one is text and names a file.
  std::string text;
  for (const std::byte b : start.bytes)
    text += char(b);
  text = lowerCase(text);
  return text.find("objectfilename") != std::string::npos || text.find("rawfile") != std::string::npos;
}

Payload readDatHeader(const FileStart& start, const VolumeOptions& options) {
  const MappedFile file(start.path);
  const HeaderFields header =
      splitHeader(start.path, {reinterpret_cast<const char*>(file.bytes().data()), file.bytes().size()});
  if (const HeaderField* grid = header.find("gridtype"); grid != nullptr && lowerCase(grid->text) != "equidistant") {
    header.fail(grid->line, "expected GridType EQUIDISTANT, found " + inQuotes(grid->text));
  }
  Payload payload;
  payload.header.dims = header.sizes(header.findAny({"resolution", "dimensions"}) != nullptr
                                         ? *header.findAny({"resolution", "dimensions"})
                                         : header.need("resolution"));
  setStoredType(payload, parseFormat(header));
  payload.header.placement = parsePlacement(header, payload.header.dims);
  payload.byteOrder = parseOrder(header);
  payload.byteSkip = parseBytes(header, header.findAny({"byteoffset", "headerskip"}));
  payload.interleaved.count = parseChannels(header);
  payload.interleaved.chosen =
      int(chooseComponent(numberedComponents(payload.interleaved.count), options.component, start.path));
  chooseFrame(options.frame, 1, start.path);
  const HeaderField* name = header.findAny({"objectfilename", "rawfile"});
  if (name == nullptr) name = &header.need("objectfilename");
  if (name->text.empty()) header.fail(name->line, "expected the name of a data file");
  payload.files = {besideHeader(start.path, name->text, fmt::format("{}: line {}", start.path, name->line))};
  payload.compressed = readFileStart(payload.files[0]).compressed;
  return payload;
}

}  // namespace freevoxel
