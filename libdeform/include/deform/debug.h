/* deform/debug.h -- files that show a state: VTU of phyxels and surfels. */
#ifndef DEFORM_DEBUG_H
#define DEFORM_DEBUG_H
#include "deform/base.h"
#include "deform/id.h"
#ifdef __cplusplus
extern "C" {
#endif
/** Phyxels as VTU (point data u, v; cell data energy_density, stress (xx yy zz xy yz zx) and von_mises
 * where the model offers them). Never
 * leaves half a file.
 * Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_debug_write_body(dfm_body body, const char *path);
/** Surfels as VTU (point data u, v, force). Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_debug_write_surface(dfm_body body, const char *path);
/** u of dfm_debug_write_body, [n,3], m: displacements from the rest shape at the body's pose. That is the
 * pose of creation, until a change to a model without DFM_CAP_ROTATION_INVARIANT (linear_fem) renews it.
 * Capacity and errors as for dfm_surface_positions. Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_debug_displacements(dfm_body body, uint32_t capacity, double *u, uint32_t *n);
/** The same of the surfels: u of dfm_debug_write_surface. Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_debug_surface_displacements(dfm_body body, uint32_t capacity, double *u, uint32_t *n);

/** Lines for a debug view: contact normals and contact forces of the last sub-step, boxes of the
 * surfaces. */
enum { DFM_DRAW_CONTACTS = 1, DFM_DRAW_FORCES = 2, DFM_DRAW_BOXES = 4 };
typedef void (*dfm_draw_line_fn)(void *user, const double a[3], const double b[3], uint32_t rgb);
/** Calls line for each; what is a sum of DFM_DRAW_*. Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_debug_draw(dfm_world world, uint32_t what, dfm_draw_line_fn line, void *user);
#ifdef __cplusplus
}
#endif
#endif
