#include "tests/volume/tiny_files.h"

#include <OpenImageIO/imageio.h>
#include <gtest/gtest.h>

#include "base/error.h"
#include "tests/support/test_data.h"
#include "tests/volume/dicom_slice.h"
#include "tests/volume/volume_files.h"

namespace freevoxel::test {

namespace {

namespace oiio = OIIO;

std::string byteValues() {
  return testBytes(ValueType::u8, ByteOrder::little);
}

std::string numbersInWords() {
  std::string text;
  for (const char c : byteValues())
    text += std::to_string(int(uint8_t(c))) + "\n";
  return text;
}

std::string nifti() {
  Bytes header(ByteOrder::big);
  header.zeros(352).put<int32_t>(0, 348).put<int16_t>(70, 2).put<int16_t>(72, 8).put<float>(108, 352.0f);
  const int16_t dim[] = {3, 5, 7, 11, 1, 1, 1, 1};
  for (size_t i = 0; i < 8; ++i)
    header.put<int16_t>(40 + 2 * i, dim[i]).put<float>(76 + 4 * i, 1.0f);
  header.put<uint32_t>(344, 0x6e2b3100u).put<int16_t>(252, 1).put<int16_t>(254, 1);
  for (const size_t offset : {280, 300, 320})
    header.put<float>(offset, 1.0f);
  return header.str() + byteValues();
}

std::string numpy() {
  std::string text = "{'descr': '|u1', 'fortran_order': False, 'shape': (11, 7, 5), }";
  text.resize(118, ' ');
  return Bytes().text("\x93NUMPY").add(uint8_t(1)).add(uint8_t(0)).add(uint16_t(118)).text(text).str() + byteValues();
}

std::string vtk(const std::string& encoding) {
  return "# vtk DataFile Version 3.0\nt\n" + encoding +
         "\nDATASET STRUCTURED_POINTS\nDIMENSIONS 5 7 11\nSPACING 1 2 3\nORIGIN 0 0 0\nPOINT_DATA 385\n"
         "SCALARS s unsigned_char 1\nLOOKUP_TABLE default\n";
}

/// What OpenImageIO writes of slices of 5 x 7 pixels, each a page.
std::string image(const std::string& extension, oiio::TypeDesc type, const std::string& compression, int pages = 1) {
  // These tests fork: no thread may be left behind.
  oiio::attribute("threads", 1);
  oiio::attribute("exr_threads", -1);
  const std::string path = temporaryFolder() + "/image" + extension;
  const auto output = oiio::ImageOutput::create(path);
  oiio::ImageSpec spec(5, 7, 1, type);
  spec.attribute("compression", compression);
  for (int page = 0; page < pages; ++page) {
    EXPECT_TRUE(output->open(path, spec, page == 0 ? oiio::ImageOutput::Create : oiio::ImageOutput::AppendSubimage));
    std::vector<float> pixels;
    for (uint64_t i = 0; i < 35; ++i)
      pixels.push_back(float(testValue(ValueType::u8, uint64_t(page) * 35 + i)) / 255.0f);
    EXPECT_TRUE(output->write_image(oiio::TypeDesc::FLOAT, pixels.data()));
  }
  EXPECT_TRUE(output->close());
  return readBytes(path);
}

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

}  // namespace

std::vector<TinyFile> tinyFiles() {
  const std::string bytes = byteValues();
  const std::string nrrd = "NRRD0004\ndimension: 3\nsizes: 5 7 11\ntype: uchar\nspacings: 1 2 3\n";
  const std::string meta =
      "NDims = 3\nDimSize = 5 7 11\nElementType = MET_UCHAR\nElementSpacing = 1 2 3\nOffset = 1 2 3\n"
      "TransformMatrix = 1 0 0 0 1 0 0 0 1\nElementNumberOfChannels = 1\n";
  const std::string local = "ElementDataFile = LOCAL\n";
  return {
      {"nrrdRaw", "a.nrrd", nrrd + "encoding: raw\n\n" + bytes},
      {"nrrdGzip", "a.nrrd", nrrd + "encoding: gzip\n\n" + gzip(bytes)},
      {"nrrdText", "a.nrrd", nrrd + "encoding: ascii\n\n" + numbersInWords()},
      {"metaImageRaw", "a.mha", meta + local + bytes},
      {"metaImageZlib", "a.mha", meta + "CompressedData = True\n" + local + zlibStream(bytes)},
      {"metaImageText", "a.mha", meta + "BinaryData = False\n" + local + numbersInWords()},
      {"nifti", "a.nii", nifti()},
      {"niftiGzip", "a.nii.gz", gzip(nifti())},
      {"vtkBinary", "a.vtk", vtk("BINARY") + bytes},
      {"vtkText", "a.vtk", vtk("ASCII") + numbersInWords()},
      {"numpy", "a.npy", numpy()},
      {"numpyGzip", "a.npy.gz", gzip(numpy())},
  };
}

std::vector<TinyFile> tinyLibraryFiles() {
  DicomSlice packed;
  packed.packed = true;
  return {
      {"dicom", "a.dcm", DicomSlice().bytes()},
      {"dicomRunLengths", "a.dcm", packed.bytes()},
      {"png", "a.png", image(".png", oiio::TypeDesc::UINT8, "zip")},
      {"png16", "a.png", image(".png", oiio::TypeDesc::UINT16, "zip")},
      {"tiff", "a.tif", image(".tif", oiio::TypeDesc::UINT8, "none")},
      {"tiffZip", "a.tif", image(".tif", oiio::TypeDesc::UINT16, "zip")},
      {"tiffPages", "a.tif", image(".tif", oiio::TypeDesc::UINT8, "lzw", 3)},
      {"exr", "a.exr", image(".exr", oiio::TypeDesc::FLOAT, "none")},
      {"exrZip", "a.exr", image(".exr", oiio::TypeDesc::HALF, "zip")},
      {"vdb", "a.vdb", vdb(false)},
      {"vdbZip", "a.vdb", vdb(true)},
  };
}

}  // namespace freevoxel::test
