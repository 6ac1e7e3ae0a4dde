// Meshes of second-order tetrahedra and of hexahedra for the host of model_host.h.
#pragma once
#include "model_host.h"

namespace model_test {

// VTK's order of the edges.
constexpr int kEdgesOfTet[6][2] = {{0, 1}, {1, 2}, {0, 2}, {0, 3}, {1, 3}, {2, 3}};

// The middles of the edges as points; `noise` bends the edges by that share of their length.
inline Mesh second_order(const Mesh &m, double noise = 0) {
  Mesh out;
  out.kind = DFM_CELL_TET10;
  out.rest = m.rest;
  std::map<std::pair<uint32_t, uint32_t>, uint32_t> middle;
  std::mt19937 random(11);
  std::uniform_real_distribution<double> u(-noise, noise);
  out.mass.assign(m.npoint(), 0);
  for (uint32_t c = 0; c < m.ncell(); ++c) {
    const uint32_t *q = &m.cells[4 * size_t(c)];
    for (int a = 0; a < 4; ++a) out.cells.push_back(q[a]);
    for (const auto &e : kEdgesOfTet) {
      const auto [at, fresh] = middle.insert({std::minmax(q[e[0]], q[e[1]]), uint32_t(out.rest.size() / 3)});
      if (fresh) {
        const Vec x = m.at(q[e[0]]), y = m.at(q[e[1]]);
        const double length = norm(y - x);
        for (size_t k = 0; k < 3; ++k) out.rest.push_back((x[k] + y[k]) / 2 + length * u(random));
        out.mass.push_back(0);
      }
      out.cells.push_back(at->second);
    }
    for (uint32_t a = 0; a < 10; ++a)
      out.mass[out.cells[10 * size_t(c) + a]] += 1000 * m.volume(c) * (a < 4 ? 1.0 / 36 : 4.0 / 27);
  }
  out.edges = m.edges;  // a mesh has some
  return out;
}

// nx x ny x nz boxes of sides h; `noise` moves inner points by that share of the shortest side.
inline Mesh brick_bar(uint32_t nx, uint32_t ny, uint32_t nz, Vec h, double noise = 0) {
  Mesh m;
  m.kind = DFM_CELL_HEX8;
  const auto id = [&](uint32_t i, uint32_t j, uint32_t k) { return (i * (ny + 1) + j) * (nz + 1) + k; };
  std::mt19937 random(7);
  const double most = noise * *std::min_element(h.begin(), h.end());
  std::uniform_real_distribution<double> u(-most, most);
  for (uint32_t i = 0; i <= nx; ++i)
    for (uint32_t j = 0; j <= ny; ++j)
      for (uint32_t k = 0; k <= nz; ++k) {
        const bool inner = i > 0 && j > 0 && k > 0 && i < nx && j < ny && k < nz;
        const double at[3] = {h[0] * i, h[1] * j, h[2] * k};
        for (double x : at) m.rest.push_back(x + (inner ? u(random) : 0));
      }
  m.mass.assign(m.npoint(), 0);
  for (uint32_t i = 0; i < nx; ++i)
    for (uint32_t j = 0; j < ny; ++j)
      for (uint32_t k = 0; k < nz; ++k)
        for (uint32_t n = 0; n < 8; ++n) {
          const uint32_t p = id(i + ((n % 4) == 1 || (n % 4) == 2), j + (n % 4 > 1), k + n / 4);
          m.cells.push_back(p);
          m.mass[p] += 1000 * h[0] * h[1] * h[2] / 8;
        }
  m.edges = {0, 1};
  return m;
}

// The same bricks as HEX20 or HEX27; `noise` shifts the new nodes by that share of the first edge.
inline Mesh with_middles(const Mesh &m, uint32_t kind, double noise = 0) {
  const std::vector<uint32_t> of[19] = {{0, 1},
                                        {1, 2},
                                        {2, 3},
                                        {3, 0},
                                        {4, 5},
                                        {5, 6},
                                        {6, 7},
                                        {7, 4},
                                        {0, 4},
                                        {1, 5},
                                        {2, 6},
                                        {3, 7},
                                        {0, 3, 4, 7},
                                        {1, 2, 5, 6},
                                        {0, 1, 4, 5},
                                        {2, 3, 6, 7},
                                        {0, 1, 2, 3},
                                        {4, 5, 6, 7},
                                        {0, 1, 2, 3, 4, 5, 6, 7}};
  Mesh out;
  out.kind = kind;
  out.rest = m.rest;
  std::map<std::vector<uint32_t>, uint32_t> known;
  std::mt19937 random(11);
  std::uniform_real_distribution<double> u(-noise, noise);
  out.mass.assign(m.npoint(), 0);
  for (uint32_t c = 0; c < m.ncell(); ++c) {
    const uint32_t *const q = &m.cells[8 * size_t(c)];
    const Vec d = m.at(q[6]) - m.at(q[0]);
    out.cells.insert(out.cells.end(), q, q + 8);
    for (uint32_t k = 0; k + 8 < out.nodes(); ++k) {
      std::vector<uint32_t> key;
      Vec middle{};
      for (const uint32_t n : of[k]) {
        key.push_back(q[n]);
        middle = middle + (1.0 / double(of[k].size())) * m.at(q[n]);
      }
      std::sort(key.begin(), key.end());
      const auto [at, fresh] = known.insert({key, uint32_t(out.rest.size() / 3)});
      if (fresh) {
        for (const double x : middle) out.rest.push_back(x + norm(m.at(q[1]) - m.at(q[0])) * u(random));
        out.mass.push_back(0);
      }
      out.cells.push_back(at->second);
    }
    for (uint32_t k = 0; k < out.nodes(); ++k) {
      const double twenty = k < 8 ? 7.0 / 248 : 16.0 / 248;
      const double share = kind == DFM_CELL_HEX20 ? twenty
                                                  : (k < 8    ? 1
                                                     : k < 20 ? 4
                                                     : k < 26 ? 16
                                                              : 64) /
                                                        216.0;
      out.mass[out.cells[out.nodes() * size_t(c) + k]] += 1000 * d[0] * d[1] * d[2] * share;
    }
  }
  out.edges = m.edges;
  return out;
}

// Weights of the three Gauss points for integrals over [-1,end] in place of [-1,1], in its length.
inline std::array<double, 3> part_rule(double end) {
  const double g = std::sqrt(0.6), m0 = (end + 1) / 2, m1 = (end * end - 1) / 4,
               m2 = (end * end * end + 1) / 6;
  return {m2 / 1.2 - m1 / (2 * g), m0 - m2 / 0.6, m2 / 1.2 + m1 / (2 * g)};
}

// Every cell is a box of material, from a corner of the cell to somewhere inside it or beyond its borders.
inline Mesh cut_bars() {
  Mesh m = brick_bar(3, 3, 3, {0.1, 0.12, 0.09});
  std::mt19937 random(3);
  std::uniform_real_distribution<double> u(-0.5, 1.6);
  for (uint32_t c = 0; c < m.ncell(); ++c) {
    const std::array<double, 3> x = part_rule(u(random)), y = part_rule(u(random)), z = part_rule(u(random));
    for (uint32_t q = 0; q < 27; ++q) m.inside.push_back(x[q % 3] * y[q / 3 % 3] * z[q / 9]);
  }
  return m;
}

}  // namespace model_test
