// Rotations from a 3 x 3 matrix, one at a time: the nearest one for every matrix, and two others for
// comparison. All of them are proper (det = +1) for every matrix: flat, inverted, zero.
#pragma once
#include <cmath>

#include "polar_lanes.h"
#include "small.h"

namespace model {

// The rotation of Jacobi's methods in the plane of p and q, from the entries pp, qq and pq of what it is to
// make diagonal.
struct Givens {
  double c, s;
  Givens(double pp, double qq, double pq) {
    const double theta = (qq - pp) / (2 * pq);
    const double t = (theta < 0 ? -1 : 1) / (std::fabs(theta) + std::sqrt(theta * theta + 1));
    c = 1 / std::sqrt(t * t + 1);
    s = t * c;
  }
  void turn(double &x, double &y) const {
    const double before = x;
    x = c * before - s * y;
    y = s * before + c * y;
  }
};

// Eigenvalues on the diagonal of the symmetric a, eigenvectors in the columns of v: cyclic Jacobi.
template <int kN>
inline void jacobi(double (&a)[kN][kN], double (&v)[kN][kN]) {
  for (int i = 0; i < kN; ++i)
    for (int j = 0; j < kN; ++j) v[i][j] = i == j;
  for (int sweep = 0; sweep < 30; ++sweep) {
    double off = 0, all = 0;
    for (int i = 0; i < kN; ++i)
      for (int j = 0; j < kN; ++j) {
        all += a[i][j] * a[i][j];
        if (i != j) off += a[i][j] * a[i][j];
      }
    if (!(off > 1e-33 * all)) return;
    for (int p = 0; p < kN; ++p)
      for (int q = p + 1; q < kN; ++q) {
        if (a[p][q] == 0) continue;
        const Givens by(a[p][p], a[q][q], a[p][q]);
        for (int k = 0; k < kN; ++k) by.turn(a[k][p], a[k][q]);
        for (int k = 0; k < kN; ++k) by.turn(a[p][k], a[q][k]);
        for (int k = 0; k < kN; ++k) by.turn(v[k][p], v[k][q]);
        a[p][q] = a[q][p] = 0;
      }
  }
}

// out [kN,kN] = sum of v v^T / divisor(value, largest value) over the eigenvectors v of the symmetric a, that
// is overwritten; divisor 0: the vector is left out.
template <int kN, class Divisor>
inline void spectral_inverse(double (&a)[kN][kN], double *out, const Divisor &divisor) {
  double v[kN][kN], most = 0;
  jacobi(a, v);
  for (int k = 0; k < kN; ++k) most = a[k][k] > most ? a[k][k] : most;
  for (int e = 0; e < kN * kN; ++e) out[e] = 0;
  for (int k = 0; k < kN; ++k) {
    const double by = divisor(a[k][k], most);
    for (int e = 0; by != 0 && e < kN * kN; ++e) out[e] += v[e / kN][k] * v[e % kN][k] / by;
  }
}

namespace rotation {

inline void identity(double *r) {
  for (int k = 0; k < 9; ++k) r[k] = k % 4 == 0;
}

// Copies f divided by its largest entry; returns false if that is zero or not finite.
inline bool scaled(const double *f, double *out) {
  double most = 0;
  for (int k = 0; k < 9; ++k) {
    if (!std::isfinite(f[k])) return false;
    most = std::fabs(f[k]) > most ? std::fabs(f[k]) : most;
  }
  if (!(most > 0)) return false;
  int exponent;
  (void)std::frexp(most, &exponent);
  for (int k = 0; k < 9; ++k) out[k] = std::ldexp(f[k], -exponent);
  return true;
}

// The rotation of a quaternion w x y z of any length but zero.
inline void from_quaternion(const double *q, double *r) {
  const double s = 2 / ((q[0] * q[0] + q[1] * q[1]) + (q[2] * q[2] + q[3] * q[3]));
  const double x = s * q[1], y = s * q[2], z = s * q[3];
  r[0] = 1 - (y * q[2] + z * q[3]);
  r[4] = 1 - (x * q[1] + z * q[3]);
  r[8] = 1 - (x * q[1] + y * q[2]);
  r[1] = x * q[2] - z * q[0];
  r[3] = x * q[2] + z * q[0];
  r[2] = x * q[3] + y * q[0];
  r[6] = x * q[3] - y * q[0];
  r[5] = y * q[3] - x * q[0];
  r[7] = y * q[3] + x * q[0];
}

// w of the Newton step R exp([w]x): (tr S I - S) w = axial(R^T F), S the symmetric part of R^T F; false if
// the matrix is not safely positive definite.
inline bool correction(const double *f, const double *r, double *w) {
  double a[9], b[3];
  transposed_matrix_product(r, f, a);
  b[0] = a[7] - a[5];
  b[1] = a[2] - a[6];
  b[2] = a[3] - a[1];
  const double m0 = a[4] + a[8], m1 = a[8] + a[0], m2 = a[0] + a[4];
  const double xy = -0.5 * (a[1] + a[3]), yz = -0.5 * (a[5] + a[7]), zx = -0.5 * (a[6] + a[2]);
  const double c0 = m1 * m2 - yz * yz, c1 = zx * yz - xy * m2, c2 = xy * yz - m1 * zx;
  const double det = (m0 * c0 + xy * c1) + zx * c2, trace = (m0 + m1) + m2;
  if (!(det > 1e-13 * (trace * trace * trace))) return false;
  w[0] = ((c0 * b[0] + c1 * b[1]) + c2 * b[2]) / det;
  w[1] = ((c1 * b[0] + (m0 * m2 - zx * zx) * b[1]) + (xy * zx - m0 * yz) * b[2]) / det;
  w[2] = ((c2 * b[0] + (xy * zx - m0 * yz) * b[1]) + (m0 * m1 - xy * xy) * b[2]) / det;
  return true;
}

// Nearest rotation of any matrix: the eigenvector of the largest eigenvalue of Horn's matrix, which no matrix
// makes ambiguous to the point of no result, then Newton's method on the rotation while that is safe. Returns
// the identity for a matrix without a unique nearest rotation (zero, not finite).
inline void nearest(const double *given, double *r) {
  double f[9];
  if (!scaled(given, f)) return identity(r);
  const double x = f[7] - f[5], y = f[2] - f[6], z = f[3] - f[1];
  double k[4][4] = {{(f[0] + f[4]) + f[8], x, y, z},
                    {x, (f[0] - f[4]) - f[8], f[1] + f[3], f[2] + f[6]},
                    {y, f[1] + f[3], (f[4] - f[0]) - f[8], f[5] + f[7]},
                    {z, f[2] + f[6], f[5] + f[7], (f[8] - f[0]) - f[4]}};
  double v[4][4], q[4];
  jacobi(k, v);
  int best = 0;
  for (int n = 1; n < 4; ++n)
    if (k[n][n] > k[best][best]) best = n;
  for (int n = 0; n < 4; ++n) q[n] = v[n][best];
  from_quaternion(q, r);
  for (int n = 0; n < 2; ++n) {
    double w[3];
    if (!correction(f, r, w)) return;
    const double hx = 0.5 * w[0], hy = 0.5 * w[1], hz = 0.5 * w[2];
    if (!((hx * hx + hy * hy) + hz * hz < 1e-6)) return;
    const double p[4] = {q[0], q[1], q[2], q[3]};
    q[0] = ((p[0] - p[1] * hx) - p[2] * hy) - p[3] * hz;
    q[1] = ((p[1] + p[0] * hx) + p[2] * hz) - p[3] * hy;
    q[2] = ((p[2] + p[0] * hy) + p[3] * hx) - p[1] * hz;
    q[3] = ((p[3] + p[0] * hz) + p[1] * hy) - p[2] * hx;
    from_quaternion(q, r);
  }
}

struct Single {
  using V = double;
  static double splat(double a) { return a; }
  static double root(double a) { return std::sqrt(a); }
  static double more(double a, double b) { return a > b ? a : b; }
  static double less(double a, double b) { return a < b ? a : b; }
};

// The closed form where it is accurate, else nearest(): what the kernels do with each of their lanes.
inline void polar_of(const double *f, double *r) {
  Polar<Single> o;
  polar(f, r, o);
  const bool good = o.divisor > kPolarDivisor * o.cube && kPolarStep * o.trace > std::fabs(o.step) &&
                    o.n > kPolarLeastSquare;
  if (!good) nearest(f, r);
}

// The columns of f made orthogonal one after the other; the third is the cross product of the first two, so
// that it is proper. Depends on the order of the columns; where a column is lost it takes an axis.
inline void gram_schmidt(const double *given, double *r) {
  double f[9];
  if (!scaled(given, f)) return identity(r);
  double u[3][3];
  const auto unit = [](double *a) {
    const double l = std::sqrt((a[0] * a[0] + a[1] * a[1]) + a[2] * a[2]);
    if (!(l > 1e-14)) return false;
    for (int k = 0; k < 3; ++k) a[k] /= l;
    return true;
  };
  const auto column = [&](int from, int to) {
    for (int k = 0; k < 3; ++k) u[to][k] = f[3 * k + from];
  };
  column(0, 0);
  if (!unit(u[0])) {
    column(1, 0);
    if (!unit(u[0])) {
      column(2, 0);
      unit(u[0]);
    }
  }
  const auto rest = [&] {
    for (int twice = 0; twice < 2; ++twice) {
      const double along = (u[0][0] * u[1][0] + u[0][1] * u[1][1]) + u[0][2] * u[1][2];
      for (int k = 0; k < 3; ++k) u[1][k] -= along * u[0][k];
    }
    return unit(u[1]);
  };
  column(1, 1);
  for (int axis = 0; !rest() && axis < 3; ++axis)
    for (int k = 0; k < 3; ++k) u[1][k] = k == axis;
  for (int k = 0; k < 3; ++k) {
    const int m = (k + 1) % 3, n = (k + 2) % 3;
    r[3 * k] = u[0][k];
    r[3 * k + 1] = u[1][k];
    r[3 * k + 2] = u[0][m] * u[1][n] - u[0][n] * u[1][m];
  }
}

// R = U diag(1, 1, det) V^T of f = U diag(s) V^T by one-sided Jacobi (Hestenes, J. SIAM 6, 1958): turns V
// make the columns of w = f V orthogonal relative to their lengths, so that small stretches keep their
// digits. U are the columns of w over their lengths, longest first.
inline void by_singular_values(const double *given, double *r) {
  double w[9], v[9], u[9];
  if (!scaled(given, w)) return identity(r);
  identity(v);
  const auto product = [&](int p, int q) {
    return (w[p] * w[q] + w[3 + p] * w[3 + q]) + w[6 + p] * w[6 + q];
  };
  double *const both[2] = {w, v};
  bool turned = true;
  for (int sweep = 0; turned && sweep < 30; ++sweep) {
    turned = false;
    for (int p = 0; p < 2; ++p)
      for (int q = p + 1; q < 3; ++q) {
        const double pp = product(p, p), qq = product(q, q), pq = product(p, q);
        if (!(pq * pq > 1e-32 * pp * qq)) continue;
        turned = true;
        const Givens by(pp, qq, pq);
        for (double *const m : both)
          for (int k = 0; k < 9; k += 3) by.turn(m[k + p], m[k + q]);
      }
  }
  int first = 0, last = 2;
  for (int k = 0; k < 3; ++k) {
    if (product(k, k) > product(first, first)) first = k;
    if (product(k, k) <= product(last, last)) last = k;
  }
  if (last == first) last = (first + 2) % 3;
  const int order[3] = {first, 3 - first - last, last};
  double axis[3][3], sorted[9];
  for (int k = 0; k < 3; ++k)
    for (int i = 0; i < 3; ++i) {
      axis[k][i] = v[3 * i + order[k]];
      sorted[3 * i + k] = w[3 * i + order[k]];
    }
  for (int i = 0; i < 3; ++i)
    axis[2][i] = axis[0][(i + 1) % 3] * axis[1][(i + 2) % 3] - axis[0][(i + 2) % 3] * axis[1][(i + 1) % 3];
  gram_schmidt(sorted, u);
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      r[3 * i + j] = (u[3 * i] * axis[0][j] + u[3 * i + 1] * axis[1][j]) + u[3 * i + 2] * axis[2][j];
}

}  // namespace rotation
}  // namespace model
