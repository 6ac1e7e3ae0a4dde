// Every number of every def and every argument that is a double: what is not finite is refused with a
// sentence that names it, and changes nothing; what is finite and huge is refused or taken, but
// nothing breaks.
#include <functional>
#include <limits>

#include "query.h"
#include "rigid.h"

namespace {

struct Number {
  const char *name;  // what the sentence says of it
  std::function<dfm_status(double)> call;
  bool infinite = false;  // +infinity means something: without a bound
};

struct Scene {
  test::Context c;
  dfm_world w = test::make_world(c);
  dfm_body body = 0;
  dfm_obstacle floor = test::add_plane(w, "floor");
  dfm_rigid rigid = 0;
  uint32_t spring = 0;
  int made = 0;
  const uint32_t points[2] = {0, 1};

  Scene() {
    test::BodyOptions o;
    o.name = "block";
    o.position = {0, 0, 1e-4};
    body = test::make_body(c, w, "beam", {0.1, 0.1, 0.1}, 10, o);
    test::ok(dfm_body_hold(body, 2, points, 7));
    dfm_joint_def hinge = test::joint(DFM_JOINT_HINGE, 0, DFM_RIGID_WORLD, {5, 0, 1}, {0, 1, 0});
    hinge.motor = 1;
    hinge.max = 1;
    rigid = test::create(w, {test::box("arm", {0.1, 0.1, 0.1}, 1, {5, 0, 1})}, {hinge})[0];
    const dfm_spring_def d{sizeof d, 2, points, nullptr, {}, nullptr, 0, 0, 1, 0};
    test::ok(dfm_body_add_spring(body, &d, &spring));
  }

  dfm_status world(const std::function<void(dfm_world_def &)> &set) {
    dfm_world_def d = dfm_world_def_default();
    set(d);
    dfm_world other = 0;
    const dfm_status s = dfm_world_create(c, &d, &other);
    if (s == DFM_OK) test::ok(dfm_world_destroy(other));
    return s;
  }
  dfm_status solid(const std::function<void(dfm_body_def &)> &set) {
    static const double x[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
    static const uint32_t tets[] = {0, 1, 2, 3};
    dfm_body_def d = dfm_body_def_default();
    d.npoint = 4;
    d.ntet = 1;
    d.points = x;
    d.tets = tets;
    d.pose.position[2] = 10;
    set(d);
    dfm_body b = 0;
    const dfm_status s = dfm_body_create(w, &d, &b);
    if (s == DFM_OK) test::ok(dfm_body_destroy(b));
    return s;
  }
  dfm_status obstacle(uint32_t shape, const std::function<void(dfm_obstacle_def &)> &set) {
    dfm_obstacle_def d = dfm_obstacle_def_default();
    d.shape = shape;
    d.pose.position[2] = -10;
    set(d);
    dfm_obstacle o = 0;
    const dfm_status s = dfm_obstacle_create(w, &d, &o);
    if (s == DFM_OK) test::ok(dfm_obstacle_destroy(o));
    return s;
  }
  dfm_status rigid_body(const std::function<void(dfm_rigid_def &, dfm_joint_def &)> &set) {
    dfm_rigid_def d = test::box("other", {0.1, 0.1, 0.1}, 1, {8, 0, 1});
    for (double &i : d.inertia) i = 1e-3;
    dfm_joint_def j = test::joint(DFM_JOINT_HINGE, 0, DFM_RIGID_WORLD, {8, 0, 1}, {0, 1, 0});
    j.motor = 1;
    j.max = 1;
    set(d, j);
    const dfm_rigid_set_def all = {sizeof all, 1, 1, 0, &d, &j, nullptr};
    dfm_rigid r = 0;
    const dfm_status s = dfm_rigid_create(w, nullptr, &all, &r);
    if (s == DFM_OK) test::ok(dfm_rigid_destroy(r));
    return s;
  }
  dfm_status material(const std::function<void(dfm_material_def &)> &set) {
    dfm_material_def d = dfm_material_def_default();
    set(d);
    dfm_material m = 0;
    const dfm_status s = dfm_material_create(w, &d, &m);
    if (s == DFM_OK) test::ok(dfm_material_destroy(m));
    return s;
  }
  dfm_status spring_like(const std::function<void(dfm_spring_def &)> &set) {
    dfm_spring_def d{sizeof d, 2, points, nullptr, {}, nullptr, 0, 0, 1, 0};
    set(d);
    uint32_t number = 0;
    const dfm_status s = dfm_body_add_spring(body, &d, &number);
    if (s == DFM_OK) test::ok(dfm_body_remove_spring(body, number));
    return s;
  }
  dfm_status query(std::array<double, 3> at, const double *path, double reach) const {
    const dfm_query_shape s = test::point(at);
    dfm_query_hits hits{sizeof hits, sizeof(dfm_query_hit), 0, 0, nullptr};
    return dfm_world_query(w, &s, path, reach, nullptr, nullptr, &hits);
  }
  dfm_status load(double force, const dfm_scale_key *key, const dfm_sine *sine) {
    const double f[6] = {0, force, 0};
    uint32_t number = 0;
    const dfm_status s = dfm_body_add_load(body, 2, points, f, key ? 1 : 0, key, sine, &number);
    if (s == DFM_OK) test::ok(dfm_body_remove_load(body, number));
    return s;
  }
  dfm_status state(double x, double v) {
    std::vector<double> at(300), speed(300);
    uint32_t n = 0;
    test::ok(dfm_body_get_state(body, 100, at.data(), speed.data(), &n));
    const std::vector<double> was = at, then = speed;
    at[10] += x;
    speed[10] += v;
    const dfm_status s = dfm_body_set_state(body, n, at.data(), speed.data());
    if (s == DFM_OK) test::ok(dfm_body_set_state(body, n, was.data(), then.data()));
    return s;
  }
  dfm_status rule(double mu) {
    const dfm_param_value value{"mu", &mu, 1};
    dfm_friction_def f{};
    f.size = sizeof f;
    f.between[0] = f.between[1] = "*";
    f.law = "coulomb";
    f.params = {sizeof(dfm_params), 1, &value};
    return dfm_world_add_friction(w, &f);
  }
  std::vector<Number> numbers();
};

#define N(text, ...)                                     \
  {                                                      \
    text, [this](double x) -> dfm_status { __VA_ARGS__ } \
  }
std::vector<Number> Scene::numbers() {
  std::vector<Number> all = {
      N("gravity", return world([&](auto &d) { d.gravity[1] = x; });),
      N("contact_offset", return world([&](auto &d) { d.contact_offset = x; });),
      N("contact_tolerance", return world([&](auto &d) { d.contact_tolerance = x; });),
      N("sleep_speed", return world([&](auto &d) { d.sleep_speed = x; });),
      N("sleep_time", return world([&](auto &d) { d.sleep_time = x; });),
      N("gravity", const double g[3] = {0, x, 0}; return dfm_world_set_gravity(w, g);),
      N("gravity", const dfm_vector_key k{x, {0, 0, 0}}; return dfm_world_set_gravity_keys(w, 1, &k);),
      N("gravity", const dfm_vector_key k{0, {0, x, 0}}; return dfm_world_set_gravity_keys(w, 1, &k);),
      N("pose", return solid([&](auto &d) { d.pose.position[1] = x; });),
      N("pose", return solid([&](auto &d) { d.pose.rotation[1] = x; });),
      N("velocity", return solid([&](auto &d) { d.velocity[1] = x; });),
      N("spin", return solid([&](auto &d) { d.spin[1] = x; });),
      N("point", double p[12] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, x};
        return solid([&](auto &d) { d.points = p; });),
      N("share", return solid([&](auto &d) { d.cell_share = &x; });),
      N("poisson", const dfm_param_value v{"poisson", &x, 1};
        return solid([&](auto &d) { d.model_params = {sizeof(dfm_params), 1, &v}; });),
      N("young", const dfm_cell_field f{"young", &x, 1}; return solid([&](auto &d) {
          d.nfield = 1;
          d.fields = &f;
        });),
      N("density", return material([&](auto &d) { d.density = x; });),
      N("young", return material([&](auto &d) { d.young = x; });),
      N("poisson", return material([&](auto &d) { d.poisson = x; });),
      N("damping_mass", return material([&](auto &d) { d.damping_mass = x; });),
      N("damping_stiffness", return material([&](auto &d) { d.damping_stiffness = x; });),
      N("friction", const dfm_param_value v{"friction", &x, 1};
        return material([&](auto &d) { d.extra = {sizeof(dfm_params), 1, &v}; });),
      N("pose", return obstacle(DFM_SHAPE_PLANE, [&](auto &d) { d.pose.position[1] = x; });),
      N("pose", return obstacle(DFM_SHAPE_BOX, [&](auto &d) { d.pose.rotation[1] = x; });),
      N("half_size", return obstacle(DFM_SHAPE_BOX, [&](auto &d) { d.half_size[1] = x; });),
      N("radius", return obstacle(DFM_SHAPE_SPHERE, [&](auto &d) { d.radius = x; });),
      N("half_length", return obstacle(DFM_SHAPE_CAPSULE, [&](auto &d) { d.half_length = x; });),
      N("velocity_surface", return obstacle(DFM_SHAPE_PLANE, [&](auto &d) { d.velocity_surface[1] = x; });),
      N("sine", return obstacle(DFM_SHAPE_BOX, [&](auto &d) { d.sine.amplitude[1] = x; });),
      N("sine", return obstacle(DFM_SHAPE_BOX, [&](auto &d) { d.sine.frequency = x; });),
      N("sine", return obstacle(DFM_SHAPE_BOX, [&](auto &d) { d.sine.phase = x; });),
      N("key", const dfm_pose_key k{x, {}}; return obstacle(DFM_SHAPE_BOX,
                                                            [&](auto &d) {
                                                              d.nkey = 1;
                                                              d.keys = &k;
                                                            });),
      N("key", const dfm_pose_key k{0, {{0, x, 0}, {}}}; return obstacle(DFM_SHAPE_BOX,
                                                                         [&](auto &d) {
                                                                           d.nkey = 1;
                                                                           d.keys = &k;
                                                                         });),
      N("key", const dfm_pose_key k{0, {{}, {0, x, 0, 1}}}; return obstacle(DFM_SHAPE_BOX,
                                                                            [&](auto &d) {
                                                                              d.nkey = 1;
                                                                              d.keys = &k;
                                                                            });),
      N("pose", const dfm_pose p{{0, x, 0}, {0, 0, 0, 1}}; return dfm_obstacle_move_to(floor, &p);),
      N("pose", const dfm_pose p{{0, 0, 0}, {0, x, 0, 1}}; return dfm_obstacle_move_to(floor, &p);),
      N("pose", return rigid_body([&](auto &d, auto &) { d.pose.position[1] = x; });),
      N("pose", return rigid_body([&](auto &d, auto &) { d.pose.rotation[1] = x; });),
      N("half_size", return rigid_body([&](auto &d, auto &) { d.half_size[1] = x; });),
      N("radius", return rigid_body([&](auto &d, auto &) {
          d.shape = DFM_SHAPE_SPHERE;
          d.radius = x;
        });),
      N("half_length", return rigid_body([&](auto &d, auto &) {
          d.shape = DFM_SHAPE_CAPSULE;
          d.half_length = x;
        });),
      N("mass", return rigid_body([&](auto &d, auto &) { d.mass = x; });),
      N("inertia", return rigid_body([&](auto &d, auto &) { d.inertia[1] = x; });),
      N("velocity", return rigid_body([&](auto &d, auto &) { d.velocity[1] = x; });),
      N("spin", return rigid_body([&](auto &d, auto &) { d.spin[1] = x; });),
      N("anchor", return rigid_body([&](auto &, auto &j) { j.anchor[1] = x; });),
      N("axis", return rigid_body([&](auto &, auto &j) { j.axis[1] = x; });),
      N("velocity", return rigid_body([&](auto &, auto &j) { j.velocity = x; });),
      N("max", return rigid_body([&](auto &, auto &j) { j.max = x; });),
      N("max", return rigid_body([&](auto &, auto &j) {
          j.motor = 0;
          j.max = x;
        });),
      N("velocity", return dfm_rigid_set_motor(rigid, 0, x, 1);),
      N("max", return dfm_rigid_set_motor(rigid, 0, 0, x);),
      N("end", return spring_like([&](auto &d) { d.to[1] = x; });),
      N("stiffness", return spring_like([&](auto &d) { d.stiffness = x; });),
      N("damping", return spring_like([&](auto &d) { d.damping = x; });),
      N("weight", const double weights[2] = {1, x};
        return spring_like([&](auto &d) { d.weights = weights; });),
      N("key", const dfm_vector_key k{0, {0, x, 0}}; return spring_like([&](auto &d) {
          d.nkey = 1;
          d.keys = &k;
        });),
      N("end", const double to[3] = {0, x, 0}; return dfm_body_set_spring_target(body, spring, to);),
      N("load", return load(x, nullptr, nullptr);),
      N("key", const dfm_scale_key k{0, x}; return load(1, &k, nullptr);),
      N("key", const dfm_scale_key k{x, 1}; return load(1, &k, nullptr);),
      N("sine", const dfm_sine s{{x, 0, 0}, 1, 0}; return load(1, nullptr, &s);),
      N("sine", const dfm_sine s{{0, 0, 0}, x, 0}; return load(1, nullptr, &s);),
      N("sine", const dfm_sine s{{0, 0, 0}, 1, x};
        return dfm_body_move_held(body, 2, points, 0, nullptr, &s);),
      N("key", const dfm_pose_key k{0, {{0, x, 0}, {}}};
        return dfm_body_move_held(body, 2, points, 1, &k, nullptr);),
      N("state", return state(x, 0);),
      N("state", return state(0, x);),
      N("impulse", const double at[3] = {0, 0, 0}, p[3] = {0, x, 0};
        return dfm_body_apply_impulse(body, at, p);),
      N("point", const double at[3] = {0, x, 0}, p[3] = {0, 0, 0};
        return dfm_body_apply_impulse(body, at, p);),
      N("young", const dfm_param_value v{"young", &x, 1}; const dfm_params p{sizeof p, 1, &v};
        return dfm_body_set_params(body, &p);),
      N("mu", return rule(x);),
      N("step", return dfm_world_step(w, x, nullptr);),
      N("shape.pose.position", const double d[3] = {0, 0, 1}; return query({0, x, 0}, d, 1);),
      N("path", const double d[3] = {0, x, 1}; return query({0, 0, 0}, d, 1);),
      N("point", const double o[3] = {0, x, 0}; double f[3], m[3];
        return dfm_world_pair_wrench(w, body, floor, o, f, m);),
      N("beam", const double size[3] = {0.1, x, 0.1}; dfm_mesh_handle m = 0;
        const dfm_status s = dfm_mesh_make(c, "beam", size, DFM_MESH_CELLS, 10, &m);
        if (s == DFM_OK) test::ok(dfm_mesh_destroy(m)); return s;),
  };
  all.push_back({"reach",
                 [this](double x) {
                   const double d[3] = {0, 0, 1};
                   return query({0, 0, 0}, d, x);
                 },
                 true});
  for (int k = 0; k < 4; ++k)
    all.push_back({"state", [this, k](double x) {
                     dfm_rigid_state s = test::state(rigid);
                     const dfm_rigid_state was = s;
                     (k == 0 ? s.position : k == 1 ? s.rotation : k == 2 ? s.velocity : s.spin)[1] = x;
                     const dfm_status status = dfm_rigid_set_state(rigid, &s);
                     if (status == DFM_OK) test::ok(dfm_rigid_set_state(rigid, &was));
                     return status;
                   }});
  return all;
}
#undef N

}  // namespace

TEST(Numbers, ThatAreNotFinite_AreRefusedByNameAndChangeNothing) {
  Scene s;
  test::ok(dfm_world_step(s.w, 1e-4, nullptr));
  const double inf = std::numeric_limits<double>::infinity();
  int number = 0;
  for (const Number &n : s.numbers()) {
    const std::string before = test::snapshot(s.w);
    for (const double bad : {std::numeric_limits<double>::quiet_NaN(), inf, -inf}) {
      if (n.infinite && bad > 0) continue;
      EXPECT_EQ(n.call(bad), DFM_E_ARG) << number << " " << n.name << " = " << bad;
      EXPECT_NE(std::string(dfm_last_error()).find(n.name), std::string::npos)
          << number << " " << n.name << " = " << bad << ": " << dfm_last_error();
    }
    EXPECT_EQ(test::snapshot(s.w), before) << number << " " << n.name;
    ++number;
  }
  EXPECT_GT(number, 80);
}

TEST(Numbers, ThatAreHuge_AreRefusedWithASentenceOrTaken) {
  Scene s;
  int number = 0;
  for (const Number &n : s.numbers()) {
    for (const double huge : {1e308, -1e308, 1e200, 5e-324}) {
      const dfm_status status = n.call(huge);
      EXPECT_TRUE(status == DFM_OK || status == DFM_E_ARG || status == DFM_DISCARD ||
                  status == DFM_E_DIVERGED || status == DFM_E_NOMEM)
          << number << " " << n.name << " = " << huge << ": " << dfm_status_name(status) << ": "
          << dfm_last_error();
    }
    ++number;
  }
}

// Poses say "normalized on use": any length but zero, which is no rotation.
TEST(Numbers, QuaternionsOfAnyLength_AreNormalized) {
  Scene s;
  for (const double length : {1e-300, 1e-30, 3.0, 1e30, 1e300}) {
    dfm_pose pose{{0, 0, 0}, {0, 0, 0.6 * length, 0.8 * length}};
    dfm_obstacle_def d = dfm_obstacle_def_default();
    d.shape = DFM_SHAPE_BOX;
    d.pose = pose;
    dfm_obstacle o = 0;
    ASSERT_EQ(dfm_obstacle_create(s.w, &d, &o), DFM_OK) << dfm_last_error();
    test::ok(dfm_obstacle_get_pose(o, &pose));
    EXPECT_NEAR(pose.rotation[2], 0.6, 1e-15) << length;
    EXPECT_NEAR(pose.rotation[3], 0.8, 1e-15) << length;
    test::ok(dfm_obstacle_destroy(o));
  }
}

TEST(Numbers, ImpulseThatGivesMoreThanLight_IsRefusedAndChangesNothing) {
  Scene s;
  const double at[3] = {0, 0, 0.1}, huge[3] = {1e300, 0, 0};
  const uint64_t before = dfm_world_hash(s.w);
  EXPECT_EQ(dfm_body_apply_impulse(s.body, at, huge), DFM_E_ARG);
  test::says({"speed of light"});
  EXPECT_EQ(dfm_world_hash(s.w), before);
}
