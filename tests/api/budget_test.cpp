// What a step may cost: cheapened in a known order, ended early, stopped from outside.
#include <atomic>
#include <chrono>
#include <cmath>
#include <ctime>
#include <thread>
#include <utility>

#include "deform/scene.h"
#include "rigid.h"
#include "stack.h"

namespace {

constexpr double kStep = 2e-3;

// A stack that falls asleep, a rigid box and a law that remembers, hit by a fast block: all that a step may
// change is there.
struct Busy {
  test::Context context;
  dfm_world world = 0;
  dfm_body lower = 0, upper = 0;

  explicit Busy(uint32_t threads = 1) : context(threads) {
    dfm_world_def d = dfm_world_def_default();
    d.sleep = 1;
    d.sleep_time = 0.02;
    d.sleep_speed = 0.05;
    test::ok(dfm_world_create(context, &d, &world));
    test::set_friction(world, 0.4, "coulomb");
    test::add_plane(world, "floor");
    test::BodyOptions o;
    o.damping_stiffness = 1e-3;
    o.damping_mass = 20;
    o.volume = 0.5;
    o.name = "lower";
    o.position = {0, 0, 1e-5};
    lower = test::make_body(context, world, "beam", {0.1, 0.1, 0.05}, 60, o);
    o.name = "upper";
    o.position = {0.02, 0.02, 0.1};
    o.velocity = {0, 0, -3};
    upper = test::make_body(context, world, "beam", {0.05, 0.05, 0.05}, 60, o);
    test::create(world, {test::box("flyer", {0.02, 0.02, 0.02}, 0.05, {0.3, 0.3, 0.03})});
  }
  void set_work(uint64_t units, double seconds = 0) const {
    test::ok(dfm_world_set_budget(world, seconds, units));
  }
};

struct Seen {
  uint64_t hash, steps;
  uint32_t events = 0;  // that wait to be read
  std::vector<double> forces;
  explicit Seen(dfm_world w) : hash(dfm_world_hash(w)), steps(test::stats(w).steps) {
    for (const dfm_contact &c : test::contacts(w)) forces.push_back(c.fn);
    dfm_world_events(w, 0, nullptr, &events);
  }
  bool operator==(const Seen &o) const {
    return hash == o.hash && steps == o.steps && events == o.events && forces == o.forces;
  }
};

// With much friction: solves do not converge.
dfm_world sheets_that_hit(const test::Context &c, const char *law, double speed, dfm_body *bodies) {
  dfm_world_def d = dfm_world_def_default();
  d.gravity[2] = 0;
  d.energy_watch = 0;
  dfm_world w = 0;
  test::ok(dfm_world_create(c, &d, &w));
  test::set_friction(w, 0.9, law);
  test::BodyOptions o;
  o.young = 1e6;
  o.damping_stiffness = 1e-4;
  bodies[0] = test::make_body(c, w, "beam", {0.12, 0.12, 0.012}, 30, o);
  o.position = {0.01, -0.01, 0.03};
  o.velocity = {0, 0, -speed};
  o.rotation = {0.1, 0.05, 0.1, 0.988};
  bodies[1] = test::make_body(c, w, "beam", {0.12, 0.12, 0.012}, 30, o);
  return w;
}

}  // namespace

// Whatever the budget: the world goes on, by what fits, and reaches the end in more steps.
TEST(Budget, BelowTheLeastWork_StillAdvances) {
  for (const uint64_t share : {2, 4, 1000000}) {
    Busy tried, plain;
    int steps = 0;
    for (int i = 0; i < 60; ++i) {
      test::ok(dfm_world_step(plain.world, kStep, nullptr));
      const uint64_t work = test::stats(plain.world).work;
      tried.set_work(std::max<uint64_t>(1, work / share));
      const double end = dfm_world_time(plain.world);
      while (dfm_world_time(tried.world) < end * (1 - 1e-9)) {
        const double before = dfm_world_time(tried.world);
        uint32_t trouble = 0;
        ASSERT_EQ(dfm_world_step(tried.world, end - before, &trouble), DFM_OK) << dfm_last_error();
        ASSERT_GT(dfm_world_time(tried.world), before);
        if (dfm_world_time(tried.world) < end * (1 - 1e-9)) {
          EXPECT_TRUE(trouble & DFM_TROUBLE_BUDGET);
        }
        ++steps;
      }
    }
    const dfm_world_stats s = test::stats(tried.world);
    std::printf("1/%g of the work: %d steps for 60, %g shortened, %g unconverged of %g\n", double(share),
                steps, double(s.shortened), double(s.unconverged), double(s.substeps));
    EXPECT_GT(s.shortened, 0u);
    EXPECT_EQ(s.discarded, 0u);
    EXPECT_LT(s.energy_gain, 0.01 * s.energy_max);
  }
}

// Implicit bodies take a whole step at once, whatever it costs.
TEST(Budget, OfImplicitBodies_TakesASubStep) {
  test::Context context;
  const dfm_world w = test::make_world(context, {0, 0, -9.81}, DFM_INTEGRATOR_IMPLICIT_EULER);
  test::add_plane(w, "floor");
  test::BodyOptions o;
  o.position = {0, 0, 1e-3};
  o.velocity = {0, 0, -3};
  test::make_body(context, w, "beam", {0.1, 0.1, 0.05}, 60, o);
  for (const uint64_t units : {1, 1000, 2000, 4000}) {
    test::ok(dfm_world_set_budget(w, 0, units));
    const double before = dfm_world_time(w);
    test::ok(dfm_world_step(w, kStep, nullptr));
    EXPECT_GT(dfm_world_time(w), before + 1e-3 * kStep) << units;
  }
}

// unsanitized: long there; OfImplicitBodies_TakesASubStep runs the same code
// A heap of them: solves that the budget ends leave no motion that the energy watch would have to end.
TEST(Budget, OfImplicitBodiesInAHeap_MakesNoEnergy) {
  test::Context context;
  for (const char *model : {"msm", "corotational_fem"}) {
    const dfm_world w = test::make_world(context, {0, 0, -9.81}, DFM_INTEGRATOR_IMPLICIT_EULER);
    test::set_friction(w, 0.5, "coulomb");
    test::add_plane(w, "floor");
    test::BodyOptions o;
    o.model = model;
    o.young = 1e5;
    o.damping_stiffness = 2e-3;
    for (int k = 0; k < 12; ++k) {
      o.position = {0.04 * (k % 2), 0.03 * (k / 2 % 2), 0.05 + 0.07 * (k / 4)};
      o.velocity = {0.2 * (k % 3), 0.1 * (k % 5), -2};
      o.spin = {1.0 + k, 2, 3};
      test::make_body(context, w, "beam", {0.035, 0.025, 0.06}, 40, o);
    }
    test::ok(dfm_world_set_budget(w, 0, 30000));
    for (int step = 0; step < 30; ++step) {
      const double before = dfm_world_time(w);
      ASSERT_EQ(dfm_world_step(w, 1.0 / 60, nullptr), DFM_OK) << model << step << dfm_last_error();
      ASSERT_GT(dfm_world_time(w), before) << model << step;
    }
    EXPECT_GT(test::stats(w).cheapened, 10u) << model;
  }
}

// Solves that would need more and ways that cross cost accuracy first, then sub-steps; no step takes more.
// unsanitized: too slow there; shorter tests run the same code
TEST(Budget, OfSolvesThatItEnds_IsKept) {
  test::Context c;
  for (const char *law : {"coulomb", "lugre"}) {
    constexpr int kSteps = 40;
    constexpr double h = 2e-4;
    dfm_body bodies[2];
    const dfm_world free = sheets_that_hit(c, law, 30, bodies);
    test::ok(dfm_world_set_budget(free, 0, UINT64_MAX));
    test::ok(dfm_world_step(free, h, nullptr));
    uint64_t least = test::stats(free).work / test::stats(free).last_substeps;
    for (int i = 1; i < kSteps; ++i) test::ok(dfm_world_step(free, h, nullptr));
    const dfm_world_stats whole = test::stats(free);
    EXPECT_EQ(whole.unconverged, 0u);
    std::printf("%s: without a budget %g units at most, %u sub-steps at most, %g unconverged\n", law,
                double(whole.work_max), whole.substeps_max, double(whole.unconverged));
    least = whole.substeps_max * (least + 12 * uint64_t{whole.contacts_max});
    for (const double more : {2.0, 4.0, 16.0}) {
      const dfm_world w = sheets_that_hit(c, law, 30, bodies);
      const auto budget = uint64_t(more * double(least));
      test::ok(dfm_world_set_budget(w, 0, budget));
      for (int i = 0; i < kSteps; ++i) {
        ASSERT_EQ(dfm_world_step(w, h, nullptr), DFM_OK) << law << more << " step " << i << dfm_last_error();
        ASSERT_LE(test::stats(w).work, budget) << law << more << " step " << i;
      }
      const dfm_world_stats s = test::stats(w);
      if (more < 3) {
        EXPECT_GT(s.cheapened, 0u);
      }
      std::printf("  %g units: %g at most, %g simplified, %g ended early, %g unconverged, %g s lost\n",
                  double(budget), double(s.work_max), double(s.cheapened), double(s.shortened),
                  double(s.unconverged), s.guard_lost);
    }
  }
}

// A step that evaluates its stable step has less for contact, whoever asked for that and when.
TEST(Budget, WhereTheStableStepIsNew_LeavesLessForContact) {
  test::Context c;
  dfm_body bodies[2];
  const dfm_world w = sheets_that_hit(c, "coulomb", 3, bodies);
  constexpr double h = 5e-4;
  test::ok(dfm_world_set_budget(w, 0, 12000));
  uint64_t plain = 0, anew = 0, less = 0;
  for (int i = 0; i < 30; ++i) {
    const std::string start = test::snapshot(w);
    const auto again = [&](bool asks) {
      test::ok(dfm_world_restore(w, start.data(), start.size()));
      test::ok(dfm_body_hold(bodies[0], 0, nullptr, 0));  // holds nothing more: the stable step is due
      double dt = 0;
      if (asks) test::ok(dfm_world_stable_step(w, &dt, nullptr, nullptr));
      test::ok(dfm_world_step(w, h, nullptr));
      return test::stats(w).work;
    };
    const uint64_t found = again(false), hash = dfm_world_hash(w);
    EXPECT_EQ(again(true), found) << i;
    EXPECT_EQ(dfm_world_hash(w), hash) << i;
    anew += found;
    test::ok(dfm_world_restore(w, start.data(), start.size()));
    test::ok(dfm_world_step(w, h, nullptr));
    plain += test::stats(w).work;
    less += found < test::stats(w).work;
  }
  std::printf("%g units, %g where the stable step is new; less in %g of 30 steps\n", double(plain),
              double(anew), double(less));
  EXPECT_GT(less, 0u);
  EXPECT_LT(anew, plain);
}

// Sheets that hit at 100 m/s: sweeps beyond the usual cap and the guard's pieces are there to be left out.
// Three times the speed of their waves: the energy watch, which would end some of these steps, is off.
// unsanitized: too slow there; shorter tests run the same code
TEST(Budget, ThatCheapensAStep_IsReportedAndIsTheSameWithAnyThreads) {
  uint64_t hash[2];
  for (const uint32_t threads : {1u, 4u}) {
    test::Context c(threads);
    const auto make = [&] {
      dfm_world_def d = dfm_world_def_default();
      d.gravity[2] = 0;
      d.energy_watch = 0;
      dfm_world w = 0;
      test::ok(dfm_world_create(c, &d, &w));
      test::set_friction(w, 0.3);
      test::BodyOptions o;
      o.young = 1e6;
      o.damping_stiffness = 1e-4;
      test::make_body(c, w, "beam", {0.12, 0.12, 0.012}, 30, o);
      o.position = {0.01, -0.01, 0.03};
      o.velocity = {0, 0, -100};
      o.rotation = {0.1, 0.05, 0.1, 0.988};
      test::make_body(c, w, "beam", {0.12, 0.12, 0.012}, 30, o);
      return w;
    };
    const dfm_world thrifty = make();
    uint64_t cheap = 0;
    for (int i = 0; i < 4; ++i) {
      const auto before = test::snapshot(thrifty);  // what this very step takes without a budget
      test::ok(dfm_world_step(thrifty, 5e-4, nullptr));
      const uint64_t whole = test::stats(thrifty).work;
      test::ok(dfm_world_restore(thrifty, before.data(), before.size()));
      test::ok(dfm_world_set_budget(thrifty, 0, whole * 3 / 4));
      uint32_t trouble = 0;
      test::ok(dfm_world_step(thrifty, 5e-4, &trouble));
      cheap += (trouble & DFM_TROUBLE_BUDGET) != 0;
      test::ok(dfm_world_set_budget(thrifty, 0, UINT64_MAX));
    }
    EXPECT_GT(cheap, 0u);
    EXPECT_GE(test::stats(thrifty).cheapened + test::stats(thrifty).shortened, cheap);
    hash[threads > 1] = dfm_world_hash(thrifty);
  }
  EXPECT_EQ(hash[0], hash[1]);
}

TEST(Budget, OfTooLittleTime_EndsTheStepEarly) {
  Busy b;
  b.set_work(0, 1e-9);
  uint32_t trouble = 0;
  test::ok(dfm_world_step(b.world, kStep, &trouble));
  EXPECT_TRUE(trouble & DFM_TROUBLE_BUDGET);
  EXPECT_GT(dfm_world_time(b.world), 0);
  EXPECT_LT(dfm_world_time(b.world), 0.9 * kStep);
  EXPECT_EQ(test::stats(b.world).shortened, 1u);
  EXPECT_EQ(test::stats(b.world).steps, 1u);
  b.set_work(0);
  trouble = 0;
  test::ok(dfm_world_step(b.world, kStep, &trouble));
  EXPECT_FALSE(trouble & DFM_TROUBLE_BUDGET);
  EXPECT_EQ(dfm_world_set_budget(b.world, -1, 0), DFM_E_ARG);
}

// Twenty toys that fall on each other, with budgets that a frame exceeds: every step advances the world, so
// that the next one meets another state.
// unsanitized: too slow there; shorter tests run the same code
TEST(Budget, OfTwentyToys_AdvancesInEveryStep) {
  const std::string path = std::string(DEFORM_SOURCE_DIR) + "/tests/bench/toys.json";
  for (const auto &[seconds, work] : {std::pair(4e-3, uint64_t{0}), std::pair(0.0, uint64_t{200000})}) {
    test::Context context;
    dfm_scene scene = 0;
    test::ok(dfm_scene_open(context, path.c_str(), nullptr, &scene));
    dfm_world w = 0;
    test::ok(dfm_scene_world(scene, &w));
    test::ok(dfm_world_set_budget(w, seconds, work));
    for (int k = 0; k < 60; ++k) {
      const double before = dfm_world_time(w);
      test::ok(dfm_world_step(w, 1.0 / 60, nullptr));
      EXPECT_GT(dfm_world_time(w), before) << k << ", " << seconds << " s, " << work << " units";
    }
    EXPECT_EQ(test::stats(w).discarded, 0u);
    EXPECT_GT(test::stats(w).contacts_max, 0u);
    test::ok(dfm_scene_close(scene));
  }
}

// One sub-step of three thrown chains may take most of a second.
TEST(Budget, OfTimeForChainsThatHitAFloor_EndsTheStepSoon) {
  test::Context c;
  const dfm_world w = test::make_world(c, {0, 0, -9.81});
  test::set_friction(w, 0.4, "coulomb");
  test::add_plane(w, "floor");
  for (uint32_t s = 0; s < 3; ++s) {
    std::vector<dfm_rigid_def> links;
    std::vector<dfm_joint_def> joints;
    for (uint32_t i = 0; i < 8; ++i) {
      const double x = 0.1 * i, y = 0.05 * s, z = 0.5 + 0.1 * s;
      links.push_back(test::box(nullptr, {0.042, 0.012, 0.012}, 0.1 * (1 + i % 3), {x, y, z}));
      if (i) joints.push_back(test::joint(DFM_JOINT_BALL, i, i - 1, {x - 0.05, y, z}, {0, 1, 0}));
    }
    const std::vector<dfm_rigid> chain = test::create(w, links, joints);
    for (uint32_t i = 0; i < 8; ++i) {
      dfm_rigid_state state = test::state(chain[i]);
      state.velocity[1] = std::sin(0.5 * i + s);
      state.velocity[2] = std::cos(0.7 * i);
      test::ok(dfm_rigid_set_state(chain[i], &state));
    }
  }
  const auto step = [&] {  // s of this process: others may have the processor
    const std::clock_t from = std::clock();
    test::ok(dfm_world_step(w, 1.0 / 60, nullptr));
    return double(std::clock() - from) / CLOCKS_PER_SEC;
  };
  const double free = step();  // the budget is a share of what this machine takes
  double whole = free;
  std::string before;
  for (int k = 0; k < 40 && whole < 20 * free; ++k) {
    before = test::snapshot(w);
    whole = step();
  }
  ASSERT_GE(whole, 20 * free);
  test::ok(dfm_world_restore(w, before.data(), before.size()));
  test::ok(dfm_world_set_budget(w, whole / 8, UINT64_MAX));
  const double now = dfm_world_time(w);
  EXPECT_LT(step(), 0.5 * whole);
  EXPECT_GT(dfm_world_time(w), now);
}

TEST(Interrupt, BetweenSteps_StopsTheNextOneOnce) {
  Busy b;
  const Seen before(b.world);
  test::ok(dfm_world_interrupt(b.world));
  test::ok(dfm_world_interrupt(b.world));  // counts once
  uint32_t trouble = 0;
  EXPECT_EQ(dfm_world_step(b.world, kStep, &trouble), DFM_DISCARD);
  EXPECT_EQ(trouble, uint32_t(DFM_TROUBLE_INTERRUPTED));
  EXPECT_TRUE(before == Seen(b.world));
  test::ok(dfm_world_step(b.world, kStep, nullptr));
  EXPECT_EQ(dfm_world_interrupt(0), DFM_E_HANDLE);
}

// From within a step, at one contact of it after the other; then the step is taken in full, and all goes on
// as if nothing had been tried.
TEST(Interrupt, AnywhereInAStep_LeavesTheStateAsBefore) {
  struct Stop {
    dfm_world world;
    int at = -1, met = 0;
    static void pre_solve(void *user, dfm_contact_choice *) {
      Stop &s = *static_cast<Stop *>(user);
      if (s.met++ == s.at) {
        EXPECT_EQ(dfm_world_interrupt(s.world), DFM_OK);
      }
    }
  };
  Busy tried, plain;
  Stop stop{tried.world}, none{plain.world};
  test::ok(dfm_world_set_pre_solve(tried.world, &Stop::pre_solve, &stop));
  test::ok(dfm_world_set_pre_solve(plain.world, &Stop::pre_solve, &none));
  int stopped = 0;
  for (int i = 0; i < 60; ++i) {
    none.met = 0;
    test::ok(dfm_world_step(plain.world, kStep, nullptr));
    const Seen before(tried.world);
    for (int part = 0; part < 4 && none.met > 0; ++part) {
      stop.met = 0;
      stop.at = none.met * part / 4;
      uint32_t trouble = 0;
      ASSERT_EQ(dfm_world_step(tried.world, kStep, &trouble), DFM_DISCARD) << i << ' ' << part;
      EXPECT_EQ(trouble, uint32_t(DFM_TROUBLE_INTERRUPTED));
      EXPECT_TRUE(before == Seen(tried.world)) << "step " << i << ", " << part << "/4 of its contacts";
      ++stopped;
    }
    stop.at = -1;
    test::ok(dfm_world_step(tried.world, kStep, nullptr));
    ASSERT_EQ(dfm_world_hash(tried.world), dfm_world_hash(plain.world)) << "step " << i;
  }
  EXPECT_GT(stopped, 100);
}

// A step of one sub-step, of which nothing is saved in advance: what its first stages have written is undone.
TEST(Interrupt, WithinTheOnlySubStep_LeavesNothingOfIt) {
  struct Stop {
    test::Context context;
    dfm_world world = test::make_world(context);
    bool within = false, asked = false;
    static void pre_solve(void *user, dfm_contact_choice *) {
      Stop &s = *static_cast<Stop *>(user);
      if (std::exchange(s.asked, false)) test::ok(dfm_world_interrupt(s.world));
    }
    void discard(double dt) {
      if (within) asked = true;
      else test::ok(dfm_world_interrupt(world));
      EXPECT_EQ(dfm_world_step(world, dt, nullptr), DFM_DISCARD);
    }
  };
  Stop first, second;  // stopped before and after the stages have begun
  second.within = true;
  for (Stop *s : {&first, &second}) {
    test::add_plane(s->world, "floor");
    test::BodyOptions o;
    o.position = {0, 0, 0.1};
    o.velocity = {0, 0, -0.1};
    test::make_body(s->context, s->world, "ball", {0.1, 0, 0}, 200, o);
    const dfm_vector_key keys[2] = {{0, {0, 0, -9.81}}, {10, {5, 0, -9.81}}};
    test::ok(dfm_world_set_gravity_keys(s->world, 2, keys));
    test::ok(dfm_world_set_pre_solve(s->world, &Stop::pre_solve, s));
    for (int i = 0; i < 20; ++i) test::ok(dfm_world_step(s->world, 1e-5, nullptr));
    for (int i = 0; i < 3; ++i) s->discard(1e-5);
    ASSERT_EQ(test::stats(s->world).last_substeps, 1u);
  }
  // the work of the steps that were stopped is all that differs, behind the checksum
  constexpr size_t kHead = 40;
  const std::string a = test::snapshot(first.world), b = test::snapshot(second.world);
  ASSERT_EQ(a.size(), b.size());
  const size_t from = size_t(std::mismatch(a.begin() + kHead, a.end(), b.begin() + kHead).first - a.begin());
  const size_t to = size_t(a.rend() - std::mismatch(a.rbegin(), a.rend(), b.rbegin()).first);
  EXPECT_LE(to - from, sizeof(uint64_t));
}

// What pairs that sleep bore in the last step is told by its length, not by that of a step that was stopped.
TEST(Interrupt, BetweenSteps_LeavesTheImpulsesOfTheLastOne) {
  Busy b;
  dfm_rigid flyer = 0;
  test::ok(dfm_world_find_rigid(b.world, "flyer", &flyer));
  test::ok(dfm_rigid_destroy(flyer));
  bool asleep = false;
  for (int i = 0; i < 2000; ++i) test::ok(dfm_world_step(b.world, kStep, nullptr));
  test::ok(dfm_body_is_asleep(b.lower, &asleep));
  ASSERT_TRUE(asleep);
  const auto parts = [&] {
    std::vector<double> out;
    for (const dfm_pair_impulse &p : test::listed(dfm_world_pair_impulses, b.world))
      out.insert(out.end(), p.part, p.part + 8);
    return out;
  };
  const std::vector<double> before = parts();
  EXPECT_FALSE(before.empty());
  test::ok(dfm_world_interrupt(b.world));
  EXPECT_EQ(dfm_world_step(b.world, 2 * kStep, nullptr), DFM_DISCARD);
  EXPECT_EQ(parts(), before);
}

// A step of thousands of sub-steps, asked to stop from another thread: this one or, should it have been over
// already, the next.
TEST(Interrupt, FromAnotherThread_StopsALongStep) {
  Busy b;
  double stable = 0;
  test::ok(dfm_world_stable_step(b.world, &stable, nullptr, nullptr));
  std::atomic<bool> running{false};
  std::thread other([&] {
    while (!running) std::this_thread::yield();
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
    test::ok(dfm_world_interrupt(b.world));
  });
  const Seen before(b.world);
  running = true;
  uint32_t trouble = 0;
  const dfm_status first = dfm_world_step(b.world, 5000 * stable, &trouble);
  other.join();
  if (first == DFM_DISCARD) EXPECT_TRUE(before == Seen(b.world));
  else EXPECT_EQ(dfm_world_step(b.world, kStep, &trouble), DFM_DISCARD);
  EXPECT_EQ(trouble, uint32_t(DFM_TROUBLE_INTERRUPTED));
  test::ok(dfm_world_step(b.world, kStep, nullptr));
}
