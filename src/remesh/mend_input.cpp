#include "remesh/mend_input.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <string>
#include <utility>

#include "core/geometry.h"
#include "mesh/caps.h"
#include "mesh/face_contacts.h"
#include "mesh/half_edges.h"
#include "mesh/joining.h"
#include "mesh/short_edges.h"
#include "mesh/topology.h"

namespace bisector {
namespace {

// Of the diagonal: how far vertices are moved that would be at the same point.
constexpr double kApart = 1e-7;
// Of the edge length: how high triangles are at most whose folds are let go.
constexpr double kFold = 0.05;
// Of the diagonal: what is put between faces in contact. Files in single precision keep it.
constexpr double kFacesApart = 2e-6;

MeshTopology topology_of(const TriangleMesh& mesh) { return analyse_topology(mesh.triangles, mesh.vertices.size()); }

// Those that are another one's, or that others are.
std::vector<Index> members_of_pairs(const std::vector<Index>& original) {
  std::vector<Index> members;
  for (Index v = 0; v < original.size(); ++v)
    if (original[v] != v) members.insert(members.end(), {v, original[v]});
  std::sort(members.begin(), members.end());
  members.erase(std::unique(members.begin(), members.end()), members.end());
  return members;
}

// Moves vertices that were one towards their own triangles, so that seeds there are not at the same point.
void part_fans(TriangleMesh& mesh, const std::vector<Index>& original) {
  std::vector<char> is_split(mesh.vertices.size(), 0);
  for (Index v = 0; v < original.size(); ++v)
    if (original[v] != v) is_split[v] = is_split[original[v]] = 1;
  std::vector<Vec3> inwards(mesh.vertices.size());
  for (const Triangle& t : mesh.triangles)
    for (std::size_t k = 0; k < 3; ++k) {
      if (!is_split[t[k]]) continue;
      const Vec3 across = 0.5 * (mesh.vertices[t[(k + 1) % 3]] + mesh.vertices[t[(k + 2) % 3]]) - mesh.vertices[t[k]];
      if (const double length = norm(across); length > 0) inwards[t[k]] += (1 / length) * across;
    }
  const double step = kApart * bounding_box(mesh).diagonal();
  for (Index v = 0; v < original.size(); ++v)
    if (const double length = norm(inwards[v]); is_split[v] && length > 0)
      mesh.vertices[v] += (step / length) * inwards[v];
}

// Takes those back that have edges in common with what they are equal to: there borders meet along lines.
void leave_seams(const TriangleMesh& mesh, std::vector<Index>& first) {
  std::vector<char> is_equal(first.size(), 0), on_seam(first.size(), 0);
  for (Index v = 0; v < first.size(); ++v)
    if (first[v] != v) is_equal[v] = is_equal[first[v]] = 1;
  std::map<std::array<Index, 2>, std::array<Index, 2>> edges;  // between points, and the first between vertices there
  for (const Triangle& t : mesh.triangles)
    for (std::size_t k = 0; k < 3; ++k) {
      const std::array<Index, 2> edge = ascending(t[k], t[(k + 1) % 3]);
      const auto [a, b] = edge;
      if (!is_equal[a] || !is_equal[b]) continue;
      if (edges.try_emplace(ascending(first[a], first[b]), edge).first->second != edge)
        on_seam[first[a]] = on_seam[first[b]] = 1;
    }
  for (Index v = 0; v < first.size(); ++v)
    if (on_seam[first[v]]) first[v] = v;
}

}  // namespace

std::string plural(std::size_t count, const char* word) {
  return fmt::format("{} {}{}", count, word, count == 1 ? "" : "s");
}

void rename_edges(const std::vector<Index>& vertex_of, std::vector<std::array<Index, 2>>& edges) {
  for (auto& edge : edges)
    for (Index& v : edge) v = vertex_of[v];
  std::erase_if(edges, [](const std::array<Index, 2>& e) { return e[0] == e[1]; });
}

void mend_rounding(WeldResult& welded, std::vector<std::array<Index, 2>> given, double edge, const Context& context) {
  rename_edges(welded.vertex_of, given);
  const double length = kRounding * bounding_box(welded.mesh).diagonal();
  const ShortEdges shortest = collapse_short_edges(welded.mesh, length, given, edge);
  if (shortest.collapsed + shortest.removed_parts > 0) {
    rename_edges(shortest.vertex_of, given);
    for (Index& v : welded.vertex_of)
      if (v != kNone) v = shortest.vertex_of[v];
    welded.merged_vertices += shortest.collapsed;
    welded.degenerate_triangles += shortest.removed_triangles;
  }
  if (shortest.collapsed > 0)
    context.warn(fmt::format("collapsed {} shorter than {:g}, {:g} of the diagonal, as rounding leaves them",
                             plural(shortest.collapsed, "edge"), length, kRounding));
  if (shortest.removed_parts > 0)
    context.warn(fmt::format("left out {} smaller than edges, with nothing inside but for rounding, {:g}",
                             plural(shortest.removed_parts, "closed part"), length));
  const double fold = kFold * edge;
  if (const std::size_t flipped = flip_caps(welded.mesh, length, fold, given); flipped > 0)
    context.warn(fmt::format("flipped {} of triangles lower than {:g}, or folded back and lower than {:g}",
                             plural(flipped, "edge"), length, fold));
}

void Separation::separate(TriangleMesh& mesh, Touching touching, const Context& context) {
  const MeshTopology before = topology_of(mesh);
  if (before.manifold) return;
  halved_ = halve_touching_edges(mesh, touching);
  vertices_ = mesh.vertices.size();
  original_ = separate_touching(mesh, touching);
  if (original_.size() == vertices_) return;
  part_fans(mesh, original_);
  const std::size_t edges = before.non_manifold_edges - topology_of(mesh).non_manifold_edges;
  std::vector<std::string> where;
  if (before.non_manifold_vertices > 0) where.push_back("in " + plural(before.non_manifold_vertices, "point"));
  if (edges > 0) where.push_back("along " + plural(edges, "edge"));
  context.warn(
      fmt::format("parts of the surface touch {}; they are meshed as if they did not", fmt::join(where, " and ")));
}

std::vector<std::array<Index, 2>> Separation::edges(const TriangleMesh& mesh,
                                                    const std::vector<std::array<Index, 2>>& given) const {
  if (mesh.vertices.size() == given_) return given;
  return edges_after_separating(mesh, original_, edges_after_halving(given, halved_, vertices_));
}

std::vector<Index> Separation::originals(std::size_t vertices) const {
  std::vector<Index> of = original_;
  for (std::size_t v = of.size(); v < vertices; ++v) of.push_back(static_cast<Index>(v));
  for (Index& v : of)
    if (v >= given_) v = kNone;
  return of;
}

std::vector<Index> Separation::parted() const { return members_of_pairs(original_); }

std::vector<double> Separation::values(std::vector<double> given) const {
  for (const auto& [a, b] : halved_) given.push_back(0.5 * (given[a] + given[b]));
  for (std::size_t v = vertices_; v < original_.size(); ++v) given.push_back(double{given[original_[v]]});
  return given;
}

std::vector<Index> part_equal_points(TriangleMesh& mesh, bool seams, const Context& context) {
  std::vector<Index> first = first_equal(mesh.vertices);
  if (!seams) leave_seams(mesh, first);
  std::size_t count = 0;
  for (Index v = 0; v < first.size(); ++v) count += first[v] != v;
  if (count == 0) return {};
  part_fans(mesh, first);
  context.warn(fmt::format("parts of the surface have {} at the points of others; they are meshed as if they did not",
                           count == 1 ? "1 vertex" : fmt::format("{} vertices", count)));
  return members_of_pairs(first);
}

void open_contacts(TriangleMesh& mesh, const Context& context) {
  const double diagonal = bounding_box(mesh).diagonal();
  const std::size_t count = open_face_contacts(mesh, kRounding * diagonal, kFacesApart * diagonal);
  if (count > 0)
    context.warn(fmt::format("parts of the surface lie on each other with {}; these are moved {:g} apart",
                             plural(count, "triangle"), kFacesApart * diagonal));
}

}  // namespace bisector
