// dfm_world_equilibrium: closed forms, what time passes on the way, what it refuses and leaves alone; and
// scenes that ask for it.
#include <algorithm>
#include <filesystem>

#include "support.h"
#include "world.h"

namespace {

// A bar of 0.4 x 0.1 x 0.1 m along x, held where x is least.
struct Bar {
  test::Context context;
  dfm_world world;
  dfm_body body;
  std::vector<double> rest;
  std::vector<uint32_t> low, high;

  explicit Bar(const char *model, double poisson = 0, std::array<double, 3> gravity = {0, 0, 0},
               bool held = true, uint32_t cells = 120, dfm_world_def def = dfm_world_def_default()) {
    std::copy(gravity.begin(), gravity.end(), def.gravity);
    test::ok(dfm_world_create(context, &def, &world));
    test::BodyOptions o;
    o.model = model;
    o.poisson = poisson;
    body = test::make_body(context, world, "beam", {0.4, 0.1, 0.1}, cells, o);
    dfm_body_info info{};
    info.size = sizeof info;
    test::ok(dfm_body_get_info(body, &info));
    rest.resize(3 * size_t(info.npoint));
    test::ok(dfm_body_get_rest(body, info.npoint, rest.data(), 0, nullptr));
    double least = 1e300, most = -1e300;
    for (size_t i = 0; i < rest.size(); i += 3) {
      least = std::min(least, rest[i]);
      most = std::max(most, rest[i]);
    }
    for (size_t i = 0; i < rest.size(); i += 3) {
      if (rest[i] < least + 1e-9) low.push_back(uint32_t(i / 3));
      if (rest[i] > most - 1e-9) high.push_back(uint32_t(i / 3));
    }
    if (held) test::ok(dfm_body_hold(body, uint32_t(low.size()), low.data(), 7));
  }
  ~Bar() { dfm_world_destroy(world); }
  std::vector<double> positions() const {
    std::vector<double> x(rest.size());
    uint32_t n = 0;
    test::ok(dfm_body_get_state(body, uint32_t(rest.size() / 3), x.data(), nullptr, &n));
    return x;
  }
  double pulled() const {  // mean displacement of the far end along x
    const std::vector<double> x = positions();
    double sum = 0;
    for (const uint32_t i : high) sum += (x[3 * i] - rest[3 * i]) / double(high.size());
    return sum;
  }
  dfm_status find(dfm_equilibrium_def def = dfm_equilibrium_def_default(),
                  dfm_equilibrium_info *info = nullptr) {
    return dfm_world_equilibrium(world, &def, info);
  }
};

dfm_equilibrium_info info_of() {
  dfm_equilibrium_info info{};
  info.size = sizeof info;
  return info;
}

TEST(Equilibrium, OwnWeightAlongTheBar_IsTheClosedForm) {
  Bar bar("linear_fem", 0, {9.81, 0, 0});
  dfm_equilibrium_info info = info_of();
  test::ok(bar.find(dfm_equilibrium_def_default(), &info));
  // points of a layer weigh differently: the end is not quite plane
  EXPECT_NEAR(bar.pulled() / (1000 * 9.81 * 0.16 / (2 * 1e5)), 1, 1e-3);
  EXPECT_EQ(info.load_steps, 1u);
  EXPECT_LE(info.iterations, 2u);  // one, and one to polish: the stiffness is constant
  EXPECT_LT(info.residual, 1e-10);
  EXPECT_EQ(test::measure(bar.body).speed_max, 0);
  EXPECT_EQ(dfm_world_time(bar.world), 0);
}

// Every model that tells its stiffness comes to where it rests after a long time with damping.
TEST(Equilibrium, SpringsAndTetrahedra_AreWhereTheyRestAfterALongTime) {
  for (const char *model : {"msm", "linear_fem", "corotational_fem"}) {
    Bar bar(model, 0.3, {0, 0, -3}), moving(model, 0.3, {0, 0, -3});
    const double start = test::measure(bar.body).com[2];
    test::ok(bar.find());
    const double drag = 20;
    const dfm_param_value value = {"damping_mass", &drag, 1};
    const dfm_params params = {sizeof params, 1, &value};
    test::ok(dfm_body_set_params(moving.body, &params));
    test::run(moving.world, 8, 1e-3);
    const double rested = test::measure(moving.body).com[2] - start;
    const double found = test::measure(bar.body).com[2] - start;
    EXPECT_LT(rested, -1e-3) << model;
    EXPECT_NEAR(found / rested, 1, 1e-5) << model;
    // and stays there
    test::run(bar.world, 0.05, 1e-3);
    EXPECT_NEAR((test::measure(bar.body).com[2] - start) / found, 1, 1e-7) << model;
  }
}

// What relaxes on a floor is where it is after all time, however slowly it does.
TEST(Equilibrium, OfABarOnAFloor_DoesNotWaitForItsRelaxation) {
  double sag[2];
  for (const double relaxation : {1e-2, 1e2}) {
    Bar bar("msm", 0.3, {0, 0, -9.81}, false);
    const double sls = 2;
    const dfm_param_value values[] = {{"damper", &sls, 1}, {"relaxation_time", &relaxation, 1}};
    const dfm_params params = {sizeof params, 2, values};
    test::ok(dfm_body_set_model(bar.body, "msm", &params));
    double low = 1e300;
    for (size_t i = 2; i < bar.rest.size(); i += 3) low = std::min(low, bar.rest[i]);
    test::add_plane(bar.world, "floor", {0, 0, low});
    const double start = test::measure(bar.body).com[2];
    dfm_equilibrium_info info = info_of();
    test::ok(bar.find(dfm_equilibrium_def_default(), &info));
    EXPECT_LT(info.iterations, 200u) << relaxation;
    sag[relaxation > 1] = test::measure(bar.body).com[2] - start;
  }
  EXPECT_NEAR(sag[1] / sag[0], 1, 1e-4);
}

TEST(Equilibrium, LoadSteps_EndAtTheSamePlace) {
  Bar one("corotational_fem", 0.3, {0, 0, -9.81}), four("corotational_fem", 0.3, {0, 0, -9.81});
  dfm_equilibrium_def def = dfm_equilibrium_def_default();
  def.load_steps = 4;
  dfm_equilibrium_info info = info_of();
  test::ok(one.find());
  test::ok(four.find(def, &info));
  EXPECT_EQ(info.load_steps, 4u);
  const std::vector<double> a = one.positions(), b = four.positions();
  for (size_t i = 0; i < a.size(); ++i) EXPECT_NEAR(a[i], b[i], 1e-9);
  // half of the load is half of the way, where all is linear
  Bar half("linear_fem", 0, {9.81, 0, 0}), whole("linear_fem", 0, {9.81, 0, 0});
  dfm_equilibrium_def to = dfm_equilibrium_def_default();
  to.load_to = 0.5;
  test::ok(half.find(to));
  test::ok(whole.find());
  EXPECT_NEAR(half.pulled() / whole.pulled(), 0.5, 1e-9);
}

// Conjugate gradients know the positions: rigid motions of patches carry the load through the body.
TEST(Equilibrium, ConjugateGradientsOfALargeBody_NeedFewIterations) {
  dfm_world_def few = dfm_world_def_default();
  few.solver = "pcg";
  few.solver_iterations = 150;
  Bar bar("linear_fem", 0.3, {0, 0, -9.81}, true, 5000, few);
  EXPECT_EQ(bar.find(), DFM_OK) << dfm_last_error();
}

TEST(Equilibrium, HeldPointsOnTheirWay_AreWhereTheTimeThatPassesPutsThem) {
  Bar bar("linear_fem");
  test::ok(dfm_body_hold(bar.body, uint32_t(bar.high.size()), bar.high.data(), 7));
  const dfm_pose_key keys[] = {{0, {{0, 0, 0}, {0, 0, 0, 1}}}, {2, {{0.02, 0, 0}, {0, 0, 0, 1}}}};
  test::ok(dfm_body_move_held(bar.body, uint32_t(bar.high.size()), bar.high.data(), 2, keys, nullptr));
  dfm_equilibrium_def def = dfm_equilibrium_def_default();
  def.time = 1;
  test::ok(bar.find(def));
  EXPECT_EQ(dfm_world_time(bar.world), 1);
  EXPECT_NEAR(bar.pulled(), 0.01, 1e-15);
  const std::vector<double> x = bar.positions();
  for (size_t i = 0; i < x.size(); i += 3) EXPECT_NEAR(x[i] - bar.rest[i], 0.025 * bar.rest[i], 1e-12);
}

TEST(Equilibrium, BodyOnASpring_HangsByItsWeight) {
  Bar bar("linear_fem", 0.3, {0, 0, -9.81}, false);
  dfm_spring_def s{};
  s.size = sizeof s;
  const std::vector<double> all = bar.rest;
  std::vector<uint32_t> points(all.size() / 3);
  for (uint32_t i = 0; i < points.size(); ++i) points[i] = i;
  s.npoint = uint32_t(points.size());
  s.points = points.data();
  s.stiffness = 1000;
  test::ok(dfm_body_add_spring(bar.body, &s, nullptr));
  test::ok(bar.find());
  EXPECT_NEAR(test::measure(bar.body).com[2], -4 * 9.81 / 1000, 1e-6);
}

TEST(Equilibrium, FreeBodyUnderANetLoad_IsRefusedAndNothingChanges) {
  Bar bar("linear_fem", 0.3, {0, 0, -9.81}, false);
  const uint64_t before = dfm_world_hash(bar.world);
  EXPECT_EQ(bar.find(), DFM_E_DIVERGED);
  test::says({"body1", "nothing holds it", "fix"});
  EXPECT_EQ(dfm_world_hash(bar.world), before);
  EXPECT_EQ(dfm_world_time(bar.world), 0);
}

TEST(Equilibrium, FreeBodyUnderBalancedLoads_Stretches) {
  Bar bar("linear_fem", 0, {0, 0, 0}, false);
  const double area = 0.01, force = 5;
  for (const auto *end : {&bar.low, &bar.high}) {  // the closed form of a bar: tractions shared by area
    std::vector<double> f(3 * end->size(), 0);
    const double sign = end == &bar.high ? 1 : -1;
    for (size_t i = 0; i < end->size(); ++i) f[3 * i] = sign * force / double(end->size());
    test::ok(dfm_body_add_load(bar.body, uint32_t(end->size()), end->data(), f.data(), 0, nullptr, nullptr,
                               nullptr));
  }
  test::ok(bar.find());
  const std::vector<double> x = bar.positions();
  double low = 0;
  for (const uint32_t i : bar.low) low += (x[3 * i] - bar.rest[3 * i]) / double(bar.low.size());
  EXPECT_NEAR((bar.pulled() - low) / (force * 0.4 / (1e5 * area)), 1, 0.05);
}

// Its loads are balanced only at the end of the time that passes.
TEST(Equilibrium, FreeBodyUnderLoadsWithKeys_NeedsBalanceOnlyAtTheEnd) {
  for (const char *model : {"linear_fem", "corotational_fem"}) {
    Bar bar(model, 0, {0, 0, 0}, false);
    for (const auto *end : {&bar.low, &bar.high}) {
      const bool grows = end == &bar.high;
      std::vector<double> f(3 * end->size(), 0);
      for (size_t i = 0; i < end->size(); ++i) f[3 * i] = (grows ? 5 : -5) / double(end->size());
      const dfm_scale_key keys[] = {{0, grows ? 0.0 : 1.0}, {10, 1}};
      test::ok(dfm_body_add_load(bar.body, uint32_t(end->size()), end->data(), f.data(), 2, keys, nullptr,
                                 nullptr));
    }
    const uint64_t before = dfm_world_hash(bar.world);
    dfm_equilibrium_def def = dfm_equilibrium_def_default();
    def.time = 5;
    EXPECT_EQ(bar.find(def), DFM_E_DIVERGED) << model;
    test::says({"body1", "nothing holds it"});
    EXPECT_EQ(dfm_world_hash(bar.world), before);
    def.time = 10;
    dfm_equilibrium_info info = info_of();
    const double start = test::measure(bar.body).com[0];
    test::ok(bar.find(def, &info));
    EXPECT_NEAR(test::measure(bar.body).com[0], start, 1e-6) << model;
    EXPECT_LT(info.iterations, 100u) << model;
    EXPECT_EQ(dfm_world_time(bar.world), 10);
  }
}

TEST(Equilibrium, FreeBodyThatFindsNone_GetsAdviceThatDoesNotSpeakOfFriction) {
  Bar bar("corotational_fem", 0, {0, 0, 0}, false);
  for (const auto *end : {&bar.low, &bar.high}) {
    std::vector<double> f(3 * end->size(), 0);
    for (size_t i = 0; i < end->size(); ++i) f[3 * i] = (end == &bar.high ? 20 : -20) / double(end->size());
    test::ok(dfm_body_add_load(bar.body, uint32_t(end->size()), end->data(), f.data(), 0, nullptr, nullptr,
                               nullptr));
  }
  dfm_equilibrium_def def = dfm_equilibrium_def_default();
  def.max_iterations = 1;
  EXPECT_EQ(bar.find(def), DFM_E_DIVERGED);
  test::says({"body1", "hold more of its points"});
  EXPECT_EQ(std::string(dfm_last_error()).find("friction"), std::string::npos);
}

// Its integrator is the explicit one from then on until the end of the impact, and the search has its own.
TEST(Equilibrium, BodyInAnImpact_ComesToRestAndStays) {
  for (const bool alone : {false, true}) {
    test::Context context;
    dfm_world_def d = dfm_world_def_default();
    d.step = 1.0 / 60;
    dfm_world w = 0;
    test::ok(dfm_world_create(context, &d, &w));
    test::BodyOptions o;
    o.model = "corotational_fem";
    o.young = 3e8;
    o.position = {0, 0, 0.002};
    o.velocity = {0, 0, -4};
    const dfm_body b = test::make_body(context, w, "beam", {0.1, 0.1, 0.1}, 400, o);
    const dfm_obstacle floor = test::add_plane(w, "floor");
    const auto struck = [&] { return test::explain(w).find("\"changes\":1") != std::string::npos; };
    for (int i = 0; i < 20 && !struck(); ++i) test::ok(dfm_world_step(w, 1e-3, nullptr));
    ASSERT_TRUE(struck()) << test::explain(w);
    if (alone) {
      const uint32_t held[] = {0, 1, 2, 3, 4, 5, 6, 7};
      test::ok(dfm_body_hold(b, 8, held, 7));
      test::ok(dfm_obstacle_destroy(floor));
    }
    test::ok(dfm_world_equilibrium(w, nullptr, nullptr));
    EXPECT_EQ(test::measure(b).speed_max, 0);
    test::run(w, 0.1, 1e-3);
    EXPECT_LT(test::measure(b).speed_max, 1e-3);
    dfm_world_destroy(w);
  }
}

// It turns down like a pendulum, far from where it starts.
TEST(Equilibrium, BarOnAHinge_HangsBelowIt) {
  Bar bar("corotational_fem", 0.3, {0, 0, -9.81}, false);
  std::vector<uint32_t> edge;
  for (const uint32_t i : bar.low)
    if (bar.rest[3 * size_t{i} + 2] > 0.1 - 1e-9) edge.push_back(i);
  test::ok(dfm_body_hold(bar.body, uint32_t(edge.size()), edge.data(), 7));
  test::ok(bar.find());
  const auto m = test::measure(bar.body);
  EXPECT_NEAR(m.com[0], 0, 1e-8);
  EXPECT_LT(m.com[2], -0.1);
}

TEST(Equilibrium, Interrupted_EndsWithTheWorldAsItWas) {
  Bar bar("linear_fem", 0.3, {0, 0, -9.81});
  const uint64_t before = dfm_world_hash(bar.world);
  test::ok(dfm_world_interrupt(bar.world));
  EXPECT_EQ(bar.find(), DFM_DISCARD);
  EXPECT_EQ(dfm_world_hash(bar.world), before);
}

TEST(Equilibrium, WhatItCannotDo_IsRefusedByName) {
  Bar bar("linear_fem");
  dfm_equilibrium_def def = dfm_equilibrium_def_default();
  def.load_to = -1;
  EXPECT_EQ(bar.find(def), DFM_E_ARG);
  def = dfm_equilibrium_def_default();
  def.time = NAN;
  EXPECT_EQ(bar.find(def), DFM_E_ARG);
}

// A scene with "mode": "static": growing loads, nodes of the end, rows on the way.
TEST(Equilibrium, StaticScene_WritesTheDisplacementsOfItsNodes) {
  const std::string folder = test::scratch("static_scene"), scene = folder + "/bar.json";
  test::write_file(scene, R"({"format": "deform-scene", "version": 1, "gravity": [0, 0, 0],
    "time": {"mode": "static", "duration": 1, "step": 0.25},
    "materials": {"m": {"density": 1000, "young": 1e5, "poisson": 0}},
    "bodies": [{"name": "bar", "mesh": {"make": "beam", "size": [0.4, 0.1, 0.1], "cells": 120},
      "material": "m",
      "model": {"type": "linear_fem"}, "fix": [{"box": [[-1, -1, -1], [0.001, 1, 1]]}],
      "forces": [{"box": [[0.399, -1, -1], [1, 1, 1]], "total": [5, 0, 0], "by": "area"}]}],
    "probes": [{"name": "end", "body": "bar", "point": [0.4, 0.05, 0.05]}],
    "output": {"every": 0.25, "nodes": true}})");
  const test::CommandResult r = test::deform({"run", scene, "--out", folder + "/out", "--quiet"});
  ASSERT_EQ(r.exit_code, 0) << r.err;
  const auto rows = test::read_csv(folder + "/out/nodes/bar.csv");
  double most = 0;
  for (size_t i = 1; i < rows.size(); ++i) most = std::max(most, std::strtod(rows[i][1].c_str(), nullptr));
  EXPECT_NEAR(most / (5 * 0.4 / (1e5 * 0.01)), 1, 1e-8);
  EXPECT_EQ(test::read_csv(folder + "/out/probes.csv").size(), 6u);  // header, start, four shares of the load
  const std::string summary = test::read_file(folder + "/out/summary.json");
  for (const char *part : {"\"equilibrium\"", "\"load_steps\": 4", "\"steps\": 4"})
    EXPECT_NE(summary.find(part), std::string::npos) << part << summary;
}

TEST(Equilibrium, StaticSceneWithoutOne_StopsWithTheReason) {
  const std::string folder = test::scratch("static_free"), scene = folder + "/free.json";
  test::write_file(scene, R"({"format": "deform-scene", "version": 1,
    "time": {"mode": "static", "duration": 1},
    "bodies": [{"name": "stone", "mesh": {"make": "beam", "size": [0.4, 0.1, 0.1], "cells": 20}}]})");
  const test::CommandResult r = test::deform({"run", scene, "--out", folder + "/out", "--quiet"});
  EXPECT_EQ(r.exit_code, 3);
  EXPECT_NE(r.err.find("'stone' has no equilibrium"), std::string::npos) << r.err;
}

std::string block_scene(const std::string &folder, const std::string &more) {
  const std::string scene = folder + "/block.json";
  test::write_file(scene, R"({"format": "deform-scene", "version": 1,
    "time": {"mode": "static", "duration": 1, "step": 0.5},
    "bodies": [{"name": "block", "mesh": {"make": "beam", "size": [0.1, 0.1, 0.1], "cells": 24}}],
    "obstacles": [{"name": "floor", "shape": "plane"}])" +
                              more + "}");
  return scene;
}

TEST(Equilibrium, StaticSceneWithContact_ReportsContactsOfItsEquilibria) {
  const std::string folder = test::scratch("static_contacts");
  const test::CommandResult r =
      test::deform({"run", block_scene(folder, ""), "--out", folder + "/out", "--quiet"});
  ASSERT_EQ(r.exit_code, 0) << r.err;
  const std::string summary = test::read_file(folder + "/out/summary.json");
  const size_t at = summary.find("\"mean\": ", summary.find("\"contacts\": {"));
  ASSERT_NE(at, std::string::npos) << summary;
  EXPECT_GE(std::strtod(summary.c_str() + at + 8, nullptr), 4) << "corners of the block: " << summary;
}

// Errors are reported as bad input, before a folder is made.
TEST(Equilibrium, StaticSceneThatCannotBe_IsRefusedWhenItIsRead) {
  const std::string folder = test::scratch("static_refused");
  const char *const rigid = R"(, "rigid": {"host": "builtin", "bodies": [{"name": "stone", "shape": "sphere",
    "radius": 0.1, "mass": 1, "pose": {"position": [0, 0, 1]}}]})";
  const test::CommandResult r =
      test::deform({"run", block_scene(folder, rigid), "--out", folder + "/out", "--quiet"});
  EXPECT_EQ(r.exit_code, 2) << r.err;
  for (const char *part : {"/time/mode: ", "moving rigid bodies"})
    EXPECT_NE(r.err.find(part), std::string::npos) << part << ": " << r.err;
  EXPECT_EQ(std::count(r.err.begin(), r.err.end(), '\n'), 1) << r.err;
  EXPECT_FALSE(std::filesystem::exists(folder + "/out"));
}

TEST(Equilibrium, ModelThatRefusesABody_IsReportedInOneSentence) {
  const std::string folder = test::scratch("model_refuses");
  const test::CommandResult r = test::deform(
      {"run", block_scene(folder, ""), "--out", folder + "/out", "--quiet", "--set",
       R"(/bodies/0/model={"type": "corotational_fem", "params": {"locking": "nodal", "energy": "stvk"}})"});
  EXPECT_EQ(r.exit_code, 2) << r.err;
  EXPECT_EQ(std::count(r.err.begin(), r.err.end(), '\n'), 1) << r.err;
  for (const char *part : {"/bodies/0: ", "refused the body: ", "locking nodal"})
    EXPECT_NE(r.err.find(part), std::string::npos) << part << ": " << r.err;
}

}  // namespace
