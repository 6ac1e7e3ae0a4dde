// Mass-spring kernels, chosen at run time by instruction set. All of them do the same IEEE operations in
// the same order:
//   spring  L = sqrt((dx^2 + dy^2) + dz^2),  F = k [(L - L0)/L + damp (dv.d)/L^2] d  (2.25), (2.26 corrected)
//   tilted  L = sqrt(((dx^2 + dy^2) + dz^2) + w^2) in its place, w the frozen extra coordinates' part
//           of d                                                             (chapter 6, form B)
//   turned  l = sqrt(d.d),  F = k [(L - L0)/l + damp (dv.d)/(l L)] d                     (chapter 6, form A)
//   branch  F = k [(a e + part r)/L + damp (dv.d)/L^2] d,  e = L - L0, and r for the next step
//                                                                            (Fig. 2.5 a, c)
//   row     f_i += (F0 + F1) + (F2 + F3) per quad of springs, then f_j -= F one spring after the other
//   cell    6V = a.(b x c),  p = kV/(36 V0) (6V0 - 6V) + kC/(36 V0) max(0, 0.6 6V0 - 6V)  (2.27 corrected,
//           collapse) with 6V kept between -6V0 and 18V0, and taken from a cell whose edges have grown beyond
//           a limit as doc/models/msm.md says
//           F_n = p g_n,  F_0 = -((F_1 + F_2) + F_3), four cells at a time, corner after corner in the order
//           1 2 3 0; four cells without pressure are left out, and so is the second term where none of them
//           has lost so much, which changes no bit: sums that begin at +0 never become -0
// so that the instruction set never shows in a result. Plain data only: kernel files see no STL and nothing
// with external inline code.
#pragma once
#include <stdint.h>

#include "../model_common/block_points.h"
#include "../model_common/volume_limits.h"

namespace msm {

// Large bodies wait for memory, so numbers of points within a block have 16 bits.
constexpr uint32_t kMaxLocal = 65536;
// Four springs that leave the same point. Short rows are filled with springs of stiffness zero.
struct Quad { uint16_t i, j[4]; };
// A cell: local points, orientation as given.
struct Cell { uint16_t p[4]; };

// One block of the body.
struct Block : model::BlockPoints {
  uint32_t quads, cells;  // quads is even, cells a multiple of 8
  // [local,8] row sums: the springs' block xx yy zz, coupling (kTilted, kTurned), xy yz zx, then
  // the cells' row times the weight
  double *row;
  const double *weight;            // [local] of the row sums, see Body::find_weights
  const Quad *quad;                // [quads]
  const double *stiffness, *rest;  // [quads,4] N/m, m
  // [quads,4] w^2, m^2; damper over stiffness, s; each NULL where nothing calls for it
  const double *tilt, *damp;
  // [quads,4] number of the spring in the host's list, ~0 for one that fills up
  const uint32_t *edge;
  const Cell *cell;              // [cells]
  const double *bulk, *volume6;  // [cells] kV/(36 V0), 6 V0 >= 0
  const double *collapse;        // [cells] kC/(36 V0)
  uint32_t *limited;             // cells beyond it, counted by cell_rows; those that fill up have none
  const double *limit;           // [cells] kLimit times the sum of the squared edges at rest, m^2
  double least_limit;            // of them: below it none is read
};

// A spring with a dashpot in series beside it, for one step: p = r + kept e is the stretch of the branch's
// spring (doc/models/msm.md).
struct Branch {
  double follow, part;  // a = 1 - part (1 - kept); share of the branch in the stiffness
  double kept;          // of the step that led here
  double keep, next;    // exp(-h/tau) and kept of the step that begins
  const double *state;  // [nedge] r
  double *state_out;    // [nedge] r of the next step; NULL: not wanted
};

// How a spring's length counts, and where its damper's constant comes from.
enum Form : uint32_t { kPlain, kTilted, kTurned, kForms };
enum Damping : uint32_t { kUndamped, kUniform, kPerSpring, kDampings };

// The same in single precision. A point: its place in units of 2^n m from the first point of its block, and
// its velocity less that point's.
struct SinglePoint {
  int32_t x[4];
  float v[4];
};
// Groups of kFans fans of cells (msm_fans.h), a lane of floats each. The points of a group are a, b and its
// ring; its springs those from a to all others, in that order. Where a fan of a group has fewer
// cells than another, its last ring point is repeated. What is missing has no stiffness.
constexpr uint32_t kFans = 8, kMaxInFan = 8;  // fans of a group, cells of a fan
struct SingleBlock : model::BlockPoints {
  SinglePoint *at;  // [local]
  int *above;       // power of two above the largest offset of the last call: guessed for this one
  uint32_t groups;
  const uint32_t *cells;                           // [groups] of the longest fan
  const uint16_t *number;                          // [groups][cells + 3][kFans] of points times 4
  const float *stiffness, *rest, *tilt, *damp;     // [groups][cells + 2][kFans]
  const float *bulk, *volume6, *collapse, *limit;  // [groups][cells][kFans]
};
struct SingleKernels {
  // Clears f; returns the unit of the places, m: NaN where one is not finite.
  float (*load)(const SingleBlock &b, const double *x, const double *v, uint32_t stride);
  // plain, tilted; then without, with cells
  void (*forces[2][kDampings][2])(const SingleBlock &b, float unit, float damp);
};

// Plain or tilted springs in the host's order, without branches.
struct SpringList {
  uint32_t n;                         // a multiple of 4
  const uint32_t *edges;              // [n,2]
  double scale;                       // of shape
  const double *shape, *rest, *tilt;  // [n] N/m over scale, m, m^2 or NULL
};

struct Kernels {
  const char *name;
  const SingleKernels *single;
  // As merge and store those of model_common/block_lanes.h.
  void (*load)(const model::BlockPoints &b, const double *x, const double *v, uint32_t stride);
  // damp: seconds, of kUniform
  void (*springs[kForms][kDampings])(const Block &b, double damp);
  // tilted or plain (tilt zero)
  void (*branches[kDampings])(const Block &b, double damp, const Branch &branch);
  void (*cells)(const Block &b);
  // clears row, then both at the loaded points: what the step bound is made of
  void (*spring_rows[kForms])(const Block &b);
  void (*cell_rows)(const Block &b);
  void (*merge)(double *f, const model::Merge *merge, uint32_t n);
  void (*merge_rows)(double *row, const model::Merge *merge, uint32_t n);
  void (*store)(const model::BlockPoints &b, double *f, uint32_t stride);
  // return `sum` and the energies beyond it, J
  double (*spring_energies)(const SpringList &s, const double *x, uint32_t stride, double sum);
  double (*cell_energies)(const Block &b, const double *x, uint32_t stride, double sum);
  void (*drag)(const model::BlockPoints &b, const double *mass, const double *by_point, double all,
               const double *v, uint32_t stride);
};

// Springs shorter than this carry no force: their direction is rounding. The square root of the
// smallest safe square.
constexpr double kShortestSquared = 1e-200;
constexpr float kShortestSingle = 1e-30f;

const Kernels *kernels_sse2();
const Kernels *kernels_avx2();
const Kernels *kernels_avx512();

}  // namespace msm
