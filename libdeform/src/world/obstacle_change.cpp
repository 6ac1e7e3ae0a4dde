#include "world/obstacle_change.h"

#include <cmath>
#include <utility>

#include "core/error.h"
#include "dynamics/rigid/rigid_set.h"
#include "state/bounds.h"
#include "state/world.h"
#include "step/context.h"
#include "step/stages.h"
#include "world/body_zones.h"

namespace dfm {

void set_belt(Obstacle &o, Vec3 velocity) {
  World &w = *o.world;
  if (!std::isfinite(velocity.x + velocity.y + velocity.z)) refuse(o, ": velocity_surface must be finite");
  check_velocity(o, velocity);
  if (o.rigid)
    fail(DFM_E_STATE, "'%s' is a rigid body, which has no belt; its motors drive it (dfm_rigid_set_motor)",
         o.name.c_str());
  if (norm2(velocity - load3(o.def.velocity_surface)) == 0) return;
  store3(o.def.velocity_surface, velocity);
  wake_all(w);
  // the view is rebuilt with the tables, and stays valid otherwise
  if (!w.changed) w.steps->obstacle_views[o.slot].belt = velocity;
}

void set_filter(Obstacle &o, uint32_t category, uint32_t collides_with) {
  World &w = *o.world;
  if (o.def.category == category && o.def.collides_with == collides_with) return;
  o.def.category = category;
  o.def.collides_with = collides_with;
  renew_defs(o);
  wake_all(w);
  w.overlaps.place(o.id);
  w.changed = true;
}

void set_material(Obstacle &o, const Material *material) {
  World &w = *o.world;
  SurfaceZones::Zone zone{"", "", kDefaultFriction};
  if (material) {
    if (material->world != &w) refuse(o, DFM_E_HANDLE, ": its material belongs to another world");
    zone = {"", material->name, friction_of(*material)};
  }
  const uint64_t handle = material ? material->handle : 0;
  const bool same = zone.material == o.zone.material && zone.friction == o.zone.friction;
  std::string name = zone.material;
  o.zone = std::move(zone);
  o.material = std::move(name);
  o.def.material = handle;
  if (o.rigid && !o.added) o.rigid->defs[o.rigid_body].material = handle;
  if (same) return;
  wake_all(w);
  w.changed = true;
}

void renew_defs(Obstacle &o) noexcept {
  const auto is = [&](const Material &m) {
    return m.name == o.material && friction_of(m) == o.zone.friction;
  };
  uint64_t handle = 0, unnamed = 0;
  for (const auto &m : o.world->materials) {
    if (m->handle == o.def.material && is(*m)) unnamed = m->handle;
    if (!o.material.empty() && m->name == o.material) handle = m->handle;
  }
  o.def.material = handle ? handle : unnamed;
  if (!o.rigid || o.added) return;
  dfm_rigid_def &d = o.rigid->defs[o.rigid_body];
  d.category = o.def.category;
  d.collides_with = o.def.collides_with;
  d.material = o.def.material;
}

}  // namespace dfm
