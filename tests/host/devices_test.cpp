// Listing and opening devices, with and without a loader and drivers.
#include <algorithm>
#include <cctype>

#include "host/device/ranking.h"
#include "tests/host/fixture.h"

namespace bisector::host {
namespace {

class Devices : public HostTest {};

void expect_one_line(const std::string& text) {
  EXPECT_FALSE(text.empty());
  EXPECT_EQ(text.find('\n'), std::string::npos) << text;
}

std::string open_error(const std::string& request) {
  try {
    Device::open(parse_device(request));
  } catch (const DeviceError& error) {
    EXPECT_NE(error.reason(), Reason::other);
    return error.what();
  }
  return {};
}

TEST_F(Devices, AreDescribed) {
  for (const DeviceDescription& description : list_devices().devices) {
    EXPECT_FALSE(description.name.empty());
    EXPECT_FALSE(description.driver.empty());
    if (!description.rejected.empty()) continue;
    EXPECT_EQ(description.uuid.size(), 36u);
    EXPECT_GT(description.memory, 0u);
    const bool listed = std::ranges::count(description.features, "float64") != 0;
    EXPECT_EQ(description.float64, listed);
  }
}

TEST_F(Devices, AreOpenedByIndexAndUuid) {
  for (const DeviceDescription& description : list_devices().devices) {
    if (!description.rejected.empty()) continue;
    std::string capitals = description.uuid;
    std::ranges::transform(capitals, capitals.begin(), [](unsigned char c) { return std::toupper(c); });
    for (const std::string& which : {std::to_string(description.index), description.uuid, capitals}) {
      const std::unique_ptr<Device> device = Device::open(parse_device("vulkan:" + which));
      EXPECT_EQ(device->description().uuid, description.uuid);
      EXPECT_EQ(device->description().float64, description.float64);
      EXPECT_GE(device->limits().groups, 65535u);
    }
  }
}

TEST_F(Devices, TheBestIsOpened) {
  const std::unique_ptr<Device> device = Device::open();
  for (const DeviceDescription& other : list_devices().devices) {
    EXPECT_FALSE(other.rejected.empty() && better(other, device->description())) << other.name;
  }
}

TEST_F(Devices, MustExist) {
  const std::string name = list_devices().devices.front().name;
  for (const char* request : {"vulkan:99", "vulkan:00000000-0000-0000-0000-00000000dead"}) {
    const std::string text = open_error(request);
    expect_one_line(text);
    EXPECT_NE(text.find(request), std::string::npos) << text;
    EXPECT_NE(text.find(name), std::string::npos) << text;
  }
}

TEST(NoDevice, WithoutDriver) {
  const Environment files("VK_DRIVER_FILES", "/nonexistent.json"), old_files("VK_ICD_FILENAMES", "/nonexistent.json");
  const DeviceList list = list_devices();
  EXPECT_TRUE(list.devices.empty());
  expect_one_line(list.problem);
  expect_one_line(open_error("vulkan"));
  expect_one_line(open_error("vulkan:0"));
}

TEST(NoDevice, WithoutLoader) {
  const Environment loader("BISECTOR_VULKAN_LOADER", "/nonexistent.so");
  const DeviceList list = list_devices();
  EXPECT_TRUE(list.devices.empty());
  EXPECT_NE(list.problem.find("no Vulkan loader"), std::string::npos) << list.problem;
  expect_one_line(list.problem);
  expect_one_line(open_error("vulkan"));
}

TEST(Ranking, PrefersKindThenMemory) {
  DeviceDescription small, large, software, broken;
  small.kind = large.kind = broken.kind = "discrete";
  software.kind = "software";
  small.memory = 1;
  large.memory = 2;
  software.memory = broken.memory = 3;
  broken.rejected = "it is broken";
  EXPECT_TRUE(better(large, small));
  EXPECT_TRUE(better(small, software));
  EXPECT_FALSE(better(software, large));
  const DeviceList list{{software, small, broken, large}, ""};
  EXPECT_EQ(host::best_gpu(list), &list.devices[3]);
  EXPECT_EQ(host::best_gpu({{software, broken}, ""}), nullptr);
}

}  // namespace
}  // namespace bisector::host
