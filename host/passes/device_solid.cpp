#include "host/passes/device_solid.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host/passes/packing.h"

namespace bisector::host {
namespace {

void pack(const TetFrame& frame, double scale, bool is_double, RealWords& words) {
  const TetLayout layout = tet_layout(is_double);
  const std::size_t begin = words.count();
  for (const Vec3& corner : frame.corners) words.point(scale * corner);
  words.expect_at(begin + layout.normals);
  for (const Vec3& normal : frame.normals) words.point(normal);
  words.expect_at(begin + layout.density);
  for (const double density : frame.density) words.number(density);
  words.expect_at(begin + layout.gradient);
  words.vector((1 / scale) * frame.gradient);
  words.expect_at(begin + layout.moments);
  words.moments(scaled(frame.moments, scale, true));
  words.expect_at(begin + layout.words);
}

uint order_and_anchors(const TetFrame& frame) {
  uint bits = 0;
  for (unsigned k = 0; k < 4; ++k) {
    bits |= uint{frame.order[k]} << (2 * k);
    bits |= uint{frame.anchor[k]} << (kTetAnchorShift + 2 * k);
  }
  return bits;
}

}  // namespace

double device_scale(const Solid& solid) { return std::ldexp(1.0, 16 - std::ilogb(solid.box.diagonal())); }

DeviceSolid::DeviceSolid(Device& device, Commands& commands, const Solid& given, bool as_whole, double scale,
                         bool is_double, bool with_doubles)
    : solid(given), whole(as_whole), frames(whole ? std::vector<TetFrame>{enclosure_frame(given)} : tet_frames(given)),
      words(device), double_words(device), meta(device, Lifetime::kept), has_doubles(with_doubles) {
  const std::size_t bytes =
      is_double || with_doubles ? tet_layout(true).words * sizeof(double) : tet_layout(false).words * sizeof(float);
  if (frames.size() > device.limits().storage_range / bytes)
    throw DeviceError(
        fmt::format("{}: {} tetrahedra are more than its buffers hold", device.description().name, frames.size()));
  std::vector<Index> place(solid.mesh.vertices.size(), kNone);
  std::vector<TetMeta> metas;
  RealWords packed(is_double), wide(true);
  packed.reserve(frames.size() * tet_layout(is_double).words);
  metas.reserve(frames.size());
  for (std::size_t t = 0; t < frames.size(); ++t) {
    pack(frames[t], scale, is_double, packed);
    if (with_doubles) pack(frames[t], scale, true, wide);
    TetMeta& tet = metas.emplace_back();
    tet.sites.fill(kNone);
    tet.bits = order_and_anchors(frames[t]);
    tet.owner = kNone;
    if (whole || !(solid.six_volumes[t] > 0)) continue;
    for (std::size_t k = 0; k < 4; ++k) {
      const Index v = solid.mesh.tets[t][k];
      if (place[v] == kNone) {
        place[v] = static_cast<Index>(vertices.size());
        vertices.push_back(v);
      }
      tet.sites[k] = place[v];
    }
  }
  upload(commands, words, packed);
  if (with_doubles) upload(commands, double_words, wide);
  upload(commands, meta, metas);
  commands.run();
}

}  // namespace bisector::host
