// Tools so fast that they do not meet where they are nearest at the start of the sub-step. After a solve the
// guard's time of impact (ccd/) is computed along the straight paths of capsules. A pair that meets becomes a
// row, linearized at its hit time, and all rows are solved again, at most four times.
#include <algorithm>

#include "body/obstacle_mesh.h"
#include "ccd/toi_guard_motion.h"
#include "core/error.h"
#include "dynamics/rigid/rigid_set.h"
#include "math/turn.h"
#include "plugin/context.h"
#include "state/obstacle.h"
#include "state/tool.h"
#include "state/world.h"
#include "step/budget.h"
#include "step/context.h"
#include "step/rigid/rigid.h"
#include "step/rigid/tool_touch.h"

namespace dfm {
namespace {

constexpr uint32_t kMaxHits = 4;  // further solves
constexpr double kSlow = 5e-4;    // m in a sub-step: what moves by less is kept apart by its rows
constexpr uint32_t kLooks = 16;   // pieces of an edge whose ends are tested
// Whether the bounding spheres of the two, or that of one and a plane, do not meet.
bool balls_apart(const ObstacleView &a, const ObstacleView &b) {
  if (a.shape == Shape::plane && b.shape == Shape::plane) return true;
  if (a.shape == Shape::plane)
    return dot(rotate(a.rotation, {0, 0, 1}), b.position - a.position) > ball_around(b);
  if (b.shape == Shape::plane) return balls_apart(b, a);
  const double far = ball_around(a) + ball_around(b);
  return norm2(a.position - b.position) > far * far;
}

// m, depth of the center of a shape without corners inside another one; 0: it is outside.
double center_depth(const ToolShape &a, const ToolShape &b) {
  double deepest = 0;
  ObstaclePoint o;
  for (const auto &[own, other] : {std::pair(&a, &b), std::pair(&b, &a)})
    if (!own->endless() && other->closest(own->position(), HUGE_VAL, o))
      deepest = std::max(deepest, -o.distance);
  return deepest;
}

bool cuts(const World &w, const Obstacle &o) {
  return std::any_of(w.tools.begin(), w.tools.end(),
                     [&](const auto &t) { return t->set == o.rigid && !t->cuts.bodies.empty(); });
}

constexpr double kDeep = 0.02;    // of the smaller one's reach: a smaller depth is not reported
constexpr double kWithin = 0.1;   // of the floor: a hit may be found this far above it
constexpr uint64_t kSeldom = 16;  // steps between two tests of driven tools against triangles

}  // namespace

// Whether the depth is reported.
bool ToolTouch::inside(const ToolShape &a, const ToolShape &b, double deep) const {
  const double smaller = std::min(a.endless() ? HUGE_VAL : a.reach(), b.endless() ? HUGE_VAL : b.reach());
  return deep > offset_ + kDeep * smaller;
}

// The place of p at the end of the sub-step, by the present velocities.
Vec3 ToolTouch::end_of(const Side &side, Vec3 p) const {
  const Moved &m = sides_[side.tool];
  const size_t at = 6 * size_t{side.part};
  const Vec3 from = center(side), way = load3(&m.now[at]), spin = load3(&m.now[at + 3]);
  return from + h_ * way + rotate(turned(Quat{}, h_ * spin), p - from);
}

void ToolTouch::find_hits(const Pair &pair, ToolShape &a, ToolShape &b, Side at_a, Side at_b) {
  const double far = h_ * (fastest(a, at_a, b) + fastest(b, at_b, a));
  if (far < kSlow || !cull_facing(a, b, 2 * far + offset_, pair.jaw)) return;
  const double floor = 0.5 * offset_;
  narrow::PairMotion m;
  m.edges = true;
  m.round = a.round() + b.round();
  const auto put = [&](size_t k, const Side &side, const ToolShape::Edge &e) {
    store3(m.m[k].p0, e.from);
    store3(m.m[k].p1, end_of(side, e.from));
    store3(m.m[k + 1].p0, e.to);
    store3(m.m[k + 1].p1, end_of(side, e.to));
  };
  const auto place = [&](size_t k, double s, double t) {
    const auto at = [&](const dfm_motion &x) { return load3(x.p0) + t * (load3(x.p1) - load3(x.p0)); };
    return at(m.m[k]) + s * (at(m.m[k + 1]) - at(m.m[k]));
  };
  for (const ToolShape::Edge &p : a.edges()) {
    put(0, at_a, p);
    for (const ToolShape::Edge &q : b.edges()) {
      put(2, at_b, q);
      if (m.far_apart(floor) || !(m.distance(0) > floor)) continue;
      const ToiHit hit = m.touch(floor, kWithin * floor);
      if (!(hit.t <= 1)) continue;
      const Vec3 apart = place(0, hit.at[0], hit.t) - place(2, hit.at[1], hit.t);
      if (!(norm(apart) > 0)) continue;
      const Vec3 n = normalized(apart), on_a = place(0, hit.at[0], 0), on_b = place(2, hit.at[1], 0);
      // The normal is that of the hit, so the two may overlap along it now: that must not push them apart,
      // which would add energy.
      const double gap = std::max(dot(n, on_a - on_b) - m.round, offset_);
      hits_.push_back(
          {&pair, {kHitEdges, p.number, q.number}, at_a, at_b, {0.5 * (on_a + on_b), on_a, on_b}, n, gap});
    }
  }
}

// Pairs that meet on the way become rows, and no row has an impulse yet. Returns false if there are none.
bool ToolTouch::add_hits(const World &w, const StepContext &step) {
  hits_.clear();
  each_pair(w, step, [&](const Pair &pair, ToolShape &a, ToolShape &b, Side at_a, Side at_b) {
    if (a.round() > 0 && b.round() > 0) find_hits(pair, a, b, at_a, at_b);
  });
  if (hits_.empty()) return false;
  for (const Hit &hit : hits_) {
    std::erase_if(rows_, [&](const Row &row) { return row.key == key_of(hit.pair->id, hit.name); });
    add_row(*hit.pair, hit.name, hit.a, hit.b, hit.place, hit.normal, hit.gap, HUGE_VAL);
  }
  return true;
}

bool ToolTouch::finds_more(World &w, StepContext &step) {
  if (rows_.empty() || hits_found_ == kMaxHits || is_used_up(step)) return false;
  if (outruns_rows()) {
    rows_.clear();
    find(w, step);
  } else if (!add_hits(w, step)) return false;
  take_last(w, step);
  ++hits_found_;
  return true;
}

// m, how deep one reaches into the other now, by its corners and, if `edges`, along its edges; 0: not at all.
double ToolTouch::depth(ToolShape &a, ToolShape &b, bool edges) const {
  if (!cull_facing(a, b, offset_, true)) return 0;
  double deepest = 0;
  ObstaclePoint o;
  const auto look = [&](const ToolShape &in, Vec3 p, double round) {
    if (in.closest(p, HUGE_VAL, o)) deepest = std::max(deepest, round - o.distance);
  };
  for (const auto &[own, other] : {std::pair(&a, &b), std::pair(&b, &a)}) {
    for (const auto &corner : own->corners()) look(*other, corner.at, own->round());
    if (!edges) continue;
    for (const ToolShape::Edge &e : own->edges())
      for (uint32_t k = 1; k < kLooks; ++k)
        look(*other, e.from + (double(k) / kLooks) * (e.to - e.from), own->round());
  }
  return deepest;
}

bool ToolTouch::reported(const Pair &pair) const {
  return std::any_of(reported_.begin(), reported_.end(),
                     [&](const auto &known) { return known[0] == pair.id[0] && known[1] == pair.id[1]; });
}

// Warns, once for each pair, of rigid bodies of other hosts that pass through something. A host with a world
// of its own may let bodies overlap by a little.
void ToolTouch::warn_passing(const World &w, const StepContext &step) {
  for (const Pair &pair : passing_) {
    const Obstacle &a = *w.obstacles[pair.a], &b = *w.obstacles[pair.b];
    const ObstacleView &va = step.obstacle_views[a.slot], &vb = step.obstacle_views[b.slot];
    if (!ToolShape::takes_part(va) || !ToolShape::takes_part(vb) || balls_apart(va, vb) || reported(pair))
      continue;
    ToolShape shape_a(va, a.mesh.get()), shape_b(vb, b.mesh.get());
    const bool corners = shape_a.has_corners() || shape_b.has_corners();
    const double deep = corners ? depth(shape_a, shape_b, true) : center_depth(shape_a, shape_b);
    if (!inside(shape_a, shape_b, deep)) continue;
    reported_.push_back({pair.id[0], pair.id[1]});
    if (!corners) {
      const Obstacle &body = is_moved(a) ? a : b;
      w.context->logf(
          DFM_LOG_WARNING,
          "the center of '%s' is %.3g m deep in '%s' at %.6g s and goes through it, because rigid "
          "bodies meet planes and voxels with their corners, which voxels have none of; give it "
          "triangles or boxes as its shape, or filter the pair",
          body.name.c_str(), deep, (&body == &a ? b : a).name.c_str(), w.time);
      continue;
    }
    const auto held = [](const Obstacle &o) { return is_moved(o) && o.rigid->host_name != "builtin"; };
    const Obstacle &body = held(a) ? a : b, &other = held(a) ? b : a;
    w.context->logf(DFM_LOG_WARNING,
                    "rigid body '%s' is %.3g m deep in '%s' at %.6g s and goes through it, because host '%s' "
                    "does not know of it; make both bodies of this host (what stands: \"fixed\"), or filter "
                    "the pair",
                    body.name.c_str(), deep, other.name.c_str(), w.time, body.rigid->host_name.c_str());
  }
}

// Warns, once for each pair, of what the rows do not end: a tool without a coupling that passes through an
// obstacle, and something placed inside what keeps it out.
void ToolTouch::warn_deep(const World &w, const Pair &pair, double deep, bool driven) {
  if (reported(pair)) return;
  reported_.push_back({pair.id[0], pair.id[1]});
  const bool first = pair.wall[0] != kNone;
  const Obstacle &own = *w.obstacles[first ? pair.b : pair.a], &other = *w.obstacles[first ? pair.a : pair.b];
  if (driven)
    w.context->logf(DFM_LOG_WARNING,
                    "tool '%s' is %.3g m deep in '%s' at %.6g s and goes through it, because it goes exactly "
                    "where it is told; give it a \"coupling\" (stiffness), or filter the pair",
                    own.name.c_str(), deep, other.name.c_str(), w.time);
  else
    w.context->logf(
        DFM_LOG_WARNING,
        "'%s' is %.3g m deep in '%s' at %.6g s, which contact opens by %.2g m in a sub-step only; "
        "place it outside, or filter the pair",
        own.name.c_str(), deep, other.name.c_str(), w.time, kOpens * offset_);
}

// Warns of tools without a coupling that pass through each other or through obstacles. Tools that cut are
// left out: their edge goes into the table under what they cut.
void ToolTouch::warn_driven(const World &w, const StepContext &step) {
  const auto can_move = [&](const Side &side, const Obstacle &to) {
    const Moved &m = sides_[side.tool];
    return m.responds ||
           (m.gives(to) && std::any_of(m.jaws.begin(), m.jaws.end(),
                                       [&](const Moved::Jaw &jaw) { return jaw.part == side.part; }));
  };
  for (const Pair &pair : pairs_) {
    const Obstacle &a = *w.obstacles[pair.a], &b = *w.obstacles[pair.b];
    const bool wall_a = pair.wall[0] != kNone, wall_b = pair.wall[1] != kNone;
    const Side at_a = side_of(a, pair.wall[0]), at_b = side_of(b, pair.wall[1]);
    if ((!wall_a && can_move(at_a, b)) || (!wall_b && can_move(at_b, a)) || reported(pair)) continue;
    const ObstacleView &va = step.obstacle_views[a.slot], &vb = step.obstacle_views[b.slot];
    if (!ToolShape::takes_part(va) || !ToolShape::takes_part(vb)) continue;
    const bool mesh = va.surface || vb.surface;
    if (wall_a || wall_b) {
      if (cuts(w, wall_a ? b : a) || balls_apart(va, vb) || (mesh && w.step_count % kSeldom != 0)) continue;
      ToolShape shape_a(va, a.mesh.get()), shape_b(vb, b.mesh.get());
      const double deep = depth(shape_a, shape_b, !mesh);
      if (inside(shape_a, shape_b, deep)) warn_deep(w, pair, deep, true);
      continue;
    }
    ToolShape shape_a(va, a.mesh.get()), shape_b(vb, b.mesh.get());
    const double deep = depth(shape_a, shape_b, true);
    hits_.clear();
    if (!(deep > offset_)) find_hits(pair, shape_a, shape_b, at_a, at_b);
    if (!(deep > offset_) && hits_.empty()) continue;
    reported_.push_back({pair.id[0], pair.id[1]});
    w.context->logf(DFM_LOG_WARNING,
                    "tools '%s' and '%s' have met at %.6g s%s and pass each other, because both go exactly "
                    "where they are told; give one of them a \"coupling\" (stiffness), or filter the pair",
                    a.name.c_str(), b.name.c_str(), w.time,
                    deep > offset_ ? format(" (%.3g m deep)", deep).c_str() : "");
  }
}

}  // namespace dfm
