#include "batch/record.h"

#include <fmt/format.h>
#include <sys/stat.h>

#include <algorithm>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <utility>

#include "job/messages.h"

namespace bisector::batch {
namespace {

namespace fs = std::filesystem;
using job::Json;

constexpr std::pair<Ending, const char*> kWords[] = {{Ending::done, "done"},
                                                     {Ending::failed, "failed"},
                                                     {Ending::crashed, "crashed"},
                                                     {Ending::timeout, "timeout"},
                                                     {Ending::memory, "memory"}};

}  // namespace

const char* word_of(Ending ending) {
  return std::find_if(std::begin(kWords), std::end(kWords), [&](const auto& word) { return word.first == ending; })
      ->second;
}

Json state_of(const std::vector<std::string>& files) {
  Json state = Json::object();
  for (const std::string& file : files) {
    struct stat found {};
    state[file] = nullptr;
    if (stat(file.c_str(), &found) == 0) state[file] = {found.st_size, found.st_mtim.tv_sec, found.st_mtim.tv_nsec};
  }
  return state;
}

Json make_record(const BatchJob& job, const Outcome& outcome, const std::string& message, Json report, Json files) {
  Json record{{"job", job.given}, {"status", word_of(outcome.ending)}};
  if (outcome.signal) record["signal"] = outcome.signal;
  else record["exit_code"] = outcome.exit_code;
  record["seconds"] = outcome.seconds;
  record["memory_mib"] = static_cast<double>(outcome.most_memory) / (1024 * 1024);
  if (outcome.ending != Ending::done) record["message"] = message;
  record["report"] = std::move(report);
  record["files"] = std::move(files);
  return record;
}

bool is_done(const Json& record) { return record["status"] == word_of(Ending::done); }

std::optional<Json> read_record(const std::string& path, const BatchJob& job, bool retry) {
  std::ifstream file(path);
  if (!file) return {};
  Json record = Json::parse(file, nullptr, false);
  if (!record.is_object() || record.value("job", Json()) != job.given ||
      record.value("files", Json()) != state_of(job.inputs))
    return {};
  const Json status = record.value("status", Json());
  const auto known = [&](const auto& word) { return status == word.second; };
  if (std::none_of(std::begin(kWords), std::end(kWords), known)) return {};
  if (!is_done(record)) return retry ? std::optional<Json>() : record;
  std::error_code error;
  for (const std::string& output : job.outputs)
    if (!fs::exists(output, error)) return {};
  return record;
}

std::string last_error(const std::string& log) {
  constexpr const char* kMark = "error: ";
  std::ifstream file(log);
  std::string last, error;
  for (std::string line; std::getline(file, line);) {
    if (line.empty()) continue;
    last = line;
    if (const std::size_t at = line.find(kMark); at != std::string::npos) error = line.substr(at + std::strlen(kMark));
  }
  return job::one_line(error.empty() ? last : error);
}

std::string message_of(const Outcome& outcome, const Limits& limits, const std::string& said) {
  switch (outcome.ending) {
    case Ending::timeout: return fmt::format("took longer than {} s", limits.seconds);
    case Ending::memory:
      return fmt::format("held more than {:.4g} MiB of memory", static_cast<double>(limits.memory) / (1024 * 1024));
    case Ending::crashed:
      return fmt::format("was killed by signal {} ({}){}", outcome.signal, strsignal(outcome.signal),
                         outcome.signal == SIGKILL ? ", perhaps for want of memory" : "");
    case Ending::done:
    case Ending::failed: break;
  }
  return said.empty() ? fmt::format("ended with exit code {} and said nothing", outcome.exit_code) : said;
}

}  // namespace bisector::batch
