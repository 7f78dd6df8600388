#include "base/camera.h"

#include <cmath>
#include <glm/glm.hpp>
#include <glm/gtc/matrix_transform.hpp>
#include <numbers>

#include "base/error.h"

namespace freevoxel {

namespace {

bool finite(glm::dvec3 v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

}  // namespace

void checkCamera(const Camera& camera) {
  if (!finite(camera.eye) || !finite(camera.target) || !finite(camera.up)) {
    throw InputError("camera: eye, target and up must be finite numbers");
  }
  const glm::dvec3 forward = camera.target - camera.eye;
  if (glm::length(forward) == 0.0) throw InputError("camera: eye and target are the same point");
  if (glm::length(camera.up) == 0.0 ||
      glm::length(glm::cross(glm::normalize(forward), glm::normalize(camera.up))) < 1e-9) {
    throw InputError("camera: up is parallel to the line from eye to target; give another --up");
  }
  if (camera.orthographicHeight) {
    if (!std::isfinite(*camera.orthographicHeight) || *camera.orthographicHeight <= 0.0) {
      throw InputError(
          fmt::format("camera: orthographic height {} is not a positive length", *camera.orthographicHeight));
    }
  } else if (!(camera.verticalFov > 0.0 && camera.verticalFov < std::numbers::pi)) {
    throw InputError(fmt::format("camera: vertical field of view {} degrees is not between 0 and 180",
                                 camera.verticalFov * 180.0 / std::numbers::pi));
  }
  if (camera.imageSize.x < 1 || camera.imageSize.y < 1 || camera.imageSize.x > 32768 || camera.imageSize.y > 32768) {
    throw InputError(
        fmt::format("camera: image size {}x{} is not within 1..32768", camera.imageSize.x, camera.imageSize.y));
  }
}

Camera turned(const Camera& camera, double angle, glm::dvec3 axis) {
  const glm::dmat3 rotation(glm::rotate(glm::dmat4(1.0), angle, axis));
  Camera result = camera;
  result.eye = camera.target + rotation * (camera.eye - camera.target);
  result.up = rotation * camera.up;
  return result;
}

ViewFrame viewFrame(const Camera& camera) {
  checkCamera(camera);
  const glm::dvec3 forward = glm::normalize(camera.target - camera.eye);
  const glm::dvec3 right = glm::normalize(glm::cross(forward, camera.up));
  const glm::dvec3 up = glm::cross(right, forward);
  ViewFrame frame;
  frame.viewFromWorld = glm::transpose(glm::dmat3(right, up, -forward));
  frame.eye = camera.eye;
  frame.orthographic = camera.orthographicHeight.has_value();
  frame.pixelsPerUnit = frame.orthographic ? camera.imageSize.y / *camera.orthographicHeight
                                           : 0.5 * camera.imageSize.y / std::tan(0.5 * camera.verticalFov);
  frame.centre = 0.5 * glm::dvec2(camera.imageSize);
  return frame;
}

Ray pixelRay(const ViewFrame& frame, glm::dvec2 pixel) {
  const glm::dvec2 offset((pixel.x - frame.centre.x) / frame.pixelsPerUnit,
                          (frame.centre.y - pixel.y) / frame.pixelsPerUnit);
  const glm::dmat3 worldFromView = glm::transpose(frame.viewFromWorld);
  if (frame.orthographic) {
    return {frame.eye + worldFromView * glm::dvec3(offset, 0.0), worldFromView * glm::dvec3(0.0, 0.0, -1.0)};
  }
  return {frame.eye, worldFromView * glm::normalize(glm::dvec3(offset, -1.0))};
}

std::optional<Projected> project(const ViewFrame& frame, glm::dvec3 world) {
  const glm::dvec3 view = frame.viewFromWorld * (world - frame.eye);
  const double depth = -view.z;
  if (frame.orthographic) {
    return Projected{frame.centre + frame.pixelsPerUnit * glm::dvec2(view.x, -view.y), depth};
  }
  if (depth <= 0.0) return std::nullopt;
  return Projected{frame.centre + frame.pixelsPerUnit / depth * glm::dvec2(view.x, -view.y), depth};
}

Camera orbitCamera(const Box& box, const Orbit& orbit, glm::ivec2 imageSize, double verticalFov,
                   std::optional<double> orthographicHeight) {
  const double radius = 0.5 * glm::length(box.extent());
  const double aspect = double(imageSize.x) / imageSize.y;
  Camera camera;
  camera.imageSize = imageSize;
  camera.verticalFov = verticalFov;
  camera.target = box.centre();
  const double halfFov = std::atan(std::tan(0.5 * verticalFov) * std::min(1.0, aspect));
  const double distance = orbit.distance.value_or(radius / std::sin(halfFov));
  const double ce = std::cos(orbit.elevation);
  const glm::dvec3 towardsEye(ce * std::sin(orbit.azimuth), std::sin(orbit.elevation), ce * std::cos(orbit.azimuth));
  camera.eye = camera.target + distance * towardsEye;
  // Straight above or below, y is no use as up: what was behind the box at elevation 0 becomes up.
  if (std::abs(ce) < 1e-6) {
    const double sign = orbit.elevation > 0.0 ? -1.0 : 1.0;
    camera.up = glm::dvec3(sign * std::sin(orbit.azimuth), 0.0, sign * std::cos(orbit.azimuth));
  }
  if (orthographicHeight) {
    camera.orthographicHeight = *orthographicHeight > 0.0 ? *orthographicHeight : 2.0 * radius / std::min(1.0, aspect);
  }
  return camera;
}

}  // namespace freevoxel
