// The calls of the API that are in progress on this thread, the innermost first. A hook, a plugin or a host's
// table may call back into the library during a call. Objects in use by an outer call must not be destroyed
// or changed, so each call registers the objects that it uses.
#pragma once
#include <atomic>
#include <cstddef>
#include <cstdint>

#include "core/error.h"

namespace dfm {

class Call {
 public:
  Call() noexcept : outer_(innermost_) { innermost_ = this; }
  ~Call() {
    innermost_ = outer_;
    if (writing_) writing_->store(false, std::memory_order_release);
    if (counted_) counted_->fetch_sub(1, std::memory_order_release);
  }
  Call(const Call &) = delete;

  // The innermost call. Only inside as_status().
  static Call &now() { return *innermost_; }

  // Registers `object` as in use: nested calls may read it and not destroy it.
  void hold(const void *object) noexcept {
    for (size_t i = 0; i < nheld_; ++i)
      if (held_[i] == object) return;
    if (nheld_ < kMaxHeld) held_[nheld_++] = object;
  }
  // Whether an outer call uses it.
  bool held_outside(const void *object) const noexcept {
    for (const Call *c = outer_; c; c = c->outer_)
      for (size_t i = 0; i < c->nheld_; ++i)
        if (c->held_[i] == object) return true;
    return false;
  }
  // Registers `object` as changing until the call ends. busy: set while any thread changes it.
  void change(const void *object, std::atomic<bool> &busy, const char *what) {
    if (writing_ == &busy) return;
    if (held_outside(object) || busy.exchange(true, std::memory_order_acquire)) refuse(what);
    hold(object);
    writing_ = &busy;
  }
  // Called before destroying or changing an object without such a flag.
  void need_alone(const void *object, const char *what) const {
    if (held_outside(object)) refuse(what);
  }
  // Counts this call among those in progress in a context.
  void count(std::atomic<uint32_t> &calls) noexcept {
    if (counted_) return;
    calls.fetch_add(1, std::memory_order_acquire);
    counted_ = &calls;
  }
  // The object is being destroyed, and its flag with it.
  void let_go() noexcept { writing_ = nullptr; }

  [[noreturn]] static void refuse(const char *what) {
    fail(DFM_E_BUSY,
         "the %s is busy with another call (a step, or a call in which a hook, plugin or host runs now); "
         "call again after that call has returned",
         what);
  }

 private:
  static constexpr size_t kMaxHeld = 6;  // no function uses more objects
  static inline thread_local Call *innermost_ = nullptr;
  Call *const outer_;
  std::atomic<bool> *writing_ = nullptr;
  std::atomic<uint32_t> *counted_ = nullptr;
  const void *held_[kMaxHeld] = {};
  size_t nheld_ = 0;
};

}  // namespace dfm
