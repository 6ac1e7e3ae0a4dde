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

/** Options of dfm_scene_open. */
typedef struct dfm_scene_options {
  uint32_t size, nset;
  const char *const *set; /* [nset] "/json/pointer=value": value is JSON, or a bare string */
  /* 0: none. Positions +-1e-3 of the body's size, angles +-0.5 degrees, velocities +-1 % */
  uint64_t jitter_seed;
} dfm_scene_options;
/** Loads a scene with options (NULL: none), and keeps what a runner needs: duration, step, output, probes.
 * Errors as dfm_scene_load. Threads: Not during step. Since 0.1. */
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
/** Settings of a scene that a runner needs. */
typedef struct dfm_scene_settings {
  uint32_t size, nprobe;        /* nprobe: number of probes */
  double duration, step, every; /* s; step 0: "auto", the stable step; every: between records */
  /* "output": pictures, states/, nodes/, contacts.csv; check for crossings in every step */
  bool frames, states, nodes, contacts, check;
  const char *color;         /* "body" "contact" "speed" "displacement" "stress" */
  double eye[3], look_at[3]; /* m, world; of the camera, if has_camera */
  bool has_camera;
} dfm_scene_settings;
/** @return DFM_OK; DFM_E_HANDLE. Threads: Any thread. Not during step. Since 0.1. */
DFM_API dfm_status dfm_scene_get_settings(dfm_scene scene, dfm_scene_settings *out);
/** Position, m, and velocity, m/s, of a probe: fixed weights on the points of the cell (or nearest cell) that
 * contained its point at rest; NaN once a cut has taken the cell.
 * @param probe 0 .. nprobe - 1. @return DFM_OK; DFM_E_ARG no such probe; DFM_E_HANDLE.
 * Threads: Any thread. Not during step. Since 0.1. */
DFM_API dfm_status dfm_scene_probe(dfm_scene scene, uint32_t probe, const char **name, double position[3],
                                   double velocity[3]);

/** dfm_scene_write_def.flags. SNAPSHOT: also writes the bytes of dfm_world_snapshot to
 * STEM_files/snapshot.state; `deform run SCENE --from STEM_files/snapshot.state` continues with the same
 * bits. PARTIAL: leaves out what a scene cannot express, and reports it. */
enum { DFM_SCENE_SNAPSHOT = 1, DFM_SCENE_PARTIAL = 2 };
/** Options of dfm_world_write_scene. Since 0.1. */
typedef struct dfm_scene_write_def {
  uint32_t size, flags; /* flags: DFM_SCENE_* */
  double duration;      /* s, of the scene, from the time of the world; 1 */
  double step;          /* s, of the scene; 0: dfm_world_def.step, or "auto" if that is 0 */
  /* called with one sentence, valid during the call, for each thing that a scene cannot express and for each
   * plugin that is not shipped with the library; NULL: the sentences go to the log hook as warnings. It must
   * not call the library */
  void (*note)(void *user, const char *sentence);
  void *user;      /* first argument of note */
  uint64_t cookie; /* set by the default function */
} dfm_scene_write_def;
/** dfm_scene_write_def_default into a def of any size (base.h). Threads: Any thread. Since 0.1. */
DFM_API void dfm_scene_write_def_default_sized(uint32_t size, dfm_scene_write_def *out);
/** One second, the world's step, no flags, sentences to the log. Threads: Any thread. Since 0.1. */
static inline dfm_scene_write_def dfm_scene_write_def_default(void) {
  dfm_scene_write_def out;
  dfm_scene_write_def_default_sized((uint32_t)sizeof out, &out);
  return out;
}
/** Writes a world as a scene from which `deform run` and dfm_scene_load continue: bodies (rest mesh, present
 * points and velocities, material, model, held points and motions), obstacles, rigid bodies, friction,
 * filters, attachments, settings, the time. A world with something that a scene cannot express (a callback,
 * rigid bodies of a host's own world, ...: doc/concepts/write_scene.md) is refused and nothing is written;
 * with DFM_SCENE_PARTIAL the rest is written.
 * @param path   a file whose name ends in .json; meshes and states go to the folder STEM_files beside it
 * @param def    NULL: the default
 * @param notes  out, number of things that a scene cannot express, refused or not; may be NULL
 * @return DFM_OK; DFM_E_UNSUPPORTED something that a scene cannot express (the error names it); DFM_E_ARG the
 * path, a name that a scene cannot have, a value out of range; DFM_E_IO cannot be written there (the scene
 * file is written last and is unchanged); DFM_E_HANDLE; DFM_E_NOMEM. Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_world_write_scene(dfm_world world, const char *path, const dfm_scene_write_def *def,
                                         uint32_t *notes);
/** dfm_world_write_scene for the world of a scene, with what the scene has beside its world: "probes",
 * "output" and "time"/"mode". "accuracy" and "budget" are not written, since the world has what they chose. A
 * probe whose cell is gone is something that a scene cannot say; one whose cell is in a piece is the piece's.
 * @param def  NULL: no flags, the scene's duration; a step of 0 is the scene's
 * @return as dfm_world_write_scene. Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_scene_write(dfm_scene scene, const char *path, const dfm_scene_write_def *def,
                                   uint32_t *notes);
#ifdef __cplusplus
}
#endif
#endif
