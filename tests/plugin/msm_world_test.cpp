// The mass-spring model's options through the library: state by instance is saved, hashed and restored; the
// plan lists what is at work.
#include "world.h"

namespace {

struct Scene {
  test::Context context;
  dfm_world world = 0;
  dfm_body body = 0;

  explicit Scene(const std::vector<std::pair<const char *, std::vector<double>>> &params,
                 std::vector<const char *> requested = {}, uint32_t threads = 1)
      : context(threads) {
    dfm_world_def w = dfm_world_def_default();
    requested.push_back(nullptr);
    if (requested.size() > 1) w.effects = requested.data();
    test::ok(dfm_world_create(context, &w, &world));
    std::vector<uint8_t> fixed;
    dfm_body_def d = test::clamped_beam(context, 4, fixed);
    std::vector<dfm_param_value> values;
    for (const auto &[key, value] : params) values.push_back({key, value.data(), uint32_t(value.size())});
    d.model_params = {sizeof(dfm_params), uint32_t(values.size()), values.data()};
    test::ok(dfm_body_create(world, &d, &body));
  }
  ~Scene() { dfm_world_destroy(world); }
  dfm_status advance(int steps) {
    dfm_status status = DFM_OK;
    for (int n = 0; n < steps && status == DFM_OK; ++n) status = dfm_world_step(world, 1e-3, nullptr);
    return status;
  }
  std::string plan() const { return test::explain(world); }
  std::string snapshot() const { return test::snapshot(world); }
};

// Among the effects of the plan; bodies, which come later, list what their models could do.
bool lists(const std::string &plan, const char *effect) {
  return plan.substr(0, plan.find("\"stages\"")).find("\"name\":\"" + std::string(effect) + "\"") !=
         std::string::npos;
}

using Values = std::vector<std::pair<const char *, std::vector<double>>>;
const Values kSls = {
    {"damper", {2}}, {"relaxation_ratio", {2}}, {"relaxation_time", {0.02}}, {"anisotropy_slope", {1}}};

TEST(MsmWorld, Branches_AreSavedHashedAndRestored) {
  Scene s(kSls), other(kSls);
  test::ok(s.advance(30));
  const std::string data = s.snapshot();
  const uint64_t then = dfm_world_hash(s.world);
  test::ok(s.advance(100));
  const uint64_t end = dfm_world_hash(s.world);
  EXPECT_NE(then, end);
  for (Scene *to : {&s, &other}) {
    test::ok(dfm_world_restore(to->world, data.data(), data.size()));
    EXPECT_EQ(dfm_world_hash(to->world), then);
    test::ok(to->advance(100));
    EXPECT_EQ(dfm_world_hash(to->world), end);
  }
  // A body that has no branches gets them with the parameters that the snapshot tells.
  Scene voigt({{"anisotropy_slope", {1}}});
  EXPECT_NE(dfm_world_hash(voigt.world), then);
  test::ok(dfm_world_restore(voigt.world, data.data(), data.size()));
  EXPECT_EQ(dfm_world_hash(voigt.world), then);
  test::ok(voigt.advance(100));
  EXPECT_EQ(dfm_world_hash(voigt.world), end);
}

TEST(MsmWorld, MaxwellBar_FlowsUnderGravityWhereAVoigtBarStands) {
  const auto sag = [](double damper, int steps) {
    Scene s({{"young", {5e5}},
             {"damper", {damper}},
             {"relaxation_time", {0.05}},
             {"damping_stiffness", {0.002}},
             {"damping_mass", {8}}});
    dfm_body_measure before{}, after{};
    before.size = after.size = sizeof before;
    test::ok(dfm_body_get_measure(s.body, &before));
    test::ok(s.advance(steps));
    test::ok(dfm_body_get_measure(s.body, &after));
    return before.com[2] - after.com[2];
  };
  const double voigt = sag(0, 4000), sls = sag(2, 4000), maxwell = sag(1, 4000);
  EXPECT_NEAR(sls, voigt, 0.01 * voigt);  // the same spring carries both in the end
  EXPECT_GT(maxwell, 3 * voigt);          // 0.31 m of a bar of 0.5 m
}

TEST(MsmWorld, Plan_ListsTheEffectsThatParametersCallFor) {
  Scene plain({{"volume", {0}}, {"damping_stiffness", {0}}, {"damping_mass", {0}}});
  test::ok(plain.advance(1));
  std::string plan = plain.plan();
  EXPECT_TRUE(lists(plan, "large_rotation"));
  for (const char *effect : {"volume", "damping", "anisotropy", "deform.relaxation"})
    EXPECT_FALSE(lists(plan, effect)) << effect;
  const double one = 1;
  const dfm_param_value values[] = {{"volume", &one, 1}, {"anisotropy_slope", &one, 1}};
  const dfm_params params = {sizeof params, 2, values};
  test::ok(dfm_body_set_params(plain.body, &params));
  test::ok(plain.advance(1));
  plan = plain.plan();
  EXPECT_TRUE(lists(plan, "volume") && lists(plan, "anisotropy"));
  EXPECT_FALSE(lists(plan, "damping"));
  Scene sls(kSls);
  test::ok(sls.advance(1));
  plan = sls.plan();
  EXPECT_TRUE(lists(plan, "deform.relaxation") && lists(plan, "damping") && lists(plan, "anisotropy"));
}

TEST(MsmWorld, EffectThatParametersLeaveOff_IsRefusedWithTheWayOut) {
  Scene s({{"volume", {0}}}, {"volume"});
  EXPECT_EQ(s.advance(1), DFM_E_ARG);
  const std::string why = dfm_last_error();
  EXPECT_NE(why.find("volume"), std::string::npos);
  EXPECT_NE(why.find("deform plugin info org.deform.msm"), std::string::npos) << why;
  Scene on({{"volume", {1}}}, {"volume"});
  EXPECT_EQ(on.advance(1), DFM_OK);
}

TEST(MsmWorld, DamperOfARunningBody_CannotChange) {
  Scene s({});
  const double maxwell = 1;
  const dfm_param_value value = {"damper", &maxwell, 1};
  const dfm_params params = {sizeof params, 1, &value};
  EXPECT_EQ(dfm_body_set_params(s.body, &params), DFM_E_ARG);
  EXPECT_NE(std::string(dfm_last_error()).find("damper"), std::string::npos);
}

}  // namespace
