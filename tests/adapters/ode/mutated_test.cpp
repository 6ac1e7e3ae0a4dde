// Scenes with host "ode" whose numbers are replaced by extremes: ODE's assertions, which end a process, end
// in an error of ours, and its handlers stay those of the host program. Each run has a process of its own.
// tests/bench/ode_mutations.py draws thousands.
#include <gtest/gtest.h>

#include <ode/ode.h>

#include <cctype>

#include "deform/deform.h"
#include "deform/ode_host.h"
#include "support.h"

namespace {

struct Mutation { const char *scene, *assignment; };

std::string file_of(const std::string &scene) {
  return std::string(DEFORM_SOURCE_DIR) + "/examples/scenes/" + scene + ".json";
}

test::CommandResult run(const Mutation &m, const std::string &more = "/output/every=1") {
  const std::string out = test::scratch("ode_mutated");
  return test::run({"/usr/bin/timeout", "120", DEFORM_COMMAND, "run", file_of(m.scene), "--quiet", "--time",
                    "0.01", "--out", out, "--set", m.assignment, "--set", more});
}

class MutatedOdeScene : public testing::TestWithParam<Mutation> {};

void PrintTo(const Mutation &m, std::ostream *out) { *out << m.scene; }

// letters and figures of scene and assignment
std::string name_of(const testing::TestParamInfo<Mutation> &info) {
  std::string name = std::string(info.param.scene) + info.param.assignment;
  for (char &c : name)
    if (!std::isalnum(static_cast<unsigned char>(c))) c = '_';
  return name;
}

void ignore(int, const char *, va_list) {}

}  // namespace

TEST_P(MutatedOdeScene, EndsInOrder) {
  const test::CommandResult r = run(GetParam());
  EXPECT_TRUE(r.exit_code == 0 || r.exit_code == 2 || r.exit_code == 3) << r.exit_code << "\n" << r.err;
  EXPECT_EQ(r.exit_code == 0, r.err.find("deform: /") == std::string::npos) << r.err;
}

INSTANTIATE_TEST_SUITE_P(Seen, MutatedOdeScene,
                         testing::Values(Mutation{"ode_bed", "/gravity/2=1e200"},
                                         Mutation{"ode_bed", "/gravity=[1e200,1e200,1e200]"},
                                         Mutation{"ode_bed", "/rigid/bodies/0/pose/position/0=1e15"},
                                         Mutation{"ode_bed", "/rigid/bodies/0/spin=[1e6,1e6,1e6]"},
                                         Mutation{"ode_bed", "/rigid/bodies/0/spin=[0,0,1e200]"},
                                         Mutation{"ode_bed", "/rigid/bodies/0/velocity=[1e200,0,0]"},
                                         Mutation{"ode_bed", "/rigid/bodies/0/half_size/0=1e30"},
                                         Mutation{"ode_bed", "/rigid/bodies/0/mass=1e-200"},
                                         Mutation{"ode_bed",
                                                  "/rigid/bodies/0/inertia=[1e-200,1e-200,1e-200]"},
                                         Mutation{"ode_chain", "/gravity/2=-1e200"},
                                         Mutation{"ode_chain", "/rigid/bodies/1/pose/position/0=1e15"},
                                         Mutation{"ode_chain", "/rigid/bodies/1/pose/position/0=1e9"},
                                         Mutation{"ode_chain", "/rigid/bodies/2/spin=[1e6,1e6,1e6]"},
                                         Mutation{"ode_chain", "/rigid/bodies/3/joints/0/anchor/1=-1e15"},
                                         Mutation{"ode_chain", "/rigid/bodies/1/joints/0/anchor/0=1e30"},
                                         Mutation{"ode_cart", "/rigid/bodies/0/spin=[1e6,1e6,1e6]"},
                                         Mutation{"ode_gripper", "/rigid/bodies/0/mass=1e30"},
                                         Mutation{"ode_seesaw", "/gravity/2=-1e200"}),
                         name_of);

TEST(OdeHost, BodyThatItCannotTake_IsRefusedWithItsReason) {
  const test::CommandResult r = run({"ode_bed", "/rigid/bodies/0/pose/position/0=1e15"});
  EXPECT_EQ(r.exit_code, 2);
  for (const char *part : {"refuses", "(1e+15, ", "within 1e+09 m"})
    EXPECT_NE(r.err.find(part), std::string::npos) << part << " in\n" << r.err;
}

// The scene whose joint is 1e15 m off makes ODE fail an assertion in its step.
TEST(OdeAssertion, InAStep_IsAnErrorAndTheCallersHandlersStay) {
  ASSERT_EQ(dfm_ode_register(), DFM_OK);
  dSetDebugHandler(ignore);
  dSetErrorHandler(ignore);
  dfm_context_def def = dfm_context_def_default();
  def.plugin_dir = DEFORM_PLUGIN_DIR;
  def.log = [](void *, int32_t, const char *) {};
  dfm_context *context = nullptr;
  ASSERT_EQ(dfm_context_create(&def, &context), DFM_OK);
  const char *const set[] = {"/rigid/bodies/3/joints/0/anchor/1=-1e15"};
  dfm_scene_options options = {};
  options.size = sizeof options;
  options.nset = 1;
  options.set = set;
  dfm_scene scene = 0;
  dfm_world world = 0;
  ASSERT_EQ(dfm_scene_open(context, file_of("ode_chain").c_str(), &options, &scene), DFM_OK)
      << dfm_last_error();
  ASSERT_EQ(dfm_scene_world(scene, &world), DFM_OK);
  dfm_status status = DFM_OK;
  uint32_t trouble = 0;
  for (int i = 0; i < 20 && status >= 0; ++i) status = dfm_world_step(world, 1e-3, &trouble);
  EXPECT_EQ(status, DFM_E_DIVERGED) << dfm_last_error();
  EXPECT_NE(std::string(dfm_last_error()).find("host \"ode\""), std::string::npos) << dfm_last_error();
  EXPECT_LT(dfm_world_step(world, 1e-3, &trouble), 0) << "it stays an error, and no crash";
  EXPECT_EQ(dGetDebugHandler(), ignore);
  EXPECT_EQ(dGetErrorHandler(), ignore);
  dSetDebugHandler(nullptr);
  dSetErrorHandler(nullptr);
  dfm_context_destroy(context);
}
