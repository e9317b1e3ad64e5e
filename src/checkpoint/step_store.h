// The file of a checkpoint: results of the steps of a run, and states within them.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "bisector/checkpoint.h"
#include "bisector/context.h"
#include "core/stopwatch.h"

namespace bisector {

// A step by its place among all of the run, and a fingerprint of what it starts from.
struct StepKey {
  std::uint64_t number = 0, start = 0;
  auto operator<=>(const StepKey&) const = default;
};

class StepStore {
 public:
  // As Checkpoint.
  StepStore(std::string path, std::string_view identity, const CheckpointOptions& options);
  ~StepStore();
  StepStore(const StepStore&) = delete;
  StepStore& operator=(const StepStore&) = delete;

  bool empty() const { return results_.empty() && states_.empty(); }
  void remove();
  // What there was when it was opened, in words.
  const std::string& found() const { return found_; }

  // The next step of the run.
  StepKey begin(std::uint64_t start);
  std::optional<std::string> result(const StepKey& step) const { return read(step, Kind::result); }
  std::optional<std::string> state(const StepKey& step) const { return read(step, Kind::state); }

  // Whether the state is to be written again: it is so rarely that this takes little of the time.
  bool state_is_due() const;
  void keep_state(const StepKey& step, std::string_view bytes, const Context& context);
  // After a step of so many seconds. Not kept if computing it again takes less time than writing is worth.
  void keep_result(const StepKey& step, std::string_view bytes, double seconds, const Context& context);

 private:
  enum class Kind : std::uint32_t { result = 1, state = 2 };
  struct Head;
  struct Place {
    std::uint64_t offset = 0, size = 0;  // of the bytes behind the head
  };
  using Places = std::map<StepKey, Place>;

  Places& places(Kind kind) { return kind == Kind::result ? results_ : states_; }
  const Places& places(Kind kind) const { return kind == Kind::result ? results_ : states_; }
  static Head head_of(const StepKey& step, Kind kind, std::string_view bytes);
  void open_file();
  void check_head_line(const std::string& line);
  void index();
  std::string describe(std::uint64_t left_out) const;
  bool is_whole(const Head& head, std::uint64_t offset, std::uint64_t size) const;
  std::optional<std::string> read(const StepKey& step, Kind kind) const;
  void append(const StepKey& step, Kind kind, std::string_view bytes, const Context& context);
  void forget(Kind kind, const StepKey& step);
  void compact();

  std::string path_;
  std::string head_line_, found_;
  CheckpointOptions options_;
  int descriptor_ = -1;
  bool failed_ = false;      // nothing is written any more
  std::uint64_t steps_ = 0;  // begun
  std::uint64_t end_ = 0;    // of the file's whole records
  std::uint64_t dead_ = 0;   // bytes of records that nobody will ask for
  Places results_, states_;
  Stopwatch watch_;
  double last_state_ = 0;     // when it was written or its step began, in seconds of the watch
  double state_seconds_ = 0;  // that writing it took
  double bytes_per_second_ = 5e8;
};

}  // namespace bisector
