// A body's model changes while it runs: what stays, what jumps, what is refused, what comes later by time.
#include <algorithm>
#include <cstring>
#include <functional>
#include <limits>

#include "stack.h"

namespace {

constexpr const char *kModels[] = {"msm", "corotational_fem", "linear_fem"};

using test::State;
std::vector<double> surface_of(dfm_body body) { return test::listed(dfm_surface_positions, body, 3); }
std::string model_of(dfm_body body) {
  dfm_body_info i{};
  i.size = sizeof i;
  test::ok(dfm_body_get_info(body, &i));
  return i.model;
}
std::vector<dfm_swap> swaps(dfm_world w) { return test::listed(dfm_world_swaps, w); }

struct Param {
  const char *key;
  double value;
};
dfm_status set_model(dfm_body body, const char *type, std::initializer_list<Param> params = {}) {
  std::vector<dfm_param_value> rows;
  for (const Param &p : params) rows.push_back({p.key, &p.value, 1});
  const dfm_params given{sizeof given, uint32_t(rows.size()), rows.data()};
  return dfm_body_set_model(body, type, &given);
}

// A bar in flight that turns, bends and shivers.
struct Flying {
  test::Context context;
  dfm_world world;
  dfm_body body;
  explicit Flying(int32_t integrator = DFM_INTEGRATOR_SYMPLECTIC_EULER, const char *model = "msm",
                  uint32_t threads = 1)
      : context(threads), world(test::make_world(context, {0, 0, 0}, integrator)) {
    test::BodyOptions o;
    o.model = model;
    o.young = 1e5;
    o.name = "bar";
    o.velocity = {0.3, -0.2, 0.1};
    o.spin = {1, 2, 3};
    body = test::make_body(context, world, "beam", {0.3, 0.1, 0.1}, 200, o);
    State s = State(body);
    for (size_t i = 0; i < s.x.size(); i += 3) {  // its lowest bending, about
      const double along = s.x[i] / 0.3;
      s.v[i + 2] += 2 * (along * along - along + 1.0 / 6);
    }
    test::ok(dfm_body_set_state(body, uint32_t(s.x.size() / 3), nullptr, s.v.data()));
  }
};

}  // namespace

TEST(SetModel, InFlight_KeepsEveryPositionAndVelocityToTheBit) {
  for (const int32_t integrator : {DFM_INTEGRATOR_SYMPLECTIC_EULER, DFM_INTEGRATOR_IMPLICIT_EULER}) {
    Flying f(integrator);
    test::run(f.world, 0.05, 1e-3);
    for (const char *model : {"corotational_fem", "linear_fem", "msm", "corotational_fem"}) {
      SCOPED_TRACE(model);
      const State before = State(f.body);
      const std::vector<double> surface = surface_of(f.body);
      const dfm_body_measure m = test::measure(f.body);
      test::ok(set_model(f.body, model));
      EXPECT_EQ(model_of(f.body), std::string("org.deform.") + model);
      EXPECT_TRUE(before == State(f.body));
      EXPECT_EQ(surface, surface_of(f.body));
      const dfm_body_measure n = test::measure(f.body);
      EXPECT_EQ(std::memcmp(m.momentum, n.momentum, sizeof m.momentum), 0);
      EXPECT_EQ(std::memcmp(m.angular, n.angular, sizeof m.angular), 0);
      EXPECT_EQ(m.kinetic, n.kinetic);
      const std::vector<dfm_swap> rows = swaps(f.world);
      ASSERT_EQ(rows.size(), 1u);
      EXPECT_EQ(rows[0].body, f.body);
      EXPECT_EQ(rows[0].flags, 0u);
      EXPECT_EQ(rows[0].t, dfm_world_time(f.world));
      EXPECT_EQ(std::string(rows[0].to), model_of(f.body));
      EXPECT_EQ(rows[0].elastic_before, m.elastic);
      EXPECT_EQ(rows[0].elastic_after, n.elastic);
      EXPECT_TRUE(std::isinf(rows[0].max_jump));
      test::run(f.world, 0.02, 1e-3);
    }
    EXPECT_TRUE(swaps(f.world).empty());
  }
}

// Nothing of the model that it was made with is left: the run is that of a body made with the new one.
TEST(SetModel, BeforeTheFirstStep_IsABodyMadeSo) {
  for (const int32_t integrator : {DFM_INTEGRATOR_SYMPLECTIC_EULER, DFM_INTEGRATOR_IMPLICIT_EULER})
    for (const char *from : kModels)
      for (const char *to : kModels) {
        SCOPED_TRACE(std::string(from) + " to " + to);
        Flying changed(integrator, from), made(integrator, to);
        test::ok(set_model(changed.body, to));
        test::run(changed.world, 5e-3, 1e-3);
        test::run(made.world, 5e-3, 1e-3);
        // linear_fem turns its rest shape as the body stands, which is as it was made but for rounding
        const State a = State(changed.body), b = State(made.body);
        for (size_t i = 0; i < a.x.size(); ++i) ASSERT_NEAR(a.x[i], b.x[i], 1e-13);
        const bool same = dfm_world_hash(changed.world) == dfm_world_hash(made.world);
        EXPECT_TRUE(same || std::string(to) == "linear_fem");
      }
}

// The bound is the new model's at once, and so is the step that a host may take.
TEST(SetModel, StepBound_IsThatOfTheNewModel) {
  for (const char *to : kModels) {
    Flying changed(DFM_INTEGRATOR_SYMPLECTIC_EULER, "msm"), made(DFM_INTEGRATOR_SYMPLECTIC_EULER, to);
    test::run(changed.world, 0.1, 1e-3);
    const State s = State(changed.body);
    test::ok(dfm_body_set_state(made.body, uint32_t(s.x.size() / 3), s.x.data(), s.v.data()));
    test::ok(set_model(changed.body, to));
    double a = 0, b = 0;
    test::ok(dfm_world_stable_step(changed.world, &a, nullptr, nullptr));
    test::ok(dfm_world_stable_step(made.world, &b, nullptr, nullptr));
    EXPECT_EQ(a, b) << to;
  }
}

// A model of small rotations counts them from where the body is: turned by any angle it is at rest.
TEST(SetModel, ToSmallRotations_StartsFromThePresentOnes) {
  test::Context c;
  const dfm_world w = test::make_world(c, {0, 0, 0});
  test::BodyOptions o;
  o.spin = {3, -5, 7};
  const dfm_body b = test::make_body(c, w, "beam", {0.2, 0.1, 0.1}, 60, o);
  test::run(w, 0.3, 1e-3);  // 2.7 rad
  uint32_t n = 0;
  test::ok(dfm_body_get_state(b, 0, nullptr, nullptr, &n));
  const std::vector<double> still(size_t(3) * n, 0.0);
  test::ok(dfm_body_set_state(b, n, nullptr, still.data()));
  const double before = test::measure(b).elastic;
  test::ok(set_model(b, "linear_fem"));
  const std::vector<dfm_swap> rows = swaps(w);
  ASSERT_EQ(rows.size(), 1u);
  EXPECT_LT(rows[0].elastic_after, 3 * before) << "what spinning stretches, seen by another model";
  EXPECT_LT(rows[0].elastic_after, 0.1) << "from the pose at the start it would be 60 J and more";
}

// A clamped bar that hangs: its clamp says which way it points, so that it comes to rest where one that was
// linear from the start does.
TEST(SetModel, OfAClampedBar_KeepsTheDirectionOfTheClamp) {
  const auto tip = [](const char *first) {
    test::Context c;
    const dfm_world w = test::make_world(c, {0, 0, -9.81}, DFM_INTEGRATOR_IMPLICIT_EULER);
    test::BodyOptions o;
    o.model = first;
    o.young = 2e5;
    const dfm_body b = test::make_body(c, w, "beam", {0.3, 0.1, 0.1}, 100, o);
    const State s = State(b);
    std::vector<uint32_t> held;
    for (uint32_t i = 0; 3 * i < s.x.size(); ++i)
      if (s.x[3 * i] < 1e-9) held.push_back(i);
    test::ok(dfm_body_hold(b, uint32_t(held.size()), held.data(), 7));
    test::ok(dfm_world_equilibrium(w, nullptr, nullptr));
    test::ok(set_model(b, "linear_fem"));
    test::ok(dfm_world_equilibrium(w, nullptr, nullptr));
    return test::measure(b).com[2];
  };
  const double linear = tip("linear_fem"), changed = tip("corotational_fem");
  EXPECT_LT(linear, 0.045) << "it bends";
  EXPECT_NEAR(changed, linear, 1e-12);
}

TEST(SetModel, AboveMaxJump_IsRefusedAndChangesNothing) {
  Flying f, other;
  test::run(f.world, 0.05, 1e-3);
  test::run(other.world, 0.05, 1e-3);
  const std::string before = test::snapshot(f.world);
  EXPECT_EQ(set_model(f.body, "corotational_fem", {{"max_jump", 1e-9}}), DFM_DISCARD);
  test::says({"body 'bar'", "org.deform.msm", "org.deform.corotational_fem", "max_jump (1e-09 J)",
              "nothing was changed"});
  EXPECT_EQ(before, test::snapshot(f.world));
  EXPECT_TRUE(swaps(f.world).empty());
  test::run(f.world, 0.05, 1e-3);
  test::run(other.world, 0.05, 1e-3);
  EXPECT_EQ(dfm_world_hash(f.world), dfm_world_hash(other.world)) << "nor anything that comes later";
  test::ok(set_model(f.body, "corotational_fem", {{"max_jump", 1.0}}));
  EXPECT_EQ(swaps(f.world)[0].max_jump, 1.0);
}

// Bodies that the library moves explicitly do not keep a body which has become stiff at their side:
// integrators that were left to it are chosen anew.
TEST(SetModel, ToAStifferBody_ChoosesIntegratorsAgain) {
  test::Context context;
  dfm_world_def d = dfm_world_def_default();
  d.step = 1.0 / 60;
  d.gravity[2] = 0;
  dfm_world w = 0;
  test::ok(dfm_world_create(context, &d, &w));
  dfm_body bodies[2] = {};
  for (int i = 0; i < 2; ++i) {
    test::Tet t;
    t.def.pose.position[0] = 10 * i;
    test::ok(dfm_body_create(w, &t.def, &bodies[i]));
  }
  test::ok(dfm_world_step(w, d.step, nullptr));
  test::ok(set_model(bodies[1], "corotational_fem", {{"young", 1e11}}));
  dfm_world_stats before = {}, after = {};
  before.size = after.size = sizeof before;
  test::ok(dfm_world_get_stats(w, &before));
  test::ok(dfm_world_step(w, d.step, nullptr));
  test::ok(dfm_world_get_stats(w, &after));
  EXPECT_LT(after.substeps - before.substeps, 100u);
}

TEST(SetModel, WhatDoesNotFit_IsRefusedAndChangesNothing) {
  Flying f;
  test::run(f.world, 0.01, 1e-3);
  const uint64_t hash = dfm_world_hash(f.world);
  const auto refused = [&](dfm_status found, dfm_status wanted, std::initializer_list<const char *> parts) {
    EXPECT_EQ(found, wanted) << dfm_last_error();
    test::says(parts);
    EXPECT_EQ(dfm_world_hash(f.world), hash);
    EXPECT_EQ(model_of(f.body), "org.deform.msm");
  };
  refused(set_model(f.body, "corotational"), DFM_E_UNSUPPORTED, {"corotational_fem", "msm"});
  refused(set_model(f.body, "corotational_fem", {{"yuong", 1e5}}), DFM_E_ARG, {"young"});
  refused(set_model(f.body, "corotational_fem", {{"poisson", 0.7}}), DFM_E_ARG, {"poisson"});
  for (const double bad : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN()})
    refused(set_model(f.body, "msm", {{"max_jump", bad}}), DFM_E_ARG, {"max_jump", "above 0"});
  refused(dfm_body_set_model(f.body, nullptr, nullptr), DFM_E_ARG, {"type"});
  const dfm_params lost{sizeof lost, 2, nullptr};
  refused(dfm_body_set_model(f.body, "msm", &lost), DFM_E_ARG, {"2 parameters", "NULL"});
}

// In free vibration, which nothing damps: energy rises by no more than the jumps, whose sum is limited.
TEST(SetModel, RoundAndRound_NeverGainsMoreThanTheJumps) {
  for (const int32_t integrator : {DFM_INTEGRATOR_SYMPLECTIC_EULER, DFM_INTEGRATOR_IMPLICIT_EULER}) {
    Flying f(integrator);
    const auto energy = [&] {
      const dfm_body_measure m = test::measure(f.body);
      return m.kinetic + m.elastic;
    };
    const dfm_body_measure start = test::measure(f.body);
    double given = energy(), first = given, made = 0;
    for (int k = 0; k < 40; ++k) {
      test::run(f.world, 0.02, 5e-4);
      if (set_model(f.body, kModels[(k + 1) % 3]) == DFM_OK) {
        const dfm_swap s = swaps(f.world)[0];
        given += std::max(0.0, s.elastic_after - s.elastic_before);
        ++made;
      } else {
        test::says({"body 'bar'", "would rise by", "earlier changes have put in", "set max_jump"});
      }
      EXPECT_LT(energy(), std::min(1.02 * given, 1.11 * first)) << k;
    }
    EXPECT_TRUE(made < 40 || integrator != DFM_INTEGRATOR_SYMPLECTIC_EULER);
    const dfm_body_measure end = test::measure(f.body);
    const double p = std::sqrt(start.momentum[0] * start.momentum[0] + start.momentum[1] * start.momentum[1] +
                               start.momentum[2] * start.momentum[2]);
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(end.momentum[c], start.momentum[c], 1e-10 * p);
  }
}

namespace {

// A block on a slope below the angle of friction, under a law with memory.
struct Slope {
  test::Context context;
  dfm_world world;
  dfm_body block;
  explicit Slope(int32_t integrator = DFM_INTEGRATOR_SYMPLECTIC_EULER, uint32_t threads = 1,
                 bool sleep = false)
      : context(threads), world(test::make_world(context, {3.5, 0, -9.2}, integrator)) {
    test::add_plane(world, "slope");
    test::set_friction(world, 0.5, "elastoplastic");
    test::BodyOptions o;
    o.name = "block";
    o.young = 1e5;
    o.damping_stiffness = 2e-3;
    o.position = {0, 0, 1e-4};
    block = test::make_body(context, world, "beam", {0.1, 0.1, 0.1}, 60, o);
    test::ok(dfm_world_set_sleep(world, sleep));
  }
};

}  // namespace

TEST(SetModel, InMidContact_HoldsOnWithTheSameBristles) {
  for (const int32_t integrator : {DFM_INTEGRATOR_SYMPLECTIC_EULER, DFM_INTEGRATOR_IMPLICIT_EULER}) {
    Slope s(integrator);
    test::run(s.world, 1.0, 1e-3);
    const std::vector<dfm_contact> before = test::contacts(s.world);
    ASSERT_GE(before.size(), 4u);
    test::events(s.world);
    test::ok(set_model(s.block, "corotational_fem"));
    const std::vector<dfm_contact> after = test::contacts(s.world);
    ASSERT_EQ(before.size(), after.size());
    for (size_t i = 0; i < before.size(); ++i)
      EXPECT_EQ(std::memcmp(&before[i], &after[i], sizeof(dfm_contact)), 0);
    test::ok(dfm_world_step(s.world, 1e-3, nullptr));
    double most = 0, change = 0;
    const std::vector<dfm_contact> next = test::contacts(s.world);
    for (const dfm_contact &c : next)
      for (const dfm_contact &b : before)
        if (b.key == c.key)
          for (int k = 0; k < 2; ++k) {
            most = std::max(most, std::fabs(b.bristle[k]));
            change = std::max(change, std::fabs(c.bristle[k] - b.bristle[k]));
          }
    EXPECT_GT(most, 0);
    EXPECT_LT(change, 0.6 * most) << "bristles go on; dropped ones would start from zero";
    EXPECT_TRUE(test::events(s.world).empty()) << "no contact has ended or begun";
    // the shape of the new model's rest is another one; once it is there, nothing creeps
    test::run(s.world, 0.5, 1e-3);
    const double x = test::measure(s.block).com[0];
    test::run(s.world, 0.5, 1e-3);
    EXPECT_LT(std::fabs(test::measure(s.block).com[0] - x), 1e-6);
  }
}

// The same model anew is no change at all: contacts, bristles and warm starts go on to the bit.
TEST(SetModel, ToTheSameModelInMidContact_ContinuesToTheBit) {
  Slope s, plain;
  for (int k = 0; k < 5; ++k) {
    test::run(s.world, 0.1, 1e-3);
    test::run(plain.world, 0.1, 1e-3);
    EXPECT_EQ(dfm_world_hash(s.world), dfm_world_hash(plain.world)) << k;
    test::ok(set_model(s.block, "msm"));
  }
}

TEST(SetModel, OfASleeper_WakesItAndItSleepsAgain) {
  Slope s(DFM_INTEGRATOR_SYMPLECTIC_EULER, 1, true);
  const auto asleep = [&] {
    bool is = false;
    test::ok(dfm_body_is_asleep(s.block, &is));
    return is;
  };
  test::run(s.world, 2.0, 1e-3);
  ASSERT_TRUE(asleep());
  EXPECT_EQ(set_model(s.block, "corotational_fem", {{"max_jump", 1e-12}}), DFM_DISCARD);
  EXPECT_TRUE(asleep()) << "refused: nothing has changed";
  const size_t n = test::contacts(s.world).size();
  test::ok(set_model(s.block, "corotational_fem"));
  EXPECT_FALSE(asleep());
  test::ok(dfm_world_step(s.world, 1e-3, nullptr));
  EXPECT_EQ(test::contacts(s.world).size(), n);
  test::run(s.world, 2.0, 1e-3);
  EXPECT_TRUE(asleep());
}

// Into the world it was taken of, and into a new one whose body has its first model still.
TEST(SetModel, SnapshotAfterIt_RestoresBeforeAndAfter) {
  for (const int32_t integrator : {DFM_INTEGRATOR_SYMPLECTIC_EULER, DFM_INTEGRATOR_IMPLICIT_EULER})
    for (const char *to : {"corotational_fem", "linear_fem"}) {
      Slope s(integrator), fresh(integrator);
      test::run(s.world, 0.1, 1e-3);
      const std::string first = test::snapshot(s.world);
      const uint64_t first_hash = dfm_world_hash(s.world);
      test::ok(set_model(s.block, to, {{"young", 2e5}}));
      test::run(s.world, 0.1, 1e-3);
      const std::string taken = test::snapshot(s.world);
      test::run(s.world, 0.1, 1e-3);
      const uint64_t end = dfm_world_hash(s.world);
      for (const dfm_world w : {s.world, fresh.world}) {
        test::ok(dfm_world_restore(w, taken.data(), taken.size()));
        EXPECT_EQ(taken, test::snapshot(w));
        test::run(w, 0.1, 1e-3);
        EXPECT_EQ(dfm_world_hash(w), end) << to;
      }
      test::ok(dfm_world_restore(s.world, first.data(), first.size()));
      EXPECT_EQ(model_of(s.block), "org.deform.msm");
      EXPECT_EQ(dfm_world_hash(s.world), first_hash);
      test::run(s.world, 0.01, 1e-3);
    }
}

// What differs by cell belongs to the mesh: the new model takes what it has a parameter for.
TEST(SetModel, FieldsByCell_StayWithTheMesh) {
  test::Context c;
  const double size[3] = {0.2, 0.1, 0.1};
  dfm_mesh_handle mesh = 0;
  test::ok(dfm_mesh_make(c, "beam", size, DFM_MESH_CELLS, 60, &mesh));
  dfm_body_def d = dfm_body_def_default();
  test::lend(mesh, d);
  std::vector<double> young(d.ntet);
  for (uint32_t i = 0; i < d.ntet; ++i) young[i] = 1e5 + 1e3 * i;
  const dfm_cell_field field{"young", young.data(), 1};
  d.nfield = 1;
  d.fields = &field;
  const dfm_world w = test::make_world(c, {0, 0, 0});
  dfm_body changed = 0, made = 0;
  test::ok(dfm_body_create(w, &d, &changed));
  d.model = "corotational_fem";
  test::ok(dfm_body_create(w, &d, &made));
  State s = State(changed);
  for (size_t i = 0; i < s.x.size(); i += 3) s.x[i] *= 1.05;
  for (const dfm_body b : {changed, made}) test::ok(dfm_body_set_state(b, d.npoint, s.x.data(), nullptr));
  test::ok(set_model(changed, "corotational_fem"));
  EXPECT_EQ(test::measure(changed).elastic, test::measure(made).elastic);
  EXPECT_EQ(set_model(changed, "msm", {{"young", 1e5}}), DFM_E_ARG);
  test::says({"young", "field"});
  test::ok(dfm_mesh_destroy(mesh));
}

TEST(SetModel, EffectThatTheSceneRequests_IsNotLostSilently) {
  test::Context c;
  const char *const effects[] = {"deform.plasticity", nullptr};
  dfm_world_def def = dfm_world_def_default();
  def.effects = effects;
  dfm_world w = 0;
  test::ok(dfm_world_create(c, &def, &w));
  test::Tet tet("soft");
  const double yield = 0.1;
  const dfm_param_value v{"yield", &yield, 1};
  tet.def.model = "corotational_fem";
  tet.def.model_params = {sizeof(dfm_params), 1, &v};
  dfm_body b = 0;
  test::ok(dfm_body_create(w, &tet.def, &b));
  test::ok(dfm_world_step(w, 1e-4, nullptr));
  const std::string before = test::snapshot(w);
  EXPECT_EQ(set_model(b, "msm"), DFM_E_ARG);
  test::says({"body 'soft'", "effect 'deform.plasticity'", "org.deform.msm"});
  EXPECT_EQ(before, test::snapshot(w));
}

namespace {

dfm_switch switch_at(double t, const char *type, double max_jump = 0,
                     int32_t integrator = DFM_INTEGRATOR_AUTO) {
  dfm_switch s = dfm_switch_default();
  s.integrator = integrator;
  s.t = t;
  s.type = type;
  s.max_jump = max_jump;
  return s;
}

}  // namespace

// unsanitized: one of the models is on Mesa's driver, which leaves 128 bytes behind
TEST(SetModel, AnyModelFromAnyOther_TakesABlockOverInContact) {
  test::Context c;
  std::vector<std::string> models;
  test::ok(dfm_plugin_visit(
      c,
      [](void *user, const dfm_type *type, const char *) {
        if (type->kind == DFM_KIND_MODEL) static_cast<std::vector<std::string> *>(user)->push_back(type->id);
      },
      &models));
  ASSERT_GE(models.size(), 3u);
  for (const std::string &from : models)
    for (const std::string &to : models) {
      SCOPED_TRACE(from + " to " + to);
      Slope s;
      test::ok(set_model(s.block, from.c_str()));
      test::run(s.world, 0.2, 1e-3);
      const State before = State(s.block);
      const dfm_body_measure m = test::measure(s.block);
      const dfm_status status = set_model(s.block, to.c_str());
      if (status == DFM_DISCARD) {  // a shape that the model does not know, by more than 1e-6 of the size
        test::says({"would move the surface", to.c_str()});
        EXPECT_EQ(to, "org.deform.condensed");
        EXPECT_EQ(model_of(s.block), from);
      } else {
        ASSERT_EQ(status, DFM_OK) << dfm_last_error();
      }
      EXPECT_TRUE(before == State(s.block));
      test::ok(dfm_world_step(s.world, 1e-3, nullptr));
      EXPECT_FALSE(test::contacts(s.world).empty());
      test::run(s.world, 0.1, 1e-3);
      for (int k = 0; k < 3; ++k) EXPECT_NEAR(test::measure(s.block).com[k], m.com[k], 5e-3);
    }
}

// By time: at the first step that begins then, once, and a restored world goes on with what is to come.
TEST(Switches, AreMadeAtTheirTimes) {
  Slope s;
  const dfm_switch list[] = {switch_at(0.01, "corotational_fem"),
                             switch_at(0.02, "linear_fem", 0, DFM_INTEGRATOR_IMPLICIT_EULER),
                             switch_at(0.0355, "msm", 0, DFM_INTEGRATOR_SYMPLECTIC_EULER)};
  test::ok(dfm_body_set_switches(s.block, 3, list));
  test::run(s.world, 0.01, 1e-3);
  EXPECT_EQ(model_of(s.block), "org.deform.msm") << "the step that begins at 0.01 s has not begun";
  const std::string at = test::snapshot(s.world);
  test::run(s.world, 0.04, 1e-3);
  const uint64_t end = dfm_world_hash(s.world);
  const std::vector<dfm_swap> rows = swaps(s.world);
  ASSERT_EQ(rows.size(), 3u);
  const double times[] = {0.01, 0.02, 0.036};
  for (size_t i = 0; i < 3; ++i) EXPECT_NEAR(rows[i].t, times[i], 1e-9);
  EXPECT_EQ(std::string(rows[1].to), "org.deform.linear_fem");
  EXPECT_EQ(model_of(s.block), "org.deform.msm");
  Slope fresh;
  for (const dfm_world w : {s.world, fresh.world}) {
    test::ok(dfm_world_restore(w, at.data(), at.size()));
    test::run(w, 0.04, 1e-3);
    EXPECT_EQ(dfm_world_hash(w), end);
    EXPECT_EQ(swaps(w).size(), 3u);
  }
}

TEST(Switches, RefusedByMaxJump_LeaveTheModelAndAreReported) {
  Slope s, plain;
  const dfm_switch list[] = {switch_at(0.01, "corotational_fem", 1e-12)};
  test::ok(dfm_body_set_switches(s.block, 1, list));
  test::run(s.world, 0.05, 1e-3);
  test::run(plain.world, 0.05, 1e-3);
  const std::vector<dfm_swap> rows = swaps(s.world);
  ASSERT_EQ(rows.size(), 1u);
  EXPECT_EQ(rows[0].flags, uint32_t{DFM_SWAP_REFUSED});
  EXPECT_GT(std::fabs(rows[0].elastic_after - rows[0].elastic_before), 1e-12);
  EXPECT_EQ(dfm_world_hash(s.world), dfm_world_hash(plain.world));
}

TEST(Switches, ThatAreNone_AreRefusedWhole) {
  Slope s;
  const dfm_switch good = switch_at(1, "corotational_fem");
  test::ok(dfm_body_set_switches(s.block, 1, &good));
  const std::string before = test::snapshot(s.world);
  const auto refused = [&](std::vector<dfm_switch> list, std::initializer_list<const char *> parts) {
    EXPECT_LT(dfm_body_set_switches(s.block, uint32_t(list.size()), list.data()), 0);
    test::says(parts);
    EXPECT_EQ(before, test::snapshot(s.world));
  };
  refused({switch_at(2, "msm"), switch_at(1, "msm")}, {"body 'block'", "1 s", "must not decrease"});
  refused({switch_at(NAN, "msm")}, {"finite"});
  refused({switch_at(1, "mms")}, {"msm"});
  refused({switch_at(1, nullptr)}, {"type"});
  refused({switch_at(1, "msm", -1)}, {"max_jump"});
  refused({switch_at(1, "msm", 0, 9)}, {"integrator 9"});
  EXPECT_EQ(dfm_body_set_switches(s.block, 1, nullptr), DFM_E_ARG);
  test::ok(dfm_body_set_switches(s.block, 0, nullptr));
  test::run(s.world, 0.01, 1e-3);
  EXPECT_TRUE(swaps(s.world).empty());
}

TEST(Switches, BeginWithADefault_AndMayBeLongerThanThisHeader) {
  const dfm_switch d = dfm_switch_default();
  EXPECT_EQ(d.size, sizeof(dfm_switch));
  EXPECT_EQ(d.params.size, sizeof(dfm_params));
  EXPECT_EQ(d.integrator, DFM_INTEGRATOR_AUTO);
  EXPECT_EQ(d.type, nullptr);
  EXPECT_EQ(d.max_jump, 0);
  Slope s;
  dfm_switch none = d;
  none.size = 0;
  none.type = "msm";
  EXPECT_EQ(dfm_body_set_switches(s.block, 1, &none), DFM_E_ARG);
  test::says({"switch 0: size is 0", "dfm_switch_default()"});
  struct Later {
    dfm_switch known;
    double added[2];
  } list[2] = {{d, {0, 0}}, {d, {0, 0}}};
  for (Later &l : list) l.known.size = sizeof l;
  list[0].known.type = "corotational_fem";
  list[1].known.type = "linear_fem";
  list[1].known.t = 5e-3;
  test::ok(dfm_body_set_switches(s.block, 2, &list[0].known));
  test::run(s.world, 0.02, 1e-3);
  EXPECT_EQ(model_of(s.block), "org.deform.linear_fem");
}

TEST(Switches, WithAnyNumberOfThreads_GiveTheSameBits) {
  uint64_t hash[3];
  for (size_t k = 0; k < 3; ++k) {
    Slope s(DFM_INTEGRATOR_SYMPLECTIC_EULER, uint32_t(1 + 3 * k));
    const dfm_switch list[] = {switch_at(0.02, "corotational_fem"), switch_at(0.04, "linear_fem"),
                               switch_at(0.06, "msm", 0, DFM_INTEGRATOR_SYMPLECTIC_EULER)};
    test::ok(dfm_body_set_switches(s.block, 3, list));
    test::run(s.world, 0.1, 1e-3);
    hash[k] = dfm_world_hash(s.world);
  }
  EXPECT_EQ(hash[0], hash[1]);
  EXPECT_EQ(hash[0], hash[2]);
}

namespace {

// A ball above a floor, with a rule; msm far away, corotational where it matters.
struct Ball {
  test::Context context;
  dfm_world world;
  dfm_body body;
  dfm_switch_rule rule = dfm_switch_rule_default();
  explicit Ball(double height, std::array<double, 3> velocity = {0, 0, 0}, double gravity = -9.81,
                uint32_t threads = 1)
      : context(threads), world(test::make_world(context, {0, 0, gravity})) {
    test::add_plane(world, "floor");
    test::BodyOptions o;
    o.name = "ball";
    o.young = 5e4;
    o.position = {0, 0, 0.05 + height};
    o.velocity = velocity;
    body = test::make_body(context, world, "ball", {0.05}, 100, o);
    rule.otherwise.type = "msm";
  }
  void follow() const { test::ok(dfm_body_set_switch_rule(body, &rule)); }
};

}  // namespace

// Dropped, it bounces: accurate from the first touch until it has flown for the wait.
TEST(SwitchRule, Touching_TakesTheModelAtOnceAndKeepsItForTheWait) {
  Ball b(0.05);
  b.rule.touching.type = "corotational_fem";
  b.rule.wait = 0.03;
  b.follow();
  double touched = -1;
  int in_contact = 0, flying = 0;
  for (int i = 0; i < 400; ++i) {
    test::ok(dfm_world_step(b.world, 1e-3, nullptr));
    // what the next step begins with decides; the rule has seen the state before this one
    const double t = dfm_world_time(b.world);
    const bool accurate = model_of(b.body) == "org.deform.corotational_fem";
    if (touched >= 0 && t - touched > 1.5e-3) {
      EXPECT_EQ(accurate, t - touched < 0.03 + 1.5e-3) << t;
      ++(accurate ? in_contact : flying);
    }
    for (const dfm_contact &c : test::contacts(b.world))
      if (c.fn > 0) touched = t;
  }
  EXPECT_GT(in_contact, 20);
  EXPECT_GT(flying, 20);
  const std::vector<dfm_swap> rows = swaps(b.world);
  ASSERT_GE(rows.size(), 2u);
  for (size_t i = 0; i < rows.size(); ++i)
    EXPECT_EQ(std::string(rows[i].to), i % 2 ? "org.deform.msm" : "org.deform.corotational_fem");
}

// Past the place of interest: near begins at the distance and ends farther away.
TEST(SwitchRule, Near_BeginsAtTheDistanceAndEndsFartherAway) {
  Ball b(0.5, {1, 0, 0}, 0);
  b.rule.near_by.type = "corotational_fem";
  b.rule.point[0] = 0.5;
  b.rule.point[2] = 0.55;
  b.rule.distance = 0.2;
  b.rule.hysteresis = 0.5;
  b.rule.wait = 0;
  b.follow();
  test::run(b.world, 1.2, 1e-3);
  const std::vector<dfm_swap> rows = swaps(b.world);
  ASSERT_EQ(rows.size(), 2u);
  EXPECT_NEAR(rows[0].t, 0.5 - 0.2 - 0.05, 2e-3) << "its surface is 0.2 m away";
  EXPECT_NEAR(rows[1].t, 0.5 + 1.5 * 0.2 + 0.05, 2e-3);
  EXPECT_EQ(std::string(rows[1].to), "org.deform.msm");
  // the place moves to where it is now
  const dfm_body_measure m = test::measure(b.body);
  test::ok(dfm_body_set_interest(b.body, m.com));
  test::ok(dfm_world_step(b.world, 1e-3, nullptr));
  EXPECT_EQ(model_of(b.body), "org.deform.corotational_fem");
}

// A model without an integrator of its own has the one that the body had when the rule was made, whatever
// another model of the rule has brought.
TEST(SwitchRule, IntegratorOfOneModel_GoesWithIt) {
  Ball b(0.5, {0, 0, 0}, 0);
  b.rule.near_by.type = "corotational_fem";
  b.rule.near_by.integrator = DFM_INTEGRATOR_IMPLICIT_EULER;
  b.rule.distance = 1;
  b.rule.wait = 0;
  b.follow();
  const double places[][3] = {{9, 0, 0}, {0, 0, 0}, {9, 0, 0}};
  for (const auto &place : places) {
    test::ok(dfm_body_set_interest(b.body, place));
    test::ok(dfm_world_step(b.world, 1e-4, nullptr));
    double step = 0;
    test::ok(dfm_world_stable_step(b.world, &step, nullptr, nullptr));
    const bool near = place[0] == 0;
    EXPECT_EQ(model_of(b.body), near ? "org.deform.corotational_fem" : "org.deform.msm");
    const bool bounded = test::stats(b.world).stable_step < 0.1;
    EXPECT_EQ(bounded, !near) << "implicit points have no bound";
  }
}

// It swings across the line in less than the wait, or less far than the hysteresis: one change.
TEST(SwitchRule, OnTheLine_DoesNotChangeBackAndForth) {
  for (const bool by_time : {false, true}) {
    Ball b(0.5, {0, 0, 0}, 0);
    b.rule.near_by.type = "corotational_fem";
    b.rule.point[2] = 0.55;
    b.rule.distance = 0.2;
    b.rule.hysteresis = by_time ? 0 : 0.2;
    b.rule.wait = by_time ? 0.05 : 0;
    b.follow();
    for (int i = 0; i < 200; ++i) {
      const double away = 0.2 + 0.05 + (i / 10 % 2 ? 0.01 : -0.01);
      const double point[3] = {away, 0, 0.55};
      test::ok(dfm_body_set_interest(b.body, point));
      test::ok(dfm_world_step(b.world, 1e-3, nullptr));
    }
    EXPECT_EQ(swaps(b.world).size(), 1u) << by_time;
  }
}

TEST(SwitchRule, Refused_IsReportedOnceAndTriedAgain) {
  Ball b(1e-4);
  test::run(b.world, 0.2, 1e-3);
  b.rule.touching.type = "corotational_fem";
  b.rule.max_jump = 1e-12;
  b.rule.wait = 0.01;
  b.follow();
  test::run(b.world, 0.1, 1e-3);
  std::vector<dfm_swap> rows = swaps(b.world);
  ASSERT_EQ(rows.size(), 1u);
  EXPECT_EQ(rows[0].flags, uint32_t{DFM_SWAP_REFUSED});
  EXPECT_EQ(model_of(b.body), "org.deform.msm");
  b.rule.max_jump = 0;
  b.follow();
  test::run(b.world, 0.02, 1e-3);
  EXPECT_EQ(model_of(b.body), "org.deform.corotational_fem");
}

TEST(SwitchRule, IsPartOfASnapshot_AndOfNoThread) {
  for (const char *far : {"msm", "modal"}) {
    uint64_t hash[2];
    for (size_t k = 0; k < 2; ++k) {
      Ball b(0.02, {0, 0, 0}, -9.81, uint32_t(1 + 3 * k));
      b.rule.otherwise.type = far;
      b.rule.touching.type = "corotational_fem";
      b.rule.wait = 0.02;
      b.follow();
      test::run(b.world, 0.1, 1e-3);
      const std::string taken = test::snapshot(b.world);
      test::run(b.world, 0.1, 1e-3);
      hash[k] = dfm_world_hash(b.world);
      const size_t changes = swaps(b.world).size();
      EXPECT_GE(changes, 2u);
      Ball fresh(0.02);  // has no instance to come back to
      for (const dfm_world w : {b.world, fresh.world}) {
        test::ok(dfm_world_restore(w, taken.data(), taken.size()));
        EXPECT_EQ(taken, test::snapshot(w));
        test::run(w, 0.1, 1e-3);
        EXPECT_EQ(dfm_world_hash(w), hash[k]) << far;
      }
    }
    EXPECT_EQ(hash[0], hash[1]) << far;
  }
}

// A sleeping body is left alone: a change would wake it.
TEST(SwitchRule, OfASleeper_WaitsUntilItWakes) {
  Slope s(DFM_INTEGRATOR_SYMPLECTIC_EULER, 1, true);
  test::run(s.world, 2.0, 1e-3);
  dfm_switch_rule rule = dfm_switch_rule_default();
  rule.touching.type = "corotational_fem";
  rule.otherwise.type = "msm";
  test::ok(dfm_body_set_switch_rule(s.block, &rule));
  test::run(s.world, 0.1, 1e-3);
  EXPECT_EQ(model_of(s.block), "org.deform.msm");
  EXPECT_EQ(test::stats(s.world).asleep, 1u);
  test::ok(dfm_body_wake(s.block));
  test::run(s.world, 2e-3, 1e-3);
  EXPECT_EQ(model_of(s.block), "org.deform.corotational_fem");
}

TEST(SwitchRule, ThatIsNone_IsRefused) {
  Ball b(1);
  const auto refused = [&](const std::function<void(dfm_switch_rule &)> &spoil,
                           std::initializer_list<const char *> parts) {
    dfm_switch_rule r = b.rule;
    r.near_by.type = "corotational_fem";
    r.distance = 1;
    test::ok(dfm_body_set_switch_rule(b.body, &r));
    const std::string before = test::snapshot(b.world);
    spoil(r);
    EXPECT_LT(dfm_body_set_switch_rule(b.body, &r), 0);
    test::says(parts);
    EXPECT_EQ(before, test::snapshot(b.world));
  };
  refused([](auto &r) { r.otherwise.type = nullptr; }, {"body 'ball'", "otherwise"});
  refused([](auto &r) { r.near_by.type = nullptr; }, {"near_by"});
  refused([](auto &r) { r.near_by.type = "corot"; }, {"corotational_fem"});
  refused([](auto &r) { r.distance = 0; }, {"distance", "0 m"});
  refused([](auto &r) { r.point[1] = NAN; }, {"point"});
  refused([](auto &r) { r.hysteresis = -1; }, {"hysteresis"});
  refused([](auto &r) { r.wait = NAN; }, {"wait"});
  refused([](auto &r) { r.max_jump = -1; }, {"max_jump"});
  // a rule, or a choice in it, that was not made by the default
  refused([](auto &r) { r.size = 0; }, {"size is 0", "_default()"});
  refused([](auto &r) { r.otherwise.size = 0; },
          {"body 'ball'", "'otherwise' is 0", "dfm_switch_rule_default()"});
  refused([](auto &r) { r.near_by.size = 8; }, {"'near_by' is 8, expected 32"});
  refused([](auto &r) { r.touching = {12, 0, nullptr, {}}; }, {"'touching' is 12"});
  dfm_switch_rule r = b.rule;  // one that is not asked for may be all zero
  r.touching.type = "corotational_fem";
  r.near_by = {};
  test::ok(dfm_body_set_switch_rule(b.body, &r));
  test::ok(dfm_body_set_switch_rule(b.body, nullptr));
  const double here[3] = {0, 0, 0};
  EXPECT_EQ(dfm_body_set_interest(b.body, here), DFM_E_ARG);
  test::says({"no rule"});
}
