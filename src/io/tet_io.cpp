#include "bisector/io.h"

#include <algorithm>
#include <filesystem>
#include <iterator>
#include <utility>

#include "core/grouping.h"
#include "core/orientation.h"
#include "core/parallel.h"
#include "io/files.h"
#include "io/formats.h"
#include "io/tet_formats.h"
#include "mesh/attribute_sizes.h"
#include "mesh/tet_adjacency.h"
#include "mesh/topology.h"

namespace bisector {

using namespace io;

namespace {

using Edge = std::array<Index, 2>;

template <std::size_t N>
void check_corners(const std::string& path, const char* kind, const std::vector<std::array<Index, N>>& elements) {
  for (std::size_t i = 0; i < elements.size(); ++i) {
    std::array<Index, N> corners = elements[i];
    std::sort(corners.begin(), corners.end());
    const auto twice = std::adjacent_find(corners.begin(), corners.end());
    if (twice != corners.end())
      fail(path, fmt::format("{} {}: vertex {} occurs twice in it; remove it", kind, i, *twice));
  }
}

void turn_positive(const std::string& path, TetMesh& mesh, const Context& context) {
  std::vector<signed char> sign(mesh.tets.size());
  parallel_each(mesh.tets.size(), [&](std::size_t i) {
    Tetrahedron& t = mesh.tets[i];
    sign[i] = static_cast<signed char>(
        orientation(mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]], mesh.vertices[t[3]]));
    if (sign[i] < 0) std::swap(t[2], t[3]);
  });
  const auto flat = static_cast<std::size_t>(std::count(sign.begin(), sign.end(), 0));
  if (flat > 0)
    context.warn(fmt::format("{}: {} no volume", name_of(path), quantity(flat, "tetrahedron has", "tetrahedra have")));
}

Triangle ascending(Triangle t) {
  std::sort(t.begin(), t.end());
  return t;
}

// Marked triangles as their only tetrahedron sees them from inside.
void turn_outward(TetMesh& mesh) {
  if (mesh.boundary.empty()) return;
  std::vector<std::pair<Triangle, std::size_t>> marks;
  for (std::size_t i = 0; i < mesh.boundary.size(); ++i) marks.emplace_back(ascending(mesh.boundary[i]), i);
  std::sort(marks.begin(), marks.end());
  std::vector<Triangle> outward(mesh.boundary.size());
  std::vector<char> sides(mesh.boundary.size(), 0);
  for (const Tetrahedron& tet : mesh.tets)
    for (int k = 0; k < 4; ++k) {
      const Triangle facet = facet_of(tet, k), key = ascending(facet);
      auto at = std::lower_bound(marks.begin(), marks.end(), std::pair(key, std::size_t{0}));
      for (; at != marks.end() && at->first == key; ++at) {
        outward[at->second] = facet;
        if (sides[at->second] < 2) ++sides[at->second];
      }
    }
  for (std::size_t i = 0; i < mesh.boundary.size(); ++i) {
    Triangle& t = mesh.boundary[i];
    if (sides[i] != 1) continue;
    const auto first = std::find(outward[i].begin(), outward[i].end(), t[0]) - outward[i].begin();
    if (outward[i][static_cast<std::size_t>(first + 1) % 3] != t[1]) std::swap(t[1], t[2]);
  }
}

void drop_zero_marks(std::vector<std::int32_t>& marks) {
  if (std::all_of(marks.begin(), marks.end(), [](std::int32_t mark) { return mark == 0; })) marks.clear();
}

void check_sound(const std::string& path, const TetMesh& mesh) {
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v)
    for (int k = 0; k < 3; ++k)
      if (coordinate_flaw(mesh.vertices[v][k]))
        fail(path, fmt::format("vertex {}: a coordinate is not finite or beyond 1e100; nothing was written", v));
  const auto check = [&](const char* kind, const auto& elements) {
    for (std::size_t i = 0; i < elements.size(); ++i)
      for (const Index v : elements[i])
        if (v >= mesh.vertices.size())
          fail(path, fmt::format("{} {}: index {} is out of range, the mesh has {} vertices; nothing was written", kind,
                                 i, v, mesh.vertices.size()));
  };
  check("tetrahedron", mesh.tets);
  check("boundary triangle", mesh.boundary);
  check("feature edge", mesh.feature_edges);
  if (!mesh.regions.empty() && mesh.regions.size() != mesh.tets.size())
    fail(path, fmt::format("{} regions for {} tetrahedra; give one each", mesh.regions.size(), mesh.tets.size()));
  if (!mesh.boundary_labels.empty() && mesh.boundary_labels.size() != mesh.boundary.size())
    fail(path,
         fmt::format("{} labels for {} triangles; give one each", mesh.boundary_labels.size(), mesh.boundary.size()));
  check_attributes(mesh);
}

// Every edge has its node.
void check_order(const std::string& path, const TetMesh& mesh, const SecondOrder& order) {
  if (order.empty()) return;
  if (order.nodes.size() != order.edges.size())
    fail(path, fmt::format("{} nodes for {} edges; give one each", order.nodes.size(), order.edges.size()));
  const auto check = [&](const auto& elements) {
    for (const auto& element : elements)
      for (std::size_t i = 0; i < element.size(); ++i)
        for (std::size_t j = 0; j < i; ++j)
          if (order.node_of(element[i], element[j]) == kNone)
            fail(path, fmt::format("the edge of vertices {} and {} has no node; nothing was written", element[j],
                                   element[i]));
  };
  check(mesh.tets);
  check(mesh.boundary);
  check(mesh.feature_edges);
}

}  // namespace

bool is_tet_format(const std::string& path) {
  const std::string extension = lower_extension(path);
  return std::any_of(file_formats().begin(), file_formats().end(),
                     [&](const FileFormat& format) { return format.reads_tets && format.extension == extension; });
}

Soup io::surface_of(const std::string& path, TetSoup soup) {
  if (!soup.tets.empty())
    fail(path, fmt::format("it holds {}, where a surface is needed; give their boundary",
                           quantity(soup.tets.size(), "tetrahedron", "tetrahedra")));
  Soup surface;
  surface.vertices = std::move(soup.vertices);
  surface.faces = rows_of(soup.triangles);
  drop_zero_marks(soup.labels);
  surface.labels = std::move(soup.labels);
  surface.edges = std::move(soup.edges);
  surface.label_names = std::move(soup.label_names);
  for (std::vector<Attribute>* attributes : {&soup.attributes, &soup.triangle_attributes})
    for (Attribute& attribute : *attributes)
      if (attributes == &soup.triangle_attributes || attribute.site == Attribute::Site::vertex)
        surface.attributes.push_back(std::move(attribute));
  return surface;
}

TetMesh io::mesh_of(const std::string& path, TetSoup soup, const Context& context) {
  if (soup.tets.empty() && soup.triangles.empty())
    fail(path, "there are neither tetrahedra nor triangles; export a mesh of them");
  check_corners(path, "tetrahedron", soup.tets);
  check_corners(path, "triangle", soup.triangles);
  TetMesh mesh;
  mesh.vertices = std::move(soup.vertices);
  mesh.tets = std::move(soup.tets);
  mesh.regions = std::move(soup.regions);
  mesh.boundary = std::move(soup.triangles);
  mesh.boundary_labels = std::move(soup.labels);
  mesh.region_names = std::move(soup.region_names);
  mesh.label_names = std::move(soup.label_names);
  mesh.attributes = std::move(soup.attributes);
  if (soup.curved > 0)
    context.warn(fmt::format("{}: {} of second order taken by their corners", name_of(path),
                             quantity(soup.curved, "element", "elements")));
  turn_positive(path, mesh, context);
  turn_outward(mesh);
  drop_zero_marks(mesh.regions);
  drop_zero_marks(mesh.boundary_labels);
  for (Edge e : soup.edges) {
    if (e[0] == e[1]) continue;
    if (e[0] > e[1]) std::swap(e[0], e[1]);
    mesh.feature_edges.push_back(e);
  }
  std::sort(mesh.feature_edges.begin(), mesh.feature_edges.end());
  mesh.feature_edges.erase(std::unique(mesh.feature_edges.begin(), mesh.feature_edges.end()), mesh.feature_edges.end());
  return mesh;
}

TetMesh read_tet_mesh(const std::string& path, const Context& context) {
  const Format& format = format_of(path, &FileFormat::reads_tets, "tetrahedral meshes");
  return mesh_of(path, format.read_tets(path, read_bytes(path)), context);
}

void write_tet_mesh(const std::string& path, const TetMesh& mesh, const SecondOrder& order) {
  const Format& format = order.empty()
                             ? format_of(path, &FileFormat::writes_tets, "tetrahedral meshes")
                             : format_of(path, &FileFormat::writes_second_order, "tetrahedra of second order");
  check_sound(path, mesh);
  check_order(path, mesh, order);
  write_file(path, format.bytes_of_tets(mesh, order));
}

std::string io::solution_beside(const std::string& path) {
  const std::string extension = lower_extension(path);
  if (extension != ".mesh" && extension != ".meshb") return {};
  const std::string stem = path.substr(0, path.size() - extension.size());
  return extension == ".meshb" && std::filesystem::exists(stem + ".solb") ? stem + ".solb" : stem + ".sol";
}

std::vector<double> read_tet_attribute(const std::string& path, const std::string& name) {
  const std::string extension = lower_extension(path);
  if (extension == ".vtk") return read_vtk_attribute(path, read_bytes(path), name);
  if (extension == ".vtu") return read_vtu_attribute(path, read_bytes(path), name);
  const bool binary = extension == ".meshb";
  if (!binary && extension != ".mesh")
    fail(path, fmt::format("there are no values '{}' at vertices, {} files are not read for them; use .vtk, .vtu, or "
                           ".mesh or .meshb with a .sol",
                           printable(name), extension.empty() ? "such" : printable(extension)));
  const std::string solution = solution_beside(path), bytes = read_bytes(solution);
  const bool binary_solution = lower_extension(solution) == ".solb";
  const std::vector<double> values =
      binary_solution ? read_medit_solution_binary(solution, bytes) : read_medit_solution(solution, bytes);
  const std::string mesh = read_bytes(path);
  const std::size_t vertices = (binary ? read_medit_binary : read_medit)(path, mesh).vertices.size();
  if (values.size() != vertices)
    fail(solution,
         fmt::format("{} values for the {} vertices of {}; give one each", values.size(), vertices, name_of(path)));
  return values;
}

RequiredElements read_required(const std::string& path) {
  const std::string extension = lower_extension(path);
  const bool binary = extension == ".meshb";
  if (!binary && extension != ".mesh") return {};
  const std::string bytes = read_bytes(path);
  if (!binary && bytes.find("Required") == std::string::npos) return {};
  const TetSoup soup = (binary ? read_medit_binary : read_medit)(path, bytes);
  const auto indices = [&](const std::vector<std::int64_t>& listed, std::size_t count, const char* what) {
    std::vector<Index> found;
    for (const std::int64_t i : listed) {
      if (i < 1 || i > static_cast<std::int64_t>(count))
        fail(path, fmt::format("the required {} {} is out of range, the file has {}, counted from 1; mend it", what, i,
                               count));
      found.push_back(static_cast<Index>(i - 1));
    }
    std::sort(found.begin(), found.end());
    found.erase(std::unique(found.begin(), found.end()), found.end());
    return found;
  };
  RequiredElements required;
  required.vertices = indices(soup.required_vertices, soup.vertices.size(), "vertex");
  required.triangles = indices(soup.required_triangles, soup.triangles.size(), "triangle");
  for (const Index e : indices(soup.required_edges, soup.edges.size(), "edge")) {
    const auto [a, b] = soup.edges[e];
    required.edges.push_back({std::min(a, b), std::max(a, b)});
  }
  std::sort(required.edges.begin(), required.edges.end());
  required.edges.erase(std::unique(required.edges.begin(), required.edges.end()), required.edges.end());
  return required;
}

TriangleMesh surface_of_marks(const TetMesh& mesh) {
  TriangleMesh surface{mesh.vertices, mesh.boundary, {}, mesh.boundary_labels, {}, mesh.label_names};
  const EdgeTable table = edge_table(surface.triangles, surface.vertices.size());
  for (const Edge& e : mesh.feature_edges)
    if (std::binary_search(table.edges.begin(), table.edges.end(), e)) surface.feature_edges.push_back(e);
  std::copy_if(mesh.attributes.begin(), mesh.attributes.end(), std::back_inserter(surface.attributes),
               [](const Attribute& attribute) { return attribute.site == Attribute::Site::vertex; });
  return surface;
}

}  // namespace bisector
