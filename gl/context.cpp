#include "gl/context.h"

#include <dlfcn.h>
#include <epoxy/egl.h>
#include <epoxy/gl.h>

#include <cstring>
#include <mutex>
#include <utility>

#include "base/error.h"

namespace freevoxel::gl {

namespace {

constexpr const char* kAdvice =
    "install a driver (on Debian: apt-get install libegl-mesa0 libgl1-mesa-dri) or use --backend cpu";

bool haveLibrary(const char* name) {
  void* handle = dlopen(name, RTLD_LAZY | RTLD_LOCAL);
  if (handle != nullptr) dlclose(handle);
  return handle != nullptr;
}

/// libepoxy ends the program where a library is missing: look before it does.
void requireLibraries() {
  if (!haveLibrary("libEGL.so.1")) throw MachineError(fmt::format("OpenGL: libEGL.so.1 is missing; {}", kAdvice));
  if (!haveLibrary("libOpenGL.so.0") && !haveLibrary("libGL.so.1")) {
    throw MachineError(fmt::format("OpenGL: neither libOpenGL.so.0 nor libGL.so.1 is there; {}", kAdvice));
  }
}

struct Candidate {
  std::string name;
  EGLDisplay display;
};

/// Displays that need no window system: GPUs first, then Mesa's surfaceless platform, then software devices.
std::vector<Candidate> candidates() {
  std::vector<Candidate> gpus, software;
  std::vector<Candidate> result;
  const char* extensions = eglQueryString(EGL_NO_DISPLAY, EGL_EXTENSIONS);
  const auto has = [&](const char* name) { return extensions != nullptr && std::strstr(extensions, name) != nullptr; };
  if (has("EGL_EXT_device_enumeration") && has("EGL_EXT_platform_device")) {
    EGLDeviceEXT devices[32];
    EGLint count = 0;
    if (eglQueryDevicesEXT(32, devices, &count)) {
      for (int i = 0; i < count; ++i) {
        const char* features = eglQueryDeviceStringEXT(devices[i], EGL_EXTENSIONS);
        const bool isSoftware = features != nullptr && std::strstr(features, "EGL_MESA_device_software") != nullptr;
        const EGLDisplay display = eglGetPlatformDisplayEXT(EGL_PLATFORM_DEVICE_EXT, devices[i], nullptr);
        if (display != EGL_NO_DISPLAY) {
          (isSoftware ? software : gpus).push_back({fmt::format("EGL device {}", i), display});
        }
      }
    }
  }
  result = gpus;
  if (has("EGL_MESA_platform_surfaceless")) {
    const EGLDisplay display = eglGetPlatformDisplayEXT(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr);
    if (display != EGL_NO_DISPLAY) result.push_back({"surfaceless platform", display});
  }
  result.insert(result.end(), software.begin(), software.end());
  return result;
}

/// A current 4.5 core context on `display`, or why not.
std::string makeCurrent(EGLDisplay display, EGLContext& context) {
  EGLint major = 0, minor = 0;
  if (!eglInitialize(display, &major, &minor)) return "does not initialise";
  if (!eglBindAPI(EGL_OPENGL_API)) return "has no desktop OpenGL";
  const EGLint configAttributes[] = {EGL_SURFACE_TYPE, EGL_PBUFFER_BIT, EGL_RENDERABLE_TYPE, EGL_OPENGL_BIT, EGL_NONE};
  EGLConfig config = nullptr;
  EGLint configCount = 0;
  if (!eglChooseConfig(display, configAttributes, &config, 1, &configCount) || configCount < 1) config = nullptr;
  const EGLint contextAttributes[] = {EGL_CONTEXT_MAJOR_VERSION,
                                      4,
                                      EGL_CONTEXT_MINOR_VERSION,
                                      5,
                                      EGL_CONTEXT_OPENGL_PROFILE_MASK,
                                      EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT,
                                      EGL_CONTEXT_OPENGL_DEBUG,
                                      EGL_TRUE,
                                      EGL_NONE};
  context = eglCreateContext(display, config, EGL_NO_CONTEXT, contextAttributes);
  if (context == EGL_NO_CONTEXT) return "has no OpenGL 4.5 core profile";
  if (!eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, context)) {
    eglDestroyContext(display, context);
    context = EGL_NO_CONTEXT;
    return "has no surfaceless contexts";
  }
  return {};
}

struct ErrorSink {
  std::mutex mutex;
  std::vector<std::string> errors;
};

void APIENTRY onDebugMessage(GLenum source, GLenum type, GLuint, GLenum severity, GLsizei length, const GLchar* text,
                             const void* user) {
  // Shader compilers' messages come with the compile log; performance hints are no errors.
  if (source == GL_DEBUG_SOURCE_SHADER_COMPILER) return;
  if (type != GL_DEBUG_TYPE_ERROR && type != GL_DEBUG_TYPE_UNDEFINED_BEHAVIOR) return;
  if (severity == GL_DEBUG_SEVERITY_NOTIFICATION) return;
  auto* sink = static_cast<ErrorSink*>(const_cast<void*>(user));
  const std::lock_guard lock(sink->mutex);
  if (sink->errors.size() < 100) {
    sink->errors.push_back(length > 0 ? std::string(text, size_t(length)) : std::string(text));
  }
}

}  // namespace

struct Context::State {
  EGLDisplay display = EGL_NO_DISPLAY;
  EGLContext context = EGL_NO_CONTEXT;
  ErrorSink sink;
};

Context::Context() : state_(std::make_unique<State>()) {
  requireLibraries();
  std::string tried;
  for (const Candidate& candidate : candidates()) {
    const std::string problem = makeCurrent(candidate.display, state_->context);
    if (problem.empty()) {
      state_->display = candidate.display;
      break;
    }
    tried += fmt::format("{}{} {}", tried.empty() ? "" : ", ", candidate.name, problem);
  }
  if (state_->context == EGL_NO_CONTEXT) {
    throw MachineError(fmt::format("OpenGL 4.5 is not to be had through EGL ({}); {}",
                                   tried.empty() ? "no display without a window" : tried, kAdvice));
  }
  const auto text = [](GLenum name) {
    const GLubyte* value = glGetString(name);
    return std::string(value != nullptr ? reinterpret_cast<const char*>(value) : "unknown");
  };
  renderer_ = text(GL_RENDERER) + ", " + text(GL_VERSION);
  for (const char* name : {"llvmpipe", "softpipe", "SWR", "swrast"}) {
    software_ = software_ || renderer_.find(name) != std::string::npos;
  }
  glEnable(GL_DEBUG_OUTPUT);
  glEnable(GL_DEBUG_OUTPUT_SYNCHRONOUS);
  glDebugMessageCallback(&onDebugMessage, &state_->sink);
}

Context::~Context() {
  eglMakeCurrent(state_->display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
  eglDestroyContext(state_->display, state_->context);
  // The display stays initialised: another context may live on it, and EGL frees it at exit.
}

std::vector<std::string> Context::takeErrors() {
  glFinish();
  const std::lock_guard lock(state_->sink.mutex);
  return std::exchange(state_->sink.errors, {});
}

}  // namespace freevoxel::gl
