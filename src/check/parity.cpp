#include "check/parity.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <type_traits>

#include "voronoi/dual.h"

namespace bisector {
namespace {

// Of the mean mass of a cell; less is what rounding makes of 0.
constexpr double kLeastShare = 1e-12;

template <class T>
bool same_bits(const std::vector<T>& a, const std::vector<T>& b) {
  static_assert(std::is_trivially_copyable_v<T>);
  return a.size() == b.size() && (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0);
}

bool same_bits(double a, double b) { return std::memcmp(&a, &b, sizeof a) == 0; }

bool same_dual(const RestrictedPolygons& a, const RestrictedPolygons& b) {
  const auto unoriented = [](const RestrictedPolygons& polygons) {
    Dual dual = extract_dual(polygons);
    for (Triangle& t : dual.triangles) std::sort(t.begin(), t.end());
    return dual;
  };
  const Dual first = unoriented(a), second = unoriented(b);
  return first.triangles == second.triangles && first.multiplicity == second.multiplicity;
}

void worsen(double& worst, double error, double scale) {
  const double relative = error == 0 ? 0 : error / scale;
  worst = std::isnan(relative) ? std::numeric_limits<double>::infinity() : std::max(worst, relative);
}

// `square_of` gives the squared length that goes with a mass.
template <class Square>
void measure_errors(const CellMoments& a, const CellMoments& b, double whole, const Square& square_of, Parity& parity) {
  worsen(parity.sum_error, std::abs(b.mass - whole), whole);
  if (a.cells.size() != b.cells.size()) {
    parity.mass_error = parity.centroid_error = parity.energy_error = std::numeric_limits<double>::infinity();
    return;
  }
  const double least_mass = kLeastShare * whole / static_cast<double>(std::max<std::size_t>(1, a.cells.size()));
  for (std::size_t i = 0; i < a.cells.size(); ++i) {
    const Moments &expected = a.cells[i], &found = b.cells[i];
    const double mass = std::max(a.step_mass[i], least_mass);
    const double length2 = std::max(square_of(mass), expected.second / mass);
    worsen(parity.mass_error, std::abs(found.mass - expected.mass), mass);
    worsen(parity.centroid_error, norm(found.first - expected.first), mass * std::sqrt(length2));
    worsen(parity.energy_error, std::abs(found.second - expected.second), mass * length2);
  }
}

}  // namespace

bool same_bits(const CellMoments& a, const CellMoments& b) {
  return same_bits(a.cells, b.cells) && same_bits(a.step_mass, b.step_mass) && same_bits(a.mass, b.mass) &&
         same_bits(a.energy, b.energy) && a.triangles.offsets == b.triangles.offsets &&
         a.triangles.values == b.triangles.values;
}

Parity compare(const CellMoments& a, const RestrictedPolygons& polygons_a, const CellMoments& b,
               const RestrictedPolygons& polygons_b, const Surface& surface) {
  Parity parity;
  parity.same_pairs = same_bits(polygons_a.pairs, polygons_b.pairs);
  parity.same_labels =
      parity.same_pairs && polygons_a.offsets == polygons_b.offsets && polygons_a.labels == polygons_b.labels;
  parity.same_dual = same_dual(polygons_a, polygons_b);
  parity.bitwise = parity.same_labels && same_bits(a, b) && same_bits(polygons_a.vertices, polygons_b.vertices);
  const double area_per_mass = surface.area / surface.mass;
  measure_errors(
      a, b, surface.mass, [&](double mass) { return mass * area_per_mass; }, parity);
  return parity;
}

Parity compare(const CellMoments& a, const ClippedPolyhedra& polyhedra_a, const CellMoments& b,
               const ClippedPolyhedra& polyhedra_b, const Solid& solid) {
  Parity parity;
  parity.same_pairs = same_bits(polyhedra_a.pairs, polyhedra_b.pairs);
  parity.same_labels = parity.same_pairs && polyhedra_a.label_offsets == polyhedra_b.label_offsets &&
                       polyhedra_a.labels == polyhedra_b.labels &&
                       polyhedra_a.vertex_offsets == polyhedra_b.vertex_offsets &&
                       polyhedra_a.triples == polyhedra_b.triples;
  parity.same_dual = dual_tets(polyhedra_a) == dual_tets(polyhedra_b);
  parity.bitwise = parity.same_labels && same_bits(a, b) && same_bits(polyhedra_a.vertices, polyhedra_b.vertices);
  const double volume_per_mass = solid.volume / solid.mass;
  measure_errors(
      a, b, solid.mass, [&](double mass) { return std::pow(mass * volume_per_mass, 2.0 / 3); }, parity);
  return parity;
}

}  // namespace bisector
