// The type org.deform.condensed: its surface at rest is that of the full solution. org.deform.boundary has
// the same steps (boundary_elements_test.cpp).
#include "near.h"
#include "stepper_host.h"

namespace {

using namespace stepper_test;

const dfm_type &condensed() { return type_of("model_reduced", 1); }

// Three long steps: every mode is at rest.
void settle(Stepper &b) {
  b.dt = 1e5;
  for (int n = 0; n < 3; ++n) b.step();
}

// Nodes of the rows of the reference's surface.
std::vector<uint32_t> reference_surface() {
  std::vector<uint32_t> out;
  const auto nodes = test::read_csv(test::reference_dir() + "/elasticity/tables/condensation_nodes.csv");
  for (size_t r = 1; r < nodes.size(); ++r) out.push_back(uint32_t(std::stoul(nodes[r][1])));
  EXPECT_EQ(out.size(), 649u);
  return out;
}

TEST(Condensed, ClampedBarUnderUnevenLoads_HasTheFullSolution) {
  const Mesh m = read_msh(test::mesh_dir() + "/bars/bar_s3.msh");
  Host host;
  Stepper b(host, condensed(), m, {{"young", 1e5}, {"modes", 5}}, clamp_of(m));
  ASSERT_EQ(b.status, DFM_OK) << host.logged;
  uint32_t corner = 0;
  const auto far = [&](uint32_t i) { return m.at(i)[0] + m.at(i)[1] + m.at(i)[2]; };
  for (uint32_t i = 0; i < b.size(); ++i)
    if (far(i) > far(corner)) corner = i;
  b.pull({0, 0, -9.81});
  b.set(b.f, corner, b.get(b.f, corner) + Vec{0, 0.01, 0.02});
  settle(b);
  const auto rows = test::read_csv(test::reference_dir() + "/elasticity/fields/condensation_us.csv");
  const std::vector<uint32_t> surface = reference_surface();
  ASSERT_EQ(rows.size(), 650u);
  double worst = 0, most = 0;
  for (size_t r = 1; r < rows.size(); ++r) {
    const uint32_t i = surface[std::stoul(rows[r][0])];
    for (size_t a = 0; a < 3; ++a) {
      const double u = std::strtod(rows[r][1 + a].c_str(), nullptr);
      worst = test::worse(worst, std::abs(b.get(b.x, i)[a] - m.at(i)[a] - u));
      most = std::max(most, std::abs(u));
    }
  }
  EXPECT_LT(worst / most, 1e-10);
}

// K' = K_ss - K_si K_ii^-1 K_is is the inverse of the surface's response at rest: its least eigenvalue is one
// over the largest of that (reference: 0.0169849).
// unsanitized: too slow there; shorter tests run the same code
TEST(Condensed, ResponseOfTheSurface_HasTheEigenvalueOfTheSchurComplement) {
  const Mesh m = read_msh(test::mesh_dir() + "/bars/bar_s3.msh");
  Host host;
  Stepper b(host, condensed(), m, {{"young", 1e5}, {"modes", 5}}, clamp_of(m));
  ASSERT_EQ(b.status, DFM_OK) << host.logged;
  const std::vector<uint32_t> surface = reference_surface();
  b.dt = 1e5;
  b.predict();
  const dfm_kin k = b.now();
  std::vector<double> p(3 * surface.size()), du(p.size());
  for (size_t j = 0; j < p.size(); ++j) p[j] = j % 3 != 1;  // bends along z and a little along y
  double length = 0;
  for (int n = 0; n < 60; ++n) {
    ASSERT_EQ(b.ext->respond(b.self, &k, 649, surface.data(), p.data(), du.data()), DFM_OK);
    length = 0;
    for (const double u : du) length += u * u;
    length = std::sqrt(length);
    for (size_t j = 0; j < p.size(); ++j) p[j] = du[j] / length;
  }
  EXPECT_NEAR(1 / (b.dt * b.dt * length) / 0.016984912321452515, 1, 1e-6);
}

// Pulled at two corners, along the line between them, a free body takes the shape that all its modes give.
TEST(Condensed, FreeBodyPulledAtTwoCorners_HasTheShapeOfAllModes) {
  const Mesh m = kuhn_bar(4, 2, 2, 0.05);
  std::vector<double> x[2];
  for (const int which : {0, 1}) {
    Host host;
    Stepper b(host, type_of("model_reduced", uint32_t(which)), m,
              {{"young", 1e6}, {"modes", which ? 6 : 1000}});
    b.dt = 1e3;
    b.state[0] = 1;
    const Vec pull = (0.1 * b.dt / norm(m.at(44) - m.at(0))) * (m.at(44) - m.at(0));
    for (size_t a = 0; a < 3; ++a) {
      b.p_s[3 * 44 + a] = pull[a];
      b.p_s[a] = -pull[a];
    }
    b.predict();
    b.commit();
    x[which] = b.x_end;
  }
  for (size_t j = 0; j < x[0].size(); ++j) EXPECT_NEAR(x[0][j], x[1][j], 1e-11);
}

TEST(Condensed, Commit_IsPredictAndRespond) {
  const Mesh m = kuhn_bar(4, 2, 2, 0.05);
  for (const uint32_t which : {0u, 1u, 2u, 3u}) {
    const bool held = which % 2;
    Host host;
    Stepper b(host, type_of("model_reduced", 1 + which / 2), m,
              {{"modes", 12}, {"damping_stiffness", 1e-3}, {"damping_mass", 2}},
              held ? clamp_of(m) : std::vector<uint8_t>{});
    for (uint32_t i = 0; i < b.size(); ++i)
      if (!held) b.set(b.v, i, cross({1, 2, -1}, m.at(i)));
    b.pull({0.3, 0, -9.81});
    for (int n = 0; n < 10; ++n) b.step();
    expect_commit_is_predict_and_respond(b, {44, 40, 20, 17, 3, 12});
  }
}

class Reduced : public testing::TestWithParam<uint32_t> {
 protected:
  const dfm_type &type() const { return type_of("model_reduced", GetParam()); }
};
INSTANTIATE_TEST_SUITE_P(CondensedAndBoundary, Reduced, testing::Values(1, 2));

TEST_P(Reduced, FreeSpinningBody_KeepsItsMomentaUnderUnevenForces) {
  const Mesh m = kuhn_bar(4, 2, 1, 0.05);
  Host host;
  Stepper b(host, type(), m, {{"young", 1e6}});
  for (uint32_t i = 0; i < b.size(); ++i) b.set(b.v, i, cross({4, 7, -9}, m.at(i)));
  b.step();
  const Vec p = b.momentum();
  Vec l = b.angular_momentum();
  for (int n = 0; n < 100; ++n) {
    // two forces along the line between two points
    const Vec d = b.get(b.x, 29) - b.get(b.x, 3);
    b.set(b.f, 3, d);
    b.set(b.f, 29, -1.0 * d);
    b.step();
  }
  EXPECT_LT(norm(b.momentum() - p), 1e-12 * norm(p));
  EXPECT_LT(norm(b.angular_momentum() - l), 1e-11 * norm(l));
}

// A body that was deformed by another model goes on from there, with few modes too.
TEST(Condensed, BodyDeformedElsewhere_IsNotMovedAtOnce) {
  const Mesh m = kuhn_bar(4, 2, 2, 0.05);
  for (const uint32_t type : {0u, 1u, 2u}) {
    Host host;
    Stepper b(host, type_of("model_reduced", type), m, {{"modes", 3}});
    std::mt19937 random(5);
    std::uniform_real_distribution<double> u(-1e-3, 1e-3);
    for (uint32_t i = 0; i < b.size(); ++i) b.set(b.x, i, m.at(i) + Vec{u(random), u(random), u(random)});
    b.pull({0, 0, -9.81});
    b.dt = 1e-12;
    b.predict();
    b.commit();
    for (size_t j = 0; j < 4 * size_t(b.size()); ++j) EXPECT_NEAR(b.x_end[j], b.x[j], 1e-12);
  }
}

// unsanitized: too slow there; shorter tests run the same code
TEST(Condensed, AnyInstructionSet_GivesTheSameBits) {
  const Mesh m = kuhn_bar(5, 3, 3, 0.05);
  for (const uint32_t type : {0u, 1u, 2u}) {
    std::vector<std::vector<double>> end;
    for (const char *simd : {"sse2", "avx2", "avx512"}) {
      setenv("DEFORM_SIMD", simd, 1);
      Host host;
      Stepper b(host, type_of("model_reduced", type), m, {{"modes", 13}});
      unsetenv("DEFORM_SIMD");
      b.pull({0.3, 0, -9.81});
      for (int n = 0; n < 20; ++n) {
        b.p_s[4] = 0.01 * (n % 3);
        b.p_s[80] = -0.02;
        b.step();
      }
      end.push_back({b.x, b.x + 4 * b.size()});
    }
    EXPECT_EQ(end[0], end[1]) << type;
    EXPECT_EQ(end[0], end[2]) << type;
  }
}

TEST(Condensed, MeshTooLarge_IsRefusedWithTheModelThatCan) {
  const Mesh m = kuhn_bar(17, 17, 17, 0.01);
  Host host;
  const Stepper b(host, condensed(), m);
  EXPECT_EQ(b.status, DFM_E_ARG);
  EXPECT_NE(host.logged.find("use the model modal, or a coarser mesh"), std::string::npos) << host.logged;
  EXPECT_EQ(host.live, 0u);
}

TEST(Condensed, RefusedMemory_LeavesNothingBehind) {
  const Mesh m = kuhn_bar(2, 1, 1, 0.05);
  refuse_each_allocation([&](Host &host) { return Stepper(host, condensed(), m); });
}

}  // namespace
