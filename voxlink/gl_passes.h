// What passes over GPU buffers have in common.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <glm/gtc/type_ptr.hpp>
#include <initializer_list>
#include <span>

#include "base/camera.h"
#include "gl/objects.h"

namespace freevoxel {

/// Groups along one axis that every driver takes.
inline constexpr uint64_t kMostGroups = 65535;

inline void bindStorage(std::initializer_list<const gl::Buffer*> buffers) {
  GLuint binding = 0;
  for (const gl::Buffer* buffer : buffers)
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, binding++, buffer->id());
}

/// Runs a program over groups; what it wrote is there for later passes and for reading.
inline void dispatch(const gl::Program& program, uint64_t x, uint64_t y = 1, uint64_t z = 1) {
  glUseProgram(program.id());
  glDispatchCompute(GLuint(x), GLuint(y), GLuint(z));
  glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT | GL_BUFFER_UPDATE_BARRIER_BIT);
}

/// A number of groups as a rectangle of groups; programs skip what is too many.
inline void dispatchMany(const gl::Program& program, uint64_t groups) {
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

inline void fillWithZeros(const gl::Buffer& buffer) {
  const uint32_t zero = 0;
  glClearNamedBufferData(buffer.id(), GL_R32UI, GL_RED_INTEGER, GL_UNSIGNED_INT, &zero);
}

inline void setInts(const gl::Program& program, GLint location, glm::ivec3 value) {
  glProgramUniform3i(program.id(), location, value.x, value.y, value.z);
}

inline void setMatrix(const gl::Program& program, GLint location, const glm::dmat3& value) {
  const glm::mat3 single(value);
  glProgramUniformMatrix3fv(program.id(), location, 1, GL_FALSE, glm::value_ptr(single));
}

/// The rays of an image's pixels, as trace_rays.comp takes them: told by where they pass a plane through a place, from
/// where float positions are exact enough however far away the eye is.
struct PixelRays {
  /// `middle`: the place, in voxels; `unit`: of ways, in world lengths.
  PixelRays(const Camera& camera, const glm::dmat4& voxelsFromWorld, glm::dvec3 middle, double unit) {
    const ViewFrame frame = viewFrame(camera);
    const glm::dvec3 world(glm::inverse(voxelsFromWorld) * glm::dvec4(middle, 1.0));
    const glm::dvec3 forward = glm::transpose(frame.viewFromWorld) * glm::dvec3(0.0, 0.0, -1.0);
    const double distance = std::max(glm::dot(world - camera.eye, forward), unit);
    const auto wayOf = [&](glm::dvec2 pixel) {
      const Ray ray = pixelRay(frame, pixel);
      return frame.orthographic ? forward * distance : ray.direction * (distance / glm::dot(ray.direction, forward));
    };
    const auto placeOf = [&](glm::dvec2 pixel) {
      return glm::dvec3(voxelsFromWorld * glm::dvec4(pixelRay(frame, pixel).origin + wayOf(pixel), 1.0));
    };
    const glm::dvec2 pixels[3] = {{0.0, 0.0}, {1.0, 0.0}, {0.0, 1.0}};
    for (int i = 0; i < 3; ++i) {
      const glm::dvec3 before = i == 0 ? glm::dvec3(0.0) : placeOf(pixels[0]);
      const glm::dvec3 wayBefore = i == 0 ? glm::dvec3(0.0) : wayOf(pixels[0]);
      place[i] = glm::vec3(placeOf(pixels[i]) - before);
      way[i] = glm::vec3((wayOf(pixels[i]) - wayBefore) / unit);
    }
  }
  void set(const gl::Program& program, GLint placeLocation, GLint wayLocation) const {
    glProgramUniform3fv(program.id(), placeLocation, 3, glm::value_ptr(place[0]));
    glProgramUniform3fv(program.id(), wayLocation, 3, glm::value_ptr(way[0]));
  }

  glm::vec3 place[3], way[3];  ///< of pixel (0,0), per pixel right, per pixel down
};

}  // namespace freevoxel
