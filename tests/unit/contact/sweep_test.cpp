// Sweeps on laws that are affine in the normal force stay within what the laws can answer at all.
#include <gtest/gtest.h>

#include <cmath>

#include "contact/solver.h"

namespace {

using namespace dfm;

// A point of 1 kg pressed into a groove of two walls, 45 degrees each: what friction on one wall pushes, the other one carries.
struct Groove {
  ContactRows rows{Memory::standard()};
  ContactState law;

  // steep: dft/dfn; mu: limit over normal force.
  Groove(double steep, double mu, uint8_t mode) {
    const double s = std::sqrt(0.5), speed[3] = {0.3, 0, -1};
    rows.n = 2, rows.ndof = 1;
    rows.begin = {0, 1, 2}, rows.dof = {0, 0}, rows.weight = {1, 1}, rows.block = {kNone};
    rows.y = {speed[0], speed[1], speed[2], 0}, rows.inv_mass = {1, 1, 1, 0}, rows.y_free = rows.y;
    // normal, a tangent that points away from the other wall, the third one
    rows.frame = {s, 0, s, s, 0, -s, 0, 1, 0, -s, 0, s, -s, 0, -s, 0, -1, 0};
    rows.drive.assign(6, 0), rows.rate.assign(2, 0), rows.wn.assign(2, 1), rows.wt.assign(2, 1), rows.cross.assign(4, 0), rows.impulse.assign(6, 0);
    law.resize(2, 0);
    for (uint32_t i = 0; i < 2; ++i) {
      // asked at a normal force that is next to nothing, as where a contact begins
      law.fn[i] = 1e-6, law.limit[i] = mu * 1e-6, law.mode[i] = mode, law.set_valued[i] = 0;
      law.dft_dfn[i] = steep, law.dft_dfn[law.stride + i] = 0;
    }
  }
  double friction(uint32_t i) const { return std::hypot(rows.impulse[3 * i + 1], rows.impulse[3 * i + 2]); }
};

}  // namespace

// Before: every sweep multiplied the impulses by the square of the slope, until they were infinite, and the law was asked at a slip that is no number.
TEST(Sweep, LawThatIsSteepWhereItWasAsked_StaysWithinItsLimit) {
  for (const uint8_t mode : {1, 2}) {
    Groove g(10, 0.5, mode);
    for (int k = 0; k < 400; ++k) sweep(g.rows, g.law, 1e-3);
    for (uint32_t i = 0; i < 2; ++i) {
      const double ln = g.rows.impulse[3 * i];
      EXPECT_LE(ln, 10) << int(mode);
      EXPECT_LE(g.friction(i), std::max(0.5 * ln, 1e-3 * 0.5e-6) * (1 + 1e-12)) << int(mode);
    }
  }
}

TEST(Sweep, RestoredVelocities_AreThoseOfTheImpulses) {
  Groove g(0.2, 0.5, 2);
  for (int k = 0; k < 20; ++k) sweep(g.rows, g.law, 1e-3);
  const Vec3 now = load3(g.rows.y.data());
  g.rows.y.assign(4, NAN);
  g.rows.restore();
  EXPECT_NEAR(norm(load3(g.rows.y.data()) - now), 0, 1e-15);
}

// What is no number is not passed over: a residual of zero would call it solved.
TEST(Sweep, ImpulseThatIsNoNumber_IsNotConverged) {
  Groove g(0.2, 0.5, 2);
  g.rows.impulse[0] = NAN, g.rows.restore();
  Tolerance t;
  t.normal.assign(2, 1e-6), t.tangent.assign(2, 1e-6), t.most_normal = 1e-6;
  EXPECT_EQ(inner_residual(g.rows, g.law, 1e-3, t).due, INFINITY);
}
