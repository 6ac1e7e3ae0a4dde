// A progress bar on a terminal, for runs that last over two seconds.
#pragma once
#include <chrono>

namespace cli {

class Progress {
 public:
  explicit Progress(bool wanted);
  ~Progress();  // wipes the line
  void show(double done, double total, double steps_per_second);  // cheap: draws ten times a second at most

 private:
  using Clock = std::chrono::steady_clock;
  bool on_, drawn_ = false;
  Clock::time_point begin_, next_;
};

}  // namespace cli
