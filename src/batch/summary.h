// A batch as a table: one row a job, in the order of its file.
#pragma once

#include <string>
#include <vector>

#include "batch/jobs_file.h"

namespace bisector::batch {

// The rows of jobs and their records; a record that is null is of a job that has not been run.
job::Json summary_of(const std::vector<BatchJob>& jobs, const std::vector<job::Json>& records);

// Its rows as comma-separated values (RFC 4180), with a line of column names.
std::string csv_of(const job::Json& summary);

// Writes summary.json, summary.csv and summary.html into a folder. Throws Error.
void write_summary(const std::string& folder, const job::Json& summary);

}  // namespace bisector::batch
