// Obstacles of triangles against what is known in closed form: a flat floor of triangles is a plane, whatever
// its triangles; weights are carried once; friction holds and slides where it does on a plane.
#include "obstacle.h"

namespace {

constexpr double kG = 9.81;

struct Block {
  test::Context context;
  dfm_world world;
  dfm_body body;

  explicit Block(std::array<double, 3> gravity = {0, 0, -kG}, double mu = 0) {
    world = test::make_world(context, gravity);
    test::BodyOptions o;
    o.name = "block";
    o.young = 1e6;
    o.damping_stiffness = 1e-3;
    o.position = {-0.05, -0.05, 2e-5};
    body = test::make_body(context, world, "beam", {0.1, 0.1, 0.1}, 60, o);
    test::set_friction(world, mu);
  }
  void push(std::array<double, 3> velocity) const { test::set_velocity(body, velocity); }
  dfm_body_measure now() const { return test::measure(body); }
  double normal_force() const {
    double sum = 0;
    for (const dfm_contact &c : test::contacts(world)) sum += c.fn * c.normal[2];
    return sum;
  }
  // Lowest surfel over a surface of one height.
  double clearance(double (*height)(double)) const {
    uint32_t n = 0;
    test::ok(dfm_surface_positions(body, 0, nullptr, &n));
    std::vector<double> x(size_t(3) * n);
    test::ok(dfm_surface_positions(body, n, x.data(), &n));
    double least = 1;
    for (size_t i = 0; i < x.size(); i += 3) least = std::min(least, x[i + 2] - height(x[i]));
    return least;
  }
};

double flat(double, double) { return 0; }

const test::Triangles &irregular_floor() {
  static const test::Triangles floor = test::height_field(0.6, 23, flat);
  return floor;
}

}  // namespace

// The ghost of every engine: an inner edge of a flat floor that trips what slides over it.
TEST(MeshFloor, FrictionlessSlide_IsThatOnPlane) {
  Block on_plane, on_mesh;
  test::add_plane(on_plane.world, "floor");
  test::add_mesh(on_mesh.world, "floor", irregular_floor());
  for (Block *b : {&on_plane, &on_mesh}) {
    test::run(b->world, 0.1, 1e-3);
    b->push({0.7, 0.2, 0});
  }
  double upward = 0;
  for (int k = 0; k < 500; ++k) {
    for (Block *b : {&on_plane, &on_mesh}) test::run(b->world, 1e-3, 1e-3);
    const dfm_body_measure p = on_plane.now(), m = on_mesh.now();
    for (int i = 0; i < 3; ++i)
      EXPECT_NEAR(m.velocity[i], p.velocity[i], 1e-9 * 0.7) << "step " << k << ", axis " << i;
    upward = std::max(upward, std::fabs(m.com[2] - p.com[2]));
    ASSERT_GE(test::contacts(on_mesh.world).size(), 4u);
  }
  EXPECT_LT(upward, 1e-10);
  EXPECT_NEAR(on_mesh.now().velocity[0], 0.7, 1e-9) << "nothing slows it";
}

// Every surfel of the bottom is carried once, however many triangles, edges and corners lie under it.
TEST(MeshFloor, RestingBlock_IsCarriedOnce) {
  Block b;
  test::add_mesh(b.world, "floor", irregular_floor());
  test::run(b.world, 1.0, 1e-3);
  Block p;
  test::add_plane(p.world, "floor");
  test::run(p.world, 1.0, 1e-3);
  const std::vector<dfm_contact> list = test::contacts(b.world);
  EXPECT_EQ(list.size(), test::contacts(p.world).size());
  double area = 0;
  for (size_t i = 0; i < list.size(); ++i) {
    area += list[i].area;
    for (size_t j = 0; j < i; ++j) EXPECT_NE(list[i].feature_a, list[j].feature_a);
  }
  EXPECT_NEAR(area, 0.01, 0.02 * 0.01);
  EXPECT_NEAR(b.normal_force(), b.now().mass * kG, 1e-6 * b.now().mass * kG);
}

// The vertices of a coarse floor under the block, and of a fine one, make no difference either.
TEST(MeshFloor, ClosedSlab_CarriesAsPlane) {
  const test::Triangles slab = test::box_surface({0.3, 0.3, 0.05}, 9);
  Block b;
  dfm_obstacle_def d = test::mesh_def("slab", slab);
  d.pose.position[2] = -0.05;
  dfm_obstacle o = 0;
  test::ok(dfm_obstacle_create(b.world, &d, &o));
  test::run(b.world, 1.0, 1e-3);
  EXPECT_NEAR(b.normal_force(), b.now().mass * kG, 1e-6 * b.now().mass * kG);
  EXPECT_NEAR(b.clearance([](double) { return 0.0; }), 0, 1e-3);
}

// tan 24.2 degrees is 0.45.
TEST(MeshFloor, Friction_HoldsAndSlidesAsOnPlane) {
  const double angle = std::atan(0.45), g[3] = {kG * std::sin(angle), 0, -kG * std::cos(angle)};
  Block holds({g[0], 0, g[2]}, 0.5), slides({g[0], 0, g[2]}, 0.4);
  test::add_mesh(holds.world, "floor", irregular_floor());
  test::add_mesh(slides.world, "floor", irregular_floor());
  test::run(holds.world, 0.3, 1e-3);
  test::run(slides.world, 0.3, 1e-3);
  EXPECT_LT(std::fabs(holds.now().velocity[0]), 1e-3);
  const double v0 = slides.now().velocity[0];
  test::run(slides.world, 0.2, 1e-3);
  const double want = (g[0] + 0.4 * g[2]) * 0.2;
  EXPECT_NEAR(slides.now().velocity[0] - v0, want, 0.02 * want);
}

// A mesh that is carried along carries what lies on it, as a plane does; a belt drives without moving.
TEST(MeshFloor, MovingAndBelt_DriveAsPlane) {
  for (const bool belt : {false, true}) {
    double v[2];
    for (const bool mesh : {false, true}) {
      Block b({0, 0, -kG}, 0.5);
      dfm_obstacle_def d = mesh ? test::mesh_def("floor", irregular_floor()) : dfm_obstacle_def_default();
      d.name = "floor";
      const dfm_pose_key keys[2] = {{0, {{0, 0, 0}, {0, 0, 0, 1}}},
                                    {1, {{0.2, 0.1, 0.05}, {0, 0, 0.05, 0.99874922}}}};
      if (belt) {
        d.velocity_surface[0] = 0.2;
        d.velocity_surface[1] = 0.1;
      } else {
        d.nkey = 2;
        d.keys = keys;
      }
      dfm_obstacle o = 0;
      test::ok(dfm_obstacle_create(b.world, &d, &o));
      test::run(b.world, 0.4, 1e-3);
      v[mesh] = b.now().velocity[0];
      EXPECT_NEAR(b.now().velocity[2], belt ? 0 : 0.05, 1e-3);
    }
    EXPECT_NEAR(v[0], 0.2, 0.01);
    EXPECT_NEAR(v[1], v[0], 1e-6 * v[0]) << (belt ? "belt" : "moved");
  }
}

// Sliding off a flat onto a slope and from a slope onto a flat: no catch at the edge, no way through it, no
// energy from nowhere.
namespace {
double roof(double x) { return x > 0.1 ? -0.4 * (x - 0.1) : 0; }
double valley(double x) { return x > 0.1 ? 0.3 * (x - 0.1) : 0; }
}  // namespace

TEST(MeshFloor, ConvexAndConcaveEdge_ArePassed) {
  // sliding, rolling
  for (const auto &[convex, mu] : {std::pair{true, 0.0}, {false, 0.0}, {true, 0.5}, {false, 0.5}}) {
    double (*const height)(double) = convex ? roof : valley;
    // Columns of points on the edge, so that it is where the formula has it.
    test::Triangles m = test::height_field(0.8, 32, flat, 0.2);
    for (size_t i = 0; i < m.points.size(); i += 3) {
      if (std::fabs(m.points[i] - 0.1) < 0.02) m.points[i] = 0.1;
      m.points[i + 2] = height(m.points[i]);
    }
    test::Context context;
    const dfm_world world = test::make_world(context);
    test::BodyOptions o;
    o.name = "ball";
    o.young = 2e5;
    o.damping_stiffness = 1e-3;
    o.position = {-0.1, 0, 0.0503};
    o.velocity = {0.8, 0, 0};
    if (mu > 0) o.spin = {0, 16, 0};
    const dfm_body ball = test::make_body(context, world, "ball", {0.05, 0, 0}, 400, o);
    test::set_friction(world, mu);
    test::add_mesh(world, "floor", m);
    const auto energy = [&] {
      const dfm_body_measure k = test::measure(ball);
      return k.kinetic + k.elastic + k.mass * kG * k.com[2];
    };
    double last = energy(), gained = 0, least = 1;
    for (int k = 0; k < 400; ++k) {
      test::run(world, 1e-3, 1e-3);
      const double e = energy();
      gained += std::max(0.0, e - last);
      last = e;
      uint32_t n = 0;
      test::ok(dfm_surface_positions(ball, 0, nullptr, &n));
      std::vector<double> x(size_t(3) * n);
      test::ok(dfm_surface_positions(ball, n, x.data(), &n));
      for (size_t i = 0; i < x.size(); i += 3) least = std::min(least, x[i + 2] - height(x[i]));
    }
    const dfm_body_measure end = test::measure(ball);
    EXPECT_GT(end.com[0], convex ? 0.18 : 0.13) << "past the edge";
    EXPECT_GT(least, 0) << (convex ? "convex" : "concave") << ", mu " << mu;
    EXPECT_LT(gained, 0.01 * 0.5 * end.mass * 0.64) << (convex ? "convex" : "concave");
  }
}

// A spike far smaller than the body's triangles: only the mesh's own vertex can meet the face above it.
TEST(MeshObstacle, SpikeUnderFace_CarriesIt) {
  test::Triangles spike;
  spike.points = {0, 0, 0, -0.01, -0.01, -0.05, 0.01, -0.01, -0.05, 0, 0.012, -0.05};
  spike.tris = {0, 1, 2, 0, 2, 3, 0, 3, 1, 1, 3, 2};
  Block b;
  test::add_mesh(b.world, "spike", spike);
  double moment = 0;
  for (int k = 0; k < 60; ++k) {
    test::run(b.world, 1e-3, 1e-3);
    for (const dfm_contact &c : test::contacts(b.world)) {
      moment += c.fn * 1e-3;
      EXPECT_GT(c.normal[2], 0.9);
    }
  }
  EXPECT_GT(moment, 0.5 * b.now().mass * kG * 0.06) << "the block stands on its point";
  EXPECT_GT(b.now().com[2], 0.045);
}

// Beside an open mesh there is no inside: what hangs over its rim, or passes below it sideways,
// is left alone.
TEST(MeshObstacle, OpenRim_ExertsNoForce) {
  Block b({0, 0, 0});
  const test::Triangles sheet = test::height_field(0.1, 1, flat);  // coarse: it would pull back from 50 mm
  dfm_obstacle_def d = test::mesh_def("sheet", sheet);
  d.pose.position[0] = 0.152;
  d.pose.position[2] = 0.02;  // 2 mm beside the block, above its lowest points
  dfm_obstacle o = 0;
  test::ok(dfm_obstacle_create(b.world, &d, &o));
  test::run(b.world, 0.05, 1e-3);
  EXPECT_LT(b.now().speed_max, 1e-12);
}

TEST(Voxels, Friction_HoldsAndSlidesAsOnPlane) {
  const double angle = std::atan(0.45), g[3] = {kG * std::sin(angle), 0, -kG * std::cos(angle)};
  const test::Triangles slab = test::box_surface({0.3, 0.3, 0.1}, 3);
  const auto with = [&](double mu) {
    auto b = std::make_unique<Block>(std::array<double, 3>{g[0], 0, g[2]}, mu);
    dfm_obstacle_def d = test::mesh_def("slab", slab, DFM_SHAPE_VOXELS, 20000);
    d.pose.position[2] = -0.1;
    dfm_obstacle o = 0;
    test::ok(dfm_obstacle_create(b->world, &d, &o));
    test::run(b->world, 0.3, 1e-3);
    return b;
  };
  const auto holds = with(0.5), slides = with(0.4);
  EXPECT_LT(std::fabs(holds->now().velocity[0]), 1e-3);
  const double normal = holds->normal_force(), weight = -holds->now().mass * g[2];
  EXPECT_NEAR(normal, weight, 0.01 * weight);
  const double v0 = slides->now().velocity[0];
  test::run(slides->world, 0.2, 1e-3);
  const double want = (g[0] + 0.4 * g[2]) * 0.2;
  EXPECT_NEAR(slides->now().velocity[0] - v0, want, 0.02 * want);
}

// The spike again, through the grid: its tip is a few cells wide, the face is twenty.
TEST(Voxels, SpikeUnderFace_CarriesIt) {
  test::Triangles spike;
  spike.points = {0, 0, 0, -0.02, -0.02, -0.05, 0.02, -0.02, -0.05, 0, 0.024, -0.05};
  spike.tris = {0, 1, 2, 0, 2, 3, 0, 3, 1, 1, 3, 2};
  Block b;
  test::add_mesh(b.world, "spike", spike, DFM_SHAPE_VOXELS, 100000);
  double moment = 0;
  for (int k = 0; k < 60; ++k) {
    test::run(b.world, 1e-3, 1e-3);
    for (const dfm_contact &c : test::contacts(b.world)) moment += c.fn * 1e-3;
  }
  EXPECT_GT(moment, 0.4 * b.now().mass * kG * 0.06);
  EXPECT_GT(b.now().com[2], 0.045);
}
