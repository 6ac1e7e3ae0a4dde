// parallel_for over the host's hook or the library's pool. Results must not depend on the division: each
// block writes to its own elements, or to a partial sum in slot begin/grain; the caller adds these in slot
// order.
#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <memory>
#include <mutex>

namespace dfm {

class Tasks {
  struct Pool;

 public:
  using HostFor = void (*)(void *user, uint32_t n, uint32_t grain, void (*fn)(void *, uint32_t, uint32_t),
                           void *task);
  // threads: 1 no workers, 0 one per processor. host_for is used instead if given.
  Tasks(uint32_t threads, HostFor host_for, void *host_user);
  ~Tasks();
  uint32_t threads() const { return threads_; }
  // whether run() may use more than the caller's thread
  bool parallel() const { return host_for_ || pool_; }

  // How many threads a job of so many blocks calls. A job of few blocks leaves the others alone, so that many
  // threads are not slower than few.
  static uint32_t useful(uint32_t blocks, uint32_t threads);

  // Calls fn(begin, end) over [0,n), divided at multiples of grain, and waits for the end. A call from a
  // worker runs serially in that worker.
  void run(uint32_t n, uint32_t grain, void (*fn)(void *, uint32_t, uint32_t), void *task);
  template <class F>
  void parallel_for(uint32_t n, uint32_t grain, F &&f) {
    run(
        n, grain, [](void *task, uint32_t begin, uint32_t end) { (*static_cast<F *>(task))(begin, end); },
        &f);
  }

  // While an object of this type exists, run() uses the caller's thread alone.
  class Alone {
   public:
    Alone();
    ~Alone();
    Alone(const Alone &) = delete;

   private:
    const bool outer_;
  };

  // While an object of this type exists, workers that have had a job stay awake for the next one.
  class Step {
   public:
    explicit Step(Tasks &tasks);
    ~Step();
    Step(const Step &) = delete;
    Step &operator=(const Step &) = delete;

   private:
    Pool *pool_;
  };

 private:
  std::unique_ptr<Pool> pool_;
  uint32_t threads_;
  HostFor host_for_;
  void *host_user_;
};

// f(i) for all i < n, blocks of `grain` on the threads of tasks (null: on this one). No exception may leave a
// worker: the caller gets that of the lowest i, and others may not have run.
template <class F>
void each_on(Tasks *tasks, size_t n, size_t grain, F &&f) {
  if (!tasks || !tasks->parallel() || n <= grain) {
    for (size_t i = 0; i < n; ++i) f(i);
    return;
  }
  std::mutex lock;
  size_t first = n;
  std::exception_ptr thrown;
  tasks->parallel_for(static_cast<uint32_t>(n), static_cast<uint32_t>(grain),
                      [&](uint32_t begin, uint32_t end) {
                        uint32_t i = begin;
                        try {
                          for (; i < end; ++i) f(size_t{i});
                        } catch (...) {
                          const std::lock_guard held(lock);
                          if (i < first) thrown = std::current_exception();
                          first = std::min(first, size_t{i});
                        }
                      });
  if (thrown) std::rethrow_exception(thrown);
}

// How many forks lie between the process that asked first and this one; 0 where the system tells none. A
// child of fork() has the memory of its parent and one thread. Whoever owns threads compares the count with
// that of the time when they were started: in a child they are not there, to be called or to be waited for.
uint32_t forks() noexcept;

}  // namespace dfm
