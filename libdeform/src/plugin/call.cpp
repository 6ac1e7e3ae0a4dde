#include "plugin/call.h"

#include "plugin/boundary.h"
#include "plugin/context.h"

namespace dfm {

dfm_status run_plugin(const dfm_host &host, const dfm_type &type, const char *what,
                      dfm_status (*run)(const void *f), const void *f) noexcept {
  dfm_context &context = *static_cast<dfm_context *>(host.ctx);
  const PluginCall call(context.scratch);
  Boundary boundary(type.id, what);
  dfm_status status = DFM_E_FATAL;
  bool threw = false;
  try {
    status = run(f);
  } catch (...) {
    threw = true;
  }
  if (const char *changed = boundary.restore(); changed && context.left_changed.first(&type))
    context.warn(
        "%s: %s changed %s and did not restore it; the library restored it, and will do so again without a "
        "message; a plugin must not change the floating-point environment",
        type.id, what, changed);
  if (threw)
    context.logf(DFM_LOG_ERROR,
                 "%s: %s threw an exception; a plugin must not (wrap its entries in dfm::plugin::guarded)",
                 type.id, what);
  else if (status < 0 && !Overheard::active())
    context.logf(DFM_LOG_ERROR, "%s: %s returned %s", type.id, what, dfm_status_name(status));
  return status;
}

}  // namespace dfm
