// Blocks to sums: the order-free renderer (papers/freevoxels sections 3.3, 4.1, 4.2 and 5; docs/fidelity.md).
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "base/camera.h"
#include "base/light.h"
#include "base/progress.h"
#include "hierarchy/attenuation_file.h"
#include "hierarchy/value_grid.h"
#include "splat/blend_kernels.h"
#include "splat/block_source.h"
#include "splat/sums.h"
#include "splat/visible_blocks.h"
#include "volume/transfer_function.h"

namespace freevoxel {

enum class Backend { automatic, gl, cpu };

/// What one splat covers.
enum class Footprint {
  cell,    ///< cells between voxels, traced and classified after interpolation, a block at a time
  kernel,  ///< the paper's: a blending kernel round every voxel, integrated along the view ray
};

/// Where attenuation towards the eye, or towards a lamp, comes from.
enum class AttenuationSource {
  automatic,     ///< pinned, if the file has a pin that is the target; else stored, with an attenuation file and the
                 ///< target outside the volume; else swept
  interpolated,  ///< among the 26 directions of the file, which run on to the outside even if the target is inside
  stored,    ///< the same, corrected by a sweep of a coarse copy of the volume, and right before a voxel traced (which
             ///< takes the values of the whole volume, and is left out where blocks of coarser levels are drawn)
  swept,     ///< one sweep over the values for this target
  pinned,    ///< a sweep for this target that the file holds: the bits that `swept` gives
  quotient,  ///< interpolated, divided by the same at the target's own voxel: the paper's A_B / A_V for an eye inside
};

/// What is left out of a picture because nobody sees it. Deterministic: the same bits in any order.
enum class Cull {
  off,     ///< nothing: cells, off the image, empty or not, are all traced. Only to show that `none` changes no bit
  none,    ///< only what adds nothing
  hidden,  ///< also what hardly any light reaches the eye from (docs/fidelity.md has what that changes)
};

/// The order in which blocks, and splats inside a block, are drawn. It changes no bit of the result.
struct SplatOrder {
  enum class Kind { hilbert, reverse, shuffle } kind = Kind::hilbert;
  uint64_t seed = 0;  ///< of shuffle
};

struct SplatOptions {
  Formula formula = Formula::normalised;
  Footprint footprint = Footprint::cell;  ///< formula `paper` is defined for `kernel` only
  AttenuationSource attenuation = AttenuationSource::automatic;
  AttenuationSource lightAttenuation = AttenuationSource::automatic;  ///< the same, towards lamps
  Lighting lighting;
  Cull cull = Cull::none;
  SplatOrder order;
  /// From an attenuation file, blocks are drawn at the coarsest level whose voxels are no larger than this on the
  /// image, in pixels; 0: at the finest.
  double lodPixels = 0.0;
  /// Bytes that may be taken by buffers and textures, and by everything else whose size depends on volume or image; 0:
  /// as many as there are. Neither changes a bit of the result.
  uint64_t gpuMemoryBytes = 0, memoryBytes = 0;
  /// Stored attenuation is looked up for the blocks that are drawn and not for the whole volume at once, as it is
  /// anyway with lodPixels or where memory is short: for who draws a share of them. The bits are the same.
  bool blockwise = false;
  float firstQuantum = 0x1p-20f;  ///< raised by 4 until the sums prove exact; a power of two
};

struct SplatStatistics {
  uint64_t blocks = 0;                                 ///< drawn
  uint64_t culledBlocks = 0;                           ///< outside the view frustum
  uint64_t hiddenBlocks = 0;                           ///< dropped by Cull::hidden
  uint64_t emptyBlocks = 0;                            ///< of those in the file: nothing in them is visible
  std::vector<uint64_t> blocksOfLevel, splatsOfLevel;  ///< drawn, at each level
  uint64_t splats = 0;                                 ///< drawn: of cells, blocks; of kernels, voxels
  uint64_t culledSplats = 0;     ///< of kernels: visible voxels off screen or nearer than the near plane
  uint64_t hiddenSplats = 0;     ///< of kernels: dropped by Cull::hidden
  uint64_t fragments = 0;        ///< pixels that splats' bounding rectangles covered
  uint64_t pieces = 0;           ///< of cells: pieces of rays between two planes of voxels that were traced (cpu only)
  uint64_t visiblePieces = 0;    ///< of these, in which something is visible
  int passes = 1;                ///< 1 + how often the quantum had to be raised
  std::string backend;           ///< "gl" or "cpu"
  std::string glRenderer;        ///< empty for cpu
  std::string attenuation;       ///< towards the eye: name of the source
  std::string lightAttenuation;  ///< the same towards lamps, of the last one; empty without any
  uint64_t glBytes = 0;          ///< most that buffers and textures took at once
  uint64_t volumeBytes = 0;      ///< of BlockSource
  double attenuationSeconds = 0, lightSeconds = 0, setupSeconds = 0, drawSeconds = 0;

  /// Adds what another drawing counted, of blocks, splats, fragments and pieces.
  void addCounts(const SplatStatistics& other);
};

struct SplatResult {
  Sums sums;
  SplatStatistics statistics;
};

struct BlendedResult {
  Image image;  ///< premultiplied linear RGBA
  SplatStatistics statistics;
};

/// Edge of a block, voxels. Attenuation comes in where rays enter a block, so larger blocks are more accurate; smaller
/// ones are skipped, culled and shared among processes more finely (docs/fidelity.md has the figures). Other edges make
/// another picture.
inline constexpr int kBlockEdge = 32;

/// Names on the command line and in statistics.
std::string_view attenuationSourceName(AttenuationSource source);

/// What there is to draw in one block.
struct BlockWork {
  uint64_t cells = 0;   ///< VisibleBlock::visibleCells, if the block is in view
  uint64_t pixels = 0;  ///< of its bounding rectangle on the image
};

/// Renders frames of one volume under one transfer function. Move-only.
class Splatter {
 public:
  /// `grid` and `file` must outlive the splatter; `file` may be null (then attenuation is always swept). The opacities
  /// of `transfer` must be those that the file was made with (opacityHash).
  /// `blockEdge`: 1 to kLargestBlockEdge. Throws InputError (transfer function), MachineError (no GL where it was asked
  /// for).
  Splatter(const ValueGrid& grid, const AttenuationFile* file, const TransferFunction& transfer, Backend backend,
           int blockEdge = kBlockEdge);
  /// From the file alone, which must outlive the splatter: values are read block by block, and as a whole only for what
  /// sweeps or blends them.
  Splatter(const AttenuationFile& file, const TransferFunction& transfer, Backend backend, int blockEdge = kBlockEdge);
  ~Splatter();
  Splatter(Splatter&& other) noexcept;
  Splatter& operator=(Splatter&&) = delete;

  /// The blocks in which something may be visible: those that a prepared frame is to draw, else those of the finest
  /// level, which a frame with lodPixels = 0 has too. Along the Hilbert curve, coarsest level first.
  std::span<const VisibleBlock> blocks() const;

  /// Same bits for any order, thread count and backend. Throws InputError or MachineError.
  SplatResult render(const Camera& camera, const SplatOptions& options, Progress& progress);

  /// The same in two steps, for those who add other processes' sums before they ask whether they are exact: makes a
  /// frame's attenuation and light, once, and draws it, at any quantum. The frame lasts until the next prepare() or
  /// render().
  void prepare(const Camera& camera, const SplatOptions& options);
  /// Sums of a share of the blocks, which may not be exact. `share`: per block of blocks(), 0 = left to somebody else;
  /// empty = all are drawn. The sums of shares add up to those of the whole, bit for bit.
  Sums draw(float quantum, std::span<const uint8_t> share, Progress& progress);
  /// What there is to draw in each of blocks(), without drawing it.
  std::vector<BlockWork> countWork(const Camera& camera) const;
  /// Of the frame as it was drawn last.
  const SplatStatistics& statistics() const;

  /// The same, from coarse to fine: `show(n, sums)` gets the coarsest level's sums, n = 0, and then those after each
  /// step in which blocks are subtracted and their finer ones added, exactly; the last are those that render() gives,
  /// bit for bit. If sums turn out not to be exact, all begins again, with n = 0. Statistics count what was drawn in
  /// all. Throws InputError if there are no levels, or if attenuation is swept or pinned.
  SplatResult refine(const Camera& camera, const SplatOptions& options,
                     const std::function<void(size_t n, const Sums& sums)>& show, Progress& progress);

  /// The leaky baseline: kernels, sorted by their distance from the eye and laid over each other from back to front.
  /// On the CPU only. `options` as for `render`; formula, footprint and source of attenuation do not matter.
  BlendedResult renderBlended(const Camera& camera, BlendKernel kernel, const SplatOptions& options,
                              Progress& progress);

 private:
  struct State;
  /// `allLevels`: blocks of every level can be drawn, not only those of the frame.
  void prepareFrame(const Camera& camera, const SplatOptions& options, bool allLevels);
  Sums drawFrameBlocks(std::span<const VisibleBlock> blocks, float quantum, Progress& progress);

  std::unique_ptr<State> state_;
};

}  // namespace freevoxel
