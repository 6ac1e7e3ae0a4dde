// Springs from a body to places in the world: what they pull, and that they count in the step bound, the
// snapshot and the scene file.
#include <gtest/gtest.h>

#include <numbers>

#include "support.h"
#include "world.h"

namespace {

struct Hung {
  test::Context context;
  dfm_world world;
  dfm_body body;
  std::vector<uint32_t> points;
  double mass;
  explicit Hung(double young = 1e5, std::array<double, 3> gravity = {}, const char *model = "")
      : world(test::make_world(context, gravity)) {
    test::BodyOptions o;
    o.young = young;
    o.model = model;
    body = test::make_body(context, world, "beam", {0.1, 0.1, 0.1}, 60, o);
    dfm_body_info info{};
    info.size = sizeof info;
    test::ok(dfm_body_get_info(body, &info));
    mass = info.mass;
    for (uint32_t i = 0; i < info.npoint; ++i) points.push_back(i);
  }
  // From all points to `to`.
  uint32_t spring(double stiffness, double damping, std::array<double, 3> to) {
    dfm_spring_def d{};
    d.size = sizeof d;
    d.npoint = uint32_t(points.size());
    d.points = points.data();
    d.stiffness = stiffness;
    d.damping = damping;
    std::copy(to.begin(), to.end(), d.to);
    uint32_t number = 0;
    test::ok(dfm_body_add_spring(body, &d, &number));
    return number;
  }
  double x(int axis = 0) { return test::measure(body).com[axis]; }
  void run(double seconds, double step) {
    for (int i = 0; i < int(std::lround(seconds / step)); ++i) test::ok(dfm_world_step(world, step, nullptr));
  }
};

}  // namespace

// A body on a spring at its center of mass swings as a point mass: x = A cos(w t), w = sqrt(k/m), and the
// scheme's own frequency differs by (w h)^2 / 24 only.
TEST(Spring, AtTheCenterOfMass_SwingsAsAPointMass) {
  Hung s;
  const double k = 40, w = std::sqrt(k / s.mass), x0 = s.x();
  s.spring(k, 0, {x0 - 0.02, s.x(1), s.x(2)});
  const double quarter = 0.5 * std::numbers::pi / w, h = quarter / 400;
  s.run(quarter, h);
  EXPECT_NEAR(s.x(), x0 - 0.02, 1e-4);
  s.run(quarter, h);
  EXPECT_NEAR(s.x(), x0 - 0.04, 1e-5);
  EXPECT_NEAR(s.x(1), 0.05, 1e-12);
}

TEST(Spring, UnderWeight_HangsByWeightOverStiffness) {
  Hung s(1e5, {0, 0, -10});
  const double k = 500, z0 = s.x(2);
  const uint32_t number = s.spring(k, 40, {0.05, 0.05, z0});
  s.run(3, 1e-3);
  EXPECT_NEAR(z0 - s.x(2), s.mass * 10 / k, 1e-9);
  double force[3];
  test::ok(dfm_body_get_spring_force(s.body, number, force));
  EXPECT_NEAR(force[2], s.mass * 10, 1e-6);
  test::ok(dfm_body_remove_spring(s.body, number));
  s.run(0.1, 1e-3);
  EXPECT_NEAR(test::measure(s.body).velocity[2], -1, 1e-6);
}

TEST(Spring, ThatIsStiff_ShortensTheStableStepAndStaysBounded) {
  Hung s(1e4);
  test::ok(dfm_world_step(s.world, 1e-4, nullptr));
  const double before = test::stats(s.world).stable_step;
  s.spring(1e7, 0, {0.06, 0.05, 0.05});
  test::ok(dfm_world_step(s.world, 1e-4, nullptr));
  EXPECT_LT(test::stats(s.world).stable_step, 0.5 * before);
  s.run(0.1, 1e-3);
  EXPECT_LT(std::fabs(s.x() - 0.06), 0.0101);
}

// The end moves evenly: a damped body follows at its speed, behind by nothing but what gravity and
// drag would pull.
TEST(Spring, WhoseEndMoves_TakesTheBodyAlong) {
  Hung s;
  const dfm_vector_key keys[] = {{0, {0.05, 0.05, 0.05}}, {2, {0.45, 0.05, 0.05}}};
  dfm_spring_def d{};
  d.size = sizeof d;
  d.npoint = uint32_t(s.points.size());
  d.points = s.points.data();
  d.stiffness = 200;
  d.damping = 20;
  d.keys = keys;
  d.nkey = 2;
  uint32_t number = 0;
  test::ok(dfm_body_add_spring(s.body, &d, &number));
  s.run(1.5, 1e-3);
  EXPECT_NEAR(s.x(), 0.35, 1e-6);
  EXPECT_NEAR(test::measure(s.body).velocity[0], 0.2, 1e-5);
  const double back[3] = {0.05, 0.05, 0.05};
  test::ok(dfm_body_set_spring_target(s.body, number, back));
  s.run(2, 1e-3);
  EXPECT_NEAR(s.x(), 0.05, 1e-6);
}

TEST(Spring, SavedAndRestored_PullsOnWithTheSameBits) {
  Hung a, b;
  a.spring(300, 1, {0.2, 0.05, 0.05});
  a.run(0.1, 1e-3);
  const std::string data = test::snapshot(a.world);
  test::ok(dfm_world_restore(b.world, data.data(), data.size()));
  a.run(0.2, 1e-3);
  b.run(0.2, 1e-3);
  EXPECT_EQ(dfm_world_hash(a.world), dfm_world_hash(b.world));
  EXPECT_GT(std::fabs(a.x() - 0.05), 1e-3);
}

TEST(Spring, ThatMakesNoSense_IsRefusedWithASentence) {
  Hung s;
  dfm_spring_def d{};
  const uint32_t none = 100000;
  const double negative = -1, zero = 0;
  d.size = sizeof d;
  d.npoint = 1;
  d.points = s.points.data();
  d.stiffness = 1;
  const auto refused = [&](dfm_spring_def bad, const char *word) {
    uint32_t number = 77;
    EXPECT_EQ(dfm_body_add_spring(s.body, &bad, &number), DFM_E_ARG);
    EXPECT_NE(std::string(dfm_last_error()).find(word), std::string::npos) << dfm_last_error();
    EXPECT_EQ(number, 77u);
  };
  auto with = [&](auto change) {
    dfm_spring_def copy = d;
    change(copy);
    return copy;
  };
  refused(with([&](auto &x) { x.npoint = 0; }), "at least one point");
  refused(with([&](auto &x) { x.points = &none; }), "does not exist");
  refused(with([&](auto &x) { x.weights = &negative; }), "not negative");
  refused(with([&](auto &x) { x.weights = &zero; }), "above 0");
  refused(with([&](auto &x) { x.stiffness = -1; }), "not negative");
  refused(with([&](auto &x) { x.damping = NAN; }), "not negative");
  refused(with([&](auto &x) { x.to[1] = INFINITY; }), "finite");
  refused(with([&](auto &x) { x.nkey = 1; }), "NULL");
  double force[3];
  EXPECT_EQ(dfm_body_get_spring_force(s.body, 5, force), DFM_E_ARG);
  EXPECT_EQ(dfm_body_remove_spring(s.body, 5), DFM_E_ARG);
  const double to[3] = {0, NAN, 0};
  EXPECT_EQ(dfm_body_set_spring_target(s.body, s.spring(1, 0, {}), to), DFM_E_ARG);
}

// From the scene file: by box (its points' center of mass) and by a point inside a cell, to a place and
// along keyframes.
TEST(Spring, OfASceneFile_PullsAtTheGivenPlace) {
  const std::string folder = test::scratch("spring_scene");
  ASSERT_EQ(test::deform({"mesh", "make", "beam", "--size", "0.1", "0.1", "0.1", "--cells", "60", "--out",
                          folder + "/cube.msh"})
                .exit_code,
            0);
  const std::string head =
      R"({"format": "deform-scene", "version": 1, "gravity": [0, 0, -10],
    "time": {"duration": 3, "step": 0.001},
    "materials": {"gel": {"young": 1e6, "damping": {"mass": 4, "stiffness": 0.001}}},
    "bodies": [{"name": "cube", "mesh": "cube.msh", "material": "gel", "springs": [)";
  for (const char *spring :
       {R"({"box": [[0, 0, 0], [0.1, 0.1, 0.1]], "to": [0.05, 0.05, 0.05], "stiffness": 500, "damping": 40})",
        R"({"point": [0.05, 0.05, 0.05], "keyframes": [{"t": 0, "position": [0.05, 0.05, 0.05]}],
         "stiffness": 500, "damping": 40})"}) {
    test::write_file(folder + "/scene.json", head + spring + "]}]}");
    const test::CommandResult r =
        test::deform({"run", folder + "/scene.json", "--out", folder + "/out", "--quiet"});
    ASSERT_EQ(r.exit_code, 0) << r.err;
    const auto rows = test::read_csv(folder + "/out/bodies.csv");
    // com_z; the cube gives a little around the point
    EXPECT_NEAR(std::stod(rows.back()[4]), 0.05 - 10.0 / 500, 2e-4) << spring;
  }
}
