// Functions that are inline in the headers because they use sizeof of the caller's structs (lists and
// defaults), exported as symbols for callers that look functions up by name without a C compiler. Their
// structs remain those of 0.1.
//
// The inline functions of these names must not be called here: where a compiler emits one, both have a name.
#include "api/first_size.h"

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

// Returns in memory exactly the bytes of the struct of 0.1, also after the struct has grown.
#define DFM_DEFAULT_SYMBOL(type)                                                         \
  struct first_##type { alignas(type) unsigned char bytes[dfm::kFirstSize<type>]; };     \
  extern "C" DFM_API first_##type type##_symbol(void) asm(DFM_SYMBOL(#type "_default")); \
  first_##type type##_symbol(void) {                                                     \
    first_##type out;                                                                    \
    static_assert(sizeof out == dfm::kFirstSize<type> && sizeof out > 16);               \
    type##_default_sized(sizeof out, reinterpret_cast<type *>(out.bytes));               \
    return out;                                                                          \
  }
DFM_DEFAULT_SYMBOL(dfm_attach_def)
DFM_DEFAULT_SYMBOL(dfm_cut_def)
DFM_DEFAULT_SYMBOL(dfm_separate_def)
DFM_DEFAULT_SYMBOL(dfm_scene_write_def)
DFM_DEFAULT_SYMBOL(dfm_stream_def)
DFM_DEFAULT_SYMBOL(dfm_context_def)
DFM_DEFAULT_SYMBOL(dfm_world_def)
DFM_DEFAULT_SYMBOL(dfm_equilibrium_def)
DFM_DEFAULT_SYMBOL(dfm_material_def)
DFM_DEFAULT_SYMBOL(dfm_obstacle_def)
DFM_DEFAULT_SYMBOL(dfm_rigid_def)
DFM_DEFAULT_SYMBOL(dfm_tool_def)
DFM_DEFAULT_SYMBOL(dfm_body_def)
DFM_DEFAULT_SYMBOL(dfm_switch)
DFM_DEFAULT_SYMBOL(dfm_switch_rule)
DFM_DEFAULT_SYMBOL(dfm_query_shape)
DFM_DEFAULT_SYMBOL(dfm_query_filter)
DFM_DEFAULT_SYMBOL(dfm_vertex_layout)
