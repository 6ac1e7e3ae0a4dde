#include "mesh/cell_finder.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/lists.h"
#include "deform/plugin.h"
#include "geometry/closest.h"

namespace dfm {
namespace {

// a weight above -kInside is inside: a point on a face belongs to the cells on both sides
constexpr double kInside = 1e-10;

double distance2(Vec3 x, const Vec3 c[4]) {
  constexpr int kFace[4][3] = {{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}};
  double best = std::numeric_limits<double>::infinity();
  for (const auto &f : kFace)
    best = std::min(best, closest_on_triangle(x, c[f[0]], c[f[1]], c[f[2]]).distance2);
  return best;
}

// Refined once so that sum w c = x to rounding in cells of any shape.
void barycentric(Vec3 x, const Vec3 c[4], double w[4]) {
  const Vec3 e1 = c[1] - c[0], e2 = c[2] - c[0], e3 = c[3] - c[0];
  const Vec3 n1 = cross(e2, e3), n2 = cross(e3, e1), n3 = cross(e1, e2);
  const double inverse = 1 / dot(e1, n1);
  const Vec3 d = x - c[0];
  double a = dot(d, n1) * inverse, b = dot(d, n2) * inverse, g = dot(d, n3) * inverse;
  for (int pass = 0; pass < 2; ++pass) {
    const Vec3 r = d - (a * e1 + b * e2 + g * e3);
    a += dot(r, n1) * inverse;
    b += dot(r, n2) * inverse;
    g += dot(r, n3) * inverse;
  }
  w[0] = 1 - (a + b + g);
  w[1] = a;
  w[2] = b;
  w[3] = g;
}

}  // namespace

CellFinder::CellFinder(const Memory &memory, const CellsAtRest &in)
    : in_(in),
      kind_(cell_kind(in.cells ? in.kind : uint32_t{DFM_CELL_TET})),
      origin_(in.npoint ? load3(in.point) : Vec3{}),
      point_(in.npoint, Vec3{}, memory),
      tree_(memory, in.ntet, [&](uint32_t t) {
        Extent box;
        for (size_t k = 0; k < 4; ++k) box.add(local(in.point + size_t{3} * in.tet[size_t{4} * t + k]));
        // points accepted by kInside may be outside by that share of the cell
        const double more = 4 * kInside * box.longest();
        box.grow({more, more, more});
        return box;
      }) {
  for (uint32_t i = 0; i < in.npoint; ++i) point_[i] = local(in.point + size_t{3} * i);
}

void CellFinder::corners(uint32_t tet, Vec3 c[4]) const {
  for (int k = 0; k < 4; ++k) c[k] = point_[in_.tet[size_t{4} * tet + size_t(k)]];
}

uint32_t CellFinder::find(Vec3 x, double &away) const {
  Vec3 c[4];
  double w[4];
  uint32_t cell = UINT32_MAX;
  tree_.holding(x, [&](uint32_t t) {
    if (t >= cell) return;
    corners(t, c);
    barycentric(x, c, w);
    if (std::min({w[0], w[1], w[2], w[3]}) >= -kInside) cell = t;
  });
  double far2 = 0;
  if (cell == UINT32_MAX) {
    far2 = std::numeric_limits<double>::infinity();
    tree_.near(x, far2, [&](uint32_t t) {
      corners(t, c);
      const double d2 = distance2(x, c);
      if (d2 < far2 || (d2 == far2 && t < cell)) {
        far2 = d2;
        cell = t;
      }
    });
  }
  away = std::sqrt(far2);
  return cell;
}

void CellFinder::corner_weights(Vec3 x, uint32_t tet, double w[4]) const {
  Vec3 c[4];
  corners(tet, c);
  barycentric(x, c, w);
}

double CellFinder::length2(uint32_t cell) const {
  const uint32_t *const node = in_.cells + kind_.nodes * size_t{cell};
  const auto from_first = [&](uint32_t k) { return norm2(point_[node[k]] - point_[node[0]]); };
  return kind_.nodes == 10 ? std::max({from_first(1), from_first(2), from_first(3)}) : from_first(6);
}

double CellFinder::beyond(Vec3 at) const {
  const auto above = [](double a) { return std::max(a, 0.0); };
  if (kind_.nodes == 10) {
    const double last = above(at.x + at.y + at.z - 1);
    return 2 * std::sqrt(norm2(Vec3{above(-at.x), above(-at.y), above(-at.z)}) + last * last);
  }
  return norm(Vec3{above(std::fabs(at.x) - 1), above(std::fabs(at.y) - 1), above(std::fabs(at.z) - 1)});
}

// From the center of the cell: one step where its edges are straight and parallel.
bool CellFinder::place(Vec3 x, uint32_t cell, Vec3 &at, double *w) const {
  constexpr int kSteps = 20;
  const uint32_t *const node = in_.cells + kind_.nodes * size_t{cell};
  const Vec3 first = point_[node[0]];  // which may lie far away
  const double near2 = 1e-28 * length2(cell);
  at = kind_.nodes == 10 ? Vec3{0.25, 0.25, 0.25} : Vec3{};
  for (int step = 0; step < kSteps; ++step) {
    Vec3 left = x - first, along[3], slope[kMaxNodes];
    cell_shapes(kind_.nodes, at, w, slope);
    for (uint32_t k = 1; k < kind_.nodes; ++k) left -= w[k] * (point_[node[k]] - first);
    if (norm2(left) <= near2) return true;
    for (uint32_t k = 0; k < kind_.nodes; ++k) {
      along[0] += slope[k].x * point_[node[k]];
      along[1] += slope[k].y * point_[node[k]];
      along[2] += slope[k].z * point_[node[k]];
    }
    const Vec3 n0 = cross(along[1], along[2]), n1 = cross(along[2], along[0]), n2 = cross(along[0], along[1]);
    const double inverse = 1 / dot(along[0], n0);
    at += inverse * Vec3{dot(left, n0), dot(left, n1), dot(left, n2)};
  }
  return false;
}

std::span<const uint32_t> CellFinder::weights(Vec3 x, uint32_t tet, double *w) const {
  Vec3 at;
  if (const uint32_t cell = tet / kind_.tets; in_.cells && place(x, cell, at, w))
    return {in_.cells + kind_.nodes * size_t{cell}, kind_.nodes};
  corner_weights(x, tet, w);
  return {in_.tet + size_t{4} * tet, 4};
}

void CellFinder::near(Vec3 x, double far2, std::vector<uint32_t> &out) const {
  out.clear();
  tree_.near(x, far2, [&](uint32_t t) { out.push_back(t / kind_.tets); });
  sort_unique(out);
}

}  // namespace dfm
