// Cells of any kind: their shape functions, and the stiffness of one at rest.
// Orders of nodes are VTK's (plugin.h).
//
// TET10: quadratic shape functions; the 8-point rule of degree 3 integrates the stiffness of a straight cell
// exactly and passes the patch test on curved ones. A mesh has about as many linear parts of the volume
// change as displacements, so near poisson 1/2 it would lock: what differs from the mean of the cell counts
// with the bulk modulus of poisson 0.4 at most (selective integration: Malkus and Hughes 1978, Mixed finite
// element methods - reduced and selective integration techniques; left out altogether, a lone cell would be a
// mechanism).
// HEX8: trilinear shape functions, 2 x 2 x 2 points, with two remedies against locking:
// - bending: three displacements that are quadratic in one coordinate each, whose gradients are taken at the
//   center and scaled by the Jacobian, so that constant stresses do no work on them (Taylor, Beresford,
//   Wilson 1976, A non-conforming element for stress analysis). They belong to the cell alone and are
//   eliminated from its stiffness.
// - poisson near 1/2: the volume change is its projection on 1, xi, eta, zeta (B-bar, Hughes 1980,
//   Generalization of selective integration procedures); the linear parts are those of bending, which the
//   quadratic displacements relieve, so that one constraint is left per cell.
// HEX20, HEX27: serendipity and triquadratic shape functions, 3 x 3 x 3 points. The same projection of the
// volume change leaves four constraints per cell, against 12 and 24 displacements of a large mesh. It changes
// nothing where displacements are quadratic and the cell a parallelepiped.
// For a hexahedron of a lattice the same integrals are over its material, by 3 x 3 x 3 points whose weights
// are given (dfm_mesh.inside): in a box they are exact for all functions that occur. The quadratic
// displacements lose their mean gradient over the material, again for constant stresses, and those that say
// nothing new on material that is thin in their direction stay zero. A share kTie of the stiffness is that of
// the whole cell, scaled by what is material: it changes nothing for uniform strains, and holds nodes far
// from the material, whose mass is of that order too.
#pragma once
#include <deform/plugin.h>

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "entry.h"
#include "material.h"
#include "small.h"
#include "tetrahedron.h"

namespace model {

// Largest singular value, or a little more: the largest eigenvalue of the symmetric m^T m is at most mean +
// sqrt(2/3) |deviator|, equal where the other two are.
inline double norm_of(const double *m) {
  double a[6];
  constexpr int kRow[6] = {0, 1, 2, 0, 1, 2}, kCol[6] = {0, 1, 2, 1, 2, 0};
  for (int n = 0; n < 6; ++n) {
    const double *x = m + kRow[n], *y = m + kCol[n];
    a[n] = (x[0] * y[0] + x[3] * y[3]) + x[6] * y[6];
  }
  const double mean = ((a[0] + a[1]) + a[2]) / 3, x = a[0] - mean, y = a[1] - mean, z = a[2] - mean;
  const double deviator2 = ((x * x + y * y) + z * z) + 2 * ((a[3] * a[3] + a[4] * a[4]) + a[5] * a[5]);
  return std::sqrt(mean + std::sqrt(deviator2 * (2.0 / 3)));
}

// Isotropic, or with an axis of unit length: then lambda and mu are those of the fiber.
struct CellMaterial {
  Lame lame;
  const Fiber *fiber = nullptr;
  const double *axis = nullptr;
};

constexpr const char *kFlatCell =
    "a cell is inverted or flat at rest; mesh the shape again with less curved cells";

// One cell at rest.
struct RestCell {
  double volume = 0;
  double mean[kMaxNodes][3] = {};                       // 1/m, mean gradients of the shape functions
  double stiffness[3 * kMaxNodes][3 * kMaxNodes] = {};  // N/m, of the first 3 nodes_of(kind) rows
};

namespace cells {

constexpr int kInner = 3;               // quadratic displacements of a HEX8
constexpr int kMax = 27, kInside = 27;  // gradients at a point, and points, are no more
static_assert(kMax >= int(kMaxNodes));
constexpr int rows_of(uint32_t kind) { return int(nodes_of(kind)) + (kind == DFM_CELL_HEX8 ? kInner : 0); }
constexpr int points_of(uint32_t kind) { return nodes_of(kind) > 10 ? 27 : 8; }  // whole cells
constexpr double kTie = 0.02;
constexpr double kThin = 1e-9;       // of the square of a function: it depends on those before it
constexpr double kSwell = 14.0 / 3;  // bulk over shear modulus, at poisson 0.4

// The strain at the points of a cell, as displacements of its nodes give it: sum d_a (x) g_a over its nodes
// and inner displacements. Weights m^3, 0: no such point.
struct RestPoints {
  double *weight = nullptr;  // [points]
  double (*g)[3] = nullptr;  // [points,rows]
};
// The inner displacements of a hexahedron, at rest under elastic stresses: component r is minus the sum of
// share[r] times all components before it.
struct RestInner { double share[3 * kInner][3 * (8 + kInner)]; };

// At one of the points of a rule.
struct Point {
  double at[3];                // reference coordinates
  double weight;               // m^3 once the Jacobian is known
  double local[kMaxNodes][3];  // derivatives of the shape functions
  double inverse[9];           // of the Jacobian
  double jacobian;
  double g[kMax][3];  // gradients, 1/m
};

constexpr int kTetEdges[6][2] = {{0, 1}, {1, 2}, {0, 2}, {0, 3}, {1, 3}, {2, 3}};

inline void tet10(int n, Point &p) {
  double b[4];  // barycentric: a corner, or the center of the face opposite to it
  for (int k = 0; k < 4; ++k) b[k] = n < 4 ? k == n : k == n - 4 ? 0 : 1.0 / 3;
  p.weight = (n < 4 ? 1.0 : 9.0) / 40 / 6;
  const double d[4][3] = {{-1, -1, -1}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  for (int c = 0; c < 3; ++c) {
    p.at[c] = b[c + 1];
    for (int k = 0; k < 4; ++k) p.local[k][c] = (4 * b[k] - 1) * d[k][c];
    for (int e = 0; e < 6; ++e) {
      const int i = kTetEdges[e][0], j = kTetEdges[e][1];
      p.local[4 + e][c] = 4 * (b[i] * d[j][c] + b[j] * d[i][c]);
    }
  }
}

// The sum over the 3 x 3 x 3 points.
inline double whole_share(int n) {
  constexpr double kShare[3] = {5.0 / 18, 8.0 / 18, 5.0 / 18};
  return kShare[n % 3] * kShare[n / 3 % 3] * kShare[n / 9];
}

inline void hexahedron(int nodes, Point &p) {
  constexpr int kAt[27][3] = {{-1, -1, -1}, {1, -1, -1}, {1, 1, -1},  {-1, 1, -1}, {-1, -1, 1}, {1, -1, 1},
                              {1, 1, 1},    {-1, 1, 1},  {0, -1, -1}, {1, 0, -1},  {0, 1, -1},  {-1, 0, -1},
                              {0, -1, 1},   {1, 0, 1},   {0, 1, 1},   {-1, 0, 1},  {-1, -1, 0}, {1, -1, 0},
                              {1, 1, 0},    {-1, 1, 0},  {-1, 0, 0},  {1, 0, 0},   {0, -1, 0},  {0, 1, 0},
                              {0, 0, -1},   {0, 0, 1},   {0, 0, 0}};
  for (int k = 0; k < nodes; ++k) {
    double f[3], d[3], along = -2;
    bool corner = true;
    for (int c = 0; c < 3; ++c) {
      const double s = kAt[k][c], x = p.at[c];
      const bool middle = kAt[k][c] == 0, square = nodes == 27;
      f[c] = middle ? 1 - x * x : 0.5 * (1 + s * x) * (square ? s * x : 1);
      d[c] = middle ? -2 * x : square ? x + 0.5 * s : 0.5 * s;
      along += s * x;
      corner &= !middle;
    }
    for (int c = 0; c < 3; ++c) {
      const int i = (c + 1) % 3, j = (c + 2) % 3;
      p.local[k][c] = d[c] * f[i] * f[j];
      if (nodes == 20 && corner) p.local[k][c] = (along * d[c] + kAt[k][c] * f[c]) * f[i] * f[j];
    }
  }
}

inline void hexahedron_place(int nodes, int n, const double *inside, Point &p) {
  constexpr double kGauss = 0.57735026918962576451, kThree = 0.77459666924148337704;
  constexpr int kHigh[8] = {0, 1, 3, 2, 4, 5, 7, 6};  // bits by axis
  const bool three = inside || nodes > 8;
  for (int c = 0, step = 1; c < 3; ++c, step *= 3)
    p.at[c] = three ? kThree * (n / step % 3 - 1) : kHigh[n] >> c & 1 ? kGauss : -kGauss;
  p.weight = inside ? 8 * inside[n] : three ? 8 * whole_share(n) : 1;
}

// The weights of a cell that is all material. Those of others may be negative, so that no potential of the
// flow at their points has a least value: such a cell flows by its mean strain, which has no more energy
// than the elastic cell.
inline bool is_whole(const double *inside) {
  for (int n = 0; n < kInside; ++n)
    if (std::fabs(inside[n] - whole_share(n)) > 1e-9) return false;
  return true;
}

// The Jacobian dx_i/dxi_j, its determinant and inverse; false if it is not positive.
inline bool jacobian_of(uint32_t nodes, const double *x, Point &p) {
  double j[9] = {};
  for (uint32_t a = 0; a < nodes; ++a)
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c) j[3 * r + c] += x[3 * a + uint32_t(r)] * p.local[a][c];
  p.jacobian = invert(j, p.inverse);
  return p.jacobian > 0;
}

// Gradient of a function with these derivatives, times by.
inline void gradient(const double *inverse, const double *local, double by, double *g) {
  for (int c = 0; c < 3; ++c)
    g[c] = by * ((local[0] * inverse[c] + local[1] * inverse[3 + c]) + local[2] * inverse[6 + c]);
}

// Projects what the rows hold at the points on 1, xi, eta, zeta, weighted by volume. Returns which of these
// say something new, as bits.
inline int project(const Point *q, int points, int rows, double (*theta)[kMax][3]) {
  double basis[kInside][4];
  int kept = 0;
  const auto inner = [&](int i, int j) {
    double sum = 0;
    for (int n = 0; n < points; ++n) sum += q[n].weight * basis[n][i] * basis[n][j];
    return sum;
  };
  for (int n = 0; n < points; ++n) {  // made orthonormal one after another
    basis[n][0] = 1;
    for (int k = 0; k < 3; ++k) basis[n][k + 1] = q[n].at[k];
  }
  for (int i = 0; i < 4; ++i) {
    const double before = inner(i, i);
    for (int j = 0; j < i; ++j) {
      const double along = inner(i, j);
      for (int n = 0; n < points; ++n) basis[n][i] -= along * basis[n][j];
    }
    const double square = inner(i, i), length = square > kThin * std::fabs(before) ? std::sqrt(square) : 0;
    kept |= (length > 0) << i;
    for (int n = 0; n < points; ++n) basis[n][i] = length > 0 ? basis[n][i] / length : 0;
  }
  for (int a = 0; a < rows; ++a)
    for (int c = 0; c < 3; ++c) {
      double part[4] = {};
      for (int n = 0; n < points; ++n)
        for (int i = 0; i < 4; ++i) part[i] += q[n].weight * basis[n][i] * theta[n][a][c];
      for (int n = 0; n < points; ++n) {
        theta[n][a][c] = 0;
        for (int i = 0; i < 4; ++i) theta[n][a][c] += basis[n][i] * part[i];
      }
    }
  return kept;
}

// Strain (material.h) of displacements with these gradients, a column for each component.
inline void strain_of(int rows, const double (*g)[3], double (*strain)[3 * kMax]) {
  for (int a = 0; a < rows; ++a)
    for (int i = 0; i < 3; ++i) {
      const int j = (i + 1) % 3;
      strain[i][3 * a + i] = strain[3 + i][3 * a + j] = g[a][i];
      strain[3 + i][3 * a + i] = g[a][j];
    }
}

// Adds the stiffness at a point with the elasticity d: the strain has the deviator of its own and the volume
// change theta.
inline void add_stiffness(const double (*d)[6], const Point &p, const double (*theta)[3], int rows,
                          double (*k)[3 * kMax]) {
  double strain[6][3 * kMax] = {};
  strain_of(rows, p.g, strain);
  for (int r = 0; r < 3 * rows; ++r)
    for (int m = 0; m < 3; ++m) strain[m][r] += (theta[r / 3][r % 3] - p.g[r / 3][r % 3]) / 3;
  for (int r = 0; r < 3 * rows; ++r) {
    double stress[6] = {};
    for (int m = 0; m < 6; ++m)
      for (int n = 0; n < 6; ++n) stress[m] += p.weight * d[m][n] * strain[n][r];
    for (int s = 0; s < 3 * rows; ++s)
      for (int m = 0; m < 6; ++m) k[r][s] += stress[m] * strain[m][s];
  }
}

// Eliminates the rows of k from n on, the last one first: each pivot is positive, or its row is zero.
template <int kSize>
inline void eliminate(double (&k)[kSize][kSize], int n, int all) {
  for (int p = all - 1; p >= n; --p)
    for (int i = 0; i < p && k[p][p] > 0; ++i) {
      const double share = k[i][p] / k[p][p];
      for (int j = 0; j < p; ++j) k[i][j] -= share * k[p][j];
    }
}

}  // namespace cells

// Strain and stress are constant in a first-order tetrahedron: one point.
inline bool make_rest_tetrahedron(const double *x, const Lame &m, RestCell &out) {
  Tetrahedron t;
  if (!make_tetrahedron(x, x + 3, x + 6, x + 9, t) || !(t.volume > 0)) return false;
  out.volume = t.volume;
  for (int a = 0; a < 4; ++a) std::copy_n(t.g[a], 3, out.mean[a]);
  for (int a = 0; a < 4; ++a)
    for (int b = 0; b < 4; ++b) {
      double across = 0;
      for (int k = 0; k < 3; ++k) across += t.g[a][k] * t.g[b][k];
      for (int r = 0; r < 3; ++r)
        for (int s = 0; s < 3; ++s)
          out.stiffness[3 * a + r][3 * b + s] =
              t.volume * ((m.lambda * t.g[a][r] * t.g[b][s] + m.mu * t.g[b][r] * t.g[a][s]) +
                          (r == s ? m.mu * across : 0));
    }
  return true;
}

// x [nodes,3] m; inside [27] or null. at_points may be empty, and is for cells that are no first-order
// tetrahedra; with it HEX8 need inner. False if the Jacobian is not positive at a point: the cell is
// inverted or flat there.
inline bool make_rest_cell(uint32_t kind, const double *x, const double *inside, const CellMaterial &material,
                           RestCell &out, const cells::RestPoints &at_points = {},
                           cells::RestInner *inner = nullptr) {
  using namespace cells;
  const Lame &m = material.lame;
  if (kind == DFM_CELL_TET) return make_rest_tetrahedron(x, m, out);
  const int nodes = int(nodes_of(kind)), rows = rows_of(kind), points = inside ? kInside : points_of(kind);
  const bool hex = kind != DFM_CELL_TET10, inner_rows = rows > nodes;
  const auto look = [&](int n, Point &p) {
    hex ? hexahedron_place(nodes, n, inside, p) : tet10(n, p);
    if (hex) hexahedron(nodes, p);
    return jacobian_of(uint32_t(nodes), x, p);
  };
  Point q[kInside], center{};
  if (inner_rows) hexahedron(nodes, center);
  if (inner_rows && !jacobian_of(uint32_t(nodes), x, center)) return false;
  out = RestCell();
  double spurious[kInner][3] = {};  // m^2, integrals of the quadratic displacements' gradients
  for (int n = 0; n < points; ++n) {
    if (!look(n, q[n])) return false;
    q[n].weight *= q[n].jacobian;
    for (int a = 0; a < nodes; ++a) gradient(q[n].inverse, q[n].local[a], 1, q[n].g[a]);
    for (int k = 0; inner_rows && k < kInner; ++k) {
      double local[3] = {};
      local[k] = q[n].at[k];
      gradient(center.inverse, local, center.jacobian / q[n].jacobian, q[n].g[nodes + k]);
      for (int c = 0; c < 3; ++c) spurious[k][c] += q[n].weight * q[n].g[nodes + k][c];
    }
    out.volume += q[n].weight;
    for (int a = 0; a < nodes; ++a)
      for (int c = 0; c < 3; ++c) out.mean[a][c] += q[n].weight * q[n].g[a][c];
  }
  for (int a = 0; a < nodes; ++a)
    for (double &g : out.mean[a]) g /= out.volume;
  for (int n = 0; inside && n < points; ++n)
    for (int k = 0; k < kInner; ++k)
      for (int c = 0; c < 3; ++c) q[n].g[nodes + k][c] -= spurious[k][c] / out.volume;
  double theta[kInside][kMax][3];
  for (int n = 0; n < points; ++n) std::copy_n(&q[n].g[0][0], 3 * rows, &theta[n][0][0]);
  const int kept = hex ? project(q, points, rows, theta) : 0;
  for (int n = 0; n < points; ++n)
    for (int k = 0; inner_rows && k < kInner; ++k)
      for (int c = 0; c < 3 && !(kept >> (k + 1) & 1); ++c) q[n].g[nodes + k][c] = theta[n][nodes + k][c] = 0;
  // 2 mu deviator : deviator + bulk theta^2
  const double bulk = m.lambda + 2 * m.mu / 3;
  if (const double by = std::sqrt(kSwell * m.mu / bulk); !hex && by < 1)
    for (int n = 0; n < points; ++n)
      for (int a = 0; a < nodes; ++a)
        for (int c = 0; c < 3; ++c) theta[n][a][c] = out.mean[a][c] + by * (theta[n][a][c] - out.mean[a][c]);
  double k[3 * kMax][3 * kMax] = {}, d[6][6];
  if (material.fiber) elasticity_matrix(*material.fiber, material.axis, d);
  for (int n = 0; material.fiber && n < points; ++n) add_stiffness(d, q[n], theta[n], rows, k);
  for (int n = 0; !material.fiber && n < points; ++n)
    for (int a = 0; a < rows; ++a)
      for (int b = 0; b < rows; ++b) {
        const double *ga = q[n].g[a], *gb = q[n].g[b], *ta = theta[n][a], *tb = theta[n][b];
        const double both = (ga[0] * gb[0] + ga[1] * gb[1]) + ga[2] * gb[2];
        for (int i = 0; i < 3; ++i)
          for (int j = 0; j < 3; ++j) {
            const double shear = (i == j ? both : 0) + ga[j] * gb[i] - (2.0 / 3) * (ga[i] * gb[j]);
            k[3 * a + i][3 * b + j] += q[n].weight * (m.mu * shear + bulk * (ta[i] * tb[j]));
          }
      }
  eliminate(k, 3 * nodes, 3 * rows);
  if (at_points.weight && !inside) {
    for (int n = 0; n < points; ++n) {
      at_points.weight[n] = q[n].weight;
      std::copy_n(q[n].g[0], 3 * rows, at_points.g[n * rows]);
    }
    if (inner_rows) *inner = RestInner();
    for (int r = 3 * nodes; r < 3 * rows; ++r)
      for (int j = 0; j < r && k[r][r] > 0; ++j) inner->share[r - 3 * nodes][j] = k[r][j] / k[r][r];
  }
  for (int i = 0; i < 3 * nodes; ++i)
    for (int j = 0; j < 3 * nodes; ++j) out.stiffness[i][j] = 0.5 * (k[i][j] + k[j][i]);
  if (!inside) return true;
  RestCell whole;
  if (!make_rest_cell(kind, x, nullptr, material, whole, at_points, inner)) return false;
  for (int i = 0; i < 3 * nodes; ++i)
    for (int j = 0; j < 3 * nodes; ++j)
      out.stiffness[i][j] += kTie * (out.volume / whole.volume * whole.stiffness[i][j] - out.stiffness[i][j]);
  if (at_points.weight && !is_whole(inside)) {
    std::fill_n(at_points.weight, points_of(kind), 0.0);
    std::fill_n(at_points.g[0], 3 * rows, 0.0);
    *inner = RestInner();
    at_points.weight[0] = out.volume;
    for (int a = 0; a < nodes; ++a)
      for (int c = 0; c < 3; ++c)
        at_points.g[a][c] = out.mean[a][c] + kTie * (whole.mean[a][c] - out.mean[a][c]);
  }
  return true;
}

}  // namespace model
