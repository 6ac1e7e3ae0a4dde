// Bodies of the models msm_gpu and corotational_fem_gpu in a world: contact and friction of the library,
// sub-steps, snapshots, the command.
#include <filesystem>

#include "cut_scenes.h"
#include "support.h"
#include "tool.h"
#include "under_ball.h"
#include "world.h"

namespace {

// A model, its springs with branches, tilted with forces of form A, or by themselves.
const std::string kRelaxing = "msm_gpu relaxing", kTurned = "msm_gpu turned", kAlone = "msm_gpu alone";
std::string type_of(const std::string &model) { return model.substr(0, model.find(' ')); }

struct World {
  test::Context context;
  dfm_world world;
  dfm_body body = 0;
  World(const std::string &model, double device, const char *law, double mu, std::array<double, 3> gravity,
        double z, double young = 2e5, uint32_t threads = 1)
      : context(threads) {
    world = test::make_world(context, gravity);
    const double size[3] = {0.1, 0.1, 0.1};
    dfm_mesh_handle mesh = 0;
    test::ok(dfm_mesh_make(context, "beam", size, DFM_MESH_CELLS, 200, &mesh));
    dfm_body_def d = dfm_body_def_default();
    d.name = "block";
    const std::string type = type_of(model);
    d.model = type.c_str();
    test::lend(mesh, d);
    test::BodyOptions o;
    o.young = young;
    o.damping_stiffness = 1e-3;
    d.material = test::make_material(world, o);
    const double sls = 2, time = 0.01, slope = 2, form_a = 1, none = 0;
    std::vector<dfm_param_value> params;
    if (type.ends_with("_gpu")) params.push_back({"device", &device, 1});
    if (model.ends_with("relaxing"))
      params.insert(params.end(), {{"damper", &sls, 1}, {"relaxation_time", &time, 1}});
    if (model.ends_with("turned"))
      params.insert(params.end(), {{"anisotropy_slope", &slope, 1}, {"anisotropy_form", &form_a, 1}});
    if (model == kAlone) params.insert(params.end(), {{"volume", &none, 1}, {"collapse", &none, 1}});
    d.model_params = {sizeof(dfm_params), uint32_t(params.size()), params.data()};
    d.pose.position[2] = z;
    test::ok(dfm_body_create(world, &d, &body));
    test::ok(dfm_mesh_destroy(mesh));
    test::add_plane(world, "floor");
    test::set_friction(world, mu, law);
  }
  ~World() { dfm_world_destroy(world); }
  dfm_body_measure now() const { return test::measure(body); }
};

constexpr double kHardware = 1, kSoftware = 2, kReference = 3;  // of the parameter "device"

bool is_there(double which) {
  test::Context context(1);
  const dfm_world w = test::make_world(context);
  test::Tet tet;
  const dfm_param_value row{"device", &which, 1};
  tet.def.model = "msm_gpu";
  tet.def.model_params = {sizeof(dfm_params), 1, &row};
  const dfm_material_def md = dfm_material_def_default();
  test::ok(dfm_material_create(w, &md, &tet.def.material));
  dfm_body body = 0;
  const bool made = dfm_body_create(w, &tet.def, &body) == DFM_OK;
  dfm_world_destroy(w);
  return made;
}

// "auto", a software driver at least; without one the processor.
double device() {
  static const double found = is_there(0) ? 0 : kReference;
  return found;
}

double normal_force(dfm_world world) {
  dfm_pair_report pair{};
  uint32_t n = 0;
  EXPECT_EQ(dfm_world_pairs(world, 1, &pair, &n), DFM_OK) << dfm_last_error();
  return n ? pair.normal : 0;
}

class GpuWorld : public testing::TestWithParam<std::string> {};
class GpuWorldState : public GpuWorld {};
constexpr auto name_of = [](const testing::TestParamInfo<std::string> &one) {
  const std::string type = type_of(one.param);
  return one.param == type ? type : one.param.substr(type.size() + 1);
};
INSTANTIATE_TEST_SUITE_P(Models, GpuWorld, testing::Values("msm_gpu", "corotational_fem_gpu", kRelaxing),
                         name_of);
INSTANTIATE_TEST_SUITE_P(Models, GpuWorldState,
                         testing::Values("msm_gpu", "corotational_fem_gpu", kRelaxing, kTurned), name_of);

std::string on_the_processor(std::string model) { return model.erase(model.find("_gpu"), 4); }

TEST_P(GpuWorld, BlockDropped_ComesToRestAsOnTheProcessor) {
  World gpu(GetParam(), device(), "coulomb", 0.5, {0, 0, -9.81}, 0.03);
  World processor(on_the_processor(GetParam()), 0, "coulomb", 0.5, {0, 0, -9.81}, 0.03);
  for (const World *w : {&gpu, &processor}) test::run(w->world, 1.5, 2e-3);
  const dfm_body_measure m = gpu.now();
  EXPECT_LT(m.speed_max, 1e-6);
  EXPECT_NEAR(normal_force(gpu.world), m.mass * 9.81, 1e-3 * m.mass * 9.81);
  EXPECT_NEAR(m.com[2], processor.now().com[2], 1e-5);
  EXPECT_LT(m.com[2], 0.04995);  // it sags
}

// The rest does not depend on the step that the host takes, though a longer one is divided for contact.
TEST_P(GpuWorld, SagOnAFloor_IsTheSameAtAnyStep) {
  double height[2];
  int n = 0;
  for (const double h : {5e-4, 1.0 / 60}) {
    World w(GetParam(), device(), "none", 0, {0, 0, -9.81}, 1e-3);
    test::run(w.world, 1.5, h);
    height[n++] = w.now().com[2];
  }
  EXPECT_NEAR(height[0], height[1], 1e-7);
}

TEST_P(GpuWorld, InFlight_TakesOneSubStepAndOnTheFloorThoseOfItsBound) {
  World w(GetParam(), device(), "coulomb", 0.5, {0, 0, -9.81}, 0.2);
  test::run(w.world, 0.1, 0.01);
  EXPECT_EQ(test::stats(w.world).substeps_max, 1u);
  test::run(w.world, 1.2, 0.01);
  const dfm_world_stats s = test::stats(w.world);
  EXPECT_GT(s.contacts, 0u);
  EXPECT_GE(s.last_substeps * s.stable_step, 0.01 * (1 - 1e-9));
}

TEST_P(GpuWorld, OnASlope_HoldsWithAnyLawAndCreepsLessThanItsBound) {
  for (const char *law : {"coulomb", "karnopp", "dahl", "lugre", "elastoplastic", "gms"}) {
    // laws are the library's, whatever moves the body
    if (GetParam() != "msm_gpu" && law != std::string("coulomb") && law != std::string("lugre")) continue;
    World w(GetParam(), device(), law, 0.6, {9.81 * std::sin(0.3), 0, -9.81 * std::cos(0.3)}, 1e-4);
    test::run(w.world, 1.0, 2e-3);
    const dfm_body_measure before = w.now();
    test::run(w.world, 1.0, 2e-3);
    const dfm_body_measure m = w.now();
    EXPECT_NEAR(normal_force(w.world), m.mass * 9.81 * std::cos(0.3), 0.01 * m.mass * 9.81) << law;
    EXPECT_LT(std::hypot(m.com[0] - before.com[0], m.com[1] - before.com[1]), 1e-6) << law;
  }
}

TEST_P(GpuWorld, OnASlope_SlidesWithCoulombsAcceleration) {
  const double theta = 0.5, mu = 0.3;
  World w(GetParam(), device(), "coulomb", mu, {9.81 * std::sin(theta), 0, -9.81 * std::cos(theta)}, 1e-4,
          1e6);
  test::run(w.world, 0.2, 1e-3);
  const double before = w.now().velocity[0];
  test::run(w.world, 0.4, 1e-3);
  EXPECT_NEAR((w.now().velocity[0] - before) / 0.4, 9.81 * (std::sin(theta) - mu * std::cos(theta)), 0.01);
}

TEST_P(GpuWorldState, SavedInContact_ContinuesWithTheSameBits) {
  const auto make = [] {
    return std::make_unique<World>(GetParam(), device(), "lugre", 0.5, std::array<double, 3>{1, 0, -9.81},
                                   0.01);
  };
  const auto a = make(), b = make();
  test::run(a->world, 0.1, 2e-3);
  ASSERT_GT(normal_force(a->world), 0);
  const std::string saved = test::snapshot(a->world);
  test::run(a->world, 0.1, 2e-3);
  test::run(b->world, 0.03, 2e-3);
  test::ok(dfm_world_restore(b->world, saved.data(), saved.size()));
  test::run(b->world, 0.1, 2e-3);
  EXPECT_EQ(dfm_world_hash(a->world), dfm_world_hash(b->world));
}

// Sheared, then as at rest: what dampers saw before moves nothing. All points but one stop: dampers between
// them see that at once.
TEST(GpuWorldVelocity, SetByTheHost_IsWhatDampersSee) {
  constexpr double h = 1e-4;  // the processor damps where steps change
  for (const std::string model : {"msm_gpu", "corotational_fem_gpu"}) {
    double lost[2];
    for (const bool card : {false, true}) {
      World w(card ? model : on_the_processor(model), kReference, "none", 0, {0, 0, 0}, 0.2);
      uint32_t n = 0;
      test::ok(dfm_body_get_state(w.body, 0, nullptr, nullptr, &n));
      std::vector<double> x(3 * size_t{n}), v(x);
      test::ok(dfm_body_get_state(w.body, n, x.data(), nullptr, &n));
      for (size_t i = 0; i < n; ++i) v[3 * i] = 20 * x[3 * i + 2];
      test::ok(dfm_body_set_state(w.body, n, x.data(), v.data()));
      test::run(w.world, 2e-3, h);
      std::fill(v.begin(), v.end(), 0.0);
      test::ok(dfm_body_set_state(w.body, n, x.data(), v.data()));
      test::run(w.world, h, h);
      EXPECT_LT(w.now().speed_max, 1e-9) << model << card;
      for (size_t i = 0; i < n; ++i) v[3 * i] = 1;
      test::ok(dfm_body_set_state(w.body, n, x.data(), v.data()));
      test::run(w.world, h, h);
      std::fill(v.begin() + 3, v.end(), 0.0);
      test::ok(dfm_body_set_state(w.body, n, x.data(), v.data()));
      test::run(w.world, h, h);
      lost[card] = 1 - w.now().speed_max;
    }
    EXPECT_GT(lost[0], 0.03) << model;
    EXPECT_NEAR(lost[1], lost[0], 0.05 * lost[0]) << model;
  }
}

// The cells under a sphere go, and with them their springs: the rest moves as what is left of the processor's
// body would, and as the same cut of another one does.
TEST_P(GpuWorldState, CutWhileItMoves_ContinuesWithTheCellsThatAreLeft) {
  uint64_t hash[2];
  double height[3];
  for (int n = 0; n < 3; ++n) {
    const std::string model = n < 2 ? GetParam() : on_the_processor(GetParam());
    World w(model, device(), "coulomb", 0.5, {0, 0, -9.81}, 1e-3);
    test::run(w.world, 0.1, 2e-3);
    const dfm_body_measure before = w.now();
    const dfm_cut_def sphere = test::cutting::sphere({0.05, 0.05, 0.1}, 0.03);
    dfm_cut_info done = test::cutting::request();
    test::ok(dfm_body_cut(w.body, &sphere, &done));
    EXPECT_GT(done.cells, 5u);
    EXPECT_NEAR(w.now().mass + done.mass, before.mass, 1e-12);
    test::run(w.world, 1.0, 2e-3);
    EXPECT_NEAR(normal_force(w.world), w.now().mass * 9.81, 1e-3 * before.mass * 9.81);
    height[n] = w.now().com[2];
    if (n < 2) hash[n] = dfm_world_hash(w.world);
  }
  EXPECT_EQ(hash[0], hash[1]);
  EXPECT_NEAR(height[0], height[2], 1e-5);
}

// Jaws close on the cube beside its middle and lift it: the force and torque that the tool feels and what
// each jaw presses with.
TEST_P(GpuWorld, LiftedByAGrasper_PullsAsOnTheProcessor) {
  std::vector<double> felt[2];
  for (const bool card : {false, true}) {
    World w(card ? GetParam() : on_the_processor(GetParam()), device(), "coulomb", 0.8, {0, 0, -9.81}, 1e-4,
            1e5);
    const dfm_pose start = test::tools::pose({0.05, 0.04, 0.51});
    dfm_tool_def d = test::tools::grasper({0.01, 0.03, 0.25}, 0.27, start);
    const dfm_tool jaws = test::tools::make(w.world, d);
    for (int n = 1; n <= 600; ++n) {
      const double t = 2e-3 * n;
      test::ok(dfm_tool_set_opening(jaws, std::max(0.27 - 0.5 * t, 0.17)));
      d.pose.position[2] = 0.51 + 0.2 * std::clamp(t - 0.2, 0.0, 0.2);
      test::ok(dfm_tool_set_pose(jaws, &d.pose, nullptr));
      ASSERT_EQ(dfm_world_step(w.world, 2e-3, nullptr), DFM_OK) << dfm_last_error();
    }
    felt[card].resize(6);
    test::ok(dfm_tool_force(jaws, &felt[card][0], &felt[card][3]));
    for (const dfm_pair_report &pair : test::listed(dfm_world_pairs, w.world))
      felt[card].push_back(pair.normal);
    EXPECT_NEAR(felt[card][2], -9.81, 0.1);
    EXPECT_NEAR(w.now().com[2], 0.09, 0.005);
  }
  ASSERT_EQ(felt[0].size(), 8u);
  ASSERT_EQ(felt[1].size(), 8u);
  for (size_t k = 0; k < 8; ++k) {
    // a torque by the weight at the cube's edge: jaws yield, so where between them it comes to rest is soft
    const double weight = std::hypot(felt[0][0], felt[0][1], felt[0][2]);
    const double whole = k < 3 ? weight : k < 6 ? 0.1 * weight : felt[0][k];
    EXPECT_NEAR(felt[1][k], felt[0][k], 0.01 * whole) << k;
  }
}

TEST(GpuTear, PulledBar_PartsAsOnTheProcessor) {
  for (const std::string model : test::cutting::kModels) {
    using Bar = test::cutting::PulledBar;
    Bar processor(model.c_str(), 0.3), card((model + "_gpu").c_str(), 0.3, device());
    const dfm_body_measure before = test::measure(card.b);
    for (const Bar *bar : {&processor, &card}) test::run(bar->w, 0.5, 1e-3);
    const dfm_body_measure after = test::measure(card.b);
    const uint32_t torn = processor.tears();
    EXPECT_GT(torn, 4u) << model;
    EXPECT_EQ(card.tears(), torn) << model;
    EXPECT_GT(test::cutting::parts(card.b), 1u) << model;
    EXPECT_EQ(test::cutting::parts(card.b), test::cutting::parts(processor.b)) << model;
    EXPECT_NEAR(after.mass, before.mass, 1e-13);
    EXPECT_NEAR(after.elastic, test::measure(processor.b).elastic, 0.02 * after.elastic) << model;
  }
}

// rho g L/E = 0.75: springs alone do not tell a cell from its mirror image.
TEST(MsmGpuWorld, SoftBlockReleased_InvertsNoCell) {
  World whole("msm_gpu", kReference, "coulomb", 0.5, {0, 0, -9.81}, 1e-3, 1308);
  World alone(kAlone, kReference, "coulomb", 0.5, {0, 0, -9.81}, 1e-3, 1308);
  for (const World *w : {&whole, &alone}) test::run(w->world, 0.5, 1.0 / 60);
  EXPECT_EQ(test::stats(whole.world).inverted_max, 0u);
  EXPECT_GT(test::stats(alone.world).inverted_max, 10u);
  EXPECT_GT(whole.now().com[2], 0.015);
}

// Two bodies, one on the other, submit from two threads at once.
TEST_P(GpuWorld, OnTwoWorkers_HasTheSameBits) {
  if (device() == kReference) GTEST_SKIP() << "no driver";
  uint64_t hash[2];
  for (const uint32_t threads : {1u, 2u}) {
    World w(GetParam(), device(), "coulomb", 0.5, {0, 0, -9.81}, 1e-3, 2e5, threads);
    test::BodyOptions o;
    o.name = "upper";
    o.model = type_of(GetParam());
    o.position = {0.02, 0.01, 0.103};
    test::make_body(w.context, w.world, "beam", {0.1, 0.1, 0.1}, 100, o);
    test::run(w.world, 0.1, 2e-3);
    EXPECT_GT(test::stats(w.world).contacts, 0u);
    hash[threads - 1] = dfm_world_hash(w.world);
  }
  EXPECT_EQ(hash[0], hash[1]);
}

// A card may round a square root and a quotient otherwise.
TEST_P(GpuWorldState, OnASoftwareDriverAndOnTheProcessor_HasTheSameBits) {
  if (!is_there(kSoftware)) GTEST_SKIP() << "no such driver";
  World a(GetParam(), kSoftware, "lugre", 0.5, {1, 0, -9.81}, 0.01);
  World b(GetParam(), kReference, "lugre", 0.5, {1, 0, -9.81}, 0.01);
  for (const World *w : {&a, &b}) test::run(w->world, 0.3, 2e-3);
  EXPECT_EQ(dfm_world_hash(a.world), dfm_world_hash(b.world));
}

// soak(relaxing): long; springs without branches make the same way
TEST_P(GpuWorld, UnderASoftBall_CarriesBothWeights) {
  World w(GetParam(), device(), "coulomb", 0.5, {0, 0, -9.81}, 1e-4, 1e6);
  test::expect_block_carries_ball(w.context, w.world, w.body, 1.8);
}

const char *const kScene =
    R"({"format": "deform-scene", "version": 1, "time": {"duration": 0.01, "step": 0.001},
 "materials": {"soft": {"density": 1000, "young": 1e5}},
 "bodies": [{"name": "cube", "mesh": {"make": "beam", "size": [0.1, 0.1, 0.1], "cells": 50},
   "material": "soft", "model": {"type": "msm_gpu"DEVICE}}]})";

test::CommandResult run_scene(const std::string &device, bool driver) {
  const std::string folder = test::scratch("gpu"), file = folder + "/scene.json";
  std::string scene = kScene;
  const size_t at = scene.find("DEVICE");
  scene.replace(at, 6, device.empty() ? "" : ", \"params\": {\"device\": \"" + device + "\"}");
  test::write_file(file, scene);
  std::vector<std::string> argv = {"/usr/bin/env"};
  if (!driver) argv.insert(argv.end(), {"VK_ICD_FILENAMES=/nowhere.json", "VK_DRIVER_FILES=/nowhere.json"});
  argv.insert(argv.end(), {DEFORM_COMMAND, "run", file, "--out", folder + "/out"});
  return test::run(argv);
}

TEST(GpuCommand, WithoutADriver_SaysWhatToInstallAndTheReferenceStillRuns) {
  const test::CommandResult none = run_scene("", false), processor = run_scene("reference", false);
  EXPECT_NE(none.exit_code, 0);
  EXPECT_NE(none.err.find("take the model without _gpu"), std::string::npos) << none.err;
  EXPECT_NE(none.err.find("mesa-vulkan-drivers"), std::string::npos) << none.err;
  EXPECT_EQ(processor.exit_code, 0) << processor.err;
}

// A sphere is pressed 9 mm into a block that lies on voxels, and dragged: normal and friction forces of both
// pairs within 1 % of the processor's, and the point below it.
TEST(GpuCommand, ProbeOnABlockOnVoxels_PushesAsOnTheProcessor) {
  const std::string folder = test::scratch("gpu_probe"), file = folder + "/scene.json";
  test::Context context;
  dfm_mesh_handle surface = 0;
  const double slab[3] = {0.3, 0.3, 0.1};
  test::ok(dfm_mesh_make(context, "beam", slab, DFM_MESH_SURFACE, 200, &surface));
  test::ok(dfm_mesh_write(surface, (folder + "/slab.ply").c_str()));
  test::write_file(file, R"({"format": "deform-scene", "version": 1, "time": {"duration": 0.3, "step": 0.001},
 "materials": {"tissue": {"density": 1000, "young": 5e4, "damping": {"mass": 5, "stiffness": 0.004}}},
 "bodies": [{"name": "block", "mesh": {"make": "beam", "size": [0.1, 0.1, 0.1], "cells": 200},
   "material": "tissue", "pose": {"position": [0, 0, 0.1001]}, "model": {"type": "msm"}}],
 "obstacles": [
   {"name": "slab", "shape": "voxels", "mesh": "slab.ply", "cells": 4000,
    "pose": {"position": [-0.1, -0.1, 0]}},
   {"name": "probe", "shape": "sphere", "radius": 0.03, "pose": {"position": [0.05, 0.05, 0.232]},
    "motion": {"keyframes": [{"t": 0, "position": [0.05, 0.05, 0.232]},
      {"t": 0.1, "position": [0.05, 0.05, 0.222]}, {"t": 0.3, "position": [0.06, 0.05, 0.222]}]}}],
 "contact": {"friction": [{"between": ["*", "*"], "law": "coulomb", "params": {"mu": 0.3}}]},
 "probes": [{"name": "tip", "body": "block", "point": [0.05, 0.05, 0.1]}], "output": {"every": 0.1}})");
  for (const std::string model : {"msm", "corotational_fem"}) {
    std::vector<double> found[2];
    for (const bool card : {false, true}) {
      const std::string type = model + (card ? R"(_gpu", "params": {"device": "reference"})" : R"(")");
      const test::CommandResult r = test::deform(
          {"run", file, "--out", folder + "/out", "--set", R"(/bodies/0/model={"type": ")" + type + "}"});
      ASSERT_EQ(r.exit_code, 0) << r.err;
      const auto pairs = test::read_csv(folder + "/out/contacts.csv"),
                 tip = test::read_csv(folder + "/out/probes.csv");
      for (size_t row = pairs.size() - 2; row < pairs.size(); ++row)
        for (const size_t column : {5, 6}) found[card].push_back(std::stod(pairs[row][column]));
      for (const size_t column : {2, 3, 4}) found[card].push_back(std::stod(tip.back()[column]));
    }
    ASSERT_EQ(found[0].size(), 7u);
    for (size_t k = 0; k < 7; ++k) {
      EXPECT_GT(found[0][k], k < 4 ? 3 : 0.03) << model;
      EXPECT_NEAR(found[1][k], found[0][k], k < 4 ? 0.01 * found[0][k] : 2e-4) << model << " " << k;
    }
  }
}

// A machine that must have a card fails without one.
TEST(GpuCommand, Hardware_IsNoSoftwareDriver) {
  const test::CommandResult r = run_scene("hardware", true);
  bool card = false;
  for (const char *node : {"/dev/dri/renderD128", "/dev/nvidia0"})
    card = card || std::filesystem::exists(node);
  if (!card) {
    EXPECT_NE(r.exit_code, 0) << "a driver of software was taken";
    EXPECT_NE(r.err.find("no graphics card"), std::string::npos) << r.err;
  }
}

const std::string kCube = R"("mesh": {"make": "beam", "size": [0.1, 0.1, 0.1], "cells": 50}, )";

// "device" of a body, the members of its model, and those of the body.
test::CommandResult explain_on(const std::string &device, const std::string &model, bool driver,
                               const std::string &costs = "", const std::string &wish = "",
                               const std::string &body = "") {
  const std::string folder = test::scratch("device"), file = folder + "/scene.json";
  test::write_file(file,
                   R"({"format": "deform-scene", "version": 1, "time": {"duration": 0.01, "step": 0.001},
 )" + wish + R"("materials": {"soft": {"density": 1000, "young": 1e5, "damping": {"stiffness": 1e-4}},
   "clay": {"young": 1e5, "yield": 0.1}},
 "bodies": [{"name": "cube", "material": "soft", )" +
                       (body.find("\"mesh\"") == std::string::npos ? kCube + body : body) + R"("device": ")" +
                       device + R"(", "model": {)" + model + "}}]}");
  test::write_file(folder + "/tet.msh", R"($MeshFormat
2.2 0 8
$EndMeshFormat
$PhysicalNames
1
3 1 "core"
$EndPhysicalNames
$Nodes
4
1 0 0 0
2 0.1 0 0
3 0 0.1 0
4 0 0 0.1
$EndNodes
$Elements
1
1 4 2 1 1 1 2 3 4
$EndElements
)");
  std::vector<std::string> argv = {"/usr/bin/env", "DEFORM_COSTS=" + costs};
  if (!driver) argv.insert(argv.end(), {"VK_ICD_FILENAMES=/nowhere.json", "VK_DRIVER_FILES=/nowhere.json"});
  argv.insert(argv.end(), {DEFORM_COMMAND, "explain", file});
  return test::run(argv);
}

bool says(const test::CommandResult &r, const std::string &words) {
  return (r.exit_code == 0 ? r.out : r.err).find(words) != std::string::npos;
}

// A file of costs in which the card moves cells faster, or slower.
std::string costs_of_cells(bool faster) {
  const auto model = [](const char *name, const char *itself, const char *ns) {
    std::string costs;
    for (const char *meets : {"free", "touching", "pressed", "stacked"})
      costs += std::string(costs.empty() ? "" : ", ") + "\"" + meets +
               R"(": [{"points": 10, "ns_per_point": )" + ns + "}]";
    return std::string(R"({"model": ")") + name + R"(", "steps_itself": )" + itself +
           R"(, "wave_steps": 1, "errors": {"bends_little": 0, "bends_far": 0, "turns": 0, "lies": 0,)"
           R"( "dents": 0, "dent_force": 0}, "costs": {"symplectic_euler": {)" +
           costs + "}}}";
  };
  const std::string file = test::scratch("costs") + "/costs.json";
  test::write_file(file,
                   R"({"format": "deform-costs", "version": 4, "machine": "that of the test", "models": [)" +
                       model("corotational_fem", "false", "100") + ", " +
                       model("corotational_fem_gpu", "true", faster ? "1" : "1e9") + "]}");
  return file;
}

TEST(GpuScene, Device_ChoosesTheModelOfThatName) {
  for (const auto &[device, model, found] :
       {std::array{"cpu", R"("type": "msm")", "model: org.deform.msm  "},
        std::array{"auto", R"("type": "condensed")", "no loaded model computes what condensed does"}}) {
    const test::CommandResult r = explain_on(device, model, true);
    EXPECT_EQ(r.exit_code, 0) << r.err;
    EXPECT_TRUE(says(r, found)) << r.out;
  }
  for (const char *device : {"cpu", "auto"}) {
    const test::CommandResult other = explain_on(device, R"("type": "msm_gpu")", true);
    EXPECT_NE(other.exit_code, 0);
    EXPECT_TRUE(says(other, "/bodies/0/device: org.deform.msm_gpu is the model of a graphics card"))
        << other.err;
  }
  const test::CommandResult none = explain_on("gpu", R"("type": "condensed")", true);
  EXPECT_NE(none.exit_code, 0);
  EXPECT_TRUE(says(none, "that exists for corotational_fem, msm")) << none.err;
  if (device() == kReference) GTEST_SKIP() << "no driver";
  const test::CommandResult springs =
      explain_on("gpu", R"("type": "msm", "params": {"damper": "sls", "anisotropy_slope": 1})", true);
  EXPECT_TRUE(says(springs, "runs on: gpu, by msm_gpu: the scene asks for it")) << springs.out << springs.err;
  EXPECT_TRUE(says(springs, "on_processor: ")) << springs.out;
  EXPECT_TRUE(says(explain_on("gpu", R"("type": "corotational_fem")", true), "by corotational_fem_gpu"));
}

TEST(GpuScene, DeviceBesideAnAccuracy_IsThatOfTheModelThatThePlannerTakes) {
  const test::CommandResult r =
      explain_on("auto", R"("type": "auto")", true, "", R"("accuracy": {"target": 0.9},)");
  EXPECT_EQ(r.exit_code, 0) << r.err;
  EXPECT_TRUE(says(r, "runs on: cpu, by ")) << r.out;
  EXPECT_TRUE(says(r, "chosen:   ")) << r.out;
  if (device() == kReference) GTEST_SKIP() << "no driver";
  const test::CommandResult card =
      explain_on("gpu", R"("type": "auto")", true, "", R"("accuracy": {"target": 0.9},)");
  EXPECT_EQ(card.exit_code, 0) << card.err;
  EXPECT_TRUE(says(card, "runs on: gpu, by msm_gpu")) << card.out;
}

// The card has fewer effects than the processor, and no scene loses one without a word.
TEST(GpuScene, WhatTheCardLacks_IsReported) {
  if (device() == kReference) GTEST_SKIP() << "no driver";
  const test::CommandResult other =
      explain_on("gpu", R"("type": "corotational_fem", "params": {"energy": "stvk"})", true);
  EXPECT_NE(other.exit_code, 0);
  EXPECT_TRUE(says(other, "corotational_fem_gpu has no \"energy\" here")) << other.err;
  for (const auto &[body, model, words] :
       {std::array{R"("mesh": "tet.msh", "materials_by_group": {"core": "clay"}, )", "",
                   "has no \"yield\" here"},
        std::array{R"("mesh": {"make": "beam", "size": [1, 1, 1], "cells": 50, "order": 2}, )", "",
                   "second-order"},
        std::array{R"("mesh": {"make": "bricks", "size": [1, 1, 1], "cells": 50}, )", "", "hex"},
        std::array{R"("mass_scaling": 0.1, )", "", "mass_scaling"},
        std::array{"", R"("type": "msm", "precision": "single")", "only in double precision"},
        std::array{R"("integrator": "implicit_euler", )", "", "is moved by symplectic_euler alone"}}) {
    const std::string of = *model ? model : R"("type": "corotational_fem")";
    const test::CommandResult r = explain_on("gpu", of, true, "", "", body);
    EXPECT_NE(r.exit_code, 0) << words;
    EXPECT_TRUE(says(r, "/bodies/0/device: ") && says(r, words) && says(r, "take \"device\": \"cpu\""))
        << r.err;
    EXPECT_EQ(std::count(r.err.begin(), r.err.end(), '\n'), 1) << r.err;
    const test::CommandResult either = explain_on("auto", of, true, costs_of_cells(true), "", body);
    EXPECT_EQ(either.exit_code, 0) << either.err;
    EXPECT_EQ(either.err, "");
    EXPECT_TRUE(says(either, "runs on: cpu, by ")) << either.out;
  }
}

// Whatever reads the scene once more, a scale that it does not say stays one that it does not say.
TEST(GpuScene, SizeInMillimeters_IsReportedWithEveryDevice) {
  const std::string file = test::scratch("millimeters") + "/tet.obj";
  test::write_file(file, "v 0 0 0\nv 90 0 0\nv 0 90 0\nv 0 0 90\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n");
  const std::string body =
      R"("mesh": ")" + file + R"(", "fill": {"cells": 50}, "pose": {"position": [0, 0, 1]}, )";
  for (const auto &[on, model] : {std::array{"cpu", "msm"}, std::array{"auto", "msm"},
                                  std::array{"auto", "condensed"}, std::array{"gpu", "msm"}}) {
    if (std::string_view(on) == "gpu" && device() == kReference) continue;
    const test::CommandResult r =
        explain_on(on, std::string(R"("type": ")") + model + "\"", true, "", "", body);
    EXPECT_EQ(r.exit_code, 0) << r.err;
    const size_t first = r.err.find("is in millimeters, set \"scale\"");
    EXPECT_NE(first, std::string::npos) << on << " " << model << ": " << r.err;
    EXPECT_EQ(r.err.find("is in millimeters, set", first + 1), std::string::npos) << r.err;
  }
}

// A state of a machine where "auto" chose otherwise.
TEST(GpuScene, StateOfAnotherDevice_IsReported) {
  const std::string folder = test::scratch("state"), file = folder + "/scene.json", state = folder + "/s.dfm";
  test::write_file(file,
                   R"({"format": "deform-scene", "version": 1, "time": {"duration": 0.01, "step": 0.001},
 "bodies": [{"name": "cube", )" +
                       kCube + R"("device": "auto", "model": {"type": "condensed"}}]})");
  const auto run = [&](const std::vector<std::string> &more) {
    std::vector<std::string> argv = {"run", file, "--out", folder + "/out"};
    argv.insert(argv.end(), more.begin(), more.end());
    return test::deform(argv);
  };
  const test::CommandResult saved = run({"--save", "0.005", state});
  ASSERT_EQ(saved.exit_code, 0) << saved.err;
  EXPECT_EQ(run({"--from", state}).exit_code, 0);
  std::string text = test::read_file(state);
  const size_t at = text.find("is on cpu");
  ASSERT_NE(at, std::string::npos);
  text.replace(at, 9, "is on gpu");
  test::write_file(state, text);
  const test::CommandResult r = run({"--from", state});
  EXPECT_NE(r.exit_code, 0);
  EXPECT_TRUE(says(r, "written where 'cube' is on gpu, and here 'cube' is on cpu")) << r.err;
}

TEST(GpuScene, WithoutADriver_GpuIsRefusedInOneSentence) {
  const test::CommandResult r = explain_on("gpu", R"("type": "corotational_fem")", false);
  EXPECT_NE(r.exit_code, 0);
  EXPECT_TRUE(says(r, "/bodies/0/device: ") && says(r, "mesa-vulkan-drivers")) << r.err;
  EXPECT_TRUE(says(r, "take \"device\": \"cpu\"")) << r.err;
  EXPECT_EQ(std::count(r.err.begin(), r.err.end(), '\n'), 1) << r.err;
}

TEST(GpuScene, Auto_TakesTheCardWhereItIsFasterAndThere) {
  for (const bool faster : {true, false}) {
    const std::string file = costs_of_cells(faster);
    const test::CommandResult here = explain_on("auto", R"("type": "corotational_fem")", true, file),
                              none = explain_on("auto", R"("type": "corotational_fem")", false, file);
    EXPECT_EQ(here.exit_code, 0) << here.err;
    EXPECT_EQ(none.exit_code, 0) << none.err;
    EXPECT_EQ(none.err, "");
    EXPECT_TRUE(says(none, "runs on: cpu, by corotational_fem: ")) << none.out;
    EXPECT_TRUE(says(none, faster ? "mesa-vulkan-drivers" : "(costs of that of the test)")) << none.out;
    // no card is what computes on the processor
    const bool card = is_there(kHardware);
    EXPECT_TRUE(says(here, faster && card ? "runs on: gpu" : "runs on: cpu")) << here.out;
    if (!faster) continue;
    EXPECT_TRUE(says(here, card ? "(costs of" : "no graphics card")) << here.out;
  }
}

// V09 counts 144 bytes that Mesa 22.3.6 leaves at each vkEnumeratePhysicalDevices of a new instance.
TEST(GpuCommand, PluginCheck_FindsNothingOfOurs) {
  if (device() == kReference) GTEST_SKIP() << "no driver: the defaults of the model are refused";
  const test::CommandResult r =
      test::deform({"plugin", "check", std::string(DEFORM_PLUGIN_DIR) + "/model_gpu.so"});
  std::istringstream lines(r.out);
  int passed = 0;
  for (std::string line, id, result; std::getline(lines, line);) {
    std::istringstream words(line);
    words >> id >> result;
    passed += result == "pass";
    if (result == "FAIL") {
      EXPECT_EQ(id, "V09") << r.out;
    }
  }
  EXPECT_GE(passed, 39) << r.out;
}

}  // namespace
