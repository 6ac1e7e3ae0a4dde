/* The C functions and struct members that outside checks call, as those write them: this file compiles, or a
 * name, a parameter or a result has changed. Inline functions too have an address and can be called
 * by pointer. */
#include <stddef.h>

#include "deform/deform.h"

#define SAME_TYPE(struct_, member, type)                                                     \
  _Static_assert(_Generic(((struct_ *)0)->member, type: 1, default: 0), #struct_ "." #member \
                                                                                 " is "      \
                                                                                 "no " #type)

SAME_TYPE(dfm_contact, size, uint32_t);
SAME_TYPE(dfm_contact, flags, uint32_t);
SAME_TYPE(dfm_contact, body_a, uint64_t);
SAME_TYPE(dfm_contact, body_b, uint64_t);
SAME_TYPE(dfm_contact, key, uint64_t);
SAME_TYPE(dfm_contact, kind, uint32_t);
SAME_TYPE(dfm_contact, law, uint32_t);
SAME_TYPE(dfm_contact, gap, double);
SAME_TYPE(dfm_contact, fn, double);
SAME_TYPE(dfm_toi_options, method, int32_t);
SAME_TYPE(dfm_param_value, key, const char *);
SAME_TYPE(dfm_params, values, const dfm_param_value *);
_Static_assert(sizeof(dfm_world) == 8 && sizeof(dfm_body) == 8 && sizeof(dfm_law) == 8,
               "handles are 64-bit values");
_Static_assert(DFM_CONTACT_VERTEX_FACE == 0 && DFM_CONTACT_EDGE_EDGE == 1 && DFM_CONTACT_PRIMITIVE == 2 &&
                   DFM_CONTACT_RIGID == 3,
               "kinds");
_Static_assert(DFM_CONTACT_STICKING == 1 && DFM_CONTACT_BEGAN == 2, "flags");

dfm_status (*const signature_point_triangle)(const dfm_motion *, const dfm_motion[3], const dfm_toi_options *,
                                             double *, double[3]) = dfm_toi_point_triangle;
dfm_status (*const signature_edge_edge)(const dfm_motion[2], const dfm_motion[2], const dfm_toi_options *,
                                        double *, double[2]) = dfm_toi_edge_edge;
dfm_status (*const signature_context_create)(const dfm_context_def *, dfm_context **) = dfm_context_create;
void (*const signature_context_destroy)(dfm_context *) = dfm_context_destroy;
dfm_status (*const signature_law_open)(dfm_context *, const char *, dfm_law *) = dfm_law_open;
dfm_status (*const signature_law_close)(dfm_law) = dfm_law_close;
dfm_status (*const signature_law_type)(dfm_law, const dfm_type **) = dfm_law_type;
dfm_status (*const signature_law_eval)(dfm_law, const dfm_friction_in *, dfm_friction_out *) = dfm_law_eval;
dfm_status (*const signature_world_create)(dfm_context *, const dfm_world_def *,
                                           dfm_world *) = dfm_world_create;
dfm_status (*const signature_world_destroy)(dfm_world) = dfm_world_destroy;
dfm_status (*const signature_scene_load)(dfm_context *, const char *, dfm_world *) = dfm_scene_load;
dfm_status (*const signature_world_step)(dfm_world, double, uint32_t *) = dfm_world_step;
uint64_t (*const signature_world_hash)(dfm_world) = dfm_world_hash;
dfm_status (*const signature_find_body)(dfm_world, const char *, dfm_body *) = dfm_world_find_body;
dfm_status (*const signature_positions)(dfm_body, uint32_t, double *, uint32_t *) = dfm_surface_positions;
dfm_status (*const signature_contacts)(dfm_world, uint32_t, dfm_contact *, uint32_t *) = dfm_world_contacts;
dfm_status (*const signature_stream)(dfm_world, const dfm_stream_def *, void *, size_t *) = dfm_world_stream;
dfm_status (*const signature_snapshot)(dfm_world, void *, size_t *) = dfm_world_snapshot;
dfm_status (*const signature_set_model)(dfm_body, const char *, const dfm_params *) = dfm_body_set_model;
dfm_status (*const signature_restore)(dfm_world, const void *, size_t) = dfm_world_restore;
dfm_status (*const signature_query)(dfm_world, const dfm_query_shape *, const double[3], double,
                                    const dfm_query_filter *, dfm_query_hit_fn, void *) = dfm_world_query;
dfm_status (*const signature_pre_solve)(dfm_world, dfm_pre_solve_fn, void *) = dfm_world_set_pre_solve;
dfm_status (*const signature_may_touch)(dfm_world, dfm_may_touch_fn, void *) = dfm_world_set_may_touch;
dfm_status (*const signature_vertices)(dfm_body, const dfm_vertex_layout *, size_t, void *,
                                       uint32_t *) = dfm_surface_vertices;
dfm_status (*const signature_sensor)(uint64_t, uint32_t, uint64_t *, uint32_t *) = dfm_sensor_things;
