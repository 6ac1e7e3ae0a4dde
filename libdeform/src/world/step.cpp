// One step, from top to bottom:
//
//   bound -> n sub-steps of { motion -> model -> predict -> broad -> narrow -> self -> contact <-> friction -> distribute -> guard -> commit -> sleep }
//
// The list of stages is the plan's (plan/plan.cpp): what a scene does not call for is not in it (and rollback.cpp stands for narrow to distribute
// where it is asked for). Sub-steps are equal and the contact solve
// runs in each; detection keeps its candidate lists while nothing has moved further than their skin.
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <limits>
#include <utility>

#include "core/error.h"
#include "integrate/symplectic_euler.h"
#include "surfel/make_surface.h"
#include "world/bounds.h"
#include "world/spring.h"
#include "world/step_sizes.h"
#include "world/world.h"

namespace dfm {
namespace {

// The bound depends on the state (volume terms stiffen as cells grow, tilted springs as they stretch). 0.9 of it is used, which pays for what a
// shape changes by about a twentieth of its lengths; so it is asked for again after 16 sub-steps, sooner where the edges stretch faster.
constexpr uint32_t kBoundEvery = 16;
constexpr double kBoundShare = 0.9, kBoundStrain = 0.05;

// The first body, in id order, for which something failed: the same for every cut of the bodies over threads.
struct FirstFailure {
  std::atomic<uint32_t> body{kNone};
  void note(uint32_t i) {
    uint32_t seen = body;
    while (i < seen && !body.compare_exchange_weak(seen, i)) {}
  }
};

class StageTimer {
 public:
  StageTimer(World &w, StageId id) : w_(w), id_(id), start_(std::chrono::steady_clock::now()) {
    w_.context->trace_begin(stage_name(id_));
  }
  ~StageTimer() {
    w_.context->trace_end(stage_name(id_));
    w_.stage_seconds[size_t(id_)] += std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
    ++w_.stage_calls[size_t(id_)];
  }

 private:
  World &w_;
  StageId id_;
  std::chrono::steady_clock::time_point start_;
};

uint32_t inverted_cells(const Body &b) {
  uint32_t n = 0;
  for (size_t t = 0; t < b.tets.size(); t += 4) n += tet_volume(b.p.x.data(), kStride, &b.tets[t]) < 0;
  return n;
}

// The fastest stretch of an edge, 1/s; turning gives none.
double strain_rate(const Body &b) {
  const double *const x = b.p.x.data(), *const v = b.p.v.data();
  double most = 0;
  for (size_t e = 0; e < b.edges.size(); e += 2) {
    const size_t i = size_t(b.edges[e]) * kStride, j = size_t(b.edges[e + 1]) * kStride;
    const Vec3 d = load3(x + j) - load3(x + i);
    const double dd = norm2(d), stretch = std::fabs(dot(d, load3(v + j) - load3(v + i)));
    if (stretch > most * dd) most = dd > 0 ? stretch / dd : most;
  }
  return most;
}

// One stage; false: the sub-step cannot be taken, and nothing of it has been committed.
bool run_stage(World &w, StageId id, uint32_t *trouble) {
  StageTimer timer(w, id);
  switch (id) {
    case StageId::motion: w.stage_motion(); return true;
    case StageId::model: return w.stage_model(trouble);
    case StageId::predict: return w.stage_predict(trouble) && watch_energy(w, trouble);
    case StageId::gather: w.stage_gather(); return true;
    case StageId::broad: w.stage_broad(); return true;
    case StageId::narrow: return w.stage_narrow(trouble);
    case StageId::self: w.stage_self(); return true;
    case StageId::solve: return w.stage_solve(trouble);
    case StageId::distribute: w.stage_distribute(); return true;
    case StageId::guard: return w.stage_guard(trouble);
    case StageId::lagged: w.stage_lagged(); return true;
    case StageId::rollback: return w.stage_rollback(trouble);
    case StageId::commit: return w.stage_commit(trouble);
    case StageId::rigid_predict: return w.stage_rigid_predict(trouble);
    case StageId::rigid_commit: return w.stage_rigid_commit(trouble);
    case StageId::sleep: w.stage_sleep(); return true;
    case StageId::step: return true;
  }
  return true;
}

// Pose now and at the end of the sub-step, as the velocity and spin that lead from one to the other.
void view_obstacles(World &w, double t, double h, double left) {
  for (size_t i = 0; i < w.obstacles.size(); ++i) {
    const Obstacle &o = *w.obstacles[i];
    ObstacleView &v = w.obstacle_views[i];
    v.position = o.pose.position, v.rotation = o.pose.rotation;
    v.velocity = v.spin = v.linear = {};
    if (o.has_target) {
      v.velocity = (1 / left) * (o.target.position - o.pose.position);
      v.spin = spin_between(o.pose.rotation, o.target.rotation, left);
    } else if (o.moves()) {
      const Pose end = o.pose_at_time(t + h);
      v.velocity = (1 / h) * (end.position - o.pose.position);
      v.spin = spin_between(o.pose.rotation, end.rotation, h);
    }
    if (o.mesh) o.mesh->place(v.position, v.rotation, v.velocity, v.spin);
  }
}

// Where the obstacles are at the end of the sub-step; `last`: of the step, so that a target is met exactly.
void move_obstacles(World &w, double t, double h, double left, bool last) {
  for (auto &o : w.obstacles) {
    if (o->has_target || o->moves()) o->pose = last && o->has_target ? o->target : o->end_pose(t, h, left);
    if (last) o->has_target = false;
  }
}

// Where the guard let the bodies go a share of their way only. Obstacles come to their poses in the sub-steps after.
void move_obstacles_by(World &w, double share) {
  for (auto &o : w.obstacles) {
    if (!o->has_target && !o->moves()) continue;
    const Pose end = o->end_pose(w.time, w.h, w.left);
    o->pose = {o->pose.position + share * (end.position - o->pose.position), slerp(o->pose.rotation, end.rotation, share)};
  }
}

}  // namespace

Pose Obstacle::end_pose(double t, double h, double left) const {
  if (rigid) return shape_pose(*this, rigid->next[rigid_body]);
  if (!has_target) return moves() ? pose_at_time(t + h) : pose;
  const double s = h / left;
  return {pose.position + s * (target.position - pose.position), slerp(pose.rotation, target.rotation, s < 1 ? s : 1)};
}

dfm_status World::step(double dt, uint32_t *trouble) {
  prepare();
  check_target_speeds(*this, dt);
  release_overlaps(*this);
  if (!std::exchange(overlaps.told, true)) *trouble |= DFM_TROUBLE_OVERLAP;
  if (bound_due()) update_bound();
  const double needed = std::ceil(dt / stable - 1e-9);   // stable is infinite where nothing bounds the step
  if (!(needed <= def.max_substeps)) {
    set_last_error(format("a step of %g s needs %g sub-steps of %g s (max_substeps %u): soften or coarsen body '%s', whose point %u bounds the step, lower "
                          "its damping, or take a shorter step", dt, needed, stable, def.max_substeps, worst_body ? worst_body->name.c_str() : "?", worst_point).c_str());
    return *trouble |= DFM_TROUBLE_SUBSTEPS, DFM_DISCARD;
  }
  const StepSizes before = sizes;
  const uint32_t n = static_cast<uint32_t>(std::min<double>(def.max_substeps, choose_pieces(sizes, dt, stable)));
  watch.new_size = earned(before, sizes, stable);
  plan_work(*this, n);
  if (n > 1) *trouble |= DFM_TROUBLE_SUBSTEPS;
  if (inverted) *trouble |= DFM_TROUBLE_INVERTED;

  begin_impulses(step_impulses);
  const double goal = time + dt;
  double from = time, span = dt;   // `cut` equal sub-steps since `from`; the rest of the step is cut finer where the bound has fallen
  uint32_t cut = n, done = 0;
  for (uint32_t k = 0; k < cut; ++k, ++done) {
    if (bound_due()) {
      update_bound();
      if (inverted) *trouble |= DFM_TROUBLE_INVERTED;
      const double more = (cut - k) * cut_finer(sizes, span / cut, stable);
      if (!(done + more <= def.max_substeps)) {
        set_last_error(format("step %llu: the shape of body '%s' has changed so much that the rest of the step needs %g sub-steps of %g s "
                              "(max_substeps %u); take a shorter step", static_cast<unsigned long long>(step_count),
                              worst_body ? worst_body->name.c_str() : "?", std::ceil((goal - time) / stable), stable, def.max_substeps).c_str());
        return DFM_E_DIVERGED;
      }
      if (more > cut - k) from = time, span = goal - time, cut = static_cast<uint32_t>(more), k = 0, watch.new_size = true, *trouble |= DFM_TROUBLE_SUBSTEPS;
    }
    const bool last = k + 1 == cut;
    const double end = last ? goal : from + span * (double(k + 1) / cut);
    if (!advance(end, goal, last, trouble)) return DFM_E_DIVERGED;
    pass(sizes);
  }
  stats.last_substeps = done, stats.substeps_max = std::max(stats.substeps_max, done);
  ++step_count;
  stats.steps = step_count, stats.time = time;
  return DFM_OK;
}

// One planned sub-step, up to `end`: as a whole, or in the pieces that the guard cuts it into. last: of the step, which ends at `goal`.
bool World::advance(double end, double goal, bool last, uint32_t *trouble) {
  guard.pieces = 0, guard.motion = 1, guard.planned = end - time;
  for (bool whole = false; !whole;) {
    const double rest = h = end - time;
    left = goal - time;
    if (h < left || (def.sleep && !idle())) keep_start(*this);   // waking changes what a later failure must put back
    charge(*this, 1);
    view_obstacles(*this, time, h, left);
    if (idle()) stats.contacts_mean += (stats.contacts - stats.contacts_mean) / double(stats.substeps + 1), step_impulses.idle += h;
    else if (!piece(trouble)) return false;
    whole = h == rest;
    if (guard.motion < 1) move_obstacles_by(*this, guard.motion);
    else move_obstacles(*this, time, h, left, whole && last);
    time = whole ? end : time + h;
    ++stats.substeps, ++bound_age;
  }
  return true;
}

// Shortens h until the guard has nothing against it.
bool World::piece(uint32_t *trouble) {
  const uint32_t before = *trouble;
  const uint64_t unconverged = stats.unconverged;
  guard.acted = false;
  while (!sub_step(trouble)) {
    if (!guard.again) return false;
    h *= guard.cut;
    keep_start(*this);
    *trouble = before, stats.unconverged = unconverged;
    view_obstacles(*this, time, h, left);
  }
  stats.guard_steps += guard.acted;
  guard.memory.keep();
  return true;
}

// All stages, or none: where one fails or throws, the state is that of the sub-step before.
bool World::sub_step(uint32_t *trouble) {
  struct Undo {
    World &w;
    bool kept = false;
    ~Undo() { if (!kept) w.undo_motion(); }
  } undo{*this};
  driven.clear();
  guard.start();
  charge(*this, body_work(*this) + surface_work(*this));
  for (const PlannedStage &stage : plan.stages)
    if (!run_stage(*this, stage.id, trouble)) return false;
  keep_rigids();
  return undo.kept = true;
}

bool World::bound_due() const { return bound_age >= kBoundEvery; }

void World::update_bound() {
  stable = std::numeric_limits<double>::infinity();
  worst_body = nullptr, worst_point = 0;
  inverted = 0;
  uint32_t limited = 0;
  double fastest = 0;
  for (auto &b : bodies) {
    const bool stays = b->slumber.asleep && b->bound.known;
    if (!stays) ask_bound(*b);   // who sleeps counts too: the step must not change when it wakes
    inverted += b->bound.inverted, limited += b->model.limited_cells();
    if (!stays && !b->model.stepper && b->model.ops->bound) fastest = std::max(fastest, strain_rate(*b));
    if (b->bound.step < stable) stable = b->bound.step, worst_body = b.get(), worst_point = b->bound.point;
  }
  stable *= kBoundShare;
  stats.stable_step = stable, stats.inverted_max = std::max(stats.inverted_max, inverted);
  stats.limited_max = std::max(stats.limited_max, limited);
  const double keeps = kBoundStrain / (fastest * stable);   // sub-steps
  bound_age = keeps >= kBoundEvery || !(fastest > 0) ? 0 : kBoundEvery - static_cast<uint32_t>(std::max(1.0, keeps));
}

void World::ask_bound(Body &b) {
  b.bound = {true, std::numeric_limits<double>::infinity(), 0, inverted_cells(b)};
  if (b.model.stepper || !b.model.ops->bound) return;
  std::fill(b.ksum.begin(), b.ksum.end(), 0.0), std::fill(b.csum.begin(), b.csum.end(), 0.0);
  double cell = std::numeric_limits<double>::infinity();
  const dfm_kin k = b.kin(time, 0, nullptr);
  if (b.model.call("bound", [&] { return b.model.ops->bound(b.model.self, &k, b.ksum.data(), b.csum.data(), &cell); }) != DFM_OK)
    fail(DFM_E_FATAL, "model '%s' of body '%s' gives no step bound", b.model.type->id, b.name.c_str());
  for (const Spring &spring : b.springs) add_spring_bound(b, spring);
  b.bound.step = std::min(cell, stable_step(b.p, b.ksum.data(), b.csum.data(), &b.bound.point));
}

void World::stage_motion() {
  // Held velocities are the one part of the state that changes before a sub-step is known to succeed; what was there is kept.
  if (!gravity_keys.empty()) change_gravity(*this, vector_at(gravity_keys, time + h));
  for (auto &b : bodies) {
    if (b->slumber.asleep) continue;
    if (b->loads_vary()) {
      std::fill(b->p.load.begin(), b->p.load.end(), 0.0);
      for (const Load &load : b->loads) {
        double scale = load.keys.empty() ? 1 : scale_at(load.keys, time + h);
        if (load.sine.amplitude[0] != 0) scale *= 1 + load.sine.amplitude[0] * sine_at(load.sine, time + h);
        for (size_t i = 0; i < load.points.size(); ++i) {
          double *const f = &b->p.load[size_t(load.points[i]) * kStride];
          store3(f, load3(f) + scale * load3(&load.force[3 * i]));
        }
      }
      for (const Spring &spring : b->springs) add_spring_force(*b, spring, time, h);
    }
    for (const HeldMotion &m : b->motions) {
      const Pose first = m.keys.empty() ? Pose{} : to_pose(m.keys.front().pose), now = m.keys.empty() ? Pose{} : pose_at(m.keys, time + h);
      const Vec3 shift = m.sine.frequency != 0 || m.sine.phase != 0 ? sine_at(m.sine, time + h) * load3(m.sine.amplitude) : Vec3{};
      for (size_t i = 0; i < m.points.size(); ++i) {
        const size_t at = size_t(m.points[i]) * kStride;
        const Vec3 local = rotate_back(first.rotation, load3(&m.start[3 * i]) - first.position);
        const Vec3 v = (1 / h) * (place(now, local) + shift - load3(&b->p.x[at]));
        for (int k = 0; k < 3; ++k)
          if (b->p.held[m.points[i]] & (1 << k)) {
            driven.push_back({&b->p.v[at + size_t(k)], b->p.v[at + size_t(k)]});
            b->p.v[at + size_t(k)] = v[k];
          }
      }
    }
  }
}

void World::undo_motion() {
  for (size_t i = driven.size(); i-- > 0;) *driven[i].velocity = driven[i].before;
  driven.clear();
}

bool World::stage_model(uint32_t *trouble) {
  FirstFailure failed;
  context->tasks.parallel_for(static_cast<uint32_t>(active.size()), 1, [&](uint32_t begin, uint32_t end) {
    for (const uint32_t i : std::span(active).subspan(begin, end - begin)) {
      Body &b = *bodies[i];
      if (b.model.stepper) continue;
      std::copy(b.p.load.begin(), b.p.load.end(), b.p.f.begin());
      const dfm_kin k = b.kin(time, h, b.model.state_out.empty() ? nullptr : b.model.state_out.data());
      if (b.model.call("add_forces", [&] { return b.model.ops->add_forces(b.model.self, &k, b.p.f.data()); }) != DFM_OK) failed.note(i);
    }
  });
  if (failed.body == kNone) return true;
  *trouble |= DFM_TROUBLE_PLUGIN;
  const Body &b = *bodies[failed.body];
  set_last_error(format("step %llu, body '%s': model '%s' could not compute its forces; take a smaller step or change the model",
                        static_cast<unsigned long long>(step_count), b.name.c_str(), b.model.type->id).c_str());
  return false;
}

bool World::stage_predict(uint32_t *trouble) {
  const bool touches = plan.touches();
  FirstFailure failed;
  context->tasks.parallel_for(static_cast<uint32_t>(active.size()), 1, [&](uint32_t begin, uint32_t end) {
    for (const uint32_t i : std::span(active).subspan(begin, end - begin)) {
      Body &b = *bodies[i];
      bool good = true;
      if (b.model.stepper) {
        // A self-stepping body takes loads and gravity as external forces and answers the surfels' mean velocities.
        for (uint32_t k = 0; k < b.p.n; ++k) {
          double *const f = &b.p.f[size_t(k) * kStride];
          store3(f, load3(&b.p.load[size_t(k) * kStride]) + b.p.mass[k] * gravity);
        }
        const dfm_kin k = b.kin(time, h, nullptr);
        Array<double> &u = b.surfel_impulse;   // [nsurfel,3]: free until distribute
        good = b.model.call("predict", [&] { return b.model.stepper->predict(b.model.self, &k, b.p.f.data(), u.data()); }) == DFM_OK;
        for (uint32_t s = 0; s < b.surface.nsurfel; ++s) {
          store3(&b.surface.v[size_t(s) * kStride], load3(&u[3 * size_t(s)]));
          for (size_t c = 0; c < 3; ++c) good = good && std::fabs(u[3 * size_t(s) + c]) <= kLight;
        }
        if (b.surface.identity()) gather_surface(b.surface, b.p.x.data(), nullptr);
      } else {
        free_kinetic[i] = predict(b.p, gravity, h);
        // A lightest point at the limit has so much alone; who has less need not be looked at point by point.
        good = free_kinetic[i] < 0.5 * b.p.least_mass * (kLight * kLight) ||
               (std::isfinite(free_kinetic[i]) && largest_coordinate(b.p.v_free.data(), b.p.n, kStride) <= kLight);
        if (touches && b.surface.identity()) gather_surface(b.surface, b.p.x.data(), b.p.v_free.data());
      }
      if (!good) failed.note(i);
    }
  });
  if (failed.body == kNone) return true;
  const Body &b = *bodies[failed.body];
  *trouble |= DFM_TROUBLE_NONFINITE;
  const double speed = b.model.stepper ? NAN : largest_coordinate(b.p.v_free.data(), b.p.n, kStride);
  const std::string what = speed > kLight && std::isfinite(speed) ? format("a point would move at %.3g m/s, faster than light", speed)
                                                                  : "forces or velocities are not finite";
  set_last_error(format("step %llu, body '%s': %s (model '%s'); take a smaller step, or look for loads and parameters that are too large",
                        static_cast<unsigned long long>(step_count), b.name.c_str(), what.c_str(), b.model.type->id).c_str());
  return false;
}

// Surfels that hang on several phyxels: rows of N are independent of each other, so they are cut among the threads.
void World::stage_gather() {
  for (const uint32_t i : active) {
    const auto &b = bodies[i];
    if (b->surface.identity()) continue;
    const double *const v = b->model.stepper ? nullptr : b->p.v_free.data();   // a self-stepping model has answered its surfels' velocities
    context->tasks.parallel_for(b->surface.nsurfel, 1024, [&](uint32_t begin, uint32_t end) {
      gather_rows(b->surface, b->p.x.data(), v, begin, end);
    });
  }
}

void World::stage_broad() {
  try {
    broad.update(body_views, obstacle_views, filter, h, offset);
  } catch (...) {
    broad.clear();   // out of memory half way through its lists: they are made anew next time
    throw;
  }
}

void World::stage_distribute() {
  distribute(contacts, rows.frame.data(), rows.impulse.data(), sinks);
}

// Self-stepping bodies write their end of the sub-step beside the present state, so that one that fails leaves all bodies as they were.
bool World::commit_steppers(uint32_t *trouble) {
  FirstFailure failed;
  context->tasks.parallel_for(static_cast<uint32_t>(active.size()), 1, [&](uint32_t begin, uint32_t end) {
    for (const uint32_t i : std::span(active).subspan(begin, end - begin)) {
      Body &b = *bodies[i];
      if (!b.model.stepper) continue;
      if (!plan.touches()) std::fill(b.surfel_impulse.begin(), b.surfel_impulse.end(), 0.0);
      const dfm_kin k = b.kin(time, h, b.model.state_out.empty() ? nullptr : b.model.state_out.data());
      // x and v out must not alias k: v_free and f serve as the new arrays
      double *const x = b.p.f.data(), *const v = b.p.v_free.data();
      if (b.model.call("commit", [&] { return b.model.stepper->commit(b.model.self, &k, b.surfel_impulse.data(), x, v); }) != DFM_OK) {
        failed.note(i);
        continue;
      }
      double poison = 0;
      for (size_t j = 0; j < size_t(b.p.n) * kStride; ++j) poison += 0.0 * x[j] + 0.0 * v[j];
      if (poison != 0) failed.note(i);
    }
  });
  if (failed.body == kNone) return true;
  *trouble |= DFM_TROUBLE_PLUGIN;
  const Body &b = *bodies[failed.body];
  set_last_error(format("step %llu, body '%s': model '%s' could not end its step, or ended it with something not finite; take a smaller step "
                        "or change the model", static_cast<unsigned long long>(step_count), b.name.c_str(), b.model.type->id).c_str());
  return false;
}

bool World::stage_commit(uint32_t *trouble) {
  const bool steppers = std::any_of(bodies.begin(), bodies.end(), [](auto &b) { return b->model.stepper != nullptr; });
  if (steppers && !guard.stepped && !commit_steppers(trouble)) return false;
  guard.stepped = false;
  const double way = h * guard.motion;   // the guard may leave some of it out
  const bool touched = plan.touches() && !plan.rolls_back() && rows.n > 0;
  book_energy(*this, guard.motion);
  context->tasks.parallel_for(static_cast<uint32_t>(active.size()), 1, [&](uint32_t begin, uint32_t end) {
    for (const uint32_t i : std::span(active).subspan(begin, end - begin)) {
      Body &b = *bodies[i];
      if (b.model.stepper) {
        for (size_t j = 0; guard.motion < 1 && j < b.p.x.size(); ++j) b.p.f[j] = b.p.x[j] + guard.motion * (b.p.f[j] - b.p.x[j]);
        b.p.x.swap(b.p.f), b.p.v.swap(b.p.v_free);
      } else {
        commit(b.p, touched, way);
      }
      b.model.commit_state();
      if (!plan.touches()) continue;
      Vec3 sum;
      for (uint32_t s = 0; s < b.surface.nsurfel; ++s) sum += load3(&b.surfel_impulse[3 * size_t(s)]);
      b.contact_impulse += sum;
    }
  });
  if (plan.touches()) keep_contacts(), add_impulses(*this);
  return true;
}

}  // namespace dfm
