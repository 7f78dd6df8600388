#include "precompute/sweep.h"

#include <omp.h>

#include <algorithm>
#include <cstring>
#include <vector>

#include "base/error.h"
#include "base/grid.h"
#include "shaders/shared/directions.h"

namespace freevoxel {

namespace {

/// Depths along one direction, kept from plane to plane. Planes must come in order from the outside: ascending z where
/// the direction points down, descending where it points up, any order where it lies in the plane.
class DirectionSweep {
 public:
  DirectionSweep(int direction, glm::ivec3 dims)
      : step_(shared::directionX(direction), shared::directionY(direction), shared::directionZ(direction)),
        dims_(dims),
        rows_(step_.z != 0 ? dims.y : 2),
        state_(size_t(rows_) * size_t(dims.x)),
        source_(size_t(dims.x)),
        segments_(size_t(dims.x)) {}

  /// `plane` holds the codes of this z, `next` those of z + step.z, null if that lies outside.
  void sweepPlane(const SegmentDepth& segments, const uint16_t* plane, const uint16_t* next, uint8_t* out) {
    // Between planes the state is renewed in place: the row that a row reads must not have been renewed yet. Within a
    // plane it must have been, and two rows suffice.
    const bool ascending = step_.z != 0 ? step_.y >= 0 : step_.y < 0;
    for (int i = 0; i < dims_.y; ++i) {
      const int y = ascending ? i : dims_.y - 1 - i;
      const int nextY = y + step_.y;
      FixedDepth* depths = row(y);
      if (next == nullptr || nextY < 0 || nextY >= dims_.y) {
        std::fill_n(depths, dims_.x, 0);
      } else {
        sweepRow(segments, plane + offset(y), next + offset(nextY), row(nextY), depths);
      }
      attenuationCodes(depths, size_t(dims_.x), out + offset(y));
    }
  }

 private:
  size_t offset(int y) const { return size_t(y) * size_t(dims_.x); }
  FixedDepth* row(int y) { return state_.data() + offset(step_.z != 0 ? y : y & 1); }

  void sweepRow(const SegmentDepth& segments, const uint16_t* codes, const uint16_t* nextCodes,
                const FixedDepth* nextDepths, FixedDepth* depths) {
    // Voxels first..last-1 of the row have a neighbour inside the volume.
    const int first = std::max(0, -step_.x);
    const int last = dims_.x - std::max(0, step_.x);
    if (first >= last) {
      std::fill_n(depths, dims_.x, 0);
      return;
    }
    const auto count = size_t(last - first);
    segments.row({codes + first, count}, {nextCodes + first + step_.x, count}, segments_.data());
    if (step_.y == 0 && step_.z == 0) {
      sweepAlongRow(first, last, depths);
    } else {
      if (nextDepths == depths) {
        std::memcpy(source_.data(), depths, source_.size() * sizeof(FixedDepth));
        nextDepths = source_.data();
      }
      addDepths(nextDepths + first + step_.x, segments_.data(), count, depths + first);
    }
    if (step_.x < 0) depths[0] = 0;
    if (step_.x > 0) depths[dims_.x - 1] = 0;
  }

  /// The neighbour is in the same row: a running sum from its outer end.
  void sweepAlongRow(int first, int last, FixedDepth* depths) const {
    FixedDepth depth = 0;
    if (step_.x < 0) {
      for (int x = first; x < last; ++x)
        depths[x] = depth = saturatingSum(depth, segments_[size_t(x - first)]);
    } else {
      for (int x = last - 1; x >= first; --x)
        depths[x] = depth = saturatingSum(depth, segments_[size_t(x - first)]);
    }
  }

  glm::ivec3 step_;
  glm::ivec3 dims_;
  int rows_;
  std::vector<FixedDepth> state_;     ///< rows_ rows of dims.x depths
  std::vector<FixedDepth> source_;    ///< copy of a row that is renewed from itself, shifted
  std::vector<FixedDepth> segments_;  ///< of the row
};

/// One direction through the planes of one slab, from the outside inwards.
void sweepSlab(DirectionSweep& sweep, int direction, std::span<const uint16_t> codes, glm::ivec3 dims,
               const SegmentDepth& segments, int firstPlane, int planes, uint8_t* bytes) {
  const size_t planeVoxels = size_t(dims.x) * size_t(dims.y);
  const int stepZ = shared::directionZ(direction);
  for (int i = 0; i < planes; ++i) {
    const int local = sweepPass(direction) == 0 ? i : planes - 1 - i;
    const int z = firstPlane + local;
    const bool inside = z + stepZ >= 0 && z + stepZ < dims.z;
    const uint16_t* plane = codes.data() + size_t(z) * planeVoxels;
    const uint16_t* next = inside ? codes.data() + size_t(z + stepZ) * planeVoxels : nullptr;
    sweep.sweepPlane(segments, plane, next, bytes + size_t(local) * planeVoxels);
  }
}

}  // namespace

void sweepAttenuation(std::span<const uint16_t> codes, glm::ivec3 dims, const SegmentDepth& segments, int slabPlanes,
                      AttenuationSink& sink) {
  check(validDims(dims) && slabPlanes >= 1, "dims and slab are positive");
  checkEqual(uint64_t(codes.size()), voxelCount(dims), "number of codes");
  const size_t planeVoxels = size_t(dims.x) * size_t(dims.y);
  const int slabs = (dims.z + slabPlanes - 1) / slabPlanes;

  std::vector<DirectionSweep> sweeps;
  sweeps.reserve(shared::kDirectionCount);
  for (int direction = 0; direction < shared::kDirectionCount; ++direction)
    sweeps.emplace_back(direction, dims);
  const std::vector<uint8_t> slabBytes(size_t(std::min(slabPlanes, dims.z)) * planeVoxels);
  std::vector<std::vector<uint8_t>> buffers(size_t(omp_get_max_threads()), slabBytes);

  // Both passes run at once, one from each end: 26 tasks of about the same size at every step, and no step needs the
  // codes of more than two slabs.
  for (int step = 0; step < slabs; ++step) {
    const int firstPlanes[kSweepPasses] = {step * slabPlanes, (slabs - 1 - step) * slabPlanes};
#pragma omp parallel for schedule(dynamic)
    for (int direction = 0; direction < shared::kDirectionCount; ++direction) {
      uint8_t* bytes = buffers[size_t(omp_get_thread_num())].data();
      const int firstPlane = firstPlanes[sweepPass(direction)];
      const int planes = std::min(slabPlanes, dims.z - firstPlane);
      sweepSlab(sweeps[size_t(direction)], direction, codes, dims, segments, firstPlane, planes, bytes);
      sink.receive({direction, firstPlane, planes, {bytes, size_t(planes) * planeVoxels}});
    }
    for (int pass = 0; pass < kSweepPasses; ++pass)
      sink.complete(pass, firstPlanes[pass]);
  }
}

}  // namespace freevoxel
