// A game that creates and destroys things while it runs, saves, and loads into a world built anew, or rewinds
// to before something was destroyed: things are found by name, or by their order if they have no name.
#include <algorithm>

#include "cut_scenes.h"
#include "rigid.h"
#include "stack.h"
#include "support.h"

namespace {

using test::snapshot;

dfm_status restore(dfm_world w, const std::string &data) {
  return dfm_world_restore(w, data.data(), data.size());
}

void steps(dfm_world w, int n) {
  for (int i = 0; i < n; ++i) ASSERT_EQ(dfm_world_step(w, 1.0 / 240, nullptr), DFM_OK) << dfm_last_error();
}

dfm_body crate(dfm_context *c, dfm_world w, const std::string &name, std::array<double, 3> at,
               double size = 0.1) {
  test::BodyOptions o;
  o.name = name;
  o.young = 5e4;
  o.density = 300;
  o.damping_stiffness = 2e-3;
  o.position = at;
  return test::make_body(c, w, "beam", {size, size, size}, 24, o);
}

dfm_obstacle ball(dfm_world w, const char *name, double x, double radius = 0.05) {
  dfm_obstacle_def d = dfm_obstacle_def_default();
  d.name = name;
  d.shape = DFM_SHAPE_SPHERE;
  d.radius = radius;
  d.pose.position[0] = x;
  dfm_obstacle out = 0;
  test::ok(dfm_obstacle_create(w, &d, &out));
  return out;
}

dfm_world empty(dfm_context *c) {
  dfm_world_def d = dfm_world_def_default();
  d.sleep = 1;
  d.self_contact = DFM_SELF_ON;
  dfm_world w = 0;
  test::ok(dfm_world_create(c, &d, &w));
  return w;
}

// Friction rule and contacts refer to these by name.
void slip(dfm_world w, const char *a, const char *b) {
  test::ok(test::add_friction(w, "coulomb", {{"mu", 0.1}}, a, b));
}

void expect_refused(dfm_world w, const std::string &data, const char *part) {
  const uint64_t hash = dfm_world_hash(w);
  const std::string state = snapshot(w);
  EXPECT_EQ(restore(w, data), DFM_E_FORMAT);
  EXPECT_NE(std::string(dfm_last_error()).find(part), std::string::npos) << dfm_last_error();
  EXPECT_EQ(dfm_world_hash(w), hash);
  EXPECT_EQ(snapshot(w), state);
}

}  // namespace

TEST(SavedGame, AfterBodiesWereDestroyed_LoadsIntoAWorldBuiltAnewWithTheSameBits) {
  test::Context c;
  const dfm_world w = empty(c);
  test::add_plane(w, "floor");
  const dfm_body gone = crate(c, w, "gone", {0, 0, 0.01});
  crate(c, w, "one", {0.02, 0.01, 0.12});
  const dfm_body burst = crate(c, w, "", {0.3, 0, 0.01});
  crate(c, w, "", {0.31, 0.02, 0.12});
  const dfm_obstacle side = ball(w, nullptr, 0.7);
  const dfm_obstacle post = ball(w, "post", -0.1);
  crate(c, w, "", {-0.15, 0, 0.1}, 0.12);
  slip(w, "one", "floor");
  steps(w, 60);
  test::ok(dfm_body_destroy(gone));  // while it carries another one
  test::ok(dfm_body_destroy(burst));
  test::ok(dfm_obstacle_destroy(post));
  steps(w, 20);
  const dfm_body late = crate(c, w, "late", {0.02, 0, 0.4});
  ball(w, "post", 0.1);
  test::create(w, {test::box(nullptr, {0.05, 0.05, 0.05}, 0.3, {0.3, 0, 0.4})});
  slip(w, "late", "*");
  steps(w, 30);
  ASSERT_GT(test::contacts(w).size(), 2u);
  const dfm_pose away{{0.5, 0.1, 0}, {0, 0, 0, 1}};
  test::ok(dfm_obstacle_teleport(side, &away));
  const std::string saved = snapshot(w);
  steps(w, 200);
  const uint64_t later = dfm_world_hash(w);
  test::ok(dfm_body_destroy(late));

  // what has a name in another order, the rest in the same order
  const dfm_world anew = empty(c);
  ball(anew, "post", 0.1);
  crate(c, anew, "", {5, 0, 1});
  crate(c, anew, "late", {6, 0, 1});
  ball(anew, nullptr, 0.55);
  const dfm_body last = crate(c, anew, "", {7, 0, 1}, 0.12);
  const std::vector<dfm_rigid> box =
      test::create(anew, {test::box(nullptr, {0.05, 0.05, 0.05}, 0.3, {3, 0, 0.4})});
  const dfm_body one = crate(c, anew, "one", {8, 0, 1});
  test::add_plane(anew, "floor");
  steps(anew, 3);
  ASSERT_EQ(restore(anew, saved), DFM_OK) << dfm_last_error();
  EXPECT_EQ(snapshot(anew), saved);
  std::vector<dfm_body> bodies = test::listed(dfm_world_bodies, anew);
  EXPECT_EQ(bodies.front(), one) << "in the order of the saved game";
  EXPECT_LT(test::measure(last).com[0], 0.2);
  EXPECT_LT(test::state(box[0]).position[2], 0.4);
  steps(anew, 200);
  EXPECT_EQ(dfm_world_hash(anew), later);
  // new things get numbers of their own
  crate(c, anew, "", {3, 0, 1});
  ball(anew, nullptr, 4);
  steps(anew, 5);
}

TEST(SavedGame, RewoundToBeforeABodyWasDestroyed_GoesOnOnceTheBodyIsThereAgain) {
  test::Context c;
  const dfm_world w = empty(c);
  test::add_plane(w, "floor");
  const dfm_body lower = crate(c, w, "lower", {0, 0, 0.01});
  const dfm_body upper = crate(c, w, "upper", {0.02, 0.01, 0.12});
  steps(w, 50);
  const std::string taken = snapshot(w);
  steps(w, 100);
  const uint64_t later = dfm_world_hash(w);
  test::ok(dfm_body_destroy(lower));
  steps(w, 10);
  expect_refused(w, taken, "body 'lower' is not in this world; create it before you restore");
  for (int again = 0; again < 2; ++again) {
    crate(c, w, "lower", {1, 0, 1});
    ASSERT_EQ(restore(w, taken), DFM_OK) << dfm_last_error();
    EXPECT_GT(test::measure(upper).com[2], 0.1);
    steps(w, 100);
    EXPECT_EQ(dfm_world_hash(w), later);
    dfm_body now = 0;
    test::ok(dfm_world_find_body(w, "lower", &now));
    if (again == 0) test::ok(dfm_body_destroy(now));
  }
  const dfm_body extra = crate(c, w, "extra", {2, 0, 1});
  expect_refused(w, taken, "body 'extra' was not there when it was taken; destroy it before you restore");
  test::ok(dfm_body_destroy(extra));
  ball(w, nullptr, 4);
  expect_refused(w, taken, "was not there");
}

TEST(SavedGame, WithABodyOfAnotherMesh_IsRefusedUnderItsName) {
  test::Context c;
  const dfm_world w = empty(c), other = empty(c);
  for (const dfm_world world : {w, other}) {
    crate(c, world, "gone", {9, 0, 1});
    crate(c, world, "first", {0, 0, 1});
  }
  crate(c, w, "second", {1, 0, 1}, 0.1);
  dfm_body gone = 0;
  test::ok(dfm_world_find_body(w, "gone", &gone));
  test::ok(dfm_body_destroy(gone));
  test::ok(dfm_world_find_body(other, "gone", &gone));
  test::ok(dfm_body_destroy(gone));
  crate(c, other, "second", {1, 0, 1}, 0.2);
  expect_refused(other, snapshot(w), "body 'second' has another shape, mesh");
  crate(c, w, "", {3, 0, 1});
  test::ok(dfm_world_find_body(other, "second", &gone));
  test::ok(dfm_body_destroy(gone));
  crate(c, other, "second", {1, 0, 1}, 0.1);
  expect_refused(other, snapshot(w), "more than the 0 of this world that were created without a name (body)");
}

// Tools that cut, sensors and answers of the host refer to things by their numbers.
TEST(SavedGame, WithToolsSensorsAndPieces_LoadsWithTheSameBits) {
  test::Context c;
  const auto build = [&](dfm_world w, bool anew) {
    if (!anew) ball(w, "gone", 9);
    const dfm_body dough = crate(c, w, "dough", {0, 0, 0.01}, 0.1);
    if (anew) crate(c, w, "clump", {0.06, 0.02, 0.4}, 0.05);
    test::add_plane(w, "floor");
    dfm_obstacle_def gate = dfm_obstacle_def_default();
    gate.name = "gate";
    gate.shape = DFM_SHAPE_BOX;
    for (double &size : gate.half_size) size = 0.02;
    gate.pose.position[0] = 0.08;
    gate.pose.position[2] = 0.2;
    dfm_obstacle o = 0;
    test::ok(dfm_obstacle_create(w, &gate, &o));
    test::ok(dfm_obstacle_set_sensor(o, true));
    dfm_tool_def blade = dfm_tool_def_default();
    blade.name = "blade";
    blade.shape = DFM_TOOL_BLADE;
    const dfm_pose_key keys[] = {{0, {{0.03, 0.05, 0.3}, {0, 0, 0, 1}}},
                                 {1.2, {{0.03, 0.05, 0}, {0, 0, 0, 1}}}};
    blade.half_size[0] = 1e-3;
    blade.half_size[1] = blade.half_size[2] = 0.1;
    blade.nkey = 2;
    blade.keys = keys;
    dfm_tool tool = 0;
    test::ok(dfm_tool_create(w, &blade, &tool));
    test::ok(dfm_tool_set_cuts(tool, DFM_CUT_SPLIT, 0, 1, &dough));
    if (!anew) crate(c, w, "clump", {0.06, 0.02, 0.4}, 0.05);
    const dfm_separate_def rule = dfm_separate_def_default();
    test::ok(dfm_body_set_separate(dough, &rule));
    return dough;
  };
  const dfm_world w = empty(c);
  const dfm_body dough = build(w, false);
  dfm_obstacle gone = 0;
  test::ok(dfm_world_find_obstacle(w, "gone", &gone));
  test::ok(dfm_obstacle_destroy(gone));
  dfm_cut_def plane = dfm_cut_def_default();
  plane.shape = DFM_CUT_PLANE;
  plane.how = DFM_CUT_SPLIT;
  for (int k = 0; k < 3; ++k) plane.blade[k] = 0.05;
  plane.blade[3] = 1;
  steps(w, 20);
  test::ok(dfm_body_cut(dough, &plane, nullptr));
  steps(w, 20);
  const size_t cut = test::listed(dfm_world_bodies, w).size();
  ASSERT_GT(cut, 2u);
  const std::string saved = snapshot(w);
  const auto reported = [](dfm_world world) {
    test::events(world);
    size_t n = 0;
    for (int i = 0; i < 260; ++i) {
      steps(world, 1);
      for (const dfm_contact_event &e : test::events(world))
        n += e.kind == DFM_EVENT_SENSOR_BEGIN || e.kind == DFM_EVENT_CUT || e.kind == DFM_EVENT_PIECE;
    }
    return n;
  };
  const size_t first = reported(w);
  EXPECT_GT(first, 0u);
  const uint64_t later = dfm_world_hash(w);
  const dfm_world anew = empty(c);
  const dfm_body again = build(anew, true);
  // a piece of its own, under a number that the saved game has given to something else
  test::ok(dfm_body_cut(again, &plane, nullptr));
  for (int twice = 0; twice < 2; ++twice) {
    ASSERT_EQ(restore(anew, saved), DFM_OK) << dfm_last_error();
    EXPECT_EQ(test::listed(dfm_world_bodies, anew).size(), cut);
    EXPECT_EQ(reported(anew), first);
    EXPECT_EQ(dfm_world_hash(anew), later);
  }
}

TEST(SavedGame, DecisionsOfTheHost_StayThoseOfTheSamePairs) {
  test::Context c;
  int requested = 0;
  const dfm_may_touch_fn no = [](void *user, uint64_t, uint64_t) {
    ++*static_cast<int *>(user);
    return false;
  };
  const dfm_world w = empty(c);
  crate(c, w, "gone", {9, 0, 1});
  crate(c, w, "a", {0, 0, 1});
  dfm_body gone = 0;
  test::ok(dfm_world_find_body(w, "gone", &gone));
  test::ok(dfm_body_destroy(gone));
  crate(c, w, "b", {0.05, 0, 1});
  ball(w, "post", 0, 0.2);
  test::ok(dfm_world_set_may_touch(w, no, &requested));
  steps(w, 2);
  ASSERT_GT(requested, 0);
  const std::string saved = snapshot(w);
  steps(w, 150);
  EXPECT_EQ(test::contacts(w).size(), 0u);
  const uint64_t later = dfm_world_hash(w);
  const dfm_world anew = empty(c);
  test::ok(dfm_world_set_may_touch(anew, no, &requested));
  ball(anew, "post", 0, 0.2);
  crate(c, anew, "b", {0, 0, 1});
  crate(c, anew, "a", {0.05, 0, 1});
  steps(anew, 1);
  requested = 0;
  ASSERT_EQ(restore(anew, saved), DFM_OK) << dfm_last_error();
  steps(anew, 150);
  EXPECT_EQ(requested, 0) << "all pairs have been asked";
  EXPECT_EQ(dfm_world_hash(anew), later);
}

namespace {

// Both halves of what the blade of dfm_cut_def says; the second one becomes a body.
void halve(dfm_body body, double x) {
  const dfm_separate_def rule = dfm_separate_def_default();
  test::ok(dfm_body_set_separate(body, &rule));
  dfm_cut_def plane = dfm_cut_def_default();
  plane.shape = DFM_CUT_PLANE;
  plane.how = DFM_CUT_SPLIT;
  plane.blade[0] = x;
  plane.blade[3] = 1;
  test::ok(dfm_body_cut(body, &plane, nullptr));
}

dfm_body found(dfm_world w, const char *name) {
  dfm_body out = 0;
  test::ok(dfm_world_find_body(w, name, &out));
  return out;
}

}  // namespace

// A rewind takes the piece of one body back, and the next piece, of another body, has its number.
TEST(SavedGame, RewoundAndCutOtherwise_LoadsEachOfTheTwoCourses) {
  test::Context c;
  const dfm_world w = empty(c);
  test::add_plane(w, "floor");
  const dfm_body left = crate(c, w, "left", {0, 0, 0.01}), right = crate(c, w, "right", {0.3, 0, 0.01});
  steps(w, 5);
  const std::string start = snapshot(w);
  std::string saved[2];
  uint64_t later[2];
  for (int k = 0; k < 2; ++k) {
    halve(k == 0 ? left : right, k == 0 ? 0.05 : 0.35);
    steps(w, 5);
    saved[k] = snapshot(w);
    steps(w, 20);
    later[k] = dfm_world_hash(w);
    ASSERT_EQ(restore(w, start), DFM_OK) << dfm_last_error();
  }
  std::string bad = saved[0];
  bad.back() ^= 1;
  for (const int k : {0, 1, 1, 0}) {
    expect_refused(w, bad, "damaged");
    ASSERT_EQ(restore(w, saved[k]), DFM_OK) << k << ": " << dfm_last_error();
    EXPECT_EQ(snapshot(w), saved[k]);
    found(w, k == 0 ? "left.1" : "right.1");
    steps(w, 20);
    EXPECT_EQ(dfm_world_hash(w), later[k]) << k;
  }
}

// Pieces of a destroyed body are bodies of their own, with the mesh of the whole body.
TEST(SavedGame, WithAPieceWhoseBodyIsGone_LoadsIntoAWorldBuiltAnew) {
  test::Context c;
  const dfm_world w = empty(c);
  test::add_plane(w, "floor");
  const dfm_body dough = crate(c, w, "dough", {0, 0, 0.01});
  crate(c, w, "other", {0.3, 0, 0.05});
  steps(w, 5);
  halve(dough, 0.04);
  steps(w, 5);
  test::ok(dfm_body_destroy(dough));
  steps(w, 5);
  const std::string saved = snapshot(w);
  steps(w, 40);
  const uint64_t later = dfm_world_hash(w);
  const dfm_world anew = empty(c);
  crate(c, anew, "dough.1", {0, 0, 0.01});
  crate(c, anew, "other", {0.3, 0, 0.05});
  test::add_plane(anew, "floor");
  ASSERT_EQ(restore(anew, saved), DFM_OK) << dfm_last_error();
  EXPECT_EQ(snapshot(anew), saved);
  steps(anew, 40);
  EXPECT_EQ(dfm_world_hash(anew), later);
}

TEST(SavedGame, BodyOfAnEmptyWorld_IsNotFoundInOneSentence) {
  test::Context c;
  dfm_body body = 0;
  EXPECT_EQ(dfm_world_find_body(empty(c), "dough", &body), DFM_E_ARG);
  EXPECT_STREQ(dfm_last_error(), "no body is named 'dough'; the world has none");
}

// A contact of a free rigid body with something rigid goes with the body, also where it was the last of its
// kind in the world.
TEST(SavedGame, WithoutTheRigidBodyThatTouched_LoadsIntoAWorldBuiltAnew) {
  test::Context c;
  const dfm_world w = empty(c);
  test::add_plane(w, "floor");
  const dfm_rigid weight = test::create(w, {test::box("weight", {0.05, 0.05, 0.05}, 1, {1, 0, 0.06})}, {})[0];
  steps(w, 60);
  uint32_t contacts = 0;
  test::ok(dfm_world_contacts(w, 0, nullptr, &contacts));
  ASSERT_GT(contacts, 0u);
  test::ok(dfm_rigid_destroy(weight));
  const std::string saved = snapshot(w);
  const dfm_world anew = empty(c);
  test::add_plane(anew, "floor");
  ASSERT_EQ(restore(anew, saved), DFM_OK) << dfm_last_error();
  EXPECT_EQ(snapshot(anew), saved);
  for (int k = 0; k < 3; ++k) {
    steps(w, 1);
    steps(anew, 1);
    EXPECT_EQ(dfm_world_hash(anew), dfm_world_hash(w)) << k;
    EXPECT_EQ(snapshot(anew), snapshot(w)) << k;
  }
}

// A piece without cells goes with the body that it came off: no list shows it, so nobody would destroy it.
TEST(SavedGame, RewoundToBeforeABodyWhosePieceLostItsCells_Loads) {
  test::Context c;
  const dfm_world w = empty(c);
  test::add_plane(w, "floor");
  crate(c, w, "other", {0.3, 0, 0.05});
  steps(w, 5);
  const std::string saved = snapshot(w);
  const dfm_body dough = crate(c, w, "dough", {0, 0, 0.01});
  steps(w, 5);
  halve(dough, 0.04);
  const dfm_body piece = found(w, "dough.1");
  dfm_cut_def all = dfm_cut_def_default();
  std::fill_n(all.half_size, 3, 1.0);
  test::ok(dfm_body_cut(piece, &all, nullptr));
  steps(w, 5);
  test::ok(dfm_body_destroy(dough));
  EXPECT_EQ(restore(w, saved), DFM_OK) << dfm_last_error();
  EXPECT_EQ(dfm_body_destroy(piece), DFM_E_HANDLE);
}

// What a tool cuts is state: a rewind takes it back, and a world built anew has it.
TEST(SavedGame, WithAToolThatCuts_LoadsWhatItCuts) {
  test::Context c;
  const auto build = [&](dfm_world w) {
    test::add_plane(w, "floor");
    crate(c, w, "dough", {0, 0, 0.01});
    dfm_tool_def d = dfm_tool_def_default();
    d.name = "punch";
    const dfm_pose_key keys[] = {{0, {{0.05, 0.05, 0.3}, {0, 0, 0, 1}}},
                                 {0.5, {{0.05, 0.05, 0.05}, {0, 0, 0, 1}}}};
    d.radius = 0.02;
    d.nkey = 2;
    d.keys = keys;
    dfm_tool tool = 0;
    test::ok(dfm_tool_create(w, &d, &tool));
    return tool;
  };
  const auto cut_bodies = [](dfm_tool tool) {
    uint32_t n = 0;
    test::ok(dfm_tool_cuts(tool, nullptr, nullptr, 0, nullptr, &n));
    return n;
  };
  const dfm_world w = empty(c), anew = empty(c);
  const dfm_tool punch = build(w), other = build(anew);
  steps(w, 5);
  const std::string blunt = snapshot(w);
  const dfm_body dough = found(w, "dough");
  test::ok(dfm_tool_set_cuts(punch, DFM_CUT_REMOVE, 2, 1, &dough));
  steps(w, 5);
  const std::string sharp = snapshot(w);
  uint64_t later[2];
  for (const bool cuts : {false, true}) {
    ASSERT_EQ(restore(w, cuts ? sharp : blunt), DFM_OK) << dfm_last_error();
    EXPECT_EQ(cut_bodies(punch), uint32_t(cuts));
    steps(w, 120);
    later[cuts] = dfm_world_hash(w);
  }
  EXPECT_NE(later[0], later[1]);
  for (const bool cuts : {true, false}) {
    ASSERT_EQ(restore(anew, cuts ? sharp : blunt), DFM_OK) << dfm_last_error();
    EXPECT_EQ(cut_bodies(other), uint32_t(cuts));
    EXPECT_EQ(snapshot(anew), cuts ? sharp : blunt);
    steps(anew, 120);
    EXPECT_EQ(dfm_world_hash(anew), later[cuts]);
  }
}
