#include "cli/manual/environment.h"

#include <algorithm>
#include <fstream>
#include <sstream>

#include "bisector/error.h"

namespace bisector::cli::manual {
namespace {

constexpr const char* kHead = "| environment variable | for | meaning |";

std::string trimmed(const std::string& text) {
  const std::size_t first = text.find_first_not_of(' ');
  return first == std::string::npos ? "" : text.substr(first, text.find_last_not_of(' ') + 1 - first);
}

std::vector<std::string> split(const std::string& text, char separator) {
  std::vector<std::string> parts;
  std::istringstream in(text);
  for (std::string part; std::getline(in, part, separator);) parts.push_back(trimmed(part));
  return parts;
}

}  // namespace

std::vector<EnvironmentVariable> read_environment_variables(const std::string& path) {
  std::ifstream in(path);
  std::string line;
  while (std::getline(in, line) && line != kHead) {
  }
  std::vector<EnvironmentVariable> variables;
  std::getline(in, line);  // the rule below the head
  while (std::getline(in, line) && line.starts_with('|')) {
    line.erase(std::remove(line.begin(), line.end(), '`'), line.end());
    const std::vector<std::string> cells = split(line, '|');  // the first is what lies before the table
    if (cells.size() != 4) throw Error(path + ": '" + line + "' has not three cells; mend the table");
    variables.push_back({cells[1], split(cells[2], ','), cells[3]});
  }
  if (variables.empty()) throw Error(path + ": there is no table headed " + kHead + "; add it");
  return variables;
}

}  // namespace bisector::cli::manual
