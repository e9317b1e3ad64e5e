// Surfaces that ranks read in parts.
#include <gtest/gtest.h>

#include <unistd.h>

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "backend/cpu_backend.h"
#include "bisector/error.h"
#include "bisector/io.h"
#include "bisector/quality.h"
#include "compute/compute.h"
#include "cvt/optimise.h"
#include "distributed/distributed_backend.h"
#include "io/ply_parts.h"
#include "remesh/remesh_parts.h"
#include "support/diagram.h"
#include "support/models.h"
#include "support/run.h"
#include "support/thread_ranks.h"

namespace bisector::test {
namespace {

class Parts : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() / ("bisector-parts-" + std::to_string(getpid()));
    std::filesystem::create_directory(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::string write(const TriangleMesh& mesh) const {
    const std::string path = (folder_ / "surface.ply").string();
    write_mesh(path, mesh);
    return path;
  }
  std::string write(const std::string& bytes) const {
    const std::string path = (folder_ / "bytes.ply").string();
    std::ofstream(path, std::ios::binary) << bytes;
    return path;
  }

 private:
  std::filesystem::path folder_;
};

void expect_error(const std::string& path, const std::string& what) {
  try {
    const io::PlyParts parts(path);
    for (std::size_t v = 0; v < parts.vertices(); ++v) parts.vertex(v);
    for (std::size_t t = 0; t < parts.triangles(); ++t) parts.triangle(t);
    ADD_FAILURE() << "no error about " << what;
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find(what), std::string::npos) << error.what();
  }
}

TEST_F(Parts, AreWhatTheWholeFileIs) {
  const TriangleMesh mesh = torus(12, 8);
  const io::PlyParts parts(write(mesh));
  ASSERT_EQ(parts.vertices(), mesh.vertices.size());
  ASSERT_EQ(parts.triangles(), mesh.triangles.size());
  for (std::size_t v = 0; v < parts.vertices(); ++v) EXPECT_EQ(parts.vertex(v), mesh.vertices[v]);
  for (std::size_t t = 0; t < parts.triangles(); ++t) EXPECT_EQ(parts.triangle(t), mesh.triangles[t]);
}

TEST_F(Parts, OfAnyTypesAndWithOtherProperties) {
  std::string bytes =
      "ply\nformat binary_big_endian 1.0\nelement vertex 3\nproperty uchar red\nproperty short z\nproperty short x\n"
      "property short y\nelement face 1\nproperty list ushort ushort vertex_index\nproperty uchar label\nend_header\n";
  for (const int v : {1, 2, 3}) bytes += {'\7', 0, static_cast<char>(v), 0, '\4', 0, '\5'};
  bytes += {0, 3, 0, 2, 0, 1, 0, 0, '\7'};
  const io::PlyParts parts(write(bytes));
  EXPECT_EQ(parts.vertex(1), (Vec3{4, 5, 2}));
  EXPECT_EQ(parts.triangle(0), (Triangle{2, 1, 0}));
}

TEST_F(Parts, WhatCannotBeReadIsAnError) {
  expect_error("/nowhere/at/all.ply", "cannot be read");
  expect_error(write(""), "not empty");
  expect_error(write("ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n1\n"), "in text");
  const std::string head =
      "ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n"
      "element face 1\nproperty list uchar int vertex_indices\nend_header\n";
  const std::string vertex(12, '\0');
  expect_error(write(head + vertex.substr(1)), "ends within");
  expect_error(write(head + vertex + std::string{4} + std::string(12, '\0')), "4 corners");
  expect_error(write(head + vertex + std::string{3} + std::string{7} + std::string(11, '\0')), "no vertex 7");
  expect_error(write(head + std::string{0, 0, '\x80', '\x7f'} + vertex.substr(4) + std::string(13, '\0')),
               "not finite");
  std::string listed = head;
  listed.insert(listed.find("element face"), "property list uchar int more\n");
  expect_error(write(listed), "no fixed length");
}

TEST_F(Parts, OfATinyModelAreAnErrorOfAllRanks) {
  TriangleMesh mesh = torus(12, 8);
  for (Vec3& p : mesh.vertices) p = 1e-41 * p;
  const std::string path = write(mesh);
  for (const std::size_t size : {1, 3}) {
    ThreadRanks ranks(size);
    try {
      read_on_all(path, 50, ranks.root());
      ADD_FAILURE() << "no error";
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find("1e-40"), std::string::npos) << error.what();
    }
  }
}

// Every triangle is somewhere once; area and stand-in are the same however many ranks there are.
TEST_F(Parts, MakeUpTheWhole) {
  const TriangleMesh mesh = torus(120, 80);
  const std::string path = write(mesh);
  double area = 0;
  TriangleMesh stand_in;
  for (const std::size_t size : {1, 2, 5}) {
    SCOPED_TRACE(size);
    ThreadRanks ranks(size);
    FileOfRanks divided = read_on_all(path, 400, ranks.root());
    DistributedBackend backend(divided, NeighbourSource::nearest, ranks.root());
    EXPECT_EQ(divided.vertices, mesh.vertices.size());
    EXPECT_EQ(divided.triangles, mesh.triangles.size());
    EXPECT_NEAR(divided.area, Surface(mesh).area, 1e-13 * divided.area);
    EXPECT_LT(divided.stand_in.triangles.size(), mesh.triangles.size() / 4);
    EXPECT_NEAR(Surface(divided.stand_in).area, divided.area, 0.1 * divided.area);
    if (size == 1) {
      area = divided.area;
      stand_in = divided.stand_in;
    }
    EXPECT_EQ(divided.area, area);
    EXPECT_TRUE(same_bits(divided.stand_in.vertices, stand_in.vertices));
    EXPECT_EQ(divided.stand_in.triangles, stand_in.triangles);
    const std::vector<Vec3> seeds = random_seeds(mesh, 300, 2);
    Diagram diagram;
    backend.evaluate(seeds, Want::moments, diagram);
    std::size_t facets = 0;
    for (const PartFigures& part : backend.figures()) facets += part.facets;
    EXPECT_EQ(facets, mesh.triangles.size());
    EXPECT_THROW(backend.surface(), std::logic_error);
  }
}

TEST_F(Parts, GiveTheCpusDiagramAndDual) {
  const TriangleMesh mesh = torus(40, 24);
  const std::string path = write(mesh);
  const Surface surface(mesh);
  CpuBackend cpu(surface, NeighbourSource::nearest);
  for (const std::size_t size : {1, 3}) {
    ThreadRanks ranks(size);
    FileOfRanks file = read_on_all(path, 500, ranks.root());
    DistributedBackend backend(file, NeighbourSource::nearest, ranks.root());
    for (const std::uint64_t random : {1, 2}) {
      const std::vector<Vec3> seeds = random_seeds(mesh, 500, random);
      const Want want = Want::polygons | Want::dual;
      const Evaluated found = evaluated(backend, seeds, want), reference = evaluated(cpu, seeds, want);
      expect_same_diagram(found, reference);
      EXPECT_EQ(found.dual.triangles, reference.dual.triangles);
      EXPECT_EQ(found.dual.multiplicity, reference.dual.multiplicity);
      EXPECT_EQ(found.dual.mesh_triangle, reference.dual.mesh_triangle);
      for (const PartFigures& part : backend.figures()) EXPECT_EQ(part.untiled, 0u);
    }
  }
}

// What is nearest to seeds beyond vertices are these, on as many triangles of as many ranks.
TEST_F(Parts, ProjectToTheFirstOfEquallyNearTriangles) {
  const TriangleMesh mesh = icosphere(3);
  const std::string path = write(mesh);
  const Surface surface(mesh);
  CpuBackend cpu(surface, NeighbourSource::nearest);
  const auto projected = [](Backend& backend, std::vector<Vec3> seeds) {
    Diagram diagram;
    backend.evaluate(seeds, backend.projected(), diagram);
    for (Vec3& x : seeds) x *= 1.05;
    std::vector<Vec3> normals;
    backend.project(diagram.moments, {}, seeds, normals);
    return std::pair(seeds, normals);
  };
  const auto [at, normals] = projected(cpu, mesh.vertices);
  EXPECT_TRUE(same_bits(at, mesh.vertices));
  for (const std::size_t size : {2, 3, 5}) {
    ThreadRanks ranks(size);
    FileOfRanks file = read_on_all(path, mesh.vertices.size(), ranks.root());
    DistributedBackend backend(file, NeighbourSource::nearest, ranks.root());
    const auto [found_at, found_normals] = projected(backend, mesh.vertices);
    EXPECT_TRUE(same_bits(found_at, at));
    EXPECT_TRUE(same_bits(found_normals, normals));
  }
}

// A descent whose projections are the ranks'.
TEST_F(Parts, DescendAsTheCpuDoes) {
  const TriangleMesh mesh = torus(40, 24);
  const std::string path = write(mesh);
  const Surface surface(mesh);
  CpuBackend cpu(surface, NeighbourSource::nearest);
  OptimiseOptions options;
  options.constrained = true;
  options.iterations = 20;
  options.tolerance = 0;
  const std::vector<Vec3> seeds = random_seeds(mesh, 400, 5);
  FreeRun reference(cpu, seeds);
  optimise(reference.run, options);
  for (const std::size_t size : {1, 3}) {
    ThreadRanks ranks(size);
    FileOfRanks file = read_on_all(path, 400, ranks.root());
    DistributedBackend backend(file, NeighbourSource::nearest, ranks.root());
    FreeRun found(backend, seeds);
    optimise(found.run, options);
    EXPECT_EQ(found.run.totals.iterations, reference.run.totals.iterations);
    EXPECT_TRUE(same_bits(found.run.seeds.positions(), reference.run.seeds.positions()));
    EXPECT_TRUE(same_bits(found.run.energy, reference.run.energy));
  }
}

void expect_same_of_ranks(const std::vector<std::size_t>& sizes, const std::string& path, const RemeshOptions& options,
                          const PartsResult& reference) {
  for (const std::size_t size : sizes) {
    ThreadRanks ranks(size);
    set_ranks(&ranks.root());
    const PartsResult found = remesh_parts(path, options);
    set_ranks(nullptr);
    EXPECT_TRUE(same_bits(found.mesh.vertices, reference.mesh.vertices)) << size;
    EXPECT_EQ(found.mesh.triangles, reference.mesh.triangles) << size;
  }
}

TEST_F(Parts, AreRemeshedAlikeByAnyNumberOfRanks) {
  const std::string path = write(torus(200, 120));
  RemeshOptions options;
  options.vertices = 1000;
  const PartsResult reference = remesh_parts(path, options);
  EXPECT_EQ(reference.untiled, 0u);
  EXPECT_TRUE(reference.topology.manifold && reference.topology.closed);
  EXPECT_EQ(reference.topology.euler, 0);
  EXPECT_GE(reference.mesh.vertices.size(), 990u);
  EXPECT_LE(reference.mesh.vertices.size(), 1000u);
  const QualityReport quality = measure_quality(reference.mesh);
  EXPECT_GT(quality.q_ave, 0.93);
  EXPECT_GT(quality.valence6, 0.8);
  expect_same_of_ranks({2, 3}, path, options, reference);
}

// A rank may have none but triangles without area: there are so many that the last of three has no other.
TEST_F(Parts, MayHaveNoAreaOnARank) {
  TriangleMesh mesh = box(2);
  const Index first = static_cast<Index>(mesh.vertices.size());
  for (int k = 0; k < 600; ++k) {
    mesh.vertices.push_back({10.0 + k, 0, 0});
    if (k >= 2) mesh.triangles.push_back({first, first + static_cast<Index>(k) - 1, first + static_cast<Index>(k)});
  }
  const std::string path = write(mesh);
  RemeshOptions options;
  options.vertices = 60;
  const PartsResult reference = remesh_parts(path, options);
  expect_same_of_ranks({2, 3}, path, options, reference);
}

// Ranks without a triangle have cells all the same, of none.
TEST_F(Parts, MayBeFewerThanRanks) {
  RemeshOptions options;
  options.vertices = 20;
  for (const std::vector<Triangle>& triangles : {std::vector<Triangle>{{0, 1, 2}}, {{0, 1, 2}, {1, 3, 2}}}) {
    TriangleMesh mesh;
    mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}};
    mesh.triangles = triangles;
    const std::string path = write(mesh);
    const PartsResult reference = remesh_parts(path, options);
    EXPECT_EQ(reference.topology.euler, 1);
    expect_same_of_ranks({2, 3, 4}, path, options, reference);
  }
}

}  // namespace
}  // namespace bisector::test
