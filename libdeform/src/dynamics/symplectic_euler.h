// Symplectic Euler in velocity form: v' = v + h M^-1 (f + m g + contact), x' = x + h v'. The mean velocity
// over the sub-step is v', which is what contact needs. (The position form loses h^2 a to rounding:
// doc/concepts/step.md.)
#pragma once
#include <cmath>
#include <limits>

#include "body/phyxels.h"
#include "dynamics/points_kernel.h"
#include "geometry/surface.h"

namespace dfm {

const PointsKernels &points_kernels();  // the widest of this processor

// Largest stable sub-step. For every mode of K - w^2 M with dampers C taken from the start of the step the
// scheme is stable iff h^2 k + 2 h c <= 4 m; with Gershgorin row sums this holds for the whole matrix if it
// holds for each point:
// h = [-c + sqrt(c^2 + 4 m k)] / k, or 4m / (c + sqrt(c^2 + 4 m k)): the same root without cancellation, and
// defined for k = 0.
inline double stable_step(double k, double c, double m) {
  const double bottom = c + std::sqrt(c * c + 4 * m * k);
  return bottom > 0 ? 4 * m / bottom : std::numeric_limits<double>::infinity();
}
// s, the longest lag of dampers that are `ratio` (s) times the springs beside them, in a body whose slowest
// uniform strain has this angular frequency (doc/concepts/step.md, "Dampers").
double damper_lag(double ratio, double frequency);
// The stable step of all points. ksum, csum: [n] row sums of K and C (N/m, N s/m). worst: the point that
// bounds, or n.
double stable_step(const Phyxels &p, const double *ksum, const double *csum, uint32_t *worst);

}  // namespace dfm
