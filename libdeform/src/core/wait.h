// Waits until ready() holds, in which the lock is held. std::condition_variable::wait() does the same; with
// glibc by the newest symbol of gcc 12's library, which systems of 2021 lack (tests/python/test_wheel.py).
#pragma once
#include <condition_variable>
#include <mutex>
#ifdef __GLIBC__
#include <pthread.h>
#endif

namespace dfm {

template <class Ready>
void wait(std::condition_variable &changed, std::unique_lock<std::mutex> &lock, const Ready &ready) {
#ifdef __GLIBC__
  while (!ready()) pthread_cond_wait(changed.native_handle(), lock.mutex()->native_handle());
#else
  changed.wait(lock, ready);
#endif
}

}  // namespace dfm
