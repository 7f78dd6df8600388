// ParaView's colour maps: a JSON array of objects with "RGBPoints" and "Points".
#pragma once

#include "volume/json_reading.h"
#include "volume/transfer_function.h"

namespace freevoxel {

bool isParaViewColourMap(const nlohmann::json& document);

/// The first colour map of the document, over the range of its colours. Colour space RGB (others differ between the
/// points and are refused); opacities from "Points" (midpoint 0.5 and sharpness 0 only), 1 if there are none.
/// Throws InputError.
TransferFunction readParaViewColourMap(const JsonPlace& document);

}  // namespace freevoxel
