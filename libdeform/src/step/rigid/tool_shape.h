// The shape of a part of a tool, or of a rigid body, as corners, edges and faces; contacts are between those
// of two shapes. A sphere is one corner with a radius, a capsule two corners and the edge between them. A
// plane and voxels have neither corners nor edges: only those of the other shape touch them.
#pragma once
#include <cstdint>
#include <vector>

#include "geometry/obstacle_shape.h"
#include "math/extent.h"
#include "math/vec3.h"

namespace dfm {

struct ObstacleMesh;

// Component of a normal; with a smaller one it counts as on the border of the cone of an edge. So a rod along
// a face touches both borders of the face, also if it is not quite parallel to it.
constexpr double kAlong = 1e-3;

// m, from its position to no point of it; not of a plane
inline double ball_around(const ObstacleView &v) {
  if (v.shape == Shape::box) return norm(v.half_size);
  if (v.shape == Shape::sphere) return v.radius;
  return v.shape == Shape::capsule ? v.radius + v.half_length : v.extent;
}

class ToolShape {
 public:
  struct Edge {
    Vec3 from, to, beside[2];  // directions in the faces beside it, away from it
    int faces = 0;             // 0: the axis of a capsule, which has no faces
    uint32_t number = 0;
    uint32_t end[2] = {};  // numbers of the corners
    bool flat = false;     // its faces lie in one plane: what touches it touches them or their border
    // Whether a motion along n leaves the shape here, or does so once the two have turned by so much.
    bool is_outward(Vec3 n, double turn) const;
  };

  static bool takes_part(const ObstacleView &view);
  ToolShape() : ToolShape(ObstacleView{}, nullptr) {}
  // mesh: that of the view, if it has one
  ToolShape(const ObstacleView &view, ObstacleMesh *mesh) : shape_(view) { take(view, mesh); }
  void take(const ObstacleView &view, ObstacleMesh *mesh);  // replaces the shape; uses the same memory
  Vec3 position() const { return shape_.view().position; }
  double reach() const { return reach_; }  // m, of any point of it from position(); not of a plane
  bool endless() const { return shape_.view().shape == Shape::plane; }
  bool has_corners() const { return !endless() && shape_.view().shape != Shape::voxels; }
  double round() const { return round_; }  // m, radius around corners and edges
  Extent bounds() const;                   // not of a plane
  // Finds the corners, edges and triangles near the box; call it before the functions below. flat: also edges
  // within a face of a mesh, and corners of such edges only. Where these touch, other features touch as well,
  // unless one thing is pressed into the other, as by jaws.
  void look_at(const Extent &near, bool flat);
  // The same for what lies at dot(normal, x) <= height.
  void select_below(Vec3 normal, double height, bool flat);
  struct Corner {
    Vec3 at;
    uint32_t number;
  };
  const std::vector<Corner> &corners() const { return corners_; }
  const std::vector<Edge> &edges() const { return edges_; }
  // f(a, b, c), counter-clockwise seen from outside: triangles near the box, or all of a box; the axis of a
  // round shape, as one that has no area; none of planes and voxels.
  template <class F>
  void each_triangle(F &&f) const {
    for (const uint32_t t : triangles_) {
      const uint32_t *const c = &surface_->tri[3 * size_t{t}];
      f(node(c[0]), node(c[1]), node(c[2]));
    }
    if (round_ > 0) f(shape_.end(0), shape_.end(1), shape_.end(1));
    if (shape_.view().shape != Shape::box) return;
    for (uint32_t k = 0; k < 3; ++k)
      for (uint32_t side = 0; side < 2; ++side) {
        // with k, u and v a right-handed frame
        const uint32_t u = 1u << (k + 1) % 3, v = 1u << (k + 2) % 3, at = side << k;
        const Vec3 p = shape_.corner(at), q = shape_.corner(at | u | v);
        const Vec3 r = shape_.corner(at | (side ? u : v)), s = shape_.corner(at | (side ? v : u));
        f(p, r, q);
        f(p, q, s);
      }
  }
  // Whether this corner may touch something in direction n. Where the surface around it is flat or hollow,
  // only if every edge of the corner falls away from n: an edge of the other shape beside it does not count.
  bool may_meet(const Corner &corner, Vec3 n) const;
  // The closest point of the surface; false: none, or a mesh is farther away than `limit` on either side.
  // face: out, whether the point lies within a face, not on an edge or at a corner.
  bool closest(Vec3 p, double limit, ObstaclePoint &out, bool *face = nullptr) const;

 private:
  void select_mesh(const Extent &near, bool flat);
  Extent under(Vec3 normal, double height) const;
  Edge edge_of_mesh(uint32_t edge) const;
  Vec3 node(uint32_t i) const { return load3(&surface_->x[4 * size_t{i}]); }
  Vec3 face_normal(uint32_t triangle) const;

  ObstacleShape shape_;
  ObstacleMesh *mesh_;
  const Surface *surface_;  // of the mesh
  double reach_ = 0, round_ = 0;
  std::vector<Corner> corners_;
  std::vector<Edge> edges_;
  std::vector<uint32_t> triangles_, near_edges_;
};

// The normal of two edges, from q to p, if both edges are left along it. It follows from the two directions
// alone, so it stays the same for edges that have passed each other. apart: from q to p, where they are
// nearest. turn: rad, by which the two may turn against each other, at least kAlong, which holds for
// edges that have passed each other.
bool between(const ToolShape::Edge &p, const ToolShape::Edge &q, Vec3 apart, double turn, Vec3 &n);

}  // namespace dfm
