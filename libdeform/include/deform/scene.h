/* deform/scene.h -- JSON scenes (schema: deform-scene.schema.json). */
#ifndef DEFORM_SCENE_H
#define DEFORM_SCENE_H
#include "deform/base.h"
#include "deform/id.h"
#ifdef __cplusplus
extern "C" {
#endif
/** Loads a scene file into a new world.
 * @return DFM_OK; DFM_E_IO; DFM_E_FORMAT not JSON (line, column); DFM_E_ARG (JSON pointer, key, what was
 * expected, nearest valid name);
 *         DFM_E_UNSUPPORTED "not available yet: POINTER". Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_scene_load(dfm_context *context, const char *path, dfm_world *out);

/** A scene that keeps what only a runner needs: duration, step, output, probes. */
typedef struct dfm_scene_options {
  uint32_t size, nset;
  const char *const *set; /* [nset] "/json/pointer=value": value is JSON, or a bare string */
  /* 0: none. Positions +-1e-3 of the body's size, angles +-0.5 degrees, velocities +-1 % */
  uint64_t jitter_seed;
} dfm_scene_options;
/** Loads a scene with options (NULL: none); errors as dfm_scene_load. Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_scene_open(dfm_context *context, const char *path, const dfm_scene_options *options,
                                  dfm_scene *out);
/** Closes the scene and destroys its world. @return DFM_OK; DFM_E_HANDLE. Threads: Not during
 * step. Since 0.1. */
DFM_API dfm_status dfm_scene_close(dfm_scene scene);
/** The scene's world, which lives as long as the scene. @return DFM_OK; DFM_E_HANDLE. Threads: Any thread.
 * Not during step. Since 0.1. */
DFM_API dfm_status dfm_scene_world(dfm_scene scene, dfm_world *out);
/** Any value of the scene after defaults and --set, as JSON text; pointer as in RFC 6901, e.g.
 * "/output/camera/eye". text NULL: *bytes gets the size needed. @return DFM_E_ARG nothing there. Threads: Any
 * thread. Not during step. Since 0.1. */
DFM_API dfm_status dfm_scene_value(dfm_scene scene, const char *pointer, char *text, size_t *bytes);
/** What a runner needs most. */
typedef struct dfm_scene_settings {
  uint32_t size, nprobe;        /* nprobe: number of probes */
  double duration, step, every; /* s; step 0: "auto", the stable step; every: between records */
  /* "output": pictures, states/, nodes/, contacts.csv; crossings looked for in every step */
  bool frames, states, nodes, contacts, check;
  const char *color;         /* "body" "contact" "speed" "displacement" "stress" */
  double eye[3], look_at[3]; /* m, world; of the camera, where has_camera */
  bool has_camera;
} dfm_scene_settings;
/** @return DFM_OK; DFM_E_HANDLE. Threads: Any thread. Not during step. Since 0.1. */
DFM_API dfm_status dfm_scene_get_settings(dfm_scene scene, dfm_scene_settings *out);
/** Position, m, and velocity, m/s, of a probe: fixed weights on the cell (or nearest cell) that held its
 * point at rest.
 * @param probe 0 .. nprobe - 1. @return DFM_OK; DFM_E_ARG no such probe; DFM_E_HANDLE.
 * Threads: Any thread. Not during step. Since 0.1. */
DFM_API dfm_status dfm_scene_probe(dfm_scene scene, uint32_t probe, const char **name, double position[3],
                                   double velocity[3]);
#ifdef __cplusplus
}
#endif
#endif
