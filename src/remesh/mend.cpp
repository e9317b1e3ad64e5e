#include "remesh/mend.h"

#include <algorithm>
#include <array>
#include <map>
#include <optional>
#include <utility>

#include "bisector/quality.h"
#include "core/geometry.h"
#include "core/parallel.h"
#include "mesh/topology.h"
#include "remesh/slivers.h"
#include "remesh/topology_control.h"

namespace bisector {
namespace {

using Kind = SeedPlace::Kind;

// Changes that are tried one after the other, how many are gone on from after each, and the sweeps after each.
constexpr int kSteps = 4, kSweeps = 3, kMoreSweeps = 6;
constexpr std::size_t kWidth = 6;
constexpr double kIrregular = 10;    // price of a triangle at a vertex beyond or short of six, in average costs
constexpr double kLeastGain = 0.05;  // of what is missing of the angles
// There are at most so many searches, and one for so many vertices; and the number of vertices may be off by one in so
// many.
constexpr std::size_t kMostSearches = 500, kVerticesPerSearch = 200;
constexpr long long kDrift = 200;
// Rounds over the pairs of triangles that cross, and the best changes of a part that are looked at for whether they
// cross.
constexpr int kUncrossingRounds = 4;
constexpr std::size_t kMostUncrossed = 64;

std::array<Index, 2> key(Index a, Index b) { return {std::min(a, b), std::max(a, b)}; }

// Vertices more than there were.
long long growth(const ImprovePatch& changed) {
  long long more = 0;
  for (const PatchVertex& v : changed.vertices()) {
    if (v.seed == kNone) more += !v.removed;
    else more -= v.removed;
  }
  return more;
}

class Mender {
 public:
  Mender(const CellMap& map, const FeatureCurves& curves, const FeatureTrace& trace, const ImproveOptions& options,
         MendMesh& result);

  MendReport run(const Context& context);

 private:
  struct Bad {
    Index triangle;
    double under;
  };
  // A part of the mesh that may change, and the vertices and triangles there that it is of.
  struct Part {
    ImprovePatch patch;
    std::vector<Index> vertices, triangles;
  };

  std::array<Vec3, 3> corners(Index t) const {
    const Triangle& v = triangles_[t];
    return {vertices_[v[0]].x, vertices_[v[1]].x, vertices_[v[2]].x};
  }
  // By how much its smallest angle that curves do not impose is too small.
  double under(Index t) const;
  std::vector<Bad> find_bad() const;
  // That of the vertices given, with those around them.
  Part part_around(std::vector<Index> core) const;
  std::optional<ImprovePatch> search(const ImprovePatch& start) const;
  // Whether the number of vertices may change so.
  bool may_grow(long long by) const;
  // What is near a part that is to change, with that as it is or as `changed`.
  TriangleMesh surroundings(const Part& part, const std::vector<Index>& near, const ImprovePatch* changed) const;
  // Whether topology is as before, and no more triangles intersect, or, if so wanted, fewer.
  bool fits(const Part& part, const ImprovePatch& changed, bool fewer = false) const;
  std::vector<Part> choose_parts();
  void mend_angles(const Context& context);
  std::vector<std::array<Index, 2>> find_crossing_pairs() const;
  std::optional<ImprovePatch> search_uncrossed(const Part& part) const;
  void mend_crossings(const Context& context);
  bool has_edge(Index a, Index b) const;
  std::vector<Index> vertices_along(Index curve) const;
  bool recover(Index curve);
  void take(const Part& part, const ImprovePatch& changed);
  void write_back();

  const CellMap& map_;
  const FeatureCurves& curves_;
  const FeatureTrace& trace_;
  const CurvesBetween curves_between_;
  MendMesh& result_;
  const ShapeGoal goal_;
  const long long wanted_;  // vertices
  std::vector<PatchVertex> vertices_;
  std::vector<Triangle> triangles_;
  std::vector<char> alive_, tried_;               // of the triangles: still there, searched for already
  std::vector<std::vector<Index>> stars_;         // triangles at each vertex
  std::map<std::array<Index, 2>, Index> locked_;  // curves by edge
  std::size_t count_ = 0;                         // of vertices
  std::size_t searches_left_ = 0;
  double average_ = 0;  // cost
  MendReport report_;
};

Mender::Mender(const CellMap& map, const FeatureCurves& curves, const FeatureTrace& trace,
               const ImproveOptions& options, MendMesh& result)
    : map_(map), curves_(curves), trace_(trace), curves_between_(curves), result_(result),
      goal_(shape_goal(options.min_angle, options.max_angle)),
      wanted_(static_cast<long long>(options.vertices ? options.vertices : result.mesh.vertices.size())) {
  const TriangleMesh& mesh = result.mesh;
  triangles_ = mesh.triangles;
  alive_.assign(triangles_.size(), 1);
  tried_.assign(triangles_.size(), 0);
  count_ = mesh.vertices.size();
  vertices_.resize(count_);
  stars_.resize(count_);
  for (Index t = 0; t < triangles_.size(); ++t)
    for (const Index v : triangles_[t]) stars_[v].push_back(t);
  for (const auto& [a, b] : mesh.feature_edges) locked_[{a, b}] = curves_between_(result.places[a], result.places[b]);
  // Vertices stay where their triangles are no disk.
  std::vector<char> whole(count_, 1);
  const EdgeTable table = edge_table(mesh.triangles, mesh.vertices.size());
  const std::vector<char> split = split_vertices(mesh.triangles, mesh.vertices.size());
  for (Index v = 0; v < count_; ++v) whole[v] = !split[v] && result.owners[v] != kNone;
  for (std::size_t e = 0; e < table.edges.size(); ++e)
    if (table.half_edges.size(e) != 2)
      for (const Index v : table.edges[e]) whole[v] = 0;
  parallel_each(count_, [&](std::size_t v) {
    PatchVertex& vertex = vertices_[v];
    vertex.x = mesh.vertices[v];
    vertex.place = result.places[v];
    vertex.owner = result.owners[v];
    vertex.free = (vertex.place.kind != Kind::surface && vertex.owner != kNone) || whole[v];
    if (vertex.place.kind == Kind::surface && vertex.owner != kNone)
      map_.project(vertex.x, vertex.owner, vertex.normal);
  });
  average_ = fixed_sum(triangles_.size(),
                       [&](std::size_t t) {
                         const auto [a, b, c] = corners(static_cast<Index>(t));
                         return shape_cost(a, b, c, goal_);
                       }) /
             static_cast<double>(triangles_.size());
}

double Mender::under(Index t) const {
  const std::array<Vec3, 3> x = corners(t);
  if (free_angle_lack(x, {}, kBadAngle) == 0) return 0;
  const Triangle& v = triangles_[t];
  std::array<bool, 3> locked;
  for (int m = 0; m < 3; ++m) locked[m] = locked_.count(key(v[m], v[(m + 1) % 3])) > 0;
  return free_angle_lack(x, locked, kBadAngle);
}

std::vector<Mender::Bad> Mender::find_bad() const {
  std::vector<Bad> bad;
  for (Index t = 0; t < triangles_.size(); ++t)
    if (alive_[t])
      if (const double missing = under(t); missing > 0) bad.push_back({t, missing});
  std::stable_sort(bad.begin(), bad.end(), [](const Bad& a, const Bad& b) { return a.under > b.under; });
  return bad;
}

Mender::Part Mender::part_around(std::vector<Index> core) const {
  const std::size_t given = core.size();
  Part part{{map_, &curves_, goal_}, std::move(core), {}};
  std::vector<Index>& members = part.vertices;
  for (std::size_t k = 0; k < given; ++k)
    for (const Index t : stars_[members[k]])
      for (const Index v : triangles_[t])
        if (std::find(members.begin(), members.end(), v) == members.end()) members.push_back(v);
  for (const Index v : members) part.triangles.insert(part.triangles.end(), stars_[v].begin(), stars_[v].end());
  std::sort(part.triangles.begin(), part.triangles.end());
  part.triangles.erase(std::unique(part.triangles.begin(), part.triangles.end()), part.triangles.end());
  const auto add = [&](Index v, bool free) {
    PatchVertex vertex = vertices_[v];
    vertex.seed = v;
    vertex.free = vertex.free && free;
    part.patch.add_vertex(vertex);
  };
  for (const Index v : members) add(v, true);
  std::vector<LockedEdge> locked;
  for (const Index t : part.triangles) {
    Triangle local;
    for (int m = 0; m < 3; ++m) {
      const Index v = triangles_[t][m];
      auto member = std::find(members.begin(), members.end(), v);
      local[m] = static_cast<Index>(member - members.begin());
      if (member != members.end()) continue;
      members.push_back(v);
      add(v, false);
    }
    part.patch.add_triangle(local);
    for (int m = 0; m < 3; ++m) {
      const auto edge = locked_.find(key(triangles_[t][m], triangles_[t][(m + 1) % 3]));
      if (edge == locked_.end()) continue;
      const auto [a, b] = key(local[m], local[(m + 1) % 3]);
      locked.push_back({a, b, edge->second});
    }
  }
  for (Index k = 0; k < members.size(); ++k) part.patch.set_outside(k, stars_[members[k]].size());
  part.patch.lock(std::move(locked));
  return part;
}

bool Mender::may_grow(long long by) const {
  const long long off = static_cast<long long>(count_) - wanted_;
  return std::abs(off + by) <= std::max(wanted_ / kDrift, std::abs(off));
}

std::optional<ImprovePatch> Mender::search(const ImprovePatch& start) const {
  const ImprovePatch::Lack before = start.lack(kBadAngle);
  double least = (1 - kLeastGain) * before.squares, best_cost = 0;
  std::optional<ImprovePatch> best;
  const auto cost_of = [&](const ImprovePatch& patch) { return patch.shape_cost_sum(average_, kIrregular * average_); };
  const auto consider = [&](const ImprovePatch& patch, double cost, bool) {
    if (!may_grow(growth(patch)) || patch.is_folded()) return;
    const ImprovePatch::Lack lack = patch.lack(kBadAngle);
    if (lack.most > before.most || lack.squares > least) return;
    if (best && lack.squares == least && cost >= best_cost) return;
    least = lack.squares;
    best_cost = cost;
    best = patch;
  };
  const auto consider_relaxed = [&](ImprovePatch patch) {
    patch.relax_all(kMoreSweeps);
    consider(patch, cost_of(patch), true);
  };
  consider_relaxed(start);
  search_changes(start, {kSteps, kWidth, kSweeps, average_}, cost_of, consider);
  if (best) consider_relaxed(*best);
  return best;
}

TriangleMesh Mender::surroundings(const Part& part, const std::vector<Index>& near, const ImprovePatch* changed) const {
  std::map<Index, Vec3> moved;
  const auto number = [&](Index v) {  // outside; new vertices come after all others
    const Index known = changed->vertices()[v].seed;
    return known != kNone ? known : static_cast<Index>(vertices_.size() + v);
  };
  TriangleMesh mesh;
  if (changed) {
    for (Index v = 0; v < changed->vertices().size(); ++v) moved[number(v)] = changed->vertices()[v].x;
    for (const Triangle& t : changed->triangles()) mesh.triangles.push_back({number(t[0]), number(t[1]), number(t[2])});
  } else {
    for (const Index t : part.triangles) mesh.triangles.push_back(triangles_[t]);
  }
  for (const Index t : near) mesh.triangles.push_back(triangles_[t]);
  std::map<Index, Index> local;
  for (Triangle& t : mesh.triangles)
    for (Index& v : t) {
      const auto [at, is_new] = local.try_emplace(v, static_cast<Index>(mesh.vertices.size()));
      if (is_new) {
        const auto place = moved.find(v);
        mesh.vertices.push_back(place != moved.end() ? place->second : vertices_[v].x);
      }
      v = at->second;
    }
  return mesh;
}

bool Mender::fits(const Part& part, const ImprovePatch& changed, bool fewer) const {
  std::vector<Vec3> points;
  for (const PatchVertex& v : changed.vertices()) points.push_back(v.x);
  for (const Index v : part.vertices) points.push_back(vertices_[v].x);
  const Box box = bounding_box(points);
  std::vector<Index> near;
  for (Index t = 0; t < triangles_.size(); ++t) {
    if (!alive_[t] || std::binary_search(part.triangles.begin(), part.triangles.end(), t)) continue;
    const std::array<Vec3, 3> x = corners(t);
    bool apart = false;
    for (int k = 0; k < 3; ++k)
      apart |= std::max({x[0][k], x[1][k], x[2][k]}) < box.lo[k] || std::min({x[0][k], x[1][k], x[2][k]}) > box.hi[k];
    if (!apart) near.push_back(t);
  }
  const TriangleMesh before = surroundings(part, near, nullptr), after = surroundings(part, near, &changed);
  const MeshTopology was = analyse_topology(before.triangles, before.vertices.size());
  const MeshTopology is = analyse_topology(after.triangles, after.vertices.size());
  // A border may have more edges.
  if (!same_topology(is, was) || is.non_manifold_edges != was.non_manifold_edges ||
      is.non_manifold_vertices != was.non_manifold_vertices)
    return false;
  const std::size_t crossings = count_self_intersections(after);
  if (crossings == 0 && !fewer) return true;
  const std::size_t more_than = count_self_intersections(before);
  return fewer ? crossings < more_than : crossings <= more_than;
}

void Mender::take(const Part& part, const ImprovePatch& changed) {
  std::vector<Index> global;
  for (const PatchVertex& v : changed.vertices()) {
    Index at = v.seed;
    if (at == kNone) {
      at = static_cast<Index>(vertices_.size());
      vertices_.push_back(v);
      stars_.emplace_back();
      if (!v.removed) {
        ++report_.inserted;
        ++count_;
      }
    } else {
      const bool free = vertices_[at].free;
      vertices_[at] = v;
      vertices_[at].free = free;
      if (v.removed) {
        ++report_.removed;
        --count_;
      }
    }
    vertices_[at].step = 0;
    vertices_[at].seed = kNone;
    global.push_back(at);
  }
  for (const Index t : part.triangles) {
    alive_[t] = 0;
    for (int m = 0; m < 3; ++m) {
      std::erase(stars_[triangles_[t][m]], t);
      locked_.erase(key(triangles_[t][m], triangles_[t][(m + 1) % 3]));
    }
  }
  for (const LockedEdge& edge : changed.locked()) locked_[key(global[edge.a], global[edge.b])] = edge.curve;
  for (const Triangle& t : changed.triangles()) {
    const Index at = static_cast<Index>(triangles_.size());
    triangles_.push_back({global[t[0]], global[t[1]], global[t[2]]});
    alive_.push_back(1);
    tried_.push_back(0);
    for (const Index v : triangles_.back()) stars_[v].push_back(at);
  }
  ++report_.made;
}

bool Mender::has_edge(Index a, Index b) const {
  return std::any_of(stars_[a].begin(), stars_[a].end(), [&](Index t) {
    return std::find(triangles_[t].begin(), triangles_[t].end(), b) != triangles_[t].end();
  });
}

// The vertices of a curve in order, the first again at the end of a loop. Empty if there are too few for a chain, or if
// an end has none.
std::vector<Index> Mender::vertices_along(Index curve) const {
  std::vector<std::pair<double, Index>> found;
  const auto [first, last] = curves_.ends(curve);
  Index at_first = kNone, at_last = kNone;
  for (Index v = 0; v < vertices_.size(); ++v) {
    const SeedPlace& place = vertices_[v].place;
    if (vertices_[v].removed) continue;
    if (place.curve == curve) found.push_back({place.position, v});
    if (place.corner != kNone && place.corner == first) at_first = v;
    if (place.corner != kNone && place.corner == last) at_last = v;
  }
  std::sort(found.begin(), found.end());
  std::vector<Index> chain;
  const bool closed = curves_.closed(curve);
  if (!closed) chain.push_back(at_first);
  for (const auto& [position, v] : found) chain.push_back(v);
  if (!chain.empty()) chain.push_back(closed ? chain.front() : at_last);
  const bool is_loop = closed || first == last;
  if (chain.size() < (is_loop ? 4 : 2) || chain.front() == kNone || chain.back() == kNone) return {};
  return chain;
}

// True if it is a chain of edges then.
bool Mender::recover(Index curve) {
  if (trace_.sheets(curve) != 2) return false;  // as many triangles have the edges that flips make
  const std::vector<Index> chain = vertices_along(curve);
  if (chain.empty()) return false;
  for (std::size_t k = 0; k + 1 < chain.size(); ++k) {
    const Index a = chain[k], b = chain[k + 1];
    const auto known = locked_.find(key(a, b));
    if (known != locked_.end() && has_edge(a, b)) {
      if (known->second != kNone && known->second != curve) return false;
      continue;
    }
    const Part part = part_around({a, b});
    ImprovePatch changed = part.patch;
    if (!changed.connect(0, 1, curve)) return false;
    changed.relax_all(kMoreSweeps);
    if (changed.is_folded() || !fits(part, changed)) return false;
    take(part, changed);
  }
  return true;
}

void Mender::write_back() {
  TriangleMesh& mesh = result_.mesh;
  const std::vector<std::int32_t> labels = std::move(mesh.labels);
  mesh.labels.clear();
  mesh.vertices.clear();
  result_.places.clear();
  std::vector<Index> number(vertices_.size(), kNone);
  for (Index v = 0; v < vertices_.size(); ++v) {
    if (vertices_[v].removed) continue;
    number[v] = static_cast<Index>(mesh.vertices.size());
    mesh.vertices.push_back(vertices_[v].x);
    result_.places.push_back(vertices_[v].place);
  }
  mesh.triangles.clear();
  for (Index t = 0; t < triangles_.size(); ++t) {
    if (!alive_[t]) continue;
    const Triangle& v = triangles_[t];
    mesh.triangles.push_back({number[v[0]], number[v[1]], number[v[2]]});
    if (labels.empty()) continue;
    if (t < labels.size()) {
      mesh.labels.push_back(labels[t]);
      continue;
    }
    const std::array<Vec3, 3> x = corners(t);
    Index owner = kNone;
    for (const Index w : v)
      if (owner == kNone) owner = vertices_[w].owner;
    const Index on = map_.triangle_at((1.0 / 3) * (x[0] + x[1] + x[2]), owner);
    mesh.labels.push_back(on != kNone ? map_.surface().mesh.labels[on] : 0);
  }
  mesh.feature_edges.clear();
  for (const auto& [edge, curve] : locked_) mesh.feature_edges.push_back(key(number[edge[0]], number[edge[1]]));
  std::sort(mesh.feature_edges.begin(), mesh.feature_edges.end());
  number.resize(result_.owners.size());
  result_.number = std::move(number);
}

// The worst triangles that were not tried in vain, as they are now; their parts share no triangle.
std::vector<Mender::Part> Mender::choose_parts() {
  std::vector<Part> parts;
  std::vector<char> taken(triangles_.size(), 0);
  for (const Bad& b : find_bad()) {
    if (parts.size() == searches_left_) break;
    if (tried_[b.triangle]) continue;
    Part part = part_around({triangles_[b.triangle].begin(), triangles_[b.triangle].end()});
    if (std::any_of(part.triangles.begin(), part.triangles.end(), [&](Index t) { return taken[t] != 0; })) continue;
    for (const Index t : part.triangles) taken[t] = 1;
    tried_[b.triangle] = 1;
    parts.push_back(std::move(part));
  }
  searches_left_ -= parts.size();
  return parts;
}

void Mender::mend_angles(const Context& context) {
  searches_left_ = kMostSearches + count_ / kVerticesPerSearch;
  int round = 0;
  for (std::vector<Part> parts = choose_parts(); !parts.empty(); parts = choose_parts()) {
    context.report({"mending angles", ++round, 0, 0, 0, 1});
    std::vector<std::optional<ImprovePatch>> changed(parts.size());
    parallel_each(
        parts.size(),
        [&](std::size_t k) {
          context.check();
          changed[k] = search(parts[k].patch);
        },
        1);
    for (std::size_t k = 0; k < parts.size(); ++k)
      if (changed[k] && may_grow(growth(*changed[k])) && fits(parts[k], *changed[k])) take(parts[k], *changed[k]);
  }
}

std::vector<std::array<Index, 2>> Mender::find_crossing_pairs() const {
  TriangleMesh mesh;
  std::vector<Index> number;
  for (const PatchVertex& v : vertices_) mesh.vertices.push_back(v.x);
  for (Index t = 0; t < triangles_.size(); ++t) {
    if (!alive_[t]) continue;
    mesh.triangles.push_back(triangles_[t]);
    number.push_back(t);
  }
  std::vector<std::array<Index, 2>> pairs = find_self_intersections(mesh);
  for (std::array<Index, 2>& pair : pairs) pair = {number[pair[0]], number[pair[1]]};
  return pairs;
}

// With as good angles, and fewer pairs of triangles that cross.
std::optional<ImprovePatch> Mender::search_uncrossed(const Part& part) const {
  const ImprovePatch::Lack before = part.patch.lack(kBadAngle);
  const auto is_good = [&](const ImprovePatch& patch) {
    const ImprovePatch::Lack lack = patch.lack(kBadAngle);
    return may_grow(growth(patch)) && !patch.is_folded() && lack.most <= before.most && lack.squares <= before.squares;
  };
  std::vector<std::pair<double, ImprovePatch>> found;
  search_changes(
      part.patch, {kSteps, kWidth, kSweeps, average_},
      [&](const ImprovePatch& patch) { return patch.shape_cost_sum(average_, kIrregular * average_); },
      [&](const ImprovePatch& patch, double cost, bool) {
        if (is_good(patch)) found.push_back({cost, patch});
      });
  std::stable_sort(found.begin(), found.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  if (found.size() > kMostUncrossed) found.erase(found.begin() + kMostUncrossed, found.end());
  for (auto& [cost, patch] : found) {
    if (fits(part, patch, true)) return std::move(patch);
    patch.relax_all(kMoreSweeps);
    if (is_good(patch) && fits(part, patch, true)) return std::move(patch);
  }
  return std::nullopt;
}

// Two sheets that are nearer to each other than triangles are off them cross in few places: other triangles there do
// not.
void Mender::mend_crossings(const Context& context) {
  for (int round = 0; round < kUncrossingRounds; ++round) {
    const std::vector<std::array<Index, 2>> pairs = find_crossing_pairs();
    if (pairs.size() <= *result_.may_cross || pairs.size() > count_ / kVerticesPerCrossing) return;
    context.report({"mending crossings", round + 1, 0, 0, 0, 1});
    bool any = false;
    for (const std::array<Index, 2>& pair : pairs)
      for (const Index t : pair) {
        context.check();
        if (!alive_[pair[0]] || !alive_[pair[1]]) break;
        const Part part = part_around({triangles_[t].begin(), triangles_[t].end()});
        if (const std::optional<ImprovePatch> changed = search_uncrossed(part)) {
          take(part, *changed);
          any = true;
        }
      }
    if (!any) return;
  }
}

MendReport Mender::run(const Context& context) {
  report_.bad = find_bad().size();
  std::erase_if(result_.broken, [&](Index curve) { return recover(curve); });
  mend_angles(context);
  if (result_.may_cross) mend_crossings(context);
  if (report_.made > 0) write_back();
  return report_;
}

}  // namespace

MendReport mend_angles(const CellMap& map, const FeatureCurves& curves, const FeatureTrace& trace,
                       const ImproveOptions& options, MendMesh& result, const Context& context) {
  if (result.broken.empty() && !result.may_cross && find_slivers(result.mesh).bounds.points.empty()) return {};
  return Mender(map, curves, trace, options, result).run(context);
}

}  // namespace bisector
