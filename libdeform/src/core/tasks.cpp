#include "core/tasks.h"

#if defined(__unix__)
#include <pthread.h>
#endif

#include <algorithm>
#include <atomic>
#include <chrono>
#include <thread>
#include <vector>

#include "core/float_env.h"
#include "core/wait.h"

namespace dfm {
namespace {

thread_local bool inside_worker = false;

struct Inside {
  const bool outer = inside_worker;
  const UsualFloatEnv usual;  // a worker has that of the thread that made the context, a host's its own
  Inside() { inside_worker = true; }
  ~Inside() { inside_worker = outer; }
};

// A host's worker threads are not marked as workers: each block marks its thread while it runs.
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

uint32_t forks() noexcept {
  static std::atomic<uint32_t> count{0};
#if defined(__unix__)
  [[maybe_unused]] static const int once =
      pthread_atfork(nullptr, nullptr, [] { count.fetch_add(1, std::memory_order_relaxed); });
#endif
  return count.load(std::memory_order_relaxed);
}

// Waits for `ready` without sleeping, until `most` has passed: waking a thread takes 50 microseconds, as long
// as the work of a small body. After a short time it yields now and then, so that other threads of its core
// can run: seldom, because a yield is a call to the system, which also slows another thread of the same core.
// Returns false if it is not ready yet; then sleep.
template <class Ready, class Most>
bool spin(Ready ready, Most most) {
  using Clock = std::chrono::steady_clock;
  constexpr auto kMoment = std::chrono::microseconds(20), kYieldInterval = std::chrono::microseconds(5);
  constexpr int kSpins = 32;  // between two readings of the clock
  const Clock::time_point start = Clock::now();
  for (auto next_check = kMoment;;) {
    for (int i = 0; i < kSpins; ++i) {
      if (ready()) return true;
#if defined(__x86_64__)
      __builtin_ia32_pause();
#endif
    }
    const auto passed = Clock::now() - start;
    if (passed > most()) return ready();
    if (passed <= next_check) continue;
    std::this_thread::yield();
    next_check = std::chrono::duration_cast<std::chrono::microseconds>(passed) + kYieldInterval;
  }
}

constexpr std::chrono::microseconds kWithinStep{2000}, kBetweenSteps{200}, kCrowded{2};

// A job has a team: as many threads as are of use, always the same ones, so that each finds the bodies that
// it had in the last job in the cache of its core. Blocks of `grain` are divided into one run per member.
// Each member first takes the blocks of its own run, then blocks that are left in other runs. The owner waits
// only for workers that have entered the job: a worker that sleeps, or whose core is busy, does not delay it.
// Between the jobs of a step workers spin so that they do not fall asleep. Each worker waits at a cache line
// of its own, so jobs that do not call it do not disturb it.
struct Tasks::Pool {
  static constexpr uint64_t kOpen = uint64_t{1} << 31, kInside = kOpen - 1;
  static constexpr int kNumber = 32;  // bits below a job's number

  // held by the thread that owns the job: worlds of one context may step on several threads
  std::mutex taken;
  std::mutex mutex;
  std::condition_variable done;
  std::vector<std::thread> workers;
  // number of the job, whether it is open, number of workers inside; the job is written before it opens
  std::atomic<uint64_t> gate{0};
  std::atomic<bool> stop{false};
  std::atomic<bool> waiting{false};     // the owner is in done
  std::atomic<uint32_t> stepping{0};    // number of worlds in a step
  const uint32_t of_process = forks();  // whose threads they are
  bool crowded = false;                 // one processor: a spinning thread would keep the other from working

  struct alignas(64) Run {  // of blocks; each has its own cache line
    std::atomic<uint32_t> next{0};
    uint32_t end = 0;
  };
  struct alignas(64) Seat {           // of a worker
    std::atomic<uint64_t> called{0};  // number of the last job that calls it
    std::atomic<bool> asleep{false};  // in start
    std::condition_variable start;
  };
  uint32_t n = 0, grain = 1, team = 0;
  std::vector<Run> run;    // by member, the owner's first
  std::vector<Seat> seat;  // by member; the owner's is not used
  void (*fn)(void *, uint32_t, uint32_t) = nullptr;
  void *task = nullptr;

  explicit Pool(uint32_t threads) : run(threads), seat(threads) {}
  // Also runs if a worker could not be started and the pool was never complete.
  ~Pool() {
    {
      const std::lock_guard lock(mutex);
      stop = true;
    }
    for (Seat &s : seat) s.start.notify_one();
    for (auto &worker : workers) worker.join();
  }

  void drain(uint32_t own) {
    const Inside inside;
    for (uint32_t k = 0; k < team; ++k) {
      Run &r = run[(own + k) % team];
      while (r.next.load(std::memory_order_relaxed) < r.end) {
        const uint32_t block = r.next.fetch_add(1, std::memory_order_relaxed);
        if (block >= r.end) break;
        const uint64_t begin = uint64_t(block) * grain;
        fn(task, static_cast<uint32_t>(begin), static_cast<uint32_t>(std::min<uint64_t>(n, begin + grain)));
      }
    }
  }

  // Each member wakes at most two others: a call to the system takes microseconds.
  void wake_next(uint32_t own) {
    for (uint32_t k = 2 * own + 1; k < team && k <= 2 * own + 2; ++k) {
      if (!seat[k].asleep.load()) continue;
      { const std::lock_guard lock(mutex); }  // a worker that says that it sleeps is waiting in start now
      seat[k].start.notify_one();
    }
  }

  void work(uint32_t own) {
    Seat &here = seat[own];
    uint64_t seen = 0;
    const auto ready = [&] { return here.called.load() != seen || stop.load(); };
    const auto most = [&] {
      return crowded ? kCrowded : stepping.load(std::memory_order_relaxed) ? kWithinStep : kBetweenSteps;
    };
    for (;;) {
      if (!spin(ready, most)) {
        std::unique_lock lock(mutex);
        here.asleep = true;
        wait(here.start, lock, ready);
        here.asleep = false;
      }
      if (stop.load()) return;
      seen = here.called.load();
      if (!enter(seen)) continue;
      wake_next(own);
      drain(own);
      if (((gate.fetch_sub(1) - 1) & (kOpen | kInside)) != 0 || !waiting.load()) continue;
      const std::lock_guard lock(mutex);
      done.notify_one();
    }
  }

  // False: the job is over.
  bool enter(uint64_t number) {
    for (uint64_t now = gate.load(); (now & kOpen) && now >> kNumber == number;)
      if (gate.compare_exchange_weak(now, now + 1)) return true;
    return false;
  }

  // No worker is inside, and the job is written.
  void open() {
    const uint32_t blocks = 1 + (n - 1) / grain;
    team = useful(blocks, static_cast<uint32_t>(run.size()));
    for (uint64_t k = 0; k < team; ++k) {
      run[k].next.store(static_cast<uint32_t>(k * blocks / team), std::memory_order_relaxed);
      run[k].end = static_cast<uint32_t>((k + 1) * blocks / team);
    }
    const uint64_t number = ((gate.load() >> kNumber) + 1) & (~uint64_t{0} >> kNumber);
    gate.store(number << kNumber | kOpen);
    for (uint32_t k = 1; k < team; ++k) seat[k].called.store(number);
    wake_next(0);
  }

  void close() {
    const auto empty = [&] { return (gate.load() & kInside) == 0; };
    if ((gate.fetch_and(~kOpen) & kInside) == 0) return;
    if (spin(empty, [&] { return crowded ? kCrowded : kWithinStep; })) return;
    std::unique_lock lock(mutex);
    waiting = true;
    wait(done, lock, empty);
    waiting = false;
  }
};

// A team of m takes W / m for its work and c m to enter and to leave, one after the other: the best m is
// sqrt(W / c). Callers choose a grain of 2 us and more, and c is about 0.15 us.
uint32_t Tasks::useful(uint32_t blocks, uint32_t threads) {
  const uint32_t most = std::min(blocks, threads);
  uint32_t team = 1;
  while (team < most && uint64_t{team} * team < uint64_t{13} * blocks) ++team;
  return team;
}

Tasks::Tasks(uint32_t threads, HostFor host_for, void *host_user)
    : threads_(threads ? threads : std::max(1u, std::thread::hardware_concurrency())),
      host_for_(host_for),
      host_user_(host_user) {
  if (host_for_ || threads_ == 1) return;
  // More threads than processors would have to sleep between jobs: they are of no use. Two are always made.
  const uint32_t processors = std::thread::hardware_concurrency();
  const uint32_t members = processors ? std::min(threads_, std::max(2u, processors)) : threads_;
  threads_ = members;  // what threads() says: those that there are
  pool_ = std::make_unique<Pool>(members);
  pool_->crowded = processors > 0 && members > processors;
  pool_->workers.reserve(members - 1);
  for (uint32_t i = 1; i < members; ++i)
    pool_->workers.emplace_back([pool = pool_.get(), i] { pool->work(i); });
}

// In a child of fork() the workers cannot be joined, and a condition that they wait for cannot be destroyed.
Tasks::~Tasks() {
  if (pool_ && pool_->of_process != forks()) (void)pool_.release();
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
  if (pool.of_process != forks()) {  // a worker may have held a lock when the process was forked
    fn(task, 0, n);
    return;
  }
  const std::unique_lock own(pool.taken, std::try_to_lock);
  if (!own) {  // results do not depend on the division, so this thread does the work instead of waiting
    fn(task, 0, n);
    return;
  }
  pool.n = n;
  pool.grain = grain;
  pool.fn = fn;
  pool.task = task;
  pool.open();
  pool.drain(0);
  pool.close();
}

Tasks::Alone::Alone() : outer_(inside_worker) { inside_worker = true; }
Tasks::Alone::~Alone() { inside_worker = outer_; }

Tasks::Step::Step(Tasks &tasks) : pool_(tasks.pool_.get()) {
  if (pool_) ++pool_->stepping;
}
Tasks::Step::~Step() {
  if (pool_) --pool_->stepping;
}

}  // namespace dfm
