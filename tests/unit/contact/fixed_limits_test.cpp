// Sweeps with fixed friction limits: what J is, and that no sweep increases it.
#include "contact/fixed_limits.h"

#include <cmath>
#include <random>

#include "near.h"
#include "rows_case.h"

namespace {

using namespace dfm;
using test::RowsCase;

// Points, coupled points, a self-stepping body and rigid bodies; approaching and opening contacts.
struct Jam {
  RowsCase c;
  ContactRows &rows = c.rows;
  RowsPart part = rows.whole();
  ContactState law;
  Array<double> limit{HookAllocator<double>(Memory::standard())};

  Jam() {
    law.resize(RowsCase::kContacts, 0);
    for (uint32_t i = 0; i < RowsCase::kContacts; ++i) {
      rows.rate[i] = i % 2 ? -0.5 : 0.3;
      law.form[i] = kSetValuedLaw;
      law.fn[i] = 3;
      law.limit[i] = 6;  // a coefficient of friction of 2
    }
    rows.impulse.assign(rows.impulse.size(), 0.0);
    rows.restore(part);
  }
  double dense_j() const {
    const test::Dense w = c.delassus();
    const std::vector<double> free = c.free_velocity();
    double sum = 0;
    for (size_t i = 0; i < free.size(); ++i) {
      double response = 0;
      for (size_t k = 0; k < free.size(); ++k) response += w(i, k) * rows.impulse[k];
      sum += rows.impulse[i] * (0.5 * response + free[i] + (i % 3 ? 0 : rows.rate[i / 3]));
    }
    return sum;
  }
};

}  // namespace

TEST(FixedLimits, ExcessWork_IsTheQuadraticForm) {
  Jam jam;
  std::mt19937 random(3);
  for (double &l : jam.rows.impulse) l = std::normal_distribution<double>()(random);
  jam.rows.restore(jam.part);
  const ExcessWork e = excess_work(jam.rows, jam.part);
  EXPECT_NEAR(e.work, jam.dense_j(), 1e-12 * e.scale);
  EXPECT_GE(e.scale, 0);
}

TEST(FixedLimits, Sweeps_NeverIncreaseTheWork) {
  Jam jam;
  jam.limit.assign(RowsCase::kContacts, 0.0);
  double last = 0;
  for (int k = 0; k < 40; ++k) {
    if (k == 10) {
      fix_limits(jam.rows, jam.part, jam.law, jam.limit);
      for (uint32_t i = 0; i < RowsCase::kContacts; ++i)
        EXPECT_DOUBLE_EQ(jam.limit[i], 2 * jam.rows.impulse[3 * size_t{i}]);
    }
    sweep_fixed(jam.rows, jam.part, jam.limit.data());
    const ExcessWork e = excess_work(jam.rows, jam.part);
    EXPECT_LE(e.work, last + 1e-13 * e.scale) << "sweep " << k;
    last = e.work;
    for (uint32_t i = 0; i < RowsCase::kContacts; ++i) {
      const double *const l = &jam.rows.impulse[3 * size_t{i}];
      EXPECT_GE(l[0], 0);
      EXPECT_LE(std::hypot(l[1], l[2]), jam.limit[i] * (1 + 1e-12));
    }
  }
  EXPECT_LT(last, 0);
}

TEST(FixedLimits, DroppedImpulses_LeaveTheFreeVelocities) {
  Jam jam;
  for (double &l : jam.rows.impulse) l = 1e8;
  jam.rows.restore(jam.part);
  drop_impulses(jam.rows, jam.part);
  for (size_t i = 0; i < jam.rows.y.size(); ++i) EXPECT_EQ(jam.rows.y[i], jam.rows.y_free[i]);
}
