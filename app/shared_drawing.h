// Splats drawn by all ranks together, every one its share of the blocks (DESIGN section 9). With one rank: drawn.
#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "app/options.h"
#include "app/session.h"
#include "parallel/composite.h"
#include "parallel/partition.h"
#include "splat/splat.h"

namespace freevoxel {

/// How pictures of several ranks become one. The bits are the same.
enum class CompositeMethod { tiles, reduce };

/// What matter is coloured by (papers/freevoxels Figs. 3 and 5).
enum class ColourBy {
  value,  ///< the transfer function
  rank,   ///< that drew it
  level,  ///< of the block it was drawn from
};

struct ShareOptions {
  Partition partition;
  CompositeMethod composite = CompositeMethod::tiles;
  ColourBy colourBy = ColourBy::value;
};
/// Throws UsageError.
Partition parsePartitionName(std::string_view text);
/// --partition and --composite.
void addShareOptions(CLI::App& command, ShareOptions& options);

/// Colour of a rank or level, sRGB: neighbours far apart in hue.
glm::dvec3 rankColour(int rank);

/// What the ranks share out, from the blocks that a splatter has.
std::vector<SharedBlock> sharedBlocks(std::span<const VisibleBlock> blocks);

/// Draws frames of one size. Everything here is collective.
class SharedDrawing {
 public:
  /// All must outlive this.
  SharedDrawing(Splatter& splatter, const ShareOptions& options, glm::ivec2 imageSize, Session& session);

  /// Sums and statistics: on rank 0 the sums of all, elsewhere of no use; statistics of this rank. The same bits for
  /// any number of ranks. Throws as Splatter::render does, RankFailed, and InputError if the partition will not do.
  SplatResult render(const Camera& camera, SplatOptions options);

  /// Fills statistics "ranks" with what every rank did in all frames; nothing for one rank.
  void report();

 private:
  /// Blocks of every level in a colour of their own.
  Sums drawByLevel(float quantum, const std::vector<uint8_t>& share, SplatStatistics& statistics);

  Splatter& splatter_;
  const ShareOptions& options_;
  Session& session_;
  Compositor compositor_;
  SplatStatistics total_;
  double compositeSeconds_ = 0.0;
  uint64_t reducedBytes_ = 0;
};

/// Throws InputError, on all ranks, unless `identity` is the same on all of them. Collective. `what` names it: a path.
void expectSameOnAllRanks(const Ranks& ranks, uint64_t identity, const std::string& what);

}  // namespace freevoxel
