/* deform/contact.h -- friction between pairs, contact report, events. */
#ifndef DEFORM_CONTACT_H
#define DEFORM_CONTACT_H
#include "deform/base.h"
#include "deform/id.h"
#ifdef __cplusplus
extern "C" {
#endif
/** Friction law between two sides. A side is "*", "material=NAME", the name of a body or obstacle, or
 * "body:GROUP" (a group of its surface triangles); these have the weights 1, 2, 3 and 4. Of the rules that
 * match, in either order, the one with the largest sum of weights is used, and among equals the last one
 * added. "material=NAME" refers to the material of the cell behind a triangle. If no rule matches, the law is
 * "coulomb" with mu_C = mu_S = sqrt(f_a f_b), where f is the material's entry "friction", 0.5 by default. */
typedef struct dfm_friction_def {
  uint32_t size, flags; /* DFM_FRICTION_RESTITUTION */
  const char *between[2];
  const char *law; /* short name or full id */
  dfm_params params;
  /* with DFM_FRICTION_RESTITUTION, 0 to 1: two that meet faster than 2 |g| h and answer within the sub-step
   * of h seconds as rigid bodies leave each other at least at this share of that speed. An impact that
   * sub-steps resolve is left to elasticity. Not between two rigid things */
  double restitution;
} dfm_friction_def;
/** dfm_friction_def.flags: `restitution` is given. Without it contact adds no speed of its own. Since 0.1. */
enum { DFM_FRICTION_RESTITUTION = 1 };
/** Adds a rule. It replaces an earlier rule for the same two sides, in either order. A rule that names a body
 * or obstacle is removed when that is destroyed. If the earlier rule has the same law, the call acts as
 * dfm_world_set_friction with all parameters; those that are not given get their defaults.
 * @return DFM_OK; DFM_E_ARG unknown name or key (nearest valid one), value out of range; DFM_E_UNSUPPORTED no
 * such law (lists those loaded).
 * Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_world_add_friction(dfm_world world, const dfm_friction_def *def);
/** Changes parameters of a rule while the world runs, for example by a slider. Parameters that are not given
 * keep their values. Tables and plan are rebuilt only if an effect appears or disappears (mu_S at mu_C,
 * sigma2 at 0); memory does not grow. Touching contacts keep their state (a bristle is a displacement in m),
 * unless the parameters change which state values the law has. Sleeping bodies wake, unless no value
 * changes.
 * @param a, b    the two sides of the rule, in either order
 * @param params  keys and values of the rule's law
 * @return DFM_OK; DFM_E_ARG no rule for these sides (lists the rules), unknown key (nearest valid one), value
 * out of range: nothing was changed; DFM_E_NOMEM. Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_world_set_friction(dfm_world world, const char *a, const char *b,
                                          const dfm_params *params);
/** Removes a rule. Its contacts use the next rule that matches, or the law of pairs without a rule. If that
 * is another law, or has other parameters, their state starts at zero. Bodies wake; the next step rebuilds
 * the tables.
 * @param a, b  the two sides of the rule, in either order
 * @return DFM_OK; DFM_E_ARG no rule for these sides (lists the rules). Threads: Not during
 * step. Since 0.1. */
DFM_API dfm_status dfm_world_remove_friction(dfm_world world, const char *a, const char *b);
/** Lets two named sides touch or pass through each other, whatever their filters say. Rules are replaced and
 * removed as rules of friction are. Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_world_filter_pair(dfm_world world, const char *a, const char *b, bool collide);

/** Removes the rule of dfm_world_filter_pair for two sides, in either order: their own filters, or the next
 * rule, decide again. Bodies wake; if the two overlap, they are treated as overlapping at the start
 * (dfm_world_overlaps).
 * @return DFM_OK; DFM_E_ARG no filter for these sides. Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_world_remove_filter(dfm_world world, const char *a, const char *b);

/** dfm_contact.kind. VERTEX_FACE: a surfel of side a on a triangle of side b. EDGE_EDGE: an
 * edge of each side. PRIMITIVE: a surfel, an edge or a triangle of side a (flags) on an obstacle or a rigid
 * body. RIGID: a place where two rigid things meet: rigid bodies, parts of tools, obstacles. Side a is one
 * that gives way, and where both do, the one that was made first. Since 0.1. */
enum {
  DFM_CONTACT_VERTEX_FACE = 0,
  DFM_CONTACT_EDGE_EDGE = 1,
  DFM_CONTACT_PRIMITIVE = 2,
  DFM_CONTACT_RIGID = 3
};
/** dfm_contact.flags. STICKING: it carries load and its law sticks. BEGAN: it began to touch in the last
 * sub-step. EDGE_A, TRIANGLE_A: feature_a is the number of an edge, of a triangle; without these, of a
 * surfel. The edges of a surface are those of dfm_surface_triangles, each once, as pairs i < j of surfels in
 * lexicographic order. Since 0.1. */
enum { DFM_CONTACT_STICKING = 1, DFM_CONTACT_BEGAN = 2, DFM_CONTACT_EDGE_A = 4, DFM_CONTACT_TRIANGLE_A = 8 };

/** One contact of the last sub-step. Forces act on side a. Components in the plane of contact: [0] along
 * tangent, [1] along normal x tangent. */
typedef struct dfm_contact {
  uint32_t size, flags; /* flags: DFM_CONTACT_STICKING, BEGAN, EDGE_A, TRIANGLE_A */
  /* body_a: a soft body; RIGID: a rigid body or a part of a tool. body_b 0: an obstacle, which does not
   * respond. key: constant while the contact lasts */
  uint64_t body_a, body_b, key;
  /* surfel, edge or triangle number on each side; PRIMITIVE: feature_b is the index of the obstacle or rigid
   * body in dfm_world_obstacles, from 0; RIGID: both are such indices */
  uint32_t feature_a, feature_b;
  /* DFM_CONTACT_VERTEX_FACE, ...; number of its friction law (dfm_world_law_info) */
  uint32_t kind, law;
  double point[3];              /* m, world */
  double normal[3], tangent[3]; /* unit; normal from b to a */
  /* m, distance of the surfaces minus the rest distance d_c; 0 at rest */
  double gap;
  /* m2, area of the surface that the contact represents, for forces per area; RIGID: 0 */
  double area;
  double fn, ft[2];  /* N, mean over the sub-step */
  double slip[2];    /* m/s, of a relative to b */
  double bristle[2]; /* m, deflection of the bristles; 0 for laws without memory */
} dfm_contact;
/** dfm_world_contacts with rows of any size. @param row_size bytes from one row of out to the next
 * (base.h). Since 0.1.
 * Threads: Any thread. Not during step. */
DFM_API dfm_status dfm_world_contacts_sized(dfm_world world, uint32_t row_size, uint32_t capacity,
                                            dfm_contact *out, uint32_t *n);
/** All contacts of the last sub-step: those of soft bodies in key order, then RIGID ones that carry load, in
 * key order. @param capacity of out in contacts; 0 with out
 * NULL only counts.
 * @return DFM_OK; DFM_E_ARG capacity too small (out untouched, *n set); DFM_E_HANDLE. Threads: Any thread.
 * Not during step. Since 0.1. */
static inline dfm_status dfm_world_contacts(dfm_world world, uint32_t capacity, dfm_contact *out,
                                            uint32_t *n) {
  return dfm_world_contacts_sized(world, (uint32_t)sizeof(dfm_contact), capacity, out, n);
}

/** A friction law of a world with its parameters. Pointers are borrowed; they are valid until a rule of
 * friction is added, changed or removed, or the world is restored or destroyed. */
typedef struct dfm_law_info {
  uint32_t size, reserved;
  const char *id, *name; /* "org.deform.lugre", "LuGre" */
  const dfm_type *type;  /* description: label, unit and range of each parameter */
  /* all parameters with their values, in the order of type->params; they can be passed to dfm_friction_def
   * unchanged */
  dfm_params params;
} dfm_law_info;
/** The law of dfm_contact.law and dfm_pair_report.law. The number is valid as long as the pointers of
 * dfm_law_info are.
 * @param law   number of the law in the world, from 0
 * @param info  out, info->size bytes at most
 * @return DFM_OK; DFM_E_ARG no such law; DFM_E_HANDLE; DFM_E_BUSY. Threads: Any thread. Not during
 * step. Since 0.1. */
DFM_API dfm_status dfm_world_law_info(dfm_world world, uint32_t law, dfm_law_info *info);

/** Resultants per touching pair of the last sub-step. a, b: body or obstacle handles (both are 64-bit
 * values). a is a soft body, or, of two rigid things, side a of dfm_contact. */
typedef struct dfm_pair_report {
  /* law: that of the first contact in key order; other contacts of the pair may have other laws */
  uint32_t size, count, sticking, law;
  uint64_t a, b;
  double normal;                /* N, sum of normal forces */
  double force[3], friction[3]; /* N, resultants on a: total, friction alone */
  double moment[3];             /* N m, of the total force on a about its center of mass */
  double slip_max;              /* m/s */
  /* J, work of friction on both sides since the pair first touched; <= 0 up to rounding */
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

/** Resultant of the contacts between two things in the last sub-step, friction included, about a given
 * point.
 * @param a, b    body or obstacle handles, in any order: force and moment act on a; those on b are
 *                their negatives
 * @param point   m, world
 * @param force   out, N; zero if the two do not touch. May be NULL
 * @param moment  out, N m, about point. May be NULL
 * @return DFM_OK; DFM_E_ARG; DFM_E_HANDLE a or b is not of this world. Threads: Any thread. Not during
 * step. Since 0.1. */
DFM_API dfm_status dfm_world_pair_wrench(dfm_world world, uint64_t a, uint64_t b, const double point[3],
                                         double force[3], double moment[3]);

/** Contact between two things over the whole last dfm_world_step, all sub-steps included, as sounds, damage
 * models and force displays need it. It includes an impact that began and ended within the step, of which no
 * contact is left to report. */
typedef struct dfm_pair_impulse {
  uint32_t size, reserved;
  uint64_t a, b; /* as in dfm_pair_report */
  /* N s, on a, friction included; equals the momentum that b gave to a */
  double impulse[3];
  double normal_impulse; /* N s, sum of normal impulses */
  /* N, largest sum of normal forces and largest norm of the resultant, each a mean over one sub-step */
  double peak_normal, peak_force;
  /* m, world: mean of the contact points, weighted by their normal impulses */
  double point[3];
  double touching; /* s of the step during which the pair carried load */
  /* N s, normal_impulse by eighths of the step, in order; an impulse is spread over its sub-step */
  double part[8];
} dfm_pair_impulse;
/** dfm_world_pair_impulses with rows of any size. @param row_size bytes from one row of out to the next
 * (base.h). Since 0.1.
 * Threads: Any thread. Not during step. */
DFM_API dfm_status dfm_world_pair_impulses_sized(dfm_world world, uint32_t row_size, uint32_t capacity,
                                                 dfm_pair_impulse *out, uint32_t *n);
/** Pairs that carried load during the last step, in the order in which their sides were created, a first;
 * capacity as for dfm_world_contacts. After a failed step the list covers the sub-steps that were taken. A
 * side that has been destroyed since is 0.
 * @return DFM_OK; DFM_E_ARG capacity too small (out untouched, *n set); DFM_E_HANDLE. Threads: Any thread.
 * Not during step. Since 0.1. */
static inline dfm_status dfm_world_pair_impulses(dfm_world world, uint32_t capacity, dfm_pair_impulse *out,
                                                 uint32_t *n) {
  return dfm_world_pair_impulses_sized(world, (uint32_t)sizeof(dfm_pair_impulse), capacity, out, n);
}

typedef struct dfm_contact_event {
  uint32_t size, kind; /* DFM_EVENT_* */
  /* handles as in dfm_pair_report; key of the contact, 0 of a sensor and of two rigid things */
  uint64_t a, b, key;
  double t; /* s, simulated time */
} dfm_contact_event;
/* BEGIN, END: a contact of a soft body began or ended to touch, so a pair may have several; two rigid things
 * begin and end as a whole. RELEASE: an attachment ended, by its release force or with one of its sides; key
 * is its number (deform/attach.h). SENSOR: a thing entered or left a sensor (deform/sensor.h). TEAR: body
 * a == b tore, by "tear" of its material (deform/material.h); key is the number of points that were split.
 * CUT: part b of a tool cut body a (dfm_tool_set_cuts), or, if a == b, a planned cut (dfm_body_plan_cut); key
 * is the number of opened faces or removed cells. PIECE: a part of body a is now body b (dfm_body_separate);
 * key: its cells */
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
/** Begin and end of contacts and of overlaps with sensors, ends of attachments, tears, cuts by tools, and
 * pieces, since the last call; empties the list, which keeps the latest 65,536.
 * Threads: Not during step. Since 0.1. */
static inline dfm_status dfm_world_events(dfm_world world, uint32_t capacity, dfm_contact_event *out,
                                          uint32_t *n) {
  return dfm_world_events_sized(world, (uint32_t)sizeof(dfm_contact_event), capacity, out, n);
}

/** Starts a measurement of creep: contacts that touch and stick in every step from now on qualify. Threads:
 * Not during step. Since 0.1. */
DFM_API dfm_status dfm_world_hold_begin(dfm_world world);
/** @param creep  out, m/s: largest net tangential displacement of a qualifying contact since hold_begin,
 * divided by the time; NAN if none qualifies
 * @param count  out, number of qualifying contacts; may be NULL. Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_world_hold(dfm_world world, double *creep, uint32_t *count);
#ifdef __cplusplus
}
#endif
#endif
