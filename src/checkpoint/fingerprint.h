// A number that tells data apart: 64 bits, from all bytes in order. For finding what was written before, not against
// malice.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string_view>
#include <type_traits>
#include <vector>

namespace bisector {

class Fingerprint {
 public:
  std::uint64_t value() const { return mix(state_ ^ count_); }

  // Bytes in pieces are the same as at once if all pieces but the last have a multiple of eight bytes.
  Fingerprint& add(std::string_view bytes) {
    count_ += bytes.size();
    for (; bytes.size() >= 8; bytes.remove_prefix(8)) add_word(bytes.data(), 8);
    if (!bytes.empty()) add_word(bytes.data(), bytes.size());
    return *this;
  }
  template <class T>
  Fingerprint& add(const T& value) {
    static_assert(std::has_unique_object_representations_v<T> || std::is_floating_point_v<T>);
    return add(std::string_view(reinterpret_cast<const char*>(&value), sizeof(T)));
  }
  // Its length as well. T has no padding.
  template <class T>
  Fingerprint& add_all(const std::vector<T>& values) {
    static_assert(std::is_trivially_copyable_v<T>);
    add(values.size());
    return add(std::string_view(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)));
  }

 private:
  // The finaliser of MurmurHash3 (Appleby 2011).
  static std::uint64_t mix(std::uint64_t x) {
    x = (x ^ (x >> 33)) * 0xff51afd7ed558ccdu;
    x = (x ^ (x >> 33)) * 0xc4ceb9fe1a85ec53u;
    return x ^ (x >> 33);
  }
  void add_word(const char* bytes, std::size_t size) {
    std::uint64_t word = 0;
    std::memcpy(&word, bytes, size);
    state_ = mix(state_ ^ word) + 0x9e3779b97f4a7c15u;
  }

  std::uint64_t state_ = 0, count_ = 0;
};

}  // namespace bisector
