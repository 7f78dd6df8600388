// The text of the files in shaders/, embedded in the program.
#pragma once

#include <string_view>

namespace freevoxel {

/// Text of a shader file by its path from the project's top ("shaders/draw_splats.frag"); empty if there is none.
std::string_view embeddedShader(std::string_view path);

}  // namespace freevoxel
