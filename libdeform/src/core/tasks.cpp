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
struct HostTask {
  void (*fn)(void *, uint32_t, uint32_t);
  void *task;
};
void run_host_block(void *task, uint32_t begin, uint32_t end) {
  const Inside inside;
  const HostTask &t = *static_cast<HostTask *>(task);
  t.fn(t.task, begin, end);
}

}  // namespace

// Waits for `ready` without sleeping, for about as long as a step spends between two of its jobs (some 100
// microseconds): waking a thread costs tens of microseconds, more than the work of a small body. False: not
// ready yet, sleep.
template <class Ready>
bool spin(Ready ready) {
  for (int i = 0; i < 4000; ++i) {
    if (ready()) return true;
#if defined(__x86_64__)
    __builtin_ia32_pause();
#endif
  }
  return false;
}

// Blocks of `grain` are handed out by an atomic counter; workers spin for a moment between jobs, then sleep.
struct Tasks::Pool {
  std::mutex taken;  // held by the thread whose job runs: worlds of one context may step on several threads
  std::mutex mutex;
  std::condition_variable start, done;
  std::vector<std::thread> workers;
  std::atomic<uint64_t> job{0};   // rises with each job; what the job is was written before
  std::atomic<uint32_t> busy{0};  // workers that have not finished it
  std::atomic<bool> stop{false};
  uint32_t asleep = 0;   // workers in start, under mutex
  bool waiting = false;  // the owner is in done, under mutex

  uint32_t n = 0, grain = 1;
  std::atomic<uint32_t> next{0};
  void (*fn)(void *, uint32_t, uint32_t) = nullptr;
  void *task = nullptr;

  // Also where a later worker could not be started and the pool never came to be.
  ~Pool() {
    {
      const std::lock_guard lock(mutex);
      stop = true;
    }
    start.notify_all();
    for (auto &worker : workers) worker.join();
  }

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
    const auto ready = [&] {
      return stop.load(std::memory_order_acquire) || job.load(std::memory_order_acquire) != seen;
    };
    for (;;) {
      if (!spin(ready)) {
        std::unique_lock lock(mutex);
        ++asleep;
        start.wait(lock, ready);
        --asleep;
      }
      if (stop.load(std::memory_order_acquire)) return;
      seen = job.load(std::memory_order_acquire);
      drain();
      if (busy.fetch_sub(1, std::memory_order_acq_rel) != 1) continue;
      const std::lock_guard lock(mutex);
      if (waiting) done.notify_one();
    }
  }

  void wait() {
    const auto finished = [&] { return busy.load(std::memory_order_acquire) == 0; };
    if (spin(finished)) return;
    std::unique_lock lock(mutex);
    waiting = true;
    done.wait(lock, finished);
    waiting = false;
  }
};

Tasks::Tasks(uint32_t threads, HostFor host_for, void *host_user)
    : threads_(threads ? threads : std::max(1u, std::thread::hardware_concurrency())),
      host_for_(host_for),
      host_user_(host_user) {
  if (host_for_ || threads_ == 1) return;
  pool_ = std::make_unique<Pool>();
  pool_->workers.reserve(threads_ - 1);
  for (uint32_t i = 1; i < threads_; ++i) pool_->workers.emplace_back([pool = pool_.get()] { pool->work(); });
}

Tasks::~Tasks() = default;

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
  pool.n = n;
  pool.grain = grain;
  pool.fn = fn;
  pool.task = task;
  pool.next.store(0, std::memory_order_relaxed);
  pool.busy.store(static_cast<uint32_t>(pool.workers.size()), std::memory_order_relaxed);
  bool wake;
  {
    const std::lock_guard lock(pool.mutex);
    pool.job.fetch_add(1, std::memory_order_release);
    wake = pool.asleep > 0;
  }
  if (wake) pool.start.notify_all();
  pool.drain();
  pool.wait();
}

}  // namespace dfm
