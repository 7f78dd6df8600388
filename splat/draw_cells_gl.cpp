#include <algorithm>
#include <vector>

#include "base/error.h"
#include "gl/objects.h"
#include "gl/program.h"
#include "splat/draw_cells.h"
#include "splat/sum_targets.h"

namespace freevoxel {

namespace {

/// Voxels, aprons included, that pass through the sample buffer at a time: 16 MiB.
constexpr size_t kVoxelsAtATime = size_t(4) << 20;

// Locations and bindings of draw_blocks.vert and accumulate_cells.frag.
constexpr GLint kImageSizeUniform = 0, kImageWidthUniform = 1, kEntriesPerCodeUniform = 2, kInverseQuantumUniform = 3,
                kHiddenBelowUniform = 4;
constexpr GLuint kRaysBinding = 0, kLayoutsBinding = 1, kSamplesBinding = 2, kLightsBinding = 3, kIntegralBinding = 4,
                 kDensityBinding = 5;

template <class T>
std::span<const std::byte> bytesOf(const std::vector<T>& items) {
  return std::as_bytes(std::span(items));
}

class GlCellCanvas final : public CellCanvas {
 public:
  explicit GlCellCanvas(glm::ivec2 imageSize)
      : targets_(imageSize),
        program_(gl::makeProgram({"shaders/draw_blocks.vert", "shaders/accumulate_cells.frag"})),
        rectangles_(gl::makeVertexArray()) {
    glProgramUniform2f(program_.id(), kImageSizeUniform, float(imageSize.x), float(imageSize.y));
    glProgramUniform1i(program_.id(), kImageWidthUniform, imageSize.x);
  }

  void clear() override { targets_.clear(); }

  void draw(const CellFrame& frame, std::span<const VisibleBlock> blocks, CellCounts& counts) override {
    glFinish();  // as in drawBatch
    replace(rays_, bytesOf(*frame.rays));
    replace(integral_, bytesOf(frame.table->integral));
    replace(density_, bytesOf(frame.table->density));
    glProgramUniform1f(program_.id(), kEntriesPerCodeUniform, frame.table->entriesPerCode);
    glProgramUniform1f(program_.id(), kInverseQuantumUniform, frame.inverseQuantum);
    glProgramUniform1f(program_.id(), kHiddenBelowUniform, frame.hiddenBelow);
    const size_t blocksAtATime = std::max(size_t(1), kVoxelsAtATime / blockVoxels(frame.edge));
    while (!blocks.empty()) {
      const std::span<const VisibleBlock> batch = blocks.first(std::min(blocks.size(), blocksAtATime));
      blocks = blocks.subspan(batch.size());
      drawBatch(frame, batch, counts);
    }
  }

  Image wholeQuanta() override { return targets_.read(); }

 private:
  /// Makes `buffer` hold `data`, larger if need be.
  static void replace(gl::Buffer& buffer, std::span<const std::byte> data) {
    const size_t bytes = std::max(data.size(), size_t(16));
    if (buffer.bytes() < bytes) buffer = gl::Buffer(bytes);
    buffer.replace(data);
  }

  void drawBatch(const CellFrame& frame, std::span<const VisibleBlock> blocks, CellCounts& counts) {
    const bool lit = !frame.light->empty();
    const size_t voxels = blockVoxels(frame.edge);
    std::vector<VisibleBlock> shown;
    std::vector<PixelBounds> bounds;
    for (const VisibleBlock& block : blocks) {
      const PixelBounds pixels = pixelBounds(*frame.view, block);
      (pixels.empty() ? counts.culledBlocks : counts.blocks) += 1;
      if (pixels.empty()) continue;
      const glm::ivec2 size = pixels.high - pixels.low;
      counts.fragments += uint64_t(size.x) * uint64_t(size.y);
      shown.push_back(block);
      bounds.push_back(pixels);
    }
    if (shown.empty()) return;
    std::vector<CellLayout> layouts(shown.size() * 3);
    std::vector<uint32_t> samples(shown.size() * voxels);
    std::vector<LightValue> lights(lit ? shown.size() * voxels : 0);
#pragma omp parallel for schedule(dynamic, 1)
    for (int64_t i = 0; i < int64_t(shown.size()); ++i) {
      const VisibleBlock& block = shown[size_t(i)];
      const size_t start = size_t(i) * voxels;
      for (int axis = 0; axis < 3; ++axis) {
        CellLayout& layout = layouts[size_t(i) * 3 + size_t(axis)];
        layout = cellLayout(block, frame.grid->dims, frame.edge, axis, lit);
        layout.samples = int(start);
      }
      std::vector<uint16_t> codes(voxels), attenuations(voxels);
      gatherBlock(*frame.grid, *frame.attenuation, block.origin, frame.edge, codes, attenuations);
      for (size_t v = 0; v < voxels; ++v)
        samples[start + v] = uint32_t(codes[v]) | uint32_t(attenuations[v]) << 16;
      if (lit)
        gatherLight(*frame.light, frame.grid->dims, block.origin, frame.edge, std::span(lights).subspan(start, voxels));
    }
    // llvmpipe does not know that a fragment shader still reads a storage buffer: what is drawn must be done first.
    glFinish();
    replace(layouts_, bytesOf(layouts));
    replace(samples_, bytesOf(samples));
    replace(lights_, bytesOf(lights));
    replace(bounds_, bytesOf(bounds));

    targets_.bind();
    glUseProgram(program_.id());
    const std::pair<GLuint, const gl::Buffer*> bindings[] = {
        {kRaysBinding, &rays_},     {kLayoutsBinding, &layouts_},   {kSamplesBinding, &samples_},
        {kLightsBinding, &lights_}, {kIntegralBinding, &integral_}, {kDensityBinding, &density_}};
    for (const auto& [binding, buffer] : bindings)
      glBindBufferBase(GL_SHADER_STORAGE_BUFFER, binding, buffer->id());
    static_assert(sizeof(PixelBounds) == 16);
    glVertexArrayVertexBuffer(rectangles_.id(), 0, bounds_.id(), 0, sizeof(PixelBounds));
    glVertexArrayBindingDivisor(rectangles_.id(), 0, 1);
    glEnableVertexArrayAttrib(rectangles_.id(), 0);
    glVertexArrayAttribIFormat(rectangles_.id(), 0, 4, GL_INT, 0);
    glVertexArrayAttribBinding(rectangles_.id(), 0, 0);
    glBindVertexArray(rectangles_.id());
    glDrawArraysInstanced(GL_TRIANGLE_STRIP, 0, 4, GLsizei(shown.size()));
    SumTargets::release();
  }

  SumTargets targets_;
  gl::Program program_;
  gl::VertexArray rectangles_;
  gl::Buffer rays_, layouts_, samples_, lights_, integral_, density_, bounds_;
};

}  // namespace

std::unique_ptr<CellCanvas> makeGlCellCanvas(gl::Context& /*context*/, glm::ivec2 imageSize) {
  return std::make_unique<GlCellCanvas>(imageSize);
}

}  // namespace freevoxel
