#pragma once
#include <atomic>
#include <cstdint>

#include "core/memory.h"

namespace dfm {

// The first body, in id order, for which something failed, independent of the division of bodies among
// threads.
struct FirstFailure {
  std::atomic<uint32_t> body{kNone};
  void note(uint32_t i) {
    uint32_t seen = body;
    while (i < seen && !body.compare_exchange_weak(seen, i)) {}
  }
};

}  // namespace dfm
