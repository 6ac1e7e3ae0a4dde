// What a terminal is shown of anything that lasts over two seconds.
#pragma once
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <string>
#include <thread>

namespace cli {

class Progress {
 public:
  explicit Progress(bool wanted);
  ~Progress();  // wipes the line
  // Cheap: draws ten times a second at most. drawing: s that the pictures took so far.
  void show(double done, double total, double steps_per_second, uint64_t pictures = 0, double drawing = 0);

 private:
  using Clock = std::chrono::steady_clock;
  bool on_, drawn_ = false;
  Clock::time_point begin_, next_;
};

// For one call that does not know its end before it has it: a terminal shows what is being done and for how
// long, as long as this lives.
class Patience {
 public:
  Patience(bool wanted, std::string what, std::chrono::milliseconds wait = std::chrono::seconds(2));
  ~Patience();  // wipes the line

 private:
  void run(std::chrono::milliseconds wait);
  std::string what_;
  std::mutex mutex_;
  std::condition_variable changed_;
  bool done_ = false;
  std::thread thread_;
};

}  // namespace cli
