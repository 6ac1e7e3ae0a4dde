// The search tree of one body or obstacle for rays and closest points. It is built at the first query, and
// refitted at the first query after positions have changed. Any number of threads may query at once while
// none changes positions.
#pragma once
#include <atomic>
#include <mutex>
#include <span>

#include "core/memory.h"
#include "geometry/triangle_search.h"

namespace dfm {

class SearchTree {
 public:
  explicit SearchTree(const Memory &memory) : tree_(memory), x_(memory) {}

  // version: of the positions, above zero. fill(x) writes them, [npoint,4].
  template <class Fill>
  Triangles at(uint64_t version, std::span<const uint32_t> corners, size_t npoint, Fill &&fill) {
    if (version_.load(std::memory_order_acquire) != version) {
      const std::lock_guard lock(mutex_);
      if (version_.load(std::memory_order_relaxed) != version) {
        x_.resize(4 * npoint);
        fill(x_.data());
        tree_.renew(corners, x_.data());
        version_.store(version, std::memory_order_release);
      }
    }
    return {tree_, corners, x_.data()};
  }

 private:
  std::mutex mutex_;
  std::atomic<uint64_t> version_{0};  // 0: no tree yet
  BoxTree tree_;
  Array<double> x_;
};

}  // namespace dfm
