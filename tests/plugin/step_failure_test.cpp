// Plugins that fail inside a step: the step says who and where, the world keeps its last good state, the host
// lives on. Laws and models are static plugins that do what the test tells them.
#define DFM_STATIC_PLUGIN misbehaving
#include <atomic>
#include <cfenv>
#include <stdexcept>
#include <thread>

#include "deform/plugin.hpp"
#include "rigid.h"
#include "stack.h"

namespace {

enum class Way { behave, throws, fails, nan_force, nan_limit, negative_limit, rounds };
Way law_way = Way::behave;
enum class Model {
  behave,
  throws_forces,
  fails_forces,
  nan_force,
  throws_bound,
  throws_create,
  fails_create,
  nested,
  rounds
};
Model model_way = Model::behave;
const dfm_host *host_of_model = nullptr;
std::atomic<int> nested_parallel{0}, nested_calls{0};

// Frictionless, but for the way told.
dfm_status law_eval(const dfm_friction_in *in, dfm_friction_out *out) {
  if (law_way == Way::throws) throw std::runtime_error("boom");
  if (law_way == Way::fails) return DFM_E_FATAL;
  for (uint32_t i = 0; i < in->n; ++i) {
    const bool last = i + 1 == in->n;
    out->ft[i] = last && law_way == Way::nan_force ? NAN : 0;
    out->ft[in->stride + i] = 0;
    for (uint32_t k = 0; k < 4 && out->dft_dvt; ++k) out->dft_dvt[k * in->stride + i] = 0;
    for (uint32_t k = 0; k < 2 && out->dft_dfn; ++k) out->dft_dfn[k * in->stride + i] = 0;
    if (out->limit)
      out->limit[i] = last && law_way == Way::nan_limit        ? NAN
                      : last && law_way == Way::negative_limit ? -1
                                                               : 0;
    if (out->mode) out->mode[i] = 2;
  }
  if (law_way == Way::rounds) std::fesetround(FE_UPWARD);
  return DFM_OK;
}

// A cloud of free points (no forces): enough to fall on a floor.
dfm_status create(const dfm_host *host, const dfm_mesh *, void **self) {
  if (model_way == Model::throws_create) throw 1;
  if (model_way == Model::fails_create) return DFM_E_NOMEM;
  host_of_model = host;
  *self = &model_way;
  return DFM_OK;
}
void destroy(void *) {
  if (model_way != Model::behave) throw std::runtime_error("on the way out");
}
dfm_status add_forces(void *, const dfm_kin *k, double *f) {
  if (model_way == Model::throws_forces) throw std::runtime_error("boom");
  if (model_way == Model::fails_forces) return DFM_E_FATAL;
  if (model_way == Model::nan_force) f[0] = NAN;
  if (model_way == Model::rounds) std::fesetround(FE_DOWNWARD);
  if (model_way == Model::nested) {
    // A call from inside a worker runs serially in the caller.
    struct Task { std::thread::id caller; } task{std::this_thread::get_id()};
    ++nested_calls;
    host_of_model->parallel_for(
        host_of_model->ctx, 1000, 1,
        [](void *user, uint32_t, uint32_t) {
          if (std::this_thread::get_id() != static_cast<Task *>(user)->caller) ++nested_parallel;
        },
        &task);
  }
  (void)k;
  return DFM_OK;
}
dfm_status bound(void *, const dfm_kin *, double *, double *, double *) {
  if (model_way == Model::throws_bound) throw 2;
  return DFM_OK;
}

}  // namespace

extern "C" const dfm_plugin *dfm_plugin_entry_misbehaving(const dfm_host *host, uint32_t, uint32_t) {
  if (!DFM_ABI_OK(host)) return nullptr;
  static const char *const effects[] = {nullptr};
  static dfm_friction friction{};
  friction.size = sizeof friction;
  friction.needs = 0;
  friction.flags = DFM_FRIC_SET_VALUED | DFM_FRIC_JACOBIAN;
  friction.eval = law_eval;
  static dfm_model ops{};
  ops.size = sizeof ops;
  ops.cells = DFM_CELL_TET;
  ops.create = create;
  ops.destroy = destroy;
  ops.add_forces = add_forces;
  ops.bound = bound;
  static const dfm_type law = dfm::plugin::type(DFM_KIND_FRICTION, "test.bad_law", "bad law", "1", "MIT",
                                                "test", effects, &friction),
                        model = dfm::plugin::type(DFM_KIND_MODEL, "test.bad_model", "bad model", "1", "MIT",
                                                  "test", effects, &ops);
  static const dfm_type *const types[] = {&law, &model};
  static const dfm_plugin plugin{sizeof(dfm_plugin), DFM_ABI, DFM_ABI_DRAFT, 2, types, nullptr};
  return &plugin;
}

namespace {

struct Host {
  std::string log;
  dfm_context *c = nullptr;
  explicit Host(uint32_t threads = 1, bool own_parallel_for = false) {
    law_way = Way::behave;
    model_way = Model::behave;
    dfm_context_def def = dfm_context_def_default();
    def.plugin_dir = DEFORM_PLUGIN_DIR;
    def.threads = threads;
    def.user = this;
    def.log = [](void *user, int32_t, const char *text) {
      static_cast<Host *>(user)->log += std::string(text) + "\n";
    };
    if (own_parallel_for)
      def.parallel_for = [](void *, uint32_t n, uint32_t grain, void (*fn)(void *, uint32_t, uint32_t),
                            void *task) {
        std::vector<std::thread> pieces;
        const uint32_t piece = std::max(grain, (n + 3) / 4);
        for (uint32_t at = 0; at < n; at += piece) pieces.emplace_back(fn, task, at, std::min(n, at + piece));
        for (auto &t : pieces) t.join();
      };
    EXPECT_EQ(dfm_context_create(&def, &c), DFM_OK) << dfm_last_error();
    test::ok(dfm_plugin_register_static(c, dfm_plugin_entry_misbehaving, "misbehaving"));
  }
  ~Host() { dfm_context_destroy(c); }
};

using test::says;

}  // namespace

TEST(StepFailure, OfALaw_EndsTheStepAndKeepsTheState) {
  Host h;
  const test::Stack s = test::make_stack(h.c);
  test::ok(test::add_friction(s.world, "test.bad_law"));
  test::run(s.world, 0.05, 1e-3);
  for (const Way way : {Way::throws, Way::fails, Way::nan_force, Way::nan_limit, Way::negative_limit}) {
    SCOPED_TRACE(int(way));
    const uint64_t before = dfm_world_hash(s.world);
    const double t = dfm_world_time(s.world);
    uint32_t trouble = 0;
    law_way = way;
    h.log.clear();
    EXPECT_EQ(dfm_world_step(s.world, 1e-3, &trouble), DFM_E_DIVERGED);
    EXPECT_TRUE(trouble & DFM_TROUBLE_PLUGIN);
    says({"step ", "'test.bad_law'"});
    EXPECT_EQ(dfm_world_hash(s.world), before);
    EXPECT_EQ(dfm_world_time(s.world), t);
    EXPECT_TRUE(way != Way::throws || h.log.find("test.bad_law: eval threw") != std::string::npos) << h.log;
    law_way = Way::behave;
    test::run(s.world, 0.01, 1e-3);
  }
}

TEST(StepFailure, OfALawBetweenRigidThings_EndsTheStepAndKeepsTheState) {
  Host h;
  const dfm_world w = test::make_world(h.c);
  test::add_plane(w, "floor");
  test::create(w, {test::box("crate", {0.1, 0.1, 0.1}, 1, {0, 0, 0.1})}, {});
  test::ok(test::add_friction(w, "test.bad_law"));
  test::run(w, 0.05, 1e-3);
  for (const Way way : {Way::throws, Way::fails, Way::nan_force, Way::nan_limit, Way::negative_limit}) {
    SCOPED_TRACE(int(way));
    const uint64_t before = dfm_world_hash(w);
    uint32_t trouble = 0;
    law_way = way;
    EXPECT_EQ(dfm_world_step(w, 1e-3, &trouble), DFM_E_DIVERGED);
    EXPECT_TRUE(trouble & DFM_TROUBLE_PLUGIN);
    says({"step ", "'test.bad_law'"});
    EXPECT_EQ(dfm_world_hash(w), before);
    law_way = Way::behave;
    test::run(w, 0.01, 1e-3);
  }
}

TEST(StepFailure, OfAModel_EndsTheStepAndKeepsTheState) {
  Host h;
  const dfm_world w = test::make_world(h.c);
  test::add_plane(w, "floor");
  test::BodyOptions o;
  o.name = "good";
  o.position = {0, 0, 0.3};
  test::make_body(h.c, w, "beam", {0.1, 0.1, 0.1}, 60, o);
  o.name = "cloud";
  o.model = "test.bad_model";
  o.position = {0.5, 0, 0.3};
  test::make_body(h.c, w, "beam", {0.1, 0.1, 0.1}, 60, o);
  test::run(w, 0.008, 1e-3);
  for (const Model way : {Model::throws_forces, Model::fails_forces, Model::nan_force}) {
    SCOPED_TRACE(int(way));
    const uint64_t before = dfm_world_hash(w);
    uint32_t trouble = 0;
    model_way = way;
    EXPECT_EQ(dfm_world_step(w, 1e-3, &trouble), DFM_E_DIVERGED);
    EXPECT_TRUE(trouble & (way == Model::nan_force ? DFM_TROUBLE_NONFINITE : DFM_TROUBLE_PLUGIN));
    says({"step 8", "body 'cloud'", "test.bad_model"});
    EXPECT_EQ(dfm_world_hash(w), before);
    model_way = Model::behave;
  }
  model_way = Model::throws_bound;
  double dt = 0;
  // the bound is asked anew
  EXPECT_EQ(dfm_world_set_gravity(w, std::array<double, 3>{0, 0, -1}.data()), DFM_OK);
  const uint64_t before = dfm_world_hash(w);
  EXPECT_EQ(dfm_world_step(w, 1e-3, nullptr), DFM_E_FATAL);
  says({"'test.bad_model'", "'cloud'", "bound"});
  EXPECT_EQ(dfm_world_stable_step(w, &dt, nullptr, nullptr), DFM_E_FATAL);
  EXPECT_EQ(dfm_world_hash(w), before);
  model_way = Model::behave;
  test::run(w, 0.2, 1e-3);
}

// A law or a model that returns with another rounding mode changes no bit of what the host computes after it.
TEST(StepFailure, RoundingModeLeftByAPlugin_ChangesNoBit) {
  uint64_t hash[2] = {};
  for (const bool rounds : {false, true}) {
    Host h;
    const test::Stack s = test::make_stack(h.c);
    test::ok(test::add_friction(s.world, "test.bad_law"));
    test::BodyOptions o;
    o.name = "cloud";
    o.model = "test.bad_model";
    o.position = {0.7, 0, 0.3};
    test::make_body(h.c, s.world, "beam", {0.1, 0.1, 0.1}, 60, o);
    if (rounds) {
      law_way = Way::rounds;
      model_way = Model::rounds;
    }
    test::run(s.world, 0.05, 1e-3);
    hash[rounds] = dfm_world_hash(s.world);
    EXPECT_EQ(std::fegetround(), FE_TONEAREST);
    EXPECT_EQ(rounds, h.log.find("test.bad_law: eval changed the rounding mode") != std::string::npos)
        << h.log;
    EXPECT_EQ(rounds, h.log.find("test.bad_model: ") != std::string::npos) << h.log;
    law_way = Way::behave;
    model_way = Model::behave;
  }
  EXPECT_EQ(hash[0], hash[1]);
}

// A held point that is moved has a new velocity before the step is known to fail; it is put back.
TEST(StepFailure, WithHeldPointsThatMove_PutsTheirVelocityBack) {
  Host h;
  const dfm_world w = test::make_world(h.c);
  test::BodyOptions o;
  o.name = "cloud";
  o.model = "test.bad_model";
  const dfm_body b = test::make_body(h.c, w, "beam", {0.1, 0.1, 0.1}, 60, o);
  const uint32_t points[] = {0, 1, 2};
  const dfm_sine sine{{0.01, 0.02, 0}, 5, 0.3};
  test::ok(dfm_body_hold(b, 3, points, 7));
  test::ok(dfm_body_move_held(b, 3, points, 0, nullptr, &sine));
  test::run(w, 0.01, 1e-3);
  const uint64_t before = dfm_world_hash(w);
  model_way = Model::fails_forces;
  EXPECT_EQ(dfm_world_step(w, 7e-4, nullptr), DFM_E_DIVERGED);
  EXPECT_EQ(dfm_world_hash(w), before);
  model_way = Model::behave;
}

TEST(StepFailure, OfAModelInCreate_RefusesTheBody) {
  Host h;
  const dfm_world w = test::make_world(h.c);
  const double points[12] = {0, 0, 0, 0.1, 0, 0, 0, 0.1, 0, 0, 0, 0.1};
  const uint32_t cells[4] = {0, 1, 2, 3};
  dfm_body_def d = dfm_body_def_default();
  d.npoint = 4;
  d.ntet = 1;
  d.points = points;
  d.tets = cells;
  d.model = "test.bad_model";
  dfm_body b = 0;
  model_way = Model::throws_create;
  EXPECT_EQ(dfm_body_create(w, &d, &b), DFM_E_FATAL);
  says({"'test.bad_model'", "refused"});
  model_way = Model::fails_create;
  EXPECT_EQ(dfm_body_create(w, &d, &b), DFM_E_NOMEM);
  EXPECT_EQ(b, 0u);
  uint32_t n = 7;
  test::ok(dfm_world_bodies(w, 0, nullptr, &n));
  EXPECT_EQ(n, 0u);
  model_way = Model::behave;
  test::ok(dfm_body_create(w, &d, &b));
  model_way = Model::throws_forces;  // destroy throws too; the host lives
  test::ok(dfm_body_destroy(b));
  EXPECT_NE(h.log.find("destroy threw"), std::string::npos) << h.log;
  model_way = Model::behave;
}

// A plugin's parallel_for inside a worker runs serially there, under our pool and under a host's that does
// not know of workers.
TEST(Tasks, NestedInWorkerThreads_RunSeriallyInTheCaller) {
  for (const bool host_hook : {false, true}) {
    Host h(3, host_hook);
    const dfm_world w = test::make_world(h.c);
    for (int i = 0; i < 6; ++i) {
      test::BodyOptions o;
      o.model = "test.bad_model";
      o.position = {0.3 * i, 0, 0};
      test::make_body(h.c, w, "beam", {0.1, 0.1, 0.1}, 60, o);
    }
    nested_parallel = nested_calls = 0;
    model_way = Model::nested;
    test::run(w, 0.02, 1e-3);
    model_way = Model::behave;
    EXPECT_EQ(nested_calls, 120);
    EXPECT_EQ(nested_parallel, 0) << (host_hook ? "host's hook" : "own pool");
  }
}
