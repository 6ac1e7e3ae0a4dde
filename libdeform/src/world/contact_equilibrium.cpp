// Each step is a step of the world from rest, with the usual contact, friction and guard. Two things differ:
// the dynamics of bodies (SettlingPoints), and prescribed motions and loads are constant at their
// values at the end of the load step (World::prescribed).
//
//   load step   gravity and loads at its share; keys and sines go on to its time
//     rounds    what relaxes has done so, until that changes nothing
//       steps   until forces are balanced and nothing has moved
#include "world/equilibrium.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <vector>
#include <utility>

#include "core/error.h"
#include "dynamics/at_rest.h"
#include "state/bounds.h"
#include "state/obstacle.h"
#include "state/world.h"
#include "step/budget.h"
#include "step/context.h"
#include "step/stages.h"
#include "step/step_impulses.h"
#include "step/watch/energy_watch.h"
#include "world/change_energy.h"
#include "world/rest_loads.h"
#include "dynamics/implicit_points.h"

namespace dfm {
namespace {

// Points on their way to an equilibrium with contact, in steps of backward Euler from rest:
//
//   f(x) + loads + M g + contact = (M / h^2 + S) (x - x0)
//
// (S: of compliant loads, and of what slows touched points, N/m)
// which is the condition of equilibrium once x stops changing. M / h^2 decides the length of a step, not
// where steps end; it bounds the motion of bodies that nothing holds (the proximal point method, Rockafellar
// 1976). A step starts with the contact forces of the step before. Without them bodies would fall freely by
// h^2 g before contacts are found, which is meters in a step of a second.

class SettlingPoints : public ImplicitPoints {
 public:
  // softness: [npoint] N/m, S. error: m, tolerance of Newton's method for points at rest.
  SettlingPoints(const Memory &memory, Phyxels &points, Surface &surface, ModelInstance &model,
                 const ImplicitOptions &options, const std::vector<double> &softness, double error);

  // The contact forces to start with: impulses at the surfels [nsurfel,3] over h seconds; h 0: none.
  void start_from(const double *surfel_impulse, double h);
  // In the next steps, points that contacts push, or have pushed since the last call with 0, resist their
  // motion in a step by this multiple of their own stiffness, as softness does. It shortens steps there, and
  // does not change where they end.
  void slow_touched(double times);
  const double *contact_force() const { return last_.data(); }  // [npoint,3] N, of the last step
  double stiffest() const { return stiffest_; }                 // N/m, of a point, in the last step

  Abilities abilities() const override {
    Abilities a = ImplicitPoints::abilities();
    a.damps = false;  // its steps are not steps in time
    return a;
  }
  bool bound(double time, double share, const AddRowSums &outside, StepBound &out) override;
  bool free_motion(const SubStep &now, double &kinetic) override;
  // with the last contact forces: used to find contacts
  const double *point_velocity() const override { return guess_.data(); }
  const double *start() const override { return guess_.data(); }
  bool end_state(const SubStep &now, const double *surfel_impulse, bool touched) override;
  double accurate_step(const SubStep &) const override { return std::numeric_limits<double>::infinity(); }
  void commit(const SubStep &now, double fraction) override;

 private:
  double error_allowed_, stiffest_ = 0;
  double slowed_ = 0;  // multiple of their own stiffness by which touched points resist
  // [npoint] N/m: stiffness of loads; the model's own at a touched point, else 0
  Array<double> springs_of_loads_, own_;
  Array<double> last_, next_;  // [npoint,3] N, contact forces of the last step and at the end of this one
  Array<double> guess_;        // [npoint,4] m/s
  Array<double> load_;         // [npoint,4] N, loads alone
  // [npoint,3] N s, m/s: the last contact forces, and their effect on velocities
  Array<double> impulse_, taken_;
};

SettlingPoints::SettlingPoints(const Memory &memory, Phyxels &points, Surface &surface, ModelInstance &model,
                               const ImplicitOptions &options, const std::vector<double> &softness,
                               double error)
    : ImplicitPoints(memory, points, surface, model, options), error_allowed_(error) {
  use_memory(memory, softness_, last_, next_, guess_, load_, impulse_, taken_, springs_of_loads_, own_);
  for (Array<double> *a : {&last_, &next_, &impulse_, &taken_}) a->assign(size_t{3} * points.n, 0.0);
  guess_.assign(size_t{kStride} * points.n, 0.0);
  softness_.assign(softness.begin(), softness.end());
  springs_of_loads_ = softness_;
  own_.assign(points.n, 0.0);
}

void SettlingPoints::start_from(const double *surfel_impulse, double h) {
  std::fill(last_.begin(), last_.end(), 0.0);
  if (h > 0) spread_impulses(surfel_impulse, 1 / h, last_);
}

void SettlingPoints::slow_touched(double times) {
  if (times == 0 && slowed_ == 0) return;
  if (times == 0) std::fill(own_.begin(), own_.end(), 0.0);
  else
    for (uint32_t i = 0; i < p_.n; ++i) {
      const double *const push = &last_[size_t{3} * i];
      if (own_[i] == 0 && (push[0] != 0 || push[1] != 0 || push[2] != 0)) own_[i] = own_stiffness(i);
    }
  slowed_ = times;
  bool changed = false;
  for (uint32_t i = 0; i < p_.n; ++i) {
    const double before = std::exchange(softness_[i], springs_of_loads_[i] + times * own_[i]);
    changed = changed || softness_[i] != before;
  }
  if (changed) softness_changed();
}

// The scheme is stable at any step, also with loads that depend on positions.
bool SettlingPoints::bound(double, double, const AddRowSums &, StepBound &out) {
  out = {};
  return true;
}

// One linear correction only: with contact forces that do not rotate with the body, a standing body may have
// no equilibrium near, and Newton's method would search for it forever.
bool SettlingPoints::free_motion(const SubStep &now, double &) {
  load_ = p_.load;
  for (uint32_t i = 0; i < p_.n; ++i)
    for (uint32_t c = 0; c < 3; ++c) {
      p_.load[size_t{kStride} * i + c] += last_[size_t{3} * i + c];
      impulse_[size_t{3} * i + c] = now.h * last_[size_t{3} * i + c];
    }
  options_.rest = error_allowed_ / now.h;
  const bool found = take_first_way(now);
  p_.load.swap(load_);
  guess_ = p_.v_free;
  if (!found || !solve(impulse_, taken_)) return false;
  stiffest_ = largest_diagonal() / (now.h * now.h);
  double nan_flag = 0;
  for (uint32_t i = 0; i < p_.n; ++i)
    for (uint32_t c = 0; c < 3; ++c) {
      const size_t at = size_t{kStride} * i + c;
      p_.v_free[at] -= taken_[size_t{3} * i + c];
      nan_flag += 0.0 * p_.v_free[at];
    }
  return nan_flag == 0;
}

bool SettlingPoints::end_state(const SubStep &now, const double *surfel_impulse, bool touched) {
  std::fill(next_.begin(), next_.end(), 0.0);
  if (touched) spread_impulses(surfel_impulse, 1 / now.h, next_);
  return ImplicitPoints::end_state(now, surfel_impulse, touched);
}

void SettlingPoints::commit(const SubStep &now, double fraction) {
  last_.swap(next_);
  ImplicitPoints::commit(now, fraction);
}

// s, length of a step. The longer it is, the more the stiffness and the less the mass of a body decides its
// end.
constexpr double kLongest = 1, kShortest = 1e-4;
// Tolerances: of Newton's method and contact in a step, relative to the median edge of a body; of the motion
// in the last step, relative to the size of the body; of forces at a point, relative to the largest load,
// reaction or contact force (or their rounding); of contacts and friction, relative to the rest distance.
constexpr double kGap = 0.01, kError = 1e-7, kContact = 2e-8, kMoves = 1e-6, kLeft = 1e-6;
// Limit on the motion of an unsupported body in a step: the median edge at first, less if steps are halved,
// down to the first share of it; more if they converge well, up to the second share of its size.
constexpr double kInner = 0.1, kOuter = 0.25;
constexpr double kNet = 0.1;      // share of the tolerance, for the sum of forces on a body
constexpr uint32_t kSteps = 500;  // of a round
constexpr uint32_t kWaits = 50;   // steps to wait for rest before keys advance
constexpr uint32_t kRounds = 4;   // of relaxation
constexpr uint32_t kRefused = 8;  // consecutive failed steps
// A body whose step goes back by more than this share of the step before is slowed where it is touched; if it
// goes on by more than that, it is slowed less, by this factor. Limit on the share that counts.
constexpr double kOvershoots = 0.5, kSpeedsUp = 0.5, kMaxOvershoot = 2;
constexpr double kMaxSlowed = 1e3;
constexpr double kAway = 10;  // of its size: a body in contact that has moved so far keeps sliding

class Settling {
 public:
  Settling(World &w, const dfm_equilibrium_def &def, dfm_equilibrium_info &info)
      : w_(w),
        step_(*w.steps),
        info_(info),
        start_{w.time, def.load_from},
        end_{w.time + def.time, def.load_to} {
    if (def.tolerance > 0) tolerance_ = def.tolerance;
    if (def.max_iterations) most_ = def.max_iterations;
    for (auto &b : w.bodies) bodies_.push_back(make(*b));
    earlier_.swap(w.events);  // a long search produces more than a world keeps
    write_down(w_, step_, before_);
    stats_ = w.stats;
    steps_ = w.step_count;
    sizes_ = w.sizes;
    suspended_ = w.overlaps.suspended;
    def_ = w.def;
    exchange();
    wake_all(w_);  // adds the contact impulses of the meantime
    for (One &one : bodies_) one.contact_impulse = one.body->contact_impulse;
    w.def.sleep = 0;
    w.changed = true;
  }
  Settling(const Settling &) = delete;
  ~Settling() {
    exchange();
    w_.def = def_;
    w_.prescribed = {};
    w_.changed = true;
    if (!done_) w_.overlaps.suspended.swap(suspended_);
    try {
      set_gravity_now(w_);
      prepare(w_);
    } catch (...) {  // no memory for the tables: they are made at the next use
    }
    if (done_) return;
    restore_start(w_, step_, before_);
    w_.events.swap(earlier_);
    for (auto &b : w_.bodies) set_loads(*b, w_.time, 1);
  }

  void run(uint32_t load_steps) {
    prepare(w_);
    for (uint32_t k = 1; k <= load_steps; ++k) {
      reach(k == load_steps ? end_ : between(start_, end_, double(k) / load_steps));
      ++info_.load_steps;
    }
    keep();
  }

 private:
  struct One {
    Body *body;
    std::unique_ptr<Dynamics> other;  // its normal dynamics; exchanged during the search
    SettlingPoints *points;
    std::unique_ptr<AtRest> rest;
    double size, edge;           // m
    Vec3 contact_impulse;        // N s, before the search
    double reach = 0;            // m, limit on its motion without contact in the next step
    double slid = 0;             // m moved since it has been in contact
    std::vector<double> last{};  // [npoint,4] m, at the start of the step
    double left = 0, scale = 0;  // N, largest component of unbalanced forces; of all forces
    double moved = 0;            // m, in the last step
    double net = 0, all = 0;     // N, sum of external forces, sum of their norms
    double pull = 0;             // m/s2, acceleration by this sum
    bool touches = false;
    std::vector<double> way{}, way_before{};  // [npoint,4] m, of the last two steps; empty: unknown
    double slowed = 0;                        // SettlingPoints::slow_touched
  };

  One make(Body &b) const {
    ImplicitOptions options = w_.implicit;
    options.rest_factor = false;
    if (options.solver == "auto" && b.p.n <= kFactoredAtRest) options.solver = "ldlt";
    options.newton = std::max(options.newton, ImplicitOptions{}.newton);
    auto points = std::make_unique<SettlingPoints>(w_.memory(), b.p, b.surface, b.model, options,
                                                   softness_of(b), kError * b.surface.median_edge);
    points->start_from(b.surfel_impulse.data(), b.impulse_time());
    SettlingPoints *const own = points.get();
    return {.body = &b,
            .other = std::move(points),
            .points = own,
            .rest = std::make_unique<AtRest>(w_.memory(), b.p, b.model),
            .size = extent_of(b.p.x.data(), b.p.n, kStride).longest(),
            .edge = b.surface.median_edge,
            .contact_impulse = {}};
  }

  void exchange() {
    for (One &one : bodies_) one.body->dynamics.swap(one.other);
  }

  void reach(const Station &to) {
    w_.prescribed = {to.time, to.share};
    if (w_.gravity.keys.empty()) w_.gravity.now = to.share * load3(w_.def.gravity);
    for (One &one : bodies_) {
      set_loads(*one.body, w_.prescribed.at(w_.time), to.share);
      one.reach = one.edge;
      one.slid = 0;
      one.slowed = 0;
      one.points->slow_touched(0);
      one.way.clear();
    }
    for (uint32_t round = 0;; ++round) {
      const uint32_t steps = come_to_rest(to);
      if ((round > 0 && steps <= 1) || round == kRounds || !relax()) return;
    }
  }

  bool relax() {
    bool any = false;
    for (One &one : bodies_) any = one.rest->relax(w_.time) || any;
    return any;
  }

  // Number of steps with all prescribed motions at their end.
  uint32_t come_to_rest(const Station &to) {
    stop_motion();
    weigh_all(kLongest);
    double longest = kLongest;
    uint32_t refused = 0, before = 0;
    // Keys advance after bodies rest under the new loads: otherwise unloaded contacts would not carry bodies
    // along.
    bool goes_on = w_.time >= to.time;
    for (uint32_t steps = 0;;) {
      const double h = length(longest);
      w_.prescribed.until = goes_on ? std::min(to.time, w_.time + way_on(to)) : w_.time;
      const uint64_t pieces = w_.stats.substeps;
      const bool taken = step(h);
      const bool whole = taken && w_.stats.substeps == pieces + 1;
      const double off = h * w_.stats.residual / w_.offset;  // of contacts, relative to the rest distance
      w_.time = w_.prescribed.at(w_.time);
      const bool there = w_.time >= to.time;
      stop_motion();
      ++info_.iterations;
      if (there) ++steps;
      if (taken) refused = 0;
      else if (++refused == kRefused)
        fail(DFM_E_DIVERGED,
             "no equilibrium was found, because a step from rest failed (%s); use more load_steps, hold what "
             "moves freely, or raise max_time and max_work",
             dfm_last_error());
      weigh_all(h);
      bool rests = taken && off <= kGap;
      for (One &one : bodies_) {
        one.reach = whole ? std::min(1.5 * one.reach, std::max(one.edge, kOuter * one.size))
                          : std::max(0.5 * one.reach, kInner * one.edge);
        one.slid = there && one.touches ? one.slid + one.moved : 0;
        rests = rests && one.moved <= kMoves * one.size && balanced(one);
      }
      if (there)
        for (One &one : bodies_) slow_overshoot(one, whole);
      if (rests && there) return steps;
      goes_on = goes_on || rests || ++before == kWaits;
      longest = whole ? std::min(kLongest, 2 * h) : 0.5 * h;
      if (there) check_progress(steps, h);
    }
  }

  // Each step solves for the impulses of contacts whose places and normals are those before it. Where a body
  // gives way, they turn: the foot of a sphere on a face moves away from the corner that it has pressed down.
  // If its next place overshoots by more than it was off, long steps go to and fro for ever. They converge if
  // the touched points go only a part of the way, 1 / (1 + slowed):
  // doc/decisions/implicit_time.md. overshoot: the factor between the ways of the last two
  // steps, if they are opposite.
  void slow_overshoot(One &one, bool whole) {
    one.way_before.swap(one.way);
    if (!whole) return one.way.clear();
    const Array<double> &x = one.body->p.x;
    one.way.resize(x.size());
    for (size_t at = 0; at < x.size(); ++at) one.way[at] = x[at] - one.last[at];
    if (one.way_before.size() != one.way.size()) return;
    double both = 0, square = 0;
    for (size_t at = 0; at < x.size(); ++at) {
      both += one.way[at] * one.way_before[at];
      square += one.way_before[at] * one.way_before[at];
    }
    const double overshoot = square > 0 ? -both / square : 0;
    if (overshoot > kOvershoots)
      one.slowed = std::min(one.slowed + (1 + one.slowed) * std::min(overshoot, kMaxOvershoot), kMaxSlowed);
    else if (overshoot < -kOvershoots) one.slowed *= kSpeedsUp;
    if (one.slowed > 0) one.points->slow_touched(one.slowed);
  }

  // Returns false if it failed; the world is then at the end of its last completed part.
  bool step(double h) {
    double edge = HUGE_VAL;
    for (One &one : bodies_) {
      one.last.assign(one.body->p.x.begin(), one.body->p.x.end());
      edge = std::min(edge, one.edge);
    }
    w_.def.contact_tolerance = kContact * edge / h;
    uint32_t trouble = 0;
    const dfm_status status = step_within_budget(w_, h, &trouble);
    if (trouble & DFM_TROUBLE_INTERRUPTED)
      fail(DFM_DISCARD, "the search for an equilibrium was interrupted; the world is as before it");
    return status == DFM_OK;
  }

  bool balanced(const One &one) const {
    return one.net <= kNet * tolerance_ * one.all &&
           one.left <= std::max(tolerance_ * one.scale,
                                kForceRounding * one.points->stiffest() *
                                    largest_coordinate(one.body->p.x.data(), one.body->p.n, kStride));
  }

  void stop_motion() {
    for (auto &b : w_.bodies) {
      std::fill(b->p.v.begin(), b->p.v.end(), 0.0);
      relax_dampers(b->p);
      b->dynamics->points_changed();
    }
  }

  void weigh_all(double h) {
    for (One &one : bodies_) {
      set_loads(*one.body, w_.time, w_.prescribed.share);  // without springs
      weigh(one, h);
    }
  }

  // Computes the unbalanced forces at the present positions, with the contact forces of the last step of h
  // seconds.
  void weigh(One &one, double h) {
    sum_loads(one);
    const Phyxels &p = one.body->p;
    if (!one.rest->add_forces(w_.time, h)) one.left = HUGE_VAL;
    double nan_flag = 0;
    for (size_t at = 0; at < p.x.size(); ++at) {
      double &most = p.moves(at) || at % kStride == 3 ? one.left : one.scale;
      most = std::max(most, std::fabs(p.f[at]));
      if (!one.last.empty()) one.moved = std::max(one.moved, std::fabs(p.x[at] - one.last[at]));
      nan_flag += 0.0 * p.f[at];
    }
    if (nan_flag != 0) one.left = HUGE_VAL;
  }

  // Writes loads and contact forces into points().f and sums them. Components that are held at some point do
  // not count: there the body is supported.
  void sum_loads(One &one) const {
    Body &b = *one.body;
    Phyxels &p = b.p;
    const double *const contact = one.points->contact_force();
    loads_at_rest(w_, b, p.f.data());
    one.scale = one.moved = one.left = one.all = 0;
    one.touches = false;
    uint8_t held = 0;
    for (const uint8_t bits : p.held) held = uint8_t(held | bits);
    Vec3 force, center, torque;
    for (uint32_t i = 0; i < p.n; ++i) center += (p.mass[i] / b.mass) * p.x_at(i);
    double inertia = 0, far = 0;
    for (uint32_t i = 0; i < p.n; ++i) {
      double *const f = &p.f[size_t{kStride} * i];
      Vec3 free;
      for (uint32_t c = 0; c < 3; ++c) {
        const double push = contact[3 * size_t{i} + c];
        one.scale = std::max({one.scale, std::fabs(f[c]), std::fabs(push)});
        one.all += std::fabs(f[c]) + std::fabs(push);
        one.touches = one.touches || push != 0;
        f[c] += push;
        if (!(held & (1 << c))) free[int(c)] = f[c];
      }
      const Vec3 arm = p.x_at(i) - center;
      force += free;
      torque += cross(arm, free);
      inertia += p.mass[i] * norm2(arm);
      far = std::max(far, norm2(arm));
    }
    one.net = norm(force);
    one.pull = one.net / b.mass + norm(torque) / inertia * std::sqrt(far);
  }

  // Limits the next step so that an unsupported body moves no farther than its reach.
  double length(double longest) const {
    double h = longest;
    for (const One &one : bodies_) {
      if (!hangs(one) && one.pull > 0) h = std::min(h, std::sqrt(one.reach / one.pull));
    }
    return std::max(h, kShortest);
  }

  // s, by which keys advance in the next step, so that no prescribed motion exceeds the reach of a body. The
  // length of the step itself is unchanged: in a short step, friction would have to accelerate the body's
  // mass.
  double way_on(const Station &to) const {
    double part = to.time - w_.time, reach = HUGE_VAL;
    for (const One &one : bodies_) reach = std::min(reach, one.reach);
    while (part > kShortest && prescribed_way(part) > reach) part *= 0.5;
    return std::max(part, kShortest);
  }

  // m, the largest prescribed motion in the next h seconds, also if it returns in between.
  double prescribed_way(double h) const {
    double most = 0;
    for (const double part : {1.0, 0.5, 0.25, 0.125})
      most = std::max(most, prescribed_distance(w_.time + part * h));
    return most;
  }
  double prescribed_distance(double t) const {
    double most = 0, size = 0;
    for (const One &one : bodies_) {
      size = std::max(size, one.size);
      each_held_place(*one.body, t, [&](uint32_t point, Vec3 x) {
        most = std::max(most, norm(x - one.body->p.x_at(point)));
      });
    }
    for (const auto &o : w_.obstacles) {
      if (!o->moves()) continue;
      const Pose to = o->pose_at_time(t);
      const double turn = norm(spin_between(o->pose.rotation, to.rotation, 1));
      most = std::max(most, norm(to.position - o->pose.position) + turn * size);
    }
    return most;
  }

  void check_progress(uint32_t steps, double h) const {
    for (const One &one : bodies_)
      if (one.slid > kAway * one.size) refuse(one, steps, h);
    if (steps < most_) return;
    const auto worse = [](const One &a, const One &b) { return a.left * b.scale < b.left * a.scale; };
    refuse(*std::max_element(bodies_.begin(), bodies_.end(), worse), steps, h);
  }

  static bool hangs(const One &one) {
    const Array<uint8_t> &held = one.body->p.held;
    return std::ranges::find(held, 7) != held.end();
  }

  // A body that is held cannot slide away.
  static const char *advice(const One &one) {
    return hangs(one)
               ? "use more load_steps, or run the world in time with damping (integrator tr_bdf2) until it "
                 "rests"
               : "hold it (fix), raise the friction, or run the world in time";
  }

  [[noreturn]] void refuse(const One &one, uint32_t steps, double h) const {
    fail(DFM_E_DIVERGED,
         "body '%s' finds no rest at %g of the loads: the last of %u steps from rest (%g s) has moved it by "
         "%g m, and %g N at a point are not balanced (the largest load or reaction is %g N); %s",
         one.body->name.c_str(), w_.prescribed.share, steps, h, one.moved, one.left, one.scale, advice(one));
  }

  // The result becomes the present state; the steps of the search leave no trace.
  void keep() {
    info_.residual = 0;
    for (One &one : bodies_) {
      info_.residual = std::max(info_.residual, one.scale > 0 ? one.left / one.scale : 0);
      one.body->contact_impulse = one.contact_impulse;
      if (def_.sleep) one.body->anchor = one.body->p.x;
      ++one.body->x_version;
      set_loads(*one.body, w_.time, 1);
    }
    const dfm_world_stats now = w_.stats;
    w_.stats = stats_;
    w_.stats.contacts = now.contacts;
    w_.stats.sticking = now.sticking;
    w_.stats.contacts_max = std::max(w_.stats.contacts_max, now.contacts);
    w_.stats.time = w_.time;
    w_.step_count = steps_;
    w_.sizes = sizes_;
    begin_impulses(w_.step_impulses, w_.time, 0);
    for (dfm_contact_event &event : w_.events) event.t = w_.time;
    w_.events.insert(w_.events.begin(), earlier_.begin(), earlier_.end());
    done_ = true;
  }

  World &w_;
  StepContext &step_;
  dfm_equilibrium_info &info_;
  Station start_, end_;
  double tolerance_ = kLeft;
  uint32_t most_ = kSteps;
  std::vector<One> bodies_;
  std::string before_;
  dfm_world_stats stats_{};
  uint64_t steps_ = 0;
  StepSizes sizes_;
  std::vector<dfm_contact_event> earlier_;  // before the search
  decltype(Overlaps::suspended) suspended_;
  dfm_world_def def_{};
  bool done_ = false;
};

}  // namespace

void find_contact_equilibrium(World &w, const dfm_equilibrium_def &def, dfm_equilibrium_info &info) {
  {
    Settling search(w, def, info);
    search.run(def.load_steps ? def.load_steps : 1);
  }
  forget_energy(w);
  for (auto &b : w.bodies) clear_change_energy(*b);
  w.bound.age = kNone;
  ++w.placements;
}

}  // namespace dfm
