// Rigid bodies through the public API: a host of somebody else's, names, filters, events, snapshots, errors.
#include "rigid.h"

#include <cstring>
#include <functional>

#include "support.h"

namespace {

using namespace test;

// A host with one body that only moves along z, of 1 kg, and counts its calls.
struct Lift {
  int created = 0, predicted = 0, responded = 0, committed = 0, destroyed = 0;
  dfm_status fail_commit = DFM_OK, fail_respond = DFM_OK;
};

dfm_rigid_host lift_table(Lift *counts) {
  dfm_rigid_host t{};
  t.size = sizeof t;
  t.user = counts;
  t.create = [](void *user, const dfm_rigid_set_def *set, void **self, uint32_t *group, uint32_t *nextra) {
    if (set->nbody != 1) return dfm_status(set->nbody == 2 ? DFM_E_ARG : DFM_E_NOMEM);
    ++static_cast<Lift *>(user)->created;
    *self = user;
    group[0] = 0;
    *nextra = 1;
    return dfm_status(DFM_OK);
  };
  t.destroy = [](void *self) { ++static_cast<Lift *>(self)->destroyed; };
  t.predict = [](void *self, const dfm_rigid_step *step, double *v) {
    ++static_cast<Lift *>(self)->predicted;
    v[2] = step->state[0].velocity[2] + step->h * step->gravity[2];
    return dfm_status(DFM_OK);
  };
  t.respond = [](void *self, const dfm_rigid_step *, uint32_t, double *m) {
    ++static_cast<Lift *>(self)->responded;
    std::fill(m, m + 36, 0.0);
    m[14] = 1;
    return static_cast<Lift *>(self)->fail_respond;
  };
  t.commit = [](void *self, const dfm_rigid_step *step, const double *impulse, dfm_rigid_state *state,
                double *extra) {
    Lift &lift = *static_cast<Lift *>(self);
    ++lift.committed;
    state[0] = step->state[0];
    state[0].velocity[2] += step->h * step->gravity[2] + impulse[2];
    state[0].position[2] += step->h * state[0].velocity[2];
    extra[0] = step->extra[0] + 1;
    return lift.fail_commit;
  };
  t.joint = [](void *, const dfm_rigid_state *, const double *, uint32_t, double *, double *, double *) {
    return dfm_fail(DFM_E_STATE, "the drive is locked; unlock it first");
  };
  return t;
}

struct Set {
  std::vector<dfm_rigid_def> bodies;
  std::vector<dfm_joint_def> joints;
  dfm_status create(dfm_world w, const char *host = nullptr) const {
    const dfm_rigid_set_def set = {sizeof set, uint32_t(bodies.size()), uint32_t(joints.size()),
                                   0,          bodies.data(),           joints.data(),
                                   nullptr};
    std::vector<dfm_rigid> out(bodies.size() + 1);
    return dfm_rigid_create(w, host, &set, out.data());
  }
};

dfm_world falling_on_ball(dfm_context *c, dfm_body *ball, dfm_rigid *plate) {
  const dfm_world w = make_world(c);
  set_friction(w, 0.5);
  add_plane(w, "floor");
  BodyOptions o;
  o.name = "ball";
  o.young = 3e4;
  o.damping_stiffness = 2e-3;
  o.position = {0, 0, 0.101};
  *ball = make_body(c, w, "ball", {0.1}, 300, o);
  dfm_rigid_def d = box("plate", {0.1, 0.08, 0.02}, 1.5, {0.01, 0, 0.226});
  d.spin[0] = 1;
  dfm_joint_def j = joint(DFM_JOINT_HINGE, 0, DFM_RIGID_WORLD, {0.3, 0, 0.226}, {0, 1, 0});
  j.motor = 1;
  j.velocity = -1;
  j.max = 0.5;
  d.spin[0] = 0;
  *plate = create(w, {d}, {j})[0];
  return w;
}

}  // namespace

TEST(RigidHost, OfAnotherEngine_TakesPartInTheSolve) {
  static Lift counts;  // the table stays registered for the life of the process
  counts = {};
  const dfm_rigid_host table = lift_table(&counts);
  ASSERT_EQ(dfm_rigid_host_register("lift", &table), DFM_OK) << dfm_last_error();
  EXPECT_EQ(dfm_rigid_host_register("lift", &table), DFM_E_STATE);
  EXPECT_EQ(dfm_rigid_host_register("builtin", &table), DFM_E_STATE);
  {
    Context c;
    const dfm_world w = make_world(c);
    add_plane(w, "floor");
    BodyOptions o;
    o.young = 3e4;
    o.damping_stiffness = 4e-3;
    o.damping_mass = 10;
    o.position = {0, 0, 0.101};
    o.name = "ball";
    const dfm_body ball = make_body(c, w, "ball", {0.1}, 300, o);
    Set set{{box("plate", {0.1, 0.1, 0.02}, 1, {0, 0, 0.23})},
            {joint(DFM_JOINT_HINGE, 0, DFM_RIGID_WORLD, {0, 0, 0.23}, {0, 1, 0})}};
    EXPECT_EQ(Set({{box("one", {0.1, 0.1, 0.1}, 1), box("two", {0.1, 0.1, 0.1}, 1, {1, 0, 0})}, {}})
                  .create(w, "lift"),
              DFM_E_FATAL);
    EXPECT_NE(std::strstr(dfm_last_error(), "gives no reason; look for"), nullptr) << dfm_last_error();
    Set three{{box("one", {0.1, 0.1, 0.1}, 1), box("two", {0.1, 0.1, 0.1}, 1, {1, 0, 0}),
               box("three", {0.1, 0.1, 0.1}, 1, {2, 0, 0})},
              {}};
    EXPECT_EQ(three.create(w, "lift"), DFM_E_NOMEM) << dfm_last_error();
    EXPECT_EQ(set.create(w, "lfit"), DFM_E_ARG);
    EXPECT_NE(std::strstr(dfm_last_error(), "did you mean 'lift'"), nullptr) << dfm_last_error();
    ASSERT_EQ(set.create(w, "lift"), DFM_OK) << dfm_last_error();
    run(w, 1.5, 1e-3);
    dfm_rigid plate = 0;
    ok(dfm_world_find_rigid(w, "plate", &plate));
    double force[3], moment[3], mean = 0;
    for (int k = 0; k < 200; ++k) {
      run(w, 1e-3, 1e-3);
      ok(dfm_rigid_contact_wrench(plate, force, moment));
      mean += force[2] / 200;
    }
    EXPECT_NEAR(mean, 9.81, 0.05);
    EXPECT_GT(state(plate).position[2], 0.15);
    EXPECT_LT(measure(ball).com[2], 0.1);
    EXPECT_EQ(counts.created, 1);
    EXPECT_EQ(uint64_t(counts.committed), stats(w).substeps);
    EXPECT_EQ(counts.predicted, counts.committed);
    EXPECT_GT(counts.responded, 100);
    // A host that fails ends the step; nothing has moved.
    const uint64_t before = dfm_world_hash(w);
    counts.fail_commit = DFM_E_FATAL;
    uint32_t trouble = 0;
    EXPECT_EQ(dfm_world_step(w, 1e-4, &trouble), DFM_E_DIVERGED);
    EXPECT_TRUE(trouble & DFM_TROUBLE_PLUGIN);
    EXPECT_NE(std::strstr(dfm_last_error(), "lift"), nullptr) << dfm_last_error();
    EXPECT_EQ(dfm_world_hash(w), before);
    counts.fail_commit = DFM_OK;
    counts.fail_respond = DFM_E_FATAL;
    trouble = 0;
    EXPECT_EQ(dfm_world_step(w, 1e-4, &trouble), DFM_E_DIVERGED);
    EXPECT_TRUE(trouble & DFM_TROUBLE_PLUGIN);
    EXPECT_NE(std::strstr(dfm_last_error(), "does not answer impulses"), nullptr) << dfm_last_error();
    EXPECT_EQ(dfm_world_hash(w), before);
    double after[3];
    ok(dfm_rigid_contact_wrench(plate, after, moment));
    EXPECT_TRUE(std::equal(after, after + 3, force)) << "that of the last sub-step which was kept";
    EXPECT_EQ(dfm_rigid_joint(plate, 0, nullptr, nullptr, nullptr), DFM_E_STATE);
    EXPECT_NE(std::strstr(dfm_last_error(), "unlock it"), nullptr) << dfm_last_error();
    // No motors in this host.
    EXPECT_EQ(dfm_rigid_set_motor(plate, 0, 1, 1), DFM_E_UNSUPPORTED);
  }
  EXPECT_EQ(counts.destroyed, counts.created);
}

TEST(RigidBodies, WithoutNames_TakeTheNextFreeOnes) {
  Context c;
  const dfm_world w = make_world(c);
  for (int i = 10; i < 20; ++i) add_plane(w, ("rigid" + std::to_string(i)).c_str());
  const Set two{{box(nullptr, {1, 1, 1}, 1), box(nullptr, {1, 1, 1}, 1, {9, 9, 9})}, {}};
  EXPECT_EQ(two.create(w), DFM_OK) << dfm_last_error();

  std::vector<std::string> names;
  for (int i = 22; i < 60; ++i) names.push_back("rigid" + std::to_string(i));
  std::vector<dfm_rigid_def> bodies = {box(nullptr, {1, 1, 1}, 1)};
  for (const std::string &name : names) bodies.push_back(box(name.c_str(), {1, 1, 1}, 1));
  const Set one_of_many{bodies, {}};
  EXPECT_EQ(one_of_many.create(w), DFM_OK) << dfm_last_error();
}

TEST(RigidBodies, HashAndSnapshotOnThreads_CoverThem) {
  Context one, four(4);
  dfm_body ball;
  dfm_rigid plate, other;
  const dfm_world a = falling_on_ball(one, &ball, &plate), b = falling_on_ball(four, &ball, &other);
  run(a, 0.15, 1e-3);
  run(b, 0.15, 1e-3);
  EXPECT_GT(stats(a).contacts, 3u);
  EXPECT_EQ(dfm_world_hash(a), dfm_world_hash(b));
  const std::string data = snapshot(a);
  double force[3], restored[3], moment[3];
  ok(dfm_rigid_contact_wrench(plate, force, moment));
  run(a, 0.2, 1e-3);
  const uint64_t end = dfm_world_hash(a);
  run(b, 0.01, 1e-3);
  ASSERT_EQ(dfm_world_restore(b, data.data(), data.size()), DFM_OK) << dfm_last_error();
  ok(dfm_rigid_contact_wrench(other, restored, moment));
  EXPECT_TRUE(std::equal(force, force + 3, restored));
  run(b, 0.2, 1e-3);
  EXPECT_EQ(dfm_world_hash(b), end);
  // The hash depends on a pose and on the target of a motor.
  ok(dfm_world_restore(b, data.data(), data.size()));
  dfm_rigid_state s = state(other);
  const uint64_t there = dfm_world_hash(b);
  s.velocity[0] += 1e-9;
  ok(dfm_rigid_set_state(other, &s));
  EXPECT_NE(dfm_world_hash(b), there);
  ok(dfm_world_restore(b, data.data(), data.size()));
  ok(dfm_rigid_set_motor(other, 0, 2, 0.5));
  EXPECT_NE(dfm_world_hash(b), there);
  run(b, 0.2, 1e-3);
  EXPECT_NE(dfm_world_hash(b), end);
}

TEST(RigidBodies, ReportsNameThem) {
  Context c;
  dfm_body ball;
  dfm_rigid plate;
  const dfm_world w = falling_on_ball(c, &ball, &plate);
  run(w, 0.15, 1e-3);
  uint32_t n = 0;
  ok(dfm_world_contacts(w, 0, nullptr, &n));
  std::vector<dfm_contact> contacts(n);
  ok(dfm_world_contacts(w, n, contacts.data(), &n));
  uint32_t with_plate = 0, with_floor = 0;
  double force[3] = {}, wrench[3], moment[3];
  for (const dfm_contact &k : contacts) {
    with_plate += k.body_b == plate;
    with_floor += k.body_b == 0;
    if (k.body_b != plate) continue;
    for (int i = 0; i < 3; ++i) {
      const int m = (i + 1) % 3, n2 = (i + 2) % 3;
      force[i] -= k.fn * k.normal[i] + k.ft[0] * k.tangent[i] +
                  k.ft[1] * (k.normal[m] * k.tangent[n2] - k.normal[n2] * k.tangent[m]);
    }
  }
  EXPECT_GT(with_plate, 0u);
  EXPECT_GT(with_floor, 0u);
  ok(dfm_rigid_contact_wrench(plate, wrench, moment));
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(wrench[i], force[i], 1e-9 * norm(vec(wrench)));
  ok(dfm_world_events(w, 0, nullptr, &n));
  std::vector<dfm_contact_event> events(n);
  ok(dfm_world_events(w, n, events.data(), &n));
  EXPECT_TRUE(std::any_of(events.begin(), events.end(),
                          [&](auto &e) { return e.kind == DFM_EVENT_BEGIN && e.b == plate; }));
  const std::string text = test::explain(w);
  for (const char *part :
       {"rigid predict", "rigid commit", "1 rigid body and 1 joint of host builtin", "two_way_rigid"})
    EXPECT_NE(text.find(part), std::string::npos) << part;
  // It is an obstacle that moves by itself.
  dfm_pose pose{};
  ok(dfm_obstacle_get_pose(plate, &pose));
  EXPECT_EQ(pose.position[2], state(plate).position[2]);
  EXPECT_EQ(dfm_obstacle_move_to(plate, &pose), DFM_E_STATE);
  EXPECT_EQ(dfm_obstacle_destroy(plate), DFM_E_STATE);
  EXPECT_EQ(dfm_rigid_destroy(plate), DFM_OK);
  EXPECT_EQ(dfm_rigid_get_state(plate, nullptr), DFM_E_HANDLE);
  run(w, 0.05, 1e-3);
}

TEST(RigidBodies, StatesInOneCall_AreThoseOfEachBody) {
  Context c;
  const dfm_world w = make_world(c);
  ok(Set{{box("a", {0.1, 0.1, 0.1}, 1)}, {}}.create(w));
  add_plane(w, "floor");
  ok(Set{{box("b", {0.1, 0.1, 0.1}, 1, {1, 0, 0})}, {}}.create(w));
  dfm_rigid a = 0, b = 0;
  ok(dfm_world_find_rigid(w, "a", &a));
  ok(dfm_world_find_rigid(w, "b", &b));
  run(w, 0.05, 1e-3);
  uint32_t n = 0;
  ok(dfm_world_rigid_states(w, 0, nullptr, nullptr, &n));
  ASSERT_EQ(n, 2u);
  dfm_rigid handles[3] = {};
  dfm_rigid_state states[3] = {};
  EXPECT_EQ(dfm_world_rigid_states(w, 1, handles, states, &n), DFM_E_ARG);
  EXPECT_EQ(dfm_world_rigid_states(w, 1, handles, nullptr, &n), DFM_E_ARG);
  EXPECT_EQ(handles[0], 0u) << "a refused call writes nothing";
  ok(dfm_world_rigid_states(w, 3, handles, states, &n));
  EXPECT_EQ(n, 2u);
  EXPECT_EQ(handles[0], a);
  EXPECT_EQ(handles[1], b);
  for (int i = 0; i < 2; ++i) {
    dfm_rigid_state one{};
    ok(dfm_rigid_get_state(handles[i], &one));
    EXPECT_EQ(std::memcmp(&one, &states[i], sizeof one), 0);
  }
  ok(dfm_rigid_destroy(a));
  ok(dfm_world_rigid_states(w, 2, nullptr, states, nullptr));
  dfm_rigid_state left{};
  ok(dfm_rigid_get_state(b, &left));
  EXPECT_EQ(std::memcmp(&left, &states[0], sizeof left), 0);
}

TEST(RigidBodies, BadDefs_AreRefused) {
  Context c;
  const dfm_world w = make_world(c);
  const dfm_obstacle floor = add_plane(w, "floor");
  auto refused = [&](const Set &set, std::vector<const char *> words) {
    EXPECT_EQ(set.create(w), DFM_E_ARG);
    for (const char *word : words)
      EXPECT_NE(std::strstr(dfm_last_error(), word), nullptr) << word << " in: " << dfm_last_error();
    uint32_t n = 1;
    ok(dfm_world_rigids(w, 0, nullptr, &n));
    EXPECT_EQ(n, 0u);
  };
  const dfm_rigid_def good = box("a", {0.1, 0.1, 0.1}, 1);
  auto with = [&](const std::function<void(dfm_rigid_def &)> &change) {
    Set set{{good}, {}};
    change(set.bodies[0]);
    return set;
  };
  auto tied = [&](dfm_joint_def j) {
    Set set{{good, box("b", {0.1, 0.1, 0.1}, 1, {1, 0, 0})}, {j}};
    return set;
  };
  refused({}, {"at least one body"});
  refused(with([](dfm_rigid_def &d) { d.mass = 0; }), {"'a'", "mass"});
  refused(with([](dfm_rigid_def &d) { d.mass = INFINITY; }), {"'a'", "mass", "finite"});
  refused(with([](dfm_rigid_def &d) { d.shape = DFM_SHAPE_PLANE; }), {"sphere, a box or a capsule"});
  refused(with([](dfm_rigid_def &d) {
            d.inertia[0] = 5;
            d.inertia[1] = 1;
            d.inertia[2] = 1;
          }),
          {"inertia", "sum"});
  refused(with([](dfm_rigid_def &d) { d.inertia[0] = 1; }), {"inertia", "positive"});
  refused(with([](dfm_rigid_def &d) {
            d.fixed = 1;
            d.velocity[0] = 1;
          }),
          {"fixed", "velocity"});
  refused(with([](dfm_rigid_def &d) { d.name = "floor"; }), {"floor", "taken"});
  refused(with([](dfm_rigid_def &d) { d.half_size[1] = -1; }), {"half_size"});
  refused({{good, good}, {}}, {"'a'", "taken"});
  refused(tied(joint(7, 0, 1, {})), {"type 7"});
  refused(tied(joint(DFM_JOINT_BALL, 0, 5, {})), {"body 5", "has 2"});
  refused(tied(joint(DFM_JOINT_BALL, 1, 1, {})), {"to itself"});
  refused(tied(joint(DFM_JOINT_HINGE, 0, 1, {}, {0, 0, 0})), {"axis is zero"});
  dfm_joint_def j = joint(DFM_JOINT_BALL, 0, 1, {});
  j.motor = 1;
  refused(tied(j), {"hinges and sliders"});
  j = joint(DFM_JOINT_SLIDER, 0, 1, {});
  j.motor = 1;
  j.max = -1;
  refused(tied(j), {"max -1"});
  dfm_rigid_state s{};
  EXPECT_EQ(dfm_rigid_get_state(floor, &s), DFM_E_HANDLE);
  EXPECT_NE(std::strstr(dfm_last_error(), "not a rigid body"), nullptr);
}

// A shape that is added counts in the largest speed, and has no belt: it moves with its body.
TEST(RigidBodies, AddedShape_MovesWithItsBody) {
  Context c;
  const dfm_world w = make_world(c, {0, 0, 0});
  dfm_rigid_def d = box("lump", {0.1, 0.1, 0.1}, 1);
  d.shape = DFM_SHAPE_NONE;
  for (double &i : d.inertia) i = 0.01;
  d.spin[2] = 10;
  const dfm_rigid lump = create(w, {d})[0];
  dfm_obstacle_def of = dfm_obstacle_def_default();
  of.shape = DFM_SHAPE_BOX;
  of.pose.position[0] = 1;
  for (double &half : of.half_size) half = 0.1;
  of.velocity_surface[0] = 1;
  dfm_obstacle shape = 0;
  EXPECT_EQ(dfm_rigid_add_shape(lump, &of, &shape), DFM_E_ARG);
  says({"'lump'", "no belt"});
  of.velocity_surface[0] = 0;
  ok(dfm_rigid_add_shape(lump, &of, &shape));
  dfm_body_measure m{};
  m.size = sizeof m;
  ok(dfm_rigid_get_measure(lump, &m));
  EXPECT_NEAR(m.speed_max, 10 * (1 + 0.1 * std::sqrt(3.0)), 1e-12);
}

// One part is refused after another could have been made: state, reports and sleepers are as before.
TEST(RigidBodies, RefusedForItsLastPart_LeavesTheWorldAsItWas) {
  Context c;
  dfm_body ball = 0;
  dfm_rigid plate = 0;
  const dfm_world w = falling_on_ball(c, &ball, &plate);
  run(w, 0.05, 1e-3);
  const size_t touching = contacts(w).size();
  ASSERT_GT(touching, 0u);
  const std::string before = snapshot(w);
  Set set{{box("first", {0.1, 0.1, 0.1}, 1), box("second", {0.1, 0.1, 0.1}, 1)}, {}};
  set.bodies[1].material = plate;
  EXPECT_EQ(set.create(w), DFM_E_HANDLE);
  dfm_tool_def tool = dfm_tool_def_default();
  const double corner[9] = {0, 0, 0, 0.1, 0, 0, 0, 0.1, 0};
  const uint32_t triangle[3] = {0, 1, 3};
  tool.shape = DFM_TOOL_MESH;
  tool.npoint = 3;
  tool.points = corner;
  tool.ntriangle = 1;
  tool.triangles = triangle;
  dfm_tool out = 0;
  EXPECT_EQ(dfm_tool_create(w, &tool, &out), DFM_E_ARG) << "there is no point 3";
  EXPECT_TRUE(snapshot(w) == before);
  EXPECT_EQ(contacts(w).size(), touching);
}

// Scene errors name their place.
TEST(RigidBodies, SceneErrors_NameTheirPlace) {
  const std::string scene = std::string(DEFORM_SOURCE_DIR) + "/examples/scenes/rigid_pinch.json";
  auto refused = [&](const std::string &set, std::vector<std::string> words) {
    const CommandResult r = deform({"run", scene, "--quiet", "--out", scratch("rigid_errors"), "--set", set});
    EXPECT_EQ(r.exit_code, 2) << set;
    for (const std::string &word : words)
      EXPECT_NE(r.err.find(word), std::string::npos) << set << ": " << r.err;
  };
  refused("/rigid/host=bulit", {"/rigid", "builtin"});
  refused("/rigid={\"host\":\"bulit\",\"bodies\":[]}", {"/rigid/host", "builtin"});
  refused("/rigid/bodies/0/mass=0", {"/rigid/bodies/0/mass"});
  refused("/rigid/bodies/1/shape=plane", {"/rigid/bodies/1/shape", "sphere", "capsule"});
  refused("/rigid/bodies/1/shape=voxels", {"not available yet: /rigid/bodies/1/shape"});
  refused("/rigid/bodies/1/massa=1", {"/rigid/bodies/1", "mass"});
  refused("/rigid/bodies/1/name=ball", {"/rigid/bodies/1/name", "taken"});
  refused("/rigid/bodies/1/joints/0/with=lfit", {"/rigid/bodies/1/joints/0/with", "lift"});
  refused("/rigid/bodies/1/joints/0/type=weld", {"/rigid/bodies/1/joints/0/type", "hinge"});
  refused("/rigid/bodies/1/joints/0/type=ball", {"/rigid/bodies/1/joints/0/axis"});
  refused("/rigid/bodies/1/joints/0/axis=[0,0,0]", {"/rigid/bodies/1/joints/0/axis", "zero"});
  refused("/rigid/bodies/1/joints/0/motor/max=-1", {"/rigid/bodies/1/joints/0/motor/max"});
  refused("/rigid/bodies/1/inertia=[1,1,9]", {"/rigid", "inertia"});
}
