// Chemical elements as they are usually drawn.
#pragma once

#include <string>
#include <string_view>

#include "voxlink/material.h"

namespace freevoxel {

struct Element {
  std::string_view symbol;
  float radius;   ///< van der Waals, angstrom (Bondi 1964; Mantina et al. 2009; 2 where unknown)
  uint32_t srgb;  ///< 0xrrggbb, the colours of Corey, Pauling and Koltun as Jmol has them
};

/// By symbol, whatever the case; an element of its own, pink, radius 2, if the symbol is none.
const Element& elementNamed(std::string_view symbol);

/// Whether the symbol is one in the table.
bool isElement(std::string_view symbol);

/// Named by the symbol.
Material materialOf(const Element& element);

}  // namespace freevoxel
