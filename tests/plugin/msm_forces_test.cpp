// Forces of org.deform.msm: rest, rigid motion, momentum, energy, dampers, degenerate shapes. Sees the
// plugin ABI alone.
#include "msm_host.h"

namespace msm_test {
namespace {

const Params kFull = {2e5, 0.4, 0.003, 0.5, 1.5};

struct Sums {
  Vec force{}, torque{};
  double scale = 0;
};
Sums sums(const Instance &b) {
  Sums s;
  for (uint32_t i = 0; i < b.size(); ++i) {
    const Vec x = b.get(b.x, i), f = b.get(b.f, i);
    s.force = s.force + f;
    s.torque = s.torque + cross(x, f);
    s.scale += norm(f) * std::max(1.0, norm(x));
  }
  return s;
}

TEST(MsmForces, Rest_IsExactlyZero) {
  Host host;
  for (uint32_t stride : {3u, 4u, 5u}) {
    Instance b(host, kuhn_bar(6, 3, 2, 0.07, 0.2), kFull, stride);
    b.forces();
    EXPECT_EQ(b.largest_force(), 0.0);
    EXPECT_EQ(b.energy(), 0.0);
  }
}

TEST(MsmForces, RigidMotion_GivesNoForceAndNoDamping) {
  Host host;
  Params p = kFull;
  p.damping_mass = 0;
  Instance b(host, kuhn_bar(4, 3, 2, 0.1, 0.2), p);
  const Vec axis = (1 / std::sqrt(14.0)) * Vec{1, 2, 3};
  const Vec shift = {0.3, -0.7, 0.2};
  const Vec spin = {2, -1, 0.5};
  const Vec drift = {0.4, 0.1, -0.3};
  for (double angle : {0.3, 1.6, 2.967}) {
    for (uint32_t i = 0; i < b.size(); ++i) {
      const Vec x = rotate(b.mesh.at(i), axis, angle) + shift;
      b.set(b.x, i, x);
      b.set(b.v, i, drift + cross(spin, x));
    }
    b.forces();
    // A spring carries E h^2 per unit strain; points lie ten edges from the origin, which costs a digit
    // of the strain.
    EXPECT_LT(b.largest_force(), 1e-14 * 10 * p.young * 0.1 * 0.1) << angle;
    EXPECT_LT(b.energy(), 1e-24 * p.young);
  }
}

TEST(MsmForces, SpinOfUnitTet_DampersStaySilent) {
  Host host;
  // dampers of about 0.5 N s/m: |f| is the rounding of the projected velocity
  Params soft = {1.0, 0.3, 1.0, 0, 0};
  Instance b(host, regular_tet(), soft);
  for (uint32_t i = 0; i < 4; ++i) b.set(b.v, i, cross({0, 0, 1}, b.mesh.at(i)) + Vec{0.25, 0.5, -0.125});
  b.forces();
  EXPECT_LT(b.largest_force(), 1e-14);
}

TEST(MsmForces, AnyDeformation_KeepsMomentumAndAngularMomentum) {
  Host host;
  Params p = kFull;
  p.damping_mass = 0;
  for (const Mesh &m : {irregular_tet(), kuhn_bar(5, 4, 3, 0.1, 0.2), kuhn_bar(24, 8, 8, 0.05, 0.2)}) {
    Instance b(host, m, p);
    b.shake(0.02, 3);
    b.forces();
    const Sums s = sums(b);
    EXPECT_LT(norm(s.force), 1e-12 * s.scale);
    EXPECT_LT(norm(s.torque), 1e-12 * s.scale);
  }
}

TEST(MsmForces, Force_IsMinusTheGradientOfTheEnergyOverDecades) {
  Host host;
  for (double young : {1.0, 1e4, 1e8})
    for (double volume : {0.0, 0.1, 10.0}) {
      Instance b(host, kuhn_bar(3, 2, 2, 0.1, 0.2), {young, 0.35, 0, 0, volume});
      b.shake(0.01, 0);
      expect_force_is_gradient(b, 1e-6, 2e-7,
                               "young " + std::to_string(young) + " volume " + std::to_string(volume));
    }
}

TEST(MsmForces, EnlargedCell_ContractsByTheVolumeTermAlone) {
  Host host;
  // The volume part is the difference to the springs that the same scale leaves alone; 1 % of size is
  // 3 % of volume.
  for (const Mesh &m : {regular_tet(), irregular_tet()})
    for (double size : {1.01, 0.99, -1.0}) {
      Instance both(host, m, {1.0, 0.25, 0, 0, 1e6}), springs(host, m, {1.0, 0.25, 0, 0, 0});
      Vec center{};
      for (uint32_t i = 0; i < 4; ++i) center = center + 0.25 * m.at(i);
      for (uint32_t i = 0; i < 4; ++i) {
        // -1: inverted, pushed through itself back to its volume
        const Vec x = center + size * (m.at(i) - center);
        both.set(both.x, i, x);
        springs.set(springs.x, i, x);
      }
      both.forces();
      springs.forces();
      for (uint32_t i = 0; i < 4; ++i) {
        const double outward = dot(both.get(both.f, i), m.at(i) - center);
        if (size > 1) EXPECT_LT(outward, 0);
        else EXPECT_GT(outward, 0);
        EXPECT_GT(norm(both.get(both.f, i)), 1e3 * norm(springs.get(springs.f, i)));
      }
    }
}

TEST(MsmForces, DamperAtUnitStretchRate_IsItsConstantWhateverTheLength) {
  Host host;
  for (double length : {0.01, 1.0, 100.0}) {
    Mesh m = regular_tet();
    for (double &x : m.rest) x *= length;
    m.finish();
    Instance b(host, m, {1000, 0.3, 0.25, 0, 0});
    // Edge 0-1 stretches at 1 m/s. Points 2 and 3 move toward its middle and apart so that no other edge
    // changes its length.
    const Vec middle = 0.5 * (m.at(0) + m.at(1));
    const Vec u2 = (1 / norm(m.at(2) - middle)) * (m.at(2) - middle);
    const Vec u3 = (1 / norm(m.at(3) - middle)) * (m.at(3) - middle);
    const double a = 0.5 * 0.5 / std::sqrt(0.75);
    const double co = dot(u2, u3);
    const double si = std::sqrt(1 - co * co);
    const double apart = a * (1 - co) / si;
    const Vec t2 = (1 / si) * (co * u2 - u3), t3 = (1 / si) * (co * u3 - u2);
    b.set(b.v, 0, {-0.5, 0, 0});
    b.set(b.v, 1, {0.5, 0, 0});
    b.set(b.v, 2, apart * t2 - a * u2);
    b.set(b.v, 3, apart * t3 - a * u3);
    const double c = 0.25 * 1000 * m.volume(0) / (length * length);
    b.forces();
    EXPECT_LT(norm(b.get(b.f, 0) - Vec{c, 0, 0}), 1e-13 * c) << length;
    EXPECT_LT(norm(b.get(b.f, 1) + Vec{c, 0, 0}), 1e-13 * c) << length;
    EXPECT_LT(norm(b.get(b.f, 2)) + norm(b.get(b.f, 3)), 1e-13 * c) << length;
  }
}

TEST(MsmForces, MassDamping_IsDragOverMass) {
  Host host;
  Instance b(host, irregular_tet(), {1e4, 0.3, 0, 7, 0});
  for (uint32_t i = 0; i < 4; ++i) b.set(b.v, i, {1, -2, 3});
  b.forces();
  for (uint32_t i = 0; i < 4; ++i)
    EXPECT_LT(norm(b.get(b.f, i) + (7 * b.mesh.mass[i]) * Vec{1, -2, 3}), 1e-12);
}

TEST(MsmForces, InvertedFlatAndCoincidentCells_GiveFiniteForces) {
  Host host;
  const std::array<Vec, 4> shapes[] = {{{{0, 0, 0}, {0, 0, 0}, {0, 0, 0}, {0, 0, 0}}},
                                       {{{0, 0, 0}, {0, 0, 0}, {1, 0, 0}, {1, 0, 0}}},
                                       {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}}},
                                       {{{0, 0, 0}, {0, 1, 0}, {1, 0, 0}, {0, 0, 1}}},
                                       {{{0, 0, 0}, {1e-160, 0, 0}, {0, 1e-180, 0}, {0, 0, 1e-320}}}};
  for (const auto &shape : shapes) {
    Instance b(host, regular_tet(), kFull);
    for (uint32_t i = 0; i < 4; ++i) {
      b.set(b.x, i, shape[i]);
      b.set(b.v, i, {double(i), -1, 2});
    }
    b.forces();
    for (uint32_t i = 0; i < 4; ++i)
      for (double f : b.get(b.f, i)) EXPECT_TRUE(std::isfinite(f));
    EXPECT_TRUE(std::isfinite(b.energy()));
    EXPECT_TRUE(b.bound() >= 0);
  }
  // The same at rest: a flat cell and one with two points at one place have no volume to keep, and no spring
  // between the two.
  Mesh flat = regular_tet();
  flat.rest[11] = 0;
  flat.mass.assign(4, 1);
  Mesh doubled = regular_tet();
  std::copy_n(doubled.rest.begin(), 3, doubled.rest.begin() + 3);
  for (const Mesh &m : {flat, doubled}) {
    Instance b(host, m, kFull);
    ASSERT_EQ(b.status, DFM_OK);
    b.shake(0.1, 1);
    b.forces();
    for (uint32_t i = 0; i < 4; ++i)
      for (double f : b.get(b.f, i)) EXPECT_TRUE(std::isfinite(f));
    EXPECT_TRUE(std::isfinite(b.energy()));
  }
}

TEST(MsmForces, ForcesAccumulate_AndLeaveTheFourthLaneAlone) {
  Host host;
  Instance b(host, kuhn_bar(3, 2, 2, 0.1), kFull), twice(host, b.mesh, kFull);
  b.shake(0.01, 1);
  twice.shake(0.01, 1);
  b.forces();
  // whatever the host keeps in the fourth lane stays out of the forces and is kept
  for (uint32_t i = 0; i < b.size(); ++i) {
    twice.x[4 * i + 3] = std::nan("");
    twice.v[4 * i + 3] = 1e300;
    twice.f[4 * i + 3] = 42;
    twice.set(twice.f, i, {1, 2, 3});
  }
  const dfm_kin k = twice.kin();
  ASSERT_EQ(twice.ops->add_forces(twice.self, &k, twice.f), DFM_OK);
  for (uint32_t i = 0; i < b.size(); ++i) {
    EXPECT_EQ(twice.f[4 * i + 3], 42);
    for (int a = 0; a < 3; ++a) EXPECT_EQ(twice.f[4 * i + a], (a + 1) + b.f[4 * i + a]);
  }
}

TEST(MsmForces, CellEnergy_SumsToTheEnergy) {
  Host host;
  Instance b(host, kuhn_bar(5, 3, 2, 0.1, 0.2), kFull);
  b.shake(0.01, 1);
  EXPECT_EQ(b.ops->extension(b.self, "dfm.stepper/1"), nullptr);
  const double sum = energy_of_cells(b);
  EXPECT_NEAR(sum, b.energy(), 1e-12 * sum);
  EXPECT_GT(sum, 0);
}

}  // namespace
}  // namespace msm_test
