#include <gtest/gtest.h>

#include <filesystem>

#include "base/error.h"
#include "tests/support/test_data.h"
#include "tests/volume/volume_files.h"

namespace freevoxel::test::nrrd_tests {

namespace {

const std::string kStart = "NRRD0004\ndimension: 3\nsizes: 5 7 11\n";
const std::string kByteHeader = kStart + "type: uchar\nencoding: raw\n";
const std::string kBytes = testBytes(ValueType::u8, ByteOrder::little);

/// Writes an NRRD file of that content; other files go beside it.
class NrrdFile {
 public:
  explicit NrrdFile(const std::string& content, const std::string& name = "v.nrrd") : path_(folder_ + "/" + name) {
    writeBytes(path_, content);
  }
  const std::string& path() const { return path_; }
  void beside(const std::string& name, const std::string& bytes) const { writeBytes(folder_ + "/" + name, bytes); }
  std::string besidePath(const std::string& name) const { return folder_ + "/" + name; }
  Volume read() const { return readVolume(path_); }
  /// Without the path that every error starts with.
  std::string error() const {
    const std::string text = inputError([this] { readVolume(path_); });
    EXPECT_EQ(text.substr(0, path_.size() + 2), path_ + ": ");
    return text.substr(std::min(text.size(), path_.size() + 2));
  }

 private:
  std::string folder_ = temporaryFolder();
  std::string path_;
};

std::string sliceBytes(int z) {
  return kBytes.substr(size_t(z) * 35, 35);
}

Placement placementOf(const std::string& fields) {
  return NrrdFile(kByteHeader + fields + "\n" + kBytes).read().header.placement;
}

}  // namespace

TEST(Nrrd, everyTypeNameInBothByteOrdersAndEncodings) {
  const std::vector<std::pair<ValueType, std::vector<std::string>>> names{
      {ValueType::i8, {"signed char", "int8", "int8_t"}},
      {ValueType::u8, {"uchar", "unsigned char", "uint8", "uint8_t"}},
      {ValueType::i16, {"short", "short int", "signed short", "signed short int", "int16", "int16_t"}},
      {ValueType::u16, {"ushort", "unsigned short", "unsigned short int", "uint16", "uint16_t"}},
      {ValueType::i32, {"int", "signed int", "int32", "int32_t"}},
      {ValueType::u32, {"uint", "unsigned int", "uint32", "uint32_t"}},
      {ValueType::f32, {"float", "FLOAT"}},
      {ValueType::f64, {"double"}}};
  for (const auto& [type, spellings] : names) {
    for (const std::string& spelling : spellings) {
      const std::string header = kStart + "type: " + spelling + "\nendian: ";
      const std::string little = testBytes(type, ByteOrder::little);
      const std::string big = testBytes(type, ByteOrder::big);
      expectTestValues(NrrdFile(header + "little\nencoding: raw\n\n" + little).read(), type);
      expectTestValues(NrrdFile(header + "big\nencoding: raw\n\n" + big).read(), type);
      expectTestValues(NrrdFile(header + "big\nencoding: gz\n\n" + gzip(big)).read(), type);
    }
  }
}

TEST(Nrrd, withoutPlacementVoxelsAreUnitCubes) {
  const Placement placement = placementOf("");
  EXPECT_EQ(placement.spacing, glm::dvec3(1.0));
  EXPECT_EQ(placement.origin, glm::dvec3(0.0));
  EXPECT_EQ(placement.direction, glm::dmat3(1.0));
}

TEST(Nrrd, spacings) {
  EXPECT_EQ(placementOf("spacings: 0.5 0.75 2\nspace: 3D-left-handed\n").spacing, glm::dvec3(0.5, 0.75, 2.0));
  EXPECT_EQ(placementOf("spacings: 0.5 NaN 2\n").spacing, glm::dvec3(0.5, 1.0, 2.0));
  EXPECT_EQ(placementOf("spacings: 0.5 0.75 2\nspace: 3D-left-handed\n").direction, glm::dmat3(1.0));
}

TEST(Nrrd, spaceDirectionsAndOrigin) {
  for (const std::string space : {"", "space: right-anterior-superior\n", "space: RAS\n", "space dimension: 3\n",
                                  "space: scanner-xyz\n", "space: 3D-right-handed\n"}) {
    const Placement placement =
        placementOf(space + "space directions: (0,2,0) ( -0.5, 0, 0 ) (0,0,3)\nspace origin: (10, -20 ,30.5)\n");
    EXPECT_EQ(placement.spacing, glm::dvec3(2.0, 0.5, 3.0));
    EXPECT_EQ(placement.direction[0], glm::dvec3(0.0, 1.0, 0.0));
    EXPECT_EQ(placement.direction[1], glm::dvec3(-1.0, 0.0, 0.0));
    EXPECT_EQ(placement.origin, glm::dvec3(10.0, -20.0, 30.5));
  }
}

TEST(Nrrd, axisEndsPlaceTheFirstVoxel) {
  const Placement cells = placementOf("axis mins: 10 20 30\naxismaxs: 20 34 85\n");
  EXPECT_EQ(cells.spacing, glm::dvec3(2.0, 2.0, 5.0));
  EXPECT_EQ(cells.origin, glm::dvec3(11.0, 21.0, 32.5));
  const Placement nodes = placementOf("axis mins: 10 20 NaN\naxis maxs: 18 32 1\ncenters: node node node\n");
  EXPECT_EQ(nodes.spacing, glm::dvec3(2.0, 2.0, 1.0));
  EXPECT_EQ(nodes.origin, glm::dvec3(10.0, 20.0, 0.0));
}

TEST(Nrrd, overriddenSpacing) {
  const NrrdFile file(kByteHeader + "spacings: 1 2 3\n\n" + kBytes);
  VolumeOptions raw;
  raw.spacing = glm::dvec3(4.0, 5.0, 6.0);
  EXPECT_EQ(readVolume(file.path(), raw).header.placement.spacing, glm::dvec3(4.0, 5.0, 6.0));
  raw.dims = kDims;
  EXPECT_NE(inputError([&] { readVolume(file.path(), raw); }).find("leave out --dims"), std::string::npos);
}

TEST(Nrrd, whatIsUnknownIsPassedOver) {
  const NrrdFile file(
      "NRRD0005\r\n# a comment: with a colon\r\ntype:uchar\r\nDimension: 3\r\nsizes:  5 7\t11 \r\nencoding: RAW\r\n"
      "key one:=value: 3\r\nno such field: 7\r\ncontent: a := b\r\n\r\n" +
      kBytes);
  expectTestValues(file.read(), ValueType::u8);
}

TEST(Nrrd, foundByContentWhateverItsName) {
  expectTestValues(NrrdFile(kByteHeader + "\n" + kBytes, "v.dat").read(), ValueType::u8);
}

TEST(Nrrd, detachedFile) {
  for (const std::string field : {"data file: v.raw\n", "datafile: ./v.raw\n", "data file: v.raw"}) {
    const NrrdFile file(kByteHeader + field, "v.nhdr");
    file.beside("v.raw", kBytes);
    expectTestValues(file.read(), ValueType::u8);
  }
  const NrrdFile packed(kStart + "type: uchar\nencoding: gzip\ndata file: with blank.gz\n\n", "v.nhdr");
  packed.beside("with blank.gz", gzip(kBytes));
  expectTestValues(packed.read(), ValueType::u8);
}

TEST(Nrrd, absoluteNamesAreKept) {
  const NrrdFile elsewhere(kBytes, "v.raw");
  expectTestValues(NrrdFile(kByteHeader + "data file: " + elsewhere.path() + "\n", "v.nhdr").read(), ValueType::u8);
}

TEST(Nrrd, oneFilePerSlice) {
  const NrrdFile numbered(kByteHeader + "data file: s%03d.raw 1 11 1 2\n", "v.nhdr");
  const NrrdFile backwards(kByteHeader + "data file: s%d.raw 20 0 -2\n", "v.nhdr");
  std::string names = "data file: LIST\n";
  for (int z = 0; z < 11; ++z)
    names += "s" + std::to_string(z) + "\n";
  const NrrdFile listed(kByteHeader + names, "v.nhdr");
  for (int z = 0; z < 11; ++z) {
    char name[16];
    snprintf(name, sizeof(name), "s%03d.raw", z + 1);
    numbered.beside(name, sliceBytes(z));
    backwards.beside("s" + std::to_string(20 - 2 * z) + ".raw", sliceBytes(z));
    listed.beside("s" + std::to_string(z), sliceBytes(z));
  }
  expectTestValues(numbered.read(), ValueType::u8);
  expectTestValues(backwards.read(), ValueType::u8);
  expectTestValues(listed.read(), ValueType::u8);
}

TEST(Nrrd, oneFilePerRow) {
  const NrrdFile file(kByteHeader + "data file: r%d 0 76 1 1\n", "v.nhdr");
  for (int row = 0; row < 77; ++row)
    file.beside("r" + std::to_string(row), kBytes.substr(size_t(row) * 5, 5));
  expectTestValues(file.read(), ValueType::u8);
}

TEST(Nrrd, filesOfSeveralSlices) {
  const NrrdFile file("NRRD0004\ndimension: 3\nsizes: 5 7 10\ntype: uchar\nencoding: gzip\ndata file: LIST 3\na\nb\n",
                      "v.nhdr");
  file.beside("a", gzip(kBytes.substr(0, 175)));
  file.beside("b", gzip(kBytes.substr(175, 175)));
  const Volume volume = file.read();
  EXPECT_EQ(volume.value(349), double(uint8_t(kBytes[349])));
}

TEST(Nrrd, linesAndBytesAreSkipped) {
  const std::string junk = "one line\nanother\nxyz";
  const NrrdFile skipping(kByteHeader + "line skip: 2\nbyte skip: 3\ndata file: v.raw\n", "v.nhdr");
  skipping.beside("v.raw", junk + kBytes);
  expectTestValues(skipping.read(), ValueType::u8);
  const NrrdFile atEnd(kByteHeader + "byteskip: -1\ndata file: v.raw\n", "v.nhdr");
  atEnd.beside("v.raw", junk + kBytes);
  expectTestValues(atEnd.read(), ValueType::u8);
  // Lines are skipped in the file, bytes in what it unpacks to.
  const NrrdFile packed(kStart + "type: uchar\nencoding: gzip\nlineskip: 1\nbyteskip: 4\n\n" + "a line\n" +
                        gzip("abcd" + kBytes));
  expectTestValues(packed.read(), ValueType::u8);
}

TEST(Nrrd, everyTruncationFails) {
  const NrrdFile raw(kByteHeader + "\n" + kBytes);
  expectTruncationsFail(raw.path(), [&] { raw.read(); });
  const NrrdFile packed(kStart + "type: uchar\nencoding: gzip\n\n" + gzip(kBytes));
  expectTruncationsFail(packed.path(), [&] { packed.read(); });
}

TEST(Nrrd, everyTruncationOfDetachedFilesFails) {
  const NrrdFile one(kByteHeader + "data file: v.raw", "v.nhdr");
  one.beside("v.raw", kBytes);
  expectTruncationsFail(one.path(), [&] { one.read(); });
  expectTruncationsFail(one.besidePath("v.raw"), [&] { one.read(); });
  const NrrdFile slices(kByteHeader + "data file: s%d 1 11 1", "v.nhdr");
  for (int z = 0; z < 11; ++z)
    slices.beside("s" + std::to_string(z + 1), sliceBytes(z));
  expectTruncationsFail(slices.path(), [&] { slices.read(); });
  expectTruncationsFail(slices.besidePath("s7"), [&] { slices.read(); });
}

TEST(Nrrd, payloadsThatAreTooLong) {
  EXPECT_EQ(NrrdFile(kByteHeader + "\n" + kBytes + "xx").error(),
            fmt::format("expected 385 bytes (5 x 7 x 11 values of type u8) from byte {} on, found 387",
                        kByteHeader.size() + 1));
  EXPECT_EQ(NrrdFile(kStart + "type: uchar\nencoding: gzip\n\n" + gzip(kBytes + "x")).error(),
            "expected 385 bytes (5 x 7 x 11 values of type u8), the stream goes on after them");
  const NrrdFile atEnd(kByteHeader + "byte skip: -1\n\n" + "abc" + kBytes);
  expectTestValues(atEnd.read(), ValueType::u8);
}

TEST(Nrrd, errorsNameTheLine) {
  const auto error = [](const std::string& header) { return NrrdFile(header + "\n" + kBytes).error(); };
  const std::string start = "NRRD0004\n";
  const std::string rest = "encoding: raw\n";
  EXPECT_EQ(error("NRRD0006\n"), "line 1: expected NRRD0001 to NRRD0005, found 'NRRD0006'");
  EXPECT_EQ(error("hello\n"), "line 1: expected NRRD0001 to NRRD0005");
  EXPECT_EQ(error(start), "the header has no field 'type'");
  EXPECT_EQ(error(start + "type: quadruple\n"), "line 2: expected a type of plain numbers, found 'quadruple'");
  EXPECT_EQ(error(start + "type: uchar\ntype: short\n"),
            "line 3: field 'type' is given a second time (first in line 2)");
  EXPECT_EQ(error(start + "type uchar\n"),
            "line 2: expected 'field: value', 'key:=value' or '# comment', found 'type uchar'");
  EXPECT_EQ(error(start + "type: uchar\ndimension: 2\nsizes: 5 77\n"), "line 3: expected dimension 3 or 4, found '2'");
  EXPECT_EQ(error(start + "type: uchar\ndimension: 3\nsizes: 5 77\n"), "line 4: expected 3 sizes, found '5 77'");
  EXPECT_EQ(error(start + "type: uchar\ndimension: 3\nsizes: 5 0 77\n"),
            "line 4: expected a size in 1..2097152, found '0'");
  EXPECT_EQ(error(start + "type: uchar\ndimension: 3\nsizes: 5 -1 77\n"),
            "line 4: expected a size in 1..2097152, found '-1'");
  EXPECT_EQ(error(start + "type: uchar\ndimension: 3\nsizes: 5 99999999999999999999 77\n"),
            "line 4: expected a size in 1..2097152, found '99999999999999999999'");
  EXPECT_EQ(error(kStart + "type: uchar\nencoding: hex\n"),
            "line 5: expected encoding raw, gzip or ascii, found 'hex'");
  EXPECT_EQ(error(kStart + "type: short\n" + rest), "the header has no field 'endian', which values of 2 bytes need");
  EXPECT_EQ(error(kStart + "type: short\nendian: middle\n" + rest),
            "line 5: expected endian little or big, found 'middle'");
  EXPECT_EQ(error(kByteHeader + "spacings: 1 2\n"), "line 6: expected 3 numbers, found '1 2'");
  EXPECT_EQ(error(kByteHeader + "spacings: 1 2 x\n"), "line 6: expected a finite number or NaN, found 'x'");
  EXPECT_EQ(error(kByteHeader + "spacings: 1 -2 3\n"), "line 6: expected a positive spacing, found -2");
  EXPECT_EQ(error(kByteHeader + "space: nowhere\n"),
            "line 6: expected the name of a three-dimensional space, found 'nowhere'");
  EXPECT_EQ(error(kByteHeader + "space dimension: 4\n"), "line 6: expected space dimension 3, found '4'");
  EXPECT_EQ(error(kByteHeader + "space directions: none (0,1,0) (0,0,1)\n"),
            "line 6: expected three vectors of the form (x,y,z), found 'none (0,1,0) (0,0,1)'");
  EXPECT_EQ(error(kByteHeader + "space directions: (1,0,0) (0,1,0)\n"), "line 6: expected 3 vectors, found 2");
  EXPECT_EQ(error(kByteHeader + "space directions: (1,0,0) (0,1,nan) (0,0,1)\n"),
            "line 6: expected three finite numbers (x,y,z), found '(0,1,nan)'");
  EXPECT_EQ(error(kByteHeader + "space directions: (1,0,0) (1,0,0) (0,0,1)\n"),
            "line 6: expected three axes that do not lie in one plane");
  EXPECT_EQ(error(kByteHeader + "space directions: (1,0,0) (0,0,0) (0,0,1)\n"),
            "line 6: expected a voxel edge of positive length for axis y, found (0, 0, 0)");
  EXPECT_EQ(error(kByteHeader + "space origin: 1 2 3\n"),
            "line 6: expected a vector of the form (x,y,z), found '1 2 3'");
  EXPECT_EQ(error(kByteHeader + "byte skip: -2\n"), "line 6: expected a number of bytes or -1, found '-2'");
  EXPECT_EQ(error(kByteHeader + "line skip: many\n"), "line 6: expected a number of lines, found 'many'");
  EXPECT_EQ(error(kStart + "type: uchar\nencoding: gzip\nbyte skip: -1\n"),
            "line 6: byte skip -1 is for encoding raw only");
  EXPECT_EQ(NrrdFile(kByteHeader).error(),
            "the header ends without a blank line (values follow) or a field 'data file'");
}

TEST(Nrrd, fourDimensionsAreChosenFrom) {
  const std::string start = "NRRD0004\ntype: uchar\nencoding: raw\ndimension: 4\n";
  EXPECT_EQ(NrrdFile(start + "sizes: 3 5 7 11\n\n" + kBytes).error(),
            "holds 3 values per voxel ('0', '1', '2'); choose one with --component");
  EXPECT_EQ(NrrdFile(start + "sizes: 5 7 11 2\nkinds: domain domain domain list\n\n" + kBytes).error(),
            "there are 2 volumes; choose one with --frame 0 to 1");
  EXPECT_EQ(NrrdFile(start + "sizes: 50 60 70 12\n\n" + kBytes).error(),
            "line 4: expected a field 'kinds' that says which of the four axes are not of space");
  expectTestValues(NrrdFile(start + "sizes: 5 7 11 1\n\n" + kBytes).read(), ValueType::u8);

  std::string pairs;
  for (const char c : kBytes) {
    pairs += 'x';
    pairs += c;
  }
  VolumeOptions second;
  second.component = "1";
  const std::string directions = "space: LPS\nspace directions: none (2,0,0) (0,3,0) (0,0,4)\nspace origin: (1,2,3)\n";
  const NrrdFile vectors(start + "sizes: 2 5 7 11\nkinds: vector domain domain domain\n" + directions + "\n" + pairs);
  const Volume component = readVolume(vectors.path(), second);
  expectTestValues(component, ValueType::u8);
  EXPECT_EQ(component.header.placement.spacing, glm::dvec3(2.0, 3.0, 4.0));
  EXPECT_EQ(component.header.placement.origin, glm::dvec3(-1.0, -2.0, 3.0));
  second.component = "2";
  EXPECT_NE(inputError([&] { readVolume(vectors.path(), second); }).find("has no component '2'"), std::string::npos);

  VolumeOptions frame;
  const std::string other(385, 'x');
  const std::string list = start + "sizes: 5 7 11 3\nkinds: domain domain domain time\n";
  for (const bool packed : {false, true}) {
    const std::string values = other + kBytes + other;
    const NrrdFile file(packed ? "NRRD0004\ntype: uchar\nencoding: gzip\ndimension: 4\nsizes: 5 7 11 3\n"
                                 "kinds: domain domain domain time\n\n" +
                                     gzip(values)
                               : list + "\n" + values);
    frame.frame = 1;
    expectTestValues(readVolume(file.path(), frame), ValueType::u8);
    expectTruncationsFail(file.path(), [&] { readVolume(file.path(), frame); });
    frame.frame = 3;
    EXPECT_NE(inputError([&] { readVolume(file.path(), frame); }).find("there is no --frame 3"), std::string::npos);
  }
}

TEST(Nrrd, numbersInWords) {
  std::string text;
  for (uint64_t i = 0; i < voxelCount(kDims); ++i)
    text += fmt::format("{}{}", testValue(ValueType::f32, i), i % 5 == 4 ? "\n" : " ");
  const std::string header = kStart + "type: float\nencoding: ascii\n\n";
  const NrrdFile file(header + text);
  expectTestValues(file.read(), ValueType::f32);
  expectTruncationsFail(file.path(), [&] { file.read(); });
  EXPECT_NE(NrrdFile(header + text + "7").error().find("goes on"), std::string::npos);
  EXPECT_EQ(NrrdFile(kStart + "type: uchar\nencoding: ascii\n\n1 2 256" + std::string(1000, ' ')).error(),
            "value 2: expected a number of type u8, found '256'");
  EXPECT_NE(NrrdFile(kStart + "type: uchar\nencoding: ascii\n\n1 2 3").error().find("expected 385 numbers"),
            std::string::npos);
}

TEST(Nrrd, valuesOf64Bits) {
  std::string bytes;
  for (int64_t i = 0; i < int64_t(voxelCount(kDims)); ++i) {
    const int64_t value = (i - 5) * 1000000000000;
    bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
  }
  const Volume volume = NrrdFile(kStart + "type: int64\nencoding: raw\nendian: little\n\n" + bytes).read();
  EXPECT_EQ(volume.header.type, ValueType::f64);
  EXPECT_EQ(volume.value(0), -5e12);
  EXPECT_EQ(volume.value(384), 379e12);
}

TEST(Nrrd, dataFilesThatDoNotFit) {
  const auto error = [](const std::string& field) { return NrrdFile(kByteHeader + field, "v.nhdr").error(); };
  EXPECT_NE(error("data file: gone.raw\n").find("gone.raw does not exist"), std::string::npos);
  EXPECT_EQ(error("data file:\n"), "line 6: expected the name of a data file");
  EXPECT_EQ(error("data file: s%d 1 10 1\n"), "line 6: expected 11 data files, found 10");
  EXPECT_EQ(error("data file: s%d 1 11 1 1\n"), "line 6: expected 77 data files, found 11");
  EXPECT_EQ(error("data file: s%d 1 5 1 3\n"), "line 6: expected data files that share 11 slices evenly, found 5");
  EXPECT_EQ(error("data file: s%d 1 11 1 4\n"), "line 6: expected 1, 2 or 3 axes per data file, found '4'");
  EXPECT_EQ(error("data file: s%d 1 11 0\n"), "line 6: expected numbers that lead from 1 to 11, found step 0");
  EXPECT_EQ(error("data file: s%d 1 11 -1\n"), "line 6: expected numbers that lead from 1 to 11, found step -1");
  EXPECT_EQ(error("data file: s%s 1 11 1\n"), "line 6: expected one %d in the file names, found 's%s'");
  EXPECT_EQ(error("data file: s%d%d 1 11 1\n"), "line 6: expected one %d in the file names, found 's%d%d'");
  EXPECT_EQ(error("data file: s%999999999d 1 11 1\n"),
            "line 6: expected one %d in the file names, found 's%999999999d'");
  EXPECT_NE(error("data file: s%d 1 11 1\n").find("s1 does not exist"), std::string::npos);
  EXPECT_EQ(error("data file: LIST\na\n"), "line 6: expected 11 data files, found 1");
  EXPECT_EQ(error("data file: LIST 3\n"), "line 6: expected data files that share 11 slices evenly, found 0");
}

TEST(Nrrd, aDataFileMayNotBeAFolder) {
  const NrrdFile file(kByteHeader + "data file: .\n", "v.nhdr");
  EXPECT_NE(inputError([&] { file.read(); }).find("not a regular file"), std::string::npos);
}

TEST(Nrrd, lyingHeadersDoNotAllocate) {
  const std::string huge = "NRRD0004\ndimension: 3\nsizes: 2097152 2097152 2097152\ntype: double\nendian: little\n";
  EXPECT_EQ(NrrdFile(huge + "encoding: raw\n\n" + kBytes).error(),
            "2097152 x 2097152 x 2097152 values of type f64 are more than 2^64 bytes");
  const std::string large = "NRRD0004\ndimension: 3\nsizes: 2097152 2097152 16\ntype: uchar\n";
  EXPECT_NE(NrrdFile(large + "encoding: raw\n\n" + kBytes).error().find("found 385"), std::string::npos);
  EXPECT_NE(NrrdFile(large + "encoding: gzip\n\n" + gzip(kBytes)).error().find("cannot hold more than"),
            std::string::npos);
  EXPECT_NE(NrrdFile(kByteHeader + "byte skip: 18446744073709551615\n\n" + kBytes).error().find("expected 385 bytes"),
            std::string::npos);
  EXPECT_NE(NrrdFile(kByteHeader + "line skip: 18446744073709551615\n\n" + kBytes).error().find("lines to skip"),
            std::string::npos);
}

TEST(Nrrd, everyChangedByteOfAHeaderIsReadOrRefused) {
  const std::string content = kByteHeader + "spacings: 1 2 3\nendian: little\n\n" + kBytes;
  const NrrdFile file(content);
  for (size_t i = 0; i + kBytes.size() < content.size(); ++i) {
    for (const char c : {'\0', '\n', ':', '9', '\xff', ' '}) {
      std::string changed = content;
      changed[i] = c;
      writeBytes(file.path(), changed);
      VolumeOptions raw;
      try {
        readVolume(file.path(), raw);
      } catch (const InputError&) {  // anything else fails the test
      }
    }
  }
}

TEST(Nrrd, compressedAsAWhole) {
  EXPECT_NE(NrrdFile(gzip(kByteHeader + "\n" + kBytes), "v.nrrd.gz").error().find("gunzip it"), std::string::npos);
}

}  // namespace freevoxel::test::nrrd_tests
