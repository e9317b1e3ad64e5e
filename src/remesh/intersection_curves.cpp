#include "remesh/intersection_curves.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <utility>

#include "core/geometry.h"
#include "features/curves.h"
#include "mesh/edge_splitter.h"
#include "mesh/topology.h"
#include "remesh/kept.h"

namespace bisector {
namespace {

using Edge = std::array<Index, 2>;

// Of the edge length: how near to a vertex of the curve a corner is put there.
constexpr double kAtVertex = 0.02;
// Of an edge: how near others may come to it, and how far the curve away from it.
constexpr double kLeastGap = 0.15, kMostBend = 0.5;
constexpr double kLeastCosine = 0.966;  // of 15 degrees between two edges

// An edge of the mesh on one of the components that have it.
struct Copy {
  Index component;
  Edge ends;  // of the mesh, at the points of the common edge's ends
};

// The lines that components have in common, as a graph over the first vertex at each point.
class Network {
 public:
  Network(const Corefinement& cut, const std::vector<Edge>& left_out) {
    const TriangleMesh& mesh = cut.mesh;
    const CommonParts common = find_common_parts(mesh, cut.overlapping);
    if (common.edges.empty()) return;
    const std::vector<Index> component = label_components(mesh.triangles, mesh.vertices.size());
    for (const Triangle& t : mesh.triangles)
      for (std::size_t k = 0; k < 3; ++k) {
        const Index a = t[k], b = t[(k + 1) % 3], p = common.same[a], q = common.same[b];
        if (p == kNone || q == kNone ||
            !std::binary_search(common.edges.begin(), common.edges.end(), sorted_edge(p, q)))
          continue;
        std::vector<Copy>& copies = copies_[sorted_edge(p, q)];
        const Copy copy{component[a], p < q ? Edge{a, b} : Edge{b, a}};
        const auto same =
            std::find_if(copies.begin(), copies.end(), [&](const Copy& c) { return c.component == copy.component; });
        if (same == copies.end()) copies.push_back(copy);
      }
    const std::set<Edge> go(left_out.begin(), left_out.end());
    std::erase_if(copies_, [&](const auto& item) {
      return std::any_of(item.second.begin(), item.second.end(),
                         [&](const Copy& copy) { return go.contains(sorted_edge(copy.ends[0], copy.ends[1])); });
    });
    for (auto& [edge, copies] : copies_) {
      std::sort(copies.begin(), copies.end(), [](const Copy& a, const Copy& b) { return a.component < b.component; });
      for (const Index end : edge) beside_[end].push_back(edge);
      for (const Copy& copy : copies) {
        edges_.push_back(sorted_edge(copy.ends[0], copy.ends[1]));
        for (std::size_t k = 0; k < 2; ++k) point_of_[copy.ends[k]] = edge[k];
      }
    }
    std::sort(edges_.begin(), edges_.end());
    edges_.erase(std::unique(edges_.begin(), edges_.end()), edges_.end());
  }

  // Of the mesh, sorted.
  const std::vector<Edge>& edges() const { return edges_; }
  bool has(Index a, Index b) const { return std::binary_search(edges_.begin(), edges_.end(), sorted_edge(a, b)); }

  // Curves end at this vertex, and at those of other components at its point.
  void end_at(Index vertex) {
    if (const auto at = point_of_.find(vertex); at != point_of_.end()) nodes_.insert(at->second);
  }
  void end_at_branchings() {
    for (const auto& [point, edges] : beside_)
      if (edges.size() != 2 || components_of(edges[0]) != components_of(edges[1])) nodes_.insert(point);
  }
  // Vertices of the mesh.
  std::vector<Index> ends() const {
    std::vector<Index> found;
    for (const auto& [vertex, point] : point_of_)
      if (nodes_.contains(point)) found.push_back(vertex);
    return found;
  }

  struct Path {
    std::vector<Index> points;
    bool closed = false;
  };
  std::vector<Path> paths() const {
    std::vector<Path> found;
    std::set<Edge> taken;
    const auto follow = [&](Index from, Edge edge) {
      Path path{{from}, false};
      while (taken.insert(edge).second) {
        const Index to = edge[0] == path.points.back() ? edge[1] : edge[0];
        if (to == from && !nodes_.contains(from)) {
          path.closed = true;
          break;
        }
        path.points.push_back(to);
        if (nodes_.contains(to)) break;
        const std::vector<Edge>& next = beside_.at(to);
        edge = next[0] == edge ? next[1] : next[0];
      }
      found.push_back(std::move(path));
    };
    for (const Index node : nodes_)
      for (const Edge& edge : beside_.at(node))
        if (!taken.contains(edge)) follow(node, edge);
    for (const auto& [point, edges] : beside_)
      for (const Edge& edge : edges)
        if (!taken.contains(edge)) follow(point, edge);
    return found;
  }
  // The vertices along a path on each of the components, none if they do not hang together: a component may have
  // several at a point.
  std::vector<std::vector<Index>> copies_along(const Path& path) const {
    const std::vector<Index>& on = path.points;
    std::vector<std::vector<Index>> found;
    for (std::size_t k = 0; k + (path.closed ? 0 : 1) < on.size(); ++k) {
      const Index from = on[k], to = on[(k + 1) % on.size()];
      const std::vector<Copy>& copies = copies_.at(sorted_edge(from, to));
      const std::size_t start = from < to ? 0 : 1;
      if (k == 0)
        for (const Copy& copy : copies) found.push_back({copy.ends[start]});
      for (std::size_t c = 0; c < found.size(); ++c) {
        if (found[c].back() != copies[c].ends[start]) return {};
        found[c].push_back(copies[c].ends[1 - start]);
      }
    }
    for (std::vector<Index>& copy : found) {
      if (!path.closed) continue;
      if (copy.back() != copy.front()) return {};
      copy.pop_back();
    }
    return found;
  }

 private:
  std::vector<Index> components_of(const Edge& edge) const {
    std::vector<Index> found;
    for (const Copy& copy : copies_.at(edge)) found.push_back(copy.component);
    return found;
  }

  std::map<Edge, std::vector<Copy>> copies_;
  std::map<Index, std::vector<Edge>> beside_;  // edges at each point
  std::map<Index, Index> point_of_;            // of vertices of the mesh
  std::vector<Edge> edges_;
  std::set<Index> nodes_;
};

// The parts of a curve that are no edges of the network.
std::vector<FeatureCurve> parts_beside(const FeatureCurve& curve, const Network& network) {
  std::vector<Index> on = curve.vertices;
  if (curve.closed) {
    std::size_t first = 0;
    while (first < on.size() && !network.has(on[first], on[(first + 1) % on.size()])) ++first;
    if (first == on.size()) return {curve};
    std::rotate(on.begin(), on.begin() + static_cast<std::ptrdiff_t>(first), on.end());
    on.push_back(Index{on.front()});
  }
  std::vector<FeatureCurve> parts;
  bool goes_on = false;
  for (std::size_t k = 0; k + 1 < on.size(); ++k) {
    if (network.has(on[k], on[k + 1])) {
      goes_on = false;
      continue;
    }
    if (!goes_on) parts.push_back({{on[k]}, false, curve.kind});
    parts.back().vertices.push_back(on[k + 1]);
    goes_on = true;
  }
  return parts;
}

FeatureGraph features_beside(const FeatureGraph& features, const Network& network) {
  FeatureGraph rest;
  rest.corners = features.corners;
  for (const FeatureCurve& curve : features.curves)
    for (FeatureCurve& part : parts_beside(curve, network)) rest.curves.push_back(std::move(part));
  return rest;
}

}  // namespace

IntersectionCurves::IntersectionCurves(const Corefinement& cut, const std::vector<Edge>& left_out,
                                       FeatureGraph& features)
    : vertices_(cut.mesh.vertices.size()) {
  Network network(cut, left_out);
  if (network.edges().empty()) return;
  FeatureGraph all = features_beside(features, network);
  FeatureOptions turns;
  turns.mode = FeatureMode::none;
  turns.given = network.edges();
  network.end_at_branchings();
  for (const Index corner : detect_features(cut.mesh, turns).corners) network.end_at(corner);
  for (const Index corner : all.corners) network.end_at(corner);
  for (const FeatureCurve& curve : all.curves)
    for (const Index v : curve.vertices) network.end_at(v);
  for (const Network::Path& path : network.paths())
    if (Curve curve{network.copies_along(path), path.closed}; !curve.copies.empty())
      curves_.push_back(std::move(curve));
  for (FeatureCurve& curve : copies()) all.curves.push_back(std::move(curve));
  std::vector<Index> corners = network.ends();
  for (const FeatureCurve& curve : all.curves)
    if (!curve.closed) corners.insert(corners.end(), {curve.vertices.front(), curve.vertices.back()});
  add_corners(all, corners);
  all.edges = edges_of(all.curves);
  features = std::move(all);
  edges_ = edges_of(copies());
}

double IntersectionCurves::length(const TriangleMesh& mesh) const {
  double sum = 0;
  for (const auto& [a, b] : edges_) sum += norm(mesh.vertices[b] - mesh.vertices[a]);
  return sum;
}

void IntersectionCurves::put_into(FeatureGraph& simplified) const {
  std::set<Index> ends;
  std::vector<FeatureCurve> others;
  for (FeatureCurve& curve : simplified.curves) {
    if (curve.kind == FeatureKind::intersection) continue;
    if (!curve.closed) ends.insert({curve.vertices.front(), curve.vertices.back()});
    others.push_back(std::move(curve));
  }
  for (FeatureCurve& curve : copies()) {
    if (!curve.closed) ends.insert({curve.vertices.front(), curve.vertices.back()});
    others.push_back(std::move(curve));
  }
  simplified.curves = std::move(others);
  add_corners(simplified, {ends.begin(), ends.end()});
  drop_doubled(simplified);
}

// Curves that are led along these (features/simplify.h) end at the first corner.
void IntersectionCurves::drop_doubled(FeatureGraph& features) const {
  const std::vector<char> is_among = among(features);
  std::size_t k = 0;
  std::erase_if(features.curves,
                [&](const FeatureCurve& curve) { return is_among[k++] && curve.kind != FeatureKind::intersection; });
  features.edges = edges_of(features.curves);
}

std::vector<FeatureCurve> IntersectionCurves::copies() const {
  std::vector<FeatureCurve> all;
  for (const Curve& curve : curves_)
    for (const std::vector<Index>& copy : curve.copies) {
      std::vector<Index>& on = all.emplace_back(FeatureCurve{{}, curve.closed, FeatureKind::intersection}).vertices;
      for (std::size_t k = 0; k < curve.edges(); ++k) {
        const std::vector<Index> chain = edge_chain(splits_, copy[k], copy[(k + 1) % copy.size()]);
        on.insert(on.end(), chain.begin(), chain.end() - 1);
      }
      if (!curve.closed) on.push_back(copy.back());
    }
  return all;
}

void IntersectionCurves::follow(const EdgeSplits& splits) {
  splits_.insert(splits_.end(), splits.begin(), splits.end());
  std::sort(splits_.begin(), splits_.end());
  for (const auto& [a, b, middle] : splits) vertices_ = std::max(vertices_, std::size_t{middle} + 1);
  edges_ = edges_of(copies());
}

// The shortest that is wanted on any of the components, where their refined edges begin and end.
std::vector<IntersectionCurves::Station> IntersectionCurves::stations(const Curve& curve, const SizedMesh& sized,
                                                                      const EdgeSplits& splits) {
  std::vector<Station> found;
  for (std::size_t k = 0; k < curve.edges(); ++k) {
    std::vector<std::vector<Station>> copies;
    for (const std::vector<Index>& copy : curve.copies) {
      const Index from = copy[k], to = copy[(k + 1) % copy.size()];
      const Vec3 &a = sized.mesh.vertices[from], &b = sized.mesh.vertices[to];
      const double length = norm(b - a);
      std::vector<Station>& along = copies.emplace_back();
      for (const Index v : edge_chain(splits, from, to))
        along.push_back({v == from ? 0
                         : v == to ? 1
                                   : norm(sized.mesh.vertices[v] - a) / length,
                         target_edge_length(sized.sizing, v)});
    }
    std::vector<double> places;
    for (const std::vector<Station>& along : copies)
      for (const Station& station : along) places.push_back(station.place);
    std::sort(places.begin(), places.end());
    places.erase(std::unique(places.begin(), places.end()), places.end());
    for (const double place : places) {
      if (place == 0 && k > 0) continue;  // the end of the edge before
      double least = std::numeric_limits<double>::infinity();
      for (const std::vector<Station>& along : copies) {
        const auto next = std::find_if(along.begin() + 1, along.end() - 1,
                                       [&](const Station& station) { return station.place >= place; });
        const auto last = next - 1;
        const double t = (place - last->place) / (next->place - last->place);
        least = std::min(least, last->length + t * (next->length - last->length));
      }
      found.push_back({static_cast<double>(k) + place, least});
    }
  }
  return found;
}

// Of the corners along the polyline, both ends included, in its edges: at a vertex if the place is a whole number.
std::vector<double> IntersectionCurves::corner_places(const Curve& curve, const SizedMesh& sized,
                                                      const EdgeSplits& splits, std::size_t least) {
  const std::vector<Index>& on = curve.copies[0];
  const std::vector<Station> stations_along = stations(curve, sized, splits);
  // How many edges of the result it is to each of them, and to each vertex.
  std::vector<double> way{0}, way_to_vertex{0};
  for (std::size_t i = 1; i < stations_along.size(); ++i) {
    const Station &last = stations_along[i - 1], &next = stations_along[i];
    const auto k = static_cast<std::size_t>(last.place);
    const Vec3 edge = sized.mesh.vertices[on[(k + 1) % on.size()]] - sized.mesh.vertices[on[k]];
    way.push_back(way.back() + 2 * (next.place - last.place) * norm(edge) / (last.length + next.length));
    if (next.place == std::floor(next.place)) way_to_vertex.push_back(way.back());
  }
  const std::size_t count = std::max(least, static_cast<std::size_t>(std::lround(way.back())));
  std::vector<double> places{0};
  for (std::size_t i = 1; i < count; ++i) {
    const double at = way.back() * static_cast<double>(i) / static_cast<double>(count);
    const auto after = static_cast<std::size_t>(std::upper_bound(way.begin(), way.end() - 1, at) - way.begin());
    const Station &last = stations_along[after - 1], &next = stations_along[after];
    const double place = last.place + (at - way[after - 1]) / (way[after] - way[after - 1]) * (next.place - last.place);
    const auto vertex = static_cast<std::size_t>(std::lround(place));
    places.push_back(std::abs(at - way_to_vertex[vertex]) < kAtVertex ? static_cast<double>(vertex) : place);
  }
  places.push_back(static_cast<double>(curve.edges()));
  return places;
}

IntersectionCurves::Division IntersectionCurves::divide(TriangleMesh& mesh, FeatureGraph& features,
                                                        const SizedMesh& sized) {
  Division division;
  EdgeSplits refined = splits_;
  refined.insert(refined.end(), sized.splits.begin(), sized.splits.end());
  std::sort(refined.begin(), refined.end());
  std::vector<Index> all_corners;
  const std::size_t before = mesh.vertices.size();
  std::vector<Piece> pieces;
  EdgeSplitter splitter(mesh);
  std::map<Edge, Index> part;
  for (const auto& [a, b, middle] : splits_) part[{a, b}] = middle;
  // The vertex at a point of an edge; there is one afterwards.
  const auto put = [&](Index a, Index b, const Vec3& p) {
    const Vec3 along = mesh.vertices[b] - mesh.vertices[a];
    for (auto at = part.find(sorted_edge(a, b)); at != part.end(); at = part.find(sorted_edge(a, b))) {
      const Index middle = at->second;
      if (mesh.vertices[middle] == p) return middle;
      (dot(p - mesh.vertices[middle], along) > 0 ? a : b) = middle;
    }
    const double t = norm(p - mesh.vertices[a]) / norm(mesh.vertices[b] - mesh.vertices[a]);
    const Index middle = splitter.split(a, b, t);
    mesh.vertices[middle] = p;
    part[sorted_edge(a, b)] = middle;
    division.added.push_back({a, b, t});
    return middle;
  };
  std::map<Edge, std::size_t> between;  // curves from one point to another
  for (const Curve& curve : curves_)
    if (!curve.closed) ++between[sorted_edge(curve.copies[0].front(), curve.copies[0].back())];
  for (const Curve& curve : curves_) {
    const std::vector<Index>& on = curve.copies[0];
    const bool loop = curve.closed || on.front() == on.back();
    const std::size_t least = loop ? 3 : between[sorted_edge(on.front(), on.back())] > 1 ? 2 : 1;
    const std::vector<double> places = corner_places(curve, sized, refined, least);
    std::vector<std::vector<Index>> corners(curve.copies.size());
    for (const double place : places) {
      const auto k = static_cast<std::size_t>(place);
      const double t = place - static_cast<double>(k);
      const std::size_t from = k % on.size(), to = (k + 1) % on.size();
      const Vec3 p = mesh.vertices[on[from]] + t * (mesh.vertices[on[to]] - mesh.vertices[on[from]]);
      for (std::size_t c = 0; c < corners.size(); ++c)
        corners[c].push_back(t == 0 ? curve.copies[c][from] : put(curve.copies[c][from], curve.copies[c][to], p));
    }
    for (const std::vector<Index>& copy : corners) all_corners.insert(all_corners.end(), copy.begin(), copy.end());
    for (std::size_t k = 1; k < places.size(); ++k) {
      const Vec3 a = mesh.vertices[corners[0][k - 1]], b = mesh.vertices[corners[0][k]];
      Piece piece{&curve, {}, places[k - 1], places[k], a, b};
      for (const std::vector<Index>& copy : corners) piece.ends.push_back({copy[k - 1], copy[k]});
      pieces.push_back(std::move(piece));
      if (a == b) continue;
      division.middles.push_back(0.5 * (a + b));
      division.lengths.push_back(norm(b - a));
    }
  }
  const EdgeSplits splits = splits_of(division.added, before);
  follow(splits);
  features = split_features(features, splits);
  add_corners(features, all_corners);
  drop_doubled(features);
  division.crowded = crowded_edges(mesh, features, pieces);
  return division;
}

// Where no room is, of all components.
std::vector<Edge> IntersectionCurves::crowded_edges(const TriangleMesh& mesh, const FeatureGraph& features,
                                                    const std::vector<Piece>& pieces) const {
  const std::vector<Index> component = label_components(mesh.triangles, mesh.vertices.size());
  std::vector<char> is_crowded(pieces.size(), 0);
  std::map<Index, std::vector<std::size_t>> at;  // the pieces at a corner
  for (std::size_t q = 0; q < pieces.size(); ++q)
    for (const Edge& ends : pieces[q].ends)
      for (const Index end : ends) at[end].push_back(q);
  const std::size_t corners = features.corners.size();
  for (std::size_t q = 0; q < pieces.size(); ++q) {
    const Piece& piece = pieces[q];
    const double length = norm(piece.to - piece.from);
    const auto away = [&](const Vec3& p) {
      const Vec3 along = piece.to - piece.from;
      const double t = length > 0 ? std::clamp(dot(p - piece.from, along) / (length * length), 0.0, 1.0) : 0;
      return norm(p - piece.from - t * along);
    };
    const std::vector<Index>& on = piece.curve->copies[0];
    for (auto k = static_cast<std::size_t>(std::ceil(piece.first)); static_cast<double>(k) <= piece.last; ++k)
      is_crowded[q] |= away(mesh.vertices[on[k % on.size()]]) > kMostBend * length;
    for (const Edge& ends : piece.ends) {
      for (std::size_t k = 0; k < corners; ++k) {
        const Index corner = features.corners[k];
        if (corner == ends[0] || corner == ends[1] || component[corner] != component[ends[0]]) continue;
        if (away(mesh.vertices[corner]) >= kLeastGap * length) continue;
        is_crowded[q] = 1;
        if (const auto others = at.find(corner); others != at.end())
          for (const std::size_t other : others->second) is_crowded[other] = 1;
      }
      for (std::size_t k = 0; k < 2; ++k)
        for (const std::size_t other : at[ends[k]])
          for (const Edge& others : pieces[other].ends) {
            if (other == q || (others[0] != ends[k] && others[1] != ends[k])) continue;
            const Vec3 corner = mesh.vertices[ends[k]];
            const Vec3 a = unit(mesh.vertices[ends[1 - k]] - corner);
            const Vec3 b = unit(mesh.vertices[others[0] == ends[k] ? others[1] : others[0]] - corner);
            if (dot(a, b) > kLeastCosine) is_crowded[q] = is_crowded[other] = 1;
          }
    }
  }
  std::vector<Edge> crowded;
  for (std::size_t q = 0; q < pieces.size(); ++q) {
    if (!is_crowded[q]) continue;
    const std::vector<Index>& on = pieces[q].curve->copies[0];
    for (auto k = static_cast<std::size_t>(pieces[q].first); static_cast<double>(k) < pieces[q].last; ++k)
      crowded.push_back(sorted_edge(on[k % on.size()], on[(k + 1) % on.size()]));
  }
  return crowded;
}

std::vector<char> IntersectionCurves::among(const FeatureGraph& features) const {
  std::vector<char> found;
  for (const FeatureCurve& curve : features.curves) {
    std::vector<Index> on;
    for (const Index v : curve.vertices)
      if (v < vertices_) on.push_back(v);
    bool is_among = !curve.closed && on.size() > 1;
    for (std::size_t k = 1; is_among && k < on.size(); ++k)
      is_among = std::binary_search(edges_.begin(), edges_.end(), sorted_edge(on[k - 1], on[k]));
    found.push_back(is_among);
  }
  return found;
}

}  // namespace bisector
