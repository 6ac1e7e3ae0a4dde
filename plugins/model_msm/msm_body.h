// A mass-spring body: the springs and cells of a mesh, cut into blocks that fit the first-level cache, and
// the ops on them.
#pragma once
#include <cstring>

#include "../model_common/blocks.h"
#include "../model_common/entry.h"
#include "../model_common/mass_spring.h"
#include "msm_kernel.h"

namespace msm {

using model::Refused;

constexpr const char *kId = "org.deform.msm";
void complain(const dfm_host *h, const char *what);
bool valid(const dfm_host *h, const double *values);  // of all parameters; false after the reason was logged

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

struct Body : model::Blocks<Block>, Material {
  using Row = Param;
  static constexpr const char *kName = kId;
  // From this size on blocks go through the host's parallel_for; below it waking a worker costs more than it
  // saves. Summing the blocks is a twentieth of the work.
  static constexpr uint32_t kParallelCells = 10000, kParallelMergeCells = 100000;

  const Kernels *kernels = nullptr;
  // In the host's order.
  Buffer<double> mass, edge_energy;
  Buffer<double> weight;  // [npoint] of the row sums
  // [npoint] rows at rest: no shape counts as less stiff, for it may be left in a few steps
  Buffer<double> rest_rows;
  Buffer<double> spring_sum, coupled;  // [npoint] sum of the springs' stiffness k; sum of k w_other / w_own

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

  Form form() const { return edge_tilt.empty() ? kPlain : is_turned() ? kTurned : kTilted; }
  Damping damping() const { return !damping_on ? kUndamped : edge_damp.empty() ? kUniform : kPerSpring; }

  Branch branch_at(const dfm_kin &k) const;

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
  Material &springs() { return *this; }
  const Material &springs() const { return *this; }
  void mask_changed();
  void rest_of_branches(uint32_t n, const dfm_kin &k);  // fills rest_now of block n
  // Blocks of the tangent: the points, then the springs. See msm_tangent.cpp.
  uint32_t pairs() const { return npoint + nedge; }
  void pattern(uint32_t *ij) const;
  void add_stiffness(const dfm_kin &k, double a, double b, double *blk) const;

 private:
  void take_mesh(const dfm_mesh &m);
  struct Layout;
  void build_blocks();
  void order_springs(Layout &l) const;
  void order_cells(Layout &l) const;
  uint32_t high_rank(const Layout &l, uint32_t e) const;
  uint32_t spring_halo(Layout &l, uint32_t b) const;
  size_t fill_springs(const Layout &l, Block &out, uint32_t b, size_t quads_at);
  size_t fill_cells(const Layout &l, Block &out, uint32_t b, size_t cells_at);
  struct Room : Material::Room { Buffer<double> tilt, damp, rest_now, own, next, gradient, tangent; };
  void make_room(Room &room) const;
  void place_material(Room &room);
  void fill_stiffness();
  void fill_single();
  void find_weights(Room &room);
  // store(n, b): takes the sums of block n
  template <class Store>
  void sum_forces(const dfm_kin &k, bool in_single, const Store &store);
  // use(i, |A_i|, sums): of all springs and cells of the point, for all points
  template <class Use>
  void each_row(const dfm_kin &k, const Use &use);
  struct SpringTangent { double along, across; };  // N/m
  SpringTangent spring_tangent(uint32_t e, double square, const Branch &branch) const;
  void add_springs(const dfm_kin &k, double a, double b, double *blk) const;
  void add_cells(const dfm_kin &k, double a, double *blk) const;
};

// Best kernels of this processor, or those that DEFORM_SIMD names.
const Kernels *choose_kernels(const dfm_host *host);

}  // namespace msm
