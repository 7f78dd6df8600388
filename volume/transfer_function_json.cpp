// Transfer functions as JSON text: our own form (DESIGN section 10) here, ParaView's in paraview_colour_map.cpp.
#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <limits>
#include <string_view>

#include "base/error.h"
#include "base/mapped_file.h"
#include "volume/imagevis3d_table.h"
#include "volume/json_reading.h"
#include "volume/paraview_colour_map.h"
#include "volume/slicer_volume_property.h"
#include "volume/text_parsing.h"
#include "volume/transfer_function.h"

namespace freevoxel {

namespace {

/// Twice this is still finite: differences of values cannot overflow.
constexpr double kLargestValue = 1e300;

double readValue(const JsonPlace& place) {
  return place.number(-kLargestValue, kLargestValue);
}

TransferPoint readCorner(const JsonPlace& place) {
  TransferPoint point;
  point.value = readValue(place.member("value"));
  const JsonPlace color = place.member("color");
  color.size(3, 3, "[red, green, blue]");
  for (int channel = 0; channel < 3; ++channel)
    point.srgb[channel] = color.element(size_t(channel)).number(0.0, 1.0);
  point.opacity = place.member("opacity").number(0.0, 1.0);
  return point;
}

TransferPoint readPoint(const JsonPlace& place) {
  place.onlyKeys({"value", "color", "opacity"});
  return readCorner(place);
}

std::vector<TransferPoint> readPoints(const JsonPlace& place) {
  place.size(1, std::numeric_limits<size_t>::max(), "a list of at least one point");
  std::vector<TransferPoint> points;
  for (size_t i = 0; i < place.size(); ++i) {
    points.push_back(readPoint(place.element(i)));
    const double value = points[i].value;
    if (i >= 1 && value < points[i - 1].value) {
      place.element(i).member("value").fail(
          fmt::format("expected values in ascending order, found {} after {}", value, points[i - 1].value));
    }
    if (i >= 2 && value == points[i - 2].value) {
      place.element(i).member("value").fail(
          fmt::format("expected at most two points (a step) of one value, found a third of {}", value));
    }
  }
  return points;
}

void readRange(const JsonPlace& place, TransferFunction& transfer) {
  place.size(2, 2, "[low, high]");
  transfer.low = readValue(place.element(0));
  transfer.high = readValue(place.element(1));
  // The narrowest range that 65536 codes can still divide.
  if (!(transfer.high - transfer.low >= 65536.0 * std::numeric_limits<double>::min())) {
    place.fail(fmt::format("expected low < high, found [{}, {}]", transfer.low, transfer.high));
  }
}

/// {"labels": [{"value": 3, "color": [r,g,b], "opacity": a, "name": "heart"}, ...]}: names are for people.
TransferFunction readLabels(const JsonPlace& place) {
  place.onlyKeys({"labels", "referenceLength"});
  const JsonPlace list = place.member("labels");
  constexpr size_t kMost = 65534;
  list.size(1, kMost, "a list of at least one label");
  TransferFunction transfer;
  transfer.isLabels = true;
  for (size_t i = 0; i < list.size(); ++i) {
    const JsonPlace label = list.element(i);
    label.onlyKeys({"value", "color", "opacity", "name"});
    transfer.points.push_back(readCorner(label));
    const double value = transfer.points[i].value;
    if (value != std::round(value) || std::abs(value) > 1e9) {
      label.member("value").fail(fmt::format("expected a whole number, found {}", value));
    }
    if (i >= 1 && value <= transfer.points[i - 1].value) {
      label.member("value").fail(
          fmt::format("expected labels in ascending order, found {} after {}", value, transfer.points[i - 1].value));
    }
  }
  transfer.low = transfer.points.front().value - 1.0;
  transfer.high = transfer.points.back().value + 1.0;
  if (transfer.high - transfer.low > double(kMost) + 1.0) {
    list.fail(fmt::format("expected labels that span at most {}, found {}", kMost, transfer.high - transfer.low - 1.0));
  }
  if (place.has("referenceLength")) transfer.referenceLength = place.member("referenceLength").number(1e-6, 1e6);
  return transfer;
}

TransferFunction readOwn(const JsonPlace& place) {
  if (place.has("labels")) return readLabels(place);
  place.onlyKeys({"range", "points", "referenceLength"});
  TransferFunction transfer;
  transfer.points = readPoints(place.member("points"));
  if (place.has("range")) {
    readRange(place.member("range"), transfer);
  } else {
    transfer.low = transfer.points.front().value;
    transfer.high = transfer.points.back().value;
    if (!(transfer.low < transfer.high)) place.fail("expected a key 'range' where all points have one value");
  }
  if (place.has("referenceLength")) {
    transfer.referenceLength = place.member("referenceLength").number(1e-6, 1e6);
  }
  return transfer;
}

}  // namespace

TransferFunction parseTransferFunction(const std::string& json, const std::string& name) {
  const nlohmann::json document = parseJson(json, name);
  const JsonPlace top(document, name);
  return isParaViewColourMap(document) ? readParaViewColourMap(top) : readOwn(top);
}

TransferFunction readTransferFunction(const std::string& path) {
  const MappedFile file(path);
  constexpr size_t kLargestFile = size_t(1) << 24;
  if (file.bytes().size() > kLargestFile) {
    throw InputError(fmt::format("{}: expected a transfer function of at most {} bytes, found {}", path, kLargestFile,
                                 file.bytes().size()));
  }
  const std::string text(reinterpret_cast<const char*>(file.bytes().data()), file.bytes().size());
  const std::string extension = lowerCase(std::filesystem::path(path).extension().string());
  if (extension == ".1dt") return parseImageVis3dTable(text, path);
  if (extension == ".vp") return parseSlicerVolumeProperty(text, path);
  return parseTransferFunction(text, path);
}

std::string transferFunctionJson(const TransferFunction& transfer) {
  // fmt's {} is the shortest text that reads back as the same double.
  std::string json = transfer.isLabels
                         ? fmt::format("{{\n  \"referenceLength\": {},\n  \"labels\": [\n", transfer.referenceLength)
                         : fmt::format("{{\n  \"range\": [{}, {}],\n  \"referenceLength\": {},\n  \"points\": [\n",
                                       transfer.low, transfer.high, transfer.referenceLength);
  for (const TransferPoint& point : transfer.points) {
    json +=
        fmt::format("    {{\"value\": {}, \"color\": [{}, {}, {}], \"opacity\": {}}}{}\n", point.value, point.srgb.r,
                    point.srgb.g, point.srgb.b, point.opacity, &point == &transfer.points.back() ? "" : ",");
  }
  return json + "  ]\n}\n";
}

}  // namespace freevoxel
