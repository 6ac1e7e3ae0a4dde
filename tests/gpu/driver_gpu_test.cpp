// A driver that fails in a call: the step says so, and the next one is taken where the driver works again.
#include <gtest/gtest.h>

#include <cstdlib>
#include <utility>

#include "model_gpu/springs.h"
#include "model_gpu/vulkan_stepper.h"

namespace {

using namespace gpu;

dfm_host services() {
  dfm_host h{};
  h.size = sizeof h;
  h.abi = DFM_ABI;
  h.alloc = [](void *, size_t bytes, size_t align) {
    return std::aligned_alloc(align, (bytes + align - 1) / align * align);
  };
  h.release = [](void *, void *p, size_t, size_t) { std::free(p); };
  return h;
}

// A point without springs that moves by 1 m/s.
struct Moving {
  dfm_host host = services();
  Springs none;
  std::shared_ptr<Vulkan> vulkan;
  std::unique_ptr<VulkanStepper> stepper;
  std::string missing;
  Moving() {
    try {
      vulkan = std::make_shared<Vulkan>(Wanted::automatic);
    } catch (const std::string &why) {
      missing = why;
      return;
    }
    none.lay_out(&host, 1, 0, nullptr);
    stepper = std::make_unique<VulkanStepper>(vulkan, 1);
    stepper->take(none.work());
    stepper->place[0] = {0, 0, 0, 1};
    stepper->speed[0] = {1, 0, 0, 0};
  }
  const char *run() { return stepper->run(2, 0.5, {}, true, true); }
};

template <auto Call, class Broken>
void expect_reported(Broken broken) {
  Moving one;
  if (!one.stepper) GTEST_SKIP() << one.missing;
  const auto works = std::exchange((*one.vulkan).*Call, broken);
  const char *const why = one.run();
  ASSERT_NE(why, nullptr);
  EXPECT_NE(std::string(why).find("take the model without _gpu"), std::string::npos) << why;
  (*one.vulkan).*Call = works;
  EXPECT_EQ(one.run(), nullptr);
  EXPECT_EQ(one.stepper->place[0].x, 1);
}

TEST(GpuDriver, ThatBeginsNoCommands_IsReported) {
  expect_reported<&Vulkan::BeginCommandBuffer>(
      [](VkCommandBuffer, const VkCommandBufferBeginInfo *) { return VK_ERROR_OUT_OF_HOST_MEMORY; });
}

TEST(GpuDriver, ThatEndsNoCommands_IsReported) {
  expect_reported<&Vulkan::EndCommandBuffer>([](VkCommandBuffer) { return VK_ERROR_OUT_OF_DEVICE_MEMORY; });
}

TEST(GpuDriver, ThatTakesNoCommands_IsReported) {
  expect_reported<&Vulkan::QueueSubmit>(
      [](VkQueue, uint32_t, const VkSubmitInfo *, VkFence) { return VK_ERROR_DEVICE_LOST; });
}

TEST(GpuDriver, ThatCopiesNothing_RefusesTheBody) {
  Moving one;
  if (!one.stepper) GTEST_SKIP() << one.missing;
  const auto works = one.vulkan->EndCommandBuffer;
  one.vulkan->EndCommandBuffer = [](VkCommandBuffer) { return VK_ERROR_OUT_OF_DEVICE_MEMORY; };
  EXPECT_THROW(one.stepper->take(one.none.work()), std::string);
  one.vulkan->EndCommandBuffer = works;
  EXPECT_NE(one.run(), nullptr);  // not with half of its arrays
  one.stepper->take(one.none.work());
  EXPECT_EQ(one.run(), nullptr);
  EXPECT_EQ(one.stepper->place[0].x, 1);
}

}  // namespace
