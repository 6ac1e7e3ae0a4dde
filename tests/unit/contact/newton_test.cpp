// ContactNewton against the conditions that define its problem: complementarity along the normal, the law of
// friction, and the balance of momentum, on made-up islands of every kind of unknown and row.
#include "contact/newton.h"

#include <gtest/gtest.h>

#include <cmath>

#include "near.h"
#include "newton_island.h"
#include "rows_case.h"

namespace {

using namespace dfm;
using test::BristleLaw;
using test::Dense;
using test::expect_near;
using test::Island;
using test::LinearSystem;
using test::RowsCase;

Vec3 any_vector(std::mt19937 &random) {
  std::normal_distribution<double> normal;
  const double x = normal(random);
  const double y = normal(random);
  return {x, y, normal(random)};
}

struct Kind {
  double decades = 3;  // of the masses
  double most_mu = 2;
  double copies = 0.4;  // share of contacts that repeat the one before
  bool body = true, bonds = true, drags = true;
  double gaps = 0;  // m
};

// Points that touch each other, a body and what does not move. The state without motion meets every condition
// on velocities, so that there is a solution.
std::unique_ptr<Island> any_island(uint32_t seed, const Kind &kind) {
  std::mt19937 random(seed);
  const auto upto = [&](double most) { return std::uniform_real_distribution<double>(0, most)(random); };
  const auto below = [&](uint32_t n) { return std::uniform_int_distribution<uint32_t>(0, n - 1)(random); };
  const uint32_t points = 2 + below(5), more = kind.body && below(2) ? 3 + below(4) : 0,
                 nodes = points + more;
  std::vector<double> mass;
  std::vector<Vec3> velocity;
  for (uint32_t k = 0; k < points; ++k) {
    mass.push_back(std::pow(10.0, kind.decades * (upto(2) - 1)));
    velocity.push_back(any_vector(random));
  }
  std::unique_ptr<LinearSystem> body;
  if (more) body = std::make_unique<LinearSystem>(more, 1, std::pow(10.0, upto(4) - 2), random);
  auto island = std::make_unique<Island>(mass, velocity, std::move(body));
  const double mu = upto(kind.most_mu);
  const uint32_t contacts = 1 + below(3 * nodes);
  std::vector<std::pair<uint32_t, double>> side;
  bool obstacle = false;
  Vec3 normal;
  for (uint32_t i = 0; i < contacts; ++i) {
    if (i > 0 && upto(1) < kind.copies) {  // as it was, or turned by a hair
      const double turn = below(3) ? std::pow(10.0, -4 + upto(2)) : 0;
      island->touch(side, obstacle, normal + turn * any_vector(random), upto(kind.gaps));
      continue;
    }
    const uint32_t a = below(nodes), b = (a + 1 + below(nodes - 1)) % nodes;
    obstacle = below(2) == 0;
    normal = any_vector(random);
    side = {{a, 1.0}};
    if (!obstacle) {  // another point, or a triangle
      const double at[3] = {upto(1), upto(1), upto(1)}, sum = at[0] + at[1] + at[2];
      if (nodes < 4 || below(2)) {
        side.emplace_back(b, -1.0);
      } else {
        for (uint32_t k = 0; k < 3; ++k) side.emplace_back((a + 1 + k) % nodes, -at[k] / sum);
      }
    }
    island->touch(side, obstacle, normal, upto(kind.gaps));
  }
  if (kind.bonds && below(2)) {
    const uint32_t a = below(nodes), b = below(2) ? (a + 1 + below(nodes - 1)) % nodes : kNone;
    const bool rigid = below(2);
    island->hold(a, b, rigid ? 0 : std::pow(10.0, upto(4) - 2), rigid ? Vec3{} : 0.3 * any_vector(random));
  }
  if (kind.drags && below(2)) {
    const uint32_t a = below(nodes), b = below(2) ? (a + 1 + below(nodes - 1)) % nodes : kNone;
    island->drag(a, b, any_vector(random), upto(2), 1e3);
  }
  island->build({0, mu});
  return island;
}

// Of the rows case, by the dense operator: contacts of points, coupled surfels, a body that steps itself and
// two rigid bodies that answer each other.
struct AllKinds : RowsCase {
  ContactState state;
  test::Laws laws;
  ContactNewton newton{Memory::standard()};
  explicit AllKinds(double mu, std::initializer_list<uint32_t> which = {0, 1, 2, 3, 4, 5, 6})
      : RowsCase(which), laws(rows, rows.whole(), state, kStep, 1e-8) {
    laws.set_all({0, mu});
    rows.impulse.assign(rows.impulse.size(), 0.0);
  }
  bool solve() {
    ImplicitSystem *const systems[3] = {};
    newton.begin(rows, rows.whole(), systems, state, laws, kStep);
    return newton.solve(1e-8, 1e-8);
  }
  // [3n] m/s, by the impulses
  std::vector<double> velocities() const {
    std::vector<double> u = delassus() * std::vector<double>(rows.impulse.begin(), rows.impulse.end());
    const std::vector<double> free = free_velocity();
    for (size_t k = 0; k < u.size(); ++k) u[k] += free[k];
    return u;
  }
};

void expect_law(const AllKinds &p, double mu) {
  const std::vector<double> u = p.velocities();
  for (uint32_t i = 0; i < p.rows.n; ++i) {
    const Vec3 l = load3(&p.rows.impulse[3 * size_t{i}]);
    const double slip = std::hypot(u[3 * i + 1], u[3 * i + 2]), size = std::hypot(l.y, l.z);
    const double allowed = std::max(1e-7, 1e-3 * slip);
    EXPECT_GE(l.x, 0) << i;
    EXPECT_NEAR(std::min(p.rows.wn[i] * l.x, u[3 * i]), 0, 1e-7) << i;
    EXPECT_LE(size, mu * l.x * (1 + 1e-9)) << i;
    expect_near(p.rows.velocity(i), load3(&u[3 * i]), 1e-8);
    if (!(l.x > 0)) continue;
    EXPECT_LE(std::min(p.rows.wt[i] * (mu * l.x - size), slip), allowed) << i;
    if (slip > 10 * allowed) {
      EXPECT_NEAR((l.y * u[3 * i + 1] + l.z * u[3 * i + 2]), -slip * size, 1e-4 * slip * size) << i;
    }
  }
}

// Nearly contradictory rows may miss by a few tolerances (kContradiction in contact/newton.cpp): `required`
// is 1.
void expect_solved(const Island &p) {
  p.expect_conditions(p.newton.residual().required < 1 ? Island::kTolerance : 20 * Island::kTolerance);
  EXPECT_LE(p.unbalanced(), 2 * Island::kTolerance);
}

}  // namespace

// A point of mass 2 that meets a wall at (-1, 0.3, 0.4) m/s stops along the normal by 2 N s. Friction ends
// the slip of 0.5 m/s by 1 N s where mu allows it, else it takes mu m/s.
TEST(ContactNewton, OnePointOnAWall_IsExact) {
  for (const double mu : {0.0, 0.2, 0.6}) {
    Island p({2}, {{-1, 0.3, 0.4}});
    p.touch({{0, 1.0}}, true, {1, 0, 0});
    p.build({0, mu});
    ASSERT_TRUE(p.solve());
    EXPECT_LE(p.newton.residual().required, 1);
    const double left = std::max(0.0, 0.5 - mu);
    expect_near(p.velocity(0), {0, 0.6 * left, 0.8 * left}, Island::kTolerance);
    EXPECT_NEAR(p.impulse(0).x, 2, 2 * Island::kTolerance);
  }
}

TEST(ContactNewton, EveryKindOfUnknown_MeetsTheConditionsByTheDenseOperator) {
  for (const double mu : {0.0, 0.3, 1.0}) {
    AllKinds p(mu);
    ASSERT_TRUE(p.solve()) << mu;
    EXPECT_LE(p.newton.residual().required, 1) << mu;
    expect_law(p, mu);
  }
}

// Masses from 1 g to 1 t, contacts that come twice or nearly so, rigid and soft bonds, drags.
TEST(ContactNewton, RandomIslands_MeetTheConditions) {
  Kind kind;
  kind.most_mu = 1;
  for (uint32_t seed = 0; seed < 300; ++seed) {
    const auto p = any_island(seed, kind);
    SCOPED_TRACE(seed);
    ASSERT_TRUE(p->solve());
    EXPECT_LE(p->newton.residual().required, 1);
    expect_solved(*p);
  }
}

// With mu above 1 contacts can jam so that the steps go round: at most one in a hundred islands, whose
// impulses stay within the cones.
TEST(ContactNewton, RandomIslandsOfStrongFriction_MeetTheConditions) {
  uint32_t unsolved = 0;
  for (uint32_t seed = 0; seed < 300; ++seed) {
    const auto p = any_island(seed, {});
    SCOPED_TRACE(seed);
    ASSERT_TRUE(p->solve());
    if (p->newton.residual().required <= 1) expect_solved(*p);
    else ++unsolved;
    for (uint32_t i = 0; i < p->rows.n; ++i) {
      const Vec3 l = p->impulse(i);
      EXPECT_LE(std::hypot(l.y, l.z), (1 + 1e-9) * p->laws->law[i].mu * l.x) << i;
    }
  }
  EXPECT_LE(unsolved, 3u);
}

TEST(ContactNewton, ContactsWithoutBias_DoNoWork) {
  for (uint32_t seed = 1000; seed < 1100; ++seed) {
    const auto p = any_island(seed, {});
    ASSERT_TRUE(p->solve()) << seed;
    EXPECT_LE(p->work(), 1e-6 * p->effort()) << seed;
  }
}

TEST(ContactNewton, ContactsThatAreApart_CloseTheirGapAtMost) {
  for (uint32_t seed = 2000; seed < 2100; ++seed) {
    Kind kind;
    kind.gaps = 1e-3;
    const auto p = any_island(seed, kind);
    SCOPED_TRACE(seed);
    ASSERT_TRUE(p->solve());
    expect_solved(*p);
  }
}

// Impulses of redundant contacts are not unique; velocities are: the same contact ten times is that contact.
TEST(ContactNewton, TheSameContactTenTimes_GivesTheVelocityOfOne) {
  for (const double mu : {0.1, 1.0}) {
    Vec3 first;
    for (const uint32_t times : {1u, 10u}) {
      Island p({1, 3}, {{0.2, 1, -1}, {0, 0, 0.5}});
      for (uint32_t k = 0; k < times; ++k) p.touch({{0, 1.0}, {1, -1.0}}, false, {0, 0, 1});
      p.touch({{1, 1.0}}, true, {0, 0, 1});
      p.build({0, mu});
      ASSERT_TRUE(p.solve(1e-8));
      EXPECT_LE(p.newton.residual().required, 1);
      if (times == 1) first = p.velocity(0);
      else expect_near(p.velocity(0), first, 1e-6);
    }
  }
}

// Laws that are stiff: f falls by sigma per meter of slip up to the limit, with a bristle that is stretched
// at the start. At 1e12 N/m that is Coulomb's law with the memory of the bristle.
TEST(ContactNewton, StiffBristles_AreOnTheirLaw) {
  for (const double sigma : {1e3, 1e6, 1e9, 1e12})
    for (uint32_t seed = 0; seed < 20; ++seed) {
      Kind kind;
      kind.most_mu = 1;
      kind.bonds = kind.drags = false;
      const auto p = any_island(3000 + seed, kind);
      for (uint32_t i = 0; i < p->rows.n; ++i)
        p->laws->set(i, {sigma, std::max(0.05, p->laws->law[i].mu), 0.3 / sigma, -0.4 / sigma});
      SCOPED_TRACE(testing::Message() << "sigma " << sigma << " seed " << seed);
      ASSERT_TRUE(p->solve());
      EXPECT_LE(p->newton.residual().required, 1);
      p->expect_conditions();
      EXPECT_LE(p->unbalanced(), 2e-6);
      for (uint32_t i = 0; i < p->rows.n; ++i) {
        // the law's force at the slip, which may be off by the tolerance
        const BristleLaw &law = p->laws->law[i];
        const Vec3 u = p->relative(i), l = p->impulse(i);
        const double kappa = Island::kStep * law.sigma, R = law.mu * l.x / Island::kStep;
        if (!(R > 0)) continue;
        EXPECT_LE(std::hypot(l.y, l.z), (1 + 1e-9) * law.mu * l.x);
        const double t1 = 0.3 + kappa * u.y, t2 = -0.4 + kappa * u.z, s = R / (R + std::hypot(t1, t2));
        const double off = std::hypot(l.y + Island::kStep * t1 * s, l.z + Island::kStep * t2 * s);
        const double slope = Island::kStep * kappa * s;  // of the law, kg
        EXPECT_LE(off / (slope + 1 / p->rows.wt[i]), std::max(2e-6, 1e-2 * std::hypot(u.y, u.z))) << i;
      }
    }
}

// With the derivative of the law a step squares the error: from the multipliers of the solution, velocities
// that are off by a millionth need three steps or so. Without one of its terms each step leaves a share.
TEST(ContactNewton, StepsNearTheSolution_SquareTheError) {
  constexpr uint32_t kIslands = 20;
  const BristleLaw laws[3] = {{0, 0.4}, {300, 0.4, 1e-4, 2e-4}, {1e6, 0.4, 1e-8, 0}};
  for (const BristleLaw &law : laws) {
    uint32_t steps = 0;
    for (uint32_t seed = 0; seed < kIslands; ++seed) {
      Kind kind;
      kind.decades = 0.3;
      kind.copies = 0;
      kind.body = kind.bonds = kind.drags = false;
      const auto p = any_island(4000 + seed, kind);
      p->laws->set_all(law);
      ASSERT_TRUE(p->solve(1e-12)) << seed;
      for (size_t k = 0; k < p->rows.y.size(); ++k) p->rows.y[k] *= k % 2 ? 1 + 1e-6 : 1 - 1e-6;
      ASSERT_TRUE(p->solve(1e-12)) << seed;
      steps += p->newton.steps();
    }
    EXPECT_LE(steps, 4 * kIslands) << law.sigma;
  }
}

// The matrix of a linear body serves all steps of a solve. Another is made where steps go round, and where
// they are as small as rounding.
TEST(ContactNewton, ALinearBody_IsAssembledRarely) {
  uint32_t assembled = 0, steps = 0;
  for (uint32_t seed = 0; seed < 60; ++seed) {
    Kind kind;
    kind.most_mu = 0.3;
    const auto p = any_island(seed, kind);
    if (!p->body) continue;
    ASSERT_TRUE(p->solve()) << seed;
    assembled += p->body->assembled;
    steps += p->newton.steps();
  }
  EXPECT_LT(2 * assembled, steps);
}

TEST(ContactNewton, SecondSolve_GivesTheSameBits) {
  for (uint32_t seed = 5000; seed < 5020; ++seed) {
    const auto p = any_island(seed, {}), q = any_island(seed, {});
    ASSERT_TRUE(any_island(seed + 1, {})->solve());
    ASSERT_TRUE(p->solve() && q->solve());
    EXPECT_EQ(p->rows.impulse, q->rows.impulse) << seed;
    EXPECT_EQ(p->rows.y, q->rows.y) << seed;
    EXPECT_EQ(p->newton.steps(), q->newton.steps());
  }
}

std::unique_ptr<LinearSystem> stiff_body(uint32_t points) {
  std::mt19937 random(3);
  return std::make_unique<LinearSystem>(points, 1, 10, random);
}

// Contacts of a point that is held have no impulse, and do not keep the others from their solution.
TEST(ContactNewton, HeldPointOfABody_FeelsNoContact) {
  for (const double gap : {-0.9, -0.5, 0.0}) {  // of the offset
    auto body = stiff_body(4);
    for (uint32_t c = 0; c < 3; ++c) body->fix(0, c);
    Island island({}, {}, std::move(body));
    for (uint32_t k = 0; k < 3; ++k) island.touch({{k, 1.0}}, true, {0, 0, 1}, k ? 0 : gap * Island::kOffset);
    island.build({0, 0.4});
    ASSERT_TRUE(island.solve()) << gap;
    EXPECT_LE(island.newton.residual().required, 1) << gap;
    EXPECT_LE(island.newton.passes(), 20) << gap;
    EXPECT_EQ(norm(island.impulse(0)), 0) << gap;
    for (uint32_t k = 1; k < 3; ++k) EXPECT_GE(island.relative(k).x, -Island::kTolerance) << gap;
  }
}

// A law with a slope takes no part where the normal is held and the tangents are free.
TEST(ContactNewton, NormalThatIsHeld_MakesNoFriction) {
  auto body = stiff_body(3);
  body->fix(0, 2);
  Island island({}, {}, std::move(body));
  for (uint32_t k = 0; k < 2; ++k) island.touch({{k, 1.0}}, true, {0, 0, 1}, k ? 0 : -0.7 * Island::kOffset);
  island.build({300, 0.4, 1e-4, 2e-4});
  ASSERT_TRUE(island.solve());
  EXPECT_EQ(norm(island.impulse(0)), 0);
}

TEST(ContactNewton, BondOfAPointThatIsHeldAlongOneAxis_HoldsTheOthers) {
  for (uint32_t axis = 0; axis < 3; ++axis) {
    auto body = stiff_body(3);
    body->fix(0, axis);
    Island island({}, {}, std::move(body));
    island.hold(0, kNone, 0, {-0.01, -0.02, -0.03});
    island.build({});
    ASSERT_TRUE(island.solve()) << axis;
    EXPECT_LE(island.newton.residual().required, 1) << axis;
    for (uint32_t c = 0; c < 3; ++c)
      EXPECT_NEAR(island.velocity(0)[int(c)], c == axis ? 0 : 0.01 * (c + 1), 2e-6) << axis;
  }
}

// Rows that cannot all be met end soon, with finite impulses, and say so.
TEST(ContactNewton, RowsThatContradictEachOther_EndUnconverged) {
  for (const double speed : {0.01, 1.0})
    for (const bool with_body : {false, true}) {
      SCOPED_TRACE(testing::Message() << speed << " body " << with_body);
      Island island(with_body ? std::vector<double>{} : std::vector<double>{1.0},
                    with_body ? std::vector<Vec3>{} : std::vector<Vec3>{{}},
                    with_body ? stiff_body(3) : nullptr);
      for (const double side : {1.0, -1.0}) island.touch({{0, 1.0}}, true, {0, 0, side});
      island.build({0, 0.4});
      for (uint32_t i = 0; i < 2; ++i) island.rows.rate[i] = -speed;  // both walls close
      ASSERT_TRUE(island.solve());
      EXPECT_GT(island.newton.residual().required, 1);
      EXPECT_LT(island.newton.passes(), 60);
      for (uint32_t i = 0; i < 2; ++i) EXPECT_LT(norm(island.impulse(i)), 1e12);
    }
}

TEST(ContactNewton, BondsThatContradictEachOther_AreNotTakenForSolved) {
  Island island({1.0}, {{}});
  for (const double side : {1.0, -1.0}) island.hold(0, kNone, 0, {side, 0, 0});
  island.build({});
  ASSERT_TRUE(island.solve());
  EXPECT_GT(island.newton.residual().required, 1);
}
