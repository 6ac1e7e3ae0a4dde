#include "step/overlap/overlap_sides.h"

#include "core/lists.h"
#include "step/context.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "body/obstacle_mesh.h"
#include "geometry/convex_gap.h"
#include "geometry/pierce.h"
#include "geometry/triangle_search.h"
#include "geometry/voxel_grid.h"

namespace dfm {
namespace {

// surfels that are tested first: without crossings, a piece is completely inside or outside
constexpr uint32_t kProbes = 64;
constexpr uint32_t kInner = 256;    // places inside a body that are tested if surfaces coincide
constexpr uint32_t kDepths = 2048;  // enclosed surfels whose depth is measured

uint32_t stride_of(size_t n, uint32_t most) { return static_cast<uint32_t>(n / most + 1); }

double cross_triangles(const OverlapSkin &a, uint32_t s, const OverlapSkin &b, uint32_t t) {
  const Vec3 p[3] = {a.corner(s, 0), a.corner(s, 1), a.corner(s, 2)};
  const Vec3 x[3] = {b.corner(t, 0), b.corner(t, 1), b.corner(t, 2)};
  return std::max(edges_pierce(p, x), edges_pierce(x, p));
}

bool in_box(Vec3 p, const OverlapSkin &s) {
  for (int k = 0; k < 3; ++k)
    if (!(p[k] >= s.lo()[k] && p[k] <= s.hi()[k])) return false;
  return true;
}

bool may_hold(const OverlapSkin &b, Vec3 p) { return b.room() || in_box(p, b); }

// The part of a inside b.
void count_enclosed(const OverlapSkin &a, OverlapSkin &b, double least, Crossed &out) {
  bool any = out.crossings > 0;
  for (uint32_t s = 0, n = stride_of(a.nsurfel(), kProbes); s < a.nsurfel() && !any; s += n)
    any = may_hold(b, a.x(s)) && b.inside(a.x(s));
  if (!any) return;
  std::vector<Vec3> in;
  for (uint32_t s = 0; s < a.nsurfel(); ++s)
    if (may_hold(b, a.x(s)) && b.inside(a.x(s))) in.push_back(a.x(s));
  uint32_t deeper = 0;
  for (size_t i = 0, n = stride_of(in.size(), kDepths); i < in.size(); i += n) {
    const double depth = b.distance(in[i]);
    out.depth = std::max(out.depth, depth);
    deeper += depth > least;
  }
  if (deeper) {
    out.through = true;
    out.enclosed += static_cast<uint32_t>(in.size());
    out.mostly = out.mostly || 2 * in.size() > a.nsurfel();
  }
}

// Coincident surfaces neither cross nor contain surfels of each other; places inside the bodies decide.
void probe_inner(OverlapSkin &a, OverlapSkin &b, double least, Crossed &out) {
  for (const Vec3 p : a.inner()) {
    if (!may_hold(b, p) || !b.inside(p) || !a.covers(p)) continue;
    const double depth = b.distance(p);
    if (depth > least) {
      out.through = out.coincide = true;
      ++out.enclosed;
      out.depth = std::max(out.depth, depth);
    }
  }
}

}  // namespace

OverlapSkin::OverlapSkin(const Memory &memory, const Body &b)
    : memory_(&memory), surface_(&b.surface), x_(memory) {
  const Surface &s = b.surface;
  x_.assign(size_t{4} * s.nsurfel, 0.0);
  for (uint32_t i = 0; i < s.nsurfel; ++i) {
    store3(&x_[size_t{4} * i], s.sum(i, b.p.x.data()));
  }
  closed_ = std::find(s.edge_tri.begin(), s.edge_tri.end(), kNone) == s.edge_tri.end();
  const size_t cells = b.ncell();
  b.dynamics->see_points();
  for (size_t t = 0, n = stride_of(cells, kInner); t < cells; t += n) {
    Vec3 sum;
    for (size_t k = 0; k < 4; ++k) sum += load3(&b.p.x[size_t(b.tets[4 * t + k]) * kStride]);
    inner_.push_back(0.25 * sum);
  }
  finish();
}

OverlapSkin::OverlapSkin(const Memory &memory, const Obstacle &o)
    : memory_(&memory), surface_(&own_), x_(memory) {
  Array<double> box{memory};
  const Array<double> *points = &o.points;
  if (o.def.shape == DFM_SHAPE_BOX) {
    constexpr uint32_t faces[36] = {0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4,
                                    2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6, 1, 3, 5, 3, 7, 5};
    own_.tri.assign(faces, faces + 36);
    for (uint32_t i = 0; i < 8; ++i)
      for (uint32_t k = 0; k < 3; ++k) box.push_back(i >> k & 1 ? o.def.half_size[k] : -o.def.half_size[k]);
    points = &box;
  } else {
    own_.tri.assign(o.triangles.begin(), o.triangles.end());
    closed_ = o.grid || (o.mesh && o.mesh->closed);
    if (o.grid) slack_ = 0.5 * o.grid->cell();
  }
  std::vector<uint32_t> used(own_.tri.begin(), own_.tri.end());  // points that triangles have
  sort_unique(used);
  for (uint32_t &i : own_.tri)
    i = static_cast<uint32_t>(std::lower_bound(used.begin(), used.end(), i) - used.begin());
  own_.ntri = static_cast<uint32_t>(own_.tri.size() / 3);
  own_.nsurfel = static_cast<uint32_t>(used.size());
  x_.assign(size_t{4} * own_.nsurfel, 0.0);
  for (uint32_t i = 0; i < own_.nsurfel; ++i)
    store3(&x_[size_t{4} * i], place(o.pose, load3(&(*points)[size_t{3} * used[i]])));
  finish();
}

void OverlapSkin::finish() {
  const Extent box = extent_of(x_.data(), nsurfel(), kStride);
  lo_ = box.lo;
  hi_ = box.hi;
  origin_ = 0.5 * (lo_ + hi_);
  const double size = norm(hi_ - lo_);
  scale_ = size > 0 ? 1 / size : 1;
  double volume = 0;
  for (uint32_t t = 0; t < surface_->ntri; ++t)
    volume += dot(corner(t, 0) - origin_, cross(corner(t, 1) - origin_, corner(t, 2) - origin_));
  outward_ = volume > 0;
}

void OverlapSkin::shift(Vec3 by) {
  for (uint32_t s = 0; s < nsurfel(); ++s) store3(&x_[size_t{4} * s], x(s) + by);
  for (Vec3 &p : inner_) p += by;
  lo_ += by;
  hi_ += by;
  origin_ += by;
  if (tree_) tree_->refit(surface_->tri, x_.data());
}

const BoxTree &OverlapSkin::tree() {
  if (!tree_) {
    tree_ = std::make_unique<BoxTree>(*memory_);
    tree_->build(surface_->tri, x_.data());
  }
  return *tree_;
}

double OverlapSkin::turns(Vec3 p) {
  if (!winding_) {
    Array<double> points{*memory_};
    for (uint32_t s = 0; s < nsurfel(); ++s)
      for (int k = 0; k < 3; ++k) points.push_back(scale_ * (x(s)[k] - origin_[k]));
    winding_ = std::make_unique<WindingTree>(*memory_, points.data(), surface_->ntri, surface_->tri.data());
  }
  return winding_->at(scale_ * (p - origin_));
}

bool OverlapSkin::inside(Vec3 p) {
  if (!closed_) return false;
  return outward_ ? turns(p) > 0.5 : turns(p) > -0.5;
}

bool OverlapSkin::covers(Vec3 p) { return surface_->identity() || std::fabs(turns(p)) > 0.5; }

double OverlapSkin::distance(Vec3 p) {
  const Triangles triangles{tree(), surface_->tri, x_.data()};
  return std::sqrt(closest_to(triangles, p, DistanceKey::squared, kFar).key);
}

Crossed cross_skins(OverlapSkin &a, OverlapSkin &b, double offset, bool yes_or_no,
                    Array<PairOfTriangles> &stack) {
  Crossed out;
  if (!b.room() && !a.room())
    for (int k = 0; k < 3; ++k)
      if (!(a.hi()[k] > b.lo()[k] && b.hi()[k] > a.lo()[k])) return out;  // a floor may be flat
  const double least = offset + a.slack() + b.slack();
  double edges = 0;
  near_pairs(a.tree(), b.tree(), 0, stack, [&](uint32_t p, uint32_t q, double) {
    if (yes_or_no && edges > least) return;
    const double depth = cross_triangles(a, a.tree().triangles()[p], b, b.tree().triangles()[q]);
    out.crossings += depth >= 0;
    edges = std::max(edges, depth);
  });
  out.through = edges > least;
  if (yes_or_no && out.through) return out;
  count_enclosed(a, b, least, out);
  count_enclosed(b, a, least, out);
  if (!out.through) {
    probe_inner(a, b, least, out);
    probe_inner(b, a, least, out);
  }
  if (out.depth == 0) out.depth = edges;
  return out;
}

Crossed cross_shape(OverlapSkin &a, const ObstacleShape &b, double offset) {
  Crossed out;
  const ObstacleView &view = b.view();
  const bool plane = view.shape == Shape::plane;
  for (int k = 0; !plane && k < 3; ++k) {
    const double lo = std::min(b.end(0)[k], b.end(1)[k]) - view.radius;
    const double hi = std::max(b.end(0)[k], b.end(1)[k]) + view.radius;
    if (!(std::min(a.hi()[k], hi) - std::max(a.lo()[k], lo) > 0)) return out;
  }
  std::vector<double> distance(a.nsurfel());
  for (uint32_t s = 0; s < a.nsurfel(); ++s) {
    distance[s] = b.closest(a.x(s)).distance;
    out.depth = std::max(out.depth, -distance[s]);
    out.enclosed += distance[s] < 0;
  }
  const Convex axis = convex_triangle(b.end(0), b.end(1), b.end(1));
  double nearest = std::numeric_limits<double>::infinity();  // of a triangle to the axis
  for (uint32_t t = 0; t < a.surface().ntri; ++t) {
    const uint32_t *const c = &a.surface().tri[size_t{3} * t];
    const double d[3] = {distance[c[0]], distance[c[1]], distance[c[2]]};
    double least = std::min({d[0], d[1], d[2]});
    if (!plane && least > 0) {  // a shape smaller than the triangle
      const ConvexGap gap = convex_gap(convex_triangle(a.corner(t, 0), a.corner(t, 1), a.corner(t, 2)), axis);
      least = (gap.apart ? gap.distance : 0) - view.radius;
      nearest = std::min(nearest, least);
    }
    out.crossings += least < 0 && std::max({d[0], d[1], d[2]}) > 0;
  }
  if (nearest < 0) out.depth = std::max(out.depth, -nearest);
  if (!plane && out.crossings == 0 && out.enclosed == 0 && a.inside(b.end(0))) {
    out.enclosed = 1;
    out.depth = a.distance(b.end(0)) + view.radius;
  }
  out.through = out.depth > offset;
  return out;
}

OverlapSides::OverlapSides(World &w)
    : w_(w), step_(*w.steps), bodies_(w.bodies.size()), obstacles_(w.obstacles.size()), stack_(w.memory()) {}

bool OverlapSides::may_touch(const OverlapPair &p) const {
  const BodyView &a = step_.body_views[p.a];
  const uint64_t b = p.obstacle ? step_.obstacle_views[p.b].id : step_.body_views[p.b].id;
  if (p.obstacle && step_.obstacle_views[p.b].shape == Shape::none) return false;
  return w_.overlaps.is_suspended(a.id, b, p.obstacle) ||
         (p.obstacle ? w_.pairs.filter.may_touch(a, step_.obstacle_views[p.b])
                     : w_.pairs.filter.may_touch(a, step_.body_views[p.b]));
}

OverlapSkin &OverlapSides::body(uint32_t i) {
  if (!bodies_[i]) bodies_[i] = std::make_unique<OverlapSkin>(w_.memory(), *w_.bodies[i]);
  return *bodies_[i];
}

OverlapSkin &OverlapSides::other(const OverlapPair &p) {
  if (!p.obstacle) return body(p.b);
  if (!obstacles_[p.b]) obstacles_[p.b] = std::make_unique<OverlapSkin>(w_.memory(), *w_.obstacles[p.b]);
  return *obstacles_[p.b];
}

bool OverlapSides::plane(const OverlapPair &p) const {
  return p.obstacle && w_.obstacles[p.b]->def.shape == DFM_SHAPE_PLANE;
}

bool OverlapSides::round(const OverlapPair &p) const {
  return plane(p) || (p.obstacle && (w_.obstacles[p.b]->def.shape == DFM_SHAPE_SPHERE ||
                                     w_.obstacles[p.b]->def.shape == DFM_SHAPE_CAPSULE));
}

ObstacleShape OverlapSides::shape(const OverlapPair &p) const {
  ObstacleView v = step_.obstacle_views[p.b];
  v.position = w_.obstacles[p.b]->pose.position;
  v.rotation = w_.obstacles[p.b]->pose.rotation;
  return ObstacleShape(v);
}

Crossed OverlapSides::look(const OverlapPair &p, double least, bool yes_or_no) {
  return round(p) ? cross_shape(body(p.a), shape(p), least)
                  : cross_skins(body(p.a), other(p), least, yes_or_no, stack_);
}

Vec3 OverlapSides::center(const OverlapPair &p) {
  return round(p) ? w_.obstacles[p.b]->pose.position : 0.5 * (other(p).lo() + other(p).hi());
}

double OverlapSides::slack(const OverlapPair &p) { return round(p) ? 0 : other(p).slack(); }

double OverlapSides::reach(const OverlapPair &p, Vec3 direction) {
  if (round(p)) {
    const ObstacleShape s = shape(p);
    return std::max(dot(s.end(0), direction), dot(s.end(1), direction)) + s.view().radius;
  }
  const OverlapSkin &b = other(p);
  double most = -std::numeric_limits<double>::infinity();
  for (uint32_t s = 0; s < b.nsurfel(); ++s) most = std::max(most, dot(b.x(s), direction));
  return most;
}

}  // namespace dfm
