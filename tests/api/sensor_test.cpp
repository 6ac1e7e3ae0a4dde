// Sensors: what overlaps them is told, and nothing is pushed.
#include <fstream>

#include "obstacle.h"
#include "query.h"
#include "rigid.h"
#include "stack.h"
#include "support.h"

namespace {

struct Event {
  uint32_t kind;
  uint64_t a, b;
  bool operator==(const Event &) const = default;
};
std::ostream &operator<<(std::ostream &to, const Event &e) {
  return to << "{" << e.kind << ", " << std::hex << e.a << ", " << e.b << std::dec << "}";
}

// Those of sensors; empties the list.
std::vector<Event> events_of(dfm_world w) {
  uint32_t n = 0;
  std::vector<dfm_contact_event> all(4096);
  test::ok(dfm_world_events(w, 4096, all.data(), &n));
  std::vector<Event> out;
  for (uint32_t i = 0; i < n; ++i) {
    if (all[i].kind != DFM_EVENT_SENSOR_BEGIN && all[i].kind != DFM_EVENT_SENSOR_END) continue;
    EXPECT_EQ(all[i].key, 0u);
    EXPECT_EQ(all[i].t, dfm_world_time(w));
    out.push_back({all[i].kind, all[i].a, all[i].b});
  }
  return out;
}

std::vector<uint64_t> things(uint64_t sensor) {
  uint32_t n = 0;
  test::ok(dfm_sensor_things(sensor, 0, nullptr, &n));
  std::vector<uint64_t> out(n);
  if (n) test::ok(dfm_sensor_things(sensor, n, out.data(), &n));
  return out;
}

dfm_obstacle gate(dfm_world w, uint32_t shape, double z, double half = 0.05) {
  dfm_obstacle_def d = dfm_obstacle_def_default();
  d.name = "gate";
  d.shape = shape;
  d.half_size[0] = d.half_size[1] = 0.3;
  d.half_size[2] = half;
  d.radius = half;
  d.half_length = 0.01;
  d.pose.position[2] = z;
  const test::Triangles cube = test::box_surface({0.3, 0.3, half}, 2);
  if (shape == DFM_SHAPE_MESH || shape == DFM_SHAPE_VOXELS) {
    d.npoint = uint32_t(cube.points.size() / 3);
    d.points = cube.points.data();
    d.ntriangle = uint32_t(cube.tris.size() / 3);
    d.triangles = cube.tris.data();
  }
  dfm_obstacle o = 0;
  test::ok(dfm_obstacle_create(w, &d, &o));
  test::ok(dfm_obstacle_set_sensor(o, true));
  return o;
}

dfm_body cube(dfm_context *c, dfm_world w, double z, const char *name = "cube") {
  test::BodyOptions o;
  o.name = name;
  o.position = {-0.05, -0.05, z};
  return test::make_body(c, w, "beam", {0.1, 0.1, 0.1}, 60, o);
}

}  // namespace

// Two planes are nowhere apart, and tell nothing.
TEST(Sensor, APlaneAmongPlanes_FindsBodiesAlone) {
  test::Context c;
  const test::Stack s = test::make_stack(c);
  const dfm_obstacle level = test::add_plane(s.world, "level", {0, 0, 0.05});
  test::ok(dfm_obstacle_set_sensor(level, true));
  test::run(s.world, 2e-3, 1e-3);
  EXPECT_EQ(things(level), std::vector<uint64_t>{s.lower});
}

class Gate : public ::testing::TestWithParam<uint32_t> {};

TEST_P(Gate, ABodyThatFallsThrough_EntersLeavesAndFallsFreely) {
  test::Context c;
  const dfm_world w = test::make_world(c);
  const dfm_obstacle g = gate(w, GetParam(), -0.3);
  const dfm_body b = cube(c, w, 0);
  bool sensor = false;
  test::ok(dfm_is_sensor(g, &sensor));
  EXPECT_TRUE(sensor);
  double in = 0, out = 0;
  for (int i = 0; i < 400; ++i) {
    test::ok(dfm_world_step(w, 1e-3, nullptr));
    for (const Event &e : events_of(w)) {
      EXPECT_EQ(e.a, g);
      EXPECT_EQ(e.b, b);
      (e.kind == DFM_EVENT_SENSOR_BEGIN ? in : out) = dfm_world_time(w);
      EXPECT_EQ(things(g).size(), e.kind == DFM_EVENT_SENSOR_BEGIN ? 1u : 0u);
    }
  }
  // the cube's bottom enters at -0.25, its top leaves at -0.35
  EXPECT_NEAR(in, std::sqrt(2 * 0.25 / 9.81), 2e-3);
  EXPECT_NEAR(out, std::sqrt(2 * 0.45 / 9.81), 2e-3);
  dfm_body_measure m{};
  m.size = sizeof m;
  test::ok(dfm_body_get_measure(b, &m));
  EXPECT_NEAR(m.velocity[2], -9.81 * 0.4, 1e-9);
  EXPECT_TRUE(test::pairs(w).empty());
}

INSTANTIATE_TEST_SUITE_P(Shapes, Gate,
                         ::testing::Values(DFM_SHAPE_BOX, DFM_SHAPE_SPHERE, DFM_SHAPE_MESH,
                                           DFM_SHAPE_VOXELS));

TEST(Sensor, Plane_DetectsBodiesBelow) {
  test::Context c;
  const dfm_world w = test::make_world(c);
  const dfm_obstacle g = test::add_plane(w, "water");
  test::ok(dfm_obstacle_set_sensor(g, true));
  const dfm_body low = cube(c, w, -1, "low");
  cube(c, w, 1, "high");
  test::ok(dfm_world_step(w, 1e-3, nullptr));
  EXPECT_EQ(events_of(w), (std::vector<Event>{{DFM_EVENT_SENSOR_BEGIN, g, low}}));
  EXPECT_EQ(things(g), std::vector<uint64_t>{low});
  test::ok(dfm_world_step(w, 1e-3, nullptr));
  EXPECT_TRUE(events_of(w).empty()) << "told once";
}

TEST(Sensor, EndOfAnOverlap_IsReportedAtOnce) {
  test::Context c;
  const dfm_world w = test::make_world(c, {0, 0, 0});
  const dfm_obstacle g = gate(w, DFM_SHAPE_BOX, 0);
  const dfm_body one = cube(c, w, 0, "one"), two = cube(c, w, -0.3, "two");
  test::ok(dfm_world_step(w, 1e-3, nullptr));
  EXPECT_EQ(events_of(w), (std::vector<Event>{{DFM_EVENT_SENSOR_BEGIN, g, one}}));
  test::ok(dfm_body_destroy(one));
  std::vector<Event> end = events_of(w);
  ASSERT_EQ(end.size(), 1u);
  EXPECT_EQ(end[0].kind, uint32_t{DFM_EVENT_SENSOR_END});
  EXPECT_EQ(end[0].a, g);
  const dfm_pose there{{0, 0, -0.25}, {0, 0, 0, 1}};
  test::ok(dfm_obstacle_teleport(g, &there));
  test::ok(dfm_world_step(w, 1e-3, nullptr));
  EXPECT_EQ(events_of(w), (std::vector<Event>{{DFM_EVENT_SENSOR_BEGIN, g, two}}));
  test::ok(dfm_obstacle_set_sensor(g, false));
  EXPECT_EQ(events_of(w), (std::vector<Event>{{DFM_EVENT_SENSOR_END, g, two}}));
  uint32_t n = 0;
  EXPECT_EQ(dfm_sensor_things(g, 0, nullptr, &n), DFM_E_ARG);
  test::says({"not a sensor"});
  test::ok(dfm_obstacle_set_sensor(g, true));
  test::ok(dfm_world_step(w, 1e-3, nullptr));
  events_of(w);
  test::ok(dfm_obstacle_destroy(g));
  end = events_of(w);
  ASSERT_EQ(end.size(), 1u);
  EXPECT_EQ(end[0].b, two);
  EXPECT_EQ(dfm_sensor_things(g, 0, nullptr, &n), DFM_E_HANDLE);
  test::ok(dfm_world_step(w, 1e-3, nullptr));
  EXPECT_TRUE(events_of(w).empty());
}

TEST(Sensor, MasksAndRules_SelectWhatItDetects) {
  test::Context c;
  const dfm_world w = test::make_world(c, {0, 0, 0});
  const dfm_obstacle g = gate(w, DFM_SHAPE_BOX, 0);
  const dfm_body one = cube(c, w, 0, "one"), two = cube(c, w, 0, "two");
  test::ok(dfm_world_filter_pair(w, "one", "two", false));
  test::ok(dfm_world_filter_pair(w, "gate", "two", false));
  test::ok(dfm_world_step(w, 1e-3, nullptr));
  EXPECT_EQ(things(g), std::vector<uint64_t>{one});
  test::ok(dfm_body_set_filter(one, 2, 2));
  test::ok(dfm_world_remove_filter(w, "gate", "two"));
  test::ok(dfm_world_step(w, 1e-3, nullptr));
  EXPECT_EQ(things(g), std::vector<uint64_t>{two});
}

TEST(Sensor, RigidBodiesObstaclesAndSoftSensors_AreSeenToo) {
  test::Context c;
  const dfm_world w = test::make_world(c, {0, 0, 0});
  const dfm_obstacle g = gate(w, DFM_SHAPE_BOX, 0);
  const dfm_rigid ball = test::create(w, {test::box("plate", {0.02, 0.02, 0.02}, 1, {0, 0, 0.06})})[0];
  dfm_obstacle_def d = dfm_obstacle_def_default();
  d.shape = DFM_SHAPE_SPHERE;
  d.name = "knob";
  d.radius = 0.01;
  d.pose.position[0] = 0.305;
  dfm_obstacle knob = 0;
  test::ok(dfm_obstacle_create(w, &d, &knob));
  const dfm_body ghost = cube(c, w, 0, "ghost"), solid = cube(c, w, 0.02, "solid");
  test::ok(dfm_body_set_sensor(ghost, true));
  test::ok(dfm_world_step(w, 1e-3, nullptr));
  EXPECT_EQ(things(g), (std::vector<uint64_t>{solid, ball, knob})) << "but no other sensor";
  EXPECT_EQ(things(ghost), (std::vector<uint64_t>{solid, ball}));
  dfm_body_measure m{};
  m.size = sizeof m;
  test::ok(dfm_body_get_measure(solid, &m));
  EXPECT_LT(m.kinetic, 1e-25) << "nothing pushes it";
  const dfm_query_shape s = test::sphere({0.2, 0, 0}, 0);
  EXPECT_TRUE(test::query(w, s).empty()) << "queries pass sensors by";
  dfm_query_filter f = dfm_query_filter_default();
  f.what |= DFM_QUERY_SENSORS;
  EXPECT_EQ(test::nearest(w, s, nullptr, 0, &f).thing, g);
  EXPECT_EQ(test::ray(w, {0.2, 0.2, 1}, {0, 0, -1}, 10).thing, 0u);
}

TEST(Sensor, AfterARestore_TheSameEventsAreReported) {
  test::Context c;
  const dfm_world w = test::make_world(c);
  gate(w, DFM_SHAPE_BOX, -0.3);
  cube(c, w, 0);
  test::run(w, 0.25, 1e-3);
  const std::string kept = test::snapshot(w);
  test::events(w);
  std::vector<std::vector<Event>> first, second;
  for (auto *list : {&first, &second}) {
    for (int i = 0; i < 100; ++i) {
      test::ok(dfm_world_step(w, 1e-3, nullptr));
      list->push_back(events_of(w));
    }
    test::ok(dfm_world_restore(w, kept.data(), kept.size()));
    EXPECT_TRUE(events_of(w).empty());
  }
  EXPECT_EQ(first, second);
}

// A cube falls through a gate, past a rigid one, into a soft sensor.
TEST(Sensor, InAScene_TheCommandWritesWhatItReports) {
  const std::string folder = test::scratch("sensor_scene");
  std::ofstream(folder + "/scene.json") << R"({
    "format": "deform-scene", "version": 1, "time": {"duration": 0.4, "step": 0.001},
    "bodies": [
      {"name": "cube", "mesh": {"make": "beam", "size": [0.1, 0.1, 0.1], "cells": 40}},
      {"name": "pond", "mesh": {"make": "beam", "size": [0.5, 0.5, 0.3], "cells": 40}, "sensor": true,
       "pose": {"position": [-0.2, -0.2, -0.9]}, "fix": [{"box": [[-1, -1, -1], [1, 1, 1]]}]}],
    "obstacles": [
      {"name": "gate", "shape": "box", "half_size": [0.3, 0.3, 0.05], "sensor": true,
       "pose": {"position": [0, 0, -0.3]}}],
    "rigid": {"bodies": [
      {"name": "ring", "shape": "sphere", "radius": 0.05, "fixed": true, "sensor": true,
       "pose": {"position": [0.05, 0.05, -0.3]}}]}})";
  const test::CommandResult r =
      test::deform({"run", folder + "/scene.json", "--quiet", "--out", folder + "/out"});
  ASSERT_EQ(r.exit_code, 0) << r.err;
  const auto rows = test::read_csv(folder + "/out/sensors.csv");
  std::vector<std::string> events_of;
  for (const auto &row : rows) events_of.push_back(row[1] + " " + row[2] + " " + row[3]);
  EXPECT_EQ(events_of, (std::vector<std::string>{"sensor thing event", "gate cube begin", "ring cube begin",
                                                 "gate cube end", "ring cube end", "pond cube begin"}));
  const std::string summary = test::read_file(folder + "/out/summary.json");
  EXPECT_NE(summary.find("\"sensors\""), std::string::npos) << summary;
  EXPECT_NE(summary.find("\"inside\": [\"cube\"]"), std::string::npos) << summary;
}
