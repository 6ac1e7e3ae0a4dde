// Anisotropy by frozen extra coordinates (Zerbato 2010, chapter 6): one spring in closed form, both forms,
// frames, fields by cell.
#include "msm_host.h"

namespace msm_test {
namespace {

constexpr double kPi = 3.14159265358979323846;

Params tilted(double slope, Vec axis, bool form_a = false, bool stiffer = false) {
  Params p = {2e5, 0.3, 0, 0, 0};
  p.slope = slope;
  p.axis = axis;
  p.form_a = form_a;
  p.stiffer = stiffer;
  return p;
}
const std::pair<const char *, Params> kAll[] = {{"B", tilted(1.5, {1, 2, -0.5})},
                                                {"A", tilted(1.5, {1, 2, -0.5}, true)},
                                                {"B stiffer", tilted(1.5, {1, 2, -0.5}, false, true)},
                                                {"A stiffer", tilted(1.5, {1, 2, -0.5}, true, true)}};

// A cell of unit edges of which the spring from point 0 to point 1, along x, is alone switched on: 1 N/m.
struct OneSpring : Instance {
  OneSpring(Host &lent, Params p) : Instance(lent, regular_tet(), unit_stiff(p)) {
    mask({1, 2, 3, 4, 5}, false);
  }
  static Params unit_stiff(Params p) {
    p.young = 1 / regular_tet().volume(0);
    return p;
  }
  double pull_at(double stretch) {
    set(x, 1, {1 + stretch, 0, 0});
    forces();
    EXPECT_EQ(get(f, 1)[1], 0) << "off the spring's direction";
    return get(f, 0)[0];
  }
  double tangent() { return (pull_at(1e-6) - pull_at(-1e-6)) / 2e-6; }
};

TEST(MsmAnisotropy, OneSpring_IsSofterByCosineOrItsSquare) {
  for (double slope : {1e-3, 0.1, 0.5, 1.0, 2.3, 10.0, 100.0})
    for (double angle : {0.0, 0.4, 1.1, 1.5}) {
      const double g = slope * std::cos(angle), cos2 = 1 / (1 + g * g);
      const Vec axis = {3 * std::cos(angle), 0, 3 * std::sin(angle)};  // its length does not matter
      Host host;
      EXPECT_NEAR(OneSpring(host, tilted(slope, axis)).tangent() / cos2, 1, 1e-6) << slope << " " << angle;
      EXPECT_NEAR(OneSpring(host, tilted(slope, axis, true)).tangent() / std::sqrt(cos2), 1, 1e-6)
          << slope << " " << angle;
      const double across = slope * std::sin(angle), cos2_across = 1 / (1 + across * across);
      EXPECT_NEAR(OneSpring(host, tilted(slope, axis, false, true)).tangent() / cos2_across, 1, 1e-6)
          << slope << " " << angle;
      EXPECT_NEAR(OneSpring(host, tilted(slope, axis, true, true)).tangent() / std::sqrt(cos2_across), 1,
                  1e-6)
          << slope << " " << angle;
    }
}

// height cos a cos 60 over a spring of unit length, force at d = 0.1
TEST(MsmAnisotropy, StretchByATenth_GivesTheValuesOfFigure65) {
  const double form_b[] = {0.08218, 0.09022, 0.1};
  const double form_a[] = {0.09027, 0.09476, 0.1};
  const double angle[] = {0, kPi / 4, kPi / 2};
  Host host;
  EXPECT_NEAR(OneSpring(host, {}).pull_at(0.1), 0.1, 1e-14);
  for (int n = 0; n < 3; ++n) {
    const Vec axis = {std::cos(angle[n]), std::sin(angle[n]), 0};
    EXPECT_NEAR(OneSpring(host, tilted(0.5, axis)).pull_at(0.1), form_b[n], 5e-6) << angle[n];
    EXPECT_NEAR(OneSpring(host, tilted(0.5, axis, true)).pull_at(0.1), form_a[n], 5e-6) << angle[n];
  }
}

TEST(MsmAnisotropy, SpringAcrossTheSoftAxisOrAlongTheStiffOne_IsUnchangedToTheBit) {
  Host host;
  for (bool form_a : {false, true})
    for (double stretch : {-0.5, -1e-9, 0.0, 0.3, 4.0}) {
      const double plain = OneSpring(host, {}).pull_at(stretch);
      EXPECT_NEAR(OneSpring(host, tilted(5, {0, 1, 0}, form_a)).pull_at(stretch), plain,
                  form_a ? 1e-15 * std::abs(plain) : 0);
      EXPECT_NEAR(OneSpring(host, tilted(5, {1, 0, 0}, form_a, true)).pull_at(stretch), plain,
                  form_a ? 1e-15 * std::abs(plain) : 0);
    }
}

TEST(MsmAnisotropy, SlopeZero_IsThePlainModelToTheBitAndToTheByte) {
  Host plain_host, host;
  const Mesh mesh = kuhn_bar(6, 4, 3, 0.1, 0.2);
  const Params plain = {2e5, 0.4, 0.003, 0.5, 1.5};
  Params flat = plain;
  flat.axis = {0, 5, 1};
  flat.stiffer = true;
  Instance a(plain_host, mesh, plain), b(host, mesh, flat);
  EXPECT_EQ(host.live, plain_host.live);
  const auto same = [&] {
    std::vector<double> k[2], c[2];
    a.forces();
    b.forces();
    EXPECT_EQ(std::memcmp(a.f, b.f, 4 * a.size() * sizeof(double)), 0);
    EXPECT_EQ(a.energy(), b.energy());
    EXPECT_EQ(a.bound(&k[0], &c[0]), b.bound(&k[1], &c[1]));
    EXPECT_TRUE(k[0] == k[1] && c[0] == c[1]);
  };
  a.shake(0.01, 1);
  b.shake(0.01, 1);
  same();
  Params steep = flat;
  steep.slope = 2;
  ASSERT_EQ(b.ops->set_params(b.self, Instance::row(steep).data()), DFM_OK);
  b.forces();
  EXPECT_NE(std::memcmp(a.f, b.f, 4 * a.size() * sizeof(double)), 0);
  ASSERT_EQ(b.ops->set_params(b.self, Instance::row(flat).data()), DFM_OK);
  same();
  EXPECT_EQ(host.live, plain_host.live);
}

TEST(MsmAnisotropy, RestAndRigidMotion_GiveNoForce) {
  Host host;
  for (const auto &[name, p] : kAll) {
    Params damped = p;
    damped.damping_stiffness = 0.01;
    Instance b(host, kuhn_bar(5, 3, 2, 0.1, 0.2), damped);
    b.forces();
    EXPECT_EQ(b.largest_force(), 0) << name;
    EXPECT_EQ(b.energy(), 0) << name;
    const Vec axis = (1 / std::sqrt(14.0)) * Vec{1, 2, 3}, spin = {2, -1, 0.5};
    for (uint32_t i = 0; i < b.size(); ++i) {
      const Vec x = rotate(b.mesh.at(i), axis, 2.0) + Vec{0.3, -0.7, 0.2};
      b.set(b.x, i, x);
      b.set(b.v, i, Vec{0.4, 0.1, -0.3} + cross(spin, x));
    }
    b.forces();
    EXPECT_LT(b.largest_force(), 1e-13 * p.young * 0.1 * 0.1) << name;
    EXPECT_LT(std::abs(b.energy()), 1e-24 * p.young) << name;
  }
}

TEST(MsmAnisotropy, AnyDeformation_KeepsMomentumAndAngularMomentum) {
  Host host;
  for (auto [name, p] : kAll)
    for (const Mesh &m : {irregular_tet(), kuhn_bar(5, 4, 3, 0.1, 0.2)}) {
      p.damping_stiffness = 0.003;
      p.volume = 1;
      Instance b(host, m, p);
      b.shake(0.03, 3);
      b.forces();
      expect_no_force_or_torque(b, name);
    }
}

TEST(MsmAnisotropy, Force_IsMinusTheGradientOfTheEnergyOverDecades) {
  Host host;
  for (auto [name, p] : kAll)
    for (double slope : {1e-3, 0.1, 1.0, 10.0})
      for (double amount : {1e-5, 1e-3, 0.03}) {
        p.slope = slope;
        Instance b(host, kuhn_bar(3, 2, 2, 0.1, 0.2), p);
        b.shake(amount, 0);
        expect_force_is_gradient(
            b, 1e-3 * amount, 3e-6,
            std::string(name) + " slope " + std::to_string(slope) + " amount " + std::to_string(amount));
      }
}

// A cell squeezed into one point: no stretch is left of springs across the axis, next to none of those that
// lean by rounding alone.
TEST(MsmAnisotropy, EnergyOfFormA_WhereAllPointsMeet_IsThatJustBefore) {
  for (Vec axis : {Vec{0, 0, 1}, Vec{1, 0, 0}, Vec{1e-17, 1, 0}, Vec{1, 2, -0.5}})
    for (double slope : {1e-9, 1.0, 12.0}) {
      Host host;
      Instance b(host, regular_tet(), tilted(slope, axis, true));
      const auto squeezed = [&](double to) {
        for (uint32_t i = 0; i < 4; ++i) b.set(b.x, i, to * b.mesh.at(i));
        return b.energy();
      };
      const double before = squeezed(1e-9);
      EXPECT_NEAR(squeezed(0) / before, 1, 1e-7)
          << axis[0] << " " << axis[1] << " " << axis[2] << ", slope " << slope;
    }
}

TEST(MsmAnisotropy, EnergyOfFormA_AgreesWithItsIntegralForAnyStretch) {
  Host host;
  for (double slope : {1e-4, 0.3, 3.0, 100.0}) {
    OneSpring b(host, tilted(slope, {1, 0, 0}, true));
    for (double to : {-1.0 + 1e-9, -0.9, -0.1, -1e-3, -1e-6, 1e-6, 1e-3, 0.1, 1.0, 20.0}) {
      // Simpson's rule on the force law k (L - L0), written without cancellation: exact to rounding with this
      // many pieces, kink at l = 0 included.
      const auto law = [&](double s) {
        return s * (2 + s) / (std::sqrt((1 + s) * (1 + s) + slope * slope) + std::sqrt(1 + slope * slope));
      };
      double sum = 0;
      const int n = 100000;
      for (int k = 0; k < n; ++k)
        sum += to / n / 6 * (law(to * k / n) + 4 * law(to * (k + 0.5) / n) + law(to * (k + 1.0) / n));
      b.set(b.x, 1, {1 + to, 0, 0});
      // The stretch itself is known to 1e-16 only.
      EXPECT_NEAR(b.energy() / sum, 1, 1e-11 + 1e-15 / std::abs(to)) << slope << " " << to;
    }
  }
}

TEST(MsmAnisotropy, BodyTurnedTogetherWithItsAxis_GivesTheTurnedResult) {
  const Vec about = (1 / std::sqrt(14.0)) * Vec{-1, 3, 2};
  Host host;
  for (auto [name, p] : kAll) {
    p.damping_stiffness = 0.002;
    p.volume = 0.5;
    Mesh mesh = kuhn_bar(5, 3, 3, 0.1, 0.2), turned = mesh;
    for (uint32_t i = 0; i < mesh.npoint(); ++i) {
      const Vec x = rotate(mesh.at(i), about, 1.1);
      std::copy(x.begin(), x.end(), &turned.rest[3 * i]);
    }
    Params q = p;
    q.axis = rotate(p.axis, about, 1.1);
    Instance a(host, mesh, p), b(host, turned, q);
    a.shake(0.02, 2);
    for (uint32_t i = 0; i < a.size(); ++i) {
      b.set(b.x, i, rotate(a.get(a.x, i), about, 1.1));
      b.set(b.v, i, rotate(a.get(a.v, i), about, 1.1));
    }
    a.forces();
    b.forces();
    for (uint32_t i = 0; i < a.size(); ++i)
      EXPECT_LT(norm(rotate(a.get(a.f, i), about, 1.1) - b.get(b.f, i)), 1e-10 * a.largest_force()) << name;
    EXPECT_NEAR(a.energy() / b.energy(), 1, 1e-10) << name;
    EXPECT_NEAR(a.bound() / b.bound(), 1, 1e-10) << name;
    // The axis fixed in space instead is another body: the test can tell.
    Instance fixed(host, turned, p);
    std::copy(b.x, b.x + 4 * b.size(), fixed.x);
    EXPECT_GT(std::abs(fixed.energy() / b.energy() - 1), 1e-3) << name;
  }
}

TEST(MsmAnisotropy, AxesByCell_AddUpWithoutASign) {
  Host host;
  const Mesh mesh = kuhn_bar(5, 3, 3, 0.1, 0.2);
  const Params p = tilted(1.5, {1, 2, -0.5});
  Fields uniform = {{"anisotropy_axis", {}}, {"anisotropy_slope", std::vector<double>(mesh.ncell(), 1.5)}};
  Fields flipped = uniform;
  for (uint32_t c = 0; c < mesh.ncell(); ++c)
    for (double a : p.axis) {
      uniform["anisotropy_axis"].push_back(a);
      flipped["anisotropy_axis"].push_back(c % 2 ? -a : a);
    }
  Instance plain(host, mesh, p), field(host, mesh, {2e5}, 4, uniform), other(host, mesh, {2e5}, 4, flipped);
  for (Instance *b : {&plain, &field, &other}) {
    b->shake(0.02, 2);
    b->forces();
  }
  for (uint32_t i = 0; i < plain.size(); ++i)
    EXPECT_LT(norm(plain.get(plain.f, i) - field.get(field.f, i)), 1e-12 * plain.largest_force());
  EXPECT_EQ(std::memcmp(field.f, other.f, 4 * field.size() * sizeof(double)), 0);
}

TEST(MsmAnisotropy, SpringBetweenTwoMaterials_TakesTheMeanByVolume) {
  // Two cells that share a face: the edges of the face take both slopes by volume, the others
  // their own cell's.
  Mesh m = irregular_tet();
  m.rest.insert(m.rest.end(), {0.6, 0.4, -1.3});
  m.cells.insert(m.cells.end(), {0, 2, 1, 4});
  m.finish();
  const double v0 = m.volume(0), v1 = m.volume(1), g0 = 0.5, g1 = 2;
  ASSERT_GT(std::min(v0, v1), 0);
  Host host;
  Params p = {1e5};
  p.axis = {0.2, 1, 0.1};
  Instance b(host, m, p, 4, {{"anisotropy_slope", {g0, g1}}});
  const uint32_t shared = 0;  // edge 0-1
  std::vector<uint32_t> rest;
  for (uint32_t e = 0; e < m.edges.size() / 2; ++e)
    if (e != shared) rest.push_back(e);
  b.mask(rest, false);
  Instance plain(host, m, {1e5});
  plain.mask(rest, false);
  const Vec d = m.at(1) - m.at(0), n = (1 / norm(d)) * d;
  const double l = norm(d);
  const double ad = dot(p.axis, d);
  const double w2 = (v0 * g0 * g0 + v1 * g1 * g1) / (v0 + v1) * ad * ad / dot(p.axis, p.axis);
  const double longer = l + 0.1;
  for (Instance *body : {&b, &plain}) {
    body->set(body->x, 1, m.at(1) + 0.1 * n);
    body->forces();
  }
  const double k = dot(plain.get(plain.f, 0), n) / 0.1;
  const double expected = k * (1 - std::sqrt((l * l + w2) / (longer * longer + w2))) * longer;
  EXPECT_NEAR(dot(b.get(b.f, 0), n) / expected, 1, 1e-12);
}

TEST(MsmAnisotropy, WrongInput_IsRefusedWithASentence) {
  Host host;
  const auto refused = [&](const Params &p, const Fields &fields, const char *word) {
    host.logged.clear();
    Instance b(host, irregular_tet(), p, 4, fields);
    EXPECT_EQ(b.status, DFM_E_ARG) << word;
    EXPECT_NE(host.logged.find(word), std::string::npos) << host.logged;
  };
  refused(tilted(1, {0, 0, 0}), {}, "anisotropy_axis");
  refused(tilted(-1, {1, 0, 0}), {}, "anisotropy_slope");
  refused(tilted(1, {std::nan(""), 0, 0}), {}, "anisotropy_axis");
  refused(tilted(1, {1, 0, 0}), {{"anisotropy_axis", {0, 0, 0}}}, "anisotropy_axis");
  refused({}, {{"young", {-1}}}, "young");
  Params p = tilted(1, {1, 0, 0}, true);
  p.damper = 2;
  refused(p, {}, "voigt");
  EXPECT_EQ(host.live, 0u);
}

}  // namespace
}  // namespace msm_test
