// The pipelines, on meshes of a few vertices that the bytes give.
#include <cmath>
#include <cstring>

#include "bisector/diagram.h"
#include "bisector/quality.h"
#include "bisector/remesh.h"
#include "bisector/segment.h"
#include "bisector/tetmesh.h"
#include "bisector/tree.h"
#include "core/geometry.h"
#include "fuzz/target.h"

namespace bisector::fuzz {
namespace {

constexpr std::size_t kMostVertices = 16, kMostElements = 24, kMostPoints = 60;

// Takes values off the bytes; zeros when they are used up.
class Source {
 public:
  explicit Source(std::string_view bytes) : bytes_(bytes) {}

  unsigned byte() {
    if (bytes_.empty()) return 0;
    const auto value = static_cast<unsigned char>(bytes_.front());
    bytes_.remove_prefix(1);
    return value;
  }
  std::size_t below(std::size_t n) { return byte() % n; }
  // Small whole numbers, which make ties, or any double that readers let through.
  double coordinate(bool whole) {
    if (whole) return static_cast<double>(byte() % 8);
    char raw[8];
    for (char& c : raw) c = static_cast<char>(byte());
    double value = 0;
    std::memcpy(&value, raw, sizeof value);
    return std::isfinite(value) && std::abs(value) <= 1e100 ? value : static_cast<double>(raw[0]);
  }
  std::vector<Vec3> points(std::size_t most) {
    const bool whole = byte() % 4 != 0;
    std::vector<Vec3> points(4 + below(most - 3));
    for (Vec3& p : points)
      for (int k = 0; k < 3; ++k) p[k] = coordinate(whole);
    return points;
  }
  template <std::size_t N>
  std::vector<std::array<Index, N>> elements(std::size_t vertices) {
    std::vector<std::array<Index, N>> elements(1 + below(kMostElements));
    for (auto& element : elements)
      for (Index& v : element) v = static_cast<Index>(below(vertices));
    return elements;
  }
  // Every other mesh is closed: the hull of a tetrahedron, with what follows on top of it.
  TriangleMesh surface() {
    TriangleMesh mesh;
    const bool closed = byte() % 2;
    mesh.vertices = points(kMostVertices);
    if (closed) mesh.triangles = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}};
    if (!closed || byte() % 2)
      for (const Triangle& t : elements<3>(mesh.vertices.size())) mesh.triangles.push_back(t);
    if (byte() % 4 == 0)
      for (std::size_t k = 0; k < mesh.triangles.size(); ++k) mesh.labels.push_back(static_cast<int>(byte() % 3));
    return mesh;
  }
  TetMesh solid() {
    TetMesh mesh;
    mesh.vertices = points(kMostVertices);
    mesh.tets = byte() % 2 ? elements<4>(mesh.vertices.size()) : std::vector<Tetrahedron>{{0, 1, 2, 3}};
    return mesh;
  }

 private:
  std::string_view bytes_;
};

ComputeOptions cpu() {
  ComputeOptions compute;
  compute.device.kind = DeviceRequest::Kind::cpu;
  return compute;
}

void check_triangles(const std::vector<Vec3>& vertices, const std::vector<Triangle>& triangles) {
  for (const Triangle& t : triangles)
    for (const Index v : t) require(v < vertices.size(), "a triangle's corner is a vertex");
  for (const Vec3& p : vertices)
    require(std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z), "a vertex is finite");
}

void remesh_tiny(std::string_view bytes) {
  Source source(bytes);
  RemeshOptions options;
  options.vertices = 4 + source.below(20);
  options.iterations = 3;
  options.compute = cpu();
  options.threads = 1;
  options.topology = static_cast<TopologyControl>(source.below(3));
  options.fit = source.byte() % 4 == 0;
  const TriangleMesh surface = source.surface();
  guarded([&] {
    const RemeshResult result = remesh(surface, options);
    check_triangles(result.mesh.vertices, result.mesh.triangles);
  });
}

template <class Domain>
void diagram_of(const Domain& domain, const std::vector<Vec3>& seeds) {
  DiagramOptions options;
  options.compute = cpu();
  guarded([&] { require(compute_diagram(domain, {}, seeds, options).untiled == 0, "cells tile the domain"); });
}

void diagram_of_surface(std::string_view bytes) {
  Source source(bytes);
  const std::vector<Vec3> seeds = source.points(12);
  diagram_of(source.surface(), seeds);
}

void diagram_of_solid(std::string_view bytes) {
  Source source(bytes);
  const std::vector<Vec3> seeds = source.points(12);
  diagram_of(source.solid(), seeds);
}

void tet_tiny(std::string_view bytes) {
  Source source(bytes);
  TetOptions options;
  options.vertices = 8 + source.below(16);
  options.iterations = 3;
  options.compute = cpu();
  options.threads = 1;
  const TetMesh solid = source.solid();
  guarded([&] {
    const TetResult result = tetrahedralise(solid, options);
    for (const Tetrahedron& t : result.mesh.tets)
      for (const Index v : t) require(v < result.mesh.vertices.size(), "a tetrahedron's corner is a vertex");
  });
}

void segment_tiny(std::string_view bytes) {
  Source source(bytes);
  SegmentOptions options;
  options.proxies = 1 + source.below(5);
  options.surfaces = static_cast<SegmentSurfaces>(source.below(3));
  options.regularize = source.byte() % 2;
  const TriangleMesh surface = source.surface();
  guarded([&] { segment(surface, options); });
}

void quality_tiny(std::string_view bytes) {
  Source source(bytes);
  const TriangleMesh surface = source.surface(), other = source.surface();
  const TetMesh solid = source.solid();
  guarded([&] { measure_quality(surface); });
  guarded([&] { count_self_intersections(surface); });
  guarded([&] { measure_distance(surface, other, 100); });
  guarded([&] { measure_tet_quality(solid); });
}

void tree_tiny(std::string_view bytes) {
  Source source(bytes);
  TreeOptions options;
  options.clusters = source.below(8);
  options.find_ground = source.byte() % 4 == 0;
  options.scene = source.byte() % 8 == 0;
  const std::vector<Vec3> points = source.points(kMostPoints);
  guarded([&] {
    const TreeResult tree = reconstruct_tree(points, options);
    const TriangleMesh mesh = tree_mesh(tree);
    check_triangles(mesh.vertices, mesh.triangles);
  });
}

}  // namespace

std::vector<Target> pipelines() {
  return {{"remesh", remesh_tiny},
          {"surface_diagram", diagram_of_surface},
          {"solid_diagram", diagram_of_solid},
          {"tet", tet_tiny},
          {"segment", segment_tiny},
          {"quality", quality_tiny},
          {"tree", tree_tiny}};
}

}  // namespace bisector::fuzz
