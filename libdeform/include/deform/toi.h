/* deform/toi.h -- time of impact of points, triangles and edges whose vertices move on straight paths
 * over a step. */
#ifndef DEFORM_TOI_H
#define DEFORM_TOI_H
#include "deform/base.h"
#ifdef __cplusplus
extern "C" {
#endif

/** Straight path at constant speed: p0 at t = 0, p1 at t = 1, m. */
typedef struct { double p0[3], p1[3]; } dfm_motion;

/** How a query is answered; every field but size may be 0.
 * method          one of DFM_TOI_*; options NULL: conservative with all defaults
 * tolerance       a number, 0: 1e-12. Conservative: the share of the extent (the largest coordinate
 *                 difference between the two features at either end of the step) by which features may still
 *                 be apart when they are called touching. Others: width of t at which a root counts as found;
 *                 near misses below 8 times that share count as touches.
 * min_separation  m; touching is a distance of at most that
 * max_iterations  0: 512 for conservative, 100 per root for the others. Conservative then answers the last
 * time that it knows to be safe,
 *                 the others the best they have. */
typedef struct {
  uint32_t size;
  int32_t method;
  double tolerance, min_separation;
  int32_t max_iterations;
} dfm_toi_options;

/* CONSERVATIVE never answers later than the exact time and never misses. The others find the roots of the
 * exact conditions for a touch (the coplanarity cubic) to rounding, take the earliest where the features do
 * touch, and differ in how they close in on a root. */
enum { DFM_TOI_BISECTION = 0, DFM_TOI_REGULA_FALSI = 1, DFM_TOI_BRENT = 2, DFM_TOI_CONSERVATIVE = 3 };

/** First time in [0,1] at which the point touches the closed triangle. The answer's bits depend neither
 * on the order of the triangle's vertices, nor on a translation that is exact in doubles, nor on a power
 * of two as scale.
 * @param t     out: the time; 0 where they touch from the start; +INFINITY: they never touch
 * @param bary  out, may be NULL: weights of the triangle's vertices at the nearest point at t; left as
 * it is for a miss
 * @return DFM_OK; DFM_E_ARG an argument is NULL, a coordinate or option is not finite or out of range
 * (nothing is written).
 * Threads: Any thread. Since 0.1. */
DFM_API dfm_status dfm_toi_point_triangle(const dfm_motion *p, const dfm_motion tri[3],
                                          const dfm_toi_options *options, double *t, double bary[3]);

/** First time in [0,1] at which two closed edges touch; the same bits for swapped edges and ends.
 * @param ab  out, may be NULL: where on a (0: a[0], 1: a[1]) and where on b at t; left as it is for a miss.
 * Else as above.
 * Threads: Any thread. Since 0.1. */
DFM_API dfm_status dfm_toi_edge_edge(const dfm_motion a[2], const dfm_motion b[2],
                                     const dfm_toi_options *options, double *t, double ab[2]);

/** Work of this thread's last dfm_toi_* query that returned DFM_OK: values of the root function (and of its
 * like for a separation) plus distances between the features. Threads: Any thread. Since 0.1. */
DFM_API uint32_t dfm_toi_evaluations(void);
#ifdef __cplusplus
}
#endif
#endif
