#include "mesh/cells.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "deform/plugin.h"
#include "math/vec3.h"
#include "mesh/faces.h"

namespace dfm {
namespace {

constexpr uint32_t kNoPoint = UINT32_MAX;
constexpr CellKind kKinds[] = {{DFM_CELL_TET, 4, 1, "tetrahedra", 4, 10},
                               {DFM_CELL_TET10, 10, 8, "second-order tetrahedra", 11, 24},
                               {DFM_CELL_HEX8, 8, 6, "hexahedra", 5, 12}};
// middles of the edges 01 12 02 03 13 23 are 4 to 9
constexpr uint32_t kTets[8][4] = {{0, 4, 6, 7}, {4, 1, 5, 8}, {6, 5, 2, 9}, {7, 8, 9, 3},
                                  {6, 8, 7, 4}, {6, 8, 9, 7}, {6, 8, 5, 9}, {6, 8, 4, 5}};
constexpr uint32_t kQuads[6][4] = {{0, 3, 2, 1}, {4, 5, 6, 7}, {0, 1, 5, 4},
                                   {1, 2, 6, 5}, {2, 3, 7, 6}, {3, 0, 4, 7}};  // outward

// Whether a node of a hexahedron lies on the high side of an axis.
bool high_side(uint32_t node, int axis) {
  return axis == 2 ? node >= 4 : axis == 1 ? node % 4 >= 2 : node % 4 == 1 || node % 4 == 2;
}

}  // namespace

const CellKind &cell_kind(uint32_t kind) {
  for (const CellKind &k : kKinds)
    if (k.kind == kind) return k;
  fail(DFM_E_ARG, "%u is no kind of cell; expected DFM_CELL_TET, DFM_CELL_TET10 or DFM_CELL_HEX8", kind);
}

void tets_of(const CellKind &kind, const uint32_t *cell, uint32_t *out) {
  if (kind.nodes == 4) {
    std::copy_n(cell, 4, out);
    return;
  }
  if (kind.nodes == 10) {
    for (const auto &tet : kTets)
      for (const uint32_t node : tet) *out++ = cell[node];
    return;
  }
  const uint32_t least = *std::min_element(cell, cell + 8);
  for (const auto &quad : kQuads) {
    uint32_t first = 0;
    for (uint32_t k = 1; k < 4; ++k)
      if (cell[quad[k]] < cell[quad[first]]) first = k;
    if (cell[quad[first]] == least) continue;
    const auto at = [&](uint32_t k) { return cell[quad[(first + k) % 4]]; };
    for (const uint32_t node : {least, at(0), at(1), at(2), least, at(0), at(2), at(3)}) *out++ = node;
  }
}

Array<uint32_t> tets_of(const Memory &memory, const CellKind &kind, const Array<uint32_t> &cells) {
  const size_t n = cells.size() / kind.nodes;
  Array<uint32_t> out(4 * kind.tets * n, memory);
  for (size_t c = 0; c < n; ++c) tets_of(kind, &cells[kind.nodes * c], &out[4 * kind.tets * c]);
  return out;
}

void mass_shares(const CellKind &kind, const double *points, const uint32_t *cell, double *out) {
  if (kind.nodes != 8) {
    for (uint32_t k = 0; k < kind.nodes; ++k) out[k] = kind.nodes == 4 ? 0.25 : k < 4 ? 1.0 / 36 : 4.0 / 27;
    return;
  }
  constexpr double kGauss = 0.57735026918962576451;
  std::fill_n(out, 8, 0.0);
  double all = 0;
  for (uint32_t q = 0; q < 8; ++q) {
    const auto at = [&](int axis) { return high_side(q, axis) ? kGauss : -kGauss; };
    const Vec3 place{at(0), at(1), at(2)};
    double shape[8];
    Vec3 along[3];
    hexahedron_shapes(place, shape);
    hexahedron_jacobian(points, 3, cell, place, along);
    const double weight = dot(along[0], cross(along[1], along[2]));
    all += weight;
    for (uint32_t k = 0; k < 8; ++k) out[k] += weight * shape[k];
  }
  for (uint32_t k = 0; k < 8; ++k) out[k] /= all;
}

Vec3 inside_place(uint32_t point) {
  constexpr double kAt[3] = {-0.77459666924148337704, 0, 0.77459666924148337704};
  return {kAt[point % 3], kAt[point / 3 % 3], kAt[point / 9]};
}

void hexahedron_shapes(Vec3 at, double out[8]) {
  for (uint32_t k = 0; k < 8; ++k)
    out[k] = 0.125 * (high_side(k, 0) ? 1 + at.x : 1 - at.x) * (high_side(k, 1) ? 1 + at.y : 1 - at.y) *
             (high_side(k, 2) ? 1 + at.z : 1 - at.z);
}

void hexahedron_jacobian(const double *points, size_t stride, const uint32_t *cell, Vec3 at, Vec3 along[3]) {
  Vec3 out[3];
  for (uint32_t k = 0; k < 8; ++k) {
    const Vec3 x = load3(points + stride * cell[k]);
    const double sx = high_side(k, 0) ? 1 : -1, sy = high_side(k, 1) ? 1 : -1, sz = high_side(k, 2) ? 1 : -1;
    const double px = 1 + sx * at.x, py = 1 + sy * at.y, pz = 1 + sz * at.z;
    out[0] += (0.125 * sx * py * pz) * x;
    out[1] += (0.125 * sy * pz * px) * x;
    out[2] += (0.125 * sz * px * py) * x;
  }
  std::copy_n(out, 3, along);
}

bool inverted_inside(const double *points, size_t stride, const uint32_t *cell, const double *inside) {
  Vec3 sum, along[3];
  double all = 0;
  for (uint32_t q = 0; q < kInsidePoints; ++q) {
    sum += inside[q] * inside_place(q);
    all += inside[q];
  }
  hexahedron_jacobian(points, stride, cell, (1 / all) * sum, along);
  return dot(along[0], cross(along[1], along[2])) < 0;
}

void each_inside(const double *points, size_t stride, const uint32_t *cell, const double *inside,
                 const std::function<void(double volume, Vec3 place)> &use) {
  for (uint32_t q = 0; q < kInsidePoints; ++q) {
    const Vec3 at = inside_place(q);
    double shape[8];
    hexahedron_shapes(at, shape);
    Vec3 place, along[3];
    for (uint32_t k = 0; k < 8; ++k) place += shape[k] * load3(points + stride * cell[k]);
    hexahedron_jacobian(points, stride, cell, at, along);
    use(8 * inside[q] * dot(along[0], cross(along[1], along[2])), place);
  }
}

Array<uint32_t> RestMesh::cell_groups() const {
  Array<uint32_t> out{*memory};
  for (size_t t = 0; t < tet_group.size(); t += cell_kind(cell).tets) out.push_back(tet_group[t]);
  return out;
}

RestMesh second_order(const RestMesh &mesh) {
  if (mesh.cell != DFM_CELL_TET)
    fail(DFM_E_UNSUPPORTED, "only first-order tetrahedra become second-order ones; these cells are %s",
         cell_kind(mesh.cell).name);
  if (!mesh.share.empty())
    fail(DFM_E_UNSUPPORTED,
         "the cells of a filled surface are only in part material, which second-order cells cannot be; mesh "
         "the shape instead");
  const Memory &memory = *mesh.memory;
  const CellKind &kind = cell_kind(DFM_CELL_TET10);
  RestMesh out(memory);
  out.cell = kind.kind;
  out.points = mesh.points;
  out.groups = mesh.groups;
  out.file_point = mesh.file_point;
  for (const uint32_t t : mesh.file_cell) out.file_cell.insert(out.file_cell.end(), kind.tets, t);
  out.warnings = mesh.warnings;
  uint32_t last = *std::max_element(out.file_point.begin(), out.file_point.end());
  const Array<uint32_t> edges = unique_edges(mesh.tets);
  for (size_t e = 0; e < edges.size(); e += 2) {
    const auto at = [&](size_t k) { return load3(&mesh.points[3 * size_t{edges[k]}]); };
    double x[3];
    store3(x, 0.5 * (at(e) + at(e + 1)));
    out.points.insert(out.points.end(), x, x + 3);
    out.file_point.push_back(++last);
  }
  const auto middle = [&](uint32_t a, uint32_t b) {
    const std::pair<uint32_t, uint32_t> key = std::minmax(a, b);
    size_t lo = 0, hi = edges.size() / 2;
    while (lo < hi) {
      const size_t at = (lo + hi) / 2;
      if (std::pair(edges[2 * at], edges[2 * at + 1]) < key) lo = at + 1;
      else hi = at;
    }
    const bool found = lo < edges.size() / 2 && std::pair(edges[2 * lo], edges[2 * lo + 1]) == key;
    return found ? uint32_t(mesh.npoint() + lo) : kNoPoint;
  };
  for (size_t t = 0; t < mesh.tets.size(); t += 4) {
    const uint32_t *q = &mesh.tets[t];
    out.cells.insert(out.cells.end(), q, q + 4);
    for (const auto &[a, b] : {std::pair{0, 1}, {1, 2}, {0, 2}, {0, 3}, {1, 3}, {2, 3}})
      out.cells.push_back(middle(q[a], q[b]));
    out.tet_group.insert(out.tet_group.end(), kind.tets, mesh.tet_group[t / 4]);
  }
  out.tets = tets_of(memory, kind, out.cells);
  for (size_t t = 0; t < mesh.tri_group.size(); ++t) {
    const uint32_t *q = &mesh.tris[3 * t];
    const uint32_t a = middle(q[0], q[1]), b = middle(q[1], q[2]), c = middle(q[2], q[0]);
    const bool face = a != kNoPoint && b != kNoPoint && c != kNoPoint;  // a file may name other triangles
    if (face) out.tris.insert(out.tris.end(), {q[0], a, c, a, q[1], b, c, b, q[2], a, b, c});
    else out.tris.insert(out.tris.end(), q, q + 3);
    out.tri_group.insert(out.tri_group.end(), face ? 4 : 1, mesh.tri_group[t]);
  }
  for (MeshGroup &g : out.groups) {
    if (g.dimension < 2) continue;
    const uint32_t index = uint32_t(&g - out.groups.data());
    const Array<uint32_t> &of = g.dimension == 3 ? out.tets : out.tris;
    const Array<uint32_t> &group = g.dimension == 3 ? out.tet_group : out.tri_group;
    const size_t width = g.dimension == 3 ? 4 : 3;
    for (size_t t = 0; t < group.size(); ++t)
      if (group[t] == index) g.points.insert(g.points.end(), &of[width * t], &of[width * t] + width);
    std::sort(g.points.begin(), g.points.end());
    g.points.erase(std::unique(g.points.begin(), g.points.end()), g.points.end());
  }
  return out;
}

}  // namespace dfm
