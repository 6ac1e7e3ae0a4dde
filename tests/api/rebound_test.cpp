// A fall by each integrator, as `deform run` and `deform explain` tell of it: the peak force, and bodies that
// will not rebound.
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <cstdlib>
#include <string>
#include <vector>

#include "support.h"
#include "world.h"

namespace {

// A ball of 1e9 Pa, 60 cells, falls 5 mm at 2 m/s; rule: what the pair has beside its law.
struct Fall {
  std::string path = test::scratch("rebound_" + std::to_string(getpid())) + "/";
  explicit Fall(const std::string &rule, const std::string &time = R"("step": 0.002)") {
    test::write_file(path + "scene.json", R"({
      "format": "deform-scene", "version": 1, "time": {"duration": 0.03, )" +
                                              time + R"(},
      "materials": {"stiff": {"density": 1000, "young": 1e9, "poisson": 0.3}},
      "bodies": [{"name": "ball", "mesh": {"make": "ball", "radius": 0.05, "cells": 60}, "material": "stiff",
                  "pose": {"position": [0, 0, 0.055]}, "velocity": [0, 0, -2]}],
      "obstacles": [{"name": "floor", "shape": "plane"}],
      "contact": {"friction": [{"between": ["*", "*"], "law": "none")" +
                                              rule + R"(}]},
      "output": {"every": 0.01}})");
  }
  struct Run {
    std::string err, summary;
    double number(const std::string &key) const {
      const size_t at = summary.find("\"" + key + "\": ");
      return at == std::string::npos ? NAN : std::atof(summary.c_str() + at + key.size() + 4);
    }
    double velocity() const {  // m/s upward, at the end
      size_t at = summary.find("\"velocity\": [");
      for (int k = 0; k < 2 && at != std::string::npos; ++k) at = summary.find(", ", at + 1);
      return at == std::string::npos ? NAN : std::atof(summary.c_str() + at + 2);
    }
  };
  Run run(const std::string &integrator) const {
    const auto r = test::deform({"run", path + "scene.json", "--set",
                                 "/time/integrator=\"" + integrator + "\"", "--out", path + integrator});
    EXPECT_EQ(r.exit_code, 0) << r.err;
    return {r.err, test::read_file(path + integrator + "/summary.json")};
  }
  std::string explain(const std::string &integrator) const {
    return test::deform({"explain", path + "scene.json", "--set", "/time/integrator=\"" + integrator + "\""})
        .out;
  }
};

const std::vector<std::string> kAll = {"symplectic_euler", "implicit_euler", "tr_bdf2", "auto"};
constexpr const char *kWords = "will not rebound";

}  // namespace

// The largest force of a sub-step differs by a factor of hundreds between them.
TEST(Rebound, PeakForce_IsThatOfTheFallByEveryIntegrator) {
  const Fall fall(R"(, "restitution": 0.95)");
  std::vector<double> peaks;
  for (const std::string &integrator : kAll) {
    const Fall::Run r = fall.run(integrator);
    EXPECT_EQ(r.number("peak_window_s"), 0.005);
    peaks.push_back(r.number("peak_N"));
  }
  for (size_t i = 0; i < kAll.size(); ++i) EXPECT_NEAR(peaks[i], peaks[0], 0.2 * peaks[0]) << kAll[i];
}

TEST(Rebound, WindowOfThePeak_IsTheLongestStepThatTheSceneAllows) {
  EXPECT_EQ(Fall("", R"("step": 0.015)").run("implicit_euler").number("peak_window_s"), 0.015);
  EXPECT_EQ(Fall("", R"("step": "auto")").run("symplectic_euler").number("peak_window_s"), 0.01);
}

TEST(Rebound, IntegratorThatWillNotRebound_SaysSo) {
  const Fall fall("", R"("step": 0.016)");
  for (const std::string &integrator : kAll) {
    const Fall::Run r = fall.run(integrator);
    const double up = r.velocity();
    const bool dead = up < 1;
    if (integrator != "auto") {  // which may find that explicit time takes less work
      EXPECT_EQ(dead, integrator != "symplectic_euler") << up;
    }
    EXPECT_EQ(r.summary.find("body 'ball' falls on 'floor'") != std::string::npos, dead)
        << integrator << r.err;
    EXPECT_EQ(r.summary.find(kWords) != std::string::npos, dead) << integrator;
    EXPECT_EQ(fall.explain(integrator).find(kWords) != std::string::npos, integrator != "symplectic_euler");
  }
  for (const auto &[integrator, remedies] : {std::pair{"implicit_euler", "a restitution of the pair"},
                                             {"auto", "automatic steps, or with a restitution of the pair"}})
    EXPECT_NE(fall.explain(integrator).find(std::string("; it does with ") + remedies + "\n"),
              std::string::npos)
        << fall.explain(integrator);
  const Fall given(R"(, "restitution": 0.5)", R"("step": 0.016)");
  EXPECT_EQ(given.run("implicit_euler").summary.find(kWords), std::string::npos) << "the pair throws it back";
}

// What it touched is gone: nothing is told of it, and nothing of it is read.
TEST(Rebound, WithoutAnythingToFallOn_IsNotTold) {
  std::string told;
  dfm_context_def of = dfm_context_def_default();
  of.plugin_dir = DEFORM_PLUGIN_DIR;
  of.user = &told;
  of.log = [](void *user, int32_t, const char *text) { *static_cast<std::string *>(user) += text; };
  dfm_context *context = nullptr;
  test::ok(dfm_context_create(&of, &context));
  const dfm_world w = test::make_world(context, {0, 0, -9.81});
  const dfm_obstacle floor = test::add_plane(w, "floor");
  test::BodyOptions o;
  o.integrator = DFM_INTEGRATOR_TR_BDF2;
  o.position = {0, 0, 0.1002};
  const dfm_body ball = test::make_body(context, w, "ball", {0.1, 0, 0}, 60, o);
  for (int i = 0; i < 30; ++i) test::ok(dfm_world_step(w, 1e-3, nullptr));
  ASSERT_GT(test::stats(w).contacts, 0u);
  test::ok(dfm_obstacle_destroy(floor));
  const double none[3] = {};
  test::ok(dfm_world_set_gravity(w, none));
  test::set_velocity(ball, {0, 0, -20});
  uint32_t n = 0;
  test::ok(dfm_body_get_state(ball, 0, nullptr, nullptr, &n));
  std::vector<uint32_t> points(n);
  std::vector<double> up(3 * size_t{n});
  for (uint32_t i = 0; i < n; ++i) {
    points[i] = i;
    up[3 * size_t{i} + 2] = test::measure(ball).mass / n * 15 / 1e-3;
  }
  test::ok(dfm_body_add_load(ball, n, points.data(), up.data(), 0, nullptr, nullptr, nullptr));
  test::ok(dfm_world_step(w, 1e-3, nullptr));
  EXPECT_EQ(told.find(kWords), std::string::npos) << told;
  dfm_context_destroy(context);
}
