// A compute device by Vulkan 1.1, found at run time: nothing is linked, and without a driver a sentence says
// what is missing.
#pragma once
#define VK_NO_PROTOTYPES
#include <vulkan/vulkan_core.h>

#include <memory>
#include <mutex>
#include <string>

#include "../model_common/entry.h"
#include "stepper.h"

// The functions that are used, by what hands them out.
// clang-format off
#define DEFORM_GPU_OF_INSTANCE(X) \
  X(DestroyInstance) X(EnumeratePhysicalDevices) X(GetPhysicalDeviceProperties) X(GetPhysicalDeviceFeatures) \
  X(GetPhysicalDeviceQueueFamilyProperties) X(GetPhysicalDeviceMemoryProperties) X(CreateDevice) \
  X(GetDeviceProcAddr)
#define DEFORM_GPU_OF_DEVICE(X) \
  X(DestroyDevice) X(GetDeviceQueue) X(DeviceWaitIdle) X(QueueSubmit) X(CreateBuffer) X(DestroyBuffer) \
  X(GetBufferMemoryRequirements) X(BindBufferMemory) X(AllocateMemory) X(FreeMemory) X(MapMemory) \
  X(CreateShaderModule) X(DestroyShaderModule) X(CreateDescriptorSetLayout) X(DestroyDescriptorSetLayout) \
  X(CreatePipelineLayout) X(DestroyPipelineLayout) X(CreateComputePipelines) X(DestroyPipeline) \
  X(CreateDescriptorPool) X(DestroyDescriptorPool) X(AllocateDescriptorSets) X(UpdateDescriptorSets) \
  X(CreateCommandPool) X(DestroyCommandPool) X(AllocateCommandBuffers) X(BeginCommandBuffer) \
  X(EndCommandBuffer) X(CmdBindPipeline) X(CmdBindDescriptorSets) X(CmdPushConstants) X(CmdDispatch) \
  X(CmdPipelineBarrier) X(CmdCopyBuffer) X(CreateFence) X(DestroyFence) X(ResetFences) X(WaitForFences)
// clang-format on

namespace gpu {

void must(VkResult result, const char *what);  // throws std::string: a sentence without its full stop

// Which device: the best one, one that is no software driver, a software driver.
enum class Wanted : uint32_t { automatic, hardware, software };

// A device with the pipelines of the kernels; several bodies share it.
class Vulkan {
 public:
  explicit Vulkan(Wanted wanted);  // throws std::string: a sentence without its full stop
  ~Vulkan();
  Vulkan(const Vulkan &) = delete;

  std::string name;
  bool software = false;  // its driver computes on the processor
  VkPhysicalDeviceLimits limits{};
  VkDevice device = VK_NULL_HANDLE;
  uint32_t family = 0;
  VkDescriptorSetLayout set_layout = VK_NULL_HANDLE;
  VkPipelineLayout layout = VK_NULL_HANDLE;
  VkPipeline pipeline[kKernels][kCombinations] = {};  // made where a body needs them
#define DEFORM_GPU_DECLARE(name) PFN_vk##name name = nullptr;
  DEFORM_GPU_OF_INSTANCE(DEFORM_GPU_DECLARE)
  DEFORM_GPU_OF_DEVICE(DEFORM_GPU_DECLARE)
#undef DEFORM_GPU_DECLARE

  // Memory that the device reads fastest, or that the processor reads and writes (mapped); throws.
  uint32_t memory_type(uint32_t allowed, bool mapped) const;
  VkResult submit(VkCommandBuffer commands, VkFence done);
  void need(Kernel kernel, uint32_t options);  // makes the pipeline; throws

 private:
  VkInstance instance_ = VK_NULL_HANDLE;
  VkPhysicalDeviceMemoryProperties memory_{};
  VkQueue queue_ = VK_NULL_HANDLE;
  std::mutex one_;  // a queue takes one call at a time

  void open_instance();
  VkPhysicalDevice choose(Wanted wanted);
  void open_device(VkPhysicalDevice chosen);
  void make_layout();
  void close();
};

}  // namespace gpu
