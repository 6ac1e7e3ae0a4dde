// Linear elasticity: constants of the isotropic and of the transversely isotropic solid. Order of stress and
// strain xx yy zz xy yz zx, shear strain as twice the tensor's (engineering).
#pragma once
#include <cmath>

namespace model {

struct Lame { double lambda, mu; };
inline Lame lame_of(double young, double poisson) {
  return {young * poisson / ((1 + poisson) * (1 - 2 * poisson)), young / (2 * (1 + poisson))};
}

// Five constants of a solid that is the same in all directions across an axis (the fiber):
//   young, poisson        in the plane across the axis
//   young_along           along the axis
//   poisson_along         contraction across the axis for a pull along it, over that pull's strain
//   shear_along           shear modulus of planes that contain the axis
struct Transverse { double young, poisson, young_along, poisson_along, shear_along; };

// The same as an energy density (Spencer 1984, Continuum Theory of the Mechanics of Fibre-Reinforced
// Composites): with e the strain, a the unit axis, t = tr e, q = a.e a,
//   W = lambda/2 t^2 + mu e:e + alpha t q + 2 (mu_along - mu) |e a|^2 + beta/2 q^2
//   stress = lambda t I + 2 mu e + alpha (q I + t a a) + 2 (mu_along - mu) (a (e a) + (e a) a) + beta q a a
struct Fiber { double lambda, mu, alpha, beta, mu_along; };

// False where the constants have no positive energy. With n = poisson_along^2 young / young_along the plane
// strain of the plane has the bulk modulus k = young / (2 (1 - poisson - 2 n)).
inline bool fiber_of(const Transverse &t, Fiber &out) {
  const double ratio = t.poisson_along * t.poisson_along * t.young / t.young_along;
  const double room = 1 - t.poisson - 2 * ratio;
  if (!(t.young > 0 && t.young_along > 0 && t.shear_along > 0 && t.poisson > -1 && room > 0)) return false;
  const double k = t.young / (2 * room), mu = t.young / (2 * (1 + t.poisson));
  // c11 = k + mu, c12 = k - mu, c13 = 2 nu k, c33 = E_along + 4 nu^2 k, c44 = shear_along, axis 3
  const double lambda = k - mu, c13 = 2 * t.poisson_along * k;
  const double c33 = t.young_along + 4 * (t.poisson_along * t.poisson_along) * k;
  out.lambda = lambda;
  out.mu = mu;
  out.alpha = c13 - lambda;
  out.mu_along = t.shear_along;
  out.beta = c33 - lambda - 2 * mu - 2 * out.alpha - 4 * (t.shear_along - mu);
  return true;
}

// No strain has more than this times its square as twice its energy: the axially symmetric strains have the
// 2 x 2 matrix of c11 + c12, sqrt 2 c13, c33, the others 2 mu and 2 mu_along.
inline double largest_modulus(const Fiber &c) {
  const double plane = 2 * (c.lambda + c.mu), cross = c.lambda + c.alpha;
  const double along = c.lambda + 2 * c.alpha + 4 * c.mu_along - 2 * c.mu + c.beta;
  const double half = 0.5 * (plane - along), mean = 0.5 * (plane + along);
  const double both = mean + std::sqrt(half * half + 2 * (cross * cross)),
               shear = 2 * std::fmax(c.mu, c.mu_along);
  return both > shear ? both : shear;
}

// D[6][6] of stress = D strain; axis of unit length.
inline void elasticity_matrix(const Fiber &c, const double *axis, double (*d)[6]) {
  constexpr int kRow[6] = {0, 1, 2, 0, 1, 2}, kCol[6] = {0, 1, 2, 1, 2, 0};
  const double shear = c.mu_along - c.mu;
  const auto delta = [](int i, int j) { return i == j ? 1.0 : 0.0; };
  for (int m = 0; m < 6; ++m)
    for (int n = 0; n < 6; ++n) {
      const int i = kRow[m], j = kCol[m], k = kRow[n], l = kCol[n];
      const double ai = axis[i], aj = axis[j], ak = axis[k], al = axis[l];
      d[m][n] = c.lambda * delta(i, j) * delta(k, l) +
                c.mu * (delta(i, k) * delta(j, l) + delta(i, l) * delta(j, k)) +
                c.alpha * (delta(i, j) * ak * al + ai * aj * delta(k, l)) +
                shear * ((ai * ak * delta(j, l) + ai * al * delta(j, k)) +
                         (aj * ak * delta(i, l) + aj * al * delta(i, k))) +
                c.beta * ai * aj * ak * al;
    }
}
inline void elasticity_matrix(const Lame &c, double (*d)[6]) {
  const double any[3] = {0, 0, 1};
  elasticity_matrix({c.lambda, c.mu, 0, 0, c.mu}, any, d);
}

}  // namespace model
