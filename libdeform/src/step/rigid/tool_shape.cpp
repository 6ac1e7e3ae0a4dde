#include "step/rigid/tool_shape.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "body/obstacle_mesh.h"
#include "geometry/closest.h"

namespace dfm {
namespace {

constexpr double kSame = 1e-9;   // relative: squared distances that differ by less are equal
constexpr double kFlat = 1e-6;   // rad: faces that differ by less have no edge between them
constexpr double kSharp = 0.1;   // sine: by more, all edges of a sharp corner fall from its mean normal
constexpr double kCross = 1e-6;  // sine between edges that have a normal
constexpr double kSteep = 0.1;   // component of a normal; with a smaller one a plane bounds no axis

template <class... Points>
Extent box_of(Points... at) {
  Extent box;
  (box.add(at), ...);
  return box;
}

}  // namespace

bool ToolShape::Edge::is_outward(Vec3 n, double turn) const {
  for (int k = 0; k < faces; ++k)
    if (!(dot(n, beside[k]) < turn)) return false;
  return true;
}

bool between(const ToolShape::Edge &p, const ToolShape::Edge &q, Vec3 apart, double turn, Vec3 &n) {
  n = cross(p.to - p.from, q.to - q.from);
  const double sine = norm(n), d = norm(apart);
  const auto outward = [&](double by) { return q.is_outward(n, by) && p.is_outward(-n, by); };
  if (p.faces == 0 || q.faces == 0 || !(sine > kCross * norm(p.to - p.from) * norm(q.to - q.from))) {
    if (!(d > 0)) return false;
    n = (1 / d) * apart;
    return outward(turn);
  }
  n = (1 / sine) * n;
  if (outward(kAlong)) return true;
  n = -n;
  if (outward(kAlong)) return true;
  if (dot(n, apart) < 0) n = -n;
  return outward(turn);
}

bool ToolShape::takes_part(const ObstacleView &o) { return o.shape != Shape::none; }

void ToolShape::take(const ObstacleView &view, ObstacleMesh *mesh) {
  shape_ = ObstacleShape(view);
  mesh_ = mesh;
  surface_ = view.surface;
  round_ = shape_.view().radius;
  edges_.clear();
  corners_.clear();
  triangles_.clear();
  reach_ = shape_.extent() + round_;
}

Extent ToolShape::bounds() const {
  if (shape_.view().shape == Shape::mesh) return mesh_->bounds();
  double lo[3], hi[3];
  shape_.bounds(lo, hi);
  return {load3(lo), load3(hi)};
}

// Box around that part of the bounds of the shape that lies at dot(normal, x) <= height.
Extent ToolShape::under(Vec3 normal, double height) const {
  const Extent all = bounds();
  Extent out = all;
  const double n[3] = {normal.x, normal.y, normal.z};
  const double slack = kSame * (std::fabs(height) + norm(all.lo) + norm(all.hi));
  double least_of[3], sum = 0;
  for (int k = 0; k < 3; ++k) sum += least_of[k] = std::min(n[k] * all.lo[k], n[k] * all.hi[k]);
  for (int k = 0; k < 3; ++k) {
    if (std::fabs(n[k]) < kSteep) continue;  // the bound would be far away, and a quotient with a large error
    const double end = (height + slack - (sum - least_of[k])) / n[k];
    if (n[k] > 0) out.hi[k] = std::min(out.hi[k], end);
    else out.lo[k] = std::max(out.lo[k], end);
  }
  return out;
}

Vec3 ToolShape::face_normal(uint32_t t) const {
  const uint32_t *const c = &surface_->tri[3 * size_t{t}];
  const Vec3 n = cross(node(c[1]) - node(c[0]), node(c[2]) - node(c[0]));
  const double length = norm(n);
  return length > 0 ? (1 / length) * n : Vec3{};
}

// No motion leaves the shape at a concave edge: corners and other edges touch first. A normal on the border
// of the cone counts, since the edge of a box that lies square on a face of another box crosses nothing else.
ToolShape::Edge ToolShape::edge_of_mesh(uint32_t e) const {
  const uint32_t *const end = &surface_->edge[2 * size_t{e}];
  Edge out;
  out.number = e;
  out.from = node(end[0]);
  out.to = node(end[1]);
  out.end[0] = end[0];
  out.end[1] = end[1];
  Vec3 normal[2];
  for (const size_t k : {0, 1}) {
    const uint32_t t = surface_->edge_tri[2 * size_t{e} + k];
    if (t == kNone) continue;
    const uint32_t *const c = &surface_->tri[3 * size_t{t}];
    const Vec3 middle = (1.0 / 3) * (node(c[0]) + node(c[1]) + node(c[2])), n = face_normal(t);
    normal[k] = n;
    Vec3 into = cross(n, out.to - out.from);
    if (dot(into, middle - out.from) < 0) into = -into;
    const double length = norm(into);
    out.beside[out.faces++] = length > 0 ? (1 / length) * into : Vec3{};
  }
  out.flat = out.faces == 2 && norm(normal[0] - normal[1]) < kFlat;
  return out;
}

// All ascending, as a search through the whole mesh would list them. An edge is listed with the first of its
// triangles, which is near wherever the edge is.
void ToolShape::select_mesh(const Extent &near, bool flat) {
  mesh_->triangles_near(near.lo, near.hi, triangles_);
  std::erase_if(triangles_, [&](uint32_t t) {
    const uint32_t *const c = &surface_->tri[3 * size_t{t}];
    return !near.meets(box_of(node(c[0]), node(c[1]), node(c[2])));
  });
  near_edges_.clear();
  for (const uint32_t t : triangles_)
    for (size_t k = 0; k < 3; ++k) {
      const uint32_t e = surface_->tri_edge[3 * size_t{t} + k];
      const uint32_t *const beside = &surface_->edge_tri[2 * size_t{e}];
      const uint32_t *const end = &surface_->edge[2 * size_t{e}];
      if ((beside[0] == kNone ? beside[1] : beside[0]) == t && near.meets(box_of(node(end[0]), node(end[1]))))
        near_edges_.push_back(e);
    }
  std::sort(near_edges_.begin(), near_edges_.end());
  for (const uint32_t e : near_edges_) {
    const Edge edge = edge_of_mesh(e);
    if (!flat && edge.flat) continue;
    edges_.push_back(edge);
    for (const uint32_t i : edge.end)
      if (near.meets(box_of(node(i)))) corners_.push_back({node(i), i});
  }
  std::sort(corners_.begin(), corners_.end(),
            [](const Corner &a, const Corner &b) { return a.number < b.number; });
  const auto same = [](const Corner &a, const Corner &b) { return a.number == b.number; };
  corners_.erase(std::unique(corners_.begin(), corners_.end(), same), corners_.end());
}

void ToolShape::look_at(const Extent &near, bool flat) {
  corners_.clear();
  edges_.clear();
  switch (shape_.view().shape) {
    case Shape::mesh: return select_mesh(near, flat);
    case Shape::box:
      for (uint32_t i = 0; i < 8; ++i) corners_.push_back({shape_.corner(i), i});
      for (uint32_t i = 0; i < 12; ++i) {
        Edge e;
        uint32_t face[2];
        shape_.edge(i, e.from, e.to, face);
        // what is away from the edge in one face is away from the other one
        e.beside[0] = -shape_.face_normal(face[1]);
        e.beside[1] = -shape_.face_normal(face[0]);
        e.faces = 2;
        e.number = i;
        edges_.push_back(e);
      }
      return;
    case Shape::capsule: {
      Edge e;
      e.from = shape_.end(0);
      e.to = shape_.end(1);
      edges_.push_back(e);
      corners_.push_back({shape_.end(1), 1});
      [[fallthrough]];
    }
    case Shape::sphere: corners_.push_back({shape_.end(0), 0}); return;
    default: return;
  }
}

void ToolShape::select_below(Vec3 normal, double height, bool flat) {
  look_at(shape_.view().shape == Shape::mesh ? under(normal, height) : Extent{}, flat);
}

bool ToolShape::may_meet(const Corner &corner, Vec3 n) const {
  if (shape_.view().shape != Shape::mesh) return true;
  const uint32_t *const begin = &surface_->fan_begin[corner.number];
  const std::span around(&surface_->fan[begin[0]], begin[1] - begin[0]);
  Vec3 out;
  for (const uint32_t t : around) out += face_normal(t);
  bool sharp = true, leads = true;
  for (const uint32_t t : around)
    for (size_t k = 0; k < 3; ++k) {
      const uint32_t *const end = &surface_->edge[2 * size_t{surface_->tri_edge[3 * size_t{t} + k]}];
      if (end[0] != corner.number && end[1] != corner.number) continue;
      const Vec3 way = normalized(node(end[end[0] == corner.number]) - corner.at);
      sharp = sharp && dot(out, way) < -kSharp * norm(out);
      leads = leads && dot(n, way) < kAlong;
    }
  return sharp || leads;
}

bool ToolShape::closest(Vec3 p, double limit, ObstaclePoint &out, bool *face) const {
  if (shape_.view().shape != Shape::mesh) {
    if (shape_.view().shape == Shape::voxels && !shape_.voxels_near(p, limit)) return false;
    out = shape_.closest(p);
    if (face)
      *face = shape_.view().shape != Shape::box || dot(out.normal, shape_.face_normal(out.face)) > 1 - kSame;
    return true;
  }
  double best = limit * limit, faced = 0;
  bool found = false;
  for (const uint32_t t : triangles_) {
    const uint32_t *const c = &surface_->tri[3 * size_t{t}];
    const TrianglePoint at = closest_on_triangle(p, node(c[0]), node(c[1]), node(c[2]));
    if (!(at.distance2 <= best * (found ? 1 + kSame : 1))) continue;
    // Among equally near triangles, the one that faces p most decides on which side p is: its neighbors at an
    // edge may face away, or be seen edge-on, where rounding would decide.
    const Vec3 n = face_normal(t), way = p - at.point;
    const double side = dot(n, way), d = std::sqrt(at.distance2);
    if (found && at.distance2 >= best * (1 - kSame) && std::fabs(side) <= faced) continue;
    found = true;
    best = at.distance2;
    faced = std::fabs(side);
    out.point = at.point;
    out.face = 0;
    out.distance = side < 0 ? -d : d;
    if (face) *face = at.feature == TriangleFeature::face;
    out.normal = at.feature == TriangleFeature::face || !(d > 0) ? n : (1 / out.distance) * way;
  }
  return found;
}

}  // namespace dfm
