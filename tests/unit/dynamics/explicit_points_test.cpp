// Ends of explicit points: the free motion but for what contact reaches, whichever solve was before.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>
#include <vector>

#include "../world/inside.h"
#include "step/context.h"
#include "step/stages.h"
#include "support.h"
#include "world.h"

namespace {

struct Falling {
  test::Context context;
  dfm_world world = test::make_world(context);
  dfm::Body *body = nullptr;
  dfm::SubStep now{0, 1e-4, {0, 0, -9.81}, HUGE_VAL, {}};
  Falling() {
    test::BodyOptions o;
    o.position = {0.1, -0.2, 0.3};
    o.velocity = {1, 2, -3};
    test::make_body(context, world, "beam", {0.1, 0.1, 0.1}, 60, o);
    test::run(world, 1e-3, 1e-3);
    body = test::inside(world).bodies[0].get();
    double kinetic = 0;
    EXPECT_TRUE(body->dynamics->add_forces(now, false) && body->dynamics->free_motion(now, kinetic));
  }
  std::vector<double> impulses(unsigned seed, uint32_t every) const {
    std::vector<double> q(3 * size_t{body->surface.nsurfel});
    std::mt19937 random(seed);
    for (size_t k = 0; k < q.size(); ++k)
      if (k / 3 % every == 0) q[k] = 1e-3 * double(random()) / 4294967296.0;
    return q;
  }
  void make_dynamics() const {
    dfm::Body &b = *body;
    b.dynamics = dfm::make_dynamics(test::inside(world).memory(), b.p, b.surface, b.model, b.edges, nullptr);
  }
  // Each surfel with its point, as if it had several.
  void couple() const {
    dfm::Surface &s = body->surface;
    s.row.resize(s.nsurfel + size_t{1});
    std::iota(s.row.begin(), s.row.end(), 0u);
    s.col = s.point;
    s.weight.assign(s.nsurfel, 1.0);
  }
  void end(const std::vector<double> &q) const {
    EXPECT_TRUE(body->dynamics->end_state(now, q.data(), true));
  }
};

// The model gives its forces part by part, or, where they are read later, for all points at once.
TEST(ExplicitPoints, PartsAndWhole_LeadToTheSameBits) {
  struct Moved {
    test::Context context;
    dfm_world world = test::make_world(context);
    dfm::Body *body = nullptr;
    dfm::SubStep now{0, 1e-4, {0, 0, -9.81}, HUGE_VAL, {}};
    double kinetic = 0;
    explicit Moved(bool keep) {
      test::BodyOptions o;
      o.velocity = {1, 2, -3};
      test::make_body(context, world, "beam", {0.4, 0.1, 0.1}, 9000, o);
      test::run(world, 1e-3, 1e-3);
      body = test::inside(world).bodies[0].get();
      std::fill(body->p.f.begin(), body->p.f.end(), 0.0);
      for (size_t k = 0; k < body->p.load.size(); ++k)
        body->p.load[k] = k % 4 == 3 ? 0 : 1e-3 * double(k % 7);
      EXPECT_TRUE(body->dynamics->add_forces(now, keep) && body->dynamics->free_motion(now, kinetic));
    }
  };
  const Moved whole(true), parts(false);
  EXPECT_EQ(whole.body->p.v_free, parts.body->p.v_free);
  EXPECT_EQ(whole.body->p.x_end, parts.body->p.x_end);
  EXPECT_NEAR(whole.kinetic, parts.kinetic, 1e-12 * whole.kinetic);
  EXPECT_NE(whole.body->p.f, parts.body->p.f);
}

// Of a plugin's model: a part that it does not have would be written beyond the end of an array.
TEST(ExplicitPoints, ModelThatGivesOtherParts_HasFailed) {
  const Falling f;
  dfm::Dynamics &points = *f.body->dynamics;
  dfm_part_forces &parts = *f.body->model.part_forces;
  EXPECT_TRUE(points.add_forces(f.now, false));
  parts.forces = [](void *, const dfm_kin *, uint32_t, dfm_take_part_fn take, void *user) {
    take(user, 1 << 20, 0, nullptr, nullptr);
    return dfm_status(DFM_OK);
  };
  EXPECT_FALSE(points.add_forces(f.now, false));
  parts.forces = [](void *, const dfm_kin *, uint32_t, dfm_take_part_fn, void *) {
    return dfm_status(DFM_OK);
  };
  EXPECT_FALSE(points.add_forces(f.now, false));
  // Of three parts the first one three times.
  parts.parts = [](const void *) -> uint32_t { return 3; };
  parts.forces = [](void *, const dfm_kin *, uint32_t, dfm_take_part_fn take, void *user) {
    for (int i = 0; i < 3; ++i) take(user, 0, 0, nullptr, nullptr);
    return dfm_status(DFM_OK);
  };
  f.make_dynamics();
  EXPECT_FALSE(f.body->dynamics->add_forces(f.now, false));
}

// Of a plugin's model: its exception is a failure of the call, and forces then come for all points at once.
TEST(ExplicitPoints, ModelThatThrowsWhereItListsItsParts_IsMovedWithoutThem) {
  const Falling f;
  f.body->model.part_forces->parts = [](const void *) -> uint32_t { throw 1; };
  f.make_dynamics();
  EXPECT_TRUE(f.body->dynamics->add_forces(f.now, false));
}

// Where the guard takes a part of the way, forces have acted for that part, or in full, and contact in full.
TEST(ExplicitPoints, APartOfTheWay_HasTheForcesOfThatPart) {
  for (const bool in_full : {false, true})
    for (const bool in_place : {true, false}) {
      const Falling f;
      const dfm::Phyxels &p = f.body->p;
      const std::vector<double> free(p.v_free.begin(), p.v_free.end());
      if (!in_place) f.couple();
      const std::vector<double> q = f.impulses(1, 2);
      for (uint32_t s = 0; s < f.body->surface.nsurfel; ++s)
        for (size_t k = 0; k < 3; ++k)
          f.body->p.impulse[4 * size_t{f.body->surface.point[s]} + k] = q[3 * s + k];
      f.end(q);
      const double *end = f.body->dynamics->end().v;
      const std::vector<double> v(end, end + free.size());
      f.body->dynamics->take_part(0.25, in_full, q.data());
      end = f.body->dynamics->end().v;
      size_t moved = 0;
      for (size_t k = 0; k < free.size(); ++k) {
        const double forces = (in_full ? 1 : 0.25) * (free[k] - p.v[k]);
        EXPECT_NEAR(end[k], p.v[k] + forces + (v[k] - free[k]), 1e-12) << k;
        EXPECT_NEAR(p.x_end[k], p.x[k] + 0.25 * f.now.h * v[k], 1e-12) << k;
        moved += v[k] != free[k];
      }
      EXPECT_GT(moved, 10u);
    }
}

// A body that is pressed together and cannot move: its forces would drive its points further with each
// sub-step.
TEST(ExplicitPoints, ABodyThatCannotMove_GainsNoEnergy) {
  const Falling f;
  dfm::World &w = test::inside(f.world);
  dfm::StepContext &step = *w.steps;
  dfm::Phyxels &p = f.body->p;
  for (uint32_t i = 0; i < p.n; ++i) p.x[4 * size_t{i}] *= 0.9;
  const std::vector<double> x(p.x.begin(), p.x.end()), v(p.v.begin(), p.v.end());
  const double before = f.body->energy.work;
  for (int k = 0; k < 10; ++k) {
    double kinetic = 0;
    EXPECT_TRUE(f.body->dynamics->add_forces(f.now, false) && f.body->dynamics->free_motion(f.now, kinetic));
    EXPECT_TRUE(f.body->dynamics->end_state(f.now, nullptr, false));
    step.active = {0};
    step.h = f.now.h;
    step.guard.motion = 0;
    step.ended = true;
    uint32_t trouble = 0;
    EXPECT_TRUE(dfm::stage_commit(w, step, &trouble));
  }
  EXPECT_TRUE(std::equal(x.begin(), x.end(), p.x.begin()));
  EXPECT_TRUE(std::equal(v.begin(), v.end(), p.v.begin()));
  EXPECT_EQ(f.body->energy.work, before);
}

TEST(ExplicitPoints, ASecondEnd_IsThatOfItsImpulsesAlone) {
  const Falling once, twice;
  const std::vector<double> free(once.body->p.v_free.begin(), once.body->p.v_free.end());
  twice.end(twice.impulses(1, 2));
  twice.end(twice.impulses(2, 3));
  once.end(once.impulses(2, 3));
  const size_t n = 4 * size_t{once.body->p.n};
  const double *const v = once.body->dynamics->end().v, *const w = twice.body->dynamics->end().v;
  size_t changed = 0;
  for (size_t k = 0; k < n; ++k) {
    EXPECT_EQ(v[k], w[k]) << k;
    EXPECT_EQ(once.body->p.x_end[k], twice.body->p.x_end[k]) << k;
    EXPECT_EQ(once.body->p.x_end[k], once.body->p.x[k] + once.now.h * v[k]) << k;
    changed += v[k] != free[k];
  }
  EXPECT_GT(changed, 10u);
  EXPECT_LT(changed, n / 2);
}

TEST(ExplicitPoints, BeforeAFurtherSolve_TheVelocityIsFreeAgain) {
  const Falling f;
  const std::vector<double> free(f.body->p.v_free.begin(), f.body->p.v_free.end());
  f.end(f.impulses(1, 2));
  f.body->dynamics->end_state(f.now, nullptr, false);
  const double *const v = f.body->dynamics->unknowns().velocity;
  for (size_t k = 0; k < free.size(); ++k) EXPECT_EQ(v[k], free[k]) << k;
}

TEST(ExplicitPoints, ACommittedEnd_IsWhatTheNextSubStepBeginsWith) {
  const Falling f;
  f.end(f.impulses(1, 2));
  const double *const end = f.body->dynamics->end().v;
  const std::vector<double> v(end, end + 4 * size_t{f.body->p.n}),
      x(f.body->p.x_end.begin(), f.body->p.x_end.end());
  f.body->dynamics->commit(f.now);
  for (size_t k = 0; k < v.size(); ++k) {
    EXPECT_EQ(f.body->p.v[k], v[k]) << k;
    EXPECT_EQ(f.body->p.x[k], x[k]) << k;
  }
}

// By power iteration on the forces: the largest eigenvalue of M^-1 (h^2 K + 2 h C) at the body's shape.
double largest(dfm::Body &b, double h) {
  const std::vector<double> x(b.p.x.begin(), b.p.x.end());
  const size_t n = b.p.n;
  const dfm::SubStep now{0, h, {}, HUGE_VAL, {}};
  const auto forces = [&](const std::vector<double> &u, double step, bool moves) {
    for (size_t i = 0; i < n; ++i)
      for (size_t k = 0; k < 3; ++k) {
        b.p.x[4 * i + k] = x[4 * i + k] + (moves ? step * u[3 * i + k] : 0);
        b.p.v[4 * i + k] = moves ? 0 : step * u[3 * i + k];
      }
    EXPECT_TRUE(b.dynamics->add_forces(now, true));
    std::vector<double> f;
    for (size_t i = 0; i < n; ++i) f.insert(f.end(), {b.p.f[4 * i], b.p.f[4 * i + 1], b.p.f[4 * i + 2]});
    return f;
  };
  std::vector<double> u(3 * n);
  std::mt19937 random(3);
  for (double &a : u) a = double(random()) / 4294967296.0 - 0.5;
  double value = 0;
  for (int k = 0; k < 150; ++k) {
    double most = 0, length = 0;
    for (const double a : u) most = std::max(most, std::fabs(a));
    const double e = 1e-7 / most;
    const std::vector<double> up = forces(u, e, true), down = forces(u, -e, true), with = forces(u, e, false),
                              without = forces(u, -e, false);
    for (size_t i = 0; i < u.size(); ++i) {
      const double m = b.p.mass[i / 3];
      const double a = -(h * h * (up[i] - down[i]) + 2 * h * (with[i] - without[i])) / (2 * e * m);
      length += m * u[i] * u[i];
      value = i == 0 ? m * u[i] * a : value + m * u[i] * a;
      u[i] = a + 0.5 * u[i];  // negative ones stay behind
    }
    value /= length;
  }
  std::copy(x.begin(), x.end(), b.p.x.begin());
  std::fill(b.p.v.begin(), b.p.v.end(), 0.0);
  return value;
}

// What is used of the bound is stable in every shape, and at rest it is more than row sums allow.
// unsanitized: too slow there; shorter tests run the same code
TEST(ExplicitPoints, BoundFromTheSpectrum_IsStableInEveryShape) {
  struct Case {
    const char *model, *mesh;
    double poisson, damping;
  };
  for (const Case &c : {Case{"msm", "beam", 0.3, 0},
                        {"msm", "ball", 0.3, 2e-3},
                        {"msm", "beam", 0.45, 1e-3},
                        {"corotational_fem", "beam", 0.3, 0},
                        {"corotational_fem", "ball", 0.45, 2e-3},
                        {"linear_fem", "beam", 0.3, 1e-3},
                        {"meshless", "beam", 0.3, 0}}) {
    SCOPED_TRACE(testing::Message() << c.model << ", " << c.mesh << ", " << c.poisson << ", " << c.damping);
    test::Context context;
    const dfm_world world = test::make_world(context);
    test::BodyOptions o;
    o.model = c.model;
    o.poisson = c.poisson;
    o.damping_stiffness = c.damping;
    test::make_body(context, world, c.mesh, {0.1, 0.1, 0.1}, 200, o);
    test::run(world, 1e-4, 1e-4);
    dfm::Body &b = *test::inside(world).bodies[0];
    const std::vector<double> rest(b.p.x.begin(), b.p.x.end());
    const auto bound = [&](double share) {
      dfm::StepBound found;
      EXPECT_TRUE(b.dynamics->bound(0, share, [](double *, double *) {}, found));
      return found.step;
    };
    const double share = b.integrator.share, measured = bound(share), rows = bound(1);
    std::printf("%s, %s, %g, %g: %.3f of the step by row sums\n", c.model, c.mesh, c.poisson, c.damping,
                measured / rows);
    EXPECT_GT(measured, (c.damping > 0 ? 1.01 : 1.15) * rows);
    std::mt19937 random(5);
    for (const double stretch : {1.0, 1.1, 1.3, 2.0, 0.9, 0.7, 0.4})
      for (const double noise : {0.0, 0.05}) {  // of the edge
        for (size_t i = 0; i < b.p.n; ++i)
          for (size_t k = 0; k < 3; ++k)
            b.p.x[4 * i + k] = (k == 0 ? stretch : 1) * rest[4 * i + k] +
                               (k == 1 ? 0.3 * (stretch - 1) : 0) * rest[4 * i] +
                               noise * b.surface.median_edge * (double(random()) / 2147483648.0 - 1);
        EXPECT_LE(largest(b, 0.9 * bound(share)), 4) << stretch << ", " << noise;
      }
  }
}

}  // namespace
