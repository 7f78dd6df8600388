#include "parallel/composite.h"

#include <algorithm>

#include "base/error.h"

namespace freevoxel {

namespace {

/// Pieces travel in parts of so many tiles, 192 KiB of six channels: what has arrived is still in a cache when it is
/// added.
constexpr size_t kPartTiles = 128;

constexpr int kGatherRound = 1000;  // rounds count from 0

/// Of a message: the round, and whether it is a range as it is instead of packed.
int tagOf(int round, bool whole) {
  return 2 * round + (whole ? 1 : 0);
}
bool isWhole(const MPI_Status& status) {
  return status.MPI_TAG % 2 == 1;
}

bool agreed(const Ranks& ranks, bool mine) {
  int all = mine ? 1 : 0;
  MPI_Allreduce(MPI_IN_PLACE, &all, 1, MPI_INT, MPI_MIN, ranks.communicator());
  return all != 0;
}

}  // namespace

std::vector<int> compositeRounds(int rankCount) {
  std::vector<int> rounds;
  for (int left = rankCount; left > 1;) {
    int radix = std::min(left, kCompositeRadix);
    while (radix > 1 && left % radix != 0)
      --radix;
    // No small divisor: the smallest there is, which is prime.
    if (radix == 1) {
      radix = kCompositeRadix + 1;
      while (left % radix != 0)
        ++radix;
    }
    rounds.push_back(radix);
    left /= radix;
  }
  return rounds;
}

Compositor::Compositor(const Ranks& ranks, glm::ivec2 imageSize, int channels, size_t slicePixels)
    : ranks_(ranks),
      packing_(imageSize, channels),
      sliceTiles_(std::clamp((slicePixels + (kCompositeTile - 1)) / kCompositeTile, size_t(1),
                             std::max(packing_.tiles(), size_t(1)))),
      rounds_(compositeRounds(ranks.rankCount())) {
  if (rounds_.empty()) return;
  // Every part has a mask of its own.
  const auto wordsOf = [&](size_t tiles) {
    return (tiles / kPartTiles + 1) * packing_.mostWords({0, std::min(tiles, kPartTiles)});
  };
  const size_t radix = size_t(*std::max_element(rounds_.begin(), rounds_.end()));
  // Later rounds have less to split.
  outgoing_.resize(size_t(rounds_.front()) * wordsOf(sliceTiles_ / size_t(rounds_.front()) + 1));
  incoming_.resize(2 * radix * packing_.mostWords({0, kPartTiles}));
  if (ranks.isRoot()) {
    gathered_.resize(size_t(ranks.rankCount()) * packing_.mostWords({0, sliceTiles_ / size_t(ranks.rankCount()) + 2}));
  }
}

Compositor::Range Compositor::piece(Range whole, int pieces, int index) {
  const auto cut = [&](int i) { return whole.first + whole.size() * size_t(i) / size_t(pieces); };
  return {cut(index), cut(index + 1)};
}

Compositor::Range Compositor::bandOf(Range slice, int rank) const {
  for (const int radix : rounds_) {
    slice = piece(slice, radix, rank % radix);
    rank /= radix;
  }
  return slice;
}

std::span<float> Compositor::valuesOf(Image& image, Range range) const {
  return std::span(image.pixels).subspan(packing_.firstValue(range), packing_.valueCount(range));
}

size_t Compositor::send(Image& image, Range range, int to, int round, uint32_t* space, MPI_Request* request) {
  const bool whole = packing_.allCovered(image, range);
  const size_t packed = whole ? 0 : packing_.pack(image, range, space);
  const size_t count = whole ? packing_.valueCount(range) : packed;
  const void* words = space;
  if (whole) words = valuesOf(image, range).data();
  MPI_Isend(words, int(count), MPI_UINT32_T, to, tagOf(round, whole), ranks_.communicator(), request);
  traffic_.sentBytes += count * sizeof(uint32_t);
  return packed;
}

void Compositor::countReceived(const MPI_Status& status) {
  int count = 0;
  MPI_Get_count(&status, MPI_UINT32_T, &count);
  traffic_.receivedBytes += uint64_t(count) * sizeof(uint32_t);
}

Compositor::Range Compositor::exchangePieces(Image& image, Range whole, int round, int stride) {
  const int radix = rounds_[size_t(round)];
  const int digit = ranks_.rank() / stride % radix;
  const auto member = [&](int i) { return ranks_.rank() + (i - digit) * stride; };
  const auto parts = [&](int i) { return (piece(whole, radix, i).size() + (kPartTiles - 1)) / kPartTiles; };
  const auto part = [&](int i, size_t n) {
    const Range range = piece(whole, radix, i);
    const size_t first = range.first + n * kPartTiles;
    return Range{first, std::min(first + kPartTiles, range.last)};
  };

  // Two parts of each partner are on their way while others are added. What comes first from a partner was sent first.
  const size_t partWords = packing_.mostWords({0, kPartTiles});
  std::vector<MPI_Request> receives(size_t(2 * radix), MPI_REQUEST_NULL), sends;
  std::vector<size_t> asked(size_t(radix), 0);  // parts, by partner
  std::vector<size_t> partOf(receives.size());
  const auto ask = [&](size_t slot) {
    const int i = int(slot / 2);
    if (i == digit || asked[size_t(i)] == parts(digit)) return;
    partOf[slot] = asked[size_t(i)]++;
    MPI_Irecv(incoming_.data() + slot * partWords, int(partWords), MPI_UINT32_T, member(i), MPI_ANY_TAG,
              ranks_.communicator(), &receives[slot]);
  };
  for (size_t slot = 0; slot < receives.size(); ++slot)
    ask(slot);
  // Each begins with another partner, so that no rank is everybody's first.
  size_t used = 0;
  for (int step = 1; step < radix; ++step) {
    const int i = (digit + step) % radix;
    for (size_t n = 0; n < parts(i); ++n) {
      sends.push_back(MPI_REQUEST_NULL);
      used += send(image, part(i, n), member(i), round, outgoing_.data() + used, &sends.back());
    }
  }
  for (;;) {
    int slot = 0;
    MPI_Status status;
    MPI_Waitany(int(receives.size()), receives.data(), &slot, &status);
    if (slot == MPI_UNDEFINED) break;
    countReceived(status);
    const Range range = part(digit, partOf[size_t(slot)]);
    const uint32_t* words = incoming_.data() + size_t(slot) * partWords;
    if (isWhole(status)) {
      addWords(valuesOf(image, range), words);
    } else {
      packing_.add(image, range, words);
    }
    ask(size_t(slot));
  }
  MPI_Waitall(int(sends.size()), sends.data(), MPI_STATUSES_IGNORE);
  return piece(whole, radix, digit);
}

void Compositor::gatherBands(Image& image, Range slice) {
  const int rankCount = ranks_.rankCount();
  std::vector<MPI_Request> requests(size_t(rankCount), MPI_REQUEST_NULL);
  std::vector<const uint32_t*> packed(requests.size(), nullptr);
  size_t used = 0;
  for (int of = 1; of < rankCount; ++of) {
    const Range band = bandOf(slice, of);
    MPI_Message message;
    MPI_Status status;
    MPI_Mprobe(of, MPI_ANY_TAG, ranks_.communicator(), &message, &status);
    countReceived(status);
    if (isWhole(status)) {
      // Straight to its place.
      MPI_Imrecv(valuesOf(image, band).data(), int(packing_.valueCount(band)), MPI_UINT32_T, &message,
                 &requests[size_t(of)]);
      continue;
    }
    packed[size_t(of)] = gathered_.data() + used;
    MPI_Imrecv(gathered_.data() + used, int(packing_.mostWords(band)), MPI_UINT32_T, &message, &requests[size_t(of)]);
    used += packing_.mostWords(band);
  }
  for (int step = 1; step < rankCount; ++step) {
    int of = 0;
    MPI_Waitany(rankCount, requests.data(), &of, MPI_STATUS_IGNORE);
    // Where the sum is zero, so is the root's own share of it.
    if (packed[size_t(of)] != nullptr) packing_.replace(image, bandOf(slice, of), packed[size_t(of)]);
  }
}

bool Compositor::addSlice(Image& image, Range slice, std::span<const float> limits) {
  Range mine = slice;
  for (int round = 0, stride = 1; round < int(rounds_.size()); ++round) {
    mine = exchangePieces(image, mine, round, stride);
    stride *= rounds_[size_t(round)];
  }
  const bool below = allBelow(valuesOf(image, mine), limits);
  if (ranks_.isRoot()) {
    gatherBands(image, slice);
  } else {
    MPI_Request sending = MPI_REQUEST_NULL;
    send(image, mine, 0, kGatherRound, outgoing_.data(), &sending);
    MPI_Wait(&sending, MPI_STATUS_IGNORE);
  }
  return below;
}

bool Compositor::add(Image& image, std::span<const float> limits) {
  checkEqual(image.pixels.size(), packing_.values(), "values of an image to be added");
  checkEqual(limits.size(), size_t(image.channels), "limits of an image to be added");
  if (ranks_.rankCount() == 1) return allBelow(image.pixels, limits);
  const Ranks::Exchange exchange(ranks_);
  bool below = true;
  for (size_t first = 0; first < packing_.tiles(); first += sliceTiles_)
    below = addSlice(image, {first, std::min(packing_.tiles(), first + sliceTiles_)}, limits) && below;
  return agreed(ranks_, below);
}

bool addByReduce(const Ranks& ranks, Image& image, std::span<const float> limits) {
  if (ranks.rankCount() > 1) {
    const Ranks::Exchange exchange(ranks);
    constexpr size_t kMost = size_t(1) << 30;
    for (size_t first = 0; first < image.pixels.size(); first += kMost) {
      float* values = image.pixels.data() + first;
      const int count = int(std::min(kMost, image.pixels.size() - first));
      MPI_Reduce(ranks.isRoot() ? MPI_IN_PLACE : values, ranks.isRoot() ? values : nullptr, count, MPI_FLOAT, MPI_SUM,
                 0, ranks.communicator());
    }
  }
  const bool below = !ranks.isRoot() || allBelow(image.pixels, limits);
  return ranks.rankCount() == 1 ? below : agreed(ranks, below);
}

}  // namespace freevoxel
