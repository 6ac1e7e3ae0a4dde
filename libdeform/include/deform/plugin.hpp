// deform/plugin.hpp -- header-only help for plugins written in C++17 or later; nothing in it crosses the
// boundary that plugin.h does not name. A law in full:
//
//   #include "deform/plugin.hpp"
//   namespace dp = dfm::plugin;
//   constexpr dfm_param rows[] = {dp::param("mu_C", "friction coefficient", "1", 0, 10, 0.5)};
//   dfm_status eval(const dfm_friction_in *in, dfm_friction_out *out) { ... return DFM_OK; }  // may throw
//   const dfm_friction law = dp::friction(DFM_NEED_FN | DFM_NEED_VT, DFM_FRIC_ISOTROPIC, dp::guarded<eval>);
//   const char *const effects[] = {"viscous", nullptr};
//   const dfm_type type = dp::type(DFM_KIND_FRICTION, "org.example.mylaw", "My law", "1.0.0", "MIT",
//                                  "Paper, eq. 1", rows, effects, &law);
//   DFM_PLUGIN(&type)
#ifndef DEFORM_PLUGIN_HPP
#define DEFORM_PLUGIN_HPP
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <new>
#include <type_traits>

#include "deform/elementary.h"
#include "deform/plugin.h"

namespace dfm::plugin {

// ---- no exception crosses: guarded<f> has f's parameters and is what goes into the tables -----------------
template <auto Function>
struct Guard;
template <class... A, dfm_status (*Function)(A...)>
struct Guard<Function> {
  static dfm_status call(A... a) noexcept {
    try {
      return Function(a...);
    } catch (const std::bad_alloc &) {
      return DFM_E_NOMEM;
    } catch (...) {
      return DFM_E_FATAL;
    }
  }
};
template <auto Function>
inline constexpr auto guarded = &Guard<Function>::call;

// ---- tables -----------------------------------------------------------------------------------------------
constexpr dfm_param param(const char *key, const char *label, const char *unit, double min, double max,
                          double def, uint32_t flags = 0, uint32_t width = 1) {
  return {key, label, unit, min, max, def, flags, width, nullptr};
}

// `names` ends with a null pointer; value k reads names[k].
template <size_t N>
constexpr dfm_param enumeration(const char *key, const char *label, const char *const (&names)[N],
                                uint32_t def) {
  return {key,
          label,
          "1",
          0,
          static_cast<double>(N - 2),
          static_cast<double>(def),
          DFM_PARAM_ENUM | DFM_PARAM_INTEGER,
          1,
          names};
}

template <size_t N>
constexpr dfm_type type(uint32_t kind, const char *id, const char *name, const char *version,
                        const char *licence, const char *source, const dfm_param (&rows)[N],
                        const char *const *effects, const void *ops) {
  return {sizeof(dfm_type),  kind,    id, name, version, licence, source, rows, static_cast<uint32_t>(N),
          sizeof(dfm_param), effects, ops};
}
// Without parameters.
constexpr dfm_type type(uint32_t kind, const char *id, const char *name, const char *version,
                        const char *licence, const char *source, const char *const *effects,
                        const void *ops) {
  return {sizeof(dfm_type),  kind,    id, name, version, licence, source, nullptr, 0,
          sizeof(dfm_param), effects, ops};
}

using Eval = dfm_status (*)(const dfm_friction_in *, dfm_friction_out *);
using Check = dfm_status (*)(const double *, char *, size_t);
constexpr dfm_friction friction(uint32_t needs, uint32_t flags, Eval eval, Check check = nullptr) {
  return {
      sizeof(dfm_friction), needs, flags, 0, nullptr, eval, check, nullptr, nullptr, nullptr, 0, 0, nullptr};
}

// ---- models: an instance is an object ---------------------------------------------------------------------
// create and destroy of a class with the constructor Body(const dfm_host &, const dfm_mesh &). What it throws
// refuses the body; the text of a std::exception says why.
template <class Body>
dfm_status make(const dfm_host *host, const dfm_mesh *mesh, void **self) noexcept {
  try {
    *self = new Body(*host, *mesh);
    return DFM_OK;
  } catch (const std::bad_alloc &) {
    return DFM_E_NOMEM;
  } catch (const std::exception &e) {
    host->log(host->ctx, 3, 0, e.what());
    return DFM_E_ARG;
  } catch (...) {
    return DFM_E_FATAL;
  }
}
template <class Body>
void unmake(void *self) noexcept {
  delete static_cast<Body *>(self);
}

// method<&Body::f> goes into a table where f's arguments stand behind self. f gives a dfm_status, or nothing:
// then it is DFM_OK unless it throws.
template <class Body, auto F, class... A>
dfm_status call_method(Body *body, A... a) noexcept {
  try {
    if constexpr (std::is_void_v<decltype((body->*F)(a...))>) {
      (body->*F)(a...);
      return DFM_OK;
    } else {
      return (body->*F)(a...);
    }
  } catch (const std::bad_alloc &) {
    return DFM_E_NOMEM;
  } catch (...) {
    return DFM_E_FATAL;
  }
}
template <auto F>
struct Method;
template <class Body, class R, class... A, R (Body::*F)(A...)>
struct Method<F> {
  using Call = dfm_status (*)(void *, A...);
  constexpr operator Call() const noexcept {
    return [](void *self, A... a) noexcept -> dfm_status {
      return call_method<Body, F>(static_cast<Body *>(self), a...);
    };
  }
};
template <class Body, class R, class... A, R (Body::*F)(A...) const>
struct Method<F> {
  using Call = dfm_status (*)(void *, A...);
  using ConstCall = dfm_status (*)(const void *, A...);
  constexpr operator Call() const noexcept {
    return [](void *self, A... a) noexcept -> dfm_status {
      return call_method<const Body, F>(static_cast<const Body *>(self), a...);
    };
  }
  constexpr operator ConstCall() const noexcept {
    return [](const void *self, A... a) noexcept -> dfm_status {
      return call_method<const Body, F>(static_cast<const Body *>(self), a...);
    };
  }
};
template <auto F>
inline constexpr Method<F> method{};

// ---- batches: columns of a structure of arrays ------------------------------------------------------------
// Column c of p, or null where the caller does not want it.
template <class T>
constexpr T *column(T *p, uint32_t stride, uint32_t c) {
  return p ? p + static_cast<size_t>(c) * stride : nullptr;
}

// ---- entry ------------------------------------------------------------------------------------------------
// Null after saying why where the host speaks another ABI; else the plugin. Only the head of the host is read
// before that is known.
inline const dfm_plugin *publish(const dfm_host *host, uint32_t host_abi, uint32_t host_abi_min,
                                 const dfm_plugin *plugin) noexcept {
  if (host && DFM_ABI_OK(host)) return plugin;
  // the head of dfm_host up to log is the same in every ABI
  if (host && host->size >= offsetof(dfm_host, log) + sizeof(host->log) && host->log) {
    char text[192];
    std::snprintf(text, sizeof text,
                  "plugin built for ABI %u draft %u, the host speaks ABI %u (from %u) draft %u; rebuild the "
                  "plugin against the deform/plugin.h of the host",
                  DFM_ABI, DFM_ABI_DRAFT, host_abi, host_abi_min, host->abi_draft);
    host->log(host->ctx, 2, 0, text);
  }
  return nullptr;
}

}  // namespace dfm::plugin

// Defines the one exported symbol; the arguments are pointers to the dfm_types.
#define DFM_PLUGIN(...)                                                                              \
  extern "C" DFM_EXPORT const dfm_plugin *dfm_plugin_entry(const dfm_host *host, uint32_t host_abi,  \
                                                           uint32_t host_abi_min) {                  \
    static const dfm_type *const types[] = {__VA_ARGS__};                                            \
    static const dfm_plugin plugin = {                                                               \
        sizeof(dfm_plugin), DFM_ABI, DFM_ABI_DRAFT, sizeof types / sizeof types[0], types, nullptr}; \
    return dfm::plugin::publish(host, host_abi, host_abi_min, &plugin);                              \
  }
#endif
