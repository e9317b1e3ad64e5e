#include "tree/level_sections.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "tree/shortest_paths.h"

namespace bisector {
namespace {

constexpr std::size_t kLeastPoints = 8;  // of a slice that starts a section of its own
constexpr double kSectionLength = 2;     // in radii: long enough to tell an axis, short enough for a bend

// What hangs together with the lowest points not farther than `width` above them.
std::vector<Index> root_points(const std::vector<Vec3>& points, const Csr<Index>& neighbours,
                               const std::vector<Index>& lowest, double width) {
  std::vector<char> taken(points.size(), 0);
  std::vector<Index> found;
  for (const Index start : lowest) {
    if (taken[start]) continue;
    taken[start] = 1;
    found.push_back(start);
    for (std::size_t at = found.size() - 1; at < found.size(); ++at) {
      const Index i = found[at];
      for (const Index* j = neighbours.begin(i); j != neighbours.end(i); ++j)
        if (!taken[*j] && points[*j].z <= points[start].z + width) {
          taken[*j] = 1;
          found.push_back(*j);
        }
    }
  }
  std::sort(found.begin(), found.end());
  return found;
}

struct Slice {
  Index band = 0;
  std::size_t points = 0;
  Vec3 centre;
  double radius = 0;
  Index parent = kNone;  // slice
};

struct Slices {
  std::vector<Slice> slices;  // parents before children
  std::vector<Index> of_point;
};

Slices cut_slices(const std::vector<Vec3>& points, const Csr<Index>& neighbours, const std::vector<double>& distance,
                  double width) {
  Slices result;
  std::vector<Index> band(points.size(), kNone);
  std::vector<Index> order;
  for (std::size_t i = 0; i < points.size(); ++i)
    if (std::isfinite(distance[i])) {
      band[i] = static_cast<Index>(distance[i] / width);
      order.push_back(static_cast<Index>(i));
    }
  std::sort(order.begin(), order.end(), [&](Index a, Index b) {
    return std::pair{band[a], a} < std::pair{band[b], b};
  });
  result.of_point.assign(points.size(), kNone);
  std::vector<Index> members;
  for (const Index start : order) {
    if (result.of_point[start] != kNone) continue;
    const auto name = static_cast<Index>(result.slices.size());
    members.assign(1, start);
    result.of_point[start] = name;
    for (std::size_t at = 0; at < members.size(); ++at) {
      const Index i = members[at];
      for (const Index* j = neighbours.begin(i); j != neighbours.end(i); ++j)
        if (band[*j] == band[start] && result.of_point[*j] == kNone) {
          result.of_point[*j] = name;
          members.push_back(*j);
        }
    }
    Slice slice{band[start], members.size(), {}, 0, kNone};
    for (const Index i : members) slice.centre += points[i];
    slice.centre *= 1 / static_cast<double>(members.size());
    Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
    for (const Index i : members) {
      const Vec3 d = points[i] - slice.centre;
      const Eigen::Vector3d v(d.x, d.y, d.z);
      spread += v * v.transpose();
    }
    // Of a thin ring two eigenvalues are half the squared radius, of a short piece of a twig the lower two.
    const double middle =
        Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(spread, Eigen::EigenvaluesOnly).eigenvalues()[1];
    slice.radius = std::sqrt(std::max(0.0, 2 * middle / static_cast<double>(members.size())));
    result.slices.push_back(slice);
  }
  return result;
}

// The parent of a slice is the one that most shortest paths come from.
void find_parents(const std::vector<Index>& previous, Slices& slices) {
  std::map<std::pair<Index, Index>, std::size_t> votes;
  for (std::size_t i = 0; i < previous.size(); ++i) {
    const Index child = slices.of_point[i];
    if (child == kNone || previous[i] == i) continue;
    const Index parent = slices.of_point[previous[i]];
    if (parent != child) ++votes[{child, parent}];
  }
  std::vector<std::size_t> most(slices.slices.size(), 0);
  for (const auto& [edge, count] : votes)
    if (count > most[edge.first]) {
      most[edge.first] = count;
      slices.slices[edge.first].parent = edge.second;
    }
}

// Section of each slice.
std::vector<Index> join_slices(const std::vector<Slice>& slices, double width, std::size_t& count) {
  std::vector<std::size_t> children(slices.size(), 0);
  for (const Slice& s : slices)
    if (s.parent != kNone && s.points >= kLeastPoints) ++children[s.parent];
  std::vector<Index> section(slices.size());
  std::vector<Index> first_band;
  std::vector<double> radius;
  count = 0;
  for (std::size_t k = 0; k < slices.size(); ++k) {
    const Slice& s = slices[k];
    const Index up = s.parent == kNone ? kNone : section[s.parent];
    const bool small = s.points < kLeastPoints;
    const bool joins =
        up != kNone && (small || (children[s.parent] == 1 && static_cast<double>(s.band - first_band[up] + 1) * width <=
                                                                 kSectionLength * std::max(radius[up], s.radius)));
    if (joins) {
      section[k] = up;
      if (!small) radius[up] = std::max(radius[up], s.radius);
      continue;
    }
    section[k] = static_cast<Index>(count++);
    first_band.push_back(s.band);
    radius.push_back(s.radius);
  }
  return section;
}

}  // namespace

LevelSections level_sections(const std::vector<Vec3>& points, const Csr<Index>& neighbours,
                             const std::vector<Index>& lowest, double width) {
  LevelSections result;
  std::vector<double> lengths;
  lengths.reserve(neighbours.values.size());
  for (std::size_t i = 0; i < neighbours.rows(); ++i)
    for (const Index* j = neighbours.begin(i); j != neighbours.end(i); ++j)
      lengths.push_back(norm(points[*j] - points[i]));
  ShortestPaths paths = shortest_paths(neighbours, lengths, root_points(points, neighbours, lowest, width));
  result.distance = std::move(paths.distance);
  Slices slices = cut_slices(points, neighbours, result.distance, width);
  find_parents(paths.previous, slices);
  const std::vector<Index> section = join_slices(slices.slices, width, result.count);
  result.section.assign(points.size(), kNone);
  for (std::size_t i = 0; i < points.size(); ++i)
    if (slices.of_point[i] != kNone) result.section[i] = section[slices.of_point[i]];
  return result;
}

}  // namespace bisector
