#include "core/forks.h"

#include <atomic>
#if defined(__unix__)
#include <pthread.h>
#endif

namespace dfm {
namespace {

std::atomic<uint32_t> count{0};

}  // namespace

uint32_t forks() noexcept {
#if defined(__unix__)
  [[maybe_unused]] static const int once =
      pthread_atfork(nullptr, nullptr, [] { count.fetch_add(1, std::memory_order_relaxed); });
#endif
  return count.load(std::memory_order_relaxed);
}

}  // namespace dfm
