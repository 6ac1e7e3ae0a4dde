// Steps that fail half way: ODE's bodies stand where the dfm_world does, those that it does not know
// included, and go on as if nothing had been.
#include <gtest/gtest.h>

#include <cstdlib>
#include <utility>

#include "ode.h"
#include "saboteur.h"

namespace {

using namespace test;

// What a step may leave behind in a body.
struct Stand {
  Vec position, velocity, spin, force, torque;
  std::array<double, 4> rotation;
  int enabled, gyroscopic;
};
Stand stand(dBodyID b) {
  const dReal *const q = dBodyGetQuaternion(b);
  return {position(b),
          velocity(b),
          vec(dBodyGetAngularVel(b)),
          vec(dBodyGetForce(b)),
          vec(dBodyGetTorque(b)),
          {q[0], q[1], q[2], q[3]},
          dBodyIsEnabled(b),
          dBodyGetGyroscopicMode(b)};
}

// A box with a soft ball on it; on a hinge of the box hangs a weight without a geom, which the dfm_world does
// not know, and on that a sleeping one.
struct Swing {
  Ode ode;
  dBodyID box, weight, sleeper;
  dJointID hinge;
  dJointFeedback feedback{};
  Swing() : ode({0, 0, -9.81}) {
    soft_bed(ode);
    box = ode.box({0.08, 0.08, 0.05}, 2, {0.15, 0.15, 0.152});
    weight = ode.body(0.5, {1e-3, 2e-3, 3e-3}, {0.15, 0.3, 0.3});
    dBodySetAngularVel(weight, 1, 0, 0);
    hinge = dJointCreateHinge(ode.world, nullptr);
    dJointAttach(hinge, box, weight);
    dJointSetHingeAnchor(hinge, 0.15, 0.15, 0.25);
    dJointSetHingeAxis(hinge, 1, 0, 0);
    dJointSetFeedback(hinge, &feedback);
    ode.step();  // the box is known now, before the saboteur
    Saboteur::join(ode.soft);
    sleeper = ode.body(0.2, {1e-3, 1e-3, 1e-3}, {0.15, 0.4, 0.3});
    const dJointID tie = dJointCreateBall(ode.world, nullptr);
    dJointAttach(tie, weight, sleeper);
    dJointSetBallAnchor(tie, 0.15, 0.35, 0.3);
  }
  std::array<Stand, 3> stands() const { return {stand(box), stand(weight), stand(sleeper)}; }
};

constexpr double kStep = 0.04;  // of several sub-steps

// To the last bit, but for rotations: ODE makes them unit anew whenever they are set.
void expect_alike(const std::array<Stand, 3> &a, const std::array<Stand, 3> &b) {
  for (size_t i = 0; i < a.size(); ++i) {
    SCOPED_TRACE(i);
    EXPECT_EQ(a[i].position, b[i].position);
    EXPECT_EQ(a[i].velocity, b[i].velocity);
    EXPECT_EQ(a[i].spin, b[i].spin);
    EXPECT_EQ(a[i].force, b[i].force);
    EXPECT_EQ(a[i].torque, b[i].torque);
    EXPECT_EQ(a[i].enabled, b[i].enabled);
    EXPECT_EQ(a[i].gyroscopic, b[i].gyroscopic);
    for (size_t k = 0; k < 4; ++k) EXPECT_NEAR(a[i].rotation[k], b[i].rotation[k], 3e-16);
  }
}

}  // namespace

// Nothing has moved: every body, its forces and its sleep are as before the call, and the next steps are
// those of a world in which nothing had failed.
TEST(OdeFailure, InTheFirstSubStepOrInterrupted_LeavesNoTrace) {
  for (const auto &[where, interrupted] :
       {std::pair{Saboteur::predict, false}, {Saboteur::commit, false}, {Saboteur::commit, true}}) {
    SCOPED_TRACE(where + 2 * interrupted);
    Swing struck, calm;
    for (Swing *s : {&struck, &calm}) {
      for (int i = 0; i < 5; ++i) s->ode.step(kStep);
      dBodyDisable(s->sleeper);
      dBodyAddForce(s->weight, 0.3, 0, 0);
      dBodyAddTorque(s->box, 0, 0, 0.1);
    }
    const auto before = struck.stands();
    Saboteur::arm(where, interrupted ? 3 : 0, interrupted ? struck.ode.soft : 0);
    EXPECT_EQ(dfm_ode_step(struck.ode.adapter, kStep), interrupted ? DFM_DISCARD : DFM_E_DIVERGED);
    expect_alike(struck.stands(), before);
    EXPECT_EQ(dJointGetFeedback(struck.hinge), &struck.feedback);
    for (Swing *s : {&struck, &calm})
      for (int i = 0; i < 5; ++i) s->ode.step(kStep);
    expect_alike(struck.stands(), calm.stands());
    EXPECT_EQ(dfm_world_hash(struck.ode.soft), dfm_world_hash(calm.ode.soft));
  }
}

// Some sub-steps have counted: all bodies are where the last of these ended, whichever of them the
// dfm_world knows.
TEST(OdeFailure, InALaterSubStep_LeavesAllBodiesAtTheSameTime) {
  for (const Saboteur::Where where : {Saboteur::predict, Saboteur::commit})
    for (const int good : {1, 2, 3}) {
      Swing struck, calm;
      for (Swing *s : {&struck, &calm}) s->ode.step(kStep);
      ASSERT_GT(stats(calm.ode.soft).last_substeps, 4u);
      const double start = dfm_world_time(struck.ode.soft);
      Saboteur::arm(where, good);
      dBodyAddForce(struck.weight, 0.3, 0, 0);
      dBodyAddForce(calm.weight, 0.3, 0, 0);
      EXPECT_EQ(dfm_ode_step(struck.ode.adapter, kStep), DFM_E_DIVERGED);
      const double passed = dfm_world_time(struck.ode.soft) - start;
      EXPECT_GT(passed, 0);
      // errors of joints close by a share per step of the caller's
      dWorldSetERP(calm.ode.world, dWorldGetERP(calm.ode.world) * passed / kStep);
      calm.ode.step(passed);
      ASSERT_EQ(stats(calm.ode.soft).last_substeps, uint32_t(good));
      const auto a = struck.stands(), b = calm.stands();
      for (size_t i = 0; i < a.size(); ++i) {
        EXPECT_LT(apart(a[i].position, b[i].position), 1e-12) << where << " " << good << " " << i;
        EXPECT_LT(apart(a[i].velocity, b[i].velocity), 1e-9) << where << " " << good << " " << i;
        EXPECT_LT(apart(a[i].spin, b[i].spin), 1e-9) << where << " " << good << " " << i;
        EXPECT_EQ(a[i].force, Vec{}) << i;  // they acted
      }
    }
}

// A step that is not begun at all leaves the forces for the next one, too.
TEST(OdeFailure, DiscardedStep_KeepsTheForces) {
  Swing s;
  s.ode.step(kStep);
  dBodyAddForce(s.weight, 0.3, 0, 0);
  const auto before = s.stands();
  EXPECT_EQ(dfm_ode_step(s.ode.adapter, 1e3), DFM_DISCARD);
  expect_alike(s.stands(), before);
}

// ---- the end of the program -------------------------------------------------------------------------------

namespace {

// Detaches when statics go, after those that came later; the exit code says whether the adapter
// was still there.
struct Late {
  dfm_ode adapter = 0;
  ~Late() {
    if (adapter) std::_Exit(dfm_ode_detach(adapter) == DFM_OK ? 0 : 1);
  }
};
[[noreturn]] void detach_late() {
  // before the first adapter, so destroyed after all that comes with it
  static Late late;
  static Ode *const ode = new Ode;
  ode->ball(0.1, 1, {0, 0, 1});
  ode->step();
  late.adapter = ode->adapter;
  std::exit(2);
}
[[noreturn]] void never_detach() {
  Ode *const ode = new Ode;
  ode->box({0.2, 0.2, 0.05}, 1, {0, 0, 0.049});
  dCreatePlane(ode->space, 0, 0, 1, 0);
  ode->step();
  dSpaceDestroy(ode->space);
  dWorldDestroy(ode->world);
  dCloseODE();
  ok(dfm_world_destroy(ode->soft));
  std::exit(::testing::Test::HasFailure());
}

}  // namespace

TEST(OdeExitDeathTest, AdapterOfAHostThatExitsLate_IsStillValid) {
  // a process of its own, in which no adapter has been before
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(detach_late(), ::testing::ExitedWithCode(0), "");
}
TEST(OdeExitDeathTest, AdapterThatIsNotDetached_AccessesNothingAtExit) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(never_detach(), ::testing::ExitedWithCode(0), "");
}
