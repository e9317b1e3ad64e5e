// How positions and moments lie in device buffers: twins of kernels/real.glsl, points.glsl and layout/elements.h.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "core/geometry.h"
#include "core/single.h"
#include "host/device/buffer.h"
#include "host/device/commands.h"
#include "kernels/layout/elements.h"
#include "voronoi/moments.h"

namespace bisector::host {

// Reals one after the other, as a buffer holds them.
class RealWords {
 public:
  explicit RealWords(bool is_double) : double_(is_double) {}

  void reserve(std::size_t reals) { bytes_.reserve(reals * size()); }
  void clear() { bytes_.clear(); }
  void number(double x);
  void vector(const Vec3& v);
  // A position or direction with 48 bits or more: as it is in double, a high and a low part in single.
  void point(const Vec3& p);
  void moments(const Moments& m);
  // Throws std::logic_error unless the next real is the one at this place: packing then does not follow
  // kernels/layout/.
  void expect_at(std::size_t place) const;

  std::size_t count() const { return bytes_.size() / size(); }
  std::size_t size() const { return double_ ? sizeof(double) : sizeof(float); }
  const std::vector<std::byte>& bytes() const { return bytes_; }

 private:
  bool double_;
  std::vector<std::byte> bytes_;
};

// A number as a high and a low float, which hold 48 bits of it or more.
inline std::array<float, 2> split(double x) {
  const float high = to_single(x);
  return {high, static_cast<float>(x - static_cast<double>(high))};
}

// With it, equal pairs of floats mean equal doubles: the low half of the bits of x, a coordinate of the seed in `slot`,
// which scaling by a power of two leaves as it is. A number that a float cannot hold counts as equal to no other.
std::uint32_t low_word(double x, double scale, std::size_t slot);

// What a coordinate of the difference of two positions may lack in single precision, coordinates being at most
// `largest`: two positions of 48 bits and the rounding of their difference.
inline float residual_of(double largest) { return static_cast<float>(0x1p-44 * largest); }

// Makes room in the buffer for the data and records their transfer.
void upload(Commands& commands, Buffer& buffer, const void* data, std::size_t bytes);
template <class T>
void upload(Commands& commands, Buffer& buffer, const std::vector<T>& values) {
  upload(commands, buffer, values.data(), values.size() * sizeof(T));
}
inline void upload(Commands& commands, Buffer& buffer, const RealWords& words) {
  upload(commands, buffer, words.bytes());
}

// The kernel of that name in the given precision.
inline Kernel kernel(const char* name, bool is_double, std::vector<std::uint32_t> constants = {}) {
  return {std::string(name) + (is_double ? "_double" : "_single"), std::move(constants)};
}

// What loops_complete() of kernels/common.glsl needs: the compiler of the kernels may not know it.
inline constexpr uint kTwo = 2;

// Lengths times `scale`, a power of two, of moments over an area or a volume.
Moments scaled(const Moments& m, double scale, bool is_solid = false);

}  // namespace bisector::host
