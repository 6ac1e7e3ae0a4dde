// ODE's own rigid contacts with the library's friction laws.
#include <gtest/gtest.h>

#include "bristle_law.h"
#include "ode.h"

namespace {

using namespace test;

dfm_status use(Ode &ode, const char *law, std::vector<std::pair<const char *, double>> values) {
  std::vector<dfm_param_value> list;
  for (auto &[key, value] : values) list.push_back({key, &value, 1});
  const dfm_params params = {sizeof params, uint32_t(list.size()), list.data()};
  return dfm_ode_set_friction(ode.adapter, ode.context, law, &params, 1e-3);
}

// Path of a box that is thrown along a plane at 1 m/s.
double sliding_path(Ode &ode) {
  dCreatePlane(ode.space, 0, 0, 1, 0);
  const dBodyID box = ode.box({0.1, 0.1, 0.02}, 2, {0, 0, 0.02}, {1, 0, 0});
  ode.run(1.5);
  EXPECT_LT(norm(velocity(box)), 1e-3);
  return position(box)[0];
}

}  // namespace

TEST(OdeFriction, Coulomb_StopsASlidingBoxWhereItShould) {
  Ode ode;
  ok(use(ode, "coulomb", {{"mu", 0.2}}));
  EXPECT_NEAR(sliding_path(ode), 1 / (2 * 0.2 * 9.81), 0.01 / (2 * 0.2 * 9.81));
}

TEST(OdeFriction, NoLaw_IsTheCoefficientOfTheDef) {
  Ode ode;
  ok(use(ode, "coulomb", {{"mu", 0.2}}));
  ok(dfm_ode_set_friction(ode.adapter, ode.context, nullptr, nullptr, 1));
  EXPECT_NEAR(sliding_path(ode), 1 / (2 * 0.5 * 9.81), 0.01 / (2 * 0.5 * 9.81));
}

// Stribeck's curve: the path is the integral of v dv / (g mu(v)), mu = mu_C + (mu_S - mu_C)
// exp(-(v / v_s)^2).
TEST(OdeFriction, StribeckCurve_IsFollowedDownToRest) {
  Ode ode;
  ok(use(ode, "coulomb", {{"mu_C", 0.1}, {"mu_S", 0.4}, {"v_s", 0.3}}));
  double path = 0;
  for (int i = 0; i < 10000; ++i) {
    const double v = (i + 0.5) * 1e-4;
    path += 1e-4 * v / (9.81 * (0.1 + 0.3 * std::exp(-v * v / 0.09)));
  }
  EXPECT_NEAR(sliding_path(ode), path, 0.01 * path);
}

// A box that is set down while it slides loses mu times the impulse that stops its fall, and then what
// Coulomb and viscous friction take: dv/dt = -(mu g + r v).
TEST(OdeFriction, ViscousPart_DoesNotGrowWithTheImpulseOfTouchDown) {
  for (const char *law : {"coulomb", "karnopp"}) {
    Ode ode;
    ok(use(ode, law, {{"mu", 0.3}, {"sigma2", 500}}));
    dCreatePlane(ode.space, 0, 0, 1, 0);
    const dBodyID box = ode.box({0.4, 0.4, 0.02}, 2, {0, 0, 0.03}, {5, 0, 0});
    const double fall = std::sqrt(2 * 0.01 / 9.81), rate = 4 * 500 * 1e-3 / 2, at = 0.3 * 9.81 / rate;
    const double landed = 5 - 0.3 * 9.81 * fall, left = (landed + at) * std::exp(-rate * (0.2 - fall)) - at;
    ode.run(0.2);
    EXPECT_NEAR(velocity(box)[0], left, 0.01 * left) << law;
  }
}

// A law with a state: pushed with half of what it carries, the box moves by its bristles' bending and comes
// back when let go.
TEST(OdeFriction, LawWithAState_BendsAndComesBack) {
  Ode ode;
  ok(dfm_plugin_register_static(ode.context, dfm_plugin_entry_bristle, "bristle"));
  ok(use(ode, "bristle", {{"mu", 0.5}, {"sigma0", 1e7}}));
  dCreatePlane(ode.space, 0, 0, 1, 0);
  const dBodyID box = ode.box({0.1, 0.1, 0.02}, 2, {0, 0, 0.02});
  ode.run(0.2);
  const double start = position(box)[0];
  for (int i = 0; i < 500; ++i) {
    dBodyAddForce(box, 0.5 * 0.5 * 2 * 9.81, 0, 0);
    ode.step();
  }
  const double bent = position(box)[0] - start;
  const double stiffness = 4 * 1e7 * 1e-3;  // four corners, N/m
  EXPECT_NEAR(bent, 0.25 * 2 * 9.81 / stiffness, 0.1 * 0.25 * 2 * 9.81 / stiffness);
  ode.run(0.5);
  EXPECT_LT(std::fabs(position(box)[0] - start), 0.1 * bent);
}

// Bent bristles between rigid bodies: the adapter's snapshot has them; the dfm_world's own takes the bodies
// back, and they begin straight.
TEST(OdeFriction, SnapshotOfTheAdapter_HasTheBristles) {
  Ode ode;
  ok(dfm_plugin_register_static(ode.context, dfm_plugin_entry_bristle, "bristle"));
  ok(use(ode, "bristle", {{"mu", 0.5}, {"sigma0", 1e6}}));
  soft_ball(ode, {0, 0, 0.145}, {}, 3e4, 30);
  dCreatePlane(ode.space, 0, 0, 1, 0);
  const dBodyID box = ode.box({0.2, 0.2, 0.02}, 2, {0, 0, 0.02});
  const auto push = [&](int steps) {
    for (int i = 0; i < steps; ++i) {
      dBodyAddForce(box, 4, 1, 0);
      ode.step();
    }
  };
  push(100);
  const std::vector<unsigned char> shot = ode.snapshot();
  std::vector<unsigned char> plain;
  size_t bytes = 0;
  ok(dfm_world_snapshot(ode.soft, nullptr, &bytes));
  plain.resize(bytes);
  ok(dfm_world_snapshot(ode.soft, plain.data(), &bytes));
  push(50);
  const uint64_t hash = dfm_world_hash(ode.soft);
  ok(dfm_ode_restore(ode.adapter, shot.data(), shot.size()));
  push(50);
  EXPECT_EQ(dfm_world_hash(ode.soft), hash);
  uint64_t straight[2];
  for (uint64_t &h : straight) {
    ok(dfm_world_restore(ode.soft, plain.data(), plain.size()));
    push(50);
    h = dfm_world_hash(ode.soft);
  }
  EXPECT_NE(straight[0], hash);
  EXPECT_EQ(straight[0], straight[1]);
  ok(use(ode, "coulomb", {{"mu", 0.2}}));
  EXPECT_EQ(dfm_ode_restore(ode.adapter, shot.data(), shot.size()), DFM_E_FORMAT);
  EXPECT_NE(std::string(dfm_last_error()).find("dfm_ode_set_friction"), std::string::npos)
      << dfm_last_error();
}

namespace {

// The law of bristle_law.h, which notes the step of each evaluation; 0: a near callback.
std::vector<double> noted;
const dfm_plugin *entry_noted(const dfm_host *host, uint32_t abi, uint32_t least) {
  const dfm_plugin *const known = dfm_plugin_entry_bristle(host, abi, least);
  if (!known) return nullptr;
  static dfm_friction ops;
  static dfm_type type;
  static const dfm_type *const types[] = {&type};
  static dfm_plugin plugin;
  ops = *static_cast<const dfm_friction *>(known->types[0]->ops);
  ops.eval = [](const dfm_friction_in *in, dfm_friction_out *out) {
    noted.push_back(in->dt);
    return eval(in, out);
  };
  type = *known->types[0];
  type.ops = &ops;
  type.id = "test.noted";
  plugin = *known;
  plugin.types = types;
  return &plugin;
}

}  // namespace

// A sub-step that the guard repeats as a shorter one is collided anew: its contact joints are of its length.
TEST(OdeFriction, SubStepRepeatedShorter_HasItsOwnContacts) {
  struct Data { dfm_ode adapter; } data{};
  const auto callback = [](void *user, dGeomID a, dGeomID b) {
    noted.push_back(0);
    ok(dfm_ode_contact(static_cast<Data *>(user)->adapter, a, b, nullptr));
  };
  Ode ode({0, 0, -9.81}, 0, callback, &data);
  data.adapter = ode.adapter;
  ok(dfm_plugin_register_static(ode.context, entry_noted, "noted"));
  ok(use(ode, "test.noted", {{"mu", 0.5}, {"sigma0", 1e6}}));
  soft_bed(ode, 2e3);
  const dGeomID floor = dCreatePlane(ode.space, 0, 0, 1, -1);
  dGeomSetCategoryBits(floor, 4);
  dGeomSetCollideBits(floor, 4);
  ode.ball(0.05, 1, {0, 0, -0.95}, {1, 0, 0});
  const dGeomID shot = dBodyGetFirstGeom(ode.ball(0.015, 1, {0.15, 0.15, 0.125}, {0, 0, -60}));
  dGeomSetCategoryBits(shot, 2);
  dGeomSetCollideBits(shot, 1);
  noted.clear();
  ode.run(0.05, 2e-3);
  size_t collided = 0, finished = 0;
  for (size_t i = 0; i + 2 < noted.size(); ++i) {
    if (noted[i] != 0 || noted[i + 1] == 0) continue;
    ++collided;
    if (noted[i + 2] == 0) continue;
    ++finished;
    EXPECT_EQ(noted[i + 2], noted[i + 1]);
  }
  EXPECT_GT(finished, 5u);
  EXPECT_GT(collided, finished);  // some were repeated
}

// A near callback of the caller's that leaves the contact to dfm_ode_contact.
TEST(OdeFriction, OwnNearCallback_MayUseTheLaw) {
  struct Data {
    dfm_ode adapter;
    int made;
  } data{};
  const auto callback = [](void *user, dGeomID a, dGeomID b) {
    Data &d = *static_cast<Data *>(user);
    int n = 0;
    ok(dfm_ode_contact(d.adapter, a, b, &n));
    d.made += n;
  };
  Ode ode({0, 0, -9.81}, 0, callback, &data);
  data.adapter = ode.adapter;
  ok(use(ode, "karnopp", {{"mu", 0.2}}));
  EXPECT_NEAR(sliding_path(ode), 1 / (2 * 0.2 * 9.81), 0.01 / (2 * 0.2 * 9.81));
  EXPECT_GT(data.made, 3000);
}

TEST(OdeFriction, WrongLaw_IsReportedInOneSentenceAndChangesNothing) {
  Ode ode;
  EXPECT_LT(use(ode, "coulom", {}), 0);
  EXPECT_LT(use(ode, "coulomb", {{"nu", 1}}), 0);
  EXPECT_NE(std::string(dfm_last_error()).find("nu"), std::string::npos) << dfm_last_error();
  EXPECT_NEAR(sliding_path(ode), 1 / (2 * 0.5 * 9.81), 0.01 / (2 * 0.5 * 9.81));
}
