// The module behind base/image_library.h.
#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <iterator>

#include "base/image_library.h"

namespace freevoxel {

namespace {

namespace oiio = OIIO;

constexpr oiio::TypeDesc::BASETYPE kTypes[] = {oiio::TypeDesc::UINT8, oiio::TypeDesc::INT8,   oiio::TypeDesc::UINT16,
                                               oiio::TypeDesc::INT16, oiio::TypeDesc::UINT32, oiio::TypeDesc::INT32,
                                               oiio::TypeDesc::HALF,  oiio::TypeDesc::FLOAT,  oiio::TypeDesc::DOUBLE};

SampleType sampleType(oiio::TypeDesc type) {
  return SampleType(std::find(std::begin(kTypes), std::end(kTypes), type.basetype) - std::begin(kTypes));
}

oiio::TypeDesc typeOf(SampleType type) {
  return kTypes[int(type)];
}

/// The library's messages run over several lines; ours have one.
std::string firstLine(std::string text) {
  text.erase(std::find(text.begin(), text.end(), '\n'), text.end());
  return text.empty() ? "unknown reason" : text;
}

class Reader final : public ImageFileReader {
 public:
  explicit Reader(std::unique_ptr<oiio::ImageInput> input, std::unique_ptr<oiio::Filesystem::IOMemReader> bytes = {})
      : bytes_(std::move(bytes)), input_(std::move(input)) {
    describe();
  }
  const ImageFileHeader& header() const override { return header_; }
  std::string text(const std::string& name) const override { return input_->spec().get_string_attribute(name); }
  bool select(int picture) override {
    if (!input_->seek_subimage(picture, 0)) return false;
    picture_ = picture;
    describe();
    return true;
  }
  bool read(int firstRow, int lastRow, int firstChannel, int lastChannel, SampleType type, void* out) override {
    const bool whole = firstRow == 0 && lastRow == header_.height;
    const bool read =
        whole ? input_->read_image(picture_, 0, firstChannel, lastChannel, typeOf(type), out)
              : input_->read_scanlines(picture_, 0, firstRow, lastRow, 0, firstChannel, lastChannel, typeOf(type), out);
    return read && !input_->has_error();
  }
  std::string error() override { return firstLine(input_->geterror()); }

 private:
  void describe() {
    const oiio::ImageSpec& spec = input_->spec();
    header_ = {spec.width,
               spec.height,
               spec.depth,
               spec.nchannels,
               sampleType(spec.format),
               spec.format.c_str(),
               spec.deep,
               spec.image_bytes(true),
               spec.channelnames};
  }

  std::unique_ptr<oiio::Filesystem::IOMemReader> bytes_;  ///< outlives the input
  std::unique_ptr<oiio::ImageInput> input_;
  ImageFileHeader header_;
  int picture_ = 0;
};

class OpenImageIo final : public ImageLibrary {
 public:
  OpenImageIo() {
    // Its thread pools would compete with ours and, started inside a library call, outlive it. -1 means none at all.
    oiio::attribute("threads", 1);
    oiio::attribute("exr_threads", -1);
  }

  std::unique_ptr<ImageFileReader> open(const std::string& path, const std::string& format,
                                        std::string& error) const override {
    const oiio::ImageSpec wishes = separateAlpha();
    if (format.empty()) {
      auto input = oiio::ImageInput::open(path, &wishes);
      if (!input) {
        error = firstLine(oiio::geterror());
        return nullptr;
      }
      return std::make_unique<Reader>(std::move(input));
    }
    auto input = oiio::ImageInput::create(format);
    oiio::ImageSpec ignored;
    if (!input || !input->open(path, ignored, wishes)) {
      error = firstLine(input ? input->geterror() : oiio::geterror());
      return nullptr;
    }
    return std::make_unique<Reader>(std::move(input));
  }

  std::unique_ptr<ImageFileReader> openBytes(const std::string& name, std::string_view bytes,
                                             std::string& error) const override {
    auto reader = std::make_unique<oiio::Filesystem::IOMemReader>(const_cast<char*>(bytes.data()), bytes.size());
    const oiio::ImageSpec wishes = separateAlpha();
    auto input = oiio::ImageInput::open(name, &wishes, reader.get());
    if (!input) {
      error = firstLine(oiio::geterror());
      return nullptr;
    }
    return std::make_unique<Reader>(std::move(input), std::move(reader));
  }

  std::string write(const std::string& path, const std::string& format,
                    const ImageFileContent& content) const override {
    oiio::ImageSpec spec(content.width, content.height, int(content.channelNames.size()), typeOf(content.type));
    spec.channelnames = content.channelNames;
    spec.alpha_channel = content.separateAlpha ? spec.nchannels - 1 : -1;
    if (content.separateAlpha) spec.attribute("oiio:UnassociatedAlpha", 1);
    spec.attribute("DateTime", "");  // else today's: equal pictures should be equal files
    for (const auto& [name, text] : content.attributes)
      spec.attribute(name, text);
    const auto output = oiio::ImageOutput::create(format);
    if (!output) return firstLine(oiio::geterror());
    const bool written =
        output->open(path, spec) && output->write_image(typeOf(content.type), content.pixels) && output->close();
    return written ? "" : firstLine(output->geterror());
  }

 private:
  static oiio::ImageSpec separateAlpha() {
    oiio::ImageSpec wishes;
    wishes["oiio:UnassociatedAlpha"] = 1;
    return wishes;
  }
};

}  // namespace

extern "C" __attribute__((visibility("default"))) const ImageLibrary* freevoxelImageLibrary();
const ImageLibrary* freevoxelImageLibrary() {
  static const OpenImageIo library;
  return &library;
}

}  // namespace freevoxel
