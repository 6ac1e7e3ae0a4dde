// Cuts that are made beside the steps (dfm_body_set_cut_delay): when faces open, and that nothing else
// depends on who makes the cut, and when.
#include <atomic>
#include <cstdlib>
#include <thread>

#include "cut_scenes.h"
#include "deform/tool.h"
#include "rigid.h"
#include "support.h"

namespace {

constexpr double kStep = 1e-3;

// Memory of a context that is refused: to all threads but the one that steps, or to all.
struct Refusing {
  enum { none, beside, all };
  std::atomic<int> to{none};
  std::atomic<uint64_t> refused{0}, largest{0};  // largest: bytes that were given at a time
  const std::thread::id steps = std::this_thread::get_id();
  dfm_context *c = nullptr;
  Refusing() {
    dfm_context_def def = dfm_context_def_default();
    def.user = this;
    def.plugin_dir = DEFORM_PLUGIN_DIR;
    def.log = [](void *, int32_t, const char *) {};
    def.alloc = [](void *user, size_t bytes, size_t align) -> void * {
      Refusing &r = *static_cast<Refusing *>(user);
      if (r.to == all || (r.to == beside && std::this_thread::get_id() != r.steps)) {
        ++r.refused;
        return nullptr;
      }
      for (uint64_t most = r.largest; bytes > most && !r.largest.compare_exchange_weak(most, bytes);) {}
      return std::aligned_alloc(align, (bytes + align - 1) / align * align + align);
    };
    def.release = [](void *, void *p, size_t, size_t) { std::free(p); };
    EXPECT_EQ(dfm_context_create(&def, &c), DFM_OK) << dfm_last_error();
  }
  ~Refusing() { dfm_context_destroy(c); }
};

struct Options {
  double delay;
  const char *model = "msm";
  uint32_t threads = 1;
  bool floor = false, held = false;  // held: each point
  double velocity = 0;               // m/s along x
  double energy = 0;                 // J/m2 that a cut takes
  double young = 3e4;                // Pa
  dfm_context *in = nullptr;         // null: one of its own
};

// A cube of 40 mm about the origin that moves through empty space, or lies in a box with friction that
// remembers; and a blade above it.
struct Cube {
  static constexpr double kArea = 0.04 * 0.04;  // m2
  test::Context own;
  dfm_context *context;
  dfm_world w;
  dfm_body body = 0;
  dfm_tool blade = 0;
  double z = test::cutting::knife().pose.position[2];
  uint64_t opened = 0, events = 0, largest = 0;
  explicit Cube(const Options &o)
      : own(o.threads),
        context(o.in ? o.in : own.c),
        w(test::make_world(context, {0, 0, o.floor ? -9.81 : 0})) {
    test::cutting::Tough cube{.size = {0.04, 0.04, 0.04},
                              .cells = 600,
                              .energy = o.energy,
                              .name = "cube",
                              .model = o.model,
                              .corner = -0.02,
                              .velocity = o.velocity};
    if (o.held) cube.held = [](const double *) { return true; };
    cube.material.young = o.young;
    cube.material.damping_stiffness = 2e-3;
    body = test::cutting::make(context, w, cube);
    if (o.floor) {
      dfm_obstacle_def below = dfm_obstacle_def_default();
      below.name = "floor";
      below.shape = DFM_SHAPE_PLANE;
      below.pose.position[2] = -0.02;
      dfm_obstacle plane = 0;
      test::ok(dfm_obstacle_create(w, &below, &plane));
      test::set_friction(w, 0.4, "lugre");
    }
    const dfm_tool_def td = test::cutting::knife();
    test::ok(dfm_tool_create(w, &td, &blade));
    test::ok(dfm_tool_set_cuts(blade, DFM_CUT_SPLIT, 0, 1, &body));
    test::ok(dfm_body_set_cut_delay(body, o.delay));
  }
  void step(double speed = 1) { EXPECT_EQ(try_step(speed), DFM_OK) << dfm_last_error(); }
  dfm_status try_step(double speed) {
    z -= speed * kStep;
    const dfm_pose p{{0.001, 0, z}, {0, 0, 0, 1}};
    test::ok(dfm_tool_set_pose(blade, &p, nullptr));
    const dfm_status status = dfm_world_step(w, kStep, nullptr);
    for (const dfm_contact_event &e : test::listed(dfm_world_events, w))
      if (e.kind == uint32_t{DFM_EVENT_CUT}) {
        EXPECT_EQ(e.a, body);
        opened += e.key;
        ++events;
      }
    return status;
  }
  void steps(int n, double speed = 1) {
    for (int i = 0; i < n; ++i) step(speed);
  }
  uint32_t waiting() const {
    uint32_t n = 0;
    test::ok(dfm_body_cut_delay(body, nullptr, &n));
    return n;
  }
  uint32_t points() const { return test::cutting::info(body).npoint; }
  uint32_t parts() const { return test::cutting::parts(body); }
};

const char *const kModels[] = {"msm", "corotational_fem"};

}  // namespace

TEST(CutDelay, Faces_OpenTheDelayAfterTheBlade_InOneStep) {
  Cube s({.delay = 0.010});
  while (s.waiting() == 0) s.step();
  const uint32_t first = s.waiting();
  for (int i = 0; i < 9; ++i) {
    s.step();
    EXPECT_EQ(s.events, 0u) << i;
  }
  const uint32_t met = s.waiting(), whole = s.points();
  EXPECT_GT(met, first) << "the blade goes on meanwhile";
  s.step(0);
  EXPECT_EQ(s.opened, first);
  EXPECT_EQ(s.waiting(), met - first);
  s.steps(9, 0);
  EXPECT_EQ(s.opened, first);
  s.step(0);
  EXPECT_EQ(s.opened, met) << "what it has met meanwhile opens the delay after that";
  EXPECT_EQ(s.waiting(), 0u);
  EXPECT_GT(s.points(), whole);
}

// The step that opens faces has the time for it; the one after has the pairs of the new surface to find.
// What a first cut needs of the body follows from its cells: it is made before the first step, which would
// take longer than others by it.
TEST(CutDelay, FirstStep_MakesNothingOfTheSizeOfTheCells) {
  Refusing r;
  Cube s({.delay = 0.006, .in = r.c});
  const uint64_t cells = test::cutting::info(s.body).ntet * 4 * sizeof(uint32_t);
  EXPECT_GT(r.largest, cells);
  r.largest = 0;
  s.step();
  EXPECT_LT(r.largest, cells);
  s.steps(60);
  EXPECT_GT(s.opened, 0u);
  EXPECT_GT(r.largest, cells);
}

// Evaluating it takes longer than the exchange of the shapes, and the step after finds the new pairs.
TEST(CutDelay, StableStepOfANewShape_IsEstimatedForOneStep_ThenEvaluated) {
  // soft enough for a few sub-steps a step; deformed, so that its bound is not that at rest
  Cube s({.delay = 0.005, .floor = true, .young = 5e3});
  uint32_t opened = 0, evaluated = 0;
  for (int i = 0; i < 60; ++i) {
    const uint64_t events = s.events;
    s.step();
    if (s.events == events) continue;
    ++opened;
    const double now = test::stats(s.w).stable_step;
    s.step();
    if (opened >
        1) {  // the first cut gives up what the spectrum allows beyond row sums, and takes finer steps
      EXPECT_EQ(test::stats(s.w).stable_step, now) << "opening " << opened;
    }
    s.step();
    const double found = test::stats(s.w).stable_step;
    evaluated += found != now;
    EXPECT_LE(now, found / 0.9) << "opening " << opened << ": beyond the bound itself";
  }
  EXPECT_GT(opened, 2u);
  EXPECT_GE(evaluated + 1, opened) << "where the bound is due as faces open, it is evaluated then";
}

TEST(CutDelay, Blade_PartsTheBody_WithoutMassMomentumOrForce) {
  for (const char *model : kModels)
    for (const double velocity : {0.0, 1e-3}) {
      Cube s({.delay = 0.008, .model = model, .velocity = velocity});
      const dfm_body_measure before = test::measure(s.body);
      s.steps(60);
      s.steps(20, 0);
      EXPECT_EQ(s.waiting(), 0u);
      EXPECT_EQ(s.parts(), 2u) << model;
      const dfm_body_measure after = test::measure(s.body);
      EXPECT_NEAR(after.mass, before.mass, 1e-15);
      for (int k = 0; k < 3; ++k) {
        EXPECT_NEAR(after.momentum[k], before.momentum[k], 1e-14 * before.mass);
        EXPECT_NEAR(after.angular[k], before.angular[k], 1e-14 * before.mass);
      }
    }
}

// Energy due at inner points waits for the cut; in the end all of it is paid exactly once.
TEST(CutDelay, Blade_PaysForTheCut) {
  for (const char *model : kModels)
    for (const double delay : {0.008, 0.04}) {
      Cube s({.delay = delay, .model = model, .held = true, .energy = 100});
      s.steps(400, 0.2);
      s.steps(50, 0.1);
      EXPECT_EQ(s.parts(), 2u) << model;
      dfm_tool_state t{};
      t.size = sizeof t;
      test::ok(dfm_tool_get_state(s.blade, &t));
      EXPECT_NEAR(t.work, 100 * Cube::kArea, 1e-9 * 100 * Cube::kArea) << model << ' ' << delay;
    }
}

// However many threads there are, and whether the one beside the steps is in time.
TEST(CutDelay, OnOneTwoOrFourThreads_TheBitsAreTheSame_InTimeOrLate) {
  const auto run = [](uint32_t threads, bool hurry) {
    Cube s({.delay = 0.006, .threads = threads, .floor = true, .energy = 100});
    for (int i = 0; i < 45; ++i) {
      s.step(i < 35 ? 1 : 0);
      // most cuts are made by the time that they are needed, or only just begun
      if (!hurry && s.waiting() > 0) std::this_thread::sleep_for(std::chrono::milliseconds(4));
    }
    EXPECT_GT(s.events, 3u);
    return test::snapshot(s.w);
  };
  const std::string one = run(1, false);
  EXPECT_TRUE(run(1, true) == one);
  EXPECT_TRUE(run(2, false) == one);
  EXPECT_TRUE(run(4, true) == one);
}

TEST(CutDelay, Snapshot_WhileFacesWait_GoesOnTheSameWay) {
  for (const char *model : kModels) {
    Cube s({.delay = 0.012, .model = model, .floor = true, .energy = 100});
    while (s.events < 2) s.step();
    s.steps(5);
    ASSERT_GT(s.waiting(), 0u);
    const std::string half = test::snapshot(s.w);
    const double z = s.z;
    s.steps(20);
    const std::string end = test::snapshot(s.w);
    test::ok(dfm_world_restore(s.w, half.data(), half.size()));
    s.z = z;
    s.steps(20);
    EXPECT_TRUE(test::snapshot(s.w) == end) << model;
    Cube other({.delay = 0.012, .model = model, .threads = 2, .floor = true, .energy = 100});
    test::ok(dfm_world_restore(other.w, half.data(), half.size()));
    other.z = z;
    EXPECT_GT(other.waiting(), 0u);
    other.steps(20);
    EXPECT_TRUE(test::snapshot(other.w) == end) << model;
  }
}

TEST(CutDelay, ParametersChanged_InBetween_AreThoseOfTheNewShape) {
  Cube s({.delay = 0.010, .model = "corotational_fem"});
  while (s.waiting() == 0) s.step();
  const std::string waits = test::snapshot(s.w);
  const double z = s.z;
  const auto go_on = [&] {
    const double young = 6e4;
    const dfm_param_value value{"young", &young, 1};
    const dfm_params params{sizeof params, 1, &value};
    test::ok(dfm_body_set_params(s.body, &params));
    s.steps(12);
    return test::snapshot(s.w);
  };
  const std::string later = go_on();
  ASSERT_GT(s.opened, 0u);
  test::ok(dfm_world_restore(s.w, waits.data(), waits.size()));
  s.z = z;
  EXPECT_EQ(go_on(), later);
}

// A cut by the host in between is not waited for, and what waits opens in what it has left.
TEST(CutDelay, CutByTheHost_InBetween_LosesNoFace) {
  Cube s({.delay = 0.010});
  while (s.waiting() == 0) s.step();
  s.steps(4);
  dfm_cut_def d = dfm_cut_def_default();
  d.shape = DFM_CUT_BOX;
  d.pose.position[0] = 0.02;
  for (double &h : d.half_size) h = 0.006;
  dfm_cut_info info{};
  info.size = sizeof info;
  test::ok(dfm_body_cut(s.body, &d, &info));
  ASSERT_GT(info.cells, 0u);
  s.steps(60);
  EXPECT_EQ(s.waiting(), 0u);
  EXPECT_EQ(s.parts(), 2u);
}

TEST(CutDelay, ModelChanged_InBetween_LosesNoFace) {
  Cube s({.delay = 0.010});
  while (s.waiting() == 0) s.step();
  s.steps(4);
  EXPECT_EQ(dfm_body_set_model(s.body, "shape_matching", nullptr), DFM_E_UNSUPPORTED);
  test::ok(dfm_body_set_model(s.body, "corotational_fem", nullptr));
  s.steps(60);
  EXPECT_EQ(s.waiting(), 0u);
  EXPECT_EQ(s.parts(), 2u);
}

// Pieces wait for the faces that they have.
TEST(CutDelay, BodyThatFallsInPieces_InBetween_LosesNoFace) {
  const auto set_up = [](Cube &s) {
    const dfm_separate_def each = dfm_separate_def_default();
    test::ok(dfm_body_set_separate(s.body, &each));
    test::ok(dfm_world_filter_pair(s.w, "*", "*", false));
  };
  const auto pieces = [](const Cube &s) {
    uint32_t n = 0;
    test::ok(dfm_body_pieces(s.body, 0, nullptr, &n));
    return n;
  };
  Cube s({.delay = 0.010}), other({.delay = 0.010});
  set_up(s);
  set_up(other);
  while (s.waiting() == 0) s.step();
  dfm_cut_def d = dfm_cut_def_default();  // into two halves across the blade
  d.shape = DFM_CUT_BOX;
  const double half[] = {0.05, 0.003, 0.05};
  std::copy(half, half + 3, d.half_size);
  test::ok(dfm_body_cut(s.body, &d, nullptr));
  ASSERT_EQ(pieces(s), 1u);
  dfm_body piece = 0;
  uint32_t n = 0;
  test::ok(dfm_body_pieces(s.body, 1, &piece, &n));
  EXPECT_EQ(dfm_body_set_cut_delay(piece, 0.02), DFM_E_STATE);
  test::says({"is a piece of 'cube'"});
  const std::string half_way = test::snapshot(s.w);
  const double z = s.z;
  EXPECT_EQ(dfm_body_set_cut_delay(s.body, 0), DFM_E_STATE);
  const auto go_on = [&](Cube &c) {
    c.z = z;
    for (int i = 0; i < 70; ++i) {
      c.z -= kStep;
      const dfm_pose p{{0.001, 0, c.z}, {0, 0, 0, 1}};
      test::ok(dfm_tool_set_pose(c.blade, &p, nullptr));
      test::ok(dfm_world_step(c.w, kStep, nullptr));
    }
    return test::snapshot(c.w);
  };
  const std::string end = go_on(s);
  EXPECT_GE(pieces(s), 3u) << "each half is cut in two";
  test::ok(dfm_world_restore(other.w, half_way.data(), half_way.size()));
  EXPECT_TRUE(go_on(other) == end);
  test::ok(dfm_world_restore(s.w, half_way.data(), half_way.size()));
  EXPECT_TRUE(go_on(s) == end);
}

// Faces that waited in a piece wait no more once a restore has taken the piece back, or it has no cells left.
TEST(CutDelay, PieceThatIsGone_HoldsNoDelay) {
  Cube s({.delay = 0.010});
  const dfm_separate_def each = dfm_separate_def_default();
  test::ok(dfm_body_set_separate(s.body, &each));
  test::ok(dfm_world_filter_pair(s.w, "*", "*", false));
  const std::string whole = test::snapshot(s.w);
  const double z = s.z;
  for (const bool restored : {true, false}) {
    s.z = z;
    while (s.waiting() == 0) s.step();
    dfm_cut_def d = dfm_cut_def_default();  // into two halves across the blade
    d.shape = DFM_CUT_BOX;
    const double half[] = {0.05, 0.003, 0.05};
    std::copy(half, half + 3, d.half_size);
    test::cutting::cut(s.body, d);
    const std::vector<dfm_body> pieces = test::listed(dfm_body_pieces, s.body);
    ASSERT_EQ(pieces.size(), 1u);
    uint32_t waiting = 0;
    test::ok(dfm_body_cut_delay(pieces[0], nullptr, &waiting));
    ASSERT_GT(waiting, 0u);
    if (restored) {
      test::cutting::restore(s.w, whole);
    } else {
      test::cutting::cut(pieces[0], test::cutting::sphere({0, 0, 0}, 1));
      s.steps(30, 0);
    }
    EXPECT_EQ(s.waiting(), 0u);
    EXPECT_EQ(dfm_body_set_cut_delay(s.body, 0.010), DFM_OK) << dfm_last_error();
  }
}

TEST(CutDelay, WorldWithAFaceThatWaits_CanGo) {
  for (const bool begun : {false, true}) {
    Cube s({.delay = 0.05});
    while (s.waiting() == 0) s.step();
    if (begun) std::this_thread::sleep_for(std::chrono::microseconds(200));
  }
}

TEST(CutDelay, BodyWithAFaceThatWaits_CanGo) {
  Cube s({.delay = 0.005});
  while (s.waiting() == 0) s.step();
  test::ok(dfm_body_destroy(s.body));
  s.steps(10);
  Cube emptied({.delay = 0.005});
  while (emptied.waiting() == 0) emptied.step();
  dfm_cut_def d = dfm_cut_def_default();
  d.shape = DFM_CUT_BOX;
  for (double &h : d.half_size) h = 1;
  test::ok(dfm_body_cut(emptied.body, &d, nullptr));
  emptied.steps(10);
}

// The step does what the thread cannot.
TEST(CutDelay, NoMemoryForTheThread_TheBitsAreTheSame) {
  const auto run = [](Refusing &r, int to) {
    Cube s({.delay = 0.006, .floor = true, .energy = 100, .in = r.c});
    r.to = to;
    for (int i = 0; i < 60; ++i) {
      s.step();
      if (s.waiting() > 0) std::this_thread::sleep_for(std::chrono::milliseconds(2));
      // on a machine without a free core: until the thread has asked for memory once
      for (int k = 0; k < 100 && to == Refusing::beside && s.waiting() > 0 && r.refused == 0; ++k)
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    r.to = Refusing::none;
    EXPECT_GT(s.events, 3u);
    return test::snapshot(s.w);
  };
  Refusing plenty, little;
  const std::string expected = run(plenty, Refusing::none);
  EXPECT_TRUE(run(little, Refusing::beside) == expected);
  EXPECT_GT(little.refused, 0u);
}

// A step that cannot open faces says so, and the next one does.
TEST(CutDelay, NoMemoryForTheStep_FacesOpenInTheNext) {
  Refusing r;
  Cube s({.delay = 0.006, .in = r.c});
  int failed = 0;
  for (int i = 0; i < 80; ++i) {
    if (s.waiting() > 0 && i % 3 == 0) {
      r.to = Refusing::all;
      const dfm_status status = s.try_step(i < 60 ? 1 : 0);
      r.to = Refusing::none;
      EXPECT_TRUE(status == DFM_OK || status == DFM_E_NOMEM) << dfm_last_error();
      failed += status != DFM_OK;
    } else {
      s.step(i < 60 ? 1 : 0);
    }
  }
  EXPECT_GT(failed, 3);
  s.steps(10, 0);
  EXPECT_EQ(s.waiting(), 0u);
}

TEST(CutDelay, WhatIsWrong_IsRefused) {
  Cube s({.delay = 0});
  double delay = -1;
  EXPECT_EQ(dfm_body_set_cut_delay(s.body, -1), DFM_E_ARG);
  EXPECT_EQ(dfm_body_set_cut_delay(s.body, NAN), DFM_E_ARG);
  EXPECT_EQ(dfm_body_set_cut_delay(0, 0.01), DFM_E_HANDLE);
  test::ok(dfm_body_set_cut_delay(s.body, 0.02));
  test::ok(dfm_body_cut_delay(s.body, &delay, nullptr));
  EXPECT_EQ(delay, 0.02);
  while (s.waiting() == 0) s.step();
  EXPECT_EQ(dfm_body_set_cut_delay(s.body, 0), DFM_E_STATE);
  EXPECT_GT(s.waiting(), 0u);

  test::Context context;
  const dfm_world w = test::make_world(context, {0, 0, 0});
  test::BodyOptions o;
  o.model = "shape_matching";
  const dfm_body body = test::make_body(context, w, "beam", {0.04, 0.04, 0.04}, 100, o);
  EXPECT_EQ(dfm_body_set_cut_delay(body, 0.01), DFM_E_UNSUPPORTED);
}
