// A thread of low priority that does jobs beside the steps, one after the other. A job has inputs of its own
// and gives the same result on every thread: a step does itself what is not done in time. On a busy machine
// the thread may be suspended anywhere for long, so no step waits for a lock that it holds.
#pragma once
#include <atomic>
#include <chrono>
#include <memory>

namespace dfm {

class Background {
 public:
  class Job {
   public:
    virtual ~Job() = default;
    virtual void run() noexcept = 0;

   private:
    friend class Background;
    enum State { waits, runs, done, left };
    std::atomic<State> state_{waits};
  };

  Background();
  ~Background();  // waits for the job that runs; the others are dropped
  // The job does not begin if no thread can be made, if the thread is suspended while it holds the list, or
  // in a child of fork(), where the thread is not.
  void start(std::shared_ptr<Job> job) noexcept;
  // Waits for it while it runs: as long as the thread has a core for half of each `patience`, since what is
  // left takes less than the whole would, and otherwise for one. false: it is not done; it will not begin,
  // but may still be running.
  bool finish(const std::shared_ptr<Job> &job, std::chrono::microseconds patience);
  // Frees it on the thread: large things take long, and a step has no time. The one before goes here if it is
  // still there, so that a thread that does not come to them holds one.
  void drop(std::shared_ptr<void> what) noexcept;

 private:
  struct Room;
  std::unique_ptr<Room> room_;
  std::shared_ptr<Job> dropped_;
};

}  // namespace dfm
