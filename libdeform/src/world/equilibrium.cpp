// Each step is a step of the world from rest, with the usual contact, friction and guard. Two things differ:
// the dynamics of bodies (SettlingPoints), and prescribed motions and loads are constant at their
// values at the end of the load step (World::prescribed). Where nothing can touch anything, a step solves by
// Newton's method, and is so long that the mass of a held body does not count; the next one finishes it.
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

#include "core/error.h"
#include "dynamics/implicit_points.h"
#include "state/bounds.h"
#include "state/obstacle.h"
#include "state/world.h"
#include "step/budget.h"
#include "step/context.h"
#include "step/solve/attach.h"
#include "step/stages.h"
#include "step/step_impulses.h"
#include "step/watch/energy_watch.h"
#include "world/change_energy.h"
#include "world/rest_loads.h"

namespace dfm {
namespace {

// s, length of a step. The longer it is, the more the stiffness and the less the mass of a body decides its
// end. Where nothing can touch bodies that are held, a step may last forever. A search whose steps failures
// have halved below the second ends.
constexpr double kLongest = 1, kShortest = 1e-4;
// Tolerances: of contact in a step, relative to the median edge of a body; of the motion in the last step,
// relative to the size of the body, of forces at a point to the largest load, reaction or contact force, and
// of their sum over a body to half of their norms (or to their rounding).
constexpr double kContact = 2e-8, kLeft = 1e-6;
constexpr double kAlone = 1e-10;  // of Newton's method and of forces where nothing can touch anything
constexpr double kReach = 0.1;    // of its size, an edge at least: what a body may move in a step
constexpr uint32_t kSteps = 500;  // of a load step
constexpr double kAway = 10;      // of its size: a body in contact that has moved so far keeps sliding
constexpr double kForever = 1e9;  // s: longer than any relaxation
// Up to this number of points a factorization is faster than conjugate gradients on a matrix without the mass
// term of a step.
constexpr uint32_t kFactoredAtRest = 30000;
// Rounding of forces, relative to the largest product of stiffness and coordinate.
constexpr double kForceRounding = 8 * 2.220446049250313e-16;

// Points on their way to an equilibrium, in steps of backward Euler from rest:
//
//   f(x) + loads + M g + contact = (M / h^2 + S) (x - x0)        S: stiffness of loads, N/m
//
// which is the condition of equilibrium once x stops changing. M / h^2 decides the length of a step, not
// where steps end; it bounds the motion of bodies that nothing holds (the proximal point method, Rockafellar
// 1976). A step starts with the contact forces of the step before. Without them bodies would fall freely by
// h^2 g before contacts are found, which is meters in a step of a second.
//
// Each step solves for the impulses of contacts whose places and normals are those before it. Where a body
// gives way, they turn: the foot of a sphere on a face moves away from the corner that it has pressed down.
// If its next place overshoots by more than it was off, whole steps go to and fro for ever, so a touched body
// goes Aitken's share of its way (Irons and Tuck 1969): doc/decisions/implicit_time.md.

class SettlingPoints : public ImplicitPoints {
 public:
  // softness: [npoint] N/m, S. alone: nothing can touch them.
  SettlingPoints(const Memory &memory, Phyxels &points, Surface &surface, ModelInstance &model,
                 const ImplicitOptions &options, const std::vector<double> &softness, bool alone);

  // The contact forces to start with: impulses at the surfels [nsurfel,3] over h seconds; h 0: none.
  void start_from(const double *surfel_impulse, double h);
  void forget_way() { std::fill(way_.begin(), way_.end(), 0.0); }  // the next step goes its whole way
  const double *contact_force() const { return force_.data(); }    // [npoint,3] N, of the last step
  double stiffest() const { return stiffest_; }                    // N/m, of a point, in the last step
  // For points that have been stopped. Adds the forces of the model to theirs. Returns false if it fails.
  bool add_model_forces(double time, bool trial = false) {
    const dfm_kin k = kin(time, 0, trial);
    return model_.call("add_forces", [&] { return model_.ops->add_forces(model_.self, &k, p_.f.data()); }) ==
           DFM_OK;
  }
  // The same. Sets the state of the model to its limit after infinite time (relaxed, flowed). Returns false
  // if there is no limit, or the model fails.
  bool relax(double time) {
    if (model_.state.empty()) return false;
    std::fill(p_.f.begin(), p_.f.end(), 0.0);
    if (!add_model_forces(time, true)) return false;
    model_.commit_state();
    return true;
  }

  bool bound(double time, double share, const AddRowSums &outside, StepBound &out) override;
  bool free_motion(const SubStep &now, double &kinetic) override;
  const double *start() const override { return p_.v_free.data(); }  // with the last contact forces
  void take(const double *v) override;
  double accurate_step(const SubStep &) const override { return std::numeric_limits<double>::infinity(); }
  void take_part(double share, bool in_full, const double *surfel_impulse) override {
    ImplicitPoints::take_part(share, in_full, surfel_impulse);
    whole_ = false;
  }
  void commit(const SubStep &now) override;

 private:
  bool alone_, whole_ = true;  // the guard has taken the whole step
  double stiffest_ = 0;
  double h_ = 0, share_ = 1, last_share_ = 1;  // s, of this step; of its way, and of that of the last step
  Array<double> way_;                          // [npoint,4] m, the whole way of the last step; 0: unknown
  Array<double> force_;                        // [npoint,3] N, contact forces of the last step
  Array<double> load_;                         // [npoint,4] N, loads alone
};

SettlingPoints::SettlingPoints(const Memory &memory, Phyxels &points, Surface &surface, ModelInstance &model,
                               const ImplicitOptions &options, const std::vector<double> &softness,
                               bool alone)
    : ImplicitPoints(memory, points, surface, model, options), alone_(alone) {
  abilities_.damps = false;  // its steps are not steps in time
  least_h_ = kForever;       // flow is complete however long the step is
  use_memory(memory, softness_, way_, force_, load_);
  force_.assign(size_t{3} * points.n, 0.0);
  way_.assign(size_t{kStride} * points.n, 0.0);
  softness_.assign(softness.begin(), softness.end());
}

void SettlingPoints::start_from(const double *surfel_impulse, double h) {
  std::fill(force_.begin(), force_.end(), 0.0);
  if (h > 0) spread_impulses(surfel_impulse, 1 / h, force_);
}

// The scheme is stable at any step, also with loads that depend on positions.
bool SettlingPoints::bound(double, double, const AddRowSums &, StepBound &out) {
  out = {};
  return true;
}

// With contact one linear correction only: with contact forces that do not rotate with the body, a standing
// body may have no equilibrium near, and Newton's method would search for it forever.
bool SettlingPoints::free_motion(const SubStep &now, double &kinetic) {
  options_.rest = kAlone * surface_.median_edge / now.h;
  h_ = now.h;
  share_ = 1;
  whole_ = true;
  bool found;
  if (alone_) found = ImplicitPoints::free_motion(now, kinetic);
  else {
    load_ = p_.load;
    for (uint32_t i = 0; i < p_.n; ++i)
      for (uint32_t c = 0; c < 3; ++c) p_.load[size_t{kStride} * i + c] += force_[size_t{3} * i + c];
    found = take_first_way(now);
    p_.load.swap(load_);
  }
  stiffest_ = largest_diagonal() / (now.h * now.h);
  return found && std::ranges::all_of(p_.v_free, [&](double v) { return std::fabs(v) <= now.fastest; });
}

void SettlingPoints::take(const double *v) {
  ImplicitPoints::take(v);
  double along = 0, square = 0;
  for (size_t j = 0; j < way_.size(); ++j) {
    const double change = h_ * v[j] - way_[j];
    along -= way_[j] * change;
    square += change * change;
  }
  share_ = along > 0 ? std::min(1.0, last_share_ * along / square) : 1;
  if (share_ < 1)
    for (double &end : p_.v_end) end *= share_;
}

void SettlingPoints::commit(const SubStep &now) {
  if (alone_) return p_.x.swap(p_.x_end);  // the state of the model goes on at rest
  if (!whole_) forget_way();
  else
    for (size_t j = 0; j < way_.size(); ++j) way_[j] = now.h / share_ * p_.v_end[j];
  last_share_ = share_;
  ImplicitPoints::commit(now);
}

class Settling {
 public:
  Settling(World &w, const dfm_equilibrium_def &def, dfm_equilibrium_info &info)
      : w_(w),
        step_(*w.steps),
        info_(info),
        alone_(!w.plan.touches()),
        start_{w.time, def.load_from},
        end_{w.time + def.time, def.load_to},
        tolerance_(def.tolerance > 0 ? def.tolerance
                   : alone_          ? kAlone
                                     : kLeft),
        most_(def.max_iterations ? def.max_iterations : kSteps) {
    for (auto &b : w.bodies) bodies_.push_back(make(*b));
    suspended_ = w.overlaps.suspended;
    write_down(w_, step_, before_);
    earlier_.swap(w.events);  // a long search produces more than a world keeps; from here on nothing throws
    stats_ = w.stats;
    steps_ = w.step_count;
    sizes_ = w.sizes;
    last_h_ = w.watch.last_h;
    def_ = w.def;
    exchange();
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
    w_.events.swap(earlier_);
    restore_start(w_, step_, before_);
    for (auto &b : w_.bodies) set_loads(*b, w_.time, 1);
  }

  void run(uint32_t load_steps) {
    wake_all(w_);  // adds the contact impulses of the meantime
    for (One &one : bodies_) one.contact_impulse = one.body->contact_impulse;
    prepare(w_);
    for (uint32_t k = 1; k <= load_steps; ++k) {
      come_to(k == load_steps ? end_ : between(start_, end_, double(k) / load_steps));
      ++info_.load_steps;
    }
    keep();
  }

 private:
  struct One {
    Body *body;
    std::unique_ptr<Dynamics> other;  // its normal dynamics; exchanged during the search
    SettlingPoints *points;
    double size, edge;           // m
    Vec3 contact_impulse;        // N s, before the search
    uint8_t held;                // components that are held at some point
    double slid = 0;             // m moved since it has been in contact
    std::vector<double> last{};  // [npoint,4] m, at the start of the step
    double left = 0, scale = 0;  // N, largest component of unbalanced forces; of all forces
    double moved = 0;            // m, in the last step
    Vec3 net{};                  // N, sum of external forces
    double all = 0;              // N, sum of their norms
    double pull = 0;             // m/s2, acceleration by their sum
    bool touches = false;
  };

  One make(Body &b) const {
    ImplicitOptions options = w_.implicit;
    options.rest_factor = false;
    if (options.solver == "auto" && b.p.n <= kFactoredAtRest) options.solver = "ldlt";
    options.newton = std::max(options.newton, ImplicitOptions{}.newton);
    auto points = std::make_unique<SettlingPoints>(w_.memory(), b.p, b.surface, b.model, options,
                                                   softness_of(b), alone_);
    if (!alone_) points->start_from(b.surfel_impulse.data(), b.impulse_time());
    SettlingPoints *const own = points.get();
    return {.body = &b,
            .other = std::move(points),
            .points = own,
            .size = extent_of(b.p.x.data(), b.p.n, kStride).longest(),
            .edge = b.surface.median_edge,
            .contact_impulse = {},
            .held = b.p.held_anywhere()};
  }

  void exchange() {
    for (One &one : bodies_) one.body->dynamics.swap(one.other);
  }

  void come_to(const Station &to) {
    w_.prescribed = {to.time, to.share};
    if (w_.gravity.keys.empty()) w_.gravity.now = to.share * load3(w_.def.gravity);
    for (One &one : bodies_) {
      set_loads(*one.body, w_.prescribed.at(w_.time), to.share);
      one.slid = 0;
    }
    uint32_t steps = 0;
    for (uint32_t before = 0;; before = steps) {
      come_to_rest(to, steps);
      if ((before > 0 && steps <= before + 1) || !relax()) return;
    }
  }

  bool relax() {
    bool any = false;
    for (One &one : bodies_) any = one.points->relax(w_.time) || any;
    return any;
  }

  // steps: of the load step, but for those in which prescribed motions go on.
  void come_to_rest(const Station &to, uint32_t &steps) {
    const bool all_hang = std::ranges::all_of(bodies_, hangs);
    if (alone_ && !all_hang) w_.time = to.time;  // loads need not be balanced in between
    weigh_all();
    for (One &one : bodies_) one.points->forget_way();
    const double most = alone_ && all_hang ? kForever : kLongest;
    double longest = most;  // where no force is left over
    // Keys advance after bodies rest under the new loads: otherwise unloaded contacts would not carry bodies
    // along.
    bool goes_on = alone_ || w_.time >= to.time;
    for (;;) {
      const double h = length(longest);
      w_.prescribed.until = goes_on ? next_stop(to) : w_.time;
      const uint64_t pieces = w_.stats.substeps;
      uint32_t trouble = 0;
      const bool taken = step(h, trouble);
      const bool solved = taken && !(trouble & DFM_TROUBLE_UNCONVERGED);
      const bool whole = solved && w_.stats.substeps == pieces + 1;
      w_.time = w_.prescribed.at(w_.time);
      const bool there = w_.time >= to.time;
      ++info_.iterations;
      if (there || !goes_on) ++steps;
      if (!taken && longest < kShortest)
        fail(DFM_E_DIVERGED,
             "no equilibrium was found, because a step from rest failed (%s); use more load_steps, hold what "
             "moves freely, or raise max_time and max_work",
             dfm_last_error());
      weigh_all();
      bool rests = solved;
      for (One &one : bodies_) {
        if (alone_) check_balance(one);
        if (!whole || !there) one.points->forget_way();
        one.slid = there && one.touches ? one.slid + one.moved : 0;
        rests = rests && one.moved <= kLeft * one.size && balanced(one);
      }
      if (rests && there) return;
      goes_on = goes_on || rests;
      if (!whole) longest = std::min(kLongest, 0.5 * longest);
      else longest = std::min(most, 2 * longest);
      check_progress(steps, h);
    }
  }

  // Returns false if it failed; the world is then at the end of its last completed part.
  bool step(double h, uint32_t &trouble) {
    double edge = HUGE_VAL;
    for (One &one : bodies_) {
      one.last.assign(one.body->p.x.begin(), one.body->p.x.end());
      edge = std::min(edge, one.edge);
    }
    w_.def.contact_tolerance = kContact * edge / h;
    const dfm_status status = step_within_budget(w_, h, &trouble);
    if (trouble & DFM_TROUBLE_INTERRUPTED)
      fail(DFM_DISCARD, "the search for an equilibrium was interrupted; the world is as before it");
    if (status != DFM_OK) return false;
    if (alone_) return true;
    for (const One &one : bodies_)
      one.points->start_from(one.body->surfel_impulse.data(), one.body->impulse_time());
    return true;
  }

  bool balanced(const One &one) const {
    const double rounding = kForceRounding * one.points->stiffest() *
                            largest_coordinate(one.body->p.x.data(), one.body->p.n, kStride);
    const double carried = 0.5 * one.all;  // each force has one that it balances
    return (alone_ || norm(one.net) <= std::max(tolerance_ * carried, rounding)) &&
           one.left <= std::max(tolerance_ * one.scale, rounding);
  }

  void check_balance(const One &one) const {
    if (!one.body->springs.empty() || norm(one.net) <= tolerance_ * one.all) return;
    dfm::refuse(
        *one.body, DFM_E_DIVERGED,
        " has no equilibrium: nothing holds it, and its loads sum to [%g, %g, %g] N; hold some of its "
        "points (fix), or balance its loads",
        one.net.x, one.net.y, one.net.z);
  }

  // Stops all bodies, too.
  void weigh_all() {
    for (One &one : bodies_) {
      Phyxels &p = one.body->p;
      std::fill(p.v.begin(), p.v.end(), 0.0);
      one.body->relax_dampers();
      set_loads(*one.body, w_.time, w_.prescribed.share);  // without springs
      weigh(one);
    }
  }

  // Computes the unbalanced forces at the present positions, with the contact forces of the last step.
  void weigh(One &one) {
    sum_loads(one);
    const Phyxels &p = one.body->p;
    if (!one.points->add_model_forces(w_.time)) one.left = HUGE_VAL;
    double nan_flag = 0;
    for (size_t at = 0; at < p.x.size(); ++at) {
      double &most = p.moves(at) || at % kStride == 3 ? one.left : one.scale;
      most = std::max(most, std::fabs(p.f[at]));
      const double moved = one.last.empty() ? 0 : std::fabs(p.x[at] - one.last[at]);
      one.moved = std::max(one.moved, moved);
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
    Vec3 center, torque;
    one.net = {};
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
        if (!(one.held & (1 << c))) free[int(c)] = f[c];
      }
      const Vec3 arm = p.x_at(i) - center;
      one.net += free;
      torque += cross(arm, free);
      inertia += p.mass[i] * norm2(arm);
      far = std::max(far, norm2(arm));
    }
    one.pull = norm(one.net) / b.mass + (inertia > 0 ? norm(torque) / inertia * std::sqrt(far) : 0);
  }

  static double reach(const One &one) { return std::max(one.edge, kReach * one.size); }

  // s, of the next step: forces that nothing balances move no body farther than its reach. So M / h^2 falls
  // with them.
  double length(double longest) const {
    double most = 1;
    for (const One &one : bodies_)
      if (!alone_ && !hangs(one)) most = std::max(most, one.pull / reach(one));
    return longest / std::sqrt(most);
  }

  // s, to which keys advance in the next step, so that no prescribed motion exceeds the reach of a body. The
  // length of the step itself is unchanged: in a short step, friction would have to accelerate the body's
  // mass.
  double next_stop(const Station &to) const {
    if (alone_) return to.time;
    double part = to.time - w_.time, least = HUGE_VAL;
    for (const One &one : bodies_) least = std::min(least, reach(one));
    while (part > kShortest && prescribed_way(w_.time + part) > least) part *= 0.5;
    return std::min(to.time, w_.time + std::max(part, kShortest));
  }

  // m, the largest prescribed motion until t.
  double prescribed_way(double t) const {
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

  static bool hangs(const One &one) { return one.held == 7; }

  // A body that is held cannot slide away.
  const char *advice(const One &one) const {
    if (alone_ && !hangs(one))
      return "use more load_steps, hold more of its points (fix), or run the world in time";
    return hangs(one)
               ? "use more load_steps, or run the world in time with damping (integrator tr_bdf2) until it "
                 "rests"
               : "hold it (fix), raise the friction, or run the world in time";
  }

  [[noreturn]] void refuse(const One &one, uint32_t steps, double h) const {
    dfm::refuse(
        *one.body, DFM_E_DIVERGED,
        " finds no rest at %g of the loads: the last of %u steps from rest (%g s) has moved it by %g m, "
        "and %g N at a point are not balanced (the largest load or reaction is %g N); %s",
        w_.prescribed.share, steps, h, one.moved, one.left, one.scale, advice(one));
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
    w_.watch.last_h = last_h_;
    begin_impulses(w_.step_impulses, w_.time, 0);
    for (dfm_contact_event &event : w_.events) event.t = w_.time;
    w_.events.insert(w_.events.begin(), earlier_.begin(), earlier_.end());
    done_ = true;
  }

  World &w_;
  StepContext &step_;
  dfm_equilibrium_info &info_;
  const bool alone_;  // nothing can touch anything
  const Station start_, end_;
  const double tolerance_;
  const uint32_t most_;
  std::vector<One> bodies_;
  std::string before_;
  dfm_world_stats stats_{};
  uint64_t steps_ = 0;
  StepSizes sizes_;
  double last_h_ = 0;
  std::vector<dfm_contact_event> earlier_;  // before the search
  decltype(Overlaps::suspended) suspended_;
  dfm_world_def def_{};
  bool done_ = false;
};

}  // namespace

void check_equilibrium(const World &w) {
  if (!w.rigid_sets.empty())
    fail(DFM_E_UNSUPPORTED,
         "static mode does not support moving rigid bodies; remove them, or run the world in time");
  for (const auto &b : w.bodies)
    if (b->model.stepper)
      refuse(*b, DFM_E_UNSUPPORTED,
             ": model '%s' steps itself and gives no stiffness, which an equilibrium needs; choose another "
             "model",
             b->model.type->id);
}

void find_equilibrium(World &w, const dfm_equilibrium_def &def, dfm_equilibrium_info &info) {
  drop_released(w);  // of a step that has failed: what the search gives back has none
  prepare(w);
  check_equilibrium(w);
  {
    Settling search(w, def, info);
    search.run(def.load_steps ? def.load_steps : 1);
  }
  forget_energy(w);
  for (auto &b : w.bodies) {
    clear_change_energy(*b);
    if (!w.plan.touches()) w.overlaps.place(b->id);
  }
  w.bound.age = kNone;
  ++w.placements;
}

}  // namespace dfm
