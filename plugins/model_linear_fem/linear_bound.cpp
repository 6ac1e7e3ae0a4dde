// The step bound. K is the sum of the cells' K_e, and K_e <= kappa_e I with its largest eigenvalue, so the
// diagonal D_i = sum of kappa_e over the cells around i dominates K. kappa_e is known in closed form: forces
// at the corners come of the displacement gradient H alone, so the largest quotient
//   u.K_e u / u.u,   u.K_e u = V (lambda (tr H)^2 + 2 mu sym H : sym H),
// is at the displacements of least u.u for their H, and that is tr(H A^-1 H^T), A = sum g_a g_a^T. Along the
// axes of A, with eigenvalues a_i, each pair of shears is independent, and so are the three stretches:
//   kappa_e = V max( mu (a_i + a_j),  largest eigenvalue of [ lambda sqrt(a_i a_j) + 2 mu a_i delta_ij ] ).
#include <algorithm>
#include <cmath>

#include "linear_body.h"

namespace linear {
namespace {

// Eigenvalues of a symmetric 3x3 matrix, in any order, by Jacobi's rotations; s is destroyed.
void eigenvalues(double (*s)[3], double *out) {
  for (int sweep = 0; sweep < 8; ++sweep)
    for (int p = 0; p < 2; ++p)
      for (int q = p + 1; q < 3; ++q) {
        if (s[p][q] == 0) continue;
        const double theta = (s[q][q] - s[p][p]) / (2 * s[p][q]);
        const double t = (theta < 0 ? -1 : 1) / (std::fabs(theta) + std::sqrt(theta * theta + 1));
        const double c = 1 / std::sqrt(t * t + 1), sine = t * c;
        const int r = 3 - p - q;
        const double rp = s[r][p], rq = s[r][q], pq = s[p][q];
        s[p][p] -= t * pq;
        s[q][q] += t * pq;
        s[p][q] = s[q][p] = 0;
        s[r][p] = s[p][r] = c * rp - sine * rq;
        s[r][q] = s[q][r] = sine * rp + c * rq;
      }
  for (int n = 0; n < 3; ++n) out[n] = s[n][n];
}

}  // namespace

double largest_stiffness(const Tetrahedron &t, const model::Lame &m) {
  double spread[3][3] = {}, a[3], stretch[3][3], value[3];
  for (const double *g : t.g)
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c) spread[r][c] += g[r] * g[c];
  eigenvalues(spread, a);
  for (double &x : a) x = std::max(x, 0.0);
  double most = 0;
  for (int r = 0; r < 3; ++r) {
    most = std::max(most, m.mu * (a[r] + a[(r + 1) % 3]));
    for (int c = 0; c < 3; ++c)
      stretch[r][c] = m.lambda * std::sqrt(a[r] * a[c]) + (r == c ? 2 * m.mu * a[r] : 0);
  }
  eigenvalues(stretch, value);
  for (double x : value) most = std::max(most, x);
  return t.volume * most * (1 + 1e-12);  // rounding of the eigenvalues
}

}  // namespace linear
