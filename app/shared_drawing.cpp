#include "app/shared_drawing.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <numeric>

#include "base/error.h"

namespace freevoxel {

namespace {

double secondsSince(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// Sums of white matter become those of matter in one colour: still whole quanta, still below S_o.
void tint(Sums& sums, glm::vec3 linear) {
  const float inverseQuantum = 1.0f / sums.quantum;
  for (size_t i = 0; i < sums.image.pixels.size(); i += kSumChannels) {
    for (int c = 0; c < 3; ++c) {
      float& value = sums.image.pixels[i + size_t(c)];
      value = std::nearbyint(value * inverseQuantum * linear[c]) * sums.quantum;
    }
  }
}

glm::vec3 linearColour(int number) {
  glm::vec3 linear(0.0f);
  for (int c = 0; c < 3; ++c)
    linear[c] = linearFromSrgb(float(rankColour(number)[c]));
  return linear;
}

}  // namespace

Partition parsePartitionName(std::string_view text) {
  Partition partition;
  if (!parsePartition(text, partition)) {
    throw UsageError(fmt::format("expected round-robin, hilbert, slab, random:SEED or file:F, found '{}'", text));
  }
  return partition;
}

void addShareOptions(CLI::App& command, ShareOptions& options) {
  const std::string group = "Several processes (mpirun -n N freevoxel ...; the bits are the same for any number)";
  addParsed<Partition>(
      command, "--partition", options.partition, "round-robin|hilbert|slab|random:SEED|file:F",
      "which rank draws which block: in turn, back and forth, those with most to draw first; runs of the Hilbert "
      "curve; slabs across z; at random; or as a text file says, a rank for every block (default "
      "round-robin)",
      parsePartitionName)
      ->group(group);
  addChoice<CompositeMethod>(command, "--composite", options.composite,
                             {{"tiles", CompositeMethod::tiles}, {"reduce", CompositeMethod::reduce}},
                             "how pictures of several ranks are added: bands of the image by rank and only tiles that "
                             "are covered, or one MPI_Reduce of whole images")
      ->group(group);
}

glm::dvec3 rankColour(int rank) {
  // Hues a golden angle apart, three turns of saturation and value.
  const double hue = 6.0 * std::fmod(0.61803398874989485 * rank + 0.03, 1.0);
  const double saturation = rank % 2 == 0 ? 0.85 : 0.6;
  glm::dvec3 colour;
  for (int c = 0; c < 3; ++c) {
    const double k = std::fmod(c == 0 ? hue + 5.0 : c == 1 ? hue + 3.0 : hue + 1.0, 6.0);
    colour[c] = 1.0 - saturation * std::max(0.0, std::min({k, 4.0 - k, 1.0}));
  }
  return colour;
}

std::vector<SharedBlock> sharedBlocks(std::span<const VisibleBlock> blocks) {
  std::vector<SharedBlock> shared;
  shared.reserve(blocks.size());
  for (const VisibleBlock& block : blocks)
    shared.push_back({block.level, block.origin.z, block.visibleCells});
  return shared;
}

void expectSameOnAllRanks(const Ranks& ranks, uint64_t identity, const std::string& what) {
  if (ranks.rankCount() == 1) return;
  ranks.agree();
  const std::vector<std::string> all = ranks.gatherEverywhere(fmt::format("{:016x}", identity));
  for (size_t rank = 1; rank < all.size(); ++rank) {
    if (all[rank] == all[0]) continue;
    throw InputError(
        fmt::format("{}: rank {} sees another file than rank 0: expected hash {}, found {}; put it where all ranks see "
                    "the same, and wait until it is written",
                    what, rank, all[0], all[rank]));
  }
}

SharedDrawing::SharedDrawing(Splatter& splatter, const ShareOptions& options, glm::ivec2 imageSize, Session& session)
    : splatter_(splatter),
      options_(options),
      session_(session),
      compositor_(session.ranks(), imageSize, kSumChannels) {}

Sums SharedDrawing::drawByLevel(float quantum, const std::vector<uint8_t>& share, SplatStatistics& statistics) {
  const std::span<const VisibleBlock> blocks = splatter_.blocks();
  int levels = 1;
  for (const VisibleBlock& block : blocks)
    levels = std::max(levels, block.level + 1);
  Sums sum;
  for (int level = 0; level < levels; ++level) {
    std::vector<uint8_t> ofLevel(blocks.size(), 0);
    for (size_t i = 0; i < blocks.size(); ++i)
      ofLevel[i] = blocks[i].level == level && (share.empty() || share[i] != 0) ? 1 : 0;
    Sums sums = splatter_.draw(quantum, ofLevel, session_.progress());
    tint(sums, linearColour(level));
    const SplatStatistics before = statistics;
    statistics = splatter_.statistics();
    statistics.passes = 1;
    statistics.addCounts(before);
    if (level == 0) {
      sum = std::move(sums);
    } else {
      // Whole quanta: exact wherever the result is, which is checked.
      for (size_t i = 0; i < sum.image.pixels.size(); ++i)
        sum.image.pixels[i] += sums.image.pixels[i];
    }
  }
  return sum;
}

SplatResult SharedDrawing::render(const Camera& camera, SplatOptions options) {
  const Ranks& ranks = session_.ranks();
  options.blockwise = ranks.rankCount() > 1;
  splatter_.prepare(camera, options);
  // What is to be drawn may depend on the view.
  std::vector<uint8_t> share;
  if (ranks.rankCount() > 1) {
    share = shareOf(dealBlocks(sharedBlocks(splatter_.blocks()), options_.partition, ranks.rankCount()), ranks.rank());
  }
  for (float quantum = options.firstQuantum;; quantum = nextQuantum(quantum)) {
    SplatStatistics done;
    Sums sums;
    if (options_.colourBy == ColourBy::level) {
      sums = drawByLevel(quantum, share, done);
    } else {
      sums = splatter_.draw(quantum, share, session_.progress());
      done = splatter_.statistics();
    }
    if (options_.colourBy == ColourBy::rank) tint(sums, linearColour(ranks.rank()));
    ranks.agree();
    const auto start = std::chrono::steady_clock::now();
    const std::array<float, kSumChannels> limits = exactLimits(quantum);
    const bool exact = options_.composite == CompositeMethod::tiles ? compositor_.add(sums.image, limits)
                                                                    : addByReduce(ranks, sums.image, limits);
    if (options_.composite == CompositeMethod::reduce) reducedBytes_ += sums.image.pixels.size() * sizeof(float);
    compositeSeconds_ += secondsSince(start);
    if (!exact) continue;
    total_.addCounts(done);
    total_.attenuationSeconds += done.attenuationSeconds;
    total_.lightSeconds += done.lightSeconds;
    total_.volumeBytes = std::max(total_.volumeBytes, done.volumeBytes);
    total_.setupSeconds += done.setupSeconds;
    total_.drawSeconds += done.drawSeconds;
    return {std::move(sums), done};
  }
}

void SharedDrawing::report() {
  const Ranks& ranks = session_.ranks();
  if (ranks.rankCount() == 1) return;
  session_.addSeconds("composite", compositeSeconds_);
  const bool tiles = options_.composite == CompositeMethod::tiles;
  const nlohmann::ordered_json mine = {{"rank", ranks.rank()},
                                       {"host", hostName()},
                                       {"seconds",
                                        {{"attenuation", total_.attenuationSeconds},
                                         {"light", total_.lightSeconds},
                                         {"setup", total_.setupSeconds},
                                         {"draw", total_.drawSeconds},
                                         {"composite", compositeSeconds_}}},
                                       {"blocks", total_.blocks},
                                       {"splats", total_.splats},
                                       {"fragments", total_.fragments},
                                       {"pieces", total_.pieces},
                                       {"sentBytes", tiles            ? compositor_.traffic().sentBytes
                                                     : ranks.isRoot() ? 0
                                                                      : reducedBytes_},
                                       {"volumeBytes", total_.volumeBytes},
                                       {"peakMemoryBytes", peakMemoryBytes()}};
  ranks.agree();
  nlohmann::ordered_json all = nlohmann::ordered_json::array();
  std::vector<uint64_t> splats, pieces;
  uint64_t blocks = 0, fragments = 0;
  for (const std::string& text : ranks.gatherEverywhere(mine.dump())) {
    all.push_back(nlohmann::ordered_json::parse(text));
    splats.push_back(all.back()["splats"].get<uint64_t>());
    pieces.push_back(all.back()["pieces"].get<uint64_t>());
    blocks += all.back()["blocks"].get<uint64_t>();
    fragments += all.back()["fragments"].get<uint64_t>();
  }
  session_.statistics["blocks"] = blocks;
  session_.statistics["splats"] = std::accumulate(splats.begin(), splats.end(), uint64_t(0));
  session_.statistics["fragments"] = fragments;
  session_.statistics["partition"] = partitionName(options_.partition);
  session_.statistics["balance"] = balance(splats);
  session_.statistics["balancePieces"] = balance(pieces);
  session_.statistics["ranks"] = std::move(all);
}

}  // namespace freevoxel
