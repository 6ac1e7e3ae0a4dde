/* deform/id.h -- handles. A handle is a 64-bit value {generation:24, kind:8, index+1:32}; zero is null. It
 * resolves through one process-wide table, so a stale handle, or one of the wrong kind, is an error
 * (DFM_E_HANDLE) in release builds too. */
#ifndef DEFORM_ID_H
#define DEFORM_ID_H
#include <stdint.h>
#ifdef __cplusplus
extern "C" {
#endif
typedef uint64_t dfm_world;
typedef uint64_t dfm_body;
typedef uint64_t dfm_obstacle;
typedef uint64_t dfm_material;
typedef uint64_t dfm_law;
typedef uint64_t dfm_scene;
typedef uint64_t dfm_tetmesh;
typedef uint64_t dfm_trimesh;
typedef uint64_t dfm_rigid; /* names a dfm_obstacle too */
#ifdef __cplusplus
}
#endif
#endif
