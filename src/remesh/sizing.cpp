#include "remesh/sizing.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <queue>
#include <tuple>
#include <unordered_map>

#include "bisector/error.h"
#include "core/degenerate.h"
#include "core/geometry.h"
#include "core/parallel.h"
#include "features/curvature.h"
#include "features/local_feature_size.h"
#include "features/size_field.h"
#include "mesh/stars.h"
#include "mesh/topology.h"

namespace bisector {
namespace {

constexpr double kSmallestFeature = 0.25;  // of the uniform edge length: smaller ones do not show in the result
constexpr double kSamplesPerVertex = 32;   // of the surface for lfs: their spacing is then that smallest feature
constexpr double kMostSamples = 300'000;
constexpr double kSteepest = 10;             // ratio of densities above which an edge is bisected
constexpr double kSteepestUnknown = 6;       // the same where what they are between its ends is not known
constexpr double kShortest = 0.7;            // edge length by h below which it is not for the sake of that ratio
constexpr double kLong = 2;                  // edge length by h above which h is looked at between the ends
constexpr double kLongest = 32;              // edge length by h above which an edge is bisected whatever h is there
constexpr double kFarthest = 2.5;            // ratio of the density to the linear one above which an edge is bisected
constexpr std::size_t kTriangles = 400'000;  // refinement stops there
constexpr double kMostVertices = 1e8;        // that an edge length may ask for
constexpr int kRounds = 8;                   // of refinement and calibration
constexpr double kMostFactor = 2;            // of lengths beside bounds, in lengths without
constexpr double kSettled = 1e-3;            // relative error of the calibration

double fourth_root(double x) { return std::sqrt(std::sqrt(x)); }
double fourth_power(double x) { return x * x * x * x; }

struct Border {
  Index a, b;
  double length;
};

// What the estimate integrates over.
struct Domain {
  explicit Domain(const TriangleMesh& mesh) : triangles(mesh.triangles) {
    areas.resize(triangles.size());
    parallel_each(areas.size(), [&](std::size_t t) {
      const Triangle& v = triangles[t];
      areas[t] = triangle_area(mesh.vertices[v[0]], mesh.vertices[v[1]], mesh.vertices[v[2]]);
    });
    area = fixed_sum(areas.size(), [&](std::size_t t) { return areas[t]; });
    if (!(area > 0)) throw Error("sizing: the surface has no area; check the mesh");
    const EdgeTable table = edge_table(triangles, mesh.vertices.size());
    for (std::size_t e = 0; e < table.edges.size(); ++e) {
      const auto [a, b] = table.edges[e];
      if (table.half_edges.size(e) == 1) borders.push_back({a, b, norm(mesh.vertices[b] - mesh.vertices[a])});
    }
    border = fixed_sum(borders.size(), [&](std::size_t e) { return borders[e].length; });
  }

  const std::vector<Triangle>& triangles;
  std::vector<double> areas;
  std::vector<Border> borders;
  double area = 0, border = 0;
};

// The estimate for densities (unit / h)^4 given by h at the vertices.
MeshEstimate estimate(const Domain& domain, const std::vector<double>& h) {
  const double unit = *std::max_element(h.begin(), h.end());
  const auto density = [&](Index v) { return fourth_power(unit / h[v]); };
  // Over triangles by the rule that is exact for quadratics, over borders by Simpson's.
  const double inverse_square = fixed_sum(domain.areas.size(), [&](std::size_t t) {
    const Triangle& v = domain.triangles[t];
    const double d[3] = {density(v[0]), density(v[1]), density(v[2])};
    return domain.areas[t] / 3 *
           (std::sqrt(0.5 * (d[0] + d[1])) + std::sqrt(0.5 * (d[1] + d[2])) + std::sqrt(0.5 * (d[2] + d[0])));
  });
  const double inverse = fixed_sum(domain.areas.size(), [&](std::size_t t) {
    const Triangle& v = domain.triangles[t];
    const double d[3] = {density(v[0]), density(v[1]), density(v[2])};
    return domain.areas[t] / 3 *
           (fourth_root(0.5 * (d[0] + d[1])) + fourth_root(0.5 * (d[1] + d[2])) + fourth_root(0.5 * (d[2] + d[0])));
  });
  const double border = fixed_sum(domain.borders.size(), [&](std::size_t e) {
    const Border& b = domain.borders[e];
    const double da = density(b.a), db = density(b.b);
    return b.length / 6 * (fourth_root(da) + 4 * fourth_root(0.5 * (da + db)) + fourth_root(db));
  });
  return {2 / std::sqrt(3.0) * inverse_square / (unit * unit) + 0.5 * border / unit, unit * inverse / inverse_square};
}

// The edge length at which equilateral triangles have so many vertices.
double uniform_edge(const Domain& domain, double vertices) {
  const double a = 2 / std::sqrt(3.0) * domain.area, b = 0.5 * domain.border;
  return (b + std::sqrt(b * b + 4 * a * vertices)) / (2 * vertices);
}

double uniform_count(const Domain& domain, double h) {
  return 2 / std::sqrt(3.0) * domain.area / (h * h) + 0.5 * domain.border / h;
}

void check(const TriangleMesh& mesh, const SizingOptions& options, const SizingTarget& target) {
  const auto positive = [](double x) { return x > 0 && std::isfinite(x); };
  if ((target.vertices > 0) == (target.edge_length != 0) || (target.vertices == 0 && !positive(target.edge_length)))
    throw Error("sizing: give either a number of vertices or a positive edge length");
  if (!(options.exponent >= 0 && options.exponent <= 8))
    throw Error("sizing: the density's exponent must be between 0 and 8; correct it");
  if (!(options.gradation >= 0 && std::isfinite(options.gradation)))
    throw Error("sizing: gradation must be 0 (no bound) or positive; correct it");
  for (const double bound : {options.min_edge, options.max_edge})
    if (bound != 0 && !positive(bound))
      throw Error("sizing: the least and largest edge length must be positive; correct them");
  if (options.max_edge > 0 && options.min_edge > options.max_edge)
    throw Error(fmt::format("sizing: the least edge length {:g} is larger than the largest {:g}; correct them",
                            options.min_edge, options.max_edge));
  if (options.kind != DensityKind::attribute) return;
  if (options.attribute.size() != mesh.vertices.size())
    throw Error(fmt::format("sizing: {} densities for {} vertices; give one per vertex", options.attribute.size(),
                            mesh.vertices.size()));
  for (std::size_t v = 0; v < options.attribute.size(); ++v)
    if (!(options.attribute[v] >= 1e-100 && options.attribute[v] <= 1e100))
      throw Error(fmt::format("sizing: the density {:g} of vertex {} is not within 1e-100 and 1e100; correct it",
                              options.attribute[v], v));
}

void check_bounds(const Domain& domain, const SizingOptions& options, const SizingTarget& target) {
  const double least = options.min_edge, largest = options.max_edge;
  if (target.vertices == 0) {
    if (uniform_count(domain, target.edge_length) > kMostVertices)
      throw Error(fmt::format("sizing: edges of {:g} make more than {:.0f} vertices; ask for longer ones",
                              target.edge_length, kMostVertices));
    if (target.edge_length < least || (largest > 0 && target.edge_length > largest))
      throw Error(
          fmt::format("sizing: the edge length {:g} is not within the bounds asked for; change it or "
                      "the least or largest edge length",
                      target.edge_length));
    return;
  }
  const auto count = static_cast<double>(target.vertices);
  if (least > 0 && uniform_count(domain, least) < count)
    throw Error(
        fmt::format("sizing: {} vertices do not fit with edges of {:g} and more; ask for at most {:.0f}, or "
                    "for shorter edges",
                    target.vertices, least, uniform_count(domain, least)));
  if (largest > 0 && uniform_count(domain, largest) > count)
    throw Error(
        fmt::format("sizing: {} vertices are too few for edges of at most {:g}; ask for at least {:.0f}, or "
                    "for longer edges",
                    target.vertices, largest, uniform_count(domain, largest)));
}

// The mean of each vertex's logarithm and that of its neighbours.
void smooth_logarithms(const TriangleMesh& mesh, std::vector<double>& values) {
  std::vector<double> sum(values.size(), 0);
  std::vector<std::size_t> count(values.size(), 0);
  for (const auto& [a, b] : edge_table(mesh.triangles, mesh.vertices.size()).edges) {
    sum[a] += std::log(values[b]);
    sum[b] += std::log(values[a]);
    ++count[a];
    ++count[b];
  }
  for (std::size_t v = 0; v < values.size(); ++v)
    if (count[v]) values[v] = std::exp(0.5 * std::log(values[v]) + 0.5 * sum[v] / static_cast<double>(count[v]));
}

// The limits of h at a point.
struct Range {
  double least = 0, most = std::numeric_limits<double>::infinity();

  double clamp(double h) const { return std::min(std::max(h, least), most); }
};

Range range_at(const SizeLimits& limits, const Vec3& p) {
  Range range;
  if (limits.least) range.least = (*limits.least)(p);
  if (limits.most) range.most = (*limits.most)(p);
  return range;
}

// rho at the vertices, before it is scaled and bounded, and at vertices that are added.
class Field {
 public:
  // For a result that would have so many vertices and edges of that length if it were uniform.
  Field(const TriangleMesh& mesh, const SizingOptions& options, double vertices, double uniform,
        const SizeLimits& limits = {})
      : kind_(options.kind), limits_(limits) {
    if (limits.any()) ranges_.resize(mesh.vertices.size());
    std::vector<Index> nearest;
    const std::vector<double> most = limits.most ? limits.most->at(mesh.vertices, nearest) : std::vector<double>{};
    parallel_each(ranges_.size(), [&](std::size_t v) {
      if (limits.least) ranges_[v].least = (*limits.least)(mesh.vertices[v]);
      if (limits.most) ranges_[v].most = most[v];
    });
    const double diagonal = bounding_box(mesh).diagonal();
    unit_ = diagonal;
    least_ = std::min(kSmallestFeature * uniform / diagonal, 1.0);
    exponent_ = options.exponent > 0 ? options.exponent : kind_ == DensityKind::lfs ? 2 : 1;
    if (kind_ == DensityKind::lfs) {
      const double wanted = kSamplesPerVertex * vertices;
      size_ = std::make_unique<LocalFeatureSize>(
          mesh, static_cast<std::size_t>(std::clamp(wanted, double{LocalFeatureSize::kSamples}, kMostSamples)));
      least_ = std::clamp(size_->spacing() / diagonal, least_, 1.0);
      values_.resize(mesh.vertices.size());
      parallel_each(values_.size(), [&](std::size_t v) { values_[v] = from_size(mesh.vertices[v]); });
    } else if (kind_ == DensityKind::curvature) {
      const PrincipalCurvatures curvatures = principal_curvatures(mesh, options.sharp, 3, uniform);
      values_.resize(mesh.vertices.size());
      for (std::size_t v = 0; v < values_.size(); ++v)
        values_[v] = std::clamp(curvatures.magnitude(v) * diagonal, 1.0, 1 / least_);
      smooth_logarithms(mesh, values_);
      for (double& x : values_) x = std::pow(x, exponent_);
    } else if (kind_ == DensityKind::attribute) {
      values_ = options.attribute;
    } else {
      values_.assign(mesh.vertices.size(), 1.0);
    }
  }

  const std::vector<double>& values() const { return values_; }
  // Of the edge length; empty if there are none.
  const std::vector<Range>& ranges() const { return ranges_; }

  // A vertex in the middle of two.
  void add(const Vec3& p, Index a, Index b) {
    values_.push_back(kind_ == DensityKind::lfs ? from_size(p) : 0.5 * (values_[a] + values_[b]));
    if (limits_.any()) ranges_.push_back(range_at(limits_, p));
  }

  // Whether the field between vertices is not known before there is one. Other fields are linear.
  bool measured() const { return kind_ == DensityKind::lfs; }
  const SizeLimits& limits() const { return limits_; }

 private:
  double from_size(const Vec3& p) const { return std::pow(std::clamp((*size_)(p) / unit_, least_, 1.0), -exponent_); }

  DensityKind kind_;
  double unit_ = 1, least_ = 0, exponent_ = 1;
  std::unique_ptr<LocalFeatureSize> size_;
  std::vector<double> values_;
  SizeLimits limits_;
  std::vector<Range> ranges_;
};

// The lengths of a calibrated field, and the factor that led to them.
struct Calibration {
  std::vector<double> lengths;
  double factor = 0;
};

// 0: no bound. A bound of lengths has its own.
double gradation_of_field(const SizingOptions& options) {
  return options.kind == DensityKind::uniform ? 0 : options.gradation;
}

class Calibrator {
 public:
  Calibrator(const SizingOptions& options, const SizingTarget& target) : options_(options), target_(target) {}

  // `guess`: a factor to start from, or 0.
  Calibration run(const Domain& domain, const std::vector<Vec3>& points, const Field& field, double guess) const {
    const std::vector<double>& rho = field.values();
    std::vector<double> raw(rho.size());
    parallel_each(raw.size(), [&](std::size_t v) { raw[v] = 1 / fourth_root(rho[v]); });
    const auto excess = [&](Calibration& c) {
      c.lengths = lengths(points, raw, field.ranges(), c.factor);
      const MeshEstimate e = estimate(domain, c.lengths);
      return target_.vertices ? 0.5 * std::log(static_cast<double>(target_.vertices) / e.vertices)
                              : std::log(e.mean_edge / target_.edge_length);
    };
    // Without gradation and bounds, the excess is what the factor's logarithm is off by.
    Calibration c;
    const MeshEstimate e = estimate(domain, raw);
    const double unbounded = target_.vertices ? std::sqrt(e.vertices / static_cast<double>(target_.vertices))
                                              : target_.edge_length / e.mean_edge;
    c.factor = guess > 0 ? guess : unbounded;
    // Where bounds ask for more vertices than are wanted, whatever the factor, it stays below the one without bounds by
    // this much.
    const double most = field.ranges().empty() ? std::numeric_limits<double>::infinity() : kMostFactor * unbounded;
    double low = 0, high = 0, low_excess = 0, high_excess = 0;  // factors on either side
    double last = c.factor, last_off = 0;
    for (int i = 0; i < 60; ++i) {
      const double off = excess(c);
      if (std::abs(off) < kSettled || (off < 0 && c.factor == most)) break;
      (off < 0 ? low : high) = c.factor;
      (off < 0 ? low_excess : high_excess) = off;
      if (low > 0 && high > 0) {
        const double width = std::log(high / low);
        if (width < 1e-9) break;
        const double share = std::clamp(-low_excess / (high_excess - low_excess), 0.05, 0.95);
        c.factor = low * std::exp(share * width);
      } else {
        // Outwards along the secant, with a stride that grows in the end, until the target lies between.
        const double way = std::log(c.factor / last);
        const double slope = i > 0 && way != 0 ? std::clamp((off - last_off) / way, 0.1, 1.0) : 1;
        last = c.factor;
        last_off = off;
        c.factor *= std::exp(-off / slope * std::max(1, i - 4));
      }
      c.factor = std::min(c.factor, most);
    }
    return c;
  }

 private:
  std::vector<double> lengths(const std::vector<Vec3>& points, const std::vector<double>& raw,
                              const std::vector<Range>& ranges, double factor) const {
    std::vector<double> h(raw.size());
    for (std::size_t v = 0; v < h.size(); ++v) h[v] = factor * raw[v];
    if (const double gradation = gradation_of_field(options_); gradation > 0) h = limit_gradation(points, h, gradation);
    for (std::size_t v = 0; v < ranges.size(); ++v) h[v] = ranges[v].clamp(h[v]);
    for (double& x : h) {
      x = std::max(x, options_.min_edge);
      if (options_.max_edge > 0) x = std::min(x, options_.max_edge);
    }
    return h;
  }

  const SizingOptions& options_;
  const SizingTarget& target_;
};

double uniform_length(const Domain& domain, const SizingTarget& target) {
  return target.vertices ? uniform_edge(domain, static_cast<double>(target.vertices)) : target.edge_length;
}

Sizing uniform_sizing(const Domain& domain, const SizingTarget& target) {
  const double h = uniform_length(domain, target);
  return {{}, h, target.vertices ? target.vertices : static_cast<std::size_t>(std::llround(uniform_count(domain, h)))};
}

Sizing to_sizing(const Domain& domain, const std::vector<double>& lengths, const SizingTarget& target) {
  const MeshEstimate e = estimate(domain, lengths);
  Sizing sizing;
  sizing.unit_edge = e.mean_edge;
  sizing.density.resize(lengths.size());
  for (std::size_t v = 0; v < lengths.size(); ++v) sizing.density[v] = fourth_power(e.mean_edge / lengths[v]);
  sizing.vertices = target.vertices ? target.vertices : static_cast<std::size_t>(std::llround(e.vertices));
  return sizing;
}

// Bisection of edges with all their triangles.
class Refiner {
 public:
  // `lengths`: h at the vertices; `factor`: h where the field is 1.
  Refiner(SizedMesh& sized, Field& field, std::vector<double> lengths, double factor, const SizingOptions& options)
      : mesh_(sized.mesh), sized_(sized), field_(field), lengths_(std::move(lengths)), factor_(factor),
        options_(options), gradation_(gradation_of_field(options)) {}

  // False if nothing had to be bisected.
  bool run() {
    const EdgeTable table = edge_table(mesh_.triangles, mesh_.vertices.size());
    for (const auto& [a, b] : table.edges) push(a, b);
    for (const Triangle& triangle : mesh_.triangles) push_longest(triangle);
    if (queue_.empty()) return false;
    triangles_at_.reserve(2 * table.edges.size());
    for (std::size_t e = 0; e < table.edges.size(); ++e) {
      std::vector<Index>& list = triangles_at_[edge_key(table.edges[e][0], table.edges[e][1])];
      for (const std::size_t* h = table.half_edges.begin(e); h != table.half_edges.end(e); ++h)
        if (list.empty() || list.back() != *h / 3) list.push_back(static_cast<Index>(*h / 3));
    }
    const std::size_t limit = std::max(kTriangles, sized_.parent.size());
    bool any = false;
    while (!queue_.empty() && mesh_.triangles.size() < limit) {
      const Edge edge = queue_.top();
      queue_.pop();
      const Edge longest = longest_beyond(edge);
      if (!bisect(std::get<1>(longest), std::get<2>(longest))) continue;
      any = true;
      if (longest != edge) queue_.push(edge);
    }
    return any;
  }

 private:
  using Edge = std::tuple<double, Index, Index>;  // squared length, lower and upper end
  struct Later {
    bool operator()(const Edge& e, const Edge& f) const {
      if (std::get<0>(e) != std::get<0>(f)) return std::get<0>(e) < std::get<0>(f);
      return std::tie(std::get<1>(e), std::get<2>(e)) > std::tie(std::get<1>(f), std::get<2>(f));
    }
  };

  Edge edge(Index a, Index b) const {
    return {norm2(mesh_.vertices[b] - mesh_.vertices[a]), std::min(a, b), std::max(a, b)};
  }

  // From an edge to the longest of a triangle at it, and so on, until there is none longer. Triangles whose longest
  // edge alone is bisected never get ever thinner (Rivara 1984).
  Edge longest_beyond(Edge longest) const {
    for (bool moved = true; moved;) {
      moved = false;
      const auto found = triangles_at_.find(edge_key(std::get<1>(longest), std::get<2>(longest)));
      if (found == triangles_at_.end()) break;
      for (const Index t : found->second)
        for (int k = 0; k < 3; ++k) {
          const Edge other = edge(mesh_.triangles[t][k], mesh_.triangles[t][(k + 1) % 3]);
          if (!Later()(longest, other)) continue;
          longest = other;
          moved = true;
        }
    }
    return longest;
  }

  void push(Index a, Index b) {
    if (a == b) return;
    const Edge e = edge(a, b);
    const double length = std::sqrt(std::get<0>(e));
    const auto [least, largest] = std::minmax(lengths_[a], lengths_[b]);
    const double steepest = field_.measured() ? kSteepestUnknown : kSteepest;
    const bool steep = fourth_power(largest / least) > steepest && length > kShortest * least;
    if (steep || length > kLongest * least || (length > kLong * least && differs_along(a, b, length / least)))
      queue_.push(e);
  }

  // The longest edge of a triangle inside which h differs.
  void push_longest(const Triangle& v) {
    if (field_.measured() || !field_.limits().any()) return;
    const Edge longest = std::max({edge(v[0], v[1]), edge(v[1], v[2]), edge(v[2], v[0])}, Later());
    const double length = std::sqrt(std::get<0>(longest));
    const double least = std::min({lengths_[v[0]], lengths_[v[1]], lengths_[v[2]]});
    const double area = triangle_area(mesh_.vertices[v[0]], mesh_.vertices[v[1]], mesh_.vertices[v[2]]);
    // Where all of a triangle is near its edges, they tell enough. Longer ones are bisected anyway.
    if (!(length > kLong * least) || length > kLongest * least || 2 * area < least * length) return;
    const int n = static_cast<int>(std::ceil(length / least));
    for (int i = 1; i + 1 < n; ++i)
      for (int j = 1; i + j < n; ++j)
        if (differs(v, {static_cast<double>(i) / n, static_cast<double>(j) / n, static_cast<double>(n - i - j) / n})) {
          queue_.push(longest);
          return;
        }
  }

  // Looks at points about as far from each other as h, which changes little from one to the next.
  bool differs_along(Index a, Index b, double length) const {
    if (field_.measured()) return true;
    if (!field_.limits().any()) return false;
    const int n = static_cast<int>(std::ceil(length));
    for (int i = 1; i < n; ++i) {
      const double w = static_cast<double>(i) / n;
      if (differs({a, b, b}, {1 - w, w, 0})) return true;
    }
    return false;
  }

  // Whether h at a point of a triangle is far from what the density gives that is linear between its corners.
  bool differs(const Triangle& v, const std::array<double, 3>& weights) const {
    Vec3 p{};
    double linear = 0, density = 0;
    for (int k = 0; k < 3; ++k) {
      p += weights[k] * mesh_.vertices[v[k]];
      linear += weights[k] * field_.values()[v[k]];
      density += weights[k] / fourth_power(lengths_[v[k]]);
    }
    double h = bounded(factor_ / fourth_root(linear), range_at(field_.limits(), p));
    if (gradation_ > 0)
      for (const Index k : v) h = std::min(h, lengths_[k] + gradation_ * norm(p - mesh_.vertices[k]));
    const double ratio = density * fourth_power(h);
    return ratio > kFarthest || ratio * kFarthest < 1;
  }

  double bounded(double h, const Range& range) const {
    h = std::max(range.clamp(h), options_.min_edge);
    return options_.max_edge > 0 ? std::min(h, options_.max_edge) : h;
  }

  double raw_length(Index v) const {
    return bounded(factor_ / fourth_root(field_.values()[v]), field_.ranges().empty() ? Range{} : field_.ranges()[v]);
  }

  // Lets two vertices limit each other. The next calibration does so for all; until then this keeps a finer place that
  // was found from being taken for a steep one.
  void relax(Index a, Index b) {
    if (!(gradation_ > 0)) return;
    const double step = gradation_ * norm(mesh_.vertices[b] - mesh_.vertices[a]);
    lengths_[a] = std::min(lengths_[a], lengths_[b] + step);
    lengths_[b] = std::min(lengths_[b], lengths_[a] + step);
  }

  bool bisect(Index a, Index b) {
    const Vec3 middle = 0.5 * mesh_.vertices[a] + 0.5 * mesh_.vertices[b];
    if (middle == mesh_.vertices[a] || middle == mesh_.vertices[b]) return false;
    const auto found = triangles_at_.find(edge_key(a, b));
    if (found == triangles_at_.end()) return false;  // triangles on each other queue their edges more than once
    const std::vector<Index> around = std::move(found->second);
    triangles_at_.erase(found);
    const auto m = static_cast<Index>(mesh_.vertices.size());
    mesh_.vertices.push_back(middle);
    field_.add(middle, a, b);
    lengths_.push_back(raw_length(m));
    relax(m, a);
    relax(m, b);
    sized_.splits.push_back({a, b, m});
    for (const Index t : around) {
      const auto added = static_cast<Index>(mesh_.triangles.size());
      Triangle &first = mesh_.triangles[t], second = first;
      const auto apex = std::find_if(first.begin(), first.end(), [&](Index v) { return v != a && v != b; });
      const Index c = apex == first.end() ? kNone : *apex;  // none in a triangle with a corner twice
      std::replace(first.begin(), first.end(), b, m);
      std::replace(second.begin(), second.end(), a, m);
      mesh_.triangles.push_back(second);
      sized_.parent.push_back(sized_.parent[t]);
      triangles_at_[edge_key(a, m)].push_back(t);
      triangles_at_[edge_key(m, b)].push_back(added);
      if (c == kNone) continue;
      relax(m, c);
      std::vector<Index>& beyond = triangles_at_[edge_key(b, c)];
      std::replace(beyond.begin(), beyond.end(), t, added);
      std::vector<Index>& between = triangles_at_[edge_key(m, c)];
      between.insert(between.end(), {t, added});
      push(m, c);
      push_longest(mesh_.triangles[t]);
      push_longest(mesh_.triangles[added]);
    }
    push(a, m);
    push(m, b);
    return true;
  }

  TriangleMesh& mesh_;
  SizedMesh& sized_;
  Field& field_;
  std::vector<double> lengths_;
  double factor_;
  const SizingOptions& options_;
  double gradation_;
  std::priority_queue<Edge, std::vector<Edge>, Later> queue_;
  std::unordered_map<std::uint64_t, std::vector<Index>> triangles_at_;
};

}  // namespace

MeshEstimate estimate_mesh(const TriangleMesh& mesh, const Sizing& sizing) {
  std::vector<double> h(mesh.vertices.size(), sizing.unit_edge);
  for (std::size_t v = 0; v < sizing.density.size(); ++v) h[v] /= fourth_root(sizing.density[v]);
  return estimate(Domain(mesh), h);
}

Sizing compute_sizing(const TriangleMesh& mesh, const SizingOptions& options, const SizingTarget& target) {
  check(mesh, options, target);
  const Domain domain(mesh);
  check_bounds(domain, options, target);
  if (options.kind == DensityKind::uniform) return uniform_sizing(domain, target);
  const double uniform = uniform_length(domain, target);
  const Field field(mesh, options, uniform_count(domain, uniform), uniform);
  const Calibration calibration = Calibrator(options, target).run(domain, mesh.vertices, field, 0);
  return to_sizing(domain, calibration.lengths, target);
}

double target_edge_length(const Sizing& sizing, Index vertex) {
  return sizing.density.empty() ? sizing.unit_edge : sizing.unit_edge / fourth_root(sizing.density[vertex]);
}

double target_edge_length(const Sizing& sizing, const TriangleMesh& mesh, Index triangle,
                          const std::array<double, 3>& weights) {
  if (sizing.density.empty()) return sizing.unit_edge;
  double density = 0;
  for (int k = 0; k < 3; ++k) density += weights[k] * sizing.density[mesh.triangles[triangle][k]];
  return sizing.unit_edge / fourth_root(density);
}

SizedMesh refine_for_density(const TriangleMesh& mesh, const SizingOptions& options, const SizingTarget& target,
                             const SizeLimits& limits) {
  check(mesh, options, target);
  SizedMesh sized;
  sized.mesh = mesh;
  sized.parent.resize(mesh.triangles.size());
  for (Index t = 0; t < sized.parent.size(); ++t) sized.parent[t] = t;
  auto domain = std::make_unique<Domain>(sized.mesh);
  check_bounds(*domain, options, target);
  if (options.kind == DensityKind::uniform && !limits.any()) {
    sized.sizing = uniform_sizing(*domain, target);
    return sized;
  }
  const double uniform = uniform_length(*domain, target);
  Field field(mesh, options, uniform_count(*domain, uniform), uniform, limits);
  const Calibrator calibrator(options, target);
  Calibration calibration;
  for (int round = 0;; ++round) {
    calibration = calibrator.run(*domain, sized.mesh.vertices, field, calibration.factor);
    if (round == kRounds || !Refiner(sized, field, calibration.lengths, calibration.factor, options).run()) break;
    domain = std::make_unique<Domain>(sized.mesh);
  }
  sized.sizing = to_sizing(*domain, calibration.lengths, target);
  std::sort(sized.splits.begin(), sized.splits.end());
  if (sized.parent.size() > mesh.triangles.size()) {
    sized.mesh.face_of_triangle = sized.parent;
    if (!mesh.face_of_triangle.empty())
      for (Index& face : sized.mesh.face_of_triangle) face = mesh.face_of_triangle[face];
  }
  return sized;
}

}  // namespace bisector
