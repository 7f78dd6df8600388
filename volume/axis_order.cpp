#include "volume/axis_order.h"

#include <cstring>

#include "base/error.h"

namespace freevoxel {

namespace {

class ReversedSource final : public VolumeSource {
 public:
  ReversedSource(std::unique_ptr<VolumeSource> source, VolumeHeader header, std::string name)
      : source_(std::move(source)), header_(std::move(header)), name_(std::move(name)) {}

  const VolumeHeader& header() const override { return header_; }

  void readSlices(int count, std::span<std::byte> out) override {
    if (source_) {
      whole_ = readAll(*source_, name_);
      source_.reset();
    }
    const size_t valueBytes = bytesPerValue(header_.type);
    const glm::ivec3 dims = header_.dims;
    check(count >= 0 && count <= dims.z - nextSlice_, "no more slices are asked for than the volume has");
    checkEqual(out.size(), size_t(count) * size_t(dims.x) * size_t(dims.y) * valueBytes, "size of the room for slices");
    std::byte* to = out.data();
    for (int z = nextSlice_; z < nextSlice_ + count; ++z) {
      for (int y = 0; y < dims.y; ++y) {
        for (int x = 0; x < dims.x; ++x, to += valueBytes) {
          std::memcpy(to, whole_.data.data() + linearIndex({z, y, x}, whole_.header.dims) * valueBytes, valueBytes);
        }
      }
    }
    nextSlice_ += count;
  }

 private:
  std::unique_ptr<VolumeSource> source_;
  VolumeHeader header_;
  std::string name_;
  Volume whole_;
  int nextSlice_ = 0;
};

}  // namespace

std::unique_ptr<VolumeSource> withAxesReversed(std::unique_ptr<VolumeSource> source, VolumeHeader header,
                                               std::string name) {
  return std::make_unique<ReversedSource>(std::move(source), std::move(header), std::move(name));
}

}  // namespace freevoxel
