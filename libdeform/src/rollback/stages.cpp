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
#include "rollback/stages.h"

#include <algorithm>

#include "body/make_surface.h"
#include "core/error.h"
#include "friction/laws.h"
#include "plugin/context.h"
#include "rollback/equations.h"
#include "rollback/impact_time.h"
#include "state/world.h"
#include "step/context.h"
#include "step/solve_islands.h"
#include "step/stages.h"

namespace dfm::rollback {

namespace {

struct Buffers : MethodBuffers {
  Islands islands;                        // of surfels, world-wide numbers
  Array<ImpactHit> hits;                  // by candidate
  Array<uint8_t> joins;                   // by candidate: ties its vertices together
  Array<uint32_t> joined;                 // those candidates, in the order in which they were found
  Array<double> fraction;                 // by surfel, of its way
  Array<double> time;                     // by island
  Array<uint8_t> met;                     // by surfel: a contact of a point has it
  std::vector<const double *> fractions;  // by body slot, into fraction
  explicit Buffers(const Memory &m) : islands(m) { use_memory(m, hits, joins, joined, fraction, time, met); }
};
Buffers &buffers(StepContext &step) { return static_cast<Buffers &>(*step.method); }

// [n,4] N, friction for the next sub-step.
Array<double> &lagged(Body &b) { return b.method_values; }
const Array<double> &lagged(const Body &b) { return b.method_values; }

}  // namespace

std::unique_ptr<MethodBuffers> make_buffers(const Memory &memory) {
  return std::make_unique<Buffers>(memory);
}

void stage_lagged(World &w, StepContext &step) {
  for (const auto &b : w.bodies) {
    Phyxels &p = b->p;
    const Array<double> &force = lagged(*b);
    bool any = false;
    const double *const diagonal = b->dynamics->diagonal();
    for (size_t i = 0; i < p.v_free.size(); ++i)
      if (force[i] != 0) {
        any = true;
        p.v_free[i] += step.h * (diagonal[i] * force[i]);
      }
    if (!any) continue;
    b->dynamics->free_changed();
    gather_surface(b->surface, p.x.data(), p.v_free.data());
  }
}

namespace {

constexpr uint32_t kGrain = 64;

// The first time of every candidate that `wanted`, each into its own place.
template <class Wanted>
void ask(World &w, StepContext &step, std::span<const double *const> fraction, Wanted &&wanted) {
  Buffers &r = buffers(step);
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
void set_fractions(StepContext &step, const ImpactQuery &query, size_t own) {
  Buffers &r = buffers(step);
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
void find_islands(World &w, StepContext &step) {
  Buffers &r = buffers(step);
  const Array<Candidate> &list = step.broad.candidates();
  const ImpactQuery query(step.body_views, step.obstacle_views, step.h, w.offset);
  r.hits.resize(list.size());
  r.joins.assign(list.size(), 0);
  r.joined.clear();
  ask(w, step, {}, [](const ImpactQuery &, uint32_t) { return true; });
  if (!take_new(r)) return;
  const size_t own = r.joined.size();
  do {
    set_fractions(step, query, own);
    ask(w, step, r.fractions, [&](const ImpactQuery &q, uint32_t i) {
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
void find_points(World &w, StepContext &step) {
  Buffers &r = buffers(step);
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
void set_forces(World &w, StepContext &step) {
  for (uint32_t i = 0; i < step.rows.n; ++i) {
    const ContactPoint &c = step.contacts[i];
    Vec3 pull;  // of the lagged friction on the relative velocity, m/s
    for (uint32_t k = 0; k < c.nnode; ++k) {
      uint32_t s;
      const Body &b = body_of_node(w, step, c.node[k], s);
      const size_t at = size_t{b.surface.point[s]} * kStride;
      const double *const force = &lagged(b)[at];
      for (int j = 0; j < 3; ++j)
        pull[j] += c.weight[k] * (step.h * (b.dynamics->diagonal()[at + size_t(j)] * force[j]));
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
void roll_back(World &w, StepContext &step) {
  for (size_t i = 0; i < step.body_views.size(); ++i) {
    Body &b = *w.bodies[step.body_views[i].slot];
    const double *const fraction = buffers(step).fractions[i];
    b.dynamics->free_changed();
    for (uint32_t s = 0; s < b.surface.nsurfel; ++s) {
      const size_t at = size_t{b.surface.point[s]} * kStride;
      const Vec3 before = load3(&b.p.v_free[at]);
      const Vec3 after = fraction[s] < 1 ? velocity_after(before, fraction[s]) : before;
      const Vec3 lost = b.p.mass[b.surface.point[s]] * (after - before);
      store3(&b.surfel_impulse[3 * size_t{s}], step.h * load3(&lagged(b)[at]) + lost);
      store3(&b.p.v_free[at], after);
    }
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
void keep_friction(World &w, StepContext &step) {
  for (const auto &b : w.bodies) std::fill(lagged(*b).begin(), lagged(*b).end(), 0.0);
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
      double *const to = &lagged(*w.bodies[b.slot])[size_t{b.surface.point[s]} * kStride];
      store3(to, load3(to) + c.weight[k] * force);
    }
  }
}

}  // namespace

bool stage_rollback(World &w, StepContext &step, uint32_t *trouble) {
  step.passes = step.sweeps = 0;
  step.residual = {};
  uint32_t nnode = 0;
  for (const BodyView &v : step.body_views) nnode = std::max(nnode, v.first_node + v.surface->nsurfel);
  Buffers &r = buffers(step);
  r.fraction.assign(nnode, 1.0);
  r.fractions.clear();
  for (const BodyView &v : step.body_views) r.fractions.push_back(&r.fraction[v.first_node]);
  find_islands(w, step);
  find_points(w, step);
  make_rows(w, step);
  set_forces(w, step);
  for (SolveIsland &island : step.solve_islands->all())
    if (const LawInstance *bad = island.batches.evaluate(step.h, step.state)) {
      *trouble |= tell_failed_solve(w, step, bad, island.batches.failed());
      return false;
    }
  w.stats.passes = step.rows.n > 0;
  w.stats.sweeps = 0;
  w.stats.residual = 0;
  w.stats.passes_max = std::max(w.stats.passes_max, w.stats.passes);
  reserve_contacts(w, step);
  roll_back(w, step);  // nothing fails from here on
  set_slip(w, step);
  keep_friction(w, step);
  return true;
}

}  // namespace dfm::rollback
