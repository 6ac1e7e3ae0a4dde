#include "core/aside.h"

#include <condition_variable>
#include <deque>
#include <mutex>
#include <thread>
#if defined(__linux__)
#include <sched.h>
#endif

#include "core/float_env.h"
#include "core/tasks.h"

namespace dfm {
namespace {

// Only the time that nothing else wants: on the core of the steps, what is left between them.
void take_what_is_left() noexcept {
#if defined(__linux__)
  const sched_param none{};
  sched_setscheduler(0, SCHED_IDLE, &none);  // of this thread; refused: it works at the usual priority
#endif
}

}  // namespace

struct Aside::Room {
  std::mutex mutex;  // of the list
  std::condition_variable begin;
  std::deque<std::shared_ptr<Job>> jobs;
  bool stop = false;
  std::thread thread;

  void work() {
    take_what_is_left();
    const Tasks::Alone alone;  // the workers belong to the steps
    const UsualFloatEnv usual;
    for (;;) {
      std::shared_ptr<Job> job;  // may be the last that holds it: it goes without the lock
      {
        std::unique_lock lock(mutex);
        begin.wait(lock, [&] { return stop || !jobs.empty(); });
        if (stop) return;
        job = std::move(jobs.front());
        jobs.pop_front();
      }
      Job::State state = Job::waits;
      if (!job->state_.compare_exchange_strong(state, Job::runs)) continue;
      job->run();
      job->state_ = Job::done;
    }
  }

  // Not locked: the thread, which holds the lock for less than a microsecond, has been suspended meanwhile.
  std::unique_lock<std::mutex> locked() {
    const auto until = std::chrono::steady_clock::now() + std::chrono::microseconds(50);
    std::unique_lock lock(mutex, std::try_to_lock);
    while (!lock && std::chrono::steady_clock::now() < until) lock.try_lock();
    return lock;
  }
};

Aside::Aside() : room_(std::make_unique<Room>()) {}

Aside::~Aside() {
  {
    const std::lock_guard lock(room_->mutex);
    room_->stop = true;
  }
  room_->begin.notify_all();
  if (room_->thread.joinable()) room_->thread.join();
}

void Aside::start(std::shared_ptr<Job> job) noexcept {
  try {
    if (!room_->thread.joinable()) room_->thread = std::thread([this] { room_->work(); });
    {
      const std::unique_lock lock = room_->locked();
      if (!lock) return;
      room_->jobs.push_back(std::move(job));
    }
    room_->begin.notify_one();
  } catch (...) {  // no thread, or no memory: who needs it does it
  }
}

bool Aside::finish(const std::shared_ptr<Job> &job, std::chrono::microseconds most) {
  Job::State state = Job::waits;
  if (job->state_.compare_exchange_strong(state, Job::left)) {
    // Its memory is not held until the thread comes to it.
    if (const std::unique_lock lock = room_->locked()) std::erase(room_->jobs, job);
    return false;
  }
  const auto until = std::chrono::steady_clock::now() + most;
  // asleep, since the thread may need this core
  while (job->state_ == Job::runs && std::chrono::steady_clock::now() < until)
    std::this_thread::sleep_for(std::chrono::microseconds(20));
  return job->state_ == Job::done;
}

}  // namespace dfm
