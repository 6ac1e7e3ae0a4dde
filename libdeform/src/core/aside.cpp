#include "core/aside.h"

#include <algorithm>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <thread>
#if defined(__linux__)
#include <sched.h>
#endif

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
  std::mutex mutex;
  std::condition_variable begin, end;
  std::deque<std::shared_ptr<Job>> jobs;
  bool stop = false;
  std::thread thread;

  void work() {
    take_what_is_left();
    const Tasks::Alone alone;  // the workers belong to the steps
    for (std::unique_lock lock(mutex);;) {
      begin.wait(lock, [&] { return stop || !jobs.empty(); });
      if (stop) return;
      std::shared_ptr<Job> job = std::move(jobs.front());
      jobs.pop_front();
      job->state_ = Job::runs;
      lock.unlock();
      job->run();
      lock.lock();
      job->state_ = Job::done;
      end.notify_all();
      lock.unlock();
      job.reset();  // outside, as it may be the last who holds it
      lock.lock();
    }
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
      const std::lock_guard lock(room_->mutex);
      room_->jobs.push_back(std::move(job));
    }
    room_->begin.notify_one();
  } catch (...) {  // no thread, or no memory: who needs it does it
  }
}

bool Aside::finish(const std::shared_ptr<Job> &job, std::chrono::microseconds most) {
  std::unique_lock lock(room_->mutex);
  if (job->state_ == Job::waits) {
    std::erase(room_->jobs, job);
    return false;
  }
  return room_->end.wait_for(lock, most, [&] { return job->state_ == Job::done; });
}

}  // namespace dfm
