#include "host/passes/device_solid.h"

#include <fmt/format.h>

#include <cmath>

#include "host/passes/packing.h"

namespace bisector::host {
namespace {

constexpr std::size_t kTetReals[2] = {60, 36};  // single, double: of kernels/tet.glsl
constexpr std::size_t kMetaWords = 10;

void pack(const TetFrame& frame, double scale, RealWords& words) {
  for (const Vec3& corner : frame.corners) words.point(scale * corner);
  for (const Vec3& normal : frame.normals) words.point(normal);
  for (const double density : frame.density) words.number(density);
  words.vector((1 / scale) * frame.gradient);
  words.moments(scaled(frame.moments, scale, true));
}

Index order_and_anchors(const TetFrame& frame) {
  Index bits = 0;
  for (unsigned k = 0; k < 4; ++k) {
    bits |= Index{frame.order[k]} << (2 * k);
    bits |= Index{frame.anchor[k]} << (8 + 2 * k);
  }
  return bits;
}

}  // namespace

double device_scale(const Solid& solid) { return std::ldexp(1.0, 16 - std::ilogb(solid.box.diagonal())); }

DeviceSolid::DeviceSolid(Device& device, Commands& commands, const Solid& given, double scale, bool is_double,
                         bool with_doubles)
    : solid(given), frames(tet_frames(given)), words(device), double_words(device), meta(device), tet_of_facet(device),
      has_doubles(with_doubles) {
  frames.push_back(TetFrame(solid.enclosure, {0, 1, 2, 3}, nullptr, 0));
  const std::size_t bytes = is_double || with_doubles ? kTetReals[1] * sizeof(double) : kTetReals[0] * sizeof(float);
  if (frames.size() > device.limits().storage_range / bytes)
    throw DeviceError(fmt::format("{}: {} tetrahedra are more than its buffers hold; use --device cpu",
                                  device.description().name, tets()));
  std::vector<Index> place(solid.mesh.vertices.size(), kNone), meta_words;
  RealWords packed(is_double), wide(true);
  packed.reserve(frames.size() * kTetReals[is_double]);
  for (std::size_t t = 0; t < frames.size(); ++t) {
    pack(frames[t], scale, packed);
    if (with_doubles) pack(frames[t], scale, wide);
    if (t == tets() || !(solid.six_volumes[t] > 0)) {
      meta_words.insert(meta_words.end(), kMetaWords, kNone);
    } else {
      for (const Index v : solid.mesh.tets[t]) {
        if (place[v] == kNone) {
          place[v] = static_cast<Index>(vertices.size());
          vertices.push_back(v);
        }
        meta_words.push_back(place[v]);
      }
      meta_words.insert(meta_words.end(), solid.adjacent[t].begin(), solid.adjacent[t].end());
      meta_words.insert(meta_words.end(), 2, kNone);
    }
    meta_words[kMetaWords * t + 8] = order_and_anchors(frames[t]);
  }
  std::vector<Index> under;
  for (const FacetSummary& summary : solid.boundary.summaries) under.push_back(solid.tet_of_triangle[summary.triangle]);
  upload(commands, words, packed);
  if (with_doubles) upload(commands, double_words, wide);
  upload(commands, meta, meta_words);
  upload(commands, tet_of_facet, under);
  commands.run();
}

}  // namespace bisector::host
