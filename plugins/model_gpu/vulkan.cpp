#include "vulkan.h"

#ifdef _WIN32
#include <windows.h>
#else
#include <dlfcn.h>
#endif

#include <cstddef>
#include <vector>

namespace gpu {
namespace {

constexpr uint32_t kOfSprings[] = {
#include "spring_step.inc"
};
constexpr uint32_t kOfCells[] = {
#include "cell_forces.inc"
};
constexpr uint32_t kOfMotion[] = {
#include "cell_motion.inc"
};
constexpr uint32_t kOfVolumes[] = {
#include "volume_forces.inc"
};
struct Code {
  size_t bytes;
  const uint32_t *words;
};
constexpr Code kCode[kKernels] = {{sizeof kOfSprings, kOfSprings},
                                  {sizeof kOfCells, kOfCells},
                                  {sizeof kOfMotion, kOfMotion},
                                  {sizeof kOfVolumes, kOfVolumes}};

// The smaller, the better.
int rank_of(VkPhysicalDeviceType type) {
  switch (type) {
    case VK_PHYSICAL_DEVICE_TYPE_DISCRETE_GPU: return 0;
    case VK_PHYSICAL_DEVICE_TYPE_INTEGRATED_GPU: return 1;
    case VK_PHYSICAL_DEVICE_TYPE_VIRTUAL_GPU: return 2;
    case VK_PHYSICAL_DEVICE_TYPE_CPU: return 4;
    default: return 3;
  }
}
constexpr int kSoftware = 4;

// The entry of the Vulkan loader, which is never closed: a driver that is loaded again takes longer than all
// else here.
PFN_vkGetInstanceProcAddr loader() {
#ifdef _WIN32
  const HMODULE library = LoadLibraryExW(L"vulkan-1.dll", nullptr, LOAD_LIBRARY_SEARCH_SYSTEM32);
  if (!library)
    throw std::string(
        "the Vulkan loader vulkan-1.dll is not installed; install the driver of the graphics card, or take "
        "the model without _gpu");
  return reinterpret_cast<PFN_vkGetInstanceProcAddr>(
      reinterpret_cast<void *>(GetProcAddress(library, "vkGetInstanceProcAddr")));
#else
  void *const library = dlopen("libvulkan.so.1", RTLD_NOW | RTLD_LOCAL);
  if (!library)
    throw std::string(
        "the Vulkan loader libvulkan.so.1 is not installed; install libvulkan1 and the driver of the "
        "graphics card (without a card mesa-vulkan-drivers), or take the model without _gpu");
  return reinterpret_cast<PFN_vkGetInstanceProcAddr>(dlsym(library, "vkGetInstanceProcAddr"));
#endif
}

}  // namespace

void must(VkResult result, const char *what) {
  if (result == VK_SUCCESS) return;
  throw std::string("the driver failed in ") + what + " (VkResult " + std::to_string(int(result)) +
      "); choose another device, or a smaller body if its memory is full, or take the model without _gpu";
}

Vulkan::Vulkan(Wanted wanted) {
  try {
    open_instance();
    open_device(choose(wanted));
    make_layout();
  } catch (...) {
    close();
    throw;
  }
}

Vulkan::~Vulkan() { close(); }

void Vulkan::open_instance() {
  const PFN_vkGetInstanceProcAddr get = loader();
  const auto create =
      get ? reinterpret_cast<PFN_vkCreateInstance>(get(nullptr, "vkCreateInstance")) : nullptr;
  VkApplicationInfo app{};
  app.sType = VK_STRUCTURE_TYPE_APPLICATION_INFO;
  app.apiVersion = VK_API_VERSION_1_1;
  VkInstanceCreateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO;
  info.pApplicationInfo = &app;
  if (!create || create(&info, nullptr, &instance_) != VK_SUCCESS)
    throw std::string(
        "the Vulkan loader finds no driver on this machine; install that of the graphics card "
        "(without a card mesa-vulkan-drivers), or take the model without _gpu");
#define DEFORM_GPU_GET(name) name = reinterpret_cast<PFN_vk##name>(get(instance_, "vk" #name));
  DEFORM_GPU_OF_INSTANCE(DEFORM_GPU_GET)
#undef DEFORM_GPU_GET
}

// Chooses the first that the driver lists among equals.
VkPhysicalDevice Vulkan::choose(Wanted wanted) {
  uint32_t n = 0;
  must(EnumeratePhysicalDevices(instance_, &n, nullptr), "vkEnumeratePhysicalDevices");
  std::vector<VkPhysicalDevice> all(n);
  must(EnumeratePhysicalDevices(instance_, &n, all.data()), "vkEnumeratePhysicalDevices");
  VkPhysicalDevice best = VK_NULL_HANDLE;
  int best_rank = kSoftware + 1;
  std::string seen;
  for (const VkPhysicalDevice one : all) {
    VkPhysicalDeviceProperties about;
    VkPhysicalDeviceFeatures features;
    GetPhysicalDeviceProperties(one, &about);
    GetPhysicalDeviceFeatures(one, &features);
    const int rank = rank_of(about.deviceType);
    seen += (seen.empty() ? "" : ", ") + std::string(about.deviceName).substr(0, 40);
    const bool binds = about.limits.maxPerStageDescriptorStorageBuffers >= kBindings;
    if (!features.shaderFloat64) seen += " without shaderFloat64";
    else if (!binds) seen += " with too few storage buffers";
    if (!features.shaderFloat64 || !binds || about.apiVersion < VK_API_VERSION_1_1 || rank >= best_rank)
      continue;
    if (wanted != Wanted::automatic && (wanted == Wanted::software) != (rank == kSoftware)) continue;
    best = one;
    best_rank = rank;
    name = about.deviceName;
    software = rank == kSoftware;
    limits = about.limits;
  }
  if (best) return best;
  throw std::string("no ") + (wanted == Wanted::hardware ? "graphics card" : "device") +
      " that computes in binary64 with Vulkan 1.1; found: " + (seen.empty() ? "none" : seen.substr(0, 90)) +
      "; install a driver, or take the model without _gpu";
}

void Vulkan::open_device(VkPhysicalDevice chosen) {
  uint32_t n = 0;
  GetPhysicalDeviceQueueFamilyProperties(chosen, &n, nullptr);
  std::vector<VkQueueFamilyProperties> families(n);
  GetPhysicalDeviceQueueFamilyProperties(chosen, &n, families.data());
  while (family < n && !(families[family].queueFlags & VK_QUEUE_COMPUTE_BIT)) ++family;
  if (family == n) throw "the device " + name + " has no queue for compute; choose another one";
  GetPhysicalDeviceMemoryProperties(chosen, &memory_);
  const float first = 1;
  VkDeviceQueueCreateInfo queue{};
  queue.sType = VK_STRUCTURE_TYPE_DEVICE_QUEUE_CREATE_INFO;
  queue.queueFamilyIndex = family;
  queue.queueCount = 1;
  queue.pQueuePriorities = &first;
  VkPhysicalDeviceFeatures features{};
  features.shaderFloat64 = VK_TRUE;
  VkDeviceCreateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO;
  info.queueCreateInfoCount = 1;
  info.pQueueCreateInfos = &queue;
  info.pEnabledFeatures = &features;
  must(CreateDevice(chosen, &info, nullptr, &device), "vkCreateDevice");
#define DEFORM_GPU_GET(name) name = reinterpret_cast<PFN_vk##name>(GetDeviceProcAddr(device, "vk" #name));
  DEFORM_GPU_OF_DEVICE(DEFORM_GPU_GET)
#undef DEFORM_GPU_GET
  GetDeviceQueue(device, family, 0, &queue_);
}

// All kernels share it; none uses all of the bindings.
void Vulkan::make_layout() {
  VkDescriptorSetLayoutBinding bindings[kBindings] = {};
  for (uint32_t b = 0; b < kBindings; ++b) {
    bindings[b].binding = b;
    bindings[b].descriptorType = VK_DESCRIPTOR_TYPE_STORAGE_BUFFER;
    bindings[b].descriptorCount = 1;
    bindings[b].stageFlags = VK_SHADER_STAGE_COMPUTE_BIT;
  }
  VkDescriptorSetLayoutCreateInfo set{};
  set.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO;
  set.bindingCount = kBindings;
  set.pBindings = bindings;
  must(CreateDescriptorSetLayout(device, &set, nullptr, &set_layout), "vkCreateDescriptorSetLayout");
  const VkPushConstantRange range{VK_SHADER_STAGE_COMPUTE_BIT, 0, sizeof(Constants)};
  VkPipelineLayoutCreateInfo whole{};
  whole.sType = VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO;
  whole.setLayoutCount = 1;
  whole.pSetLayouts = &set_layout;
  whole.pushConstantRangeCount = 1;
  whole.pPushConstantRanges = &range;
  must(CreatePipelineLayout(device, &whole, nullptr, &layout), "vkCreatePipelineLayout");
}

void Vulkan::need(Kernel kernel, uint32_t options) {
  const std::lock_guard<std::mutex> one(one_);
  VkPipeline &to = pipeline[kernel][options];
  if (to) return;
  VkBool32 on[kOptionBits];
  VkSpecializationMapEntry entries[kOptionBits];
  for (uint32_t n = 0; n < kOptionBits; ++n) {
    on[n] = options >> n & 1;
    entries[n] = {n, uint32_t(n * sizeof on[0]), sizeof on[0]};
  }
  const VkSpecializationInfo constants{kOptionBits, entries, sizeof on, on};
  VkShaderModuleCreateInfo code{};
  code.sType = VK_STRUCTURE_TYPE_SHADER_MODULE_CREATE_INFO;
  code.codeSize = kCode[kernel].bytes;
  code.pCode = kCode[kernel].words;
  VkShaderModule module = VK_NULL_HANDLE;
  must(CreateShaderModule(device, &code, nullptr, &module), "vkCreateShaderModule");
  VkComputePipelineCreateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_COMPUTE_PIPELINE_CREATE_INFO;
  info.stage.sType = VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO;
  info.stage.stage = VK_SHADER_STAGE_COMPUTE_BIT;
  info.stage.module = module;
  info.stage.pName = "main";
  info.stage.pSpecializationInfo = &constants;
  info.layout = layout;
  const VkResult made = CreateComputePipelines(device, VK_NULL_HANDLE, 1, &info, nullptr, &to);
  DestroyShaderModule(device, module, nullptr);
  must(made, "vkCreateComputePipelines");
}

void Vulkan::close() {
  if (device) {
    DeviceWaitIdle(device);
    for (const auto &of_kernel : pipeline)
      for (const VkPipeline each : of_kernel) DestroyPipeline(device, each, nullptr);
    DestroyPipelineLayout(device, layout, nullptr);
    DestroyDescriptorSetLayout(device, set_layout, nullptr);
    DestroyDevice(device, nullptr);
  }
  if (instance_) DestroyInstance(instance_, nullptr);
}

uint32_t Vulkan::memory_type(uint32_t allowed, bool mapped) const {
  constexpr VkMemoryPropertyFlags kMapped =
      VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT;
  constexpr VkMemoryPropertyFlags kWishes[2][2] = {{VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT, 0},
                                                   {kMapped | VK_MEMORY_PROPERTY_HOST_CACHED_BIT, kMapped}};
  for (const VkMemoryPropertyFlags wish : kWishes[mapped])
    for (uint32_t t = 0; t < memory_.memoryTypeCount; ++t)
      if ((allowed >> t & 1) && (memory_.memoryTypes[t].propertyFlags & wish) == wish) return t;
  throw "the device " + name + " has no memory for the arrays of a body; choose another one";
}

VkResult Vulkan::submit(VkCommandBuffer commands, VkFence done) {
  VkSubmitInfo info{};
  info.sType = VK_STRUCTURE_TYPE_SUBMIT_INFO;
  info.commandBufferCount = 1;
  info.pCommandBuffers = &commands;
  const std::lock_guard<std::mutex> one(one_);
  return QueueSubmit(queue_, 1, &info, done);
}

}  // namespace gpu
