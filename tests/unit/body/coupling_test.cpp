// N: rows that sum to one, linear fields, and what its transpose does to forces. The reference values of
// (3.9) and (3.12) come from reference/elasticity (phyxels: nodes of a small cylinder).
#include "body/coupling.h"

#include <gtest/gtest.h>

#include <cstdio>

#include "../narrow/detect_scene.h"
#include "contact/distribute.h"
#include "mesh/mesh.h"
#include "near.h"
#include "support.h"

namespace {

using namespace dfm;

enum Kind { kBarycentric, kMls, kThesis };
Coupling couple(Kind kind, const CouplingInput &in) {
  const Memory &m = Memory::standard();
  return kind == kBarycentric ? couple_barycentric(m, in)
         : kind == kMls       ? couple_mls(m, in)
                              : couple_thesis(m, in);
}

struct Case {
  std::vector<double> point, surfel;
  std::vector<uint32_t> tet, tri;
  CouplingInput in(double support = 3) const {
    CouplingInput c;
    c.npoint = uint32_t(point.size() / 3);
    c.ntet = uint32_t(tet.size() / 4);
    c.nsurfel = uint32_t(surfel.size() / 3);
    c.point = point.data();
    c.tet = tet.data();
    c.surfel = surfel.data();
    c.support = support;
    return c;
  }
  Vec3 p(uint32_t i) const { return load3(&point[3 * i]); }
  Vec3 s(uint32_t i) const { return load3(&surfel[3 * i]); }
};

// A fine sphere in a coarse ball, moved and scaled. With cells of 1 m the sphere sticks out of the faceted
// ball a little.
Case ball(double scale = 1, Vec3 shift = {}, int level = 3) {
  const double size[1] = {1};
  const RestMesh m = make_ball(Memory::standard(), size[0], 400);
  Case c;
  c.tet.assign(m.tets.begin(), m.tets.end());
  const auto put = [&](std::vector<double> &to, Vec3 x) {
    for (int k = 0; k < 3; ++k) to.push_back(shift[k] + scale * x[k]);
  };
  for (uint32_t i = 0; i < m.points.size() / 3; ++i) put(c.point, load3(&m.points[3 * i]));
  const test::Mesh fine = test::sphere_mesh(0.97, level);
  for (uint32_t i = 0; i < fine.npoint(); ++i) put(c.surfel, fine.at(i));
  c.tri = fine.tri;
  return c;
}

double row_sum(const Coupling &c, uint32_t s) {
  double sum = 0;
  for (uint32_t j = c.row[s]; j < c.row[s + 1]; ++j) sum += c.weight[j];
  return sum;
}

// N times the phyxels about a near origin, minus the surfel: what linear fields lose.
double linear_error(const Case &k, const Coupling &c) {
  double worst = 0;
  for (uint32_t s = 0; s + 1 < c.row.size(); ++s) {
    Vec3 r;
    for (uint32_t j = c.row[s]; j < c.row[s + 1]; ++j) r += c.weight[j] * (k.p(c.col[j]) - k.s(s));
    worst = test::worse(worst, norm(r));
  }
  return worst;
}

class Linear : public testing::TestWithParam<Kind> {};

TEST_P(Linear, Rows_SumToOneAndReproduceLinearFieldsAtAnyScaleAndPlace) {
  struct At {
    double scale;
    Vec3 shift;
  };
  for (const At a : {At{1, {}}, At{1e-9, {}}, At{1e5, {}}, At{1, {1e7, -1e7, 1e7}}, At{1e-9, {0.01, 0, 0}}}) {
    const Case k = ball(a.scale, a.shift);
    const Coupling c = couple(GetParam(), k.in());
    ASSERT_EQ(c.row.size(), k.surfel.size() / 3 + 1);
    EXPECT_LE(linear_error(k, c), 1e-12 * a.scale) << "scale " << a.scale << " at " << a.shift.x;
    for (uint32_t s = 0; s + 1 < c.row.size(); ++s) {
      EXPECT_NEAR(row_sum(c, s), 1, 2.3e-16);
      for (uint32_t j = c.row[s] + 1; j < c.row[s + 1]; ++j) EXPECT_LT(c.col[j - 1], c.col[j]);
    }
  }
}

// A power of two is exact, so no step of the construction may know the unit of length.
TEST_P(Linear, ScaleByAPowerOfTwo_ChangesNoBit) {
  const Coupling home = couple(GetParam(), ball().in()), scaled = couple(GetParam(), ball(0x1p-30).in());
  EXPECT_EQ(home.col, scaled.col);
  EXPECT_EQ(home.weight, scaled.weight);
}

// Random forces at the surfels of a body that is bent and turned: force, torque about the origin and power,
// at the surfels and at the phyxels.
TEST_P(Linear, Transpose_ConservesForceTorqueAndPowerInADeformedState) {
  const Case k = ball();
  const uint32_t np = k.in().npoint, ns = k.in().nsurfel;
  Surface surface;
  make_surface(Memory::standard(), ns, k.surfel.data(), k.tri.data(), uint32_t(k.tri.size() / 3), surface);
  wear_coupling(couple(GetParam(), k.in()), surface);
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  const auto any = [&] { return Vec3{normal(random), normal(random), normal(random)}; };
  Array<double> x(size_t{4} * np), v(size_t{4} * np), f(size_t{4} * np, 1.0);
  for (uint32_t i = 0; i < np; ++i) {
    const Vec3 r = k.p(i);
    store3(&x[4 * i],
           rotate(test::turn({1, 2, 3}, 2), r + Vec3{0.3 * r.y * r.y, 0.2 * r.x * r.z, 0.1 * r.x}) +
               0.05 * any());
    store3(&v[4 * i], any());
  }
  std::vector<double> load(size_t{3} * ns);
  for (uint32_t s = 0; s < ns; ++s) store3(&load[3 * s], any());
  gather_surface(surface, x.data(), v.data());
  scatter_surface(surface, load.data(), np, f.data());
  Vec3 force, torque;
  double power = 0, sum = 0, work = 0;
  for (uint32_t s = 0; s < ns; ++s) {
    const Vec3 l = load3(&load[3 * s]), at = load3(&surface.x[4 * s]), move = load3(&surface.v[4 * s]);
    force += l;
    torque += cross(at, l);
    power += dot(move, l);
    sum += norm(l);
    work += std::fabs(dot(move, l));
  }
  for (uint32_t i = 0; i < np; ++i) {
    const Vec3 l = load3(&f[4 * i]);
    force -= l;
    torque -= cross(load3(&x[4 * i]), l);
    power -= dot(load3(&v[4 * i]), l);
    EXPECT_EQ(f[4 * i + 3], 0.0);
  }
  EXPECT_LT(norm(force), 1e-13 * sum);
  EXPECT_LT(norm(torque), 1e-13 * sum);
  EXPECT_LT(std::fabs(power), 1e-13 * work);
}

TEST_P(Linear, SameInput_SameBits) {
  const Case k = ball();
  const Coupling a = couple(GetParam(), k.in()), b = couple(GetParam(), k.in());
  EXPECT_EQ(a.col, b.col);
  EXPECT_EQ(a.weight, b.weight);
}

INSTANTIATE_TEST_SUITE_P(Coupling, Linear, testing::Values(kBarycentric, kMls),
                         [](const auto &i) { return i.param == kMls ? "Mls" : "Barycentric"; });

// Two cells on a common face 1 2 3.
Case two_cells() {
  Case c;
  c.point = {0, 0, -1, 1, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 1};
  c.tet = {1, 2, 3, 4, 1, 3, 2, 0};
  return c;
}

TEST(Barycentric, SharedPointsAndFaces_GoToTheLowestCellAndDropZeros) {
  Case c = two_cells();
  c.surfel = {0, 0, 0, 0.25, 0.25, 0, 0.5, 0, 0, 0.1, 0.1, 0.1};
  const Coupling n = couple(kBarycentric, c.in());
  EXPECT_EQ(std::vector<uint32_t>(n.row.begin(), n.row.end()), (std::vector<uint32_t>{0, 1, 4, 6, 10}));
  EXPECT_EQ(n.col[0], 3u);
  EXPECT_EQ(n.weight[0], 1.0);
  for (uint32_t j = n.row[3]; j < n.row[4]; ++j) EXPECT_NE(n.col[j], 0u) << "cell 1 does not hold it";
  EXPECT_EQ(n.outside, 0u);
  EXPECT_EQ(n.farthest, 0.0);
  // a hair over the face is still in cell 0, whose point 4 it leans on
  c.surfel = {0.25, 0.25, -1e-12};
  const Coupling over = couple(kBarycentric, c.in());
  EXPECT_EQ(over.outside, 0u);
  EXPECT_EQ(over.col.back(), 4u);
  EXPECT_LT(over.weight.back(), 0);
}

TEST(Barycentric, Outside_TakesTheNearestCellAndSaysHowFar) {
  Case c = two_cells();
  c.surfel = {0.2, 0.2, 2, 0.1, 0.1, 0.1, 0.1, 0.1, -3};
  const Coupling n = couple(kBarycentric, c.in());
  EXPECT_EQ(n.outside, 2u);
  EXPECT_NEAR(n.farthest, norm(Vec3{0.1, 0.1, -2}), 0.02) << "from point 0, or the faces at it";
  EXPECT_EQ(n.col[n.row[1] - 1], 4u) << "the upper cell";
  EXPECT_EQ(n.col[n.row[2]], 0u) << "the lower cell";
  EXPECT_LT(linear_error(c, n), 1e-14);
}

TEST(Mls, TooFewPhyxelsInReach_FallBackAndAreCounted) {
  Case c = two_cells();
  c.surfel = {0.1, 0.1, 0.1, 0, 0, 6};
  const Coupling n = couple(kMls, c.in(1));
  EXPECT_EQ(n.outside, 1u) << "the far one; all five points reach the near one";
  EXPECT_NEAR(n.farthest, 5, 1e-12);
  EXPECT_LT(linear_error(c, n), 1e-13);
  const Coupling narrow = couple(kMls, c.in(0.01)), thesis = couple(kThesis, c.in(0.01));
  EXPECT_EQ(narrow.outside, 2u);
  EXPECT_EQ(thesis.outside, 2u) << "no 0/0";
  EXPECT_LT(linear_error(c, narrow), 1e-14);
}

// A sheet one cell thick: neighborhoods that are all but flat.
TEST(Mls, ThinSheet_StaysLinear) {
  for (const double thick : {1e-2, 1e-4, 1e-6, 1e-9}) {
    Case c;
    for (int z = 0; z < 2; ++z)
      for (int i = 0; i < 6; ++i)
        for (int j = 0; j < 6; ++j) c.point.insert(c.point.end(), {0.1 * i, 0.1 * j, thick * z});
    const auto at = [](int i, int j, int z) { return uint32_t(36 * z + 6 * i + j); };
    for (int i = 0; i < 5; ++i)
      for (int j = 0; j < 5; ++j)
        for (const auto &path : {std::array{at(i + 1, j, 0), at(i + 1, j + 1, 0)},
                                 std::array{at(i, j + 1, 0), at(i + 1, j + 1, 0)}})
          c.tet.insert(c.tet.end(), {at(i, j, 0), path[0], path[1], at(i + 1, j + 1, 1)});
    c.surfel = {0.23, 0.31, thick, 0.01, 0.02, 0, 0.25, 0.25, 0.5 * thick};
    const Coupling n = couple(kMls, c.in());
    EXPECT_LE(linear_error(c, n), 1e-12 * 0.5) << thick;
  }
}

// Zerbato 2010, chapter 3: Shepard weights draw the surface inwards, and lose torque and power where the
// linear-exact ones do not.
TEST(Thesis, Surface_ShrinksAndTorqueAndPowerAreLost) {
  const Case k = ball();
  const Coupling c = couple(kThesis, k.in());
  for (uint32_t s = 0; s + 1 < c.row.size(); ++s) EXPECT_NEAR(row_sum(c, s), 1, 2.3e-16);
  double shrink = 0, torque_in = 0, torque_out = 0, power_in = 0, power_out = 0;
  // Traction of a twist about z; velocity of a stretch and a spin, both linear in x.
  const auto velocity = [](Vec3 x) { return Vec3{0.5 * x.x - x.y, x.x - 0.25 * x.y, -0.25 * x.z}; };
  for (uint32_t s = 0; s + 1 < c.row.size(); ++s) {
    const Vec3 x = k.s(s), f = cross({0, 0, 1}, x) + x;
    Vec3 y;
    for (uint32_t j = c.row[s]; j < c.row[s + 1]; ++j) y += c.weight[j] * k.p(c.col[j]);
    shrink = std::max(shrink, norm(y - x));
    torque_in += cross(x, f).z;
    torque_out += cross(y, f).z;
    power_in += dot(velocity(x), f);
    power_out += dot(velocity(y), f);
  }
  const double torque = 1 - torque_out / torque_in, power = 1 - power_out / power_in;
  std::printf(
      "thesis coupling, support 3: surfels off by up to %.3f of the radius, torque lost %.1f %%, power lost "
      "%.1f %%\n",
      shrink, 100 * torque, 100 * power);
  EXPECT_GT(shrink, 0.05);
  EXPECT_GT(torque, 0.01);
  EXPECT_GT(power, 0.01);
}

// The reference tables of (3.9), with and without its gradient term, and of the transpose.
class Reference : public testing::Test {
 protected:
  Case k;
  std::vector<std::vector<double>> read(const std::string &name) const {
    std::vector<std::vector<double>> rows;
    for (const auto &line : test::read_csv(test::reference_dir() + "/elasticity/" + name)) {
      if (!line.empty() && std::isalpha(line[0][0])) continue;  // the headings
      rows.emplace_back();
      for (const std::string &cell : line) rows.back().push_back(std::stod(cell));
    }
    return rows;
  }
  void SetUp() override {
    for (const auto &row : read("tables/mls_phyxels.csv"))
      k.point.insert(k.point.end(), row.begin() + 1, row.begin() + 4);
    for (const auto &row : read("tables/mls_surfels.csv"))
      k.surfel.insert(k.surfel.end(), row.begin() + 1, row.begin() + 4);
    k.tet = {0, 1, 2, 3};  // never asked: every surfel is within reach
  }
  Vec3 apply(const Coupling &c, uint32_t s, const std::vector<Vec3> &u) const {
    Vec3 sum;
    for (uint32_t j = c.row[s]; j < c.row[s + 1]; ++j) sum += c.weight[j] * u[c.col[j]];
    return sum;
  }
};

TEST_F(Reference, QuadraticField_BothCouplings) {
  const Coupling mls = couple(kMls, k.in()), thesis = couple(kThesis, k.in());
  EXPECT_EQ(mls.outside + thesis.outside, 0u);
  std::vector<Vec3> u;
  for (const auto &row : read("fields/mls_elastic_u.csv")) u.push_back({row[1], row[2], row[3]});
  ASSERT_EQ(u.size(), k.in().npoint);
  // mls_elastic_u is quadratic + linear; so is the sum of the two surfel tables
  const auto linear = read("fields/mls_linear_surfel_u.csv");
  const auto quadratic = read("fields/mls_quadratic_surfel_u.csv");
  double worst = 0, worst_thesis = 0, top = 0;
  for (uint32_t s = 0; s < k.in().nsurfel; ++s) {
    const auto at3 = [](const std::vector<double> &row, size_t at) {
      return Vec3{row[at], row[at + 1], row[at + 2]};
    };
    const auto sum = [&](size_t at) { return at3(linear[s], at) + at3(quadratic[s], at); };
    top = std::max(top, norm(sum(4)));
    worst = test::worse(worst, norm(apply(mls, s, u) - sum(4)));
    worst_thesis = test::worse(worst_thesis, norm(apply(thesis, s, u) - sum(1)));
  }
  EXPECT_LT(worst, 1e-11 * top);
  EXPECT_LT(worst_thesis, 1e-11 * top);
}

TEST_F(Reference, TransposedForces_Match) {
  const Coupling mls = couple(kMls, k.in());
  for (const char *name : {"random", "torsion", "single_surfel", "uniform_down"}) {
    const auto in = read(std::string("fields/mls_force_") + name + "_in.csv");
    const auto out = read(std::string("fields/mls_force_transpose_") + name + ".csv");
    std::vector<Vec3> f(k.in().npoint);
    for (uint32_t s = 0; s < k.in().nsurfel; ++s)
      for (uint32_t j = mls.row[s]; j < mls.row[s + 1]; ++j)
        f[mls.col[j]] += mls.weight[j] * Vec3{in[s][1], in[s][2], in[s][3]};
    double worst = 0, top = 0;
    for (uint32_t i = 0; i < f.size(); ++i) {
      const Vec3 want{out[i][1], out[i][2], out[i][3]};
      worst = test::worse(worst, norm(f[i] - want));
      top = std::max(top, norm(want));
    }
    EXPECT_LT(worst, 1e-11 * top) << name;
  }
}

TEST(Gather, WeightsOfAPlainRow_ComeBackToTheBit) {
  // Identity as a matrix: a surfel on a phyxel is that phyxel, whatever the number of cells around it.
  const RestMesh m = make_ball(Memory::standard(), 1, 400);
  const auto boundary = boundary_triangles(Memory::standard(), m.ntet(), m.tets.data());
  Surface identity, coupled;
  make_surface(Memory::standard(), m.npoint(), m.points.data(), boundary.data(),
               uint32_t(boundary.size() / 3), identity);
  Case k;
  k.point.assign(m.points.begin(), m.points.end());
  k.tet.assign(m.tets.begin(), m.tets.end());
  for (const uint32_t p : identity.point)
    k.surfel.insert(k.surfel.end(), &m.points[3 * p], &m.points[3 * p] + 3);
  const Coupling c = couple(kBarycentric, k.in());
  EXPECT_EQ(c.col, identity.point);
  EXPECT_EQ(c.weight, Array<double>(identity.nsurfel, 1.0));
}

}  // namespace
