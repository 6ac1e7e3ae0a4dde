// Limits on the numbers that a world accepts: positions that doubles resolve, plausible speeds, a rest
// distance that fits the bodies.
#pragma once
#include <cstddef>

#include "core/error.h"
#include "math/vec3.h"
#include "state/motion.h"

namespace dfm {

inline constexpr double kLight = 299792458;    // m/s: no component of a velocity is above it
inline constexpr double kObstacleSpeed = 200;  // m/s, unless the world's def says otherwise

struct Body;
struct Obstacle;
struct World;

// Throw DFM_E_ARG, in one sentence that names the thing.
// radius: m, of the thing that rotates
void check_velocity(const Named &whose, Vec3 velocity, Vec3 spin = {}, double radius = 0);
// m, largest coordinate; where d_c is known
void check_place(const World &w, const Named &whose, double farthest);
// of a body: by its own median edge
void check_resolved(const Body &b, double farthest, double edge);
// all of them, once d_c is chosen
void check_offset(const World &w);
// Mean thickness of a body: 2 V / A, the thickness of a sheet, the radius of a rod, two thirds of
// that of a ball.
double thickness(const Body &b);

double largest_coordinate(const double *x, size_t n, size_t stride);  // m, of n points

// Motions of obstacles: by their keys and sine when they are made, by their target when dt is known.
void check_motion_speed(const World &w, const Obstacle &o);
void check_target_speeds(const World &w, double dt);
void check_way(const World &w, const Obstacle &o, const Pose &from, const Pose &to, double dt);

}  // namespace dfm
