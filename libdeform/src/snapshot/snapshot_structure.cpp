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
  h.add(z.group.data(), z.group.size());
  h.add(z.material.data(), z.material.size());
  h.add(z.friction);
}

void composition(Hash &h, const Composition &m) {
  for (const Material &x : m.materials) {
    h.add(x.def.young);
    h.add(x.def.poisson);
    h.add(x.def.damping_mass);
    h.add(x.def.damping_stiffness);
    for (size_t i = 0; i < x.extra_keys.size(); ++i) {
      h.add(x.extra_keys[i].data(), x.extra_keys[i].size());
      h.add(x.extra_values[i].data(), x.extra_values[i].size() * sizeof(double));
    }
  }
  h.add(m.of.data(), m.of.size() * sizeof(uint32_t));
  for (const CellField &f : m.given) {
    h.add(f.key.data(), f.key.size());
    h.add(f.values.data(), f.values.size() * sizeof(double));
  }
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
  h.add(whole ? whole->npoint : b.p.n);
  h.add(whole ? whole->nsurfel : b.surface.nsurfel);
  h.add(b.material.data(), b.material.size());
  const Array<uint32_t> &tets = whole ? whole->tets : b.tets;
  const Array<double> &rest = whole ? whole->rest : b.p.rest, &mass = whole ? whole->mass : b.p.mass;
  h.add(tets.data(), tets.size() * sizeof(uint32_t));
  h.add(b.cells.data(), b.cells.size() * sizeof(uint32_t));
  h.add(b.inside.data(), b.inside.size() * sizeof(double));
  h.add(rest.data(), rest.size() * sizeof(double));
  h.add(mass.data(), mass.size() * sizeof(double));
  composition(h, whole ? whole->composition : b.composition);
  const SurfaceZones &zones = whole ? whole->zones : b.zones;
  const Surface &s = b.surface;
  h.add(s.row.data(), s.row.size() * sizeof(uint32_t));
  h.add(s.col.data(), s.col.size() * sizeof(uint32_t));
  h.add(s.weight.data(), s.weight.size() * sizeof(double));
  h.add(s.rest.data(), s.rest.size() * sizeof(double));
  if (!s.identity()) h.add(s.tri.data(), s.tri.size() * sizeof(uint32_t));
  zone(h, zones.list[0]);
  if (zones.of.empty()) return h.value;
  for (const auto &z : zones.list) zone(h, z);
  h.add(zones.of.data(), zones.of.size() * sizeof(uint32_t));
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
    h.add(o.points.data(), o.points.size() * sizeof(double));
    h.add(o.triangles.data(), o.triangles.size() * sizeof(uint32_t));
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
    h.add(set->host_name.data(), set->host_name.size());
    h.add(set->njoint);
    h.add(uint64_t(set->extra.size()));
    h.add(set->group.data(), set->group.size() * sizeof(uint32_t));
    for (const dfm_rigid_def &d : set->defs) {
      h.add(d.mass);
      h.add(d.inertia);
    }
  }
  for (auto &t : w.tools) {
    h.add(t->name.data(), t->name.size());
    const ToolMotion &m = t->motion;
    for (const double x :
         {m.stiffness, m.damping, m.turn_stiffness, m.turn_damping, m.mass, m.inertia, m.late})
      h.add(x);
    h.add(t->def.flags);
    h.add(t->keys.data(), t->keys.size() * sizeof(dfm_pose_key));
    h.add(t->opening_keys.data(), t->opening_keys.size() * sizeof(dfm_scale_key));
  }
  if (const uint8_t requested = uses_self_contact(w)) h.add(requested);
  return h.value;
}

uint64_t snapshot_structure(const World &w) {
  Hash h;
  const auto add = [&](const auto &thing) {
    h.add(thing.id);
    h.add(thing.name.data(), thing.name.size());
    h.add(make_of(thing));
  };
  for (const Body *const b : all_bodies(w))
    if (!b->piece_of) add(*b);
  for (auto &o : w.obstacles) add(*o);
  h.add(rest_of_structure(w));
  return h.value;
}

}  // namespace dfm
