// The environment variables that docs/cli.md lists.
#pragma once

#include <string>
#include <vector>

namespace bisector::cli::manual {

struct EnvironmentVariable {
  std::string name;
  std::vector<std::string> commands;  // that read it
  std::string meaning;
};

// Reads the table headed "| environment variable | for | meaning |". Throws Error if there is none.
std::vector<EnvironmentVariable> read_environment_variables(const std::string& path);

}  // namespace bisector::cli::manual
