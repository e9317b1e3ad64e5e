// A Vulkan loader that counts what kernels execute: BISECTOR_VULKAN_LOADER names this library, which passes everything
// on to libvulkan.so.1 but adds to each block of each shader a counter in memory. scripts/count_operations runs it.
//
// When a device is destroyed a line of JSON for each shader goes to the file that BISECTOR_COUNTS names: the hash of
// its SPIR-V (FNV-1a of the words) and how often its blocks were entered, in their order in the module. A counter wraps
// at 2^32. A device needs bufferDeviceAddress.
#include <dlfcn.h>
#include <vulkan/vulkan.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <mutex>
#include <string>
#include <vector>

namespace {

using Words = std::vector<std::uint32_t>;

constexpr std::uint32_t kMostCounters = 1u << 18;

// Of SPIR-V's specification.
enum Op : std::uint32_t {
  kOpLine = 8,
  kOpMemoryModel = 14,
  kOpCapability = 17,
  kOpTypeInt = 21,
  kOpTypeVector = 23,
  kOpTypePointer = 32,
  kOpConstant = 43,
  kOpConstantComposite = 44,
  kOpFunction = 54,
  kOpVariable = 59,
  kOpBitcast = 124,
  kOpAtomicIAdd = 234,
  kOpPhi = 245,
  kOpLabel = 248,
  kOpNoLine = 317,
};
constexpr std::uint32_t kPhysicalAddresses = 5347, kPhysicalMemoryModel = 5348, kPhysicalStorageClass = 5349;

std::uint32_t head(std::uint32_t op, std::size_t words) { return static_cast<std::uint32_t>(words << 16) | op; }

void append(Words& to, std::uint32_t op, std::initializer_list<std::uint32_t> operands) {
  to.push_back(head(op, operands.size() + 1));
  to.insert(to.end(), operands);
}

// A shader with a counter at `address` + 4 k that block k adds 1 to on entry.
struct Counted {
  Words words;
  std::uint32_t blocks = 0;
};

class Counting {
 public:
  Counting(const std::uint32_t* words, std::size_t count, VkDeviceAddress address)
      : given_(words), count_(count), address_(address), next_id_(words[3]) {}

  Counted run() {
    find_types();
    out_.assign(given_, given_ + 5);
    bool capability = false, in_functions = false, pending = false;
    for (std::size_t at = 5; at < count_; at += length(at)) {
      const std::uint32_t op = given_[at] & 0xffff;
      if (op == kOpFunction && !in_functions) {
        in_functions = true;
        declare();
      }
      if (pending && op != kOpPhi && op != kOpVariable && op != kOpLine && op != kOpNoLine) {
        count_block();
        pending = false;
      }
      out_.insert(out_.end(), given_ + at, given_ + at + length(at));
      if (op == kOpCapability && !capability) {
        capability = true;
        append(out_, kOpCapability, {kPhysicalAddresses});
      }
      if (op == kOpMemoryModel) out_[out_.size() - 2] = kPhysicalMemoryModel;
      if (op == kOpLabel) pending = true;
    }
    out_[3] = next_id_;
    return {std::move(out_), blocks_};
  }

 private:
  std::size_t length(std::size_t at) const { return std::max<std::uint32_t>(given_[at] >> 16, 1); }

  // Types must not be declared twice.
  void find_types() {
    for (std::size_t at = 5; at < count_; at += length(at)) {
      const std::uint32_t op = given_[at] & 0xffff;
      if (op == kOpTypeInt && given_[at + 2] == 32 && given_[at + 3] == 0) uint_ = given_[at + 1];
      if (op == kOpTypeVector && given_[at + 2] == uint_ && uint_ && given_[at + 3] == 2) pair_ = given_[at + 1];
      if (op == kOpLabel) ++labels_;
    }
  }

  void declare() {
    if (!uint_) append(out_, kOpTypeInt, {uint_ = next_id_++, 32, 0});
    if (!pair_) append(out_, kOpTypeVector, {pair_ = next_id_++, uint_, 2});
    append(out_, kOpTypePointer, {pointer_ = next_id_++, kPhysicalStorageClass, uint_});
    append(out_, kOpConstant, {uint_, one_ = next_id_++, 1});
    append(out_, kOpConstant, {uint_, zero_ = next_id_++, 0});
    for (std::uint32_t block = 0; block < labels_; ++block) {
      const VkDeviceAddress place = address_ + 4 * VkDeviceAddress{block};
      const std::uint32_t low = next_id_++, high = next_id_++;
      append(out_, kOpConstant, {uint_, low, static_cast<std::uint32_t>(place)});
      append(out_, kOpConstant, {uint_, high, static_cast<std::uint32_t>(place >> 32)});
      places_.push_back(next_id_++);
      append(out_, kOpConstantComposite, {pair_, places_.back(), low, high});
    }
  }

  void count_block() {
    const std::uint32_t pointer = next_id_++, before = next_id_++;
    append(out_, kOpBitcast, {pointer_, pointer, places_[blocks_++]});
    // Scope: the device; no order.
    append(out_, kOpAtomicIAdd, {uint_, before, pointer, one_, zero_, one_});
  }

  const std::uint32_t* given_;
  std::size_t count_;
  VkDeviceAddress address_;
  std::uint32_t next_id_, uint_ = 0, pair_ = 0, pointer_ = 0, one_ = 0, zero_ = 0, labels_ = 0, blocks_ = 0;
  std::vector<std::uint32_t> places_;
  Words out_;
};

struct Shader {
  std::uint64_t hash;
  std::uint32_t first, blocks;
};

struct Device {
  VkDevice handle;
  VkBuffer buffer;
  VkDeviceMemory memory;
  VkDeviceAddress address;
  std::uint32_t* counters;
  std::uint32_t used;
  std::vector<Shader> shaders;
};

std::mutex mutex;
std::vector<Device> devices;
PFN_vkGetInstanceProcAddr next_instance;
PFN_vkGetDeviceProcAddr next_device;
PFN_vkCreateDevice next_create_device;
PFN_vkGetPhysicalDeviceMemoryProperties memory_properties;

[[noreturn]] void give_up(const char* what) {
  std::fprintf(stderr, "counting loader: %s\n", what);
  std::abort();
}

template <class Function>
Function device_function(VkDevice device, const char* name) {
  const auto function = reinterpret_cast<Function>(next_device(device, name));
  if (!function) give_up(name);
  return function;
}

void check(VkResult result, const char* what) {
  if (result != VK_SUCCESS) give_up(what);
}

void add_counters(VkPhysicalDevice physical, Device& device) {
  const VkDevice handle = device.handle;
  VkBufferCreateInfo buffer{};
  buffer.sType = VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO;
  buffer.size = 4 * VkDeviceSize{kMostCounters};
  buffer.usage = VK_BUFFER_USAGE_STORAGE_BUFFER_BIT | VK_BUFFER_USAGE_SHADER_DEVICE_ADDRESS_BIT;
  check(device_function<PFN_vkCreateBuffer>(handle, "vkCreateBuffer")(handle, &buffer, nullptr, &device.buffer),
        "vkCreateBuffer failed");
  VkMemoryRequirements needs;
  device_function<PFN_vkGetBufferMemoryRequirements>(handle, "vkGetBufferMemoryRequirements")(handle, device.buffer,
                                                                                              &needs);
  VkPhysicalDeviceMemoryProperties properties;
  memory_properties(physical, &properties);
  VkMemoryAllocateFlagsInfo flags{};
  flags.sType = VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_FLAGS_INFO;
  flags.flags = VK_MEMORY_ALLOCATE_DEVICE_ADDRESS_BIT;
  VkMemoryAllocateInfo memory{};
  memory.sType = VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO;
  memory.pNext = &flags;
  memory.allocationSize = needs.size;
  memory.memoryTypeIndex = VK_MAX_MEMORY_TYPES;
  constexpr VkMemoryPropertyFlags wanted = VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT;
  for (std::uint32_t k = properties.memoryTypeCount; k-- > 0;)
    if ((needs.memoryTypeBits >> k & 1u) && (properties.memoryTypes[k].propertyFlags & wanted) == wanted)
      memory.memoryTypeIndex = k;
  if (memory.memoryTypeIndex == VK_MAX_MEMORY_TYPES) give_up("there is no memory for counters");
  check(device_function<PFN_vkAllocateMemory>(handle, "vkAllocateMemory")(handle, &memory, nullptr, &device.memory),
        "vkAllocateMemory failed");
  check(device_function<PFN_vkBindBufferMemory>(handle, "vkBindBufferMemory")(handle, device.buffer, device.memory, 0),
        "vkBindBufferMemory failed");
  void* mapped = nullptr;
  check(device_function<PFN_vkMapMemory>(handle, "vkMapMemory")(handle, device.memory, 0, VK_WHOLE_SIZE, 0, &mapped),
        "vkMapMemory failed");
  device.counters = static_cast<std::uint32_t*>(mapped);
  std::fill_n(device.counters, kMostCounters, 0u);
  VkBufferDeviceAddressInfo address{};
  address.sType = VK_STRUCTURE_TYPE_BUFFER_DEVICE_ADDRESS_INFO;
  address.buffer = device.buffer;
  device.address = device_function<PFN_vkGetBufferDeviceAddress>(handle, "vkGetBufferDeviceAddress")(handle, &address);
}

VKAPI_ATTR VkResult VKAPI_CALL create_device(VkPhysicalDevice physical, const VkDeviceCreateInfo* info,
                                             const VkAllocationCallbacks* allocator, VkDevice* made) {
  VkPhysicalDeviceBufferDeviceAddressFeatures addresses{};
  addresses.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_BUFFER_DEVICE_ADDRESS_FEATURES;
  addresses.pNext = const_cast<void*>(info->pNext);
  addresses.bufferDeviceAddress = VK_TRUE;
  VkDeviceCreateInfo changed = *info;
  changed.pNext = &addresses;
  const VkResult result = next_create_device(physical, &changed, allocator, made);
  if (result != VK_SUCCESS) return result;
  Device device{};
  device.handle = *made;
  add_counters(physical, device);
  const std::lock_guard lock(mutex);
  devices.push_back(std::move(device));
  return result;
}

Device& known(VkDevice handle) {
  for (Device& device : devices)
    if (device.handle == handle) return device;
  give_up("a device is unknown");
}

void write_counts(const Device& device) {
  const char* path = std::getenv("BISECTOR_COUNTS");
  std::FILE* file = path ? std::fopen(path, "a") : nullptr;
  if (!file) give_up("the file that BISECTOR_COUNTS should name cannot be written");
  for (const Shader& shader : device.shaders) {
    std::fprintf(file, "{\"hash\": \"%016llx\", \"blocks\": [", static_cast<unsigned long long>(shader.hash));
    for (std::uint32_t k = 0; k < shader.blocks; ++k)
      std::fprintf(file, "%s%u", k ? ", " : "", device.counters[shader.first + k]);
    std::fprintf(file, "]}\n");
  }
  std::fclose(file);
}

VKAPI_ATTR void VKAPI_CALL destroy_device(VkDevice handle, const VkAllocationCallbacks* allocator) {
  const std::lock_guard lock(mutex);
  Device& device = known(handle);
  write_counts(device);
  device_function<PFN_vkDestroyBuffer>(handle, "vkDestroyBuffer")(handle, device.buffer, nullptr);
  device_function<PFN_vkFreeMemory>(handle, "vkFreeMemory")(handle, device.memory, nullptr);
  const auto destroy = device_function<PFN_vkDestroyDevice>(handle, "vkDestroyDevice");
  devices.erase(devices.begin() + (&device - devices.data()));
  destroy(handle, allocator);
}

VKAPI_ATTR VkResult VKAPI_CALL create_shader(VkDevice handle, const VkShaderModuleCreateInfo* info,
                                             const VkAllocationCallbacks* allocator, VkShaderModule* made) {
  const std::lock_guard lock(mutex);
  Device& device = known(handle);
  std::uint64_t hash = 0xcbf29ce484222325;
  const auto* bytes = reinterpret_cast<const unsigned char*>(info->pCode);
  for (std::size_t k = 0; k < info->codeSize; ++k) hash = (hash ^ bytes[k]) * 0x100000001b3;
  const Counted counted =
      Counting(info->pCode, info->codeSize / 4, device.address + 4 * VkDeviceAddress{device.used}).run();
  if (device.used + counted.blocks > kMostCounters) give_up("there are more blocks than counters");
  device.shaders.push_back({hash, device.used, counted.blocks});
  device.used += counted.blocks;
  VkShaderModuleCreateInfo changed = *info;
  changed.codeSize = 4 * counted.words.size();
  changed.pCode = counted.words.data();
  return device_function<PFN_vkCreateShaderModule>(handle, "vkCreateShaderModule")(handle, &changed, allocator, made);
}

PFN_vkVoidFunction own_device_function(const char* name) {
  if (!std::strcmp(name, "vkDestroyDevice")) return reinterpret_cast<PFN_vkVoidFunction>(destroy_device);
  if (!std::strcmp(name, "vkCreateShaderModule")) return reinterpret_cast<PFN_vkVoidFunction>(create_shader);
  return nullptr;
}

VKAPI_ATTR PFN_vkVoidFunction VKAPI_CALL get_device_function(VkDevice device, const char* name) {
  if (!std::strcmp(name, "vkGetDeviceProcAddr")) return reinterpret_cast<PFN_vkVoidFunction>(get_device_function);
  if (const auto own = own_device_function(name)) return own;
  return next_device(device, name);
}

PFN_vkGetInstanceProcAddr loader() {
  void* library = dlopen("libvulkan.so.1", RTLD_NOW | RTLD_LOCAL);
  void* function = library ? dlsym(library, "vkGetInstanceProcAddr") : nullptr;
  if (!function) give_up("there is no libvulkan.so.1");
  return reinterpret_cast<PFN_vkGetInstanceProcAddr>(function);
}

}  // namespace

extern "C" __attribute__((visibility("default"))) VKAPI_ATTR PFN_vkVoidFunction VKAPI_CALL
vkGetInstanceProcAddr(VkInstance instance, const char* name) {
  static const bool once = (next_instance = loader(), true);
  (void)once;
  const auto function = next_instance(instance, name);
  if (!function) return nullptr;
  if (!std::strcmp(name, "vkCreateDevice")) {
    next_create_device = reinterpret_cast<PFN_vkCreateDevice>(function);
    next_device = reinterpret_cast<PFN_vkGetDeviceProcAddr>(next_instance(instance, "vkGetDeviceProcAddr"));
    memory_properties = reinterpret_cast<PFN_vkGetPhysicalDeviceMemoryProperties>(
        next_instance(instance, "vkGetPhysicalDeviceMemoryProperties"));
    return reinterpret_cast<PFN_vkVoidFunction>(create_device);
  }
  if (!std::strcmp(name, "vkGetDeviceProcAddr")) return reinterpret_cast<PFN_vkVoidFunction>(get_device_function);
  if (!std::strcmp(name, "vkGetInstanceProcAddr")) return reinterpret_cast<PFN_vkVoidFunction>(vkGetInstanceProcAddr);
  if (const auto own = own_device_function(name)) return own;
  return function;
}
