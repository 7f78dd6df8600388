#include <memory>

#include "base/error.h"
#include "base/image.h"
#include "base/image_library.h"
#include "volume/byte_source.h"
#include "voxlink/read_assimp.h"

namespace freevoxel {

namespace {

MeanColour meanOf(ImageFileReader& input, const std::string& name) {
  const ImageFileHeader& header = input.header();
  if (header.width < 1 || header.height < 1 || header.depth != 1 || header.channels < 1 || header.channels > 4) {
    throw InputError(fmt::format("{}: expected a picture of 1 to 4 channels, found {} x {} x {} of {}", name,
                                 header.width, header.height, header.depth, header.channels));
  }
  const int channels = header.channels;
  const bool grey = channels < 3, hasAlpha = channels == 2 || channels == 4;
  std::vector<float> row(size_t(header.width) * size_t(channels));
  glm::dvec3 sum(0.0);
  double alpha = 0.0;
  for (int y = 0; y < header.height; ++y) {
    if (!input.read(y, y + 1, 0, channels, SampleType::f32, row.data())) {
      throw InputError(fmt::format("{}: row {}: {}", name, y, input.error()));
    }
    for (int x = 0; x < header.width; ++x) {
      const float* texel = row.data() + size_t(x) * size_t(channels);
      for (int c = 0; c < 3; ++c)
        sum[c] += double(linearFromSrgb(texel[grey ? 0 : c]));
      alpha += hasAlpha ? double(texel[channels - 1]) : 1.0;
    }
  }
  const double texels = double(header.width) * double(header.height);
  return {glm::vec3(sum / texels), float(alpha / texels)};
}

}  // namespace

MeanColour meanOfTexture(const std::string& path) {
  openPlain(path, 0);  // nothing but a regular file
  std::string error;
  const std::unique_ptr<ImageFileReader> input = imageLibrary().open(path, "", error);
  if (!input) throw InputError(fmt::format("{}: {}", path, error));
  return meanOf(*input, path);
}

MeanColour meanOfTexture(const std::string& name, std::string_view bytes) {
  std::string error;
  const std::unique_ptr<ImageFileReader> input = imageLibrary().openBytes(name, bytes, error);
  if (!input) throw InputError(fmt::format("{}: {}", name, error));
  return meanOf(*input, name);
}

}  // namespace freevoxel
