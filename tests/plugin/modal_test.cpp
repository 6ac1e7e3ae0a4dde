// The plugin model_reduced, type org.deform.modal: frequencies, the exact step, free bodies, answers.
#include "near.h"
#include "stepper_host.h"

namespace {

using namespace stepper_test;

const dfm_type &modal() { return type_of("model_reduced"); }

Mesh mesh_of(const std::string &name) { return read_msh(test::mesh_dir() + "/" + name + ".msh"); }

const double kTurn = 2 * std::acos(-1.0);

std::vector<double> modes_of(const Mesh &m, const Params &p, const std::vector<uint8_t> &fixed = {}) {
  Host host;
  const Stepper b(host, modal(), m, p, fixed);
  EXPECT_EQ(b.status, DFM_OK) << host.logged;
  return frequencies(host.logged);
}

// Rows mesh, bc, mass, then eigenvalues, of the same elements and lumped masses.
std::vector<double> reference_eigenvalues(const std::string &mesh, const std::string &bc) {
  for (const auto &row :
       test::read_csv(test::reference_dir() + "/elasticity/tables/modal_p1_eigenvalues_rad2_s2.csv"))
    if (row[0] == mesh && row[1] == bc && row[2] == "lumped") {
      std::vector<double> out;
      for (size_t k = 3; k < row.size(); ++k) out.push_back(std::strtod(row[k].c_str(), nullptr));
      return out;
    }
  ADD_FAILURE() << mesh << " " << bc << " is not in the table";
  return {};
}

// unsanitized: too slow there; shorter tests run the same code
TEST(Modal, FrequenciesOfBarsAndSpheres_AreThoseOfTheSameElements) {
  const std::pair<const char *, const char *> meshes[] = {
      {"bars/bar_s2", "bar_s2"}, {"bars/bar_u3", "bar_u3"}, {"spheres/sphere_3", "sphere_3"}};
  for (const auto &[path, name] : meshes) {
    const Mesh m = mesh_of(path);
    for (const bool held : {false, true}) {
      if (held && name[0] == 's') continue;
      const std::vector<double> wanted = reference_eigenvalues(name, held ? "cantilever" : "free");
      const std::vector<double> hertz =
          modes_of(m, {{"young", 1e7}, {"modes", 12}}, held ? clamp_of(m) : std::vector<uint8_t>{});
      ASSERT_GE(hertz.size(), wanted.size());
      for (size_t k = 0; k < wanted.size(); ++k)
        EXPECT_NEAR(std::pow(kTurn * hertz[k], 2) / wanted[k], 1, 1e-8) << name << held << " mode " << k;
    }
  }
}

// Lamb 1881: five torsional modes k_s a = 2.5011, five spheroidal 2.6462; lumped masses give less.
// unsanitized: too slow there; shorter tests run the same code
TEST(Modal, FrequenciesOfAFreeSphere_KeepTheirMultiplicity) {
  const std::vector<double> hertz = modes_of(mesh_of("spheres/sphere_4"), {{"young", 1e7}, {"modes", 14}});
  ASSERT_EQ(hertz.size(), 14u);
  EXPECT_LT(hertz[4] / hertz[0], 1.005);
  EXPECT_LT(hertz[9] / hertz[5], 1.005);
  EXPECT_GT(hertz[5] / hertz[4], 1.03);
  EXPECT_GT(hertz[10] / hertz[9], 1.2);
  EXPECT_NEAR(hertz[0] / 493.742, 1, 0.03);
  EXPECT_NEAR(hertz[5] / 522.383, 1, 0.03);
}

// unsanitized: too slow there; shorter tests run the same code
TEST(Modal, FrequenciesOfAFineBar_AreNearTheContinuum) {
  const Mesh m = mesh_of("bars/bar_u3");
  const double held[] = {1.611, 1.611, 9.662, 9.662, 14.27}, free[] = {9.934, 9.934, 25.88, 25.88, 28.49};
  const std::vector<double> cantilever = modes_of(m, {{"young", 1e7}, {"modes", 8}}, clamp_of(m));
  const std::vector<double> loose = modes_of(m, {{"young", 1e7}, {"modes", 8}});
  // of this mesh: bending 7 % above, torsion with lumped masses 9 % off
  for (int k = 0; k < 5; ++k) {
    EXPECT_NEAR(cantilever[k] / held[k], 1, 0.10) << k;
    EXPECT_NEAR(loose[k] / free[k], 1, 0.10) << k;
  }
}

// The cube's cells turn into each other about its diagonal: eigenvalues are double to the last digits, where
// Lanczos's method sees one vector. It finds the same modes as a dense solver.
// unsanitized: too slow there; shorter tests run the same code
TEST(Modal, DoubleModesOfACube_AreBothFound) {
  const Mesh m = kuhn_bar(5, 5, 5, 0.02);
  const std::vector<double> few = modes_of(m, {{"modes", 24}}), all = modes_of(m, {{"modes", 300}});
  ASSERT_EQ(few.size(), 24u);
  ASSERT_EQ(all.size(), 300u);
  int doubles = 0;
  for (size_t k = 0; k < few.size(); ++k) {
    EXPECT_NEAR(few[k] / all[k], 1, 1e-9) << k;
    doubles += k > 0 && few[k] / few[k - 1] < 1 + 1e-9;
  }
  EXPECT_GE(doubles, 5);
}

// With all modes the step is exact: the clamped bar under sudden gravity (exact modal sum), at 0.05 s each,
// five periods of the fastest mode.
// unsanitized: too slow there; shorter tests run the same code
TEST(Modal, AllModesOfAClampedBar_EqualTheExactMotion) {
  const Mesh m = mesh_of("bars/bar_s2");
  const auto table = test::read_csv(test::reference_dir() + "/elasticity/tables/dyn_linear_step.csv");
  for (const int run : {0, 1}) {
    double alpha = 0, beta = 0, worst = 0;
    for (const auto &row : table)
      if (row[0] == std::to_string(run)) {
        alpha = std::strtod(row[1].c_str(), nullptr);
        beta = std::strtod(row[2].c_str(), nullptr);
      }
    Host host;
    Stepper b(host, modal(), m,
              {{"young", 1e5}, {"modes", 1024}, {"damping_mass", alpha}, {"damping_stiffness", beta}},
              clamp_of(m));
    ASSERT_EQ(b.status, DFM_OK) << host.logged;
    b.dt = 4e-3;
    b.pull({0, 0, -0.2});
    for (int n = 0; n < 500; ++n) b.step();
    const auto rows = test::read_csv(test::reference_dir() + "/elasticity/fields/dyn_linear_damp" +
                                     std::to_string(run) + "_t2.csv");
    double most = 0;
    for (size_t r = 1; r < rows.size(); ++r) {
      const uint32_t i = uint32_t(std::stoul(rows[r][0]));
      for (int a = 0; a < 3; ++a) {
        const double u = std::strtod(rows[r][size_t(1 + a)].c_str(), nullptr);
        most = std::max(most, std::abs(u));
        worst = test::worse(worst, std::abs(b.get(b.x, i)[size_t(a)] - m.at(i)[size_t(a)] - u));
      }
    }
    EXPECT_LT(worst / most, 1e-9) << "run " << run;
  }
}

// One step or a hundred: the same, below and above critical damping, by the series and by the closed form.
TEST(Modal, StepsOfAnyLength_GiveTheSameMotion) {
  const Mesh m = kuhn_bar(4, 1, 1, 0.05);
  for (const double damping : {0.0, 1e-3, 0.1}) {
    const auto move = [&](int pieces) {
      Host host;
      Stepper b(host, modal(), m,
                {{"young", 1e5}, {"modes", 10}, {"damping_stiffness", damping}, {"damping_mass", damping}},
                clamp_of(m));
      b.dt = 6e-3 / pieces;
      b.pull({0, 0.1, -0.2});
      for (int n = 0; n < pieces; ++n) b.step();
      return std::vector<double>(b.x, b.x + 4 * b.size());
    };
    const std::vector<double> one = move(1), many = move(100);
    for (size_t j = 0; j < one.size(); ++j) EXPECT_NEAR(one[j], many[j], 1e-13) << damping;
  }
}

TEST(Modal, FreeSpinningBody_KeepsItsMomenta) {
  const Mesh m = kuhn_bar(6, 2, 1, 0.05);
  Host host;
  Stepper b(host, modal(), m, {{"young", 1e6}});
  ASSERT_EQ(b.status, DFM_OK) << host.logged;
  const Vec spin = {4, 7, -9}, drift = {1, -2, 0.5}, axis = {0.6, 0, 0.8};
  std::mt19937 random(5);
  std::uniform_real_distribution<double> u(-1, 1);
  for (uint32_t i = 0; i < b.size(); ++i) {
    b.set(b.x, i, rotate(m.at(i), axis, 2.9) + Vec{3, 1, 2});
    b.set(b.v, i, drift + cross(spin, b.get(b.x, i)) + 0.1 * Vec{u(random), u(random), u(random)});
  }
  b.step();  // now it moves in what the modes hold
  const Vec p = b.momentum(), l = b.angular_momentum();
  const double before = b.kinetic() + b.energy();
  for (int n = 0; n < 1000; ++n) b.step();
  EXPECT_LT(norm(b.momentum() - p), 1e-12 * norm(p));
  EXPECT_LT(norm(b.angular_momentum() - l), 1e-11 * norm(l));
  EXPECT_NEAR((b.kinetic() + b.energy()) / before, 1, 0.01) << "Coriolis's forces are left out";
}

// A rod is stretched by its spin: at small strain by rho w^2 L^3 / (12 E).
TEST(Modal, SpinningRod_IsStretched) {
  const Mesh m = kuhn_bar(20, 1, 1, 0.05);
  Host host;
  Stepper b(host, modal(), m, {{"young", 1e7}, {"poisson", 0}, {"damping_stiffness", 0.01}});
  const double w = 5, rho = 1000, length = 1;
  const Vec center = {0.5, 0.025, 0.025};
  for (uint32_t i = 0; i < b.size(); ++i) b.set(b.v, i, cross({0, 0, w}, m.at(i) - center));
  for (int n = 0; n < 2000; ++n) b.step();
  double least = 1e300, most = -1e300;
  const Vec along = [&] {
    const Vec d = b.get(b.x, b.size() - 1) - b.get(b.x, 0);
    return (1 / norm(d)) * d;
  }();
  for (uint32_t i = 0; i < b.size(); ++i) {
    least = std::min(least, dot(b.get(b.x, i), along));
    most = std::max(most, dot(b.get(b.x, i), along));
  }
  const double rest = dot(m.at(b.size() - 1) - m.at(0),
                          (1 / norm(m.at(b.size() - 1) - m.at(0))) * (m.at(b.size() - 1) - m.at(0)));
  EXPECT_NEAR((most - least - rest) / (rho * w * w * length * length * length / (12 * 1e7)), 1, 0.03);
}

TEST(Modal, BodyUnderAnyPose_IsAtRest) {
  const Mesh m = kuhn_bar(3, 2, 2, 0.05);
  for (const bool held : {false, true}) {
    Host host;
    Stepper b(host, modal(), m, {}, held ? clamp_of(m) : std::vector<uint8_t>{});
    for (uint32_t i = 0; i < b.size(); ++i) b.set(b.x, i, rotate(m.at(i), {0, 0.6, 0.8}, 3.0) + Vec{1, 2, 3});
    for (int n = 0; n < 20; ++n) b.step();
    for (uint32_t i = 0; i < b.size(); ++i) {
      EXPECT_LT(norm(b.get(b.v, i)), 1e-11);
      EXPECT_LT(norm(b.get(b.x, i) - rotate(m.at(i), {0, 0.6, 0.8}, 3.0) - Vec{1, 2, 3}), 1e-13);
    }
    EXPECT_LT(b.energy(), 1e-20);
  }
}

TEST(Modal, Commit_IsPredictAndRespond) {
  const Mesh m = kuhn_bar(4, 2, 2, 0.05);
  for (const bool held : {false, true})
    for (const double touched : {0.0, 1.0}) {
      Host host;
      Stepper b(host, modal(), m, {{"modes", 20}, {"damping_stiffness", 1e-3}, {"damping_mass", 2}},
                held ? clamp_of(m) : std::vector<uint8_t>{});
      for (uint32_t i = 0; i < b.size(); ++i)
        if (!held) b.set(b.v, i, cross({1, 2, -1}, m.at(i)));
      b.pull({0.3, 0, -9.81});
      for (int n = 0; n < 10; ++n) b.step();
      b.state[0] = touched;
      expect_commit_is_predict_and_respond(b, {44, 40, 20, 17, 3, 12});
    }
}

// What impulses give to a free body is theirs.
TEST(Modal, ImpulsesAtSurfels_AreCountedAsMomentum) {
  const Mesh m = kuhn_bar(4, 2, 2, 0.05);
  Host host;
  Stepper b(host, modal(), m);
  for (uint32_t i = 0; i < b.size(); ++i) b.set(b.v, i, cross({1, 2, -1}, m.at(i)));
  for (int n = 0; n < 10; ++n) b.step();
  const Vec p = b.momentum(), l = b.angular_momentum();
  Vec sum{}, moment{}, center{};
  double mass = 0;
  for (uint32_t i = 0; i < b.size(); ++i) {
    center = center + m.mass[i] * b.get(b.x, i);
    mass += m.mass[i];
  }
  center = (1 / mass) * center;
  for (const uint32_t s : {0u, 7u, 30u}) {
    const Vec push = {0.01 * s, 0.02, -0.03};
    std::copy(push.begin(), push.end(), &b.p_s[3 * s]);
    sum = sum + push;
    moment = moment + cross(b.get(b.x, s), push);
  }
  b.step();
  EXPECT_LT(norm(b.momentum() - p - sum), 1e-13);
  // the center has moved on with the momentum it got, so the moment about the origin is exact
  EXPECT_LT(norm(b.angular_momentum() - l - moment), 1e-13);
}

// Held points that move apart stretch the body between them.
TEST(Modal, HeldEndsPulledApart_StretchTheBarEvenly) {
  const Mesh m = kuhn_bar(8, 1, 1, 0.05);
  std::vector<uint8_t> fixed = clamp_of(m);
  for (uint32_t i = 0; i < m.npoint(); ++i)
    if (m.at(i)[0] > 0.4 - 1e-9) fixed[i] = 7;
  Host host;
  Stepper b(host, modal(), m, {{"young", 1e6}, {"poisson", 0}, {"damping_stiffness", 0.01}}, fixed);
  ASSERT_EQ(b.status, DFM_OK) << host.logged;
  for (int n = 0; n < 600; ++n) {
    for (uint32_t i = 0; i < b.size(); ++i)
      if (fixed[i]) b.set(b.v, i, {m.at(i)[0] > 0.2 && n < 100 ? 0.04 : 0.0, 0, 0.1});
    b.step();
  }
  for (uint32_t i = 0; i < b.size(); ++i)
    EXPECT_LT(norm(b.get(b.x, i) - m.at(i) - Vec{0.01 * m.at(i)[0], 0, 0.06}), 1e-9) << i;
}

TEST(Modal, NumberOfModes_FollowsTheRuleThatIsGiven) {
  const Mesh m = kuhn_bar(4, 3, 3, 0.05);
  const std::vector<double> all = modes_of(m, {{"modes", 1000}}), plain = modes_of(m, {});
  EXPECT_EQ(all.size(), 3u * m.npoint() - 6);
  EXPECT_EQ(plain.size(), 40u);
  const std::vector<double> below = modes_of(m, {{"frequency", 0.5 * (all[60] + all[61])}});
  EXPECT_EQ(below.size(), 61u);
  const size_t half = modes_of(m, {{"share", 0.5}}).size(), most = modes_of(m, {{"share", 0.9}}).size();
  EXPECT_GT(half, 3u);
  EXPECT_GT(most, half);
  EXPECT_LT(most, all.size());
}

TEST(Modal, BodiesItCannotTake_AreRefusedInOneSentence) {
  const Mesh m = kuhn_bar(3, 1, 1, 0.05);
  const auto refused = [&](const Params &p, const std::vector<uint8_t> &fixed) {
    Host host;
    const Stepper b(host, modal(), m, p, fixed);
    EXPECT_EQ(b.status, DFM_E_ARG);
    EXPECT_EQ(host.live, 0u);
    return host.logged;
  };
  EXPECT_NE(refused({{"frequency", 0.1}}, {}).find("no mode lies below the frequency 0.1 Hz; the lowest has"),
            std::string::npos);
  EXPECT_NE(refused({{"frequency", 50}, {"modes", 5}}, {}).find("give one of them"), std::string::npos);
  {
    Host host;
    const Stepper b(host, modal(), kuhn_bar(22, 20, 20, 0.01));
    EXPECT_NE(host.logged.find("10143 points; more than 10000 are refused"), std::string::npos)
        << host.logged;
  }
  std::vector<uint8_t> line(m.npoint(), 0);
  line[0] = line[1] = 7;
  EXPECT_NE(refused({}, line).find("leaves the body a rigid motion"), std::string::npos);
  EXPECT_NE(refused({}, std::vector<uint8_t>(m.npoint(), 7)).find("all points are held"), std::string::npos);
}

// Held components are along the axes of the world: a pose that turns the body turns it away from them, by
// however little. A body that sags has a mean rotation too.
TEST(Modal, PartlyHeldBodyThatItsPoseHasTurned_IsRefusedAndASaggingOneIsNot) {
  const Mesh m = kuhn_bar(4, 2, 2, 0.05);
  std::vector<uint8_t> fixed(m.npoint(), 0);
  for (uint32_t i = 0; i < m.npoint(); ++i)
    if (m.at(i)[0] < 1e-9) fixed[i] = norm(m.at(i)) < 1e-9 ? 7 : 3;
  const auto predicted = [&](double angle, double sag) {
    Host host;
    Stepper b(host, modal(), m, {}, fixed);
    EXPECT_EQ(b.status, DFM_OK) << host.logged;
    for (uint32_t i = 0; i < b.size(); ++i) {
      const Vec x = m.at(i);
      b.set(b.x, i, rotate(x - Vec{0, 0, sag * x[0] * x[0]}, {0, 0, 1}, angle) + Vec{0, 0, 0.5});
    }
    const dfm_kin k = b.now();
    return b.ext->predict(b.self, &k, b.f, b.u_s.data());
  };
  for (const double sag : {0.0, 1e-3, 0.1}) EXPECT_EQ(predicted(0, sag), DFM_OK) << sag;
  for (const double angle : {1e-4, 0.05, 0.5}) EXPECT_EQ(predicted(angle, 0), DFM_E_UNSUPPORTED) << angle;
}

TEST(Modal, MoreModesThanThereAre_AreReportedToHaveNoEffectWithTheNumberUsed) {
  const Mesh m = kuhn_bar(2, 1, 1, 0.05);
  Host host;
  const Stepper b(host, modal(), m, {{"modes", 1000}});
  ASSERT_EQ(b.status, DFM_OK) << host.logged;
  const auto *idle = static_cast<const dfm_idle *>(b.ops->extension(b.self, DFM_EXT_IDLE));
  uint32_t row = 0;
  while (std::string(modal().params[row].key) != "modes") ++row;
  const char *why = idle->why(b.self, row);
  ASSERT_NE(why, nullptr);
  EXPECT_EQ(std::string(why), "30 modes are used; the mesh has 30, and at most 1024 are taken");
}

TEST(Modal, ModesAboveTheNyquistFrequency_AreNamedOnceAndKeepTheSag) {
  const Mesh m = kuhn_bar(4, 1, 1, 0.05);
  Host host;
  Stepper b(host, modal(), m, {{"young", 1e6}}, clamp_of(m));
  const std::vector<double> hertz = frequencies(host.logged);
  host.logged.clear();
  b.pull({0, 0, -1});
  b.dt = 0.1;
  for (int n = 0; n < 200; ++n) b.step();
  const size_t first = host.logged.find("lie above the Nyquist frequency 5 Hz of the step 0.1 s");
  ASSERT_NE(first, std::string::npos) << host.logged;
  EXPECT_EQ(host.logged.find("Nyquist", first + 40), std::string::npos);
  ASSERT_GT(hertz[0], 5);
  const double sag = b.get(b.x, b.size() - 1)[2] - m.at(b.size() - 1)[2];
  b.dt = 10;  // every mode at rest in one step
  for (int n = 0; n < 3; ++n) b.step();
  EXPECT_NEAR(sag, b.get(b.x, b.size() - 1)[2] - m.at(b.size() - 1)[2], 1e-9 * std::abs(sag));
}

// Once for each time that the body leaves the range and for each doubling, not in each period.
TEST(Modal, StrainsOutOfRange_AreReportedOnceEachTime) {
  const Mesh m = kuhn_bar(8, 1, 1, 0.05);
  Host host;
  Stepper b(host, modal(), m, {{"young", 1e5}, {"damping_mass", 5}}, clamp_of(m));
  const auto reported = [&] {
    size_t n = 0;
    for (size_t at = 0; (at = host.logged.find("displacement gradient reaches", at)) != std::string::npos;
         ++at)
      ++n;
    return n;
  };
  const auto run = [&](double pull, double seconds) {
    b.pull({0, 0, pull});
    for (int n = 0; n * b.dt < seconds; ++n) {
      b.step();
      b.t += b.dt;
    }
  };
  run(-0.01, 2);
  EXPECT_EQ(reported(), 0u);
  run(-3, 5);
  const size_t first = reported();
  EXPECT_GE(first, 1u) << host.logged;
  EXPECT_LE(first, 3u) << "it swings through the limit many times";
  run(-0.01, 5);
  EXPECT_EQ(reported(), first);
  run(-3, 5);
  EXPECT_EQ(reported(), 2 * first) << "out of the range anew";
}

TEST(Modal, RefusedMemory_LeavesNothingBehind) {
  const Mesh m = kuhn_bar(2, 1, 1, 0.05);
  refuse_each_allocation([&](Host &host) { return Stepper(host, modal(), m, {}, clamp_of(m)); });
}

// No memory is asked for in a step.
TEST(Modal, Steps_TakeNoMemory) {
  const Mesh m = kuhn_bar(4, 2, 2, 0.05);
  Host host;
  Stepper b(host, modal(), m);
  const size_t before = host.calls;
  for (int n = 0; n < 5; ++n) {
    b.p_s[4] = 0.01 * n;
    b.step();
  }
  EXPECT_EQ(host.calls, before);
}

}  // namespace
