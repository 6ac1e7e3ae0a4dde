// The defaults of defs, and what is inline in the headers because it uses sizeof of the caller's structs
// (lists and defaults), exported as symbols for callers that look functions up by name without a C compiler.
// Their structs remain those of 0.1.
//
// The inline functions of these names must not be called here: where a compiler emits one, both have a name.
#include "api/structs.h"

#define DFM_TEXT(x) #x
#define DFM_PREFIX(prefix) DFM_TEXT(prefix)
#define DFM_SYMBOL(name) DFM_PREFIX(__USER_LABEL_PREFIX__) name

// bytes: size of a row in 0.1.
#define DFM_LIST_SYMBOL(name, row, bytes)                                               \
  extern "C" DFM_API dfm_status name##_symbol(dfm_world, uint32_t, row *,               \
                                              uint32_t *) asm(DFM_SYMBOL(#name));       \
  dfm_status name##_symbol(dfm_world world, uint32_t capacity, row *out, uint32_t *n) { \
    return name##_sized(world, bytes, capacity, out, n);                                \
  }
DFM_LIST_SYMBOL(dfm_world_contacts, dfm_contact, 192)
DFM_LIST_SYMBOL(dfm_world_pairs, dfm_pair_report, 128)
DFM_LIST_SYMBOL(dfm_world_pair_impulses, dfm_pair_impulse, 104)
DFM_LIST_SYMBOL(dfm_world_events, dfm_contact_event, 40)
DFM_LIST_SYMBOL(dfm_world_overlaps, dfm_overlap, 40)
DFM_LIST_SYMBOL(dfm_world_profile, dfm_stage_time, 24)
DFM_LIST_SYMBOL(dfm_world_swaps, dfm_swap, 64)

// The members that are not zero. type_default() returns in memory exactly the bytes of the struct of 0.1,
// also after the struct has grown.
#define DFM_DEFAULT(type, ...)                                                                              \
  void type##_default_sized(uint32_t size, type *out) { dfm::write_default(size, out, type{__VA_ARGS__}); } \
  struct first_##type { alignas(type) unsigned char bytes[dfm::kFirstSize<type>]; };                        \
  extern "C" DFM_API first_##type type##_symbol(void) asm(DFM_SYMBOL(#type "_default"));                    \
  first_##type type##_symbol(void) {                                                                        \
    first_##type out;                                                                                       \
    static_assert(sizeof out == dfm::kFirstSize<type> && sizeof out > 16);                                  \
    type##_default_sized(sizeof out, reinterpret_cast<type *>(out.bytes));                                  \
    return out;                                                                                             \
  }
#pragma GCC diagnostic ignored "-Wmissing-field-initializers"
#define DFM_CHOICE \
  { .size = sizeof(dfm_model_choice), .params = {.size = sizeof(dfm_params)} }
DFM_DEFAULT(dfm_attach_def, )
DFM_DEFAULT(dfm_cut_def, .pose = {{}, {0, 0, 0, 1}})
DFM_DEFAULT(dfm_separate_def, .least_cells = 1)
DFM_DEFAULT(dfm_scene_write_def, .duration = 1)
DFM_DEFAULT(dfm_stream_def, .kind = DFM_STREAM_FRAME)
DFM_DEFAULT(dfm_context_def, .threads = 1)
DFM_DEFAULT(dfm_world_def, .gravity = {0, 0, -9.81}, .max_sweeps = 200, .max_passes = 20,
            .max_substeps = 10000, .sleep_speed = 0.01, .sleep_time = 0.5, .energy_watch = 0.01)
DFM_DEFAULT(dfm_equilibrium_def, .load_steps = 1, .load_to = 1)
DFM_DEFAULT(dfm_material_def, .density = 1000, .young = 1e5, .poisson = 0.3)
DFM_DEFAULT(dfm_obstacle_def, .half_size = {0.5, 0.5, 0.5}, .radius = 0.5, .half_length = 0.5, .category = 1,
            .collides_with = ~0u)
DFM_DEFAULT(dfm_rigid_def, .shape = DFM_SHAPE_SPHERE, .half_size = {0.5, 0.5, 0.5}, .radius = 0.5,
            .half_length = 0.5, .mass = 1, .category = 1, .collides_with = ~0u)
DFM_DEFAULT(dfm_tool_def, .radius = 0.005, .mass = 0.05, .inertia = 1e-5, .category = 1, .collides_with = ~0u)
DFM_DEFAULT(dfm_body_def, .category = 1, .collides_with = ~0u)
DFM_DEFAULT(dfm_switch, .integrator = DFM_INTEGRATOR_AUTO, .params = {.size = sizeof(dfm_params)})
DFM_DEFAULT(dfm_switch_rule, .touching = DFM_CHOICE, .near_by = DFM_CHOICE, .otherwise = DFM_CHOICE,
            .hysteresis = 0.1, .wait = 0.1)
DFM_DEFAULT(dfm_query_shape, .shape = DFM_SHAPE_SPHERE)
DFM_DEFAULT(dfm_query_filter, .what = DFM_QUERY_BODIES | DFM_QUERY_OBSTACLES | DFM_QUERY_RIGIDS,
            .category = ~0u, .collides_with = ~0u)
DFM_DEFAULT(dfm_vertex_layout, .stride = 24, .normal = 12, .velocity = DFM_VERTEX_NONE,
            .displacement = DFM_VERTEX_NONE, .stick = DFM_VERTEX_NONE)
