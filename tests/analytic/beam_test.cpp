// A clamped beam under its own weight. Euler-Bernoulli with Timoshenko's shear: w = q L^4/(8 E I) + q L^2/(2 k G A), k = 5/6, and for springs
// alone G = E/(2 (1 + 1/4)). Source: S. Timoshenko, Phil. Mag. 41 (1921); the springs' Poisson ratio: doc/models/msm.md.
#include "world.h"

namespace {

constexpr double kL = 0.5, kH = 0.1, kRho = 1000, kG = 9.81;

double timoshenko(double young) {
  const double area = kH * kH, inertia = kH * kH * kH * kH / 12, q = kRho * kG * area, shear = young / 2.5;
  return q * kL * kL * kL * kL / (8 * young * inertia) + q * kL * kL / (2 * (5.0 / 6) * shear * area);
}

// Sag of the tip's middle at rest, by a run damped until nothing moves.
double sag(double young, uint32_t cells) {
  test::Context context;
  const dfm_world world = test::make_world(context, {0, 0, -kG});
  test::BodyOptions o;
  o.young = young, o.density = kRho, o.damping_mass = 30, o.damping_stiffness = 2e-5;
  const dfm_body body = test::make_body(context, world, "beam", {kL, kH, kH}, cells, o);
  const double lo[3] = {-0.001, -1, -1}, hi[3] = {0.001, 1, 1};
  @FIX@
  test::run(world, 0.8, 2e-4);
  return @SAG@;
}

}  // namespace
