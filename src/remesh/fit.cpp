#include "remesh/fit.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <utility>

#include "backend/project.h"
#include "bisector/error.h"
#include "bisector/quality.h"
#include "core/degenerate.h"
#include "core/geometry.h"
#include "core/parallel.h"
#include "core/random.h"
#include "mesh/topology.h"
#include "mesh/triangle_quality.h"
#include "spatial/nearest.h"

namespace bisector {
namespace {

// A triangle of the mesh is divided into kSplit^2 similar ones with a sample in each, or into more if the mesh has few;
// the reference gets as many samples as the mesh.
constexpr int kSplit = 2;
constexpr std::size_t kFewSamples = 10'000;
// Weight of a vertex's tangential distance to where its triangles would be equilateral, beside that of its samples.
constexpr double kFairness = 0.2;
constexpr double kUpright = 0.5;    // cosine between a triangle's normal and the reference's, at least
constexpr double kResidual = 1e-4;  // of the linear system, relative
constexpr int kSolverSteps = 200;
constexpr int kHalvings = 6;         // of a vertex's step, then it stays; of the whole step, then the fit ends
constexpr double kRounding = 1e-12;  // of the reference's diagonal: nearer than this there is nothing to gain
constexpr std::uint64_t kRandomSeed = 1;

using Corners = std::array<Vec3, 3>;
using Weights = std::array<double, 3>;

Corners corners_of(const TriangleMesh& mesh, const std::vector<Vec3>& vertices, std::size_t t) {
  const auto [a, b, c] = mesh.triangles[t];
  return {vertices[a], vertices[b], vertices[c]};
}

Vec3 at(const Corners& p, const Weights& w) { return w[0] * p[0] + w[1] * p[1] + w[2] * p[2]; }

// The zero vector if there is no area.
Vec3 unit_normal(const Corners& p) {
  const Vec3 n = cross(p[1] - p[0], p[2] - p[0]);
  const double length = norm(n);
  return length > 0 ? (1 / length) * n : Vec3{};
}

Vec3 nearest_on(const Corners& t, const Vec3& p) { return nearest_on_triangle(p, t[0], t[1], t[2]); }

// A triangle similar to the one that it is part of.
struct Part {
  Weights centre;
  double size;  // of its edges, relative; negative if it is turned by half
};

// The m^2 parts that come from dividing each edge into m.
std::vector<Part> divide(int m) {
  std::vector<Part> parts;
  const double third = 1.0 / (3 * m);
  for (int i = 0; i < m; ++i)
    for (int j = 0; i + j < m; ++j)
      for (const int turned : {0, 1}) {
        if (turned && i + j + 1 == m) continue;
        const double a = (3 * i + 1 + turned) * third, b = (3 * j + 1 + turned) * third;
        parts.push_back({{a, b, 1 - a - b}, (turned ? -3 : 3) * third});
      }
  return parts;
}

// Uniform on the triangle.
Weights random_weights(Random& random) {
  double u = random.uniform(), v = random.uniform();
  if (v < u) std::swap(u, v);
  return {u, v - u, 1 - v};
}

// The corners (3 t + k) at each vertex, ascending.
Csr<std::size_t> corners_at_vertices(const TriangleMesh& mesh) {
  Csr<std::size_t> corners;
  corners.offsets.assign(mesh.vertices.size() + 1, 0);
  for (const Triangle& t : mesh.triangles)
    for (const Index v : t) ++corners.offsets[v + 1];
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) corners.offsets[v + 1] += corners.offsets[v];
  corners.values.resize(3 * mesh.triangles.size());
  std::vector<std::size_t> slot(corners.offsets.begin(), corners.offsets.end() - 1);
  for (std::size_t c = 0; c < corners.values.size(); ++c) corners.values[slot[mesh.triangles[c / 3][c % 3]]++] = c;
  return corners;
}

// Quadratic form of one triangle's samples: sums of w b_i b_j, as 00, 11, 22, 01, 12, 20, and of w b_i times the way to
// the other side.
struct Local {
  std::array<double, 6> matrix{};
  std::array<Vec3, 3> pull{};

  void add(double w, const Weights& b) {
    for (std::size_t k = 0; k < 3; ++k) {
      matrix[k] += w * b[k] * b[k];
      matrix[3 + k] += w * b[k] * b[(k + 1) % 3];
    }
  }
  double entry(std::size_t i, std::size_t j) const {
    return i == j ? matrix[i] : matrix[3 + ((i + 1) % 3 == j ? i : j)];
  }
};

// What no triangle may fall below.
struct Shape {
  double largest_cotangent = 0;  // of the smallest angle
  double quality = 0;
  double upright = 0;  // cosine of the angle to the reference's normal
};

Shape shape_of(const Corners& p, const Vec3& upright) {
  const Vec3 n = cross(p[1] - p[0], p[2] - p[0]);
  const double twice = norm(n);
  if (!(twice > 0)) return {std::numeric_limits<double>::infinity(), 0, -1};
  Shape shape{0, 0, dot(n, upright) / twice};
  double perimeter = 0, longest = 0;
  for (int k = 0; k < 3; ++k) {
    const Vec3 u = p[(k + 1) % 3] - p[k], v = p[(k + 2) % 3] - p[k];
    shape.largest_cotangent = std::max(shape.largest_cotangent, dot(u, v) / twice);
    perimeter += norm(u);
    longest = std::max(longest, norm(u));
  }
  shape.quality = 6 / std::numbers::sqrt3 * (twice / perimeter) / longest;
  return shape;
}

class Fit {
 public:
  Fit(const TriangleMesh& reference, TriangleMesh& mesh, const FitOptions& options);
  bool has_area() const { return total_area_ > 0; }
  FitReport run(const Context& context);

 private:
  struct Squared {
    double to_reference = 0, from_reference = 0;  // weighted means over the samples
    double sum() const { return to_reference + from_reference; }
  };

  void sample_reference();
  void set_bounds();
  Weights sample_weights(std::size_t sample) const;
  Squared pair_up(const std::vector<Vec3>& vertices);
  std::vector<Local> local_forms() const;
  Vec3 fair_position(std::size_t v) const;
  std::vector<Vec3> solve(const std::vector<Local>& forms) const;
  bool keeps_bounds(const std::vector<Vec3>& vertices, std::size_t t) const;
  std::size_t damp(const std::vector<Vec3>& from, const std::vector<Vec3>& step, std::vector<double>& factor,
                   std::vector<Vec3>& vertices) const;
  std::size_t separate();
  FitReport::Distance report(const Squared& squared) const;

  double mesh_weight(std::size_t t) const { return areas_[t] / (total_area_ * static_cast<double>(parts_.size())); }
  double reference_weight() const { return 1 / static_cast<double>(points_.size()); }

  const TriangleMesh& reference_;
  TriangleMesh& mesh_;
  const FitOptions& options_;
  double diagonal_;  // of the reference
  NearestOnMesh nearest_on_reference_;
  Csr<std::size_t> corners_;  // at each of the mesh's vertices
  std::vector<char> fixed_;
  std::vector<Part> parts_;    // of each of the mesh's triangles, with one sample in each part
  std::vector<double> areas_;  // of the mesh's triangles at the start: the samples' weights do not change
  double total_area_ = 0;
  std::vector<Vec3> points_;           // samples of the reference, in the order of its triangles
  std::vector<Index> point_triangle_;  // of the reference
  std::vector<Vec3> start_;            // vertices of the mesh
  std::vector<Vec3> upright_;          // of each of the mesh's triangles: the reference's normal
  Shape bounds_;
  std::vector<Index> foot_triangle_;   // of each of the mesh's samples, in the reference
  std::vector<Index> found_triangle_;  // of each of the reference's samples, in the mesh
};

Fit::Fit(const TriangleMesh& reference, TriangleMesh& mesh, const FitOptions& options)
    : reference_(reference), mesh_(mesh), options_(options), diagonal_(bounding_box(reference).diagonal()),
      nearest_on_reference_(reference), corners_(corners_at_vertices(mesh)), fixed_(options.fixed),
      start_(mesh.vertices) {
  if (fixed_.empty()) fixed_.assign(mesh.vertices.size(), 0);
  const EdgeTable table = edge_table(mesh.triangles, mesh.vertices.size());
  for (std::size_t e = 0; e < table.edges.size(); ++e)
    if (table.half_edges.size(e) != 2)
      for (const Index v : table.edges[e]) fixed_[v] = 1;
  for (std::size_t v = 0; v < fixed_.size(); ++v)
    if (corners_.size(v) == 0) fixed_[v] = 1;

  areas_.resize(mesh.triangles.size());
  parallel_each(areas_.size(), [&](std::size_t t) {
    const Corners p = corners_of(mesh, mesh.vertices, t);
    areas_[t] = triangle_area(p[0], p[1], p[2]);
  });
  total_area_ = fixed_sum(areas_.size(), [&](std::size_t t) { return areas_[t]; });
  if (!has_area()) return;
  int split = kSplit;
  while (mesh.triangles.size() * static_cast<std::size_t>(split * split) < kFewSamples) ++split;
  parts_ = divide(split);
  sample_reference();
  set_bounds();
}

// One uniform point in each of as many parts of equal area as there are samples of the mesh.
void Fit::sample_reference() {
  std::vector<double> sums(reference_.triangles.size());
  double area = 0;
  for (std::size_t t = 0; t < sums.size(); ++t) {
    const Corners p = corners_of(reference_, reference_.vertices, t);
    sums[t] = area += triangle_area(p[0], p[1], p[2]);
  }
  const std::size_t last = static_cast<std::size_t>(std::lower_bound(sums.begin(), sums.end(), area) - sums.begin());
  points_.resize(mesh_.triangles.size() * parts_.size());
  point_triangle_.resize(points_.size());
  foot_triangle_.assign(points_.size(), kNone);
  found_triangle_.assign(points_.size(), kNone);
  parallel_each(points_.size(), [&](std::size_t i) {
    Random random(kRandomSeed, i);
    const double where = (static_cast<double>(i) + random.uniform()) * reference_weight() * area;
    const auto found = std::upper_bound(sums.begin(), sums.begin() + last, where);
    point_triangle_[i] = static_cast<Index>(found - sums.begin());
    points_[i] = at(corners_of(reference_, reference_.vertices, point_triangle_[i]), random_weights(random));
  });
}

void Fit::set_bounds() {
  upright_.resize(mesh_.triangles.size());
  parallel_each(
      upright_.size(),
      [&](std::size_t t) {
        const Corners p = corners_of(mesh_, start_, t);
        const NearestPoint foot = nearest_on_reference_.nearest(at(p, {1.0 / 3, 1.0 / 3, 1.0 / 3}));
        const Vec3 own = unit_normal(p),
                   theirs = unit_normal(corners_of(reference_, reference_.vertices, foot.triangle));
        upright_[t] = dot(own, theirs) > 0 ? theirs : own;
      },
      128);
  bounds_ = {0, 1, kUpright};
  if (!options_.min_angle || !options_.min_quality)
    for (std::size_t t = 0; t < upright_.size(); ++t) {
      const Shape shape = shape_of(corners_of(mesh_, start_, t), upright_[t]);
      bounds_.largest_cotangent = std::max(bounds_.largest_cotangent, shape.largest_cotangent);
      bounds_.quality = std::min(bounds_.quality, shape.quality);
    }
  if (options_.min_angle) bounds_.largest_cotangent = 1 / std::tan(*options_.min_angle * std::numbers::pi / 180);
  if (options_.min_quality) bounds_.quality = *options_.min_quality;
}

// One uniform point in each part.
Weights Fit::sample_weights(std::size_t sample) const {
  Random random(kRandomSeed, points_.size() + sample);
  const Part& part = parts_[sample % parts_.size()];
  const Weights inside = random_weights(random);
  Weights weights = part.centre;
  for (int k = 0; k < 3; ++k) weights[k] += part.size * (inside[k] - 1.0 / 3);
  return weights;
}

// Finds the nearest points of all samples where the mesh's vertices lie at `vertices`; what was found last is the hint.
Fit::Squared Fit::pair_up(const std::vector<Vec3>& vertices) {
  const auto look_up = [](const NearestOnMesh& tree, const TriangleMesh& mesh, const std::vector<Vec3>& at_vertices,
                          const Vec3& p, Index& last) {
    const NearestPoint found =
        last == kNone ? tree.nearest(p) : tree.nearest(p, {nearest_on(corners_of(mesh, at_vertices, last), p), last});
    last = found.triangle;
    return norm2(p - found.point);
  };
  Squared squared;
  squared.to_reference = fixed_sum(points_.size(), [&](std::size_t i) {
    const std::size_t t = i / parts_.size();
    if (!(areas_[t] > 0)) return 0.0;
    const Vec3 q = at(corners_of(mesh_, vertices, t), sample_weights(i));
    return mesh_weight(t) * look_up(nearest_on_reference_, reference_, reference_.vertices, q, foot_triangle_[i]);
  });
  const NearestOnMesh nearest_on_mesh({vertices, mesh_.triangles, {}});
  squared.from_reference = fixed_sum(points_.size(), [&](std::size_t i) {
    return reference_weight() * look_up(nearest_on_mesh, mesh_, vertices, points_[i], found_triangle_[i]);
  });
  return squared;
}

std::vector<Local> Fit::local_forms() const {
  Csr<Index> points;  // that found each triangle, ascending
  points.offsets.assign(mesh_.triangles.size() + 1, 0);
  for (const Index t : found_triangle_) ++points.offsets[t + 1];
  for (std::size_t t = 0; t < mesh_.triangles.size(); ++t) points.offsets[t + 1] += points.offsets[t];
  points.values.resize(points_.size());
  std::vector<std::size_t> slot(points.offsets.begin(), points.offsets.end() - 1);
  for (std::size_t i = 0; i < points_.size(); ++i) points.values[slot[found_triangle_[i]]++] = static_cast<Index>(i);

  std::vector<Local> forms(mesh_.triangles.size());
  parallel_each(
      forms.size(),
      [&](std::size_t t) {
        if (!(areas_[t] > 0)) return;
        const Corners p = corners_of(mesh_, mesh_.vertices, t);
        const Vec3 normal = unit_normal(p);
        const auto add = [&](double w, const Weights& b, const Vec3& pull, Index reference_triangle) {
          if (!std::isfinite(b[0] + b[1] + b[2] + norm2(pull))) return;  // at a needle
          forms[t].add(w, b);
          const Vec3 theirs = unit_normal(corners_of(reference_, reference_.vertices, reference_triangle));
          if (dot(normal, theirs) < 0) return;  // another sheet
          for (int k = 0; k < 3; ++k) forms[t].pull[k] += (w * b[k]) * pull;
        };
        for (std::size_t i = t * parts_.size(); i < (t + 1) * parts_.size(); ++i) {
          const Index foot = foot_triangle_[i];
          const Weights b = sample_weights(i);
          const Vec3 q = at(p, b);
          add(mesh_weight(t), b, nearest_on(corners_of(reference_, reference_.vertices, foot), q) - q, foot);
        }
        for (const Index* i = points.begin(t); i != points.end(t); ++i) {
          const Vec3 q = nearest_on(p, points_[*i]);
          add(reference_weight(), barycentric_weights(p[0], p[1], p[2], q), points_[*i] - q, point_triangle_[*i]);
        }
      },
      256);
  return forms;
}

// The mean of the places that would make one triangle at the vertex equilateral each.
Vec3 Fit::fair_position(std::size_t v) const {
  Vec3 sum;
  for (const std::size_t* c = corners_.begin(v); c != corners_.end(v); ++c) {
    const Corners p = corners_of(mesh_, mesh_.vertices, *c / 3);
    const Vec3 &a = p[(*c + 1) % 3], &b = p[(*c + 2) % 3];
    sum += 0.5 * (a + b) + (0.5 * std::numbers::sqrt3) * cross(unit_normal(p), b - a);
  }
  return (1 / static_cast<double>(corners_.size(v))) * sum;
}

// The step to the minimum for the present pairs and the fairness: conjugate gradients, preconditioned by each vertex's
// own block. They take few steps, for the matrix is a mass matrix.
std::vector<Vec3> Fit::solve(const std::vector<Local>& forms) const {
  const std::size_t n = mesh_.vertices.size();
  std::vector<Vec3> x(n), residual(n), scaled(n), direction(n), image(n), normals(n);
  std::vector<double> diagonal(n, 0);
  const auto inner = [&](const std::vector<Vec3>& a, const std::vector<Vec3>& b) {
    return fixed_sum(n, [&](std::size_t v) { return dot(a[v], b[v]); });
  };
  const auto tangential = [&](std::size_t v, const Vec3& d) { return d - dot(d, normals[v]) * normals[v]; };
  const auto precondition = [&](std::size_t v) {
    if (!(diagonal[v] > 0)) return Vec3{};
    return (1 / diagonal[v]) * (residual[v] - (kFairness / (1 + kFairness)) * tangential(v, residual[v]));
  };
  const auto multiply = [&](const std::vector<Vec3>& d, std::size_t v) {
    if (fixed_[v]) return Vec3{};
    Vec3 sum = (kFairness * diagonal[v]) * tangential(v, d[v]);
    for (const std::size_t* c = corners_.begin(v); c != corners_.end(v); ++c)
      for (std::size_t k = 0; k < 3; ++k) sum += forms[*c / 3].entry(*c % 3, k) * d[mesh_.triangles[*c / 3][k]];
    return sum;
  };

  parallel_each(n, [&](std::size_t v) {
    if (fixed_[v]) return;
    Vec3 normal;
    for (const std::size_t* c = corners_.begin(v); c != corners_.end(v); ++c) {
      const Corners p = corners_of(mesh_, mesh_.vertices, *c / 3);
      normal += cross(p[1] - p[0], p[2] - p[0]);
      diagonal[v] += forms[*c / 3].matrix[*c % 3];
      residual[v] += forms[*c / 3].pull[*c % 3];
    }
    const double length = norm(normal);
    if (length > 0) normals[v] = (1 / length) * normal;
    residual[v] += (kFairness * diagonal[v]) * tangential(v, fair_position(v) - mesh_.vertices[v]);
    direction[v] = precondition(v);
  });
  double slope = inner(residual, direction);
  const double enough = kResidual * kResidual * slope;
  for (int k = 0; k < kSolverSteps && slope > enough; ++k) {
    parallel_each(n, [&](std::size_t v) { image[v] = multiply(direction, v); });
    const double length = slope / inner(direction, image);
    parallel_each(n, [&](std::size_t v) {
      x[v] += length * direction[v];
      residual[v] -= length * image[v];
      scaled[v] = precondition(v);
    });
    const double next = inner(residual, scaled);
    parallel_each(n, [&](std::size_t v) { direction[v] = scaled[v] + (next / slope) * direction[v]; });
    slope = next;
  }
  return x;
}

bool Fit::keeps_bounds(const std::vector<Vec3>& vertices, std::size_t t) const {
  const Shape now = shape_of(corners_of(mesh_, vertices, t), upright_[t]);
  if (now.largest_cotangent <= bounds_.largest_cotangent && now.quality >= bounds_.quality &&
      now.upright >= bounds_.upright)
    return true;
  const Shape start = shape_of(corners_of(mesh_, start_, t), upright_[t]);
  return now.largest_cotangent <= std::max(bounds_.largest_cotangent, start.largest_cotangent) &&
         now.quality >= std::min(bounds_.quality, start.quality) &&
         now.upright >= std::min(bounds_.upright, start.upright);
}

// vertices = from + factor * step, where factors are lowered around triangles that would break a bound; `from` breaks
// none. Returns the number of vertices held back.
std::size_t Fit::damp(const std::vector<Vec3>& from, const std::vector<Vec3>& step, std::vector<double>& factor,
                      std::vector<Vec3>& vertices) const {
  const double least = std::ldexp(1.0, -kHalvings);
  const std::vector<double> wanted = factor;
  vertices.resize(from.size());
  parallel_each(from.size(), [&](std::size_t v) { vertices[v] = from[v] + factor[v] * step[v]; });
  std::vector<Index> active(mesh_.triangles.size());
  for (std::size_t t = 0; t < active.size(); ++t) active[t] = static_cast<Index>(t);
  while (!active.empty()) {
    std::vector<char> broken(active.size());
    parallel_each(active.size(), [&](std::size_t i) { broken[i] = !keeps_bounds(vertices, active[i]); });
    std::vector<Index> held;
    for (std::size_t i = 0; i < active.size(); ++i)
      if (broken[i])
        for (const Index v : mesh_.triangles[active[i]])
          if (!fixed_[v] && factor[v] > 0) held.push_back(v);
    std::sort(held.begin(), held.end());
    held.erase(std::unique(held.begin(), held.end()), held.end());
    active.clear();
    for (const Index v : held) {
      factor[v] = factor[v] > least * wanted[v] ? 0.5 * factor[v] : 0;
      vertices[v] = from[v] + factor[v] * step[v];
      for (const std::size_t* c = corners_.begin(v); c != corners_.end(v); ++c)
        active.push_back(static_cast<Index>(*c / 3));
    }
    std::sort(active.begin(), active.end());
    active.erase(std::unique(active.begin(), active.end()), active.end());
  }
  std::size_t count = 0;
  for (std::size_t v = 0; v < factor.size(); ++v)
    if (factor[v] < wanted[v]) ++count;
  return count;
}

// Puts vertices back to the start until no two triangles intersect that did not there. Returns how many.
std::size_t Fit::separate() {
  std::vector<std::array<Index, 2>> pairs = find_self_intersections(mesh_);
  if (pairs.empty()) return 0;
  const std::vector<std::array<Index, 2>> before = find_self_intersections({start_, mesh_.triangles, {}});
  std::vector<Vec3> step(start_.size());
  for (std::size_t v = 0; v < step.size(); ++v) step[v] = mesh_.vertices[v] - start_[v];
  std::vector<double> factor(start_.size(), 1);
  for (;;) {
    std::vector<std::array<Index, 2>> fresh;
    std::set_difference(pairs.begin(), pairs.end(), before.begin(), before.end(), std::back_inserter(fresh));
    if (fresh.empty()) break;
    for (const auto& pair : fresh)
      for (const Index t : pair)
        for (const Index v : mesh_.triangles[t]) factor[v] = 0;
    damp(start_, step, factor, mesh_.vertices);
    pairs = find_self_intersections(mesh_);
  }
  return static_cast<std::size_t>(std::count_if(factor.begin(), factor.end(), [](double f) { return f < 1; }));
}

FitReport::Distance Fit::report(const Squared& squared) const {
  const double percent = 100 / diagonal_;
  return {percent * std::sqrt(squared.to_reference), percent * std::sqrt(squared.from_reference)};
}

FitReport Fit::run(const Context& context) {
  FitReport result;
  const Squared start = pair_up(mesh_.vertices);
  Squared now = start;
  std::vector<Vec3> vertices;
  const double exact = kRounding * diagonal_;
  for (bool falls = true; falls && now.sum() > exact * exact && result.iterations < options_.iterations;) {
    context.check();
    const std::vector<Vec3> step = solve(local_forms());
    double whole = 1;
    for (int k = 0;; ++k, whole *= 0.5) {
      std::vector<double> factor(step.size(), whole);
      const std::size_t damped = damp(mesh_.vertices, step, factor, vertices);
      const Squared next = pair_up(vertices);
      if (next.sum() < now.sum()) {
        falls = next.sum() < (1 - options_.tolerance) * now.sum();
        now = next;
        result.damped = damped;
        ++result.iterations;
        std::swap(mesh_.vertices, vertices);
        break;
      }
      if (k == kHalvings) {
        falls = false;
        break;
      }
    }
    const double fraction = static_cast<double>(result.iterations) / options_.iterations;
    context.report(
        {"fit", result.iterations, options_.iterations, now.sum(), 0, options_.done + options_.share * fraction});
  }
  result.restored = separate();
  if (result.restored > 0) now = pair_up(mesh_.vertices);
  if (now.sum() > start.sum()) {
    mesh_.vertices = start_;
    now = start;
  }
  result.before = report(start);
  result.after = report(now);
  return result;
}

}  // namespace

FitReport fit_to_surface(const TriangleMesh& reference, TriangleMesh& mesh, const FitOptions& options,
                         const Context& context) {
  if (!options.fixed.empty() && options.fixed.size() != mesh.vertices.size())
    throw Error("fit: " + std::to_string(options.fixed.size()) + " marks for " + std::to_string(mesh.vertices.size()) +
                " vertices; give one per vertex or none");
  TriangleMesh fitted = mesh;
  Fit fit(reference, fitted, options);
  if (!fit.has_area()) return {};
  const FitReport report = fit.run(context);
  mesh.vertices = std::move(fitted.vertices);
  return report;
}

}  // namespace bisector
