// The fuzzer's corpus: inputs that reach different parts of the code, and those that once went wrong.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <set>

#include "fuzz/target.h"

namespace bisector {
namespace {

namespace fs = std::filesystem;

class FuzzCorpus : public testing::TestWithParam<fuzz::Target> {};

TEST_P(FuzzCorpus, IsReadOrRefused) {
  const fs::path folder = fs::path(BISECTOR_FUZZ_CORPUS) / GetParam().name;
  ASSERT_TRUE(fs::is_directory(folder)) << folder;
  std::set<fs::path> files;
  for (const auto& entry : fs::directory_iterator(folder)) files.insert(entry.path());
  EXPECT_GT(files.size(), 1u);
  for (const fs::path& file : files) {
    SCOPED_TRACE(file);
    std::ifstream in(file, std::ios::binary);
    const std::string bytes{std::istreambuf_iterator<char>(in), {}};
    GetParam().run(bytes);
    // Cut off anywhere.
    for (const std::size_t part : {1, 2, 3}) GetParam().run(std::string_view(bytes).substr(0, bytes.size() * part / 4));
  }
}

INSTANTIATE_TEST_SUITE_P(Targets, FuzzCorpus, testing::ValuesIn(fuzz::targets()),
                         [](const auto& target) { return "of_" + target.param.name; });

}  // namespace
}  // namespace bisector
