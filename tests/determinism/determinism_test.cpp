// One scene, one hash: whatever the threads, the host's way to cut and order work, the instruction set, the
// lists that detection keeps.
#include <algorithm>
#include <cstdlib>
#include <random>
#include <thread>

#include "core/handle.h"
#include "query.h"
#include "scenes.h"
#include "step/context.h"

namespace {

class Determinism : public testing::TestWithParam<scenes::Scene> {};
INSTANTIATE_TEST_SUITE_P(Scenes, Determinism, testing::ValuesIn(scenes::all),
                         [](const auto &i) { return std::string(i.param.name); });

// A host that cuts at random multiples of grain and hands the pieces, shuffled, to three threads.
struct RudeHost {
  std::mt19937 random{7};
  uint64_t calls = 0;
  static void parallel_for(void *user, uint32_t n, uint32_t grain, void (*fn)(void *, uint32_t, uint32_t),
                           void *task) {
    RudeHost &host = *static_cast<RudeHost *>(user);
    ++host.calls;
    std::vector<std::pair<uint32_t, uint32_t>> pieces;
    for (uint32_t at = 0; at < n;) {
      const uint64_t end = at + uint64_t(grain) * (1 + host.random() % 3);
      pieces.push_back({at, uint32_t(std::min<uint64_t>(n, end))});
      at = pieces.back().second;
    }
    std::shuffle(pieces.begin(), pieces.end(), host.random);
    std::vector<std::thread> threads;
    for (size_t t = 0; t < 3; ++t)
      threads.emplace_back([&, t] {
        for (size_t i = t; i < pieces.size(); i += 3) fn(task, pieces[i].first, pieces[i].second);
      });
    for (auto &t : threads) t.join();
  }
};

// unsanitized(implicit_m*:implicit_l*:implicit_*_ball:implicit_*_ten:s*_ten:ten_*:condensed_*): slow
TEST_P(Determinism, OneToEightThreads_GiveTheSameHash) {
  scenes::Scene scene = GetParam();
  // five runs, of the longest one until the ball has woken the block
  scene.steps = std::min(scene.steps, 165);
  const uint64_t one = scenes::run(scene, 1);
#ifdef DEFORM_SANITIZED  // two numbers show a race as well as four
  const std::initializer_list<uint32_t> counts = {2, 8};
#else
  const std::initializer_list<uint32_t> counts = {2, 3, 5, 8};
#endif
  for (const uint32_t threads : counts) EXPECT_EQ(scenes::run(scene, threads), one) << threads << " threads";
}

// unsanitized(implicit_m*:implicit_l*:implicit_*_skins:implicit_*_ball:*_ten:ten_*:condensed_*:fine_*): slow
TEST_P(Determinism, AHostThatCutsAndShuffles_GivesTheSameHash) {
  RudeHost host;
  dfm_context_def def = dfm_context_def_default();
  def.user = &host;
  def.parallel_for = RudeHost::parallel_for;
  def.plugin_dir = DEFORM_PLUGIN_DIR;
  def.log = [](void *, int32_t, const char *) {};
  dfm_context *c = nullptr;
  ASSERT_EQ(dfm_context_create(&def, &c), DFM_OK) << dfm_last_error();
  scenes::Scene few = GetParam();
  few.steps = 60;  // threads are made and joined for every call
  EXPECT_EQ(scenes::hex(scenes::run(c, few)), scenes::hex(scenes::run(few)));
  dfm_context_destroy(c);
  EXPECT_TRUE(host.calls > 60 || few.name != std::string("ten_in_a_box")) << "the hook was not used";
}

// Passes over few points are shorter than a job takes to start: only the forces are one.
TEST(Jobs, OfTwoBodiesOfFewPoints_AreOnePerSubStep) {
  RudeHost host;
  dfm_context_def def = dfm_context_def_default();
  def.user = &host;
  def.parallel_for = RudeHost::parallel_for;
  def.plugin_dir = DEFORM_PLUGIN_DIR;
  dfm_context *c = nullptr;
  ASSERT_EQ(dfm_context_create(&def, &c), DFM_OK) << dfm_last_error();
  const dfm_world w = test::make_world(c);
  test::BodyOptions o;
  o.integrator = DFM_INTEGRATOR_SYMPLECTIC_EULER;
  for (const double x : {0.0, 0.1}) {
    o.position = {x, 0, 0};
    test::make_body(c, w, "beam", {0.02, 0.02, 0.02}, 20, o);
  }
  scenes::advance(w, 10);
  const uint64_t calls = host.calls, before = test::stats(w).substeps;
  scenes::advance(w, 60);
  const double substeps = double(test::stats(w).substeps - before);
  EXPECT_LT(double(host.calls - calls), 1.2 * substeps);
  EXPECT_GT(substeps, 59);
  dfm_context_destroy(c);
}

// Lists of pairs that are renewed every sub-step, or hold for long, hold the same contacts.
TEST_P(Determinism, LivesOfCandidateLists_DoNotShow) {
  const uint64_t usual = scenes::run(GetParam());
  for (double skin : {1.0, 90.0}) {
    const test::Context c;
    const dfm_world w = GetParam().build(c);
    static_cast<dfm::World *>(dfm::handle_find(dfm::Kind::world, w))->steps->broad.set_skin_steps(skin);
    scenes::advance(w, GetParam().steps);
    EXPECT_EQ(dfm_world_hash(w), usual) << "skin of " << skin << " steps";
  }
}

// Renewed at random times.
TEST_P(Determinism, ForgottenCandidateLists_DoNotShow) {
  const test::Context c;
  const dfm_world w = GetParam().build(c);
  dfm::BroadPhase &broad = static_cast<dfm::World *>(dfm::handle_find(dfm::Kind::world, w))->steps->broad;
  std::mt19937 random(3);
  for (int i = 0; i < GetParam().steps; ++i) {
    if (random() % 5 == 0) broad.clear();
    scenes::advance(w, 1);
  }
  EXPECT_EQ(dfm_world_hash(w), scenes::run(GetParam()));
}

// Two worlds of one context may step at the same time, each on its own thread.
// unsanitized(implicit_m*:implicit_l*:implicit_*_skins:implicit_*_ball:*_ten:ten_*:condensed_*:fine_*): slow
TEST_P(Determinism, WorldsThatStepAtTheSameTime_DoNotDisturbEachOther) {
  scenes::Scene few = GetParam();
  few.steps = 60;
  const uint64_t alone = scenes::run(few);
  const test::Context c(3);
  dfm_world worlds[2] = {few.build(c), few.build(c)};
  std::thread other([&] { scenes::advance(worlds[1], few.steps); });
  scenes::advance(worlds[0], few.steps);
  other.join();
  EXPECT_EQ(dfm_world_hash(worlds[0]), alone);
  EXPECT_EQ(dfm_world_hash(worlds[1]), alone);
}

// Reading a world, in every way there is, changes nothing that comes later.
TEST_P(Determinism, QueriesAndSnapshots_ChangeNothing) {
  const test::Context c;
  const dfm_world w = GetParam().build(c);
  std::vector<dfm_body> bodies(16);
  uint32_t n = 0;
  test::ok(dfm_world_bodies(w, 16, bodies.data(), &n));
  for (int i = 0; i < GetParam().steps; ++i) {
    scenes::advance(w, 1);
    double dt = 0;
    size_t bytes = 0;
    switch (i % 7) {
      case 0: test::ok(dfm_world_stable_step(w, &dt, nullptr, nullptr)); break;
      case 1: test::ok(dfm_world_explain(w, nullptr, &bytes)); break;
      case 2: test::ok(dfm_world_snapshot(w, nullptr, &bytes)); break;
      case 3:
        test::measure(bodies[0]);
        test::stats(w);
        break;
      case 4: test::ray(w, {0, 0, 1}, {0, 0, -1}, 10); break;
      case 5: test::ok(dfm_world_events(w, 0, nullptr, &n)); break;
      default: test::ok(dfm_world_contacts(w, 0, nullptr, &n)); test::ok(dfm_world_pairs(w, 0, nullptr, &n));
    }
  }
  EXPECT_EQ(dfm_world_hash(w), scenes::run(GetParam()));
}

// Kernels are chosen when a body is created. Those that the processor lacks are refused by a
// warning on the log.
TEST_P(Determinism, InstructionSets_GiveTheSameHash) {
  const char *const given = std::getenv("DEFORM_SIMD");
  const std::string before = given ? given : "";
  const uint64_t best = scenes::run(GetParam());
  for (const char *simd : {"sse2", "avx2", "avx512"}) {
    setenv("DEFORM_SIMD", simd, 1);
    EXPECT_EQ(scenes::run(GetParam()), best) << simd;
  }
  setenv("DEFORM_SIMD", before.c_str(), 1);  // empty: the processor's best
}

}  // namespace
