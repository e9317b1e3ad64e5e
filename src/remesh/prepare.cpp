#include "remesh/prepare.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <optional>
#include <string>
#include <utility>

#include "bisector/error.h"
#include "bisector/quality.h"
#include "bisector/repair.h"
#include "core/geometry.h"
#include "features/normals.h"
#include "features/wedges.h"
#include "mesh/corefine.h"
#include "mesh/joining.h"
#include "mesh/spatial_order.h"
#include "mesh/topology.h"
#include "mesh/touching.h"
#include "mesh/used_vertices.h"
#include "remesh/detail.h"
#include "remesh/mend_input.h"
#include "remesh/sizing.h"
#include "spatial/kd_tree.h"

namespace bisector {
namespace {

// With few seeds to start from the count says nothing about the result's, which topology control finds. The density
// then is one that a mesh of so many vertices could follow.
constexpr std::size_t kLeastForDensity = 3000;
constexpr std::size_t kMostVertices = 100'000'000;
// Of triangles that cross, from which on they are more of a soup than components.
constexpr std::size_t kMostPairs = 100'000;
// Of the vertices wanted, for each edge that two components have in common: with fewer, nothing is left for the rest.
constexpr std::size_t kLeastPerEdge = 8;
// Of the curves in which components cross, by length: where more has no room they cross anyway.
constexpr double kLeastShared = 0.5;
// Of those wanted, for each corner that is only there because parts of the surface touch.
constexpr std::size_t kVerticesPerCorner = 2;
// Plans without what there is no room for.
constexpr int kMostRounds = 10;
// Of the diagonal, from no rounding to that of six digits.
constexpr double kRoundings[] = {0, 1e-7, 1e-6, kRounding};

MeshTopology topology_of(const TriangleMesh& mesh) { return analyse_topology(mesh.triangles, mesh.vertices.size()); }

void warn_of_weld(const WeldResult& welded, bool has_tolerance, const Context& context) {
  const std::size_t removed = welded.degenerate_triangles + welded.duplicate_triangles;
  std::vector<std::string> done;
  if (welded.merged_vertices)
    done.push_back(
        fmt::format("welded {} {}", welded.merged_vertices, welded.merged_vertices == 1 ? "vertex" : "vertices"));
  if (welded.split_edges) done.push_back(fmt::format("split {} at cracks", plural(welded.split_edges, "edge")));
  if (removed) done.push_back(fmt::format("removed {}", plural(removed, "triangle")));
  if (done.empty()) return;
  std::string line = fmt::format("{}", fmt::join(done, ", "));
  if (welded.border_before)
    line += fmt::format("; {} of {} left", welded.border_after, plural(welded.border_before, "border edge"));
  if (!has_tolerance && welded.border_after) line += "; a weld tolerance sets how far vertices may be apart";
  context.warn(line);
}

void orient_with_warning(TriangleMesh& mesh, const Context& context) {
  if (analyse_topology(mesh.triangles, mesh.vertices.size()).oriented) return;
  std::vector<Triangle> turned = mesh.triangles;
  orient(turned, mesh.vertices.size());
  if (!analyse_topology(turned, mesh.vertices.size()).oriented) return;
  std::size_t count = 0;
  for (std::size_t t = 0; t < turned.size(); ++t) count += turned[t] != mesh.triangles[t];
  mesh.triangles = std::move(turned);
  context.warn(fmt::format("turned {} over, to run the same way round as most", plural(count, "triangle")));
}

void check_edges(const TriangleMesh& mesh, const std::vector<std::array<Index, 2>>& edges, const char* what) {
  if (edges.empty()) return;
  const EdgeTable table = edge_table(mesh.triangles, mesh.vertices.size());
  for (const auto& [a, b] : edges)
    if (!std::binary_search(table.edges.begin(), table.edges.end(), sorted_edge(a, b)))
      throw Error(fmt::format("{} {} {} is not an edge of the mesh; remove it", what, a, b));
}

void check_kept(const TriangleMesh& mesh, const RemeshOptions& options) {
  const std::vector<char> used = mark_used_vertices(mesh.triangles, mesh.vertices.size());
  for (const Index v : options.keep_vertices)
    if (v >= used.size() || !used[v])
      throw Error(fmt::format("vertex {}, which is to be kept, is {}; leave it out", v,
                              v < used.size() ? "on no triangle" : "none of the mesh's"));
}

WeldResult as_it_is(const TriangleMesh& input) {
  WeldResult welded;
  welded.mesh = input;
  welded.vertex_of.resize(input.vertices.size());
  std::iota(welded.vertex_of.begin(), welded.vertex_of.end(), Index{0});
  return welded;
}

}  // namespace

OrderedInput::OrderedInput(const TriangleMesh& input, const RemeshOptions& given) : options(given) {
  const std::size_t vertices = input.vertices.size();
  if (!input.labels.empty() && input.labels.size() != input.triangles.size())
    throw Error(fmt::format("{} labels for {} triangles; give one each", input.labels.size(), input.triangles.size()));
  std::vector<double>& density = options.sizing.attribute;
  if (!density.empty() && density.size() != vertices)
    throw Error(
        fmt::format("the density has {} values for {} vertices; give one per vertex", density.size(), vertices));
  check_edges(input, given.features.given, "feature edge");
  check_edges(input, input.feature_edges, "feature edge");
  check_edges(input, given.keep_edges, "the edge to be kept,");
  check_kept(input, given);
  OrderedMesh ordered = in_spatial_order(input);
  mesh = std::move(ordered.mesh);
  vertex_of = std::move(ordered.vertex_of);
  for (auto* edges : {&options.features.given, &options.keep_edges})
    for (auto& edge : *edges)
      for (Index& v : edge) v = vertex_of[v];
  for (Index& v : options.keep_vertices) v = vertex_of[v];
  if (density.empty()) return;
  density.resize(mesh.vertices.size());
  for (std::size_t v = 0; v < vertices; ++v)
    if (vertex_of[v] != kNone) density[vertex_of[v]] = given.sizing.attribute[v];
}

WeldResult join_borders(const TriangleMesh& input, const std::optional<double>& tolerance) {
  if (tolerance) return weld(input, *tolerance);
  WeldResult best = remove_double_triangles(input);
  if (best.duplicate_triangles > 0 && has_solids_with_common_faces(input)) return as_it_is(input);
  MeshTopology before = topology_of(best.mesh);
  const double diagonal = bounding_box(input).diagonal();
  for (const double rounding : kRoundings) {
    if (before.boundary_edges + before.non_manifold_edges == 0) break;
    WeldResult welded = weld(input, rounding * diagonal);
    const MeshTopology now = topology_of(welded.mesh);
    if (!joins_borders(now, before)) continue;
    // Sheets that share points exactly were made to meet there, three or more of them as well as two; what a tolerance
    // joins so may only be near.
    if (rounding > 0 && now.non_manifold_edges > before.non_manifold_edges) continue;
    best = std::move(welded);
    before = now;
  }
  return best;
}

WeldResult weld_and_orient(const TriangleMesh& input, const std::optional<double>& tolerance, const Context& context) {
  WeldResult welded = join_borders(input, tolerance);
  warn_of_weld(welded, tolerance.has_value(), context);
  orient_with_warning(welded.mesh, context);
  return welded;
}

SizingTarget target_of(const RemeshOptions& options) {
  if (!options.seeds.empty()) return {std::max(options.seeds.size(), kLeastForDensity), 0};
  return {options.vertices, options.edge_length};
}

WeldResult weld_and_mend(const OrderedInput& input, const Context& context) {
  const RemeshOptions& options = input.options;
  WeldResult welded = weld_and_orient(input.mesh, options.weld, context);
  if (!options.weld && options.keep_vertices.empty() && options.keep_edges.empty())
    mend_rounding(welded, options.features.given, compute_sizing(welded.mesh, {}, target_of(options)).unit_edge,
                  context);
  return welded;
}

Preparation::Preparation(OrderedInput ordered, const Context& context, bool branches)
    : welded_(weld_and_mend(ordered, context)), mesh_(std::exchange(welded_.mesh, {})), sizing_(ordered.options.sizing),
      target_(target_of(ordered.options)), given_seeds_(ordered.options.seeds.size()) {
  const TriangleMesh& input = ordered.mesh;
  const RemeshOptions& options = ordered.options;
  const std::vector<Index>& vertex_of = welded_.vertex_of;

  FeatureOptions features = options.features;
  std::vector<std::array<Index, 2>> keep_edges = options.keep_edges;
  for (auto* edges : {&features.given, &keep_edges}) rename_edges(vertex_of, *edges);
  const std::size_t vertices = mesh_.vertices.size();
  Separation separation(mesh_);
  if (!branches) {
    separation.separate(mesh_, ordered.touching, context);
    touching_ = separation.parted();
    const std::vector<Index> equal = part_equal_points(mesh_, false, context);
    touching_.insert(touching_.end(), equal.begin(), equal.end());
  }
  features.given = separation.edges(mesh_, features.given);
  keep_edges = separation.edges(mesh_, keep_edges);
  if (!branches && options.keep_vertices.empty() && options.keep_edges.empty()) open_contacts(mesh_, context);
  features.given.insert(features.given.end(), keep_edges.begin(), keep_edges.end());
  if (options.energy == Energy::automatic) find_noise(features);
  features_ = detect_features(mesh_, features);
  std::vector<Index> keep_vertices = options.keep_vertices;
  for (const auto& edge : options.keep_edges) keep_vertices.insert(keep_vertices.end(), edge.begin(), edge.end());
  if (!keep_vertices.empty()) keep(keep_vertices, std::move(keep_edges), separation.originals(vertices));

  if (!sizing_.attribute.empty()) {
    std::vector<double> values(vertices);
    for (std::size_t v = input.vertices.size(); v-- > 0;)
      if (vertex_of[v] != kNone) values[vertex_of[v]] = sizing_.attribute[v];
    sizing_.attribute = separation.values(std::move(values));
  }
  sizing_.sharp = features_.edges;
  if (given_seeds_ > 0 || (branches && options.detail == DetailMode::off)) return;
  std::vector<double> lengths = lay_down_plain();
  if (!branches) apart_ = SetApart(mesh_, lengths, unbounded_->sizing.vertices);
  add_corners_where_curves_touch();
  if (options.detail == DetailMode::off) return;
  resolves_all_ = options.detail == DetailMode::all;
  if (!plan_with_intersections()) plan(std::move(lengths));
}

void Preparation::keep(const std::vector<Index>& vertices, std::vector<std::array<Index, 2>> edges,
                       const std::vector<Index>& original) {
  std::vector<Index> welded_as(welded_.vertex_of.size(), kNone);  // by welded vertex
  for (const Index v : vertices) {
    Index& as = welded_as[welded_.vertex_of[v]];
    as = std::min(as, v);
  }
  kept_as_.assign(mesh_.vertices.size(), kNone);
  std::vector<Vec3> points;
  std::vector<char> counted(welded_as.size(), 0);
  for (Index v = 0; v < kept_as_.size(); ++v) {
    if (original[v] == kNone || welded_as[original[v]] == kNone) continue;
    kept_as_[v] = welded_as[original[v]];
    keep_vertices_.push_back(v);
    // Vertices that were one before they were separated are no distance apart.
    if (std::exchange(counted[original[v]], 1) == 0) points.push_back(mesh_.vertices[v]);
  }
  add_corners(features_, keep_vertices_);
  for (auto& edge : edges) edge = sorted_edge(edge[0], edge[1]);
  std::sort(edges.begin(), edges.end());
  edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
  keep_edges_ = std::move(edges);
  for (const auto& [a, b] : keep_edges_) {
    kept_lengths_.points.push_back(0.5 * (mesh_.vertices[a] + mesh_.vertices[b]));
    kept_lengths_.lengths.push_back(norm(mesh_.vertices[b] - mesh_.vertices[a]));
  }
  // Edges are no longer than kept vertices are apart.
  if (points.size() < 2) return;
  const PointSet set{points};
  const KdTree tree(3, set);
  for (const Vec3& p : points) {
    std::array<Index, 2> nearest{};
    std::array<double, 2> squares{};
    const double at[] = {p.x, p.y, p.z};
    tree.knnSearch(at, 2, nearest.data(), squares.data());
    if (!(squares[1] > 0)) continue;
    bounds_.points.push_back(p);
    bounds_.lengths.push_back(std::sqrt(squares[1]));
  }
}

KeptFeatures Preparation::kept_features(const FeatureGraph& features) const {
  KeptFeatures kept;
  if (keep_vertices_.empty()) return kept;
  for (const Index v : features.corners) kept.corners.push_back(v < kept_as_.size() ? kept_as_[v] : kNone);
  for (const FeatureCurve& curve : features.curves) {
    const std::vector<Index>& on = curve.vertices;
    const bool whole =
        !curve.closed && std::all_of(on.begin() + 1, on.end() - 1, [&](Index v) { return v >= kept_as_.size(); });
    kept.curves.push_back(
        whole && std::binary_search(keep_edges_.begin(), keep_edges_.end(), sorted_edge(on.front(), on.back())));
  }
  return kept;
}

// Where a curve passes a point of another part of the surface, an edge across its bend there would cross that part.
// Each corner takes a vertex; where they would take most, they cross.
void Preparation::add_corners_where_curves_touch() {
  if (touching_.empty()) return;
  std::vector<char> is_on_curve(mesh_.vertices.size(), 0);
  for (const FeatureCurve& curve : features_.curves)
    for (const Index v : curve.vertices) is_on_curve[v] = 1;
  std::vector<Index> corners;
  for (const Index v : touching_)
    if (is_on_curve[v]) corners.push_back(v);
  if (features_.corners.size() + corners.size() > unbounded_->sizing.vertices / kVerticesPerCorner) return;
  add_corners(features_, corners);
}

// What noise folds is no feature.
void Preparation::find_noise(FeatureOptions& features) {
  const std::size_t count = target_.vertices ? target_.vertices : compute_sizing(mesh_, {}, target_).vertices;
  noisy_ = has_noisy_normals(mesh_, std::max<std::size_t>(count, 4));
  if (noisy_ && features.mode == FeatureMode::automatic) features.mode = FeatureMode::none;
}

// Without details. Returns the edge length at each vertex.
std::vector<double> Preparation::lay_down_plain() {
  unbounded_ = refine_for_density(mesh_, sizing_, target_);
  std::vector<double> lengths(mesh_.vertices.size());
  for (Index v = 0; v < lengths.size(); ++v) lengths[v] = target_edge_length(unbounded_->sizing, v);
  return lengths;
}

// `lengths` are those of lay_down_plain(). What lies between components that are set apart is no detail.
void Preparation::plan(std::vector<double> lengths) {
  add_wedges(lengths);
  plan_features(lengths);
}

// Cuts components that are set apart where they cross, and plans with what they have in common. Where the result has no
// room for that it is let go. False, and nothing is done, if there is none.
bool Preparation::plan_with_intersections() {
  if (apart_.empty() || noisy_ || !keep_vertices_.empty()) return false;
  std::optional<Corefinement> corefined = corefine_components(mesh_, kMostPairs);
  if (!corefined) return false;
  auto uncut = std::make_shared<const Preparation>(*this);
  std::vector<double>& values = sizing_.attribute;
  if (!values.empty())
    for (const InsertedVertex& v : corefined->inserted) {
      double value = 0;
      for (std::size_t k = 0; k < 3; ++k) value += v.weights[k] * values[mesh_.triangles[v.triangle][k]];
      values.push_back(value);
    }
  mesh_ = corefined->mesh;
  features_ = split_features(features_, corefined->splits);
  const Preparation cut = *this;
  std::vector<std::array<Index, 2>> left_out;
  double whole = 0;
  for (int round = 0; round < kMostRounds; ++round) {
    *this = cut;
    meeting_ = IntersectionCurves(*corefined, left_out, features_);
    const double length = meeting_.length(mesh_);
    whole = std::max(whole, length);
    if (meeting_.empty() || length < kLeastShared * whole) break;
    sizing_.sharp = features_.edges;
    std::vector<double> lengths = lay_down_plain();
    const std::size_t vertices = unbounded_->sizing.vertices;
    plan(std::move(lengths));
    const std::vector<std::array<Index, 2>> crowded = divide_intersection_curves();
    const std::size_t edges = kept_lengths_.points.size();
    // Half of the edges may turn out to be crowded.
    if (kLeastPerEdge * edges > (crowded.empty() ? vertices : 2 * vertices)) break;
    if (crowded.empty()) {
      lets_cross_ = !left_out.empty();
      uncut_ = std::move(uncut);
      return true;
    }
    left_out.insert(left_out.end(), crowded.begin(), crowded.end());
  }
  *this = *uncut;
  return false;
}

Preparation Preparation::without_intersections() const {
  Preparation without = *uncut_;
  without.plan(without.lay_down_plain());
  return without;
}

// `lengths` are those of lay_down_plain(), before and after.
void Preparation::add_wedges(std::vector<double>& lengths) {
  const std::size_t vertices = mesh_.vertices.size();
  const std::vector<EdgePoint> added = link_wedges(mesh_, features_, lengths);
  if (added.empty()) return;
  features_ = split_features(features_, splits_of(added, vertices));
  sizing_.sharp = features_.edges;
  add_values(added);
  meeting_.follow(splits_of(added, vertices));
  lengths = lay_down_plain();
}

void Preparation::add_values(const std::vector<EdgePoint>& added) {
  std::vector<double>& values = sizing_.attribute;
  for (const auto& [a, b, t] : added)
    if (!values.empty()) values.push_back(values[a] + t * (values[b] - values[a]));
}

// By the edge lengths that there are beside details. Returns the edges along which there is no room.
std::vector<std::array<Index, 2>> Preparation::divide_intersection_curves() {
  undivided_ = {mesh_, features_, sizing_, meeting_};
  IntersectionCurves::Division division = meeting_.divide(mesh_, features_, lay_down_bounded());
  sizing_.sharp = features_.edges;
  add_values(division.added);
  kept_lengths_ = {std::move(division.middles), std::move(division.lengths)};
  unbounded_.reset();
  return std::move(division.crowded);
}

void Preparation::plan_features(const std::vector<double>& lengths) {
  const Sizing& plain = unbounded_->sizing;
  std::optional<TriangleMesh> moved;
  if (!apart_.empty()) apart_.move(moved.emplace(mesh_));
  DetailPlan plan = plan_details(moved ? *moved : mesh_, features_, lengths, plain.vertices, resolves_all_);
  features_ = std::move(plan.features);
  add_corners(features_, keep_vertices_);
  add_corners_where_curves_touch();
  if (!meeting_.empty()) meeting_.put_into(features_);
  detail_ = plan.result;
  if (resolves_all_ && detail_.vertices > plain.vertices) {
    target_ = {detail_.vertices, 0};
    unbounded_.reset();
  }
  bound({std::move(plan.points), std::move(plan.lengths)});
}

void Preparation::bound(const SizeBounds& bounds) {
  if (!bounds.points.empty()) unbounded_.reset();
  const std::size_t before = bounds_.points.size();
  bounds_.add(bounds);
  // Cells that hold next to nothing ask for next to nothing.
  const double least = kRounding * bounding_box(mesh_).diagonal();
  for (std::size_t k = before; k < bounds_.points.size(); ++k) {
    bounds_.points[k] = apart_.back(bounds_.points[k]);
    bounds_.lengths[k] = std::max(bounds_.lengths[k], least);
  }
}

bool Preparation::divide_intersections_again() {
  if (!undivided_) return false;
  Undivided before = *std::exchange(undivided_, std::nullopt);
  mesh_ = std::move(before.mesh);
  features_ = std::move(before.features);
  sizing_ = std::move(before.sizing);
  meeting_ = std::move(before.meeting);
  kept_lengths_ = {};
  divide_intersection_curves();
  return true;
}

void Preparation::ask_for(std::size_t vertices) {
  target_ = {vertices, 0};
  unbounded_.reset();
}

SizedMesh Preparation::lay_down_bounded() const {
  SizeBounds most = bounds_;
  most.add(kept_lengths_);
  std::optional<SizeField> field;
  if (!most.points.empty()) field.emplace(most.points, most.lengths, kDetailGradation);
  std::optional<SizeFloor> floor;
  if (!kept_lengths_.points.empty()) floor.emplace(kept_lengths_.points, kept_lengths_.lengths, kDetailGradation);
  return refine_for_density(mesh_, sizing_, target_, {field ? &*field : nullptr, floor ? &*floor : nullptr});
}

PreparedInput Preparation::lay_down() {
  const bool bounded = !bounds_.points.empty() || !kept_lengths_.points.empty();
  SizedMesh sized = unbounded_ && !bounded ? *std::exchange(unbounded_, std::nullopt) : lay_down_bounded();
  if (sized.sizing.vertices > kMostVertices && given_seeds_ == 0)
    throw Error(fmt::format("edges of {} make about {:.3g} vertices, more than {}; ask for longer ones",
                            target_.edge_length, static_cast<double>(sized.sizing.vertices), kMostVertices));
  PreparedInput prepared;
  prepared.detail = detail_;
  prepared.noisy = noisy_;
  prepared.features = split_features(features_, sized.splits);
  prepared.kept = kept_features(prepared.features);
  if (!meeting_.empty()) prepared.whole = meeting_.among(prepared.features);
  prepared.mesh = std::move(sized.mesh);
  prepared.mesh.feature_edges.clear();
  prepared.mesh.labels.clear();
  for (const Index v : prepared.features.corners) prepared.corners.push_back(prepared.mesh.vertices[v]);
  apart_.move(prepared.mesh);
  if (!mesh_.labels.empty())
    for (Index t : sized.parent) prepared.mesh.labels.push_back(mesh_.labels[t]);
  prepared.density = std::move(sized.sizing.density);
  prepared.unit_edge = sized.sizing.unit_edge;
  prepared.vertices = given_seeds_ == 0 ? sized.sizing.vertices : given_seeds_;
  if (prepared.vertices < 4)
    throw Error(fmt::format("edges of {} make {} vertices, fewer than 4; ask for shorter ones", target_.edge_length,
                            prepared.vertices));
  return prepared;
}

}  // namespace bisector
