// Contacts solved against exact answers and a dense operator (rows_case.h); the residual against its
// definition; sweeps on laws that are affine in the normal force stay within what the laws can answer at all.
#include "contact/solver.h"

#include <gtest/gtest.h>

#include <cmath>

#include "contact/sweeps.h"
#include "near.h"
#include "rows_case.h"
#include "same_tolerance.h"

namespace {

using namespace dfm;
using test::Dense;
using test::expect_near;
using test::RowsCase;

// A point of 1 kg pressed into a groove of two walls, 45 degrees each: what friction on one wall pushes, the
// other one carries.
struct Groove {
  ContactRows rows{Memory::standard()};
  ContactState law;

  // steep: dft/dfn; mu: limit over normal force.
  Groove(double steep, double mu, uint8_t mode) {
    const double s = std::sqrt(0.5), speed[3] = {0.3, 0, -1};
    rows.n = 2;
    rows.ndof = 1;
    rows.begin = {0, 1, 2};
    rows.dof = {0, 0};
    rows.weight = {1, 1};
    rows.block = {kNone};
    rows.y = {speed[0], speed[1], speed[2], 0};
    rows.inverse_mass = {1, 1, 1, 0};
    rows.y_free = rows.y;
    // normal, a tangent that points away from the other wall, the third one
    rows.frame = {s, 0, s, s, 0, -s, 0, 1, 0, -s, 0, s, -s, 0, -s, 0, -1, 0};
    rows.drive.assign(6, 0);
    rows.rate.assign(2, 0);
    rows.compliance.assign(6, 0);
    rows.wn.assign(2, 1);
    rows.wt.assign(2, 1);
    rows.cross.assign(4, 0);
    rows.impulse.assign(6, 0);
    law.resize(2, 0);
    for (uint32_t i = 0; i < 2; ++i) {
      // asked at a normal force that is next to nothing, as where a contact begins
      law.fn[i] = 1e-6;
      law.limit[i] = mu * 1e-6;
      law.mode[i] = mode;
      law.form[i] = dfm::kSmoothLaw;
      law.dft_dfn[i] = steep;
      law.dft_dfn[law.stride + i] = 0;
    }
    linearize(rows, rows.whole(), 1e-3, law);
  }
  double friction(uint32_t i) const { return std::hypot(rows.impulse[3 * i + 1], rows.impulse[3 * i + 2]); }
};

// The force of Coulomb's law at the trial in `s`: what ends the slip, within mu times the normal force.
void solve_with_coulomb(double mu, ContactState &s) {
  for (uint32_t i = 0; i < s.n; ++i) {
    const uint32_t second = s.stride + i;
    const double size = std::hypot(s.ft_stop[i], s.ft_stop[second]);
    s.form[i] = dfm::kSetValuedLaw;
    s.limit[i] = mu * s.fn[i];
    s.mode[i] = size > s.limit[i] ? 2 : 1;
    const double share = size > s.limit[i] ? s.limit[i] / size : 1;
    for (const uint32_t at : {i, second}) {
      s.ft[at] = share * s.ft_stop[at];
      s.dft_dfn[at] = s.mode[i] == 2 ? mu * s.ft_stop[at] / size : 0;
    }
  }
}

// Contacts of the made-up case, from the relative velocities that minus these impulses would leave of rest.
struct Problem : RowsCase {
  ContactState state;
  double mu;
  Problem(std::initializer_list<uint32_t> which, double friction, const std::vector<Vec3> &taken)
      : RowsCase(which), mu(friction) {
    state.resize(rows.n, 0);
    rows.y.assign(rows.y.size(), 0.0);
    rows.drive.assign(rows.drive.size(), 0.0);
    for (uint32_t i = 0; i < rows.n; ++i) rows.apply(i, -taken[i]);
    rows.y_free.assign(rows.y.begin(), rows.y.end());
  }
  std::vector<double> velocities() const {
    std::vector<double> u;
    for (uint32_t i = 0; i < rows.n; ++i)
      for (int axis = 0; axis < 3; ++axis) u.push_back(rows.velocity(i)[axis]);
    return u;
  }
  // Of the velocities by the impulses, by the dense operator.
  std::vector<double> changes() const {
    return delassus() * std::vector<double>(rows.impulse.begin(), rows.impulse.end());
  }
  void request() {
    set_trial(rows, rows.whole(), kStep, rows.wt.data(), state);
    solve_with_coulomb(mu, state);
  }
  // One answer of the law, and `sweeps` on it.
  void pass(uint32_t sweeps) {
    request();
    const RowsPart part = rows.whole();
    AcceleratedImpulses acceleration{Memory::standard()};
    acceleration.start(rows, part);
    for (uint32_t k = 0; k < sweeps; ++k) {
      if (k > 0) acceleration.follow(rows, part);
      sweep(rows, part, state, kStep);
    }
  }
  Vec3 impulse(uint32_t i) const { return load3(&rows.impulse[3 * size_t{i}]); }
};

}  // namespace

// A point of mass m = 1 / w that meets a wall at (-1, 0.3, 0.4) m/s stops along the normal by m. Friction
// ends the slip of 0.5 m/s by m (-0.3, -0.4) where mu allows half of the normal impulse. Below that it takes
// mu m/s along the slip and leaves 0.5 - mu. One answer of the law and one sweep are exact.
TEST(Solver, OnePoint_SticksOrSlidesByTheClosedForm) {
  const double m = 1 / 1.75;
  const Vec3 brought = m * Vec3{1, -0.3, -0.4};
  for (const double mu : {0.6, 0.50001, 0.49999, 0.3}) {
    const double taken = std::min(mu, 0.5);
    Problem p({4}, mu, {brought});
    p.pass(1);
    expect_near(p.impulse(0), m * Vec3{1, -0.6 * taken, -0.8 * taken}, 1e-15);
    expect_near(p.rows.velocity(0), {0, 0.6 * (0.5 - taken), 0.8 * (0.5 - taken)}, 1e-15);
  }
}

TEST(Solver, OnePointThatLeaves_GetsNoForce) {
  Problem p({4}, 0.6, {{-1, 0.3, 0.4}});
  p.pass(1);
  expect_near(p.impulse(0), {}, 0);
}

// Where the contact gives way by min(c l, m) under the impulse l, it leaves that approach: a point that comes
// at 1 m/s, with c = 3 / m, keeps 3/4 m/s, or the largest effect.
TEST(Solver, OnePointThatMeetsAContactThatGives_KeepsWhatItGives) {
  for (const double most : {0.0, 0.3, 0.7, 0.8, 2.0}) {
    Problem p({4}, 0.6, {{1 / 1.75, 0, 0}});
    p.rows.compliance = {3 * 1.75, most, 0};
    p.pass(1);
    const double left = std::min(0.75, most);
    EXPECT_NEAR(p.impulse(0).x, (1 - left) / 1.75, 1e-15) << most;
    EXPECT_NEAR(p.rows.velocity(0).x, -left, 1e-15) << most;
    const test::SameTolerance tolerance{1, 1e-9, 1e-9, 1e-9};
    EXPECT_LT(residual_of(p.rows, p.rows.whole(), p.state, RowsCase::kStep, tolerance).normal, 1e-15) << most;
  }
}

// The normal impulse p_n = -u_n / W_nn changes the slip by W_tn p_n, and friction answers that: in the same
// sweep it is -(u_t + W_tn p_n) / w_t where it sticks.
TEST(Solver, FrictionOfASweep_FollowsTheNewNormalImpulse) {
  Problem p({2}, 10, {{1, -0.3, 0.4}});
  const std::vector<double> u = p.velocities();
  const Dense w = p.delassus();
  p.pass(1);
  const double normal = -u[0] / w(0, 0);
  const double wt = p.rows.wt[0];
  const double first = -(u[1] + w(1, 0) * normal) / wt;
  const double second = -(u[2] + w(2, 0) * normal) / wt;
  expect_near(p.impulse(0), {normal, first, second}, 1e-13);
}

// Where all contacts close and stick the impulses solve W p = -u, and no others do: W has full rank. The
// impulses that the velocities were made of are within their cones, so they are the answer.
TEST(Solver, CoupledContactsThatStick_MatchTheDenseSolution) {
  const std::vector<Vec3> taken = {{1, 0.2, -0.3}, {2, 0.5, 0.4}};
  Problem two({4, 0}, 0.9, taken);
  std::vector<double> against = two.velocities();
  for (double &u : against) u = -u;
  const std::vector<double> exact = test::solved(two.delassus(), against);
  for (int k = 0; k < 20; ++k) two.pass(20);
  for (uint32_t i = 0; i < 2; ++i) {
    expect_near(load3(&exact[3 * i]), taken[i], 1e-12);
    expect_near(two.impulse(i), taken[i], 1e-12);
    expect_near(two.rows.velocity(i), {}, 1e-12);
  }
}

// Signorini's and Coulomb's conditions at every contact, with velocities by the dense operator: an impulse
// only pushes, and only where the contact closes; friction is within its cone, and on its edge against the
// slip where there is any.
TEST(Solver, CoupledContactsThatSlideAndOpen_MeetTheConditions) {
  constexpr double kMu = 0.3, kNear = 1e-10;
  Problem p(
      {0, 1, 2, 3, 4, 5, 6}, kMu,
      {{1, 0.2, -0.1}, {-2, 0.5, 0.4}, {1, 2, -1}, {2, -0.1, 0}, {1, -0.5, 0.5}, {-0.5, 0, 0.25}, {1, 1, 1}});
  const std::vector<double> before = p.velocities();
  for (int k = 0; k < 60; ++k) p.pass(20);
  const std::vector<double> change = p.changes();
  uint32_t open = 0;
  uint32_t stick = 0;
  uint32_t slide = 0;
  for (uint32_t i = 0; i < p.rows.n; ++i) {
    const Vec3 l = p.impulse(i);
    const Vec3 u = load3(&before[3 * size_t{i}]) + load3(&change[3 * size_t{i}]);
    const double friction = std::hypot(l.y, l.z);
    const double slip = std::hypot(u.y, u.z);
    EXPECT_GE(l.x, 0) << i;
    EXPECT_GE(u.x, -kNear) << i;
    EXPECT_LE(l.x * u.x, kNear) << i;
    EXPECT_LE(friction, kMu * l.x + kNear) << i;
    if (slip > kNear) {
      EXPECT_NEAR(l.y, -kMu * l.x * u.y / slip, kNear) << i;
      EXPECT_NEAR(l.z, -kMu * l.x * u.z / slip, kNear) << i;
    }
    ++(l.x == 0 ? open : slip > kNear ? slide : stick);
  }
  EXPECT_GT(open, 0u);
  EXPECT_GT(slide, 0u);
  EXPECT_GT(stick, 0u);
}

// r_n = |min(w_n l_n, u_n + rate)|, r_t = w_t |l_t - law|, with velocities by the dense operator. What the
// law wants of a contact that carries l_n is l_t - u_t / w_t, which would end the slip, cut to the length mu
// l_n.
TEST(Solver, Residual_IsThatOfItsDefinition) {
  constexpr double kMu = 0.4;
  const std::vector<Vec3> taken = {{1, 0.2, -0.1}, {-2, 0.5, 0.4}, {1, 2, -1}};
  Problem p({0, 2, 6}, kMu, taken);
  p.rows.rate = {0.25, -0.5, 0.125};
  const std::vector<double> before = p.velocities();
  p.rows.impulse = {0.5, 0.1, 0.1, 0.25, -0.2, 0, 0.75, 0, 0.3};
  p.rows.restore(p.rows.whole());
  p.request();
  const test::SameTolerance tolerance{3, 0.5, 0.25, 4 * 0.5};
  const Residual found = residual_of(p.rows, p.rows.whole(), p.state, RowsCase::kStep, tolerance);
  const std::vector<double> change = p.changes();
  double normal = 0;
  double tangent = 0;
  double share = 0;
  for (uint32_t i = 0; i < 3; ++i) {
    const Vec3 l = p.impulse(i);
    const Vec3 u = load3(&before[3 * size_t{i}]) + load3(&change[3 * size_t{i}]);
    const double wt = p.rows.wt[i];
    const double a = l.y - u.y / wt;
    const double b = l.z - u.z / wt;
    const double cut = std::min(1.0, kMu * l.x / std::hypot(a, b));
    const double own = wt * std::hypot(cut * a - l.y, cut * b - l.z);
    normal = std::max(normal, std::fabs(std::min(p.rows.wn[i] * l.x, u.x + p.rows.rate[i])));
    tangent = std::max(tangent, own);
    share = std::max(share, own / std::max(0.25, 1e-3 * std::hypot(u.y, u.z)));
  }
  EXPECT_NEAR(found.normal, normal, 1e-13);
  EXPECT_NEAR(found.speed, std::max(normal, tangent), 1e-13);
  EXPECT_NEAR(found.relative, std::max(normal / 0.5, share), 1e-12);
  EXPECT_NEAR(found.required, std::max(normal / (4 * 0.5), share), 1e-12);
  // Where friction may be off by much, the normal residual alone decides: over what it may be off by, and at
  // most.
  const Residual loose = residual_of(p.rows, p.rows.whole(), p.state, RowsCase::kStep,
                                     test::SameTolerance{3, 0.5, 1e6, 4 * 0.5});
  EXPECT_NEAR(loose.relative, normal / 0.5, 1e-12);
  EXPECT_NEAR(loose.required, normal / (4 * 0.5), 1e-12);
}

// At a solution nothing is left, whatever has led there.
TEST(Solver, Residual_OfASolutionVanishes) {
  Problem p({0, 2, 6}, 0.4, {{1, 0.2, -0.1}, {-2, 0.5, 0.4}, {1, 2, -1}});
  for (int k = 0; k < 40; ++k) p.pass(20);
  p.request();
  const test::SameTolerance tolerance{3, 1e-6, 1e-6, 4 * 1e-6};
  EXPECT_LT(residual_of(p.rows, p.rows.whole(), p.state, RowsCase::kStep, tolerance).speed, 1e-11);
}

// Before: every sweep multiplied the impulses by the square of the slope, until they were infinite, and the
// law was asked at a slip that is no number.
// Impulses from elsewhere may do any work: the share of them that lowers the energy most does none.
TEST(Solver, ShareOfLeastWork_IsThatOfTheSolutionAlongTheImpulses) {
  Groove g(0, 0, 0);
  const RowsPart all = g.rows.whole();
  const auto share = [&](double first, double second) {
    g.rows.impulse = {first, 0, 0, second, 0, 0};
    g.rows.restore(all);
    return share_of_least_work(g.rows, all);
  };
  const double s = std::sqrt(0.5), one = s * (1 - 0.3), other = s * (1 + 0.3);  // both walls stop the point
  EXPECT_NEAR(share(one, other), 1, 1e-15);
  EXPECT_EQ(share(0.5 * one, 0.5 * other), 1);
  EXPECT_NEAR(share(4 * one, 4 * other), 0.25, 1e-15);
  g.rows.rate = {10, 10};  // both are far away
  EXPECT_EQ(share(one, other), 0);
}

TEST(Sweep, LawThatIsSteepWhereItWasEvaluated_StaysWithinItsLimit) {
  for (const uint8_t mode : {1, 2}) {
    Groove g(10, 0.5, mode);
    for (int k = 0; k < 400; ++k) sweep(g.rows, g.rows.whole(), g.law, 1e-3);
    for (uint32_t i = 0; i < 2; ++i) {
      const double ln = g.rows.impulse[3 * i];
      EXPECT_LE(ln, 10) << int(mode);
      EXPECT_LE(g.friction(i), std::max(0.5 * ln, 1e-3 * 0.5e-6) * (1 + 1e-12)) << int(mode);
    }
  }
}

// A bristle that is not parallel to the slip turns as it grows, so its force answers a slip along one axis on
// the other one as well, and not the same both ways. The impulse is on the law's tangent, all of it.
TEST(Sweep, LawWhoseSlopeIsNotSymmetric_IsSolvedOnItsTangent) {
  Groove g(0, 0, 2);
  const double h = 1e-3, ft[2] = {5, -3}, vt[2] = {0.1, 0.2}, slope[4] = {-200, -300, 100, -250};
  g.rows.wn[1] = 0;  // one wall only
  g.law.fn[0] = 500;
  g.law.limit[0] = 1e6;
  for (uint32_t k = 0; k < 2; ++k) {
    g.law.ft[k * g.law.stride] = ft[k];
    g.law.vt[k * g.law.stride] = vt[k];
  }
  for (uint32_t k = 0; k < 4; ++k) g.law.dft_dvt[k * g.law.stride] = slope[k];
  linearize(g.rows, g.rows.whole(), h, g.law);
  sweep(g.rows, g.rows.whole(), g.law, h);
  const Vec3 u = g.rows.velocity(0);
  const double v[2] = {u.y - vt[0], u.z - vt[1]};
  for (uint32_t k = 0; k < 2; ++k)
    EXPECT_NEAR(g.rows.impulse[1 + k], h * (ft[k] + slope[2 * k] * v[0] + slope[2 * k + 1] * v[1]), 1e-15);
}

TEST(Sweep, RestoredVelocities_AreThoseOfTheImpulses) {
  Groove g(0.2, 0.5, 2);
  for (int k = 0; k < 20; ++k) sweep(g.rows, g.rows.whole(), g.law, 1e-3);
  const Vec3 now = load3(g.rows.y.data());
  g.rows.y.assign(4, NAN);
  g.rows.restore(g.rows.whole());
  EXPECT_NEAR(norm(load3(g.rows.y.data()) - now), 0, 1e-15);
}

// NaN is not ignored: a residual of zero would count as solved.
TEST(Sweep, ImpulseThatIsNoNumber_IsNotConverged) {
  Groove g(0.2, 0.5, 2);
  g.rows.impulse[0] = NAN;
  g.rows.restore(g.rows.whole());
  const test::SameTolerance t{2, 1e-6, 1e-6, 1e-6};
  EXPECT_EQ(residual_of(g.rows, g.rows.whole(), g.law, 1e-3, t).required, INFINITY);
}
