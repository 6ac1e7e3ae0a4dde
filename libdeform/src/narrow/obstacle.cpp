// Bodies against planes, spheres, boxes and capsules, in closed form. A surfel sees the nearest point of the
// obstacle. Where the obstacle is smaller than a triangle, edges and faces of the body count too, with the
// same rule as between bodies: only local minima of the distance, seen from outside. So they do where the
// body's surface means to be smooth and bulges between its surfels (geometry/bulge.h).
#include <algorithm>

#include "geometry/area.h"
#include "geometry/bulge.h"
#include "geometry/closest.h"
#include "narrow/detail.h"

namespace dfm::narrow {

void finish(const Pair &pair, ContactPoint &c, Vec3 q, Vec3 o, Vec3 normal, double distance, uint32_t patch,
            Array<ContactPoint> &out) {
  place(c, q, o, normal, distance);
  // A belt slips along its surface; it never pushes what lies beside it. Of what turns, it is the place where
  // the body's own point is: what sticks goes along with the turn at its own radius, and that is also where
  // impulses act (ContactRows::arm), so that a spin which they take back leaves nothing.
  const ObstacleView &view = pair.shape->view();
  store3(c.velocity, view.velocity_at(q, pair.h) - dot(view.belt, normal) * normal);
  c.key = contact_key(c, *pair.a.surface, pair.a.id, nullptr, view.id, patch, 0);
  out.push_back(c);
}

double reach_of(const Pair &pair, std::span<const uint32_t> nodes, Vec3 o) {
  const Vec3 v = pair.shape->shape_velocity(o);
  double speed2 = 0;
  for (const uint32_t s : nodes) speed2 = std::max(speed2, norm2(pair.va(s) - v));
  return contact_reach(pair.h, pair.offset, std::sqrt(speed2));
}

namespace {

// One edge of the body with its data for a query against a shape; the faces beside it are found at first
// use.
struct Edge {
  const Pair &pair;
  uint32_t number;
  std::span<const uint32_t> ends;
  Vec3 p, u;  // p + s u
  EdgeFaces faces;
  bool known = false;

  Edge(const Pair &of, uint32_t e) : pair(of), number(e), ends(&of.a.surface->edge[2 * size_t{e}], 2) {
    p = pair.xa(ends[0]);
    u = pair.xa(ends[1]) - p;
  }
  const EdgeFaces &sides() {
    if (!known) faces = edge_faces(*pair.a.surface, number);
    known = true;
    return faces;
  }
  void emit(double s, Vec3 o, Vec3 normal, double distance, uint32_t feature_b,
            Array<ContactPoint> &out) const {
    ContactPoint c = blank(pair, kPrimitive, 1, number, feature_b);
    add_node(c, pair.a.first_node + ends[0], 1 - s);
    add_node(c, pair.a.first_node + ends[1], s);
    finish(pair, c, p + s * u, o, normal, distance, feature_b, out);
  }
};

// The inner point s of an edge against a ball around c; normal from c to the edge. `cone` accepts directions
// that leave the obstacle. slack: of the edge's own cone of normals, more than kFlat.
template <class Cone>
void edge_point(Edge &e, double s, Vec3 c, double radius, uint32_t feature_b, double slack, Cone &&cone,
                Array<ContactPoint> &out) {
  if (!(s > 0 && s < 1)) return;
  const Vec3 r = e.p + s * e.u - c;
  const double d = norm(r);
  if (!(d > 0) || !(d - radius < reach_of(e.pair, e.ends, c))) return;
  const Vec3 normal = (1 / d) * r;
  const EdgeFaces &f = e.sides();
  if (!(dot(normal, f.outward()) < 0) || !f.leans_out(-normal, kFlat + slack) || !cone(normal)) return;
  e.emit(s, c + radius * normal, normal, d - radius, feature_b, out);
}

// Across a capsule's axis the two lines fix the normal, as between two edges, and what bears is a row of
// edges that the straight axis presses into one line: flat ones. Left out, each would lose its load where it
// is pushed flat, spring back and be hit again (a tube between two rods shook for ever). A ball's center has
// the faces beside a flat edge.
void edge_round(Edge &e, Array<ContactPoint> &out) {
  const Pair &pair = e.pair;
  const ObstacleShape &shape = *pair.shape;
  const double radius = shape.view().radius;
  const auto any = [](Vec3) { return true; };
  const auto convex = [&] { return edge_becomes_convex(*pair.a.surface, e.number, pair.h); };
  const Vec3 axis = shape.end(1) - shape.end(0);
  // Nearly parallel to the axis: the ends of the axis, not one point that jumps between them.
  const bool parallel = norm2(cross(e.u, axis)) <= 0.0025 * norm2(e.u) * norm2(axis);
  if (shape.view().shape == Shape::sphere || parallel) {
    const int ends = shape.view().shape == Shape::sphere ? 1 : 2;
    for (int k = 0; k < ends && convex(); ++k)
      edge_point(e, closest_on_segment(shape.end(k), e.p, e.p + e.u), shape.end(k), radius, uint32_t(k), 0,
                 any, out);
    return;
  }
  const SegmentPoints q = closest_segments(e.p, e.p + e.u, shape.end(0), shape.end(1));
  const bool across = q.t > 0 && q.t < 1;
  if (!across && !convex()) return;
  const Vec3 c = shape.end(0) + q.t * axis;
  const double slack = across ? kCone + std::min(0.3, reach_of(pair, e.ends, c) / norm(e.u)) : 0;
  edge_point(e, q.s, c, radius, 2, slack, any, out);
}

// Numbers of box features: edges 0 to 11, corners 12 to 19. As between two bodies (edge_edge.cpp), edges that
// bore each other in the last sub-step count on when the load has pressed the body's flat: a box would else
// shake on the rim of its dent for ever, and lose friction with each of them.
void edge_box(Edge &e, bool convex, Array<ContactPoint> &out) {
  const Pair &pair = e.pair;
  const ObstacleShape &shape = *pair.shape;
  const double depth = recovery_depth(*pair.a.surface), uu = norm2(e.u);
  for (uint32_t k = 0; k < 12; ++k) {
    Vec3 q, to;
    uint32_t face[2];
    shape.edge(k, q, to, face);
    const Vec3 w = to - q, r = e.p - q, n = cross(e.u, w);
    const double nn = norm2(n), ww = norm2(w), uw = dot(e.u, w), ur = dot(e.u, r), wr = dot(w, r);
    const double s = uw * wr - ww * ur, t = uu * wr - uw * ur;  // times nn
    if (!(nn > kParallel * kParallel * uu * ww) || !(s > 0 && s < nn && t > 0 && t < nn)) continue;
    const Vec3 o = q + (t / nn) * w;
    const double reach = reach_of(pair, e.ends, o), nr = dot(n, r), allowed = std::max(reach, depth);
    if (!(nr * nr < allowed * allowed * nn) || !(convex || pair.bears(e.number, k))) continue;
    const EdgeFaces &f = e.sides();
    const Vec3 m0 = shape.face_normal(face[0]), m1 = shape.face_normal(face[1]);
    Vec3 normal = (1 / std::sqrt(nn)) * n;
    if (dot(normal, m0 + m1) < dot(normal, f.outward())) normal = -normal;
    const double distance = dot(normal, r);
    const double slack = kCone + std::min(0.3, reach / std::sqrt(std::min(uu, ww)));
    if (!(distance < reach) || !f.leans_out(-normal, slack) || dot(normal, m0) < -slack ||
        dot(normal, m1) < -slack)
      continue;
    e.emit(s / nn, o, normal, distance, k, out);
  }
  for (uint32_t k = 0; convex && k < 8; ++k) {
    const Vec3 corner = shape.corner(k);
    const auto cone = [&](Vec3 n) {
      for (int i = 0; i < 3; ++i)
        if (dot(n, shape.axis(i)) * (k >> i & 1 ? 1 : -1) < -kFlat) return false;
      return true;
    };
    edge_point(e, closest_on_segment(corner, e.p, e.p + e.u), corner, 0, 12 + k, 0, cone, out);
  }
}

// Off a box's edge or corner the direction is free, and the surfel must stick out along it; where it does
// not, the edges and faces beside it are nearer.
bool off_an_edge(const ObstacleShape &shape, const ObstaclePoint &o) {
  if (shape.view().shape != Shape::box || !(o.distance > 0)) return false;
  for (int k = 0; k < 3; ++k)
    if (std::fabs(dot(o.normal, shape.axis(k))) > 1 - 1e-12) return false;
  return true;
}

// Contacts of a box edge have numbers below this, and the faces that bulges touch have those from it on.
constexpr uint32_t kFaces = 32;
// Newton's steps to the place that is nearest to a round obstacle; to a flat one the first is exact.
constexpr int kPlaces = 8;

// The lowest place of a smooth surface over one of its edges or triangles is a contact where it lies below
// the edge's ends, or the triangle's border, by more than kMinDip. find(heights, u, border): whether there
// is one, which may lie beyond the border, and the lowest height of the border.
template <class Find>
bool touch_bulge(const Pair &pair, const Patch &patch, uint8_t type, uint32_t feature, Find &&find,
                 ContactPoint &c) {
  const ObstacleShape &shape = *pair.shape;
  const auto at = [&](uint32_t s) { return pair.xa(s); };
  const Vec3 x[3] = {at(patch.node[0]), at(patch.node[1]), at(patch.node[2])};
  double u[3] = {1.0 / 3, 1.0 / 3, 1.0 / 3}, w[4];
  Vec3 p = (1.0 / 3) * (x[0] + x[1] + x[2]);
  ObstaclePoint o = shape.closest(p);
  const double reach = reach_of(pair, patch.node, o.point);
  bool touches = false;
  for (int step = 0; step < kPlaces; ++step) {
    PatchHeights heights(patch, o.normal, at);
    if (heights.least() - dot(o.normal, o.point) >= reach) return false;
    const Vec3 over = u[0] * x[0] + u[1] * x[1] + u[2] * x[2];
    for (int k = 0; k < 3; ++k) {
      heights.corner[k] += 0.5 * shape.bend(o, x[k] - over);
      heights.off[k] -= 0.125 * shape.bend(o, x[(k + 1) % 3] - x[k]);
    }
    double border;
    if (!find(heights, u, border)) return false;
    touches = in_triangle(u) && heights.at(u) < border - kMinDip * pair.offset;
    double sum = 0;
    for (double &part : u) sum += part = std::max(part, 0.0);
    for (double &part : u) part /= sum;
    patch.weights(u, w);
    p = {};
    for (int i = 0; i < 4; ++i) p += w[i] * at(patch.node[i]);
    const Vec3 before = o.normal;
    o = shape.closest(p);
    if (norm2(o.normal - before) == 0) break;
  }
  if (!touches || !(o.distance < reach) || off_an_edge(shape, o)) return false;
  c = blank(pair, kPrimitive, type, feature, kFaces + o.face);
  for (int i = 0; i < 4; ++i) add_node(c, pair.a.first_node + patch.node[i], w[i]);
  place(c, p, o.point, o.normal, o.distance);
  return true;
}

void finish_bulge(const Pair &pair, ContactPoint &c, Array<ContactPoint> &out) {
  const Vec3 normal = load3(c.normal), half = (0.5 * c.distance) * normal, middle = load3(c.point);
  finish(pair, c, middle + half, middle - half, normal, c.distance, c.feature_b, out);
}

// The two patches of an edge are one curve where the edge is smooth; at a crease the nearer one counts.
void edge_bulge(const Pair &pair, uint32_t edge, Array<ContactPoint> &out) {
  const Surface &s = *pair.a.surface;
  ContactPoint nearest{}, c;
  bool any = false;
  for (int side = 0; side < 2; ++side) {
    const uint32_t t = s.edge_tri[2 * size_t{edge} + size_t(side)];
    if (t == kNone || s.bulge_from[t] == kNone) continue;
    const uint32_t *const edges = &s.tri_edge[3 * size_t{t}];
    const int k = edges[0] == edge ? 0 : edges[1] == edge ? 1 : 2;
    const auto find = [&](const PatchHeights &h, double u[3], double &border) {
      border = std::min(h.corner[k], h.corner[(k + 1) % 3]);
      return h.lowest_of_edge(k, u);
    };
    if (!touch_bulge(pair, Patch(s, t), 1, edge, find, c) || (any && !(c.distance < nearest.distance)))
      continue;
    nearest = c;
    any = true;
  }
  if (any) finish_bulge(pair, nearest, out);
}

void triangle_bulge(const Pair &pair, uint32_t t, Array<ContactPoint> &out) {
  const Surface &s = *pair.a.surface;
  if (s.bulge_from[t] == kNone) return;
  const auto find = [](const PatchHeights &h, double u[3], double &border) {
    border = std::min({h.corner[0], h.corner[1], h.corner[2]});
    for (int k = 0; k < 3; ++k)
      if (h.lowest_of_edge(k, u) && in_triangle(u)) border = std::min(border, h.at(u));
    return h.lowest(u);
  };
  ContactPoint c;
  if (touch_bulge(pair, Patch(s, t), 2, t, find, c)) finish_bulge(pair, c, out);
}

}  // namespace

void surfel_obstacle(const Pair &pair, Run run, Array<ContactPoint> &out) {
  for (const Candidate &candidate : run) {
    const uint32_t s = candidate.feature_a;
    const Vec3 x = pair.xa(s);
    const ObstaclePoint o = pair.shape->closest(x);
    if (!(o.distance < reach_of(pair, {&s, 1}, o.point))) continue;
    if (off_an_edge(*pair.shape, o) && !vertex_cone_has(*pair.a.surface, s, -o.normal)) continue;
    ContactPoint c = blank(pair, kPrimitive, 0, s, o.face);
    add_node(c, pair.a.first_node + s, 1);
    c.area = facing_area(*pair.a.surface, s, -o.normal);
    finish(pair, c, x, o.point, o.normal, o.distance, o.face, out);
  }
}

void edge_obstacle(const Pair &pair, Run run, Array<ContactPoint> &out) {
  const Surface &surface = *pair.a.surface;
  const bool box = pair.shape->view().shape == Shape::box, plane = pair.shape->view().shape == Shape::plane;
  for (const Candidate &candidate : run) {
    const uint32_t number = candidate.feature_a;
    const bool convex = box && edge_becomes_convex(surface, number, pair.h);
    if (!plane && (box ? convex || pair.bears(number)
                       : !edge_hollow(surface, number) || !edge_hollow(surface, number, 2 * pair.h))) {
      Edge e(pair, number);
      if (box) edge_box(e, convex, out);
      else edge_round(e, out);
    }
    if (!surface.bulge.empty()) edge_bulge(pair, number, out);
  }
}

// Faces against the center of a sphere, the ends of a capsule's axis, the corners of a box.
void triangle_obstacle(const Pair &pair, Run run, Array<ContactPoint> &out) {
  const ObstacleShape &shape = *pair.shape;
  const bool box = shape.view().shape == Shape::box;
  const double radius = shape.view().radius, depth = recovery_depth(*pair.a.surface);
  for (const Candidate &candidate : run) {
    const std::span<const uint32_t> corner(&pair.a.surface->tri[3 * size_t{candidate.feature_a}], 3);
    const Vec3 a = pair.xa(corner[0]), b = pair.xa(corner[1]), d = pair.xa(corner[2]);
    const Vec3 m = normalized(cross(b - a, d - a));
    for (uint32_t k = 0; k < shape.points(); ++k) {
      const Vec3 c = shape.point(k);
      const TrianglePoint q = closest_on_triangle(c, a, b, d);
      const double plane = dot(m, c - q.point), distance = plane - radius;
      // Over the face, its border included: there rounding may put a point beside both of two triangles.
      if (q.feature != TriangleFeature::face && !(q.distance2 <= plane * plane * (1 + 1e-9))) continue;
      if (!(norm2(m) > 0) || !(distance < reach_of(pair, corner, c)) ||
          !(plane > (box ? -depth : -std::min(radius, depth))))
        continue;
      // only a corner that leads the box into the body, not one of its far side
      if (box && plane < 0) {
        bool leads = true;
        for (int i = 0; i < 3; ++i) leads &= dot(m, shape.axis(i)) * (k >> i & 1 ? 1 : -1) <= 0.3;
        if (!leads) continue;
      }
      ContactPoint p = blank(pair, kPrimitive, 2, candidate.feature_a, box ? 12 + k : k);
      for (int i = 0; i < 3; ++i) add_node(p, pair.a.first_node + corner[i], q.weight[i]);
      finish(pair, p, q.point, c - radius * m, -m, distance, p.feature_b, out);
    }
    if (!pair.a.surface->bulge.empty()) triangle_bulge(pair, candidate.feature_a, out);
  }
}

}  // namespace dfm::narrow
