// The context: hooks of the host, services for plugins, loaded plugins, and the objects created in it.
#pragma once
#include <atomic>
#include <cstdint>
#include <mutex>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/memory.h"
#include "core/tasks.h"
#include "deform/base.h"
#include "plugin/boundary.h"
#include "plugin/loader.h"
#include "plugin/registry.h"
#include "plugin/scratch.h"

struct dfm_context {
  explicit dfm_context(const dfm_context_def &def);
  ~dfm_context();  // destroys its objects, newest first, then the plugins
  dfm_context(const dfm_context &) = delete;
  dfm_context &operator=(const dfm_context &) = delete;

  // Logs to the host's hook; without one, warnings and errors go to stderr.
  void log(int32_t level, const char *utf8) const noexcept;
  void logf(int32_t level, const char *format, ...) const noexcept DEFORM_PRINTF(3, 4);
  void warn(const char *format, ...) const noexcept DEFORM_PRINTF(2, 3);
  void warn(const dfm::Named &whose, const char *sentence, ...) const noexcept DEFORM_PRINTF(3, 4);
  void trace_begin(const char *zone) const {
    if (hooks.trace_begin) hooks.trace_begin(hooks.user, zone);
  }
  void trace_end(const char *zone) const {
    if (hooks.trace_end) hooks.trace_end(hooks.user, zone);
  }

  // Worlds, laws and scenes are listed so that dfm_context_destroy can destroy them: destroy(handle) is
  // called for those still in the list.
  void add_live(uint64_t handle, void (*destroy)(uint64_t));
  void remove_live(uint64_t handle) noexcept;

  dfm_context_def hooks;  // given by the host
  dfm::Memory memory;
  dfm::Tasks tasks;
  dfm::Scratch scratch;
  dfm_host host;  // given to plugins
  dfm::Registry registry;
  dfm::Loader loader;
  dfm::SaidOnce left_changed;      // types that left the floating-point environment changed
  std::atomic<uint32_t> calls{0};  // calls of the API in progress in it or in its worlds (api/call.h)
  std::atomic<bool> ending{false};

 private:
  void log_line(int32_t level, const dfm::Named *whose, const char *format, va_list args) const noexcept;
  std::mutex live_mutex_;
  std::vector<std::pair<uint64_t, void (*)(uint64_t)>> live_;
};

namespace dfm {

// During its lifetime, an error that a plugin logs on this thread is kept here instead, and the caller of the
// plugin includes it in its own message. Keeps the first one; does not allocate.
class Overheard {
 public:
  Overheard() noexcept : outer_(now_) { now_ = this; }
  ~Overheard() { now_ = outer_; }
  Overheard(const Overheard &) = delete;
  Overheard &operator=(const Overheard &) = delete;
  const char *text() const { return text_; }  // without a full stop; empty: no message

  static bool active() noexcept { return now_; }
  static bool take(const char *text) noexcept;  // false: there is no listener

 private:
  static thread_local Overheard *now_;
  Overheard *outer_;
  char text_[512] = {};
};

// A zone of the host's tracer during the lifetime of the object.
class TraceZone {
 public:
  TraceZone(const dfm_context &context, const char *zone) : context_(context), zone_(zone) {
    context_.trace_begin(zone_);
  }
  ~TraceZone() { context_.trace_end(zone_); }
  TraceZone(const TraceZone &) = delete;

 private:
  const dfm_context &context_;
  const char *zone_;
};

}  // namespace dfm
