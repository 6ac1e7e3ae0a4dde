// The rest state's factor, turned with a body's points.
#include "dynamics/rest_factor.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "../math/grid_system.h"
#include "body/implicit_system.h"
#include "core/handle.h"
#include "math/ldlt_solver.h"
#include "state/world.h"
#include "world.h"

namespace {

constexpr double kStep = 1.0 / 60;

test::BodyOptions options(const char *model) {
  test::BodyOptions o;
  o.model = model;
  o.young = 1e6;
  return o;
}

// A beam of finite elements, its factor, and its points turned and bent.
struct Beam {
  test::Context context;
  dfm_world world = test::make_world(context, {0, 0, 0}, DFM_INTEGRATOR_IMPLICIT_EULER);
  dfm::Body &body;
  dfm::ModelStiffness stiffness{dfm::Memory::standard()};
  dfm::RestFactor factor;

  Beam()
      : body(dfm::resolve<dfm::Body>(dfm::Kind::body, test::make_body(context, world, "beam", {0.1, 0.1, 0.4},
                                                                      300, options("corotational_fem")))),
        factor(dfm::Memory::standard(), body.p, body.model, stiffness, solver()) {}
  std::unique_ptr<dfm::LinearSolver> solver() {
    stiffness.create(body.model, body.p.n);
    auto out = std::make_unique<dfm::LdltSolver>(dfm::Memory::standard());
    out->analyse(stiffness.pattern());
    return out;
  }
  // Turned about x by `turn`, and about y by `bend` times the height.
  std::vector<double> placed(double turn, double bend) const {
    std::vector<double> out(body.p.x.begin(), body.p.x.end());
    for (uint32_t i = 0; i < body.p.n; ++i) {
      double *const p = &out[size_t{dfm::kStride} * i];
      const double angle = bend * p[2], x = p[0] * std::cos(angle) + p[2] * std::sin(angle),
                   z = p[2] * std::cos(angle) - p[0] * std::sin(angle);
      p[0] = x;
      const double y = p[1] * std::cos(turn) - z * std::sin(turn);
      p[2] = p[1] * std::sin(turn) + z * std::cos(turn);
      p[1] = y;
    }
    return out;
  }
};

TEST(RestFactor, ImpulsesOnABentFreeBody_AreItsMomentumAndAngularMomentum) {
  Beam beam;
  const dfm::Phyxels &p = beam.body.p;
  ASSERT_TRUE(beam.factor.prepare(kStep));
  const std::vector<double> x = beam.placed(0.7, 4), b = test::noise(3 * p.n, 1);
  beam.factor.turn(x.data());
  std::vector<double> y(b.size());
  ASSERT_TRUE(beam.factor.solve(b.data(), y.data()));
  dfm::Vec3 off, turned_off;
  for (uint32_t i = 0; i < p.n; ++i) {
    const dfm::Vec3 left = dfm::load3(&b[size_t{3} * i]) - p.mass[i] * dfm::load3(&y[size_t{3} * i]);
    off += left;
    turned_off += cross(dfm::load3(&x[size_t{dfm::kStride} * i]), left);
  }
  EXPECT_LT(norm(off), 1e-12);
  EXPECT_LT(norm(turned_off), 1e-12);
}

TEST(RestFactor, OfATurnedBody_IsTheTurnedOne) {
  Beam beam;
  const dfm::Phyxels &p = beam.body.p;
  const double turn = 1.1, c = std::cos(turn), s = std::sin(turn);
  const auto turned = [&](std::vector<double> a, double way) {
    for (size_t i = 0; i < a.size(); i += 3) {
      const double y = c * a[i + 1] - way * s * a[i + 2];
      a[i + 2] = way * s * a[i + 1] + c * a[i + 2];
      a[i + 1] = y;
    }
    return a;
  };
  const std::vector<double> b = test::noise(3 * p.n, 2);
  std::vector<double> still(b.size()), y(b.size());
  ASSERT_TRUE(beam.factor.prepare(kStep));
  beam.factor.turn(beam.placed(0, 0).data());
  ASSERT_TRUE(beam.factor.solve(turned(b, -1).data(), still.data()));
  beam.factor.turn(beam.placed(turn, 0).data());
  ASSERT_TRUE(beam.factor.solve(b.data(), y.data()));
  const std::vector<double> expected = turned(still, 1);
  double most = 0, worst = 0;
  for (size_t k = 0; k < y.size(); ++k) {
    most = std::max(most, std::fabs(y[k]));
    worst = std::max(worst, std::fabs(y[k] - expected[k]));
  }
  EXPECT_LT(worst, 1e-11 * most);
}

TEST(RestFactor, PointsHeldInPart_AreNotServedWhereTheyTurn) {
  Beam beam;
  beam.body.p.held[3] = 2;
  EXPECT_FALSE(beam.factor.prepare(kStep));
  beam.body.p.held[3] = 0;
  EXPECT_TRUE(beam.factor.prepare(kStep));
}

// A fixed face that is touched does not give way.
TEST(ImplicitPoints, HeldPoints_TakeNoImpulses) {
  for (const char *model : {"corotational_fem", "linear_fem", "msm"}) {
    test::Context context;
    const dfm_world world = test::make_world(context, {0, 0, 0}, DFM_INTEGRATOR_IMPLICIT_EULER);
    dfm::Body &body = dfm::resolve<dfm::Body>(
        dfm::Kind::body, test::make_body(context, world, "beam", {0.1, 0.1, 0.4}, 300, options(model)));
    body.p.held[0] = 7;
    update_inverse_mass(body.p);
    double kinetic = 0;
    const dfm::SubStep now{0, kStep, {}, 1e9, {}};
    ASSERT_TRUE(body.dynamics->free_motion(now, kinetic));
    const double *const alone = body.dynamics->unknowns().system->diagonal_inverse();
    std::vector<double> r(3 * size_t{body.p.n}), v(4 * size_t{body.p.n}, 1.0);
    ASSERT_TRUE(body.dynamics->unknowns().system->residual(v.data(), r.data()));
    for (size_t c = 0; c < 3; ++c) {
      EXPECT_EQ(alone[c], 0) << model;
      EXPECT_EQ(r[c], 0) << model;
      EXPECT_GT(alone[4 + c], 0) << model;
    }
  }
}

}  // namespace
