#include "world/step_bound.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/error.h"
#include "integrate/symplectic_euler.h"
#include "world/spring.h"
#include "world/world.h"

namespace dfm {
namespace {

// The bound depends on the state (volume terms stiffen as cells grow, tilted springs as they stretch). 0.9 of
// it is used, which pays for what a shape changes by about a twentieth of its lengths; so it is asked for
// again after 16 sub-steps, sooner where the edges stretch faster.
constexpr uint32_t kBoundEvery = 16;
constexpr double kBoundShare = 0.9, kBoundStrain = 0.05;

uint32_t inverted_cells(const Body &b) {
  uint32_t n = 0;
  for (size_t t = 0; t < b.tets.size(); t += 4) n += tet_volume(b.p.x.data(), kStride, &b.tets[t]) < 0;
  return n;
}

// The fastest stretch of an edge, 1/s; turning gives none.
double strain_rate(const Body &b) {
  const double *const x = b.p.x.data(), *const v = b.p.v.data();
  double most = 0;
  for (size_t e = 0; e < b.edges.size(); e += 2) {
    const size_t i = size_t(b.edges[e]) * kStride, j = size_t(b.edges[e + 1]) * kStride;
    const Vec3 d = load3(x + j) - load3(x + i);
    const double dd = norm2(d), stretch = std::fabs(dot(d, load3(v + j) - load3(v + i)));
    if (stretch > most * dd) most = dd > 0 ? stretch / dd : most;
  }
  return most;
}

void ask_bound(World &w, Body &b) {
  b.bound = {true, std::numeric_limits<double>::infinity(), 0, inverted_cells(b)};
  if (b.model.stepper || !b.model.ops->bound) return;
  std::fill(b.ksum.begin(), b.ksum.end(), 0.0);
  std::fill(b.csum.begin(), b.csum.end(), 0.0);
  double cell = std::numeric_limits<double>::infinity();
  const dfm_kin k = b.kin(w.time, 0, nullptr);
  if (b.model.call("bound", [&] {
        return b.model.ops->bound(b.model.self, &k, b.ksum.data(), b.csum.data(), &cell);
      }) != DFM_OK)
    fail(DFM_E_FATAL, "model '%s' of body '%s' gives no step bound", b.model.type->id, b.name.c_str());
  for (const Spring &spring : b.springs) add_spring_bound(b, spring);
  b.bound.step = std::min(cell, stable_step(b.p, b.ksum.data(), b.csum.data(), &b.bound.point));
}

}  // namespace

bool bound_due(const World &w) { return w.bound_age >= kBoundEvery; }

void update_bound(World &w) {
  w.stable = std::numeric_limits<double>::infinity();
  w.worst_body = nullptr;
  w.worst_point = 0;
  w.inverted = 0;
  uint32_t limited = 0;
  double fastest = 0;
  for (auto &b : w.bodies) {
    const bool stays = b->slumber.asleep && b->bound.known;
    if (!stays) ask_bound(w, *b);  // who sleeps counts too: the step must not change when it wakes
    w.inverted += b->bound.inverted;
    limited += b->model.limited_cells();
    if (!stays && !b->model.stepper && b->model.ops->bound) fastest = std::max(fastest, strain_rate(*b));
    if (b->bound.step < w.stable) {
      w.stable = b->bound.step;
      w.worst_body = b.get();
      w.worst_point = b->bound.point;
    }
  }
  w.stable *= kBoundShare;
  w.stats.stable_step = w.stable;
  w.stats.inverted_max = std::max(w.stats.inverted_max, w.inverted);
  w.stats.limited_max = std::max(w.stats.limited_max, limited);
  const double keeps = kBoundStrain / (fastest * w.stable);  // sub-steps
  w.bound_age =
      keeps >= kBoundEvery || !(fastest > 0) ? 0 : kBoundEvery - static_cast<uint32_t>(std::max(1.0, keeps));
}

}  // namespace dfm
