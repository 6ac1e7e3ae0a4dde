// Jobs beside the steps: what a step does not wait for takes no memory.
#include "core/aside.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <memory>
#include <thread>

namespace {

using namespace std::chrono_literals;

struct Waits final : dfm::Aside::Job {
  std::atomic<bool> begun{false}, end{false};
  void run() noexcept override {
    begun = true;
    while (!end) std::this_thread::sleep_for(1ms);
  }
};

TEST(Aside, JobThatIsLeft_IsDroppedBeforeTheThreadComesToIt) {
  const auto first = std::make_shared<Waits>();
  dfm::Aside aside;
  aside.start(first);
  while (!first->begun) std::this_thread::sleep_for(1ms);
  auto second = std::make_shared<Waits>();
  aside.start(second);
  EXPECT_FALSE(aside.finish(second, 0us));
  const std::weak_ptr<Waits> kept = second;
  second.reset();
  EXPECT_TRUE(kept.expired());
  first->end = true;
  while (!aside.finish(first, 1s)) {}
}

}  // namespace
