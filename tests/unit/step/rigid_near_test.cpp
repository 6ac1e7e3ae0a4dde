// Which pairs of rigid things a sub-step looks at.
#include "../world/inside.h"
#include "rigid.h"
#include "step/context.h"
#include "step/rigid/tool_touch.h"

namespace {

void add_box(dfm_world w, const std::string &name, test::Vec at) {
  dfm_obstacle_def d = dfm_obstacle_def_default();
  d.name = name.c_str();
  d.shape = DFM_SHAPE_BOX;
  for (int k = 0; k < 3; ++k) {
    d.half_size[k] = 0.01;
    d.pose.position[k] = at[size_t(k)];
  }
  dfm_obstacle o = 0;
  test::ok(dfm_obstacle_create(w, &d, &o));
}

}  // namespace

// 20 boxes over a plane, and 300 obstacles far from them: 6,000 pairs that cannot touch. Each box is near the
// plane, which has no end, one near an obstacle, and one comes to an obstacle within the step.
TEST(RigidNear, OfManyPairs_ThoseThatMayMeetAreLookedAt) {
  test::Context context;
  const dfm_world world = test::make_world(context, {0, 0, 0});
  test::add_plane(world, "floor", {0, 0, -1});
  std::vector<dfm_rigid_def> boxes;
  std::vector<std::string> names;
  for (int i = 0; i < 20; ++i) names.push_back("box" + std::to_string(i));
  for (int i = 0; i < 20; ++i)
    boxes.push_back(test::box(names[size_t(i)].c_str(), {0.01, 0.01, 0.01}, 0.01, {0.1 * i, 0, 0}));
  boxes[7].velocity[1] = 200;
  test::create(world, boxes);
  for (int i = 0; i < 300; ++i) add_box(world, "far" + std::to_string(i), {0.1 * i, 50, 0});
  add_box(world, "beside", {0.5, 0.021, 0});
  add_box(world, "ahead", {0.7, 0.15, 0});
  test::ok(dfm_world_step(world, 1e-3, nullptr));
  const dfm::World &w = test::inside(world);
  EXPECT_EQ(w.pairs.tool_law.size(), 20 * 19 / 2 + 20 * 303u);
  EXPECT_EQ(w.steps->tools->near(), 22u);
}
