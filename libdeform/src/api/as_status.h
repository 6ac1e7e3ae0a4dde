// No exception crosses the C API: every function of api/ runs its body through this.
#pragma once
#include <new>
#include <type_traits>

#include "api/call.h"
#include "core/error.h"
#include "core/float_env.h"
#include "deform/base.h"

namespace dfm {

// Runs f in the usual floating-point environment, and turns an exception into a status and the message of
// dfm_last_error().
template <class F>
dfm_status as_status(F &&f) noexcept {
  Call call;
  const UsualFloatEnv usual;
  try {
    if constexpr (std::is_same_v<std::invoke_result_t<F>, dfm_status>) {
      return f();
    } else {
      f();
      return DFM_OK;
    }
  } catch (const Error &e) {
    set_last_error(e.what());
    return e.status;
  } catch (const std::bad_alloc &) {
    set_last_error("out of memory: the allocation hook or the system refused; nothing was changed");
    return DFM_E_NOMEM;
  } catch (const std::exception &e) {
    set_last_error(e.what());
    return DFM_E_FATAL;
  } catch (...) {
    set_last_error("internal error: an exception of unknown type");
    return DFM_E_FATAL;
  }
}

}  // namespace dfm
