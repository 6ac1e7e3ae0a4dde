#include "mesh/topology_tri.h"

#include <algorithm>
#include <cmath>

#include "core/disjoint_sets.h"
#include "mesh/mesh.h"

namespace dfm {

Array<TriEdge> sorted_edges(const Memory &memory, uint32_t ntri, const uint32_t *tris) {
  Array<TriEdge> edges{memory};
  edges.reserve(3 * size_t(ntri));
  for (uint32_t h = 0; h < 3 * ntri; ++h) {
    const uint32_t a = tris[h], b = tris[next_half_edge(h)];
    edges.push_back({uint64_t(std::min(a, b)) << 32 | std::max(a, b), h});
  }
  std::sort(edges.begin(), edges.end());
  return edges;
}

Array<uint32_t> edge_twins(const Memory &memory, const Array<TriEdge> &edges) {
  Array<uint32_t> twin(edges.size(), kOpenEdge, memory);
  for (size_t i = 0, j = 0; i < edges.size(); i = j) {
    while (j < edges.size() && edges[j].key == edges[i].key) ++j;
    if (j - i == 2) {
      twin[edges[i].half] = edges[i + 1].half;
      twin[edges[i + 1].half] = edges[i].half;
    }
    for (size_t k = i; j - i > 2 && k < j; ++k) twin[edges[k].half] = kCrowdedEdge;
  }
  return twin;
}

double triangle_area(const double *points, const uint32_t *tri) {
  const auto [a, b, c] = corners_of(points, tri);
  const double l = std::sqrt(std::max({norm2(b - a), norm2(c - a), norm2(c - b)}));
  return l > 0 ? 0.5 * l * (l * norm(cross((1 / l) * (b - a), (1 / l) * (c - a)))) : 0;
}

double triangle_quality(const double *points, const uint32_t *tri) {
  const auto [a, b, c] = corners_of(points, tri);
  const double sum = norm2(b - a) + norm2(c - b) + norm2(a - c), l = std::sqrt(sum);
  return l > 0 ? 2 * std::sqrt(3.0) * norm(cross((1 / l) * (b - a), (1 / l) * (c - a))) : 0;
}

namespace {

// Boundary loops: from each end of an open edge around that point, through the triangles between, to the
// loop's next open edge.
uint32_t count_holes(const RestMesh &mesh, const Array<uint32_t> &twin) {
  Array<uint32_t> open{*mesh.memory};
  Array<uint32_t> number(twin.size(), *mesh.memory);
  for (uint32_t h = 0; h < twin.size(); ++h)
    if (twin[h] == kOpenEdge) {
      number[h] = uint32_t(open.size());
      open.push_back(h);
    }
  DisjointSets sets(*mesh.memory, uint32_t(open.size()));
  for (const uint32_t start : open)
    for (const uint32_t point : {mesh.tris[start], mesh.tris[next_half_edge(start)]}) {
      uint32_t h = start;
      do {
        // the triangle's other edge at the point
        const uint32_t next = next_half_edge(h), previous = previous_half_edge(h);
        h = mesh.tris[next] == point || mesh.tris[next_half_edge(next)] == point ? next : previous;
        if (mesh.tris[h] != point && mesh.tris[next_half_edge(h)] != point) break;
        if (twin[h] < kCrowdedEdge) h = twin[h];
        else break;
      } while (h != start);
      if (twin[h] == kOpenEdge) sets.join(number[start], number[h]);
    }
  return sets.number();
}

}  // namespace

void measure_surface(const RestMesh &mesh, dfm_mesh_info &s) {
  s.ntriangle = mesh.ntri();
  s.duplicate_points = mesh.merged_points;
  const double *points = mesh.points.data();
  Array<double> length{*mesh.memory};
  {
    const Array<TriEdge> edges = sorted_edges(*mesh.memory, s.ntriangle, mesh.tris.data());
    const Array<uint32_t> twin = edge_twins(*mesh.memory, edges);
    uint32_t disagreeing = 0;
    for (size_t i = 0; i < edges.size(); ++i) {
      const uint32_t h = edges[i].half;
      if (i > 0 && edges[i - 1].key == edges[i].key) continue;
      ++s.nedge;
      s.open_edges += twin[h] == kOpenEdge;
      s.nonmanifold_edges += twin[h] == kCrowdedEdge;
      disagreeing += twin[h] < kCrowdedEdge && mesh.tris[h] == mesh.tris[twin[h]];
      length.push_back(norm(load3(points + 3 * size_t(edges[i].key >> 32)) -
                            load3(points + 3 * size_t(uint32_t(edges[i].key)))));
    }
    s.closed = s.open_edges + s.nonmanifold_edges + disagreeing == 0;
    s.holes = count_holes(mesh, twin);
  }
  put_edges(length, s);
  s.npiece = count_pieces(*mesh.memory, s.npoint, mesh.tris, 3);
  // Volume from cones to the middle of the box: far from the origin nothing cancels.
  const Vec3 middle = 0.5 * (load3(s.lo) + load3(s.hi));
  put_qualities(s.ntriangle, s, [&](size_t t) {
    const uint32_t *tri = &mesh.tris[3 * t];
    const auto [a, b, c] = corners_of(points, tri);
    s.area += triangle_area(points, tri);
    s.volume += dot(cross(a - middle, b - middle), c - middle) / 6;
    return triangle_quality(points, tri);
  });
}

}  // namespace dfm
