#include "core/tasks.h"

#include <gtest/gtest.h>
#if defined(__unix__)
#include <sys/wait.h>
#include <unistd.h>
#endif

#include <algorithm>
#include <atomic>
#include <chrono>
#include <memory>
#include <mutex>
#include <random>
#include <set>
#include <thread>
#include <vector>

namespace {

using namespace dfm;

// Every number of [0,n) once, in blocks that begin at multiples of grain.
void expect_once(Tasks &tasks, uint32_t n, uint32_t grain, const char *what) {
  std::vector<std::atomic<int>> hit(n);
  std::atomic<int> crooked{0};
  tasks.parallel_for(n, grain, [&](uint32_t begin, uint32_t end) {
    crooked += begin % std::max(1u, grain) != 0 || end > n;
    for (uint32_t i = begin; i < end; ++i) ++hit[i];
  });
  EXPECT_TRUE(std::all_of(hit.begin(), hit.end(), [](const auto &h) { return h == 1; })) << what;
  EXPECT_EQ(crooked, 0) << what;
}

TEST(Tasks, JobsOnOneToEightThreads_RunEachBlockOnce) {
  std::mt19937 random(1);
  for (uint32_t threads = 1; threads <= 8; ++threads) {
    Tasks tasks(threads, nullptr, nullptr);
    for (int job = 0; job < 400; ++job) expect_once(tasks, random() % 50, random() % 8, "in turn");
  }
}

// Workers sleep between the jobs, or between the worlds' steps, or wake while one opens.
TEST(Tasks, JobsAfterPausesOnThreeThreads_RunEachBlockOnce) {
  Tasks tasks(3, nullptr, nullptr);
  for (int pause = 0; pause < 40; ++pause) {
    std::this_thread::sleep_for(std::chrono::microseconds(60 * (pause % 8)));
    const Tasks::Step awake(tasks);
    for (int job = 0; job < 5; ++job) expect_once(tasks, 9, 1, "after a pause");
  }
}

TEST(Tasks, AJobWithinAJobOnFourThreads_RunsOnTheCallingThread) {
  Tasks tasks(4, nullptr, nullptr);
  std::atomic<int> other{0};
  tasks.parallel_for(16, 1, [&](uint32_t, uint32_t) {
    const auto here = std::this_thread::get_id();
    tasks.parallel_for(8, 1, [&](uint32_t, uint32_t) { other += std::this_thread::get_id() != here; });
  });
  EXPECT_EQ(other, 0);
}

#if defined(__unix__)
// The child has the pool, but none of its threads.
TEST(Tasks, InAChildOfFork_RunsAndEndsWithoutWorkers) {
  auto tasks = std::make_unique<Tasks>(3, nullptr, nullptr);
  for (const int pause : {0, 50, 1000}) {  // workers spin, fall asleep, sleep
    expect_once(*tasks, 50, 1, "in the parent");
    std::this_thread::sleep_for(std::chrono::microseconds(pause));
    const pid_t child = fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
      alarm(10);  // ends a child that waits for what is not there
      uint32_t sum = 0;
      const auto owner = std::this_thread::get_id();
      tasks->parallel_for(50, 1, [&](uint32_t begin, uint32_t end) {
        sum += std::this_thread::get_id() == owner ? end - begin : 1000;
      });
      tasks.reset();
      _exit(sum == 50 ? 0 : 1);
    }
    int status = -1;
    ASSERT_EQ(waitpid(child, &status, 0), child);
    EXPECT_EQ(status, 0) << "pause " << pause << " us";
  }
  expect_once(*tasks, 50, 1, "in the parent, afterwards");
}
#endif

TEST(Tasks, TwoOwnersOnTwoThreads_DoNotDisturbEachOther) {
  Tasks tasks(3, nullptr, nullptr);
  const auto work = [&] {
    for (int job = 0; job < 300; ++job) expect_once(tasks, 7, 1, "beside another owner");
  };
  std::thread beside(work);
  work();
  beside.join();
}

// Threads that a job calls: no more than blocks, and no more than pay for being called.
TEST(Tasks, AJobOfFewBlocksOnManyThreads_CallsFewOfThem) {
  EXPECT_EQ(Tasks::useful(1, 64), 1u);
  EXPECT_EQ(Tasks::useful(2, 64), 2u);
  EXPECT_EQ(Tasks::useful(10, 4), 4u);
  EXPECT_LT(Tasks::useful(30, 64), 24u);
  EXPECT_EQ(Tasks::useful(1000, 64), 64u);
  for (uint32_t blocks = 1; blocks < 300; ++blocks)
    EXPECT_GE(Tasks::useful(blocks + 1, 64), Tasks::useful(blocks, 64)) << blocks;
}

// Of eight threads a job of two blocks always has the same two: data stay in the caches of their cores.
TEST(Tasks, JobsOfTwoBlocksOnEightThreads_RunOnTheSameTwo) {
  Tasks tasks(8, nullptr, nullptr);
  std::mutex mutex;
  std::set<std::thread::id> seen;
  for (int job = 0; job < 500; ++job) {
    if (job % 50 == 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    tasks.parallel_for(2, 1, [&](uint32_t, uint32_t) {
      const std::lock_guard lock(mutex);
      seen.insert(std::this_thread::get_id());
    });
  }
  EXPECT_LE(seen.size(), 2u);
}

// More threads than processors are of no use, and would wake and sleep in each job.
TEST(Tasks, JobsOfTooManyThreads_UseAsManyAsProcessors) {
  const uint32_t processors = std::thread::hardware_concurrency();
  if (!processors) GTEST_SKIP() << "the number of processors is not known";
  Tasks tasks(processors + 6, nullptr, nullptr);
  std::mutex mutex;
  std::set<std::thread::id> seen;
  for (int job = 0; job < 50; ++job)
    tasks.parallel_for(1000, 1, [&](uint32_t, uint32_t) {
      const std::lock_guard lock(mutex);
      seen.insert(std::this_thread::get_id());
    });
  EXPECT_LE(seen.size(), std::max(2u, processors));
  EXPECT_EQ(tasks.threads(), std::max(2u, processors));
}

TEST(Tasks, ExceptionsOnThreeThreads_ReachTheCallerAsThatOfTheLowestNumber) {
  Tasks tasks(3, nullptr, nullptr);
  for (int pass = 0; pass < 20; ++pass) {
    std::vector<std::atomic<int>> hit(100);
    try {
      each_on(&tasks, hit.size(), 1, [&](size_t i) {
        ++hit[i];
        if (i % 10 == 7) throw i;
      });
      FAIL();
    } catch (size_t i) {
      EXPECT_EQ(i, 7u);
    }
    EXPECT_TRUE(std::all_of(hit.begin(), hit.end(), [](const auto &h) { return h == 1; }));
  }
}

// A job does not end before its last block has, also where that takes so long that the owner sleeps.
TEST(Tasks, ALongBlockOnTwoThreads_IsWaitedFor) {
  Tasks tasks(2, nullptr, nullptr);
  for (int job = 0; job < 4; ++job) {
    std::atomic<int> done{0};
    const auto owner = std::this_thread::get_id();
    tasks.parallel_for(2, 1, [&](uint32_t, uint32_t) {
      if (std::this_thread::get_id() != owner) std::this_thread::sleep_for(std::chrono::milliseconds(6));
      else std::this_thread::sleep_for(std::chrono::milliseconds(1));
      ++done;
    });
    EXPECT_EQ(done, 2);
  }
}

}  // namespace
