#include "voxlink/scene_buffers.h"

#include <algorithm>
#include <array>
#include <bit>

#include "base/error.h"
#include "voxlink/direction_code.h"
#include "voxlink/triangle_overlap.h"

namespace freevoxel {

namespace {

/// Something in a voxel of a brick. `key` orders what is in one voxel: kind, then material and face of a triangle,
/// number of a sphere, or volume; `reference` is the number of the triangle or sample.
struct Entry {
  uint32_t place;  ///< of the voxel in its brick: lists x fastest, then z
  uint32_t key;
  uint32_t reference;
  bool operator<(const Entry& other) const {
    return place != other.place ? place < other.place
           : key != other.key   ? key < other.key
                                : reference < other.reference;
  }
};

int bitsOf(int64_t x) {
  return int(std::bit_width(uint64_t(x < 0 ? -x : x)));
}
/// x / 2^shift rounded down; times 2^-shift for negative shifts.
int shifted(int64_t x, int shift) {
  return int(shift >= 0 ? x >> shift : x * (int64_t(1) << -shift));
}

/// One triangle in one voxel, in the small integers that are added up.
struct TrianglePart {
  int slopeU = 0, slopeV = 0, height = 0;
  glm::ivec3 normal{0};  ///< for shading; its longest component has 11 bits
};

glm::ivec3 scaledTo11Bits(glm::ivec3 v) {
  const int shift = bitsOf(std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)})) - 11;
  return {shifted(v.x, shift), shifted(v.y, shift), shifted(v.z, shift)};
}

class Voxeliser {
 public:
  Voxeliser(const SceneVoxels& scene, int edge) : scene_(scene), edge_(edge) {
    bricks_ = (scene.grid.dims + (edge - 1)) / edge;
    const size_t count = scene.mesh->triangles.size();
    usable_.resize(count);
#pragma omp parallel for schedule(static)
    for (size_t i = 0; i < count; ++i)
      usable_[i] = triangle(i).degenerate() ? 0 : 1;
  }

  uint64_t degenerate() const {
    return uint64_t(std::count(usable_.begin(), usable_.end(), uint8_t(0)));
  }
  glm::ivec3 bricks() const {
    return bricks_;
  }
  uint64_t brickOf(glm::ivec3 voxel) const {
    return linearIndex(voxel / edge_, bricks_);
  }
  uint32_t placeOf(glm::ivec3 voxel) const {
    const glm::ivec3 local = voxel % edge_;
    return uint32_t((local.y * edge_ + local.x) * edge_ + local.z);
  }

  /// Calls f(voxel, key, reference) for everything in every voxel, from several threads.
  template <class F>
  void forEach(const F& f) const {
    const Mesh& mesh = *scene_.mesh;
#pragma omp parallel for schedule(dynamic, 256)
    for (size_t i = 0; i < usable_.size(); ++i) {
      if (usable_[i] == 0) continue;
      const SnappedTriangle t = triangle(i);
      const uint32_t key = shared::kTriangles | mesh.materialOfTriangle[i] << 3 | t.face();
      t.forEachVoxel(scene_.grid.dims, [&](glm::ivec3 voxel) { f(voxel, key, uint32_t(i)); });
    }
#pragma omp parallel for schedule(dynamic, 16)
    for (size_t i = 0; i < scene_.spheres.size(); ++i) {
      const SnappedSphere sphere = snappedSphere(scene_.spheres[i]);
      const VoxelRange range = rangeOf(sphere, scene_.grid.dims);
      glm::ivec3 voxel;
      for (voxel.z = range.first.z; voxel.z <= range.last.z; ++voxel.z) {
        for (voxel.y = range.first.y; voxel.y <= range.last.y; ++voxel.y) {
          for (voxel.x = range.first.x; voxel.x <= range.last.x; ++voxel.x) {
            if (touches(sphere, voxel)) f(voxel, shared::kSphere | uint32_t(i), 0u);
          }
        }
      }
    }
#pragma omp parallel for schedule(static)
    for (size_t i = 0; i < scene_.samples.size(); ++i) {
      const VolumeSample& sample = scene_.samples[i];
      f(glm::ivec3(sample.voxel[0], sample.voxel[1], sample.voxel[2]), shared::kVolume | uint32_t(sample.volume),
        uint32_t(i));
    }
  }

  /// The fragment of entries of one voxel that share a key.
  SceneFragment fragment(glm::ivec3 voxel, const Entry* first, const Entry* end) const {
    switch (shared::fragmentKind(first->key)) {
      case shared::kSphere:
        return {first->key, 0};
      case shared::kVolume:
        return {shared::kVolume | (first->key & 0x3fffu) << 16, scene_.samples[first->reference].body};
      default:
        return merged(voxel, first, end);
    }
  }

 private:
  SnappedTriangle triangle(size_t i) const {
    const glm::uvec3 vertices = scene_.mesh->triangles[i];
    std::array<glm::ivec3, 3> places;
    for (int k = 0; k < 3; ++k)
      places[size_t(k)] = scene_.grid.snapped(scene_.mesh->positions[vertices[k]]);
    return SnappedTriangle(places);
  }

  TrianglePart part(glm::ivec3 voxel, uint32_t reference) const {
    const SnappedTriangle t = triangle(reference);
    const int axis = t.axis(), u = (axis + 1) % 3, v = (axis + 2) % 3;
    const glm::ivec3 centre = voxel * shared::kSubvoxels + shared::kSubvoxels / 2;
    const int shift = bitsOf(t.normal()[size_t(axis)]) - 15;
    glm::ivec3 normal;
    for (int k = 0; k < 3; ++k)
      normal[k] = shifted(t.normal()[size_t(k)], shift);
    TrianglePart part;
    part.slopeU = shared::slopeOf(normal[u], normal[axis]);
    part.slopeV = shared::slopeOf(normal[v], normal[axis]);
    part.height = shared::heightOf(shifted(-t.above(centre), shift), normal[axis]);
    part.normal = scaledTo11Bits(normal);
    if (scene_.mesh->normals.empty()) return part;
    // Normals of the vertices, weighed by where the voxel's centre is seen along the axis; beyond an edge, on it.
    const int64_t whole = std::abs(t.normal()[size_t(axis)]);
    const int weightShift = std::max(0, bitsOf(whole) - 15);
    const int turn = t.normal()[size_t(axis)] < 0 ? -1 : 1;
    glm::ivec3 sum(0);
    for (size_t k = 0; k < 3; ++k) {
      const glm::ivec3 a = t.vertices()[(k + 1) % 3], b = t.vertices()[(k + 2) % 3];
      const int64_t inside =
          turn * (int64_t(b[u] - a[u]) * (centre[v] - a[v]) - int64_t(b[v] - a[v]) * (centre[u] - a[u]));
      const int weight = shifted(std::clamp(inside, int64_t(0), whole), weightShift);
      sum += weight * vertexNormal(scene_.mesh->triangles[reference][int(k)]);
    }
    if (sum != glm::ivec3(0)) part.normal = scaledTo11Bits(sum);
    return part;
  }
  /// In units of 1/1024.
  glm::ivec3 vertexNormal(uint32_t vertex) const {
    const glm::vec3 n = scene_.mesh->normals[vertex];
    return {shared::snapped(n.x, 0.0f, 1024.0f), shared::snapped(n.y, 0.0f, 1024.0f),
            shared::snapped(n.z, 0.0f, 1024.0f)};
  }

  SceneFragment merged(glm::ivec3 voxel, const Entry* first, const Entry* end) const {
    int64_t slopeU = 0, slopeV = 0, height = 0;
    int64_t normal[3] = {0, 0, 0};
    for (const Entry* entry = first; entry != end; ++entry) {
      const TrianglePart p = part(voxel, entry->reference);
      slopeU += p.slopeU;
      slopeV += p.slopeV;
      height += p.height;
      for (int k = 0; k < 3; ++k)
        normal[k] += p.normal[k];
    }
    const int64_t count = end - first;
    const int u = int(slopeU / count), v = int(slopeV / count), h = int(height / count);
    int reach = 0;
    for (const Entry* entry = first; entry != end; ++entry) {
      const TrianglePart p = part(voxel, entry->reference);
      reach = std::max(reach, shared::planesApart(p.slopeU, p.slopeV, p.height, u, v, h));
    }
    const uint32_t face = first->key & 7u, material = first->key >> 3;
    const int shift = bitsOf(std::max({std::abs(normal[0]), std::abs(normal[1]), std::abs(normal[2])})) - 20;
    const glm::vec3 direction(float(shifted(normal[0], std::max(0, shift))),
                              float(shifted(normal[1], std::max(0, shift))),
                              float(shifted(normal[2], std::max(0, shift))));
    return {shared::kTriangles | material << 16 | shared::packDirection(direction.x, direction.y, direction.z),
            shared::planeOf(face, u, v, h, reach)};
  }

  const SceneVoxels& scene_;
  int edge_;
  glm::ivec3 bricks_{0};
  std::vector<uint8_t> usable_;
};

}  // namespace

SceneBuffers buildSceneBuffers(const SceneVoxels& scene, int brickEdge, uint64_t& degenerate) {
  checkBrickEdge(brickEdge);
  const Voxeliser voxeliser(scene, brickEdge);
  degenerate = voxeliser.degenerate();
  const size_t bricks = size_t(voxelCount(voxeliser.bricks()));

  // Entries, brick by brick: count, then place.
  std::vector<uint32_t> counts(bricks);
  voxeliser.forEach([&](glm::ivec3 voxel, uint32_t, uint32_t) {
    uint32_t& count = counts[voxeliser.brickOf(voxel)];
#pragma omp atomic
    ++count;
  });
  std::vector<uint64_t> starts(bricks + 1);
  for (size_t i = 0; i < bricks; ++i)
    starts[i + 1] = starts[i] + counts[i];
  if (starts[bricks] == 0) {
    throw InputError("VoxLink: nothing of the scene fills a voxel, so there is nothing to trace");
  }
  std::vector<Entry> entries(static_cast<size_t>(starts[bricks]));
  std::vector<uint32_t> cursors(bricks);
  voxeliser.forEach([&](glm::ivec3 voxel, uint32_t key, uint32_t reference) {
    const uint64_t brick = voxeliser.brickOf(voxel);
    uint32_t at = 0;
    uint32_t& cursor = cursors[brick];
#pragma omp atomic capture
    at = cursor++;
    entries[starts[brick] + at] = {voxeliser.placeOf(voxel), key, reference};
  });

  // In order; how many voxels and fragments each brick holds, and the box.
  struct Totals {
    uint64_t voxels = 0, fragments = 0;
  };
  std::vector<Totals> totals(bricks + 1);
  glm::ivec3 low = scene.grid.dims, high(0);
  const auto originOf = [&](size_t brick) {
    const glm::ivec3 size = voxeliser.bricks();
    return glm::ivec3(int(brick % size_t(size.x)), int(brick / size_t(size.x) % size_t(size.y)),
                      int(brick / (size_t(size.x) * size_t(size.y)))) *
           brickEdge;
  };
  const auto voxelAt = [&](glm::ivec3 origin, uint32_t place) {
    const int column = int(place) / brickEdge;
    return origin + glm::ivec3(column % brickEdge, column / brickEdge, int(place) % brickEdge);
  };
#pragma omp parallel
  {
    glm::ivec3 ownLow = scene.grid.dims, ownHigh(0);
#pragma omp for schedule(dynamic, 16)
    for (size_t brick = 0; brick < bricks; ++brick) {
      Entry* const first = entries.data() + starts[brick];
      Entry* const end = entries.data() + starts[brick + 1];
      std::sort(first, end);
      for (const Entry* entry = first; entry != end; ++entry) {
        const bool newVoxel = entry == first || entry->place != entry[-1].place;
        if (newVoxel) {
          ++totals[brick].voxels;
          const glm::ivec3 voxel = voxelAt(originOf(brick), entry->place);
          ownLow = glm::min(ownLow, voxel);
          ownHigh = glm::max(ownHigh, voxel + 1);
        }
        if (newVoxel || entry->key != entry[-1].key) ++totals[brick].fragments;
      }
    }
#pragma omp critical(freevoxelSceneBox)
    {
      low = glm::min(low, ownLow);
      high = glm::max(high, ownHigh);
    }
  }

  SceneBuffers buffers;
  buffers.grid = brickGrid(brickEdge, low, high);
  Totals before;
  for (Totals& brick : totals) {
    const Totals own = brick;
    brick = before;
    before.voxels += own.voxels;
    before.fragments += own.fragments;
  }
  checkFragmentCount(std::max(before.voxels, before.fragments));
  buffers.voxels.resize(size_t(before.voxels) + 1);
  buffers.voxels.back() = uint32_t(before.fragments);
  buffers.fragments.resize(size_t(before.fragments));

  const BrickGrid& grid = buffers.grid;
  const int64_t gridBricks = int64_t(grid.bricks());
  buffers.brickWords.resize(size_t(gridBricks + 31) / 32);
  std::vector<size_t> occupied;
  for (int64_t at = 0; at < gridBricks; ++at) {
    BrickWord& word = buffers.brickWords[size_t(at) >> 5];
    if ((at & 31) == 0) word = {0, uint32_t(occupied.size())};
    const size_t index = size_t(linearIndex(grid.position(uint64_t(at)), voxeliser.bricks()));
    if (starts[index] == starts[index + 1]) continue;
    word.occupied |= 1u << (at & 31);
    occupied.push_back(index);
  }
  const size_t words = size_t(shared::headerWords(brickEdge));
  buffers.brickHeaders.resize(occupied.size() * words);
#pragma omp parallel for schedule(dynamic, 16)
  for (size_t n = 0; n < occupied.size(); ++n) {
    const size_t brick = occupied[n];
    const glm::ivec3 origin = originOf(brick);
    uint32_t* const header = buffers.brickHeaders.data() + n * words;
    std::array<uint16_t, 256> masks{};
    uint64_t voxel = totals[brick].voxels, fragment = totals[brick].fragments;
    const uint32_t first = uint32_t(voxel);
    const Entry* const end = entries.data() + starts[brick + 1];
    for (const Entry* entry = entries.data() + starts[brick]; entry != end;) {
      const uint32_t place = entry->place, column = place / uint32_t(brickEdge);
      masks[column] = uint16_t(masks[column] | 1u << place % uint32_t(brickEdge));
      buffers.voxels[voxel++] = uint32_t(fragment);
      while (entry != end && entry->place == place) {
        const Entry* last = entry;
        while (last != end && last->place == place && last->key == entry->key)
          ++last;
        buffers.fragments[fragment++] = voxeliser.fragment(voxelAt(origin, place), entry, last);
        entry = last;
      }
    }
    writeHeader(header, brickEdge, first, masks.data());
  }
  return buffers;
}

}  // namespace freevoxel
