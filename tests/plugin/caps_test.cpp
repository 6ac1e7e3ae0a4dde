// What a model can with its present parameters (dfm.caps/1) is what the world goes by, not what its type
// claims: energy watch, measure, implicit steps, the choice of an integrator, explain.
#define DFM_STATIC_PLUGIN caps
#include <cmath>
#include <cstring>

#include "world.h"

namespace {

// Each point hangs on its place at rest by a spring. `kind`: 0 stiffness that never changes, 1 one that may,
// 2 none, 3 fails when it is asked its abilities.
struct Springs {
  uint32_t npoint;
  std::vector<double> rest;
  double kind;
};
constexpr double kStiffness = 40;

dfm_status create(const dfm_host *, const dfm_mesh *m, void **self) {
  *self = new Springs{m->npoint, std::vector<double>(m->rest, m->rest + 3 * size_t(m->npoint)), m->params[0]};
  return DFM_OK;
}
void destroy(void *self) { delete static_cast<Springs *>(self); }
dfm_status set_params(void *self, const double *params) {
  static_cast<Springs *>(self)->kind = params[0];
  return DFM_OK;
}
dfm_status add_forces(void *self, const dfm_kin *k, double *f) {
  const Springs &s = *static_cast<Springs *>(self);
  for (uint32_t i = 0; i < s.npoint; ++i)
    for (size_t c = 0; c < 3; ++c)
      f[size_t(i) * k->stride + c] -=
          kStiffness * (k->x[size_t(i) * k->stride + c] - s.rest[3 * size_t(i) + c]);
  return DFM_OK;
}
dfm_status bound(void *self, const dfm_kin *, double *ksum, double *, double *) {
  for (uint32_t i = 0; i < static_cast<Springs *>(self)->npoint; ++i) ksum[i] += kStiffness;
  return DFM_OK;
}
dfm_status pattern(const void *self, uint32_t *nb, uint32_t *ij) {
  *nb = static_cast<const Springs *>(self)->npoint;
  for (uint32_t i = 0; ij && i < *nb; ++i) ij[2 * size_t(i)] = ij[2 * size_t(i) + 1] = i;
  return DFM_OK;
}
dfm_status stiffness(void *self, const dfm_kin *, double a, double, double *blk) {
  for (size_t i = 0; i < static_cast<Springs *>(self)->npoint; ++i)
    for (size_t c = 0; c < 3; ++c) blk[9 * i + 4 * c] -= a * kStiffness;
  return DFM_OK;
}
uint32_t holds(const void *self) {
  const double kind = static_cast<const Springs *>(self)->kind;
  if (kind == 3) throw 1;
  return kind == 0   ? DFM_CAP_STIFFNESS | DFM_CAP_CONSTANT_STIFFNESS
         : kind == 1 ? DFM_CAP_STIFFNESS | DFM_CAP_PLAUSIBLE  // which its type does not claim
                     : 0;
}
const dfm_caps caps = {sizeof(dfm_caps), 0, holds};
const void *extension(const void *, const char *id) {
  return std::strcmp(id, DFM_EXT_CAPS) ? nullptr : &caps;
}

const dfm_param rows[] = {
    {"kind", "its abilities", "1", 0, 3, 0, DFM_PARAM_RUNTIME | DFM_PARAM_INTEGER, 1, nullptr}};
const dfm_model model = {sizeof(dfm_model),
                         DFM_CAP_STIFFNESS | DFM_CAP_CONSTANT_STIFFNESS,
                         DFM_CELL_TET,
                         0,
                         nullptr,
                         create,
                         destroy,
                         set_params,
                         nullptr,
                         add_forces,
                         bound,
                         nullptr,
                         pattern,
                         stiffness,
                         extension,
                         0,
                         0};
const dfm_type type = {sizeof(dfm_type), DFM_KIND_MODEL, "test.caps", "springs",         "1",     "MIT",
                       "Hooke 1678",     rows,           1,           sizeof(dfm_param), nullptr, &model};
const dfm_type *const types[] = {&type};
const dfm_plugin plugin = {sizeof(dfm_plugin), DFM_ABI, DFM_ABI_DRAFT, 1, types, nullptr};

}  // namespace

extern "C" const dfm_plugin *dfm_plugin_entry_caps(const dfm_host *host, uint32_t, uint32_t) {
  return DFM_ABI_OK(host) ? &plugin : nullptr;
}

namespace {

dfm_params one(const dfm_param_value &value) { return {sizeof(dfm_params), 1, &value}; }
dfm_status set(dfm_body b, const char *key, double to) {
  const dfm_param_value value = {key, &to, 1};
  const dfm_params params = one(value);
  return dfm_body_set_params(b, &params);
}
std::string explained(dfm_world w) {
  size_t bytes = 0;
  test::ok(dfm_world_explain(w, nullptr, &bytes));
  std::string text(bytes, ' ');
  test::ok(dfm_world_explain(w, text.data(), &bytes));
  return text;
}

struct Body {
  test::Context context;
  dfm_world world = 0;
  dfm_body body = 0;
  dfm_status made = DFM_OK;
  Body(const char *name, const char *key, double value, int32_t integrator, double step = 0) {
    test::ok(dfm_plugin_register_static(context, dfm_plugin_entry_caps, "caps"));
    dfm_world_def def = dfm_world_def_default();
    def.step = step;
    test::ok(dfm_world_create(context, &def, &world));
    dfm_mesh_handle mesh = 0;
    const double size[] = {0.1, 0.1, 0.1};
    test::ok(dfm_mesh_make(context, "beam", size, DFM_MESH_CELLS, 60, &mesh));
    dfm_body_def d = dfm_body_def_default();
    test::lend(mesh, d);
    d.model = name;
    d.integrator = integrator;
    const dfm_param_value row = {key, &value, 1};
    d.model_params = one(row);
    made = dfm_body_create(world, &d, &body);
    test::ok(dfm_mesh_destroy(mesh));
  }
};

// With rotation = qr forces are no gradient of the energy (rules M04), so there is none to tell or to watch.
TEST(Caps, OfCorotationalWithQr_LeaveNoEnergy) {
  for (const int32_t integrator : {DFM_INTEGRATOR_SYMPLECTIC_EULER, DFM_INTEGRATOR_IMPLICIT_EULER}) {
    Body b("corotational_fem", "rotation", 2, integrator);
    ASSERT_EQ(b.made, DFM_OK) << dfm_last_error();
    EXPECT_TRUE(std::isnan(test::measure(b.body).elastic));
    EXPECT_NE(explained(b.world).find("gives no energy, or not with these parameters"), std::string::npos);
    test::ok(set(b.body, "rotation", 0));
    EXPECT_FALSE(std::isnan(test::measure(b.body).elastic)) << "asked again after set_params";
    EXPECT_EQ(explained(b.world).find("gives no energy"), std::string::npos);
    test::run(b.world, 0.02, 1e-3);
    size_t bytes = 0;
    test::ok(dfm_world_snapshot(b.world, nullptr, &bytes));
    std::vector<unsigned char> before(bytes);
    test::ok(dfm_world_snapshot(b.world, before.data(), &bytes));
    test::ok(set(b.body, "rotation", 2));
    EXPECT_TRUE(std::isnan(test::measure(b.body).elastic));
    test::ok(dfm_world_restore(b.world, before.data(), bytes));
    EXPECT_FALSE(std::isnan(test::measure(b.body).elastic)) << "with the parameters of the snapshot";
  }
}

TEST(Caps, WithoutStiffness_NoImplicitStepIsTaken) {
  const Body named("caps", "kind", 2, DFM_INTEGRATOR_IMPLICIT_EULER);
  EXPECT_EQ(named.made, DFM_E_UNSUPPORTED);
  // the library may choose, and implicit steps would cost a hundredth
  Body chosen("caps", "kind", 2, DFM_INTEGRATOR_AUTO, 10.0),
      other("caps", "kind", 1, DFM_INTEGRATOR_AUTO, 10.0);
  EXPECT_NE(explained(chosen.world).find("\"used\":\"symplectic_euler\""), std::string::npos);
  EXPECT_NE(explained(chosen.world).find("gives no stiffness"), std::string::npos);
  EXPECT_NE(explained(other.world).find("\"used\":\"tr_bdf2\""), std::string::npos) << explained(other.world);
  EXPECT_EQ(explained(other.world).find("plausible"), std::string::npos) << "its type does not claim it";
}

TEST(Caps, ThatTheIntegratorIsMadeFor_StayWithTheBody) {
  Body constant("caps", "kind", 0, DFM_INTEGRATOR_IMPLICIT_EULER),
      variable("caps", "kind", 1, DFM_INTEGRATOR_IMPLICIT_EULER),
      free("caps", "kind", 0, DFM_INTEGRATOR_SYMPLECTIC_EULER);
  for (const double kind : {1.0, 2.0, 3.0}) EXPECT_NE(set(constant.body, "kind", kind), DFM_OK) << kind;
  EXPECT_EQ(set(constant.body, "kind", 2), DFM_E_UNSUPPORTED);
  test::says({"test.caps", "stiffness", "dfm_body_set_model"});
  EXPECT_EQ(set(variable.body, "kind", 2), DFM_E_UNSUPPORTED);
  EXPECT_EQ(set(variable.body, "kind", 0), DFM_OK) << "more than it is made for";
  EXPECT_EQ(set(free.body, "kind", 2), DFM_OK) << "explicit steps need none";
  EXPECT_EQ(set(free.body, "kind", 3), DFM_E_ARG) << "it fails, and nothing has changed";
  for (const Body *b : {&constant, &variable, &free}) test::run(b->world, 0.02, 1e-3);
}

}  // namespace
