// What the report says adds up: contacts to pairs, pairs to the change of momentum of the bodies, friction
// work to the energy that is lost.
#include "zoned.h"

namespace {

constexpr double kG = 9.81;
using Vector = std::array<double, 3>;
Vector cross(const double *a, const double *b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

struct Wrench { double force[3], moment[3]; };
Wrench wrench(dfm_world w, uint64_t a, uint64_t b, const double point[3]) {
  Wrench out{};
  test::ok(dfm_world_pair_wrench(w, a, b, point, out.force, out.moment));
  return out;
}

// A turning cube slides on a floor with a ball on its back.
struct Pile {
  test::Context context;
  dfm_world world;
  dfm_body cube, ball;
  dfm_obstacle floor;
  Pile() {
    world = test::make_world(context);
    test::BodyOptions a, b;
    a.name = "cube";
    a.young = 2e5;
    a.velocity = {0.8, 0.1, 0};
    a.position = {-0.05, -0.05, 2e-5};
    a.spin = {0, 0, 3};
    a.damping_stiffness = 1e-3;
    b.name = "ball";
    b.young = 1e5;
    b.velocity = {0.5, 0, -0.2};
    b.density = 700;
    b.position = {0.01, 0, 0.141};
    b.damping_stiffness = 1e-3;
    cube = test::make_body(context, world, "beam", {0.1, 0.1, 0.1}, 60, a);
    ball = test::make_body(context, world, "ball", {0.04, 0, 0}, 300, b);
    floor = test::add_plane(world, "floor");
    test::set_friction(world, 0.4);
  }
};

}  // namespace

TEST(Report, PairsOfEveryStep_SumToTheChangeOfMomentum) {
  Pile s;
  const double h = 5e-5, origin[3] = {0.3, -0.2, 0.1};
  double scale = 0;
  int both = 0;
  for (int k = 0; k < 2000; ++k) {
    const dfm_body bodies[2] = {s.cube, s.ball};
    const dfm_body_measure before[2] = {test::measure(s.cube), test::measure(s.ball)};
    test::run(s.world, h, h);
    ASSERT_EQ(test::stats(s.world).last_substeps, 1u);
    const Wrench cube_floor = wrench(s.world, s.cube, s.floor, origin);
    const Wrench ball_floor = wrench(s.world, s.ball, s.floor, origin);
    const Wrench ball_cube = wrench(s.world, s.ball, s.cube, origin);
    const Wrench back = wrench(s.world, s.cube, s.ball, origin);
    both += ball_cube.force[2] > 0 && cube_floor.force[2] > 0;
    for (int i = 0; i < 3; ++i) {
      EXPECT_EQ(back.force[i], -ball_cube.force[i]);
      EXPECT_EQ(back.moment[i], -ball_cube.moment[i]);
      scale = std::max(scale, h * std::fabs(cube_floor.force[i]));
    }
    for (int b = 0; b < 2; ++b) {
      const dfm_body_measure after = test::measure(bodies[b]);
      const Wrench &on_floor = b ? ball_floor : cube_floor, &other = b ? ball_cube : back;
      const double weight[3] = {0, 0, -before[b].mass * kG};
      double arm0[3], arm1[3], friction = 0;
      for (int i = 0; i < 3; ++i) {
        arm0[i] = before[b].com[i] - origin[i];
        arm1[i] = after.com[i] - origin[i];
      }
      const Vector l0 = cross(arm0, before[b].momentum);
      const Vector l1 = cross(arm1, after.momentum);
      const Vector lw = cross(arm0, weight);
      for (int i = 0; i < 3; ++i) {
        const double push = h * (on_floor.force[i] + other.force[i] + weight[i]);
        EXPECT_NEAR(after.momentum[i] - before[b].momentum[i], push,
                    1e-13 * (1 + std::fabs(before[b].momentum[i])))
            << "step " << k;
        friction += std::fabs(on_floor.force[i]) + std::fabs(other.force[i]);
      }
      // The report's point lies midway between two surfaces d_c apart (some 5e-5 m here), and forces move
      // points within the step: hence the arm.
      for (int i = 0; i < 3; ++i) {
        const size_t j = size_t(i);
        const double turn = h * (on_floor.moment[i] + other.moment[i] + lw[j]);
        const double change = after.angular[i] + l1[j] - before[b].angular[i] - l0[j];
        EXPECT_NEAR(change, turn, h * friction * 1e-4 + 1e-13) << "step " << k << " body " << b;
      }
    }
  }
  EXPECT_GT(scale, 1e-4);
  EXPECT_GT(both, 50);
}

TEST(Report, ContactsOfAPair_SumToItsForces) {
  Pile s;
  test::run(s.world, 0.05, 1e-3);
  int pairs_seen = 0;
  for (int k = 0; k < 50; ++k) {
    test::run(s.world, 1e-3, 1e-3);
    uint32_t n = 0;
    dfm_pair_report pairs[4] = {};
    test::ok(dfm_world_pairs(s.world, 4, pairs, &n));
    const std::vector<dfm_contact> contacts = test::contacts(s.world);
    uint32_t counted = 0;
    for (uint32_t p = 0; p < n; ++p) {
      const dfm_pair_report &pair = pairs[p];
      double force[3] = {}, friction[3] = {}, normal = 0, slip = 0;
      uint32_t count = 0;
      for (const dfm_contact &c : contacts) {
        const uint64_t b = c.body_b ? c.body_b : s.floor;
        const bool straight = c.body_a == pair.a && b == pair.b, turned = c.body_a == pair.b && b == pair.a;
        if (!straight && !turned) continue;
        ++count;
        normal += c.fn;
        const Vector second = cross(c.normal, c.tangent);
        for (int i = 0; i < 3; ++i) {
          const double ft = (turned ? -1 : 1) * (c.ft[0] * c.tangent[i] + c.ft[1] * second[size_t(i)]);
          friction[i] += ft;
          force[i] += ft + (turned ? -1 : 1) * c.fn * c.normal[i];
        }
        if (c.fn > 0) slip = std::max(slip, std::hypot(c.slip[0], c.slip[1]));
      }
      const double near = 1e-12 * (1 + normal);
      EXPECT_EQ(count, pair.count);
      EXPECT_NEAR(normal, pair.normal, near);
      EXPECT_NEAR(slip, pair.slip_max, 1e-15);
      for (int i = 0; i < 3; ++i) {
        EXPECT_NEAR(force[i], pair.force[i], near);
        EXPECT_NEAR(friction[i], pair.friction[i], near);
      }
      double com[3];
      const dfm_body_measure m = test::measure(pair.a == s.cube ? s.cube : s.ball);
      // pair.moment is about the center as it was at the start of the last sub-step, when the contact
      // points were there
      for (int i = 0; i < 3; ++i)
        com[i] = m.com[i] - 1e-3 / test::stats(s.world).last_substeps * m.velocity[i];
      const Wrench about = wrench(s.world, pair.a, pair.b, com);
      for (int i = 0; i < 3; ++i) EXPECT_NEAR(about.moment[i], pair.moment[i], near);
      counted += count;
      ++pairs_seen;
    }
    EXPECT_EQ(counted, contacts.size());
  }
  EXPECT_GT(pairs_seen, 50);
}

TEST(Report, FrictionWork_IsTheEnergyThatSlidingLoses) {
  // A settled stiff block slides from 2 m/s down to about 1. What it loses beyond the work of friction went
  // into its own damping and into the step, p W p / 2 each time, which falls with the step.
  double missing[2];
  for (int half = 0; half < 2; ++half) {
    const double h = half ? 1e-4 : 2e-4;
    test::Context context;
    const dfm_world world = test::make_world(context);
    test::BodyOptions o;
    o.young = 1e6;
    o.damping_stiffness = 1e-3;
    o.position = {-0.05, -0.05, 2e-5};
    const dfm_body body = test::make_body(context, world, "beam", {0.1, 0.1, 0.1}, 96, o);
    test::add_plane(world, "floor");
    test::set_friction(world, 0.5);
    test::run(world, 0.3, h);
    uint32_t n = 0;
    test::ok(dfm_body_get_state(body, 0, nullptr, nullptr, &n));
    std::vector<double> x(3 * n), v(3 * n);
    test::ok(dfm_body_get_state(body, n, x.data(), v.data(), &n));
    for (uint32_t i = 0; i < n; ++i) v[3 * i] += 2;
    test::ok(dfm_body_set_state(body, n, x.data(), v.data()));
    test::run(world, 0.05, h);
    dfm_pair_report pair{};
    const auto energy = [&] {
      const dfm_body_measure m = test::measure(body);
      return m.kinetic + m.elastic + m.mass * kG * m.com[2];
    };
    test::ok(dfm_world_pairs(world, 1, &pair, &n));
    const double e0 = energy(), w0 = pair.friction_work;
    test::run(world, 0.15, h);
    test::ok(dfm_world_pairs(world, 1, &pair, &n));
    ASSERT_EQ(n, 1u);
    const double lost = e0 - energy(), work = pair.friction_work - w0;
    EXPECT_LT(work, -0.5) << "J";
    missing[half] = (lost + work) / lost;
    EXPECT_GT(missing[half], -1e-4) << "no energy from nowhere";
  }
  EXPECT_LT(missing[0], 1e-3);
  EXPECT_LT(missing[1], missing[0]);
}
