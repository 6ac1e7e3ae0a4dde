// A surfel p against the other triangles of its own surface, and edges against edges.
//
//        p                The surface around p is at distance 0 of it, so a triangle's nearest point is a
//    ____|\____    /      minimum of the distance only if no triangle beside it (those of p among them) is
//              \__/ F     nearer. Flat and convex parts have no such minima, however fine they are.
//
// In a fold the nearest point lies inside a face, over an edge or over a corner, as between two bodies.
//
// Every near pair is also compared with the rest shape:
//   - Its rest gap is o = min(d_c, half of its distance at rest) instead of d_c: features that are near each
//     other at rest, as in a sharp fold, have no contact force there.
//   - Near features that face each other through the material at rest are the two sides of something thin.
//     They are kept apart from inside, by the same rule for the surface turned inside out: what passed there
//     would invert cells. Seen from outside they make no contact, which would hold them in that state.
//   - The side is that of the rest shape, so a feature slightly on the wrong side is led back. Near features
//     that lie beside each other in one plane may fold either way: their side is the present one.
//
// The two sides of an open face (a cut) coincide at rest. Each is seen d_c / 2 further back
// (geometry/surface.h), so they are d_c apart and touch as two bodies do. Two copies of one point that have
// not slid apart make one contact, along the normal of the faces that were joined at them. The features
// around them make none, because that contact holds them; from there to where the copies have slid apart,
// features rest where the material touches, less what is left to the copies (body/self_rest.h,
// doc/decisions/cutting.md).
#include "narrow/self_contact.h"

#include <algorithm>
#include <initializer_list>
#include <span>

#include "geometry/area.h"
#include "geometry/closest.h"
#include "narrow/detail.h"

namespace dfm {
namespace {

using namespace narrow;

// Sine of the fold at the positions x + ahead v: negative where the edge is convex; an open edge is as convex
// as can be (geometry/convex.h).
double fold(const Surface &s, uint32_t edge, double ahead) {
  if (edge_open(s, edge)) return -1;
  const Fold f = fold_of(s, edge, ahead);
  return f.size2 > 0 ? -f.value * std::sqrt(f.e2) / std::sqrt(f.size2) : 0;
}

// relative: a triangle beside the feature counts as nearer only beyond this
constexpr double kNearer = 1e-9;
// cosine to the outward normal beyond which a pair at rest looks through the material, or away from it
constexpr double kThrough = 0.25;

constexpr double kDeep = 1e-2;     // of the median edge: what is less deep is held by all faces
constexpr double kOpposed = -0.5;  // cosine between normals that push against each other

using Kin = PairAtRest;

class RestShape {
 public:
  RestShape(const Surface &surface, const SelfRest &rest, double offset)
      : s_(surface), rest_(rest), offset_(offset) {}

  const OpenedSurface &opened() const { return rest_.opened; }
  Kin of_face(uint32_t surfel, uint32_t t) const {
    const uint32_t *const c = &s_.tri[3 * size_t{t}];
    const Vec3 p = rest_.at(surfel), a = rest_.at(c[0]), b = rest_.at(c[1]), d = rest_.at(c[2]);
    const TrianglePoint q = closest_on_triangle(p, a, b, d);
    const double distance = std::sqrt(q.distance2);
    const std::span<const uint32_t> fan{s_.fan.data() + s_.fan_begin[surfel],
                                        s_.fan.data() + s_.fan_begin[surfel + 1]};
    if (across({&surfel, 1}, fan, {c, 3}, {&t, 1}, distance)) {
      const double back = s_.back;
      const Vec3 o = rest_.at(surfel, back);
      return outside(
          closest_on_triangle(o, rest_.at(c[0], back), rest_.at(c[1], back), rest_.at(c[2], back)).distance2);
    }
    return kin(distance, dot(normalized(cross(b - a, d - a)), p - q.point) / distance);
  }
  Kin of_edges(uint32_t a, uint32_t b) const {
    const uint32_t *const ea = &s_.edge[2 * size_t{a}], *const eb = &s_.edge[2 * size_t{b}];
    const Vec3 a0 = rest_.at(ea[0]), a1 = rest_.at(ea[1]), b0 = rest_.at(eb[0]), b1 = rest_.at(eb[1]);
    const SegmentPoints at = closest_segments(a0, a1, b0, b1);
    const Vec3 way = a0 + at.s * (a1 - a0) - (b0 + at.t * (b1 - b0));
    Vec3 up;
    for (const uint32_t t : {s_.edge_tri[2 * size_t{b}], s_.edge_tri[2 * size_t{b} + 1]}) {
      if (t == kNone) continue;
      const uint32_t *const c = &s_.tri[3 * size_t{t}];
      up += normalized(cross(rest_.at(c[1]) - rest_.at(c[0]), rest_.at(c[2]) - rest_.at(c[0])));
    }
    const double distance = norm(way);
    if (across({ea, 2}, {&s_.edge_tri[2 * size_t{a}], 2}, {eb, 2}, {&s_.edge_tri[2 * size_t{b}], 2},
               distance)) {
      const double back = s_.back;
      return outside(closest_segments(rest_.at(ea[0], back), rest_.at(ea[1], back), rest_.at(eb[0], back),
                                      rest_.at(eb[1], back))
                         .distance2);
    }
    return kin(distance, dot(normalized(up), way) / distance);
  }

 private:
  // Whether a pair without copies, of a body with open faces, is on different sides of one, or has one in
  // between. tris: the triangles around the features.
  bool across(std::span<const uint32_t> a, std::span<const uint32_t> tris_a, std::span<const uint32_t> b,
              std::span<const uint32_t> tris_b, double at_rest) const {
    const OpenedSurface &opened = rest_.opened;
    if (!opened.any()) return false;
    bool a_beside = false, b_beside = false;
    for (const uint32_t t : tris_a) {
      const uint32_t side = t == kNone ? kNone : opened.side[t];
      a_beside = a_beside || side != kNone;
      for (const uint32_t u : tris_b) {
        if (u == kNone || opened.side[u] == kNone) continue;
        b_beside = true;
        if (side == opened.side[u]) return false;
      }
    }
    if ((a_beside && b_beside) || at_rest >= rest_.thin) return true;
    for (const uint32_t i : a)
      for (const uint32_t j : b)
        if (opened.joined(i, j)) return false;
    return true;
  }
  Kin outside(double at_rest2) const {
    Kin k;
    k.apart = std::min(offset_, std::sqrt(at_rest2));
    k.side = 1;
    k.known = true;
    return k;
  }
  // By the distance at rest and the cosine between the way across and the outward normal there.
  Kin kin(double at_rest, double facing) const {
    Kin k;
    k.known = true;
    k.touches = at_rest > kClosedAtRest * offset_;
    if (!k.touches) return k;
    k.apart = std::min(offset_, 0.5 * at_rest);
    k.side = at_rest >= rest_.thin || facing > kThrough ? 1 : facing < -kThrough ? -1 : 0;
    return k;
  }
  const Surface &s_;
  const SelfRest &rest_;
  double offset_;
};

struct Self {
  const BodyView &body;
  const Surface &s;
  RestShape rest;
  double h, offset, depth, edge_depth;  // depth: m, recovery
  const Tangled &tangled;
  const Array<CopiesNow> &copies_now;
  const Array<double> &slack;
  Pair pair;
  Array<ContactPoint> &out;

  Self(const BodyView &b, const SelfRest &r, double step, double d_c, const Tangled &t,
       const SelfPairs &pairs, Array<ContactPoint> &to)
      : body(b),
        s(*b.surface),
        rest(s, r, d_c),
        h(step),
        offset(d_c),
        depth(self_recovery_depth(s)),
        edge_depth(edge_recovery_depth(s, s)),
        tangled(t),
        copies_now(pairs.copies),
        slack(pairs.slack),
        pair{b, &b, nullptr, step, d_c, 0},
        out(to) {}

  // Whether features on the wrong side of each other really cross.
  bool through(std::initializer_list<uint32_t> a, std::initializer_list<uint32_t> b) const {
    return !tangled || (std::any_of(a.begin(), a.end(), tangled) && std::any_of(b.begin(), b.end(), tangled));
  }
  Vec3 x(uint32_t surfel) const { return pair.xa(surfel); }
  Vec3 place(uint32_t surfel) const { return load3(&s.place[4 * size_t{surfel}]); }  // not set back
  Vec3 v(uint32_t surfel) const { return pair.va(surfel); }
  const uint32_t *corners(uint32_t t) const { return &s.tri[3 * size_t{t}]; }
  bool has(uint32_t t, uint32_t surfel) const {
    const uint32_t *const c = corners(t);
    return c[0] == surfel || c[1] == surfel || c[2] == surfel;
  }
  TrianglePoint closest(uint32_t t, Vec3 p) const {
    return closest_on_triangle(p, x(corners(t)[0]), x(corners(t)[1]), x(corners(t)[2]));
  }
  Vec3 normal(uint32_t t) const {
    const uint32_t *const c = corners(t);
    return normalized(cross(x(c[1]) - x(c[0]), x(c[2]) - x(c[0])));
  }

  void copies(uint32_t surfel, uint32_t t);
  bool held(const Kin &k) const;
  double rests_at(const Kin &k, double set_back) const;
  void keep_shallow(size_t begin);
  bool defers_to(uint32_t t, double distance2, uint32_t other, uint32_t surfel) const;
  bool minimum(uint32_t surfel, uint32_t t, const TrianglePoint &at) const;
  Vec3 outward(uint32_t surfel, uint32_t t, const TrianglePoint &at) const;
  // Opened: the body has open faces. Then `kept` is the state of the pair at rest, stored here once.
  // Otherwise it is null, and the state at rest is computed for the few pairs that are near, so that bodies
  // without cuts store nothing.
  template <bool Opened>
  void vertex_face(uint32_t surfel, uint32_t t, Kin *kept);
  template <bool Opened>
  void edge_edge(uint32_t a, uint32_t b, Kin *kept);
  template <bool Opened>
  void find(SelfPairs &pairs, Array<uint8_t> &lent);
  void share_areas(size_t begin, size_t edges, Array<uint8_t> &lent);
};

// Whether t leaves the feature that it shares with `other` to it, because p belongs to `other`, or is nearer
// to it, or over its face, or because `other` comes first.
bool Self::defers_to(uint32_t t, double distance2, uint32_t other, uint32_t surfel) const {
  if (has(other, surfel)) return true;
  const TrianglePoint o = closest(other, x(surfel));
  if (o.distance2 < distance2 * (1 - kNearer)) return true;
  return o.distance2 <= distance2 * (1 + kNearer) && (o.feature == TriangleFeature::face || other < t);
}

bool Self::minimum(uint32_t surfel, uint32_t t, const TrianglePoint &at) const {
  const int f = int(at.feature);
  if (f == 0) return true;
  if (f < 4) {
    const uint32_t *const sides = &s.edge_tri[2 * size_t{s.tri_edge[3 * size_t{t} + size_t(f - 1)]}];
    const uint32_t beyond = sides[0] == t ? sides[1] : sides[0];
    return beyond == kNone || !defers_to(t, at.distance2, beyond, surfel);
  }
  const uint32_t corner = corners(t)[f - 4];
  for (uint32_t k = s.fan_begin[corner]; k < s.fan_begin[corner + 1]; ++k)
    if (s.fan[k] != t && defers_to(t, at.distance2, s.fan[k], surfel)) return false;
  return true;
}

// Not normalized. The side of its plane at the closest point separates outside from inside. At a corner, that
// of the edge there which points most to p.
Vec3 Self::outward(uint32_t surfel, uint32_t t, const TrianglePoint &at) const {
  const int f = int(at.feature);
  if (f == 0) return normal(t);
  uint32_t edge = kNone;
  if (f < 4) {
    edge = s.tri_edge[3 * size_t{t} + size_t(f - 1)];
  } else {
    const uint32_t corner = corners(t)[f - 4];
    const Vec3 to = x(surfel) - x(corner);
    double most = 0;
    for (uint32_t k = s.fan_begin[corner]; k < s.fan_begin[corner + 1]; ++k)
      for (uint32_t i = 0; i < 3; ++i) {
        const uint32_t e = s.tri_edge[3 * size_t{s.fan[k]} + i], *const ends = &s.edge[2 * size_t{e}];
        if (ends[0] != corner && ends[1] != corner) continue;
        const double c = dot(normalized(x(ends[0] == corner ? ends[1] : ends[0]) - x(corner)), to);
        if (edge == kNone || c > most) {
          edge = e;
          most = c;
        }
      }
  }
  Vec3 sum;
  for (const uint32_t side : {s.edge_tri[2 * size_t{edge}], s.edge_tri[2 * size_t{edge} + 1]})
    if (side != kNone) sum += normal(side);
  return sum;
}

// A surfel that is behind two faces which push in opposite directions, as in the tip of a cell, leaves
// through the nearer one. Contacts of a surfel are neighbors in the list.
void Self::keep_shallow(size_t begin) {
  const auto depth_of = [&](const ContactPoint &c) { return offset - c.distance; };
  const double clearly = kDeep * s.median_edge;
  const auto opposed = [&](const ContactPoint &c, const ContactPoint &d) {
    return depth_of(d) > 0 && depth_of(c) > std::max(clearly, depth_of(d)) &&
           dot(load3(c.normal), load3(d.normal)) < kOpposed;
  };
  std::vector<uint8_t> goes(out.size() - begin);
  for (size_t i = begin; i < out.size(); ++i)
    for (size_t j = i; j-- > begin && out[j].feature_a == out[i].feature_a;) {
      if (opposed(out[i], out[j])) goes[i - begin] = 1;
      if (opposed(out[j], out[i])) goes[j - begin] = 1;
    }
  size_t to = begin;
  for (size_t i = begin; i < out.size(); ++i)
    if (!goes[i - begin]) out[to++] = out[i];
  out.resize(to);
}

// The contact of two copies of a point that have not slid along each other.
void Self::copies(uint32_t surfel, uint32_t t) {
  const OpenedSurface &opened = rest.opened();
  for (uint32_t k = opened.copies_begin[surfel]; k < opened.copies_begin[surfel + 1]; ++k) {
    if (opened.copies[k].first != t) continue;
    const uint32_t other = opened.copies[k].b;
    const CopiesNow &now = copies_now[k];
    if (!(now.slip < kNearCopies * offset)) return;
    const double distance = now.gap;
    const double reach = contact_reach(h, offset, norm(v(surfel) - v(other)));
    if (!(distance < reach && distance >= -depth)) return;
    ContactPoint contact = blank(pair, kVertexFace, 0, surfel, t);
    add_node(contact, body.first_node + surfel, 1);
    add_node(contact, body.first_node + other, -1);
    narrow::place(contact, x(surfel), x(other), now.normal, distance + offset);
    contact.area = 0.5 * facing_area(s, surfel, -now.normal);
    out.push_back(contact);
    return;
  }
}

// Do the copies among the corners hold the pair for the whole sub-step (SelfPairs::slack)?
bool Self::held(const Kin &k) const {
  for (const uint32_t c : k.copies)
    if (c != kNone && !(slack[c] > 2 * h * copies_now[c].speed)) return false;
  return k.beside();
}

// m, set back: the distance at which a pair beside copies rests. It is what setting back has added along
// the normal, so that the material touches, less what is left to them.
double Self::rests_at(const Kin &k, double set_back) const {
  double apart = HUGE_VAL;
  for (const uint32_t c : k.copies)
    if (c != kNone) apart = std::min(apart, copies_now[c].apart);
  return rest_beside(set_back, apart, offset);
}

template <bool Opened>
void Self::vertex_face(uint32_t surfel, uint32_t t, Kin *kept) {
  if constexpr (Opened) {
    copies(surfel, t);
    if (held(*kept)) return;
  }
  const uint32_t *const c = corners(t);
  const Vec3 p = x(surfel), a = x(c[0]), u = x(c[1]) - a, w = x(c[2]) - a, n = cross(u, w);
  double speed2 = 0;
  for (int i = 0; i < 3; ++i) speed2 = std::max(speed2, norm2(v(surfel) - v(c[i])));
  const double reach = contact_reach(h, offset, std::sqrt(speed2));
  const double widest = std::max(reach, depth);
  const double along = dot(n, p - a);
  const double nn = norm2(n);
  if (along * along > widest * widest * (1 + kNearer) * nn && nn > 1e-12 * norm2(u) * norm2(w)) return;
  if constexpr (Opened) {
    if (!kept->known) *kept = rest.of_face(surfel, t);
    if (!kept->touches) return;
  }
  const TrianglePoint at = closest(t, p);
  if (!(at.distance2 < widest * widest) || !minimum(surfel, t, at)) return;
  const Kin k = Opened ? *kept : rest.of_face(surfel, t);
  if (!k.touches) return;
  const bool face = at.feature == TriangleFeature::face;
  const Vec3 up = outward(surfel, t, at);
  const double distance = std::sqrt(at.distance2), now = (face ? along : dot(up, p - at.point)) < 0 ? -1 : 1;
  const bool beside = Opened && k.beside();
  double side = k.side != 0 ? k.side : now;
  if (!beside && now != side && face && distance <= depth && !through({surfel}, {c[0], c[1], c[2]}))
    side = now;
  if (!face && !(distance > 1e-9 * s.median_edge)) return;
  Vec3 normal = face ? side * up : (1 / distance) * (p - at.point);
  if (!(norm2(normal) > 0)) return;
  double back = 0;
  if (beside) {
    Vec3 way = p - place(surfel);
    for (int i = 0; i < 3; ++i) way -= at.weight[i] * (x(c[i]) - place(c[i]));
    back = dot(normal, way);
  }
  const double apart = beside ? rests_at(k, back) : k.apart;
  // within the rounding of the set-back faces, a feature behind one need not have crossed it
  if (beside && now != side && face && distance <= depth && -distance < apart - offset &&
      !through({surfel}, {c[0], c[1], c[2]}))
    return;
  const double within = beside ? apart + reach - 2 * offset : reach;
  if (!(now == side ? distance < within : face && distance <= depth && -distance < within)) return;
  ContactPoint contact = blank(pair, kVertexFace, 0, surfel, t);
  add_node(contact, body.first_node + surfel, 1);
  for (int i = 0; i < 3; ++i) add_node(contact, body.first_node + c[i], -at.weight[i]);
  narrow::place(contact, p, at.point, normal, (now == side ? distance : -distance) + (offset - apart));
  contact.area = 0.5 * facing_area(s, surfel, -side * normal);
  out.push_back(contact);
}

// As narrow/edge_edge.cpp, of one surface; from within, with the surface turned inside out.
template <bool Opened>
void Self::edge_edge(uint32_t a, uint32_t b, Kin *kept) {
  if (Opened && held(*kept)) return;
  const uint32_t *const ea = &s.edge[2 * size_t{a}], *const eb = &s.edge[2 * size_t{b}];
  const Vec3 p0 = x(ea[0]), u = x(ea[1]) - p0, q0 = x(eb[0]), w = x(eb[1]) - q0, r = p0 - q0, n = cross(u, w);
  const double uu = norm2(u), ww = norm2(w), nn = norm2(n), nr = dot(n, r);
  if (!(nn > kParallel * kParallel * uu * ww)) return;
  const double uw = dot(u, w);
  const double ur = dot(u, r);
  const double wr = dot(w, r);
  const double past_a = uw * wr - ww * ur;
  const double past_b = uu * wr - uw * ur;
  if (!(past_a > -kPast * nn && past_a < (1 + kPast) * nn && past_b > -kPast * nn &&
        past_b < (1 + kPast) * nn))
    return;
  const double on_a = past_a / nn, on_b = past_b / nn;
  double speed2 = 0;
  for (int i = 0; i < 2; ++i)
    for (int j = 0; j < 2; ++j) speed2 = std::max(speed2, norm2(v(ea[i]) - v(eb[j])));
  const double reach = contact_reach(h, offset, std::sqrt(speed2)), widest = std::max(reach, edge_depth);
  if (!(nr * nr < widest * widest * nn)) return;
  // Setting back moves the ends of edges beside copies by as much as may leave crossings to them.
  const bool beside = Opened && kept->beside();
  const auto nowhere = [&](int place) { return beside ? place == kNowhere : place != kBetween; };
  if (nowhere(place_on_edge(on_a, 2 * h * std::sqrt(speed2 / uu))) ||
      nowhere(place_on_edge(on_b, 2 * h * std::sqrt(speed2 / ww))))
    return;
  const Vec3 velocity = v(ea[0]) + on_a * (v(ea[1]) - v(ea[0])) - (v(eb[0]) + on_b * (v(eb[1]) - v(eb[0])));
  if (!slides_in(p0, u, q0, w, on_a, on_b, velocity, h, reach)) return;
  if (Opened && !kept->known) *kept = rest.of_edges(a, b);
  const Kin k = Opened ? *kept : rest.of_edges(a, b);
  if (!k.touches) return;
  // An edge that is flat folds out where the impact bends its faces, by what they may move against each other
  // within the sub-step.
  const double bent = std::min(0.3, 2 * h * std::sqrt(speed2 / std::min(uu, ww))) - kConvex;
  const auto sticks_out = [&](uint32_t e, double side) {
    return side * fold(s, e, 0) < bent || side * fold(s, e, 2 * h) < bent;
  };
  const bool outside = k.side >= 0 && sticks_out(a, 1) && sticks_out(b, 1);
  const bool within = !outside && k.side <= 0 && sticks_out(a, -1) && sticks_out(b, -1);
  if (!(outside || within)) return;
  const EdgeFaces fa = edge_faces(s, a), fb = edge_faces(s, b);
  const Vec3 up_a = within ? -fa.outward() : fa.outward(), up_b = within ? -fb.outward() : fb.outward();
  Vec3 normal = (1 / std::sqrt(nn)) * n;
  if (dot(normal, up_b) < dot(normal, up_a)) normal = -normal;
  const double distance = dot(normal, r);
  const auto way = [&](uint32_t surfel) { return x(surfel) - place(surfel); };
  const double back = beside ? dot(normal, (1 - on_a) * way(ea[0]) + on_a * way(ea[1]) -
                                               (1 - on_b) * way(eb[0]) - on_b * way(eb[1]))
                             : 0;
  const double apart = beside ? rests_at(k, back) : k.apart;
  if (!(distance < (beside ? apart + reach - 2 * offset : reach) && distance >= -edge_depth) ||
      (distance < (beside ? apart - offset : 0) && !through({ea[0], ea[1]}, {eb[0], eb[1]})))
    return;
  const double open = kCone + std::min(0.3, reach / std::sqrt(std::min(uu, ww)));
  if (!fb.leans_out(normal, open) || !fa.leans_out(-normal, open)) return;
  ContactPoint c = blank(pair, kEdgeEdge, 1, a, b);
  add_node(c, body.first_node + ea[0], 1 - on_a);
  add_node(c, body.first_node + ea[1], on_a);
  add_node(c, body.first_node + eb[0], on_b - 1);
  add_node(c, body.first_node + eb[1], -on_b);
  narrow::place(c, p0 + on_a * u, q0 + on_b * w, normal, distance + (offset - apart));
  out.push_back(c);
}

// An edge contact takes over the area of the nearest of its ends that has no contact of its own; none
// is given twice.
void Self::share_areas(size_t begin, size_t edges, Array<uint8_t> &lent) {
  if (edges == out.size()) return;
  lent.assign(s.nsurfel, 0);
  for (size_t i = begin; i < edges; ++i) lent[out[i].feature_a] = 1;
  for (size_t i = edges; i < out.size(); ++i) {
    ContactPoint &c = out[i];
    const auto owner = [&](int k) {
      return AreaOwner{body, c.weight[k] > 0 ? -load3(c.normal) : load3(c.normal)};
    };
    take_area(c, 0.5, owner, body.first_node, lent);
  }
}

template <bool Opened>
void Self::find(SelfPairs &pairs, Array<uint8_t> &lent) {
  const size_t begin = out.size();
  // copies are known by their places, not by where they are set back
  const double within = Opened ? HUGE_VAL : pairs.within;
  const std::span<const SelfPair> vf = pairs.vertex_face, ee = pairs.edge_edge;
  for (size_t i = 0; i < vf.size(); ++i)
    if (vf[i].apart < within) vertex_face<Opened>(vf[i].a, vf[i].b, Opened ? &pairs.of_face[i] : nullptr);
  if constexpr (Opened) keep_shallow(begin);
  const size_t edges = out.size();
  for (size_t i = 0; i < ee.size(); ++i)
    if (ee[i].apart < within) edge_edge<Opened>(ee[i].a, ee[i].b, Opened ? &pairs.of_edges[i] : nullptr);
  name_contacts(pair, begin, out);
  share_areas(begin, edges, lent);
}

// Pairs with copies of one point among their corners.
void find_copies(const OpenedSurface &opened, std::span<const uint32_t> a, std::span<const uint32_t> b,
                 PairAtRest &out) {
  uint32_t n = 0;
  for (const uint32_t i : a)
    for (const uint32_t j : b)
      if (opened.origin[i] == opened.origin[j] && n < 2) out.copies[n++] = opened.copies_of(i, j);
  if (n == 0) return;
  out.side = 1;
  out.known = true;
}

}  // namespace

void SelfPairs::follow(const Surface &s, const SelfRest &rest, uint64_t list, double d_c) {
  const OpenedSurface &opened = rest.opened;
  if (renewals != list || offset != d_c) {
    renewals = 0;  // until the arrays are complete: an allocation may fail
    if (opened.any()) {
      of_face.assign(vertex_face.size(), {});
      of_edges.assign(edge_edge.size(), {});
      for (size_t i = 0; i < of_face.size(); ++i)
        find_copies(opened, {&vertex_face[i].a, 1}, {&s.tri[3 * size_t{vertex_face[i].b}], 3}, of_face[i]);
      for (size_t i = 0; i < of_edges.size(); ++i)
        find_copies(opened, {&s.edge[2 * size_t{edge_edge[i].a}], 2},
                    {&s.edge[2 * size_t{edge_edge[i].b}], 2}, of_edges[i]);
    }
    copies.resize(opened.copies.size());
    slack.resize(copies.size());
    renewals = list;
    offset = d_c;
  }
  const auto at = [&](uint32_t surfel) { return load3(&s.place[4 * size_t{surfel}]); };
  const auto area = [&](uint32_t t) {
    const uint32_t *const c = &s.tri[3 * size_t{t}];
    const Vec3 a = load3(&s.x[4 * size_t{c[0]}]);
    return cross(load3(&s.x[4 * size_t{c[1]}]) - a, load3(&s.x[4 * size_t{c[2]}]) - a);
  };
  for (size_t k = 0; k < copies.size(); ++k) {
    const auto [a, b, first] = opened.copies[k];
    CopiesNow &now = copies[k];
    const Vec3 way = at(a) - at(b);
    const double apart2 = norm2(way);
    now.apart = now.slip = std::sqrt(apart2);
    const Vec3 v = load3(&s.v[4 * size_t{a}]) - load3(&s.v[4 * size_t{b}]);
    now.speed = norm(v);
    slack[k] = kLeftToCopies * offset - now.apart;
    if (first == kNone) continue;
    Vec3 up;
    double least = HUGE_VAL;
    for (uint32_t f = s.fan_begin[b]; f < s.fan_begin[b + 1]; ++f) {
      const uint32_t t = s.fan[f], twin = opened.twin[t];
      if (twin == kNone) continue;
      const uint32_t *const c = &s.tri[3 * size_t{twin}];
      if (c[0] != a && c[1] != a && c[2] != a) continue;
      const Vec3 n = area(t), m = area(twin);
      up += n - m;
      least = std::min({least, dot(normalized(n), way), -dot(normalized(m), way)});
    }
    now.normal = normalized(up);
    now.gap = dot(now.normal, way);
    if (std::fabs(now.gap) < kNearer * offset) now.gap = 0;
    now.slip = norm2(now.normal) > 0 ? norm(way - now.gap * now.normal) : HUGE_VAL;
    if (!(now.slip < kNearCopies * offset)) continue;
    // their own contact takes the rest
    now.speed = norm(v - std::min(0.0, dot(now.normal, v)) * now.normal);
    slack[k] =
        std::max(slack[k], std::min(0.5 * kLeftToCopies * offset + least, kNearCopies * offset - now.apart));
  }
}

void find_self_contacts(const BodyView &body, const SelfRest &rest, double h, double offset,
                        const Tangled &tangled, SelfPairs &pairs, Array<uint8_t> &lent,
                        Array<ContactPoint> &out) {
  Self self(body, rest, h, offset, tangled, pairs, out);
  if (rest.opened.any()) self.find<true>(pairs, lent);
  else self.find<false>(pairs, lent);
}

double self_apart(const Surface &surface, const SelfRest &rest, ContactKind kind, uint32_t a, uint32_t b,
                  double offset) {
  if (rest.opened.any()) {
    const std::span<const uint32_t> ca = kind == kEdgeEdge ? std::span(&surface.edge[2 * size_t{a}], 2)
                                                           : std::span<const uint32_t>(&a, 1),
                                    cb = kind == kEdgeEdge ? std::span(&surface.edge[2 * size_t{b}], 2)
                                                           : std::span(&surface.tri[3 * size_t{b}], 3);
    PairAtRest k;
    find_copies(rest.opened, ca, cb, k);
    if (k.beside()) return offset;
  }
  const RestShape shape(surface, rest, offset);
  const Kin k = kind == kEdgeEdge ? shape.of_edges(a, b) : shape.of_face(a, b);
  return k.apart;
}

}  // namespace dfm
