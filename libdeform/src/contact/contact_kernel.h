// Loops of the contact solve, compiled for several vector widths. Every element sees the same operations in
// the same order at each width: the four lanes are the components of one point (the last one is ignored), or
// four of the partial sums. Contacts are processed in order, because each starts from the result of the one
// before. Plain data only.
#pragma once
#include <cstddef>
#include <cstdint>

namespace dfm {

// The part of a law's dft/dvt that dissipates: its symmetric part without the positive eigenvalue, and its
// antisymmetric part, which does no work. [a b; c d], N s/m; v.D v <= 0 for every v.
struct Slope { double a, b, c, d; };
// How a law is solved: by its slopes, by projection on the disc of radius limit, or not at all (no force).
enum LawForm : uint8_t { kSmoothLaw, kSetValuedLaw, kNoFriction };
// Of a smooth law: slope D, and 1 - h w_t D as [m11 m12; m21 m22] with its determinant.
struct LinearLaw {
  Slope slope;
  double m11, m12, m21, m22, det;
};

// Members of ContactRows, with the same names, if all dofs respond to their own impulses only.
struct RowsView {
  uint32_t n;
  const uint32_t *begin, *dof;
  const double *weight;
  const double *alone;          // [ndof,4]
  const double *frame, *drive;  // [n,9], [n,3] plus one vector, which is ignored
  const double *across;         // [n,9] the frame transposed, and a vector more
  const double *rate, *wn, *wt, *cross;
  const double *compliance;  // [n,3] softness, its largest effect, the load from which on it acts
};
// Of ContactState.
struct LawView {
  size_t stride;
  const double *fn, *vt, *ft, *dft_dvt, *dft_dfn, *limit;
  const uint8_t *mode, *form;
  const LinearLaw *linear;
};
// Of Tolerance.
struct ToleranceView {
  const double *normal, *tangent;
  double most_normal;
};

// Residual of a state. Of each contact, m/s: r_n = |min(w_n lambda_n, u_n + gap/h)|, r_t = w_t |lambda_t -
// law|. `relative` is the worst over its tolerance: at most 1 is converged. `required` is the same with
// most_normal for normal[i]: the required accuracy; the rest may be left to the warm start of the next
// sub-step. `normal` is the worst r_n alone, m/s.
struct Residual { double relative = 0, required = 0, speed = 0, normal = 0; };

struct ContactKernels {
  // One sweep of block Gauss-Seidel in contact order; y [ndof,4] and impulse [n,3] change.
  void (*sweep)(const RowsView &rows, const LawView &law, double h, double *y, double *impulse);
  // Of all contacts by the linearized laws.
  Residual (*residual)(const RowsView &rows, const LawView &law, const ToleranceView &tolerance, double h,
                       const double *y, const double *impulse);
  // Impulses, and y with them, change by jump [n,3]; a normal impulse never comes below zero.
  void (*leap)(const RowsView &rows, const double *jump, double *y, double *impulse);
  // n is a multiple of 4. f = metric (now - from); where df is not null, df = f - f before, dg = now - g
  // before; g = now.
  void (*differences)(size_t n, const double *metric, const double *now, const double *from, double *f,
                      double *g, double *df, double *dg);
  // a.y, a.z, b.y and b.z, each of four partial sums
  void (*dots)(size_t n, const double *a, const double *b, const double *y, const double *z, double out[4]);
  // out = - sum_j gamma_j dg_j, dg [count,n]
  void (*combine)(size_t n, uint32_t count, const double *gamma, const double *dg, double *out);
};

const ContactKernels &contact_kernels_sse2();
const ContactKernels &contact_kernels_avx2();

}  // namespace dfm
