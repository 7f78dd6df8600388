// Volumes that foreign libraries read, read in a child process (volume/child_process.h). They come back slice by slice,
// so a volume is nowhere whole but where the caller puts it.
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "volume/child_process.h"
#include "volume/read_volume.h"

namespace freevoxel {

enum class LibraryFormat : uint32_t { imageStack, dicom, vdb };

/// What a child is to read.
struct LibraryRequest {
  LibraryFormat format = LibraryFormat::imageStack;
  std::string formatName;          ///< for messages: "OpenVDB"
  std::string path;                ///< as the user named it
  std::vector<std::string> files;  ///< in order for a stack
  std::optional<std::string> component;
  std::optional<glm::dvec3> spacing;  ///< replaces the file's
  bool labels = false;
};

/// The argument that makes the program a reader of volumes.
inline constexpr const char* kReaderArgument = "--read-with-library";

/// Starts a child and waits until it has read the header. Throws InputError (what the child says, or how it ended) or
/// MachineError (it cannot be started).
std::unique_ptr<VolumeSource> openWithLibrary(const LibraryRequest& request);

/// The child: reads the request from standard input, answers, ends the process.
[[noreturn]] void runLibraryReader();

}  // namespace freevoxel
