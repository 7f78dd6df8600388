#include <algorithm>
#include <vector>

#include "base/error.h"
#include "gl/objects.h"
#include "gl/program.h"
#include "splat/draw_cells.h"
#include "splat/ready_blocks.h"
#include "splat/sum_targets.h"

namespace freevoxel {

namespace {

// Locations and bindings of draw_blocks.vert and accumulate_cells.frag.
constexpr GLint kImageSizeUniform = 0, kImageWidthUniform = 1, kEntriesPerCodeUniform = 2, kInverseQuantumUniform = 3,
                kHiddenBelowUniform = 4;
constexpr GLuint kRaysBinding = 0, kLayoutsBinding = 1, kSamplesBinding = 2, kLightsBinding = 3, kIntegralBinding = 4,
                 kDensityBinding = 5, kMatterBinding = 6;

template <class T>
std::span<const std::byte> bytesOf(const std::vector<T>& items) {
  return std::as_bytes(std::span(items));
}

/// Blocks are padded to here in the buffers that they pass through: no driver wants more.
constexpr size_t kOffsetAlignment = 256;

constexpr size_t alignedUp(size_t bytes) {
  return (bytes + kOffsetAlignment - 1) / kOffsetAlignment * kOffsetAlignment;
}

/// What all blocks of a batch take, part by part.
struct BatchBytes {
  size_t layouts = 0, bounds = 0, samples = 0, lights = 0, matter = 0;

  void add(const CellFrame& frame, const VisibleBlock& block) {
    const size_t voxels = blockVoxels(frame.source->edge());
    layouts += 3 * sizeof(CellLayout);
    bounds += sizeof(PixelBounds);
    samples += voxels * sizeof(uint32_t);
    if (frame.source->lit()) lights += voxels * sizeof(LightValue);
    if (block.level > 0) matter += voxels * sizeof(shared::CoverValue);
  }
  size_t total() const {
    return alignedUp(layouts) + alignedUp(bounds) + alignedUp(samples) + alignedUp(lights) + alignedUp(matter);
  }
};

class GlCellCanvas final : public CellCanvas {
 public:
  GlCellCanvas(glm::ivec2 imageSize, size_t blocksAtATime, uint64_t bytes)
      : blocksAtATime_(blocksAtATime),
        allowed_(bytes),
        targets_(imageSize),
        program_(gl::makeProgram({"shaders/draw_blocks.vert", "shaders/accumulate_cells.frag"})),
        rectangles_(gl::makeVertexArray()) {
    glProgramUniform2f(program_.id(), kImageSizeUniform, float(imageSize.x), float(imageSize.y));
    glProgramUniform1i(program_.id(), kImageWidthUniform, imageSize.x);
  }

  void clear() override { targets_.clear(); }

  void draw(const CellFrame& frame, std::span<const VisibleBlock> blocks, CellCounts& counts) override {
    finish();
    replace(rays_, bytesOf(*frame.rays));
    replace(integral_, bytesOf(frame.table->integral));
    replace(density_, bytesOf(frame.table->density));
    glProgramUniform1f(program_.id(), kEntriesPerCodeUniform, frame.table->entriesPerCode);
    glProgramUniform1f(program_.id(), kInverseQuantumUniform, frame.inverseQuantum);
    glProgramUniform1f(program_.id(), kHiddenBelowUniform, frame.hiddenBelow);
    const std::vector<VisibleBlock> shown = blocksOnImage(frame, blocks, counts);
    frame.advanced(blocks.size() - shown.size());
    makeSlots(frame, shown);
    for (size_t first = 0; first < shown.size();) {
      const size_t count = batchSize(frame, std::span(shown).subspan(first));
      // While this batch is read from the file, the one before it is being drawn.
      readyBlocks(frame, std::span(shown).subspan(first, count), ready_, counts);
      drawBatch(frame);
      frame.advanced(count);
      first += count;
    }
  }

  Image wholeQuanta() override {
    finish();
    return targets_.read();
  }

 private:
  /// One of the two buffers that blocks pass through.
  struct Slot {
    gl::Buffer buffer;
    gl::Fence drawn;
  };

  /// llvmpipe does not know that a fragment shader still reads a storage buffer: what is drawn must be done before the
  /// buffer is written again.
  void finish() {
    for (Slot& slot : slots_)
      slot.drawn.wait();
  }

  /// Makes `buffer` hold `data`, larger if need be.
  static void replace(gl::Buffer& buffer, std::span<const std::byte> data) {
    const size_t bytes = std::max(data.size(), size_t(16));
    if (buffer.bytes() < bytes) {
      buffer = gl::Buffer();
      buffer = gl::Buffer(bytes);
    }
    buffer.replace(data);
  }

  /// As large as they may be, but not larger than needed.
  void makeSlots(const CellFrame& frame, std::span<const VisibleBlock> blocks) {
    if (blocks.empty()) return;
    BatchBytes all;
    for (const VisibleBlock& block : blocks)
      all.add(frame, block);
    const size_t wanted = std::min(all.total(), kLargestSlot);
    if (slots_[0].buffer.bytes() >= wanted) return;
    for (Slot& slot : slots_)
      slot.buffer = gl::Buffer();
    const uint64_t others = gl::liveBytes();
    const size_t bytes = std::min<uint64_t>(wanted, allowed_ > others ? (allowed_ - others) / 2 : 0);
    for (const VisibleBlock& block : blocks) {
      BatchBytes one;
      one.add(frame, block);
      if (one.total() > bytes) {
        throw MachineError(fmt::format(
            "the picture and one block of the volume, twice, take {} bytes of graphics memory, {} are allowed; allow "
            "more, or make the picture smaller",
            others + 2 * one.total(), allowed_));
      }
    }
    for (Slot& slot : slots_)
      slot.buffer = gl::Buffer(bytes);
  }

  /// How many of the blocks fit a slot; at least one does.
  size_t batchSize(const CellFrame& frame, std::span<const VisibleBlock> blocks) const {
    BatchBytes bytes;
    size_t count = 0;
    for (; count < std::min(blocks.size(), blocksAtATime_); ++count) {
      bytes.add(frame, blocks[count]);
      if (bytes.total() > slots_[0].buffer.bytes()) break;
    }
    return std::max(count, size_t(1));
  }

  void drawBatch(const CellFrame& frame) {
    const size_t voxels = blockVoxels(frame.source->edge());
    const bool lit = frame.source->lit();
    BatchBytes bytes;
    std::vector<const ReadyBlock*> shown;
    std::vector<PixelBounds> bounds;
    std::vector<size_t> matterStarts;
    for (const ReadyBlock& ready : ready_) {
      if (!ready.drawn) continue;
      matterStarts.push_back(bytes.matter / sizeof(shared::CoverValue));
      bytes.add(frame, ready.block);
      shown.push_back(&ready);
      bounds.push_back(ready.bounds);
    }
    if (shown.empty()) return;
    std::vector<CellLayout> layouts(shown.size() * 3);
    samples_.resize(shown.size() * voxels);
#pragma omp parallel for schedule(dynamic, 1)
    for (int64_t i = 0; i < int64_t(shown.size()); ++i) {
      const ReadyBlock& ready = *shown[size_t(i)];
      const size_t start = size_t(i) * voxels;
      for (int axis = 0; axis < 3; ++axis) {
        CellLayout& layout = layouts[size_t(i) * 3 + size_t(axis)];
        layout = cellLayout(ready.block, frame.source->dims(ready.block.level), frame.source->edge(), axis, lit);
        layout.samples = int(start);
        if (ready.block.level > 0) layout.matter = int(matterStarts[size_t(i)]);
      }
      const std::vector<uint16_t>& codes = ready.samples.codes;
      for (size_t v = 0; v < voxels; ++v)
        samples_[start + v] = (codes.empty() ? 0u : uint32_t(codes[v])) | uint32_t(ready.samples.attenuations[v]) << 16;
    }

    Slot& slot = slots_[next_];
    next_ = 1 - next_;
    slot.drawn.wait();
    size_t at = 0;
    const auto put = [&](GLuint binding, size_t partBytes, auto&& write) {
      // A block of storage may not be empty.
      const size_t size = std::max(partBytes, size_t(16));
      if (partBytes > 0) write(at);
      glBindBufferRange(GL_SHADER_STORAGE_BUFFER, binding, slot.buffer.id(), partBytes > 0 ? GLintptr(at) : 0,
                        GLsizeiptr(size));
      at += alignedUp(partBytes);
    };
    put(kLayoutsBinding, bytes.layouts, [&](size_t offset) { slot.buffer.write(offset, bytesOf(layouts)); });
    put(kSamplesBinding, bytes.samples, [&](size_t offset) { slot.buffer.write(offset, bytesOf(samples_)); });
    put(kLightsBinding, bytes.lights, [&](size_t offset) {
      for (size_t i = 0; i < shown.size(); ++i)
        slot.buffer.write(offset + i * voxels * sizeof(LightValue), bytesOf(shown[i]->samples.lights));
    });
    put(kMatterBinding, bytes.matter, [&](size_t offset) {
      for (size_t i = 0; i < shown.size(); ++i)
        slot.buffer.write(offset + matterStarts[i] * sizeof(shared::CoverValue), bytesOf(shown[i]->samples.cover));
    });
    slot.buffer.write(at, bytesOf(bounds));

    targets_.bind();
    glUseProgram(program_.id());
    const std::pair<GLuint, const gl::Buffer*> bindings[] = {
        {kRaysBinding, &rays_}, {kIntegralBinding, &integral_}, {kDensityBinding, &density_}};
    for (const auto& [binding, buffer] : bindings)
      glBindBufferBase(GL_SHADER_STORAGE_BUFFER, binding, buffer->id());
    static_assert(sizeof(PixelBounds) == 16);
    glVertexArrayVertexBuffer(rectangles_.id(), 0, slot.buffer.id(), GLintptr(at), sizeof(PixelBounds));
    glVertexArrayBindingDivisor(rectangles_.id(), 0, 1);
    glEnableVertexArrayAttrib(rectangles_.id(), 0);
    glVertexArrayAttribIFormat(rectangles_.id(), 0, 4, GL_INT, 0);
    glVertexArrayAttribBinding(rectangles_.id(), 0, 0);
    glBindVertexArray(rectangles_.id());
    glDrawArraysInstanced(GL_TRIANGLE_STRIP, 0, 4, GLsizei(shown.size()));
    SumTargets::release();
    slot.drawn = gl::Fence::here();
    glFlush();
  }

  /// More at a time is not faster.
  static constexpr size_t kLargestSlot = size_t(24) << 20;

  size_t blocksAtATime_;
  uint64_t allowed_;
  SumTargets targets_;
  gl::Program program_;
  gl::VertexArray rectangles_;
  gl::Buffer rays_, integral_, density_;
  Slot slots_[2];
  int next_ = 0;
  std::vector<ReadyBlock> ready_;
  std::vector<uint32_t> samples_;
};

}  // namespace

std::unique_ptr<CellCanvas> makeGlCellCanvas(gl::Context& /*context*/, glm::ivec2 imageSize, size_t blocksAtATime,
                                             uint64_t bytes) {
  return std::make_unique<GlCellCanvas>(imageSize, blocksAtATime, bytes);
}

}  // namespace freevoxel
