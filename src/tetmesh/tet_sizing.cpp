#include "tetmesh/tet_sizing.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <queue>
#include <tuple>
#include <unordered_map>
#include <utility>

#include "bisector/error.h"
#include "core/degenerate.h"
#include "core/geometry.h"
#include "core/parallel.h"
#include "features/size_field.h"
#include "mesh/locate.h"
#include "mesh/stars.h"
#include "mesh/used_vertices.h"

namespace bisector {
namespace {

// Vertices of a body-centred cubic lattice per volume, for a mean edge length of 1. A cubic cell of side a has 2
// vertices, with 8 edges of length a sqrt(3) / 2 and 6 of length a at each: 0.9235 a on average.
constexpr double kPerVolume = 2 * 0.9235 * 0.9235 * 0.9235;
// Vertices of an equilateral triangulation per area, 2 / sqrt(3), of which each counts half: the other half of its cell
// is outside.
constexpr double kPerArea = 1 / std::numbers::sqrt3;
constexpr double kMostVertices = 1e8;  // that may be asked for
constexpr double kMostFactor = 2;      // of lengths beside a bound, in lengths without
constexpr double kLongest = 2;         // lengths h at an edge's end, beyond which the edge is bisected
constexpr double kReach = 0.87;        // of a tetrahedron from the middle of its longest edge, by that
// Tetrahedra of a refined solid at most, unless the input has more. Those that carry a field are about as many as will
// be asked for; needles of wild proportions take ever more.
constexpr std::size_t kMostTets = 2'000'000, kMostTetsPerVertex = 100, kFewestTets = 50'000;
constexpr int kRounds = 6;            // of refinement and calibration
constexpr int kTrials = 40;           // factors tried by a calibration
constexpr double kCalibrated = 1e-3;  // relative error of the edge length, at which a calibration ends
constexpr double kNarrowest = 1e-9;   // relative width of the interval of factors, at which it gives up
constexpr double kOutside = -1e-6;  // least barycentric coordinate of a point that counts as within the background mesh
constexpr double kLeastDensity = 1e-100, kMostDensity = 1e100;  // of an attribute

double volume_of(const TetMesh& mesh, const Tetrahedron& t) {
  return std::abs(
             rounded_six_volume(mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]], mesh.vertices[t[3]])) /
         6;
}

// Volumes and areas, over which the number of vertices is an integral.
struct Extent {
  Extent(const TetMesh& mesh, const TriangleMesh& boundary)
      : volumes(mesh.tets.size()), areas(boundary.triangles.size()) {
    parallel_each(volumes.size(), [&](std::size_t t) { volumes[t] = volume_of(mesh, mesh.tets[t]); });
    parallel_each(areas.size(), [&](std::size_t t) {
      const auto [a, b, c] = boundary.triangles[t];
      areas[t] = triangle_area(boundary.vertices[a], boundary.vertices[b], boundary.vertices[c]);
    });
    volume = fixed_sum(volumes.size(), [&](std::size_t t) { return volumes[t]; });
    area = fixed_sum(areas.size(), [&](std::size_t t) { return areas[t]; });
    if (!(volume > 0)) throw Error("sizing: the solid has no volume; check the mesh");
  }

  std::vector<double> volumes, areas;
  double volume = 0, area = 0;
};

struct TetEstimate {
  double vertices = 0, mean_edge = 0;
};

TetEstimate estimate(const Extent& extent, const TetMesh& mesh, const TriangleMesh& boundary,
                     const std::vector<double>& h) {
  const auto over_tets = [&](auto&& f) {
    return fixed_sum(extent.volumes.size(), [&](std::size_t t) {
      double sum = 0;
      for (Index v : mesh.tets[t]) sum += f(h[v]);
      return extent.volumes[t] * sum / 4;
    });
  };
  const double cubes = over_tets([](double x) { return 1 / (x * x * x); });
  const double squares = over_tets([](double x) { return 1 / (x * x); });
  const double surface = fixed_sum(extent.areas.size(), [&](std::size_t t) {
    double sum = 0;
    for (Index v : boundary.triangles[t]) sum += 1 / (h[v] * h[v]);
    return extent.areas[t] * sum / 3;
  });
  return {kPerVolume * cubes + kPerArea * surface, squares / cubes};
}

double uniform_edge(const Extent& extent, double vertices) {
  double low = 0,
         high = std::cbrt(kPerVolume * extent.volume / vertices) + std::sqrt(kPerArea * extent.area / vertices);
  while (estimate_tet_vertices(extent.volume, extent.area, high) > vertices) high *= 2;
  for (int k = 0; k < 200 && high - low > 1e-12 * high; ++k) {
    const double h = 0.5 * (low + high);
    (estimate_tet_vertices(extent.volume, extent.area, h) > vertices ? low : high) = h;
  }
  return high;
}

bool positive(double x) { return x > 0 && std::isfinite(x); }

void check_bounds(const SizingOptions& field, const SizingTarget& target) {
  if ((target.vertices > 0) == (target.edge_length != 0) || (target.vertices == 0 && !positive(target.edge_length)))
    throw Error("sizing: give either a number of vertices or a positive edge length");
  if (!positive(field.gradation)) throw Error("sizing: the gradation inside a solid must be positive; correct it");
  for (const double bound : {field.min_edge, field.max_edge})
    if (bound != 0 && !positive(bound))
      throw Error("sizing: the least and largest edge length must be positive; correct them");
  if (field.max_edge > 0 && field.min_edge > field.max_edge)
    throw Error(fmt::format("sizing: the least edge length {:g} is larger than the largest {:g}; correct them",
                            field.min_edge, field.max_edge));
}

void check_samples(const SizeSamples& sizes) {
  const std::size_t points = sizes.points.size();
  if (points != sizes.lengths.size())
    throw Error(fmt::format("sizing: {} lengths for {} points; give one per point", sizes.lengths.size(), points));
  for (const Tetrahedron& tet : sizes.tets)
    for (Index v : tet)
      if (v >= points) throw Error(fmt::format("sizing: the background mesh has no vertex {}; correct it", v));
  for (std::size_t k = 0; k < points; ++k)
    if (!positive(sizes.lengths[k]))
      throw Error(
          fmt::format("sizing: the edge length {:g} of point {} is not positive; correct it", sizes.lengths[k], k));
}

void check_attribute(const std::vector<double>& attribute, std::size_t vertices) {
  if (attribute.empty() || attribute.size() > vertices)
    throw Error(fmt::format("sizing: {} densities for {} vertices; give one per vertex", attribute.size(), vertices));
  for (std::size_t v = 0; v < attribute.size(); ++v)
    if (!(attribute[v] >= kLeastDensity && attribute[v] <= kMostDensity))
      throw Error(fmt::format("sizing: the density {:g} of vertex {} is not within 1e-100 and 1e100; correct it",
                              attribute[v], v));
}

void check(const TetMesh& mesh, const TetSizingOptions& options, const SizingTarget& target) {
  check_bounds(options.field, target);
  check_samples(options.sizes);
  if (options.field.kind == DensityKind::attribute && options.sizes.points.empty())
    check_attribute(options.field.attribute, mesh.vertices.size());
}

// The samples from which the field of lengths grows, up to a factor.
SizeSamples samples_of(const TetMesh& mesh, const TriangleMesh& boundary, const TetSizingOptions& options,
                       double uniform) {
  if (!options.sizes.points.empty()) return options.sizes;
  SizeSamples samples;
  if (options.field.kind == DensityKind::attribute) {
    samples.points.assign(mesh.vertices.begin(),
                          mesh.vertices.begin() + static_cast<std::ptrdiff_t>(options.field.attribute.size()));
    for (double rho : options.field.attribute) samples.lengths.push_back(std::pow(rho, -0.2));
    if (samples.points.size() == mesh.vertices.size()) samples.tets = mesh.tets;
    return samples;
  }
  // The surface's own sizing, for edges as long as the solid's will be, on a surface refined until it can carry the
  // field.
  SizingTarget target;
  target.edge_length = uniform;
  SizingOptions field = options.field;
  field.min_edge = field.max_edge = 0;
  const SizedMesh sized = refine_for_density(boundary, field, target);
  for (const Index v : used_vertices(sized.mesh.triangles, sized.mesh.vertices.size())) {
    samples.points.push_back(sized.mesh.vertices[v]);
    samples.lengths.push_back(target_edge_length(sized.sizing, v));
  }
  return samples;
}

// The field of edge lengths that grows from the samples, their lengths multiplied by a factor and kept within bounds.
// If there are no samples it is `uniform` times the factor everywhere.
class ScaledField {
 public:
  ScaledField(const SizeSamples& samples, const SizingOptions& bounds, double uniform, const SizeField* bound)
      : samples_(samples), bounds_(bounds), uniform_(uniform), bound_(bound) {
    if (samples.tets.empty()) return;
    background_.vertices = samples.points;
    background_.tets = samples.tets;
    locator_.emplace(background_);
  }
  ScaledField(const ScaledField&) = delete;

  void scale(double factor) {
    lengths_ = samples_.lengths;
    for (double& h : lengths_) h = bounded(h * factor);
    plain_ = uniform_ * factor;
    if (!lengths_.empty()) field_.emplace(samples_.points, lengths_, bounds_.gradation);
  }
  // Whether the length is known to be the same everywhere in a ball.
  bool is_constant(const Vec3& centre, double radius) const {
    return !field_ && bound_ && (*bound_)(centre)-bound_->gradation() * radius >= plain_;
  }
  double at(const Vec3& x) const {
    const double grown = field_ ? (*field_)(x) : plain_, bound = bound_ ? (*bound_)(x) : grown;
    return bounded(std::min({grown, bound, linear(x, locate(x))}));
  }
  std::vector<double> at(const std::vector<Vec3>& points) {
    std::vector<double> h = field_ ? field_->at(points, near_) : std::vector<double>(points.size(), plain_);
    const std::vector<double> bounds = bound_ ? bound_->at(points, near_bound_) : h;
    const std::size_t known = tet_of_.size();
    tet_of_.resize(points.size(), kNone);
    parallel_each(points.size(), [&](std::size_t k) {
      if (k >= known) tet_of_[k] = locate(points[k]);
      h[k] = bounded(std::min({h[k], bounds[k], linear(points[k], tet_of_[k])}));
    });
    return h;
  }

 private:
  double bounded(double h) const {
    h = std::max(h, bounds_.min_edge);
    return bounds_.max_edge > 0 ? std::min(h, bounds_.max_edge) : h;
  }

  Index locate(const Vec3& x) const { return locator_ ? locator_->nearest(x) : kNone; }
  // The length that is linear on the background mesh; infinite outside it.
  double linear(const Vec3& x, Index tet) const {
    const double infinite = std::numeric_limits<double>::infinity();
    if (tet == kNone) return infinite;
    const std::array<double, 4> w = locator_->weights(tet, x);
    if (!(*std::min_element(w.begin(), w.end()) > kOutside)) return infinite;
    double h = 0;
    for (std::size_t k = 0; k < 4; ++k) h += w[k] * lengths_[background_.tets[tet][k]];
    return h;
  }

  const SizeSamples& samples_;
  const SizingOptions& bounds_;
  double uniform_, plain_ = 0;
  const SizeField* bound_;
  std::optional<SizeField> field_;
  std::vector<double> lengths_;
  TetMesh background_;
  std::optional<TetLocator> locator_;
  // Of the points that at() was given last: the sample found near each and its tetrahedron of the background mesh. The
  // next call's points begin with the same ones.
  std::vector<Index> near_, near_bound_, tet_of_;
};

// Finds the factor with which the estimate meets the target, beginning with the one given and up to `most`. Returns h
// at the vertices.
std::vector<double> calibrate(const Extent& extent, const TetMesh& mesh, const TriangleMesh& boundary,
                              const SizingTarget& target, ScaledField& field, double most, double& factor) {
  double low = 0, high = 0;
  std::vector<double> h;
  for (int k = 0; k < kTrials; ++k) {
    field.scale(factor);
    h = field.at(mesh.vertices);
    const TetEstimate e = estimate(extent, mesh, boundary, h);
    const double off = target.vertices ? std::log(static_cast<double>(target.vertices) / e.vertices) / 3
                                       : std::log(e.mean_edge / target.edge_length);
    if (std::abs(off) < kCalibrated || (low > 0 && high > 0 && std::log(high / low) < kNarrowest)) break;
    if (off < 0 && factor >= most) break;
    (off < 0 ? low : high) = factor;
    const double next = std::min(factor * std::exp(-off), most);
    factor = low > 0 && high > 0 && !(next > low && next < high) ? std::sqrt(low * high) : next;
  }
  return h;
}

// Bisection of edges with all their tetrahedra and marked triangles.
class Refiner {
 public:
  Refiner(SizedSolid& sized, TriangleMesh& boundary, const ScaledField& field, std::vector<double>& lengths)
      : mesh_(sized.mesh), boundary_(boundary), splits_(sized.splits), field_(field), lengths_(lengths) {
    for (Index t = 0; t < mesh_.tets.size(); ++t) index_tet(t);
    for (Index t = 0; t < mesh_.boundary.size(); ++t) index_triangle(mesh_.boundary[t], t, marked_);
    for (Index t = 0; t < boundary_.triangles.size(); ++t) index_triangle(boundary_.triangles[t], t, outer_);
    for (const auto& [a, b] : mesh_.feature_edges) features_.insert({edge_key(a, b), 1});
  }

  // False if nothing had to be bisected.
  bool run(std::size_t limit) {
    for (const Tetrahedron& t : mesh_.tets)
      for (int i = 0; i < 4; ++i)
        for (int j = i + 1; j < 4; ++j) push(t[i], t[j]);
    if (queue_.empty()) return false;
    bool any = false;
    while (!queue_.empty() && mesh_.tets.size() < limit) {
      const Edge edge = queue_.top();
      queue_.pop();
      const Edge longest = longest_beyond(edge);
      if (!bisect(std::get<1>(longest), std::get<2>(longest))) continue;
      any = true;
      if (longest != edge) queue_.push(edge);
    }
    collect_features();
    return any;
  }

 private:
  using Edge = std::tuple<double, Index, Index>;  // squared length, lower and upper end
  using Around = std::unordered_map<std::uint64_t, std::vector<Index>>;
  // Of equally long edges the one with lower ends comes first.
  struct Shorter {
    bool operator()(const Edge& e, const Edge& f) const {
      if (std::get<0>(e) != std::get<0>(f)) return std::get<0>(e) < std::get<0>(f);
      return std::tie(std::get<1>(e), std::get<2>(e)) > std::tie(std::get<1>(f), std::get<2>(f));
    }
  };

  Edge edge(Index a, Index b) const {
    return {norm2(mesh_.vertices[b] - mesh_.vertices[a]), std::min(a, b), std::max(a, b)};
  }

  void index_tet(Index t) {
    const Tetrahedron& v = mesh_.tets[t];
    for (int i = 0; i < 4; ++i)
      for (int j = i + 1; j < 4; ++j) tets_[edge_key(v[i], v[j])].push_back(t);
  }
  static void index_triangle(const Triangle& v, Index t, Around& around) {
    for (int k = 0; k < 3; ++k) around[edge_key(v[k], v[(k + 1) % 3])].push_back(t);
  }

  // From edge to longer edge of the same tetrahedron, up to one that is the longest of all its tetrahedra (Rivara
  // 1984).
  Edge longest_beyond(Edge longest) const {
    for (bool moved = true; moved;) {
      moved = false;
      const auto found = tets_.find(edge_key(std::get<1>(longest), std::get<2>(longest)));
      if (found == tets_.end()) break;
      for (const Index t : found->second)
        for (int i = 0; i < 4; ++i)
          for (int j = i + 1; j < 4; ++j) {
            const Edge other = edge(mesh_.tets[t][i], mesh_.tets[t][j]);
            if (!Shorter()(longest, other)) continue;
            longest = other;
            moved = true;
          }
    }
    return longest;
  }

  void push(Index a, Index b) {
    const Edge e = edge(a, b);
    const double most = kLongest * std::min(lengths_[a], lengths_[b]);
    if (!(std::get<0>(e) > most * most)) return;
    // A tetrahedron with this edge as its longest lies within the ball.
    const Vec3 middle = 0.5 * mesh_.vertices[a] + 0.5 * mesh_.vertices[b];
    if (!field_.is_constant(middle, kReach * std::sqrt(std::get<0>(e)))) queue_.push(e);
  }

  // False if the edge is not there any more, or too short for a vertex between its ends.
  bool bisect(Index a, Index b) {
    const Vec3 middle = 0.5 * mesh_.vertices[a] + 0.5 * mesh_.vertices[b];
    if (middle == mesh_.vertices[a] || middle == mesh_.vertices[b]) return false;
    const auto found = tets_.find(edge_key(a, b));
    if (found == tets_.end()) return false;  // queued by several tetrahedra and bisected already
    const std::vector<Index> around = std::move(found->second);
    tets_.erase(found);
    const auto m = static_cast<Index>(mesh_.vertices.size());
    mesh_.vertices.push_back(middle);
    lengths_.push_back(field_.at(middle));
    splits_.push_back({std::min(a, b), std::max(a, b), m});
    for (const Index t : around) split_tet(a, b, m, t);
    split_triangles(a, b, m, mesh_.boundary, mesh_.boundary_labels, marked_);
    split_triangles(a, b, m, boundary_.triangles, boundary_.labels, outer_);
    if (features_.erase(edge_key(a, b))) {
      features_.insert({edge_key(a, m), 1});
      features_.insert({edge_key(m, b), 1});
    }
    push(a, m);
    push(m, b);
    return true;
  }

  // Divides tetrahedron t, which keeps corner a, at the middle m of its edge from a to b.
  void split_tet(Index a, Index b, Index m, Index t) {
    const auto added = static_cast<Index>(mesh_.tets.size());
    Tetrahedron &first = mesh_.tets[t], second = first;
    std::replace(first.begin(), first.end(), b, m);
    std::replace(second.begin(), second.end(), a, m);
    std::vector<Index> others;
    for (Index v : first)
      if (v != a && v != m) others.push_back(v);
    mesh_.tets.push_back(second);
    if (!mesh_.regions.empty()) mesh_.regions.push_back(mesh_.regions[t]);
    tets_[edge_key(a, m)].push_back(t);
    tets_[edge_key(m, b)].push_back(added);
    tets_[edge_key(others[0], others[1])].push_back(added);
    for (Index c : others) {
      std::vector<Index>& beyond = tets_[edge_key(b, c)];
      std::replace(beyond.begin(), beyond.end(), t, added);
      std::vector<Index>& between = tets_[edge_key(m, c)];
      const bool fresh = between.empty();
      between.insert(between.end(), {t, added});
      if (fresh) push(m, c);
    }
  }

  static void split_triangles(Index a, Index b, Index m, std::vector<Triangle>& triangles,
                              std::vector<std::int32_t>& labels, Around& at) {
    const auto found = at.find(edge_key(a, b));
    if (found == at.end()) return;
    const std::vector<Index> around = std::move(found->second);
    at.erase(found);
    for (const Index t : around) {
      const auto added = static_cast<Index>(triangles.size());
      Triangle &first = triangles[t], second = first;
      const Index c = *std::find_if(first.begin(), first.end(), [&](Index v) { return v != a && v != b; });
      std::replace(first.begin(), first.end(), b, m);
      std::replace(second.begin(), second.end(), a, m);
      triangles.push_back(second);
      if (!labels.empty()) labels.push_back(labels[t]);
      at[edge_key(a, m)].push_back(t);
      at[edge_key(m, b)].push_back(added);
      std::vector<Index>& beyond = at[edge_key(b, c)];
      std::replace(beyond.begin(), beyond.end(), t, added);
      std::vector<Index>& between = at[edge_key(m, c)];
      between.insert(between.end(), {t, added});
    }
  }

  void collect_features() {
    mesh_.feature_edges.clear();
    for (const auto& [k, one] : features_)
      mesh_.feature_edges.push_back({static_cast<Index>(k >> 32), static_cast<Index>(k & 0xffffffffu)});
    std::sort(mesh_.feature_edges.begin(), mesh_.feature_edges.end());
  }

  TetMesh& mesh_;
  TriangleMesh& boundary_;
  EdgeSplits& splits_;
  const ScaledField& field_;
  std::vector<double>& lengths_;
  Around tets_, marked_, outer_;  // at each edge
  std::unordered_map<std::uint64_t, char> features_;
  std::priority_queue<Edge, std::vector<Edge>, Shorter> queue_;
};

std::vector<double> powers(const std::vector<double>& lengths, double unit, int exponent) {
  std::vector<double> rho(lengths.size());
  for (std::size_t v = 0; v < rho.size(); ++v) {
    const double r = unit / lengths[v];
    rho[v] = exponent == 4 ? r * r * r * r : r * r * r * r * r;
  }
  return rho;
}

}  // namespace

std::vector<double> SizedSolid::volume_density() const { return powers(lengths, edge_length, 5); }
std::vector<double> SizedSolid::surface_density() const { return powers(lengths, edge_length, 4); }

double estimate_tet_vertices(double volume, double area, double h) {
  return kPerVolume * volume / (h * h * h) + kPerArea * area / (h * h);
}

UniformSize uniform_size(const TetMesh& mesh, const TriangleMesh& boundary, const SizingTarget& target) {
  const Extent extent(mesh, boundary);
  const auto count = static_cast<double>(target.vertices);
  const double edge = target.vertices ? uniform_edge(extent, count) : target.edge_length;
  const double wanted = target.vertices ? count : estimate_tet_vertices(extent.volume, extent.area, edge);
  if (wanted > kMostVertices)
    throw Error(
        fmt::format("sizing: edges of {:g} make more than {:.0f} vertices; ask for longer ones", edge, kMostVertices));
  return {edge, static_cast<std::size_t>(std::llround(wanted))};
}

double estimate_cells(const SizedSolid& sized) {
  return kPerVolume * fixed_sum(sized.mesh.tets.size(), [&](std::size_t t) {
           double sum = 0;
           for (const Index v : sized.mesh.tets[t]) {
             const double h = sized.lengths.empty() ? sized.edge_length : sized.lengths[v];
             sum += 1 / (h * h * h);
           }
           return volume_of(sized.mesh, sized.mesh.tets[t]) * sum / 4;
         });
}

SizedSolid refine_for_sizes(const TetMesh& mesh, const TriangleMesh& boundary, const TetSizingOptions& options,
                            const SizingTarget& target, const SizeField* bound, bool more_vertices) {
  check(mesh, options, target);
  SizedSolid sized;
  sized.mesh = mesh;
  const UniformSize size = uniform_size(mesh, boundary, target);
  sized.edge_length = size.edge_length;
  sized.vertices = size.vertices;
  const bool uniform = options.field.kind == DensityKind::uniform && options.sizes.points.empty();
  if (uniform && !bound) return sized;

  const SizeSamples samples = uniform ? SizeSamples{} : samples_of(mesh, boundary, options, sized.edge_length);
  double factor = 1, most = std::numeric_limits<double>::infinity();
  TriangleMesh surface = boundary;
  if (bound && !uniform) {
    // The factor that would do without the bound.
    ScaledField unbounded(samples, options.field, sized.edge_length, nullptr);
    calibrate(Extent(mesh, boundary), mesh, boundary, target, unbounded, most, factor);
  }
  if (bound) most = more_vertices ? factor : kMostFactor * factor;
  ScaledField field(samples, options.field, sized.edge_length, bound);
  const std::size_t limit =
      std::max(mesh.tets.size(), std::clamp(kMostTetsPerVertex * sized.vertices, kFewestTets, kMostTets));
  for (int round = 0;; ++round) {
    surface.vertices = sized.mesh.vertices;
    const Extent extent(sized.mesh, surface);
    sized.lengths = calibrate(extent, sized.mesh, surface, target, field, most, factor);
    const TetEstimate e = estimate(extent, sized.mesh, surface, sized.lengths);
    sized.edge_length = e.mean_edge;
    if (target.vertices == 0 || more_vertices)
      sized.vertices = std::max(target.vertices, static_cast<std::size_t>(std::llround(e.vertices)));
    if (round == kRounds || !Refiner(sized, surface, field, sized.lengths).run(limit)) break;
  }
  if (static_cast<double>(sized.vertices) > kMostVertices)
    throw Error(fmt::format("sizing: such edges make more than {:.0f} vertices; ask for longer ones", kMostVertices));
  std::sort(sized.splits.begin(), sized.splits.end());
  return sized;
}

}  // namespace bisector
