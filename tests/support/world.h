// Worlds that several tests build through the public API.
#pragma once
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <initializer_list>
#include <string>
#include <vector>

#include "deform/deform.h"

namespace test {

// A context with this build's plugins; fails the test where they are missing.
struct Context {
  dfm_context *c = nullptr;
  explicit Context(uint32_t threads = 1) {
    dfm_context_def def = dfm_context_def_default();
    def.threads = threads;
    def.plugin_dir = DEFORM_PLUGIN_DIR;
    def.log = [](void *, int32_t, const char *) {};
    EXPECT_EQ(dfm_context_create(&def, &c), DFM_OK) << dfm_last_error();
  }
  ~Context() { dfm_context_destroy(c); }
  operator dfm_context *() const { return c; }
};

#define DFM_OK_OR_DIE(call) ASSERT_EQ(call, DFM_OK) << dfm_last_error()
inline void ok(dfm_status s) { EXPECT_EQ(s, DFM_OK) << dfm_last_error(); }

// The sentence of the last error holds all of the parts.
inline void says(std::initializer_list<const char *> parts) {
  const std::string sentence = dfm_last_error();
  for (const char *part : parts)
    EXPECT_NE(sentence.find(part), std::string::npos) << "'" << part << "' is missing in: " << sentence;
}

// Four points, one cell: the smallest body.
struct Tet {
  double points[12] = {0, 0, 0, 0.1, 0, 0, 0, 0.1, 0, 0, 0, 0.1};
  uint32_t cells[4] = {0, 1, 2, 3};
  dfm_body_def def = dfm_body_def_default();
  explicit Tet(const char *name = nullptr) {
    def.name = name;
    def.npoint = 4;
    def.ntet = 1;
    def.points = points;
    def.tets = cells;
  }
};

struct BodyOptions {
  std::string name, model;
  double young = 1e5, poisson = 0.3, density = 1000, damping_stiffness = 0, damping_mass = 0, volume = -1,
         smooth = 0;
  std::array<double, 3> position{}, velocity{}, spin{};
  std::array<double, 4> rotation{0, 0, 0, 1};
  const dfm_surface_def *surface = nullptr;
  int32_t integrator = DFM_INTEGRATOR_AUTO;
};

inline dfm_mesh_info info_of(dfm_mesh_handle mesh) {
  dfm_mesh_info info{};
  info.size = sizeof info;
  ok(dfm_mesh_get_info(mesh, &info));
  return info;
}
// Points and cells of a mesh into a def that borrows them.
inline dfm_mesh_info lend(dfm_mesh_handle mesh, dfm_body_def &d) {
  const dfm_mesh_info info = info_of(mesh);
  d.npoint = info.npoint;
  d.ntet = info.ntet;
  d.points = info.points;
  d.tets = info.tets;
  d.cell = info.cell;
  d.cells = info.cells;
  d.cell_inside = info.inside;
  return info;
}

inline dfm_material make_material(dfm_world w, const BodyOptions &o) {
  dfm_material_def md = dfm_material_def_default();
  md.density = o.density;
  md.young = o.young;
  md.poisson = o.poisson;
  md.damping_mass = o.damping_mass;
  md.damping_stiffness = o.damping_stiffness;
  dfm_material material = 0;
  ok(dfm_material_create(w, &md, &material));
  return material;
}

// A body from a generator: kind "beam", "cylinder" or "ball".
inline dfm_body make_body(dfm_context *c, dfm_world w, const char *kind, std::array<double, 3> size,
                          uint32_t cells, const BodyOptions &o) {
  dfm_mesh_handle mesh = 0;
  ok(dfm_mesh_make(c, kind, size.data(), DFM_MESH_CELLS, cells, &mesh));
  dfm_body_def d = dfm_body_def_default();
  d.name = o.name.empty() ? nullptr : o.name.c_str();
  d.model = o.model.empty() ? nullptr : o.model.c_str();
  lend(mesh, d);
  d.material = make_material(w, o);
  const dfm_param_value volume{"volume", &o.volume, 1};
  if (o.volume >= 0) d.model_params = {sizeof(dfm_params), 1, &volume};
  for (int k = 0; k < 3; ++k) {
    d.pose.position[k] = o.position[k];
    d.velocity[k] = o.velocity[k];
    d.spin[k] = o.spin[k];
  }
  for (int k = 0; k < 4; ++k) d.pose.rotation[k] = o.rotation[k];
  d.surface = o.surface;
  d.integrator = o.integrator;
  d.smooth = o.smooth;
  dfm_body body = 0;
  ok(dfm_body_create(w, &d, &body));
  ok(dfm_mesh_destroy(mesh));
  return body;
}

// What one of the counted functions lists, `width` numbers or structs to a row.
template <class T>
std::vector<T> listed(dfm_status (*list)(uint64_t, uint32_t, T *, uint32_t *), uint64_t handle,
                      size_t width = 1) {
  uint32_t n = 0;
  ok(list(handle, 0, nullptr, &n));
  std::vector<T> out(width * n);
  if (n) ok(list(handle, n, out.data(), &n));
  return out;
}
inline std::vector<dfm_contact> contacts(dfm_world w) { return listed(dfm_world_contacts, w); }

// m and m/s, [npoint,3].
struct State {
  std::vector<double> x, v;
  explicit State(dfm_body b) {
    uint32_t n = 0;
    ok(dfm_body_get_state(b, 0, nullptr, nullptr, &n));
    x.resize(3 * size_t{n});
    v.resize(3 * size_t{n});
    ok(dfm_body_get_state(b, n, x.data(), v.data(), &n));
  }
  bool operator==(const State &) const = default;
};

// What one of the functions writes that tell their size first.
template <class T>
std::string written(dfm_status (*write)(dfm_world, T *, size_t *), dfm_world w) {
  size_t bytes = 0;
  ok(write(w, nullptr, &bytes));
  std::string data(bytes, '\0');
  ok(write(w, data.data(), &bytes));
  return data;
}
inline std::string snapshot(dfm_world w) { return written(dfm_world_snapshot, w); }

// Every point at one velocity.
inline void set_velocity(dfm_body body, std::array<double, 3> velocity) {
  uint32_t n = 0;
  ok(dfm_body_get_state(body, 0, nullptr, nullptr, &n));
  std::vector<double> v(size_t(3) * n);
  for (size_t i = 0; i < v.size(); ++i) v[i] = velocity[i % 3];
  ok(dfm_body_set_state(body, n, nullptr, v.data()));
}

inline dfm_world make_world(dfm_context *c, std::array<double, 3> gravity = {0, 0, -9.81},
                            int32_t integrator = DFM_INTEGRATOR_AUTO) {
  dfm_world_def d = dfm_world_def_default();
  d.integrator = integrator;
  for (int k = 0; k < 3; ++k) d.gravity[k] = gravity[k];
  dfm_world w = 0;
  ok(dfm_world_create(c, &d, &w));
  return w;
}

inline dfm_obstacle add_plane(dfm_world w, const char *name, std::array<double, 3> point = {},
                              std::array<double, 4> rotation = {0, 0, 0, 1}) {
  dfm_obstacle_def d = dfm_obstacle_def_default();
  d.name = name;
  d.shape = DFM_SHAPE_PLANE;
  for (int k = 0; k < 3; ++k) d.pose.position[k] = point[k];
  for (int k = 0; k < 4; ++k) d.pose.rotation[k] = rotation[k];
  dfm_obstacle o = 0;
  ok(dfm_obstacle_create(w, &d, &o));
  return o;
}

using LawValues = std::vector<std::pair<const char *, double>>;
inline dfm_status add_friction(dfm_world w, const char *law, const LawValues &given = {}, const char *a = "*",
                               const char *b = "*") {
  std::vector<dfm_param_value> values;
  for (const auto &[key, value] : given) values.push_back({key, &value, 1});
  const dfm_friction_def f = {
      sizeof f, 0, {a, b}, law, {sizeof(dfm_params), uint32_t(values.size()), values.data()}, 0};
  return dfm_world_add_friction(w, &f);
}
inline void set_friction(dfm_world w, double mu, const char *law = "coulomb") {
  ok(add_friction(w, law, std::string(law) == "none" ? LawValues{} : LawValues{{"mu", mu}}));
}

inline dfm_body_measure measure(dfm_body b) {
  dfm_body_measure m{};
  m.size = sizeof m;
  ok(dfm_body_get_measure(b, &m));
  return m;
}
// J, kinetic, elastic and of its weight over z = 0.
inline double total_energy(dfm_body b, double g = 9.81) {
  const dfm_body_measure m = measure(b);
  return m.kinetic + m.elastic + m.mass * g * m.com[2];
}

inline dfm_world_stats stats(dfm_world w) {
  dfm_world_stats s{};
  s.size = sizeof s;
  ok(dfm_world_get_stats(w, &s));
  return s;
}

inline void run(dfm_world w, double seconds, double dt) {
  const long n = std::lround(seconds / dt);
  for (long i = 0; i < n; ++i) {
    uint32_t trouble = 0;
    ASSERT_EQ(dfm_world_step(w, dt, &trouble), DFM_OK) << dfm_last_error();
  }
}

// A beam of 0.5 x 0.1 x 0.1 m whose end of least x is held; `fixed` must outlive the def.
inline dfm_body_def clamped_beam(dfm_context *context, uint32_t cells, std::vector<uint8_t> &fixed) {
  dfm_mesh_handle mesh = 0;
  const double size[] = {0.5, 0.1, 0.1};
  ok(dfm_mesh_make(context, "beam", size, DFM_MESH_CELLS, cells, &mesh));
  dfm_body_def d = dfm_body_def_default();
  lend(mesh, d);
  double least = 1e300;
  for (uint32_t i = 0; i < d.npoint; ++i) least = std::min(least, d.points[3 * i]);
  fixed.assign(d.npoint, 0);
  for (uint32_t i = 0; i < d.npoint; ++i) fixed[i] = d.points[3 * i] < least + 1e-9 ? 7 : 0;
  d.fixed = fixed.data();
  return d;
}

inline std::string explain(dfm_world w) { return written(dfm_world_explain, w); }

}  // namespace test
