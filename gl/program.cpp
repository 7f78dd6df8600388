#include "gl/program.h"

#include <set>
#include <vector>

#include "base/error.h"
#include "shaders/embedded_shaders.h"

namespace freevoxel::gl {

namespace {

void deleteShader(GLuint id) {
  glDeleteShader(id);
}
using Shader = Object<deleteShader>;

void appendSource(std::string_view path, std::set<std::string>& seen, std::vector<std::string>& names,
                  std::string& out) {
  if (!seen.insert(std::string(path)).second) return;
  const std::string_view text = embeddedShader(path);
  if (text.empty()) throw InternalError(fmt::format("internal error: no embedded shader {}", path));
  const size_t number = names.size();
  names.emplace_back(path);
  out += fmt::format("#line 1 {}\n", number);
  int line = 0;
  for (size_t start = 0; start < text.size();) {
    const size_t end = std::min(text.find('\n', start), text.size());
    const std::string_view current = text.substr(start, end - start);
    start = end + 1;
    ++line;
    constexpr std::string_view kInclude = "#include \"";
    if (current.starts_with(kInclude)) {
      const std::string_view rest = current.substr(kInclude.size());
      appendSource(rest.substr(0, rest.find('"')), seen, names, out);
      out += fmt::format("#line {} {}\n", line + 1, number);
    } else {
      out += current;
      out += '\n';
    }
  }
}

GLenum stage(std::string_view path) {
  if (path.ends_with(".vert")) return GL_VERTEX_SHADER;
  if (path.ends_with(".frag")) return GL_FRAGMENT_SHADER;
  if (path.ends_with(".comp")) return GL_COMPUTE_SHADER;
  throw InternalError(fmt::format("internal error: {} is no shader stage", path));
}

Shader compile(std::string_view path) {
  const std::string source = shaderSource(path);
  Shader shader(glCreateShader(stage(path)));
  const char* text = source.c_str();
  glShaderSource(shader.id(), 1, &text, nullptr);
  glCompileShader(shader.id());
  GLint compiled = 0;
  glGetShaderiv(shader.id(), GL_COMPILE_STATUS, &compiled);
  if (compiled == 0) {
    char log[2048] = {};
    glGetShaderInfoLog(shader.id(), sizeof log, nullptr, log);
    throw MachineError(fmt::format("OpenGL: the driver does not compile {}: {}", path, log));
  }
  return shader;
}

}  // namespace

std::string shaderSource(std::string_view path) {
  std::set<std::string> seen;
  std::vector<std::string> names;
  std::string out = "#version 450 core\n";
  appendSource(path, seen, names, out);
  return out;
}

Program makeProgram(std::initializer_list<std::string_view> paths) {
  Program program(glCreateProgram());
  std::vector<Shader> shaders;
  for (const std::string_view path : paths) {
    shaders.push_back(compile(path));
    glAttachShader(program.id(), shaders.back().id());
  }
  glLinkProgram(program.id());
  for (const Shader& shader : shaders)
    glDetachShader(program.id(), shader.id());
  GLint linked = 0;
  glGetProgramiv(program.id(), GL_LINK_STATUS, &linked);
  if (linked == 0) {
    char log[2048] = {};
    glGetProgramInfoLog(program.id(), sizeof log, nullptr, log);
    throw MachineError(fmt::format("OpenGL: the driver does not link {}: {}", *paths.begin(), log));
  }
  return program;
}

}  // namespace freevoxel::gl
