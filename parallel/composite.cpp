#include "parallel/composite.h"

#include <algorithm>

#include "base/error.h"

namespace freevoxel {

namespace {

constexpr int kGatherTag = 1000;  // rounds count from 0

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
  const Range slice{0, sliceTiles_};
  // Of the pieces of a round; later rounds have less to split. Every piece has a mask of its own.
  size_t words = 0;
  for (int i = 0; i < rounds_.front(); ++i)
    words += packing_.mostWords({0, slice.size() / size_t(rounds_.front()) + 1});
  for (const int radix : rounds_)
    words = std::max(words, size_t(radix) * packing_.mostWords({0, slice.size() / size_t(radix) + 1}));
  outgoing_.resize(words);
  incoming_.resize(words);
  if (ranks.isRoot()) {
    gathered_.resize(size_t(ranks.rankCount()) * packing_.mostWords({0, slice.size() / size_t(ranks.rankCount()) + 2}));
  }
}

Compositor::Range Compositor::piece(Range whole, int pieces, int index) {
  const auto cut = [&](int i) { return whole.first + whole.size() * size_t(i) / size_t(pieces); };
  return {cut(index), cut(index + 1)};
}

bool Compositor::addSlice(Image& image, Range slice, std::span<const float> limits) {
  const MPI_Comm communicator = ranks_.communicator();
  const int rank = ranks_.rank(), rankCount = ranks_.rankCount();
  // The band of every rank, as the rounds come to it: its digit in each round picks a piece of what is left.
  const auto bandOf = [&](int of) {
    Range range = slice;
    for (const int radix : rounds_) {
      range = piece(range, radix, of % radix);
      of /= radix;
    }
    return range;
  };
  const auto received = [&](MPI_Status& status) {
    int count = 0;
    MPI_Get_count(&status, MPI_UINT32_T, &count);
    traffic_.receivedBytes += uint64_t(count) * sizeof(uint32_t);
  };
  const auto send = [&](const uint32_t* words, size_t count, int to, int tag, MPI_Request* request) {
    MPI_Isend(words, int(count), MPI_UINT32_T, to, tag, communicator, request);
    traffic_.sentBytes += count * sizeof(uint32_t);
  };

  std::vector<MPI_Request> gathering(ranks_.isRoot() ? size_t(rankCount) : 0, MPI_REQUEST_NULL);
  std::vector<const uint32_t*> gatheredFrom(gathering.size());
  size_t used = 0;
  for (int of = 1; of < int(gathering.size()); ++of) {
    const size_t words = packing_.mostWords(bandOf(of));
    gatheredFrom[size_t(of)] = gathered_.data() + used;
    MPI_Irecv(gathered_.data() + used, int(words), MPI_UINT32_T, of, kGatherTag, communicator, &gathering[size_t(of)]);
    used += words;
  }

  Range mine = slice;
  for (int round = 0, stride = 1; round < int(rounds_.size()); ++round) {
    const int radix = rounds_[size_t(round)];
    const int digit = rank / stride % radix;
    const auto member = [&](int i) { return rank + (i - digit) * stride; };
    const Range kept = piece(mine, radix, digit);
    std::vector<MPI_Request> sends(size_t(radix), MPI_REQUEST_NULL), receives(size_t(radix), MPI_REQUEST_NULL);
    std::vector<const uint32_t*> from(static_cast<size_t>(radix));
    size_t in = 0, out = 0;
    for (int i = 0; i < radix; ++i) {
      if (i == digit) continue;
      from[size_t(i)] = incoming_.data() + in;
      MPI_Irecv(incoming_.data() + in, int(packing_.mostWords(kept)), MPI_UINT32_T, member(i), round, communicator,
                &receives[size_t(i)]);
      in += packing_.mostWords(kept);
    }
    // Each begins with another partner, so that no rank is everybody's first.
    for (int step = 1; step < radix; ++step) {
      const int i = (digit + step) % radix;
      const size_t count = packing_.pack(image, piece(mine, radix, i), outgoing_.data() + out);
      send(outgoing_.data() + out, count, member(i), round, &sends[size_t(i)]);
      out += count;
    }
    for (int step = 1; step < radix; ++step) {
      int i = 0;
      MPI_Status status;
      MPI_Waitany(radix, receives.data(), &i, &status);
      received(status);
      packing_.add(image, kept, from[size_t(i)]);
    }
    MPI_Waitall(radix, sends.data(), MPI_STATUSES_IGNORE);
    mine = kept;
    stride *= radix;
  }

  bool below = true;
  MPI_Request sending = MPI_REQUEST_NULL;
  const size_t count = packing_.pack(image, mine, outgoing_.data(), limits, below);
  if (!ranks_.isRoot()) send(outgoing_.data(), count, 0, kGatherTag, &sending);
  const bool allSumsBelow = agreed(ranks_, below);
  for (int step = 1; step < int(gathering.size()); ++step) {
    int of = 0;
    MPI_Status status;
    MPI_Waitany(rankCount, gathering.data(), &of, &status);
    received(status);
    // Where the sum is zero, so is the root's own share of it.
    packing_.replace(image, bandOf(of), gatheredFrom[size_t(of)]);
  }
  MPI_Wait(&sending, MPI_STATUS_IGNORE);
  return allSumsBelow;
}

bool Compositor::add(Image& image, std::span<const float> limits) {
  checkEqual(image.pixels.size(), packing_.values(), "values of an image to be added");
  checkEqual(limits.size(), size_t(image.channels), "limits of an image to be added");
  if (ranks_.rankCount() == 1) return allBelow(image.pixels, limits);
  const Ranks::Exchange exchange(ranks_);
  bool below = true;
  for (size_t first = 0; first < packing_.tiles(); first += sliceTiles_)
    below = addSlice(image, {first, std::min(packing_.tiles(), first + sliceTiles_)}, limits) && below;
  return below;
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
