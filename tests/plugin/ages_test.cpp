// A plugin and a host of different ages: models whose structs are shorter or longer than those of this
// library (garbage behind the end must not be read), a struct of the host that is longer than the plugin
// knows, and one that is shorter than it would like. Laws of other ages are in registry_test.
#define DFM_STATIC_PLUGIN ages
#include <cmath>
#include <cstddef>
#include <cstring>

#include "world.h"

namespace {

// ---- one model, told in three ages ------------------------------------------------------------------------
// Each point hangs on its place at rest by a spring; its state counts the calls.

struct Springs {
  uint32_t npoint, nsurfel;
  std::vector<double> rest;
};

// What a later ABI 1 may append to dfm_kin.
struct LaterKin {
  dfm_kin known;
  const uint8_t *held;
};
uint32_t reported_of_held = 0, not_reported = 0;

bool is_held(const dfm_kin *k, uint32_t point) {
  if (k->size < offsetof(LaterKin, held) + sizeof(const uint8_t *)) {
    ++not_reported;
    return false;
  }
  ++reported_of_held;
  return reinterpret_cast<const LaterKin *>(k)->held[point];
}

dfm_status create(const dfm_host *, const dfm_mesh *m, void **self) {
  *self = new Springs{m->npoint, m->nsurfel, std::vector<double>(m->rest, m->rest + 3 * size_t(m->npoint))};
  return DFM_OK;
}
void destroy(void *self) { delete static_cast<Springs *>(self); }

constexpr double kStiffness = 40;

dfm_status add_forces(void *self, const dfm_kin *k, double *f) {
  const Springs &s = *static_cast<Springs *>(self);
  for (uint32_t i = 0; i < s.npoint; ++i)
    for (size_t c = 0; c < 3; ++c) {
      const size_t at = size_t(i) * k->stride + c;
      f[at] -= kStiffness * (k->x[at] - s.rest[3 * size_t(i) + c]);
    }
  if (!k->state_out) return DFM_OK;
  // [npoint] and one of the instance
  for (size_t i = 0; i <= s.npoint; ++i) k->state_out[i] = k->state[i] + 1;
  return DFM_OK;
}
dfm_status add_forces_unless_held(void *self, const dfm_kin *k, double *f) {
  const Springs &s = *static_cast<Springs *>(self);
  std::vector<double> before(f, f + size_t(k->stride) * s.npoint);
  const dfm_status status = add_forces(self, k, f);
  for (uint32_t i = 0; i < s.npoint; ++i)
    if (is_held(k, i)) std::memcpy(f + i * k->stride, &before[i * k->stride], 3 * sizeof(double));
  return status;
}
dfm_status bound(void *self, const dfm_kin *, double *ksum, double *, double *) {
  for (uint32_t i = 0; i < static_cast<Springs *>(self)->npoint; ++i) ksum[i] += kStiffness;
  return DFM_OK;
}

const dfm_slot slots[] = {{DFM_PER_POINT, 1, DFM_SLOT_SCALAR, 0}, {DFM_PER_INSTANCE, 1, DFM_SLOT_SCALAR, 0}};

struct OldModel {
  uint32_t size, caps, cells, nslot;
  const dfm_slot *slots;
  decltype(dfm_model::create) create;
  decltype(dfm_model::destroy) destroy;
  decltype(dfm_model::set_params) set_params;
  decltype(dfm_model::state_init) state_init;
  decltype(dfm_model::add_forces) add_forces;
  decltype(dfm_model::bound) bound;
};
const struct {
  OldModel model;
  uint64_t beyond[8];
} old_model = {{sizeof(OldModel), DFM_CAP_ENERGY, DFM_CELL_TET, 2, slots, create, destroy, nullptr, nullptr,
                add_forces, bound},
               {0xbad, 0xbad, 0xbad, 0xbad, 0xbad, 0xbad, 0xbad, 0xbad}};

const dfm_model present_model = {sizeof(dfm_model), 0,       DFM_CELL_TET, 2,       slots, create,
                                 destroy,           nullptr, nullptr,      nullptr, bound, nullptr,
                                 nullptr,           nullptr, nullptr,      0,       0};

struct LaterSlot {
  dfm_slot known;
  uint64_t added[2];
};
const LaterSlot later_slots[] = {{slots[0], {7, 7}}, {slots[1], {7, 7}}};
struct LaterModel {
  dfm_model known;
  void *added[4];
};
struct LaterEffects {
  dfm_effects known;
  void *added[2];
};
const char *const all_effects[] = {"damping", nullptr};
const char *const *active(const void *) { return all_effects; }
const LaterEffects later_effects = {{sizeof(LaterEffects), 0, active}, {nullptr, nullptr}};
struct LaterFact {
  dfm_fact known;
  double added[2];
};
const LaterFact later_facts[] = {{{"first", "the first", "1", 1}, {7, 7}},
                                 {{"second", "the second", "m", 2}, {7, 7}}};
const dfm_fact *list_facts(const void *, uint32_t *n) {
  *n = 2;
  return &later_facts[0].known;
}
const dfm_facts later_fact_table = {sizeof(dfm_facts), sizeof(LaterFact), list_facts};
const void *later_extension(const void *, const char *id) {
  if (!std::strcmp(id, DFM_EXT_FACTS)) return &later_fact_table;
  return std::strcmp(id, DFM_EXT_EFFECTS) ? nullptr : &later_effects;
}

// ---- a stepper without what came after commit; it translates, and its mass is 1 kg -----------------------

struct OldStepper {
  uint32_t size, reserved;
  decltype(dfm_stepper::predict) predict;
  decltype(dfm_stepper::respond) respond;
  decltype(dfm_stepper::diagonal) diagonal;
  decltype(dfm_stepper::commit) commit;
};

double velocity_of_all = 0;  // along z, of a body that only translates

dfm_status predict(void *self, const dfm_kin *k, const double *, double *u) {
  const Springs &s = *static_cast<Springs *>(self);
  velocity_of_all = k->v[2] - k->dt * 9.81;
  for (uint32_t i = 0; i < 3 * s.nsurfel; ++i) u[i] = i % 3 == 2 ? velocity_of_all : 0;
  return DFM_OK;
}
uint32_t responded = 0;
dfm_status respond(void *, const dfm_kin *, uint32_t n, const uint32_t *, const double *p, double *du) {
  double sum[3] = {};
  ++responded;
  for (uint32_t i = 0; i < 3 * n; ++i) sum[i % 3] += p[i];
  for (uint32_t i = 0; i < 3 * n; ++i) du[i] = sum[i % 3];
  return DFM_OK;
}
dfm_status commit(void *self, const dfm_kin *k, const double *p, double *x, double *v) {
  const Springs &s = *static_cast<Springs *>(self);
  double u[3] = {0, 0, velocity_of_all};
  for (uint32_t i = 0; i < 3 * s.nsurfel; ++i) u[i % 3] += p[i];
  for (size_t i = 0; i < s.npoint; ++i)
    for (size_t c = 0; c < k->stride; ++c) {
      v[i * k->stride + c] = c < 3 ? u[c] : 0;
      x[i * k->stride + c] = c < 3 ? k->x[i * k->stride + c] + k->dt * u[c] : 0;
    }
  return DFM_OK;
}
const struct {
  OldStepper table;
  uint64_t beyond[4];
} old_stepper = {{sizeof(OldStepper), 0, predict, respond, nullptr, commit}, {0xbad, 0xbad, 0xbad, 0xbad}};
const void *old_stepper_extension(const void *, const char *id) {
  return std::strcmp(id, "dfm.stepper/1") ? nullptr : &old_stepper;
}
const void *short_table(const void *, const char *id) {
  static const dfm_effects none = {4, 0, nullptr};
  return std::strcmp(id, DFM_EXT_EFFECTS) ? nullptr : &none;
}

dfm_model with_extension(const void *(*extension)(const void *, const char *)) {
  dfm_model m = present_model;
  m.nslot = 0;
  m.add_forces = nullptr;
  m.extension = extension;
  return m;
}

const void *ops_of(size_t n) {
  static dfm_model present = present_model, stepper = with_extension(old_stepper_extension),
                   spoilt = with_extension(short_table);
  static LaterModel later = {present_model, {}};
  present.add_forces = add_forces;
  spoilt.add_forces = add_forces;
  later.known.size = sizeof later;
  later.known.add_forces = add_forces_unless_held;
  later.known.slots = &later_slots[0].known;
  later.known.slot_size = sizeof(LaterSlot);
  later.known.extension = later_extension;
  const void *const all[] = {&old_model, &present, &later, &stepper, &spoilt};
  return all[n];
}

}  // namespace

extern "C" const dfm_plugin *dfm_plugin_entry_ages(const dfm_host *host, uint32_t, uint32_t) {
  if (!DFM_ABI_OK(host)) return nullptr;
  static const char *const ids[] = {"test.old", "test.present", "test.later", "test.stepper", "test.spoilt"};
  static dfm_type all[5];
  static const dfm_type *list[5];
  for (size_t n = 0; n < 5; ++n) {
    all[n] = {sizeof(dfm_type),
              DFM_KIND_MODEL,
              ids[n],
              "springs to the place at rest",
              "1",
              "MIT",
              "Hooke 1678",
              nullptr,
              0,
              sizeof(dfm_param),
              all_effects,
              ops_of(n)};
    list[n] = &all[n];
  }
  static const dfm_plugin plugin = {sizeof(dfm_plugin), DFM_ABI, DFM_ABI_DRAFT, 5, list, nullptr};
  return &plugin;
}

namespace {

struct World {
  test::Context context;
  dfm_world world = 0;
  dfm_body body = 0;
  explicit World(const char *model) {
    test::ok(dfm_plugin_register_static(context, dfm_plugin_entry_ages, "ages"));
    world = test::make_world(context);
    test::BodyOptions o;
    o.model = model;
    body = test::make_body(context, world, "beam", {0.1, 0.1, 0.1}, 60, o);
  }
  std::vector<double> after(double seconds) {
    test::run(world, seconds, 1e-3);
    auto [x, v] = test::State(body);
    x.insert(x.end(), v.begin(), v.end());
    return x;
  }
};

TEST(Ages, ShorterAndLongerModels_MoveLikeThatOfThisHeader) {
  World present("present"), old("old"), later("later");
  const std::vector<double> moved = present.after(0.05);
  EXPECT_EQ(old.after(0.05), moved);
  reported_of_held = not_reported = 0;
  EXPECT_EQ(later.after(0.05), moved) << "this host's dfm_kin ends before held";
  EXPECT_EQ(reported_of_held, 0u);
  EXPECT_GT(not_reported, 0u);
  EXPECT_TRUE(std::isnan(test::measure(old.body).elastic)) << "it claims an energy and ends before it";
  size_t bytes = 0;
  test::ok(dfm_world_explain(later.world, nullptr, &bytes));
  std::string text(bytes, ' ');
  test::ok(dfm_world_explain(later.world, text.data(), &bytes));
  EXPECT_NE(text.find("\"second\""), std::string::npos) << text << ": rows of facts that are longer";
}

TEST(Ages, StepperThatEndsWithCommit_RespondsOneByOne) {
  World w("stepper");
  test::add_plane(w.world, "floor", {0, 0, -0.01});
  test::set_friction(w.world, 0.5);
  responded = 0;
  test::run(w.world, 0.1, 1e-3);
  EXPECT_GT(responded, 0u);
}

TEST(Ages, TableShorterThanItEverWas_IsRefusedWithItsName) {
  test::Context context;
  test::ok(dfm_plugin_register_static(context, dfm_plugin_entry_ages, "ages"));
  const dfm_world world = test::make_world(context);
  const double point[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
  const uint32_t cell[] = {0, 1, 2, 3};
  dfm_body_def d = dfm_body_def_default();
  d.model = "spoilt";
  d.npoint = 4;
  d.ntet = 1;
  d.points = point;
  d.tets = cell;
  dfm_body body = 0;
  EXPECT_EQ(dfm_body_create(world, &d, &body), DFM_E_UNSUPPORTED);
  test::says({"test.spoilt", "dfm_effects.size is 4, at least 16 expected"});
}

// A host of later age, played by the test: its dfm_kin and dfm_mesh go on behind what this plugin knows, and
// dfm_kin brings what the later plugin asks for.
TEST(Ages, LongerStructsOfTheHost_ChangeNothingForThePluginThatDoesNotKnowThem) {
  const double rest[] = {0, 0, 0, 1, 0, 0}, x[] = {0.5, 0, 0, 0, 2, 0, 0, 0};
  struct {
    dfm_mesh known;
    uint64_t beyond[4];
  } mesh = {{}, {0xbad, 0xbad, 0xbad, 0xbad}};
  mesh.known.size = sizeof mesh;
  mesh.known.npoint = 2;
  mesh.known.rest = rest;
  const uint8_t held[] = {0, 7};
  struct {
    LaterKin kin;
    uint64_t beyond[4];
  } k = {{{}, held}, {0xbad, 0xbad, 0xbad, 0xbad}};
  k.kin.known.size = sizeof k;
  k.kin.known.stride = 4;
  k.kin.known.x = k.kin.known.v = x;
  void *self = nullptr;
  ASSERT_EQ(create(nullptr, &mesh.known, &self), DFM_OK);
  double f[8] = {}, g[8] = {};
  reported_of_held = not_reported = 0;
  EXPECT_EQ(static_cast<const dfm_model *>(ops_of(1))->add_forces(self, &k.kin.known, f), DFM_OK);
  EXPECT_EQ(static_cast<const dfm_model *>(ops_of(2))->add_forces(self, &k.kin.known, g), DFM_OK);
  EXPECT_EQ(f[0], -0.5 * kStiffness);
  EXPECT_EQ(f[4], -1 * kStiffness);
  EXPECT_EQ(g[0], f[0]);
  EXPECT_EQ(g[4], 0) << "held, as this host says";
  EXPECT_EQ(reported_of_held, 2u);
  EXPECT_EQ(not_reported, 0u);
  destroy(self);
}

}  // namespace
