// Cuts by time and without a tool: planes, the other shapes, events, pieces, snapshots, the key "cuts".
#include <unistd.h>

#include "cut_scenes.h"
#include "opened.h"

namespace {

using test::cutting::parts;

struct Cube : test::cutting::CubeAtRest {
  using CubeAtRest::CubeAtRest;
  void plan(double t, const dfm_cut_def &d) { test::ok(dfm_body_plan_cut(body, t, &d)); }
};

dfm_cut_def plane(double z, std::array<double, 3> normal = {0, 0, 1}) {
  dfm_cut_def d = dfm_cut_def_default();
  d.shape = DFM_CUT_PLANE;
  d.how = DFM_CUT_SPLIT;
  d.blade[2] = z;
  std::copy(normal.begin(), normal.end(), d.blade + 3);
  return d;
}

const dfm_cut_def kAcross = plane(0.001), kAlong = plane(0, {1, 0, 0});

uint32_t cells(dfm_body b) { return test::cutting::info(b).ntet; }

std::vector<dfm_contact_event> cut_events(dfm_world w) {
  uint32_t n = 0;
  std::vector<dfm_contact_event> all(70000);
  for (dfm_contact_event &e : all) e.size = sizeof e;
  test::ok(dfm_world_events(w, uint32_t(all.size()), all.data(), &n));
  all.resize(n);
  std::erase_if(all, [](const dfm_contact_event &e) { return e.kind != DFM_EVENT_CUT; });
  return all;
}

void separate(dfm_body b) {
  dfm_separate_def rule = dfm_separate_def_default();
  rule.least_cells = 8;  // across a mesh without layers two planes leave crumbs
  test::ok(dfm_body_set_separate(b, &rule));
}

uint32_t pieces(dfm_body b) {
  uint32_t n = 0;
  test::ok(dfm_body_pieces(b, 0, nullptr, &n));
  return n;
}

}  // namespace

TEST(PlaneCut, Plane_PartsTheBodyInTwoWhereverItIsGivenFrom) {
  for (const double far : {0.0, 3.0, -1e3})
    for (const double scale : {1.0, -1e-6}) {
      Cube c;
      dfm_cut_def d = plane(0.001, {0, 0, scale});
      d.blade[0] = far;
      dfm_cut_info info{};
      info.size = sizeof info;
      test::ok(dfm_body_cut(c.body, &d, &info));
      EXPECT_EQ(info.parts, 2u) << far << " " << scale;
      EXPECT_GE(info.area, 2 * 0.04 * 0.04 * (1 - 1e-9));
      EXPECT_EQ(info.force[0], 0);
    }
}

TEST(PlaneCut, SlantedPlane_HasNoGaps) {
  for (int k = 0; k < 20; ++k) {
    Cube c;
    const dfm_cut_def d = plane(0.0003 * k, {std::cos(k), std::sin(2.0 * k), 0.3 * k - 3});
    dfm_cut_info info{};
    info.size = sizeof info;
    test::ok(dfm_body_cut(c.body, &d, &info));
    EXPECT_GE(info.parts, 2u) << k;
  }
}

TEST(PlaneCut, PlaneThatRemoves_TakesTheCellsThatItMeets) {
  Cube c;
  dfm_cut_def d = plane(0.001);
  d.how = DFM_CUT_REMOVE;
  dfm_cut_info info{};
  info.size = sizeof info;
  test::ok(dfm_body_cut(c.body, &d, &info));
  EXPECT_GT(info.cells, 0u);
  EXPECT_EQ(info.parts, 2u);
}

TEST(PlaneCut, PlaneBeside_CutsNothing) {
  Cube c;
  const dfm_cut_def d = plane(0.021);
  dfm_cut_info info{};
  info.size = sizeof info;
  test::ok(dfm_body_cut(c.body, &d, &info));
  EXPECT_EQ(info.parts, 1u);
}

TEST(PlannedCut, Cut_IsMadeAtTheEndOfTheStepThatReachesItsTime) {
  Cube c;
  const dfm_cut_def d = plane(0.001);
  c.plan(0.005, d);
  test::run(c.w, 0.004, 1e-3);
  EXPECT_EQ(parts(c.body), 1u);
  EXPECT_TRUE(cut_events(c.w).empty());
  test::run(c.w, 0.001, 1e-3);
  EXPECT_EQ(parts(c.body), 2u);
  const std::vector<dfm_contact_event> events = cut_events(c.w);
  ASSERT_EQ(events.size(), 1u);
  EXPECT_EQ(events[0].a, c.body);
  EXPECT_EQ(events[0].b, c.body);
  EXPECT_GE(events[0].key, 20u);
  EXPECT_NEAR(events[0].t, 0.005, 1e-9);
  test::run(c.w, 0.005, 1e-3);
  EXPECT_TRUE(cut_events(c.w).empty());  // once
}

TEST(PlannedCut, LaterCutsReachPieces_AndNoneIsMadeTwice) {
  Cube c;
  separate(c.body);
  c.plan(0.002, kAlong);
  c.plan(0.001, kAcross);
  test::run(c.w, 0.001, 1e-3);
  EXPECT_EQ(pieces(c.body), 1u);
  test::run(c.w, 0.003, 1e-3);
  EXPECT_EQ(pieces(c.body), 3u);
  EXPECT_EQ(cut_events(c.w).size(), 3u);
}

TEST(PlannedCut, TwoOfOneStep_AreBothMade) {
  Cube c;
  separate(c.body);
  c.plan(0, kAcross);
  c.plan(0.0005, kAlong);
  test::run(c.w, 0.001, 1e-3);
  EXPECT_EQ(pieces(c.body), 3u);
}

TEST(PlannedCut, Null_TakesThemBack) {
  Cube c;
  separate(c.body);
  c.plan(0.001, kAlong);
  c.plan(0.002, kAcross);
  test::run(c.w, 0.001, 1e-3);
  EXPECT_EQ(pieces(c.body), 1u);
  test::ok(dfm_body_plan_cut(c.body, 0, nullptr));  // of the piece, too
  test::run(c.w, 0.003, 1e-3);
  EXPECT_EQ(pieces(c.body), 1u);
}

TEST(PlannedCut, PlannedAfterAPieceHasComeOff_CutsThePieceToo) {
  Cube c;
  separate(c.body);
  test::ok(dfm_body_cut(c.body, &kAcross, nullptr));
  c.plan(0.001, kAlong);
  test::run(c.w, 0.001, 1e-3);
  EXPECT_EQ(pieces(c.body), 3u);
}

// A step is not divided: a cut comes with the end of the step that its time is in.
TEST(PlannedCut, StepsOfAnySize_CutInTheStepThatHasTheTime) {
  for (const double dt : {1e-4, 3e-4, 7e-4, 1e-3, 4e-3}) {
    Cube c;
    const dfm_cut_def d = plane(0.001);
    c.plan(0.0035, d);
    double t = 0;
    while (cut_events(c.w).empty() && t < 0.1) {
      test::ok(dfm_world_step(c.w, dt, nullptr));
      t += dt;
    }
    EXPECT_GE(t, 0.0035 * (1 - 1e-6)) << dt;
    EXPECT_LT(t, 0.0035 + dt * (1 - 1e-3)) << dt;
  }
}

TEST(PlannedCut, ManyThreads_CutToTheSameBits) {
  std::string one;
  for (const uint32_t threads : {1u, 2u, 4u}) {
    Cube c("corotational_fem", 320, threads);
    separate(c.body);
    c.plan(0.002, kAcross);
    c.plan(0.002, kAlong);
    test::run(c.w, 0.01, 1e-3);
    EXPECT_EQ(pieces(c.body), 3u);
    if (one.empty()) one = test::snapshot(c.w);
    else EXPECT_TRUE(one == test::snapshot(c.w)) << threads;
  }
}

TEST(PlannedCut, SleepingBody_WakesAndIsCut) {
  test::Context context;
  dfm_world_def world = dfm_world_def_default();
  world.sleep = 1;
  dfm_world w = 0;
  test::ok(dfm_world_create(context, &world, &w));
  dfm_obstacle_def floor = dfm_obstacle_def_default();
  dfm_obstacle obstacle = 0;
  test::ok(dfm_obstacle_create(w, &floor, &obstacle));
  test::BodyOptions o;
  o.name = "cube";
  o.model = "corotational_fem";
  o.young = 3e4;
  o.damping_mass = 5;
  o.damping_stiffness = 2e-3;
  o.position = {-0.02, -0.02, 1e-4};
  const dfm_body body = test::make_body(context, w, "beam", {0.04, 0.04, 0.04}, 320, o);
  const auto sleeps = [&] {
    bool out = false;
    test::ok(dfm_body_is_asleep(body, &out));
    return out;
  };
  const dfm_cut_def d = plane(0, {1, 0, 0});
  test::ok(dfm_body_plan_cut(body, 2.5, &d));
  test::run(w, 2.4, 2e-3);
  EXPECT_TRUE(sleeps());
  test::run(w, 0.102, 2e-3);
  EXPECT_FALSE(sleeps());
  EXPECT_EQ(parts(body), 2u);
}

TEST(PlannedCut, BodyWithoutCells_HasNoneLeft) {
  Cube c;
  dfm_cut_def all = dfm_cut_def_default();
  all.shape = DFM_CUT_BOX;
  std::fill_n(all.half_size, 3, 1.0);
  const dfm_cut_def d = plane(0.001);
  c.plan(0.002, d);
  c.plan(0.001, all);
  test::run(c.w, 0.001, 1e-3);
  const std::vector<dfm_contact_event> events = cut_events(c.w);
  ASSERT_EQ(events.size(), 1u);
  EXPECT_EQ(events[0].key, 324u);
  test::run(c.w, 0.002, 1e-3);  // the second one finds nothing
  EXPECT_EQ(dfm_body_plan_cut(c.body, 1, &d), DFM_E_STATE);
  test::says({"cube", "no cells left"});
}

// Where two planes meet, teeth of pieces rest at a distance of zero, but for rounding. To keep these apart
// the guard took all motion away.
TEST(PlannedCut, PiecesOfTwoPlanes_AreNotHeldByTheGuard) {
  Cube c;
  separate(c.body);
  c.plan(0.003, kAcross);
  c.plan(0.006, kAlong);
  test::run(c.w, 0.008, 1e-3);
  EXPECT_EQ(pieces(c.body), 3u);
  const double before = test::measure(c.body).com[2], down[] = {0, 0, -9.81};
  test::ok(dfm_world_set_gravity(c.w, down));
  test::run(c.w, 0.02, 1e-3);
  EXPECT_NEAR(before - test::measure(c.body).com[2], 0.5 * 9.81 * 0.02 * 0.02, 5e-5);
  EXPECT_EQ(test::stats(c.w).guard_lost, 0);
}

TEST(PlannedCut, SnapshotsBeforeAndAfter_GoOnToTheBit) {
  Cube c;
  separate(c.body);
  c.plan(0.003, kAcross);
  c.plan(0.006, kAlong);
  test::run(c.w, 0.001, 1e-3);
  const std::string before = test::snapshot(c.w);
  test::run(c.w, 0.003, 1e-3);
  const std::string between = test::snapshot(c.w);
  test::run(c.w, 0.004, 1e-3);
  const std::string end = test::snapshot(c.w);
  for (const auto &[from, left] : {std::pair(&before, 0.007), std::pair(&between, 0.004)}) {
    test::ok(dfm_world_restore(c.w, from->data(), from->size()));
    test::run(c.w, left, 1e-3);
    EXPECT_TRUE(test::snapshot(c.w) == end);
    Cube other;  // one that has never heard of them
    test::ok(dfm_world_restore(other.w, from->data(), from->size()));
    test::run(other.w, left, 1e-3);
    EXPECT_TRUE(test::snapshot(other.w) == end);
  }
}

// A plane has no size, so that none is asked of its def.
TEST(PlannedCut, APlaneWithoutASize_IsRestored) {
  Cube c;
  dfm_cut_def across = kAcross;
  across.half_size[1] = NAN;
  c.plan(1, across);
  const std::string data = test::snapshot(c.w);
  test::ok(dfm_world_restore(c.w, data.data(), data.size()));
}

TEST(PlannedCut, WhatIsWrong_IsRefusedInASentence) {
  Cube c;
  const dfm_cut_def d = plane(0);
  test::run(c.w, 0.01, 1e-3);
  for (const double t : {-1.0, 0.009, double(NAN), double(INFINITY)}) {
    EXPECT_EQ(dfm_body_plan_cut(c.body, t, &d), DFM_E_ARG);
    test::says({"cube", "0.01 s", "not past"});
  }
  dfm_cut_def wrong = plane(0, {0, 0, 0});
  EXPECT_EQ(dfm_body_plan_cut(c.body, 1, &wrong), DFM_E_ARG);
  test::says({"cube", "normal"});
  EXPECT_EQ(dfm_body_cut(c.body, &wrong, nullptr), DFM_E_ARG);
  wrong.shape = DFM_CUT_PLANE + 1;
  EXPECT_EQ(dfm_body_plan_cut(c.body, 1, &wrong), DFM_E_ARG);
  test::says({"DFM_CUT_PLANE"});
  Cube modal("modal");
  EXPECT_EQ(dfm_body_plan_cut(modal.body, 1, &d), DFM_E_UNSUPPORTED);
  test::says({"cube", "corotational_fem"});
  // until the cut is made, the model stays one that can be cut
  c.plan(0.02, d);
  EXPECT_EQ(dfm_body_set_model(c.body, "modal", nullptr), DFM_E_UNSUPPORTED);
  test::says({"cut", "corotational_fem"});
  test::run(c.w, 0.01, 1e-3);
  EXPECT_EQ(parts(c.body), 2u);
}

// Once the last cut is made, each model will do.
TEST(PlannedCut, SwitchOfTheModel_MayFollowTheCutOnly) {
  const dfm_cut_def d = plane(0.001);
  for (const double t : {0.003, 0.006}) {
    const bool after = t > 0.005;
    for (const bool first : {false, true}) {
      Cube c;
      dfm_switch to = dfm_switch_default();
      to.t = t;
      to.type = "linear_fem";
      const dfm_status planned = first ? dfm_body_plan_cut(c.body, 0.005, &d) : DFM_OK;
      EXPECT_EQ(planned, DFM_OK);
      const dfm_status set = dfm_body_set_switches(c.body, 1, &to);
      EXPECT_EQ(set, first && !after ? DFM_E_UNSUPPORTED : DFM_OK) << t;
      if (!first) {
        const dfm_status refused = dfm_body_plan_cut(c.body, 0.005, &d);
        EXPECT_EQ(refused, after ? DFM_OK : DFM_E_UNSUPPORTED) << t;
      }
      if (!after) test::says({"cube", "linear_fem", "corotational_fem"});
      test::run(c.w, 0.005, 1e-3);
      EXPECT_EQ(cut_events(c.w).size(), first || after ? 1u : 0u);
      test::run(c.w, 0.005, 1e-3);
    }
  }
}

// ---- scenes ---------------------------------------------------------------------------------------------

namespace {

std::string folder() { return test::scratch("planned cut " + std::to_string(getpid())); }

std::string scene(const std::string &cuts, const std::string &body = R"("separate": {})",
                  const std::string &mode = "dynamic") {
  return R"({"format": "deform-scene", "version": 1, "gravity": [0, 0, 0],
    "time": {"duration": 0.02, "step": 0.001, "mode": ")" +
         mode + R"("}, "materials": {"gel": {"young": 3e4, "damping": {"stiffness": 0.002}}},
    "bodies": [{"name": "cube", "mesh": {"make": "beam", "size": [0.04, 0.04, 0.04], "cells": 320},
      "material": "gel", "pose": {"position": [-0.02, -0.02, -0.02]}, )" +
         body + R"(}], "cuts": )" + cuts + "}";
}

struct Opened : test::Opened {
  using test::Opened::Opened;
  dfm_body cube() const {
    dfm_body out = 0;
    test::ok(dfm_world_find_body(world, "cube", &out));
    return out;
  }
};

std::string written(const std::string &text) {
  const std::string path = folder() + "/scene.json";
  test::write_file(path, text);
  return path;
}

constexpr char kPlane[] =
    R"({"body": "cube", "t": 0.005, "shape": "plane", "point": [0, 0, 0.001], "normal": [0, 0, 2]})";

}  // namespace

TEST(CutScene, EachShape_Cuts) {
  const std::pair<const char *, bool> shapes[] = {
      {R"("shape": "plane", "point": [0, 0, 0.001], "normal": [0, 0, 1])", true},
      {R"("shape": "blade", "corners": [[-1, -1, 0.001], [1, -1, 0.001], [1, 1, 0.001], [-1, 1, 0.001]])",
       true},
      {R"("shape": "plane", "mode": "remove", "point": [0, 0, 0.001], "normal": [0, 0, 1])", false},
      {R"("shape": "sphere", "radius": 0.01, "pose": {"position": [0.02, 0, 0]})", false},
      {R"("shape": "box", "half_size": [0.01, 0.01, 0.01], "pose": {"position": [0.02, 0, 0]})", false},
      {R"("shape": "ellipsoid", "half_size": [0.01, 0.02, 0.01])", false}};
  for (const auto &[shape, whole] : shapes) {
    const Opened s(
        written(scene(std::string(R"([{"body": "cube", "t": 0.002, )") + shape + "}]", R"("id": 1)")));
    ASSERT_EQ(s.status, DFM_OK) << dfm_last_error();
    const uint32_t n = cells(s.cube());
    test::run(s.world, 0.002, 1e-3);
    EXPECT_EQ(cut_events(s.world).size(), 1u) << shape;
    if (whole) {
      EXPECT_EQ(cells(s.cube()), n) << shape;
      EXPECT_EQ(parts(s.cube()), 2u) << shape;
    } else {
      EXPECT_LT(cells(s.cube()), n) << shape;
    }
  }
}

TEST(CutScene, WhatIsWrong_IsNamed) {
  const auto refused = [](const std::string &text, std::initializer_list<const char *> words) {
    const Opened s(written(text));
    EXPECT_LT(s.status, 0) << text;
    test::says(words);
  };
  const auto one = [](const std::string &entry) { return scene("[{" + entry + "}]"); };
  const std::string plane = R"("shape": "plane", "point": [0, 0, 0], "normal": [0, 0, 1])";
  refused(one(R"("body": "cub", "t": 0, )" + plane), {"/cuts/0/body", "cube"});
  refused(one(R"("body": "cube", "t": -0.1, )" + plane), {"/cuts/0/t"});
  std::string late = one(R"("body": "cube", "t": 0.4, )" + plane);
  late.insert(late.find("\"duration\""), "\"start\": 0.5, ");
  refused(late, {"/cuts/0/t", "0.4 s", "start"});
  std::string rigid = one(R"("body": "ball", "t": 0.1, )" + plane);
  rigid.insert(rigid.rfind('}'), R"(, "rigid": {"bodies": [{"name": "ball", "shape": "sphere", "radius": 0.01,
    "mass": 1, "pose": {"position": [0, 0, 1]}}]})");
  refused(rigid, {"/cuts/0/body", "ball", "cube"});
  refused(one(R"("body": "cube", )" + plane), {"/cuts/0", "\"t\""});
  refused(one(R"("body": "cube", "t": 0, "shape": "plane", "point": [0, 0, 0], "normal": [0, 0, 0])"),
          {"/cuts/0/normal", "zero"});
  refused(one(R"("body": "cube", "t": 0, "shape": "plane", "normal": [0, 0, 1])"), {"/cuts/0", "point"});
  refused(one(R"("body": "cube", "t": 0, "shape": "capsule")"), {"/cuts/0/shape", "plane"});
  refused(one(R"("body": "cube", "t": 0, "radius": 1, )" + plane), {"/cuts/0/radius", "plane"});
  refused(one(R"("body": "cube", "t": 0, "mode": "split", "shape": "sphere", "radius": 1)"),
          {"/cuts/0/mode", "remove"});
  refused(one(R"("body": "cube", "t": 0, "shape": "box", "half_size": [1, 0, 1])"), {"/cuts/0/half_size"});
  refused(one(R"("body": "cube", "t": 0, "shape": "blade", "corners": [[0, 0, 0]])"),
          {"/cuts/0/corners", "four"});
  refused(scene("[" + std::string(kPlane) + "]", R"("model": {"type": "modal"})"),
          {"/cuts/0", "corotational_fem"});
  refused(scene("[" + std::string(kPlane) + "]", R"("switch": [{"t": 0.001, "type": "modal"}])"),
          {"/bodies/0/switch", "cut"});
  refused(scene("[" + std::string(kPlane) + "]", R"("separate": {})", "static"), {"/cuts", "static"});
}

// A cut that is made already is not written; one of a piece is one of the body that the piece is there.
TEST(CutScene, WrittenBetweenTwoCuts_HasTheSecond) {
  const std::string again = folder() + "/between.json";
  const std::string second =
      R"({"body": "cube", "t": 0.01, "shape": "plane", "point": [0, 0, 0], "normal": [1, 0, 0]})";
  const Opened s(written(scene("[" + std::string(kPlane) + ", " + second + "]")));
  ASSERT_EQ(s.status, DFM_OK) << dfm_last_error();
  test::run(s.world, 0.007, 1e-3);
  dfm_scene_write_def partial = dfm_scene_write_def_default();
  partial.flags = DFM_SCENE_PARTIAL;  // sides of a cut do not know there that they were one
  test::ok(dfm_world_write_scene(s.world, again.c_str(), &partial, nullptr));
  const Opened t(again);
  ASSERT_EQ(t.status, DFM_OK) << dfm_last_error();
  EXPECT_TRUE(cut_events(t.world).empty());
  test::run(t.world, 0.005, 1e-3);
  EXPECT_EQ(cut_events(t.world).size(), 2u);
  uint32_t n = 0;
  test::ok(dfm_world_bodies(t.world, 0, nullptr, &n));
  EXPECT_GE(n, 4u);
}

TEST(CutScene, WrittenAndLoaded_CutsAlike) {
  const std::string again = folder() + "/again.json";
  const std::string sphere = R"({"body": "cube", "t": 0.007, "shape": "sphere", "radius": 0.01, "most": 9,
    "pose": {"position": [0.02, 0, 0]}})";
  const Opened s(written(scene("[" + std::string(kPlane) + ", " + sphere + "]")));
  ASSERT_EQ(s.status, DFM_OK) << dfm_last_error();
  test::ok(dfm_world_write_scene(s.world, again.c_str(), nullptr, nullptr));
  const Opened t(again);
  ASSERT_EQ(t.status, DFM_OK) << dfm_last_error();
  for (const dfm_world w : {s.world, t.world}) test::run(w, 0.012, 1e-3);
  EXPECT_EQ(pieces(s.cube()), 1u);
  EXPECT_EQ(pieces(t.cube()), 1u);
  EXPECT_EQ(dfm_world_hash(s.world), dfm_world_hash(t.world));
}

// Where a body will be is not known before, and a run may be continued.
TEST(CutScene, CutsThatMeetNothingOrComeTooLate_AreWarnedOf) {
  const auto reported = [](const std::string &entries) {
    const test::CommandResult r =
        test::deform({"run", written(scene("[" + entries + "]")), "--out", folder() + "/told"});
    EXPECT_EQ(r.exit_code, 0) << r.err;
    return r.err;
  };
  EXPECT_EQ(reported(kPlane).find("its cut at"), std::string::npos);
  const std::string beside =
      R"({"body": "cube", "t": 0.01, "shape": "plane", "point": [0, 0, 1], "normal": [0, 0, 2]})";
  const std::string missed = reported(kPlane + (", " + beside));
  EXPECT_NE(missed.find("body 'cube': its cut at 0.01 s has met no closed face"), std::string::npos)
      << missed;
  EXPECT_EQ(missed.find("has met"), missed.rfind("has met")) << missed;  // once, of body and piece
  const std::string half = R"({"body": "cube", "t": 0.01, "shape": "sphere", "radius": 0.008,
    "pose": {"position": [0, 0, -0.02]}})";
  EXPECT_EQ(reported(kPlane + (", " + half)).find("has met"), std::string::npos);  // one of the two is met
  const std::string late = R"({"body": "cube", "t": 3, "shape": "sphere", "radius": 0.008})";
  const std::string unmade = reported(late);
  EXPECT_NE(unmade.find("/cuts/0/t"), std::string::npos) << unmade;
}

// unsanitized: too slow there; shorter tests run the same code
TEST(CutScene, HowTo_CutsTwoSlices) {
  const test::CommandResult r =
      test::deform({"run", std::string(DEFORM_SOURCE_DIR) + "/libdeform/doc/howto/cut/planes.json", "--check",
                    "--out", folder() + "/howto"});
  EXPECT_EQ(r.exit_code, 0) << r.err;
  EXPECT_NE(r.out.find("jelly.2"), std::string::npos) << r.out;
  EXPECT_EQ(r.out.find("jelly.3"), std::string::npos) << r.out;
  EXPECT_NE(r.out.find("crossing triangle pairs: 0 "), std::string::npos) << r.out;
  EXPECT_EQ(r.err.find("warning"), std::string::npos) << r.err;
}

TEST(CutScene, Explain_NamesTheCut) {
  const test::CommandResult r = test::deform({"explain", written(scene("[" + std::string(kPlane) + "]"))});
  EXPECT_EQ(r.exit_code, 0) << r.err;
  EXPECT_NE(r.out.find("cut at 0.005 s by a plane, which opens faces"), std::string::npos) << r.out;
}

namespace {

// Where each probe is, in the order of the scene.
std::vector<std::array<double, 3>> probes(dfm_scene s, uint32_t n) {
  std::vector<std::array<double, 3>> out(n);
  for (uint32_t i = 0; i < n; ++i) test::ok(dfm_scene_probe(s, i, nullptr, out[i].data(), nullptr));
  return out;
}

size_t rows(const std::string &table, const std::string &word) {
  size_t n = 0;
  for (size_t at = 0; (at = table.find(word, at)) != std::string::npos; ++at) ++n;
  return n;
}

// A bar without forces, 0.2 m long, with probes in it 1 cm from both ends, and a second body.
std::string bar(const std::string &cuts, const std::string &more = "") {
  return R"({"format": "deform-scene", "version": 1, "gravity": [0, 0, 0],
    "time": {"duration": 0.02, "step": 0.001},
    "bodies": [{"name": "bar", "mesh": {"make": "beam", "size": [0.2, 0.02, 0.02], "cells": 300})" +
         more + R"(}, {"name": "rest", "mesh": {"make": "ball", "radius": 0.01, "cells": 60},
      "pose": {"position": [0, 1, 0]}}],
    "probes": [{"name": "near", "body": "bar", "point": [0.01, 0.01, 0.01]},
               {"name": "far", "body": "bar", "point": [0.19, 0.01, 0.01]},
               {"name": "rest", "body": "rest", "point": [0, 0, 0]}],
    "output": {"every": 0.01, "nodes": true, "states": true},
    "cuts": [)" +
         cuts + "]}";
}

constexpr char kHalf[] = R"({"body": "bar", "t": 0.005, "shape": "box", "half_size": [0.05, 0.1, 0.1],
  "pose": {"position": [0.04, 0, 0]}})";
constexpr char kAll[] = R"({"body": "bar", "t": 0.005, "shape": "sphere", "radius": 0.5})";
constexpr char kAcrossBar[] =
    R"({"body": "bar", "t": 0.002, "shape": "plane", "point": [0.1, 0, 0], "normal": [1, 0, 0]})";

}  // namespace

// Nothing moves, so each probe stays where it was or is gone with its cell.
TEST(CutScene, Probe_FollowsItsCell) {
  const std::string parted = std::string(kAcrossBar) + ", " + kHalf,
                    taken = std::string(kAcrossBar) + ", " + kAll;
  const struct {
    std::string cuts, more;
    bool near, far;
  } cases[] = {{kHalf, "", false, true},
               {kAcrossBar, "", true, true},
               {kAcrossBar, R"(, "separate": {})", true, true},
               {parted, R"(, "separate": {})", false, true},
               {taken, R"(, "separate": {})", false, false},
               {kAll, "", false, false}};
  for (const auto &c : cases) {
    const Opened s(written(bar(c.cuts, c.more)));
    ASSERT_EQ(s.status, DFM_OK) << dfm_last_error();
    const auto before = probes(s.scene, 3);
    test::run(s.world, 0.01, 1e-3);
    const auto now = probes(s.scene, 3);
    const bool there[] = {c.near, c.far, true};
    for (size_t i = 0; i < 3; ++i)
      for (size_t k = 0; k < 3; ++k) {
        if (there[i]) EXPECT_NEAR(now[i][k], before[i][k], 1e-12) << c.cuts << c.more << i;
        else EXPECT_TRUE(std::isnan(now[i][k])) << c.cuts << c.more << i;
      }
    const std::string again = folder() + "/probes.json";
    dfm_scene_write_def partial = dfm_scene_write_def_default();
    partial.flags = DFM_SCENE_PARTIAL;
    test::ok(dfm_scene_write(s.scene, again.c_str(), &partial, nullptr));
    const Opened t(again);
    ASSERT_EQ(t.status, DFM_OK) << dfm_last_error();
    uint32_t next = 0;
    for (size_t i = 0; i < 3; ++i) {
      if (!there[i]) continue;
      double x[3], v[3];
      test::ok(dfm_scene_probe(t.scene, next++, nullptr, x, v));
      for (size_t k = 0; k < 3; ++k) EXPECT_NEAR(x[k], now[i][k], 1e-12) << c.cuts << c.more << i;
    }
    EXPECT_EQ(dfm_scene_probe(t.scene, next, nullptr, nullptr, nullptr), DFM_E_ARG);
  }
}

TEST(CutScene, BodyWithoutCells_TheRunGoesOn) {
  for (const char *cut : {kAll, kHalf}) {
    const std::string out = folder() + "/all gone";
    const test::CommandResult r = test::deform({"run", written(bar(cut)), "--out", out});
    EXPECT_EQ(r.exit_code, 0) << r.err;
    EXPECT_NE(r.out.find("\nrest "), std::string::npos) << r.out;
    const std::string bodies = test::read_file(out + "/bodies.csv");
    EXPECT_EQ(rows(bodies, ",rest,"), 3u) << bodies;
    EXPECT_EQ(rows(bodies, ",bar,"), cut == kHalf ? 3u : 1u) << bodies;
    // rows of the nodes that are left, none of which has moved
    const std::string nodes = test::read_file(out + "/nodes/bar.csv");
    for (size_t at = nodes.find('\n') + 1; at < nodes.size(); at = nodes.find('\n', at) + 1) {
      double u[3];
      ASSERT_EQ(std::sscanf(&nodes[at], "%*u,%lf,%lf,%lf", u, u + 1, u + 2), 3) << &nodes[at];
      for (const double x : u) EXPECT_NEAR(x, 0, 1e-12) << nodes;
    }
    EXPECT_EQ(rows(nodes, "\n") > 1, cut == kHalf) << nodes;
  }
}

// Recorded and replayed, and continued from states before, between and after the cuts: the same bits.
// unsanitized: too slow there; shorter tests run the same code
TEST(CutScene, RunThatCuts_IsReplayedAndContinuedToTheBit) {
  const std::string dir = folder(), path = dir + "/a scene.json";
  const std::string second =
      R"({"body": "cube", "t": 0.01, "shape": "plane", "point": [0, 0, 0], "normal": [1, 0, 0]})";
  test::write_file(path, scene("[" + std::string(kPlane) + ", " + second + "]"));
  const auto run = [&](std::vector<std::string> words) {
    const test::CommandResult r = test::deform(words);
    EXPECT_EQ(r.exit_code, 0) << r.err;
  };
  const auto hash = [&](const std::string &out) {
    const std::string text = test::read_file(out + "/summary.json");
    const size_t at = text.find("\"state_hash\"");
    EXPECT_NE(at, std::string::npos);
    return text.substr(at, 36);
  };
  for (const char *t : {"0.003", "0.007", "0.015"}) {
    run({"run", path, "--out", dir + "/whole", "--quiet", "--record", "--save", t, dir + "/half.state"});
    run({"run", path, "--out", dir + "/rest", "--quiet", "--from", dir + "/half.state", "--frames", "100"});
    EXPECT_EQ(hash(dir + "/whole"), hash(dir + "/rest")) << t;
  }
  run({"replay", dir + "/whole", "--quiet"});
}
