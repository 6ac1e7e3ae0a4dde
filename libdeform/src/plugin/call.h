// Every call into a plugin goes through here: what it took as scratch is given back, an exception becomes a status, and a failure is
// logged under the plugin's name.
#pragma once
#include "plugin/context.h"

namespace dfm {

template <class F>
dfm_status call_plugin(const dfm_host &host, const dfm_type &type, const char *what, F &&f) noexcept {
  dfm_context &context = *static_cast<dfm_context *>(host.ctx);
  const PluginCall call(context.scratch);
  try {
    const dfm_status status = f();
    if (status < 0) context.logf(DFM_LOG_ERROR, "%s: %s returned %s", type.id, what, dfm_status_name(status));
    return status;
  } catch (...) {
    context.logf(DFM_LOG_ERROR, "%s: %s threw an exception; a plugin must not (wrap its entries in dfm::plugin::guarded)", type.id, what);
    return DFM_E_FATAL;
  }
}

}  // namespace dfm
