#include "volume/numpy_array.h"

#include <algorithm>
#include <map>

#include "base/error.h"
#include "volume/byte_source.h"
#include "volume/component.h"
#include "volume/header_reading.h"
#include "volume/text_parsing.h"

namespace freevoxel {

namespace {

constexpr size_t kMagicBytes = 8;  // six characters and two numbers

struct NumpyHeader {
  std::string path;
  size_t textOffset = 0;
  std::string text;  ///< a Python dictionary

  [[noreturn]] void fail(const std::string& what) const {
    throw InputError(fmt::format("{}: offset {}: {}", path, textOffset, what));
  }

  /// What stands behind a key, up to the end of the dictionary.
  std::string_view value(const std::string& key) const {
    for (const char quote : {'\'', '"'}) {
      const std::string name = quote + key + quote;
      const size_t at = text.find(name);
      if (at == std::string::npos) continue;
      std::string_view rest = trimmed(std::string_view(text).substr(at + name.size()));
      if (!rest.starts_with(':')) break;
      return trimmed(rest.substr(1));
    }
    fail(fmt::format("expected a key '{}', found none", key));
  }
};

NumpyHeader readHeader(const FileStart& start) {
  NumpyHeader header;
  header.path = start.path;
  if (start.bytes.size() < 12 || !start.startsWith("\x93NUMPY")) {
    throw InputError(fmt::format("{}: offset 0: expected a NumPy array", start.path));
  }
  const int version = int(start.bytes[6]);
  if (version < 1 || version > 3) {
    throw InputError(fmt::format("{}: offset 6: expected version 1, 2 or 3, found {}", start.path, version));
  }
  const size_t lengthBytes = version == 1 ? 2 : 4;
  const size_t length = version == 1 ? size_t(numberAt<uint16_t>(start.bytes, 8, ByteOrder::little))
                                     : size_t(numberAt<uint32_t>(start.bytes, 8, ByteOrder::little));
  header.textOffset = kMagicBytes + lengthBytes;
  constexpr size_t kLongest = size_t(1) << 16;
  if (length > kLongest) {
    throw InputError(
        fmt::format("{}: offset 8: expected a header of at most {} bytes, found {}", start.path, kLongest, length));
  }
  const auto source = start.compressed ? openInflated(start.path, 0) : openPlain(start.path, 0);
  std::vector<std::byte> bytes(header.textOffset + length);
  if (source->read(bytes) != bytes.size()) {
    throw InputError(fmt::format("{}: offset 8: the header of {} bytes is cut off", start.path, length));
  }
  for (size_t i = header.textOffset; i < bytes.size(); ++i)
    header.text += char(bytes[i]);
  return header;
}

std::string parseDescription(const NumpyHeader& header) {
  const std::string_view value = header.value("descr");
  if (value.empty() || (value[0] != '\'' && value[0] != '"')) header.fail("expected a plain type, found a structure");
  const size_t end = value.find(value[0], 1);
  if (end == std::string_view::npos) header.fail("expected a type in quotes, found " + inQuotes(value));
  return std::string(value.substr(1, end - 1));
}

StoredType parseType(const NumpyHeader& header, const std::string& description) {
  static const std::map<std::string, StoredType> kTypes{
      {"u1", StoredType::u8},  {"b1", StoredType::u8},  {"i1", StoredType::i8},  {"u2", StoredType::u16},
      {"i2", StoredType::i16}, {"u4", StoredType::u32}, {"i4", StoredType::i32}, {"u8", StoredType::u64},
      {"i8", StoredType::i64}, {"f2", StoredType::f16}, {"f4", StoredType::f32}, {"f8", StoredType::f64},
  };
  const auto found = kTypes.find(description.substr(std::min<size_t>(description.size(), 1)));
  if (found == kTypes.end() || std::string_view("<>|=").find(description[0]) == std::string_view::npos) {
    header.fail("expected a type such as '|u1', '<i2' or '<f4', found " + inQuotes(description));
  }
  return found->second;
}

bool parseFortranOrder(const NumpyHeader& header) {
  const std::string_view value = header.value("fortran_order");
  if (value.starts_with("True")) return true;
  if (!value.starts_with("False")) header.fail("expected True or False, found " + inQuotes(value.substr(0, 8)));
  return false;
}

std::vector<int64_t> parseShape(const NumpyHeader& header) {
  const std::string_view value = header.value("shape");
  const size_t end = value.find(')');
  if (!value.starts_with('(') || end == std::string_view::npos) header.fail("expected a shape (z, y, x)");
  std::string numbers(value.substr(1, end - 1));
  std::replace(numbers.begin(), numbers.end(), ',', ' ');
  std::vector<int64_t> shape;
  for (const std::string_view part : words(numbers)) {
    const std::optional<int64_t> size = parseNumber<int64_t>(part);
    if (!size) header.fail("expected a size, found " + inQuotes(part));
    shape.push_back(*size);
  }
  return shape;
}

std::vector<int> volumeShape(const NumpyHeader& header) {
  const std::vector<int64_t> shape = parseShape(header);
  for (const int64_t size : shape) {
    if (size < 1 || size > kMaxDim) header.fail(fmt::format("expected sizes in 1..{}, found '{}'", kMaxDim, size));
  }
  if (shape.size() != 3 && shape.size() != 4) {
    header.fail(fmt::format("expected an array of 3 axes [z][y][x], found {}", shape.size()));
  }
  return {shape.begin(), shape.end()};
}

ByteOrder byteOrderOf(const std::string& description) {
  return description[0] == '>' ? ByteOrder::big : ByteOrder::little;
}

}  // namespace

bool isNumpyArray(const FileStart& start) {
  return start.startsWith("\x93NUMPY") || start.extension == ".npy";
}

size_t numpyAxes(const FileStart& start) {
  return parseShape(readHeader(start)).size();
}

NumpyTable readNumpyTable(const FileStart& start) {
  const NumpyHeader header = readHeader(start);
  const std::string description = parseDescription(header);
  NumpyTable table;
  table.type = parseType(header, description);
  table.byteOrder = byteOrderOf(description);
  table.columnsFirst = parseFortranOrder(header);
  table.bytesBefore = header.textOffset + header.text.size();
  const std::vector<int64_t> shape = parseShape(header);
  if (shape.size() != 2) header.fail(fmt::format("expected an array of 2 axes, found {}", shape.size()));
  for (const int64_t size : shape) {
    if (size < 0) header.fail(fmt::format("expected sizes of 0 or more, found {}", size));
  }
  table.rows = uint64_t(shape[0]);
  table.columns = uint64_t(shape[1]);
  return table;
}

Payload readNumpyHeader(const FileStart& start, const VolumeOptions& options) {
  const NumpyHeader header = readHeader(start);
  const std::string description = parseDescription(header);
  const bool fortran = parseFortranOrder(header);
  std::vector<int> shape = volumeShape(header);

  Payload payload;
  setStoredType(payload, parseType(header, description));
  payload.byteOrder = byteOrderOf(description);
  payload.files = {start.path};
  payload.compressed = start.compressed;
  payload.byteSkip = header.textOffset + header.text.size();
  payload.zFastest = fortran;
  int volumes = 1;
  size_t chosen = 0;
  // Along the slower end of memory whole volumes follow one another; along the other, values lie side by side.
  bool sideBySide = false;
  if (shape.size() == 4) {
    if (!options.component && !options.frame) {
      header.fail("an array of 4 axes: choose from the last with --component, or from the first with --frame");
    }
    const bool last = options.component.has_value();
    volumes = last ? shape.back() : shape.front();
    shape.erase(last ? shape.end() - 1 : shape.begin());
    sideBySide = last != fortran;
    chosen = last ? chooseComponent(numberedComponents(volumes), options.component, start.path)
                  : chooseFrame(options.frame, uint64_t(volumes), start.path);
  } else {
    chooseComponent(numberedComponents(1), options.component, start.path);
    chooseFrame(options.frame, 1, start.path);
  }
  payload.header.dims = {shape[2], shape[1], shape[0]};
  if (sideBySide) {
    payload.interleaved = {volumes, int(chosen)};
  } else {
    limitToVolume(payload, chosen, uint64_t(volumes), start.path);
  }
  return payload;
}

}  // namespace freevoxel
