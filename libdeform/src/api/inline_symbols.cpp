// Functions that are inline in the headers because they use sizeof of the caller's structs (lists and
// defaults), exported as symbols for callers that look functions up by name without a C compiler. Their
// structs remain those of 0.1.
//
// In this file the headers' inline functions have other names.
#define dfm_world_contacts contacts_inline
#define dfm_world_pairs pairs_inline
#define dfm_world_pair_impulses pair_impulses_inline
#define dfm_world_events events_inline
#define dfm_world_overlaps overlaps_inline
#define dfm_world_profile profile_inline
#define dfm_world_swaps swaps_inline
#define dfm_attach_def_default attach_def_inline
#define dfm_cut_def_default cut_def_inline
#define dfm_separate_def_default separate_def_inline
#define dfm_scene_write_def_default scene_write_def_inline
#define dfm_stream_def_default stream_def_inline
#define dfm_context_def_default context_def_inline
#define dfm_world_def_default world_def_inline
#define dfm_equilibrium_def_default equilibrium_def_inline
#define dfm_material_def_default material_def_inline
#define dfm_obstacle_def_default obstacle_def_inline
#define dfm_rigid_def_default rigid_def_inline
#define dfm_tool_def_default tool_def_inline
#define dfm_body_def_default body_def_inline
#define dfm_switch_default switch_inline
#define dfm_switch_rule_default switch_rule_inline
#define dfm_query_shape_default query_shape_inline
#define dfm_query_filter_default query_filter_inline
#define dfm_vertex_layout_default vertex_layout_inline
#include "api/first_size.h"
#undef dfm_world_contacts
#undef dfm_world_pairs
#undef dfm_world_pair_impulses
#undef dfm_world_events
#undef dfm_world_overlaps
#undef dfm_world_profile
#undef dfm_world_swaps
#undef dfm_attach_def_default
#undef dfm_cut_def_default
#undef dfm_separate_def_default
#undef dfm_scene_write_def_default
#undef dfm_stream_def_default
#undef dfm_context_def_default
#undef dfm_world_def_default
#undef dfm_equilibrium_def_default
#undef dfm_material_def_default
#undef dfm_obstacle_def_default
#undef dfm_rigid_def_default
#undef dfm_tool_def_default
#undef dfm_body_def_default
#undef dfm_switch_default
#undef dfm_switch_rule_default
#undef dfm_query_shape_default
#undef dfm_query_filter_default
#undef dfm_vertex_layout_default

// bytes: size of a row in 0.1.
#define DFM_LIST_SYMBOL(name, row, bytes)                                                         \
  extern "C" DFM_API dfm_status name(dfm_world world, uint32_t capacity, row *out, uint32_t *n) { \
    return name##_sized(world, bytes, capacity, out, n);                                          \
  }
DFM_LIST_SYMBOL(dfm_world_contacts, dfm_contact, 192)
DFM_LIST_SYMBOL(dfm_world_pairs, dfm_pair_report, 128)
DFM_LIST_SYMBOL(dfm_world_pair_impulses, dfm_pair_impulse, 104)
DFM_LIST_SYMBOL(dfm_world_events, dfm_contact_event, 40)
DFM_LIST_SYMBOL(dfm_world_overlaps, dfm_overlap, 40)
DFM_LIST_SYMBOL(dfm_world_profile, dfm_stage_time, 24)
DFM_LIST_SYMBOL(dfm_world_swaps, dfm_swap, 64)

// Returns in memory exactly the bytes of the struct of 0.1, also after the struct has grown.
#define DFM_DEFAULT_SYMBOL(type)                                                     \
  struct first_##type { alignas(type) unsigned char bytes[dfm::kFirstSize<type>]; }; \
  extern "C" DFM_API first_##type type##_default(void) {                             \
    first_##type out;                                                                \
    static_assert(sizeof out == dfm::kFirstSize<type> && sizeof out > 16);           \
    type##_default_sized(sizeof out, reinterpret_cast<type *>(out.bytes));           \
    return out;                                                                      \
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
