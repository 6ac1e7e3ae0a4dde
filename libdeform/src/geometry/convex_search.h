// A convex shape against a surface of triangles, through the tree of the surface. A box is skipped only if no
// triangle in it can change the result, so results are those of a test of every triangle; of equal triangles
// the lowest number.
#pragma once
#include <algorithm>

#include "geometry/convex_gap.h"
#include "geometry/tree_walk.h"
#include "geometry/triangle_search.h"

namespace dfm {

struct TriangleOnPath {
  ConvexHit hit;
  uint32_t triangle = kNone;
};
// The first triangle that the shape touches, up to and including the distance `limit`.
TriangleOnPath first_on_path(const Triangles &triangles, const Convex &shape, Vec3 unit, double limit);

bool touches_any(const Triangles &triangles, const Convex &shape);

// How often a closed surface winds around p: 1 inside, where its triangles look outward. By a ray, so exact
// to rounding; p on the surface may count either way.
int winding_by_ray(const Triangles &triangles, Vec3 p);

// Keeps the smallest of the offered items in the caller's memory; finish() sorts them.
template <class T>
class Least {
 public:
  Least(T *out, uint32_t capacity) : out_(out), capacity_(capacity) {}
  void offer(const T &value) {
    if (count_ < capacity_) {
      out_[count_++] = value;
      return;
    }
    if (count_++ == capacity_) std::make_heap(out_, out_ + capacity_);
    if (capacity_ == 0 || !(value < out_[0])) return;
    std::pop_heap(out_, out_ + capacity_);
    out_[capacity_ - 1] = value;
    std::push_heap(out_, out_ + capacity_);
  }
  uint32_t finish() {  // returns the number of offered items
    std::sort(out_, out_ + std::min(count_, capacity_));
    return count_;
  }

 private:
  T *out_;
  uint32_t capacity_, count_ = 0;
};

// The lowest numbers of the triangles that the shape touches or contains, and their total count.
uint32_t triangles_touched(const Triangles &triangles, const Convex &shape, uint32_t capacity, uint32_t *out);

// Calls f(distance, triangle) for all triangles on a ray up to and including `limit`, in no order. As
// first_on_ray.
template <class F>
void all_on_ray(const Triangles &m, Vec3 o, Vec3 unit, double limit, F &&f) {
  if (m.tree.empty()) return;
  const double slack = kRaySlack * length_scale(m.tree, o);
  const RayBoxes boxes(o, unit, {slack, slack, slack});
  walk(
      m.tree,
      [&](const Box &b) {
        const RayBoxes::Span s = boxes.meet(b);
        return s.near <= s.far && s.near <= limit;
      },
      [&](uint32_t place) {
        const RayBoxes::Span inside = boxes.meet(m.tree.triangle_boxes()[place]);
        const uint32_t t = m.tree.triangles()[place];
        const double at = ray_triangle(o, unit, m.corner(t, 0), m.corner(t, 1), m.corner(t, 2));
        if (at >= inside.near && at <= inside.far && at <= limit && at < kFar) f(at, t);
        return true;
      });
}

}  // namespace dfm
