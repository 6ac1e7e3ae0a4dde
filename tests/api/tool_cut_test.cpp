// Tools that cut what they pass through: blades, scissors, solids; limits, events, snapshots, the key "cuts".
#include <unistd.h>

#include <set>

#include "cut_scenes.h"
#include "deform/tool.h"
#include "opened.h"
#include "rigid.h"
#include "support.h"

namespace {

using test::cutting::parts;

using Cube = test::cutting::CubeAtRest;

dfm_tool make(dfm_world w, uint32_t shape, std::array<double, 3> half, std::array<double, 3> at,
              double radius = 0) {
  dfm_tool_def d = dfm_tool_def_default();
  d.name = "tool";
  d.shape = shape;
  d.radius = radius;
  for (size_t k = 0; k < 3; ++k) {
    d.half_size[k] = half[k];
    d.pose.position[k] = at[k];
  }
  dfm_tool t = 0;
  test::ok(dfm_tool_create(w, &d, &t));
  return t;
}
dfm_tool blade(dfm_world w, double x = 0.001) {
  return make(w, DFM_TOOL_BLADE, {0.0005, 0.03, 0.02}, {x, 0, 0.05});
}
void cuts(dfm_tool t, uint32_t how, dfm_body b, uint32_t most = 0) {
  test::ok(dfm_tool_set_cuts(t, how, most, 1, &b));
}
void move(dfm_world w, dfm_tool t, std::array<double, 3> from, std::array<double, 3> to, int n) {
  for (int i = 1; i <= n; ++i) {
    dfm_pose p{{0, 0, 0}, {0, 0, 0, 1}};
    for (size_t k = 0; k < 3; ++k) p.position[k] = from[k] + (to[k] - from[k]) * i / n;
    test::ok(dfm_tool_set_pose(t, &p, nullptr));
    uint32_t trouble = 0;
    test::ok(dfm_world_step(w, 1e-3, &trouble));
  }
}
uint32_t cells(dfm_body b) { return test::cutting::info(b).ntet; }
// Sum of the keys of the cut events since the last call, and the largest one.
struct CutEvents { uint64_t sum = 0, most = 0, n = 0; };
CutEvents cut_events(dfm_world w, dfm_body b, dfm_tool t) {
  dfm_rigid list[3] = {};
  uint32_t n = 0;
  test::ok(dfm_tool_parts(t, 3, list, &n));
  const std::set<uint64_t> of_tool(list, list + n);
  CutEvents out;
  for (const dfm_contact_event &e : test::listed(dfm_world_events, w)) {
    if (e.kind != uint32_t{DFM_EVENT_CUT}) continue;
    EXPECT_EQ(e.a, b);
    EXPECT_TRUE(of_tool.count(e.b));
    out.sum += e.key;
    out.most = std::max(out.most, e.key);
    ++out.n;
  }
  return out;
}
double force_on(dfm_tool t) {
  double f[3], m[3];
  test::ok(dfm_tool_force(t, f, m));
  return std::hypot(f[0], f[1], f[2]);
}

const char *const kModels[] = {"msm", "corotational_fem"};

}  // namespace

TEST(ToolCut, BladeThroughACube_PartsIt_WithoutMassMomentumOrForce) {
  for (const char *model : kModels) {
    Cube s(model);
    const dfm_tool t = blade(s.w);
    cuts(t, DFM_CUT_SPLIT, s.body);
    const dfm_body_measure before = test::measure(s.body);
    const uint32_t before_cells = cells(s.body);
    move(s.w, t, {0.001, 0, 0.05}, {0.001, 0, 0.015}, 20);
    EXPECT_GT(cut_events(s.w, s.body, t).n, 1u) << "a cut grows from step to step";
    EXPECT_EQ(parts(s.body), 1u) << "half way";
    move(s.w, t, {0.001, 0, 0.015}, {0.001, 0, -0.01}, 20);
    EXPECT_EQ(parts(s.body), 2u) << model;
    EXPECT_EQ(cells(s.body), before_cells);
    EXPECT_EQ(force_on(t), 0);
    const dfm_body_measure after = test::measure(s.body);
    EXPECT_NEAR(after.mass, before.mass, 1e-15);
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(after.momentum[k], 0, 1e-15);
    EXPECT_NEAR(after.com[0], before.com[0], 1e-12);
  }
}

// Faces beyond the limit are cut in the steps that follow.
TEST(ToolCut, Limit_HoldsInEachStep_AndNothingIsForgotten) {
  Cube whole, s;
  const dfm_tool free = blade(whole.w), t = blade(s.w);
  cuts(free, DFM_CUT_SPLIT, whole.body);
  cuts(t, DFM_CUT_SPLIT, s.body, 5);
  move(whole.w, free, {0.001, 0, 0.05}, {0.001, 0, -0.01}, 60);
  move(s.w, t, {0.001, 0, 0.05}, {0.001, 0, -0.01}, 60);
  const CutEvents all = cut_events(whole.w, whole.body, free), some = cut_events(s.w, s.body, t);
  EXPECT_GT(all.most, 5u);
  EXPECT_LE(some.most, 5u);
  EXPECT_EQ(some.sum, all.sum);
  EXPECT_EQ(parts(s.body), 2u);
}

// Its flat side is no edge: a blade that stands, goes sideways or is drawn back leaves what it is in whole.
TEST(ToolCut, BladeThatDoesNotGoForward_CutsNothing) {
  Cube s;
  const dfm_tool t = blade(s.w);
  const dfm_pose inside{{0.001, 0, 0.02}, {0, 0, 0, 1}};
  test::ok(dfm_tool_teleport(t, &inside));
  cuts(t, DFM_CUT_SPLIT, s.body);
  move(s.w, t, {0.001, 0, 0.02}, {0.001, 0, 0.02}, 5);
  move(s.w, t, {0.001, 0, 0.02}, {-0.015, 0, 0.02}, 20);
  move(s.w, t, {-0.015, 0, 0.02}, {-0.015, 0, 0.06}, 20);
  EXPECT_EQ(cut_events(s.w, s.body, t).n, 0u);
  EXPECT_TRUE(test::contacts(s.w).empty()) << "the two do not touch";
}

// Seen from the cells, it is the body that stands and the blade that moves.
TEST(ToolCut, BodyThatMovesIntoABlade_IsCut) {
  Cube s;
  const dfm_tool t = blade(s.w);
  cuts(t, DFM_CUT_SPLIT, s.body);
  test::set_velocity(s.body, {0, 0, 1});
  for (int k = 0; k < 70; ++k) test::ok(dfm_world_step(s.w, 1e-3, nullptr));
  EXPECT_EQ(parts(s.body), 2u);
}

TEST(ToolCut, Solids_TakeCellsAway_AsTheyGo) {
  const struct {
    uint32_t shape;
    std::array<double, 3> half;
    double radius;
  } solids[] = {{DFM_TOOL_SPHERE, {}, 0.008},
                {DFM_TOOL_CAPSULE, {}, 0.006},
                {DFM_TOOL_ELLIPSOID, {0.008, 0.006, 0.01}, 0},
                {DFM_TOOL_BOX, {0.006, 0.006, 0.006}, 0},
                {DFM_TOOL_BLADE, {0.001, 0.03, 0.02}, 0}};
  for (const auto &solid : solids) {
    Cube s;
    const dfm_tool t = make(s.w, solid.shape, solid.half, {0, 0, 0.06}, solid.radius);
    cuts(t, DFM_CUT_REMOVE, s.body, 40);
    const double before = test::measure(s.body).mass;
    const uint32_t whole = cells(s.body);
    move(s.w, t, {0, 0, 0.06}, {0, 0, 0}, 30);
    const CutEvents gone = cut_events(s.w, s.body, t);
    EXPECT_GT(gone.sum, 30u) << solid.shape;
    EXPECT_LE(gone.most, 40u);
    EXPECT_EQ(cells(s.body), whole - gone.sum);
    EXPECT_LT(test::measure(s.body).mass, before);
    EXPECT_EQ(force_on(t), 0) << solid.shape;
  }
}

TEST(ToolCut, EverythingRemoved_LeavesABodyThatIsANameOnly) {
  Cube s;
  const dfm_tool t = make(s.w, DFM_TOOL_SPHERE, {}, {0, 0, 0.2}, 0.1);
  cuts(t, DFM_CUT_REMOVE, s.body);
  move(s.w, t, {0, 0, 0.2}, {0, 0, 0}, 4);
  EXPECT_EQ(cells(s.body), 0u);
  move(s.w, t, {0, 0, 0}, {0, 0, 0.1}, 4);
}

TEST(ToolCut, Scissors_CutWhatTheyCloseOn) {
  Cube s;
  dfm_tool_def d = dfm_tool_def_default();
  d.name = "tool";
  d.shape = DFM_TOOL_SCISSORS;
  d.half_size[0] = 0.004;
  d.half_size[1] = 0.001;
  d.half_size[2] = 0.04;
  d.pose.position[1] = 0.001;
  d.pose.position[2] = 0.03;
  d.opening = 1.5;
  dfm_tool t = 0;
  test::ok(dfm_tool_create(s.w, &d, &t));
  cuts(t, DFM_CUT_SPLIT, s.body);
  for (int i = 1; i <= 60; ++i) {
    test::ok(dfm_tool_set_opening(t, 1.5 * (1 - i / 60.0)));
    test::ok(dfm_world_step(s.w, 1e-3, nullptr));
    if (i == 20) {
      EXPECT_EQ(parts(s.body), 1u);
    }
  }
  EXPECT_EQ(parts(s.body), 2u);
  cut_events(s.w, s.body, t);
  for (int i = 1; i <= 60; ++i) {
    test::ok(dfm_tool_set_opening(t, 1.5 * i / 60.0));
    test::ok(dfm_world_step(s.w, 1e-3, nullptr));
  }
  EXPECT_EQ(cut_events(s.w, s.body, t).n, 0u) << "opening cuts nothing";
}

TEST(ToolCut, Snapshot_TakesBackACut_WhichThenGoesTheSameWay) {
  Cube s;
  const dfm_tool t = blade(s.w);
  cuts(t, DFM_CUT_SPLIT, s.body);
  move(s.w, t, {0.001, 0, 0.05}, {0.001, 0, 0.02}, 20);
  const std::string half = test::snapshot(s.w);
  move(s.w, t, {0.001, 0, 0.02}, {0.001, 0, -0.01}, 20);
  const std::string end = test::snapshot(s.w);
  ASSERT_EQ(parts(s.body), 2u);
  test::ok(dfm_world_restore(s.w, half.data(), half.size()));
  EXPECT_EQ(parts(s.body), 1u);
  move(s.w, t, {0.001, 0, 0.02}, {0.001, 0, -0.01}, 20);
  EXPECT_TRUE(test::snapshot(s.w) == end);
}

TEST(ToolCut, WhatIsSet_CanBeRead_AndTakenBack) {
  Cube s;
  const dfm_tool t = blade(s.w);
  uint32_t how = 9, most = 9, n = 9;
  test::ok(dfm_tool_cuts(t, &how, &most, 0, nullptr, &n));
  EXPECT_EQ(n, 0u);
  cuts(t, DFM_CUT_SPLIT, s.body, 7);
  dfm_body b = 0;
  test::ok(dfm_tool_cuts(t, &how, &most, 1, &b, &n));
  EXPECT_EQ(how, uint32_t{DFM_CUT_SPLIT});
  EXPECT_EQ(most, 7u);
  EXPECT_EQ(b, s.body);
  EXPECT_EQ(dfm_body_set_model(s.body, "modal", nullptr), DFM_E_UNSUPPORTED);
  test::says({"cube", "neither cut nor torn", "modal"});
  test::ok(dfm_tool_set_cuts(t, DFM_CUT_SPLIT, 0, 0, nullptr));
  move(s.w, t, {0.001, 0, 0.05}, {0.001, 0, 0.036}, 30);
  EXPECT_GT(force_on(t), 1e-3) << "a blade that cuts nothing presses";
  EXPECT_EQ(parts(s.body), 1u);
}

TEST(ToolCut, PiecesOfAPiece_AreCutToo_AndThoseOfAWholeThatIsDestroyed) {
  for (const bool whole : {false, true}) {
    SCOPED_TRACE(whole);
    Cube s;
    const dfm_separate_def rule = dfm_separate_def_default();
    test::ok(dfm_body_set_separate(s.body, &rule));
    dfm_body piece = 0, other = 0;
    test::cutting::cut(s.body, test::cutting::plane(1, 0.0001, DFM_CUT_SPLIT));
    test::ok(dfm_world_find_body(s.w, "cube.1", &piece));
    const double y = test::measure(piece).com[1] > 0 ? 0.015 : -0.015;  // beside the body
    const dfm_tool t = make(s.w, DFM_TOOL_BLADE, {0.0005, 0.008, 0.02}, {0.011, y, 0.05});
    cuts(t, DFM_CUT_SPLIT, whole ? s.body : piece);
    test::cutting::cut(piece, test::cutting::plane(2, 0.0001, DFM_CUT_SPLIT));
    test::ok(dfm_world_find_body(s.w, "cube.2", &other));
    if (whole) test::ok(dfm_body_destroy(s.body));
    dfm_body listed[4] = {};
    uint32_t n = 0;
    test::ok(dfm_tool_cuts(t, nullptr, nullptr, 4, listed, &n));
    EXPECT_EQ(std::count(listed, listed + n, other), 1);
    std::set<uint64_t> cut;
    for (int i = 0; i < 50; ++i) {
      move(s.w, t, {0.011, y, 0.05 - 0.001 * i}, {0.011, y, 0.049 - 0.001 * i}, 1);
      ASSERT_EQ(force_on(t), 0) << i;
      for (const dfm_contact_event &e : test::listed(dfm_world_events, s.w))
        if (e.kind == uint32_t{DFM_EVENT_CUT}) cut.insert(e.a);
    }
    EXPECT_TRUE(cut.count(piece) && cut.count(other));
  }
}

TEST(ToolCut, WhatCannotCut_IsRefused) {
  Cube s, modal("modal");
  const dfm_tool grasper = make(s.w, DFM_TOOL_GRASPER, {0.001, 0.002, 0.01}, {0, 0, 0.1});
  EXPECT_EQ(dfm_tool_set_cuts(grasper, DFM_CUT_REMOVE, 0, 1, &s.body), DFM_E_ARG);
  test::says({"tool", "grasper", "scissors"});
  test::ok(dfm_tool_destroy(grasper));
  const dfm_tool ball = make(s.w, DFM_TOOL_SPHERE, {}, {0, 0, 0.1}, 0.01);
  EXPECT_EQ(dfm_tool_set_cuts(ball, DFM_CUT_SPLIT, 0, 1, &s.body), DFM_E_ARG);
  test::says({"tool", "edge", "DFM_CUT_REMOVE"});
  EXPECT_EQ(dfm_tool_set_cuts(ball, 5, 0, 1, &s.body), DFM_E_ARG);
  EXPECT_EQ(dfm_tool_set_cuts(ball, DFM_CUT_REMOVE, 0, 1, nullptr), DFM_E_ARG);
  EXPECT_EQ(dfm_tool_set_cuts(ball, DFM_CUT_REMOVE, 0, 1, &modal.body), DFM_E_HANDLE);
  test::ok(dfm_tool_destroy(ball));
  const dfm_tool thick = make(s.w, DFM_TOOL_BLADE, {0.02, 0.001, 0.01}, {0, 0, 0.1});
  EXPECT_EQ(dfm_tool_set_cuts(thick, DFM_CUT_SPLIT, 0, 1, &s.body), DFM_E_ARG);
  test::says({"along y", "exchange"});
  const dfm_tool t = blade(modal.w);
  EXPECT_EQ(dfm_tool_set_cuts(t, DFM_CUT_SPLIT, 0, 1, &modal.body), DFM_E_UNSUPPORTED);
  test::says({"cube", "msm"});
}

namespace {

// By a quaternion x, y, z, w.
std::array<double, 3> turned(const double q[4], const double v[3]) {
  std::array<double, 3> t, out;
  for (size_t k = 0; k < 3; ++k) {
    const size_t i = (k + 1) % 3, j = (k + 2) % 3;
    t[k] = 2 * (q[i] * v[j] - q[j] * v[i]);
  }
  for (size_t k = 0; k < 3; ++k) {
    const size_t i = (k + 1) % 3, j = (k + 2) % 3;
    out[k] = v[k] + q[3] * t[k] + q[i] * t[j] - q[j] * t[i];
  }
  return out;
}

// Which points of the cube are held, by their places at rest.
using Held = bool (*)(const double *x);
bool none(const double *) { return false; }
bool all(const double *) { return true; }
bool sides(const double *x) { return x[0] < 1e-9 || x[0] > 0.04 - 1e-9; }

// A cube of a material that takes energy to be cut, and a blade above it.
struct Tough {
  static constexpr double kEnergy = 100, kArea = 0.04 * 0.04;  // J/m2, m2
  test::Context context;
  dfm_world w;
  dfm_body body = 0;
  dfm_tool t = 0;
  explicit Tough(double stiffness, Held held, const char *model = "corotational_fem",
                 uint32_t integrator = DFM_INTEGRATOR_SYMPLECTIC_EULER, double turn = 5)
      : w(test::make_world(context, {0, 0, 0}, integrator)) {
    body = test::cutting::make(context, w,
                               {.size = {0.04, 0.04, 0.04},
                                .cells = 320,
                                .energy = kEnergy,
                                .name = "cube",
                                .model = model,
                                .corner = -0.02,
                                .held = held});
    dfm_tool_def td = test::cutting::knife();
    td.stiffness = stiffness;
    td.turn_stiffness = stiffness > 0 ? turn : 0;
    td.damping = stiffness > 0 ? 2 : 0;
    td.turn_damping = stiffness > 0 ? 0.01 : 0;
    test::ok(dfm_tool_create(w, &td, &t));
    cuts(t, DFM_CUT_SPLIT, body);
  }
  dfm_tool_state state() const {
    dfm_tool_state s{};
    s.size = sizeof s;
    test::ok(dfm_tool_get_state(t, &s));
    return s;
  }
  // J, of force and torque on the tool over its way; N, largest force; N s and N m s about the world's
  // origin, that it has got.
  double work = 0, most = 0;
  std::array<double, 3> impulse{}, moment{};
  void down(double to, double speed, double dt = 1e-3) {
    for (double z = state().device.position[2]; z > to;) {
      z -= dt * speed;
      const dfm_tool_state before = state();
      const dfm_pose p{{0.001, 0, z}, {0, 0, 0, 1}};
      test::ok(dfm_tool_set_pose(t, &p, nullptr));
      test::ok(dfm_world_step(w, dt, nullptr));
      double f[3], m[3];
      test::ok(dfm_tool_force(t, f, m));
      const dfm_tool_state now = state();
      const double *const q = now.pose.rotation, *const at = now.pose.position;
      std::array<double, 3> way, force = turned(q, f), torque = turned(q, m);
      for (size_t k = 0; k < 3; ++k) way[k] = at[k] - before.pose.position[k];
      for (size_t k = 0; k < 3; ++k) {
        const size_t i = (k + 1) % 3, j = (k + 2) % 3;
        // about the origin as it stood before the step
        const double turn = torque[k] + way[i] * force[j] - way[j] * force[i];
        work -= force[k] * way[k] + turn * now.spin[k] * dt;
        impulse[k] += dt * force[k];
        moment[k] += dt * (torque[k] + at[i] * force[j] - at[j] * force[i]);
      }
      most = std::max(most, f[2]);
      EXPECT_GE(f[2], -1e-12) << "it holds back and never pulls";
    }
  }
  // The momentum of the body is the impulse of the tool.
  void same_momenta(double turning = 1e-12) const {
    const dfm_body_measure m = test::measure(body);
    for (size_t k = 0; k < 3; ++k) {
      const size_t i = (k + 1) % 3, j = (k + 2) % 3;
      EXPECT_NEAR(m.momentum[k], -impulse[k], 1e-12 * most * 0.01) << k;
      const double spin = m.angular[k] + m.com[i] * m.momentum[j] - m.com[j] * m.momentum[i];
      EXPECT_NEAR(spin, -moment[k], turning * most * 0.01 * 0.04) << k;
    }
  }
};

}  // namespace

// Nothing of the body gives way: the work of force and torque is that of the cut. Who holds the body gets the
// impulse.
TEST(ToolCut, DrivenBlade_FeelsTheEnergyOfTheCut) {
  for (const char *model : kModels) {
    Tough s(0, all, model);
    s.down(-0.03, 0.2);
    EXPECT_EQ(parts(s.body), 2u);
    const double cut = s.kEnergy * s.kArea;
    EXPECT_NEAR(s.work, cut, 1e-9 * cut) << model;
    EXPECT_NEAR(s.state().work, s.work, 1e-9 * s.work) << "who moves it has put it in";
    EXPECT_GT(s.most, s.kEnergy * 0.04);
    EXPECT_LT(s.most, 1.5 * s.kEnergy * 0.04) << "no impacts";
    const dfm_body_measure m = test::measure(s.body);
    for (size_t k = 0; k < 3; ++k) EXPECT_NEAR(m.contact_impulse[k], -s.impulse[k], 1e-12 * s.impulse[2]);
  }
}

// Eight others stand in the body, where each leaves a track of its own.
TEST(ToolCut, NinthEdgeInABody_PaysAsTheFirst) {
  Tough s(0, all);
  for (int k = 0; k < 8; ++k) {
    dfm_tool_def d = test::cutting::knife();
    const std::string name = "blade " + std::to_string(k);
    d.name = name.c_str();
    d.pose.position[0] = 0.002 * k - 0.015;
    d.pose.position[2] = 0;
    dfm_tool stands = 0;
    test::ok(dfm_tool_create(s.w, &d, &stands));
    cuts(stands, DFM_CUT_SPLIT, s.body);
  }
  s.down(-0.03, 0.2);
  EXPECT_NEAR(s.work, s.kEnergy * s.kArea, 1e-9 * s.kEnergy * s.kArea);
}

// The sides are held: the body bends under the blade, and the work beyond that of the cut goes into it.
// unsanitized: too slow there; shorter tests run the same code
TEST(ToolCut, DrivenBlade_BendsTheBody) {
  for (const char *model : kModels) {
    Tough s(0, sides, model);
    s.down(0.02, 0.2);
    double lowest = 0;
    const auto sag = [&] {
      const std::vector<double> x = test::cutting::State(s.body).x;
      for (size_t k = 2; k < x.size(); k += 3) lowest = std::min(lowest, x[k] + 0.02);
    };
    for (double z = 0.015; z > -0.045; z -= 0.005) {
      s.down(z, 0.2);
      sag();
    }
    EXPECT_EQ(parts(s.body), 2u);
    EXPECT_LT(lowest, -1e-3) << model << ": it sags by 0 without a force on the body";
    const double cut = s.kEnergy * s.kArea;
    EXPECT_NEAR(s.work, cut, 0.05 * cut) << model << ": of the cross-section as it is when it is cut";
  }
}

// The sides of the slit lie on each other under the drag, with friction: contacts that hold the same points
// more than once, whose slips no impulse takes away (doc/decisions/contact_solver.md).
// unsanitized: too slow there; shorter tests run the same code
TEST(ToolCut, SidesOfASlitUnderDrag_AreSolved_ImplicitSteps) {
  Tough s(0, sides, "corotational_fem", DFM_INTEGRATOR_IMPLICIT_EULER);
  s.down(0.015, 0.2);
  dfm_world_stats stats{};
  stats.size = sizeof stats;
  test::ok(dfm_world_get_stats(s.w, &stats));
  EXPECT_LT(double(stats.unconverged), 0.01 * double(stats.substeps));
}

// Nothing holds the cube, and its sides do not touch (doc/decisions/friction_memory.md says what that does
// to angular momentum): a slow blade takes it along, a fast one goes through and leaves it some momentum.
TEST(ToolCut, FreeBody_IsDraggedByTheBlade_AndMomentumIsKept) {
  for (const char *model : kModels) {
    Tough slow(0, none, model), fast(0, none, model);
    for (const dfm_world w : {slow.w, fast.w}) test::ok(dfm_world_filter_pair(w, "cube", "cube", false));
    slow.down(0, 0.2);
    EXPECT_EQ(parts(slow.body), 1u) << model;
    EXPECT_NEAR(test::measure(slow.body).velocity[2], -0.2, 0.1);
    slow.same_momenta();
    fast.down(-0.1, 5, 4e-4);
    EXPECT_EQ(parts(fast.body), 2u);
    fast.same_momenta();
    const dfm_body_measure m = test::measure(fast.body);
    const double cut = fast.kEnergy * fast.kArea;
    EXPECT_GT(fast.work, cut + m.kinetic);
    EXPECT_LT(fast.work, 1.1 * (cut + m.kinetic)) << "the rest is damping";
  }
}

// On a virtual coupling both give way.
// unsanitized: too slow there; shorter tests run the same code
TEST(ToolCut, CoupledBlade_PaysTheEnergyOfTheCut_AndIsHeldBack) {
  for (const uint32_t integrator : {DFM_INTEGRATOR_SYMPLECTIC_EULER, DFM_INTEGRATOR_IMPLICIT_EULER}) {
    Tough s(2000, all, "corotational_fem", integrator);
    s.down(0.0, 0.1);
    EXPECT_GT(s.state().pose.position[2] - s.state().device.position[2], 1e-3);
    EXPECT_LT(s.most, 1.5 * s.kEnergy * 0.04) << "no impacts";
    s.down(-0.4, 0.5);
    EXPECT_EQ(parts(s.body), 2u);
    const double cut = s.kEnergy * s.kArea;
    // turned a little, it sees another cross-section of a rough cut
    EXPECT_NEAR(s.work, cut, 1e-3 * cut);
    EXPECT_GT(s.state().work, s.work) << "the hand has paid for it";
    EXPECT_GT(s.state().port_work, 0);
    Tough straight(2000, all, "corotational_fem", integrator, 5e9);
    straight.down(0.0, 0.1);
    straight.down(-0.4, 0.5);
    // the limit of a drag follows from the velocity, 0.5 m/s, which a solve knows to its tolerance, 1e-6 m/s
    EXPECT_NEAR(straight.work, cut, 2e-6 * cut);
    Tough free(2000, none, "corotational_fem", integrator);
    test::ok(dfm_world_filter_pair(free.w, "cube", "cube", false));
    free.down(0.0, 0.1);
    // backward Euler takes angular momentum from what turns
    free.same_momenta(integrator == uint32_t{DFM_INTEGRATOR_SYMPLECTIC_EULER} ? 1e-12 : 1e-2);
  }
}

// A hand that is too weak for the rest of the cut leaves the blade where it is, without creep.
TEST(ToolCut, CoupledBlade_StandsWhereTheHandIsTooWeak) {
  Tough s(200, all);
  s.down(0.005, 0.1);
  for (int i = 0; i < 3000; ++i) test::ok(dfm_world_step(s.w, 1e-3, nullptr));  // it turns about its edge
  const double there = s.state().pose.position[2];
  EXPECT_GT(there - s.state().device.position[2], 1e-3) << "the spring pulls";
  for (int i = 0; i < 200; ++i) test::ok(dfm_world_step(s.w, 1e-3, nullptr));
  EXPECT_NEAR(s.state().pose.position[2], there, 1e-9);
  EXPECT_EQ(parts(s.body), 1u);
}

// The energy due is part of a snapshot.
// unsanitized: too slow there; shorter tests run the same code
TEST(ToolCut, SnapshotOfABladeThatOwes_GoesOnTheSameWay) {
  Tough s(0, sides);
  s.down(0.03, 0.2);
  const std::string half = test::snapshot(s.w);
  s.down(0.01, 0.2);
  const std::string end = test::snapshot(s.w);
  test::ok(dfm_world_restore(s.w, half.data(), half.size()));
  s.down(0.01, 0.2);
  EXPECT_TRUE(test::snapshot(s.w) == end);
}

// A tool that has gone, or cuts no more, owes nothing: the body rests.
TEST(ToolCut, BladeThatOwesAndStopsCutting_LetsTheBodySleep) {
  for (const bool destroyed : {true, false}) {
    Tough s(2000, all, "msm", DFM_INTEGRATOR_IMPLICIT_EULER);
    test::ok(dfm_world_filter_pair(s.w, "cube", "knife", false));
    test::ok(dfm_world_set_sleep(s.w, true));
    s.down(0.01, 0.1);
    test::run(s.w, 0.7, 1e-2);
    EXPECT_EQ(test::stats(s.w).asleep, 0u) << "the blade pulls at it";
    if (destroyed) test::ok(dfm_tool_destroy(s.t));
    else test::ok(dfm_tool_set_cuts(s.t, DFM_CUT_SPLIT, 0, 0, nullptr));
    test::run(s.w, 0.7, 1e-2);
    EXPECT_EQ(test::stats(s.w).asleep, 1u) << destroyed;
  }
}

// A step that is interrupted gives back what its sub-steps have paid of it.
TEST(ToolCut, InterruptedWhereABladePays_IsAsBeforeTheStep) {
  struct Stop {
    dfm_world world;
    int at, met = 0;
    static void pre_solve(void *user, dfm_contact_choice *) {
      Stop &s = *static_cast<Stop *>(user);
      if (s.met++ == s.at) test::ok(dfm_world_interrupt(s.world));
    }
  };
  Tough plain(0, sides), s(0, sides);
  for (Tough *const t : {&plain, &s}) {
    t->down(0.02, 0.2);
    const dfm_pose p{{0.001, 0, 0.0196}, {0, 0, 0, 1}};
    test::ok(dfm_tool_set_pose(t->t, &p, nullptr));
  }
  Stop none{plain.w, -1};
  test::ok(dfm_world_set_pre_solve(plain.w, &Stop::pre_solve, &none));
  test::ok(dfm_world_step(plain.w, 1e-3, nullptr));
  ASSERT_GT(test::stats(plain.w).last_substeps, 1u);
  Stop stop{s.w, none.met - 1};  // at the last contact of the step
  test::ok(dfm_world_set_pre_solve(s.w, &Stop::pre_solve, &stop));
  ASSERT_EQ(dfm_world_step(s.w, 1e-3, nullptr), DFM_DISCARD);
  test::ok(dfm_world_step(s.w, 1e-3, nullptr));
  EXPECT_EQ(dfm_world_hash(s.w), dfm_world_hash(plain.w));
}

// A load that overflows in the middle of a step ends it there, and the blade has moved on. A snapshot knows
// how far it has cut.
TEST(ToolCut, StepThatFailsHalfWay_LeavesNoBridge) {
  for (const uint32_t how : {DFM_CUT_SPLIT, DFM_CUT_REMOVE}) {
    Cube whole, s;
    uint32_t opened[2] = {};
    for (Cube *const c : {&whole, &s}) {
      const dfm_tool t =
          how == DFM_CUT_SPLIT ? blade(c->w) : make(c->w, DFM_TOOL_SPHERE, {}, {0.001, 0, 0.05}, 0.004);
      cuts(t, how, c->body);
      test::BodyOptions o;
      o.name = "far";
      o.position = {1, 0, 0};
      const dfm_body far = test::make_body(c->context, c->w, "beam", {0.04, 0.04, 0.04}, 60, o);
      move(c->w, t, {0.001, 0, 0.05}, {0.001, 0, 0.021}, 2);
      cut_events(c->w, c->body, t);  // which a snapshot does not keep
      const dfm_pose p{{0.001, 0, -0.03}, {0, 0, 0, 1}};
      test::ok(dfm_tool_set_pose(t, &p, nullptr));
      const double huge[3] = {0, 0, 1.7e308}, now = dfm_world_time(c->w);
      const dfm_scale_key grow[2] = {{now + 6e-4, 0}, {now + 7e-4, 1e20}};
      uint32_t load = 0, point = 4;
      if (c == &s) {
        test::ok(dfm_body_add_load(far, 1, &point, huge, 2, grow, nullptr, &load));
        const uint64_t before = test::stats(c->w).substeps;
        ASSERT_EQ(dfm_world_step(c->w, 1e-3, nullptr), DFM_E_DIVERGED);
        ASSERT_GT(dfm_world_time(c->w), now);
        EXPECT_EQ(test::stats(c->w).last_substeps, test::stats(c->w).substeps - before);
        test::ok(dfm_body_remove_load(far, load));
        const std::string kept = test::snapshot(c->w);
        test::ok(dfm_world_restore(c->w, kept.data(), kept.size()));
        EXPECT_TRUE(test::snapshot(c->w) == kept);
      }
      test::ok(dfm_world_step(c->w, now + 1e-3 - dfm_world_time(c->w), nullptr));
      opened[c == &s] = uint32_t(cut_events(c->w, c->body, t).sum);
    }
    EXPECT_GT(opened[0], 0u);
    EXPECT_EQ(opened[1], opened[0]) << how;
    EXPECT_EQ(parts(s.body), parts(whole.body)) << how;
  }
}

// ---- scenes ---------------------------------------------------------------------------------------------

namespace {

std::string folder() { return test::scratch("tool cut " + std::to_string(getpid())); }

std::string scene(const std::string &cuts,
                  const char *shape = R"("blade", "half_size": [0.0005, 0.03, 0.02])") {
  return R"({"format": "deform-scene", "version": 1, "gravity": [0, 0, 0],
    "time": {"duration": 0.06, "step": 0.001, "integrator": "symplectic_euler"},
    "materials": {"gel": {"young": 3e4, "damping": {"stiffness": 0.002}}},
    "bodies": [{"name": "cube", "mesh": {"make": "beam", "size": [0.04, 0.04, 0.04], "cells": 320},
      "material": "gel", "pose": {"position": [-0.02, -0.02, -0.02]}}],
    "tools": [{"name": "knife", "shape": )" +
         std::string(shape) + R"(, "cuts": )" + cuts + R"(, "pose": {"position": [0.001, 0, 0.05]},
      "motion": {"keyframes": [{"t": 0, "position": [0.001, 0, 0.05]},
                               {"t": 0.06, "position": [0.001, 0, -0.01]}]}}]})";
}

struct Opened : test::Opened {
  explicit Opened(const std::string &text) : test::Opened(test::written(folder() + "/scene.json", text)) {}
};

}  // namespace

TEST(ToolCutScene, BothForms_CutByTheKeysOfTheTool) {
  for (const char *form :
       {R"(["cube"])", R"({"bodies": ["cube"]})", R"({"bodies": ["cube"], "mode": "split", "most": 12})"}) {
    const Opened s(scene(form));
    ASSERT_EQ(s.status, DFM_OK) << dfm_last_error();
    test::run(s.world, 0.06, 1e-3);
    dfm_body cube = 0;
    test::ok(dfm_world_find_body(s.world, "cube", &cube));
    EXPECT_EQ(parts(cube), 2u) << form;
  }
  const Opened s(scene(R"({"bodies": ["cube"], "mode": "remove"})"));
  ASSERT_EQ(s.status, DFM_OK) << dfm_last_error();
  test::run(s.world, 0.06, 1e-3);
  dfm_body cube = 0;
  test::ok(dfm_world_find_body(s.world, "cube", &cube));
  EXPECT_LT(cells(cube), 300u);
}

TEST(ToolCutScene, WhatIsWrong_IsNamed) {
  const auto refused = [](const std::string &text, std::initializer_list<const char *> words) {
    const Opened s(text);
    EXPECT_LT(s.status, 0) << text;
    test::says(words);
  };
  refused(scene(R"(["cub"])"), {"/tools/0/cuts/0", "cube"});
  refused(scene("[]"), {"/tools/0/cuts", "at least one body"});
  refused(scene(R"({"mode": "split"})"), {"/tools/0/cuts", "bodies"});
  refused(scene(R"({"bodies": ["cube"], "mode": "spilt"})"), {"/tools/0/cuts/mode", "split"});
  refused(scene(R"({"bodies": ["cube"], "limit": 3})"), {"/tools/0/cuts/limit", "most"});
  refused(scene(R"({"bodies": ["cube"], "most": -1})"), {"/tools/0/cuts/most"});
  refused(scene(R"(["cube"])", R"("grasper", "half_size": [0.001, 0.002, 0.01])"),
          {"/tools/0/cuts", "grasper"});
  refused(scene(R"({"bodies": ["cube"], "mode": "split"})", R"("sphere", "radius": 0.01)"),
          {"/tools/0/cuts", "edge"});
}

// Recorded and replayed, and continued from a saved state in the middle of the cut: the same bits.
// unsanitized: too slow there; shorter tests run the same code
TEST(ToolCutScene, RunThatCuts_IsReplayedAndContinuedToTheBit) {
  const std::string dir = folder(), path = dir + "/a scene.json";
  test::write_file(path, scene(R"({"bodies": ["cube"], "most": 12})"));
  const auto run = [&](std::vector<std::string> words) {
    const test::CommandResult r = test::deform(words);
    EXPECT_EQ(r.exit_code, 0) << r.err;
  };
  const auto hash = [&](const std::string &out) {
    const std::string text = test::read_file(out + "/summary.json");
    const size_t at = text.find("\"state_hash\"");
    EXPECT_NE(at, std::string::npos);
    return text.substr(at, 36);
  };
  run({"run", path, "--out", dir + "/whole", "--quiet", "--record", "--save", "0.03", dir + "/half.state"});
  run({"run", path, "--out", dir + "/rest", "--quiet", "--from", dir + "/half.state"});
  EXPECT_EQ(hash(dir + "/whole"), hash(dir + "/rest"));
  run({"replay", dir + "/whole", "--quiet"});
  run({"replay", dir + "/whole", "--quiet", "--states", "--out", dir + "/pictures"});
}
