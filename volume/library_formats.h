// Which files are for the libraries of volume/child_reader.h.
#pragma once

#include <optional>
#include <string>

#include "volume/child_reader.h"

namespace freevoxel {

/// What to ask a child for, if `path` is a folder of DICOM files or images, a pattern of image files, or a file of one
/// of these kinds or of OpenVDB. Files of a stack are in the order of their numbers, which have to be evenly spaced.
/// Throws InputError for a folder that holds none of it, and for missing or mixed slices.
std::optional<LibraryRequest> libraryRequest(const std::string& path);

/// "TIFF, PNG, ...", for messages.
const char* libraryFormatNames();

}  // namespace freevoxel
