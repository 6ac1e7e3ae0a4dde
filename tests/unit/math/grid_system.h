// Block matrices of springs in a grid, and what compares answers about them.
#pragma once
#include <algorithm>
#include <cmath>
#include <random>
#include <stdexcept>
#include <utility>
#include <vector>

#include "dense.h"
#include "math/block_matrix.h"
#include "math/ldlt_solver.h"
#include "near.h"

namespace test {

// A grid of points, each tied to its neighbors up to a corner of its cell, and a share of the identity: what
// an implicit step of springs and masses looks like.
struct Grid {
  uint32_t n = 0;
  std::vector<uint32_t> ij;
  std::vector<double> blk;
  std::vector<double> points;
  dfm::BlockPattern pattern() const { return {n, uint32_t(ij.size() / 2), ij.data()}; }
};

inline Grid grid(uint32_t a, uint32_t b, uint32_t c, double mass, uint32_t seed = 1) {
  Grid g;
  g.n = a * b * c;
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(0.5, 2.0);
  std::vector<double> own(9 * size_t{g.n}, 0.0);
  std::vector<std::pair<std::pair<uint32_t, uint32_t>, std::vector<double>>> blocks;
  const auto point = [&](uint32_t x, uint32_t y, uint32_t z) { return (z * b + y) * a + x; };
  for (uint32_t z = 0; z < c; ++z)
    for (uint32_t y = 0; y < b; ++y)
      for (uint32_t x = 0; x < a; ++x) {
        g.points.insert(g.points.end(), {double(x), double(y), double(z)});
        for (int dz = 0; dz <= 1; ++dz)
          for (int dy = -1; dy <= 1; ++dy)
            for (int dx = -1; dx <= 1; ++dx) {
              if (dz == 0 && (dy < 0 || (dy == 0 && dx <= 0))) continue;
              const int64_t u = int64_t(x) + dx, v = int64_t(y) + dy, w = int64_t(z) + dz;
              if (u < 0 || v < 0 || u >= a || v >= b || w >= c) continue;
              const double k = uniform(random), l2 = dx * dx + dy * dy + dz * dz;
              const double e[3] = {double(dx), double(dy), double(dz)};
              const uint32_t i = point(x, y, z), j = point(uint32_t(u), uint32_t(v), uint32_t(w));
              std::vector<double> block(9);
              for (uint32_t r = 0; r < 3; ++r)
                for (uint32_t s = 0; s < 3; ++s) {
                  // a little of the identity: a spring alone does nothing across itself
                  const double value = k * (e[r] * e[s] / l2 + (r == s ? 0.1 : 0.0));
                  block[3 * r + s] = -value;
                  own[9 * i + 3 * r + s] += value;
                  own[9 * j + 3 * r + s] += value;
                }
              blocks.push_back({{i, j}, block});
            }
      }
  for (uint32_t i = 0; i < g.n; ++i) {
    for (uint32_t r = 0; r < 3; ++r) own[9 * i + 4 * r] += mass;
    blocks.push_back({{i, i}, std::vector<double>(own.begin() + 9 * i, own.begin() + 9 * i + 9)});
  }
  std::shuffle(blocks.begin(), blocks.end(), random);  // any order
  for (const auto &[pair, block] : blocks) {
    g.ij.insert(g.ij.end(), {pair.first, pair.second});
    g.blk.insert(g.blk.end(), block.begin(), block.end());
  }
  return g;
}

inline Dense dense(const Grid &g) {
  Dense a(3 * size_t{g.n}, 3 * size_t{g.n});
  for (size_t b = 0; b < g.ij.size() / 2; ++b)
    for (size_t r = 0; r < 3; ++r)
      for (size_t c = 0; c < 3; ++c) {
        const size_t row = 3 * g.ij[2 * b] + r, column = 3 * g.ij[2 * b + 1] + c;
        a(row, column) = a(column, row) = g.blk[9 * b + 3 * r + c];
      }
  return a;
}

inline std::vector<double> noise(size_t n, uint32_t seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  std::vector<double> v(n);
  for (double &x : v) x = uniform(random);
  return v;
}

inline double worst(const std::vector<double> &a, const std::vector<double> &b) {
  double difference = 0, size = 0;
  for (size_t k = 0; k < a.size(); ++k) {
    difference = worse(difference, std::fabs(a[k] - b[k]));
    size = std::max(size, std::fabs(b[k]));
  }
  return difference / size;
}

// Of a system with a pattern and blocks (also block_system.h).
template <class System>
std::vector<double> direct_solution(const System &system, const std::vector<double> &b) {
  dfm::LdltSolver solver(dfm::Memory::standard());
  solver.analyse(system.pattern());
  std::vector<double> x(b.size());
  dfm::SolveInfo info;
  if (!solver.factor(system.blk.data()) || !solver.solve(1, b.data(), x.data(), 0, info))
    throw std::runtime_error("the matrix is not positive definite");
  return x;
}

}  // namespace test
