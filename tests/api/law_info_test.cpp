// The number of a law in reports, resolved: its name, its description, its parameters with their values.
#include <cstring>

#include "stack.h"

namespace {

dfm_law_info info_of(dfm_world w, uint32_t law) {
  dfm_law_info info{};
  info.size = sizeof info;
  EXPECT_EQ(dfm_world_law_info(w, law, &info), DFM_OK) << dfm_last_error();
  return info;
}

// Values of a parameter, empty where the law has no such key.
std::vector<double> value(const dfm_law_info &info, const char *key) {
  for (uint32_t i = 0; i < info.params.n; ++i) {
    const dfm_param_value &row = info.params.values[i];
    if (std::strcmp(row.key, key) == 0) return {row.value, row.value + row.width};
  }
  return {};
}

void add_rule(dfm_world w, const char *a, const char *b, const char *law, const dfm_params &params) {
  dfm_friction_def def{};
  def.size = sizeof def;
  def.between[0] = a;
  def.between[1] = b;
  def.law = law;
  def.params = params;
  ASSERT_EQ(dfm_world_add_friction(w, &def), DFM_OK) << dfm_last_error();
}

uint32_t law_between(dfm_world w, uint64_t a, uint64_t b) {
  for (const dfm_pair_report &p : test::pairs(w))
    if (p.a == a && p.b == b) return p.law;
  ADD_FAILURE() << "the pair does not touch";
  return UINT32_MAX;
}

}  // namespace

TEST(LawInfo, OfTheLawsOfAStack_HasTheirNamesAndValues) {
  test::Context c;
  const test::Stack s = test::make_stack(c, 0, 0.5);
  const double mu = 0.3, stiffness = 2e8;
  const dfm_param_value rows[] = {{"mu_C", &mu, 1}, {"sigma0", &stiffness, 1}};
  add_rule(s.world, "upper", "lower", "dahl", {sizeof(dfm_params), 2, rows});
  test::run(s.world, 10e-3, 1e-3);

  const dfm_law_info floor = info_of(s.world, law_between(s.world, s.lower, s.floor));
  EXPECT_STREQ(floor.id, "org.deform.coulomb");
  EXPECT_EQ(value(floor, "mu_C"), std::vector<double>{0.5});
  EXPECT_EQ(value(floor, "mu_S"), std::vector<double>{0.5});
  EXPECT_TRUE(value(floor, "sigma0").empty());

  const dfm_law_info pair = info_of(s.world, law_between(s.world, s.lower, s.upper));
  EXPECT_STREQ(pair.id, "org.deform.dahl");
  EXPECT_STREQ(pair.name, pair.type->name);
  EXPECT_EQ(value(pair, "mu_C"), std::vector<double>{0.3});
  EXPECT_EQ(value(pair, "sigma0"), std::vector<double>{2e8});
  ASSERT_EQ(pair.params.n, pair.type->nparam);
  for (uint32_t i = 0; i < pair.params.n; ++i) {
    EXPECT_STREQ(pair.params.values[i].key, pair.type->params[i].key);
    EXPECT_EQ(pair.params.values[i].width, pair.type->params[i].width);
  }
  for (const dfm_contact &contact : test::contacts(s.world)) {
    const bool on_floor = contact.kind == DFM_CONTACT_PRIMITIVE;
    EXPECT_STREQ(info_of(s.world, contact.law).id, on_floor ? floor.id : pair.id);
  }
}

TEST(LawInfo, OfAPairWithoutARule_IsTheDefaultLaw) {
  test::Context c;
  const dfm_world w = test::make_world(c);
  test::add_plane(w, "floor");
  test::BodyOptions o;
  o.name = "block";
  o.position = {0, 0, 1e-4};
  test::make_body(c, w, "beam", {0.1, 0.1, 0.1}, 40, o);
  test::run(w, 10e-3, 1e-3);
  const auto pairs = test::pairs(w);
  ASSERT_EQ(pairs.size(), 1u);
  const dfm_law_info info = info_of(w, pairs[0].law);
  EXPECT_STREQ(info.id, "org.deform.coulomb");
  EXPECT_EQ(value(info, "mu_C"), std::vector<double>{0.5});
}

// A law made from the values that were read gives the same bits.
TEST(LawInfo, ParamsGivenBack_MakeTheSameRule) {
  for (const char *const law : {"coulomb", "karnopp", "dahl", "lugre", "elastoplastic", "gms", "none"}) {
    SCOPED_TRACE(law);
    test::Context c;
    const double four[] = {4e8, 3e8, 2e8, 1e8};
    const double shares[] = {0.1, 0.2, 0.3, 0.4};
    const dfm_param_value lists[] = {{"k", four, 4}, {"nu", shares, 4}};
    const uint32_t n = std::strcmp(law, "gms") == 0 ? 2 : 0;
    test::Stack twice[2];
    for (int i = 0; i < 2; ++i) {
      twice[i] = test::make_stack(c, 0);
      add_rule(twice[i].world, "upper", "lower", law, {sizeof(dfm_params), n, lists});
      test::run(twice[i].world, 10e-3, 1e-3);
      if (i == 0) continue;
      const dfm_law_info info =
          info_of(twice[i].world, law_between(twice[i].world, twice[i].lower, twice[i].upper));
      add_rule(twice[i].world, "upper", "lower", info.id, info.params);
    }
    for (const test::Stack &s : twice) test::run(s.world, 5e-3, 1e-3);
    EXPECT_EQ(dfm_world_hash(twice[0].world), dfm_world_hash(twice[1].world));
  }
}

TEST(LawInfo, AfterTheRuleWasReplaced_HasTheNewValue) {
  test::Context c;
  const test::Stack s = test::make_stack(c, 0);
  for (const double mu : {0.2, 0.7}) {
    test::set_friction(s.world, mu);
    test::run(s.world, 5e-3, 1e-3);
    EXPECT_EQ(value(info_of(s.world, law_between(s.world, s.lower, s.floor)), "mu_C"),
              std::vector<double>{mu});
  }
}

TEST(LawInfo, OfANumberThatIsNoLaw_IsRefused) {
  test::Context c;
  const test::Stack s = test::make_stack(c, 0);
  test::run(s.world, 5e-3, 1e-3);
  dfm_law_info info{};
  info.size = sizeof info;
  EXPECT_EQ(dfm_world_law_info(s.world, 4711, &info), DFM_E_ARG);
  test::says({"law 4711", "dfm_contact"});
  EXPECT_EQ(info.id, nullptr);
  EXPECT_EQ(dfm_world_law_info(s.lower, 0, &info), DFM_E_HANDLE);
  EXPECT_EQ(dfm_world_law_info(s.world, 0, nullptr), DFM_E_ARG);
  // A caller whose struct ends before params.
  info = {};
  info.size = offsetof(dfm_law_info, params);
  test::ok(dfm_world_law_info(s.world, 0, &info));
  EXPECT_STREQ(info.id, "org.deform.coulomb");
  EXPECT_EQ(info.params.values, nullptr);
  EXPECT_EQ(info.size, offsetof(dfm_law_info, params));
}
