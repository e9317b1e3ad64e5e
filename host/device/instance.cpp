#include "host/device/instance.h"

#include <dlfcn.h>

#include <algorithm>
#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <mutex>
#include <string>
#include <vector>

#include "bisector/error.h"
#include "host/device/attempt.h"
#include "host/device/validation.h"

namespace bisector::host {
namespace {

constexpr const char* kValidationLayer = "VK_LAYER_KHRONOS_validation";

std::atomic<std::size_t> messages{0};

VKAPI_ATTR VkBool32 VKAPI_CALL count_message(VkDebugUtilsMessageSeverityFlagBitsEXT, VkDebugUtilsMessageTypeFlagsEXT,
                                             const VkDebugUtilsMessengerCallbackDataEXT* data, void*) {
  ++messages;
  std::fprintf(stderr, "%s\n", data->pMessage);
  return VK_FALSE;
}

int validation_level() {
  const char* level = std::getenv("BISECTOR_VULKAN_VALIDATION");
  return level ? std::atoi(level) : 0;
}

bool has_extension(const std::vector<vk::ExtensionProperties>& extensions, const char* name) {
  return std::ranges::any_of(extensions, [&](const auto& e) { return std::strcmp(e.extensionName, name) == 0; });
}

vk::DebugUtilsMessengerCreateInfoEXT messenger_info() {
  using Severity = vk::DebugUtilsMessageSeverityFlagBitsEXT;
  using Type = vk::DebugUtilsMessageTypeFlagBitsEXT;
  return {{}, Severity::eWarning | Severity::eError, Type::eValidation | Type::ePerformance, count_message};
}

vk::raii::Instance make_instance(const vk::raii::Context& context) {
  const bool has_version = context.getDispatcher()->vkEnumerateInstanceVersion != nullptr;
  if (!has_version || context.enumerateInstanceVersion() < VK_API_VERSION_1_2) {
    throw DeviceError("the Vulkan loader is older than 1.2; update it");
  }
  const auto extensions = attempt("Vulkan", "vkEnumerateInstanceExtensionProperties",
                                  [&] { return context.enumerateInstanceExtensionProperties(); });
  const vk::ApplicationInfo application("bisector", 1, "bisector", 1, VK_API_VERSION_1_2);
  vk::InstanceCreateInfo info({}, &application);
  std::vector<const char*> enabled;
  if (has_extension(extensions, VK_KHR_PORTABILITY_ENUMERATION_EXTENSION_NAME)) {
    enabled.push_back(VK_KHR_PORTABILITY_ENUMERATION_EXTENSION_NAME);
    info.flags |= vk::InstanceCreateFlagBits::eEnumeratePortabilityKHR;
  }

  // In the chain the messenger also hears of what is left when the instance is destroyed.
  vk::DebugUtilsMessengerCreateInfoEXT messenger = messenger_info();
  const std::array checks{vk::ValidationFeatureEnableEXT::eSynchronizationValidation,
                          vk::ValidationFeatureEnableEXT::eGpuAssisted};
  vk::ValidationFeaturesEXT features(checks, {}, &messenger);
  const int level = validation_level();
  if (level > 0) {
    const auto layers = context.enumerateInstanceLayerProperties();
    if (std::ranges::none_of(layers, [](const auto& l) { return std::strcmp(l.layerName, kValidationLayer) == 0; })) {
      throw DeviceError(std::string("BISECTOR_VULKAN_VALIDATION: there is no ") + kValidationLayer + "; install it");
    }
    info.setPEnabledLayerNames(kValidationLayer);
    enabled.push_back(VK_EXT_DEBUG_UTILS_EXTENSION_NAME);
    if (level > 1) enabled.push_back(VK_EXT_VALIDATION_FEATURES_EXTENSION_NAME);
    info.pNext = level > 1 ? static_cast<const void*>(&features) : &messenger;
  }
  info.setPEnabledExtensionNames(enabled);
  try {
    checkpoint("vkCreateInstance");
    return {context, info};
  } catch (const vk::IncompatibleDriverError&) {
    throw DeviceError("there is no Vulkan driver that works; install the GPU's driver, or let the container see it");
  } catch (const vk::SystemError& error) {
    fail("Vulkan", "vkCreateInstance", error);
  }
}

}  // namespace

std::size_t validation_messages() { return messages; }

Instance::Library::Library() {
  const char* override_name = std::getenv("BISECTOR_VULKAN_LOADER");
  const char* name = override_name ? override_name : "libvulkan.so.1";
  handle = dlopen(name, RTLD_NOW | RTLD_LOCAL);
  if (!handle) {
    throw DeviceError(std::string("there is no Vulkan loader (") + name +
                      "); install the package libvulkan1 or vulkan-loader, and the GPU's driver");
  }
}

Instance::Library::~Library() { dlclose(handle); }

PFN_vkGetInstanceProcAddr Instance::Library::entry() const {
  const auto entry = reinterpret_cast<PFN_vkGetInstanceProcAddr>(dlsym(handle, "vkGetInstanceProcAddr"));
  if (!entry) throw DeviceError("the Vulkan loader lacks vkGetInstanceProcAddr; install it anew");
  return entry;
}

std::shared_ptr<const Instance> Instance::shared() {
  std::string environment;
  for (const char* name : {"BISECTOR_VULKAN_LOADER", "BISECTOR_VULKAN_VALIDATION", "VK_DRIVER_FILES",
                           "VK_ICD_FILENAMES", "VK_ADD_DRIVER_FILES"}) {
    const char* value = std::getenv(name);
    environment += value ? value : "";
    environment += '\n';
  }
  struct Kept {
    std::mutex mutex;
    std::string environment;
    std::shared_ptr<const Instance> instance;
  };
  // Never destroyed, for drivers may be gone by then.
  static Kept& kept = *new Kept;
  const std::lock_guard lock(kept.mutex);
  if (!kept.instance || kept.environment != environment) {
    kept.instance = std::make_shared<const Instance>();
    kept.environment = environment;
  }
  return kept.instance;
}

Instance::Instance() : context_(library_.entry()), instance_(make_instance(context_)), messenger_(nullptr) {
  if (validation_level() > 0) {
    messenger_ = attempt("Vulkan", "vkCreateDebugUtilsMessengerEXT",
                         [&] { return vk::raii::DebugUtilsMessengerEXT(instance_, messenger_info()); });
  }
}

}  // namespace bisector::host
