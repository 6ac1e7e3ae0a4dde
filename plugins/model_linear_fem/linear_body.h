// A body of linear elasticity: stiffness between the points of a mesh, assembled once, and the ops on it.
#pragma once
#include <deform/plugin.h>

#include "../model_common/buffer.h"
#include "../model_common/by_kind.h"
#include "../model_common/material.h"
#include "../model_common/tetrahedron.h"

namespace linear {

using model::Buffer;
using model::Tetrahedron;

// Rows of the parameter table, each one wide.
enum Param : uint32_t { kYoung, kPoisson, kDampingStiffness, kDampingMass, kParamCount };
extern const dfm_param kParams[kParamCount];
constexpr const char *kId = "org.deform.linear_fem";

struct Body {
  using Row = Param;
  static constexpr model::CellBody::Of kOf = {kId, kParams, kParamCount, false, {0, -1, -1}};
  const dfm_host *host = nullptr;
  uint32_t npoint = 0, ncell = 0, nedge = 0;
  double params[kParamCount] = {};
  const char *active_effects[2] = {};  // NULL-terminated

  void create(const dfm_host *h, const dfm_mesh &m);
  void apply_params(const double *values);  // cannot fail

  void add_forces(const dfm_kin &k, double *f) const;
  bool lacks_state(const dfm_kin &) const { return false; }
  void bound(const dfm_kin &k, double *ksum, double *csum) const;
  double energy(const dfm_kin &k);
  void cell_energy(const dfm_kin &k, double *density) const;
  void cell_stress(const dfm_kin &k, double *stress) const;
  // Blocks of the tangent: the points by themselves, then the edges of the mesh.
  uint32_t pairs() const { return npoint + nedge; }
  void pattern(uint32_t *ij) const;
  void add_stiffness(const dfm_kin &k, double a, double b, double *blk) const;

 private:
  Buffer<double> field[kParamCount];  // [ncell] values by cell in place of a parameter's; empty without
  Buffer<double> rest, mass;          // [npoint,3] m, [npoint] kg
  Buffer<uint32_t> cells, edges;      // [ncell,4], [nedge,2]
  Buffer<uint32_t> cell_edge;         // [ncell,6]
  // Row of a point: its neighbors, and the edge of each, twice its number and one more where the point is
  // the edge's second.
  Buffer<uint32_t> row_begin, row_point, row_edge;
  // [nedge,9] block (i, j) of K and of the sum of damping_stiffness K by cell; the latter empty where that is
  // one number. A block of a point with itself is minus the sum of its row.
  Buffer<double> block, damp_block;
  Buffer<double> drag, volume;  // [npoint] kg/s; m3, four times its own
  Buffer<double> ksum, csum;    // [npoint] of the bound
  bool damping_on = false, drag_on = false;
  model::SmallRange range;

  // Rows [begin, end) of the forces.
  void force_rows(const dfm_kin &k, double *f, uint32_t begin, uint32_t end) const;

  double at(Param which, uint32_t c) const { return field[which].empty() ? params[which] : field[which][c]; }
  void take_mesh(const dfm_mesh &m);
  void take_fields(const dfm_mesh &m);
  void find_rows();
  bool cell(uint32_t c, Tetrahedron &out) const;  // false: flat at rest, it has no stiffness
  void add_cell(uint32_t c, const Tetrahedron &t, const model::Lame &m, double damp);
  void displacement(const dfm_kin &k, uint32_t point, double *u) const;
  void gradient_of(uint32_t c, const dfm_kin &k, const Tetrahedron &t, double (&h)[3][3]) const;
  void strain_of(uint32_t c, const dfm_kin &k, const Tetrahedron &t, double *e) const;
  void look_at(uint32_t c, const dfm_kin &k, const Tetrahedron &t);
  double density_of(uint32_t c, const dfm_kin &k, const Tetrahedron &t) const;
};

// N/m, the largest eigenvalue of the cell's stiffness. See linear_bound.cpp.
double largest_stiffness(const Tetrahedron &t, const model::Lame &m);

}  // namespace linear
