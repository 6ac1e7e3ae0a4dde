// The energy watch: a run that gains energy out of nothing ends early and says so; work that is really
// done is no gain.
#define DFM_STATIC_PLUGIN counting_looks
#include <filesystem>
#include <random>

#include "deform/plugin.hpp"
#include "step_energy.h"
#include "support.h"

using namespace test::step_energy;

extern "C" const dfm_plugin *dfm_plugin_entry_counting_looks(const dfm_host *, uint32_t, uint32_t);

namespace {

const std::string kBar = DEFORM_SOURCE_DIR "/examples/data/bar.msh";

// Points without forces between them, whose energy is asked for: how often?
uint32_t looks = 0;
dfm_status create(const dfm_host *, const dfm_mesh *, void **self) {
  *self = &looks;
  return DFM_OK;
}
void destroy(void *) {}
dfm_status no_forces(void *, const dfm_kin *, double *) { return DFM_OK; }
dfm_status no_energy(void *, const dfm_kin *, double *joule) {
  *joule = 0;
  ++looks;
  return DFM_OK;
}

// Forces along the velocities: they do work, and no energy pays for it.
uint32_t pushed = 0;  // points
dfm_status create_pushed(const dfm_host *, const dfm_mesh *mesh, void **self) {
  pushed = mesh->npoint;
  *self = &pushed;
  return DFM_OK;
}
dfm_status push_forward(void *, const dfm_kin *k, double *f) {
  for (size_t at = 0; at < size_t(pushed) * k->stride; ++at) f[at] += 1e-3 * k->v[at];
  return DFM_OK;
}

// A body that is pushed forward.
struct Pushed {
  test::Context context;
  dfm_world world = 0;
  dfm_body body = 0;
  explicit Pushed(double watch = 0.01) {
    test::ok(dfm_plugin_register_static(context, dfm_plugin_entry_counting_looks, "counting_looks"));
    dfm_world_def d = dfm_world_def_default();
    d.energy_watch = watch;
    d.gravity[2] = 0;
    test::ok(dfm_world_create(context, &d, &world));
    test::BodyOptions o;
    o.model = "test.pushed";
    body = test::make_body(context, world, "beam", {0.1, 0.1, 0.1}, 60, o);
    test::set_velocity(body, {0, 0, 1});
  }
  dfm_status step(uint32_t *trouble) { return dfm_world_step(world, 1e-3, trouble); }
};

}  // namespace

extern "C" const dfm_plugin *dfm_plugin_entry_counting_looks(const dfm_host *host, uint32_t, uint32_t) {
  if (!DFM_ABI_OK(host)) return nullptr;
  static const char *const effects[] = {nullptr};
  static dfm_model ops{};
  ops.size = sizeof ops;
  ops.caps = DFM_CAP_ENERGY;
  ops.cells = DFM_CELL_TET;
  ops.create = create;
  ops.destroy = destroy;
  ops.add_forces = no_forces;
  ops.energy = no_energy;
  static const dfm_type type =
      dfm::plugin::type(DFM_KIND_MODEL, "test.counting_looks", "points", "1", "MIT", "test", effects, &ops);
  static dfm_model pushes = ops;
  pushes.create = create_pushed;
  pushes.add_forces = push_forward;
  static const dfm_type pushed_type =
      dfm::plugin::type(DFM_KIND_MODEL, "test.pushed", "points", "1", "MIT", "test", effects, &pushes);
  static const dfm_type *const types[] = {&type, &pushed_type};
  static const dfm_plugin plugin{sizeof(dfm_plugin), DFM_ABI, DFM_ABI_DRAFT, 2, types, nullptr};
  return &plugin;
}

TEST(EnergyWatch, ModelThatPushesForward_EndsBeforeTheEnergyHasGrownByATenth) {
  Pushed b;
  uint32_t trouble = 0;
  dfm_status status = DFM_OK;
  int i = 0;
  for (; i < 20000 && status == DFM_OK; ++i) status = b.step(&trouble);
  ASSERT_EQ(status, DFM_E_DIVERGED) << i;
  EXPECT_TRUE(trouble & DFM_TROUBLE_ENERGY);
  const std::string why = dfm_last_error();
  for (const char *word : {"body1", "step", "energy", "limit: 1 %", "shorter step"})
    EXPECT_NE(why.find(word), std::string::npos) << why;
  const dfm_world_stats stats = test::stats(b.world);
  EXPECT_GT(stats.energy_gain, 0.01 * stats.energy_max);
  EXPECT_LT(stats.energy_gain, 0.1 * stats.energy_max);
  const dfm_body_measure m = test::measure(b.body);
  EXPECT_LT(m.kinetic + m.elastic, 1.2 * stats.energy_max) << "the state is a good one";
  const uint64_t hash = dfm_world_hash(b.world);
  EXPECT_EQ(b.step(nullptr), DFM_E_DIVERGED) << "the cause is still there";
  EXPECT_EQ(dfm_world_hash(b.world), hash);
  test::set_velocity(b.body, {0, 0, 0});
  EXPECT_EQ(b.step(nullptr), DFM_OK) << "a new state is a new beginning";
}

TEST(EnergyWatch, SwitchedOff_StopsNothing) {
  test::Context context;
  dfm_world_def d = dfm_world_def_default();
  EXPECT_EQ(d.energy_watch, 0.01);
  dfm_world w = 0;
  for (const double bad : {-1.0, double(NAN), HUGE_VAL}) {
    d.energy_watch = bad;
    EXPECT_EQ(dfm_world_create(context, &d, &w), DFM_E_ARG);
  }
  Pushed b(0);
  for (int i = 0; i < 4000; ++i) ASSERT_EQ(b.step(nullptr), DFM_OK);
  EXPECT_EQ(test::stats(b.world).energy_gain, 0);
}

// Nothing moves it but rounding, which grows like any motion of a body that nothing damps.
TEST(EnergyWatch, UndampedBodyAtRest_IsNotStopped) {
  test::Context context;
  const dfm_world w = test::make_world(context);
  test::BodyOptions o;
  o.young = 1e7;
  test::make_body(context, w, "beam", {0.1, 0.1, 0.1}, 60, o);
  for (int i = 0; i < 5; ++i) ASSERT_EQ(dfm_world_step(w, 0.1, nullptr), DFM_OK) << dfm_last_error();
}

// Each of these lengths is stable by itself. Without the damping that such changes call for, their sequence
// adds energy to the stiff modes until the watch stops the run.
TEST(EnergyWatch, StepsOfRandomLength_AddNoEnergy) {
  for (const char *motion : {"wrung", "ring", "spin"}) {
    test::Context context;
    const Setting s = make(context, {"bar", kBar, motion, 1});
    double stable = 0;
    test::ok(dfm_world_stable_step(s.world, &stable, nullptr, nullptr));
    std::mt19937 random(1);
    const dfm_body_measure before = test::measure(s.body);
    for (int i = 0; i < 20000; ++i)
      ASSERT_EQ(dfm_world_step(s.world, stable * (0.8 + 0.2 * double(random()) / 4294967296.0), nullptr),
                DFM_OK)
          << motion << ", step " << i << ": " << dfm_last_error();
    const dfm_body_measure after = test::measure(s.body);
    EXPECT_LT(after.kinetic + after.elastic, 1.001 * (before.kinetic + before.elastic)) << motion;
    for (int k = 0; k < 3; ++k) {
      EXPECT_NEAR(after.momentum[k], before.momentum[k], 1e-12) << motion;
      EXPECT_NEAR(after.angular[k], before.angular[k], 1e-9 * std::fabs(before.angular[2]) + 1e-15) << motion;
    }
  }
}

// The bound shortens the sub-steps in an impact, which moves the body from one nearby energy to another: no
// gain, though nothing damps it.
TEST(EnergyWatch, UndampedBodyThatBounces_IsNoGain) {
  for (const double step : {1.0 / 60, 1e-3}) {
    test::Context context;
    const dfm_world w = test::make_world(context);
    test::BodyOptions o;
    o.position = {0, 0, 0.2};
    test::make_body(context, w, "beam", {0.2, 0.1, 0.1}, 600, o);
    const dfm_obstacle_def d = dfm_obstacle_def_default();
    dfm_obstacle floor = 0;
    test::ok(dfm_obstacle_create(w, &d, &floor));
    for (int i = 0; i * step < 2; ++i)
      ASSERT_EQ(dfm_world_step(w, step, nullptr), DFM_OK) << step << ": " << dfm_last_error();
    EXPECT_GT(test::stats(w).substeps_max, uint32_t(step * 1000)) << "the impact asks for shorter sub-steps";
    test::ok(dfm_world_destroy(w));
  }
}

// An impact shortens the sub-steps while contact presses the body: what that changes of the balance does not
// depend on the impulses of contact, nor on the pieces that the guard has just cut.
TEST(EnergyWatch, BallThatFallsOnASoftPad_IsNoGain) {
  struct Fall {
    double young, radius, mass, from;
    int cells;
  };
  const Fall falls[] = {{5e4, 0.03, 0.3, 0.25, 600},  // shorter sub-steps
                        {2e5, 0.03, 0.3, 0.25, 5000},
                        {1e5, 0.03, 0.3, 0.12, 600},
                        {1e4, 0.03, 0.3, 1.024, 1500},  // shorter after a piece that the guard has cut
                        {1e4, 0.05, 1, 1.04, 200},
                        {1e5, 0.03, 0.5, 0.99, 300},  // cells that are strained by a tenth at once
                        {1e5, 0.03, 0.5, 0.99, 450}};
  for (const Fall &f : falls) {
    const std::string out = test::scratch("energy_watch_ball"), scene = out + "/scene.json";
    test::write_file(scene, R"({"format": "deform-scene", "version": 1, "time": {"duration": 1},
    "materials": {"soft": {"density": 1000, "young": )" +
                                std::to_string(f.young) + R"(, "poisson": 0.3}},
    "bodies": [{"name": "pad", "mesh": {"make": "beam", "size": [0.2, 0.2, 0.05], "cells": )" +
                                std::to_string(f.cells) + R"(}, "material": "soft",
                "pose": {"position": [-0.1, -0.1, 0.001]}}],
    "rigid": {"bodies": [{"name": "ball", "shape": "sphere", "radius": )" +
                                std::to_string(f.radius) + R"(, "mass": )" + std::to_string(f.mass) +
                                R"(, "pose": {"position": [0.02, 0.01, )" +
                                std::to_string(0.051 + f.radius + f.from) +
                                R"(]}}]},
    "obstacles": [{"name": "floor", "shape": "plane"}],
    "contact": {"friction": [{"between": ["*", "*"], "law": "coulomb", "params": {"mu": 0.5}}]}})");
    const test::CommandResult r = test::deform({"run", scene, "--out", out + "/run", "--quiet"});
    EXPECT_EQ(r.exit_code, 0) << f.young << " Pa, " << f.mass << " kg from " << f.from << " m: " << r.err;
  }
}

// A light impact strains cells far beyond yield in one sub-step. What flow dissipates there is as much as the
// largest energy so far, and is no gain until it is committed.
TEST(EnergyWatch, BodyThatYieldsUnderAnImpact_IsNoGain) {
  const std::string out = test::scratch("energy_watch_yield"), scene = out + "/scene.json";
  test::write_file(scene, R"({"format": "deform-scene", "version": 1,
    "time": {"duration": 0.15, "step": 5e-4},
    "materials": {"clay": {"density": 2500, "young": 1e7, "poisson": 0.3, "friction": 0.5}},
    "bodies": [{"name": "bed", "mesh": {"make": "beam", "size": [0.2, 0.2, 0.04], "cells": 800},
                "material": "clay", "model": {"type": "corotational_fem", "params": {"yield": 2000}},
                "pose": {"position": [-0.1, -0.1, 0]}, "fix": [{"box": [[-1, -1, -0.001], [1, 1, 0.001]]}]}],
    "rigid": {"bodies": [{"name": "box", "shape": "box", "half_size": [0.02, 0.0125, 0.0125], "mass": 0.1,
                          "pose": {"position": [0, 0, 0.0735]}}]},
    "obstacles": [{"name": "floor", "shape": "plane"}]})");
  const test::CommandResult r = test::deform({"run", scene, "--out", out + "/run", "--quiet"});
  EXPECT_EQ(r.exit_code, 0) << r.err;
}

// An impact compresses cells, which stiffen, before sixteen sub-steps are over: then the bound is looked at.
TEST(EnergyWatch, SoftBallThatIsThrown_IsNoGain) {
  struct Throw {
    double down;
    int cells;
  };
  for (const Throw &t : {Throw{2, 2000}, Throw{10, 300}, Throw{10, 2000}}) {
    const std::string out = test::scratch("energy_watch_throw"), scene = out + "/scene.json";
    test::write_file(scene, R"({"format": "deform-scene", "version": 1, "time": {"duration": 0.4},
    "materials": {"soft": {"density": 1000, "young": 1e4, "poisson": 0.3}},
    "bodies": [{"name": "ball", "mesh": {"make": "ball", "radius": 0.05, "cells": )" +
                                std::to_string(t.cells) +
                                R"(}, "material": "soft", "pose": {"position": [0, 0, 0.1]},
                "velocity": [1, 0, )" +
                                std::to_string(-t.down) + R"(]}],
    "obstacles": [{"name": "floor", "shape": "plane"}],
    "contact": {"friction": [{"between": ["*", "*"], "law": "coulomb", "params": {"mu": 0.5}}]}})");
    const test::CommandResult r = test::deform({"run", scene, "--out", out + "/run", "--quiet"});
    EXPECT_EQ(r.exit_code, 0) << t.cells << " cells, " << t.down << " m/s: " << r.err;
  }
}

// A base costs eight looks. A host that changes something before every step would have a new
// one all the time.
TEST(EnergyWatch, HostThatChangesEveryStep_CostsFewLooks) {
  test::Context context;
  test::ok(dfm_plugin_register_static(context, dfm_plugin_entry_counting_looks, "counting_looks"));
  const dfm_world w = test::make_world(context);
  test::BodyOptions o;
  o.model = "test.counting_looks";
  const dfm_body b = test::make_body(context, w, "beam", {0.1, 0.1, 0.1}, 60, o);
  looks = 0;
  const uint32_t steps = 10000;
  for (uint32_t i = 0; i < steps; ++i) {
    if (i % 10 == 0) test::set_velocity(b, {0, 0, 1});
    test::ok(dfm_world_step(w, 1e-3, nullptr));
  }
  EXPECT_GE(looks, steps / 512);
  EXPECT_LE(looks, 16 + steps / 256);
}

// The pressed points move in every sub-step until contact stops them; that is no new motion.
TEST(EnergyWatch, BodyThatIsPressedAndAtRest_NeedsFewChecks) {
  test::Context context;
  test::ok(dfm_plugin_register_static(context, dfm_plugin_entry_counting_looks, "counting_looks"));
  const dfm_world w = test::make_world(context, {0, 0, 0});
  test::add_plane(w, "floor");
  test::BodyOptions o;
  o.model = "test.counting_looks";
  const dfm_body b = test::make_body(context, w, "beam", {0.1, 0.1, 0.1}, 60, o);
  const std::vector<double> x = test::State(b).x;
  const uint32_t n = uint32_t(x.size() / 3);
  std::vector<uint32_t> low;
  for (uint32_t i = 0; i < n; ++i)
    if (x[3 * i + 2] < 1e-6) low.push_back(i);
  ASSERT_FALSE(low.empty());
  std::vector<double> force(3 * low.size(), 0.0);
  for (size_t i = 2; i < force.size(); i += 3) force[i] = -10;
  test::ok(
      dfm_body_add_load(b, uint32_t(low.size()), low.data(), force.data(), 0, nullptr, nullptr, nullptr));
  looks = 0;
  const uint32_t steps = 5000;
  for (uint32_t i = 0; i < steps; ++i) test::ok(dfm_world_step(w, 1e-3, nullptr));
  EXPECT_LT(test::measure(b).kinetic, 1e-6);
  EXPECT_LE(looks, 16 + steps / 512);
}

// Held points that are shaken, also under a load; a load and a gravity that vary, a spring, an obstacle that
// strikes from below: all put energy in and take it out.
void do_work(int32_t integrator, double h) {
  test::Context context;
  for (int what = 0; what < 6; ++what) {
    const dfm_world w = test::make_world(context, {0, 0, what == 4 ? -9.81 : 0.0}, integrator);
    test::BodyOptions o;
    o.position = {0, 0, what == 4 ? 0.05 : 0};
    const dfm_body b = test::make_body(context, w, "beam", {0.3, 0.06, 0.06}, 150, o);
    const std::vector<double> x = test::State(b).x;
    const uint32_t n = uint32_t(x.size() / 3);
    std::vector<uint32_t> end;
    for (uint32_t i = 0; i < n; ++i)
      if (x[3 * i] < *std::min_element(x.begin(), x.end()) + 0.02) end.push_back(i);
    if (what == 0 || what == 5) {
      test::ok(dfm_body_hold(b, uint32_t(end.size()), end.data(), 7));
      const dfm_sine sine{{0, 0, 0.01}, 11, 0};
      test::ok(dfm_body_move_held(b, uint32_t(end.size()), end.data(), 0, nullptr, &sine));
    }
    if (what == 1 || what == 5) {
      std::vector<double> force(3 * end.size(), 0.0);
      for (size_t i = 2; i < force.size(); i += 3) force[i] = 0.02;
      const dfm_sine sine{{50, 0, 0}, 13, 0};
      test::ok(
          dfm_body_add_load(b, uint32_t(end.size()), end.data(), force.data(), 0, nullptr, &sine, nullptr));
    } else if (what == 2) {
      const dfm_vector_key keys[] = {
          {0, {0, 0, 0}}, {0.1, {0, 3, 20}}, {0.2, {0, -3, -20}}, {0.5, {0, 0, 5}}};
      test::ok(dfm_world_set_gravity_keys(w, 4, keys));
    } else if (what == 3) {
      dfm_spring_def d{};
      d.size = sizeof d;
      d.npoint = uint32_t(end.size());
      d.points = end.data();
      d.to[2] = 0.1;
      d.stiffness = 100;
      test::ok(dfm_body_add_spring(b, &d, nullptr));
    } else if (what == 4) {
      dfm_obstacle_def d = dfm_obstacle_def_default();
      d.name = "anvil";
      d.shape = DFM_SHAPE_PLANE;
      d.sine = {{0, 0, 0.02}, 5, 0};
      dfm_obstacle obstacle = 0;
      test::ok(dfm_obstacle_create(w, &d, &obstacle));
      test::set_friction(w, 0, "none");
    }
    for (int i = 0; i < 0.5 / h; ++i)
      ASSERT_EQ(dfm_world_step(w, h, nullptr), DFM_OK) << what << ": " << dfm_last_error();
    const dfm_world_stats s = test::stats(w);
    EXPECT_GT(s.energy_max, 1e-5) << what;
    EXPECT_LT(s.energy_gain, 1e-3 * s.energy_max) << what;
    test::ok(dfm_world_destroy(w));
  }
}

TEST(EnergyWatch, WorkThatIsDone_IsNoGain) { do_work(DFM_INTEGRATOR_SYMPLECTIC_EULER, 1e-3); }

TEST(EnergyWatch, WorkThatIsDoneOnImplicitBodies_IsNoGain) {
  for (const int32_t integrator : {DFM_INTEGRATOR_IMPLICIT_EULER, DFM_INTEGRATOR_TR_BDF2})
    for (const double h : {1e-3, 1.0 / 60}) {
      SCOPED_TRACE(std::to_string(integrator) + " at " + std::to_string(h) + " s");
      do_work(integrator, h);
    }
}

TEST(EnergyWatch, OfAScene_IsReadAndReported) {
  const std::string out = test::scratch("energy_watch"), scene = out + "/scene.json";
  const std::string text =
      R"({"format": "deform-scene", "version": 1, "time": {"duration": 0.02, "step": "auto"},
    "gravity": [0, 0, 0],
    "bodies": [{"name": "bar", "mesh": ")" +
      kBar + R"(", "spin": [0, 0, 9]}], "output": {"every": 0.01}})";
  test::write_file(scene, text);
  const test::CommandResult r = test::deform({"run", scene, "--out", out + "/run", "--quiet"});
  EXPECT_EQ(r.exit_code, 0) << r.err;
  const std::string summary = test::read_file(out + "/run/summary.json");
  for (const char *key : {"\"energy\"", "\"start_J\"", "\"max_J\"", "\"gain_J\""})
    EXPECT_NE(summary.find(key), std::string::npos) << key;
  for (const char *good : {"0.05", "false", "true", "0"})
    EXPECT_EQ(test::deform({"run", scene, "--time", "0.001", "--out", out + "/run", "--quiet", "--set",
                            std::string("/contact/energy_watch=") + good})
                  .exit_code,
              0)
        << good;
  for (const char *bad : {"-1", "often"}) {
    const test::CommandResult no = test::deform({"run", scene, "--out", out + "/run", "--quiet", "--set",
                                                 std::string("/contact/energy_watch=") + bad});
    EXPECT_EQ(no.exit_code, 2);
    EXPECT_NE(no.err.find("/contact/energy_watch"), std::string::npos) << no.err;
  }
}

// A model whose dampers push instead of braking, beside a body that is sound: the run stops, says which and
// when, and keeps its last good state.
TEST(EnergyWatch, OfARunThatAModelPumps_ExitsWithThree) {
  const std::string out = test::scratch("energy_watch_pumped"), scene = out + "/scene.json";
  test::write_file(scene,
                   R"({"format": "deform-scene", "version": 1, "time": {"duration": 30, "step": "auto"},
    "bodies": [{"name": "sound", "mesh": ")" +
                       kBar + R"(", "pose": {"position": [0, 2, 0]}, "spin": [0, 0, 9]},
               {"name": "pumped", "mesh": ")" +
                       kBar + R"(", "model": {"type": "org.tiny.pump"}, "spin": [0, 0, 9]}],
    "gravity": [0, 0, 0], "output": {"every": 1, "states": true}})");
  std::filesystem::create_directories(out + "/plugins");
  std::filesystem::copy_file(std::string(DEFORM_BINARY_DIR) + "/lib/tiny/tiny_pump.so",
                             out + "/plugins/tiny_pump.so",
                             std::filesystem::copy_options::overwrite_existing);
  const auto run = [&](const std::vector<std::string> &more) {
    std::vector<std::string> all{"run", scene, "--quiet", "--out", out + "/run"};
    all.insert(all.end(), more.begin(), more.end());
    setenv("DEFORM_PLUGIN_PATH", (out + "/plugins").c_str(), 1);
    const test::CommandResult result = test::deform(all);
    unsetenv("DEFORM_PLUGIN_PATH");
    return result;
  };
  const test::CommandResult r = run({});
  EXPECT_EQ(r.exit_code, 3) << r.err;
  for (const char *part : {"stopped at step ", "body 'pumped'",
                           "beyond what loads, motions and contact have put in", "last good state"})
    EXPECT_NE(r.err.find(part), std::string::npos) << part << ": " << r.err;
  EXPECT_TRUE(std::filesystem::exists(out + "/run/states/last_pumped.vtu"));
  const std::string summary = test::read_file(out + "/run/summary.json");
  EXPECT_NE(summary.find("\"body\": \"pumped\""), std::string::npos) << summary;
  const size_t at = r.err.find("stopped at step ") + 16;
  const std::string step = r.err.substr(at, r.err.find_first_not_of("0123456789", at) - at);
  EXPECT_GT(std::stoi(step), 0);
  EXPECT_NE(summary.find("\"steps\": " + step + ","), std::string::npos)
      << "the steps before it are done: " << summary;
  EXPECT_NE(summary.find("\"finite\": true"), std::string::npos) << summary;
  const test::CommandResult blind = run({"--time", "0.5", "--set", "/contact/energy_watch=0"});
  EXPECT_EQ(blind.exit_code, 0) << blind.err;
}

// Forces of 940 N were reported at 1e-12 s, of 7e8 N at 1e-15 s.
TEST(ShortStep, BelowTheFloor_IsRefusedWithASentence) {
  test::Context context;
  const dfm_world w = test::make_world(context);
  const dfm_body b = test::make_body(context, w, "beam", {0.1, 0.1, 0.1}, 60, {});
  const uint64_t hash = dfm_world_hash(w);
  for (const double dt : {1e-15, 1e-12, 0.99e-9}) {
    EXPECT_EQ(dfm_world_step(w, dt, nullptr), DFM_E_ARG) << dt;
    EXPECT_NE(std::string(dfm_last_error()).find("take a longer step"), std::string::npos)
        << dfm_last_error();
  }
  EXPECT_EQ(dfm_world_hash(w), hash);
  EXPECT_EQ(dfm_world_step(w, 1e-9, nullptr), DFM_OK);
  std::vector<double> x = test::State(b).x;
  const uint32_t n = uint32_t(x.size() / 3);
  for (size_t i = 0; i < x.size(); i += 3) x[i] += 50;
  test::ok(dfm_body_set_state(b, n, x.data(), nullptr));
  EXPECT_EQ(dfm_world_step(w, 1e-8, nullptr), DFM_E_ARG) << "50 m away positions round 50 times as much";
  EXPECT_EQ(dfm_world_step(w, 1e-7, nullptr), DFM_OK);
  const std::string out = test::scratch("short_step"), scene = out + "/scene.json";
  test::write_file(scene,
                   R"({"format": "deform-scene", "version": 1, "time": {"duration": 1e-9, "step": 1e-12},
    "bodies": [{"name": "bar", "mesh": ")" +
                       kBar + "\"}]}");
  const test::CommandResult r = test::deform({"explain", scene});
  EXPECT_EQ(r.exit_code, 2);
  EXPECT_NE(r.err.find("/time/step"), std::string::npos) << r.err;
}
