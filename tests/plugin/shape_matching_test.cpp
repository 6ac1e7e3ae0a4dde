// Shape matching as a plugin: goals of the reference clouds, momenta, the answer to impulses, what does not
// depend on the step, recovery from every shape, plastic flow, held points.
#include "../../plugins/model_common/index.h"
#include "near.h"
#include "model_tangent.h"
#include "stepper_host.h"

namespace stepper_test {
namespace {

const dfm_type &shape() {
  static const dfm_type &type = type_of("model_shape_matching");
  return type;
}
enum Mode { kRigid, kLinear, kQuadratic };
// Goals are reached within one step of 10 s: nothing is left of a deviation.
const Params kAtOnce = {{"mode", kRigid}, {"stiffness", 0.999999}, {"damping_ratio", 1}};
constexpr double kWhole = 10;

std::vector<Params> all_kinds() {
  std::vector<Params> out;
  for (double mode : {kRigid, kLinear, kQuadratic})
    for (double clusters : {1, 4}) out.push_back({{"mode", mode}, {"clusters", clusters}});
  return out;
}
std::string name_of(const Params &v) {
  std::string out;
  for (const auto &[key, value] : v) out += key + " " + std::to_string(value) + " ";
  return out;
}

// The largest difference between the distances of two points and those at rest.
double distortion(const Stepper &b) {
  double most = 0;
  for (uint32_t i = 0; i < b.size(); ++i)
    for (uint32_t j = 0; j < i; ++j)
      most =
          std::max(most, std::abs(norm(b.get(b.x, i) - b.get(b.x, j)) - norm(b.mesh.at(i) - b.mesh.at(j))));
  return most;
}
double volume(const Stepper &b, uint32_t cell) {
  const uint32_t *const q = &b.mesh.cells[4 * size_t(cell)];
  const Vec o = b.get(b.x, q[0]);
  return dot(b.get(b.x, q[1]) - o, cross(b.get(b.x, q[2]) - o, b.get(b.x, q[3]) - o)) / 6;
}

struct Cloud {
  std::string kind;
  Mesh mesh;
  std::vector<Vec> x, goal;
  double gap = 0;
};
std::vector<Cloud> reference_clouds() {
  std::vector<Cloud> out;
  std::ifstream in(test::reference_dir() + "/elasticity/tables/shape_matching.csv");
  std::string line;
  std::getline(in, line);
  while (std::getline(in, line)) {
    std::stringstream fields(line);
    std::string field;
    std::vector<std::string> f;
    while (std::getline(fields, field, ',')) f.push_back(field);
    if (std::stoul(f[0]) == out.size()) out.push_back({f[1], {}, {}, {}, std::stod(f[13])});
    Cloud &c = out.back();
    c.mesh.mass.push_back(std::stod(f[3]));
    for (size_t k = 4; k < 7; ++k) c.mesh.rest.push_back(std::stod(f[k]));
    c.x.push_back({std::stod(f[7]), std::stod(f[8]), std::stod(f[9])});
    c.goal.push_back({std::stod(f[10]), std::stod(f[11]), std::stod(f[12])});
  }
  for (Cloud &c : out) {
    c.mesh.cells = {0, 1, 2, 3};
    c.mesh.edges = {0, 1, 0, 2, 0, 3, 1, 2, 1, 3, 2, 3};
  }
  return out;
}

// Of a cloud on a line no turn about it is nearest: there goals have the rest shape, and that is all.
TEST(ShapeMatching, GoalsOfTheReferenceClouds_AreReached) {
  const std::vector<Cloud> clouds = reference_clouds();
  ASSERT_EQ(clouds.size(), 10u);
  for (const Cloud &c : clouds) {
    Host host;
    Stepper b(host, shape(), c.mesh, kAtOnce);
    ASSERT_EQ(b.status, DFM_OK) << host.logged;
    for (uint32_t i = 0; i < b.size(); ++i) b.set(b.x, i, c.x[i]);
    b.advance(kWhole);
    EXPECT_LT(distortion(b), 1e-11) << c.kind;
    Vec force{}, torque{};
    for (uint32_t i = 0; i < b.size(); ++i) {
      const Vec change = c.mesh.mass[i] * (b.get(b.x, i) - c.x[i]);
      force = force + change;
      torque = torque + cross(c.x[i], change);
      if (c.gap > 1e-9) {
        EXPECT_LT(norm(b.get(b.x, i) - c.goal[i]), 1e-12 / c.gap) << c.kind << " " << i;
      }
    }
    EXPECT_LT(norm(force), 1e-13 * 20) << c.kind;    // kg m; a cloud has about 10 kg, 2 m
    EXPECT_LT(norm(torque), 1e-13 * 100) << c.kind;  // kg m2
  }
}

TEST(ShapeMatching, TurnedRestShape_IsItsOwnGoal) {
  const Mesh mesh = kuhn_bar(4, 2, 2, 0.1, 0.2);
  for (const Params &kind : all_kinds()) {
    Host host;
    Stepper b(host, shape(), mesh, kind);
    for (double angle : {0.5, 1.57, 3.0}) {
      for (uint32_t i = 0; i < b.size(); ++i)
        b.set(b.x, i, rotate(mesh.at(i), {0.48, 0.6, 0.64}, angle) + Vec{3, -1, 2});
      double most = 0;
      b.dt = 1e-2;
      b.predict();
      for (double u : b.u_s) most = test::worse(most, std::abs(u));
      EXPECT_LT(most * 1e-2, 1e-12 * 0.4 * 10) << name_of(kind) << angle;  // at a distance of 4 m
    }
  }
}

TEST(ShapeMatching, FreeStep_KeepsBothMomenta) {
  const Mesh mesh = kuhn_bar(4, 2, 2, 0.1, 0.2);
  for (Params kind : all_kinds()) {
    kind["plastic_creep"] = 20;
    Host host;
    Stepper b(host, shape(), mesh, kind);
    b.shake(0.03, 2);
    const Vec p = b.momentum(), l = b.angular_momentum();
    double scale = 0;  // kg m2/s
    for (uint32_t i = 0; i < b.size(); ++i) scale += mesh.mass[i] * norm(b.get(b.x, i)) * norm(b.get(b.v, i));
    for (int n = 0; n < 200; ++n) b.advance(n % 3 || kind.at("clusters") > 1 ? 1e-3 : 2e-2);
    EXPECT_LT(norm(b.momentum() - p), 1e-12 * norm(p) * 10) << name_of(kind);
    EXPECT_LT(norm(b.angular_momentum() - l), 1e-12 * scale) << name_of(kind);
  }
}

// Column by column, between all surfels: 1/kg.
Dense response_of(Stepper &b) {
  const size_t n = 3 * size_t(b.size());
  std::vector<uint32_t> all(b.size());
  for (uint32_t s = 0; s < b.size(); ++s) all[s] = s;
  Dense out(n, n);
  for (size_t c = 0; c < n; ++c) {
    std::vector<double> p(n, 0);
    p[c] = 1;
    const std::vector<double> du = b.respond(all, p);
    for (size_t r = 0; r < n; ++r) out(r, c) = du[r];
  }
  return out;
}

TEST(ShapeMatching, ResponseToImpulses_IsSymmetricAndNotNegative) {
  const Mesh mesh = kuhn_bar(2, 2, 1, 0.1, 0.2);
  std::vector<uint8_t> fixed(mesh.npoint(), 0);
  fixed[0] = 7;
  fixed[3] = 2;
  for (const Params &kind : all_kinds())
    for (double h : {1e-4, 1e-2, 1.0})
      for (bool held : {false, true}) {
        Host host;
        Stepper b(host, shape(), mesh, kind, held ? fixed : std::vector<uint8_t>{}, true);
        b.shake(0.02, 1);
        b.dt = h;
        b.predict();
        const Dense w = response_of(b), flipped = transposed(w);
        EXPECT_LT(largest_difference(w, flipped), 1e-13 * largest(w)) << name_of(kind) << h;
        Dense minus = w;
        for (double &x : minus.value) x = -x;
        EXPECT_TRUE(below(minus, 1e-12 * largest(w))) << name_of(kind) << h;
      }
}

TEST(ShapeMatching, ResponseOfSomeSurfels_IsThatOfAll) {
  Host host;
  Stepper b(host, shape(), kuhn_bar(2, 2, 1, 0.1, 0.2), {{"clusters", 3}}, {}, true);
  b.shake(0.02, 1);
  b.predict();
  const Dense w = response_of(b);
  const std::vector<uint32_t> some = {11, 2, 7};
  for (size_t c = 0; c < 9; ++c) {
    std::vector<double> p(9, 0), diagonal(27);
    p[c] = 1;
    const std::vector<double> du = b.respond(some, p);
    const dfm_kin k = b.kin();
    ASSERT_EQ(b.ext->diagonal(b.self, &k, 3, some.data(), diagonal.data()), DFM_OK);
    for (size_t r = 0; r < 9; ++r)
      EXPECT_NEAR(du[r], w(3 * some[r / 3] + r % 3, 3 * some[c / 3] + c % 3), 1e-13 * largest(w));
    EXPECT_GE(diagonal[9 * (c / 3) + 4 * (c % 3)], du[c]) << "a bound";
  }
}

TEST(ShapeMatching, Commit_IsPredictPlusRespond) {
  for (const Params &kind : all_kinds())
    for (double h : {1e-3, 1e-1}) {
      Host host;
      Stepper b(host, shape(), kuhn_bar(3, 2, 2, 0.1, 0.2), kind, {}, true);
      b.shake(0.02, 1);
      std::mt19937 random(5);
      std::uniform_real_distribution<double> u(-1, 1);
      std::vector<uint32_t> all;
      std::vector<double> p;
      for (uint32_t s = 0; s < b.size(); ++s) {
        all.push_back(s);
        for (int k = 0; k < 3; ++k) p.push_back(s % 2 ? u(random) : 0);
        for (size_t k = 0; k < 3; ++k) b.f[4 * s + k] = u(random);
      }
      b.dt = h;
      b.predict();
      const std::vector<double> by = b.respond(all, p);
      b.p_s = p;
      b.commit();
      double scale = 0;
      for (double d : by) scale = std::max(scale, std::abs(d));
      for (uint32_t s = 0; s < b.size(); ++s)
        for (size_t k = 0; k < 3; ++k) {
          double mean = 0;
          const Coupling &c = b.coupling;
          for (uint32_t e = c.row[s]; e < c.row[s + 1]; ++e)
            mean += c.weight[e] * (b.x_end[4 * c.col[e] + k] - b.x[4 * c.col[e] + k]) / h;
          EXPECT_NEAR(mean, b.u_s[3 * s + k] + by[3 * s + k], 1e-10 * scale) << name_of(kind) << h;
        }
    }
}

// With goals that stand still a deviation d that has been d/(1-a) one step ago is d (1-a)^n after n steps,
// a = 1 - (1 - a0)^(h/h0): after one time the same is left of it, whatever the step.
TEST(ShapeMatching, DecayingDeviation_IsLeftByTheSameShareAtAnyStep) {
  const Mesh mesh = kuhn_bar(3, 2, 2, 0.1);
  const double a0 = 0.7, h0 = 0.01, time = 0.04;
  for (double h : {0.04, 0.01, 0.002, 0.0004}) {
    Host host;
    Stepper b(host, shape(), mesh,
              {{"mode", kRigid}, {"stiffness", a0}, {"reference_step", h0}, {"damping_ratio", 1}});
    const double left = std::pow(1 - a0, h / h0);
    Vec center{};
    double total = 0;
    for (uint32_t i = 0; i < b.size(); ++i) {
      center = center + mesh.mass[i] * mesh.at(i);
      total += mesh.mass[i];
    }
    for (uint32_t i = 0; i < b.size(); ++i) {  // swollen by a tenth
      const Vec d = 0.1 * (mesh.at(i) - (1 / total) * center);
      b.set(b.x, i, mesh.at(i) + d);
      b.set(b.v, i, ((1 - 1 / left) / h) * d);
    }
    for (long n = std::lround(time / h); n > 0; --n) b.advance(h);
    const Vec rest = mesh.at(0) - mesh.at(b.size() - 1), now = b.get(b.x, 0) - b.get(b.x, b.size() - 1);
    EXPECT_NEAR((norm(now) / norm(rest) - 1) / (0.1 * std::pow(1 - a0, time / h0)), 1, 1e-9) << h;
  }
}

// A pull along x that has neither a force nor a torque strains the body by f/(m w^2), w = -ln(1 - a0)/h0.
// Linear goals follow the strain e by linearity times what is left of it without a change of volume. That is
// taken away along each axis in the share s of the inverse of its moment sum m q^2 in the sum of all three.
// So with linearity b, of
//   (1 - b) e_y + b s_y tr e = 0 and (1 - b) e_x + b s_x tr e = f/(m w^2),
// e_x is (1 - b s_x)/(1 - b) times that, to first order.
TEST(ShapeMatching, DeviationUnderALoad_IsTheSameAtAnyStep) {
  Mesh mesh = kuhn_bar(3, 2, 2, 0.1);
  mesh.mass.assign(mesh.npoint(), 0.1);  // the pull then turns nothing
  const double a0 = 0.9, h0 = 0.01, omega = -std::log(1 - a0) / h0, pull = 30;
  for (Mode mode : {kRigid, kLinear, kQuadratic}) {
    std::vector<double> seen;
    for (double h : {1e-3, 1e-2, 1.0 / 30}) {
      Host host;
      Stepper b(host, shape(), mesh,
                {{"mode", mode}, {"stiffness", a0}, {"reference_step", h0}, {"linearity", 0.6}});
      Vec center{};
      double total = 0;
      for (uint32_t i = 0; i < b.size(); ++i) {
        center = center + mesh.mass[i] * mesh.at(i);
        total += mesh.mass[i];
      }
      for (uint32_t i = 0; i < b.size(); ++i)
        b.set(b.f, i, {mesh.mass[i] * pull * (mesh.at(i) - (1 / total) * center)[0], 0, 0});
      for (int n = 0; n < 2000; ++n) b.advance(h);
      const Vec rest = mesh.at(b.size() - 1) - mesh.at(0), now = b.get(b.x, b.size() - 1) - b.get(b.x, 0);
      seen.push_back((now[0] / rest[0] - 1) / (pull / (omega * omega)));
      EXPECT_LT(norm(b.get(b.v, 0)), 1e-9) << mode << h;
    }
    EXPECT_NEAR(seen[1] / seen[0], 1, 1e-9) << mode;
    EXPECT_NEAR(seen[2] / seen[0], 1, 1e-9) << mode;
    if (mode == kRigid) {
      EXPECT_NEAR(seen[0], 1, 1e-9);
    }
    if (mode == kLinear) {
      // 4 points along x have the moment 5/4 of their distance squared, 3 along y and z 2/3
      const double share = 0.8 / (0.8 + 1.5 + 1.5);
      EXPECT_NEAR(seen[0], (1 - 0.6 * share) / (1 - 0.6), 0.01);
    }
  }
}

// The pull to the goals is a gradient: what a place b changes of it at a, a changes of it at b. Squeezed
// to a third and stretched, turned, and with places of their own; inside out too.
TEST(ShapeMatching, PullToTheGoals_IsAGradient) {
  const Mesh mesh = kuhn_bar(3, 2, 2, 0.1, 0.2);
  constexpr double kStep = 1e-9, kBy = 1e-6;  // so short that the pull is m w^2 (g - x) h, of clusters too
  for (const double squeezed : {1.0, 0.35, -0.4})
    for (const Params &kind : {Params{{"mode", kRigid}}, Params{{"mode", kLinear}, {"linearity", 0.8}},
                               Params{{"mode", kLinear}, {"clusters", 3}}}) {
      Host host;
      Stepper b(host, shape(), mesh, kind);
      ASSERT_EQ(b.status, DFM_OK) << host.logged;
      std::vector<Vec> at;
      for (uint32_t i = 0; i < b.size(); ++i) {
        const Vec q = mesh.at(i);
        const double own = 0.003 * std::sin(7.0 * i);
        at.push_back(rotate({1.3 * q[0] + own, 1.1 * q[1] - own, squeezed * q[2] + 0.1 * q[0] + 0.5 * own},
                            {0.48, 0.6, 0.64}, 0.7));
      }
      const auto pull = [&](size_t moved, double by) {
        for (uint32_t i = 0; i < b.size(); ++i) {
          Vec x = at[i];
          if (moved / 3 == i) x[moved % 3] += by;
          b.set(b.x, i, x);
          b.set(b.v, i, {});
        }
        b.advance(kStep);
        std::vector<double> out;
        for (uint32_t i = 0; i < b.size(); ++i)
          for (int k = 0; k < 3; ++k) out.push_back(mesh.mass[i] * b.get(b.v, i)[size_t(k)]);
        return out;
      };
      const size_t n = 3 * b.size();
      std::vector<std::vector<double>> slope;
      double most = 0;
      for (size_t j = 0; j < n; ++j) {
        const std::vector<double> more = pull(j, kBy), less = pull(j, -kBy);
        slope.emplace_back();
        for (size_t i = 0; i < n; ++i) {
          slope[j].push_back((more[i] - less[i]) / (2 * kBy));
          most = std::max(most, std::abs(slope[j][i]));
        }
      }
      for (size_t j = 0; j < n; ++j)
        for (size_t i = 0; i < j; ++i)
          ASSERT_NEAR(slope[j][i], slope[i][j], 1e-6 * most)
              << name_of(kind) << squeezed << " " << i << " " << j;
    }
}

// With clusters that move against each other as well, as long as w h is at most 2.
TEST(ShapeMatching, DeviationOfClustersUnderALoad_IsTheSameAtAnyStepUpToItsLimit) {
  Mesh mesh = kuhn_bar(9, 2, 2, 0.1);
  mesh.mass.assign(mesh.npoint(), 0.1);
  std::vector<double> seen;
  for (double h : {1e-3, 4e-3, 8e-3}) {
    Host host;
    Stepper b(host, shape(), mesh,
              {{"stiffness", 0.9}, {"clusters", 4}, {"damping_mass", 10}});  // w = 230 1/s
    for (uint32_t i = 0; i < b.size(); ++i) b.set(b.f, i, {3 * (mesh.at(i)[0] - 0.45), 0, 0});
    for (long n = std::lround(6 / h); n > 0; --n) b.advance(h);
    const Vec now = b.get(b.x, b.size() - 1) - b.get(b.x, 0);
    seen.push_back(now[0] - 0.9);
  }
  EXPECT_GT(seen[0], 1e-3);
  EXPECT_NEAR(seen[1] / seen[0], 1, 1e-9);
  EXPECT_NEAR(seen[2] / seen[0], 1, 1e-9);
}

enum class Start { scrambled, plane, line, point, inverted };
void spoil(Stepper &b, Start how, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> u(-0.4, 0.4);
  for (uint32_t i = 0; i < b.size(); ++i) {
    Vec x = b.mesh.at(i);
    if (how == Start::scrambled) x = {u(random), u(random), u(random)};
    if (how == Start::plane) x = x - dot(x, {0.6, 0, 0.8}) * Vec{0.6, 0, 0.8};
    if (how == Start::line) x = dot(x, {0.36, 0.48, 0.8}) * Vec{0.36, 0.48, 0.8};
    if (how == Start::point) x = {0.1, 0.1, 0.1};
    if (how == Start::inverted) x[0] = -x[0];
    b.set(b.x, i, x);
  }
}

// unsanitized: too slow there; shorter tests run the same code
TEST(ShapeMatching, BodyDeformedInAnyWay_Recovers) {
  const Mesh mesh = kuhn_bar(4, 2, 2, 0.1, 0.2);
  for (const Params &kind : all_kinds())
    for (Start how : {Start::scrambled, Start::plane, Start::line, Start::point, Start::inverted})
      for (double h : {2e-3, 1.0 / 30})
        for (unsigned seed = 0; seed < (how == Start::scrambled ? 5u : 1u); ++seed) {
          Host host;
          Stepper b(host, shape(), mesh, kind);
          spoil(b, how, seed);
          for (int n = 0; n < 1000; ++n) b.advance(h);
          // from rest: what moves in the end has been made of rounding
          EXPECT_LT(norm(b.momentum()) + norm(b.angular_momentum()), 1e-10)
              << name_of(kind) << int(how) << " " << h;
          EXPECT_LT(distortion(b), 1e-6 * 0.4) << name_of(kind) << int(how) << " " << h << " " << seed;
          for (uint32_t c = 0; c < mesh.ncell(); ++c) EXPECT_GT(volume(b, c), 0);
        }
}

TEST(ShapeMatching, StepOfAnyLength_StaysBounded) {
  for (const Params &kind : all_kinds())
    for (double damping : {0.0, 0.5, 1.0})
      for (double h : {1e-5, 1e-3, 1e-1, 10.0}) {
        if (damping == 0 && kind.at("clusters") > 1) continue;  // its goals exchange energy
        Params all = kind;
        all["damping_ratio"] = damping;
        Host host;
        Stepper b(host, shape(), kuhn_bar(4, 2, 2, 0.1, 0.2), all);
        b.shake(0.05, 0);
        for (int n = 0; n < 300; ++n) b.advance(h);
        for (uint32_t i = 0; i < b.size(); ++i) EXPECT_LT(norm(b.get(b.x, i)), 1) << name_of(all) << h;
      }
}

TEST(ShapeMatching, StepThatChangesAtRandom_StaysBoundedWithOneCluster) {
  for (Mode mode : {kRigid, kLinear, kQuadratic}) {
    Host host;
    Stepper b(host, shape(), kuhn_bar(4, 2, 2, 0.1, 0.2), {{"mode", mode}});
    b.shake(0.05, 0);
    std::mt19937 random(1);
    for (int n = 0; n < 2000; ++n) b.advance(1e-4 * (1 + random() % 333));
    for (uint32_t i = 0; i < b.size(); ++i) EXPECT_LT(norm(b.get(b.x, i)), 1) << mode;
  }
}

TEST(ShapeMatching, EveryPoint_IsInAClusterAndClustersBend) {
  const Mesh mesh = kuhn_bar(12, 2, 2, 0.1);
  const auto bend_left = [&](double clusters) {
    Host host;
    Stepper b(host, shape(), mesh, {{"mode", kRigid}, {"clusters", clusters}});
    for (uint32_t i = 0; i < b.size(); ++i) {  // a bow of 1.2 m and a quarter of a turn
      const Vec x = mesh.at(i);
      const double angle = x[0] / 1.2 * 1.57, radius = 1.2 / 1.57 - (x[1] - 0.1);
      b.set(b.x, i, {radius * std::sin(angle), 0.1 + 1.2 / 1.57 - radius * std::cos(angle), x[2]});
    }
    double away = 0;  // m^2 kg, of the goals
    b.predict();
    for (double u : b.u_s) away += u * u;
    return away;
  };
  EXPECT_LT(bend_left(6), 0.1 * bend_left(1)) << "pieces turn on their own";
  EXPECT_GT(bend_left(1), 0);
}

TEST(ShapeMatching, StretchAboveTheYieldStrain_Stays) {
  const Mesh mesh = kuhn_bar(4, 2, 2, 0.1);
  std::vector<uint8_t> fixed(mesh.npoint(), 0);
  const auto set_after = [&](double stretch, Params with) {
    with["plastic_creep"] = 10;
    Host host;
    Stepper b(host, shape(), mesh, with);
    double length = 0;
    for (int n = 0; n < 400; ++n) {  // the pulled shape is given anew at every step, then let go
      for (uint32_t i = 0; n < 200 && i < b.size(); ++i) {
        const Vec x = mesh.at(i);
        b.set(b.x, i, {x[0] * stretch, x[1], x[2]});
        b.set(b.v, i, {});
      }
      b.advance(2e-3);
    }
    for (uint32_t i = 0; i < b.size(); ++i)
      if (mesh.at(i)[1] == 0 && mesh.at(i)[2] == 0 && mesh.at(i)[0] > 0.35)
        length = norm(b.get(b.x, i) - b.get(b.x, 0));
    return length / 0.4 - 1;
  };
  EXPECT_NEAR(set_after(1.04, {{"plastic_yield", 0.05}}), 0, 1e-6) << "below the yield strain";
  EXPECT_GT(set_after(1.3, {{"plastic_yield", 0.05}}), 0.1);
  EXPECT_LT(set_after(1.3, {{"plastic_yield", 0.05}}), 0.3);
  EXPECT_NEAR(set_after(1.3, {{"plastic_yield", 0.05}, {"plastic_max", 0.06}}), 0.05, 0.02);
  EXPECT_NEAR(set_after(1.3, {{"plastic_yield", 1}}), 0, 1e-6);
}

// Held points stay at their prescribed places, and the rest hangs at the same distance at any step.
TEST(ShapeMatching, HeldEnd_CarriesTheBody) {
  const Mesh mesh = kuhn_bar(4, 2, 2, 0.1);
  std::vector<uint8_t> fixed(mesh.npoint(), 0);
  uint32_t tip = 0;
  for (uint32_t i = 0; i < mesh.npoint(); ++i) {
    if (mesh.at(i)[0] < 1e-9) fixed[i] = 7;
    if (mesh.at(i)[0] > 0.39) tip = i;
  }
  std::vector<double> sag;
  for (double h : {1e-3, 1e-2}) {
    Host host;
    Stepper b(host, shape(), mesh, {{"mode", kRigid}, {"stiffness", 0.99}}, fixed);
    for (uint32_t i = 0; i < b.size(); ++i) b.set(b.f, i, {0, 0, -9.81 * mesh.mass[i]});
    for (int n = 0; n < 1000; ++n) b.advance(h);
    for (uint32_t i = 0; i < b.size(); ++i)
      if (fixed[i] == 7) {
        EXPECT_EQ(b.get(b.x, i), mesh.at(i));
      }
    sag.push_back(mesh.at(tip)[2] - b.get(b.x, tip)[2]);
    const double omega = -std::log(1 - 0.99) / 0.01;
    EXPECT_NEAR(sag.back() / (9.81 / (omega * omega)), 1, 1e-3) << h;
  }
  EXPECT_NEAR(sag[0] / sag[1], 1, 1e-3);
}

TEST(ShapeMatching, ResponseWithoutAPrediction_IsRefusedInOneSentence) {
  Host host;
  Stepper b(host, shape(), regular_tet(), {});
  const dfm_kin k = b.kin();
  const uint32_t first = 0;
  double p[3] = {1, 0, 0}, du[3];
  EXPECT_EQ(b.ext->respond(b.self, &k, 1, &first, p, du), DFM_E_STATE);
  EXPECT_NE(host.logged.find("was not predicted"), std::string::npos) << host.logged;
}

TEST(ShapeMatching, Type_IsReportedAsPlausible) {
  EXPECT_TRUE(static_cast<const dfm_model *>(shape().ops)->caps & DFM_CAP_PLAUSIBLE);
  EXPECT_NE(std::string(shape().name).find("plausible"), std::string::npos);
}

TEST(ShapeMatching, ParameterOutOfItsRange_IsRefusedByName) {
  Host host;
  Stepper b(host, shape(), regular_tet(), {{"stiffness", 1}});
  EXPECT_EQ(b.status, DFM_E_ARG);
  EXPECT_NE(host.logged.find("stiffness"), std::string::npos) << host.logged;
}

// Clusters that share fewer than three points, or three in a line, part or fold about them.
TEST(ShapeMatching, ClustersThatShareTooFewPoints_AreRefusedInOneSentence) {
  const Mesh bar = kuhn_bar(12, 2, 2, 0.1);
  const auto made = [&](double clusters, double overlap) {
    Host host;
    const Stepper b(host, shape(), bar, {{"clusters", clusters}, {"overlap", overlap}});
    if (b.status == DFM_OK) return std::string("made");
    EXPECT_EQ(b.status, DFM_E_ARG);
    return host.logged;
  };
  EXPECT_EQ(made(1, 0), "made");
  EXPECT_EQ(made(10, 0.5), "made");
  for (const auto &[clusters, overlap] :
       {std::pair(10.0, 0.0), std::pair(4096.0, 0.0), std::pair(4096.0, 4.0)}) {
    const std::string said = made(clusters, overlap);
    EXPECT_NE(said.find("points do not hold together; take fewer clusters, or a larger overlap"),
              std::string::npos)
        << clusters << ' ' << overlap << ' ' << said;
  }
}

// (w h)^2 = 4 at h = 2 * 0.01 s / ln(10^4).
TEST(ShapeMatching, StepAtWhichClustersAreSofterThanRequested_IsReportedOnce) {
  const auto reported = [](double clusters, double h) {
    Host host;
    Stepper b(host, shape(), kuhn_bar(4, 2, 2, 0.1), {{"clusters", clusters}});
    for (int n = 0; n < 3; ++n) b.advance(h);
    const std::string what = "more softly than asked; up to 0.00217 s";
    size_t times = 0;
    for (size_t at = 0; (at = host.logged.find(what, at)) != std::string::npos; ++at) ++times;
    return times;
  };
  EXPECT_EQ(reported(4, 2.1e-3), 0u);
  EXPECT_EQ(reported(4, 2.2e-3), 1u);
  EXPECT_EQ(reported(1, 2.2e-3), 0u);
}

TEST(ShapeMatching, RefusedMemory_LeavesNothingBehind) {
  const Mesh mesh = kuhn_bar(2, 1, 1, 0.1);
  const Params three = {{"clusters", 3}, {"mode", kQuadratic}};
  refuse_each_allocation([&](Host &host) { return Stepper(host, shape(), mesh, three); });
}

// What 32 bits do not name is refused before anything is written there.
TEST(Model, ListsBeyondAllIndices_AreRefusedInOneSentence) {
  EXPECT_EQ(model::after(4000000000u, 294967295u, "too many"), UINT32_MAX);
  for (const uint64_t n : {uint64_t{294967296u}, uint64_t{1} << 32, UINT64_MAX})
    EXPECT_THROW(model::after(4000000000u, n, "too many"), const char *);
}

}  // namespace
}  // namespace stepper_test
