#include "gl/objects.h"

#include <atomic>
#include <vector>

#include "base/error.h"

namespace freevoxel::gl {

void deleteBuffer(GLuint id) {
  glDeleteBuffers(1, &id);
}
void deleteTexture(GLuint id) {
  glDeleteTextures(1, &id);
}
void deleteFramebuffer(GLuint id) {
  glDeleteFramebuffers(1, &id);
}
void deleteVertexArray(GLuint id) {
  glDeleteVertexArrays(1, &id);
}
void deleteProgram(GLuint id) {
  glDeleteProgram(id);
}

namespace {

std::atomic<uint64_t> live{0}, peak{0};

uint64_t bytesPerTexel(GLenum format) {
  switch (format) {
    case GL_RGBA32F:
      return 16;
    case GL_RG32F:
      return 8;
    case GL_R32F:
      return 4;
    default:
      throw InternalError("internal error: a texture format of unknown size");
  }
}

template <class Create>
GLuint created(Create create) {
  GLuint id = 0;
  create(&id);
  return id;
}

}  // namespace

uint64_t liveBytes() {
  return live;
}
uint64_t peakBytes() {
  return peak;
}
void resetPeakBytes() {
  peak = live.load();
}

CountedBytes::CountedBytes(uint64_t bytes) : bytes_(bytes) {
  const uint64_t now = live += bytes;
  for (uint64_t before = peak; before < now && !peak.compare_exchange_weak(before, now);) {
  }
}
CountedBytes::~CountedBytes() {
  live -= bytes_;
}

Buffer::Buffer(size_t bytes) : Object(created([](GLuint* id) { glCreateBuffers(1, id); })), bytes_(bytes) {
  glNamedBufferData(id(), GLsizeiptr(bytes), nullptr, GL_STREAM_DRAW);
}

void Buffer::replace(std::span<const std::byte> data) {
  check(data.size() <= bytes(), "data fits the buffer");
  glInvalidateBufferData(id());
  glNamedBufferSubData(id(), 0, GLsizeiptr(data.size()), data.data());
}

void Buffer::write(size_t offset, std::span<const std::byte> data) {
  check(offset <= bytes() && data.size() <= bytes() - offset, "data fits the buffer");
  glNamedBufferSubData(id(), GLintptr(offset), GLsizeiptr(data.size()), data.data());
}

Fence::~Fence() {
  if (sync_ != nullptr) glDeleteSync(sync_);
}

Fence Fence::here() {
  Fence fence;
  fence.sync_ = glFenceSync(GL_SYNC_GPU_COMMANDS_COMPLETE, 0);
  return fence;
}

void Fence::wait() {
  if (sync_ == nullptr) return;
  constexpr GLuint64 kSecond = 1000000000;
  while (glClientWaitSync(sync_, GL_SYNC_FLUSH_COMMANDS_BIT, kSecond) == GL_TIMEOUT_EXPIRED) {
  }
  *this = Fence();
}

Texture2D::Texture2D(GLenum format, glm::ivec2 size)
    : Object(created([](GLuint* id) { glCreateTextures(GL_TEXTURE_2D, 1, id); })), size_(size) {
  GLint limit = 0;
  glGetIntegerv(GL_MAX_TEXTURE_SIZE, &limit);
  if (size.x > limit || size.y > limit) {
    throw MachineError(fmt::format("OpenGL: an image of {}x{} exceeds this driver's limit of {}x{}; use --backend cpu",
                                   size.x, size.y, limit, limit));
  }
  bytes_ = CountedBytes(bytesPerTexel(format) * uint64_t(size.x) * uint64_t(size.y));
  glTextureStorage2D(id(), 1, format, size.x, size.y);
  glTextureParameteri(id(), GL_TEXTURE_MIN_FILTER, GL_NEAREST);
  glTextureParameteri(id(), GL_TEXTURE_MAG_FILTER, GL_NEAREST);
  const float zero[4] = {};
  glClearTexImage(id(), 0, GL_RGBA, GL_FLOAT, zero);
}

Framebuffer makeFramebuffer(std::span<const Texture2D* const> colourAttachments) {
  Framebuffer framebuffer(created([](GLuint* id) { glCreateFramebuffers(1, id); }));
  std::vector<GLenum> drawBuffers;
  for (size_t i = 0; i < colourAttachments.size(); ++i) {
    const GLenum attachment = GL_COLOR_ATTACHMENT0 + GLenum(i);
    glNamedFramebufferTexture(framebuffer.id(), attachment, colourAttachments[i]->id(), 0);
    drawBuffers.push_back(attachment);
  }
  glNamedFramebufferDrawBuffers(framebuffer.id(), GLsizei(drawBuffers.size()), drawBuffers.data());
  const GLenum status = glCheckNamedFramebufferStatus(framebuffer.id(), GL_DRAW_FRAMEBUFFER);
  if (status != GL_FRAMEBUFFER_COMPLETE) {
    throw MachineError(
        fmt::format("OpenGL: the driver refuses this framebuffer (status 0x{:x}); use --backend cpu", status));
  }
  return framebuffer;
}

VertexArray makeVertexArray() {
  return VertexArray(created([](GLuint* id) { glCreateVertexArrays(1, id); }));
}

}  // namespace freevoxel::gl
