#include "deform/world.h"

#include <algorithm>
#include <cmath>

#include "api/objects.h"
#include "core/lists.h"
#include "cut/planned_cut.h"
#include "cut/separate.h"
#include "cut/tear.h"
#include "cut/tool_cut.h"
#include "deform/deprecated.h"
#include "plugin/context.h"
#include "snapshot/snapshot.h"
#include "state/obstacle.h"
#include "state/tool.h"
#include "step/context.h"
#include "step/stages.h"
#include "step/step_bound.h"
#include "world/create.h"
#include "world/equilibrium.h"
#include "world/explain.h"
#include "world/model_change.h"
#include "world/sensors.h"
#include "world/tool.h"

using namespace dfm;

namespace {

void destroy_world(uint64_t handle) {
  World *const w = static_cast<World *>(handle_find(Kind::world, handle));
  if (!w) return;
  for (auto &b : w->bodies) handle_destroy(b->handle);
  for (auto &b : w->emptied) handle_destroy(b->handle);
  for (auto &b : w->rolled_back) handle_destroy(b->handle);
  for (auto &o : w->obstacles) handle_destroy(o->handle);
  for (auto &m : w->materials) handle_destroy(m->handle);
  for (auto &t : w->tools) handle_destroy(t->handle);
  handle_destroy(handle);
  forget_stop(handle);
  delete w;
}

void check_gravity(const double *g) {
  if (!all_finite(g, 3)) fail(DFM_E_ARG, "gravity is not finite; give m/s2");
}

void check_max_time(double seconds) {
  if (!(seconds >= 0))
    fail(DFM_E_ARG, "max_time is %g s; give the wall time that a step may take, or 0 for no limit", seconds);
}

// Positions are checked only up to a kilometer away, where it could matter.
double shortest_step(const World &w, double dt) {
  double reach = 1;
  if (dt < 1e3 * kShortestStep)
    for (const auto &b : w.bodies)
      for (const double x : b->p.x) reach = std::max(reach, std::fabs(x));
  return kShortestStep * reach;
}

void choose_integrator(World &w) {
  const dfm_world_def &d = w.def;
  if (d.reserved3 != 0)
    fail(DFM_E_UNSUPPORTED, "reserved3, once the contact method, is %d; leave it 0, and choose an integrator",
         d.reserved3);
  if (d.integrator < DFM_INTEGRATOR_AUTO || d.integrator > DFM_INTEGRATOR_TR_BDF2)
    fail(DFM_E_UNSUPPORTED,
         "integrator %d is not available; use DFM_INTEGRATOR_AUTO, DFM_INTEGRATOR_SYMPLECTIC_EULER, "
         "DFM_INTEGRATOR_IMPLICIT_EULER or DFM_INTEGRATOR_TR_BDF2",
         d.integrator);
  if (!(d.step >= 0 && std::isfinite(d.step)))
    fail(DFM_E_ARG, "step is %g; give the length of the steps in s, or 0 (unknown)", d.step);
  if (d.integrator == DFM_INTEGRATOR_AUTO && d.step == 0) w.def.integrator = DFM_INTEGRATOR_SYMPLECTIC_EULER;
  if (!(d.solver_tolerance >= 0 && d.solver_tolerance < 1))
    fail(DFM_E_ARG, "solver_tolerance is %g; it must be 0 (the default) or a relative residual below 1",
         d.solver_tolerance);
  if (d.solver) w.implicit.solver = d.solver;
  if (d.solver_tolerance > 0) w.implicit.tolerance = d.solver_tolerance;
  if (d.newton_iterations) w.implicit.newton = d.newton_iterations;
  w.implicit.solver_iterations = d.solver_iterations;
  w.implicit.tasks = &w.context->tasks;
}

// Refuses words that no loaded plugin and no part of the library provides.
void check_effects(const World &w) {
  std::vector<std::string> known = {kFriction, kGuard, kMemory, kSelfContact};
  for (const dfm_type *type : w.context->registry.list())
    for (const std::string &word : effects(*type)) known.push_back(word);
  sort_unique(known);
  for (const char *const *word = w.def.effects; word && *word; ++word) {
    if (std::find(known.begin(), known.end(), *word) != known.end()) continue;
    fail(DFM_E_ARG, "effect '%s' is asked for, but no loaded plugin provides it%s; provided: %s", *word,
         did_you_mean(*word, known, '\'').c_str(), join(known).c_str());
  }
}

// What the list of effects leaves out of the world itself; bodies and laws follow when they are created.
void select_effects(World &w) {
  check_effects(w);
  w.selection = Selection(w.def.effects, w.context->registry);
  const bool unguarded = w.def.flags & DFM_WORLD_UNGUARDED;
  if (unguarded && w.selection.lists(kGuard))
    fail(DFM_E_ARG,
         "effect 'guard' is asked for, but DFM_WORLD_UNGUARDED (contact.guard false) leaves it out; remove "
         "one of the two");
  if (!w.selection.wants(kGuard) && !unguarded) {
    w.def.flags |= DFM_WORLD_UNGUARDED;
    w.left_out.push_back({kGuard, "contact", "contact.guard"});
  }
  if (!w.selection.wants(kSelfContact) && w.def.self_contact != DFM_SELF_OFF) {
    w.def.self_contact = DFM_SELF_OFF;
    w.left_out.push_back({kSelfContact, "contact", "contact.self"});
  }
  for (const LeftOut &o : w.left_out) warn_of(*w.context, o);
}

}  // namespace

dfm_status dfm_world_create(dfm_context *context, const dfm_world_def *def, dfm_world *out) {
  return as_status([&] {
    need(context, "context");
    need(out, "out");
    auto w = std::make_unique<World>(&used(*context));
    w->def = take_def(def, dfm_world_def_default());
    check_gravity(w->def.gravity);
    if (!(w->def.contact_offset >= 0 && std::isfinite(w->def.contact_offset)) ||
        !(w->def.contact_tolerance >= 0 && std::isfinite(w->def.contact_tolerance)))
      fail(DFM_E_ARG,
           "contact_offset (m) and contact_tolerance (m/s) must be zero (automatic) or positive, and finite; "
           "found %g and %g",
           w->def.contact_offset, w->def.contact_tolerance);
    for (const double speed : {w->def.recovery_speed, w->def.obstacle_speed})
      if (!(speed >= 0 && std::isfinite(speed)))
        fail(DFM_E_ARG,
             "recovery_speed and obstacle_speed must be zero (the default) or positive, and finite; found %g "
             "m/s",
             speed);
    if (w->def.flags & ~uint32_t{DFM_WORLD_UNGUARDED | DFM_WORLD_UNTANGLE})
      fail(DFM_E_ARG, "flags 0x%x: known are DFM_WORLD_UNGUARDED (1) and DFM_WORLD_UNTANGLE (2)",
           w->def.flags);
    if (w->def.max_sweeps == 0 || w->def.max_passes == 0 || w->def.max_substeps == 0)
      fail(DFM_E_ARG, "max_sweeps, max_passes and max_substeps must be at least 1");
    check_max_time(w->def.max_time);
    if (!(w->def.energy_watch >= 0 && std::isfinite(w->def.energy_watch)))
      fail(DFM_E_ARG,
           "energy_watch is %g; it must be a finite share of the largest energy such as 0.01, or 0 (off)",
           w->def.energy_watch);
    if (w->def.sleep > 1) fail(DFM_E_ARG, "sleep is %u; it must be 0 (off) or 1 (on)", w->def.sleep);
    if (w->def.self_contact > DFM_SELF_AUTO)
      fail(DFM_E_ARG, "self_contact is %u; it must be DFM_SELF_OFF (0), DFM_SELF_ON (1) or DFM_SELF_AUTO (2)",
           w->def.self_contact);
    for (const double value : {w->def.sleep_speed, w->def.sleep_time})
      if (!(value > 0 && std::isfinite(value)))
        fail(DFM_E_ARG,
             "sleep_speed (m/s) and sleep_time (s) must be positive and finite; the defaults are 0.01 and "
             "0.5, found %g",
             value);
    choose_integrator(*w);
    select_effects(*w);
    prepare(*w);
    w->changed = true;
    World &made = *w;
    *out = made.handle = keep_live(*context, Kind::world, std::move(w), destroy_world);
  });
}

dfm_status dfm_world_destroy(dfm_world world) {
  return as_status(to_change<world_of>, world, [&](World &w) {
    w.context->remove_live(world);
    Call::now().let_go();
    destroy_world(world);
  });
}

dfm_status dfm_world_set_gravity(dfm_world world, const double gravity[3]) {
  return as_status(to_change<world_of>, world, [&](World &w) {
    need(gravity, "gravity");
    check_gravity(gravity);
    if (w.gravity.keys.empty() && std::equal(gravity, gravity + 3, w.def.gravity)) return;
    store3(w.def.gravity, load3(gravity));
    w.gravity.keys.clear();
    wake_all(w);
    set_gravity_now(w);
    values_changed(w);
  });
}

dfm_status dfm_world_set_gravity_keys(dfm_world world, uint32_t n, const dfm_vector_key *keys) {
  return as_status(to_change<world_of>, world, [&](World &w) {
    if (n) need(keys, "keys");
    std::vector<dfm_vector_key> copy(keys, keys + n);
    check_keys(copy, "gravity");
    w.gravity.keys = std::move(copy);
    wake_all(w);
    set_gravity_now(w);
    values_changed(w);
  });
}

dfm_status dfm_world_set_sleep(dfm_world world, bool sleep) {
  return as_status(whole_to_change, world, [&](World &w) {
    if (w.def.sleep == sleep) return;
    wake_all(w);
    for (auto &b : w.bodies) b->anchor.clear();
    w.def.sleep = sleep;
    w.changed = true;
  });
}

dfm_status dfm_world_step(dfm_world world, double dt, uint32_t *trouble) {
  return as_status(to_change<world_of>, world, [&](World &w) -> dfm_status {
    uint32_t bits = 0;
    if (!trouble) trouble = &bits;
    *trouble = 0;
    if (!(dt > 0 && std::isfinite(dt))) fail(DFM_E_ARG, "a step of %g s; it must be positive and finite", dt);
    if (const double floor = shortest_step(w, dt); dt < floor)
      fail(DFM_E_ARG, "%s", short_step(dt, floor).c_str());
    read_devices(w, w.time + dt);  // may refuse the step
    make_switches(w, dt);
    begin_cuts(w);
    const double before = w.time;
    const dfm_status s = step_within_budget(w, dt, trouble);
    const double passed = w.time - before;
    if (s == DFM_OK) separate_what_waits(w);
    if (s == DFM_OK) cut_by_tools(w, passed);
    if (s == DFM_OK) make_planned_cuts(w, passed);
    if (s == DFM_OK) tear_bodies(w);
    if (s == DFM_OK) update_sensors(w, true);
    if (s == DFM_OK) write_devices(w);
    return s;
  });
}

dfm_status dfm_world_equilibrium(dfm_world world, const dfm_equilibrium_def *def,
                                 dfm_equilibrium_info *info) {
  return as_status(whole_to_change, world, [&](World &w) {
    const dfm_equilibrium_def d = take_def(def, dfm_equilibrium_def_default());
    for (const double value : {d.load_from, d.load_to, d.time, d.tolerance})
      if (!std::isfinite(value) || value < 0)
        fail(DFM_E_ARG, "load_from, load_to, time and tolerance must be finite and not negative; found %g",
             value);
    dfm_equilibrium_info found{};
    found.size = sizeof found;
    make_switches(w, 0);
    find_equilibrium(w, d, found);
    if (info) copy_out(info, found);
  });
}

dfm_status dfm_world_set_budget(dfm_world world, double max_time, uint64_t max_work) {
  return as_status(to_change<world_of>, world, [&](World &w) {
    check_max_time(max_time);
    w.def.max_time = max_time;
    w.def.max_work = max_work;
  });
}

dfm_status dfm_world_interrupt(dfm_world world) {
  // does not use the handle table: a signal may have interrupted it
  if (uint8_t(world >> 32) != uint8_t(Kind::world))
    return as_status([&] {
      fail(DFM_E_HANDLE,
           "world handle 0x%llx is not the handle of a world; pass the handle of the world to interrupt",
           static_cast<unsigned long long>(world));
    });
  return request_stop(world) ? DFM_OK : as_status([] {
    fail(DFM_E_NOMEM,
         "64 other worlds have been interrupted and have not stepped since; step or destroy one of them "
         "first");
  });
}

dfm_status dfm_world_stable_step(dfm_world world, double *dt, dfm_body *body, uint32_t *point) {
  return as_status(whole_to_change, world, [&](World &w) {
    need(dt, "dt");
    prepare(w);
    // The bound that the next step uses, recomputed only when the step would recompute it, so that reading it
    // changes no result.
    if (bound_expired(w)) update_bound(w);
    *dt = offered_step(w.sizes, w.bound.step);
    const auto accurate = [](const auto &b) { return b->dynamics->abilities().accurate; };
    if (std::any_of(w.bodies.begin(), w.bodies.end(), accurate)) *dt = std::min(*dt, accurate_step(w.sizes));
    if (body) *body = w.bound.body ? w.bound.body->handle : 0;
    if (point) *point = w.bound.point;
  });
}

dfm_status dfm_world_overlaps_sized(dfm_world world, uint32_t row_size, uint32_t capacity, dfm_overlap *out,
                                    uint32_t *n) {
  return as_status([&] {
    Rows<dfm_overlap> rows(out, row_size, "dfm_overlap");
    World &w = exclusive(world_of(world));
    prepare(w);
    if (!room(w.overlaps.found.size(), capacity, out, n)) return;
    for (const Overlap &o : w.overlaps.found) {
      const uint32_t aside = o.suspended && !o.separated ? DFM_OVERLAP_ASIDE : 0;
      const uint32_t parted = o.separated ? DFM_OVERLAP_SEPARATED : 0;
      const uint32_t flags = (o.obstacle ? uint32_t{DFM_OVERLAP_OBSTACLE} : 0) | aside | parted;
      rows.add({0, flags, w.handle_of(o.a), w.handle_of(o.b), o.crossings, o.enclosed, o.depth});
    }
  });
}

dfm_status dfm_world_find_overlaps(dfm_world world, uint32_t *n) {
  return as_status(whole_to_change, world, [&](World &w) {
    prepare(w);
    const bool reported = w.overlaps.reported;
    const Overlaps::Mode mode(w.overlaps, &Overlaps::report_only);
    prepare(w);
    w.overlaps.reported = reported;
    if (n) *n = static_cast<uint32_t>(w.overlaps.found.size());
  });
}

dfm_status dfm_world_untangle(dfm_world world, uint32_t *left) {
  return as_status(whole_to_change, world, [&](World &w) {
    const Overlaps::Mode mode(w.overlaps, &Overlaps::untangle);
    prepare(w);
    const auto &found = w.overlaps.found;
    if (left)
      *left = static_cast<uint32_t>(
          std::count_if(found.begin(), found.end(), [](const Overlap &o) { return !o.separated; }));
  });
}

double dfm_world_time(dfm_world world) {
  const World *const w = static_cast<World *>(handle_find(Kind::world, world));
  return w ? w->time : NAN;
}

uint64_t dfm_world_hash(dfm_world world) {
  uint64_t hash = 0;
  as_status([&] { hash = world_hash(whole(not_in_step(world_of(world)))); });
  return hash;
}

dfm_status dfm_world_snapshot(dfm_world world, void *buffer, size_t *bytes) {
  return as_status(whole_to_change, world, [&](World &w) {
    prepare(w);
    std::vector<unsigned char> data;
    world_snapshot(w, data);
    copy_bytes(data.data(), data.size(), buffer, bytes);
  });
}

dfm_status dfm_world_restore(dfm_world world, const void *buffer, size_t bytes) {
  return as_status(whole_to_change, world, [&](World &w) {
    need(buffer, "buffer");
    world_restore(w, buffer, bytes);
    update_sensors(w, false);
  });
}

dfm_status dfm_world_find_body(dfm_world world, const char *name, dfm_body *out) {
  return as_status(world_of, world, [&](World &w) {
    need(name, "name");
    need(out, "out");
    if (const Body *const b = w.find_body(name)) *out = b->handle;  // one without cells, too
    else find_named(w.bodies, "body", name, out);
  });
}

dfm_status dfm_world_bodies(dfm_world world, uint32_t capacity, dfm_body *bodies, uint32_t *n) {
  return as_status(world_of, world, [&](World &w) { copy_list(w.bodies, capacity, bodies, n, kHandle); });
}

dfm_status dfm_world_obstacles(dfm_world world, uint32_t capacity, dfm_obstacle *obstacles, uint32_t *n) {
  return as_status(world_of, world,
                   [&](World &w) { copy_list(w.obstacles, capacity, obstacles, n, kHandle); });
}

dfm_status dfm_world_get_stats(dfm_world world, dfm_world_stats *out) {
  return as_status(world_of, world, [&](const World &w) {
    dfm_world_stats s = w.stats;
    s.rebuilds = w.steps->broad.stats().rebuilds;
    s.refits = w.steps->broad.stats().refits;
    // not in snapshots: lists are rebuilt after a restore, and may then be shorter
    s.pairs_tested = static_cast<uint32_t>(w.steps->broad.candidates().size());
    s.threads = w.context->tasks.threads();
    s.time = w.time;
    s.asleep = w.sleepers;
    copy_out(out, s);
  });
}

dfm_status dfm_world_profile_sized(dfm_world world, uint32_t row_size, uint32_t capacity, dfm_stage_time *out,
                                   uint32_t *n) {
  return as_status([&] {
    Rows<dfm_stage_time> rows(out, row_size, "dfm_stage_time");
    World &w = exclusive(world_of(world));
    prepare(w);
    if (!room(w.plan.stages.size(), capacity, out, n)) return;
    for (size_t i = 0; i < w.plan.stages.size(); ++i) {
      const size_t row = w.plan.stages[i].row;
      const StageTime &time = w.steps->stage_times[row];
      rows.add({stage_table()[row].name, time.seconds, time.calls});
    }
  });
}

dfm_status dfm_world_explain(dfm_world world, char *text, size_t *bytes) {
  return as_status(to_change<world_of>, world, [&](World &w) {
    prepare(w);
    if (bound_expired(w)) update_bound(w);
    const std::string json = explain(w);
    copy_bytes(json.c_str(), json.size() + 1, text, bytes);
  });
}

dfm_status dfm_world_memory(dfm_world world, dfm_memory *out) {
  return as_status([&] {
    const Meters &m = world_of(world).meters;
    dfm_memory all{};
    all.bodies = m.bodies.bytes();
    all.dynamics = m.dynamics.bytes();
    all.obstacles = m.obstacles.bytes();
    all.detection = m.detection.bytes();
    all.contacts = m.contacts.bytes();
    all.steps = m.steps.bytes();
    all.total = all.bodies + all.dynamics + all.obstacles + all.detection + all.contacts + all.steps;
    copy_out(out, all);
  });
}
