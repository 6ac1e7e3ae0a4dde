// Zerbato's collision solution on cases that are computed by hand, and tests that tell a printed form that is
// wrong from the right one (Zerbato 2010, doc/reference/zerbato.md: (4.5), (5.21), (5.24), (5.25), (5.27)).
#include "rollback/equations.h"

#include "obstacle.h"
#include "rollback_cases.h"

namespace {

using test::rollback::Vector;

constexpr double kOffset = 1e-4;

// A tetrahedron without stress of its own: so soft that nothing but contact changes its velocities within the
// steps taken here.
struct Tet {
  const char *name;
  double point[4][3], velocity[4][3];
};

struct Scene {
  test::Context context;
  dfm_world world = 0;
  dfm::rollback::Scheme scheme;
  Scene(Vector gravity, double mu) {
    dfm_world_def d = dfm_world_def_default();
    d.contact_offset = kOffset;
    std::copy(gravity.begin(), gravity.end(), d.gravity);
    test::ok(dfm_world_create(context, &d, &world));
    if (mu > 0) test::set_friction(world, mu);
    else test::set_friction(world, 0, "none");
  }
  dfm_body add(const Tet &t) {
    dfm_material_def md = dfm_material_def_default();
    md.density = 1e6;
    md.young = 1e-3;
    dfm_material material = 0;
    test::ok(dfm_material_create(world, &md, &material));
    const auto volume = [&](const uint32_t c[4]) {
      double e[3][3];
      for (int i = 0; i < 3; ++i)
        for (size_t k = 0; k < 3; ++k) e[i][k] = t.point[c[i + 1]][k] - t.point[c[0]][k];
      return e[0][0] * (e[1][1] * e[2][2] - e[1][2] * e[2][1]) -
             e[0][1] * (e[1][0] * e[2][2] - e[1][2] * e[2][0]) +
             e[0][2] * (e[1][0] * e[2][1] - e[1][1] * e[2][0]);
    };
    uint32_t cell[4] = {0, 1, 2, 3};
    if (volume(cell) < 0) std::swap(cell[2], cell[3]);
    dfm_body_def d = dfm_body_def_default();
    d.name = t.name;
    d.npoint = 4;
    d.ntet = 1;
    d.points = &t.point[0][0];
    d.tets = cell;
    d.material = material;
    dfm_body b = 0;
    test::ok(dfm_body_create(world, &d, &b));
    test::ok(dfm_body_set_state(b, 4, &t.point[0][0], &t.velocity[0][0]));
    return b;
  }
  void step(double h) {
    uint32_t trouble = 0;
    ASSERT_EQ(scheme.step(world, h, &trouble), DFM_OK) << dfm_last_error();
    EXPECT_EQ(trouble, 0u);
  }
};

struct State { Vector x[4], v[4]; };
State state(dfm_body b) {
  State s;
  uint32_t n = 0;
  test::ok(dfm_body_get_state(b, 4, &s.x[0][0], &s.v[0][0], &n));
  return s;
}
double vertex_mass(dfm_body b) { return test::measure(b).mass / 4; }

void set_velocity(Tet &t, Vector v) {
  for (auto &of : t.velocity) std::copy(v.begin(), v.end(), of);
}

// A vertex at `tip` that points down (or up) with the rest of its body well behind it.
Tet pointer(const char *name, Vector tip, double back, Vector velocity) {
  Tet t{name, {}, {}};
  const double beside[4][2] = {{0, 0}, {0.2, 0}, {-0.1, 0.2}, {-0.1, -0.2}};
  for (int i = 0; i < 4; ++i) {
    t.point[i][0] = tip[0] + beside[i][0];
    t.point[i][1] = tip[1] + beside[i][1];
    t.point[i][2] = tip[2] + (i ? back : 0);
  }
  set_velocity(t, velocity);
  return t;
}

}  // namespace

// (4.5) with the corrected forces, two sub-steps: h = 0.01 s, v = (0.3, 0, -2) m/s, g = 10 m/s2, half a way
// above where it touches.
TEST(Rollback, OneVertexAgainstAPlane_IsAsComputedByHand) {
  Scene s({0, 0, -10}, 0.5);
  test::add_plane(s.world, "floor");
  const double h = 0.01, way = 2.1 * h, tip = kOffset + 0.5 * way;
  const dfm_body b = s.add(pointer("tet", {0, 0, tip}, 0.3, {0.3, 0, -2}));
  const double m = vertex_mass(b);
  s.step(h);
  // T = 1/2, t = 0.9 T; position and velocity go back together
  const State one = state(b);
  EXPECT_NEAR(one.x[0][2], tip - 0.45 * way, 1e-15);
  EXPECT_NEAR(one.x[0][0], 0.45 * h * 0.3, 1e-15);
  EXPECT_NEAR(one.v[0][2], -0.45 * 2.1, 1e-14);
  EXPECT_NEAR(one.v[0][0], 0.45 * 0.3, 1e-15);
  for (int k = 1; k < 4; ++k)
    EXPECT_NEAR(one.v[k][2], -2.1, 1e-14) << "vertices that do not collide go their way";
  // normal force: all that would stop it within the step; friction: what would stop the slip, within mu fn
  const auto contacts = test::contacts(s.world);
  ASSERT_EQ(contacts.size(), 1u);
  EXPECT_NEAR(contacts[0].fn, m * 2.1 / h, 1e-10 * m / h);
  EXPECT_NEAR(std::hypot(contacts[0].ft[0], contacts[0].ft[1]), m * 0.3 / h, 1e-10 * m / h);
  EXPECT_NEAR(std::hypot(contacts[0].slip[0], contacts[0].slip[1]), 0.45 * 0.3, 1e-12);
  // The lag: friction of the sub-step that is over meets a vertex that has slowed down since, and
  // throws it back.
  s.step(h);
  const double vx = 0.45 * 0.3 - 0.3, vz = -0.45 * 2.1 - 0.1, t = 0.9 * (0.05 * way) / (-vz * h);
  const State two = state(b);
  EXPECT_NEAR(two.v[0][0], t * vx, 1e-12);
  EXPECT_EQ(two.v[0][1], 0) << "(5.21), (5.25): the tangential part by the dot product; by the printed cross "
                               "product friction would act along y";
  EXPECT_NEAR(two.v[0][2], t * vz, 1e-12);
  EXPECT_LT(two.v[0][0], 0);
}

// A vertex of one body on a face of another: all four vertices go back, each loses (1 - t) m v of its own,
// and nobody gets it.
TEST(Rollback, VertexAgainstFace_BothBodiesLoseTheirOwnMomentum) {
  Scene s({0, 0, 0}, 0);
  Tet table{"table", {{-1, -1, 0}, {1, -1, 0}, {0, 1, 0}, {0, 0, -1}}, {}};
  set_velocity(table, {0.1, 0, 0.5});
  const double h = 0.1, way = (2 + 0.5) * h, tip = kOffset + 0.8 * way;
  const dfm_body a = s.add(pointer("falling", {0, 0, tip}, 0.4, {0, 0, -2})), b = s.add(table);
  const double ma = vertex_mass(a), mb = vertex_mass(b), before = -8 * ma + 2 * mb;
  s.step(h);
  const double t = 0.9 * 0.8;
  const State sa = state(a), sb = state(b);
  EXPECT_NEAR(sa.v[0][2], -2 * t, 2e-3 * kOffset / way);
  for (int k = 0; k < 3; ++k) {
    EXPECT_NEAR(sb.v[k][2], 0.5 * t, 2e-3 * kOffset / way);
    EXPECT_NEAR(sb.v[k][0], 0.1 * t, 2e-3 * kOffset / way) << "tangential motion stops with the normal one";
  }
  EXPECT_EQ(sb.v[3][2], 0.5);
  const auto p = test::rollback::momentum({a, b});
  const double lost = (1 - t) * (2 * ma - 3 * 0.5 * mb);
  EXPECT_NEAR(p[2] - before, lost, 1e-3 * std::fabs(lost));
  // books: what the method did to the bodies, to rounding
  EXPECT_NEAR(p[2] - before, test::measure(a).contact_impulse[2] + test::measure(b).contact_impulse[2],
              1e-13 * std::fabs(before));
  // (5.24) corrected: m_eff of a vertex on a face with weights (1/4, 1/4, 1/2)
  const auto contacts = test::contacts(s.world);
  ASSERT_EQ(contacts.size(), 1u);
  const double m_eff = 1 / (1 / ma + (1.0 / 16 + 1.0 / 16 + 1.0 / 4) / mb);
  EXPECT_NEAR(contacts[0].fn, m_eff * 2.5 / h, 1e-6 * m_eff / h);
}

// The counter-example to (4.5) in doc/reference/zerbato.md: a triangle comes down on a point, t = 1/2; two of
// its vertices touch something else at t = 0.1. With a time for each vertex it ends below the point.
TEST(Rollback, OneTimePerIsland_KeepsTheTriangleAboveThePoint) {
  Scene s({0, 0, 0}, 0);
  const Tet falling{"falling",
                    {{-1, -1, 0.2}, {1, -1, 0.2}, {0, 1, 0.6}, {0, 0, 2}},
                    {{0, 0, 0.4}, {0, 0, 0.4}, {0, 0, -2}, {0, 0, 0}}};
  const dfm_body a = s.add(pointer("still", {0, 0, 0}, -1, {})), b = s.add(falling);
  for (const double x : {-1.0, 1.0}) {
    dfm_obstacle_def d = dfm_obstacle_def_default();
    d.shape = DFM_SHAPE_BOX;
    d.half_size[0] = d.half_size[1] = d.half_size[2] = 0.05 + 1e-7;
    d.pose.position[0] = 1.05 * x;
    d.pose.position[1] = -1.05;
    d.pose.position[2] = 0.24 + kOffset + 0.05;
    dfm_obstacle o = 0;
    test::ok(dfm_obstacle_create(s.world, &d, &o));
  }
  const auto height = [](double ta, double tb, double tc) {
    return 0.25 * (0.2 + 0.4 * ta) + 0.25 * (0.2 + 0.4 * tb) + 0.5 * (0.6 - 2 * tc);
  };
  EXPECT_NEAR(height(0.5, 0.5, 0.5), 0, 1e-15);
  EXPECT_NEAR(height(0.1, 0.1, 0.5), -0.08, 1e-15) << "(4.5) as printed: through the point";
  s.step(1);
  const State sb = state(b);
  const double t = (sb.x[0][2] - 0.2) / 0.4;
  EXPECT_NEAR(t, 0.09, 5e-4);  // its edges rise past the boxes' corners within d_c of them
  EXPECT_NEAR(sb.x[1][2], 0.2 + 0.4 * t, 1e-14);
  EXPECT_NEAR(sb.x[2][2], 0.6 - 2 * t, 1e-14) << "tied to the two by the contact with the point";
  EXPECT_GT(0.25 * sb.x[0][2] + 0.25 * sb.x[1][2] + 0.5 * sb.x[2][2], 0.3);
  EXPECT_EQ(state(a).x[0][2], 0);
}

// Two edges cross; no vertex of either comes near the other body. The six vertex-face pairs of Zerbato (2010,
// 4.2) alone see nothing.
TEST(Rollback, EdgeAgainstEdge_GoesBackToo) {
  Scene s({0, 0, 0}, 0);
  const Tet lower{"lower", {{-1, 0, 0}, {1, 0, 0}, {0, -0.3, -1}, {0, 0.3, -1}}, {}};
  Tet upper{"upper", {{0, -1, 0.1}, {0, 1, 0.1}, {-0.3, 0, 1.1}, {0.3, 0, 1.1}}, {}};
  set_velocity(upper, {0, 0, -2});
  const dfm_body a = s.add(lower), b = s.add(upper);
  s.step(0.1);
  const double t = 0.9 * (0.1 - kOffset) / 0.2;
  EXPECT_NEAR(state(b).x[0][2], 0.1 - 0.2 * t, 1e-6);
  EXPECT_NEAR(state(b).x[1][2], 0.1 - 0.2 * t, 1e-6);
  EXPECT_NEAR(state(b).x[2][2], 0.9, 1e-12);
  EXPECT_EQ(state(a).x[0][2], 0);
  ASSERT_EQ(test::contacts(s.world).size(), 1u);
  EXPECT_EQ(test::contacts(s.world)[0].kind, uint32_t{DFM_CONTACT_EDGE_EDGE});
}

// A vertex that goes back stands in the way of one that does not: they are tied, and the second
// does not pass.
TEST(Rollback, VertexHeldUpByAnother_TiesWhatFollowsIt) {
  Scene s({0, 0, 0}, 0);
  test::add_plane(s.world, "floor");
  Tet table{"table", {{-1, -1, 0.05}, {1, -1, 0.05}, {0, 1, 0.05}, {0, 0.3, 0.046}}, {}};
  set_velocity(table, {0, 0, -1});
  table.velocity[3][2] = 0;
  // follows from above, as fast, at a distance that the motion alone never closes, and would end
  // above the floor
  const Tet follower = pointer("follower", {0, -0.9, 0.103}, 0.1, {0, 0, -1});
  const dfm_body a = s.add(table), b = s.add(follower);
  s.step(0.1);
  const double t = 0.9 * (0.05 - kOffset) / 0.1;
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(state(a).x[k][2], 0.05 - 0.1 * t, 1e-6);
  EXPECT_NEAR(state(b).x[0][2], 0.103 - 0.1 * t, 1e-6);
  EXPECT_NEAR(state(b).x[1][2], 0.103, 1e-12) << "its other vertices collide with nothing";
}

// Over the middle of a floor of triangles, where six of them meet: the point is pressed once, not six times.
TEST(Rollback, VertexWhereTrianglesMeet_IsOneContact) {
  Scene s({0, 0, 0}, 0.5);
  test::add_mesh(s.world, "floor", test::box_surface({1, 1, 0.5}, 2));
  const dfm_body b = s.add(pointer("tet", {0, 0, 0.5 + kOffset + 0.01}, 0.3, {0, 0, -2}));
  s.step(0.01);
  const auto contacts = test::contacts(s.world);
  ASSERT_EQ(contacts.size(), 1u);
  EXPECT_NEAR(contacts[0].fn, vertex_mass(b) * 2 / 0.01, 1e-6 * vertex_mass(b) / 0.01);
  EXPECT_NEAR(state(b).v[0][2], -2 * 0.45, 1e-4);
}

// At rest t = 0: frozen, across the plane as much as into it. What parts is free, at once and in full.
TEST(Rollback, TouchingVertex_IsFrozenWhileItPresses) {
  Scene s({0, 0, 0}, 0);
  test::add_plane(s.world, "floor");
  const dfm_body b = s.add(pointer("tet", {0, 0, kOffset}, 0.3, {1, 0.5, -1e-6}));
  s.step(0.01);
  const State pressed = state(b);
  for (size_t k = 0; k < 3; ++k) EXPECT_EQ(pressed.v[0][k], 0);
  EXPECT_EQ(pressed.x[0][0], 0);
  EXPECT_EQ(pressed.v[1][0], 1);
  std::vector<double> v(12, 0.0);
  v[0] = 1;
  v[2] = 1e-6;
  test::ok(dfm_body_set_state(b, 4, nullptr, v.data()));
  s.step(0.01);
  EXPECT_NEAR(state(b).v[0][0], 1, 1e-10);
  EXPECT_NEAR(state(b).v[0][2], 1e-6, 1e-10);
  EXPECT_TRUE(test::contacts(s.world).empty());
}

// (5.24) as printed chooses between f_p.(f_p - f_t) and f_t.(f_p - f_t): by Cauchy-Schwarz its first
// branch, zero, always.
TEST(RollbackForces, NormalForce_IsNotTheOneThatIsPrinted) {
  uint64_t seed = 7;
  const auto next = [&] {
    seed = seed * 6364136223846793005ull + 1442695040888963407ull;
    return 2 * double(seed >> 11) / 9007199254740992.0 - 1;
  };
  int zero = 0;
  for (int i = 0; i < 100000; ++i) {
    const dfm::Vec3 p{next(), next(), next()}, t{next(), next(), next()};
    zero += dot(p - t, p) > 0 || dot(p - t, t) < 0;
  }
  EXPECT_EQ(zero, 100000) << "as printed friction vanishes identically";
  const double h = 1e-3, m = 1;
  EXPECT_NEAR(dfm::rollback::normal_force(1 / m, -9.8 * h, h), 9.8, 1e-12) << "a block of 1 kg at rest";
  EXPECT_EQ(dfm::rollback::normal_force(1 / m, (20 - 9.8) * h, h), 0) << "pulled up by 20 N";
  EXPECT_EQ(dfm::rollback::normal_force(0, -1, h), 0) << "neither side can move";
}
