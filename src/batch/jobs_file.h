// The file of a batch: a JSON object on each line, with a command, its input and its options by name.
#pragma once

#include <set>
#include <string>
#include <vector>

#include "job/report.h"

namespace bisector::batch {

struct BatchJob {
  std::string name;                 // names its files; no two jobs share one
  std::size_t line;                 // in the file, from 1
  job::Json given;                  // the object as it was read
  std::string input;                // a path
  std::vector<std::string> inputs;  // all files that it reads, which its options tell; the caller's to set
  std::vector<std::string> outputs;
  std::vector<std::string> words;  // of the command line
  std::set<std::string> options;   // keys that were given
};

// "command", "input" and the names of outputs as the command's own, "name" if the stem of the first output, or else of
// the input, is not what the job is to be called; all other keys are names of options, with - or _ between words.
// A value is a string, a number, true for an option without value, an array for one that is repeated; what is false or
// null is left out. `inputs` are left empty. Throws Error, which names file and line.
std::vector<BatchJob> read_jobs(const std::string& path);

// Throws Error if a job writes what another writes or reads, for jobs run at the same time and in any order, or one of
// the files that the batch itself has in its folder.
void check_files(const std::string& path, const std::vector<BatchJob>& jobs, const std::string& folder);

}  // namespace bisector::batch
