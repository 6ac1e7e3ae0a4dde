// The two stages of rigid bodies around the solve: motion without contact, and the end with contact.
#include "step/rigid/rigid.h"

#include <algorithm>
#include <cmath>

#include "body/obstacle_mesh.h"
#include "core/error.h"
#include "math/turn.h"
#include "state/bounds.h"
#include "state/obstacle.h"
#include "state/world.h"
#include "step/context.h"
#include "step/messages.h"
#include "step/rigid/tool_touch.h"
#include "step/stages.h"

namespace dfm {
namespace {

// said: sentences() before the call of the host. Includes the host's reason if it has given one.
bool host_failed(const WorldState &state, const RigidSet &set, const HostFault &fault, uint64_t said,
                 uint32_t *trouble) {
  need_memory(fault.status);
  const std::string why =
      said != sentences() ? last_error() : "take a smaller step or look at its masses and motors";
  return fail_step(trouble, DFM_TROUBLE_PLUGIN, "%s, rigid body '%s' and those with it: host '%s' %s; %s",
                   at_step(state).c_str(), set.defs[0].name, set.host_name.c_str(), fault.what, why.c_str());
}

}  // namespace

Obstacle &rigid_obstacle(World &w, uint64_t id) {
  if (Obstacle *const o = w.obstacle(id)) return *o;
  fail(DFM_E_FATAL, "a rigid body has lost its shape");
}

bool is_moved(const Obstacle &o) { return o.rigid && o.rigid->group[o.rigid_body] != DFM_RIGID_STILL; }

Pose shape_pose(const Obstacle &o, const dfm_rigid_state &s) {
  return o.added ? load_pose(s) * o.local : load_pose(s);
}

Vec3 mean_velocity_at(const Obstacle &o, const double *v, Vec3 arm, double h) {
  const Vec3 turn = load3(o.rigid->state[o.rigid_body].spin);
  const Vec3 second = cross(turn, cross(turn, arm)), third = cross(turn, second);
  return velocity_at(v, arm) + (0.5 * h) * second + (h * h / 6) * third;
}

void place_rigids(World &w) {
  StepContext &step = *w.steps;
  step.rigid_places.clear();
  step.rigid_groups.clear();
  if (w.rigid_sets.empty()) return;
  step.rigid_places.resize(w.obstacles.size());
  for (auto &set : w.rigid_sets) {
    set->first_group = static_cast<uint32_t>(step.rigid_groups.size());
    step.rigid_groups.resize(step.rigid_groups.size() + set->ngroup);
    for (uint32_t g : set->group)
      if (g != DFM_RIGID_STILL) ++step.rigid_groups[set->first_group + g];
  }
  step.rigid_first.assign(1, 0);
  for (const uint32_t n : step.rigid_groups) step.rigid_first.push_back(step.rigid_first.back() + n);
  step.rigid_members.resize(step.rigid_first.back());
  for (auto &set : w.rigid_sets)
    for (uint32_t i = 0; i < set->defs.size(); ++i)
      if (const uint32_t g = set->group[i]; g != DFM_RIGID_STILL)
        step.rigid_members[step.rigid_first[set->first_group + g] + set->place[i]] = {set.get(), i};
  for (auto &o : w.obstacles)
    if (is_moved(*o))
      step.rigid_places[o->slot] = {
          o->rigid->first_group + o->rigid->group[o->rigid_body], o->rigid->place[o->rigid_body], {}};
}

namespace {

bool query_rigids(const WorldState &state, const Entities &entities, uint32_t *trouble) {
  const uint64_t said = sentences();
  for (auto &set : entities.rigid_sets)
    if (const HostFault fault = set->free_motion()) return host_failed(state, *set, fault, said, trouble);
  return true;
}

}  // namespace

bool stage_rigid_predict(const WorldMemory &memory, const WorldState &state, const Entities &entities,
                         const Rules &rules, const Derived &derived, const Awake &awake, SubStepTimes &times,
                         Budget &budget, Views &views, Solution &solution, uint32_t *trouble) {
  solution.rigid_again = false;
  for (auto &set : entities.rigid_sets) set->begin(sub_step_of(state, rules, times));
  if (!query_rigids(state, entities, trouble)) return false;
  if (!views.tools->begin(memory, state, entities, derived, awake, views, times, budget)) return false;
  for (auto &set : entities.rigid_sets) set->first.assign(set->velocity.begin(), set->velocity.end());
  for (auto &o : entities.obstacles) {
    if (!is_moved(*o)) continue;
    const dfm_rigid_state &s = o->rigid->state[o->rigid_body];
    const double *const v = &o->rigid->velocity[6 * size_t{o->rigid_body}];
    ObstacleView &view = views.obstacle_views[o->slot];
    view.velocity = o->added
                        ? mean_velocity_at(*o, v, rotate(load_quat(s.rotation), o->local.position), times.h)
                        : load3(v);
    view.spin = load3(v + 3);
    view.linear = view.spin - load3(s.spin);
    if (o->mesh) o->mesh->place(view.position, view.rotation, view.velocity, view.spin);
    views.rigid_places[o->slot].center = load3(s.position);
  }
  return true;
}

namespace {

// Sets number their groups one after another.
RigidSet &set_of_group(World &w, uint32_t group) {
  const auto after = std::upper_bound(w.rigid_sets.begin(), w.rigid_sets.end(), group,
                                      [](uint32_t g, const auto &set) { return g < set->first_group; });
  return **(after - 1);
}

}  // namespace

bool rigid_response(World &w, StepContext &step, const ContactRows::Block &block, uint32_t *trouble) {
  bool given = true;
  step.rows.set_response(block, false, [&](double *matrix) {
    if (step.tools->fill_response(block.group, matrix)) return;
    RigidSet &set = set_of_group(w, block.group);
    const uint64_t said = sentences();
    if (const HostFault fault =
            set.respond(block.group - set.first_group, step.rigid_groups[block.group], matrix))
      given = host_failed(w, set, fault, said, trouble);
  });
  return given;
}

// The velocities of rigid bodies without contact, less those that detection has used: a host that says
// DFM_RIGID_AGAIN or decides otherwise about its motors knows better now how its bodies move, and turning
// adds what is linear in no impulse.
void start_rigids(World &w, StepContext &step) {
  for (const ContactRows::Block &block : step.rows.blocks) {
    if (block.group == kNone) continue;
    double *to = &step.rows.y[4 * size_t{block.first}];
    for (const auto &[set, body] : step.tools->members(step, block.group)) {
      const size_t at = 6 * size_t{body};
      double now[6];
      if (!step.tools->free_velocity(*set, body, now)) std::copy_n(&set->velocity[at], 6, now);
      store3(to, load3(now) - load3(&set->first[at]));
      store3(to + 4, load3(now + 3) - load3(&set->first[at + 3]));
      to += 8;
    }
  }
}

void sum_rigid_impulses(const Entities &entities, const Derived &derived, const Views &views,
                        const Detection &detection, const Solution &solution) {
  for (auto &set : entities.rigid_sets) std::fill(set->impulse.begin(), set->impulse.end(), 0.0);
  const ContactRows &rows = solution.rows;
  if (!derived.plan.has(StageRole::solves) || rows.rigid.empty()) return;
  views.tools->add_impulses();
  for (uint32_t i = 0; i < rows.all(); ++i) {
    if (rows.rigid[i] == kNone || (i >= rows.soft() && i < rows.n)) continue;
    const Obstacle &o =
        *entities.obstacles[i < rows.n ? detection.contacts[i].slot_b : solution.bonds[i - rows.n].slot_b];
    const Vec3 p = -rows.world_impulse(i);
    double *const to = &o.rigid->impulse[6 * size_t{o.rigid_body}];
    add3(to, p);
    add3(to + 3, cross(load3(&rows.arm[size_t(3) * i]), p));
  }
}

bool follow_rigids(World &w, StepContext &step, double left, bool revises, Followed &out, uint32_t *trouble) {
  step.tools->take(step, left);
  sum_rigid_impulses(w, w, step, step, step);
  out = {};
  const uint64_t said = sentences();
  for (auto &set : w.rigid_sets) {
    if (!revises || !set->host.revise) continue;
    bool changed = false;
    if (const HostFault fault = set->revise(changed)) return host_failed(w, *set, fault, said, trouble);
    if (!changed) continue;
    set->velocity.assign(set->revised.begin(), set->revised.end());
    step.tools->renew(*set);
    out.renewed = true;
  }
  out.renewed = out.renewed || (revises && step.tools->press_harder());
  out.goes_on = out.renewed || step.tools->follow(w, step);
  if (out.renewed)
    for (const ContactRows::Block &block : step.rows.blocks)
      if (block.group != kNone && !rigid_response(w, step, block, trouble)) return false;
  return true;
}

void restart_rigids(World &w, StepContext &step) {
  step.tools->put(step.rows, step.state);
  start_rigids(w, step);
  step.rows.restart_rigids();
}

namespace {

// again: whether a host requests another solve.
bool query_rigid_ends(const WorldState &state, const Entities &entities, bool &again, uint32_t *trouble) {
  const uint64_t said = sentences();
  for (auto &set : entities.rigid_sets)
    if (const HostFault fault = set->take_impulses()) return host_failed(state, *set, fault, said, trouble);
  for (auto &set : entities.rigid_sets) {
    bool one = false;
    if (const HostFault fault = set->end_state(one)) return host_failed(state, *set, fault, said, trouble);
    again |= one;
  }
  return true;
}

}  // namespace

Next stage_rigid_commit(const WorldMemory &memory, WorldState &state, const Entities &entities,
                        const Derived &derived, const Awake &awake, const Detection &detection,
                        SubStepTimes &times, Budget &budget, Views &views, Solution &solution,
                        StepImpulses &impulses, uint32_t *trouble) {
  sum_rigid_impulses(entities, derived, views, detection, solution);
  ToolTouch &tools = *views.tools;
  tools.list(state, solution);
  bool again = false;
  if (!query_rigid_ends(state, entities, again, trouble)) return Next::stop;
  solution.rigid_again = again && solution.rigid_rounds < DFM_RIGID_MOST_AGAIN &&
                         derived.plan.has(StageRole::solves) && solution.rows.all() > 0;
  if (solution.rigid_again) {
    ++solution.rigid_rounds;
    ++state.stats.rigid_again;
    if (!query_rigids(state, entities, trouble)) return Next::stop;
    tools.correct();
    return Next::solve;
  }
  solution.rigid_rounds = 0;
  if (!tools.follows_arcs(entities, derived, awake, times, budget) ||
      !tools.stays_out(memory, state, entities, derived, awake, views, times, budget))
    return Next::stop;
  if (const uint32_t row = tools.jammed_row(derived); row != kNone)
    return go_on(
        report_jam(state, entities, detection, solution, views, solution.rows.soft() + row, trouble));
  tools.turn_jaws();
  reserve_reports(state, entities, derived, views, solution, impulses);
  // From here on (guard) their true motion is used.
  for (auto &o : entities.obstacles) {
    if (!is_moved(*o)) continue;
    const Pose from = shape_pose(*o, o->rigid->state[o->rigid_body]);
    const Pose to = shape_pose(*o, o->rigid->next[o->rigid_body]);
    ObstacleView &view = views.obstacle_views[o->slot];
    view.velocity = (1 / times.h) * (to.position - from.position);
    view.spin = (1 / times.h) * rotation_vector(to.rotation * conjugate(from.rotation));
    view.linear = {};
  }
  return Next::stage;
}

void keep_rigids(World &w, StepContext &step) {
  if (!w.rigid_sets.empty()) step.tools->keep(w);  // else stage_rigid_predict() has not made anything
  for (auto &set : w.rigid_sets) set->commit(sub_step_of(w, w, step), step.guard.motion);
  if (!w.rigid_sets.empty())
    for (auto &o : w.obstacles)
      if (o->rigid) o->pose = shape_pose(*o, o->rigid->state[o->rigid_body]);
}

dfm_body_measure measure_rigid(const RigidSet &set, uint32_t i) {
  const dfm_rigid_def &d = set.defs[i];
  const dfm_rigid_state &s = set.state[i];
  dfm_body_measure m{};
  m.size = sizeof m;
  m.mass = d.mass;
  m.volume = m.rest_volume = solid_volume(d);
  const Vec3 v = load3(s.velocity), w = load3(s.spin),
             L = in_axes(load_quat(s.rotation), load3(d.inertia), w);
  store3(m.com, load3(s.position));
  store3(m.velocity, v);
  store3(m.momentum, d.mass * v);
  store3(m.angular, L);
  m.kinetic = 0.5 * d.mass * norm2(v) + 0.5 * dot(w, L);
  double reach = 0;
  for (const auto &o : set.world->obstacles) {
    if (o->rigid != &set || o->rigid_body != i) continue;
    const bool round = o->def.shape == DFM_SHAPE_SPHERE || o->def.shape == DFM_SHAPE_CAPSULE;
    const double own = o->standing().extent() + (round ? o->def.radius : 0);
    reach = std::max(reach, own + (o->added ? norm(o->local.position) : 0));
  }
  m.speed_max = norm(v) + norm(w) * reach;
  for (uint32_t k = 0; k < 3; ++k) m.contact_impulse[k] = set.total[3 * i + k];
  return m;
}

void set_rigid_state(Obstacle &o, const dfm_rigid_state &given) {
  RigidSet &set = *o.rigid;
  if (!is_moved(o)) fail(DFM_E_ARG, "rigid body '%s' is fixed and cannot be moved", o.name.c_str());
  if (!finite_values({&given, 1}))
    fail(DFM_E_ARG, "rigid body '%s': the given state is not finite", o.name.c_str());
  check_velocity({"rigid body", o.name.c_str()}, load3(given.velocity), load3(given.spin), 1);
  check_place(*o.world, {"rigid body", o.name.c_str()}, largest_coordinate(given.position, 1, 3));
  dfm_rigid_state &s = set.state[o.rigid_body];
  s = given;
  store_quat(s.rotation, unit_quat(given.rotation));
  for (auto &shape : o.world->obstacles)
    if (shape->rigid == &set && shape->rigid_body == o.rigid_body) shape->pose = shape_pose(*shape, s);
  ++o.world->placements;
  values_changed(*o.world);
}

namespace {

// ask: the host about one of its joints. Includes its reason if it refuses with one.
template <class Ask>
void ask_joint(const RigidSet &set, uint32_t joint, Ask &&ask) {
  if (joint >= set.njoint)
    fail(DFM_E_ARG, "there is no joint %u; the set of rigid body '%s' has %u", joint, set.defs[0].name,
         set.njoint);
  const uint64_t said = sentences();
  const dfm_status status = ask();
  need_memory(status);
  if (status == DFM_OK) return;
  const std::string why = said != sentences() ? last_error() : "it is neither hinge nor slider";
  fail(status < 0 ? status : DFM_E_ARG, "joint %u of the set of rigid body '%s': %s", joint, set.defs[0].name,
       why.c_str());
}

}  // namespace

void set_rigid_motor(RigidSet &set, uint32_t joint, double velocity, double max) {
  if (!set.host.set_motor) fail(DFM_E_UNSUPPORTED, "rigid host '%s' has no motors", set.host_name.c_str());
  if (!std::isfinite(velocity) || !(max >= 0 && std::isfinite(max)))
    fail(DFM_E_ARG, "motor of joint %u: velocity %g and max %g must be finite, max not negative", joint,
         velocity, max);
  ask_joint(set, joint, [&] { return set.host.set_motor(set.self, joint, velocity, max, set.extra.data()); });
  set.motors[joint] = {velocity, max};
}

void rigid_joint(RigidSet &set, uint32_t joint, double *position, double *rate, double *effort) {
  if (!set.host.joint)
    fail(DFM_E_UNSUPPORTED, "rigid host '%s' says nothing about its joints", set.host_name.c_str());
  const std::lock_guard one_at_a_time(set.querying);
  double p = 0, r = 0, e = 0;
  ask_joint(set, joint,
            [&] { return set.host.joint(set.self, set.state.data(), set.extra.data(), joint, &p, &r, &e); });
  if (position) *position = p;
  if (rate) *rate = r;
  if (effort) *effort = e;
}

}  // namespace dfm
