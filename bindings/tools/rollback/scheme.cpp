// Two stages in place of narrow, contact <-> friction and distribute:
//
//   lagged     v_free += h M^-1 (friction forces that the last sub-step found)
//   rollback   for every listed pair, on straight ways x -> x + h v_free: when does it touch?
//              (4.2)-(4.4), (4.7) corrected
//              vertices that a hit ties together are an island; it goes its way up to t = 0.9 of its earliest
//              hit (4.5)
//              a pair whose vertices now go different fractions may touch on that way: it joins them, and so
//              on until none does
//              normal force and friction of every colliding point, from the forces of this sub-step; they act
//              in the next  (5.18)-(5.30)
//
// Why this ends, and in a state without contact: vertices of one island follow the true motion up to one
// time, before any of their hits; pairs that go unequal fractions have been tested with just that motion; and
// each round that finds a hit leaves fewer islands.
#include "rollback/scheme.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "api/objects.h"
#include "body/make_surface.h"
#include "core/error.h"
#include "friction/laws.h"
#include "plugin/context.h"
#include "rollback/equations.h"
#include "rollback/impact_time.h"
#include "state/world.h"
#include "step/context.h"
#include "step/islands.h"
#include "step/solve/solve_islands.h"
#include "step/stages.h"
#include "step/step_bound.h"
#include "step/step_impulses.h"
#include "world/sensors.h"

namespace dfm::rollback {

struct Buffers {
  Islands islands{Memory::standard()};      // of surfels, world-wide numbers
  std::vector<ImpactHit> hits;              // by candidate
  std::vector<uint8_t> joins;               // by candidate: ties its vertices together
  std::vector<uint32_t> joined;             // those candidates, in the order in which they were found
  std::vector<double> fraction;             // by surfel, of its way
  std::vector<double> time;                 // by island
  std::vector<uint8_t> met;                 // by surfel: a contact of a point has it
  std::vector<const double *> fractions;    // by body slot, into fraction
  std::vector<std::vector<double>> lagged;  // by body slot: [n,4] N, friction for the next sub-step
};

namespace {

// v_free += h M^-1 (friction forces that the last sub-step found)
void add_lagged(World &w, StepContext &step, const Buffers &r) {
  for (const auto &b : w.bodies) {
    Phyxels &p = b->p;
    const std::vector<double> &force = r.lagged[b->slot];
    if (std::ranges::all_of(force, [](double f) { return f == 0; })) continue;
    const double *const diagonal = b->dynamics->unknowns().diagonal;
    for (size_t i = 0; i < p.v_free.size(); ++i) p.v_free[i] += step.h * (diagonal[i] * force[i]);
    gather_surface(b->surface, p.x.data(), p.v_free.data());
  }
}

constexpr uint32_t kGrain = 64;

// The first time of every candidate that `wanted`, each into its own place.
template <class Wanted>
void query_impacts(World &w, StepContext &step, Buffers &r, std::span<const double *const> fraction,
                   Wanted &&wanted) {
  const Array<Candidate> &list = step.broad.candidates();
  const ImpactQuery query(step.body_views, step.obstacle_views, step.h, w.offset);
  w.context->tasks.parallel_for(static_cast<uint32_t>(list.size()), kGrain,
                                [&](uint32_t begin, uint32_t end) {
                                  for (uint32_t i = begin; i < end; ++i) {
                                    if (!wanted(query, i)) continue;
                                    r.hits[i] = query.first(list[i], fraction);
                                    r.joins[i] = r.hits[i].t <= 1 ? 2 : 0;  // 2: new
                                  }
                                });
}

bool take_new(Buffers &r) {
  const size_t before = r.joined.size();
  for (uint32_t i = 0; i < r.joins.size(); ++i)
    if (r.joins[i] == 2) {
      r.joins[i] = 1;
      r.joined.push_back(i);
    }
  return r.joined.size() > before;
}

// One time per island. `own`: as many of `joined` as have hit on the true motion; the others only tie.
void set_fractions(StepContext &step, Buffers &r, const ImpactQuery &query, size_t own) {
  const uint32_t n = static_cast<uint32_t>(r.fraction.size());
  r.islands.start(n);
  uint32_t node[4];
  for (const uint32_t i : r.joined) {
    const uint32_t count = query.nodes(step.broad.candidates()[i], node);
    for (uint32_t k = 1; k < count; ++k) r.islands.join(node[0], node[k]);
  }
  r.islands.finish();
  r.time.assign(r.islands.count, 1.0);
  for (size_t k = 0; k < own; ++k) {
    query.nodes(step.broad.candidates()[r.joined[k]], node);
    double &t = r.time[r.islands.of[node[0]]];
    t = std::min(t, kSafety * r.hits[r.joined[k]].t);
  }
  for (uint32_t i = 0; i < n; ++i) r.fraction[i] = r.time[r.islands.of[i]];
}

// Fractions of all surfels: every pair that would touch on the ways that they leave is tied.
void find_islands(World &w, StepContext &step, Buffers &r) {
  const Array<Candidate> &list = step.broad.candidates();
  const ImpactQuery query(step.body_views, step.obstacle_views, step.h, w.offset);
  r.hits.resize(list.size());
  r.joins.assign(list.size(), 0);
  r.joined.clear();
  query_impacts(w, step, r, {}, [](const ImpactQuery &, uint32_t) { return true; });
  if (!take_new(r)) return;
  const size_t own = r.joined.size();
  do {
    set_fractions(step, r, query, own);
    query_impacts(w, step, r, r.fractions, [&](const ImpactQuery &q, uint32_t i) {
      if (r.joins[i]) return false;
      uint32_t node[4];
      const uint32_t n = q.nodes(list[i], node);
      return std::any_of(node + 1, node + n,
                         [&](uint32_t s) { return r.fraction[s] != r.fraction[node[0]]; });
    });
  } while (take_new(r));
}

// Colliding points: of each vertex with one other side the earliest hit. A pair of edges counts only where
// none of its ends is such a point: Zerbato (2010) has no edges, and what both have would push twice.
void find_points(World &w, StepContext &step, Buffers &r) {
  const Array<Candidate> &list = step.broad.candidates();
  const ImpactQuery query(step.body_views, step.obstacle_views, step.h, w.offset);
  const auto edges = [&](const Candidate &c) { return c.kind == 1; };
  const auto same = [&](const Candidate &a, const Candidate &b) {
    return a.slot_a == b.slot_a && a.slot_b == b.slot_b && a.obstacle == b.obstacle && a.kind == b.kind &&
           a.feature_a == b.feature_a;
  };
  const auto marked = [&](const Candidate &c) {
    uint32_t node[4];
    const uint32_t n = query.nodes(c, node);
    return std::any_of(node, node + n, [&](uint32_t s) { return r.met[s] != 0; });
  };
  r.met.assign(r.fraction.size(), 0);
  for (const uint32_t i : r.joined) {
    uint32_t node[4];
    if (edges(list[i])) continue;
    const uint32_t n = query.nodes(list[i], node);
    for (uint32_t k = 0; k < n; ++k) r.met[node[k]] = 1;
  }
  step.contacts.clear();
  for (uint32_t i = 0; i < list.size();) {
    uint32_t end = i, best = kNone;
    for (; end < list.size() && same(list[end], list[i]); ++end)
      if (r.joins[end] && !(edges(list[end]) && marked(list[end])) &&
          (best == kNone || r.hits[end].t < r.hits[best].t))
        best = end;
    if (best != kNone) step.contacts.push_back(query.contact(list[best], r.hits[best]));
    i = end;
  }
}

const Body &body_of_node(const World &w, const StepContext &step, uint32_t node, uint32_t &surfel) {
  size_t i = 0;
  while (i + 1 < step.body_views.size() && step.body_views[i + 1].first_node <= node) ++i;
  surfel = node - step.body_views[i].first_node;
  return *w.bodies[step.body_views[i].slot];
}

// The arguments of the laws: slip on the predicted way, normal force and the force that would end the
// slip from all forces but friction.
void set_forces(World &w, StepContext &step, const Buffers &r) {
  for (uint32_t i = 0; i < step.rows.n; ++i) {
    const ContactPoint &c = step.contacts[i];
    Vec3 pull;  // of the lagged friction on the relative velocity, m/s
    for (uint32_t k = 0; k < c.nnode; ++k) {
      uint32_t s;
      const Body &b = body_of_node(w, step, c.node[k], s);
      const size_t at = size_t{b.surface.point[s]} * kStride;
      const double *const force = &r.lagged[b.slot][at];
      const double *const d = b.dynamics->unknowns().diagonal + at;
      pull += c.weight[k] * (step.h * Vec3{d[0] * force[0], d[1] * force[1], d[2] * force[2]});
    }
    const double *const f = &step.rows.frame[size_t(i) * 9];
    const Vec3 u = step.rows.velocity(i);
    const Vec3 free = u - Vec3{dot(load3(f), pull), dot(load3(f + 3), pull), dot(load3(f + 6), pull)};
    const double stop = step.rows.wt[i] > 0 ? -1 / (step.rows.wt[i] * step.h) : 0;
    step.state.fn[i] = normal_force(step.rows.wn[i], free.x, step.h);
    step.state.vt[i] = u.y;
    step.state.vt[step.state.stride + i] = u.z;
    step.state.ft_stop[i] = stop * free.y;
    step.state.ft_stop[step.state.stride + i] = stop * free.z;
  }
}

// (4.5) for velocities and, by the commit, for positions; the momentum that this and the lagged friction
// change goes into the books.
void roll_back(World &w, StepContext &step, const Buffers &r) {
  for (size_t i = 0; i < step.body_views.size(); ++i) {
    Body &b = *w.bodies[step.body_views[i].slot];
    const double *const fraction = r.fractions[i];
    for (uint32_t s = 0; s < b.surface.nsurfel; ++s) {
      const size_t at = size_t{b.surface.point[s]} * kStride;
      const Vec3 before = load3(&b.p.v_free[at]);
      const Vec3 after = fraction[s] < 1 ? velocity_after(before, fraction[s]) : before;
      const Vec3 lost = b.p.mass[b.surface.point[s]] * (after - before);
      store3(&b.surfel_impulse[3 * size_t{s}], step.h * load3(&r.lagged[b.slot][at]) + lost);
      store3(&b.p.v_free[at], after);
    }
    for (size_t at = 0; at < b.p.x.size(); ++at) b.p.x_end[at] = b.p.x[at] + step.h * b.p.v_free[at];
  }
}

// Slip for the report: that of the way which was left.
void set_slip(World &w, StepContext &step) {
  for (uint32_t i = 0; i < step.rows.n; ++i) {
    const ContactPoint &c = step.contacts[i];
    Vec3 v = -load3(c.velocity);
    for (uint32_t k = 0; k < c.nnode; ++k) {
      uint32_t s;
      const Body &b = body_of_node(w, step, c.node[k], s);
      v += c.weight[k] * load3(&b.p.v_free[size_t{b.surface.point[s]} * kStride]);
    }
    const double *const f = &step.rows.frame[size_t(i) * 9];
    step.state.vt[i] = dot(load3(f + 3), v);
    step.state.vt[step.state.stride + i] = dot(load3(f + 6), v);
  }
}

// (5.27)-(5.30): friction on the points of both sides, by their weights at the common place; for the
// next sub-step.
void keep_friction(World &w, StepContext &step, Buffers &r) {
  for (std::vector<double> &force : r.lagged) std::ranges::fill(force, 0.0);
  for (uint32_t i = 0; i < step.rows.n; ++i) {
    const ContactPoint &c = step.contacts[i];
    const double *const f = &step.rows.frame[size_t(i) * 9];
    double *const l = &step.rows.impulse[size_t(i) * 3];
    l[0] = step.h * step.state.fn[i];
    l[1] = step.h * step.state.ft[i];
    l[2] = step.h * step.state.ft[step.state.stride + i];
    const Vec3 force = step.state.ft[i] * load3(f + 3) + step.state.ft[step.state.stride + i] * load3(f + 6);
    for (uint32_t k = 0; k < c.nnode; ++k) {
      uint32_t s;
      const Body &b = body_of_node(w, step, c.node[k], s);
      double *const to = &r.lagged[b.slot][size_t{b.surface.point[s]} * kStride];
      store3(to, load3(to) + c.weight[k] * force);
    }
  }
}

bool solve(World &w, StepContext &step, Buffers &r, uint32_t *trouble) {
  step.residual = {};
  uint32_t nnode = 0;
  for (const BodyView &v : step.body_views) nnode = std::max(nnode, v.first_node + v.surface->nsurfel);
  r.fraction.assign(nnode, 1.0);
  r.fractions.clear();
  for (const BodyView &v : step.body_views) r.fractions.push_back(&r.fraction[v.first_node]);
  find_islands(w, step, r);
  find_points(w, step, r);
  if (!make_rows(w, step, trouble)) return false;
  set_forces(w, step, r);
  for (SolveIsland &island : step.solve_islands->all())
    if (const LawInstance *bad = island.batches.evaluate(step.h, step.state))
      return report_failed_solve(w, step, bad, island.batches.failed(), trouble);
  w.stats.passes = step.rows.n > 0;
  w.stats.sweeps = 0;
  w.stats.residual = 0;
  w.stats.passes_max = std::max(w.stats.passes_max, w.stats.passes);
  reserve_contacts(w, step);
  roll_back(w, step, r);  // nothing fails from here on
  set_slip(w, step);
  keep_friction(w, step, r);
  return true;
}

// The stages of the library's step, as planned, but for what the scheme puts in place of some. As there: all
// of them, or none.
bool sub_step(World &w, StepContext &step, Buffers &r, uint32_t *trouble) {
  step.driven.clear();
  step.guard.start();
  step.length.begin(step.h);
  step.ended = step.in_impact = false;
  for (const PlannedStage &planned : w.plan.stages) {
    const auto start = std::chrono::steady_clock::now();
    const bool solves = planned.role == StageRole::solves;
    if (planned.role == StageRole::lists_pairs) add_lagged(w, step, r);
    // it has neither sleep nor rigid bodies nor a guard, which would have stages run again
    if (solves ? !solve(w, step, r, trouble)
               : stage_table()[planned.row].take(w, step, trouble) != Next::stage)
      return false;
    StageTime &time = step.stage_times[planned.row];
    time.seconds += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    ++time.calls;
  }
  return true;
}

const char *lacking(const Body &b) {
  return !b.dynamics->abilities().placed          ? "a model that steps itself"
         : b.dynamics->unknowns().system          ? "an implicit integrator"
         : !b.surface.identity()                  ? "a surface of its own"
         : !b.motions.empty()                     ? "a motion of held points"
         : b.tears || !b.planned_cuts.empty()     ? "cuts"
         : !b.switches.empty() || !b.rule.empty() ? "changes of its model"
                                                  : nullptr;
}
const char *lacking(const Obstacle &o) {
  return o.def.shape == DFM_SHAPE_VOXELS ? "voxels" : o.moves() || o.has_target ? "a motion" : nullptr;
}
const char *lacking(const World &w) {
  const auto remembers = [](const auto &law) { return law->nstate > 0; };
  return !w.rigid_sets.empty()                    ? "rigid bodies"
         : !w.attachments.empty()                 ? "attachments"
         : w.def.sleep                            ? "sleep"
         : w.steps->facts.self_bodies > 0         ? "self contact"
         : std::ranges::any_of(w.laws, remembers) ? "a friction law with memory"
                                                  : nullptr;
}

// Throws Error if the world has what the scheme lacks.
void check(const World &w) {
  const auto refuse = [](const char *what, const std::string &whose) {
    if (what)
      fail(DFM_E_UNSUPPORTED, "%s%s: beyond the scheme of Zerbato (2010); use `deform run`", whose.c_str(),
           what);
  };
  refuse(lacking(w), "");
  for (const auto &b : w.bodies) refuse(lacking(*b), "body '" + b->name + "': ");
  for (const auto &o : w.obstacles) refuse(lacking(*o), "obstacle '" + o->name + "': ");
}

// What the roll-back replaces leaves the plan.
void take_over(World &w, Buffers &r) {
  w.def.energy_watch = 0;  // which balances impulses
  prepare(w);
  check(w);
  std::erase_if(w.plan.stages, [](const PlannedStage &s) {
    return s.role == StageRole::finds_contacts || s.role == StageRole::reports_impulses ||
           s.role == StageRole::guards;
  });
  r.lagged.resize(w.bodies.size());
  for (const auto &b : w.bodies) r.lagged[b->slot].resize(size_t{kStride} * b->p.n);
}

}  // namespace

Scheme::Scheme() : buffers_(std::make_unique<Buffers>()) {}
Scheme::~Scheme() = default;

dfm_status Scheme::step(dfm_world world, double dt, uint32_t *trouble) {
  return as_status([&]() -> dfm_status {
    World &w = exclusive(world_of(world));
    StepContext &step = *w.steps;
    take_over(w, *buffers_);
    if (bound_expired(w)) update_bound(w);
    uint32_t bits = 0, done = 0;
    const double start = w.time, goal = start + dt;
    begin_impulses(w.step_impulses, start, dt);
    for (double left = choose_substeps(w.sizes, dt, w.bound.step); left > 0; --left) {
      if (bound_expired(w)) {
        update_bound(w);
        left *= cut_finer(w.sizes, (goal - w.time) / left, w.bound.step);
      }
      if (!(done + left <= w.def.max_substeps))
        fail(DFM_E_DIVERGED, "a step of %g s needs %g sub-steps of %g s; take a shorter one", dt, done + left,
             w.bound.step);
      step.h = step.left = step.rest = (goal - w.time) / left;
      const bool ends = sub_step(w, step, *buffers_, &bits);
      if (trouble) *trouble = bits;
      if (!ends) return DFM_E_DIVERGED;
      w.time = left > 1 ? w.time + step.h : goal;
      ++w.stats.substeps;
      ++w.bound.age;
      pass(w.sizes, step.h);
      ++done;
    }
    w.stats.last_substeps = done;
    w.stats.substeps_max = std::max(w.stats.substeps_max, done);
    w.stats.steps = ++w.step_count;
    w.stats.time = w.time;
    update_sensors(w, true);
    return DFM_OK;
  });
}

}  // namespace dfm::rollback
