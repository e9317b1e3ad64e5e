// Files go through meshio, Gmsh and VTK (foreign_formats.py): these read what is written here, and what they write is
// read here, with equal vertices, cells, labels and names.
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "bisector/io.h"
#include "core/geometry.h"
#include "mesh/tet_topology.h"
#include "support/files.h"
#include "support/models.h"
#include "support/solids.h"

namespace bisector::test {
namespace {

using Json = nlohmann::json;
using Point = std::array<double, 3>;

constexpr int kSkipped = 77;

// Coordinates that need all digits, and positive marks, which all of the formats take.
TetMesh marked_solid() {
  TetMesh mesh = marked_cube(2);
  for (Vec3& p : mesh.vertices) p = {p.x, 3 * p.y / 7, 100 * p.z / 3};
  for (std::int32_t& region : mesh.regions) region = region == 7 ? 1 : 2;
  for (std::int32_t& label : mesh.boundary_labels) label += 3;
  return mesh;
}

const LabelNames kLabelNames{{1, "inlet"},      {2, "outlet"}, {3, "north wall"},
                             {4, "south wall"}, {5, "floor"},  {6, "roof"}};
const LabelNames kRegionNames{{1, "steel"}, {2, "copper"}};

Json names_of(const LabelNames& names) {
  Json json;
  for (const auto& [label, name] : names) json[std::to_string(label)] = name;
  return json;
}

template <std::size_t N>
Json rows_of(const std::vector<std::array<Index, N>>& rows) {
  return Json(rows);
}

// Nodes in no two of which anything is alike.
SecondOrder shaken_nodes(const TetMesh& mesh) {
  SecondOrder order = second_order(mesh, boundary_surface(mesh), {});
  SplitMix64 random(5);
  for (Vec3& p : order.nodes) p += Vec3{random.range(0, 0.01), random.range(0, 0.01), random.range(0, 0.01)};
  return order;
}

class ForeignFormats : public FileTest {
 protected:
  void SetUp() override {
    FileTest::SetUp();
    solid_ = marked_solid();
    std::vector<Index> kept;
    surface_ = boundary_surface(solid_, &kept);
    write_all();
  }
  void write_all() {
    TriangleMesh named = surface_;
    named.label_names = kLabelNames;
    TetMesh named_solid = solid_;
    named_solid.label_names = kLabelNames;
    named_solid.region_names = kRegionNames;
    for (const FileFormat& format : file_formats()) {
      const std::string extension(format.extension);
      if (format.writes_surfaces) {
        write_mesh(path("surface" + extension), surface_);
        write_mesh(path("surface-named" + extension), named);
      }
      if (format.writes_tets) {
        write_tet_mesh(path("tets" + extension), solid_);
        write_tet_mesh(path("tets-named" + extension), named_solid);
      }
    }
    TriangleMesh bare = surface_;  // meshio reads PLY with nothing but vertices and faces
    bare.feature_edges.clear();
    bare.labels.clear();
    write_mesh(path("bare.ply"), bare);
    const auto points_of = [](const std::vector<Vec3>& vertices) {
      Json points;
      for (const Vec3& p : vertices) points.push_back({p.x, p.y, p.z});
      return points;
    };
    TetMesh warm = solid_;
    warm.attributes = {
        {"heat", Attribute::Site::vertex, Attribute::Type::float64, 1, std::vector<double>(warm.vertices.size(), 1)}};
    const SecondOrder order = shaken_nodes(solid_);
    Json nodes;
    for (std::size_t e = 0; e < order.edges.size(); ++e)
      nodes.push_back({order.edges[e], {order.nodes[e].x, order.nodes[e].y, order.nodes[e].z}});
    write_tet_mesh(path("curved.msh"), warm, order);
    write_tet_mesh(path("curved.vtu"), warm, order);
    const Json expected{{"nodes", nodes},
                        {"surface",
                         {{"points", points_of(surface_.vertices)},
                          {"triangles", rows_of(surface_.triangles)},
                          {"edges", rows_of(surface_.feature_edges)},
                          {"marks", {{"triangles", surface_.labels}}},
                          {"names", {{"triangles", names_of(kLabelNames)}}}}},
                        {"tets",
                         {{"points", points_of(solid_.vertices)},
                          {"triangles", rows_of(solid_.boundary)},
                          {"tets", rows_of(solid_.tets)},
                          {"edges", rows_of(solid_.feature_edges)},
                          {"marks", {{"triangles", solid_.boundary_labels}, {"tets", solid_.regions}}},
                          {"names", {{"triangles", names_of(kLabelNames)}, {"tets", names_of(kRegionNames)}}}}}};
    std::ofstream(path("expected.json")) << expected;
  }

  // Has a library read all that it can, and reads what it writes. `module` is what has to be installed.
  void pass_through(const std::string& library, const char* package) {
    const std::string command = "/usr/bin/python3 " BISECTOR_SOURCE_DIR "/tests/io/foreign_formats.py " + library +
                                " " + folder_.string() + " > " + path("log") + " 2>&1";
    const int status = std::system(command.c_str());
    std::ifstream in(path("log"));
    std::ostringstream log;
    log << in.rdbuf();
    if (WIFEXITED(status) && WEXITSTATUS(status) == kSkipped)
      GTEST_SKIP() << library << " is not installed (" << log.str() << "); install " << package;
    ASSERT_EQ(status, 0) << log.str();
    std::ifstream list(path("written.json"));
    const Json written = Json::parse(list);
    EXPECT_FALSE(written.empty());
    for (const Json& file : written) {
      SCOPED_TRACE(file.dump());
      if (file["kind"] == "tets") check_solid(file);
      else check_surface(file);
    }
  }

  void check_surface(const Json& file) {
    TriangleMesh mesh;
    ASSERT_NO_THROW(mesh = read_mesh(path(file["file"])));
    const bool single = file["single"];
    EXPECT_TRUE(points_of(mesh.vertices, single) == points_of(surface_.vertices, single));
    check_triangles(file, mesh.vertices, mesh.triangles, mesh.labels, mesh.label_names, surface_.vertices,
                    surface_.triangles, surface_.labels);
    if (file["edges"]) {
      EXPECT_TRUE(edges_of(mesh.vertices, mesh.feature_edges, single) ==
                  edges_of(surface_.vertices, surface_.feature_edges, single));
    }
  }

  void check_solid(const Json& file) {
    TetMesh mesh;
    ASSERT_NO_THROW(mesh = read_tet_mesh(path(file["file"])));
    const bool single = file["single"];
    EXPECT_TRUE(points_of(mesh.vertices, single) == points_of(solid_.vertices, single));
    check_triangles(file, mesh.vertices, mesh.boundary, mesh.boundary_labels, mesh.label_names, solid_.vertices,
                    solid_.boundary, solid_.boundary_labels);
    EXPECT_TRUE(edges_of(mesh.vertices, mesh.feature_edges, single) ==
                edges_of(solid_.vertices, solid_.feature_edges, single));
    const auto tets_of = [&](const TetMesh& m) {
      std::multiset<std::pair<std::multiset<Point>, std::int32_t>> tets;
      for (std::size_t i = 0; i < m.tets.size(); ++i) {
        std::multiset<Point> corners;
        for (const Index v : m.tets[i]) corners.insert(point_of(m.vertices[v], single));
        tets.insert({corners, m.regions.at(i)});
      }
      return tets;
    };
    EXPECT_TRUE(tets_of(mesh) == tets_of(solid_));
    if (file["names"]) {
      EXPECT_EQ(mesh.region_names, kRegionNames);
    }
  }

  // Files may order cells in their own way, and number labels anew where they have names.
  void check_triangles(const Json& file, const std::vector<Vec3>& vertices, const std::vector<Triangle>& triangles,
                       const std::vector<std::int32_t>& labels, const LabelNames& names,
                       const std::vector<Vec3>& true_vertices, const std::vector<Triangle>& true_triangles,
                       const std::vector<std::int32_t>& true_labels) {
    const bool single = file["single"], with_names = file["names"];
    const auto cells = [&](const std::vector<Vec3>& points, const std::vector<Triangle>& corners,
                           const std::vector<std::int32_t>& marks, const LabelNames& called) {
      std::multiset<std::pair<std::array<Point, 3>, std::string>> all;
      for (std::size_t i = 0; i < corners.size(); ++i) {
        std::array<Point, 3> t;
        for (std::size_t k = 0; k < 3; ++k) t[k] = point_of(points[corners[i][k]], single);
        std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
        std::string mark;
        if (file["labels"]) {
          const std::int32_t label = marks.at(i);
          mark = with_names ? called.at(label) : std::to_string(label);
        }
        all.insert({t, mark});
      }
      return all;
    };
    EXPECT_TRUE(cells(vertices, triangles, labels, names) ==
                cells(true_vertices, true_triangles, true_labels, kLabelNames));
  }

  static Point point_of(const Vec3& p, bool single) {
    if (!single) return {p.x, p.y, p.z};
    Point rounded{};
    for (std::size_t k = 0; k < 3; ++k) {
      const volatile float x = static_cast<float>(p[static_cast<int>(k)]);  // g++ 12 -O3 leaves the rounding out
      rounded[k] = x;
    }
    return rounded;
  }
  static std::multiset<Point> points_of(const std::vector<Vec3>& vertices, bool single) {
    std::multiset<Point> points;
    for (const Vec3& p : vertices) points.insert(point_of(p, single));
    return points;
  }
  static std::multiset<std::set<Point>> edges_of(const std::vector<Vec3>& vertices,
                                                 const std::vector<std::array<Index, 2>>& edges, bool single) {
    std::multiset<std::set<Point>> all;
    for (const auto& e : edges) all.insert({point_of(vertices[e[0]], single), point_of(vertices[e[1]], single)});
    return all;
  }

  TetMesh solid_;
  TriangleMesh surface_;  // its boundary
};

// The table of docs/cli.md has a row for each format, which says what is read and written.
TEST_F(ForeignFormats, AreThoseOfTheManual) {
  std::ifstream manual(BISECTOR_SOURCE_DIR "/docs/cli.md");
  std::map<std::string, std::vector<std::string>> rows;
  bool table = false;
  for (std::string line; std::getline(manual, line);) {
    if (line.starts_with("| | forms")) table = true;
    else if (table && !line.starts_with('|')) break;
    if (!table || !line.starts_with("| `.")) continue;
    std::vector<std::string> cells;
    std::istringstream in(line.substr(1));
    for (std::string cell; std::getline(in, cell, '|');) cells.push_back(cell);
    ASSERT_GE(cells.size(), 5u) << line;
    rows[cells[0].substr(2, cells[0].find('`', 2) - 2)] = cells;
  }
  const auto says = [](const std::string& cell, const char* word) { return cell.find(word) != std::string::npos; };
  EXPECT_EQ(rows.size(), file_formats().size());
  for (const FileFormat& format : file_formats()) {
    const std::vector<std::string>& row = rows[std::string(format.extension)];
    ASSERT_FALSE(row.empty()) << format.extension;
    EXPECT_EQ(says(row[2], "read"), format.reads_surfaces) << format.extension;
    EXPECT_EQ(says(row[2], "written"), format.writes_surfaces) << format.extension;
    EXPECT_EQ(says(row[3], "written"), format.writes_polygons) << format.extension;
    EXPECT_EQ(says(row[4], "read"), format.reads_tets) << format.extension;
    EXPECT_EQ(says(row[4], "written"), format.writes_tets) << format.extension;
    EXPECT_EQ(says(row[5], "written"), format.writes_second_order) << format.extension;
    EXPECT_EQ(row[6].find_first_not_of(' ') != std::string::npos, format.labels != FileFormat::Labels::none);
  }
}

TEST_F(ForeignFormats, Meshio) { pass_through("meshio", "python3-meshio"); }
TEST_F(ForeignFormats, Gmsh) { pass_through("gmsh", "python3-gmsh"); }
TEST_F(ForeignFormats, Vtk) { pass_through("vtk", "python3-vtk9"); }
TEST_F(ForeignFormats, PythonsZip) { pass_through("zip", "python3"); }

}  // namespace
}  // namespace bisector::test
