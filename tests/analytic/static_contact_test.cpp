// Equilibrium with contact and Coulomb friction (dfm_world_equilibrium): closed forms, the limit of a slope,
// balance, the order of loads, what finds no rest. Sources: doc/concepts/static.md;
// reference/contact (incline_block, box_stack, squeezed_ball_fe).
#include "stack.h"

#include "cells.h"
#include "contact_elastic.h"
#include "obstacle.h"
#include "support.h"

namespace {

constexpr double kG = 9.81, kEdge = 0.1, kOffset = 5e-5;

test::BodyOptions cube(const char *name, double young, double z, const char *model = "corotational_fem") {
  test::BodyOptions o;
  o.name = name;
  o.model = model;
  o.young = young;
  o.position = {0, 0, z};
  return o;
}

dfm_body make_cube(dfm_context *c, dfm_world w, const test::BodyOptions &o) {
  return test::make_body(c, w, "beam", {kEdge, kEdge, kEdge}, 60, o);
}

dfm_world offset_world(dfm_context *c, std::array<double, 3> gravity) {
  dfm_world_def d = dfm_world_def_default();
  for (int k = 0; k < 3; ++k) d.gravity[k] = gravity[k];
  d.contact_offset = kOffset;
  dfm_world w = 0;
  test::ok(dfm_world_create(c, &d, &w));
  return w;
}

dfm_status find(dfm_world w, double time = 0, uint32_t load_steps = 1, dfm_equilibrium_info *info = nullptr) {
  dfm_equilibrium_def def = dfm_equilibrium_def_default();
  def.time = time;
  def.load_steps = load_steps;
  return dfm_world_equilibrium(w, &def, info);
}

std::vector<double> positions(dfm_body b) { return test::State(b).x; }

// Points that lie at z, within 1e-9 m.
std::vector<uint32_t> layer(dfm_body b, double z) {
  const std::vector<double> x = positions(b);
  std::vector<uint32_t> found;
  for (uint32_t i = 0; i < x.size() / 3; ++i)
    if (std::fabs(x[3 * i + 2] - z) < 1e-9) found.push_back(i);
  return found;
}

void hold(dfm_body b, double z, uint8_t axes) {
  const std::vector<uint32_t> points = layer(b, z);
  test::ok(dfm_body_hold(b, uint32_t(points.size()), points.data(), axes));
}

double height(dfm_body b) { return test::measure(b).com[2]; }
double weight(dfm_body b) { return test::measure(b).mass * kG; }

// The resultant on a of its pair with b.
dfm_pair_report pair_of(dfm_world w, uint64_t a, uint64_t b) {
  for (const dfm_pair_report &p : test::pairs(w))
    if (p.a == a && p.b == b) return p;
  ADD_FAILURE() << "the pair does not touch";
  return {};
}

void load_all(dfm_body b, std::array<double, 3> total) {
  const uint32_t n = uint32_t(positions(b).size() / 3);
  std::vector<uint32_t> points(n);
  std::vector<double> f(3 * size_t(n));
  for (uint32_t i = 0; i < n; ++i) {
    points[i] = i;
    for (size_t k = 0; k < 3; ++k) f[3 * i + k] = total[k] / n;
  }
  test::ok(dfm_body_add_load(b, n, points.data(), f.data(), 0, nullptr, nullptr, nullptr));
}

}  // namespace

// The static answer without contact comes from the same mesh with its bottom held along z.
TEST(StaticContact, CubeOnPlane_SinksByItsStaticSagUnderItsWeight) {
  for (const char *model : {"msm", "linear_fem", "corotational_fem"})
    for (const double young : {1e4, 1e5, 1e7}) {
      test::Context context;
      const dfm_world held = test::make_world(context), w = offset_world(context, {0, 0, -kG});
      const dfm_body still = make_cube(context, held, cube("still", young, 0, model));
      hold(still, 0, 4);
      const double start = height(still);
      test::ok(find(held));
      const dfm_body b = make_cube(context, w, cube("cube", young, 1e-3, model));
      const dfm_obstacle floor = test::add_plane(w, "floor");
      test::set_friction(w, 0, "none");
      dfm_equilibrium_info info{};
      info.size = sizeof info;
      test::ok(find(w, 0, 1, &info));
      EXPECT_NEAR((start + kOffset - height(b)) / (start - height(still)), 1, 0.005)
          << model << ", " << young << " Pa";
      const dfm_pair_report p = pair_of(w, b, floor);
      EXPECT_NEAR(p.force[2] / weight(b), 1, 1e-6);
      EXPECT_LT(std::hypot(p.moment[0], p.moment[1]), 1e-6 * weight(b) * kEdge);
      EXPECT_LE(info.residual, 1e-6);
      EXPECT_EQ(dfm_world_time(w), 0);
      EXPECT_EQ(test::measure(b).speed_max, 0);
      // and steps in time leave it there, as closely as they solve contact
      const double found = height(b);
      test::run(w, 0.01, 1e-3);
      EXPECT_NEAR(height(b), found, 0.005 * kOffset + 1e-3 * (start - height(still)));
      dfm_world_destroy(held);
      dfm_world_destroy(w);
    }
}

// Points that are held where they touch feel no contact: the answer is that without the floor.
TEST(StaticContact, CubeThatIsHeldOnItsFloor_SagsAsWithoutIt) {
  test::Context context;
  double found[2];
  for (const bool floor : {false, true}) {
    const dfm_world w = offset_world(context, {0, 0, -kG});
    const dfm_body b = make_cube(context, w, cube("cube", 1e5, 0));
    hold(b, 0, 7);
    if (floor) test::add_plane(w, "floor");
    test::ok(find(w));
    found[floor] = height(b);
    dfm_world_destroy(w);
  }
  EXPECT_NEAR(found[1], found[0], 1e-9);
}

// Rows of box_stack: cubes of edge 0.1 m with Poisson's ratio 0, shortening of a bar under its weight.
TEST(StaticContact, ThreeCubes_CarryWhatIsAboveAndShortenAsABar) {
  const double young = 1e5, g = kG;
  test::Context context;
  const dfm_world w = offset_world(context, {0, 0, -g});
  std::vector<dfm_body> cubes;
  for (int k = 0; k < 3; ++k) {
    test::BodyOptions o = cube(("cube" + std::to_string(k)).c_str(), young, 2e-4 + k * (kEdge + 2e-4));
    o.poisson = 0;
    o.position[0] = 0.001 * k;
    o.position[1] = 0.0007 * k;
    cubes.push_back(make_cube(context, w, o));
  }
  const dfm_obstacle floor = test::add_plane(w, "floor");
  test::set_friction(w, 0.5);
  const double top = 3 * kEdge + 3 * kOffset;
  const std::vector<uint32_t> top_layer = layer(cubes[2], 3 * kEdge + 6e-4);
  test::ok(find(w));
  const double one = weight(cubes[0]);
  EXPECT_NEAR(pair_of(w, cubes[0], floor).force[2] / (3 * one), 1, 1e-6);
  EXPECT_NEAR(pair_of(w, cubes[0], cubes[1]).force[2] / (-2 * one), 1, 1e-6);
  EXPECT_NEAR(pair_of(w, cubes[1], cubes[2]).force[2] / -one, 1, 1e-6);
  const std::vector<double> x = positions(cubes[2]);
  double up = 0;
  for (const uint32_t i : top_layer) up += x[3 * i + 2] / double(top_layer.size());
  EXPECT_NEAR((top - up) / (1000 * g * 9 * kEdge * kEdge / (2 * young)), 1, 0.03);
  dfm_world_destroy(w);
}

// tan 26.5 degrees = 0.4986.
TEST(StaticContact, SlopeOf26Point5Degrees_HoldsAt05AndFindsNoRestAt049) {
  const double a = 26.5 * M_PI / 180;
  for (const char *law : {"coulomb", "karnopp", "dahl", "lugre", "elastoplastic", "gms"})
    for (const double mu : {0.49, 0.5}) {
      test::Context context;
      const dfm_world w = test::make_world(context, {kG * std::sin(a), 0, -kG * std::cos(a)});
      const dfm_body b = make_cube(context, w, cube("block", 1e6, 1e-4));
      const dfm_obstacle floor = test::add_plane(w, "floor");
      test::set_friction(w, mu, law);
      if (mu == 0.5) {
        test::ok(find(w));
        const dfm_pair_report p = pair_of(w, b, floor);
        EXPECT_NEAR(-p.friction[0] / (weight(b) * std::sin(a)), 1, 1e-6) << law;
      } else {
        EXPECT_EQ(find(w), DFM_E_DIVERGED) << law;
        test::says({"'block'", "finds no rest", "friction"});
      }
      dfm_world_destroy(w);
    }
}

TEST(StaticContact, LoadAlongThePlane_IsCarriedByFrictionBelowItsLimit) {
  const double mu = 0.5;
  for (const double share : {0.3, 0.9, 1.1}) {
    test::Context context;
    const dfm_world w = test::make_world(context);
    const dfm_body b = make_cube(context, w, cube("block", 1e5, 1e-4));
    const dfm_obstacle floor = test::add_plane(w, "floor");
    test::set_friction(w, mu);
    const double load = share * mu * weight(b);
    load_all(b, {0, load, 0});
    if (share > 1) {
      EXPECT_EQ(find(w), DFM_E_DIVERGED);
      dfm_world_destroy(w);
      continue;
    }
    test::ok(find(w));
    const dfm_pair_report p = pair_of(w, b, floor);
    EXPECT_NEAR(p.friction[1] / -load, 1, 1e-6);
    EXPECT_NEAR(p.force[2] / weight(b), 1, 1e-6);
    uint32_t carry = 0, stick = 0;
    for (const dfm_contact &c : test::contacts(w)) {
      EXPECT_LE(std::hypot(c.ft[0], c.ft[1]), mu * c.fn * (1 + 1e-9) + 1e-9);
      carry += c.fn > 0;
      stick += c.fn > 0 && (c.flags & DFM_CONTACT_STICKING);
    }
    EXPECT_GT(stick, 0u);
    if (share < 0.5) {
      EXPECT_GT(2 * stick, carry);
    }
    dfm_world_destroy(w);
  }
}

// A cube whose top is held is pressed on the plane by a way along z and moved by a way along x. Moved first,
// it does not touch, and no friction is left. Pressed first, it sticks: its bottom is as if it were bonded.
TEST(StaticContact, PressedThenMoved_IsNotMovedThenPressed) {
  const double down = 1e-3, aside = 1e-4, young = 1e5;
  double friction[2] = {}, normal[2] = {};
  for (const int pressed_first : {0, 1}) {
    test::Context context;
    const dfm_world w = offset_world(context, {0, 0, 0});
    const dfm_body b = make_cube(context, w, cube("cube", young, kOffset + 1e-4, "linear_fem"));
    const dfm_obstacle floor = test::add_plane(w, "floor");
    test::set_friction(w, 5);  // nothing slips
    const std::vector<uint32_t> top = layer(b, kOffset + 1e-4 + kEdge);
    test::ok(dfm_body_hold(b, uint32_t(top.size()), top.data(), 7));
    const double x = pressed_first ? 0 : aside, z = pressed_first ? -1e-4 - down : 0;
    const dfm_pose_key keys[] = {{0, {{0, 0, 0}, {0, 0, 0, 1}}},
                                 {1, {{x, 0, z}, {0, 0, 0, 1}}},
                                 {2, {{aside, 0, -1e-4 - down}, {0, 0, 0, 1}}}};
    test::ok(dfm_body_move_held(b, uint32_t(top.size()), top.data(), 3, keys, nullptr));
    test::ok(find(w, 2, 2));
    EXPECT_EQ(dfm_world_time(w), 2);
    const dfm_pair_report p = pair_of(w, b, floor);
    friction[pressed_first] = p.friction[0];
    normal[pressed_first] = p.normal;
    dfm_world_destroy(w);
  }
  // bonded: the bottom held, reactions by the balance of the upper layer
  test::Context context;
  const dfm_world w = test::make_world(context, {0, 0, 0});
  const dfm_body b = make_cube(context, w, cube("cube", young, 0, "linear_fem"));
  hold(b, 0, 7);
  const std::vector<uint32_t> top = layer(b, kEdge);
  test::ok(dfm_body_hold(b, uint32_t(top.size()), top.data(), 7));
  const dfm_pose_key keys[] = {{0, {{0, 0, 0}, {0, 0, 0, 1}}}, {1, {{aside, 0, 0}, {0, 0, 0, 1}}}};
  test::ok(dfm_body_move_held(b, uint32_t(top.size()), top.data(), 2, keys, nullptr));
  test::ok(find(w, 1, 1));
  // 2 U = force times way
  const double bonded = 2 * test::measure(b).elastic / aside;
  EXPECT_NEAR(friction[1] / -bonded, 1, 0.01);
  EXPECT_LT(std::fabs(friction[0]), 1e-3 * bonded);
  EXPECT_NEAR(normal[0] / normal[1], 1, 1e-3);
  dfm_world_destroy(w);
}

TEST(StaticContact, WithoutAnEquilibrium_NothingChanges) {
  const double a = 26.5 * M_PI / 180;
  test::Context context;
  const dfm_world w = test::make_world(context, {kG * std::sin(a), 0, -kG * std::cos(a)});
  make_cube(context, w, cube("block", 1e6, 1e-4));
  test::add_plane(w, "floor");
  test::set_friction(w, 0.2);
  test::ok(dfm_world_set_sleep(w, true));
  test::run(w, 0.02, 1e-3);
  const std::string before = test::snapshot(w);
  EXPECT_EQ(find(w), DFM_E_DIVERGED);
  EXPECT_TRUE(test::snapshot(w) == before);
  // and it continues like a world without the call
  const uint64_t requested = (test::run(w, 0.02, 1e-3), dfm_world_hash(w));
  test::ok(dfm_world_restore(w, before.data(), before.size()));
  test::run(w, 0.02, 1e-3);
  EXPECT_EQ(dfm_world_hash(w), requested);
  dfm_world_destroy(w);
}

TEST(StaticContact, Interrupted_EndsWithTheWorldAsItWas) {
  test::Context context;
  const test::Stack s = test::make_stack(context);
  test::run(s.world, 1e-3, 1e-3);
  const std::string before = test::snapshot(s.world);
  test::ok(dfm_world_interrupt(s.world));
  EXPECT_EQ(find(s.world), DFM_DISCARD);
  test::says({"interrupted"});
  EXPECT_TRUE(test::snapshot(s.world) == before);
  dfm_world_destroy(s.world);
}

// Explicit bodies are moved implicitly for the search alone, and the same on any number of threads.
// unsanitized: too slow there; determinism/ has smaller scenes on threads
TEST(StaticContact, Stack_StaysWhereItWasFoundOnAnyNumberOfThreads) {
  uint64_t hash[2];
  for (const uint32_t threads : {1u, 4u}) {
    test::Context context(threads);
    const test::Stack s = test::make_stack(context);
    test::ok(find(s.world));
    hash[threads > 1] = dfm_world_hash(s.world);
    EXPECT_EQ(test::stats(s.world).steps, 0u);
    const double before = height(s.upper);
    test::ok(dfm_world_hold_begin(s.world));
    test::run(s.world, 0.1, 1e-3);
    EXPECT_GT(test::stats(s.world).substeps, 100u);  // explicit again
    EXPECT_NEAR(height(s.upper), before, 2e-6);
    dfm_world_destroy(s.world);
  }
  EXPECT_EQ(hash[0], hash[1]);
}

// A body that hangs on a spring and leans on the floor: what the spring does not carry the floor does.
TEST(StaticContact, SpringAndFloor_ShareTheWeight) {
  test::Context context;
  const dfm_world w = offset_world(context, {0, 0, -kG});
  const dfm_body b = make_cube(context, w, cube("cube", 1e6, kOffset));
  const dfm_obstacle floor = test::add_plane(w, "floor");
  const std::vector<uint32_t> top = layer(b, kOffset + kEdge);
  dfm_spring_def s{};
  s.size = sizeof s;
  s.npoint = uint32_t(top.size());
  s.points = top.data();
  const std::vector<double> even(top.size(), 1.0);
  s.weights = even.data();
  s.stiffness = 1000;
  s.to[0] = s.to[1] = kEdge / 2;
  s.to[2] = kOffset + kEdge + 0.004;
  test::ok(dfm_body_add_spring(b, &s, nullptr));
  test::ok(find(w));
  const std::vector<double> x = positions(b);
  double up = 0;
  for (const uint32_t i : top) up += x[3 * i + 2] / double(top.size());
  const double pull = s.stiffness * (s.to[2] - up);
  EXPECT_NEAR(pull, 4, 0.1);
  EXPECT_NEAR((pair_of(w, b, floor).force[2] + pull) / weight(b), 1, 1e-6);
  dfm_world_destroy(w);
}

// What moves carries what rests on it, however fast: only the way counts, and no time passes that a step of
// the search could divide.
TEST(StaticContact, TrayThatMoves_CarriesTheCube) {
  const test::Triangles triangles = test::box_surface({0.5, 0.5, 0.1}, 10);
  for (const bool mesh : {false, true})
    for (const uint32_t load_steps : {1u, 4u}) {
      SCOPED_TRACE(testing::Message() << (mesh ? "mesh, " : "box, ") << load_steps << " load steps");
      test::Context context;
      const dfm_world w = offset_world(context, {0, 0, -kG});
      const dfm_body b = make_cube(context, w, cube("cube", 1e5, kOffset));
      dfm_pose_key keys[2] = {};
      for (dfm_pose_key &key : keys) key.pose = {{0, 0, -0.1}, {0, 0, 0, 1}};
      keys[1].t = 1;
      keys[1].pose.position[0] = 1.5;
      dfm_obstacle_def d = mesh ? test::mesh_def("tray", triangles) : dfm_obstacle_def_default();
      if (!mesh) d.shape = DFM_SHAPE_BOX;
      d.half_size[0] = d.half_size[1] = 0.5;
      d.half_size[2] = 0.1;
      d.nkey = 2;
      d.keys = keys;
      dfm_obstacle tray = 0;
      test::ok(dfm_obstacle_create(w, &d, &tray));
      test::set_friction(w, 0.8);
      const double before = test::measure(b).com[0];
      test::ok(find(w, 1, load_steps));
      EXPECT_NEAR(test::measure(b).com[0] - before, 1.5, 2e-4);
      dfm_world_destroy(w);
    }
}

// The foot of the sphere on a face moves by more than the corner that gives way under it. Without friction
// nothing else holds the contact there, and the path to it does not matter.
TEST(StaticContact, SphereInAHeldBlock_IsFoundOnAnyPath) {
  for (const char *model : {"linear_fem", "corotational_fem", "msm"}) {
    double first = 0;
    for (const uint32_t load_steps : {1u, 5u}) {
      test::Context context;
      const dfm_world w = offset_world(context, {0, 0, 0});
      const dfm_body b =
          test::make_body(context, w, "beam", {0.2, 0.2, 0.1}, 4000, cube("block", 1e5, 0, model));
      hold(b, 0, 7);
      const auto start = test::measure(b);
      const double depth = 4e-3, radius = 0.05;
      dfm_pose_key keys[2] = {};
      for (dfm_pose_key &key : keys)
        key.pose = {{start.com[0], start.com[1], 0.1 + radius + 5e-4}, {0, 0, 0, 1}};
      keys[1].t = 1;
      keys[1].pose.position[2] = 0.1 + radius - depth;
      dfm_obstacle_def d = dfm_obstacle_def_default();
      d.shape = DFM_SHAPE_SPHERE;
      d.radius = radius;
      d.nkey = 2;
      d.keys = keys;
      dfm_obstacle ball = 0;
      test::ok(dfm_obstacle_create(w, &d, &ball));
      test::set_friction(w, 0, "none");
      dfm_equilibrium_info info{};
      info.size = sizeof info;
      ASSERT_EQ(find(w, 1, load_steps, &info), DFM_OK) << model << ": " << dfm_last_error();
      EXPECT_LE(info.residual, 1e-6);
      EXPECT_LT(info.iterations, 50 * load_steps);
      const double force = -pair_of(w, b, ball).force[2];
      if (load_steps == 1) first = force;
      // both end within the tolerance of contact of their last steps
      EXPECT_NEAR(force / first, 1, 3e-4) << model;
      dfm_world_destroy(w);
    }
  }
}

// Rows of squeezed_ball_fe, which are a converged linear solution with contact.
TEST(StaticContact, BallBetweenPlates_TakesTheForceOfTheReference) {
  int rows = 0;
  for (const auto &row : test::read_csv(test::reference_dir() + "/contact/tables/squeezed_ball_fe.csv")) {
    if (row[0] != "sphere" || row[3] != "1" || row[2] != "0.04") continue;
    ++rows;
    const double nu = std::stod(row[1]), depth = 0.04, young = 1e5, offset = 2e-5;
    test::Context context;
    dfm_world_def wd = dfm_world_def_default();
    wd.gravity[2] = 0;
    wd.contact_offset = offset;
    dfm_world w = 0;
    test::ok(dfm_world_create(context, &wd, &w));
    const test::Cells cells = test::elastic::graded_ball(context, 1, 9, test::elastic::grading(0.2));
    test::BodyOptions o = cube("ball", young, 1 + offset, "linear_fem");
    o.poisson = nu;
    std::vector<uint8_t> fixed(cells.npoint(), 0);
    for (const double z : {-0.3, 0.5}) {  // on the axis
      uint32_t best = 0;
      const auto far = [&](uint32_t i) {
        const double *const p = cells.point(i);
        return std::hypot(p[0], p[1], 0.02 * (p[2] - z));
      };
      for (uint32_t i = 1; i < cells.npoint(); ++i)
        if (far(i) < far(best)) best = i;
      fixed[best] = 3;
    }
    const dfm_body b = test::make_body(w, cells, o, nullptr, fixed.data());
    const dfm_obstacle bottom = test::add_plane(w, "bottom");
    const dfm_obstacle top = test::add_plane(w, "top", {0, 0, 2 + 2 * offset}, {1, 0, 0, 0});
    test::set_friction(w, 0, "none");
    const dfm_pose pose{{0, 0, 2 + 2 * offset - 2 * depth}, {1, 0, 0, 0}};
    test::ok(dfm_obstacle_move_to(top, &pose));
    test::ok(find(w));
    // how far the middle has come: u_z = a + c z over the points near it
    const std::vector<double> x = positions(b);
    double n = 0, z1 = 0, z2 = 0, u1 = 0, uz = 0;
    for (uint32_t i = 0; i < cells.npoint(); ++i) {
      const double *const p = cells.point(i);
      if (p[0] * p[0] + p[1] * p[1] + p[2] * p[2] > 0.04) continue;
      const double u = x[3 * size_t(i) + 2] - 1 - offset - p[2];
      n += 1;
      z1 += p[2];
      z2 += p[2] * p[2];
      u1 += u;
      uz += u * p[2];
    }
    const double slope = (n * uz - z1 * u1) / (n * z2 - z1 * z1), came = (u1 - slope * z1) / n;
    const double force = pair_of(w, b, bottom).force[2];
    EXPECT_NEAR(force / -pair_of(w, b, top).force[2], 1, 1e-6);
    // the table follows depth^1.52
    EXPECT_NEAR(force / std::pow(-came / depth, 1.52) / (young * std::stod(row[4])), 1, 0.03)
        << "nu " << nu << ", middle down by " << -came;
    dfm_world_destroy(w);
  }
  EXPECT_EQ(rows, 2);
}
