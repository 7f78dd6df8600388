#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <filesystem>
#include <memory>

#include "base/error.h"
#include "base/mapped_file.h"
#include "volume/component.h"
#include "volume/header_reading.h"
#include "volume/slice_sink.h"

namespace freevoxel {

namespace {

namespace oiio = OIIO;

/// No picture packs better than this: a damaged header must not make us reserve memory for pixels that cannot be there.
constexpr uint64_t kMaxCompression = 4096;

std::string firstLine(std::string text) {
  text.erase(std::find(text.begin(), text.end(), '\n'), text.end());
  return text.empty() ? "unknown reason" : text;
}

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

ValueType valueType(const std::string& path, oiio::TypeDesc type) {
  switch (type.basetype) {
    case oiio::TypeDesc::UINT8:
      return ValueType::u8;
    case oiio::TypeDesc::INT8:
      return ValueType::i8;
    case oiio::TypeDesc::UINT16:
      return ValueType::u16;
    case oiio::TypeDesc::INT16:
      return ValueType::i16;
    case oiio::TypeDesc::UINT32:
      return ValueType::u32;
    case oiio::TypeDesc::INT32:
      return ValueType::i32;
    case oiio::TypeDesc::HALF:
    case oiio::TypeDesc::FLOAT:
      return ValueType::f32;
    case oiio::TypeDesc::DOUBLE:
      return ValueType::f64;
    default:
      throw InputError(fmt::format("{}: expected pixels of plain numbers, found {}", path, type.c_str()));
  }
}

oiio::TypeDesc pixelType(ValueType type) {
  constexpr oiio::TypeDesc::BASETYPE kTypes[] = {oiio::TypeDesc::UINT8, oiio::TypeDesc::INT8,   oiio::TypeDesc::UINT16,
                                                 oiio::TypeDesc::INT16, oiio::TypeDesc::UINT32, oiio::TypeDesc::INT32,
                                                 oiio::TypeDesc::FLOAT, oiio::TypeDesc::DOUBLE};
  return kTypes[int(type)];
}

class OpenedImage {
 public:
  explicit OpenedImage(const std::string& path) : path_(path) {
    checkPngEnd(path);
    checkTiffPages(path);
    oiio::ImageSpec wishes;
    wishes["oiio:UnassociatedAlpha"] = 1;
    input_ = oiio::ImageInput::open(path, &wishes);
    if (!input_) throw InputError(fmt::format("{}: damaged header: {}", path, firstLine(oiio::geterror())));
    checkPage();
  }

  const oiio::ImageSpec& spec() const { return input_->spec(); }
  ValueType type() const { return valueType(path_, spec().format); }

  int countPages() {
    int count = 1;
    while (input_->seek_subimage(count, 0))
      ++count;
    input_->geterror();
    return count;
  }
  /// Page `index`, which has to be of the kind of the first one.
  void readPage(int index, int channel, const VolumeHeader& header, const std::string& firstPath,
                std::span<std::byte> out) {
    if (!input_->seek_subimage(index, 0)) {
      throw InputError(fmt::format("{}: page {}: damaged: {}", path_, index, firstLine(input_->geterror())));
    }
    checkPage();
    const oiio::ImageSpec& page = spec();
    if (page.width != header.dims.x || page.height != header.dims.y || type() != header.type ||
        channel >= page.nchannels) {
      throw InputError(fmt::format("{}{}: expected {} x {} pixels of type {} as in {}, found {} x {} of type {}", path_,
                                   index > 0 ? fmt::format(": page {}", index) : "", header.dims.x, header.dims.y,
                                   valueTypeName(header.type), firstPath, page.width, page.height,
                                   valueTypeName(type())));
    }
    if (!input_->read_image(index, 0, channel, channel + 1, pixelType(header.type), out.data()) ||
        input_->has_error()) {
      throw InputError(fmt::format("{}: damaged or cut short: {}", path_, firstLine(input_->geterror())));
    }
  }

 private:
  void checkPage() const {
    const oiio::ImageSpec& page = spec();
    if (page.width < 1 || page.height < 1 || page.width > kMaxDim || page.height > kMaxDim || page.depth > 1 ||
        page.nchannels < 1 || page.deep) {
      throw InputError(fmt::format("{}: expected a flat picture, found {} x {} x {} pixels of {} channels", path_,
                                   page.width, page.height, page.depth, page.nchannels));
    }
    if (page.image_bytes(true) / kMaxCompression > std::filesystem::file_size(path_)) {
      throw InputError(fmt::format("{}: cut short: {} x {} pixels of {} channels cannot lie in {} bytes", path_,
                                   page.width, page.height, page.nchannels, std::filesystem::file_size(path_)));
    }
  }

  std::string path_;
  std::unique_ptr<oiio::ImageInput> input_;
};

}  // namespace

void readImageStack(const LibraryRequest& request, SliceSink& sink) {
  oiio::attribute("threads", 1);
  oiio::attribute("exr_threads", -1);
  const std::string& firstPath = request.files.at(0);
  auto image = std::make_unique<OpenedImage>(firstPath);
  const bool pages = request.files.size() == 1;
  VolumeHeader header;
  header.type = image->type();
  header.dims = {image->spec().width, image->spec().height, 1};
  std::vector<std::string> names = image->spec().channelnames;
  if (names.size() != size_t(image->spec().nchannels)) names = numberedComponents(image->spec().nchannels);
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
