// The first triangle on a ray and the closest one to a point, through a tree of boxes. Nodes are visited
// nearest first, and skipped only if no triangle in them can be better, so results are those of a test of
// every triangle; of equal triangles the lowest number.
#pragma once
#include <cstdint>
#include <limits>
#include <span>

#include "geometry/box_tree.h"
#include "geometry/closest.h"
#include "geometry/surface.h"

namespace dfm {

inline constexpr double kFar = std::numeric_limits<double>::infinity();

struct Triangles {
  const BoxTree &tree;
  std::span<const uint32_t> corners;  // [ntri,3]
  const double *x;                    // [points,4], those that the tree was made from
  Vec3 corner(uint32_t t, uint32_t k) const { return load3(x + 4 * size_t{corners[3 * size_t{t} + k]}); }
};

// Numbers of visited boxes and triangles.
struct SearchCount {
  uint64_t nodes = 0;
  uint64_t triangles = 0;
  void add_to(SearchCount *all) const {
    if (!all) return;
    all->nodes += nodes;
    all->triangles += triangles;
  }
};

struct TriangleOnRay {
  double distance = kFar;
  uint32_t triangle = kNone;
};
struct TriangleNearPoint {
  double key = kFar;
  uint32_t triangle = kNone;
  TrianglePoint at{};
};

// A ray, in coordinates in which it runs along an axis (Woop, Benthin and Wald 2013). The product of an edge
// is the other's negative to the bit in its two triangles, and has the right sign or is zero, so no ray slips
// between triangles, at an edge or a corner.
class ShearedRay {
 public:
  ShearedRay(Vec3 o, Vec3 d);
  // Products of the edges opposite to a, b and c: of one sign where the ray's line meets the triangle, that
  // of normal . direction. along: the way to it times their sum.
  struct Products {
    double a, b, c, along;
    double sum() const { return a + b + c; }
    bool meets() const { return (a >= 0 && b >= 0 && c >= 0) || (a <= 0 && b <= 0 && c <= 0); }
  };
  Products of(Vec3 a, Vec3 b, Vec3 c) const;

 private:
  Vec3 o_;
  int x_, y_, z_;
  double shear_x_, shear_y_, scale_;
};
// Distance along the ray, or infinity. Both sides count.
double ray_triangle(const ShearedRay &ray, Vec3 a, Vec3 b, Vec3 c);

// Up to and with `limit`. A triangle counts where it is met inside of its box, to 1e-8 of all lengths: where
// a ray grazes it by less than 1e-7 rad the numbers mean no more than that.
TriangleOnRay first_on_ray(const Triangles &triangles, Vec3 o, Vec3 unit, double limit,
                           SearchCount *count = nullptr);

// The search is for the least key(squared distance), a function that does not fall, up to and with `limit`.
enum class DistanceKey : uint8_t { squared, root };
TriangleNearPoint closest_to(const Triangles &triangles, Vec3 p, DistanceKey key, double limit,
                             SearchCount *count = nullptr);

}  // namespace dfm
