// Cuts that are made beside the steps (dfm_body_set_cut_delay): when faces open, and that nothing else
// depends on who makes the cut, and when.
#include <thread>

#include "deform/tool.h"
#include "rigid.h"
#include "support.h"

namespace {

constexpr double kStep = 1e-3;

// A tough cube of 40 mm about the origin that moves through empty space, or lies in a box with friction that
// remembers; and a blade above it.
struct Cube {
  static constexpr double kEnergy = 100, kArea = 0.04 * 0.04;  // J/m2, m2
  test::Context context;
  dfm_world w;
  dfm_body body = 0;
  dfm_tool blade = 0;
  double z = 0.05;
  uint64_t opened = 0, events = 0, largest = 0;
  explicit Cube(double delay, const char *model = "msm", uint32_t threads = 1, bool floor = false,
                double velocity = 0)
      : context(threads), w(test::make_world(context, {0, 0, floor ? -9.81 : 0})) {
    dfm_tetmesh mesh = 0;
    const double size[] = {0.04, 0.04, 0.04}, energy = kEnergy;
    test::ok(dfm_tetmesh_make(context, "beam", size, 600, &mesh));
    dfm_body_def d = dfm_body_def_default();
    test::lend(mesh, d);
    dfm_material_def m = dfm_material_def_default();
    m.name = "tissue";
    m.young = 3e4;
    m.damping_stiffness = 2e-3;
    const dfm_param_value row{"fracture_energy", &energy, 1};
    m.extra = {sizeof(dfm_params), 1, &row};
    test::ok(dfm_material_create(w, &m, &d.material));
    d.name = "cube";
    d.model = model;
    for (double &c : d.pose.position) c = -0.02;
    d.velocity[0] = velocity;
    test::ok(dfm_body_create(w, &d, &body));
    if (floor) {
      dfm_obstacle_def o = dfm_obstacle_def_default();
      o.name = "floor";
      o.shape = DFM_SHAPE_PLANE;
      o.pose.position[2] = -0.02;
      dfm_obstacle plane = 0;
      test::ok(dfm_obstacle_create(w, &o, &plane));
      test::set_friction(w, 0.4, "lugre");
    }
    dfm_tool_def td = dfm_tool_def_default();
    td.name = "knife";
    td.shape = DFM_TOOL_BLADE;
    const double half[] = {0.0005, 0.03, 0.02};
    std::copy(half, half + 3, td.half_size);
    td.pose.position[0] = 0.001;
    td.pose.position[2] = z;
    test::ok(dfm_tool_create(w, &td, &blade));
    test::ok(dfm_tool_set_cuts(blade, DFM_CUT_SPLIT, 0, 1, &body));
    test::ok(dfm_body_set_cut_delay(body, delay));
  }
  void step(double speed = 1) {
    z -= speed * kStep;
    const dfm_pose p{{0.001, 0, z}, {0, 0, 0, 1}};
    test::ok(dfm_tool_set_pose(blade, &p, nullptr));
    test::ok(dfm_world_step(w, kStep, nullptr));
    for (const dfm_contact_event &e : test::listed(dfm_world_events, w))
      if (e.kind == uint32_t{DFM_EVENT_CUT}) {
        EXPECT_EQ(e.a, body);
        opened += e.key;
        ++events;
      }
  }
  void steps(int n, double speed = 1) {
    for (int i = 0; i < n; ++i) step(speed);
  }
  uint32_t waiting() const {
    uint32_t n = 0;
    test::ok(dfm_body_cut_delay(body, nullptr, &n));
    return n;
  }
  uint32_t points() const {
    dfm_body_info i{};
    i.size = sizeof i;
    test::ok(dfm_body_get_info(body, &i));
    return i.npoint;
  }
  uint32_t parts() const {
    dfm_cut_info info{};
    info.size = sizeof info;
    test::ok(dfm_body_remove_cells(body, 0, nullptr, &info));
    return info.parts;
  }
};

const char *const kModels[] = {"msm", "corotational_fem"};

}  // namespace

TEST(CutDelay, Faces_OpenTheDelayAfterTheBlade_InOneStep) {
  Cube s(0.010);
  while (s.waiting() == 0) s.step();
  const uint32_t first = s.waiting();
  for (int i = 0; i < 9; ++i) {
    s.step();
    EXPECT_EQ(s.events, 0u) << i;
  }
  const uint32_t met = s.waiting(), whole = s.points();
  EXPECT_GT(met, first) << "the blade goes on meanwhile";
  s.step(0);
  EXPECT_EQ(s.opened, first);
  EXPECT_EQ(s.waiting(), met - first);
  s.steps(9, 0);
  EXPECT_EQ(s.opened, first);
  s.step(0);
  EXPECT_EQ(s.opened, met) << "what it has met meanwhile opens the delay after that";
  EXPECT_EQ(s.waiting(), 0u);
  EXPECT_GT(s.points(), whole);
}

// The same cut as without a delay, with its work, once; mass and momenta to rounding.
TEST(CutDelay, Blade_PartsTheBody_AndPaysOnce) {
  for (const char *model : kModels)
    for (const double velocity : {0.0, 1e-3}) {
      Cube s(0.008, model, 1, false, velocity);
      const dfm_body_measure before = test::measure(s.body);
      s.steps(60);
      s.steps(20, 0);
      EXPECT_EQ(s.waiting(), 0u);
      EXPECT_EQ(s.parts(), 2u) << model;
      const dfm_body_measure after = test::measure(s.body);
      EXPECT_NEAR(after.mass, before.mass, 1e-15);
      for (int k = 0; k < 3; ++k) {
        EXPECT_NEAR(after.momentum[k], before.momentum[k], 1e-14 * before.mass);
        EXPECT_NEAR(after.angular[k], before.angular[k], 1e-14 * before.mass);
      }
      dfm_tool_state t{};
      t.size = sizeof t;
      test::ok(dfm_tool_get_state(s.blade, &t));
      if (velocity == 0) {
        EXPECT_NEAR(t.work, Cube::kEnergy * Cube::kArea, 1e-9 * Cube::kEnergy * Cube::kArea);
      }
    }
}

// However many threads there are, and whether the one beside the steps is in time.
TEST(CutDelay, OnOneTwoOrFourThreads_TheBitsAreTheSame_InTimeOrLate) {
  const auto run = [](uint32_t threads, bool hurry) {
    Cube s(0.006, "msm", threads, true);
    for (int i = 0; i < 70; ++i) {
      s.step(i < 60 ? 1 : 0);
      // most cuts are made by the time that they are needed, or only just begun
      if (!hurry && s.waiting() > 0) std::this_thread::sleep_for(std::chrono::milliseconds(4));
    }
    EXPECT_GT(s.events, 3u);
    return test::snapshot(s.w);
  };
  const std::string one = run(1, false);
  EXPECT_TRUE(run(1, true) == one);
  EXPECT_TRUE(run(2, false) == one);
  EXPECT_TRUE(run(4, true) == one);
}

TEST(CutDelay, Snapshot_WhileFacesWait_GoesOnTheSameWay) {
  for (const char *model : kModels) {
    Cube s(0.012, model, 1, true);
    while (s.events < 2) s.step();
    s.steps(5);
    ASSERT_GT(s.waiting(), 0u);
    const std::string half = test::snapshot(s.w);
    const double z = s.z;
    s.steps(20);
    const std::string end = test::snapshot(s.w);
    test::ok(dfm_world_restore(s.w, half.data(), half.size()));
    s.z = z;
    s.steps(20);
    EXPECT_TRUE(test::snapshot(s.w) == end) << model;
    Cube other(0.012, model, 2, true);
    test::ok(dfm_world_restore(other.w, half.data(), half.size()));
    other.z = z;
    EXPECT_GT(other.waiting(), 0u);
    other.steps(20);
    EXPECT_TRUE(test::snapshot(other.w) == end) << model;
  }
}

// A cut by the host in between is not waited for, and what waits opens in what it has left.
TEST(CutDelay, CutByTheHost_InBetween_LosesNoFace) {
  Cube s(0.010);
  while (s.waiting() == 0) s.step();
  s.steps(4);
  dfm_cut_def d = dfm_cut_def_default();
  d.shape = DFM_CUT_BOX;
  d.pose.position[0] = 0.02;
  for (double &h : d.half_size) h = 0.006;
  dfm_cut_info info{};
  info.size = sizeof info;
  test::ok(dfm_body_cut(s.body, &d, &info));
  ASSERT_GT(info.cells, 0u);
  s.steps(60);
  EXPECT_EQ(s.waiting(), 0u);
  EXPECT_EQ(s.parts(), 2u);
}

TEST(CutDelay, WorldWithAFaceThatWaits_CanGo) {
  Cube s(0.05);
  while (s.waiting() == 0) s.step();
  s.step();
}

TEST(CutDelay, WhatIsWrong_IsRefused) {
  Cube s(0);
  double delay = -1;
  EXPECT_EQ(dfm_body_set_cut_delay(s.body, -1), DFM_E_ARG);
  EXPECT_EQ(dfm_body_set_cut_delay(s.body, NAN), DFM_E_ARG);
  EXPECT_EQ(dfm_body_set_cut_delay(0, 0.01), DFM_E_HANDLE);
  test::ok(dfm_body_set_cut_delay(s.body, 0.02));
  test::ok(dfm_body_cut_delay(s.body, &delay, nullptr));
  EXPECT_EQ(delay, 0.02);
  while (s.waiting() == 0) s.step();
  EXPECT_EQ(dfm_body_set_cut_delay(s.body, 0), DFM_E_STATE);
  EXPECT_GT(s.waiting(), 0u);

  test::Context context;
  const dfm_world w = test::make_world(context, {0, 0, 0});
  test::BodyOptions o;
  o.model = "shape_matching";
  const dfm_body body = test::make_body(context, w, "beam", {0.04, 0.04, 0.04}, 100, o);
  EXPECT_EQ(dfm_body_set_cut_delay(body, 0.01), DFM_E_UNSUPPORTED);
}
