// The Vulkan loader and an instance of it.
#pragma once

#include <cstddef>
#include <memory>

#include "host/device/vulkan.h"

namespace bisector::host {

class Instance {
 public:
  // Throws DeviceError that says what is missing: the loader, a driver, or the validation layer that was asked for.
  Instance();
  // The process's instance. It is kept until the environment names another loader, driver or validation: NVIDIA's
  // driver finds nothing more once it has been unloaded and loaded some dozens of times. Throws as the constructor
  // does.
  static std::shared_ptr<const Instance> shared();
  Instance(const Instance&) = delete;
  Instance& operator=(const Instance&) = delete;

  const vk::raii::Instance& get() const { return instance_; }

 private:
  // dlclose() when everything that came from the library is gone.
  struct Library {
    Library();
    ~Library();
    Library(const Library&) = delete;
    Library& operator=(const Library&) = delete;
    PFN_vkGetInstanceProcAddr entry() const;
    void* handle;
  };

  Library library_;
  vk::raii::Context context_;
  vk::raii::Instance instance_;
  vk::raii::DebugUtilsMessengerEXT messenger_;
};

}  // namespace bisector::host
