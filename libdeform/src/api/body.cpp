#include "deform/body.h"

#include <cmath>
#include <span>

#include "api/objects.h"
#include "state/bounds.h"
#include "state/spring.h"
#include "step/stages.h"
#include "step/watch/energy_watch.h"
#include "world/change_energy.h"
#include "world/create.h"
#include "world/measure.h"
#include "world/queries.h"
#include "world/rest_loads.h"

using namespace dfm;

namespace {

// A count of keys without keys, and a sine that is not finite.
void check_motion(const Body &b, uint32_t nkey, const void *keys, const dfm_sine *sine) {
  if (nkey && !keys) refuse(b, ": %u keys are announced, but keys is NULL", nkey);
  if (!sine) return;
  for (double v : {sine->amplitude[0], sine->amplitude[1], sine->amplitude[2], sine->frequency, sine->phase})
    if (!std::isfinite(v))
      refuse(b, ": the sine is not finite; give amplitude, frequency (Hz) and phase (rad)");
}

void check_points(const Body &b, uint32_t n, const uint32_t *points) {
  if (n) need(points, "points");
  for (uint32_t i = 0; i < n; ++i)
    if (points[i] >= b.p.n) refuse(b, ": point %u does not exist; it has %u points", points[i], b.p.n);
}

// Removes the points from the motions that carry them, at most one each; a motion without points is removed.
// All or nothing.
void drop_motions(Body &b, std::span<const uint32_t> points) {
  if (b.motions.empty()) return;
  std::vector<uint8_t> dropped(b.p.n);
  for (const uint32_t p : points) dropped[p] = 1;
  for (HeldMotion &m : b.motions) {
    size_t kept = 0;
    for (size_t i = 0; i < m.points.size(); ++i) {
      if (dropped[m.points[i]]) continue;
      m.points[kept] = m.points[i];
      for (size_t k = 0; k < 3; ++k) m.start[3 * kept + k] = m.start[3 * i + k];
      ++kept;
    }
    m.points.resize(kept);
    m.start.resize(3 * kept);
  }
  std::erase_if(b.motions, [](const HeldMotion &m) { return m.points.empty(); });
}

// Held components keep the velocity of the hold, which dampers see at once: zero unless a motion moves them.
void stop_held(Body &b) {
  for (Array<double> *const v : {&b.p.v, &b.p.dampers.v, &b.p.dampers.slow})
    for (size_t at = 0; at < v->size(); ++at)
      if (b.p.held[at / kStride] & (1 << at % kStride)) (*v)[at] = 0;
}

// Constant lasting loads are summed once; varying ones are summed in the motion stage. Changes by the host
// are no work of the step.
void disturb(Body &b) {
  wake(*b.world, b);
  forget_energy(b);
}

void sum_loads(Body &b) {
  std::fill(b.p.load.begin(), b.p.load.end(), 0.0);
  for (const Load &load : b.loads)
    for (size_t i = 0; i < load.points.size(); ++i)
      add3(&b.p.load[size_t(load.points[i]) * kStride], load3(&load.force[3 * i]));
  disturb(b);
  values_changed(*b.world);
}

Spring &spring_of(Body &b, uint32_t number) {
  for (Spring &s : b.springs)
    if (s.number == number) return s;
  refuse(b, " has no spring %u", number);
}

// They count in the step bound and act from the next sub-step on.
void springs_changed(Body &b) {
  sum_loads(b);
  b.bound.known = false;
}

Spring make_spring(const Body &b, const dfm_spring_def &d) {
  if (!b.dynamics->abilities().springs)
    refuse(b, DFM_E_UNSUPPORTED,
           ": springs are integrated explicitly and need a model with a step bound, which model '%s' does "
           "not have; choose another model",
           b.model.type->id);
  check_points(b, d.npoint, d.points);
  if (d.npoint == 0) refuse(b, ": a spring needs at least one point");
  if (d.nkey && !d.keys) refuse(b, ": %u keys are announced, but keys is NULL", d.nkey);
  if (!(d.stiffness >= 0) || !(d.damping >= 0) || std::isinf(d.stiffness) || std::isinf(d.damping))
    refuse(b, ": a spring's stiffness and damping are finite and not negative; found %g N/m and %g N s/m",
           d.stiffness, d.damping);
  Spring s{b.next_load, {d.points, d.points + d.npoint}, {}, {}, load3(d.to), d.stiffness, d.damping};
  if (d.nkey) s.keys.assign(d.keys, d.keys + d.nkey);
  check_keys(s.keys, b.name.c_str());
  double sum = 0, nan_flag = 0;
  for (uint32_t i = 0; i < d.npoint; ++i) {
    const double w = d.weights ? d.weights[i] : b.p.mass[d.points[i]];
    if (!(w >= 0)) refuse(b, ": weight %u of a spring is %g; weights are not negative", i, w);
    s.weights.push_back(w);
    sum += w;
  }
  for (double x : d.to) nan_flag += 0.0 * x;
  if (!(sum > 0) || std::isinf(sum) || nan_flag != 0)
    refuse(b, ": a spring's end and the sum of its weights must be finite, the sum above 0");
  for (double &w : s.weights) w /= sum;
  return s;
}

}  // namespace

dfm_status dfm_body_create(dfm_world world, const dfm_body_def *def, dfm_body *out) {
  return as_status(to_change<world_of>, world, [&](World &w) {
    need(out, "out");
    dfm_body_def own = take_def(def, dfm_body_def_default());
    check_flags(own, 0, "dfm_body_def");
    dfm_surface_def surface;
    dfm_surface_groups groups;
    take_pointed(own.surface, surface);
    take_pointed(own.groups, groups);
    Body &made = create_body(w, own);
    warn_of_own_weight(w, made);
    *out = made.handle;
  });
}

dfm_status dfm_body_destroy(dfm_body body) {
  return as_status(any_body_of, body, [&](Body &b) {
    if (!b.emptied && !b.rolled_back) body_of(body);  // with all of its points
    exclusive(*b.world);
    destroy_body(b);
  });
}

dfm_status dfm_body_get_info(dfm_body body, dfm_body_info *out) {
  return as_status(any_body_of, body, [&](const Body &b) {
    dfm_body_info i{};
    if (!b.emptied && !b.rolled_back) {
      i.npoint = b.p.n;
      i.ntet = b.ncell();
      i.nsurfel = b.surface.nsurfel;
      i.ntriangle = b.surface.ntri;
      i.nedge = static_cast<uint32_t>(b.edges.size() / 2);
      i.mass = b.mass;
      i.rest_volume = b.rest_volume;
      i.mass_moved = b.scaling.moved;
      i.frequency_change = b.scaling.frequency;
    }
    i.world = b.world->handle;
    i.name = b.name.c_str();
    i.model = b.model.type->id;
    i.user = b.user;
    copy_out(out, i);
  });
}

dfm_status dfm_body_set_user(dfm_body body, void *user) {
  return as_status([&] { shown_body_of(body).user = user; });
}

dfm_status dfm_body_set_filter(dfm_body body, uint32_t category, uint32_t collides_with) {
  return as_status(to_change<body_of>, body, [&](Body &b) {
    if (b.category == category && b.collides_with == collides_with) return;
    b.category = category;
    b.collides_with = collides_with;
    disturb(b);
    b.world->overlaps.place(b.id);
    b.world->changed = true;
  });
}

dfm_status dfm_body_get_state(dfm_body body, uint32_t capacity, double *x, double *v, uint32_t *n) {
  return as_status(still_body_of, body, [&](const Body &b) {
    if (!room(b.p.n, capacity, x ? x : v, n)) return;
    for (uint32_t i = 0; i < b.p.n; ++i) {
      if (x) store3(x + size_t(3) * i, load3(&b.p.x[size_t(i) * kStride]));
      if (v) store3(v + size_t(3) * i, load3(&b.p.v[size_t(i) * kStride]));
    }
  });
}

dfm_status dfm_body_set_state(dfm_body body, uint32_t n, const double *x, const double *v) {
  return as_status(to_change<body_of>, body, [&](Body &b) {
    if (n != b.p.n) refuse(b, " has %u points, %u were given", b.p.n, n);
    for (size_t i = 0; i < size_t(3) * n; ++i)
      if ((x && !std::isfinite(x[i])) || (v && !std::isfinite(v[i])))
        refuse(b, ": the state of point %zu is not finite; nothing was changed", i / 3);
    for (uint32_t i = 0; v && i < n; ++i) check_velocity(b, load3(v + size_t(3) * i));
    if (x) {
      const double far = largest_coordinate(x, n, 3);
      check_resolved(b, far, b.surface.median_edge);
      check_place(*b.world, b, far);
    }
    const HostWork work(b);
    for (uint32_t i = 0; i < n; ++i)
      for (int k = 0; k < 3; ++k) {
        if (b.p.held[i] & (1 << k)) continue;
        if (x) b.p.x[size_t(i) * kStride + size_t(k)] = x[size_t(3) * i + size_t(k)];
        if (v) b.p.v[size_t(i) * kStride + size_t(k)] = v[size_t(3) * i + size_t(k)];
      }
    if (v) b.relax_dampers();
    b.dynamics->points_changed();
    disturb(b);
    if (x) lose_energy(b);
    b.world->bound.age = kNone;
    ++b.world->placements;
    ++b.x_version;
    if (x) b.world->overlaps.place(b.id);
  });
}

dfm_status dfm_body_get_rest(dfm_body body, uint32_t capacity_points, double *x, uint32_t capacity_tets,
                             uint32_t *tets) {
  return as_status(shown_body_of, body, [&](const Body &b) {
    const bool points = x && room(b.p.n, capacity_points, x, nullptr);
    if (tets && room(b.ncell(), capacity_tets, tets, nullptr)) std::copy(b.tets.begin(), b.tets.end(), tets);
    if (points) std::copy(b.p.rest.begin(), b.p.rest.end(), x);
  });
}

dfm_status dfm_body_hold(dfm_body body, uint32_t n, const uint32_t *points, uint8_t axes) {
  return as_status(to_change<body_of>, body, [&](Body &b) {
    check_points(b, n, points);
    if (axes > 7) fail(DFM_E_ARG, "axes is %u; it is a sum of 1 (x), 2 (y) and 4 (z)", unsigned(axes));
    if (b.model.stepper)
      refuse(b, DFM_E_UNSUPPORTED,
             ": model '%s' steps itself and must know the held points when the body is created; give "
             "dfm_body_def.fixed",
             b.model.type->id);
    const HostWork work(b);
    if (axes == 0) drop_motions(b, {points, n});
    for (uint32_t i = 0; i < n; ++i) b.p.held[points[i]] = axes;
    update_inverse_mass(b.p);
    stop_held(b);
    disturb(b);
    b.world->bound.age = kNone;
  });
}

dfm_status dfm_body_move_held(dfm_body body, uint32_t n, const uint32_t *points, uint32_t nkey,
                              const dfm_pose_key *keys, const dfm_sine *sine) {
  return as_status(to_change<body_of>, body, [&](Body &b) {
    check_points(b, n, points);
    check_motion(b, nkey, keys, sine);
    if (nkey == 0 && !sine) refuse(b, ": a motion needs keys or a sine");
    if (n == 0) refuse(b, ": a motion needs points");
    HeldMotion m;
    m.points.assign(points, points + n);
    if (nkey) m.keys.assign(keys, keys + nkey);
    check_keys(m.keys, b.name.c_str());
    if (sine) m.sine = *sine;
    for (uint32_t i = 0; i < n; ++i) {
      if (!b.p.held[points[i]]) refuse(b, ": point %u is not held; call dfm_body_hold first", points[i]);
      for (int k = 0; k < 3; ++k) m.start.push_back(b.p.x[size_t(points[i]) * kStride + size_t(k)]);
    }
    b.motions.reserve(b.motions.size() + 1);
    drop_motions(b, {points, n});
    b.motions.push_back(std::move(m));
    disturb(b);
    values_changed(*b.world);
  });
}

dfm_status dfm_body_add_load(dfm_body body, uint32_t n, const uint32_t *points, const double *force,
                             uint32_t nkey, const dfm_scale_key *keys, const dfm_sine *sine, uint32_t *load) {
  return as_status(to_change<body_of>, body, [&](Body &b) {
    check_points(b, n, points);
    check_motion(b, nkey, keys, sine);
    if (n) need(force, "force");
    Load l{};
    l.number = b.next_load;
    l.points.assign(points, points + n);
    l.force.assign(force, force + size_t(3) * n);
    if (!all_finite(l.force.data(), l.force.size())) refuse(b, ": a load is not finite");
    if (nkey) l.keys.assign(keys, keys + nkey);
    check_keys(l.keys, b.name.c_str());
    if (sine) l.sine = *sine;
    b.loads.push_back(std::move(l));
    ++b.next_load;
    if (load) *load = b.loads.back().number;
    sum_loads(b);
  });
}

dfm_status dfm_body_remove_load(dfm_body body, uint32_t load) {
  return as_status(to_change<body_of>, body, [&](Body &b) {
    if (std::erase_if(b.loads, [&](const Load &l) { return l.number == load; }) == 0)
      refuse(b, " has no load %u", load);
    sum_loads(b);
  });
}

dfm_status dfm_body_add_spring(dfm_body body, const dfm_spring_def *def, uint32_t *spring) {
  return as_status(to_change<body_of>, body, [&](Body &b) {
    b.springs.push_back(make_spring(
        b,
        take_def(def, dfm_spring_def{sizeof(dfm_spring_def), 0, nullptr, nullptr, {}, nullptr, 0, 0, 0, 0})));
    ++b.next_load;
    if (spring) *spring = b.springs.back().number;
    springs_changed(b);
  });
}

dfm_status dfm_body_set_spring_target(dfm_body body, uint32_t spring, const double to[3]) {
  return as_status(to_change<body_of>, body, [&](Body &b) {
    need(to, "to");
    Spring &s = spring_of(b, spring);
    if (!all_finite(to, 3)) refuse(b, ": a spring's end must be finite");
    s.to = load3(to);
    s.keys.clear();
    disturb(b);
  });
}

dfm_status dfm_body_get_spring_force(dfm_body body, uint32_t spring, double force[3]) {
  return as_status(still_body_of, body, [&](Body &b) {
    need(force, "force");
    store3(force, spring_force(b, spring_of(b, spring), b.world->time, 0));
  });
}

dfm_status dfm_body_remove_spring(dfm_body body, uint32_t spring) {
  return as_status(to_change<body_of>, body, [&](Body &b) {
    b.springs.erase(b.springs.begin() + (&spring_of(b, spring) - b.springs.data()));
    springs_changed(b);
  });
}

dfm_status dfm_body_apply_impulse(dfm_body body, const double point[3], const double impulse[3]) {
  return as_status(to_change<body_of>, body, [&](Body &b) {
    need(point, "point");
    need(impulse, "impulse");
    if (!all_finite(point, 3) || !all_finite(impulse, 3)) refuse(b, ": point and impulse must be finite");
    const TriangleNearPoint near = closest_on_body(b, load3(point));
    // no point of the triangle gets more than all of the impulse
    for (int k = 0; k < 3; ++k)
      b.surface.each_phyxel(b.surface.tri[size_t(3) * near.triangle + size_t(k)],
                            [&](uint32_t phyxel, double) {
                              const double mass = b.p.mass[phyxel];
                              if (mass > 0) check_velocity(b, (1 / mass) * load3(impulse));
                            });
    disturb(b);
    const HostWork work(b);
    // dv = M^-1 N^T p: the change with the least kinetic energy that gives the point its new velocity
    for (int k = 0; k < 3; ++k)
      b.surface.each_phyxel(
          b.surface.tri[size_t(3) * near.triangle + size_t(k)],
          [&](uint32_t phyxel, double w) { b.dynamics->push(phyxel, near.at.weight[k] * w, impulse); });
  });
}

dfm_status dfm_body_set_params(dfm_body body, const dfm_params *params) {
  return as_status(to_change<body_of>, body, [&](Body &b) {
    need(params, "params");
    const HostWork work(b);
    set_model_params(b, *params);
    disturb(b);
  });
}

dfm_status dfm_body_wake(dfm_body body) {
  return as_status(body_of, body, [&](Body &b) { wake(exclusive(*b.world), b); });
}

dfm_status dfm_body_is_asleep(dfm_body body, bool *asleep) {
  return as_status(shown_body_of, body, [&](const Body &b) {
    need(asleep, "asleep");
    *asleep = b.sleep_state.asleep;
  });
}

dfm_status dfm_body_get_measure(dfm_body body, dfm_body_measure *out) {
  return as_status([&] { copy_out(out, measure(still_body_of(body))); });
}

dfm_status dfm_body_energy_density(dfm_body body, uint32_t capacity, double *out) {
  return as_status(still_body_of, body, [&](Body &b) {
    if (!room(b.ncell(), capacity, out, nullptr)) return;
    energy_density(b, out);
  });
}

dfm_status dfm_body_stress(dfm_body body, uint32_t capacity, double *out) {
  return as_status(still_body_of, body, [&](Body &b) {
    if (!room(b.ncell(), capacity, out, nullptr)) return;
    cell_stress(b, out);
  });
}

dfm_status dfm_body_point_stress(dfm_body body, uint32_t capacity, double *out) {
  return as_status(still_body_of, body, [&](Body &b) {
    if (room(b.p.n, capacity, out, nullptr)) point_stress(b, out);
  });
}
