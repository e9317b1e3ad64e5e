#include "remesh/around_kept.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <numeric>
#include <utility>
#include <vector>

#include "bisector/error.h"
#include "bisector/features.h"
#include "mesh/topology.h"
#include "remesh/prepare.h"
#include "remesh/topology_control.h"

namespace bisector {
namespace {

using Edge = std::array<Index, 2>;

// The input, welded and oriented, in the part that is kept and the part that is remeshed.
class Division {
 public:
  Division(const TriangleMesh& input, const RemeshOptions& options, const Context& context) {
    TriangleMesh traced = input;
    traced.face_of_triangle.resize(input.triangles.size());
    std::iota(traced.face_of_triangle.begin(), traced.face_of_triangle.end(), Index{0});
    welded_ = weld_and_orient(traced, options.weld, context);
    find_kept(input, options);
    find_input_vertices(input);
    find_interface();
    take_out();
  }

  // The part that is remeshed.
  const TriangleMesh& free() const { return free_; }
  RemeshOptions options_for_free(const TriangleMesh& input, const RemeshOptions& options) const;
  // Puts what the free part has become and the kept part together.
  void join(const RemeshOptions& options, RemeshResult& result) const;

 private:
  const TriangleMesh& whole() const { return welded_.mesh; }
  void find_kept(const TriangleMesh& input, const RemeshOptions& options);
  void find_input_vertices(const TriangleMesh& input);
  void find_interface();
  void take_out();
  std::size_t vertices_inside_kept() const {
    std::size_t count = 0;
    for (std::size_t v = 0; v < in_kept_.size(); ++v) count += in_kept_[v] && free_of_[v] == kNone;
    return count;
  }
  // Edges of the whole as edges of the free part; others are left out.
  std::vector<Edge> in_free(const std::vector<Edge>& edges) const {
    std::vector<Edge> found;
    for (const auto& [a, b] : edges)
      if (std::binary_search(free_edges_.begin(), free_edges_.end(), sorted_edge(a, b)))
        found.push_back({free_of_[a], free_of_[b]});
    return found;
  }
  // Edges of the input as edges of the whole.
  std::vector<Edge> in_whole(const std::vector<Edge>& edges) const {
    std::vector<Edge> found;
    for (const auto& [a, b] : edges) found.push_back(sorted_edge(welded_.vertex_of[a], welded_.vertex_of[b]));
    return found;
  }

  WeldResult welded_;
  std::vector<char> is_kept_;     // of each triangle of the whole
  std::vector<char> in_kept_;     // of each vertex, whether a kept triangle has it
  std::vector<Index> input_of_;   // of each vertex, one of the input's that it is
  std::vector<Edge> interface_;   // between kept and free triangles, sorted
  std::vector<Edge> free_edges_;  // of free triangles, sorted
  TriangleMesh free_;
  std::vector<Index> free_of_;   // of each vertex of the whole, that of the free part, or kNone
  std::vector<Index> whole_of_;  // and back
};

void Division::find_kept(const TriangleMesh& input, const RemeshOptions& options) {
  std::vector<char> asked(input.triangles.size(), 0);
  for (const Index t : options.keep_triangles) {
    if (t >= asked.size())
      throw Error(fmt::format("triangle {}, which is to be kept, is none of the mesh's; leave it out", t));
    asked[t] = 1;
  }
  is_kept_.resize(whole().triangles.size());
  in_kept_.assign(whole().vertices.size(), 0);
  for (std::size_t t = 0; t < is_kept_.size(); ++t) {
    is_kept_[t] = asked[whole().face_of_triangle[t]];
    if (is_kept_[t])
      for (const Index v : whole().triangles[t]) in_kept_[v] = 1;
  }
  if (std::find(is_kept_.begin(), is_kept_.end(), 0) == is_kept_.end())
    throw Error("all triangles are to be kept; nothing is left to be remeshed");
}

void Division::find_input_vertices(const TriangleMesh& input) {
  input_of_.assign(whole().vertices.size(), kNone);
  for (auto v = static_cast<Index>(input.vertices.size()); v-- > 0;) {
    const Index w = welded_.vertex_of[v];
    if (input.vertices[v] == whole().vertices[w]) input_of_[w] = v;
  }
}

void Division::find_interface() {
  const EdgeTable table = edge_table(whole().triangles, whole().vertices.size());
  for (std::size_t e = 0; e < table.edges.size(); ++e) {
    std::array<bool, 2> beside{};  // a free triangle, a kept one
    for (const std::size_t* h = table.half_edges.begin(e); h != table.half_edges.end(e); ++h)
      beside[static_cast<std::size_t>(is_kept_[*h / 3])] = true;
    if (beside[0]) free_edges_.push_back(table.edges[e]);
    if (beside[0] && beside[1]) interface_.push_back(table.edges[e]);
  }
}

void Division::take_out() {
  free_of_.assign(whole().vertices.size(), kNone);
  for (std::size_t t = 0; t < is_kept_.size(); ++t) {
    if (is_kept_[t]) continue;
    Triangle corners = whole().triangles[t];
    for (Index& v : corners) {
      if (free_of_[v] == kNone) {
        free_of_[v] = static_cast<Index>(whole_of_.size());
        whole_of_.push_back(v);
        free_.vertices.push_back(whole().vertices[v]);
      }
      v = free_of_[v];
    }
    free_.triangles.push_back(corners);
    if (!whole().labels.empty()) free_.labels.push_back(whole().labels[t]);
  }
  free_.feature_edges = in_free(whole().feature_edges);
}

RemeshOptions Division::options_for_free(const TriangleMesh& input, const RemeshOptions& options) const {
  RemeshOptions made = options;
  made.weld = 0;
  made.keep_triangles.clear();
  made.keep_vertices.clear();
  for (const Index v : options.keep_vertices)
    if (const Index f = free_of_[welded_.vertex_of[v]]; f != kNone) made.keep_vertices.push_back(f);
  made.keep_edges = in_free(in_whole(options.keep_edges));
  for (const Edge& edge : in_free(interface_)) made.keep_edges.push_back(edge);
  made.features.given = in_free(in_whole(options.features.given));
  std::vector<double>& density = made.sizing.attribute;
  if (!density.empty()) {
    density.resize(whole_of_.size());
    for (auto v = static_cast<Index>(input.vertices.size()); v-- > 0;)
      if (const Index f = free_of_[welded_.vertex_of[v]]; f != kNone) density[f] = options.sizing.attribute[v];
  }
  if (options.vertices > 0) {
    const std::size_t inside = vertices_inside_kept(), least = inside + 4;
    if (options.vertices < least)
      throw Error(fmt::format("the triangles to be kept have {} vertices inside; ask for more than {} in all", inside,
                              least - 1));
    made.vertices -= inside;
  }
  return made;
}

void Division::join(const RemeshOptions& options, RemeshResult& result) const {
  TriangleMesh& mesh = result.mesh;
  if (result.kept.empty()) result.kept.assign(mesh.vertices.size(), kNone);
  // Vertices where the free part touches itself are one again.
  std::vector<Index> at_whole(whole().vertices.size(), kNone), index(mesh.vertices.size());
  TriangleMesh joined;
  std::vector<SeedPlace> places;
  std::vector<Index> kept;
  for (Index v = 0; v < index.size(); ++v) {
    const Index w = result.kept[v] == kNone ? kNone : whole_of_[result.kept[v]];
    if (w != kNone && at_whole[w] != kNone) {
      index[v] = at_whole[w];
      continue;
    }
    index[v] = static_cast<Index>(joined.vertices.size());
    if (w != kNone) at_whole[w] = index[v];
    joined.vertices.push_back(mesh.vertices[v]);
    places.push_back(result.places[v]);
    kept.push_back(w == kNone ? kNone : input_of_[w]);
  }
  joined.triangles = std::move(mesh.triangles);
  joined.labels = std::move(mesh.labels);
  for (Triangle& t : joined.triangles)
    for (Index& v : t) v = index[v];
  for (std::size_t t = 0; t < is_kept_.size(); ++t) {
    if (!is_kept_[t]) continue;
    Triangle corners = whole().triangles[t];
    for (Index& v : corners) {
      if (at_whole[v] == kNone) {
        at_whole[v] = static_cast<Index>(joined.vertices.size());
        joined.vertices.push_back(whole().vertices[v]);
        places.push_back({SeedPlace::Kind::fixed});
        kept.push_back(input_of_[v]);
      }
      v = at_whole[v];
    }
    joined.triangles.push_back(corners);
    if (!whole().labels.empty()) joined.labels.push_back(whole().labels[t]);
    ++result.kept_triangles;
  }

  // Features along the kept part are those of the whole.
  FeatureOptions features = options.features;
  features.given = in_whole(options.features.given);
  const FeatureGraph graph = detect_features(whole(), features);
  std::vector<Edge> along;
  for (const auto& [a, b] : interface_) along.push_back(sorted_edge(at_whole[a], at_whole[b]));
  std::sort(along.begin(), along.end());
  for (const auto& [a, b] : mesh.feature_edges)
    if (const Edge edge = sorted_edge(index[a], index[b]); !std::binary_search(along.begin(), along.end(), edge))
      joined.feature_edges.push_back(edge);
  const auto is_of_free = [&](const Edge& edge) {
    return std::binary_search(free_edges_.begin(), free_edges_.end(), edge) &&
           !std::binary_search(interface_.begin(), interface_.end(), edge);
  };
  for (const Edge& edge : graph.edges)
    if (!is_of_free(edge)) joined.feature_edges.push_back(sorted_edge(at_whole[edge[0]], at_whole[edge[1]]));
  std::sort(joined.feature_edges.begin(), joined.feature_edges.end());
  for (TopologyFault& fault : result.faults)
    for (Index& seed : fault.seeds)
      if (seed != kNone) seed = index[seed];

  mesh = std::move(joined);
  result.places = std::move(places);
  result.kept = std::move(kept);
  result.wanted += vertices_inside_kept();
  result.topology = analyse_topology(mesh.triangles, mesh.vertices.size());
  result.input_topology = analyse_topology(whole().triangles, whole().vertices.size());
  result.topology_matches = same_topology(result.topology, result.input_topology);
  result.features.curves = graph.curves.size();
  result.features.corners = graph.corners.size();
  result.features.distance = measure_feature_distance(mesh.vertices, mesh.feature_edges, whole(), graph.edges);
  result.welded = welded_;
  result.welded.mesh = {};
}

}  // namespace

RemeshResult remesh_around_kept(const TriangleMesh& input, const RemeshOptions& options, const Context& context,
                                const RemeshSurface& remesh_surface) {
  if (!options.seeds.empty())
    throw Error("seeds are of the whole surface and leave no room for triangles that are kept; give one of the two");
  const Division division(input, options, context);
  RemeshResult result = remesh_surface(division.free(), division.options_for_free(input, options), context);
  division.join(options, result);
  return result;
}

}  // namespace bisector
