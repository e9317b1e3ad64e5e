#include "batch/jobs_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>

#include "bisector/error.h"
#include "job/job.h"
#include "job/messages.h"
#include "job/outputs.h"

namespace bisector::batch {
namespace {

namespace fs = std::filesystem;
using job::Json;

// Keys that a batch sets itself.
constexpr const char* kOwnKeys[] = {"report", "quiet", "verbose", "help"};
// What a batch writes beside the files of its jobs.
constexpr const char* kSummary = "summary";
// Of a job, in bytes: names of files have at most 255.
constexpr std::size_t kLongestName = 200;

[[noreturn]] void fail(const std::string& path, std::size_t line, const std::string& what) {
  throw Error(fmt::format("{}: line {}: {}", path, line, what));
}

class LineReader {
 public:
  LineReader(const std::string& path, std::size_t line) : path_(path), line_(line) {}

  BatchJob read(const std::string& text) const {
    BatchJob job;
    job.line = line_;
    std::set<std::string> keys;
    const auto note_key = [&](int depth, Json::parse_event_t event, Json& parsed) {
      if (event == Json::parse_event_t::key && depth == 1 && !keys.insert(parsed.get<std::string>()).second)
        fail(fmt::format("\"{}\" is given twice", parsed.get<std::string>()));
      return true;
    };
    try {
      job.given = Json::parse(text, note_key);
    } catch (const Json::exception&) {
      fail("is not JSON; a line is one object, such as {\"command\": \"remesh\", \"input\": \"in.off\", ...}");
    }
    if (!job.given.is_object()) fail("is no JSON object");
    const std::string command = text_of(job.given, "command");
    const std::unique_ptr<job::Job> kind = job::make_job(command);
    if (!kind) fail(fmt::format("there is no command \"{}\"; use {}", command, job::known_commands()));
    job.input = text_of(job.given, "input");
    job.words = {command, job.input};
    std::map<std::string, const char*> outputs;
    const std::vector<job::OutputKind> kinds = kind->outputs();
    for (const job::OutputKind& output : kinds) outputs[output.name] = output.option;
    for (const auto& [key, value] : job.given.items()) {
      if (key == "command" || key == "input" || key == "name") continue;
      if (std::find(std::begin(kOwnKeys), std::end(kOwnKeys), key) != std::end(kOwnKeys))
        fail(fmt::format("\"{}\" cannot be given; a batch keeps what each job reports and prints", key));
      const auto output = outputs.find(key);
      if (output != outputs.end()) {
        if (!value.is_string() || value.get<std::string>().empty())
          fail(fmt::format("\"{}\" is to be the name of a file", key));
        job.outputs.push_back(value.get<std::string>());
        job.words.insert(job.words.end(), {output->second, job.outputs.back()});
        continue;
      }
      std::string option = key;
      std::replace(option.begin(), option.end(), '_', '-');
      job.options.insert(option);
      add_option(option, value, job.words);
    }
    job.name = name_of(job);
    if (job.name.empty()) fail("the job has no name; give it a \"name\", or an output that is no folder");
    if (job.name.size() > kLongestName)
      fail(fmt::format("the name {}... is too long for a file; give the job a \"name\" of at most {} characters",
                       job.name.substr(0, 20), kLongestName));
    return job;
  }

 private:
  [[noreturn]] void fail(const std::string& what) const { batch::fail(path_, line_, job::one_line(what)); }

  std::string text_of(const Json& object, const char* key) const {
    const auto found = object.find(key);
    if (found == object.end() || !found->is_string() || found->get<std::string>().empty())
      fail(fmt::format("\"{}\" is missing or no string", key));
    return found->get<std::string>();
  }

  void add_option(const std::string& name, const Json& value, std::vector<std::string>& words) const {
    if (value.is_null() || value == false) return;
    if (value.is_array()) {
      for (const Json& one : value) {
        if (one.is_array()) fail(fmt::format("\"{}\" has lists in a list; use one list", name));
        add_option(name, one, words);
      }
      return;
    }
    if (value.is_object()) fail(fmt::format("\"{}\" is an object; use a string or a number", name));
    const bool is_letter = name.size() == 1;
    words.push_back((is_letter ? "-" : "--") + name);
    if (value == true) return;
    const std::string text = value.is_string() ? value.get<std::string>() : value.dump();
    if (is_letter) words.push_back(text);
    else words.back() += "=" + text;
  }

  std::string name_of(const BatchJob& job) const {
    const auto given = job.given.find("name");
    if (given == job.given.end()) return fs::path(job.outputs.empty() ? job.input : job.outputs.front()).stem();
    const std::string name = text_of(job.given, "name");
    if (name.front() == '.' || name == kSummary || name.find('/') != std::string::npos ||
        name.find('\0') != std::string::npos)
      fail(fmt::format("\"{}\" cannot be the name of a job's files", name));
    return name;
  }

  const std::string& path_;
  std::size_t line_;
};

// Names that were made up give way to those that were given, and to those before them.
void make_unique(const std::string& path, std::vector<BatchJob>& jobs) {
  std::map<std::string, std::size_t> line_of{{kSummary, 0}};
  for (const BatchJob& job : jobs) {
    if (!job.given.contains("name")) continue;
    const auto [found, fresh] = line_of.emplace(job.name, job.line);
    if (!fresh) fail(path, job.line, fmt::format("the name \"{}\" is that of line {}, too", job.name, found->second));
  }
  for (BatchJob& job : jobs) {
    if (job.given.contains("name")) continue;
    const std::string stem = job.name;
    for (int k = 2; !line_of.emplace(job.name, job.line).second; ++k) job.name = fmt::format("{}-{}", stem, k);
  }
}

}  // namespace

std::vector<BatchJob> read_jobs(const std::string& path) {
  std::ifstream file(path);
  if (!file) throw Error(fmt::format("{}: cannot be opened: {}", path, std::strerror(errno)));
  std::vector<BatchJob> jobs;
  std::size_t line = 0;
  for (std::string text; std::getline(file, text);) {
    ++line;
    if (text.find_first_not_of(" \t\r") != std::string::npos) jobs.push_back(LineReader(path, line).read(text));
  }
  if (file.bad()) throw Error(fmt::format("{}: cannot be read: {}", path, std::strerror(errno)));
  if (jobs.empty()) throw Error(path + ": has no jobs; write a JSON object on each line");
  make_unique(path, jobs);
  return jobs;
}

void check_files(const std::string& path, const std::vector<BatchJob>& jobs, const std::string& folder) {
  const fs::path home = job::target_of(folder + '/' + kSummary).parent_path();
  std::set<fs::path> own{job::target_of(path)};
  for (const char* ending : {".json", ".csv", ".html"}) own.insert(home / (std::string(kSummary) + ending));
  for (const BatchJob& job : jobs)
    for (const char* ending : {".json", ".log"}) own.insert(home / (job.name + ending));
  std::map<fs::path, std::size_t> writer;  // its line
  for (const BatchJob& job : jobs)
    for (const std::string& output : job.outputs) {
      const fs::path file = job::target_of(output);
      const bool hidden = file.parent_path() == home && file.filename().string().starts_with('.');
      if (hidden || own.contains(file))
        fail(path, job.line, output + " is a file of the batch itself; choose another name, or another folder for -o");
      const auto [found, fresh] = writer.emplace(file, job.line);
      if (!fresh)
        fail(path, job.line, fmt::format("{} is written by line {}, too; choose another name", output, found->second));
    }
  for (const BatchJob& job : jobs)
    for (const std::string& input : job.inputs) {
      const auto found = writer.find(job::target_of(input));
      if (found != writer.end() && found->second != job.line)
        fail(path, job.line,
             fmt::format("{} is written by line {}; jobs run in any order: put this one into a batch of its own", input,
                         found->second));
    }
}

}  // namespace bisector::batch
