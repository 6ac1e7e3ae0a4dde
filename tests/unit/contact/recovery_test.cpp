// What opening depths costs: contacts that face each other can open together only at large velocities.
#include "contact/recovery.h"

#include <gtest/gtest.h>

#include <cmath>

#include "contact/fixed_limits.h"

namespace {

using namespace dfm;

constexpr double kOpening = 0.1;  // m/s, at both walls

// A point of 1 kg between two walls that lean away from each other by `lean` (radians to the vertical, each):
// at 45 degrees a groove, near zero a slit that the point can leave upwards alone.
struct Slit {
  ContactRows rows{Memory::standard()};
  RowsPart part;

  explicit Slit(double lean, double speed = 0) {
    const double c = std::cos(lean), s = std::sin(lean);
    rows.n = 2;
    rows.ndof = 1;
    rows.begin = {0, 1, 2};
    rows.dof = {0, 0};
    rows.weight = {1, 1};
    rows.block = {kNone};
    rows.y = {0, 0, -speed, 0};
    rows.alone = {1, 1, 1, 0};
    rows.y_free = rows.y;
    rows.frame = {c, 0, s, s, 0, -c, 0, 1, 0, -c, 0, s, -s, 0, -c, 0, -1, 0};
    rows.drive.assign(6, 0);
    rows.rate.assign(2, -kOpening);
    rows.yields.assign(4, 0);
    rows.wn.assign(2, 1);
    rows.wt.assign(2, 1);
    rows.cross.assign(4, 0);
    rows.impulse.assign(6, 0);
    rows.turn_frames();
    part = rows.whole();
  }
  // Exact, by symmetry: both impulses are the same, and the point moves upwards.
  void solve() {
    const double s = rows.frame[2], needed = std::max(0.0, -rows.rate[0] / s - rows.y_free[2]);
    for (size_t i = 0; i < 2; ++i) rows.impulse[3 * i] = needed / (2 * s);
    rows.restore(part);
  }
  double kinetic(const Array<double> &y) const { return 0.5 * norm2(load3(y.data())); }
};

}  // namespace

TEST(Recovery, WorkOfOpening_IsWhatThePointHasGot) {
  for (const double lean : {0.8, 0.1, 1e-3}) {
    Slit slit(lean);
    slit.solve();
    const OpeningWork o = opening_work(slit.rows, slit.part, 0);
    const double got = slit.kinetic(slit.rows.y);
    EXPECT_NEAR(work_of_opening(slit.rows, slit.part, o.put_in), got, 1e-9 * got) << lean;
    EXPECT_GE(o.put_in, got * (1 - 1e-9)) << lean;
  }
}

TEST(Recovery, GrooveIsAllowed_SlitIsNot) {
  const auto work_over_allowed = [](double lean) {
    Slit slit(lean);
    slit.solve();
    const OpeningWork o = opening_work(slit.rows, slit.part, 0);
    EXPECT_EQ(opens_dearly(slit.rows, slit.part, 0), o.put_in > o.allowed) << lean;
    return work_of_opening(slit.rows, slit.part, o.put_in) / o.allowed;
  };
  EXPECT_LT(work_over_allowed(0.8), 0.2);
  EXPECT_GT(work_over_allowed(1e-3), 1e4);  // 100 m/s where both walls open at 0.1 m/s
}

TEST(Recovery, LoadThatIsCarried_CountsAsNoOpening) {
  Slit slit(0.8, 10);  // falls into the groove, and is stopped there
  slit.solve();
  const OpeningWork o = opening_work(slit.rows, slit.part, 0);
  EXPECT_GT(o.put_in, o.allowed);
  EXPECT_LT(work_of_opening(slit.rows, slit.part, o.put_in), 0);
}

TEST(Recovery, SlowerOpening_DoesSquareTheLess) {
  Slit slit(1e-3);
  slit.solve();
  const OpeningWork before = opening_work(slit.rows, slit.part, 0);
  const double work = work_of_opening(slit.rows, slit.part, before.put_in);
  slow_opening(slit.rows, slit.part, std::sqrt(before.allowed / work));
  drop_impulses(slit.rows, slit.part);
  slit.solve();
  const OpeningWork after = opening_work(slit.rows, slit.part, kOpening);
  EXPECT_NEAR(after.allowed, before.allowed, 1e-12 * before.allowed);
  EXPECT_NEAR(work_of_opening(slit.rows, slit.part, after.put_in), before.allowed, 1e-6 * before.allowed);
  slow_opening(slit.rows, slit.part, 0);
  EXPECT_EQ(opening_work(slit.rows, slit.part, kOpening).put_in, 0);
}
