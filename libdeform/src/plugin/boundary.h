// Guards around calls into plugins: the rounding mode, denormal handling and exception masks of the host are
// restored, and the plugin that a thread is in can be queried.
#pragma once
#include <array>
#include <atomic>

#include "core/float_env.h"

namespace dfm {

// The plugin that this thread is in, for dfm_plugin_running. Plain pointers, so that signal handlers can read
// them.
struct Running { const char *who = nullptr, *what = nullptr; };
extern constinit thread_local Running running;

// An object of this type surrounds every call into a plugin.
class Boundary {
 public:
  Boundary(const char *who, const char *what) noexcept : before_(FloatEnv::now()), outer_(running) {
    running = {who, what};
  }
  ~Boundary() {
    restore();
    running = outer_;
  }
  Boundary(const Boundary &) = delete;
  Boundary &operator=(const Boundary &) = delete;
  // Restores the floating-point environment; returns what the call had changed, or null.
  const char *restore() noexcept {
    const FloatEnv after = FloatEnv::now();
    if (after == before_) return nullptr;
    before_.apply();
    return before_.difference(after);
  }

 private:
  FloatEnv before_;
  Running outer_;
};

// Remembers which messages have been given. Has limited room and does not allocate; without room a message is
// dropped.
class SaidOnce {
 public:
  bool first(const void *about) noexcept {
    for (auto &slot : said_) {
      const void *expected = nullptr;
      if (slot.load(std::memory_order_relaxed) == about) return false;
      if (slot.compare_exchange_strong(expected, about)) return true;
      if (expected == about) return false;
    }
    return false;
  }

 private:
  std::array<std::atomic<const void *>, 64> said_{};
};

}  // namespace dfm
