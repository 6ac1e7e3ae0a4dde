// An island of contacts is solved as if it were alone: what bodies do has the same bits with and without
// other bodies in the world that they do not touch.
#include <algorithm>
#include <cstdint>
#include <string_view>
#include <utility>
#include <vector>

#include "support.h"
#include "world.h"

namespace {

// Three blocks on each other on a floor, the upper two attached to each other. They slide and tip as they
// land.
struct Stack {
  double x, speed;
  const char *model;
  int32_t integrator;
};

std::vector<double> state(dfm_body body) {
  std::vector<double> x(3 * 4096), v(3 * 4096);
  uint32_t n = 0;
  test::ok(dfm_body_get_state(body, 4096, x.data(), v.data(), &n));
  x.resize(3 * size_t{n});
  x.insert(x.end(), v.begin(), v.begin() + 3 * std::ptrdiff_t(n));
  return x;
}

// States of the bodies, stack after stack, after 40 steps.
std::vector<std::vector<double>> run(const std::vector<Stack> &stacks, uint32_t threads = 1,
                                     dfm_world_stats *stats = nullptr) {
  const test::Context c(threads);
  const dfm_world w = test::make_world(c);
  test::add_plane(w, "floor");
  test::set_friction(w, 0.3);
  std::vector<dfm_body> bodies;
  for (const Stack &s : stacks) {
    test::BodyOptions o;
    o.young = 2e5;
    o.damping_stiffness = 1e-3;
    o.model = s.model;
    o.integrator = s.integrator;
    for (int level = 0; level < 3; ++level) {
      o.position = {s.x + 0.013 * level, 0.007 * level, 1e-4 + 0.1002 * level};
      o.velocity = {s.speed, 0, -0.2};
      o.spin = {0, s.speed, 0};
      bodies.push_back(test::make_body(c, w, "beam", {0.1, 0.1, 0.1}, 80, o));
    }
    const double z = o.position[2];
    const double bottom[] = {-9, -9, z - 1e-9, 9, 9, z + 1e-9};
    dfm_attach_def d = dfm_attach_def_default();
    d.to = bodies[bodies.size() - 2];
    d.box = bottom;
    d.max_distance = 0.01;
    test::ok(dfm_body_attach(bodies.back(), &d, nullptr));
  }
  for (int k = 0; k < 40; ++k) test::ok(dfm_world_step(w, 1e-3, nullptr));
  EXPECT_GT(test::stats(w).contacts, 0u);
  if (stats) *stats = test::stats(w);
  std::vector<std::vector<double>> out;
  for (const dfm_body b : bodies) out.push_back(state(b));
  return out;
}

Stack stack(double x, double speed, const char *model, int32_t integrator) {
  return {x, speed, model, integrator};
}

constexpr int32_t kAuto = DFM_INTEGRATOR_AUTO, kImplicit = DFM_INTEGRATOR_IMPLICIT_EULER;

}  // namespace

TEST(Islands, BesideAnother_HaveTheBitsThatTheyHaveAlone) {
  for (const auto &[model, integrator] :
       {std::pair{"msm", kAuto}, {"modal", kAuto}, {"corotational_fem", kImplicit}}) {
    const Stack slow = stack(0, 0.2, model, integrator), fast = stack(1, -0.9, model, integrator);
    const auto both = run({slow, fast}), first = run({slow}), second = run({fast});
    ASSERT_EQ(both.size(), 6u);
    for (size_t k = 0; k < 3; ++k) {
      EXPECT_EQ(both[k], first[k]) << model << k;
      EXPECT_EQ(both[3 + k], second[k]) << model << k;
    }
  }
}

TEST(Islands, Statistics_AreThoseOfTheWorst) {
  const Stack slow = stack(0, 0.2, "msm", kAuto), fast = stack(1, -0.9, "msm", kAuto);
  dfm_world_stats both{}, first{}, second{};
  run({slow, fast}, 1, &both);
  run({slow}, 1, &first);
  run({fast}, 1, &second);
  EXPECT_EQ(both.residual, std::max(first.residual, second.residual));
  EXPECT_EQ(both.residual_max, std::max(first.residual_max, second.residual_max));
  EXPECT_EQ(both.sweeps, std::max(first.sweeps, second.sweeps));
  EXPECT_EQ(both.passes, std::max(first.passes, second.passes));
  EXPECT_EQ(both.contacts, first.contacts + second.contacts);
  EXPECT_GE(both.unconverged, std::max(first.unconverged, second.unconverged));
  EXPECT_LE(both.unconverged, first.unconverged + second.unconverged);
}

// Implicit bodies elsewhere do not tighten the tolerance of explicit ones.
TEST(Islands, OfExplicitBodiesBesideImplicitOnes_HaveTheBitsThatTheyHaveAlone) {
  const Stack own = stack(0, 0.2, "msm", DFM_INTEGRATOR_SYMPLECTIC_EULER);
  const auto both = run({own, stack(1, -0.9, "corotational_fem", kImplicit)}), alone = run({own});
  for (size_t k = 0; k < 3; ++k) EXPECT_EQ(both[k], alone[k]) << k;
}

// unsanitized: too slow there; ten bodies on one to eight threads are islands too
TEST(Islands, OnMoreThreads_HaveTheSameBits) {
  const std::vector<Stack> stacks = {stack(0, 0.2, "msm", kAuto), stack(1, -0.9, "msm", kAuto),
                                     stack(2, 0.4, "corotational_fem", kImplicit)};
  const auto one = run(stacks);
  for (const uint32_t threads : {2u, 3u, 4u}) EXPECT_EQ(run(stacks, threads), one) << threads;
}

namespace {

// A host's loop that notes how many islands the contact solve has handed out.
struct Jobs {
  bool solve = false;
  uint32_t most = 0;
  static void run(void *user, uint32_t n, uint32_t grain, void (*fn)(void *, uint32_t, uint32_t),
                  void *task) {
    Jobs &jobs = *static_cast<Jobs *>(user);
    if (jobs.solve && grain == 1) jobs.most = std::max(jobs.most, n);
    for (uint32_t k = 0; k < n; k += grain) fn(task, k, std::min(n, k + grain));
  }
  static void begin(void *user, const char *stage) {
    static_cast<Jobs *>(user)->solve = std::string_view(stage) == "contact+friction";
  }
  static void end(void *user, const char *) { static_cast<Jobs *>(user)->solve = false; }
};

// A beam that lies on two blocks on a floor: number of islands in the last of 40 steps.
uint32_t islands_of_a_bridge() {
  Jobs jobs;
  dfm_context_def def = dfm_context_def_default();
  def.plugin_dir = DEFORM_PLUGIN_DIR;
  def.user = &jobs;
  def.parallel_for = Jobs::run;
  def.trace_begin = Jobs::begin;
  def.trace_end = Jobs::end;
  dfm_context *c = nullptr;
  test::ok(dfm_context_create(&def, &c));
  const dfm_world w = test::make_world(c);
  test::add_plane(w, "floor");
  test::BodyOptions o;
  o.young = 2e5;
  o.damping_stiffness = 1e-3;
  o.integrator = DFM_INTEGRATOR_SYMPLECTIC_EULER;
  for (const double x : {0.0, 0.3}) {
    o.position = {x, 0, 1e-4};
    test::make_body(c, w, "beam", {0.1, 0.1, 0.1}, 80, o);
  }
  o.position = {0, 0.01, 0.1002};
  test::make_body(c, w, "beam", {0.4, 0.08, 0.05}, 200, o);
  for (int k = 0; k < 40; ++k) {
    jobs.most = 0;
    test::ok(dfm_world_step(w, 1e-3, nullptr));
  }
  dfm_context_destroy(c);
  return jobs.most;
}

}  // namespace

// Both ends of the beam and both blocks: no point is in two of these patches.
TEST(Islands, OfOneExplicitBody_AreItsPatches) { EXPECT_EQ(islands_of_a_bridge(), 4u); }
