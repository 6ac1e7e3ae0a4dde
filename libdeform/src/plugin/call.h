// Every call into a plugin goes through this: its scratch memory is returned, the floating-point environment
// is restored, an exception becomes a status, and a failure is logged with the plugin's name.
#pragma once
#include <type_traits>

#include "deform/plugin.h"

namespace dfm {

// run(f) calls into the plugin. An f that returns nothing succeeds if it returns.
dfm_status run_plugin(const dfm_host &host, const dfm_type &type, const char *what,
                      dfm_status (*run)(const void *f), const void *f) noexcept;

template <class F>
dfm_status call_plugin(const dfm_host &host, const dfm_type &type, const char *what, F &&f) noexcept {
  return run_plugin(
      host, type, what,
      [](const void *g) -> dfm_status {
        auto &run = *static_cast<std::remove_reference_t<F> *>(const_cast<void *>(g));
        if constexpr (!std::is_void_v<decltype(run())>) {
          return run();
        } else {
          run();
          return DFM_OK;
        }
      },
      &f);
}

}  // namespace dfm
