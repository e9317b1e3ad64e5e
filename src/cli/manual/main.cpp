// bisector_manual: writes manual pages and the completion of shells. Run by the build, with docs/cli.md, the pages'
// date and the folder to write to.
#include <algorithm>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <string>
#include <vector>

#include "cli/manual/completion.h"
#include "cli/manual/entry.h"
#include "cli/manual/environment.h"
#include "cli/manual/man_page.h"
#include "io/files.h"

namespace {

using namespace bisector::cli::manual;

void write_completion(const std::string& folder, const ProgramEntries& program) {
  const std::string& name = program.front().name;
  bisector::write_file(folder + "/" + name + ".bash", bash_completion(program));
  bisector::write_file(folder + "/" + name + ".zsh", zsh_completion(program));
  bisector::write_file(folder + "/" + name + ".fish", fish_completion(program));
}

}  // namespace

int main(int argc, char** argv) try {
  const std::vector<std::string> arguments(argv + 1, argv + argc);
  if (arguments.size() != 3) {
    std::fputs("usage: bisector_manual docs/cli.md YYYY-MM-DD FOLDER\n", stderr);
    return 2;
  }
  const std::vector<EnvironmentVariable> environment = read_environment_variables(arguments[0]);
  const std::string& folder = arguments[2];
  std::filesystem::create_directories(folder);

  const std::vector<Entry> entries = make_entries();
  for (std::size_t i = 0; i < entries.size(); ++i)
    bisector::write_file(folder + "/" + entries[i].name + ".1", man_page(entries, i, environment, arguments[1]));

  ProgramEntries program, step;
  for (const Entry& entry : entries) {
    if (entry.name == "bisector" || !entry.command.empty()) program.push_back(entry);
    if (entry.name == "bisector-step") step.push_back(entry);
  }
  write_completion(folder, program);
  write_completion(folder, step);
  return 0;
} catch (const std::exception& error) {
  std::fprintf(stderr, "bisector_manual: %s\n", error.what());
  return 1;
}
