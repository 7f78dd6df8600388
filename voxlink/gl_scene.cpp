#include "voxlink/gl_scene.h"

#include <algorithm>
#include <array>
#include <climits>
#include <glm/glm.hpp>

#include "base/error.h"
#include "gl/program.h"
#include "voxlink/direction_code.h"
#include "voxlink/gl_passes.h"

namespace freevoxel {

using shared::RayControl;
using shared::RayRecord;
static_assert(sizeof(RayRecord) == 96 && offsetof(RayRecord, x) == 48 && offsetof(RayRecord, state) == 88);
static_assert(sizeof(RayControl) == 64 && offsetof(RayControl, copyGroups) == 32 &&
              offsetof(RayControl, traceGroups) == 44);

namespace {

constexpr size_t kSnappedTriangleBytes = 48;
constexpr uint32_t kMostEntriesPerVoxel = 60000;
constexpr uint32_t kMostFragmentsPerVoxel = 4096;

template <class T>
std::span<const std::byte> bytesOf(const std::vector<T>& data) {
  return std::as_bytes(std::span(data));
}

void requireIntegers() {
  if (!epoxy_has_gl_extension("GL_ARB_gpu_shader_int64")) {
    throw MachineError(
        "VoxLink: this OpenGL driver has no 64-bit integers (GL_ARB_gpu_shader_int64), which scenes are voxelised "
        "with; "
        "use --backend cpu");
  }
}

gl::Program makeAfterCheck(std::initializer_list<std::string_view> paths) {
  requireIntegers();
  return gl::makeProgram(paths);
}

/// Draws into nothing, of the size of a face of the grid.
class EmptyFramebuffer {
 public:
  explicit EmptyFramebuffer(glm::ivec2 size) {
    GLuint id = 0;
    glCreateFramebuffers(1, &id);
    framebuffer_ = gl::Framebuffer(id);
    glNamedFramebufferParameteri(id, GL_FRAMEBUFFER_DEFAULT_WIDTH, size.x);
    glNamedFramebufferParameteri(id, GL_FRAMEBUFFER_DEFAULT_HEIGHT, size.y);
    glBindFramebuffer(GL_FRAMEBUFFER, id);
    glViewport(0, 0, size.x, size.y);
    for (const GLenum off : {GL_DEPTH_TEST, GL_CULL_FACE, GL_BLEND, GL_SCISSOR_TEST, GL_STENCIL_TEST})
      glDisable(off);
  }
  ~EmptyFramebuffer() { glBindFramebuffer(GL_FRAMEBUFFER, 0); }
  EmptyFramebuffer(const EmptyFramebuffer&) = delete;
  EmptyFramebuffer& operator=(const EmptyFramebuffer&) = delete;

 private:
  gl::Framebuffer framebuffer_;
};

/// Two triangles for each of `count` things.
void drawRectangles(uint64_t count) {
  constexpr uint64_t kMost = uint64_t(INT_MAX) / 6;
  check(count <= kMost, "rectangles can be counted");
  glDrawArrays(GL_TRIANGLES, 0, GLsizei(6 * count));
  glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT | GL_BUFFER_UPDATE_BARRIER_BIT);
}

}  // namespace

/// What is voxelised.
struct GlScene::Inputs {
  gl::Buffer positions, corners, normals, materialOfTriangle, triangles, samples, degenerate;
  uint64_t triangleCount = 0, sphereCount = 0, sampleCount = 0;
};

GlScene::GlScene(const gl::Context& context, uint64_t memoryLimit, uint64_t rayBuffer)
    : memory_(context, memoryLimit),
      prefixSum_(memory_),
      rayBytes_(rayBuffer),
      snapTriangles_(makeAfterCheck({"shaders/voxlink/snap_triangles.comp"})),
      voxeliseTriangles_(
          gl::makeProgram({"shaders/voxlink/voxelise_triangles.vert", "shaders/voxlink/voxelise_triangles.frag"})),
      voxeliseSpheres_(
          gl::makeProgram({"shaders/voxlink/voxelise_spheres.vert", "shaders/voxlink/voxelise_spheres.frag"})),
      emitSamples_(gl::makeProgram({"shaders/voxlink/emit_samples.comp"})),
      findKeys_(gl::makeProgram({"shaders/voxlink/find_keys.comp"})),
      mergeEntries_(gl::makeProgram({"shaders/voxlink/merge_entries.comp"})),
      findReach_(gl::makeProgram({"shaders/voxlink/find_reach.comp"})),
      packFragments_(gl::makeProgram({"shaders/voxlink/pack_fragments.comp"})),
      fillSceneBricks_(gl::makeProgram({"shaders/voxlink/fill_scene_bricks.comp"})),
      fillBrickWords_(gl::makeProgram({"shaders/voxlink/fill_brick_words.comp"})),
      copyStarts_(gl::makeProgram({"shaders/voxlink/copy_starts.comp"})),
      planRays_(gl::makeProgram({"shaders/voxlink/plan_rays.comp"})),
      takeRays_(gl::makeProgram({"shaders/voxlink/take_rays.comp"})),
      traceScene_(gl::makeProgram({"shaders/voxlink/trace_scene.comp"})),
      noVertices_(gl::makeVertexArray()) {}

void GlScene::upload(gl::Buffer& buffer, std::span<const std::byte> bytes, const char* what) {
  memory_.release(buffer);
  buffer = memory_.allocate(bytes.size(), what);
  write(buffer, bytes);
}

void GlScene::voxelise(const Inputs& inputs, int stage) {
  for (const gl::Program* program : {&voxeliseTriangles_, &voxeliseSpheres_, &emitSamples_}) {
    setInts(*program, 0, space_.dims);
    glProgramUniform1i(program->id(), 1, bricks_.edge);
    glProgramUniform1i(program->id(), 2, stage);
  }
  glBindVertexArray(noVertices_.id());
  if (inputs.triangleCount > 0) {
    for (int axis = 0; axis < 3; ++axis) {
      const EmptyFramebuffer target({space_.dims[(axis + 1) % 3], space_.dims[(axis + 2) % 3]});
      glUseProgram(voxeliseTriangles_.id());
      glProgramUniform1i(voxeliseTriangles_.id(), 3, axis);
      bindStorage({&brickCounts_, &table_, &entries_, &inputs.triangles});
      drawRectangles(inputs.triangleCount);
    }
  }
  if (inputs.sphereCount > 0) {
    const EmptyFramebuffer target({space_.dims.x, space_.dims.y});
    glUseProgram(voxeliseSpheres_.id());
    bindStorage({&brickCounts_, &table_, &entries_, &spheres_});
    drawRectangles(inputs.sphereCount);
  }
  if (inputs.sampleCount > 0) {
    glProgramUniform1ui(emitSamples_.id(), 3, GLuint(inputs.sampleCount));
    bindStorage({&brickCounts_, &table_, &entries_, &inputs.samples});
    dispatchMany(emitSamples_, (inputs.sampleCount + 63) / 64);
  }
  glBindVertexArray(0);
  glFinish();
}

void GlScene::build(const SceneVoxels& scene, int brickEdge, uint64_t& degenerate, Progress& progress) {
  checkBrickEdge(brickEdge);
  glFinish();
  for (gl::Buffer* old : {&brickWords_, &brickHeaders_, &voxels_, &fragments_, &volumeLight_})
    memory_.release(*old);
  lit_ = false;
  space_ = scene.grid;
  bricks_ = BrickGrid{};
  bricks_.edge = brickEdge;
  const glm::ivec3 size = (space_.dims + (brickEdge - 1)) / brickEdge;
  const uint64_t brickCount = voxelCount(size);
  const Mesh& mesh = *scene.mesh;
  constexpr uint64_t kMostRectangles = uint64_t(INT_MAX) / 6;
  if (brickCount > uint64_t(INT_MAX) || mesh.triangles.size() > kMostRectangles ||
      scene.spheres.size() > kMostRectangles || scene.samples.size() > UINT32_MAX) {
    throw MachineError("VoxLink: more bricks, triangles or spheres than GPU passes can count; use --backend cpu");
  }
  progress.begin("building", 4, "passes");
  upload(materials_, bytesOf(scene.materials), "the material buffer");
  upload(spheres_, bytesOf(scene.spheres), "the sphere buffer");
  upload(volumeMaterials_, bytesOf(scene.volumeMaterials), "the volumes' materials");
  upload(firstOfVolume_, bytesOf(scene.firstOfVolume), "the list of volumes");
  Inputs inputs;
  inputs.triangleCount = mesh.triangles.size();
  inputs.sphereCount = scene.spheres.size();
  inputs.sampleCount = scene.samples.size();
  upload(inputs.positions, bytesOf(mesh.positions), "the mesh");
  upload(inputs.corners, bytesOf(mesh.triangles), "the mesh");
  upload(inputs.normals, bytesOf(mesh.normals), "the mesh");
  upload(inputs.materialOfTriangle, bytesOf(mesh.materialOfTriangle), "the mesh");
  upload(inputs.samples, bytesOf(scene.samples), "samples of volumes");
  inputs.triangles = memory_.allocate(inputs.triangleCount * kSnappedTriangleBytes, "snapped triangles");
  inputs.degenerate = memory_.allocate(4, "a counter");
  fillWithZeros(inputs.degenerate);
  if (inputs.triangleCount > 0) {
    glProgramUniform1ui(snapTriangles_.id(), 0, GLuint(inputs.triangleCount));
    glProgramUniform3f(snapTriangles_.id(), 1, space_.origin.x, space_.origin.y, space_.origin.z);
    glProgramUniform1f(snapTriangles_.id(), 2, space_.scale());
    bindStorage(
        {&inputs.positions, &inputs.corners, &inputs.materialOfTriangle, &inputs.triangles, &inputs.degenerate});
    dispatchMany(snapTriangles_, (inputs.triangleCount + 63) / 64);
  }
  uint32_t without = 0;
  glFinish();
  read(inputs.degenerate, std::span(&without, 1));
  degenerate = without;

  // Entries per brick.
  brickCounts_ = memory_.allocate((brickCount + 1) * 8, "the count of entries per brick");
  table_ = memory_.allocate(0, "the table of voxels");
  entries_ = memory_.allocate(0, "entries of voxels");
  fillWithZeros(brickCounts_);
  voxelise(inputs, 0);
  progress.advance(1);
  {
    std::vector<std::array<uint32_t, 2>> counts(static_cast<size_t>(brickCount));
    read(brickCounts_, std::span(counts));
    uint64_t total = 0;
    for (const auto& count : counts)
      total += count[1];
    if (total == 0) {
      throw InputError("VoxLink: nothing of the scene fills a voxel, so there is nothing to trace");
    }
    checkFragmentCount(total);
  }
  prefixSum_.run(brickCounts_, brickCount + 1);
  std::array<uint32_t, 2> totals{};
  read(brickCounts_, std::span<uint32_t>(totals), brickCount * 8);
  occupied_ = totals[0];
  const uint64_t entryCount = totals[1];

  // Entries per voxel of occupied bricks, then the entries themselves.
  const uint64_t places = occupied_ * uint64_t(brickEdge) * uint64_t(brickEdge) * uint64_t(brickEdge);
  if (places >= UINT32_MAX) throw MachineError("VoxLink: more voxels in occupied bricks than 32 bits can name");
  memory_.release(table_);
  table_ = memory_.allocate((places + 1) * 8, "the table of voxels");
  fillWithZeros(table_);
  voxelise(inputs, 1);
  progress.advance(1);
  prefixSum_.run(table_, places + 1);
  read(table_, std::span<uint32_t>(totals), places * 8);
  voxelCount_ = totals[0];
  checkEqual(uint64_t(totals[1]), entryCount, "entries of voxels");
  memory_.release(entries_);
  entries_ = memory_.allocate(entryCount * 16, "entries of voxels");
  voxelise(inputs, 2);
  progress.advance(1);

  // Fragments per voxel.
  gl::Buffer starts = memory_.allocate((voxelCount_ + 1) * 8, "the count of fragments per voxel");
  gl::Buffer most = memory_.allocate(8, "a counter");
  fillWithZeros(starts);
  fillWithZeros(most);
  for (const gl::Program* program : {&findKeys_, &mergeEntries_, &findReach_})
    glProgramUniform1ui(program->id(), 0, GLuint(entryCount));
  const uint64_t entryGroups = (entryCount + 63) / 64;
  bindStorage({&table_, &entries_, &starts, &most});
  dispatchMany(findKeys_, entryGroups);
  glFinish();
  std::array<uint32_t, 2> mostInOne{};
  read(most, std::span<uint32_t>(mostInOne));
  if (mostInOne[0] > kMostEntriesPerVoxel || mostInOne[1] > kMostFragmentsPerVoxel) {
    throw MachineError(
        fmt::format("VoxLink: one voxel holds {} triangles and spheres, at most {} of {} kinds go through GPU passes; "
                    "raise --resolution or use --backend cpu",
                    mostInOne[0], kMostEntriesPerVoxel, kMostFragmentsPerVoxel));
  }
  prefixSum_.run(starts, voxelCount_ + 1);
  read(starts, std::span<uint32_t>(totals), voxelCount_ * 8);
  fragmentCount_ = totals[1];

  // Headers and the box.
  brickHeaders_ = memory_.allocate(occupied_ * uint64_t(shared::headerWords(brickEdge)) * 4, "brick headers");
  gl::Buffer placeBricks = memory_.allocate(occupied_ * 4, "the list of occupied bricks");
  gl::Buffer box = memory_.allocate(24, "the box");
  const std::array<int32_t, 6> nothing{INT_MAX, INT_MAX, INT_MAX, 0, 0, 0};
  write(box, std::span<const int32_t>(nothing));
  setInts(fillSceneBricks_, 0, size);
  glProgramUniform1i(fillSceneBricks_.id(), 1, brickEdge);
  bindStorage({&brickCounts_, &table_, &brickHeaders_, &placeBricks, &box});
  dispatch(fillSceneBricks_, uint64_t(size.x), uint64_t(size.y), uint64_t(size.z));
  glFinish();
  std::array<int32_t, 6> fitted{};
  read(box, std::span<int32_t>(fitted));
  bricks_ = brickGrid(brickEdge, {fitted[0], fitted[1], fitted[2]}, {fitted[3], fitted[4], fitted[5]});
  const uint64_t wordCount = (bricks_.bricks() + 31) / 32;
  brickWords_ = memory_.allocate(wordCount * sizeof(BrickWord), "the brick grid");
  setInts(fillBrickWords_, 0, size);
  setInts(fillBrickWords_, 1, bricks_.first);
  setInts(fillBrickWords_, 2, bricks_.count);
  glProgramUniform1ui(fillBrickWords_.id(), 3, GLuint(wordCount));
  bindStorage({&brickCounts_, &brickWords_});
  dispatchMany(fillBrickWords_, (wordCount + 63) / 64);

  // Fragments: triangles of one face and material in one voxel become one plane.
  fragments_ = memory_.allocate(fragmentCount_ * sizeof(SceneFragment), "the fragment buffer");
  gl::Buffer sums = memory_.allocate(fragmentCount_ * 32, "sums of triangles");
  gl::Buffer fragmentOfEntry = memory_.allocate(entryCount * 4, "entries' fragments");
  gl::Buffer directions = memory_.allocate(sizeof directionTable(), "directions");
  write(directions, std::span<const float>(directionTable()));
  fillWithZeros(sums);
  for (const gl::Program* program : {&mergeEntries_, &findReach_}) {
    setInts(*program, 1, space_.dims);
    glProgramUniform1i(program->id(), 2, brickEdge);
    glProgramUniform1i(program->id(), 3, mesh.normals.empty() ? 0 : 1);
  }
  bindStorage({&table_, &entries_, &starts, &inputs.triangles, &inputs.corners, &inputs.normals, &sums,
               &fragmentOfEntry, &placeBricks, &fragments_, &inputs.samples});
  dispatchMany(mergeEntries_, entryGroups);
  dispatchMany(findReach_, entryGroups);
  glFinish();
  glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 10, directions.id());
  glProgramUniform1ui(packFragments_.id(), 0, GLuint(fragmentCount_));
  dispatchMany(packFragments_, (fragmentCount_ + 63) / 64);

  voxels_ = memory_.allocate((voxelCount_ + 1) * 4, "the voxel buffer");
  glProgramUniform1ui(copyStarts_.id(), 0, GLuint(voxelCount_ + 1));
  bindStorage({&starts, &voxels_});
  dispatchMany(copyStarts_, (voxelCount_ + 1 + 63) / 64);
  glFinish();
  for (gl::Buffer* temporary : {&inputs.positions, &inputs.corners, &inputs.normals, &inputs.materialOfTriangle,
                                &inputs.triangles, &inputs.samples, &inputs.degenerate, &table_, &brickCounts_,
                                &entries_, &starts, &most, &placeBricks, &box, &sums, &fragmentOfEntry, &directions})
    memory_.release(*temporary);
  progress.end();
}

SceneBuffers GlScene::download() const {
  SceneBuffers buffers;
  buffers.grid = bricks_;
  buffers.brickWords.resize(size_t(bricks_.bricks() + 31) / 32);
  buffers.brickHeaders.resize(size_t(occupied_) * size_t(shared::headerWords(bricks_.edge)));
  buffers.voxels.resize(size_t(voxelCount_) + 1);
  buffers.fragments.resize(size_t(fragmentCount_));
  read(brickWords_, std::span(buffers.brickWords));
  read(brickHeaders_, std::span(buffers.brickHeaders));
  read(voxels_, std::span(buffers.voxels));
  read(fragments_, std::span(buffers.fragments));
  return buffers;
}

void GlScene::setVolumeLight(std::span<const uint32_t> light) {
  check(light.empty() || light.size() == fragmentCount_, "every fragment has light");
  glFinish();
  upload(volumeLight_, std::as_bytes(light), "light at the voxels");
  lit_ = !light.empty();
}

void GlScene::useBuffers(const gl::Program& program) const {
  setInts(program, 0, bricks_.low);
  setInts(program, 1, bricks_.high);
  setInts(program, 2, bricks_.first);
  setInts(program, 3, bricks_.count);
  glProgramUniform1i(program.id(), 4, bricks_.edge);
}

Image GlScene::trace(const SceneTracing& tracing, const Camera& camera, ImageRows rows, int steps, uint64_t& rays,
                     int& passes, Progress& progress) {
  check(steps >= 1 && steps <= kMostSteps, "steps are in their range");
  const uint64_t lampCount = tracing.lighting.lights.size();
  const bool shadowRays = tracing.shadows == Shadows::rays && lampCount > 0;

  // The ray buffer: a stack, and a quarter for the rays of a pass.
  const uint64_t newPerRay = 1 + (shadowRays ? lampCount : 0);
  const uint64_t reserve = uint64_t(tracing.maxDepth + 2) * newPerRay;
  const uint64_t records = std::min(rayBytes_ / sizeof(RayRecord), uint64_t(INT_MAX));
  const uint64_t largest = std::max(records / 4, uint64_t(1));
  const uint64_t capacity = records - std::min(records, largest);
  if (capacity < 2 * reserve + 2 * (newPerRay + 1)) {
    throw MachineError(fmt::format(
        "VoxLink: {} bytes of ray buffer are too few for {} lamps and {} reflections, which "
        "need {}; raise --ray-buffer",
        rayBytes_, lampCount, tracing.maxDepth, 4 * (2 * reserve + 2 * (newPerRay + 1)) * sizeof(RayRecord)));
  }
  const glm::ivec2 size(camera.imageSize.x, rows.count);
  rays = 0;
  passes = 0;
  if (rows.count == 0) return Image(size, 4);
  const uint64_t tiled = uint64_t((size.x + 7) / 8) * uint64_t((size.y + 7) / 8) * 64;
  const uint64_t pixels = uint64_t(size.x) * uint64_t(size.y);
  if (pixels > uint64_t(INT_MAX) / 4) throw InputError("VoxLink: the picture has more pixels than can be counted");

  glFinish();
  memory_.release(stack_);
  memory_.release(batch_);
  memory_.release(sums_);
  memory_.release(lamps_);
  memory_.release(control_);
  stack_ = memory_.allocate(capacity * sizeof(RayRecord), "the ray buffer");
  batch_ = memory_.allocate(largest * sizeof(RayRecord), "the ray buffer");
  sums_ = memory_.allocate(pixels * 16, "the picture");
  fillWithZeros(sums_);
  control_ = memory_.allocate(sizeof(RayControl), "the ray buffer");
  fillWithZeros(control_);
  std::vector<glm::vec4> lamps;
  for (const SceneLamp& lamp : sceneLamps(space_, tracing.lighting)) {
    lamps.emplace_back(lamp.place, lamp.directional ? 1.0f : 0.0f);
    lamps.emplace_back(lamp.linear, 0.0f);
  }
  lamps_ = memory_.allocate(lamps.size() * sizeof(glm::vec4), "the lamps");
  write(lamps_, std::span<const glm::vec4>(lamps));
  if (volumeLight_.id() == 0) volumeLight_ = memory_.allocate(0, "light at the voxels");

  const GLuint plan = planRays_.id();
  glProgramUniform1ui(plan, 0, GLuint(capacity));
  glProgramUniform1ui(plan, 1, GLuint(largest));
  glProgramUniform1ui(plan, 2, GLuint(newPerRay));
  glProgramUniform1ui(plan, 3, GLuint(reserve));
  glProgramUniform1ui(plan, 4, GLuint(tiled));
  useBuffers(traceScene_);
  const GLuint id = traceScene_.id();
  glm::dmat4 voxelsFromWorld = glm::dmat4(1.0 / space_.edge);
  voxelsFromWorld[3] = glm::dvec4(-glm::dvec3(space_.origin) / space_.edge, 1.0);
  const PixelRays pixelRays(camera, voxelsFromWorld, 0.5 * glm::dvec3(bricks_.low + bricks_.high), space_.edge);
  glProgramUniform2i(id, 5, size.x, size.y);
  glProgramUniform1i(id, 23, rows.first);
  pixelRays.set(traceScene_, 6, 9);
  glProgramUniform1i(id, 12, steps);
  glProgramUniform1i(id, 13, lit_ ? 1 : 0);
  glProgramUniform1i(id, 14, GLint(lampCount));
  glProgramUniform1i(id, 15, shadowRays ? 1 : 0);
  glProgramUniform1i(id, 16, tracing.maxDepth);
  glProgramUniform1f(id, 17, tracing.lighting.ambient);
  const Shading shading = tracing.lighting.shading;
  glProgramUniform1i(id, 18, shading == Shading::none ? 0 : shading == Shading::lambert ? 1 : 2);
  glProgramUniform1f(id, 19, kPhongHighlight);
  glProgramUniform1f(id, 20, kPhongExponent);
  glProgramUniform1f(id, 21, sumScale(tracing.lighting));
  glProgramUniform1f(id, 22, kEscapeScale);

  progress.begin("tracing", tiled, "pixels");
  uint64_t seen = 0;
  RayControl control{};
  glBindBuffer(GL_DISPATCH_INDIRECT_BUFFER, control_.id());
  const auto indirect = [&](const gl::Program& program, size_t offset) {
    glUseProgram(program.id());
    glMemoryBarrier(GL_COMMAND_BARRIER_BIT);
    glDispatchComputeIndirect(GLintptr(offset));
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT | GL_BUFFER_UPDATE_BARRIER_BIT);
  };
  constexpr int kPassesBetweenLooks = 4;
  do {
    for (int i = 0; i < kPassesBetweenLooks; ++i) {
      bindStorage({&control_, &stack_, &batch_});
      dispatch(planRays_, 1);
      indirect(takeRays_, offsetof(RayControl, copyGroups));
      bindStorage({&brickWords_, &brickHeaders_, &voxels_, &fragments_, &materials_, &spheres_, &volumeMaterials_,
                   &firstOfVolume_, &volumeLight_, &lamps_, &batch_, &stack_, &control_, &sums_});
      indirect(traceScene_, offsetof(RayControl, traceGroups));
    }
    glFinish();
    read(control_, std::span(&control, 1));
    progress.advance(control.nextPixel - seen);
    seen = control.nextPixel;
  } while (control.waiting > 0 || control.nextPixel < tiled);
  glBindBuffer(GL_DISPATCH_INDIRECT_BUFFER, 0);
  progress.end();
  rays = (uint64_t(control.raysHigh) << 32) + control.rays + control.born;
  passes = int(control.passes);
  std::vector<uint32_t> sums(size_t(pixels) * 4);
  read(sums_, std::span(sums));
  return picture(sums, tracing.lighting, size);
}

}  // namespace freevoxel
