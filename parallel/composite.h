// The additive composite: images of all ranks become one sum on rank 0 (papers/freevoxels section 4.4; DESIGN section
// 9).
//
// Sums of whole quanta are exact, so any tree of additions gives the same bits. The tree is radix-k (Peterka, Goodell,
// Ross, Shen, Thakur 2009): in every round a group of k ranks splits the part of the image that it has in common, each
// adds up one piece of it, and in the end every rank owns one band, which goes to rank 0. A rank sends at most its
// image once and its band, however many ranks there are, and of both only tiles in which there is anything. Parts that
// are all covered travel without being copied.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/image.h"
#include "parallel/ranks.h"
#include "parallel/tile_packing.h"

namespace freevoxel {

/// Ranks of a group exchange pieces all at once if there are no more than this.
inline constexpr int kCompositeRadix = 8;

/// Group sizes of the rounds for so many ranks: their product is rankCount, each at most kCompositeRadix unless it is a
/// prime number above it. Empty for one rank.
std::vector<int> compositeRounds(int rankCount);

struct CompositeTraffic {
  uint64_t sentBytes = 0, receivedBytes = 0;
};

/// Images that are larger are added a slice at a time: it bounds buffers and messages. Pixels.
inline constexpr size_t kCompositeSlice = size_t(1) << 23;

/// Adds images of one size. Holds a buffer of the size of the image, or of a slice of it, rank 0 two.
class Compositor {
 public:
  /// `ranks` must outlive this. Not collective.
  Compositor(const Ranks& ranks, glm::ivec2 imageSize, int channels, size_t slicePixels = kCompositeSlice);

  /// Collective. Adds up the `image` of every rank: on rank 0 it is the sum afterwards, elsewhere what is left in it is
  /// of no use. No value may be negative. Returns, the same on all ranks, whether every sum stayed below its channel's
  /// limit; if not, the sum need not be complete.
  bool add(Image& image, std::span<const float> limits);

  /// Of this rank since the compositor was made.
  const CompositeTraffic& traffic() const { return traffic_; }

 private:
  using Range = TilePacking::Range;
  static Range piece(Range whole, int pieces, int index);
  /// What a rank has of a slice after all rounds: its digit in each picks a piece of what is left.
  Range bandOf(Range slice, int rank) const;
  std::span<float> valuesOf(Image& image, Range range) const;
  bool addSlice(Image& image, Range slice, std::span<const float> limits);
  /// One round: gives the piece of `whole` that this rank has added up.
  Range exchangePieces(Image& image, Range whole, int round, int stride);
  /// On rank 0, of what all others send.
  void gatherBands(Image& image, Range slice);
  /// As it is if all of it is covered, else packed into `space`. Gives the words that took. Image and space must stay
  /// until the request is done.
  size_t send(Image& image, Range range, int to, int round, uint32_t* space, MPI_Request* request);
  void countReceived(const MPI_Status& status);

  const Ranks& ranks_;
  TilePacking packing_;
  size_t sliceTiles_;
  std::vector<int> rounds_;
  std::vector<uint32_t> outgoing_, incoming_, gathered_;
  CompositeTraffic traffic_;
};

/// The same by one MPI_Reduce of the whole images, for comparison.
bool addByReduce(const Ranks& ranks, Image& image, std::span<const float> limits);

}  // namespace freevoxel
