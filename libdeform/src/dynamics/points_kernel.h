// Loops over points of four doubles, the last of which is zero, compiled for several vector widths: every
// width performs the same operations on each component. Plain data only.
#pragma once
#include <cstdint>

namespace dfm {

// Where points go without contact: free = v + h (w (f + mass g)), x_end = x + h free.
struct FreeMotion {
  double h;
  const double *gravity;  // [4]
  const double *mass, *v, *w, *x;
  double *free, *x_end;
  // A point's memory is prefetched this many points ahead: the points of a part lie in short runs, which the
  // processor does not predict. The number of all points or more: no prefetch.
  uint32_t ahead;
};

struct PointsKernels {
  // of all points [n,4]; f: [n,4] N. Returns the kinetic energy at free, J.
  double (*predict)(const FreeMotion &motion, uint32_t n, const double *f);
  // of the points that are named: f = load + more, load [..,4] of all points, more [n,4] of these
  double (*predict_part)(const FreeMotion &motion, uint32_t n, const uint32_t *point, const double *load,
                         const double *more);
  // v_end = free + w impulse (impulse null: free), x_end = x + h v_end
  void (*end)(uint32_t n, double h, const double *x, const double *free, const double *w,
              const double *impulse, double *x_end, double *v_end);
  // how many of the cells [n,4] are inverted. x: [..,4]
  uint32_t (*inverted)(uint32_t n, const uint32_t *cells, const double *x);
  // of the boxes around cells [n,4], the largest diagonal, squared
  double (*largest_box)(uint32_t n, const uint32_t *cells, const double *x);
  // the least and the largest component of n points, n > 0
  void (*bounds)(uint32_t n, const double *x, double low[4], double high[4]);
  // out [n,4]: the middles of the cells [n] of tets [..,4]
  void (*middles)(uint32_t n, const uint32_t *cells, const uint32_t *tets, const double *x, double *out);
  // of pairs [n,2] of points, the largest distance, squared
  double (*farthest)(uint32_t n, const uint32_t *pairs, const double *x);
  // of edges [n,2] d between points at x that move at v: the largest |d.(v_j - v_i)| / d.d, 1/s
  double (*strain_rate)(uint32_t n, const uint32_t *edges, const double *x, const double *v);
};

const PointsKernels &points_kernels_sse2();
const PointsKernels &points_kernels_avx2();

}  // namespace dfm
