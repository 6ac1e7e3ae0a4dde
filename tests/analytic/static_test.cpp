// Equilibria against reference/elasticity: nodal fields of linear and corotational tetrahedra,
// values of the benchmarks, patch tests, orders of convergence, locking.
#include <algorithm>
#include <cstdlib>
#include <map>

#include "statics.h"

namespace {

using test::by_node;
using test::mesh_path;
using test::reference;
using test::Statics;

struct Field {
  const char *name, *mesh;
  double young, poisson;
};

TEST(Static, LinearFieldsOfTheReferenceSet_AreReachedTo1em8) {
  for (const Field &f : {Field{"lin_bar_s2_tip", "bars/bar_s2.msh", 1e5, 0.3},
                         {"lin_bar_s2_gravz", "bars/bar_s2.msh", 1e8, 0.3},
                         {"lin_bar_s3_tip", "bars/bar_s3.msh", 1e5, 0.3},
                         {"lin_bar_s3_gravz", "bars/bar_s3.msh", 1e8, 0.3},
                         {"lin_bar_u2_tip", "bars/bar_u2.msh", 1e5, 0.3},
                         {"lin_bar_u2_gravz", "bars/bar_u2.msh", 1e8, 0.3},
                         {"cook3d_1", "bench/cook3d_1.msh", 1, 1.0 / 3},
                         {"cook3d_2", "bench/cook3d_2.msh", 1, 1.0 / 3},
                         {"LE1_1", "bench/LE1_1.msh", 2.1e11, 0.3},
                         {"LE10_1", "bench/LE10_1.msh", 2.1e11, 0.3},
                         {"LE11_1", "bench/LE11_1.msh", 2.1e11, 0.3},
                         {"lame_sphere_1", "bench/lame_sphere_1.msh", 1e5, 0.3},
                         {"lame_cylinder_1", "bench/lame_cylinder_1.msh", 1e5, 0.3},
                         {"twisted_1_Fy", "bench/twisted_1_Fy.msh", 29e6, 0.22},
                         {"twisted_1_Fz", "bench/twisted_1_Fz.msh", 29e6, 0.22}}) {
    Statics s(mesh_path(f.mesh), "linear_fem", f.young, f.poisson);
    s.apply(reference("fields/" + std::string(f.name) + "_bc.csv"));
    s.solve();
    const double error = s.error_of(reference("fields/" + std::string(f.name) + "_u.csv"));
    EXPECT_LT(error, 1e-8) << f.name;
  }
}

// Strain energies of bench_p1.csv, on every mesh that has its loads in the set.
TEST(Static, Benchmarks_HaveTheStrainEnergyOfTheirTable) {
  uint32_t seen = 0;
  for (const auto &row : test::read_csv(reference("tables/bench_p1.csv"))) {
    if (row.size() < 7 || row[5] != "strain_energy") continue;
    const double expected = std::strtod(row[6].c_str(), nullptr);
    Statics s(mesh_path("bench/" + row[0] + ".msh"), "linear_fem", std::strtod(row[3].c_str(), nullptr),
              std::strtod(row[4].c_str(), nullptr));
    s.apply(reference("fields/" + row[0] + "_bc.csv"));
    s.solve();
    EXPECT_NEAR(s.energy() / expected, 1, 1e-8) << row[0];
    ++seen;
  }
  EXPECT_EQ(seen, 17u);
}

TEST(Static, CorotationalFieldsOfTheReferenceSet_AreReachedTo1em6) {
  for (const Field &f : {Field{"cor_bar_s2_E5e+06", "bars/bar_s2.msh", 5e6, 0.3},
                         {"cor_bar_s2_E1.25e+06", "bars/bar_s2.msh", 1.25e6, 0.3},
                         {"cor_slender_E8e+07", "bars/slender.vtk", 8e7, 0.3},
                         {"cor_slender_E2e+07", "bars/slender.vtk", 2e7, 0.3}}) {
    Statics s(mesh_path(f.mesh), "corotational_fem", f.young, f.poisson);
    s.apply(reference("fields/" + std::string(f.name) + "_bc.csv"));
    const dfm_equilibrium_info info = s.solve();
    EXPECT_LT(s.error_of(reference("fields/" + std::string(f.name) + "_u.csv")), 1e-6)
        << f.name << " " << info.iterations;
  }
}

constexpr double kStrain[3][3] = {{1e-3, 3e-4, -2e-4}, {1e-4, -7e-4, 4e-4}, {-5e-4, 2.5e-4, 6e-4}};
constexpr double kTurn[3][3] = {{0.2332880370152467, -0.809761909396947, -0.5383886531822373},
                                {0.26270256283485277, 0.5855611010893226, -0.7668804081283211},
                                {0.9362499961364876, 0.03746794604552878, 0.3493309287102364}};

void times(const double (&m)[3][3], const double *x, double *out) {
  for (size_t r = 0; r < 3; ++r) out[r] = m[r][0] * x[0] + m[r][1] * x[1] + m[r][2] * x[2];
}

// Boundary points follow an affine map; inner points start elsewhere and have to find it.
void patch(const char *model, bool turned) {
  Statics s(mesh_path("bench/patch.vtk"), model, 1e5, 0.3);
  std::vector<uint8_t> inner(s.npoint, 0);
  for (const auto &[node, v] : by_node(reference("tables/patch_nodes.csv")))
    inner[s.of_node[node]] = v[0] != 0;
  const std::vector<double> rest = s.rest();
  std::vector<double> exact(rest.size()), start(rest.size());
  for (size_t i = 0; i < rest.size(); i += 3) {
    double more[3], x[3];
    for (size_t k = 0; k < 3; ++k) {
      more[k] = rest[i + k];
      for (size_t c = 0; c < 3; ++c)
        more[k] += (turned ? 0.5 * (kStrain[k][c] + kStrain[c][k]) : kStrain[k][c]) * rest[i + c];
    }
    if (turned) times(kTurn, more, &exact[i]);
    else std::copy(more, more + 3, &exact[i]);
    if (turned) times(kTurn, &rest[i], x);
    else std::copy(&rest[i], &rest[i] + 3, x);
    std::copy(inner[i / 3] ? x : &exact[i], (inner[i / 3] ? x : &exact[i]) + 3, &start[i]);
  }
  test::ok(dfm_body_set_state(s.body, s.npoint, start.data(), nullptr));
  for (uint32_t i = 0; i < s.npoint; ++i)
    if (!inner[i]) s.hold(i, 7);
  s.solve();
  const std::vector<double> x = s.positions();
  double most = 0;
  for (size_t i = 0; i < x.size(); ++i) most = std::max(most, std::abs(x[i] - exact[i]));
  EXPECT_LT(most, 1e-12) << model;
  // every cell has the energy of the strain: stress is a function of it
  std::vector<double> density;
  dfm_body_info info{};
  info.size = sizeof info;
  test::ok(dfm_body_get_info(s.body, &info));
  density.resize(info.ntet);
  test::ok(dfm_body_energy_density(s.body, info.ntet, density.data()));
  const double lambda = 1e5 * 0.3 / (1.3 * 0.4), mu = 1e5 / 2.6;
  double trace = 0, square = 0;
  for (size_t r = 0; r < 3; ++r)
    for (size_t c = 0; c < 3; ++c) {
      const double e = 0.5 * (kStrain[r][c] + kStrain[c][r]);
      square += e * e;
      trace += r == c ? e : 0;
    }
  for (const double d : density)
    EXPECT_NEAR(d / (0.5 * lambda * trace * trace + mu * square), 1, 1e-9) << model;
  // and its stress, which the picture of the cells has too
  std::vector<double> stress(6 * size_t(info.ntet));
  EXPECT_EQ(dfm_body_stress(s.body, info.ntet - 1, stress.data()), DFM_E_ARG);
  test::ok(dfm_body_stress(s.body, info.ntet, stress.data()));
  if (!turned) {
    constexpr size_t kRow[6] = {0, 1, 2, 0, 1, 2}, kColumn[6] = {0, 1, 2, 1, 2, 0};
    for (size_t n = 0; n < stress.size(); ++n) {
      const size_t r = kRow[n % 6], c = kColumn[n % 6];
      EXPECT_NEAR(stress[n], mu * (kStrain[r][c] + kStrain[c][r]) + (r == c ? lambda * trace : 0), 1e-7);
    }
  }
  const std::string path = testing::TempDir() + "patch_" + model + ".vtu";
  test::ok(dfm_debug_write_body(s.body, path.c_str()));
  const std::string picture = test::read_file(path);
  EXPECT_NE(picture.find("Name=\"stress\" NumberOfComponents=\"6\""), std::string::npos);
  EXPECT_NE(picture.find("Name=\"von_mises\""), std::string::npos);
}

TEST(Static, PatchTest_IsPassedByLinearElasticity) { patch("linear_fem", false); }

TEST(Static, PatchTestTurned_IsPassedByCorotationalElasticity) { patch("corotational_fem", true); }

// Quarter of a thick cylinder under pressure inside, one layer between planes that do not move along z.
struct Cylinder {
  static constexpr double kInner = 0.05, kOuter = 0.1, kHeight = 0.01, kPressure = 1000, kYoung = 1e5,
                          kPoisson = 0.3;
  uint32_t radial, around;
  std::vector<double> points;
  std::vector<uint32_t> tets;

  uint32_t id(uint32_t r, uint32_t t, uint32_t z) const { return (r * (around + 1) + t) * 2 + z; }
  explicit Cylinder(uint32_t cells) : radial(cells), around(2 * cells) {
    for (uint32_t r = 0; r <= radial; ++r)
      for (uint32_t t = 0; t <= around; ++t)
        for (uint32_t z = 0; z < 2; ++z) {
          const double rho = kInner + (kOuter - kInner) * r / radial, a = M_PI / 2 * t / around;
          for (double x : {t == around ? 0 : rho * std::cos(a), t ? rho * std::sin(a) : 0, kHeight * z})
            points.push_back(x);
        }
    // six tetrahedra around the diagonal of each hexahedron
    for (uint32_t r = 0; r < radial; ++r)
      for (uint32_t t = 0; t < around; ++t) {
        int axes[3] = {0, 1, 2};
        do {
          uint32_t q[3] = {r, t, 0};
          uint32_t cell[4] = {id(q[0], q[1], q[2])};
          for (int k = 0; k < 3; ++k) {
            ++q[axes[k]];
            cell[k + 1] = id(q[0], q[1], q[2]);
          }
          const int falls = (axes[0] > axes[1]) + (axes[1] > axes[2]) + (axes[0] > axes[2]);
          if (falls % 2) std::swap(cell[1], cell[2]);
          tets.insert(tets.end(), cell, cell + 4);
        } while (std::next_permutation(axes, axes + 3));
      }
  }
  // Lame: u = A rho + B / rho
  static double radial_displacement(double rho) {
    const double a2 = kInner * kInner, b2 = kOuter * kOuter, f = kPressure * a2 / (b2 - a2);
    return (1 + kPoisson) / kYoung * f * ((1 - 2 * kPoisson) * rho + b2 / rho);
  }
};

// Relative errors of displacement and strain in the mean square, by one point and by four points per cell.
std::array<double, 2> errors_of(uint32_t cells) {
  const Cylinder c(cells);
  Statics s(c.points, c.tets, "linear_fem", Cylinder::kYoung, Cylinder::kPoisson);
  for (uint32_t i = 0; i < s.npoint; ++i)
    s.hold(i, uint8_t(4 | (c.points[3 * i] == 0 ? 1 : 0) | (c.points[3 * i + 1] == 0 ? 2 : 0)));
  for (uint32_t t = 0; t <= c.around; ++t)
    for (uint32_t z = 0; z < 2; ++z) {
      // pressure on the facets beside it, normal to each: p times half of its chord turned by 90 degrees
      double f[3] = {};
      const auto at = [&](uint32_t n) { return &c.points[3 * size_t(c.id(0, n, z))]; };
      const uint32_t first = t ? t - 1 : 0, last = std::min(t + 1, c.around);
      const double dx = at(last)[0] - at(first)[0], dy = at(last)[1] - at(first)[1];
      f[0] = 0.5 * Cylinder::kPressure * (Cylinder::kHeight / 2) * dy;
      f[1] = -0.5 * Cylinder::kPressure * (Cylinder::kHeight / 2) * dx;
      s.load(c.id(0, t, z), f);
    }
  s.solve();
  const std::vector<double> u = s.displacement();
  double off = 0, all = 0, strain_off = 0, strain_all = 0;
  for (size_t n = 0; n < c.tets.size(); n += 4) {
    const uint32_t *q = &c.tets[n];
    double e[3][3], inverse[3][3];
    for (size_t k = 0; k < 3; ++k)
      for (size_t a = 0; a < 3; ++a) e[k][a] = c.points[3 * q[k + 1] + a] - c.points[3 * q[0] + a];
    double det = 0;
    for (size_t k = 0; k < 3; ++k) {
      const size_t l = (k + 1) % 3, m = (k + 2) % 3;
      for (size_t a = 0; a < 3; ++a)
        inverse[k][a] = e[l][(a + 1) % 3] * e[m][(a + 2) % 3] - e[l][(a + 2) % 3] * e[m][(a + 1) % 3];
      if (k == 0)
        for (size_t a = 0; a < 3; ++a) det += e[0][a] * inverse[0][a];
    }
    double h[3][3] = {}, center[3] = {};
    for (size_t r = 0; r < 3; ++r)
      for (size_t a = 0; a < 3; ++a)
        for (size_t k = 0; k < 3; ++k)
          h[r][a] += (u[3 * q[k + 1] + r] - u[3 * q[0] + r]) * inverse[k][a] / det;
    for (size_t k = 0; k < 4; ++k)
      for (size_t a = 0; a < 3; ++a) center[a] += c.points[3 * q[k] + a] / 4;
    // displacement: the rule of degree 2 with four points
    for (size_t k = 0; k < 4; ++k) {
      double x[3] = {}, v[3] = {};
      for (size_t m = 0; m < 4; ++m) {
        const double w = m == k ? 0.5854101966249685 : 0.1381966011250105;
        for (size_t a = 0; a < 3; ++a) {
          x[a] += w * c.points[3 * q[m] + a];
          v[a] += w * u[3 * q[m] + a];
        }
      }
      const double rho = std::hypot(x[0], x[1]), exact = Cylinder::radial_displacement(rho);
      for (size_t a = 0; a < 3; ++a) {
        const double truth = a < 2 ? exact * x[a] / rho : 0;
        off += det / 24 * (v[a] - truth) * (v[a] - truth);
        all += det / 24 * truth * truth;
      }
    }
    const double rho = std::hypot(center[0], center[1]), d = 1e-6;
    const double rr =
        (Cylinder::radial_displacement(rho + d) - Cylinder::radial_displacement(rho - d)) / (2 * d);
    const double tt = Cylinder::radial_displacement(rho) / rho;
    for (size_t r = 0; r < 3; ++r)
      for (size_t a = 0; a < 3; ++a) {
        const double nn = r < 2 && a < 2 ? center[r] * center[a] / (rho * rho) : 0;
        const double truth = r < 2 && a < 2 ? rr * nn + tt * ((r == a) - nn) : 0;
        const double have = 0.5 * (h[r][a] + h[a][r]);
        strain_off += det / 6 * (have - truth) * (have - truth);
        strain_all += det / 6 * truth * truth;
      }
  }
  return {std::sqrt(off / all), std::sqrt(strain_off / strain_all)};
}

TEST(Static, ThickCylinder_ConvergesWithOrders2And1) {
  std::array<double, 2> before = errors_of(4);
  for (const uint32_t cells : {8u, 16u}) {
    const std::array<double, 2> now = errors_of(cells);
    EXPECT_NEAR(std::log2(before[0] / now[0]), cells == 8 ? 1.88 : 1.96, 0.05) << cells;
    EXPECT_NEAR(std::log2(before[1] / now[1]), cells == 8 ? 0.956 : 0.971, 0.05) << cells;
    before = now;
  }
}

// Cook's membrane in plane strain at nu 0.4999: linear tetrahedra lock, far from the 19.43 of the corner.
TEST(Static, CooksMembraneNearlyIncompressible_LocksAsThePageSays) {
  Statics s(mesh_path("bench/cook3d_2.msh"), "linear_fem", 1, 0.4999);
  s.apply(reference("fields/cook3d_2_bc.csv"));
  const std::vector<double> rest = s.rest();
  double corner = 0;
  for (uint32_t i = 0; i < s.npoint; ++i) s.hold(i, rest[3 * i] == 0 ? 7 : 4);
  s.solve();
  const std::vector<double> u = s.displacement();
  for (uint32_t i = 0; i < s.npoint; ++i)
    if (std::abs(rest[3 * i] - 48) < 1e-9 && std::abs(rest[3 * i + 1] - 60) < 1e-9) corner = u[3 * i + 1];
  EXPECT_GT(corner, 0.05 * 19.43);
  EXPECT_LT(corner, 0.5 * 19.43);
}

}  // namespace
