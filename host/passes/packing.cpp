#include "host/passes/packing.h"

#include <bit>
#include <cmath>
#include <cstring>
#include <stdexcept>

namespace bisector::host {

void RealWords::number(double x) {
  const std::size_t at = bytes_.size();
  bytes_.resize(at + size());
  const float narrow = static_cast<float>(x);
  std::memcpy(bytes_.data() + at, double_ ? static_cast<const void*>(&x) : &narrow, size());
}

void RealWords::vector(const Vec3& v) {
  for (int k = 0; k < 3; ++k) number(v[k]);
}

void RealWords::point(const Vec3& p) {
  vector(p);
  if (double_) return;
  for (int k = 0; k < 3; ++k) number(static_cast<double>(split(p[k])[1]));
}

void RealWords::moments(const Moments& m) {
  number(m.mass);
  vector(m.first);
  number(m.second);
}

void RealWords::expect_at(std::size_t place) const {
  if (count() != place) throw std::logic_error("reals are not packed where the kernels read them");
}

std::uint32_t low_word(double x, double scale, std::size_t slot) {
  if (x != 0 && std::abs(scale * x) < 0x1p-100) return static_cast<std::uint32_t>(slot + 1);
  return static_cast<std::uint32_t>(std::bit_cast<std::uint64_t>(x));
}

void upload(Commands& commands, Buffer& buffer, const void* data, std::size_t bytes) {
  buffer.reserve(bytes);
  if (bytes) commands.upload(buffer, 0, data, bytes);
}

Moments scaled(const Moments& m, double scale, bool is_solid) {
  const double squared = scale * scale, mass = is_solid ? squared * scale : squared;
  return {mass * m.mass, (mass * scale) * m.first, (mass * squared) * m.second};
}

}  // namespace bisector::host
