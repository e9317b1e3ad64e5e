// What became of a job, in a file of its own: what a batch that is started again goes by.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "batch/child.h"
#include "batch/jobs_file.h"

namespace bisector::batch {

// The word of an ending: done, failed, crashed, timeout or memory.
const char* word_of(Ending ending);

// Size and time of change of each file, by its path; null for one that is not there.
job::Json state_of(const std::vector<std::string>& files);

// "job", "status", "exit_code" or "signal", "seconds", "memory_mib", "message" where it is not done, "report", that of
// the command, and "files", the state of what the job reads as it was before the job began.
job::Json make_record(const BatchJob& job, const Outcome& outcome, const std::string& message, job::Json report,
                      job::Json files);
bool is_done(const job::Json& record);

// The record of a job that needs not be run: one of the same job, none of whose files has changed since it began, and
// whose outputs are there if it is done. Of those that are not done, `retry` asks for another run.
std::optional<job::Json> read_record(const std::string& path, const BatchJob& job, bool retry);

// The last line with an error in what a program printed; if it has none, its last line.
std::string last_error(const std::string& log);

// Why a job is not done: `said` if it ended by itself.
std::string message_of(const Outcome& outcome, const Limits& limits, const std::string& said);

}  // namespace bisector::batch
