/* deform/material.h -- named parameter sets that bodies share. */
#ifndef DEFORM_MATERIAL_H
#define DEFORM_MATERIAL_H
#include "deform/base.h"
#include "deform/id.h"
#ifdef __cplusplus
extern "C" {
#endif
/** density kg/m3 (> 0), young Pa (> 0), poisson (-1..0.5), damping_mass 1/s, damping_stiffness s. A model
 * parameter that the body does not set is taken from the material's entry of the same key, else from the
 * model's default. `extra` holds such further entries, and three of the library: "friction", the coefficient
 * for pairs without a rule (dfm_friction_def); "tear", the largest strain (> 0) that the material withstands
 * in any direction; "fracture_energy", J/m2 (0: none), the energy that a blade needs to open faces
 * (dfm_cut_info.fracture). At the end of a step a body of a material with "tear" splits the points beyond
 * that strain (doc/concepts/cutting.md); its model must be msm or corotational_fem. */
typedef struct dfm_material_def {
  uint32_t size, flags;
  const char *name; /* unique in its world; NULL: none */
  double density, young, poisson, damping_mass, damping_stiffness;
  dfm_params extra;
  uint64_t cookie; /* set by the default function */
} dfm_material_def;

/** dfm_material_def_default into a def of any size (base.h). Threads: Any thread. Since 0.1. */
DFM_API void dfm_material_def_default_sized(uint32_t size, dfm_material_def *out);
/** 1000 kg/m3, 1e5 Pa, 0.3, undamped. Threads: Any thread. Since 0.1. */
static inline dfm_material_def dfm_material_def_default(void) {
  dfm_material_def out;
  dfm_material_def_default_sized((uint32_t)sizeof out, &out);
  return out;
}
/** @return DFM_OK; DFM_E_ARG a value out of range or the name is taken; DFM_E_HANDLE. Threads: Not during
 * step. Since 0.1. */
DFM_API dfm_status dfm_material_create(dfm_world world, const dfm_material_def *def, dfm_material *out);
/** Destroys a material; bodies keep the values that they took from it. Threads: Not during step.
 * Since 0.1. */
DFM_API dfm_status dfm_material_destroy(dfm_material material);
#ifdef __cplusplus
}
#endif
#endif
