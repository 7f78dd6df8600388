// The camera: how world space lands on pixels.
#pragma once

#include <glm/mat3x3.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <optional>

#include "base/placement.h"

namespace freevoxel {

/// A perspective or orthographic camera. World space is right-handed; view space has x right, y up and looks along -z.
/// Pixel (0,0) is the upper left one; pixel (x,y) has its centre at (x + 0.5, y + 0.5).
/// Invariant (checkCamera): eye != target, up not parallel to the line of sight, 0 < verticalFov < pi, sizes >= 1.
struct Camera {
  glm::dvec3 eye{0.0, 0.0, 1.0};
  glm::dvec3 target{0.0};
  glm::dvec3 up{0.0, 1.0, 0.0};
  double verticalFov = 0.5235987755982988;   ///< radians, the whole angle; 30 degrees
  std::optional<double> orthographicHeight;  ///< world length that the image's height shows; set = orthographic
  glm::ivec2 imageSize{1000, 1000};          ///< pixels
};

/// Throws InputError unless the camera's invariant holds.
void checkCamera(const Camera& camera);

/// The camera turned about an axis of world space through its target; `angle` in radians.
Camera turned(const Camera& camera, double angle, glm::dvec3 axis);

/// View space axes of a camera as rows applied to world vectors: view = rotation * (world - eye).
struct ViewFrame {
  glm::dmat3 viewFromWorld;  ///< rotation only
  glm::dvec3 eye;            ///< world
  double pixelsPerUnit;      ///< perspective: focal length in pixels; orthographic: pixels per world length
  glm::dvec2 centre;         ///< pixel position of the optical axis
  bool orthographic;
};

ViewFrame viewFrame(const Camera& camera);

/// A ray in world space; `direction` has unit length. Orthographic rays start on the plane through the eye.
struct Ray {
  glm::dvec3 origin;
  glm::dvec3 direction;
};

/// The ray through a point of the image, in pixels (the centre of pixel (x,y) is (x + 0.5, y + 0.5)).
Ray pixelRay(const ViewFrame& frame, glm::dvec2 pixel);

/// Where a world point lands, in pixels, and its distance along the line of sight. Nothing behind or on the eye's plane
/// has an image in perspective.
struct Projected {
  glm::dvec2 pixel;
  double depth;
};
std::optional<Projected> project(const ViewFrame& frame, glm::dvec3 world);

/// A camera on a sphere round `box`, framed to fit: azimuth 0, elevation 0 looks along -z with y up; azimuth turns
/// about y. Angles in radians, elevation in -pi/2..pi/2; `distance` from the box's centre in world lengths, or chosen
/// so that the box's bounding sphere just fits the narrower field of view. If `orthographicHeight` is given the camera
/// is orthographic (a height of 0 frames the box too).
struct Orbit {
  double azimuth = 0.0;
  double elevation = 0.0;
  std::optional<double> distance;
};
Camera orbitCamera(const Box& box, const Orbit& orbit, glm::ivec2 imageSize, double verticalFov,
                   std::optional<double> orthographicHeight);

}  // namespace freevoxel
