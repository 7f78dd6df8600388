// Programs from the embedded shaders.
#pragma once

#include <initializer_list>
#include <string>
#include <string_view>

#include "gl/objects.h"

namespace freevoxel::gl {

/// The text of an embedded shader with its `#include "shaders/..."` lines replaced, each file once, as "#version 450
/// core" and `#line` marks want it. Throws InternalError if a file is missing.
std::string shaderSource(std::string_view path);

/// Compiles and links embedded shaders; the stage follows from the extension (.vert .frag .comp).
/// Throws MachineError with the driver's log if it refuses them.
Program makeProgram(std::initializer_list<std::string_view> paths);

}  // namespace freevoxel::gl
