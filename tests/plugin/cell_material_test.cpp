// Plastic flow and fibers at the points of second-order tetrahedra, hexahedra and cells of a lattice: under a
// uniform strain as a first-order tetrahedron, beyond it forces against potential, tangent and bound.
#include "cell_meshes.h"
#include "corot_host.h"
#include "model_operator.h"
#include "model_tangent.h"

namespace corot_test {
namespace {

constexpr double kYoung = 1e5, kYield = 2e3;

struct Case {
  const char *name;
  Mesh mesh;
};
const std::vector<Case> &meshes() {
  static const std::vector<Case> all = [] {
    Mesh whole = brick_bar(2, 2, 2, {0.1, 0.1, 0.1});
    const std::array<double, 3> rule = part_rule(1);
    for (uint32_t n = 0; n < 27 * whole.ncell(); ++n)
      whole.inside.push_back(rule[n % 3] * rule[n / 3 % 3] * rule[n / 9 % 3]);
    return std::vector<Case>{
        {"second-order tetrahedra", second_order(kuhn_bar(2, 2, 2, 0.1, 0.15), 0.03)},
        {"hexahedra", brick_bar(3, 3, 3, {0.1, 0.12, 0.09}, 0.25)},
        {"hexahedra of 20 points", with_middles(brick_bar(2, 2, 2, {0.1, 0.12, 0.09}), DFM_CELL_HEX20, 0.03)},
        {"hexahedra of 27 points", with_middles(brick_bar(2, 2, 2, {0.1, 0.12, 0.09}), DFM_CELL_HEX27, 0.03)},
        {"whole cells of a lattice", whole},
        {"cut cells of a lattice", cut_bars()}};
  }();
  return all;
}

Params soft(Params more = {}) {
  Params p = {{"young", {kYoung}}, {"poisson", {0.3}}, {"yield", {kYield}}};
  for (const auto &[key, value] : more) p[key] = value;
  return p;
}
const std::vector<Params> &flows() {
  static const std::vector<Params> all = {soft(), soft({{"hardening", {3e4}}}),
                                          soft({{"creep", {300}}, {"hardening", {3e4}}}),
                                          soft({{"plastic_limit", {0.05}}})};
  return all;
}
Params fibers(Params more = {}) {
  Params p = {{"young", {kYoung}},
              {"poisson", {0.3}},
              {"anisotropy_young", {5 * kYoung}},
              {"anisotropy_shear", {2 * kYoung}},
              {"anisotropy_axis", {1, 2, -0.5}}};
  for (const auto &[key, value] : more) p[key] = value;
  return p;
}

// x = R (I + by A) X
void strain(Instance &b, double by, double angle) {
  constexpr double kA[3][3] = {{1, 0.4, 0}, {0.2, -0.5, 0.1}, {0, -0.3, -0.2}};
  for (uint32_t i = 0; i < b.size(); ++i) {
    const Vec x = b.mesh.at(i);
    Vec at = x;
    for (size_t r = 0; r < 3; ++r)
      for (size_t c = 0; c < 3; ++c) at[r] += by * kA[r][c] * x[c];
    b.set(b.x, i, rotate(at, {0, 0.6, 0.8}, angle));
  }
}
constexpr double kStrain = 0.05;

// Pulled, pushed, and let go to a part, turned meanwhile: every point flows as the one of a tetrahedron.
TEST(CellMaterial, UniformStrain_FlowsAsAFirstOrderTetrahedron) {
  for (const Case &kind : meshes())
    for (Params p : flows()) {
      p["yield"][0] *= kStrain / 0.1;
      if (p.count("plastic_limit")) p["plastic_limit"] = {0.5 * kStrain};
      Host host;
      Instance one(host, irregular_tet(), p), b(host, kind.mesh, p);
      ASSERT_EQ(b.status, DFM_OK) << host.logged;
      double angle = 0;
      for (const double by : {1.0, -1.5, 0.7, 0.2}) {
        for (Instance *of : {&one, &b}) {
          strain(*of, by * kStrain, angle);
          of->forces_and_step();
        }
        angle += 0.7;
        const std::vector<double> wanted = stress_of_cells(one), stress = stress_of_cells(b);
        double most = 0;
        for (const double s : wanted) most = std::max(most, std::abs(s));
        for (size_t n = 0; n < stress.size(); ++n)
          EXPECT_NEAR(stress[n], wanted[n % 6], 1e-9 * most) << kind.name << ", " << p.rbegin()->first;
        for (size_t n = 0; n < b.state.size(); ++n) {
          if (b.state[n / 7 * 7 + 6] == 0) continue;  // a cut cell has one point
          EXPECT_NEAR(b.state[n], one.state[n % 7], 1e-9 * kStrain) << kind.name;
        }
        const double density = energy_of_cells(one) / one.mesh.volume(0);
        const auto *ext = static_cast<const dfm_cell_energy *>(b.ops->extension(b.self, DFM_EXT_CELL_ENERGY));
        std::vector<double> each(b.mesh.ncell());
        const dfm_kin k = b.kin();
        ASSERT_EQ(ext->cell_energy(b.self, &k, each.data()), DFM_OK);
        for (const double w : each) EXPECT_NEAR(w / density, 1, 1e-6) << kind.name;
      }
      EXPECT_GT(one.state[6], 0);
      size_t flowing = 0;
      for (size_t n = 6; n < b.state.size(); n += 7) flowing += b.state[n] > 0;
      const uint32_t points = kind.mesh.nodes() > 10                               ? 27
                              : kind.mesh.inside.empty() || kind.mesh.ncell() == 8 ? 8
                                                                                   : 1;
      EXPECT_EQ(flowing, points * b.mesh.ncell());
    }
}

TEST(CellMaterial, UniformStrain_HasTheStressOfAFirstOrderTetrahedronWithFibers) {
  for (const Case &kind : meshes()) {
    Host host;
    Instance one(host, irregular_tet(), fibers()), b(host, kind.mesh, fibers());
    ASSERT_EQ(b.status, DFM_OK) << host.logged;
    for (Instance *of : {&one, &b}) strain(*of, kStrain, 1.1);
    const std::vector<double> wanted = stress_of_cells(one), stress = stress_of_cells(b);
    for (size_t n = 0; n < stress.size(); ++n)
      EXPECT_NEAR(stress[n], wanted[n % 6], 1e-9 * 5 * kYoung) << kind.name;
  }
}

TEST(CellMaterial, Forces_AreTheGradientOfThePotentialAndHaveNoMoment) {
  for (const Case &kind : meshes())
    for (std::vector<Params> all = flows(); const Params &p : {all[0], all[1], all[2], all[3], fibers()}) {
      Host host;
      Instance b(host, kind.mesh, p);
      strain(b, 0.02, 1.2);
      b.work(0.004);
      b.shake(0.004, 0, 9);
      expect_force_is_gradient(b, 1e-7, 1e-5, std::string(kind.name) + ", " + p.rbegin()->first);
      if (b.state.empty()) continue;
      const double before = b.energy();
      b.forces_and_step();
      EXPECT_LE(b.energy(), before * (1 + 1e-12)) << kind.name;
      expect_no_force_or_torque(b, kind.name);
    }
}

// Small strain, where what the tangent leaves out is small.
// unsanitized: too slow there; shorter tests run the same code
TEST(CellMaterial, Tangent_IsThatOfTheFlowAndOfFibers) {
  for (const Case &kind : meshes()) {
    for (Params p : flows()) {
      Host host;
      p["yield"] = {1e-4 * kYield};
      if (p.count("plastic_limit")) p["plastic_limit"] = {3e-6};
      Instance b(host, kind.mesh, p), elastic(host, kind.mesh, {{"young", {kYoung}}});
      b.work(1e-6);
      b.shake(1e-6, 0, 11);
      std::copy(b.x, b.x + 4 * b.size(), elastic.x);
      const Dense k = tangent(b, 1, 0), whole = tangent(elastic, 1, 0);
      EXPECT_LT(largest_difference(k, differences(b, b.x, 1e-10)), 3e-3 * largest(whole))
          << kind.name << ", " << p.rbegin()->first;
      EXPECT_TRUE(below(k, 1e-9 * largest(whole))) << kind.name;
      if (!p.count("plastic_limit")) {
        EXPECT_GT(largest_difference(k, whole), 0.03 * largest(whole)) << kind.name;
      }
    }
    Host host;
    Instance b(host, kind.mesh, fibers());
    const Dense k = tangent(b, 1, 0);
    EXPECT_LT(largest_difference(k, differences(b, b.x, 1e-7)), 1e-6 * largest(k)) << kind.name;
    EXPECT_TRUE(below(k, 1e-9 * largest(k))) << kind.name;
  }
}

// unsanitized: too slow there; shorter tests run the same code
TEST(CellMaterial, Bound_IsAboveTheLargestEigenvalue) {
  for (const Case &kind : meshes())
    for (const Params &p : {soft({{"damping_stiffness", {1e-4}}}), fibers()})
      for (const double amount : {0.0, 4e-3}) {
        Host host;
        Instance b(host, kind.mesh, p);
        strain(b, 0.02, 0.7);
        if (p.count("yield")) b.work(0.004);
        b.shake(amount, 0);
        const double most = Operator(b).largest(b.bound(), 100);
        EXPECT_LT(most, 4.0) << kind.name << ", " << p.rbegin()->first;
        if (!p.count("yield") && amount == 0) {
          EXPECT_GT(most, 0.5) << kind.name;
        }
      }
}

TEST(CellMaterial, BelowYield_IsTheElasticBodyBitForBit) {
  for (const Case &kind : meshes()) {
    Host host;
    const Params elastic = {{"young", {kYoung}}, {"damping_stiffness", {1e-3}}};
    Params strong = elastic;
    strong["yield"] = {1e9};
    Instance a(host, kind.mesh, elastic), b(host, kind.mesh, strong);
    for (Instance *i : {&a, &b}) {
      i->shake(0.005, 1);
      for (int n = 0; n < 10; ++n) {
        i->forces_and_step();
        i->move(1e-5);
      }
    }
    EXPECT_EQ(std::vector<double>(a.x, a.x + 4 * a.size()), std::vector<double>(b.x, b.x + 4 * b.size()));
    EXPECT_EQ(a.energy(), b.energy());
    EXPECT_EQ(a.bound(), b.bound());
  }
}

// One hexahedron across a bar under a pull along the fibers, and across them.
TEST(CellMaterial, BarAlongItsFibers_IsStifferByTheirModulus) {
  for (const bool second : {false, true})
    for (const double along : {1.0, 0.0}) {
      const Mesh m = second ? second_order(kuhn_bar(4, 1, 1, 0.1)) : brick_bar(4, 1, 1, {0.1, 0.1, 0.1});
      Host host;
      Instance b(host, m, fibers({{"anisotropy_axis", {along, 0, 1 - along}}, {"anisotropy_shear", {-1}}}));
      const Dense k = tangent(b, 1, 0);
      Dense part(3 * m.npoint(), 3 * m.npoint());
      std::vector<double> right(3 * m.npoint(), 0.0);
      const auto held = [&](uint32_t j) { return m.rest[j / 3 * 3 + j % 3] < 1e-9; };
      const auto is_end = [&](uint32_t j) { return j % 3 == 0 && m.rest[j] > 0.4 - 1e-9; };
      for (uint32_t r = 0; r < right.size(); ++r) {
        if (held(r) || is_end(r)) {
          part(r, r) = 1;
          right[r] = is_end(r) ? 4e-4 : 0;
          continue;
        }
        for (uint32_t c = 0; c < right.size(); ++c) part(r, c) = k(r, c);
      }
      const std::vector<double> force = k * test::solved(part, right);
      double sum = 0;
      for (uint32_t j = 0; j < force.size(); ++j) sum -= is_end(j) ? force[j] : 0;
      EXPECT_NEAR(sum / (1e-3 * kYoung * 0.01), along > 0 ? 5 : 1, 1e-6) << second;
    }
}

// Moment over that of a bar of an ideally plastic material, bent to ten times the curvature at which it
// yields (the hardening adds 1 % of the stress at the surface): ends stay plane, sides are free.
double plastic_moment(const Mesh &m) {
  constexpr double kSide = 0.1, kStrain = 1e-4, kMost = 10;
  Host host;
  Instance b(host, m, soft({{"yield", {kYoung * kStrain}}, {"hardening", {1e-3 * kYoung}}}));
  std::vector<uint32_t> free;
  const auto on = [&](uint32_t i, size_t a, double at) { return std::abs(m.at(i)[a] - at) < 1e-9; };
  for (uint32_t i = 0; i < m.npoint(); ++i) {
    const bool below = on(i, 0, 0) && on(i, 1, 0) && on(i, 2, 0),
               above = on(i, 0, 0) && on(i, 1, 0) && on(i, 2, kSide);
    if (!on(i, 0, 0) && !on(i, 0, kSide)) free.push_back(3 * i);
    if (!below && !above) free.push_back(3 * i + 1);
    if (!below) free.push_back(3 * i + 2);
  }
  double out = 0;
  for (int step = 1; step <= 40; ++step) {
    const double curvature = kMost * kStrain / (kSide / 2) * step / 40;
    for (uint32_t i = 0; i < m.npoint(); ++i)
      if (on(i, 0, kSide)) b.x[4 * i] = kSide * (1 - curvature * (m.at(i)[2] - kSide / 2));
    int n = 0;
    for (; n < 20; ++n) {
      b.forces();
      const Dense k = tangent(b, 1, 0);
      Dense part(free.size(), free.size());
      std::vector<double> right;
      double most = 0;
      for (size_t r = 0; r < free.size(); ++r) {
        right.push_back(b.f[4 * (free[r] / 3) + free[r] % 3]);
        most = std::max(most, std::abs(right.back()));
        for (size_t c = 0; c < free.size(); ++c) part(r, c) = -k(free[r], free[c]);
      }
      if (most < 1e-8 * b.largest_force()) break;
      const std::vector<double> u = test::solved(part, right);
      for (size_t r = 0; r < free.size(); ++r) b.x[4 * (free[r] / 3) + free[r] % 3] += u[r];
    }
    EXPECT_LT(n, 20) << "no equilibrium";
    b.forces_and_step();
  }
  for (uint32_t i = 0; i < m.npoint(); ++i)
    if (on(i, 0, kSide)) out += b.f[4 * i] * (m.at(i)[2] - kSide / 2);
  const double ideal = kYoung * kStrain * std::pow(kSide, 3) / 4 * (1 - 1 / (3 * kMost * kMost));
  return out / ideal;
}

// By cells across: doc/models/corotational_fem.md.
// unsanitized: dense solves; the other tests run the same code
TEST(CellMaterial, BarBentFarBeyondYield_HasThePlasticMomentOfItsCells) {
  const auto bricks = [](uint32_t n) { return brick_bar(n, n, n, {0.1 / n, 0.1 / n, 0.1 / n}); };
  EXPECT_NEAR(plastic_moment(bricks(1)), 1.33, 0.01);
  EXPECT_NEAR(plastic_moment(bricks(2)), 1.09, 0.01);
  EXPECT_NEAR(plastic_moment(bricks(4)), 1.03, 0.01);
  EXPECT_NEAR(plastic_moment(second_order(kuhn_bar(1, 1, 1, 0.1))), 0.94, 0.01);
  EXPECT_NEAR(plastic_moment(second_order(kuhn_bar(2, 2, 2, 0.05))), 1.00, 0.01);
  EXPECT_NEAR(plastic_moment(kuhn_bar(2, 2, 2, 0.05)), 1.76, 0.01);
  EXPECT_NEAR(plastic_moment(kuhn_bar(4, 4, 4, 0.025)), 1.48, 0.01);
}

TEST(CellMaterial, ValuesByCell_AreThoseOfTheCells) {
  const Mesh m = brick_bar(4, 1, 1, {0.1, 0.1, 0.1});
  Host host;
  const Fields own = {{"yield", {50, 50, 0, 1e9}}};
  Instance b(host, m, soft({{"poisson", {0.0}}}), 4, own);
  ASSERT_EQ(b.status, DFM_OK) << host.logged;
  for (uint32_t i = 0; i < b.size(); ++i) b.set(b.x, i, {1.001 * m.at(i)[0], m.at(i)[1], m.at(i)[2]});
  b.forces_and_step();
  for (uint32_t c = 0; c < 4; ++c) EXPECT_EQ(b.state[56 * c + 6] > 0, c < 2) << c;
  const Fields axes = {{"anisotropy_axis", {1, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1}}};
  Instance f(host, m, fibers({{"poisson", {0.0}}, {"anisotropy_poisson", {0.0}}}), 4, axes);
  std::copy(b.x, b.x + 4 * b.size(), f.x);
  const std::vector<double> stress = stress_of_cells(f);
  for (uint32_t c = 0; c < 4; ++c) EXPECT_NEAR(stress[6 * c], c < 2 ? 500 : 100, 1) << c;
}

// Pieces in any cut and order give the same bits, of the state too.
TEST(CellMaterial, Flow_DoesNotDependOnTheDivisionOfTheWork) {
  Host one, many;
  many.shuffle = 1;
  const Mesh m = brick_bar(12, 8, 8, {0.1, 0.1, 0.1});
  Instance a(one, m, soft()), b(many, m, soft());
  for (Instance *i : {&a, &b}) {
    i->shake(1e-2, 1);
    i->forces_and_step();
  }
  EXPECT_EQ(std::vector<double>(a.f, a.f + 4 * a.size()), std::vector<double>(b.f, b.f + 4 * b.size()));
  EXPECT_EQ(a.state, b.state);
  EXPECT_GT(*std::max_element(a.state.begin(), a.state.end()), 0);
}

TEST(CellMaterial, RefusedMemory_LeavesNothingBehind) {
  const Mesh m = brick_bar(2, 1, 1, {0.1, 0.1, 0.1});
  refuse_each_allocation([&](Host &host) { return Instance(host, m, soft()); });
}

TEST(CellMaterial, Refusals_GiveTheReason) {
  const Mesh m = brick_bar(1, 1, 1, {0.1, 0.1, 0.1});
  const auto refused = [&](const Params &p, const char *word) {
    Host host;
    Instance b(host, m, p);
    EXPECT_EQ(b.status, DFM_E_ARG) << word;
    EXPECT_NE(host.logged.find(word), std::string::npos) << host.logged;
    EXPECT_EQ(host.live, 0u);
  };
  refused(soft({{"anisotropy_young", {1e6}}}),
          "yield excludes anisotropy and energies other than corotational");
  refused(fibers({{"anisotropy_poisson", {9}}}), "no positive energy");
  refused(soft({{"creep", {-0.5}}}), "creep");
  Host host;
  Instance elastic(host, m);
  elastic.shake(1e-2, 1);
  const auto forces = [&] {
    elastic.forces();
    return std::vector<double>(elastic.f, elastic.f + 4 * elastic.size());
  };
  const std::vector<double> values = Instance::row(soft({{"young", {2 * kYoung}}})), before = forces();
  EXPECT_EQ(elastic.ops->set_params(elastic.self, values.data()), DFM_E_ARG);
  EXPECT_NE(host.logged.find("created without yield"), std::string::npos);
  EXPECT_EQ(forces(), before);
  Instance b(host, m, soft());
  dfm_kin k = b.kin();
  k.state = nullptr;
  EXPECT_EQ(b.ops->add_forces(b.self, &k, b.f), DFM_E_STATE);
  const auto *idle = static_cast<const dfm_idle *>(b.ops->extension(b.self, DFM_EXT_IDLE));
  const auto *no = static_cast<const dfm_idle *>(elastic.ops->extension(elastic.self, DFM_EXT_IDLE));
  uint32_t hardening = 0;
  while (std::strcmp(plugin_type().params[hardening].key, "hardening")) ++hardening;
  EXPECT_EQ(idle->why(b.self, hardening), nullptr);
  EXPECT_STREQ(no->why(elastic.self, hardening), "yield is 0");
}

}  // namespace
}  // namespace corot_test
