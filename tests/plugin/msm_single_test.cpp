// Forces of org.deform.msm in single precision, extension dfm.f32/1: error against double, momentum, the same
// bits for every instruction set and cut, parameters that change, what has none. Sees the plugin ABI alone.
#include "msm_host.h"

namespace msm_test {
namespace {

const Params kFull = {2e5, 0.4, 0.003, 0.5, 1.5};
constexpr double kUnit = 5.9604644775390625e-8;  // 2^-24

struct Single : Instance {
  using Instance::Instance;
  const dfm_f32 *table() const { return static_cast<const dfm_f32 *>(ops->extension(self, DFM_EXT_F32)); }
  dfm_status prepare() const { return table()->prepare(self); }
  void single_forces() {
    std::fill(f, f + size_t(size()) * stride, 0.0);
    const dfm_kin k = kin();
    EXPECT_EQ(table()->add_forces(self, &k, f), DFM_OK);
  }
  std::vector<double> kept() const { return {f, f + size_t(size()) * stride}; }
  // Largest difference of a point's force between the two.
  double difference() {
    forces();
    const std::vector<double> exact = kept();
    single_forces();
    double most = 0;
    for (uint32_t i = 0; i < size(); ++i) most = std::max(most, norm(get(f, i) - get(exact.data(), i)));
    return most;
  }
};

Params tilted() {
  Params p = kFull;
  p.slope = 1.3;
  p.axis = {1, 2, -1};
  return p;
}
Params collapsing() {
  Params p = {2e5, 0.3, 0.003, 0, -1};
  p.collapse = 3;
  return p;
}

// A point of a free mesh has 14 springs of E h^2 per unit strain and 24 cells; the page's bound of one is
// 5 units of the 24th bit.
double bound_of(const Params &p, double h) { return 30 * kUnit * p.young * h * h; }

// unsanitized: too slow there; shorter tests run the same code
TEST(MsmSingle, Error_IsAFewUnitsOfTheLastBitOfAStrain) {
  const double h = 0.1;
  for (const Params &p : {Params{2e5}, Params{2e5, 0.4, 0.003}, kFull, tilted(), collapsing()})
    for (const Vec &shift : {Vec{}, Vec{1234.5, -567.8, 90.1}})
      for (uint32_t stride : {3u, 4u, 5u}) {
        Host host;
        Single b(host, kuhn_bar(16, 8, 8, h, 0.2), p, stride);
        ASSERT_EQ(b.prepare(), DFM_OK);
        for (uint32_t i = 0; i < b.size(); ++i) b.set(b.x, i, b.get(b.x, i) + shift);
        EXPECT_LT(b.difference(), bound_of(p, h));
        b.shake(1e-3, 0.1);
        EXPECT_LT(b.difference(), bound_of(p, h));
      }
}

TEST(MsmSingle, RigidMotion_GivesNoMoreThanThatError) {
  Host host;
  const double h = 0.1;
  Params p = kFull;
  p.damping_mass = 0;
  Single b(host, kuhn_bar(16, 8, 8, h, 0.2), p);
  ASSERT_EQ(b.prepare(), DFM_OK);
  const Vec axis = (1 / std::sqrt(14.0)) * Vec{1, 2, 3}, drift = {100, 40, -30}, spin = {2, -1, 0.5};
  for (double angle : {0.0, 0.3, 1.6, 2.967}) {
    for (uint32_t i = 0; i < b.size(); ++i) {
      const Vec x = rotate(b.mesh.at(i), axis, angle) + Vec{3, -7, 2};
      b.set(b.x, i, x);
      b.set(b.v, i, drift + cross(spin, x));
    }
    b.single_forces();
    EXPECT_LT(b.largest_force(), bound_of(p, h)) << angle;
  }
}

TEST(MsmSingle, LargeStrain_InvertedAndFarCells_AgreeToARelativeError) {
  for (double amount : {0.03, 0.3, 3.0}) {
    Host host;
    Single b(host, kuhn_bar(8, 6, 6, 0.1, 0.2), collapsing());
    ASSERT_EQ(b.prepare(), DFM_OK);
    b.shake(amount, 1);
    const double difference = b.difference();
    EXPECT_LT(difference, 2e-6 * b.largest_force()) << amount;
  }
}

TEST(MsmSingle, Momentum_IsKeptAsInDouble_AngularToTheLastBitOfAFloat) {
  for (const Params &given : {kFull, tilted(), collapsing()}) {
    Params p = given;
    p.damping_mass = 0;
    Host host;
    Single b(host, kuhn_bar(16, 8, 8, 0.1, 0.2), p);
    ASSERT_EQ(b.prepare(), DFM_OK);
    b.shake(0.01, 1);
    b.single_forces();
    Vec force{}, torque{};
    double scale = 0;
    for (uint32_t i = 0; i < b.size(); ++i) {
      const Vec f = b.get(b.f, i);
      force = force + f;
      torque = torque + cross(b.get(b.x, i), f);
      scale += norm(f);
    }
    EXPECT_LT(norm(force), 1e-14 * scale);
    EXPECT_LT(norm(torque), 1e-7 * scale * 0.1);
  }
}

std::vector<double> results(const char *simd, const Mesh &mesh, const Params &p, unsigned shuffle = 0) {
  Host host;
  host.shuffle = shuffle;
  setenv("DEFORM_SIMD", simd, 1);
  Single b(host, mesh, p);
  unsetenv("DEFORM_SIMD");
  EXPECT_EQ(b.prepare(), DFM_OK);
  std::vector<double> all;
  for (double amount : {0.004, 0.05, 0.5}) {  // inverted cells, then cells beyond their limit
    b.shake(amount, 2);
    b.single_forces();
    all.insert(all.end(), b.f, b.f + 4 * size_t(b.size()));
  }
  return all;
}

// unsanitized: too slow there; shorter tests run the same code
TEST(MsmSingle, InstructionSetAndCut_NeverShowInAResult) {
  Params undamped = kFull;
  undamped.damping_stiffness = 0;
  for (const Mesh &mesh : {irregular_tet(), kuhn_bar(4, 3, 2, 0.1, 0.2), kuhn_bar(30, 9, 8, 0.05, 0.2)})
    for (const Params &p : {kFull, undamped, tilted(), collapsing()}) {
      const std::vector<double> baseline = results("sse2", mesh, p);
      for (const char *simd : {"avx2", "avx512"}) EXPECT_EQ(baseline, results(simd, mesh, p)) << simd;
      EXPECT_EQ(baseline, results("", mesh, p, 11));
    }
}

TEST(MsmSingle, Compiler_NeverShowsInAResult) {
  uint64_t hash = 14695981039346656037ull;
  for (const double value : results("", kuhn_bar(8, 6, 6, 0.1, 0.2), collapsing())) {
    unsigned char bytes[sizeof value];
    std::memcpy(bytes, &value, sizeof value);
    for (const unsigned char byte : bytes) hash = (hash ^ byte) * 1099511628211ull;
  }
  EXPECT_EQ(hash, 10720112930180195139ull);
}

// n cells around one edge, `open` ones short of a ring; every third one listed in the other orientation.
Mesh spindle(uint32_t n, bool open) {
  Mesh m;
  m.rest = {0, 0, -0.1, 0, 0, 0.1};
  const uint32_t ring = open ? n + 1 : n;
  for (uint32_t k = 0; k < ring; ++k) {
    const double angle = 2 * M_PI * k / ring;
    for (double x : {0.1 * std::cos(angle), 0.1 * std::sin(angle), 0.01 * (k % 3)}) m.rest.push_back(x);
  }
  for (uint32_t k = 0; k < n; ++k) {
    const uint32_t to = 2 + (k + 1) % ring;
    for (uint32_t p : k % 3 ? std::vector{0u, 1u, 2 + k, to} : std::vector{to, 0u, 1u, 2 + k})
      m.cells.push_back(p);
  }
  m.finish();
  return m;
}

TEST(MsmSingle, CellsAroundOneEdge_AnyNumber_HaveTheForcesOfDouble) {
  for (uint32_t n = 3; n <= 40; n += n < 20 ? 1 : 10)
    for (const bool open : {false, true})
      for (const Params &p : {kFull, tilted(), collapsing(), Params{2e5}}) {
        Host host;
        Single b(host, spindle(n, open), p);
        ASSERT_EQ(b.prepare(), DFM_OK);
        b.shake(5e-3, 0.1);
        const double difference = b.difference();
        EXPECT_LT(difference, 3e-6 * b.largest_force()) << n;
      }
}

// Every cell is a fan of its own then, and their array is full.
TEST(MsmSingle, CellsThatShareNoFace_HaveTheForcesOfDouble) {
  Mesh m;
  const Mesh one = regular_tet();
  for (uint32_t c = 0; c < 8; ++c) {
    for (const uint32_t k : one.cells) m.cells.push_back(m.npoint() + k);
    for (uint32_t k = 0; k < 4; ++k)
      for (const double x : one.at(k) + Vec{2.0 * c, 0, 0}) m.rest.push_back(x);
  }
  m.finish();
  Host host;
  Single b(host, m, kFull);
  ASSERT_EQ(b.prepare(), DFM_OK);
  b.shake(5e-3, 0.1);
  EXPECT_LT(b.difference(), bound_of(kFull, 1));
}

TEST(MsmSingle, ParametersAndMasks_ReachBoth) {
  Host host;
  const double h = 0.1;
  Params p = kFull;
  Single b(host, kuhn_bar(8, 6, 6, h, 0.2), p);
  ASSERT_EQ(b.prepare(), DFM_OK);
  b.shake(1e-3, 0.1);
  p.young = 7e4;
  p.volume = 0.2;
  p.slope = 0.7;
  p.damping_stiffness = 0.01;
  ASSERT_EQ(b.ops->set_params(b.self, Instance::row(p).data()), DFM_OK);
  EXPECT_LT(b.difference(), bound_of(p, h));
  b.mask({0, 5, 17, 300}, false);
  EXPECT_LT(b.difference(), bound_of(p, h));
  ASSERT_EQ(b.prepare(), DFM_OK);
  EXPECT_LT(b.difference(), bound_of(p, h));
}

TEST(MsmSingle, WhatHasNone_IsRefusedWithItsReason) {
  Params branch = kFull, turned = kFull;
  branch.damper = 1;
  turned.form_a = true;
  for (const auto &[p, word] : {std::pair(branch, "damper"), std::pair(turned, "anisotropy_form")}) {
    Host host;
    Single b(host, kuhn_bar(2, 2, 2, 0.1), p);
    EXPECT_EQ(b.prepare(), DFM_E_UNSUPPORTED);
    EXPECT_NE(host.logged.find(word), std::string::npos) << host.logged;
  }
  Host host;
  Single small(host, kuhn_bar(2, 2, 2, 1e-7), kFull);
  EXPECT_EQ(small.prepare(), DFM_E_UNSUPPORTED);
  Single b(host, kuhn_bar(2, 2, 2, 0.1), kFull);
  const dfm_kin k = b.kin();
  EXPECT_EQ(b.table()->add_forces(b.self, &k, b.f), DFM_E_STATE);
}

TEST(MsmSingle, WhereMemoryEnds_NothingHasChanged) {
  Host host;
  Single b(host, kuhn_bar(3, 2, 2, 0.1), kFull);
  const size_t before = host.live;
  size_t n = 0;
  for (; n < 100; ++n) {
    host.fail_at = host.calls + n;
    const dfm_status status = b.prepare();
    if (status == DFM_OK) break;
    EXPECT_EQ(status, DFM_E_NOMEM) << n;
    EXPECT_EQ(host.live, before) << n;
  }
  EXPECT_GT(n, 5u);
  host.fail_at = ~size_t(0);
  b.single_forces();
}

TEST(MsmSingle, APlaceThatIsNotFinite_ShowsInTheForces) {
  for (double bad : {double(NAN), HUGE_VAL}) {
    Host host;
    Single b(host, kuhn_bar(3, 2, 2, 0.1), kFull);
    ASSERT_EQ(b.prepare(), DFM_OK);
    b.x[4 * 5 + 1] = bad;
    b.single_forces();
    EXPECT_TRUE(std::isnan(b.f[4 * 5 + 1]));
  }
}

}  // namespace
}  // namespace msm_test
