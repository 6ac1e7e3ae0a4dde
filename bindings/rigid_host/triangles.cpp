#include "triangles.h"

#include <cmath>

namespace dfm_rigid_detail {
namespace {

constexpr uint32_t kSides = 64;
constexpr double kPi = 3.14159265358979323846;

}  // namespace

void Triangles::fill(dfm_obstacle_def &def) const {
  def.shape = DFM_SHAPE_MESH;
  def.npoint = static_cast<uint32_t>(points.size() / 3);
  def.ntriangle = static_cast<uint32_t>(corners.size() / 3);
  def.points = points.data();
  def.triangles = corners.data();
}

void Welder::add(const std::array<double, 3> corner[3]) {
  uint32_t c[3];
  for (int k = 0; k < 3; ++k) {
    const auto [at, fresh] = known_.try_emplace(corner[k], static_cast<uint32_t>(known_.size()));
    c[k] = at->second;
    if (fresh) out_.points.insert(out_.points.end(), corner[k].begin(), corner[k].end());
  }
  if (c[0] != c[1] && c[1] != c[2] && c[2] != c[0]) out_.corners.insert(out_.corners.end(), c, c + 3);
}

Triangles cylinder(double radius, double length, int axis) {
  Triangles t;
  const auto add = [&](double x, double y, double z) {  // of a cylinder along z, turned round to `axis`
    const double p[3] = {x, y, z};
    for (int k = 0; k < 3; ++k) t.points.push_back(p[(k + 2 - axis + 3) % 3]);
  };
  const double turn = 2 * kPi / kSides, r = radius * std::sqrt(turn / std::sin(turn));
  for (uint32_t i = 0; i < kSides; ++i)
    for (const double z : {-0.5 * length, 0.5 * length})
      add(r * std::cos(turn * i), r * std::sin(turn * i), z);
  add(0, 0, -0.5 * length);
  add(0, 0, 0.5 * length);
  for (uint32_t i = 0; i < kSides; ++i) {
    const uint32_t low = 2 * i, high = low + 1, next_low = 2 * ((i + 1) % kSides), next_high = next_low + 1;
    t.corners.insert(t.corners.end(), {low, next_low, next_high, low, next_high, high});
    t.corners.insert(t.corners.end(), {2 * kSides, next_low, low, 2 * kSides + 1, high, next_high});
  }
  return t;
}

Pose plane_pose(Vec n, double distance) {
  const Vec v = cross({0, 0, 1}, n);
  return {distance * n, n.z > -1 + 1e-12 ? unit({v.x, v.y, v.z, 1 + n.z}) : Quat{1, 0, 0, 0}};
}

}  // namespace dfm_rigid_detail
