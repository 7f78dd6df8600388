#include "base/image.h"

#include <OpenImageIO/imageio.h>
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
#include "base/mapped_file.h"

namespace freevoxel {

namespace {

namespace oiio = OIIO;

constexpr int kMaxImageSize = 32768;  // as in checkCamera
constexpr int kMaxChannels = 64;
/// No picture packs better than this: a damaged header must not make us reserve memory for pixels that cannot be there.
/// (Deflate, in PNG and most EXR files, reaches 1032.)
constexpr uint64_t kMaxCompression = 4096;

/// EXR files keep their channels sorted by name; this attribute remembers the order they were given in.
constexpr const char* kChannelOrder = "ChannelOrder";

void quietOpenImageIo() {
  // Its thread pools would compete with ours and, started inside a library call, outlive it. -1 means none at all.
  [[maybe_unused]] static const bool once = [] {
    oiio::attribute("threads", 1);
    oiio::attribute("exr_threads", -1);
    return true;
  }();
}

/// The library's messages run over several lines; ours have one.
std::string firstLine(std::string text) {
  text.erase(std::find(text.begin(), text.end(), '\n'), text.end());
  return text.empty() ? "unknown reason" : text;
}

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
  std::unique_ptr<oiio::ImageInput> input;
  oiio::ImageSpec spec;
  std::string format;
};

OpenedImage openImage(const std::string& path) {
  quietOpenImageIo();
  OpenedImage opened;
  opened.format = checkedFormat(path);
  opened.input = oiio::ImageInput::create(opened.format);
  if (!opened.input) throw InternalError("OpenImageIO has no reader for " + opened.format);
  oiio::ImageSpec wishes;
  wishes["oiio:UnassociatedAlpha"] = 1;
  if (!opened.input->open(path, opened.spec, wishes)) {
    throw InputError(fmt::format("{}: damaged header: {}", path, firstLine(opened.input->geterror())));
  }
  const oiio::ImageSpec& spec = opened.spec;
  if (spec.width < 1 || spec.height < 1 || spec.width > kMaxImageSize || spec.height > kMaxImageSize ||
      spec.depth > 1 || spec.nchannels < 1 || spec.nchannels > kMaxChannels || spec.deep) {
    throw InputError(fmt::format("{}: expected up to {} x {} pixels of 1..{} channels, found {} x {} of {}{}", path,
                                 kMaxImageSize, kMaxImageSize, kMaxChannels, spec.width, spec.height, spec.nchannels,
                                 spec.deep ? " (deep)" : ""));
  }
  const uint64_t fileBytes = std::filesystem::file_size(path);
  if (spec.image_bytes(true) / kMaxCompression > fileBytes) {
    throw InputError(fmt::format("{}: cut short: {} x {} pixels of {} channels cannot lie in {} bytes", path,
                                 spec.width, spec.height, spec.nchannels, fileBytes));
  }
  return opened;
}

/// Channels as the writer ordered them, where the file says so and names each of them once.
Image inWrittenOrder(Image image, const oiio::ImageSpec& spec) {
  std::vector<int> source;
  std::string order = spec.get_string_attribute(kChannelOrder);
  for (size_t begin = 0; begin < order.size();) {
    const size_t end = std::min(order.find(',', begin), order.size());
    const auto found = std::find(spec.channelnames.begin(), spec.channelnames.end(), order.substr(begin, end - begin));
    source.push_back(int(found - spec.channelnames.begin()));
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

void write(const std::string& path, const char* format, oiio::ImageSpec spec, const oiio::TypeDesc& type,
           const void* pixels, const ImageMetadata& metadata) {
  quietOpenImageIo();
  spec.attribute("DateTime", "");  // else today's: equal pictures should be equal files
  for (const auto& [name, text] : metadata)
    spec.attribute(name, text);
  AtomicFile file(path);
  const std::unique_ptr<oiio::ImageOutput> output = oiio::ImageOutput::create(format);
  if (!output) throw InternalError(std::string("OpenImageIO has no writer for ") + format);
  if (!output->open(file.temporaryPath(), spec) || !output->write_image(type, pixels) || !output->close()) {
    throw MachineError(fmt::format("{}: cannot write the image: {}", path, firstLine(output->geterror())));
  }
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
  oiio::ImageSpec spec(image.size.x, image.size.y, channels, oiio::TypeDesc::UINT8);
  spec.attribute("oiio:ColorSpace", "sRGB");
  spec.attribute("oiio:UnassociatedAlpha", 1);
  write(path, "png", std::move(spec), oiio::TypeDesc::UINT8, bytes.data(), metadata);
}

void writeExr(const std::string& path, const Image& image, std::span<const std::string> channelNames,
              const ImageMetadata& metadata) {
  checkEqual(channelNames.size(), size_t(image.channels), "number of channel names");
  oiio::ImageSpec spec(image.size.x, image.size.y, image.channels, oiio::TypeDesc::FLOAT);
  spec.channelnames.assign(channelNames.begin(), channelNames.end());
  spec.alpha_channel = -1;
  std::string order;
  for (const std::string& name : channelNames)
    order += (order.empty() ? "" : ",") + name;
  spec.attribute(kChannelOrder, order);
  spec.attribute("compression", "zip");
  write(path, "openexr", std::move(spec), oiio::TypeDesc::FLOAT, image.pixels.data(), metadata);
}

Image readImage(const std::string& path) {
  const OpenedImage opened = openImage(path);
  const oiio::ImageSpec& spec = opened.spec;
  const glm::ivec2 size(spec.width, spec.height);
  const auto read = [&](const oiio::TypeDesc& type, void* pixels) {
    if (!opened.input->read_image(0, 0, 0, spec.nchannels, type, pixels)) {
      throw InputError(fmt::format("{}: damaged or cut short: {}", path, firstLine(opened.input->geterror())));
    }
  };
  if (opened.format == "png") {
    std::vector<uint16_t> codes(spec.image_pixels() * size_t(spec.nchannels));
    read(oiio::TypeDesc::UINT16, codes.data());
    return linearPicture(size, spec.nchannels, codes);
  }
  Image image(size, spec.nchannels);
  read(oiio::TypeDesc::FLOAT, image.pixels.data());
  return inWrittenOrder(std::move(image), spec);
}

std::string readImageCommand(const std::string& path) {
  return openImage(path).spec.get_string_attribute("Command");
}

}  // namespace freevoxel
