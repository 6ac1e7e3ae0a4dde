#include "dynamics/symplectic_euler.h"

#include <limits>

namespace dfm {

namespace {

// One point: four doubles, two or one machine vectors. The same operations on each component as written,
// at every width.
using Point = double __attribute__((vector_size(32)));
static_assert(kStride == 4 && sizeof(Point) == kStride * sizeof(double));
Point *points(Array<double> &a) { return reinterpret_cast<Point *>(a.data()); }

}  // namespace

double predict(Phyxels &p, Vec3 gravity, double h) {
  const Point g{gravity.x, gravity.y, gravity.z, 0};
  const Point *const v = points(p.v), *const w = points(p.inv_mass), *const f = points(p.f);
  Point *const free = points(p.v_free);
  Point square[2] = {};  // two sums, so that one addition does not wait for the one before
  const auto one = [&](uint32_t i, Point &sum) {
    free[i] = v[i] + h * (w[i] * (f[i] + p.mass[i] * g));
    sum += p.mass[i] * (free[i] * free[i]);
  };
  uint32_t i = 0;
  for (; i + 2 <= p.n; i += 2) {
    one(i, square[0]);
    one(i + 1, square[1]);
  }
  if (i < p.n) one(i, square[0]);
  const Point sum = square[0] + square[1];
  return 0.5 * ((sum[0] + sum[1]) + sum[2]);
}

void find_end(Phyxels &p, bool touched, double h) {
  Point *const x_end = points(p.x_end), *const v_end = points(p.v_end);
  const Point *const x = points(p.x), *const free = points(p.v_free), *const w = points(p.inv_mass);
  const Point *const impulse = points(p.impulse);
  for (uint32_t i = 0; i < p.n; ++i) {
    const Point v = touched ? free[i] + w[i] * impulse[i] : free[i];
    v_end[i] = v;
    x_end[i] = x[i] + h * v;
  }
}

void shorten(Phyxels &p, const double *mean, double h) {
  Point *const x_end = points(p.x_end);
  const Point *const x = points(p.x), *const u = reinterpret_cast<const Point *>(mean);
  for (uint32_t i = 0; i < p.n; ++i) x_end[i] = x[i] + h * u[i];
}

double stable_step(const Phyxels &p, const double *ksum, const double *csum, uint32_t *worst) {
  double best = std::numeric_limits<double>::infinity();
  *worst = p.n;
  for (uint32_t i = 0; i < p.n; ++i) {
    if ((p.held[i] & 7) == 7) continue;  // a held point does not move
    const double k = ksum[i], c = csum[i], m = p.mass[i];
    // h = 4m / (c + sqrt(c^2 + 4 m k)): the same root without cancellation, and defined for k = 0
    const double bottom = c + std::sqrt(c * c + 4 * m * k);
    const double h = bottom > 0 ? 4 * m / bottom : std::numeric_limits<double>::infinity();
    if (h < best) {
      best = h;
      *worst = i;
    }
  }
  return best;
}

}  // namespace dfm
