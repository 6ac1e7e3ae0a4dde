// The model linear_fem in a world: by its short name, at rest under any pose, swinging alike in every frame.
#include "logged_context.h"
#include "world.h"

namespace {

struct Bar {
  test::Context context;
  dfm_world world;
  dfm_body body;
  explicit Bar(std::array<double, 3> gravity, std::array<double, 4> turn = {0, 0, 0, 1},
               std::array<double, 3> at = {}) {
    world = test::make_world(context, gravity);
    test::BodyOptions o;
    o.model = "linear_fem";
    o.position = at;
    o.rotation = turn;
    body = test::make_body(context, world, "beam", {0.4, 0.1, 0.1}, 60, o);
  }
  ~Bar() { dfm_world_destroy(world); }
};

const double kHalf = std::sqrt(0.5);

TEST(LinearFemWorld, FreeBodyUnderAnyPose_StaysAtRest) {
  Bar bar({0, 0, 0}, {0, 0, kHalf, kHalf}, {2, -1, 3});
  test::run(bar.world, 0.1, 1e-3);
  const dfm_body_measure m = test::measure(bar.body);
  EXPECT_LT(m.speed_max, 1e-12);  // rounding of positions of 3 m
  EXPECT_LT(m.elastic, 1e-20);
}

// Held at one end it swings under gravity; turned together with gravity it does so in the turned frame.
TEST(LinearFemWorld, SwingTurnedWithGravity_IsTheTurnedSwing) {
  const auto swing = [](std::array<double, 3> gravity, std::array<double, 4> turn) {
    Bar bar(gravity, turn);
    const std::vector<double> rest = [&] {
      uint32_t n = 0;
      test::ok(dfm_body_get_state(bar.body, 0, nullptr, nullptr, &n));
      std::vector<double> x(3 * size_t(n));
      test::ok(dfm_body_get_rest(bar.body, n, x.data(), 0, nullptr));
      return x;
    }();
    std::vector<uint32_t> held;
    double least = 1e300;
    for (size_t i = 0; i < rest.size(); i += 3) least = std::min(least, rest[i]);
    for (size_t i = 0; i < rest.size(); i += 3)
      if (rest[i] < least + 1e-9) held.push_back(uint32_t(i / 3));
    test::ok(dfm_body_hold(bar.body, uint32_t(held.size()), held.data(), 7));
    test::run(bar.world, 0.1, 1e-3);
    return test::measure(bar.body);
  };
  const dfm_body_measure a = swing({0, -9.81, 0}, {0, 0, 0, 1}),
                         b = swing({9.81, 0, 0}, {0, 0, kHalf, kHalf});
  EXPECT_GT(a.elastic, 1e-3);
  EXPECT_NEAR(a.elastic / b.elastic, 1, 1e-10);
  EXPECT_NEAR(a.velocity[1], -b.velocity[0], 1e-10 * std::abs(a.velocity[1]));
}

// What turns swells: told with body, cell and turn when its energy is asked for, and once more where it is
// much worse. A body that tumbles goes on to 90 degrees, where the tangent has no bound.
TEST(LinearFemWorld, BodyThatTurns_ReportsThatItLeavesItsRange) {
  test::LoggedContext logged;
  const dfm_world world = test::make_world(logged.context, {0, 0, 0});
  test::BodyOptions o;
  o.name = "top";
  o.model = "linear_fem";
  o.young = 1e4;
  const dfm_body top = test::make_body(logged.context, world, "ball", {0.1}, 100, o);
  const std::vector<double> rest = test::State(top).x;
  const uint32_t n = uint32_t(rest.size() / 3);
  const auto reported = [&](double tangent) {
    std::vector<double> x = rest;
    for (size_t i = 0; i < x.size(); i += 3) {
      x[i] -= tangent * rest[i + 1];
      x[i + 1] += tangent * rest[i];
    }
    test::ok(dfm_body_set_state(top, n, x.data(), nullptr));
    logged.log.clear();
    test::measure(top);
    return logged.log;
  };
  EXPECT_EQ(reported(0.2), "");
  const std::string first = reported(0.3057);
  for (const char *part : {"body 'top': org.deform.linear_fem: cell ", "turned by 17 degrees",
                           "strained by 0 %", "swells", "corotational_fem"})
    EXPECT_NE(first.find(part), std::string::npos) << part << "\n" << first;
  EXPECT_EQ(reported(0.4), "") << "told already";
  EXPECT_EQ(reported(1), "") << "worse, but not by much";
  EXPECT_NE(reported(2).find("turned by 63 degrees"), std::string::npos);
  for (const double tangent : {10, 100, 1000}) EXPECT_EQ(reported(tangent), "") << tangent;
}

}  // namespace
