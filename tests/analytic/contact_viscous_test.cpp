// Viscous layers and smoothed friction under a block, by laws of three kinds: smooth with derivatives, smooth
// without, and set-valued with a viscous part. A block on a layer of c per area loses its speed as exp(-c A t
// / m); on mu fn v / sqrt(v^2 + e^2) it creeps down a slope at a speed that is known. Sources: closed forms;
// doc/laws/formulas.md (16), creep of smoothed laws.
#include "deform/plugin.hpp"
#include "world.h"

namespace {

constexpr double kG = 9.81, kSmooth = 1e-3;  // m/s2, m/s

// Linear in the slip, per area; the flag says whether it gives its derivatives.
dfm_status viscous(const dfm_friction_in *in, dfm_friction_out *out) {
  const size_t stride = in->stride;
  for (size_t i = 0; i < in->n; ++i) {
    const double c = in->params[0] * in->area[i];
    if (out->ft) {
      out->ft[i] = -c * in->vt[i];
      out->ft[stride + i] = -c * in->vt[stride + i];
    }
    if (out->dft_dvt) {
      out->dft_dvt[i] = out->dft_dvt[3 * stride + i] = -c;
      out->dft_dvt[stride + i] = out->dft_dvt[2 * stride + i] = 0;
    }
    if (out->dft_dfn) out->dft_dfn[i] = out->dft_dfn[stride + i] = 0;
    if (out->limit) out->limit[i] = HUGE_VAL;
    if (out->mode) out->mode[i] = 2;
  }
  return DFM_OK;
}

dfm_status smoothed(const dfm_friction_in *in, dfm_friction_out *out) {
  const size_t stride = in->stride;
  for (size_t i = 0; i < in->n; ++i) {
    const double x = in->vt[i];
    const double y = in->vt[stride + i];
    const double r = std::sqrt(x * x + y * y + kSmooth * kSmooth);
    const double mu = in->params[0];
    const double f = mu * in->fn[i];
    if (out->ft) {
      out->ft[i] = -f * x / r;
      out->ft[stride + i] = -f * y / r;
    }
    if (out->dft_dvt) {
      const double q = f / (r * r * r);
      out->dft_dvt[i] = -q * (y * y + kSmooth * kSmooth);
      out->dft_dvt[3 * stride + i] = -q * (x * x + kSmooth * kSmooth);
      out->dft_dvt[stride + i] = out->dft_dvt[2 * stride + i] = q * x * y;
    }
    if (out->dft_dfn) {
      out->dft_dfn[i] = -mu * x / r;
      out->dft_dfn[stride + i] = -mu * y / r;
    }
    if (out->limit) out->limit[i] = f;
    if (out->mode) out->mode[i] = 2;
  }
  return DFM_OK;
}

const dfm_param rows[] = {{"c", "drag per area, or coefficient", "1", 0.0, 1e12, 1.0, 0, 1, nullptr}};
constexpr uint32_t kNeeds = DFM_NEED_FN | DFM_NEED_VT | DFM_NEED_AREA,
                   kPlain = DFM_FRIC_ISOTROPIC | DFM_FRIC_PASSIVE;
const dfm_friction with = {sizeof(dfm_friction),
                           kNeeds,
                           kPlain | DFM_FRIC_JACOBIAN,
                           0,
                           nullptr,
                           viscous,
                           nullptr,
                           nullptr,
                           nullptr,
                           nullptr,
                           0,
                           0,
                           nullptr};
const dfm_friction without = {sizeof(dfm_friction),
                              kNeeds,
                              kPlain,
                              0,
                              nullptr,
                              viscous,
                              nullptr,
                              nullptr,
                              nullptr,
                              nullptr,
                              0,
                              0,
                              nullptr};
const dfm_friction smooth = {sizeof(dfm_friction),
                             kNeeds,
                             kPlain | DFM_FRIC_JACOBIAN,
                             0,
                             nullptr,
                             smoothed,
                             nullptr,
                             nullptr,
                             nullptr,
                             nullptr,
                             0,
                             0,
                             nullptr};

dfm_type type(const char *id, const dfm_friction *ops) {
  return dfm::plugin::type(DFM_KIND_FRICTION, id, "test", "1.0", "MIT", "test", rows, nullptr, ops);
}
const dfm_type types[] = {type("org.test.viscous", &with), type("org.test.viscous_bare", &without),
                          type("org.test.smoothed", &smooth)};
const dfm_type *const list[] = {types, types + 1, types + 2};
const dfm_plugin plugin = {sizeof(dfm_plugin), DFM_ABI, DFM_ABI_DRAFT, 3, list, nullptr};
const dfm_plugin *entry(const dfm_host *, uint32_t, uint32_t) { return &plugin; }

struct Block {
  test::Context context;
  dfm_world world = 0;
  dfm_body body = 0;
  Block(double theta, const char *law, const test::LawValues &params) {
    test::ok(dfm_plugin_register_static(context, entry, "test laws"));
    world = test::make_world(context, {kG * std::sin(theta), 0, -kG * std::cos(theta)});
    test::BodyOptions o;
    o.name = "block";
    o.young = 1e6;
    o.damping_stiffness = 1e-3;
    o.position = {-0.05, -0.05, 2e-5};
    body = test::make_body(context, world, "beam", {0.1, 0.1, 0.1}, 60, o);
    test::add_plane(world, "floor");
    test::ok(test::add_friction(world, law, params));
  }
  void push(double vx, double vy) const {
    uint32_t n = 0;
    test::ok(dfm_body_get_state(body, 0, nullptr, nullptr, &n));
    std::vector<double> v(size_t(3) * n);
    for (size_t i = 0; i < n; ++i) {
      v[3 * i] = vx;
      v[3 * i + 1] = vy;
    }
    test::ok(dfm_body_set_state(body, n, nullptr, v.data()));
  }
};

}  // namespace

TEST(Viscous, BlockOnLayer_LosesSpeedExponentially) {
  for (const double c : {1e2, 4e2})
    for (const std::string law : {"org.test.viscous", "org.test.viscous_bare", "coulomb"}) {
      Block b(0, law.c_str(),
              law == "coulomb" ? test::LawValues{{"mu_C", 0}, {"mu_S", 0}, {"sigma2", c}}
                               : test::LawValues{{"c", c}});
      test::run(b.world, 0.2, 1e-3);
      b.push(0.5, 0.25);
      const double rate = c * 0.01 / test::measure(b.body).mass;  // 1/s
      test::run(b.world, 0.3, 1e-3);
      const dfm_body_measure m = test::measure(b.body);
      const double left = std::exp(-rate * 0.3);
      EXPECT_NEAR(m.velocity[0], 0.5 * left, 0.02 * 0.5 * left) << law << ", " << c;
      EXPECT_NEAR(m.velocity[1], 0.25 * left, 0.02 * 0.25 * left) << law << ", " << c;
      EXPECT_EQ(test::stats(b.world).unconverged, 0u) << law << ", " << c;
    }
}

// However stiff the layer, with or without derivatives, the passes converge at once and nothing is thrown: h
// w_t c up to 1e8.
TEST(Viscous, StiffLayer_HoldsTheBlock) {
  for (const double c : {1e5, 1e7, 1e10})
    for (const char *law : {"org.test.viscous", "org.test.viscous_bare"}) {
      Block b(0.2, law, {{"c", c}});
      test::run(b.world, 0.5, 1e-3);
      const double speed = test::measure(b.body).velocity[0];
      const double terminal = test::measure(b.body).mass * kG * std::sin(0.2) / (c * 0.01);
      if (c == 1e5) {
        EXPECT_NEAR(speed, terminal, 0.02 * terminal) << law;
      } else {  // the block's shear relaxes for c L / G = 2.6 s and more
        EXPECT_LT(std::fabs(speed), 1e-4) << law << ", " << c;
      }
      EXPECT_LE(test::stats(b.world).passes_max, 4u) << law << ", " << c;
      EXPECT_EQ(test::stats(b.world).unconverged, 0u) << law << ", " << c;
    }
}

TEST(Viscous, SmoothedFriction_CreepsAtTheSpeedOfItsSlope) {
  const double theta = 0.5, mu = 0.8, t = std::tan(theta) / mu;
  Block b(theta, "org.test.smoothed", {{"c", mu}});
  test::run(b.world, 1, 1e-3);
  const double exact = kSmooth * t / std::sqrt(1 - t * t);
  EXPECT_NEAR(test::measure(b.body).velocity[0], exact, 1e-4 * exact);
}
