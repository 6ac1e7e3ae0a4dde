#include "state/bounds.h"

#include <algorithm>
#include <cmath>
#include <cstdarg>

#include "core/error.h"
#include "geometry/obstacle_shape.h"
#include "state/obstacle.h"
#include "state/world.h"

namespace dfm {
namespace {

constexpr double kUnit = 2.220446049250313e-16;  // spacing of doubles at 1
constexpr double kUnits = 64;                    // spacings that a rest distance must span
// the rest distance is no more than this share of the thinnest body
constexpr double kOfThickness = 0.1;
constexpr double kTurn = 6.283185307179586476925;

double farthest(Vec3 p) { return std::max({std::fabs(p.x), std::fabs(p.y), std::fabs(p.z)}); }

double speed_limit(const World &w) {
  return w.def.obstacle_speed > 0 ? w.def.obstacle_speed : kObstacleSpeed;
}

// Radius at which a rotation of an obstacle is measured. A plane has no extent; its tilt is measured at 1 m.
double turned(const Obstacle &o) {
  const Shape shape = Shape(o.def.shape);
  return shape == Shape::plane || shape == Shape::none ? 1 : o.standing().extent();
}

double speed_of(const Obstacle &o, const Pose &from, const Pose &to, double seconds) {
  return norm(to.position - from.position) / seconds +
         norm(spin_between(from.rotation, to.rotation, seconds)) * turned(o);
}

// `when`: a format, used for what is too fast only, since a step must not allocate.
DEFORM_PRINTF(4, 5)
void check_speed(const World &w, const Obstacle &o, double speed, const char *when, ...) {
  if (speed <= speed_limit(w) * (1 + 1e-9)) return;
  va_list args;
  va_start(args, when);
  const std::string text = vformat(when, args);
  va_end(args);
  fail(DFM_E_ARG,
       "%s '%s' would move at %.4g m/s %s; at most %g m/s (dfm_world_def.obstacle_speed): give it more "
       "time, or put it there without a motion (%s)",
       o.rigid ? "tool" : "obstacle", o.name.c_str(), speed, text.c_str(), speed_limit(w),
       o.rigid ? "dfm_tool_teleport" : "dfm_obstacle_teleport");
}

}  // namespace

double largest_coordinate(const double *x, size_t n, size_t stride) {
  double far = 0;
  for (size_t i = 0; i < n; ++i) far = std::max(far, farthest(load3(x + stride * i)));
  return far;
}

void check_velocity(const Named &whose, Vec3 velocity, Vec3 spin, double radius) {
  const double speed = farthest(velocity) + farthest(spin) * radius;
  if (!(speed <= kLight))
    refuse(whose, ": a velocity of %.4g m/s (spin included) is above the speed of light; give a smaller one",
           speed);
}

void check_place(const World &w, const Named &whose, double far) {
  const double least = kUnits * kUnit * far;
  if (w.offset > 0 && !w.bodies.empty() && !(least <= w.offset))
    refuse(whose,
           ": a coordinate is %.4g m, where neighboring numbers are %.3g m apart, too coarse for the contact "
           "offset of %g m; move the scene nearer to the origin",
           far, kUnit * far, w.offset);
}

void check_resolved(const Body &b, double far, double edge) {
  if (!(kUnits * kUnit * far <= 0.1 * edge))
    refuse(b,
           ": a coordinate is %.4g m, where neighboring numbers are %.3g m apart, too coarse for contact "
           "between edges of %g m; move the scene nearer to the origin",
           far, kUnit * far, edge);
}

double thickness(const Body &b) {
  const Surface &s = b.surface;
  double area = 0;
  const auto at = [&](uint32_t surfel) {
    return s.identity() ? b.p.rest_at(s.point[surfel]) : load3(&s.rest[size_t{3} * surfel]);
  };
  for (uint32_t t = 0; t < s.ntri; ++t) area += 0.5 * norm(s.area2(t, at));
  return area > 0 ? 2 * b.rest_volume / area : 0;
}

void check_offset(const World &w) {
  for (auto &b : w.bodies) {
    if (w.def.contact_offset > 0 && !b->cut.whole)  // no host chooses how thick what a cut leaves is
      if (const double thick = thickness(*b); !(w.offset <= kOfThickness * thick))
        fail(DFM_E_ARG,
             "a contact offset of %g m is too large for body '%s', whose mean thickness is %.3g m: give at "
             "most a tenth of that, or leave the offset out",
             w.offset, b->name.c_str(), thick);
    check_place(w, *b, largest_coordinate(b->p.x.data(), b->p.n, kStride));
  }
  for (auto &o : w.obstacles)
    check_place(w, {o->rigid ? "rigid body" : "obstacle", o->name.c_str()}, farthest(o->pose.position));
}

void check_motion_speed(const World &w, const Obstacle &o) {
  for (size_t i = 1; i < o.keys.size(); ++i)
    check_speed(
        w, o,
        speed_of(o, to_pose(o.keys[i - 1].pose), to_pose(o.keys[i].pose), o.keys[i].t - o.keys[i - 1].t),
        "between two of its keys");
  check_speed(w, o, kTurn * std::fabs(o.def.sine.frequency) * norm(load3(o.def.sine.amplitude)),
              "in its sine");
}

void check_way(const World &w, const Obstacle &o, const Pose &from, const Pose &to, double dt) {
  check_speed(w, o, speed_of(o, from, to, dt), "in a step of %g s", dt);
}

void check_target_speeds(const World &w, double dt) {
  for (auto &o : w.obstacles)
    if (o->has_target) check_way(w, *o, o->pose, o->target, dt);
}

}  // namespace dfm
