#include <algorithm>
#include <filesystem>
#include <memory>

#include "base/error.h"
#include "base/image_library.h"
#include "base/mapped_file.h"
#include "volume/component.h"
#include "volume/header_reading.h"
#include "volume/slice_sink.h"

namespace freevoxel {

namespace {

/// No picture packs better than this: a damaged header must not make us reserve memory for pixels that cannot be there.
constexpr uint64_t kMaxCompression = 4096;

/// libpng is content with a picture that lacks its end.
void checkPngEnd(const std::string& path) {
  constexpr std::string_view kEnd("IEND\xae\x42\x60\x82", 8);
  const MappedFile file(path);
  const std::string_view content(reinterpret_cast<const char*>(file.bytes().data()), file.bytes().size());
  if (content.starts_with("\x89PNG") && !content.ends_with(kEnd)) {
    throw InputError(
        fmt::format("{}: cut short: expected the PNG file to end with IEND at byte {}", path, content.size()));
  }
}

/// OpenImageIO takes a chain of pages that leads beyond the file's end for its end.
void checkTiffPages(const std::string& path) {
  const MappedFile file(path);
  const std::span<const std::byte> bytes = file.bytes();
  if (bytes.size() < 16) return;  // refused when it is opened
  const char first = char(bytes[0]);
  if ((first != 'I' && first != 'M') || bytes[1] != bytes[0]) return;
  const ByteOrder order = first == 'I' ? ByteOrder::little : ByteOrder::big;
  const auto version = numberAt<uint16_t>(bytes, 2, order);
  if (version != 42 && version != 43) return;
  const bool big = version == 43;
  const size_t offsetBytes = big ? 8 : 4, countBytes = big ? 8 : 2, entryBytes = big ? 20 : 12;
  const auto offsetAt = [&](size_t at) {
    return big ? numberAt<uint64_t>(bytes, at, order) : numberAt<uint32_t>(bytes, at, order);
  };
  const auto fail = [&](int page, uint64_t at) {
    throw InputError(fmt::format("{}: page {}: cut short or damaged: expected its directory at byte {} of {}", path,
                                 page, at, bytes.size()));
  };
  uint64_t at = offsetAt(big ? 8 : 4);
  for (int page = 0; at != 0; ++page) {
    if (page > kMaxDim || at > bytes.size() || bytes.size() - at < countBytes) fail(page, at);
    const uint64_t entries = big ? numberAt<uint64_t>(bytes, at, order) : numberAt<uint16_t>(bytes, at, order);
    const uint64_t room = bytes.size() - at - countBytes;
    if (room < offsetBytes || entries > (room - offsetBytes) / entryBytes) fail(page, at);
    at = offsetAt(at + countBytes + entries * entryBytes);
  }
}

ValueType valueType(const std::string& path, const ImageFileHeader& header) {
  switch (header.type) {
    case SampleType::u8:
      return ValueType::u8;
    case SampleType::i8:
      return ValueType::i8;
    case SampleType::u16:
      return ValueType::u16;
    case SampleType::i16:
      return ValueType::i16;
    case SampleType::u32:
      return ValueType::u32;
    case SampleType::i32:
      return ValueType::i32;
    case SampleType::f16:
    case SampleType::f32:
      return ValueType::f32;
    case SampleType::f64:
      return ValueType::f64;
    case SampleType::other:
      break;
  }
  throw InputError(fmt::format("{}: expected pixels of plain numbers, found {}", path, header.typeName));
}

SampleType sampleType(ValueType type) {
  constexpr SampleType kTypes[] = {SampleType::u8,  SampleType::i8,  SampleType::u16, SampleType::i16,
                                   SampleType::u32, SampleType::i32, SampleType::f32, SampleType::f64};
  return kTypes[int(type)];
}

class OpenedImage {
 public:
  explicit OpenedImage(const std::string& path) : path_(path) {
    checkPngEnd(path);
    checkTiffPages(path);
    std::string error;
    input_ = imageLibrary().open(path, "", error);
    if (!input_) throw InputError(fmt::format("{}: damaged header: {}", path, error));
    checkPage();
  }

  const ImageFileHeader& header() const { return input_->header(); }
  ValueType type() const { return valueType(path_, header()); }

  int countPages() {
    int count = 1;
    while (input_->select(count))
      ++count;
    input_->error();
    return count;
  }
  /// Page `index`, which has to be of the kind of the first one.
  void readPage(int index, int channel, const VolumeHeader& expected, const std::string& firstPath,
                std::span<std::byte> out) {
    if (!input_->select(index)) {
      throw InputError(fmt::format("{}: page {}: damaged: {}", path_, index, input_->error()));
    }
    checkPage();
    const ImageFileHeader& page = header();
    if (page.width != expected.dims.x || page.height != expected.dims.y || type() != expected.type ||
        channel >= page.channels) {
      throw InputError(fmt::format("{}{}: expected {} x {} pixels of type {} as in {}, found {} x {} of type {}", path_,
                                   index > 0 ? fmt::format(": page {}", index) : "", expected.dims.x, expected.dims.y,
                                   valueTypeName(expected.type), firstPath, page.width, page.height,
                                   valueTypeName(type())));
    }
    if (!input_->read(0, page.height, channel, channel + 1, sampleType(expected.type), out.data())) {
      throw InputError(fmt::format("{}: damaged or cut short: {}", path_, input_->error()));
    }
  }

 private:
  void checkPage() const {
    const ImageFileHeader& page = header();
    if (page.width < 1 || page.height < 1 || page.width > kMaxDim || page.height > kMaxDim || page.depth > 1 ||
        page.channels < 1 || page.deep) {
      throw InputError(fmt::format("{}: expected a flat picture, found {} x {} x {} pixels of {} channels", path_,
                                   page.width, page.height, page.depth, page.channels));
    }
    if (page.bytes / kMaxCompression > std::filesystem::file_size(path_)) {
      throw InputError(fmt::format("{}: cut short: {} x {} pixels of {} channels cannot lie in {} bytes", path_,
                                   page.width, page.height, page.channels, std::filesystem::file_size(path_)));
    }
  }

  std::string path_;
  std::unique_ptr<ImageFileReader> input_;
};

}  // namespace

void readImageStack(const LibraryRequest& request, SliceSink& sink) {
  const std::string& firstPath = request.files.at(0);
  auto image = std::make_unique<OpenedImage>(firstPath);
  const bool pages = request.files.size() == 1;
  VolumeHeader header;
  header.type = image->type();
  header.dims = {image->header().width, image->header().height, 1};
  std::vector<std::string> names = image->header().channelNames;
  if (names.size() != size_t(image->header().channels)) names = numberedComponents(image->header().channels);
  const int channel = int(chooseComponent(names, request.component, firstPath));
  header.dims.z = pages ? image->countPages() : int(request.files.size());
  sink.header(header);

  std::vector<std::byte> slice(header.bytes() / uint64_t(header.dims.z));
  for (int z = 0; z < header.dims.z; ++z) {
    const std::string& path = request.files[pages ? 0 : size_t(z)];
    if (!pages && z > 0) image = std::make_unique<OpenedImage>(path);
    image->readPage(pages ? z : 0, channel, header, firstPath, slice);
    sink.values(slice);
  }
}

}  // namespace freevoxel
