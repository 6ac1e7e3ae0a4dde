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
  for (int it = 0; it < 10000 && rr > 1e-10 * start; ++it) {
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

// Along and across the axis of springs whose extra coordinates have slope g (doc/models/msm.md, affine network), over Young's modulus.
Pull affine(double g, bool form_a) {
  double m0 = 0, m2 = 0, m4 = 0;  // means of t, t c^2, t c^4 over directions, t the softening of a spring at cosine c to the axis
  const int n = 20000;
  for (int k = 0; k < n; ++k) {
    const double c = (k + 0.5) / n, s = 1 / (1 + g * g * c * c), t = (form_a ? std::sqrt(s) : s) / n;
    m0 += t, m2 += t * c * c, m4 += t * c * c * c * c;
  }
  const double c33 = 6 * m4, c11 = 6 * 3.0 / 8 * (m0 - 2 * m2 + m4), c12 = c11 / 3, c13 = 3 * (m2 - m4);
  const double sum = (c11 + c12) * c33 - 2 * c13 * c13;
  return {sum / (c11 + c12), (c11 - c12) * sum / (c11 * c33 - c13 * c13)};  // here: along, across
}

TEST(MsmMaterial, SlopeAlongOneAxis_SoftensAsTheAffineNetworkOnAFreeMesh) {
  Mesh mesh = kuhn_bar(20, 3, 3, 0.05, 0.28);
  for (size_t n = 0; n < mesh.rest.size(); ++n)
    if (n % 3) mesh.rest[n] *= 0.1 / 0.15;  // the section that pull() takes
  const std::string path = test::shared_dir() + "/meshes/bars/bar_u3.msh";
  const bool free_mesh = std::ifstream(path).good();
  if (free_mesh) mesh = read_msh(path);
  else mesh.finish();
  for (bool form_a : {false, true}) {
    double last = 1e300, last_ratio = 0;
    for (double g : {0.0, 1.0, 2.0, 4.0, 12.0}) {
      Host host;
      Params p = {2e4, 0.3, 0, 0, 0};
      p.slope = g, p.form_a = form_a;
      Instance along(host, mesh, p);
      p.axis = {0, 1, 0};
      Instance across(host, mesh, p);
      const double e_along = pull(along).young / 2e4, e_across = pull(across).young / 2e4;
      const Pull expected = affine(g, form_a);
      std::printf("form %c  slope %4.1f  along %.4f (affine %.4f)  across %.4f (%.4f)  ratio %.3f (%.3f)\n", form_a ? 'A' : 'B', g, e_along,
                  expected.young, e_across, expected.poisson, e_across / e_along, expected.poisson / expected.young);
      EXPECT_LT(e_along, last);
      EXPECT_GT(e_across / e_along, last_ratio);
      // Points move less evenly the more springs differ, and the soft direction gains most by it; a regular mesh adds its own directions.
      const double over = e_across / e_along / (expected.poisson / expected.young);
      EXPECT_GE(over, 1 - 1e-6);
      if (free_mesh && g <= 2) { EXPECT_LE(over, 1.15); }
      last = e_along, last_ratio = e_across / e_along;
    }
  }
}

TEST(MsmMaterial, UniformFields_AreTheParametersAndUnevenOnesAddUpByCell) {
  Host host;
  const Mesh mesh = kuhn_bar(6, 2, 2, 0.1, 0.2);
  const auto all = [&](double value) { return std::vector<double>(mesh.ncell(), value); };
  Instance plain(host, mesh, {3e4, 0.4, 0.002, 3, 1.5});
  Instance field(host, mesh, {}, 4, {{"young", all(3e4)}, {"poisson", all(0.4)}, {"damping_stiffness", all(0.002)},
                                     {"damping_mass", all(3)}, {"volume", all(1.5)}});
  plain.shake(0.01, 1), field.shake(0.01, 1), plain.forces(), field.forces();
  for (uint32_t i = 0; i < mesh.npoint(); ++i) EXPECT_LT(norm(plain.get(plain.f, i) - field.get(field.f, i)), 1e-12 * plain.largest_force());
  EXPECT_NEAR(plain.bound() / field.bound(), 1, 1e-12);

  // Forces are a sum over cells: those of a body of two materials are those of its halves, each in a body whose other half is nothing.
  Fields both, left, right;
  for (uint32_t c = 0; c < mesh.ncell(); ++c) {
    const bool l = mesh.at(mesh.cells[4 * c])[0] < 0.25;
    const auto add = [&](const char *key, double a, double b, double none) {
      both[key].push_back(l ? a : b), left[key].push_back(l ? a : none), right[key].push_back(l ? none : b);
    };
    add("young", 1e5, 3e4, 1e-3), add("poisson", 0.45, 0.1, 0.25), add("damping_stiffness", 0.001, 0.004, 0), add("volume", 2, 0, 0);
  }
  Instance sum(host, mesh, {}, 4, both), a(host, mesh, {}, 4, left), b(host, mesh, {}, 4, right);
  for (Instance *m : {&sum, &a, &b}) m->shake(0.01, 1), m->forces();
  for (uint32_t i = 0; i < mesh.npoint(); ++i)
    EXPECT_LT(norm(sum.get(sum.f, i) - a.get(a.f, i) - b.get(b.f, i)), 1e-7 * sum.largest_force()) << i;  // nothing is 1e-8 of something
}

TEST(MsmMaterial, DragByCell_WeighsByVolumeAroundAPoint) {
  Mesh m = irregular_tet();
  m.rest.insert(m.rest.end(), {0.6, 0.4, -1.3});
  m.cells.insert(m.cells.end(), {0, 2, 1, 4});
  m.finish();
  Host host;
  Instance b(host, m, {}, 4, {{"damping_mass", {2, 10}}});
  for (uint32_t i = 0; i < 5; ++i) b.set(b.v, i, {1, -2, 3});
  b.forces();
  const double v0 = m.volume(0), v1 = m.volume(1), mixed = (2 * v0 + 10 * v1) / (v0 + v1), drag[] = {mixed, mixed, mixed, 2, 10};
  for (uint32_t i = 0; i < 5; ++i) EXPECT_LT(norm(b.get(b.f, i) + (drag[i] * m.mass[i]) * Vec{1, -2, 3}), 1e-11 * m.mass[i]);
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
