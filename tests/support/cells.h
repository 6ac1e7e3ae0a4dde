// Tetrahedra as plain arrays, for tests that change a generator's mesh before it becomes a body.
#pragma once
#include <functional>

#include "world.h"

namespace test {

struct Cells {
  std::vector<double> points;        // [n,3]
  std::vector<uint32_t> tets;        // [m,4]
  std::vector<uint32_t> nodes = {};  // [m / 8,10] of cells of second order, else empty
  uint32_t npoint() const { return uint32_t(points.size() / 3); }
  uint32_t ntet() const { return uint32_t(tets.size() / 4); }
  const double *point(uint32_t i) const { return &points[3 * size_t(i)]; }
  const uint32_t *tet(uint32_t t) const { return &tets[4 * size_t(t)]; }
  double volume(uint32_t t) const {
    const uint32_t *const q = tet(t);
    double e[3][3];
    for (int a = 0; a < 3; ++a)
      for (int k = 0; k < 3; ++k) e[a][k] = point(q[a + 1])[k] - point(q[0])[k];
    return (e[0][0] * (e[1][1] * e[2][2] - e[1][2] * e[2][1]) -
            e[0][1] * (e[1][0] * e[2][2] - e[1][2] * e[2][0]) +
            e[0][2] * (e[1][0] * e[2][1] - e[1][1] * e[2][0])) /
           6;
  }
  // A quarter of every cell around a point, by an amount per volume.
  std::vector<double> lumped(const std::function<double(uint32_t cell)> &density) const {
    std::vector<double> m(npoint());
    for (uint32_t t = 0; t < ntet(); ++t)
      for (int a = 0; a < 4; ++a) m[tet(t)[a]] += 0.25 * density(t) * volume(t);
    return m;
  }
};

inline Cells make_cells(dfm_context *c, const char *kind, std::array<double, 3> size, uint32_t cells) {
  dfm_mesh_handle mesh = 0;
  ok(dfm_mesh_make(c, kind, size.data(), DFM_MESH_CELLS, cells, &mesh));
  dfm_body_def d = dfm_body_def_default();
  lend(mesh, d);
  Cells out{{d.points, d.points + 3 * size_t(d.npoint)}, {d.tets, d.tets + 4 * size_t(d.ntet)}};
  ok(dfm_mesh_destroy(mesh));
  return out;
}

// Corners of the edges of DFM_CELL_TET10, in the order of its nodes 4 to 9.
constexpr size_t kTetEdge[6][2] = {{0, 1}, {1, 2}, {0, 2}, {0, 3}, {1, 3}, {2, 3}};

// Cells that a generator made and a test changed, in second order: middles of straight edges.
inline Cells second_order(dfm_context *c, const char *kind, std::array<double, 3> size, const Cells &cells) {
  dfm_mesh_handle mesh = 0, fine = 0;
  ok(dfm_mesh_make(c, kind, size.data(), DFM_MESH_CELLS, cells.ntet(), &mesh));
  ok(dfm_mesh_second_order(mesh, &fine));
  const dfm_mesh_info info = info_of(fine);
  Cells out{cells.points,
            {info.tets, info.tets + 4 * size_t(info.ntet)},
            {info.cells, info.cells + 10 * size_t(info.ncell)}};
  out.points.resize(3 * size_t(info.npoint));
  for (uint32_t n = 0; n < 10 * info.ncell; n += 10)
    for (size_t e = 0; e < 6; ++e)
      for (int k = 0; k < 3; ++k)
        out.points[3 * size_t(out.nodes[n + 4 + e]) + k] =
            0.5 * (out.point(out.nodes[n + kTetEdge[e][0]])[k] + out.point(out.nodes[n + kTetEdge[e][1]])[k]);
  ok(dfm_mesh_destroy(mesh));
  ok(dfm_mesh_destroy(fine));
  return out;
}

// Materials that differ from cell to cell: `kind` of a cell is an index into them.
struct CellMaterials {
  struct Material { double density, young; };
  std::vector<Material> materials;
  std::function<uint32_t(uint32_t cell)> kind;
};

inline dfm_body make_body(dfm_world w, const Cells &cells, const BodyOptions &o,
                          const CellMaterials *by_cell = nullptr, const uint8_t *fixed = nullptr) {
  const auto material = [&](double density, double young) {
    dfm_material_def md = dfm_material_def_default();
    md.density = density;
    md.young = young;
    md.poisson = o.poisson;
    md.damping_mass = o.damping_mass;
    md.damping_stiffness = o.damping_stiffness;
    dfm_material m = 0;
    ok(dfm_material_create(w, &md, &m));
    return m;
  };
  std::vector<dfm_material> handles, of_cell;
  if (by_cell) {
    for (const auto &[density, young] : by_cell->materials) handles.push_back(material(density, young));
    for (uint32_t t = 0; t < cells.ntet(); ++t) of_cell.push_back(handles[by_cell->kind(t)]);
  }
  dfm_body_def d = dfm_body_def_default();
  d.name = o.name.empty() ? nullptr : o.name.c_str();
  d.model = o.model.empty() ? nullptr : o.model.c_str();
  d.npoint = cells.npoint();
  d.ntet = cells.ntet();
  d.points = cells.points.data();
  d.tets = cells.tets.data();
  if (!cells.nodes.empty()) d.cell = DFM_CELL_TET10;
  if (!cells.nodes.empty()) d.cells = cells.nodes.data();
  d.material = by_cell ? handles[0] : material(o.density, o.young);
  if (by_cell) d.cell_materials = of_cell.data();
  const dfm_param_value volume{"volume", &o.volume, 1};
  if (o.volume >= 0) d.model_params = {sizeof(dfm_params), 1, &volume};
  for (int k = 0; k < 3; ++k) {
    d.pose.position[k] = o.position[size_t(k)];
    d.velocity[k] = o.velocity[size_t(k)];
    d.spin[k] = o.spin[size_t(k)];
  }
  for (int k = 0; k < 4; ++k) d.pose.rotation[k] = o.rotation[size_t(k)];
  d.surface = o.surface;
  d.fixed = fixed;
  dfm_body body = 0;
  ok(dfm_body_create(w, &d, &body));
  return body;
}

}  // namespace test
