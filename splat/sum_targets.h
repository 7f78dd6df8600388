// The float framebuffer into which splats are blended.
#pragma once

#include "base/image.h"
#include "gl/objects.h"

namespace freevoxel {

/// Two attachments, S_rgb and S_o, and the two depth sums, cleared by clear() and added to by drawing between bind()
/// and release(). A context must be current.
class SumTargets {
 public:
  explicit SumTargets(glm::ivec2 size);
  void clear();
  void bind();
  static void release();
  /// kSumChannels channels as they stand in the framebuffer.
  Image read() const;
  glm::ivec2 size() const { return light_.size(); }

 private:
  gl::Texture2D light_;
  gl::Texture2D depth_;
  gl::Framebuffer framebuffer_;
};

}  // namespace freevoxel
