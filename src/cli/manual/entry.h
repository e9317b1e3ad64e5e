// What the manual says of a program or a command, gathered from the command line that the program itself reads.
#pragma once

#include <string>
#include <vector>

#include "cli/program.h"
#include "job/parsed_option.h"

namespace bisector::cli::manual {

struct Option {
  std::string name;   // "--detail", "-n", or of an argument "IN"
  std::string alias;  // "-h" of "--help"; may be empty
  std::string type;   // of its value, "WORD"; empty: it is a switch, or an argument
  std::string help;   // one line
  std::string group;  // "Size"
  bool required = false;
  bool optional_value = false;
  job::OptionValues values;

  bool is_argument() const { return name.front() != '-'; }
};

struct Entry {
  std::string name;     // "bisector-remesh", which is the page's
  std::string command;  // "remesh"; empty: the page is of a program
  std::string about;
  std::string usage;
  std::vector<std::string> description;  // paragraphs
  std::vector<Example> examples;
  std::vector<Option> options;  // arguments first
  std::vector<ExitCode> exit_codes;
  std::string no_output;  // what becomes of files if the exit code is not 0
};

// The program, then its commands, then bisector-step, bisector-tetgen and bisector-mpi.
std::vector<Entry> make_entries();

}  // namespace bisector::cli::manual
