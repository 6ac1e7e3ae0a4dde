// How fast a bond closes what it is open by.
#include "../world/inside.h"
#include "state/obstacle.h"
#include "step/context.h"
#include "step/solve/attach.h"
#include "world.h"

// The guard may cut a sub-step to pieces of any length. What a bond is open by closes within the planned
// sub-step: within a piece of a nanosecond, ten micrometers are 10 km/s.
TEST(BondGap, InPiecesOfTheGuard_ClosesInThePlannedSubStep) {
  test::Context context;
  const dfm_world world = test::make_world(context, {0, 0, 0});
  test::BodyOptions o;
  o.position = {0, 0, -0.05};
  const dfm_body beam = test::make_body(context, world, "beam", {0.05, 0.05, 0.05}, 60, o);
  dfm_obstacle_def d = dfm_obstacle_def_default();
  d.name = "hook";
  d.shape = DFM_SHAPE_BOX;
  d.half_size[0] = d.half_size[1] = d.half_size[2] = 0.05;
  d.pose.position[2] = 0.05;
  dfm_obstacle hook = 0;
  test::ok(dfm_obstacle_create(world, &d, &hook));
  const double box[] = {-9, -9, -1e-9, 9, 9, 1e-9};
  dfm_attach_def held = dfm_attach_def_default();
  held.to = hook;
  held.box = box;
  uint32_t number = 0;
  test::ok(dfm_body_attach(beam, &held, &number));
  test::ok(dfm_world_step(world, 1e-3, nullptr));

  dfm::World &w = test::inside(world);
  dfm::StepContext &step = *w.steps;
  const double open = 0.5 * w.offset;
  w.obstacles[0]->pose.position.z += open;
  step.length.planned = 1e-3;
  for (const double h : {1e-3, 1e-5, 1e-9}) {
    step.h = h;
    dfm::make_bonds(w, step, false);
    ASSERT_FALSE(step.bonds.empty());
    for (const dfm::Bond &b : step.bonds)
      EXPECT_NEAR(dfm::norm(b.rate), open / 1e-3, 1e-6 * open / 1e-3) << h;
  }
}
