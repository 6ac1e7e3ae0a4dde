// The example programs: each runs, and prints what physics says.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <iterator>
#include <sstream>

#include "support.h"

namespace {

test::CommandResult example(const std::string &name, const std::vector<std::string> &args = {}) {
  const std::string plugins = std::string("DEFORM_PLUGIN_PATH=") + DEFORM_PLUGIN_DIR;
  std::vector<std::string> line{"/usr/bin/env", plugins,
                                std::string(DEFORM_BINARY_DIR) + "/bin/example_" + name};
  line.insert(line.end(), args.begin(), args.end());
  return test::run(line);
}

}  // namespace

TEST(CProgram, Hello_PrintsBallsThatPressOnTheFloorAndOnEachOther) {
  const test::CommandResult r = example("01_hello");
  ASSERT_EQ(r.exit_code, 0) << r.out << r.err;
  std::istringstream lines(r.out);
  int on_floor = 0, on_ball = 0;
  for (std::string line; std::getline(lines, line);) {
    double newton = -1, z = -1;
    char what[32] = "";
    ASSERT_EQ(std::sscanf(line.c_str(), "ball on %31[a-z]: %lf N at z = %lf m", what, &newton, &z), 3)
        << line;
    EXPECT_GE(newton, 0);
    EXPECT_LT(newton, 200);
    const bool floor = what == std::string("floor");
    EXPECT_TRUE(floor ? std::fabs(z) < 0.005 : z > 0.01 && z < 0.25) << line;
    ++(floor ? on_floor : on_ball);
  }
  EXPECT_GT(on_floor, 0) << r.out;
}

// unsanitized: too slow there; shorter tests run the same code
TEST(CProgram, Pull_SlidesWhereCoulombSays) {
  const test::CommandResult r = example("02_pull");
  ASSERT_EQ(r.exit_code, 0) << r.out << r.err;
  double at = 0, mu = 0;
  unsigned begun = 0, ended = 0, now = 0;
  const char *const form = "slides at %lf of its weight (mu %lf)\ncontacts: %u begun, %u ended, %u now";
  ASSERT_EQ(std::sscanf(r.out.c_str(), form, &at, &mu, &begun, &ended, &now), 5) << r.out;
  EXPECT_EQ(mu, 0.5);
  EXPECT_NEAR(at, mu, 0.03) << "0.016 of it pass while the block gathers the speed that counts as sliding";
  EXPECT_EQ(begun - ended, now) << "the events tell what touches";
  EXPECT_GT(now, 3u);
}

// As the pages on games say: a step whose budget is used up ends early, and the world falls behind; it never
// stands still.
TEST(CProgram, GameLoop_FallsBehindWhereTheBudgetEndsSteps) {
  const struct {
    const char *work;
    double least, most;  // s, of the world after a second, as printed
  } budgets[] = {{"0", 0.95, 1.05}, {"15000", 0.3, 0.95}, {"500", 0.01, 0.15}};
  for (const auto &budget : budgets) {
    const test::CommandResult r = example("06_game_loop", {"1e5", "60", "1", budget.work});
    ASSERT_EQ(r.exit_code, 0) << r.out << r.err;
    const std::string line = r.out.substr(r.out.find("\nt ") + 1);
    double t = 0;
    int steps = 0;
    unsigned shortened = 0;
    ASSERT_EQ(std::sscanf(line.c_str(), "t %lf s: %d steps", &t, &steps), 2) << r.out;
    const size_t end = line.find(" asleep, ");
    ASSERT_NE(end, std::string::npos) << r.out;
    ASSERT_EQ(std::sscanf(line.c_str() + end, " asleep, %u shortened", &shortened), 1) << r.out;
    EXPECT_EQ(shortened > 0, budget.most < 1) << line;
    EXPECT_GE(t, budget.least) << line;
    EXPECT_LT(t, budget.most) << line;
    EXPECT_EQ(steps, 60) << line;
  }
}

TEST(CProgram, Surface_JoinsAndTurnsALooseCube) {
  const test::CommandResult r = example("03_surface", {test::scratch("c_program") + "/cube.obj"});
  ASSERT_EQ(r.exit_code, 0) << r.out << r.err;
  EXPECT_EQ(r.out,
            "28 points were merged with another at exactly the same place\n"
            "4 of 12 triangles faced the wrong way and were turned\n"
            "8 points, 12 triangles, closed, 0.001 m3\n"
            "read again: 8 points, closed, nothing to repair: yes\n");
}

TEST(CProgram, RigidHost_IsCarriedByTheBall) {
  const test::CommandResult r = example("04_rigid_host");
  ASSERT_EQ(r.exit_code, 0) << r.out << r.err;
  const size_t at = r.out.find("carried with ");
  ASSERT_NE(at, std::string::npos) << r.out;
  EXPECT_NEAR(std::strtod(r.out.c_str() + at + 13, nullptr), 2 * 9.81, 0.02 * 2 * 9.81);
}

TEST(CProgram, Draw_FillsABufferAndDrawsFromIt) {
  const std::string picture = test::scratch("c_program_draw") + "/draw.ppm";
  const test::CommandResult r = example("07_draw", {picture});
  ASSERT_EQ(r.exit_code, 0) << r.out << r.err;
  unsigned vertices = 0, bytes = 0, triangles = 0, stuck = 0;
  ASSERT_EQ(std::sscanf(r.out.c_str(), "%u vertices of %u bytes, %u triangles, %u vertices stick", &vertices,
                        &bytes, &triangles, &stuck),
            4)
      << r.out;
  EXPECT_EQ(bytes, 36u);
  EXPECT_EQ(triangles, 2 * vertices - 4) << "a closed surface";
  EXPECT_GT(stuck, 2u) << "it lies on the floor";
  std::ifstream in(picture, std::ios::binary);
  const std::string drawn((std::istreambuf_iterator<char>(in)), {});
  ASSERT_EQ(drawn.size(), 15u + 256 * 256 * 3);
  const auto pixel = [&](size_t x, size_t y) {
    return static_cast<unsigned char>(drawn[15 + 3 * (256 * y + x)]);
  };
  EXPECT_EQ(pixel(5, 5), 40) << "nothing in the corner";
  EXPECT_GT(pixel(128, 180), 60) << "the ball, lit from the front";
}

// Its figures are those of the machine; the force is that of the scene.
TEST(CProgram, HapticLoop_RunsBesideTheScene) {
  const std::string scene = DEFORM_SOURCE_DIR "/examples/scenes/grasp.json";
  const test::CommandResult r = example("08_haptic_loop", {scene, "grasper", "0.2", "500"});
  ASSERT_EQ(r.exit_code, 0) << r.out << r.err;
  EXPECT_NE(r.out.find("motion that the force answers"), std::string::npos) << r.out;
  EXPECT_NE(r.out.find("of 200 steps ended behind the clock"), std::string::npos) << r.out;
  const test::CommandResult none =
      example("08_haptic_loop", {DEFORM_SOURCE_DIR "/examples/scenes/attached.json"});
  EXPECT_EQ(none.exit_code, 1);
  EXPECT_NE(none.out.find("it has no tools"), std::string::npos) << none.out;
}

TEST(CppProgram, Cpp_PrintsTheMissingLawAndTheBalls) {
  const test::CommandResult r = example("05_cpp");
  ASSERT_EQ(r.exit_code, 0) << r.out << r.err;
  unsigned contacts = 0;
  double newton = 0, z = 0;
  const char *const form =
      "no such law: DFM_E_UNSUPPORTED\n%u contacts, %lf N between the balls, lower at %lf m";
  ASSERT_EQ(std::sscanf(r.out.c_str(), form, &contacts, &newton, &z), 3) << r.out;
  EXPECT_GT(contacts, 3u);
  EXPECT_GT(newton, 0);
  EXPECT_TRUE(z > 0.05 && z < 0.12) << z;
}
