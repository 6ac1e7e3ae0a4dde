// Energy that contact makes: laws and models of plugins that are wrong in ways that a look at one body, or at
// one call of the plugin, does not see. The run ends with a sentence that names who did it, long before a
// value stops being finite.
#define DFM_STATIC_PLUGIN wrong_energy
#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>
#include <vector>

#include "deform/plugin.hpp"
#include "stack.h"

namespace {

// ---- a friction law

enum LawWay { kRight, kDrives, kViscous, kTurned, kBelt, kStretches, kLawWays };
const char *const kLawNames[] = {"right",
                                 "force along the slip",
                                 "viscosity below zero",
                                 "force turned by 120 degrees",
                                 "force along an axis",
                                 "bristle that gives back more than it took"};

struct Pair { double x, y; };
// The force at a slip and a normal force; z: the bristle at the end, which may be changed.
Pair force_of(int way, Pair v, double normal, Pair &z) {
  const double most = 0.3 * normal, c = most / (std::hypot(v.x, v.y) + 1e-3);
  if (way == kDrives) return {c * v.x, c * v.y};
  if (way == kViscous) return {2 * v.x, 2 * v.y};
  if (way == kTurned) {
    const double a = std::cos(2.1), b = std::sin(2.1);
    return {-c * (a * v.x - b * v.y), -c * (b * v.x + a * v.y)};
  }
  if (way == kBelt) return {most, 0};
  if (way == kStretches) {
    const double k = 2000, r = k * std::hypot(z.x, z.y), share = r > most ? most / r : 1;
    const Pair f{-k * share * z.x, -k * share * z.y};
    const double grow = r > most ? share : 1.05;
    z = {grow * z.x, grow * z.y};
    return f;
  }
  return {-c * v.x, -c * v.y};
}

dfm_status law_eval(const dfm_friction_in *in, dfm_friction_out *out) {
  const int way = int(in->params[0]);
  const uint32_t s = in->stride;
  for (uint32_t i = 0; i < in->n; ++i) {
    const Pair v{in->vt[i], in->vt[s + i]};
    Pair z{in->state[i] + in->dt * v.x, in->state[s + i] + in->dt * v.y};
    const Pair f = force_of(way, v, in->fn[i], z);
    if (out->ft) {
      out->ft[i] = f.x;
      out->ft[s + i] = f.y;
    }
    if (out->state) {
      out->state[i] = z.x;
      out->state[s + i] = z.y;
    }
    const double slope = way == kRight ? -0.3 * in->fn[i] / (std::hypot(v.x, v.y) + 1e-3) : 0;
    for (uint32_t k = 0; k < 4 && out->dft_dvt; ++k) out->dft_dvt[k * s + i] = k == 0 || k == 3 ? slope : 0;
    for (uint32_t k = 0; k < 2 && out->dft_dfn; ++k) out->dft_dfn[k * s + i] = 0;
    if (out->limit) out->limit[i] = INFINITY;
    if (out->mode) out->mode[i] = 2;
    if (out->stored) out->stored[i] = 0;
  }
  return DFM_OK;
}

// ---- models: one that steps itself, and one whose points the library moves

enum ModelWay {
  kFine,
  kTwice,      // the end has twice the response that was told
  kSkew,       // the response is not symmetric
  kBackwards,  // impulses at one point push its neighbors the other way
  kSteppers,
  kCurl = kSteppers,  // forces that are no gradient
  kDriven,            // damping of the wrong sign
  kPropelled,         // forces that do not sum to zero
  kStiffer,           // forces twice those of the energy
  kModelWays
};
const char *const kModelNames[] = {"fine",
                                   "twice the response",
                                   "response not symmetric",
                                   "response backwards",
                                   "stiffness not symmetric",
                                   "damping below zero",
                                   "propels itself",
                                   "forces are not those of the energy"};

// Points on springs to where they began.
struct Points {
  std::vector<double> mass, rest, v;
  int way = 0;
};
constexpr double kFrequency = 60;  // rad/s
Points &points(void *self) { return *static_cast<Points *>(self); }
dfm_status make(const dfm_host *, const dfm_mesh *m, void **self) {
  auto *const p = new Points;
  p->mass.assign(m->mass, m->mass + m->npoint);
  p->rest.assign(m->rest, m->rest + 3 * size_t(m->npoint));
  p->v.resize(3 * size_t(m->npoint));
  p->way = int(m->params[0]);
  *self = p;
  return DFM_OK;
}
void destroy(void *self) { delete &points(self); }
// Springs between all points and their mean: rest lies where the mean is.
std::array<double, 3> mean_of(const Points &p, const double *x, size_t stride) {
  std::array<double, 3> out{};
  double all = 0;
  for (size_t i = 0; i < p.mass.size(); ++i) {
    all += p.mass[i];
    for (size_t c = 0; c < 3; ++c) out[c] += p.mass[i] * x[i * stride + c];
  }
  for (double &c : out) c /= all;
  return out;
}
std::vector<double> apart(const Points &p, const dfm_kin *k) {
  const auto now = mean_of(p, k->x, k->stride), then = mean_of(p, p.rest.data(), 3);
  std::vector<double> d(p.v.size());
  for (size_t i = 0; i < p.mass.size(); ++i)
    for (size_t c = 0; c < 3; ++c)
      d[3 * i + c] = k->x[i * k->stride + c] - now[c] - (p.rest[3 * i + c] - then[c]);
  return d;
}
dfm_status energy(void *self, const dfm_kin *k, double *joule) {
  const Points &p = points(self);
  const std::vector<double> d = apart(p, k);
  *joule = 0;
  for (size_t j = 0; j < d.size(); ++j) *joule += 0.5 * p.mass[j / 3] * kFrequency * kFrequency * d[j] * d[j];
  return DFM_OK;
}
dfm_status add_forces(void *self, const dfm_kin *k, double *f) {
  const Points &p = points(self);
  const std::vector<double> d = apart(p, k);
  const auto mean = mean_of(p, k->v, k->stride);
  for (size_t i = 0; i < p.mass.size(); ++i) {
    const double s = p.mass[i] * kFrequency * kFrequency * (p.way == kStiffer ? 2 : 1);
    double *const to = f + i * k->stride;
    for (size_t c = 0; c < 3; ++c) {
      to[c] -= s * d[3 * i + c];
      const double damper = p.way == kDriven ? 3 : -3;
      to[c] += damper * p.mass[i] * (k->v[i * k->stride + c] - mean[c]);
    }
    if (p.way == kCurl) {
      to[0] += 0.3 * s * d[3 * i + 1];
      to[1] -= 0.3 * s * d[3 * i];
    }
    if (p.way == kPropelled) to[0] += 3 * p.mass[i];
  }
  return DFM_OK;
}
dfm_status bound(void *self, const dfm_kin *, double *ksum, double *csum, double *) {
  const Points &p = points(self);
  for (size_t i = 0; i < p.mass.size(); ++i) {
    ksum[i] += 3 * p.mass[i] * kFrequency * kFrequency;
    csum[i] += 3 * p.mass[i];
  }
  return DFM_OK;
}
dfm_status predict(void *self, const dfm_kin *k, const double *f, double *u) {
  Points &p = points(self);
  const std::vector<double> d = apart(p, k);
  for (size_t i = 0; i < p.mass.size(); ++i)
    for (size_t c = 0; c < 3; ++c)
      u[3 * i + c] = p.v[3 * i + c] =
          k->v[i * k->stride + c] +
          k->dt * (f[i * k->stride + c] / p.mass[i] - kFrequency * kFrequency * d[3 * i + c]);
  return DFM_OK;
}
dfm_status respond(void *self, const dfm_kin *, uint32_t n, const uint32_t *surfel, const double *push,
                   double *du) {
  const Points &p = points(self);
  for (uint32_t s = 0; s < n; ++s)
    for (size_t c = 0; c < 3; ++c) {
      double &to = du[3 * s + c] = push[3 * s + c] / p.mass[surfel[s]];
      const size_t other = 3 * ((s + 1) % n) + c;
      if (n > 1 && p.way == kSkew && s == 0) to += 0.9 * push[other] / p.mass[surfel[s]];
      if (n > 1 && p.way == kBackwards) to -= 0.9 * push[other] / p.mass[surfel[s]];
    }
  return DFM_OK;
}
dfm_status commit(void *self, const dfm_kin *k, const double *push, double *x, double *v) {
  const Points &p = points(self);
  const double times = p.way == kTwice ? 2.2 : 1;
  for (size_t i = 0; i < p.mass.size(); ++i)
    for (size_t c = 0; c < k->stride; ++c) {
      const size_t at = i * k->stride + c;
      v[at] = c < 3 ? p.v[3 * i + c] + times * push[3 * i + c] / p.mass[i] : 0;
      x[at] = k->x[at] + k->dt * v[at];
    }
  return DFM_OK;
}
const dfm_stepper kSteps{sizeof(dfm_stepper), 0, predict, respond, nullptr, commit, nullptr, nullptr};
const void *extension(const void *, const char *id) {
  return std::strcmp(id, "dfm.stepper/1") ? nullptr : &kSteps;
}

const char *const kLaw = "test.wrong_law", *const kPointsModel = "test.wrong_points",
                  *const kStepsModel = "test.wrong_steps";

}  // namespace

extern "C" const dfm_plugin *dfm_plugin_entry_wrong_energy(const dfm_host *host, uint32_t, uint32_t) {
  if (!DFM_ABI_OK(host)) return nullptr;
  static const char *const effects[] = {nullptr};
  static const dfm_param rows[] = {{"way", "how it is wrong", "1", 0, 100, 0, 0, 1, nullptr}};
  static const dfm_slot slot{DFM_PER_CONTACT, 2, DFM_SLOT_TANGENT, 0};
  static dfm_friction law{};
  law.size = sizeof law;
  law.needs = DFM_NEED_FN | DFM_NEED_VT;
  law.flags = DFM_FRIC_ISOTROPIC | DFM_FRIC_PASSIVE | DFM_FRIC_JACOBIAN;
  law.nslot = 1;
  law.slots = &slot;
  law.eval = law_eval;
  static dfm_model ops{};
  ops.size = sizeof ops;
  ops.caps = DFM_CAP_ENERGY;
  ops.cells = DFM_CELL_TET;
  ops.create = make;
  ops.destroy = destroy;
  ops.energy = energy;
  static dfm_model steps = ops;
  steps.extension = extension;
  ops.add_forces = add_forces;
  ops.bound = bound;
  using dfm::plugin::type;
  static const dfm_type types[] = {
      type(DFM_KIND_FRICTION, kLaw, "law", "1", "MIT", "test", rows, effects, &law),
      type(DFM_KIND_MODEL, kPointsModel, "points", "1", "MIT", "test", rows, effects, &ops),
      type(DFM_KIND_MODEL, kStepsModel, "steps", "1", "MIT", "test", rows, effects, &steps)};
  static const dfm_type *const list[] = {&types[0], &types[1], &types[2]};
  static const dfm_plugin plugin{sizeof(dfm_plugin), DFM_ABI, DFM_ABI_DRAFT, 3, list, nullptr};
  return &plugin;
}

namespace {

struct Bench {
  test::Context context;
  dfm_world world = 0;
  uint32_t trouble = 0;
  Bench() { test::ok(dfm_plugin_register_static(context, dfm_plugin_entry_wrong_energy, "wrong_energy")); }
  dfm_status run(int steps, double dt = 1e-3) {
    dfm_status status = DFM_OK;
    for (int i = 0; i < steps && status == DFM_OK; ++i) status = dfm_world_step(world, dt, &trouble);
    return status;
  }
};

void set_law(dfm_world w, int way) { test::ok(test::add_friction(w, kLaw, {{"way", way}})); }

constexpr int32_t kIntegrators[] = {DFM_INTEGRATOR_SYMPLECTIC_EULER, DFM_INTEGRATOR_IMPLICIT_EULER};

struct Sliding : Bench {
  explicit Sliding(int way, int32_t integrator = DFM_INTEGRATOR_AUTO) {
    const test::Stack s = test::make_stack(context, 1e-4, 0.5, integrator);
    world = s.world;
    set_law(world, way);
    // a bristle that slides takes more than it can give back
    const double share = way == kStretches ? 0.01 : 1;
    test::set_velocity(s.upper, {0.3 * share, 0.1 * share, 0});
  }
};

// Two tetrahedra on a floor, one above the other.
struct Falling : Bench {
  Falling(const char *model, int way) {
    world = test::make_world(context, {0, 0, -9.81});
    test::set_friction(world, 0.3);
    test::add_plane(world, "floor");
    const double value = way;
    const dfm_param_value params{"way", &value, 1};
    for (int i = 0; i < 2; ++i) {
      test::Tet t(i ? "upper" : "lower");
      t.def.model = model;
      t.def.model_params = {sizeof(dfm_params), 1, &params};
      t.def.pose.position[2] = 0.01 + 0.12 * i;
      dfm_body body = 0;
      test::ok(dfm_body_create(world, &t.def, &body));
    }
  }
};

}  // namespace

TEST(EnergyPair, LawThatDrives_IsStoppedAndNamed) {
  for (int way = kRight + 1; way < kLawWays; ++way)
    for (const int32_t integrator : kIntegrators) {
      // its bristle is too slow for backward Euler, which takes what it gives
      if (way == kStretches && integrator != kIntegrators[0]) continue;
      SCOPED_TRACE(std::string(kLawNames[way]) +
                   (integrator == kIntegrators[0] ? ", explicit" : ", implicit"));
      Sliding b(way, integrator);
      ASSERT_EQ(b.run(8000, 2.5e-4), DFM_E_DIVERGED);
      EXPECT_TRUE(b.trouble & DFM_TROUBLE_ENERGY);
      test::says(
          {"friction law 'test.wrong_law' has put in", "than it has taken", "the largest energy so far"});
      EXPECT_LT(dfm_world_time(b.world), 0.1);
      EXPECT_LT(test::stats(b.world).energy_max, 0.1) << "it is seen before anything has grown";
    }
}

TEST(EnergyPair, LawThatIsRepairedAfterAStop_Continues) {
  Sliding b(kDrives);
  ASSERT_EQ(b.run(2000), DFM_E_DIVERGED);
  ASSERT_EQ(b.run(1), DFM_E_DIVERGED) << "nothing has changed";
  set_law(b.world, kRight);
  EXPECT_EQ(b.run(300), DFM_OK) << dfm_last_error();
}

// A restored world stops where the one that was saved does.
TEST(EnergyPair, Snapshot_HasTheSums) {
  Sliding b(kViscous);
  test::ok(b.run(5));
  const std::string saved = test::snapshot(b.world);
  ASSERT_EQ(b.run(2000), DFM_E_DIVERGED);
  const double end = dfm_world_time(b.world);
  test::ok(dfm_world_restore(b.world, saved.data(), saved.size()));
  ASSERT_EQ(b.run(2000), DFM_E_DIVERGED);
  EXPECT_EQ(dfm_world_time(b.world), end);
}

TEST(EnergyPair, ModelWithAWrongResponse_IsStoppedAndNamed) {
  for (const int way : {kTwice, kBackwards}) {
    SCOPED_TRACE(kModelNames[way]);
    Falling b(kStepsModel, way);
    ASSERT_EQ(b.run(5000), DFM_E_DIVERGED);
    EXPECT_TRUE(b.trouble & DFM_TROUBLE_ENERGY);
    test::says({"'lower'", "model 'test.wrong_steps'", "than it has taken"});
    EXPECT_LT(test::stats(b.world).energy_max, 1);
  }
}

TEST(EnergyPair, ModelWhoseForcesAreWrong_IsStoppedAndNamed) {
  for (int way = kSteppers; way < kModelWays; ++way) {
    SCOPED_TRACE(kModelNames[way]);
    Falling b(kPointsModel, way);
    ASSERT_EQ(b.run(5000), DFM_E_DIVERGED);
    EXPECT_TRUE(b.trouble & DFM_TROUBLE_ENERGY);
    test::says({"of model 'test.wrong_points': its energy has grown by"});
    EXPECT_LT(test::stats(b.world).energy_max, 1);
  }
}

TEST(EnergyPair, LawsAndModelsThatAreRight_Continue) {
  for (const int32_t integrator : kIntegrators) {
    Sliding b(kRight, integrator);
    EXPECT_EQ(b.run(1000), DFM_OK) << dfm_last_error();
  }
  for (const char *model : {kPointsModel, kStepsModel}) {
    Falling b(model, kFine);
    EXPECT_EQ(b.run(3000), DFM_OK) << dfm_last_error();
  }
  // not symmetric, but the body comes to rest: nothing is made
  Falling b(kStepsModel, kSkew);
  EXPECT_EQ(b.run(3000), DFM_OK) << dfm_last_error();
}

// A probe that is pressed into a block and stops within a sub-step: the surface follows it at the old
// velocity for that sub-step, which is no work of the contact. 4 mm in 0.05 s, in 41 steps.
TEST(EnergyPair, ProbeThatStops_DoesNoWork) {
  test::Context context;
  dfm_world_def wd = dfm_world_def_default();
  wd.integrator = DFM_INTEGRATOR_SYMPLECTIC_EULER;
  dfm_world world = 0;
  test::ok(dfm_world_create(context, &wd, &world));
  dfm_mesh_handle mesh = 0;
  const double size[3] = {0.2, 0.2, 0.1};
  test::ok(dfm_mesh_make(context, "beam", size, DFM_MESH_CELLS, 400, &mesh));
  dfm_mesh_info info = {};
  info.size = sizeof info;
  test::ok(dfm_mesh_get_info(mesh, &info));
  dfm_material_def material = dfm_material_def_default();
  material.young = 1e5;
  material.poisson = 0.3;
  material.damping_stiffness = 1e-3;
  dfm_body_def body = dfm_body_def_default();
  test::ok(dfm_material_create(world, &material, &body.material));
  body.points = info.points;
  body.tets = info.tets;
  body.npoint = info.npoint;
  body.ntet = info.ntet;
  std::vector<uint8_t> fixed(info.npoint, 0);
  for (uint32_t i = 0; i < info.npoint; ++i)
    if (body.points[3 * size_t(i) + 2] < 1e-9) fixed[i] = 7;
  body.fixed = fixed.data();
  dfm_body block = 0;
  test::ok(dfm_body_create(world, &body, &block));
  dfm_obstacle_def sphere = dfm_obstacle_def_default();
  sphere.shape = DFM_SHAPE_SPHERE;
  sphere.radius = 0.05;
  sphere.pose.position[0] = sphere.pose.position[1] = 0.1;
  sphere.pose.position[2] = 0.15 + 1e-5;
  dfm_obstacle probe = 0;
  test::ok(dfm_obstacle_create(world, &sphere, &probe));
  const double h = 0.0012207;
  for (int i = 1; i <= 200; ++i) {
    dfm_pose pose = sphere.pose;
    pose.position[2] = 0.15 - 0.004 * std::min(1.0, i * h / 0.05);
    test::ok(dfm_obstacle_move_to(probe, &pose));
    ASSERT_EQ(dfm_world_step(world, h, nullptr), DFM_OK) << i << ": " << dfm_last_error();
  }
  test::ok(dfm_mesh_destroy(mesh));
}
