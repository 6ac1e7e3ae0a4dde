// A mass-spring body: the springs and cells of a mesh, cut into blocks that fit the first-level cache, and
// the ops on them.
#pragma once
#include <deform/plugin_draft.h>

#include <algorithm>
#include <cstdint>
#include <cstring>

#include "../model_common/blocks.h"
#include "../model_common/entry.h"
#include "../model_common/small.h"
#include "msm_kernel.h"

namespace msm {

using model::Buffer;
using model::Refused;

// Rows of the parameter table; a row's value begins at its number, the last row is three wide.
enum Param : uint32_t {
  kYoung,
  kPoisson,
  kDampingStiffness,
  kDampingMass,
  kVolume,
  kCollapse,
  kSlope,
  kAxisKind,
  kAxisForm,
  kDamper,
  kRelaxationRatio,
  kRelaxationTime,
  kAxis,
  kParamCount,
  kValueCount = kAxis + 3
};
enum Kind : uint32_t { kSofter, kStiffer };
enum Force : uint32_t { kFormB, kFormA };
enum Damper : uint32_t { kVoigt, kMaxwell, kStandardLinear };
extern const dfm_param kParams[kParamCount];
constexpr double kFromPoisson = -1;  // of `volume`: what gives the body the ratio `poisson`
constexpr const char *kId = "org.deform.msm";
void complain(const dfm_host *h, const char *what);
bool valid(const dfm_host *h, const double *values);  // of all parameters; false after the reason was logged

// `volume` that gives Poisson's ratio nu; springs alone give 1/4 and no volume modulus that is not
// negative gives less.
inline double volume_for(double nu) { return nu > 0.25 ? 3 * (4 * nu - 1) / (2 * (1 + nu)) : 0; }

// What single precision reads beside the points (msm_kernel.h), block after block.
struct Single {
  Buffer<SingleBlock> block;
  Buffer<int> above;  // [block]
  size_t rays = 0, ncell = 0;
  Buffer<uint32_t> cells;
  Buffer<uint16_t> number;
  Buffer<uint32_t> edge, cell;  // [rays] number of the spring, [ncell] place in block order; kNone for none
  Buffer<float> stiffness, rest, tilt, damp;
  Buffer<float> bulk, volume6, collapse, limit;
  void create(const dfm_host *h, size_t groups, size_t rings) {
    rays = kFans * (rings + 2 * groups);
    ncell = kFans * rings;
    cells.create(h, groups);
    number.create(h, kFans * (rings + 3 * groups));
    edge.create_raw(h, rays);
    cell.create_raw(h, ncell);
    std::fill(edge.data(), edge.data() + rays, ~0u);
    std::fill(cell.data(), cell.data() + ncell, ~0u);
    for (Buffer<float> *each : {&stiffness, &rest, &tilt, &damp}) each->create(h, rays);
    for (Buffer<float> *each : {&bulk, &volume6, &collapse, &limit}) each->create(h, ncell);
  }
};

struct Body : model::Blocks<Block> {
  using Row = Param;
  // From this size on blocks go through the host's parallel_for; below it waking a worker costs more than it
  // saves. Summing the blocks is a twentieth of the work.
  static constexpr uint32_t kParallelCells = 10000, kParallelMergeCells = 100000;

  const Kernels *kernels = nullptr;
  uint32_t ncell = 0, nedge = 0;
  double params[kValueCount] = {};
  Buffer<double> field[kParamCount];  // [ncell,width] values by cell in place of a parameter's; empty without

  // In the host's order.
  // shape: stiffness over `scale`, see find_shapes
  Buffer<double> mass, shape, edge_volume, edge_length, edge_energy;
  Buffer<double> per_modulus;  // [nedge] stiffness over the sum of E V around the edge
  Buffer<uint32_t> edges, cells, cell_edge;
  Buffer<double> cell_volume6;
  Buffer<double> rest_point;  // [npoint,3]
  Buffer<double> weight;      // [npoint] of the row sums
  // [npoint] rows at rest: no shape counts as less stiff, for it may be left in a few steps
  Buffer<double> rest_rows;
  Buffer<double> spring_sum, coupled;  // [npoint] sum of the springs' stiffness k; sum of k w_other / w_own

  // Empty if the effect is off.
  Buffer<double> edge_tilt, edge_rest;  // [nedge] w^2 and sqrt(L0^2 + w^2)
  // [nedge], [npoint] damper over stiffness and its largest around a point, where it differs
  Buffer<double> edge_damp, damp_most;
  Buffer<double> point_drag;           // [npoint] drag over mass, where it differs
  Buffer<uint8_t> edge_off;            // [nedge] springs that are switched off
  const char *active_effects[8] = {};  // of the present parameters, NULL-terminated

  // In block order.
  Buffer<uint32_t> spring_edge, cell_id;
  Buffer<double> stiffness, rest, bulk, collapse, limit, volume6, slot_weight, row;
  // as the springs'; rest_now: of plain springs with the same forces as those with branches
  Buffer<double> tilt, damp, rest_now;
  Buffer<uint32_t> limited;  // [nblock] cells beyond their limit at the last bound
  Buffer<Quad> quad;
  Buffer<Cell> cell;
  Single single;  // empty until it is needed
  bool has_single() const { return !single.block.empty(); }
  const char *keeps_double() const;  // why forces in single precision are not available; NULL if they are
  void prepare_single();

  // why a parameter has no effect with the present others; NULL if it has
  const char *idle(Param which) const;
  uint32_t choice(Param which) const { return uint32_t(params[which]); }
  bool volume_on = false, cells_on = false;  // the volume term; that or the resistance to collapse
  bool damping_on = false, drag_on = false;
  Form form() const { return edge_tilt.empty() ? kPlain : choice(kAxisForm) == kFormA ? kTurned : kTilted; }
  Damping damping() const { return !damping_on ? kUndamped : edge_damp.empty() ? kUniform : kPerSpring; }

  // Branches: a spring of share `part` of the stiffness in series with a dashpot.
  bool has_branch() const { return choice(kDamper) != kVoigt; }
  double part() const {
    return choice(kDamper) == kMaxwell ? 1
           : choice(kDamper) == kVoigt ? 0
                                       : params[kRelaxationRatio] / (1 + params[kRelaxationRatio]);
  }
  Branch branch_at(const dfm_kin &k) const;

  double at(Param which, uint32_t c) const { return field[which].empty() ? params[which] : field[which][c]; }
  // Moduli over Young's: the springs' scale and the volume modulus kV. See doc/models/msm.md.
  double volume_of(uint32_t c) const {
    const double given = at(kVolume, c);
    return given < 0 ? volume_for(at(kPoisson, c)) : given;
  }
  double volume_ratio(uint32_t c) const { return volume_of(c) / (3 * (1 - 2 * at(kPoisson, c))); }
  // Of spring e with its branch, switched off or not; its damper over that; its rest length as it counts.
  double full_stiffness(uint32_t e) const { return scale * shape[e]; }
  double stiffness_of(uint32_t e) const { return edge_off.empty() || !edge_off[e] ? scale * shape[e] : 0; }
  double damp_scale() const {
    return choice(kDamper) == kStandardLinear ? 1 / (1 + params[kRelaxationRatio]) : 1;
  }
  double rest_length(uint32_t e) const { return edge_rest.empty() ? edge_length[e] : edge_rest[e]; }
  // over 36 V0; both 0 for a cell that is flat at rest or cut
  struct CellStiffness { double bulk, collapse; };
  CellStiffness cell_stiffness(uint32_t c) const;
  double collapse_share(uint32_t c) const;
  double limit_of(uint32_t c) const {
    double sum = 0;
    for (int n = 0; n < 6; ++n)
      sum += edge_length[cell_edge[6 * size_t(c) + n]] * edge_length[cell_edge[6 * size_t(c) + n]];
    return sum > 0 ? kLimit * sum : 1;  // four points at one place have no volume to keep
  }
  size_t spring_slots() const {
    return 4 * size_t(block[nblock - 1].quad + block[nblock - 1].quads - quad.data());
  }
  size_t cell_slots() const { return size_t(block[nblock - 1].cell + block[nblock - 1].cells - cell.data()); }

  void create(const dfm_host *h, const dfm_mesh &m);
  void apply_params(const double *values);

  void add_forces(const dfm_kin &k, double *f_out,
                  bool in_single = false);  // in_single: see prepare_single()
  // the same, block by block; in_single: after prepare_single()
  void part_forces(const dfm_kin &k, bool in_single, dfm_take_part_fn take, void *user);
  void bound(const dfm_kin &k, double *ksum, double *csum);
  bool lacks_state(const dfm_kin &k) const;
  double energy(const dfm_kin &k) const;
  void cell_energy(const dfm_kin &k, double *density);
  void mask_springs(uint32_t n, const uint32_t *which, bool on);
  void rest_of_branches(uint32_t n, const dfm_kin &k);  // fills rest_now of block n
  // Blocks of the tangent: the points, then the springs. See msm_tangent.cpp.
  uint32_t pairs() const { return npoint + nedge; }
  void pattern(uint32_t *ij) const;
  void add_stiffness(const dfm_kin &k, double a, double b, double *blk) const;

 private:
  double scale = 1;  // of shape
  void take_mesh(const dfm_mesh &m);
  struct Layout;
  void build_blocks();
  void order_springs(Layout &l) const;
  void order_cells(Layout &l) const;
  uint32_t high_rank(const Layout &l, uint32_t e) const;
  uint32_t spring_halo(Layout &l, uint32_t b) const;
  size_t fill_springs(const Layout &l, Block &out, uint32_t b, size_t quads_at);
  size_t fill_cells(const Layout &l, Block &out, uint32_t b, size_t cells_at);
  void take_fields(const dfm_mesh &m);
  void find_shapes();
  // memory for new parameters, allocated before anything changes: arrays to swap in, sums and vectors
  struct Room {
    Buffer<double> edge_tilt, edge_rest, tilt, edge_damp, damp_most, damp, point_drag, rest_now;
    Buffer<double> damp_share, drag_around, own, next, gradient, tangent;
  };
  void make_room(Room &room) const;
  double largest_of(Param which) const;
  double largest_volume() const;
  void find_tilts(Room &room);
  void find_dampers(Room &room);
  void find_effects();
  void fill_stiffness();
  void fill_single();
  void find_weights(Room &room);
  // store(n, b): takes the sums of block n
  template <class Store>
  void sum_forces(const dfm_kin &k, bool in_single, const Store &store);
  // use(i, |A_i|, sums): of all springs and cells of the point, for all points
  template <class Use>
  void each_row(const dfm_kin &k, const Use &use);
  double spring_energy(uint32_t e, const dfm_kin &k, const Branch &branch) const;
  struct SpringTangent { double along, across; };  // N/m
  SpringTangent spring_tangent(uint32_t e, double square, const Branch &branch) const;
  void add_springs(const dfm_kin &k, double a, double b, double *blk) const;
  void add_cells(const dfm_kin &k, double a, double *blk) const;
};

// Best kernels of this processor, or those that DEFORM_SIMD names.
const Kernels *choose_kernels(const dfm_host *host);

// Six times the volume and the length of a spring, by the operations of the kernels, so that forces of the
// rest shape are exactly zero.
inline double volume6_of(const double *x0, const double *x1, const double *x2, const double *x3) {
  const double a[3] = {x1[0] - x0[0], x1[1] - x0[1], x1[2] - x0[2]};
  const double c[3] = {x2[0] - x0[0], x2[1] - x0[1], x2[2] - x0[2]};
  const double d[3] = {x3[0] - x0[0], x3[1] - x0[1], x3[2] - x0[2]};
  double g[3];
  model::cross(c, d, g);
  return model::dot(a, g);
}
using model::square_between;
inline double length_of(const double *x, const double *y) { return __builtin_sqrt(square_between(x, y)); }

// Energy of a cell from its corners, its stiffness over 36 V0, six volumes at rest and its limit.
double cell_energy_of(const double *const *x, double bulk, double collapse, double rest, double limit);

// Energy of form A over k, the integral of L - L0 over l from rest to l. See msm_energy.cpp.
double turned_energy(double l, double l0, double tilt2);

}  // namespace msm
