#include <algorithm>
#include <cmath>
#include <utility>

#include "core/disjoint_sets.h"
#include "core/lists.h"
#include "math/extent.h"
#include "mesh/cells.h"
#include "mesh/faces.h"
#include "mesh/mesh.h"
#include "mesh/topology_tri.h"

namespace dfm {

namespace {

// Lists by their lowest point are short, so that sorting is done within them and not over all.
// key(item): the lowest point.
template <class Item, class Key>
void sort_by_lowest(Array<Item> &items, const Key &key) {
  uint32_t most = 0;
  for (const Item &f : items) most = std::max(most, key(f));
  // numbers far beyond the items would make the table larger than the work
  if (items.empty() || most > 4 * items.size() + 64) return std::sort(items.begin(), items.end());
  Array<uint32_t> begin(items.get_allocator());
  Array<Item> sorted(items.get_allocator());
  const auto each = [&](const auto &use) {
    for (const Item &f : items) use(key(f), f);
  };
  make_lists(size_t{most} + 1, each, begin, sorted);
  for (size_t p = 0; p <= most; ++p) std::sort(sorted.begin() + begin[p], sorted.begin() + begin[p + 1]);
  items.swap(sorted);
}

}  // namespace

Array<TetFace> sorted_faces(const Memory &memory, uint32_t ntet, const uint32_t *tets) {
  Array<TetFace> faces{memory};
  faces.reserve(size_t(ntet) * 4);
  for (uint32_t t = 0; t < ntet; ++t)
    for (uint32_t f = 0; f < 4; ++f) {
      uint32_t c[3];
      for (int k = 0; k < 3; ++k) c[k] = tets[size_t(t) * 4 + kTetFace[f][k]];
      uint32_t odd = 0;  // whether sorting the corners turned the face over
      const auto order = [&](int a, int b) {
        const bool turned = c[a] > c[b];
        const uint32_t low = std::min(c[a], c[b]), high = std::max(c[a], c[b]);
        c[a] = low;
        c[b] = high;
        odd ^= uint32_t(turned);
      };
      order(0, 1);
      order(1, 2);
      order(0, 1);
      faces.push_back({c[0], c[1], c[2], t * 4 + f, odd});
    }
  sort_by_lowest(faces, [](const TetFace &f) { return f.a; });
  return faces;
}

Array<uint32_t> boundary_triangles(const Memory &memory, uint32_t ntet, const uint32_t *tets) {
  return boundary_triangles(sorted_faces(memory, ntet, tets), tets);
}

Array<uint32_t> boundary_triangles(const Array<TetFace> &faces, const uint32_t *tets) {
  const HookAllocator<uint32_t> memory(faces.get_allocator());
  Array<uint32_t> owner(memory);
  for (size_t i = 0; i < faces.size();) {
    size_t j = i + 1;
    while (j < faces.size() && faces[j].same_corners(faces[i])) ++j;
    if (j == i + 1) owner.push_back(faces[i].owner);
    i = j;
  }
  std::sort(owner.begin(), owner.end());
  Array<uint32_t> triangles(memory);
  triangles.reserve(owner.size() * 3);
  for (const uint32_t face : owner)
    for (const uint32_t corner : kTetFace[face & 3])
      triangles.push_back(tets[size_t(face >> 2) * 4 + corner]);
  return triangles;
}

uint32_t edge_number(const Array<uint32_t> &edges, uint32_t a, uint32_t b) {
  const std::pair<uint32_t, uint32_t> key = std::minmax(a, b);
  const auto at = [&](size_t e) { return std::pair(edges[2 * e], edges[2 * e + 1]); };
  size_t low = 0, high = edges.size() / 2;
  while (low < high) {
    const size_t middle = (low + high) / 2;
    if (at(middle) < key) low = middle + 1;
    else high = middle;
  }
  return 2 * low < edges.size() && at(low) == key ? uint32_t(low) : UINT32_MAX;
}

Array<uint32_t> unique_edges(const Memory &memory, uint32_t ntet, const uint32_t *tets) {
  Array<uint64_t> keys{memory};
  keys.reserve(size_t(ntet) * 6);
  for (uint32_t t = 0; t < ntet; ++t)
    for (const auto &e : kTetEdge) {
      const uint32_t a = tets[size_t(t) * 4 + e[0]], b = tets[size_t(t) * 4 + e[1]];
      keys.push_back(uint64_t(std::min(a, b)) << 32 | std::max(a, b));
    }
  sort_by_lowest(keys, [](uint64_t key) { return uint32_t(key >> 32); });
  keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
  Array<uint32_t> edges{memory};
  edges.reserve(keys.size() * 2);
  for (const uint64_t key : keys) {
    edges.push_back(uint32_t(key >> 32));
    edges.push_back(uint32_t(key));
  }
  return edges;
}

uint32_t count_pieces(const Memory &memory, uint32_t npoint, const Array<uint32_t> &corners, size_t each) {
  DisjointSets sets(memory, npoint);
  for (size_t i = 0; i < corners.size(); ++i) sets.join(corners[i / each * each], corners[i]);
  return sets.number();
}

double tet_volume(const double *points, const uint32_t *tet) {
  const auto at = [&](int k) { return load3(points + 3 * size_t(tet[k])); };
  return tet_volume(at(0), at(1), at(2), at(3));
}

double tet_quality(const double *points, const uint32_t *tet) {
  double sum = 0;
  for (const auto &e : kTetEdge)
    sum += norm2(load3(points + 3 * size_t(tet[e[0]])) - load3(points + 3 * size_t(tet[e[1]])));
  // Lengths relative to the edges' mean, so that neither nanometers nor kilometers leave the
  // range of a double.
  const double length = std::sqrt(sum / 6);
  if (!(length > 0)) return 0;
  const Vec3 a = load3(points + 3 * size_t(tet[0]));
  const auto scaled = [&](int k) { return (1 / length) * (load3(points + 3 * size_t(tet[k])) - a); };
  const double volume = tet_volume(Vec3{}, scaled(1), scaled(2), scaled(3));
  const double root = std::cbrt(3 * std::fabs(volume));
  return std::copysign(2 * root * root, volume);
}

namespace {

uint32_t count_duplicate_points(const RestMesh &mesh) {
  Array<uint32_t> order(mesh.npoint(), *mesh.memory);
  for (uint32_t i = 0; i < order.size(); ++i) order[i] = i;
  const auto at = [&](uint32_t i) { return mesh.points.data() + 3 * size_t(i); };
  std::sort(order.begin(), order.end(), [&](uint32_t a, uint32_t b) {
    return std::lexicographical_compare(at(a), at(a) + 3, at(b), at(b) + 3);
  });
  uint32_t n = 0;
  for (size_t i = 1; i < order.size(); ++i) n += std::equal(at(order[i]), at(order[i]) + 3, at(order[i - 1]));
  return n;
}

uint32_t count_nonmanifold_edges(const Memory &memory, const Array<uint32_t> &triangles) {
  const Array<TriEdge> edges = sorted_edges(memory, uint32_t(triangles.size() / 3), triangles.data());
  uint32_t n = 0;
  for (size_t i = 2; i < edges.size(); ++i)  // the third triangle at an edge
    n += edges[i].key == edges[i - 2].key && (i == 2 || edges[i].key != edges[i - 3].key);
  return n;
}

// As in dfm_mesh_info. A corner's gradient is as long as its face's area over three volumes.
double wave_path(const RestMesh &mesh) {
  Array<double> volume(mesh.npoint(), 0.0, *mesh.memory);
  Array<double> stiffness(mesh.npoint(), 0.0, *mesh.memory);
  for (size_t t = 0; t < mesh.tets.size(); t += 4) {
    Vec3 x[4];
    for (size_t k = 0; k < 4; ++k) x[k] = load3(&mesh.points[3 * size_t(mesh.tets[t + k])]);
    const double v = std::fabs(tet_volume(mesh.points.data(), &mesh.tets[t]));
    double face[4], sum = 0;  // 6 v g
    for (size_t k = 0; k < 4; ++k) {
      const Vec3 &a = x[(k + 1) % 4], &b = x[(k + 2) % 4], &c = x[(k + 3) % 4];
      sum += face[k] = norm(cross(b - a, c - a));
    }
    for (size_t k = 0; k < 4; ++k) {
      volume[mesh.tets[t + k]] += v / 4;
      stiffness[mesh.tets[t + k]] += v > 0 ? face[k] * sum / (36 * v) : HUGE_VAL;
    }
  }
  double least = HUGE_VAL;
  for (uint32_t i = 0; i < mesh.npoint(); ++i)
    if (stiffness[i] > 0) least = std::min(least, volume[i] / stiffness[i]);
  return 2 * std::sqrt(least);
}

void measure_cells(const RestMesh &mesh, dfm_mesh_info &s) {
  const Memory &memory = *mesh.memory;
  s.ntet = mesh.ntet();
  s.cell = mesh.cell;
  s.ncell = s.ntet / cell_kind(mesh.cell).tets;
  s.overlapping_faces = mesh.overlapping;
  {
    const Array<uint32_t> triangles = boundary_triangles(mesh.tets);
    s.ntriangle = uint32_t(triangles.size() / 3);
    s.nonmanifold_edges = count_nonmanifold_edges(memory, triangles);
  }
  {
    const Array<uint32_t> edges = unique_edges(mesh.tets);
    s.nedge = uint32_t(edges.size() / 2);
    Array<double> length{memory};
    length.reserve(s.nedge);
    for (size_t i = 0; i < edges.size(); i += 2)
      length.push_back(
          norm(load3(&mesh.points[3 * size_t(edges[i])]) - load3(&mesh.points[3 * size_t(edges[i + 1])])));
    put_edges(length, s);
  }
  s.npiece = count_pieces(memory, s.npoint, mesh.tets, 4);
  s.duplicate_points = count_duplicate_points(mesh);
  for (size_t t = 0; t < mesh.tets.size(); t += 4) s.volume += tet_volume(mesh.points.data(), &mesh.tets[t]);
  const CellKind &kind = cell_kind(mesh.cell);
  put_qualities(s.ncell, s, [&](size_t c) {
    const double q = cell_quality(kind, mesh.points.data(), &mesh.nodes()[kind.nodes * c]);
    s.flat_cells += q < 0.01;
    return q;
  });
  s.wave_path = wave_path(mesh);
}

}  // namespace

dfm_mesh_info mesh_statistics(const RestMesh &mesh) {
  dfm_mesh_info s{};
  s.npoint = mesh.npoint();
  s.ngroup = static_cast<uint32_t>(mesh.groups.size());
  s.turned = mesh.turned;
  s.dropped_points = mesh.dropped_points;
  s.dropped_cells = mesh.dropped_cells;
  if (mesh.tets.empty() && mesh.tris.empty()) return s;
  const Extent box = extent_of(mesh.points);
  store3(s.lo, box.lo);
  store3(s.hi, box.hi);
  if (mesh.tets.empty()) measure_surface(mesh, s);
  else measure_cells(mesh, s);
  return s;
}

}  // namespace dfm
