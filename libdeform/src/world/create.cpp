// Creates bodies and obstacles: checks defs, turns meshes into phyxels and surfels, creates the model
// instance.
#include "world/create.h"

#include <algorithm>
#include <cmath>

#include "body/obstacle_mesh.h"
#include "core/error.h"
#include "core/handle.h"
#include "friction/pair_rules.h"
#include "geometry/area.h"
#include "geometry/voxel_grid.h"
#include "mesh/cells.h"
#include "plugin/context.h"
#include "state/bounds.h"
#include "state/material.h"
#include "state/obstacle.h"
#include "state/search_tree.h"
#include "step/context.h"
#include "step/rigid/tool_touch.h"
#include "step/solve/attach.h"
#include "step/stages.h"
#include "step/step_impulses.h"
#include "step/watch/contact_energy.h"
#include "world/body_effects.h"
#include "world/body_model.h"
#include "world/body_surface.h"
#include "world/body_zones.h"
#include "world/idle.h"
#include "world/may_cut.h"
#include "world/sensors.h"
#include "world/triangle_list.h"

namespace dfm {
std::string name_of(World &w, const char *given, const char *kind) {
  uint64_t number = w.next_id;
  return name_of(w, given, kind, number);
}

std::string name_of(World &w, const char *given, const char *kind, uint64_t &number) {
  const auto numbered = [&] { return kind + std::to_string(number); };
  while (!given && (w.find_body(numbered()) || w.find_obstacle(numbered()))) ++number;
  std::string name = given ? given : numbered();
  ++number;
  return name;
}

namespace {

void check_name(World &w, const std::string &name, const char *kind) {
  if (name.empty() || name == "*" || name.rfind("material=", 0) == 0)
    fail(DFM_E_ARG, "%s name '%s' is reserved; choose another", kind, name.c_str());
  if (w.find_body(name) || w.find_obstacle(name))
    fail(DFM_E_ARG, "%s '%s': the name is taken in this world; names are unique", kind, name.c_str());
}

void check_mesh(const dfm_body_def &def, const Body &b) {
  if (def.npoint < 4 || def.ntet < 1 || !def.points || !def.tets)
    refuse(b, " has %u points and %u tetrahedra; it needs at least 4 points and 1 tetrahedron", def.npoint,
           def.ntet);
  const bool others = def.cell != 0 && def.cell != DFM_CELL_TET;
  if (others != (def.cells != nullptr))
    refuse(b,
           ": cell is %u and cells is %s; tetrahedra need no cells, and other kinds need both, as "
           "dfm_mesh_get_info gives them",
           def.cell, def.cells ? "set" : "NULL");
  for (uint32_t i = 0; i < def.npoint; ++i)
    if (!all_finite(def.points + size_t(3) * i, 3)) refuse(b, ": point %u is not finite", i);
  std::vector<uint8_t> used(def.npoint);
  for (uint32_t t = 0; t < def.ntet; ++t) {
    const uint32_t *const c = def.tets + size_t(4) * t;
    for (int k = 0; k < 4; ++k) {
      if (c[k] >= def.npoint) refuse(b, ": tetrahedron %u names point %u of %u", t, c[k], def.npoint);
      used[c[k]] = 1;
    }
    if (!(tet_volume(def.points, 3, c) > 0))
      refuse(
          b,
          ": tetrahedron %u has no positive volume; reverse or remove it (deform mesh info shows such cells)",
          t);
  }
  const auto unused = std::find(used.begin(), used.end(), uint8_t(0));
  if (unused != used.end())
    refuse(b, ": point %td belongs to no tetrahedron and would have no mass; drop it", unused - used.begin());
}

void place_phyxels(Body &b, const dfm_body_def &def) {
  Phyxels &p = b.p;
  const Pose pose = to_pose(def.pose);
  Vec3 com;
  for (uint32_t i = 0; i < p.n; ++i) {
    const Vec3 x = place(pose, load3(def.points + size_t(3) * i));
    store3(&p.x[size_t(i) * kStride], x);
    com += p.mass[i] * x;
  }
  com = (1 / b.mass) * com;
  for (uint32_t i = 0; i < p.n; ++i) {
    const Vec3 v = load3(def.velocity) + cross(load3(def.spin), p.x_at(i) - com);
    for (int k = 0; k < 3; ++k) p.v[size_t(i) * kStride + size_t(k)] = p.held[i] & (1 << k) ? 0 : v[k];
  }
}

// Copies, valid after the def and its materials are gone.
void keep_composition(World &w, Body &b, const dfm_body_def &def, const CellMaterials &cells) {
  for (const Material *m : cells.list) b.composition.materials.push_back(*m);
  b.composition.of = cells.of;
  for (uint32_t i = 0; i < def.nfield; ++i) {
    const dfm_cell_field &f = def.fields[i];
    b.composition.given.push_back(
        {f.key, "field", f.width,
         Array<double>(f.values, f.values + size_t(f.width) * def.ntet, w.memory())});
  }
}

void take_inside(Body &b, const dfm_body_def &def) {
  if (b.cell_type != DFM_CELL_HEX8)
    refuse(b, DFM_E_UNSUPPORTED, ": cell_inside is for hexahedra; its cells are %s",
           cell_kind(b.cell_type).name);
  const size_t n = b.cells.size() / 8 * kInsidePoints;
  b.inside = Array<double>(def.cell_inside, def.cell_inside + n, b.cells.get_allocator());
  for (size_t c = 0; c < n; c += kInsidePoints) {
    double material = 0;
    for (size_t q = 0; q < kInsidePoints; ++q) material += b.inside[c + q];
    if (!(material > 0 && material < HUGE_VAL))
      refuse(b, ": the weights of cell %zu in cell_inside sum to %g; expected more than 0", c / kInsidePoints,
             material);
  }
}

// Points at rest, without mass and place, and cells.
void take_points(World &w, Body &b, const dfm_body_def &def) {
  const Memory &m = w.memory();
  Phyxels &p = b.p;
  p.size(m, def.npoint);
  std::copy_n(def.points, p.rest.size(), p.rest.begin());
  if (def.fixed)
    for (uint32_t i = 0; i < p.n; ++i) p.held[i] = def.fixed[i] & 7;
  b.tets = Array<uint32_t>(def.tets, def.tets + size_t(4) * def.ntet, m);
  if (def.cells) {
    const CellKind &kind = cell_kind(def.cell);
    b.cell_type = kind.kind;
    b.cells = Array<uint32_t>(def.cells, def.cells + size_t(def.ntet / kind.tets) * kind.nodes, m);
    if (def.ntet % kind.tets || tets_of(m, kind, b.cells) != b.tets)
      refuse(b, ": its tetrahedra are not those of its %s; give both as dfm_mesh_get_info does", kind.name);
    if (def.cell_share)
      refuse(b, DFM_E_UNSUPPORTED, ": cell_share is for tetrahedra; %s take cell_inside, if any", kind.name);
  }
  if (def.cell_inside) take_inside(b, def);
  if (def.cell_share) b.share = Array<double>(def.cell_share, def.cell_share + def.ntet, m);
}

void take_model(World &w, Body &b, const dfm_body_def &def, const CellMaterials &materials) {
  const Registry &types = w.context->registry;
  const dfm_type &type =
      def.model ? types.find(DFM_KIND_MODEL, def.model) : default_model(types, b.cell_type);
  check_fields(type, def, b);
  keep_composition(w, b, def, materials);
  ModelOrigin origin{keep_params(type, def.model_params),
                     to_pose(def.pose),
                     static_cast<uint32_t>(def.integrator),
                     {b.p.held.begin(), b.p.held.end()}};
  const auto make = [&] { exchange(b, *make_body_model(w, b, type, origin, def.integrator)); };
  make();
  if (def.mass_scaling != 0) {
    set_scaled_mass(b, def.mass_scaling);
    make();
  }
  b.first_model = model_hash(b);
}

// The thing is complete: from here on it is the world's. Whatever may fail comes first.
template <class Thing>
void add_to_world(World &w, Kind kind, std::unique_ptr<Thing> thing,
                  std::vector<std::unique_ptr<Thing>> &list) {
  list.reserve(list.size() + 1);
  w.overlaps.place(w.next_id);
  thing->handle = handle_create(kind, thing.get());
  thing->id = w.next_id++;
  list.push_back(std::move(thing));
  w.changed = true;
}

}  // namespace

Body &create_body(World &w, const dfm_body_def &def) {
  auto owned = std::make_unique<Body>();
  Body &b = *owned;
  b.world = &w;
  b.search = std::make_unique<SearchTree>(w.memory());
  b.name = name_of(w, def.name, "body");
  check_name(w, b.name, "body");
  check_mesh(def, b);
  if (!all_finite(def.pose.position, 3) || !all_finite(def.pose.rotation, 4) ||
      !all_finite(def.velocity, 3) || !all_finite(def.spin, 3))
    refuse(b, ": pose, velocity and spin must be finite");
  Material plain;
  plain.def = dfm_material_def_default();
  const CellMaterials materials = cell_materials(w, def, b, plain);
  check_share(def, b);
  if (def.material) b.material = resolve<Material>(Kind::material, def.material).name;
  b.category = def.category;
  b.collides_with = def.collides_with;
  b.user = def.user;

  take_points(w, b, def);
  lump_body(b, def, materials);
  update_inverse_mass(b.p);
  place_phyxels(b, def);
  const double far = largest_coordinate(b.p.x.data(), b.p.n, kStride);
  check_velocity(b, load3(def.velocity), load3(def.spin), far);

  b.edges = unique_edges(w.memory(), def.ntet, b.tets.data());
  make_body_surface(b, def.surface, def.smooth);
  check_resolved(b, far, b.surface.median_edge);
  if (def.surface) {
    b.coupling = def.surface->coupling;
    b.support = def.surface->support;
  }
  make_zones(b, def, materials, plain);
  use_memory(w.memory(), b.surfel_impulse);
  b.surfel_impulse.assign(size_t(3) * b.surface.nsurfel, 0.0);

  take_model(w, b, def, materials);
  b.tears = may_tear(b);
  if (b.tears) check_may_cut(b, b.model);

  reserve_sleep(w, *w.steps, static_cast<uint32_t>(w.bodies.size() + 1));
  add_to_world(w, Kind::body, std::move(owned), w.bodies);
  w.tearing += b.tears;
  warn_of_idle(b);
  warn_of_own_steps(b, b.model, def.integrator);
  for (const LeftOut &o : left_out_of(b)) warn_of(*w.context, o);
  return b;
}

namespace {

constexpr uint32_t kVoxelCells = 262144, kMaxVoxelCells = 1u << 28, kFewestVoxelCells = 64;

// Points and triangles of a mesh or of voxels: checked and kept.
void take_triangles(Obstacle &o, const dfm_obstacle_def &def) {
  check_triangles(def, o, "");
  const Memory &m = o.world->meters.obstacles.memory();
  o.points = Array<double>(def.points, def.points + size_t(3) * def.npoint, m);
  o.triangles = Array<uint32_t>(def.triangles, def.triangles + size_t(3) * def.ntriangle, m);
  o.def.points = o.points.data();
  o.def.triangles = o.triangles.data();
}

void make_voxels(Obstacle &o, const Memory &memory) {
  const uint32_t cells = o.def.cells ? o.def.cells : kVoxelCells;
  if (cells < kFewestVoxelCells || cells > kMaxVoxelCells)
    refuse(o, ": %u cells; a grid has between %u and %u", cells, kFewestVoxelCells, kMaxVoxelCells);
  if (!ObstacleMesh(memory, o.def.npoint, o.points.data(), o.def.ntriangle, o.triangles.data()).closed)
    refuse(o,
           ": voxels need a closed surface, and this one has open edges or edges of more than two triangles, "
           "so no place is inside or outside; close it, or use the shape mesh, which takes open ones");
  if (!(signed_volume(o.triangles, [&](uint32_t i) { return load3(&o.points[3 * size_t{i}]); }) > 0))
    refuse(o,
           ": its surface encloses no volume or faces inward; reverse its triangles (dfm_mesh_create does)");
  o.grid = std::make_unique<VoxelGrid>(memory, o.points.data(), o.def.ntriangle, o.triangles.data(), cells);
  const VoxelGrid &g = *o.grid;
  o.world->context->logf(DFM_LOG_INFO,
                         "obstacle '%s': voxels of %g m in %.1f MB; distances are wrong by at most %g m at "
                         "the centers of its triangles",
                         o.name.c_str(), g.cell(), 1e-6 * double(g.bytes()), g.error());
  if (g.error() > 0.25 * g.cell())
    o.world->context->warn(o,
                           ": its voxels of %g m are too coarse: distances are wrong by %g m somewhere, as "
                           "where walls are thinner than two cells; ask for more cells or use the shape mesh",
                           g.cell(), g.error());
}

}  // namespace

std::unique_ptr<Obstacle> make_obstacle(World &w, const dfm_obstacle_def &def, bool rigid) {
  auto owned = std::make_unique<Obstacle>();
  Obstacle &o = *owned;
  o.world = &w;
  o.search = std::make_unique<SearchTree>(w.meters.obstacles.memory());
  o.name = name_of(w, def.name, "obstacle");
  check_name(w, o.name, "obstacle");
  if (def.shape > DFM_SHAPE_NONE || (def.shape == DFM_SHAPE_NONE && !rigid))
    refuse(o, ": shape %u is unknown; use DFM_SHAPE_PLANE, SPHERE, BOX, CAPSULE, MESH or VOXELS", def.shape);
  if (!all_finite(def.pose.position, 3) || !all_finite(def.pose.rotation, 4) ||
      !all_finite(def.velocity_surface, 3) || !all_finite(def.sine.amplitude, 3) ||
      !all_finite(&def.sine.frequency, 1) || !all_finite(&def.sine.phase, 1))
    refuse(o, ": pose, sine and velocity_surface must be finite");
  if ((def.shape == DFM_SHAPE_SPHERE || def.shape == DFM_SHAPE_CAPSULE) &&
      !(def.radius > 0 && std::isfinite(def.radius)))
    refuse(o, ": radius %g m; it must be positive and finite", def.radius);
  if (def.shape == DFM_SHAPE_CAPSULE && !(def.half_length >= 0 && std::isfinite(def.half_length)))
    refuse(o, ": half_length %g m; it must be finite and not negative", def.half_length);
  if (def.shape == DFM_SHAPE_BOX)
    for (double s : def.half_size)
      if (!(s > 0 && std::isfinite(s)))
        refuse(o, ": half_size %g m; all three must be positive and finite", s);
  if (def.material) {
    const Material &m = resolve<Material>(Kind::material, def.material);
    if (m.world != &w) refuse(o, DFM_E_HANDLE, ": its material belongs to another world");
    o.material = m.name;
    o.zone = {"", m.name, friction_of(m)};
  }
  o.def = def;
  if (def.nkey && !def.keys) refuse(o, ": %u keys are announced, but keys is NULL", def.nkey);
  if (def.nkey) o.keys.assign(def.keys, def.keys + def.nkey);
  check_keys(o.keys, o.name.c_str());
  o.def.keys = nullptr;
  o.def.nkey = 0;
  o.def.points = nullptr;
  o.def.triangles = nullptr;
  if (def.shape == DFM_SHAPE_MESH || def.shape == DFM_SHAPE_VOXELS) take_triangles(o, def);
  else o.def.npoint = o.def.ntriangle = 0;
  if (def.shape == DFM_SHAPE_MESH)
    o.mesh = std::make_unique<ObstacleMesh>(w.meters.obstacles.memory(), def.npoint, o.points.data(),
                                            def.ntriangle, o.triangles.data());
  if (def.shape == DFM_SHAPE_VOXELS) make_voxels(o, w.meters.obstacles.memory());
  o.pose = o.pose_at_time(w.time);
  check_motion_speed(w, o);
  check_velocity(o, load3(def.velocity_surface));
  o.def.name = o.name.c_str();
  return owned;
}

Obstacle &add_obstacle(World &w, std::unique_ptr<Obstacle> obstacle) {
  Obstacle &o = *obstacle;
  wake_all(w);  // it may be where a body sleeps
  add_to_world(w, Kind::obstacle, std::move(obstacle), w.obstacles);
  return o;
}

Obstacle &create_obstacle(World &w, const dfm_obstacle_def &def) {
  return add_obstacle(w, make_obstacle(w, def, false));
}

void end_contacts(World &w, uint64_t id, bool obstacle) {
  reserve_events(w, w.store.n + w.attachments.size() + w.sensed.size() + w.rigid_touching.size());
  end_idle(w);
  drop_attachments(w, id);
  if (obstacle) wake_touching(w, id);
  else wake(w, *w.body(id));
  end_sensor_overlaps(w, id);
  ContactStore &s = w.store;
  for (uint32_t i = 0; i < s.n; ++i)
    if ((s.id_a[i] == id || s.id_b[i] == id)) {
      if (s.touching[i]) add_event(w, DFM_EVENT_END, s.id_a[i], s.id_b[i], s.key[i], w.time);
      s.touching[i] = 0;
    }
  end_rigid_contacts(w, id);
  std::erase_if(w.work, [&](const PairWork &p) { return p.a == id || p.b == id; });
  w.watch.made = w.watch.rubbed = 0;  // the limit is that of the bodies that are left
  w.changed = true;
}

namespace {

// Rules that name the removed thing are removed too.
void forget(World &w, uint64_t handle, const std::string &name) {
  const auto goes = [&](const std::string &side) {  // "body:GROUP" may also be the full name of another body
    return names(side, name) && (side == name || (!w.find_body(side) && !w.find_obstacle(side)));
  };
  const auto named = [&](const auto &rule) { return goes(rule.between[0]) || goes(rule.between[1]); };
  std::erase_if(w.friction, named);
  std::erase_if(w.filters, named);
  handle_destroy(handle);
  w.changed = true;
}

// Called when the body that the host made is destroyed: its pieces become bodies like any other.
// Those without cells go with it: no list has them, so that the host could not find what a restore refuses.
void orphan_pieces(World &w, const Body &whole) {
  for (auto &p : w.bodies) {
    if (p->piece_of != whole.id) continue;
    p->piece_of = 0;
    p->whole_name.clear();
  }
  const auto is_piece = [&](const auto &p) { return p->piece_of == whole.id; };
  for (auto *list : {&w.emptied, &w.rolled_back})
    for (auto at = list->begin(); (at = std::find_if(list->begin(), list->end(), is_piece)) != list->end();)
      destroy_body(**at);
}

}  // namespace

void destroy_body(Body &b) {
  World &w = *b.world;
  if (b.rolled_back) {
    handle_destroy(b.handle);
    std::erase_if(w.rolled_back, [&](auto &p) { return p.get() == &b; });
    return;
  }
  if (!b.piece_of) orphan_pieces(w, b);
  if (!b.emptied) {
    end_contacts(w, b.id, false);  // may lack memory, so first
    w.sensors -= b.sensor;
  }
  w.tearing -= b.tears;
  forget(w, b.handle, b.name);
  std::erase_if(b.emptied ? w.emptied : w.bodies, [&](auto &p) { return p.get() == &b; });
  w.bound.body = nullptr;
}

void destroy_obstacle(Obstacle &o) {
  World &w = *o.world;
  end_contacts(w, o.id, true);  // may lack memory, so first
  w.sensors -= o.sensor;
  forget(w, o.handle, o.name);
  std::erase_if(w.obstacles, [&](auto &p) { return p.get() == &o; });
}

}  // namespace dfm
