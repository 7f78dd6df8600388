#include "voxlink/elements.h"

#include <algorithm>
#include <array>
#include <cctype>

#include "base/image.h"

namespace freevoxel {

namespace {

constexpr std::array<Element, 42> kElements{{
    {"H", 1.10f, 0xffffff},  {"D", 1.10f, 0xffffff},  {"He", 1.40f, 0xd9ffff}, {"Li", 1.81f, 0xcc80ff},
    {"Be", 1.53f, 0xc2ff00}, {"B", 1.92f, 0xffb5b5},  {"C", 1.70f, 0x909090},  {"N", 1.55f, 0x3050f8},
    {"O", 1.52f, 0xff0d0d},  {"F", 1.47f, 0x90e050},  {"Ne", 1.54f, 0xb3e3f5}, {"Na", 2.27f, 0xab5cf2},
    {"Mg", 1.73f, 0x8aff00}, {"Al", 1.84f, 0xbfa6a6}, {"Si", 2.10f, 0xf0c8a0}, {"P", 1.80f, 0xff8000},
    {"S", 1.80f, 0xffff30},  {"Cl", 1.75f, 0x1ff01f}, {"Ar", 1.88f, 0x80d1e3}, {"K", 2.75f, 0x8f40d4},
    {"Ca", 2.31f, 0x3dff00}, {"Ti", 2.00f, 0xbfc2c7}, {"Cr", 2.00f, 0x8a99c7}, {"Mn", 2.00f, 0x9c7ac7},
    {"Fe", 2.00f, 0xe06633}, {"Co", 2.00f, 0xf090a0}, {"Ni", 1.63f, 0x50d050}, {"Cu", 1.40f, 0xc88033},
    {"Zn", 1.39f, 0x7d80b0}, {"Ga", 1.87f, 0xc28f8f}, {"As", 1.85f, 0xbd80e3}, {"Se", 1.90f, 0xffa100},
    {"Br", 1.83f, 0xa62929}, {"Kr", 2.02f, 0x5cb8d1}, {"Pd", 1.63f, 0x006985}, {"Ag", 1.72f, 0xc0c0c0},
    {"Cd", 1.58f, 0xffd98f}, {"I", 1.98f, 0x940094},  {"Xe", 2.16f, 0x429eb0}, {"Pt", 1.75f, 0xd0d0e0},
    {"Au", 1.66f, 0xffd123}, {"Hg", 1.55f, 0xb8b8d0},
}};
constexpr Element kUnknown{"unknown", 2.0f, 0xff1493};

const Element* find(std::string_view symbol) {
  const auto same = [&](const Element& element) {
    return std::equal(symbol.begin(), symbol.end(), element.symbol.begin(), element.symbol.end(),
                      [](char a, char b) { return std::tolower(uint8_t(a)) == std::tolower(uint8_t(b)); });
  };
  const auto found = std::find_if(kElements.begin(), kElements.end(), same);
  return found == kElements.end() ? nullptr : &*found;
}

}  // namespace

const Element& elementNamed(std::string_view symbol) {
  const Element* found = find(symbol);
  return found == nullptr ? kUnknown : *found;
}

bool isElement(std::string_view symbol) {
  return find(symbol) != nullptr;
}

Material materialOf(const Element& element) {
  Material material;
  material.name = std::string(element.symbol);
  for (int c = 0; c < 3; ++c)
    material.linear[c] = linearFromSrgb(float(element.srgb >> (16 - 8 * c) & 0xffu) / 255.0f);
  return material;
}

}  // namespace freevoxel
