// What a run tells its caller while it lasts, the warnings that its report lists, and how it is cancelled.
#pragma once

#include <atomic>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "bisector/context.h"

namespace bisector::job {

// What a caller hears of a run; each function may be empty.
struct Listener {
  std::function<void(const std::string&)> phase;    // what is being done
  std::function<void(const Progress&)> progress;    // within it
  std::function<void(const std::string&)> warning;  // one line each
  std::function<void(const std::string&)> note;     // likewise, of what is as it should be
  const std::atomic<bool>* cancel = nullptr;        // may be null
};

class Journal {
 public:
  explicit Journal(Listener listener) : listener_(std::move(listener)) {}
  Journal(const Journal&) = delete;
  Journal& operator=(const Journal&) = delete;

  // For the library; refers to this journal.
  Context context();
  // Says what is being done. Throws Cancelled if the caller asked to stop.
  void phase(const std::string& what);
  void warn(std::string_view message);
  void note(std::string_view message);
  // All so far, in order.
  const std::vector<std::string>& warnings() const { return warnings_; }

 private:
  Listener listener_;
  std::vector<std::string> warnings_;
};

}  // namespace bisector::job
