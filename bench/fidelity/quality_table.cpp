#include <fmt/core.h>

#include <algorithm>
#include <map>
#include <optional>
#include <tuple>

#include "base/progress.h"
#include "bench/fidelity/measured.h"
#include "bench/fidelity/references.h"
#include "bench/fidelity/tables.h"
#include "splat/splat.h"

namespace freevoxel::bench {

namespace {

constexpr double kConvergedStep = 0.125;

/// How one row's pictures are made: by splats, or by a ray caster.
struct Row {
  std::string name;
  std::optional<SplatOptions> splats;
  std::optional<BlendKernel> blended;
  Classification classification = Classification::preintegrated;  ///< of the attenuation file
  RaycastOptions raycast;
};

SplatOptions splats(Formula formula, Footprint footprint, AttenuationSource source) {
  SplatOptions options;
  options.formula = formula;
  options.footprint = footprint;
  options.attenuation = source;
  return options;
}

constexpr const char* kOneVoxel = "ray casting, a step of one voxel";
constexpr const char* kOrdered = "`blended` in order, normalised kernel";

std::string cellRow(AttenuationSource source) {
  return fmt::format("**`normalised`, cell, {}**", attenuationSourceName(source));
}

std::vector<Row> allRows() {
  constexpr Footprint kKernel = Footprint::kernel, kCell = Footprint::cell;
  constexpr AttenuationSource kSources[] = {AttenuationSource::interpolated, AttenuationSource::stored,
                                            AttenuationSource::swept};
  std::vector<Row> rows;
  const auto add = [&](const std::string& name, Formula formula, Footprint footprint, AttenuationSource source) {
    Row row;
    row.name = name;
    row.splats = splats(formula, footprint, source);
    // The rule `voxel` is what kernels were made for.
    if (footprint == kKernel) row.classification = Classification::voxel;
    rows.push_back(row);
  };
  Row coarse{kOneVoxel, {}, {}, Classification::preintegrated, {}};
  coarse.raycast.step = 1.0;
  rows.push_back(coarse);
  rows.push_back({kOrdered, {}, BlendKernel::normalised, Classification::voxel, {}});
  rows.push_back({"`blended` in order, Gaussian of peak 1", {}, BlendKernel::gaussian, Classification::voxel, {}});
  add("`paper`, kernel, nearest of 26", Formula::paper, kKernel, AttenuationSource::interpolated);
  add("`direct`, kernel, interpolated", Formula::direct, kKernel, AttenuationSource::interpolated);
  for (const AttenuationSource source : kSources)
    add(fmt::format("`normalised`, kernel, {}", attenuationSourceName(source)), Formula::normalised, kKernel, source);
  add("`direct`, cell, interpolated", Formula::direct, kCell, AttenuationSource::interpolated);
  add("`direct`, cell, swept", Formula::direct, kCell, AttenuationSource::swept);
  for (const AttenuationSource source : kSources)
    add(cellRow(source), Formula::normalised, kCell, source);
  return rows;
}

std::vector<Row> qualityRows(const std::vector<std::string>& wanted) {
  std::vector<Row> rows = allRows();
  const auto isWanted = [&](const Row& row) {
    return wanted.empty() || std::any_of(wanted.begin(), wanted.end(), [&](const std::string& part) {
             return row.name.find(part) != std::string::npos;
           });
  };
  rows.erase(std::remove_if(rows.begin(), rows.end(), [&](const Row& row) { return !isWanted(row); }), rows.end());
  return rows;
}

/// Draws a view once for all rows that differ only in how sums become a picture.
class ViewPictures {
 public:
  ViewPictures(Splatter& splatter, const Scene& scene, const Camera& view, const Folders& folders)
      : splatter_(splatter), scene_(scene), view_(view), folders_(folders) {}

  Image of(const Row& row) {
    if (row.blended) return splatter_.renderBlended(view_, *row.blended, {}, silentProgress()).image;
    if (!row.splats) return reference(scene_, view_, row.raycast, folders_);
    const bool paper = row.splats->formula == Formula::paper;
    const auto [place, isNew] = drawn_.try_emplace({row.splats->footprint, row.splats->attenuation, paper});
    if (isNew) place->second = splatter_.render(view_, *row.splats, silentProgress()).sums;
    return resolve(place->second, row.splats->formula);
  }

 private:
  Splatter& splatter_;
  const Scene& scene_;
  const Camera& view_;
  const Folders& folders_;
  std::map<std::tuple<Footprint, AttenuationSource, bool>, Sums> drawn_;
};

RaycastOptions converged(RaycastClassification classification) {
  RaycastOptions options;
  options.classification = classification;
  options.step = kConvergedStep;
  return options;
}

/// What DESIGN section 12 asks of cells, as differences in dB; a minus is a miss where the head says so.
void addBars(Table& table, const Scene& scene, const std::map<std::string, double>& pooled) {
  if (table.head.empty()) {
    table.head = {"volume",
                  "swept less one-voxel ray casting (real volumes: above 0)",
                  "interpolated less ordered blending (above 0)",
                  "interpolated less one-voxel ray casting (real: above -3)",
                  "stored less ordered blending (above 0)",
                  "stored less one-voxel ray casting (real: above -3)"};
  }
  const auto difference = [&](AttenuationSource source, const char* other) -> std::string {
    const auto a = pooled.find(cellRow(source)), b = pooled.find(other);
    return a == pooled.end() || b == pooled.end() ? "-" : fmt::format("{:+.1f}", a->second - b->second);
  };
  table.rows.push_back(
      {scene.source.title + (scene.source.real() ? "" : " (procedural)"),
       difference(AttenuationSource::swept, kOneVoxel), difference(AttenuationSource::interpolated, kOrdered),
       difference(AttenuationSource::interpolated, kOneVoxel), difference(AttenuationSource::stored, kOrdered),
       difference(AttenuationSource::stored, kOneVoxel)});
}

}  // namespace

void castReferences(const Scene& scene, const TableOptions& options) {
  RaycastOptions coarse;
  coarse.step = 1.0;
  for (const Camera& view : randomViews(scene.bounds(), options.views, options.imageSize)) {
    for (const RaycastOptions& how :
         {converged(RaycastClassification::post), converged(RaycastClassification::pre), coarse}) {
      reference(scene, view, how, options.folders);
    }
  }
}

void addQuality(QualityTables& tables, const Scene& scene, const TableOptions& options) {
  const std::vector<Row> rows = qualityRows(options.rows);
  for (Table* table : {&tables.post, &tables.pre}) {
    if (table->head.empty()) {
      table->head = {""};
      for (const Row& row : rows)
        table->rows.push_back({row.name});
    }
    table->head.push_back(scene.source.title);
  }
  const std::vector<Camera> views = randomViews(scene.bounds(), options.views, options.imageSize);
  const RaycastOptions post = converged(RaycastClassification::post), pre = converged(RaycastClassification::pre);
  std::vector<Image> postReferences, preReferences;
  for (const Camera& view : views) {
    postReferences.push_back(reference(scene, view, post, options.folders));
    preReferences.push_back(reference(scene, view, pre, options.folders));
  }
  std::map<std::string, double> pooled;
  std::vector<std::string> ofPost(rows.size()), ofPre(rows.size());
  for (const Classification classification : {Classification::voxel, Classification::preintegrated}) {
    const AttenuationFile file = attenuationFile(scene, classification, options.folders);
    Splatter splatter(scene.grid, &file, scene.transfer, Backend::cpu);
    std::vector<Measured> fromPost(rows.size()), fromPre(rows.size());
    for (size_t i = 0; i < views.size(); ++i) {
      ViewPictures pictures(splatter, scene, views[i], options.folders);
      for (size_t r = 0; r < rows.size(); ++r) {
        if (rows[r].classification != classification) continue;
        const Image picture = pictures.of(rows[r]);
        fromPost[r].add(compareImages(picture, postReferences[i]));
        fromPre[r].add(compareImages(picture, preReferences[i]));
      }
    }
    for (size_t r = 0; r < rows.size(); ++r) {
      if (rows[r].classification != classification) continue;
      pooled[rows[r].name] = fromPost[r].pooled();
      ofPost[r] = fromPost[r].text();
      ofPre[r] = fromPre[r].text();
    }
  }
  for (size_t r = 0; r < rows.size(); ++r) {
    tables.post.rows[r].push_back(ofPost[r]);
    tables.pre.rows[r].push_back(ofPre[r]);
  }
  addBars(tables.bars, scene, pooled);
}

}  // namespace freevoxel::bench
