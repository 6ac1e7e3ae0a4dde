// Loops over points, four doubles each, compiled for several vector widths: the same operations on each
// component at every width. Plain data only.
#pragma once
#include <cstdint>

namespace dfm {

struct PointsKernels {
  // free = v + h (w (f + mass g)), of all points [n,4]; returns the kinetic energy at free, J. gravity: [4]
  double (*predict)(uint32_t n, double h, const double *gravity, const double *mass, const double *v,
                    const double *w, const double *f, double *free);
  // v_end = free + w impulse (impulse null: free), x_end = x + h v_end
  void (*end)(uint32_t n, double h, const double *x, const double *free, const double *w,
              const double *impulse, double *x_end, double *v_end);
};

const PointsKernels &points_kernels_sse2();
const PointsKernels &points_kernels_avx2();

}  // namespace dfm
