// The rotations of model_common: 330 matrices against their nearest rotation in 60 digits.
#include <cstdio>

#include "../../plugins/model_common/rotation.h"
#include "corot_host.h"

namespace corot_test {
namespace {

using Rotation = void (*)(const double *, double *);
struct Case {
  std::string kind;
  double matrix[9], nearest[9], gap;
};

std::vector<Case> cases() {
  std::vector<Case> all;
  const std::string path = test::reference_dir() + "/elasticity/tables/polar_cases.csv";
  const auto rows = test::read_csv(path);
  for (size_t n = 1; n < rows.size(); ++n) {
    Case c;
    c.kind = rows[n][1];
    for (size_t k = 0; k < 9; ++k) {
      c.matrix[k] = std::stod(rows[n][2 + k]);
      c.nearest[k] = std::stod(rows[n][11 + k]);
    }
    c.gap = std::stod(rows[n][23]);
    all.push_back(c);
  }
  return all;
}

double orthogonality(const double *r) {
  double most = 0;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      most = std::max(most, std::abs(r[i] * r[j] + r[3 + i] * r[3 + j] + r[6 + i] * r[6 + j] - (i == j)));
  return most;
}
double determinant(const double *r) {
  return r[0] * (r[4] * r[8] - r[5] * r[7]) + r[1] * (r[5] * r[6] - r[3] * r[8]) +
         r[2] * (r[3] * r[7] - r[4] * r[6]);
}
double distance(const double *a, const double *b) {
  double sum = 0;
  for (int k = 0; k < 9; ++k) sum += (a[k] - b[k]) * (a[k] - b[k]);
  return std::sqrt(sum);
}

void expect_proper(const double *r, const std::string &what) {
  EXPECT_LT(orthogonality(r), 1e-14) << what;
  EXPECT_NEAR(determinant(r), 1, 1e-14) << what;
}

TEST(Polar, ReferenceMatrices_MeetTheirNearestRotation) {
  const std::vector<Case> all = cases();
  ASSERT_EQ(all.size(), 330u);
  for (const Rotation rotation : {model::rotation::polar_of, model::rotation::nearest})
    for (const Case &c : all) {
      double r[9];
      rotation(c.matrix, r);
      expect_proper(r, c.kind);
      if (c.gap < 1e-12) continue;
      EXPECT_LT(distance(r, c.nearest), 4e-15 / c.gap) << c.kind << " " << c.gap;
    }
}

// R and stretches 1, s2, s3 along axes that lie anywhere: long and thin cells. Their nearest rotation is R,
// to the rounding of the matrix over the least sum of two stretches.
TEST(Polar, NeedlesInAnyDirection_MeetTheirRotation) {
  std::mt19937 generator(7);
  const auto random = [&] { return double(generator()) * 0x1p-32 - 0.5; };
  const auto turn = [&](double *r) {
    const double q[4] = {random(), random(), random(), random()};
    model::rotation::from_quaternion(q, r);
  };
  for (const double thin : {1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7})
    for (const double ratio : {1.0, 0.9, 0.5, 0.1, 1e-3}) {
      double r[9], axes[9], f[9] = {}, found[9];
      turn(r);
      turn(axes);
      const double stretch[3] = {1, thin, ratio * thin};
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j)
          for (int k = 0; k < 3; ++k) {
            double turned = 0;
            for (int m = 0; m < 3; ++m) turned += r[3 * i + m] * axes[3 * m + k];
            f[3 * i + j] += turned * stretch[k] * axes[3 * j + k];
          }
      const double gap = thin + ratio * thin;
      for (const Rotation rotation : {model::rotation::nearest, model::rotation::by_singular_values}) {
        rotation(f, found);
        expect_proper(found, "needle");
        EXPECT_LT(distance(found, r), 4e-15 / gap) << thin << " " << ratio;
      }
    }
}

// What doc/models/corotational_fem.md says of the other two.
TEST(Polar, OtherRotations_AreProperAndStandOffAsDocumented) {
  double by_values = 0, by_columns = 0;
  for (const Case &c : cases()) {
    double r[9];
    model::rotation::by_singular_values(c.matrix, r);
    expect_proper(r, "svd " + c.kind);
    by_values = std::max(by_values, distance(r, c.nearest) * c.gap);
    model::rotation::gram_schmidt(c.matrix, r);
    expect_proper(r, "qr " + c.kind);
    if (c.kind == "pure_rotation") {
      EXPECT_LT(distance(r, c.nearest), 4e-15);
    }
    if (c.kind == "random") by_columns = std::max(by_columns, distance(r, c.nearest));
  }
  std::printf("svd: error times gap up to %.2g; qr: error of random matrices up to %.2g\n", by_values,
              by_columns);
  EXPECT_LT(by_values, 4e-15);
  EXPECT_GT(by_columns, 0.1);
}

TEST(Polar, MatricesWithoutANearestRotation_GiveSomeRotation) {
  const double nan = std::nan("");
  for (const std::array<double, 9> &m :
       std::vector<std::array<double, 9>>{{0, 0, 0, 0, 0, 0, 0, 0, 0},
                                          {1, 0, 0, 0, 0, 0, 0, 0, 0},
                                          {0, 0, 0, 0, 0, 0, 0, 0, -1},
                                          {-1, 0, 0, 0, -1, 0, 0, 0, -1},
                                          {1, 1, 1, 1, 1, 1, 1, 1, 1},
                                          {1e-300, 0, 0, 0, 1e-300, 0, 0, 0, 1e-300},
                                          {1e300, 0, 0, 0, -1e300, 0, 0, 0, 1e300},
                                          {5e-324, 0, 0, 0, 0, 0, 0, 0, 0},
                                          {nan, 0, 0, 0, 1, 0, 0, 0, 1}})
    for (const Rotation rotation : {model::rotation::polar_of, model::rotation::nearest,
                                    model::rotation::by_singular_values, model::rotation::gram_schmidt}) {
      double r[9];
      rotation(m.data(), r);
      expect_proper(r, std::to_string(m[0]));
    }
}

}  // namespace
}  // namespace corot_test
