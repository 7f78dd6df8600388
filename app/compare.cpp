// freevoxel compare: how far two pictures are apart.
#include "base/compare.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

#include "app/command.h"
#include "app/input_file.h"
#include "base/error.h"

namespace freevoxel {

namespace {

struct CompareOptions {
  std::string a, b;
  bool json = false;
  std::string differencePath;
  double gain = 1.0;
  std::optional<double> minPsnr;
  bool identical = false;
};

/// Without the fourth channel. Colours are premultiplied, so they are the picture over black, as an opaque PNG is.
Image withoutAlpha(const Image& image) {
  Image colours(image.size, 3);
  for (size_t i = 0, count = image.pixels.size() / 4; i < count; ++i) {
    std::copy_n(image.pixels.begin() + ptrdiff_t(4 * i), 3, colours.pixels.begin() + ptrdiff_t(3 * i));
  }
  return colours;
}

/// JSON has no infinity; the largest double reads back as what it is, larger than any error.
double finite(double value) {
  return std::clamp(value, -std::numeric_limits<double>::max(), std::numeric_limits<double>::max());
}

nlohmann::ordered_json toJson(const ImageDifference& difference) {
  constexpr double kMaxPsnr = 999.0;
  return {{"identical", difference.identical},
          {"psnr", std::clamp(difference.psnr, -kMaxPsnr, kMaxPsnr)},
          {"ssim", difference.ssim},
          {"rms", finite(difference.rms)},
          {"maxError", finite(difference.maxError)},
          {"differingBytes", difference.differingBytes},
          {"coveredPixels", difference.coveredPixels}};
}

Outcome compare(const CompareOptions& options, Session& session) {
  Image a = session.timed("read", [&] { return readImage(options.a); });
  Image b = session.timed("read", [&] { return readImage(options.b); });
  const bool colourOnly = std::min(a.channels, b.channels) == 3 && std::max(a.channels, b.channels) == 4;
  if (colourOnly) {
    session.warn("one picture has alpha and the other has not: comparing colours over black");
    (a.channels == 4 ? a : b) = withoutAlpha(a.channels == 4 ? a : b);
  }
  ImageDifference difference = session.timed("compare", [&] { return compareImages(a, b); });
  if (colourOnly) difference.identical = false;
  if (!options.differencePath.empty()) {
    writePng(options.differencePath, differenceImage(a, b, float(options.gain)), session.imageMetadata());
  }
  const nlohmann::ordered_json values = toJson(difference);
  if (options.json) {
    fmt::print("{}\n", values.dump(2));
  } else {
    fmt::print(
        "{}; PSNR {:.2f} dB, SSIM {:.5f}, RMS {:.3g}, largest error {:.3g}, {} bytes differ, {} pixels covered\n",
        difference.identical ? "identical" : "different", difference.psnr, difference.ssim, difference.rms,
        difference.maxError, difference.differingBytes, difference.coveredPixels);
  }
  session.statistics.update(values);
  if (options.identical && !difference.identical) {
    session.complain(
        fmt::format("{} and {} are not identical: {} bytes differ", options.a, options.b, difference.differingBytes));
    return Outcome::failed;
  }
  if (options.minPsnr && !(difference.psnr >= *options.minPsnr)) {
    session.complain(fmt::format("{} and {} are too far apart: PSNR {:.2f} dB is below {}", options.a, options.b,
                                 difference.psnr, *options.minPsnr));
    return Outcome::failed;
  }
  return Outcome::done;
}

}  // namespace

Command addCompare(CLI::App& program, CommonOptions& common) {
  auto options = std::make_shared<CompareOptions>();
  CLI::App* command = addSubcommand(program, "compare", "measure how far two pictures are apart",
                                    "freevoxel compare splats.exr reference.exr --min-psnr 45");
  command->add_option("A", options->a, "PNG or EXR; also --sums files")->required();
  command->add_option("B", options->b, "as A; size and channels must agree")->required();
  command->add_flag("--json", options->json,
                    "print JSON: identical, psnr (dB, within -999..999), ssim, rms, maxError, differingBytes, "
                    "coveredPixels");
  command->add_option("--diff", options->differencePath, "write the absolute difference as a picture")
      ->type_name("FILE.png");
  addParsed<double>(*command, "--gain", options->gain, "FACTOR",
                    fmt::format("brightens the picture of --diff (default {})", options->gain), parseNumber)
      ->needs("--diff");
  addParsed(*command, "--min-psnr", options->minPsnr, "DB", "exit status 1 if the PSNR is lower", parseNumber);
  command->add_flag("--identical", options->identical, "exit status 1 if a byte differs");
  addCommonOptions(*command, common);
  return {command, [options](Session& session) { return compare(*options, session); }};
}

}  // namespace freevoxel
