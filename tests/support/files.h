// Tests that write files and read them back.
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include "bisector/context.h"
#include "bisector/error.h"

namespace bisector::test {

// Runs what must throw an Error of one line that begins with the file's name and holds `part`.
template <class Run>
void expect_error_line(const Run& run, const std::string& path, const std::string& part) {
  try {
    run();
    ADD_FAILURE() << path << ": no error: " << part;
  } catch (const Error& error) {
    const std::string what = error.what();
    EXPECT_EQ(what.find('\n'), std::string::npos) << what;
    EXPECT_TRUE(what.starts_with(path)) << what;
    EXPECT_NE(what.find(part), std::string::npos) << what;
  }
}

// A folder of its own for each test, removed at its end.
class FileTest : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto* info = ::testing::UnitTest::GetInstance()->current_test_info();
    folder_ = std::filesystem::temp_directory_path() /
              ("bisector-" + std::string(info->name()) + "-" + std::to_string(::getpid()));
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::string path(const std::string& name) const { return (folder_ / name).string(); }
  std::string store(const std::string& name, std::string_view bytes) const {
    std::ofstream(path(name), std::ios::binary).write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    return path(name);
  }
  std::string slurp(const std::string& name) const {
    std::ifstream in(path(name), std::ios::binary);
    std::ostringstream bytes;
    bytes << in.rdbuf();
    return bytes.str();
  }
  // A context that collects warnings, from none on.
  Context collecting() {
    warnings_.clear();
    Context context;
    context.warning = [this](const std::string& line) { warnings_.push_back(line); };
    return context;
  }

  std::filesystem::path folder_;
  std::vector<std::string> warnings_;
};

}  // namespace bisector::test
