// Solids of second-order tetrahedra or of hexahedra of 8, 20 or 27 points whose bricks are maps of the unit
// cube, with consistent loads, in static equilibrium.
#pragma once
#include <deform/plugin.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <functional>
#include <map>

#include "statics.h"
#include "vec.h"

namespace test {

using Counts = std::array<uint32_t, 3>;
constexpr uint32_t kTet10 = DFM_CELL_TET10, kHex8 = DFM_CELL_HEX8, kHex20 = DFM_CELL_HEX20,
                   kHex27 = DFM_CELL_HEX27;
struct CellKind {
  const char *name;
  size_t nodes;
  int vtk;
};
inline const CellKind &cells_of(uint32_t kind) {
  static const std::map<uint32_t, CellKind> all = {{kTet10, {"second-order tetrahedra", 10, 24}},
                                                   {kHex8, {"hexahedra", 8, 12}},
                                                   {kHex20, {"hexahedra of 20 points", 20, 25}},
                                                   {kHex27, {"hexahedra of 27 points", 27, 29}}};
  return all.at(kind);
}

constexpr size_t kTetEdge[6][2] = {{0, 1}, {1, 2}, {0, 2}, {0, 3}, {1, 3}, {2, 3}};
// between two corners; a face or the whole between two that are opposite
constexpr size_t kHexMiddle[19][2] = {{0, 1}, {1, 2}, {2, 3}, {3, 0}, {4, 5}, {5, 6}, {6, 7},
                                      {7, 4}, {0, 4}, {1, 5}, {2, 6}, {3, 7}, {0, 7}, {1, 6},
                                      {0, 5}, {3, 6}, {0, 2}, {4, 6}, {0, 6}};
// Place of a node in the cell's own coordinates: 0 to 1 of a tetrahedron, -1 to 1 of a hexahedron.
inline Vec node_place(uint32_t kind, size_t k) {
  const size_t corners = kind == kTet10 ? 4 : 8;
  if (k >= corners) {
    const size_t (&ends)[2] = kind == kTet10 ? kTetEdge[k - 4] : kHexMiddle[k - 8];
    const Vec a = node_place(kind, ends[0]), b = node_place(kind, ends[1]);
    return {0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1]), 0.5 * (a[2] + b[2])};
  }
  if (kind != kTet10)
    return {k % 4 == 1 || k % 4 == 2 ? 1.0 : -1.0, k % 4 >= 2 ? 1.0 : -1.0, k >= 4 ? 1.0 : -1.0};
  Vec x{};
  if (k > 0) x[k - 1] = 1;
  return x;
}

// Shape functions of a cell at a point in its own coordinates, with its place, Jacobian and their gradients.
struct Shape {
  double n[27] = {}, local[27][3] = {}, g[27][3] = {};  // g 1/m
  double jacobian = 0;                                  // m3
  Vec at{};                                             // m

  Shape(uint32_t kind, const Vec &q, const double *points, const uint32_t *cell) {
    const size_t nodes = cells_of(kind).nodes;
    kind == kTet10 ? tetrahedron(q) : hexahedron(kind, q);
    Vec j[3] = {};  // rows by the cell's coordinates
    for (size_t a = 0; a < nodes; ++a)
      for (size_t r = 0; r < 3; ++r) {
        at[r] += n[a] * points[3 * size_t(cell[a]) + r];
        for (size_t c = 0; c < 3; ++c) j[c][r] += points[3 * size_t(cell[a]) + r] * local[a][c];
      }
    jacobian = dot(j[0], cross(j[1], j[2]));
    for (size_t c = 0; c < 3; ++c) {
      const Vec inverse = cross(j[(c + 1) % 3], j[(c + 2) % 3]);
      for (size_t a = 0; a < nodes; ++a)
        for (size_t r = 0; r < 3; ++r) g[a][r] += local[a][c] * inverse[r] / jacobian;
    }
  }

 private:
  // Products of functions of one coordinate: linear, quadratic, or, with 20 points, linear at corners, whose
  // product is then multiplied by s.q - 2, and across an edge.
  void hexahedron(uint32_t kind, const Vec &q) {
    for (size_t a = 0; a < cells_of(kind).nodes; ++a) {
      const Vec s = node_place(kind, a);
      double f[3], d[3];
      for (size_t c = 0; c < 3; ++c) {
        const bool linear = kind != kHex27 && s[c] != 0;
        f[c] = s[c] == 0 ? 1 - q[c] * q[c] : 0.5 * (1 + s[c] * q[c]) * (linear ? 1 : s[c] * q[c]);
        d[c] = s[c] == 0 ? -2 * q[c] : linear ? 0.5 * s[c] : q[c] + 0.5 * s[c];
      }
      const double whole = f[0] * f[1] * f[2];
      const bool corner = kind == kHex20 && a < 8;
      const double more = corner ? dot(s, q) - 2 : 1;
      n[a] = whole * more;
      for (size_t c = 0; c < 3; ++c)
        local[a][c] = d[c] * f[(c + 1) % 3] * f[(c + 2) % 3] * more + (corner ? whole * s[c] : 0);
    }
  }
  void tetrahedron(const Vec &q) {
    const double b[4] = {1 - q[0] - q[1] - q[2], q[0], q[1], q[2]};
    const auto slope = [](size_t k, size_t c) { return k == 0 ? -1.0 : double(k == c + 1); };
    for (size_t k = 0; k < 4; ++k) {
      n[k] = b[k] * (2 * b[k] - 1);
      for (size_t c = 0; c < 3; ++c) local[k][c] = (4 * b[k] - 1) * slope(k, c);
    }
    for (size_t k = 4; k < 10; ++k) {
      const auto [i, j] = kTetEdge[k - 4];
      n[k] = 4 * b[i] * b[j];
      for (size_t c = 0; c < 3; ++c) local[k][c] = 4 * (b[i] * slope(j, c) + b[j] * slope(i, c));
    }
  }
};

// Gauss's rule of degree 7 on (0, 1).
constexpr double kGauss[4] = {0.06943184420297371, 0.33000947820757187, 0.66999052179242813,
                              0.93056815579702629};
constexpr double kWeight[4] = {0.17392742256872693, 0.32607257743127307, 0.32607257743127307,
                               0.17392742256872693};

// Cells under a map from the unit cube. Along an axis their borders are at `power` of equal parts, so that
// they are smallest at 0.
struct Brick {
  Counts cells;
  std::function<Vec(double, double, double)> at;
  Vec power = {1, 1, 1};
};

struct Grid {
  uint32_t kind;
  size_t nodes;
  std::vector<double> points;
  std::vector<uint32_t> cells;

  // Bricks that touch share their points.
  Grid(uint32_t kind_of_cells, const std::vector<Brick> &bricks)
      : kind(kind_of_cells), nodes(cells_of(kind_of_cells).nodes) {
    for (const Brick &b : bricks) add(b);
  }
  size_t npoint() const { return points.size() / 3; }
  size_t ncell() const { return cells.size() / nodes; }
  const uint32_t *cell(size_t c) const { return &cells[nodes * c]; }
  Vec point(size_t i) const { return {points[3 * i], points[3 * i + 1], points[3 * i + 2]}; }
  Shape shape(size_t c, const Vec &q) const { return Shape(kind, q, points.data(), cell(c)); }
  uint32_t nearest(const Vec &x) const {
    uint32_t best = 0;
    const auto distance = [&](uint32_t i) { return dot(minus(point(i), x), minus(point(i), x)); };
    for (uint32_t i = 1; i < npoint(); ++i)
      if (distance(i) < distance(best)) best = i;
    return best;
  }
  std::string file() const {
    const std::string path = scratch("mapped_solid") + "/cells.vtk";
    std::ofstream out(path);
    out.precision(17);
    out << "# vtk DataFile Version 3.0\ncells\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS " << npoint()
        << " double\n";
    for (size_t i = 0; i < points.size(); ++i) out << points[i] << (i % 3 == 2 ? '\n' : ' ');
    out << "CELLS " << ncell() << ' ' << ncell() * (nodes + 1) << '\n';
    for (size_t c = 0; c < ncell(); ++c) {
      out << nodes;
      for (size_t a = 0; a < nodes; ++a) out << ' ' << cell(c)[a];
      out << '\n';
    }
    out << "CELL_TYPES " << ncell() << '\n';
    for (size_t c = 0; c < ncell(); ++c) out << cells_of(kind).vtk << '\n';
    return path;
  }

 private:
  std::map<std::array<int64_t, 3>, uint32_t> known_;

  uint32_t add_point(const Brick &b, const std::array<uint32_t, 3> &at) {
    const uint32_t step = kind == kHex8 ? 1 : 2;  // points along the edge of a cell
    double share[3];
    for (size_t a = 0; a < 3; ++a) {
      const auto border = [&](uint32_t n) { return std::pow(double(n) / b.cells[a], b.power[a]); };
      share[a] = 0.5 * (border(at[a] / step) + border((at[a] + step - 1) / step));
    }
    Vec x = b.at(share[0], share[1], share[2]);
    std::array<int64_t, 3> key;
    for (size_t a = 0; a < 3; ++a) {
      if (std::abs(x[a]) < 1e-12) x[a] = 0;
      key[a] = std::llround(x[a] * 1e8);
    }
    const auto [it, fresh] = known_.try_emplace(key, uint32_t(npoint()));
    if (fresh) points.insert(points.end(), x.begin(), x.end());
    return it->second;
  }
  void add(const Brick &b) {
    const Vec o = b.at(0.5, 0.5, 0.5);
    const bool left_handed = dot(minus(b.at(0.51, 0.5, 0.5), o),
                                 cross(minus(b.at(0.5, 0.51, 0.5), o), minus(b.at(0.5, 0.5, 0.51), o))) < 0;
    for (uint32_t i = 0; i < b.cells[0]; ++i)
      for (uint32_t j = 0; j < b.cells[1]; ++j)
        for (uint32_t k = 0; k < b.cells[2]; ++k) {
          if (kind == kTet10) {
            add_tetrahedra(b, {2 * i, 2 * j, 2 * k}, left_handed);
            continue;
          }
          for (size_t a = 0; a < nodes; ++a) {
            const Vec s = node_place(kind, a);
            const double half = kind == kHex8 ? 0.5 : 1;
            const auto along = [&](uint32_t cell, double side) {
              return uint32_t(half * (2 * cell + 1 + side));
            };
            cells.push_back(
                add_point(b, {along(i, s[0]), along(j, s[1]), along(k, left_handed ? -s[2] : s[2])}));
          }
        }
  }
  // six around the diagonal of a hexahedron
  void add_tetrahedra(const Brick &b, const std::array<uint32_t, 3> &low, bool left_handed) {
    int axes[3] = {0, 1, 2};
    do {
      std::array<uint32_t, 3> q[4] = {low};
      for (int s = 0; s < 3; ++s) {
        q[s + 1] = q[s];
        q[s + 1][size_t(axes[s])] += 2;
      }
      const int falls = (axes[0] > axes[1]) + (axes[1] > axes[2]) + (axes[0] > axes[2]);
      if ((falls % 2 == 1) != left_handed) std::swap(q[1], q[2]);
      for (const auto &corner : q) cells.push_back(add_point(b, corner));
      for (const auto &[m, n] : kTetEdge)
        cells.push_back(
            add_point(b, {(q[m][0] + q[n][0]) / 2, (q[m][1] + q[n][1]) / 2, (q[m][2] + q[n][2]) / 2}));
    } while (std::next_permutation(axes, axes + 3));
  }
};

struct MappedSolid : Grid {
  Statics body;
  double lambda, mu;             // Pa
  std::vector<double> loads, u;  // N, m, by points of the grid

  MappedSolid(uint32_t kind_of_cells, const std::vector<Brick> &bricks, double young, double poisson,
              const char *model = "linear_fem")
      : Grid(kind_of_cells, bricks),
        body(file(), model, young, poisson),
        lambda(young * poisson / ((1 + poisson) * (1 - 2 * poisson))),
        mu(young / (2 * (1 + poisson))),
        loads(points.size()) {}

  void hold(const std::function<int(const Vec &)> &axes) {
    for (uint32_t i = 0; i < npoint(); ++i)
      if (const int a = axes(point(i))) body.hold(body.of_node[i], uint8_t(a));
  }
  // Consistent loads of a traction by the outward normal, on the faces all of whose points `on` picks.
  void pull(const std::function<bool(const Vec &)> &on, const std::function<Vec(const Vec &)> &traction) {
    constexpr size_t kTet[4][3] = {{1, 2, 3}, {0, 2, 3}, {0, 1, 3}, {0, 1, 2}};
    constexpr size_t kHex[6][3] = {{0, 1, 3}, {4, 5, 7}, {0, 1, 4}, {3, 2, 7}, {0, 3, 4}, {1, 2, 5}};
    for (size_t c = 0; c < ncell(); ++c)
      for (size_t f = 0; f < (kind == kTet10 ? 4 : 6); ++f) {
        const size_t (&corner)[3] = kind == kTet10 ? kTet[f] : kHex[f];
        const Vec from = node_place(kind, corner[0]), along[2] = {minus(node_place(kind, corner[1]), from),
                                                                  minus(node_place(kind, corner[2]), from)};
        const auto off_face = [&](size_t k) {
          return std::abs(dot(cross(along[0], along[1]), minus(node_place(kind, k), from))) > 1e-9;
        };
        bool all = true;
        for (size_t k = 0; k < nodes; ++k) all = all && (off_face(k) || on(point(cell(c)[k])));
        if (all) pull_face(c, from, along, traction);
      }
  }
  // use(cell, shape, volume) at points of a rule that is exact beyond the needs of the cells.
  template <class Use>
  void each_point(const Use &use) const {
    for (size_t c = 0; c < ncell(); ++c)
      for (size_t s = 0; s < 64; ++s) {
        const double a = kGauss[s % 4], b = kGauss[s / 4 % 4], d = kGauss[s / 16];
        const double weight = kWeight[s % 4] * kWeight[s / 4 % 4] * kWeight[s / 16];
        const bool hex = kind != kTet10;
        const Shape at =
            shape(c, hex ? Vec{2 * a - 1, 2 * b - 1, 2 * d - 1} : Vec{a, (1 - a) * b, (1 - a) * (1 - b) * d});
        use(cell(c), at, at.jacobian * weight * (hex ? 8 : (1 - a) * (1 - a) * (1 - b)));
      }
  }
  // Loads that are as an initial strain, the same in all directions.
  void warm(const std::function<double(const Vec &)> &strain) {
    each_point([&](const uint32_t *of, const Shape &s, double volume) {
      const double stress = (3 * lambda + 2 * mu) * strain(s.at);
      for (size_t k = 0; k < nodes; ++k)
        for (size_t r = 0; r < 3; ++r) loads[3 * size_t(of[k]) + r] += volume * stress * s.g[k][r];
    });
  }
  void solve() {
    uint32_t load = 0;
    ok(dfm_body_add_load(body.body, body.npoint, body.of_node.data(), loads.data(), 0, nullptr, nullptr,
                         &load));
    body.solve();
    ok(dfm_body_remove_load(body.body, load));
    const std::vector<double> moved = body.displacement();
    u.resize(points.size());
    for (size_t i = 0; i < npoint(); ++i)
      for (size_t r = 0; r < 3; ++r) u[3 * i + r] = moved[3 * size_t(body.of_node[i]) + r];
  }
  double displacement(const Vec &where, size_t axis) const { return u[3 * size_t(nearest(where)) + axis]; }
  // Twice the work of the loads; of a uniform unit load the mean displacement along it.
  double work() const {
    double sum = 0;
    for (size_t i = 0; i < u.size(); ++i) sum += loads[i] * u[i];
    return sum;
  }
  double stress(const Vec &where, size_t axis) const {  // normal, along an axis
    std::vector<double> all(6 * size_t(body.npoint));
    ok(dfm_body_point_stress(body.body, body.npoint, all.data()));
    return all[6 * size_t(body.of_node[nearest(where)]) + axis];
  }

 private:
  void pull_face(size_t c, const Vec &from, const Vec (&along)[2],
                 const std::function<Vec(const Vec &)> &traction) {
    for (size_t s = 0; s < 16; ++s) {
      const double a = kGauss[s % 4], b = kGauss[s / 4];
      const bool hex = kind != kTet10;
      const double first = hex ? a : a * (1 - b), second = hex ? b : a * b;
      Vec q;
      for (size_t r = 0; r < 3; ++r) q[r] = from[r] + first * along[0][r] + second * along[1][r];
      const Shape at = shape(c, q);
      Vec edge[2] = {}, middle{};
      for (size_t k = 0; k < nodes; ++k)
        for (size_t r = 0; r < 3; ++r) {
          const double x = points[3 * size_t(cell(c)[k]) + r];
          middle[r] += x / double(nodes);
          for (size_t e = 0; e < 2; ++e)
            for (size_t m = 0; m < 3; ++m) edge[e][r] += x * at.local[k][m] * along[e][m];
        }
      Vec out = cross(edge[0], edge[1]);
      const double area = std::sqrt(dot(out, out)), side = dot(out, minus(at.at, middle)) < 0 ? -area : area;
      for (double &x : out) x /= side;
      const Vec p = traction(out);
      const double weight = kWeight[s % 4] * kWeight[s / 4] * (hex ? 1 : a) * area;
      for (size_t k = 0; k < nodes; ++k)
        for (size_t r = 0; r < 3; ++r) loads[3 * size_t(cell(c)[k]) + r] += weight * at.n[k] * p[r];
    }
  }
};

}  // namespace test
