#include "view/scene.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "core/geometry.h"
#include "core/parallel.h"
#include "mesh/tet_quality.h"
#include "mesh/topology.h"
#include "mesh/triangle_quality.h"
#include "mesh/used_vertices.h"
#include "spatial/nearest.h"

namespace bisector::view {
namespace {

constexpr double kMissing = std::numeric_limits<double>::quiet_NaN();

const Measure kTheta{"theta_min", "Smallest angle", "°", Element::triangle, Worst::low, 0, 60, 60};
const Measure kQ{"q", "Q", "", Element::triangle, Worst::low, 0, 1, 50};
const Measure kValence{"valence", "Valence", "", Element::vertex, Worst::off_six, 2.5, 12.5, 10};
const Measure kDihedral{"dihedral_min", "Smallest dihedral angle", "°", Element::tet, Worst::low, 0, 72, 36};
const Measure kRadiusRatio{"radius_ratio", "Radius ratio", "", Element::tet, Worst::low, 0, 1, 50};

void measure_triangles(Model& model) {
  const std::size_t n = model.triangles.size();
  Values theta{kTheta.key, std::vector<double>(n)}, q{kQ.key, std::vector<double>(n)};
  parallel_each(n, [&](std::size_t i) {
    const Triangle& t = model.triangles[i];
    const TriangleShape shape = measure_triangle(model.vertices[t[0]], model.vertices[t[1]], model.vertices[t[2]]);
    theta.at[i] = *std::min_element(shape.theta.begin(), shape.theta.end());
    q.at[i] = shape.q;
  });
  model.values.push_back(std::move(theta));
  model.values.push_back(std::move(q));
}

// Of interior vertices, as in reports.
void measure_valences(Model& model) {
  const std::size_t n = model.vertices.size();
  const auto [neighbours, border] = count_neighbours(edge_table(model.triangles, n), n);
  Values valence{kValence.key, std::vector<double>(n, kMissing)};
  for (std::size_t v = 0; v < n; ++v)
    if (neighbours[v] > 0 && !border[v]) valence.at[v] = neighbours[v];
  model.values.push_back(std::move(valence));
}

void measure_tets(Model& model) {
  const std::size_t n = model.tets.size();
  Values dihedral{kDihedral.key, std::vector<double>(n)}, ratio{kRadiusRatio.key, std::vector<double>(n)};
  parallel_each(n, [&](std::size_t i) {
    const Tetrahedron& t = model.tets[i];
    const TetShape shape =
        measure_tet(model.vertices[t[0]], model.vertices[t[1]], model.vertices[t[2]], model.vertices[t[3]]);
    dihedral.at[i] = shape.smallest;
    ratio.at[i] = shape.radius_ratio;
  });
  model.values.push_back(std::move(dihedral));
  model.values.push_back(std::move(ratio));
}

TriangleMesh surface_of(const Model& model) { return {model.vertices, model.triangles}; }

// Vertices inside of a solid are of no surface.
std::vector<char> on_surface(const Model& model) { return mark_used_vertices(model.triangles, model.vertices.size()); }

Values distances(const Model& from, const Model& to, double percent) {
  const NearestOnMesh nearest(surface_of(to));
  const std::vector<char> used = on_surface(from);
  Values values{"distance", std::vector<double>(from.vertices.size(), kMissing)};
  parallel_each(values.at.size(), [&](std::size_t v) {
    if (used[v]) values.at[v] = percent * norm(from.vertices[v] - nearest.nearest(from.vertices[v]).point);
  });
  return values;
}

double largest(const std::vector<double>& values) {
  double most = 0;
  for (const double x : values) most = std::max(most, std::isnan(x) ? 0 : x);
  return most;
}

// How bad a value is; none is the least.
double badness(const Measure& measure, double value) {
  if (std::isnan(value)) return -std::numeric_limits<double>::infinity();
  switch (measure.worst) {
    case Worst::none: break;
    case Worst::low: return -value;
    case Worst::high: return value;
    case Worst::off_six: return std::abs(value - 6);
  }
  return 0;
}

}  // namespace

Model surface_model(const std::string& title, const std::string& file, const TriangleMesh& mesh) {
  return {title, file, mesh.vertices, mesh.triangles, mesh.face_of_triangle, {}, mesh.feature_edges};
}

Model solid_model(const std::string& title, const std::string& file, const TetMesh& mesh,
                  const std::vector<Triangle>& boundary) {
  return {title, file, mesh.vertices, boundary, {}, mesh.tets, mesh.feature_edges};
}

void measure_shapes(Scene& scene) {
  bool surfaces = false, solids = false;
  for (Model& model : scene.models) {
    if (!model.triangles.empty()) {
      measure_triangles(model);
      measure_valences(model);
      surfaces = true;
    }
    if (!model.tets.empty()) {
      measure_tets(model);
      solids = true;
    }
  }
  if (solids) scene.measures.insert(scene.measures.end(), {kDihedral, kRadiusRatio});
  if (surfaces) scene.measures.insert(scene.measures.end(), {kTheta, kQ, kValence});
}

void measure_distances(Scene& scene) {
  Model &first = scene.models[0], &second = scene.models[1];
  const double percent = 100 / bounding_box(first.vertices).diagonal();
  Values there = distances(first, second, percent), back = distances(second, first, percent);
  const double most = std::max(largest(there.at), largest(back.at));
  scene.measures.push_back({"distance", "Distance to the other", "% of the diagonal", Element::vertex, Worst::high, 0,
                            most > 0 ? most : 1, 50});
  first.values.push_back(std::move(there));
  second.values.push_back(std::move(back));
}

void add_groups(Scene& scene, std::size_t model, const Measure& groups, std::vector<double> values) {
  scene.models[model].values.push_back({groups.key, std::move(values)});
  const auto same = [&](const Measure& m) { return m.key == groups.key; };
  if (std::none_of(scene.measures.begin(), scene.measures.end(), same)) scene.measures.push_back(groups);
}

void add_labels(Scene& scene, Measure groups, const std::vector<std::vector<std::int32_t>>& labels) {
  std::vector<std::int32_t> all;
  for (const auto& some : labels) all.insert(all.end(), some.begin(), some.end());
  std::sort(all.begin(), all.end());
  all.erase(std::unique(all.begin(), all.end()), all.end());
  for (const std::int32_t label : all) groups.names.push_back(std::to_string(label));
  for (std::size_t model = 0; model < labels.size(); ++model) {
    if (labels[model].empty()) continue;
    std::vector<double> values;
    for (const std::int32_t label : labels[model])
      values.push_back(static_cast<double>(std::lower_bound(all.begin(), all.end(), label) - all.begin()));
    add_groups(scene, model, groups, std::move(values));
  }
}

bool is_worse(const Measure& measure, double a, double b) { return badness(measure, a) > badness(measure, b); }

std::vector<std::size_t> worst_elements(const Measure& measure, const std::vector<double>& values, std::size_t most) {
  std::vector<std::size_t> worst;
  for (std::size_t i = 0; i < values.size(); ++i)
    if (!std::isnan(values[i])) worst.push_back(i);
  const std::size_t n = std::min(most, worst.size());
  std::partial_sort(worst.begin(), worst.begin() + static_cast<std::ptrdiff_t>(n), worst.end(),
                    [&](std::size_t i, std::size_t j) {
                      const double a = badness(measure, values[i]), b = badness(measure, values[j]);
                      return a > b || (a == b && i < j);
                    });
  worst.resize(n);
  return worst;
}

}  // namespace bisector::view
