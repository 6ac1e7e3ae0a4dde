#include "rollback/impact_time.h"

#include <algorithm>
#include <cmath>

#include "ccd/toi.h"
#include "geometry/area.h"
#include "geometry/closest.h"
#include "geometry/obstacle_shape.h"
#include "narrow/detail.h"

namespace dfm::rollback {
namespace {

// fraction of d_c, accuracy of impact times; features nearer than d_c by twice that are at rest
constexpr double kSharp = 1e-3;
constexpr double kBack = 0.5;  // share of its distance to which a feature that leaves a rest may return
// far more than needed; every step is safe, so stopping early gives an earlier time
constexpr int kNewton = 60;

// The two nearest places of the features at one moment.
struct Nearest {
  Vec3 a, b;
  double distance, at[3];
};

Nearest nearest_of(const Vec3 x[4], bool edges) {
  Nearest n{};
  if (edges) {
    const SegmentPoints s = closest_segments(x[0], x[1], x[2], x[3]);
    n.a = x[0] + s.s * (x[1] - x[0]);
    n.b = x[2] + s.t * (x[3] - x[2]);
    n.distance = std::sqrt(s.distance2);
    n.at[0] = s.s;
    n.at[1] = s.t;
  } else {
    const TrianglePoint t = closest_on_triangle(x[0], x[1], x[2], x[3]);
    n.a = x[0];
    n.b = t.point;
    n.distance = std::sqrt(t.distance2);
    std::copy(t.weight, t.weight + 3, n.at);
  }
  return n;
}

void weights_of(const Nearest &n, bool edges, double w[4]) {
  if (edges) {
    w[0] = 1 - n.at[0];
    w[1] = n.at[0];
    w[2] = n.at[1] - 1;
    w[3] = -n.at[1];
  } else {
    w[0] = 1;
    w[1] = -n.at[0];
    w[2] = -n.at[1];
    w[3] = -n.at[2];
  }
}

// The boxes of the two swept features, grown by `by`, do not overlap: nearly all pairs end here.
bool far_apart(const Vec3 x[4], const Vec3 way[4], bool edges, double by) {
  const int split = edges ? 2 : 1;
  for (int i = 0; i < 3; ++i) {
    double low[2] = {HUGE_VAL, HUGE_VAL}, high[2] = {-HUGE_VAL, -HUGE_VAL};
    for (int k = 0; k < 4; ++k) {
      const int side = k >= split;
      const double p = x[k][i], q = x[k][i] + way[k][i];
      low[side] = std::min({low[side], p, q});
      high[side] = std::max({high[side], p, q});
    }
    const double grown = by * (1 + 1e-9);
    if (low[0] - high[1] > grown || low[1] - high[0] > grown) return true;
  }
  return false;
}

double touch_time(const Vec3 x[4], const Vec3 way[4], bool edges, double distance, double within) {
  dfm_motion m[4];
  for (int k = 0; k < 4; ++k) {
    store3(m[k].p0, x[k]);
    store3(m[k].p1, x[k] + way[k]);
  }
  const dfm_toi_options options = {sizeof options, DFM_TOI_CONSERVATIVE, 0, distance, 0};
  return (edges ? toi_edge_edge(m, m + 2, options, within) : toi_point_triangle(m[0], m + 1, options, within))
      .t;
}

}  // namespace

ImpactQuery::ImpactQuery(std::span<const BodyView> bodies, std::span<const ObstacleView> obstacles, double h,
                         double touch)
    : bodies_(bodies), obstacles_(obstacles), h_(h), touch_(touch) {}

Vec3 ImpactQuery::start(const Corner &c) const {
  return c.slot == kNone ? c.still : load3(&bodies_[c.slot].surface->x[4 * size_t{c.surfel}]);
}

Vec3 ImpactQuery::way(const Corner &c, std::span<const double *const> fraction) const {
  if (c.slot == kNone) return {};
  const double s = fraction.empty() ? 1 : fraction[c.slot][c.surfel];
  return (h_ * s) * load3(&bodies_[c.slot].surface->v[4 * size_t{c.surfel}]);
}

void ImpactQuery::mesh_features(const Candidate &c, const Surface &mesh, Features &f) const {
  const Surface &a = *bodies_[c.slot_a].surface;
  const auto fixed = [&](uint32_t s) { return still(load3(&mesh.x[4 * size_t{s}])); };
  if (c.kind == 1) {
    for (uint32_t k = 0; k < 2; ++k) {
      f.corner[k] = surfel(c.slot_a, a.edge[2 * size_t{c.feature_a} + k]);
      f.corner[2 + k] = fixed(mesh.edge[2 * size_t{c.feature_b} + k]);
    }
    return;
  }
  f.turned = c.kind == 2;  // a vertex of the mesh against a triangle of the body
  f.corner[0] = f.turned ? fixed(c.feature_a) : surfel(c.slot_a, c.feature_a);
  const uint32_t *const t = &(f.turned ? a : mesh).tri[3 * size_t{c.feature_b}];
  for (uint32_t k = 0; k < 3; ++k) f.corner[1 + k] = f.turned ? surfel(c.slot_a, t[k]) : fixed(t[k]);
}

template <class F>
void ImpactQuery::each(const Candidate &c, F &&call) const {
  const Surface &a = *bodies_[c.slot_a].surface;
  Features f{{}, c.kind == 1, false, 0, 0};
  if (!c.obstacle) {
    const Surface &b = *bodies_[c.slot_b].surface;
    f.corner[0] = surfel(c.slot_a, f.edges ? a.edge[2 * size_t{c.feature_a}] : c.feature_a);
    if (f.edges) f.corner[1] = surfel(c.slot_a, a.edge[2 * size_t{c.feature_a} + 1]);
    for (uint32_t k = f.edges ? 2 : 1; k < 4; ++k)
      f.corner[k] = surfel(c.slot_b, f.edges ? b.edge[2 * size_t{c.feature_b} + k - 2]
                                             : b.tri[3 * size_t{c.feature_b} + k - 1]);
    return call(f);
  }
  const ObstacleView &v = obstacles_[c.slot_b];
  if (v.shape == Shape::mesh) {
    mesh_features(c, *v.surface, f);
    return call(f);
  }
  if (c.kind == 0) return;
  const ObstacleShape shape(v);
  if (c.kind == 1) {
    for (uint32_t k = 0; k < 2; ++k) f.corner[k] = surfel(c.slot_a, a.edge[2 * size_t{c.feature_a} + k]);
    if (v.shape == Shape::capsule) {
      f.round = v.radius;
      f.part = 2;
      f.corner[2] = still(shape.end(0));
      f.corner[3] = still(shape.end(1));
      call(f);
    } else if (v.shape == Shape::box) {
      for (f.part = 0; f.part < 12; ++f.part) {
        Vec3 from, to;
        uint32_t faces[2];
        shape.edge(f.part, from, to, faces);
        f.corner[2] = still(from);
        f.corner[3] = still(to);
        call(f);
      }
    }
    return;
  }
  const uint32_t points = v.shape == Shape::box ? 8 : v.shape == Shape::capsule ? 2 : 1;
  f.turned = true;
  f.round = v.shape == Shape::box ? 0 : v.radius;
  for (uint32_t k = 0; k < 3; ++k) f.corner[1 + k] = surfel(c.slot_a, a.tri[3 * size_t{c.feature_a} + k]);
  for (uint32_t k = 0; k < points; ++k) {
    f.corner[0] = still(v.shape == Shape::box ? shape.corner(k) : shape.end(int(k)));
    f.part = v.shape == Shape::box ? 12 + k : k;
    call(f);
  }
}

void ImpactQuery::against(const Features &f, std::span<const double *const> fraction, ImpactHit &best) const {
  Vec3 x[4], d[4];
  for (int k = 0; k < 4; ++k) {
    x[k] = start(f.corner[k]);
    d[k] = way(f.corner[k], fraction);
  }
  if (far_apart(x, d, f.edges, touch_ + f.round)) return;
  Nearest n = nearest_of(x, f.edges);
  const double distance = n.distance - f.round;
  if (!(distance > 0)) return;
  double t;
  if (distance > touch_ * (1 + 2 * kSharp)) {
    t = touch_time(x, d, f.edges, touch_ + f.round, kSharp * touch_);
  } else {
    double w[4];
    weights_of(n, f.edges, w);
    Vec3 closing;
    for (int k = 0; k < 4; ++k) closing += w[k] * d[k];
    t = dot(closing, n.a - n.b) < 0
            ? 0
            : touch_time(x, d, f.edges, kBack * distance + f.round, kSharp * distance);
  }
  if (!(t <= 1) || !(t < best.t)) return;
  if (t > 0) {
    for (int k = 0; k < 4; ++k) x[k] += t * d[k];
    n = nearest_of(x, f.edges);
  }
  const Vec3 normal = (f.turned ? -1 : 1) * normalized(n.a - n.b);
  best.t = t;
  best.part = f.part;
  best.start = distance;
  std::copy(n.at, n.at + 3, best.at);
  store3(best.normal, normal);
  store3(best.point, 0.5 * (n.a + n.b));
}

// A surfel against a convex shape at rest: the distance is a convex function of time, and Newton steps from
// the left never pass its root.
void ImpactQuery::against_shape(const Candidate &c, std::span<const double *const> fraction,
                                ImpactHit &best) const {
  const ObstacleShape shape(obstacles_[c.slot_b]);
  const Corner corner = surfel(c.slot_a, c.feature_a);
  const Vec3 x = start(corner), d = way(corner, fraction);
  ObstaclePoint p = shape.closest(x);
  const double distance = p.distance;
  if (!(distance > 0)) return;
  double touch = touch_, t = 0;
  if (distance <= touch_ * (1 + 2 * kSharp)) {
    if (!(dot(p.normal, d) < 0)) return;  // separates, and from a convex shape it does not return
    touch = distance;
  }
  for (int i = 0; i < kNewton && p.distance > touch * (1 + kSharp); ++i) {
    const double rate = dot(p.normal, d), left = touch - p.distance;
    if (!(rate < 0) || left < rate * (1 - t)) return;
    t = std::min(1.0, t + left / rate);
    p = shape.closest(x + t * d);
  }
  best.t = t;
  best.part = p.face;
  best.start = distance;
  best.at[0] = 1;
  best.at[1] = best.at[2] = 0;
  store3(best.normal, p.normal);
  store3(best.point, 0.5 * (x + t * d + p.point));
}

ImpactHit ImpactQuery::first(const Candidate &c, std::span<const double *const> fraction) const {
  ImpactHit best{};
  best.t = HUGE_VAL;
  if (c.obstacle && c.kind == 0 && obstacles_[c.slot_b].shape != Shape::mesh)
    against_shape(c, fraction, best);
  else each(c, [&](const Features &f) { against(f, fraction, best); });
  return best;
}

uint32_t ImpactQuery::nodes(const Candidate &c, uint32_t out[4]) const {
  const BodyView &a = bodies_[c.slot_a];
  uint32_t n = 0;
  const auto add = [&](const BodyView &body, const Array<uint32_t> &list, uint32_t feature, uint32_t width) {
    for (uint32_t k = 0; k < width; ++k) out[n++] = body.first_node + list[size_t{width} * feature + k];
  };
  if (c.obstacle) {
    const bool mesh = obstacles_[c.slot_b].shape == Shape::mesh;
    if (c.kind == 0) out[n++] = a.first_node + c.feature_a;
    else if (c.kind == 1) add(a, a.surface->edge, c.feature_a, 2);
    else add(a, a.surface->tri, mesh ? c.feature_b : c.feature_a, 3);
    return n;
  }
  const BodyView &b = bodies_[c.slot_b];
  if (c.kind == kEdgeEdge) {
    add(a, a.surface->edge, c.feature_a, 2);
    add(b, b.surface->edge, c.feature_b, 2);
  } else {
    out[n++] = a.first_node + c.feature_a;
    add(b, b.surface->tri, c.feature_b, 3);
  }
  return n;
}

ContactPoint ImpactQuery::contact(const Candidate &c, const ImpactHit &hit) const {
  const BodyView &a = bodies_[c.slot_a];
  const Vec3 normal = load3(hit.normal);
  ContactPoint p{};
  p.slot_a = c.slot_a;
  p.slot_b = c.slot_b;
  p.obstacle = c.obstacle;
  p.feature_a = c.feature_a;
  p.feature_b = c.feature_b;
  p.kind = c.obstacle ? uint8_t{kPrimitive} : c.kind;
  p.type_a = c.obstacle ? c.kind : c.kind == kEdgeEdge;
  p.distance = hit.start;
  std::copy(hit.point, hit.point + 3, p.point);
  std::copy(hit.normal, hit.normal + 3, p.normal);
  uint32_t node[4];
  const uint32_t n = nodes(c, node);
  const bool edge = p.type_a == 1, triangle = p.type_a == 2;
  for (uint32_t k = 0; k < n; ++k) {
    const double w = edge       ? k == 0   ? 1 - hit.at[0]
                                  : k == 1 ? hit.at[0]
                                  : k == 2 ? hit.at[1] - 1
                                           : -hit.at[1]
                     : triangle ? hit.at[k]
                     : k == 0   ? 1
                                : -hit.at[k - 1];
    narrow::add_node(p, node[k], w);
  }
  uint64_t id_b;
  uint32_t patch;
  if (c.obstacle) {
    const ObstacleView &o = obstacles_[c.slot_b];
    const bool mesh = o.shape == Shape::mesh;
    id_b = o.id;
    patch = !mesh ? hit.part : c.kind == 2 ? c.feature_a : c.feature_b;
    if (!mesh) p.feature_b = hit.part;
    if (mesh && c.kind == 2) {
      p.feature_a = c.feature_b;
      p.feature_b = c.feature_a;
    }
    store3(p.velocity, o.belt - dot(o.belt, normal) * normal);
    if (p.type_a == 0) p.area = facing_area(*a.surface, c.feature_a, -normal);
  } else {
    const Surface &b = *bodies_[c.slot_b].surface;
    const uint32_t *const t = c.kind == kEdgeEdge ? &b.edge_tri[2 * size_t{c.feature_b}] : &c.feature_b;
    id_b = bodies_[c.slot_b].id;
    patch = b.patch[c.kind == kEdgeEdge && t[0] == kNone ? t[1] : t[0]];
    if (p.type_a == 0) p.area = 0.5 * facing_area(*a.surface, c.feature_a, -normal);
  }
  p.key = narrow::contact_key(p, *a.surface, a.id, nullptr, id_b, patch, 0);
  return p;
}

}  // namespace dfm::rollback
