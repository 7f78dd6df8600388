#include <gtest/gtest.h>

#include "base/error.h"
#include "tests/support/test_data.h"
#include "tests/volume/volume_files.h"

namespace freevoxel::test::legacy_vtk_tests {

namespace {

std::string start(const std::string& encoding) {
  return "# vtk DataFile Version 3.0\na title\n" + encoding +
         "\nDATASET STRUCTURED_POINTS\nDIMENSIONS 5 7 11\nSPACING 1 2 0.5\nORIGIN 10 20 30\n";
}
const std::string kBinary = start("BINARY") + "POINT_DATA 385\n";

std::string error(const std::string& content) {
  const std::string path = fileOf(content, "v.vtk");
  return inputError([&] { readVolume(path); }).substr(path.size() + 2);
}

std::string textOf(ValueType type) {
  std::string text;
  for (uint64_t i = 0; i < voxelCount(kDims); ++i)
    text += fmt::format("{}{}", testValue(type, i), i % 9 == 8 || i == 384 ? "\n" : " ");
  return text;
}

VolumeOptions component(const std::string& name) {
  VolumeOptions options;
  options.component = name;
  return options;
}

}  // namespace

TEST(LegacyVtk, everyTypeBinaryAndText) {
  const std::vector<std::pair<ValueType, std::string>> names{
      {ValueType::u8, "unsigned_char"}, {ValueType::i8, "char"},          {ValueType::u16, "unsigned_short"},
      {ValueType::i16, "short"},        {ValueType::u32, "unsigned_int"}, {ValueType::i32, "int"},
      {ValueType::f32, "float"},        {ValueType::f64, "double"}};
  for (const auto& [type, name] : names) {
    const std::string scalars = "SCALARS s " + name + "\nLOOKUP_TABLE default\n";
    const Volume volume = readVolume(fileOf(kBinary + scalars + testBytes(type, ByteOrder::big), "v.vtk"));
    expectTestValues(volume, type);
    EXPECT_EQ(volume.header.placement.spacing, glm::dvec3(1.0, 2.0, 0.5));
    EXPECT_EQ(volume.header.placement.origin, glm::dvec3(10.0, 20.0, 30.0));
    expectTestValues(readVolume(fileOf(start("ASCII") + "POINT_DATA 385\n" + scalars + textOf(type), "v.vtk")), type);
  }
}

TEST(LegacyVtk, severalArrays) {
  const std::string values = testBytes(ValueType::f32, ByteOrder::big);
  std::string vectors;
  for (size_t i = 0; i < values.size(); i += 4)
    vectors += "aaaa" + values.substr(i, 4) + "bbbb";
  const std::string content = kBinary + "VECTORS flow float\n" + vectors + "\nSCALARS first%20one float 1\n" +
                              "LOOKUP_TABLE default\n" + values + "\nLOOKUP_TABLE default 2\nrgbargba\n" +
                              "FIELD more 2\npressure 1 385 float\n" + values + "\nnames 2 3 unsigned_char\nabcdef\n" +
                              "METADATA\nINFORMATION 0\n\n";
  const std::string path = fileOf(content, "v.vtk");
  expectTestValues(readVolume(path), ValueType::f32);
  for (const std::string name : {"first one", "pressure", "flow.1", "1"}) {
    expectTestValues(readVolume(path, component(name)), ValueType::f32);
  }
  EXPECT_EQ(inputError([&] { readVolume(path, component("heat")); }),
            path + ": has no component 'heat'; there are 'flow.0', 'flow.1', 'flow.2', 'first one', 'pressure'");
  EXPECT_EQ(error(kBinary + "VECTORS flow float\n" + vectors),
            "holds 3 values per voxel ('flow.0', 'flow.1', 'flow.2'); choose one with --component");
}

TEST(LegacyVtk, valuesOfCells) {
  const std::string content =
      "# vtk DataFile Version 3.0\na title\nBINARY\nDATASET STRUCTURED_POINTS\nDIMENSIONS 6 8 12\nORIGIN 0 0 0\n"
      "SPACING 1 2 3\nCELL_DATA 385\nSCALARS s unsigned_char\nLOOKUP_TABLE default\n";
  const Volume volume = readVolume(fileOf(content + testBytes(ValueType::u8, ByteOrder::big), "v.vtk"));
  expectTestValues(volume, ValueType::u8);
  EXPECT_EQ(volume.header.placement.origin, glm::dvec3(0.5, 1.0, 1.5));
}

TEST(LegacyVtk, everyTruncationFails) {
  const std::string scalars = "SCALARS s unsigned_char\nLOOKUP_TABLE default\n";
  const std::string values = testBytes(ValueType::u8, ByteOrder::big);
  const std::string binary = fileOf(kBinary + scalars + values, "v.vtk");
  expectTruncationsFail(binary, [&] { readVolume(binary); });
  // Text needs one blank after its last number.
  const std::string text = fileOf(start("ASCII") + "POINT_DATA 385\n" + scalars + textOf(ValueType::u8), "v.vtk");
  expectTruncationsFail(text, [&] { readVolume(text); });
}

TEST(LegacyVtk, whatCannotBeIsRefused) {
  const std::string scalars = "SCALARS s unsigned_char\nLOOKUP_TABLE default\n";
  const std::string values = testBytes(ValueType::u8, ByteOrder::big);
  EXPECT_NE(error(kBinary + scalars + values + "x").find("expected a keyword"), std::string::npos);
  EXPECT_NE(
      error("# vtk DataFile Version 3.0\nt\nBINARY\nDATASET UNSTRUCTURED_GRID\n").find("found 'UNSTRUCTURED_GRID'"),
      std::string::npos);
  EXPECT_NE(error(start("BINARY") + "POINT_DATA 384\n" + scalars + values).find("expected 385 of the 5 x 7 x 11 grid"),
            std::string::npos);
  EXPECT_NE(error(start("BINARY") + "SPACING 1 0 1\n").find("expected a positive spacing, found 0"), std::string::npos);
  EXPECT_NE(error("# vtk DataFile Version 3.0\nt\nBINARY\nDATASET STRUCTURED_POINTS\nDIMENSIONS 2097152 2097152 "
                  "2097152\nPOINT_DATA 9223372036854775808\nSCALARS s double\nLOOKUP_TABLE default\n")
                .find("expected 9223372036854775808 values"),
            std::string::npos);
  EXPECT_NE(error("# vtk DataFile Version 3.0\nt\nASCII\nDATASET STRUCTURED_POINTS\nDIMENSIONS 2097152 2097152 "
                  "1\nPOINT_DATA 4398046511104\nSCALARS s double\nLOOKUP_TABLE default\n1 2 3")
                .find("expected 4398046511104 values"),
            std::string::npos);
  EXPECT_NE(error(kBinary).find("no array with a value for every voxel"), std::string::npos);
}

}  // namespace freevoxel::test::legacy_vtk_tests
