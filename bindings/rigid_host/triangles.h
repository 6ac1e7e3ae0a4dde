// Shapes that the library's primitives do not have, as triangles in the shape's frame.
#pragma once
#include <array>
#include <cstdint>
#include <map>
#include <vector>

#include "deform/deform.h"
#include "rigid_math.h"

namespace dfm_rigid_detail {

struct Triangles {
  std::vector<double> points;
  std::vector<uint32_t> corners;
  bool empty() const { return corners.empty(); }
  void fill(dfm_obstacle_def &def) const;  // def points into this
};

// Corners of one place, equal to the bit, are one point; triangles without area go.
class Welder {
 public:
  void add(const std::array<double, 3> corner[3]);
  Triangles take() { return std::move(out_); }

 private:
  std::map<std::array<double, 3>, uint32_t> known_;
  Triangles out_;
};

// A cylinder's flat ends and rim: a closed mesh of 64 sides, as wide as to hold the cylinder's volume, so
// that the side is off by 0.08 % of the radius at most. axis: 0 x, 1 y, 2 z.
Triangles cylinder(double radius, double length, int axis);
// nx by nz samples in rows of x; place: where sample (x, z) lies. The surface's outside is where z goes
// round to x by the right hand.
template <class Place>
Triangles grid(uint32_t nx, uint32_t nz, Place &&place) {
  Triangles t;
  for (uint32_t z = 0; z < nz; ++z)
    for (uint32_t x = 0; x < nx; ++x) {
      const Vec p = place(x, z);
      t.points.insert(t.points.end(), {p.x, p.y, p.z});
    }
  for (uint32_t z = 0; z + 1 < nz; ++z)
    for (uint32_t x = 0; x + 1 < nx; ++x) {
      const uint32_t a = z * nx + x, b = a + 1, c = a + nx, d = c + 1;
      t.corners.insert(t.corners.end(), {a, c, b, b, c, d});
    }
  return t;
}
// A plane through its nearest point to the origin, z its normal.
Pose plane_pose(Vec normal, double distance);

}  // namespace dfm_rigid_detail
