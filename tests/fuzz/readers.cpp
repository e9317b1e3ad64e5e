// All that reads what others wrote.
#include <CLI/CLI.hpp>

#include <algorithm>
#include <array>
#include <filesystem>
#include <utility>

#include "batch/jobs_file.h"
#include "bisector/io.h"
#include "checkpoint/bytes.h"
#include "checkpoint/step_store.h"
#include "cli/program.h"
#include "fuzz/target.h"
#include "host/device/cache_file.h"
#include "io/ply_parts.h"
#include "tetmesh/tetgen_reply.h"

namespace bisector::fuzz {
namespace {

void check(const TriangleMesh& mesh) {
  const std::size_t n = mesh.vertices.size();
  for (const Triangle& t : mesh.triangles)
    for (const Index v : t) require(v < n, "a triangle's corner is a vertex");
  for (const auto& edge : mesh.feature_edges) require(edge[0] < n && edge[1] < n, "an edge's end is a vertex");
  const auto of_triangles = [&](std::size_t size) { return size == 0 || size == mesh.triangles.size(); };
  require(of_triangles(mesh.labels.size()) && of_triangles(mesh.face_of_triangle.size()), "a number for each triangle");
  for (const Attribute& a : mesh.attributes) {
    const std::size_t sites = a.site == Attribute::Site::vertex    ? n
                              : a.site == Attribute::Site::element ? mesh.triangles.size()
                                                                   : 3 * mesh.triangles.size();
    require(a.values.size() == a.components * sites, "an attribute has numbers for each site");
  }
}

void check(const TetMesh& mesh) {
  for (const Tetrahedron& t : mesh.tets)
    for (const Index v : t) require(v < mesh.vertices.size(), "a tetrahedron's corner is a vertex");
  for (const Triangle& t : mesh.boundary)
    for (const Index v : t) require(v < mesh.vertices.size(), "a triangle's corner is a vertex");
  for (const auto& edge : mesh.feature_edges)
    require(std::max(edge[0], edge[1]) < mesh.vertices.size(), "an edge's end is a vertex");
  require(mesh.regions.empty() || mesh.regions.size() == mesh.tets.size(), "a region for each tetrahedron");
  require(mesh.boundary_labels.empty() || mesh.boundary_labels.size() == mesh.boundary.size(), "a label each");
}

void read_surface(std::string_view bytes, const char* name) {
  guarded([&] { check(read_mesh(file_of(bytes, name))); });
}

void read_solid(std::string_view bytes, const char* name) {
  const std::string path = file_of(bytes, name);
  guarded([&] { check(read_tet_mesh(path)); });
  guarded([&] { check(read_mesh(path)); });
}

void read_cloud(std::string_view bytes, const char* name) {
  guarded([&] {
    const PointCloud cloud = read_point_cloud(file_of(bytes, name));
    require(!cloud.points.empty(), "there is a point");
    require(cloud.classification.empty() || cloud.classification.size() == cloud.points.size(), "a class each");
  });
}

template <const char* kName>
void surface(std::string_view bytes) {
  read_surface(bytes, kName);
}
template <const char* kName>
void solid(std::string_view bytes) {
  read_solid(bytes, kName);
}
template <const char* kName>
void cloud(std::string_view bytes) {
  read_cloud(bytes, kName);
}

constexpr char kOff[] = "a.off", kObj[] = "a.obj", kStl[] = "a.stl", k3mf[] = "a.3mf", kVtp[] = "a.vtp",
               kMesh[] = "a.mesh", kMeshb[] = "a.meshb", kMsh[] = "a.msh", kVtk[] = "a.vtk", kVtu[] = "a.vtu",
               kXyz[] = "a.xyz", kPcd[] = "a.pcd", kLas[] = "a.las";

void ply(std::string_view bytes) {
  const std::string path = file_of(bytes, "a.ply");
  guarded([&] { check(read_mesh(path)); });
  guarded([&] {
    const io::PlyParts parts(path);
    for (std::size_t v = 0; v < parts.vertices(); ++v) parts.vertex(v);
    for (std::size_t t = 0; t < parts.triangles(); ++t)
      for (const Index v : parts.triangle(t)) require(v < parts.vertices(), "a triangle's corner is a vertex");
  });
  guarded([&] { read_point_cloud(path); });
  guarded([&] { read_vertex_attribute(path, "quality"); });
}

void medit(std::string_view bytes) {
  read_solid(bytes, kMesh);
  guarded([&] { read_required(file_of(bytes, kMesh)); });
}

// A solution beside a mesh of four vertices, ASCII and binary.
void sol(std::string_view bytes) {
  static const std::string mesh = file_of(
      "MeshVersionFormatted 2 Dimension 3 Vertices 4 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1 0 Tetrahedra 1 1 2 3 4 0 End",
      "s.mesh");
  file_of(bytes, "s.sol");
  guarded([&] { require(read_tet_attribute(mesh, "v").size() == 4, "a value for each vertex"); });
}

void feature_edges(std::string_view bytes) {
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  mesh.triangles = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}};
  guarded([&] {
    for (const auto& edge : read_feature_edges(file_of(bytes, "a.edges"), mesh))
      require(edge[0] < 4 && edge[1] < 4, "an edge's end is a vertex");
  });
}

void indices(std::string_view bytes) {
  guarded([&] {
    for (const Index i : read_indices(file_of(bytes, "a.txt"), 100, "vertex")) require(i < 100, "an index in range");
  });
}

void jobs(std::string_view bytes) {
  guarded([&] { batch::read_jobs(file_of(bytes, "a.jsonl")); });
}

// Behind the line that tells whose the file is.
void checkpoint(std::string_view bytes) {
  static const std::string head = [] {
    const std::string path = file_of("", "new.checkpoint");
    std::filesystem::remove(path);
    StepStore store(path, "fuzz", {});
    std::string line(4096, '\0');
    std::FILE* file = std::fopen(path.c_str(), "rb");
    line.resize(std::fread(line.data(), 1, line.size(), file));
    std::fclose(file);
    return line;
  }();
  guarded([&] {
    CheckpointOptions options;
    options.resume = true;
    StepStore store(file_of(head + std::string(bytes), "a.checkpoint"), "fuzz", options);
    for (std::uint64_t k = 0; k < 4; ++k)
      for (const auto& record : {store.result({k, k}), store.state({k, k})})
        if (record) {
          ByteReader in(*record);
          std::vector<double> numbers;
          in.get_all(numbers);
          in.end();
        }
  });
}

void kernel_cache(std::string_view bytes) { host::load_cache(file_of(bytes, "a.cache"), {}); }

void tetgen_reply(std::string_view bytes) {
  guarded([&] {
    const TetgenReply reply = parse_reply(std::string(bytes));
    for (const Tetrahedron& t : reply.tets)
      for (const Index v : t) require(v < reply.points.size(), "a tetrahedron's corner is a point");
  });
}

// Words of a command line, a line each.
void command_line(std::string_view bytes) {
  std::vector<std::string> words;
  while (!bytes.empty()) {
    const std::size_t end = std::min(bytes.find('\n'), bytes.size());
    words.emplace_back(bytes.substr(0, end));
    bytes.remove_prefix(std::min(end + 1, bytes.size()));
  }
  std::reverse(words.begin(), words.end());  // as CLI11 wants them
  cli::Program program = cli::make_program();
  try {
    program.app->parse(words);
    for (const cli::Command& command : program.commands)
      if (command.app->parsed() && command.check_usage) command.check_usage();
  } catch (const CLI::ParseError&) {
  }
}

}  // namespace

std::vector<Target> readers() {
  return {{"off", surface<kOff>},
          {"obj", surface<kObj>},
          {"ply", ply},
          {"stl", surface<kStl>},
          {"3mf", surface<k3mf>},
          {"vtp", surface<kVtp>},
          {"medit", medit},
          {"medit_binary", solid<kMeshb>},
          {"gmsh", solid<kMsh>},
          {"vtk", solid<kVtk>},
          {"vtu", solid<kVtu>},
          {"xyz", cloud<kXyz>},
          {"pcd", cloud<kPcd>},
          {"las", cloud<kLas>},
          {"sol", sol},
          {"feature_edges", feature_edges},
          {"indices", indices},
          {"jobs", jobs},
          {"checkpoint", checkpoint},
          {"kernel_cache", kernel_cache},
          {"tetgen_reply", tetgen_reply},
          {"command_line", command_line}};
}

}  // namespace bisector::fuzz
