// The volume term that follows from Poisson's ratio, and the resistance to collapse: what it leaves alone,
// and that cells come back from any shape.
#include "msm_host.h"

namespace msm_test {
namespace {

constexpr double kFromPoisson = -1;

Params defaults(double poisson) {
  Params p = {1e4, poisson, 0, 0, kFromPoisson};
  p.collapse = 3;
  return p;
}

double volume_share(const Instance &b, uint32_t c) {
  const uint32_t *q = &b.mesh.cells[4 * c];
  const Vec o = b.get(b.x, q[0]);
  return dot(b.get(b.x, q[1]) - o, cross(b.get(b.x, q[2]) - o, b.get(b.x, q[3]) - o)) / 6 / b.mesh.volume(c);
}
double least_share(const Instance &b) {
  double least = 1e300;
  for (uint32_t c = 0; c < b.mesh.ncell(); ++c) least = std::min(least, volume_share(b, c));
  return least;
}

// Cells stretched, flat and turned inside out.
void crush(Instance &b, unsigned seed = 1) {
  for (uint32_t i = 0; i < b.size(); ++i)
    b.set(b.x, i, {1.3 * b.mesh.at(i)[0], b.mesh.at(i)[1], 0.3 * b.mesh.at(i)[2]});
  b.shake(0.02, 0, seed);
}

TEST(MsmCollapse, TableDefaults_AreVolumeFromPoissonAndThreeTimesYoung) {
  const auto row = [](const char *key) {
    const dfm_type &type = plugin_type();
    for (uint32_t n = 0; n < type.nparam; ++n)
      if (!std::strcmp(type.params[n].key, key)) return type.params[n];
    return dfm_param{};
  };
  EXPECT_EQ(row("volume").def, kFromPoisson);
  EXPECT_EQ(row("volume").min, kFromPoisson);
  EXPECT_EQ(row("collapse").def, 3);
}

TEST(MsmCollapse, VolumeFromPoisson_IsTheFormulaAndNothingBelowAQuarter) {
  Host host;
  const Mesh mesh = kuhn_bar(4, 3, 2, 0.1, 0.2);
  for (double nu : {-0.5, 0.0, 0.25, 0.3, 0.4, 0.45, 0.49}) {
    Params given = defaults(nu);
    given.volume = nu > 0.25 ? 3 * (4 * nu - 1) / (2 * (1 + nu)) : 0;
    Instance a(host, mesh, defaults(nu)), b(host, mesh, given),
        field(host, mesh, defaults(0.1), 4, {{"poisson", std::vector<double>(mesh.ncell(), nu)}});
    for (Instance *m : {&a, &b, &field}) {
      m->shake(0.02, 0);
      m->forces();
    }
    EXPECT_EQ(std::memcmp(a.f, b.f, 4 * a.size() * sizeof(double)), 0) << nu;
    EXPECT_EQ(a.bound(), b.bound()) << nu;
    for (uint32_t i = 0; i < a.size(); ++i)
      EXPECT_LT(norm(a.get(a.f, i) - field.get(field.f, i)), 1e-12 * a.largest_force()) << nu;
  }
}

TEST(MsmCollapse, VolumeBetweenMinusOneAndZero_IsRefused) {
  Host host;
  Params p = defaults(0.3);
  p.volume = -0.5;
  Instance b(host, regular_tet(), p);
  EXPECT_EQ(b.status, DFM_E_ARG);
  EXPECT_NE(host.logged.find("volume"), std::string::npos) << host.logged;
  Instance field(host, regular_tet(), {}, 4, {{"volume", {-0.5}}});
  EXPECT_EQ(field.status, DFM_E_ARG);
}

TEST(MsmCollapse, CellsAboveSixTenths_FeelNothingOfIt) {
  Host host;
  for (double nu : {0.2, 0.3, 0.45}) {
    Params without = defaults(nu);
    without.collapse = 0;
    Instance a(host, kuhn_bar(4, 3, 2, 0.1, 0.2), defaults(nu)), b(host, a.mesh, without);
    a.shake(0.004, 0);
    b.shake(0.004, 0);
    ASSERT_GT(least_share(a), 0.6);
    a.forces();
    b.forces();
    EXPECT_EQ(std::memcmp(a.f, b.f, 4 * a.size() * sizeof(double)), 0) << nu;
    EXPECT_EQ(a.energy(), b.energy());
  }
}

TEST(MsmCollapse, Force_IsMinusTheGradientOfTheEnergyOverDecades) {
  Host host;
  for (double young : {1.0, 1e4, 1e8})
    for (double nu : {0.0, 0.3, 0.49}) {
      Params p = defaults(nu);
      p.young = young;
      Instance b(host, kuhn_bar(3, 2, 2, 0.1, 0.2), p);
      crush(b);
      ASSERT_LT(least_share(b), 0);
      expect_force_is_gradient(b, 1e-6, 1e-6,
                               "young " + std::to_string(young) + " poisson " + std::to_string(nu));
      b.forces();
      expect_no_force_or_torque(b, "crushed");
    }
}

// A share of the points is thrown `far` edges of the mesh away, so that the cells around them are needles,
// sheets and balloons of any orientation.
void scatter(Instance &b, double edge, double far, unsigned seed = 4) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  for (uint32_t i = 0; i < b.size(); ++i) {
    const Vec away = {normal(random), normal(random), normal(random)};
    b.set(b.x, i, b.get(b.x, i) + (i % 3 ? 0.2 * edge : far * edge) * away);
  }
}

TEST(MsmCollapse, ForceOfStretchedCells_IsMinusTheGradientOfTheEnergy) {
  Host host;
  for (double nu : {0.0, 0.3, 0.49})
    for (double far : {1.0, 2.0, 10.0, 100.0}) {
      Instance b(host, kuhn_bar(3, 2, 2, 0.1, 0.2), defaults(nu));
      scatter(b, 0.1, far);
      expect_force_is_gradient(b, 1e-6 * std::max(1.0, far), 2e-6,
                               "poisson " + std::to_string(nu) + " far " + std::to_string(far));
      b.forces();
      expect_no_force_or_torque(b, "scattered");
    }
}

TEST(MsmCollapse, LimitedCells_AreCountedWithTheBound) {
  Host host;
  for (const char *simd : {"sse2", "avx2", "avx512"}) {
    setenv("DEFORM_SIMD", simd, 1);
    Instance b(host, kuhn_bar(3, 2, 2, 0.1, 0.2), defaults(0.3));
    unsetenv("DEFORM_SIMD");
    const auto *ext = static_cast<const dfm_limited *>(b.ops->extension(b.self, DFM_EXT_LIMITED));
    ASSERT_NE(ext, nullptr);
    b.bound();
    EXPECT_EQ(ext->count(b.self), 0u) << simd;
    b.set(b.x, 0, b.get(b.x, 0) + Vec{-5, -4, -3});  // a corner of the bar
    const auto touching = size_t(std::count(b.mesh.cells.begin(), b.mesh.cells.end(), 0u));
    b.bound();
    EXPECT_EQ(ext->count(b.self), touching) << simd;
  }
}

TEST(MsmCollapse, StepBound_NeverFallsFarBelowThatAtRest) {
  Host host;
  for (double nu : {0.0, 0.3, 0.45})
    for (const Mesh &mesh : {regular_tet(), kuhn_bar(4, 3, 3, 0.1, 0.2)}) {
      Instance b(host, mesh, defaults(nu));
      const double edge = norm(mesh.at(1) - mesh.at(0)), rest = b.bound();
      double least = rest;
      for (double far = 0.1; far < 1e6; far *= 1.7)
        for (unsigned seed = 0; seed < 4; ++seed) {
          for (uint32_t i = 0; i < b.size(); ++i) b.set(b.x, i, mesh.at(i));
          scatter(b, edge, far, seed);
          least = std::min(least, b.bound());
        }
      EXPECT_GT(least, 0.07 * rest) << "poisson " << nu << ", " << mesh.ncell() << " cells";
    }
}

// Such a cell turns over within a step wherever the body vibrates: with the full resistance the bound of the
// whole body falls each time.
TEST(MsmCollapse, FlatCellBelowSixTenths_LeavesTheStepBoundOfItsBody) {
  Host host;
  Mesh mesh = kuhn_bar(4, 4, 4, 0.1);
  const auto inner = [&](uint32_t i) {
    return std::all_of(&mesh.rest[3 * i], &mesh.rest[3 * i] + 3,
                       [](double v) { return v > 0.19 && v < 0.21; });
  };
  for (uint32_t c = 0; c < mesh.ncell(); ++c) {
    const uint32_t *const q = &mesh.cells[4 * c];
    const auto a = std::find_if(q, q + 4, inner);
    if (a == q + 4) continue;
    const Vec face = mesh.at(q[a == q]);
    const Vec n = cross(mesh.at(q[a <= q + 1 ? 2 : 1]) - face, mesh.at(q[a == q + 3 ? 2 : 3]) - face);
    const Vec height = (dot(mesh.at(*a) - face, n) / dot(n, n)) * n;
    Mesh flat = mesh;
    for (size_t k = 0; k < 3; ++k) flat.rest[3 * *a + k] -= 0.97 * height[k];
    Instance b(host, flat, defaults(0.2));
    ASSERT_EQ(b.status, DFM_OK) << host.logged;
    const double rest = b.bound();
    b.set(b.x, *a, flat.at(*a) - 0.012 * height);  // to 0.6 of what is left of the cell
    EXPECT_GT(b.bound(), 0.8 * rest);
    return;
  }
  FAIL() << "no inner point";
}

TEST(MsmCollapse, CellEnergy_SumsToTheEnergy) {
  Host host;
  Instance b(host, kuhn_bar(5, 3, 2, 0.1, 0.2), defaults(0.3));
  crush(b);
  const double sum = energy_of_cells(b);
  EXPECT_NEAR(sum, b.energy(), 1e-12 * sum);
}

TEST(MsmCollapse, CellsGivenInsideOut_CountFromTheirOwnVolume) {
  Host host;  // a host may hand over cells of either orientation; a cell is at rest as it was given
  Mesh turned = kuhn_bar(3, 2, 2, 0.1, 0.2);
  for (size_t c = 0; c < turned.cells.size(); c += 8) std::swap(turned.cells[c], turned.cells[c + 1]);
  Instance a(host, kuhn_bar(3, 2, 2, 0.1, 0.2), defaults(0.3)), b(host, turned, defaults(0.3));
  crush(a);
  crush(b);
  a.forces();
  b.forces();
  EXPECT_NEAR(a.energy(), b.energy(), 1e-12 * a.energy());
  for (uint32_t i = 0; i < a.size(); ++i)
    EXPECT_LT(norm(a.get(a.f, i) - b.get(b.f, i)), 1e-12 * a.largest_force()) << i;
}

// Ten periods and more of damped motion by symplectic Euler.
void settle(Instance &b, double periods, double period) {
  double h = 0;
  int n = 0;
  for (double t = 0; t < periods * period && n < 20000; t += h, ++n) {
    h = 0.9 * b.bound();
    b.forces();
    b.move(h);
  }
}

TEST(MsmCollapse, SquashedFlatAndInvertedBodies_ComeBack) {
  Host host;
  using Start = Vec (*)(Vec x, double size, uint32_t i);
  const std::pair<const char *, Start> starts[] = {
      {"squashed", [](Vec x, double, uint32_t) { return Vec{x[0], x[1], 0.01 * x[2]}; }},
      {"flat", [](Vec x, double, uint32_t) { return Vec{x[0], x[1], 0}; }},
      {"points pushed through a cell",
       [](Vec x, double size, uint32_t i) { return i % 7 ? x : x - (0.5 * size / norm(x)) * x; }},
      {"mirrored", [](Vec x, double, uint32_t) { return Vec{x[0], x[1], -x[2]}; }},
      {"in a point", [](Vec x, double, uint32_t) { return 0.01 * x; }},
      {"blown up", [](Vec x, double, uint32_t) { return 20.0 * x; }}};
  for (const Mesh &mesh : {regular_tet(), irregular_tet(), kuhn_bar(3, 3, 3, 0.1, 0.2)}) {
    Vec middle{};
    double size = 0;
    for (uint32_t i = 0; i < mesh.npoint(); ++i) middle = middle + (1.0 / mesh.npoint()) * mesh.at(i);
    for (uint32_t i = 0; i < mesh.npoint(); ++i) size = std::max(size, norm(mesh.at(i) - middle));
    for (double nu : {-0.5, 0.25, 0.3, 0.45})
      for (const auto &[name, start] : starts) {
        // A whole body that is mirrored has far to go, and one of few cells can meet itself on the way; a
        // cell alone cannot.
        if (mesh.ncell() > 1 && !std::strcmp(name, "mirrored")) continue;
        Params p = defaults(nu);
        const double period = size / std::sqrt(p.young / 1000);
        p.damping_stiffness = 0.02 * period;
        p.damping_mass = 2 / period;
        Instance b(host, mesh, p);
        for (uint32_t i = 0; i < b.size(); ++i) b.set(b.x, i, middle + start(mesh.at(i) - middle, size, i));
        b.shake(1e-3 * size, 0);  // no start is so even that nothing tells one side from the other
        settle(b, 30, period);
        EXPECT_GT(least_share(b), 0.99) << name << ", poisson " << nu << ", " << mesh.ncell() << " cells";
        EXPECT_LT(b.energy(), 1e-6 * p.young * std::pow(size, 3))
            << name << ", poisson " << nu << ", " << mesh.ncell() << " cells";
      }
  }
}

}  // namespace
}  // namespace msm_test
