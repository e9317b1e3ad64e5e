#include "console.h"

#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>

#include "job/messages.h"
#include "program.h"

namespace bisector::cli {
namespace {

constexpr char kCancelled[] = "bisector: cancelled\n";

std::atomic<bool> interrupted = false, at_once = false;
static_assert(std::atomic<bool>::is_always_lock_free, "used in a signal handler");
int print_failure = 0;  // error number; 0: none

extern "C" void on_interrupt(int) {
  if (!interrupted.exchange(true) && !at_once) return;
  [[maybe_unused]] const ssize_t written = write(STDERR_FILENO, kCancelled, sizeof kCancelled - 1);
  _exit(kInterrupted);
}

void handle_interrupts(void (*handler)(int)) {
  struct sigaction action {};
  action.sa_handler = handler;
  action.sa_flags = SA_RESTART;
  for (const int signal : {SIGINT, SIGTERM}) sigaction(signal, &action, nullptr);
}

std::size_t terminal_width() {
  winsize size{};
  return ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0 ? size.ws_col : 80;
}

std::string time_left(double seconds) {
  if (seconds < 60) return fmt::format("{:.0f} s left", seconds);
  if (seconds < 3600) return fmt::format("{:.0f} min left", seconds / 60);
  return fmt::format("{:.1f} h left", seconds / 3600);
}

// What cannot be written, for a disk is full, stops no run; fmt::print would.
void put(std::FILE* file, const std::string& text) { std::fputs(text.c_str(), file); }

}  // namespace

const std::atomic<bool>& watch_interrupts() {
  handle_interrupts(on_interrupt);
  return interrupted;
}

void stop_watching_interrupts() {
  handle_interrupts(SIG_IGN);
  if (interrupted) throw Cancelled();
}

void end_at_interrupts(bool at_once_now) { at_once = at_once_now; }

void require_printed() {
  if (print_failure == 0) return;
  throw Error(fmt::format("what is printed cannot be written to stdout: {}; check where it is redirected to",
                          std::strerror(print_failure)));
}

void print_cancelled() { put(stderr, kCancelled); }

void print_error(std::string_view message) {
  put(stderr, fmt::format("bisector: error: {}\n", job::one_line(message)));
}

Console::Console(bool quiet, bool stdout_is_taken)
    : quiet_(quiet), live_(!quiet && isatty(STDERR_FILENO)), out_(stdout_is_taken ? stderr : stdout),
      journal_(listener()) {}

Console::~Console() { clear_line(); }

job::Listener Console::listener() {
  job::Listener listener;
  if (live_) {
    listener.phase = [this](const std::string& what) { show_line(what); };
    listener.progress = [this](const Progress& progress) { show(progress); };
  }
  if (!quiet_)
    listener.warning = [this](const std::string& warning) {
      clear_line();
      put(stderr, fmt::format("bisector: warning: {}\n", warning));
    };
  listener.note = [this](const std::string& line) { note(line); };
  listener.cancel = &interrupted;
  return listener;
}

void Console::print(std::string_view line) {
  if (quiet_) return;
  clear_line();
  put(out_, fmt::format("{}\n", line));
  // Who reads a pipe sees it at once.
  if ((std::fflush(out_) != 0 || std::ferror(out_)) && out_ == stdout && print_failure == 0) print_failure = errno;
}

void Console::note(std::string_view line) {
  if (quiet_) return;
  clear_line();
  put(stderr, fmt::format("bisector: {}\n", job::one_line(line)));
}

void Console::print_written(const std::vector<std::string>& paths) {
  std::string line;
  for (const std::string& path : paths)
    if (!path.empty() && path != "-") line += (line.empty() ? "written    " : ", ") + path;
  if (!line.empty()) print(line);
}

void Console::show(const Progress& progress) {
  const Clock::time_point now = Clock::now();
  if (now - last_shown_ < std::chrono::milliseconds(100)) return;
  last_shown_ = now;
  const double elapsed = std::chrono::duration<double>(now - start_).count();
  const double fraction = std::clamp(progress.fraction, 0.0, 1.0);
  std::string line = fmt::format("iteration {}/{}  energy {:.6e}  gradient {:.2e}", progress.iteration,
                                 progress.iterations, progress.energy, progress.gradient_norm);
  if (!progress.phase.empty()) line = fmt::format("{}  {}", progress.phase, line);
  if (fraction > 0) line += fmt::format("  {:.0f} %", 100 * fraction);
  if (fraction > 0.02) line += "  " + time_left(elapsed * (1 - fraction) / fraction);
  show_line(std::move(line));
}

// The line must not reach the last column, or the terminal would wrap it.
void Console::show_line(std::string line) {
  line = job::one_line(line).substr(0, terminal_width() - 1);
  const std::size_t length = line.size();
  if (length < shown_) line.append(shown_ - length, ' ');
  put(stderr, fmt::format("\r{}", line));
  std::fflush(stderr);
  shown_ = length;
}

void Console::clear_line() {
  if (shown_ == 0) return;
  put(stderr, fmt::format("\r{}\r", std::string(shown_, ' ')));
  std::fflush(stderr);
  shown_ = 0;
}

}  // namespace bisector::cli
