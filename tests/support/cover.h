// Runs the scene of a row (cover_scene.h) and says what does not hold. What is asked, and why these bounds,
// stands in doc/reference/combinations.md.
#pragma once
#include <ctime>

#include "cover_scene.h"
#include "crossing.h"
#include "voxel_core.h"

namespace test::cover {

// Largest values of what is bounded.
struct Seen {
  bool refused = false;
  std::string reason;              // why it was refused or stopped
  std::vector<std::string> wrong;  // what does not hold, a sentence each
  double momentum = 0;  // of a body and a step: what its impulses do not explain, over the weight's impulse
  double cone = 0;  // friction beyond what the law allows, sum over contacts, over weight and normal forces
  double cone_cut = 0;  // the same in steps that end at the cap on sweeps, as the step tells
  double work = 0;      // J, that friction has done on the pair
  double gain = 0;      // kinetic, elastic and potential energy above the start's, over the largest seen
  double creep = 0;     // m/s, of what is held
  double slide = 0;     // acceleration on the steep slope over the law's, less 1
  double slip = 0;      // m/s, fastest contact of the pair
  size_t crossings = 0;
  uint32_t stuck = 0;
  uint64_t unconverged = 0;  // steps
  uint64_t substeps = 0;
  double cpu = 0;  // s
};

class Run {
 public:
  Run(const Row &row, Seen &seen)
      : seen_(seen),
        s_(row),
        explicit_(level(row, kIntegrator) == "symplectic_euler"),
        self_(s_.upper == s_.lower),
        step_(explicit_ ? 1.0 / 960 : 1.0 / 240) {
    for (const dfm_body b : s_.bodies) triangles_.push_back(surface_triangles(b));
    wall_ = s_.triangles.points;
    if (s_.ground_shape == DFM_SHAPE_VOXELS) {
      dfm_obstacle_def d{};
      d.size = sizeof d;
      ok(dfm_obstacle_get_def(s_.ground, &d));
      wall_ = cli::voxel_core(d);
    }
    if (s_.ground_shape == DFM_SHAPE_VOXELS || s_.ground_shape == DFM_SHAPE_BOX)
      for (size_t i = 2; i < wall_.size(); i += 3) wall_[i] -= 0.05;
  }

  void all() {
    const bool slides_always = s_.law() == "none";
    drop();
    if (slides_always) {
      tilt(0, 0.1, 16);
      slide(0.1, 0);
    } else {
      tilt(0, kHeld * kMu, 16);
      hold();
      tilt(kHeld * kMu, kSteep * kMu, 8);
      slide(kSteep * kMu, kMu);
    }
    judge();
  }

 private:
  static constexpr double kHeld = 0.7, kSteep = 1.5;  // slopes, of what friction holds
  static constexpr double kFrame = 1.0 / 240;         // s, what times are counted in
  static constexpr long kLook = 16;                   // frames, of a measurement
  static constexpr double kCreep = 1e-6;              // m/s

  struct Stopped {};

  void say(const char *format, double a, double b = 0) {
    char text[400];
    std::snprintf(text, sizeof text, format, a, b);
    seen_.wrong.emplace_back(text);
  }

  // ---- what happens

  void gravity(double slope) {
    const double c = 1 / std::hypot(1, slope);
    gravity_ = {0, 0, -kG * c};
    gravity_[s_.along] = kG * slope * c;
    ok(dfm_world_set_gravity(s_.world, gravity_.data()));
  }
  void frames(long n) {
    for (long i = 0, steps = std::lround(double(n) * kFrame / step_); i < steps; ++i) one_step();
  }
  void drop() {
    start_energy_ = energy();
    watching_energy_ = true;
    frames(32);
    watching_energy_ = false;
  }
  void tilt(double from, double to, long n) {
    for (long i = 1; i <= n; ++i) {
      const double s = double(i) / double(n);
      gravity(from + (to - from) * s * s * (3 - 2 * s));
      frames(1);
    }
  }
  // Soft bodies ring for some time. What still moves is looked at again after a longer time, as long
  // as it has halved in the last one: ringing does, creep does not.
  void hold() {
    seen_.creep = HUGE_VAL;
    for (long wait = 40; wait <= 640; wait *= 2) {
      frames(wait);
      const double last = seen_.creep;
      look_for_creep();
      if (seen_.creep <= kCreep || !(seen_.creep <= 0.5 * last)) break;
    }
    for (const dfm_contact &c : contacts(s_.world))
      seen_.stuck += of_pair(c) && (c.flags & DFM_CONTACT_STICKING);
  }
  void look_for_creep() {
    const Vec before = place();
    ok(dfm_world_hold_begin(s_.world));
    frames(kLook);
    const Vec after = place();
    seen_.creep = apart(before, after) / (double(kLook) * kFrame);
    double contact = 0;
    ok(dfm_world_hold(s_.world, &contact, nullptr));
    seen_.creep = std::max(seen_.creep, contact);
  }
  void slide(double slope, double mu) {
    frames(8);
    const double before = speed();
    frames(kLook);
    const double after = speed();
    const double expected = kG * (slope - mu) / std::hypot(1, slope);
    if (!self_) seen_.slide = std::fabs((after - before) / (double(kLook) * kFrame) / expected - 1);
  }

  // ---- what is looked at

  bool of_pair(const dfm_contact &c) const {
    if (self_) return c.body_a == s_.upper && c.body_b == s_.upper;
    const uint64_t other = c.kind == DFM_CONTACT_PRIMITIVE ? obstacle(c) : c.body_b;
    return (c.body_a == s_.upper && other == s_.lower) || (c.body_a == s_.lower && other == s_.upper);
  }
  uint64_t obstacle(const dfm_contact &c) const { return listed(dfm_world_obstacles, s_.world)[c.feature_b]; }

  dfm_body_measure upper() const { return s_.rigid ? rigid_measure(s_.rigid) : measure(s_.upper); }
  double speed() const { return upper().velocity[s_.along]; }
  // Of what is held, against what holds it where that may move.
  Vec place() const {
    Vec at = vec(upper().com);
    if (s_.lower != s_.ground && !self_) {
      const dfm_body_measure m = measure(s_.lower);
      for (size_t k = 0; k < 3; ++k) at[k] -= m.com[k];
    }
    return at;
  }
  std::vector<std::pair<uint64_t, dfm_body_measure>> movers() const {
    std::vector<std::pair<uint64_t, dfm_body_measure>> out;
    for (const dfm_body b : s_.bodies) out.emplace_back(b, measure(b));
    if (s_.rigid) out.emplace_back(s_.rigid, rigid_measure(s_.rigid));
    return out;
  }
  // Kinetic, elastic where the model tells it, and potential; without the potential.
  std::pair<double, double> energy() const {
    double all = 0, mechanical = 0;
    for (const auto &[handle, m] : movers()) {
      const double e = m.kinetic + (std::isnan(m.elastic) ? 0 : m.elastic);
      mechanical += e;
      all += e - m.mass * dot(gravity_, vec(m.com));
    }
    return {all, mechanical};
  }

  void one_step() {
    const auto before = movers();
    uint32_t trouble = 0;
    const dfm_status status = dfm_world_step(s_.world, step_, &trouble);
    converged_ = !(trouble & DFM_TROUBLE_UNCONVERGED);
    seen_.unconverged += !converged_;
    if (status != DFM_OK) {
      seen_.reason = dfm_last_error();
      throw Stopped{};
    }
    look_at_momentum(before);
    look_at_contacts();
    if (watching_energy_) {
      const auto [all, mechanical] = energy();
      most_energy_ = std::max(most_energy_, mechanical);
      rise_ = std::max(rise_, all - start_energy_.first);
    }
    if (++steps_ % std::lround(kFrame / step_) == 0) check_surfaces();
  }

  // Change of momentum = gravity's impulse + the impulses that the pairs report, of each body.
  void look_at_momentum(const std::vector<std::pair<uint64_t, dfm_body_measure>> &before) {
    const auto after = movers();
    const auto reported = listed(dfm_world_pair_impulses, s_.world);
    for (size_t i = 0; i < after.size(); ++i) {
      const uint64_t handle = after[i].first;
      const double mass = after[i].second.mass;
      Vec left{};
      for (size_t k = 0; k < 3; ++k) {
        left[k] = after[i].second.momentum[k] - before[i].second.momentum[k] - mass * gravity_[k] * step_;
        for (const dfm_pair_impulse &p : reported) {
          if (p.a == p.b) continue;
          if (p.a == handle) left[k] -= p.impulse[k];
          if (p.b == handle) left[k] += p.impulse[k];
        }
      }
      const double off = norm(left) / (mass * kG * step_);
      if (!std::isfinite(off)) finite_ = false;
      seen_.momentum = std::max(seen_.momentum, off);
    }
  }

  // The most that the law lets friction be, N.
  double limit(const dfm_contact &c) const {
    if (s_.law() == "none") return 0;
    double most = kMu * c.fn;
    // micro-damping beside the bristle, |dz/dt| <= 2 |v| (doc/laws/formulas.md, (3))
    if (s_.law() == "lugre" || s_.law() == "elastoplastic")
      most += 2 * 1e3 * c.area * std::hypot(c.slip[0], c.slip[1]);
    return most;
  }
  void look_at_contacts() {
    const double weight = upper().mass * kG;
    double over = 0, pressed = weight;
    for (const dfm_contact &c : contacts(s_.world)) {
      if (!of_pair(c)) continue;
      if (c.fn < 0) seen_.cone = HUGE_VAL;
      pressed += c.fn;
      over += std::max(0.0, std::hypot(c.ft[0], c.ft[1]) - limit(c));
      if (c.fn > 1e-6 * weight) seen_.slip = std::max(seen_.slip, std::hypot(c.slip[0], c.slip[1]));
    }
    double &cone = converged_ ? seen_.cone : seen_.cone_cut;
    cone = std::max(cone, over / pressed);
    for (const dfm_pair_report &p : listed(dfm_world_pairs, s_.world))
      if ((p.a == s_.upper && p.b == s_.lower) || (p.a == s_.lower && p.b == s_.upper))
        seen_.work = std::max(seen_.work, p.friction_work);
  }

  void check_surfaces() {
    std::vector<std::vector<double>> x;
    for (const dfm_body b : s_.bodies) x.push_back(surface_positions(b));
    size_t found = 0;
    for (const auto &p : x)
      for (const double v : p)
        if (!std::isfinite(v)) finite_ = false;
    if (!finite_) throw Stopped{};
    std::vector<crossing::Surface> surfaces;
    for (size_t b = 0; b < x.size(); ++b)
      surfaces.push_back(
          {x[b].data(), uint32_t(x[b].size() / 3), triangles_[b].data(), uint32_t(triangles_[b].size() / 3)});
    std::vector<double> moved;
    static const Triangles kBlock = box_surface({0.03, 0.03, 0.015}, 1);
    if (s_.rigid) {
      const dfm_rigid_state r = state(s_.rigid);
      for (size_t i = 0; i < kBlock.points.size(); i += 3) {
        const Vec p = turned(r.rotation, &kBlock.points[i]);
        for (size_t k = 0; k < 3; ++k) moved.push_back(r.position[k] + p[k]);
      }
      surfaces.push_back({moved.data(), uint32_t(moved.size() / 3), kBlock.tris.data(),
                          uint32_t(kBlock.tris.size() / 3), true});
    }
    if (s_.ground_shape == DFM_SHAPE_PLANE)
      for (const auto &p : x)
        for (size_t i = 2; i < p.size(); i += 3) found += p[i] < -1e-12;
    else
      surfaces.push_back({wall_.data(), uint32_t(wall_.size() / 3), s_.triangles.tris.data(),
                          uint32_t(s_.triangles.tris.size() / 3), true});
    const crossing::Found crossed = crossing::Counter().count(surfaces, crossing::Touching::counts);
    found += crossed.between + (self_ ? crossed.within : 0);
    seen_.crossings = std::max(seen_.crossings, found);
  }
  static Vec turned(const double q[4], const double p[3]) {
    Vec t, out;
    for (size_t k = 0; k < 3; ++k)
      t[k] = 2 * (q[(k + 1) % 3] * p[(k + 2) % 3] - q[(k + 2) % 3] * p[(k + 1) % 3]);
    for (size_t k = 0; k < 3; ++k)
      out[k] = p[k] + q[3] * t[k] + q[(k + 1) % 3] * t[(k + 2) % 3] - q[(k + 2) % 3] * t[(k + 1) % 3];
    return out;
  }

  // ---- what must hold

  void judge() {
    const bool holds = s_.law() != "none";
    seen_.gain = rise_ / most_energy_;
    if (!finite_) say("not finite", 0);
    if (seen_.crossings) say("%g crossings", double(seen_.crossings));
    if (!(seen_.momentum <= 1e-9)) say("momentum: %.3g of the weight's impulse in a step", seen_.momentum);
    if (!(seen_.cone <= 1e-2))
      say("friction exceeds what its law allows by %.3g of what presses", seen_.cone);
    if (!(seen_.cone_cut <= 0.1))
      say("where sweeps end early friction exceeds what its law allows by %.3g of what presses",
          seen_.cone_cut);
    const double work = 1e-6 * most_energy_;
    if (!(seen_.work <= work)) say("friction has done %.3g J of work; at most %.3g J", seen_.work, work);
    if (!(seen_.gain <= 0.01)) say("gains %.3g of its energy", seen_.gain);
    if (holds && !(seen_.creep <= kCreep)) say("creeps with %.3g m/s", seen_.creep);
    if (holds && seen_.stuck < 1) say("%g contacts stick where all must", 0);
    const double within = s_.lower == s_.ground ? 0.01 : 0.05;
    if (!(seen_.slide <= within))
      say("slides with %.3g of the law's acceleration too much or too little", seen_.slide);
    if (!(seen_.slip >= 1000 * kCreep))
      say("slides with %.3g m/s at most: not the scene that it should be", seen_.slip);
  }

  Seen &seen_;
  Scene s_;
  bool explicit_, self_;
  double step_;
  uint64_t steps_ = 0;
  Vec gravity_{0, 0, -kG};
  std::vector<std::vector<uint32_t>> triangles_;
  std::vector<double> wall_;
  std::pair<double, double> start_energy_{};
  double most_energy_ = 0, rise_ = 0;
  bool watching_energy_ = false, finite_ = true, converged_ = true;

  friend Seen run(const Row &row);
};

inline Seen run(const Row &row) {
  Seen seen;
  const std::clock_t start = std::clock();
  try {
    Run r(row, seen);
    try {
      r.all();
    } catch (const Run::Stopped &) {
      seen.wrong.push_back("stopped at " + std::to_string(dfm_world_time(r.s_.world)) + " s: " + seen.reason);
    }
    seen.substeps = stats(r.s_.world).substeps;
  } catch (const Refused &r) {
    seen.refused = true;
    seen.reason = r.sentence;
  }
  seen.cpu = double(std::clock() - start) / CLOCKS_PER_SEC;
  return seen;
}

}  // namespace test::cover
