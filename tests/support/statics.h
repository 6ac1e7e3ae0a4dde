// Equilibria of one body, with meshes and fields of the reference set.
#pragma once
#include <algorithm>
#include <cstdlib>
#include <map>
#include <string>
#include <vector>

#include "support.h"
#include "world.h"

namespace test {

inline std::string reference(const std::string &name) {
  return test::reference_dir() + "/elasticity/" + name;
}
inline std::string mesh_path(const std::string &name) { return test::mesh_dir() + "/" + name; }

// Rows of node, then numbers, by node.
inline std::map<uint32_t, std::vector<double>> by_node(const std::string &path) {
  std::map<uint32_t, std::vector<double>> out;
  const auto rows = test::read_csv(path);
  for (size_t r = 1; r < rows.size(); ++r) {
    std::vector<double> &values = out[uint32_t(std::stoul(rows[r][0]))];
    for (size_t c = 1; c < rows[r].size(); ++c) values.push_back(std::strtod(rows[r][c].c_str(), nullptr));
  }
  return out;
}

// One body of a mesh, without gravity.
struct Statics {
  test::Context context;
  dfm_world world;
  dfm_body body = 0;
  uint32_t npoint = 0;
  std::vector<uint32_t> of_node;  // point of each node of the file

  // `choices`: of the model's parameters, beside the material's
  Statics(const std::string &mesh_file, const char *model, double young, double poisson,
          const std::vector<dfm_param_value> &choices = {}) {
    world = test::make_world(context, {0, 0, 0});
    dfm_mesh_handle mesh = 0;
    test::ok(dfm_mesh_load(context, mesh_file.c_str(), DFM_MESH_CELLS, &mesh));
    dfm_body_def d = dfm_body_def_default();
    const uint32_t *const file_point = test::lend(mesh, d).file_point;
    d.model_params.size = sizeof d.model_params;
    d.model_params.n = uint32_t(choices.size());
    d.model_params.values = choices.data();
    take(d, file_point, model, young, poisson);
    test::ok(dfm_mesh_destroy(mesh));
  }
  Statics(const std::vector<double> &points, const std::vector<uint32_t> &tets, const char *model,
          double young, double poisson, const std::vector<dfm_param_value> &choices = {}) {
    world = test::make_world(context, {0, 0, 0});
    dfm_body_def d = dfm_body_def_default();
    d.model_params = {sizeof d.model_params, uint32_t(choices.size()), choices.data()};
    d.points = points.data();
    d.tets = tets.data();
    d.npoint = uint32_t(points.size() / 3);
    d.ntet = uint32_t(tets.size() / 4);
    take(d, nullptr, model, young, poisson);
  }
  ~Statics() { dfm_world_destroy(world); }

  void take(dfm_body_def &d, const uint32_t *file_point, const char *model, double young, double poisson) {
    npoint = d.npoint;
    for (uint32_t i = 0; i < npoint; ++i) {
      const uint32_t node = file_point ? file_point[i] : i;
      if (of_node.size() <= node) of_node.resize(node + 1, UINT32_MAX);
      of_node[node] = i;
    }
    test::BodyOptions o;
    o.young = young;
    o.poisson = poisson;
    d.material = test::make_material(world, o);
    d.model = model;
    test::ok(dfm_body_create(world, &d, &body));
  }
  void hold(uint32_t point, uint8_t axes) { test::ok(dfm_body_hold(body, 1, &point, axes)); }
  void load(uint32_t point, const double *force) {
    test::ok(dfm_body_add_load(body, 1, &point, force, 0, nullptr, nullptr, nullptr));
  }
  // node,fixx,fixy,fixz,fx,fy,fz
  void apply(const std::string &bc) {
    for (const auto &[node, v] : by_node(bc)) {
      const uint8_t axes = uint8_t((v[0] != 0) | (v[1] != 0) << 1 | (v[2] != 0) << 2);
      if (axes) hold(of_node[node], axes);
      if (v[3] != 0 || v[4] != 0 || v[5] != 0) load(of_node[node], &v[3]);
    }
  }
  dfm_equilibrium_info solve(uint32_t load_steps = 1) {
    dfm_equilibrium_def def = dfm_equilibrium_def_default();
    def.load_steps = load_steps;
    dfm_equilibrium_info info{};
    info.size = sizeof info;
    test::ok(dfm_world_equilibrium(world, &def, &info));
    return info;
  }
  std::vector<double> positions() const { return test::State(body).x; }
  std::vector<double> rest() const {
    std::vector<double> x(3 * size_t(npoint));
    test::ok(dfm_body_get_rest(body, npoint, x.data(), 0, nullptr));
    return x;
  }
  std::vector<double> displacement() const {
    std::vector<double> u = positions();
    const std::vector<double> x = rest();
    for (size_t i = 0; i < u.size(); ++i) u[i] -= x[i];
    return u;
  }
  double energy() const { return test::measure(body).elastic; }
  // Largest difference from a field of the reference set over its largest value.
  double error_of(const std::string &field) const {
    const std::vector<double> u = displacement();
    double most = 0, largest = 0;
    for (const auto &[node, v] : by_node(field))
      for (size_t k = 0; k < 3; ++k) {
        most = std::max(most, std::abs(u[3 * size_t(of_node[node]) + k] - v[k]));
        largest = std::max(largest, std::abs(v[k]));
      }
    return most / largest;
  }
};

}  // namespace test
