// The host's rounding mode, how it treats denormal numbers, and what it lets raise a signal, change no bit of
// a world, and the host has them back after each call.
#include <fenv.h>

#include <cfloat>
#include <optional>
#include <thread>

#include "cut_scenes.h"
#include "flush_denormals.h"
#include "scenes.h"

namespace {

enum Env { kUsual, kUpward, kToZero, kFlushing, kSignaling };

// As long as it lives, this thread has it.
struct Host {
  fenv_t before;
  explicit Host(Env env) {
    fegetenv(&before);
    if (env == kUpward) fesetround(FE_UPWARD);
    if (env == kToZero) fesetround(FE_TOWARDZERO);
    if (env == kFlushing) flush_denormals();
    if (env == kSignaling) feenableexcept(FE_DIVBYZERO | FE_INVALID | FE_OVERFLOW);
  }
  ~Host() { fesetenv(&before); }
  Host(const Host &) = delete;
  Host &operator=(const Host &) = delete;
};

// Whether arithmetic of this thread goes by it.
bool has(Env env) {
  volatile double small = DBL_MIN, third = 3, one = 1, up = 1;
  if (env == kSignaling) return (fegetexcept() & FE_INVALID) != 0;
  if (env == kFlushing) return small / 4 == 0;
  up = one / third;
  const int mode = env == kUpward ? FE_UPWARD : env == kToZero ? FE_TOWARDZERO : FE_TONEAREST;
  return fegetround() == mode && (env != kUpward || up > 0.33333333333333331);
}

// The workers are made, and work, in the host's environment; so does the thread beside the steps.
std::string cut_beside(uint32_t threads, Env env) {
  std::optional<Host> host(env);
  const test::Context c(threads);
  host.reset();
  const dfm_world w = test::make_world(c, {0, 0, 0});
  const dfm_body body = test::cutting::cube(c, w, "corotational_fem");
  test::ok(dfm_body_set_cut_delay(body, 0.005));
  const dfm_tool_def d = test::cutting::knife();
  dfm_tool t = 0;
  test::ok(dfm_tool_create(w, &d, &t));
  test::ok(dfm_tool_set_cuts(t, DFM_CUT_SPLIT, 0, 1, &body));
  for (int i = 1; i <= 60; ++i) {
    dfm_pose p = d.pose;
    p.position[2] = d.pose.position[2] - 1e-3 * i;
    host.emplace(env);
    test::ok(dfm_tool_set_pose(t, &p, nullptr));
    test::ok(dfm_world_step(w, 1e-3, nullptr));
    EXPECT_TRUE(has(env));
    host.reset();
  }
  return test::snapshot(w);
}

}  // namespace

TEST(FloatEnv, OfTheHost_ChangesNoBit) {
  for (const scenes::Scene &scene : scenes::all) {
    if (std::string(scene.name) != "crossing_beams" && std::string(scene.name) != "coupled_pair") continue;
    const uint64_t usual = scenes::run(scene, 1);
    for (const Env env : {kUpward, kToZero, kFlushing, kSignaling}) {
#if !defined(__x86_64__)  // others need not raise signals
      if (env == kSignaling) continue;
#endif
      for (const uint32_t threads : {1u, 2u}) {
        std::optional<Host> host(env);
        const test::Context c(threads);  // workers begin with what its maker has
        host.reset();
        const dfm_world w = scene.build(c);  // the scene computes in it, too
        host.emplace(env);
        scenes::advance(w, scene.steps);
        EXPECT_TRUE(has(env)) << scene.name << " " << env;
        host.reset();
        EXPECT_EQ(dfm_world_hash(w), usual) << scene.name << " " << env << " " << threads;
      }
    }
  }
}

TEST(FloatEnv, OfTheHost_ChangesNoCutMadeBesideTheSteps) {
  const std::string usual = cut_beside(1, kUsual);
  for (const uint32_t threads : {1u, 2u})
    for (const Env env : {kUpward, kToZero}) EXPECT_TRUE(cut_beside(threads, env) == usual) << env;
}

// Its workers have an environment of their own.
TEST(FloatEnv, OfTheHostsWorkers_ChangesNoBit) {
  dfm_context_def def = dfm_context_def_default();
  def.plugin_dir = DEFORM_PLUGIN_DIR;
  def.parallel_for = [](void *, uint32_t n, uint32_t, void (*fn)(void *, uint32_t, uint32_t), void *task) {
    std::thread([&] {
      const Host host(kUpward);
      fn(task, 0, n);
      EXPECT_TRUE(has(kUpward));
    }).join();
  };
  const scenes::Scene &scene = scenes::all[1];
  dfm_context *c = nullptr;
  ASSERT_EQ(dfm_context_create(&def, &c), DFM_OK) << dfm_last_error();
  const dfm_world w = scene.build(c);
  scenes::advance(w, scene.steps);
  EXPECT_EQ(dfm_world_hash(w), scenes::run(scene, 1));
  dfm_context_destroy(c);
}
