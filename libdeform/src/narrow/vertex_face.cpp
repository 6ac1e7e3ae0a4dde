// A surfel p of body a against the triangles of body b near it, all together:
//
//      F   over a face: plane distance, face normal            p            p       .  p
//      E   over an edge or corner, if no triangle that         |F        E  |    X  . /|
//          has it is nearer: direction from it to p        ____|____     ___/    ___./ |F
//      X   beside a concave edge: the other face's plane,           \       |        \____
//          its weights extrapolated                                  \      |
//
// The nearest point decides whether p is outside: over a face by its side, over an edge by the sum of its
// faces' normals, over a corner by the edge there that points to p most (the point of the corner's spherical
// outline nearest to the direction of p lies on it). From inside, only the nearest face pushes back (with the
// planes across concave edges): the far side of a thin body does not pull p through.
#include <algorithm>

#include "geometry/area.h"
#include "geometry/closest.h"
#include "narrow/detail.h"

namespace dfm::narrow {
namespace {

constexpr uint32_t kMax = 96;  // triangles kept per surfel; beyond that the nearest ones
constexpr int kWalk = 8;       // triangles around a corner, seldom more, from an edge to where p is
constexpr double kLoose = 1 + 1e-9;
// relative: a triangle beside the feature counts as nearer only beyond this
constexpr double kNearer = 1e-9;

struct Near {
  uint32_t tri;
  TriangleFeature feature;
  bool emitted;
  double weight[3];
  Vec3 q, normal;  // closest point; unit face normal (zero for a triangle without area)
  Vec3 emitted_normal;
  double distance, plane;  // to the triangle (>= 0); signed, to its plane
  double reach;
};

struct Group {
  const Pair &pair;
  double depth;  // m, recovery
  uint32_t surfel = 0, count = 0;
  Vec3 p;
  Near near[kMax];

  explicit Group(const Pair &of) : pair(of), depth(recovery_depth(*of.b->surface)) {}

  const uint32_t *corners(const Near &n) const { return &pair.b->surface->tri[3 * size_t{n.tri}]; }
  double reach_to(Vec3 v, const uint32_t *corners) const;
  bool reaches(Run run, Vec3 v, double widest2) const;
  void collect(Run run, size_t begin, size_t end);
  uint32_t nearest() const;
  bool has_feature(const Near &other, const Near &of) const;
  bool local_minimum(const Near &n) const;
  Vec3 outward(const Near &n) const;
  bool beyond_rim(const Near &n) const;
  bool repeated(const Near &n, Vec3 normal) const;
  uint32_t steepest(const Near &n) const;
  bool plane_weights(const Near &n, double weight[3]) const;
  bool faces(const Near &n, Vec3 surface) const;
  bool past_border(uint32_t tri, uint32_t across) const;
  bool reachable_across(const Near &n, double weight[3]) const;
  void emit(Near &n, Vec3 normal, double distance, const double weight[3], Array<ContactPoint> &out) const;
  void resolve(Array<ContactPoint> &out);
};

// Place for a new entry; where all are taken (a surface folded onto itself), that of the farthest, or null.
// The order of triangles stays.
Near *place_for(Near *near, uint32_t &count, double distance) {
  if (count < kMax) return &near[count++];
  uint32_t far = 0;
  for (uint32_t i = 1; i < count; ++i)
    if (near[i].distance >= near[far].distance) far = i;
  if (!(distance < near[far].distance)) return nullptr;
  std::copy(near + far + 1, near + count, near + far);
  return &near[count - 1];
}

double Group::reach_to(Vec3 v, const uint32_t *c) const {
  double speed2 = 0;
  for (int k = 0; k < 3; ++k) speed2 = std::max(speed2, norm2(v - pair.vb(c[k])));
  return contact_reach(pair.h, pair.offset, std::sqrt(speed2));
}

// Is p within reach of a plane, or behind one, so that it is worth looking closer? In front of all faces
// beyond the reach, p is outside and free. Looser by a few roundings than the decisions that follow, which
// alone may depend on distances.
bool Group::reaches(Run run, Vec3 v, double widest2) const {
  const double depth2 = depth * depth;
  for (const Candidate &candidate : run) {
    const uint32_t *c = &pair.b->surface->tri[3 * size_t{candidate.feature_b}];
    const Vec3 a = pair.xb(c[0]), u = pair.xb(c[1]) - a, w = pair.xb(c[2]) - a, n = cross(u, w);
    const double s = dot(n, p - a), nn = norm2(n);
    // A sliver's normal is rounding; it is always examined further.
    if (nn <= 1e-12 * norm2(u) * norm2(w) || (s < 0 && s * s <= kLoose * depth2 * nn)) return true;
    if (!(s * s <= kLoose * widest2 * nn)) continue;
    const double reach = reach_to(v, c);
    if (s * s <= kLoose * reach * reach * nn) return true;
  }
  return false;
}

void Group::collect(Run run, size_t begin, size_t end) {
  count = 0;
  const Vec3 v = pair.va(surfel);
  const double reach = contact_reach(pair.h, pair.offset, norm(v) + pair.speed_b);
  if (!pair.known.apart && !reaches(run.subspan(begin, end - begin), v, reach * reach)) return;
  const double widest = std::max(reach, depth);
  for (size_t i = begin; i < end; ++i) {
    if (pair.known.beyond(i, widest)) continue;
    const Candidate &candidate = run[i];
    const uint32_t *c = &pair.b->surface->tri[3 * size_t{candidate.feature_b}];
    const Vec3 a = pair.xb(c[0]), b = pair.xb(c[1]), d = pair.xb(c[2]);
    const TrianglePoint t = closest_on_triangle(p, a, b, d);
    const double distance = std::sqrt(t.distance2);
    pair.known.found(i, distance);
    if (!(t.distance2 <= widest * widest)) continue;
    Near *n = place_for(near, count, distance);
    if (!n) continue;
    n->tri = candidate.feature_b;
    n->feature = t.feature;
    n->emitted = false;
    for (int k = 0; k < 3; ++k) n->weight[k] = t.weight[k];
    n->q = t.point;
    n->distance = distance;
    n->normal = normalized(cross(b - a, d - a));
    n->plane = dot(n->normal, p - t.point);
    n->reach = reach_to(v, c);
  }
}

uint32_t Group::nearest() const {
  uint32_t best = 0;
  for (uint32_t i = 1; i < count; ++i)
    if (near[i].distance < near[best].distance) best = i;
  return best;
}

// Does `other` have the edge or corner on which `of` has its closest point?
bool Group::has_feature(const Near &other, const Near &of) const {
  const uint32_t *c = corners(of), *o = corners(other);
  const auto has = [&](uint32_t s) { return o[0] == s || o[1] == s || o[2] == s; };
  const int f = int(of.feature);
  return f >= 4 ? has(c[f - 4]) : has(c[f - 1]) && has(c[f % 3]);
}

bool Group::local_minimum(const Near &n) const {
  if (n.feature == TriangleFeature::face) return true;
  for (uint32_t i = 0; i < count; ++i)
    if (near[i].distance < n.distance * (1 - kNearer) && has_feature(near[i], n)) return false;
  return true;
}

// Not normalized; its side at n's closest point distinguishes inside from outside.
Vec3 Group::outward(const Near &n) const {
  if (n.feature == TriangleFeature::face) return n.normal;
  Vec3 sum;
  const int f = int(n.feature);
  uint32_t i0 = corners(n)[f >= 4 ? f - 4 : f - 1], i1 = corners(n)[f >= 4 ? 0 : f % 3];
  if (f >= 4) {
    double most = -2;
    for (uint32_t i = 0; i < count; ++i) {
      if (!has_feature(near[i], n)) continue;
      for (int k = 0; k < 3; ++k) {
        const uint32_t w = corners(near[i])[k];
        const double c = dot(normalized(pair.xb(w) - n.q), p - n.q);
        if (w == i0 || !(c > most || most == -2)) continue;
        most = c;
        i1 = w;
      }
    }
  }
  for (uint32_t i = 0; i < count; ++i) {
    const uint32_t *c = corners(near[i]);
    if ((c[0] == i0 || c[1] == i0 || c[2] == i0) && (c[0] == i1 || c[1] == i1 || c[2] == i1))
      sum += near[i].normal;
  }
  return sum;
}

// Is p beside an open surface, where there is no inside?
bool Group::beyond_rim(const Near &n) const {
  const Surface &s = *pair.b->surface;
  const int f = int(n.feature);
  if (f == 0) return false;
  if (f < 4) return edge_open(s, s.tri_edge[3 * size_t{n.tri} + f - 1]);
  const uint32_t corner = corners(n)[f - 4];
  for (uint32_t k = s.fan_begin[corner]; k < s.fan_begin[corner + 1]; ++k)
    for (int i = 0; i < 3; ++i) {
      const uint32_t *c = &s.tri[3 * size_t{s.fan[k]}];
      if ((c[i] == corner || c[(i + 1) % 3] == corner) && edge_open(s, s.tri_edge[3 * size_t{s.fan[k]} + i]))
        return true;
    }
  return false;
}

// Was the same closest point made a contact from another triangle, with the same normal?
bool Group::repeated(const Near &n, Vec3 normal) const {
  const double tiny = 1e-9 * pair.b->surface->median_edge;
  const double same = 1e-8 * n.distance * n.distance + tiny * tiny;
  for (uint32_t j = 0; j < count; ++j)
    if (near[j].emitted && norm2(near[j].q - n.q) <= same && norm2(near[j].emitted_normal - normal) <= 1e-6)
      return true;
  return false;
}

// The face at n's feature that the direction to p is least tangent to.
uint32_t Group::steepest(const Near &n) const {
  uint32_t best = uint32_t(&n - near);
  double most = -1;
  for (uint32_t i = 0; i < count; ++i) {
    if (near[i].tri != n.tri && (n.feature == TriangleFeature::face || !has_feature(near[i], n))) continue;
    const double s = std::fabs(dot(near[i].normal, p - n.q));
    if (s > most) {
      most = s;
      best = i;
    }
  }
  return best;
}

// Weights of p's projection on n's plane, negative beyond an edge; false for a triangle without area.
bool Group::plane_weights(const Near &n, double weight[3]) const {
  const uint32_t *c = corners(n);
  const Vec3 a = pair.xb(c[0]), b = pair.xb(c[1]), d = pair.xb(c[2]), normal = cross(b - a, d - a);
  const double nn = norm2(normal);
  if (!(nn > 0) || !(norm2(n.normal) > 0)) return false;
  weight[1] = dot(normal, cross(p - a, d - a)) / nn;
  weight[2] = dot(normal, cross(b - a, p - a)) / nn;
  weight[0] = 1 - weight[1] - weight[2];
  return true;
}

// Does the surface's point lie on the outer side of n's plane? A plane that is extended across a concave edge
// bounds the free space over a point only there: where the surface has turned away behind the plane, a surfel
// passes over that point.
bool Group::faces(const Near &n, Vec3 surface) const {
  const double tiny = 1e-9 * pair.b->surface->median_edge;
  return dot(n.normal, surface - pair.xb(corners(n)[0])) >= -tiny;
}

// Does the surface end between the triangle's edge `across` and p? From triangle to triangle toward p: is
// there a convex edge that p is past? Then p lies beside the surface, as below the front face of a block, not
// in a groove of it.
bool Group::past_border(uint32_t tri, uint32_t across) const {
  const Surface &s = *pair.b->surface;
  for (int steps = 0; steps < kWalk; ++steps) {
    const uint32_t *c = &s.tri[3 * size_t{tri}];
    const Vec3 normal = cross(pair.xb(c[1]) - pair.xb(c[0]), pair.xb(c[2]) - pair.xb(c[0]));
    uint32_t next = kNone;
    for (int k = 0; k < 3; ++k) {
      const uint32_t edge = s.tri_edge[3 * size_t{tri} + k];
      const Vec3 from = pair.xb(c[k]);
      if (edge == across || !(dot(cross(normal, pair.xb(c[(k + 1) % 3]) - from), p - from) < 0)) continue;
      if (edge_convex(s, edge)) return true;
      if (next == kNone) next = edge;
    }
    if (next == kNone) return false;
    const uint32_t *sides = &s.edge_tri[2 * size_t{next}];
    tri = sides[0] == tri ? sides[1] : sides[0];
    across = next;
  }
  return false;
}

// p projects beside the face, across concave edges only and no further than it can travel. Flat edges do not
// count: sliding over them within the reach costs less than a tenth of the rest distance.
bool Group::reachable_across(const Near &n, double weight[3]) const {
  if (!plane_weights(n, weight)) return false;
  const Surface &s = *pair.b->surface;
  const uint32_t *c = corners(n);
  const double area2 = norm(cross(pair.xb(c[1]) - pair.xb(c[0]), pair.xb(c[2]) - pair.xb(c[0])));
  bool across = false;
  for (int k = 0; k < 3; ++k) {  // edge k faces corner k + 2
    const double w = weight[(k + 2) % 3];
    if (w >= 0) continue;
    const uint32_t from = c[k], to = c[(k + 1) % 3];
    const Vec3 along = pair.xb(to) - pair.xb(from);
    const double length = norm(along);
    if (!(-w * area2 <= n.reach * length)) return false;
    const uint32_t *sides = &s.edge_tri[2 * size_t{s.tri_edge[3 * size_t{n.tri} + k]}];
    const uint32_t beyond = sides[0] == n.tri ? sides[1] : sides[0];
    if (beyond == kNone) return false;
    Vec3 o;
    for (int i = 0; i < 3; ++i)
      if (const uint32_t v = s.tri[3 * size_t{beyond} + i]; v != from && v != to)
        o = pair.xb(v) - pair.xb(from);
    // rise / height: sine of the fold
    const double rise = dot(n.normal, o) * length, height = norm(cross(along, o));
    if (!(rise * n.reach > 0.1 * pair.offset * height)) return false;
    // A cut leaves convex edges everywhere, and planes beyond them hold its teeth.
    if (!s.slit && past_border(beyond, s.tri_edge[3 * size_t{n.tri} + k])) return false;
    across = true;
  }
  return across;
}

void Group::emit(Near &n, Vec3 normal, double distance, const double weight[3],
                 Array<ContactPoint> &out) const {
  ContactPoint c = blank(pair, kVertexFace, 0, surfel, n.tri);
  add_node(c, pair.a.first_node + surfel, 1);
  for (int k = 0; k < 3; ++k) add_node(c, pair.b->first_node + corners(n)[k], -weight[k]);
  place(c, p, p - distance * normal, normal, distance);
  c.area = 0.5 * facing_area(*pair.a.surface, surfel, -normal);
  if (rests(pair, n.reach, c)) out.push_back(c);
  n.emitted = true;
  n.emitted_normal = normal;
}

void Group::resolve(Array<ContactPoint> &out) {
  const Near &best = near[nearest()];
  const double tiny = 1e-9 * pair.b->surface->median_edge;
  const bool inside = dot(outward(best), p - best.q) < 0 && !beyond_rim(best);
  uint32_t deepest = kNone;  // of the faces that p is behind, the one it is least deep below
  double weight[3];
  for (uint32_t i = 0; i < count; ++i) {
    Near &n = near[i];
    if (n.feature == TriangleFeature::face) {
      if (n.plane >= 0) {
        if (n.plane < n.reach && !repeated(n, n.normal)) emit(n, n.normal, n.plane, n.weight, out);
      } else if (inside && -n.plane <= depth && (deepest == kNone || n.plane > near[deepest].plane)) {
        deepest = i;
      }
      continue;
    }
    bool rim = n.distance < n.reach && local_minimum(n);
    if (rim) {
      const Vec3 out_here = outward(n);
      rim = norm2(out_here) > 0 && (n.distance <= tiny || dot(out_here, p - n.q) > 0);
      const Vec3 normal = n.distance > tiny ? (1 / n.distance) * (p - n.q) : normalized(out_here);
      const bool first = n.distance <= tiny || vertex_cone_has(*pair.a.surface, surfel, -normal);
      if (rim && first && !repeated(n, normal)) emit(n, normal, n.distance, n.weight, out);
    }
    if (!rim && std::fabs(n.plane) < n.reach && (inside || n.plane >= 0) && faces(n, best.q) &&
        reachable_across(n, weight))
      emit(n, n.normal, n.plane, weight, out);
  }
  if (!inside) return;
  const uint32_t steep = steepest(best);
  if (deepest != kNone) {
    emit(near[deepest], near[deepest].normal, near[deepest].plane, near[deepest].weight, out);
  } else if (best.distance <= depth && best.feature != TriangleFeature::face && !near[steep].emitted &&
             plane_weights(near[steep], weight)) {
    // Nearest is a concave edge or a saddle: its steepest face, extended, leads out.
    emit(near[steep], near[steep].normal, near[steep].plane, weight, out);
  }
}

}  // namespace

void name_contacts(const Pair &pair, size_t begin, Array<ContactPoint> &out) {
  const Surface &b = *pair.b->surface;
  const auto patch = [&](const ContactPoint &c) { return patch_of(b, c.kind, c.feature_b); };
  for (size_t i = begin, end = begin; i < out.size(); i = end) {
    uint32_t touching = 0;
    for (; end < out.size() && out[end].type_a == out[i].type_a && out[end].feature_a == out[i].feature_a;
         ++end)
      touching += out[end].distance < 2 * pair.offset;
    for (size_t k = i; k < end; ++k) {
      uint32_t ordinal = 0;
      for (size_t j = i; j < k; ++j) ordinal += patch(out[j]) == patch(out[k]);
      out[k].key = contact_key(out[k], *pair.a.surface, pair.a.id, &b, pair.b->id, patch(out[k]), ordinal);
      if (out[k].distance < 2 * pair.offset) out[k].area /= touching;
    }
  }
}

void vertex_face(const Pair &pair, Run run, Array<ContactPoint> &out) {
  Group group(pair);
  const double widest = std::max(contact_reach(pair.h, pair.offset, pair.known.speed), group.depth);
  for (size_t i = 0; i < run.size();) {
    if (pair.known.beyond(i, widest)) {
      ++i;
      continue;
    }
    size_t end = i + 1;
    while (end < run.size() && run[end].feature_a == run[i].feature_a) ++end;
    group.surfel = run[i].feature_a;
    group.p = pair.xa(group.surfel);
    group.collect(run, i, end);
    i = end;
    if (!group.count) continue;
    const size_t begin = out.size();
    group.resolve(out);
    std::sort(out.begin() + begin, out.end(),
              [](const ContactPoint &l, const ContactPoint &r) { return l.feature_b < r.feature_b; });
    name_contacts(pair, begin, out);
  }
}

}  // namespace dfm::narrow
