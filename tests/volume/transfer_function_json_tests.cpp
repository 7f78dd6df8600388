#include <gtest/gtest.h>

#include "base/error.h"
#include "tests/support/test_data.h"
#include "tests/volume/volume_files.h"
#include "volume/transfer_function.h"

namespace freevoxel::test {

namespace {

std::string errorOf(const std::string& json) {
  return inputError([&] { parseTransferFunction(json, "t.json"); });
}

const std::string kPoints = R"("points": [{"value": 0, "color": [1, 0.5, 0], "opacity": 0},
 {"value": 10, "color": [0, 0, 1], "opacity": 0.25}])";

bool equal(const TransferFunction& a, const TransferFunction& b) {
  if (a.low != b.low || a.high != b.high || a.referenceLength != b.referenceLength) return false;
  return std::equal(a.points.begin(), a.points.end(), b.points.begin(), b.points.end(),
                    [](const TransferPoint& p, const TransferPoint& q) {
                      return p.value == q.value && p.srgb == q.srgb && p.opacity == q.opacity;
                    });
}

}  // namespace

TEST(TransferFunctionJson, readsWhatIsWritten) {
  const TransferFunction t =
      parseTransferFunction(R"({"range": [-1, 20], "referenceLength": 2.5, )" + kPoints + "}", "t");
  EXPECT_EQ(t.low, -1.0);
  EXPECT_EQ(t.high, 20.0);
  EXPECT_EQ(t.referenceLength, 2.5);
  ASSERT_EQ(t.points.size(), 2u);
  EXPECT_EQ(t.points[0].srgb, glm::dvec3(1.0, 0.5, 0.0));
  EXPECT_EQ(t.points[1].value, 10.0);
  EXPECT_EQ(t.points[1].opacity, 0.25);
}

TEST(TransferFunctionJson, rangeDefaultsToThePoints) {
  const TransferFunction t = parseTransferFunction("{" + kPoints + "}", "t");
  EXPECT_EQ(t.low, 0.0);
  EXPECT_EQ(t.high, 10.0);
  EXPECT_EQ(t.referenceLength, 1.0);
}

TEST(TransferFunctionJson, roundTripIsExact) {
  TransferFunction t;
  t.low = -1.0 / 3.0;
  t.high = 1e22;
  t.referenceLength = 0.1;
  t.points = {{-1e-300, {1.0 / 3.0, 2.0 / 7.0, 0.1}, 5e-324}, {0.1 + 0.2, {1, 0, 1}, 1.0 / 9.0}, {0.1 + 0.2, {}, 1.0}};
  const std::string json = transferFunctionJson(t);
  EXPECT_TRUE(equal(parseTransferFunction(json, "t"), t)) << json;
  EXPECT_EQ(transferFunctionJson(parseTransferFunction(json, "t")), json);
}

TEST(TransferFunctionJson, syntaxErrorsNameLineAndColumn) {
  EXPECT_EQ(errorOf("{\n  \"range\": [0, 1],,\n}").substr(0, 26), "t.json: line 2, column 19:");
  EXPECT_NE(errorOf("").find("line 1, column 1:"), std::string::npos);
  EXPECT_NE(errorOf("{} x").find("line 1, column 4:"), std::string::npos);
  EXPECT_NE(errorOf(R"({"range": [0, 1e999]})").find("1e999"), std::string::npos);
  errorOf("{\"\xff\": 1}");
  errorOf(std::string(100000, '['));
}

TEST(TransferFunctionJson, errorsNameTheirPlace) {
  const std::string range = R"({"range": [0, 1], )";
  const auto point = [&](const std::string& fields) { return range + R"("points": [{)" + fields + "}]}"; };
  EXPECT_EQ(errorOf("[]"), "t.json: expected a list of colour maps, found an array of 0");
  EXPECT_EQ(errorOf("3"), "t.json: expected an object, found '3'");
  EXPECT_EQ(errorOf(range + R"("Points": []})"),
            "t.json: unknown key 'Points', expected range, points, referenceLength");
  EXPECT_EQ(errorOf(R"({"range": [0, 1]})"), "t.json: expected a key 'points', found none");
  EXPECT_EQ(errorOf(range + R"("points": []})"),
            "t.json: points: expected a list of at least one point, found an array of 0");
  EXPECT_EQ(errorOf(R"({"range": [1, 1], )" + kPoints + "}"), "t.json: range: expected low < high, found [1, 1]");
  EXPECT_EQ(errorOf(R"({"range": [1, 0], )" + kPoints + "}"), "t.json: range: expected low < high, found [1, 0]");
  EXPECT_EQ(errorOf(R"({"range": [0, 1, 2], )" + kPoints + "}"),
            "t.json: range: expected [low, high], found an array of 3");
  EXPECT_EQ(errorOf(R"({"range": [0, 5e-324], )" + kPoints + "}"),
            "t.json: range: expected low < high, found [0, 5e-324]");
  EXPECT_EQ(errorOf(R"({"referenceLength": 0, )" + kPoints + "}"),
            "t.json: referenceLength: expected a number in 1e-06..1000000, found '0'");
  EXPECT_EQ(errorOf(point(R"("value": 0, "color": [0, 0, 1.5], "opacity": 0)")),
            "t.json: points[0].color[2]: expected a number in 0..1, found '1.5'");
  EXPECT_EQ(errorOf(point(R"("value": 0, "color": [0, 0], "opacity": 0)")),
            "t.json: points[0].color: expected [red, green, blue], found an array of 2");
  EXPECT_EQ(errorOf(point(R"("value": 0, "color": [0, 0, 0], "opacity": -0.5)")),
            "t.json: points[0].opacity: expected a number in 0..1, found '-0.5'");
  EXPECT_EQ(errorOf(point(R"("value": null, "color": [0, 0, 0], "opacity": 0)")),
            "t.json: points[0].value: expected a number in -1e+300..1e+300, found 'null'");
  EXPECT_EQ(errorOf(point(R"("value": 0, "color": [0, 0, 0])")),
            "t.json: points[0]: expected a key 'opacity', found none");
  EXPECT_EQ(errorOf(point(R"("value": 0, "colour": [0, 0, 0], "opacity": 0)")),
            "t.json: points[0]: unknown key 'colour', expected value, color, opacity");
  EXPECT_EQ(errorOf(point(R"("value": 0, "value": 1, "color": [0, 0, 0], "opacity": 0)")),
            "t.json: key 'value' is given twice");
}

TEST(TransferFunctionJson, pointsAreInOrder) {
  const std::string p = R"("color": [0, 0, 0], "opacity": 0})";
  EXPECT_EQ(errorOf(R"({"points": [{"value": 2, )" + p + R"(, {"value": 1, )" + p + "]}"),
            "t.json: points[1].value: expected values in ascending order, found 1 after 2");
  EXPECT_EQ(errorOf(R"({"range": [0, 9], "points": [{"value": 2, )" + p + R"(, {"value": 2, )" + p +
                    R"(, {"value": 2, )" + p + "]}"),
            "t.json: points[2].value: expected at most two points (a step) of one value, found a third of 2");
  EXPECT_EQ(errorOf(R"({"points": [{"value": 2, )" + p + "]}"),
            "t.json: expected a key 'range' where all points have one value");
}

TEST(TransferFunctionJson, everyTruncationFails) {
  const std::string json = transferFunctionJson(parseTransferFunction("{" + kPoints + "}", "t"));
  for (size_t length = 0; length + 2 < json.size(); ++length) {  // the last two are "}" and the end of its line
    EXPECT_THROW(parseTransferFunction(json.substr(0, length), "t"), InputError) << length;
  }
}

TEST(TransferFunctionJson, missingFilesAreNamed) {
  EXPECT_NE(inputError([] { readTransferFunction("/nonexistent/t.json"); }).find("/nonexistent/t.json"),
            std::string::npos);
}

TEST(TransferFunctionJson, paraViewColourMaps) {
  const TransferFunction t = parseTransferFunction(R"([{"ColorSpace": "RGB", "Name": "x", "NanColor": [1, 1, 0],
    "RGBPoints": [0, 0, 0, 0,  10, 1, 0.5, 0], "Points": [0, 0, 0.5, 0,  5, 0.8, 0.5, 0,  10, 0.2, 0.5, 0]}])",
                                                   "t");
  EXPECT_EQ(t.low, 0.0);
  EXPECT_EQ(t.high, 10.0);
  ASSERT_EQ(t.points.size(), 3u);
  EXPECT_DOUBLE_EQ(t.opacityAt(5.0), 0.8);
  EXPECT_DOUBLE_EQ(t.opacityAt(7.5), 0.5);
  EXPECT_DOUBLE_EQ(t.srgbAt(5.0).r, 0.5);
  EXPECT_DOUBLE_EQ(t.srgbAt(10.0).g, 0.5);
}

TEST(TransferFunctionJson, paraViewColourMapsThatBendAreRefused) {
  EXPECT_EQ(errorOf(R"([{"ColorSpace": "Lab", "RGBPoints": [0, 0, 0, 0, 1, 1, 1, 1]}])"),
            "t.json: [0].ColorSpace: expected \"RGB\"");
  EXPECT_EQ(errorOf(R"([{"RGBPoints": [0, 0, 0, 0, 1, 1, 1, 1], "Points": [0, 0, 0.3, 0, 1, 1, 0.5, 0]}])"),
            "t.json: [0].Points[2]: expected midpoint 0.5 and sharpness 0 (a straight line)");
  errorOf(R"([{"RGBPoints": [0, 0, 0, 0, 1]}])");
  errorOf(R"([{"RGBPoints": []}])");
}

TEST(TransferFunctionJson, examplesAreValid) {
  const std::string folder = sourceFolder() + "/examples/transfer";
  const std::vector<std::string> names = listFolder(folder);
  EXPECT_GE(names.size(), 18u);
  for (const std::string& name : names) {
    const TransferFunction t = readTransferFunction(folder + "/" + name);
    EXPECT_GT(t.largestOpacity(t.low, t.high), 0.0) << name;
  }
}

}  // namespace freevoxel::test
