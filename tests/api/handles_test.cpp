// Handles: null, stale, of another kind or made up, every call that takes one says so; ends of
// life in any order.
#include <filesystem>
#include <functional>
#include <limits>
#include <regex>
#include <set>

#include "stack.h"
#include "support.h"

namespace {

using Call = std::pair<const char *, std::function<dfm_status(uint64_t)>>;

// Buffers that calls may be given; none of them is touched by a refused call.
double zero3[3] = {0, 0, 0}, one3[3] = {1, 1, 1};
double numbers[64];
uint32_t count, index0 = 0;
uint64_t made;
size_t bytes;
dfm_pose pose{};
dfm_friction_def friction() {
  dfm_friction_def f{};
  f.size = sizeof f;
  f.between[0] = f.between[1] = "*";
  f.law = "coulomb";
  return f;
}

std::vector<Call> world_calls() {
  return {
      {"world_destroy", [](uint64_t h) { return dfm_world_destroy(h); }},
      {"world_write_scene",
       [](uint64_t h) { return dfm_world_write_scene(h, "/nonexistent/x.json", nullptr, nullptr); }},
      {"world_set_gravity", [](uint64_t h) { return dfm_world_set_gravity(h, zero3); }},
      {"world_set_gravity_keys", [](uint64_t h) { return dfm_world_set_gravity_keys(h, 0, nullptr); }},
      {"world_step", [](uint64_t h) { return dfm_world_step(h, 1e-3, nullptr); }},
      {"world_stable_step", [](uint64_t h) { return dfm_world_stable_step(h, numbers, nullptr, nullptr); }},
      {"world_snapshot", [](uint64_t h) { return dfm_world_snapshot(h, nullptr, &bytes); }},
      {"world_stream", [](uint64_t h) { return dfm_world_stream(h, nullptr, nullptr, &bytes); }},
      {"world_restore", [](uint64_t h) { return dfm_world_restore(h, numbers, sizeof numbers); }},
      {"world_find_body", [](uint64_t h) { return dfm_world_find_body(h, "lower", &made); }},
      {"world_bodies", [](uint64_t h) { return dfm_world_bodies(h, 0, nullptr, &count); }},
      {"world_obstacles", [](uint64_t h) { return dfm_world_obstacles(h, 0, nullptr, &count); }},
      {"world_get_stats",
       [](uint64_t h) {
         dfm_world_stats s{};
         return dfm_world_get_stats(h, &s);
       }},
      {"world_memory",
       [](uint64_t h) {
         dfm_memory m{};
         return dfm_world_memory(h, &m);
       }},
      {"world_profile", [](uint64_t h) { return dfm_world_profile(h, 0, nullptr, &count); }},
      {"world_profile_sized", [](uint64_t h) { return dfm_world_profile_sized(h, 24, 0, nullptr, &count); }},
      {"world_overlaps", [](uint64_t h) { return dfm_world_overlaps(h, 0, nullptr, &count); }},
      {"world_overlaps_sized",
       [](uint64_t h) { return dfm_world_overlaps_sized(h, 40, 0, nullptr, &count); }},
      {"world_find_overlaps", [](uint64_t h) { return dfm_world_find_overlaps(h, &count); }},
      {"world_untangle", [](uint64_t h) { return dfm_world_untangle(h, &count); }},
      {"world_find_rigid", [](uint64_t h) { return dfm_world_find_rigid(h, "box", &made); }},
      {"world_find_obstacle", [](uint64_t h) { return dfm_world_find_obstacle(h, "floor", &made); }},
      {"world_tools", [](uint64_t h) { return dfm_world_tools(h, 0, nullptr, &count); }},
      {"world_find_tool", [](uint64_t h) { return dfm_world_find_tool(h, "probe", &made); }},
      {"world_rigids", [](uint64_t h) { return dfm_world_rigids(h, 0, nullptr, &count); }},
      {"world_rigid_states",
       [](uint64_t h) { return dfm_world_rigid_states(h, 0, nullptr, nullptr, &count); }},
      {"world_explain", [](uint64_t h) { return dfm_world_explain(h, nullptr, &bytes); }},
      {"world_add_friction",
       [](uint64_t h) {
         const dfm_friction_def f = friction();
         return dfm_world_add_friction(h, &f);
       }},
      {"world_set_friction",
       [](uint64_t h) {
         const dfm_params p{sizeof p, 0, nullptr};
         return dfm_world_set_friction(h, "*", "*", &p);
       }},
      {"world_remove_friction", [](uint64_t h) { return dfm_world_remove_friction(h, "*", "*"); }},
      {"world_filter_pair", [](uint64_t h) { return dfm_world_filter_pair(h, "*", "*", true); }},
      {"world_remove_filter", [](uint64_t h) { return dfm_world_remove_filter(h, "*", "*"); }},
      {"world_contacts", [](uint64_t h) { return dfm_world_contacts(h, 0, nullptr, &count); }},
      {"world_contacts_sized",
       [](uint64_t h) { return dfm_world_contacts_sized(h, 192, 0, nullptr, &count); }},
      {"world_law_info",
       [](uint64_t h) {
         dfm_law_info i{};
         return dfm_world_law_info(h, 0, &i);
       }},
      {"world_pairs", [](uint64_t h) { return dfm_world_pairs(h, 0, nullptr, &count); }},
      {"world_pairs_sized", [](uint64_t h) { return dfm_world_pairs_sized(h, 128, 0, nullptr, &count); }},
      {"world_pair_impulses", [](uint64_t h) { return dfm_world_pair_impulses(h, 0, nullptr, &count); }},
      {"world_pair_impulses_sized",
       [](uint64_t h) { return dfm_world_pair_impulses_sized(h, 104, 0, nullptr, &count); }},
      {"world_pair_wrench",
       [](uint64_t h) { return dfm_world_pair_wrench(h, 1, 2, zero3, nullptr, nullptr); }},
      {"world_events", [](uint64_t h) { return dfm_world_events(h, 0, nullptr, &count); }},
      {"world_events_sized", [](uint64_t h) { return dfm_world_events_sized(h, 40, 0, nullptr, &count); }},
      {"world_swaps", [](uint64_t h) { return dfm_world_swaps(h, 0, nullptr, &count); }},
      {"world_swaps_sized", [](uint64_t h) { return dfm_world_swaps_sized(h, 72, 0, nullptr, &count); }},
      {"world_equilibrium", [](uint64_t h) { return dfm_world_equilibrium(h, nullptr, nullptr); }},
      {"world_set_budget", [](uint64_t h) { return dfm_world_set_budget(h, 0, 0); }},
      {"world_set_sleep", [](uint64_t h) { return dfm_world_set_sleep(h, true); }},
      {"world_hold_begin", [](uint64_t h) { return dfm_world_hold_begin(h); }},
      {"world_hold", [](uint64_t h) { return dfm_world_hold(h, numbers, nullptr); }},
      {"world_query",
       [](uint64_t h) {
         const dfm_query_shape s = dfm_query_shape_default();
         dfm_query_hits hits{sizeof hits, sizeof(dfm_query_hit), 0, 0, nullptr};
         return dfm_world_query(h, &s, nullptr, 0, nullptr, nullptr, &hits);
       }},
      {"world_set_may_touch", [](uint64_t h) { return dfm_world_set_may_touch(h, nullptr, nullptr); }},
      {"world_ask_again", [](uint64_t h) { return dfm_world_ask_again(h, 0, 0); }},
      {"world_set_pre_solve", [](uint64_t h) { return dfm_world_set_pre_solve(h, nullptr, nullptr); }},
      {"debug_draw",
       [](uint64_t h) {
         return dfm_debug_draw(
             h, DFM_DRAW_CONTACTS, [](void *, const double *, const double *, uint32_t) {}, nullptr);
       }},
      {"body_create",
       [](uint64_t h) {
         const dfm_body_def d = dfm_body_def_default();
         return dfm_body_create(h, &d, &made);
       }},
      {"obstacle_create",
       [](uint64_t h) {
         const dfm_obstacle_def d = dfm_obstacle_def_default();
         return dfm_obstacle_create(h, &d, &made);
       }},
      {"tool_create",
       [](uint64_t h) {
         const dfm_tool_def d = dfm_tool_def_default();
         return dfm_tool_create(h, &d, &made);
       }},
      {"rigid_create",
       [](uint64_t h) {
         const dfm_rigid_set_def d{sizeof d, 0, 0, 0, nullptr, nullptr, nullptr};
         return dfm_rigid_create(h, nullptr, &d, &made);
       }},
      {"material_create",
       [](uint64_t h) {
         const dfm_material_def d = dfm_material_def_default();
         return dfm_material_create(h, &d, &made);
       }},
  };
}

std::vector<Call> body_calls() {
  return {
      {"body_destroy", [](uint64_t h) { return dfm_body_destroy(h); }},
      {"body_get_info",
       [](uint64_t h) {
         dfm_body_info i{};
         return dfm_body_get_info(h, &i);
       }},
      {"body_set_user", [](uint64_t h) { return dfm_body_set_user(h, nullptr); }},
      {"body_set_filter", [](uint64_t h) { return dfm_body_set_filter(h, 1, 1); }},
      {"body_attach",
       [](uint64_t h) {
         const dfm_attach_def d = dfm_attach_def_default();
         return dfm_body_attach(h, &d, nullptr);
       }},
      {"body_cut",
       [](uint64_t h) {
         const dfm_cut_def d = dfm_cut_def_default();
         return dfm_body_cut(h, &d, nullptr);
       }},
      {"body_plan_cut", [](uint64_t h) { return dfm_body_plan_cut(h, 0, nullptr); }},
      {"body_remove_cells", [](uint64_t h) { return dfm_body_remove_cells(h, 1, &index0, nullptr); }},
      {"body_separate", [](uint64_t h) { return dfm_body_separate(h, nullptr, nullptr); }},
      {"body_set_separate", [](uint64_t h) { return dfm_body_set_separate(h, nullptr); }},
      {"body_set_cut_delay", [](uint64_t h) { return dfm_body_set_cut_delay(h, 0.01); }},
      {"body_cut_delay", [](uint64_t h) { return dfm_body_cut_delay(h, nullptr, &count); }},
      {"body_pieces", [](uint64_t h) { return dfm_body_pieces(h, 0, nullptr, &count); }},
      {"body_origins", [](uint64_t h) { return dfm_body_origins(h, 0, nullptr, 0, nullptr); }},
      {"body_detach", [](uint64_t h) { return dfm_body_detach(h, 1); }},
      {"body_attachments", [](uint64_t h) { return dfm_body_attachments(h, 0, nullptr, &count); }},
      {"body_get_attachment",
       [](uint64_t h) {
         dfm_attachment a{};
         return dfm_body_get_attachment(h, 1, &a);
       }},
      {"body_get_state", [](uint64_t h) { return dfm_body_get_state(h, 0, nullptr, nullptr, &count); }},
      {"body_set_state", [](uint64_t h) { return dfm_body_set_state(h, 1, numbers, numbers); }},
      {"body_get_rest", [](uint64_t h) { return dfm_body_get_rest(h, 1, numbers, 0, nullptr); }},
      {"body_hold", [](uint64_t h) { return dfm_body_hold(h, 1, &index0, 7); }},
      {"body_move_held",
       [](uint64_t h) {
         const dfm_sine s{};
         return dfm_body_move_held(h, 1, &index0, 0, nullptr, &s);
       }},
      {"body_add_load",
       [](uint64_t h) { return dfm_body_add_load(h, 1, &index0, one3, 0, nullptr, nullptr, nullptr); }},
      {"body_remove_load", [](uint64_t h) { return dfm_body_remove_load(h, 1); }},
      {"body_add_spring",
       [](uint64_t h) {
         const dfm_spring_def d{sizeof d, 1, &index0, nullptr, {}, nullptr, 0, 0, 1, 0};
         return dfm_body_add_spring(h, &d, nullptr);
       }},
      {"body_set_spring_target", [](uint64_t h) { return dfm_body_set_spring_target(h, 1, zero3); }},
      {"body_get_spring_force", [](uint64_t h) { return dfm_body_get_spring_force(h, 1, numbers); }},
      {"body_remove_spring", [](uint64_t h) { return dfm_body_remove_spring(h, 1); }},
      {"body_apply_impulse", [](uint64_t h) { return dfm_body_apply_impulse(h, zero3, one3); }},
      {"body_set_params",
       [](uint64_t h) {
         const dfm_params p{sizeof p, 0, nullptr};
         return dfm_body_set_params(h, &p);
       }},
      {"body_set_model", [](uint64_t h) { return dfm_body_set_model(h, "msm", nullptr); }},
      {"body_set_switch_rule", [](uint64_t h) { return dfm_body_set_switch_rule(h, nullptr); }},
      {"body_set_interest", [](uint64_t h) { return dfm_body_set_interest(h, zero3); }},
      {"body_set_switches", [](uint64_t h) { return dfm_body_set_switches(h, 0, nullptr); }},
      {"body_wake", [](uint64_t h) { return dfm_body_wake(h); }},
      {"body_is_asleep",
       [](uint64_t h) {
         bool asleep;
         return dfm_body_is_asleep(h, &asleep);
       }},
      {"body_get_measure",
       [](uint64_t h) {
         dfm_body_measure m{};
         return dfm_body_get_measure(h, &m);
       }},
      {"body_energy_density", [](uint64_t h) { return dfm_body_energy_density(h, 64, numbers); }},
      {"body_stress", [](uint64_t h) { return dfm_body_stress(h, 10, numbers); }},
      {"body_point_stress", [](uint64_t h) { return dfm_body_point_stress(h, 10, numbers); }},
      {"surface_positions", [](uint64_t h) { return dfm_surface_positions(h, 0, nullptr, &count); }},
      {"surface_velocities", [](uint64_t h) { return dfm_surface_velocities(h, 0, nullptr, &count); }},
      {"surface_normals", [](uint64_t h) { return dfm_surface_normals(h, 0, nullptr, &count); }},
      {"surface_forces", [](uint64_t h) { return dfm_surface_forces(h, 0, nullptr, &count); }},
      {"surface_triangles", [](uint64_t h) { return dfm_surface_triangles(h, 0, nullptr, &count); }},
      {"surface_points", [](uint64_t h) { return dfm_surface_points(h, 0, nullptr, &count); }},
      {"surface_vertices", [](uint64_t h) { return dfm_surface_vertices(h, nullptr, 0, nullptr, &count); }},
      {"body_set_sensor", [](uint64_t h) { return dfm_body_set_sensor(h, false); }},
      {"debug_displacements", [](uint64_t h) { return dfm_debug_displacements(h, 0, nullptr, &count); }},
      {"debug_surface_displacements",
       [](uint64_t h) { return dfm_debug_surface_displacements(h, 0, nullptr, &count); }},
      {"debug_write_body", [](uint64_t h) { return dfm_debug_write_body(h, "/nonexistent/x.vtu"); }},
      {"debug_write_surface", [](uint64_t h) { return dfm_debug_write_surface(h, "/nonexistent/x.vtu"); }},
  };
}

std::vector<Call> obstacle_calls() {
  return {
      {"obstacle_destroy", [](uint64_t h) { return dfm_obstacle_destroy(h); }},
      {"obstacle_set_sensor", [](uint64_t h) { return dfm_obstacle_set_sensor(h, false); }},
      {"obstacle_get_pose", [](uint64_t h) { return dfm_obstacle_get_pose(h, &pose); }},
      {"obstacle_get_def",
       [](uint64_t h) {
         dfm_obstacle_def d{};
         return dfm_obstacle_get_def(h, &d);
       }},
      {"obstacle_move_to", [](uint64_t h) { return dfm_obstacle_move_to(h, &pose); }},
      {"obstacle_teleport", [](uint64_t h) { return dfm_obstacle_teleport(h, &pose); }},
      {"obstacle_set_velocity_surface",
       [](uint64_t h) { return dfm_obstacle_set_velocity_surface(h, zero3); }},
      {"obstacle_set_filter", [](uint64_t h) { return dfm_obstacle_set_filter(h, 1, 1); }},
      {"obstacle_set_material", [](uint64_t h) { return dfm_obstacle_set_material(h, 0); }},
  };
}

std::vector<Call> rigid_calls() {
  return {
      {"rigid_destroy", [](uint64_t h) { return dfm_rigid_destroy(h); }},
      {"rigid_add_shape",
       [](uint64_t h) {
         const dfm_obstacle_def d = dfm_obstacle_def_default();
         return dfm_rigid_add_shape(h, &d, &made);
       }},
      {"rigid_get_def",
       [](uint64_t h) {
         dfm_rigid_def d{};
         return dfm_rigid_get_def(h, &d);
       }},
      {"rigid_get_state",
       [](uint64_t h) {
         dfm_rigid_state s{};
         return dfm_rigid_get_state(h, &s);
       }},
      {"rigid_set_state",
       [](uint64_t h) {
         const dfm_rigid_state s{};
         return dfm_rigid_set_state(h, &s);
       }},
      {"rigid_get_measure",
       [](uint64_t h) {
         dfm_body_measure m{};
         return dfm_rigid_get_measure(h, &m);
       }},
      {"rigid_contact_wrench", [](uint64_t h) { return dfm_rigid_contact_wrench(h, numbers, numbers); }},
      {"rigid_set_motor", [](uint64_t h) { return dfm_rigid_set_motor(h, 0, 0, 0); }},
      {"rigid_joint", [](uint64_t h) { return dfm_rigid_joint(h, 0, nullptr, nullptr, nullptr); }},
  };
}

std::vector<Call> tool_calls() {
  return {
      {"tool_destroy", [](uint64_t h) { return dfm_tool_destroy(h); }},
      {"tool_get_def",
       [](uint64_t h) {
         dfm_tool_def d{};
         return dfm_tool_get_def(h, &d);
       }},
      {"tool_parts", [](uint64_t h) { return dfm_tool_parts(h, 0, nullptr, &count); }},
      {"tool_set_pose", [](uint64_t h) { return dfm_tool_set_pose(h, &pose, nullptr); }},
      {"tool_set_opening", [](uint64_t h) { return dfm_tool_set_opening(h, 0); }},
      {"tool_follow_keys", [](uint64_t h) { return dfm_tool_follow_keys(h); }},
      {"tool_keys_at", [](uint64_t h) { return dfm_tool_keys_at(h, 0, &pose, numbers); }},
      {"tool_teleport", [](uint64_t h) { return dfm_tool_teleport(h, &pose); }},
      {"tool_force", [](uint64_t h) { return dfm_tool_force(h, numbers, numbers); }},
      {"tool_feedback", [](uint64_t h) { return dfm_tool_feedback(h, numbers, numbers); }},
      {"tool_get_state",
       [](uint64_t h) {
         dfm_tool_state s{};
         return dfm_tool_get_state(h, &s);
       }},
      {"tool_grab",
       [](uint64_t h) {
         uint32_t held = 0;
         return dfm_tool_grab(h, 0, 0, 0, 1, &held, &count);
       }},
      {"tool_set_device", [](uint64_t h) { return dfm_tool_set_device(h, nullptr); }},
      {"tool_set_cuts", [](uint64_t h) { return dfm_tool_set_cuts(h, 0, 0, 0, nullptr); }},
      {"tool_cuts", [](uint64_t h) { return dfm_tool_cuts(h, nullptr, nullptr, 0, nullptr, &count); }},
  };
}

std::vector<Call> material_calls() {
  return {{"material_destroy", [](uint64_t h) { return dfm_material_destroy(h); }}};
}

std::vector<Call> law_calls() {
  return {
      {"law_close", [](uint64_t h) { return dfm_law_close(h); }},
      {"law_type",
       [](uint64_t h) {
         const dfm_type *t;
         return dfm_law_type(h, &t);
       }},
      {"law_pack", [](uint64_t h) { return dfm_law_pack(h, nullptr, 0, nullptr, &count); }},
      {"law_eval",
       [](uint64_t h) {
         dfm_friction_in in{};
         dfm_friction_out out{};
         return dfm_law_eval(h, &in, &out);
       }},
  };
}

std::vector<Call> mesh_calls() {
  return {
      {"mesh_destroy", [](uint64_t h) { return dfm_mesh_destroy(h); }},
      {"mesh_get_info",
       [](uint64_t h) {
         dfm_mesh_info i{};
         return dfm_mesh_get_info(h, &i);
       }},
      {"mesh_write", [](uint64_t h) { return dfm_mesh_write(h, "/nonexistent/x.msh"); }},
      {"mesh_second_order", [](uint64_t h) { return dfm_mesh_second_order(h, &made); }},
      {"mesh_fill", [](uint64_t h) { return dfm_mesh_fill(h, 100, &made); }},
      {"mesh_lattice", [](uint64_t h) { return dfm_mesh_lattice(h, 10, 0, &made); }},
  };
}

std::vector<Call> scene_calls() {
  return {
      {"scene_close", [](uint64_t h) { return dfm_scene_close(h); }},
      {"scene_world", [](uint64_t h) { return dfm_scene_world(h, &made); }},
      {"scene_value", [](uint64_t h) { return dfm_scene_value(h, "/time", nullptr, &bytes); }},
      {"scene_get_settings",
       [](uint64_t h) {
         dfm_scene_settings s{};
         return dfm_scene_get_settings(h, &s);
       }},
      {"scene_probe", [](uint64_t h) { return dfm_scene_probe(h, 0, nullptr, nullptr, nullptr); }},
      {"scene_write", [](uint64_t h) { return dfm_scene_write(h, "/nonexistent/x.json", nullptr, nullptr); }},
  };
}

// Calls by the kind of handle that they take.
struct Taker {
  uint32_t kind;
  const char *wanted;
  std::vector<Call> calls;
};
std::vector<Taker> takers() {
  return {{DFM_HANDLE_WORLD, "a world", world_calls()},
          {DFM_HANDLE_BODY, "a body", body_calls()},
          {DFM_HANDLE_OBSTACLE, "an obstacle", obstacle_calls()},
          {DFM_HANDLE_RIGID, "", rigid_calls()},
          {DFM_HANDLE_TOOL, "a tool", tool_calls()},
          {DFM_HANDLE_MATERIAL, "a material", material_calls()},
          {DFM_HANDLE_LAW, "a law", law_calls()},
          {DFM_HANDLE_MESH, "a mesh", mesh_calls()},
          {DFM_HANDLE_SCENE, "a scene", scene_calls()}};
}

// One live handle of each kind, as reports and find functions give them.
struct Live {
  uint32_t kind;
  const char *name;
  uint64_t handle;
};
std::vector<Live> live(dfm_context *c) {
  const test::Stack s = test::make_stack(c);
  std::vector<Live> out = {{DFM_HANDLE_WORLD, "a world", s.world},
                           {DFM_HANDLE_BODY, "a body", s.lower},
                           {DFM_HANDLE_OBSTACLE, "an obstacle", s.floor}};
  const auto add = [&](uint32_t kind, const char *name, dfm_status status, const uint64_t &handle) {
    test::ok(status);
    out.push_back({kind, name, handle});
  };
  const dfm_rigid_def rigid_def = dfm_rigid_def_default();
  const dfm_rigid_set_def set = {sizeof set, 1, 0, 0, &rigid_def, nullptr, nullptr};
  const dfm_material_def material_def = dfm_material_def_default();
  const double size[3] = {0.1, 0, 0};
  const std::string file = std::string(DEFORM_SOURCE_DIR) + "/examples/scenes/two_cylinders.json";
  uint64_t h = 0;
  add(DFM_HANDLE_RIGID, "an obstacle", dfm_rigid_create(s.world, nullptr, &set, &h), h);
  dfm_tool_def tool_def = dfm_tool_def_default();
  tool_def.pose.position[2] = 9;
  add(DFM_HANDLE_TOOL, "a tool", dfm_tool_create(s.world, &tool_def, &h), h);
  add(DFM_HANDLE_MATERIAL, "a material", dfm_material_create(s.world, &material_def, &h), h);
  add(DFM_HANDLE_LAW, "a law", dfm_law_open(c, "coulomb", &h), h);
  add(DFM_HANDLE_MESH, "a mesh", dfm_mesh_make(c, "ball", size, DFM_MESH_CELLS, 100, &h), h);
  add(DFM_HANDLE_SCENE, "a scene", dfm_scene_open(c, file.c_str(), nullptr, &h), h);
  return out;
}

// Names of the public functions whose first argument is a handle of the kind, without "dfm_"; of handles
// alone those that give a status.
std::multiset<std::string> declared() {
  const std::regex comment(R"(/\*[\s\S]*?\*/)");
  const std::regex function(
      R"(\bdfm_status\s+dfm_(\w+)\s*\(\s*dfm_(world|body|obstacle|rigid|tool|material|law|)"
      R"(scene|mesh_handle)\s+\w)");
  std::multiset<std::string> out;
  for (const auto &entry :
       std::filesystem::directory_iterator(std::string(DEFORM_SOURCE_DIR) + "/libdeform/include/deform")) {
    if (entry.path().extension() != ".h" || entry.path().stem() == "deprecated") continue;
    const std::string text = std::regex_replace(test::read_file(entry.path()), comment, "");
    for (std::sregex_iterator at(text.begin(), text.end(), function), end; at != end; ++at)
      out.insert((*at)[1]);
  }
  return out;
}

void all_refuse(const std::vector<Call> &calls, uint64_t handle, const char *what) {
  for (const auto &[name, call] : calls) {
    EXPECT_EQ(call(handle), DFM_E_HANDLE) << name << " on a " << what << " handle";
    EXPECT_NE(std::string(dfm_last_error()).find("handle 0x"), std::string::npos)
        << name << ": " << dfm_last_error();
  }
}

}  // namespace

TEST(Handles, NullOrMadeUp_AreRefusedByEveryCall) {
  test::Context c;
  const test::Stack s = test::make_stack(c);
  for (const Taker &taker : takers()) {
    all_refuse(taker.calls, 0, "null");
    all_refuse(taker.calls, 0xdeadbeefdeadbeefull, "made up");
    all_refuse(taker.calls, std::numeric_limits<uint64_t>::max(), "made up");
  }
  EXPECT_TRUE(std::isnan(dfm_world_time(0)));
  EXPECT_EQ(dfm_world_hash(0), 0u);
  EXPECT_NE(dfm_world_hash(s.world), 0u);
}

// The lists above are complete: a function that joins the headers joins them.
TEST(Handles, EveryFunctionWithAHandle_IsTested) {
  std::multiset<std::string> tried{"world_interrupt"};  // looks at the kind alone: below
  for (const Taker &taker : takers())
    for (const auto &[name, call] : taker.calls) tried.insert(name);
  EXPECT_EQ(tried, declared());
}

TEST(Handles, OfAnotherKind_AreRefusedByEveryCall_WithBothKindsNamed) {
  test::Context c;
  const std::vector<Live> all = live(c);
  for (const Taker &taker : takers())
    for (const Live &one : all) {
      // a rigid body is an obstacle too
      const bool moves = taker.kind == DFM_HANDLE_OBSTACLE && one.kind == DFM_HANDLE_RIGID;
      if (taker.kind == one.kind || moves) continue;
      SCOPED_TRACE(one.name);
      for (const auto &[name, call] : taker.calls) {
        EXPECT_EQ(call(one.handle), DFM_E_HANDLE) << name;
        const std::string said = dfm_last_error();
        if (taker.kind == DFM_HANDLE_RIGID && one.kind == DFM_HANDLE_OBSTACLE) {
          EXPECT_NE(said.find("obstacle 'floor', which is not a rigid body"), std::string::npos)
              << name << ": " << said;
          continue;
        }
        const char *const wanted = taker.kind == DFM_HANDLE_RIGID ? "an obstacle" : taker.wanted;
        const std::string both = std::string("is that of ") + one.name + "; pass the handle of " + wanted;
        EXPECT_NE(said.find(both), std::string::npos) << name << ": " << said;
      }
    }
  for (const Live &one : all) {
    if (one.kind == DFM_HANDLE_WORLD) continue;
    EXPECT_TRUE(std::isnan(dfm_world_time(one.handle)));
    EXPECT_EQ(dfm_world_hash(one.handle), 0u);
    EXPECT_EQ(dfm_world_interrupt(one.handle), DFM_E_HANDLE);
    test::says({"is not the handle of a world"});
  }
  test::run(all[0].handle, 2e-3, 1e-3);  // and nothing was harmed
}

TEST(Handles, HandleKind_IdentifiesWhatAReportNames) {
  test::Context c;
  uint64_t floor = 0;
  for (const Live &one : live(c)) {
    EXPECT_EQ(dfm_handle_kind(one.handle), one.kind);
    if (one.kind == DFM_HANDLE_OBSTACLE) floor = one.handle;
  }
  test::ok(dfm_obstacle_destroy(floor));
  for (const uint64_t none : {uint64_t{0}, floor, uint64_t{0xdeadbeefdeadbeef}})
    EXPECT_EQ(dfm_handle_kind(none), uint32_t{DFM_HANDLE_NONE});
  const test::Stack s = test::make_stack(c);
  test::run(s.world, 10e-3, 1e-3);
  const auto pairs = test::pairs(s.world);
  EXPECT_FALSE(pairs.empty());
  for (const dfm_pair_report &p : pairs) {
    EXPECT_EQ(dfm_handle_kind(p.a), uint32_t{DFM_HANDLE_BODY});
    EXPECT_EQ(dfm_handle_kind(p.b), uint32_t(p.b == s.floor ? DFM_HANDLE_OBSTACLE : DFM_HANDLE_BODY));
  }
}

TEST(Handles, AfterTheirObjectWent_AreRefusedThoughTheSlotIsUsedAgain) {
  test::Context c;
  test::Stack s = test::make_stack(c);
  test::ok(dfm_body_destroy(s.upper));
  test::ok(dfm_obstacle_destroy(s.floor));
  all_refuse(body_calls(), s.upper, "stale");
  all_refuse(obstacle_calls(), s.floor, "stale");
  for (int i = 0; i < 50; ++i) {  // new objects take the slots with other generations
    const dfm_obstacle o = test::add_plane(s.world, "again");
    EXPECT_NE(o, s.floor);
    EXPECT_NE(o, s.upper);
    test::ok(dfm_obstacle_destroy(o));
  }
  all_refuse(obstacle_calls(), s.floor, "stale");
  all_refuse(body_calls(), s.upper, "stale");
  dfm_body_info info{};
  test::ok(dfm_body_get_info(s.lower, &info));
}

TEST(Handles, AfterAWorldIsDestroyed_ItsHandlesAreStale) {
  test::Context c;
  const test::Stack s = test::make_stack(c);
  dfm_material material = 0;
  const dfm_material_def md = dfm_material_def_default();
  test::ok(dfm_material_create(s.world, &md, &material));
  const test::Stack other = test::make_stack(c);
  test::ok(dfm_world_destroy(s.world));
  all_refuse(world_calls(), s.world, "stale");
  all_refuse(body_calls(), s.lower, "stale");
  all_refuse(obstacle_calls(), s.floor, "stale");
  EXPECT_EQ(dfm_material_destroy(material), DFM_E_HANDLE);
  test::run(other.world, 2e-3, 1e-3);  // the world beside it lives
}

TEST(Handles, AfterTheContextIsDestroyed_EveryHandleIsStale) {
  test::Stack s;
  dfm_law law = 0;
  dfm_mesh_handle mesh = 0;
  {
    test::Context c;
    s = test::make_stack(c);
    test::run(s.world, 5e-3, 1e-3);
    test::ok(dfm_law_open(c, "coulomb", &law));
    const double size[3] = {0.1, 0, 0};
    test::ok(dfm_mesh_make(c, "ball", size, DFM_MESH_CELLS, 100, &mesh));
  }
  all_refuse(world_calls(), s.world, "stale");
  all_refuse(body_calls(), s.upper, "stale");
  all_refuse(obstacle_calls(), s.floor, "stale");
  all_refuse(law_calls(), law, "stale");
  all_refuse(mesh_calls(), mesh, "stale");
  dfm_context_destroy(nullptr);
}

TEST(Handles, OfASceneWhoseWorldWentFirst_StayAsFarAsTheSceneGoes) {
  test::Context c;
  dfm_scene scene = 0;
  dfm_world world = 0, again = 0;
  const std::string file = std::string(DEFORM_SOURCE_DIR) + "/examples/scenes/two_cylinders.json";
  ASSERT_EQ(dfm_scene_open(c, file.c_str(), nullptr, &scene), DFM_OK) << dfm_last_error();
  test::ok(dfm_scene_world(scene, &world));
  test::ok(dfm_world_step(world, 1e-4, nullptr));
  test::ok(dfm_world_destroy(world));
  test::ok(dfm_scene_world(scene, &again));
  EXPECT_EQ(again, world);
  all_refuse(world_calls(), again, "stale");
  test::ok(dfm_scene_close(scene));
  EXPECT_EQ(dfm_scene_close(scene), DFM_E_HANDLE);
}

TEST(Handles, MaterialOfAnotherWorld_IsRefused) {
  test::Context c;
  const dfm_world a = test::make_world(c), b = test::make_world(c);
  const dfm_material_def md = dfm_material_def_default();
  dfm_obstacle_def od = dfm_obstacle_def_default();
  test::ok(dfm_material_create(a, &md, &od.material));
  dfm_obstacle o = 0;
  EXPECT_EQ(dfm_obstacle_create(b, &od, &o), DFM_E_HANDLE);
  EXPECT_EQ(o, 0u);
  od.material = b;
  EXPECT_EQ(dfm_obstacle_create(b, &od, &o), DFM_E_HANDLE) << "a world handle is no material";
}
