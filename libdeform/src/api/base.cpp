#include "deform/base.h"

#include <algorithm>

#include "api/objects.h"
#include "core/file.h"
#include "plugin/context.h"

using namespace dfm;

namespace {

dfm_context_def checked(const dfm_context_def *given) {
  if (given && given->size < offsetof(dfm_context_def, alloc))
    fail(DFM_E_ARG, "dfm_context_def.size is %u; start from dfm_context_def_default()", given->size);
  const dfm_context_def def = take_def(given, dfm_context_def_default());
  if (!def.alloc != !def.release)
    fail(DFM_E_ARG, "set both hooks alloc and release, or neither; %s is missing",
         def.alloc ? "release" : "alloc");
  if (!def.trace_begin != !def.trace_end)
    fail(DFM_E_ARG, "set both hooks trace_begin and trace_end, or neither");
  if (def.threads > 1024)
    fail(DFM_E_ARG, "threads is %u, at most 1024 expected (0: one per processor)", def.threads);
  return def;
}

}  // namespace

const char *dfm_version(int *major, int *minor, int *patch) {
  if (major) *major = DFM_VERSION_MAJOR;
  if (minor) *minor = DFM_VERSION_MINOR;
  if (patch) *patch = DFM_VERSION_PATCH;
#define DFM_TEXT_(x) #x
#define DFM_TEXT(x) DFM_TEXT_(x)
  return DFM_TEXT(DFM_VERSION_MAJOR) "." DFM_TEXT(DFM_VERSION_MINOR) "." DFM_TEXT(DFM_VERSION_PATCH);
}

const char *dfm_status_name(dfm_status s) {
  switch (s) {
    case DFM_OK: return "DFM_OK";
    case DFM_DISCARD: return "DFM_DISCARD";
    case DFM_E_ARG: return "DFM_E_ARG";
    case DFM_E_NOMEM: return "DFM_E_NOMEM";
    case DFM_E_UNSUPPORTED: return "DFM_E_UNSUPPORTED";
    case DFM_E_STATE: return "DFM_E_STATE";
    case DFM_E_FATAL: return "DFM_E_FATAL";
    case DFM_E_HANDLE: return "DFM_E_HANDLE";
    case DFM_E_IO: return "DFM_E_IO";
    case DFM_E_FORMAT: return "DFM_E_FORMAT";
    case DFM_E_DIVERGED: return "DFM_E_DIVERGED";
    case DFM_E_BUSY: return "DFM_E_BUSY";
  }
  return "unknown status";
}

const char *dfm_last_error(void) { return last_error(); }

dfm_status dfm_fail(dfm_status status, const char *sentence) {
  set_last_error(sentence ? sentence : "");
  return status;
}

dfm_status dfm_file_read(const char *path, uint64_t limit, const char *expected, dfm_file_take_fn take,
                         void *user) {
  return as_status([&] {
    if (!path || !*path || !expected || !take)
      fail(DFM_E_ARG, "dfm_file_read: path is empty, or path, expected or take is NULL");
    const Array<char> bytes = read_whole_file(Memory::standard(), path, limit, expected);
    take(user, bytes.data(), bytes.size());
  });
}

dfm_status dfm_file_write(const char *path, const void *bytes, size_t n) {
  return as_status([&] {
    if (!path || !*path || (n && !bytes))
      fail(DFM_E_ARG, "dfm_file_write: path is empty, or path or bytes is NULL");
    AtomicFile file(path);
    file.write(bytes, n);
    file.commit();
  });
}

dfm_status dfm_context_create(const dfm_context_def *def, dfm_context **out) {
  return as_status([&] {
    need(out, "out");
    auto context = std::make_unique<dfm_context>(checked(def));
    context->loader.add_bundled();
    if (context->hooks.plugin_dir) {
      try {
        context->loader.scan(context->hooks.plugin_dir);
      } catch (const Error &e) {
        fail(DFM_E_ARG, "plugin_dir: %s", e.what());
      }
      context->hooks.plugin_dir = nullptr;  // the caller's string need not outlive this call
    } else {
      context->loader.discover();
    }
    *out = context.release();
  });
}

void dfm_context_destroy(dfm_context *context) {
  if (!context) return;
  if (context->calls != 0 || context->ending.exchange(true)) {
    set_last_error(
        "dfm_context_destroy was called by a hook, plugin or host inside another call of this context; "
        "nothing was destroyed; call it after that call has returned");
    context->log(DFM_LOG_ERROR, last_error());
    return;
  }
  delete context;
}

dfm_status dfm_plugin_load(dfm_context *context, const char *path) {
  return as_status([&] {
    if (!path || !*path) fail(DFM_E_ARG, "dfm_plugin_load: the path is empty");
    exclusive(require(context)).loader.load(path);
  });
}

dfm_status dfm_plugin_scan(dfm_context *context, const char *directory, uint32_t *loaded) {
  return as_status([&] {
    if (!directory || !*directory) fail(DFM_E_ARG, "dfm_plugin_scan: the directory is empty");
    const uint32_t n = exclusive(require(context)).loader.scan(directory);
    if (loaded) *loaded = n;
  });
}

dfm_status dfm_plugin_register_static(dfm_context *context, dfm_plugin_fn entry, const char *name) {
  return as_status([&] {
    if (!entry || !name || !*name) fail(DFM_E_ARG, "dfm_plugin_register_static: entry and name are needed");
    exclusive(require(context)).loader.add_static(entry, name);
  });
}

dfm_status dfm_plugin_visit(dfm_context *context, dfm_plugin_visit_fn visit, void *user) {
  return as_status([&] {
    if (!visit) fail(DFM_E_ARG, "dfm_plugin_visit: visit is NULL");
    const Registry &registry = used(require(context)).registry;
    for (const dfm_type *type : registry.list()) visit(user, type, registry.file_of(*type).c_str());
  });
}

dfm_status dfm_plugin_visit_passed(dfm_context *context, dfm_plugin_passed_fn visit, void *user) {
  return as_status([&] {
    if (!visit) fail(DFM_E_ARG, "dfm_plugin_visit_passed: visit is NULL");
    for (const auto &passed : used(require(context)).registry.passed())
      visit(user, passed.file.c_str(), passed.reason.c_str());
  });
}
