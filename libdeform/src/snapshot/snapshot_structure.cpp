#include "snapshot/snapshot_structure.h"

#include <algorithm>

#include "core/hash.h"
#include "dynamics/rigid/rigid_set.h"
#include "snapshot/snapshot_cuts.h"
#include "state/obstacle.h"
#include "state/tool.h"
#include "state/world.h"
#include "step/self_contact.h"

namespace dfm {
namespace {

void zone(Hash &h, const SurfaceZones::Zone &z) {
  h.list(z.group, z.material);
  h.add(z.friction);
}

void composition(Hash &h, const Composition &m) {
  for (const Material &x : m.materials) {
    for (const auto &[key, at] : kMaterialMembers) h.add(x.def.*at);
    for (size_t i = 0; i < x.extra_keys.size(); ++i) h.list(x.extra_keys[i], x.extra_values[i]);
  }
  h.list(m.of);
  for (const CellField &f : m.given) h.list(f.key, f.values);
}

// The def in a unique form: a rotation of length zero means none (dfm_pose), and sizes that the shape does
// not use get their defaults.
dfm_obstacle_def unique_form(const dfm_obstacle_def &d) {
  static const double none[4] = {};
  const dfm_obstacle_def usual = dfm_obstacle_def_default();
  dfm_obstacle_def out = d;
  if (std::equal(none, none + 4, out.pose.rotation)) out.pose.rotation[3] = 1;
  const bool round = d.shape == DFM_SHAPE_SPHERE || d.shape == DFM_SHAPE_CAPSULE;
  if (d.shape != DFM_SHAPE_BOX) std::copy_n(usual.half_size, 3, out.half_size);
  if (!round) out.radius = usual.radius;
  if (d.shape != DFM_SHAPE_CAPSULE) out.half_length = usual.half_length;
  return out;
}

}  // namespace

uint64_t make_of(const Body &b) {
  Hash h;
  // for a body that has been cut: the original
  const WholeBody *const whole = b.cut.whole.get();
  if (b.ahead.delay > 0) h.add(b.ahead.delay);
  if (b.smooth > 0) h.add(b.smooth);
  h.add(whole ? whole->npoint : b.p.n);
  h.add(whole ? whole->nsurfel : b.surface.nsurfel);
  h.list(b.material, whole ? whole->tets : b.tets, b.cells, b.inside, whole ? whole->rest : b.p.rest,
         whole ? whole->mass : b.p.mass);
  composition(h, whole ? whole->composition : b.composition);
  const SurfaceZones &zones = whole ? whole->zones : b.zones;
  const Surface &s = b.surface;
  h.list(s.row, s.col, s.weight, s.rest);
  if (!s.identity()) h.list(s.tri);
  zone(h, zones.list[0]);
  if (zones.of.empty()) return h.value;
  for (const auto &z : zones.list) zone(h, z);
  h.list(zones.of);
  return h.value;
}

uint64_t make_of(const Obstacle &o) {
  Hash h;
  const dfm_obstacle_def d = unique_form(o.def);
  h.add(d.shape);
  // Anchors of joints are places in the world, so they depend on it. Else the snapshot has it.
  if (o.rigid && o.rigid->njoint) h.add(d.pose);
  h.add(d.half_size);
  h.add(d.radius);
  h.add(d.half_length);
  if (!o.points.empty()) {
    h.list(o.points, o.triangles);
    h.add(d.cells);
  }
  if (o.added) {
    h.add(o.rigid_body);
    h.add(o.local.position);
    h.add(o.local.rotation);
  }
  return h.value;
}

uint64_t rest_of_structure(const World &w) {
  Hash h;
  for (auto &set : w.rigid_sets) {
    h.list(set->host_name);
    h.add(set->njoint);
    for (const dfm_joint_def &j : set->joints) {
      for (const uint32_t x : {j.type, j.body, j.with}) h.add(x);
      h.add(j.anchor);
      if (j.type == DFM_JOINT_HINGE || j.type == DFM_JOINT_SLIDER) h.add(j.axis);
    }
    h.add(uint64_t(set->extra.size()));
    h.list(set->group);
    for (const dfm_rigid_def &d : set->defs) {
      h.add(d.mass);
      h.add(d.inertia);
    }
  }
  for (auto &t : w.tools) {
    h.list(t->name);
    const ToolMotion &m = t->motion;
    for (const double x :
         {m.stiffness, m.damping, m.turn_stiffness, m.turn_damping, m.mass, m.inertia, m.late})
      h.add(x);
    h.add(t->def.shape);
    h.add(t->def.flags);
    h.list(t->keys, t->opening_keys);
  }
  if (uses_self_contact(w)) h.add(uint8_t{1});
  return h.value;
}

uint64_t snapshot_structure(const World &w) {
  Hash h;
  const auto add = [&](const auto &thing) {
    h.add(thing.id);
    h.list(thing.name);
    h.add(make_of(thing));
  };
  for (const Body *const b : all_bodies(w))
    if (!b->piece_of) add(*b);
  for (auto &o : w.obstacles) add(*o);
  h.add(rest_of_structure(w));
  return h.value;
}

}  // namespace dfm
