// Kernels of the corotational model, chosen at run time by instruction set. All of them do the same IEEE
// operations in the same order, four cells at a time, so that the instruction set never shows in a result:
//   gradient   F = (e1 (x) g1 + e2 (x) g2) + e3 (x) g3, e_k the edges from corner 0, g_k the rest gradients
//   rotation   closed form from the trace of the stretch, see model_common/polar_lanes.h; cells for which
//              that is not accurate go to Block::rotate one by one
//   forces     f_k = -P g_k, f_0 = -((f_1 + f_2) + f_3), P V at once: 2 mu and lambda hold the volume
// Corners are added cell after cell in the order 1 2 3 0. Plain data only: kernel files see no STL and
// nothing with external inline code.
#pragma once
#include <stdint.h>

#include "../model_common/block_points.h"

namespace corot {

constexpr uint32_t kGroup = 8;  // cells side by side in memory, one per lane of the widest vector

struct Group {
  double g[9][kGroup];                 // g[3 k + a]: component a of the gradient of corner k + 1 at rest
  double mu2[kGroup], lambda[kGroup];  // 2 mu V, lambda V; 0 for a cell that fills up
  uint32_t p[kGroup][4];               // local points
};
// Places of the blocks of a cell in the stiffness: its corners by themselves, then its edges in the order
// of model_common/edges.h.
struct SlotGroup { uint32_t slot[10][kGroup]; };
// Transverse isotropy: unit axis at rest and the constants of model_common/material.h times the volume.
struct FiberGroup {
  double axis[3][kGroup];
  double alpha[kGroup], beta[kGroup], shear[kGroup];  // shear: 2 (mu_along - mu)
  double most[kGroup];                                // largest eigenvalue of the elasticity, or more
  double young[kGroup];                               // across the axis
};

// Plastic cells (model_common/plastic.h): constants of the material, the first two times the volume.
struct PlasticGroup { double yield[kGroup], hardening[kGroup], limit[kGroup]; };

// The rotation of a cell from its gradient, both row-major.
using Rotate = void (*)(const double *gradient, double *rotation);

// The energy of a cell: linear in the frame, or of the gradient itself (Smith, de Goes, Kim 2018; Saint
// Venant and Kirchhoff). With mu, lambda those of linear elasticity and E = (F^T F - I)/2
//   neo-Hookean  W = m/2 (n - 3) - m/2 ln((n + 1)/4) + l/2 (J - 1)^2 - 3/4 m (J - 1),  n = |F|^2, J = det F,
//                m = 4/3 mu, l = lambda + 5/6 mu,
//                P = m (1 - 1/(n + 1)) F + (l (J - 1) - 3/4 m) cof F
//   St. Venant   W = mu E:E + lambda/2 (tr E)^2,  P = F (2 mu E + lambda tr(E) I)
enum Energy : uint32_t { kLinear, kNeoHookean, kVenant };

// One block of the body. Where `nodal` the zeros of p are the volume change of the point and its rate.
struct Block : model::BlockPoints {
  uint32_t groups;
  uint32_t energy;      // Energy
  uint32_t rotate_all;  // no closed form, every cell goes to `rotate`
  uint32_t nodal;       // the volume change is that of the points, see corot_nodal.cpp
  const Group *group;
  const FiberGroup *fiber;  // NULL: isotropic
  const double *damp;       // [groups,8] s; NULL: none
  // NULL: elastic; else the rest counts: state [ncell,7] of the host, `state_out` NULL where not wanted;
  // number of each cell [groups,8], ~0 for one that fills up; share of the flow at once, and one over it.
  const PlasticGroup *plastic;
  const double *state;
  double *state_out;
  const uint32_t *cell;
  double flow, per_flow;
  double collapse;  // 0 where no cell resists collapse
  const SlotGroup *slots;
  double *value;       // [groups,8] what `energies` and `twists` write
  double *damp_value;  // [groups,8] what `twists` writes of dampers; NULL without
  Rotate rotate;
};

struct Kernels {
  // Those of model_common/block_lanes.h.
  void (*load)(const model::BlockPoints &b, const double *x, const double *v, uint32_t stride);
  // Adds the cells' shares in the volume change of their points, and in its rate where there are dampers, to
  // the first two components of f.
  void (*dilate)(const Block &b);
  void (*forces)(const Block &b);
  // out [ncell,6] of the host, Pa m^3: xx yy zz xy yz zx; cells [groups,8]: number of each, ~0 for one that
  // fills up
  void (*stresses)(const Block &b, const uint32_t *cells, double *out);
  void (*energies)(const Block &b);  // J per cell, of kLinear
  // Stiffness of each cell, and of its damper, beyond that at rest; all of it where the energy is not linear.
  // See corot_bound.cpp.
  void (*twists)(const Block &b);
  // blk -= (a + b damp) R K_e R^T of each cell
  void (*tangents)(const Block &b, double a, double damp, double *blk);
  void (*merge)(double *f, const model::Merge *merge, uint32_t n);
  void (*store)(const model::BlockPoints &b, double *f, uint32_t stride);
};

// The sum of the two smaller stretches of a cell, over the trace of all three, from which on the bound counts
// it: where it vanishes two rotations are equally near and the energy has a kink.
constexpr double kMinPair = 0.1;

// The volume, over that at rest, that a flatter cell counts as having in its Cauchy stress.
constexpr double kMinVolume = 1e-3;

// The volume, over that at rest, below which a cell resists collapse (corot_collapse.h), and by how much it
// may fall until the next bound.
constexpr double kFlat = 0.5, kFalls = 0.1;

const Kernels *kernels_sse2();
const Kernels *kernels_avx2();
const Kernels *kernels_avx512();

}  // namespace corot
