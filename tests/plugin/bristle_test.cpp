// A law with state in contact: an elastic bristle (stiffness per area) that slides at the cone, with implicit radial return. It shows that the
// host owns typed state: it is carried with the contact, committed once per sub-step, dropped on lift-off, saved and restored.
#define DFM_STATIC_PLUGIN bristle
#include "world.h"

namespace {

// parameters: mu, sigma0 (N/m3). State: z (m), a tangent pair.
dfm_status eval(const dfm_friction_in *in, dfm_friction_out *out) {
  const double mu = in->params[0], sigma = in->params[1], h = in->dt;
  const uint32_t n = in->n, s = in->stride;
  for (uint32_t i = 0; i < n; ++i) {
    const double fn = in->fn[i] > 0 ? in->fn[i] : 0, k = sigma * in->area[i], most = mu * fn;
    double z[2] = {in->state[i], in->state[s + i]};
    const double old = k * std::sqrt(z[0] * z[0] + z[1] * z[1]);
    if (old > most) z[0] *= most / old, z[1] *= most / old;         // the old state first: onto the cone of the new normal force
    double t[2] = {z[0] + h * in->vt[i], z[1] + h * in->vt[s + i]};
    const double trial = k * std::sqrt(t[0] * t[0] + t[1] * t[1]);
    const bool slip = trial > most;
    double d[4] = {-k * h, 0, 0, -k * h}, e[2] = {0, 0};
    if (slip) {
      const double r = trial > 0 ? most / trial : 0, q[2] = {t[0] * k / trial, t[1] * k / trial};
      for (int a = 0; a < 2; ++a)
        for (int b = 0; b < 2; ++b) d[2 * a + b] = -k * h * r * ((a == b) - q[a] * q[b]);
      e[0] = -mu * q[0], e[1] = -mu * q[1];
      t[0] *= r, t[1] *= r;
    }
    if (out->ft) out->ft[i] = -k * t[0], out->ft[s + i] = -k * t[1];
    if (out->state) out->state[i] = t[0], out->state[s + i] = t[1];
    for (int a = 0; out->dft_dvt && a < 4; ++a) out->dft_dvt[a * s + i] = d[a];
    if (out->dft_dfn) out->dft_dfn[i] = e[0], out->dft_dfn[s + i] = e[1];
    if (out->limit) out->limit[i] = most;
    if (out->mode) out->mode[i] = fn > 0 ? (slip ? 2 : 1) : 0;
    if (out->stored) out->stored[i] = 0.5 * k * (t[0] * t[0] + t[1] * t[1]);
  }
  return DFM_OK;
}

}  // namespace

extern "C" const dfm_plugin *dfm_plugin_entry_bristle(const dfm_host *host, uint32_t, uint32_t) {
  if (!DFM_ABI_OK(host)) return nullptr;
  static const dfm_slot slot{DFM_PER_CONTACT, 2, DFM_SLOT_TANGENT, 0};
  static dfm_friction ops{};
  ops.size = sizeof ops, ops.needs = DFM_NEED_FN | DFM_NEED_VT | DFM_NEED_AREA, ops.flags = DFM_FRIC_ISOTROPIC | DFM_FRIC_PASSIVE | DFM_FRIC_JACOBIAN;
  ops.nslot = 1, ops.slots = &slot, ops.eval = eval;
  static const dfm_param rows[] = {{"mu", "friction coefficient", "1", 0, 10, 0.5, 0, 1, nullptr},
                                   {"sigma0", "bristle stiffness per area", "N/m^3", 0, 1e15, 1e8, 0, 1, nullptr}};
  static const char *const effects[] = {"presliding", nullptr};
  static dfm_type type{};
  type.size = sizeof type, type.kind = DFM_KIND_FRICTION, type.id = "test.bristle", type.name = "bristle", type.version = "1";
  type.licence = "MIT", type.source = "elastic predictor and radial return, Simo and Hughes 1998, box 1.4", type.params = rows, type.nparam = 2;
  type.param_size = sizeof(dfm_param), type.effects = effects, type.ops = &ops;
  static const dfm_type *const types[] = {&type};
  static const dfm_plugin plugin{sizeof(dfm_plugin), DFM_ABI, DFM_ABI_DRAFT, 1, types, nullptr};
  return &plugin;
}

namespace {

constexpr double kG = 9.81;

struct World {
  test::Context context;
  dfm_world world;
  dfm_body body;
  // A block of edge 0.1 m under gravity tilted by theta.
  // drag (1/s) lets the sway on undamped bristles die out; it carries nothing at rest.
  World(double theta, double sigma0, uint32_t cells = 200, double drag = 0) {
    test::ok(dfm_plugin_register_static(context, dfm_plugin_entry_bristle, "bristle"));
    world = test::make_world(context, {kG * std::sin(theta), 0, -kG * std::cos(theta)});
    test::BodyOptions o;
    o.young = 1e6, o.damping_stiffness = 1e-3, o.damping_mass = drag, o.position = {-0.05, -0.05, 2e-5};
    body = test::make_body(context, world, "beam", {0.1, 0.1, 0.1}, cells, o);
    test::add_plane(world, "floor");
    const double mu = 0.5;
    const dfm_param_value values[] = {{"mu", &mu, 1}, {"sigma0", &sigma0, 1}};
    dfm_friction_def f{};
    f.size = sizeof f, f.between[0] = f.between[1] = "*", f.law = "test.bristle", f.params = {sizeof(dfm_params), 2, values};
    test::ok(dfm_world_add_friction(world, &f));
  }
  std::vector<dfm_contact> contacts() {
    std::vector<dfm_contact> c(512);
    uint32_t n = 0;
    test::ok(dfm_world_contacts(world, 512, c.data(), &n));
    c.resize(n);
    return c;
  }
};

}  // namespace

// At rest on a slope the bristles carry the tangential weight: sum sigma0 A z = m g sin(theta), and with all of the base touching the mean
// deflection is m g sin(theta) / (sigma0 area of the base), whatever the mesh.
TEST(Bristle, AtRestOnASlope_DeflectsByWeightOverStiffnessTimesArea) {
  for (uint32_t cells : {100u, 600u}) {
    World w(0.2, 2e6, cells, 30);
    test::run(w.world, 1.5, 1e-3);
    double area = 0, carried = 0, force = 0;
    for (const dfm_contact &c : w.contacts()) {
      // along the slope, which is x; the second tangent is normal x tangent
      const double t1 = c.tangent[0], t2 = c.normal[1] * c.tangent[2] - c.normal[2] * c.tangent[1];
      area += c.area;
      carried += 2e6 * c.area * (c.bristle[0] * t1 + c.bristle[1] * t2);
      force -= c.ft[0] * t1 + c.ft[1] * t2;
    }
    const double weight = test::measure(w.body).mass * kG * std::sin(0.2);
    EXPECT_NEAR(area, 0.01, 0.02 * 0.01) << cells;
    EXPECT_NEAR(carried, weight, 0.01 * weight) << cells;
    EXPECT_NEAR(force, carried, 1e-6 * weight) << cells;
    EXPECT_LT(test::measure(w.body).speed_max, 1e-6) << cells;
  }
}

// No stiffness limit on the step: bristles are a compliance that is solved implicitly.
TEST(Bristle, FromSoftToNearlyRigid_HoldsAtTheSameStep) {
  for (double sigma0 : {1e6, 1e7, 1e8}) {
    World w(0.2, sigma0, 200, 30);
    test::run(w.world, 1.5, 1e-3);
    const double x0 = test::measure(w.body).com[0];
    test::run(w.world, 0.5, 1e-3);
    EXPECT_LT(std::fabs(test::measure(w.body).com[0] - x0), 1e-5) << sigma0;
    EXPECT_LT(test::measure(w.body).speed_max, 1e-3) << sigma0;
    EXPECT_LT(double(test::stats(w.world).unconverged), 0.01 * double(test::stats(w.world).substeps)) << sigma0;
  }
}

TEST(Bristle, AboveTheCone_SlidesWithCoulombsAcceleration) {
  World w(0.8, 1e8);
  test::run(w.world, 0.1, 1e-3);
  const double v0 = test::measure(w.body).velocity[0];
  test::run(w.world, 0.3, 1e-3);
  const double expected = kG * (std::sin(0.8) - 0.5 * std::cos(0.8));
  EXPECT_NEAR((test::measure(w.body).velocity[0] - v0) / 0.3, expected, 0.01 * expected);
}

TEST(Bristle, LiftedOff_ForgetsItsDeflection) {
  World w(0.2, 2e6);
  test::run(w.world, 1.0, 1e-3);
  ASSERT_FALSE(w.contacts().empty());
  const double up[3] = {0, 0, 30};
  test::ok(dfm_world_set_gravity(w.world, up));
  test::run(w.world, 0.1, 1e-3);
  EXPECT_TRUE(w.contacts().empty());
  const double down[3] = {0, 0, -kG};
  test::ok(dfm_world_set_gravity(w.world, down));
  test::run(w.world, 1.0, 1e-3);
  for (const dfm_contact &c : w.contacts()) EXPECT_LT(2e6 * c.area * std::hypot(c.bristle[0], c.bristle[1]), 0.5 * c.fn + 1e-9);
}

TEST(Bristle, SavedInMidContact_ContinuesWithTheSameBits) {
  World a(0.2, 2e6), b(0.2, 2e6);
  test::run(a.world, 0.2, 1e-3);
  size_t bytes = 0;
  test::ok(dfm_world_snapshot(a.world, nullptr, &bytes));
  std::vector<unsigned char> data(bytes);
  test::ok(dfm_world_snapshot(a.world, data.data(), &bytes));
  test::ok(dfm_world_restore(b.world, data.data(), bytes));
  test::run(a.world, 0.2, 1e-3), test::run(b.world, 0.2, 1e-3);
  EXPECT_EQ(dfm_world_hash(a.world), dfm_world_hash(b.world));
}
