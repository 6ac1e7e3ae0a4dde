// Polar decomposition F = R S, R the nearest rotation (det = +1 for every F), in closed form, for vectors of
// lanes and for double alike. The trace t of S is the largest root of
//   p(t) = t^4 - 2 n t^2 - 8 d t + 2 |C|^2 - n^2,   C = F^T F, n = tr C, d = det F,
// because t = max over rotations Q of tr(Q^T F) is the largest eigenvalue of the 4 x 4 matrix of that form in
// the quaternion of Q (Horn 1987, J. Opt. Soc. Am. A 4), whose characteristic polynomial p is. The maximum is
// attained at R, hence R = dt/dF, and by the implicit function theorem
//   R = [(t^2 + n) F + 2 t cof F - 2 F C] / (t^3 - n t - 2 d).
// The divisor is 2 (s1 + s2)(s2 + s3)(s3 + s1), s3 with the sign of d: the error grows as it falls against
// t^3. t begins at sqrt(3 n), its least upper bound, and takes three steps of Halley's method. What this
// file leaves to the caller: lanes without good accuracy (rotation.h).
#pragma once

namespace model {
namespace {

constexpr double kPolarDivisor = 0.25;       // least divisor over t^3; 16/27 at F = I
constexpr double kPolarStep = 1e-6;          // largest last step over t: its cube is below rounding
constexpr double kPolarLeastSquare = 1e-80;  // of F; below it powers of t lose digits

// Intermediate results of the rotation; a lane is accurate where divisor > kPolarDivisor cube, |step| <
// kPolarStep trace and n > kPolarLeastSquare. Ops has the type V of a vector and splat(double), root(V).
template <class Ops>
struct Polar {
  typename Ops::V c[6], cofactor[9];  // C as xx yy zz xy yz zx
  typename Ops::V n, det, constant, trace, step, divisor, cube;
};

// In three parts, so that a caller may do each for many vectors: the root is a chain of divisions that wait
// for each other. f, r: nine vectors, row-major.
template <class Ops>
static inline __attribute__((always_inline)) void polar_invariants(const typename Ops::V *f, Polar<Ops> &o) {
  using V = typename Ops::V;
  V *const c = o.c, *const q = o.cofactor;
  c[0] = (f[0] * f[0] + f[3] * f[3]) + f[6] * f[6];
  c[1] = (f[1] * f[1] + f[4] * f[4]) + f[7] * f[7];
  c[2] = (f[2] * f[2] + f[5] * f[5]) + f[8] * f[8];
  c[3] = (f[0] * f[1] + f[3] * f[4]) + f[6] * f[7];
  c[4] = (f[1] * f[2] + f[4] * f[5]) + f[7] * f[8];
  c[5] = (f[2] * f[0] + f[5] * f[3]) + f[8] * f[6];
  q[0] = f[4] * f[8] - f[5] * f[7];
  q[1] = f[5] * f[6] - f[3] * f[8];
  q[2] = f[3] * f[7] - f[4] * f[6];
  q[3] = f[2] * f[7] - f[1] * f[8];
  q[4] = f[0] * f[8] - f[2] * f[6];
  q[5] = f[1] * f[6] - f[0] * f[7];
  q[6] = f[1] * f[5] - f[2] * f[4];
  q[7] = f[2] * f[3] - f[0] * f[5];
  q[8] = f[0] * f[4] - f[1] * f[3];
  const V two = Ops::splat(2);
  o.n = (c[0] + c[1]) + c[2];
  o.det = (f[0] * q[0] + f[1] * q[1]) + f[2] * q[2];
  const V own = (c[0] * c[0] + c[1] * c[1]) + c[2] * c[2];
  const V mixed = (c[3] * c[3] + c[4] * c[4]) + c[5] * c[5];
  o.constant = two * (own + two * mixed) - o.n * o.n;
}

template <class Ops>
static inline __attribute__((always_inline)) void polar_trace(Polar<Ops> &o) {
  using V = typename Ops::V;
  const V n = o.n, twice_n = Ops::splat(2) * n, twice_det = Ops::splat(2) * o.det;
  const V two = Ops::splat(2), three = Ops::splat(3), four = Ops::splat(4), eight = Ops::splat(8);
  V t = Ops::root(three * n), step = t;
  for (int k = 0; k < 3; ++k) {
    const V square = t * t, slope = t * (square - n) - twice_det;  // a quarter of p'
    const V p = square * (square - twice_n) - four * (twice_det * t) + o.constant;
    // p'' is 4 (3 t^2 - n)
    step = (two * (p * slope)) / (eight * (slope * slope) - p * (three * square - n));
    t = t - step;
  }
  o.trace = t;
  o.step = step;
  o.cube = (t * t) * t;
  o.divisor = t * (t * t - n) - twice_det;
}

template <class Ops>
static inline __attribute__((always_inline)) void polar_rotation(const typename Ops::V *f,
                                                                 const Polar<Ops> &o, typename Ops::V *r) {
  using V = typename Ops::V;
  const V *const c = o.c, *const q = o.cofactor;
  const V inverse = Ops::splat(1) / o.divisor;
  const V linear = (o.trace * o.trace + o.n) * inverse, cubic = Ops::splat(2) * inverse;
  const V cofactor = o.trace * cubic;
  for (int i = 0; i < 3; ++i) {
    const V *const row = f + 3 * i;
    const V x = (row[0] * c[0] + row[1] * c[3]) + row[2] * c[5];
    const V y = (row[0] * c[3] + row[1] * c[1]) + row[2] * c[4];
    const V z = (row[0] * c[5] + row[1] * c[4]) + row[2] * c[2];
    r[3 * i] = (linear * row[0] + cofactor * q[3 * i]) - cubic * x;
    r[3 * i + 1] = (linear * row[1] + cofactor * q[3 * i + 1]) - cubic * y;
    r[3 * i + 2] = (linear * row[2] + cofactor * q[3 * i + 2]) - cubic * z;
  }
}

template <class Ops>
static inline __attribute__((always_inline)) void polar(const typename Ops::V *f, typename Ops::V *r,
                                                        Polar<Ops> &o) {
  polar_invariants(f, o);
  polar_trace(o);
  polar_rotation(f, o, r);
}

}  // namespace
}  // namespace model
