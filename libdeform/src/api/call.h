// The calls of the API that are in progress on this thread, the innermost first. A hook, a plugin or a host's
// table may call back into the library in the middle of one; what a call works on must not be destroyed or
// changed beneath it, so each names what it holds.
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
  Call &operator=(const Call &) = delete;

  // The call whose body runs now. Only under as_status().
  static Call &now() { return *innermost_; }

  // Works on `object`, which those that it calls may look at and not destroy.
  void hold(const void *object) noexcept {
    for (size_t i = 0; i < nheld_; ++i)
      if (held_[i] == object) return;
    if (nheld_ < kMostHeld) held_[nheld_++] = object;
  }
  // Does a call around this one hold it?
  bool held_outside(const void *object) const noexcept {
    for (const Call *c = outer_; c; c = c->outer_)
      for (size_t i = 0; i < c->nheld_; ++i)
        if (c->held_[i] == object) return true;
    return false;
  }
  // Changes `object` until the call ends. busy: that somebody does, on whatever thread.
  void change(const void *object, std::atomic<bool> &busy, const char *what) {
    if (writing_ == &busy) return;
    if (held_outside(object) || busy.exchange(true, std::memory_order_acquire)) refuse(what);
    hold(object);
    writing_ = &busy;
  }
  // Destroys or changes something that has no flag of its own.
  void need_alone(const void *object, const char *what) const {
    if (held_outside(object)) refuse(what);
  }
  // Counts among the calls that a context is in.
  void count(std::atomic<uint32_t> &calls) noexcept {
    if (counted_) return;
    calls.fetch_add(1, std::memory_order_acquire);
    counted_ = &calls;
  }
  // The object is going, and its flag with it.
  void let_go() noexcept { writing_ = nullptr; }

  [[noreturn]] static void refuse(const char *what) {
    fail(DFM_E_BUSY,
         "the %s is busy with another call (a step, or a call in which a hook, plugin or host runs now); "
         "call again after that call has returned",
         what);
  }

 private:
  static constexpr size_t kMostHeld = 6;  // no function works on more things than that
  static inline thread_local Call *innermost_ = nullptr;
  Call *const outer_;
  std::atomic<bool> *writing_ = nullptr;
  std::atomic<uint32_t> *counted_ = nullptr;
  const void *held_[kMostHeld] = {};
  size_t nheld_ = 0;
};

}  // namespace dfm
