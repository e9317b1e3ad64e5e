// Completion of command lines in shells: commands, options, the words that an option takes, and files by extension.
#pragma once

#include <string>
#include <vector>

#include "cli/manual/entry.h"

namespace bisector::cli::manual {

// A program, then its commands if it has any.
using ProgramEntries = std::vector<Entry>;

std::string bash_completion(const ProgramEntries& program);
std::string zsh_completion(const ProgramEntries& program);
std::string fish_completion(const ProgramEntries& program);

}  // namespace bisector::cli::manual
