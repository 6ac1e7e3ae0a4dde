// A thread of low priority that does jobs beside the steps, one after the other. A job has inputs of its own
// and gives the same result whoever does it: who needs one that is not done does it himself.
#pragma once
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
    enum { waits, runs, done } state_ = waits;  // under the mutex
  };

  Aside();
  ~Aside();  // waits for the job that runs; the others are dropped
  // Where no thread can be made, no job begins.
  void start(std::shared_ptr<Job> job) noexcept;
  // Whether it is done, `most` from now at the latest. false: it will not begin any more, but may run still.
  bool finish(const std::shared_ptr<Job> &job, std::chrono::microseconds most);

 private:
  struct Room;
  std::unique_ptr<Room> room_;
};

}  // namespace dfm
