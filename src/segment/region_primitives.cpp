#include "segment/region_primitives.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>
#include <optional>
#include <utility>

#include "core/grouping.h"
#include "core/parallel.h"
#include "segment/flood.h"
#include "segment/primitive_fit.h"
#include "segment/quadric_fit.h"

namespace bisector {
namespace {

// Which vertices tell a region's surface: those deep inside, since near borders that no crease marks some belong to
// others.
constexpr std::uint8_t kDeep = 4;           // edges away from borders, at most
constexpr std::size_t kEnoughInside = 24;   // vertices that are left one edge inside; twice as many deeper inside
constexpr std::size_t kTrialSamples = 400;  // vertices that types are tried on

// When one surface is as good as another. Lengths are in the unit-sized model, energies those of Eq. 2.3.
constexpr double kExact = 2e-6;     // distances that do not tell types apart
constexpr double kMuchWorse = 1.5;  // ratio of energies, or of tilts, from which on the larger one is out of question
constexpr double kHardlyWorse = 1.07;  // ratio of energies up to which the larger one is accepted for a simpler type
constexpr double kOneSided = 0.98;     // least Candidate::side: less means two sheets with the data between

// From the simplest to the most general.
constexpr std::array kSpecialTypes{SurfaceType::plane, SurfaceType::sphere, SurfaceType::cylinder, SurfaceType::cone,
                                   SurfaceType::torus};
constexpr double kInfinity = std::numeric_limits<double>::infinity();

// From the vertices of some triangles that are on borders, at depth 0, to the others, at kDeep.
void spread_depths(const SegmentDomain& domain, const std::vector<Index>& triangles, std::vector<std::uint8_t>& depth) {
  for (std::uint8_t level = 0; level + 1 < kDeep; ++level)
    for (const Index t : triangles) {
      const Triangle& corners = domain.triangles[t];
      if (std::none_of(corners.begin(), corners.end(), [&](Index v) { return depth[v] == level; })) continue;
      for (const Index v : corners) depth[v] = std::min<std::uint8_t>(depth[v], static_cast<std::uint8_t>(level + 1));
    }
}

// How many edges each vertex is away from the borders between regions: 0 on them, at most kDeep.
std::vector<std::uint8_t> vertex_depths(const SegmentDomain& domain, const std::vector<Index>& labels) {
  std::vector<Index> region(domain.vertices.size(), kNone);
  std::vector<std::uint8_t> depth(domain.vertices.size(), kDeep);
  for (std::size_t t = 0; t < labels.size(); ++t)
    for (const Index v : domain.triangles[t]) {
      if (region[v] != kNone && region[v] != labels[t]) depth[v] = 0;
      region[v] = labels[t];
    }
  std::vector<Index> all(domain.triangles.size());
  std::iota(all.begin(), all.end(), 0u);
  spread_depths(domain, all, depth);
  return depth;
}

struct VertexSum {
  Index vertex;
  double weight;
  Vec3 normal;
};

struct VertexSamples {
  SurfaceSamples samples;
  std::size_t corners = 0;  // vertices of the region, whatever their depth
};

// The vertices that are deepest inside, where those are enough to tell the surface: near borders that no crease marks,
// and on borders, are vertices of other surfaces.
VertexSamples vertex_samples(const SegmentDomain& domain, const Index* begin, const Index* end,
                             const std::vector<std::uint8_t>& depths) {
  std::vector<VertexSum> sums;
  sums.reserve(3 * static_cast<std::size_t>(end - begin));
  for (const Index* t = begin; t != end; ++t)
    for (const Index v : domain.triangles[*t])
      sums.push_back({v, domain.areas[*t] / 3, domain.areas[*t] * domain.normals[*t]});
  std::stable_sort(sums.begin(), sums.end(),
                   [](const VertexSum& a, const VertexSum& b) { return a.vertex < b.vertex; });
  std::size_t n = 0;
  for (std::size_t k = 0; k < sums.size(); ++k) {
    if (n > 0 && sums[n - 1].vertex == sums[k].vertex) {
      sums[n - 1].weight += sums[k].weight;
      sums[n - 1].normal += sums[k].normal;
    } else {
      sums[n++] = sums[k];
    }
  }
  sums.resize(n);
  VertexSamples result;
  result.corners = n;
  int least = 0;
  for (int depth = kDeep; depth > 0 && least == 0; --depth) {
    const auto inside = [&](const VertexSum& s) { return depths[s.vertex] >= depth; };
    const auto count = static_cast<std::size_t>(std::count_if(sums.begin(), sums.end(), inside));
    if (count >= (depth == 1 ? kEnoughInside : std::max(2 * kEnoughInside, 2 * n / 5))) least = depth;
  }
  for (const VertexSum& s : sums) {
    const double length = norm(s.normal);
    if (!(length > 0) || depths[s.vertex] < least) continue;
    result.samples.points.push_back(domain.vertices[s.vertex]);
    result.samples.normals.push_back((1 / length) * s.normal);
    result.samples.weights.push_back(s.weight);
  }
  return result;
}

struct Candidate {
  Primitive primitive;
  double energy = 0;    // Eq. 2.3
  double vertices = 0;  // weighted squared exact distances of some of the vertices
  double tilt = 0;      // squared sines between its normals and the triangles', times the areas
  double side = 1;      // mean cosine between them over the mean absolute cosine: 1 if all are on one side
};

SurfaceSamples thinned(const SurfaceSamples& samples, std::size_t limit) {
  const std::size_t n = samples.points.size();
  if (n <= limit) return samples;
  SurfaceSamples few;
  for (std::size_t k = 0; k < limit; ++k) {
    const std::size_t i = k * n / limit;
    few.points.push_back(samples.points[i]);
    few.normals.push_back(samples.normals[i]);
    few.weights.push_back(samples.weights[i]);
  }
  return few;
}

constexpr int kQuadricParameters = 9;

int free_parameters(SurfaceType type) {
  switch (type) {
    case SurfaceType::plane: return 3;
    case SurfaceType::sphere: return 4;
    case SurfaceType::cylinder: return 5;
    case SurfaceType::cone: return 6;
    case SurfaceType::torus: return 7;
    default: return kQuadricParameters;
  }
}

int free_parameters(const Primitive& primitive) { return free_parameters(type_of(primitive)); }

// What the sum of squared distances of n points may be larger by, as a factor, for so many parameters fewer: the
// Bayesian information criterion (Schwarz 1978) with twice its penalty, since each type is the best of several fits.
double simplicity_allowance(std::size_t n, int fewer) {
  const double points = std::max<double>(10, static_cast<double>(n));
  return std::exp(2 * fewer * std::log(points) / points);
}

class RegionSurface {
 public:
  RegionSurface(const SegmentDomain& domain, const Index* begin, const Index* end,
                const std::vector<std::uint8_t>& depths)
      : domain_(domain), begin_(begin), end_(end) {
    VertexSamples inside = vertex_samples(domain, begin, end, depths);
    corners_ = inside.corners;
    vertices_ = std::move(inside.samples);
    all_ = vertices_;
    for (const Index* t = begin; t != end; ++t) {
      if (!(domain.areas[*t] > 0)) continue;
      area_ += domain.areas[*t];
      all_.points.push_back(domain.barycentres[*t]);
      all_.normals.push_back(domain.normals[*t]);
      all_.weights.push_back(domain.areas[*t]);
    }
    few_vertices_ = thinned(vertices_, kTrialSamples);
    few_ = thinned(all_, 2 * kTrialSamples);
  }

  std::size_t vertices() const { return vertices_.points.size(); }  // those that tell the surface
  // Whether they can speak against a surface: there is one through as many points as it has parameters.
  bool can_tell(int parameters) const { return vertices_.points.size() > static_cast<std::size_t>(parameters); }
  std::size_t corners() const { return corners_; }  // all, those on the border too
  double area() const { return area_; }
  // Of the vertices that types are tried on.
  double weight() const { return std::accumulate(few_vertices_.weights.begin(), few_vertices_.weights.end(), 0.0); }
  bool passes_through_vertices(const Candidate& c) const { return c.vertices <= weight() * (kExact * kExact); }
  // Whether the triangles are all on one of its sides: it is no pair of sheets with the data between.
  static bool is_sound(const Candidate& c) { return c.side >= kOneSided; }

  Candidate measured(const Primitive& primitive) const {
    Candidate c{primitive, 0, 0, 0, 1};
    double signed_sum = 0, sum = 0;
    const Proxy proxy = Proxy::of(primitive);
    for (const Index* t = begin_; t != end_; ++t) {
      c.energy += distance_to(domain_, *t, proxy);
      const Vec3 gradient = proxy.gradient(domain_.barycentres[*t]);
      const double length = norm(gradient);
      const Vec3 normal = length > 0 ? (1 / length) * gradient : Vec3{};
      c.tilt += domain_.areas[*t] * norm2(cross(normal, domain_.normals[*t]));
      const double cosine = domain_.areas[*t] * dot(normal, domain_.normals[*t]);
      signed_sum += cosine;
      sum += std::abs(cosine);
    }
    if (sum > 0) c.side = std::abs(signed_sum) / sum;
    for (std::size_t k = 0; k < few_vertices_.points.size(); ++k) {
      const Vec3& p = few_vertices_.points[k];
      c.vertices += few_vertices_.weights[k] * norm2(foot_point(primitive, p) - p);
    }
    // Approximate distances are far too small beyond the rim of a quadric that is flat like a lens.
    if (weight() > 0) c.energy = std::max(c.energy, c.vertices * area_ / weight());
    return c;
  }
  // Vertices lie on the surface that was tessellated and barycentres below it, but a few circles of vertices alone are
  // those of many surfaces.
  template <class Fit>
  std::optional<Candidate> best(const Fit& fit) const {
    const auto first = fit(few_vertices_);
    std::optional<Candidate> by_vertices, by_all;
    if (first) by_vertices = measured(first->primitive);
    if (const auto second = fit(few_)) by_all = measured(second->primitive);
    if (!by_vertices || (by_all && kMuchWorse * by_all->energy < by_vertices->energy)) return by_all;
    return by_vertices;
  }

  // Fitted to all vertices, if that is no worse.
  Primitive refined(const Candidate& candidate) const {
    const bool general = std::holds_alternative<GeneralQuadric>(candidate.primitive);
    const auto fit = general ? std::optional(refine_quadric(candidate.primitive, vertices_))
                             : refine_primitive(candidate.primitive, vertices_);
    if (!fit || type_of(fit->primitive) == SurfaceType::plane_pair) return candidate.primitive;
    const Candidate better = measured(fit->primitive);
    const bool exact = better.vertices <= weight() * kExact * kExact && better.tilt <= kMuchWorse * candidate.tilt;
    const bool kept = is_sound(better) && (exact || better.energy <= kHardlyWorse * candidate.energy);
    return kept ? better.primitive : candidate.primitive;
  }

 private:
  const SegmentDomain& domain_;
  const Index *begin_, *end_;
  double area_ = 0;
  std::size_t corners_ = 0;
  SurfaceSamples vertices_, all_, few_vertices_, few_;
};

Primitive primitive_of(const Proxy& proxy, const SurfaceMoments& moments) {
  if (const std::optional<Torus>& torus = proxy.torus)
    return make_torus(torus->centre, torus->axis, torus->radius, torus->minor_radius);
  return classify(proxy.quadric, moments.centroid(), std::sqrt(moments.area()), kExact);
}

// All types fitted to the region, from the simplest on: the plane, the special types, then general quadrics.
std::vector<Candidate> fit_candidates(const RegionSurface& region, const SurfaceMoments& moments, const Plane& plane,
                                      const Proxy& proxy, SegmentSurfaces surfaces) {
  std::vector<Candidate> candidates{region.measured(plane)};
  for (const SurfaceType type : kSpecialTypes) {
    if (type == SurfaceType::torus && surfaces != SegmentSurfaces::all) continue;
    if (!region.can_tell(free_parameters(type))) continue;
    const auto candidate = region.best([&](const SurfaceSamples& samples) { return fit_primitive(type, samples); });
    if (candidate) candidates.push_back(*candidate);
  }
  if (proxy.torus) candidates.push_back(region.measured(primitive_of(proxy, moments)));
  // The proxy, or the quadric nearest to what it covers.
  const Primitive start = primitive_of(proxy.torus ? fit_proxy(moments, surfaces).proxy : proxy, moments);
  candidates.push_back(region.measured(start));
  if (!region.can_tell(kQuadricParameters)) return candidates;
  const auto refined =
      region.best([&](const SurfaceSamples& samples) { return std::optional(refine_quadric(start, samples)); });
  if (refined) candidates.push_back(*refined);
  return candidates;
}

// Leaves out what is no surface of its own; the plane always stays. Surfaces with all triangles on one side are
// preferred.
void remove_invalid(const SurfaceMoments& moments, std::vector<Candidate>& candidates) {
  std::erase_if(candidates, [&](const Candidate& c) {
    const auto* quadric = std::get_if<GeneralQuadric>(&c.primitive);
    return quadric && (quadric->type == SurfaceType::plane_pair || is_invalid(quadric->polynomial, moments));
  });
  if (std::any_of(candidates.begin(), candidates.end(), RegionSurface::is_sound))
    std::erase_if(candidates, [](const Candidate& c) { return !RegionSurface::is_sound(c); });
}

// Leaves out what is much farther off than the best. What passes through all vertices and is no more tilted than others
// may be as far off between them as tessellation makes it.
void remove_distant(const RegionSurface& region, std::vector<Candidate>& candidates) {
  Candidate least{{}, kInfinity, kInfinity, kInfinity, 1};
  for (const Candidate& c : candidates) {
    least.energy = std::min(least.energy, c.energy);
    if (region.passes_through_vertices(c)) least.tilt = std::min(least.tilt, c.tilt);
  }
  const double slack = region.area() * (kExact * kExact);
  std::erase_if(candidates, [&](const Candidate& c) {
    return c.energy > kMuchWorse * least.energy + slack &&
           !(region.passes_through_vertices(c) && c.tilt <= kMuchWorse * least.tilt + slack);
  });
}

// The simplest that passes through all vertices; else, from the simplest on, a more general one has to pay for its
// parameters.
const Candidate& simplest_adequate(const RegionSurface& region, const std::vector<Candidate>& candidates) {
  const auto exact_one = std::find_if(candidates.begin(), candidates.end(),
                                      [&](const Candidate& c) { return region.passes_through_vertices(c); });
  if (exact_one != candidates.end()) return *exact_one;
  const Candidate* chosen = &candidates[0];
  for (const Candidate& c : candidates) {
    const int more = free_parameters(c.primitive) - free_parameters(chosen->primitive);
    if (c.energy * simplicity_allowance(region.corners(), more) < chosen->energy) chosen = &c;
  }
  return *chosen;
}

Primitive primitive_of(const SegmentDomain& domain, const Index* begin, const Index* end,
                       const std::vector<std::uint8_t>& depths, const Proxy& proxy, SegmentSurfaces surfaces) {
  const SurfaceMoments moments = sum_of_moments(domain, {begin, end});
  const PlaneFit flat = fit_plane(moments);
  const Plane plane = make_plane(flat.normal, flat.offset);
  const RegionSurface region(domain, begin, end, depths);
  if (region.vertices() < 3 || surfaces == SegmentSurfaces::planes) return plane;
  std::vector<Candidate> candidates = fit_candidates(region, moments, plane, proxy, surfaces);
  remove_invalid(moments, candidates);
  remove_distant(region, candidates);
  return region.refined(simplest_adequate(region, candidates));
}

// Regions with their surfaces, while simpler ones are tried.
class Labelling {
 public:
  Labelling(const SegmentDomain& domain, std::vector<Index> start, const std::vector<Primitive>& primitives,
            std::size_t& evaluations)
      : labels(std::move(start)), triangles(primitives.size()), depths(vertex_depths(domain, labels)), domain_(domain),
        evaluations_(evaluations), moves_(domain),
        around_(items_at_vertices<Index>(domain.triangles, domain.vertices.size())) {
    for (const Primitive& p : primitives) proxies_.push_back(Proxy::of(p));
    for (Index t = 0; t < labels.size(); ++t) {
      triangles[labels[t]].push_back(t);
      distances_.push_back(distance_to(domain, t, proxies_[labels[t]]));
    }
    evaluations += labels.size();
  }

  double energy(Index region) const {
    double sum = 0;
    for (const Index t : triangles[region]) sum += distances_[t];
    return sum;
  }
  // Exchanges a region's surface and moves the borders to where they then belong, unless the sum of distances grows by
  // more than `most`. The work is done on triangles of the region and on those that move. False: all is as it was.
  bool exchange(Index region, const Primitive& primitive, double most);

  std::vector<Index> labels;
  std::vector<std::vector<Index>> triangles;  // of each region, ascending
  std::vector<std::uint8_t> depths;           // vertex_depths

 private:
  struct Before {
    Index triangle, label;
    double distance;
  };
  void update(const std::vector<Before>& moved);

  const SegmentDomain& domain_;
  std::size_t& evaluations_;
  BorderMoves moves_;
  Csr<Index> around_;  // the triangles at each vertex
  std::vector<Proxy> proxies_;
  std::vector<double> distances_;  // of each triangle to the proxy of its region
};

bool Labelling::exchange(Index region, const Primitive& primitive, double most) {
  const Proxy old = proxies_[region];
  proxies_[region] = Proxy::of(primitive);
  std::vector<Before> before;
  double growth = 0;
  for (const Index t : triangles[region]) {
    before.push_back({t, region, distances_[t]});
    distances_[t] = distance_to(domain_, t, proxies_[region]);
    growth += distances_[t] - before.back().distance;
  }
  evaluations_ += before.size();
  const auto own = static_cast<std::ptrdiff_t>(before.size());
  moves_.relax(proxies_, triangles[region], labels, distances_, evaluations_, [&](Index t, Index, double distance) {
    before.push_back({t, labels[t], distances_[t]});
    growth += distance - distances_[t];
  });
  if (growth <= most) {
    update({before.begin() + own, before.end()});
    return true;
  }
  for (std::size_t k = before.size(); k-- > 0;) {
    labels[before[k].triangle] = before[k].label;
    distances_[before[k].triangle] = before[k].distance;
  }
  proxies_[region] = old;
  return false;
}

// Lists and depths of the regions that triangles have moved from and to.
void Labelling::update(const std::vector<Before>& moved) {
  std::vector<Index> regions, all;
  for (const Before& b : moved) {
    regions.push_back(b.label);
    regions.push_back(labels[b.triangle]);
  }
  std::sort(regions.begin(), regions.end());
  regions.erase(std::unique(regions.begin(), regions.end()), regions.end());
  for (const Index r : regions) {
    all.insert(all.end(), triangles[r].begin(), triangles[r].end());
    triangles[r].clear();
  }
  std::sort(all.begin(), all.end());
  for (const Index t : all) triangles[labels[t]].push_back(t);
  for (const Index t : all)
    for (const Index v : domain_.triangles[t]) {
      const bool inside =
          std::all_of(around_.begin(v), around_.end(v), [&](Index u) { return labels[u] == labels[t]; });
      depths[v] = inside ? kDeep : 0;
    }
  spread_depths(domain_, all, depths);
}

// Exchanges a region's surface for the simplest type that costs little. False: it stays.
void simplify(const SegmentDomain& domain, SegmentSurfaces surfaces, Index r, Labelling& labelling,
              Primitive& primitive) {
  const std::vector<Index>& triangles = labelling.triangles[r];
  const RegionSurface region(domain, triangles.data(), triangles.data() + triangles.size(), labelling.depths);
  const double energy = labelling.energy(r);
  for (const SurfaceType type : kSpecialTypes) {
    if (type == type_of(primitive)) break;
    if (type == SurfaceType::torus && surfaces != SegmentSurfaces::all) continue;
    if (!region.can_tell(free_parameters(type))) continue;
    const auto candidate = region.best([&](const SurfaceSamples& samples) { return fit_primitive(type, samples); });
    if (!candidate || !RegionSurface::is_sound(*candidate)) continue;
    const int fewer = free_parameters(primitive) - free_parameters(type);
    const double allowance = std::max(kHardlyWorse, simplicity_allowance(region.corners(), fewer));
    const double most = (allowance - 1) * energy + region.area() * kExact * kExact;
    if (!labelling.exchange(r, candidate->primitive, most)) continue;
    primitive = candidate->primitive;
    return;
  }
}

}  // namespace

std::vector<Primitive> region_primitives(const SegmentDomain& domain, const std::vector<Index>& labels,
                                         std::size_t count, const std::vector<Proxy>& proxies, SegmentSurfaces surfaces,
                                         const Context& context) {
  const Csr<Index> triangles = items_of_labels<Index>(labels, count);
  const std::vector<std::uint8_t> depths = vertex_depths(domain, labels);
  std::vector<Primitive> primitives(count);
  parallel_each(
      count,
      [&](std::size_t r) {
        context.check();
        primitives[r] = primitive_of(domain, triangles.begin(r), triangles.end(r), depths, proxies[r], surfaces);
      },
      1);
  return primitives;
}

void simplify_primitives(const SegmentDomain& domain, SegmentSurfaces surfaces, std::vector<Index>& labels,
                         std::vector<Primitive>& primitives, std::size_t& evaluations, const Context& context) {
  if (surfaces == SegmentSurfaces::planes) return;
  Labelling labelling(domain, std::move(labels), primitives, evaluations);
  for (Index r = 0; r < primitives.size(); ++r) {
    context.check();
    simplify(domain, surfaces, r, labelling, primitives[r]);
  }
  labels = std::move(labelling.labels);
}

void take_proxies(const SegmentDomain& domain, const std::vector<Index>& labels, const std::vector<Proxy>& proxies,
                  double most, std::vector<Primitive>& primitives) {
  const Csr<Index> triangles = items_of_labels<Index>(labels, primitives.size());
  std::vector<Primitive> exact(primitives.size());
  std::vector<std::pair<double, std::size_t>> gains(primitives.size());
  std::vector<double> energies(primitives.size(), 0);
  parallel_each(
      primitives.size(),
      [&](std::size_t r) {
        const Index *begin = triangles.begin(r), *end = triangles.end(r);
        exact[r] = primitive_of(proxies[r], sum_of_moments(domain, {begin, end}));
        const Proxy now = Proxy::of(primitives[r]), other = Proxy::of(exact[r]);
        gains[r].second = r;
        for (const Index* t = begin; t != end; ++t) {
          const double d = distance_to(domain, *t, now);
          energies[r] += d;
          gains[r].first += d - distance_to(domain, *t, other);
        }
      },
      1);
  double energy = std::accumulate(energies.begin(), energies.end(), 0.0);
  std::stable_sort(gains.begin(), gains.end(), [](const auto& a, const auto& b) { return a.first > b.first; });
  for (const auto& [gain, r] : gains) {
    if (energy <= most || !(gain > 0)) break;
    primitives[r] = exact[r];
    energy -= gain;
  }
}

void refine_primitives(const SegmentDomain& domain, const std::vector<Index>& labels,
                       std::vector<Primitive>& primitives, const Context& context) {
  const Csr<Index> triangles = items_of_labels<Index>(labels, primitives.size());
  const std::vector<std::uint8_t> depths = vertex_depths(domain, labels);
  parallel_each(
      primitives.size(),
      [&](std::size_t r) {
        context.check();
        const RegionSurface region(domain, triangles.begin(r), triangles.end(r), depths);
        primitives[r] = region.refined(region.measured(primitives[r]));
      },
      1);
}

}  // namespace bisector
