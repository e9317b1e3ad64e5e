#include "bisector/io.h"

#include <algorithm>
#include <utility>

#include "core/orientation.h"
#include "core/parallel.h"
#include "io/files.h"
#include "io/tet_formats.h"
#include "mesh/tet_adjacency.h"
#include "mesh/topology.h"

namespace bisector {

using namespace io;

namespace {

using Edge = std::array<Index, 2>;

[[noreturn]] void fail_extension(const std::string& path, const char* known) {
  const std::string extension = lower_extension(path);
  if (extension.empty()) fail(path, fmt::format("no file name extension; use {}", known));
  fail(path, fmt::format("unknown format '{}' of tetrahedral meshes; use {}", printable(extension), known));
}

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
}

}  // namespace

bool is_tet_format(const std::string& path) {
  const std::string extension = lower_extension(path);
  return extension == ".mesh" || extension == ".msh" || extension == ".vtk" || extension == ".vtu";
}

TetMesh io::mesh_of(const std::string& path, TetSoup soup, const Context& context) {
  if (soup.tets.empty() && soup.triangles.empty())
    fail(path, "there are neither tetrahedra nor triangles; export a mesh of them");
  check_corners(path, "tetrahedron", soup.tets);
  check_corners(path, "triangle", soup.triangles);
  TetMesh mesh{std::move(soup.vertices),  std::move(soup.tets),   std::move(soup.regions),
               std::move(soup.triangles), std::move(soup.labels), {}};
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
  const std::string extension = lower_extension(path);
  TetSoup (*read)(const std::string&, std::string_view) = extension == ".mesh"  ? read_medit
                                                          : extension == ".msh" ? read_gmsh
                                                          : extension == ".vtk" ? read_vtk
                                                          : extension == ".vtu" ? read_vtu
                                                                                : nullptr;
  if (!read) fail_extension(path, ".mesh, .msh, .vtk or .vtu");
  return mesh_of(path, read(path, read_bytes(path)), context);
}

void write_tet_mesh(const std::string& path, const TetMesh& mesh) {
  const std::string extension = lower_extension(path);
  std::string (*format)(const TetMesh&) = extension == ".mesh"  ? format_medit
                                          : extension == ".msh" ? format_gmsh
                                          : extension == ".vtu" ? format_vtu
                                                                : nullptr;
  if (!format) fail_extension(path, ".mesh, .msh or .vtu");
  check_sound(path, mesh);
  write_file(path, format(mesh));
}

std::vector<double> read_tet_attribute(const std::string& path, const std::string& name) {
  const std::string extension = lower_extension(path);
  if (extension == ".vtk") return read_vtk_attribute(path, read_bytes(path), name);
  if (extension == ".vtu") return read_vtu_attribute(path, read_bytes(path), name);
  if (extension != ".mesh")
    fail(path, fmt::format("there are no values '{}' at vertices, {} files are not read for them; use .vtk, .vtu, or "
                           ".mesh with a .sol",
                           printable(name), extension.empty() ? "such" : printable(extension)));
  const std::string solution = path.substr(0, path.size() - extension.size()) + ".sol";
  std::vector<double> values = read_medit_solution(solution, read_bytes(solution));
  const std::size_t vertices = read_medit(path, read_bytes(path)).vertices.size();
  if (values.size() != vertices)
    fail(solution,
         fmt::format("{} values for the {} vertices of {}; give one each", values.size(), vertices, name_of(path)));
  return values;
}

TriangleMesh surface_of_marks(const TetMesh& mesh) {
  TriangleMesh surface{mesh.vertices, mesh.boundary, {}, mesh.boundary_labels, {}};
  const EdgeTable table = edge_table(surface.triangles, surface.vertices.size());
  for (const Edge& e : mesh.feature_edges)
    if (std::binary_search(table.edges.begin(), table.edges.end(), e)) surface.feature_edges.push_back(e);
  return surface;
}

}  // namespace bisector
