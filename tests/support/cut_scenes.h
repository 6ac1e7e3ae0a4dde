// Bodies, shapes and calls that the tests of cuts share.
#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "deform/tool.h"
#include "stack.h"

namespace test::cutting {

inline dfm_cut_info request() {
  dfm_cut_info i{};
  i.size = sizeof i;
  return i;
}

inline dfm_body_info info(dfm_body b) {
  dfm_body_info i{};
  i.size = sizeof i;
  test::ok(dfm_body_get_info(b, &i));
  return i;
}

// Parts that hang together.
inline uint32_t parts(dfm_body b) {
  dfm_cut_info i = request();
  test::ok(dfm_body_remove_cells(b, 0, nullptr, &i));
  return i.parts;
}

using test::State;

// Of 40 mm about the origin.
inline dfm_body cube(dfm_context *c, dfm_world w, const char *model, uint32_t cells = 320) {
  test::BodyOptions o;
  o.name = "cube";
  o.model = model;
  o.young = 3e4;
  o.damping_stiffness = 2e-3;
  o.position = {-0.02, -0.02, -0.02};
  return test::make_body(c, w, "beam", {0.04, 0.04, 0.04}, cells, o);
}

// That cube, at rest in empty space.
struct CubeAtRest {
  test::Context context;
  dfm_world w;
  dfm_body body;
  explicit CubeAtRest(const char *model = "corotational_fem", uint32_t cells = 320, uint32_t threads = 1)
      : context(threads), w(test::make_world(context, {0, 0, 0})), body(cube(context, w, model, cells)) {}
};

// A blade above it, with its edge down, that goes through it beside the middle.
inline dfm_tool_def knife() {
  dfm_tool_def d = dfm_tool_def_default();
  d.name = "knife";
  d.shape = DFM_TOOL_BLADE;
  d.half_size[0] = 0.0005;
  d.half_size[1] = 0.03;
  d.half_size[2] = 0.02;
  d.pose.position[0] = 0.001;
  d.pose.position[2] = 0.05;
  return d;
}

// A beam of a material that takes energy to be cut.
struct Tough {
  std::array<double, 3> size;
  uint32_t cells;
  double energy;  // J/m2
  const char *name = "block", *model = nullptr;
  double corner = 0;                        // m, along each axis
  bool (*held)(const double *x) = nullptr;  // by places in the mesh; null: no point
  double velocity = 0;                      // m/s along x
  dfm_material_def material = dfm_material_def_default();
};

inline dfm_body make(dfm_context *c, dfm_world w, Tough o) {
  dfm_mesh_handle mesh = 0;
  test::ok(dfm_mesh_make(c, "beam", o.size.data(), DFM_MESH_CELLS, o.cells, &mesh));
  dfm_body_def d = dfm_body_def_default();
  test::lend(mesh, d);
  o.material.name = "tissue";
  const dfm_param_value row{"fracture_energy", &o.energy, 1};
  o.material.extra = {sizeof(dfm_params), 1, &row};
  test::ok(dfm_material_create(w, &o.material, &d.material));
  d.name = o.name;
  d.model = o.model;
  for (double &x : d.pose.position) x = o.corner;
  d.velocity[0] = o.velocity;
  std::vector<uint8_t> fixed(d.npoint);
  for (uint32_t i = 0; i < d.npoint; ++i) fixed[i] = o.held && o.held(d.points + 3 * size_t{i}) ? 7 : 0;
  if (o.held) d.fixed = fixed.data();
  dfm_body body = 0;
  test::ok(dfm_body_create(w, &d, &body));
  test::ok(dfm_mesh_destroy(mesh));
  return body;
}

inline dfm_cut_def sphere(std::array<double, 3> at, double radius) {
  dfm_cut_def d = dfm_cut_def_default();
  for (int k = 0; k < 3; ++k) {
    d.pose.position[k] = at[k];
    d.half_size[k] = radius;
  }
  return d;
}

// The whole plane at right angles to an axis.
inline dfm_cut_def plane(int axis, double at, uint32_t how) {
  dfm_cut_def d = dfm_cut_def_default();
  d.shape = DFM_CUT_BLADE;
  d.how = how;
  const double corner[4][2] = {{-9, -9}, {9, -9}, {9, 9}, {-9, 9}};
  for (int i = 0; i < 4; ++i) {
    d.blade[3 * i + axis] = at;
    d.blade[3 * i + (axis + 1) % 3] = corner[i][0];
    d.blade[3 * i + (axis + 2) % 3] = corner[i][1];
  }
  return d;
}

inline dfm_cut_info cut(dfm_body b, const dfm_cut_def &d) {
  dfm_cut_info out = request();
  test::ok(dfm_body_cut(b, &d, &out));
  return out;
}

inline void restore(dfm_world w, const std::string &data) {
  test::ok(dfm_world_restore(w, data.data(), data.size()));
}

inline void steps(dfm_world w, int n, double h = 1e-3) {
  for (int i = 0; i < n; ++i) {
    uint32_t trouble = 0;
    ASSERT_EQ(dfm_world_step(w, h, &trouble), DFM_OK) << dfm_last_error();
    ASSERT_EQ(trouble & DFM_TROUBLE_ENERGY, 0u);
  }
}

struct Cube {
  test::Context context;
  dfm_world w;
  dfm_body b;
  explicit Cube(const char *model, std::array<double, 3> gravity = {0, 0, 0}, uint32_t cells = 320)
      : w(test::make_world(context, gravity)) {
    test::BodyOptions o;
    o.name = "cube";
    o.model = model;
    o.young = 2e4;
    o.damping_stiffness = 1e-3;
    o.velocity = {0.3, -0.2, 0.1};
    o.spin = {1, 2, -3};
    o.position = {0, 0, 0.06};
    b = test::make_body(context, w, "beam", {0.1, 0.1, 0.1}, cells, o);
  }
};

// A cube at rest on a floor; pushed: gravity is tilted, and friction with memory holds the cube.
struct CubeOnFloor {
  test::Context context;
  dfm_world w;
  dfm_body b;
  explicit CubeOnFloor(const char *model, double young, bool pushed = false, uint32_t cells = 320)
      : w(test::make_world(context, {pushed ? 1.5 : 0, 0, -9.81})) {
    test::add_plane(w, "floor");
    test::set_friction(w, pushed ? 0.6 : 0.5, pushed ? "elastoplastic" : "coulomb");
    test::BodyOptions o;
    o.name = "cube";
    o.model = model;
    o.young = young;
    o.damping_stiffness = 2e-3;
    o.position = {0, 0, 1e-4};
    b = test::make_body(context, w, "beam", {0.1, 0.1, 0.1}, cells, o);
  }
};

inline const char *const kModels[] = {"msm", "corotational_fem"};

// A bar whose ends are held, the right one pulled away at 0.3 m/s.
struct PulledBar {
  test::Context context;
  dfm_world w;
  dfm_body b = 0;
  explicit PulledBar(const char *model, double tear, double device = 0)
      : w(test::make_world(context, {0, 0, 0})) {
    dfm_mesh_handle mesh = 0;
    const double size[] = {0.3, 0.06, 0.06};
    test::ok(dfm_mesh_make(context, "beam", size, DFM_MESH_CELLS, 200, &mesh));
    dfm_body_def d = dfm_body_def_default();
    test::lend(mesh, d);
    dfm_material_def m = dfm_material_def_default();
    m.name = "dough";
    m.young = 2e4;
    m.damping_stiffness = 2e-3;
    m.damping_mass = 2;
    const dfm_param_value row{"tear", &tear, 1};
    m.extra = {sizeof(dfm_params), tear != 0 ? 1u : 0u, &row};
    if (dfm_material_create(w, &m, &d.material) != DFM_OK) return;
    d.name = "bar";
    d.model = model;
    const dfm_param_value on{"device", &device, 1};
    if (device > 0) d.model_params = {sizeof(dfm_params), 1, &on};
    std::vector<uint32_t> ends[2];
    for (uint32_t i = 0; i < d.npoint; ++i)
      for (int side = 0; side < 2; ++side)
        if (std::fabs(d.points[3 * size_t{i}] - 0.3 * side) < 1e-6) ends[side].push_back(i);
    std::vector<uint8_t> fixed(d.npoint, 0);
    for (const auto &end : ends)
      for (const uint32_t i : end) fixed[i] = 7;
    d.fixed = fixed.data();
    if (dfm_body_create(w, &d, &b) != DFM_OK) return;
    dfm_pose_key keys[2] = {};
    for (dfm_pose_key &key : keys) key.pose.rotation[3] = 1;
    keys[1].t = 1;
    keys[1].pose.position[0] = 0.3;
    test::ok(dfm_body_move_held(b, uint32_t(ends[1].size()), ends[1].data(), 2, keys, nullptr));
  }
  uint32_t tears() const {
    uint32_t points = 0;
    for (const dfm_contact_event &e : test::listed(dfm_world_events, w))
      if (e.kind == uint32_t{DFM_EVENT_TEAR} && e.a == b && e.b == b) points += uint32_t(e.key);
    return points;
  }
};

}  // namespace test::cutting
