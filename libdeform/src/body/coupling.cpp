// A surfel moves with the tetrahedron that contains it: its barycentric coordinates at rest are its weights.
// They reproduce linear fields, also outside the cell, where they extrapolate.
#include <limits>

#include "body/coupling_rows.h"
#include "core/error.h"
#include "geometry/closest.h"

namespace dfm {
namespace {

// a weight above -kInside is inside: a point on a face belongs to the cells on both sides
constexpr double kInside = 1e-10;
// 64 rounding units: a weight below is zero, so that a surfel on a phyxel is that phyxel
constexpr double kNothing = 1.4e-14;

double cell_distance2(Vec3 x, const Vec3 c[4]) {
  constexpr int kFace[4][3] = {{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}};
  double best = std::numeric_limits<double>::infinity();
  for (const auto &f : kFace)
    best = std::min(best, closest_on_triangle(x, c[f[0]], c[f[1]], c[f[2]]).distance2);
  return best;
}

Array<RestBox> cell_boxes(const Memory &memory, const CouplingInput &in, const LocalRest &rest) {
  Array<RestBox> boxes(in.ntet, RestBox{}, HookAllocator<RestBox>(memory));
  for (uint32_t t = 0; t < in.ntet; ++t) {
    RestBox &b = boxes[t];
    b.lo = b.hi = rest.point[in.tet[size_t{4} * t]];
    for (int k = 1; k < 4; ++k) {
      const Vec3 x = rest.point[in.tet[size_t{4} * t + size_t(k)]];
      for (int a = 0; a < 3; ++a) {
        b.lo[a] = std::min(b.lo[a], x[a]);
        b.hi[a] = std::max(b.hi[a], x[a]);
      }
    }
    // points accepted by kInside may be outside by that share of the cell
    const Vec3 size = b.hi - b.lo;
    const double more = 4 * kInside * std::max({size.x, size.y, size.z});
    b.lo -= {more, more, more};
    b.hi += {more, more, more};
  }
  return boxes;
}

}  // namespace

LocalRest::LocalRest(const Memory &memory, const CouplingInput &in)
    : point(in.npoint, Vec3{}, HookAllocator<Vec3>(memory)),
      surfel(in.nsurfel, Vec3{}, HookAllocator<Vec3>(memory)) {
  const Vec3 origin = in.npoint ? load3(in.point) : Vec3{};
  for (uint32_t i = 0; i < in.npoint; ++i) point[i] = load3(in.point + size_t{3} * i) - origin;
  for (uint32_t s = 0; s < in.nsurfel; ++s) surfel[s] = load3(in.surfel + size_t{3} * s) - origin;
}

void tet_weights(Vec3 x, const Vec3 c[4], double w[4]) {
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

RestCells::RestCells(const Memory &memory, const CouplingInput &in, const LocalRest &rest)
    : in_(in), rest_(rest), box_(cell_boxes(memory, in, rest)), tree_(memory, box_) {}

uint32_t RestCells::find(Vec3 x, double *away) const {
  Vec3 c[4];
  double w[4];
  const auto corners = [&](uint32_t t) {
    for (int k = 0; k < 4; ++k) c[k] = rest_.point[in_.tet[size_t{4} * t + size_t(k)]];
  };
  uint32_t cell = UINT32_MAX;
  tree_.holding(x, [&](uint32_t t) {
    if (t >= cell) return;
    corners(t);
    tet_weights(x, c, w);
    if (std::min({w[0], w[1], w[2], w[3]}) >= -kInside) cell = t;
  });
  double far2 = 0;
  if (cell == UINT32_MAX) {
    far2 = std::numeric_limits<double>::infinity();
    tree_.near(x, far2, [&](uint32_t t) {
      corners(t);
      const double d2 = cell_distance2(x, c);
      if (d2 < far2 || (d2 == far2 && t < cell)) {
        far2 = d2;
        cell = t;
      }
    });
  }
  if (away) *away = std::sqrt(far2);
  return cell;
}

double RestCells::row(Vec3 x, RowEntry out[4]) const {
  double away;
  const uint32_t *const corner = in_.tet + size_t{4} * find(x, &away);
  Vec3 c[4];
  double w[4];
  for (int k = 0; k < 4; ++k) c[k] = rest_.point[corner[k]];
  tet_weights(x, c, w);
  for (int k = 0; k < 4; ++k) out[k] = {corner[k], w[k]};
  return away;
}

void append_row(Coupling &out, RowEntry *entries, size_t n) {
  double largest = 0;
  for (size_t i = 0; i < n; ++i) largest = std::max(largest, std::fabs(entries[i].weight));
  n = size_t(std::remove_if(entries, entries + n,
                            [&](const RowEntry &e) { return std::fabs(e.weight) <= kNothing * largest; }) -
             entries);
  std::sort(entries, entries + n, [](const RowEntry &a, const RowEntry &b) { return a.col < b.col; });
  // Summed in the order of gather_surface(); the last weight completes the sum.
  double before = 0;
  for (size_t i = 0; i + 1 < n; ++i) before += entries[i].weight;
  entries[n - 1].weight = 1 - before;
  for (size_t i = 0; i < n; ++i) {
    out.col.push_back(entries[i].col);
    out.weight.push_back(entries[i].weight);
  }
  if (out.col.size() > UINT32_MAX)
    fail(DFM_E_NOMEM,
         "a coupling of more than 4294967295 weights: use barycentric, a smaller support or fewer surfels");
  out.row.push_back(static_cast<uint32_t>(out.col.size()));
}

Coupling empty_coupling(const Memory &memory, uint32_t nsurfel) {
  Coupling out{Array<uint32_t>(HookAllocator<uint32_t>(memory)),
               Array<uint32_t>(HookAllocator<uint32_t>(memory)),
               Array<double>(HookAllocator<double>(memory))};
  out.row.reserve(size_t{nsurfel} + 1);
  out.row.push_back(0);
  return out;
}

void append_cell_row(const Memory &memory, const CouplingInput &in, const LocalRest &rest, uint32_t surfel,
                     std::optional<RestCells> &cells, Coupling &out) {
  if (!cells) cells.emplace(memory, in, rest);
  RowEntry row[4];
  out.farthest = std::max(out.farthest, cells->row(rest.surfel[surfel], row));
  ++out.outside;
  append_row(out, row, 4);
}

Coupling couple_barycentric(const Memory &memory, const CouplingInput &in) {
  const LocalRest rest(memory, in);
  const RestCells cells(memory, in, rest);
  Coupling out = empty_coupling(memory, in.nsurfel);
  out.col.reserve(size_t{4} * in.nsurfel);
  out.weight.reserve(size_t{4} * in.nsurfel);
  for (uint32_t s = 0; s < in.nsurfel; ++s) {
    RowEntry row[4];
    const double far = cells.row(rest.surfel[s], row);
    out.outside += far > 0;
    out.farthest = std::max(out.farthest, far);
    append_row(out, row, 4);
  }
  return out;
}

}  // namespace dfm
