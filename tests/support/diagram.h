// Diagrams computed by the library, and comparisons of them down to the last bit.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <string>
#include <vector>

#include "backend/backend.h"
#include "core/parallel.h"
#include "support/models.h"
#include "voronoi/dual.h"
#include "voronoi/restricted.h"
#include "voronoi/tiling.h"

namespace bisector::test {

inline Diagram diagram_of(RestrictedVoronoi& voronoi, const std::vector<Vec3>& seeds, NeighbourSource source) {
  Diagram d;
  const DiagramWork work = voronoi.evaluate(seeds, source, Want::polygons, d);
  EXPECT_EQ(work.counts.pairs, d.polygons.pairs.size());
  EXPECT_EQ(d.moments.triangles.values.size(), d.polygons.pairs.size());
  return d;
}

inline Diagram diagram_of(const Surface& surface, const std::vector<Vec3>& seeds, NeighbourSource source) {
  RestrictedVoronoi voronoi(surface);
  return diagram_of(voronoi, seeds, source);
}

// A backend's diagram, and what its evaluation reported.
struct Evaluated : Diagram {
  EvaluationReport report;
};

inline Evaluated evaluated(Backend& backend, const std::vector<Vec3>& seeds, Want want) {
  Evaluated result;
  result.report = backend.evaluate(seeds, want, result);
  return result;
}

inline Evaluated diagram_of(Backend& backend, const std::vector<Vec3>& seeds) {
  return evaluated(backend, seeds, Want::polygons);
}

inline bool same_bits(double a, double b) { return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b); }
inline bool same_bits(const Vec3& a, const Vec3& b) {
  return same_bits(a.x, b.x) && same_bits(a.y, b.y) && same_bits(a.z, b.z);
}
inline bool same_bits(const Moments& a, const Moments& b) {
  return same_bits(a.mass, b.mass) && same_bits(a.first, b.first) && same_bits(a.second, b.second);
}
template <class T>
bool same_bits(const std::vector<T>& a, const std::vector<T>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const T& x, const T& y) { return same_bits(x, y); });
}

inline std::vector<std::array<Index, 2>> pairs_of(const RestrictedPolygons& polygons) {
  std::vector<std::array<Index, 2>> pairs;
  pairs.reserve(polygons.pairs.size());
  for (const auto& [triangle, cell] : polygons.pairs) pairs.push_back({triangle, cell});
  return pairs;
}

// The dual's triples as ascending indices, in the order of the dual.
inline std::vector<Triangle> triples_of(const RestrictedPolygons& polygons) {
  std::vector<Triangle> triples = extract_dual(polygons).triangles;
  for (Triangle& t : triples) std::sort(t.begin(), t.end());
  return triples;
}

inline void expect_same_moments(const CellMoments& a, const CellMoments& b) {
  EXPECT_TRUE(same_bits(a.cells, b.cells));
  EXPECT_TRUE(same_bits(a.step_mass, b.step_mass));
  EXPECT_TRUE(same_bits(a.mass, b.mass));
  EXPECT_TRUE(same_bits(a.energy, b.energy));
  EXPECT_EQ(a.triangles.offsets, b.triangles.offsets);
  EXPECT_EQ(a.triangles.values, b.triangles.values);
}

inline void expect_same_diagram(const Diagram& a, const Diagram& b) {
  expect_same_moments(a.moments, b.moments);
  EXPECT_TRUE(pairs_of(a.polygons) == pairs_of(b.polygons));
  EXPECT_TRUE(a.polygons.offsets == b.polygons.offsets);
  EXPECT_TRUE(a.polygons.labels == b.polygons.labels);
  EXPECT_TRUE(same_bits(a.polygons.vertices, b.polygons.vertices));
}

// The checks of every reported diagram, and that its parts fit together.
inline void expect_sound(const Surface& surface, const Diagram& d) {
  EXPECT_EQ(count_untiled(surface, d.polygons), 0u);
  EXPECT_NEAR(d.moments.mass, surface.mass, 1e-12 * surface.mass);
  const auto pairs = pairs_of(d.polygons);
  EXPECT_TRUE(std::is_sorted(pairs.begin(), pairs.end()));
  EXPECT_EQ(std::adjacent_find(pairs.begin(), pairs.end()), pairs.end());
  std::vector<std::array<Index, 2>> transposed;
  for (Index i = 0; i < d.moments.triangles.rows(); ++i) {
    EXPECT_TRUE(std::is_sorted(d.moments.triangles.begin(i), d.moments.triangles.end(i)));
    for (const Index* t = d.moments.triangles.begin(i); t != d.moments.triangles.end(i); ++t)
      transposed.push_back({*t, i});
  }
  std::sort(transposed.begin(), transposed.end());
  EXPECT_TRUE(transposed == pairs);
  double mass = 0;
  for (const Moments& m : d.moments.cells) {
    EXPECT_GE(m.mass, -1e-12 * surface.mass);
    mass += m.mass;
  }
  EXPECT_NEAR(mass, surface.mass, 1e-12 * surface.mass);
  const auto triples = triples_of(d.polygons);
  EXPECT_TRUE(std::is_sorted(triples.begin(), triples.end()));
  EXPECT_EQ(std::adjacent_find(triples.begin(), triples.end()), triples.end());
}

// A case's name as a test name.
inline std::string test_name(std::string name) {
  for (char& c : name)
    if (!((c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9'))) c = '_';
  return name;
}

}  // namespace bisector::test
