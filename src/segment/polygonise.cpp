#include "segment/polygonise.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <set>
#include <utility>
#include <variant>

#include "bisector/error.h"
#include "bisector/quality.h"
#include "core/grouping.h"
#include "mesh/half_edges.h"
#include "mesh/topology.h"
#include "segment/border_loops.h"
#include "segment/collapse.h"
#include "segment/meeting_point.h"
#include "segment/planar_patch.h"
#include "segment/primitive.h"

namespace bisector {
namespace {

// Where corners fold a region or make polygons cross, vertices go back towards the mesh, by halves.
constexpr int kHalvings = 4;
// And regions that stay folded or cross others get more corners.
constexpr int kRefinements = 6;
constexpr double kFinerChord = 0.25;

using Edge = std::array<Index, 2>;

class Polygoniser {
 public:
  Polygoniser(const TriangleMesh& mesh, const SegmentResult& segmentation, const RegionBorders& borders,
              const PolygoniseOptions& options)
      : mesh_(mesh), segmentation_(segmentation), options_(options), borders_(borders), positions_(mesh.vertices),
        fixed_(mesh.vertices.size(), 0), regions_(segmentation.regions.size()) {
    for (std::size_t r = 0; r < regions_.size(); ++r) {
      const auto* plane = std::get_if<Plane>(&segmentation.regions[r].proxy);
      if (plane == nullptr) continue;
      regions_[r].plane = *plane;
      regions_[r].normal = borders_.regions[r].same_sense ? plane->normal : -plane->normal;
    }
  }

  PolygonisedMesh run() {
    keep_curved_and_non_manifold();
    place_vertices();
    const std::vector<Vec3> placed = positions_;
    remove_inner_vertices();
    simplify();
    if (flaws() > 0) refine(placed);
    separate_edges();
    return result();
  }

 private:
  struct Region {
    std::optional<Plane> plane;
    Vec3 normal;  // on the side that the triangles face; zero for other surfaces
    std::vector<std::vector<Index>> loops;
    std::vector<Triangle> triangles;
    bool has_handles = false, is_folded = false, crosses = false;
    double chord = 1;  // share of the options'
  };

  struct Simplified {
    std::vector<Vec3> positions;
    std::vector<Region> regions;
    LabelledTriangles triangles;
  };

  // Regions that their corners fold, or that cross others, get more of them, and in the end those for which that was of
  // no use get none. Of all these the one with the fewest crossing regions is kept, then with the fewest faces.
  void refine(const std::vector<Vec3>& placed) {
    const auto cost = [&] { return std::pair(crossing(), faces()); };
    auto least = cost();
    Simplified best{positions_, regions_, coarse_};
    const auto simplify_with = [&](double factor) {
      for (Region& region : regions_)
        if (region.is_folded || region.crosses) region.chord = std::min(1.0, factor * region.chord);
      positions_ = placed;
      simplify();
      if (!(cost() < least)) return;
      least = cost();
      best = {positions_, regions_, coarse_};
    };
    for (int k = 0; k < kRefinements && flaws() > 0; ++k) simplify_with(kFinerChord);
    if (flaws() > 0) simplify_with(1 / std::pow(kFinerChord, kRefinements));
    positions_ = std::move(best.positions);
    regions_ = std::move(best.regions);
    coarse_ = std::move(best.triangles);
  }

  // What all choices of anchors have in common.
  void remove_inner_vertices() {
    kept_ = fixed_;
    for (const BorderChain& chain : borders_.chains)
      for (const Index v : chain.vertices) kept_[v] = 1;
    without_inner_ = {borders_.triangles, segmentation_.labels};
    collapse_vertices(positions_, kept_, normals(), without_inner_);
  }

  std::vector<Vec3> normals() const {
    std::vector<Vec3> normals;
    for (const Region& region : regions_) normals.push_back(region.normal);
    return normals;
  }

  void simplify() {
    kept_ = fixed_;
    coarse_ = without_inner_;
    keep_anchors();
    collapse_vertices(positions_, kept_, normals(), coarse_);
    find_loops();
    fill_regions();
    for (int k = 0; k < kHalvings && draw_back(k + 1 == kHalvings); ++k) fill_regions();
    find_crossings();
  }

  // But for holes: one for each region, or as many as it has triangles.
  std::size_t faces() const {
    std::size_t count = 0;
    for (const Region& region : regions_) count += region.plane && !region.is_folded ? 1 : region.triangles.size();
    return count;
  }

  std::size_t crossing() const {
    return static_cast<std::size_t>(
        std::count_if(regions_.begin(), regions_.end(), [](const Region& region) { return region.crosses; }));
  }

  std::size_t flaws() const {
    return static_cast<std::size_t>(std::count_if(
        regions_.begin(), regions_.end(), [](const Region& region) { return region.is_folded || region.crosses; }));
  }

  // Other surfaces keep their triangles, and so does what is no manifold.
  void keep_curved_and_non_manifold() {
    const std::size_t n = positions_.size();
    const std::vector<Triangle>& triangles = borders_.triangles;
    for (std::size_t t = 0; t < triangles.size(); ++t)
      if (!regions_[segmentation_.labels[t]].plane)
        for (const Index v : triangles[t]) fixed_[v] = 1;
    const HalfEdgeTwins twins = half_edge_twins(triangles, n);
    for (std::size_t h = 0; h < twins.twin.size(); ++h) {
      if (twins.twin[h] != kNoTwin || twins.is_single[h]) continue;
      for (const std::size_t end : {h, next_half_edge(h)}) fixed_[origin(triangles, end)] = 1;
    }
    const std::vector<char> split = split_vertices(triangles, n);
    for (std::size_t v = 0; v < n; ++v) fixed_[v] |= split[v];
  }

  void place_vertices() {
    const Csr<Index> at_vertex = items_at_vertices<Index>(borders_.triangles, positions_.size());
    const std::vector<Vec3> old = positions_;
    for (std::size_t v = 0; v < old.size(); ++v) {
      if (at_vertex.size(v) == 0) continue;
      std::set<Index> around;
      double length = 0;
      std::size_t edges = 0;
      for (const Index* t = at_vertex.begin(v); t != at_vertex.end(v); ++t) {
        around.insert(segmentation_.labels[*t]);
        for (const Index w : borders_.triangles[*t]) length += norm(old[w] - old[v]);
        edges += 2;
      }
      const bool is_flat = std::all_of(around.begin(), around.end(), [&](Index r) { return regions_[r].plane; });
      if (!is_flat) continue;
      std::vector<MeetingSurface> planes;
      for (const Index r : around) planes.push_back({&segmentation_.regions[r].proxy, segmentation_.regions[r].rms});
      positions_[v] = meeting_point(old[v], planes, length / static_cast<double>(edges));
    }
  }

  // Anchors are the ends of chains, two vertices of those that have no ends, and where a chain strays from its chord.
  void keep_anchors() {
    for (const BorderChain& chain : borders_.chains) {
      std::vector<Index> path = chain.vertices;
      const double bend = bend_of(chain);
      if (!chain.closed) {
        kept_[path.front()] = kept_[path.back()] = 1;
        divide(path, 0, path.size() - 1, bend);
        continue;
      }
      const std::size_t first = farthest_from(path, centre_of(path));
      std::rotate(path.begin(), path.begin() + static_cast<std::ptrdiff_t>(first), path.end());
      const std::size_t second = farthest_from(path, positions_[path[0]]);
      path.push_back(path[0]);
      kept_[path[0]] = kept_[path[second]] = 1;
      divide(path, 0, second, bend);
      divide(path, second, path.size() - 1, bend);
    }
  }

  // The sine of the angle between the planes, larger for regions that want more corners.
  double bend_of(const BorderChain& chain) const {
    const Region& left = regions_[chain.left];
    if (chain.right == kNone) return 1 / left.chord;
    const Region& right = regions_[chain.right];
    return norm(cross(left.normal, right.normal)) / std::min(left.chord, right.chord);
  }

  Vec3 centre_of(const std::vector<Index>& path) const {
    Vec3 sum;
    for (const Index v : path) sum += positions_[v];
    return (1 / static_cast<double>(path.size())) * sum;
  }

  std::size_t farthest_from(const std::vector<Index>& path, const Vec3& p) const {
    std::size_t best = 0;
    for (std::size_t i = 1; i < path.size(); ++i)
      if (norm2(positions_[path[i]] - p) > norm2(positions_[path[best]] - p)) best = i;
    return best;
  }

  void divide(const std::vector<Index>& path, std::size_t begin, std::size_t end, double bend) {
    std::vector<std::array<std::size_t, 2>> stack{{begin, end}};
    while (!stack.empty()) {
      const auto [from, to] = stack.back();
      stack.pop_back();
      const Vec3 &a = positions_[path[from]], &b = positions_[path[to]];
      double most = 0;
      std::size_t middle = from;
      for (std::size_t i = from + 1; i < to; ++i) {
        const Vec3& p = positions_[path[i]];
        const double d = norm(p - nearest_on_segment(p, a, b));
        if (d <= most) continue;
        most = d;
        middle = i;
      }
      if (middle == from || !(bend * most > options_.chord * norm(b - a))) continue;
      kept_[path[middle]] = 1;
      stack.push_back({middle, to});
      stack.push_back({from, middle});
    }
  }

  void find_loops() {
    const RegionBorders coarse =
        follow_borders(coarse_.triangles, positions_.size(), coarse_.labels, regions_.size()).borders;
    for (std::size_t r = 0; r < regions_.size(); ++r) {
      regions_[r].loops.clear();
      for (const BorderLoop& loop : coarse.regions[r].loops) regions_[r].loops.push_back(loop.vertices);
      regions_[r].has_handles = coarse.regions[r].euler != 2 - static_cast<long long>(coarse.regions[r].loops.size());
    }
  }

  // Planar regions are triangulated in their planes, where their corners let them.
  void fill_regions() {
    const Csr<Index> of_region = items_of_labels<Index>(coarse_.labels, regions_.size());
    std::vector<std::array<double, 2>> points(positions_.size());
    for (std::size_t r = 0; r < regions_.size(); ++r) {
      Region& region = regions_[r];
      region.triangles.clear();
      if (region.plane && !region.has_handles) {
        const auto [u, w] = frame_across(region.normal);
        for (const std::vector<Index>& loop : region.loops)
          for (const Index v : loop) points[v] = {dot(positions_[v], u), dot(positions_[v], w)};
        region.triangles = triangulate_loops(region.loops, points);
      }
      region.is_folded = region.plane && region.triangles.empty();
      if (!region.triangles.empty()) continue;
      for (const Index* t = of_region.begin(r); t != of_region.end(r); ++t)
        region.triangles.push_back(coarse_.triangles[*t]);
    }
  }

  // Vertices of the triangles that cross others; notes their regions.
  std::set<Index> find_crossings() {
    TriangleMesh made{positions_, {}};
    std::vector<std::size_t> region_of;
    for (std::size_t r = 0; r < regions_.size(); ++r) {
      regions_[r].crosses = false;
      made.triangles.insert(made.triangles.end(), regions_[r].triangles.begin(), regions_[r].triangles.end());
      region_of.resize(made.triangles.size(), r);
    }
    std::set<Index> vertices;
    for (const auto& pair : find_self_intersections(made))
      for (const Index t : pair) {
        regions_[region_of[t]].crosses = true;
        vertices.insert(made.triangles[t].begin(), made.triangles[t].end());
      }
    return vertices;
  }

  // Moves vertices of folded regions, and of triangles that cross, halfway back to the mesh, or all the way. False if
  // there are none.
  bool draw_back(bool all_the_way) {
    std::set<Index> moved = find_crossings();
    for (const Region& region : regions_) {
      if (!region.is_folded) continue;
      for (const std::vector<Index>& loop : region.loops) moved.insert(loop.begin(), loop.end());
    }
    for (const Index v : moved)
      positions_[v] = all_the_way ? mesh_.vertices[v] : 0.5 * (positions_[v] + mesh_.vertices[v]);
    return !moved.empty();
  }

  // Diagonals of planar regions may join vertices that another edge joins already: these give way to the other diagonal
  // of their two triangles, or get a vertex in the middle.
  void separate_edges() {
    std::set<Edge> taken;
    for (const Region& region : regions_) {
      for (const std::vector<Index>& loop : region.loops)
        for (std::size_t i = 0; i < loop.size(); ++i) taken.insert(ascending(loop[i], loop[(i + 1) % loop.size()]));
      if (region.plane && !region.is_folded) continue;
      for (const Triangle& t : region.triangles)
        for (std::size_t k = 0; k < 3; ++k) taken.insert(ascending(t[k], t[(k + 1) % 3]));
    }
    for (Region& region : regions_) {
      if (!region.plane || region.is_folded) continue;
      std::set<Edge> own;
      for (const std::vector<Index>& loop : region.loops)
        for (std::size_t i = 0; i < loop.size(); ++i) own.insert(ascending(loop[i], loop[(i + 1) % loop.size()]));
      std::vector<Edge> twice;
      for (const Triangle& t : region.triangles)
        for (std::size_t k = 0; k < 3; ++k) {
          const Edge e = ascending(t[k], t[(k + 1) % 3]);
          if (own.insert(e).second && !taken.insert(e).second) twice.push_back(e);
        }
      for (const Edge& e : twice) {
        if (const std::optional<Edge> other = flip(region, e, taken)) taken.insert(*other);
        else divide_edge(region.triangles, e);
      }
    }
  }

  // The other diagonal of the two triangles at e, if it lies inside them and joins what no edge joins.
  std::optional<Edge> flip(Region& region, const Edge& e, const std::set<Edge>& taken) const {
    std::array<std::size_t, 2> sides{};
    std::array<Index, 2> across{};
    for (std::size_t t = 0; t < region.triangles.size(); ++t)
      for (std::size_t k = 0; k < 3; ++k) {
        const Triangle& v = region.triangles[t];
        if (ascending(v[k], v[(k + 1) % 3]) != e) continue;
        const std::size_t side = v[k] == e[0] ? 0 : 1;  // the first triangle has e in its own direction
        sides[side] = t;
        across[side] = v[(k + 2) % 3];
      }
    const Edge other = ascending(across[0], across[1]);
    if (taken.contains(other)) return std::nullopt;
    const Triangle first{e[0], across[1], across[0]}, second{across[1], e[1], across[0]};
    for (const Triangle& t : {first, second})
      if (!(dot(region.normal, twice_area_normal(positions_[t[0]], positions_[t[1]], positions_[t[2]])) > 0))
        return std::nullopt;
    region.triangles[sides[0]] = first;
    region.triangles[sides[1]] = second;
    return other;
  }

  void divide_edge(std::vector<Triangle>& triangles, const Edge& e) {
    const auto middle = static_cast<Index>(positions_.size());
    positions_.push_back(0.5 * (positions_[e[0]] + positions_[e[1]]));
    for (std::size_t t = 0, n = triangles.size(); t < n; ++t)
      for (std::size_t k = 0; k < 3; ++k) {
        const Index a = triangles[t][k], b = triangles[t][(k + 1) % 3], c = triangles[t][(k + 2) % 3];
        if (ascending(a, b) != e) continue;
        triangles[t] = {a, middle, c};
        triangles.push_back({middle, b, c});
        break;
      }
  }

  // A region's polygons: itself if it is one, else its triangles joined across the longest edges first, as long as
  // polygons stay simple.
  std::vector<std::vector<Index>> polygons_of(const Region& region) const {
    if (region.plane && !region.is_folded && region.loops.size() == 1) {
      std::vector<Index> corners = region.loops[0];
      std::sort(corners.begin(), corners.end());
      if (std::adjacent_find(corners.begin(), corners.end()) == corners.end()) return {region.loops[0]};
    }
    std::vector<std::vector<Index>> polygons;
    for (const Triangle& t : region.triangles) polygons.emplace_back(t.begin(), t.end());
    if (region.plane && !region.is_folded) join_polygons(polygons);
    return polygons;
  }

  void join_polygons(std::vector<std::vector<Index>>& polygons) const {
    std::vector<std::pair<double, Edge>> diagonals;
    std::set<Edge> once;
    for (const std::vector<Index>& polygon : polygons)
      for (std::size_t i = 0; i < polygon.size(); ++i) {
        const Edge e = ascending(polygon[i], polygon[(i + 1) % polygon.size()]);
        if (!once.insert(e).second) diagonals.push_back({-norm2(positions_[e[1]] - positions_[e[0]]), e});
      }
    std::sort(diagonals.begin(), diagonals.end());
    for (const auto& [length, e] : diagonals) {
      std::array<std::vector<Index>*, 2> sides{};
      for (std::vector<Index>& polygon : polygons)
        for (std::size_t i = 0; i < polygon.size(); ++i)
          if (ascending(polygon[i], polygon[(i + 1) % polygon.size()]) == e) {
            // Each side starts with the edge's far end.
            std::rotate(polygon.begin(), polygon.begin() + static_cast<std::ptrdiff_t>((i + 1) % polygon.size()),
                        polygon.end());
            sides[sides[0] != nullptr] = &polygon;
            break;
          }
      if (sides[1] == nullptr || sides[0] == sides[1]) continue;
      std::vector<Index> joined(sides[0]->begin(), sides[0]->end());
      joined.insert(joined.end(), sides[1]->begin() + 1, sides[1]->end() - 1);
      std::vector<Index> corners = joined;
      std::sort(corners.begin(), corners.end());
      if (std::adjacent_find(corners.begin(), corners.end()) != corners.end()) continue;
      *sides[0] = std::move(joined);
      polygons.erase(polygons.begin() + (sides[1] - polygons.data()));
    }
  }

  // The vertices of polygons in the mesh's order, then those that triangles alone have.
  PolygonisedMesh result() const {
    PolygonisedMesh mesh;
    for (std::size_t r = 0; r < regions_.size(); ++r) {
      const std::vector<std::vector<Index>> polygons = polygons_of(regions_[r]);
      mesh.divided += regions_[r].plane && !regions_[r].is_folded && polygons.size() > 1;
      mesh.folded += regions_[r].is_folded;
      for (const std::vector<Index>& polygon : polygons) {
        mesh.polygons.values.insert(mesh.polygons.values.end(), polygon.begin(), polygon.end());
        mesh.polygons.offsets.push_back(mesh.polygons.values.size());
        mesh.labels.push_back(static_cast<Index>(r));
      }
      for (const Triangle& t : regions_[r].triangles) {
        mesh.triangulated.triangles.push_back(t);
        mesh.triangulated.labels.push_back(static_cast<std::int32_t>(r));
      }
    }
    std::vector<Index> number(positions_.size(), kNone);
    for (const Index v : mesh.polygons.values) number[v] = 0;
    for (std::size_t v = 0; v < number.size(); ++v) {
      if (number[v] == kNone) continue;
      number[v] = static_cast<Index>(mesh.vertices.size());
      mesh.vertices.push_back(positions_[v]);
    }
    for (Index& v : mesh.polygons.values) v = number[v];
    mesh.triangulated.vertices = mesh.vertices;
    for (Triangle& t : mesh.triangulated.triangles)
      for (Index& v : t) {
        if (number[v] == kNone) {
          number[v] = static_cast<Index>(mesh.triangulated.vertices.size());
          mesh.triangulated.vertices.push_back(positions_[v]);
        }
        v = number[v];
      }
    mesh.self_intersections = count_self_intersections(mesh.triangulated);
    return mesh;
  }

  const TriangleMesh& mesh_;
  const SegmentResult& segmentation_;
  const PolygoniseOptions& options_;
  const RegionBorders& borders_;
  std::vector<Vec3> positions_;
  std::vector<char> fixed_, kept_;  // vertices that stay whatever happens, and these with the anchors
  std::vector<Region> regions_;
  LabelledTriangles without_inner_, coarse_;  // without vertices inside regions, and without those between anchors
};

}  // namespace

PolygonisedMesh polygonise(const TriangleMesh& mesh, const SegmentResult& segmentation, const RegionBorders& borders,
                           const PolygoniseOptions& options) {
  if (!(options.chord > 0) || !std::isfinite(options.chord))
    throw Error(fmt::format("borders may stray from chords by {} of their length; it must be positive", options.chord));
  return Polygoniser(mesh, segmentation, borders, options).run();
}

PolygonisedMesh polygonise(const TriangleMesh& mesh, const SegmentResult& segmentation,
                           const PolygoniseOptions& options) {
  return polygonise(mesh, segmentation, region_borders(mesh, segmentation), options);
}

}  // namespace bisector
