#include "parallel/composite_cost.h"

#include <algorithm>
#include <chrono>
#include <cstring>
#include <functional>

#include "parallel/composite.h"

namespace freevoxel {

namespace {

double medianSeconds(const std::function<void()>& f) {
  std::vector<double> seconds;
  for (int run = 0; run < 7; ++run) {
    const auto start = std::chrono::steady_clock::now();
    f();
    seconds.push_back(std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
  }
  std::nth_element(seconds.begin(), seconds.begin() + 3, seconds.end());
  return std::max(seconds[3], 1e-9);
}

}  // namespace

CompositeRates measureCompositeRates(glm::ivec2 imageSize, int channels) {
  Image image(imageSize, channels);
  std::fill(image.pixels.begin(), image.pixels.end(), 0.5f);
  TilePacking packing(image.size, channels);
  std::vector<uint32_t> words(packing.mostWords(packing.all())), arrived(words.size());
  CompositeRates rates;
  const double bytes = double(image.pixels.size() * sizeof(float));
  rates.pack = bytes / medianSeconds([&] { packing.pack(image, packing.all(), words.data()); });
  rates.transfer =
      bytes / medianSeconds([&] { std::memcpy(arrived.data(), words.data(), words.size() * sizeof(uint32_t)); });
  rates.add = bytes / medianSeconds([&] { packing.add(image, packing.all(), arrived.data()); });
  return rates;
}

std::vector<uint8_t> coveredCompositeTiles(const Image& image) {
  const TilePacking packing(image.size, image.channels);
  std::vector<uint8_t> covered(packing.tiles());
  for (size_t tile = 0; tile < covered.size(); ++tile)
    covered[tile] = packing.isCovered(image, tile) ? 1 : 0;
  return covered;
}

CompositeCost compositeCost(int rankCount, uint64_t tiles, uint64_t coveredTiles, uint64_t unionTiles, int channels,
                            const CompositeRates& rates) {
  CompositeCost cost;
  const double tileBytes = double(kCompositeTile) * channels * double(sizeof(float));
  double region = 1.0;  // of the image that the rank still answers for
  double covered = double(coveredTiles), masks = double(tiles) / 8.0;
  for (const int radix : compositeRounds(rankCount)) {
    const double sent = region * (1.0 - 1.0 / radix) * (covered * tileBytes + masks);
    cost.sentBytes += sent;
    // Everything covered is read to be sent or kept; as many bytes arrive as are sent.
    cost.seconds += sent / rates.pack + sent / rates.transfer + sent / rates.add;
    region /= radix;
    covered = std::min(double(unionTiles), covered * radix);
  }
  if (rankCount > 1) {
    const double band = region * (double(unionTiles) * tileBytes + masks);
    cost.sentBytes += band;
    cost.gatheredBytes = (double(unionTiles) * tileBytes + masks) * (1.0 - region);
    cost.seconds += band / rates.pack + cost.gatheredBytes / rates.transfer + cost.gatheredBytes / rates.add;
  }
  return cost;
}

}  // namespace freevoxel
