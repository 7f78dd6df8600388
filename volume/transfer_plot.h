// A picture of a transfer function over the values it is for.
#pragma once

#include <glm/vec2.hpp>

#include "base/image.h"
#include "volume/histogram.h"
#include "volume/transfer_function.h"

namespace freevoxel {

/// Over the function's range: bars of the histogram (logarithmic, grey), the opacity as a curve (linear, 0 to 1) filled
/// with the colours, and a strip of the colours alone; numbers under it are values. Opaque RGBA. Sizes at least
/// 200 x 120.
Image transferPlot(const TransferFunction& transfer, const Histogram& histogram, glm::ivec2 size);

}  // namespace freevoxel
