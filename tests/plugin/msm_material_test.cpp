// What material the springs are: Young's modulus under refinement, Poisson ratio, and the Voigt element in closed form.
#include "msm_host.h"

namespace msm_test {
namespace {

// K u at rest, by central differences of the forces: the model is smooth, so 1e-5 of an edge leaves 1e-9.
struct Stiffness {
  Instance &b;
  double h;
  void apply(const std::vector<double> &u, std::vector<double> &out) const {
    double most = 1e-300;
    for (double a : u) most = std::max(most, std::abs(a));
    const double step = h / most;
    std::vector<double> forces[2];
    for (int side = 0; side < 2; ++side) {
      for (uint32_t i = 0; i < b.size(); ++i)
        for (int a = 0; a < 3; ++a) b.x[4 * i + a] = b.mesh.rest[3 * i + a] + (side ? -step : step) * u[3 * i + a];
      b.forces();
      for (uint32_t i = 0; i < b.size(); ++i)
        for (int a = 0; a < 3; ++a) forces[side].push_back(b.f[4 * i + a]);
    }
    out.resize(u.size());
    for (size_t n = 0; n < u.size(); ++n) out[n] = -(forces[0][n] - forces[1][n]) / (2 * step);
  }
};

struct Pull { double young, poisson; };

// Static stretch by 1 along x of a bar [0,1] x [0,0.1]^2 between plates without friction: force and lateral contraction.
Pull pull(Instance &b) {
  const size_t n = b.mesh.rest.size();
  std::vector<char> held(n, 0);
  std::vector<double> u(n, 0), r, p(n), q;
  for (uint32_t i = 0; i < b.size(); ++i) {
    u[3 * i] = b.mesh.rest[3 * i];
    held[3 * i] = b.mesh.rest[3 * i] < 1e-9 || b.mesh.rest[3 * i] > 1 - 1e-9;
  }
  const Stiffness stiffness{b, 1e-7};
  stiffness.apply(u, r);
  double rr = 0;
  for (size_t k = 0; k < n; ++k) r[k] = held[k] ? 0 : -r[k], p[k] = r[k], rr += r[k] * r[k];
  const double start = rr;
  for (int it = 0; it < 3000 && rr > 1e-10 * start; ++it) {
    stiffness.apply(p, q);
    double pq = 0;
    for (size_t k = 0; k < n; ++k) q[k] = held[k] ? 0 : q[k], pq += p[k] * q[k];
    double next = 0;
    for (size_t k = 0; k < n; ++k) u[k] += rr / pq * p[k], r[k] -= rr / pq * q[k], next += r[k] * r[k];
    for (size_t k = 0; k < n; ++k) p[k] = r[k] + next / rr * p[k];
    rr = next;
  }
  EXPECT_LE(rr, 1e-10 * start);
  stiffness.apply(u, q);
  Pull result{};
  double sum = 0, lateral = 0, square = 0;
  for (uint32_t i = 0; i < b.size(); ++i) {
    if (b.mesh.rest[3 * i] > 1 - 1e-9) sum += q[3 * i];
    for (int a = 1; a < 3; ++a) {
      const double y = b.mesh.rest[3 * i + a] - 0.05;
      lateral += y * u[3 * i + a], square += y * y;
    }
  }
  result.young = sum / (0.1 * 0.1);
  result.poisson = -lateral / square;
  return result;
}

// Regular bars of this test and, where they lie beside the repository, the structured and the free meshes of the same bar.
std::vector<std::pair<std::string, Mesh>> bars() {
  std::vector<std::pair<std::string, Mesh>> all = {{"regular 10", kuhn_bar(10, 1, 1, 0.1)}, {"regular 20", kuhn_bar(20, 2, 2, 0.05)},
                                                   {"regular 40", kuhn_bar(40, 4, 4, 0.025)},
                                                    {"shaken 40", kuhn_bar(40, 4, 4, 0.025, 0.1)}};
  const std::string folder = test::shared_dir() + "/meshes/bars/bar_";
  for (const char *name : {"s1", "s2", "s3", "s4", "u1", "u2", "u3", "u4"})
    if (std::ifstream(folder + name + ".msh")) all.push_back({name, read_msh(folder + name + ".msh")});
  return all;
}

TEST(MsmMaterial, AxialStretch_KeepsYoungsModulusUnderRefinement) {
  // Springs are exact for a direction average of the strain (Voigt); a mesh's own directions and its surface make the rest.
  std::vector<double> young;
  for (const auto &[name, mesh] : bars()) {
    Host host;
    Instance b(host, mesh, {2e4, 0.3, 0, 0, 0});
    const Pull p = pull(b);
    std::printf("%-10s E/young %.4f  nu %.4f\n", name.c_str(), p.young / 2e4, p.poisson);
    young.push_back(p.young / 2e4);
  }
  const auto [least, most] = std::minmax_element(young.begin(), young.end());
  EXPECT_LT(*most - *least, 0.1 * (*most + *least));  // all within 10 % of their middle
  EXPECT_NEAR(0.5 * (*most + *least), 1, 0.05);
  EXPECT_NEAR(young[1], young[0], 0.005);
  EXPECT_NEAR(young[2], young[0], 0.005);  // pure refinement
}

TEST(MsmMaterial, VolumeTerm_KeepsYoungsModulusAndRaisesPoisson) {
  Host host;
  const Mesh mesh = kuhn_bar(20, 2, 2, 0.05, 0.25);
  double last = 0;
  for (double volume : {0.0, 0.1, 1.0, 10.0}) {
    Instance b(host, mesh, {2e4, 0.45, 0, 0, volume});
    const Pull p = pull(b);
    EXPECT_NEAR(p.young / 2e4, 1.1, 0.15) << volume;
    EXPECT_GT(p.poisson, last) << volume;
    last = p.poisson;
  }
  EXPECT_NEAR(last, 0.5, 0.01);
}

TEST(MsmMaterial, YoungField_ScalesTheSpringsOfItsCells) {
  Host host;
  const Mesh mesh = kuhn_bar(6, 2, 2, 0.1, 0.2);
  const std::vector<double> uniform(mesh.ncell(), 3e4);
  std::vector<double> doubled = uniform;
  for (double &e : doubled) e *= 2;
  const Params p = {1e4, 0.4, 0.002, 0, 1};
  Instance plain(host, mesh, {3e4, 0.4, 0.002, 0, 1}), field(host, mesh, p, 4, {{"young", uniform}}), twice(host, mesh, p, 4, {{"young", doubled}});
  plain.shake(0.01, 1), field.shake(0.01, 1), twice.shake(0.01, 1);
  plain.forces(), field.forces(), twice.forces();
  for (uint32_t i = 0; i < mesh.npoint(); ++i) {
    EXPECT_LT(norm(plain.get(plain.f, i) - field.get(field.f, i)), 1e-12 * plain.largest_force());
    EXPECT_LT(norm(2.0 * field.get(field.f, i) - twice.get(twice.f, i)), 1e-12 * plain.largest_force());
  }
}

// M3: m x'' + c x' + k x = F from rest, with m = 0.2, k = 50, c = 0.4: the free point of a cell whose base is held. A force of 1e-5 N
// keeps x so small that the springs are linear to 1e-7.
TEST(MsmMaterial, VoigtElement_FollowsTheClosedForm) {
  Host host;
  const double m = 0.2, k = 50, c = 0.4, force = 1e-5, h = 2e-5;
  // Regular cell of unit edge: three springs at 2/3 of their stiffness along the height, k_e = young V.
  const Mesh mesh = regular_tet();
  const double young = k / (3 * (2.0 / 3)) / mesh.volume(0);
  Instance b(host, mesh, {young, 0.3, c / k, 0, 0});
  const double zeta = c / (2 * std::sqrt(k * m)), w0 = std::sqrt(k / m), wd = w0 * std::sqrt(1 - zeta * zeta);
  const double rest = mesh.at(3)[2];
  double v = 0, worst = 0;
  for (int n = 1; n <= 100000; ++n) {
    // Midpoint: order 2, so that the integrator's error stays below the comparison.
    double *x = b.x + 4 * 3 + 2, *vel = b.v + 4 * 3 + 2;
    const double x0 = *x;
    *vel = v, b.forces();
    const double a0 = (b.f[4 * 3 + 2] + force) / m;
    *x = x0 + 0.5 * h * v, *vel = v + 0.5 * h * a0, b.forces();
    const double a1 = (b.f[4 * 3 + 2] + force) / m;
    *x = x0 + h * (v + 0.5 * h * a0), v += h * a1;
    if (n % 500) continue;
    const double t = n * h;
    const double turn = std::cos(wd * t) + zeta / std::sqrt(1 - zeta * zeta) * std::sin(wd * t);
    const double exact = force / k * (1 - std::exp(-zeta * w0 * t) * turn);
    worst = std::max(worst, std::abs((*x - rest) - exact) / (force / k));
    if (n == 500) { EXPECT_NEAR((*x - rest) / force, 0.000247825376157322, 1e-8); }   // x of a unit force at 0.01 s
    if (n == 2500) { EXPECT_NEAR((*x - rest) / force, 0.00574037939570326, 1e-8); }   // at 0.05 s
  }
  EXPECT_LT(worst, 1e-6);
}

}  // namespace
}  // namespace msm_test
