// From the words of a command line to values.
#pragma once

#include <cstdint>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <stdexcept>
#include <string>
#include <string_view>

namespace freevoxel {

/// The program was called in a way that makes no sense: one line, exit status 2.
struct UsageError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

// All of these read the whole text or throw a UsageError that says what was expected and what was found.

/// A finite number.
double parseNumber(std::string_view text);
/// A whole number from `low` to `high`.
int64_t parseWhole(std::string_view text, int64_t low, int64_t high);
uint64_t parseSeed(std::string_view text);
/// "X,Y,Z".
glm::dvec3 parseTriple(std::string_view text);
/// "X,Y,Z", each a finite number above 0.
glm::dvec3 parseSpacing(std::string_view text);
/// "X,Y,Z", each from 1 to kMaxDim.
glm::ivec3 parseDims(std::string_view text);
/// "WIDTHxHEIGHT" in pixels, each from 1 to 32768.
glm::ivec2 parseImageSize(std::string_view text);
/// A number of bytes: a whole number, or one with K, M or G behind it (powers of 1024).
uint64_t parseBytes(std::string_view text);
/// sRGB 0..1 from "#rrggbb", "r,g,b" or one of colourNames().
glm::vec3 parseColour(std::string_view text);
/// "black, white, ..."
std::string colourNames();

}  // namespace freevoxel
