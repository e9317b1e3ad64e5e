// What is fuzzed: functions of any bytes, which may throw Error, whose message must be one line, and nothing else.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "bisector/error.h"

namespace bisector::fuzz {

struct Target {
  std::string name;
  void (*run)(std::string_view bytes);
};

// All of them.
const std::vector<Target>& targets();

// Aborts if the condition does not hold.
void require(bool condition, const char* what);

// Runs the body, which may throw an Error of one line.
template <class Body>
void guarded(const Body& body) {
  try {
    body();
  } catch (const Error& error) {
    const std::string_view line = error.what();
    require(!line.empty() && line.find('\n') == std::string_view::npos, "an error is one line");
  }
}

// A file in a folder of this process, with the bytes.
std::string file_of(std::string_view bytes, const std::string& name);

std::vector<Target> readers();
std::vector<Target> pipelines();

}  // namespace bisector::fuzz
