#include "volume/file_start.h"

#include <algorithm>
#include <filesystem>
#include <memory>

#include "volume/byte_source.h"
#include "volume/text_parsing.h"

namespace freevoxel {

namespace {

std::vector<std::byte> firstBytes(ByteSource& source) {
  std::vector<std::byte> bytes(1024);
  bytes.resize(source.read(bytes));
  return bytes;
}

}  // namespace

bool FileStart::startsWith(std::string_view text) const {
  return bytes.size() >= text.size() &&
         std::equal(text.begin(), text.end(), bytes.begin(), [](char c, std::byte b) { return std::byte(c) == b; });
}

FileStart readFileStart(const std::string& path) {
  FileStart start;
  start.path = path;
  std::filesystem::path name(path);
  if (lowerCase(name.extension().string()) == ".gz") name = name.stem();
  start.extension = lowerCase(name.extension().string());
  start.bytes = firstBytes(*openPlain(path, 0));
  start.compressed = isGzip(start.bytes);
  if (start.compressed) start.bytes = firstBytes(*openInflated(path, 0));
  return start;
}

}  // namespace freevoxel
