// Edges of a tetrahedron in the list of its mesh, and the pairs of points that share a cell of any kind.
#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "buffer.h"

namespace model {

constexpr int kEdgeOf[6][2] = {{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 3}, {2, 3}};

// Number of the edge between two points; edges [nedge,2] i < j, lexicographic. Throws a message if it is
// missing.
inline uint32_t find_edge(const uint32_t *edges, uint32_t nedge, uint32_t a, uint32_t b) {
  const auto key = [](uint32_t i, uint32_t j) {
    return i < j ? uint64_t(i) << 32 | j : uint64_t(j) << 32 | i;
  };
  const auto listed = [&](uint32_t e) { return key(edges[2 * size_t(e)], edges[2 * size_t(e) + 1]); };
  const uint64_t wanted = key(a, b);
  uint32_t lo = 0, hi = nedge;
  while (lo < hi) {
    const uint32_t mid = lo + (hi - lo) / 2;
    if (listed(mid) < wanted) lo = mid + 1;
    else hi = mid;
  }
  if (lo == nedge || listed(lo) != wanted) throw "a cell has an edge that the mesh's edge list lacks";
  return lo;
}

// Numbers of the edges of a cell.
inline void find_edges(const uint32_t *edges, uint32_t nedge, const uint32_t *cell, uint32_t *out) {
  for (int n = 0; n < 6; ++n) out[n] = find_edge(edges, nedge, cell[kEdgeOf[n][0]], cell[kEdgeOf[n][1]]);
}

// pair [.,2]: all pairs i < j of points of a cell, lexicographic; cells [ncell,nodes]. Returns their number.
inline uint32_t list_pairs(const dfm_host *host, const uint32_t *cells, uint32_t ncell, uint32_t nodes,
                           Buffer<uint32_t> &pair) {
  Buffer<uint64_t> key;
  key.create(host, size_t(nodes) * (nodes - 1) / 2 * ncell);
  size_t n = 0;
  for (const uint32_t *q = cells; q < cells + size_t(nodes) * ncell; q += nodes)
    for (uint32_t a = 0; a < nodes; ++a)
      for (uint32_t b = a + 1; b < nodes; ++b)
        key[n++] = uint64_t(std::min(q[a], q[b])) << 32 | std::max(q[a], q[b]);
  std::sort(key.data(), key.data() + n);
  n = size_t(std::unique(key.data(), key.data() + n) - key.data());
  pair.create(host, 2 * n);
  for (size_t p = 0; p < n; ++p) {
    pair[2 * p] = uint32_t(key[p] >> 32);
    pair[2 * p + 1] = uint32_t(key[p]);
  }
  return uint32_t(n);
}

}  // namespace model
