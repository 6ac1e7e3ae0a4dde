// The list of effects selects: what is not in it leaves the same bits as a world that never had it.
#include <gtest/gtest.h>

#include <functional>
#include <string>
#include <vector>

#include "world.h"

namespace {

using List = std::vector<const char *>;

struct Logged {
  dfm_context *context = nullptr;
  std::string log;
  Logged() {
    dfm_context_def def = dfm_context_def_default();
    def.plugin_dir = DEFORM_PLUGIN_DIR;
    def.user = this;
    def.log = [](void *user, int32_t, const char *text) { static_cast<Logged *>(user)->log += text; };
    test::ok(dfm_context_create(&def, &context));
  }
  ~Logged() { dfm_context_destroy(context); }
  Logged(const Logged &) = delete;
  Logged &operator=(const Logged &) = delete;
};

struct Law {
  const char *name = "coulomb";
  std::vector<dfm_param_value> params;
};

// A soft block that slides on a floor, with all that parameters can call for.
struct Options {
  List effects;  // empty: auto
  double volume = 1, damping = 2e-4;
  uint32_t flags = 0, self = DFM_SELF_ON;
  Law law;
};

const double kLow = 0.2, kHigh = 0.5, kDrag = 300, kStiff = 1e7, kNone = 0;
const Law kAll = {"coulomb", {{"mu_C", &kLow, 1}, {"mu_S", &kHigh, 1}, {"sigma2", &kDrag, 1}}};

dfm_status make(dfm_context *c, const Options &o, dfm_world *w, dfm_body *body = nullptr) {
  dfm_world_def def = dfm_world_def_default();
  List list = o.effects;
  list.push_back(nullptr);
  if (!o.effects.empty()) def.effects = list.data();
  def.flags = o.flags;
  def.self_contact = o.self;
  def.gravity[0] = 4;
  if (const dfm_status status = dfm_world_create(c, &def, w)) return status;
  dfm_obstacle_def floor = dfm_obstacle_def_default();
  floor.name = "floor";
  floor.shape = DFM_SHAPE_PLANE;
  dfm_obstacle obstacle = 0;
  test::ok(dfm_obstacle_create(*w, &floor, &obstacle));
  dfm_friction_def rule{};
  rule.size = sizeof rule;
  rule.between[0] = rule.between[1] = "*";
  rule.law = o.law.name;
  rule.params = {sizeof(dfm_params), uint32_t(o.law.params.size()), o.law.params.data()};
  test::ok(dfm_world_add_friction(*w, &rule));
  test::BodyOptions b;
  b.name = "block";
  b.volume = o.volume;
  b.damping_stiffness = o.damping;
  b.position = {0, 0, 0.052};
  const dfm_body made = test::make_body(c, *w, "beam", {0.1, 0.1, 0.1}, 60, b);
  if (body) *body = made;
  double step = 0;
  return dfm_world_stable_step(*w, &step, nullptr, nullptr);  // makes the plan
}

uint64_t result(const Options &o) {
  test::Context c;
  dfm_world w = 0;
  test::ok(make(c, o, &w));
  for (int i = 0; i < 150; ++i) test::ok(dfm_world_step(w, 1e-3, nullptr));
  return dfm_world_hash(w);
}

std::string plan(dfm_world w) { return test::written(dfm_world_explain, w); }

const List kEvery = {"friction", "stiction", "stribeck", "viscous",
                     "volume",   "damping",  "guard",    "self_contact"};

List without(const std::string &effect) {
  List out;
  for (const char *e : kEvery)
    if (e != effect) out.push_back(e);
  return out;
}

Options everything() {
  Options o;
  o.law = kAll;
  return o;
}

}  // namespace

TEST(Effects, ThatAreAllListed_GiveTheBitsOfAuto) {
  Options listed = everything();
  listed.effects = kEvery;
  EXPECT_EQ(result(everything()), result(listed));
}

// Off by the list, and never there: the same bits; with it: others.
TEST(Effects, ThatAreNotListed_LeaveTheBitsOfAWorldWithoutThem) {
  const Law flat = {"coulomb", {{"mu_C", &kLow, 1}, {"mu_S", &kLow, 1}, {"sigma2", &kDrag, 1}}};
  const Law dry = {"coulomb", {{"mu_C", &kLow, 1}, {"mu_S", &kHigh, 1}}};
  const struct {
    const char *effect;
    std::function<void(Options &)> never;
  } cases[] = {{"volume", [](Options &o) { o.volume = 0; }},
               {"damping", [](Options &o) { o.damping = 0; }},
               {"stribeck", [&](Options &o) { o.law = flat; }},
               {"viscous", [&](Options &o) { o.law = dry; }}};
  const uint64_t all = result(everything());
  for (const auto &c : cases) {
    Options off = everything(), never = everything();
    off.effects = without(c.effect);
    c.never(never);
    EXPECT_EQ(result(off), result(never)) << c.effect;
    EXPECT_NE(result(off), all) << c.effect;
  }
}

TEST(Effects, WithoutFriction_AreThoseOfTheLawNone) {
  Options off = everything(), never = everything();
  off.effects = {"volume", "damping", "guard", "self_contact"};
  never.law = {"none", {}};
  EXPECT_EQ(result(off), result(never));
  EXPECT_NE(result(off), result(everything()));
}

TEST(Effects, OfTheHost_AreOutWhereTheyAreNotListed) {
  const struct {
    const char *effect, *stage;
  } cases[] = {{"guard", "guard"}, {"self_contact", "self contact"}};
  for (const auto &c : cases) {
    test::Context context;
    Options off = everything();
    off.effects = without(c.effect);
    dfm_world w = 0;
    test::ok(make(context, off, &w));
    const std::string text = plan(w), absent = text.substr(text.find("\"absent\":"));
    EXPECT_NE(absent.find(std::string("{\"name\":\"") + c.stage), std::string::npos) << text;
    EXPECT_NE(text.find(std::string("{\"name\":\"") + c.effect + "\",\"of\":\"contact\""), std::string::npos)
        << text;
  }
}

// A law with memory gives way to the cheapest that has all else; one that is asked for by what no other has
// stays.
TEST(Effects, WithoutMemory_TakeAnotherLaw) {
  const Law lugre = {"lugre", {{"mu_C", &kLow, 1}, {"mu_S", &kHigh, 1}, {"sigma0", &kStiff, 1}}};
  Options off = everything(), never = everything();
  off.law = lugre;
  off.effects = {"friction", "stribeck", "volume", "damping", "guard", "self_contact"};
  never.law = {"coulomb", {{"mu_C", &kLow, 1}, {"mu_S", &kHigh, 1}}};
  EXPECT_EQ(result(off), result(never));
  Logged c;
  dfm_world w = 0;
  test::ok(make(c.context, off, &w));
  EXPECT_NE(plan(w).find(R"("name":"org.deform.coulomb","asked":"org.deform.lugre")"), std::string::npos)
      << plan(w);
  EXPECT_NE(c.log.find("friction law org.deform.lugre: the list of effects does not contain memory"),
            std::string::npos)
      << c.log;
  off.effects = {"presliding", "volume"};
  test::ok(make(c.context, off, &w));
  EXPECT_NE(plan(w).find(R"("name":"org.deform.lugre","asked":"org.deform.lugre")"), std::string::npos)
      << plan(w);
}

TEST(Effects, WithoutStiction_TakeTheCheapestLawThatSlides) {
  Options off = everything();
  off.law = {"karnopp", {{"mu_C", &kLow, 1}, {"mu_S", &kHigh, 1}}};
  off.effects = {"friction", "volume", "damping", "guard", "self_contact"};
  Options never = everything();
  never.law = {"coulomb", {{"mu_C", &kLow, 1}, {"mu_S", &kLow, 1}}};
  EXPECT_EQ(result(off), result(never));
}

TEST(Effects, ThatParametersDoNotCallFor_AreNotListedByAuto) {
  test::Context c;
  Options o;
  o.volume = 0;
  o.self = DFM_SELF_OFF;
  dfm_world w = 0;
  test::ok(make(c, o, &w));
  const std::string text = plan(w), effects = text.substr(0, text.find("\"left_out\""));
  for (const char *there : {"friction", "stiction", "damping", "guard"})
    EXPECT_NE(effects.find(std::string("\"name\":\"") + there), std::string::npos)
        << there << ": " << effects;
  for (const char *not_there : {"stribeck", "viscous", "volume", "memory", "self_contact"})
    EXPECT_EQ(effects.find(std::string("\"name\":\"") + not_there), std::string::npos)
        << not_there << ": " << effects;
}

TEST(Effects, WithoutAProvider_AreRefusedWithPossibleProviders) {
  test::Context c;
  dfm_world w = 0;
  Options o = everything();
  o.effects = {"memory"};
  EXPECT_EQ(make(c, o, &w), DFM_E_ARG);
  test::says({"'memory'", "org.deform.lugre", "org.deform.gms"});
  o.law = {"coulomb", {}};
  o.effects = {"viscous"};
  EXPECT_EQ(make(c, o, &w), DFM_E_ARG);
  test::says({"'viscous'", "org.deform.coulomb", "parameters"});
  o.effects = {"guard"};
  o.flags = DFM_WORLD_UNGUARDED;
  EXPECT_EQ(make(c, o, &w), DFM_E_ARG);
  test::says({"'guard'", "contact.guard"});
}

// Before anything is said about what the list leaves out.
TEST(Effects, ThatNoPluginKnows_AreRefusedWithTheNearest) {
  Logged c;
  dfm_world w = 0;
  Options o = everything();
  o.effects = {"frictoin", "volume"};
  EXPECT_EQ(make(c.context, o, &w), DFM_E_ARG);
  test::says({"'frictoin'", "did you mean 'friction'", "provided:", "stribeck"});
  EXPECT_EQ(c.log, "");
}

// What parameters would have called for is told as bodies and laws come, and in the plan.
TEST(Effects, ThatAreLeftOut_AreReported) {
  Logged c;
  dfm_world w = 0;
  dfm_body b = 0;
  Options o = everything();
  o.effects = {"damping", "friction"};
  test::ok(make(c.context, o, &w, &b));
  for (const char *part :
       {"body 'block': the list of effects does not contain volume, which the scene needs: volume 1",
        "friction law org.deform.coulomb: the list of effects does not contain viscous, which "
        "the scene needs: sigma2 300",
        "does not contain guard", "does not contain self_contact"})
    EXPECT_NE(c.log.find(part), std::string::npos) << part << "\n" << c.log;
  EXPECT_NE(plan(w).find(R"({"name":"volume","of":"body 'block'","by":"volume 1"})"), std::string::npos)
      << plan(w);
}

// A parameter that changes later does not bring an effect back that the list does not have; its value is
// remembered.
TEST(Effects, ThatAreLeftOut_StayOutWhenParametersChange) {
  test::Context c;
  dfm_world w = 0;
  dfm_body b = 0;
  Options o = everything();
  o.volume = 0;
  o.effects = {"damping", "friction"};
  test::ok(make(c, o, &w, &b));
  const double half = 0.5, more = 0.7;
  const dfm_param_value volume{"volume", &half, 1}, drag{"mu_C", &more, 1}, top{"mu_S", &more, 1};
  const dfm_params params{sizeof params, 1, &volume};
  test::ok(dfm_body_set_params(b, &params));
  EXPECT_NE(plan(w).find(R"({"name":"volume","of":"body 'block'","by":"volume 0.5"})"), std::string::npos)
      << plan(w);
  const dfm_param_value law[] = {drag, top};
  const dfm_params friction{sizeof friction, 2, law};
  test::ok(dfm_world_set_friction(w, "*", "*", &friction));
  EXPECT_NE(plan(w).find(R"("name":"viscous","of":"friction law org.deform.coulomb","by":"sigma2 300")"),
            std::string::npos)
      << plan(w);
}

TEST(Effects, ThatAreLeftOut_LetParametersChangeAfterARestore) {
  test::Context c;
  dfm_world w = 0;
  dfm_body body = 0;
  Options o;
  o.effects = {"friction", "guard"};
  test::ok(make(c, o, &w, &body));
  const std::string start = test::snapshot(w);
  const auto go_back = [&] { test::ok(dfm_world_restore(w, start.data(), start.size())); };
  const auto set_young = [&](double young) {
    const dfm_param_value value = {"young", &young, 1};
    const dfm_params params = {sizeof params, 1, &value};
    test::ok(dfm_body_set_params(body, &params));
  };
  const auto hash_after = [&] {
    test::run(w, 0.02, 1e-3);
    return dfm_world_hash(w);
  };
  set_young(3e5);
  const uint64_t changed = hash_after();
  go_back();
  set_young(2e5);
  go_back();
  set_young(3e5);
  EXPECT_EQ(hash_after(), changed);
  dfm_world_destroy(w);
}
