// DICOM and OpenVDB.
#include <gtest/gtest.h>

#include "tests/volume/damaged_library_file.h"
#include "tests/volume/dicom_slice.h"
#include "tests/volume/volume_files.h"

namespace freevoxel::test {

namespace {

/// A file of OpenVDB's version 222 with one grid of floats: the test's values, active, in two leaves under one node of
/// each of the two upper levels. Values lie in the file as they are, packed by zlib if `packed`; only active ones.
std::string vdb(bool packed) {
  const auto text = [](const std::string& s) { return Bytes().add(uint32_t(s.size())).text(s).str(); };
  const auto values = [&](const std::string& bytes) {
    if (!packed) return bytes;
    if (bytes.empty()) return Bytes().add(int64_t(0)).str();
    const std::string packedBytes = zlibStream(bytes);
    return Bytes().add(int64_t(packedBytes.size())).text(packedBytes).str();
  };
  // Bit n of a mask stands for child n, counted with z fastest.
  const auto mask = [](size_t bits, const std::vector<size_t>& on) {
    std::string bytes(bits / 8, '\0');
    for (const size_t bit : on)
      bytes[bit / 8] = char(uint8_t(bytes[bit / 8]) | 1u << bit % 8);
    return bytes;
  };
  const auto node = [&](size_t children, const std::vector<size_t>& on) {
    return mask(children, on) + mask(children, {}) + Bytes().add(uint8_t(0)).str() + values({});
  };
  const std::string start = Bytes()
                                .text(std::string(" BDV\0\0\0\0", 8))
                                .add(uint32_t(222))
                                .add(uint32_t(3))
                                .add(uint32_t(0))
                                .add(uint8_t(1))
                                .text("01234567-89ab-cdef-0123-456789abcdef")
                                .add(uint32_t(0))
                                .add(uint32_t(1))
                                .text(text("density") + text("Tree_float_5_4_3") + text(""))
                                .str();
  Bytes grid;
  grid.add(uint32_t(packed ? 3 : 2)).add(uint32_t(0)).text(text("UniformScaleMap"));
  for (const double scale : {0.5, 0.5, 2.0, 4.0, 1.0}) {  // scale, edge, 1/scale, 1/scale^2, 1/(2 scale)
    for (int axis = 0; axis < 3; ++axis)
      grid.add(scale);
  }
  grid.add(uint32_t(1)).add(0.0f).add(uint32_t(0)).add(uint32_t(1)).zeros(12);  // one child of the root, at 0 0 0
  grid.text(node(size_t(1) << 15, {0})).text(node(size_t(1) << 12, {0, 1}));
  std::string buffers;
  for (const int first : {0, 8}) {
    std::vector<size_t> on;
    Bytes active;
    for (int x = 0; x < 5; ++x) {
      for (int y = 0; y < 7; ++y) {
        for (int z = first; z < std::min(first + 8, kDims.z); ++z) {
          on.push_back(size_t(64 * x + 8 * y + z - first));
          active.add(float(testValue(ValueType::f32, linearIndex({x, y, z}, kDims))));
        }
      }
    }
    grid.text(mask(512, on));
    buffers += mask(512, on) + Bytes().add(uint8_t(0)).str() + values(active.str());
  }
  const int64_t gridAt = int64_t(start.size()) + 24, buffersAt = gridAt + int64_t(grid.str().size());
  return start + Bytes().add(gridAt).add(buffersAt).add(buffersAt + int64_t(buffers.size())).str() + grid.str() +
         buffers;
}

std::vector<TinyFile> tinyLibraryFiles() {
  DicomSlice packed;
  packed.packed = true;
  return {
      {"dicom", "a.dcm", DicomSlice().bytes()},
      {"dicomRunLengths", "a.dcm", packed.bytes()},
      {"vdb", "a.vdb", vdb(false)},
      {"vdbZip", "a.vdb", vdb(true)},
  };
}

}  // namespace

INSTANTIATE_TEST_SUITE_P(Library, DamagedLibraryFile, testing::ValuesIn(tinyLibraryFiles()), NameOf());

}  // namespace freevoxel::test
