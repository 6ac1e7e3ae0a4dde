// Two edges cross over each other: closest points of their lines n . r / |n| with n = u x w, both inside the
// edges, both edges convex, and the direction inside both cones of normals. The faces beside the edges give
// the sign, so that edges which have slipped through each other by a little are pushed back the way they
// came.
//
// Edges that bore each other in the last sub-step count on, convex or not, within their cones of normals: the
// load itself presses them flat and a little hollow, and left out there they would lose it, spring back and
// be hit again, for ever (doc/decisions/friction_memory.md). Between hollow edges the lines are further
// apart than the surfaces, so such a contact keeps nothing away that the others would let come.
#include <algorithm>
#include <cmath>

#include "geometry/closest.h"
#include "narrow/detail.h"

namespace dfm::narrow {

EdgeFaces edge_faces(const Surface &surface, uint32_t edge) {
  const uint32_t *ends = &surface.edge[2 * size_t{edge}], *tris = &surface.edge_tri[2 * size_t{edge}];
  const auto x = [&](uint32_t s) { return load3(&surface.x[4 * size_t{s}]); };
  EdgeFaces f{};
  f.along = normalized(x(ends[1]) - x(ends[0]));
  for (int k = 0; k < 2; ++k) {
    if (tris[k] == kNone) continue;
    const uint32_t *c = &surface.tri[3 * size_t{tris[k]}];
    f.normal[k] = normalized(cross(x(c[1]) - x(c[0]), x(c[2]) - x(c[0])));
    // The first face has the edge as i to j, so inward lies to its left; the second has it as j to i.
    f.inward[k] = (k == 0 ? 1.0 : -1.0) * cross(f.normal[k], f.along);
  }
  return f;
}

// Where the crossing at `at` (0 and 1: the ends) lies on an edge: kNowhere on it, between its ends, or so
// close to one of them that the end itself may make the contact (vertex-face); a second one in the same place
// with nearly the same normal would only make the solve ill-conditioned. Where the crossing may slide over an
// end within the sub-step (by `slide`, in lengths of the edge), the edge counts as that much longer, for
// slides_in() to decide.
int place_on_edge(double at, double slide) {
  if (slide > kEnd) {
    const double margin = std::min(slide, kPast);
    return at > -margin && at < 1 + margin ? kBetween : kNowhere;
  }
  if (!(at > 0 && at < 1)) return kNowhere;
  return at <= kEnd ? 0 : at >= 1 - kEnd ? 1 : kBetween;
}

// Edges whose crossing moves in over an end would be through each other before they were seen. Edges that
// pass each other, however near, must not touch. Lists of candidates hold edges that are within reach.
bool slides_in(Vec3 p0, Vec3 u, Vec3 q0, Vec3 w, double s, double t, Vec3 v, double h, double reach) {
  const auto on = [](double at) { return at >= 0 && at <= 1; };
  if (on(s) && on(t)) return true;
  const double uw = dot(u, w), uv = dot(u, v), wv = dot(w, v), ahead = 2 * h / norm2(cross(u, w));
  const auto comes = [&](double at, double way) { return on(at) || (at < 0 ? at + way > 0 : at + way < 1); };
  return comes(s, ahead * (uw * wv - norm2(w) * uv)) && comes(t, ahead * (norm2(u) * wv - uw * uv)) &&
         closest_segments(p0, p0 + u, q0, q0 + w).distance2 < reach * reach;
}

namespace {

// Share of the rest distance: with the depth that a contact may keep before it opens at once
// (contact/rows.cpp), it stays above the distance at which the guard acts, half of the rest distance.
constexpr double kIndentation = 0.3;

// Does a vertex this near an edge make a contact of its own there: over one of the edge's faces, or off the
// edge in the vertex's cone of normals?
bool end_touches(const Surface &surface, uint32_t vertex, Vec3 from, Vec3 to, const EdgeFaces &faces) {
  const Vec3 p = load3(&surface.x[4 * size_t{vertex}]);
  const double s = closest_on_segment(p, from, to);
  const Vec3 off = from + s * (to - from) - p;
  const double distance = norm(off);
  if (dot(off, faces.inward[0]) < 0 || dot(off, faces.inward[1]) < 0 || !(distance > 0)) return true;
  return vertex_cone_has(surface, vertex, (1 / distance) * off);
}

// Is the crossing at `at` of an edge the contact of that edge's end, because the end makes none of its own?
// So it is where vertices of both surfaces lie on each other.
bool replaces_end(const Surface &surface, const uint32_t *ends, double at, Vec3 from, Vec3 to,
                  const EdgeFaces &faces) {
  if (at > kEnd && at < 1 - kEnd) return false;
  return !end_touches(surface, ends[at > 0.5], from, to, faces);
}

// m, how far a surface rises at an edge (or dips, if it is concave) above the middle of a straight edge of
// this length and direction that crosses it.
double rise(const EdgeFaces &faces, Vec3 outward, Vec3 across, double length) {
  if (!(norm2(faces.normal[0]) > 0) || !(norm2(faces.normal[1]) > 0)) return HUGE_VAL;  // a rim
  const double turn = dot(faces.inward[0] + faces.inward[1], outward);
  return 0.25 * length * std::fabs(turn) * norm(cross(faces.along, across));
}

// m, how far a crossing yields under load. Where one of the edges lies in a flat face, the distance of the
// surfaces is linear along the other edge, so that the crossing is no minimum: contacts of surfels and of
// rims hold the surfaces apart, and the crossing only repeats them. Not so where both edges are rims, nor
// where it replaces the contact of a surfel (doc/decisions/contact_problem.md). Faces of a cut touch at the
// rest distance of their surfaces, which were set back, and must not come nearer.
double indentation(const Surface &sa, const Surface &sb, double rise_a, double rise_b, double offset) {
  if (sa.back > 0 || sb.back > 0) return 0;
  return kIndentation * offset * std::clamp(2 - std::min(rise_a, rise_b) / offset, 0.0, 1.0);
}

}  // namespace

// Convex now, or on the way to be within the sub-step: a fold that pops out under an edge that lies on both
// its faces meets it at once.
bool edge_becomes_convex(const Surface &surface, uint32_t edge, double h) {
  return edge_convex(surface, edge, 0) || edge_convex(surface, edge, 2 * h);
}

void edge_edge(const Pair &pair, Run run, Array<ContactPoint> &out) {
  const Surface &sa = *pair.a.surface, &sb = *pair.b->surface;
  const size_t begin = out.size();
  uint32_t last_a = kNone;
  Vec3 p0, u, vp0, vp1;
  double uu = 0, widest2 = 0;
  const double depth = edge_recovery_depth(sa, sb);
  EdgeFaces fa;
  bool known = false, convex = false, bears = false;  // fa belongs to last_a; so do convex and bears
  const double farthest = std::max(contact_reach(pair.h, pair.offset, pair.known.speed), depth);
  for (size_t i = 0; i < run.size(); ++i) {
    if (pair.known.beyond(i, farthest)) continue;
    const Candidate &candidate = run[i];
    const uint32_t *ea = &sa.edge[2 * size_t{candidate.feature_a}];
    const uint32_t *eb = &sb.edge[2 * size_t{candidate.feature_b}];
    if (candidate.feature_a != last_a) {
      last_a = candidate.feature_a;
      known = false;
      convex = edge_becomes_convex(sa, last_a, pair.h);
      bears = pair.bears(last_a);
      p0 = pair.xa(ea[0]);
      u = pair.xa(ea[1]) - p0;
      vp0 = pair.va(ea[0]);
      vp1 = pair.va(ea[1]);
      uu = norm2(u);
      const double speed = std::sqrt(std::max(norm2(vp0), norm2(vp1))) + pair.speed_b;
      const double widest = std::max(contact_reach(pair.h, pair.offset, speed), depth);
      widest2 = widest * widest;
    }
    if (!convex && !bears) continue;
    const Vec3 q0 = pair.xb(eb[0]), w = pair.xb(eb[1]) - q0, r = p0 - q0;
    const Vec3 n = cross(u, w);
    const double nn = norm2(n), nr = dot(n, r), ww = norm2(w);
    const double uw = dot(u, w), ur = dot(u, r), wr = dot(w, r);
    const double s = uw * wr - ww * ur, t = uu * wr - uw * ur;  // times nn
    if (!(nr * nr <= widest2 * nn) || !(nn > kParallel * kParallel * uu * ww) ||
        !(s > -kPast * nn && s < (1 + kPast) * nn && t > -kPast * nn && t < (1 + kPast) * nn)) {
      if (pair.known.apart)
        pair.known.found(i, std::sqrt(closest_segments(p0, p0 + u, q0, q0 + w).distance2));
      continue;
    }
    double speed2 = 0;
    for (const uint32_t e : {eb[0], eb[1]})
      speed2 = std::max({speed2, norm2(vp0 - pair.vb(e)), norm2(vp1 - pair.vb(e))});
    const double reach = contact_reach(pair.h, pair.offset, std::sqrt(speed2));
    const double allowed = std::max(reach, depth);
    if (!(nr * nr < allowed * allowed * nn)) continue;
    const int place_a = place_on_edge(s / nn, 2 * pair.h * std::sqrt(speed2 / uu));
    const int place_b = place_on_edge(t / nn, 2 * pair.h * std::sqrt(speed2 / ww));
    if (place_a == kNowhere || place_b == kNowhere) continue;
    const double edge_s = s / nn, edge_t = t / nn;
    const Vec3 vq0 = pair.vb(eb[0]), vq1 = pair.vb(eb[1]);
    const Vec3 v = vp0 + edge_s * (vp1 - vp0) - (vq0 + edge_t * (vq1 - vq0));
    if (!slides_in(p0, u, q0, w, edge_s, edge_t, v, pair.h, reach)) continue;

    if (!(convex && edge_becomes_convex(sb, candidate.feature_b, pair.h)) &&
        !(bears && pair.bears(last_a, candidate.feature_b)))
      continue;
    if (!known) fa = edge_faces(sa, candidate.feature_a);
    known = true;
    const EdgeFaces fb = edge_faces(sb, candidate.feature_b);
    Vec3 normal = (1 / std::sqrt(nn)) * n;
    if (dot(normal, fb.outward()) < dot(normal, fa.outward())) normal = -normal;
    const double distance = dot(normal, r);
    if (!(distance < reach)) continue;
    // Past an end there is no depth yet, and what keeps the end away is a contact of its own.
    if (distance < -pair.offset && !(s > 0 && s < nn && t > 0 && t < nn)) continue;
    // As far as the edges can turn within the sub-step, their cones may open.
    const double slack = kCone + std::min(0.3, reach / std::sqrt(std::min(uu, ww)));
    if (!fb.leans_out(normal, slack) || !fa.leans_out(-normal, slack)) continue;
    // Faces that look the same way do not press on each other.
    if (!fb.is_outward(normal, slack) || !fa.is_outward(-normal, slack)) continue;
    if (place_a != kBetween && end_touches(sa, ea[place_a], q0, q0 + w, fb)) continue;
    if (place_b != kBetween && end_touches(sb, eb[place_b], p0, p0 + u, fa)) continue;
    ContactPoint c = blank(pair, kEdgeEdge, 1, candidate.feature_a, candidate.feature_b);
    add_node(c, pair.a.first_node + ea[0], 1 - edge_s);
    add_node(c, pair.a.first_node + ea[1], edge_s);
    add_node(c, pair.b->first_node + eb[0], edge_t - 1);
    add_node(c, pair.b->first_node + eb[1], -edge_t);
    place(c, p0 + edge_s * u, q0 + edge_t * w, normal, distance);
    if (!rests(pair, reach, c)) continue;
    if (!replaces_end(sa, ea, edge_s, q0, q0 + w, fb) && !replaces_end(sb, eb, edge_t, p0, p0 + u, fa))
      c.indentation = indentation(sa, sb, rise(fa, -normal, fb.along, std::sqrt(ww)),
                                  rise(fb, normal, fa.along, std::sqrt(uu)), pair.offset);
    out.push_back(c);
  }
  name_contacts(pair, begin, out);
}

}  // namespace dfm::narrow
