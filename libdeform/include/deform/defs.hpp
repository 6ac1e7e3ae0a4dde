// deform/defs.hpp -- what the classes of deform.hpp take and give: definitions that begin with the library's
// defaults, and the rows and reports that queries return. Included by deform.hpp.
#ifndef DEFORM_DEFS_HPP
#define DEFORM_DEFS_HPP
#include <cstdint>
#include <span>

#include "deform/deform.h"
#include "deform/result.hpp"

namespace deform {

// ---- defs with the library's defaults ---------------------------------------------------------------------
struct ContextDef : dfm_context_def {
  ContextDef() noexcept : dfm_context_def(dfm_context_def_default()) {}
};
struct WorldDef : dfm_world_def {
  WorldDef() noexcept : dfm_world_def(dfm_world_def_default()) {}
};
struct EquilibriumDef : dfm_equilibrium_def {
  EquilibriumDef() noexcept : dfm_equilibrium_def(dfm_equilibrium_def_default()) {}
};
struct Switch : dfm_switch {
  Switch() noexcept : dfm_switch(dfm_switch_default()) {}
};
struct SwitchRule : dfm_switch_rule {
  SwitchRule() noexcept : dfm_switch_rule(dfm_switch_rule_default()) {}
};
struct MaterialDef : dfm_material_def {
  MaterialDef() noexcept : dfm_material_def(dfm_material_def_default()) {}
};
struct ObstacleDef : dfm_obstacle_def {
  ObstacleDef() noexcept : dfm_obstacle_def(dfm_obstacle_def_default()) {}
};
struct RigidDef : dfm_rigid_def {
  RigidDef() noexcept : dfm_rigid_def(dfm_rigid_def_default()) {}
};
struct SceneWriteDef : dfm_scene_write_def {
  SceneWriteDef() noexcept : dfm_scene_write_def(dfm_scene_write_def_default()) {}
};
struct StreamDef : dfm_stream_def {
  StreamDef() noexcept : dfm_stream_def(dfm_stream_def_default()) {}
};
struct BodyDef : dfm_body_def {
  BodyDef() noexcept : dfm_body_def(dfm_body_def_default()) {}
  // Borrowed until the body is made: points [n,3], tets [n,4].
  void set_mesh(std::span<const double> p, std::span<const uint32_t> t) noexcept {
    npoint = static_cast<uint32_t>(p.size() / 3);
    points = p.data();
    ntet = static_cast<uint32_t>(t.size() / 4);
    tets = t.data();
    cells = nullptr;
    cell_inside = cell_share = nullptr;
    cell = dfm_body_def_default().cell;
  }
  template <class Mesh>
  auto set_mesh(const Mesh &mesh) {
    return mesh.give_to(*this);
  }
  template <class Mesh>
  void set_mesh(Unique<Mesh> &&) = delete;  // it would end before the body is made
};

// ---- what steps and queries return ------------------------------------------------------------------------
// What world.step() returns. Converts to true where the world advanced.
struct [[nodiscard]] StepReport {
  uint32_t trouble = 0;  // DFM_TROUBLE_*
  // too many sub-steps, its budget used up, or interrupted (trouble says which): nothing changed
  bool discarded = false;
  constexpr explicit operator bool() const noexcept { return !discarded; }
};
struct StableStep {
  double dt = 0;
  dfm_body body = 0;
  uint32_t point = 0;
};
struct Wrench { Vec3 force{}, moment{}; };
struct HoldReport {
  double creep = 0;
  uint32_t count = 0;
};
struct JointState { double position = 0, rate = 0, effort = 0; };  // as dfm_rigid_joint
struct ProbeState {
  const char *name = nullptr;
  Vec3 position{}, velocity{};
};
// weights of the triangle's vertices
struct Touch {
  double t = 0;
  Vec3 weights{};
};
struct EdgeTouch { double t = 0, a = 0, b = 0; };  // where on each edge
// as in dfm_mesh_info
struct MeshData {
  std::span<const double> points;
  std::span<const uint32_t> tets, faces;
};

}  // namespace deform
#endif
