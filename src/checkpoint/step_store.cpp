#include "checkpoint/step_store.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cerrno>
#include <cstring>
#include <utility>
#include <vector>

#include "bisector/error.h"
#include "bisector/version.h"
#include "checkpoint/fingerprint.h"

namespace bisector {
namespace {

constexpr std::uint64_t kPiece = 1 << 20;  // bytes that are read or copied at once
// Of the time, what writing states may take, and of a step's, what writing its result may, unless all are wanted.
constexpr double kStateShare = 1.0 / 30, kResultShare = 1.0 / 20;
// Bytes of dead records, beside as many as there are others, from which on the file is written anew.
constexpr std::uint64_t kManyDead = 16 << 20;

[[noreturn]] void fail(const std::string& path, const std::string& what) { throw Error(path + ": " + what); }

bool write_at(int descriptor, std::string_view bytes, std::uint64_t offset) {
  while (!bytes.empty()) {
    const ssize_t n = pwrite(descriptor, bytes.data(), bytes.size(), static_cast<off_t>(offset));
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return false;
    bytes.remove_prefix(static_cast<std::size_t>(n));
    offset += static_cast<std::uint64_t>(n);
  }
  return true;
}

bool read_at(int descriptor, char* bytes, std::uint64_t size, std::uint64_t offset) {
  while (size > 0) {
    const ssize_t n = pread(descriptor, bytes, size, static_cast<off_t>(offset));
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return false;
    bytes += n;
    offset += static_cast<std::uint64_t>(n);
    size -= static_cast<std::uint64_t>(n);
  }
  return true;
}

bool is_file_of(const std::string& path, int descriptor) {
  struct stat named {
  }, open{};
  return stat(path.c_str(), &named) == 0 && fstat(descriptor, &open) == 0 && named.st_dev == open.st_dev &&
         named.st_ino == open.st_ino;
}

}  // namespace

struct StepStore::Head {
  std::uint32_t kind = 0, unused = 0;
  StepKey step;
  std::uint64_t size = 0;
  std::uint64_t check = 0;  // fingerprint of the others and of the bytes that follow

  Fingerprint of_head() const { return Fingerprint().add(kind).add(step.number).add(step.start).add(size).add(unused); }
};

StepStore::StepStore(std::string path, std::string_view identity, const CheckpointOptions& options)
    : path_(std::move(path)), options_(options) {
  head_line_ = fmt::format("bisector checkpoint, form 1, {}-endian, version {}.{}.{}, run {:016x}\n",
                           std::endian::native == std::endian::little ? "little" : "big", BISECTOR_VERSION_MAJOR,
                           BISECTOR_VERSION_MINOR, BISECTOR_VERSION_PATCH, Fingerprint().add(identity).value());
  try {
    open_file();
    index();
  } catch (...) {
    if (descriptor_ >= 0) close(descriptor_);
    throw;
  }
}

StepStore::~StepStore() {
  if (empty() && is_file_of(path_, descriptor_)) remove();
  close(descriptor_);
}

// Held by this process alone, and under its name still.
void StepStore::open_file() {
  do {
    if (descriptor_ >= 0) close(descriptor_);
    descriptor_ = open(path_.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | (options_.resume ? 0 : O_EXCL), 0666);
    if (descriptor_ < 0 && errno == EEXIST) fail(path_, "is there already; resume it, or remove it");
    if (descriptor_ < 0) fail(path_, fmt::format("cannot be written: {}", std::strerror(errno)));
    if (flock(descriptor_, LOCK_EX | LOCK_NB) != 0) fail(path_, "is in use by another process; wait for it");
  } while (!is_file_of(path_, descriptor_));
}

void StepStore::check_head_line(const std::string& line) {
  if (line == head_line_) return;
  const auto before_run = [](const std::string& text) { return text.substr(0, text.find(", run ")); };
  if (!line.starts_with("bisector checkpoint,")) fail(path_, "is no checkpoint; name another file");
  if (before_run(line) == before_run(head_line_))
    fail(path_, "is of a run with another input or other options; give those, or name another file");
  fail(path_, "is of another version of Bisector or another kind of machine; go on with that, or remove the file");
}

// Finds the records, and cuts off what is not whole.
void StepStore::index() {
  const off_t length = lseek(descriptor_, 0, SEEK_END);
  if (length < 0) fail(path_, "cannot be read; name a file on a disk");
  const auto size = static_cast<std::uint64_t>(length);
  std::string line(std::min<std::uint64_t>(head_line_.size(), size), '\0');
  if (!read_at(descriptor_, line.data(), line.size(), 0)) fail(path_, "cannot be read");
  // A run that was killed as it began has left less than the first line.
  if (line.size() == head_line_.size() || !head_line_.starts_with(line)) check_head_line(line);
  if (line.size() < head_line_.size() && !write_at(descriptor_, head_line_, 0)) {
    const int error = errno;
    remove();
    fail(path_, fmt::format("cannot be written: {}", std::strerror(error)));
  }
  end_ = head_line_.size();
  Head head;
  while (end_ + sizeof head <= size && read_at(descriptor_, reinterpret_cast<char*>(&head), sizeof head, end_)) {
    const std::uint64_t offset = end_ + sizeof head;
    if (head.size > size - offset || !is_whole(head, offset, head.size)) break;
    const auto kind = static_cast<Kind>(head.kind);
    if (kind != Kind::result && kind != Kind::state) break;
    forget(kind, head.step);
    if (kind == Kind::result) forget(Kind::state, head.step);
    places(kind)[head.step] = {offset, head.size};
    end_ = offset + head.size;
  }
  found_ = describe(size - std::min(end_, size));
  if (end_ < size && ftruncate(descriptor_, static_cast<off_t>(end_)) != 0)
    fail(path_, fmt::format("cannot be written: {}", std::strerror(errno)));
}

std::string StepStore::describe(std::uint64_t left_out) const {
  std::string found = "nothing that could be gone on from";
  if (!empty())
    found = fmt::format("{} step{} done{}", results_.size(), results_.size() == 1 ? "" : "s",
                        states_.empty() ? "" : ", and one under way");
  if (left_out > 0) found += fmt::format("; the last {} bytes are damaged or half written and left out", left_out);
  return found;
}

bool StepStore::is_whole(const Head& head, std::uint64_t offset, std::uint64_t size) const {
  Fingerprint found = head.of_head();
  std::vector<char> piece(std::min(kPiece, size));
  while (size > 0) {
    const std::uint64_t part = std::min(kPiece, size);
    if (!read_at(descriptor_, piece.data(), part, offset)) return false;
    found.add(std::string_view(piece.data(), part));
    offset += part;
    size -= part;
  }
  return found.value() == head.check;
}

StepStore::Head StepStore::head_of(const StepKey& step, Kind kind, std::string_view bytes) {
  Head head;
  head.kind = static_cast<std::uint32_t>(kind);
  head.step = step;
  head.size = bytes.size();
  head.check = head.of_head().add(bytes).value();
  return head;
}

void StepStore::forget(Kind kind, const StepKey& step) {
  const auto found = places(kind).find(step);
  if (found == places(kind).end()) return;
  dead_ += sizeof(Head) + found->second.size;
  places(kind).erase(found);
}

StepKey StepStore::begin(std::uint64_t start) {
  last_state_ = watch_.seconds();
  return {steps_++, start};
}

std::optional<std::string> StepStore::read(const StepKey& step, Kind kind) const {
  const auto found = places(kind).find(step);
  if (found == places(kind).end()) return {};
  std::string bytes(found->second.size, '\0');
  if (!read_at(descriptor_, bytes.data(), bytes.size(), found->second.offset)) return {};
  return bytes;
}

bool StepStore::state_is_due() const {
  if (failed_) return false;
  return options_.every <= 0 ||
         watch_.seconds() - last_state_ >= std::max(options_.every, state_seconds_ / kStateShare);
}

void StepStore::keep_state(const StepKey& step, std::string_view bytes, const Context& context) {
  const double before = watch_.seconds();
  append(step, Kind::state, bytes, context);
  last_state_ = watch_.seconds();
  state_seconds_ = last_state_ - before;
}

void StepStore::keep_result(const StepKey& step, std::string_view bytes, double seconds, const Context& context) {
  const double writing = static_cast<double>(bytes.size()) / bytes_per_second_;
  if (options_.every > 0 && writing > kResultShare * seconds) return;
  append(step, Kind::result, bytes, context);
  forget(Kind::state, step);
}

// The head is written last: without it a record is not there.
void StepStore::append(const StepKey& step, Kind kind, std::string_view bytes, const Context& context) {
  if (failed_) return;
  const Stopwatch writing;
  const Head head = head_of(step, kind, bytes);
  const std::string_view head_bytes(reinterpret_cast<const char*>(&head), sizeof head);
  if (!write_at(descriptor_, bytes, end_ + sizeof head) || fdatasync(descriptor_) != 0 ||
      !write_at(descriptor_, head_bytes, end_) || fdatasync(descriptor_) != 0) {
    failed_ = true;
    const int error = errno;
    if (ftruncate(descriptor_, static_cast<off_t>(end_)) != 0) end_ = 0;
    context.warn(fmt::format("{}: cannot be written: {}; the run goes on, and what comes now is not kept", path_,
                             std::strerror(error)));
    return;
  }
  if (bytes.size() > kPiece) bytes_per_second_ = static_cast<double>(bytes.size()) / std::max(writing.seconds(), 1e-9);
  forget(kind, step);
  places(kind)[step] = {end_ + sizeof head, bytes.size()};
  end_ += sizeof head + bytes.size();
  if (dead_ > kManyDead + (end_ - dead_)) compact();
}

// Writes the records that count to a new file in place of the old one, which stays if that fails.
void StepStore::compact() {
  const std::string name = path_ + ".new";
  const int fresh = open(name.c_str(), O_RDWR | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  if (fresh < 0) return;
  Places moved[2];
  std::uint64_t end = head_line_.size();
  bool done = flock(fresh, LOCK_EX | LOCK_NB) == 0 && write_at(fresh, head_line_, 0);
  std::vector<char> piece(kPiece);
  for (const Kind kind : {Kind::result, Kind::state})
    for (const auto& [step, place] : places(kind)) {
      const std::uint64_t begin = place.offset - sizeof(Head), size = sizeof(Head) + place.size;
      for (std::uint64_t at = 0; done && at < size; at += kPiece) {
        const std::uint64_t part = std::min(kPiece, size - at);
        done = read_at(descriptor_, piece.data(), part, begin + at) &&
               write_at(fresh, std::string_view(piece.data(), part), end + at);
      }
      moved[kind == Kind::state][step] = {end + sizeof(Head), place.size};
      end += size;
    }
  if (!done || fdatasync(fresh) != 0 || rename(name.c_str(), path_.c_str()) != 0) {
    close(fresh);
    unlink(name.c_str());
    return;
  }
  close(std::exchange(descriptor_, fresh));
  results_ = std::move(moved[0]);
  states_ = std::move(moved[1]);
  end_ = end;
  dead_ = 0;
}

void StepStore::remove() { unlink(path_.c_str()); }

Checkpoint::Checkpoint(const std::string& path, std::string_view identity, const CheckpointOptions& options)
    : steps_(std::make_unique<StepStore>(path, identity, options)) {}
Checkpoint::~Checkpoint() = default;
bool Checkpoint::empty() const { return steps_->empty(); }
std::string Checkpoint::found() const { return steps_->found(); }
void Checkpoint::remove() { steps_->remove(); }

}  // namespace bisector
