#include "batch/child.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <initializer_list>

#include "bisector/error.h"

namespace bisector::batch {
namespace {

namespace fs = std::filesystem;

constexpr double kGrace = 5;  // seconds to end in after SIGTERM
constexpr int kNotStarted = 127;

// Of a process and all below it. One that has ended meanwhile counts for nothing.
std::uint64_t memory_of(pid_t id) {
  const std::string process = fmt::format("/proc/{}/", id);
  std::uint64_t all = 0, resident = 0;
  std::ifstream(process + "statm") >> all >> resident;
  std::uint64_t bytes = resident * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
  std::error_code error;
  for (fs::directory_iterator task(process + "task", error), end; !error && task != end; task.increment(error)) {
    std::ifstream children(task->path() / "children");
    for (pid_t child = 0; children >> child;) bytes += memory_of(child);
  }
  return bytes;
}

sigset_t child_signal() {
  sigset_t set;
  sigemptyset(&set);
  sigaddset(&set, SIGCHLD);
  return set;
}

// In the new process: nothing but what is safe after fork().
[[noreturn]] void become(char* const* words, int log, pid_t parent) {
  setpgid(0, 0);
  // It does not outlive the batch, however that ends.
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent) _exit(kNotStarted);
  const sigset_t blocked = child_signal();
  sigprocmask(SIG_UNBLOCK, &blocked, nullptr);
  for (const int signal : {SIGINT, SIGTERM}) std::signal(signal, SIG_DFL);
  const int nothing = open("/dev/null", O_RDONLY);
  dup2(nothing, STDIN_FILENO);
  dup2(log, STDOUT_FILENO);
  dup2(log, STDERR_FILENO);
  execv(words[0], words);
  const char* why = std::strerror(errno);
  for (const char* part : std::initializer_list<const char*>{words[0], ": cannot be started: ", why, "\n"})
    if (write(STDERR_FILENO, part, std::strlen(part)) < 0) break;
  _exit(kNotStarted);
}

}  // namespace

Child::Child(const std::vector<std::string>& words, const std::string& log, const Limits& limits) : limits_(limits) {
  const int file = open(log.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  if (file < 0) throw Error(fmt::format("{}: cannot be written: {}", log, std::strerror(errno)));
  const sigset_t blocked = child_signal();
  sigprocmask(SIG_BLOCK, &blocked, nullptr);
  std::vector<std::string> copies = words;
  std::vector<char*> pointers;
  for (std::string& word : copies) pointers.push_back(word.data());
  pointers.push_back(nullptr);
  const pid_t parent = getpid();
  id_ = fork();
  if (id_ == 0) become(pointers.data(), file, parent);
  const int error = errno;
  close(file);
  if (id_ < 0) throw Error(fmt::format("a process cannot be started: {}", std::strerror(error)));
  setpgid(id_, id_);  // as the child does, whoever comes first
}

Child::~Child() {
  if (id_ < 0) return;
  kill(-id_, SIGKILL);
  while (waitpid(id_, nullptr, 0) < 0 && errno == EINTR) {
  }
}

bool Child::has_ended() {
  if (id_ < 0) return true;
  enforce();
  int status = 0;
  rusage used{};
  const pid_t found = wait4(id_, &status, WNOHANG, &used);
  if (found != id_) return false;
  outcome_.most_memory =
      std::max<std::uint64_t>(outcome_.most_memory, static_cast<std::uint64_t>(used.ru_maxrss) * 1024);
  end_with(status);
  return true;
}

void Child::enforce() {
  const double seconds = watch_.seconds();
  const std::uint64_t memory = memory_of(id_);
  outcome_.most_memory = std::max(outcome_.most_memory, memory);
  if (limits_.memory && memory > limits_.memory) {
    over_memory_ = true;
    kill(-id_, SIGKILL);
  }
  if (limits_.seconds > 0 && seconds > limits_.seconds && stopped_ < 0) {
    over_time_ = true;
    stop();
  }
  if (stopped_ >= 0 && seconds > stopped_ + kGrace) kill(-id_, SIGKILL);
}

void Child::stop() {
  if (id_ < 0 || stopped_ >= 0) return;
  stopped_ = watch_.seconds();
  kill(-id_, SIGTERM);
}

void Child::end_with(int status) {
  kill(-id_, SIGKILL);  // what it started and left behind
  id_ = -1;
  outcome_.seconds = watch_.seconds();
  if (WIFEXITED(status)) outcome_.exit_code = WEXITSTATUS(status);
  else outcome_.signal = WTERMSIG(status);
  if (over_memory_) outcome_.ending = Ending::memory;
  else if (over_time_) outcome_.ending = Ending::timeout;
  else if (outcome_.signal) outcome_.ending = Ending::crashed;
  else outcome_.ending = outcome_.exit_code == 0 ? Ending::done : Ending::failed;
}

void wait_for_children(double seconds) {
  const sigset_t set = child_signal();
  timespec time{};
  time.tv_sec = static_cast<time_t>(seconds);
  time.tv_nsec = static_cast<long>(1e9 * (seconds - static_cast<double>(time.tv_sec)));
  sigtimedwait(&set, nullptr, &time);
}

}  // namespace bisector::batch
