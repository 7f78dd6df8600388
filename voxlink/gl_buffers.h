// The VoxLink buffers in GPU memory: built, lit and traced by compute passes (shaders/voxlink/).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/camera.h"
#include "base/image.h"
#include "base/light.h"
#include "base/progress.h"
#include "gl/context.h"
#include "gl/objects.h"
#include "voxlink/buffers.h"
#include "voxlink/gl_memory.h"
#include "voxlink/image_rows.h"
#include "voxlink/shadows.h"

namespace freevoxel {

/// A context must be current for as long as one lives. Every allocation is checked first against the limit and against
/// what the driver can bind: MachineError says how much would have been needed.
class GlVoxLink {
 public:
  /// `memoryLimit`: bytes that all buffers together may take.
  GlVoxLink(const gl::Context& context, uint64_t memoryLimit);

  /// Builds the buffers from slabs of one layer of bricks: a counting pass that fits the box, a prefix sum over bricks,
  /// and, with sizes known, a pass that fills. Throws as buildBuffers and MachineError.
  void build(const ValueGrid& grid, const std::vector<uint8_t>& stored, int brickEdge, Progress& progress);
  /// What is in GPU memory.
  VoxLinkBuffers download() const;
  const BrickGrid& grid() const { return bricks_; }
  uint64_t fragments() const { return fragmentCount_; }
  uint64_t occupiedBricks() const { return occupied_; }

  void setMaterials(std::span<const VoxelMaterial> materials);
  /// Shares made elsewhere, lamp after lamp.
  void setShares(const LightShares& shares);
  /// Shares by a ray from every voxel to every lamp.
  void traceShares(std::span<const Light> lights);
  LightShares downloadShares() const;
  /// Light at every voxel from shares and shading; without it voxels shine with their own colour.
  void light(const Lighting& lighting, const Camera& camera);
  void unlit() { lit_ = false; }

  /// Like traceRays. `steps` of every ray per pass, 1 to kMostSteps; `passes` tells how many it took.
  Image trace(const Camera& camera, ImageRows rows, int steps, int& passes);

  /// llvmpipe ends an invocation silently after 65535 turns of its loops.
  static constexpr int kMostSteps = 32768;

 private:
  void count(const ValueGrid& grid, const std::vector<uint8_t>& stored, Progress& progress);
  void uploadSlab(const ValueGrid& grid, int layer);
  void useBuffers(const gl::Program& program) const;

  GlMemory memory_;
  PrefixSum prefixSum_;
  gl::Program countVoxels_, fillBrickWords_, fillBricks_, traceShadows_, lightVoxels_, traceRays_;
  glm::ivec3 dims_{0};
  Placement placement_;
  BrickGrid bricks_;
  uint64_t fragmentCount_ = 0, occupied_ = 0;
  size_t lamps_ = 0;
  bool lit_ = false;
  gl::Buffer slab_, stored_, counts_, box_;  // while building
  gl::Buffer brickWords_, brickHeaders_, fragments_, materials_, shares_, light_, lampBuffer_, rays_, active_;
};

}  // namespace freevoxel
