// Where BISECTOR_VULKAN_VALIDATION is set, no test of this program may have caused a message.
#include "host/device/validation.h"
#include "tests/host/fixture.h"

namespace bisector::host {
namespace {

std::size_t planted = 0;

int validation_level() {
  const char* level = std::getenv("BISECTOR_VULKAN_VALIDATION");
  return level ? std::atoi(level) : 0;
}

class NoMessages : public testing::Environment {
 public:
  void SetUp() override {
    if (!validation_level()) return;
    // A layer that is missing must not look like one that has nothing to say.
    EXPECT_EQ(list_devices().problem.find("BISECTOR_VULKAN_VALIDATION"), std::string::npos);
  }
  void TearDown() override { EXPECT_EQ(validation_messages(), planted); }
};

[[maybe_unused]] const testing::Environment* const registered = testing::AddGlobalTestEnvironment(new NoMessages);

class Validation : public HostTest {};

TEST_F(Validation, HearsOfWritesOutOfBounds) {
  if (validation_level() < 2) GTEST_SKIP() << "BISECTOR_VULKAN_VALIDATION is not 2";
  const std::size_t before = validation_messages();
  const std::unique_ptr<Device> device = Device::open();
  Buffer values(*device);
  Commands commands(*device);
  values.reserve(64 * 4);
  commands.fill(values, 0, 64 * 4, 0);
  commands.dispatch({"test_add", {}}, {updates(values)}, CountPush{65}, 65);
  commands.run();
  planted = validation_messages() - before;
  EXPECT_GT(planted, 0u);
}

}  // namespace
}  // namespace bisector::host
