// Bristles between sub-steps.
//
//   normal turns    contact/store.cpp, transport(): by the smallest rotation that takes it along
//   surfaces spin   here: about the normal, by half of what each of the two turns
//   area changes    here: sigma0 A z is kept where A grows, z where A shrinks
//   bristles slide  here: areas follow the load (contact/areas.h, contact/exchange.h), as far as sliding
//                   renews the bristles (contact/renewal.h)
//
// A surface's turn about n within the sub-step is what its points near the contact did, x -> x': with r from
// their middle, in the plane of n,
//     tan(angle) = sum n . (r x r') / sum r . r'
// is the rotation of least squares (Kabsch 1976, in the plane); exact for a rigid motion, whatever its size.
#include "step/solve/friction_memory.h"

#include <algorithm>

#include "contact/contact_state.h"
#include "friction/laws.h"
#include "state/obstacle.h"
#include "state/world.h"
#include "step/context.h"
#include "step/move_obstacles.h"

namespace dfm {
namespace {

// Share of the bristles renewed in a sub-step up to which a contact counts as at rest: areas then drift by
// less than 1 % in 1e7 sub-steps.
constexpr double kRests = 1e-9;

// A turn in the plane of n: cosine and sine.
struct Turn { double c, s; };
Turn unit_turn(double c, double s) {
  const double size = std::sqrt(c * c + s * s);
  return size > 0 ? Turn{c / size, s / size} : Turn{1, 0};
}

// How a surface turns in the plane of two directions: of the points around a contact's feature, seen from one
// of them, which keeps digits where coordinates are large. Around a corner the next corner of each triangle
// represents both triangles that have it; with the middle of the triangles' corners r_m, q_m and their number
// N that is
//     sum over corners of (r - r_m)(q - q_m) = 2 (sum over the ring of r q - 2/N (sum r)(sum q))
class Neighborhood {
 public:
  Neighborhood(const Body &b, uint32_t origin, Vec3 t1, Vec3 t2)
      : body_(b), axis_{{t1.x, t2.x}, {t1.y, t2.y}, {t1.z, t2.z}}, at_(before(origin)), now_(after(origin)) {}

  void point(uint32_t surfel) {
    const Two r = in_plane(before(surfel) - at_), q = in_plane(after(surfel) - now_);
    along_ += r * q;
    across_ += r * Two{q[1], q[0]};
    r_ += r;
    q_ += q;
  }

  // by: 1 over the weight of all points, the origin's too, where these weigh 1
  Turn turn(double by) const {
    return unit_turn(along_[0] + along_[1] - by * (r_[0] * q_[0] + r_[1] * q_[1]),
                     across_[0] - across_[1] - by * (r_[0] * q_[1] - r_[1] * q_[0]));
  }

 private:
  using Two = double __attribute__((vector_size(16)));
  const Body &body_;
  const Two axis_[3];
  const Vec3 at_, now_;
  Two along_{}, across_{}, r_{}, q_{};

  Two in_plane(Vec3 v) const { return v.x * axis_[0] + v.y * axis_[1] + v.z * axis_[2]; }
  Vec3 before(uint32_t surfel) const { return load3(&body_.surface.x[4 * size_t{surfel}]); }
  Vec3 after(uint32_t surfel) const {
    const Surface &s = body_.surface;
    return s.identity() ? load3(&body_.p.x[size_t(s.point[surfel]) * kStride]) : coupled(surfel);
  }
  Vec3 coupled(uint32_t surfel) const {
    Vec3 now;
    body_.surface.each_phyxel(surfel, [&](uint32_t phyxel, double weight) {
      now += weight * load3(&body_.p.x[size_t(phyxel) * kStride]);
    });
    return now;
  }
};

// t1, t2: tangents of the contact. Corners count once per triangle; the first twelve triangles of a fan are
// used.
Turn turn_of(const Body &b, uint8_t type, uint32_t feature, Vec3 t1, Vec3 t2) {
  constexpr uint32_t kMax = 12;
  const Surface &s = b.surface;
  uint32_t points[kMax], n = 0, origin = feature;
  double corners = 0, shares = 1;
  const auto add_triangle = [&](uint32_t t) {
    if (t == kNone) return;
    for (uint32_t k = 0; k < 3; ++k) points[n++] = s.tri[3 * size_t{t} + k];
    origin = points[0];
    corners += 3;
  };
  if (type == 0) {
    const uint32_t *const fan = &s.fan[s.fan_begin[feature]];
    n = std::min(kMax, s.fan_begin[feature + 1] - s.fan_begin[feature]);
    for (uint32_t k = 0; k < n; ++k) {
      const uint32_t *const c = &s.tri[3 * size_t{fan[k]}];
      points[k] = c[0] == feature ? c[1] : c[1] == feature ? c[2] : c[0];
    }
    corners = 3 * n;
    shares = 2;
  } else if (type == 1) {
    add_triangle(s.edge_tri[2 * size_t{feature}]);
    add_triangle(s.edge_tri[2 * size_t{feature} + 1]);
  } else {
    add_triangle(feature);
  }
  if (n == 0) return {1, 0};
  Neighborhood near(b, origin, t1, t2);
  for (uint32_t k = 0; k < n; ++k) near.point(points[k]);
  return near.turn(shares / corners);
}

// How obstacles turn in the plane of n. Contacts of one obstacle follow each other, so its spin is found once
// for all of them: a look at keyframes takes longer than the rest of a contact's turn.
class ObstacleTurn {
 public:
  ObstacleTurn(const World &w, const StepContext &step) : w_(w), step_(step) {}

  Turn about(Vec3 n, uint32_t slot) {
    if (slot != slot_) {
      slot_ = slot;
      const Obstacle &o = *w_.obstacles[slot];
      moves_ = o.rigid || o.has_target || o.moves();
      if (moves_) spin_ = spin_between(o.pose.rotation, end_pose(w_, step_, o).rotation, 1);
    }
    if (!moves_) return {1, 0};
    const double a = step_.guard.motion * dot(n, spin_);
    const double half = 0.5 * a * (1 + a * a / 12);  // tan(a / 2) up to a^5
    return unit_turn(1 - half * half, 2 * half);     // of length one, as the following halving requires
  }

 private:
  const World &w_;
  const StepContext &step_;
  uint32_t slot_ = kNone;
  bool moves_ = false;
  Vec3 spin_;
};

}  // namespace

void share_areas(World &w, StepContext &step) {
  const auto counts = [](const LawInstance *law) {
    return (law->ops->needs & DFM_NEED_AREA) && !(law->ops->flags & DFM_FRIC_SET_VALUED);
  };
  step.shares = std::any_of(w.pairs.laws.begin(), w.pairs.laws.end(), counts);
  if (!step.shares) {
    step.exchange.clear();
    return step.target_area.clear();
  }
  const uint32_t n = step.rows.soft();
  step.sharing.resize(n);
  step.target_area.resize(n);
  step.keeps_area.resize(n);
  step.ways.resize(n);
  step.renewed.resize(n);
  step.areas.share(step.contacts, step.rows.impulse.data(), 1.1 * w.offset, step.target_area.data());
  for (uint32_t i = 0; i < n; ++i)
    step.sharing[i] = counts(w.pairs.laws[step.state.law[i]]) ? step.state.law[i] : kNone;
  step.exchange.list(step.contacts, step.sources, step.sharing.data(), step.target_area.data());
  step.renewal.list(step.contacts, step.rows.impulse.data());
  for (uint32_t i = 0; i < n; ++i) {
    const uint32_t m = step.match[i];
    const bool carries = step.sharing[i] != kNone && step.rows.impulse[3 * size_t{i}] > 0;
    step.keeps_area[i] = carries && m < w.store.next_area.size() && w.store.law[m] == step.state.law[i] &&
                         w.store.next_area[m] > 0;
    step.state.area[i] = step.keeps_area[i] ? w.store.next_area[m] : step.target_area[i];
  }
  step.renewal.fill(step.keeps_area.data(), step.target_area.data(), step.state.area.data());
}

// Slip beyond the change of the bristles. The slip of the last evaluation is known to one percent
// (friction/local_solve.cpp); up to five percent counts as none.
void follow_load(World &w, StepContext &step) {
  ContactStore &to = step.next_store;
  const ContactState &s = step.state;
  const uint32_t n = static_cast<uint32_t>(step.target_area.size());
  to.next_area.resize(n == 0 ? 0 : to.n);
  if (n == 0) return;
  for (uint32_t i = 0; i < n; ++i) {
    step.ways[i] = {0, 0};
    if (step.sharing[i] == kNone || !(step.rows.impulse[3 * size_t{i}] > 0)) continue;
    const LawInstance &law = *w.pairs.laws[s.law[i]];
    const double x = step.h * s.vt[i], y = step.h * s.vt[s.stride + i], far = std::sqrt(x * x + y * y);
    double pairs = 0;
    for (uint32_t k = 0; k + 1 < law.nstate; ++k) {
      if (!law.tangent[k]) continue;
      const double *const z = &s.bristle[size_t{k} * s.stride + i];
      const double *const after = &s.bristle_out[size_t{k} * s.stride + i];
      const double a = x - (after[0] - z[0]), b = y - (after[s.stride] - z[s.stride]);
      step.ways[i].slid += std::max(0.0, std::sqrt(a * a + b * b) - 0.05 * far);
      step.ways[i].out += std::sqrt(after[0] * after[0] + after[s.stride] * after[s.stride]);
      ++pairs;
      ++k;
    }
    if (pairs == 0) step.ways[i].slid = far;
  }
  step.renewal.measure(step.h, step.rows.impulse.data(), step.ways.data(), s.dwell.data(),
                       step.renewed.data());
  // At rest renewal is rounding only, and the target areas are not needed.
  if (std::all_of(step.renewed.begin(), step.renewed.end(), [](double r) { return r <= kRests; })) {
    std::copy_n(s.area.begin(), to.n, to.next_area.begin());
    return;
  }
  step.exchange.pass(step.contacts, step.sources, step.rows.impulse.data(), step.target_area.data());
  for (uint32_t i = 0; i < to.n; ++i)
    to.next_area[i] = s.area[i] + step.renewed[i] * (step.target_area[i] - s.area[i]);
}

void fit_bristles(World &w, StepContext &step) {
  ContactState &s = step.state;
  if (s.nstate == 0) return;
  for (uint32_t i = 0; i < step.rows.soft(); ++i) {
    const uint32_t m = step.match[i];
    if (m == kNone || !(w.store.area[m] < s.area[i])) continue;
    const LawInstance &law = *w.pairs.laws[s.law[i]];
    for (uint32_t k = 0; k < law.nstate; ++k)
      if (law.tangent[k]) s.bristle[size_t(k) * s.stride + i] *= w.store.area[m] / s.area[i];
  }
}

void turn_frames(World &w, StepContext &step) {
  ContactStore &to = step.next_store;
  ObstacleTurn obstacle(w, step);
  for (uint32_t i = 0; i < to.n; ++i) {
    const LawInstance &law = *w.pairs.laws[step.state.law[i]];
    if (!law.turns || !to.touching[i]) continue;
    const ContactPoint &c = step.contacts[i];
    const Vec3 n = load3(c.normal), t = load3(&to.tangent[3 * size_t{i}]);
    const Vec3 side = cross(n, t);
    const Turn a = turn_of(*w.bodies[c.slot_a], c.type_a, c.feature_a, t, side);
    const Turn b = c.obstacle
                       ? obstacle.about(n, c.slot_b)
                       : turn_of(*w.bodies[c.slot_b], c.kind == kEdgeEdge ? 1 : 2, c.feature_b, t, side);
    // half of the sum
    const Turn both{a.c * b.c - a.s * b.s, a.c * b.s + a.s * b.c}, mean = unit_turn(1 + both.c, both.s);
    store3(&to.turned[3 * size_t{i}], mean.c * t + mean.s * side);
  }
}

}  // namespace dfm
