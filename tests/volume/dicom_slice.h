// DICOM files put together by hand.
#pragma once

#include <fmt/core.h>

#include <glm/vec3.hpp>
#include <string>

#include "tests/volume/volume_files.h"

namespace freevoxel::test {

/// The least that makes a DICOM image of 5 x 7 pixels: explicit VR, little-endian; pixel i of slice z is 35 z + i.
struct DicomSlice {
  std::string series = "1.2.3";
  glm::dvec3 position{0.0};
  std::string orientation = "1\\0\\0\\0\\1\\0";
  std::string slope, intercept;
  std::string pixelSpacing = "0.5\\0.25";
  uint16_t columns = 5, rows = 7;
  std::string frames;
  bool packed = false;  ///< run lengths in a fragment, 8 bits
  int z = 0;

  static std::string element(uint16_t group, uint16_t number, const std::string& vr, std::string value) {
    if (value.size() % 2 == 1) value += vr == "UI" ? '\0' : ' ';
    Bytes bytes;
    bytes.add(group).add(number).text(vr);
    if (vr == "OW" || vr == "OB") {
      bytes.add(uint16_t(0)).add(uint32_t(value.size()));
    } else {
      bytes.add(uint16_t(value.size()));
    }
    return bytes.text(value).str();
  }
  static std::string number(uint16_t value) { return Bytes().add(value).str(); }

  std::string bytes() const {
    const std::string meta = element(2, 1, "OB", std::string("\0\1", 2)) +
                             element(2, 2, "UI", "1.2.840.10008.5.1.4.1.1.2") + element(2, 3, "UI", "1.2.3.4") +
                             element(2, 0x10, "UI", packed ? "1.2.840.10008.1.2.5" : "1.2.840.10008.1.2.1") +
                             element(2, 0x12, "UI", "1.2.3.5");
    std::string all = std::string(128, '\0') + "DICM" + element(2, 0, "UL", Bytes().add(uint32_t(meta.size())).str()) +
                      meta + element(8, 0x16, "UI", "1.2.840.10008.5.1.4.1.1.2") +
                      element(8, 0x18, "UI", "1.2.3.4." + std::to_string(z + 1)) + element(8, 0x60, "CS", "CT") +
                      element(0x18, 0x50, "DS", "99") + element(0x20, 0x0e, "UI", series) +
                      element(0x20, 0x32, "DS", fmt::format("{}\\{}\\{}", position.x, position.y, position.z)) +
                      element(0x20, 0x37, "DS", orientation) + element(0x28, 2, "US", number(1)) +
                      element(0x28, 4, "CS", "MONOCHROME2") + (frames.empty() ? "" : element(0x28, 8, "IS", frames)) +
                      element(0x28, 0x10, "US", number(rows)) + element(0x28, 0x11, "US", number(columns)) +
                      element(0x28, 0x30, "DS", pixelSpacing) + element(0x28, 0x100, "US", number(packed ? 8 : 16)) +
                      element(0x28, 0x101, "US", number(packed ? 8 : 12)) +
                      element(0x28, 0x102, "US", number(packed ? 7 : 11)) + element(0x28, 0x103, "US", number(0));
    if (!intercept.empty()) all += element(0x28, 0x1052, "DS", intercept) + element(0x28, 0x1053, "DS", slope);
    if (packed) return all + packedPixels();
    Bytes pixels;
    for (int i = 0; i < 35; ++i)
      pixels.add(uint16_t(z * 35 + i));
    return all + element(0x7fe0, 0x10, "OW", pixels.str());
  }

  /// An empty table of offsets, a fragment with one segment of one literal run, and the end of the sequence.
  std::string packedPixels() const {
    Bytes fragment;
    fragment.add(uint32_t(1)).add(uint32_t(64)).zeros(56).add(uint8_t(34));
    for (int i = 0; i < 35; ++i)
      fragment.add(uint8_t(z * 35 + i));
    Bytes all;
    const auto item = [&all](uint16_t number) -> Bytes& { return all.add(uint16_t(0xfffe)).add(number); };
    all.add(uint16_t(0x7fe0)).add(uint16_t(0x10)).text("OB").add(uint16_t(0)).add(UINT32_MAX);
    item(0xe000).add(uint32_t(0));
    item(0xe000).add(uint32_t(fragment.str().size())).text(fragment.str());
    item(0xe0dd).add(uint32_t(0));
    return all.str();
  }
};

}  // namespace freevoxel::test
