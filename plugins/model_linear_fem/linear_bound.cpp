// The step bound. K is the sum of the cells' K_e, and K_e <= kappa_e I with its largest eigenvalue, so the
// diagonal D_i = sum of kappa_e over the cells around i dominates K. kappa_e is known in closed form: forces
// at the corners come of the displacement gradient H alone, so the largest quotient
//   u.K_e u / u.u,   u.K_e u = V (lambda (tr H)^2 + 2 mu sym H : sym H),
// is at the displacements of least u.u for their H, and that is tr(H A^-1 H^T), A = sum g_a g_a^T. Along the
// axes of A, with eigenvalues a_i, each pair of shears is independent, and so are the three stretches:
//   kappa_e = V max( mu (a_i + a_j),  largest eigenvalue of [ lambda sqrt(a_i a_j) + 2 mu a_i delta_ij ] ).
#include <algorithm>
#include <cmath>

#include "../model_common/rotation.h"
#include "linear_body.h"

namespace linear {
double largest_stiffness(const Tetrahedron &t, const model::Lame &m) {
  double spread[3][3] = {}, a[3], stretch[3][3], axes[3][3];
  for (const double *g : t.g)
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c) spread[r][c] += g[r] * g[c];
  model::jacobi(spread, axes);
  for (int r = 0; r < 3; ++r) a[r] = std::max(spread[r][r], 0.0);
  double most = 0;
  for (int r = 0; r < 3; ++r) {
    most = std::max(most, m.mu * (a[r] + a[(r + 1) % 3]));
    for (int c = 0; c < 3; ++c)
      stretch[r][c] = m.lambda * std::sqrt(a[r] * a[c]) + (r == c ? 2 * m.mu * a[r] : 0);
  }
  model::jacobi(stretch, axes);
  for (int r = 0; r < 3; ++r) most = std::max(most, stretch[r][r]);
  return t.volume * most * (1 + 1e-12);  // rounding of the eigenvalues
}

}  // namespace linear
