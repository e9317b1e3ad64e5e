// Every Vulkan call that can fail does, once, with each failure.
#include "host/device/faults.h"

#include <algorithm>

#include "tests/host/fixture.h"

namespace bisector::host {
namespace {

class Faults : public HostTest {};

constexpr std::uint32_t kCount = 1000;

// Throws DeviceError, or returns whether the result was right.
bool scenario() {
  const std::unique_ptr<Device> device = Device::open();
  Buffer a(*device), b(*device);
  Commands commands(*device);
  const std::vector<std::uint32_t> values(kCount, 3);
  put(commands, a, values);
  b.reserve(kCount * 4);
  commands.dispatch({"test_step", {2}}, {reads(a), writes(b)}, StepPush{kCount, 5}, kCount);
  std::vector<std::uint32_t> result(kCount);
  commands.download(b, 0, result.data(), kCount * 4);
  commands.run();
  return result == step(values, 5, 2);
}

TEST_F(Faults, AllLeaveAsDeviceError) {
  ASSERT_TRUE(scenario());
  inject_fault(Fault::none, 0);
  ASSERT_TRUE(scenario());
  const std::size_t calls = fallible_calls();
  EXPECT_GT(calls, 40u);
  for (const Fault fault : {Fault::out_of_memory, Fault::device_lost}) {
    for (std::size_t call = 0; call < calls; ++call) {
      inject_fault(fault, call);
      try {
        scenario();
        ADD_FAILURE() << "call " << call << " did not fail";
      } catch (const DeviceError& error) {
        const std::string text = error.what();
        EXPECT_EQ(text.find('\n'), std::string::npos) << text;
        EXPECT_NE(text.find("(vk"), std::string::npos) << text;
      }
    }
  }
  inject_fault(Fault::none, 0);
  EXPECT_TRUE(scenario());
}

// The instance is made once, and anew where the environment says otherwise.
TEST_F(Faults, OfTheInstanceLeaveAsDeviceErrorToo) {
  ASSERT_TRUE(scenario());
  std::vector<std::string> calls;
  {
    const Environment loader("BISECTOR_VULKAN_LOADER", "libvulkan.so.1");
    inject_fault(Fault::none, 0);
    log_fallible_calls(&calls);
    ASSERT_TRUE(scenario());
    log_fallible_calls(nullptr);
  }
  EXPECT_EQ(std::ranges::count(calls, "vkCreateInstance"), 1);
  const std::size_t first = static_cast<std::size_t>(std::ranges::find(calls, "vkCreateInstance") - calls.begin());
  for (std::size_t call = 0; call <= first; ++call) {
    inject_fault(Fault::none, 0);
    ASSERT_TRUE(scenario());
    const Environment loader("BISECTOR_VULKAN_LOADER", "libvulkan.so.1");
    inject_fault(Fault::out_of_memory, call);
    EXPECT_THROW(scenario(), DeviceError) << call;
  }
  inject_fault(Fault::none, 0);
  calls.clear();
  log_fallible_calls(&calls);
  EXPECT_TRUE(scenario());
  log_fallible_calls(nullptr);
  EXPECT_EQ(std::ranges::count(calls, "vkCreateInstance"), 0);
}

TEST_F(Faults, RejectADeviceInTheList) {
  const std::size_t devices = list_devices().devices.size();
  inject_fault(Fault::none, 0);
  list_devices();
  const std::size_t calls = fallible_calls();
  for (std::size_t call = 0; call < calls; ++call) {
    inject_fault(Fault::device_lost, call);
    const DeviceList list = list_devices();
    if (list.devices.empty()) {
      EXPECT_FALSE(list.problem.empty());
      continue;
    }
    EXPECT_EQ(list.devices.size(), devices);
    EXPECT_EQ(
        std::ranges::count_if(list.devices, [](const auto& d) { return d.rejected.find("lost") != d.rejected.npos; }),
        1);
  }
  inject_fault(Fault::none, 0);
}

}  // namespace
}  // namespace bisector::host
