// Balls on inclines and skidding balls against rigid rolling. A polyhedron loses a little at every edge: 5 %,
// on about 1,000 facets. reference/contact/tables/{rolling_incline,skid_to_roll}.csv (solid sphere).
#include "support.h"
#include "world.h"

namespace {

constexpr double kG = 9.81, kR = 0.1;
double radians(double deg) { return deg * 3.14159265358979323846 / 180; }

struct Ball {
  test::Context context;
  dfm_world world;
  dfm_body body;
  Ball(double mu, std::array<double, 3> gravity, std::array<double, 3> velocity = {}) {
    world = test::make_world(context, gravity);
    test::BodyOptions o;
    o.young = 1e6;
    o.damping_stiffness = 2e-5;
    o.volume = 1;
    o.velocity = velocity;
    // turned by 37 degrees about (1 2 3), so that it starts on no face, edge or corner in particular
    o.rotation = {0.0848, 0.1696, 0.2544, 0.9483};
    o.position = {0, 0, 0.0995};
    body = test::make_body(context, world, "ball", {kR, 0, 0}, 8000, o);
    test::add_plane(world, "incline");
    test::set_friction(world, mu);
  }
  double speed() { return test::measure(body).velocity[0]; }
  double turning() {  // R omega about y
    const dfm_body_measure m = test::measure(body);
    return m.angular[1] / (0.4 * m.mass * kR * kR) * kR;
  }
};

struct Row { double theta_deg, mu, a, r_alpha; };

// Slopes of speed and of R omega over 0.4 s, by least squares: a polyhedron's turning is uneven
// from edge to edge.
void compare(const Row &row) {
  const double theta = radians(row.theta_deg);
  Ball ball(row.mu, {kG * std::sin(theta), 0, -kG * std::cos(theta)});
  test::run(ball.world, 0.1, 2e-4);
  constexpr int kSamples = 100;
  double tt = 0, tv = 0, tw = 0;
  for (int i = 0; i < kSamples; ++i) {
    const double t = (i - 0.5 * (kSamples - 1)) * 4e-3;
    tt += t * t;
    tv += t * ball.speed();
    tw += t * ball.turning();
    test::run(ball.world, 4e-3, 2e-4);
  }
  EXPECT_NEAR(tv / tt, row.a, 0.05 * row.a) << row.theta_deg << " degrees, mu " << row.mu;
  EXPECT_NEAR(tw / tt, row.r_alpha, 0.05 * row.a) << row.theta_deg << " degrees, mu " << row.mu;
}

}  // namespace

TEST(BallOnIncline, RollsOrSlips_AsARigidSphereDoes) {
  const auto table = test::read_csv(test::reference_dir() + "/contact/tables/rolling_incline.csv");
  int compared = 0;
  for (size_t i = 1; i < table.size(); ++i) {
    const auto &c = table[i];
    if (c.size() < 7 || c[0] != "solid sphere") continue;
    const Row row{std::stod(c[1]), std::stod(c[2]), std::stod(c[5]), std::stod(c[6])};
    // below 10 degrees the facets hold the ball back; mu 0 is the frictionless test of the scene
    if (row.theta_deg < 9 || row.theta_deg > 36 || (row.mu != 0.1 && row.mu != 0.3)) continue;
    compare(row);
    ++compared;
  }
  EXPECT_GE(compared, 12);
}

// Thrown along a plane without spin: skids with mu g, and rolls at 5/7 of the start speed from t = 2
// v0/(7 mu g) on.
TEST(BallOnPlane, ThrownWithoutSpin_RollsAtFiveSeventhsOfItsSpeed) {
  for (const auto &[v0, mu] : {std::pair{1.0, 0.1}, {3.0, 0.3}}) {
    Ball ball(mu, {0, 0, -kG}, {v0, 0, 0});
    const double skid = 2 * v0 / (7 * mu * kG);
    test::run(ball.world, skid / 2, 2e-4);
    EXPECT_NEAR(ball.speed(), v0 - mu * kG * skid / 2, 0.05 * v0);
    test::run(ball.world, skid / 2 + 0.05, 2e-4);
    EXPECT_NEAR(ball.speed(), 5.0 / 7 * v0, 0.05 * v0);
    EXPECT_NEAR(ball.turning(), 5.0 / 7 * v0, 0.05 * v0);
  }
}
