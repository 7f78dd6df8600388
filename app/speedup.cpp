// freevoxel speedup: how much faster several ranks draw a picture (papers/freevoxels Fig. 8; DESIGN section 9).
#include <fmt/core.h>
#include <time.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstring>
#include <glm/glm.hpp>
#include <memory>
#include <numbers>
#include <numeric>
#include <optional>

#include "app/command.h"
#include "app/input_file.h"
#include "app/plot.h"
#include "app/shared_drawing.h"
#include "base/error.h"
#include "hierarchy/attenuation_file.h"
#include "parallel/composite_cost.h"
#include "splat/splat.h"

namespace freevoxel {

namespace {

constexpr int kMostRanks = 65536, kMostViews = 4096, kMostRepeats = 100;

struct SpeedupOptions {
  std::string input;
  std::vector<int> ranks = {8, 16, 32, 64, 96, 128};
  std::vector<Partition> partitions = {Partition{}};
  std::vector<int> blockEdges = {kBlockEdge};
  int views = 1, repeats = 1;
  bool countOnly = false, json = false;
  bool processorTime = false;
  std::vector<std::string> plots;
  CameraOptions camera;
  SplatOptions splat;
  Backend backend = Backend::automatic;
};

/// One number of ranks, partition and block edge, over all views.
struct Row {
  int ranks = 1;
  std::string partition;
  int blockEdge = kBlockEdge;
  uint64_t blocks = 0;
  // Mean over largest of a rank: means over views, and the worst view.
  double balance = 0.0, worstBalance = 1.0;  ///< of splats: visible voxels of blocks in view, or kernels drawn
  double balancePieces = 0.0, worstBalancePieces = 1.0;  ///< of what is traced: pieces of rays, or fragments
  // Sums over views.
  double oneSeconds = 0.0;      ///< one rank alone
  double slowestSeconds = 0.0;  ///< the slowest rank of each view
  double compositeSeconds = 0.0;
  double sentBytes = 0.0;  ///< per frame, by the rank that sends most

  double speedup() const { return oneSeconds / slowestSeconds; }
  double speedupWithComposite() const { return oneSeconds / (slowestSeconds + compositeSeconds); }
};

/// Seconds since some moment: of the clock on the wall, or that processors have worked for this process.
double secondsNow(bool processorTime) {
  if (!processorTime) return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
  timespec time{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return double(time.tv_sec) + 1e-9 * double(time.tv_nsec);
}

template <class T>
std::vector<T> parseList(std::string_view text, T (*parse)(std::string_view)) {
  std::vector<T> values;
  for (;;) {
    const size_t comma = text.find(',');
    values.push_back(parse(text.substr(0, comma)));
    if (comma == std::string_view::npos) return values;
    text.remove_prefix(comma + 1);
  }
}

/// The camera's own view, or `count` directions spread evenly over the sphere (a Fibonacci lattice) round its target.
std::vector<Camera> viewsOf(const Camera& camera, int count) {
  if (count == 1) return {camera};
  std::vector<Camera> views;
  const double distance = glm::length(camera.eye - camera.target);
  for (int i = 0; i < count; ++i) {
    const double height = 1.0 - (2.0 * i + 1.0) / count;
    const double turn = 2.0 * std::numbers::pi * std::fmod(0.61803398874989485 * i, 1.0);
    const double radius = std::sqrt(1.0 - height * height);
    const glm::dvec3 direction(radius * std::sin(turn), height, radius * std::cos(turn));
    Camera view = camera;
    view.eye = view.target + distance * direction;
    view.up = std::abs(direction.y) < 0.99 ? glm::dvec3(0.0, 1.0, 0.0) : glm::dvec3(0.0, 0.0, 1.0);
    views.push_back(view);
  }
  return views;
}

/// What ranks do in one view, by rank.
struct RankWork {
  std::vector<uint64_t> splats, pieces;
  std::vector<double> seconds;
  explicit RankWork(int ranks) : splats(size_t(ranks)), pieces(size_t(ranks)), seconds(size_t(ranks)) {}
};

void addBalance(const RankWork& work, int views, Row& row) {
  const double splats = balance(work.splats), pieces = balance(work.pieces);
  row.balance += splats / views;
  row.balancePieces += pieces / views;
  row.worstBalance = std::min(row.worstBalance, splats);
  row.worstBalancePieces = std::min(row.worstBalancePieces, pieces);
}

/// Draws a share; the least time of several, since others on the machine can only add to it.
Sums timedDraw(Splatter& splatter, float quantum, std::span<const uint8_t> share, const SpeedupOptions& options,
               double& seconds) {
  Sums sums;
  seconds = INFINITY;
  for (int i = 0; i < options.repeats; ++i) {
    const double start = secondsNow(options.processorTime);
    sums = splatter.draw(quantum, share, silentProgress());
    seconds = std::min(seconds, secondsNow(options.processorTime) - start);
  }
  return sums;
}

/// The whole picture by one rank, at the first quantum that proves exact.
Sums drawWhole(Splatter& splatter, const SpeedupOptions& options, double& seconds) {
  for (float quantum = options.splat.firstQuantum;; quantum = nextQuantum(quantum)) {
    Sums sums = timedDraw(splatter, quantum, {}, options, seconds);
    if (sumsAreExact(sums)) return sums;
  }
}

bool sameBits(const Image& a, const Image& b) {
  return a.pixels.size() == b.pixels.size() &&
         std::memcmp(a.pixels.data(), b.pixels.data(), a.pixels.size() * sizeof(float)) == 0;
}

class Experiment {
 public:
  Experiment(const SpeedupOptions& options, const AttenuationFile& file, Session& session)
      : options_(options), file_(file), session_(session) {
    views_ = viewsOf(makeCamera(options.camera, worldBounds(file.placement(), file.dims())), options.views);
    if (!options.countOnly && !together()) rates_ = measureCompositeRates(options.camera.imageSize, kSumChannels);
  }

  std::vector<Row> run() {
    for (const int edge : options_.blockEdges) {
      Splatter splatter(file_, file_.transfer(), options_.backend, edge);
      const std::vector<SharedBlock> blocks = sharedBlocks(splatter.blocks());
      const size_t firstRow = rows_.size();
      const std::vector<int> counts = together() ? std::vector<int>{session_.ranks().rankCount()} : options_.ranks;
      std::vector<std::vector<int>> owners;
      for (const Partition& partition : options_.partitions) {
        for (const int ranks : counts) {
          Row row;
          row.ranks = ranks;
          row.partition = partitionName(partition);
          row.blockEdge = edge;
          row.blocks = blocks.size();
          rows_.push_back(row);
          owners.push_back(dealBlocks(blocks, partition, ranks));
        }
      }
      for (const Camera& view : views_) {
        if (options_.countOnly) {
          count(splatter, view, owners, firstRow);
        } else if (together()) {
          drawTogether(splatter, view, owners, firstRow);
        } else {
          drawVirtual(splatter, view, owners, firstRow);
        }
      }
    }
    return std::move(rows_);
  }

  const std::optional<CompositeRates>& rates() const { return rates_; }
  /// That every rank spends alike before it draws: attenuation towards the eye and the lamps. Sum over views and edges.
  double replicatedSeconds() const { return replicatedSeconds_; }

 private:
  bool together() const { return session_.ranks().rankCount() > 1; }

  void count(Splatter& splatter, const Camera& view, const std::vector<std::vector<int>>& owners, size_t firstRow) {
    const std::vector<BlockWork> work = splatter.countWork(view);
    for (size_t i = 0; i < owners.size(); ++i) {
      Row& row = rows_[firstRow + i];
      RankWork ofRanks(row.ranks);
      for (size_t block = 0; block < work.size(); ++block) {
        ofRanks.splats[size_t(owners[i][block])] += work[block].cells;
        ofRanks.pieces[size_t(owners[i][block])] += work[block].pixels;
      }
      addBalance(ofRanks, options_.views, row);
    }
  }

  /// What the share's splats are, as RankWork has them, after it was drawn.
  void note(Splatter& splatter, std::span<const uint8_t> share, const std::vector<BlockWork>& work, size_t rank,
            RankWork& ofRanks) const {
    const SplatStatistics& done = splatter.statistics();
    if (options_.splat.footprint == Footprint::kernel) {
      ofRanks.splats[rank] = done.splats;
    } else {
      for (size_t block = 0; block < work.size(); ++block)
        ofRanks.splats[rank] += share[block] != 0 ? work[block].cells : 0;
    }
    ofRanks.pieces[rank] = done.pieces > 0 ? done.pieces : done.fragments;
  }

  void prepare(Splatter& splatter, const Camera& view) {
    splatter.prepare(view, options_.splat);
    replicatedSeconds_ += splatter.statistics().attenuationSeconds + splatter.statistics().lightSeconds;
  }

  void drawVirtual(Splatter& splatter, const Camera& view, const std::vector<std::vector<int>>& owners,
                   size_t firstRow) {
    prepare(splatter, view);
    const std::vector<BlockWork> work = splatter.countWork(view);
    // Once for nothing: memory is there and the clock of the processor up.
    double oneSeconds = 0.0;
    drawWhole(splatter, options_, oneSeconds);
    const Sums whole = drawWhole(splatter, options_, oneSeconds);
    const std::vector<uint8_t> united = coveredCompositeTiles(whole.image);
    const auto unionTiles = uint64_t(std::count(united.begin(), united.end(), 1));
    uint64_t draws = 0;
    for (size_t i = 0; i < owners.size(); ++i)
      draws += uint64_t(rows_[firstRow + i].ranks);
    session_.progress().begin("drawing", draws, "shares");
    for (size_t i = 0; i < owners.size(); ++i) {
      Row& row = rows_[firstRow + i];
      RankWork ofRanks(row.ranks);
      Image sum(view.imageSize, kSumChannels);
      uint64_t mostCovered = 0;
      for (int rank = 0; rank < row.ranks; ++rank) {
        const std::vector<uint8_t> share = shareOf(owners[i], rank);
        const Sums part = timedDraw(splatter, whole.quantum, share, options_, ofRanks.seconds[size_t(rank)]);
        note(splatter, share, work, size_t(rank), ofRanks);
        const std::vector<uint8_t> covered = coveredCompositeTiles(part.image);
        mostCovered = std::max(mostCovered, uint64_t(std::count(covered.begin(), covered.end(), 1)));
        for (size_t v = 0; v < sum.pixels.size(); ++v)
          sum.pixels[v] += part.image.pixels[v];
        session_.progress().advance(1);
      }
      // The picture comes first: times of a wrong one are worth nothing.
      check(sameBits(sum, whole.image), "shares add up to the whole picture");
      addBalance(ofRanks, options_.views, row);
      row.oneSeconds += oneSeconds;
      row.slowestSeconds += *std::max_element(ofRanks.seconds.begin(), ofRanks.seconds.end());
      const CompositeCost cost =
          compositeCost(row.ranks, united.size(), mostCovered, unionTiles, kSumChannels, *rates_);
      row.compositeSeconds += cost.seconds;
      row.sentBytes = std::max(row.sentBytes, cost.sentBytes);
    }
    session_.progress().end();
  }

  void drawTogether(Splatter& splatter, const Camera& view, const std::vector<std::vector<int>>& owners,
                    size_t firstRow) {
    const Ranks& ranks = session_.ranks();
    prepare(splatter, view);
    const std::vector<BlockWork> work = splatter.countWork(view);
    Sums whole;
    double oneSeconds = 0.0;
    if (ranks.isRoot()) {
      drawWhole(splatter, options_, oneSeconds);
      whole = drawWhole(splatter, options_, oneSeconds);
    }
    ranks.agree();
    const float quantum = std::stof(ranks.gatherEverywhere(fmt::format("{:a}", whole.quantum))[0]);
    for (size_t i = 0; i < owners.size(); ++i) {
      Row& row = rows_[firstRow + i];
      const std::vector<uint8_t> share = shareOf(owners[i], ranks.rank());
      double drawSeconds = INFINITY, frameSeconds = INFINITY;
      uint64_t sentBytes = 0;
      for (int repeat = 0; repeat < options_.repeats; ++repeat) {
        Compositor compositor(ranks, view.imageSize, kSumChannels);
        ranks.agree();
        const double start = secondsNow(options_.processorTime);
        Sums part = splatter.draw(quantum, share, silentProgress());
        const double drawn = secondsNow(options_.processorTime) - start;
        compositor.add(part.image, exactLimits(quantum));
        const double frame = secondsNow(options_.processorTime) - start;
        if (ranks.isRoot()) check(sameBits(part.image, whole.image), "shares add up to the whole picture");
        sentBytes = compositor.traffic().sentBytes;
        drawSeconds = std::min(drawSeconds, drawn);
        frameSeconds = std::min(frameSeconds, frame);
      }
      RankWork mine(row.ranks);
      note(splatter, share, work, size_t(ranks.rank()), mine);
      const nlohmann::json told = {mine.splats[size_t(ranks.rank())], mine.pieces[size_t(ranks.rank())], drawSeconds,
                                   frameSeconds, sentBytes};
      ranks.agree();
      const std::vector<std::string> all = ranks.gatherEverywhere(told.dump());
      RankWork ofRanks(row.ranks);
      double slowestFrame = 0.0;
      for (size_t rank = 0; rank < all.size(); ++rank) {
        const nlohmann::json one = nlohmann::json::parse(all[rank]);
        ofRanks.splats[rank] = one[0];
        ofRanks.pieces[rank] = one[1];
        ofRanks.seconds[rank] = one[2];
        slowestFrame = std::max(slowestFrame, one[3].get<double>());
        row.sentBytes = std::max(row.sentBytes, one[4].get<double>());
      }
      addBalance(ofRanks, options_.views, row);
      const double slowest = *std::max_element(ofRanks.seconds.begin(), ofRanks.seconds.end());
      row.oneSeconds += oneSeconds;
      row.slowestSeconds += slowest;
      row.compositeSeconds += std::max(0.0, slowestFrame - slowest);
    }
  }

  const SpeedupOptions& options_;
  const AttenuationFile& file_;
  Session& session_;
  std::vector<Camera> views_;
  std::optional<CompositeRates> rates_;
  std::vector<Row> rows_;
  double replicatedSeconds_ = 0.0;
};

nlohmann::ordered_json rowJson(const Row& row, const SpeedupOptions& options) {
  nlohmann::ordered_json json = {{"ranks", row.ranks},
                                 {"partition", row.partition},
                                 {"block", row.blockEdge},
                                 {"blocks", row.blocks},
                                 {"balance", row.balance},
                                 {"worstBalance", row.worstBalance},
                                 {"balancePieces", row.balancePieces},
                                 {"worstBalancePieces", row.worstBalancePieces}};
  if (options.countOnly) return json;
  json["oneSeconds"] = row.oneSeconds / options.views;
  json["slowestSeconds"] = row.slowestSeconds / options.views;
  json["compositeSeconds"] = row.compositeSeconds / options.views;
  json["sentBytes"] = row.sentBytes;
  json["speedup"] = row.speedup();
  json["efficiency"] = row.speedup() / row.ranks;
  json["speedupWithComposite"] = row.speedupWithComposite();
  json["efficiencyWithComposite"] = row.speedupWithComposite() / row.ranks;
  return json;
}

std::string table(const std::vector<Row>& rows, const SpeedupOptions& options) {
  std::string text = fmt::format("{:>6} {:<14} {:>5} {:>7} {:>7} {:>7} {:>7} {:>7}", "ranks", "partition", "block",
                                 "blocks", "balance", "worst", "pieces", "worst");
  if (!options.countOnly) {
    text += fmt::format(" {:>9} {:>9} {:>8} {:>6} {:>9} {:>9} {:>6}", "T(1) ms", "max T ms", "speedup", "eff.",
                        "comp. ms", "speedup", "eff.");
  }
  text += '\n';
  for (const Row& row : rows) {
    text += fmt::format("{:>6} {:<14} {:>5} {:>7} {:>7.4f} {:>7.4f} {:>7.4f} {:>7.4f}", row.ranks, row.partition,
                        row.blockEdge, row.blocks, row.balance, row.worstBalance, row.balancePieces,
                        row.worstBalancePieces);
    if (!options.countOnly) {
      text += fmt::format(" {:>9.2f} {:>9.2f} {:>8.2f} {:>6.3f} {:>9.2f} {:>9.2f} {:>6.3f}",
                          1e3 * row.oneSeconds / options.views, 1e3 * row.slowestSeconds / options.views, row.speedup(),
                          row.speedup() / row.ranks, 1e3 * row.compositeSeconds / options.views,
                          row.speedupWithComposite(), row.speedupWithComposite() / row.ranks);
    }
    text += '\n';
  }
  return text;
}

/// The paper's Figure 8 on the left, balance on the right.
void plotRows(const std::string& path, const std::vector<Row>& rows, const SpeedupOptions& options) {
  PlotPanel speedup{"Speedup (papers/freevoxels Fig. 8)", "speedup", true, {}};
  PlotPanel fair{"Balance: mean / largest of a rank, worst view", "balance", false, {}};
  Curve ideal{"ideal", {}, true};
  const auto curveOf = [](PlotPanel& panel, const std::string& name, bool dashed) -> Curve& {
    for (Curve& curve : panel.curves) {
      if (curve.name == name) return curve;
    }
    panel.curves.push_back({name, {}, dashed});
    return panel.curves.back();
  };
  for (const Row& row : rows) {
    const std::string name = fmt::format("{}, blocks of {}", row.partition, row.blockEdge);
    curveOf(fair, name + ": splats", false).points.emplace_back(row.ranks, row.worstBalance);
    if (!options.countOnly) {
      curveOf(fair, name + ": pieces", true).points.emplace_back(row.ranks, row.worstBalancePieces);
      curveOf(speedup, name, false).points.emplace_back(row.ranks, row.speedup());
      curveOf(speedup, name + ", with composite", true).points.emplace_back(row.ranks, row.speedupWithComposite());
    }
    ideal.points.emplace_back(row.ranks, row.ranks);
  }
  std::sort(ideal.points.begin(), ideal.points.end());
  ideal.points.erase(std::unique(ideal.points.begin(), ideal.points.end()), ideal.points.end());
  speedup.curves.push_back(ideal);
  plot(path, "ranks", options.countOnly ? std::vector<PlotPanel>{fair} : std::vector<PlotPanel>{speedup, fair});
}

Outcome speedup(const SpeedupOptions& options, const CLI::App& command, Session& session) {
  for (const std::string& path : options.plots) {
    const std::string extension = lowerCaseExtension(path);
    if (extension != "png" && extension != "svg") {
      throw UsageError(fmt::format("--plot: expected a name ending in .png or .svg, found '{}'", path));
    }
  }
  if (session.ranks().rankCount() > 1 && command.get_option("--ranks")->count() > 0) {
    throw UsageError("--ranks is for virtual ranks: under mpirun there are as many as it started");
  }
  if (session.ranks().rankCount() > 1 && options.countOnly) {
    throw UsageError("--count counts for virtual ranks: leave mpirun out");
  }
  if (!isAttenuationFile(options.input)) {
    throw InputError(
        fmt::format("{}: expected an attenuation file (.fvx); make one with freevoxel precompute", options.input));
  }
  const AttenuationFile file(options.input);
  expectSameOnAllRanks(session.ranks(), file.identity(), options.input);
  Experiment experiment(options, file, session);
  const std::vector<Row> rows = session.timed("measure", [&] { return experiment.run(); });
  if (!session.ranks().isRoot()) return Outcome::done;
  nlohmann::ordered_json json = {
      {"input", options.input},
      {"real", session.ranks().rankCount() > 1},
      {"views", options.views},
      {"replicatedSeconds", experiment.replicatedSeconds() / options.views / double(options.blockEdges.size())}};
  if (experiment.rates()) {
    json["compositeRates"] = {{"packBytesPerSecond", experiment.rates()->pack},
                              {"addBytesPerSecond", experiment.rates()->add},
                              {"transferBytesPerSecond", experiment.rates()->transfer}};
  }
  for (const Row& row : rows)
    json["rows"].push_back(rowJson(row, options));
  session.statistics.update(json);
  fmt::print("{}", options.json ? json.dump(2) + '\n' : table(rows, options));
  for (const std::string& path : options.plots)
    session.timed("write", [&] { plotRows(path, rows, options); });
  return Outcome::done;
}

int parseRanks(std::string_view text) {
  return int(parseWhole(text, 1, kMostRanks));
}

int parseBlockEdge(std::string_view text) {
  return int(parseWhole(text, 4, 61));
}

}  // namespace

Command addSpeedup(CLI::App& program, CommonOptions& common) {
  auto options = std::make_shared<SpeedupOptions>();
  CLI::App* command = addSubcommand(program, "speedup", "measure how much faster several ranks draw",
                                    "freevoxel speedup cloud.fvx --ranks 8,16,32 --threads 1 --plot speedup.png");
  command
      ->add_option(
          "INPUT", options->input,
          "an attenuation file (.fvx). Ranks are virtual and draw one after another; under mpirun they are real")
      ->required();
  addParsed<std::vector<int>>(
      *command, "--ranks", options->ranks, "N,N,...",
      fmt::format("numbers of virtual ranks, each 1 to {} (default 8,16,32,64,96,128)", kMostRanks),
      [](std::string_view text) { return parseList<int>(text, parseRanks); });
  addParsed<std::vector<Partition>>(
      *command, "--partition", options->partitions, "P,P,...",
      "which rank draws which block, each as of render (default round-robin)",
      [](std::string_view text) { return parseList<Partition>(text, parsePartitionName); });
  addParsed<std::vector<int>>(*command, "--block", options->blockEdges, "EDGE,...",
                              fmt::format("edges of the blocks that are shared, 4 to 61 voxels; others than {} make "
                                          "other pictures (default {})",
                                          kBlockEdge, kBlockEdge),
                              [](std::string_view text) { return parseList<int>(text, parseBlockEdge); });
  addParsed<int>(
      *command, "--views", options->views, "N",
      fmt::format("view directions, 1 to {}: the camera's own, or so many spread over the sphere (default 1)",
                  kMostViews),
      [](std::string_view text) { return int(parseWhole(text, 1, kMostViews)); });
  addChoice<bool>(*command, "--clock", options->processorTime, {{"wall", false}, {"processor", true}},
                  "what is measured: time that passes, or time that processors work for this process, which other work "
                  "on the machine disturbs less; with --threads 1 they should be the same");
  addParsed<int>(*command, "--repeat", options->repeats, "N",
                 fmt::format("draw everything so often and take the least time, 1 to {} (default 1)", kMostRepeats),
                 [](std::string_view text) { return int(parseWhole(text, 1, kMostRepeats)); });
  command->add_flag(
      "--count", options->countOnly,
      "only count what ranks would have to draw: splats, and pixels that blocks cover in place of pieces");
  command->add_flag("--json", options->json, "print JSON instead of a table");
  command->add_option("--plot", options->plots, "draw speedup and balance over ranks (repeatable; needs gnuplot)")
      ->type_name("FILE.png|FILE.svg")
      ->expected(1, 16);
  addChoice<Footprint>(*command, "--footprint", options->splat.footprint,
                       {{"cell", Footprint::cell}, {"kernel", Footprint::kernel}}, "what a splat covers");
  addChoice<AttenuationSource>(*command, "--attenuation", options->splat.attenuation,
                               {{"auto", AttenuationSource::automatic},
                                {"stored", AttenuationSource::stored},
                                {"interpolated", AttenuationSource::interpolated},
                                {"swept", AttenuationSource::swept}},
                               "what light loses on its way to the eye, as of render; every rank works it out alike");
  addChoice<Backend>(*command, "--backend", options->backend,
                     {{"auto", Backend::automatic}, {"gl", Backend::gl}, {"cpu", Backend::cpu}}, "what draws splats");
  addCameraOptions(*command, options->camera);
  addCommonOptions(*command, common);
  return {command, [options, command](Session& session) { return speedup(*options, *command, session); }, true};
}

}  // namespace freevoxel
