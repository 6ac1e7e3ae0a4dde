// Parameters by key over the table of the type.
#include <initializer_list>

#include "tiny_support.h"

using tiny::Context;

namespace {

struct Given {
  const char *key;
  std::vector<double> values;
};

struct Packed {
  dfm_status status;
  std::vector<double> values;
  std::string why;
};

Packed pack(dfm_law law, std::initializer_list<Given> given) {
  std::vector<dfm_param_value> list;
  for (const auto &g : given)
    list.push_back({g.key, g.values.data(), static_cast<uint32_t>(g.values.size())});
  const dfm_params params{sizeof params, static_cast<uint32_t>(list.size()), list.data()};
  Packed out{DFM_OK, std::vector<double>(64), ""};
  uint32_t n = 0;
  out.status = dfm_law_pack(law, &params, 64, out.values.data(), &n);
  if (out.status < 0) out.why = dfm_last_error();
  out.values.resize(n);
  return out;
}

bool has(const std::string &text, const std::string &part) { return text.find(part) != std::string::npos; }

struct Params : testing::Test {
  Context c;
  dfm_law law(const std::string &file, const std::string &name) {
    EXPECT_EQ(dfm_plugin_load(c.c, file.c_str()), DFM_OK) << dfm_last_error();
    return c.open(name);
  }
  dfm_law drag() { return law(tiny::plugin("tiny_law"), "drag"); }
  dfm_law coulomb() { return law(std::string(DEFORM_PLUGIN_DIR) + "/friction_coulomb.so", "coulomb"); }
};

TEST_F(Params, NothingGiven_IsTheDefaults) {
  const Packed p = pack(drag(), {});
  EXPECT_EQ(p.status, DFM_OK);
  EXPECT_EQ(p.values, (std::vector<double>{2, 0.25, 0.25, 0.25, 4}));
}

TEST_F(Params, Given_TakesTheRowsPlace) {
  EXPECT_EQ(pack(drag(), {{"steps", {7}}, {"axis", {0, 0, 1}}}).values, (std::vector<double>{2, 0, 0, 1, 7}));
}

TEST_F(Params, UnknownKey_NamesTheNearest) {
  const Packed p = pack(drag(), {{"axs", {0, 0, 1}}});
  EXPECT_EQ(p.status, DFM_E_ARG);
  EXPECT_EQ(p.why, "org.tiny.drag has no parameter \"axs\"; did you mean \"axis\"?; it has: c, axis, steps");
}

TEST_F(Params, WrongWidth_IsRefused) {
  const Packed p = pack(drag(), {{"axis", {1, 2}}});
  EXPECT_EQ(p.status, DFM_E_ARG);
  EXPECT_TRUE(has(p.why, "\"axis\" has 2 values, 3 expected")) << p.why;
}

TEST_F(Params, OutOfRangeOrNan_IsRefusedWithTheRange) {
  for (double bad : {-1.0, 2e6, std::nan(""), HUGE_VAL}) {
    const Packed p = pack(drag(), {{"c", {bad}}});
    EXPECT_EQ(p.status, DFM_E_ARG) << bad;
    EXPECT_TRUE(has(p.why, "\"c\" is") && has(p.why, "[0, 1e+06] N s/m")) << p.why;
  }
  EXPECT_EQ(pack(drag(), {{"axis", {0, 0, -1.5}}}).status, DFM_E_ARG);
}

TEST_F(Params, FractionForAWholeNumber_IsRefused) {
  const Packed p = pack(drag(), {{"steps", {2.5}}});
  EXPECT_EQ(p.status, DFM_E_ARG);
  EXPECT_TRUE(has(p.why, "a whole number in [1, 9]")) << p.why;
}

TEST_F(Params, FractionForAnEnumeration_ListsItsNames) {
  const Packed p = pack(law(tiny::plugin("tiny_nan"), "nan"), {{"value", {0.5}}});
  EXPECT_EQ(p.status, DFM_E_ARG);
  EXPECT_TRUE(has(p.why, "one of number, nan, infinity")) << p.why;
  EXPECT_EQ(pack(c.open("nan"), {{"value", {3}}}).status, DFM_E_ARG);
  EXPECT_EQ(pack(c.open("nan"), {{"value", {2}}}).status, DFM_OK);
}

TEST_F(Params, GivenTwice_IsRefused) {
  const Packed p = pack(drag(), {{"c", {1}}, {"c", {2}}});
  EXPECT_EQ(p.status, DFM_E_ARG);
  EXPECT_TRUE(has(p.why, "\"c\" is given twice")) << p.why;
}

TEST_F(Params, Mu_StandsForBothCoefficients) {
  const dfm_law law = coulomb();
  EXPECT_EQ(pack(law, {}).values, (std::vector<double>{0.5, 0.5, 0.01, 2, 0}));
  EXPECT_EQ(pack(law, {{"mu", {0.3}}}).values, (std::vector<double>{0.3, 0.3, 0.01, 2, 0}));
  EXPECT_EQ(pack(law, {{"mu_S", {0.4}}, {"mu", {0.3}}}).values, (std::vector<double>{0.3, 0.4, 0.01, 2, 0}))
      << "a row's own name wins";
  EXPECT_EQ(pack(drag(), {{"mu", {0.3}}}).status, DFM_E_ARG) << "a law without coefficients";
}

TEST_F(Params, StaticBelowKinetic_IsRefusedByTheLawsCheck) {
  const Packed p = pack(coulomb(), {{"mu_C", {0.6}}});
  EXPECT_EQ(p.status, DFM_E_ARG);
  EXPECT_TRUE(has(p.why, "mu_S (0.5) must not be below mu_C (0.6)")) << p.why;
  EXPECT_EQ(pack(coulomb(), {{"mu_C", {0.6}}, {"mu_S", {0.6}}}).status, DFM_OK);
}

TEST_F(Params, ThrowingCheck_IsARefusal) {
  const Packed p = pack(law(tiny::plugin("tiny_throw"), "checks"), {});
  EXPECT_EQ(p.status, DFM_E_ARG);
  EXPECT_TRUE(has(p.why, "threw")) << p.why;
}

TEST_F(Params, Counting_NeedsNoRoom) {
  const dfm_law law = drag();
  uint32_t n = 0;
  EXPECT_EQ(dfm_law_pack(law, nullptr, 0, nullptr, &n), DFM_OK);
  EXPECT_EQ(n, 5u);
  double few[2] = {-1, -1};
  EXPECT_EQ(dfm_law_pack(law, nullptr, 2, few, &n), DFM_E_ARG);
  EXPECT_EQ(few[0], -1);
}

TEST_F(Params, KeyOrValueMissing_IsRefused) {
  const dfm_law law = drag();
  const double one = 1;
  for (const dfm_param_value &value : {dfm_param_value{nullptr, &one, 1}, dfm_param_value{"c", nullptr, 1}}) {
    const dfm_params params{sizeof params, 1, &value};
    EXPECT_EQ(dfm_law_pack(law, &params, 0, nullptr, nullptr), DFM_E_ARG);
  }
}

}  // namespace
