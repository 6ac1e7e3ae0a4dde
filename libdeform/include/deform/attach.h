/* deform/attach.h -- points of a body's surface held at an obstacle, a rigid body or another body. */
#ifndef DEFORM_ATTACH_H
#define DEFORM_ATTACH_H
#include "deform/base.h"
#include "deform/id.h"
#ifdef __cplusplus
extern "C" {
#endif
/** dfm_attach_def.flags. TOUCH: contact between the two continues where they are not attached; without it
 * there is no contact between them while they are attached. */
enum { DFM_ATTACH_TOUCH = 1 };
/** Attaches part of a body's surface to something else. The part is the union of points, surfels, group and
 * box; it must have at least one surfel. Each surfel keeps its present place in the frame of the obstacle or
 * rigid body, or its present place on the deforming surface of the other body. Since 0.1. */
typedef struct dfm_attach_def {
  uint32_t size, flags; /* flags: DFM_ATTACH_* */
  uint64_t to;          /* dfm_obstacle, dfm_rigid, or another dfm_body of the same world */
  uint32_t npoint, nsurfel;
  /* [npoint] phyxels; inner ones are ignored. Not for a body with a surface of its own (dfm_surface_def) */
  const uint32_t *points;
  const uint32_t *surfels; /* [nsurfel] as dfm_surface_positions numbers them */
  const char *group;       /* of dfm_body_def.groups: corners of its triangles; NULL: none */
  const double *box;       /* [6] m, world: min x y z, max x y z; the surfels inside it now; NULL: none */
  /* m: surfels farther from the other body's surface are ignored; 0: any. Not for obstacles */
  double max_distance;
  /* N/m and N s/m of the whole attachment, shared evenly by its surfels; both 0: rigid. Otherwise each surfel
   * is held by a spring and a damper, which are stable at any stiffness */
  double stiffness, damping;
  double release;  /* N: a larger resultant (mean over a sub-step) ends it; 0: never */
  uint64_t cookie; /* set by the default function */
} dfm_attach_def;
/** dfm_attach_def_default into a def of any size (base.h). Threads: Any thread. Since 0.1. */
DFM_API void dfm_attach_def_default_sized(uint32_t size, dfm_attach_def *out);
/** Nothing attached, rigid, never released. Threads: Any thread. Since 0.1. */
static inline dfm_attach_def dfm_attach_def_default(void) {
  dfm_attach_def out;
  dfm_attach_def_default_sized((uint32_t)sizeof out, &out);
  return out;
}
/** Attaches a body's surface. Attachments are solved together with the contacts: both sides receive opposite
 * impulses in every sub-step, so momentum and angular momentum are conserved to rounding; an obstacle carries
 * the body along. Attachments are part of snapshots, and end when either side is destroyed. A gap made by the
 * host (dfm_body_set_state, a teleport) closes by at most the contact offset per sub-step, or at
 * dfm_world_def.recovery_speed; a spring pulls in proportion to its gap.
 * @param attachment  out, its number among the body's attachments, loads and springs; may be NULL
 * @return DFM_OK; DFM_E_ARG no surfel is selected, a number or group does not exist, a value is negative or
 * not finite, or `to` is the body itself; DFM_E_HANDLE `to` is not of this world; DFM_E_NOMEM.
 * Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_body_attach(dfm_body body, const dfm_attach_def *def, uint32_t *attachment);
/** Ends an attachment. The two can touch from now on; if they overlap, they are treated as overlapping at the
 * start (dfm_world_overlaps). @return DFM_OK; DFM_E_ARG no such attachment; DFM_E_HANDLE. Threads: Not during
 * step. Since 0.1. */
DFM_API dfm_status dfm_body_detach(dfm_body body, uint32_t attachment);
/** Numbers of the body's attachments, in order of creation. A released attachment leaves the list, and
 * dfm_world_events reports it: kind DFM_EVENT_RELEASE, a the body, b the other side, key its number.
 * @param capacity of out; 0 with out NULL only counts. @return DFM_OK; DFM_E_ARG too small (out untouched, *n
 * set); DFM_E_HANDLE. Threads: Any thread. Not during step. Since 0.1. */
DFM_API dfm_status dfm_body_attachments(dfm_body body, uint32_t capacity, uint32_t *out, uint32_t *n);

typedef struct dfm_attachment {
  uint32_t size, flags; /* DFM_ATTACH_* */
  uint64_t to;
  uint32_t nsurfel, reserved;
  double stiffness, damping, release; /* as given */
  double point[3];                    /* m, world: mean of its surfels now */
  /* N and N m about `point`, on the body, mean over the last sub-step */
  double force[3], moment[3];
  double impulse[3]; /* N s on the body since creation: a difference over its time is a mean force */
  double stretch;    /* m, largest distance of a surfel from its place */
} dfm_attachment;
/** Definition and present state of an attachment. @return DFM_OK; DFM_E_ARG no such attachment; DFM_E_HANDLE.
 * Threads: Any thread. Not during step. Since 0.1. */
DFM_API dfm_status dfm_body_get_attachment(dfm_body body, uint32_t attachment, dfm_attachment *out);
#ifdef __cplusplus
}
#endif
#endif
