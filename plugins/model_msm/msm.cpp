// org.deform.msm: mass-spring model on the edges of tetrahedra, dampers along the springs, a volume term per cell.
// Thesis 2.2, equations (2.25), (2.26) and (2.27), the last two as corrected in doc/models/msm.md, which derives the constants.
#include <stdio.h>

#include "msm_body.h"

namespace msm {
namespace {

constexpr uint32_t kRun = DFM_PARAM_RUNTIME;
const dfm_param kParams[kParamCount] = {
    {"young", "Young's modulus", "Pa", 1e-3, 1e13, 1e5, kRun | DFM_PARAM_LOG_SCALE | DFM_PARAM_PER_CELL, 1, nullptr},
    {"poisson", "Poisson ratio that the volume term aims at (springs alone: 1/4)", "1", -0.99, 0.4999, 0.3, kRun, 1, nullptr},
    {"damping_stiffness", "damper over stiffness of each spring", "s", 0, 1e3, 0, kRun, 1, nullptr},
    {"damping_mass", "drag over mass of each point", "1/s", 0, 1e6, 0, kRun, 1, nullptr},
    {"volume", "volume stiffness in bulk moduli E/(3(1-2 nu)); 0: off", "1", 0, 1e6, 0, kRun, 1, nullptr},
};

void complain(const dfm_host *h, const char *what) {
  char text[256];
  snprintf(text, sizeof text, "org.deform.msm: %s.", what);
  h->log(h->ctx, 3, 0, text);
}

bool check_params(const dfm_host *h, const double *values) {
  for (uint32_t n = 0; n < kParamCount; ++n)
    if (!(values[n] >= kParams[n].min && values[n] <= kParams[n].max)) {
      char text[200];
      const dfm_param &p = kParams[n];
      snprintf(text, sizeof text, "parameter %s = %g %s is outside %g .. %g", p.key, values[n], p.unit, p.min, p.max);
      complain(h, text);
      return false;
    }
  return true;
}

const char *check_mesh(const dfm_mesh &m) {
  if (m.cell != DFM_CELL_TET) return "the cells must be tetrahedra";
  if (!m.npoint || !m.ncell || !m.nedge || !m.edges || !m.cells || !m.rest || !m.mass) return "the mesh has no cells, points or edges";
  for (size_t n = 0; n < 4 * size_t(m.ncell); ++n)
    if (m.cells[n] >= m.npoint) return "a cell names a point that the mesh lacks";
  for (size_t n = 0; n < 2 * size_t(m.nedge); ++n)
    if (m.edges[n] >= m.npoint) return "an edge names a point that the mesh lacks";
  return nullptr;
}

dfm_status create(const dfm_host *h, const dfm_mesh *m, void **self) {
  *self = nullptr;
  if (const char *wrong = check_mesh(*m)) return complain(h, wrong), DFM_E_ARG;
  if (!check_params(h, m->params)) return DFM_E_ARG;
  void *memory = h->alloc(h->ctx, sizeof(Body), 64);
  if (!memory) return DFM_E_NOMEM;
  Body *body = new (memory) Body;
  dfm_status status = DFM_OK;
  try {
    body->create(h, *m);
  } catch (const char *wrong) {
    complain(h, wrong), status = DFM_E_ARG;
  } catch (...) {
    status = DFM_E_NOMEM;
  }
  if (status == DFM_OK) return *self = body, DFM_OK;
  body->~Body();
  h->release(h->ctx, memory, sizeof(Body), 64);
  return status;
}

void destroy(void *self) {
  Body *body = static_cast<Body *>(self);
  if (!body) return;
  const dfm_host *h = body->host;
  body->~Body();
  h->release(h->ctx, self, sizeof(Body), 64);
}

dfm_status set_params(void *self, const double *params) {
  Body *body = static_cast<Body *>(self);
  if (!check_params(body->host, params)) return DFM_E_ARG;
  try {
    body->apply_params(params);
  } catch (...) {
    return DFM_E_NOMEM;
  }
  return DFM_OK;
}

dfm_status state_init(const void *, double *) { return DFM_OK; }

dfm_status add_forces(void *self, const dfm_kin *k, double *f) {
  static_cast<Body *>(self)->add_forces(*k, f);
  return DFM_OK;
}

dfm_status bound(void *self, const dfm_kin *k, double *ksum, double *csum, double *) {
  static_cast<Body *>(self)->bound(*k, ksum, csum);
  return DFM_OK;
}

dfm_status energy(void *self, const dfm_kin *k, double *joule) {
  *joule = static_cast<const Body *>(self)->energy(*k);
  return DFM_OK;
}

dfm_status cell_energy(void *self, const dfm_kin *k, double *density) {
  static_cast<Body *>(self)->cell_energy(*k, density);
  return DFM_OK;
}

const dfm_cell_energy kCellEnergy = {sizeof(dfm_cell_energy), 0, cell_energy};

const void *extension(const void *, const char *id) { return !strcmp(id, DFM_EXT_CELL_ENERGY) ? &kCellEnergy : nullptr; }

const char *const kEffects[] = {"volume", "damping", "large_rotation", nullptr};

const dfm_model kModel = {
    sizeof(dfm_model), DFM_CAP_ENERGY | DFM_CAP_DAMPING | DFM_CAP_ROTATION_INVARIANT | DFM_CAP_PLAUSIBLE, DFM_CELL_TET, 0, nullptr,
    create, destroy, set_params, state_init, add_forces, bound, energy, nullptr, nullptr, extension};

const dfm_type kType = {
    sizeof(dfm_type), DFM_KIND_MODEL, "org.deform.msm", "mass-spring", "0.1.0", "MIT",
    "Zerbato 2010, (2.25)-(2.27) corrected; Van Gelder 1998, Approximate simulation of elastic membranes by triangulated spring meshes",
    kParams, kParamCount, sizeof(dfm_param), kEffects, &kModel};

const dfm_type *const kTypes[] = {&kType};
const dfm_plugin kPlugin = {sizeof(dfm_plugin), DFM_ABI, DFM_ABI_DRAFT, 1, kTypes, nullptr};

}  // namespace
}  // namespace msm

extern "C" DFM_EXPORT const dfm_plugin *dfm_plugin_entry(const dfm_host *host, uint32_t, uint32_t) {
  if (DFM_ABI_OK(host)) return &msm::kPlugin;
  msm::complain(host, "built for another draft of the plugin ABI: build it against this library's header");
  return nullptr;
}
