// A thread of low priority that does jobs beside the steps, one after the other. A job has inputs of its own
// and gives the same result whoever does it: who needs one that is not done does it himself. On a full
// machine the thread may be stopped anywhere for long, so no step waits for a lock that it holds.
#pragma once
#include <atomic>
#include <chrono>
#include <memory>

namespace dfm {

class Aside {
 public:
  class Job {
   public:
    virtual ~Job() = default;
    virtual void run() noexcept = 0;

   private:
    friend class Aside;
    enum State { waits, runs, done, left };
    std::atomic<State> state_{waits};
  };

  Aside();
  ~Aside();  // waits for the job that runs; the others are dropped
  // Where no thread can be made, or it has stopped while it took a job, this one does not begin.
  void start(std::shared_ptr<Job> job) noexcept;
  // Whether it is done, `most` from now at the latest. false: it will not begin any more, but may run still.
  bool finish(const std::shared_ptr<Job> &job, std::chrono::microseconds most);

 private:
  struct Room;
  std::unique_ptr<Room> room_;
};

}  // namespace dfm
