#include "geometry/obstacle_shape.h"

#include <algorithm>
#include <cmath>

#include "geometry/closest.h"
#include "geometry/voxel_grid.h"

namespace dfm {

ObstacleShape::ObstacleShape(const ObstacleView &view) : view_(view) {
  for (int k = 0; k < 3; ++k) {
    Vec3 e;
    e[k] = 1;
    axis_[k] = normalized(rotate(view.rotation, e));
  }
  if (view.shape != Shape::capsule) view_.half_length = 0;
  if (view.shape != Shape::capsule && view.shape != Shape::sphere) view_.radius = 0;
  end_[0] = view.position - view_.half_length * axis_[2];
  end_[1] = view.position + view_.half_length * axis_[2];
}

uint32_t ObstacleShape::points() const {
  switch (view_.shape) {
    case Shape::box: return 8;
    case Shape::capsule: return 2;
    case Shape::sphere: return 1;
    default: return 0;
  }
}

Vec3 ObstacleShape::corner(uint32_t i) const {
  Vec3 p = view_.position;
  for (int k = 0; k < 3; ++k) p += (i >> k & 1 ? view_.half_size[k] : -view_.half_size[k]) * axis_[k];
  return p;
}

void ObstacleShape::edge(uint32_t i, Vec3 &from, Vec3 &to, uint32_t faces[2]) const {
  const uint32_t k = i >> 2, k1 = (k + 1) % 3, k2 = (k + 2) % 3, s1 = i & 1, s2 = i >> 1 & 1;
  const uint32_t base = s1 << k1 | s2 << k2;
  from = corner(base);
  to = corner(base | 1u << k);
  faces[0] = 2 * k1 + s1;
  faces[1] = 2 * k2 + s2;
}

ObstaclePoint ObstacleShape::closest(Vec3 p) const {
  switch (view_.shape) {
    case Shape::plane: {
      const double d = dot(axis_[2], p - view_.position);
      return {p - d * axis_[2], axis_[2], d, 0};
    }
    case Shape::box: return closest_on_box(p);
    case Shape::voxels: return closest_on_voxels(p);
    default: break;
  }
  const Vec3 c = end_[0] + closest_on_segment(p, end_[0], end_[1]) * (end_[1] - end_[0]);
  const double d = norm(p - c);
  // on the axis all directions are equal
  const Vec3 n = d > 1e-12 * view_.radius ? (1 / d) * (p - c) : axis_[0];
  return {c + view_.radius * n, n, d - view_.radius, 0};
}

double ObstacleShape::bend(const ObstaclePoint &o, Vec3 way) const {
  if (view_.shape != Shape::sphere && view_.shape != Shape::capsule) return 0;
  const auto along = [&](Vec3 v) { return dot(axis_[2], v); };
  const double out = dot(o.normal, way);
  double aside = norm2(way) - out * out;
  // the shaft is straight
  if (std::fabs(along(o.point - view_.radius * o.normal - view_.position)) < view_.half_length)
    aside -= along(way) * along(way);
  return aside / (view_.radius + o.distance);
}

ObstaclePoint ObstacleShape::closest_on_box(Vec3 p) const {
  Vec3 local, outside;
  bool inside = true;
  for (int k = 0; k < 3; ++k) {
    local[k] = dot(axis_[k], p - view_.position);
    const double over = std::fabs(local[k]) - view_.half_size[k];
    if (over > 0) {
      outside[k] = local[k] > 0 ? over : -over;
      inside = false;
    }
  }
  if (inside) {
    int face = 0;
    for (int k = 1; k < 3; ++k)
      if (view_.half_size[k] - std::fabs(local[k]) < view_.half_size[face] - std::fabs(local[face])) face = k;
    const double depth = view_.half_size[face] - std::fabs(local[face]);
    const Vec3 n = local[face] < 0 ? -axis_[face] : axis_[face];
    return {p + depth * n, n, -depth, uint32_t(2 * face + (local[face] < 0 ? 0 : 1))};
  }
  int most = 0;
  for (int k = 1; k < 3; ++k)
    if (std::fabs(outside[k]) > std::fabs(outside[most])) most = k;
  const Vec3 r = outside.x * axis_[0] + outside.y * axis_[1] + outside.z * axis_[2];
  const double d = norm(outside);
  // Directly above a face the axis itself is the normal, so that all points of a face have exactly the same
  // normal.
  int sides = 0;
  for (int k = 0; k < 3; ++k) sides += outside[k] != 0;
  const Vec3 n = sides == 1 ? (outside[most] < 0 ? -axis_[most] : axis_[most]) : normalized(r);
  return {p - r, n, d, uint32_t(2 * most + (outside[most] < 0 ? 0 : 1))};
}

ObstaclePoint ObstacleShape::closest_on_voxels(Vec3 p) const {
  const VoxelGrid::Value value = view_.grid->at(local(p));
  const double g = norm(value.gradient);
  // Halfway between two walls any direction is valid.
  const Vec3 n = g > 1e-6 ? normalized(rotate(view_.rotation, value.gradient)) : axis_[2];
  return {p - value.distance * n, n, value.distance, 0};
}

bool ObstacleShape::voxels_near(Vec3 p, double limit) const { return view_.grid->near(local(p), limit); }

Vec3 ObstacleShape::shape_velocity(Vec3 q) const {
  switch (view_.shape) {
    case Shape::sphere: return view_.velocity;
    case Shape::capsule: q = end_[0] + closest_on_segment(q, end_[0], end_[1]) * (end_[1] - end_[0]); break;
    default: break;
  }
  return view_.velocity + cross(view_.spin, q - view_.position);
}

double ObstacleShape::extent() const {
  switch (view_.shape) {
    case Shape::box: return norm(view_.half_size);
    case Shape::capsule: return view_.half_length;
    case Shape::mesh:
    case Shape::voxels: return view_.extent;
    default: return 0;
  }
}

void ObstacleShape::bounds(double lo[3], double hi[3]) const {
  const bool voxels = view_.shape == Shape::voxels, angular = voxels || view_.shape == Shape::box;
  const Vec3 half = voxels ? 0.5 * (view_.grid->high() - view_.grid->low()) : view_.half_size;
  const Vec3 center = voxels ? 0.5 * (view_.grid->high() + view_.grid->low()) : Vec3{};
  for (int k = 0; k < 3; ++k) {
    double r = angular ? 0 : view_.radius;
    lo[k] = std::min(end_[0][k], end_[1][k]);
    hi[k] = std::max(end_[0][k], end_[1][k]);
    for (int i = 0; angular && i < 3; ++i) {
      lo[k] += axis_[i][k] * center[i];
      hi[k] += axis_[i][k] * center[i];
      r += std::fabs(axis_[i][k]) * half[i];
    }
    lo[k] -= r;
    hi[k] += r;
  }
}

}  // namespace dfm
