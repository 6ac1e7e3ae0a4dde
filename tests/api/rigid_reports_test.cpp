// What rigid things do to each other, as a host asks for it: impulses and resultants of pairs, contacts,
// events. Rigid bodies, obstacles and coupled tools.
#include <cstring>
#include <map>

#include "obstacle.h"
#include "tool.h"

namespace {

using namespace test::tools;
using test::go;
using test::push;
using test::Vec;

constexpr double kG = 9.81;
constexpr double kStep[] = {1e-3, 1.0 / 60};

std::vector<dfm_pair_impulse> impulses(dfm_world w) { return test::listed(dfm_world_pair_impulses, w); }
std::vector<dfm_contact_event> events(dfm_world w) { return test::listed(dfm_world_events, w); }

const char *const kFloors[] = {"plane", "box", "triangles", "fixed body"};
// Its top is the plane z = 0.
dfm_obstacle put_floor(dfm_world w, const std::string &kind) {
  if (kind == "plane") return test::add_plane(w, "floor");
  if (kind == "triangles")
    return test::add_mesh(w, "floor", test::height_field(0.5, 9, [](double, double) { return 0.0; }));
  if (kind == "fixed body") {
    dfm_rigid_def r = test::box("floor", {0.5, 0.5, 0.05}, 1, {0, 0, -0.05});
    r.fixed = 1;
    return test::create(w, {r})[0];
  }
  dfm_obstacle_def d = dfm_obstacle_def_default();
  d.name = "floor";
  d.shape = DFM_SHAPE_BOX;
  d.pose.position[2] = -0.05;
  std::copy_n(std::array{0.5, 0.5, 0.05}.begin(), 3, d.half_size);
  dfm_obstacle out = 0;
  test::ok(dfm_obstacle_create(w, &d, &out));
  return out;
}

Vec sum_of(const std::vector<dfm_pair_impulse> &list, uint64_t thing) {
  Vec out{};
  for (const dfm_pair_impulse &p : list)
    for (size_t k = 0; k < 3; ++k) out[k] += (p.a == thing) * p.impulse[k] - (p.b == thing) * p.impulse[k];
  return out;
}

// N s on a, of the contacts of the last sub-step, h long.
Vec sum_of_contacts(dfm_world w, uint64_t a, double h) {
  Vec out{};
  for (const dfm_contact &c : test::contacts(w)) {
    const Vec second = cross(test::vec(c.normal), test::vec(c.tangent));
    for (size_t k = 0; k < 3; ++k) {
      const double f = h * (c.fn * c.normal[k] + c.ft[0] * c.tangent[k] + c.ft[1] * second[k]);
      out[k] += (c.body_a == a) * f - (c.body_b == a) * f;
    }
  }
  return out;
}

// In each step the momentum of each body changes by its weight and by the impulses of its pairs alone.
void check_momenta(dfm_world w, const std::vector<dfm_rigid> &bodies, double dt, double time) {
  std::vector<dfm_body_measure> before(bodies.size());
  for (int i = 0; i < std::lround(time / dt); ++i) {
    for (size_t b = 0; b < bodies.size(); ++b) before[b] = test::rigid_measure(bodies[b]);
    ASSERT_EQ(dfm_world_step(w, dt, nullptr), DFM_OK) << dfm_last_error();
    const auto list = impulses(w);
    for (size_t b = 0; b < bodies.size(); ++b) {
      const dfm_body_measure now = test::rigid_measure(bodies[b]);
      const Vec got = sum_of(list, bodies[b]);
      for (size_t k = 0; k < 3; ++k)
        ASSERT_NEAR(now.momentum[k] - before[b].momentum[k], got[k] - (k == 2 ? now.mass * kG * dt : 0),
                    1e-12 * now.mass * 10)
            << "body " << b << ", step " << i;
    }
  }
}

}  // namespace

// Dropped askew: impacts, rocking, rest.
TEST(RigidReports, ImpulsesOfPairs_AreTheMomentumThatABodyGets) {
  for (const char *const floor : kFloors)
    for (const double dt : kStep) {
      SCOPED_TRACE(std::string(floor) + " " + std::to_string(dt));
      test::Context context;
      const dfm_world w = test::make_world(context, {0, 0, -kG});
      test::set_friction(w, 0.4);
      const dfm_obstacle ground = put_floor(w, floor);
      const double mass = 2;
      const dfm_rigid r = test::create(w, {test::box("crate", {0.05, 0.06, 0.04}, mass, {0, 0, 0.1})})[0];
      push(r, {0.5, 0.1, 0}, {1, 2, 0.5});
      check_momenta(w, {r}, dt, 1.5);

      const auto list = impulses(w);  // it lies
      ASSERT_EQ(list.size(), 1u);
      EXPECT_EQ(list[0].a, r);
      EXPECT_EQ(list[0].b, ground);
      const double weight = mass * kG;
      EXPECT_NEAR(list[0].impulse[2], weight * dt, 1e-9 * weight * dt);
      EXPECT_NEAR(list[0].normal_impulse, weight * dt, 1e-9 * weight * dt);
      EXPECT_NEAR(list[0].peak_normal, weight, 1e-6 * weight);
      EXPECT_NEAR(list[0].touching, dt, 1e-12);
      EXPECT_NEAR(list[0].point[2], 0, 1e-5);

      const auto pairs = test::pairs(w);
      ASSERT_EQ(pairs.size(), 1u);
      EXPECT_EQ(pairs[0].a, r);
      EXPECT_EQ(pairs[0].b, ground);
      EXPECT_NEAR(pairs[0].force[2], weight, 1e-6 * weight);
      EXPECT_NEAR(pairs[0].normal, weight, 1e-6 * weight);
      EXPECT_LT(test::norm(test::vec(pairs[0].moment)), 1e-6 * weight);
      EXPECT_LT(pairs[0].friction_work, 0) << "it slid";
      EXPECT_EQ(pairs[0].sticking, pairs[0].count);

      const auto contacts = test::contacts(w);
      ASSERT_EQ(contacts.size(), pairs[0].count);
      for (const dfm_contact &c : contacts) {
        EXPECT_EQ(c.kind, uint32_t(DFM_CONTACT_RIGID));
        EXPECT_EQ(c.body_a, r);
        EXPECT_EQ(c.body_b, std::string(floor) == "fixed body" ? ground : 0);
        EXPECT_EQ(test::listed(dfm_world_obstacles, w)[c.feature_a], r);
        EXPECT_EQ(test::listed(dfm_world_obstacles, w)[c.feature_b], ground);
        EXPECT_NEAR(c.normal[2], 1, 1e-6);
        EXPECT_NEAR(c.gap, 0, 2e-6 * dt);  // what the arcs of its landing leave, 1e-6 m/s, stays
        EXPECT_EQ(c.flags, uint32_t(DFM_CONTACT_STICKING));
      }
      double on_crate[3], on_ground[3], turns[3];
      const Vec center = test::vec(test::state(r).position);
      test::ok(dfm_world_pair_wrench(w, r, ground, center.data(), on_crate, turns));
      test::ok(dfm_world_pair_wrench(w, ground, r, center.data(), on_ground, nullptr));
      EXPECT_NEAR(on_crate[2], weight, 1e-6 * weight);
      EXPECT_LT(test::norm(test::vec(turns)), 1e-6 * weight);
      for (int k = 0; k < 3; ++k) EXPECT_EQ(on_crate[k], -on_ground[k]);
    }
}

// Each of three boxes gets what its pairs say, so what one gives is what the other gets, and at rest each
// pair carries what lies above it.
TEST(RigidReports, OfAStack_ArePairsThatCarryWhatIsAbove) {
  for (const char *const floor : {"plane", "triangles"})
    for (const double dt : kStep) {
      SCOPED_TRACE(std::string(floor) + " " + std::to_string(dt));
      test::Context context;
      const dfm_world w = test::make_world(context, {0, 0, -kG});
      const dfm_obstacle ground = put_floor(w, floor);
      std::vector<dfm_rigid_def> defs;
      const char *const names[] = {"low", "middle", "top"};
      for (int i = 0; i < 3; ++i)
        defs.push_back(test::box(names[i], {0.05, 0.05, 0.02}, 1.0 + i, {0.003 * i, 0, 0.021 + 0.042 * i}));
      const std::vector<dfm_rigid> r = test::create(w, defs);
      check_momenta(w, r, dt, 1);
      std::map<std::pair<uint64_t, uint64_t>, dfm_pair_impulse> of;
      for (const dfm_pair_impulse &p : impulses(w)) of[{p.a, p.b}] = p;
      ASSERT_EQ(of.size(), 3u);
      EXPECT_NEAR((of[{r[0], ground}].impulse[2]), 6 * kG * dt, 1e-8 * dt);
      EXPECT_NEAR((of[{r[0], r[1]}].impulse[2]), -5 * kG * dt, 1e-8 * dt) << "on the lower one";
      EXPECT_NEAR((of[{r[1], r[2]}].impulse[2]), -3 * kG * dt, 1e-8 * dt);
      for (const dfm_rigid one : r) {
        const Vec pairs = sum_of(impulses(w), one), contacts = sum_of_contacts(w, one, dt);
        EXPECT_LT(test::apart(pairs, contacts), 1e-12);
      }
    }
}

// Thrown along a floor: mu N against the slip, which is its speed, and no contact sticks.
TEST(RigidReports, OfABoxThatSlides_AreFrictionAndSlip) {
  for (const char *const law : {"coulomb", "lugre"}) {
    SCOPED_TRACE(law);
    test::Context context;
    const dfm_world w = test::make_world(context, {0, 0, -kG});
    test::set_friction(w, 0.3, law);
    const dfm_obstacle ground = put_floor(w, "plane");
    const dfm_rigid r = test::create(w, {test::box("crate", {0.05, 0.06, 0.04}, 1, {0, 0, 0.04 + 1e-5})})[0];
    go(w, 1e-3, 0.2);
    push(r, {2, 0, 0});
    double energy = test::rigid_measure(r).kinetic, work = 0;
    go(w, 1e-3, 0.2);
    const auto pairs = test::pairs(w);
    ASSERT_EQ(pairs.size(), 1u);
    EXPECT_EQ(pairs[0].b, ground);
    EXPECT_NEAR(pairs[0].friction[0], -0.3 * kG, 0.02 * kG);
    EXPECT_NEAR(pairs[0].slip_max, test::state(r).velocity[0], 1e-3);
    EXPECT_EQ(pairs[0].sticking, 0u);
    for (const dfm_contact &c : test::contacts(w)) {
      const Vec second = cross(test::vec(c.normal), test::vec(c.tangent));
      const double slip = c.slip[0] * c.tangent[0] + c.slip[1] * second[0];
      EXPECT_NEAR(slip, test::state(r).velocity[0], 1e-3);
      EXPECT_LT(c.ft[0] * c.tangent[0] + c.ft[1] * second[0], 0);
    }
    work = pairs[0].friction_work;
    energy -= test::rigid_measure(r).kinetic;
    EXPECT_NEAR(work, -energy, 0.01 * energy) << "of what it has lost";
  }
}

// One event where a pair begins to touch, however it rocks and rolls, and one where it ends.
TEST(RigidReports, EventsOfAPair_AreItsBeginAndItsEnd) {
  for (const char *const floor : kFloors)
    for (const char *const thing : {"box", "ball"})
      for (const double dt : kStep) {
        SCOPED_TRACE(std::string(thing) + " on " + floor + " " + std::to_string(dt));
        test::Context context;
        const dfm_world w = test::make_world(context, {0, 0, -kG});
        const dfm_obstacle ground = put_floor(w, floor);
        dfm_rigid_def d = test::box("thing", {0.05, 0.06, 0.04}, 1, {0, 0, 0.09});
        if (std::string(thing) == "ball") {
          d.shape = DFM_SHAPE_SPHERE;
          d.radius = 0.05;
        }
        const dfm_rigid r = test::create(w, {d})[0];
        push(r, {0.1, 0, 0}, {0.3, 0, 0});
        const double high = std::string(thing) == "ball" ? 0.04 : 0.03;  // less: it has turned a little
        go(w, dt, 0.05);
        EXPECT_TRUE(events(w).empty());
        go(w, dt, 1);
        auto list = events(w);
        ASSERT_EQ(list.size(), 1u);
        EXPECT_EQ(list[0].kind, uint32_t(DFM_EVENT_BEGIN));
        EXPECT_EQ(list[0].a, r);
        EXPECT_EQ(list[0].b, ground);
        EXPECT_EQ(list[0].key, 0u);
        EXPECT_NEAR(list[0].t, std::sqrt(2 * high / kG), 0.03);
        push(r, {0.1, 0, 1});
        go(w, dt, 0.05);
        list = events(w);
        ASSERT_EQ(list.size(), 1u);
        EXPECT_EQ(list[0].kind, uint32_t(DFM_EVENT_END));
        EXPECT_TRUE(impulses(w).empty());
        EXPECT_TRUE(test::contacts(w).empty());
        go(w, dt, 0.5);
        list = events(w);
        ASSERT_EQ(list.size(), 1u);
        EXPECT_EQ(list[0].kind, uint32_t(DFM_EVENT_BEGIN));
      }
}

TEST(RigidReports, WhatIsFilteredOrRemoved_EndsToTouch) {
  test::Context context;
  const dfm_world w = test::make_world(context, {0, 0, -kG});
  const dfm_obstacle ground = put_floor(w, "plane");
  const dfm_rigid r = test::create(w, {test::box("crate", {0.05, 0.06, 0.04}, 1, {0, 0, 0.04 + 1e-5})})[0];
  const dfm_rigid other =
      test::create(w, {test::box("other", {0.05, 0.06, 0.04}, 1, {0, 0.3, 0.04 + 1e-5})})[0];
  go(w, 1e-3, 0.1);
  EXPECT_EQ(events(w).size(), 2u);
  test::ok(dfm_world_filter_pair(w, "crate", "floor", false));
  go(w, 1e-3, 2e-3);
  auto list = events(w);
  ASSERT_EQ(list.size(), 1u);
  EXPECT_EQ(list[0].kind, uint32_t(DFM_EVENT_END));
  EXPECT_EQ(list[0].a, r);
  test::ok(dfm_obstacle_destroy(ground));
  EXPECT_TRUE(test::contacts(w).empty());
  EXPECT_TRUE(test::pairs(w).empty());
  list = events(w);
  ASSERT_EQ(list.size(), 1u);
  EXPECT_EQ(list[0].kind, uint32_t(DFM_EVENT_END));
  EXPECT_EQ(list[0].a, other);
  go(w, 1e-3, 2e-3);
  EXPECT_TRUE(events(w).empty());
  EXPECT_TRUE(impulses(w).empty());
}

// What touches at a snapshot touches after it: nothing begins anew, and the end is told.
TEST(RigidReports, AfterARestore_GoOn) {
  test::Context context;
  const dfm_world w = test::make_world(context, {0, 0, -kG});
  const dfm_obstacle ground = put_floor(w, "plane");
  const dfm_rigid r = test::create(w, {test::box("crate", {0.05, 0.06, 0.04}, 1, {0, 0, 0.04 + 1e-5})})[0];
  push(r, {0.5, 0, 0});
  go(w, 1e-3, 0.1);
  const double work = test::pairs(w)[0].friction_work;
  EXPECT_LT(work, 0);
  size_t bytes = 0;
  test::ok(dfm_world_snapshot(w, nullptr, &bytes));
  std::vector<char> kept(bytes);
  test::ok(dfm_world_snapshot(w, kept.data(), &bytes));
  const auto then = test::contacts(w);
  push(r, {0, 0, 1});
  go(w, 1e-3, 0.01);
  events(w);
  test::ok(dfm_world_restore(w, kept.data(), bytes));
  ASSERT_FALSE(then.empty());
  ASSERT_EQ(test::contacts(w).size(), then.size());
  for (size_t i = 0; i < then.size(); ++i)
    EXPECT_EQ(std::memcmp(&test::contacts(w)[i], &then[i], sizeof then[i]), 0) << i;
  go(w, 1e-3, 0.01);
  EXPECT_TRUE(events(w).empty());
  ASSERT_EQ(test::pairs(w).size(), 1u);
  EXPECT_LE(test::pairs(w)[0].friction_work, work) << "it goes on";
  push(r, {0, 0, 1});
  go(w, 1e-3, 0.01);
  const auto list = events(w);
  ASSERT_EQ(list.size(), 1u);
  EXPECT_EQ(list[0].kind, uint32_t(DFM_EVENT_END));
  EXPECT_EQ(list[0].b, ground);
}

// A coupled tool that is pressed on a table, and on a crate that stands on it: the pair carries the force of
// the coupling.
TEST(RigidReports, OfAToolThatIsPressedOnSomething_AreItsForce) {
  for (const bool crate : {false, true})
    for (const double dt : kStep) {
      SCOPED_TRACE(std::string(crate ? "crate" : "table") + " " + std::to_string(dt));
      test::Context context;
      const dfm_world w = test::make_world(context, {0, 0, crate ? -kG : 0});
      const dfm_obstacle table = put_floor(w, "plane");
      dfm_rigid r = 0;
      const double top = crate ? 0.08 : 0;
      if (crate) r = test::create(w, {test::box("crate", {0.05, 0.06, 0.04}, 1, {0, 0, 0.04 + 1e-5})})[0];
      dfm_tool_def d = dfm_tool_def_default();
      d.name = "probe";
      d.shape = DFM_TOOL_SPHERE;
      d.radius = 0.01;
      d.stiffness = 500;
      d.damping = 2 * std::sqrt(d.stiffness * d.mass);
      d.turn_stiffness = 0.2;
      d.turn_damping = 2 * std::sqrt(d.turn_stiffness * d.inertia);
      d.pose = pose({0, 0, top + 0.02});
      const dfm_tool t = make(w, d);
      for (int i = 0; i * dt < 1; ++i) {
        const dfm_pose p = pose({0, 0, top + 0.02 - 0.02 * std::min(1.0, i * dt / 0.3)});
        test::ok(dfm_tool_set_pose(t, &p, nullptr));
        ASSERT_EQ(dfm_world_step(w, dt, nullptr), DFM_OK) << dfm_last_error();
      }
      double force[3], torque[3];
      test::ok(dfm_tool_force(t, force, torque));
      EXPECT_GT(force[2], 4);
      const auto list = impulses(w);
      ASSERT_EQ(list.size(), crate ? 2u : 1u);
      dfm_obstacle part = 0;
      test::ok(dfm_world_find_obstacle(w, "probe", &part));
      const uint64_t under = crate ? r : table;
      Vec on_tool = sum_of(list, part);
      EXPECT_NEAR(on_tool[2], force[2] * dt, 1e-6 * force[2] * dt);
      const Vec on_under = sum_of(list, under);
      EXPECT_NEAR(on_under[2], crate ? kG * dt : -force[2] * dt, 1e-6 * force[2] * dt);
      double on[3];
      const double origin[3] = {};
      test::ok(dfm_world_pair_wrench(w, part, under, origin, on, nullptr));
      EXPECT_NEAR(on[2], force[2], 1e-6 * force[2]);
      const auto reported = events(w);
      EXPECT_EQ(reported.size(), list.size());
      for (const dfm_contact_event &e : reported) EXPECT_EQ(e.kind, uint32_t(DFM_EVENT_BEGIN));
    }
}
