#include "voxlink/trace_scene.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/glm.hpp>
#include <limits>
#include <optional>

#include "base/error.h"
#include "voxlink/traversal.h"

namespace freevoxel {

namespace {

using glm::dvec3;
using glm::vec3;

/// A view ray or a shadow ray; the same as shared::RayRecord, with positions as doubles.
struct SceneRay {
  dvec3 origin{0.0}, direction{0.0};  ///< voxels; unit vector
  double start = 0.0;                 ///< where it begins
  float through = 1.0f;               ///< view ray: 1 - opacity so far
  vec3 brings{0.0f};                  ///< shadow ray: light for the pixel
  double end = INFINITY;              ///< shadow ray: the lamp
  uint32_t ignored = 0, left = 0, inside = 0;
  double ignoreUntil = 0.0;
  bool thrownBack = false, towardsLamp = false;
  int depth = 0;
};

/// The next surface in a voxel.
struct Meeting {
  double t = INFINITY, leave = 0.0;
  int fragment = -1;
  uint32_t material = 0, plane = 0;  ///< plane: 0 of a sphere
  bool leaving = false;
  vec3 outward{0.0f};  ///< of the surface itself: tells its sides
  vec3 normal{0.0f};   ///< for light, to the outside
};

/// Beyond the ends of a ray's part of a voxel, spheres are still met: rounding must not let a ray slip through.
constexpr float kSphereSlack = 1e-3f;

class SceneTracer {
 public:
  SceneTracer(const SceneBuffers& buffers, const SceneVoxels& scene, std::span<const uint32_t> light,
              const SceneTracing& tracing)
      : buffers_(buffers),
        scene_(scene),
        light_(light),
        tracing_(tracing),
        lamps_(sceneLamps(scene.grid, tracing.lighting)),
        scale_(sumScale(tracing.lighting)) {}

  /// Adds up what a view ray and all that come from it bring.
  uint64_t tracePixel(const SceneRay& first, uint32_t* sums) const {
    uint64_t rays = 0;
    std::vector<SceneRay> waiting{first};
    while (!waiting.empty()) {
      SceneRay ray = waiting.back();
      waiting.pop_back();
      ++rays;
      traceView(ray, waiting, sums, rays);
    }
    return rays;
  }

  /// What is left of light on its way along a ray up to ray.end. `own`: a voxel whose volumes do not count.
  float shadow(SceneRay ray, glm::ivec3 own) const {
    float kept = 1.0f;
    traverse(buffers_, ray.origin, ray.direction, ray.start,
             [&](size_t stored, glm::ivec3 voxel, double from, double to) {
               if (from >= ray.end) return false;
               double at = from;
               int last = -1;
               for (;;) {
                 const Meeting met = nextMeeting(stored, voxel, ray, from, std::min(to, ray.end), at, last);
                 const bool found = met.fragment >= 0;
                 const double until = found ? met.t : std::min(to, ray.end);
                 if (voxel != own) kept *= std::exp(-extinction(stored) * float(until - at));
                 if (!found) break;
                 kept *= shared::shadowKept(scene_.materials[met.material]);
                 pass(ray, met);
                 at = met.t;
                 last = met.fragment;
               }
               return kept >= shared::kLeastThrough;
             });
    return kept >= shared::kLeastThrough ? kept : 0.0f;
  }

 private:
  /// The surface that a ray meets next in a voxel, after `last` at `at`.
  Meeting nextMeeting(size_t stored, glm::ivec3 voxel, SceneRay& ray, double from, double to, double at,
                      int last) const {
    Meeting best;
    const float length = float(to - from), now = float(at - from);
    const dvec3 entry = ray.origin + from * ray.direction;
    const vec3 direction(ray.direction);
    const uint32_t first = buffers_.voxels[stored], end = buffers_.voxels[stored + 1];
    for (uint32_t i = first; i < end; ++i) {
      const SceneFragment& fragment = buffers_.fragments[i];
      const int number = int(i - first);
      const uint32_t kind = shared::fragmentKind(fragment.head);
      if (kind == shared::kVolume) continue;
      const auto consider = [&](float t, float leave, uint32_t material, uint32_t plane, vec3 outward, vec3 normal) {
        if (t < now || (t == now && number <= last)) return;
        const bool leaving = glm::dot(direction, outward) > 0.0f;
        const uint32_t key = shared::surfaceKey(material, leaving);
        if (from + t < ray.ignoreUntil && (shared::sameSurface(ray.ignored, key) ||
                                           shared::samePlane(ray.ignored, ray.left, key, plane, ray.towardsLamp))) {
          ray.ignoreUntil = std::max(ray.ignoreUntil, from + leave + shared::kGapVoxels);
          return;
        }
        if (from + t < best.t) best = {from + t, from + leave, number, material, plane, leaving, outward, normal};
      };
      if (kind == shared::kTriangles) {
        float t = 0.0f, leave = 0.0f;
        if (!shared::meetPlane(fragment.body, vec3(entry - (dvec3(voxel) + 0.5)), direction, length,
                               float(from - ray.start), ray.thrownBack, t, leave)) {
          continue;
        }
        const vec3 normal = shared::unpackDirection(fragment.head);
        consider(t, leave, shared::fragmentIndex(fragment.head), fragment.body,
                 shared::planeOutward(fragment.body, normal), normal);
      } else {
        const SceneSphere& sphere = scene_.spheres[shared::sphereIndex(fragment.head)];
        const vec3 place(entry - dvec3(sphere.x, sphere.y, sphere.z));
        float t[2];
        if (!shared::meetSphere(sphere.radius, place, direction, t[0], t[1])) continue;
        for (const float root : t) {
          if (root < -kSphereSlack || root > length + kSphereSlack) continue;
          const float inside = std::clamp(root, 0.0f, length);
          const vec3 outward = (place + root * direction) / sphere.radius;
          consider(inside, inside, sphere.material, 0, outward, outward);
        }
      }
    }
    return best;
  }

  /// The normal for light where a ray meets a plane: those of the surface around, blended.
  vec3 blendedNormal(const Meeting& met, glm::ivec3 voxel, dvec3 place, vec3 direction) const {
    const vec3 in(place - dvec3(voxel));
    vec3 sum(0.0f);
    for (int i = 0; i < 27; ++i) {
      const glm::ivec3 step(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1);
      const std::optional<size_t> stored = buffers_.stored(voxel + step);
      if (!stored) continue;
      const float weight =
          shared::blendWeight(in.x, step.x) * shared::blendWeight(in.y, step.y) * shared::blendWeight(in.z, step.z);
      for (uint32_t k = buffers_.voxels[*stored]; k < buffers_.voxels[*stored + 1]; ++k) {
        const SceneFragment& fragment = buffers_.fragments[k];
        if (shared::fragmentKind(fragment.head) != shared::kTriangles) continue;
        if (shared::fragmentIndex(fragment.head) != met.material) continue;
        const vec3 normal = shared::unpackDirection(fragment.head);
        sum += weight * shared::blendLikeness(glm::dot(normal, met.normal)) * normal;
      }
    }
    return shared::facingNormal(sum, met.outward, direction);
  }

  /// A ray goes on straight behind a surface.
  static void pass(SceneRay& ray, const Meeting& met) {
    ray.ignored = shared::surfaceKey(met.material, met.leaving);
    ray.left = met.plane;
    ray.ignoreUntil = met.leave + shared::kGapVoxels;
  }
  /// A ray starts anew at a surface.
  static SceneRay from(const SceneRay& ray, const Meeting& met, vec3 direction, bool thrownBack) {
    SceneRay next = ray;
    next.thrownBack = thrownBack;
    next.origin = ray.origin + met.t * ray.direction;
    next.direction = glm::normalize(dvec3(direction));
    next.start = 0.0;
    next.ignored = shared::surfaceKey(met.material, glm::dot(direction, met.outward) > 0.0f);
    next.left = met.plane;
    next.ignoreUntil = shared::kLeaveVoxels;
    return next;
  }

  const VoxelMaterial& volumeMaterial(const SceneFragment& fragment) const {
    return scene_.volumeMaterials[scene_.firstOfVolume[shared::fragmentIndex(fragment.head)] +
                                  shared::fragmentCode(fragment.body)];
  }
  float extinction(size_t stored) const {
    float sum = 0.0f;
    for (uint32_t i = buffers_.voxels[stored]; i < buffers_.voxels[stored + 1]; ++i) {
      const SceneFragment& fragment = buffers_.fragments[i];
      if (shared::fragmentKind(fragment.head) == shared::kVolume) sum += volumeMaterial(fragment).extinction;
    }
    return sum;
  }

  void add(uint32_t* sums, vec3 light) const {
    for (int c = 0; c < 3; ++c)
      sums[c] += uint32_t(light[c] * scale_ + 0.5f);
  }

  /// What the volumes in a voxel add and take over a length.
  void passVolumes(size_t stored, float length, SceneRay& ray, uint32_t* sums) const {
    float sum = 0.0f;
    vec3 colour(0.0f);
    for (uint32_t i = buffers_.voxels[stored]; i < buffers_.voxels[stored + 1]; ++i) {
      const SceneFragment& fragment = buffers_.fragments[i];
      if (shared::fragmentKind(fragment.head) != shared::kVolume) continue;
      const VoxelMaterial& material = volumeMaterial(fragment);
      vec3 arriving(1.0f);
      if (!light_.empty()) shared::unpackLight(light_[i], arriving.r, arriving.g, arriving.b);
      sum += material.extinction;
      colour += material.extinction * vec3(material.red, material.green, material.blue) * arriving;
    }
    if (!(sum > 0.0f)) return;
    const float passed = std::exp(-sum * length);
    add(sums, ray.through * (1.0f - passed) / sum * colour);
    ray.through *= passed;
  }

  void traceView(SceneRay& ray, std::vector<SceneRay>& waiting, uint32_t* sums, uint64_t& rays) const {
    for (;;) {
      bool turned = false, ended = false;
      traverse(buffers_, ray.origin, ray.direction, ray.start,
               [&](size_t stored, glm::ivec3 voxel, double from, double to) {
                 double at = from;
                 int last = -1;
                 for (;;) {
                   Meeting met = nextMeeting(stored, voxel, ray, from, to, at, last);
                   const bool found = met.fragment >= 0;
                   passVolumes(stored, float((found ? met.t : to) - at), ray, sums);
                   if (ray.through < shared::kLeastThrough) {
                     ended = true;
                     return false;
                   }
                   if (!found) return true;
                   at = met.t;
                   last = met.fragment;
                   if (met.plane != 0) {
                     met.normal = blendedNormal(met, voxel, ray.origin + met.t * ray.direction, vec3(ray.direction));
                   }
                   meet(ray, met, waiting, sums, rays, turned, ended);
                   if (turned || ended) return false;
                 }
               });
      if (turned) continue;
      if (!ended) sums[3] += uint32_t(ray.through * kEscapeScale + 0.5f);
      return;
    }
  }

  void meet(SceneRay& ray, const Meeting& met, std::vector<SceneRay>& waiting, uint32_t* sums, uint64_t& rays,
            bool& turned, bool& ended) const {
    const SurfaceMaterial& material = scene_.materials[met.material];
    const vec3 direction(ray.direction);
    lightSurface(ray, met, material, sums, rays);
    ray.through *= 1.0f - material.opacity;
    if (ray.through < shared::kLeastThrough) {
      ended = true;
      return;
    }
    const vec3 against = met.leaving ? -met.normal : met.normal;
    const shared::Split split = shared::splitRay(material, met.material + 1, ray.through, direction, against,
                                                 met.leaving, ray.inside, ray.depth >= tracing_.maxDepth);
    if (split.straight > 0.0f && split.mirrored > 0.0f) {
      SceneRay back = from(ray, met, split.back, true);
      back.through = split.mirrored;
      ++back.depth;
      waiting.push_back(back);
    }
    if (split.straight > 0.0f) {
      ray.through = split.straight;
      ray.inside = split.inside;
      if (split.onward == direction) {
        pass(ray, met);
        return;
      }
      ray = from(ray, met, split.onward, false);
    } else if (split.mirrored > 0.0f) {
      ray.through = split.mirrored;
      ray = from(ray, met, split.back, true);
    } else {
      ended = true;
      return;
    }
    ++ray.depth;
    turned = true;
  }

  /// Adds a surface's own light, by shadow rays if there are any.
  void lightSurface(const SceneRay& ray, const Meeting& met, const SurfaceMaterial& material, uint32_t* sums,
                    uint64_t& rays) const {
    const float shown = ray.through * material.opacity;
    if (!(shown > 0.0f)) return;
    const vec3 colour = shown * vec3(material.red, material.green, material.blue);
    vec3 sum = tracing_.lighting.ambient * colour;
    const vec3 towardsEye(-ray.direction);
    for (const SceneLamp& lamp : lamps_) {
      const dvec3 place = ray.origin + met.t * ray.direction;
      dvec3 towards(lamp.place);
      double distance = INFINITY;
      if (!lamp.directional) {
        towards -= place;
        distance = glm::length(towards);
        if (!(distance > 0.0)) continue;
        towards /= distance;
      }
      const vec3 brings =
          colour * lamp.linear * shadeSurface(tracing_.lighting.shading, met.normal, 1.0f, vec3(towards), towardsEye);
      if (!(std::max({brings.r, brings.g, brings.b}) * scale_ >= 0.5f)) continue;
      if (tracing_.shadows == Shadows::none) {
        sum += brings;
        continue;
      }
      SceneRay shadowRay = from(ray, met, vec3(towards), true);
      shadowRay.end = distance;
      shadowRay.towardsLamp = true;
      ++rays;
      add(sums, brings * shadow(shadowRay, glm::ivec3(-1)));
    }
    add(sums, sum);
  }

  const SceneBuffers& buffers_;
  const SceneVoxels& scene_;
  std::span<const uint32_t> light_;
  const SceneTracing& tracing_;
  std::vector<SceneLamp> lamps_;
  float scale_;
};

/// Calls f(fragment, voxel) for every fragment of a volume.
template <class F>
void forEachVolumeFragment(const SceneBuffers& buffers, const F& f) {
  forEachStoredVoxel(buffers, [&](size_t stored, glm::ivec3 voxel) {
    for (uint32_t i = buffers.voxels[stored]; i < buffers.voxels[stored + 1]; ++i) {
      if (shared::fragmentKind(buffers.fragments[i].head) == shared::kVolume) f(size_t(i), voxel);
    }
  });
}

}  // namespace

LightShares volumeShares(const SceneBuffers& buffers, const SceneVoxels& scene, const Lighting& lighting,
                         Shadows shadows) {
  if (scene.volumeMaterials.empty()) return {};
  const size_t fragments = buffers.fragments.size();
  LightShares shares(fragments * lighting.lights.size(), uint8_t(255));
  if (shadows == Shadows::none) return shares;
  const SceneTracing tracing{lighting, shadows, 0};
  const SceneTracer tracer(buffers, scene, {}, tracing);
  const std::vector<SceneLamp> lamps = sceneLamps(scene.grid, lighting);
  for (size_t n = 0; n < lamps.size(); ++n) {
    forEachVolumeFragment(buffers, [&](size_t fragment, glm::ivec3 voxel) {
      SceneRay ray;
      ray.origin = dvec3(voxel) + 0.5;
      ray.direction = dvec3(lamps[n].place);
      if (!lamps[n].directional) {
        ray.direction -= ray.origin;
        ray.end = glm::length(ray.direction);
      }
      const double length = glm::length(ray.direction);
      if (!(length > 0.0)) return;
      ray.direction /= length;
      shares[n * fragments + fragment] = uint8_t(tracer.shadow(ray, voxel) * 255.0f + 0.5f);
    });
  }
  return shares;
}

std::vector<uint32_t> lightVolumes(const SceneBuffers& buffers, const SceneVoxels& scene, const Lighting& lighting,
                                   const LightShares& shares, const Camera& camera) {
  if (scene.volumeMaterials.empty()) return {};
  const size_t fragments = buffers.fragments.size();
  checkEqual(shares.size(), fragments * lighting.lights.size(), "shares of light");
  std::vector<uint32_t> light(fragments);
  const std::vector<SceneLamp> lamps = sceneLamps(scene.grid, lighting);
  const bool orthographic = camera.orthographicHeight.has_value();
  const vec3 eye(orthographic ? glm::normalize(camera.eye - camera.target) : scene.grid.voxelsFromWorld(camera.eye));
  forEachVolumeFragment(buffers, [&](size_t fragment, glm::ivec3 voxel) {
    vec3 sum(lighting.ambient), normal;
    float surface = 0.0f;
    shared::unpackNormal(shared::fragmentNormal(buffers.fragments[fragment].body), normal.x, normal.y, normal.z,
                         surface);
    const vec3 place = vec3(voxel) + 0.5f;
    const vec3 toEye = orthographic ? eye : eye - place;
    const float eyeDistance = glm::length(toEye);
    for (size_t n = 0; n < lamps.size(); ++n) {
      float share = float(shares[n * fragments + fragment]) * (1.0f / 255.0f);
      const vec3 toLight = lamps[n].directional ? lamps[n].place : lamps[n].place - place;
      const float distance = glm::length(toLight);
      if (lighting.shading != Shading::none && surface > 0.0f && eyeDistance > 0.0f && distance > 0.0f)
        share *= shadeSurface(lighting.shading, normal, surface, toLight / distance, toEye / eyeDistance);
      sum += lamps[n].linear * share;
    }
    light[fragment] = shared::packLight(sum.r, sum.g, sum.b);
  });
  return light;
}

Image traceScene(const SceneBuffers& buffers, const SceneVoxels& scene, std::span<const uint32_t> light,
                 const SceneTracing& tracing, const Camera& camera, ImageRows rows, uint64_t& rays,
                 Progress& progress) {
  check(light.empty() || light.size() == buffers.fragments.size(), "every fragment has light");
  const ViewFrame frame = viewFrame(camera);
  const SceneTracer tracer(buffers, scene, light, tracing);
  const glm::ivec2 size(camera.imageSize.x, rows.count);
  std::vector<uint32_t> sums(size_t(size.x) * size_t(size.y) * 4);
  progress.begin("tracing", uint64_t(size.y), "rows");
  uint64_t count = 0;
#pragma omp parallel for schedule(dynamic, 4) reduction(+ : count)
  for (int y = 0; y < size.y; ++y) {
    for (int x = 0; x < size.x; ++x) {
      const Ray seen = pixelRay(frame, glm::dvec2(x, rows.first + y) + 0.5);
      SceneRay ray;
      ray.origin = scene.grid.voxelsFromWorld(seen.origin);
      ray.direction = seen.direction;
      count += tracer.tracePixel(ray, sums.data() + 4 * (size_t(y) * size_t(size.x) + size_t(x)));
    }
#pragma omp critical(freevoxelTraceSceneProgress)
    progress.advance(1);
  }
  progress.end();
  rays = count;
  return picture(sums, tracing.lighting, size);
}

}  // namespace freevoxel
