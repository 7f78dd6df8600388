#include "voxlink/gl_buffers.h"

#include <algorithm>
#include <array>
#include <climits>
#include <cmath>
#include <glm/glm.hpp>
#include <glm/gtc/type_ptr.hpp>

#include "base/error.h"
#include "gl/program.h"
#include "voxlink/gl_passes.h"
#include "voxlink/trace_rays.h"

namespace freevoxel {

namespace {

glm::dmat3 lengthFromIndex(const Placement& placement) {
  glm::dmat3 matrix;
  for (int axis = 0; axis < 3; ++axis)
    matrix[axis] = placement.direction[axis] * (placement.spacing[axis] / placement.unitLength());
  return matrix;
}

glm::ivec3 volumeBricks(glm::ivec3 dims, int edge) {
  return (dims + (edge - 1)) / edge;
}

}  // namespace

GlVoxLink::GlVoxLink(const gl::Context& context, uint64_t memoryLimit)
    : memory_(context, memoryLimit),
      prefixSum_(memory_),
      countVoxels_(gl::makeProgram({"shaders/voxlink/count_voxels.comp"})),
      fillBrickWords_(gl::makeProgram({"shaders/voxlink/fill_brick_words.comp"})),
      fillBricks_(gl::makeProgram({"shaders/voxlink/fill_bricks.comp"})),
      traceShadows_(gl::makeProgram({"shaders/voxlink/trace_shadows.comp"})),
      lightVoxels_(gl::makeProgram({"shaders/voxlink/light_voxels.comp"})),
      traceRays_(gl::makeProgram({"shaders/voxlink/trace_rays.comp"})) {}

void GlVoxLink::uploadSlab(const ValueGrid& grid, int layer) {
  const int first = std::max(0, layer * bricks_.edge - 1);
  const int end = std::min(dims_.z, (layer + 1) * bricks_.edge + 1);
  const size_t slice = size_t(dims_.x) * size_t(dims_.y);
  glFinish();  // llvmpipe does not know that a pass still reads a storage buffer
  write(slab_, std::span(grid.codes).subspan(size_t(first) * slice, size_t(end - first) * slice));
  for (const gl::Program* program : {&countVoxels_, &fillBricks_}) {
    setInts(*program, 0, dims_);
    glProgramUniform1i(program->id(), 1, first);
    glProgramUniform1i(program->id(), 2, bricks_.edge);
    glProgramUniform1i(program->id(), 3, layer);
  }
}

void GlVoxLink::count(const ValueGrid& grid, const std::vector<uint8_t>& stored, Progress& progress) {
  std::vector<uint32_t> bits(stored.size() / 32 + 1);
  for (size_t code = 0; code < stored.size(); ++code) {
    if (stored[code] != 0) bits[code / 32] |= 1u << (code % 32);
  }
  stored_ = memory_.allocate(bits.size() * sizeof(uint32_t), "the list of stored codes");
  write(stored_, std::span<const uint32_t>(bits));
  const std::array<int32_t, 6> nothing{INT_MAX, INT_MAX, INT_MAX, 0, 0, 0};
  box_ = memory_.allocate(sizeof nothing, "the box");
  write(box_, std::span<const int32_t>(nothing));
  fillWithZeros(counts_);
  const glm::ivec3 bricks = volumeBricks(dims_, bricks_.edge);
  for (int layer = 0; layer < bricks.z; ++layer) {
    uploadSlab(grid, layer);
    bindStorage({&slab_, &stored_, &counts_, &box_});
    dispatch(countVoxels_, uint64_t(bricks.x), uint64_t(bricks.y));
    progress.advance(1);
  }
}

void GlVoxLink::build(const ValueGrid& grid, const std::vector<uint8_t>& stored, int brickEdge, Progress& progress) {
  checkBrickEdge(brickEdge);
  checkEqual(uint64_t(grid.codes.size()), voxelCount(grid.dims), "codes of the grid");
  checkEqual(stored.size(), size_t(grid.coding.largest) + 1, "codes of the volume");
  glFinish();
  for (gl::Buffer* old : {&brickWords_, &brickHeaders_, &fragments_, &shares_, &light_})
    memory_.release(*old);
  lit_ = false;
  dims_ = grid.dims;
  placement_ = grid.placement;
  bricks_ = BrickGrid{};
  bricks_.edge = brickEdge;
  const glm::ivec3 bricks = volumeBricks(dims_, brickEdge);
  const uint64_t brickCount = voxelCount(bricks);
  if (uint64_t(std::max({bricks.x, bricks.y, bricks.z})) > kMostGroups || brickCount > uint64_t(INT_MAX)) {
    throw MachineError(
        fmt::format("VoxLink: {} x {} x {} bricks are more than GPU passes can count; use larger bricks "
                    "or --backend cpu",
                    bricks.x, bricks.y, bricks.z));
  }
  progress.begin("building", 2 * uint64_t(bricks.z), "layers");
  slab_ = memory_.allocate(uint64_t(dims_.x) * uint64_t(dims_.y) * uint64_t(std::min(dims_.z, brickEdge + 2)) * 2,
                           "a slab of the volume");
  counts_ = memory_.allocate((brickCount + 1) * 8, "the count of voxels per brick");
  count(grid, stored, progress);
  std::array<int32_t, 6> box{};
  read(box_, std::span<int32_t>(box));
  if (box[0] >= box[3]) throw nothingStored();
  bricks_ = brickGrid(brickEdge, {box[0], box[1], box[2]}, {box[3], box[4], box[5]});

  prefixSum_.run(counts_, brickCount + 1);
  std::array<uint32_t, 2> totals{};
  read(counts_, std::span<uint32_t>(totals), brickCount * 8);
  occupied_ = totals[0];
  fragmentCount_ = totals[1];
  const uint64_t headerBytes = occupied_ * uint64_t(shared::headerWords(brickEdge)) * 4;
  const uint64_t wordCount = (bricks_.bricks() + 31) / 32;
  brickWords_ = memory_.allocate(wordCount * sizeof(BrickWord), "the brick grid");
  brickHeaders_ = memory_.allocate(headerBytes, "brick headers");
  fragments_ = memory_.allocate(fragmentCount_ * 4, "the fragment buffer");

  setInts(fillBrickWords_, 0, bricks);
  setInts(fillBrickWords_, 1, bricks_.first);
  setInts(fillBrickWords_, 2, bricks_.count);
  glProgramUniform1ui(fillBrickWords_.id(), 3, GLuint(wordCount));
  bindStorage({&counts_, &brickWords_});
  dispatchMany(fillBrickWords_, (wordCount + 63) / 64);

  setMatrix(fillBricks_, 4, gradientFromDifferences(grid));
  glProgramUniform1f(fillBricks_.id(), 5, kPerSurface);
  for (int layer = bricks_.first.z; layer < bricks_.first.z + bricks_.count.z; ++layer) {
    uploadSlab(grid, layer);
    bindStorage({&slab_, &stored_, &counts_, &brickHeaders_, &fragments_});
    dispatch(fillBricks_, uint64_t(bricks.x), uint64_t(bricks.y));
    progress.advance(1);
  }
  glFinish();
  for (gl::Buffer* temporary : {&slab_, &stored_, &counts_, &box_})
    memory_.release(*temporary);
  progress.end();
}

VoxLinkBuffers GlVoxLink::download() const {
  VoxLinkBuffers buffers;
  buffers.dims = dims_;
  buffers.placement = placement_;
  buffers.grid = bricks_;
  buffers.brickWords.resize((bricks_.bricks() + 31) / 32);
  buffers.brickHeaders.resize(size_t(occupied_) * size_t(shared::headerWords(bricks_.edge)));
  buffers.fragments.resize(size_t(fragmentCount_));
  read(brickWords_, std::span(buffers.brickWords));
  read(brickHeaders_, std::span(buffers.brickHeaders));
  read(fragments_, std::span(buffers.fragments));
  return buffers;
}

void GlVoxLink::setMaterials(std::span<const VoxelMaterial> materials) {
  glFinish();
  if (materials_.bytes() < materials.size_bytes()) {
    memory_.release(materials_);
    materials_ = memory_.allocate(materials.size_bytes(), "the material buffer");
  }
  write(materials_, materials);
}

void GlVoxLink::useBuffers(const gl::Program& program) const {
  setInts(program, 0, bricks_.low);
  setInts(program, 1, bricks_.high);
  setInts(program, 2, bricks_.first);
  setInts(program, 3, bricks_.count);
  glProgramUniform1i(program.id(), 4, bricks_.edge);
}

void GlVoxLink::setShares(const LightShares& shares) {
  checkEqual(fragmentCount_ == 0 ? 0 : shares.size() % fragmentCount_, uint64_t(0), "shares beyond whole lamps");
  glFinish();
  memory_.release(shares_);
  lamps_ = size_t(shares.size() / fragmentCount_);
  shares_ = memory_.allocate(shares.size(), "the lamps' shares");
  write(shares_, std::span<const uint8_t>(shares));
}

void GlVoxLink::traceShares(std::span<const Light> lights) {
  glFinish();
  memory_.release(shares_);
  lamps_ = lights.size();
  if (fragmentCount_ * lamps_ > UINT32_MAX) {
    throw MachineError(fmt::format("VoxLink: {} lamps over {} voxels are more than 32 bits can name; use --backend cpu",
                                   lamps_, fragmentCount_));
  }
  shares_ = memory_.allocate(fragmentCount_ * lamps_, "the lamps' shares");
  fillWithZeros(shares_);
  useBuffers(traceShadows_);
  setMatrix(traceShadows_, 10, lengthFromIndex(placement_));
  for (size_t n = 0; n < lamps_; ++n) {
    const LampView lamp(placement_, lights[n]);
    const glm::vec3 index(lamp.directional ? glm::normalize(lamp.index) : lamp.index);
    glProgramUniform1ui(traceShadows_.id(), 7, GLuint(n * fragmentCount_));
    glProgramUniform1i(traceShadows_.id(), 8, lamp.directional ? 1 : 0);
    glProgramUniform3f(traceShadows_.id(), 9, index.x, index.y, index.z);
    bindStorage({&brickWords_, &brickHeaders_, &fragments_, &materials_, &shares_});
    for (int localZ = 0; localZ < bricks_.edge; ++localZ) {
      glProgramUniform1i(traceShadows_.id(), 5, localZ);
      for (int column = 0; column < bricks_.edge * bricks_.edge; column += 64) {
        glProgramUniform1i(traceShadows_.id(), 6, column);
        dispatch(traceShadows_, uint64_t(bricks_.count.x), uint64_t(bricks_.count.y), uint64_t(bricks_.count.z));
      }
    }
  }
}

LightShares GlVoxLink::downloadShares() const {
  LightShares shares(size_t(fragmentCount_) * lamps_);
  read(shares_, std::span(shares));
  return shares;
}

void GlVoxLink::light(const Lighting& lighting, const Camera& camera) {
  checkLighting(lighting);
  checkEqual(lighting.lights.size(), lamps_, "lamps with shares");
  constexpr size_t kMostLamps = 512;  // times the voxels of four columns, within llvmpipe's turns of a loop
  if (lamps_ > kMostLamps) {
    throw MachineError(
        fmt::format("VoxLink: {} lamps are more than the {} of the GPU passes; use --backend cpu", lamps_, kMostLamps));
  }
  const double unit = placement_.unitLength();
  const auto towards = [&](glm::dvec3 world) { return glm::vec3((world - placement_.origin) / unit); };
  std::vector<glm::vec4> lamps;
  for (const Light& lamp : lighting.lights) {
    lamps.emplace_back(lamp.directional ? glm::vec3(glm::normalize(lamp.world)) : towards(lamp.world),
                       lamp.directional ? 1.0f : 0.0f);
    lamps.emplace_back(lamp.linear, 0.0f);
  }
  glFinish();
  memory_.release(lampBuffer_);
  lampBuffer_ = memory_.allocate(lamps.size() * sizeof(glm::vec4), "the lamps");
  write(lampBuffer_, std::span<const glm::vec4>(lamps));
  if (light_.bytes() < fragmentCount_ * 4) {
    memory_.release(light_);
    light_ = memory_.allocate(fragmentCount_ * 4, "light at the voxels");
  }
  if (shares_.id() == 0) shares_ = memory_.allocate(0, "the lamps' shares");
  useBuffers(lightVoxels_);
  const GLuint id = lightVoxels_.id();
  const glm::vec3 eye =
      camera.orthographicHeight ? glm::vec3(glm::normalize(camera.eye - camera.target)) : towards(camera.eye);
  glProgramUniform1i(id, 5, GLint(lamps_));
  glProgramUniform1ui(id, 6, GLuint(fragmentCount_));
  setMatrix(lightVoxels_, 7, lengthFromIndex(placement_));
  glProgramUniform4f(id, 8, eye.x, eye.y, eye.z, camera.orthographicHeight ? 1.0f : 0.0f);
  glProgramUniform1f(id, 9, lighting.ambient);
  glProgramUniform1i(id, 10, lighting.shading == Shading::none ? 0 : lighting.shading == Shading::lambert ? 1 : 2);
  glProgramUniform1f(id, 11, kPhongHighlight);
  glProgramUniform1f(id, 12, kPhongExponent);
  bindStorage({&brickWords_, &brickHeaders_, &fragments_, &shares_, &light_, &lampBuffer_});
  dispatch(lightVoxels_, uint64_t(bricks_.count.x), uint64_t(bricks_.count.y), uint64_t(bricks_.count.z));
  lit_ = true;
}

Image GlVoxLink::trace(const Camera& camera, ImageRows rows, int steps, int& passes) {
  const glm::ivec2 size(camera.imageSize.x, rows.count);
  passes = 0;
  if (rows.count == 0) return Image(size, 4);
  check(steps >= 1 && steps <= kMostSteps, "steps are in their range");
  glm::dmat4 voxelsFromWorld = glm::inverse(placement_.worldFromIndex());
  voxelsFromWorld[3] += glm::dvec4(0.5, 0.5, 0.5, 0.0);
  const double unit = placement_.unitLength();
  const PixelRays pixelRays(camera, voxelsFromWorld, 0.5 * glm::dvec3(bricks_.low + bricks_.high), unit);
  const uint64_t rayCount = uint64_t(size.x) * uint64_t(size.y);
  glFinish();
  if (rays_.bytes() < rayCount * sizeof(RayState)) {
    memory_.release(rays_);
    rays_ = memory_.allocate(rayCount * sizeof(RayState), "the ray buffer");
  }
  if (active_.id() == 0) active_ = memory_.allocate(sizeof(uint32_t), "the count of active rays");
  useBuffers(traceRays_);
  const GLuint id = traceRays_.id();
  glProgramUniform2i(id, 5, size.x, size.y);
  glProgramUniform1i(id, 16, rows.first);
  pixelRays.set(traceRays_, 6, 9);
  setMatrix(traceRays_, 12, glm::dmat3(voxelsFromWorld) * unit);
  glProgramUniform1i(id, 13, steps);
  glProgramUniform1i(id, 15, lit_ ? 1 : 0);
  const gl::Buffer& light = lit_ ? light_ : active_;  // any buffer: it is not read
  for (passes = 1;; ++passes) {
    glProgramUniform1i(id, 14, passes == 1 ? 1 : 0);
    fillWithZeros(active_);
    bindStorage({&brickWords_, &brickHeaders_, &fragments_, &materials_, &light, &rays_, &active_});
    dispatch(traceRays_, uint64_t(size.x + 7) / 8, uint64_t(size.y + 7) / 8);
    uint32_t active = 0;
    glFinish();
    read(active_, std::span(&active, 1));
    if (active == 0) break;
  }
  std::vector<RayState> rays(static_cast<size_t>(rayCount));
  read(rays_, std::span(rays));
  Image picture(size, 4);
  for (size_t i = 0; i < rays.size(); ++i) {
    float* pixel = picture.pixels.data() + 4 * i;
    pixel[0] = rays[i].red;
    pixel[1] = rays[i].green;
    pixel[2] = rays[i].blue;
    pixel[3] = 1.0f - rays[i].through;
  }
  return picture;
}

}  // namespace freevoxel
