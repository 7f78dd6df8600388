#include "volume/library_formats.h"

#include <algorithm>
#include <array>
#include <filesystem>

#include "base/error.h"
#include "volume/byte_source.h"
#include "volume/file_pattern.h"
#include "volume/text_parsing.h"

namespace freevoxel {

namespace {

namespace fs = std::filesystem;

constexpr std::string_view kDigits = "0123456789";

std::string extensionOf(const std::string& path) {
  return lowerCase(fs::path(path).extension().string());
}

/// ".tif" and ".tiff" are one.
std::string imageKind(const std::string& path) {
  const std::string extension = extensionOf(path);
  if (extension == ".tif" || extension == ".tiff") return "TIFF";
  if (extension == ".png") return "PNG";
  if (extension == ".exr") return "EXR";
  return {};
}

bool hasDicomExtension(const std::string& path) {
  const std::string extension = extensionOf(path);
  return extension == ".dcm" || extension == ".dicom" || extension == ".ima";
}

std::string firstBytes(const std::string& path) {
  std::array<std::byte, 132> bytes{};
  const size_t count = openPlain(path, 0)->read(bytes);
  return {reinterpret_cast<const char*>(bytes.data()), count};
}

bool isDicom(const std::string& path) {
  const std::string start = firstBytes(path);
  return start.size() == 132 && start.substr(128) == "DICM";
}

bool startsLikeImage(const std::string& start) {
  using namespace std::string_literals;
  const std::array<std::string, 6> signatures{"II*\0"s, "MM\0*"s, "II+\0"s, "MM\0+"s, "\x89PNG"s, "\x76\x2f\x31\x01"s};
  return std::any_of(signatures.begin(), signatures.end(), [&](const auto& s) { return start.starts_with(s); });
}

bool startsLikeVdb(const std::string& start) {
  using namespace std::string_literals;
  return start.starts_with(" BDV\0\0\0\0"s);
}

LibraryRequest stackRequest(const std::string& path, std::vector<std::string> files) {
  LibraryRequest request;
  request.format = LibraryFormat::imageStack;
  request.formatName = "image";
  request.path = path;
  request.files = std::move(files);
  return request;
}

LibraryRequest dicomRequest(const std::string& path, std::vector<std::string> files) {
  LibraryRequest request;
  request.format = LibraryFormat::dicom;
  request.formatName = "DICOM";
  request.path = path;
  request.files = std::move(files);
  return request;
}

/// Names with their digits taken out, and the numbers.
struct NumberedName {
  std::string frame;
  std::vector<int64_t> numbers;
};

NumberedName takeApart(std::string_view name) {
  NumberedName parts;
  while (!name.empty()) {
    const size_t digit = std::min(name.find_first_of(kDigits), name.size());
    parts.frame += name.substr(0, digit);
    name.remove_prefix(digit);
    if (name.empty()) break;
    const size_t end = std::min(name.find_first_not_of(kDigits), name.size());
    parts.frame += '#';
    parts.numbers.push_back(parseNumber<int64_t>(name.substr(0, end)).value_or(-1));
    name.remove_prefix(end);
  }
  return parts;
}

/// Throws InputError unless the numbers, ascending, are evenly spaced.
void checkEvenlySpaced(const std::string& path, const std::vector<int64_t>& numbers) {
  if (numbers.size() < 3) return;
  int64_t step = numbers[1] - numbers[0];
  for (size_t i = 1; i < numbers.size(); ++i)
    step = std::min(step, numbers[i] - numbers[i - 1]);
  for (size_t i = 1; i < numbers.size(); ++i) {
    if (numbers[i] - numbers[i - 1] == step) continue;
    throw InputError(fmt::format("{}: slice number {} is missing, between {} and {}", path, numbers[i - 1] + step,
                                 numbers[i - 1], numbers[i]));
  }
}

/// Names in natural order differ in one number, which is evenly spaced.
void checkStack(const std::string& folder, const std::vector<std::string>& names) {
  const NumberedName first = takeApart(names[0]);
  std::optional<size_t> varying;
  std::vector<int64_t> numbers;
  for (const std::string& name : names) {
    const NumberedName parts = takeApart(name);
    if (parts.frame != first.frame) {
      throw InputError(fmt::format("{}: holds images of different names ('{}' and '{}'); keep one stack in a folder",
                                   folder, names[0], name));
    }
    for (size_t i = 0; i < parts.numbers.size(); ++i) {
      if (parts.numbers[i] == first.numbers[i] || varying == i) continue;
      if (varying) {
        throw InputError(
            fmt::format("{}: holds images whose names differ in several numbers ('{}' and '{}'); keep "
                        "one stack in a folder",
                        folder, names[0], name));
      }
      varying = i;
    }
  }
  for (size_t i = 0; varying && i < names.size(); ++i)
    numbers.push_back(takeApart(names[i]).numbers[*varying]);
  std::sort(numbers.begin(), numbers.end());
  checkEvenlySpaced(folder, numbers);
}

/// A slice that lost all but its first bytes is no DICOM file any more, but is still named like one.
void checkNoneIsCut(const std::string& folder, const std::vector<std::string>& dicom,
                    const std::vector<std::string>& others) {
  const NumberedName first = takeApart(dicom[0]);
  if (first.numbers.empty()) return;
  for (const std::string& name : others) {
    if (takeApart(name).frame != first.frame) continue;
    throw InputError(fmt::format("{}: is named like the DICOM files beside it, but is none; it may be cut short",
                                 (fs::path(folder) / name).string()));
  }
}

std::vector<std::string> withFolder(const std::string& folder, const std::vector<std::string>& names) {
  std::vector<std::string> paths;
  for (const std::string& name : names)
    paths.push_back((fs::path(folder) / name).string());
  return paths;
}

LibraryRequest folderRequest(const std::string& folder) {
  std::vector<std::string> dicom, images, others;
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error)) {
    const std::string name = entry->path().filename().string();
    std::error_code ignored;
    if (name.starts_with('.') || name == "DICOMDIR" || !entry->is_regular_file(ignored)) continue;
    const std::string path = entry->path().string();
    if (hasDicomExtension(path) || isDicom(path)) {
      dicom.push_back(name);
    } else if (!imageKind(path).empty()) {
      images.push_back(name);
    } else {
      others.push_back(name);
    }
  }
  if (error) throw InputError(fmt::format("{}: cannot read the folder: {}", folder, error.message()));
  std::vector<std::string>& names = dicom.empty() ? images : dicom;
  std::sort(names.begin(), names.end(), naturallyBefore);
  if (names.empty()) {
    throw InputError(fmt::format("{}: the folder holds neither DICOM files nor TIFF, PNG or EXR images", folder));
  }
  if (!dicom.empty()) {
    checkNoneIsCut(folder, dicom, others);
    return dicomRequest(folder, withFolder(folder, dicom));
  }
  for (const std::string& name : images) {
    if (imageKind(name) != imageKind(images[0])) {
      throw InputError(fmt::format("{}: holds {} and {} images; keep one stack in a folder", folder,
                                   imageKind(images[0]), imageKind(name)));
    }
  }
  checkStack(folder, images);
  return stackRequest(folder, withFolder(folder, images));
}

LibraryRequest patternRequest(const std::string& pattern) {
  const std::vector<int> numbers = numbersOfPattern(pattern);
  if (numbers.empty()) throw InputError(fmt::format("{}: no file of that pattern exists", pattern));
  checkEvenlySpaced(pattern, std::vector<int64_t>(numbers.begin(), numbers.end()));
  std::vector<std::string> files;
  for (const int number : numbers)
    files.push_back(*expandPattern(pattern, number));
  return stackRequest(pattern, std::move(files));
}

}  // namespace

std::optional<LibraryRequest> libraryRequest(const std::string& path) {
  std::error_code ignored;
  if (fs::is_directory(path, ignored)) return folderRequest(path);
  if (!fs::exists(path, ignored)) {
    if (isPattern(path) && !imageKind(path).empty()) return patternRequest(path);
    return std::nullopt;  // whoever opens it says so
  }
  if (!fs::is_regular_file(path, ignored)) return std::nullopt;
  const std::string start = firstBytes(path);
  if (startsLikeVdb(start) || extensionOf(path) == ".vdb") {
    LibraryRequest request;
    request.format = LibraryFormat::vdb;
    request.formatName = "OpenVDB";
    request.path = path;
    request.files = {path};
    return request;
  }
  if (isDicom(path) || hasDicomExtension(path)) return dicomRequest(path, {path});
  if (startsLikeImage(start) || !imageKind(path).empty()) return stackRequest(path, {path});
  return std::nullopt;
}

const char* libraryFormatNames() {
  return "OpenVDB, DICOM, TIFF, PNG, EXR";
}

}  // namespace freevoxel
