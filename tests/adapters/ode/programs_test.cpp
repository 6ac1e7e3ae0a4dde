// The example programs beside an ODE world: what they print is what physics says.
#include <gtest/gtest.h>

#include <cstdio>

#include "support.h"

namespace {

test::CommandResult example(const std::string &name) {
  return test::run({"/usr/bin/env", std::string("DEFORM_PLUGIN_PATH=") + DEFORM_PLUGIN_DIR,
                    std::string(DEFORM_BINARY_DIR) + "/bin/example_ode_" + name});
}

}  // namespace

TEST(OdePrograms, Gripper_LiftsTheBallAndHoldsIt) {
  const test::CommandResult r = example("gripper");
  ASSERT_EQ(r.exit_code, 0) << r.out << r.err;
  double mass = 0, height = 0, slip = 1e9;
  const char *const form =
      "the ball of %lf kg is %lf m above the floor and slips by %lf micrometers per second";
  ASSERT_EQ(std::sscanf(r.out.c_str(), form, &mass, &height, &slip), 3) << r.out;
  EXPECT_NEAR(mass, 0.1, 0.005);
  EXPECT_NEAR(height, 0.05 + 0.1, 0.015);
  EXPECT_LT(slip, 1);
}

// unsanitized: too slow there; shorter tests run the same code
TEST(OdePrograms, Cart_DrivesOverTheBumpAndStandsOnItsTires) {
  const test::CommandResult r = example("cart");
  ASSERT_EQ(r.exit_code, 0) << r.out << r.err;
  const size_t at = r.out.find("t 2.5 s: "), sum = r.out.find("the tyres carry ");
  ASSERT_TRUE(at != std::string::npos && sum != std::string::npos) << r.out;
  double x = 0, z = 0, crate = 0, carried = 0, weight = 0;
  ASSERT_EQ(std::sscanf(r.out.c_str() + at, "t 2.5 s: chassis at %lf m, %lf m high, crate at %lf m on it", &x,
                        &z, &crate),
            3)
      << r.out;
  ASSERT_EQ(std::sscanf(r.out.c_str() + sum, "the tyres carry %lf N of %lf N", &carried, &weight), 2)
      << r.out;
  EXPECT_GT(x, 1.3);
  EXPECT_NEAR(z, 0.138, 0.01);
  EXPECT_NEAR(crate, -0.1, 0.02);
  EXPECT_NEAR(carried, weight, 0.03 * weight);
}
