// A coarse regular grid of hexahedra under a closed surface, and what of each of them is material.
//
// Integrals. Let F be the antiderivative in x of f, zero at the low face of a cell. By the divergence theorem
// the integral of f over the material of the cell is the sum of F n_x dA over the triangles in the cell, plus
// F at its high face times n_x dA of those in the cells beyond that face, since the surface is closed.
// Triangles are clipped to the cells, and F n_x, of degree 7 at most, is integrated exactly. So the mass of a
// lattice, its moments up to the second, and its energy are those of the inside of the surface to rounding.
//
// Cells with little material. Far corners of such a cell have next to no stiffness. So a cell with less than
// kMinPart of the material of its fullest neighbor is left out, and its material moves with that neighbor,
// whose shape functions go on beyond its borders (S. Badia, F. Verdugo, A. F. Martin, The aggregated unfitted
// finite element method for elliptic problems, Comput. Methods Appl. Mech. Engng 336, 2018). A larger part
// makes bars askew to the grid too soft, a smaller one too stiff: one to four cells across, in eight
// directions, they bend by 0.90 to 1.34 of the exact angle with 0.25, 0.82 to 1.05 with 0.15, 0.73 to 1.02
// with 0.1 (tests/analytic/lattice_test.cpp has one of them).
//
// Hinges. Cells that share no more than an edge or a corner turn about it without a force. Where those that
// are left out would leave such a place, they are kept.
#include <algorithm>
#include <cmath>
#include <vector>

#include "core/disjoint_sets.h"
#include "core/error.h"
#include "core/lists.h"
#include "deform/plugin.h"
#include "math/extent.h"
#include "mesh/cells.h"
#include "mesh/mesh.h"

namespace dfm {
namespace {

constexpr uint32_t kMaxCells = 1'000'000;
constexpr uint64_t kBytesPerCell = 600;
constexpr double kMinPart = 0.15;
constexpr double kNothing = 1e-12;  // of a cell, by rounding
constexpr double kTwice = 1e-6;     // beyond a whole cell: the surface crosses itself
constexpr int kTries = 10;
constexpr double kFarOff = 0.25;  // number of cells beside the wanted one

struct Grid {
  double lo[3], hi[3], edge[3];
  uint32_t n[3];
  size_t size() const { return size_t(n[0]) * n[1] * n[2]; }
  size_t number(uint32_t i, uint32_t j, uint32_t k) const { return (size_t(i) * n[1] + j) * n[2] + k; }
  void place(size_t cell, uint32_t out[3]) const {
    out[2] = uint32_t(cell % n[2]);
    out[1] = uint32_t(cell / n[2] % n[1]);
    out[0] = uint32_t(cell / n[2] / n[1]);
  }
};

// Integrals over the material of a cell of xi^a eta^b zeta^c, [a + 3 b + 9 c].
struct Moments { double m[27] = {}; };
struct Flux { double m[9] = {}; };  // sum of eta^b zeta^c n_x dA over the triangles in a cell

// ---- triangles --------------------------------------------------------------------------------------------

struct Polygon {
  double x[10][3];  // a triangle, cut by six planes
  int n = 0;
  void add(const double *p) { std::copy_n(p, 3, x[n++]); }
};

// The part where the coordinate is at least (side 1) or at most (side -1) at.
Polygon cut(const Polygon &in, int axis, double at, double side) {
  Polygon out;
  for (int k = 0; k < in.n; ++k) {
    const double *const p = in.x[k], *const q = in.x[(k + 1) % in.n];
    const double from = side * (p[axis] - at), to = side * (q[axis] - at);
    if (from >= 0) out.add(p);
    if ((from > 0 && to < 0) || (from < 0 && to > 0)) {
      double between[3];
      const double t = from / (from - to);
      for (int c = 0; c < 3; ++c) between[c] = p[c] + t * (q[c] - p[c]);
      between[axis] = at;
      out.add(between);
    }
  }
  return out;
}

class Integrals {
 public:
  Array<Moments> moments;

  Integrals(const Memory &memory, const Grid &grid)
      : moments(grid.size(), Moments{}, memory), grid_(grid), flux_(grid.size(), Flux{}, memory) {}

  void run(const RestMesh &surface) {
    for (size_t t = 0; t < surface.tris.size(); t += 3) {
      Polygon p;
      for (size_t k = 0; k < 3; ++k) {
        double x[3];
        for (size_t c = 0; c < 3; ++c)
          x[c] = (surface.points[3 * size_t{surface.tris[t + k]} + c] - grid_.lo[c]) / grid_.edge[c];
        p.add(x);
      }
      uint32_t cell[3];
      divide(p, 0, cell);
    }
    constexpr double kWhole[3] = {2, 0, 2.0 / 3};  // F at the high face
    for (uint32_t j = 0; j < grid_.n[1]; ++j)
      for (uint32_t k = 0; k < grid_.n[2]; ++k) {
        Flux beyond;
        for (uint32_t i = grid_.n[0]; i-- > 0;) {
          const size_t cell = grid_.number(i, j, k);
          for (int n = 0; n < 27; ++n) moments[cell].m[n] += kWhole[n % 3] * beyond.m[n / 3];
          for (int n = 0; n < 9; ++n) beyond.m[n] += flux_[cell].m[n];
        }
      }
  }

 private:
  const Grid &grid_;
  Array<Flux> flux_;

  // In units of cells; what lies in a plane between two cells is in one of them.
  void divide(const Polygon &p, int axis, uint32_t *cell) {
    if (p.n < 3) return;
    if (axis == 3) return add(p, cell);
    double lo = p.x[0][axis], hi = lo;
    for (int k = 1; k < p.n; ++k) {
      lo = std::min(lo, p.x[k][axis]);
      hi = std::max(hi, p.x[k][axis]);
    }
    const double last = grid_.n[axis] - 1.0;
    const auto first = uint32_t(std::clamp(std::floor(lo), 0.0, last));
    const auto end = uint32_t(std::clamp(std::ceil(hi) - 1, double(first), last));
    for (uint32_t i = first; i <= end; ++i) {
      cell[axis] = i;
      const Polygon above = i > first ? cut(p, axis, i, 1) : p;
      divide(i < end ? cut(above, axis, i + 1.0, -1) : above, axis + 1, cell);
    }
  }

  void add(const Polygon &p, const uint32_t *at) {
    // points and weights of Gauss's rule on [0,1], degree 9
    constexpr double kPlace[5] = {0.046910077030668004, 0.23076534494715845, 0.5, 0.76923465505284155,
                                  0.95308992296933200},
                     kWeight[5] = {0.11846344252809454, 0.23931433524968324, 0.28444444444444444,
                                   0.23931433524968324, 0.11846344252809454};
    const size_t cell = grid_.number(at[0], at[1], at[2]);
    double x[10][3];
    for (int k = 0; k < p.n; ++k)
      for (int c = 0; c < 3; ++c) x[k][c] = 2 * (p.x[k][c] - at[c]) - 1;
    for (int k = 1; k + 1 < p.n; ++k) {
      double u[3], v[3];
      for (int c = 0; c < 3; ++c) {
        u[c] = x[k][c] - x[0][c];
        v[c] = x[k + 1][c] - x[0][c];
      }
      const double twice = u[1] * v[2] - u[2] * v[1];  // n_x dA
      if (twice == 0) continue;
      for (int i = 0; i < 5; ++i)
        for (int j = 0; j < 5; ++j) {
          double y[3];
          for (int c = 0; c < 3; ++c)
            y[c] = x[0][c] + kPlace[i] * ((1 - kPlace[j]) * u[c] + kPlace[j] * v[c]);
          const double w = kWeight[i] * kWeight[j] * kPlace[i] * twice;
          const double f[3] = {y[0] + 1, 0.5 * (y[0] * y[0] - 1), (y[0] * y[0] * y[0] + 1) / 3};
          const double b[3] = {w, w * y[1], w * y[1] * y[1]}, c[3] = {1, y[2], y[2] * y[2]};
          for (int n = 0; n < 9; ++n) {
            const double g = b[n % 3] * c[n / 3];
            flux_[cell].m[n] += g;
            for (int a = 0; a < 3; ++a) moments[cell].m[3 * n + a] += f[a] * g;
          }
        }
    }
  }
};

// ---- tensor products --------------------------------------------------------------------------------------

// Applies a matrix along each axis.
Moments along_axes(const double (&by)[3][3][3], const Moments &in) {
  Moments now = in;
  for (int axis = 0, step = 1; axis < 3; ++axis, step *= 3) {
    Moments next;
    for (int n = 0; n < 27; ++n) {
      const int own = n / step % 3, base = n - own * step;
      for (int a = 0; a < 3; ++a) next.m[n] += by[axis][own][a] * now.m[base + a * step];
    }
    now = next;
  }
  return now;
}

// The same material in the coordinates of a cell that is so many cells lower along each axis.
Moments moved(const Moments &in, const int (&cells)[3]) {
  double by[3][3][3] = {};
  for (int axis = 0; axis < 3; ++axis) {
    const double s = 2.0 * cells[axis];
    by[axis][0][0] = by[axis][1][1] = by[axis][2][2] = 1;
    by[axis][1][0] = s;
    by[axis][2][0] = s * s;
    by[axis][2][1] = 2 * s;
  }
  return along_axes(by, in);
}

// Weights of the Gauss points, by the polynomials that are 1 at one of three points and 0 at the others.
Moments weights_of(const Moments &in) {
  constexpr double g2 = 0.6, g = 0.77459666924148337704;
  constexpr double kOne[3][3] = {{0, -0.5 / g, 0.5 / g2}, {1, 0, -1 / g2}, {0, 0.5 / g, 0.5 / g2}};
  double by[3][3][3];
  for (auto &axis : by) std::copy_n(&kOne[0][0], 9, &axis[0][0]);
  Moments out = along_axes(by, in);
  for (double &w : out.m) w /= 8;
  return out;
}

// ---- the grid ---------------------------------------------------------------------------------------------

double cells_in(const Extent &box, double size) {
  double all = 1;
  for (int k = 0; k < 3; ++k) all *= std::max(1.0, std::round((box.hi[k] - box.lo[k]) / size));
  return all;
}

Grid grid_of(const Extent &box, double size) {
  Grid g{};
  const double all = cells_in(box, size);
  for (int k = 0; k < 3; ++k) {
    g.lo[k] = box.lo[k];
    g.hi[k] = box.hi[k];
    const double n = std::max(1.0, std::round((g.hi[k] - g.lo[k]) / size));
    g.n[k] = uint32_t(std::min(n, 1.0 * kMaxCells));
    g.edge[k] = (g.hi[k] - g.lo[k]) / n;
  }
  if (all > kMaxCells)
    fail(DFM_E_ARG, "cells of %g m are %.3g in the box of the surface, %g x %g x %g m; at most %u are made",
         size, all, g.hi[0] - g.lo[0], g.hi[1] - g.lo[1], g.hi[2] - g.lo[2], kMaxCells);
  return g;
}

struct Lattice {
  Grid grid{};
  Array<Moments> moments;
  Array<uint32_t> root;  // by cell, the one that it belongs to; UINT32_MAX: it has no material
  uint32_t kept = 0;
  double part(size_t cell) const { return moments[cell].m[0] / 8; }
};

// The neighbor with most material; a cell itself where none has more.
size_t fullest(const Lattice &l, size_t cell, bool faces) {
  uint32_t at[3];
  l.grid.place(cell, at);
  size_t best = cell;
  for (int n = 0; n < 27; ++n) {
    const int step[3] = {n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1};
    uint32_t to[3];
    bool within = !faces || std::abs(step[0]) + std::abs(step[1]) + std::abs(step[2]) == 1;
    for (int k = 0; k < 3; ++k) {
      to[k] = at[k] + uint32_t(step[k]);
      within = within && to[k] < l.grid.n[k];
    }
    if (!within) continue;
    const size_t other = l.grid.number(to[0], to[1], to[2]);
    if (l.part(other) > l.part(best)) best = other;
  }
  return best;
}

// Kept cells that faces join, each with the lowest number of its cells.
class Joined {
 public:
  explicit Joined(const Lattice &l) : l_(l), sets_(Memory::standard(), uint32_t(l.grid.size())) {
    for (size_t c = 0; c < l.grid.size(); ++c)
      if (kept(c)) join_faces(c);
  }
  bool kept(size_t c) const { return l_.root[c] == c; }
  void join_faces(size_t c) {
    uint32_t at[3];
    l_.grid.place(c, at);
    for (int face = 0; face < 6; ++face) {
      uint32_t to[3] = {at[0], at[1], at[2]};
      to[face / 2] += face % 2 ? 1 : UINT32_MAX;
      if (to[face / 2] >= l_.grid.n[face / 2]) continue;
      const size_t other = l_.grid.number(to[0], to[1], to[2]);
      if (kept(other)) sets_.join(uint32_t(c), uint32_t(other));
    }
  }
  // Whether kept cells meet at a corner of this one and are of more than one piece.
  bool at_hinge(size_t c) {
    uint32_t at[3];
    l_.grid.place(c, at);
    for (uint32_t corner = 0; corner < 8; ++corner) {
      uint32_t piece = UINT32_MAX;
      for (uint32_t n = 0; n < 8; ++n) {
        uint32_t to[3];
        bool within = true;
        for (uint32_t k = 0; k < 3; ++k) {
          to[k] = at[k] + (corner >> k & 1) - (n >> k & 1);
          within = within && to[k] < l_.grid.n[k];
        }
        const size_t other = within ? l_.grid.number(to[0], to[1], to[2]) : c;
        if (other == c || !kept(other)) continue;
        const uint32_t of = sets_.root(uint32_t(other));
        if (piece != UINT32_MAX && of != piece) return true;
        piece = of;
      }
    }
    return false;
  }

 private:
  const Lattice &l_;
  DisjointSets sets_;
};

// Keeps cells that were to be left out, those with most material first, until none is left at a hinge.
void keep_hinges(Lattice &l) {
  Joined pieces(l);
  for (bool more = true; more;) {
    std::vector<uint32_t> found;
    for (size_t c = 0; c < l.grid.size(); ++c)
      if (l.root[c] != UINT32_MAX && !pieces.kept(c) && pieces.at_hinge(c)) found.push_back(uint32_t(c));
    std::ranges::sort(found, [&](uint32_t a, uint32_t b) {
      return l.part(a) != l.part(b) ? l.part(a) > l.part(b) : a < b;
    });
    more = false;
    for (const uint32_t c : found) {
      if (!pieces.at_hinge(c)) continue;
      l.root[c] = c;
      ++l.kept;
      pieces.join_faces(c);
      more = true;
    }
  }
}

void give_away(Lattice &l) {
  for (size_t c = 0; c < l.grid.size(); ++c) {
    if (!(l.part(c) > kNothing)) continue;
    l.root[c] = uint32_t(c);
    for (const bool faces : {true, false}) {
      const size_t to = fullest(l, c, faces);
      if (l.root[c] == c && l.part(c) < kMinPart * l.part(to)) l.root[c] = uint32_t(to);
    }
    l.kept += l.root[c] == c;
  }
  keep_hinges(l);
  // each step leads to a fuller cell
  for (size_t c = 0; c < l.grid.size(); ++c)
    while (l.root[c] != UINT32_MAX && l.root[l.root[c]] != l.root[c]) l.root[c] = l.root[l.root[c]];
  for (size_t c = 0; c < l.grid.size(); ++c) {
    const uint32_t root = l.root[c];
    if (root == UINT32_MAX || root == c) continue;
    uint32_t from[3], to[3];
    l.grid.place(c, from);
    l.grid.place(root, to);
    const Moments add =
        moved(l.moments[c], {int(from[0] - to[0]), int(from[1] - to[1]), int(from[2] - to[2])});
    for (int n = 0; n < 27; ++n) l.moments[root].m[n] += add.m[n];
  }
}

Lattice lay(const RestMesh &surface, const Grid &grid) {
  need_memory(kBytesPerCell * grid.size(), format("a lattice of %zu cells", grid.size()).c_str());
  Integrals of(*surface.memory, grid);
  of.run(surface);
  Lattice out{grid, std::move(of.moments), Array<uint32_t>(grid.size(), UINT32_MAX, *surface.memory)};
  for (size_t c = 0; c < grid.size(); ++c)
    if (!(out.part(c) > -kTwice && out.part(c) < 1 + kTwice))
      fail(DFM_E_FORMAT,
           "the surface crosses itself or faces inward in part: a cell of the lattice would be filled %.3g "
           "times; mesh it again, or let \"fill\" fill it, which counts what is enclosed twice once",
           out.part(c));
  give_away(out);
  if (!out.kept)
    fail(DFM_E_FORMAT,
         "the surface encloses less than %g of every cell of the lattice: ask for smaller cells, or make "
         "lattices of parts that lie far apart one by one",
         kNothing);
  return out;
}

// The size that gives the nearest number of cells.
Lattice seek(const RestMesh &surface, const Extent &box, double volume, uint32_t cells) {
  Lattice best;
  // a tiny surface has no volume in numbers
  double size = std::max(std::cbrt(volume / cells), box.longest() / kMaxCells), apart = HUGE_VAL;
  uint32_t before[3] = {};
  for (int tries = 0; tries < kTries && apart > 0; ++tries) {
    // of a thin shape that lies askew most of the box is empty
    while (cells_in(box, size) > kMaxCells) size *= 1.1;
    const Grid grid = grid_of(box, std::min(size, box.longest()));
    if (std::equal(grid.n, grid.n + 3, before)) break;
    std::copy_n(grid.n, 3, before);
    Lattice now = lay(surface, grid);
    const double ratio = double(now.kept) / cells, off = std::fabs(std::log(ratio));
    size *= std::cbrt(ratio);
    if (!(off < apart)) continue;
    apart = off;
    best = std::move(now);
  }
  return best;
}

void refuse_unfit(const RestMesh &surface, const Extent &box, uint32_t cells, double size) {
  if ((cells != 0) == (size != 0) || !(size >= 0 && size < HUGE_VAL) || cells > kMaxCells)
    fail(DFM_E_ARG,
         "a lattice has either a number of cells, 1 to %u, or their size in m, above 0; found %u and %g",
         kMaxCells, cells, size);
  const dfm_mesh_info s = mesh_statistics(surface);
  if (!s.closed)
    fail(DFM_E_FORMAT,
         "the surface is open: %u edges have one triangle, %u more than two; a lattice needs a closed one: "
         "close it, or let \"fill\" fill it, which closes small holes",
         s.open_edges, s.nonmanifold_edges);
  if (!(s.volume > 0))
    fail(DFM_E_FORMAT,
         "the surface encloses %g m3; it should enclose a volume, its triangles "
         "counter-clockwise from outside",
         s.volume);
  if (size > box.longest())
    fail(DFM_E_ARG, "cells of %g m are larger than the surface, whose box is %g x %g x %g m", size,
         box.hi[0] - box.lo[0], box.hi[1] - box.lo[1], box.hi[2] - box.lo[2]);
}

}  // namespace

RestMesh make_lattice(const RestMesh &surface, uint32_t cells, double size) {
  const Memory &memory = *surface.memory;
  Extent box;
  for (const uint32_t p : surface.tris) box.add(load3(&surface.points[3 * size_t{p}]));
  refuse_unfit(surface, box, cells, size);
  const Lattice l =
      cells ? seek(surface, box, mesh_statistics(surface).volume, cells) : lay(surface, grid_of(box, size));
  constexpr uint32_t kCorner[8][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0},
                                      {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};
  const Grid &g = l.grid;
  RestMesh out(memory);
  Array<uint64_t> corners{memory};
  for (size_t c = 0; c < g.size(); ++c) {
    if (l.root[c] != c) continue;
    uint32_t at[3];
    g.place(c, at);
    for (const auto &k : kCorner)
      corners.push_back((uint64_t(at[0] + k[0]) * (g.n[1] + 1) + at[1] + k[1]) * (g.n[2] + 1) + at[2] + k[2]);
    const Moments inside = weights_of(l.moments[c]);
    out.inside.insert(out.inside.end(), inside.m, inside.m + kInsidePoints);
  }
  Array<uint64_t> sites = corners;
  sort_unique(sites);
  for (const uint64_t s : sites) {
    const uint64_t at[3] = {s / (g.n[2] + 1) / (g.n[1] + 1), s / (g.n[2] + 1) % (g.n[1] + 1),
                            s % (g.n[2] + 1)};
    for (int k = 0; k < 3; ++k)
      out.points.push_back(at[k] == g.n[k] ? g.hi[k] : g.lo[k] + g.edge[k] * double(at[k]));
    out.file_point.push_back(uint32_t(out.file_point.size()));
  }
  for (const uint64_t c : corners)
    out.cells.push_back(uint32_t(std::lower_bound(sites.begin(), sites.end(), c) - sites.begin()));
  const CellKind &kind = cell_kind(DFM_CELL_HEX8);
  out.cell = kind.kind;
  out.tets = tets_of(memory, kind, out.cells);
  out.tet_group.assign(out.ntet(), kNoGroup);
  if (cells && std::fabs(double(l.kept) - cells) > kFarOff * cells)
    out.warnings.push_back(format(
        "%u cells instead of %u: this is the nearest number that a grid over the box of this surface gives",
        l.kept, cells));
  return out;
}

}  // namespace dfm
