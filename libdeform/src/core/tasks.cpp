#include "core/tasks.h"

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <mutex>
#include <thread>
#include <vector>

namespace dfm {
namespace {

thread_local bool inside_worker = false;

struct Inside {
  const bool outer = inside_worker;
  Inside() { inside_worker = true; }
  ~Inside() { inside_worker = outer; }
};

// A host's workers do not know that they are ours: each block marks its thread while it runs.
struct HostTask { void (*fn)(void *, uint32_t, uint32_t); void *task; };
void run_host_block(void *task, uint32_t begin, uint32_t end) {
  const Inside inside;
  const HostTask &t = *static_cast<HostTask *>(task);
  t.fn(t.task, begin, end);
}

}  // namespace

// Blocks of `grain` are handed out by an atomic counter; workers sleep between jobs.
struct Tasks::Pool {
  std::mutex taken;  // held by the thread whose job runs: worlds of one context may step on several threads
  std::mutex mutex;
  std::condition_variable start, done;
  std::vector<std::thread> workers;
  uint64_t job = 0;
  uint32_t busy = 0;
  bool stop = false;

  uint32_t n = 0, grain = 1;
  std::atomic<uint32_t> next{0};
  void (*fn)(void *, uint32_t, uint32_t) = nullptr;
  void *task = nullptr;

  void drain() {
    const Inside inside;
    for (;;) {
      const uint32_t block = next.fetch_add(1, std::memory_order_relaxed);
      const uint64_t begin = uint64_t(block) * grain;
      if (begin >= n) break;
      fn(task, static_cast<uint32_t>(begin), static_cast<uint32_t>(std::min<uint64_t>(n, begin + grain)));
    }
  }

  void work() {
    uint64_t seen = 0;
    std::unique_lock lock(mutex);
    for (;;) {
      start.wait(lock, [&] { return stop || job != seen; });
      if (stop) return;
      seen = job;
      lock.unlock();
      drain();
      lock.lock();
      if (--busy == 0) done.notify_one();
    }
  }
};

Tasks::Tasks(uint32_t threads, HostFor host_for, void *host_user)
    : threads_(threads ? threads : std::max(1u, std::thread::hardware_concurrency())), host_for_(host_for), host_user_(host_user) {
  if (host_for_ || threads_ == 1) return;
  pool_ = std::make_unique<Pool>();
  for (uint32_t i = 1; i < threads_; ++i) pool_->workers.emplace_back([this] { pool_->work(); });
}

Tasks::~Tasks() {
  if (!pool_) return;
  {
    std::lock_guard lock(pool_->mutex);
    pool_->stop = true;
  }
  pool_->start.notify_all();
  for (auto &worker : pool_->workers) worker.join();
}

void Tasks::run(uint32_t n, uint32_t grain, void (*fn)(void *, uint32_t, uint32_t), void *task) {
  grain = std::max(1u, grain);
  if (n == 0) return;
  if (inside_worker || n <= grain || (!host_for_ && !pool_)) {
    fn(task, 0, n);
    return;
  }
  if (host_for_) {
    HostTask block{fn, task};
    host_for_(host_user_, n, grain, run_host_block, &block);
    return;
  }
  Pool &pool = *pool_;
  const std::unique_lock own(pool.taken, std::try_to_lock);
  if (!own) {  // results do not depend on the cut, so the work is done here rather than waited for
    fn(task, 0, n);
    return;
  }
  {
    std::lock_guard lock(pool.mutex);
    pool.n = n, pool.grain = grain, pool.fn = fn, pool.task = task;
    pool.next.store(0, std::memory_order_relaxed);
    pool.busy = static_cast<uint32_t>(pool.workers.size());
    ++pool.job;
  }
  pool.start.notify_all();
  pool.drain();
  std::unique_lock lock(pool.mutex);
  pool.done.wait(lock, [&] { return pool.busy == 0; });
}

}  // namespace dfm
