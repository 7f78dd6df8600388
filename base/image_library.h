// Image files of any format that OpenImageIO knows. The library brings some 250 others with it, which take a quarter of
// a second and 120 MB to load; so it lies in a module of its own (base/openimageio_module.cpp) that is loaded with the
// first image file. Nothing else includes it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace freevoxel {

/// Of one channel, this machine's byte order.
enum class SampleType { u8, i8, u16, i16, u32, i32, f16, f32, f64, other };

/// One picture of a file, as the file says: unchecked.
struct ImageFileHeader {
  int width = 0, height = 0, depth = 1, channels = 0;
  SampleType type = SampleType::other;
  std::string typeName;
  bool deep = false;   ///< several samples per pixel
  uint64_t bytes = 0;  ///< of the pixels, in the file's type
  std::vector<std::string> channelNames;
};

/// A file opened for reading, at its first picture (subimage). Alpha is not multiplied into colours that are stored
/// without it.
class ImageFileReader {
 public:
  virtual ~ImageFileReader() = default;
  virtual const ImageFileHeader& header() const = 0;            ///< of the picture at hand
  virtual std::string text(const std::string& name) const = 0;  ///< of an attribute; empty if there is none
  /// Goes to another picture of the file. False: there is none, or it is damaged.
  virtual bool select(int picture) = 0;
  /// Rows firstRow..lastRow-1, channels firstChannel..lastChannel-1, turned into `type`. False on failure, or if the
  /// library complained of anything.
  virtual bool read(int firstRow, int lastRow, int firstChannel, int lastChannel, SampleType type, void* out) = 0;
  /// What failed last, one line; forgets it.
  virtual std::string error() = 0;
};

/// What is written, and how.
struct ImageFileContent {
  int width = 0, height = 0;
  SampleType type = SampleType::u8;
  std::vector<std::string> channelNames;  ///< one for each channel
  bool separateAlpha = false;             ///< the last channel is an alpha that is not multiplied into the others
  std::vector<std::pair<std::string, std::string>> attributes;
  const void* pixels = nullptr;  ///< interleaved, row 0 at the top
};

class ImageLibrary {
 public:
  virtual ~ImageLibrary() = default;
  /// `format` is the library's name of it; empty: told by name and content. Null, and why, if it cannot be opened.
  virtual std::unique_ptr<ImageFileReader> open(const std::string& path, const std::string& format,
                                                std::string& error) const = 0;
  /// The same of a file in memory, which has to outlive the reader; `name` ends like the file's.
  virtual std::unique_ptr<ImageFileReader> openBytes(const std::string& name, std::string_view bytes,
                                                     std::string& error) const = 0;
  /// Empty, or why it could not be written.
  virtual std::string write(const std::string& path, const std::string& format,
                            const ImageFileContent& content) const = 0;
};

/// Loads the module at the first call. Throws MachineError if it is not where the build put it.
const ImageLibrary& imageLibrary();

/// The module's only function.
inline constexpr const char* kImageLibraryEntry = "freevoxelImageLibrary";
using ImageLibraryEntry = const ImageLibrary* (*)();

}  // namespace freevoxel
