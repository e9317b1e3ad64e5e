// What is fuzzed: functions of any bytes, which may throw Error, whose message must be one line, and nothing else.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace bisector::fuzz {

struct Target {
  std::string name;
  void (*run)(std::string_view bytes);
};

// All of them.
const std::vector<Target>& targets();

// Aborts if the condition does not hold.
void require(bool condition, const char* what);

// A file in a folder of this process, with the bytes.
std::string file_of(std::string_view bytes, const std::string& name);

void add_readers(std::vector<Target>& all);
void add_pipelines(std::vector<Target>& all);

}  // namespace bisector::fuzz
