// Contacts between two rigid things: velocities, impulses and the solution against what is computed by hand.
#include <gtest/gtest.h>

#include <cmath>

#include "newton_island.h"

namespace {

using namespace dfm;

constexpr double kStep = 1e-3, kMin = 1e-9;  // s, m/s

struct Ball {
  double mass, inertia;
  Vec3 center;
};
const Ball kA{2, 0.01, {0.1, 0.02, 0.05}}, kB{3, 0.03, {-0.04, 0.01, -0.1}};
const Vec3 kAt{0.02, -0.01, 0}, kNormal{0, 0.6, 0.8}, kTangent{1, 0, 0};

// Two free bodies that touch at a place with this velocity of a against b.
struct TwoBodies {
  ContactRows rows{Memory::standard()};

  explicit TwoBodies(Vec3 approach) {
    const RigidSides contact{{0, 0, kA.center}, {1, 0, kB.center}, kAt, kNormal, kTangent};
    const uint32_t bodies[2] = {1, 1};
    rows.build({}, {}, {{}, bodies}, {}, {&contact, 1});
    rows.y_free.assign(rows.y.begin(), rows.y.end());
    for (const ContactRows::Block &b : rows.blocks)
      rows.set_response(b, false, [&](double *matrix) {
        const Ball &ball = b.group == 0 ? kA : kB;
        std::fill_n(matrix, 36, 0.0);
        for (size_t k = 0; k < 6; ++k) matrix[7 * k] = 1 / (k < 3 ? ball.mass : ball.inertia);
      });
    const Vec3 third = cross(kNormal, kTangent);
    store3(rows.drive.data(), {-dot(kNormal, approach), -dot(kTangent, approach), -dot(third, approach)});
    store3(rows.impulse.data(), {});
    store3(rows.compliance.data(), {});
    rows.rate[0] = 0;
    rows.wn[0] = dot(kNormal, response(kNormal));
    rows.wt[0] = std::max(dot(kTangent, response(kTangent)), dot(third, response(third)));
    rows.cross[0] = dot(kTangent, response(kNormal));
    rows.cross[1] = dot(third, response(kNormal));
  }
  // What a unit impulse changes of the velocity of a against b at the place.
  static Vec3 response(Vec3 p) {
    Vec3 sum;
    for (const Ball *ball : {&kA, &kB}) {
      const Vec3 arm = kAt - ball->center;
      sum += (1 / ball->mass) * p + (1 / ball->inertia) * cross(cross(arm, p), arm);
    }
    return sum;
  }
  Vec3 change(uint32_t dof) const { return load3(&rows.y[4 * size_t{dof}]); }
  void expect_momenta_kept() const {
    const Vec3 linear = kA.mass * change(0) + kB.mass * change(2);
    const Vec3 angular = kA.inertia * change(1) + kB.inertia * change(3) +
                         cross(kA.center, kA.mass * change(0)) + cross(kB.center, kB.mass * change(2));
    EXPECT_LT(norm(linear), 1e-14);
    EXPECT_LT(norm(angular), 1e-15);
  }
};

}  // namespace

TEST(RigidRows, AnImpulse_MovesBothBodiesAtThePlace) {
  TwoBodies pair({});
  pair.rows.apply(0, {0.5, -0.2, 0.1});
  pair.expect_momenta_kept();
  const Vec3 third = cross(kNormal, kTangent),
             moved = TwoBodies::response(0.5 * kNormal - 0.2 * kTangent + 0.1 * third);
  const Vec3 u = pair.rows.velocity(0);
  EXPECT_NEAR(u.x, dot(kNormal, moved), 1e-14);
  EXPECT_NEAR(u.y, dot(kTangent, moved), 1e-14);
  EXPECT_NEAR(u.z, dot(third, moved), 1e-14);
}

TEST(RigidRows, TwoBodiesThatMeet_StopAndStickOrSlide) {
  for (const double mu : {0.0, 0.2, 5.0}) {
    SCOPED_TRACE(mu);
    for (const bool turns : {false, true}) {
      TwoBodies pair({0.3, -0.5, -1});
      ContactRows &rows = pair.rows;
      if (turns) {  // what a's spin adds to the velocity of the place
        rows.arc.assign(9, 0.0);
        rows.arc_a.assign(9, 0.0);
        rows.arc_a[1] = 2e-3;
        rows.arc_a[5] = -1e-3;
      }
      const RowsPart part = rows.whole();
      ContactState state;
      test::Laws laws(rows, part, state, kStep, kMin);
      laws.set_all({.mu = mu});
      ContactNewton newton{Memory::standard()};
      newton.begin(rows, part, {}, state, laws, kStep);
      ASSERT_TRUE(newton.solve(kMin, kMin));
      pair.expect_momenta_kept();
      const Vec3 u = rows.velocity(0), l = load3(rows.impulse.data());
      const double slip = std::hypot(u.y, u.z), force = std::hypot(l.y, l.z);
      EXPECT_GT(l.x, 0.1);
      EXPECT_NEAR(u.x, 0, kMin);
      if (mu > 1) EXPECT_NEAR(slip, 0, kMin);
      else EXPECT_NEAR(force, mu * l.x, 1e-9);
      EXPECT_LE(force, mu * l.x * (1 + 1e-12));
      if (!turns) continue;
      // by hand, with the arcs
      const Vec3 spin = pair.change(1);
      const Vec3 place = pair.change(0) + cross(spin, kAt - kA.center) - pair.change(2) -
                         cross(pair.change(3), kAt - kB.center);
      EXPECT_NEAR(u.x, dot(kNormal, place) - rows.drive[0] + 2e-3 * spin.y, 1e-14);
      EXPECT_NEAR(u.y, dot(kTangent, place) - rows.drive[1] - 1e-3 * spin.z, 1e-14);
    }
  }
}
