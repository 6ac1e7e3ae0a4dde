/* deform/id.h -- handles. A handle is a 64-bit value {generation:24, kind:8, index+1:32}; zero is null. It
 * resolves through one process-wide table. A null or stale handle, or one of the wrong kind, is an error
 * (DFM_E_HANDLE) in release builds too, and the sentence of dfm_last_error() names both kinds. All kinds
 * have one C type, so that reports hold bodies and obstacles in one member; deform.hpp gives each a class
 * of its own. */
#ifndef DEFORM_ID_H
#define DEFORM_ID_H
#include "deform/base.h"
#ifdef __cplusplus
extern "C" {
#endif
typedef uint64_t dfm_world;
typedef uint64_t dfm_body;
typedef uint64_t dfm_obstacle;
typedef uint64_t dfm_material;
typedef uint64_t dfm_law;
typedef uint64_t dfm_scene;
typedef uint64_t dfm_mesh_handle; /* dfm_mesh is what a model gets: plugin.h */
typedef uint64_t dfm_rigid;       /* names a dfm_obstacle too */
typedef uint64_t dfm_tool;

/** What a handle refers to. All values but RIGID are the kind in the handle; a dfm_rigid has that of an
 * obstacle there. */
enum {
  DFM_HANDLE_NONE = 0,
  DFM_HANDLE_WORLD = 1,
  DFM_HANDLE_BODY = 2,
  DFM_HANDLE_OBSTACLE = 3,
  DFM_HANDLE_MATERIAL = 4,
  DFM_HANDLE_LAW = 5,
  DFM_HANDLE_SCENE = 6,
  DFM_HANDLE_MESH = 7,
  DFM_HANDLE_RIGID = 9,
  DFM_HANDLE_TOOL = 10
};
/** Kind of what a handle refers to: for members that hold a body or an obstacle, as dfm_pair_report.b does.
 * @return DFM_HANDLE_*; DFM_HANDLE_NONE for a null, stale or made-up handle. Threads: Any thread. Not during
 * step. Since 0.1. */
DFM_API uint32_t dfm_handle_kind(uint64_t handle);
#ifdef __cplusplus
}
#endif
#endif
