// A thread that tries what may fail.
#pragma once
#include <cstdint>

#include "deform/base.h"

namespace dfm {

// During its lifetime, warnings and errors of this thread are not logged.
class Quiet {
 public:
  Quiet() noexcept : outer_(now_) { now_ = true; }
  ~Quiet() { now_ = outer_; }
  Quiet(const Quiet &) = delete;
  static bool drops(int32_t level) noexcept { return now_ && level >= DFM_LOG_WARNING; }

 private:
  static thread_local bool now_;
  bool outer_;
};

}  // namespace dfm
