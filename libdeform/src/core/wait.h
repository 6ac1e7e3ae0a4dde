// Waits until ready() holds, in which the lock is held. std::condition_variable::wait() would ask for the
// newest symbol of gcc 12's library, which systems of 2021 lack (tests/python/test_wheel.py).
#pragma once
#include <chrono>
#include <condition_variable>
#include <mutex>

namespace dfm {

template <class Ready>
void wait(std::condition_variable &changed, std::unique_lock<std::mutex> &lock, const Ready &ready) {
  while (!changed.wait_for(lock, std::chrono::hours(1), ready)) {}
}

}  // namespace dfm
