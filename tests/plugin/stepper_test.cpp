// A toy self-stepping model in contact, through dfm.stepper/1: a body that only translates. Its answers are
// those of a point mass, so every figure has a closed form.
#define DFM_STATIC_PLUGIN toy_stepper
#include "deform/plugin.hpp"
#include "coupled.h"
#include "under_ball.h"

namespace {

struct Toy {
  uint32_t npoint, nsurfel;
  std::vector<double> mass;
  std::vector<uint32_t> row, col;
  double total = 0;
};

uint32_t created = 0;

dfm_status create(const dfm_host *, const dfm_mesh *m, void **self) {
  ++created;
  Toy *t = new Toy{m->npoint, m->nsurfel, std::vector<double>(m->mass, m->mass + m->npoint),
                   std::vector<uint32_t>(m->row, m->row + m->nsurfel + 1),
                   std::vector<uint32_t>(m->col, m->col + m->row[m->nsurfel])};
  for (double x : t->mass) t->total += x;
  *self = t;
  return DFM_OK;
}
void destroy(void *self) { delete static_cast<Toy *>(self); }

// The velocity all points share, after external forces.
void mean_velocity(const Toy &t, const dfm_kin *k, const double *f, double v[3]) {
  for (int c = 0; c < 3; ++c) {
    double p = 0;
    for (uint32_t i = 0; i < t.npoint; ++i)
      p += t.mass[i] * k->v[size_t(i) * k->stride + c] + k->dt * f[size_t(i) * k->stride + c];
    v[c] = p / t.total;
  }
}

bool snaps = false;  // knows its first shape alone, and takes it at once
std::vector<double> first_shape;

struct Pending { double v[3]; };
Pending pending;  // predict and commit see the same external forces; one body in these tests

dfm_status predict(void *self, const dfm_kin *k, const double *f, double *u) {
  const Toy &t = *static_cast<Toy *>(self);
  mean_velocity(t, k, f, pending.v);
  for (uint32_t s = 0; s < t.nsurfel; ++s)
    for (int c = 0; c < 3; ++c) u[3 * s + c] = pending.v[c];
  return DFM_OK;
}
uint32_t requested = 0, requested_many = 0, most_at_once = 0;
bool offers_many = false;

dfm_status respond(void *self, const dfm_kin *, uint32_t n, const uint32_t *, const double *p, double *du) {
  const Toy &t = *static_cast<Toy *>(self);
  ++requested;
  for (int c = 0; c < 3; ++c) {
    double sum = 0;
    for (uint32_t i = 0; i < n; ++i) sum += p[3 * i + c];
    for (uint32_t i = 0; i < n; ++i) du[3 * i + c] = sum / t.total;
  }
  return DFM_OK;
}
dfm_status respond_many(void *self, const dfm_kin *k, uint32_t n, const uint32_t *surfel, uint32_t nrhs,
                        const double *p, double *du) {
  const uint32_t before = requested;
  for (uint32_t r = 0; r < nrhs; ++r) respond(self, k, n, surfel, p + 3 * n * r, du + 3 * n * r);
  requested = before;
  ++requested_many;
  most_at_once = std::max(most_at_once, nrhs);
  return DFM_OK;
}
dfm_status diagonal(void *self, const dfm_kin *, uint32_t n, const uint32_t *, double *w) {
  const Toy &t = *static_cast<Toy *>(self);
  for (uint32_t i = 0; i < 9 * n; ++i) w[i] = i % 9 == 0 || i % 9 == 4 || i % 9 == 8 ? 1 / t.total : 0;
  return DFM_OK;
}
// The longest stable step is 1 ms.
bool bounded = false;
double longest_touched = 0, longest_free = 0;
dfm_status bound(void *self, const dfm_kin *, double *ksum, double *, double *) {
  const Toy &t = *static_cast<Toy *>(self);
  for (uint32_t i = 0; bounded && i < t.npoint; ++i) ksum[i] += 4e6 * t.mass[i];
  return DFM_OK;
}

dfm_status commit(void *self, const dfm_kin *k, const double *p, double *x, double *v) {
  const Toy &t = *static_cast<Toy *>(self);
  const bool touched = std::any_of(p, p + 3 * size_t(t.nsurfel), [](double a) { return a != 0; });
  double &longest = touched ? longest_touched : longest_free;
  longest = std::max(longest, k->dt);
  for (int c = 0; c < 3; ++c) {
    double sum = 0;
    for (uint32_t s = 0; s < t.nsurfel; ++s) sum += p[3 * s + c];
    const double u = pending.v[c] + sum / t.total;
    for (uint32_t i = 0; i < t.npoint; ++i) {
      v[size_t(i) * k->stride + c] = u;
      x[size_t(i) * k->stride + c] = k->x[size_t(i) * k->stride + c] + k->dt * u;
    }
  }
  for (size_t i = 0; snaps && i < t.npoint; ++i)
    for (size_t c = 0; c < 3; ++c) x[i * k->stride + c] = first_shape[3 * i + c];
  for (uint32_t i = 0; i < t.npoint; ++i) v[size_t(i) * k->stride + 3] = x[size_t(i) * k->stride + 3] = 0;
  return DFM_OK;
}

const void *extension(const void *, const char *id) {
  static const dfm_stepper one{sizeof(dfm_stepper), 0, predict, respond, diagonal, commit, nullptr, nullptr};
  static const dfm_stepper many{sizeof(dfm_stepper), 0, predict, respond, diagonal, commit, nullptr,
                                respond_many};
  return std::string(id) != "dfm.stepper/1" ? nullptr : offers_many ? &many : &one;
}

}  // namespace

extern "C" const dfm_plugin *dfm_plugin_entry_toy_stepper(const dfm_host *host, uint32_t, uint32_t) {
  if (!DFM_ABI_OK(host)) return nullptr;
  static dfm_model ops{};
  ops.size = sizeof ops;
  ops.caps = DFM_CAP_ROTATION_INVARIANT;
  ops.cells = DFM_CELL_TET;
  ops.create = create;
  ops.destroy = destroy;
  ops.bound = bound;
  ops.extension = extension;
  static const char *const effects[] = {nullptr};
  static const dfm_type type = dfm::plugin::type(DFM_KIND_MODEL, "test.toy_stepper", "translating toy", "1",
                                                 "MIT", "Newton 1687", effects, &ops);
  static const dfm_type *const types[] = {&type};
  static const dfm_plugin plugin{sizeof(dfm_plugin), DFM_ABI, DFM_ABI_DRAFT, 1, types, nullptr};
  return &plugin;
}

namespace {

struct World {
  test::Context context;
  dfm_world world;
  dfm_body body;
  World(double mu, std::array<double, 3> gravity, double z, const dfm_surface_def *surface = nullptr) {
    test::ok(dfm_plugin_register_static(context, dfm_plugin_entry_toy_stepper, "toy_stepper"));
    world = test::make_world(context, gravity);
    test::BodyOptions o;
    o.name = "toy";
    o.model = "toy_stepper";
    o.position = {0, 0, z};
    o.surface = surface;
    body = test::make_body(context, world, "beam", {0.1, 0.1, 0.1}, 60, o);
    test::add_plane(world, "floor");
    test::set_friction(world, mu);
  }
};

}  // namespace

// unsanitized: too slow there; shorter tests run the same code
TEST(Stepper, DroppedOnAFloor_RestsAtTheOffsetAndCarriesItsWeight) {
  World w(0.5, {0, 0, -9.81}, 0.01);
  test::run(w.world, 1.0, 1e-3);
  const dfm_body_measure m = test::measure(w.body);
  EXPECT_LT(m.speed_max, 1e-9);
  dfm_pair_report pair{};
  uint32_t n = 0;
  ASSERT_EQ(dfm_world_pairs(w.world, 1, &pair, &n), DFM_OK) << dfm_last_error();
  EXPECT_NEAR(pair.normal, m.mass * 9.81, 1e-3 * m.mass * 9.81);
}

// A body that names a bound takes a long step alone and short ones in contact, also where it lands within a
// step; saved in contact, it goes on alike.
TEST(Stepper, WithABoundOfItsOwn_KeepsToItInContactOnly) {
  bounded = true;
  World w(0.5, {0.3, 0, -9.81}, 0.05), again(0.5, {0.3, 0, -9.81}, 0.05);
  longest_touched = longest_free = 0;
  test::run(w.world, 0.06, 0.01);
  EXPECT_EQ(longest_touched, 0);
  EXPECT_NEAR(longest_free, 0.01, 1e-12);
  EXPECT_EQ(test::stats(w.world).substeps_max, 1u);
  longest_free = 0;
  test::run(w.world, 0.2, 0.01);
  EXPECT_GT(longest_touched, 0.4e-3);
  EXPECT_LE(longest_touched, 1e-3);
  EXPECT_NEAR(test::stats(w.world).stable_step, 0.9e-3, 1e-12);
  const std::string saved = test::snapshot(w.world);
  test::run(again.world, 0.05, 0.01);
  test::ok(dfm_world_restore(again.world, saved.data(), saved.size()));
  for (const World *each : {&w, &again}) test::run(each->world, 0.1, 0.01);
  EXPECT_EQ(dfm_world_hash(w.world), dfm_world_hash(again.world));
  EXPECT_LT(test::measure(w.body).speed_max, 1e-9);
  EXPECT_LE(longest_touched, 1e-3);
  bounded = false;
}

// Without rows the function bounds nothing.
TEST(Stepper, WithoutABound_TakesAnyStepInContact) {
  World w(0.5, {0, 0, -9.81}, 1e-4);
  longest_touched = 0;
  test::run(w.world, 0.2, 0.01);
  EXPECT_NEAR(longest_touched, 0.01, 1e-12);
}

// All right-hand sides of a sub-step are asked in one call, with the same bits as one by one.
TEST(Stepper, ThatRespondsToMany_IsCalledOncePerSolve) {
  uint64_t hash[2];
  for (const bool many : {false, true}) {
    offers_many = many;
    requested = requested_many = most_at_once = 0;
    World w(0.5, {0.3, 0, -9.81}, 1e-4);
    test::run(w.world, 0.2, 1e-3);
    const dfm_world_stats s = test::stats(w.world);
    if (many) {
      EXPECT_EQ(requested, 0u);
      EXPECT_GT(requested_many, 0u);
      EXPECT_LE(requested_many, s.substeps);
      EXPECT_GE(most_at_once, 3u * 9) << "surfels of the lower face";
    } else {
      EXPECT_GT(requested, s.substeps);
      EXPECT_EQ(requested_many, 0u);
    }
    hash[many] = dfm_world_hash(w.world);
  }
  offers_many = false;
  EXPECT_EQ(hash[0], hash[1]);
}

// Its surface hangs on its points through N: positions come from the host, velocities from the model.
TEST(Stepper, WithASurfaceOfItsOwn_RestsOnItsSurfels) {
  const test::Skin skin = test::box_skin({0.1, 0.1, 0.1}, 5);  // no multiple of the cells
  const dfm_surface_def surface = skin.def();
  World w(0.5, {0, 0, -9.81}, 0.01, &surface);
  test::run(w.world, 1.0, 1e-3);
  const dfm_body_measure m = test::measure(w.body);
  EXPECT_LT(m.speed_max, 1e-9);
  dfm_pair_report pair{};
  uint32_t n = 0;
  ASSERT_EQ(dfm_world_pairs(w.world, 1, &pair, &n), DFM_OK) << dfm_last_error();
  EXPECT_NEAR(pair.normal, m.mass * 9.81, 1e-3 * m.mass * 9.81);
  EXPECT_GE(pair.count, 3u) << "of 36 below that could carry it";
  EXPECT_NEAR(m.com[2], 0.05 + 2e-5, 1e-9) << "d_c: a thousandth of the surface's median edge, 0.02 m";
}

TEST(Stepper, OnASlope_SlidesWithCoulombsAcceleration) {
  const double theta = 0.5, mu = 0.3;
  World w(mu, {9.81 * std::sin(theta), 0, -9.81 * std::cos(theta)}, 1e-4);
  test::run(w.world, 0.1, 1e-3);
  const double v0 = test::measure(w.body).velocity[0];
  test::run(w.world, 0.4, 1e-3);
  EXPECT_NEAR((test::measure(w.body).velocity[0] - v0) / 0.4, 9.81 * (std::sin(theta) - mu * std::cos(theta)),
              1e-3);
}

TEST(Stepper, OnASlopeBelowTheLimit_Holds) {
  World w(0.6, {9.81 * std::sin(0.5), 0, -9.81 * std::cos(0.5)}, 1e-4);
  test::run(w.world, 0.3, 1e-3);
  const double x0 = test::measure(w.body).com[0];
  test::run(w.world, 1.0, 1e-3);
  EXPECT_LT(std::fabs(test::measure(w.body).com[0] - x0), 1e-6);
}

// The seam meets the other kind of body: a soft ball on top of the toy.
TEST(Stepper, UnderASoftBall_BothRest) {
  World w(0.5, {0, 0, -9.81}, 1e-4);
  test::expect_block_carries_ball(w.context, w.world, w.body, 2.0);
}

namespace {

dfm_status to_model(dfm_body body, const char *type) { return dfm_body_set_model(body, type, nullptr); }

// A soft block on the floor, with the toy at hand.
struct Block {
  test::Context context;
  dfm_world world;
  dfm_body body;
  Block() {
    test::ok(dfm_plugin_register_static(context, dfm_plugin_entry_toy_stepper, "toy_stepper"));
    world = test::make_world(context);
    test::BodyOptions o;
    o.name = "block";
    o.young = 5e4;
    o.damping_stiffness = 2e-3;
    o.position = {0, 0, 1e-4};
    body = test::make_body(context, world, "beam", {0.1, 0.1, 0.1}, 60, o);
    test::add_plane(world, "floor");
    test::set_friction(world, 0.5);
    test::run(world, 0.5, 1e-3);
  }
  std::vector<double> points() const {
    const std::vector<double> x = test::State(body).x;
    return x;
  }
};

}  // namespace

// From a force model to a self-stepping one and back, in contact: the block stays at rest.
TEST(Stepper, TakesABodyOverInContact_AndGivesItBack) {
  Block b;
  const double z = test::measure(b.body).com[2];
  const std::vector<double> before = b.points();
  for (const char *model : {"toy_stepper", "corotational_fem", "toy_stepper", "msm"}) {
    test::ok(to_model(b.body, model));
    test::run(b.world, 0.3, 1e-3);
    EXPECT_NEAR(test::measure(b.body).com[2], z, 1e-4) << model;
    dfm_pair_report pair{};
    uint32_t n = 0;
    test::ok(dfm_world_pairs(b.world, 1, &pair, &n));
    EXPECT_NEAR(pair.normal, test::measure(b.body).mass * 9.81, 0.05) << model;
  }
  std::vector<dfm_swap> rows = test::listed(dfm_world_swaps, b.world);
  ASSERT_EQ(rows.size(), 4u);
  EXPECT_FALSE(std::isnan(rows[0].elastic_before));
  EXPECT_TRUE(std::isnan(rows[0].elastic_after));
  EXPECT_TRUE(std::isnan(rows[1].elastic_before));
  EXPECT_FALSE(std::isnan(rows[3].elastic_after));
}

TEST(Stepper, ThatWouldMoveTheSurfaceAtOnce_IsRefused) {
  Block b;
  const uint64_t hash = dfm_world_hash(b.world);
  first_shape = b.points();
  snaps = true;
  EXPECT_EQ(to_model(b.body, "toy_stepper"), DFM_OK)
      << "it stands where the model puts it: " << dfm_last_error();
  test::ok(to_model(b.body, "msm"));
  EXPECT_EQ(dfm_world_hash(b.world), hash);
  first_shape[2] += 1e-6;
  EXPECT_EQ(to_model(b.body, "toy_stepper"), DFM_DISCARD);
  test::says({"body 'block'", "test.toy_stepper", "would move the surface", "nothing was changed"});
  EXPECT_EQ(dfm_world_hash(b.world), hash);
  snaps = false;
}

TEST(Stepper, WhereLimitsCannotBeKnown_IsRefused) {
  Block b;
  const double limit = 1;
  const dfm_param_value v{"max_jump", &limit, 1};
  const dfm_params params{sizeof params, 1, &v};
  EXPECT_EQ(dfm_body_set_model(b.body, "toy_stepper", &params), DFM_DISCARD);
  test::says({"gives no energy", "max_jump"});
  const uint32_t point = 0;
  const dfm_spring_def spring{sizeof spring, 1, &point, nullptr, {0, 0, 0}, nullptr, 0, 0, 1, 0};
  test::ok(dfm_body_add_spring(b.body, &spring, nullptr));
  EXPECT_EQ(to_model(b.body, "toy_stepper"), DFM_E_UNSUPPORTED);
  test::says({"spring", "test.toy_stepper"});
}

// What a model has made of the mesh is not made again, until something that it was told has changed.
TEST(Stepper, ThatARuleComesBackTo_IsMadeOnce) {
  Block b;
  dfm_switch_rule rule = dfm_switch_rule_default();
  rule.otherwise.type = "toy_stepper";
  rule.near_by.type = "corotational_fem";
  rule.distance = 1;
  rule.wait = 0;
  created = 0;
  test::ok(dfm_body_set_switch_rule(b.body, &rule));
  const double here[3] = {0, 0, 0}, away[3] = {9, 0, 0};
  const auto to_and_fro = [&] {
    for (const double *point : {away, here}) {
      test::ok(dfm_body_set_interest(b.body, point));
      test::ok(dfm_world_step(b.world, 1e-3, nullptr));
    }
  };
  for (int i = 0; i < 5; ++i) to_and_fro();
  EXPECT_GE(test::listed(dfm_world_swaps, b.world).size(), 10u);
  EXPECT_EQ(created, 1u);
  const uint32_t point = 0;
  test::ok(dfm_body_hold(b.body, 1, &point, 7));
  to_and_fro();
  EXPECT_EQ(created, 2u) << "it is told what is held";
}
