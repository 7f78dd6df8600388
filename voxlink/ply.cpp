#include "voxlink/ply.h"

#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <optional>

#include "base/error.h"
#include "base/grid.h"
#include "base/image.h"
#include "volume/stored_values.h"
#include "volume/text_parsing.h"
#include "volume/text_values.h"

namespace freevoxel {

namespace {

enum class Encoding { ascii, little, big };
enum class Number { i8, u8, i16, u16, i32, u32, f32, f64 };

struct Property {
  std::string name;
  Number type = Number::f32;
  std::optional<Number> countType;  ///< of a list
};

struct Element {
  std::string name;
  uint64_t count = 0;
  std::vector<Property> properties;

  std::optional<size_t> find(std::string_view property) const {
    for (size_t i = 0; i < properties.size(); ++i) {
      if (properties[i].name == property) return i;
    }
    return std::nullopt;
  }
};

size_t bytesOf(Number type) {
  constexpr std::array<size_t, 8> kBytes{1, 1, 2, 2, 4, 4, 4, 8};
  return kBytes[size_t(type)];
}

std::optional<Number> numberNamed(std::string_view name) {
  constexpr std::array<std::string_view, 8> kOld{"char", "uchar", "short", "ushort", "int", "uint", "float", "double"};
  constexpr std::array<std::string_view, 8> kNew{"int8",  "uint8",  "int16",   "uint16",
                                                 "int32", "uint32", "float32", "float64"};
  for (size_t i = 0; i < kOld.size(); ++i) {
    if (name == kOld[i] || name == kNew[i]) return Number(i);
  }
  return std::nullopt;
}

template <class T>
T fromBytes(const char* bytes, bool swapped) {
  std::array<char, sizeof(T)> raw;
  for (size_t i = 0; i < sizeof(T); ++i)
    raw[i] = bytes[swapped ? sizeof(T) - 1 - i : i];
  return std::bit_cast<T>(raw);
}

/// Goes through the file: first its header by lines, then its values in order.
class PlyText {
 public:
  PlyText(std::string_view bytes, std::string path) : rest_(bytes), size_(bytes.size()), path_(std::move(path)) {}

  [[noreturn]] void fail(const std::string& what) const {
    if (encoding_ == Encoding::ascii) throw InputError(fmt::format("{}: line {}: {}", path_, line_, what));
    throw InputError(fmt::format("{}: offset {}: {}", path_, size_ - rest_.size(), what));
  }

  /// The next line without its end. Throws InputError at the end of the file.
  std::string_view headerLine() {
    ++line_;
    const size_t end = rest_.find('\n');
    if (end == std::string_view::npos) fail("expected a header that ends with 'end_header', found the end of the file");
    const std::string_view line = trimmed(rest_.substr(0, end));
    rest_.remove_prefix(end + 1);
    return line;
  }
  void startValues(Encoding encoding) {
    encoding_ = encoding;
    ++line_;
  }

  double next(Number type, const char* what) {
    if (encoding_ == Encoding::ascii) return nextWord(what);
    const size_t bytes = bytesOf(type);
    if (rest_.size() < bytes) failEnd(what);
    const char* at = rest_.data();
    rest_.remove_prefix(bytes);
    const bool swapped = (encoding_ == Encoding::little) != (std::endian::native == std::endian::little);
    switch (type) {
      case Number::i8:
        return fromBytes<int8_t>(at, swapped);
      case Number::u8:
        return fromBytes<uint8_t>(at, swapped);
      case Number::i16:
        return fromBytes<int16_t>(at, swapped);
      case Number::u16:
        return fromBytes<uint16_t>(at, swapped);
      case Number::i32:
        return fromBytes<int32_t>(at, swapped);
      case Number::u32:
        return fromBytes<uint32_t>(at, swapped);
      case Number::f32:
        return double(fromBytes<float>(at, swapped));
      case Number::f64:
        return fromBytes<double>(at, swapped);
    }
    throw InternalError("internal error: no such number in a PLY file");
  }

  /// A whole number in 0..most.
  uint32_t nextWhole(Number type, const char* what, uint32_t most) {
    const double value = next(type, what);
    if (!(value >= 0.0 && value <= double(most)) || value != std::floor(value)) {
      fail(fmt::format("expected {}, a whole number from 0 to {}, found {}", what, most, value));
    }
    return uint32_t(value);
  }

  /// Throws InputError if so many values cannot be left.
  void checkRoom(const Element& element) const {
    uint64_t least = 0;
    for (const Property& property : element.properties)
      least += encoding_ == Encoding::ascii ? 2 : bytesOf(property.countType.value_or(property.type));
    const std::optional<uint64_t> bytes = checkedProduct(element.count, least);
    if (!bytes || *bytes > uint64_t(rest_.size())) {
      fail(fmt::format("expected {} elements '{}' of at least {} bytes each, found {} bytes", element.count,
                       element.name, least, rest_.size()));
    }
  }

  void checkEnd() {
    const std::string_view left = trimmed(rest_);
    if (!left.empty()) fail(fmt::format("expected the end of the file, found {} more bytes", rest_.size()));
  }

 private:
  [[noreturn]] void failEnd(const char* what) const {
    fail(fmt::format("expected {}, found the end of the file", what));
  }

  double nextWord(const char* what) {
    size_t at = 0;
    for (; at < rest_.size() && std::isspace(uint8_t(rest_[at])) != 0; ++at)
      line_ += rest_[at] == '\n';
    rest_.remove_prefix(at);
    if (rest_.empty()) failEnd(what);
    size_t end = 0;
    while (end < rest_.size() && std::isspace(uint8_t(rest_[end])) == 0)
      ++end;
    const std::string_view word = rest_.substr(0, end);
    const std::optional<double> number = parseNumber<double>(word);
    if (!number) fail(fmt::format("expected {}, found {}", what, inQuotes(word)));
    if (end == rest_.size()) fail(endsInNumber(word));
    rest_.remove_prefix(end);
    return *number;
  }

  std::string_view rest_;
  size_t size_;
  std::string path_;
  int line_ = 0;
  Encoding encoding_ = Encoding::ascii;
};

Property parseProperty(const PlyText& text, const std::vector<std::string_view>& line) {
  Property property;
  const bool list = line.size() == 5 && line[1] == "list";
  if (!list && line.size() != 3) text.fail("expected 'property TYPE NAME' or 'property list TYPE TYPE NAME'");
  const auto type = [&](std::string_view word) {
    const std::optional<Number> number = numberNamed(word);
    if (!number) text.fail("expected a type such as float or uchar, found " + inQuotes(word));
    return *number;
  };
  if (list) property.countType = type(line[2]);
  property.type = type(line[list ? 3 : 1]);
  property.name = line.back();
  return property;
}

std::vector<Element> readHeader(PlyText& text) {
  if (text.headerLine() != "ply") text.fail("expected 'ply'");
  std::vector<Element> elements;
  std::optional<Encoding> encoding;
  for (;;) {
    const std::vector<std::string_view> line = words(text.headerLine());
    if (line.empty() || line[0] == "comment" || line[0] == "obj_info") continue;
    if (line[0] == "end_header") break;
    if (line[0] == "format" && line.size() == 3) {
      if (line[1] == "ascii") encoding = Encoding::ascii;
      if (line[1] == "binary_little_endian") encoding = Encoding::little;
      if (line[1] == "binary_big_endian") encoding = Encoding::big;
      if (!encoding || line[2] != "1.0") text.fail("expected format ascii or binary_..._endian 1.0");
    } else if (line[0] == "element" && line.size() == 3) {
      const std::optional<uint64_t> count = parseNumber<uint64_t>(line[2]);
      if (!count) text.fail("expected a number of elements, found " + inQuotes(line[2]));
      elements.push_back({std::string(line[1]), *count, {}});
    } else if (line[0] == "property" && !elements.empty()) {
      elements.back().properties.push_back(parseProperty(text, line));
    } else {
      text.fail("expected format, element, property, comment or end_header, found " + inQuotes(line[0]));
    }
  }
  if (!encoding) text.fail("expected a line 'format', found none");
  text.startValues(*encoding);
  return elements;
}

void passOver(PlyText& text, const Property& property) {
  uint32_t count = 1;
  if (property.countType) count = text.nextWhole(*property.countType, "the length of a list", 0xffffffffu);
  for (uint32_t i = 0; i < count; ++i)
    text.next(property.type, "an element's value");
}

/// Where three properties of a vertex lie; nothing unless all are there and none is a list.
std::optional<std::array<size_t, 3>> findThree(const Element& vertex, std::array<const char*, 3> names) {
  std::array<size_t, 3> places{};
  for (size_t i = 0; i < 3; ++i) {
    const std::optional<size_t> place = vertex.find(names[i]);
    if (!place || vertex.properties[*place].countType) return std::nullopt;
    places[i] = *place;
  }
  return places;
}

void readVertices(PlyText& text, const Element& vertex, RawMesh& raw) {
  Mesh& mesh = raw.mesh;
  const auto position = findThree(vertex, {"x", "y", "z"});
  if (!position) text.fail("expected properties x, y and z of element vertex");
  if (vertex.count > 0xfffffffeu) text.fail(fmt::format("expected at most 2^32 - 2 vertices, found {}", vertex.count));
  const auto normal = findThree(vertex, {"nx", "ny", "nz"});
  const auto colour = findThree(vertex, {"red", "green", "blue"});
  glm::dvec3 colourSum(0.0);
  uint64_t coloured = 0;
  std::vector<double> values(vertex.properties.size());
  for (uint64_t i = 0; i < vertex.count; ++i) {
    for (size_t p = 0; p < values.size(); ++p) {
      if (vertex.properties[p].countType) {
        passOver(text, vertex.properties[p]);
      } else {
        values[p] = text.next(vertex.properties[p].type, "a vertex's value");
      }
    }
    const auto three = [&](const std::array<size_t, 3>& places) {
      return glm::dvec3(values[places[0]], values[places[1]], values[places[2]]);
    };
    mesh.positions.push_back(glm::vec3(three(*position)));
    if (normal) mesh.normals.push_back(glm::vec3(three(*normal)));
    if (!colour) continue;
    const Number type = vertex.properties[(*colour)[0]].type;
    const double largest = type == Number::f32 || type == Number::f64 ? 1.0 : type == Number::u16 ? 65535.0 : 255.0;
    const glm::dvec3 srgb = three(*colour) / largest;
    if (!(std::isfinite(srgb.x) && std::isfinite(srgb.y) && std::isfinite(srgb.z))) continue;
    for (int c = 0; c < 3; ++c)
      colourSum[c] += double(linearFromSrgb(float(srgb[c])));
    ++coloured;
  }
  raw.report.fileVertices = vertex.count;
  if (coloured > 0) {
    mesh.materials[0].linear = glm::vec3(colourSum / double(coloured));
    raw.report.notes.push_back("colours of vertices: the mean of all");
  }
}

void readFaces(PlyText& text, const Element& face, RawMesh& raw) {
  std::optional<size_t> corners = face.find("vertex_indices");
  if (!corners) corners = face.find("vertex_index");
  if (!corners || !face.properties[*corners].countType) text.fail("expected a list vertex_indices of element face");
  std::vector<uint32_t> polygon;
  for (uint64_t i = 0; i < face.count; ++i) {
    for (size_t p = 0; p < face.properties.size(); ++p) {
      const Property& property = face.properties[p];
      if (p != *corners) {
        passOver(text, property);
        continue;
      }
      const uint32_t count = text.nextWhole(*property.countType, "a face's number of corners", 0xffffffu);
      polygon.clear();
      for (uint32_t c = 0; c < count; ++c)
        polygon.push_back(text.nextWhole(property.type, "the number of a vertex", 0xfffffffeu));
      if (count < 3) {
        ++raw.report.linesAndPoints;
      } else {
        addFan(polygon, 0, raw.mesh);
      }
    }
  }
  raw.report.fileTriangles = raw.mesh.triangles.size();
}

}  // namespace

RawMesh readPly(std::string_view bytes, const std::string& path) {
  PlyText text(bytes, path);
  const std::vector<Element> elements = readHeader(text);
  RawMesh raw;
  raw.report.format = "PLY";
  raw.mesh.materials.emplace_back();
  for (const Element& element : elements) {
    text.checkRoom(element);
    if (element.name == "vertex" && raw.mesh.positions.empty()) {
      readVertices(text, element, raw);
    } else if (element.name == "face" && raw.mesh.triangles.empty()) {
      readFaces(text, element, raw);
    } else {
      for (uint64_t i = 0; element.properties.size() > 0 && i < element.count; ++i) {
        for (const Property& property : element.properties)
          passOver(text, property);
      }
    }
  }
  text.checkEnd();
  return raw;
}

}  // namespace freevoxel
