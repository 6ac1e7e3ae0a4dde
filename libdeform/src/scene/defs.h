// The contents of a scene file, checked and in plain structs; build.cpp makes a world from it through the
// public API.
#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/error.h"
#include "deform/deform.h"
#include "scene/planner/accuracy.h"

namespace dfm {
class Registry;
}

namespace dfm::scene {

// Parameters by key, owning what a dfm_params borrows.
struct Params {
  std::vector<std::string> keys;
  std::vector<std::vector<double>> values;
  std::vector<dfm_param_value> rows;
  dfm_params view();
};

struct Selection {
  std::string pointer, group;  // group empty: by box, or the listed points
  double lo[3] = {}, hi[3] = {};
  std::vector<uint32_t> points;  // nodes of the mesh file
};

struct Motion {
  std::vector<dfm_pose_key> keys;
  dfm_sine sine = {};
  bool any() const {
    return !keys.empty() || sine.amplitude[0] != 0 || sine.amplitude[1] != 0 || sine.amplitude[2] != 0;
  }
};

struct Fix {
  Selection where;
  uint8_t axes = 7;  // bits 1 x, 2 y, 4 z
  Motion motion;
};

struct Force {
  Selection where;
  double total[3] = {};
  std::string by;  // "auto" "area" "mass"
  std::vector<dfm_scale_key> keys;
  dfm_sine sine = {};
};

struct Spring {
  std::string pointer;
  Selection where;  // unless by point
  bool at_point = false;
  double point[3] = {};
  dfm_spring_def def = {};
  std::vector<dfm_vector_key> keys;
};

// Values of one model parameter for each cell, from a file.
struct FieldFile {
  std::string pointer, key, path;
  uint32_t width = 1;
  bool directions = false;  // scaled to unit length, as an axis given in the scene is
};

// An attachment of a body's surface, made after all objects exist. In addition to the keys of the scene: the
// points of the body selected by `where`, or the surfels of a separate surface.
struct Attach {
  std::string pointer, to;
  Selection where;
  dfm_attach_def def = dfm_attach_def_default();
  std::vector<uint32_t> points, surfels;
};

struct GroupMaterial { std::string pointer, group, material; };

struct OwnSurface {
  std::string pointer, mesh;
  int32_t coupling = DFM_COUPLING_BARYCENTRIC;
  double support = 0;
  bool boundary = false, coupled = false;  // "from": "boundary" is said; a coupling is said
};

// A generated mesh (dfm_mesh_make).
struct MadeMesh {
  std::string kind;  // empty: the mesh is a file
  double size[3] = {};
  uint32_t cells = 0, order = 1;
};

// A model; type empty: none is named.
struct ModelWords {
  std::string type;
  Params params;
  int32_t integrator = DFM_INTEGRATOR_AUTO;
  dfm_model_choice view() {
    return {sizeof(dfm_model_choice), integrator, type.empty() ? nullptr : type.c_str(), params.view()};
  }
};
// A change of the body's model, by time.
struct Switch {
  std::string pointer;
  ModelWords model;
  double t = 0, max_jump = 0;
};
// By contact and distance; far empty: there is no rule.
struct SwitchRule {
  ModelWords touching, near, far;
  dfm_switch_rule values = dfm_switch_rule_default();
};

// The initial state of a body's points.
enum class StartKind { rest, scramble, plane, line, point, invert, state };
struct Start {
  std::string pointer;
  StartKind kind = StartKind::rest;
  uint64_t seed = 0;  // of scramble
  std::string state;  // a file
};

// What rules name.
struct Thing {
  std::string pointer, name, material;
  uint64_t id = 0;  // 0: as it comes
  bool sensor = false;
};

struct Body : Thing {
  static constexpr char kKind[] = "body";
  dfm_body_def def = dfm_body_def_default();
  std::string mesh, model, nodal_bc;
  bool model_open = false;  // the planner chooses; else, where `model` is empty, the library by the cells
  // of `model`, which the processor moves, or the model that a card moves; device.h chooses and clears it
  std::optional<std::string> device;
  MadeMesh made;
  OwnSurface surface;
  Start start;
  std::optional<uint32_t> fill;  // cells; 0: none of a lattice
  // of a lattice: one of these; m
  uint32_t lattice_cells = 0;
  double lattice_size = 0;
  bool lattice_open = false;  // the planner may take one: the scene has no such key, not even as null
  bool lattice() const { return lattice_cells > 0 || lattice_size > 0; }
  std::vector<GroupMaterial> by_group;
  std::vector<FieldFile> fields;
  Params params;
  std::string on;  // the obstacle that it is put on; empty: it stays where its pose has it
  double scale = 1;
  bool has_scale = false;  // the scene says it
  std::vector<Fix> fixes;
  std::vector<Force> forces;
  std::vector<Spring> springs;
  std::vector<Attach> attach;
  std::optional<dfm_separate_def> separate;
  double cut_delay = 0;
  std::vector<Switch> switches;
  SwitchRule rule;
};

struct Obstacle : Thing {
  std::string mesh;
  std::optional<dfm_pose> start;  // its initial pose
  double scale = 1;               // of the mesh
  dfm_obstacle_def def = {};
  std::vector<dfm_pose_key> keys;
};

struct Joint {
  std::string pointer, with;  // with empty: the world
  dfm_joint_def def = {};
};

struct RigidBody : Thing {
  std::optional<dfm_rigid_state> start;
  dfm_rigid_def def = {};
  std::vector<Joint> joints;
};

struct Rigid {
  std::string pointer, host = "builtin";
  std::vector<RigidBody> bodies;
};

struct Tool {
  Obstacle solid;  // pointer, name, material, mesh and scale; its def holds points and triangles
  dfm_tool_def def = {};
  std::vector<dfm_pose_key> keys;
  std::vector<dfm_scale_key> opening_keys;
  std::string hand;  // file with both; empty: none
  struct Cuts {
    std::string pointer;
    std::vector<std::string> bodies;
    uint32_t how = DFM_CUT_REMOVE, most = 0;
  } cuts;
};

// Without a tool, at the end of the first step that ends at t or later.
struct Cut {
  std::string pointer, body;
  double t = 0;
  dfm_cut_def def = dfm_cut_def_default();
};

struct Material {
  std::string pointer, name, title;  // the key; the name in the world, empty: none
  dfm_material_def def = dfm_material_def_default();
  Params extra;
};

struct Friction {
  std::string pointer, between[2], law;
  Params params;
  dfm_friction_def def = {};
};

struct Filter {
  std::string pointer, between[2];
  bool collide = false;
};

struct Probe {
  std::string pointer, name, body;
  double point[3] = {};
};

struct Definition {
  std::string file, folder;
  // Errors with the file and a pointer to the key that they belong to.
  [[noreturn]] void refuse(const std::string &pointer, const std::string &sentence,
                           dfm_status status = DFM_E_ARG) const {
    fail(status, "%s: %s: %s", file.c_str(), pointer.c_str(), sentence.c_str());
  }
  void require(dfm_status status, const std::string &pointer) const {
    if (status < 0) refuse(pointer, dfm_last_error(), status);
  }
  // Adds the key to errors of the called function.
  template <class Call>
  auto with_pointer(const std::string &pointer, Call &&call) const {
    try {
      return call();
    } catch (const Error &e) {
      refuse(pointer, e.what(), e.status);
    }
  }
  dfm_world_def world = dfm_world_def_default();
  std::vector<dfm_vector_key> gravity_keys;
  std::string solver = "auto";  // of the implicit step
  bool effects_auto = true;
  std::vector<std::string> effects;
  std::vector<Material> materials;
  std::vector<Body> bodies;
  std::vector<Obstacle> obstacles;
  Rigid rigid;
  std::vector<Tool> tools;
  std::vector<Cut> cuts;
  std::vector<Friction> friction;
  std::vector<Filter> filters;
  std::vector<Probe> probes;
  Wish wanted;  // the goal of the planner (planner.h)
  // used by the runner only
  double begin = 0, duration = 0, step = 0, every = 0, frame_rate = 0;
  bool equilibrium = false;  // mode static
  bool frames = false, states = false, nodes = false, contacts = true, check = false, has_camera = false;
  double eye[3] = {}, look_at[3] = {};
  std::string color;
};

// The model NAME_gpu beside the model NAME, which a graphics card moves, and the reverse; nullptr: none.
const dfm_type *on_card(const Registry &types, const dfm_type &model);
const dfm_type *off_card(const Registry &types, const dfm_type &model);
std::vector<std::string> model_keys(const Registry &types);  // parameters of any model

}  // namespace dfm::scene
