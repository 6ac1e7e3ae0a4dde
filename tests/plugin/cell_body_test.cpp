// Second-order tetrahedra and hexahedra of the two finite element models: patch test, rotations, forces
// against energy and tangent, the step bound, and bars against beam theory.
#include "cell_meshes.h"
#include "model_operator.h"
#include "model_tangent.h"

namespace model_test {
namespace {

struct Case {
  const char *module;
  uint32_t kind;
  bool cut = false;  // cells in part material
  Mesh mesh() const;
  bool turns() const { return std::strcmp(module, "model_corotational_fem") == 0; }
};
std::string name_of(const testing::TestParamInfo<Case> &info) {
  return std::string(info.param.turns() ? "Corotational" : "Linear") +
         (info.param.cut                      ? "Cut"
          : info.param.kind == DFM_CELL_TET10 ? "Tet10"
          : info.param.kind == DFM_CELL_HEX8  ? "Hex8"
          : info.param.kind == DFM_CELL_HEX20 ? "Hex20"
                                              : "Hex27");
}
const dfm_type &type_by(const char *module) {
  static std::map<std::string, const dfm_type *> known;
  const dfm_type *&at = known[module];
  if (!at) at = &type_of(module);
  return *at;
}
// Defaults but for the material, which both models begin with.
std::vector<double> material(const dfm_type &type, double young, double poisson, double stiffness = 0,
                             double drag = 0) {
  std::vector<double> out = {young, poisson, stiffness, drag};
  for (uint32_t n = 4; n < type.nparam; ++n) out.insert(out.end(), type.params[n].width, type.params[n].def);
  return out;
}

constexpr double kYoung = 1e5;

struct Body : ModelInstance {
  Body(Host &h, const Case &of, const Mesh &m, double poisson = 0.3, double stiffness = 0, double drag = 0)
      : ModelInstance(h, type_by(of.module), m,
                      material(type_by(of.module), kYoung, poisson, stiffness, drag)) {}
  // x = R (X + A X)
  void place(const double (&a)[3][3], Vec axis = {0, 0, 1}, double angle = 0) {
    for (uint32_t i = 0; i < size(); ++i) {
      const Vec rest = mesh.at(i);
      Vec at = rest;
      for (size_t r = 0; r < 3; ++r)
        for (size_t c = 0; c < 3; ++c) at[r] += a[r][c] * rest[c];
      set(x, i,
          std::cos(angle) * at + std::sin(angle) * cross(axis, at) +
              (1 - std::cos(angle)) * dot(axis, at) * axis);
    }
  }
};

// A block with inner points, distorted; of second order with curved edges too.
Mesh distorted(uint32_t kind) {
  if (kind == DFM_CELL_HEX8) return brick_bar(3, 3, 3, {0.1, 0.12, 0.09}, 0.25);
  if (kind != DFM_CELL_TET10) return with_middles(brick_bar(3, 2, 2, {0.1, 0.12, 0.09}, 0.15), kind, 0.03);
  return second_order(kuhn_bar(2, 2, 2, 0.1, 0.15), 0.03);
}
bool inner(const Mesh &m, uint32_t i) {
  Vec lo = m.at(0), hi = m.at(0);
  for (uint32_t k = 0; k < m.npoint(); ++k)
    for (size_t a = 0; a < 3; ++a) {
      lo[a] = std::min(lo[a], m.at(k)[a]);
      hi[a] = std::max(hi[a], m.at(k)[a]);
    }
  for (size_t a = 0; a < 3; ++a)
    if (m.at(i)[a] < lo[a] + 0.02 || m.at(i)[a] > hi[a] - 0.02) return false;
  return true;
}

Mesh Case::mesh() const { return cut ? cut_bars() : distorted(kind); }

class CellBody : public testing::TestWithParam<Case> {};
INSTANTIATE_TEST_SUITE_P(
    Both, CellBody,
    testing::Values(Case{"model_linear_fem", DFM_CELL_TET10}, Case{"model_linear_fem", DFM_CELL_HEX8},
                    Case{"model_linear_fem", DFM_CELL_HEX8, true}, Case{"model_linear_fem", DFM_CELL_HEX20},
                    Case{"model_linear_fem", DFM_CELL_HEX27}, Case{"model_corotational_fem", DFM_CELL_HEX20},
                    Case{"model_corotational_fem", DFM_CELL_HEX27},
                    Case{"model_corotational_fem", DFM_CELL_TET10},
                    Case{"model_corotational_fem", DFM_CELL_HEX8},
                    Case{"model_corotational_fem", DFM_CELL_HEX8, true}),
    name_of);
// Of others the material ends inside the cells, so inner points carry its border.
class WholeCellBody : public CellBody {};
INSTANTIATE_TEST_SUITE_P(Both, WholeCellBody,
                         testing::Values(Case{"model_linear_fem", DFM_CELL_TET10},
                                         Case{"model_linear_fem", DFM_CELL_HEX8},
                                         Case{"model_linear_fem", DFM_CELL_HEX20},
                                         Case{"model_linear_fem", DFM_CELL_HEX27},
                                         Case{"model_corotational_fem", DFM_CELL_TET10},
                                         Case{"model_corotational_fem", DFM_CELL_HEX8},
                                         Case{"model_corotational_fem", DFM_CELL_HEX20},
                                         Case{"model_corotational_fem", DFM_CELL_HEX27}),
                         name_of);

constexpr double kNone[3][3] = {};
constexpr double kA[3][3] = {{1e-2, 4e-3, 0}, {2e-3, -5e-3, 1e-3}, {0, -3e-3, 7e-3}};

// Every inner point of a uniform strain is in balance, whatever the cells' shapes, and the stress is that of
// the strain.
TEST_P(WholeCellBody, UniformStrain_LeavesInnerPointsInBalance) {
  for (double poisson : {0.0, 0.3, 0.499}) {
    Host host;
    Body b(host, GetParam(), GetParam().mesh(), poisson);
    ASSERT_EQ(b.status, DFM_OK) << host.logged;
    b.place(kA);
    b.forces();
    const double scale = b.largest_force();
    uint32_t n = 0;
    for (uint32_t i = 0; i < b.size(); ++i)
      if (inner(b.mesh, i)) {
        EXPECT_LT(norm(b.get(b.f, i)), 1e-12 * scale) << "point " << i << ", poisson " << poisson;
        ++n;
      }
    EXPECT_GE(n, 8u);
    if (GetParam().turns()) continue;
    const std::vector<double> stress = stress_of_cells(b);
    const double lambda = kYoung * poisson / ((1 + poisson) * (1 - 2 * poisson)),
                 mu = kYoung / 2 / (1 + poisson);
    for (size_t k = 0; k < stress.size(); ++k) {
      const int r = kStressRow[k % 6], c = kStressColumn[k % 6];
      EXPECT_NEAR(stress[k], mu * (kA[r][c] + kA[c][r]) + (r == c ? lambda * 0.012 : 0),
                  1e-9 * lambda + 1e-8);
    }
  }
}

TEST_P(CellBody, RigidRotation_CallsForNoForceWhereFramesTurn) {
  if (!GetParam().turns()) return;
  Host host;
  Body b(host, GetParam(), GetParam().mesh());
  b.place(kA);
  b.forces();
  const double scale = b.largest_force() / 1e-2;  // of a strain of one
  for (double angle : {0.1, 1.0, 3.0}) {
    b.place(kNone, {0.6, 0, 0.8}, angle);
    b.forces();
    EXPECT_LT(b.largest_force(), 1e-12 * scale) << angle;
    EXPECT_LT(b.energy(), 1e-20 * scale);
  }
}

TEST_P(CellBody, Forces_AreTheGradientOfTheEnergyAndHaveNoMoment) {
  Host host;
  Body b(host, GetParam(), GetParam().mesh());
  if (GetParam().turns()) b.place(kA, {0.6, 0, 0.8}, 1.2);
  b.shake(6e-3, 0);
  expect_force_is_gradient(b, 1e-6, 1e-7, "shaken");
  Vec sum{}, moment{};
  for (uint32_t i = 0; i < b.size(); ++i) {
    sum = sum + b.get(b.f, i);
    moment = moment + cross(b.get(b.x, i), b.get(b.f, i));
  }
  EXPECT_LT(norm(sum), 1e-11 * b.largest_force());
  if (GetParam().turns()) {
    EXPECT_LT(norm(moment), 1e-11 * b.largest_force());
  }
}

// At rest the tangent is the derivative, dampers too; away from it what is left out is of the order of the
// strain, and no eigenvalue is positive.
// unsanitized: too slow there; shorter tests run the same code
TEST_P(CellBody, Tangent_IsTheDerivativeAtRestAndNegativeSemidefiniteElsewhere) {
  Host host;
  Body b(host, GetParam(), GetParam().mesh(), 0.3, 0.01, 0.5);
  if (GetParam().turns()) b.place(kNone, {0.6, 0, 0.8}, 0.7);
  const Dense k = tangent(b, 1, 0), c = tangent(b, 0, 1);
  EXPECT_LT(largest_difference(k, differences(b, b.x, 1e-6)), 1e-6 * largest(k));
  EXPECT_LT(largest_difference(c, differences(b, b.v, 1e-3)), 1e-8 * largest(c));
  b.shake(6e-3, 1);
  const Dense moved = tangent(b, 1, 0), dampers = tangent(b, 0, 1);
  EXPECT_LT(largest_difference(dampers, differences(b, b.v, 1e-3)), 1e-7 * largest(c));
  EXPECT_TRUE(below(moved, 1e-9 * largest(k)));
  EXPECT_TRUE(below(dampers, 1e-9 * largest(c)));
  EXPECT_LT(largest_difference(moved, differences(b, b.x, 1e-6)),
            GetParam().turns() ? 0.2 * largest(k) : 1e-6 * largest(k));
}

// No eigenvalue of h^2 K + 2 h C over M is above 4 at the bound, at rest and well away from it.
// unsanitized: too slow there; shorter tests run the same code
TEST_P(CellBody, Bound_IsAboveTheLargestEigenvalue) {
  for (double amount : {0.0, 4e-3, 1.5e-2}) {
    Host host;
    Body b(host, GetParam(), GetParam().mesh(), 0.3, 1e-4);
    if (GetParam().turns()) b.place(kA, {0.6, 0, 0.8}, 0.7);
    b.shake(amount, 0);
    const double h = b.bound(), most = Operator(b).largest(h, 200);
    EXPECT_LT(most, 4.0) << amount;
    if (amount == 0) {
      EXPECT_GT(most, 1.0);  // half of the largest step
    }
  }
}

// u is the gradient of a harmonic function, so it is an elastic field without loads for every material; it is
// given on the boundary. The error at inner points over the largest value of u.
double field_error(uint32_t kind, uint32_t n) {
  const auto u_at = [](Vec x) {
    const double e = std::exp(x[0]), sy = std::sin(0.6 * x[1] + 0.4), cy = std::cos(0.6 * x[1] + 0.4);
    const double sz = std::sin(0.8 * x[2] + 0.3), cz = std::cos(0.8 * x[2] + 0.3);
    return Vec{e * sy * sz, 0.6 * e * cy * sz, 0.8 * e * sy * cz};
  };
  const double h = 1.0 / n;
  const Mesh m = kind == DFM_CELL_HEX8    ? brick_bar(n, n, n, {h, h, h})
                 : kind == DFM_CELL_TET   ? kuhn_bar(n, n, n, h)
                 : kind == DFM_CELL_TET10 ? second_order(kuhn_bar(n, n, n, h))
                                          : with_middles(brick_bar(n, n, n, {h, h, h}), kind);
  Host host;
  Body b(host, {"model_linear_fem", kind}, m);
  const Dense k = tangent(b, 1, 0);
  std::vector<double> given(3 * m.npoint());
  std::vector<uint32_t> free;
  double most = 0;
  for (uint32_t i = 0; i < m.npoint(); ++i) {
    const Vec x = m.at(i), u = u_at(x);
    most = std::max(most, norm(u));
    bool in = true;
    for (double c : x) in = in && c > 1e-9 && c < 1 - 1e-9;
    for (uint32_t a = 0; a < 3; ++a) {
      if (in) free.push_back(3 * i + a);
      else given[3 * i + a] = u[a];
    }
  }
  const std::vector<double> load = k * given;
  Dense part(free.size(), free.size());
  std::vector<double> right;
  for (size_t r = 0; r < free.size(); ++r) {
    right.push_back(load[free[r]]);
    for (size_t c = 0; c < free.size(); ++c) part(r, c) = -k(free[r], free[c]);
  }
  const std::vector<double> u = test::solved(part, right);
  double sum = 0;
  for (size_t r = 0; r < free.size(); ++r) {
    const double off = u[r] - u_at(m.at(free[r] / 3))[free[r] % 3];
    sum += off * off;
  }
  return std::sqrt(sum / double(free.size() / 3)) / most;
}

// unsanitized: too slow there; shorter tests run the same code
TEST(CellBars, ErrorOfASmoothField_FallsByTheOrderOfTheCells) {
  const double tet10 = field_error(DFM_CELL_TET10, 2) / field_error(DFM_CELL_TET10, 4);
  const double hex8 = field_error(DFM_CELL_HEX8, 3) / field_error(DFM_CELL_HEX8, 6);
  EXPECT_GT(std::log2(tet10), 2.7);
  EXPECT_GT(std::log2(hex8), 1.8);
  for (const uint32_t kind : {DFM_CELL_HEX20, DFM_CELL_HEX27})
    EXPECT_GT(std::log2(field_error(kind, 2) / field_error(kind, 4)), 2.7) << kind;
  // beside first-order tetrahedra with the same points
  EXPECT_LT(field_error(DFM_CELL_TET10, 4), 0.5 * field_error(DFM_CELL_TET, 8));
}

// The gradient of y z^2 - y^3/3 + x y z: quadratic, without volume change or loads.
TEST(CellBars, QuadraticFields_LeaveInnerPointsOfBricksInBalance) {
  for (const uint32_t kind : {DFM_CELL_HEX20, DFM_CELL_HEX27})
    for (const double poisson : {0.3, 0.4999}) {
      Host host;
      const Mesh m = with_middles(brick_bar(3, 2, 2, {0.1, 0.12, 0.09}), kind);
      Body b(host, {"model_linear_fem", kind}, m, poisson);
      for (uint32_t i = 0; i < b.size(); ++i) {
        const Vec x = m.at(i);
        b.set(b.x, i,
              x + Vec{x[1] * x[2], x[2] * x[2] - x[1] * x[1] + x[0] * x[2], 2 * x[1] * x[2] + x[0] * x[1]});
      }
      b.forces();
      uint32_t n = 0;
      for (uint32_t i = 0; i < b.size(); ++i)
        if (inner(m, i)) {
          EXPECT_LT(norm(b.get(b.f, i)), 1e-12 * kYoung / (1 - 2 * poisson)) << kind << ' ' << i;
          ++n;
        }
      EXPECT_GE(n, 8u);
    }
}

// The displacement u = 2 (a.x) x - |x|^2 a has no shear. What resists it in a lone cell is the linear part
// 6 a.x of the volume change: by the bulk modulus, at most by that of poisson 0.4.
TEST(CellBars, LinearVolumeChangeOfSecondOrderTetrahedra_IsSofterNearPoissonOneHalf) {
  Mesh corners;
  corners.rest = {0, 0, 0, 0.1, 0, 0, 0, 0.12, 0, 0.02, 0, 0.09};
  corners.cells = {0, 1, 2, 3};
  corners.edges = {0, 1};
  for (size_t i = 0; i < 12; ++i) corners.rest[i] -= i % 3 == 0 ? 0.03 : i % 3 == 1 ? 0.03 : 0.0225;
  const Vec a = {0.3, -0.5, 0.7};
  double square = 0;  // integral of (a.x)^2 about the centroid
  for (uint32_t k = 0; k < 4; ++k) square += corners.volume(0) / 20 * std::pow(dot(a, corners.at(k)), 2);
  for (double poisson : {0.3, 0.4, 0.49, 0.4999}) {
    Host host;
    Body b(host, {"model_linear_fem", DFM_CELL_TET10}, second_order(corners), poisson);
    ASSERT_EQ(b.status, DFM_OK) << host.logged;
    for (uint32_t i = 0; i < b.size(); ++i) {
      const Vec x = b.mesh.at(i);
      b.set(b.x, i, x + (2 * dot(a, x)) * x - dot(x, x) * a);
    }
    const double mu = kYoung / (2 * (1 + poisson)), bulk = kYoung / (3 * (1 - 2 * poisson));
    EXPECT_NEAR(b.energy() / (18 * std::min(bulk, 14.0 / 3 * mu) * square), 1, 1e-9) << poisson;
  }
}

TEST(CellBars, LinearCellsThatTurn_AreWarnedOf) {
  Host host;
  Body b(host, {"model_linear_fem", DFM_CELL_HEX8}, brick_bar(2, 1, 1, {0.1, 0.1, 0.1}));
  b.place(kNone, {0, 0, 1}, 0.2);
  b.energy();
  EXPECT_EQ(host.logged, "");
  b.place(kNone, {0, 0, 1}, 0.5);
  b.energy();
  EXPECT_NE(host.logged.find("turned by"), std::string::npos) << host.logged;
}

TEST(CellBars, ParametersOfTetrahedraAlone_AreRefusedByName) {
  const Case of{"model_corotational_fem", DFM_CELL_HEX8};
  const dfm_type &type = type_by(of.module);
  const Mesh m = brick_bar(1, 1, 1, {0.1, 0.1, 0.1});
  size_t at = 0;
  for (uint32_t r = 0; r < type.nparam; at += type.params[r++].width) {
    const std::string key = type.params[r].key;
    if (r < 4 || key == "yield" || key == "hardening" || key == "creep" || key == "plastic_limit" ||
        key.starts_with("anisotropy"))
      continue;
    Host host;
    std::vector<double> values = material(type, kYoung, 0.3);
    values[at] = type.params[r].def == 1 ? 2 : 1;
    ModelInstance refused(host, type, m, values);
    EXPECT_EQ(refused.status, DFM_E_ARG) << key;
    EXPECT_NE(host.logged.find(key), std::string::npos);
    EXPECT_NE(host.logged.find("first-order tetrahedra alone"), std::string::npos) << host.logged;
    Body b(host, of, m);
    EXPECT_EQ(b.ops->set_params(b.self, values.data()), DFM_E_ARG);
    EXPECT_EQ(host.live > 0, true);
  }
}

// Values by cell: the same as one value for all where they are the same, and their own otherwise.
TEST(CellBars, ValuesByCell_AreThoseOfTheCells) {
  const dfm_type &type = type_by("model_corotational_fem");
  const Mesh m = brick_bar(4, 1, 1, {0.1, 0.1, 0.1});
  Host host;
  Fields soft_half = {{"young", {kYoung, kYoung, kYoung / 4, kYoung / 4}}};
  ModelInstance b(host, type, m, material(type, kYoung, 0.0), 4, soft_half);
  for (uint32_t i = 0; i < b.size(); ++i) b.set(b.x, i, {1.01 * m.at(i)[0], m.at(i)[1], m.at(i)[2]});
  const std::vector<double> stress = stress_of_cells(b);
  for (uint32_t c = 0; c < 4; ++c) EXPECT_NEAR(stress[6 * c], c < 2 ? 1000 : 250, 1e-6);
}

TEST(CellBars, RefusedMemory_LeavesNothingBehind) {
  const dfm_type &type = type_by("model_corotational_fem");
  const Mesh m = brick_bar(2, 1, 1, {0.1, 0.1, 0.1});
  refuse_each_allocation(
      [&](Host &host) { return ModelInstance(host, type, m, material(type, kYoung, 0.3)); });
}

// Pieces in any cut and order give the same bits.
TEST(CellBars, Forces_DoNotDependOnTheDivisionOfTheWork) {
  Host one, many;
  many.shuffle = 1;
  const Case of{"model_corotational_fem", DFM_CELL_HEX8};
  const Mesh m = brick_bar(12, 8, 8, {0.1, 0.1, 0.1});
  Body a(one, of, m, 0.3, 1e-3), b(many, of, m, 0.3, 1e-3);
  a.shake(1e-2, 1);
  b.shake(1e-2, 1);
  a.forces();
  b.forces();
  EXPECT_EQ(std::vector<double>(a.f, a.f + 4 * a.size()), std::vector<double>(b.f, b.f + 4 * b.size()));
}

}  // namespace
}  // namespace model_test
