#include "core/background.h"

#include <algorithm>
#include <deque>
#include <thread>
#include <utility>
#if defined(__linux__)
#include <pthread.h>
#include <sched.h>
#include <time.h>
#endif

#include "core/float_env.h"
#include "core/tasks.h"
#include "core/wait.h"

namespace dfm {
namespace {

// Only the time that nothing else wants: on the core of the steps, what is left between them.
void take_what_is_left() noexcept {
#if defined(__linux__)
  const sched_param none{};
  sched_setscheduler(0, SCHED_IDLE, &none);  // of this thread; refused: it works at the usual priority
#endif
}

// How much of the time another thread works.
class Worked {
 public:
#if defined(__linux__)
  explicit Worked(std::thread &thread)
      : known_(pthread_getcpuclockid(thread.native_handle(), &clock_) == 0), since_(now()) {}
  // Has it worked for half of this time or more since the last call?
  bool half_of(std::chrono::nanoseconds time) {
    const auto before = since_;
    since_ = now();
    return known_ && 2 * (since_ - before) >= time;
  }

 private:
  std::chrono::nanoseconds now() {
    timespec t{};
    known_ = known_ && clock_gettime(clock_, &t) == 0;
    return std::chrono::seconds(t.tv_sec) + std::chrono::nanoseconds(t.tv_nsec);
  }
  clockid_t clock_{};
  bool known_;
  std::chrono::nanoseconds since_;
#else
  explicit Worked(std::thread &) {}
  bool half_of(std::chrono::nanoseconds) { return false; }  // unknown on this system
#endif
};

struct Dropped : Background::Job {
  std::shared_ptr<void> what;
  explicit Dropped(std::shared_ptr<void> &&w) : what(std::move(w)) {}
  void run() noexcept override { what.reset(); }
};

}  // namespace

struct Background::Room {
  std::mutex mutex;  // of the list
  std::condition_variable begin;
  std::deque<std::shared_ptr<Job>> jobs;
  bool stop = false;
  std::thread thread;
  const uint32_t of_process = forks();  // whose thread it is

  void work() {
    take_what_is_left();
    const Tasks::Alone alone;  // the workers belong to the steps
    const UsualFloatEnv usual;
    for (;;) {
      std::shared_ptr<Job> job;  // may be the last that holds it: it goes without the lock
      {
        std::unique_lock lock(mutex);
        wait(begin, lock, [&] { return stop || !jobs.empty(); });
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
    while (!lock && std::chrono::steady_clock::now() < until && !lock.try_lock()) {}
    return lock;
  }
};

Background::Background() : room_(std::make_unique<Room>()) {}

Background::~Background() {
  if (room_->of_process != forks()) {  // the thread cannot be joined, nor what it waits for destroyed
    (void)room_.release();
    return;
  }
  {
    const std::lock_guard lock(room_->mutex);
    room_->stop = true;
  }
  room_->begin.notify_all();
  if (room_->thread.joinable()) room_->thread.join();
}

void Background::start(std::shared_ptr<Job> job) noexcept {
  if (room_->of_process != forks()) return;
  try {
    {
      const std::unique_lock lock = room_->locked();
      if (!lock) return;
      room_->jobs.push_back(std::move(job));
    }
    // made where the first job is there: a new thread that looks for one would hold the lock
    if (!room_->thread.joinable()) room_->thread = std::thread([this] { room_->work(); });
    room_->begin.notify_one();
  } catch (...) {  // no thread, or no memory: who needs it does it
  }
}

bool Background::finish(const std::shared_ptr<Job> &job, std::chrono::microseconds patience) {
  Job::State state = Job::waits;
  if (job->state_.compare_exchange_strong(state, Job::left)) {
    // Its memory is not held until the thread comes to it.
    if (const std::unique_lock lock = room_->locked()) std::erase(room_->jobs, job);
    return false;
  }
  if (job->state_ == Job::done) return true;
  using Clock = std::chrono::steady_clock;
  Worked worked(room_->thread);
  const auto begin = Clock::now();
  auto since = begin, now = begin;
  while (job->state_ == Job::runs) {
    // asleep, since the thread may need this core; longer each time, since waking up takes time too
    constexpr Clock::duration kShort = std::chrono::microseconds(20), kLong = std::chrono::microseconds(500);
    std::this_thread::sleep_for(std::clamp((now - begin) / 4, kShort, kLong));
    now = Clock::now();
    if (now - since < patience) continue;
    if (!worked.half_of(now - since)) break;
    since = now;
  }
  return job->state_ == Job::done;
}

void Background::drop(std::shared_ptr<void> what) noexcept {
  if (dropped_) finish(dropped_, std::chrono::microseconds(0));
  dropped_.reset();
  try {
    dropped_ = std::make_shared<Dropped>(std::move(what));
    start(dropped_);
  } catch (...) {  // no memory: it goes here
  }
}

}  // namespace dfm
