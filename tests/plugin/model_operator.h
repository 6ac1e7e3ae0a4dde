// The spectrum of a model at a shape, from its forces, and whether free vibration stays bounded.
#pragma once
#include "model_host.h"

namespace model_test {

// K u and C w at the instance's shape, from forces by central differences in position (at rest velocity) and
// in velocity (linear).
struct Operator {
  ModelInstance &b;
  std::vector<double> shape;
  explicit Operator(ModelInstance &body) : b(body), shape(body.x, body.x + 4 * body.size()) {}
  std::vector<double> forces_at(const std::vector<double> &u, double step, const std::vector<double> *w) {
    for (uint32_t i = 0; i < b.size(); ++i)
      for (int a = 0; a < 3; ++a) {
        b.x[4 * i + a] = shape[4 * i + a] + step * u[3 * i + a];
        b.v[4 * i + a] = w ? (*w)[3 * i + a] : 0;
      }
    b.forces();
    std::vector<double> f;
    for (uint32_t i = 0; i < b.size(); ++i)
      for (int a = 0; a < 3; ++a) f.push_back(b.f[4 * i + a]);
    return f;
  }
  // (h^2 K + 2 h C) u / m
  std::vector<double> apply(const std::vector<double> &u, double h) {
    double most = 1e-300;
    for (double a : u) most = std::max(most, std::abs(a));
    const double step = 1e-7 / most;
    std::vector<double> plus = forces_at(u, step, nullptr);
    std::vector<double> minus = forces_at(u, -step, nullptr);
    std::vector<double> out(u.size());
    std::vector<double> zero(u.size(), 0), damped = forces_at(zero, 0, &u),
                                           still = forces_at(zero, 0, nullptr);
    for (size_t n = 0; n < u.size(); ++n)
      out[n] =
          (-h * h * (plus[n] - minus[n]) / (2 * step) - 2 * h * (damped[n] - still[n])) / b.mesh.mass[n / 3];
    return out;
  }
  // Largest eigenvalue by power iteration, with a shift that keeps negative stiffness of compressed springs
  // out of the way.
  double largest(double h, int iterations) {
    std::mt19937 random(5);
    std::normal_distribution<double> normal;
    std::vector<double> u(3 * b.size());
    for (double &a : u) a = normal(random);
    double value = 0;
    for (int it = 0; it < iterations; ++it) {
      const std::vector<double> q = apply(u, h);
      double uu = 0, uq = 0;
      for (size_t n = 0; n < u.size(); ++n) {
        uu += b.mesh.mass[n / 3] * u[n] * u[n];
        uq += b.mesh.mass[n / 3] * u[n] * q[n];
      }
      value = uq / uu;
      for (size_t n = 0; n < u.size(); ++n) u[n] = q[n] + 2 * u[n];
      double norm2 = 0;
      for (double a : u) norm2 += a * a;
      for (double &a : u) a /= std::sqrt(norm2);
    }
    return value;
  }
};

// Free vibration by symplectic Euler with the velocity of the last step in the dampers; small enough
// to stay linear.
inline double growth(ModelInstance &b, double h, int steps) {
  double start = 0, most = 0;
  for (int n = 0; n < steps; ++n) {
    b.forces();
    double moved = 0;
    for (uint32_t i = 0; i < b.size(); ++i) {
      b.set(b.v, i, b.get(b.v, i) + (h / b.mesh.mass[i]) * b.get(b.f, i));
      b.set(b.x, i, b.get(b.x, i) + h * b.get(b.v, i));
      moved = std::max(moved, norm(b.get(b.x, i) - b.mesh.at(i)));
    }
    if (!(moved < 1e6)) return 1e300;
    if (n < 10) start = std::max(start, moved);
    most = std::max(most, moved);
  }
  return most / start;
}

}  // namespace model_test
