// No crossing at the end of a sub-step, at any speed. Between distribute and commit the path of every surfel
// is known: a straight line from x to x + h v. Each listed pair of features is tested, conservatively, for
// coming as near as d_g = d_c / 2 on that path (ccd/toi_guard). If it does:
//
//   1  each hit becomes a contact, linearized at its hit time, and the solve runs again, warm started,
//      at most 16 times
//   2  the sub-step is repeated, shorter: up to the safe fraction of the path, but no less than a quarter,
//      at most 8 times
//   3  everything takes the safe fraction of its path, and motion is lost; forces on explicit bodies act for
//      that fraction (Dynamics::take_part), and contact stops what is left (take_part_of_contact)
//
// Pairs that are not listed are not tested: broad/ covers the motion after the solve too (BroadPhase::cover).
// Reasons for this order, and for shortening the sub-step of the whole world:
// doc/decisions/detection_and_guard.md.
#include "step/guard.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "body/make_surface.h"
#include "body/obstacle_mesh.h"
#include "contact/reach.h"
#include "dynamics/rigid/rigid_set.h"
#include "geometry/obstacle_shape.h"
#include "geometry/pierce.h"
#include "math/turn.h"
#include "plugin/context.h"
#include "state/obstacle.h"
#include "state/tool.h"
#include "state/world.h"
#include "step/context.h"
#include "step/move_obstacles.h"
#include "step/self_contact.h"
#include "step/sides.h"
#include "step/stages.h"
#include "step/step_bound.h"
#include "step/watch/energy_watch.h"

namespace dfm {
namespace {

constexpr uint32_t kSolves = 16, kCuts = 8, kFractions = 40;
constexpr double kMinCut = 0.25;
// Strain: above the first a sub-step is repeated finer, until it is below the second.
constexpr double kHardImpact = 0.08, kSoftImpact = 0.05;
constexpr double kFinest = 4;    // sub-steps that an impact makes of one
constexpr double kNoWay = 0.02;  // of the motion of a sub-step: less counts as none
constexpr double kSlow = 0.01;   // of d_g: what moves by less needs no closer look at how it does
// Share of its energy that an end may add to a body whose scheme dissipates; pieces that are made of a
// sub-step above it.
constexpr double kGains = 0.01, kFinestGain = 32;

Guard::Common common_motion(const Surface &s) {
  Vec3 sum;
  for (uint32_t i = 0; i < s.nsurfel; ++i) sum += load3(&s.v[size_t{4} * i]);
  const Vec3 mean = (1.0 / s.nsurfel) * sum;
  double most = 0;
  for (uint32_t i = 0; i < s.nsurfel; ++i) most = std::max(most, norm2(load3(&s.v[size_t{4} * i]) - mean));
  return {mean, std::sqrt(most)};
}

// m, d_g
double floor_of(const World &w) { return 0.5 * w.offset; }

// Where an impulse moves all points, or the end need not agree with the linear response: the largest mean
// velocity of a surfel, and the largest change of one by contact; without it surface.v holds them.
void end_speeds(const Body &b, double &speed, double &change) {
  const double *const mean = b.dynamics->end().mean;
  double fastest = 0, most = 0;
  for (uint32_t s = 0; s < b.surface.nsurfel; ++s) {
    const Vec3 u = b.surface.sum(s, mean);
    fastest = std::max(fastest, norm2(u));
    most = std::max(most, norm2(u - load3(&b.surface.v[size_t{kStride} * s])));
  }
  speed = std::sqrt(fastest);
  change = std::sqrt(most);
}

// Only bodies with contacts move otherwise than predicted.
void bound_speeds(World &w, StepContext &step) {
  Guard &g = step.guard;
  g.speed.assign(w.bodies.size(), 0.0);
  g.change.assign(w.bodies.size(), 0.0);
  for (uint32_t d = 0; d < step.rows.ndof; ++d) {
    const uint32_t i = step.rows.source[d];
    if (i == kNone) continue;
    const Vec3 y = load3(&step.rows.y[size_t(d) * kStride]);
    const Vec3 change = y - load3(&step.rows.y_free[size_t(d) * kStride]);
    g.speed[i] = std::max(g.speed[i], norm2(y));
    g.change[i] = std::max(g.change[i], norm2(change));
  }
  // otherwise the speeds were not found before the solve
  const bool listed = w.plan.has(StageRole::lists_pairs);
  for (const uint32_t i : step.active) {
    const Body &b = *w.bodies[i];
    const double before = listed ? step.broad.speed(i) : largest_speed(b.surface);
    double &speed = g.speed[i];
    speed = std::sqrt(speed);
    g.change[i] = b.surface.weight_sum * std::sqrt(g.change[i]);
    speed = b.surface.identity() ? std::max(speed, before) : before + g.change[i];
    if (!b.dynamics->unknowns().diagonal) end_speeds(b, speed, g.change[i]);
  }
}

// What contact does to a body in a sub-step.
struct Impact {
  double strain = 0;   // largest change of a velocity, times h, over an edge
  double kinetic = 0;  // J, what it adds to the points
};

Impact impact_on(const StepContext &step, const Body &b, uint32_t slot) {
  const ContactRows &rows = step.rows;
  Impact out;
  double most = 0;
  for (uint32_t d = 0; d < rows.ndof; ++d) {
    if (rows.source[d] != slot) continue;
    const Vec3 y = load3(&rows.y[size_t{kStride} * d]);
    most = std::max(most, norm2(y - load3(&b.p.v[size_t{kStride} * rows.point[d]])));
    out.kinetic +=
        0.5 * b.p.mass[rows.point[d]] * (norm2(y) - norm2(load3(&rows.y_free[size_t{kStride} * d])));
  }
  out.strain = step.h * std::sqrt(most) / b.surface.median_edge;
  return out;
}

// Does a contact press on the body of this slot that did not press in the last sub-step?
bool meets(const World &w, const StepContext &step, uint32_t slot) {
  for (uint32_t i = 0; i < step.rows.soft(); ++i) {
    const ContactPoint &c = step.contacts[i];
    if (!is_side(c, slot)) continue;
    if (!(step.rows.impulse[3 * size_t{i}] > 0)) continue;
    const uint32_t before = step.match[i];
    if (before == kNone || !w.store.touching[before]) return true;
  }
  return false;
}

// The share of its energy that an end adds to a body whose scheme dissipates, where contact moves it; order
// four in the length of the sub-step. Backward Euler lowers the energy as long as cells turn by little, but
// its equation may have further solutions, in which a part of the body is turned over. A body that steps
// itself turns its frame without contact, and what contact changes is added along straight lines: a spin w
// that contact makes or stops leaves 1 - cos(h w) of the size as strain (doc/decisions/energy_watch.md).
double gain_of(const World &w, const StepContext &step, const Body &b, uint32_t slot) {
  const double least = kBoundStrain * b.surface.median_edge;
  if (!(step.h * step.guard.change[slot] > least)) return 0;
  // not what holds a weight up, which changes the free motion alone
  const double *const end = b.dynamics->end().v;
  double most = 0;
  for (uint32_t i = 0; i < b.p.n; ++i)
    most = std::max(most, norm2(load3(end + size_t{kStride} * i) - load3(&b.p.v[size_t{kStride} * i])));
  return step.h * std::sqrt(most) > least ? gain_at_end(w, step, b) : 0;
}

// An impact is a change of a point's velocity by contact that strains an edge in this sub-step by more than
// the bound allows for. It is measured from the velocity at the start, because the support of a resting
// weight changes only the predicted velocity. After an impact the next sub-step checks the bound. False:
// this sub-step is to be repeated with shorter ones, and later ones are shorter as well. The scheme keeps
// energy as far as the trapezoid of the forces is their work; if an edge is strained by s at once, the error
// is about s^2 of the energy that contact brings, which is too much only if contact brings more than the
// body has (doc/decisions/explicit_time.md).
bool withstands_impacts(World &w, StepContext &step) {
  if (step.rows.ndof == 0) return true;
  Guard &g = step.guard;
  double hard = 0, gain = 0;
  for (const uint32_t i : step.active) {
    const Body &b = *w.bodies[i];
    gain = std::max(gain, gain_of(w, step, b, i));
    if (g.change[i] > 0 && gravity_exceeds_bound(w, b) && meets(w, step, i)) bring_check_forward(w, b);
    if (!(step.h * g.change[i] > kBoundStrain * b.surface.median_edge)) continue;
    if (!b.dynamics->unknowns().diagonal) continue;
    const Impact impact = impact_on(step, b, i);
    if (impact.strain > kBoundStrain) expire_bound(w);
    if (impact.kinetic > step.free_kinetic[i]) hard = std::max(hard, impact.strain);
  }
  // impacts divide what is planned, gains any piece of it
  const bool whole = step.h == step.length.planned && step.length.parts == 1;
  const auto fits = [&](double parts) {
    return whole ? parts <= step.length.most_parts && may_refine(w, step, parts)
                 : may_repeat(w, w, step, step.budget);
  };
  double parts = 1;
  while (gain > kGains * (parts * parts) * (parts * parts) &&
         2 * parts * step.length.planned <= kFinestGain * step.h)
    parts *= 2;
  if (whole && hard > kHardImpact)
    while (hard > parts * kSoftImpact && parts < kFinest) parts *= 2;
  while (parts > 1 && !fits(parts)) parts /= 2;
  if (parts == 1) return true;
  step.length.divide(step.h, parts);
  return false;
}

// The lists after the solve.
void follow_ends(World &w, StepContext &step) {
  if (w.plan.has(StageRole::lists_pairs))
    step.broad.cover(step.body_views, step.obstacle_views, w.pairs.filter, step.h, w.offset, step.guard.speed,
                     &w.context->tasks);
  follow_pairs(w, w, step, step, cover_self(w, step));
}

void make_room(GuardSide &s, const Surface &surface) {
  s.surface = &surface;
  if (s.stamp.size() != surface.nsurfel) {
    s.stamp.assign(surface.nsurfel, 0);
    s.end.assign(size_t{4} * surface.nsurfel, 0.0);
  }
}

// Finds which copies of points stay within their slack.
void follow_copies(const SelfBody &b, double h, GuardSide &s) {
  const Surface &surface = b.body->surface;
  s.opened = &b.rest.opened;
  s.pairs[0] = b.pairs.of_face.data();
  s.pairs[1] = b.pairs.of_edges.data();
  s.held.resize(b.pairs.copies.size());
  const auto mean = [&](uint32_t surfel) { return load3(&s.mean[4 * size_t{surface.point[surfel]}]); };
  for (size_t k = 0; k < s.held.size(); ++k) {
    const OpenedSurface::Copies &c = s.opened->copies[k];
    s.held[k] = b.pairs.slack[k] > h * norm(mean(c.a) - mean(c.b));
  }
}

// Finds how all sides move with the velocities of the solve.
void set_sides(World &w, StepContext &step) {
  GuardScene &scene = step.guard.scene;
  const size_t nb = w.bodies.size();
  scene.bodies = step.body_views;
  scene.obstacles = step.obstacle_views;
  scene.sides.resize(nb + w.obstacles.size());
  scene.poses.resize(w.obstacles.size());
  scene.h = step.h;
  scene.offset = w.offset;
  scene.floor = floor_of(w);
  scene.margin = 0.1 * (w.offset - scene.floor);
  for (size_t i = 0; i < nb; ++i) {
    const Body &b = *w.bodies[i];
    GuardSide &s = scene.sides[i];
    make_room(s, b.surface);
    s.still = b.sleep_state.asleep;
    s.whole = b.surface.origin.empty() ? 0 : b.surface.whole(b.id);
    s.travel = s.spread = step.h * step.guard.speed[i];
    s.drift = {};
    if (s.travel > kSlow * scene.floor) {
      Guard::Common &common = step.guard.common[i];
      if (common.spread < 0) common = common_motion(b.surface);
      s.drift = step.h * common.mean;
      s.spread = step.h * (common.spread + step.guard.change[i]);
    }
    s.mean = b.dynamics->end().mean;
    s.local = nullptr;
    s.opened = nullptr;
  }
  for (const auto &b : step.self_bodies) {
    GuardSide &s = scene.sides[b->body->slot];
    if (b->on) s.deform = step.h * (b->list.deforming() + step.guard.change[b->body->slot]);
    if (b->on && b->rest.opened.any()) follow_copies(*b, step.h, s);
  }
  for (size_t o = 0; o < w.obstacles.size(); ++o) {
    const ObstacleView &v = step.obstacle_views[o];
    GuardSide &s = scene.sides[nb + o];
    s.whole = 0;  // a part of a body may have had this place
    const double turn = norm(v.spin);
    s.drift = step.h * v.velocity;
    s.spread =
        turn > 0 ? step.h * turn * (v.shape == Shape::plane ? HUGE_VAL : ObstacleShape(v).extent()) : 0;
    s.travel = norm(s.drift) + s.spread;
    s.still = !v.moves();
    if (v.shape != Shape::mesh) continue;
    make_room(s, *v.surface);
    s.local = w.obstacles[o]->mesh->local.data();
  }
}

// Surfels that are set back end where the faces around them set them back at the end. Returns m, the largest
// distance between these ends and those of their straight ways.
double set_back_ends(GuardScene &scene, GuardSide &side, Surface &s) {
  double most = 0;
  const auto straight = [&](uint32_t i) { return scene.fraction * scene.h * s.sum(i, side.mean); };
  for (const uint32_t t : s.coincident)
    for (size_t k = 0; k < 3; ++k) {
      const uint32_t i = s.tri[3 * size_t{t} + k];
      if (std::exchange(side.stamp[i], scene.round) == scene.round) continue;
      store3(&side.end[4 * size_t{i}], load3(&s.place[4 * size_t{i}]) + straight(i));
    }
  ways_back(s, side.end.data(), [&](uint32_t i, Vec3 way) {
    double *const end = &side.end[4 * size_t{i}];
    add3(end, s.back * way);
    most = std::max(most, norm2(load3(end) - load3(&s.x[4 * size_t{i}]) - straight(i)));
  });
  return std::sqrt(most);
}

// Moves everything by this fraction of its path.
void set_fraction(World &w, StepContext &step, double fraction) {
  GuardScene &scene = step.guard.scene;
  step.guard.motion = scene.fraction = fraction;
  ++scene.round;
  for (size_t i = 0; i < w.bodies.size(); ++i) {
    GuardSide &side = scene.sides[i];
    Surface &surface = w.bodies[i]->surface;
    if (side.still || !(surface.back > 0)) continue;
    const double turned = set_back_ends(scene, side, surface);
    if (fraction < 1) continue;
    side.travel += turned;
    side.spread += turned;
    side.deform += turned;
  }
  for (size_t o = 0; o < w.obstacles.size(); ++o) {
    const ObstacleView &v = step.obstacle_views[o];
    GuardPose &to = scene.poses[o];
    to = {v.position, v.rotation};
    if (!v.moves()) continue;
    const Pose end = end_pose(w, step, *w.obstacles[o]);
    to = {end.position, end.rotation};
    if (fraction < 1)
      to = {v.position + fraction * (end.position - v.position), slerp(v.rotation, end.rotation, fraction)};
    scene.sides[w.bodies.size() + o].pose = to;
  }
}

bool are_parts(const StepContext &step, const Candidate &c) {
  const GuardSide &a = step.guard.scene.sides[c.slot_a], &b = step.guard.scene.sides[c.slot_b];
  return a.whole && a.whole == b.whole;
}

const Guard::Through &crossing(const Views &views, Detection &detection, uint32_t slot_a, uint32_t slot_b,
                               bool obstacle) {
  Guard &g = detection.guard;
  for (const Guard::Through &t : g.through)
    if (t.a == slot_a && t.b == slot_b && t.obstacle == obstacle) return t;
  Guard::Through found{slot_a, slot_b, obstacle, {}};
  const Surface &a = *views.body_views[slot_a].surface;
  const Surface &b = obstacle ? *views.obstacle_views[slot_b].surface : *views.body_views[slot_b].surface;
  detection.broad.near_triangles_of(slot_a, slot_b, obstacle, [&](uint32_t s, uint32_t t) {
    if (triangles_cross(a, s, b, t)) found.triangles.push_back({s, t});
  });
  return g.through.emplace_back(std::move(found));
}

// Two surfaces that cross at the start (as placed by the user) are not guarded: guarding them would keep them
// crossed. Parts of one body by feature: their teeth may cross in one place and not in another.
bool cross_at_start(StepContext &step, const Candidate &c) {
  const bool swap = !c.obstacle && c.slot_b < c.slot_a;
  const uint32_t low = swap ? c.slot_b : c.slot_a, high = swap ? c.slot_a : c.slot_b;
  const auto &crossed = crossing(step, step, low, high, c.obstacle).triangles;
  if (c.obstacle || !are_parts(step, c)) return !crossed.empty();
  const auto has = [&](uint32_t slot, uint32_t t, int kind, uint32_t feature) {
    const Surface &s = *step.body_views[slot].surface;
    const uint32_t *const of = (kind == 0 ? s.tri : s.tri_edge).data() + 3 * size_t{t};
    return kind == 2 ? t == feature : of[0] == feature || of[1] == feature || of[2] == feature;
  };
  const int kind_a = c.kind == kEdgeEdge ? 1 : 0, kind_b = c.kind == kEdgeEdge ? 1 : 2;
  return std::any_of(crossed.begin(), crossed.end(), [&](const auto &at) {
    const auto [a, b] = swap ? std::pair(at.second, at.first) : at;
    return has(c.slot_a, a, kind_a, c.feature_a) && has(c.slot_b, b, kind_b, c.feature_b);
  });
}

// For pairs of a body with itself that has open faces, or of two parts of one body.
bool of_cut(const World &w, const StepContext &step, const Candidate &c) {
  return of_one_body(c) ? w.bodies[c.slot_a]->surface.slit : !c.obstacle && are_parts(step, c);
}

// The safe fraction of the path; 1: nothing comes too near.
double find_hits(World &w, StepContext &step) {
  Guard &g = step.guard;
  g.hits.clear();
  charge(w, step, surface_work(w, step));
  if (g.near.empty()) return 1;
  const Array<Candidate> &list = *g.list;
  guard_pairs(g.scene, list, g.near, g.hits);
  std::erase_if(g.hits, [&](const GuardHit &hit) {
    const Candidate &c = list[hit.candidate];
    if (g.lets_slits && of_cut(w, step, c)) return true;
    return of_one_body(c) ? !(guarded_apart(w, step, c) > 0) : cross_at_start(step, c);
  });
  guard_obstacles(g.scene, list, g.near, g.hits);
  guard_filter_hits(w, step);
  double least = 1;
  for (const GuardHit &hit : g.hits) least = std::min(least, hit.safe);
  return least;
}

// Wakes sleeping bodies that are hit before a contact has woken them.
bool wake_hit(World &w, StepContext &step) {
  const uint32_t before = w.sleepers;
  for (const GuardHit &hit : step.guard.hits) {
    const Candidate &c = (*step.guard.list)[hit.candidate];
    if (w.sleepers == 0) break;
    wake(w, *w.bodies[c.slot_a]);
    if (!c.obstacle) wake(w, *w.bodies[c.slot_b]);
  }
  return w.sleepers < before;
}

// No motion is left, and the contact solve has no solution: the bodies are jammed. Impulses that cannot help
// would grow from sub-step to sub-step, and their rounding error would become motion. Only prescribed motion
// can cause this, because free bodies and coupled tools yield.
bool jammed(const World &w, const StepContext &step) {
  if (!(step.guard.motion < kNoWay && step.h > 0.5 * step.length.planned && step.residual.required > 1))
    return false;
  // contact may have an answer that the budget has not let it find
  if (step.budget.divided && step.budget.cheapened) return false;
  const auto prescribed = [&](const Obstacle &o) {
    return !o.rigid || std::ranges::any_of(
                           w.tools, [&](const auto &t) { return t->set == o.rigid && !t->motion.coupled(); });
  };
  return !step.driven.empty() || std::ranges::any_of(w.obstacles, [&](const auto &o) {
    return step.obstacle_views[o->slot].moves() && prescribed(*o);
  });
}

// The fraction of the way that leaves no hit, by checks as far as the budget holds them; else none. safe: the
// one that the last check found, of hits that include those across slits.
void take_safe_part(World &w, StepContext &step, bool lets_slits, double safe) {
  step.guard.lets_slits = lets_slits;
  if (lets_slits) safe = may_check(w, step) ? find_hits(w, step) : 0;
  for (uint32_t k = 0; !step.guard.hits.empty(); ++k) {
    const bool goes_on = k < kFractions && safe > 0 && may_check(w, step);
    set_fraction(w, step, goes_on ? step.guard.motion * std::min(safe, 0.999) : 0);
    if (step.guard.motion == 0) break;
    safe = find_hits(w, step);
  }
  step.guard.forget();  // surfaces that are set back may have moved by more than counts
}

}  // namespace

bool cross_at_start(const Views &views, Detection &detection, uint32_t slot_a, uint32_t slot_b,
                    bool obstacle) {
  return !crossing(views, detection, slot_a, slot_b, obstacle).triangles.empty();
}

void follow_pairs(const WorldMemory &memory, const Derived &derived, Views &views, Detection &detection,
                  bool fresh) {
  Guard &g = detection.guard;
  if (std::exchange(g.placements, derived.placements) != derived.placements) g.forget();
  const uint64_t renewals = detection.broad.stats().renewals;
  if (!fresh && !g.memory.runs.empty() && g.lists == renewals) return;
  g.lists = renewals;
  const Array<Candidate> &pairs = detection.broad.candidates();
  try {
    const bool listed = derived.plan.has(StageRole::lists_pairs);
    g.list = join_self(views, listed ? &pairs : nullptr, g.joined) ? &g.joined : &pairs;
    g.memory.follow(*g.list, &memory.context->tasks);
  } catch (...) {
    g.forget();  // out of memory: what is known is of no list
    throw;
  }
}

void check_motion(const World &w, StepContext &step, uint32_t i) {
  if (w.plan.has(StageRole::lists_pairs) && step.h * step.broad.speed(i) > kSlow * floor_of(w))
    step.guard.common[i] = common_motion(w.bodies[i]->surface);
}

// Next::stop: trouble, or the sub-step is to be repeated, shorter.
Next stage_guard(World &w, StepContext &step, uint32_t *trouble) {
  if (step.guard.solves == 0) step.guard.kept.clear();
  if (!find_ends(w, step, trouble)) return Next::stop;
  bound_speeds(w, step);
  follow_ends(w, step);
  set_sides(w, step);
  set_fraction(w, step, 1);
  guard_near(step.guard.scene, *step.guard.list, step.guard.memory, step.guard.near, &step.guard.blocks,
             &w.context->tasks);
  const double safe = find_hits(w, step);
  if (step.guard.hits.empty()) return go_on(withstands_impacts(w, step));
  step.guard.acted = true;
  // also where the budget holds no repetition: the impulse of a contact needs two bodies that move
  if (w.sleepers > 0 && wake_hit(w, step)) {
    step.length.repeat(1);
    return Next::stop;
  }
  if (step.guard.solves < kSolves && may_solve_again(w, step, step.guard.hits.size())) {
    guard_add_hits(w, step);
    for (const uint32_t i : step.active)
      if (Dynamics &d = *w.bodies[i]->dynamics; d.unknowns().diagonal)
        d.end_state(sub_step_of(w, w, step), nullptr, false);
    step.guard.resolving = true;
    ++step.guard.solves;
    ++w.stats.guard_solves;
    return Next::solve;
  }
  if (step.guard.cuts < kCuts && may_repeat(w, w, step, step.budget)) {
    ++step.guard.cuts;
    ++w.stats.guard_cuts;
    step.length.repeat(std::max(safe, kMinCut));
    return Next::stop;
  }
  // Teeth of a cut that interlock may leave no way at all, where the rest of the world has one: what contact
  // does not keep apart there crosses. Where pieces are left out to save work, only if there is no way.
  const auto hits_cuts = [&] {
    return std::any_of(step.guard.hits.begin(), step.guard.hits.end(), [&](const GuardHit &hit) {
      return of_cut(w, step, (*step.guard.list)[hit.candidate]);
    });
  };
  const bool cuts = hits_cuts(), saves = step.guard.cuts < kCuts;
  if (!(cuts && saves)) take_safe_part(w, step, cuts, safe);
  else if (take_safe_part(w, step, false, safe); step.guard.motion < kNoWay && may_check(w, step)) {
    set_fraction(w, step, 1);
    take_safe_part(w, step, true, safe);
  }
  if (jammed(w, step)) return go_on(report_jam(w, w, step, step, step, kNone, trouble));
  if (!withstands_impacts(w, step)) return Next::stop;
  return Next::stage;
}

}  // namespace dfm
