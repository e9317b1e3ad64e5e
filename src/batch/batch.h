// Runs the jobs of a file, each as a process of its own, several at a time.
#pragma once

#include <atomic>
#include <functional>
#include <string>
#include <vector>

#include "batch/child.h"
#include "batch/jobs_file.h"

namespace bisector::batch {

struct BatchOptions {
  std::string program;  // that each job is run with
  std::string folder;   // of records, logs and summary; made if it is missing
  unsigned at_once = 1;
  Limits limits;                      // of each job
  bool retry = false;                 // also those that were run before and are not done
  std::size_t shard = 0, shards = 1;  // of the jobs, those in places shard, shard + shards, ...
};

struct BatchResult {
  job::Json summary;                // of all jobs of the file
  std::size_t jobs = 0;             // of the shard
  std::size_t done_before = 0;      // of these, those that a batch before has done
  std::vector<std::string> failed;  // names of the shard's that are not done
};

// Called when a job has ended, with its record.
using Ended = std::function<void(const BatchJob& job, const job::Json& record)>;

// FOLDER/NAME.json is written when a job has ended, whole or not at all, and jobs that have one are not run again, so
// that a batch that was cut off can be started again. Throws Error, or Cancelled if `cancel` is set; jobs that run are
// ended then, and the summary is written.
BatchResult run_batch(const std::vector<BatchJob>& jobs, const BatchOptions& options, const std::atomic<bool>& cancel,
                      const Ended& ended);

}  // namespace bisector::batch
