#include "segment/coarsen.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <tuple>

#include "core/grouping.h"
#include "core/parallel.h"
#include "segment/plane_moments.h"

namespace bisector {
namespace {

// Of the growth of the mean square distance to the centroid, what that to the best plane may grow by where two clusters
// are joined: across a crease of 45 degrees it grows by as much.
constexpr double kFlat = 0.03;
constexpr double kLeastJoined = 0.1;  // of the clusters that a round must save to be worth one more

struct Join {
  double cost;
  Index a, b;
};

// Pairs of clusters to be joined, each in one pair at most: the cheapest first.
std::vector<Join> pairs_to_join(const Csr<Index>& neighbours, const std::vector<PlaneMoments>& moments,
                                const std::vector<double>& distance) {
  std::vector<Join> joins;
  for (Index a = 0; a < neighbours.rows(); ++a)
    for (const Index* b = neighbours.begin(a); b != neighbours.end(a); ++b)
      if (a < *b) joins.push_back({0, a, *b});
  parallel_each(joins.size(), [&](std::size_t k) {
    Join& join = joins[k];
    const PlaneMoments &a = moments[join.a], &b = moments[join.b];
    if (!(a.area > 0 && b.area > 0)) return;
    PlaneMoments both = a;
    both.add(b);
    const double bent = both.squared_distance() - distance[join.a] - distance[join.b];
    const double spread = a.area * b.area / both.area * norm2((1 / a.area) * a.first - (1 / b.area) * b.first);
    join.cost = bent <= kFlat * spread ? bent / kFlat + spread : std::numeric_limits<double>::infinity();
  });
  std::erase_if(joins, [](const Join& join) { return !std::isfinite(join.cost); });
  sort_in_parallel(
      joins, [](const Join& x, const Join& y) { return std::tuple(x.cost, x.a, x.b) < std::tuple(y.cost, y.a, y.b); });
  std::vector<char> taken(neighbours.rows(), 0);
  std::erase_if(joins, [&](const Join& join) {
    if (taken[join.a] || taken[join.b]) return true;
    taken[join.a] = taken[join.b] = 1;
    return false;
  });
  return joins;
}

// The graph of clusters, lengths of common borders added up.
DualGraph contracted(const DualGraph& graph, const std::vector<Index>& cluster_of, std::size_t count) {
  struct Border {
    Index cluster;
    double length;
  };
  const Csr<Border> borders = group_into_rows<Border>(count, [&](const auto& put) {
    for (Index t = 0; t < cluster_of.size(); ++t)
      for (std::size_t k = graph.neighbours.offsets[t]; k < graph.neighbours.offsets[t + 1]; ++k) {
        const Index other = cluster_of[graph.neighbours.values[k]];
        if (other != cluster_of[t]) put(cluster_of[t], Border{other, graph.edge_length[k]});
      }
  });
  DualGraph result;
  result.mean_edge_length = graph.mean_edge_length;
  std::vector<Border> row;
  for (std::size_t c = 0; c < count; ++c) {
    row.assign(borders.begin(c), borders.end(c));
    std::stable_sort(row.begin(), row.end(), [](const Border& a, const Border& b) { return a.cluster < b.cluster; });
    for (const Border& border : row) {
      if (result.neighbours.values.size() > result.neighbours.offsets.back() &&
          result.neighbours.values.back() == border.cluster) {
        result.edge_length.back() += border.length;
      } else {
        result.neighbours.values.push_back(border.cluster);
        result.edge_length.push_back(border.length);
      }
    }
    result.neighbours.offsets.push_back(result.neighbours.values.size());
  }
  return result;
}

// Corners of a regular tetrahedron, whose mean is 0 and whose second moments are 1, pushed to a centroid and a
// covariance.
TriangleSamples samples_of(const SurfaceMoments& moments) {
  const SurfaceMoments centred = moved(moments, moments.centroid());
  const double area = centred.area();
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  if (area > 0) {
    covariance << centred.m[4], centred.m[5], centred.m[6], centred.m[5], centred.m[7], centred.m[8], centred.m[6],
        centred.m[8], centred.m[9];
    covariance /= area;
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(covariance);
  const Eigen::Matrix3d root = solver.eigenvectors() * solver.eigenvalues().cwiseMax(0.0).cwiseSqrt().asDiagonal();
  constexpr double kCorners[4][3] = {{1, 1, 1}, {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1}};
  TriangleSamples samples;
  samples.area = area;
  for (std::size_t k = 0; k < 4; ++k) {
    const Eigen::Vector3d offset = root * Eigen::Vector3d(kCorners[k][0], kCorners[k][1], kCorners[k][2]);
    samples.x[k] = centred.origin.x + offset(0);
    samples.y[k] = centred.origin.y + offset(1);
    samples.z[k] = centred.origin.z + offset(2);
  }
  return samples;
}

// Fills in what follows from the graph and the triangles of the clusters.
void measure(const SegmentDomain& fine, const Csr<Index>& rows, SegmentDomain& coarse) {
  const std::size_t count = rows.rows();
  coarse.triangles.resize(count);
  coarse.normals.resize(count);
  coarse.barycentres.resize(count);
  coarse.areas.resize(count);
  coarse.samples.resize(count);
  coarse.clusters.resize(count);
  coarse.components.resize(count);
  parallel_each(count, [&](std::size_t c) {
    const Index *begin = rows.begin(c), *end = rows.end(c);
    Vec3 first, normal, sum;
    double area = 0;
    for (const Index* t = begin; t != end; ++t) {
      area += fine.areas[*t];
      first += fine.areas[*t] * fine.barycentres[*t];
      normal += fine.areas[*t] * fine.normals[*t];
      sum += fine.barycentres[*t];
    }
    const Vec3 centre = area > 0 ? (1 / area) * first : (1 / static_cast<double>(end - begin)) * sum;
    const double length = norm(normal);
    SurfaceMoments& moments = coarse.clusters[c];
    moments.origin = centre;
    Index middle = *begin;
    for (const Index* t = begin; t != end; ++t) {
      const SurfaceMoments one = fine.moments(*t, centre);
      for (std::size_t k = 0; k < moments.m.size(); ++k) moments.m[k] += one.m[k];
      for (std::size_t k = 0; k < moments.flux.size(); ++k) moments.flux[k] += one.flux[k];
      if (norm2(fine.barycentres[*t] - centre) < norm2(fine.barycentres[middle] - centre)) middle = *t;
    }
    coarse.triangles[c] = fine.triangles[middle];
    coarse.normals[c] = length > 0 ? (1 / length) * normal : Vec3{};
    coarse.barycentres[c] = centre;
    coarse.areas[c] = area;
    coarse.samples[c] = samples_of(moments);
    coarse.components[c] = fine.components[*begin];
  });
}

}  // namespace

CoarseDomain coarsened(const SegmentDomain& domain, std::size_t most) {
  const std::size_t n = domain.triangles.size();
  CoarseDomain result;
  std::vector<Index>& cluster_of = result.cluster_of;
  cluster_of.resize(n);
  std::iota(cluster_of.begin(), cluster_of.end(), 0u);
  std::vector<PlaneMoments> moments(n);
  std::vector<double> distance(n);
  parallel_each(n, [&](std::size_t t) {
    moments[t] = plane_moments(domain, static_cast<Index>(t));
    distance[t] = moments[t].squared_distance();
  });
  DualGraph graph = domain.graph;
  while (graph.neighbours.rows() > most) {
    const std::size_t count = graph.neighbours.rows();
    const std::vector<Join> joins = pairs_to_join(graph.neighbours, moments, distance);
    if (static_cast<double>(joins.size()) < kLeastJoined * static_cast<double>(count)) break;
    std::vector<Index> first(count), number(count);
    std::iota(first.begin(), first.end(), 0u);
    for (const Join& join : joins) first[join.b] = join.a;
    Index left = 0;
    for (Index c = 0; c < count; ++c) {
      if (first[c] == c) {
        moments[left] = moments[c];
        number[c] = left++;
      } else {
        moments[number[first[c]]].add(moments[c]);
        number[c] = number[first[c]];
      }
    }
    moments.resize(left);
    distance.resize(left);
    parallel_each(left, [&](std::size_t c) { distance[c] = moments[c].squared_distance(); });
    for (Index& c : cluster_of) c = number[c];
    graph = contracted(graph, number, left);
  }
  const std::size_t count = graph.neighbours.rows();
  SegmentDomain& coarse = result.domain;
  coarse.vertices = domain.vertices;
  coarse.area = domain.area;
  coarse.component_count = domain.component_count;
  coarse.origin = domain.origin;
  coarse.scale = domain.scale;
  measure(domain, items_of_labels<Index>(cluster_of, count), coarse);
  coarse.graph = std::move(graph);
  return result;
}

}  // namespace bisector
