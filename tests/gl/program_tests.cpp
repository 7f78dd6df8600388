#include "gl/program.h"

#include <gtest/gtest.h>

#include "base/error.h"
#include "gl/context.h"

namespace freevoxel::gl {
namespace {

TEST(ShaderSource, IncludesEachFileOnce) {
  const std::string source = shaderSource("shaders/accumulate_kernels.frag");
  EXPECT_TRUE(source.starts_with("#version 450 core\n"));
  EXPECT_EQ(source.find("#include \""), std::string::npos);
  const size_t first = source.find("roundToWhole(float x)");
  ASSERT_NE(first, std::string::npos);
  EXPECT_EQ(source.find("roundToWhole(float x)", first + 1), std::string::npos);
}

TEST(ShaderSource, MissingFileIsOurBug) {
  EXPECT_THROW(shaderSource("shaders/none.vert"), InternalError);
}

TEST(Program, EveryShaderCompilesAndLinks) {
  Context context;
  EXPECT_NE(makeProgram({"shaders/draw_kernel_points.vert", "shaders/accumulate_kernels.frag"}).id(), 0u);
  EXPECT_NE(makeProgram({"shaders/draw_kernel_quads.vert", "shaders/accumulate_kernels.frag"}).id(), 0u);
  EXPECT_TRUE(context.takeErrors().empty());
}

}  // namespace
}  // namespace freevoxel::gl
