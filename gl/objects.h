// OpenGL objects as move-only values with direct state access. Id 0 is empty. A Context must be current.
#pragma once

#include <epoxy/gl.h>

#include <cstddef>
#include <cstdint>
#include <glm/vec2.hpp>
#include <span>
#include <utility>

namespace freevoxel::gl {

/// Owns one object name; `Delete` frees it.
template <void (*Delete)(GLuint)>
class Object {
 public:
  Object() = default;
  explicit Object(GLuint id) : id_(id) {}
  ~Object() {
    if (id_ != 0) Delete(id_);
  }
  Object(Object&& other) noexcept : id_(std::exchange(other.id_, 0)) {}
  Object& operator=(Object&& other) noexcept {
    std::swap(id_, other.id_);
    return *this;
  }
  GLuint id() const { return id_; }

 private:
  GLuint id_ = 0;
};

void deleteBuffer(GLuint id);
void deleteTexture(GLuint id);
void deleteFramebuffer(GLuint id);
void deleteVertexArray(GLuint id);
void deleteProgram(GLuint id);

using Framebuffer = Object<deleteFramebuffer>;
using VertexArray = Object<deleteVertexArray>;
using Program = Object<deleteProgram>;

/// Bytes of all buffers and textures that are alive, and the most that were at once since resetPeakBytes().
uint64_t liveBytes();
uint64_t peakBytes();
void resetPeakBytes();

/// So many bytes that are alive.
class CountedBytes {
 public:
  CountedBytes() = default;
  explicit CountedBytes(uint64_t bytes);
  ~CountedBytes();
  CountedBytes(CountedBytes&& other) noexcept : bytes_(std::exchange(other.bytes_, 0)) {}
  CountedBytes& operator=(CountedBytes&& other) noexcept {
    std::swap(bytes_, other.bytes_);
    return *this;
  }
  uint64_t value() const { return bytes_; }

 private:
  uint64_t bytes_ = 0;
};

/// A buffer of fixed size, for data that the CPU writes again and again.
class Buffer : public Object<deleteBuffer> {
 public:
  Buffer() = default;
  explicit Buffer(size_t bytes);
  size_t bytes() const { return size_t(bytes_.value()); }
  /// Replaces the first data.size() bytes; what is being drawn from the old contents still sees them.
  void replace(std::span<const std::byte> data);
  /// Writes bytes from `offset` on. Nothing that is being drawn may read them.
  void write(size_t offset, std::span<const std::byte> data);

 private:
  CountedBytes bytes_;
};

/// A two-dimensional texture without mipmaps, all zero.
class Texture2D : public Object<deleteTexture> {
 public:
  Texture2D() = default;
  /// `format` sized, e.g. GL_RGBA32F. Throws MachineError if the size exceeds what the driver can do.
  Texture2D(GLenum format, glm::ivec2 size);
  glm::ivec2 size() const { return size_; }

 private:
  glm::ivec2 size_{0};
  CountedBytes bytes_;
};

/// Tells when the commands before it are done. Move-only.
class Fence {
 public:
  Fence() = default;
  ~Fence();
  Fence(Fence&& other) noexcept : sync_(std::exchange(other.sync_, nullptr)) {}
  Fence& operator=(Fence&& other) noexcept {
    std::swap(sync_, other.sync_);
    return *this;
  }
  /// After all commands so far.
  static Fence here();
  /// Returns when they are done; at once if this is empty.
  void wait();

 private:
  GLsync sync_ = nullptr;
};

Framebuffer makeFramebuffer(std::span<const Texture2D* const> colourAttachments);
VertexArray makeVertexArray();

}  // namespace freevoxel::gl
