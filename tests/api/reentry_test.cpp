// A hook, a law or a rigid host that calls back into the library while a call runs: whatever would destroy or
// change what that call works on answers DFM_E_BUSY and does nothing, and the call goes on to its end. Run
// under the address sanitizer, where a use after free ends the program.
#include <functional>
#include <map>

#include "deform/plugin.hpp"
#include "obstacle.h"
#include "rigid.h"

namespace {

// What the hooks do when they are called, and how often each was called.
std::function<void()> attack;
bool attacking = false;
std::map<std::string, int> called;

void hook(const char *name) {
  if (!attack || attacking) return;
  attacking = true;
  ++called[name];
  attack();
  attacking = false;
}

dfm_status eval(const dfm_friction_in *in, dfm_friction_out *out) {
  hook("law");
  for (uint32_t i = 0; i < in->n; ++i) {
    if (out->ft) out->ft[i] = out->ft[in->stride + i] = 0;
    if (out->limit) out->limit[i] = 0;
    if (out->mode) out->mode[i] = 2;
    for (uint32_t k = 0; out->dft_dvt && k < 4; ++k) out->dft_dvt[k * in->stride + i] = 0;
    for (uint32_t k = 0; out->dft_dfn && k < 2; ++k) out->dft_dfn[k * in->stride + i] = 0;
  }
  return DFM_OK;
}
const dfm_friction law_table = [] {
  dfm_friction t{};
  t.size = sizeof t;
  t.eval = eval;
  return t;
}();

// A host whose bodies never move, and which calls back from each of its entries.
dfm_status host_create(void *, const dfm_rigid_set_def *set, void **self, uint32_t *group, uint32_t *nextra) {
  hook("host create");
  for (uint32_t i = 0; i < set->nbody; ++i) group[i] = i;
  *self = reinterpret_cast<void *>(uintptr_t{1});
  *nextra = 0;
  return DFM_OK;
}
void host_destroy(void *) { hook("host destroy"); }
dfm_status host_predict(void *, const dfm_rigid_step *, double *) {
  hook("host predict");
  return DFM_OK;
}
dfm_status host_respond(void *, const dfm_rigid_step *, uint32_t, double *matrix) {
  hook("host respond");
  for (int i = 0; i < 36; ++i) matrix[i] = i % 7 == 0;
  return DFM_OK;
}
dfm_status host_commit(void *, const dfm_rigid_step *step, const double *, dfm_rigid_state *state, double *) {
  hook("host commit");
  std::copy(step->state, step->state + step->nbody, state);
  return DFM_OK;
}
dfm_status host_motor(void *, uint32_t, double, double, double *) {
  hook("host set_motor");
  return DFM_OK;
}
dfm_status host_joint(void *, const dfm_rigid_state *, const double *, uint32_t, double *p, double *r,
                      double *e) {
  hook("host joint");
  *p = *r = *e = 0;
  return DFM_OK;
}

struct Scene {
  dfm_context *c = nullptr;
  dfm_world w = 0;
  dfm_body body = 0;
  dfm_obstacle floor = 0;
  dfm_rigid rigid = 0;
  dfm_material material = 0;
  dfm_law law = 0;
  std::string snapshot;

  Scene() {
    dfm_context_def d = dfm_context_def_default();
    d.plugin_dir = DEFORM_PLUGIN_DIR;
    d.log = [](void *, int32_t, const char *) { hook("log"); };
    d.alloc = [](void *, size_t bytes, size_t align) -> void * {
      hook("alloc");
      return std::aligned_alloc(align, (bytes + align) / align * align);
    };
    d.release = [](void *, void *p, size_t, size_t) {
      hook("release");
      std::free(p);
    };
    d.parallel_for = [](void *, uint32_t n, uint32_t, void (*fn)(void *, uint32_t, uint32_t), void *task) {
      hook("parallel_for");
      fn(task, 0, n);
    };
    d.trace_begin = [](void *, const char *) { hook("trace_begin"); };
    d.trace_end = [](void *, const char *) { hook("trace_end"); };
    EXPECT_EQ(dfm_context_create(&d, &c), DFM_OK) << dfm_last_error();
    static const dfm_type type = dfm::plugin::type(DFM_KIND_FRICTION, "test.calling", "calling", "1", "MIT",
                                                   "test", nullptr, &law_table);
    static const dfm_type *const types[] = {&type};
    static dfm_plugin plugin{};
    plugin.size = sizeof plugin;
    plugin.abi = DFM_ABI;
    plugin.abi_draft = DFM_ABI_DRAFT;
    plugin.ntype = 1;
    plugin.types = types;
    const dfm_plugin_fn entry = [](const dfm_host *, uint32_t, uint32_t) -> const dfm_plugin * {
      hook("plugin entry");
      return &plugin;
    };
    test::ok(dfm_plugin_register_static(c, entry, "calling"));
    w = test::make_world(c);
    floor = test::add_plane(w, "floor");
    test::ok(test::add_friction(w, "test.calling"));
    test::BodyOptions o;
    o.name = "block";
    o.young = 2e5;
    o.damping_stiffness = 2e-3;
    o.position = {0, 0, 4e-5};
    body = test::make_body(c, w, "beam", {0.1, 0.1, 0.1}, 60, o);
    material = test::make_material(w, o);
    dfm_joint_def hinge = test::joint(DFM_JOINT_HINGE, 0, DFM_RIGID_WORLD, {0, 0, 0.12}, {0, 1, 0});
    rigid = test::create(w, {test::box("plate", {0.2, 0.2, 0.02}, 1, {0, 0, 0.1201})}, {hinge}, "calling")[0];
    test::ok(dfm_law_open(c, "test.calling", &law));
    for (int i = 0; i < 5; ++i) test::ok(dfm_world_step(w, 1e-4, nullptr));
    snapshot = test::snapshot(w);
  }
  ~Scene() {
    attack = nullptr;
    dfm_context_destroy(c);
  }
};

using Calls = std::vector<std::pair<const char *, std::function<dfm_status()>>>;

// Everything that destroys or changes a world, and what reads arrays that a step has in pieces.
Calls world_calls(Scene &s, bool step_only) {
  static const double up[3] = {0, 0, 1}, zero[3] = {0, 0, 0};
  static const uint32_t point = 0;
  static const dfm_pose pose{{0, 0, 0}, {0, 0, 0, 1}};
  static uint64_t made = 0;
  static uint32_t n = 0;
  static size_t bytes = 0;
  Calls all = {
      {"world_destroy", [&] { return dfm_world_destroy(s.w); }},
      {"world_step", [&] { return dfm_world_step(s.w, 1e-4, nullptr); }},
      {"world_restore", [&] { return dfm_world_restore(s.w, s.snapshot.data(), s.snapshot.size()); }},
      {"world_snapshot",
       [&] {
         bytes = 0;
         return dfm_world_snapshot(s.w, nullptr, &bytes);
       }},
      {"world_explain",
       [&] {
         bytes = 0;
         return dfm_world_explain(s.w, nullptr, &bytes);
       }},
      {"world_profile", [&] { return dfm_world_profile(s.w, 0, nullptr, &n); }},
      {"world_stable_step",
       [&] {
         double dt;
         return dfm_world_stable_step(s.w, &dt, nullptr, nullptr);
       }},
      {"world_set_gravity", [&] { return dfm_world_set_gravity(s.w, up); }},
      {"world_set_gravity_keys", [&] { return dfm_world_set_gravity_keys(s.w, 0, nullptr); }},
      {"world_set_sleep", [&] { return dfm_world_set_sleep(s.w, true); }},
      {"world_filter_pair", [&] { return dfm_world_filter_pair(s.w, "*", "*", false); }},
      {"world_remove_filter", [&] { return dfm_world_remove_filter(s.w, "*", "*"); }},
      {"world_set_friction",
       [&] {
         const dfm_params p{sizeof p, 0, nullptr};
         return dfm_world_set_friction(s.w, "*", "*", &p);
       }},
      {"world_remove_friction", [&] { return dfm_world_remove_friction(s.w, "*", "*"); }},
      {"world_add_friction",
       [&] {
         dfm_friction_def f{};
         f.size = sizeof f;
         f.between[0] = f.between[1] = "*";
         f.law = "none";
         return dfm_world_add_friction(s.w, &f);
       }},
      {"world_swaps", [&] { return dfm_world_swaps(s.w, 0, nullptr, &n); }},
      {"world_events", [&] { return dfm_world_events(s.w, 0, nullptr, &n); }},
      {"world_hold_begin", [&] { return dfm_world_hold_begin(s.w); }},
      {"world_set_may_touch", [&] { return dfm_world_set_may_touch(s.w, nullptr, nullptr); }},
      {"world_ask_again", [&] { return dfm_world_ask_again(s.w, 0, 0); }},
      {"world_set_pre_solve", [&] { return dfm_world_set_pre_solve(s.w, nullptr, nullptr); }},
      {"body_set_sensor", [&] { return dfm_body_set_sensor(s.body, true); }},
      {"obstacle_set_sensor", [&] { return dfm_obstacle_set_sensor(s.floor, true); }},
      {"body_create",
       [&] {
         static const double x[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
         static const uint32_t tets[] = {0, 1, 2, 3};
         dfm_body_def d = dfm_body_def_default();
         d.npoint = 4;
         d.ntet = 1;
         d.points = x;
         d.tets = tets;
         return dfm_body_create(s.w, &d, &made);
       }},
      {"body_destroy", [&] { return dfm_body_destroy(s.body); }},
      {"body_set_filter", [&] { return dfm_body_set_filter(s.body, 1, 1); }},
      {"body_attach",
       [&] {
         const dfm_attach_def d = dfm_attach_def_default();
         return dfm_body_attach(s.body, &d, nullptr);
       }},
      {"body_detach", [&] { return dfm_body_detach(s.body, 1); }},
      {"body_set_state",
       [&] {
         const std::vector<double> x(300);
         return dfm_body_set_state(s.body, 1, x.data(), x.data());
       }},
      {"body_hold", [&] { return dfm_body_hold(s.body, 1, &point, 7); }},
      {"body_move_held",
       [&] {
         const dfm_sine sine{};
         return dfm_body_move_held(s.body, 1, &point, 0, nullptr, &sine);
       }},
      {"body_add_load",
       [&] { return dfm_body_add_load(s.body, 1, &point, up, 0, nullptr, nullptr, nullptr); }},
      {"body_remove_load", [&] { return dfm_body_remove_load(s.body, 1); }},
      {"body_add_spring",
       [&] {
         const dfm_spring_def d{sizeof d, 1, &point, nullptr, {}, nullptr, 0, 0, 1, 0};
         return dfm_body_add_spring(s.body, &d, nullptr);
       }},
      {"body_remove_spring", [&] { return dfm_body_remove_spring(s.body, 1); }},
      {"body_apply_impulse", [&] { return dfm_body_apply_impulse(s.body, zero, up); }},
      {"body_set_params",
       [&] {
         const dfm_params p{sizeof p, 0, nullptr};
         return dfm_body_set_params(s.body, &p);
       }},
      {"body_set_model", [&] { return dfm_body_set_model(s.body, "msm", nullptr); }},
      {"body_set_switch_rule", [&] { return dfm_body_set_switch_rule(s.body, nullptr); }},
      {"body_set_interest", [&] { return dfm_body_set_interest(s.body, up); }},
      {"body_set_switches", [&] { return dfm_body_set_switches(s.body, 0, nullptr); }},
      {"body_wake", [&] { return dfm_body_wake(s.body); }},
      {"obstacle_create",
       [&] {
         const dfm_obstacle_def d = dfm_obstacle_def_default();
         return dfm_obstacle_create(s.w, &d, &made);
       }},
      {"obstacle_destroy", [&] { return dfm_obstacle_destroy(s.floor); }},
      {"obstacle_move_to", [&] { return dfm_obstacle_move_to(s.floor, &pose); }},
      {"obstacle_set_velocity_surface", [&] { return dfm_obstacle_set_velocity_surface(s.floor, up); }},
      {"obstacle_set_filter", [&] { return dfm_obstacle_set_filter(s.floor, 1, 2); }},
      {"obstacle_set_material", [&] { return dfm_obstacle_set_material(s.floor, s.material); }},
      {"material_create", [&] { return dfm_material_create(s.w, nullptr, &made); }},
      {"material_destroy", [&] { return dfm_material_destroy(s.material); }},
      {"rigid_create",
       [&] {
         const dfm_rigid_def d = test::box("another", {1, 1, 1}, 1, {9, 9, 9});
         const dfm_rigid_set_def set = {sizeof set, 1, 0, 0, &d, nullptr, nullptr};
         return dfm_rigid_create(s.w, "calling", &set, &made);
       }},
      {"rigid_destroy", [&] { return dfm_rigid_destroy(s.rigid); }},
      {"rigid_add_shape",
       [&] {
         const dfm_obstacle_def d = dfm_obstacle_def_default();
         return dfm_rigid_add_shape(s.rigid, &d, &made);
       }},
      {"rigid_set_state",
       [&] {
         const dfm_rigid_state state{{0, 0, 1}, {0, 0, 0, 1}, {}, {}};
         return dfm_rigid_set_state(s.rigid, &state);
       }},
      {"rigid_set_motor", [&] { return dfm_rigid_set_motor(s.rigid, 0, 0, 0); }},
  };
  if (step_only)
    all.insert(all.end(),
               {{"world_contacts", [&] { return dfm_world_contacts(s.w, 0, nullptr, &n); }},
                {"world_pairs", [&] { return dfm_world_pairs(s.w, 0, nullptr, &n); }},
                {"world_law_info",
                 [&] {
                   dfm_law_info info{};
                   return dfm_world_law_info(s.w, 0, &info);
                 }},
                {"world_query",
                 [&] {
                   const dfm_query_shape q = dfm_query_shape_default();
                   dfm_query_hits hits{sizeof hits, sizeof(dfm_query_hit), 0, 0, nullptr};
                   return dfm_world_query(s.w, &q, nullptr, 0, nullptr, nullptr, &hits);
                 }},
                {"surface_vertices", [&] { return dfm_surface_vertices(s.body, nullptr, 0, nullptr, &n); }},
                {"body_get_state", [&] { return dfm_body_get_state(s.body, 0, nullptr, nullptr, &n); }},
                {"debug_displacements", [&] { return dfm_debug_displacements(s.body, 0, nullptr, &n); }},
                {"sensor_things", [&] { return dfm_sensor_things(s.body, 0, nullptr, &n); }},
                {"world_hold",
                 [&] {
                   double creep;
                   return dfm_world_hold(s.w, &creep, &n);
                 }},
                {"debug_draw", [&] {
                   return dfm_debug_draw(
                       s.w, 7, [](void *, const double *, const double *, uint32_t) {}, nullptr);
                 }}});
  return all;
}

// Of the context: what changes its plugins. Destroying it answers nothing; that it still lives
// is what follows.
Calls context_calls(Scene &s) {
  return {
      {"plugin_load", [&] { return dfm_plugin_load(s.c, "/nonexistent.so"); }},
      {"plugin_scan", [&] { return dfm_plugin_scan(s.c, "/nonexistent", nullptr); }},
      {"plugin_register_static",
       [&] {
         return dfm_plugin_register_static(
             s.c, [](const dfm_host *, uint32_t, uint32_t) -> const dfm_plugin * { return nullptr; }, "x");
       }},
      {"context_destroy", [&] {
         dfm_context_destroy(s.c);
         return std::string(dfm_last_error()).find("nothing was destroyed") != std::string::npos ? DFM_E_BUSY
                                                                                                 : DFM_OK;
       }}};
}

// Runs `call` with each of `calls` made from every hook that it meets. All must be refused, and the call end
// as it would have.
void walk(const std::function<dfm_status()> &call, const Calls &calls,
          const std::vector<std::string> &hooks) {
  called.clear();
  std::map<std::string, int> wrong;
  attack = [&] {
    for (const auto &[name, f] : calls)
      if (const dfm_status s = f(); s != DFM_E_BUSY)
        ++wrong[std::string(name) + ": " + dfm_status_name(s) + ": " + dfm_last_error()];
  };
  const dfm_status status = call();
  attack = nullptr;
  EXPECT_EQ(status, DFM_OK) << dfm_last_error();
  for (const auto &[what, times] : wrong) ADD_FAILURE() << what << " (" << times << " times)";
  for (const std::string &hook : hooks)
    EXPECT_GT(called[hook], 0) << hook << " was not called: the walk would show little";
}

struct Reentry : testing::Test {
  static void SetUpTestSuite() {
    dfm_rigid_host host{};
    host.size = sizeof host;
    host.create = host_create;
    host.destroy = host_destroy;
    host.predict = host_predict;
    host.respond = host_respond;
    host.commit = host_commit;
    host.set_motor = host_motor;
    host.joint = host_joint;
    test::ok(dfm_rigid_host_register("calling", &host));
  }
  Scene s;
};

Calls both(Scene &s, bool step_only = true) {
  Calls all = world_calls(s, step_only);
  for (const auto &c : context_calls(s)) all.push_back(c);
  return all;
}

}  // namespace

TEST_F(Reentry, FromEveryHookOfAStep_IsBusy) {
  walk([&] { return dfm_world_step(s.w, 1e-4, nullptr); }, both(s),
       {"trace_begin", "trace_end", "law", "host predict", "host respond", "host commit"});
  test::ok(dfm_world_step(s.w, 1e-4, nullptr));
}

TEST_F(Reentry, FromTheAllocatorOfAFirstStep_IsBusy) {
  test::BodyOptions o;
  o.name = "second";
  o.position = {0.5, 0, 4e-5};
  test::make_body(s.c, s.w, "beam", {0.1, 0.1, 0.1}, 60, o);
  walk([&] { return dfm_world_step(s.w, 1e-4, nullptr); }, both(s), {"alloc", "release"});
}

TEST_F(Reentry, FromHooksOfCreation_IsBusy) {
  const Calls all = both(s);
  walk(
      [&] {
        const dfm_rigid_def d = test::box("new", {0.1, 0.1, 0.1}, 1, {9, 0, 1});
        const dfm_rigid_set_def set = {sizeof set, 1, 0, 0, &d, nullptr, nullptr};
        dfm_rigid made = 0;
        return dfm_rigid_create(s.w, "calling", &set, &made);
      },
      all, {"host create"});
  walk(
      [&] {
        const test::Triangles rock = test::box_surface({0.2, 0.2, 0.05}, 1);
        dfm_obstacle_def d = test::mesh_def("rock", rock, DFM_SHAPE_VOXELS, 64);
        d.pose.position[2] = -1;
        dfm_obstacle made = 0;
        return dfm_obstacle_create(s.w, &d, &made);
      },
      all, {"alloc", "log"});
  // of a world that has changed since
  walk(
      [&] {
        return dfm_world_restore(s.w, s.snapshot.data(), s.snapshot.size()) == DFM_E_FORMAT ? DFM_OK
                                                                                            : DFM_E_FATAL;
      },
      all, {});
}

TEST_F(Reentry, FromTheHostsFunctions_IsBusy) {
  double x = 0;
  walk([&] { return dfm_rigid_joint(s.rigid, 0, &x, &x, &x); }, both(s, false), {"host joint"});
  walk([&] { return dfm_rigid_set_motor(s.rigid, 0, 1, 1); }, both(s), {"host set_motor"});
}

TEST_F(Reentry, FromADebugLine_IsBusyButMayLook) {
  int lines = 0;
  walk(
      [&] {
        return dfm_debug_draw(
            s.w, 7,
            [](void *count, const double *, const double *, uint32_t) {
              ++*static_cast<int *>(count);
              hook("line");
            },
            &lines);
      },
      both(s, false), {"line"});
  EXPECT_GT(lines, 12);
  uint32_t n = 0;
  dfm_status looked = DFM_E_FATAL;
  attack = [&] { looked = dfm_world_contacts(s.w, 0, nullptr, &n); };
  test::ok(dfm_debug_draw(
      s.w, 7, [](void *, const double *, const double *, uint32_t) { hook("line"); }, nullptr));
  EXPECT_EQ(looked, DFM_OK);
}

TEST_F(Reentry, FromAPluginVisitOrEntry_IsBusy) {
  const Calls calls = context_calls(s);
  walk(
      [&] {
        return dfm_plugin_visit(s.c, [](void *, const dfm_type *, const char *) { hook("visit"); }, nullptr);
      },
      calls, {"visit"});
  walk(
      [&] {
        return dfm_plugin_register_static(
                   s.c,
                   [](const dfm_host *host, uint32_t, uint32_t) -> const dfm_plugin * {
                     host->log(host->ctx, 2, 0, "hello");
                     return nullptr;
                   },
                   "silent") == DFM_E_UNSUPPORTED
                   ? DFM_OK
                   : DFM_E_FATAL;
      },
      calls, {"log"});
}

TEST_F(Reentry, ALaw_IsNotClosedBeneathItsEvaluation) {
  alignas(64) const double zeros[16] = {};
  alignas(64) double out[16];
  dfm_friction_in in{};
  in.size = sizeof in;
  in.n = 1;
  in.stride = 8;
  in.dt = 1e-3;
  in.vt = in.fn = in.ft_stop = in.area = in.dwell = in.params = zeros;
  dfm_friction_out output{};
  output.size = sizeof output;
  output.ft = out;
  walk([&] { return dfm_law_eval(s.law, &in, &output); },
       {{"law_close", [&] { return dfm_law_close(s.law); }}, context_calls(s).back()}, {"law"});
}

TEST_F(Reentry, AHookThatDestroysTheContextWhileItEnds_IsRefused) {
  Scene other;
  const dfm_context *const c = other.c;
  called.clear();
  attack = [&] { dfm_context_destroy(other.c); };
  dfm_context_destroy(other.c);
  attack = nullptr;
  EXPECT_EQ(c, other.c);
  EXPECT_GT(called["release"] + called["host destroy"], 0);
  other.c = nullptr;
}
