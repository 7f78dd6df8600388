// Lets one file be GLSL 4.50 and C++20. Included first by every file in shaders/shared/.
//
// EXACT before a variable: its value is rounded once per operation and never fused, in both languages. GLSL guarantees
// correctly rounded + - * only, so shared code that must give the same bits uses these, integers and bit casts alone.
#ifndef FREEVOXEL_SHADERS_SHARED_LANGUAGE_H
#define FREEVOXEL_SHADERS_SHARED_LANGUAGE_H

#ifdef __cplusplus

#include <bit>
#include <cstdint>

#define FREEVOXEL_BEGIN_SHARED namespace freevoxel::shared {
#define FREEVOXEL_END_SHARED }
#define EXACT
#define SHARED_FUNCTION inline
#define SHARED_CONSTANT inline constexpr
#define SHARED_OUT(type) type&
#define SHARED_INOUT(type) type&

namespace freevoxel::shared {
using uint = uint32_t;
inline uint floatBitsToUint(float x) {
  return std::bit_cast<uint>(x);
}
inline float uintBitsToFloat(uint x) {
  return std::bit_cast<float>(x);
}
inline float max(float a, float b) {
  return a > b ? a : b;
}
inline float min(float a, float b) {
  return a < b ? a : b;
}
}  // namespace freevoxel::shared

#else

#define FREEVOXEL_BEGIN_SHARED
#define FREEVOXEL_END_SHARED
#define EXACT precise
#define SHARED_FUNCTION
#define SHARED_CONSTANT const
#define SHARED_OUT(type) out type
#define SHARED_INOUT(type) inout type

#endif

#endif
