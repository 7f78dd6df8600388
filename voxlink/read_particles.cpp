// CSV and NumPy arrays.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <map>
#include <memory>

#include "base/error.h"
#include "base/grid.h"
#include "base/image.h"
#include "volume/byte_source.h"
#include "volume/file_start.h"
#include "volume/numpy_array.h"
#include "volume/text_parsing.h"
#include "volume/whole_file.h"
#include "voxlink/raw_spheres.h"

namespace freevoxel {

namespace {

constexpr size_t kLargestFile = size_t(1) << 36;
constexpr uint64_t kMostSpheres = 0xfffffffeu;

/// Between commas, semicolons or tabs, the first of them that the line has, or else white space.
std::vector<std::string_view> fields(std::string_view line) {
  for (const char separator : {',', ';', '\t'}) {
    if (line.find(separator) == std::string_view::npos) continue;
    std::vector<std::string_view> parts;
    for (size_t start = 0; start <= line.size();) {
      const size_t end = std::min(line.find(separator, start), line.size());
      parts.push_back(trimmed(line.substr(start, end - start)));
      start = end + 1;
    }
    return parts;
  }
  return words(line);
}

/// Which field means what.
struct CsvColumns {
  size_t count = 0;
  std::array<size_t, 3> place{};
  std::optional<size_t> radius, material;
  std::optional<std::array<size_t, 3>> colour;
};

CsvColumns columnsByNumber(const TextLines& lines, size_t count) {
  CsvColumns columns{count, {0, 1, 2}};
  if (count != 3 && count != 4 && count != 5 && count != 7) {
    lines.fail(
        fmt::format("expected x,y,z or x,y,z,r or x,y,z,r,material or x,y,z,r,red,green,blue, found {} fields", count));
  }
  if (count > 3) columns.radius = 3;
  if (count == 5) columns.material = 4;
  if (count == 7) columns.colour = {4, 5, 6};
  return columns;
}

CsvColumns columnsByName(const TextLines& lines, const std::vector<std::string_view>& names) {
  std::map<std::string, size_t> places;
  for (size_t i = 0; i < names.size(); ++i) {
    std::string name = lowerCase(names[i]);
    std::erase(name, '"');
    places.emplace(name, i);
  }
  const auto find = [&](std::initializer_list<const char*> spellings) -> std::optional<size_t> {
    for (const char* spelling : spellings) {
      if (const auto found = places.find(spelling); found != places.end()) return found->second;
    }
    return std::nullopt;
  };
  const auto x = find({"x"}), y = find({"y"}), z = find({"z"});
  if (!x || !y || !z) lines.fail("expected names of columns with x, y and z, or numbers");
  CsvColumns columns{names.size(), {*x, *y, *z}};
  columns.radius = find({"r", "radius"});
  columns.material = find({"material"});
  const auto red = find({"red"}), green = find({"green"}), blue = find({"blue"});
  if (red && green && blue) columns.colour = {*red, *green, *blue};
  if (columns.material && columns.colour) lines.fail("expected either a material or red, green and blue, found both");
  return columns;
}

uint32_t colourOf(const TextLines& lines, const std::vector<std::string_view>& row, const CsvColumns& columns,
                  MaterialNames& names, Spheres& spheres) {
  std::array<int, 3> srgb{};
  for (size_t c = 0; c < 3; ++c) {
    const double value = lines.number(row[(*columns.colour)[c]], "a colour's channel");
    if (!(value >= 0.0 && value <= 1.0)) lines.fail(fmt::format("expected a channel from 0 to 1, found {}", value));
    srgb[c] = int(std::lround(255.0 * value));
  }
  const std::string name = fmt::format("#{:02x}{:02x}{:02x}", srgb[0], srgb[1], srgb[2]);
  return names.number(name, spheres, [&] {
    Material material;
    material.name = name;
    for (size_t c = 0; c < 3; ++c)
      material.linear[int(c)] = linearFromSrgb(float(srgb[c]) / 255.0f);
    return material;
  });
}

}  // namespace

RawSpheres readCsv(const std::string& path, const SphereOptions&) {
  const std::vector<std::byte> bytes = readWholeFile(path, kLargestFile);
  TextLines lines(asText(bytes), path);
  RawSpheres file;
  file.report.format = "CSV";
  Spheres& spheres = file.spheres;
  MaterialNames names;
  std::optional<CsvColumns> columns;
  while (lines.next()) {
    const std::string_view line = trimmed(lines.line());
    if (line.empty() || line.starts_with('#')) continue;
    const std::vector<std::string_view> row = fields(lines.line());
    if (!columns) {
      const bool named = !parseNumber<double>(row[0]);
      columns = named ? columnsByName(lines, row) : columnsByNumber(lines, row.size());
      if (named) continue;
    }
    if (row.size() != columns->count) {
      lines.fail(fmt::format("expected {} fields, found {}", columns->count, row.size()));
    }
    if (++file.report.fileSpheres > kMostSpheres) lines.fail("expected at most 2^32 - 2 spheres");
    glm::vec3 centre;
    for (size_t axis = 0; axis < 3; ++axis)
      centre[int(axis)] = float(lines.number(row[columns->place[axis]], "a place"));
    spheres.centres.push_back(centre);
    if (columns->radius) spheres.radii.push_back(float(lines.number(row[*columns->radius], "a radius")));
    uint32_t material = 0;
    if (columns->colour) {
      material = colourOf(lines, row, *columns, names, spheres);
    } else {
      const std::string name = columns->material ? std::string(row[*columns->material]) : std::string();
      if (columns->material && !lines.ended() && row.size() == *columns->material + 1) {
        lines.fail("expected an end of the line behind the material's name, which may be cut off");
      }
      material = names.number(name, spheres, [&] {
        Material made;
        made.name = name;
        return made;
      });
    }
    spheres.materialOfSphere.push_back(material);
  }
  return file;
}

RawSpheres readNumpySpheres(const std::string& path, const SphereOptions&) {
  const FileStart start = readFileStart(path);
  if (!start.startsWith("\x93NUMPY")) throw InputError(fmt::format("{}: offset 0: expected a NumPy array", path));
  const NumpyTable table = readNumpyTable(start);
  const auto fail = [&](const std::string& what) {
    throw InputError(fmt::format("{}: offset {}: {}", path, table.bytesBefore, what));
  };
  if (table.columns != 3 && table.columns != 4) {
    fail(fmt::format("expected rows of 3 (x, y, z) or 4 (and r), found {}", table.columns));
  }
  const ValueType type = keptType(table.type);
  if (table.type != StoredType::f32 && table.type != StoredType::f64 && table.type != StoredType::f16) {
    fail("expected floating point numbers");
  }
  const uint64_t valueBytes = bytesPerValue(table.type);
  const std::optional<uint64_t> values = checkedProduct(table.rows, table.columns);
  const std::optional<uint64_t> bytes = checkedProduct(values.value_or(UINT64_MAX), valueBytes);
  const auto source = start.compressed ? openInflated(path, 0) : openPlain(path, 0);
  std::vector<std::byte> before(table.bytesBefore);
  if (source->read(before) != before.size()) fail("the header is cut off");
  if (!bytes || table.rows > kMostSpheres || *bytes > source->atMost()) {
    fail(fmt::format("expected {} rows of {} values, found at most {} bytes", table.rows, table.columns,
                     source->atMost()));
  }
  std::vector<std::byte> stored(*bytes);
  if (const size_t got = source->read(stored); got != stored.size()) {
    fail(fmt::format("expected {} bytes of values, found {}", stored.size(), got));
  }
  std::byte more{};
  if (source->read(std::span(&more, 1)) != 0) fail(fmt::format("expected {} bytes of values, found more", *bytes));
  std::vector<std::byte> converted(*values * bytesPerValue(type));
  convertValues(stored, table.type, table.byteOrder, {}, {}, type, converted);
  const auto value = [&](uint64_t row, uint64_t column) {
    const uint64_t at = table.columnsFirst ? column * table.rows + row : row * table.columns + column;
    if (type == ValueType::f32) {
      float number;
      std::memcpy(&number, converted.data() + at * sizeof number, sizeof number);
      return number;
    }
    double number;
    std::memcpy(&number, converted.data() + at * sizeof number, sizeof number);
    return float(number);
  };
  RawSpheres file;
  file.report.format = "NPY";
  file.report.fileSpheres = table.rows;
  file.spheres.materials.emplace_back();
  file.spheres.materialOfSphere.assign(table.rows, 0);
  for (uint64_t row = 0; row < table.rows; ++row) {
    file.spheres.centres.emplace_back(value(row, 0), value(row, 1), value(row, 2));
    if (table.columns == 4) file.spheres.radii.push_back(value(row, 3));
  }
  return file;
}

}  // namespace freevoxel
