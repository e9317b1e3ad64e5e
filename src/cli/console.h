// What a run says on the terminal, and Ctrl-C.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdio>
#include <string>
#include <string_view>
#include <vector>

#include "bisector/context.h"
#include "job/journal.h"

namespace bisector::cli {

// From here on Ctrl-C and SIGTERM set the flag that is returned; a second one ends the program at once.
const std::atomic<bool>& watch_interrupts();
// Whether already the first of them ends the program at once.
void end_at_interrupts(bool at_once);
// From here on they are ignored, so that outputs are written together. Throws Cancelled if one came before.
void stop_watching_interrupts();

// Throws Error if something that was printed could not be written to stdout.
void require_printed();

// The last line of a run that was cancelled.
void print_cancelled();
// One line on stderr: "bisector: error: ...". Control characters in it are replaced.
void print_error(std::string_view message);

class Console {
 public:
  // `quiet` leaves errors only. With `stdout_is_taken`, text for people goes to stderr.
  Console(bool quiet, bool stdout_is_taken);
  ~Console();
  Console(const Console&) = delete;
  Console& operator=(const Console&) = delete;

  // Shows phases, progress and warnings here; Ctrl-C cancels. Has all warnings with `quiet`, too.
  job::Journal& journal() { return journal_; }
  // One line of the summary.
  void print(std::string_view line);
  // One line on stderr beside the summary.
  void note(std::string_view line);
  // The line that a summary ends with; empty names and "-" are left out.
  void print_written(const std::vector<std::string>& paths);

 private:
  using Clock = std::chrono::steady_clock;

  job::Listener listener();
  void show(const Progress& progress);
  void show_line(std::string line);
  void clear_line();

  bool quiet_;
  bool live_;  // stderr is a terminal and may show progress
  std::FILE* out_;
  std::size_t shown_ = 0;  // characters of the progress line
  Clock::time_point start_ = Clock::now(), last_shown_{};
  job::Journal journal_;
};

}  // namespace bisector::cli
