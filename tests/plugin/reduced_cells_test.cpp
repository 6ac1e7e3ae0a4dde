// Modes and condensation from second-order tetrahedra, hexahedra and cells of a lattice: frequencies of a bar
// against the continuum, the state at rest against linear_fem, a free body, energies.
#include "cell_meshes.h"
#include "stepper_host.h"

namespace {

using namespace stepper_test;

constexpr double kYoung = 1e7;

const dfm_type &reduced(uint32_t which) { return type_of("model_reduced", which); }

struct Kind {
  const char *name;
  Mesh mesh;  // a bar, at least twice as long as wide
};
std::vector<Kind> kinds() {
  Mesh cut = brick_bar(6, 2, 2, {0.1, 0.1, 0.1});
  const std::array<double, 3> whole = part_rule(1), part = part_rule(0.3);
  for (uint32_t c = 0; c < cut.ncell(); ++c)  // the upper layer is in part material
    for (uint32_t q = 0; q < 27; ++q)
      cut.inside.push_back(whole[q % 3] * whole[q / 3 % 3] * (c % 2 ? part : whole)[q / 9]);
  return {
      {"second-order tetrahedra", second_order(kuhn_bar(6, 2, 2, 0.1, 0.1), 0.02)},
      {"hexahedra", brick_bar(6, 2, 2, {0.1, 0.1, 0.1}, 0.2)},
      {"hexahedra of 20 points", with_middles(brick_bar(4, 1, 1, {0.15, 0.2, 0.2}), DFM_CELL_HEX20, 0.02)},
      {"hexahedra of 27 points", with_middles(brick_bar(4, 1, 1, {0.15, 0.2, 0.2}), DFM_CELL_HEX27, 0.02)},
      {"lattice", std::move(cut)}};
}

// Bits of the points near x = 0: curved edges leave the plane.
std::vector<uint8_t> clamp_near(const Mesh &m) {
  std::vector<uint8_t> fixed(m.npoint(), 0);
  for (uint32_t i = 0; i < m.npoint(); ++i)
    if (m.at(i)[0] < 0.01) fixed[i] = 7;
  return fixed;
}

// Deviations of the first five frequencies of a bar of 1 x 0.1 x 0.1 m from the continuum's: two of bending,
// two of the second bending, torsion (the table of doc/models/linear_fem.md).
std::vector<double> errors_of(const Mesh &m) {
  Host host;
  const Stepper b(host, reduced(0), m, {{"young", kYoung}, {"modes", 8}}, clamp_of(m));
  EXPECT_EQ(b.status, DFM_OK) << host.logged;
  std::vector<double> out = frequencies(host.logged);
  const double exact[] = {1.611, 1.611, 9.662, 9.662, 14.27};
  out.resize(5);
  for (size_t k = 0; k < 5; ++k) out[k] = out[k] / exact[k] - 1;
  return out;
}

TEST(ReducedCells, FrequenciesOfAClampedBar_AreNearerThanThoseOfTetrahedraWithTheSamePoints) {
  const Mesh first = kuhn_bar(20, 2, 2, 0.05), second = second_order(kuhn_bar(10, 1, 1, 0.1)),
             bricks = brick_bar(20, 2, 2, {0.05, 0.05, 0.05});
  ASSERT_EQ(first.npoint(), second.npoint());
  ASSERT_EQ(first.npoint(), bricks.npoint());
  const std::vector<double> of_first = errors_of(first);
  for (const Mesh *m : {&second, &bricks}) {
    const std::vector<double> error = errors_of(*m);
    for (size_t k = 0; k < 4; ++k) {
      EXPECT_LT(std::abs(error[k]), 0.015) << m->kind << " mode " << k;
      EXPECT_LT(std::abs(error[k]), 0.1 * std::abs(of_first[k])) << m->kind << " mode " << k;
    }
    EXPECT_LT(std::abs(error[4]), 0.2) << m->kind;  // lumped masses: more inertia about the axis
  }
}

// linear_fem resists the shape at rest with the loads, and its energy is that of the reduced body. With all
// modes `modal` has that shape too.
// unsanitized: too slow there; shorter tests run the same code
TEST(ReducedCells, ShapeAtRestUnderUnevenLoads_IsThatOfLinearFem) {
  for (const Kind &kind : kinds())
    for (const uint32_t which : {0u, 1u}) {
      const Mesh &m = kind.mesh;
      const std::vector<uint8_t> fixed = clamp_near(m);
      Host host;
      Stepper b(host, reduced(which), m, {{"young", kYoung}, {"modes", which ? 5.0 : 1000}}, fixed);
      ASSERT_EQ(b.status, DFM_OK) << host.logged;
      b.pull({0, 0, -9.81});
      b.set(b.f, b.size() / 2, b.get(b.f, b.size() / 2) + Vec{3, 1, 2});
      std::vector<double> load(b.f, b.f + 4 * size_t(b.size()));
      b.dt = 1e5;
      for (int n = 0; n < 3; ++n) b.step();
      const dfm_type &linear = type_of("model_linear_fem");
      ModelInstance full(host, linear, m, {kYoung, 0.3, 0, 0});
      std::copy(b.x, b.x + load.size(), full.x);
      full.forces();
      const double scale = full.largest_force();
      double moved = 0;
      for (uint32_t i = 0; i < b.size(); ++i) {
        moved = std::max(moved, norm(b.get(b.x, i) - m.at(i)));
        if (fixed[i]) continue;
        EXPECT_LT(norm(full.get(full.f, i) + Vec{load[4 * i], load[4 * i + 1], load[4 * i + 2]}),
                  1e-8 * scale)
            << kind.name << " " << which << " point " << i;
      }
      EXPECT_GT(moved, 1e-4) << kind.name;
      EXPECT_NEAR(b.energy() / full.energy(), 1, 1e-9) << kind.name << " " << which;
    }
}

TEST(ReducedCells, FewModes_SagAsLinearFemButForWhatTheyLeaveOut) {
  for (const Kind &kind : kinds()) {
    double sag[2] = {};
    for (const uint32_t which : {0u, 1u}) {
      Host host;
      Stepper b(host, reduced(which), kind.mesh, {{"young", kYoung}, {"modes", 12}}, clamp_near(kind.mesh));
      b.pull({0, 0, -9.81});
      b.dt = 1e5;
      for (int n = 0; n < 3; ++n) b.step();
      for (uint32_t i = 0; i < b.size(); ++i)
        sag[which] = std::max(sag[which], kind.mesh.at(i)[2] - b.get(b.x, i)[2]);
    }
    EXPECT_NEAR(sag[0] / sag[1], 1, 0.02) << kind.name;
  }
}

TEST(ReducedCells, CommitIsPredictAndRespond_AndFreeBodiesKeepTheirMomenta) {
  for (const Kind &kind : kinds())
    for (const uint32_t which : {0u, 1u}) {
      Host host;
      Stepper b(host, reduced(which), kind.mesh, {{"young", kYoung}, {"modes", 12}});
      ASSERT_EQ(b.status, DFM_OK) << kind.name << host.logged;
      for (uint32_t i = 0; i < b.size(); ++i) b.set(b.v, i, cross({4, 7, -9}, kind.mesh.at(i)));
      b.step();
      const Vec p = b.momentum(), l = b.angular_momentum();
      for (int n = 0; n < 20; ++n) b.step();
      EXPECT_LT(norm(b.momentum() - p), 1e-12 * norm(p)) << kind.name;
      EXPECT_LT(norm(b.angular_momentum() - l), 1e-11 * norm(l)) << kind.name;
      expect_commit_is_predict_and_respond(b, {44, 40, 20, 17, 3, 12});
    }
}

// Uniform strain: every cell has the stress and the energy of the material.
TEST(ReducedCells, UniformStrain_HasItsStressAndEnergyInEveryCell) {
  for (const Kind &kind : kinds()) {
    const Mesh &m = kind.mesh;
    Host host;
    Stepper b(host, reduced(1), m, {{"young", kYoung}, {"poisson", 0.25}});
    const double stretch = 1e-3, mu = kYoung / 2.5, lambda = mu;  // poisson 1/4
    for (uint32_t i = 0; i < b.size(); ++i)
      b.set(b.x, i, {(1 + stretch) * m.at(i)[0], m.at(i)[1], m.at(i)[2]});
    const std::vector<double> stress = stress_of_cells(b);
    std::vector<double> density(m.ncell());
    const dfm_kin k = b.kin();
    const auto *ext = static_cast<const dfm_cell_energy *>(b.ops->extension(b.self, DFM_EXT_CELL_ENERGY));
    ASSERT_EQ(ext->cell_energy(b.self, &k, density.data()), DFM_OK);
    for (uint32_t c = 0; c < m.ncell(); ++c) {
      EXPECT_NEAR(stress[6 * c] / (3 * mu * stretch), 1, 1e-6) << kind.name;
      EXPECT_NEAR(stress[6 * c + 1] / (lambda * stretch), 1, 1e-6) << kind.name;
      EXPECT_NEAR(density[c] / (1.5 * mu * stretch * stretch), 1, 1e-6) << kind.name;
    }
  }
}

TEST(ReducedCells, CellsThatAreFlatAtRest_AreRefused) {
  Mesh m = brick_bar(2, 1, 1, {0.1, 0.1, 0.1});
  std::swap(m.cells[0], m.cells[1]);
  Host host;
  const Stepper b(host, reduced(1), m);
  EXPECT_EQ(b.status, DFM_E_ARG);
  EXPECT_NE(host.logged.find("inverted or flat at rest"), std::string::npos) << host.logged;
  EXPECT_EQ(host.live, 0u);
}

TEST(ReducedCells, BoundaryElements_TakeFirstOrderTetrahedraAlone) {
  Host host;
  const Stepper b(host, reduced(2), brick_bar(2, 1, 1, {0.1, 0.1, 0.1}));
  EXPECT_EQ(b.status, DFM_E_ARG);
  EXPECT_NE(host.logged.find("must be tetrahedra"), std::string::npos) << host.logged;
}

}  // namespace
