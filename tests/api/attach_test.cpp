// Surfaces attached to obstacles, rigid bodies and other bodies: force, both momenta, release, ends, state.
#include <cstring>
#include <functional>

#include "cut_scenes.h"
#include "obstacle.h"
#include "rigid.h"
#include "stack.h"

namespace {

constexpr double kG = 9.81;

struct World {
  test::Context context;
  dfm_world w;
  explicit World(std::array<double, 3> gravity = {0, 0, -kG}) : w(test::make_world(context, gravity)) {}
  void run(double seconds, double h = 1e-3) {
    for (double t = 0; t < seconds - 1e-9; t += h) test::ok(dfm_world_step(w, h, nullptr));
  }
  // A beam of 1e-4 m3 whose top ends at the origin.
  dfm_body beam(const char *model, int32_t integrator = DFM_INTEGRATOR_AUTO,
                std::array<double, 3> position = {0, 0, -0.05}) {
    test::BodyOptions o;
    o.name = "beam";
    o.model = model;
    o.young = 2e5;
    o.damping_mass = 20;
    o.damping_stiffness = 1e-3;
    o.position = position;
    o.integrator = integrator;
    return test::make_body(context, w, "beam", {0.05, 0.04, 0.05}, 60, o);
  }
  dfm_obstacle hook(std::array<double, 3> at = {0, 0, 0.05}) {
    dfm_obstacle_def d = dfm_obstacle_def_default();
    d.name = "hook";
    d.shape = DFM_SHAPE_BOX;
    d.half_size[0] = d.half_size[1] = 0.1;
    d.half_size[2] = 0.05;
    for (int k = 0; k < 3; ++k) d.pose.position[k] = at[k];
    dfm_obstacle out = 0;
    test::ok(dfm_obstacle_create(w, &d, &out));
    return out;
  }
  dfm_rigid brick(std::array<double, 3> at, double mass, std::array<double, 3> spin = {0, 0, 0}) {
    dfm_rigid_def d = test::box("brick", {0.1, 0.06, 0.04}, mass, at);
    for (int k = 0; k < 3; ++k) d.spin[k] = spin[k];
    const dfm_rigid_set_def set = {sizeof set, 1, 0, 0, &d, nullptr, nullptr};
    dfm_rigid out = 0;
    test::ok(dfm_rigid_create(w, nullptr, &set, &out));
    return out;
  }
};

// The top of a body, or its bottom.
uint32_t attach(dfm_body body, uint64_t to, bool top = true,
                const std::function<void(dfm_attach_def &)> &with = {}) {
  std::vector<double> x = test::listed(dfm_surface_positions, body, 3);
  double edge = top ? -INFINITY : INFINITY;
  for (size_t i = 2; i < x.size(); i += 3) edge = top ? std::max(edge, x[i]) : std::min(edge, x[i]);
  const double box[] = {-9, -9, edge - 1e-9, 9, 9, edge + 1e-9};
  dfm_attach_def d = dfm_attach_def_default();
  d.to = to;
  d.box = box;
  if (with) with(d);
  uint32_t number = 0;
  test::ok(dfm_body_attach(body, &d, &number));
  return number;
}

dfm_attachment info(dfm_body body, uint32_t number) {
  dfm_attachment a{};
  a.size = sizeof a;
  test::ok(dfm_body_get_attachment(body, number, &a));
  return a;
}

struct Momenta {
  std::array<double, 3> linear{}, angular{};
  void add(const dfm_body_measure &m) {
    for (int k = 0; k < 3; ++k) {
      linear[size_t(k)] += m.momentum[k];
      const int i = (k + 1) % 3, j = (k + 2) % 3;
      angular[size_t(k)] += m.angular[k] + m.com[i] * m.momentum[j] - m.com[j] * m.momentum[i];
    }
  }
};
dfm_body_measure rigid_measure(dfm_rigid r) {
  dfm_body_measure m{};
  m.size = sizeof m;
  test::ok(dfm_rigid_get_measure(r, &m));
  return m;
}

// Cells with a point at this height, where the body has been made.
std::vector<uint32_t> cells_at(dfm_body b, double z) {
  const dfm_body_info i = test::cutting::info(b);
  std::vector<double> rest(3 * size_t{i.npoint});
  std::vector<uint32_t> tets(4 * size_t{i.ntet}), out;
  test::ok(dfm_body_get_rest(b, i.npoint, rest.data(), i.ntet, tets.data()));
  for (uint32_t c = 0; c < i.ntet; ++c)
    if (std::any_of(&tets[4 * size_t{c}], &tets[4 * size_t{c}] + 4,
                    [&](uint32_t p) { return std::fabs(rest[3 * size_t{p} + 2] - z) < 1e-9; }))
      out.push_back(c);
  return out;
}
// Removes them, or separates what lies below a plane from the rest.
void remove_at(dfm_body b, double z) {
  const std::vector<uint32_t> cells = cells_at(b, z);
  ASSERT_FALSE(cells.empty());
  test::ok(dfm_body_remove_cells(b, uint32_t(cells.size()), cells.data(), nullptr));
}
void separate_at(dfm_body b, double z) {
  test::cutting::cut(b, test::cutting::plane(2, z, DFM_CUT_SPLIT));
  dfm_cut_info made = test::cutting::request();
  test::ok(dfm_body_separate(b, nullptr, &made));
  ASSERT_EQ(made.pieces, 1u);
}
dfm_body block(const World &s, const char *name, double z) {
  test::BodyOptions o;
  o.name = name;
  o.model = "corotational_fem";
  o.young = 2e5;
  o.position = {0, 0, z};
  return test::make_body(s.context, s.w, "beam", {0.1, 0.1, 0.1}, 400, o);
}

struct Case {
  const char *model;
  int32_t integrator;
};
constexpr Case kCases[] = {{"msm", DFM_INTEGRATOR_SYMPLECTIC_EULER},
                           {"corotational_fem", DFM_INTEGRATOR_SYMPLECTIC_EULER},
                           {"corotational_fem", DFM_INTEGRATOR_IMPLICIT_EULER},
                           {"linear_fem", DFM_INTEGRATOR_IMPLICIT_EULER},
                           {"shape_matching", DFM_INTEGRATOR_AUTO}};

}  // namespace

// What hangs pulls with its weight, whatever moves it, and stays where it is held.
TEST(Attach, HangingBody_PullsWithItsWeight) {
  for (const Case &c : kCases) {
    SCOPED_TRACE(std::string(c.model) + " " + std::to_string(c.integrator));
    World s;
    const dfm_obstacle hook = s.hook();
    const dfm_body beam = s.beam(c.model, c.integrator);
    const uint32_t held = attach(beam, hook);
    s.run(1.0);
    const dfm_attachment a = info(beam, held);
    const double weight = kG * test::measure(beam).mass;
    EXPECT_EQ(a.to, hook);
    EXPECT_GE(a.nsurfel, 4u);
    EXPECT_NEAR(a.force[2], weight, 2e-3 * weight);
    EXPECT_NEAR(a.force[0], 0, 2e-3 * weight);
    EXPECT_NEAR(a.point[2], 0, 1e-9);
    EXPECT_LT(a.stretch, 1e-9);
    for (const double m : a.moment) EXPECT_NEAR(m, 0, 2e-3 * weight * 0.05);
    EXPECT_NEAR(a.impulse[2], weight * 1.0, 5e-3 * weight);
    EXPECT_TRUE(test::contacts(s.w).empty());
    EXPECT_EQ(test::stats(s.w).unconverged, 0u);
  }
}

// A modal body with more bonds than motions: the motions that hardly move the held points do not throw it.
TEST(Attach, MoreBondsThanModes_StayAtRest) {
  World s;
  test::BodyOptions o;
  o.model = "modal";
  o.young = 1e6;
  const dfm_body ball = test::make_body(s.context, s.w, "ball", {0.2, 0, 0}, 500, o);
  const double box[] = {-1, -1, 0.08, 1, 1, 1};
  const uint32_t held = attach(ball, s.hook({0, 0, 1}), true, [&](dfm_attach_def &d) { d.box = box; });
  s.run(0.3);
  const dfm_body_measure m = test::measure(ball);
  const dfm_attachment a = info(ball, held);
  EXPECT_GT(a.nsurfel, 20u);
  EXPECT_NEAR(a.force[2], kG * m.mass, 0.01 * kG * m.mass);
  for (const double p : m.momentum) EXPECT_NEAR(p, 0, 1e-3 * m.mass);
  EXPECT_LT(a.stretch, 1e-7);
  EXPECT_EQ(test::stats(s.w).unconverged, 0u);
}

// Many bonds share a brick of a ten-thousandth of the body's mass.
TEST(Attach, ALightBrick_HangsOnManyBonds) {
  World s;
  test::BodyOptions o;
  o.young = 1e6;
  o.position = {-0.1, -0.1, 0};
  const dfm_body block = test::make_body(s.context, s.w, "beam", {0.2, 0.2, 0.1}, 1000, o);
  const dfm_rigid brick = s.brick({0, 0, -0.02}, 1e-4);
  const uint32_t top = attach(block, s.hook({0, 0, 0.15})), held = attach(block, brick, false);
  s.run(0.1);
  EXPECT_GT(info(block, held).nsurfel, 40u);
  EXPECT_LT(info(block, held).stretch, 1e-6);
  EXPECT_LT(info(block, top).stretch, 1e-9);
  EXPECT_LT(std::fabs(rigid_measure(brick).momentum[2]), 1e-4 * 0.2);
  EXPECT_EQ(test::stats(s.w).unconverged, 0u);
}

// It goes where the obstacle goes, turned as well.
TEST(Attach, AnObstacle_CarriesItAlong) {
  World s;
  const dfm_obstacle hook = s.hook();
  const dfm_body beam = s.beam("msm");
  const uint32_t held = attach(beam, hook);
  const dfm_attachment before = info(beam, held);
  for (int i = 1; i <= 200; ++i) {
    const double angle = 2e-3 * i, t = 1e-3 * i;
    const dfm_pose to = {{0.2 * t, 0.1 * t, 0.05 + 0.3 * t},
                         {0, 0, std::sin(0.5 * angle), std::cos(0.5 * angle)}};
    test::ok(dfm_obstacle_move_to(hook, &to));
    s.run(1e-3);
    ASSERT_LT(info(beam, held).stretch, 1e-8) << i;
  }
  const dfm_attachment a = info(beam, held);
  const double c = std::cos(0.4), s1 = std::sin(0.4);
  EXPECT_NEAR(a.point[0], 0.04 + c * before.point[0] - s1 * before.point[1], 1e-8);
  EXPECT_NEAR(a.point[1], 0.02 + s1 * before.point[0] + c * before.point[1], 1e-8);
  EXPECT_NEAR(a.point[2], before.point[2] + 0.06, 1e-8);
}

// A brick that turns tears a beam along, and the beam the brick: both momenta stay.
TEST(Attach, ARigidBody_KeepsBothMomentaOfThePair) {
  for (const Case &c : kCases) {
    SCOPED_TRACE(std::string(c.model) + " " + std::to_string(c.integrator));
    World s({0, 0, 0});
    test::BodyOptions o;
    o.model = c.model;
    o.young = 2e5;
    o.position = {0, 0, -0.05};
    o.velocity = {0.3, -0.1, 0.2};
    o.spin = {1, 2, 3};
    o.integrator = c.integrator;
    const dfm_body beam = test::make_body(s.context, s.w, "beam", {0.05, 0.04, 0.05}, 60, o);
    const dfm_rigid brick = s.brick({0.01, 0, 0.02}, 0.2, {3, -2, 4});
    const uint32_t held = attach(beam, brick);
    const auto sum = [&] {
      Momenta m;
      m.add(test::measure(beam));
      m.add(rigid_measure(brick));
      return m;
    };
    const Momenta before = sum();
    // backward Euler takes angular momentum from what turns, attached or not
    const bool angular = c.integrator != DFM_INTEGRATOR_IMPLICIT_EULER;
    for (int i = 0; i < 200; ++i) {
      s.run(1e-3);
      const Momenta now = sum();
      for (size_t k = 0; k < 3; ++k) {
        ASSERT_NEAR(now.linear[k], before.linear[k], 1e-12) << i;
        if (angular) {
          ASSERT_NEAR(now.angular[k], before.angular[k], 1e-12) << i;
        }
      }
    }
    EXPECT_LT(info(beam, held).stretch, 2e-6);
    EXPECT_EQ(test::stats(s.w).unconverged, 0u);
  }
}

// Not at the same points: the upper beam's bottom stands at a distance on the lower one's top.
TEST(Attach, TwoBodies_KeepBothMomenta_AlsoAtADistance) {
  for (const double apart : {0.0, 2e-3}) {
    SCOPED_TRACE(apart);
    World s({0, 0, 0});
    test::BodyOptions o;
    o.young = 2e5;
    o.position = {0, 0, 0};
    o.velocity = {0.2, 0, 0.1};
    o.spin = {0, 3, 1};
    const dfm_body lower = test::make_body(s.context, s.w, "beam", {0.05, 0.04, 0.05}, 60, o);
    o.position = {0.004, 0.003, 0.05 + apart};
    o.velocity = {0, 0, 0};
    o.spin = {2, 0, 0};
    const dfm_body upper = test::make_body(s.context, s.w, "beam", {0.05, 0.04, 0.05}, 90, o);
    const uint32_t held = attach(upper, lower, false);
    const auto sum = [&] {
      Momenta m;
      m.add(test::measure(upper));
      m.add(test::measure(lower));
      return m;
    };
    const Momenta before = sum();
    for (int i = 0; i < 200; ++i) {
      s.run(1e-3);
      const Momenta now = sum();
      for (size_t k = 0; k < 3; ++k) {
        ASSERT_NEAR(now.linear[k], before.linear[k], 1e-13) << i;
        ASSERT_NEAR(now.angular[k], before.angular[k], 1e-10) << i;  // stretch times force
      }
    }
    EXPECT_LT(info(upper, held).stretch, 1e-7);
    EXPECT_EQ(test::stats(s.w).unconverged, 0u);
  }
}

TEST(Attach, AStiffness_IsThatOfTheWhole) {
  for (const int32_t integrator : {DFM_INTEGRATOR_SYMPLECTIC_EULER, DFM_INTEGRATOR_IMPLICIT_EULER}) {
    World s;
    const dfm_obstacle hook = s.hook();
    const dfm_body beam = s.beam("corotational_fem", integrator);
    const uint32_t held = attach(beam, hook, true, [](dfm_attach_def &d) {
      d.stiffness = 200;
      d.damping = 2;
    });
    s.run(2.0);
    const double weight = kG * test::measure(beam).mass;
    EXPECT_NEAR(info(beam, held).force[2], weight, 2e-3 * weight);
    EXPECT_NEAR(-info(beam, held).point[2], weight / 200, 3e-3 * weight / 200);
  }
}

TEST(Attach, ReleaseForce_ReleasesAndReportsAnEvent) {
  World s;
  const dfm_obstacle hook = s.hook();
  const dfm_body beam = s.beam("msm");
  const double weight = kG * test::measure(beam).mass;
  const uint32_t held = attach(beam, hook, true, [&](dfm_attach_def &d) { d.release = 1.5 * weight; });
  s.run(0.3);
  ASSERT_EQ(test::listed(dfm_body_attachments, beam), std::vector<uint32_t>{held});
  EXPECT_TRUE(test::listed(dfm_world_events, s.w).empty());
  const double down[3] = {0, 0, -2 * weight};
  const uint32_t point = 0;
  test::ok(dfm_body_add_load(beam, 1, &point, down, 0, nullptr, nullptr, nullptr));
  s.run(0.3);
  EXPECT_TRUE(test::listed(dfm_body_attachments, beam).empty());
  std::vector<dfm_contact_event> events;
  for (const dfm_contact_event &e : test::listed(dfm_world_events, s.w))
    if (e.kind == uint32_t(DFM_EVENT_RELEASE)) events.push_back(e);
  ASSERT_EQ(events.size(), 1u);
  EXPECT_EQ(events[0].kind, uint32_t(DFM_EVENT_RELEASE));
  EXPECT_EQ(events[0].a, beam);
  EXPECT_EQ(events[0].b, hook);
  EXPECT_EQ(events[0].key, held);
  EXPECT_LT(test::measure(beam).velocity[2], -0.5);
  dfm_attachment a{};
  EXPECT_EQ(dfm_body_get_attachment(beam, held, &a), DFM_E_ARG);
}

// What has come off within a step touches from the next sub-step on: a glued block that falls on a floor
// bounces, however many sub-steps the step has. Where that step is taken back, the glue holds again.
TEST(Attach, Release_LetsTheTwoTouchInTheSameStep) {
  const auto make = [](World &s) {
    const dfm_obstacle floor = test::add_plane(s.w, "floor");
    test::BodyOptions o;
    o.young = 1e6;
    o.damping_mass = 1;
    o.damping_stiffness = 5e-4;
    o.velocity = {0, 0, -1};
    o.integrator = DFM_INTEGRATOR_SYMPLECTIC_EULER;
    const dfm_body block = test::make_body(s.context, s.w, "beam", {0.1, 0.1, 0.1}, 300, o);
    attach(block, floor, false, [](dfm_attach_def &d) { d.release = 1; });
    return block;
  };
  World a, b;
  const dfm_body block = make(a), other = make(b);
  const uint64_t before = dfm_world_hash(b.w);
  const auto stop = [](void *world, dfm_contact_choice *) {
    test::ok(dfm_world_interrupt(*static_cast<dfm_world *>(world)));
  };
  test::ok(dfm_world_set_pre_solve(b.w, stop, &b.w));
  EXPECT_EQ(dfm_world_step(b.w, 0.02, nullptr), DFM_DISCARD);
  EXPECT_EQ(dfm_world_hash(b.w), before);
  EXPECT_EQ(test::listed(dfm_body_attachments, other).size(), 1u);
  test::ok(dfm_world_set_pre_solve(b.w, nullptr, nullptr));
  for (World *const s : {&a, &b}) test::ok(dfm_world_step(s->w, 0.02, nullptr));
  EXPECT_GT(test::stats(a.w).last_substeps, 10u);
  EXPECT_TRUE(test::listed(dfm_body_attachments, block).empty());
  EXPECT_GT(test::lowest(block), -1e-3);
  EXPECT_EQ(dfm_world_hash(a.w), dfm_world_hash(b.w));
}

// What comes off within a step may lie in what held it, and the two are then listed as an overlap. Where the
// step is taken back, they are not.
TEST(Attach, InterruptedAfterARelease_ListsNoOverlap) {
  World s;
  test::add_plane(s.w, "floor", {0, 0, -0.2});
  const dfm_body beam = s.beam("msm", DFM_INTEGRATOR_SYMPLECTIC_EULER);
  attach(beam, s.hook({0, 0, -0.05}), true, [](dfm_attach_def &d) { d.release = 1e-3; });
  test::BodyOptions o;
  o.position = {0, 0.5, -0.2};
  o.integrator = DFM_INTEGRATOR_SYMPLECTIC_EULER;
  test::make_body(s.context, s.w, "beam", {0.05, 0.05, 0.05}, 60, o);
  struct Stop {
    dfm_world w;
    int left;
  } stop{s.w, 100};
  const auto call = [](void *user, dfm_contact_choice *) {
    Stop &at = *static_cast<Stop *>(user);
    if (--at.left == 0) test::ok(dfm_world_interrupt(at.w));
  };
  test::ok(dfm_world_set_pre_solve(s.w, call, &stop));
  const uint64_t before = dfm_world_hash(s.w);
  EXPECT_EQ(dfm_world_step(s.w, 0.02, nullptr), DFM_DISCARD);
  EXPECT_EQ(dfm_world_hash(s.w), before);
  EXPECT_TRUE(test::listed(dfm_world_overlaps, s.w).empty());
  EXPECT_EQ(test::listed(dfm_body_attachments, beam).size(), 1u);
  test::ok(dfm_world_step(s.w, 0.02, nullptr));
  EXPECT_TRUE(test::listed(dfm_body_attachments, beam).empty());
  EXPECT_EQ(test::listed(dfm_world_overlaps, s.w).size(), 1u);
}

// A body that stiffens as it is stretched has as many sub-steps where others come off all the time.
// unsanitized: too slow there; shorter tests run the same code
TEST(Attach, Releases_LeaveTheBoundOfTheStepFollowed) {
  constexpr double kSpan = 0.4;
  constexpr int kPieces = 60;
  uint32_t substeps[2] = {}, planned = 0;
  for (const bool comes_off : {false, true}) {
    World s({0, 0, 0});
    const dfm_vector_key grows[2] = {{0, {0, 0, 0}}, {kSpan, {0, 0, -kG}}};
    test::ok(dfm_world_set_gravity_keys(s.w, 2, grows));
    const dfm_obstacle hook = s.hook();
    const dfm_body beam = s.beam("msm", DFM_INTEGRATOR_SYMPLECTIC_EULER, {1, 0, -0.05});
    std::vector<uint32_t> ends[2];
    const std::vector<double> x = test::points(beam);
    for (size_t i = 0; i < x.size() / 3; ++i) {
      if (x[3 * i + 2] > -1e-9) ends[1].push_back(uint32_t(i));
      if (x[3 * i + 2] < -0.05 + 1e-9) ends[0].push_back(uint32_t(i));
    }
    for (const auto &end : ends) test::ok(dfm_body_hold(beam, uint32_t(end.size()), end.data(), 7));
    const dfm_pose_key up[2] = {{0, {{0, 0, 0}, {0, 0, 0, 1}}}, {kSpan, {{0, 0, 0.05}, {0, 0, 0, 1}}}};
    test::ok(dfm_body_move_held(beam, uint32_t(ends[1].size()), ends[1].data(), 2, up, nullptr));
    for (int i = 0; i < kPieces; ++i) {
      test::BodyOptions o;
      o.young = 1e4;
      o.position = {0, 0.1 * (i + 1), -0.05};
      o.integrator = DFM_INTEGRATOR_SYMPLECTIC_EULER;
      const dfm_body piece = test::make_body(s.context, s.w, "beam", {0.05, 0.05, 0.05}, 5, o);
      const double weight = kG * test::measure(piece).mass;
      attach(piece, hook, true,
             [&](dfm_attach_def &d) { d.release = comes_off ? weight * (i + 1) / (kPieces + 1) : 0; });
    }
    double first = 0;
    test::ok(dfm_world_stable_step(s.w, &first, nullptr, nullptr));
    planned = uint32_t(kSpan / first);
    test::ok(dfm_world_step(s.w, kSpan, nullptr));
    substeps[comes_off] = test::stats(s.w).last_substeps;
  }
  EXPECT_GT(substeps[0], planned + planned / 10);
  EXPECT_EQ(substeps[1], substeps[0]);
}

TEST(Attach, Detach_LetsTheTwoTouchAgain) {
  World s;
  const dfm_obstacle hook = s.hook({0, 0, -0.15});
  const dfm_body beam = s.beam("msm", DFM_INTEGRATOR_AUTO, {0, 0, -0.1});
  const uint32_t held = attach(beam, hook, false);
  s.run(0.3);
  EXPECT_TRUE(test::contacts(s.w).empty());
  const double z = test::measure(beam).com[2];
  test::ok(dfm_body_detach(beam, held));
  s.run(0.3);
  EXPECT_FALSE(test::contacts(s.w).empty());
  EXPECT_NEAR(test::measure(beam).com[2], z, 1e-3);
  EXPECT_EQ(dfm_body_detach(beam, held), DFM_E_ARG);
  const uint32_t again = attach(beam, hook, false, [](dfm_attach_def &d) { d.flags = DFM_ATTACH_TOUCH; });
  s.run(0.1);
  EXPECT_FALSE(test::contacts(s.w).empty());
  EXPECT_LT(info(beam, again).stretch, 1e-8);
}

TEST(Attach, EndedOrTakenAlongByACut_TheOverlapIsFound) {
  for (const bool removed : {true, false}) {
    SCOPED_TRACE(removed);
    World s({0, 0, 0});
    const dfm_body cube = block(s, "cube", 0);
    const test::Triangles box = test::box_surface({0.2, 0.2, 0.025}, 1);
    dfm_obstacle_def d = dfm_obstacle_def_default();
    d.shape = DFM_SHAPE_MESH;
    d.npoint = uint32_t(box.points.size() / 3);
    d.points = box.points.data();
    d.ntriangle = uint32_t(box.tris.size() / 3);
    d.triangles = box.tris.data();
    d.pose.position[2] = 0.005;  // 30 mm of the cube are in it
    dfm_obstacle floor = 0;
    test::ok(dfm_obstacle_create(s.w, &d, &floor));
    attach(cube, floor);
    s.run(1e-3);
    EXPECT_TRUE(test::listed(dfm_world_overlaps, s.w).empty());
    if (removed) remove_at(cube, 0.1);
    else separate_at(cube, 0.0601);
    s.run(1e-3);
    const std::vector<dfm_overlap> found = test::listed(dfm_world_overlaps, s.w);
    ASSERT_EQ(found.size(), 1u);
    EXPECT_EQ(found[0].a, cube);
    EXPECT_TRUE(found[0].flags & DFM_OVERLAP_ASIDE);
  }
}

TEST(Attach, ACutFarFromIt_TakesNoPointOfIt) {
  for (const bool removed : {true, false}) {
    SCOPED_TRACE(removed);
    World s({0, 0, 0});
    const dfm_body lower = block(s, "lower", 0), upper = block(s, "upper", 0.102);
    const uint32_t held = attach(upper, lower, false);
    const uint32_t n = info(upper, held).nsurfel;
    if (removed) remove_at(lower, 0);
    else separate_at(lower, 0.034);
    EXPECT_EQ(info(upper, held).nsurfel, n);
    EXPECT_LT(info(upper, held).stretch, 1e-12) << "its places have not moved";
    dfm_body rest = 0;  // what it lies on pushes at a distance
    if (!removed) test::ok(dfm_world_find_body(s.w, "lower.1", &rest));
    if (rest) test::ok(dfm_body_destroy(rest));
    const double kick[] = {0.01, 0.02, 0}, at[] = {0.05, 0, 0.202};
    test::ok(dfm_body_apply_impulse(upper, at, kick));
    const auto sum = [&] {
      Momenta m;
      for (const dfm_body b : {lower, upper}) m.add(test::measure(b));
      return m;
    };
    const Momenta before = sum();
    s.run(0.05);
    const Momenta now = sum();
    for (size_t k = 0; k < 3; ++k) {
      EXPECT_NEAR(now.linear[k], before.linear[k], 1e-12);
      EXPECT_NEAR(now.angular[k], before.angular[k], 1e-9);
    }
  }
}

// The places may come to lie on two parts (axis 0), or all on a new one (axis 2).
TEST(Attach, WhoseOtherBodyIsParted_StaysOneAndKeepsItsImpulse) {
  for (const int axis : {0, 2}) {
    SCOPED_TRACE(axis);
    World s({0, 0, 0});
    const dfm_body lower = block(s, "lower", 0), upper = block(s, "upper", 0.102);
    const uint32_t held = attach(upper, lower, false);
    const double kick[] = {0, 0, 0.02}, at[] = {0.05, 0.05, 0.202};
    test::ok(dfm_body_apply_impulse(upper, at, kick));
    s.run(0.01);
    const dfm_attachment before = info(upper, held);
    ASSERT_LT(before.impulse[2], -1e-4);
    test::cutting::cut(lower, test::cutting::plane(axis, axis == 2 ? 0.0601 : 0.047, DFM_CUT_SPLIT));
    dfm_cut_info made = test::cutting::request();
    test::ok(dfm_body_separate(lower, nullptr, &made));
    ASSERT_EQ(made.pieces, 1u);
    EXPECT_EQ(test::listed(dfm_body_attachments, upper), std::vector<uint32_t>{held});
    EXPECT_EQ(info(upper, held).impulse[2], before.impulse[2]);
  }
}

TEST(Attach, EitherSide_MayGo) {
  for (const bool body_goes : {true, false}) {
    World s;
    const dfm_obstacle hook = s.hook();
    const dfm_body beam = s.beam("msm");
    test::BodyOptions o;
    o.young = 2e5;
    o.position = {0, 0, -0.1};
    const dfm_body below = test::make_body(s.context, s.w, "beam", {0.05, 0.04, 0.05}, 60, o);
    attach(beam, hook);
    attach(below, beam);
    s.run(0.1);
    EXPECT_LT(std::fabs(test::measure(below).velocity[2]), 0.3);
    if (body_goes) test::ok(dfm_body_destroy(beam));
    else test::ok(dfm_obstacle_destroy(hook));
    size_t released = 0;
    for (const dfm_contact_event &e : test::listed(dfm_world_events, s.w))
      released += e.kind == uint32_t(DFM_EVENT_RELEASE);
    EXPECT_EQ(released, body_goes ? 2u : 1u);
    s.run(0.2);
    EXPECT_LT(test::measure(below).velocity[2], -0.6);  // it falls
  }
}

// Restored in a world that has no attachment it continues with the same bits, and again in its own.
TEST(Attach, Snapshot_ContinuesWithTheSameBits) {
  const auto make = [](World &s, bool with) {
    const dfm_obstacle hook = s.hook();
    const dfm_body beam = s.beam("msm");
    const dfm_rigid brick = s.brick({0, 0, -0.15}, 0.3);
    if (!with) return;
    attach(beam, hook);
    attach(beam, brick, false);
  };
  World a, b;
  make(a, true);
  make(b, false);
  a.run(0.05);
  const std::string kept = test::snapshot(a.w);
  a.run(0.05);
  const uint64_t hash = dfm_world_hash(a.w);
  test::ok(dfm_world_restore(b.w, kept.data(), kept.size()));
  b.run(0.05);
  EXPECT_EQ(dfm_world_hash(b.w), hash);
  test::ok(dfm_world_restore(a.w, kept.data(), kept.size()));
  a.run(0.05);
  EXPECT_EQ(dfm_world_hash(a.w), hash);
}

namespace {

bool is_asleep(dfm_body b) {
  bool is = false;
  test::ok(dfm_body_is_asleep(b, &is));
  return is;
}
// Whether it is asleep in the end.
bool hang_until_asleep(World &s, dfm_body b) {
  test::ok(dfm_world_set_sleep(s.w, true));
  for (int i = 0; i < 400 && !is_asleep(b); ++i) s.run(0.01);
  return is_asleep(b);
}

}  // namespace

TEST(Attach, HangingBody_SleepsAndWakesWithItsSupport) {
  World s;
  const dfm_obstacle hook = s.hook();
  const dfm_body beam = s.beam("msm");
  const uint32_t held = attach(beam, hook);
  ASSERT_TRUE(hang_until_asleep(s, beam));
  const double weight = kG * test::measure(beam).mass;
  const dfm_attachment before = info(beam, held);
  s.run(0.5);
  const dfm_attachment after = info(beam, held);
  EXPECT_NEAR(after.force[2], weight, 1e-2 * weight);
  EXPECT_NEAR(after.impulse[2] - before.impulse[2], 0.5 * weight, 1e-2 * weight);
  const dfm_pose to = {{0.001, 0, 0.05}, {0, 0, 0, 1}};
  test::ok(dfm_obstacle_move_to(hook, &to));
  s.run(1e-3);
  EXPECT_FALSE(is_asleep(beam));
  EXPECT_NEAR(info(beam, held).point[0] - after.point[0], 0.001, 1e-8);
}

// What a cut takes away has borne its part until the cut.
TEST(Attach, ASleeperThatIsCut_KeepsTheImpulseOfItsSleep) {
  World s;
  const dfm_obstacle hook = s.hook();
  const dfm_body beam = s.beam("msm");
  const uint32_t held = attach(beam, hook);
  ASSERT_TRUE(hang_until_asleep(s, beam));
  s.run(0.5);
  const double before = info(beam, held).impulse[2];
  dfm_cut_def cut = dfm_cut_def_default();
  cut.shape = DFM_CUT_BOX;
  cut.how = DFM_CUT_REMOVE;
  cut.half_size[0] = cut.half_size[1] = cut.half_size[2] = 0.011;
  test::ok(dfm_body_cut(beam, &cut, nullptr));
  EXPECT_NEAR(info(beam, held).impulse[2], before, 1e-9 * before);
}

// A step that is given up changes nothing of what is attached.
TEST(Attach, ADiscardedStep_LeavesItAsItWas) {
  const auto make = [](World &s) {
    const dfm_obstacle hook = s.hook();
    const dfm_body beam = s.beam("msm");
    attach(beam, hook, true, [](dfm_attach_def &d) { d.release = 1e4; });
    attach(beam, s.brick({0, 0, -0.15}, 0.3), false);
    s.run(0.05);
    return beam;
  };
  World a, b;
  const dfm_body beam = make(a);
  make(b);
  const dfm_attachment before = info(beam, 1);
  for (int i = 0; i < 3; ++i) {
    test::ok(dfm_world_interrupt(a.w));
    EXPECT_EQ(dfm_world_step(a.w, 1.0 / 60, nullptr), DFM_DISCARD);
  }
  const dfm_attachment after = info(beam, 1);
  EXPECT_EQ(std::memcmp(&before, &after, sizeof before), 0);
  a.run(0.05);
  b.run(0.05);
  EXPECT_EQ(dfm_world_hash(a.w), dfm_world_hash(b.w));
}

// A body held above and pressed on a floor below is one problem: both loads balance the weight.
TEST(Attach, PressedOnAFloor_HolderAndFloorShareTheLoad) {
  for (const Case &c : {kCases[0], kCases[2]}) {
    SCOPED_TRACE(std::string(c.model) + " " + std::to_string(c.integrator));
    World s;
    const dfm_obstacle hook = s.hook();
    test::add_plane(s.w, "floor", {0, 0, -0.0502});
    const dfm_body beam = s.beam(c.model, c.integrator);
    const uint32_t held = attach(beam, hook);
    for (int i = 1; i <= 500; ++i) {
      const dfm_pose to = {{0, 0, 0.05 - 0.002 * std::min(i, 200) / 200}, {0, 0, 0, 1}};
      test::ok(dfm_obstacle_move_to(hook, &to));
      s.run(1e-3);
    }
    s.run(0.5);
    double floor = 0;
    for (const dfm_contact &k : test::contacts(s.w)) floor += k.fn;
    const double weight = kG * test::measure(beam).mass, pull = info(beam, held).force[2];
    EXPECT_GT(floor, 2 * weight);  // 1.8 mm shorter: pressed
    EXPECT_NEAR(pull + floor, weight, 5e-3 * floor);
    EXPECT_LT(info(beam, held).stretch, 1e-7);
    EXPECT_EQ(test::stats(s.w).guard_cuts, 0u);
  }
}

// The balance is the one of the same body held by its points.
TEST(Attach, Equilibrium_IsThatOfHeldPoints) {
  World s, t;
  const dfm_obstacle hook = s.hook();
  const dfm_body beam = s.beam("corotational_fem"), fixed = t.beam("corotational_fem");
  const uint32_t number = attach(beam, hook);
  const double middle = test::measure(fixed).com[2];
  const std::vector<double> x = test::listed(dfm_surface_positions, fixed, 3);
  const std::vector<uint32_t> points = test::listed(dfm_surface_points, fixed);
  double top = -1;
  for (size_t i = 2; i < x.size(); i += 3) top = std::max(top, x[i]);
  for (uint32_t i = 0; i < points.size(); ++i)
    if (x[3 * i + 2] > top - 1e-9) test::ok(dfm_body_hold(fixed, 1, &points[i], 7));
  test::ok(dfm_world_equilibrium(s.w, nullptr, nullptr));
  test::ok(dfm_world_equilibrium(t.w, nullptr, nullptr));
  const double sag = middle - test::measure(fixed).com[2];
  EXPECT_GT(sag, 1e-5);
  EXPECT_NEAR(middle - test::measure(beam).com[2], sag, 1e-4 * sag);
  dfm_attachment found{};
  found.size = sizeof found;
  test::ok(dfm_body_get_attachment(beam, number, &found));
  EXPECT_NEAR(found.force[2], test::measure(beam).mass * kG, 1e-3);
  EXPECT_EQ(found.impulse[2], 0);  // no time has passed
}

TEST(Attach, WhatDoesNotFit_IsRefused) {
  World s, other;
  const dfm_obstacle hook = s.hook(), theirs = other.hook();
  const dfm_body beam = s.beam("msm");
  const auto refuse = [&](dfm_status status, std::initializer_list<const char *> said, auto change) {
    dfm_attach_def d = dfm_attach_def_default();
    const uint32_t surfel = 0;
    d.to = hook;
    d.nsurfel = 1;
    d.surfels = &surfel;
    change(d);
    EXPECT_EQ(dfm_body_attach(beam, &d, nullptr), status);
    test::says(said);
  };
  const uint32_t far = 99999;
  const double nowhere[] = {5, 5, 5, 6, 6, 6};
  refuse(DFM_E_ARG, {"itself"}, [&](auto &d) { d.to = beam; });
  refuse(DFM_E_HANDLE, {"another world"}, [&](auto &d) { d.to = theirs; });
  refuse(DFM_E_HANDLE, {}, [&](auto &d) { d.to = 0; });
  refuse(DFM_E_ARG, {"surfel 99999"}, [&](auto &d) { d.surfels = &far; });
  refuse(DFM_E_ARG, {"point 99999"}, [&](auto &d) {
    d.points = &far;
    d.npoint = 1;
  });
  refuse(DFM_E_ARG, {"none"}, [&](auto &d) {
    d.nsurfel = 0;
    d.box = nowhere;
  });
  refuse(DFM_E_ARG, {"max_distance", "obstacle"}, [&](auto &d) { d.max_distance = 1; });
  refuse(DFM_E_ARG, {"no group 'lid'"}, [&](auto &d) { d.group = "lid"; });
  refuse(DFM_E_ARG, {"positive"}, [&](auto &d) { d.stiffness = -1; });
  refuse(DFM_E_ARG, {"positive"}, [&](auto &d) { d.release = NAN; });
  refuse(DFM_E_ARG, {"0x4"}, [&](auto &d) { d.flags = 4; });
  refuse(DFM_E_ARG, {"dfm_attach_def_default"}, [&](auto &d) { d.cookie = 0; });
  EXPECT_EQ(dfm_body_attach(beam, nullptr, nullptr), DFM_E_ARG);
  uint32_t n = 1;
  test::ok(dfm_body_attachments(beam, 0, nullptr, &n));
  EXPECT_EQ(n, 0u);
}
