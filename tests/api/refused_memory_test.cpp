// One allocation is refused, whichever it is, of the context's hooks or of operator new: the call fails
// cleanly or does without, the world is what it was, and once memory is back everything ends with the bits of
// a world that never missed any.
#include "refused_memory.h"

#include <algorithm>
#include <array>
#include <functional>

#include "bristle_law.h"
#include "cut_scenes.h"
#include "hook.h"
#include "obstacle.h"
#include "rigid.h"

namespace {

using test::Refusal;
using Build = std::function<dfm_world(dfm_context *)>;
constexpr int kSteps = 10;
constexpr double kStep = 1e-4;  // s, below every bound: a step is one sub-step

dfm_context *make_context() {
  dfm_context_def d = test::refusing_context();
  d.plugin_dir = DEFORM_PLUGIN_DIR;
  dfm_context *c = nullptr;
  EXPECT_EQ(dfm_context_create(&d, &c), DFM_OK) << dfm_last_error();
  EXPECT_EQ(dfm_plugin_register_static(c, dfm_plugin_entry_bristle, "bristle"), DFM_OK) << dfm_last_error();
  return c;
}

// Two legs that close on each other.
dfm_world close_legs(dfm_context *c, uint32_t self) {
  dfm_world_def d = dfm_world_def_default();
  d.gravity[2] = 0;
  d.self_contact = self;
  dfm_world w = 0;
  test::ok(dfm_world_create(c, &d, &w));
  test::HookOptions o;
  o.young = 1e4;
  o.cell = 0.002;
  o.close = 1.5;
  test::make_hook(w, o);
  return w;
}

dfm_world self_contact(dfm_context *c) { return close_legs(c, DFM_SELF_ON); }
dfm_world self_auto(dfm_context *c) { return close_legs(c, DFM_SELF_AUTO); }

// Two small boxes: one falls asleep at once, one drops on it and wakes it.
dfm_world sleepers(dfm_context *c) {
  dfm_world_def d = dfm_world_def_default();
  d.sleep = 1;
  d.sleep_speed = 0.5;
  d.sleep_time = 3e-4;
  dfm_world w = 0;
  test::ok(dfm_world_create(c, &d, &w));
  test::add_plane(w, "floor");
  test::BodyOptions o;
  o.young = 2e5;
  o.damping_stiffness = 2e-3;
  o.damping_mass = 20;
  o.position = {0, 0, 4e-5};
  test::make_body(c, w, "beam", {0.1, 0.1, 0.1}, 10, o);
  o.position = {0.02, 0.03, 0.1009};
  o.velocity = {0, 0, -1};
  test::make_body(c, w, "beam", {0.1, 0.1, 0.1}, 10, o);
  return w;
}

// A box on a hinge whose motor turns it into a soft one, and a free one that falls on that.
dfm_world rigid_host(dfm_context *c) {
  const dfm_world w = test::make_world(c);
  test::add_plane(w, "floor");
  test::BodyOptions o;
  o.young = 2e5;
  o.damping_stiffness = 1e-3;
  o.position = {0, 0, 4e-5};
  test::make_body(c, w, "beam", {0.1, 0.1, 0.1}, 10, o);
  dfm_joint_def hinge = test::joint(DFM_JOINT_HINGE, 0, DFM_RIGID_WORLD, {0.3, 0, 0.1202}, {0, 1, 0});
  hinge.motor = 1;
  hinge.velocity = -2;
  hinge.max = 5;
  dfm_rigid_def falling = test::box("free", {0.1, 0.1, 0.02}, 0.2, {0, 0, 0.1202});
  falling.velocity[2] = -1;
  test::create(w, {test::box("arm", {0.2, 0.02, 0.02}, 0.5, {0.1, 0, 0.1202}), falling}, {hinge});
  return w;
}

// A free box and a body of triangles fall on triangles, beside a soft body: trees and lists of what is near.
dfm_world rigid_on_triangles(dfm_context *c) {
  const dfm_world w = test::make_world(c);
  const test::Triangles slab = test::height_field(0.5, 12, [](double, double) { return 0.0; });
  test::add_mesh(w, "slab", slab);
  test::BodyOptions o;
  o.young = 2e5;
  o.damping_stiffness = 1e-3;
  o.position = {0, 0, 8e-4};  // it is there in the last steps
  o.velocity = {0, 0, -1};
  test::make_body(c, w, "beam", {0.1, 0.1, 0.1}, 10, o);
  dfm_rigid_def falling = test::box("free", {0.05, 0.05, 0.02}, 0.2, {0.3, 0, 0.0203});
  falling.velocity[2] = -1;
  test::create(w, {falling});
  dfm_rigid_def lump = test::box("lump", {0.05, 0.05, 0.02}, 0.2, {-0.3, 0, 0.0203});
  lump.velocity[2] = -1;
  lump.shape = DFM_SHAPE_NONE;
  for (double &moment : lump.inertia) moment = 1e-3;
  const dfm_rigid r = test::create(w, {lump})[0];
  const test::Triangles surface = test::box_surface({0.05, 0.05, 0.02}, 2);
  const dfm_obstacle_def of = test::mesh_def("lump.surface", surface);
  dfm_obstacle shape = 0;
  test::ok(dfm_rigid_add_shape(r, &of, &shape));
  return w;
}

// A law that remembers, two materials in contact, triangles below.
dfm_world bristles(dfm_context *c) {
  const dfm_world w = test::make_world(c, {2, 0, -9.81});
  const test::Triangles slab = test::box_surface({0.3, 0.3, 0.05}, 1);
  test::add_mesh(w, "slab", slab);
  dfm_friction_def f{};
  f.size = sizeof f;
  f.between[0] = f.between[1] = "*";
  f.law = "test.bristle";
  test::ok(dfm_world_add_friction(w, &f));
  test::BodyOptions o;
  o.young = 2e5;
  o.damping_stiffness = 1e-3;
  o.position = {0, 0, 0.0501};
  test::make_body(c, w, "beam", {0.1, 0.1, 0.1}, 10, o);
  o.position = {0.013, 0.007, 0.1503};
  test::make_body(c, w, "beam", {0.1, 0.1, 0.1}, 10, o);
  return w;
}

// A body of it gets another model in the middle of the walk.
dfm_world changing(dfm_context *c) {
  const dfm_world w = bristles(c);
  std::vector<dfm_body> bodies = test::listed(dfm_world_bodies, w);
  dfm_switch to = dfm_switch_default();
  to.t = 4 * kStep;
  to.type = "corotational_fem";
  test::ok(dfm_body_set_switches(bodies[0], 1, &to));
  return w;
}

using Hashes = std::array<uint64_t, kSteps>;  // after each step

// Steps with the n-th allocation from here on refused; what failed is tried again with memory back. Whether
// the n-th was reached. Two more steps follow that; every eighth walk goes to the end.
bool walk(dfm_context *c, const Build &build, int64_t n, const Hashes &expected, int *refused) {
  const dfm_world w = build(c);
  Refusal::arm(n);
  bool armed = true, came = false;
  int last = kSteps - 1;
  for (int i = 0; i <= last; ++i) {
    const int64_t kept = Refusal::refuse;
    const uint64_t before = dfm_world_hash(w);
    dfm_status status = dfm_world_step(w, kStep, nullptr);
    if (armed && Refusal::calls > kept) {
      Refusal::disarm();
      armed = false;
      came = true;
      if (n % 8 != 0) last = std::min(last, i + 2);
    }
    if (status == DFM_OK) continue;
    ++*refused;
    EXPECT_EQ(status, DFM_E_NOMEM) << "allocation " << n << ", step " << i << ": " << dfm_last_error();
    // a change of model stays made where the step after it is not, and the hash tells models
    const bool changed = !test::listed(dfm_world_swaps, w).empty();
    EXPECT_TRUE(changed || dfm_world_hash(w) == before) << "allocation " << n << ", step " << i;
    status = dfm_world_step(w, kStep, nullptr);
    EXPECT_EQ(status, DFM_OK) << "allocation " << n << ", step " << i << ": " << dfm_last_error();
  }
  if (armed) Refusal::disarm();
  EXPECT_EQ(dfm_world_hash(w), expected[size_t(last)]) << "allocation " << n;
  test::ok(dfm_world_destroy(w));
  return came;
}

void walk_all(const Build &build, int least) {
  dfm_context *const c = make_context();  // one: to load the plugins takes longer than the steps
  const dfm_world w = build(c);
  Hashes expected{};
  for (uint64_t &hash : expected) {
    EXPECT_EQ(dfm_world_step(w, kStep, nullptr), DFM_OK) << dfm_last_error();
    hash = dfm_world_hash(w);
  }
  EXPECT_EQ(test::stats(w).substeps_max, 1u);
  EXPECT_GT(test::contacts(w).size(), 0u) << "the scene has no contact: the walk would show little";
  test::ok(dfm_world_destroy(w));
  int refused = 0;
  EXPECT_FALSE(walk(c, build, int64_t(1) << 40, expected, &refused));
  const int64_t live = Refusal::live;
  int64_t n = 0;
  while (!testing::Test::HasFailure() && walk(c, build, n, expected, &refused)) ++n;
  EXPECT_EQ(Refusal::live, live);
  dfm_context_destroy(c);
  EXPECT_GT(n, least);
  EXPECT_GT(refused, least / 2);
}

}  // namespace

// unsanitized: too slow there; shorter tests run the same code
TEST(RefusedMemory, InAStepWithSelfContact_LeavesTheWorldAsItWas) { walk_all(self_contact, 40); }
TEST(RefusedMemory, InAStepWithSelfContactOnAuto_LeavesTheWorldAsItWas) { walk_all(self_auto, 40); }
TEST(RefusedMemory, InAStepThatFallsAsleepAndWakes_LeavesTheWorldAsItWas) { walk_all(sleepers, 40); }
TEST(RefusedMemory, InAStepWithARigidHost_LeavesTheWorldAsItWas) { walk_all(rigid_host, 40); }
TEST(RefusedMemory, InAStepOfRigidBodiesOnTriangles_LeavesTheWorldAsItWas) {
  walk_all(rigid_on_triangles, 40);
}
TEST(RefusedMemory, InAStepOfALawThatRemembers_LeavesTheWorldAsItWas) { walk_all(bristles, 40); }

TEST(RefusedMemory, InAStepThatChangesAModel_LeavesTheWorldAsItWas) { walk_all(changing, 40); }

namespace {

constexpr double kCutStep = 1e-3;  // s

// A cube that moves by 6 mm in each step, and that a plane cuts in the second one.
dfm_world flies(dfm_context *c, dfm_body *body) {
  const dfm_world w = test::make_world(c, {0, 0, 0});
  test::BodyOptions o;
  o.name = "cube";
  o.model = "corotational_fem";
  o.young = 3e4;
  o.damping_stiffness = 2e-4;
  o.position = {-0.02, -0.02, -0.032};
  o.velocity = {0, 0, 6};
  *body = test::make_body(c, w, "beam", {0.04, 0.04, 0.04}, 20, o);
  const dfm_separate_def rule = dfm_separate_def_default();
  test::ok(dfm_body_set_separate(*body, &rule));
  return w;
}

uint32_t cuts_reported(dfm_world w) {
  uint32_t n = 0;
  for (const dfm_contact_event &e : test::listed(dfm_world_events, w)) n += e.kind == DFM_EVENT_CUT;
  return n;
}

uint32_t pieces_of(dfm_body b) {
  uint32_t n = 0;
  test::ok(dfm_body_pieces(b, 0, nullptr, &n));
  return n;
}

struct CutRun {
  bool came = false;                       // did it come to the n-th allocation?
  uint32_t refused = 0, waited = 0;        // steps that were refused; cuts whose pieces had to wait
  std::array<double, 3> cut{0, 0, 0.001};  // a place on the plane
};

// Without the n-th allocation of the step that cuts. However it ends, the cut is made once and told once, and
// the piece comes off.
void cut_without(dfm_context *c, int64_t n, bool restores, CutRun &run) {
  dfm_body b = 0;
  dfm_world w = flies(c, &b);
  dfm_cut_def d = dfm_cut_def_default();
  d.shape = DFM_CUT_PLANE;
  d.how = DFM_CUT_SPLIT;
  std::copy(run.cut.begin(), run.cut.end(), d.blade);
  d.blade[5] = 1;
  test::ok(dfm_body_plan_cut(b, 2 * kCutStep, &d));
  test::ok(dfm_world_step(w, kCutStep, nullptr));
  Refusal::arm(n);
  const dfm_status status = dfm_world_step(w, kCutStep, nullptr);
  run.came = Refusal::disarm();
  EXPECT_TRUE(status == DFM_OK || status == DFM_E_NOMEM) << "allocation " << n << ": " << dfm_last_error();
  run.refused += status != DFM_OK;
  uint32_t reported = cuts_reported(w);
  if (reported > 0 && pieces_of(b) == 0) {
    ++run.waited;
    EXPECT_EQ(status, DFM_OK) << "allocation " << n << ": the step has been made";
    EXPECT_EQ(dfm_body_set_model(b, "shape_matching", nullptr), DFM_E_UNSUPPORTED) << dfm_last_error();
    if (restores) {  // where parts wait is in snapshots
      const std::string now = test::snapshot(w);
      test::ok(dfm_world_destroy(w));
      w = flies(c, &b);
      test::ok(dfm_world_restore(w, now.data(), now.size()));
      EXPECT_EQ(test::snapshot(w), now) << "allocation " << n;
    }
  }
  for (int i = 0; i < 3; ++i) {
    test::ok(dfm_world_step(w, kCutStep, nullptr));
    reported += cuts_reported(w);
  }
  EXPECT_EQ(reported, 1u) << "allocation " << n;
  EXPECT_EQ(pieces_of(b), 1u) << "allocation " << n << ": one cut, one piece";
  test::ok(dfm_world_destroy(w));
}

}  // namespace

TEST(RefusedMemory, InAStepThatCuts_MakesAndReportsTheCutOnce) {
  dfm_context *const c = make_context();
  CutRun run;
  cut_without(c, int64_t(1) << 40, false, run);
  ASSERT_FALSE(run.came || HasFailure());
  const int64_t all = Refusal::calls;
  for (int64_t n = 0; n < all && !HasFailure(); ++n) cut_without(c, n, n % 16 == 0, run);
  EXPECT_GT(run.refused, 100u);
  EXPECT_GT(run.waited, 50u);
  dfm_context_destroy(c);
}

namespace {

// Back to the fourth step of a world.
void restore_all(const Build &build) {
  dfm_context *const c = make_context();
  const dfm_world w = build(c);
  for (int i = 0; i < 4; ++i) test::ok(dfm_world_step(w, kStep, nullptr));
  const std::string then = test::snapshot(w);
  const uint64_t hash_then = dfm_world_hash(w);
  for (int i = 0; i < 6; ++i) test::ok(dfm_world_step(w, kStep, nullptr));
  const uint64_t hash = dfm_world_hash(w);
  const uint32_t asleep = test::stats(w).asleep;
  int64_t n = 0;
  for (dfm_status status = DFM_E_NOMEM; status != DFM_OK && n < 10000; ++n) {
    Refusal::arm(n);
    status = dfm_world_restore(w, then.data(), then.size());
    Refusal::disarm();
    if (status == DFM_OK) break;
    ASSERT_EQ(status, DFM_E_NOMEM) << "allocation " << n << ": " << dfm_last_error();
    ASSERT_EQ(dfm_world_hash(w), hash) << "allocation " << n;
    ASSERT_EQ(test::stats(w).asleep, asleep) << "allocation " << n;
  }
  EXPECT_GT(n, 60);
  EXPECT_EQ(dfm_world_hash(w), hash_then);
  EXPECT_EQ(test::snapshot(w), then);
  dfm_context_destroy(c);
}

}  // namespace

// A restore that finds no memory, wherever it misses it, leaves the world that was there; with
// memory it is done.
TEST(RefusedMemory, InARestore_LeavesTheWorldAsItWas) { restore_all(sleepers); }
TEST(RefusedMemory, InARestoreThatBringsAModelBack_LeavesTheWorldAsItWas) { restore_all(changing); }

namespace {

// Without the n-th allocation; true: it was not reached.
bool set_up_without(int64_t n, int &refused) {
  dfm_context_def d = test::refusing_context();
  dfm_context *c = nullptr;
  dfm_world w = 0;
  dfm_mesh_handle mesh = 0;
  const double size[3] = {0.1, 0.1, 0.1};
  Refusal::arm(n);
  dfm_status status = dfm_context_create(&d, &c);
  if (status == DFM_OK) status = dfm_world_create(c, nullptr, &w);
  if (status == DFM_OK) status = dfm_mesh_make(c, "beam", size, DFM_MESH_CELLS, 10, &mesh);
  const bool through = !Refusal::disarm();
  if (status != DFM_OK) {
    ++refused;
    EXPECT_TRUE(status == DFM_E_NOMEM || status == DFM_E_IO)
        << "allocation " << n << ": " << dfm_status_name(status) << ": " << dfm_last_error();
  }
  dfm_context_destroy(c);
  return through;
}

}  // namespace

// Context, world and bodies: what was refused is not there, and nothing is left of it.
TEST(RefusedMemory, InTheSetUp_EndsInAnErrorAndLeaksNothing) {
  int refused = 0;
  ASSERT_TRUE(set_up_without(INT64_MAX, refused));  // tables of the process have their size from then on
  bool through = false;
  for (int64_t n = 0; !through && n < 100000; n += n < 600 ? 1 : 7) {
    const int64_t live = Refusal::live;
    through = set_up_without(n, refused);
    EXPECT_EQ(Refusal::live, live) << "allocation " << n;
  }
  EXPECT_GT(refused, 100);
}
