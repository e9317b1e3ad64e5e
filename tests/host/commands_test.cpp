// Buffers, transfers, dispatches and their order.
#include <algorithm>
#include <array>
#include <cstring>
#include <numeric>
#include <stdexcept>

#include "host/device/faults.h"
#include "tests/host/fixture.h"

namespace bisector::host {
namespace {

class CommandsTest : public HostTest {
 protected:
  void SetUp() override {
    HostTest::SetUp();
    if (!IsSkipped()) device = Device::open();
  }

  std::unique_ptr<Device> device;
};

std::vector<std::uint32_t> counting(std::size_t count, std::uint32_t first = 0) {
  std::vector<std::uint32_t> values(count);
  std::iota(values.begin(), values.end(), first);
  return values;
}

TEST_F(CommandsTest, BuffersGrowAndAreKept) {
  Buffer buffer(*device);
  EXPECT_EQ(buffer.size(), 0u);
  buffer.reserve(0);
  EXPECT_GE(buffer.size(), 16u);
  buffer.reserve(1000);
  const std::size_t size = buffer.size();
  EXPECT_GE(size, 1000u);
  buffer.reserve(10);
  EXPECT_EQ(buffer.size(), size);
  buffer.reserve(size + 1);
  EXPECT_GE(buffer.size(), size * 3 / 2 / 16 * 16);
  const Buffer moved = std::move(buffer);
  EXPECT_GE(moved.size(), size);
}

TEST_F(CommandsTest, BuffersStayWithinOneBinding) {
  Buffer buffer(*device);
  EXPECT_THROW(buffer.reserve(device->limits().storage_range + 17), DeviceError);
  EXPECT_THROW(buffer.reserve(std::size_t{1} << 50), DeviceError);
}

TEST_F(CommandsTest, TransfersRoundTrip) {
  Commands commands(*device);
  Buffer a(*device), b(*device);
  const std::vector<std::uint32_t> values = counting(1000, 7);
  put(commands, a, values);
  b.reserve(values.size() * 4);
  commands.fill(b, 0, values.size() * 4, 5);
  commands.copy(a, 40, b, 80, 400);
  std::vector<std::uint32_t> result(values.size());
  commands.download(b, 0, result.data(), result.size() * 4);
  std::array<unsigned char, 3> bytes{};
  commands.download(a, 1, bytes.data(), bytes.size());
  commands.run();
  for (std::size_t i = 0; i < result.size(); ++i) EXPECT_EQ(result[i], i >= 20 && i < 120 ? values[i - 10] : 5u);
  EXPECT_EQ(bytes[0], 0);
  EXPECT_EQ(bytes[2], 0);
  EXPECT_THROW(commands.upload(a, a.size(), values.data(), 4), std::logic_error);
  EXPECT_THROW(commands.fill(a, 2, 4, 0), std::logic_error);
}

// More than may be staged at a time, in one recording.
TEST_F(CommandsTest, LargeTransfersRoundTrip) {
  constexpr std::size_t kWords = std::size_t{23} << 20;
  if (device->limits().storage_range < kWords * 4) GTEST_SKIP() << "the device cannot bind that much";
  Commands commands(*device);
  std::vector<Buffer> buffers;
  const std::vector<std::uint32_t> values = counting(kWords);
  for (int i = 0; i < 3; ++i) put(commands, buffers.emplace_back(*device), values);
  std::vector<std::uint32_t> result(kWords);
  for (const Buffer& buffer : buffers) {
    commands.download(buffer, 0, result.data(), kWords * 4);
    commands.run();
    EXPECT_TRUE(result == values);
    std::ranges::fill(result, 0);
  }
}

// Items of 12 bytes, which do not fill the chunks of staging memory evenly, packed and unpacked where they lie.
TEST_F(CommandsTest, ItemsRoundTrip) {
  constexpr std::size_t kItem = 12;
  for (const std::size_t count : {std::size_t{1}, std::size_t{1025}, std::size_t{100'003}, std::size_t{9'000'001}}) {
    SCOPED_TRACE(count);
    Commands commands(*device);
    Buffer buffer(*device);
    buffer.reserve(count * kItem);
    commands.upload_items(buffer, kItem, count, [](std::byte* at, std::size_t first, std::size_t items) {
      for (std::size_t i = first; i < first + items; ++i, at += kItem) {
        const std::array<std::uint32_t, 3> words{static_cast<std::uint32_t>(i), 1, static_cast<std::uint32_t>(~i)};
        std::memcpy(at, words.data(), kItem);
      }
    });
    std::vector<char> right(count, 0);
    commands.download_items(buffer, kItem, count, [&](const std::byte* at, std::size_t first, std::size_t items) {
      for (std::size_t i = first; i < first + items; ++i, at += kItem) {
        std::array<std::uint32_t, 3> words{};
        std::memcpy(words.data(), at, kItem);
        right[i] = words[0] == i && words[1] == 1 && words[2] == static_cast<std::uint32_t>(~i);
      }
    });
    commands.run();
    EXPECT_EQ(std::count(right.begin(), right.end(), 1), static_cast<std::ptrdiff_t>(count));
    const DeviceWork work = commands.take_work();
    EXPECT_GE(work.submits, 1u);
    EXPECT_EQ(work.bytes_up, count * kItem);
    EXPECT_EQ(work.bytes_down, count * kItem);
    EXPECT_EQ(commands.take_work().submits, 0u);
  }
}

TEST_F(CommandsTest, DispatchesSeeTheOnesBefore) {
  constexpr std::uint32_t kCount = 10'000, kFactor = 3;
  const Kernel kernel{"test_step", {kFactor}};
  Commands commands(*device);
  Buffer a(*device), b(*device);
  std::vector<std::uint32_t> expected = counting(kCount);
  put(commands, a, expected);
  b.reserve(kCount * 4);
  // Enough to need more than one pool of descriptors and of queries.
  for (std::uint32_t i = 0; i < 600; ++i) {
    commands.phase(i % 4 ? &DeviceSeconds::clip : &DeviceSeconds::sum);
    commands.dispatch(kernel, {reads(a), writes(b)}, StepPush{kCount, 64 + i}, kCount);
    expected = step(expected, 64 + i, kFactor);
    std::swap(a, b);
  }
  std::vector<std::uint32_t> result(kCount);
  commands.download(a, 0, result.data(), kCount * 4);
  commands.run();
  EXPECT_EQ(result, expected);
}

TEST_F(CommandsTest, WritesWaitForReads) {
  constexpr std::uint32_t kCount = 100'000;
  const Kernel kernel{"test_step", {1}};
  Commands commands(*device);
  Buffer a(*device), b(*device), c(*device);
  const std::vector<std::uint32_t> values = counting(kCount);
  b.reserve(kCount * 4);
  c.reserve(kCount * 4);
  put(commands, a, values);
  commands.dispatch(kernel, {reads(a), writes(b)}, StepPush{kCount, 1}, kCount);
  commands.fill(a, 0, kCount * 4, 9);                                             // write after read
  commands.dispatch(kernel, {reads(a), writes(c)}, StepPush{kCount, 1}, kCount);  // read after write
  commands.dispatch({"test_add", {}}, {updates(c)}, CountPush{kCount}, kCount);   // update after write
  commands.dispatch({"test_add", {}}, {updates(c)}, CountPush{kCount}, kCount);   // update after update
  put(commands, a, values);                                                       // write after read
  commands.fill(a, 0, 4, 8);                                                      // write after write
  std::vector<std::uint32_t> first(kCount), second(kCount), third(kCount);
  commands.download(b, 0, first.data(), kCount * 4);
  commands.download(c, 0, second.data(), kCount * 4);
  commands.download(a, 0, third.data(), kCount * 4);
  commands.run();
  EXPECT_EQ(first, step(values, 1, 1));
  EXPECT_EQ(second, counting(kCount, 11));
  EXPECT_EQ(third[0], 8u);
  EXPECT_EQ(third[1], 1u);
}

TEST_F(CommandsTest, IndirectDispatchesReadTheirSize) {
  constexpr std::uint32_t kCount = 640;
  Commands commands(*device);
  Buffer count(*device), arguments(*device), values(*device);
  arguments.reserve(32);
  put(commands, count, {128});
  put(commands, values, std::vector<std::uint32_t>(kCount));
  for (const std::uint32_t items : {128u, 320u}) {
    commands.fill(count, 0, 4, items);
    commands.dispatch({"test_arguments", {}}, {reads(count), writes(arguments)}, CountPush{4}, 1);
    commands.dispatch_indirect({"test_add", {}}, {updates(values)}, CountPush{kCount}, arguments, 16);
  }
  std::vector<std::uint32_t> result(kCount);
  commands.download(values, 0, result.data(), kCount * 4);
  commands.run();
  for (std::uint32_t i = 0; i < kCount; ++i) EXPECT_EQ(result[i], i < 128 ? 2u : i < 320 ? 1u : 0u) << i;
}

// More workgroups than one dimension may have on most devices.
TEST_F(CommandsTest, ManyItemsAreLaidOutInTwoDimensions) {
  constexpr std::uint32_t kCount = 65535 * 64 + 12'345;
  Commands commands(*device);
  Buffer values(*device);
  values.reserve(kCount * 4);
  commands.fill(values, 0, kCount * 4, 1);
  commands.dispatch({"test_add", {}}, {updates(values)}, CountPush{kCount}, kCount);
  std::vector<std::uint32_t> result(kCount);
  commands.download(values, 0, result.data(), kCount * std::size_t{4});
  commands.run();
  EXPECT_TRUE(result == std::vector<std::uint32_t>(kCount, 2));
}

// Each item is taken once in any order, as they come unless another one is asked for.
TEST_F(CommandsTest, ItemsAreTakenInAnyOrder) {
  constexpr std::uint32_t kCount = 5 * kGroupSize;
  for (const std::uint32_t odd : {1u, 37u, 63u}) {
    const std::unique_ptr<Device> fresh = Device::open();
    permute_invocations(*fresh, odd);
    Commands commands(*fresh);
    Buffer items(*fresh);
    items.reserve(kCount * 4);
    commands.dispatch({"test_order", {}}, {writes(items)}, CountPush{kCount}, kCount);
    std::vector<std::uint32_t> taken(kCount);
    commands.download(items, 0, taken.data(), kCount * 4);
    commands.run();
    EXPECT_EQ(taken == counting(kCount), odd == 1);
    std::ranges::sort(taken);
    EXPECT_EQ(taken, counting(kCount));
  }
}

TEST_F(CommandsTest, MemoryIsPoisoned) {
  constexpr std::uint32_t kCount = 1000, kFirst = 0xffffffff, kSecond = 7;
  poison_new_memory(*device, kFirst);
  Commands commands(*device);
  Buffer added(*device), kept(*device, Lifetime::kept), given(*device), made(*device);
  made.reserve(16);
  made.reserve(kCount * 4);  // grows
  for (Buffer* buffer : {&added, &kept, &given}) put(commands, *buffer, std::vector<std::uint32_t>(kCount, 1));
  for (Buffer* buffer : {&added, &kept})
    commands.dispatch({"test_add", {}}, {updates(*buffer)}, CountPush{kCount}, kCount);
  commands.run();
  poison_computed(*device, kSecond);
  const auto expect_all = [&](const Buffer& buffer, std::uint32_t word) {
    std::vector<std::uint32_t> words(kCount);
    commands.download(buffer, 0, words.data(), kCount * 4);
    commands.run();
    EXPECT_TRUE(words == std::vector<std::uint32_t>(kCount, word)) << word;
  };
  expect_all(made, kFirst);
  expect_all(added, kSecond);
  expect_all(kept, 2);
  expect_all(given, 1);
}

TEST_F(CommandsTest, KernelsAreBuiltForBothPrecisions) {
  Commands commands(*device);
  Buffer single(*device), twice(*device);
  single.reserve(16);
  twice.reserve(16);
  const bool float64 = device->description().float64;
  float small = 0x1p-30f;
  double fine = 0x1p-30;
  commands.upload(single, 0, &small, sizeof small);
  commands.dispatch({"test_plus_one_single", {}}, {updates(single)}, CountPush{1}, 1);
  commands.download(single, 0, &small, sizeof small);
  if (float64) {
    commands.upload(twice, 0, &fine, sizeof fine);
    commands.dispatch({"test_plus_one_double", {}}, {updates(twice)}, CountPush{1}, 1);
    commands.download(twice, 0, &fine, sizeof fine);
  }
  commands.run();
  EXPECT_EQ(small, 1.0f);
  EXPECT_EQ(fine, float64 ? 1 + 0x1p-30 : 0x1p-30);
}

// Time was counted for these phases and no others.
void expect_used(const DeviceSeconds& seconds, const std::vector<Phase>& used) {
  for (const Phase phase : {&DeviceSeconds::transfer, &DeviceSeconds::grid, &DeviceSeconds::neighbours,
                            &DeviceSeconds::owners, &DeviceSeconds::clip, &DeviceSeconds::sort, &DeviceSeconds::sum}) {
    EXPECT_EQ(seconds.*phase > 0, std::ranges::find(used, phase) != used.end());
    EXPECT_LT(seconds.*phase, 60);
  }
}

TEST_F(CommandsTest, NothingIsRunForNothing) {
  Commands commands(*device);
  commands.run();
  Buffer values(*device);
  commands.dispatch({"test_add", {}}, {updates(values)}, CountPush{0}, 0);
  commands.upload(values, 0, nullptr, 0);
  commands.run();
  expect_used(commands.take_seconds(), {});
}

TEST_F(CommandsTest, KernelsAreUsedConsistently) {
  Commands commands(*device);
  Buffer values(*device);
  EXPECT_THROW(commands.dispatch({"test_add", {}}, {updates(values)}, CountPush{1}, 1), std::logic_error);  // no memory
  values.reserve(16);
  EXPECT_THROW(commands.dispatch({"no_such", {}}, {updates(values)}, CountPush{1}, 1), std::logic_error);
  commands.dispatch({"test_add", {}}, {updates(values)}, CountPush{1}, 1);
  EXPECT_THROW(commands.dispatch({"test_add", {}}, {updates(values)}, StepPush{1, 1}, 1), std::logic_error);
  EXPECT_THROW(commands.dispatch({"test_add", {}}, {reads(values), updates(values)}, CountPush{1}, 1),
               std::logic_error);
}

TEST_F(CommandsTest, TimeIsCountedByPhase) {
  const std::vector<std::string>& features = device->description().features;
  if (std::ranges::find(features, "timestamps") == features.end()) GTEST_SKIP() << "the device has no timestamps";
  Commands commands(*device);
  Buffer values(*device);
  constexpr std::uint32_t kCount = 1'000'000;
  values.reserve(kCount * 4);
  commands.phase(&DeviceSeconds::grid);
  commands.fill(values, 0, kCount * 4, 0);
  commands.phase(&DeviceSeconds::sort);
  commands.dispatch({"test_add", {}}, {updates(values)}, CountPush{kCount}, kCount);
  commands.run();
  expect_used(commands.take_seconds(), {&DeviceSeconds::grid, &DeviceSeconds::sort});
  expect_used(commands.take_seconds(), {});
}

}  // namespace
}  // namespace bisector::host
