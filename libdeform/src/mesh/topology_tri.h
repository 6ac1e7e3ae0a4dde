// The triangles at each edge. Half-edge 3 t + k runs from corner k of triangle t to its next corner.
#pragma once
#include <algorithm>
#include <array>

#include "math/vec3.h"
#include "mesh/mesh.h"

namespace dfm {

// instead of a twin: more than two triangles, one only
inline constexpr uint32_t kCrowdedEdge = UINT32_MAX - 1, kOpenEdge = UINT32_MAX;

inline uint32_t next_half_edge(uint32_t h) { return h % 3 == 2 ? h - 2 : h + 1; }
inline uint32_t previous_half_edge(uint32_t h) { return h % 3 == 0 ? h + 2 : h - 1; }

// The corners of a triangle; points [n,3].
inline std::array<Vec3, 3> corners_of(const double *points, const uint32_t *tri) {
  const auto at = [&](int k) { return load3(points + 3 * size_t(tri[k])); };
  return {at(0), at(1), at(2)};
}

struct TriEdge {
  uint64_t key;  // lower point << 32 | higher point
  uint32_t half;
  bool operator<(const TriEdge &o) const { return key != o.key ? key < o.key : half < o.half; }
};

// All half-edges, those of one edge side by side.
Array<TriEdge> sorted_edges(const Memory &memory, uint32_t ntri, const uint32_t *tris);
// [3 ntri] the half-edge of the other triangle where exactly two meet, else kOpenEdge or kCrowdedEdge.
Array<uint32_t> edge_twins(const Memory &memory, const Array<TriEdge> &edges);

// Pieces of cells of so many corners: joined by points.
uint32_t count_pieces(const Memory &memory, uint32_t npoint, const Array<uint32_t> &corners, size_t each);

// Measures of cells and of surfaces alike.
inline void put_edges(Array<double> &lengths, dfm_mesh_info &out) {
  std::sort(lengths.begin(), lengths.end());
  out.edge_min = lengths.front();
  out.edge_median = lengths[lengths.size() / 2];
  out.edge_max = lengths.back();
}
template <class Quality>
void put_qualities(size_t n, dfm_mesh_info &out, const Quality &quality) {
  out.quality_min = 1;
  for (size_t i = 0; i < n; ++i) {
    const double q = quality(i);
    out.quality_min = std::min(out.quality_min, q);
    out.quality_mean += q;
    ++out.quality_histogram[std::clamp(static_cast<int>(q * 10), 0, 9)];
  }
  out.quality_mean /= double(n);
}
// Those of a surface alone.
void measure_surface(const RestMesh &mesh, dfm_mesh_info &out);

}  // namespace dfm
