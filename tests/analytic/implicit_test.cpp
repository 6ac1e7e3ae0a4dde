// Bodies that move by backward Euler, and their contact by the same matrix: rest, order, energy, momentum,
// friction. Those of TR-BDF2, which takes backward Euler where bodies touch. Sources:
// doc/concepts/implicit.md; reference/contact (incline_block).
#include "stack.h"

namespace {

constexpr double kG = 9.81, kFrame = 1.0 / 60, kOffset = 5e-5, kTenDegrees = 0.17453292519943295;
constexpr int32_t kImplicit = DFM_INTEGRATOR_IMPLICIT_EULER, kSecond = DFM_INTEGRATOR_TR_BDF2;

test::BodyOptions cube(const char *name, double young, double z) {
  test::BodyOptions o;
  o.name = name;
  o.young = young;
  o.damping_stiffness = 2e-3;
  o.position = {0, 0, z};
  return o;
}

// Points whose rest height is below 1e-9 m are held along z.
void hold_bottom(dfm_body b, double z) {
  uint32_t n = 0;
  std::vector<double> x(3 * 4096);
  test::ok(dfm_body_get_state(b, 4096, x.data(), nullptr, &n));
  std::vector<uint32_t> low;
  for (uint32_t i = 0; i < n; ++i)
    if (x[3 * i + 2] < z + 1e-9) low.push_back(i);
  test::ok(dfm_body_hold(b, uint32_t(low.size()), low.data(), 4));
}

// How far the center of mass of a cube sinks under its weight.
double sag_of_held_cube(double young) {
  test::Context context;
  const dfm_world w = test::make_world(context, {0, 0, -kG}, kImplicit);
  const dfm_body b = test::make_body(context, w, "beam", {0.1, 0.1, 0.1}, 60, cube("cube", young, 0));
  hold_bottom(b, 0);
  const double before = test::measure(b).com[2];
  test::run(w, 400, 10);
  return before - test::measure(b).com[2];
}

}  // namespace

// The static answer comes from the same mesh with its bottom held along z, without any contact.
TEST(ImplicitContact, CubeOnPlane_SinksByItsStaticSag) {
  struct Way {
    double h;
    int32_t integrator;
  };
  for (const double young : {1e4, 1e5, 1e7}) {
    const double expected = sag_of_held_cube(young);
    for (const auto [h, integrator] : {Way{1e-3, kImplicit}, {kFrame, kImplicit}, {kFrame, kSecond}}) {
      test::Context context;
      dfm_world_def d = dfm_world_def_default();
      d.integrator = integrator;
      d.contact_offset = kOffset;
      dfm_world w = 0;
      test::ok(dfm_world_create(context, &d, &w));
      const dfm_body b = test::make_body(context, w, "beam", {0.1, 0.1, 0.1}, 60, cube("cube", young, 1e-4));
      test::add_plane(w, "floor");
      test::set_friction(w, 0, "none");
      const double before = test::measure(b).com[2] - 1e-4;
      test::run(w, young < 5e4 ? 4 : 1, h);
      double rest = 0;  // the solve leaves gaps a hundredth of their margin
      const std::vector<dfm_contact> contacts = test::contacts(w);
      for (const dfm_contact &c : contacts) rest += c.gap / double(contacts.size());
      EXPECT_NEAR(before + kOffset + rest - test::measure(b).com[2], expected, 0.01 * expected)
          << "E " << young << " Pa, step " << h << " s, integrator " << integrator;
      EXPECT_LT(test::measure(b).speed_max, 1e-4);
    }
  }
}

TEST(ImplicitContact, SlopeOf26Point5Degrees_SlidesAt049AndHoldsAt05) {
  struct Way {
    const char *model;
    double h, mu;
    int32_t integrator = kImplicit;
  };
  std::vector<Way> ways;
  for (const char *model : {"msm", "corotational_fem"})
    for (const double h : {1e-3, kFrame})
      for (const double mu : {0.49, 0.5}) ways.push_back({model, h, mu});
  ways.push_back({"msm", kFrame, 0.5, kSecond});
  for (const auto [model, h, mu, integrator] : ways) {
    test::Context context;
    const dfm_world w = test::make_world(context, {0, 0, -kG}, integrator);
    test::BodyOptions o = cube("block", 1e6, 2e-5);
    o.model = model;
    const dfm_body b = test::make_body(context, w, "beam", {0.1, 0.1, 0.1}, 60, o);
    test::add_plane(w, "floor");
    test::set_friction(w, mu);
    std::vector<dfm_vector_key> keys;
    for (int i = 0; i <= 100; ++i) {
      const double s = i / 100.0, a = 26.5 * M_PI / 180 * s * s * (3 - 2 * s);
      keys.push_back({0.2 + 1.5 * s, {kG * std::sin(a), 0, -kG * std::cos(a)}});
    }
    test::ok(dfm_world_set_gravity_keys(w, uint32_t(keys.size()), keys.data()));
    test::run(w, 2, h);
    const double before = test::measure(b).com[0];
    test::run(w, 0.5, h);
    const double way = test::measure(b).com[0] - before;
    // slides with g (sin - 0.49 cos) = 0.0753 m/s2
    if (mu < 0.495) EXPECT_GT(way, 0.5 * 0.5 * 0.0753 * 0.25) << model << ", step " << h;
    else EXPECT_LT(std::fabs(way), 0.5e-6 * 0.5) << model << ", step " << h;
  }
}

// Positions there round by 1.2e-10 m, in a step of 2 ms more than Newton's method leaves in a body at rest.
TEST(ImplicitContact, StackOnASlopeAThousandKilometersAway_TakesNoMoreWork) {
  for (const int32_t integrator : {kImplicit, kSecond}) {
    const auto run = [&](double far) {
      test::Context context;
      const dfm_world w = test::make_world(context, {kG * 0.342, 0, -kG * 0.94}, integrator);
      test::add_plane(w, "floor");
      test::BodyOptions lower = cube("lower", 1e5, 5e-4), upper = cube("upper", 1e5, 0.0515);
      lower.position = {far - 0.05, -far - 0.05, 5e-4};
      upper.position = {far - 0.03, -far - 0.03, 0.0515};
      test::make_body(context, w, "beam", {0.1, 0.1, 0.05}, 150, lower);
      test::make_body(context, w, "beam", {0.06, 0.06, 0.04}, 150, upper);
      test::run(w, 0.3, 2e-3);
      EXPECT_GT(test::contacts(w).size(), 3u) << far << " m away";
      return test::stats(w);
    };
    const dfm_world_stats here = run(0), there = run(1e6);
    EXPECT_LE(there.work_max, 2 * here.work_max) << "integrator " << integrator;
    EXPECT_LE(there.passes_max, 2 * here.passes_max) << "integrator " << integrator;
  }
}

// A host whose frames differ: 0.1 ms, then 100 ms, while the beam lands. Of that step the revisions left a
// tenth of the change of velocity, which bent the beam by 1 cm.
TEST(ImplicitContact, BeamThatLandsInALongStep_GainsNoEnergy) {
  for (const char *model : {"msm", "corotational_fem"})
    for (const double before : {5e-5, 1e-4, 2e-4, 5e-4}) {
      test::Context context;
      const dfm_world w = test::make_world(context, {0, 0, -kG}, kImplicit);
      test::add_plane(w, "floor");
      test::BodyOptions o = cube("beam", 1e5, 0.3);
      o.model = model;
      o.damping_stiffness = 0;
      o.rotation = {0, std::sin(kTenDegrees), 0, std::cos(kTenDegrees)};
      const dfm_body b = test::make_body(context, w, "beam", {0.3, 0.05, 0.05}, 200, o);
      const auto energy = [&] { return test::total_energy(b); };
      const double start = energy();
      for (const double h : {1e-4, 0.1, 0.033, 0.008, 0.008, 0.016, 0.016, 0.016, 0.016, before, 0.1}) {
        test::ok(dfm_world_step(w, h, nullptr));
        EXPECT_LT(energy(), 1.001 * start) << model << ", " << before << " s, then " << h << " s";
      }
    }
}

TEST(ImplicitContact, TwoCubesThatCollide_KeepTheirMomentum) {
  for (const auto &[one, other] : {std::pair(kImplicit, kImplicit),
                                   {kSecond, kSecond},
                                   {kSecond, kImplicit},
                                   {kSecond, DFM_INTEGRATOR_SYMPLECTIC_EULER}}) {
    test::Context context;
    const dfm_world w = test::make_world(context, {0, 0, 0}, one);
    test::set_friction(w, 0.4);
    test::BodyOptions o = cube("lower", 1e5, 0);
    o.velocity = {0.3, 0, 1};
    const dfm_body lower = test::make_body(context, w, "beam", {0.1, 0.1, 0.1}, 60, o);
    o = cube("upper", 2e4, 0.1005);
    o.position[0] = 0.02;
    o.spin = {1, 2, 3};
    o.integrator = other;
    const dfm_body upper = test::make_body(context, w, "beam", {0.1, 0.1, 0.1}, 60, o);
    const auto momentum = [&] {
      std::array<double, 3> p{};
      for (const dfm_body b : {lower, upper})
        for (int k = 0; k < 3; ++k) p[size_t(k)] += test::measure(b).mass * test::measure(b).velocity[k];
      return p;
    };
    const auto before = momentum();
    uint32_t most = 0;
    for (int step = 0; step < 60; ++step) {
      test::run(w, 2e-3, 2e-3);
      most = std::max<uint32_t>(most, uint32_t(test::contacts(w).size()));
    }
    EXPECT_GT(most, 3u);
    for (size_t k = 0; k < 3; ++k) EXPECT_NEAR(momentum()[k], before[k], 1e-11) << one << other << k;
    EXPECT_GT(test::measure(upper).velocity[2], 0.1);
  }
}

// A stiff implicit cube on a soft explicit one on a plane, and a self-contained pair in free flight.
TEST(ImplicitContact, ImplicitOnExplicit_KeepsMomentumAndRests) {
  for (const bool flight : {true, false}) {
    test::Context context;
    const dfm_world w = test::make_world(context, {0, 0, flight ? 0 : -kG});
    test::set_friction(w, 0.4);
    test::BodyOptions o = cube("soft", 2e4, 1e-4);
    o.damping_stiffness = 5e-3;
    o.damping_mass = flight ? 0 : 20;  // it rocks
    const dfm_body soft = test::make_body(context, w, "beam", {0.1, 0.1, 0.1}, 60, o);
    o = cube("stiff", 1e8, 0.1003);
    o.integrator = kImplicit;
    o.damping_mass = flight ? 0 : 20;
    o.position[0] = 0.013;
    if (flight) o.velocity = {0.2, 0, -1};
    const dfm_body stiff = test::make_body(context, w, "beam", {0.1, 0.1, 0.1}, 60, o);
    const dfm_obstacle floor = flight ? 0 : test::add_plane(w, "floor");
    uint32_t most = 0;
    for (int step = 0; step < (flight ? 60 : 1500); ++step) {
      test::run(w, 1e-3, 1e-3);
      most = std::max<uint32_t>(most, uint32_t(test::contacts(w).size()));
    }
    EXPECT_GT(most, 3u);
    dfm_world_stats stats{};
    stats.size = sizeof stats;
    test::ok(dfm_world_get_stats(w, &stats));
    EXPECT_LE(stats.substeps_max, 4u) << "the stiff cube bounds nothing";
    const dfm_body_measure a = test::measure(soft), b = test::measure(stiff);
    if (flight) {
      EXPECT_NEAR(a.mass * a.velocity[2] + b.mass * b.velocity[2], -b.mass, 1e-11);
      EXPECT_NEAR(a.mass * a.velocity[0] + b.mass * b.velocity[0], 0.2 * b.mass, 1e-11);
    } else {
      EXPECT_LT(std::max(a.speed_max, b.speed_max), 1e-4);
      int carries = 0;  // between the cubes normals are tilted
      for (const dfm_pair_report &p : test::pairs(w))
        carries += p.b == floor && std::fabs(p.normal - (a.mass + b.mass) * kG) < 1e-3;
      EXPECT_EQ(carries, 1);
    }
  }
}

// A column of two materials, 1e6 apart, falls slightly tilted: the forces far from the start of the sub-step
// have little to do with those at it. What finds no state with its contacts is taken anew, half as long.
TEST(ImplicitContact, ColumnOfStiffnessRatio1e6_Lands) {
  test::Context context;
  const std::string path = std::string(DEFORM_SOURCE_DIR) + "/tests/stability/suite/stiffness_within.json";
  const char *set[] = {"/bodies/0/model={\"type\": \"corotational_fem\"}", "/time/integrator=implicit_euler"};
  for (const uint64_t seed : {1, 2, 3, 4}) {
    dfm_scene_options options{sizeof options, 2, set, seed};
    dfm_scene scene = 0;
    dfm_world world = 0;
    DFM_OK_OR_DIE(dfm_scene_open(context, path.c_str(), &options, &scene));
    DFM_OK_OR_DIE(dfm_scene_world(scene, &world));
    for (int step = 0; step < 60; ++step) test::run(world, kFrame, kFrame);
    dfm_body body = 0;
    test::ok(dfm_world_find_body(world, "column", &body));
    EXPECT_LT(test::measure(body).speed_max, 0.02) << "seed " << seed;
    EXPECT_NEAR(test::measure(body).com[2], 0.059, 0.005) << "seed " << seed;
    DFM_OK_OR_DIE(dfm_scene_close(scene));
  }
}

namespace {

// The tip of a bar that is held at one end and falls, 0.1 s.
double tip(int32_t integrator, double h) {
  test::Context context;
  const dfm_world w = test::make_world(context, {0, 0, -kG}, integrator);
  test::BodyOptions o;
  o.young = 1e5;
  const dfm_body b = test::make_body(context, w, "beam", {0.4, 0.1, 0.1}, 120, o);
  uint32_t n = 0;
  std::vector<double> x(3 * 4096);
  test::ok(dfm_body_get_state(b, 4096, x.data(), nullptr, &n));
  std::vector<uint32_t> held;
  uint32_t far = 0;
  for (uint32_t i = 0; i < n; ++i) {
    if (x[3 * i] < 1e-9) held.push_back(i);
    if (x[3 * i] > x[3 * far]) far = i;
  }
  test::ok(dfm_body_hold(b, uint32_t(held.size()), held.data(), 7));
  test::run(w, 0.1, h);
  test::ok(dfm_body_get_state(b, 4096, x.data(), nullptr, &n));
  return x[3 * far + 2];
}

}  // namespace

TEST(ImplicitEuler, HalvedStep_HalvesTheError) {
  const double truth = tip(DFM_INTEGRATOR_SYMPLECTIC_EULER, 2.5e-5);
  const double coarse = tip(kImplicit, 2e-3) - truth, fine = tip(kImplicit, 1e-3) - truth;
  EXPECT_NEAR(coarse / fine, 2, 0.2);
}

// Backward Euler takes energy away, at any step.
TEST(ImplicitEuler, FreeBar_GainsNoEnergy) {
  for (const double h : {1e-3, kFrame, 0.1}) {
    test::Context context;
    const dfm_world w = test::make_world(context, {0, 0, 0}, kImplicit);
    test::BodyOptions o;
    o.young = 1e6;
    o.spin = {0, 5, 1};
    const dfm_body b = test::make_body(context, w, "beam", {0.4, 0.1, 0.1}, 120, o);
    const auto energy = [&] { return test::measure(b).kinetic + test::measure(b).elastic; };
    double last = energy();
    for (int step = 0; step < 50; ++step) {
      test::run(w, h, h);
      EXPECT_LE(energy(), last * (1 + 1e-6)) << "step " << h;
      last = energy();
    }
  }
}

// Velocities of backward Euler are those of chords, which expand what turns: dampers do not see that.
TEST(ImplicitEuler, BarThatTurns_IsNotPressedTogetherByItsDampers) {
  for (const char *model : {"msm", "corotational_fem", "meshless"})
    for (const double spin : {5.0, 25.0}) {
      const auto turn = [&](double damping) {
        test::Context context;
        const dfm_world w = test::make_world(context, {0, 0, 0}, kImplicit);
        test::BodyOptions o;
        o.model = model;
        o.young = 2e6;
        o.damping_stiffness = damping;
        o.spin = {0, 0, spin};
        const dfm_body b = test::make_body(context, w, "beam", {0.1, 0.05, 0.05}, 60, o);
        const double kinetic = test::measure(b).kinetic;
        double most = 0;
        for (int step = 0; step < 6; ++step) {
          test::run(w, kFrame, kFrame);
          most = std::max(most, test::measure(b).elastic / kinetic);
        }
        return std::pair(test::measure(b).angular[2], most);
      };
      const auto plain = turn(0), damped = turn(2e-3);
      EXPECT_NEAR(damped.first / plain.first, 1, 1e-3) << model << spin;
      EXPECT_LT(damped.second, 1.5 * plain.second) << model << spin;
    }
}

// A linear model takes a rotation for a strain, and its dampers resist that, whatever the scheme.
TEST(ImplicitEuler, LinearBarThatTurns_GainsNoEnergy) {
  test::Context context;
  const dfm_world w = test::make_world(context, {0, 0, 0}, kImplicit);
  test::BodyOptions o;
  o.model = "linear_fem";
  o.young = 2e6;
  o.damping_stiffness = 2e-3;
  o.spin = {0, 0, 10};
  const dfm_body b = test::make_body(context, w, "beam", {0.1, 0.05, 0.05}, 60, o);
  const auto energy = [&] { return test::measure(b).kinetic + test::measure(b).elastic; };
  double last = energy();
  for (int step = 0; step < 100; ++step) {
    test::run(w, 1e-3, 1e-3);
    EXPECT_LE(energy(), last * (1 + 1e-6));
    last = energy();
  }
}

// The smaller a body is, the less its contacts may be off by along their normals: with a law that remembers,
// here less than along their tangents.
TEST(ImplicitContact, SmallCubesWithBristles_Converge) {
  for (const auto &[size, young, law] :
       {std::tuple(9.15e-3, 2.43e7, "lugre"), {3.17e-3, 1.14e7, "dahl"}, {4.2e-3, 4.7e5, "elastoplastic"}}) {
    test::Context context;
    const dfm_world w = test::make_world(context, {3, 0, -9.3}, kImplicit);
    test::LawValues values = {{"mu_C", 0.5}, {"sigma0", 1e8}};
    if (std::string(law) != "dahl") values.push_back({"mu_S", 0.5});
    test::ok(test::add_friction(w, law, values));
    test::BodyOptions o = cube("cube", young, size);
    o.rotation = {0.1635, 0.0490, 0.0327, 0.9848};  // 20 degrees
    o.velocity = {0.2, 0, -0.3};
    test::make_body(context, w, "beam", {size, size, size}, 100, o);
    test::add_plane(w, "floor");
    test::run(w, 0.6, 4e-3);
    EXPECT_EQ(test::stats(w).unconverged, 0u) << law;
    EXPECT_LT(test::stats(w).sweeps_max, 300u) << law;
  }
}

// Several bodies on several threads; a world that is restored continues with the same bits.
TEST(ImplicitContact, StackOnThreads_KeepsItsBits) {
  for (const int32_t integrator : {kImplicit, kSecond}) {
    std::array<uint64_t, 2> hash{};
    for (const uint32_t threads : {1u, 4u}) {
      test::Context context(threads);
      const test::Stack s = test::make_stack(context, 1e-3, 0.5, integrator);
      test::run(s.world, 0.1, 5e-3);
      const auto kept = test::snapshot(s.world);
      test::run(s.world, 0.1, 5e-3);
      const uint64_t end = dfm_world_hash(s.world);
      test::ok(dfm_world_restore(s.world, kept.data(), kept.size()));
      test::run(s.world, 0.1, 5e-3);
      EXPECT_EQ(dfm_world_hash(s.world), end);
      hash[threads > 1] = end;
    }
    EXPECT_EQ(hash[0], hash[1]) << "integrator " << integrator;
  }
}

// No stability bound limits an implicit step. The step that is offered follows the error: short steps while
// the body swings, the longest when it rests.
TEST(ImplicitEuler, OfferedStep_GrowsAsTheBodyComesToRest) {
  for (const int32_t integrator : {kImplicit, kSecond}) {
    test::Context context;
    const dfm_world w = test::make_world(context, {0, 0, -kG}, integrator);
    const dfm_body b = test::make_body(context, w, "beam", {0.1, 0.1, 0.1}, 60, cube("cube", 1e4, 0));
    hold_bottom(b, 0);
    double shortest = 1, step = 0;
    for (int k = 0; k < 400 && dfm_world_time(w) < 5; ++k) {
      test::ok(dfm_world_stable_step(w, &step, nullptr, nullptr));
      shortest = std::min(shortest, step);
      uint32_t trouble = 0;
      test::ok(dfm_world_step(w, step, &trouble));
      EXPECT_EQ(trouble, 0u);
    }
    EXPECT_LT(shortest, 8e-3);
    EXPECT_GT(step, 0.025);
    EXPECT_LT(test::measure(b).speed_max, 1e-4);
  }
}

TEST(ImplicitEuler, WhatItCannotTake_IsRefused) {
  test::Context context;
  dfm_world w = 0;
  dfm_world_def d = dfm_world_def_default();
  d.integrator = kSecond + 1;
  EXPECT_EQ(dfm_world_create(context, &d, &w), DFM_E_UNSUPPORTED);
  test::says({"DFM_INTEGRATOR_TR_BDF2"});
  d.integrator = kSecond;
  d.newton_iterations = 1;
  ASSERT_EQ(dfm_world_create(context, &d, &w), DFM_OK);
  test::Tet tet("one");
  dfm_body body = 0;
  EXPECT_EQ(dfm_body_create(w, &tet.def, &body), DFM_E_UNSUPPORTED);
  test::says({"tr_bdf2", "solver.newton"});
  d.integrator = kImplicit;
  d.newton_iterations = 0;
  d.solver = "nonsense";
  ASSERT_EQ(dfm_world_create(context, &d, &w), DFM_OK);
  EXPECT_NE(dfm_body_create(w, &tet.def, &body), DFM_OK);
  test::says({"nonsense", "ldlt", "pcg"});
}
