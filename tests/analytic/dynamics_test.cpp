// Motion of finite elements with lumped masses against reference/elasticity: the step response and
// the frequencies of a bar, the swing of a corotational one, and what lumping leaves of the frequencies.
#include <algorithm>
#include <cstdlib>

#include "support.h"
#include "world.h"

namespace {

std::string reference(const std::string &name) { return test::reference_dir() + "/elasticity/" + name; }

struct Bar {
  test::Context context;
  dfm_world world = 0;
  dfm_body body = 0;
  uint32_t npoint = 0;
  std::vector<uint32_t> of_node, tets;
  std::vector<double> rest;

  // mesh: of meshes/, held at x = 0 or free
  Bar(const std::string &mesh_file, bool held, const test::BodyOptions &o, double gravity,
      int32_t integrator = DFM_INTEGRATOR_AUTO) {
    world = test::make_world(context, {0, 0, gravity}, integrator);
    dfm_mesh_handle mesh = 0;
    test::ok(dfm_mesh_load(context, (test::mesh_dir() + "/" + mesh_file).c_str(), DFM_MESH_CELLS, &mesh));
    dfm_body_def d = dfm_body_def_default();
    const uint32_t *const file_point = test::lend(mesh, d).file_point;
    npoint = d.npoint;
    rest.assign(d.points, d.points + 3 * size_t(npoint));
    tets.assign(d.tets, d.tets + 4 * size_t(d.ntet));
    for (uint32_t i = 0; i < npoint; ++i) {
      if (of_node.size() <= file_point[i]) of_node.resize(file_point[i] + 1, UINT32_MAX);
      of_node[file_point[i]] = i;
    }
    d.material = test::make_material(world, o);
    d.model = o.model.c_str();
    for (int k = 0; k < 3; ++k) d.spin[k] = o.spin[size_t(k)];
    test::ok(dfm_body_create(world, &d, &body));
    test::ok(dfm_mesh_destroy(mesh));
    for (uint32_t i = 0; held && i < npoint; ++i)
      if (rest[3 * i] < 1e-9) test::ok(dfm_body_hold(body, 1, &i, 7));
  }
  ~Bar() { dfm_world_destroy(world); }

  std::vector<double> positions() const { return test::State(body).x; }
  // Largest distance from the places of a field over the largest displacement in it; u: displacements.
  double error_of(const std::string &field, bool u) const {
    const std::vector<double> x = positions();
    const auto rows = test::read_csv(field);
    double most = 0, largest = 0;
    for (size_t r = 1; r < rows.size(); ++r) {
      const uint32_t p = of_node[std::stoul(rows[r][0])];
      for (size_t k = 0; k < 3; ++k) {
        const double place = std::strtod(rows[r][k + 1].c_str(), nullptr) + (u ? rest[3 * p + k] : 0);
        most = std::max(most, std::fabs(x[3 * p + k] - place));
        largest = std::max(largest, std::fabs(place - rest[3 * p + k]));
      }
    }
    return most / largest;
  }
};

test::BodyOptions material(const char *model, double young) {
  test::BodyOptions o;
  o.name = "bar";
  o.model = model;
  o.young = young;
  o.poisson = 0.3;
  o.density = 1000;
  return o;
}

// Errors at the end with a step and with half of it.
struct Errors { double coarse, fine; };
Errors errors_of(const test::BodyOptions &o, double seconds, double h, const std::string &field,
                 int32_t integrator = DFM_INTEGRATOR_SYMPLECTIC_EULER) {
  const bool spins = o.spin[2] != 0;
  const auto error = [&](double step) {
    Bar bar(spins ? "bars/bar_s1.msh" : "bars/bar_s2.msh", !spins, o,
            spins                     ? 0
            : o.model == "linear_fem" ? -0.2
                                      : -9.81,
            integrator);
    test::run(bar.world, seconds, step);
    return bar.error_of(reference("fields/" + field), o.model == "linear_fem");
  };
  return {error(h), error(0.5 * h)};
}

}  // namespace

// Gravity switched on; the reference is the exact sum of modes.
TEST(Dynamics, LinearBarAfter2Seconds_ApproachesTheSumOfModesInFirstOrder) {
  test::BodyOptions o = material("linear_fem", 1e5);
  const Errors plain = errors_of(o, 2, 1e-3, "dyn_linear_damp0_t2.csv");
  EXPECT_LT(plain.coarse, 1.5e-4);
  EXPECT_NEAR(plain.coarse / plain.fine, 2, 0.1);
  const Errors implicit = errors_of(o, 2, 2e-3, "dyn_linear_damp0_t2.csv", DFM_INTEGRATOR_IMPLICIT_EULER);
  EXPECT_LT(implicit.coarse, 2e-3);
  EXPECT_NEAR(implicit.coarse / implicit.fine, 2, 0.2);
  o.damping_mass = 0.5;
  o.damping_stiffness = 0.002;
  const Errors damped = errors_of(o, 2, 4e-4, "dyn_linear_damp1_t2.csv");
  EXPECT_LT(damped.coarse, 1e-4);
  EXPECT_NEAR(damped.coarse / damped.fine, 2, 0.2);
  const Errors damped_implicit =
      errors_of(o, 2, 2e-3, "dyn_linear_damp1_t2.csv", DFM_INTEGRATOR_IMPLICIT_EULER);
  EXPECT_LT(damped_implicit.coarse, 2e-3);
  EXPECT_NEAR(damped_implicit.coarse / damped_implicit.fine, 2, 0.2);
}

// A swing through a large angle, and a spin at 1,000 rounds per minute; reference: DOP853 to 1e-11.
TEST(Dynamics, CorotationalBarThatSwingsAndSpins_FollowsTheReference) {
  const Errors swing = errors_of(material("corotational_fem", 1e6), 0.3, 2e-4, "dyn_corot_swing_t0.3.csv");
  EXPECT_LT(swing.coarse, 6e-4);
  EXPECT_NEAR(swing.coarse / swing.fine, 2, 0.1);
  test::BodyOptions o = material("corotational_fem", 5e7);
  o.spin = {0, 0, 104.719755};
  const Errors spin = errors_of(o, 0.06, 2e-5, "dyn_corot_spin_t0.06.csv");
  EXPECT_LT(spin.coarse, 3e-5);
  EXPECT_GT(spin.coarse / spin.fine, 1.9);  // its first-order part happens to be small
}

namespace {

struct Peak { double frequency, power; };

// Where near `guess` the signal is strongest, Hz; in the window of Blackman and Harris (1978), which lets
// nothing of a mode four bins away through.
Peak peak(std::vector<double> signal, double dt, double guess) {
  const size_t n = signal.size();
  for (size_t i = 0; i < n; ++i) {
    const double turn = 2 * M_PI * double(i) / double(n);
    signal[i] *=
        0.35875 - 0.48829 * std::cos(turn) + 0.14128 * std::cos(2 * turn) - 0.01168 * std::cos(3 * turn);
  }
  const auto power = [&](double f) {
    double re = 0, im = 0;
    for (size_t i = 0; i < n; ++i) {
      const double phase = 2 * M_PI * f * double(i) * dt;
      re += signal[i] * std::cos(phase);
      im += signal[i] * std::sin(phase);
    }
    return re * re + im * im;
  };
  const double bin = 1 / (double(n) * dt);
  double low = guess - 2 * bin, high = guess + 2 * bin;
  for (int k = 0; k < 30; ++k) {
    const double a = low + 0.382 * (high - low), b = low + 0.618 * (high - low);
    (power(a) > power(b) ? high : low) = power(a) > power(b) ? b : a;
  }
  return {0.5 * (low + high), power(0.5 * (low + high))};
}

}  // namespace

// Bending about both axes twice, torsion, and along the axis: free vibration of a bar that is thrown.
TEST(Dynamics, LinearBar_VibratesWithTheFrequenciesOfItsLumpedMass) {
  std::vector<double> expected;  // rad2/s2
  for (const auto &row : test::read_csv(reference("tables/modal_p1_eigenvalues_rad2_s2.csv")))
    if (row[0] == "bar_s2" && row[1] == "cantilever" && row[2] == "lumped")
      for (size_t k = 3; k < 9; ++k) expected.push_back(std::strtod(row[k].c_str(), nullptr));
  ASSERT_EQ(expected.size(), 6u);
  Bar bar("bars/bar_s2.msh", true, material("linear_fem", 1e7), 0);
  std::vector<double> v(bar.rest.size());
  std::vector<uint32_t> tip;
  for (uint32_t i = 0; i < bar.npoint; ++i) {
    const double *const p = &bar.rest[3 * size_t(i)];
    const double y = p[1] - 0.05, z = p[2] - 0.05, s = p[0], bend = s * s * (1 - 1.2 * s);
    v[3 * i] = 1e-3 * s;
    v[3 * i + 1] = 1e-3 * bend - 1e-2 * s * z;
    v[3 * i + 2] = 1e-3 * bend + 1e-2 * s * y;
    if (s > 1 - 1e-9) tip.push_back(i);
  }
  test::ok(dfm_body_set_state(bar.body, bar.npoint, nullptr, v.data()));
  constexpr double kStep = 1.9e-4, kEvery = 20 * kStep;  // s; the step is not cut
  std::vector<double> signals[4];                        // tip: along y, along z, turn, along x
  for (int k = 0; k < 3000; ++k) {
    test::run(bar.world, kEvery, kStep);
    const std::vector<double> x = bar.positions();
    double along[3] = {}, turn = 0;
    for (const uint32_t i : tip) {
      const double *const rest = &bar.rest[3 * size_t(i)];
      double u[3];
      for (size_t a = 0; a < 3; ++a) along[a] += u[a] = x[3 * i + a] - rest[a];
      turn += u[2] * (rest[1] - 0.05) - u[1] * (rest[2] - 0.05);
    }
    signals[0].push_back(along[1]);
    signals[1].push_back(along[2]);
    signals[2].push_back(turn);
    signals[3].push_back(along[0]);
  }
  for (size_t mode = 0; mode < 6; ++mode) {
    const double f = std::sqrt(expected[mode]) / (2 * M_PI);
    Peak best{};
    for (const auto &signal : signals)
      if (const Peak found = peak(signal, kEvery, f); found.power > best.power) best = found;
    EXPECT_NEAR(best.frequency / f, 1, 1e-4) << "mode " << mode << ", " << f << " Hz";
  }
}
