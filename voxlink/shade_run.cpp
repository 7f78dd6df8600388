#include "voxlink/shade_run.h"

#include <array>
#include <cmath>
#include <cstring>

#include "shaders/shared/voxlink.h"

// Highway compiles this file once for every instruction set and chooses when the program runs.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "voxlink/shade_run.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#ifndef FREEVOXEL_VOXLINK_SHADE_RUN
#define FREEVOXEL_VOXLINK_SHADE_RUN
namespace freevoxel {

/// What shared::unpackNormal finds for each of its angles.
struct NormalAngles {
  std::array<float, 128> polarSine, polarCosine, azimuthSine, azimuthCosine;
};

}  // namespace freevoxel
#endif

HWY_BEFORE_NAMESPACE();
namespace freevoxel {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using Floats = hn::CappedTag<float, VoxelRun::kSlack>;
using Words = hn::RebindToUnsigned<Floats>;
using Ints = hn::RebindToSigned<Floats>;
using F = hn::Vec<Floats>;

struct Vec3 {
  F x, y, z;
};

HWY_INLINE F dot(const Vec3& a, const Vec3& b) {
  return hn::Add(hn::Add(hn::Mul(a.x, b.x), hn::Mul(a.y, b.y)), hn::Mul(a.z, b.z));
}
HWY_INLINE F constant(float value) {
  return hn::Set(Floats(), value);
}
HWY_INLINE Vec3 constant(glm::vec3 value) {
  return {constant(value.x), constant(value.y), constant(value.z)};
}

/// Unit vectors from places to a beacon; `apart`: not of those that are at it.
HWY_INLINE Vec3 towards(const Beacon& beacon, const Vec3& place, F& apart) {
  if (beacon.directional) {
    apart = constant(1.0f);
    return constant(beacon.place);
  }
  const Vec3 to = constant(beacon.place);
  const Vec3 way = {hn::Sub(to.x, place.x), hn::Sub(to.y, place.y), hn::Sub(to.z, place.z)};
  const F distance = hn::Sqrt(dot(way, way));
  apart = hn::IfThenElseZero(hn::Gt(distance, hn::Zero(Floats())), constant(1.0f));
  const F scale = hn::Div(constant(1.0f), hn::Max(distance, constant(1e-30f)));
  return {hn::Mul(way.x, scale), hn::Mul(way.y, scale), hn::Mul(way.z, scale)};
}

/// shared::packLight.
HWY_INLINE void pack(F red, F green, F blue, uint32_t* out) {
  const Words words;
  const Ints ints;
  const F most = hn::Min(hn::Max(hn::Max(red, green), blue), constant(32768.0f));
  const auto bits = hn::BitCast(words, hn::Mul(most, constant(1.00098f)));
  const auto exponent =
      hn::Max(hn::Sub(hn::BitCast(ints, hn::ShiftRight<23>(bits)), hn::Set(ints, 126)), hn::Set(ints, -15));
  const F scale = hn::BitCast(Floats(), hn::ShiftLeft<23>(hn::Sub(hn::Set(ints, 127 + 9), exponent)));
  const auto nineBits = [&](F value) HWY_ATTR {
    const F steps = hn::Add(hn::Mul(hn::Max(value, hn::Zero(Floats())), scale), constant(0.5f));
    return hn::ConvertTo(ints, hn::Min(steps, constant(511.0f)));
  };
  auto packed = hn::Or(nineBits(red), hn::ShiftLeft<9>(nineBits(green)));
  packed = hn::Or(packed, hn::ShiftLeft<18>(nineBits(blue)));
  packed = hn::Or(packed, hn::ShiftLeft<27>(hn::Add(exponent, hn::Set(ints, 15))));
  const auto visible = hn::RebindMask(ints, hn::Gt(most, constant(0.0000305f)));
  hn::StoreU(hn::BitCast(words, hn::IfThenElseZero(visible, packed)), words, out);
}

void shadeVoxels(const ShadingFrame& frame, const NormalAngles& angles, size_t first, VoxelRun& run) {
  const Floats floats;
  const Words words;
  const Ints ints;
  const size_t lanes = hn::Lanes(floats);
  const glm::mat3& m = frame.lengthFromIndex;
  for (size_t i = 0; i < run.count; i += lanes) {
    const F vx = hn::LoadU(floats, run.x + i), vy = hn::LoadU(floats, run.y + i), vz = hn::LoadU(floats, run.z + i);
    const auto along = [&](int axis) HWY_ATTR {
      return hn::Add(hn::Add(hn::Mul(constant(m[0][axis]), vx), hn::Mul(constant(m[1][axis]), vy)),
                     hn::Mul(constant(m[2][axis]), vz));
    };
    const Vec3 place = {along(0), along(1), along(2)};
    // shared::unpackNormal
    const auto packed = hn::ShiftRight<16>(hn::LoadU(words, run.fragments + i));
    const auto polar = hn::BitCast(ints, hn::And(packed, hn::Set(words, 127u)));
    const auto azimuth = hn::BitCast(ints, hn::And(hn::ShiftRight<7>(packed), hn::Set(words, 127u)));
    const F sine = hn::GatherIndex(floats, angles.polarSine.data(), polar);
    Vec3 normal = {hn::Mul(sine, hn::GatherIndex(floats, angles.azimuthCosine.data(), azimuth)),
                   hn::Mul(sine, hn::GatherIndex(floats, angles.azimuthSine.data(), azimuth)),
                   hn::GatherIndex(floats, angles.polarCosine.data(), polar)};
    F surface = hn::Mul(hn::ConvertTo(floats, hn::BitCast(ints, hn::ShiftRight<14>(packed))), constant(1.0f / 3.0f));
    F apart;
    const Vec3 eye = towards(frame.eye, place, apart);
    surface = frame.shading == Shading::none ? hn::Zero(floats) : hn::Mul(surface, apart);
    // The side that faces the eye, as shadeSurface has it.
    const F side = hn::IfThenElse(hn::Lt(dot(normal, eye), hn::Zero(floats)), constant(-1.0f), constant(1.0f));
    normal = {hn::Mul(normal.x, side), hn::Mul(normal.y, side), hn::Mul(normal.z, side)};
    const F facing = dot(normal, eye);

    F red = constant(frame.ambient), green = red, blue = red;
    for (const ShadingLamp& lamp : frame.lamps) {
      uint8_t codes[VoxelRun::kSlack] = {};
      std::memcpy(codes, lamp.shares + first + i, lanes < run.count - i ? lanes : run.count - i);
      const auto code = hn::PromoteTo(ints, hn::Load(hn::Rebind<uint8_t, Ints>(), codes));
      F share = hn::Mul(hn::ConvertTo(floats, code), constant(1.0f / 255.0f));
      const Vec3 light = towards(lamp, place, apart);
      const F cosine = hn::Max(hn::Zero(floats), dot(normal, light));
      F shaded = cosine;
      if (frame.shading == Shading::phong) {
        const F mirrored = hn::Sub(hn::Mul(hn::Mul(constant(2.0f), cosine), facing), dot(light, eye));
        const F near = hn::IfThenElseZero(hn::Gt(cosine, hn::Zero(floats)), hn::Max(hn::Zero(floats), mirrored));
        static_assert(kPhongExponent == 24.0f);
        const F near2 = hn::Mul(near, near), near4 = hn::Mul(near2, near2), near8 = hn::Mul(near4, near4);
        shaded = hn::Add(shaded, hn::Mul(constant(kPhongHighlight), hn::Mul(hn::Mul(near8, near8), near8)));
      }
      const F change = hn::Mul(hn::Mul(surface, apart), hn::Sub(shaded, constant(1.0f)));
      share = hn::Mul(share, hn::Add(constant(1.0f), change));
      red = hn::Add(red, hn::Mul(constant(lamp.linear.r), share));
      green = hn::Add(green, hn::Mul(constant(lamp.linear.g), share));
      blue = hn::Add(blue, hn::Mul(constant(lamp.linear.b), share));
    }
    pack(red, green, blue, run.light + i);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace freevoxel
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace freevoxel {

HWY_EXPORT(shadeVoxels);

void shadeRun(const ShadingFrame& frame, size_t first, VoxelRun& run) {
  static const NormalAngles angles = [] {
    NormalAngles table{};
    for (uint32_t i = 0; i < 128; ++i) {
      float other, surface;
      shared::unpackNormal(i, table.polarSine[i], other, table.polarCosine[i], surface);
      table.azimuthSine[i] = std::sin(float(i) * (shared::kPi / 64.0f));
      table.azimuthCosine[i] = std::cos(float(i) * (shared::kPi / 64.0f));
    }
    return table;
  }();
  HWY_DYNAMIC_DISPATCH(shadeVoxels)(frame, angles, first, run);
}

}  // namespace freevoxel
#endif
