// The pipeline cache on disk, good and bad.
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <thread>

#include "host/device/cache_file.h"
#include "tests/host/fixture.h"

namespace bisector::host {
namespace {

namespace fs = std::filesystem;

using Bytes = std::vector<std::uint8_t>;

const CacheOwner kOwner{1, 2, 3, {4, 5, 6}};

// A folder of its own for each test.
class CacheFile : public HostTest {
 protected:
  void SetUp() override {
    const std::string name = testing::UnitTest::GetInstance()->current_test_info()->name();
    folder = fs::path(testing::TempDir()) / ("bisector-" + name + "-" + std::to_string(getpid()));
    fs::create_directories(folder);
    path = folder / "cache";
  }
  void TearDown() override { fs::remove_all(folder); }

  fs::path folder, path;
};

Bytes content(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

void write(const fs::path& path, const Bytes& bytes) {
  std::ofstream(path, std::ios::binary).write(reinterpret_cast<const char*>(bytes.data()), std::ssize(bytes));
}

TEST_F(CacheFile, RoundTrips) {
  const Bytes data{1, 2, 3};
  EXPECT_TRUE(load_cache(path, kOwner).empty());
  EXPECT_TRUE(store_cache(path, kOwner, data));
  EXPECT_EQ(load_cache(path, kOwner), data);
  EXPECT_EQ(std::distance(fs::directory_iterator(folder), {}), 1);
}

TEST_F(CacheFile, IsLeftAloneIfNothingChanged) {
  ASSERT_TRUE(store_cache(path, kOwner, {1, 2, 3}));
  const auto old = fs::file_time_type::clock::now() - std::chrono::hours(1);
  fs::last_write_time(path, old);
  EXPECT_TRUE(store_cache(path, kOwner, {1, 2, 3}));
  EXPECT_EQ(fs::last_write_time(path), old);
  EXPECT_TRUE(store_cache(path, kOwner, {1, 2}));
  EXPECT_NE(fs::last_write_time(path), old);
}

TEST_F(CacheFile, IsIgnoredIfDamaged) {
  ASSERT_TRUE(store_cache(path, kOwner, {1, 2, 3, 4, 5}));
  const Bytes good = content(path);
  for (std::size_t size = 0; size < good.size(); ++size) {
    write(path, Bytes(good.begin(), good.begin() + static_cast<std::ptrdiff_t>(size)));
    EXPECT_TRUE(load_cache(path, kOwner).empty()) << size;
  }
  for (std::size_t bit = 0; bit < good.size() * 8; ++bit) {
    Bytes bad = good;
    bad[bit / 8] = static_cast<std::uint8_t>(bad[bit / 8] ^ (1u << bit % 8));
    write(path, bad);
    EXPECT_TRUE(load_cache(path, kOwner).empty()) << bit;
  }
  Bytes longer = good;
  longer.push_back(0);
  write(path, longer);
  EXPECT_TRUE(load_cache(path, kOwner).empty());
  EXPECT_TRUE(store_cache(path, kOwner, {7}));
  EXPECT_EQ(load_cache(path, kOwner), Bytes{7});
}

TEST_F(CacheFile, IsIgnoredIfAnothersOrNoFile) {
  ASSERT_TRUE(store_cache(path, kOwner, {1, 2, 3}));
  for (const CacheOwner& other :
       {CacheOwner{9, 2, 3, {4, 5, 6}}, {1, 9, 3, {4, 5, 6}}, {1, 2, 9, {4, 5, 6}}, {1, 2, 3, {}}}) {
    EXPECT_TRUE(load_cache(path, other).empty());
  }
  EXPECT_TRUE(load_cache(folder, kOwner).empty());
  EXPECT_TRUE(load_cache({}, kOwner).empty());
  EXPECT_FALSE(store_cache(folder, kOwner, {1}));
  EXPECT_FALSE(store_cache(path / "below", kOwner, {1}));
  EXPECT_EQ(std::distance(fs::directory_iterator(folder), {}), 1);
}

TEST_F(CacheFile, IsReplacedAtOnce) {
  ASSERT_TRUE(store_cache(path, kOwner, Bytes(1000, 1)));
  std::atomic<bool> done = false;
  std::vector<std::thread> writers;
  for (const std::uint8_t value : Bytes{2, 3}) {
    writers.emplace_back([&, value] {
      for (std::size_t i = 0; i < 200; ++i) store_cache(path, kOwner, Bytes(1000 * value + i % 2, value));
    });
  }
  std::thread reader([&] {
    while (!done) {
      const Bytes data = load_cache(path, kOwner);
      ASSERT_FALSE(data.empty());
      ASSERT_EQ(data.size() / 1000, data.front());
    }
  });
  for (std::thread& writer : writers) writer.join();
  done = true;
  reader.join();
  EXPECT_EQ(std::distance(fs::directory_iterator(folder), {}), 1);
}

TEST_F(CacheFile, NameIsAFileOrAFolder) {
  {
    const Environment none("BISECTOR_CACHE", "");
    EXPECT_TRUE(cache_path("u").empty());
  }
  {
    const Environment file("BISECTOR_CACHE", path.string());
    EXPECT_EQ(cache_path("u"), path);
  }
  const Environment in_folder("BISECTOR_CACHE", folder.string());
  EXPECT_EQ(cache_path("u"), folder / "pipelines-u.cache");
}

TEST_F(CacheFile, ServesDevices) {
  HostTest::SetUp();
  if (IsSkipped()) return;
  const Environment cache("BISECTOR_CACHE", path.string());
  const auto use = [] { Device::open(); };
  use();
  const Bytes good = content(path);
  ASSERT_FALSE(good.empty());
  use();
  EXPECT_EQ(content(path), good);
  Bytes flipped = good;
  flipped.back() ^= 1;
  Bytes foreign = good;
  foreign[8] ^= 1;
  const std::ptrdiff_t half = std::ssize(good) / 2;
  for (const Bytes& bad : {Bytes{}, Bytes(good.begin(), good.begin() + half), flipped, foreign, Bytes(100, 0xff)}) {
    write(path, bad);
    use();
    EXPECT_EQ(content(path).size(), good.size());
  }
  fs::remove(path);
  fs::create_directory(path);  // now it names a folder
  use();
  EXPECT_EQ(std::distance(fs::directory_iterator(path), {}), 1);
  const Environment nowhere("BISECTOR_CACHE", "/dev/null/cache");
  use();
}

}  // namespace
}  // namespace bisector::host
