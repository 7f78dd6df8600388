#include "splat/sum_targets.h"

#include <algorithm>
#include <array>
#include <vector>

#include "splat/sums.h"

namespace freevoxel {

SumTargets::SumTargets(glm::ivec2 size) : light_(GL_RGBA32F, size), depth_(GL_RG32F, size) {
  const std::array<const gl::Texture2D*, 2> attachments = {&light_, &depth_};
  framebuffer_ = gl::makeFramebuffer(attachments);
}

void SumTargets::clear() {
  const float zero[4] = {};
  glClearNamedFramebufferfv(framebuffer_.id(), GL_COLOR, 0, zero);
  glClearNamedFramebufferfv(framebuffer_.id(), GL_COLOR, 1, zero);
}

void SumTargets::bind() {
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer_.id());
  glViewport(0, 0, size().x, size().y);
  glDisable(GL_DEPTH_TEST);
  glEnable(GL_PROGRAM_POINT_SIZE);
  glEnable(GL_BLEND);
  glBlendEquation(GL_FUNC_ADD);
  glBlendFunc(GL_ONE, GL_ONE);
}

void SumTargets::release() {
  glBindVertexArray(0);
  glUseProgram(0);
  glBindFramebuffer(GL_FRAMEBUFFER, 0);
}

Image SumTargets::read() const {
  const size_t pixels = size_t(size().x) * size_t(size().y);
  std::vector<float> light(pixels * 4);
  std::vector<float> depth(pixels * 2);
  glGetTextureImage(light_.id(), 0, GL_RGBA, GL_FLOAT, GLsizei(light.size() * sizeof(float)), light.data());
  glGetTextureImage(depth_.id(), 0, GL_RG, GL_FLOAT, GLsizei(depth.size() * sizeof(float)), depth.data());
  Image image(size(), kSumChannels);
  for (size_t i = 0; i < pixels; ++i) {
    float* out = image.pixels.data() + i * kSumChannels;
    std::copy_n(light.data() + i * 4, 4, out);
    std::copy_n(depth.data() + i * 2, 2, out + 4);
  }
  return image;
}

}  // namespace freevoxel
