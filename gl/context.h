// An OpenGL 4.5 core context without a window.
#pragma once

#include <memory>
#include <string>
#include <vector>

namespace freevoxel::gl {

/// A headless context, made through EGL and current on the thread that made it for as long as it lives. Prefers a GPU;
/// falls back to a software renderer. One at a time per thread.
class Context {
 public:
  /// Throws MachineError that says what EGL offered and what to install or try.
  Context();
  ~Context();
  Context(const Context&) = delete;
  Context& operator=(const Context&) = delete;

  const std::string& renderer() const { return renderer_; }  ///< GL_RENDERER and GL_VERSION
  /// Whether the renderer runs on the CPU (llvmpipe, softpipe, SWR).
  bool isSoftware() const { return software_; }

  /// Errors and undefined-behaviour warnings that the driver reported since the last call; none in correct code. Tests
  /// fail on any.
  std::vector<std::string> takeErrors();

 private:
  struct State;
  std::unique_ptr<State> state_;
  std::string renderer_;
  bool software_ = false;
};

}  // namespace freevoxel::gl
