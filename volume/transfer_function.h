// From value to colour and opacity.
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <string>
#include <vector>

namespace freevoxel {

/// One corner of a piecewise linear transfer function.
struct TransferPoint {
  double value = 0.0;    ///< data units
  glm::dvec3 srgb{0.0};  ///< 0..1 each
  double opacity = 0.0;  ///< 0..1 per reference length
};

/// What the renderer needs of a value.
struct Classified {
  glm::vec3 linear{0.0f};   ///< linear RGB, 0..1, not premultiplied
  float extinction = 0.0f;  ///< per shortest voxel edge: -ln max((1 - opacity)^(1/referenceLength), 2^-12)
};

/// Piecewise linear in value; constant beyond the first and last point; a value outside the range is first clamped to
/// it. Colours are interpolated in sRGB, as people pick them, and then made linear. Two points of one value make a step
/// (the later one holds at and above that value).
/// Of labels, which are names and not amounts, points are the labels: the function is that of the whole number nearest
/// to a value, and numbers without a point are invisible. Nothing may then be interpolated, neither values nor codes;
/// every stage that does has to take the value of the nearest voxel instead.
/// Invariant: range low < high; points sorted by value, at least one; colours and opacities in 0..1; all finite;
/// referenceLength > 0 (in shortest voxel edges).
struct TransferFunction {
  double low = 0.0;
  double high = 255.0;
  double referenceLength = 1.0;
  std::vector<TransferPoint> points;
  bool isLabels = false;  ///< then values of points are whole and differ, and low and high lie beyond them

  glm::dvec3 srgbAt(double value) const;
  double opacityAt(double value) const;     ///< per reference length
  double extinctionAt(double value) const;  ///< per shortest voxel edge, 0..12 ln 2
  Classified at(double value) const;
  /// Largest opacity over the closed interval [a, b], a <= b: exact, looks at the corners in between.
  double largestOpacity(double a, double b) const;
};

/// Largest extinction there is: opacity 1 lets 2^-12 of the light through one shortest voxel edge.
inline constexpr double kLargestExtinction = 8.317766166719343;  // 12 ln 2

/// Reads the JSON of DESIGN section 10, ParaView's colour maps, ImageVis3D's .1dt and 3D Slicer's .vp. Errors name the
/// file and what is wrong where (line and column for syntax, the key and index for contents). Throws InputError.
TransferFunction readTransferFunction(const std::string& path);
/// As above from text; `name` stands in error messages where the path would.
TransferFunction parseTransferFunction(const std::string& json, const std::string& name);
/// The same JSON, round trip exact.
std::string transferFunctionJson(const TransferFunction& transfer);

/// Hash of everything that attenuation depends on: range, opacity corners, reference length. Colours do not enter.
uint64_t opacityHash(const TransferFunction& transfer);

/// Whether two functions give every value the same opacity to 1e-12, whatever their colours and wherever their points
/// lie: then they share attenuation, though their hashes may differ.
bool sameOpacity(const TransferFunction& a, const TransferFunction& b);
/// Whether both give every value the same colour, where it is visible or not.
bool sameColours(const TransferFunction& a, const TransferFunction& b);

/// `Classified` sampled at `size` equally spaced values over the range, both ends included; size >= 2.
std::vector<Classified> transferTable(const TransferFunction& transfer, size_t size);

}  // namespace freevoxel
