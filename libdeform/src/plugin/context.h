// The context: hooks of the host, what is lent to plugins, what plugins are loaded, and the objects
// that live in it.
#pragma once
#include <atomic>
#include <cstdint>
#include <mutex>
#include <utility>
#include <vector>

#include "core/memory.h"
#include "core/tasks.h"
#include "deform/base.h"
#include "plugin/boundary.h"
#include "plugin/loader.h"
#include "plugin/registry.h"
#include "plugin/scratch.h"

struct dfm_context {
  explicit dfm_context(const dfm_context_def &def);
  ~dfm_context();  // destroys what lives in it, newest first, then the plugins
  dfm_context(const dfm_context &) = delete;
  dfm_context &operator=(const dfm_context &) = delete;

  // To the host's hook; without one, warnings and errors go to stderr.
  void log(int32_t level, const char *utf8) const noexcept;
  void logf(int32_t level, const char *format, ...) const noexcept __attribute__((format(printf, 3, 4)));
  void trace_begin(const char *zone) const {
    if (hooks.trace_begin) hooks.trace_begin(hooks.user, zone);
  }
  void trace_end(const char *zone) const {
    if (hooks.trace_end) hooks.trace_end(hooks.user, zone);
  }

  // Worlds, laws and scenes stand here so that dfm_context_destroy can end them: destroy(handle) is called
  // for those still listed.
  void add_live(uint64_t handle, void (*destroy)(uint64_t));
  void remove_live(uint64_t handle) noexcept;

  dfm_context_def hooks;  // what the host lent
  dfm::Memory memory;
  dfm::Tasks tasks;
  dfm::Scratch scratch;
  dfm_host host;  // what we lend to plugins
  dfm::Registry registry;
  dfm::Loader loader;
  dfm::SaidOnce left_changed;      // types that left the floating-point environment changed
  std::atomic<uint32_t> calls{0};  // of the API that are in progress in it or in its worlds (api/call.h)
  std::atomic<bool> ending{false};

 private:
  std::mutex live_mutex_;
  std::vector<std::pair<uint64_t, void (*)(uint64_t)>> live_;
};

namespace dfm {

// While it stands, an error that a plugin logs on this thread is kept here instead: who has called the plugin
// says it in its own sentence. The first one counts; allocates nothing.
class Overheard {
 public:
  Overheard() noexcept : outer_(now_) { now_ = this; }
  ~Overheard() { now_ = outer_; }
  Overheard(const Overheard &) = delete;
  Overheard &operator=(const Overheard &) = delete;
  const char *text() const { return text_; }  // without a full stop; empty: nothing was said

  static bool active() noexcept { return now_; }
  static bool take(const char *text) noexcept;  // false: nobody listens

 private:
  static thread_local Overheard *now_;
  Overheard *outer_;
  char text_[512] = {};
};

// A zone of the host's tracer for the life of the object.
class TraceZone {
 public:
  TraceZone(const dfm_context &context, const char *zone) : context_(context), zone_(zone) {
    context_.trace_begin(zone_);
  }
  ~TraceZone() { context_.trace_end(zone_); }
  TraceZone(const TraceZone &) = delete;
  TraceZone &operator=(const TraceZone &) = delete;

 private:
  const dfm_context &context_;
  const char *zone_;
};

}  // namespace dfm
