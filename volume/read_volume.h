// Opening volume files.
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "volume/stored_values.h"
#include "volume/volume.h"

namespace freevoxel {

/// What the user says of a file beside its name. Of a format that describes itself only `spacing` may be set among the
/// first five; it overrides the file's.
struct VolumeOptions {
  std::optional<glm::ivec3> dims;
  std::optional<ValueType> type;
  ByteOrder byteOrder = ByteOrder::little;
  uint64_t skip = 0;  ///< bytes before the first voxel, counted after decompression
  std::optional<glm::dvec3> spacing;
  std::optional<std::string> component;  ///< name or number of one of several values per voxel
  std::optional<int> frame;              ///< number of one of several volumes: in a file, or of a pattern "a%04d.nrrd"
  bool labels = false;                   ///< sets VolumeHeader::labels; values must be whole numbers
};

/// A volume opened for reading slices in ascending z, so that a volume need not fit memory.
class VolumeSource {
 public:
  virtual ~VolumeSource() = default;
  virtual const VolumeHeader& header() const = 0;
  /// The next `count` slices into `out` (count * dims.x * dims.y * bytesPerValue bytes, this machine's byte order).
  /// Throws InputError naming the file if the payload is too short or damaged and, with the last slice, if it is longer
  /// than the header says. Sizes of files that are not compressed are compared when they are opened.
  virtual void readSlices(int count, std::span<std::byte> out) = 0;
};

/// Opens what `path` names, by content first and extension second (docs/formats.md lists the formats): a file, a folder
/// of DICOM files or images, or a pattern with %d in it. What no format recognises is a raw file, plain or gzip
/// compressed. Sizes are checked against the files before anything is allocated (a compressed file cannot hold more
/// than 1032 times its size). Files that libraries read are read in a child process (volume/child_reader.h).
/// Throws InputError, or MachineError if that process cannot be started.
std::unique_ptr<VolumeSource> openVolume(const std::string& path, const VolumeOptions& options = {});

/// The whole volume. Throws InputError, or MachineError if memory does not suffice.
Volume readVolume(const std::string& path, const VolumeOptions& options = {});

/// All slices of a source that none have been read of; `name` stands in errors. Throws as above.
Volume readAll(VolumeSource& source, const std::string& name);

/// Writes an attached NRRD, gzip encoded if `compress`; appears whole or not at all. Throws MachineError. See
/// volume/write_nrrd.h for volumes that do not fit memory.
void writeNrrd(const std::string& path, const Volume& volume, bool compress);

}  // namespace freevoxel
