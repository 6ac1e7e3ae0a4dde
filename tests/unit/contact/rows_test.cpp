// The contact operator against the same operator as a dense matrix (rows_case.h), and the rates that depths
// open at.
#include "rows_case.h"

namespace {

using namespace test;

constexpr double kRounding = 1e-13;  // of sums of some twenty terms that are near 1

}  // namespace

TEST(Rows, VelocitiesWithoutImpulses_AreThoseOfTheNodesLessTheObstacles) {
  const RowsCase c;
  const std::vector<double> u = c.free_velocity();
  for (uint32_t i = 0; i < RowsCase::kContacts; ++i)
    for (int axis = 0; axis < 3; ++axis)
      EXPECT_NEAR(c.rows.velocity(i)[axis], u[3 * i + uint32_t(axis)], kRounding) << i;
}

// Column by column: a unit impulse at one contact changes what all contacts see by a column of W. Off the
// diagonal blocks that is how contacts of the same body, of the same points or of tied rigid bodies answer
// each other.
TEST(Rows, UnitImpulses_ChangeAllVelocitiesByTheDenseOperator) {
  RowsCase c;
  const Dense w = c.delassus();
  for (uint32_t i = 0; i < RowsCase::kContacts; ++i)
    for (int axis = 0; axis < 3; ++axis) {
      Vec3 unit;
      unit[axis] = 1;
      c.rows.restore(c.rows.whole());
      c.rows.apply(i, unit);
      const std::vector<double> u = c.free_velocity();
      for (uint32_t j = 0; j < RowsCase::kContacts; ++j)
        for (uint32_t k = 0; k < 3; ++k) {
          const double change = c.rows.velocity(j)[int(k)] - u[3 * j + k];
          EXPECT_NEAR(change, w(3 * j + k, 3 * i + uint32_t(axis)), kRounding)
              << "impulse at " << i << " axis " << axis << ", seen by " << j << " axis " << k;
        }
    }
}

// wn = W_nn, cross = W_tn. wt is the largest eigenvalue of the 2x2 block W_tt: a root of its characteristic
// polynomial that is not below half of its trace.
TEST(Rows, Diagonals_AreThoseOfTheDenseOperator) {
  const RowsCase c;
  const Dense w = c.delassus();
  for (uint32_t i = 0; i < RowsCase::kContacts; ++i) {
    const size_t n = 3 * size_t{i};
    EXPECT_NEAR(c.rows.wn[i], w(n, n), kRounding) << i;
    EXPECT_NEAR(c.rows.cross[2 * n / 3], w(n + 1, n), kRounding) << i;
    EXPECT_NEAR(c.rows.cross[2 * n / 3 + 1], w(n + 2, n), kRounding) << i;
    const double t = c.rows.wt[i];
    const double a = w(n + 1, n + 1);
    const double b = w(n + 1, n + 2);
    const double d = w(n + 2, n + 2);
    EXPECT_NEAR((a - t) * (d - t) - b * b, 0, kRounding * t * t) << i;
    EXPECT_GE(t, 0.5 * (a + d)) << i;
  }
}

// W is symmetric and positive semidefinite, so impulses never take out less than they bring: p . W p >= 0.
TEST(Rows, Restore_AppliesAllImpulsesAtOnce) {
  RowsCase c;
  std::vector<double> p(3 * RowsCase::kContacts);
  for (size_t k = 0; k < p.size(); ++k) {
    p[k] = k % 3 == 0 ? 1 + 0.25 * double(k) : 0.5 - 0.125 * double(k);
    c.rows.impulse[k] = p[k];
  }
  c.rows.y.assign(c.rows.y.size(), NAN);
  c.rows.restore(c.rows.whole());
  const std::vector<double> free = c.free_velocity();
  const std::vector<double> change = c.delassus() * p;
  double work = 0;
  for (uint32_t i = 0; i < RowsCase::kContacts; ++i)
    for (uint32_t k = 0; k < 3; ++k) {
      EXPECT_NEAR(c.rows.velocity(i)[int(k)], free[3 * i + k] + change[3 * i + k], 100 * kRounding) << i;
      work += p[3 * i + k] * change[3 * i + k];
    }
  EXPECT_GT(work, 0);
}

// The velocities that a solve begins with are those of its impulses, whatever the last solve left.
TEST(Rows, ApplyLast_LeavesNoFrictionWithoutANormalImpulse) {
  RowsCase c;
  for (size_t k = 0; k < c.rows.impulse.size(); ++k) c.rows.impulse[k] = 1 + 0.25 * double(k);
  c.rows.impulse[3] = c.rows.impulse[9] = 0;  // of contacts 1 and 3, whose friction is 2 N s and more
  const Array<double> free = c.rows.y;
  c.rows.apply_last();
  EXPECT_EQ(c.rows.y_free, free);
  for (const size_t i : {3, 9})
    for (size_t k = i; k < i + 3; ++k) EXPECT_EQ(c.rows.impulse[k], 0) << k;
  const std::vector<double> u = c.free_velocity();
  const std::vector<double> change =
      c.delassus() * std::vector<double>(c.rows.impulse.begin(), c.rows.impulse.end());
  for (uint32_t i = 0; i < RowsCase::kContacts; ++i)
    for (uint32_t k = 0; k < 3; ++k)
      EXPECT_NEAR(c.rows.velocity(i)[int(k)], u[3 * i + k] + change[3 * i + k], 100 * kRounding) << i;
}

// The rate is the velocity along the normal at which the gap closes to nothing (gap / h), or a depth opens by
// a fifth in the planned time, by a tenth of d_c at most. Nearer than 0.6 d_c all of a further depth opens at
// once: with g = distance / d_c - 1 the rates g / 5 and g + 0.32 are the same, -0.08, at distance 0.6 d_c.
TEST(Rows, Rate_ClosesGapsAndOpensDepthsByTheirShare) {
  RowsCase c({4});
  constexpr double d = RowsCase::kOffset;
  constexpr double h = RowsCase::kStep;
  constexpr double planned = 2 * h;
  const Vec3 tangent = c.frame(0, 1);
  const auto rate = [&](double share_of_offset) {
    c.contacts[0].distance = share_of_offset * d;
    c.rows.finish(c.contacts, &tangent.x, h, planned, d);
    return c.rows.rate[0];
  };
  EXPECT_NEAR(rate(1.5), 0.5 * d / h, 1e-15);
  EXPECT_NEAR(rate(1), 0, 1e-15);
  EXPECT_NEAR(rate(0.9), -0.02 * d / planned, 1e-15);
  EXPECT_NEAR(rate(0.6), -0.08 * d / planned, 1e-15);
  EXPECT_NEAR(rate(0.4), -0.28 * d / planned, 1e-15);
  EXPECT_NEAR(rate(-1), -0.1 * d / planned, 1e-15);  // through each other: no faster than a tenth of d_c
  c.rows.recovery = 0.01;
  EXPECT_NEAR(rate(-100), -0.01, 1e-15);  // a recovery speed takes the place of that tenth
}
