// Where the values of a volume lie, as every reader of a header says it, and the one way in which they are read.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "volume/read_volume.h"
#include "volume/stored_values.h"
#include "volume/volume.h"

namespace freevoxel {

/// Each of `files` holds an equal share of the values: first `start` bytes, then `lineSkip` lines, then the stream of
/// values, in which `byteSkip` bytes (counted after inflating) come first and `bytesAfter` last.
struct Payload {
  VolumeHeader header;
  std::vector<std::string> files;  ///< in the order of their values
  uint64_t start = 0;
  uint64_t lineSkip = 0;
  uint64_t byteSkip = 0;
  /// What follows the values in each file, exactly; unset if that is none of our business.
  std::optional<uint64_t> bytesAfter = 0;
  bool atEnd = false;       ///< instead of byteSkip: the values are the last bytes of each file; not if compressed
  bool compressed = false;  ///< gzip or zlib
  bool text = false;        ///< numbers in words, of the header's type; byteSkip counts bytes, bytesAfter is not used
  bool zFastest = false;    ///< the values run through z first, then y, then x
  ByteOrder byteOrder = ByteOrder::little;
  std::optional<StoredType> stored;  ///< unset: the header's type
  Scaling scaling;                   ///< the header's type is f32 if there is one
  Interleaved interleaved;
  std::string advice;  ///< ends the message if the sizes do not fit, e.g. "; check --dims"
};

/// Sets the header's type to what is kept of `stored`, scaled.
void setStoredType(Payload& payload, StoredType stored, Scaling scaling = {});

/// Number of the volume that `frame` means among `count`; without a frame there has to be one only. `where` names file
/// and place for the error. Throws InputError.
uint64_t chooseFrame(std::optional<int> frame, uint64_t count, const std::string& where);

/// Limits the payload to volume number `chosen` of `count` that follow one another in its one stream of values, by way
/// of byteSkip and bytesAfter. Throws InputError if their sizes are absurd.
void limitToVolume(Payload& payload, uint64_t chosen, uint64_t count, const std::string& where);

/// Checks the header, that every file exists, and that its size fits (of a compressed file: that it could fit) before
/// anything is allocated. `name` is the file that errors in the header are put down to. Throws InputError.
std::unique_ptr<VolumeSource> openPayload(const std::string& name, Payload payload);

/// Throws InputError naming the file unless the header's sizes, spacing, origin and directions make sense.
void checkVolumeHeader(const std::string& name, const VolumeHeader& header);

}  // namespace freevoxel
