// Lattices under closed surfaces: their material is the inside of the surface, whatever the cells, and a bar
// that lies askew to its grid bends as beam theory has it.
#include <deform/plugin.h>

#include <algorithm>
#include <cmath>

#include "statics.h"

namespace {

using Vec = std::array<double, 3>;
using Matrix = std::array<Vec, 3>;

Vec apply(const Matrix &m, const Vec &v) {
  Vec out{};
  for (size_t i = 0; i < 3; ++i)
    for (size_t j = 0; j < 3; ++j) out[i] += m[i][j] * v[j];
  return out;
}

// By the unit quaternion along (1, a, b, c).
Matrix turned(double a, double b, double c) {
  const double n = 1 / std::sqrt(1 + a * a + b * b + c * c), w = n;
  a *= n;
  b *= n;
  c *= n;
  return {{{1 - 2 * (b * b + c * c), 2 * (a * b - w * c), 2 * (a * c + w * b)},
           {2 * (a * b + w * c), 1 - 2 * (a * a + c * c), 2 * (b * c - w * a)},
           {2 * (a * c - w * b), 2 * (b * c + w * a), 1 - 2 * (a * a + b * b)}}};
}
const Matrix kAskew = turned(0.1, 0.23, 0.17);

struct Skin {
  std::vector<double> points;
  std::vector<uint32_t> triangles;
  dfm_mesh_handle mesh = 0;
  Skin(dfm_context *context, const char *kind, std::array<double, 3> size, uint32_t triangles_wanted,
       const Matrix &turn = turned(0, 0, 0)) {
    dfm_mesh_handle straight = 0;
    test::ok(dfm_mesh_make(context, kind, size.data(), DFM_MESH_SURFACE, triangles_wanted, &straight));
    const dfm_mesh_info info = test::info_of(straight);
    const double *const x = info.points;
    const uint32_t *const t = info.faces;
    triangles.assign(t, t + 3 * size_t(info.ntriangle));
    for (uint32_t i = 0; i < info.npoint; ++i)
      for (const double v : apply(turn, {x[3 * i], x[3 * i + 1], x[3 * i + 2]})) points.push_back(v);
    test::ok(dfm_mesh_create(context, info.npoint, points.data(), info.ntriangle, triangles.data(), &mesh));
  }
};

struct Hexahedra {
  dfm_mesh_handle mesh = 0;
  uint32_t n = 0;
  const uint32_t *corners = nullptr;  // [n,8]
  Hexahedra(const Skin &skin, uint32_t cells, double size) {
    test::ok(dfm_mesh_lattice(skin.mesh, cells, size, &mesh));
    const dfm_mesh_info info = test::info_of(mesh);
    n = info.ncell;
    corners = info.cells;
  }
};

// Mass, center and second moments of the inside, density 1000.
struct Solid {
  double mass = 0, inertia = 0;  // about z through the center
  Vec center{};
};
Solid solid_of(const Skin &s) {
  Solid out;
  double square = 0;
  for (size_t t = 0; t < s.triangles.size(); t += 3) {
    const double *p[3];
    for (size_t k = 0; k < 3; ++k) p[k] = &s.points[3 * size_t{s.triangles[t + k]}];
    const double six = p[0][0] * (p[1][1] * p[2][2] - p[1][2] * p[2][1]) +
                       p[0][1] * (p[1][2] * p[2][0] - p[1][0] * p[2][2]) +
                       p[0][2] * (p[1][0] * p[2][1] - p[1][1] * p[2][0]);
    const double m = 1000 * six / 6;
    out.mass += m;
    for (size_t k = 0; k < 3; ++k) {
      const double sum = p[0][k] + p[1][k] + p[2][k];
      out.center[k] += m * sum / 4;
      if (k < 2) square += m * (sum * sum + p[0][k] * p[0][k] + p[1][k] * p[1][k] + p[2][k] * p[2][k]) / 20;
    }
  }
  for (double &x : out.center) x /= out.mass;
  out.inertia = square - out.mass * (out.center[0] * out.center[0] + out.center[1] * out.center[1]);
  return out;
}

struct Body {
  dfm_world world;
  dfm_body body = 0;
  dfm_mesh_handle mesh = 0;
  Body(dfm_context *context, const Skin &skin, uint32_t cells, double size, const char *model,
       double poisson = 0.3, double spin = 0) {
    world = test::make_world(context, {0, 0, 0});
    test::ok(dfm_mesh_lattice(skin.mesh, cells, size, &mesh));
    dfm_body_def d = dfm_body_def_default();
    test::lend(mesh, d);
    const dfm_surface_def surface = {sizeof(dfm_surface_def),
                                     DFM_COUPLING_BARYCENTRIC,
                                     uint32_t(skin.points.size() / 3),
                                     uint32_t(skin.triangles.size() / 3),
                                     skin.points.data(),
                                     skin.triangles.data(),
                                     0};
    d.surface = &surface;
    test::BodyOptions o;
    o.young = 1e5;
    o.poisson = poisson;
    d.material = test::make_material(world, o);
    d.model = model;
    d.spin[2] = spin;
    test::ok(dfm_body_create(world, &d, &body));
  }
  ~Body() { dfm_world_destroy(world); }
  // x = R (X + A X)
  void place(const Matrix &a, const Matrix &turn) {
    dfm_body_info info{};
    info.size = sizeof info;
    test::ok(dfm_body_get_info(body, &info));
    std::vector<double> x(3 * size_t(info.npoint));
    test::ok(dfm_body_get_rest(body, info.npoint, x.data(), 0, nullptr));
    for (uint32_t i = 0; i < info.npoint; ++i) {
      const Vec rest{x[3 * i], x[3 * i + 1], x[3 * i + 2]}, moved = apply(a, rest);
      const Vec at = apply(turn, {rest[0] + moved[0], rest[1] + moved[1], rest[2] + moved[2]});
      std::copy(at.begin(), at.end(), &x[3 * i]);
    }
    test::ok(dfm_body_set_state(body, info.npoint, x.data(), nullptr));
  }
};

constexpr Matrix kStrain = {{{1e-2, 4e-3, 0}, {4e-3, -5e-3, 1e-3}, {0, 1e-3, 7e-3}}};

}  // namespace

TEST(Lattice, MassCenterAndInertia_AreThoseOfTheSurface) {
  test::Context context;
  const Skin ball(context, "ball", {1, 0, 0}, 2000, kAskew), bar(context, "beam", {1, 0.2, 0.1}, 400, kAskew),
      ring(context, "torus", {1, 0.3, 0}, 2000, kAskew);
  for (const Skin *skin : {&ball, &bar, &ring}) {
    const Solid solid = solid_of(*skin);
    for (const uint32_t cells : {8u, 60u, 500u, 4000u}) {
      const Body b(context, *skin, cells, 0, "linear_fem", 0.3, 1.0);
      const dfm_body_measure m = test::measure(b.body);
      EXPECT_NEAR(m.mass, solid.mass, 1e-12 * solid.mass) << cells;
      EXPECT_NEAR(m.rest_volume, solid.mass / 1000, 1e-12 * m.rest_volume);
      EXPECT_NEAR(m.volume, m.rest_volume, 1e-12 * m.volume);
      for (size_t k = 0; k < 3; ++k) EXPECT_NEAR(m.com[k], solid.center[k], 1e-12) << cells;
      // a point keeps a tenth of its mass at least, which is in the way of the moments of coarse ones
      if (cells == 8) continue;
      const double much = cells == 60 ? 0.15 : cells == 500 ? 0.006 : 1e-9;
      EXPECT_NEAR(m.angular[2] / solid.inertia, 1, much) << cells;
    }
  }
}

TEST(Lattice, EnergyOfUniformStrain_IsThatOfTheVolume) {
  test::Context context;
  const Skin bar(context, "beam", {1, 0.2, 0.1}, 400, kAskew), ball(context, "ball", {0.5, 0, 0}, 1000);
  for (const double poisson : {0.0, 0.3, 0.499})
    for (const Skin *skin : {&bar, &ball})
      for (const double size : {0.4, 0.2, 0.1, 0.05}) {
        const double mu = 1e5 / 2 / (1 + poisson), lambda = 1e5 * poisson / (1 + poisson) / (1 - 2 * poisson);
        double square = 0, trace = 0;
        for (size_t i = 0; i < 3; ++i) {
          trace += kStrain[i][i];
          for (size_t j = 0; j < 3; ++j) square += kStrain[i][j] * kStrain[i][j];
        }
        const double exact = solid_of(*skin).mass / 1000 * (mu * square + 0.5 * lambda * trace * trace);
        for (const char *model : {"linear_fem", "corotational_fem"}) {
          Body b(context, *skin, 0, size, model, poisson);
          b.place(kStrain, turned(0, 0, 0));
          EXPECT_NEAR(test::measure(b.body).elastic, exact, 1e-10 * exact) << model << " " << size;
        }
      }
}

TEST(Lattice, RigidRotation_CallsForNoForce) {
  test::Context context;
  const Skin bar(context, "beam", {1, 0.2, 0.1}, 400, kAskew);
  Body b(context, bar, 0, 0.1, "corotational_fem");
  b.place({}, turned(0.3, -2, 0.7));
  EXPECT_LT(test::measure(b.body).elastic, 1e-24 * 1e5);
  b.place(kStrain, turned(0.3, -2, 0.7));
  const double turned_energy = test::measure(b.body).elastic;
  b.place(kStrain, turned(0, 0, 0));
  EXPECT_NEAR(test::measure(b.body).elastic, turned_energy, 1e-12 * turned_energy);
}

namespace {

// Shape functions of the cell at x, or of the nearest one; the cells are boxes along the axes.
void shapes(const std::vector<double> &points, const uint32_t *cells, uint32_t ncell, const Vec &x,
            uint32_t *cell, double *weight) {
  double best = HUGE_VAL;
  for (uint32_t c = 0; c < ncell; ++c) {
    const double *lo = &points[3 * size_t{cells[8 * c]}], *hi = &points[3 * size_t{cells[8 * c + 6]}];
    double away = 0;
    for (size_t k = 0; k < 3; ++k) {
      const double out = std::max({lo[k] - x[k], x[k] - hi[k], 0.0});
      away += out * out;
    }
    if (away >= best) continue;
    best = away;
    *cell = c;
    for (uint32_t a = 0; a < 8; ++a) {
      const bool high[3] = {a % 4 == 1 || a % 4 == 2, a % 4 > 1, a > 3};
      weight[a] = 1;
      for (size_t k = 0; k < 3; ++k) {
        const double t = (x[k] - lo[k]) / (hi[k] - lo[k]);
        weight[a] *= high[k] ? t : 1 - t;
      }
    }
  }
}

constexpr double kSide = 0.1, kMoment = 1e-3;

// Angle by which a bar of 1 x 0.1 x 0.1 m bends under tractions at its ends that are linear across them, over
// the exact one (Timoshenko and Goodier, Theory of Elasticity, 102).
double bent(const char *model, double size, const Matrix &turn) {
  test::Context context;
  const Skin skin(context, "beam", {1, kSide, kSide}, 12, turn);
  const Hexahedra cells(skin, 0, size);
  const std::string path = test::scratch("lattice_bar") + "/bar.vtu";
  test::ok(dfm_mesh_write(cells.mesh, path.c_str()));
  test::Statics s(path, model, 1e5, 0.3);
  const std::vector<double> x = s.rest();
  std::vector<double> force(x.size());
  constexpr int kParts = 40;
  const double area = kSide * kSide / kParts / kParts, inertia = std::pow(kSide, 4) / 12;
  for (const double end : {0.0, 1.0})
    for (int i = 0; i < kParts; ++i)
      for (int j = 0; j < kParts; ++j) {
        const double y = kSide * (i + 0.5) / kParts, z = kSide * (j + 0.5) / kParts;
        const Vec at = apply(turn, {end, y, z});
        const Vec along =
            apply(turn, {(end > 0 ? 1 : -1) * kMoment * (z - kSide / 2) / inertia * area, 0, 0});
        uint32_t cell = 0;
        double weight[8];
        shapes(x, cells.corners, cells.n, at, &cell, weight);
        for (size_t a = 0; a < 8; ++a)
          for (size_t k = 0; k < 3; ++k)
            force[3 * size_t{cells.corners[8 * cell + a]} + k] += weight[a] * along[k];
      }
  // held without reactions: the loads are in balance
  const auto farthest = [&](Vec way) {
    uint32_t best = 0;
    for (uint32_t i = 0; i < s.npoint; ++i) {
      const auto height = [&](size_t n) {
        return way[0] * x[3 * n] + way[1] * x[3 * n + 1] + way[2] * x[3 * n + 2];
      };
      if (height(i) > height(best)) best = i;
    }
    return best;
  };
  s.hold(farthest({-1, 0, 0}), 7);
  s.hold(farthest({1, 0, 0}), 6);
  s.hold(farthest({0.1, 1, 0}), 4);
  for (uint32_t i = 0; i < s.npoint; ++i) s.load(i, &force[3 * i]);
  s.solve();
  const std::vector<double> u = s.displacement();
  double work = 0;
  for (size_t i = 0; i < u.size(); ++i) work += force[i] * u[i];
  return work / (kMoment * kMoment / 1e5 / inertia);
}

}  // namespace

// First-order tetrahedra along the bar: 0.352, 0.746, 0.934 (cells_test.cpp has them).
TEST(Lattice, BarAskewToTheGrid_BendsAsBeamTheoryHasIt) {
  EXPECT_NEAR(bent("linear_fem", 0.1, turned(0, 0, 0)), 1, 0.002);
  const struct { double size, much; } steps[] = {{0.1, 0.05}, {0.05, 0.06}, {0.025, 0.02}};
  for (const auto &[size, much] : steps) EXPECT_NEAR(bent("linear_fem", size, kAskew), 1, much) << size;
  EXPECT_NEAR(bent("corotational_fem", 0.1, kAskew), 1, 0.05);
}

// Cells that share no more than an edge turn about it without a force.
TEST(Lattice, BarThinnerThanACellAndAskew_HasNoHinges) {
  test::Context context;
  for (const Matrix &turn : {turned(0, 0, std::tan(M_PI / 8)), turned(0, std::tan(M_PI / 8), 0), kAskew})
    for (const double size : {0.25, 0.2, 0.15, 0.1, 0.05}) {
      const Skin bar(context, "beam", {1, kSide, kSide}, 12, turn);
      const Hexahedra cells(bar, 0, size);
      const uint32_t *const corners = cells.corners;
      std::vector<uint32_t> piece(cells.n);
      for (uint32_t c = 0; c < cells.n; ++c) piece[c] = c;
      for (uint32_t a = 0; a < cells.n; ++a)
        for (uint32_t b = 0; b < a; ++b) {
          int shared = 0;
          for (int i = 0; i < 8; ++i)
            shared += std::count(corners + 8 * b, corners + 8 * b + 8, corners[8 * a + uint32_t(i)]) > 0;
          if (shared != 4) continue;
          const uint32_t from = piece[a], to = piece[b];
          std::replace(piece.begin(), piece.end(), from, to);
        }
      EXPECT_EQ(std::count(piece.begin(), piece.end(), piece[0]), std::ptrdiff_t(cells.n))
          << size << ", " << cells.n << " cells";
    }
}

TEST(Lattice, ThinAndAskew_GetsTheNearestNumberOfCells) {
  test::Context context;
  const Skin rod(context, "beam", {1, 1e-3, 1e-3}, 12, kAskew);
  for (const uint32_t cells : {20u, 1000u}) EXPECT_GT(Hexahedra(rod, cells, 0).n, 10u) << cells;
}
