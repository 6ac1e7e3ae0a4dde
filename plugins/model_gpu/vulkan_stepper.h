// Moves the points of a body on a device. The arrays of Stepper are memory that the device copies from and
// to; a run is one submission: copies of what has changed, the sub-steps, the copy back.
#pragma once
#include "stepper.h"
#include "vulkan.h"

namespace gpu {

class VulkanStepper : public Stepper {
 public:
  VulkanStepper(std::shared_ptr<Vulkan> vulkan, uint32_t npoint);  // throws std::string
  ~VulkanStepper() override;
  void take(const Work &work) override;
  const char *run(uint32_t n, double h, const Dampers &dampers, bool moved, bool loaded) override;
  const char *device() const override { return vulkan_->name.c_str(); }
  bool on_processor() const override { return vulkan_->software; }

 private:
  struct Array {
    VkBuffer buffer = VK_NULL_HANDLE;
    VkDeviceMemory memory = VK_NULL_HANDLE;
    void *mapped = nullptr;
    size_t bytes = 0;
  };
  // Sub-steps from array `from` on, with the copies before and after them.
  struct Batch {
    uint32_t n = 0, from = 0;
    bool moved = false, loaded = false, seen = false;
    double h = 0;
    Dampers dampers;
    bool operator==(const Batch &) const = default;
  };
  static constexpr uint32_t kBatches = 16;
  static constexpr uint32_t kMaxSteps = 1024;  // of a batch: a driver ends what computes for seconds

  std::shared_ptr<Vulkan> vulkan_;
  uint32_t npoint_, now_ = 0;  // which of place_, speed_ and seen_ is the present
  Work work_{};
  Array place_[2], speed_[2], seen_[2], load_, own_[kBindings], rate_, shared_, stretch_, shared_stretch_;
  VkDescriptorPool sets_ = VK_NULL_HANDLE;
  VkDescriptorSet set_[2] = {};
  VkCommandPool pool_ = VK_NULL_HANDLE;
  VkCommandBuffer commands_[kBatches] = {}, once_ = VK_NULL_HANDLE;
  Batch recorded_[kBatches];
  VkFence done_ = VK_NULL_HANDLE;

  size_t bytes() const { return sizeof(dvec4) * npoint_; }
  void make(Array &array, size_t size, bool mapped);
  void drop(Array &array);
  void open();
  void close();
  void describe();
  VkResult begin(VkCommandBuffer commands) const;
  void order(VkCommandBuffer commands, VkPipelineStageFlags before, VkPipelineStageFlags after) const;
  VkResult finish(VkCommandBuffer commands);
  VkResult record(VkCommandBuffer commands, const Batch &batch) const;
  void upload(const Array &to, const void *from, size_t size);
};

}  // namespace gpu
