// org.deform.msm: mass-spring model on the edges of tetrahedra, dampers along the springs, a volume term per
// cell, anisotropy by extra coordinates. Zerbato 2010, 2.2, (2.25), (2.26), (2.27), Fig. 2.5 and chapter 6,
// as corrected in doc/models/msm.md, which derives the constants.
#include <stdio.h>

#include "../model_common/spring_mask.h"
#include "msm_body.h"

namespace msm {

using Ops = model::Ops<Body>;

void complain(const dfm_host *h, const char *what) { model::complain(h, kId, what); }

bool valid(const dfm_host *h, const double *values) {
  return model::in_range(h, kId, kParams, kParamCount, values) && fit_together(h, kId, values);
}

namespace {

dfm_status create(const dfm_host *h, const dfm_mesh *m, void **self) {
  return model::create<Body>(h, m, kId, self);
}

dfm_status set_params(void *self, const double *params) {
  Body *body = static_cast<Body *>(self);
  if (!valid(body->host, params)) return DFM_E_ARG;
  return model::change(*body, params);
}

// Branches: r of every spring, then `kept` of the step before; 1 where none was.
dfm_status state_init(const void *self, double *state) {
  const Body &body = *static_cast<const Body *>(self);
  if (!body.has_branch()) return DFM_OK;
  std::fill(state, state + body.nedge, 0.0);
  state[body.nedge] = 1;
  return DFM_OK;
}

uint32_t limited(const void *self) {
  const Body &body = *static_cast<const Body *>(self);
  uint32_t n = 0;
  for (uint32_t b = 0; body.cells_on && b < body.nblock; ++b) n += body.limited[b];
  return n;
}

const dfm_slot kBranchSlots[] = {{DFM_PER_EDGE, 1, DFM_SLOT_SCALAR, 0},
                                 {DFM_PER_INSTANCE, 1, DFM_SLOT_SCALAR, 0}};
const dfm_slots kNoSlots = {sizeof(dfm_slots), 0, nullptr, 0, 0},
                kSlots = {sizeof(dfm_slots), 2, kBranchSlots, 0, 0};
dfm_status prepare_single(void *self) {
  Body &body = *static_cast<Body *>(self);
  if (const char *why = body.keeps_double()) {
    complain(body.host, why);
    return DFM_E_UNSUPPORTED;
  }
  try {
    body.prepare_single();
  } catch (...) {
    return DFM_E_NOMEM;
  }
  return DFM_OK;
}

dfm_status add_single_forces(void *self, const dfm_kin *k, double *f) {
  Body &body = *static_cast<Body *>(self);
  if (!body.has_single()) return DFM_E_STATE;
  body.add_forces(*k, f, true);
  return DFM_OK;
}

uint32_t parts(const void *self) { return static_cast<const Body *>(self)->nblock; }

dfm_status part_forces(void *self, const dfm_kin *k, uint32_t single, dfm_take_part_fn take, void *user) {
  Body &body = *static_cast<Body *>(self);
  if (single && !body.has_single()) return DFM_E_STATE;
  return Ops::with_state(self, k, [&](Body &b) { b.part_forces(*k, single != 0, take, user); });
}

const dfm_part_forces kPartForces = {sizeof(dfm_part_forces), 0, parts, part_forces};
const dfm_f32 kSingle = {sizeof(dfm_f32), 0, prepare_single, add_single_forces};
const dfm_topology kTopology = {sizeof(dfm_topology), 0, nullptr};
const dfm_limited kLimited = {sizeof(dfm_limited), 0, limited};

const dfm_effect_rows kEffectRows = model::rows_of(kOff);

const void *extension(const void *self, const char *id) {
  if (!strcmp(id, DFM_EXT_CELL_ENERGY)) return &Ops::kCellEnergy;
  if (!strcmp(id, DFM_EXT_SLOTS)) return static_cast<const Body *>(self)->has_branch() ? &kSlots : &kNoSlots;
  if (!strcmp(id, DFM_EXT_EFFECTS)) return &Ops::kActiveEffects;
  if (!strcmp(id, DFM_EXT_EFFECT_ROWS)) return &kEffectRows;
  if (!strcmp(id, DFM_EXT_IDLE)) return &Ops::kIdle;
  if (!strcmp(id, DFM_EXT_LIMITED)) return &kLimited;
  if (!strcmp(id, DFM_EXT_SPRING_MASK)) return &SpringMask<Body>::kTable;
  if (!strcmp(id, DFM_EXT_F32)) return &kSingle;
  if (!strcmp(id, DFM_EXT_PART_FORCES)) return &kPartForces;
  if (!strcmp(id, DFM_EXT_TOPOLOGY)) return &kTopology;
  return nullptr;
}

const dfm_model kModel = model::table<Body>(
    DFM_CAP_ENERGY | DFM_CAP_STIFFNESS | DFM_CAP_DAMPING | DFM_CAP_ROTATION_INVARIANT | DFM_CAP_PLAUSIBLE,
    create, set_params, state_init, extension);

const dfm_type kType =
    dfm::plugin::type(DFM_KIND_MODEL, kId, "mass-spring", "0.2.0", "MIT",
                      "Zerbato 2010, (2.25)-(2.27) and chapter 6 corrected, Fig. 2.5; Van Gelder 1998, "
                      "Approximate simulation of elastic membranes by triangulated spring meshes",
                      kParams, kEffects, &kModel);

}  // namespace
}  // namespace msm

DFM_PLUGIN(&msm::kType)
