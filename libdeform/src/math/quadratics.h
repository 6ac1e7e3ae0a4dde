// The ten quadratic polynomials in space at given places, made orthonormal.
#pragma once
#include <array>
#include <cmath>
#include <vector>

#include "math/vec3.h"

namespace dfm {

constexpr size_t kQuadratics = 10;
using Quadratics = std::array<double, kQuadratics>;

// By place, the values of 1, three linear and six quadratic polynomials, one after another orthonormal in the
// sum over places with these weights. A polynomial that is one of those before it at the places is zero.
class OrthonormalQuadratics {
 public:
  std::vector<Quadratics> at;
  Quadratics sums{};  // over others

  // others(use) calls use(weight, place) for each of the others, of which only sums are wanted.
  template <class Others>
  OrthonormalQuadratics(const std::vector<Vec3> &place, const std::vector<double> &weight, Others &&others)
      : weight_(weight) {
    double total = 0, square = 0;
    for (const double w : weight) total += w;
    Vec3 center;
    for (size_t i = 0; i < place.size(); ++i) center += (weight[i] / total) * place[i];
    for (size_t i = 0; i < place.size(); ++i) square += weight[i] / total * norm2(place[i] - center);
    const auto raw = [&](Vec3 p) -> Quadratics {
      const Vec3 x = (1 / std::sqrt(square)) * (p - center);
      return {1, x.x, x.y, x.z, x.x * x.x, x.y * x.y, x.z * x.z, x.x * x.y, x.y * x.z, x.z * x.x};
    };
    for (const Vec3 p : place) at.push_back(raw(p));
    others([&](double w, Vec3 p) {
      const Quadratics q = raw(p);
      for (size_t k = 0; k < kQuadratics; ++k) sums[k] += w * q[k];
    });
    for (size_t k = 0; k < kQuadratics; ++k) {
      const double before = product(k, k);
      for (int again = 0; again < 2; ++again)  // the second time for what rounding has left
        for (size_t l = 0; l < k; ++l) {
          const double part = product(k, l);
          for (Quadratics &t : at) t[k] -= part * t[l];
          sums[k] -= part * sums[l];
        }
      const double left = product(k, k);
      const double scale = left > kFlat * before ? 1 / std::sqrt(left) : 0;
      for (Quadratics &t : at) t[k] *= scale;
      sums[k] *= scale;
    }
  }

 private:
  static constexpr double kFlat = 1e-10;  // of a polynomial's square: it depends on those before it
  const std::vector<double> &weight_;

  double product(size_t k, size_t l) const {
    double sum = 0;
    for (size_t i = 0; i < at.size(); ++i) sum += weight_[i] * at[i][k] * at[i][l];
    return sum;
  }
};

}  // namespace dfm
