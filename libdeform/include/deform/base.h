/* deform/base.h -- version, export, status, hooks, context. SI units; C99, C++11 and later. Thread phrases of
 * every header: "Any thread." / "One thread at a time per world." / "Not during step." (in a callback of the
 * step: DFM_E_BUSY; a mere read may give what is there) / "Called from workers: must be re-entrant." */
#ifndef DEFORM_BASE_H
#define DEFORM_BASE_H
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include "deform/plugin.h" /* dfm_status and its values */
#ifdef __cplusplus
extern "C" {
#endif

#if defined(_WIN32)
#if defined(DEFORM_BUILDING)
#define DFM_API __declspec(dllexport)
#elif defined(DEFORM_SHARED)
#define DFM_API __declspec(dllimport)
#else
#define DFM_API
#endif
#elif defined(__GNUC__)
#define DFM_API __attribute__((visibility("default")))
#else
#define DFM_API
#endif

#define DFM_VERSION_MAJOR 0
#define DFM_VERSION_MINOR 1
#define DFM_VERSION_PATCH 0

/** Version of the library at run time.
 * @param major,minor,patch  out, each may be NULL
 * @return "0.1.0", static storage.
 * Threads: Any thread. Since 0.1. */
DFM_API const char *dfm_version(int *major, int *minor, int *patch);

/** Name of a status value, e.g. "DFM_E_ARG". Static storage. Threads: Any thread. Since 0.1. */
DFM_API const char *dfm_status_name(dfm_status s);

/** One sentence about the last call on this thread that returned a negative status or, dfm_law_eval apart,
 * DFM_DISCARD: what was wrong, where, what to do. Empty before the first. Valid until the next such call.
 * Threads: Any thread. Since 0.1. */
DFM_API const char *dfm_last_error(void);

/** For code built on the library (bindings, rigid hosts): sets the last error of this thread.
 * @return status
 * Threads: Any thread. Since 0.1. */
DFM_API dfm_status dfm_fail(dfm_status status, const char *sentence);

typedef void (*dfm_file_take_fn)(void *user, const char *bytes, size_t n);
/** For code built on the library: reads a file that the user names, with the checks that the library applies
 * to its own files. Devices and pipes are refused at once; /dev/stdin is standard input, if that is a file or
 * a pipe.
 * @param limit     bytes; a larger file is refused before anything is allocated
 * @param expected  noun for the error, with its article ("a table of queries")
 * @param take      called once with the bytes, which are borrowed until it returns; not called on failure
 * @return DFM_OK; DFM_E_ARG; DFM_E_IO; DFM_E_FORMAT larger than limit; DFM_E_NOMEM. Threads: Any
 * thread. Since 0.1. */
DFM_API dfm_status dfm_file_read(const char *path, uint64_t limit, const char *expected,
                                 dfm_file_take_fn take, void *user);
/** Writes a whole file or nothing: to a temporary file first, which is then renamed. A file or a link at path
 * is replaced; a device or a pipe is written to.
 * @return DFM_OK; DFM_E_ARG; DFM_E_IO. Threads: Any thread. Since 0.1. */
DFM_API dfm_status dfm_file_write(const char *path, const void *bytes, size_t n);

enum { DFM_LOG_DEBUG = 0, DFM_LOG_INFO = 1, DFM_LOG_WARNING = 2, DFM_LOG_ERROR = 3 };

/* ---- structs of another version ---------------------------------------------------------------------------
 * Structs that start with `size` grow at their end in later versions, except dfm_params and dfm_model_choice.
 * A compiled program works with every later library, and with an older one if it uses nothing that the older
 * one lacks:
 * - Structs that the caller fills in (defs, options): `size` is sizeof in the caller's header. Members that
 *   the caller's struct lacks have their defaults. If the caller's struct is larger than the library's, the
 *   bytes that the library does not know must be zero; else DFM_E_UNSUPPORTED. A def with a default function
 *   must be made by it: the function sets `cookie`, and a def without the cookie is DFM_E_ARG (as is one with
 *   unknown flags).
 * - Defaults: dfm_X_default is inline and passes sizeof the caller's struct to dfm_X_default_sized. That
 *   function writes exactly so many bytes: the defaults that the library knows, then zeros, and `size` as
 *   given. out NULL: nothing.
 * - Structs that the library fills in: the caller sets `size` to sizeof; the library writes at most so many
 *   bytes and sets `size` to the number written. 0 is the size of the struct in 0.1.
 * - Lists: see below.
 * The library also exports a symbol for each inline function (of deprecated.h: DFM_DEPRECATED), for callers
 * that look functions up by name without a C compiler, with the structs of 0.1 in every later version. */

typedef struct dfm_context dfm_context; /* the only pointer of the API: hooks, loaded plugins, worlds */

/** Hooks of the host. A hook that is NULL is replaced by the library's own. */
typedef struct dfm_context_def {
  uint32_t size; /* sizeof(dfm_context_def) */
  /* threads of the library's pool if parallel_for is NULL; 1 (default): no pool; 0: one per processor */
  uint32_t threads;
  void *user;                                                       /* first argument of every hook */
  void *(*alloc)(void *user, size_t bytes, size_t align);           /* NULL on failure. Any thread. */
  void (*release)(void *user, void *p, size_t bytes, size_t align); /* Any thread. */
  void (*log)(void *user, int32_t level, const char *utf8);         /* Any thread. */
  /* Runs fn over [0,n), divided at multiples of grain; returns when all parts are done. Called from the
   * stepping thread. */
  void (*parallel_for)(void *user, uint32_t n, uint32_t grain,
                       void (*fn)(void *task, uint32_t begin, uint32_t end), void *task);
  /* zones of a trace, one per stage of a step; they nest on one thread */
  void (*trace_begin)(void *user, const char *zone);
  void (*trace_end)(void *user, const char *zone);
  const char *plugin_dir; /* NULL: DEFORM_PLUGIN_PATH, then the installed or build directory */
  uint64_t cookie;        /* set by the default function */
} dfm_context_def;

/** dfm_context_def_default into a def of any size (base.h). Threads: Any thread. Since 0.1. */
DFM_API void dfm_context_def_default_sized(uint32_t size, dfm_context_def *out);
/** Defaults: no hooks, one thread. Threads: Any thread. Since 0.1. */
static inline dfm_context_def dfm_context_def_default(void) {
  dfm_context_def out;
  dfm_context_def_default_sized((uint32_t)sizeof out, &out);
  return out;
}

/** Creates a context and scans its plugin directories (opens each file once and calls only plugin
 * entries).
 * @param def  NULL: all defaults; copied
 * @param out  the context; untouched on failure
 * @return DFM_OK; DFM_E_ARG; DFM_E_NOMEM
 * Threads: Any thread. Since 0.1. */
DFM_API dfm_status dfm_context_create(const dfm_context_def *def, dfm_context **out);

/** Destroys the context with all its worlds, laws and scenes; their handles become stale. NULL is allowed.
 * Threads: Any thread, with no call on this context running. Since 0.1. */
DFM_API void dfm_context_destroy(dfm_context *context);

/* ---- plugins of a context ------------------------------------------------------------------------------ */

/** Loads one plugin file (symlinks are followed).
 * @return DFM_OK; DFM_E_IO no such file; DFM_E_UNSUPPORTED not a plugin or another ABI (sentence says which);
 * DFM_E_STATE an id is taken
 * Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_plugin_load(dfm_context *context, const char *path);

/** Loads every plugin of a directory; dfm_plugin_visit_passed lists the files that were skipped, with
 * reasons.
 * @param loaded  out, number of plugins loaded now; may be NULL
 * Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_plugin_scan(dfm_context *context, const char *directory, uint32_t *loaded);

/** Registers a plugin that is linked into the application (its entry is dfm_plugin_entry_NAME).
 * Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_plugin_register_static(dfm_context *context, dfm_plugin_fn entry, const char *name);

typedef void (*dfm_plugin_visit_fn)(void *user, const dfm_type *type, const char *file);
typedef void (*dfm_plugin_passed_fn)(void *user, const char *file, const char *reason);

/** Calls visit for every type that the context knows, ordered by kind and id; file is "static:NAME" for
 * registered ones.
 * Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_plugin_visit(dfm_context *context, dfm_plugin_visit_fn visit, void *user);

/** Calls visit for every file that was skipped, with the reason in one sentence.
 * Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_plugin_visit_passed(dfm_context *context, dfm_plugin_passed_fn visit, void *user);

/** The plugin that the calling thread is executing: lets a handler of a signal or of the end of the process
 * name it.
 * @param what  out, the call ("eval", "create", "load"), or NULL if there is none; the parameter may be NULL
 * @return the id of the type, the file while it is being loaded, or NULL if the thread is in no plugin; valid
 * during that call
 * Threads: Any thread, and from a handler of a signal. Since 0.1. */
DFM_API const char *dfm_plugin_running(const char **what);

/* ---- lists of structs -------------------------------------------------------------------------------------
 * Rows of a list grow at their end in later versions, as structs that start with their size do. A function
 * that fills a list, such as dfm_world_contacts, is inline and passes sizeof the caller's row to the
 * library's function, whose name ends in _sized:
 * - a caller with an older header than the library gets rows of its own size, without the newer members;
 * - a caller with a newer header gets the members that the library knows, and zeros after them.
 * If a row starts with `size`, that is the number of bytes that the library has written.
 * row_size is a multiple of 8, at least 8; else DFM_E_ARG. */

/* ---- parameters by key --------------------------------------------------------------------------------- */
typedef struct {
  const char *key;
  const double *value;
  uint32_t width;
} dfm_param_value;
/* A member of defs; it does not grow in later versions. */
typedef struct {
  uint32_t size, n;
  const dfm_param_value *values;
} dfm_params;

#ifdef __cplusplus
}
#endif
#endif
