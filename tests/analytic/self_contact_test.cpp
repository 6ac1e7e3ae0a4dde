// A surface that touches itself: what it keeps, what it carries, and what it costs those who do
// not ask for it.
#include <algorithm>
#include <set>

#include "coupled.h"
#include "hook.h"

namespace {

using test::State;

// How far the upper leg's tip is above the lower one's, less what their halves take of it: 0 where they lie
// on each other.
double tip_gap(dfm_body b) {
  const test::Hook hook(0.01);
  const State s = State(b);
  double sum[4] = {}, n[4] = {};
  for (size_t i = 0; i < s.x.size(); i += 3) {
    const size_t level = size_t(std::lround(hook.points[i + 2] / 0.01));
    if (hook.points[i] / 0.01 - 0.23 * double(level) > 5.5) {
      sum[level] += s.x[i + 2];
      ++n[level];
    }
  }
  return sum[2] / n[2] - sum[1] / n[1];
}

std::vector<dfm_contact> contacts(dfm_world w) {
  uint32_t n = 0;
  test::ok(dfm_world_contacts(w, 0, nullptr, &n));
  std::vector<dfm_contact> list(n);
  if (n) test::ok(dfm_world_contacts(w, n, list.data(), &n));
  return list;
}

struct Momenta { double linear[3], angular[3]; };
Momenta momenta(dfm_body b) {  // angular: about the origin
  const dfm_body_measure m = test::measure(b);
  Momenta out{};
  for (int k = 0; k < 3; ++k) {
    const int i = (k + 1) % 3, j = (k + 2) % 3;
    out.linear[k] = m.momentum[k];
    out.angular[k] = m.angular[k] + m.com[i] * m.momentum[j] - m.com[j] * m.momentum[i];
  }
  return out;
}

}  // namespace

// Without the guard: its contacts act on places that are apart at the start of the sub-step, so they keep
// angular momentum to that distance only.
TEST(SelfContact, LegsThrownTogether_KeepMomentumAndAngularMomentumToRounding) {
  const test::Context c;
  const dfm_world w = test::make_self_world(c, true, {0, 0, 0}, DFM_WORLD_UNGUARDED);
  test::set_friction(w, 0, "none");
  test::HookOptions o;
  o.young = 2e4;
  o.close = 1;
  o.velocity = {0.3, 0.2, -0.1};
  o.spin = {1, 2, 3};
  o.position = {0.1, 0, 0.2};
  const dfm_body b = test::make_hook(w, o);
  const Momenta before = momenta(b);
  uint32_t most = 0;
  for (int i = 0; i < 60; ++i) {
    test::run(w, 5e-4, 5e-4);
    most = std::max(most, test::stats(w).contacts);
  }
  EXPECT_GE(most, 3u) << "the legs must have met";
  const Momenta after = momenta(b);
  for (int k = 0; k < 3; ++k) {
    EXPECT_NEAR(after.linear[k], before.linear[k], 1e-14) << k;
    EXPECT_NEAR(after.angular[k], before.angular[k], 1e-15) << k;
  }
}

TEST(SelfContact, LegsThrownTogether_StayApartWhereItIsOnAndPassWhereItIsOff) {
  const test::Context c;
  for (const bool self : {true, false}) {
    const dfm_world w = test::make_self_world(c, self);
    test::HookOptions o;
    o.young = 2e4;
    o.damping_stiffness = 1e-3;
    o.close = 1.2;
    o.held = true;
    const dfm_body b = test::make_hook(w, o);
    double least = 1;
    for (int i = 0; i < 60; ++i) {
      test::run(w, 5e-4, 5e-4);
      least = std::min(least, tip_gap(b));
    }
    // The legs tilt as they meet, so their tips' middles pass each other by a little; through each other they
    // pass by more than their thickness.
    if (self) EXPECT_GT(least, -0.0025);
    else EXPECT_LT(least, -0.02);
  }
}

// Edges that end beside other edges come past them, not onto them.
TEST(SelfContact, PiecesThatPassEachOther_DoNotTouch) {
  const test::Context c;
  const dfm_world w = test::make_self_world(c);
  const double size[3] = {0.1, 0.06, 0.1};
  dfm_mesh_handle block = 0;
  test::ok(dfm_mesh_make(c, "beam", size, DFM_MESH_CELLS, 96, &block));
  const dfm_mesh_info info = test::info_of(block);
  std::vector<double> points(info.points, info.points + 3 * info.npoint), v(6 * info.npoint, 0.0);
  std::vector<uint32_t> tets(info.tets, info.tets + 4 * info.ntet);
  const double shift[3] = {-0.101, 0.02, 0.2};
  for (size_t i = 0; i < 3 * info.npoint; ++i) points.push_back(points[i] + shift[i % 3]);
  for (size_t i = 0; i < 4 * info.ntet; ++i) tets.push_back(tets[i] + info.npoint);
  for (size_t i = 3 * info.npoint + 2; i < v.size(); i += 3) v[i] = -1;
  dfm_body_def d = dfm_body_def_default();
  d.npoint = 2 * info.npoint;
  d.ntet = 2 * info.ntet;
  d.points = points.data();
  d.tets = tets.data();
  d.material = test::make_material(w, {});
  dfm_body b = 0;
  test::ok(dfm_body_create(w, &d, &b));
  test::ok(dfm_body_set_state(b, d.npoint, points.data(), v.data()));
  test::run(w, 0.3, 1e-3);
  EXPECT_EQ(test::stats(w).contacts_max, 0u);
  const State after = State(b);
  for (size_t i = 2; i < v.size(); i += 3) EXPECT_NEAR(after.v[i], v[i], 1e-9);
}

TEST(SelfContact, Report_NamesItselfOnBothSidesAndSumsToZero) {
  const test::Context c;
  const dfm_world w = test::make_self_world(c);
  test::set_friction(w, 0.4);
  test::HookOptions o;
  o.young = 2e4;
  o.damping_stiffness = 1e-3;
  o.close = 1;
  o.pinch = 0.03;
  const dfm_body b = test::make_hook(w, o);
  test::run(w, 0.04, 5e-4);
  const auto list = contacts(w);
  ASSERT_FALSE(list.empty());
  std::set<uint64_t> keys;
  double normal = 0;
  for (const dfm_contact &k : list) {
    EXPECT_EQ(k.body_a, b);
    EXPECT_EQ(k.body_b, b);
    EXPECT_GT(k.gap, -2e-5);
    keys.insert(k.key);
    normal += k.fn;
  }
  EXPECT_EQ(keys.size(), list.size());
  EXPECT_GT(normal, 0);
  dfm_pair_report pair{};
  uint32_t n = 0;
  pair.size = sizeof pair;
  test::ok(dfm_world_pairs(w, 1, &pair, &n));
  ASSERT_EQ(n, 1u);
  EXPECT_EQ(pair.a, b);
  EXPECT_EQ(pair.b, b);
  EXPECT_EQ(pair.count, list.size());
  EXPECT_DOUBLE_EQ(pair.normal, normal);
  EXPECT_LE(pair.friction_work, 0);
  const double origin[3] = {0, 0, 0};
  double force[3] = {1, 1, 1}, moment[3] = {1, 1, 1};
  test::ok(dfm_world_pair_wrench(w, b, b, origin, force, moment));
  for (int k = 0; k < 3; ++k) {
    EXPECT_EQ(pair.force[k], 0);
    EXPECT_EQ(pair.moment[k], 0);
    EXPECT_EQ(force[k], 0);
    EXPECT_EQ(moment[k], 0);
  }
  dfm_contact_event events[256];
  test::ok(dfm_world_events(w, 256, events, &n));
  ASSERT_GT(n, 0u);
  for (uint32_t i = 0; i < n; ++i) EXPECT_TRUE(events[i].a == b && events[i].b == b);
}

TEST(SelfContact, LegsPressedTogether_DoNotCreep) {
  const test::Context c;
  const dfm_world w = test::make_self_world(c);
  test::set_friction(w, 0.6);
  test::HookOptions o;
  o.young = 2e4;
  o.damping_stiffness = 2e-3;
  o.damping_mass = 60;
  o.pinch = 0.05;
  o.held = true;
  test::make_hook(w, o);
  test::run(w, 0.8, 1e-3);
  test::ok(dfm_world_hold_begin(w));
  test::run(w, 0.2, 1e-3);
  double creep = NAN;
  uint32_t held = 0;
  test::ok(dfm_world_hold(w, &creep, &held));
  EXPECT_GE(held, 3u);
  EXPECT_LT(creep, 1e-7) << "m/s";
}

TEST(SelfContact, RestShape_HasNoContactInAnyRigidMotion) {
  const test::Context c;
  struct {
    const char *kind;
    std::array<double, 3> size;
    uint32_t cells;
  } const shapes[] = {{"beam", {0.2, 0.04, 0.04}, 60},     {"beam", {0.2, 0.1, 0.004}, 600},
                      {"ball", {0.05, 0, 0}, 300},         {"ball", {0.05, 0, 0}, 3000},
                      {"cylinder", {0.02, 0.2, 0}, 400},   {"tube", {0.03, 0.045, 0.06}, 300},
                      {"tube", {0.043, 0.045, 0.06}, 1500}};
  for (const auto &s : shapes) {
    dfm_body bodies[2];
    for (const bool self : {false, true}) {
      const dfm_world w = test::make_self_world(c, self);
      test::BodyOptions o;
      o.young = 1e4;
      o.velocity = {3, 2, -5};
      o.spin = {4, 0, 9};
      bodies[self] = test::make_body(c, w, s.kind, s.size, s.cells, o);
      test::run(w, 0.01, 5e-4);
      EXPECT_EQ(test::stats(w).contacts_max, 0u) << s.kind << " " << s.cells;
    }
    const State off = State(bodies[0]), on = State(bodies[1]);
    EXPECT_EQ(off.x, on.x) << s.kind << ": what does not touch itself moves as if it could not";
    EXPECT_EQ(off.v, on.v) << s.kind;
  }
}

TEST(SelfContact, PlanHasItsStage_OnlyOnRequest) {
  const test::Context c;
  const dfm_world off = test::make_self_world(c, false), on = test::make_self_world(c, true);
  test::HookOptions o;
  for (const dfm_world w : {off, on}) test::make_hook(w, o);
  const auto runs = [](const std::string &text) {
    const size_t stages = text.find("\"stages\""), absent = text.find("\"absent\"");
    return text.substr(stages, absent - stages).find("self contact") != std::string::npos;
  };
  EXPECT_FALSE(runs(test::explain(off)));
  EXPECT_NE(test::explain(off).find("\"self contact\",\"why\":\"not asked for"), std::string::npos)
      << test::explain(off);
  EXPECT_TRUE(runs(test::explain(on)));
  EXPECT_NE(test::explain(on).find("\"name\":\"self_contact\",\"asked_by\":\"contact.self\""),
            std::string::npos)
      << test::explain(on);
  test::ok(dfm_world_filter_pair(off, "hook", "hook", true));
  EXPECT_TRUE(runs(test::explain(off))) << "a rule that names the body twice asks for it";
  test::ok(dfm_world_filter_pair(on, "hook", "hook", false));
  EXPECT_FALSE(runs(test::explain(on))) << "or takes it out";
  test::ok(dfm_world_filter_pair(off, "*", "*", false));
  EXPECT_TRUE(runs(test::explain(off))) << "what is said of pairs does not touch it";
}

TEST(SelfContact, EffectInTheList_TurnsItOn) {
  const test::Context c;
  const char *const effects[] = {"self_contact", nullptr};
  dfm_world_def d = dfm_world_def_default();
  d.effects = effects;
  dfm_world w = 0;
  DFM_OK_OR_DIE(dfm_world_create(c, &d, &w));
  test::make_hook(w, {});
  EXPECT_NE(
      test::explain(w).find("\"name\":\"self_contact\",\"asked_by\":\"effects\",\"provided_by\":\"contact\""),
      std::string::npos)
      << test::explain(w);
  d.effects = nullptr;
  d.self_contact = 3;
  EXPECT_EQ(dfm_world_create(c, &d, &w), DFM_E_ARG);
  EXPECT_NE(std::string(dfm_last_error()).find("self_contact is 3"), std::string::npos);
}

TEST(SelfContact, FrictionOfABodyWithItself_FollowsThePairRules) {
  const test::Context c;
  for (const bool rough : {false, true}) {
    const dfm_world w = test::make_self_world(c);
    test::set_friction(w, 0, "none");
    test::HookOptions o;
    o.young = 2e4;
    o.damping_stiffness = 1e-3;
    o.pinch = 0.03;
    o.close = 0.5;
    test::make_hook(w, o);
    if (rough) test::ok(test::add_friction(w, "coulomb", {{"mu", 0.7}}, "hook", "hook"));
    test::run(w, 0.05, 5e-4);
    double friction = 0;
    for (const dfm_contact &k : contacts(w)) friction += std::hypot(k.ft[0], k.ft[1]);
    if (rough) EXPECT_GT(friction, 1e-4);
    else EXPECT_EQ(friction, 0);
  }
}

// Surfels of both sides hang on phyxels of one body, some on the same ones: what the rows merge must still
// answer exactly.
TEST(SelfContact, SurfaceOfItsOwn_KeepsMomentum) {
  const test::Context c;
  const dfm_world w = test::make_self_world(c);
  test::set_friction(w, 0.5);
  const dfm_world draft = test::make_self_world(c, false);
  const test::Skin coarse = test::boundary_skin(test::make_hook(draft, {}));
  test::detail::Weld fine;
  for (size_t t = 0; t < coarse.triangles.size(); t += 3) {
    test::detail::Point p[3], m[3];
    for (size_t k = 0; k < 3; ++k) std::copy_n(&coarse.points[3 * coarse.triangles[t + k]], 3, p[k].begin());
    for (size_t k = 0; k < 3; ++k)
      for (size_t i = 0; i < 3; ++i) m[k][i] = 0.5 * (p[k][i] + p[(k + 1) % 3][i]);
    fine.triangle(m[0], m[1], m[2]);
    for (size_t k = 0; k < 3; ++k) fine.triangle(p[k], m[k], m[(k + 2) % 3]);
  }
  const dfm_surface_def surface = fine.skin.def();
  test::HookOptions o;
  o.young = 2e4;
  o.close = 1;
  o.surface = &surface;
  const dfm_body b = test::make_hook(w, o);
  const Momenta before = momenta(b);
  test::run(w, 0.03, 5e-4);
  EXPECT_GT(test::stats(w).contacts_max, 3u);
  const Momenta after = momenta(b);
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(after.linear[k], before.linear[k], 1e-14) << k;
}
