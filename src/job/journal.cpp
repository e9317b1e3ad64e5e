#include "job/journal.h"

#include "job/messages.h"

namespace bisector::job {

Context Journal::context() {
  Context context;
  context.progress = listener_.progress;
  context.warning = [this](const std::string& line) { warn(line); };
  context.cancel = listener_.cancel;
  return context;
}

void Journal::phase(const std::string& what) {
  if (listener_.cancel && listener_.cancel->load(std::memory_order_relaxed)) throw Cancelled();
  if (listener_.phase) listener_.phase(what);
}

void Journal::note(std::string_view message) {
  if (listener_.note) listener_.note(one_line(message));
}

void Journal::warn(std::string_view message) {
  warnings_.push_back(one_line(message));
  if (listener_.warning) listener_.warning(warnings_.back());
}

}  // namespace bisector::job
