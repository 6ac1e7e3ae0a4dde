#include "scene/back_side.h"

#include <cmath>

#include "body/obstacle_mesh.h"
#include "math/turn.h"
#include "plugin/context.h"
#include "state/obstacle.h"

namespace dfm::scene {
namespace {

Vec3 center(const dfm::Body &b) {
  Vec3 sum{0, 0, 0};
  for (uint32_t i = 0; i < b.p.n; ++i) sum = sum + load3(&b.p.x[size_t{kStride} * i]);
  return (1.0 / b.p.n) * sum;
}

// Whether the first triangle that a ray from `from` along `d` meets (both in the obstacle's frame) faces away
// from its origin.
bool meets_a_back(const dfm::Obstacle &o, Vec3 from, Vec3 d) {
  constexpr double kEdge = 1e-9;  // a ray through a shared edge meets one of its triangles
  double nearest = INFINITY;
  bool back = false;
  for (size_t t = 0; t < o.triangles.size(); t += 3) {
    const Vec3 a = load3(&o.points[3 * size_t{o.triangles[t]}]),
               u = load3(&o.points[3 * size_t{o.triangles[t + 1]}]) - a,
               v = load3(&o.points[3 * size_t{o.triangles[t + 2]}]) - a, normal = cross(u, v);
    const double along = dot(normal, d);
    if (along == 0) continue;
    const double at = dot(normal, a - from) / along;
    if (!(at > 0) || at >= nearest) continue;
    const Vec3 w = from + at * d - a;
    const double n2 = norm2(normal), s = dot(cross(w, v), normal) / n2, r = dot(cross(u, w), normal) / n2;
    if (s < -kEdge || r < -kEdge || s + r > 1 + kEdge) continue;
    nearest = at;
    back = along > 0;
  }
  return back;
}

}  // namespace

void tell_back_side(dfm_context *context, const World &world, Vec3 gravity) {
  if (!(norm(gravity) > 0)) return;
  for (const auto &o : world.obstacles) {
    if (!o || !o->mesh || o->mesh->closed || o->sensor || o->rigid) continue;
    const Quat back = conjugate(o->pose.rotation);
    const Vec3 d = rotate(back, gravity);
    for (const auto &b : world.bodies) {
      if (!b || !meets_a_back(*o, rotate(back, center(*b) - o->pose.position), d)) continue;
      context->logf(DFM_LOG_WARNING,
                    "body '%s' would fall on the back of obstacle '%s': its mesh is open and acts only on "
                    "the side that its triangles face; reverse the order of their corners in the file",
                    b->name.c_str(), o->name.c_str());
      break;
    }
  }
}

}  // namespace dfm::scene
