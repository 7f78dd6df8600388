#include "volume/vtk_legacy.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "base/error.h"
#include "base/mapped_file.h"
#include "volume/component.h"
#include "volume/text_parsing.h"
#include "volume/text_values.h"

namespace freevoxel {

namespace {

constexpr std::string_view kWhiteSpace = " \t\r\n\v\f";

/// Goes through the file word by word.
class Cursor {
 public:
  Cursor(std::string path, std::string_view content) : path_(std::move(path)), content_(content) {}

  [[noreturn]] void fail(const std::string& what) const {
    throw InputError(fmt::format("{}: byte {}: {}", path_, wordStart_, what));
  }

  uint64_t offset() const { return at_; }
  uint64_t left() const { return content_.size() - at_; }
  void skipBytes(uint64_t count) { at_ += count; }

  /// Up to the end of the line, which is passed.
  std::string_view line() {
    wordStart_ = at_;
    const size_t end = std::min(content_.find('\n', at_), content_.size());
    const std::string_view text = content_.substr(at_, end - at_);
    at_ = std::min(end + 1, content_.size());
    return trimmed(text);
  }
  /// Empty at the end of the file.
  std::string_view word() {
    wordStart_ = std::min(content_.find_first_not_of(kWhiteSpace, at_), content_.size());
    at_ = std::min(content_.find_first_of(kWhiteSpace, wordStart_), content_.size());
    return content_.substr(wordStart_, at_ - wordStart_);
  }
  /// The next word without going there.
  std::string_view peek() const {
    const size_t first = std::min(content_.find_first_not_of(kWhiteSpace, at_), content_.size());
    return content_.substr(first, std::min(content_.find_first_of(kWhiteSpace, first), content_.size()) - first);
  }
  template <class T>
  T number(T low, T high) {
    const std::string_view text = word();
    const std::optional<T> value = parseNumber<T>(text);
    if (!value || !(*value >= low && *value <= high)) {
      fail(fmt::format("expected a number in {}..{}, found {}", low, high, inQuotes(text)));
    }
    return *value;
  }

 private:
  std::string path_;
  std::string_view content_;
  size_t at_ = 0;
  size_t wordStart_ = 0;
};

struct ArrayType {
  StoredType stored = StoredType::u8;
  bool isBit = false;  ///< packed; gone past, never read
};

struct Array {
  std::string name;
  bool isScalars = false;  ///< declared by SCALARS
  bool ofPoints = true;
  ArrayType type;
  int components = 1;
  uint64_t tuples = 0;
  uint64_t offset = 0;
};

struct VtkFile {
  bool binary = false;
  glm::ivec3 dims{0};
  glm::dvec3 spacing{1.0}, origin{0.0};
  std::vector<Array> arrays;
};

constexpr double kLargest = 1e300;

ArrayType parseType(Cursor& cursor) {
  static const std::map<std::string, StoredType> kTypes{
      {"unsigned_char", StoredType::u8},  {"char", StoredType::i8},          {"unsigned_short", StoredType::u16},
      {"short", StoredType::i16},         {"unsigned_int", StoredType::u32}, {"int", StoredType::i32},
      {"unsigned_long", StoredType::u64}, {"long", StoredType::i64},         {"float", StoredType::f32},
      {"double", StoredType::f64},        {"vtktypeint64", StoredType::i64}, {"vtktypeuint64", StoredType::u64},
      {"vtkidtype", StoredType::i32},     {"signed_char", StoredType::i8},
  };
  const std::string name = lowerCase(cursor.word());
  if (name == "bit") return {StoredType::u8, true};
  const auto found = kTypes.find(name);
  if (found == kTypes.end())
    cursor.fail("expected unsigned_char, short, float or another type, found " + inQuotes(name));
  return {found->second, false};
}

/// "%20" for a blank and the like.
std::string decodedName(std::string_view text) {
  std::string name;
  for (size_t i = 0; i < text.size(); ++i) {
    unsigned code = 0;
    const bool encoded = text[i] == '%' && i + 2 < text.size() &&
                         std::from_chars(text.data() + i + 1, text.data() + i + 3, code, 16).ptr == text.data() + i + 3;
    name += encoded ? char(code) : text[i];
    if (encoded) i += 2;
  }
  return name;
}

/// Goes past the values of an array, which begin after the line's end.
void passValues(Cursor& cursor, const VtkFile& file, Array& array) {
  const std::optional<uint64_t> count = checkedProduct(array.tuples, uint64_t(array.components));
  if (!count) cursor.fail(fmt::format("{} tuples of {} are more than 2^64 values", array.tuples, array.components));
  if (file.binary) {
    cursor.line();
    array.offset = cursor.offset();
    const std::optional<uint64_t> bytes = array.type.isBit ? std::optional(*count / 8 + (*count % 8 > 0 ? 1 : 0))
                                                           : checkedProduct(*count, bytesPerValue(array.type.stored));
    if (!bytes || *bytes > cursor.left()) {
      cursor.fail(fmt::format("array {}: expected {} values from byte {} on, found {} bytes", inQuotes(array.name),
                              *count, array.offset, cursor.left()));
    }
    cursor.skipBytes(*bytes);
    return;
  }
  array.offset = cursor.offset();
  // A blank and a digit each.
  if (*count > cursor.left() / 2) {
    cursor.fail(fmt::format("array {}: expected {} values from byte {} on, found {} bytes of text",
                            inQuotes(array.name), *count, array.offset, cursor.left()));
  }
  for (uint64_t i = 0; i < *count; ++i) {
    const std::string_view word = cursor.word();
    if (word.empty()) {
      cursor.fail(fmt::format("array {}: expected {} values, found {}", inQuotes(array.name), *count, i));
    }
    if (cursor.left() == 0) cursor.fail(fmt::format("array {}: {}", inQuotes(array.name), endsInNumber(word)));
  }
}

/// Lines up to an empty one.
void passMetadata(Cursor& cursor) {
  cursor.line();
  while (!cursor.line().empty()) {
  }
}

void parseFieldData(Cursor& cursor, VtkFile& file, bool keep, bool ofPoints) {
  cursor.word();  // its name
  const int count = cursor.number<int>(0, 100000);
  for (int i = 0; i < count; ++i) {
    Array array;
    while (cursor.peek() == "METADATA") {
      cursor.word();
      passMetadata(cursor);
    }
    array.name = decodedName(cursor.word());
    array.components = cursor.number<int>(0, 100000);
    array.tuples = cursor.number<uint64_t>(0, UINT64_MAX);
    array.type = parseType(cursor);
    array.ofPoints = ofPoints;
    passValues(cursor, file, array);
    if (keep && array.components > 0) file.arrays.push_back(array);
  }
}

/// What follows POINT_DATA or CELL_DATA; false if `keyword` is none of it.
bool parseAttribute(Cursor& cursor, const std::string& keyword, VtkFile& file, bool ofPoints, uint64_t tuples) {
  if (keyword == "FIELD") {
    parseFieldData(cursor, file, true, ofPoints);
    return true;
  }
  Array array;
  array.ofPoints = ofPoints;
  array.tuples = tuples;
  array.name = decodedName(cursor.word());
  if (keyword == "SCALARS") {
    array.isScalars = true;
    array.type = parseType(cursor);
    const std::optional<int> components = parseNumber<int>(cursor.peek());
    if (components && lowerCase(cursor.peek()) != "lookup_table") array.components = cursor.number<int>(1, 4);
    if (cursor.peek() == "LOOKUP_TABLE") {
      cursor.word();
      cursor.word();
    }
  } else if (keyword == "COLOR_SCALARS") {
    array.components = cursor.number<int>(1, 4);
    array.type.stored = file.binary ? StoredType::u8 : StoredType::f32;
  } else if (keyword == "LOOKUP_TABLE") {
    array.tuples = cursor.number<uint64_t>(0, 1 << 24);
    array.components = 4;
    array.type.stored = file.binary ? StoredType::u8 : StoredType::f32;
  } else if (keyword == "VECTORS" || keyword == "NORMALS") {
    array.components = 3;
    array.type = parseType(cursor);
  } else if (keyword == "TENSORS" || keyword == "TENSORS6") {
    array.components = keyword == "TENSORS" ? 9 : 6;
    array.type = parseType(cursor);
  } else if (keyword == "TEXTURE_COORDINATES") {
    array.components = cursor.number<int>(1, 3);
    array.type = parseType(cursor);
  } else if (keyword == "GLOBAL_IDS" || keyword == "PEDIGREE_IDS") {
    array.type = parseType(cursor);
  } else {
    return false;
  }
  passValues(cursor, file, array);
  if (keyword != "LOOKUP_TABLE") file.arrays.push_back(array);
  return true;
}

void parseStart(Cursor& cursor, VtkFile& file) {
  if (!cursor.line().starts_with("# vtk DataFile Version")) cursor.fail("expected '# vtk DataFile Version'");
  cursor.line();  // a title
  const std::string_view encoding = cursor.line();
  if (encoding != "ASCII" && encoding != "BINARY") cursor.fail("expected ASCII or BINARY, found " + inQuotes(encoding));
  file.binary = encoding == "BINARY";
  if (cursor.word() != "DATASET") cursor.fail("expected DATASET");
  const std::string_view kind = cursor.word();
  if (kind != "STRUCTURED_POINTS") {
    cursor.fail(fmt::format("expected DATASET STRUCTURED_POINTS (a regular grid), found {}", inQuotes(kind)));
  }
}

uint64_t expectedTuples(const VtkFile& file, bool ofPoints) {
  return ofPoints ? voxelCount(file.dims) : voxelCount(glm::max(file.dims - 1, glm::ivec3(1)));
}

VtkFile parseFile(Cursor& cursor) {
  VtkFile file;
  parseStart(cursor, file);
  bool inData = false, ofPoints = true;
  uint64_t tuples = 0;
  for (;;) {
    const std::string keyword(cursor.word());
    if (keyword.empty()) return file;
    if (keyword == "METADATA") {
      passMetadata(cursor);
    } else if (keyword == "DIMENSIONS") {
      for (int axis = 0; axis < 3; ++axis)
        file.dims[axis] = cursor.number<int>(1, kMaxDim);
    } else if (keyword == "SPACING" || keyword == "ASPECT_RATIO") {
      for (int axis = 0; axis < 3; ++axis) {
        file.spacing[axis] = cursor.number<double>(-kLargest, kLargest);
        if (!(file.spacing[axis] > 0.0)) {
          cursor.fail(fmt::format("expected a positive spacing, found {}", file.spacing[axis]));
        }
      }
    } else if (keyword == "ORIGIN") {
      for (int axis = 0; axis < 3; ++axis)
        file.origin[axis] = cursor.number<double>(-kLargest, kLargest);
    } else if (keyword == "POINT_DATA" || keyword == "CELL_DATA") {
      if (file.dims.x == 0) cursor.fail("expected DIMENSIONS before " + keyword);
      ofPoints = keyword == "POINT_DATA";
      inData = true;
      tuples = cursor.number<uint64_t>(0, UINT64_MAX);
      if (tuples != expectedTuples(file, ofPoints)) {
        cursor.fail(fmt::format("expected {} of the {} x {} x {} grid, found {}", expectedTuples(file, ofPoints),
                                file.dims.x, file.dims.y, file.dims.z, tuples));
      }
    } else if (!inData && keyword == "FIELD") {
      parseFieldData(cursor, file, false, true);
    } else if (!inData || !parseAttribute(cursor, keyword, file, ofPoints, tuples)) {
      cursor.fail("expected a keyword of a structured points file, found " + inQuotes(keyword));
    }
  }
}

struct Choice {
  const Array* array;
  int component;
};

Choice chooseArray(const VtkFile& file, const VolumeOptions& options, const std::string& path) {
  const bool havePoints =
      std::any_of(file.arrays.begin(), file.arrays.end(), [](const Array& array) { return array.ofPoints; });
  std::vector<Choice> choices;
  std::vector<std::string> names;
  for (const Array& array : file.arrays) {
    if (array.ofPoints != havePoints || array.type.isBit || array.tuples != expectedTuples(file, array.ofPoints)) {
      continue;
    }
    for (int i = 0; i < array.components; ++i) {
      choices.push_back({&array, i});
      names.push_back(array.components == 1 ? array.name : fmt::format("{}.{}", array.name, i));
    }
  }
  if (choices.empty()) throw InputError(fmt::format("{}: holds no array with a value for every voxel", path));
  if (!options.component) {
    for (const Choice& choice : choices) {
      if (choice.array->isScalars && choice.array->components == 1) return choice;
    }
  }
  return choices[chooseComponent(names, options.component, path)];
}

}  // namespace

bool isLegacyVtk(const FileStart& start) {
  return start.startsWith("# vtk DataFile") || start.extension == ".vtk";
}

Payload readLegacyVtkHeader(const FileStart& start, const VolumeOptions& options) {
  if (start.compressed)
    throw InputError(fmt::format("{}: the VTK file is compressed as a whole; gunzip it", start.path));
  const MappedFile mapped(start.path);
  Cursor cursor(start.path, {reinterpret_cast<const char*>(mapped.bytes().data()), mapped.bytes().size()});
  const VtkFile file = parseFile(cursor);
  const auto [array, component] = chooseArray(file, options, start.path);
  chooseFrame(options.frame, 1, start.path);

  Payload payload;
  payload.header.dims = file.dims;
  payload.header.placement.spacing = file.spacing;
  payload.header.placement.origin = file.origin;
  if (!array->ofPoints) {
    payload.header.dims = glm::max(file.dims - 1, glm::ivec3(1));
    payload.header.placement.origin += 0.5 * file.spacing;
  }
  setStoredType(payload, array->type.stored);
  payload.files = {start.path};
  payload.byteSkip = array->offset;
  payload.bytesAfter.reset();  // gone through above
  payload.byteOrder = ByteOrder::big;
  payload.interleaved = {array->components, component};
  if (!file.binary) {
    payload.text = true;
    payload.stored.reset();
  }
  return payload;
}

}  // namespace freevoxel
