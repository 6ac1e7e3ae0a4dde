// Structured bodies with near-isotropic cells and no preferred direction. Coordinates come from + - * / sqrt
// alone, so their bits are the same on every machine.
//
//   beam      body-centered cubic lattice: grid points and cell centers; four cells around each inner grid
//             face (mean ratio 0.95), two on each boundary face with alternating diagonals. All inner points
//             have 14 neighbors.
//   cylinder  rings of 6, 12, 18 .. points (a triangular lattice bent into a disc), extruded; each prism is
//   cut in three by the lattice's
//             three colors, layers mirrored in turn, so that the surface diagonals zigzag and nothing twists.
//   ball      icosahedron around the center, each of its 20 cells cut into n^3 by the tetrahedral-octahedral
//             lattice, layers pushed out to spheres: the surface triangles are nearly equilateral.
#include <algorithm>
#include <array>
#include <cmath>

#include "core/error.h"
#include "deform/plugin.h"
#include "mesh/cells.h"
#include "math/vec3.h"
#include "mesh/generate.h"
#include "mesh/mesh.h"

namespace dfm {

Vec3 unit_on_circle(double angle) {
  const double t = angle * angle;
  double s = 1, c = 1;
  for (int k = 10; k > 0; --k) {
    s = 1 - t * s / ((2 * k) * (2 * k + 1));
    c = 1 - t * c / ((2 * k - 1) * (2 * k));
  }
  return {c, angle * s, 0};
}

Vec3 turned_by_sixths(Vec3 u, uint64_t sixths) {
  static const double half = 0.5, root = std::sqrt(3.0) / 2;
  static const double turn[6][2] = {{1, 0},  {half, root},   {-half, root},
                                    {-1, 0}, {-half, -root}, {half, -root}};
  const double c = turn[sixths][0], s = turn[sixths][1];
  return {c * u.x - s * u.y, s * u.x + c * u.y, 0};
}

Vec3 unit_on_circle(uint64_t i, uint64_t n) {
  const uint64_t sextant = 6 * (i % n) / n;
  return turned_by_sixths(unit_on_circle(kSixth * (double(6 * (i % n) - sextant * n) / double(n))), sextant);
}

Vec3 on_annulus(double inner, double outer, uint32_t k, uint32_t rings, uint32_t j, uint32_t n) {
  const double w = double(k) / rings;
  return ((1 - w) * inner + w * outer) * unit_on_circle(2 * uint64_t(j) + k % 2, 2 * uint64_t(n));
}

void check_tube(double inner, double outer, double length) {
  check_size("tube's inner radius", inner);
  check_size("tube's outer radius", outer);
  check_size("tube's length", length);
  if (!(inner < outer))
    fail(DFM_E_ARG, "the tube's inner radius is %g m; expected less than the outer radius, %g m", inner,
         outer);
}

void add_point(RestMesh &mesh, Vec3 p) { mesh.points.insert(mesh.points.end(), {p.x, p.y, p.z}); }
void add_tet(RestMesh &mesh, uint32_t a, uint32_t b, uint32_t c, uint32_t d) {
  uint32_t tet[4] = {a, b, c, d};
  if (tet_volume(mesh.points.data(), tet) < 0) std::swap(tet[2], tet[3]);
  mesh.tets.insert(mesh.tets.end(), tet, tet + 4);
}

RestMesh finished(RestMesh mesh) {
  mesh.tet_group.assign(mesh.ntet(), kNoGroup);
  mesh.file_point.resize(mesh.npoint());
  for (uint32_t i = 0; i < mesh.npoint(); ++i) mesh.file_point[i] = i;
  return mesh;
}

Icosahedron::Icosahedron() {
  const double g = (1 + std::sqrt(5.0)) / 2, length = std::sqrt(1 + g * g);
  uint32_t v = 0, f = 0;
  for (int axis = 0; axis < 3; ++axis)
    for (const double s : {1.0, -1.0})
      for (const double t : {1.0, -1.0}) {
        Vec3 p;
        p[axis] = 0;
        p[(axis + 1) % 3] = s / length;
        p[(axis + 2) % 3] = t * g / length;
        corner[v++] = p;
      }
  for (uint32_t a = 0; a < 12; ++a)
    for (uint32_t b = a + 1; b < 12; ++b)
      for (uint32_t c = b + 1; c < 12; ++c)
        if (near(a, b) && near(a, c) && near(b, c)) face[f++] = {a, b, c};
}

namespace {

// ---- beam -------------------------------------------------------------------------------------------------

struct Grid {
  uint32_t n[3];
  uint32_t slab() const { return (n[1] + 1) * (n[2] + 1) + n[1] * n[2]; }
  uint32_t corner(uint32_t i, uint32_t j, uint32_t k) const { return i * slab() + j * (n[2] + 1) + k; }
  uint32_t center(uint32_t i, uint32_t j, uint32_t k) const {
    return i * slab() + (n[1] + 1) * (n[2] + 1) + j * n[2] + k;
  }
};

// Tries cubes of the size that gives the number of cells, `each` of them a cube, and smaller ones, the number
// of each edge rounded down and up.
Grid choose_grid(const double size[3], uint32_t cells, double each) {
  const double cubes = std::max(1.0, cells / each);
  const double shortest = std::min({size[0], size[1], size[2]});
  double edge = std::cbrt(size[0] * (size[1] * (size[2] / cubes)));
  Best<Grid> best;
  for (int finer = 0; finer == 0 || (finer < 64 && edge > 0.5 * shortest); ++finer, edge *= 0.9)
    for (int up = 0; up < 8; ++up) {
      Grid g{};
      for (int k = 0; k < 3; ++k)
        g.n[k] = uint32_t(std::clamp(std::floor(size[k] / edge) + (up >> k & 1), 1.0, double(kMaxCells)));
      const double count = double(g.n[0]) * g.n[1] * g.n[2];
      const double h[3] = {size[0] / g.n[0], size[1] / g.n[1], size[2] / g.n[2]};
      if (count > kMaxCells / each) continue;
      best.offer(choice_score(std::max({h[0], h[1], h[2]}) / std::min({h[0], h[1], h[2]}), count, cubes), g);
    }
  const uint32_t *const n = best.choice.n;
  check_choice("beam", best.score < HUGE_VAL ? each * n[0] * n[1] * n[2] : HUGE_VAL, cells);
  return best.choice;
}

// ---- ball -------------------------------------------------------------------------------------------------

class BallBuilder {
 public:
  BallBuilder(RestMesh &mesh, double radius, uint32_t n) : mesh_(mesh), radius_(radius), n_(n) {
    number_edges();
    add_point(mesh_, {});
    for (uint32_t k = 1; k <= n_; ++k) add_layer(k);
    for (uint32_t f = 0; f < 20; ++f) cut_cone(f);
  }

 private:
  // weights of the center and of the face's three corners; they sum to n
  using Lattice = std::array<uint32_t, 4>;

  void number_edges() {
    uint32_t e = 0;
    for (uint32_t a = 0; a < 12; ++a)
      for (uint32_t b = a + 1; b < 12; ++b)
        if (ico_.near(a, b)) {
          edge_[a][b] = e;
          ends_[e++] = {a, b};
        }
  }

  uint32_t first_of_layer(uint32_t k) const {  // 1 center and 10 q^2 + 2 points in each layer q < k
    return 1 + 2 * (k - 1) + 10 * ((k - 1) * k * (2 * k - 1) / 6);
  }

  void add_on_sphere(uint32_t k, Vec3 direction) {
    add_point(mesh_, (radius_ * (double(k) / n_)) * normalized(direction));
  }

  // Corners, then points inside edges, then points inside faces.
  void add_layer(uint32_t k) {
    for (const Vec3 &p : ico_.corner) add_on_sphere(k, p);
    for (const auto &[a, b] : ends_)
      for (uint32_t t = 1; t < k; ++t)
        add_on_sphere(k, double(k - t) * ico_.corner[a] + double(t) * ico_.corner[b]);
    for (const auto &[a, b, c] : ico_.face)
      for (uint32_t i = 1; i + 1 < k; ++i)
        for (uint32_t j = 1; i + j < k; ++j)
          add_on_sphere(k, double(k - i - j) * ico_.corner[a] +
                               (double(i) * ico_.corner[b] + double(j) * ico_.corner[c]));
  }

  uint32_t point(uint32_t f, const Lattice &w) const {
    const uint32_t k = n_ - w[0], i = w[2], j = w[3];
    if (k == 0) return 0;
    const auto &[a, b, c] = ico_.face[f];
    const uint32_t first = first_of_layer(k), inner = first + 12 + 30 * (k - 1);
    if (w[1] == k) return first + a;
    if (i == k) return first + b;
    if (j == k) return first + c;
    if (j == 0) return first + 12 + edge_[a][b] * (k - 1) + i - 1;
    if (i == 0) return first + 12 + edge_[a][c] * (k - 1) + j - 1;
    if (w[1] == 0) return first + 12 + edge_[b][c] * (k - 1) + j - 1;
    const uint32_t per_face = (k - 1) * (k - 2) / 2;
    return inner + f * per_face + (i - 1) * (k - 1) - i * (i - 1) / 2 + j - 1;
  }

  void cut_cone(uint32_t f) {
    for (uint32_t missing = 1; missing <= 3 && missing <= n_; ++missing)
      for (uint32_t w = 0; w <= n_ - missing; ++w)
        for (uint32_t a = 0; a + w <= n_ - missing; ++a)
          for (uint32_t b = 0; a + b + w <= n_ - missing; ++b) {
            const Lattice base{w, a, b, n_ - missing - w - a - b};
            if (missing == 2) cut_octahedron(f, base);
            else add_lattice_tet(f, base, missing);
          }
  }

  // missing 1: base + one each; missing 3: base + all but one each.
  void add_lattice_tet(uint32_t f, const Lattice &base, uint32_t missing) {
    uint32_t p[4];
    for (uint32_t k = 0; k < 4; ++k) {
      Lattice w = base;
      for (uint32_t q = 0; q < 4; ++q) w[q] += (q == k) == (missing == 1);
      p[k] = point(f, w);
    }
    add_tet(mesh_, p[0], p[1], p[2], p[3]);
  }

  // Four cells around the shortest diagonal; for equal lengths the choice alternates with the position, so
  // that none is preferred.
  void cut_octahedron(uint32_t f, const Lattice &base) {
    // base + two is opposite base + the others
    static constexpr uint32_t kPair[3][4] = {{0, 1, 2, 3}, {0, 2, 1, 3}, {0, 3, 1, 2}};
    uint32_t p[3][2];
    double length[3];
    for (int d = 0; d < 3; ++d) {
      for (int end = 0; end < 2; ++end) {
        Lattice w = base;
        ++w[kPair[d][2 * end]];
        ++w[kPair[d][2 * end + 1]];
        p[d][end] = point(f, w);
      }
      length[d] =
          norm2(load3(&mesh_.points[3 * size_t(p[d][0])]) - load3(&mesh_.points[3 * size_t(p[d][1])]));
    }
    uint32_t best = (base[1] + 2 * base[2] + base[0]) % 3;
    for (uint32_t d = 0; d < 3; ++d)
      if (length[d] < length[best] * (1 - 1e-9)) best = d;
    const uint32_t *axis = p[best], *u = p[(best + 1) % 3], *v = p[(best + 2) % 3];
    add_tet(mesh_, axis[0], axis[1], u[0], v[0]);
    add_tet(mesh_, axis[0], axis[1], v[0], u[1]);
    add_tet(mesh_, axis[0], axis[1], u[1], v[1]);
    add_tet(mesh_, axis[0], axis[1], v[1], u[0]);
  }

  RestMesh &mesh_;
  double radius_;
  uint32_t n_;
  const Icosahedron ico_;
  uint32_t edge_[12][12] = {};
  std::array<std::array<uint32_t, 2>, 30> ends_{};
};

// ---- cylinder ---------------------------------------------------------------------------------------------

struct Disc {  // triangular lattice in rings
  uint32_t n;
  uint32_t npoint() const { return 1 + 3 * n * (n + 1); }
  static uint32_t point(uint32_t ring, uint32_t j) {
    return ring == 0 ? 0 : 1 + 3 * ring * (ring - 1) + j % (6 * ring);
  }
};

// Tries every number of rings, with the layers that give the number of cells, with those that give near-equal
// edges, and with the nearest to the first that keep edges within 2:1.
std::array<uint32_t, 2> choose_rings(double radius, double length, uint32_t cells) {
  Best<std::array<uint32_t, 2>> best{{1, 1}};
  for (uint32_t n = 1; n == 1 || 18.0 * n * n <= std::max(4.0 * cells, 2e5); ++n) {
    const double requested = cells / (18.0 * n * n), even = length * n / radius;
    for (const double wanted : {requested, even, std::clamp(requested, even / 2, 2 * even)}) {
      if (wanted > kMaxCells / (18.0 * n * n)) continue;
      const uint32_t m = rounded(wanted);
      best.offer(choice_score(apart(length / m, radius / n), 18.0 * n * n * m, cells), {n, m});
    }
  }
  const auto [n, m] = best.choice;
  check_choice("cylinder", best.score < HUGE_VAL ? 18.0 * n * n * m : HUGE_VAL, cells);
  return best.choice;
}

}  // namespace

RestMesh make_beam(const Memory &memory, double x, double y, double z, uint32_t cells) {
  check_beam(x, y, z);
  check_cells(cells);
  const double size[3] = {x, y, z};
  const Grid g = choose_grid(size, cells, 12);
  RestMesh mesh(memory);
  const auto at = [&](double i, double j, double k) {
    add_point(mesh, {x * (i / g.n[0]), y * (j / g.n[1]), z * (k / g.n[2])});
  };
  for (uint32_t i = 0; i <= g.n[0]; ++i) {
    for (uint32_t j = 0; j <= g.n[1]; ++j)
      for (uint32_t k = 0; k <= g.n[2]; ++k) at(i, j, k);
    for (uint32_t j = 0; i < g.n[0] && j < g.n[1]; ++j)
      for (uint32_t k = 0; k < g.n[2]; ++k) at(i + 0.5, j + 0.5, k + 0.5);
  }
  // One face of cube c across `axis`, on its low or high side: shared with the next cube, or on the boundary.
  const auto add_face = [&](const uint32_t c[3], int axis, uint32_t high) {
    uint32_t corner[4], even = 0;
    for (uint32_t q = 0; q < 4; ++q) {
      uint32_t p[3] = {c[0], c[1], c[2]};
      p[axis] += high;
      p[(axis + 1) % 3] += q == 1 || q == 2;
      p[(axis + 2) % 3] += q >= 2;
      corner[q] = g.corner(p[0], p[1], p[2]);
      if (q == 0) even = (p[0] + p[1] + p[2]) % 2;  // the diagonal starts at an even corner
    }
    const uint32_t center = g.center(c[0], c[1], c[2]);
    if (!high || c[axis] + 1 == g.n[axis]) {
      add_tet(mesh, corner[even], corner[even + 1], corner[even + 2], center);
      add_tet(mesh, corner[even], corner[even + 2], corner[(even + 3) % 4], center);
      return;
    }
    uint32_t next[3] = {c[0], c[1], c[2]};
    ++next[axis];
    for (uint32_t q = 0; q < 4; ++q)
      add_tet(mesh, corner[q], corner[(q + 1) % 4], center, g.center(next[0], next[1], next[2]));
  };
  uint32_t c[3];
  for (c[0] = 0; c[0] < g.n[0]; ++c[0])
    for (c[1] = 0; c[1] < g.n[1]; ++c[1])
      for (c[2] = 0; c[2] < g.n[2]; ++c[2])
        for (int axis = 0; axis < 3; ++axis) {
          if (c[axis] == 0) add_face(c, axis, 0);
          add_face(c, axis, 1);
        }
  return finished(std::move(mesh));
}

RestMesh make_bricks(const Memory &memory, double x, double y, double z, uint32_t cells) {
  check_beam(x, y, z);
  check_cells(cells);
  const double size[3] = {x, y, z};
  const Grid g = choose_grid(size, cells, 1);
  const CellKind &kind = cell_kind(DFM_CELL_HEX8);
  RestMesh mesh(memory);
  mesh.cell = kind.kind;
  for (uint32_t i = 0; i <= g.n[0]; ++i)
    for (uint32_t j = 0; j <= g.n[1]; ++j)
      for (uint32_t k = 0; k <= g.n[2]; ++k)
        add_point(mesh, {x * i / g.n[0], y * j / g.n[1], z * k / g.n[2]});
  const auto at = [&](uint32_t i, uint32_t j, uint32_t k) {
    return (i * (g.n[1] + 1) + j) * (g.n[2] + 1) + k;
  };
  for (uint32_t i = 0; i < g.n[0]; ++i)
    for (uint32_t j = 0; j < g.n[1]; ++j)
      for (uint32_t k = 0; k < g.n[2]; ++k)
        for (const uint32_t up : {k, k + 1})
          for (const uint32_t p : {at(i, j, up), at(i + 1, j, up), at(i + 1, j + 1, up), at(i, j + 1, up)})
            mesh.cells.push_back(p);
  mesh.tets = tets_of(memory, kind, mesh.cells);
  return finished(std::move(mesh));
}

RestMesh make_cylinder(const Memory &memory, double radius, double length, uint32_t cells) {
  check_cylinder(radius, length);
  check_cells(cells);
  const auto [n, m] = choose_rings(radius, length, cells);
  const Disc disc{n};
  RestMesh mesh(memory);
  // The disc: points, and their colors in the triangular lattice (axial coordinates of hexagon directions,
  // difference modulo 3).
  static constexpr int kAxial[7][2] = {{1, 0}, {0, 1}, {-1, 1}, {-1, 0}, {0, -1}, {1, -1}, {1, 0}};
  std::vector<Vec3> flat{{}};
  std::vector<int> color{0};
  for (int k = 1; k <= int(n); ++k)
    for (int s = 0; s < 6; ++s)
      for (int t = 0; t < k; ++t) {
        const Vec3 u = (radius * (double(k) / n)) * unit_on_circle(kSixth * (double(t) / k));
        flat.push_back(turned_by_sixths(u, uint64_t(s)));
        const int q = (k - t) * kAxial[s][0] + t * kAxial[s + 1][0];
        const int r = (k - t) * kAxial[s][1] + t * kAxial[s + 1][1];
        color.push_back(((q - r) % 3 + 3) % 3);
      }
  for (uint32_t layer = 0; layer <= m; ++layer)
    for (const Vec3 &p : flat) add_point(mesh, {p.x, p.y, length * (double(layer) / m)});
  const auto prism = [&](uint32_t layer, std::array<uint32_t, 3> v) {
    add_prism(mesh, layer, disc.npoint(), v, [&](uint32_t p) { return color[p]; });
  };
  for (uint32_t layer = 0; layer < m; ++layer)
    for (uint32_t k = 1; k <= n; ++k)
      for (uint32_t s = 0; s < 6; ++s)
        for (uint32_t t = 0; t < k; ++t) {
          const uint32_t outer = s * k + t, inner = s * (k - 1) + t;
          prism(layer, {Disc::point(k - 1, inner), Disc::point(k, outer), Disc::point(k, outer + 1)});
          if (t + 1 < k)
            prism(layer,
                  {Disc::point(k - 1, inner), Disc::point(k, outer + 1), Disc::point(k - 1, inner + 1)});
        }
  return finished(std::move(mesh));
}

RestMesh make_ball(const Memory &memory, double radius, uint32_t cells) {
  check_size("ball's radius", radius);
  check_cells(cells);
  uint32_t n = 1;
  while (apart(20.0 * (n + 1) * (n + 1) * (n + 1), cells) < apart(20.0 * n * n * n, cells)) ++n;
  RestMesh mesh(memory);
  BallBuilder(mesh, radius, n);
  return finished(std::move(mesh));
}

}  // namespace dfm
