// Bytes of a file in order, inflated on the way if need be.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

namespace freevoxel {

class ByteSource {
 public:
  virtual ~ByteSource() = default;
  /// Fills `out` and returns its size, or less at the end of the file. Throws InputError if the file cannot be read or
  /// its compression is damaged or cut off.
  virtual size_t read(std::span<std::byte> out) = 0;
  /// No more bytes than this are left: exact for plain files; deflate cannot do better than 1032 to 1.
  virtual uint64_t atMost() const = 0;
};

/// The file as it is, from byte `offset` on (the end, if that is beyond it). Throws InputError.
std::unique_ptr<ByteSource> openPlain(const std::string& path, uint64_t offset);
/// From byte `offset` on a gzip stream of any number of members, or a zlib stream, up to the end of the file: bytes
/// after the stream are an error, found when the last byte has been read and one more is asked for.
std::unique_ptr<ByteSource> openInflated(const std::string& path, uint64_t offset);

/// Whether bytes look like the start of a gzip stream.
bool isGzip(std::span<const std::byte> bytes);

}  // namespace freevoxel
