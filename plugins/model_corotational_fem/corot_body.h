// A corotational body: the cells of a mesh, cut into blocks that fit the first-level cache, and the ops on
// them.
#pragma once
#include <deform/plugin.h>

#include <algorithm>
#include <cstdint>

#include "../model_common/blocks.h"
#include "../model_common/by_kind.h"
#include "../model_common/material.h"
#include "../model_common/tetrahedron.h"
#include "corot_kernel.h"

namespace corot {

using model::Buffer;

// Rows of the parameter table; a row's value begins at its number, the last row is three wide.
enum Param : uint32_t {
  kYoung,
  kPoisson,
  kDampingStiffness,
  kDampingMass,
  kEnergy,
  kRotation,
  kTangent,
  kLocking,
  kYield,
  kHardening,
  kCreep,
  kPlasticLimit,
  kCollapse,
  kYoungAlong,
  kPoissonAlong,
  kShearAlong,
  kAxis,
  kParamCount,
  kValueCount = kAxis + 3
};
enum RotationBy : uint32_t { kPolar, kSvd, kQr };
enum Locking : uint32_t { kLocked, kNodal };
enum Tangent : uint32_t { kUsual, kExact };
extern const dfm_param kParams[kParamCount];
using model::kAuto;  // creep: at once
constexpr const char *kId = "org.deform.corotational_fem";
void complain(const dfm_host *h, const char *what);

struct Body : model::Blocks<Block> {
  using Row = Param;
  static constexpr model::CellBody::Of kOf = {kId, kParams, kParamCount, true, {0, kYield, kYoungAlong}};
  // From this size on blocks go through the host's parallel_for; below it waking a worker costs more than it
  // saves. Summing the blocks is a twentieth of the work.
  static constexpr uint32_t kParallelCells = 3000, kParallelMergeCells = 100000;

  const Kernels *kernels = nullptr;
  uint32_t ncell = 0, nedge = 0;
  double params[kValueCount] = {};
  Buffer<double> field[kParamCount];  // [ncell,width] values by cell in place of a parameter's; empty without

  // In the host's order.
  Buffer<double> mass, volume;    // [npoint] kg, [ncell] m^3
  Buffer<uint32_t> cells;         // [ncell,4], each ascending, so that block (i, j) of a cell has i < j
  Buffer<uint32_t> edges;         // [nedge,2]
  Buffer<double> height_inverse;  // [ncell,4] 1/m, |g_a|
  Buffer<double> point_drag;      // [npoint] N s/m; empty without drag
  // [npoint] row sums at rest of stiffness and dampers, and their weights; [ncell,4] row of a cell per
  // stiffness against turning
  Buffer<double> rest_rows, damp_rows, weight, twist_share;
  bool made_plastic = false;
  const char *active_effects[8] = {};  // of the present parameters, NULL-terminated

  // Where the volume change is that of the points (corot_nodal.cpp): [npoint,2] what divides the sums of the
  // cells' shares in it and in its rate, and the quotients (point_change) at the last dilate().
  Buffer<double> bulk, point_change;
  // Points around each point, which the tangent joins; made when the pattern is first needed.
  struct Patches {
    Buffer<uint32_t> begin, point;           // [npoint + 1], points of the cells around a point, ascending
    Buffer<uint32_t> pair_begin, pair_slot;  // [npoint + 1], places of the pairs of a patch in the blocks
    Buffer<uint32_t> far_begin, far_point;   // [npoint + 1], j > i of patches that share no edge with i
    Buffer<double> gradient;                 // [points,3] of the volume change of the patch's point
    bool made = false;
  };

  // In block order.
  Buffer<uint32_t> cell_id;   // [groups,8], kNone for one that fills up
  Buffer<uint32_t> place_of;  // [ncell] place of a cell in that order
  Buffer<double> damp, value, damp_value;
  Buffer<Group> group;
  Buffer<SlotGroup> slots;
  Buffer<FiberGroup> fiber;
  Buffer<PlasticGroup> plastic_group;

  uint32_t choice(Param which) const { return uint32_t(params[which]); }
  double at(Param which, uint32_t c) const { return field[which].empty() ? params[which] : field[which][c]; }
  const double *axis_of(uint32_t c) const {
    return field[kAxis].empty() ? params + kAxis : field[kAxis].data() + 3 * size_t(c);
  }
  double largest_of(Param which) const;
  bool given(Param which) const;  // auto in no cell
  bool has_fibers() const { return given(kYoungAlong) || given(kPoissonAlong) || given(kShearAlong); }
  bool has_dampers() const { return largest_of(kDampingStiffness) > 0; }
  size_t lanes() const { return size_t(groups) * kGroup; }
  uint32_t groups = 0;

  // why a parameter has no effect with the present others; NULL if it has
  const char *idle(Param which) const;
  void create(const dfm_host *h, const dfm_mesh &m);
  void apply_params(const double *values);
  void add_forces(const dfm_kin &k, double *f_out);
  void bound(const dfm_kin &k, double *ksum, double *csum);
  double energy(const dfm_kin &k);
  void fill_energies(const dfm_kin &k);
  void cell_energy(const dfm_kin &k, double *out);
  void cell_stress(const dfm_kin &k, double *out);

  // Whether the cells have a plastic strain, which cannot change: it is state.
  bool plastic() const { return made_plastic; }
  size_t state_size() const { return plastic() ? size_t(model::plastic::kState) * ncell : 0; }
  bool lacks_state(const dfm_kin &k) const { return model::lacks_state(*this, kId, k); }
  double flow_at(const dfm_kin &k) const;  // share of the flow that occurs in the step
  bool nodal() const { return choice(kLocking) == kNodal; }
  void dilate(const dfm_kin &k);  // before all code that uses the volume change of the points
  // Positions of the corners of a cell.
  void corners(const dfm_kin &k, uint32_t c, const double **x) const {
    for (size_t m = 0; m < 4; ++m) x[m] = k.x + size_t(k.stride) * cells[4 * size_t(c) + m];
  }
  // dilate() has filled point_change
  double mean_change(uint32_t c) const {
    const uint32_t *q = cells.data() + 4 * size_t(c);
    return 0.25 * ((point_change[2 * size_t(q[0])] + point_change[2 * size_t(q[1])]) +
                   (point_change[2 * size_t(q[2])] + point_change[2 * size_t(q[3])]));
  }

  uint32_t pairs() const { return npoint + nedge + (nodal() ? ready_patches().far_begin[npoint] : 0); }
  void pattern(uint32_t *ij) const;
  void add_stiffness(const dfm_kin &k, double a, double b, double *blk);

 private:
  // Block n with its points packed in, `moves`: with velocities; see lend().
  Block load_block(const dfm_kin &k, uint32_t n, uint32_t begin, bool moves);
  void take_mesh(const dfm_mesh &m);
  void take_fields(const dfm_mesh &m);
  struct Layout;
  void build_blocks(const dfm_mesh &m);
  void order_cells(Layout &l) const;
  uint32_t cell_halo(Layout &l, uint32_t b) const;
  void fill_groups(const Layout &l, const dfm_mesh &m, uint32_t b, uint32_t groups_at);
  mutable Patches patches;
  Patches &ready_patches() const;
  void find_patches(Patches &to) const;
  void find_far_points(Patches &to) const;
  void find_gradients(const dfm_kin &k, bool damped);
  void add_dyads(size_t kind, double by, double *blk) const;
  void find_bulk();
  uint32_t slot_of(const Patches &in, uint32_t i, uint32_t j) const;
  void add_nodal(const dfm_kin &k, double a, double b, double *blk);
  // memory for new parameters, allocated before anything changes: arrays to swap in, and sums
  struct Room {
    Buffer<FiberGroup> fiber;
    Buffer<double> damp, damp_value, point_drag, around, next, blocks;
  };
  void make_room(Room &room) const;
  model::Fiber fiber_at(uint32_t c) const;
  double direct_energy(const dfm_kin &k, size_t place) const;
  void cell_elasticity(size_t place, double (*d)[6]) const;  // times the volume
  bool soften_cell(const dfm_kin &k, uint32_t c, const double (*s)[3], double (*d)[6], bool &flows) const;
  void add_collapse(size_t place, const double *const *x, const double (*g)[3], double a, double *blk) const;
  void add_softening(const dfm_kin &k, uint32_t c, double a, double *blk) const;
  void add_exact(const dfm_kin &k, uint32_t c, double a, double b, double *blk) const;
  void fill_material(Room &room);
  void fill_drag(Room &room);
  void find_effects();
  void find_rows(Room &room);
};

// Gradient of a cell at the positions of its corners, from the rest gradients of its lane; row-major.
void gradient_of(const Group &group, uint32_t lane, const double *const *x, double *f);

// Rest gradients of a cell of the body.
model::Tetrahedron shape_of(const double *rest, const uint32_t *cell);

}  // namespace corot
