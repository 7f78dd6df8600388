#include "parallel/partition.h"

#include <fmt/core.h>

#include <algorithm>
#include <charconv>
#include <fstream>
#include <numeric>

#include "base/error.h"

namespace freevoxel {

namespace {

/// A hash of seed and number that any language and library computes alike (Steele, Lea, Flood 2014: SplitMix64).
uint64_t mixed(uint64_t seed, uint64_t number) {
  uint64_t z = seed * 0x2545f4914f6cdd1du + (number + 1) * 0x9e3779b97f4a7c15u;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
  return z ^ (z >> 31);
}

/// Positions of a level's blocks, as they stand.
std::vector<std::vector<size_t>> byLevel(std::span<const SharedBlock> blocks) {
  std::vector<std::vector<size_t>> levels;
  for (size_t i = 0; i < blocks.size(); ++i) {
    levels.resize(std::max(levels.size(), size_t(blocks[i].level) + 1));
    levels[size_t(blocks[i].level)].push_back(i);
  }
  return levels;
}

std::vector<int> ownersFromFile(const std::string& path, size_t count, int rankCount) {
  std::ifstream file(path);
  if (!file) throw InputError(fmt::format("{}: cannot open", path));
  std::vector<int> owners;
  owners.reserve(count);
  for (std::string word; file >> word;) {
    int rank = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), rank);
    if (error != std::errc() || end != word.data() + word.size() || rank < 0 || rank >= rankCount) {
      throw InputError(fmt::format("{}: number {}: expected a rank from 0 to {}, found '{}'", path, owners.size() + 1,
                                   rankCount - 1, word.substr(0, 40)));
    }
    if (owners.size() == count) {
      throw InputError(fmt::format("{}: expected {} ranks, one per block, found more", path, count));
    }
    owners.push_back(rank);
  }
  if (file.bad()) throw InputError(fmt::format("{}: cannot be read", path));
  if (owners.size() != count) {
    throw InputError(fmt::format("{}: expected {} ranks, one per block, found {}", path, count, owners.size()));
  }
  return owners;
}

}  // namespace

bool parsePartition(std::string_view text, Partition& partition) {
  using Kind = Partition::Kind;
  constexpr std::string_view kRandom = "random:", kFile = "file:";
  if (text == "round-robin") {
    partition = {Kind::roundRobin, 0, ""};
  } else if (text == "hilbert") {
    partition = {Kind::hilbert, 0, ""};
  } else if (text == "slab") {
    partition = {Kind::slab, 0, ""};
  } else if (text.starts_with(kRandom)) {
    const std::string_view digits = text.substr(kRandom.size());
    uint64_t seed = 0;
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), seed);
    if (error != std::errc() || end != digits.data() + digits.size()) return false;
    partition = {Kind::random, seed, ""};
  } else if (text.starts_with(kFile) && text.size() > kFile.size()) {
    partition = {Kind::file, 0, std::string(text.substr(kFile.size()))};
  } else {
    return false;
  }
  return true;
}

std::string partitionName(const Partition& partition) {
  switch (partition.kind) {
    case Partition::Kind::roundRobin:
      return "round-robin";
    case Partition::Kind::hilbert:
      return "hilbert";
    case Partition::Kind::slab:
      return "slab";
    case Partition::Kind::random:
      return fmt::format("random:{}", partition.seed);
    case Partition::Kind::file:
      return "file:" + partition.path;
  }
  throw InternalError("internal error: unknown partition");
}

std::vector<int> dealBlocks(std::span<const SharedBlock> blocks, const Partition& partition, int rankCount) {
  check(rankCount >= 1, "there is a rank");
  if (partition.kind == Partition::Kind::file) return ownersFromFile(partition.path, blocks.size(), rankCount);
  std::vector<int> owners(blocks.size());
  if (partition.kind == Partition::Kind::random) {
    for (size_t i = 0; i < owners.size(); ++i)
      owners[i] = int(mixed(partition.seed, i) % uint64_t(rankCount));
    return owners;
  }
  for (std::vector<size_t>& level : byLevel(blocks)) {
    // Stable: ties stay in the order of the curve.
    if (partition.kind == Partition::Kind::roundRobin) {
      std::stable_sort(level.begin(), level.end(), [&](size_t a, size_t b) { return blocks[a].work > blocks[b].work; });
    } else if (partition.kind == Partition::Kind::slab) {
      std::stable_sort(level.begin(), level.end(), [&](size_t a, size_t b) { return blocks[a].z < blocks[b].z; });
    }
    const auto ranks = size_t(rankCount);
    for (size_t i = 0; i < level.size(); ++i) {
      const size_t round = i / ranks, turn = i % ranks;
      owners[level[i]] = partition.kind != Partition::Kind::roundRobin ? int(i * ranks / level.size())
                         : round % 2 == 0                              ? int(turn)
                                                                       : int(ranks - 1 - turn);
    }
  }
  return owners;
}

std::vector<uint8_t> shareOf(std::span<const int> owners, int rank) {
  std::vector<uint8_t> share(owners.size());
  std::transform(owners.begin(), owners.end(), share.begin(), [&](int owner) { return owner == rank ? 1 : 0; });
  return share;
}

double balance(std::span<const uint64_t> workOfRanks) {
  if (workOfRanks.empty()) return 1.0;
  const uint64_t largest = *std::max_element(workOfRanks.begin(), workOfRanks.end());
  if (largest == 0) return 1.0;
  const double sum = std::accumulate(workOfRanks.begin(), workOfRanks.end(), 0.0);
  return sum / double(workOfRanks.size()) / double(largest);
}

}  // namespace freevoxel
