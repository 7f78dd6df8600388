// A scene's VoxLink buffer in GPU memory: voxelised by orthographic passes and traced through a ray buffer
// (papers/voxlink sections 3.1.1, 3.1.2 and 5.2; shaders/voxlink/).
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
#include "voxlink/gl_memory.h"
#include "voxlink/image_rows.h"
#include "voxlink/scene_buffers.h"
#include "voxlink/trace_scene.h"

namespace freevoxel {

/// A context must be current for as long as one lives. Every allocation is checked first: MachineError.
class GlScene {
 public:
  /// `memoryLimit`: bytes that all buffers together may take; `rayBuffer`: of them for rays. Throws MachineError if the
  /// driver has no 64-bit integers (GL_ARB_gpu_shader_int64).
  GlScene(const gl::Context& context, uint64_t memoryLimit, uint64_t rayBuffer);

  /// Builds what buildSceneBuffers builds, byte for byte: what fills voxels is counted per brick, then per voxel, then
  /// written, by the same passes; sizes are known before anything is written. Throws as buildSceneBuffers and
  /// MachineError, also for more than 60000 triangles or 4096 fragments in one voxel.
  void build(const SceneVoxels& scene, int brickEdge, uint64_t& degenerate, Progress& progress);
  /// What is in GPU memory.
  SceneBuffers download() const;
  const BrickGrid& grid() const { return bricks_; }
  uint64_t storedVoxels() const { return voxelCount_; }
  uint64_t fragments() const { return fragmentCount_; }
  uint64_t occupiedBricks() const { return occupied_; }

  /// lightVolumes, or nothing.
  void setVolumeLight(std::span<const uint32_t> light);

  /// Like traceScene. `steps` of every ray per pass, 1 to kMostSteps; the number of steps and the size of the ray
  /// buffer change no bit.
  Image trace(const SceneTracing& tracing, const Camera& camera, ImageRows rows, int steps, uint64_t& rays, int& passes,
              Progress& progress);

  /// llvmpipe ends an invocation silently after 65535 turns of its loops.
  static constexpr int kMostSteps = 10000;

 private:
  struct Inputs;
  void voxelise(const Inputs& inputs, int stage);
  void useBuffers(const gl::Program& program) const;
  void upload(gl::Buffer& buffer, std::span<const std::byte> bytes, const char* what);

  GlMemory memory_;
  PrefixSum prefixSum_;
  uint64_t rayBytes_;
  gl::Program snapTriangles_, voxeliseTriangles_, voxeliseSpheres_, emitSamples_, findKeys_, mergeEntries_, findReach_,
      packFragments_, fillSceneBricks_, fillBrickWords_, copyStarts_, planRays_, takeRays_, traceScene_;
  gl::VertexArray noVertices_;
  SceneGrid space_;
  BrickGrid bricks_;
  uint64_t occupied_ = 0, voxelCount_ = 0, fragmentCount_ = 0;
  bool lit_ = false;
  gl::Buffer table_, brickCounts_, entries_;  // while building
  gl::Buffer brickWords_, brickHeaders_, voxels_, fragments_, materials_, spheres_, volumeMaterials_, firstOfVolume_,
      volumeLight_, lamps_, batch_, stack_, control_, sums_;
};

}  // namespace freevoxel
