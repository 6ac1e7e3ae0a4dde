// Forces of org.deform.corotational_fem: rest, rigid motion, momentum, energy, dampers, degenerate shapes.
#include "corot_host.h"

namespace corot_test {
namespace {

const Params kFibers = {{"poisson", {0.3}},
                        {"anisotropy_young", {1e6}},
                        {"anisotropy_poisson", {0.4}},
                        {"anisotropy_shear", {1e5}},
                        {"anisotropy_axis", {1, 2, -0.5}}};
const Params kNeoHookean = {{"energy", {1}}, {"poisson", {0.4}}},
             kVenant = {{"energy", {2}}, {"poisson", {0.4}}};
const Params kNodal = {{"locking", {1}}, {"poisson", {0.45}}};
Params damped(Params p) {
  p["damping_stiffness"] = {0.01};
  return p;
}
const Params kUneven = {{"young", {2e5}}, {"poisson", {0.4}}, {"damping_stiffness", {0.01}}};

void move_rigidly(Instance &b, Vec axis, double angle, Vec shift) {
  axis = (1 / norm(axis)) * axis;
  for (uint32_t i = 0; i < b.size(); ++i) {
    b.set(b.x, i, rotate(b.mesh.at(i), axis, angle) + shift);
    b.set(b.v, i, cross(0.7 * axis, b.get(b.x, i)) + Vec{1, 2, 3});
  }
}

TEST(CorotForces, RigidMotionByAnyAngle_GivesNoForce) {
  for (const Mesh &mesh : {irregular_tet(), kuhn_bar(4, 2, 2, 0.5, 0.2)})
    for (const char *rotation : {"polar", "svd", "qr"})
      for (double angle = 0; angle < 6.3; angle += 0.37) {
        Host host;
        Params p = kUneven;
        p["rotation"] = {rotation[0] == 'p' ? 0.0 : rotation[0] == 's' ? 1 : 2};
        Instance b(host, mesh, p);
        move_rigidly(b, {1, -2, 0.5}, angle, {3, 1, -2});
        b.forces();
        // E L^2 with edges of about 1/2 m and more
        EXPECT_LT(b.largest_force(), 1e-12 * 2e5) << rotation << " " << angle;
        EXPECT_LT(b.energy(), 1e-20 * 2e5) << rotation << " " << angle;
      }
}

TEST(CorotForces, ShakenBody_HasNoNetForceOrTorque) {
  for (const Params &p : {Params{}, kUneven, kFibers, damped(kFibers), kNeoHookean, damped(kNeoHookean),
                          kVenant, damped(kVenant), kNodal, damped(kNodal)})
    for (const Mesh &mesh : {irregular_tet(), kuhn_bar(4, 2, 2, 0.1, 0.2)})
      for (const double shake : {1e-3, 0.03, 0.3}) {  // the last turns cells inside out
        Host host;
        Instance b(host, mesh, p);
        b.shake(shake, 2);
        b.forces();
        expect_no_force_or_torque(b, std::to_string(shake));
      }
}

// A quarter of the volume: u = 1/2, so W = K young u^4/8 more, also where fibers have other moduli.
TEST(CorotForces, Collapse_CountsYoungWithFibersToo) {
  for (const double poisson : {0.3, -0.6}) {
    Params p = {{"young", {2e5}},
                {"poisson", {poisson}},
                {"anisotropy_young", {1e6}},
                {"anisotropy_poisson", {0.0}},
                {"anisotropy_axis", {1, 0, 0}}};
    double energy[2];
    for (const double collapse : {0.0, 30.0}) {
      p["collapse"] = {collapse};
      Host host;
      Instance b(host, kuhn_bar(2, 2, 2, 0.1, 0), p);
      ASSERT_EQ(b.status, DFM_OK) << host.logged;
      for (uint32_t i = 0; i < b.size(); ++i) b.x[4 * size_t(i) + 2] *= 0.25;
      energy[collapse > 0] = b.energy();
    }
    EXPECT_NEAR(energy[1] - energy[0], 30 * 2e5 / 128 * 0.008, 1e-9 * energy[1]) << poisson;
  }
}

// With Gram-Schmidt in place of the polar rotation the strain is not symmetric and a torque is left.
TEST(CorotForces, GramSchmidt_LeavesATorque) {
  Host host;
  Instance b(host, irregular_tet(), {{"rotation", {2}}});
  b.shake(0.3, 0);
  b.forces();
  Vec torque{};
  double scale = 0;
  for (uint32_t i = 0; i < 4; ++i) {
    torque = torque + cross(b.get(b.x, i), b.get(b.f, i));
    scale += norm(b.get(b.f, i));
  }
  EXPECT_GT(norm(torque), 1e-3 * scale);
}

// Pressed to a third of the volume, flat, and turned inside out.
TEST(CorotForces, ForceAgainstCollapse_IsTheGradientOfTheEnergyAndBeginsAtHalfTheVolume) {
  for (Params p : {Params{{"poisson", {0.4}}}, kFibers, kNodal})
    for (const double height : {0.3, 0.02, -0.2}) {
      Host host;
      const auto press = [&](Instance &b) {
        for (uint32_t i = 0; i < b.size(); ++i) {
          const Vec x = b.mesh.at(i);
          b.set(b.x, i, {x[0], x[1], height * x[2]});
        }
      };
      Instance without(host, kuhn_bar(3, 2, 2, 0.1, 0.2), p);
      p["collapse"] = {15};
      Instance b(host, kuhn_bar(3, 2, 2, 0.1, 0.2), p);
      press(b);
      press(without);
      EXPECT_GT(b.energy(), 1.01 * without.energy()) << height;
      b.shake(0.001, 0);
      expect_force_is_gradient(b, 1e-7, 1e-5, std::to_string(height));
      b.forces();
      expect_no_force_or_torque(b, std::to_string(height));
      for (Instance *one : {&b, &without}) {
        for (uint32_t i = 0; i < b.size(); ++i) {
          const Vec x = b.mesh.at(i);
          one->set(one->x, i, {x[0], 1.1 * x[1], 0.5 * x[2]});
        }
        one->forces();
      }
      EXPECT_EQ(std::memcmp(b.f, without.f, sizeof(double) * 4 * b.size()), 0);
      EXPECT_EQ(b.energy(), without.energy());
      p.erase("collapse");
    }
}

TEST(CorotForces, Force_IsTheGradientOfTheEnergy) {
  for (const Params &p : {Params{{"poisson", {0.4}}}, kFibers, kNeoHookean, kVenant, kNodal,
                          Params{{"energy", {1}}, {"poisson", {-0.9}}}})
    for (const double shake : {0.005, 0.02}) {
      Host host;
      Instance b(host, kuhn_bar(3, 2, 2, 0.1, 0.2), p);
      b.shake(shake, 0);
      expect_force_is_gradient(b, 1e-6, 1e-6, std::to_string(shake));
      EXPECT_NEAR(energy_of_cells(b), b.energy(), 1e-12 * b.energy());
    }
}

double present_volume(const Instance &b, uint32_t c) {
  const uint32_t *q = &b.mesh.cells[4 * size_t(c)];
  const Vec o = b.get(b.x, q[0]);
  return dot(b.get(b.x, q[1]) - o, cross(b.get(b.x, q[2]) - o, b.get(b.x, q[3]) - o)) / 6;
}

// x = R U X: stress 2 mu (U - I) + lambda tr(U - I) I of the frame, its faces those of the present shape.
TEST(CorotForces, CellStress_OfUniformStretchIsTheClosedForm) {
  constexpr double kLambda = 1e5 * 0.3 / (1.3 * 0.4), kMu = 1e5 / 2.6, kStretch[3] = {1.2, 0.9, 1.05};
  const Vec axis = (1 / std::sqrt(14.0)) * Vec{-1, 3, 2};
  Host host;
  Instance b(host, kuhn_bar(3, 2, 2, 0.1, 0.2), {{"poisson", {0.3}}, {"damping_stiffness", {0.1}}});
  b.shake(0, 1);  // dampers are not in it
  for (uint32_t i = 0; i < b.size(); ++i) {
    const Vec x = b.mesh.at(i);
    b.set(b.x, i, rotate({kStretch[0] * x[0], kStretch[1] * x[1], kStretch[2] * x[2]}, axis, 2.1));
  }
  double expected[3][3] = {};
  for (size_t k = 0; k < 3; ++k) {
    Vec e{};
    e[k] = 1;
    const Vec turned = rotate(e, axis, 2.1);
    const double s = 2 * kMu * (kStretch[k] - 1) + kLambda * (1.2 + 0.9 + 1.05 - 3);
    for (size_t r = 0; r < 3; ++r)
      for (size_t c = 0; c < 3; ++c)
        expected[r][c] += s * kStretch[k] / (1.2 * 0.9 * 1.05) * turned[r] * turned[c];
  }
  const std::vector<double> stress = stress_of_cells(b);
  for (size_t n = 0; n < stress.size(); ++n)
    EXPECT_NEAR(stress[n], expected[kStressRow[n % 6]][kStressColumn[n % 6]], 1e-10 * 1e5);
}

TEST(CorotForces, CellStress_IsSymmetricAndHasTheVirialOfTheForces) {
  for (const Params &p : {Params{{"poisson", {0.4}}}, kFibers, kNeoHookean, kVenant, kNodal}) {
    Host host;
    Instance b(host, kuhn_bar(3, 2, 2, 0.1, 0.2), p);
    b.shake(0.01, 0);
    b.forces();
    const std::vector<double> stress = stress_of_cells(b);
    for (size_t k = 0; k < 6; ++k) {
      const size_t row = size_t(kStressRow[k]), column = size_t(kStressColumn[k]);
      double sum = 0, virial = 0, turned = 0, scale = 0;
      for (uint32_t c = 0; c < b.mesh.ncell(); ++c) {
        const double part = present_volume(b, c) * stress[6 * size_t(c) + k];
        sum += part;
        scale += std::abs(part);
      }
      for (uint32_t i = 0; i < b.size(); ++i) {
        virial -= b.get(b.f, i)[row] * b.get(b.x, i)[column];
        turned -= b.get(b.f, i)[column] * b.get(b.x, i)[row];
      }
      EXPECT_NEAR(sum, virial, 1e-10 * scale) << k;
      EXPECT_NEAR(sum, turned, 1e-10 * scale) << k;
    }
  }
}

TEST(CorotForces, CellStress_OfFlatAndInvertedCellsIsFinite) {
  for (const double size : {0.0, -1.0, 1e-9}) {
    Host host;
    Instance b(host, kuhn_bar(2, 2, 2, 0.1));
    for (uint32_t i = 0; i < b.size(); ++i) b.x[4 * i] *= size;
    for (const double s : stress_of_cells(b)) EXPECT_TRUE(std::isfinite(s)) << size;
  }
}

TEST(CorotForces, RenumberedPoints_GiveTheSameForces) {
  Host host;
  const Mesh mesh = irregular_tet();
  Instance first(host, mesh, kUneven);
  first.shake(0.2, 1);
  first.forces();
  uint32_t order[4] = {0, 1, 2, 3};
  do {
    Mesh turned = mesh;
    for (size_t a = 0; a < 4; ++a)
      for (size_t k = 0; k < 3; ++k) turned.rest[3 * order[a] + k] = mesh.rest[3 * a + k];
    turned.finish();
    Instance b(host, turned, kUneven);
    for (uint32_t a = 0; a < 4; ++a) {
      b.set(b.x, order[a], first.get(first.x, a));
      b.set(b.v, order[a], first.get(first.v, a));
    }
    b.forces();
    for (uint32_t a = 0; a < 4; ++a)
      EXPECT_LT(norm(b.get(b.f, order[a]) - first.get(first.f, a)), 1e-11 * first.largest_force());
  } while (std::next_permutation(order, order + 4));
}

// P V of one cell by the textbook, from the reference's rotation.
TEST(CorotForces, PatchUnderFiniteRotation_FollowsTheReference) {
  // Case patch_corotational of cases.json: x = R U X, the stress of the frame turned with it.
  const double r[3][3] = {{0.2332880370152467, -0.809761909396947, -0.5383886531822373},
                          {0.26270256283485277, 0.5855611010893226, -0.7668804081283211},
                          {0.9362499961364876, 0.03746794604552878, 0.3493309287102364}};
  const double u[3][3] = {
      {1.001, 0.0002, -0.00035}, {0.0002, 0.9993, 0.000325}, {-0.00035, 0.000325, 1.0006}};
  const double stress[3][3] = {{32.095469902687064, -8.313435165096466, -79.32838202436128},
                               {63.503627370088864, -16.256511353997457, -67.64700457705985},
                               {111.80357751454922, 23.065065569768162, 9.99127060942904}};
  std::ifstream in(test::mesh_dir() + "/bench/patch.vtk");
  ASSERT_TRUE(in);
  Mesh mesh;
  std::string word;
  size_t count = 0;
  while (in >> word && word != "POINTS") {}
  in >> count >> word;
  mesh.rest.resize(3 * count);
  for (double &x : mesh.rest) in >> x;
  in >> word >> count >> word;
  for (size_t c = 0; c < count; ++c) {
    uint32_t corners, p;
    in >> corners;
    ASSERT_EQ(corners, 4u);
    for (int a = 0; a < 4; ++a) {
      in >> p;
      mesh.cells.push_back(p);
    }
  }
  mesh.finish();
  Host host;
  Instance b(host, mesh, {{"young", {1e5}}, {"poisson", {0.3}}});
  for (uint32_t i = 0; i < b.size(); ++i) {
    Vec x{};
    for (int k = 0; k < 3; ++k)
      for (int l = 0; l < 3; ++l)
        for (int m = 0; m < 3; ++m) x[size_t(k)] += r[k][l] * u[l][m] * mesh.rest[3 * i + size_t(m)];
    b.set(b.x, i, x);
  }
  b.forces();
  EXPECT_NEAR(b.energy(), 0.11514423076923076, 1e-10 * 0.115);
  // inner points: no force; faces: the surface traction of P
  std::map<std::array<uint32_t, 3>, std::pair<int, std::array<uint32_t, 4>>> faces;
  for (uint32_t c = 0; c < mesh.ncell(); ++c)
    for (int a = 0; a < 4; ++a) {
      const uint32_t *q = &mesh.cells[4 * c];
      std::array<uint32_t, 3> key = {q[(a + 1) % 4], q[(a + 2) % 4], q[(a + 3) % 4]};
      const std::array<uint32_t, 4> face = {key[0], key[1], key[2], q[a]};
      std::sort(key.begin(), key.end());
      faces[key].first++;
      faces[key].second = face;
    }
  std::vector<Vec> expected(b.size());
  for (const auto &[key, face] : faces) {
    if (face.first > 1) continue;
    const auto &p = face.second;
    Vec area = 0.5 * cross(mesh.at(p[1]) - mesh.at(p[0]), mesh.at(p[2]) - mesh.at(p[0]));
    if (dot(area, mesh.at(p[3]) - mesh.at(p[0])) > 0) area = -1 * area;
    Vec pull{};
    for (int k = 0; k < 3; ++k)
      for (int l = 0; l < 3; ++l) pull[size_t(k)] -= stress[k][l] * area[size_t(l)] / 3;
    for (int a = 0; a < 3; ++a) expected[p[a]] = expected[p[a]] + pull;
  }
  for (uint32_t i = 0; i < b.size(); ++i) EXPECT_LT(norm(b.get(b.f, i) - expected[i]), 1e-9 * 100 * 0.1) << i;
}

TEST(CorotForces, UniaxialStretch_MatchesTheClosedForm) {
  const auto rows = test::read_csv(test::reference_dir() + "/elasticity/tables/uniaxial_corotational.csv");
  ASSERT_GT(rows.size(), 10u);
  for (size_t n = 1; n < rows.size(); ++n) {
    const double nu = std::stod(rows[n][0]), stretch = std::stod(rows[n][1]), lateral = std::stod(rows[n][2]);
    const double stress = std::stod(rows[n][4]), energy = std::stod(rows[n][5]);
    Host host;
    Instance b(host, regular_tet(), {{"young", {1e4}}, {"poisson", {nu}}});
    for (uint32_t i = 0; i < 4; ++i) {
      const Vec x = b.mesh.at(i);
      b.set(b.x, i, {stretch * x[0], lateral * x[1], lateral * x[2]});
    }
    b.forces();
    EXPECT_NEAR(b.energy() / b.mesh.volume(0), energy, 1e-9 * 1e4) << nu << " " << stretch;
    // f_a = -V P g_a with P = stress e_x e_x: sum over a of f_a X_a = -V P
    double p[3][3] = {};
    for (uint32_t i = 0; i < 4; ++i)
      for (int k = 0; k < 3; ++k)
        for (int l = 0; l < 3; ++l)
          p[k][l] -= b.get(b.f, i)[size_t(k)] * b.mesh.at(i)[size_t(l)] / b.mesh.volume(0);
    for (int k = 0; k < 3; ++k)
      for (int l = 0; l < 3; ++l)
        EXPECT_NEAR(p[k][l], k == 0 && l == 0 ? stress : 0, 1e-9 * 1e4) << nu << " " << stretch;
  }
}

TEST(CorotForces, Damper_TakesThePowerOfItsStrainRate) {
  Host host;
  Instance plain(host, irregular_tet(), {{"poisson", {0.4}}});
  Instance damped(host, irregular_tet(), {{"poisson", {0.4}}, {"damping_stiffness", {0.02}}});
  for (Instance *b : {&plain, &damped}) b->shake(1e-3, 0.5);
  plain.forces();
  damped.forces();
  // near the rest shape the damper's force is damping_stiffness times the stiffness on the velocities
  double power = 0;
  for (uint32_t i = 0; i < 4; ++i)
    power += dot(damped.get(damped.f, i) - plain.get(plain.f, i), damped.get(damped.v, i));
  EXPECT_LT(power, 0);
  const double h = 1e-6;
  std::vector<double> more;
  for (const double sign : {1.0, -1.0}) {
    Instance moved(host, irregular_tet(), {{"poisson", {0.4}}});
    moved.shake(1e-3, 0.5);
    for (uint32_t i = 0; i < 4; ++i)
      moved.set(moved.x, i, moved.get(moved.x, i) + sign * h * moved.get(moved.v, i));
    moved.forces();
    for (uint32_t i = 0; i < 4; ++i) more.push_back(dot(moved.get(moved.f, i), damped.get(damped.v, i)));
  }
  double change = 0;
  for (size_t i = 0; i < 4; ++i) change += (more[i] - more[4 + i]) / (2 * h);
  EXPECT_NEAR(power, 0.02 * change, 0.01 * std::abs(power));
}

// No force under any rotation, no energy at rest, and near it the forces of the linear law.
TEST(CorotForces, OtherEnergies_AreTheLinearOneAtSmallStrain) {
  for (const double kind : {1.0, 2.0}) {
    Host host;
    Instance linear(host, kuhn_bar(2, 2, 1, 0.1), {{"young", {1}}, {"poisson", {0.4}}});
    Instance other(host, kuhn_bar(2, 2, 1, 0.1), {{"young", {1}}, {"poisson", {0.4}}, {"energy", {kind}}});
    EXPECT_NEAR(other.energy(), 0, 1e-18);
    for (double angle = 0; angle < 6.3; angle += 0.37) {
      move_rigidly(other, {1, -2, 0.5}, angle, {3, 1, -2});
      other.forces();
      EXPECT_LT(other.largest_force(), 1e-14) << angle;
    }
    double before = 0;
    for (const double shake : {1e-4, 1e-5, 1e-6}) {
      for (Instance *b : {&linear, &other}) {
        for (uint32_t i = 0; i < b->size(); ++i) b->set(b->x, i, b->mesh.at(i));
        b->shake(shake, 0);
        b->forces();
      }
      double most = 0;
      for (uint32_t i = 0; i < linear.size(); ++i)
        most = std::max(most, norm(other.get(other.f, i) - linear.get(linear.f, i)));
      const double error = most / linear.largest_force();
      if (before > 0) {
        EXPECT_NEAR(error, 0.1 * before, 0.02 * before) << kind;  // first order in the strain
      }
      before = error;
    }
  }
}

// A stretched body that spins as a whole strains no damper.
TEST(CorotForces, DamperUnderRigidSpin_TakesNothing) {
  Host host;
  Instance plain(host, irregular_tet(), kFibers);
  Params p = kFibers;
  p["damping_stiffness"] = {0.02};
  Instance damped(host, irregular_tet(), p);
  for (Instance *b : {&plain, &damped}) {
    b->shake(0.2, 0);
    for (uint32_t i = 0; i < 4; ++i) b->set(b->v, i, cross({3, -2, 5}, b->get(b->x, i)) + Vec{1, 1, 1});
    b->forces();
  }
  for (uint32_t i = 0; i < 4; ++i)
    EXPECT_LT(norm(damped.get(damped.f, i) - plain.get(plain.f, i)), 1e-12 * plain.largest_force());
}

// The five constants: a pull along and across the axis with the strains that they promise leaves one stress.
TEST(CorotForces, FiveConstants_AreThoseOfThePulls) {
  const double young = 1e5, nu = 0.3, along = 1e6, nu_along = 0.4, shear = 1e5, small = 1e-7;
  Params p = kFibers;
  p["anisotropy_axis"] = {0, 0, 3};
  const auto stress = [&](const double (*strain)[3], double (*out)[3]) {
    Host host;
    Instance b(host, irregular_tet(), p);
    for (uint32_t i = 0; i < 4; ++i) {
      Vec x = b.mesh.at(i);
      for (int k = 0; k < 3; ++k)
        for (int l = 0; l < 3; ++l) x[size_t(k)] += small * strain[k][l] * b.mesh.at(i)[size_t(l)];
      b.set(b.x, i, x);
    }
    b.forces();
    for (int k = 0; k < 3; ++k)
      for (int l = 0; l < 3; ++l) {
        out[k][l] = 0;
        for (uint32_t i = 0; i < 4; ++i)
          out[k][l] -= b.get(b.f, i)[size_t(k)] * b.mesh.at(i)[size_t(l)] / b.mesh.volume(0) / small;
      }
  };
  const double back = nu_along * young / along;  // contraction along the axis for a pull across it
  const double pulls[4][3][3] = {{{-nu_along, 0, 0}, {0, -nu_along, 0}, {0, 0, 1}},
                                 {{1, 0, 0}, {0, -nu, 0}, {0, 0, -back}},
                                 {{0, 0, 0.5}, {0, 0, 0}, {0.5, 0, 0}},
                                 {{0, 0.5, 0}, {0.5, 0, 0}, {0, 0, 0}}};
  const double expected[4][3][3] = {{{0, 0, 0}, {0, 0, 0}, {0, 0, along}},
                                    {{young, 0, 0}, {0, 0, 0}, {0, 0, 0}},
                                    {{0, 0, shear}, {0, 0, 0}, {shear, 0, 0}},
                                    {{0, young / 2.6, 0}, {young / 2.6, 0, 0}, {0, 0, 0}}};
  for (int n = 0; n < 4; ++n) {
    double s[3][3];
    stress(pulls[n], s);
    for (int k = 0; k < 3; ++k)
      for (int l = 0; l < 3; ++l) EXPECT_NEAR(s[k][l], expected[n][k][l], 1e-5 * along) << n << k << l;
  }
}

TEST(CorotForces, DragOverMass_SlowsEveryPointAlike) {
  Host host;
  Instance b(host, kuhn_bar(2, 2, 1, 0.1), {{"damping_mass", {3}}});
  for (uint32_t i = 0; i < b.size(); ++i) b.set(b.v, i, {1, -2, 0.5});
  b.forces();
  for (uint32_t i = 0; i < b.size(); ++i)
    for (int a = 0; a < 3; ++a)
      EXPECT_NEAR(b.get(b.f, i)[size_t(a)], -3 * b.mesh.mass[i] * b.get(b.v, i)[size_t(a)], 1e-9);
}

// Flat, turned inside out, all points in one: finite forces, and with a little drag the way back to no
// energy.
TEST(CorotForces, DegenerateShapes_AreFiniteAndRecover) {
  struct Shape { double x, y, z; };
  for (const Shape &s : {Shape{1, 1, 0}, Shape{1, 0, 0}, Shape{0, 0, 0}, Shape{1, 1, -1}, Shape{-1, -1, -1},
                         Shape{1, -0.3, 0}, Shape{-1, 1e-9, 2}}) {
    Host host;
    Instance b(host, kuhn_bar(3, 2, 2, 0.1, 0.2), {{"damping_mass", {30}}, {"damping_stiffness", {1e-4}}});
    for (uint32_t i = 0; i < b.size(); ++i) {
      const Vec x = b.mesh.at(i);
      // a breath off the exact shape: a perfectly flat one has a plane of symmetry and no reason to leave it
      const double off = 1e-6 * std::sin(double(7 * i));
      b.set(b.x, i, {s.x * x[0] + off, s.y * x[1] - off, s.z * x[2] + 0.5 * off});
    }
    b.forces();
    EXPECT_TRUE(std::isfinite(b.largest_force()));
    EXPECT_LT(b.largest_force(), 1e5 * 0.5);  // E times a few faces
    const double start = b.energy();
    for (int n = 0; n < 6000; ++n) {
      b.forces();
      b.move(0.8 * b.bound());
    }
    EXPECT_LT(b.energy(), 1e-6 * start) << s.x << " " << s.y << " " << s.z;
  }
}

TEST(CorotForces, InvertedNeoHookeanBody_ComesBack) {
  Host host;
  Instance b(host, kuhn_bar(3, 2, 2, 0.1, 0.2),
             {{"energy", {1}}, {"poisson", {0.4}}, {"damping_mass", {30}}, {"damping_stiffness", {1e-4}}});
  for (uint32_t i = 0; i < b.size(); ++i) {
    const Vec x = b.mesh.at(i);
    const double off = 1e-6 * std::sin(double(7 * i));
    b.set(b.x, i, {x[0] + off, x[1] - off, -0.5 * x[2] + off});
  }
  const double start = b.energy();
  for (int n = 0; n < 6000; ++n) {
    b.forces();
    b.move(0.8 * b.bound());
  }
  EXPECT_LT(b.energy(), 1e-6 * start);
}

TEST(CorotForces, ExactlyDegenerateShapes_AreFinite) {
  for (const double size : {0.0, -1.0, 1e-200, 1e30}) {
    Host host;
    Instance b(host, irregular_tet(), kUneven);
    for (uint32_t i = 0; i < 4; ++i) b.set(b.x, i, size * b.mesh.at(i));
    b.forces();
    EXPECT_TRUE(std::isfinite(b.largest_force())) << size;
    EXPECT_TRUE(std::isfinite(b.energy())) << size;
    EXPECT_TRUE(std::isfinite(b.bound())) << size;
  }
}

// A cell that is flat at rest has no volume and no say.
TEST(CorotForces, CellFlatAtRest_GivesNoForce) {
  Mesh mesh = regular_tet();
  mesh.rest.insert(mesh.rest.end(), {0.3, 0.3, 0});
  mesh.cells.insert(mesh.cells.end(), {0, 1, 2, 4});
  mesh.finish();
  Host host;
  Instance flat(host, mesh), alone(host, regular_tet());
  for (uint32_t i = 0; i < 4; ++i)
    for (Instance *b : {&flat, &alone}) b->set(b->x, i, 1.1 * b->get(b->x, i));
  flat.forces();
  alone.forces();
  for (uint32_t i = 0; i < 4; ++i) EXPECT_EQ(flat.get(flat.f, i), alone.get(alone.f, i));
}

// Free body: bar_s1 at 1000 rpm. T5, table dyn_corot_spin (DOP853, rtol 1e-11).
TEST(CorotForces, SpinningBar_KeepsItsMomentumAndFollowsTheReference) {
  const Mesh mesh = read_msh(test::mesh_dir() + "/bars/bar_s1.msh");
  Host host;
  Instance b(host, mesh, {{"young", {5e7}}, {"poisson", {0.3}}});
  double total = 0;
  Vec center{};
  for (uint32_t i = 0; i < b.size(); ++i) {
    total += mesh.mass[i];
    center = center + mesh.mass[i] * mesh.at(i);
  }
  center = (1 / total) * center;
  const Vec omega = {0, 0, 104.71975511965977};
  for (uint32_t i = 0; i < b.size(); ++i) b.set(b.v, i, cross(omega, mesh.at(i) - center));
  const auto momentum = [&] {
    Vec l{};
    for (uint32_t i = 0; i < b.size(); ++i) l = l + mesh.mass[i] * cross(b.get(b.x, i), b.get(b.v, i));
    return l;
  };
  const Vec before = momentum();
  EXPECT_NEAR(before[2], 91.62979, 1e-4);
  const double h = 2e-6;
  EXPECT_GT(b.bound(), h);
  const auto rows = test::read_csv(test::reference_dir() + "/elasticity/tables/dyn_corot_spin.csv");
  double time = 0;
  // leapfrog: velocities half a step behind, so that energies at the rows are of second order
  b.forces();
  for (uint32_t i = 0; i < b.size(); ++i)
    b.set(b.v, i, b.get(b.v, i) - (h / 2 / mesh.mass[i]) * b.get(b.f, i));
  for (size_t n = 1; n < rows.size(); ++n) {
    for (const double end = std::stod(rows[n][0]); time < end - h / 2; time += h) {
      b.forces();
      b.move(h);
    }
    b.forces();
    double kinetic = 0;
    for (uint32_t i = 0; i < b.size(); ++i) {
      const Vec v = b.get(b.v, i) + (h / 2 / mesh.mass[i]) * b.get(b.f, i);
      kinetic += 0.5 * mesh.mass[i] * dot(v, v);
    }
    EXPECT_NEAR(b.energy(), std::stod(rows[n][2]), 1e-4 * 4797) << time;
    EXPECT_NEAR(kinetic, std::stod(rows[n][1]), 1e-4 * 4797) << time;
    EXPECT_NEAR(kinetic + b.energy(), 4797.7243506762625, 1e-5 * 4797) << time;
  }
  // the half step's velocities turn with the body, and their momentum with them
  EXPECT_LT(norm(momentum() - before), 1e-12 * norm(before) * 100);
}

}  // namespace
}  // namespace corot_test
