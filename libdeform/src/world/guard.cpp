// No crossing at the end of a sub-step, whatever the speed. Between distribute and commit the way of every surfel is known: a straight line from x to
// x + h v. Every listed pair of features is asked, conservatively, whether it comes as near as d_g = d_c / 2 on that way (narrow/toi_guard). If so:
//
//   1  each hit becomes a contact, linearised at its hit time, and the solve runs again, warm                       at most 4 times
//   2  the sub-step is taken anew, shorter: up to the safe part of the way, but no less than a quarter               at most 8 times
//   3  all that moves takes the safe share of its way; velocities stay, so no momentum is lost, only way
//
// What is not listed is not asked: broad/ covers the motion after the solve too (BroadPhase::cover). Why the order is this one and the cut is the whole
// world's: doc/decisions/0020-guard-cuts-time.md.
#include "world/guard.h"

#include <algorithm>
#include <array>

#include "narrow/detail.h"
#include "surfel/obstacle_shape.h"
#include "world/world.h"

namespace dfm {
namespace {

constexpr uint32_t kSolves = 4, kCuts = 8, kShares = 40, kMostHits = 128;
constexpr double kLeastCut = 0.25;

double floor_of(const World &w) { return 0.5 * w.offset; }
double margin_of(const World &w) { return 0.1 * (w.offset - floor_of(w)); }

Vec3 end_velocity(const Body &b, uint32_t point, bool touched) {
  const size_t at = size_t{point} * kStride;
  const Vec3 v = load3(&b.p.v_free[at]), m = load3(&b.p.inv_mass[at]), p = load3(&b.p.impulse[at]);
  return touched ? Vec3{v.x + m.x * p.x, v.y + m.y * p.y, v.z + m.z * p.z} : v;
}

// Bounds of the surfels' speeds after the solve: only what contacts have touched moves otherwise than predicted.
void bound_motion(World &w) {
  Guard &g = w.guard;
  const size_t n = w.bodies.size();
  g.speed.assign(n, 0.0), g.travel.assign(n, 0.0);
  for (uint32_t d = 0; d < w.rows.ndof; ++d) {
    const uint32_t i = w.rows.source[d];
    const Body &b = *w.bodies[i];
    if (b.model.stepper) continue;
    const Vec3 y = load3(&w.rows.y[size_t(d) * kStride]), change = y - load3(&b.p.v_free[size_t(w.rows.point[d]) * kStride]);
    g.speed[i] = std::max(g.speed[i], norm2(b.surface.identity() ? y : change));
  }
  for (size_t i = 0; i < n; ++i) {
    const Body &b = *w.bodies[i];
    double &speed = g.speed[i];
    speed = std::sqrt(speed);
    if (b.model.stepper) {   // has written its end beside its start
      for (uint32_t s = 0; s < b.surface.nsurfel; ++s) {
        Vec3 x;
        b.surface.each_phyxel(s, [&](uint32_t p, double weight) { x += weight * load3(&b.p.f[size_t(p) * kStride]); });
        speed = std::max(speed, norm(x - load3(&b.surface.x[size_t(s) * 4])) / w.h);
      }
    } else {
      speed = b.surface.identity() ? std::max(speed, w.broad.speed(i)) : w.broad.speed(i) + b.surface.weight_sum * speed;
    }
    g.travel[i] = w.h * speed;
  }
}

void find_end(World &w, uint32_t slot, uint32_t surfel) {
  Guard &g = w.guard;
  if (g.stamp[slot][surfel] == g.round) return;
  g.stamp[slot][surfel] = g.round;
  const Body &b = *w.bodies[slot];
  const bool touched = w.rows.n > 0;
  const Vec3 x = load3(&b.surface.x[size_t(surfel) * 4]);
  Vec3 to;
  b.surface.each_phyxel(surfel, [&](uint32_t p, double weight) {
    to += b.model.stepper ? weight * load3(&b.p.f[size_t(p) * kStride]) : (weight * w.h) * end_velocity(b, p, touched);
  });
  if (b.model.stepper) to -= x;
  store3(&g.end[slot][size_t(surfel) * 4], x + g.motion * to);
}

// Ends of the features in `near`, and of the obstacles.
void find_ends(World &w) {
  Guard &g = w.guard;
  ++g.round;
  for (const uint32_t i : g.near) {
    const Candidate &c = w.broad.candidates()[i];
    const Surface &a = *w.body_views[c.slot_a].surface;
    const int corners = c.obstacle ? c.kind + 1 : c.kind == kEdgeEdge ? 2 : 1;
    const uint32_t *const of_a = corners == 3 ? &a.tri[3 * size_t{c.feature_a}] : corners == 2 ? &a.edge[2 * size_t{c.feature_a}] : &c.feature_a;
    for (int k = 0; k < corners; ++k) find_end(w, c.slot_a, of_a[k]);
    if (c.obstacle) continue;
    const Surface &b = *w.body_views[c.slot_b].surface;
    const int corners_b = c.kind == kEdgeEdge ? 2 : 3;
    const uint32_t *const of_b = corners_b == 2 ? &b.edge[2 * size_t{c.feature_b}] : &b.tri[3 * size_t{c.feature_b}];
    for (int k = 0; k < corners_b; ++k) find_end(w, c.slot_b, of_b[k]);
  }
  g.poses.clear();
  for (const ObstacleView &v : w.obstacle_views) {
    const Obstacle &o = *w.obstacles[v.slot];
    const Pose end = o.end_pose(w.time, w.h, w.left);
    g.poses.push_back({v.position + (g.motion * w.h) * v.velocity, norm2(v.spin) > 0 ? slerp(v.rotation, end.rotation, g.motion) : v.rotation});
  }
}

bool pierces(const Surface &s, Vec3 p, Vec3 q, uint32_t triangle) {
  const uint32_t *const c = &s.tri[3 * size_t{triangle}];
  Vec3 x[3];
  for (int k = 0; k < 3; ++k) x[k] = load3(&s.x[4 * size_t{c[k]}]);
  if (!(tet_volume(x[0], x[1], x[2], p) * tet_volume(x[0], x[1], x[2], q) < 0)) return false;
  const double v0 = tet_volume(p, q, x[0], x[1]), v1 = tet_volume(p, q, x[1], x[2]), v2 = tet_volume(p, q, x[2], x[0]);
  return (v0 >= 0 && v1 >= 0 && v2 >= 0) || (v0 <= 0 && v1 <= 0 && v2 <= 0);
}

// Two bodies that cross at the start (as given by the user) are let out: what is through cannot be kept out, and to guard it would keep it in.
bool cross_at_start(World &w, uint32_t slot_a, uint32_t slot_b) {
  Guard &g = w.guard;
  for (const Guard::Through &t : g.through)
    if (t.a == slot_a && t.b == slot_b) return t.yes;
  const Surface &a = *w.body_views[slot_a].surface, &b = *w.body_views[slot_b].surface;
  bool yes = false;
  const auto edges_through = [&](const Surface &from, uint32_t s, const Surface &to, uint32_t t) {
    for (int k = 0; k < 3 && !yes; ++k)
      yes = pierces(to, load3(&from.x[4 * size_t{from.tri[3 * size_t{s} + k]}]), load3(&from.x[4 * size_t{from.tri[3 * size_t{s} + (k + 1) % 3]}]), t);
  };
  w.broad.near_triangles_of(slot_a, slot_b, [&](uint32_t s, uint32_t t) {
    if (!yes) edges_through(a, s, b, t);
    if (!yes) edges_through(b, t, a, s);
  });
  g.through.push_back({slot_a, slot_b, yes});
  return yes;
}

// The safe share of the way; 1: nothing comes too near.
double find_hits(World &w) {
  Guard &g = w.guard;
  g.hits.clear();
  if (g.near.empty()) return 1;
  find_ends(w);
  const Array<Candidate> &list = w.broad.candidates();
  guard_pairs(w.body_views, g.ends, list, g.near, floor_of(w), margin_of(w), g.hits);
  std::erase_if(g.hits, [&](const GuardHit &hit) {
    const Candidate &c = list[hit.candidate];
    return cross_at_start(w, std::min(c.slot_a, c.slot_b), std::max(c.slot_a, c.slot_b));
  });
  guard_obstacles(w.body_views, g.ends, w.obstacle_views, g.poses, list, g.near, floor_of(w), margin_of(w), g.hits);
  double least = 1;
  for (const GuardHit &hit : g.hits) least = std::min(least, hit.safe);
  return least;
}

// A hit as a contact: features, places on them and normal as they are at the hit time. Returns the distance of the two places along that normal at the
// start, which is what a straight motion is added to.
class HitContact {
 public:
  HitContact(World &w, const GuardHit &hit) : w_(w), hit_(hit), c_(w.broad.candidates()[hit.candidate]) {}

  bool make(ContactPoint &out, double &along) {
    out = {};
    out.slot_a = c_.slot_a, out.slot_b = c_.slot_b, out.feature_a = c_.feature_a, out.feature_b = c_.feature_b;
    out.obstacle = c_.obstacle, out.distance = hit_.start;
    if (c_.obstacle) on_obstacle(out);
    else on_body(out);
    const double length = norm(now_);
    if (!(length > 0)) return false;
    const Vec3 n = (1 / length) * now_;
    store3(out.normal, n), store3(out.point, middle_);
    if (c_.obstacle) {
      const Vec3 belt = w_.obstacle_views[c_.slot_b].belt;
      store3(out.velocity, obstacle_way_ + belt - dot(belt, n) * n);
    }
    along = dot(n, start_);
    return true;
  }

 private:
  // Adds weight times a surfel to one side.
  void add(ContactPoint &out, uint32_t slot, uint32_t surfel, double weight) {
    const BodyView &b = w_.body_views[slot];
    const Vec3 x = load3(&b.surface->x[4 * size_t{surfel}]), end = load3(&w_.guard.end[slot][4 * size_t{surfel}]);
    narrow::add_node(out, b.first_node + surfel, weight);
    start_ += weight * x;
    const Vec3 at = x + hit_.t * (end - x);
    now_ += weight * at, (weight < 0 ? on_b_ : on_a_) += std::fabs(weight) * at;
  }
  void on_body(ContactPoint &out) {
    const Surface &a = *w_.body_views[c_.slot_a].surface, &b = *w_.body_views[c_.slot_b].surface;
    out.kind = c_.kind;
    if (c_.kind == kEdgeEdge) {
      out.type_a = 1;
      const uint32_t *const ea = &a.edge[2 * size_t{c_.feature_a}], *const eb = &b.edge[2 * size_t{c_.feature_b}];
      add(out, c_.slot_a, ea[0], 1 - hit_.at[0]), add(out, c_.slot_a, ea[1], hit_.at[0]);
      add(out, c_.slot_b, eb[0], hit_.at[1] - 1), add(out, c_.slot_b, eb[1], -hit_.at[1]);
    } else {
      add(out, c_.slot_a, c_.feature_a, 1);
      for (int k = 0; k < 3; ++k) add(out, c_.slot_b, b.tri[3 * size_t{c_.feature_b} + size_t(k)], -hit_.at[k]);
    }
    middle_ = 0.5 * (on_a_ + on_b_);
  }
  void on_obstacle(ContactPoint &out) {
    const Surface &a = *w_.body_views[c_.slot_a].surface;
    const ObstacleView &v = w_.obstacle_views[c_.slot_b];
    const GuardPose &end = w_.guard.poses[c_.slot_b];
    out.kind = kPrimitive, out.type_a = c_.kind;
    if (c_.kind == 0) add(out, c_.slot_a, c_.feature_a, 1);
    const uint32_t *const e = &a.edge[2 * size_t{c_.kind == 1 ? c_.feature_a : 0}];
    if (c_.kind == 1) add(out, c_.slot_a, e[0], 1 - hit_.at[0]), add(out, c_.slot_a, e[1], hit_.at[0]);
    if (c_.kind == 2)
      for (int k = 0; k < 3; ++k) add(out, c_.slot_a, a.tri[3 * size_t{c_.feature_a} + size_t(k)], hit_.at[k]);
    // The shape's point of the hit: nearest to the body's as the shape stands then.
    ObstacleView at = v;
    at.position = v.position + hit_.t * (end.position - v.position);
    at.rotation = norm2(v.spin) > 0 ? slerp(v.rotation, end.rotation, hit_.t) : v.rotation;
    const ObstaclePoint o = ObstacleShape(at).closest(on_a_);
    out.feature_b = c_.kind == 0 ? o.face : hit_.part;
    const Vec3 local = rotate_back(at.rotation, o.point - at.position);
    const Vec3 from = v.position + rotate(v.rotation, local), to = end.position + rotate(end.rotation, local);
    now_ = o.distance > 0 ? on_a_ - o.point : o.normal;
    start_ -= from;
    obstacle_way_ = (1 / w_.h) * (to - from);
    middle_ = 0.5 * (on_a_ + o.point);
  }

  World &w_;
  const GuardHit &hit_;
  const Candidate &c_;
  Vec3 start_, now_, on_a_, on_b_, middle_, obstacle_way_;   // differences of the sides (b from a); places; m/s
};

bool same_features(const ContactPoint &l, const ContactPoint &r) {
  return l.slot_a == r.slot_a && l.slot_b == r.slot_b && l.obstacle == r.obstacle && l.kind == r.kind && l.type_a == r.type_a &&
         l.feature_a == r.feature_a && l.feature_b == r.feature_b;
}

uint64_t free_key(const World &w, const ContactPoint &c) {
  const uint64_t id_a = w.bodies[c.slot_a]->id, id_b = c.obstacle ? w.obstacles[c.slot_b]->id : w.bodies[c.slot_b]->id;
  uint32_t patch = c.feature_b;
  if (!c.obstacle) {
    const Surface &b = w.bodies[c.slot_b]->surface;
    const uint32_t *const t = c.kind == kEdgeEdge ? &b.edge_tri[2 * size_t{c.feature_b}] : &c.feature_b;
    patch = b.patch[c.kind == kEdgeEdge && t[0] == kNone ? t[1] : t[0]];
  }
  for (uint32_t ordinal = 0;; ++ordinal) {
    const uint64_t key = narrow::contact_key(c, id_a, id_b, patch, ordinal);
    if (std::none_of(w.contacts.begin(), w.contacts.end(), [&](const ContactPoint &o) { return o.key == key; })) return key;
  }
}

// Of each feature's hits with one other side the earliest, and of those the earliest kMostHits: one impact trips all pairs around it, what the first
// ones leave is asked again, and a solve with thousands of nearly equal rows would not converge.
void choose_hits(World &w) {
  Array<GuardHit> &hits = w.guard.hits;
  const Array<Candidate> &list = w.broad.candidates();
  const auto side = [&](const GuardHit &h) {
    const Candidate &c = list[h.candidate];
    return std::array<uint32_t, 5>{c.slot_a, c.obstacle, c.slot_b, c.kind, c.feature_a};
  };
  const auto earlier = [](const GuardHit &l, const GuardHit &r) {
    return std::pair(l.t, std::pair(l.candidate, l.part)) < std::pair(r.t, std::pair(r.candidate, r.part));
  };
  std::sort(hits.begin(), hits.end(), [&](const GuardHit &l, const GuardHit &r) {
    const auto a = side(l), b = side(r);
    return a != b ? a < b : earlier(l, r);
  });
  hits.erase(std::unique(hits.begin(), hits.end(), [&](const GuardHit &l, const GuardHit &r) { return side(l) == side(r); }), hits.end());
  std::sort(hits.begin(), hits.end(), earlier);
  if (hits.size() > kMostHits) hits.resize(kMostHits);
}

// Hits join the contacts of the sub-step, in their order; one that has a contact already turns it to how it stands at the hit.
void add_hits(World &w) {
  Guard &g = w.guard;
  const auto kept = [&](uint64_t key) {
    return std::find_if(g.kept.begin(), g.kept.end(), [&](const Guard::Kept &k) { return k.key == key; });
  };
  Array<Guard::Kept> before;
  before.swap(g.kept);
  for (uint32_t i = 0; i < w.rows.n; ++i) {
    const double *const f = &w.rows.frame[size_t(i) * 9], *const l = &w.rows.impulse[size_t(i) * 3];
    g.kept.push_back({w.contacts[i].key, l[0] * load3(f) + l[1] * load3(f + 3) + l[2] * load3(f + 6), w.rows.rate[i], false});
  }
  for (const Guard::Kept &k : before)
    if (k.hit) kept(k.key)->hit = true;
  for (const GuardHit &hit : g.hits) {
    ContactPoint c;
    double along;
    if (!HitContact(w, hit).make(c, along)) continue;
    // One that starts nearer than d_c comes no nearer; what it lacks to 0.8 d_c closes in the time that the sub-step was planned with.
    const double target = hit.start < w.offset ? hit.start + std::max(0.0, 0.8 * w.offset - hit.start) * (w.h / g.planned) : w.offset;
    const double rate = (along - target) / w.h;
    const auto same = std::find_if(w.contacts.begin(), w.contacts.end(), [&](const ContactPoint &o) { return same_features(o, c); });
    if (same != w.contacts.end()) {
      c.key = same->key, c.area = same->area, c.lender = same->lender;
      *same = c;
      const auto k = kept(c.key);
      k->rate = rate, k->hit = true;
    } else {
      c.key = free_key(w, c);
      w.contacts.push_back(c);
      g.kept.push_back({c.key, {}, rate, true});
    }
  }
  std::sort(g.kept.begin(), g.kept.end(), [](const auto &l, const auto &r) { return l.key < r.key; });
  const auto id_b = [&](const ContactPoint &c) { return c.obstacle ? w.obstacles[c.slot_b]->id : w.bodies[c.slot_b]->id; };
  std::sort(w.contacts.begin(), w.contacts.end(), [&](const ContactPoint &l, const ContactPoint &r) {
    if (l.slot_a != r.slot_a) return w.bodies[l.slot_a]->id < w.bodies[r.slot_a]->id;
    if (l.obstacle != r.obstacle) return l.obstacle < r.obstacle;
    if (l.slot_b != r.slot_b) return id_b(l) < id_b(r);
    if (l.kind != r.kind) return l.kind < r.kind;
    if (l.type_a != r.type_a) return l.type_a < r.type_a;
    if (l.feature_a != r.feature_a) return l.feature_a < r.feature_a;
    return l.feature_b != r.feature_b ? l.feature_b < r.feature_b : l.key < r.key;
  });
}

void make_room(World &w) {
  Guard &g = w.guard;
  g.end.resize(w.bodies.size()), g.stamp.resize(w.bodies.size()), g.ends.resize(w.bodies.size());
  for (size_t i = 0; i < w.bodies.size(); ++i) {
    const size_t n = w.bodies[i]->surface.nsurfel;
    if (g.stamp[i].size() != n) g.stamp[i].assign(n, 0), g.end[i].assign(4 * n, 0.0);
    g.ends[i] = g.end[i].data();
  }
}

}  // namespace

void guard_adjust(World &w) {
  for (uint32_t i = 0; i < w.rows.n; ++i) {
    const auto k = std::lower_bound(w.guard.kept.begin(), w.guard.kept.end(), w.contacts[i].key, [](const auto &e, uint64_t key) { return e.key < key; });
    if (k == w.guard.kept.end() || k->key != w.contacts[i].key) continue;
    const double *const f = &w.rows.frame[size_t(i) * 9];
    double *const l = &w.rows.impulse[size_t(i) * 3];
    l[0] = std::max(0.0, dot(load3(f), k->impulse)), l[1] = dot(load3(f + 3), k->impulse), l[2] = dot(load3(f + 6), k->impulse);
    if (k->hit) w.rows.rate[i] = k->rate;
  }
}

// False: trouble, or guard.cut is below 1 and the sub-step is to be taken anew.
bool World::stage_guard(uint32_t *trouble) {
  guard.cut = guard.motion = 1;
  guard.stepped = false;
  guard.kept.clear(), guard.through.clear();
  make_room(*this);
  const bool steppers = std::any_of(bodies.begin(), bodies.end(), [](auto &b) { return b->model.stepper != nullptr; });
  double safe = 1;
  for (uint32_t solve = 0;; ++solve) {
    if (steppers && !commit_steppers(trouble)) return false;
    bound_motion(*this);
    broad.cover(body_views, obstacle_views, filter, h, offset, guard.speed);
    if (guard.lists != broad.stats().renewals || guard.way.size() != bodies.size()) guard.forget();
    if (guard.rest.empty()) guard.way.assign(bodies.size(), 0.0), guard.lists = broad.stats().renewals;
    guard_near(body_views, guard.travel, guard.way, obstacle_views, h, broad.candidates(), floor_of(*this), guard.rest, guard.near);
    safe = find_hits(*this);
    guard.stepped = steppers;
    if (guard.hits.empty()) return true;
    guard.acted = true;
    if (solve == kSolves) break;
    choose_hits(*this);
    add_hits(*this);
    if (residual.share > 1) --stats.unconverged;   // counted once, by the last solve
    guard.resolving = true;
    const bool solved = stage_solve(trouble);
    guard.resolving = false;
    if (!solved) return false;
    ++stats.guard_solves;
    stage_distribute();
  }
  if (guard.pieces < kCuts) {
    ++guard.pieces, ++stats.guard_cuts;
    guard.cut = std::max(safe, kLeastCut);
    return false;
  }
  for (uint32_t k = 0; !guard.hits.empty(); ++k) {
    guard.motion = k < kShares ? guard.motion * std::min(safe, 0.999) : 0;
    if (guard.motion == 0) break;
    safe = find_hits(*this);
  }
  stats.guard_lost += (1 - guard.motion) * h;
  return true;
}

}  // namespace dfm
