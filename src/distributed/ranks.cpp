#include "distributed/ranks.h"

#include <exception>
#include <new>
#include <utility>

namespace bisector {
namespace {

// The last byte of a message: whether the rest is what was asked for, or why there is none.
constexpr char kGood = 0, kFailed = 1;

std::string why(const std::exception_ptr& failure) {
  try {
    std::rethrow_exception(failure);
  } catch (const std::bad_alloc&) {
    return "not enough memory; use more ranks, or machines with more of it";
  } catch (const std::exception& error) {
    return error.what();
  } catch (...) {
    return "unknown error";
  }
}

}  // namespace

std::vector<std::string> Ranks::exchange(std::vector<std::string> to) {
  for (std::size_t r = 0; r < to.size(); ++r) {
    to[r] += kGood;
    if (r != static_cast<std::size_t>(rank())) bytes_sent_ += to[r].size();
  }
  std::vector<std::string> received = communicator_.exchange(std::move(to));
  for (std::size_t r = 0; r < received.size(); ++r) {
    const bool failed = received[r].back() == kFailed;
    received[r].pop_back();
    if (failed) throw RankFailed("rank " + std::to_string(r) + ": " + received[r]);
  }
  return received;
}

std::string Ranks::broadcast(std::string message) {
  if (!is_root()) return scatter({});
  return scatter(std::vector<std::string>(static_cast<std::size_t>(size()), message));
}

std::string Ranks::scatter(std::vector<std::string> messages) {
  messages.resize(static_cast<std::size_t>(size()));
  return std::move(exchange(std::move(messages)).front());
}

std::vector<std::string> Ranks::collect(std::string message) {
  std::vector<std::string> to(static_cast<std::size_t>(size()));
  to.front() = std::move(message);
  std::vector<std::string> received = exchange(std::move(to));
  return is_root() ? std::move(received) : std::vector<std::string>();
}

void Ranks::tell_failure() noexcept {
  try {
    const std::string message = why(std::current_exception()) + kFailed;
    communicator_.exchange(std::vector<std::string>(static_cast<std::size_t>(size()), message));
  } catch (...) {
    std::terminate();  // the others would wait for ever
  }
}

}  // namespace bisector
