/* deform/attach.h -- points of a body's surface held at an obstacle, a rigid body or another body. */
#ifndef DEFORM_ATTACH_H
#define DEFORM_ATTACH_H
#include "deform/base.h"
#include "deform/id.h"
#ifdef __cplusplus
extern "C" {
#endif
/** dfm_attach_def.flags. TOUCH: the two go on to touch each other where they are not attached; without it
 * they do not touch while they are attached. */
enum { DFM_ATTACH_TOUCH = 1 };
/** What of a body's surface is attached to what. Points, surfels, group and box are taken together; at least
 * one surfel is needed. Every surfel is held where it is now, in the frame of an obstacle or a rigid body, or
 * by the surface of another body as that deforms. Since 0.1. */
typedef struct dfm_attach_def {
  uint32_t size, flags; /* flags: DFM_ATTACH_* */
  uint64_t to;          /* dfm_obstacle, dfm_rigid, or another dfm_body of the same world */
  uint32_t npoint, nsurfel;
  /* [npoint] phyxels; those inside the body are passed over. Not of a body with a surface of its own */
  const uint32_t *points;
  const uint32_t *surfels; /* [nsurfel] as dfm_surface_positions numbers them */
  const char *group;       /* of dfm_body_def.groups: the corners of its triangles; NULL: none */
  const double *box; /* [6] m, world: least x y z, largest x y z; surfels that are in it now; NULL: none */
  /* m: surfels farther than this from the other body's surface are passed over; 0: any. Not of obstacles */
  double max_distance;
  /* N/m, of the whole, shared evenly by its surfels; 0: rigid. With it, or with a damping (N s/m), each
   * surfel hangs on a spring and a damper that no stiffness makes unstable */
  double stiffness, damping;
  double release;  /* N: a larger resultant, mean over a sub-step, ends the attachment; 0: none does */
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
/** Attaches a body's surface. The attachment is solved with the contacts: what pulls at the body pulls the
 * other way at the rigid body or the other body, in every sub-step, so that momentum and angular momentum are
 * kept to rounding; an obstacle carries it along. It is part of snapshots, and ends with either side. A gap
 * that a host has made (dfm_body_set_state, a teleport) closes by at most the contact offset per sub-step, or
 * at dfm_world_def.recovery_speed; a spring pulls as its gap says.
 * @param attachment  out, its number among the body's attachments, loads and springs; may be NULL
 * @return DFM_OK; DFM_E_ARG nothing of the surface is meant, a number or group that does not exist, a value
 * that is negative or not finite, the body itself; DFM_E_HANDLE `to` is none of this world's;
 * DFM_E_UNSUPPORTED the contact method is ROLLBACK; DFM_E_NOMEM. Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_body_attach(dfm_body body, const dfm_attach_def *def, uint32_t *attachment);
/** Ends an attachment. The two may touch from now on; where they overlap they are set aside as at the start
 * (dfm_world_overlaps). @return DFM_OK; DFM_E_ARG no such attachment; DFM_E_HANDLE. Threads: Not during
 * step. Since 0.1. */
DFM_API dfm_status dfm_body_detach(dfm_body body, uint32_t attachment);
/** Numbers of the body's attachments, in order of creation. One that is released leaves the list, and
 * dfm_world_events tells it: kind DFM_EVENT_RELEASE, a the body, b what it was attached to, key its number.
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
  double impulse[3]; /* N s on the body since it was made: divide differences by the time for a mean force */
  double stretch;    /* m, largest distance of a surfel from where it is held */
} dfm_attachment;
/** What an attachment is and does. @return DFM_OK; DFM_E_ARG no such attachment; DFM_E_HANDLE. Threads: Any
 * thread. Not during step. Since 0.1. */
DFM_API dfm_status dfm_body_get_attachment(dfm_body body, uint32_t attachment, dfm_attachment *out);
#ifdef __cplusplus
}
#endif
#endif
