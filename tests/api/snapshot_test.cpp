// Snapshot and restore: in the same world, in a world built anew, in a new process; what is refused, and that
// nothing changes then. The program runs itself as `PROGRAM --continue FILE STEPS`: builds the scene,
// restores, steps, prints the hash.
#include <cstdlib>
#include <cstring>

#include "rigid.h"
#include "stack.h"
#include "support.h"

namespace {

// Everything that a host can prescribe happens at once, in contact: gravity keys, a varying load, held points
// that move, a jaw on keys, a ball on a sine.
test::Stack build(dfm_context *c) {
  test::Stack s = test::make_stack(c, 1e-4, 0.4);
  const dfm_vector_key gravity[] = {{0, {0, 0, -9.81}}, {0.3, {1, 0, -9}}, {2, {-1, 0.5, -9.81}}};
  test::ok(dfm_world_set_gravity_keys(s.world, 3, gravity));
  const uint32_t pushed[] = {3, 9, 12}, held[] = {0, 1};
  const double force[] = {0.1, 0, 0, 0, 0.1, 0, 0.05, 0.05, -0.1};
  const dfm_scale_key scale[] = {{0, 0}, {0.2, 1}, {0.9, 0.3}};
  const dfm_sine wobble{{0.5, 0, 0}, 3, 0.2}, sway{{1e-3, 0, 0}, 2, 0};
  test::ok(dfm_body_add_load(s.upper, 3, pushed, force, 3, scale, &wobble, nullptr));
  test::ok(dfm_body_hold(s.lower, 2, held, 7));
  test::ok(dfm_body_move_held(s.lower, 2, held, 0, nullptr, &sway));
  dfm_obstacle_def jaw = dfm_obstacle_def_default();
  const dfm_pose_key keys[] = {{0, {{-0.2, 0.05, 0.15}, {0, 0, 0, 1}}},
                               {1, {{-0.08, 0.05, 0.15}, {0, 0, 0.1, 1}}}};
  jaw.name = "jaw";
  jaw.shape = DFM_SHAPE_BOX;
  jaw.half_size[0] = 0.1;
  jaw.half_size[1] = 0.1;
  jaw.half_size[2] = 0.02;
  jaw.nkey = 2;
  jaw.keys = keys;
  dfm_obstacle o = 0;
  test::ok(dfm_obstacle_create(s.world, &jaw, &o));
  dfm_obstacle_def ball = dfm_obstacle_def_default();
  ball.name = "ball";
  ball.shape = DFM_SHAPE_SPHERE;
  ball.radius = 0.05;
  ball.pose.position[0] = 0.16;
  ball.pose.position[1] = 0.05;
  ball.pose.position[2] = 0.05;
  ball.sine = {{0.02, 0, 0}, 1.5, 0};
  test::ok(dfm_obstacle_create(s.world, &ball, &o));
  return s;
}

void steps(dfm_world w, int n) {
  for (int i = 0; i < n; ++i) ASSERT_EQ(dfm_world_step(w, 1e-3, nullptr), DFM_OK) << dfm_last_error();
}

using test::snapshot;
dfm_status restore(dfm_world w, const std::string &data) {
  return dfm_world_restore(w, data.data(), data.size());
}

}  // namespace

int main(int argc, char **argv) {
  if (argc == 4 && std::strcmp(argv[1], "--continue") == 0) {
    test::Context c;
    const test::Stack s = build(c);
    if (restore(s.world, test::read_file(argv[2])) != DFM_OK) {
      std::fprintf(stderr, "%s\n", dfm_last_error());
      return 1;
    }
    steps(s.world, std::atoi(argv[3]));
    std::printf("%016llx\n", static_cast<unsigned long long>(dfm_world_hash(s.world)));
    return 0;
  }
  testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}

// What a step finds of an impact does not depend on what the world has seen before.
TEST(Snapshot, TakenBeforeAHardImpact_ContinuesWithTheSameBitsInANewWorld) {
  struct Thrown {
    test::Context context;
    dfm_world world = test::make_world(context, {0, 0, 0}, DFM_INTEGRATOR_SYMPLECTIC_EULER);
    Thrown() {
      test::add_plane(world, "floor");
      test::BodyOptions o;
      o.position = {0, 0, 0.062};
      o.velocity = {0, 0, -10};
      test::make_body(context, world, "ball", {0.05, 0, 0}, 600, o);
    }
  };
  Thrown first, second;
  steps(first.world, 1);
  const std::string before = snapshot(first.world);
  test::ok(restore(second.world, before));
  for (int i = 0; i < 10; ++i) {
    steps(first.world, 1);
    steps(second.world, 1);
    ASSERT_EQ(dfm_world_hash(second.world), dfm_world_hash(first.world)) << "step " << i;
  }
  EXPECT_GT(test::stats(first.world).substeps, 11u) << "the impact was hard";
}

TEST(Snapshot, TakenInContact_ContinuesWithTheSameBitsHereAndInANewProcess) {
  test::Context c;
  const test::Stack s = build(c);
  steps(s.world, 305);
  ASSERT_GT(test::stats(s.world).sticking, 0u) << "nothing sticks: the snapshot would show little";
  const std::string data = snapshot(s.world);
  const uint64_t at = dfm_world_hash(s.world);
  steps(s.world, 1000);
  const uint64_t later = dfm_world_hash(s.world);
  ASSERT_NE(at, later);

  test::ok(restore(s.world, data));
  EXPECT_EQ(dfm_world_hash(s.world), at);
  EXPECT_DOUBLE_EQ(dfm_world_time(s.world), 0.305);
  EXPECT_EQ(snapshot(s.world), data) << "a snapshot of what was restored is the same snapshot";
  steps(s.world, 1000);
  EXPECT_EQ(dfm_world_hash(s.world), later) << "in the same world";

  const test::Stack anew = build(c);
  test::ok(restore(anew.world, data));
  steps(anew.world, 1000);
  EXPECT_EQ(dfm_world_hash(anew.world), later) << "in a world built anew";

  const std::string file = test::scratch("snapshot") + "/mid_contact.bin";
  test::write_file(file, data);
  const test::CommandResult r = test::run({"/proc/self/exe", "--continue", file, "1000"});
  char text[24];
  std::snprintf(text, sizeof text, "%016llx\n", static_cast<unsigned long long>(later));
  EXPECT_EQ(r.exit_code, 0) << r.err;
  EXPECT_EQ(r.out, text) << "in a new process";
}

// Not only a multiple of the interval at which the step bound is asked: at every phase of it.
TEST(Snapshot, TakenAtAnyStep_ContinuesWithTheSameBits) {
  test::Context c;
  const test::Stack s = build(c), other = build(c);
  for (int i = 0; i < 24; ++i) {
    steps(s.world, 7);
    test::ok(restore(other.world, snapshot(s.world)));
    steps(other.world, 7);
    steps(s.world, 7);
    ASSERT_EQ(dfm_world_hash(other.world), dfm_world_hash(s.world)) << "after " << 14 * i + 7 << " steps";
  }
}

// Changes by the host during the run belong to the state.
TEST(Snapshot, OfAWorldChangedWhileRunning_HoldsTheChanges) {
  test::Context c;
  const test::Stack s = build(c), fresh = build(c);
  steps(s.world, 50);
  const uint32_t point = 5, all[] = {0, 1, 2};
  const double push[] = {0, 0.2, 0}, sideways[] = {0.5, 0, -9.81}, soft = 1.5e4;
  test::ok(dfm_body_remove_load(s.upper, 1));
  test::ok(dfm_body_add_load(s.lower, 1, &point, push, 0, nullptr, nullptr, nullptr));
  test::ok(dfm_world_set_gravity(s.world, sideways));
  test::ok(dfm_body_hold(s.upper, 3, all, 4));
  test::set_friction(s.world, 0.1);
  test::ok(dfm_world_filter_pair(s.world, "lower", "jaw", false));
  test::ok(dfm_body_set_filter(s.upper, 3, 5));
  const dfm_param_value young{"young", &soft, 1};
  const dfm_params params{sizeof params, 1, &young};
  const bool changed_model = dfm_body_set_params(s.upper, &params) == DFM_OK;
  dfm_obstacle obstacles[3];
  uint32_t n = 0;
  test::ok(dfm_world_obstacles(s.world, 3, obstacles, &n));
  const dfm_pose target{{-0.15, 0.05, 0.15}, {0, 0, 0, 1}};
  test::ok(dfm_obstacle_move_to(obstacles[1], &target));
  const std::string data = snapshot(s.world);  // with the target not reached yet
  test::ok(restore(fresh.world, data));
  EXPECT_EQ(dfm_world_hash(fresh.world), dfm_world_hash(s.world));
  steps(s.world, 400);
  steps(fresh.world, 400);
  EXPECT_EQ(dfm_world_hash(fresh.world), dfm_world_hash(s.world));
  EXPECT_TRUE(changed_model) << "young of msm is a runtime parameter: " << dfm_last_error();
}

// The columns of contacts stay as wide as the widest law that they had, though another has its place.
TEST(Snapshot, AfterALawWithMemoryGaveWay_IsRestored) {
  test::Context c;
  const test::Stack s = build(c);
  test::ok(test::add_friction(s.world, "lugre"));
  steps(s.world, 5);
  test::ok(dfm_body_destroy(s.upper));
  test::ok(dfm_body_destroy(s.lower));
  steps(s.world, 1);
  test::ok(dfm_world_remove_friction(s.world, "*", "*"));
  test::ok(test::add_friction(s.world, "coulomb"));
  const std::string data = snapshot(s.world);
  test::ok(restore(s.world, data));
}

// What the last sub-step did can be read right after a restore, of bodies that are awake.
TEST(Snapshot, TakenInContact_HasTheForcesOfTheLastSubStep) {
  test::Context c;
  const test::Stack s = build(c);
  const auto forces = [&s] {
    std::string out;
    const auto add = [&out](const void *data, size_t bytes) {
      out.append(static_cast<const char *>(data), bytes);
    };
    for (const dfm_contact &contact : test::contacts(s.world)) add(&contact, sizeof contact);
    for (const dfm_pair_report &pair : test::pairs(s.world)) add(&pair, sizeof pair);
    double wrench[6];
    test::ok(dfm_world_pair_wrench(s.world, s.upper, s.lower, wrench, wrench, wrench + 3));
    add(wrench, sizeof wrench);
    std::vector<double> on_surface(3 * 1000);
    uint32_t n = 0;
    test::ok(dfm_surface_forces(s.upper, 1000, on_surface.data(), &n));
    add(on_surface.data(), 3 * n * sizeof(double));
    return out;
  };
  steps(s.world, 305);
  ASSERT_GT(test::contacts(s.world).size(), 3u);
  const std::string data = snapshot(s.world), then = forces();
  steps(s.world, 100);
  ASSERT_NE(forces(), then);
  test::ok(restore(s.world, data));
  EXPECT_TRUE(forces() == then);
}

// The host may give a rotation of any length.
TEST(Snapshot, OfAnObstacleTurnedByALongQuaternion_IsRestored) {
  test::Context c;
  const test::Stack s = build(c);
  test::add_plane(s.world, "wall", {0.3, 0, 0}, {0, -3, 0, 3});
  steps(s.world, 5);
  const std::string data = snapshot(s.world);
  test::ok(restore(s.world, data));
  EXPECT_TRUE(snapshot(s.world) == data);
}

TEST(Snapshot, OfAHoldMeasure_ContinuesMeasuring) {
  test::Context c;
  const test::Stack s = test::make_stack(c), fresh = test::make_stack(c);
  steps(s.world, 600);
  test::ok(dfm_world_hold_begin(s.world));
  steps(s.world, 100);
  test::ok(restore(fresh.world, snapshot(s.world)));
  steps(s.world, 100);
  steps(fresh.world, 100);
  double creep = 0, restored = 0;
  uint32_t n = 0, m = 0;
  test::ok(dfm_world_hold(s.world, &creep, &n));
  test::ok(dfm_world_hold(fresh.world, &restored, &m));
  EXPECT_GT(n, 0u);
  EXPECT_EQ(n, m);
  EXPECT_EQ(creep, restored);
  EXPECT_TRUE(std::isfinite(creep));
}

// Edges of the bed's surface bear those of the box: the contact store keeps both numbers, and a box has edges
// without a mesh.
TEST(Snapshot, WhereEdgesBearThoseOfABox_ContinuesWithTheSameBits) {
  test::Context c;
  const dfm_world w = test::make_world(c);
  test::BodyOptions o;
  o.name = "bed";
  o.young = 5e4;
  o.damping_mass = 2;
  o.damping_stiffness = 0.002;
  o.position = {-0.2, -0.2, 0.001};
  test::make_body(c, w, "beam", {0.4, 0.4, 0.1}, 300, o);
  test::add_plane(w, "floor");
  const dfm_rigid_def box = test::box("box", {0.05, 0.05, 0.05}, 1, {0, 0, 0.152});
  const dfm_rigid_set_def set = {sizeof set, 1, 0, 0, &box, nullptr, nullptr};
  dfm_rigid rigid = 0;
  test::ok(dfm_rigid_create(w, nullptr, &set, &rigid));
  steps(w, 50);
  for (int k = 0; k < 5; ++k) {
    const std::string data = snapshot(w);
    steps(w, 50);
    const uint64_t later = dfm_world_hash(w);
    ASSERT_EQ(restore(w, data), DFM_OK) << dfm_last_error();
    steps(w, 50);
    EXPECT_EQ(dfm_world_hash(w), later);
  }
}

TEST(Snapshot, DamagedCutOrForeign_IsRefusedAndChangesNothing) {
  test::Context c;
  const test::Stack s = build(c);
  steps(s.world, 120);
  const std::string good = snapshot(s.world);
  steps(s.world, 30);
  const uint64_t hash = dfm_world_hash(s.world);
  const std::string state = snapshot(s.world);
  auto refused = [&](const std::string &data, const char *what) {
    EXPECT_EQ(restore(s.world, data), DFM_E_FORMAT) << what;
    EXPECT_NE(std::strlen(dfm_last_error()), 0u);
    EXPECT_EQ(dfm_world_hash(s.world), hash) << what;
  };
  for (size_t n : {size_t(0), size_t(7), size_t(8), size_t(23), size_t(24), good.size() / 2, good.size() - 8,
                   good.size() - 1})
    refused(good.substr(0, n), "cut short");
  refused(good + "x", "longer than written");
  for (size_t at = 0; at < good.size(); at += good.size() / 97 + 1) {
    std::string bad = good;
    bad[at] = char(bad[at] ^ 0x10);
    refused(bad, "one bit turned");
  }
  refused(std::string(good.size(), '\0'), "zeros");

  test::Stack other = test::make_stack(c);
  refused(snapshot(other.world), "of a world without the jaw");
  EXPECT_EQ(restore(other.world, good), DFM_E_FORMAT);
  EXPECT_NE(std::string(dfm_last_error()).find("another world"), std::string::npos) << dfm_last_error();
  EXPECT_EQ(snapshot(s.world), state);
  EXPECT_EQ(dfm_world_restore(s.world, nullptr, 10), DFM_E_ARG);
}

TEST(Snapshot, OfAWorldThatWasMadeOtherwise_IsRefused) {
  test::Context c;
  const auto refused = [&](const auto &make, auto first, auto second) {
    const dfm_world from = test::make_world(c), to = test::make_world(c);
    make(from, first);
    make(to, second);
    EXPECT_EQ(restore(to, snapshot(from)), DFM_E_FORMAT);
    test::says({"another world"});
  };
  const auto body = [&](dfm_world w, double smooth) {
    test::BodyOptions o;
    o.smooth = smooth;
    test::make_body(c, w, "beam", {0.1, 0.1, 0.1}, 60, o);
  };
  refused(body, 0.0, 60.0);
  const auto jointed = [](dfm_world w, const dfm_joint_def &j) {
    test::create(w, {test::box("box", {0.1, 0.1, 0.1}, 1)}, {j});
  };
  const test::Vec at = {0, 0, 0.1};
  const dfm_joint_def hinge = test::joint(DFM_JOINT_HINGE, 0, DFM_RIGID_WORLD, at, {1, 0, 0});
  refused(jointed, hinge, test::joint(DFM_JOINT_BALL, 0, DFM_RIGID_WORLD, at));
  refused(jointed, hinge, test::joint(DFM_JOINT_HINGE, 0, DFM_RIGID_WORLD, at, {0, 1, 0}));
  refused(jointed, hinge, test::joint(DFM_JOINT_HINGE, 0, DFM_RIGID_WORLD, {0, 0, 0.2}, {1, 0, 0}));
  const auto tool = [](dfm_world w, uint32_t shape) {
    dfm_tool_def d = dfm_tool_def_default();
    d.name = "tool";
    d.shape = shape;
    for (double &h : d.half_size) h = 0.01;
    dfm_tool out = 0;
    test::ok(dfm_tool_create(w, &d, &out));
  };
  refused(tool, uint32_t{DFM_TOOL_BOX}, uint32_t{DFM_TOOL_BLADE});
}

TEST(Snapshot, IntoATooSmallBuffer_ReturnsTheNeededSize) {
  test::Context c;
  const test::Stack s = build(c);
  size_t bytes = 0, small = 10;
  test::ok(dfm_world_snapshot(s.world, nullptr, &bytes));
  std::string data(bytes, 'q');
  EXPECT_EQ(dfm_world_snapshot(s.world, data.data(), &small), DFM_E_ARG);
  EXPECT_EQ(small, bytes);
  EXPECT_EQ(data, std::string(bytes, 'q')) << "untouched";
  EXPECT_EQ(dfm_world_snapshot(s.world, data.data(), nullptr), DFM_E_ARG);
}
