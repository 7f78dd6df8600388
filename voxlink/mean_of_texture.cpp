#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <memory>

#include "base/error.h"
#include "base/image.h"
#include "volume/byte_source.h"
#include "voxlink/read_assimp.h"

namespace freevoxel {

namespace {

namespace oiio = OIIO;

MeanColour meanOf(oiio::ImageInput& input, const std::string& name) {
  const oiio::ImageSpec spec = input.spec();
  if (spec.width < 1 || spec.height < 1 || spec.depth != 1 || spec.nchannels < 1 || spec.nchannels > 4) {
    throw InputError(fmt::format("{}: expected a picture of 1 to 4 channels, found {} x {} x {} of {}", name,
                                 spec.width, spec.height, spec.depth, spec.nchannels));
  }
  const int channels = spec.nchannels;
  const bool grey = channels < 3, hasAlpha = channels == 2 || channels == 4;
  std::vector<float> row(size_t(spec.width) * size_t(channels));
  glm::dvec3 sum(0.0);
  double alpha = 0.0;
  for (int y = 0; y < spec.height; ++y) {
    if (!input.read_scanlines(0, 0, y, y + 1, 0, 0, channels, oiio::TypeDesc::FLOAT, row.data())) {
      throw InputError(fmt::format("{}: row {}: {}", name, y, input.geterror()));
    }
    for (int x = 0; x < spec.width; ++x) {
      const float* texel = row.data() + size_t(x) * size_t(channels);
      for (int c = 0; c < 3; ++c)
        sum[c] += double(linearFromSrgb(texel[grey ? 0 : c]));
      alpha += hasAlpha ? double(texel[channels - 1]) : 1.0;
    }
  }
  const double texels = double(spec.width) * double(spec.height);
  return {glm::vec3(sum / texels), float(alpha / texels)};
}

oiio::ImageSpec notPremultiplied() {
  oiio::ImageSpec configuration;
  configuration["oiio:UnassociatedAlpha"] = 1;
  return configuration;
}

}  // namespace

MeanColour meanOfTexture(const std::string& path) {
  openPlain(path, 0);  // nothing but a regular file
  const oiio::ImageSpec configuration = notPremultiplied();
  const std::unique_ptr<oiio::ImageInput> input = oiio::ImageInput::open(path, &configuration);
  if (!input) throw InputError(fmt::format("{}: {}", path, oiio::geterror()));
  return meanOf(*input, path);
}

MeanColour meanOfTexture(const std::string& name, std::string_view bytes) {
  oiio::Filesystem::IOMemReader reader(const_cast<char*>(bytes.data()), bytes.size());
  const oiio::ImageSpec configuration = notPremultiplied();
  const std::unique_ptr<oiio::ImageInput> input = oiio::ImageInput::open(name, &configuration, &reader);
  if (!input) throw InputError(fmt::format("{}: {}", name, oiio::geterror()));
  return meanOf(*input, name);
}

}  // namespace freevoxel
