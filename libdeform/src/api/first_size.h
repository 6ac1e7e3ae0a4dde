// Sizes of the structs of the C API in 0.1, because sizeof grows with the structs. A caller that gives no
// size has these, and so do the symbols for callers without a C compiler.
#pragma once
#include <cstddef>
#include <cstdint>

#include "deform/deform.h"

namespace dfm {

template <class T>
inline constexpr uint32_t kFirstSize = 0;
template <class T>
inline constexpr const char *kStructName = "def";

// last: the last member of the struct in 0.1; must never change.
#define DFM_ENDED_WITH(type, last)                                                              \
  template <>                                                                                   \
  inline constexpr uint32_t kFirstSize<type> =                                                  \
      (offsetof(type, last) + sizeof(static_cast<type *>(nullptr)->last) + alignof(type) - 1) / \
      alignof(type) * alignof(type);                                                            \
  template <>                                                                                   \
  inline constexpr const char *kStructName<type> = #type;
DFM_ENDED_WITH(dfm_attach_def, cookie)
DFM_ENDED_WITH(dfm_attachment, stretch)
DFM_ENDED_WITH(dfm_memory, total)
DFM_ENDED_WITH(dfm_context_def, plugin_dir)
DFM_ENDED_WITH(dfm_world_def, step)
DFM_ENDED_WITH(dfm_equilibrium_def, reserved)
DFM_ENDED_WITH(dfm_material_def, extra)
DFM_ENDED_WITH(dfm_obstacle_def, reserved2)
DFM_ENDED_WITH(dfm_rigid_def, user)
DFM_ENDED_WITH(dfm_body_def, reserved)
DFM_ENDED_WITH(dfm_cut_def, cookie)
DFM_ENDED_WITH(dfm_cut_info, elastic)
DFM_ENDED_WITH(dfm_separate_def, cookie)
DFM_ENDED_WITH(dfm_surface_def, support)
DFM_ENDED_WITH(dfm_surface_groups, group)
DFM_ENDED_WITH(dfm_switch, max_jump)
DFM_ENDED_WITH(dfm_switch_rule, max_jump)
DFM_ENDED_WITH(dfm_body_info, user)
DFM_ENDED_WITH(dfm_law_info, params)
DFM_ENDED_WITH(dfm_equilibrium_info, residual)
DFM_ENDED_WITH(dfm_body_measure, contact_impulse)
DFM_ENDED_WITH(dfm_world_stats, energy_gain)
DFM_ENDED_WITH(dfm_mesh_info, group_points)
DFM_ENDED_WITH(dfm_vertex_layout, origin)
DFM_ENDED_WITH(dfm_query_shape, points)
DFM_ENDED_WITH(dfm_query_filter, user)
DFM_ENDED_WITH(dfm_query_hit, normal)
DFM_ENDED_WITH(dfm_query_hits, out)
DFM_ENDED_WITH(dfm_scene_settings, has_camera)
DFM_ENDED_WITH(dfm_scene_write_def, cookie)
DFM_ENDED_WITH(dfm_stream_def, cookie)
DFM_ENDED_WITH(dfm_tool_def, cookie)
DFM_ENDED_WITH(dfm_tool_state, port_work)
#undef DFM_ENDED_WITH

}  // namespace dfm
