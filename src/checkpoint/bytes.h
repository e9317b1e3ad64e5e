// Values as the bytes of a checkpoint, or of a message between ranks, in the order of the machine.
#pragma once

#include <cstddef>
#include <cstring>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "bisector/error.h"

namespace bisector {

class ByteWriter {
 public:
  template <class T>
  ByteWriter& put(const T& value) {
    static_assert(std::is_trivially_copyable_v<T>);
    bytes_.append(reinterpret_cast<const char*>(&value), sizeof(T));
    return *this;
  }
  template <class T>
  ByteWriter& put_all(const std::vector<T>& values) {
    static_assert(std::is_trivially_copyable_v<T>);
    put(values.size());
    bytes_.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T));
    return *this;
  }
  std::string take() { return std::move(bytes_); }

 private:
  std::string bytes_;
};

// Throws Error where bytes are missing or left over.
class ByteReader {
 public:
  explicit ByteReader(std::string_view bytes) : bytes_(bytes) {}

  template <class T>
  void get(T& value) {
    static_assert(std::is_trivially_copyable_v<T>);
    require(sizeof(T));
    std::memcpy(&value, bytes_.data(), sizeof(T));
    bytes_.remove_prefix(sizeof(T));
  }
  template <class T>
  T get() {
    T value{};
    get(value);
    return value;
  }
  template <class T>
  void get_all(std::vector<T>& values) {
    static_assert(std::is_trivially_copyable_v<T>);
    const auto count = get<std::size_t>();
    if (count > bytes_.size() / sizeof(T)) require(bytes_.size() + 1);
    values.resize(count);
    if (count > 0) std::memcpy(static_cast<void*>(values.data()), bytes_.data(), count * sizeof(T));
    bytes_.remove_prefix(count * sizeof(T));
  }
  void end() const {
    if (!bytes_.empty()) throw Error("a record of the checkpoint is longer than what it holds");
  }

 private:
  void require(std::size_t size) const {
    if (bytes_.size() < size) throw Error("a record of the checkpoint is shorter than what it holds");
  }

  std::string_view bytes_;
};

}  // namespace bisector
