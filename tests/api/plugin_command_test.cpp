// deform plugin list | info | check as a user calls it.
#include <gtest/gtest.h>

#include <cstdio>
#include <filesystem>

#include "support.h"

namespace {

bool has(const std::string &text, const std::string &part) { return text.find(part) != std::string::npos; }

TEST(PluginCommand, List_ShowsTypesWithKindAndFile) {
  const auto r = test::deform({"plugin", "list"});
  EXPECT_EQ(r.exit_code, 0) << r.err;
  EXPECT_TRUE(has(r.out, "org.deform.coulomb") && has(r.out, "org.deform.none") && has(r.out, "law"))
      << r.out;
  EXPECT_TRUE(has(r.out, "stiction stribeck viscous") && has(r.out, "friction_coulomb.so")) << r.out;
}

TEST(PluginCommand, ListOfAFolder_GivesAReasonForWhatIsNoPlugin) {
  const std::string dir = test::scratch("plugin_command");
  test::write_file(dir + "/broken.so", "no library");
  for (const char *json : {"", "--json"}) {
    std::vector<std::string> args{"plugin", "list", "--dir", dir};
    if (*json) args.push_back(json);
    const auto r = test::deform(args);
    EXPECT_EQ(r.exit_code, 0) << r.err;
    EXPECT_TRUE(has(r.out, "broken.so") && has(r.out, "not a shared library")) << r.out;
  }
  const auto missing = test::deform({"plugin", "list", "--dir", "/nowhere/at/all"});
  EXPECT_EQ(missing.exit_code, 2);
  EXPECT_TRUE(has(missing.err, "/nowhere/at/all")) << missing.err;
}

TEST(PluginCommand, ListAsJson_IsOneObject) {
  const auto r = test::deform({"plugin", "list", "--json"});
  EXPECT_EQ(r.exit_code, 0) << r.err;
  EXPECT_TRUE(has(r.out, "\"types\": [") && has(r.out, "\"id\": \"org.deform.coulomb\"") &&
              has(r.out, "\"passed\": ["))
      << r.out;
}

// A plugin that is made by the guide lies in a folder of its name.
TEST(PluginCommand, CheckByName_PassesOverAFolderOfThatName) {
  const std::string dir = test::scratch("check_by_name");
  std::filesystem::create_directories(dir + "/coulomb");
  const auto r =
      test::run({"/usr/bin/env", "-C", dir, DEFORM_COMMAND, "plugin", "check", "coulomb", "--only", "V03"});
  EXPECT_EQ(r.exit_code, 0) << r.err;
}

TEST(PluginCommand, Info_ShowsTheParameterTable) {
  for (const char *id : {"coulomb", "org.deform.coulomb"}) {
    const auto r = test::deform({"plugin", "info", id});
    EXPECT_EQ(r.exit_code, 0) << r.err;
    for (const char *part :
         {"mu_C", "mu_S", "v_s", "delta", "sigma2", "N s/m^3", "stribeck", "Zerbato", "MIT"})
      EXPECT_TRUE(has(r.out, part)) << part;
  }
  const auto json = test::deform({"plugin", "info", "coulomb", "--json"});
  EXPECT_EQ(json.exit_code, 0) << json.err;
  EXPECT_TRUE(has(json.out, "\"key\": \"v_s\"") && has(json.out, "\"default\": 0.01") &&
              has(json.out, "\"unit\": \"m/s\""))
      << json.out;
}

TEST(PluginCommand, InfoOfAModel_ListsItsCapabilities) {
  const auto r = test::deform({"plugin", "info", "msm"});
  EXPECT_EQ(r.exit_code, 0) << r.err;
  EXPECT_TRUE(has(r.out, "can      energy damping rotation_invariant plausible")) << r.out;
  const auto json = test::deform({"plugin", "info", "msm", "--json"});
  EXPECT_TRUE(has(json.out, "\"capabilities\": [")) << json.out;
  EXPECT_TRUE(has(json.out, "\"rotation_invariant\"")) << json.out;
  EXPECT_FALSE(has(test::deform({"plugin", "info", "coulomb", "--json"}).out, "capabilities"));
}

TEST(PluginCommand, SolverOfAFile_IsShownAndChecked) {
  const std::string file = std::string(DEFORM_BINARY_DIR) + "/lib/tiny/tiny_solver.so";
  const auto r = test::deform({"plugin", "info", file});
  EXPECT_EQ(r.exit_code, 0) << r.err;
  EXPECT_TRUE(has(r.out, "solver org.tiny.cholesky") && has(r.out, "can      direct")) << r.out;
  const auto checked = test::deform({"plugin", "check", file});
  EXPECT_EQ(checked.exit_code, 0) << checked.out;
  EXPECT_TRUE(has(checked.out, "rules for solvers are not available yet")) << checked.out;
}

TEST(PluginCommand, InfoOfAFile_LoadsIt) {
  const auto r = test::deform({"plugin", "info", std::string(DEFORM_PLUGIN_DIR) + "/friction_none.so"});
  EXPECT_EQ(r.exit_code, 0) << r.err;
  EXPECT_TRUE(has(r.out, "org.deform.none")) << r.out;
  const auto same = test::deform({"plugin", "info", std::string(DEFORM_PLUGIN_DIR) + "/./friction_none.so"});
  EXPECT_EQ(same.out, r.out) << same.err;
}

TEST(PluginCommand, UnknownId_ExitsTwoAndListsWhatThereIs) {
  const auto r = test::deform({"plugin", "info", "coulob"});
  EXPECT_EQ(r.exit_code, 2);
  EXPECT_TRUE(has(r.err, "coulob") && has(r.err, "did you mean \"coulomb\"") && has(r.err, "org.deform.none"))
      << r.err;
  EXPECT_EQ(test::deform({"plugin", "info", "/nowhere/x.so"}).exit_code, 2);
  EXPECT_EQ(test::deform({"plugin", "info"}).exit_code, 2);
  EXPECT_EQ(test::deform({"plugin"}).exit_code, 2);
}

// Of a check of this plugin, rules that it skips included.
int rule_count(const char *name) {
  const std::string file = std::string(DEFORM_PLUGIN_DIR) + "/" + name + ".so";
  const std::string out = test::deform({"plugin", "check", file}).out;
  const size_t last = out.rfind('\n', out.size() - 2) + 1;
  int passed = 0, failed = 0, skipped = 0;
  EXPECT_EQ(std::sscanf(out.c_str() + last, "%d passed, %d failed, %d skipped", &passed, &failed, &skipped),
            3)
      << out;
  return passed + failed + skipped;
}

TEST(PluginCommand, CheckHasAsManyRules_AsTheReadmeSays) {
  const std::string readme = test::read_file(std::string(DEFORM_SOURCE_DIR) + "/README.md");
  const std::string laws = std::to_string(rule_count("friction_none"));
  const std::string models = std::to_string(rule_count("model_shape_matching"));
  EXPECT_TRUE(has(readme, "applies " + laws + " rules to laws and " + models + " to models"))
      << laws << models;
}

}  // namespace
