// Coarse balls, cylinders and hoops whose surface is smooth, on a plane, against rigid rolling:
// a = g sin / (1 + k), k = I / (m R^2), and 1 / (1 + k) of the speed that they were thrown with. k is that of
// the meshed body. On facets of the same meshes they lose more than half of a (doc/concepts/detection.md).
#include "rigid.h"
#include "support.h"

namespace {

constexpr double kG = 9.81, kR = 0.1, kDegree = 3.14159265358979323846 / 180;

struct Round {
  const char *kind;
  std::array<double, 3> size;
  uint32_t cells;
  double young;
};
constexpr Round kBall{"ball", {kR, 0, 0}, 500, 1e6}, kCylinder{"cylinder", {kR, kR, 0}, 500, 1e6},
    kHoop{"tube", {0.9 * kR, kR, kR}, 1500, 1e7};

struct Roller {
  test::Context context;
  dfm_world world;
  dfm_body body = 0;
  double k = 0;

  dfm_body make(const Round &shape, dfm_world in, bool placed, double speed, double smooth) {
    dfm_mesh_handle mesh = 0;
    test::ok(dfm_mesh_make(context, shape.kind, shape.size.data(), DFM_MESH_CELLS, shape.cells, &mesh));
    dfm_body_def d = dfm_body_def_default();
    test::lend(mesh, d);
    test::BodyOptions o;
    o.young = shape.young;
    o.damping_stiffness = 2e-5;
    d.material = test::make_material(in, o);
    const dfm_param_value volume{"volume", &o.volume, 1};
    o.volume = 1;
    d.model_params = {sizeof(dfm_params), 1, &volume};
    d.smooth = smooth;
    // its axis along y, turned about itself, so that it starts on no edge in particular
    const double half = -45 * kDegree, turn = 0.05;
    const double q[4] = {std::sin(half) * std::cos(turn), -std::sin(half) * std::sin(turn),
                         std::cos(half) * std::sin(turn), std::cos(half) * std::cos(turn)};
    std::copy_n(q, 4, d.pose.rotation);
    if (placed) d.pose.position[2] = kR + 1e-5;
    else d.spin[1] = 1;
    d.velocity[0] = speed;
    dfm_body out = 0;
    test::ok(dfm_body_create(in, &d, &out));
    test::ok(dfm_mesh_destroy(mesh));
    return out;
  }
  Roller(const Round &shape, double theta_deg, double speed = 0, double smooth = 40) {
    const dfm_world alone = test::make_world(context, {0, 0, 0});
    const dfm_body_measure m = test::measure(make(shape, alone, false, 0, smooth));
    k = m.angular[1] / (m.mass * kR * kR);
    test::ok(dfm_world_destroy(alone));
    const double theta = theta_deg * kDegree;
    world = test::make_world(context, {kG * std::sin(theta), 0, -kG * std::cos(theta)});
    body = make(shape, world, true, speed, smooth);
    test::add_plane(world, "incline");
    test::set_friction(world, 0.5);
  }
  double speed() { return test::measure(body).velocity[0]; }
};

double acceleration(Roller &r) {
  test::run(r.world, 0.1, 2e-4);
  constexpr int kSamples = 300;
  double tt = 0, tv = 0;
  for (int i = 0; i < kSamples; ++i) {
    const double t = (i - 0.5 * (kSamples - 1)) * 4e-3;
    tt += t * t;
    tv += t * r.speed();
    test::run(r.world, 4e-3, 2e-4);
  }
  return tv / tt;
}

}  // namespace

// unsanitized: too slow there; the other tests have smaller runs
TEST(SmoothRolling, DownASlope_AcceleratesAsRigidBodiesDo) {
  for (const Round &shape : {kBall, kCylinder, kHoop})
    for (const double theta : {5.0, 10.0}) {
      Roller r(shape, theta);
      const double a = kG * std::sin(theta * kDegree) / (1 + r.k);
      EXPECT_NEAR(acceleration(r), a, 0.02 * a) << shape.kind << ", " << theta << " degrees";
    }
}

// The table of doc/concepts/detection.md.
// unsanitized: too slow there
TEST(SmoothRolling, OfFewFacets_LagsWithoutTheKey) {
  for (const Round &shape : {kBall, kCylinder}) {
    double error[2];
    for (int k = 0; k < 2; ++k) {
      Roller r(shape, 5, 0, k ? 40 : 0);
      error[k] = acceleration(r) / (kG * std::sin(5 * kDegree) / (1 + r.k)) - 1;
    }
    std::printf("%-8s %.1f %% facets, %.1f %% smooth\n", shape.kind, 100 * error[0], 100 * error[1]);
    EXPECT_LT(error[0], -0.1) << shape.kind;
    EXPECT_LT(std::fabs(error[1]), 0.02) << shape.kind;
  }
}

TEST(SmoothRolling, ThrownWithoutSpin_RollsAtItsShareOfTheSpeed) {
  for (const Round &shape : {kBall, kCylinder, kHoop}) {
    Roller r(shape, 0, 1);
    test::run(r.world, 0.6, 2e-4);
    double mean = 0;
    for (int i = 0; i < 20; ++i) {
      test::run(r.world, 4e-3, 2e-4);
      mean += r.speed() / 20;
    }
    EXPECT_NEAR(mean, 1 / (1 + r.k), 0.02 / (1 + r.k)) << shape.kind;
  }
}

// A cylinder on its flat end: nothing of it is round, and it holds as a flat one does.
TEST(SmoothRolling, OnItsFlatEnd_DoesNotCreep) {
  test::Context context;
  double way[2];
  for (const bool smooth : {false, true}) {
    const double theta = 10 * kDegree;
    const dfm_world world = test::make_world(context, {kG * std::sin(theta), 0, -kG * std::cos(theta)});
    dfm_mesh_handle mesh = 0;
    test::ok(dfm_mesh_make(context, kCylinder.kind, kCylinder.size.data(), DFM_MESH_CELLS, 500, &mesh));
    dfm_body_def d = dfm_body_def_default();
    test::lend(mesh, d);
    test::BodyOptions o;
    o.young = 1e6;
    o.damping_mass = 20;
    d.material = test::make_material(world, o);
    d.pose.position[2] = 1e-5;
    d.smooth = smooth ? 40 : 0;
    dfm_body body = 0;
    test::ok(dfm_body_create(world, &d, &body));
    test::ok(dfm_mesh_destroy(mesh));
    test::add_plane(world, "incline");
    test::set_friction(world, 0.5);
    test::run(world, 0.6, 2e-4);
    const double x = test::measure(body).com[0];
    test::run(world, 0.5, 2e-4);
    way[smooth] = std::fabs(test::measure(body).com[0] - x);
  }
  EXPECT_LT(way[0], 1e-7);
  EXPECT_EQ(way[1], way[0]);
}

// Its spin turns a free ball of a rigid world, by friction between the two: what is between them is a contact
// offset away, no more, wherever on the curve they touch.
TEST(SmoothRolling, StruckByASpinningBall_KeepsMomentumAndAngularMomentum) {
  test::Context context;
  const dfm_world world = test::make_world(context, {0, 0, 0});
  dfm_mesh_handle mesh = 0;
  test::ok(dfm_mesh_make(context, "ball", kBall.size.data(), DFM_MESH_CELLS, 500, &mesh));
  dfm_body_def d = dfm_body_def_default();
  test::lend(mesh, d);
  test::BodyOptions o;
  o.young = 1e6;
  d.material = test::make_material(world, o);
  const double turned[4] = {0.0848, 0.1696, 0.2544, 0.9483};
  std::copy_n(turned, 4, d.pose.rotation);
  d.smooth = 60;
  dfm_body body = 0;
  test::ok(dfm_body_create(world, &d, &body));
  test::ok(dfm_mesh_destroy(mesh));
  dfm_rigid_def r = dfm_rigid_def_default();
  r.shape = DFM_SHAPE_SPHERE;
  r.radius = kR;
  r.mass = 4;
  r.pose.position[0] = 0.1;
  r.pose.position[2] = 0.185;
  r.velocity[2] = -1;
  r.spin[1] = 20;
  const dfm_rigid ball = test::create(world, {r})[0];
  test::set_friction(world, 0.5);
  const auto all = [&](std::array<double, 6> &out) {
    dfm_body_measure m[2] = {test::measure(body), {}};
    m[1].size = sizeof m[1];
    test::ok(dfm_rigid_get_measure(ball, &m[1]));
    out = {};
    for (const dfm_body_measure &of : m)
      for (int k = 0; k < 3; ++k) {
        const int i = (k + 1) % 3, j = (k + 2) % 3;
        out[size_t(k)] += of.momentum[k];
        out[size_t(3 + k)] += of.angular[k] + of.com[i] * of.momentum[j] - of.com[j] * of.momentum[i];
      }
  };
  std::array<double, 6> before, after;
  all(before);
  test::run(world, 0.1, 1e-4);
  all(after);
  const dfm_body_measure m = test::measure(body);
  EXPECT_GT(std::fabs(m.velocity[0]) + std::fabs(m.velocity[2]), 0.1) << "they have met";
  EXPECT_GT(std::fabs(m.angular[1]), 1e-3);
  for (size_t k = 0; k < 3; ++k) EXPECT_NEAR(after[k], before[k], 1e-10) << k;
  for (size_t k = 3; k < 6; ++k) EXPECT_NEAR(after[k], before[k], 1e-3 * std::fabs(before[4])) << k;
}

// A snapshot has no patches: they come back from the shape at rest, with the cut and without.
TEST(SmoothRolling, CutAndRestored_ContinuesWithTheSameBits) {
  Roller r({"ball", {kR, 0, 0}, 500, 1e5}, 5);
  const auto snapshot = [&] {
    size_t bytes = 0;
    test::ok(dfm_world_snapshot(r.world, nullptr, &bytes));
    std::vector<uint8_t> data(bytes);
    test::ok(dfm_world_snapshot(r.world, data.data(), &bytes));
    return data;
  };
  const auto goes_on = [&](const std::vector<uint8_t> &from) {
    uint64_t hash[2];
    for (uint64_t &of : hash) {
      test::ok(dfm_world_restore(r.world, from.data(), from.size()));
      test::run(r.world, 0.05, 2e-4);
      of = dfm_world_hash(r.world);
    }
    EXPECT_EQ(hash[0], hash[1]);
    return hash[0];
  };
  test::run(r.world, 0.1, 2e-4);
  const std::vector<uint8_t> whole = snapshot();
  test::run(r.world, 0.05, 2e-4);
  const uint64_t expected = dfm_world_hash(r.world);
  const dfm_body_measure m = test::measure(r.body);
  dfm_cut_def d = dfm_cut_def_default();
  d.shape = DFM_CUT_PLANE;
  d.how = DFM_CUT_SPLIT;
  for (int k = 0; k < 3; ++k) d.blade[k] = m.com[k];
  d.blade[4] = 1;
  d.blade[5] = 0.2;
  test::ok(dfm_body_cut(r.body, &d, nullptr));
  test::run(r.world, 0.05, 2e-4);
  goes_on(snapshot());
  EXPECT_EQ(goes_on(whole), expected);
}
