#include "vulkan_stepper.h"

#include <algorithm>
#include <cstring>
#include <utility>

namespace gpu {
namespace {

constexpr uint32_t kGroup = 64;  // as in points.glsl
constexpr VkPipelineStageFlags kCopy = VK_PIPELINE_STAGE_TRANSFER_BIT,
                               kCompute = VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT,
                               kProcessor = VK_PIPELINE_STAGE_HOST_BIT;

VkAccessFlags writes_of(VkPipelineStageFlags stages) {
  return (stages & kCopy ? VK_ACCESS_TRANSFER_WRITE_BIT : 0) |
         (stages & kCompute ? VK_ACCESS_SHADER_WRITE_BIT : 0) |
         (stages & kProcessor ? VK_ACCESS_HOST_WRITE_BIT : 0);
}
VkAccessFlags reads_of(VkPipelineStageFlags stages) {
  return (stages & kCopy ? VK_ACCESS_TRANSFER_READ_BIT : 0) |
         (stages & kCompute ? VK_ACCESS_SHADER_READ_BIT : 0) |
         (stages & kProcessor ? VK_ACCESS_HOST_READ_BIT : 0);
}

}  // namespace

VulkanStepper::VulkanStepper(std::shared_ptr<Vulkan> vulkan, uint32_t npoint)
    : vulkan_(std::move(vulkan)), npoint_(npoint) {
  try {
    open();
  } catch (...) {
    close();
    throw;
  }
}

VulkanStepper::~VulkanStepper() { close(); }

void VulkanStepper::open() {
  const Vulkan &vk = *vulkan_;
  for (Array *array : {&place_[0], &place_[1], &speed_[0], &speed_[1], &seen_[0], &seen_[1], &load_})
    make(*array, bytes(), false);
  make(rate_, sizeof(uint32_t), true);
  highest_ = static_cast<uint32_t *>(rate_.mapped);
  make(shared_, 4 * bytes(), true);
  place = static_cast<dvec4 *>(shared_.mapped);
  speed = place + npoint_;
  seen = speed + npoint_;
  load = seen + npoint_;
  const VkDescriptorPoolSize size{VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, 2 * kBindings};
  VkDescriptorPoolCreateInfo sets{};
  sets.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO;
  sets.maxSets = 2;
  sets.poolSizeCount = 1;
  sets.pPoolSizes = &size;
  must(vk.CreateDescriptorPool(vk.device, &sets, nullptr, &sets_), "vkCreateDescriptorPool");
  const VkDescriptorSetLayout both[2] = {vk.set_layout, vk.set_layout};
  VkDescriptorSetAllocateInfo take_sets{};
  take_sets.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_SET_ALLOCATE_INFO;
  take_sets.descriptorPool = sets_;
  take_sets.descriptorSetCount = 2;
  take_sets.pSetLayouts = both;
  must(vk.AllocateDescriptorSets(vk.device, &take_sets, set_), "vkAllocateDescriptorSets");
  VkCommandPoolCreateInfo pool{};
  pool.sType = VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO;
  pool.flags = VK_COMMAND_POOL_CREATE_RESET_COMMAND_BUFFER_BIT;
  pool.queueFamilyIndex = vk.family;
  must(vk.CreateCommandPool(vk.device, &pool, nullptr, &pool_), "vkCreateCommandPool");
  VkCommandBuffer all[kBatches + 1];
  VkCommandBufferAllocateInfo commands{};
  commands.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO;
  commands.commandPool = pool_;
  commands.level = VK_COMMAND_BUFFER_LEVEL_PRIMARY;
  commands.commandBufferCount = kBatches + 1;
  must(vk.AllocateCommandBuffers(vk.device, &commands, all), "vkAllocateCommandBuffers");
  std::copy(all, all + kBatches, commands_);
  once_ = all[kBatches];
  VkFenceCreateInfo fence{};
  fence.sType = VK_STRUCTURE_TYPE_FENCE_CREATE_INFO;
  must(vk.CreateFence(vk.device, &fence, nullptr, &done_), "vkCreateFence");
}

void VulkanStepper::close() {
  const Vulkan &vk = *vulkan_;
  vk.DestroyFence(vk.device, done_, nullptr);
  vk.DestroyCommandPool(vk.device, pool_, nullptr);
  vk.DestroyDescriptorPool(vk.device, sets_, nullptr);
  for (Array *array : {&place_[0], &place_[1], &speed_[0], &speed_[1], &seen_[0], &seen_[1], &load_, &rate_,
                       &shared_, &stretch_, &shared_stretch_})
    drop(*array);
  for (Array &array : own_) drop(array);
}

void VulkanStepper::make(Array &array, size_t size, bool mapped) {
  const Vulkan &vk = *vulkan_;
  if (size > vk.limits.maxStorageBufferRange)
    throw "an array of the body takes " + std::to_string(size >> 20) + " MiB, and the device " + vk.name +
        " reads " + std::to_string(vk.limits.maxStorageBufferRange >> 20) + "; take a coarser mesh";
  VkBufferCreateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO;
  info.size = size;
  info.usage = VK_BUFFER_USAGE_STORAGE_BUFFER_BIT | VK_BUFFER_USAGE_TRANSFER_SRC_BIT |
               VK_BUFFER_USAGE_TRANSFER_DST_BIT;
  must(vk.CreateBuffer(vk.device, &info, nullptr, &array.buffer), "vkCreateBuffer");
  VkMemoryRequirements needs;
  vk.GetBufferMemoryRequirements(vk.device, array.buffer, &needs);
  VkMemoryAllocateInfo memory{};
  memory.sType = VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO;
  memory.allocationSize = needs.size;
  memory.memoryTypeIndex = vk.memory_type(needs.memoryTypeBits, mapped);
  must(vk.AllocateMemory(vk.device, &memory, nullptr, &array.memory), "vkAllocateMemory");
  must(vk.BindBufferMemory(vk.device, array.buffer, array.memory, 0), "vkBindBufferMemory");
  if (mapped) must(vk.MapMemory(vk.device, array.memory, 0, VK_WHOLE_SIZE, 0, &array.mapped), "vkMapMemory");
  if (mapped) std::memset(array.mapped, 0, size);
  array.bytes = size;
}

void VulkanStepper::drop(Array &array) {
  vulkan_->DestroyBuffer(vulkan_->device, array.buffer, nullptr);
  vulkan_->FreeMemory(vulkan_->device, array.memory, nullptr);
  array = {};
}

// Set 0 reads the first of two arrays and writes the second, set 1 the reverse. That of the rate stands for
// arrays that a kernel names and its options leave out.
void VulkanStepper::describe() {
  const Vulkan &vk = *vulkan_;
  for (uint32_t s = 0; s < 2; ++s) {
    VkBuffer buffers[kBindings] = {place_[s].buffer,     speed_[s].buffer,     load_.buffer,
                                   place_[1 - s].buffer, speed_[1 - s].buffer, seen_[s].buffer,
                                   seen_[1 - s].buffer,  rate_.buffer,         stretch_.buffer};
    for (uint32_t n = kOwn; n < kBindings; ++n) buffers[n] = own_[n].buffer;
    for (uint32_t b = 0; b < kBindings; ++b) {
      const VkDescriptorBufferInfo whole{buffers[b] ? buffers[b] : rate_.buffer, 0, VK_WHOLE_SIZE};
      VkWriteDescriptorSet write{};
      write.sType = VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET;
      write.dstSet = set_[s];
      write.dstBinding = b;
      write.descriptorCount = 1;
      write.descriptorType = VK_DESCRIPTOR_TYPE_STORAGE_BUFFER;
      write.pBufferInfo = &whole;
      vk.UpdateDescriptorSets(vk.device, 1, &write, 0, nullptr);
    }
  }
}

VkResult VulkanStepper::begin(VkCommandBuffer commands) const {
  VkCommandBufferBeginInfo info{};
  info.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO;
  return vulkan_->BeginCommandBuffer(commands, &info);
}

void VulkanStepper::order(VkCommandBuffer commands, VkPipelineStageFlags before,
                          VkPipelineStageFlags after) const {
  VkMemoryBarrier barrier{};
  barrier.sType = VK_STRUCTURE_TYPE_MEMORY_BARRIER;
  barrier.srcAccessMask = writes_of(before);
  barrier.dstAccessMask = reads_of(after) | writes_of(after);
  vulkan_->CmdPipelineBarrier(commands, before, after, 0, 1, &barrier, 0, nullptr, 0, nullptr);
}

VkResult VulkanStepper::finish(VkCommandBuffer commands) {
  const Vulkan &vk = *vulkan_;
  VkResult result = vk.ResetFences(vk.device, 1, &done_);
  if (result == VK_SUCCESS) result = vulkan_->submit(commands, done_);
  return result == VK_SUCCESS ? vk.WaitForFences(vk.device, 1, &done_, VK_TRUE, ~uint64_t{0}) : result;
}

void VulkanStepper::upload(const Array &to, const void *from, size_t size) {
  Array staging;
  try {
    make(staging, size, true);
    std::memcpy(staging.mapped, from, size);
    must(begin(once_), "vkBeginCommandBuffer");
    const VkBufferCopy all{0, 0, size};
    vulkan_->CmdCopyBuffer(once_, staging.buffer, to.buffer, 1, &all);
    must(vulkan_->EndCommandBuffer(once_), "vkEndCommandBuffer");
    must(finish(once_), "a copy of the body");
  } catch (...) {
    drop(staging);
    throw;
  }
  drop(staging);
}

// Arrays whose size has changed are made anew, and what was recorded with the old ones is not used again.
void VulkanStepper::take(const Work &work) {
  for (uint32_t p = 0; p < work.npass; ++p) {
    if ((work.pass[p].count + kGroup - 1) / kGroup > vulkan_->limits.maxComputeWorkGroupCount[0])
      throw "the body has more points or cells than the device " + vulkan_->name +
          " takes in one call; take a coarser mesh";
    vulkan_->need(work.pass[p].kernel, work.pass[p].options);
  }
  bool anew = work.npass != work_.npass || !std::equal(work.pass, work.pass + work.npass, work_.pass);
  work_.npass = 0;  // until all of it is on the device
  const auto remake = [&](Array &array, size_t bytes, bool mapped) {
    if (array.bytes == bytes) return;
    anew = true;
    drop(array);
    if (bytes) make(array, bytes, mapped);
  };
  for (uint32_t n = kOwn; n < kBindings; ++n) remake(own_[n], work.array[n].bytes, false);
  remake(stretch_, sizeof(double) * work.nstretch, false);
  remake(shared_stretch_, sizeof(double) * work.nstretch, true);
  stretch = static_cast<double *>(shared_stretch_.mapped);
  if (anew) {
    std::fill(recorded_, recorded_ + kBatches, Batch{});
    describe();
  }
  for (uint32_t n = kOwn; n < kBindings; ++n)
    if (work.array[n].data) upload(own_[n], work.array[n].data, work.array[n].bytes);
  work_ = work;
}

VkResult VulkanStepper::record(VkCommandBuffer commands, const Batch &batch) const {
  const Vulkan &vk = *vulkan_;
  const auto copy = [&](const Array &from, size_t at, const Array &to, size_t to_at) {
    const VkBufferCopy part{at, to_at, bytes()};
    vk.CmdCopyBuffer(commands, from.buffer, to.buffer, 1, &part);
  };
  const VkBufferCopy stretches{0, 0, stretch_.bytes};
  if (const VkResult begun = begin(commands); begun != VK_SUCCESS) return begun;
  order(commands, kCompute | kCopy | kProcessor, kCompute | kCopy);
  const bool lagged = batch.dampers.per_lag > 0;
  if (batch.moved) {
    copy(shared_, 0, place_[batch.from], 0);
    copy(shared_, bytes(), speed_[batch.from], 0);
    if (lagged) copy(shared_, 2 * bytes(), seen_[batch.from], 0);
    if (stretch) vk.CmdCopyBuffer(commands, shared_stretch_.buffer, stretch_.buffer, 1, &stretches);
  }
  if (batch.loaded) copy(shared_, 3 * bytes(), load_, 0);
  if (batch.moved || batch.loaded) order(commands, kCopy, kCompute);
  const Dampers later = batch.dampers.after(batch.h);
  for (uint32_t k = 0; k < batch.n; ++k) {
    vk.CmdBindDescriptorSets(commands, VK_PIPELINE_BIND_POINT_COMPUTE, vk.layout, 0, 1,
                             &set_[(batch.from + k) % 2], 0, nullptr);
    for (uint32_t p = 0; p < work_.npass; ++p) {
      const Work::Pass &pass = work_.pass[p];
      if (k + p > 0) order(commands, kCompute, kCompute);
      vk.CmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_COMPUTE, vk.pipeline[pass.kernel][pass.options]);
      const Constants now = (k ? later : batch.dampers).constants(batch.h, pass.count);
      vk.CmdPushConstants(commands, vk.layout, VK_SHADER_STAGE_COMPUTE_BIT, 0, sizeof now, &now);
      vk.CmdDispatch(commands, (pass.count + kGroup - 1) / kGroup, 1, 1);
    }
  }
  if (batch.seen) {
    const uint32_t end = (batch.from + batch.n) % 2;
    order(commands, kCompute, kCopy);
    copy(place_[end], 0, shared_, 0);
    copy(speed_[end], 0, shared_, bytes());
    if (lagged) copy(seen_[end], 0, shared_, 2 * bytes());
    if (stretch) vk.CmdCopyBuffer(commands, stretch_.buffer, shared_stretch_.buffer, 1, &stretches);
    order(commands, kCompute | kCopy, kProcessor);
  }
  return vk.EndCommandBuffer(commands);
}

// What was recorded is used again where it is the same, as it is from step to step.
const char *VulkanStepper::run(uint32_t n, double h, const Dampers &dampers, bool moved, bool loaded) {
  if (!work_.npass)
    return "its last change has not reached the device, as was said then; change it again, "
           "or take the model without _gpu";
  *highest_ = 0;
  for (uint32_t taken = 0; taken < n;) {
    const uint32_t some = std::min(n - taken, kMaxSteps);
    const Batch batch{some,
                      now_,
                      moved && !taken,
                      loaded && !taken,
                      taken + some == n,
                      h,
                      taken ? dampers.after(h) : dampers};
    const uint32_t slot = batch.from + 2 * batch.moved + 4 * batch.loaded + 8 * batch.seen;
    VkResult result = VK_SUCCESS;
    if (!(recorded_[slot] == batch)) {
      recorded_[slot] = {};
      result = record(commands_[slot], batch);
      if (result == VK_SUCCESS) recorded_[slot] = batch;
    }
    if (result == VK_SUCCESS) result = finish(commands_[slot]);
    if (result != VK_SUCCESS)
      return "the device was lost, or its driver failed; restart the program, or take the model without _gpu";
    taken += some;
    now_ = (now_ + some) % 2;
  }
  return nullptr;
}

}  // namespace gpu
