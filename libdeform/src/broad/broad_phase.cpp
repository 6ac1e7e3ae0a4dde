#include "broad/broad_phase.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "geometry/bulge.h"
#include "geometry/closest.h"
#include "geometry/obstacle_shape.h"
#include "geometry/tree_walk.h"

namespace dfm {
namespace {

constexpr double kRounding = 1 + 1e-9;  // margins hold despite rounded distances
constexpr double kSkinLeast = 0.02;     // of the median edge: a resting body keeps its lists
constexpr double kSkinMost = 0.25;      // beyond, lists grow faster than they last
// Beside a surface that is this many times finer, its edges count: its own skin is used up so soon that the
// pair is listed again in nearly every sub-step, each time with all that lies in the skin of the coarse one.
constexpr double kMuchFiner = 4;
constexpr double kWide = 2;  // times the margin that was needed since: the list is made again
// factor by which speeds may increase before the margin of the reach is used up
constexpr double kSpeedGrowth = 1.25;

double obstacle_speed(const ObstacleView &o, double extent) {
  return norm(o.velocity) + norm(o.spin) * extent;
}

// Bound of the motion of a shape between two poses: |q - q0| of unit quaternions is at most half the chord
// that a point at distance 1 moves.
double obstacle_displacement(const ObstacleView &now, const ObstacleView &then, double extent) {
  const Quat p = now.rotation, q = then.rotation;
  const double s = p.x * q.x + p.y * q.y + p.z * q.z + p.w * q.w < 0 ? -1 : 1;
  const double dx = p.x - s * q.x, dy = p.y - s * q.y, dz = p.z - s * q.z, dw = p.w - s * q.w;
  return norm(now.position - then.position) + 2 * extent * std::sqrt(dx * dx + dy * dy + dz * dz + dw * dw);
}

// Compares shape and size: a new obstacle under an old id needs new lists.
bool same_shape(const ObstacleView &a, const ObstacleView &b) {
  return a.shape == b.shape && a.surface == b.surface && a.grid == b.grid && a.slot == b.slot &&
         a.category == b.category && a.collides_with == b.collides_with && a.radius == b.radius &&
         a.half_length == b.half_length && a.half_size.x == b.half_size.x && a.half_size.y == b.half_size.y &&
         a.half_size.z == b.half_size.z;
}

uint64_t features(uint32_t a, uint32_t b) { return uint64_t{a} << 32 | b; }

struct Features {  // corners of a surface as listed
  const Surface &surface;
  const double *x;
  Vec3 point(uint32_t s) const { return load3(x + 4 * size_t{s}); }
  Vec3 corner(uint32_t t, int k) const { return point(surface.tri[3 * size_t{t} + k]); }
  Vec3 edge(uint32_t e, int k) const { return point(surface.edge[2 * size_t{e} + k]); }
};

// m, the farthest that a patch as listed lies off its triangle
double largest_bulge(const Features &f) {
  double most = 0;
  for (uint32_t t = 0; t < f.surface.bulge_from.size(); ++t) {
    if (f.surface.bulge_from[t] == kNone) continue;
    const Patch patch(f.surface, t);
    for (int k = 0; k < 3; ++k)
      most = std::max(most, norm2(patch.off(k, [&](uint32_t s) { return f.point(s); })));
  }
  return 4.0 / 3 * std::sqrt(most);
}

constexpr size_t kLook = 1000;  // surfels that are worth a job

// m, the largest distance of triangles that are listed
template <class Side>
double reach_of(const Side &a, const Side &b) {
  return kRounding * (a.margin + b.margin) + std::max(recovery_depth(*a.surface), recovery_depth(*b.surface));
}

bool finite_positions(const Surface &s) {
  double sum = 0;
  for (const double x : s.x) sum += x - x;
  return sum == 0;
}

}  // namespace

BroadPhase::BroadPhase(const Memory &memory) : memory_(memory) {
  use_memory(memory_, bodies_, things_, segments_, next_segments_, candidates_, next_, fresh_, order_, pairs_,
             parts_, lists_, stack_);
  found_.emplace_back(memory_);
}

BroadPhase::Found::Found(const Memory &m) { use_memory(m, vf, fv, ee, stack); }

void BroadPhase::Found::clear() {
  vf.clear();
  fv.clear();
  ee.clear();
}

void BroadPhase::clear() {
  bodies_.clear();
  things_.clear();
  segments_.clear();
  candidates_.clear();
}

bool BroadPhase::update(std::span<const BodyView> bodies, std::span<const ObstacleView> obstacles,
                        const PairFilter &filter, double h, double offset, Tasks *tasks) {
  const Now now{bodies, obstacles, filter, h, offset, tasks};
  match(now);
  if (!find_dirty(now)) return false;
  renew(now);
  return true;
}

bool BroadPhase::cover(std::span<const BodyView> bodies, std::span<const ObstacleView> obstacles,
                       const PairFilter &filter, double h, double offset, std::span<const double> speed,
                       Tasks *tasks) {
  const Now now{bodies, obstacles, filter, h, offset, tasks};
  bool any = false;
  for (size_t i = 0; i < bodies_.size(); ++i) {
    Body &b = bodies_[i];
    b.needed = std::max(b.needed, kRounding * (2 * offset + kSpeedGrowth * h * speed[i]));
    if (!b.usable || kRounding * (b.moved + offset + h * speed[i]) <= b.margin) continue;
    b.dirty = any = true;
    b.expected = speed[i];
  }
  for (size_t o = 0; o < things_.size(); ++o)
    if (!holds(things_[o], obstacles[o], now, 1)) things_[o].dirty = any = true;
  if (any) renew(now);
  return any;
}

void BroadPhase::renew(const Now &now) {
  ++stats_.renewals;
  each_on(now.tasks, bodies_.size(), 1, [&](size_t i) {
    if (bodies_[i].dirty) renew_body(bodies_[i], now);
  });
  bound_bodies();
  for (size_t o = 0; o < things_.size(); ++o) {
    Thing &t = things_[o];
    // The displacement of a plane is measured over the sphere around the bodies, which has just changed.
    if (!t.dirty && t.view.shape == Shape::plane) t.dirty = !holds(t, now.obstacles[o], now);
    if (t.dirty) renew_thing(t, now.obstacles[o], now);
  }
  find_pairs(now);
  assemble();
  const auto count = [this](Side &side) {
    stats_.refits += std::exchange(side.refits, 0);
    stats_.rebuilds += std::exchange(side.rebuilds, 0);
  };
  for (Body &b : bodies_) {
    b.dirty = !b.usable;
    count(b);
  }
  for (Thing &t : things_) {
    t.dirty = false;
    count(t);
  }
}

// Matches bodies_ and things_ to the views; new, removed or changed things lose their lists.
void BroadPhase::match(const Now &now) {
  bool same = now.bodies.size() == bodies_.size() && now.obstacles.size() == things_.size() &&
              now.filter.version == filter_version_;
  for (size_t i = 0; same && i < now.bodies.size(); ++i) {
    const Body &b = bodies_[i];
    same = b.id == now.bodies[i].id && b.surface == now.bodies[i].surface && b.slot == now.bodies[i].slot &&
           b.category == now.bodies[i].category && b.collides_with == now.bodies[i].collides_with &&
           b.x.size() == now.bodies[i].surface->x.size();
  }
  for (size_t o = 0; same && o < now.obstacles.size(); ++o)
    same = things_[o].view.id == now.obstacles[o].id && same_shape(things_[o].view, now.obstacles[o]);
  if (same) return;
  clear();
  filter_version_ = now.filter.version;
  bodies_.reserve(now.bodies.size());
  for (const BodyView &v : now.bodies) {
    Body &b = bodies_.emplace_back(memory_);
    b.id = v.id;
    b.surface = v.surface;
    b.slot = v.slot;
    b.category = v.category;
    b.collides_with = v.collides_with;
    b.x.resize(v.surface->x.size());
  }
  things_.reserve(now.obstacles.size());
  for (const ObstacleView &v : now.obstacles) {
    Thing &t = things_.emplace_back(memory_);
    t.view = v;
    if (v.shape != Shape::mesh) continue;
    t.surface = v.surface;
    t.x.resize(v.surface->x.size());
  }
}

// A list for a faster motion holds more than the present one needs, for ever where a body comes to rest.
// needed: m, the margin that a list would have now.
bool BroadPhase::too_wide(Side &side, double needed) const {
  side.needed = std::max(side.needed, needed);
  if (++side.age <= skin_steps_) return false;
  side.age = 0;
  return kWide * std::exchange(side.needed, 0) < side.margin;
}

void BroadPhase::look(Body &b, bool asleep, const Now &now) {
  const bool stays = b.asleep && asleep;
  b.asleep = asleep;
  b.expected = 0;
  if (b.dirty || stays) return;
  b.moved = largest_norm(b.surface->nsurfel, b.surface->x.data(), b.x.data());
  b.speed = largest_speed(*b.surface);
  b.dirty = too_wide(b, reach(b, now) + std::min(skin(b, now), b.skin_most)) || b.skin > b.skin_most ||
            !(kRounding * (b.moved + reach_share(now.h, now.offset, b.speed)) <= b.margin);
}

bool BroadPhase::find_dirty(const Now &now) {
  bool any = false;
  size_t surfels = 0;
  for (const BodyView &b : now.bodies) surfels += b.surface->nsurfel;
  // body by body, as in the other stages: the thread that has moved a body has it in the cache of its core
  each_on(now.tasks, bodies_.size(), surfels < kLook ? bodies_.size() : 1,
          [&](size_t i) { look(bodies_[i], now.bodies[i].asleep, now); });
  for (const Body &b : bodies_) any |= b.dirty;
  for (size_t o = 0; o < things_.size(); ++o) {
    Thing &t = things_[o];
    double speed;
    const double needed = reach(now.obstacles[o], now, speed);
    const double alone = skin_steps_ * now.h * speed;
    t.dirty = too_wide(t, needed + std::min(alone, t.skin_most)) || t.dirty || t.skin > t.skin_most ||
              !holds(t, now.obstacles[o], now);
    any |= things_[o].dirty;
  }
  return any;
}

// times: how many times the obstacle's displacement of the sub-step is covered.
bool BroadPhase::holds(const Thing &thing, const ObstacleView &view, const Now &now, double times) const {
  const ObstacleView &then = thing.view;
  double moved, extent;
  if (view.shape == Shape::plane) {
    // Only the motion along the normal counts, over the sphere that holds all bodies.
    const Vec3 n = ObstacleShape(view).axis(2), n0 = ObstacleShape(then).axis(2);
    moved = norm(n - n0) * radius_ +
            std::fabs(dot(n, center_ - view.position) - dot(n0, center_ - then.position));
    extent = norm(center_ - view.position) + radius_;
  } else {
    extent = ObstacleShape(view).extent();
    moved = obstacle_displacement(view, then, extent);
  }
  return kRounding * (moved + now.offset + times * now.h * obstacle_speed(view, extent)) <= thing.margin;
}

// Updates the copy and tree of a side; returns false if its surface is not finite.
bool BroadPhase::renew_tree(Side &side) {
  const Surface &s = *side.surface;
  side.usable = s.ntri > 0 && finite_positions(s);
  if (!side.usable) return false;
  std::copy(s.x.begin(), s.x.end(), side.x.begin());
  side.refits += !side.tree.empty();
  if (side.tree.empty() && s.tree) side.tree.take(*s.tree);
  side.rebuilds += side.tree.renew(s.tri, side.x.data());
  return true;
}

// m, what contacts need of the margin of a list made now. speed: m/s, out, of the fastest of its points.
double BroadPhase::reach(const ObstacleView &view, const Now &now, double &speed) const {
  const double extent =
      view.shape == Shape::plane ? norm(center_ - view.position) + radius_ : ObstacleShape(view).extent();
  speed = obstacle_speed(view, extent);
  return kRounding * reach_share(now.h, now.offset, kSpeedGrowth * speed) + now.offset;
}

void BroadPhase::renew_thing(Thing &t, const ObstacleView &view, const Now &now) {
  t.view = view;
  if (t.surface) renew_tree(t);
  const double needed = reach(view, now, t.speed), alone = skin_steps_ * now.h * t.speed;
  t.skin = std::min(alone, t.skin_most);
  t.margin = needed + kRounding * t.skin;
  t.margin_most = needed + kRounding * alone;
  t.age = 0;
  t.needed = 0;
}

// m, of the margin of a list made now: what contacts need, and beside it the skin, which lasts for
// skin_steps_ of the present motion.
double BroadPhase::reach(const Body &body, const Now &now) const {
  return kRounding * std::max(reach_share(now.h, now.offset, kSpeedGrowth * body.speed),
                              2 * now.offset + kSpeedGrowth * now.h * body.expected);
}
double BroadPhase::skin(const Body &body, const Now &now) const {
  const double edge = body.surface->median_edge;
  return std::clamp(skin_steps_ * now.h * body.speed, kSkinLeast * edge, kSkinMost * edge);
}

void BroadPhase::renew_body(Body &body, const Now &now) {
  if (!renew_tree(body)) return;
  body.speed = largest_speed(*body.surface);
  const double needed = reach(body, now), alone = skin(body, now);
  body.skin = std::min(alone, body.skin_most);
  body.margin = needed + body.skin;
  body.margin_most = needed + alone;
  body.moved = 0;
  body.age = 0;
  body.needed = 0;
}

// Two surfaces whose lists may meet with the skins that they would have alone: a skin that has become thin
// does not grow again beside the same partner.
void BroadPhase::limit_skins(Side &a, Side &b) {
  const bool first = a.surface->median_edge > b.surface->median_edge;
  Side &coarse = first ? a : b;
  const Side &fine = first ? b : a;
  const double edge = coarse.surface->median_edge;
  if (!(edge > kMuchFiner * fine.surface->median_edge)) return;
  const double wide = a.margin_most + b.margin_most + recovery_depth(*coarse.surface);
  if (!(box_distance2(a.tree.root(), b.tree.root()) <= wide * wide)) return;
  // it need not last longer than that of the fine one
  const double share = fine.speed > 0 ? std::max(1.0, coarse.speed / fine.speed) : HUGE_VAL;
  coarse.skin_most =
      std::min(coarse.skin_most, std::max(share * kSkinMost * fine.surface->median_edge, kSkinLeast * edge));
}

void BroadPhase::bound_bodies() {
  bool first = true;
  Vec3 lo, hi;
  for (const Body &b : bodies_) {
    if (!b.usable) continue;
    for (int k = 0; k < 3; ++k) {
      const double l = b.tree.root().lo[k] - b.margin, u = b.tree.root().hi[k] + b.margin;
      lo[k] = first ? l : std::min(lo[k], l);
      hi[k] = first ? u : std::max(hi[k], u);
    }
    first = false;
  }
  center_ = 0.5 * (lo + hi);
  radius_ = 0.5 * norm(hi - lo);
}

// Pairs without a changed side keep their runs; the others are listed again. Bodies are swept along x.
void BroadPhase::find_pairs(const Now &now) {
  fresh_.clear();
  pairs_.clear();
  next_segments_.clear();
  for (const Segment &s : segments_)
    if (!bodies_[s.a].dirty && !(s.obstacle ? things_[s.b].dirty : bodies_[s.b].dirty))
      next_segments_.push_back(s);
  order_.clear();
  for (uint32_t i = 0; i < bodies_.size(); ++i) {
    if (!bodies_[i].usable) continue;
    order_.push_back(i);
    if (bodies_[i].dirty) bodies_[i].skin_most = kSkinMost * bodies_[i].surface->median_edge;
  }
  for (Thing &t : things_)
    if (t.dirty) t.skin_most = HUGE_VAL;
  const auto low = [&](uint32_t i) {
    return bodies_[i].tree.root().lo[0] - bodies_[i].margin_most - recovery_depth(*bodies_[i].surface);
  };
  std::sort(order_.begin(), order_.end(),
            [&](uint32_t i, uint32_t j) { return low(i) != low(j) ? low(i) < low(j) : i < j; });
  for (size_t p = 0; p < order_.size(); ++p) {
    Body &a = bodies_[order_[p]];
    const double high = a.tree.root().hi[0] + a.margin_most + recovery_depth(*a.surface);
    for (size_t q = p + 1; q < order_.size() && low(order_[q]) <= high; ++q)
      if ((a.dirty || bodies_[order_[q]].dirty) &&
          now.filter.may_touch(now.bodies[order_[p]], now.bodies[order_[q]])) {
        limit_skins(a, bodies_[order_[q]]);
        const bool ordered = a.id < bodies_[order_[q]].id;
        pairs_.push_back({order_[ordered ? p : q], order_[ordered ? q : p], false});
      }
    for (uint32_t o = 0; o < things_.size(); ++o)
      if ((a.dirty || things_[o].dirty) && now.filter.may_touch(now.bodies[order_[p]], now.obstacles[o])) {
        if (things_[o].usable) limit_skins(a, things_[o]);
        pairs_.push_back({order_[p], o, true});
      }
  }
  list_pairs(now.tasks);
}

void BroadPhase::list_pairs(Tasks *tasks) {
  lists_.clear();
  if (!tasks || !tasks->parallel()) {
    for (const Pair &pair : pairs_) {
      list(pair, {0, 0}, found_[0]);
      add_segments(pair, {&found_[0], 1});
      for (const List &l : lists_) put_together(l);
      lists_.clear();
    }
    return;
  }
  parts_.clear();
  for (uint32_t i = 0; i < pairs_.size(); ++i) cut(i);
  while (found_.size() < parts_.size()) found_.emplace_back(memory_);
  each_on(tasks, parts_.size(), 1,
          [&](size_t i) { list(pairs_[parts_[i].pair], parts_[i].nodes, found_[i]); });
  for (size_t i = 0, end = 0; i < parts_.size(); i = end) {
    while (end < parts_.size() && parts_[end].pair == parts_[i].pair) ++end;
    add_segments(pairs_[parts_[i].pair], {&found_[i], end - i});
  }
  each_on(tasks, lists_.size(), 1, [&](size_t i) { put_together(lists_[i]); });
}

// Surfaces alone are large enough. Most of the work is where they are nearest, so both trees are divided.
void BroadPhase::cut(uint32_t pair) {
  constexpr size_t kParts = 16, kSmall = 32;  // nodes of both trees
  const Pair &p = pairs_[pair];
  const bool surfaces = !p.obstacle || (things_[p.b].view.shape == Shape::mesh && things_[p.b].usable);
  if (surfaces) {
    const Side &a = bodies_[p.a];
    const Side &b = p.obstacle ? static_cast<const Side &>(things_[p.b]) : bodies_[p.b];
    if (a.tree.nodes().size() + b.tree.nodes().size() > kSmall) {
      near_nodes(a.tree, b.tree, reach_of(a, b), kParts, stack_);
      for (const PairOfTriangles nodes : stack_) parts_.push_back({pair, nodes});
    }
  }
  if (parts_.empty() || parts_.back().pair != pair) parts_.push_back({pair, {0, 0}});
}

void BroadPhase::list(const Pair &pair, PairOfTriangles nodes, Found &found) const {
  found.clear();
  const Body &a = bodies_[pair.a];
  if (!pair.obstacle) {
    found.near = list_surfaces(a, bodies_[pair.b], nodes, found);
  } else {
    const Thing &thing = things_[pair.b];
    switch (thing.view.shape) {
      case Shape::mesh: found.near = thing.usable && list_surfaces(a, thing, nodes, found); break;
      case Shape::voxels: found.near = list_voxels(a, thing, found); break;
      default: found.near = list_obstacle(a, thing, found);
    }
  }
}

// False where the two are too far apart for any.
bool BroadPhase::list_surfaces(const Side &a, const Side &b, PairOfTriangles nodes, Found &found) const {
  const Features fa{*a.surface, a.x.data()}, fb{*b.surface, b.x.data()};
  const double near = kRounding * (a.margin + b.margin), wide = reach_of(a, b);
  const double edges = near + edge_recovery_depth(*a.surface, *b.surface);
  const double edges2 = edges * edges;
  const double deep_a = near + recovery_depth(*a.surface);
  const double deep_b = near + recovery_depth(*b.surface);
  if (!(box_distance2(a.tree.root(), b.tree.root()) <= wide * wide)) return false;
  // Surfels of one side against a triangle of the other: those that the triangle owns, so that no
  // pair comes twice.
  const auto vertices = [](const Features &from, uint32_t t, const Features &to, uint32_t face, double limit,
                           Array<uint64_t> &list) {
    const uint32_t owns = from.surface.tri_owns[t] & 7;
    for (int k = 0; owns >> k; ++k)
      if (owns >> k & 1 && triangle_within(from.corner(t, k), to.corner(face, 0), to.corner(face, 1),
                                           to.corner(face, 2), limit))
        list.push_back(features(from.surface.tri[3 * size_t{t} + k], face));
  };
  const auto look_at = [&](uint32_t place_a, uint32_t place_b, double distance2) {
    const uint32_t s = a.tree.triangles()[place_a], t = b.tree.triangles()[place_b];
    vertices(fa, s, fb, t, deep_b, found.vf);
    vertices(fb, t, fa, s, deep_a, found.fv);
    const uint32_t own_s = fa.surface.tri_owns[s] >> 3, own_t = fb.surface.tri_owns[t] >> 3;
    if (!own_s || !own_t || !(distance2 <= edges2)) return;
    for (int k = 0; own_s >> k; ++k)
      for (int l = 0; own_t >> l; ++l)
        if (own_s >> k & own_t >> l & 1 && segments_within(fa.corner(s, k), fa.corner(s, (k + 1) % 3),
                                                           fb.corner(t, l), fb.corner(t, (l + 1) % 3), edges))
          found.ee.push_back(
              features(fa.surface.tri_edge[3 * size_t{s} + k], fb.surface.tri_edge[3 * size_t{t} + l]));
  };
  near_pairs(a.tree, b.tree, wide, found.stack, look_at, nodes);
  return true;
}

bool BroadPhase::list_voxels(const Body &a, const Thing &thing, Found &found) const {
  const ObstacleShape shape(thing.view);
  const Features fa{*a.surface, a.x.data()};
  const double near = kRounding * (a.margin + thing.margin);
  Box bounds{{0, 0, 0, 0}, {0, 0, 0, 0}};
  shape.bounds(bounds.lo, bounds.hi);
  near_triangles(
      a.tree, [&](const Box &b) { return box_distance2(b, bounds) <= near * near; },
      [&](uint32_t t) {
        const Vec3 x[3] = {fa.corner(t, 0), fa.corner(t, 1), fa.corner(t, 2)};
        const Vec3 center = (1.0 / 3) * (x[0] + x[1] + x[2]);
        double size2 = 0;
        for (int k = 0; k < 3; ++k) {
          if (fa.surface.tri_owns[t] >> k & 1 && shape.voxels_near(x[k], near))
            found.vf.push_back(uint64_t{fa.surface.tri[3 * size_t{t} + k]} << 32);
          size2 = std::max(size2, norm2(x[k] - center));
        }
        if (shape.voxels_near(center, near + std::sqrt(size2))) found.fv.push_back(uint64_t{t} << 32);
      });
  return true;
}

// Edges and triangles are listed only where surfels alone would let the obstacle through: edges at a round
// shape or at the edges of a box, triangles at a round shape or at the corners of a box; and where the
// surface bulges.
bool BroadPhase::list_obstacle(const Body &a, const Thing &thing, Found &found) const {
  const ObstacleShape shape(thing.view);
  const Features fa{*a.surface, a.x.data()};
  const Shape kind = shape.view().shape;
  const bool bulges = !a.surface->bulge.empty();
  const double near = kRounding * (a.margin + thing.margin + recovery_depth(*a.surface));
  const double near_bulges = kRounding * (a.surface->bulge_sum * a.margin + thing.margin);
  const double widest = bulges ? std::max(near, near_bulges + largest_bulge(fa)) : near;
  const double limit = near + shape.view().radius, limit2 = limit * limit;
  Box bounds{{0, 0, 0, 0}, {0, 0, 0, 0}};
  if (kind != Shape::plane) shape.bounds(bounds.lo, bounds.hi);
  const Vec3 n = shape.axis(2);
  const auto box_near = [&](const Box &b) {
    if (kind != Shape::plane) return box_distance2(b, bounds) <= widest * widest;
    double lowest = -dot(n, shape.view().position);
    for (int k = 0; k < 3; ++k) lowest += n[k] * (n[k] > 0 ? b.lo[k] : b.hi[k]);
    return lowest <= widest;
  };
  const auto edge_near = [&](Vec3 p, Vec3 q) {
    if (kind != Shape::box) return closest_segments(p, q, shape.end(0), shape.end(1)).distance2 <= limit2;
    for (uint32_t e = 0; e < 12; ++e) {
      Vec3 from, to;
      uint32_t faces[2];
      shape.edge(e, from, to, faces);
      if (closest_segments(p, q, from, to).distance2 <= limit2) return true;
    }
    return false;
  };
  const auto triangle_near = [&](uint32_t t) {
    for (uint32_t c = 0; c < shape.points(); ++c)
      if (closest_on_triangle(shape.point(c), fa.corner(t, 0), fa.corner(t, 1), fa.corner(t, 2)).distance2 <=
          limit2)
        return true;
    return false;
  };
  // The obstacle, which is convex, lies behind the plane through what is nearest to the middle of the patch.
  const auto bulge_near = [&](uint32_t t) {
    if (!bulges || t == kNone || fa.surface.bulge_from[t] == kNone) return false;
    const ObstaclePoint o = shape.closest((1.0 / 3) * (fa.corner(t, 0) + fa.corner(t, 1) + fa.corner(t, 2)));
    const PatchHeights heights(Patch(fa.surface, t), o.normal, [&](uint32_t s) { return fa.point(s); });
    return heights.least() - dot(o.normal, o.point) <= near_bulges;
  };
  near_triangles(a.tree, box_near, [&](uint32_t t) {
    const uint32_t owns = fa.surface.tri_owns[t];
    for (int k = 0; k < 3; ++k) {
      if (owns >> k & 1 && shape.closest(fa.corner(t, k)).distance <= near)
        found.vf.push_back(fa.surface.tri[3 * size_t{t} + k]);
      if (!(owns >> (3 + k) & 1)) continue;
      const uint32_t edge = fa.surface.tri_edge[3 * size_t{t} + k];
      const uint32_t *const sides = &fa.surface.edge_tri[2 * size_t{edge}];
      if ((kind != Shape::plane && edge_near(fa.corner(t, k), fa.corner(t, (k + 1) % 3))) ||
          bulge_near(sides[0]) || bulge_near(sides[1]))
        found.ee.push_back(edge);
    }
    if (triangle_near(t) || bulge_near(t)) found.fv.push_back(t);
  });
  for (Array<uint64_t> *list : {&found.vf, &found.ee, &found.fv})
    for (uint64_t &f : *list) f <<= 32;
  return true;
}

void BroadPhase::add_segments(const Pair &pair, std::span<const Found> parts) {
  if (!parts.front().near) return;
  const auto [a, b, obstacle] = pair;
  const Shape shape = obstacle ? things_[b].view.shape : Shape::none;
  add_segment(a, b, obstacle, 0, parts, &Found::vf);
  if (shape == Shape::plane && bodies_[a].surface->bulge.empty()) return;
  if (shape != Shape::voxels) add_segment(a, b, obstacle, 1, parts, &Found::ee);
  if (obstacle) add_segment(a, b, true, 2, parts, &Found::fv);
  else add_segment(b, a, false, 0, parts, &Found::fv);
}

void BroadPhase::add_segment(uint32_t a, uint32_t b, bool obstacle, uint8_t kind,
                             std::span<const Found> parts, Array<uint64_t> Found::*list) {
  const uint64_t id_b = obstacle ? things_[b].view.id : bodies_[b].id;
  const size_t begin = fresh_.size();
  size_t count = 0;
  for (const Found &found : parts) count += (found.*list).size();
  fresh_.resize(begin + count);
  if (count) lists_.push_back({parts, list, begin});
  next_segments_.push_back(
      {bodies_[a].id, id_b, a, b, uint32_t(begin), uint32_t(count), obstacle, kind, true});
}

void BroadPhase::put_together(const List &l) {
  uint64_t *const begin = &fresh_[l.begin], *end = begin;
  for (const Found &found : l.parts) end = std::copy((found.*l.list).begin(), (found.*l.list).end(), end);
  std::sort(begin, end);
}

// Runs in the order of contacts, from the old lists and the fresh ones.
void BroadPhase::assemble() {
  std::sort(next_segments_.begin(), next_segments_.end(), [](const Segment &l, const Segment &r) {
    if (l.id_a != r.id_a) return l.id_a < r.id_a;
    if (l.obstacle != r.obstacle) return l.obstacle < r.obstacle;
    return l.id_b != r.id_b ? l.id_b < r.id_b : l.kind < r.kind;
  });
  next_.clear();
  for (Segment &s : next_segments_) {
    const uint32_t begin = uint32_t(next_.size());
    const uint32_t slot_a = bodies_[s.a].slot;
    const uint32_t slot_b = s.obstacle ? things_[s.b].view.slot : bodies_[s.b].slot;
    if (s.fresh) {
      for (uint32_t i = s.begin; i < s.begin + s.count; ++i)
        next_.push_back({slot_a, slot_b, uint32_t(fresh_[i] >> 32), uint32_t(fresh_[i]), s.kind, s.obstacle});
    } else {
      next_.insert(next_.end(), candidates_.begin() + s.begin, candidates_.begin() + s.begin + s.count);
    }
    s.begin = begin;
    s.fresh = false;
  }
  candidates_.swap(next_);
  segments_.swap(next_segments_);
}

}  // namespace dfm
