#include "tests/volume/tiny_files.h"

#include "tests/volume/volume_files.h"

namespace freevoxel::test {

namespace {

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

}  // namespace freevoxel::test
