#include "progress.h"

#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <string>

#include "shown.h"

namespace cli {

Progress::Progress(bool wanted)
    : on_(wanted && isatty(STDERR_FILENO)), begin_(Clock::now()), next_(begin_ + std::chrono::seconds(2)) {}

Progress::~Progress() {
  if (drawn_) std::fprintf(stderr, "\r\033[K");
}

void Progress::show(double done, double total, double steps_per_second, uint64_t pictures, double drawing) {
  if (!on_) return;
  const Clock::time_point now = Clock::now();
  if (now < next_) return;
  next_ = now + std::chrono::milliseconds(100);
  const double part = total > 0 ? std::clamp(done / total, 0.0, 1.0) : 0.0;
  const double elapsed = std::chrono::duration<double>(now - begin_).count();
  const int width = 32, filled = int(part * width);
  char drawn[64] = "";
  if (pictures)
    std::snprintf(drawn, sizeof drawn, "  %llu pictures took %.0f s of %.0f s",
                  static_cast<unsigned long long>(pictures), drawing, elapsed);
  std::fprintf(stderr, "\r[%s%s] %3.0f %%  t = %.3f s of %g s  %.*f steps/s%s  %.0f s left \033[K",
               std::string(size_t(filled), '#').c_str(), std::string(size_t(width - filled), '.').c_str(),
               100 * part, done, total, steps_per_second < 10 ? 1 : 0, steps_per_second, drawn,
               part > 0 ? elapsed / part * (1 - part) : 0.0);
  std::fflush(stderr);
  drawn_ = true;
}

Patience::Patience(bool wanted, std::string what, std::chrono::milliseconds wait) : what_(shown(what)) {
  if (wanted && isatty(STDERR_FILENO)) thread_ = std::thread([this, wait] { run(wait); });
}

Patience::~Patience() {
  if (!thread_.joinable()) return;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    done_ = true;
  }
  changed_.notify_one();
  thread_.join();
}

void Patience::run(std::chrono::milliseconds wait) {
  using Clock = std::chrono::steady_clock;
  const Clock::time_point begin = Clock::now();
  std::unique_lock<std::mutex> lock(mutex_);
  bool drawn = false;
  auto next = begin + wait;
  while (!changed_.wait_until(lock, next, [this] { return done_; })) {
    std::fprintf(stderr, "\r%s, %.0f s \033[K", what_.c_str(),
                 std::chrono::duration<double>(Clock::now() - begin).count());
    std::fflush(stderr);
    drawn = true;
    next += std::chrono::seconds(1);
  }
  if (drawn) std::fprintf(stderr, "\r\033[K");
}

}  // namespace cli
