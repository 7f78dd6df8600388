#include "base/image.h"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <memory>

#include "base/atomic_file.h"
#include "base/error.h"
#include "base/image_library.h"
#include "base/mapped_file.h"

namespace freevoxel {

namespace {

constexpr int kMaxImageSize = 32768;  // as in checkCamera
constexpr int kMaxChannels = 64;
/// No picture packs better than this: a damaged header must not make us reserve memory for pixels that cannot be there.
/// (Deflate, in PNG and most EXR files, reaches 1032.)
constexpr uint64_t kMaxCompression = 4096;

/// EXR files keep their channels sorted by name; this attribute remembers the order they were given in.
constexpr const char* kChannelOrder = "ChannelOrder";

constexpr std::array<uint8_t, 8> kPngSignature{0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'};
constexpr std::array<uint8_t, 4> kExrSignature{0x76, 0x2f, 0x31, 0x01};

template <size_t N>
bool startsWith(std::span<const std::byte> bytes, const std::array<uint8_t, N>& signature) {
  return bytes.size() >= N && std::memcmp(bytes.data(), signature.data(), N) == 0;
}

/// Walks the chunks of a PNG and checks each length and checksum. libpng checks them too, but tells stderr.
void checkPngChunks(const std::string& path, std::span<const std::byte> bytes) {
  const auto bigEndian = [&](size_t offset) {
    uint32_t value = 0;
    for (size_t i = 0; i < 4; ++i)
      value = value << 8 | uint32_t(bytes[offset + i]);
    return value;
  };
  constexpr size_t kChunkFrame = 12;  // length, name, checksum
  size_t offset = kPngSignature.size();
  for (std::string name; name != "IEND";) {
    const size_t left = bytes.size() - offset;
    if (left < kChunkFrame || bigEndian(offset) > left - kChunkFrame) {
      throw InputError(
          fmt::format("{}: cut short: the chunk at offset {} runs past the end of the file", path, offset));
    }
    const size_t length = bigEndian(offset);
    name.assign(reinterpret_cast<const char*>(&bytes[offset + 4]), 4);
    const uint32_t expected = bigEndian(offset + 8 + length);
    const uint32_t found = uint32_t(crc32_z(0, reinterpret_cast<const Bytef*>(&bytes[offset + 4]), length + 4));
    if (found != expected) {
      throw InputError(fmt::format("{}: damaged: the chunk at offset {} has checksum {:08x}, expected {:08x}", path,
                                   offset, found, expected));
    }
    offset += kChunkFrame + length;
  }
}

/// The format's name in OpenImageIO, told by the file's first bytes.
const char* checkedFormat(const std::string& path) {
  const MappedFile file(path);
  if (startsWith(file.bytes(), kExrSignature)) return "openexr";
  if (!startsWith(file.bytes(), kPngSignature)) {
    throw InputError(fmt::format("{}: is neither a PNG nor an EXR image (its first bytes fit neither)", path));
  }
  checkPngChunks(path, file.bytes());
  return "png";
}

/// An image file opened for reading, its header checked.
struct OpenedImage {
  std::unique_ptr<ImageFileReader> file;
  std::string format;
};

OpenedImage openImage(const std::string& path) {
  OpenedImage opened;
  opened.format = checkedFormat(path);
  std::string error;
  opened.file = imageLibrary().open(path, opened.format, error);
  if (!opened.file) throw InputError(fmt::format("{}: damaged header: {}", path, error));
  const ImageFileHeader& header = opened.file->header();
  if (header.width < 1 || header.height < 1 || header.width > kMaxImageSize || header.height > kMaxImageSize ||
      header.depth > 1 || header.channels < 1 || header.channels > kMaxChannels || header.deep) {
    throw InputError(fmt::format("{}: expected up to {} x {} pixels of 1..{} channels, found {} x {} of {}{}", path,
                                 kMaxImageSize, kMaxImageSize, kMaxChannels, header.width, header.height,
                                 header.channels, header.deep ? " (deep)" : ""));
  }
  const uint64_t fileBytes = std::filesystem::file_size(path);
  if (header.bytes / kMaxCompression > fileBytes) {
    throw InputError(fmt::format("{}: cut short: {} x {} pixels of {} channels cannot lie in {} bytes", path,
                                 header.width, header.height, header.channels, fileBytes));
  }
  return opened;
}

/// Channels as the writer ordered them, where the file says so and names each of them once.
Image inWrittenOrder(Image image, const ImageFileReader& file) {
  const std::vector<std::string>& names = file.header().channelNames;
  std::vector<int> source;
  const std::string order = file.text(kChannelOrder);
  for (size_t begin = 0; begin < order.size();) {
    const size_t end = std::min(order.find(',', begin), order.size());
    const auto found = std::find(names.begin(), names.end(), order.substr(begin, end - begin));
    source.push_back(int(found - names.begin()));
    begin = end + 1;
  }
  std::vector<int> sorted = source;
  std::sort(sorted.begin(), sorted.end());
  bool complete = int(sorted.size()) == image.channels;
  for (int c = 0; complete && c < image.channels; ++c)
    complete = sorted[size_t(c)] == c;
  if (!complete) return image;
  std::vector<float> pixel(size_t(image.channels));
  for (size_t i = 0; i < image.pixels.size(); i += pixel.size()) {
    for (size_t c = 0; c < pixel.size(); ++c)
      pixel[c] = image.pixels[i + size_t(source[c])];
    std::copy(pixel.begin(), pixel.end(), image.pixels.begin() + ptrdiff_t(i));
  }
  return image;
}

/// 16-bit sRGB grey or colour, with or without straight alpha, to premultiplied linear RGB or RGBA.
Image linearPicture(glm::ivec2 size, int storedChannels, std::span<const uint16_t> stored) {
  const bool grey = storedChannels < 3;
  const bool alpha = storedChannels % 2 == 0;
  Image picture(size, alpha ? 4 : 3);
  const size_t count = size_t(size.x) * size_t(size.y);
  for (size_t i = 0; i < count; ++i) {
    const uint16_t* from = &stored[i * size_t(storedChannels)];
    float* to = &picture.pixels[i * size_t(picture.channels)];
    const float a = alpha ? float(from[storedChannels - 1]) / 65535.0f : 1.0f;
    for (int c = 0; c < 3; ++c)
      to[c] = a * linearFromSrgb(float(from[grey ? 0 : c]) / 65535.0f);
    if (alpha) to[3] = a;
  }
  return picture;
}

uint8_t toByte(double value) {
  // The comparison is false for NaN too.
  if (!(value > 0.0)) return 0;
  return uint8_t(std::min(255.0, std::floor(255.0 * value + 0.5)));
}

void write(const std::string& path, const std::string& format, ImageFileContent content,
           const ImageMetadata& metadata) {
  content.attributes.insert(content.attributes.end(), metadata.begin(), metadata.end());
  AtomicFile file(path);
  const std::string error = imageLibrary().write(file.temporaryPath(), format, content);
  if (!error.empty()) throw MachineError(fmt::format("{}: cannot write the image: {}", path, error));
  file.commit();
}

}  // namespace

Image::Image(glm::ivec2 imageSize, int channelCount)
    : size(imageSize),
      channels(channelCount),
      pixels(size_t(imageSize.x) * size_t(imageSize.y) * size_t(channelCount), 0.0f) {}

float srgbFromLinear(float linear) {
  if (!(linear > 0.0f)) return 0.0f;
  if (linear >= 1.0f) return 1.0f;
  const double x = linear;
  return float(x <= 0.0031308 ? 12.92 * x : 1.055 * std::pow(x, 1.0 / 2.4) - 0.055);
}

float linearFromSrgb(float srgb) {
  if (!(srgb > 0.0f)) return 0.0f;
  if (srgb >= 1.0f) return 1.0f;
  const double x = srgb;
  return float(x <= 0.04045 ? x / 12.92 : std::pow((x + 0.055) / 1.055, 2.4));
}

void writePng(const std::string& path, const Image& image, const ImageMetadata& metadata, bool keepAlpha) {
  check(image.channels == 4 || (image.channels == 3 && !keepAlpha), "a PNG is made from RGBA or opaque RGB");
  const int channels = keepAlpha ? 4 : 3;
  const size_t count = size_t(image.size.x) * size_t(image.size.y);
  std::vector<uint8_t> bytes(count * size_t(channels));
  for (size_t i = 0; i < count; ++i) {
    const float* from = image.pixels.data() + i * size_t(image.channels);
    uint8_t* to = bytes.data() + i * size_t(channels);
    const float alpha = keepAlpha ? from[3] : 1.0f;
    for (int c = 0; c < 3; ++c)
      to[c] = alpha > 0.0f ? toByte(srgbFromLinear(from[c] / alpha)) : 0;
    if (keepAlpha) to[3] = toByte(alpha);
  }
  ImageFileContent content{image.size.x, image.size.y, SampleType::u8, {"R", "G", "B"}, keepAlpha, {}, bytes.data()};
  if (keepAlpha) content.channelNames.push_back("A");
  content.attributes.emplace_back("oiio:ColorSpace", "sRGB");
  write(path, "png", std::move(content), metadata);
}

void writeExr(const std::string& path, const Image& image, std::span<const std::string> channelNames,
              const ImageMetadata& metadata) {
  checkEqual(channelNames.size(), size_t(image.channels), "number of channel names");
  ImageFileContent content{image.size.x, image.size.y, SampleType::f32, {}, false, {}, image.pixels.data()};
  content.channelNames.assign(channelNames.begin(), channelNames.end());
  std::string order;
  for (const std::string& name : channelNames)
    order += (order.empty() ? "" : ",") + name;
  content.attributes.emplace_back(kChannelOrder, order);
  content.attributes.emplace_back("compression", "zip");
  write(path, "openexr", std::move(content), metadata);
}

Image readImage(const std::string& path) {
  const OpenedImage opened = openImage(path);
  const ImageFileHeader& header = opened.file->header();
  const glm::ivec2 size(header.width, header.height);
  const auto read = [&](SampleType type, void* pixels) {
    if (!opened.file->read(0, header.height, 0, header.channels, type, pixels)) {
      throw InputError(fmt::format("{}: damaged or cut short: {}", path, opened.file->error()));
    }
  };
  if (opened.format == "png") {
    std::vector<uint16_t> codes(size_t(header.width) * size_t(header.height) * size_t(header.channels));
    read(SampleType::u16, codes.data());
    return linearPicture(size, header.channels, codes);
  }
  Image image(size, header.channels);
  read(SampleType::f32, image.pixels.data());
  return inWrittenOrder(std::move(image), *opened.file);
}

std::string readImageCommand(const std::string& path) {
  return openImage(path).file->text("Command");
}

}  // namespace freevoxel
