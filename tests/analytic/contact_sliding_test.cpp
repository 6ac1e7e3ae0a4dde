// A soft block slides on planes and belts: stopping distance, conveyor, friction across a slope. The answers
// are those of a point mass under Coulomb friction; the block is stiff and damped, so that it differs from
// one by its shear alone. Source: reference/contact (sliding_stop, conveyor, oblique_incline);
// verification F2, F4.
#include "world.h"

namespace {

constexpr double kG = 9.81;
double radians(double deg) { return deg * 3.14159265358979323846 / 180; }

// A cube of edge 0.1 m settled on a plane, then given one velocity at all of its points.
struct Slider {
  test::Context context;
  dfm_world world;
  dfm_body body;

  Slider(double mu, std::array<double, 3> gravity, std::array<double, 3> velocity) {
    world = test::make_world(context, {0, 0, gravity[2]});
    test::BodyOptions o;
    o.name = "block";
    o.young = 1e6;
    o.damping_stiffness = 1e-3;
    o.position = {-0.05, -0.05, 2e-5};
    body = test::make_body(context, world, "beam", {0.1, 0.1, 0.1}, 60, o);
    test::add_plane(world, "floor");
    test::set_friction(world, mu);
    test::run(world, 0.2, 1e-3);
    test::ok(dfm_world_set_gravity(world, gravity.data()));
    test::set_velocity(body, velocity);
  }
  dfm_body_measure now() const { return test::measure(body); }
};

}  // namespace

TEST(Sliding, BlockWithSpeed_StopsAfterV2Over2MuG) {
  for (const auto &[v0, mu] : {std::pair{1.0, 0.3}, {0.5, 0.8}}) {
    Slider s(mu, {0, 0, -kG}, {v0, 0, 0});
    const double x0 = s.now().com[0], distance = v0 * v0 / (2 * mu * kG), time = v0 / (mu * kG);
    double stopped = NAN, before = v0;
    for (int k = 1; k * 1e-3 < time + 0.1; ++k) {
      test::run(s.world, 1e-3, 1e-3);
      const double v = s.now().velocity[0];
      // where the chord between two states crosses zero
      if (std::isnan(stopped) && v <= 0) stopped = (k - v / (v - before)) * 1e-3;
      before = v;
    }
    EXPECT_NEAR(s.now().com[0] - x0, distance, 0.02 * distance) << "v0 " << v0 << ", mu " << mu;
    EXPECT_NEAR(stopped, time, 0.02 * time) << "v0 " << v0 << ", mu " << mu;
    test::run(s.world, 0.3, 1e-3);  // what was sheared swings out
    EXPECT_LT(std::fabs(s.now().velocity[0]), 1e-6);
  }
}

// Seen from the belt, a block set down on it is a block that stops.
TEST(Sliding, BlockOnBelt_TakesItsSpeedAfterVOverMuG) {
  constexpr double mu = 0.3, speed = 1;
  test::Context context;
  const dfm_world world = test::make_world(context, {0, 0, -kG});
  test::BodyOptions o;
  o.name = "block";
  o.young = 1e6;
  o.damping_stiffness = 1e-3;
  o.position = {-0.05, -0.05, 2e-5};
  const dfm_body body = test::make_body(context, world, "beam", {0.1, 0.1, 0.1}, 60, o);
  dfm_obstacle_def belt = dfm_obstacle_def_default();
  belt.name = "belt";
  belt.velocity_surface[1] = -speed;
  dfm_obstacle plane = 0;
  test::ok(dfm_obstacle_create(world, &belt, &plane));
  test::set_friction(world, mu);
  const double time = speed / (mu * kG);
  test::run(world, 0.1, 1e-3);  // settles while it is pulled: what it gains here counts
  const double early = test::measure(body).velocity[1];
  EXPECT_NEAR(early, -mu * kG * 0.1, 0.02 * mu * kG * 0.1);
  double met = NAN;
  for (int k = 101; k * 1e-3 < time + 0.1; ++k) {
    test::run(world, 1e-3, 1e-3);
    if (std::isnan(met) && test::measure(body).velocity[1] <= -speed) met = k * 1e-3;
  }
  EXPECT_NEAR(met, time, 0.02 * time);
  test::run(world, 0.5, 1e-3);
  EXPECT_NEAR(test::measure(body).velocity[1], -speed, 1e-4);
  EXPECT_NEAR(test::measure(body).com[1], -speed * (test::stats(world).time - 0.5 * time), 0.02);
}

// Friction opposes the slip as a vector. Started across a slope with tan(theta) = mu the block turns
// downhill: friction takes from the speed what gravity adds along the slope, so that speed and downhill speed
// keep the sum v0 and both tend to v0 / 2.
TEST(Sliding, StartAcrossTheSlope_TurnsDownhillAsAVector) {
  const double theta = radians(20), mu = 0.363970234266, v0 = 1;
  Slider s(mu, {0, -kG * std::sin(theta), -kG * std::cos(theta)}, {v0, 0, 0});
  struct Row { double t, x, y; };  // oblique_incline: across, down; v' = g sin(theta) (e_down - v / |v|)
  const Row table[] = {{0.1, 0.672306224536, 0.274002170225},
                       {0.2, 0.398004889553, 0.420796053946},
                       {0.3, 0.215179714548, 0.476848845224}};
  for (const Row &r : table) {
    test::run(s.world, 0.1, 1e-3);
    const dfm_body_measure m = s.now();
    EXPECT_NEAR(m.velocity[0], r.x, 0.01 * v0) << r.t << " s";
    EXPECT_NEAR(-m.velocity[1], r.y, 0.01 * v0) << r.t << " s";
    EXPECT_NEAR(std::hypot(m.velocity[0], m.velocity[1]) - m.velocity[1], v0, 0.01 * v0) << r.t << " s";
  }
}

// On a turntable a block stays where it is while r < mu g / w^2: all contacts stick, and none creeps along
// the tangent of its circle.
TEST(Sliding, BlockOnTurntable_TurnsWithIt) {
  constexpr double kSpin = 4, kRadius = 0.1;  // rad/s, m; mu g / w^2 = 0.31 m
  test::Context context;
  const dfm_world world = test::make_world(context, {0, 0, -kG});
  std::vector<dfm_pose_key> keys;
  for (int i = 0; i <= 300; ++i) {  // turns ever faster for a second, then at kSpin
    const double t = i * 0.01, half = 0.5 * kSpin * (t < 1 ? 0.5 * t * t : t - 0.5);
    keys.push_back({t, {{0, 0, 0}, {0, 0, std::sin(half), std::cos(half)}}});
  }
  dfm_obstacle_def d = dfm_obstacle_def_default();
  d.name = "table";
  d.keys = keys.data();
  d.nkey = static_cast<uint32_t>(keys.size());
  dfm_obstacle table = 0;
  test::ok(dfm_obstacle_create(world, &d, &table));
  test::BodyOptions o;
  o.name = "block";
  o.young = 1e6;
  o.damping_stiffness = 1e-3;
  o.position = {kRadius - 0.05, -0.05, 2e-5};
  const dfm_body body = test::make_body(context, world, "beam", {0.1, 0.1, 0.1}, 60, o);
  test::set_friction(world, 0.5);
  test::run(world, 2, 1e-3);
  const dfm_body_measure before = test::measure(body);
  test::ok(dfm_world_hold_begin(world));
  test::run(world, 0.9, 1e-3);
  const dfm_body_measure after = test::measure(body);
  const double r0 = std::hypot(before.com[0], before.com[1]), r1 = std::hypot(after.com[0], after.com[1]);
  EXPECT_NEAR(r1, r0, 2e-6);
  EXPECT_NEAR(std::hypot(after.velocity[0], after.velocity[1]), kSpin * r1, 1e-3 * kSpin * r1);
  EXPECT_EQ(test::stats(world).sticking, test::stats(world).contacts);
  double creep = NAN;
  uint32_t held = 0;
  test::ok(dfm_world_hold(world, &creep, &held));
  EXPECT_EQ(held, test::stats(world).contacts);
  EXPECT_LT(creep, 1e-6) << "m/s";
}
