#include "remesh/set_apart.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "mesh/topology.h"

namespace bisector {
namespace {

// Vertices that each component should have, on average.
constexpr std::size_t kVerticesEach = 8;

// A component: the box of its vertices, and the length of its longest edges.
struct Extent {
  Box box;
  double edge = 0;
  bool empty = true;

  void add(const Vec3& p, double length) {
    if (empty) box = {p, p};
    empty = false;
    edge = std::max(edge, length);
    for (int k = 0; k < 3; ++k) {
      box.lo[k] = std::min(box.lo[k], p[k]);
      box.hi[k] = std::max(box.hi[k], p[k]);
    }
  }
};

bool are_near(const Extent& a, const Extent& b) {
  const double gap = std::max(a.edge, b.edge);
  for (int k = 0; k < 3; ++k)
    if (a.box.lo[k] - b.box.hi[k] > gap || b.box.lo[k] - a.box.hi[k] > gap) return false;
  return true;
}

std::vector<Extent> extents_of(const TriangleMesh& mesh, const std::vector<double>& edge_length) {
  const std::vector<Index> component = label_components(mesh.triangles, mesh.vertices.size());
  std::vector<Extent> extents;
  for (Index v = 0; v < component.size(); ++v) {
    if (component[v] == kNone) continue;
    if (component[v] >= extents.size()) extents.resize(component[v] + std::size_t{1});
    extents[component[v]].add(mesh.vertices[v], edge_length[v]);
  }
  return extents;
}

// Of each, the first place where none is that is near, in the order in which they begin along an axis.
std::vector<std::size_t> places_of(const std::vector<Extent>& extents, double longest_edge) {
  std::vector<std::size_t> order(extents.size()), near, place(extents.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return extents[a].box.lo.x < extents[b].box.lo.x; });
  std::vector<char> taken;
  for (const std::size_t i : order) {
    std::erase_if(near, [&](std::size_t j) { return extents[i].box.lo.x - extents[j].box.hi.x > longest_edge; });
    std::fill(taken.begin(), taken.end(), char{0});
    for (const std::size_t j : near)
      if (are_near(extents[i], extents[j])) taken[place[j]] = 1;
    place[i] = static_cast<std::size_t>(std::find(taken.begin(), taken.end(), 0) - taken.begin());
    if (place[i] == taken.size()) taken.push_back(1);
    near.push_back(i);
  }
  return place;
}

// Of all components, each with an offset.
Box box_of(const std::vector<Extent>& extents, const std::vector<Vec3>& offset) {
  std::vector<Vec3> corners;
  for (std::size_t c = 0; c < extents.size(); ++c)
    for (const Vec3& corner : {extents[c].box.lo, extents[c].box.hi}) corners.push_back(corner + offset[c]);
  return bounding_box(corners);
}

// So that sums with coordinates of single precision are exact.
double power_of_two_from(double length) { return std::exp2(std::ceil(std::log2(length))); }

}  // namespace

SetApart::SetApart(const TriangleMesh& mesh, const std::vector<double>& edge_length, std::size_t vertices) {
  const std::vector<Extent> extents = extents_of(mesh, edge_length);
  if (extents.size() < 2 || kVerticesEach * extents.size() > vertices) return;
  double edge = 0;
  for (const Extent& e : extents) edge = std::max(edge, e.edge);
  const std::vector<std::size_t> place = places_of(extents, edge);
  const std::size_t count = *std::max_element(place.begin(), place.end()) + 1;
  if (count < 2) return;
  const Box all = box_of(extents, std::vector<Vec3>(extents.size()));
  for (int k = 0; k < 3; ++k) {
    lo_[k] = all.lo[k] - edge;
    step_[k] = power_of_two_from(all.hi[k] - all.lo[k] + 2 * edge);
  }
  // Places are in a cube of boxes, which keeps coordinates small.
  const auto side = static_cast<std::size_t>(std::ceil(std::cbrt(static_cast<double>(count))));
  for (const std::size_t p : place) {
    const std::array<std::size_t, 3> at{p % side, p / side % side, p / side / side};
    Vec3& offset = offset_.emplace_back();
    for (int k = 0; k < 3; ++k) offset[k] = static_cast<double>(at[static_cast<std::size_t>(k)]) * step_[k];
  }
  longer_ = box_of(extents, offset_).diagonal() / all.diagonal();
}

void SetApart::move(TriangleMesh& mesh) const {
  if (empty()) return;
  const std::vector<Index> component = label_components(mesh.triangles, mesh.vertices.size());
  for (Index v = 0; v < component.size(); ++v)
    if (component[v] != kNone) mesh.vertices[v] += offset_[component[v]];
}

Vec3 SetApart::back(const Vec3& p) const {
  if (empty()) return p;
  Vec3 there = p;
  for (int k = 0; k < 3; ++k) there[k] -= std::floor((p[k] - lo_[k]) / step_[k]) * step_[k];
  return there;
}

void SetApart::move_back(const std::vector<Vec3>& corners, RemeshResult& result) const {
  if (empty()) return;
  for (std::size_t v = 0; v < result.mesh.vertices.size(); ++v) {
    const Index corner = result.places[v].corner;
    Vec3& p = result.mesh.vertices[v];
    p = corner == kNone ? back(p) : corners[corner];
  }
  report_back(result);
}

void SetApart::report_back(RemeshResult& result) const {
  for (TopologyFault& fault : result.faults) fault.position = back(fault.position);
  // What is in percent of the diagonal.
  FeatureDistance& off = result.features.distance;
  FitReport& fit = result.fitted;
  for (double* d : {&off.vertices, &off.to_reference, &off.from_reference, &fit.before.to_reference,
                    &fit.before.from_reference, &fit.after.to_reference, &fit.after.from_reference})
    *d *= longer_;
}

}  // namespace bisector
