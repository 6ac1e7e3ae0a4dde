// A surfel moves with the cell that contains it: its weights are the shape functions at its place at rest,
// in a first-order tetrahedron its barycentric coordinates. They reproduce linear fields, in affine cells of
// second order quadratic ones, also outside, where they extrapolate: the nearest tetrahedron, or all other
// cells within the length of one, so that the surface has no steps where the nearest one changes. Their
// parts are ((2 - d) / d)^2, d being the distance from the cell in its own coordinates, along which it is
// two long (R. Franke, G. Nielson, Smooth interpolation of large sets of scattered data, Int. J. Numer.
// Meth. Engng 15, 1980).
#include "body/coupling.h"

#include <algorithm>
#include <limits>
#include <optional>

#include "core/error.h"
#include "deform/plugin.h"
#include "geometry/rest_tree.h"
#include "mesh/cells.h"

namespace dfm {
namespace {

struct RowEntry {
  uint32_t col;
  double weight;
};

// Positions relative to the first point: differences of neighbors are exact, so the weights do not depend on
// the distance from the origin of the world.
struct LocalRest {
  Array<Vec3> point, surfel;
  LocalRest(const Memory &memory, const CouplingInput &in)
      : point(in.npoint, Vec3{}, memory), surfel(in.nsurfel, Vec3{}, memory) {
    const Vec3 origin = in.npoint ? load3(in.point) : Vec3{};
    for (uint32_t i = 0; i < in.npoint; ++i) point[i] = load3(in.point + size_t{3} * i) - origin;
    for (uint32_t s = 0; s < in.nsurfel; ++s) surfel[s] = load3(in.surfel + size_t{3} * s) - origin;
  }
};

// Distances from cells are no smaller, over half of their length.
constexpr double kNearest = 1e-10;
// 64 rounding units: a weight below is zero, so that a surfel on a phyxel is that phyxel
constexpr double kNothing = 1.4e-14;

// Sorts a row by columns and adds up the entries of each, in the order in which they came.
void add_up(Array<RowEntry> &row) {
  std::ranges::stable_sort(row, {}, &RowEntry::col);
  size_t n = 0;
  for (const RowEntry &e : row)
    if (n && row[n - 1].col == e.col) row[n - 1].weight += e.weight;
    else row[n++] = e;
  row.resize(n);
  std::erase_if(row, [](const RowEntry &e) { return e.weight == 0; });
}

// The parts of all cells near a place outside; false where the nearest one does not reach it.
bool blend(const CellFinder &finder, const CouplingInput &in, Vec3 x, uint32_t nearest,
           Array<RowEntry> &out) {
  const CellKind &kind = cell_kind(in.kind);
  Vec3 at;
  double w[kMaxNodes], all = 0;
  const auto add = [&](uint32_t cell, double part) {
    for (size_t k = 0; k < kind.nodes; ++k)
      out.push_back({in.cells[kind.nodes * size_t{cell} + k], part * w[k]});
    all += part;
  };
  if (!finder.place(x, nearest, at, w)) return false;
  std::vector<uint32_t> found;
  finder.near(x, finder.length2(nearest), found);
  for (const uint32_t cell : found) {
    if (!finder.place(x, cell, at, w)) continue;
    const double d = finder.beyond(at);
    if (d < 2) add(cell, (2 - d) * (2 - d) / std::max(d * d, kNearest * kNearest));
  }
  if (!(all > 0)) {
    finder.place(x, nearest, at, w);
    add(nearest, 1);
  }
  for (RowEntry &e : out) e.weight /= all;
  add_up(out);
  return true;
}

// Appends the row of a surfel at x; returns its distance from the cells, m.
double add_cell_row(const CellFinder &finder, const CouplingInput &in, Vec3 x, Array<RowEntry> &out) {
  double away, w[kMaxNodes];
  const uint32_t tet = finder.find(x, away);
  if (in.cells && away > 0 && blend(finder, in, x, tet / cell_kind(in.kind).tets, out)) return away;
  const std::span<const uint32_t> nodes = finder.weights(x, tet, w);
  for (size_t k = 0; k < nodes.size(); ++k) out.push_back({nodes[k], w[k]});
  return away;
}

// Entries ascending by column, zeros left out, the last weight moved by the bits that the sum lacks of one.
void append_row(Coupling &out, Array<RowEntry> &row) {
  double largest = 0;
  for (const RowEntry &e : row) largest = std::max(largest, std::fabs(e.weight));
  std::erase_if(row, [&](const RowEntry &e) { return std::fabs(e.weight) <= kNothing * largest; });
  std::ranges::sort(row, {}, &RowEntry::col);
  // Summed in the order of gather_surface(); the last weight completes the sum.
  double before = 0;
  for (size_t i = 0; i + 1 < row.size(); ++i) before += row[i].weight;
  row.back().weight = 1 - before;
  for (const RowEntry &e : row) {
    out.col.push_back(e.col);
    out.weight.push_back(e.weight);
  }
  if (out.col.size() > UINT32_MAX)
    fail(DFM_E_NOMEM,
         "a coupling of more than 4294967295 weights: use barycentric, a smaller support or fewer surfels");
  out.row.push_back(static_cast<uint32_t>(out.col.size()));
}

Coupling empty_coupling(const Memory &memory, uint32_t nsurfel) {
  Coupling out{Array<uint32_t>(memory), Array<uint32_t>(memory), Array<double>(memory)};
  out.row.reserve(size_t{nsurfel} + 1);
  out.row.push_back(0);
  return out;
}

}  // namespace

Array<uint32_t> cells_of_surfels(const Memory &memory, const CouplingInput &in) {
  const CellFinder finder(memory, in);
  Array<uint32_t> out(in.nsurfel, 0u, memory);
  double away;
  for (uint32_t s = 0; s < in.nsurfel; ++s)
    out[s] = finder.find(finder.local(in.surfel + size_t{3} * s), away);
  return out;
}

Coupling couple_barycentric(const Memory &memory, const CouplingInput &in) {
  const CellFinder finder(memory, in);
  Coupling out = empty_coupling(memory, in.nsurfel);
  out.col.reserve(size_t{4} * in.nsurfel);
  out.weight.reserve(size_t{4} * in.nsurfel);
  Array<RowEntry> row(memory);
  for (uint32_t s = 0; s < in.nsurfel; ++s) {
    row.clear();
    const double far = add_cell_row(finder, in, finder.local(in.surfel + size_t{3} * s), row);
    out.outside += far > 0;
    out.farthest = std::max(out.farthest, far);
    append_row(out, row);
  }
  return out;
}

namespace {

// ---- by reach ---------------------------------------------------------------------------------------------
// A surfel takes the motion of the phyxels that reach it, each extrapolated to the surfel by its gradient
// (Zerbato 2010, (3.9), with the corrections of doc/concepts/couplings.md):
//
//   u_s = sum_i W_i (u_i + H_i (X_s - X_i)),   W_i = w(|X_s - X_i|, h_i) / sum,
//   H_i = sum_j w_ij (u_j - u_i) X_ij^T A_i^-1,   A_i = sum_j w_ij X_ij X_ij^T,   X_ij = X_j - X_i,
//   w_ij = w(|X_ij|, h_i),   w(r, h) = 315/(64 pi h^9) (h^2 - r^2)^3  (3.11)
//
// All positions are rest positions, so that this is one row of N. h_i, the support, belongs to the phyxel i.
// Every term in the sum over i extrapolates linear fields exactly, hence so does the row; without the
// gradient (Shepard, couple_thesis) only constants are.

constexpr uint32_t kNeighbors = 10;  // their mean distance is the unit of the support
// det(A / trace A) below this: the neighbors lie in a plane (1/27 for a sphere of them)
constexpr double kFlat = 1e-10;

// (3.11) without its constant factor, which cancels in every quotient; (1 - r2/h2)^3 / h^3 neither over- nor
// underflows at any scale of length.
double kernel(double r2, double h) {
  const double q = 1 - r2 / (h * h);
  return q > 0 ? q * q * q / (h * h * h) : 0;
}

struct Symmetric {
  double xx = 0, yy = 0, zz = 0, xy = 0, xz = 0, yz = 0;
  void add(double w, Vec3 a) {
    xx += w * a.x * a.x;
    yy += w * a.y * a.y;
    zz += w * a.z * a.z;
    xy += w * a.x * a.y;
    xz += w * a.x * a.z;
    yz += w * a.y * a.z;
  }
};

// The inverse, unless the vectors lie in a plane.
bool invert(const Symmetric &s, Symmetric &out) {
  const double trace = s.xx + s.yy + s.zz;
  if (!(trace > 0)) return false;
  const double f = 1 / trace;
  const double a = f * s.xx;
  const double b = f * s.yy;
  const double c = f * s.zz;
  const double d = f * s.xy;
  const double e = f * s.xz;
  const double g = f * s.yz;
  const double cxx = b * c - g * g, cxy = e * g - d * c, cxz = d * g - b * e;
  const double det = a * cxx + d * cxy + e * cxz;
  if (!(det > kFlat)) return false;
  const double scale = f / det;
  out = {scale * cxx, scale * (a * c - e * e), scale * (a * b - d * d), scale * cxy,
         scale * cxz, scale * (d * e - a * g)};
  return true;
}
Vec3 operator*(const Symmetric &s, Vec3 v) {
  return {s.xx * v.x + s.xy * v.y + s.xz * v.z, s.xy * v.x + s.yy * v.y + s.yz * v.z,
          s.xz * v.x + s.yz * v.y + s.zz * v.z};
}

class Cloud {
 public:
  Cloud(const Memory &memory, const CouplingInput &in)
      : rest(memory, in),
        support(in.npoint, 0.0, memory),
        dots_(memory, in.npoint, [&](uint32_t i) { return Extent{rest.point[i], rest.point[i]}; }),
        cubes_(memory, in.npoint, [&](uint32_t i) {
          const double h = support[i] = find_support(i, in.support);
          return Extent{rest.point[i] - Vec3{h, h, h}, rest.point[i] + Vec3{h, h, h}};
        }) {}

  LocalRest rest;
  Array<double> support;  // [npoint] h_i, m

  // Phyxels that reach x, ascending.
  void reaching(Vec3 x, Array<uint32_t> &out) const {
    out.clear();
    cubes_.holding(x, [&](uint32_t i) {
      if (norm2(x - rest.point[i]) < support[i] * support[i]) out.push_back(i);
    });
    std::sort(out.begin(), out.end());
  }
  // Other phyxels within the support of i, ascending.
  void around(uint32_t i, Array<uint32_t> &out) const {
    const double h2 = support[i] * support[i];
    dots_.near(rest.point[i], h2, [&](uint32_t j) {
      if (j != i && norm2(rest.point[j] - rest.point[i]) < h2) out.push_back(j);
    });
    std::sort(out.begin(), out.end());
  }

 private:
  RestTree dots_;   // the phyxels
  RestTree cubes_;  // their supports

  double find_support(uint32_t i, double factor) const {
    double nearest[kNeighbors], limit2 = std::numeric_limits<double>::infinity();
    uint32_t n = 0;
    dots_.near(rest.point[i], limit2, [&](uint32_t j) {
      if (j == i) return;
      const double d2 = norm2(rest.point[j] - rest.point[i]);
      if (n == kNeighbors && d2 >= limit2) return;
      uint32_t at = n < kNeighbors ? n++ : kNeighbors - 1;
      for (; at > 0 && nearest[at - 1] > d2; --at) nearest[at] = nearest[at - 1];
      nearest[at] = d2;
      if (n == kNeighbors) limit2 = nearest[kNeighbors - 1];
    });
    double sum = 0;
    for (uint32_t k = 0; k < n; ++k) sum += std::sqrt(nearest[k]);
    return n ? factor * sum / n : 0;
  }
};

// Neighborhoods of the phyxels that reach a surfel, computed at first use.
class Neighborhoods {
 public:
  Neighborhoods(const Memory &memory, const Cloud &cloud)
      : cloud_(cloud), known_(cloud.support.size(), Known{}, memory), neighbor_(memory), list_(memory) {}
  // state 0 not computed, 1 spans space, 2 flat
  struct Known {
    size_t begin = 0, end = 0;
    Symmetric inverse;
    uint8_t state = 0;
  };
  const Known &of(uint32_t i) {
    Known &k = known_[i];
    if (k.state) return k;
    list_.clear();
    cloud_.around(i, list_);
    k.begin = neighbor_.size();
    neighbor_.insert(neighbor_.end(), list_.begin(), list_.end());
    k.end = neighbor_.size();
    Symmetric a;
    for (uint32_t j : list_) {
      const Vec3 d = cloud_.rest.point[j] - cloud_.rest.point[i];
      a.add(kernel(norm2(d), cloud_.support[i]), d);
    }
    k.state = invert(a, k.inverse) ? 1 : 2;
    return k;
  }
  uint32_t operator[](size_t k) const { return neighbor_[k]; }

 private:
  const Cloud &cloud_;
  Array<Known> known_;
  Array<uint32_t> neighbor_, list_;
};

// Rounding in A^-1 of a flat neighborhood grows with its condition number: linear fields are restored in the
// row by the smallest change relative to |w_j|: w_j += |w_j| p_j . M^-1 (p_s - sum w p), p = (1, X - X_s), M
// = sum |w| p p^T.
void restore_linear(const Array<Vec3> &point, Vec3 x, Array<RowEntry> &row) {
  double extent2 = 0;
  for (const RowEntry &e : row) extent2 = std::max(extent2, norm2(point[e.col] - x));
  const double unit = extent2 > 0 ? 1 / std::sqrt(extent2) : 0;
  const auto basis = [&](uint32_t i, double p[4]) {
    p[0] = 1;
    store3(p + 1, unit * (point[i] - x));
  };
  double m[4][4] = {}, r[4] = {1, 0, 0, 0}, p[4];
  for (const RowEntry &e : row) {
    basis(e.col, p);
    for (int a = 0; a < 4; ++a) {
      r[a] -= e.weight * p[a];
      for (int b = 0; b <= a; ++b) m[a][b] += std::fabs(e.weight) * p[a] * p[b];
    }
  }
  for (int a = 0; a < 4; ++a) {  // Cholesky: m = L L^T
    for (int b = 0; b <= a; ++b) {
      double s = m[a][b];
      for (int k = 0; k < b; ++k) s -= m[a][k] * m[b][k];
      if (a == b && !(s > 1e-14 * m[0][0])) return;  // nearly flat: the row cannot be improved
      m[a][b] = a == b ? std::sqrt(s) : s / m[b][b];
    }
    for (int k = 0; k < a; ++k) r[a] -= m[a][k] * r[k];
    r[a] /= m[a][a];
  }
  for (int a = 3; a >= 0; --a) {
    for (int k = a + 1; k < 4; ++k) r[a] -= m[k][a] * r[k];
    r[a] /= m[a][a];
  }
  for (RowEntry &e : row) {
    basis(e.col, p);
    e.weight += std::fabs(e.weight) * (r[0] * p[0] + r[1] * p[1] + r[2] * p[2] + r[3] * p[3]);
  }
}

// One row for each surfel, filled by `fill`, from the phyxels that reach it and are not excluded; if there is
// none, the row of its cell.
template <class Occluded, class Fill>
Coupling couple_by_reach(const Memory &memory, const CouplingInput &in, const Cloud &cloud,
                         const Occluded &occluded, const Fill &fill) {
  std::optional<CellFinder> cells;
  Array<uint32_t> reach(memory);
  Array<RowEntry> row(memory);
  Coupling out = empty_coupling(memory, in.nsurfel);
  for (uint32_t s = 0; s < in.nsurfel; ++s) {
    const Vec3 x = cloud.rest.surfel[s];
    cloud.reaching(x, reach);
    std::erase_if(reach, occluded);
    double sum = 0;
    for (uint32_t i : reach) sum += kernel(norm2(x - cloud.rest.point[i]), cloud.support[i]);
    row.clear();
    if (sum > 0) {
      fill(x, reach, sum, row);
    } else {
      if (!cells) cells.emplace(memory, in);
      out.farthest = std::max(out.farthest, add_cell_row(*cells, in, x, row));
      ++out.outside;
    }
    append_row(out, row);
  }
  return out;
}

}  // namespace

Coupling couple_mls(const Memory &memory, const CouplingInput &in) {
  const Cloud cloud(memory, in);
  const Array<Vec3> &point = cloud.rest.point;
  Neighborhoods near(memory, cloud);
  // A phyxel whose neighbors are in a plane has no gradient: it is excluded if others reach the surfel.
  const auto occluded = [&](uint32_t i) { return near.of(i).state == 2; };
  return couple_by_reach(memory, in, cloud, occluded,
                         [&](Vec3 x, const Array<uint32_t> &reach, double sum, Array<RowEntry> &row) {
                           for (uint32_t i : reach) {
                             const Neighborhoods::Known &k = near.of(i);
                             const double share = kernel(norm2(x - point[i]), cloud.support[i]) / sum;
                             const Vec3 a = share * (k.inverse * (x - point[i]));
                             double back = 0;
                             for (size_t e = k.begin; e < k.end; ++e) {
                               const Vec3 d = point[near[e]] - point[i];
                               const double w = kernel(norm2(d), cloud.support[i]) * dot(d, a);
                               row.push_back({near[e], w});
                               back += w;
                             }
                             row.push_back({i, share - back});
                           }
                           add_up(row);
                           for (int pass = 0; pass < 2; ++pass) restore_linear(point, x, row);
                         });
}

Coupling couple_thesis(const Memory &memory, const CouplingInput &in) {
  const Cloud cloud(memory, in);
  const auto never = [](uint32_t) { return false; };
  return couple_by_reach(
      memory, in, cloud, never, [&](Vec3 x, const Array<uint32_t> &reach, double sum, Array<RowEntry> &row) {
        for (uint32_t i : reach)
          row.push_back({i, kernel(norm2(x - cloud.rest.point[i]), cloud.support[i]) / sum});
        add_up(row);
      });
}

}  // namespace dfm
