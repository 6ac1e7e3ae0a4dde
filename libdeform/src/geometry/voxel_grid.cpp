#include "geometry/voxel_grid.h"

#include <algorithm>
#include <cmath>

#include "geometry/closest.h"
#include "geometry/rest_tree.h"
#include "geometry/surface.h"
#include "geometry/winding.h"
#include "math/extent.h"

namespace dfm {
namespace {

constexpr double kSqrt3 = 1.7320508075688772;

// Eight corners of a cell, x first, at (u, v, w) in it.
VoxelGrid::Value join(const double c[8], const double t[3], double per_size) {
  const auto mix = [](double a, double b, double s) { return a + s * (b - a); };
  const double x00 = mix(c[0], c[1], t[0]);
  const double x10 = mix(c[2], c[3], t[0]);
  const double x01 = mix(c[4], c[5], t[0]);
  const double x11 = mix(c[6], c[7], t[0]);
  const double y0 = mix(x00, x10, t[1]), y1 = mix(x01, x11, t[1]);
  Vec3 g;
  g.x = mix(mix(c[1] - c[0], c[3] - c[2], t[1]), mix(c[5] - c[4], c[7] - c[6], t[1]), t[2]);
  g.y = mix(x10 - x00, x11 - x01, t[2]);
  g.z = y1 - y0;
  return {mix(y0, y1, t[2]), per_size * g};
}

// Distances and signs of a surface, for setting up.
class Distances {
 public:
  Distances(const Memory &memory, const double *points, uint32_t ntri, const uint32_t *tris, Vec3 low,
            Vec3 high)
      : points_(points),
        tris_(tris),
        origin_(low),
        scale_(1 / norm(high - low)),
        scaled_(memory),
        tree_(memory, ntri,
              [&](uint32_t t) {
                Extent box;
                for (size_t i = 0; i < 3; ++i) box.add(at(tris[3 * size_t{t} + i]));
                return box;
              }),
        winding_(memory, make_scaled(ntri), ntri, tris) {}

  // m, without sign. The surface is known to be no further than `most`.
  double unsigned_at(Vec3 p, double most) const {
    double best2 = most * most * (1 + 1e-12);
    tree_.near(p, best2, [&](uint32_t t) {
      const uint32_t *c = tris_ + 3 * size_t{t};
      best2 = std::min(best2, closest_on_triangle(p, at(c[0]), at(c[1]), at(c[2])).distance2);
    });
    return std::sqrt(best2);
  }
  bool inside(Vec3 p) const { return winding_.at(scale_ * (p - origin_)) > 0.5; }

 private:
  Vec3 at(uint32_t i) const { return load3(points_ + 3 * size_t{i}); }
  // The winding number is computed in a box of size one.
  const double *make_scaled(uint32_t ntri) {
    uint32_t most = 0;
    for (size_t i = 0; i < 3 * size_t{ntri}; ++i) most = std::max(most, tris_[i]);
    scaled_.resize(3 * (size_t{most} + 1));
    for (uint32_t i = 0; i <= most; ++i) store3(&scaled_[3 * size_t{i}], scale_ * (at(i) - origin_));
    return scaled_.data();
  }

  const double *points_;
  const uint32_t *tris_;
  Vec3 origin_;
  double scale_;
  Array<double> scaled_;
  RestTree tree_;
  WindingTree winding_;
};

// Signs of a block of n^3 corners `step` apart, x first: a neighbor of a corner that is farther than the step
// from the surface is on the same side; the winding number is computed only if there is no such neighbor.
template <class At, class D>
void add_signs(uint32_t nx, uint32_t ny, uint32_t nz, double step, const Distances &surface, At &&place,
               D &&d) {
  for (uint32_t k = 0; k < nz; ++k)
    for (uint32_t j = 0; j < ny; ++j)
      for (uint32_t i = 0; i < nx; ++i) {
        float &own = d(i, j, k);
        const float *before = i ? &d(i - 1, j, k) : j ? &d(i, j - 1, k) : k ? &d(i, j, k - 1) : nullptr;
        const double far = before ? std::max(double(std::fabs(own)), double(std::fabs(*before))) : 0;
        if (far > step * 1.001 ? std::signbit(*before) : surface.inside(place(i, j, k))) own = -own;
      }
}

}  // namespace

VoxelGrid::VoxelGrid(const Memory &memory, const double *points, uint32_t ntri, const uint32_t *tris,
                     uint32_t cells) {
  use_memory(memory, brick_, value_, coarse_);
  Extent box;
  for (size_t i = 0; i < 3 * size_t{ntri}; ++i) box.add(load3(points + 3 * size_t{tris[i]}));
  low_ = box.lo;
  high_ = box.hi;
  const Vec3 size = high_ - low_;
  // Cubes: halved until so many fill the box (no libm root, so that the grid is the same everywhere).
  double small = 0, large = std::max({size.x, size.y, size.z});
  for (int i = 0; i < 50; ++i) {
    const double s = 0.5 * (small + large);
    (size.x / s * (size.y / s) * (size.z / s) > cells ? small : large) = s;
  }
  cell_ = large;
  // In a box without height the cells would have no size, so the number of bricks is bounded too: a plate one
  // cell high has cells/8 of them.
  const auto bricks_of = [&](int k) { return std::ceil((size[k] + 2 * kBand * cell_) / (kBrick * cell_)); };
  while (bricks_of(0) * bricks_of(1) * bricks_of(2) > 512 + 0.5 * cells) cell_ *= 1.125;
  const double span = cell_ * kBrick;
  margin_ = kBand * cell_;
  per_cell_ = 1 / cell_;
  for (int k = 0; k < 3; ++k) {
    bricks_[k] = uint32_t(bricks_of(k));
    origin_[k] = 0.5 * (low_[k] + high_[k]) - 0.5 * span * bricks_[k];
  }
  build(memory, points, ntri, tris);
}

void VoxelGrid::build(const Memory &memory, const double *points, uint32_t ntri, const uint32_t *tris) {
  const Distances surface(memory, points, ntri, tris, low_, high_);
  const double span = cell_ * kBrick, half_diagonal = 0.5 * kSqrt3 * span;
  const double everything = norm(high_ - low_) + 4 * (span + margin_);
  const auto brick_corner = [&](uint32_t i, uint32_t j, uint32_t k) {
    return origin_ + span * Vec3{double(i), double(j), double(k)};
  };
  coarse_.resize(size_t{bricks_[0] + 1} * (bricks_[1] + 1) * (bricks_[2] + 1));
  for (uint32_t k = 0; k <= bricks_[2]; ++k)
    for (uint32_t j = 0; j <= bricks_[1]; ++j)
      for (uint32_t i = 0; i <= bricks_[0]; ++i) {
        const double near = i ? double(coarse_[corner(i - 1, j, k)]) + 1.001 * span : everything;
        coarse_[corner(i, j, k)] = float(surface.unsigned_at(brick_corner(i, j, k), near));
      }
  add_signs(bricks_[0] + 1, bricks_[1] + 1, bricks_[2] + 1, span, surface, brick_corner,
            [&](uint32_t i, uint32_t j, uint32_t k) -> float & { return coarse_[corner(i, j, k)]; });

  brick_.assign(size_t{bricks_[0]} * bricks_[1] * bricks_[2], kNone);
  uint32_t kept = 0;
  for (uint32_t k = 0; k < bricks_[2]; ++k)
    for (uint32_t j = 0; j < bricks_[1]; ++j)
      for (uint32_t i = 0; i < bricks_[0]; ++i) {
        const Vec3 center = brick_corner(i, j, k) + 0.5 * span * Vec3{1, 1, 1};
        const double near =
            surface.unsigned_at(center, std::fabs(double(coarse_[corner(i, j, k)])) + 1.001 * half_diagonal);
        if (near > kBand * cell_ + half_diagonal) continue;
        const uint32_t b[3] = {i, j, k};
        brick_[index(b)] = kept;
        value_.resize(size_t{++kept} * kNodes);
        float *const v = &value_[size_t{kept - 1} * kNodes];
        const auto place = [&](uint32_t x, uint32_t y, uint32_t z) {
          return brick_corner(i, j, k) + cell_ * Vec3{double(x), double(y), double(z)};
        };
        const auto at = [&](uint32_t x, uint32_t y, uint32_t z) -> float & {
          return v[(z * (kBrick + 1) + y) * (kBrick + 1) + x];
        };
        for (uint32_t z = 0; z <= kBrick; ++z)
          for (uint32_t y = 0; y <= kBrick; ++y)
            for (uint32_t x = 0; x <= kBrick; ++x)
              at(x, y, z) =
                  float(surface.unsigned_at(place(x, y, z), x ? double(at(x - 1, y, z)) + 1.001 * cell_
                                                              : near + 1.001 * half_diagonal));
        add_signs(kBrick + 1, kBrick + 1, kBrick + 1, cell_, surface, place, at);
      }
  for (uint32_t t = 0; t < ntri; ++t) {
    Vec3 center;
    for (int i = 0; i < 3; ++i) center += (1.0 / 3) * load3(points + 3 * size_t{tris[3 * size_t{t} + i]});
    error_ = std::max(error_, std::fabs(at(center).distance));
  }
}

double VoxelGrid::extent() const {
  Vec3 far;
  for (int k = 0; k < 3; ++k) far[k] = std::max(std::fabs(low_[k]), std::fabs(high_[k]));
  return norm(far);
}

VoxelGrid::Place VoxelGrid::place(Vec3 p) const {
  Place out;
  for (int k = 0; k < 3; ++k) {
    const double most = double(bricks_[k]) * kBrick;
    const double x = (p[k] - origin_[k]) * per_cell_;
    const double y = x > 0 ? std::min(x, most) : 0;  // NaN: 0
    out.brick[k] = std::min(uint32_t(y) / kBrick, bricks_[k] - 1);
    out.in[k] = y - double(out.brick[k]) * kBrick;
    out.inside[k] = x == y ? p[k] : origin_[k] + y * cell_;
  }
  return out;
}

VoxelGrid::Value VoxelGrid::at(Vec3 p) const {
  const Place w = place(p);
  const uint32_t stored = brick_[index(w.brick)];
  double c[8], t[3];
  Value value;
  if (stored != kNone) {
    uint32_t first[3];
    for (int k = 0; k < 3; ++k) {
      first[k] = std::min(uint32_t(w.in[k]), kBrick - 1);
      t[k] = w.in[k] - first[k];
    }
    const float *const v =
        &value_[size_t{stored} * kNodes] + (first[2] * (kBrick + 1) + first[1]) * (kBrick + 1) + first[0];
    for (uint32_t i = 0; i < 8; ++i)
      c[i] = double(v[((i >> 2) * (kBrick + 1) + (i >> 1 & 1)) * (kBrick + 1) + (i & 1)]);
    value = join(c, t, per_cell_);
  } else {
    for (int k = 0; k < 3; ++k) t[k] = w.in[k] / kBrick;
    for (uint32_t i = 0; i < 8; ++i)
      c[i] = double(coarse_[corner(w.brick[0] + (i & 1), w.brick[1] + (i >> 1 & 1), w.brick[2] + (i >> 2))]);
    value = join(c, t, per_cell_ / kBrick);
  }
  const Vec3 beyond = p - w.inside;
  if (norm2(beyond) > 0) {  // outside the grid: a certain bound
    const double way = norm(beyond);
    value.distance = std::max(value.distance - way, way + margin_);
  }
  return value;
}

bool VoxelGrid::near(Vec3 p, double limit) const {
  const bool fine = limit < kBand * cell_ && brick_[index(place(p).brick)] != kNone;
  return at(p).distance <=
         (fine ? std::min(kSqrt3 * limit, limit + kSqrt3 * cell_) : kSqrt3 * (limit + kBrick * cell_));
}

double VoxelGrid::clearance(Vec3 p) const {
  const double d = at(p).distance, coarse = d / kSqrt3 - kBrick * cell_;
  if (brick_[index(place(p).brick)] == kNone) return coarse;
  return std::max(coarse, std::min(std::max(d / kSqrt3, d - kSqrt3 * cell_), kBand * cell_));
}

namespace {

// First place in [lo, hi] where a cubic, by its Bernstein coefficients there, is not above the limit: it lies
// above what its coefficients lie above.
double first_below(const double b[4], double lo, double hi, double limit, int halvings) {
  if (b[0] <= limit) return lo;
  if (std::min({b[1], b[2], b[3]}) > limit) return HUGE_VAL;
  if (halvings == 0) return lo;
  const double p = 0.5 * (b[0] + b[1]);
  const double q = 0.5 * (b[1] + b[2]);
  const double r = 0.5 * (b[2] + b[3]);
  const double pq = 0.5 * (p + q);
  const double qr = 0.5 * (q + r);
  const double mid = 0.5 * (pq + qr);
  const double left[4] = {b[0], p, pq, mid}, right[4] = {mid, qr, r, b[3]};
  const double first = first_below(left, lo, 0.5 * (lo + hi), limit, halvings - 1);
  return first < HUGE_VAL ? first : first_below(right, 0.5 * (lo + hi), hi, limit, halvings - 1);
}

}  // namespace

// Along a line, what is joined trilinearly is a cubic from one cell's border to the next; four places inside
// give it, borders themselves may belong to either side. Outside the grid, distances have a bound and so do
// their changes: 1 by the way to the grid, sqrt(3) by the place in it. What lies further beyond the grid than
// the limit exceeds that bound is passed over at once, since every cell of a long way would take a look.
double VoxelGrid::touch(Vec3 from, Vec3 way, double limit) const {
  constexpr int kHalvings = 40;
  const double beyond = std::ceil(std::max(0.0, (limit - margin_) * per_cell_)) + 1;
  double enters = 0, leaves = 1;
  for (int k = 0; k < 3; ++k) {
    const double low = origin_[k] - beyond * cell_ - from[k];
    const double high = origin_[k] + (double(bricks_[k]) * kBrick + beyond) * cell_ - from[k];
    if (way[k] == 0) {
      if (low > 0 || high < 0) return HUGE_VAL;
      continue;
    }
    enters = std::max(enters, (way[k] > 0 ? low : high) / way[k]);
    leaves = std::min(leaves, (way[k] > 0 ? high : low) / way[k]);
  }
  for (double t = enters; t < leaves;) {
    double next = 1;
    for (int k = 0; k < 3; ++k) {
      if (way[k] == 0) continue;
      const double x = (from[k] + t * way[k] - origin_[k]) * per_cell_;
      const double border = way[k] > 0 ? std::floor(x + 1e-9) + 1 : std::ceil(x - 1e-9) - 1;
      next = std::min(next, std::max((origin_[k] + border * cell_ - from[k]) / way[k], t + 1e-12));
    }
    const Vec3 middle = from + (0.5 * (t + next)) * way;
    if (norm2(middle - place(middle).inside) > 0) {
      const double change = (1 + kSqrt3) * 0.5 * (next - t) * norm(way);
      if (limit > margin_ && !(at(middle).distance - change > limit)) return t;
      t = next;
      continue;
    }
    double p[4], b[4];
    for (int i = 0; i < 4; ++i) p[i] = at(from + (t + (0.125 + 0.25 * i) * (next - t)) * way).distance;
    // p(v) = a0 + a1 v + a2 v^2 + a3 v^3 through v = -3/2, -1/2, 1/2, 3/2; the ends are v = -2 and 2
    const double a0 = (9 * (p[1] + p[2]) - p[0] - p[3]) / 16, a1 = (p[0] - p[3] + 27 * (p[2] - p[1])) / 24;
    const double a2 = (p[0] - p[1] - p[2] + p[3]) / 4, a3 = (p[3] - p[0] + 3 * (p[1] - p[2])) / 6;
    b[0] = a0 - 2 * a1 + 4 * a2 - 8 * a3;
    b[3] = a0 + 2 * a1 + 4 * a2 + 8 * a3;
    b[1] = b[0] + (4.0 / 3) * (a1 - 4 * a2 + 12 * a3);
    b[2] = b[3] - (4.0 / 3) * (a1 + 4 * a2 + 12 * a3);
    const double first = first_below(b, t, next, limit, kHalvings);
    if (first < HUGE_VAL) return first;
    t = next;
  }
  return HUGE_VAL;
}

}  // namespace dfm
