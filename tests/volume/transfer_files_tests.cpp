// Transfer functions from files of other programs, by name, and of labels.
#include <gtest/gtest.h>

#include "base/error.h"
#include "tests/support/test_data.h"
#include "tests/volume/volume_files.h"
#include "volume/histogram.h"
#include "volume/procedural.h"
#include "volume/transfer_plot.h"
#include "volume/transfer_presets.h"
#include "volume/value_codes.h"

namespace freevoxel::test {

namespace {

const std::string kProperty =
    "1\n1\n0.9\n0.1\n0.2\n10\n6 -100 0 0 0.25 300 0.75\n4 0 1 255 1\n8 -200 0 0 0 200 1 0.5 0\n";

std::string readError(const std::string& content, const std::string& name) {
  const std::string path = fileOf(content, name);
  return inputError([&] { readTransferFunction(path); }).substr(path.size() + 2);
}

Volume cloud(bool labels = false) {
  Volume volume = generateVolume("cloud", {40, 30, 20}, 1);
  volume.header.labels = labels;
  return volume;
}

}  // namespace

TEST(TransferFiles, slicersVolumeProperty) {
  const TransferFunction transfer = readTransferFunction(fileOf(kProperty, "a.vp"));
  EXPECT_EQ(transfer.low, -200.0);
  EXPECT_EQ(transfer.high, 300.0);
  EXPECT_EQ(transfer.opacityAt(-50.0), 0.125);
  EXPECT_NEAR(transfer.opacityAt(150.0), 0.5, 1e-15);
  EXPECT_EQ(transfer.srgbAt(0.0), glm::dvec3(0.5, 0.25, 0.0));
  EXPECT_EQ(transfer.srgbAt(250.0), glm::dvec3(1.0, 0.5, 0.0));
  for (size_t lines = 0, end = 0; lines < 8; ++lines) {
    end = kProperty.find('\n', end) + 1;
    EXPECT_THROW(readTransferFunction(fileOf(kProperty.substr(0, end), "a.vp")), InputError);
  }
  EXPECT_EQ(readError("1\n1\n1\n1\n1\n1\n6 0 0 1 1\n2 0 0\n4 0 0 0 0\n", "a.vp"),
            "line 7: expected a count and that many numbers, 2 for each point, found '6 0 0 1 1'");
  EXPECT_EQ(readError("1\n1\n1\n1\n1\n1\n4 5 0 1 1\n2 0 0\n4 0 0 0 0\n", "a.vp"),
            "line 7: expected values in ascending order, found 1 after 5");
  EXPECT_EQ(readError("1\n1\n1\n1\n1\n1\n4 5 0 6 2\n2 0 0\n4 0 0 0 0\n", "a.vp"),
            "line 7: expected colours and opacities in 0..1, found 2");
}

TEST(TransferFiles, imageVis3dsTable) {
  const std::string table = "3\n0 0 0 0\n1 0.5 0 0.5\n1 1 1 1\n";
  const TransferFunction transfer = readTransferFunction(fileOf(table, "a.1dt"));
  EXPECT_EQ(transfer.high, 2.0);
  EXPECT_EQ(transfer.opacityAt(0.5), 0.25);
  EXPECT_EQ(transfer.srgbAt(1.0), glm::dvec3(1.0, 0.5, 0.0));
  // Three entries are too few for a cloud of bytes: they are spread.
  const TransferFunction spread = chooseTransfer(fileOf(table, "a.1dt"), cloud());
  EXPECT_EQ(spread.high, valueStatistics(cloud()).high);
  EXPECT_EQ(spread.opacityAt(spread.high / 2.0), 0.5);
  EXPECT_EQ(readError("3\n0 0 0 0\n1 1 1 1\n", "a.1dt"), "expected 3 entries, found 2");
  EXPECT_EQ(readError("2\n0 0 0 0\n1 1 1\n", "a.1dt"),
            "line 3: expected red, green, blue and opacity, each 0..1, found '1 1 1'");
  EXPECT_EQ(readError("2\n0 0 0 0\n1 1 1 1.5\n", "a.1dt"),
            "line 3: expected red, green, blue and opacity, each 0..1, found '1 1 1 1.5'");
  EXPECT_EQ(readError("99999999\n", "a.1dt"), "line 1: expected a number of entries in 2..65536, found '99999999'");
}

TEST(TransferFiles, labels) {
  const TransferFunction transfer = parseTransferFunction(
      R"({"labels": [{"value": 2, "color": [1,0,0], "opacity": 0.5, "name": "heart"},
                     {"value": 5, "color": [0,1,0], "opacity": 1}]})",
      "t.json");
  EXPECT_TRUE(transfer.isLabels);
  EXPECT_EQ(transfer.low, 1.0);
  EXPECT_EQ(transfer.high, 6.0);
  for (const double value : {-3.0, 0.0, 1.0, 3.0, 4.0, 6.0, 7.0, 300.0})
    EXPECT_EQ(transfer.opacityAt(value), 0.0) << value;
  EXPECT_EQ(transfer.opacityAt(2.0), 0.5);
  EXPECT_EQ(transfer.opacityAt(2.4), 0.5);
  EXPECT_EQ(transfer.srgbAt(5.0), glm::dvec3(0.0, 1.0, 0.0));
  EXPECT_EQ(transfer.largestOpacity(3.0, 4.0), 0.0);
  EXPECT_EQ(transfer.largestOpacity(3.0, 5.0), 1.0);
  const TransferFunction again = parseTransferFunction(transferFunctionJson(transfer), "again");
  EXPECT_EQ(transferFunctionJson(again), transferFunctionJson(transfer));
  EXPECT_EQ(opacityHash(again), opacityHash(transfer));
  // Codes of labels are labels.
  const ValueCoding coding = valueCoding(ValueType::u8, transfer.low, transfer.high);
  EXPECT_EQ(coding.step, 1.0);
  EXPECT_EQ(transfer.opacityAt(coding.decode(coding.encode(5.0))), 1.0);
  EXPECT_EQ(transfer.opacityAt(coding.decode(coding.encode(255.0))), 0.0);
  EXPECT_EQ(transfer.opacityAt(coding.decode(coding.encode(0.0))), 0.0);
  TransferFunction amounts = transfer;
  amounts.isLabels = false;
  EXPECT_NE(opacityHash(amounts), opacityHash(transfer));

  const auto error = [](const std::string& json) { return inputError([&] { parseTransferFunction(json, "t"); }); };
  EXPECT_EQ(error(R"({"labels": [{"value": 2.5, "color": [1,0,0], "opacity": 1}]})"),
            "t: labels[0].value: expected a whole number, found 2.5");
  EXPECT_EQ(
      error(
          R"({"labels": [{"value": 2, "color": [1,0,0], "opacity": 1}, {"value": 2, "color": [1,0,0], "opacity": 1}]})"),
      "t: labels[1].value: expected labels in ascending order, found 2 after 2");
  EXPECT_NE(
      error(
          R"({"labels": [{"value": 0, "color": [1,0,0], "opacity": 1}, {"value": 70000, "color": [1,0,0], "opacity": 1}]})")
          .find("expected labels that span at most"),
      std::string::npos);
}

TEST(TransferPresets, everyOneFitsEveryVolume) {
  for (const ProceduralKind& kind : proceduralKinds()) {
    const Volume volume = generateVolume(kind.name, {9, 14, 11}, 1);
    for (const TransferPreset& preset : transferPresets()) {
      if (preset.name == "labels" && isFloatingPoint(volume.header.type)) continue;
      const TransferFunction transfer = chooseTransfer(preset.name, volume);
      // What it writes is what is accepted from files.
      EXPECT_NO_THROW(parseTransferFunction(transferFunctionJson(transfer), preset.name)) << kind.name;
    }
  }
}

TEST(TransferPresets, automaticHidesTheBackground) {
  const Volume volume = cloud();
  const TransferFunction transfer = chooseTransfer("auto", volume);
  EXPECT_EQ(transfer.opacityAt(0.0), 0.0);
  EXPECT_GT(transfer.opacityAt(valueStatistics(volume).high), 0.3);
  EXPECT_EQ(transferFunctionJson(transfer), transferFunctionJson(automaticTransfer(volume)));
}

TEST(TransferPresets, labelsStayLabels) {
  EXPECT_TRUE(chooseTransfer("auto", cloud(true)).isLabels);
  EXPECT_TRUE(chooseTransfer("gray", cloud(true)).isLabels);
  EXPECT_FALSE(chooseTransfer("gray", cloud()).isLabels);
  const TransferFunction ramp = parseTransferFunction(
      R"({"points": [{"value": 0, "color": [0,0,0], "opacity": 0}, {"value": 4, "color": [1,1,1], "opacity": 1}]})",
      "t");
  const TransferFunction labels = asLabels(ramp, "t");
  EXPECT_EQ(labels.points.size(), 5u);
  EXPECT_EQ(labels.opacityAt(3.0), 0.75);
  EXPECT_EQ(labels.opacityAt(5.0), 0.0);
}

TEST(TransferPresets, unknownNames) {
  EXPECT_NE(inputError([] { chooseTransfer("ct-boan", cloud()); }).find("is neither a file nor one of auto, gray"),
            std::string::npos);
}

TEST(Histogram, partsOfWholeNumbersAndOthers) {
  const Histogram bytes = histogramOf(readVolume(fileOf("NRRD0004\ntype: uchar\ndimension: 3\nsizes: 5 7 11\n"
                                                        "encoding: raw\n\n" +
                                                            testBytes(ValueType::u8, ByteOrder::little),
                                                        "v.nrrd")),
                                      256);
  EXPECT_EQ(bytes.counts.size(), 256u);
  EXPECT_EQ(bytes.counts[0], 2u);
  EXPECT_EQ(bytes.counts[255], 1u);
  EXPECT_EQ(bytes.middle(7), 7.0);
  EXPECT_EQ(bytes.total, 385u);
  const Histogram ramp = histogramOf(generateVolume("ramp", {5, 7, 11}, 1), 10);
  EXPECT_EQ(ramp.counts.size(), 10u);
  EXPECT_EQ(ramp.total, 385u);
}

TEST(TransferPlot, showsCurveAndBars) {
  const Volume volume = cloud();
  const Image plot = transferPlot(chooseTransfer("auto", volume), histogramOf(volume, 256), {320, 200});
  EXPECT_EQ(plot.size, glm::ivec2(320, 200));
  for (int y = 0; y < plot.size.y; ++y) {
    for (int x = 0; x < plot.size.x; ++x)
      ASSERT_EQ(plot.at(x, y)[3], 1.0f);
  }
}

}  // namespace freevoxel::test
