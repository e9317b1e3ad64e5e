#include "bisector/remesh/topology_control.h"

#include <algorithm>
#include <limits>
#include <map>
#include <string>

#include "bisector/cvt/multilevel.h"
#include "bisector/voronoi/dual.h"

namespace bisector {
namespace {

constexpr int kRounds = 24;
constexpr int kMovingRounds = 4;  // the first; later ones add seeds, for a surface may need more than were asked for
// Many steps spread what was added all over the surface, few leave it where it is needed: fewer and fewer.
constexpr int kFirstSteps = 30, kLastSteps = 2;
constexpr std::size_t kMostAdded = 100;  // and a quarter of the seeds

// Seeds of edges with other than two triangles (one, on an open surface), of vertices without a single fan of triangles, of
// repeated triangles, and seeds without any.
std::vector<Index> broken_cells(const Dual& dual, std::size_t seeds, bool closed) {
  std::vector<char> broken(seeds, 0);
  std::map<std::array<Index, 2>, int> edges;
  std::vector<std::vector<Index>> link(seeds);  // pairs of vertices opposite in each triangle
  for (std::size_t k = 0; k < dual.triangles.size(); ++k) {
    const Triangle& t = dual.triangles[k];
    for (int m = 0; m < 3; ++m) {
      const Index a = t[m], b = t[(m + 1) % 3];
      ++edges[{std::min(a, b), std::max(a, b)}];
      link[a].push_back(b);
      link[a].push_back(t[(m + 2) % 3]);
      if (dual.multiplicity[k] > 1) broken[a] = 1;
    }
  }
  for (const auto& [edge, count] : edges)
    if (count > 2 || (count < 2 && closed)) broken[edge[0]] = broken[edge[1]] = 1;
  for (std::size_t v = 0; v < seeds; ++v) {
    if (link[v].empty()) {
      broken[v] = 1;
      continue;
    }
    // The link of a manifold vertex is one path or one cycle.
    std::vector<Index> reached{link[v][0]};
    for (std::size_t head = 0; head < reached.size(); ++head)
      for (std::size_t k = 0; k < link[v].size(); ++k)
        if (link[v][k] == reached[head]) {
          const Index other = link[v][k ^ 1];
          if (std::find(reached.begin(), reached.end(), other) == reached.end()) reached.push_back(other);
        }
    std::vector<Index> around = link[v];
    std::sort(around.begin(), around.end());
    around.erase(std::unique(around.begin(), around.end()), around.end());
    if (reached.size() != around.size()) broken[v] = 1;
  }
  std::vector<Index> cells;
  for (Index v = 0; v < seeds; ++v)
    if (broken[v]) cells.push_back(v);
  return cells;
}

// For each broken cell, the place of its restricted cell that turns farthest away from the surface at the seed: the other sheet
// of a thin part, or the back of a thin limb; if the cell does not turn away, its farthest corner.
std::vector<Vec3> repair_points(const Surface& surface, const RestrictedPolygons& polygons,
                                const std::vector<Vec3>& seeds, const std::vector<Index>& cells) {
  struct Place {
    double nearest = -1;
    Vec3 normal;
    double turned = 0, farthest = -1;
    Vec3 opposite, corner;
  };
  std::vector<Place> places(seeds.size());
  std::vector<char> wanted(seeds.size(), 0);
  for (Index i : cells) wanted[i] = 1;
  const auto for_each_piece = [&](const auto& visit) {
    for (std::size_t k = 0; k < polygons.pairs.size(); ++k) {
      const auto [triangle, cell] = polygons.pairs[k];
      if (!wanted[cell]) continue;
      Vec3 centre;
      for (std::size_t e = polygons.offsets[k]; e < polygons.offsets[k + 1]; ++e) centre += polygons.vertices[e];
      centre *= 1.0 / static_cast<double>(polygons.offsets[k + 1] - polygons.offsets[k]);
      visit(places[cell], k, cell, surface.facets[surface.facet_of[triangle]].normal, centre);
    }
  };
  for_each_piece([&](Place& place, std::size_t, Index cell, const Vec3& normal, const Vec3& centre) {
    const double d = norm2(centre - seeds[cell]);
    if (place.nearest < 0 || d < place.nearest) {
      place.nearest = d;
      place.normal = normal;
    }
  });
  for_each_piece([&](Place& place, std::size_t k, Index cell, const Vec3& normal, const Vec3& centre) {
    const double turned = dot(normal, place.normal);
    if (turned < place.turned) {
      place.turned = turned;
      place.opposite = centre;
    }
    for (std::size_t e = polygons.offsets[k]; e < polygons.offsets[k + 1]; ++e) {
      const double d = norm2(polygons.vertices[e] - seeds[cell]);
      if (d > place.farthest) {
        place.farthest = d;
        place.corner = polygons.vertices[e];
      }
    }
  });
  const bool any_turned = std::any_of(cells.begin(), cells.end(), [&](Index i) { return places[i].turned < -0.2; });
  std::vector<Vec3> points;
  for (Index i : cells) {
    const Place& place = places[i];
    if (place.farthest < 0 || (any_turned && place.turned >= -0.2)) continue;
    points.push_back(any_turned ? place.opposite : place.corner);
  }
  return points;
}

}  // namespace

TriangleMesh dual_mesh(const std::vector<Vec3>& seeds, const RestrictedPolygons& polygons) {
  TriangleMesh mesh;
  mesh.triangles = extract_dual(polygons).triangles;
  std::vector<Index> index(seeds.size(), kNone);
  for (const Triangle& t : mesh.triangles)
    for (Index v : t) index[v] = 0;
  for (std::size_t v = 0; v < seeds.size(); ++v)
    if (index[v] != kNone) {
      index[v] = static_cast<Index>(mesh.vertices.size());
      mesh.vertices.push_back(seeds[v]);
    }
  for (Triangle& t : mesh.triangles)
    for (Index& v : t) v = index[v];
  return mesh;
}

bool same_topology(const MeshTopology& dual, const MeshTopology& input) {
  return dual.manifold && dual.oriented && dual.closed == input.closed && dual.euler == input.euler &&
         dual.components == input.components;
}

void enforce_topology(Backend& backend, CvtState& state, RestrictedPolygons& polygons, const MeshTopology& input,
                      OptimiseOptions options, OptimiseTotals& totals, const Context& context) {
  options.done = 1;
  options.share = 0;
  const std::size_t most = state.seeds.size() + state.seeds.size() / 4 + kMostAdded;
  std::vector<Vec3> best;
  std::size_t fewest = std::numeric_limits<std::size_t>::max();
  for (int round = 0;; ++round) {
    const std::size_t count = state.seeds.size();
    backend.evaluate(state.seeds, state.moments, polygons);
    if (!input.manifold || !input.oriented) return;
    const Dual dual = extract_dual(polygons);
    if (same_topology(analyse_topology(dual.triangles, count), input)) return;
    const std::vector<Index> cells = broken_cells(dual, count, input.closed);
    if (cells.size() < fewest) {
      fewest = cells.size();
      best = state.seeds;
    }
    std::vector<Vec3> points = repair_points(backend.surface(), polygons, state.seeds, cells);
    points.resize(std::min(points.size(), count / 4));
    if (points.empty() || round == kRounds || count + points.size() > most) break;
    options.iterations = std::max(kLastSteps, kFirstSteps * (kRounds - 2 * round) / kRounds);
    options.phase = "topology, round " + std::to_string(round + 1);
    if (round < kMovingRounds) set_count(polygons, state.moments, count - points.size(), state.seeds);
    state.seeds.insert(state.seeds.end(), points.begin(), points.end());
    optimise(backend, state, options, totals, context);
  }
  // No round did it: the one that came nearest is the result.
  state.seeds = best;
  options.iterations = 0;
  optimise(backend, state, options, totals, context);
  backend.evaluate(state.seeds, state.moments, polygons);
}

}  // namespace bisector
