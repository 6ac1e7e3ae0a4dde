// A law with state for tests: an elastic bristle (stiffness per area) that slides at the cone, with implicit
// radial return. Included by one file of a program.
#pragma once
#define DFM_STATIC_PLUGIN bristle
#include "deform/plugin.hpp"
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
    if (old > most) {
      z[0] *= most / old;
      z[1] *= most / old;  // the old state first: onto the cone of the new normal force
    }
    double t[2] = {z[0] + h * in->vt[i], z[1] + h * in->vt[s + i]};
    const double trial = k * std::sqrt(t[0] * t[0] + t[1] * t[1]);
    const bool slip = trial > most;
    double d[4] = {-k * h, 0, 0, -k * h}, e[2] = {0, 0};
    if (slip) {
      const double r = trial > 0 ? most / trial : 0, q[2] = {t[0] * k / trial, t[1] * k / trial};
      for (int a = 0; a < 2; ++a)
        for (int b = 0; b < 2; ++b) d[2 * a + b] = -k * h * r * ((a == b) - q[a] * q[b]);
      e[0] = -mu * q[0];
      e[1] = -mu * q[1];
      t[0] *= r;
      t[1] *= r;
    }
    if (out->ft) {
      out->ft[i] = -k * t[0];
      out->ft[s + i] = -k * t[1];
    }
    if (out->state) {
      out->state[i] = t[0];
      out->state[s + i] = t[1];
    }
    for (int a = 0; out->dft_dvt && a < 4; ++a) out->dft_dvt[a * s + i] = d[a];
    if (out->dft_dfn) {
      out->dft_dfn[i] = e[0];
      out->dft_dfn[s + i] = e[1];
    }
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
  ops.size = sizeof ops;
  ops.needs = DFM_NEED_FN | DFM_NEED_VT | DFM_NEED_AREA;
  ops.flags = DFM_FRIC_ISOTROPIC | DFM_FRIC_PASSIVE | DFM_FRIC_JACOBIAN;
  ops.nslot = 1;
  ops.slots = &slot;
  ops.eval = eval;
  static const dfm_param rows[] = {
      {"mu", "friction coefficient", "1", 0, 10, 0.5, 0, 1, nullptr},
      {"sigma0", "bristle stiffness per area", "N/m^3", 0, 1e15, 1e8, 0, 1, nullptr}};
  static const char *const effects[] = {"presliding", nullptr};
  static const dfm_type type = dfm::plugin::type(
      DFM_KIND_FRICTION, "test.bristle", "bristle", "1", "MIT",
      "elastic predictor and radial return, Simo and Hughes 1998, box 1.4", rows, effects, &ops);
  static const dfm_type *const types[] = {&type};
  static const dfm_plugin plugin{sizeof(dfm_plugin), DFM_ABI, DFM_ABI_DRAFT, 1, types, nullptr};
  return &plugin;
}
