// Bodies that are set on each other, or a little into each other: no motion has made that depth, and opening
// it makes none to speak of, at any stiffness and step.
#include <string>

#include "obstacle.h"
#include "world.h"

namespace {

using namespace test;

constexpr double kMax = 1e-3;  // m/s; depths open at 0.7 of it, and the body may shake

// m/s, the largest speed along z of the body's center of mass in these seconds.
double fastest(dfm_world world, dfm_body body, double seconds, double step) {
  double most = 0;
  for (double t = 0; t < seconds; t += step) {
    ok(dfm_world_step(world, step, nullptr));
    most = std::max(most, std::fabs(measure(body).velocity[2]));
  }
  return most;
}

// A block of 0.5 kg with its lower face at z, for a tenth of a second, without the weight that would set it
// moving by itself: the speed of its center of mass, m/s.
double set_down(const char *model, double young, int32_t integrator, double step, double z) {
  const Context context;
  const dfm_world world = make_world(context, {0, 0, 0}, integrator);
  add_plane(world, "floor");
  BodyOptions o;
  o.model = model;
  o.young = young;
  o.damping_stiffness = 0.002;
  o.position = {0, 0, z};
  return fastest(world, make_body(context, world, "beam", {0.1, 0.1, 0.05}, 60, o), 0.1, step);
}

TEST(SetDown, OnAFloor_GetsAMillimeterPerSecond) {
  for (const char *model : {"msm", "corotational_fem", "linear_fem", "meshless", "shape_matching"})
    for (const int32_t integrator : {DFM_INTEGRATOR_SYMPLECTIC_EULER, DFM_INTEGRATOR_IMPLICIT_EULER})
      for (const double z : {0.0, -2e-5}) {
        const std::string what = std::string(model) + ", " + std::to_string(integrator);
        const double speed = set_down(model, 1e7, integrator, 1e-3, z);
        EXPECT_LT(speed, kMax) << what << ", z " << z;
        EXPECT_GT(speed, 0.6 * kMax) << what << ", z " << z;
      }
}

TEST(SetDown, AtAnyStiffnessAndStep_GetsTheSame) {
  for (const double young : {1e6, 1e8}) {
    EXPECT_LT(set_down("msm", young, DFM_INTEGRATOR_SYMPLECTIC_EULER, 1e-4, 0), kMax) << young;
    EXPECT_LT(set_down("msm", young, DFM_INTEGRATOR_IMPLICIT_EULER, 1.0 / 60, 0), kMax) << young;
  }
}

// One on another, whose meshes have nothing in common.
TEST(SetDown, OnASoftBody_BothStay) {
  const Context context;
  const dfm_world world = make_world(context, {0, 0, -9.81}, DFM_INTEGRATOR_SYMPLECTIC_EULER);
  add_plane(world, "floor");
  BodyOptions o;
  o.model = "corotational_fem";
  o.young = 1e7;
  o.damping_stiffness = 0.002;
  const dfm_body lower = make_body(context, world, "beam", {0.1, 0.1, 0.05}, 100, o);
  o.position = {0.013, 0.007, 0.05};
  const dfm_body upper = make_body(context, world, "beam", {0.08, 0.08, 0.05}, 60, o);
  double fastest = 0;
  for (int k = 0; k < 100; ++k) {
    ok(dfm_world_step(world, 1e-3, nullptr));
    for (const dfm_body b : {lower, upper}) fastest = std::max(fastest, std::fabs(measure(b).velocity[2]));
  }
  EXPECT_LT(fastest, 1.5 * kMax) << "two gaps open at once, and edges come to bear";
}

// On a body of the same kind, and into it by up to d_c. From half of d_c on the guard looks at the pair as
// well; faces that lie on each other it leaves to contact, since rounding is no distance to keep.
void expect_stays(const char *model, double young, int32_t integrator, double step, double depth) {
  const Context context;
  const dfm_world world = make_world(context, {0, 0, 0}, integrator);
  BodyOptions o;
  o.model = model;
  o.young = young;
  o.damping_stiffness = 0.002;
  make_body(context, world, "beam", {0.2, 0.2, 0.05}, 200, o);
  o.position = {0.05, 0.05, 0.05 - depth};
  const dfm_body upper = make_body(context, world, "beam", {0.1, 0.1, 0.05}, 60, o);
  const std::string what = std::string(model) + ", " + std::to_string(young) + " Pa, " +
                           std::to_string(integrator) + ", " + std::to_string(step) + " s, " +
                           std::to_string(depth) + " m";
  EXPECT_LT(fastest(world, upper, std::max(0.03, 3 * step), step), kMax) << what;
  EXPECT_GT(stats(world).contacts, 0u) << what;
  EXPECT_EQ(stats(world).guard_solves, 0u) << what;
}

TEST(SetDown, IntoASoftBody_GetsAMillimeterPerSecond) {
  for (const double young : {1e5, 1e7})
    for (const double depth : {0.0, 4e-5}) {
      for (const char *model :
           {"msm", "corotational_fem", "linear_fem", "shape_matching", "modal", "condensed"})
        expect_stays(model, young, DFM_INTEGRATOR_SYMPLECTIC_EULER, 1e-3, depth);
      for (const char *model : {"msm", "corotational_fem", "linear_fem"})
        expect_stays(model, young, DFM_INTEGRATOR_IMPLICIT_EULER, 1.0 / 60, depth);
    }
}

// A body that steps itself, in steps of another length than its contact.
TEST(SetDown, ModalBodyOnAFloor_DoesNotHop) {
  const Context context;
  const dfm_world world = make_world(context, {0, 0, -9.81});
  add_plane(world, "floor");
  BodyOptions o;
  o.model = "modal";
  o.young = 1e7;
  o.damping_stiffness = 0.002;
  const dfm_body body = make_body(context, world, "beam", {0.1, 0.1, 0.05}, 60, o);
  EXPECT_LT(fastest(world, body, 0.05, 1e-4), kMax);
}

// The user's own speed holds here, too.
TEST(SetDown, WithARecoverySpeed_OpensByThat) {
  const Context context;
  dfm_world_def def = dfm_world_def_default();
  def.recovery_speed = 0.02;
  dfm_world world = 0;
  ok(dfm_world_create(context, &def, &world));
  add_plane(world, "floor");
  BodyOptions o;
  o.young = 1e6;
  o.damping_stiffness = 0.002;
  const dfm_body body = make_body(context, world, "beam", {0.1, 0.1, 0.05}, 60, o);
  double fastest = 0;
  for (int k = 0; k < 100; ++k) {
    ok(dfm_world_step(world, 1e-4, nullptr));
    fastest = std::max(fastest, measure(body).velocity[2]);
  }
  EXPECT_GT(fastest, 0.01);
  EXPECT_LT(fastest, 2 * 0.02);
}

}  // namespace
