#include "voxlink/gl_buffers.h"

#include <algorithm>
#include <array>
#include <climits>
#include <cmath>
#include <glm/glm.hpp>
#include <glm/gtc/type_ptr.hpp>

#include "base/error.h"
#include "gl/program.h"
#include "voxlink/trace_rays.h"

namespace freevoxel {

namespace {

/// llvmpipe crashes beyond this.
constexpr uint64_t kLargestSoftwareBuffer = uint64_t(1) << 31;
/// Groups along one axis that every driver takes.
constexpr uint64_t kMostGroups = 65535;
constexpr uint64_t kScanBlock = 256;

void bind(std::initializer_list<const gl::Buffer*> buffers) {
  GLuint binding = 0;
  for (const gl::Buffer* buffer : buffers)
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, binding++, buffer->id());
}

/// Runs a program over groups; what it wrote is there for later passes and for reading.
void dispatch(const gl::Program& program, uint64_t x, uint64_t y = 1, uint64_t z = 1) {
  glUseProgram(program.id());
  glDispatchCompute(GLuint(x), GLuint(y), GLuint(z));
  glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT | GL_BUFFER_UPDATE_BARRIER_BIT);
}

/// A number of groups as a rectangle of groups; programs skip what is too many.
void dispatchMany(const gl::Program& program, uint64_t groups) {
  const uint64_t rows = (groups + kMostGroups - 1) / kMostGroups;
  dispatch(program, rows > 1 ? kMostGroups : groups, rows);
}

template <class T>
void write(const gl::Buffer& buffer, std::span<const T> data, uint64_t offset = 0) {
  glNamedBufferSubData(buffer.id(), GLintptr(offset), GLsizeiptr(data.size_bytes()), data.data());
}

template <class T>
void read(const gl::Buffer& buffer, std::span<T> data, uint64_t offset = 0) {
  glGetNamedBufferSubData(buffer.id(), GLintptr(offset), GLsizeiptr(data.size_bytes()), data.data());
}

void fillWithZeros(const gl::Buffer& buffer) {
  const uint32_t zero = 0;
  glClearNamedBufferData(buffer.id(), GL_R32UI, GL_RED_INTEGER, GL_UNSIGNED_INT, &zero);
}

void setInts(const gl::Program& program, GLint location, glm::ivec3 value) {
  glProgramUniform3i(program.id(), location, value.x, value.y, value.z);
}

void setMatrix(const gl::Program& program, GLint location, const glm::dmat3& value) {
  const glm::mat3 single(value);
  glProgramUniformMatrix3fv(program.id(), location, 1, GL_FALSE, glm::value_ptr(single));
}

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
    : memoryLimit_(memoryLimit),
      countVoxels_(gl::makeProgram({"shaders/voxlink/count_voxels.comp"})),
      sumBlocks_(gl::makeProgram({"shaders/voxlink/sum_blocks.comp"})),
      addBlockSums_(gl::makeProgram({"shaders/voxlink/add_block_sums.comp"})),
      fillBrickWords_(gl::makeProgram({"shaders/voxlink/fill_brick_words.comp"})),
      fillBricks_(gl::makeProgram({"shaders/voxlink/fill_bricks.comp"})),
      traceShadows_(gl::makeProgram({"shaders/voxlink/trace_shadows.comp"})),
      lightVoxels_(gl::makeProgram({"shaders/voxlink/light_voxels.comp"})),
      traceRays_(gl::makeProgram({"shaders/voxlink/trace_rays.comp"})) {
  GLint64 largest = 0;
  glGetInteger64v(GL_MAX_SHADER_STORAGE_BLOCK_SIZE, &largest);
  largestBuffer_ = largest > 0 ? uint64_t(largest) : uint64_t(INT_MAX);
  if (context.isSoftware()) largestBuffer_ = std::min(largestBuffer_, kLargestSoftwareBuffer);
}

gl::Buffer GlVoxLink::allocate(uint64_t bytes, const char* what) {
  bytes = (std::max(bytes, uint64_t(16)) + 3) / 4 * 4;
  if (bytes > largestBuffer_) {
    throw MachineError(
        fmt::format("VoxLink: {} takes {} MiB, more than the {} MiB that this driver can bind as one buffer; raise "
                    "--threshold, lower --resolution or use --backend cpu",
                    what, bytes >> 20, largestBuffer_ >> 20));
  }
  if (used_ + bytes > memoryLimit_) {
    throw MachineError(
        fmt::format("VoxLink: {} takes {} KiB of GPU memory beside {} KiB in use, more than the limit of {} KiB; raise "
                    "--gpu-memory or --threshold, lower --resolution or use --backend cpu",
                    what, (bytes + 1023) >> 10, used_ >> 10, memoryLimit_ >> 10));
  }
  while (glGetError() != GL_NO_ERROR) {
  }
  gl::Buffer buffer(bytes);
  if (glGetError() == GL_OUT_OF_MEMORY) {
    throw MachineError(fmt::format(
        "VoxLink: the GPU has no {} MiB left for {}; raise --threshold, lower --resolution or use --backend cpu",
        bytes >> 20, what));
  }
  used_ += bytes;
  return buffer;
}

void GlVoxLink::release(gl::Buffer& buffer) {
  used_ -= buffer.bytes();
  buffer = gl::Buffer();
}

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
  stored_ = allocate(bits.size() * sizeof(uint32_t), "the list of stored codes");
  write(stored_, std::span<const uint32_t>(bits));
  const std::array<int32_t, 6> nothing{INT_MAX, INT_MAX, INT_MAX, 0, 0, 0};
  box_ = allocate(sizeof nothing, "the box");
  write(box_, std::span<const int32_t>(nothing));
  fillWithZeros(counts_);
  const glm::ivec3 bricks = volumeBricks(dims_, bricks_.edge);
  for (int layer = 0; layer < bricks.z; ++layer) {
    uploadSlab(grid, layer);
    bind({&slab_, &stored_, &counts_, &box_});
    dispatch(countVoxels_, uint64_t(bricks.x), uint64_t(bricks.y));
    progress.advance(1);
  }
}

void GlVoxLink::sumUp(const gl::Buffer& entries, uint64_t count) {
  const uint64_t blocks = (count + kScanBlock - 1) / kScanBlock;
  gl::Buffer sums = allocate(blocks * 8, "a prefix sum");
  bind({&entries, &sums});
  glProgramUniform1ui(sumBlocks_.id(), 0, GLuint(count));
  dispatchMany(sumBlocks_, blocks);
  if (blocks > 1) {
    sumUp(sums, blocks);
    bind({&entries, &sums});
    glProgramUniform1ui(addBlockSums_.id(), 0, GLuint(count));
    dispatchMany(addBlockSums_, blocks);
  }
  glFinish();  // before the buffer of sums goes
  release(sums);
}

void GlVoxLink::build(const ValueGrid& grid, const std::vector<uint8_t>& stored, int brickEdge, Progress& progress) {
  checkBrickEdge(brickEdge);
  checkEqual(uint64_t(grid.codes.size()), voxelCount(grid.dims), "codes of the grid");
  checkEqual(stored.size(), size_t(grid.coding.largest) + 1, "codes of the volume");
  glFinish();
  for (gl::Buffer* old : {&brickWords_, &brickHeaders_, &fragments_, &shares_, &light_})
    release(*old);
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
  slab_ = allocate(uint64_t(dims_.x) * uint64_t(dims_.y) * uint64_t(std::min(dims_.z, brickEdge + 2)) * 2,
                   "a slab of the volume");
  counts_ = allocate((brickCount + 1) * 8, "the count of voxels per brick");
  count(grid, stored, progress);
  std::array<int32_t, 6> box{};
  read(box_, std::span<int32_t>(box));
  if (box[0] >= box[3]) throw nothingStored();
  bricks_ = brickGrid(brickEdge, {box[0], box[1], box[2]}, {box[3], box[4], box[5]});

  sumUp(counts_, brickCount + 1);
  std::array<uint32_t, 2> totals{};
  read(counts_, std::span<uint32_t>(totals), brickCount * 8);
  occupied_ = totals[0];
  fragmentCount_ = totals[1];
  const uint64_t headerBytes = occupied_ * uint64_t(shared::headerWords(brickEdge)) * 4;
  const uint64_t wordCount = (bricks_.bricks() + 31) / 32;
  brickWords_ = allocate(wordCount * sizeof(BrickWord), "the brick grid");
  brickHeaders_ = allocate(headerBytes, "brick headers");
  fragments_ = allocate(fragmentCount_ * 4, "the fragment buffer");

  setInts(fillBrickWords_, 0, bricks);
  setInts(fillBrickWords_, 1, bricks_.first);
  setInts(fillBrickWords_, 2, bricks_.count);
  glProgramUniform1ui(fillBrickWords_.id(), 3, GLuint(wordCount));
  bind({&counts_, &brickWords_});
  dispatchMany(fillBrickWords_, (wordCount + 63) / 64);

  setMatrix(fillBricks_, 4, gradientFromDifferences(grid));
  glProgramUniform1f(fillBricks_.id(), 5, kSurfaceGradient);
  for (int layer = bricks_.first.z; layer < bricks_.first.z + bricks_.count.z; ++layer) {
    uploadSlab(grid, layer);
    bind({&slab_, &stored_, &counts_, &brickHeaders_, &fragments_});
    dispatch(fillBricks_, uint64_t(bricks.x), uint64_t(bricks.y));
    progress.advance(1);
  }
  glFinish();
  for (gl::Buffer* temporary : {&slab_, &stored_, &counts_, &box_})
    release(*temporary);
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
    release(materials_);
    materials_ = allocate(materials.size_bytes(), "the material buffer");
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
  release(shares_);
  lamps_ = size_t(shares.size() / fragmentCount_);
  shares_ = allocate(shares.size(), "the lamps' shares");
  write(shares_, std::span<const uint8_t>(shares));
}

void GlVoxLink::traceShares(std::span<const Light> lights) {
  glFinish();
  release(shares_);
  lamps_ = lights.size();
  if (fragmentCount_ * lamps_ > UINT32_MAX) {
    throw MachineError(fmt::format("VoxLink: {} lamps over {} voxels are more than 32 bits can name; use --backend cpu",
                                   lamps_, fragmentCount_));
  }
  shares_ = allocate(fragmentCount_ * lamps_, "the lamps' shares");
  fillWithZeros(shares_);
  useBuffers(traceShadows_);
  setMatrix(traceShadows_, 10, lengthFromIndex(placement_));
  for (size_t n = 0; n < lamps_; ++n) {
    const LampView lamp(placement_, lights[n]);
    const glm::vec3 index(lamp.directional ? glm::normalize(lamp.index) : lamp.index);
    glProgramUniform1ui(traceShadows_.id(), 7, GLuint(n * fragmentCount_));
    glProgramUniform1i(traceShadows_.id(), 8, lamp.directional ? 1 : 0);
    glProgramUniform3f(traceShadows_.id(), 9, index.x, index.y, index.z);
    bind({&brickWords_, &brickHeaders_, &fragments_, &materials_, &shares_});
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
  release(lampBuffer_);
  lampBuffer_ = allocate(lamps.size() * sizeof(glm::vec4), "the lamps");
  write(lampBuffer_, std::span<const glm::vec4>(lamps));
  if (light_.bytes() < fragmentCount_ * 4) {
    release(light_);
    light_ = allocate(fragmentCount_ * 4, "light at the voxels");
  }
  if (shares_.id() == 0) shares_ = allocate(0, "the lamps' shares");
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
  bind({&brickWords_, &brickHeaders_, &fragments_, &shares_, &light_, &lampBuffer_});
  dispatch(lightVoxels_, uint64_t(bricks_.count.x), uint64_t(bricks_.count.y), uint64_t(bricks_.count.z));
  lit_ = true;
}

Image GlVoxLink::trace(const Camera& camera, int steps, int& passes) {
  check(steps >= 1 && steps <= kMostSteps, "steps are in their range");
  const ViewFrame frame = viewFrame(camera);
  const glm::dmat4 indexFromWorld = glm::inverse(placement_.worldFromIndex());
  const glm::dmat3 indexFromWorldLength(indexFromWorld);
  const double unit = placement_.unitLength();
  // Rays are told by where they pass a plane through the middle of the box: from there float positions are exact enough
  // however far away the eye is.
  const glm::dvec3 middle(placement_.worldFromIndex() *
                          glm::dvec4(0.5 * glm::dvec3(bricks_.low + bricks_.high) - 0.5, 1.0));
  const glm::dvec3 forward = glm::transpose(frame.viewFromWorld) * glm::dvec3(0.0, 0.0, -1.0);
  const double distance = std::max(glm::dot(middle - camera.eye, forward), unit);
  const auto wayOf = [&](glm::dvec2 pixel) {
    const Ray ray = pixelRay(frame, pixel);
    return frame.orthographic ? forward * distance : ray.direction * (distance / glm::dot(ray.direction, forward));
  };
  const auto placeOf = [&](glm::dvec2 pixel) {
    const glm::dvec3 world = pixelRay(frame, pixel).origin + wayOf(pixel);
    return glm::dvec3(indexFromWorld * glm::dvec4(world, 1.0)) + 0.5;
  };
  const glm::dvec2 pixels[3] = {{0.0, 0.0}, {1.0, 0.0}, {0.0, 1.0}};
  glm::vec3 places[3], ways[3];
  for (int i = 0; i < 3; ++i) {
    const glm::dvec3 before = i == 0 ? glm::dvec3(0.0) : placeOf(pixels[0]);
    const glm::dvec3 wayBefore = i == 0 ? glm::dvec3(0.0) : wayOf(pixels[0]);
    places[i] = glm::vec3(placeOf(pixels[i]) - before);
    ways[i] = glm::vec3((wayOf(pixels[i]) - wayBefore) / unit);
  }

  const uint64_t rayCount = uint64_t(camera.imageSize.x) * uint64_t(camera.imageSize.y);
  glFinish();
  if (rays_.bytes() < rayCount * sizeof(RayState)) {
    release(rays_);
    rays_ = allocate(rayCount * sizeof(RayState), "the ray buffer");
  }
  if (active_.id() == 0) active_ = allocate(sizeof(uint32_t), "the count of active rays");
  useBuffers(traceRays_);
  const GLuint id = traceRays_.id();
  glProgramUniform2i(id, 5, camera.imageSize.x, camera.imageSize.y);
  glProgramUniform3fv(id, 6, 3, glm::value_ptr(places[0]));
  glProgramUniform3fv(id, 9, 3, glm::value_ptr(ways[0]));
  setMatrix(traceRays_, 12, indexFromWorldLength * unit);
  glProgramUniform1i(id, 13, steps);
  glProgramUniform1i(id, 15, lit_ ? 1 : 0);
  const gl::Buffer& light = lit_ ? light_ : active_;  // any buffer: it is not read
  for (passes = 1;; ++passes) {
    glProgramUniform1i(id, 14, passes == 1 ? 1 : 0);
    fillWithZeros(active_);
    bind({&brickWords_, &brickHeaders_, &fragments_, &materials_, &light, &rays_, &active_});
    dispatch(traceRays_, uint64_t(camera.imageSize.x + 7) / 8, uint64_t(camera.imageSize.y + 7) / 8);
    uint32_t active = 0;
    glFinish();
    read(active_, std::span(&active, 1));
    if (active == 0) break;
  }
  std::vector<RayState> rays(static_cast<size_t>(rayCount));
  read(rays_, std::span(rays));
  Image picture(camera.imageSize, 4);
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
