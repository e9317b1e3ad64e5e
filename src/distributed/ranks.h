// The ranks of a run in lockstep: messages, and failures that all of them hear of.
#pragma once

#include <cstdint>
#include <cstring>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "bisector/error.h"
#include "checkpoint/bytes.h"
#include "distributed/communicator.h"

namespace bisector {

// Another rank has failed.
class RankFailed : public Error {
 public:
  using Error::Error;
};

class Ranks {
 public:
  // The communicator must outlive it.
  explicit Ranks(Communicator& communicator) : communicator_(communicator) {}

  int rank() const { return communicator_.rank(); }
  int size() const { return communicator_.size(); }
  bool is_root() const { return rank() == 0; }
  // Sent to other ranks so far.
  std::uint64_t bytes_sent() const { return bytes_sent_; }

  // Calls `body`, which takes part in the same exchanges on every rank. Where it throws, every other rank gets
  // RankFailed from its next exchange.
  template <class Body>
  void together(const Body& body);

  // One message to each rank, given by rank. Returns those from each. Throws RankFailed, as do those below.
  std::vector<std::string> exchange(std::vector<std::string> to);
  // The same with lists.
  template <class T>
  std::vector<std::vector<T>> exchange(std::vector<std::vector<T>> to);
  // Rank 0's message.
  std::string broadcast(std::string message);
  // Rank 0's messages, one for each rank; the others give none.
  std::string scatter(std::vector<std::string> messages);
  // On rank 0 the messages of all, by rank; on the others nothing.
  std::vector<std::string> collect(std::string message);
  // The same with lists: those of all, one after another.
  template <class T>
  std::vector<T> collect(const std::vector<T>& list);
  // One value of each rank, by rank.
  template <class T>
  std::vector<T> gather(const T& value);

 private:
  void tell_failure() noexcept;

  Communicator& communicator_;
  std::uint64_t bytes_sent_ = 0;
};

template <class Body>
void Ranks::together(const Body& body) {
  try {
    body();
  } catch (const RankFailed&) {
    throw;
  } catch (...) {
    tell_failure();
    throw;
  }
}

template <class T>
std::vector<std::vector<T>> Ranks::exchange(std::vector<std::vector<T>> to) {
  std::vector<std::string> messages;
  for (std::vector<T>& some : to) messages.push_back(ByteWriter().put_all(std::exchange(some, {})).take());
  messages = exchange(std::move(messages));
  std::vector<std::vector<T>> received(messages.size());
  for (std::size_t r = 0; r < messages.size(); ++r) {
    ByteReader(messages[r]).get_all(received[r]);
    messages[r] = {};
  }
  return received;
}

template <class T>
std::vector<T> Ranks::collect(const std::vector<T>& list) {
  std::vector<T> all, some;
  for (std::string& message : collect(ByteWriter().put_all(list).take())) {
    ByteReader(message).get_all(some);
    message = {};
    all.insert(all.end(), some.begin(), some.end());
  }
  return all;
}

template <class T>
std::vector<T> Ranks::gather(const T& value) {
  static_assert(std::is_trivially_copyable_v<T>);
  const std::string message(reinterpret_cast<const char*>(&value), sizeof(T));
  const std::vector<std::string> received =
      exchange(std::vector<std::string>(static_cast<std::size_t>(size()), message));
  std::vector<T> values(received.size());
  for (std::size_t r = 0; r < received.size(); ++r) std::memcpy(&values[r], received[r].data(), sizeof(T));
  return values;
}

}  // namespace bisector
