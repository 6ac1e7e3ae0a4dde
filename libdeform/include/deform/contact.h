/* deform/contact.h -- friction between pairs, contact report, events. */
#ifndef DEFORM_CONTACT_H
#define DEFORM_CONTACT_H
#include "deform/base.h"
#include "deform/id.h"
#ifdef __cplusplus
extern "C" {
#endif
/** Law between two sides. A side is "*", "material=NAME", a body or obstacle name, or "body:GROUP" (a group
 * of its surface triangles), weighing 1, 2, 3 and 4: of the entries that match in either order the one with
 * the largest sum wins, then the last one given. "material=NAME" asks the material of the cell behind a
 * triangle. Where none matches: law "coulomb", mu_C = mu_S = sqrt(f_a f_b), f a material's entry "friction",
 * 0.5 where it has none. */
typedef struct dfm_friction_def {
  uint32_t size, flags;
  const char *between[2];
  const char *law; /* short name or full id */
  dfm_params params;
} dfm_friction_def;
/** Adds a rule. One for the same two sides, in either order, replaces the one before; a rule that names a
 * body or obstacle goes when that is destroyed. The same two sides with the same law: as
 * dfm_world_set_friction with all parameters, those that are not given at their defaults.
 * @return DFM_OK; DFM_E_ARG unknown name or key (nearest valid one), value out of range; DFM_E_UNSUPPORTED no
 * such law (lists those loaded).
 * Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_world_add_friction(dfm_world world, const dfm_friction_def *def);
/** Changes parameters of a rule while the world runs: the coefficient behind a slider. Those that are not
 * given keep their values. Tables and plan are made anew only where an effect comes or goes (mu_S at mu_C,
 * sigma2 at 0); memory does not grow. Touching contacts keep their state (a bristle is a displacement in m),
 * which starts anew only where the parameters change which values the law keeps. Sleeping bodies wake, except
 * where all values stay as they are.
 * @param a, b    the two sides as the rule has them, in either order
 * @param params  keys and values of the rule's law
 * @return DFM_OK; DFM_E_ARG no rule for these sides (lists the rules), unknown key (nearest valid one), value
 * out of range: nothing was changed; DFM_E_NOMEM. Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_world_set_friction(dfm_world world, const char *a, const char *b,
                                          const dfm_params *params);
/** Removes a rule. Its contacts fall to the next rule that matches, or to the law of pairs without a rule;
 * where that is another law, or has other parameters, their state starts anew. Bodies wake; the next step
 * makes the tables anew.
 * @param a, b  the two sides as the rule has them, in either order
 * @return DFM_OK; DFM_E_ARG no rule for these sides (lists the rules). Threads: Not during
 * step. Since 0.1. */
DFM_API dfm_status dfm_world_remove_friction(dfm_world world, const char *a, const char *b);
/** Lets two named sides pass or touch, whatever their filters say; replaced and removed as rules of friction
 * are. Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_world_filter_pair(dfm_world world, const char *a, const char *b, bool collide);

/** Removes what dfm_world_filter_pair has said of two sides, in either order: their own filters, or the next
 * rule, decide again. Bodies wake; where the two overlap they are set aside as at the start
 * (dfm_world_overlaps).
 * @return DFM_OK; DFM_E_ARG no filter for these sides. Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_world_remove_filter(dfm_world world, const char *a, const char *b);

/** dfm_contact.kind: what touches. VERTEX_FACE: a surfel of side a on a triangle of side b. EDGE_EDGE: an
 * edge of each side. PRIMITIVE: a surfel, an edge or a triangle of side a (flags) on an obstacle or a rigid
 * body. Since 0.1. */
enum { DFM_CONTACT_VERTEX_FACE = 0, DFM_CONTACT_EDGE_EDGE = 1, DFM_CONTACT_PRIMITIVE = 2 };
/** dfm_contact.flags. STICKING: it carries load and its law sticks. BEGAN: it touches since the last
 * sub-step. EDGE_A, TRIANGLE_A: feature_a is the number of an edge, of a triangle; with neither, of a surfel.
 * Edges of a surface are those of dfm_surface_triangles, each once, as pairs i < j of surfels in
 * lexicographic order. Since 0.1. */
enum { DFM_CONTACT_STICKING = 1, DFM_CONTACT_BEGAN = 2, DFM_CONTACT_EDGE_A = 4, DFM_CONTACT_TRIANGLE_A = 8 };

/** One contact of the last sub-step. Forces act on side a; components in the plane of contact: [0] along
 * tangent, [1] along normal x tangent. */
typedef struct dfm_contact {
  uint32_t size, flags; /* flags: DFM_CONTACT_STICKING, BEGAN, EDGE_A, TRIANGLE_A */
  /* body_b 0: an obstacle that feels nothing; key: the same for as long as the contact lasts */
  uint64_t body_a, body_b, key;
  /* surfel, edge or triangle number on each side; PRIMITIVE: feature_b is the place of the obstacle or rigid
   * body in dfm_world_obstacles, from 0 */
  uint32_t feature_a, feature_b;
  /* DFM_CONTACT_VERTEX_FACE, EDGE_EDGE or PRIMITIVE; number of its friction law (dfm_world_law_info) */
  uint32_t kind, law;
  double point[3];              /* m, world */
  double normal[3], tangent[3]; /* unit; normal from b to a */
  /* m, distance of the surfaces less the rest distance d_c; a contact at rest has 0 */
  double gap;
  /* m2, of the surface that the contact stands for; forces per area count with it */
  double area;
  double fn, ft[2];  /* N, mean over the sub-step */
  double slip[2];    /* m/s, of a relative to b */
  double bristle[2]; /* m, deflection of the law's bristles; 0 for laws without memory */
} dfm_contact;
/** dfm_world_contacts with rows of any size. @param row_size bytes from one row of out to the next
 * (base.h). Since 0.1.
 * Threads: Any thread. Not during step. */
DFM_API dfm_status dfm_world_contacts_sized(dfm_world world, uint32_t row_size, uint32_t capacity,
                                            dfm_contact *out, uint32_t *n);
/** All contacts of the last sub-step, in key order. @param capacity of out in contacts; 0 with out
 * NULL only counts.
 * @return DFM_OK; DFM_E_ARG capacity too small (out untouched, *n set); DFM_E_HANDLE. Threads: Any thread.
 * Not during step. Since 0.1. */
static inline dfm_status dfm_world_contacts(dfm_world world, uint32_t capacity, dfm_contact *out,
                                            uint32_t *n) {
  return dfm_world_contacts_sized(world, (uint32_t)sizeof(dfm_contact), capacity, out, n);
}

/** A friction law of a world with its parameters. Pointers are borrowed: they are valid until a rule of
 * friction is added, changed or removed, until the world is restored, or ends. */
typedef struct dfm_law_info {
  uint32_t size, reserved;
  const char *id, *name; /* "org.deform.lugre", "LuGre" */
  const dfm_type *type;  /* its description: label, unit and range of each parameter */
  /* all parameters with their values, in the order of type->params; dfm_friction_def takes them
   * as they are */
  dfm_params params;
} dfm_law_info;
/** The law behind dfm_contact.law and dfm_pair_report.law. The number holds as long as the pointers of
 * dfm_law_info do.
 * @param law   number of the law in the world, from 0
 * @param info  out, as far as info->size goes
 * @return DFM_OK; DFM_E_ARG no such law; DFM_E_HANDLE; DFM_E_BUSY. Threads: Any thread. Not during
 * step. Since 0.1. */
DFM_API dfm_status dfm_world_law_info(dfm_world world, uint32_t law, dfm_law_info *info);

/** Resultants per touching pair of the last sub-step. b: body or obstacle handle (both are 64-bit values). */
typedef struct dfm_pair_report {
  /* law: of its first contact in key order; friction by group or material may differ within the pair */
  uint32_t size, count, sticking, law;
  uint64_t a, b;
  double normal;                /* N, sum of normal forces */
  double force[3], friction[3]; /* N, resultants on a: total, friction alone */
  double moment[3];             /* N m, of the total force on a about its center of mass */
  double slip_max;              /* m/s */
  /* J, done by friction on both sides since the pair first touched; <= 0 but for rounding */
  double friction_work;
} dfm_pair_report;
/** dfm_world_pairs with rows of any size. @param row_size bytes from one row of out to the next
 * (base.h). Since 0.1.
 * Threads: Any thread. Not during step. */
DFM_API dfm_status dfm_world_pairs_sized(dfm_world world, uint32_t row_size, uint32_t capacity,
                                         dfm_pair_report *out, uint32_t *n);
/** Pairs in the order in which their sides were created, a first; capacity as for dfm_world_contacts.
 * Threads: Any thread. Not during step. Since 0.1. */
static inline dfm_status dfm_world_pairs(dfm_world world, uint32_t capacity, dfm_pair_report *out,
                                         uint32_t *n) {
  return dfm_world_pairs_sized(world, (uint32_t)sizeof(dfm_pair_report), capacity, out, n);
}

/** Resultant of the contacts between two things in the last sub-step, friction included, about a point of the
 * caller's choice.
 * @param a, b    body or obstacle handles, in any order: force and moment act on a, those on b are
 *                their negatives
 * @param point   m, world
 * @param force   out, N; zero where the two do not touch. May be NULL
 * @param moment  out, N m, about point. May be NULL
 * @return DFM_OK; DFM_E_ARG; DFM_E_HANDLE a or b is none of this world. Threads: Any thread. Not during
 * step. Since 0.1. */
DFM_API dfm_status dfm_world_pair_wrench(dfm_world world, uint64_t a, uint64_t b, const double point[3],
                                         double force[3], double moment[3]);

/** What contact did between two things over the whole last dfm_world_step, all its sub-steps: what a sound, a
 * damage model or a force display needs. A blow that began and ended within the step is in it, though no
 * contact of it is left to report. */
typedef struct dfm_pair_impulse {
  uint32_t size, reserved;
  uint64_t a, b; /* as in dfm_pair_report */
  /* N s, on a, friction included; equal to the momentum that a got from b */
  double impulse[3];
  double normal_impulse; /* N s, sum of normal impulses */
  /* N, largest sum of normal forces, and norm of the resultant, each a mean over one sub-step */
  double peak_normal, peak_force;
  /* m, world: mean of the points of contact, weighted with their normal impulses */
  double point[3];
  double touching; /* s of the step in which the contact carried something */
} dfm_pair_impulse;
/** dfm_world_pair_impulses with rows of any size. @param row_size bytes from one row of out to the next
 * (base.h). Since 0.1.
 * Threads: Any thread. Not during step. */
DFM_API dfm_status dfm_world_pair_impulses_sized(dfm_world world, uint32_t row_size, uint32_t capacity,
                                                 dfm_pair_impulse *out, uint32_t *n);
/** Pairs that pressed on each other during the last step, in the order in which their sides were created, a
 * first; capacity as for dfm_world_contacts. After a step that failed: of the sub-steps that were taken. A
 * side that has been destroyed since is 0.
 * @return DFM_OK; DFM_E_ARG capacity too small (out untouched, *n set); DFM_E_HANDLE. Threads: Any thread.
 * Not during step. Since 0.1. */
static inline dfm_status dfm_world_pair_impulses(dfm_world world, uint32_t capacity, dfm_pair_impulse *out,
                                                 uint32_t *n) {
  return dfm_world_pair_impulses_sized(world, (uint32_t)sizeof(dfm_pair_impulse), capacity, out, n);
}

typedef struct dfm_contact_event {
  uint32_t size, kind; /* DFM_EVENT_* */
  uint64_t a, b, key;  /* handles of body and body or obstacle; key of the contact, 0 of a sensor */
  double t;            /* s, simulated time */
} dfm_contact_event;
/* RELEASE: an attachment has ended, by its release force or with one of its sides; key is its number
 * (deform/attach.h). SENSOR: a thing has come into a sensor or left it (deform/sensor.h). TEAR: body a == b
 * has torn, by "tear" of its material (deform/material.h); key is the number of points that were split.
 * CUT: part b of a tool has cut body a (dfm_tool_set_cuts); key is the number of faces that have opened or of
 * cells that have gone. PIECE: a part of body a has become body b (dfm_body_separate); key is the number of
 * its cells */
enum {
  DFM_EVENT_BEGIN = 1,
  DFM_EVENT_END = 2,
  DFM_EVENT_RELEASE = 3,
  DFM_EVENT_SENSOR_BEGIN = 4,
  DFM_EVENT_SENSOR_END = 5,
  DFM_EVENT_TEAR = 6,
  DFM_EVENT_CUT = 7,
  DFM_EVENT_PIECE = 8
};
/** dfm_world_events with rows of any size. @param row_size bytes from one row of out to the next
 * (base.h). Since 0.1.
 * Threads: Not during step. */
DFM_API dfm_status dfm_world_events_sized(dfm_world world, uint32_t row_size, uint32_t capacity,
                                          dfm_contact_event *out, uint32_t *n);
/** Begin and end of contacts and of overlaps with sensors, ends of attachments, tears, cuts by tools
 * and pieces since the last call; empties the list. Where more than 65,536 wait, the oldest are left out.
 * Threads: Not during step. Since 0.1. */
static inline dfm_status dfm_world_events(dfm_world world, uint32_t capacity, dfm_contact_event *out,
                                          uint32_t *n) {
  return dfm_world_events_sized(world, (uint32_t)sizeof(dfm_contact_event), capacity, out, n);
}

/** Starts measuring holds: from now on, contacts that touch and stick in every step qualify. Threads: Not
 * during step. Since 0.1. */
DFM_API dfm_status dfm_world_hold_begin(dfm_world world);
/** @param creep  out, m/s: largest net tangential path of a qualifying contact since hold_begin, divided by
 * the time; NAN if none qualifies
 * @param count  out, how many qualify; may be NULL. Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_world_hold(dfm_world world, double *creep, uint32_t *count);
#ifdef __cplusplus
}
#endif
#endif
