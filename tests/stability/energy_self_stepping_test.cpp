// The energy watch on bodies whose model steps itself: what it gains out of nothing is seen, with an elastic
// energy that it gives and without one; what falls, slides, is thrown and is let go of gains nothing.
#define DFM_STATIC_PLUGIN pumping_steppers
#include <cstring>
#include <filesystem>
#include <vector>

#include "support.h"
#include "world.h"

namespace {

// Points on springs to where they began: v' = grows (v + h (f - k (x - rest)) / m), x' = x + h v'.
constexpr double kFrequency = 20;  // rad/s
struct Points {
  std::vector<double> mass, rest, v;
  std::vector<uint32_t> row, col;
  std::vector<double> weight;
  double grows = 1;
};
Points &points(void *self) { return *static_cast<Points *>(self); }
dfm_status make(const dfm_host *, const dfm_mesh *m, void **self) {
  auto *const p = new Points;
  p->mass.assign(m->mass, m->mass + m->npoint);
  p->rest.assign(m->rest, m->rest + 3 * size_t(m->npoint));
  p->v.resize(3 * size_t(m->npoint));
  if (m->nsurfel) {
    p->row.assign(m->row, m->row + m->nsurfel + 1);
    p->col.assign(m->col, m->col + p->row.back());
    p->weight.assign(m->weight, m->weight + p->row.back());
  }
  p->grows = m->params[0];
  *self = p;
  return DFM_OK;
}
void destroy(void *self) { delete &points(self); }
dfm_status energy(void *self, const dfm_kin *k, double *joule) {
  const Points &p = points(self);
  *joule = 0;
  for (size_t i = 0; i < p.mass.size(); ++i)
    for (size_t c = 0; c < 3; ++c) {
      const double d = k->x[i * k->stride + c] - p.rest[3 * i + c];
      *joule += 0.5 * p.mass[i] * kFrequency * kFrequency * d * d;
    }
  std::memset(points(self).v.data(), 0xff, p.v.size() * sizeof(double));  // its memory may be shared
  return DFM_OK;
}
dfm_status predict(void *self, const dfm_kin *k, const double *f, double *u) {
  Points &p = points(self);
  for (size_t i = 0; i < p.mass.size(); ++i)
    for (size_t c = 0; c < 3; ++c) {
      const size_t at = i * k->stride + c;
      const double spring = kFrequency * kFrequency * (k->x[at] - p.rest[3 * i + c]);
      p.v[3 * i + c] = p.grows * (k->v[at] + k->dt * (f[at] / p.mass[i] - spring));
    }
  for (size_t s = 0; s + 1 < p.row.size(); ++s)
    for (size_t c = 0; c < 3; ++c) {
      u[3 * s + c] = 0;
      for (uint32_t e = p.row[s]; e < p.row[s + 1]; ++e)
        u[3 * s + c] += p.weight[e] * p.v[3 * size_t(p.col[e]) + c];
    }
  return DFM_OK;
}
dfm_status respond(void *self, const dfm_kin *, uint32_t n, const uint32_t *surfel, const double *push,
                   double *du) {
  const Points &p = points(self);
  std::vector<double> change(p.v.size());
  const auto each = [&](auto &&act) {
    for (uint32_t s = 0; s < n; ++s)
      for (uint32_t e = p.row[surfel[s]]; e < p.row[surfel[s] + 1]; ++e)
        for (size_t c = 0; c < 3; ++c) act(3 * s + c, 3 * size_t(p.col[e]) + c, p.weight[e]);
  };
  each([&](size_t s, size_t at, double weight) { change[at] += weight * push[s] / p.mass[at / 3]; });
  std::fill_n(du, 3 * size_t(n), 0.0);
  each([&](size_t s, size_t at, double weight) { du[s] += weight * change[at]; });
  return DFM_OK;
}
dfm_status commit(void *self, const dfm_kin *k, const double *push, double *x, double *v) {
  const Points &p = points(self);
  for (size_t i = 0; i < p.mass.size() * k->stride; ++i) x[i] = v[i] = 0;
  for (size_t i = 0; i < p.mass.size(); ++i)
    for (size_t c = 0; c < 3; ++c) v[i * k->stride + c] = p.v[3 * i + c];
  for (size_t s = 0; s + 1 < p.row.size(); ++s)
    for (uint32_t e = p.row[s]; e < p.row[s + 1]; ++e)
      for (size_t c = 0; c < 3; ++c)
        v[p.col[e] * k->stride + c] += p.weight[e] * push[3 * s + c] / p.mass[p.col[e]];
  for (size_t j = 0; j < p.mass.size() * k->stride; ++j) x[j] = k->x[j] + k->dt * v[j];
  return DFM_OK;
}
const dfm_stepper kSteps{sizeof(dfm_stepper), 0, predict, respond, nullptr, commit, nullptr, nullptr};
const void *extension(const void *, const char *id) {
  return std::strcmp(id, "dfm.stepper/1") ? nullptr : &kSteps;
}

dfm_model model_of(uint32_t caps) {
  dfm_model ops{};
  ops.size = sizeof ops;
  ops.caps = caps;
  ops.cells = DFM_CELL_TET;
  ops.create = make;
  ops.destroy = destroy;
  ops.energy = caps & DFM_CAP_ENERGY ? energy : nullptr;
  ops.extension = extension;
  return ops;
}
dfm_type type_of(const char *id, const dfm_model &ops) {
  static const char *const effects[] = {nullptr};
  static const dfm_param rows[] = {{"grows", "velocity in a step", "1", 0.5, 2, 1, 0, 1, nullptr}};
  return {sizeof(dfm_type), DFM_KIND_MODEL, id, "points",          "1",     "MIT",
          "test",           rows,           1,  sizeof(dfm_param), effects, &ops};
}

// Its elastic energy is known, or it is not.
const char *const kModels[] = {"test.tells", "test.hides"};

struct Bench {
  test::Context context;
  dfm_world world = 0;
  dfm_body body = 0;
  Bench(const char *model, double grows, bool floor, bool gravity = true) {
    test::ok(dfm_plugin_register_static(context, dfm_plugin_entry_pumping_steppers, "pumping_steppers"));
    world = test::make_world(context, {0, 0, gravity ? -9.81 : 0});
    test::Tet t("stepped");
    t.def.model = model;
    const dfm_param_value value{"grows", &grows, 1};
    t.def.model_params = {sizeof(dfm_params), 1, &value};
    t.def.velocity[0] = 1;
    test::ok(dfm_body_create(world, &t.def, &body));
    if (!floor) return;
    dfm_obstacle_def d = dfm_obstacle_def_default();
    d.pose.position[2] = -0.005;
    dfm_obstacle plane = 0;
    test::ok(dfm_obstacle_create(world, &d, &plane));
  }
  dfm_status run(int steps, uint32_t *trouble = nullptr) {
    dfm_status status = DFM_OK;
    for (int i = 0; i < steps && status == DFM_OK; ++i) status = dfm_world_step(world, 1e-3, trouble);
    return status;
  }
};

}  // namespace

extern "C" const dfm_plugin *dfm_plugin_entry_pumping_steppers(const dfm_host *host, uint32_t, uint32_t) {
  if (!DFM_ABI_OK(host)) return nullptr;
  static const dfm_model reports = model_of(DFM_CAP_ENERGY), hides = model_of(0);
  static const dfm_type first = type_of(kModels[0], reports), second = type_of(kModels[1], hides);
  static const dfm_type *const types[] = {&first, &second};
  static const dfm_plugin plugin{sizeof(dfm_plugin), DFM_ABI, DFM_ABI_DRAFT, 2, types, nullptr};
  return &plugin;
}

TEST(EnergySelfStepping, ModelThatPumps_IsStoppedAndItsBodyNamed) {
  for (const char *model : kModels)
    for (const bool floor : {false, true}) {
      Bench b(model, 1.002, floor);
      uint32_t trouble = 0;
      EXPECT_EQ(b.run(20000, &trouble), DFM_E_DIVERGED) << model << ", floor " << floor;
      EXPECT_TRUE(trouble & DFM_TROUBLE_ENERGY);
      test::says({"'stepped'", "energy has grown by", "largest energy so far"});
      const dfm_world_stats stats = test::stats(b.world);
      EXPECT_LT(stats.energy_max, 4 * (0.5 + 10 * 9.81)) << "it is seen before it has grown far";
    }
}

TEST(EnergySelfStepping, BodyThatSwingsSlidesAndIsPushed_IsNoGain) {
  for (const char *model : kModels)
    for (const bool floor : {false, true}) {
      Bench b(model, 1, floor);
      EXPECT_EQ(b.run(4000), DFM_OK) << model << ", floor " << floor << ": " << dfm_last_error();
    }
}

// A spring is wound up by a load and let go: what moves then was stored before, and the host's change hides
// it from a watch that knows no elastic energy.
TEST(EnergySelfStepping, BodyThatIsLetGo_IsNoGain) {
  for (const char *model : kModels) {
    Bench b(model, 0.98, false, false);
    test::set_velocity(b.body, {0, 0, 0});
    const uint32_t all[] = {0, 1, 2, 3};
    const double pull[3] = {0.4, 0, 0};
    uint32_t load = 0;
    std::vector<double> forces;
    for (int i = 0; i < 4; ++i) forces.insert(forces.end(), pull, pull + 3);
    test::ok(dfm_body_add_load(b.body, 4, all, forces.data(), 0, nullptr, nullptr, &load));
    ASSERT_EQ(b.run(2000), DFM_OK) << dfm_last_error();
    test::ok(dfm_body_remove_load(b.body, load));
    EXPECT_EQ(b.run(2000), DFM_OK) << model << ": " << dfm_last_error();
  }
}

// The library's own models that step themselves, undamped: in a free spin, held and dropped.
TEST(EnergySelfStepping, OwnModelsWithoutDamping_AreWatchedAndGainNothing) {
  const std::string bar = DEFORM_SOURCE_DIR "/examples/data/bar.msh";
  for (const char *model : {"modal", "condensed", "shape_matching"}) {
    const std::string damping = std::strcmp(model, "shape_matching") ? "" : R"("damping_ratio": 0)";
    const std::string out = test::scratch(std::string("energy_self_") + model), scene = out + "/scene.json";
    test::write_file(scene, R"({"format": "deform-scene", "version": 1,
      "time": {"duration": 1, "step": 0.002},
      "materials": {"rubber": {"young": 1e5, "damping": {"mass": 0, "stiffness": 0}}},
      "obstacles": [{"name": "floor", "shape": "plane"}],
      "bodies": [{"name": "spins", "mesh": ")" +
                                bar + R"(", "material": "rubber", "spin": [2, 10, 20],
                  "pose": {"position": [0, 2, 9]}, "model": {"type": ")" +
                                model + R"(", "params": {)" + damping + R"(}}},
                 {"name": "drops", "mesh": ")" +
                                bar + R"(", "material": "rubber",
                  "pose": {"position": [0, 0, 0.2]}, "model": {"type": ")" +
                                model + R"(", "params": {)" + damping + R"(}}}],
      "output": {"every": 0.1}})");
    const test::CommandResult r = test::deform({"run", scene, "--quiet", "--out", out + "/run"});
    EXPECT_EQ(r.exit_code, 0) << model << ": " << r.err;
    const std::string summary = test::read_file(out + "/run/summary.json");
    EXPECT_NE(summary.find("\"unwatched\": {}"), std::string::npos) << model << ": " << summary;
  }
}

// Two plates close on a cube until next to nothing is left between them: they alone give it energy.
TEST(EnergySelfStepping, CubeSqueezedToNothing_GainsNothing) {
  const std::string out = test::scratch("energy_self_squeezed"), scene = out + "/scene.json";
  test::write_file(scene, R"({"format": "deform-scene", "version": 1,
    "time": {"duration": 0.54, "step": 0.001},
    "materials": {"gel": {"young": 1e5, "damping": {"mass": 2}}},
    "bodies": [{"name": "cube", "mesh": {"make": "beam", "size": [0.1, 0.1, 0.1], "cells": 48},
                "material": "gel", "pose": {"position": [-0.05, -0.05, 0.001]},
                "model": {"type": "shape_matching"}}],
    "obstacles": [{"name": "under", "shape": "box", "half_size": [0.3, 0.3, 0.05],
                   "pose": {"position": [0, 0, -0.05]}},
                  {"name": "over", "shape": "box", "half_size": [0.3, 0.3, 0.05],
                   "motion": {"keyframes": [{"t": 0, "position": [0, 0, 0.16]},
                                            {"t": 0.55, "position": [0, 0, 0.05]}]}}],
    "contact": {"friction": [{"between": ["*", "*"], "law": "coulomb", "params": {"mu": 0.5}}]},
    "output": {"every": 0.02}})");
  const test::CommandResult r = test::deform({"run", scene, "--quiet", "--out", out + "/run"});
  EXPECT_EQ(r.exit_code, 0) << r.err;
  const std::string summary = test::read_file(out + "/run/summary.json");
  EXPECT_NE(summary.find("\"gain_J\": 0,"), std::string::npos) << summary;
}
