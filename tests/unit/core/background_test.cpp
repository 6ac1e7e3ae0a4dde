// Jobs beside the steps: what a step does not wait for takes no memory.
#include "core/background.h"

#include <gtest/gtest.h>
#if defined(__unix__)
#include <sys/wait.h>
#include <unistd.h>
#endif
#include <time.h>

#include <atomic>
#include <chrono>
#include <memory>
#include <thread>

namespace {

using namespace std::chrono_literals;

struct Waits final : dfm::Background::Job {
  std::atomic<bool> begun{false}, end{false};
  void run() noexcept override {
    begun = true;
    while (!end) std::this_thread::sleep_for(1ms);
  }
};

TEST(Background, JobThatIsLeft_IsDroppedBeforeTheThreadComesToIt) {
  const auto first = std::make_shared<Waits>();
  dfm::Background background;
  background.start(first);
  while (!first->begun) std::this_thread::sleep_for(1ms);
  auto second = std::make_shared<Waits>();
  background.start(second);
  EXPECT_FALSE(background.finish(second, 0us));
  const std::weak_ptr<Waits> kept = second;
  second.reset();
  EXPECT_TRUE(kept.expired());
  first->end = true;
  while (!background.finish(first, 1s)) {}
}

TEST(Background, WhatIsDropped_GoesOnTheThread_OneAtATime) {
  const auto first = std::make_shared<Waits>();
  dfm::Background background;
  background.start(first);
  while (!first->begun) std::this_thread::sleep_for(1ms);
  std::thread::id freed_by[2];
  std::atomic<int> freed{0};
  for (std::thread::id &by : freed_by)
    background.drop(std::shared_ptr<int>(new int, [&](int *p) {
      delete p;
      by = std::this_thread::get_id();
      ++freed;
    }));
  EXPECT_EQ(freed, 1);
  EXPECT_EQ(freed_by[0], std::this_thread::get_id());
  first->end = true;
  while (freed < 2) std::this_thread::sleep_for(1ms);
  EXPECT_NE(freed_by[1], std::this_thread::get_id());
}

// On machines that tell how much of the time a thread works.
#if defined(__linux__)
struct Computes final : dfm::Background::Job {
  static double own_time() {
    timespec t{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return double(t.tv_sec) + 1e-9 * double(t.tv_nsec);
  }
  std::atomic<double> took{0};
  void run() noexcept override {
    const double begin = own_time();
    while (took < 0.01) took = own_time() - begin;
  }
};

// It is waited for beyond the patience while it has a core. What is not waited for had less than half of the
// last millisecond, since others took the core.
TEST(Background, JobThatRuns_IsWaitedFor) {
  const auto job = std::make_shared<Computes>();
  dfm::Background background;
  background.start(job);
  while (!(job->took > 0)) std::this_thread::sleep_for(100us);
  const auto begin = std::chrono::steady_clock::now();
  const double had = job->took;
  const bool done = background.finish(job, 1ms);
  const double did = job->took - had;
  const std::chrono::duration<double> time = std::chrono::steady_clock::now() - begin;
  if (!done) {
    EXPECT_LT(did, time.count() - 4e-4);
  }
}
#endif

#if defined(__unix__)
// The child has the list, but not the thread: it does the job itself, and ends.
TEST(Background, InAChildOfFork_BeginsNothingAndIsNotWaitedFor) {
  const auto first = std::make_shared<Waits>();
  dfm::Background *background = new dfm::Background;
  background->start(first);
  while (!first->begun) std::this_thread::sleep_for(1ms);
  first->end = true;
  while (!background->finish(first, 1s)) {}
  const pid_t child = fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    alarm(10);  // ends a child that waits for what is not there
    const auto job = std::make_shared<Waits>();
    background->start(job);
    const bool done = background->finish(job, 1ms);
    delete background;
    _exit(done || job->begun ? 1 : 0);
  }
  int status = -1;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  EXPECT_EQ(status, 0);
  delete background;
}
#endif

TEST(Background, JobThatSleeps_IsNotWaitedFor) {
  const auto job = std::make_shared<Waits>();
  dfm::Background background;
  background.start(job);
  while (!job->begun) std::this_thread::sleep_for(1ms);
  EXPECT_FALSE(background.finish(job, 5ms));
  job->end = true;
  while (!background.finish(job, 1s)) {}
}

}  // namespace
