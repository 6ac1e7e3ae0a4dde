// Soft material at the defaults of its parameters: a cube of 10 kPa that a frame of 1/60 s drops on the floor
// keeps its cells, and Poisson's ratio counts.
#include "world.h"

namespace {

constexpr double kG = 9.81, kEdge = 0.2, kDensity = 1000, kFrame = 1.0 / 60;

struct Cube {
  test::Context context;
  dfm_world world;
  dfm_body body;
  Cube(double young, double poisson, double damping_mass, bool friction = true) {
    world = test::make_world(context, {0, 0, -kG});
    test::BodyOptions o;
    o.name = "cube";
    o.young = young;
    o.poisson = poisson;
    o.density = kDensity;
    o.damping_stiffness = 1e-3;
    o.damping_mass = damping_mass;
    o.position = {0, 0, 1e-3};
    body = test::make_body(context, world, "beam", {kEdge, kEdge, kEdge}, 1500, o);
    test::add_plane(world, "floor");
    if (friction) test::set_friction(world, 0.5);
    else test::set_friction(world, 0, "none");
  }
  double share() const { return test::measure(body).volume / test::measure(body).rest_volume; }
};

}  // namespace

TEST(SoftMaterial, ACubeOfTenKilopascal_DropsWithoutACellInsideOut) {
  for (double poisson : {-0.5, 0.25, 0.3, 0.49}) {
    Cube cube(1e4, poisson, 0);
    for (int frame = 0; frame < 120; ++frame) {
      test::run(cube.world, kFrame, kFrame);
      ASSERT_GT(cube.share(), 0.75) << poisson << ", frame " << frame;
    }
    EXPECT_EQ(test::stats(cube.world).inverted_max, 0u) << poisson;
  }
}

// Under its own weight a column sinks by rho g L^2/(2 E) at its top, by a third of rho g L^2/E in the mean.
// Strains reach a fifth (10 kPa), two fifths (5 kPa).
TEST(SoftMaterial, CubesAtRest_SinkAsAColumnDoesAndNoCellIsInsideOut) {
  for (const auto &[young, poisson] :
       {std::pair{1e4, 0.0}, {1e4, 0.3}, {1e4, 0.4}, {5e3, 0.2}, {5e3, 0.3}, {1e5, 0.3}}) {
    Cube cube(young, poisson, 8);
    const double start = test::measure(cube.body).com[2] - 1e-3;
    const double column = kDensity * kG * kEdge * kEdge / (3 * young);
    test::run(cube.world, 4, kFrame);
    const dfm_body_measure m = test::measure(cube.body);
    EXPECT_NEAR(start - m.com[2], column, 0.25 * column) << young << ", poisson " << poisson;
    EXPECT_LT(m.kinetic, 1e-6) << young << ", poisson " << poisson;
    EXPECT_EQ(test::stats(cube.world).inverted_max, 0u) << young << ", poisson " << poisson;
  }
}

// The cells of this column are half as tall again as wide, and most of its edges stand: with springs that
// were evened out by a single step it was 1.5 times as stiff as the material says. Its middle sinks by
// rho g L^2/(3 E).
TEST(SoftMaterial, ColumnOfStretchedCells_SinksWithinAQuarterOfLinearTheory) {
  for (const auto &[young, poisson] : {std::pair{1e4, 0.3}, {1e4, 0.45}, {1e5, 0.0}, {1e5, 0.49}}) {
    test::Context context;
    const dfm_world world = test::make_world(context, {0, 0, -kG});
    const double length = 0.12, frequency = M_PI / 2 * std::sqrt(young / kDensity) / length;
    test::BodyOptions o;
    o.young = young;
    o.poisson = poisson;
    o.density = kDensity;
    o.damping_mass = 2 * frequency;
    o.position = {0, 0, 1e-4};
    const dfm_body body = test::make_body(context, world, "cylinder", {0.04, length, 0}, 1000, o);
    test::add_plane(world, "floor");
    test::set_friction(world, 0, "none");
    const auto middle = [body] {  // over the lowest point
      const std::vector<double> x = test::listed(dfm_surface_positions, body, 3);
      double lowest = HUGE_VAL;
      for (size_t i = 2; i < x.size(); i += 3) lowest = std::min(lowest, x[i]);
      return test::measure(body).com[2] - lowest;
    };
    const double start = middle(), linear = kDensity * kG * length * length / (3 * young);
    test::run(world, 20 / frequency, 1.0 / 240);
    EXPECT_NEAR(start - middle(), linear, 0.25 * linear) << young << ", poisson " << poisson;
  }
}

TEST(SoftMaterial, PoissonsRatio_CountsFromAQuarterOn) {
  const auto share = [](double poisson) {
    Cube cube(4e4, poisson, 12, false);  // free to grow in width, as a column is
    test::run(cube.world, 2, kFrame);
    return cube.share();
  };
  const double quarter = share(0.25), third = share(0.33), most = share(0.45);
  EXPECT_EQ(share(-0.5), quarter);
  // A column that holds its mean weight rho g L/2 loses (1 - 2 nu) of that over E.
  const double strain = kDensity * kG * kEdge / 2 / 4e4;
  EXPECT_NEAR(1 - quarter, 0.5 * strain, 0.1 * strain);
  EXPECT_NEAR(1 - third, 0.34 * strain, 0.1 * strain);
  EXPECT_NEAR(1 - most, 0.1 * strain, 0.1 * strain);
  EXPECT_LT(1 - most, 0.7 * (1 - third));
}
