// Linear elasticity of a mesh in its frame: stiffness, held components, and displacements under forces. For a
// body without held points the compliance applies to the force minus the inertia forces of the rigid
// acceleration, and its displacements neither move the center of mass nor rotate the body (they are
// orthogonal, by mass, to the rigid motions). The stiffness is that of the cells, or of the surface alone,
// which inner points then follow (boundary.h).
#pragma once
#include <deform/plugin.h>

#include <algorithm>
#include <array>
#include <vector>

#include "../model_common/cell_blocks.h"
#include "../model_common/material.h"
#include "boundary.h"
#include "params.h"
#include "sparse.h"

namespace reduced {

// A factor of more points takes minutes.
constexpr uint32_t kMaxPoints = 10000;

class Elastic {
 public:
  // Throws model::Refused after the reason was logged, or a sentence.
  void create(const dfm_host *host, const char *id, const dfm_mesh &m, bool by_surface);

  const Kernels *kernels = nullptr;  // of this processor
  uint32_t npoint = 0, ncell = 0;
  bool floating = false;          // nothing is held
  bool turns = false;             // held points are held in all components: the frame turns with them
  double total = 0, extent = 0;   // kg, m
  double origin[3] = {};          // of the rest positions below, in those of the mesh
  Buffer<double> rest, mass;      // [npoint,3] m from the origin, [npoint] kg
  Buffer<uint8_t> held;           // [npoint] bits
  std::vector<uint32_t> holders;  // points with held components
  Buffer<double> rigid;           // floating: [6, 3 npoint], orthonormal by mass; translations first

  // u = C f in the frame, held components zero; [3 npoint], not the same
  void compliance(const double *f, double *u) const;
  // the same for eight forces side by side, [3 npoint, 8]; u may be f
  void compliance_of_eight(const double *f, double *u) const;
  // C between n points, each named once: w[3n,3n]
  void compliance_between(uint32_t n, const uint32_t *points, double *w) const;
  // u: held components given, all others zero; becomes the displacement at rest under no force
  void follow(double *u) const;
  // Displacements of points that follow those of the others.
  bool leads(uint32_t point) const {
    return !std::binary_search(surface_.inner.begin(), surface_.inner.end(), point);
  }
  void lead(double *u) const;
  // [ncell] cells, by the displacement u [3 npoint] in the frame
  double largest_gradient(const double *u, uint32_t *where) const;
  double density(uint32_t c, const double *u) const;            // J/m3
  void stress(uint32_t c, const double *u, double *out) const;  // 3 x 3
  double volume(uint32_t c) const { return volume_[c]; }        // 0: flat or inverted, without stiffness
  double energy(const double *u) const;                         // J
  size_t nmoving() const;  // components that have a displacement of their own

 private:
  const dfm_host *host_ = nullptr;
  double young_ = 0, poisson_ = 0;
  Buffer<double> field_[kParamCount];
  Buffer<uint32_t> cells_, edges_;  // [ncell,nodes_], [nedge_,2]: all pairs that the stiffness joins
  uint32_t nodes_ = 4, nedge_ = 0;
  Buffer<double> volume_, mean_;  // [ncell] m3, [ncell,nodes_,3] mean gradients of the shape functions
  model::CellBlocks cell_block_;  // empty where strain is constant in a cell
  Buffer<double> block_;  // [npoint + nedge, 9]; dropped where nothing is held and cells have the energy
  bool by_surface_ = false;
  Boundary surface_;
  std::vector<uint32_t> given_;  // components: those held; floating: six that keep the body in place
  Factor factor_;
  mutable Buffer<double> work_;  // [3 npoint]

  bool is_held(size_t component) const { return held[component / 3] >> (component % 3) & 1; }
  void multiply(const double *u, double scale, double *out) const;
  void take_surface(const dfm_mesh &m, const char *id);
  model::Lame lame(uint32_t c) const;
  void gradient(uint32_t c, const double *u, double *h) const;
  void take(const dfm_mesh &m, const char *id);
  void place_origin(const dfm_mesh &m);
  void take_cells(const dfm_mesh &m);
  void add_cell(uint32_t c, const model::RestCell &cell);
  void find_rigid();
  void find_pins();
  void check_holding(const char *id) const;
  void factorize();
  template <size_t kWide>
  void respond(const double *f, double *u) const;
};

}  // namespace reduced
