// deform/deform.hpp -- the C API for C++20: handles that end what they own, spans for arrays, errors as
// exceptions or as values. Header only. Every function costs what the C function costs that it is named
// after, and allocates only where it returns a std::vector or std::string. Comments of the C headers hold:
// units, errors, threads. doc/howto/cpp.md
//
//   #include <deform/deform.hpp>
//   auto context = deform::Context::make();  // throws deform::Error with the library's sentence
//   auto world = context.make_world();
//   world.add_obstacle(deform::ObstacleDef{});
//   deform::BodyDef def;
//   const auto mesh = context.make_tets("ball", {0.1}, 500);
//   def.set_mesh(mesh);
//   const deform::Body ball = world.add_body(def);
//   for (int i = 0; i < 500; ++i) world.step(1e-3);
//
// The same names in deform::values return Result<T> instead of throwing. Without exceptions
// (-fno-exceptions), or with DEFORM_ERRORS_AS_VALUES defined, the names in deform are those.
//
// Two kinds of handles, both as large as the C handle. A plain one (Body, World, ..) refers: copies are
// free, nothing ends with it, a stale one answers DFM_E_HANDLE. Unique<Body>, Unique<World>, .. ends what it
// refers to. What lives in a context (worlds, scenes, meshes, laws) is handed out as Unique; what lives in a
// world (bodies, obstacles, materials) as a plain handle that ends with the world, or earlier by destroy()
// or in a Unique.
#ifndef DEFORM_DEFORM_HPP
#define DEFORM_DEFORM_HPP
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <type_traits>
#include <vector>

#include "deform/attach.hpp"
#include "deform/cut.hpp"
#include "deform/defs.hpp"
#include "deform/deform.h"
#include "deform/models.hpp"
#include "deform/obstacles.hpp"
#include "deform/queries.hpp"
#include "deform/result.hpp"
#include "deform/tools.hpp"

namespace deform {

// The classes. A parameter selects how they report errors: Throw or Values.
namespace basic {

// ---- materials, laws --------------------------------------------------------------------------------------
template <class E>
class Material : public Handle<dfm_material, struct MaterialKind> {
 public:
  using Handle::Handle;
  static void end(dfm_material m) noexcept { dfm_material_destroy(m); }
  auto destroy() const { return E::done(dfm_material_destroy(raw_)); }
};

template <class E>
class Law : public Handle<dfm_law, struct LawKind> {
 public:
  using Handle::Handle;
  static void end(dfm_law law) noexcept { dfm_law_close(law); }
  auto close() const { return E::done(dfm_law_close(raw_)); }
  auto type() const {
    return produce<E, const dfm_type *>([&](const dfm_type *&t) { return dfm_law_type(raw_, &t); });
  }
  // False: the law discarded the batch, nothing in out counts.
  auto eval(const dfm_friction_in &in, dfm_friction_out &out) const {
    return produce<E, bool>([&](bool &counts) {
      const dfm_status s = dfm_law_eval(raw_, &in, &out);
      counts = s == DFM_OK;
      return s;
    });
  }
  auto pack(const dfm_params &params, std::span<double> values) const {
    return produce<E, uint32_t>(
        [&](uint32_t &n) { return dfm_law_pack(raw_, &params, rows(values.size(), 1), values.data(), &n); });
  }
  auto pack(const dfm_params &params) const {
    return produce<E, std::vector<double>>([&](std::vector<double> &out) {
      uint32_t n = 0;
      const dfm_status s = dfm_law_pack(raw_, &params, 0, nullptr, &n);
      if (s < 0 || n == 0) return s;
      out.resize(n);
      return dfm_law_pack(raw_, &params, n, out.data(), &n);
    });
  }
};

// ---- meshes -----------------------------------------------------------------------------------------------
template <class E>
class Mesh : public Handle<dfm_mesh_handle, struct MeshKind> {
 public:
  using Handle::Handle;
  static void end(dfm_mesh_handle mesh) noexcept { dfm_mesh_destroy(mesh); }
  auto destroy() const { return E::done(dfm_mesh_destroy(raw_)); }
  // Counts, sizes, groups, and the arrays, which are borrowed: valid while the mesh lives.
  auto info() const {
    return produce<E, dfm_mesh_info>([&](dfm_mesh_info &i) {
      i.size = sizeof i;
      return dfm_mesh_get_info(raw_, &i);
    });
  }
  // Those arrays as spans that every mesh has.
  auto data() const {
    return produce<E, MeshData>([&](MeshData &d) {
      dfm_mesh_info i = sized<dfm_mesh_info>();
      const dfm_status s = dfm_mesh_get_info(raw_, &i);
      if (s >= 0)
        d = {{i.points, size_t{3} * i.npoint}, {i.tets, size_t{4} * i.ntet}, {i.faces, size_t{3} * i.nface}};
      return s;
    });
  }
  auto write(Text path) const { return E::done(dfm_mesh_write(raw_, path.c_str)); }
  // The same shape with points in the middles of the edges.
  auto second_order() const {
    return produce<E, Unique<Mesh<E>>>([&](auto &mesh) { return dfm_mesh_second_order(raw_, mesh.put()); });
  }
  // Tetrahedra inside of a surface.
  auto fill(uint32_t cells) const {
    return produce<E, Unique<Mesh<E>>>([&](auto &mesh) { return dfm_mesh_fill(raw_, cells, mesh.put()); });
  }
  // A coarse grid of hexahedra under a surface, by their number (size 0) or edge (cells 0).
  auto lattice(uint32_t cells, double size = 0) const {
    return produce<E, Unique<Mesh<E>>>(
        [&](auto &mesh) { return dfm_mesh_lattice(raw_, cells, size, mesh.put()); });
  }
  // Points, cells and their material into a def that borrows them.
  auto give_to(dfm_body_def &def) const {
    dfm_mesh_info i = sized<dfm_mesh_info>();
    const dfm_status s = dfm_mesh_get_info(raw_, &i);
    if (s >= 0) {
      def.npoint = i.npoint;
      def.points = i.points;
      def.ntet = i.ntet;
      def.tets = i.tets;
      def.cell = i.cell;
      def.cells = i.cells;
      def.cell_inside = i.inside;
      def.cell_share = i.share;
    }
    return E::done(s);
  }
};

// ---- bodies -----------------------------------------------------------------------------------------------
template <class E>
class Body : public Handle<dfm_body, struct BodyKind>,
             public BodyModels<E, Body<E>>,
             public BodyAttachments<E, Body<E>>,
             public BodyCuts<E, Body<E>>,
             public BodyQueries<E, Body<E>> {
 public:
  using Handle::Handle;
  static void end(dfm_body body) noexcept { dfm_body_destroy(body); }
  auto destroy() const { return E::done(dfm_body_destroy(raw_)); }
  auto info() const {
    return produce<E, dfm_body_info>([&](dfm_body_info &i) {
      i.size = sizeof i;
      return dfm_body_get_info(raw_, &i);
    });
  }
  auto measure() const {
    return produce<E, dfm_body_measure>([&](dfm_body_measure &m) {
      m.size = sizeof m;
      return dfm_body_get_measure(raw_, &m);
    });
  }
  auto set_user(void *user) const { return E::done(dfm_body_set_user(raw_, user)); }
  auto set_filter(uint32_t category, uint32_t collides_with) const {
    return E::done(dfm_body_set_filter(raw_, category, collides_with));
  }
  auto set_params(const dfm_params &params) const { return E::done(dfm_body_set_params(raw_, &params)); }

  // Points: x, v [npoint,3]; an empty span leaves that one out. Returns npoint.
  auto state(std::span<double> x, std::span<double> v) const {
    const size_t room = x.empty()             ? v.size()
                        : v.empty()           ? x.size()
                        : x.size() < v.size() ? x.size()
                                              : v.size();
    return produce<E, uint32_t>(
        [&](uint32_t &n) { return dfm_body_get_state(raw_, rows(room, 3), given(x), given(v), &n); });
  }
  auto set_state(std::span<const double> x, std::span<const double> v) const {
    if (!x.empty() && !v.empty() && x.size() != v.size()) return E::done(spans_disagree);
    return E::done(dfm_body_set_state(raw_, rows(x.empty() ? v.size() : x.size(), 3), given(x), given(v)));
  }
  auto positions() const {
    return collect<E, 3>(
        +[](dfm_body b, uint32_t room, double *x, uint32_t *n) {
          return dfm_body_get_state(b, room, x, nullptr, n);
        },
        raw_);
  }
  auto velocities() const {
    return collect<E, 3>(
        +[](dfm_body b, uint32_t room, double *v, uint32_t *n) {
          return dfm_body_get_state(b, room, nullptr, v, n);
        },
        raw_);
  }
  auto rest(std::span<double> x, std::span<uint32_t> tets) const {
    return E::done(dfm_body_get_rest(raw_, rows(x.size(), 3), given(x), rows(tets.size(), 4), given(tets)));
  }
  auto energy_density(std::span<double> out) const {
    return E::done(dfm_body_energy_density(raw_, rows(out.size(), 1), out.data()));
  }
  auto stress(std::span<double> out) const {
    return E::done(dfm_body_stress(raw_, rows(out.size(), 6), out.data()));
  }
  auto point_stress(std::span<double> out) const {
    return E::done(dfm_body_point_stress(raw_, rows(out.size(), 6), out.data()));
  }

  auto hold(std::span<const uint32_t> points, uint8_t axes = 7) const {
    return E::done(dfm_body_hold(raw_, rows(points.size(), 1), points.data(), axes));
  }
  auto move_held(std::span<const uint32_t> points, std::span<const dfm_pose_key> keys,
                 const dfm_sine *sine = nullptr) const {
    return E::done(dfm_body_move_held(raw_, rows(points.size(), 1), points.data(), rows(keys.size(), 1),
                                      keys.data(), sine));
  }
  // force [points.size(), 3] N. Returns the load's number.
  auto add_load(std::span<const uint32_t> points, std::span<const double> force,
                std::span<const dfm_scale_key> keys = {}, const dfm_sine *sine = nullptr) const {
    return produce<E, uint32_t>([&](uint32_t &load) {
      if (force.size() != 3 * points.size()) return spans_disagree;
      return dfm_body_add_load(raw_, rows(points.size(), 1), points.data(), force.data(),
                               rows(keys.size(), 1), keys.data(), sine, &load);
    });
  }
  auto remove_load(uint32_t load) const { return E::done(dfm_body_remove_load(raw_, load)); }
  // Returns the spring's number.
  auto add_spring(const dfm_spring_def &def) const {
    return produce<E, uint32_t>([&](uint32_t &spring) { return dfm_body_add_spring(raw_, &def, &spring); });
  }
  auto set_spring_target(uint32_t spring, In3 to) const {
    return E::done(dfm_body_set_spring_target(raw_, spring, to.data()));
  }
  auto spring_force(uint32_t spring) const {
    return produce<E, std::array<double, 3>>(
        [&](std::array<double, 3> &force) { return dfm_body_get_spring_force(raw_, spring, force.data()); });
  }
  auto remove_spring(uint32_t spring) const { return E::done(dfm_body_remove_spring(raw_, spring)); }
  auto apply_impulse(In3 point, In3 impulse) const {
    return E::done(dfm_body_apply_impulse(raw_, point.data(), impulse.data()));
  }
  auto asleep() const {
    return produce<E, bool>([&](bool &asleep) { return dfm_body_is_asleep(raw_, &asleep); });
  }
  auto wake() const { return E::done(dfm_body_wake(raw_)); }

  // Surface: into the caller's memory, returning how many surfels or triangles, or as a vector.
  auto surface_positions(std::span<double> out) const { return fill<E, 3>(dfm_surface_positions, raw_, out); }
  auto surface_velocities(std::span<double> out) const {
    return fill<E, 3>(dfm_surface_velocities, raw_, out);
  }
  auto surface_normals(std::span<double> out) const { return fill<E, 3>(dfm_surface_normals, raw_, out); }
  auto surface_forces(std::span<double> out) const { return fill<E, 3>(dfm_surface_forces, raw_, out); }
  auto surface_triangles(std::span<uint32_t> out) const {
    return fill<E, 3>(dfm_surface_triangles, raw_, out);
  }
  auto surface_points(std::span<uint32_t> out) const { return fill<E, 1>(dfm_surface_points, raw_, out); }
  auto surface_positions() const { return collect<E, 3>(dfm_surface_positions, raw_); }
  auto surface_velocities() const { return collect<E, 3>(dfm_surface_velocities, raw_); }
  auto surface_normals() const { return collect<E, 3>(dfm_surface_normals, raw_); }
  auto surface_forces() const { return collect<E, 3>(dfm_surface_forces, raw_); }
  auto surface_triangles() const { return collect<E, 3>(dfm_surface_triangles, raw_); }
  auto surface_points() const { return collect<E, 1>(dfm_surface_points, raw_); }

  auto displacements(std::span<double> out) const { return fill<E, 3>(dfm_debug_displacements, raw_, out); }
  auto surface_displacements(std::span<double> out) const {
    return fill<E, 3>(dfm_debug_surface_displacements, raw_, out);
  }
  auto displacements() const { return collect<E, 3>(dfm_debug_displacements, raw_); }
  auto surface_displacements() const { return collect<E, 3>(dfm_debug_surface_displacements, raw_); }
  auto write(Text path) const { return E::done(dfm_debug_write_body(raw_, path.c_str)); }
  auto write_surface(Text path) const { return E::done(dfm_debug_write_surface(raw_, path.c_str)); }
};

// ---- the world --------------------------------------------------------------------------------------------
template <class E>
class World : public Handle<dfm_world, struct WorldKind>, public WorldQueries<E, World<E>> {
 public:
  using Handle::Handle;
  static void end(dfm_world world) noexcept { dfm_world_destroy(world); }
  auto destroy() const { return E::done(dfm_world_destroy(raw_)); }

  auto step(double dt) const {
    return produce<E, StepReport>([&](StepReport &r) {
      uint32_t trouble = 0;
      const dfm_status s = dfm_world_step(raw_, dt, &trouble);
      r = {trouble, s == DFM_DISCARD};
      return s;
    });
  }
  auto stable_step() const {
    return produce<E, StableStep>(
        [&](StableStep &s) { return dfm_world_stable_step(raw_, &s.dt, &s.body, &s.point); });
  }
  double time() const noexcept { return dfm_world_time(raw_); }
  uint64_t hash() const noexcept { return dfm_world_hash(raw_); }
  auto set_gravity(In3 g) const { return E::done(dfm_world_set_gravity(raw_, g.data())); }
  auto set_gravity(std::span<const dfm_vector_key> keys) const {
    return E::done(dfm_world_set_gravity_keys(raw_, rows(keys.size(), 1), keys.data()));
  }
  auto equilibrium(const EquilibriumDef &def = {}) const {
    return produce<E, dfm_equilibrium_info>([&](dfm_equilibrium_info &i) {
      i.size = sizeof i;
      return dfm_world_equilibrium(raw_, &def, &i);
    });
  }
  auto set_budget(double max_time, uint64_t max_work) const {
    return E::done(dfm_world_set_budget(raw_, max_time, max_work));
  }
  auto interrupt() const { return E::done(dfm_world_interrupt(raw_)); }
  auto set_sleep(bool sleep) const { return E::done(dfm_world_set_sleep(raw_, sleep)); }

  auto add_material(const dfm_material_def &def) const {
    return produce<E, Material<E>>([&](Material<E> &m) { return dfm_material_create(raw_, &def, m.put()); });
  }
  auto add_body(const dfm_body_def &def) const {
    return produce<E, Body<E>>([&](Body<E> &b) { return dfm_body_create(raw_, &def, b.put()); });
  }
  auto add_obstacle(const dfm_obstacle_def &def) const {
    return produce<E, Obstacle<E>>([&](Obstacle<E> &o) { return dfm_obstacle_create(raw_, &def, o.put()); });
  }
  // One rigid body without joints; host nullptr: "builtin".
  auto add_rigid(const dfm_rigid_def &def, Text host = nullptr) const {
    return produce<E, Rigid<E>>([&](Rigid<E> &r) {
      dfm_rigid_set_def set = sized<dfm_rigid_set_def>();
      set.nbody = 1;
      set.bodies = &def;
      return dfm_rigid_create(raw_, host.c_str, &set, r.put());
    });
  }
  // A set: out [set.nbody].
  auto add_rigids(const dfm_rigid_set_def &set, std::span<dfm_rigid> out, Text host = nullptr) const {
    return E::done(out.size() < set.nbody ? spans_disagree
                                          : dfm_rigid_create(raw_, host.c_str, &set, out.data()));
  }
  auto add_tool(const dfm_tool_def &def) const {
    return produce<E, Tool<E>>([&](Tool<E> &t) { return dfm_tool_create(raw_, &def, t.put()); });
  }
  auto add_friction(const dfm_friction_def &def) const { return E::done(dfm_world_add_friction(raw_, &def)); }
  auto add_friction(Text a, Text b, Text law, const dfm_params &params = {},
                    std::optional<double> restitution = {}) const {
    dfm_friction_def def = sized<dfm_friction_def>();
    if (restitution) {
      def.flags = DFM_FRICTION_RESTITUTION;
      def.restitution = *restitution;
    }
    def.between[0] = a.c_str;
    def.between[1] = b.c_str;
    def.law = law.c_str;
    def.params = params;
    return E::done(dfm_world_add_friction(raw_, &def));
  }
  auto set_friction(Text a, Text b, const dfm_params &params) const {
    return E::done(dfm_world_set_friction(raw_, a.c_str, b.c_str, &params));
  }
  auto remove_friction(Text a, Text b) const {
    return E::done(dfm_world_remove_friction(raw_, a.c_str, b.c_str));
  }
  auto remove_filter(Text a, Text b) const {
    return E::done(dfm_world_remove_filter(raw_, a.c_str, b.c_str));
  }
  auto filter_pair(Text a, Text b, bool collide) const {
    return E::done(dfm_world_filter_pair(raw_, a.c_str, b.c_str, collide));
  }

  auto find_body(Text name) const {
    return produce<E, Body<E>>([&](Body<E> &b) { return dfm_world_find_body(raw_, name.c_str, b.put()); });
  }
  auto memory() const {
    return produce<E, dfm_memory>([&](dfm_memory &m) {
      m.size = sizeof m;
      return dfm_world_memory(raw_, &m);
    });
  }
  // How many things a scene cannot say: 0, or with DFM_SCENE_PARTIAL more.
  auto write_scene(Text path, const dfm_scene_write_def *def = nullptr) const {
    return produce<E, uint32_t>(
        [&](uint32_t &notes) { return dfm_world_write_scene(raw_, path.c_str, def, &notes); });
  }
  auto find_obstacle(Text name) const {
    return produce<E, Obstacle<E>>(
        [&](Obstacle<E> &o) { return dfm_world_find_obstacle(raw_, name.c_str, o.put()); });
  }
  auto find_rigid(Text name) const {
    return produce<E, Rigid<E>>([&](Rigid<E> &r) { return dfm_world_find_rigid(raw_, name.c_str, r.put()); });
  }
  auto find_tool(Text name) const {
    return produce<E, Tool<E>>([&](Tool<E> &t) { return dfm_world_find_tool(raw_, name.c_str, t.put()); });
  }
  auto bodies() const { return collect_handles<E, Body<E>>(dfm_world_bodies, raw_); }
  auto obstacles() const { return collect_handles<E, Obstacle<E>>(dfm_world_obstacles, raw_); }
  auto rigids() const { return collect_handles<E, Rigid<E>>(dfm_world_rigids, raw_); }
  auto tools() const { return collect_handles<E, Tool<E>>(dfm_world_tools, raw_); }
  auto tools(std::span<dfm_tool> out) const { return fill<E, 1>(dfm_world_tools, raw_, out); }
  auto bodies(std::span<dfm_body> out) const { return fill<E, 1>(dfm_world_bodies, raw_, out); }
  auto obstacles(std::span<dfm_obstacle> out) const { return fill<E, 1>(dfm_world_obstacles, raw_, out); }
  auto rigids(std::span<dfm_rigid> out) const { return fill<E, 1>(dfm_world_rigids, raw_, out); }
  // States of all rigid bodies, in the order of rigids(); `rigids`: empty, or which body each is.
  auto rigid_states(std::span<dfm_rigid_state> out, std::span<dfm_rigid> rigids = {}) const {
    return produce<E, uint32_t>([&](uint32_t &n) {
      if (!rigids.empty() && rigids.size() != out.size()) return spans_disagree;
      return dfm_world_rigid_states(raw_, uint32_t(out.size()), given(rigids), out.data(), &n);
    });
  }

  // What a step did: into the caller's memory, returning how many, or as a vector.
  auto contacts(std::span<dfm_contact> out) const {
    return fill_rows<E>(dfm_world_contacts_sized, raw_, out);
  }
  auto pairs(std::span<dfm_pair_report> out) const { return fill_rows<E>(dfm_world_pairs_sized, raw_, out); }
  auto events(std::span<dfm_contact_event> out) const {
    return fill_rows<E>(dfm_world_events_sized, raw_, out);
  }
  auto profile(std::span<dfm_stage_time> out) const {
    return fill_rows<E>(dfm_world_profile_sized, raw_, out);
  }
  auto overlaps(std::span<dfm_overlap> out) const {
    return fill_rows<E>(dfm_world_overlaps_sized, raw_, out);
  }
  auto contacts() const { return collect_rows<E>(dfm_world_contacts_sized, raw_); }
  auto pairs() const { return collect_rows<E>(dfm_world_pairs_sized, raw_); }
  auto pair_impulses(std::span<dfm_pair_impulse> out) const {
    return fill_rows<E>(dfm_world_pair_impulses_sized, raw_, out);
  }
  auto pair_impulses() const { return collect_rows<E>(dfm_world_pair_impulses_sized, raw_); }
  auto events() const { return collect_rows<E>(dfm_world_events_sized, raw_); }
  auto swaps(std::span<dfm_swap> out) const { return fill_rows<E>(dfm_world_swaps_sized, raw_, out); }
  auto swaps() const { return collect_rows<E>(dfm_world_swaps_sized, raw_); }
  auto profile() const { return collect_rows<E>(dfm_world_profile_sized, raw_); }
  auto overlaps() const { return collect_rows<E>(dfm_world_overlaps_sized, raw_); }
  // pairs that overlap still
  auto untangle() const {
    return produce<E, uint32_t>([&](uint32_t &left) { return dfm_world_untangle(raw_, &left); });
  }
  auto find_overlaps() const {
    return produce<E, uint32_t>([&](uint32_t &n) { return dfm_world_find_overlaps(raw_, &n); });
  }
  // The law behind dfm_contact.law; its pointers are borrowed until a rule of friction changes.
  auto law_info(uint32_t law) const {
    return produce<E, dfm_law_info>([&](dfm_law_info &info) {
      info.size = sizeof info;
      return dfm_world_law_info(raw_, law, &info);
    });
  }
  auto stats() const {
    return produce<E, dfm_world_stats>([&](dfm_world_stats &s) {
      s.size = sizeof s;
      return dfm_world_get_stats(raw_, &s);
    });
  }
  // a, b: handles of bodies, obstacles or rigid bodies. On a, about point.
  template <class A, class B>
  auto pair_wrench(A a, B b, In3 point) const {
    return produce<E, Wrench>([&](Wrench &w) {
      return dfm_world_pair_wrench(raw_, a.get(), b.get(), point.data(), w.force.data(), w.moment.data());
    });
  }
  auto hold_begin() const { return E::done(dfm_world_hold_begin(raw_)); }
  auto hold() const {
    return produce<E, HoldReport>([&](HoldReport &h) { return dfm_world_hold(raw_, &h.creep, &h.count); });
  }
  auto explain() const {
    return collect_text<E>([&](char *text, size_t *bytes) { return dfm_world_explain(raw_, text, bytes); });
  }

  // Returns the bytes used; an empty span only asks how many are needed.
  auto snapshot(std::span<std::byte> out) const {
    return produce<E, size_t>([&](size_t &bytes) {
      bytes = out.size();
      return dfm_world_snapshot(raw_, given(out), &bytes);
    });
  }
  auto snapshot() const {
    return collect_bytes<E>([&](void *out, size_t *bytes) { return dfm_world_snapshot(raw_, out, bytes); });
  }
  // Packets for viewers elsewhere, one behind the other.
  auto stream(const dfm_stream_def &def = StreamDef()) const {
    return collect_bytes<E>(
        [&](void *out, size_t *bytes) { return dfm_world_stream(raw_, &def, out, bytes); });
  }
  static auto pack_stream(std::span<const std::byte> packet, const dfm_stream_def &def = StreamDef()) {
    return collect_bytes<E>([&](void *out, size_t *bytes) {
      return dfm_stream_pack(packet.data(), packet.size(), &def, out, bytes);
    });
  }
  auto restore(std::span<const std::byte> from) const {
    return E::done(dfm_world_restore(raw_, from.data(), from.size()));
  }

  // line(std::span<const double, 3> a, std::span<const double, 3> b, uint32_t rgb) for each;
  // what: DFM_DRAW_*.
  template <class F>
  auto draw(uint32_t what, F &&line) const {
    typename E::template Call<std::remove_reference_t<F>> call{line};
    const dfm_status s = dfm_debug_draw(
        raw_, what,
        [](void *user, const double a[3], const double b[3], uint32_t rgb) {
          (*static_cast<decltype(call) *>(user))(In3(a, 3), In3(b, 3), rgb);
        },
        &call);
    call.rethrow();
    return E::done(s);
  }
};

// ---- scenes -----------------------------------------------------------------------------------------------
template <class E>
class Scene : public Handle<dfm_scene, struct SceneKind> {
 public:
  using Handle::Handle;
  static void end(dfm_scene scene) noexcept { dfm_scene_close(scene); }
  auto close() const { return E::done(dfm_scene_close(raw_)); }
  auto world() const {
    return produce<E, World<E>>([&](World<E> &w) { return dfm_scene_world(raw_, w.put()); });
  }
  auto settings() const {
    return produce<E, dfm_scene_settings>([&](dfm_scene_settings &s) {
      s.size = sizeof s;
      return dfm_scene_get_settings(raw_, &s);
    });
  }
  auto value(Text pointer) const {
    return collect_text<E>(
        [&](char *text, size_t *bytes) { return dfm_scene_value(raw_, pointer.c_str, text, bytes); });
  }
  auto probe(uint32_t index) const {
    return produce<E, ProbeState>([&](ProbeState &p) {
      return dfm_scene_probe(raw_, index, &p.name, p.position.data(), p.velocity.data());
    });
  }
  // As World::write_scene, with the scene's probes and outputs.
  auto write(Text path, const dfm_scene_write_def *def = nullptr) const {
    return produce<E, uint32_t>(
        [&](uint32_t &notes) { return dfm_scene_write(raw_, path.c_str, def, &notes); });
  }
};

// ---- the context ------------------------------------------------------------------------------------------
template <class E>
class Context : public Handle<dfm_context *, struct ContextKind> {
 public:
  using Handle::Handle;
  static void end(dfm_context *context) noexcept { dfm_context_destroy(context); }
  static auto make(const dfm_context_def &def = ContextDef()) {
    return produce<E, Unique<Context>>([&](auto &c) { return dfm_context_create(&def, c.put()); });
  }

  auto make_world(const dfm_world_def &def = WorldDef()) const {
    return produce<E, Unique<World<E>>>([&](auto &w) { return dfm_world_create(raw_, &def, w.put()); });
  }
  auto load_scene(Text path) const {
    return produce<E, Unique<World<E>>>([&](auto &w) { return dfm_scene_load(raw_, path.c_str, w.put()); });
  }
  auto open_scene(Text path, const dfm_scene_options *options = nullptr) const {
    return produce<E, Unique<Scene<E>>>(
        [&](auto &s) { return dfm_scene_open(raw_, path.c_str, options, s.put()); });
  }
  auto open_law(Text id_or_path) const {
    return produce<E, Unique<Law<E>>>(
        [&](auto &law) { return dfm_law_open(raw_, id_or_path.c_str, law.put()); });
  }

  // Cells, or where the file has none the surface (info().ntet is then 0); or what is asked for.
  auto load_mesh(Text path, uint32_t what = DFM_MESH_ANY) const {
    return produce<E, Unique<Mesh<E>>>(
        [&](auto &m) { return dfm_mesh_load(raw_, path.c_str, what, m.put()); });
  }
  auto make_tets(Text kind, const Size &size, uint32_t cells) const {
    return produce<E, Unique<Mesh<E>>>(
        [&](auto &m) { return dfm_mesh_make(raw_, kind.c_str, size.m, DFM_MESH_CELLS, cells, m.put()); });
  }
  auto make_surface(Text kind, const Size &size, uint32_t triangles) const {
    return produce<E, Unique<Mesh<E>>>([&](auto &m) {
      return dfm_mesh_make(raw_, kind.c_str, size.m, DFM_MESH_SURFACE, triangles, m.put());
    });
  }
  // A surface of the host's triangles: points [n,3], triangles [n,3].
  auto make_surface(std::span<const double> points, std::span<const uint32_t> triangles) const {
    return produce<E, Unique<Mesh<E>>>([&](auto &m) {
      return dfm_mesh_create(raw_, rows(points.size(), 3), points.data(), rows(triangles.size(), 3),
                             triangles.data(), m.put());
    });
  }

  auto load_plugin(Text path) const { return E::done(dfm_plugin_load(raw_, path.c_str)); }
  auto scan_plugins(Text directory) const {
    return produce<E, uint32_t>(
        [&](uint32_t &loaded) { return dfm_plugin_scan(raw_, directory.c_str, &loaded); });
  }
  auto register_plugin(dfm_plugin_fn entry, Text name) const {
    return E::done(dfm_plugin_register_static(raw_, entry, name.c_str));
  }
  // visit(const dfm_type &, const char *file) for every type known.
  template <class F>
  auto visit_plugins(F &&visit) const {
    typename E::template Call<std::remove_reference_t<F>> call{visit};
    const dfm_status s = dfm_plugin_visit(
        raw_,
        [](void *user, const dfm_type *type, const char *file) {
          (*static_cast<decltype(call) *>(user))(*type, file);
        },
        &call);
    call.rethrow();
    return E::done(s);
  }
  // visit(const char *file, const char *reason) for every file that discovery skipped.
  template <class F>
  auto visit_passed(F &&visit) const {
    typename E::template Call<std::remove_reference_t<F>> call{visit};
    const dfm_status s = dfm_plugin_visit_passed(
        raw_,
        [](void *user, const char *file, const char *reason) {
          (*static_cast<decltype(call) *>(user))(file, reason);
        },
        &call);
    call.rethrow();
    return E::done(s);
  }
};

// The plugin that the calling thread is in, or null (dfm_plugin_running).
inline const char *running_plugin(const char **what = nullptr) noexcept { return dfm_plugin_running(what); }

// ---- time of impact ---------------------------------------------------------------------------------------
template <class E>
struct Toi {
  static auto point_triangle(const dfm_motion &p, std::span<const dfm_motion, 3> triangle,
                             const dfm_toi_options *options = nullptr) {
    return produce<E, Touch>([&](Touch &t) {
      return dfm_toi_point_triangle(&p, triangle.data(), options, &t.t, t.weights.data());
    });
  }
  static auto edge_edge(std::span<const dfm_motion, 2> a, std::span<const dfm_motion, 2> b,
                        const dfm_toi_options *options = nullptr) {
    return produce<E, EdgeTouch>([&](EdgeTouch &t) {
      double ab[2] = {};
      const dfm_status s = dfm_toi_edge_edge(a.data(), b.data(), options, &t.t, ab);
      t.a = ab[0];
      t.b = ab[1];
      return s;
    });
  }
  static uint32_t evaluations() noexcept { return dfm_toi_evaluations(); }
};

}  // namespace basic

namespace values {
using Context = basic::Context<Values>;
using World = basic::World<Values>;
using Body = basic::Body<Values>;
using Obstacle = basic::Obstacle<Values>;
using Rigid = basic::Rigid<Values>;
using Tool = basic::Tool<Values>;
using Material = basic::Material<Values>;
using Law = basic::Law<Values>;
using Scene = basic::Scene<Values>;
using Mesh = basic::Mesh<Values>;
using Toi = basic::Toi<Values>;
}  // namespace values

#if defined(__cpp_exceptions)
namespace exceptions {
using Context = basic::Context<Throw>;
using World = basic::World<Throw>;
using Body = basic::Body<Throw>;
using Obstacle = basic::Obstacle<Throw>;
using Rigid = basic::Rigid<Throw>;
using Tool = basic::Tool<Throw>;
using Material = basic::Material<Throw>;
using Law = basic::Law<Throw>;
using Scene = basic::Scene<Throw>;
using Mesh = basic::Mesh<Throw>;
using Toi = basic::Toi<Throw>;
}  // namespace exceptions
#endif

#if defined(__cpp_exceptions) && !defined(DEFORM_ERRORS_AS_VALUES)
using namespace exceptions;
#else
using namespace values;
#endif

}  // namespace deform
#endif
