// A fine surface on coarse cells, in the world: queries, loads and contact go through N and its transpose.
#include <cstring>

#include "coupled.h"
#include "query.h"
#include "stack.h"
#include "support.h"

namespace {

using test::Skin;

constexpr double kG = 9.81;
constexpr std::array<double, 3> kSize{0.1, 0.1, 0.1};

struct Block {
  test::Context context;
  dfm_world world;
  dfm_body body = 0;
  Skin skin = test::box_skin(kSize, 12);
  Block(int32_t coupling, double mu, std::array<double, 3> gravity, double support = 0,
        std::array<double, 3> velocity = {}, double height = 2e-5) {
    world = test::make_world(context, gravity);
    const dfm_surface_def surface = skin.def(coupling, support);
    test::BodyOptions o;
    o.name = "block";
    o.young = 1e6;
    o.damping_stiffness = 1e-3;
    o.velocity = velocity;
    o.position = {-0.05, -0.05, height};
    o.surface = &surface;
    body = test::make_body(context, world, "beam", kSize, 60, o);
    test::add_plane(world, "floor");
    test::set_friction(world, mu);
  }
};

double norm(const double *a) { return std::sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]); }

// Three numbers for each point, of that name in a file of the surface.
std::vector<double> vectors(const std::string &path, const std::string &name) {
  const std::string file = test::read_file(path);
  const size_t at = file.find("offset=\"", file.find("Name=\"" + name + "\""));
  const size_t data = file.find("<AppendedData");
  if (at == std::string::npos || data == std::string::npos) return {NAN};
  const char *const first = file.data() + file.find('_', data) + 1 + std::stoul(file.substr(at + 8));
  uint64_t bytes = 0;
  std::memcpy(&bytes, first, sizeof bytes);
  std::vector<double> out(bytes / sizeof(double));
  std::memcpy(out.data(), first + sizeof bytes, bytes);
  return out;
}

}  // namespace

TEST(Coupled, RestingBlock_CarriesItsWeightAndEveryImpulseArrives) {
  for (const auto &[coupling, support] :
       {std::pair{DFM_COUPLING_BARYCENTRIC, 0.0}, {DFM_COUPLING_MLS, 1.5}}) {
    Block b(coupling, 0.5, {0, 0, -kG}, support);
    double worst = 0, weight = 0;
    // the first touch of 150 surfels that hang on nine phyxels takes all 50 sweeps with mls; rest must not
    uint64_t landing = 0;
    const double mass = test::measure(b.body).mass;
    for (int i = 0; i < 400; ++i) {
      const dfm_body_measure before = test::measure(b.body);
      test::run(b.world, 1e-3, 1e-3);
      const dfm_body_measure after = test::measure(b.body);
      if (i == 9) landing = test::stats(b.world).unconverged;
      for (int k = 0; k < 3; ++k) {
        const double impulse = after.contact_impulse[k] - before.contact_impulse[k];
        const double fall = k == 2 ? -kG * mass * 1e-3 : 0;
        worst = std::max(worst, std::fabs(after.momentum[k] - before.momentum[k] - fall - impulse));
      }
      if (i >= 350) weight += (after.contact_impulse[2] - before.contact_impulse[2]) / 1e-3 / 50;
    }
    EXPECT_LT(worst, 1e-12 * mass * kG * 1e-3 * 400) << "momentum that no contact gave";
    EXPECT_NEAR(weight, mass * kG, 1e-3 * mass * kG);
    double normal = 0;
    for (const dfm_contact &c : test::contacts(b.world)) normal += c.fn;
    EXPECT_NEAR(normal, mass * kG, 1e-2 * mass * kG);
    EXPECT_EQ(test::stats(b.world).unconverged, landing);
    EXPECT_LE(landing, 1u);
    EXPECT_GT(test::contacts(b.world).size(), 20u) << "surfels touch, not the nine phyxels below";
    const double lowest = [&] {
      double z = 1;
      const std::vector<double> x = test::surface_positions(b.body);
      for (size_t i = 2; i < x.size(); i += 3) z = std::min(z, x[i]);
      return z;
    }();
    EXPECT_GT(lowest, 0) << "no surfel below the plane";
  }
}

TEST(Coupled, SlidingBlock_AcceleratesWithGSinMinusMuCos) {
  const double theta = 30 * M_PI / 180, mu = 0.3, expected = kG * (std::sin(theta) - mu * std::cos(theta));
  Block b(DFM_COUPLING_BARYCENTRIC, mu, {kG * std::sin(theta), 0, -kG * std::cos(theta)});
  test::run(b.world, 0.1, 1e-3);
  const double v0 = test::measure(b.body).velocity[0];
  test::run(b.world, 0.3, 1e-3);
  EXPECT_NEAR((test::measure(b.body).velocity[0] - v0) / 0.3, expected, 0.01 * expected);
}

TEST(Coupled, Slope26Point5_HoldsAt05AndSlidesAt049) {
  for (const double mu : {0.5, 0.49}) {
    Block b(DFM_COUPLING_BARYCENTRIC, mu, {0, 0, -kG});
    std::vector<dfm_vector_key> keys;
    for (int i = 0; i <= 100; ++i) {
      const double s = i / 100.0, a = 26.5 * M_PI / 180 * s * s * (3 - 2 * s);
      keys.push_back({0.1 + s, {kG * std::sin(a), 0, -kG * std::cos(a)}});
    }
    test::ok(dfm_world_set_gravity_keys(b.world, uint32_t(keys.size()), keys.data()));
    test::run(b.world, 1.3, 1e-3);
    const double x0 = test::measure(b.body).com[0];
    test::run(b.world, 0.4, 1e-3);
    const double moved = test::measure(b.body).com[0] - x0;
    if (mu == 0.5) {
      EXPECT_LT(std::fabs(moved), 1e-7);
    } else {
      EXPECT_GT(moved, 0.5 * 0.4 * 0.4 * 0.0753 * 0.25) << "a quarter of what g (sin - mu cos) gives";
    }
  }
}

// The boundary of the cells, once as it is and once as a surface of its own: the same motion through N
// as without it.
TEST(Coupled, BoundaryThroughTheMatrix_MovesAsTheBoundary) {
  std::vector<double> end[2];
  uint64_t hash[2];
  Skin skin;
  for (int through = 0; through < 2; ++through) {
    test::Context context;
    const dfm_world w = test::make_world(context);
    test::BodyOptions o;
    o.young = 2e5;
    o.damping_stiffness = 1e-3;
    if (!through) {
      const dfm_world plain = test::make_world(context);
      skin = test::boundary_skin(test::make_body(context, plain, "beam", kSize, 200, o));
    }
    const dfm_surface_def surface = skin.def();
    if (through) o.surface = &surface;
    o.position = {0.3, -0.2, 0.05};
    o.rotation = {0.1, 0.2, 0.3, std::sqrt(1 - 0.14)};
    o.velocity = {1, 0, -1};
    o.spin = {3, 2, 1};
    const dfm_body b = test::make_body(context, w, "beam", kSize, 200, o);
    test::add_plane(w, "floor");
    test::set_friction(w, 0.4);
    test::run(w, 0.3, 1e-3);
    EXPECT_GE(test::stats(w).contacts_max, 3u);
    end[through] = test::surface_positions(b);
    hash[through] = dfm_world_hash(w);
    const std::string plan = test::explain(w);
    const std::string running =
        plan.substr(plan.find("\"stages\""), plan.find("\"absent\"") - plan.find("\"stages\""));
    EXPECT_EQ(running.find("\"gather\"") != std::string::npos, through == 1) << plan;
    uint32_t n = 0;
    test::ok(dfm_world_profile(w, 0, nullptr, &n));
    std::vector<dfm_stage_time> stages(n);
    test::ok(dfm_world_profile(w, n, stages.data(), &n));
    uint64_t gathers = 0;
    for (const dfm_stage_time &s : stages) gathers += std::string(s.name) == "gather" ? s.calls : 0;
    EXPECT_EQ(gathers, through ? test::stats(w).substeps : 0)
        << "a surface that hangs on nothing else costs no stage";
  }
  ASSERT_EQ(end[0].size(), end[1].size());
  for (size_t i = 0; i < end[0].size(); ++i) EXPECT_NEAR(end[0][i], end[1][i], 1e-12);
  EXPECT_EQ(hash[0], hash[1]) << "weights of one change no bit";
}

TEST(Coupled, Queries_SpeakOfTheSurfaceGiven) {
  test::Context context;
  const dfm_world w = test::make_world(context, {0, 0, 0});
  const Skin skin = test::ball_skin(0.09, 3);
  const dfm_surface_def surface = skin.def();
  test::BodyOptions o;
  o.name = "ball";
  o.surface = &surface;
  o.position = {1, 2, 3};
  o.rotation = {0, 0, std::sin(0.5), std::cos(0.5)};
  o.velocity = {1, 0, 0};
  o.spin = {0, 0, 2};
  const dfm_body b = test::make_body(context, w, "ball", {0.1, 0, 0}, 300, o);
  const std::vector<double> x = test::surface_positions(b);
  ASSERT_EQ(x.size(), skin.points.size());
  EXPECT_EQ(test::surface_triangles(b), skin.triangles);
  std::vector<double> v(x.size()), normal(x.size());
  uint32_t n = 0;
  test::ok(dfm_surface_velocities(b, skin.npoint(), v.data(), &n));
  test::ok(dfm_surface_normals(b, skin.npoint(), normal.data(), &n));
  for (size_t i = 0; i < x.size(); i += 3) {
    const double *const p = &skin.points[i], at[3] = {x[i] - 1, x[i + 1] - 2, x[i + 2] - 3};
    EXPECT_NEAR(at[0], std::cos(1.0) * p[0] - std::sin(1.0) * p[1], 1e-14);
    EXPECT_NEAR(at[1], std::sin(1.0) * p[0] + std::cos(1.0) * p[1], 1e-14);
    EXPECT_NEAR(at[2], p[2], 1e-14);
    EXPECT_NEAR(v[i], 1 - 2 * at[1], 1e-13)
        << "rotation about the center of mass, which is the ball's to rounding";
    EXPECT_NEAR(v[i + 1], 2 * at[0], 1e-13);
    EXPECT_GT((normal[i] * at[0] + normal[i + 1] * at[1] + normal[i + 2] * at[2]) / norm(at), 0.99);
  }
  EXPECT_EQ(dfm_surface_points(b, 0, nullptr, &n), DFM_E_UNSUPPORTED);
  EXPECT_NE(std::string(dfm_last_error()).find("several points"), std::string::npos) << dfm_last_error();
  EXPECT_NEAR(test::ray(w, {1.001, 2.002, 10}, {0, 0, -1}, 100).point[2], 3.09, 1e-3);
  EXPECT_NEAR(test::nearest(w, test::point({1, 2, 2}), nullptr, 100).distance, 1 - 0.09, 1e-3);
}

TEST(Coupled, Impulse_AtASurfelGivesItsMomentumAndTurnsTheBody) {
  for (const int32_t coupling : {DFM_COUPLING_BARYCENTRIC, DFM_COUPLING_MLS}) {
    test::Context context;
    const dfm_world w = test::make_world(context, {0, 0, 0});
    const Skin skin = test::ball_skin(0.09, 3);
    const dfm_surface_def surface = skin.def(coupling, 1.5);
    test::BodyOptions o;
    o.surface = &surface;
    o.position = {0.5, 0, 0};
    const dfm_body b = test::make_body(context, w, "ball", {0.1, 0, 0}, 300, o);
    const double point[3] = {0.5 + 0.09, 0, 0}, impulse[3] = {0.1, 0.2, -0.3};
    test::ok(dfm_body_apply_impulse(b, point, impulse));
    const dfm_body_measure m = test::measure(b);
    const double com[3] = {m.com[0] - point[0], m.com[1] - point[1], m.com[2] - point[2]};
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(m.momentum[k], impulse[k], 1e-15);
    for (int k = 0; k < 3; ++k) {
      const int i = (k + 1) % 3, j = (k + 2) % 3;
      EXPECT_NEAR(m.angular[k], -(com[i] * impulse[j] - com[j] * impulse[i]), 1e-14 * 0.4)
          << "to the rounding of the center of mass, 0.5 m from zero";
    }
    // power: what the surfel's new velocity says of the work done is the kinetic energy, as for any linear
    // map and its transpose
    const std::vector<double> x = test::surface_positions(b);
    std::vector<double> v(x.size());
    uint32_t n = 0;
    test::ok(dfm_surface_velocities(b, skin.npoint(), v.data(), &n));
    for (size_t i = 0; i < x.size(); i += 3)
      if (std::fabs(x[i] - point[0]) + std::fabs(x[i + 1]) + std::fabs(x[i + 2]) < 1e-12) {
        EXPECT_NEAR(0.5 * (v[i] * impulse[0] + v[i + 1] * impulse[1] + v[i + 2] * impulse[2]), m.kinetic,
                    1e-13 * m.kinetic);
      }
  }
}

TEST(Coupled, HeldPoints_HoldTheSurfaceOverThem) {
  test::Context context;
  const dfm_world w = test::make_world(context);
  const Skin skin = test::box_skin({0.4, 0.05, 0.05}, 16);
  const dfm_surface_def surface = skin.def();
  test::BodyOptions o;
  o.surface = &surface;
  o.young = 1e6;
  o.damping_stiffness = 1e-3;
  const dfm_body b = test::make_body(context, w, "beam", {0.4, 0.05, 0.05}, 200, o);
  const std::vector<double> p = test::State(b).x;
  const uint32_t n = uint32_t(p.size() / 3);
  std::vector<uint32_t> held;
  for (uint32_t i = 0; i < n; ++i)
    if (p[3 * i] < 1e-9) held.push_back(i);
  test::ok(dfm_body_hold(b, uint32_t(held.size()), held.data(), 7));
  test::run(w, 0.2, 1e-3);
  const std::vector<double> x = test::surface_positions(b);
  double tip = 0;
  for (size_t i = 0; i < x.size(); i += 3) {
    for (size_t k = 0; k < 3 && skin.points[i] == 0; ++k) EXPECT_NEAR(x[i + k], skin.points[i + k], 1e-15);
    tip = std::min(tip, x[i + 2] - skin.points[i + 2]);
  }
  EXPECT_LT(tip, -1e-3);
}

// `u` of the surface file: displacement from the surface as it was given.
TEST(Coupled, SurfaceFile_HoldsTheTrueDisplacement) {
  test::Context context;
  const dfm_world w = test::make_world(context, {0, 0, 0});
  const Skin skin = test::box_skin(kSize, 3);
  const dfm_surface_def surface = skin.def();
  test::BodyOptions o;
  o.surface = &surface;
  o.position = {0.25, 0.5, -1};
  const dfm_body b = test::make_body(context, w, "beam", kSize, 60, o);
  const std::string path = test::scratch("coupling") + "/skin.vtu";
  test::ok(dfm_debug_write_surface(b, path.c_str()));
  const std::vector<double> moved = vectors(path, "u");
  EXPECT_EQ(moved.size(), skin.points.size());
  for (const double u : moved) EXPECT_NEAR(u, 0, 1e-15) << "it rests at its pose";
}

// Forces of a floor that is there no more are not told.
TEST(Coupled, SurfaceFile_HasNoForcesOfWhatIsGone) {
  test::Context context;
  const dfm_world w = test::make_world(context);
  const dfm_obstacle floor = test::add_plane(w, "floor");
  const dfm_body b = test::make_body(context, w, "beam", kSize, 60, {});
  const std::string path = test::scratch("coupling") + "/falls.vtu";
  const auto most = [&] {
    test::ok(dfm_debug_write_surface(b, path.c_str()));
    double out = 0;
    for (const double f : vectors(path, "force")) out = std::max(out, std::fabs(f));
    return out;
  };
  for (int i = 0; i < 20; ++i) test::ok(dfm_world_step(w, 1e-3, nullptr));
  EXPECT_GT(most(), 0);
  test::ok(dfm_obstacle_destroy(floor));
  test::ok(dfm_world_step(w, 1e-3, nullptr));
  EXPECT_EQ(most(), 0);
}

// An error in a surface is one sentence, and no body is created.
TEST(Coupled, WrongSurfaces_AreRefusedInOneSentence) {
  test::Context context;
  const dfm_world w = test::make_world(context);
  const double points[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
  const uint32_t tets[] = {0, 1, 2, 3};
  const auto refuse = [&](const Skin &skin, const char *sentence, auto spoil) {
    dfm_surface_def s = skin.def();
    spoil(s);
    dfm_body_def d = dfm_body_def_default();
    d.name = "soft";
    d.npoint = 4;
    d.ntet = 1;
    d.points = points;
    d.tets = tets;
    d.surface = &s;
    dfm_body b = 7;
    EXPECT_EQ(dfm_body_create(w, &d, &b), DFM_E_ARG) << sentence;
    EXPECT_NE(std::string(dfm_last_error()).find(sentence), std::string::npos) << dfm_last_error();
    EXPECT_NE(std::string(dfm_last_error()).find("'soft'"), std::string::npos) << dfm_last_error();
    EXPECT_EQ(dfm_world_find_body(w, "soft", &b), DFM_E_ARG) << "nothing is left of it";
  };
  const Skin good = test::box_skin({0.2, 0.2, 0.2}, 2);
  const auto nothing = [](dfm_surface_def &) {};
  refuse(good, "coupling 3 is unknown", [](dfm_surface_def &s) { s.coupling = 3; });
  refuse(good, "support is -1", [](dfm_surface_def &s) { s.support = -1; });
  refuse(good, "support is nan", [](dfm_surface_def &s) { s.support = NAN; });
  refuse(good, "support is 11", [](dfm_surface_def &s) { s.support = 11; });
  refuse(good, "surface->size is 8", [](dfm_surface_def &s) { s.size = 8; });
  refuse(good, "0 triangles", [](dfm_surface_def &s) { s.ntriangle = 0; });
  refuse(good, "needs at least 3 points", [](dfm_surface_def &s) { s.points = nullptr; });
  Skin bad = good;
  bad.points[4] = INFINITY;
  refuse(bad, "surface point 1 is not finite", nothing);
  bad = good;
  bad.triangles[7] = 1000;
  refuse(bad, "surface triangle 2 names point 1000 of 26", nothing);
  bad = good;
  bad.triangles[4] = bad.triangles[3];
  refuse(bad, "surface triangle 1 names a point twice", nothing);
  bad = good;
  bad.points.insert(bad.points.end(), {0, 0, 0});
  refuse(bad, "surface point 26 belongs to no triangle", nothing);
  bad = good;
  for (size_t t = 0; t < bad.triangles.size(); t += 3) std::swap(bad.triangles[t], bad.triangles[t + 1]);
  refuse(bad, "faces inward", nothing);
  bad = good;
  for (double &x : bad.points) x *= 1000;
  refuse(bad, "same frame and unit", nothing);
}
