#include <fmt/core.h>

#include <algorithm>
#include <filesystem>

#include "base/compare.h"
#include "base/error.h"
#include "bench/hierarchy/tables.h"
#include "splat/splat.h"

namespace freevoxel::bench {

void addRefinement(Table& table, const Scene& scene, const TableOptions& options) {
  if (table.head.empty()) {
    table.head = {"volume",           "pictures, fewest", "first, dB",
                  "last but one, dB", "largest fall, dB", "PSNR of the first view's pictures, dB"};
  }
  const AttenuationFile file = levelFile(scene, Hierarchy::geometric, 0, options.folders);
  Splatter splatter(file, scene.transfer, Backend::cpu);
  size_t fewest = SIZE_MAX;
  double first = INFINITY, last = INFINITY, fall = 0.0;
  std::string course;
  for (const Camera& view : randomViews(scene.bounds(), options.views, glm::ivec2(options.imageSize))) {
    std::vector<Image> pictures;
    const SplatResult refined = splatter.refine(
        view, {},
        [&](size_t n, const Sums& sums) {
          pictures.resize(n);
          pictures.push_back(resolve(sums, Formula::normalised));
        },
        silentProgress());
    const SplatResult direct = splatter.render(view, {}, silentProgress());
    if (refined.sums.image.pixels != direct.sums.image.pixels || refined.sums.quantum != direct.sums.quantum)
      throw InternalError("internal error: the last picture is not the direct one");
    std::vector<double> psnr;
    for (size_t n = 0; n + 1 < pictures.size(); ++n)
      psnr.push_back(compareImages(pictures[n], pictures.back()).psnr);
    fewest = std::min(fewest, pictures.size());
    first = std::min(first, psnr.front());
    last = std::min(last, psnr.back());
    for (size_t n = 1; n < psnr.size(); ++n)
      fall = std::max(fall, psnr[n - 1] - psnr[n]);
    if (!course.empty()) continue;
    for (const double value : psnr)
      course += fmt::format("{}{:.1f}", course.empty() ? "" : ", ", value);
  }
  table.rows.push_back({scene.source.title, fmt::format("{}", fewest), fmt::format("{:.1f}", first),
                        fmt::format("{:.1f}", last), fmt::format("{:.2f}", fall), course});
  fmt::print(stderr, "{}: fall {:.2f}: {}\n", scene.source.title, fall, course);
  std::filesystem::remove(file.path());
}

}  // namespace freevoxel::bench
