// Neighbors, weights and slopes, from the rest positions alone. The support of a point is `support` times the
// mean distance of its ten nearest points (Zerbato 2010), grown until its neighbors span space well.
#include <deform/elementary.h>

#include <algorithm>
#include <cmath>

#include "../model_common/index.h"
#include "../model_common/material.h"
#include "../model_common/params.h"
#include "../model_common/rotation.h"
#include "../model_common/tetrahedron.h"
#include "meshless_body.h"

namespace meshless {

namespace {

constexpr uint32_t kNearest = 10;
// Least eigenvalue of the moments over the largest: what a neighborhood that spans space well has.
constexpr double kFlat = 1e-3;

// Points by cubes of a grid, for those near a place.
struct Grid {
  const double *rest;
  double low[3], cell = 1;
  uint32_t n[3] = {1, 1, 1};
  Buffer<uint32_t> begin, point;

  uint32_t along(int a, double x) const {
    const double at = (x - low[a]) / cell;
    return at > 0 ? std::min(n[a] - 1, uint32_t(std::min(at, 4e9))) : 0;
  }
  uint32_t cube(const double *x) const {
    return (along(0, x[0]) * n[1] + along(1, x[1])) * n[2] + along(2, x[2]);
  }
  void create(const dfm_host *host, const double *positions, uint32_t npoint) {
    rest = positions;
    double high[3], size = 0;
    for (int a = 0; a < 3; ++a) low[a] = high[a] = rest[a];
    for (size_t i = 0; i < npoint; ++i)
      for (size_t a = 0; a < 3; ++a) {
        low[a] = std::min(low[a], rest[3 * i + a]);
        high[a] = std::max(high[a], rest[3 * i + a]);
      }
    for (int a = 0; a < 3; ++a) size = std::max(size, high[a] - low[a]);
    if (!(size > 0)) throw "all points lie at one place";
    double room = 1;  // no side counts as less than a thousandth of the longest
    for (int a = 0; a < 3; ++a) room *= std::max(high[a] - low[a], 1e-3 * size);
    cell = 2 * dfm_pow(room / npoint, 1.0 / 3);
    for (int a = 0; a < 3; ++a) n[a] = uint32_t((high[a] - low[a]) / cell) + 1;
    const auto each = [&](const auto &use) {
      for (uint32_t i = 0; i < npoint; ++i) use(cube(rest + 3 * size_t(i)), i);
    };
    model::make_lists(host, size_t(n[0]) * n[1] * n[2], each, begin, point);
  }
  // Calls use(j, distance squared) of every point within the radius of point i but itself.
  template <class Use>
  void near(uint32_t i, double radius, const Use &use) const {
    const double *const x = rest + 3 * size_t(i);
    uint32_t from[3], to[3];
    for (int a = 0; a < 3; ++a) {
      from[a] = along(a, x[a] - radius);
      to[a] = along(a, x[a] + radius);
    }
    for (uint32_t u = from[0]; u <= to[0]; ++u)
      for (uint32_t v = from[1]; v <= to[1]; ++v)
        for (uint32_t w = from[2]; w <= to[2]; ++w) {
          const size_t c = (size_t(u) * n[1] + v) * n[2] + w;
          for (uint32_t p = begin[c]; p < begin[c + 1]; ++p) {
            const double d = model::square_between(x, rest + 3 * size_t(point[p]));
            if (point[p] != i && d < radius * radius) use(point[p], d);
          }
        }
  }
};

// Weight of a neighbor at a distance of sqrt(d), Zerbato 2010, (3.11) without its factor.
double weight_at(double d, double reach) {
  const double u = 1 - d / (reach * reach);
  return u * u * u;
}

// Moments of the weighted neighbors, their inverse, and least over largest eigenvalue.
struct Moments {
  double square = 0, ratio = 0, inverse[9];
  Moments(const Grid &grid, uint32_t i, double reach) {
    double a[3][3] = {}, v[3][3], most = 0, least = HUGE_VAL;
    const double *const x = grid.rest + 3 * size_t(i);
    grid.near(i, reach, [&](uint32_t j, double d) {
      const double w = weight_at(d, reach), *const y = grid.rest + 3 * size_t(j);
      for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 3; ++c) a[r][c] += w * ((y[r] - x[r]) * (y[c] - x[c]));
      square += w * d;
    });
    model::jacobi(a, v);
    for (int k = 0; k < 3; ++k) {
      most = std::max(most, a[k][k]);
      least = std::min(least, a[k][k]);
    }
    ratio = most > 0 ? least / most : 0;
    for (int e = 0; e < 9; ++e) {
      inverse[e] = 0;
      for (int k = 0; ratio > 0 && k < 3; ++k) inverse[e] += v[e / 3][k] * v[e % 3][k] / a[k][k];
    }
  }
};

// The mean distance of the ten nearest points; of all others where there are fewer.
double mean_distance(const Grid &grid, uint32_t i, uint32_t npoint) {
  const uint32_t wanted = std::min(kNearest, npoint - 1);
  for (double radius = grid.cell;; radius *= 2) {
    double nearest[kNearest], sum = 0;
    uint32_t n = 0;
    grid.near(i, radius, [&](uint32_t, double d) {
      if (n == wanted && d >= nearest[n - 1]) return;
      uint32_t at = n < wanted ? n++ : n - 1;
      for (; at > 0 && nearest[at - 1] > d; --at) nearest[at] = nearest[at - 1];
      nearest[at] = d;
    });
    if (n < wanted) continue;
    for (uint32_t k = 0; k < wanted; ++k) sum += std::sqrt(nearest[k]);
    return sum / wanted;
  }
}

}  // namespace

void Body::create(const dfm_host *h, const dfm_mesh &m) {
  host = h;
  std::copy(m.params, m.params + kParamCount, params);
  npoint = m.npoint;
  ncell = m.ncell;
  model::take_fields(h, kId, kParams, kParamCount, m, field, [](uint32_t, double) { return true; });
  take_mesh(m);
  find_volumes();
  find_neighbors();
  find_back();
  const size_t members = begin[npoint];
  solid.create(h, npoint);
  for (Buffer<double> *b : {&rows, &spread}) b->create(h, members);
  for (Buffer<double> *b : {&own_rows, &own_spread}) b->create(h, npoint);
  for (Buffer<double> *b : {&gradient, &rate, &stress}) b->create(h, 9 * size_t(npoint));
  for (Buffer<double> *b : {&pull, &pull_rate}) b->create(h, 3 * members);
  for (uint32_t i = 0; i < npoint; ++i) largest = std::max(largest, begin[i + 1] - begin[i] + 1);
  room.create(h, size_t(largest) * (largest + 18));
  apply_params(m.params);
}

void Body::take_mesh(const dfm_mesh &m) {
  rest.create_copy(host, m.rest, 3 * size_t(npoint));
  mass.create_copy(host, m.mass, npoint);
  cells.create_copy(host, m.cells, 4 * size_t(ncell));
  cell_volume.create(host, ncell);
  for (size_t c = 0; c < ncell; ++c) {
    const auto x = [&](size_t a) { return rest.data() + 3 * size_t(cells[4 * c + a]); };
    model::Tetrahedron t;
    model::make_tetrahedron(x(0), x(1), x(2), x(3), t);
    cell_volume[c] = std::max(t.volume, 0.0);
  }
}

void Body::find_volumes() {
  volume.create(host, npoint);
  double all = 0, total = 0;
  for (size_t c = 0; c < ncell; ++c) {
    all += cell_volume[c];
    for (size_t a = 0; a < 4; ++a) volume[cells[4 * c + a]] += cell_volume[c] / 4;
  }
  around.create(host, npoint);
  shared.create(host, npoint);
  std::copy(volume.data(), volume.data() + npoint, around.data());
  for (uint32_t i = 0; i < npoint; ++i) total += mass[i];
  if (uint32_t(params[kVolumes]) == kMasses)
    for (uint32_t i = 0; i < npoint; ++i) volume[i] = all * (mass[i] / total);
}

void Body::find_neighbors() {
  if (npoint < 4) throw "a body of fewer than four points has no gradients; give it more points";
  Grid grid;
  grid.create(host, rest.data(), npoint);
  Buffer<double> reach;
  reach.create(host, npoint);
  begin.create(host, size_t(npoint) + 1);
  for (uint32_t i = 0; i < npoint; ++i) {
    reach[i] = params[kSupport] * mean_distance(grid, i, npoint);
    for (int grown = 0; !(Moments(grid, i, reach[i]).ratio > kFlat); ++grown) {
      if (grown == 24) throw "the points lie in a plane; meshless elasticity needs a body with a thickness";
      reach[i] *= 1.25;
    }
    grid.near(i, reach[i], [&](uint32_t, double) { ++begin[i + 1]; });
  }
  for (uint32_t i = 0; i < npoint; ++i)
    begin[i + 1] = model::after(begin[i], begin[i + 1],
                                "the points have more than 4 billion neighbors; take a smaller support, or "
                                "fewer points");
  neighbor.create(host, begin[npoint]);
  slope.create(host, 3 * size_t(begin[npoint]));
  weight.create(host, begin[npoint]);
  for (uint32_t i = 0; i < npoint; ++i) {
    uint32_t at = begin[i];
    grid.near(i, reach[i], [&](uint32_t j, double) { neighbor[at++] = j; });
    std::sort(neighbor.data() + begin[i], neighbor.data() + begin[i + 1]);
    const Moments moments(grid, i, reach[i]);
    for (uint32_t n = begin[i]; n < begin[i + 1]; ++n) {
      double x[3];
      offset(i, n, x);
      const double d = (x[0] * x[0] + x[1] * x[1]) + x[2] * x[2], w = weight_at(d, reach[i]);
      weight[n] = w / moments.square;
      for (size_t a = 0; a < 3; ++a) {
        const double *const row = moments.inverse + 3 * a;
        slope[3 * size_t(n) + a] = w * ((row[0] * x[0] + row[1] * x[1]) + row[2] * x[2]);
      }
    }
  }
}

void Body::find_back() {
  const auto each = [&](const auto &use) {
    for (uint32_t i = 0; i < npoint; ++i)
      for (uint32_t n = begin[i]; n < begin[i + 1]; ++n) use(neighbor[n], Back{i, n});
  };
  model::make_lists(host, npoint, each, back_begin, back);
}

void Body::offset(uint32_t point, uint32_t place, double *out) const {
  const double *const x = rest.data() + 3 * size_t(point), *const y =
                                                               rest.data() + 3 * size_t(neighbor[place]);
  for (int a = 0; a < 3; ++a) out[a] = y[a] - x[a];
}

void Body::own_slope(uint32_t point, double *out) const {
  for (size_t a = 0; a < 3; ++a) {
    out[a] = 0;
    for (uint32_t n = begin[point]; n < begin[point + 1]; ++n) out[a] -= slope[3 * size_t(n) + a];
  }
}

// Constants of the points: means over the volume of their cells.
void Body::find_solids() {
  damping_on = drag_on = false;
  for (uint32_t i = 0; i < npoint; ++i) solid[i] = {};
  for (uint32_t c = 0; c < ncell; ++c) {
    const model::Lame m = model::lame_of(at(kYoung, c), at(kPoisson, c));
    for (size_t a = 0; a < 4; ++a) {
      Solid &s = solid[cells[4 * size_t(c) + a]];
      const double part = cell_volume[c];
      s.volume += part;
      s.lambda += part * m.lambda;
      s.mu += part * m.mu;
      s.damping += part * at(kDampingStiffness, c);
      s.drag += part * at(kDampingMass, c);
    }
    damping_on |= at(kDampingStiffness, c) > 0;
    drag_on |= at(kDampingMass, c) > 0;
  }
  for (uint32_t i = 0; i < npoint; ++i) {
    Solid &s = solid[i];
    const double over = s.volume > 0 ? 1 / s.volume : 0;
    for (double *mean : {&s.lambda, &s.mu, &s.damping, &s.drag}) *mean *= over;
    s.volume = volume[i];
    s.drag *= mass[i];
    s.residual = params[kHourglass] * (2 * s.mu * s.volume);
  }
}

void Body::apply_params(const double *values) {
  std::copy(values, values + kParamCount, params);
  find_solids();
  for (uint32_t i = 0; i < npoint; ++i) find_rows(i);
  const char **effect = active_effects;
  *effect++ = "large_rotation";
  if (damping_on || drag_on) *effect++ = "damping";
  *effect = nullptr;
}

}  // namespace meshless
