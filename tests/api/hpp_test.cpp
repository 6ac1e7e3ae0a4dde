// deform.hpp: what ends what, errors in both ways, spans and their lengths, callables through the C API, no
// allocation of its own.
#include <algorithm>
#include <cmath>
#include <cstring>

#include <deform/deform.hpp>
#include <gtest/gtest.h>

#include "heap_calls.h"
#include "support.h"

namespace {

namespace values = deform::values;
using deform::Vec3;

deform::ContextDef quiet() {
  deform::ContextDef def;
  def.plugin_dir = DEFORM_PLUGIN_DIR;
  def.log = [](void *, int32_t, const char *) {};
  return def;
}

// A ball above a floor, in exceptions.
struct Scene {
  deform::Unique<deform::Context> context = deform::Context::make(quiet());
  deform::Unique<deform::World> world = context.make_world();
  deform::Body ball;
  deform::Obstacle floor;
  Scene() {
    deform::ObstacleDef plane;
    plane.name = "floor";
    floor = world.add_obstacle(plane);
    const auto mesh = context.make_tets("ball", {0.1}, 200);
    deform::BodyDef def;
    def.set_mesh(mesh);
    def.name = "ball";
    def.pose.position[2] = 0.1;
    ball = world.add_body(def);
  }
};

double no_farther(const dfm_query_hit &hit) { return hit.distance; }

// Handles of different things are of different types: neither converts, assigns or compares, but a rigid body
// is an obstacle.
template <class A, class B>
constexpr bool kMixed = std::is_convertible_v<A, B> || std::is_constructible_v<A, B> ||
                        std::is_assignable_v<A &, B> || requires(A a, B b) { a == b; };
static_assert(!kMixed<deform::Body, deform::World> && !kMixed<deform::Body, deform::Obstacle> &&
              !kMixed<deform::Obstacle, deform::Body>);
static_assert(!kMixed<deform::Law, deform::Material> && !kMixed<deform::Mesh, deform::World> &&
              !kMixed<deform::Scene, deform::World>);
static_assert(!kMixed<deform::Rigid, deform::Body> &&
              !std::is_convertible_v<deform::Obstacle, deform::Rigid>);
// A mesh that would end with the statement is not taken.
template <class M>
constexpr bool kTaken = requires(deform::BodyDef def, M mesh) { def.set_mesh(std::forward<M>(mesh)); };
static_assert(kTaken<const deform::Unique<deform::Mesh> &> && !kTaken<deform::Unique<deform::Mesh>>);
static_assert(std::is_convertible_v<deform::Rigid, deform::Obstacle> &&
              !std::is_convertible_v<uint64_t, deform::Body>);

}  // namespace

TEST(Hpp, Handles_EndWhatTheyOwnAndOnlyThat) {
  const auto context = deform::Context::make(quiet());
  dfm_world raw = 0;
  {
    auto world = context.make_world();
    raw = world.get();
    const deform::World view = world;  // a plain handle refers
    auto moved = std::move(world);
    EXPECT_FALSE(world) << "moved from";  // NOLINT
    EXPECT_EQ(moved, view);
    EXPECT_EQ(view.time(), 0.0);
  }
  EXPECT_TRUE(std::isnan(dfm_world_time(raw))) << "the world outlived its Unique";

  auto a = context.make_world(), b = context.make_world();
  const deform::World was_a = a, was_b = b;
  a = std::move(b);
  EXPECT_TRUE(std::isnan(was_a.time())) << "what was there before an assignment ends";
  EXPECT_EQ(was_b.time(), 0.0);
  const deform::World kept = a.release();
  EXPECT_FALSE(a);
  EXPECT_EQ(kept.time(), 0.0);
  kept.destroy();

  Scene s;
  {
    const deform::Unique<deform::Body> owner(s.ball);
    EXPECT_EQ(s.world.bodies().size(), 1u);
  }
  EXPECT_TRUE(s.world.bodies().empty());
  EXPECT_THROW((void)s.ball.info(), deform::Error) << "a stale handle answers";
}

TEST(Hpp, Errors_CarryStatusAndSentenceInBothWays) {
  const Scene s;
  const char *named = "flor";
  try {
    s.world.add_friction("ball", named, "coulomb");
    FAIL() << "no exception";
  } catch (const deform::Error &e) {
    EXPECT_EQ(e.status(), DFM_E_ARG);
    EXPECT_NE(std::string(e.what()).find("floor"), std::string::npos) << "the nearest name: " << e.what();
  }
  const auto r = values::World(s.world.get()).add_friction("ball", named, "coulomb");
  EXPECT_FALSE(r);
  EXPECT_EQ(r.status(), DFM_E_ARG);
  EXPECT_NE(std::string(r.what()).find("floor"), std::string::npos) << r.what();

  const auto good =
      values::World(s.world.get())
          .add_friction("ball", "floor", "coulomb", deform::Params({{"mu_C", 0.2}, {"mu_S", 0.3}}));
  EXPECT_TRUE(good) << good.what();
  EXPECT_STREQ(good.what(), "");
  const auto body = values::World(s.world.get()).find_body("nobody");
  EXPECT_FALSE(body);
  EXPECT_FALSE(*body) << "a failed call gives a handle that refers to nothing";
  const auto thrown = values::World(s.world.get()).add_friction("ball", "floor", "coulomb", {}, 2);
  EXPECT_EQ(thrown.status(), DFM_E_ARG) << "a restitution is at most 1";
}

TEST(Hpp, Files_AreReadAndWrittenWhole) {
  const std::string path = test::scratch("hpp") + "/file.txt";
  ASSERT_EQ(deform::write_file(path.c_str(), "text", 4), DFM_OK);
  std::string got;
  EXPECT_EQ(deform::read_file(path.c_str(), 4, "a text",
                              [&](const char *bytes, size_t n) { got.assign(bytes, n); }),
            DFM_OK);
  EXPECT_EQ(got, "text");
  EXPECT_EQ(deform::read_file(path.c_str(), 3, "a text", [&](const char *, size_t) { got = "called"; }),
            DFM_E_FORMAT);
  EXPECT_EQ(got, "text");
}

TEST(Hpp, Step_DistinguishesADiscardedStep) {
  const auto context = deform::Context::make(quiet());
  deform::WorldDef def;
  def.max_substeps = 1;
  const auto world = context.make_world(def);
  const auto mesh = context.make_tets("ball", {0.1}, 200);
  deform::BodyDef body;
  body.set_mesh(mesh);
  world.add_body(body);
  const double stable = world.stable_step().dt;
  EXPECT_TRUE(world.step(0.5 * stable));
  const double t = world.time();
  const deform::StepReport r = world.step(50 * stable);
  EXPECT_TRUE(r.discarded);
  EXPECT_FALSE(r);
  EXPECT_EQ(world.time(), t);
  const auto v = values::World(world.get()).step(50 * stable);
  EXPECT_TRUE(v && v->discarded) << "no error: nothing failed, the host may ask for less";
  EXPECT_EQ(v.status(), DFM_DISCARD);
  EXPECT_THROW((void)world.step(-1), deform::Error);
  uint32_t trouble = DFM_TROUBLE_OVERLAP;
  EXPECT_EQ(dfm_world_step(world.get(), -1, &trouble), DFM_E_ARG);
  EXPECT_EQ(trouble, 0u) << "nothing of the step before";
}

TEST(Hpp, ADiscardedChange_IsAnErrorInBothWays) {
  const Scene s;
  for (int i = 0; i < 20; ++i) ASSERT_TRUE(s.world.step(1e-3));
  const deform::Params none({{"max_jump", 1e-12}});
  const auto r = values::Body(s.ball.get()).set_model("corotational_fem", none);
  EXPECT_FALSE(r);
  EXPECT_EQ(r.status(), DFM_DISCARD);
  EXPECT_STRNE(r.what(), "");
  EXPECT_THROW(s.ball.set_model("corotational_fem", none), deform::Error);
  s.world.interrupt();
  EXPECT_THROW((void)s.world.equilibrium(), deform::Error);
}

TEST(Hpp, Spans_ReadAndWriteWhatTheCFunctionsDo) {
  const Scene s;
  for (int i = 0; i < 20; ++i) EXPECT_TRUE(s.world.step(1e-3));
  const auto info = s.ball.info();
  std::vector<double> x(3 * info.npoint), v(3 * info.npoint), c(3 * info.npoint);
  EXPECT_EQ(s.ball.state(x, v), info.npoint);
  uint32_t n = 0;
  ASSERT_EQ(dfm_body_get_state(s.ball.get(), info.npoint, c.data(), nullptr, &n), DFM_OK);
  EXPECT_EQ(x, c);
  EXPECT_EQ(s.ball.positions(), c);
  ASSERT_EQ(dfm_body_get_state(s.ball.get(), info.npoint, nullptr, c.data(), &n), DFM_OK);
  EXPECT_EQ(v, c);
  EXPECT_EQ(s.ball.velocities(), c);
  uint32_t few = 0;
  EXPECT_EQ(dfm_body_get_rest(s.ball.get(), info.npoint, c.data(), 0, &few), DFM_E_ARG);
  EXPECT_EQ(v, c) << "untouched";

  std::vector<double> surface(3 * info.nsurfel);
  EXPECT_EQ(s.ball.surface_positions(surface), info.nsurfel);
  EXPECT_EQ(s.ball.surface_positions(), surface);
  EXPECT_EQ(s.ball.surface_triangles().size(), 3 * info.ntriangle);
  EXPECT_THROW((void)s.ball.surface_positions(std::span(surface).first(3)), deform::Error) << "too short";
  EXPECT_EQ(s.world.contacts().size(), s.world.stats().contacts);
  EXPECT_GT(s.world.contacts().size(), 0u);
  for (const dfm_contact &contact : s.world.contacts()) {
    EXPECT_EQ(deform::Body(contact.body_a), s.ball);
    EXPECT_EQ(deform::handle_kind(contact.body_a), uint32_t{DFM_HANDLE_BODY});
    EXPECT_EQ(s.world.obstacles()[contact.feature_b], s.floor);
    EXPECT_STREQ(s.world.law_info(contact.law).id, "org.deform.coulomb");
  }
  EXPECT_THROW((void)s.world.law_info(4711), deform::Error);

  // Lengths that disagree never reach the C function.
  const uint32_t points[2] = {0, 1};
  const double force[6] = {0, 0, 1, 0, 0, 1};
  EXPECT_THROW((void)s.ball.add_load(points, std::span(force).first(5)), deform::Error);
  EXPECT_THROW(s.ball.set_state(x, std::span(v).first(v.size() - 3)), deform::Error);
  std::vector<double> stress(6 * size_t(s.ball.info().npoint));
  EXPECT_EQ(values::Body(s.ball.get()).point_stress(stress).status(), DFM_E_UNSUPPORTED) << "of msm";
  ASSERT_EQ(dfm_body_set_model(s.ball.get(), "corotational_fem", nullptr), DFM_OK);
  s.ball.point_stress(stress);
  EXPECT_GT(*std::max_element(stress.begin(), stress.end()), 0);
  EXPECT_THROW(s.ball.point_stress(std::span(stress).first(6)), deform::Error);
  const auto refused = values::Body(s.ball.get()).set_state(x, std::span(v).first(3));
  EXPECT_EQ(refused.status(), deform::spans_disagree);
  EXPECT_NE(std::string(refused.what()).find("length"), std::string::npos);
  EXPECT_STREQ(deform::status_name(refused.status()), "spans_disagree");
  const uint32_t load = s.ball.add_load(points, force);
  s.ball.remove_load(load);
  EXPECT_THROW(s.ball.remove_load(load), deform::Error);
  deform::QueryShape from;
  from.shape = DFM_SHAPE_POINT;
  from.pose.position[0] = 0.003;
  from.pose.position[1] = 0.002;
  from.pose.position[2] = 1;
  const Vec3 down{0, 0, -1};
  EXPECT_EQ(s.world.query_first(from, down, 10).thing, s.ball.get());
  from.flags = DFM_QUERY_EACH;
  const std::vector<dfm_query_hit> all = s.world.query(from, down, 10);
  ASSERT_EQ(all.size(), 3u) << "the ball twice, and the floor";
  dfm_query_hit two[2];
  EXPECT_EQ(s.world.query(from, down, 10, two), 2u);
  EXPECT_EQ(two[1].distance, all[1].distance);
  std::vector<uint64_t> things;
  s.world.query(from, down, 10, nullptr, [&](const dfm_query_hit &h) {
    things.push_back(h.thing);
    return things.size() < 3 ? INFINITY : -1;
  });
  EXPECT_EQ(things, (std::vector<uint64_t>{s.ball.get(), s.ball.get(), s.floor.get()}));
  const auto nowhere = [](const dfm_query_hit &) { return -1.0; };
  s.world.query(from, down, 10, nullptr, nowhere);
  s.world.query(from, down, 10, nullptr, no_farther);
  EXPECT_THROW(s.world.query(from, down, 10, nullptr, [](const dfm_query_hit &) -> double { throw 7; }), int);
  int requested = 0;
  deform::QueryFilter filter;
  filter.user = &requested;
  filter.accept = [](void *user, uint64_t) { return ++*static_cast<int *>(user) > 0; };
  const std::vector<dfm_query_hit> again = s.world.query(from, down, 10, &filter);
  EXPECT_EQ(requested, 2);
  ASSERT_EQ(again.size(), all.size());
  for (size_t i = 0; i < all.size(); ++i) {
    EXPECT_EQ(again[i].distance, all[i].distance);
    EXPECT_EQ(again[i].reserved, 0u);
  }
  const dfm_query_hit none = s.world.query_first(from, Vec3{0, 0, 1}, 10);
  EXPECT_EQ(none.thing, 0u);
  EXPECT_TRUE(std::isinf(none.distance));
  EXPECT_EQ(none.triangle, UINT32_MAX);
  EXPECT_EQ(s.world.query(deform::QueryShape(), {}, 0.01).size(), 2u) << "near the floor's origin";

  s.world.add_friction("ball", "floor", "coulomb", deform::Params({{"mu", 0.2}}));
  s.world.set_friction("floor", "ball", deform::Params({{"mu", 0.3}}));
  s.world.remove_friction("ball", "floor");
  EXPECT_THROW(s.world.remove_friction("ball", "floor"), deform::Error);
  s.world.filter_pair("ball", "floor", false);
  s.world.remove_filter("floor", "ball");
  EXPECT_THROW(s.world.remove_filter("floor", "ball"), deform::Error);
}

TEST(Hpp, Stream_GivesPackets) {
  const Scene s;
  deform::StreamDef def;
  def.kind = DFM_STREAM_SCENE;
  const auto scene = s.world.stream(def), frame = s.world.stream();
  EXPECT_EQ(std::memcmp(scene.data(), "DFMS", 4), 0);
  EXPECT_EQ(std::memcmp(frame.data(), "DFMS", 4), 0);
  EXPECT_EQ(frame[5], std::byte{DFM_STREAM_FRAME});
  def.kind = 9;
  EXPECT_THROW((void)s.world.stream(def), deform::Error);
}

TEST(Hpp, Snapshot_RestoresTheSameBits) {
  const Scene s;
  EXPECT_TRUE(s.world.step(1e-3));
  const auto saved = s.world.snapshot();
  const uint64_t hash = s.world.hash();
  EXPECT_EQ(s.world.snapshot(std::span<std::byte>()), saved.size());
  EXPECT_TRUE(s.world.step(1e-3));
  EXPECT_NE(s.world.hash(), hash);
  s.world.restore(saved);
  EXPECT_EQ(s.world.hash(), hash);
  EXPECT_EQ(s.world.explain().front(), '{');
  EXPECT_EQ(s.world.explain().back(), '}') << "without the NUL";
}

TEST(Hpp, Callables_AreCalledAndWhatTheyThrowArrives) {
  const Scene s;
  uint32_t laws = 0, lines = 0;
  s.context.visit_plugins(
      [&](const dfm_type &type, const char *file) { laws += type.kind == DFM_KIND_FRICTION && *file; });
  EXPECT_GE(laws, 3u);
  for (int i = 0; i < 20; ++i) EXPECT_TRUE(s.world.step(1e-3));
  s.world.draw(DFM_DRAW_CONTACTS, [&](deform::In3 a, deform::In3 b, uint32_t) { lines += a[2] != b[2]; });
  EXPECT_GT(lines, 0u);
  uint32_t calls = 0;
  const auto throws = [&](const dfm_type &, const char *) {
    ++calls;
    throw std::runtime_error("enough");
  };
  EXPECT_THROW(s.context.visit_plugins(throws), std::runtime_error);
  EXPECT_EQ(calls, 1u) << "after the first exception the rest passes by";
}

TEST(Hpp, Meshes_LendTheirArrays) {
  const auto context = deform::Context::make(quiet());
  const auto surface = context.make_surface("ball", {0.1}, 400);
  const auto shape = surface.data();
  EXPECT_EQ(shape.faces.size(), 3 * surface.info().ntriangle);
  EXPECT_TRUE(shape.tets.empty());
  const auto filled = surface.fill(800);
  EXPECT_NE(filled.info().share, nullptr) << "a filled mesh tells how much of each cell is material";
  const auto made = context.make_tets("beam", {0.1, 0.1, 0.4}, 100);
  EXPECT_EQ(made.info().share, nullptr);
  EXPECT_EQ(made.data().tets.size(), 4 * made.info().ntet);
  deform::BodyDef def;
  def.set_mesh(filled);
  EXPECT_EQ(def.cell_share, filled.info().share);
  EXPECT_EQ(def.npoint, filled.info().npoint);
  const auto lattice = surface.lattice(30);
  deform::BodyDef of_lattice;
  of_lattice.set_mesh(lattice);
  EXPECT_NE(of_lattice.cell_inside, nullptr);
  EXPECT_EQ(of_lattice.cell_share, nullptr);
  const auto again = context.make_surface(shape.points, shape.faces);
  EXPECT_EQ(again.info().ntriangle, surface.info().ntriangle);
  EXPECT_THROW((void)context.make_tets("bal", {0.1}, 100), deform::Error);
  const auto read = context.load_mesh(std::string(DEFORM_SOURCE_DIR) + "/tests/data/surfaces/cube_obj.obj");
  EXPECT_EQ(read.info().ntet, 0u);
  EXPECT_EQ(read.info().ntriangle, 12u);
  EXPECT_THROW((void)read.second_order(), deform::Error);
  EXPECT_EQ(made.second_order().info().ntet, 8 * made.info().ntet);
}

TEST(Hpp, Switches_BeginWithTheLibrarysDefaults) {
  const Scene s;
  deform::Switch to;
  EXPECT_EQ(to.size, sizeof(dfm_switch));
  EXPECT_EQ(to.integrator, DFM_INTEGRATOR_AUTO);
  to.type = "corotational_fem";
  const dfm_switch list[] = {to};
  s.ball.set_switches(list);
  deform::SwitchRule rule;
  rule.otherwise.type = "msm";
  EXPECT_THROW(s.ball.set_switch_rule(rule), deform::Error) << "one model alone";
  s.ball.set_switches({});
}

TEST(Hpp, RigidBodies_GoByTheirSet) {
  const Scene s;
  deform::RigidDef box;
  box.name = "box";
  box.shape = DFM_SHAPE_BOX;
  box.mass = 1;
  box.pose.position[2] = 1;
  box.half_size[0] = box.half_size[1] = box.half_size[2] = 0.05;
  const deform::Rigid rigid = s.world.add_rigid(box);
  EXPECT_EQ(rigid.state().position[2], 1);
  EXPECT_TRUE(s.world.step(1e-3));
  EXPECT_LT(rigid.state().velocity[2], 0);
  EXPECT_EQ(s.world.find_rigid("box"), rigid);
  EXPECT_EQ(s.world.find_obstacle("box"), deform::Obstacle(rigid));
  const deform::Obstacle as_obstacle = rigid;
  EXPECT_EQ(as_obstacle.pose().position[2], rigid.state().position[2]);
  EXPECT_EQ(s.world.pair_wrench(s.ball, as_obstacle, Vec3{}).force, Vec3{});
  auto set = deform::sized<dfm_rigid_set_def>();
  dfm_rigid_def two[2] = {box, box};
  two[0].name = "a";
  two[1].name = "b";
  two[1].pose.position[0] = 1;
  set.nbody = 2;
  set.bodies = two;
  dfm_rigid out[2];
  EXPECT_THROW(s.world.add_rigids(set, std::span(out).first(1)), deform::Error) << "room for one of two";
  s.world.add_rigids(set, out);
  EXPECT_EQ(s.world.rigids().size(), 3u);
  dfm_rigid_state states[3];
  dfm_rigid ids[3];
  EXPECT_THROW(s.world.rigid_states(states, std::span(ids).first(2)), deform::Error)
      << "a name for two of three";
  EXPECT_EQ(s.world.rigid_states(states, ids), 3u);
  EXPECT_EQ(ids[2], out[1]);
  EXPECT_EQ(states[2].position[0], 1);
  deform::Rigid(out[1]).destroy();
  EXPECT_EQ(s.world.rigids().size(), 1u);
}

TEST(Hpp, Tools_PressAndFeel) {
  const Scene s;
  deform::ToolDef def;
  def.name = "probe";
  def.radius = 0.02;
  def.pose.position[2] = 0.221;
  const deform::Tool tool = s.world.add_tool(def);
  EXPECT_EQ(s.world.find_tool("probe"), tool);
  ASSERT_EQ(s.world.tools().size(), 1u);
  for (int i = 1; i <= 100; ++i) {
    tool.set_pose({{0, 0, 0.221 - 2e-4 * i}, {0, 0, 0, 1}});
    EXPECT_TRUE(s.world.step(1e-3));
  }
  EXPECT_GT(tool.force().force[2], 0.01) << "the ball pushes back";
  EXPECT_NEAR(tool.feedback().force[2], tool.force().force[2], 1e-9);
  EXPECT_NEAR(tool.state().pose.position[2], 0.201, 1e-12);
  ASSERT_EQ(tool.parts().size(), 1u);
  uint32_t number = 0;
  EXPECT_EQ(tool.grab(s.ball.get(), std::span(&number, 1)), 1u);
  s.ball.detach(number);
  EXPECT_THROW(tool.set_opening(0.1), deform::Error) << "a ball has no jaws";
  tool.destroy();
  EXPECT_TRUE(s.world.tools().empty());
}

TEST(Hpp, Cuts_AreMadeAtOnceOrPlanned) {
  const Scene s;
  deform::CutDef plane;
  plane.shape = DFM_CUT_PLANE;
  plane.how = DFM_CUT_SPLIT;
  plane.blade[3] = 1;
  s.ball.set_separate(deform::SeparateDef());
  s.ball.plan_cut(1e-3, plane);
  EXPECT_TRUE(s.ball.pieces().empty());
  EXPECT_TRUE(s.world.step(1e-3));
  EXPECT_GE(s.ball.pieces().size(), 1u);
  s.ball.set_cut_delay(0.01);
  EXPECT_EQ(s.ball.cut_delay(), 0.01);
  EXPECT_EQ(s.ball.waiting_faces(), 0u);
  deform::ToolDef knife;
  knife.name = "knife";
  knife.shape = DFM_TOOL_BLADE;
  knife.half_size[0] = knife.half_size[1] = knife.half_size[2] = 0.01;
  knife.pose.position[2] = 1;
  const deform::Tool tool = s.world.add_tool(knife);
  const dfm_body bodies[] = {s.ball.get()};
  tool.set_cuts(DFM_CUT_SPLIT, bodies, 7);
  uint32_t how = 0, most = 0;
  EXPECT_EQ(tool.cuts(&how, &most).front(), s.ball.get()) << "its pieces follow";
  EXPECT_EQ(how, uint32_t{DFM_CUT_SPLIT});
  EXPECT_EQ(most, 7u);
  s.ball.plan_cut(2e-3, plane);
  s.ball.plan_no_cuts();
  EXPECT_THROW(s.ball.plan_cut(0, plane), deform::Error) << "it is past";
  EXPECT_GE(s.ball.cut(plane).parts, 1u);
}

TEST(Hpp, SceneAndLaw_ReturnTheSameAsInC) {
  const auto context = deform::Context::make(quiet());
  const std::string path = DEFORM_SOURCE_DIR "/examples/scenes/slope_block.json";
  const auto scene = context.open_scene(path);
  EXPECT_GT(scene.settings().duration, 0);
  EXPECT_EQ(scene.value("/version"), "1");
  EXPECT_EQ(scene.world().find_body("block").info().world, scene.world().get());
  const auto law = context.open_law("karnopp");
  const deform::Params given({{"mu", 0.25}});
  const std::vector<double> packed = law.pack(given);
  EXPECT_EQ(packed.front(), 0.25);
  const double fn = 2, area = 1e-4, vt[2] = {1, 0}, stop[2] = {-100, 0};
  double ft[2] = {};
  auto in = deform::sized<dfm_friction_in>();
  in.n = in.stride = 1;
  in.dt = 1e-3;
  in.params = packed.data();
  in.fn = &fn;
  in.vt = vt;
  in.ft_stop = stop;
  in.area = &area;
  auto out = deform::sized<dfm_friction_out>();
  out.ft = ft;
  EXPECT_TRUE(law.eval(in, out));
  EXPECT_NEAR(ft[0], -0.5, 1e-12);
  const dfm_motion p = {{0, 0, 1}, {0, 0, -1}};
  const dfm_motion tri[3] = {{{-1, -1, 0}, {-1, -1, 0}}, {{1, -1, 0}, {1, -1, 0}}, {{0, 1, 0}, {0, 1, 0}}};
  EXPECT_NEAR(deform::Toi::point_triangle(p, tri).t, 0.5, 1e-9);
  EXPECT_GT(deform::Toi::evaluations(), 0u);
}

TEST(Hpp, Calls_AllocateNothing) {
  const Scene s;
  for (int i = 0; i < 50; ++i) EXPECT_TRUE(s.world.step(1e-3));
  const auto info = s.ball.info();
  std::vector<double> x(3 * info.npoint), v(3 * info.npoint), surface(3 * info.nsurfel);
  std::vector<dfm_contact> contacts(4096);
  uint32_t n = 0;
  deform::QueryShape above;
  above.shape = DFM_SHAPE_POINT;
  above.pose.position[2] = 1;
  const uint64_t before = test::heap_calls;
  for (int i = 0; i < 20; ++i) {
    n += s.world.step(1e-3).trouble;
    n += s.ball.state(x, v) + s.ball.surface_positions(surface) + s.world.contacts(contacts);
    n += s.ball.measure().size + s.world.stats().size;
    n += values::World(s.world.get()).query_first(above, Vec3{0, 0, -1}, 10)->triangle;
    s.ball.apply_impulse(Vec3{0, 0, 0.1}, Vec3{0, 0, 1e-6});
    const deform::Unique<deform::Body> nothing;
  }
  EXPECT_EQ(test::heap_calls, before);
  EXPECT_GT(n, 0u);
}

TEST(Hpp, EmptySpansWithRoomBehindThem_AreNotWritten) {
  Scene s;
  std::vector<double> x, v(3 * s.ball.info().npoint);
  x.reserve(8);
  x.push_back(7);
  const double *const at = x.data();
  x.clear();
  s.ball.state(x, v);
  EXPECT_EQ(*at, 7);
  x.assign(v.size(), 0);
  s.ball.set_state({}, v);
  s.ball.state(x, {});
  EXPECT_GT(*std::max_element(x.begin(), x.end()), 0.1);
}

TEST(Hpp, ADefThatTakesAnotherMesh_KeepsNothingOfTheFirst) {
  deform::BodyDef def;
  const double inside[27] = {};
  const uint32_t brick[8] = {};
  def.cell = DFM_CELL_HEX8;
  def.cells = brick;
  def.cell_inside = def.cell_share = inside;
  const std::vector<double> points(12);
  const std::vector<uint32_t> tets = {0, 1, 2, 3};
  def.set_mesh(points, tets);
  EXPECT_EQ(def.cells, nullptr);
  EXPECT_EQ(def.cell_inside, nullptr);
  EXPECT_EQ(def.cell_share, nullptr);
  EXPECT_EQ(def.cell, dfm_body_def_default().cell);
}
