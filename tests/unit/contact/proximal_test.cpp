// Long strides for contacts of bodies that move in few ways: the operator by its motions, which contacts
// belong together, and loads that sweeps hand over too slowly; what sweeps leave, and their momentum.
#include "contact/proximal.h"

#include <cmath>

#include "contact/solver.h"
#include "near.h"
#include "rows_case.h"
#include "same_tolerance.h"

namespace {

using namespace dfm;
using test::RowsCase;

constexpr uint8_t kNobody[2] = {0, 0};

std::vector<uint32_t> first(uint32_t n) {
  std::vector<uint32_t> out;
  for (uint32_t i = 0; i < n; ++i) out.push_back(i);
  return out;
}

}  // namespace

// W = G G^T, of a body that steps itself against jointed rigid ones.
TEST(Rows, Motions_GiveTheOperator) {
  RowsCase c({2, 2, 2});
  ContactRows::Motions found;
  ASSERT_TRUE(c.rows.motions(first(3), first(2), 15, found));
  EXPECT_EQ(found.rank, 15u);
  const Array<double> &g = found.g;
  const test::Dense w = c.delassus();
  for (size_t i = 0; i < 9; ++i)
    for (size_t j = 0; j < 9; ++j) {
      double sum = 0;
      for (size_t k = 0; k < 16; ++k) sum += g[16 * i + k] * g[16 * j + k];
      EXPECT_NEAR(sum, w(i, j), 1e-12);
    }
  EXPECT_FALSE(c.rows.motions(first(3), first(2), 14, found));
}

TEST(Proximal, Parts_AreWhatSharesMotionsAndHasNoPointsOfItsOwn) {
  Proximal p{Memory::standard()};
  RowsCase apart({0, 2, 4, 2});
  ASSERT_EQ(p.find_parts(apart.rows, apart.rows.whole(), kNobody), 1u);
  EXPECT_EQ(std::vector<uint32_t>(p.contacts(0).begin(), p.contacts(0).end()), (std::vector<uint32_t>{1, 3}));
  const uint8_t second[2] = {0, 1};
  EXPECT_EQ(p.find_parts(apart.rows, apart.rows.whole(), second), 0u) << "a block that is to be left";
  RowsCase tied({1, 2});
  EXPECT_EQ(p.find_parts(tied.rows, tied.rows.whole(), kNobody), 0u) << "the first contact has points too";
}

namespace {

// Three contacts in one place, a hair's breadth apart: the nearest has to carry all, and the farthest does.
struct Equal {
  static constexpr double kMu = 0.5, kFarthest = 2e-3;  // m/s, the farthest rate
  const Vec3 taken{1, 0.2, -0.1};
  RowsCase c{2, 2, 2};
  ContactRows &rows = c.rows;
  ContactState law;
  test::SameTolerance tolerance{3, 1e-9, 1e-9, 1e-9};

  Equal() {
    rows.y.assign(rows.y.size(), 0.0);
    rows.drive.assign(rows.drive.size(), 0.0);
    rows.rate = {0, 0.5 * kFarthest, kFarthest};
    rows.apply(0, -taken);
    rows.y_free.assign(rows.y.begin(), rows.y.end());
    rows.impulse.assign(9, 0.0);
    store3(&rows.impulse[6], taken);
    rows.restore(rows.whole());
    law.resize(3, 0);
    for (uint32_t i = 0; i < 3; ++i) {
      law.form[i] = dfm::kSetValuedLaw;
      law.mode[i] = 1;
      law.fn[i] = 1;
      law.limit[i] = kMu;
    }
  }
  double left() { return inner_residual(rows, rows.whole(), law, RowsCase::kStep, tolerance).speed; }
};

}  // namespace

// Contacts within the allowed residual keep their load; others get a new one, as always.
TEST(Sweep, LoadWithinWhatMayBeLeft_Stays) {
  Equal stays, moves;
  const Array<double> impulse(stays.rows.impulse);
  for (int k = 0; k < 10; ++k) {
    sweep(stays.rows, stays.rows.whole(), stays.law, RowsCase::kStep, 1.01 * Equal::kFarthest);
    sweep(moves.rows, moves.rows.whole(), moves.law, RowsCase::kStep, 0.99 * Equal::kFarthest);
  }
  for (size_t k = 0; k < 9; ++k) EXPECT_NEAR(stays.rows.impulse[k], impulse[k], 1e-12) << k;
  EXPECT_LT(moves.rows.impulse[6], impulse[6]);
}

// The same step in every sweep adds up: the load is handed over in a fraction of the sweeps.
TEST(Momentum, LoadOnTheFartherOfEqualContacts_IsHandedOverSooner) {
  const auto sweeps = [](bool momentum) {
    Equal e;
    Momentum m{Memory::standard()};
    m.start(e.rows, e.rows.whole());
    int count = 0;
    for (; e.left() > 1e-6 && count < 5000; ++count) {
      sweep(e.rows, e.rows.whole(), e.law, RowsCase::kStep);
      if (momentum) m.follow(e.rows, e.rows.whole());
    }
    return count;
  };
  const int plain = sweeps(false);
  EXPECT_LT(plain, 5000);
  EXPECT_LT(sweeps(true), plain / 4);
}

// A sweep moves no more of it than rate / w_n, so that hundreds of them are not enough; a stride moves a
// thousand times as much.
TEST(Proximal, LoadOnTheFartherOfEqualContacts_IsHandedOver) {
  Equal e;
  ContactRows &rows = e.rows;
  const ContactState &law = e.law;
  const Array<double> impulse(rows.impulse), y(rows.y);
  for (int k = 0; k < 200; ++k) sweep(rows, rows.whole(), law, RowsCase::kStep);
  EXPECT_GT(e.left(), 1e-4);
  rows.impulse = impulse;
  rows.y = y;

  Proximal p{Memory::standard()};
  ASSERT_EQ(p.find_parts(rows, rows.whole(), kNobody), 1u);
  ASSERT_TRUE(p.take(rows, 0));
  for (int k = 0; k < 10; ++k) ASSERT_TRUE(p.stride(rows, law, RowsCase::kStep, 1e3)) << k;
  EXPECT_GT(p.work(), 0u);
  EXPECT_LT(e.left(), 1e-9);
  EXPECT_LT(inner_residual(rows, law, RowsCase::kStep, e.tolerance, first(1)).speed, 1e-9);
  test::expect_near(load3(&rows.impulse[0]), e.taken, 1e-6);
  EXPECT_EQ(rows.impulse[6], 0);
  p.put(rows, impulse.data());
  EXPECT_EQ(rows.impulse, impulse);
  test::expect_near(rows.velocity(2), {0, 0, 0}, 1e-12);
}

// Equal contacts share a load in any way. If some of them give way under it, those that do not carry it all.
TEST(Sweep, LoadOnContactsThatGive_IsHandedToOneThatDoesNot) {
  for (const bool gives : {false, true}) {
    Equal swept, strode;
    for (Equal *e : {&swept, &strode}) {
      e->rows.rate.assign(3, 0.0);
      for (size_t i = 1; gives && i < 3; ++i) {
        e->rows.yields[2 * i] = 3 * e->rows.wn[i];
        e->rows.yields[2 * i + 1] = 1;  // m/s
      }
    }
    for (int k = 0; k < 100; ++k) sweep(swept.rows, swept.rows.whole(), swept.law, RowsCase::kStep);
    Proximal p{Memory::standard()};
    ASSERT_EQ(p.find_parts(strode.rows, strode.rows.whole(), kNobody), 1u);
    ASSERT_TRUE(p.take(strode.rows, 0));
    for (int k = 0; k < 10; ++k) ASSERT_TRUE(p.stride(strode.rows, strode.law, RowsCase::kStep, 30)) << k;
    for (Equal *e : {&swept, &strode}) {
      EXPECT_LT(e->left(), 1e-9) << gives;
      EXPECT_NEAR(e->rows.impulse[6], gives ? 0 : e->taken.x, 1e-9) << gives;
      EXPECT_NEAR(e->rows.impulse[0], gives ? e->taken.x : 0, 1e-9) << gives;
    }
  }
}
