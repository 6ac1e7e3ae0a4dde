// Parameters that do nothing beside the others: who says so, where it is shown, and that the word
// "auto" is a value.
#include <unistd.h>

#include "support.h"
#include "world.h"

namespace {

struct Setting {
  double poisson = 0.3, volume = -1;
  const char *extra = nullptr;
  double young = 1e5;
};

std::vector<std::string> warnings;
std::string plan(const Setting &s) {
  warnings.clear();
  dfm_context_def def = dfm_context_def_default();
  def.threads = 1;
  def.plugin_dir = DEFORM_PLUGIN_DIR;
  def.log = [](void *, int32_t level, const char *text) {
    if (level == DFM_LOG_WARNING) warnings.push_back(text);
  };
  dfm_context *c = nullptr;
  EXPECT_EQ(dfm_context_create(&def, &c), DFM_OK) << dfm_last_error();
  const dfm_world world = test::make_world(c);
  dfm_material_def md = dfm_material_def_default();
  md.poisson = s.poisson;
  md.young = s.young;
  const double one = 1;
  const dfm_param_value extra{s.extra, &one, 1}, volume{"volume", &s.volume, 1};
  if (s.extra) md.extra = {sizeof(dfm_params), 1, &extra};
  dfm_material material = 0;
  test::ok(dfm_material_create(world, &md, &material));
  const double points[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
  const uint32_t tets[] = {0, 1, 2, 3};
  dfm_body_def d = dfm_body_def_default();
  d.name = "lone";
  d.npoint = 4;
  d.ntet = 1;
  d.points = points;
  d.tets = tets;
  d.material = material;
  d.model_params = {sizeof(dfm_params), 1, &volume};
  dfm_body body = 0;
  test::ok(dfm_body_create(world, &d, &body));
  const std::string text = test::written(dfm_world_explain, world);
  dfm_context_destroy(c);
  return text.substr(text.find("\"idle\""));
}

}  // namespace

TEST(Idle, PoissonsRatioAtWork_IsNotListed) {
  for (const Setting &s :
       {Setting{0.3, -1}, Setting{0.45, -1}, Setting{0.45, 1}, Setting{0.25, 0}, Setting{0.25, -1}}) {
    EXPECT_EQ(plan(s).find("\"idle\":[]"), 0u) << s.poisson << " " << s.volume << plan(s);
    EXPECT_TRUE(warnings.empty()) << warnings[0];
  }
}

TEST(Idle, PoissonsRatioWithoutEffect_IsListedAndWarnedOf) {
  for (const Setting &s : {Setting{-0.5, -1}, Setting{0.2, -1}, Setting{0.45, 0}}) {
    EXPECT_NE(plan(s).find("\"name\":\"poisson\",\"why\""), std::string::npos) << s.poisson;
    ASSERT_EQ(warnings.size(), 1u);
    for (const char *word : {"lone", "poisson", "1/4"})
      EXPECT_NE(warnings[0].find(word), std::string::npos) << warnings[0];
  }
  EXPECT_NE(plan({0.3, 0}).find("\"name\":\"poisson\",\"why\""), std::string::npos)
      << "a ratio that nobody chose is listed";
  EXPECT_TRUE(warnings.empty()) << "and not warned of";
}

TEST(Idle, EntryOfAMaterialThatTheModelLacks_IsListedAndWarnedOf) {
  EXPECT_NE(plan({0.3, -1, "vendor_viscosity"}).find("vendor_viscosity"), std::string::npos);
  ASSERT_EQ(warnings.size(), 1u);
  for (const char *word : {"lone", "vendor_viscosity", "org.deform.msm"})
    EXPECT_NE(warnings[0].find(word), std::string::npos) << warnings[0];
  EXPECT_EQ(plan({0.3, -1, "friction"}).find("\"idle\":[]"), 0u) << "friction is the pairs' to use";
}

TEST(Idle, EntryThatNoModelKnows_NamesTheNearest) {
  plan({0.3, -1, "youngs"});
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_NE(warnings[0].find("its material gives it"), std::string::npos) << warnings[0];
  EXPECT_NE(warnings[0].find("did you mean 'young'?"), std::string::npos) << warnings[0];
  plan({0.3, -1, "locking"});  // of another model
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_EQ(warnings[0].find("did you mean"), std::string::npos) << warnings[0];
}

// A meter of it weighs 9810 Pa, which half the modulus has to bear.
TEST(Idle, BodyThatItsOwnWeightPressesFlat_IsWarnedOf) {
  plan({0.3, -1, nullptr, 19000});
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_NE(warnings[0].find("its own weight"), std::string::npos) << warnings[0];
  plan({0.3, -1, nullptr, 20000});
  EXPECT_TRUE(warnings.empty()) << warnings[0];
}

TEST(Idle, AutoInAScene_IsTheDefaultAndTheCommandShowsWhatDoesNothing) {
  const std::string folder = test::scratch("idle_" + std::to_string(getpid())), path = folder + "/scene.json";
  ASSERT_EQ(test::deform({"mesh", "make", "beam", "--cells", "60", "--out", folder + "/block.msh", "--quiet"})
                .exit_code,
            0);
  const auto hash = [&](const std::string &params) {
    test::write_file(path,
                     R"({"format": "deform-scene", "version": 1, "time": {"duration": 0.05, "step": 0.001},
      "gravity": [0, 0, -9.81],
      "materials": {"gel": {"density": 1000, "young": 1e4, "poisson": 0.4}},
      "bodies": [{"name": "lone", "mesh": "block.msh", "material": "gel",
      "fix": [{"box": [[-1, -1, -1], [0.001, 1, 1]]}], "model": {"type": "msm", "params": )" +
                         params + "}}]}");
    const test::CommandResult run = test::deform({"run", path, "--quiet", "--out", folder + "/out"});
    EXPECT_EQ(run.exit_code, 0) << run.err;
    const std::string text = test::read_file(folder + "/out/summary.json");
    return text.substr(text.find("state_hash"), 40);
  };
  const std::string by_default = hash("{}");
  EXPECT_EQ(hash(R"({"volume": "auto"})"), by_default);
  EXPECT_EQ(hash(R"({"volume": -1})"), by_default);
  EXPECT_NE(hash(R"({"volume": 0})"), by_default);
  hash(R"({"volume": 0})");
  const test::CommandResult saved =
      test::deform({"run", path, "--out", folder + "/out", "--save-scene", folder + "/saved.json"});
  const size_t reported = saved.err.find("poisson has no effect");
  ASSERT_NE(reported, std::string::npos) << saved.err;
  EXPECT_EQ(saved.err.find("poisson has no effect", reported + 1), std::string::npos)
      << "the saved scene is loaded to check it, and warns of the same: " << saved.err;
  const test::CommandResult explain = test::deform({"explain", path});
  EXPECT_NE(explain.out.find("poisson does not do what its name says"), std::string::npos) << explain.out;
  const test::CommandResult info = test::deform({"plugin", "info", "msm"});
  EXPECT_NE(info.out.find("auto (-1)"), std::string::npos) << info.out;
}
