// Blocks of a prepared frame to sums in whole quanta, with either footprint on either backend.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "gl/context.h"
#include "splat/block_source.h"
#include "splat/pixel_rays.h"
#include "splat/splat.h"
#include "splat/volume_view.h"
#include "volume/code_visibility.h"

namespace freevoxel {

class CellCanvas;

/// A canvas kept from drawing to drawing, with the memory for its blocks.
struct KeptCanvas {
  std::unique_ptr<CellCanvas> canvas;  ///< null: none
  // What it was made for.
  glm::ivec2 imageSize{0};
  size_t blocksAtATime = 0;
  uint64_t glBytes = 0;

  KeptCanvas();
  ~KeptCanvas();
};

/// What all drawings of a frame share. Everything pointed to must outlive them.
struct FrameDrawing {
  BlockSource* source = nullptr;
  const Placement* placement = nullptr;
  const std::vector<Classified>* classified = nullptr;  ///< by code
  const ClassificationTable* table = nullptr;
  const CodeVisibility* visibility = nullptr;
  const Camera* camera = nullptr;
  const VolumeView* view = nullptr;
  const SplatOptions* options = nullptr;
  gl::Context* context = nullptr;  ///< null: cpu
  bool endRays = false;            ///< whether attenuation is good enough to end rays where nothing comes through
  size_t blocksAtATime = 64;
  std::vector<PixelRay>* rays = nullptr;  ///< of the frame, where blocks were drawn; filled as they are
  KeptCanvas* canvas = nullptr;           ///< of the same context; made, used and left as the drawing needs it
};

/// Draws the blocks once, in the order that the options ask for, and gives their sums in whole quanta. Counts add to
/// `statistics`.
Image drawBlocks(const FrameDrawing& frame, std::span<const VisibleBlock> blocks, float quantum,
                 SplatStatistics& statistics, Progress& progress);

}  // namespace freevoxel
