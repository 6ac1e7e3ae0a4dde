// ode.hpp: what ends what, errors in both ways, both worlds in one snapshot.
#include <deform/ode.hpp>
#include <gtest/gtest.h>

#include <cmath>

#include "support.h"

namespace {

namespace values = deform::values;

// A ball of ODE over a soft one, both over ODE's plane.
struct Scene {
  dWorldID world = dWorldCreate();
  dSpaceID space = dHashSpaceCreate(nullptr);
  dBodyID body = dBodyCreate(world);
  dGeomID geom = dCreateSphere(space, 0.05);
  deform::Unique<deform::Context> context;
  deform::Unique<deform::World> soft;
  deform::Body ball;
  deform::OdeDef def;

  Scene() {
    deform::ContextDef quiet;
    quiet.plugin_dir = DEFORM_PLUGIN_DIR;
    quiet.log = [](void *, int32_t, const char *) {};
    context = deform::Context::make(quiet);
    soft = context.make_world();
    dWorldSetGravity(world, 0, 0, -9.81);
    dCreatePlane(space, 0, 0, 1, 0);
    dGeomSetBody(geom, body);
    dBodySetPosition(body, 0, 0, 0.27);
    const auto mesh = context.make_tets("ball", {0.1}, 200);
    deform::BodyDef soft_ball;
    soft_ball.set_mesh(mesh);
    soft_ball.pose.position[2] = 0.101;
    ball = soft.add_body(soft_ball);
    def.world = world;
    def.space = space;
  }
  ~Scene() {
    dSpaceDestroy(space);
    dWorldDestroy(world);
  }
  Scene(const Scene &) = delete;
  Scene &operator=(const Scene &) = delete;
};

struct OdeHpp : ::testing::Test {
  OdeHpp() { dInitODE2(0); }
  ~OdeHpp() override { dCloseODE(); }
};

}  // namespace

TEST_F(OdeHpp, UniqueOde_DetachesAtTheEndOfItsScope) {
  Scene s;
  const values::World as_values(s.soft.get());
  {
    const auto ode = deform::attach_ode(s.soft, s.def);
    const auto second = values::attach_ode(as_values, s.def);
    EXPECT_EQ(second.status(), DFM_E_STATE);
    EXPECT_THROW(deform::attach_ode(s.soft, s.def), deform::Error);
    ASSERT_TRUE(ode.step(1e-3));
    EXPECT_EQ(ode.stats().bodies, 1u);
  }
  EXPECT_TRUE(values::attach_ode(as_values, s.def));
}

TEST_F(OdeHpp, Step_MovesBothWorldsAndReportsTheirContact) {
  Scene s;
  const auto ode = deform::attach_ode(s.soft, s.def);
  const deform::Rigid rigid = ode.rigid(s.body);
  double most = 0;
  for (int i = 0; i < 200; ++i) {
    ASSERT_TRUE(ode.step(1e-3));
    most = std::max(most, rigid.contact_wrench().force[2]);
  }
  EXPECT_LT(dBodyGetPosition(s.body)[2], 0.26);
  EXPECT_GT(most, 0);
  EXPECT_EQ(ode.stats().steps, 200u);
  EXPECT_NEAR(s.soft.time(), 0.2, 1e-12);
}

TEST_F(OdeHpp, Snapshot_TakesBothWorldsBack) {
  Scene s;
  const auto ode = deform::attach_ode(s.soft, s.def);
  for (int i = 0; i < 80; ++i) ASSERT_TRUE(ode.step(1e-3));
  std::vector<std::byte> saved(ode.snapshot({}));
  EXPECT_EQ(ode.snapshot(saved), saved.size());
  EXPECT_EQ(ode.snapshot(std::span(saved).first(0)), saved.size())
      << "an empty span asks, whatever is behind it";
  const auto run_on = [&] {
    for (int i = 0; i < 40; ++i) EXPECT_TRUE(ode.step(1e-3));
    return std::pair{s.soft.hash(), dBodyGetPosition(s.body)[2]};
  };
  const auto first = run_on();
  ode.restore(saved);
  EXPECT_EQ(run_on(), first);
  EXPECT_EQ(values::Ode(ode.get()).restore(std::span(saved).first(8)).status(), DFM_E_FORMAT);
}

TEST_F(OdeHpp, SpansTooShort_AreRefusedBeforeTheCall) {
  Scene s;
  const auto ode = deform::attach_ode(s.soft, s.def);
  const double heights[3] = {};
  EXPECT_EQ(values::Ode(ode.get()).set_heights(s.geom, 1, 1, 2, 2, heights).status(), deform::spans_disagree);
  const double points[9] = {};
  for (const std::vector<uint32_t> &polygons : {std::vector<uint32_t>{3, 0, 1, 2}, {3, 0, 1, 2, 3, 0, 1}})
    EXPECT_EQ(values::Ode(ode.get()).set_convex(s.geom, points, 2, polygons).status(),
              deform::spans_disagree);
}
