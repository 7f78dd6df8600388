// Files that foreign libraries read, read in a child process: what such a library does with a damaged file (die, hang,
// eat memory) happens there, and here it is one line (DESIGN section 11).
//
// The child is this same program started again with one hidden argument (app/main.cpp hands over to runLibraryReader),
// never a mere fork, so it does not matter what threads and what OpenGL the parent has by then. The request goes to its
// standard input, the volume comes back slice by slice through a pipe (volume/child_messages.h), so it is nowhere whole
// but where the caller puts it.
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <memory>
#include <optional>
#include <string>
#include <vector>

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

/// What a child may use. Memory is address space: this much and 16 times the size of the files, but no more than the
/// machine has.
struct ChildLimits {
  uint64_t memoryBytes = uint64_t(4) << 30;
  uint64_t memoryPerFileByte = 16;
  int processorSeconds = 600;
  int silentSeconds = 60;  ///< waiting for it without anything coming
};

/// The program that reads, and its limits; one for the process, for tests to change before they read.
struct ChildProgram {
  std::string path = "/proc/self/exe";
  ChildLimits limits;
};
ChildProgram& childProgram();

/// The argument that makes the program a reader, the only one it is given.
inline constexpr const char* kReaderArgument = "--read-with-library";

/// Starts a child and waits until it has read the header. Throws InputError (what the child says, or how it ended) or
/// MachineError (it cannot be started).
std::unique_ptr<VolumeSource> openWithLibrary(const LibraryRequest& request);

/// The child: reads the request from standard input, answers, returns the exit status.
int runLibraryReader();

}  // namespace freevoxel
