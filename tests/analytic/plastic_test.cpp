// A bar pulled beyond yield and let go keeps the strain of the closed form, moved explicitly and implicitly
// and from equilibrium to equilibrium, and its plastic strain is part of a snapshot.
#include "support.h"
#include "world.h"

namespace {

constexpr double kYoung = 1e6, kYield = 2e4, kHardening = 2e5, kLength = 0.1, kArea = 4e-4, kPull = 0.06;

enum class Cells { tetrahedra, second_order, hexahedra };

struct Bar {
  test::Context context;
  dfm_world world;
  dfm_body body = 0;
  uint32_t n = 0;
  std::vector<double> rest;
  std::vector<uint32_t> end;

  explicit Bar(int32_t integrator, double yield = kYield, Cells cells = Cells::tetrahedra) {
    world = test::make_world(context, {0, 0, 0}, integrator);
    dfm_mesh_handle mesh = 0;
    const double size[3] = {kLength, 0.02, 0.02};
    test::ok(dfm_mesh_make(context, cells == Cells::hexahedra ? "bricks" : "beam", size, DFM_MESH_CELLS, 40,
                           &mesh));
    if (cells == Cells::second_order) test::ok(dfm_mesh_second_order(mesh, &mesh));
    dfm_body_def d = dfm_body_def_default();
    test::lend(mesh, d);
    test::BodyOptions o;
    o.young = kYoung;
    o.damping_mass = 200;  // let go it swings back past its new rest, but not as far as yield
    d.material = test::make_material(world, o);
    d.model = "corotational_fem";
    const double hardening = kHardening;
    const dfm_param_value values[2] = {{"yield", &yield, 1}, {"hardening", &hardening, 1}};
    d.model_params = {sizeof(dfm_params), 2, values};
    test::ok(dfm_body_create(world, &d, &body));
    test::ok(dfm_mesh_destroy(mesh));
    rest.resize(3 * size_t(d.npoint));
    test::ok(dfm_body_get_state(body, d.npoint, rest.data(), nullptr, &n));
    double low[3], high = 0;
    for (size_t k = 0; k < 3; ++k) {
      low[k] = rest[k];
      for (size_t i = k; i < rest.size(); i += 3) low[k] = std::min(low[k], rest[i]);
    }
    for (size_t i = 0; i < rest.size(); i += 3) high = std::max(high, rest[i]);
    // faces that meet in the lowest corner slide in themselves: a uniform stretch with free sides
    for (uint32_t i = 0; i < n; ++i) {
      const bool is_end = rest[3 * i] > high - 1e-9;
      uint8_t axes = is_end ? 1 : 0;
      for (size_t k = 0; k < 3; ++k) axes |= uint8_t((rest[3 * i + k] < low[k] + 1e-9) << k);
      if (axes) test::ok(dfm_body_hold(body, 1, &i, axes));
      if (is_end) end.push_back(i);
    }
  }
  ~Bar() { dfm_world_destroy(world); }

  // The end goes out by kPull, and then in by `back`, where it stays.
  void move_out(double back = -kPull) {
    dfm_pose_key keys[3] = {};
    for (dfm_pose_key &key : keys) key.pose = dfm_body_def_default().pose;
    keys[1].t = 0.3;
    keys[2].t = 0.6;
    keys[1].pose.position[0] = kPull * kLength;
    keys[2].pose.position[0] = -back * kLength;
    test::ok(dfm_body_move_held(body, uint32_t(end.size()), end.data(), 3, keys, nullptr));
  }
  void pull(double h) {
    move_out();
    test::run(world, 0.35, h);
  }
  void release() {
    for (const uint32_t i : end) {
      uint8_t axes = 0;
      for (size_t k = 1; k < 3; ++k)
        if (rest[3 * i + k] < *std::min_element(rest.begin(), rest.end()) + 1e-9) axes |= uint8_t(1 << k);
      test::ok(dfm_body_hold(body, 1, &i, axes));
    }
  }
  void let_go(double h) {
    release();
    test::run(world, 0.4, h);
  }
  double strain() const {
    std::vector<double> x(rest.size());
    uint32_t count = 0;
    test::ok(dfm_body_get_state(body, n, x.data(), nullptr, &count));
    double sum = 0;
    for (const uint32_t i : end) sum += x[3 * i] - rest[3 * i];
    return sum / double(end.size()) / kLength;
  }
};

}  // namespace

// sigma = E (e - p) = yield + hardening p at the end of the pull
TEST(Plastic, BarPulledBeyondYieldAndLetGo_KeepsThePermanentStrain) {
  const double permanent = (kYoung * kPull - kYield) / (kYoung + kHardening);
  for (const auto &[integrator, h] : {std::pair<int32_t, double>{DFM_INTEGRATOR_SYMPLECTIC_EULER, 5e-4},
                                      {DFM_INTEGRATOR_IMPLICIT_EULER, 1.0 / 240}}) {
    Bar bar(integrator);
    bar.pull(h);
    EXPECT_NEAR(bar.strain(), kPull, 1e-12);
    bar.let_go(h);
    EXPECT_NEAR(bar.strain(), permanent, 0.01 * permanent) << integrator;
    Bar elastic(integrator, 0);
    elastic.pull(h);
    elastic.let_go(h);
    EXPECT_NEAR(elastic.strain(), 0, 0.01 * permanent) << integrator;
  }
}

TEST(Plastic, BarOfCellsThatBend_KeepsThePermanentStrainAndContinuesFromASnapshot) {
  const double permanent = (kYoung * kPull - kYield) / (kYoung + kHardening);
  constexpr int32_t kExplicit = DFM_INTEGRATOR_SYMPLECTIC_EULER, kImplicit = DFM_INTEGRATOR_IMPLICIT_EULER;
  struct Way {
    Cells cells;
    int32_t integrator;
    double h;
  };
  for (const Way &w : {Way{Cells::second_order, kImplicit, 1.0 / 240},
                       Way{Cells::hexahedra, kImplicit, 1.0 / 240}, Way{Cells::hexahedra, kExplicit, 5e-4}}) {
    Bar bar(w.integrator, kYield, w.cells);
    bar.pull(w.h);
    EXPECT_NEAR(bar.strain(), kPull, 1e-12);
    const std::string shot = test::snapshot(bar.world);
    bar.let_go(w.h);
    EXPECT_NEAR(bar.strain(), permanent, 0.01 * permanent) << w.integrator;
    const uint64_t straight = dfm_world_hash(bar.world);
    test::ok(dfm_world_restore(bar.world, shot.data(), shot.size()));
    bar.let_go(w.h);
    EXPECT_EQ(dfm_world_hash(bar.world), straight);
  }
}

// Out beyond yield, in beyond it again, let go: uniform strains, which all cells have alike.
TEST(Plastic, BarPulledAndPushed_KeepsTheStrainWhateverItsCells) {
  std::vector<double> strain;
  for (const Cells cells : {Cells::tetrahedra, Cells::second_order, Cells::hexahedra}) {
    Bar bar(DFM_INTEGRATOR_AUTO, kYield, cells);
    bar.move_out(0.04);
    dfm_equilibrium_def def = dfm_equilibrium_def_default();
    def.load_steps = 3;
    for (const double t : {0.3, 0.6}) {
      def.time = t;
      test::ok(dfm_world_equilibrium(bar.world, &def, nullptr));
    }
    EXPECT_NEAR(bar.strain(), -0.04, 1e-12);
    bar.release();
    test::ok(dfm_world_equilibrium(bar.world, nullptr, nullptr));
    strain.push_back(bar.strain());
  }
  EXPECT_LT(strain[0], -0.005);
  for (const double s : strain) EXPECT_NEAR(s / strain[0], 1, 1e-6);
}

TEST(Plastic, BarInEquilibriumBeyondYieldAndFree_KeepsThePermanentStrain) {
  Bar bar(DFM_INTEGRATOR_AUTO);
  bar.move_out();
  dfm_equilibrium_def def = dfm_equilibrium_def_default();
  def.time = 0.3;
  def.load_steps = 3;
  test::ok(dfm_world_equilibrium(bar.world, &def, nullptr));
  EXPECT_NEAR(bar.strain(), kPull, 1e-12);
  bar.release();
  test::ok(dfm_world_equilibrium(bar.world, nullptr, nullptr));
  const double permanent = (kYoung * kPull - kYield) / (kYoung + kHardening);
  EXPECT_NEAR(bar.strain(), permanent, 1e-6 * permanent);
}

// Flow is complete, however slow it is; a free body gets there in few steps.
TEST(Plastic, FreeBarInEquilibrium_FlowsToTheEndWhateverItsSpeed) {
  std::vector<double> length;
  for (const double creep : {-1.0, 1e-2}) {
    Bar bar(DFM_INTEGRATOR_AUTO);
    const dfm_param_value value = {"creep", &creep, 1};
    const dfm_params params = {sizeof params, 1, &value};
    test::ok(dfm_body_set_params(bar.body, &params));
    const double low = *std::min_element(bar.rest.begin(), bar.rest.end());
    std::vector<uint32_t> start;
    for (uint32_t i = 0; i < bar.n; ++i) {
      test::ok(dfm_body_hold(bar.body, 1, &i, 0));
      if (bar.rest[3 * i] < low + 1e-9) start.push_back(i);
    }
    for (const auto *points : {&start, &bar.end}) {
      const double sign = points == &start ? -1 : 1, count = double(points->size());
      std::vector<double> f(3 * points->size(), 0);
      for (size_t k = 0; k < f.size(); k += 3) f[k] = sign * 1.2 * kYield * kArea / count;
      test::ok(dfm_body_add_load(bar.body, uint32_t(points->size()), points->data(), f.data(), 0, nullptr,
                                 nullptr, nullptr));
    }
    dfm_equilibrium_info info{};
    info.size = sizeof info;
    test::ok(dfm_world_equilibrium(bar.world, nullptr, &info));
    EXPECT_LT(info.iterations, 200u) << creep;
    std::vector<double> x(bar.rest.size());
    uint32_t n = 0;
    test::ok(dfm_body_get_state(bar.body, bar.n, x.data(), nullptr, &n));
    double sum = 0;
    for (const uint32_t i : bar.end) sum += x[3 * i] / double(bar.end.size());
    for (const uint32_t i : start) sum -= x[3 * i] / double(start.size());
    length.push_back(sum);
  }
  EXPECT_GT(length[0], kLength * (1 + 1.2 * kYield / kYoung + 0.1 * kYield / kHardening));
  EXPECT_NEAR(length[1], length[0], 1e-6 * kLength);
}

TEST(Plastic, SnapshotAndDiscardedStepInTheFlow_ContinueToTheSameBits) {
  for (const int32_t integrator : {DFM_INTEGRATOR_SYMPLECTIC_EULER, DFM_INTEGRATOR_IMPLICIT_EULER}) {
    Bar bar(integrator);
    bar.pull(1e-3);
    const std::string shot = test::snapshot(bar.world);
    // a step that is taken back leaves no flow behind
    const uint64_t before = dfm_world_hash(bar.world);
    uint32_t trouble = 0;
    test::ok(dfm_world_interrupt(bar.world));
    EXPECT_EQ(dfm_world_step(bar.world, 1e-3, &trouble), DFM_DISCARD);
    EXPECT_EQ(dfm_world_hash(bar.world), before);
    bar.let_go(1e-3);
    const uint64_t straight = dfm_world_hash(bar.world);
    test::ok(dfm_world_restore(bar.world, shot.data(), shot.size()));
    bar.let_go(1e-3);
    EXPECT_EQ(dfm_world_hash(bar.world), straight);
  }
}
