/* deform/base.h -- version, export, status, hooks, context. SI units; C99 and later, C++11 and later. Thread
 * phrases used in every header: "Any thread." / "One thread at a time per world." / "Not during step." /
 * "Called from workers: must be re-entrant." */
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

/** The sentence that belongs to the last call on this thread that returned a negative status: what was wrong,
 * where, what to do. Empty when no call has failed. Valid until the next failing call on this thread.
 * Threads: Any thread. Since 0.1. */
DFM_API const char *dfm_last_error(void);

/** For what is built on the library (bindings, rigid hosts): makes a sentence the last error of this thread.
 * @return status
 * Threads: Any thread. Since 0.1. */
DFM_API dfm_status dfm_fail(dfm_status status, const char *sentence);

typedef void (*dfm_file_take_fn)(void *user, const char *bytes, size_t n);
/** For what is built on the library: the bytes of a file that somebody names, read as the library reads its
 * own. Devices and pipes are refused at once instead of being waited for; /dev/stdin is standard input, if
 * that is a file or a pipe.
 * @param limit     bytes that such a file may have; a larger one is refused before anything is allocated
 * @param expected  what is wanted, with its article ("a table of queries"), for the sentence
 * @param take      called once with the bytes, which are borrowed until it returns; not called on failure
 * @return DFM_OK; DFM_E_ARG; DFM_E_IO; DFM_E_FORMAT larger than limit; DFM_E_NOMEM. Threads: Any
 * thread. Since 0.1. */
DFM_API dfm_status dfm_file_read(const char *path, uint64_t limit, const char *expected,
                                 dfm_file_take_fn take, void *user);
/** Writes a file whole or not at all: under no name or another name first, then renamed. What stood at path
 * before, a link included, is replaced; a device or a pipe is written to.
 * @return DFM_OK; DFM_E_ARG; DFM_E_IO. Threads: Any thread. Since 0.1. */
DFM_API dfm_status dfm_file_write(const char *path, const void *bytes, size_t n);

enum { DFM_LOG_DEBUG = 0, DFM_LOG_INFO = 1, DFM_LOG_WARNING = 2, DFM_LOG_ERROR = 3 };

/* ---- structs of another version ---------------------------------------------------------------------------
 * Structs that start with `size` grow at their end in later versions (but those of which it is said that they
 * do not: dfm_params, dfm_model_choice). A program goes on with every later library as it was built, and with
 * an older one as long as it asks for nothing that this does not have:
 * - What a caller fills in (defs, options): `size` is sizeof in the caller's header. Members that this lacks
 *   have their defaults. Where it is larger than the library's struct, what the library does not know must
 *   be zero; else DFM_E_UNSUPPORTED. A def that has a default function comes from it: it sets `cookie`, and a
 *   def without that is DFM_E_ARG (as is one with flags that are not known).
 * - Defaults: dfm_X_default is inline and hands sizeof the caller's struct to dfm_X_default_sized, which
 *   writes that many bytes and no more: the defaults that the library knows, zero behind them, `size` as
 *   given. out NULL: nothing.
 * - What the library fills in: the caller sets `size` to sizeof; the library writes so many bytes at most and
 *   leaves in `size` how many it has filled in. 0 is the size that the struct had in 0.1.
 * - Lists: further down.
 * The library also has a symbol for each of the inline functions, for callers that look functions up by name
 * without a C compiler: it answers structs as they are in 0.1, in every later version too. */

typedef struct dfm_context dfm_context; /* the only pointer of the API: hooks, loaded plugins, worlds */

/** What a host may lend to the library. Every hook may be NULL: then the library's own is used. */
typedef struct dfm_context_def {
  uint32_t size; /* sizeof(dfm_context_def) */
  /* size of the own pool where parallel_for is NULL; 1 (default): no pool; 0: one per processor */
  uint32_t threads;
  void *user;                                                       /* first argument of every hook */
  void *(*alloc)(void *user, size_t bytes, size_t align);           /* NULL on failure. Any thread. */
  void (*release)(void *user, void *p, size_t bytes, size_t align); /* Any thread. */
  void (*log)(void *user, int32_t level, const char *utf8);         /* Any thread. */
  /* Runs fn over [0,n), cut at multiples of grain; returns when all is done. Called from the
   * stepping thread. */
  void (*parallel_for)(void *user, uint32_t n, uint32_t grain,
                       void (*fn)(void *task, uint32_t begin, uint32_t end), void *task);
  /* stage zones of a step; same thread nests */
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

/** Creates a context and scans its plugin directories (nothing is opened twice, nothing runs but
 * plugin entries).
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

/** Loads every plugin of a directory; files passed over are kept with their reason (dfm_plugin_visit_passed).
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

/** Calls visit for every file that discovery passed over, with the reason in one sentence.
 * Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_plugin_visit_passed(dfm_context *context, dfm_plugin_passed_fn visit, void *user);

/** Which plugin the calling thread is in: for a handler of a signal or of the end of the process, which
 * can then name it.
 * @param what  out, what it was asked for ("eval", "create", "load"), or NULL where none; the
 * parameter may be NULL
 * @return the id of the type, the file while it is loaded, or NULL where the thread is in none; valid while
 * that call lasts
 * Threads: Any thread, and from a handler of a signal. Since 0.1. */
DFM_API const char *dfm_plugin_running(const char **what);

/* ---- lists of structs -------------------------------------------------------------------------------------
 * Rows of a list grow at their end in later versions, as structs that start with their size do. The function
 * that fills a list, dfm_world_contacts for one, is inline and hands sizeof the row of the caller's header to
 * the library's function, whose name ends in _sized:
 * - a caller with an older header than the library gets rows of its own size, without the newer members;
 * - a caller with a newer header gets the members that the library knows, and zero in those behind.
 * Where a row starts with `size`, that is the number of bytes that the library has filled in.
 * row_size is a multiple of 8, at least 8; else DFM_E_ARG. */

/* ---- parameters by key --------------------------------------------------------------------------------- */
typedef struct {
  const char *key;
  const double *value;
  uint32_t width;
} dfm_param_value;
/* Stands in defs, and is the same in every version. */
typedef struct {
  uint32_t size, n;
  const dfm_param_value *values;
} dfm_params;

#ifdef __cplusplus
}
#endif
#endif
