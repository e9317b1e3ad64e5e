// What the tests of the host layer share.
#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <cstdlib>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "host/device/commands.h"
#include "host/device/modules.h"
#include "kernels/layout/push.h"

namespace bisector::host {

extern const std::span<const Module> test_modules;

// Sets an environment variable for as long as it lives.
class Environment {
 public:
  Environment(std::string name, const std::string& value) : name_(std::move(name)) {
    if (const char* before = std::getenv(name_.c_str())) before_ = before;
    setenv(name_.c_str(), value.c_str(), 1);
  }
  ~Environment() {
    if (before_) {
      setenv(name_.c_str(), before_->c_str(), 1);
    } else {
      unsetenv(name_.c_str());
    }
  }
  Environment(const Environment&) = delete;
  Environment& operator=(const Environment&) = delete;

 private:
  std::string name_;
  std::optional<std::string> before_;
};

// Skips where there is no device that can be used.
class HostTest : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    static const bool once = (register_modules(test_modules), true);
    (void)once;
  }

  void SetUp() override {
    static const DeviceList list = list_devices();
    for (const DeviceDescription& description : list.devices) {
      if (description.rejected.empty()) return;
    }
    GTEST_SKIP() << "no Vulkan device can be used" << (list.problem.empty() ? "" : ": ") << list.problem;
  }
};

struct StepPush {
  std::uint32_t count, shift;
};

inline void put(Commands& commands, Buffer& buffer, const std::vector<std::uint32_t>& values) {
  buffer.reserve(values.size() * 4);
  commands.upload(buffer, 0, values.data(), values.size() * 4);
}

// What kernels/test_step.comp computes.
inline std::vector<std::uint32_t> step(const std::vector<std::uint32_t>& from, std::uint32_t shift,
                                       std::uint32_t factor) {
  std::vector<std::uint32_t> to(from.size());
  for (std::uint32_t i = 0; i < to.size(); ++i) to[i] = from[(i + shift) % from.size()] * factor + i;
  return to;
}

}  // namespace bisector::host
