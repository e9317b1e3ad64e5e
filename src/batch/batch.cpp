#include "batch/batch.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <memory>
#include <numeric>
#include <string>
#include <thread>
#include <utility>

#include "batch/record.h"
#include "batch/summary.h"
#include "bisector/error.h"
#include "core/stopwatch.h"
#include "io/files.h"
#include "job/outputs.h"

namespace bisector::batch {
namespace {

namespace fs = std::filesystem;
using job::Json;

constexpr double kLookEvery = 0.02;  // seconds
// The summary is written anew as jobs end, but takes no more than this share of the time.
constexpr double kShareOfSummary = 0.02;

// A file that one process at a time holds; the system lets go of it however that process ends.
class Lock {
 public:
  explicit Lock(const std::string& path) : descriptor_(open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666)) {
    if (descriptor_ < 0) throw Error(fmt::format("{}: cannot be written: {}", path, std::strerror(errno)));
  }
  ~Lock() { close(descriptor_); }
  Lock(const Lock&) = delete;
  Lock& operator=(const Lock&) = delete;

  // Whether it is free and now held.
  bool try_to_hold() { return flock(descriptor_, LOCK_EX | LOCK_NB) == 0; }
  // Waits until it is.
  void hold() {
    while (flock(descriptor_, LOCK_EX) != 0 && errno == EINTR) {
    }
  }

 private:
  int descriptor_;
};

// The file that whoever runs a shard holds.
std::string lock_of(const std::string& folder, std::size_t shard, std::size_t shards) {
  return fmt::format("{}/.shard-{}-of-{}.lock", folder, shard, shards);
}

// Whether a process holds the lock of a shard that has a job in common with this one, `own` aside.
bool runs_elsewhere(const std::string& folder, std::size_t shard, std::size_t shards, const std::string& own) {
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error)) {
    const std::string name = entry->path().filename();
    std::size_t other = 0, others = 0;
    if (std::sscanf(name.c_str(), ".shard-%zu-of-%zu.lock", &other, &others) != 2 || others == 0) continue;
    const std::string path = lock_of(folder, other, others);
    // Places k = shard mod shards and k = other mod others have a k in common if they agree mod the greatest divisor.
    const std::size_t divisor = std::gcd(shards, others);
    if (path == own || shard % divisor != other % divisor) continue;
    if (!Lock(path).try_to_hold()) return true;
  }
  return false;
}

class Batch {
 public:
  Batch(const std::vector<BatchJob>& jobs, const BatchOptions& options, const Ended& ended)
      : jobs_(jobs), options_(options), ended_(ended), records_(jobs.size()) {}

  BatchResult run(const std::atomic<bool>& cancel);

 private:
  struct Running {
    std::size_t job;
    Json files;  // of the job, as they were when it was started
    std::unique_ptr<Child> child;
  };

  std::string file(const BatchJob& job, const char* ending) const { return options_.folder + "/" + job.name + ending; }
  // What the job's command writes its report to. No job's name begins with a dot.
  std::string report_of(const BatchJob& job) const {
    return fmt::format("{}/.{}.report.json", options_.folder, job.name);
  }
  bool is_mine(std::size_t k) const { return k % options_.shards == options_.shard; }
  void read_record_of(std::size_t k);
  void read_records();
  void write_summary_of_all();
  void write_summary_at_times();
  std::vector<std::string> words_of(const BatchJob& job) const;
  void start(std::size_t k);
  void collect();
  void finish(const Running& running);

  const std::vector<BatchJob>& jobs_;
  const BatchOptions& options_;
  const Ended& ended_;
  std::vector<Json> records_;
  std::vector<std::size_t> waiting_;  // the next one last
  std::vector<Running> running_;
  Stopwatch since_summary_;
  double pause_ = 0;  // seconds until the summary is written again
  BatchResult result_;
};

void Batch::read_record_of(std::size_t k) {
  const bool retry = options_.retry && is_mine(k);
  records_[k] = read_record(file(jobs_[k], ".json"), jobs_[k], retry).value_or(Json());
}

void Batch::read_records() {
  for (std::size_t k = jobs_.size(); k-- > 0;) {
    if (!is_mine(k)) continue;
    read_record_of(k);
    if (records_[k].is_null()) waiting_.push_back(k);
    else if (is_done(records_[k])) ++result_.done_before;
  }
}

// Shards may end at the same time: the last one that comes here finds the records of all others.
void Batch::write_summary_of_all() {
  Lock lock(options_.folder + "/.summary.lock");
  lock.hold();
  for (std::size_t k = 0; k < jobs_.size(); ++k)
    if (!is_mine(k)) read_record_of(k);
  result_.summary = summary_of(jobs_, records_);
  write_summary(options_.folder, result_.summary);
}

void Batch::write_summary_at_times() {
  if (since_summary_.seconds() < pause_) return;
  const Stopwatch writing;
  write_summary_of_all();
  pause_ = writing.seconds() / kShareOfSummary;
  since_summary_ = Stopwatch();
}

std::vector<std::string> Batch::words_of(const BatchJob& job) const {
  std::vector<std::string> words{options_.program};
  words.insert(words.end(), job.words.begin(), job.words.end());
  words.insert(words.end(), {"--report", report_of(job)});
  if (options_.at_once > 1 && !job.options.contains("threads")) {
    const unsigned cores = std::max(std::thread::hardware_concurrency(), 1u);
    words.push_back(fmt::format("--threads={}", std::max(cores / options_.at_once, 1u)));
  }
  return words;
}

void Batch::start(std::size_t k) {
  const BatchJob& job = jobs_[k];
  std::error_code error;
  for (const std::string& old : {file(job, ".json"), report_of(job)}) fs::remove(old, error);
  for (const std::string& output : job.outputs)
    if (const fs::path folder = fs::path(output).parent_path(); !folder.empty()) fs::create_directories(folder, error);
  running_.push_back(
      {k, state_of(job.inputs), std::make_unique<Child>(words_of(job), file(job, ".log"), options_.limits)});
}

void Batch::collect() {
  for (std::size_t k = 0; k < running_.size();) {
    if (running_[k].child->has_ended()) {
      const Running ended = std::move(running_[k]);
      running_.erase(running_.begin() + static_cast<std::ptrdiff_t>(k));
      finish(ended);
    } else {
      ++k;
    }
  }
}

void Batch::finish(const Running& running) {
  const BatchJob& job = jobs_[running.job];
  const Outcome& outcome = running.child->outcome();
  const std::string report_file = report_of(job);
  std::ifstream report(report_file);
  // What a job has put in the place of its input is no change of it.
  Json files = running.files;
  for (const std::string& input : job.inputs)
    for (const std::string& output : job.outputs)
      if (job::target_of(input) == job::target_of(output)) files.update(state_of({input}));
  Json& record = records_[running.job];
  record = make_record(job, outcome, message_of(outcome, options_.limits, last_error(file(job, ".log"))),
                       report ? Json::parse(report, nullptr, false) : Json(), std::move(files));
  if (record["report"].is_discarded()) record["report"] = nullptr;
  write_file(file(job, ".json"), record.dump(1, ' ', false, Json::error_handler_t::replace) + "\n");
  std::error_code error;
  fs::remove(report_file, error);
  ended_(job, record);
  write_summary_at_times();
}

BatchResult Batch::run(const std::atomic<bool>& cancel) {
  std::error_code error;
  fs::create_directories(options_.folder, error);
  if (error) throw Error(fmt::format("{}: the folder cannot be made: {}", options_.folder, error.message()));
  const std::string lock_file = lock_of(options_.folder, options_.shard, options_.shards);
  Lock lock(lock_file);
  {
    Lock turn(options_.folder + "/.start.lock");  // or two that start at once might both find the other's lock free
    turn.hold();
    if (!lock.try_to_hold() || runs_elsewhere(options_.folder, options_.shard, options_.shards, lock_file))
      throw Error(options_.folder +
                  ": jobs of this batch are being run by another process; wait for it, or name another folder");
  }
  read_records();
  while (!cancel && (!waiting_.empty() || !running_.empty())) {
    while (!waiting_.empty() && running_.size() < options_.at_once) {
      start(waiting_.back());
      waiting_.pop_back();
    }
    wait_for_children(kLookEvery);
    collect();
  }
  for (const Running& running : running_) running.child->stop();
  while (!running_.empty()) {
    wait_for_children(kLookEvery);
    std::erase_if(running_, [](const Running& running) { return running.child->has_ended(); });
  }
  for (std::size_t k = 0; k < jobs_.size(); ++k) {
    if (!is_mine(k)) continue;
    ++result_.jobs;
    if (!records_[k].is_null() && !is_done(records_[k])) result_.failed.push_back(jobs_[k].name);
  }
  write_summary_of_all();
  if (cancel) throw Cancelled();
  return std::move(result_);
}

}  // namespace

BatchResult run_batch(const std::vector<BatchJob>& jobs, const BatchOptions& options, const std::atomic<bool>& cancel,
                      const Ended& ended) {
  return Batch(jobs, options, ended).run(cancel);
}

}  // namespace bisector::batch
