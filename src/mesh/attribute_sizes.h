// How many numbers attributes have, and those of some places.
#pragma once

#include <fmt/format.h>

#include <string>
#include <utility>

#include "bisector/error.h"
#include "bisector/mesh.h"

namespace bisector {

// Integers are not interpolated, but for colours.
inline bool has_fractions(const Attribute& attribute) { return attribute.type >= Attribute::Type::float32; }

inline std::size_t site_count(const TriangleMesh& mesh, Attribute::Site site) {
  return site == Attribute::Site::vertex    ? mesh.vertices.size()
         : site == Attribute::Site::element ? mesh.triangles.size()
                                            : 3 * mesh.triangles.size();
}

inline std::size_t site_count(const TetMesh& mesh, Attribute::Site site) {
  return site == Attribute::Site::vertex    ? mesh.vertices.size()
         : site == Attribute::Site::element ? mesh.tets.size()
                                            : 0;
}

// The attribute at some of its places, in their order.
template <class Places>
Attribute picked(const Attribute& from, const Places& places) {
  Attribute to{from.name, from.site, from.type, from.components};
  to.values.reserve(from.components * places.size());
  for (const std::size_t i : places)
    for (std::size_t c = 0; c < from.components; ++c) to.values.push_back(from.values[from.components * i + c]);
  return to;
}

// Throws Error if values are not as many as it takes.
template <class Mesh>
void check_attributes(const Mesh& mesh) {
  for (const Attribute& attribute : mesh.attributes) {
    const std::size_t sites = site_count(mesh, attribute.site);
    if (attribute.components == 0 || attribute.values.size() != attribute.components * sites)
      throw Error(fmt::format("attribute '{}' has {} values of {} components where there are {} places for it",
                              attribute.name, attribute.values.size(), attribute.components, sites));
  }
}

}  // namespace bisector
