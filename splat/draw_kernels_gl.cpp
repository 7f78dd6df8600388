#include <algorithm>
#include <cstddef>
#include <vector>

#include "base/error.h"
#include "gl/objects.h"
#include "gl/program.h"
#include "splat/draw_kernels.h"
#include "splat/sum_targets.h"

namespace freevoxel {

namespace {

/// Splats drawn by one call, and the size of the buffer they pass through.
constexpr size_t kBatch = 65536;

constexpr GLint kImageSizeUniform = 0;  // layout(location = 0) in both vertex shaders

gl::VertexArray kernelVertexArray(const gl::Buffer& buffer, GLuint divisor) {
  gl::VertexArray array = gl::makeVertexArray();
  glVertexArrayVertexBuffer(array.id(), 0, buffer.id(), 0, sizeof(KernelSplat));
  glVertexArrayBindingDivisor(array.id(), 0, divisor);
  for (GLuint attribute = 0; attribute < 3; ++attribute) {
    glEnableVertexArrayAttrib(array.id(), attribute);
    glVertexArrayAttribFormat(array.id(), attribute, 4, GL_FLOAT, GL_FALSE, attribute * 4 * GLuint(sizeof(float)));
    glVertexArrayAttribBinding(array.id(), attribute, 0);
  }
  return array;
}

class GlKernelCanvas final : public KernelCanvas {
 public:
  explicit GlKernelCanvas(glm::ivec2 imageSize)
      : size_(imageSize),
        targets_(imageSize),
        splats_(kBatch * sizeof(KernelSplat)),
        points_(kernelVertexArray(splats_, 0)),
        quads_(kernelVertexArray(splats_, 1)),
        pointProgram_(gl::makeProgram({"shaders/draw_kernel_points.vert", "shaders/accumulate_kernels.frag"})),
        quadProgram_(gl::makeProgram({"shaders/draw_kernel_quads.vert", "shaders/accumulate_kernels.frag"})) {
    float range[2] = {};
    glGetFloatv(GL_POINT_SIZE_RANGE, range);
    largestPoint_ = range[1];
    for (const gl::Program* program : {&pointProgram_, &quadProgram_}) {
      glProgramUniform2f(program->id(), kImageSizeUniform, float(size_.x), float(size_.y));
    }
    largeSplats_.reserve(kBatch);
  }

  void clear() override { targets_.clear(); }

  void draw(std::span<const KernelSplat> splats) override {
    targets_.bind();
    while (!splats.empty()) {
      const std::span<const KernelSplat> batch = splats.first(std::min(splats.size(), kBatch));
      splats = splats.subspan(batch.size());
      smallSplats_.clear();
      largeSplats_.clear();
      for (const KernelSplat& splat : batch)
        (fitsPoint(splat) ? smallSplats_ : largeSplats_).push_back(splat);
      if (!smallSplats_.empty()) {
        splats_.replace(std::as_bytes(std::span(smallSplats_)));
        glUseProgram(pointProgram_.id());
        glBindVertexArray(points_.id());
        glDrawArrays(GL_POINTS, 0, GLsizei(smallSplats_.size()));
      }
      if (!largeSplats_.empty()) {
        splats_.replace(std::as_bytes(std::span(largeSplats_)));
        glUseProgram(quadProgram_.id());
        glBindVertexArray(quads_.id());
        glDrawArraysInstanced(GL_TRIANGLE_STRIP, 0, 4, GLsizei(largeSplats_.size()));
      }
    }
    SumTargets::release();
  }

  Image wholeQuanta() override { return targets_.read(); }

 private:
  /// draw_kernel_points.vert makes the point as large as the longer side inside the image, and two pixels more.
  bool fitsPoint(const KernelSplat& splat) const {
    return std::min(2.0f * splat.extentX, float(size_.x)) + 2.0f <= largestPoint_ &&
           std::min(2.0f * splat.extentY, float(size_.y)) + 2.0f <= largestPoint_;
  }

  glm::ivec2 size_;
  SumTargets targets_;
  gl::Buffer splats_;
  gl::VertexArray points_;
  gl::VertexArray quads_;
  gl::Program pointProgram_;
  gl::Program quadProgram_;
  float largestPoint_ = 1.0f;
  std::vector<KernelSplat> smallSplats_;
  std::vector<KernelSplat> largeSplats_;
};

}  // namespace

std::unique_ptr<KernelCanvas> makeGlKernelCanvas(gl::Context& /*context*/, glm::ivec2 imageSize) {
  return std::make_unique<GlKernelCanvas>(imageSize);
}

}  // namespace freevoxel
