// A block of a model of the caller's choice over a floor, under a law and a gravity of its choice.
#pragma once
#include "support.h"
#include "world.h"

namespace test {

struct Block {
  const char *model, *law = "coulomb";
  std::array<double, 3> gravity{0, 0, -9.81};
  double z = 1e-4;
  int32_t integrator = DFM_INTEGRATOR_AUTO;
  double young = 1e5, damping_stiffness = 0;
};

struct BlockWorld {
  Context context;
  dfm_world world;
  dfm_body body;
  explicit BlockWorld(const Block &b) {
    world = make_world(context, b.gravity, b.integrator);
    BodyOptions o;
    o.name = "block";
    o.model = b.model;
    o.young = b.young;
    o.damping_stiffness = b.damping_stiffness;
    o.position = {0, 0, b.z};
    body = make_body(context, world, "beam", {0.2, 0.1, 0.1}, 120, o);
    add_plane(world, "floor");
    ok(add_friction(world, b.law));
  }
  ~BlockWorld() { dfm_world_destroy(world); }
};

inline std::array<double, 3> tilted(double angle) {
  return {9.81 * std::sin(angle), 0, -9.81 * std::cos(angle)};
}

// The floor carries the block's weight.
inline void expect_weight(const BlockWorld &w, double tolerance) {
  dfm_pair_report pair{};
  uint32_t n = 0;
  ASSERT_EQ(dfm_world_pairs(w.world, 1, &pair, &n), DFM_OK) << dfm_last_error();
  EXPECT_NEAR(pair.normal / (measure(w.body).mass * 9.81), 1, tolerance);
}

// Another block falls on it where nothing acts from outside: what one loses the other gains.
inline void expect_collision_keeps_momentum(Block b, const char *other, double seconds) {
  b.gravity = {0, 0, 0};
  b.z = 1;
  BlockWorld w(b);
  BodyOptions o;
  o.name = "other";
  o.model = other;
  o.position = {0.02, 0.01, 1.11};
  const dfm_body second = make_body(w.context, w.world, "beam", {0.2, 0.1, 0.1}, 120, o);
  set_velocity(second, {0.3, 0, -1});
  const auto momentum = [&](int k) {
    const dfm_body_measure m = measure(w.body), n = measure(second);
    return m.mass * m.velocity[k] + n.mass * n.velocity[k];
  };
  const std::array<double, 3> before{momentum(0), momentum(1), momentum(2)};
  run(w.world, seconds, 1e-3);
  EXPECT_LT(measure(w.body).velocity[2], -0.1) << other << ": they have met";
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(momentum(k), before[size_t(k)], 1e-11) << other;
}

// The shipped scene with the model of its first body replaced, for a time and a step (0: its own).
inline void expect_valid_demo(const std::string &scene, const std::string &model, double duration,
                              double step) {
  const std::string out = scratch(model + "_" + scene);
  std::vector<std::string> arguments = {
      "run",    std::string(DEFORM_SOURCE_DIR) + "/examples/scenes/" + scene + ".json",
      "--set",  R"(/bodies/0/model={"type":")" + model + R"("})",
      "--set",  "/time/duration=" + std::to_string(duration),
      "--out",  out,
      "--quiet"};
  if (step > 0) arguments.insert(arguments.end(), {"--set", "/time/step=" + std::to_string(step)});
  const CommandResult result = deform(arguments);
  ASSERT_EQ(result.exit_code, 0) << scene << ": " << result.err;
  const std::string summary = read_file(out + "/summary.json");
  for (const char *fact : {"\"finite\": true", "\"intersections_max\": 0", "\"stopped\": null"})
    EXPECT_NE(summary.find(fact), std::string::npos) << scene << " " << fact;
}

}  // namespace test
