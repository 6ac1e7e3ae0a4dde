#include "mesh/cells.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/error.h"
#include "deform/plugin.h"
#include "math/vec3.h"
#include "mesh/faces.h"
#include "mesh/finish.h"

namespace dfm {
namespace {

constexpr uint32_t kNoPoint = UINT32_MAX;
constexpr uint8_t kMshTet10[] = {0, 1, 2, 3, 4, 5, 6, 7, 9, 8};
constexpr uint8_t kMshHex[] = {0,  1,  2,  3,  4,  5,  6,  7,  8,  11, 16, 9,  17, 10,
                               18, 19, 12, 15, 13, 14, 24, 22, 20, 21, 23, 25, 26};
// GMF: edges as ours, then the faces below, above, y low, x high, y high, x low
constexpr uint8_t kMeditHex[] = {0,  1,  2,  3,  4,  5,  6,  7,  8,  9,  10, 11, 12, 13,
                                 14, 15, 16, 17, 18, 19, 24, 25, 22, 21, 23, 20, 26};
constexpr CellKind kKinds[] = {
    {DFM_CELL_TET, 4, 1, "tetrahedra", 4, 10, "Tetrahedra", nullptr, nullptr},
    {DFM_CELL_TET10, 10, 8, "second-order tetrahedra", 11, 24, "TetrahedraP2", kMshTet10, nullptr},
    {DFM_CELL_HEX8, 8, 6, "hexahedra", 5, 12, "Hexahedra", nullptr, nullptr},
    {DFM_CELL_HEX20, 20, 22, "hexahedra of 20 points", 17, 25, nullptr, kMshHex, nullptr},
    {DFM_CELL_HEX27, 27, 48, "hexahedra of 27 points", 12, 29, "HexahedraQ2", kMshHex, kMeditHex}};
// middles of the edges 01 12 02 03 13 23 are 4 to 9
constexpr uint8_t kTets[8][4] = {{0, 4, 6, 7}, {4, 1, 5, 8}, {6, 5, 2, 9}, {7, 8, 9, 3},
                                 {6, 8, 7, 4}, {6, 8, 9, 7}, {6, 8, 5, 9}, {6, 8, 4, 5}};
using Quads = uint8_t[6][4];  // outward
constexpr Quads kQuads = {{0, 3, 2, 1}, {4, 5, 6, 7}, {0, 1, 5, 4}, {1, 2, 6, 5}, {2, 3, 7, 6}, {3, 0, 4, 7}};
// The middles of the edges of each face, and those at each corner, facing away from it.
constexpr Quads kMiddles = {{11, 10, 9, 8},  {12, 13, 14, 15}, {8, 17, 12, 16},
                            {9, 18, 13, 17}, {10, 19, 14, 18}, {11, 16, 15, 19}};
constexpr uint8_t kAtCorner[8][3] = {{8, 11, 16},  {8, 17, 9},   {10, 9, 18},  {10, 19, 11},
                                     {12, 16, 15}, {12, 13, 17}, {14, 18, 13}, {14, 15, 19}};
constexpr uint8_t kTetEdges[6][2] = {{0, 1}, {1, 2}, {0, 2}, {0, 3}, {1, 3}, {2, 3}};
constexpr uint8_t kHexEdges[12][2] = {{0, 1}, {1, 2}, {2, 3}, {3, 0}, {4, 5}, {5, 6},
                                      {6, 7}, {7, 4}, {0, 4}, {1, 5}, {2, 6}, {3, 7}};
// Coordinates of the nodes of a hexahedron, and the node at each place, the first coordinate fastest.
constexpr int8_t kPlace[27][3] = {
    {-1, -1, -1}, {1, -1, -1}, {1, 1, -1},  {-1, 1, -1}, {-1, -1, 1}, {1, -1, 1}, {1, 1, 1},
    {-1, 1, 1},   {0, -1, -1}, {1, 0, -1},  {0, 1, -1},  {-1, 0, -1}, {0, -1, 1}, {1, 0, 1},
    {0, 1, 1},    {-1, 0, 1},  {-1, -1, 0}, {1, -1, 0},  {1, 1, 0},   {-1, 1, 0}, {-1, 0, 0},
    {1, 0, 0},    {0, -1, 0},  {0, 1, 0},   {0, 0, -1},  {0, 0, 1},   {0, 0, 0}};
constexpr uint8_t kGrid[27] = {0,  8,  1,  11, 24, 9,  3, 10, 2,  16, 22, 17, 20, 26,
                               21, 19, 23, 18, 4,  12, 5, 15, 25, 13, 7,  14, 6};

// Tetrahedra from the least of the points to the quadrangles that lack it.
uint32_t *tets_from(uint32_t least, const Quads &quads, const uint32_t *cell, uint32_t *out) {
  for (const auto &quad : quads) {
    uint32_t first = 0;
    for (uint32_t k = 1; k < 4; ++k)
      if (cell[quad[k]] < cell[quad[first]]) first = k;
    if (cell[quad[first]] == least) continue;
    const auto at = [&](uint32_t k) { return cell[quad[(first + k) % 4]]; };
    for (const uint32_t node : {least, at(0), at(1), at(2), least, at(0), at(2), at(3)}) *out++ = node;
  }
  return out;
}

Vec3 place_of(uint32_t node) {
  return {double(kPlace[node][0]), double(kPlace[node][1]), double(kPlace[node][2])};
}

// Place of a node in the coordinates of its cell.
Vec3 node_place(uint32_t nodes, uint32_t node) {
  if (nodes != 10) return place_of(node);
  constexpr Vec3 kCorner[4] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  if (node < 4) return kCorner[node];
  return 0.5 * (kCorner[kTetEdges[node - 4][0]] + kCorner[kTetEdges[node - 4][1]]);
}

using Columns = std::array<Vec3, 3>;
// Derivatives of the place by the three coordinates, where the shape functions have these slopes; points
// [n,stride].
Columns columns(uint32_t nodes, const double *points, size_t stride, const uint32_t *cell,
                const Vec3 *slope) {
  Columns along;
  for (uint32_t k = 0; k < nodes; ++k) {
    const Vec3 x = load3(points + stride * cell[k]);
    along[0] += slope[k].x * x;
    along[1] += slope[k].y * x;
    along[2] += slope[k].z * x;
  }
  return along;
}

double determinant(const Columns &j) { return dot(j[0], cross(j[1], j[2])); }

double jacobian(uint32_t nodes, const double *points, size_t stride, const uint32_t *cell, Vec3 at) {
  double value[kMaxNodes];
  Vec3 slope[kMaxNodes];
  cell_shapes(nodes, at, value, slope);
  return determinant(columns(nodes, points, stride, cell, slope));
}

constexpr double kGauss = 0.57735026918962576451;  // of two points

// Slopes of the shape functions at the points of the rule.
struct RuleSlopes {
  uint32_t n = 0;
  Vec3 slope[kMaxNodes][kMaxNodes];

  explicit RuleSlopes(uint32_t nodes) {
    double value[kMaxNodes];
    const auto add = [&](Vec3 at) { cell_shapes(nodes, at, value, slope[n++]); };
    constexpr double kThird = 1.0 / 3;
    constexpr Vec3 kTet[8] = {
        {0, 0, 0},           {1, 0, 0},           {0, 1, 0},          {0, 0, 1}, {kThird, kThird, kThird},
        {0, kThird, kThird}, {kThird, 0, kThird}, {kThird, kThird, 0}};
    if (nodes == 10)
      for (const Vec3 &at : kTet) add(at);
    for (uint32_t q = 0; nodes == 8 && q < 8; ++q) add(kGauss * place_of(q));
    for (uint32_t q = 0; nodes > 10 && q < kInsidePoints; ++q) add(inside_place(q));
  }
};

const RuleSlopes &rule_slopes(uint32_t nodes) {
  static const RuleSlopes eight(8), ten(10), twenty(20), all(27);
  return nodes == 8 ? eight : nodes == 10 ? ten : nodes == 20 ? twenty : all;
}

}  // namespace

std::span<const CellKind> cell_kinds() { return kKinds; }

const CellKind &cell_kind(uint32_t kind) {
  for (const CellKind &k : kKinds)
    if (k.kind == kind) return k;
  fail(DFM_E_ARG, "%u is no kind of cell; expected one of DFM_CELL_TET, TET10, HEX8, HEX20 and HEX27", kind);
}

void tets_of(const CellKind &kind, const uint32_t *cell, uint32_t *out) {
  if (kind.nodes == 4) std::copy_n(cell, 4, out);
  if (kind.nodes == 8) tets_from(*std::min_element(cell, cell + 8), kQuads, cell, out);
  if (kind.nodes == 10)
    for (const auto &tet : kTets)
      for (const uint32_t node : tet) *out++ = cell[node];
  if (kind.nodes == 20) {
    const uint32_t least = *std::min_element(cell + 8, cell + 20);
    out = tets_from(least, kMiddles, cell, out);
    for (uint32_t k = 0; k < 8; ++k) {
      const uint32_t a = cell[kAtCorner[k][0]], b = cell[kAtCorner[k][1]], c = cell[kAtCorner[k][2]];
      for (const uint32_t node : {cell[k], a, b, c}) *out++ = node;
      if (a == least || b == least || c == least) continue;
      for (const uint32_t node : {least, a, c, b}) *out++ = node;
    }
  }
  if (kind.nodes == 27)
    for (uint32_t part = 0; part < 8; ++part) {
      uint32_t of[8];
      for (uint32_t k = 0; k < 8; ++k) {
        uint32_t at = 0;
        for (uint32_t axis = 0, step = 1; axis < 3; ++axis, step *= 3)
          at += step * ((part >> axis & 1) + (kPlace[k][axis] > 0));
        of[k] = cell[kGrid[at]];
      }
      out = tets_from(*std::min_element(of, of + 8), kQuads, of, out);
    }
}

Array<uint32_t> tets_of(const Memory &memory, const CellKind &kind, const Array<uint32_t> &cells) {
  const size_t n = cells.size() / kind.nodes;
  Array<uint32_t> out(4 * kind.tets * n, memory);
  for (size_t c = 0; c < n; ++c) tets_of(kind, &cells[kind.nodes * c], &out[4 * kind.tets * c]);
  return out;
}

void turn_over(const CellKind &kind, uint32_t *cell) {
  const auto swap = [&](std::initializer_list<std::pair<int, int>> pairs) {
    for (const auto &[i, j] : pairs) std::swap(cell[i], cell[j]);
  };
  if (kind.nodes == 10) swap({{2, 3}, {5, 8}, {6, 7}});
  else swap({{0, 4}, {1, 5}, {2, 6}, {3, 7}});
  if (kind.nodes >= 20) swap({{8, 12}, {9, 13}, {10, 14}, {11, 15}});
  if (kind.nodes == 27) swap({{24, 25}});
}

void mass_shares(const CellKind &kind, const double *points, const uint32_t *cell, double *out) {
  if (kind.nodes == 4 || kind.nodes == 10) {
    for (uint32_t k = 0; k < kind.nodes; ++k) out[k] = kind.nodes == 4 ? 0.25 : k < 4 ? 1.0 / 36 : 4.0 / 27;
    return;
  }
  constexpr double kShare[3] = {5.0 / 18, 8.0 / 18, 5.0 / 18};
  std::fill_n(out, kind.nodes, 0.0);
  double all = 0;
  const uint32_t n = kind.nodes == 8 ? 8 : 27;
  for (uint32_t q = 0; q < n; ++q) {
    const Vec3 place = kind.nodes == 8    ? kGauss * place_of(q)
                       : kind.nodes == 20 ? inside_place(q)
                                          : place_of(q);
    double weight = jacobian(kind.nodes, points, 3, cell, place), shape[kMaxNodes];
    Vec3 slope[kMaxNodes];
    if (kind.nodes == 20) weight *= kShare[q % 3] * kShare[q / 3 % 3] * kShare[q / 9];
    for (int axis = 0; kind.nodes == 27 && axis < 3; ++axis) weight *= kPlace[q][axis] ? 1 : 4;
    cell_shapes(kind.nodes, place, shape, slope);
    for (uint32_t k = 0; k < kind.nodes; ++k) {
      const double share = weight * (kind.nodes == 20 ? shape[k] * shape[k] : shape[k]);
      out[k] += share;
      if (kind.nodes == 20) all += share;
    }
    if (kind.nodes != 20) all += weight;
  }
  for (uint32_t k = 0; k < kind.nodes; ++k) out[k] /= all;
}

Vec3 inside_place(uint32_t point) {
  constexpr double kAt[3] = {-0.77459666924148337704, 0, 0.77459666924148337704};
  return {kAt[point % 3], kAt[point / 3 % 3], kAt[point / 9]};
}

void cell_shapes(uint32_t nodes, Vec3 at, double *value, Vec3 *slope) {
  if (nodes == 10) {
    constexpr Vec3 kSlope[4] = {{-1, -1, -1}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    const double part[4] = {1 - at.x - at.y - at.z, at.x, at.y, at.z};
    for (int k = 0; k < 4; ++k) {
      value[k] = part[k] * (2 * part[k] - 1);
      slope[k] = (4 * part[k] - 1) * kSlope[k];
    }
    for (int e = 0; e < 6; ++e) {
      const uint32_t a = kTetEdges[e][0], b = kTetEdges[e][1];
      value[4 + e] = 4 * part[a] * part[b];
      slope[4 + e] = 4 * part[a] * kSlope[b] + 4 * part[b] * kSlope[a];
    }
    return;
  }
  const double x[3] = {at.x, at.y, at.z};
  for (uint32_t k = 0; k < nodes; ++k) {
    double f[3], d[3], along = -2;
    int middles = 0;
    for (int c = 0; c < 3; ++c) {
      const double s = kPlace[k][c];
      const bool middle = kPlace[k][c] == 0, square = nodes == 27;
      f[c] = middle ? 1 - x[c] * x[c] : 0.5 * (1 + s * x[c]) * (square ? s * x[c] : 1);
      d[c] = middle ? -2 * x[c] : square ? x[c] + 0.5 * s : 0.5 * s;
      along += s * x[c];
      middles += middle;
    }
    value[k] = f[0] * f[1] * f[2];
    slope[k] = {d[0] * f[1] * f[2], d[1] * f[2] * f[0], d[2] * f[0] * f[1]};
    if (nodes != 20 || middles) continue;
    slope[k] = along * slope[k] + value[k] * place_of(k);
    value[k] *= along;
  }
}

double cell_quality(const CellKind &kind, const double *points, const uint32_t *cell) {
  if (kind.nodes == 4) return tet_quality(points, cell);
  double value[kMaxNodes], least = 1;
  Vec3 slope[kMaxNodes];
  for (uint32_t k = 0; k < kind.nodes; ++k) {
    cell_shapes(kind.nodes, node_place(kind.nodes, k), value, slope);
    Columns j = columns(kind.nodes, points, 3, cell, slope);
    double square = norm2(j[0]) + norm2(j[1]) + norm2(j[2]), by = 1;
    if (kind.nodes ==
        10) {  // T = J W^-1, W the edges of a regular tetrahedron of length 1, det W = sqrt(1/2)
      square = 1.5 * square - (dot(j[0], j[1]) + dot(j[1], j[2]) + dot(j[2], j[0]));
      by = std::sqrt(2.0);
    }
    const double length = std::sqrt(square / 3);
    if (!(length > 0)) return 0;
    for (Vec3 &along : j) along = (1 / length) * along;  // neither nanometers nor kilometers leave the range
    const double volume = by * determinant(j), root = std::cbrt(std::fabs(volume));
    least = std::min(least, std::copysign(root * root, volume));
  }
  return least;
}

bool inverted_cell(const CellKind &kind, const double *points, size_t stride, const uint32_t *cell) {
  const RuleSlopes &rule = rule_slopes(kind.nodes);
  for (uint32_t q = 0; q < rule.n; ++q)
    if (determinant(columns(kind.nodes, points, stride, cell, rule.slope[q])) < 0) return true;
  return false;
}

bool inverted_inside(const double *points, size_t stride, const uint32_t *cell, const double *inside) {
  Vec3 sum;
  double all = 0;
  for (uint32_t q = 0; q < kInsidePoints; ++q) {
    sum += inside[q] * inside_place(q);
    all += inside[q];
  }
  return jacobian(8, points, stride, cell, (1 / all) * sum) < 0;
}

void each_inside(const double *points, size_t stride, const uint32_t *cell, const double *inside,
                 const std::function<void(double volume, Vec3 place)> &use) {
  for (uint32_t q = 0; q < kInsidePoints; ++q) {
    const Vec3 at = inside_place(q);
    double shape[8];
    Vec3 place, slope[8];
    cell_shapes(8, at, shape, slope);
    for (uint32_t k = 0; k < 8; ++k) place += shape[k] * load3(points + stride * cell[k]);
    use(8 * inside[q] * jacobian(8, points, stride, cell, at), place);
  }
}

Array<uint32_t> RestMesh::cell_groups() const {
  Array<uint32_t> out{*memory};
  for (size_t t = 0; t < tet_group.size(); t += cell_kind(cell).tets) out.push_back(tet_group[t]);
  return out;
}

RestMesh second_order(const RestMesh &mesh) {
  const bool hexahedra = mesh.cell == DFM_CELL_HEX8;
  if (mesh.cell != DFM_CELL_TET && !hexahedra)
    fail(DFM_E_UNSUPPORTED, "only cells of first order become second-order ones; these cells are %s",
         cell_kind(mesh.cell).name);
  if (!mesh.share.empty() || !mesh.inside.empty())
    fail(DFM_E_UNSUPPORTED,
         "the cells of a filled surface are only in part material, which second-order cells cannot be; mesh "
         "the shape instead");
  const Memory &memory = *mesh.memory;
  const CellKind &kind = cell_kind(hexahedra ? DFM_CELL_HEX27 : DFM_CELL_TET10);
  const uint32_t tets = cell_kind(mesh.cell).tets;
  if (uint64_t{mesh.ntet()} / tets * kind.tets >= kMaxTets)
    fail(DFM_E_UNSUPPORTED, "the second-order cells would be more than %u tetrahedra; take fewer cells",
         kMaxTets - 1);
  RestMesh out(memory);
  out.cell = kind.kind;
  out.points = mesh.points;
  out.groups = mesh.groups;
  out.file_point = mesh.file_point;
  for (size_t t = 0; t < mesh.file_cell.size(); t += tets)
    out.file_cell.insert(out.file_cell.end(), kind.tets, mesh.file_cell[t]);
  out.warnings = mesh.warnings;
  uint32_t last = *std::max_element(out.file_point.begin(), out.file_point.end());
  // of hexahedra also one diagonal of each face and cell
  const Array<uint32_t> edges = unique_edges(mesh.tets);
  for (size_t e = 0; e < edges.size(); e += 2) {
    const auto at = [&](size_t k) { return load3(&mesh.points[3 * size_t{edges[k]}]); };
    double x[3];
    store3(x, 0.5 * (at(e) + at(e + 1)));
    out.points.insert(out.points.end(), x, x + 3);
    out.file_point.push_back(++last);
  }
  const auto middle = [&](uint32_t a, uint32_t b) {
    const uint32_t e = edge_number(edges, a, b);
    return e == kNoPoint ? kNoPoint : mesh.npoint() + e;
  };
  Array<uint8_t> of_quad(edges.size() / 2, 0, memory);  // middle of a face of four corners or of a cell
  // The middle of a face or cell, of which each corner has its opposite in `far`.
  const auto add_middle = [&](const uint32_t *cell, std::span<const uint8_t> near, const uint8_t *far) {
    size_t least = 0;
    Vec3 sum;
    for (size_t k = 0; k < near.size(); ++k) {
      if (cell[near[k]] < cell[near[least]]) least = k;
      sum += load3(&mesh.points[3 * size_t{cell[near[k]]}]);
    }
    const uint32_t at = middle(cell[near[least]], cell[far[least]]);
    store3(&out.points[3 * size_t{at}], (1 / double(near.size())) * sum);
    of_quad[at - mesh.npoint()] = 1;
    out.cells.push_back(at);
  };
  const uint32_t corners = cell_kind(mesh.cell).nodes;
  for (size_t t = 0; t < mesh.ntet(); t += tets) {
    const uint32_t *const q = &mesh.nodes()[corners * (t / tets)];
    out.cells.insert(out.cells.end(), q, q + corners);
    out.tet_group.insert(out.tet_group.end(), kind.tets, mesh.tet_group[t]);
    if (!hexahedra) {
      for (const auto &[a, b] : kTetEdges) out.cells.push_back(middle(q[a], q[b]));
      continue;
    }
    for (const auto &[a, b] : kHexEdges) out.cells.push_back(middle(q[a], q[b]));
    for (const size_t f : {5, 3, 2, 4, 0, 1}) {
      const uint8_t (&n)[4] = kQuads[f], far[] = {n[2], n[3], n[0], n[1]};
      add_middle(q, n, far);
    }
    constexpr uint8_t kNear[] = {0, 1, 2, 3, 4, 5, 6, 7}, kFar[] = {6, 7, 4, 5, 2, 3, 0, 1};
    add_middle(q, kNear, kFar);
  }
  out.tets = tets_of(memory, kind, out.cells);
  for (size_t t = 0; t < mesh.tri_group.size(); ++t) {
    const uint32_t *q = &mesh.tris[3 * t];
    const uint32_t a = middle(q[0], q[1]), b = middle(q[1], q[2]), c = middle(q[2], q[0]);
    const bool face = a != kNoPoint && b != kNoPoint && c != kNoPoint;  // a file may name other triangles
    // of hexahedra about the middle of the face, which is that of its diagonal
    const uint32_t around[6] = {q[0], a, q[1], b, q[2], c};
    if (face && hexahedra) {
      const int middle_of = of_quad[a - mesh.npoint()] ? 1 : of_quad[b - mesh.npoint()] ? 3 : 5;
      for (int k = 1; k < 5; ++k)
        out.tris.insert(out.tris.end(),
                        {around[middle_of], around[(middle_of + k) % 6], around[(middle_of + k + 1) % 6]});
    } else if (face) out.tris.insert(out.tris.end(), {q[0], a, c, a, q[1], b, c, b, q[2], a, b, c});
    else out.tris.insert(out.tris.end(), q, q + 3);
    out.tri_group.insert(out.tri_group.end(), face ? 4 : 1, mesh.tri_group[t]);
  }
  add_to_groups(out.groups, out.tet_group, out.tets);
  add_to_groups(out.groups, out.tri_group, out.tris);
  return out;
}

}  // namespace dfm
