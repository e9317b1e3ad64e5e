#include "job/inputs.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "bisector/attributes.h"
#include "bisector/error.h"
#include "bisector/io.h"
#include "bisector/repair.h"
#include "core/degenerate.h"
#include "core/geometry.h"
#include "core/magnitude.h"
#include "job/messages.h"
#include "job/outputs.h"
#include "mesh/tet_topology.h"
#include "remesh/sizing.h"

namespace bisector::job {
namespace {

// What is finer than its edges a mesh does not show. The triangles of a soup may lie upon each other, so that their
// area says little.
double default_alpha(const TriangleMesh& mesh, double edge) {
  constexpr double kFinest = 1.0 / 500, kCoarsest = 1.0 / 20;  // in diagonals of the bounding box
  const double diagonal = bounding_box(mesh).diagonal();
  return std::clamp(edge, kFinest * diagonal, kCoarsest * diagonal);
}

std::vector<std::string> names_of(const std::vector<Attribute>& attributes) {
  std::vector<std::string> names;
  for (const Attribute& attribute : attributes) names.push_back(attribute.name);
  return names;
}

std::vector<Attribute> without(std::vector<Attribute> attributes, const std::string& name) {
  std::erase_if(attributes, [&](const Attribute& attribute) { return attribute.name == name; });
  return attributes;
}

// The numbers of a mesh in memory.
std::vector<double> given_density(const GivenMesh& mesh, const std::string& name) {
  std::vector<std::string> known;
  for (const Attribute& attribute : mesh.tets ? mesh.tets->attributes : mesh.surface->attributes) {
    if (attribute.site != Attribute::Site::vertex || attribute.components != 1) continue;
    if (attribute.name == name) return attribute.values;
    known.push_back(attribute.name);
  }
  throw Error(fmt::format("--density: the mesh's vertices have no numbers '{}'{}", name,
                          known.empty() ? "; give some" : ", use one of " + fmt::format("{}", fmt::join(known, ", "))));
}

void repeat_warnings(const GivenMesh& mesh, Journal& journal) {
  for (const std::string& warning : mesh.warnings) journal.warn(warning);
}

}  // namespace

Json size_json(const Domain& domain) {
  if (!domain.tets) return input_json(*domain.surface);
  return {{"vertices", domain.tets->vertices.size()},
          {"faces", domain.surface->triangles.size()},
          {"tets", domain.tets->tets.size()}};
}

std::shared_ptr<const TriangleMesh> read_surface(const std::string& path, const std::shared_ptr<const GivenMesh>& given,
                                                 Journal& journal) {
  if (!given) return std::make_shared<const TriangleMesh>(read_mesh(path, journal.context()));
  repeat_warnings(*given, journal);
  if (!given->surface) throw Error("the mesh has no faces; a surface is needed here");
  return {given, &*given->surface};
}

Domain read_domain(const std::string& path, const std::shared_ptr<const GivenMesh>& given, bool marks,
                   Journal& journal) {
  if (given ? !given->tets : !is_tet_format(path)) return {read_surface(path, given, journal), nullptr};
  Domain domain;
  if (given) {
    repeat_warnings(*given, journal);
    domain.tets = {given, &*given->tets};
  } else {
    domain.tets = std::make_shared<const TetMesh>(read_tet_mesh(path, journal.context()));
  }
  const TetMesh& mesh = *domain.tets;
  if (mesh.tets.empty()) return {std::make_shared<const TriangleMesh>(surface_of_marks(mesh)), nullptr};
  if (marks) domain.surface = std::make_shared<const TriangleMesh>(boundary_surface(mesh));
  else domain.surface = std::make_shared<const TriangleMesh>(TriangleMesh{mesh.vertices, boundary_facets(mesh.tets)});
  return domain;
}

void require_meshable(const std::string& path, const Domain& domain) {
  const auto has_area = [&](const Triangle& t) {
    const std::vector<Vec3>& p = domain.surface->vertices;
    return std::isnormal(norm2(twice_area_normal(p[t[0]], p[t[1]], p[t[2]]))) && !collinear(p[t[0]], p[t[1]], p[t[2]]);
  };
  try {
    require_moderate_model(domain.tets ? domain.tets->vertices : domain.surface->vertices, "vertex");
    if (std::none_of(domain.surface->triangles.begin(), domain.surface->triangles.end(), has_area))
      throw Error("no triangle has an area; check the export");
  } catch (const Error& error) {
    throw Error(path.empty() ? error.what() : path + ": " + error.what());
  }
}

std::vector<Vec3> read_seeds(const std::string& path, const Given& given, std::size_t count) {
  std::vector<Vec3> seeds = given.seeds ? *given.seeds : read_points(path);
  if (count != 0 && count != seeds.size())
    throw Error(fmt::format("{}: {}{}, but -n asks for {}; leave -n out", given.seeds ? "--seeds" : path,
                            counted(seeds.size(), "seed", "seeds"), given.seeds ? "" : " in the file", count));
  return seeds;
}

std::vector<double> read_density(const std::string& path, const std::string& attribute, const Given& given,
                                 std::size_t vertices) {
  if (given.density.empty()) {
    if (given.mesh) return given_density(*given.mesh, attribute);
    return is_tet_format(path) ? read_tet_attribute(path, attribute) : read_vertex_attribute(path, attribute);
  }
  if (given.density.size() != vertices)
    throw Error(fmt::format("--density: {} for {}; give one each", counted(given.density.size(), "value", "values"),
                            counted(vertices, "vertex", "vertices")));
  return given.density;
}

std::vector<Index> read_kept(const std::string& path, const std::vector<Index>& given, std::size_t count,
                             const char* what, const char* option) {
  if (!path.empty()) return read_indices(path, count, what);
  std::vector<Index> kept = given;
  std::sort(kept.begin(), kept.end());
  kept.erase(std::unique(kept.begin(), kept.end()), kept.end());
  if (!kept.empty() && kept.back() >= count)
    throw Error(fmt::format("{}: there is no {} {}, the mesh has {}; leave it out", option, what, kept.back(), count));
  return kept;
}

void warn_of_lost_attributes(const std::string& path, const TriangleMesh& surface, const std::string& used,
                             Journal& journal) {
  const std::string lost = loss_of_attributes(path, without(carried_attributes(surface), used), kMeshFormats);
  if (!lost.empty()) journal.warn(lost);
}

void warn_of_lost_attributes(const std::string& path, const Domain& domain, const std::string& used, Journal& journal) {
  std::vector<Attribute> kept, left;
  for (const Attribute& attribute : without(domain.tets ? domain.tets->attributes : domain.surface->attributes, used))
    (domain.tets || attribute.site == Attribute::Site::vertex ? kept : left).push_back(attribute);
  if (!left.empty())
    journal.warn(fmt::format("attributes of faces do not become those of tetrahedra: {} {} lost",
                             fmt::join(names_of(left), ", "), left.size() == 1 ? "is" : "are"));
  const std::string lost = loss_of_attributes(path, kept, kTetFormats);
  if (!lost.empty()) journal.warn(lost);
}

void leave_out_folds(const WrapOption& wrap, FeatureOptions& features) {
  if (wrap.on && features.mode == FeatureMode::automatic) features.mode = FeatureMode::none;
}

Json wrap_if_asked(const WrapOption& option, const TriangleMesh& mesh, std::size_t vertices, double edge_length,
                   bool tetrahedra, Journal& journal, TriangleMesh& wrapped) {
  if (!option.on) return nullptr;
  journal.phase("wrapping");
  const SizingTarget target{edge_length > 0 ? 0 : vertices, edge_length};
  const double edge = compute_sizing(mesh, {}, target).unit_edge;
  const double alpha = option.alpha > 0 ? option.alpha : default_alpha(mesh, edge);
  // Both sides of a shell share the vertices, so its edges are longer than those of a mesh of the sheet.
  const double thickness = !tetrahedra ? 0 : edge_length > 0 ? edge : std::sqrt(2.0) * edge;
  WrapResult result = wrap(mesh, alpha, thickness, journal.context());
  wrapped = std::move(result.mesh);
  wrapped.unit = mesh.unit;
  if (thickness > 0 && 2 * result.offset >= thickness)
    journal.warn(fmt::format(
        "--wrap: sheets with both sides outside became shells about an edge thick, {:.4g}, for tetrahedra to "
        "fit into them, and all of the wrap lies half of that outside; a larger ALPHA may close them",
        2 * result.offset));
  if (!mesh.labels.empty()) journal.warn("--wrap: the input's face labels are lost, for the wrap has faces of its own");
  return {{"alpha", alpha},
          {"offset", result.offset},
          {"vertices", wrapped.vertices.size()},
          {"faces", wrapped.triangles.size()}};
}

}  // namespace bisector::job
