// Files of tetrahedra: what is written reads back bit for bit, other programs read it, and what is malformed is refused
// in one line.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "bisector/error.h"
#include "bisector/io.h"
#include "bisector/quality.h"
#include "core/geometry.h"
#include "mesh/tet_topology.h"
#include "support/files.h"
#include "support/models.h"
#include "support/solids.h"

namespace bisector::test {
namespace {

namespace fs = std::filesystem;

class TetIo : public FileTest {
 protected:
  TetMesh read(const std::string& name, std::string_view bytes) {
    return read_tet_mesh(store(name, bytes), collecting());
  }
  void expect_error(const std::string& name, std::string_view bytes, const std::string& part) {
    expect_error_line([&] { read(name, bytes); }, path(name), part);
  }
};

bool same_bits(const Vec3& a, const Vec3& b) { return std::memcmp(&a, &b, sizeof a) == 0; }

void expect_same(const TetMesh& a, const TetMesh& b) {
  ASSERT_EQ(a.vertices.size(), b.vertices.size());
  for (std::size_t v = 0; v < a.vertices.size(); ++v) EXPECT_TRUE(same_bits(a.vertices[v], b.vertices[v])) << v;
  EXPECT_EQ(a.tets, b.tets);
  EXPECT_EQ(a.regions, b.regions);
  EXPECT_EQ(a.boundary, b.boundary);
  EXPECT_EQ(a.boundary_labels, b.boundary_labels);
  EXPECT_EQ(a.feature_edges, b.feature_edges);
  EXPECT_EQ(a.region_names, b.region_names);
  EXPECT_EQ(a.label_names, b.label_names);
}

TetMesh awkward_numbers() {
  TetMesh mesh = marked_cube(1);
  SplitMix64 random(5);
  for (Vec3& p : mesh.vertices)
    for (int k = 0; k < 3; ++k) p[k] += 1e-3 * random.unit();
  mesh.vertices.push_back({5e-324, -2.2250738585072014e-308, 1e100});  // not used by any tetrahedron
  mesh.vertices.push_back({-1e100, 1e-30, -0.0});
  mesh.vertices.push_back({123456789.123456789, 4503599627370497.5, 1e23});
  return mesh;
}

TEST_F(TetIo, RoundTripsAreExact) {
  for (const char* extension : {".mesh", ".meshb", ".msh", ".vtu", ".MSH"})
    for (const TetMesh& mesh : {marked_cube(3), awkward_numbers()}) {
      write_tet_mesh(path("a" + std::string(extension)), mesh);
      expect_same(read_tet_mesh(path("a" + std::string(extension))), mesh);
    }
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_), fs::directory_iterator{}), 5);
}

TEST_F(TetIo, WhatIsNotMarkedStaysUnmarked) {
  TetMesh mesh = marked_cube(2);
  mesh.regions.clear();
  mesh.boundary_labels.clear();
  TetMesh bare{mesh.vertices, mesh.tets, {}, {}, {}, {}};
  TetMesh shell{mesh.vertices, {}, {}, mesh.boundary, {}, {}};
  for (const char* extension : {".mesh", ".meshb", ".msh", ".vtu"})
    for (const TetMesh& m : {mesh, bare, shell}) {
      write_tet_mesh(path("a" + std::string(extension)), m);
      expect_same(read_tet_mesh(path("a" + std::string(extension))), m);
    }
  EXPECT_TRUE(is_tet_format("x.MESH") && is_tet_format("a/b.vtk") && !is_tet_format("mesh") && !is_tet_format("a.off"));
  const TriangleMesh surface = surface_of_marks(marked_cube(2));
  EXPECT_EQ(surface.triangles, mesh.boundary);
  EXPECT_EQ(surface.labels.size(), mesh.boundary.size());
  EXPECT_EQ(surface.feature_edges, mesh.feature_edges);
}

// A tetrahedron over the nodes 10, 30, 20, 40 with a triangle and an edge, in all four forms of Gmsh.
template <class T>
void put(std::string& out, T value, bool big_endian = false) {
  std::string raw(sizeof(T), '\0');
  std::memcpy(raw.data(), &value, sizeof(T));
  if (big_endian) std::reverse(raw.begin(), raw.end());
  out += raw;
}

const std::array<Vec3, 4> kCorners{Vec3{0, 0, 0}, Vec3{0, 0.1, 0}, Vec3{1, 0, 0}, Vec3{0, 0, 1}};
const std::array<int, 4> kTags{10, 30, 20, 40};  // so the vertices in order of tags are 0, 2, 1, 3

std::string gmsh_22(bool binary, bool big) {
  std::string out = binary ? "$MeshFormat\n2.2 1 8\n" : "$MeshFormat\n2.2 0 8\n";
  if (binary) {
    put<std::int32_t>(out, 1, big);
    out += "\n";
  }
  out +=
      "$EndMeshFormat\n$PhysicalNames\n1\n3 5 \"steel "
      "bar\"\n$EndPhysicalNames\n$Comments\nhello\n$EndComments\n$Nodes\n4\n";
  for (std::size_t i = 0; i < 4; ++i) {
    if (binary) {
      put<std::int32_t>(out, kTags[i], big);
      for (int k = 0; k < 3; ++k) put(out, kCorners[i][k], big);
    } else {
      std::ostringstream line;
      line << kTags[i] << ' ' << kCorners[i].x << ' ' << kCorners[i].y << ' ' << kCorners[i].z << '\n';
      out += line.str();
    }
  }
  out += "$EndNodes\n$Elements\n";
  if (!binary)
    return out + "4\n1 15 2 0 1 10\n2 1 2 0 3 10 20\n3 2 3 0 8 0 10 20 30\n4 4 2 5 9 10 20 30 40\n$EndElements\n";
  out += "4\n";
  for (const std::vector<std::int32_t>& block : {std::vector<std::int32_t>{15, 1, 2, 1, 0, 1, 10},
                                                 {1, 1, 2, 2, 0, 3, 10, 20},
                                                 {2, 1, 3, 3, 0, 8, 0, 10, 20, 30},
                                                 {4, 1, 2, 4, 5, 9, 10, 20, 30, 40}})
    for (const std::int32_t x : block) put(out, x, big);
  return out + "\n$EndElements\n";
}

std::string gmsh_41(bool binary, bool big) {
  std::string out = binary ? "$MeshFormat\n4.1 1 8\n" : "$MeshFormat\n4.1 0 8\n";
  const auto ints = [&](std::initializer_list<std::int32_t> values) {
    for (const std::int32_t x : values) {
      if (binary) put(out, x, big);
      else out += std::to_string(x) + " ";
    }
  };
  const auto sizes = [&](std::initializer_list<std::uint64_t> values) {
    for (const std::uint64_t x : values) {
      if (binary) put(out, x, big);
      else out += std::to_string(x) + "\n";
    }
  };
  const auto reals = [&](std::initializer_list<double> values) {
    for (const double x : values) {
      std::ostringstream text;
      text << x << ' ';
      if (binary) put(out, x, big);
      else out += text.str();
    }
  };
  if (binary) {
    ints({1});
    out += "\n";
  }
  out += "$EndMeshFormat\n$Entities\n";
  sizes({1, 1, 1, 1});
  ints({1});
  reals({0, 0, 0});
  sizes({0});
  ints({3});
  reals({0, 0, 0, 1, 1, 1});
  sizes({0, 1});
  ints({1});
  ints({8});
  reals({0, 0, 0, 1, 1, 1});
  sizes({0, 1});
  ints({-3});
  ints({9});
  reals({0, 0, 0, 1, 1, 1});
  sizes({2});
  ints({-5, 6});
  sizes({1});
  ints({8});
  out += "\n$EndEntities\n$Nodes\n";
  sizes({2, 4, 10, 40});
  ints({2, 8, 1});  // parametric
  sizes({3, 10, 30, 20});
  for (std::size_t i = 0; i < 3; ++i) reals({kCorners[i].x, kCorners[i].y, kCorners[i].z, 0.5, 0.5});
  ints({3, 9, 0});
  sizes({1, 40});
  reals({kCorners[3].x, kCorners[3].y, kCorners[3].z});
  out += "\n$EndNodes\n$Elements\n";
  sizes({3, 3, 1, 3});
  ints({1, 3, 1});
  sizes({1, 1, 10, 20});
  ints({2, 8, 2});
  sizes({1, 2, 10, 20, 30});
  ints({3, 9, 4});
  sizes({1, 3, 10, 20, 30, 40});
  return out + "\n$EndElements\n$Periodic\n0\n$EndPeriodic\n";
}

TEST_F(TetIo, ReadsEveryFormOfGmsh) {
  for (const bool binary : {false, true})
    for (const bool big : {false, binary}) {
      for (const std::string& bytes : {gmsh_22(binary, big), gmsh_41(binary, big)}) {
        const TetMesh mesh = read("a.msh", bytes);
        ASSERT_EQ(mesh.vertices.size(), 4u);
        for (const auto& [v, corner] : {std::pair{0, 0}, {1, 2}, {2, 1}, {3, 3}})
          EXPECT_TRUE(mesh.vertices[static_cast<std::size_t>(v)] == kCorners[static_cast<std::size_t>(corner)]);
        ASSERT_EQ(mesh.tets.size(), 1u);
        EXPECT_EQ(mesh.tets[0], (Tetrahedron{0, 1, 2, 3}));
        EXPECT_EQ(mesh.regions, std::vector<std::int32_t>{5});  // its physical group
        const bool named = bytes.find("steel bar") != std::string::npos;
        EXPECT_EQ(mesh.region_names, named ? (LabelNames{{5, "steel bar"}}) : LabelNames{});
        EXPECT_EQ(mesh.boundary, (std::vector<Triangle>{{0, 2, 1}}));   // turned outward
        EXPECT_EQ(mesh.boundary_labels, std::vector<std::int32_t>{8});  // has none: its entity
        EXPECT_EQ(mesh.feature_edges, (std::vector<std::array<Index, 2>>{{0, 1}}));
      }
    }
}

std::string vtk(bool binary, bool new_cells) {
  std::string out = std::string("# vtk DataFile Version ") + (new_cells ? "5.1" : "3.0") + "\ntitle\n" +
                    (binary ? "BINARY" : "ASCII") + "\nDATASET UNSTRUCTURED_GRID\nPOINTS 4 double\n";
  const auto real = [&](double x) {
    std::ostringstream text;
    text << x << ' ';
    if (binary) put(out, x, true);
    else out += text.str();
  };
  const auto integers = [&](std::initializer_list<int> values, bool wide = false) {
    for (const int x : values) {
      if (!binary) out += std::to_string(x) + " ";
      else if (wide) put<std::int64_t>(out, x, true);
      else put<std::int32_t>(out, x, true);
    }
    out += "\n";
  };
  for (const std::size_t i : {0u, 2u, 1u, 3u})
    for (int k = 0; k < 3; ++k) real(kCorners[i][k]);
  if (new_cells) {
    out += "\nMETADATA\nINFORMATION 0\n\nCELLS 4 9\nOFFSETS vtktypeint64\n";
    integers({0, 4, 7, 9}, true);
    out += "CONNECTIVITY vtktypeint64\n";
    integers({0, 2, 1, 3, 0, 1, 2, 0, 1}, true);
  } else {
    out += "\nCELLS 3 12\n";
    integers({4, 0, 2, 1, 3, 3, 0, 1, 2, 2, 0, 1});
  }
  out += "CELL_TYPES 3\n";
  integers({10, 5, 3});
  out += "CELL_DATA 3\nSCALARS label int 1\nLOOKUP_TABLE default\n";
  integers({5, 8, 0});
  out += "POINT_DATA 4\nVECTORS v double\n";
  for (int i = 0; i < 12; ++i) real(i);
  out += "\nFIELD FieldData 2\nsize%20h 1 4 double\n";
  for (int i = 0; i < 4; ++i) real(i + 0.5);
  out += "\nw 2 4 double\n";
  for (int i = 0; i < 8; ++i) real(i);
  return out + "\n";
}

TEST_F(TetIo, ReadsEveryFormOfLegacyVtk) {
  for (const bool binary : {false, true})
    for (const bool new_cells : {false, true}) {
      const TetMesh mesh = read("a.vtk", vtk(binary, new_cells));
      ASSERT_EQ(mesh.vertices.size(), 4u);
      EXPECT_EQ(mesh.tets, (std::vector<Tetrahedron>{{0, 2, 3, 1}})) << "turned positive";
      EXPECT_EQ(mesh.regions, std::vector<std::int32_t>{5});
      EXPECT_EQ(mesh.boundary, (std::vector<Triangle>{{0, 2, 1}}));
      EXPECT_EQ(mesh.boundary_labels, std::vector<std::int32_t>{8});
      EXPECT_EQ(mesh.feature_edges, (std::vector<std::array<Index, 2>>{{0, 1}}));
      EXPECT_EQ(read_tet_attribute(path("a.vtk"), "size h"), (std::vector<double>{0.5, 1.5, 2.5, 3.5}));
      EXPECT_THROW(read_tet_attribute(path("a.vtk"), "v"), Error);
    }
}

TEST_F(TetIo, ReadsAsciiAndAppendedVtu) {
  const std::string head =
      "<?xml version=\"1.0\"?>\n<!-- <Piece> -->\n<VTKFile type='UnstructuredGrid' version='0.1' "
      "byte_order='LittleEndian'>\n"
      "<UnstructuredGrid><Piece NumberOfPoints=\"4\" NumberOfCells=\"1\">\n"
      "<PointData><DataArray type='Float64' Name='h' format='ascii'>1 2 3 4</DataArray></PointData>\n";
  const std::string ascii =
      head +
      "<Points><DataArray type=\"Float64\" NumberOfComponents=\"3\" format=\"ascii\">0 0 0  1 0 0  0 1 0  0 0 "
      "1</DataArray></Points>\n"
      "<Cells><DataArray type=\"Int32\" Name=\"connectivity\" format=\"ascii\">0 1 2 3</DataArray>\n"
      "<DataArray type=\"Int32\" Name=\"offsets\" format=\"ascii\">4</DataArray>\n"
      "<DataArray type=\"UInt8\" Name=\"types\" format=\"ascii\">10</DataArray></Cells>\n"
      "</Piece></UnstructuredGrid></VTKFile>\n";
  EXPECT_EQ(read("a.vtu", ascii).tets, (std::vector<Tetrahedron>{{0, 1, 2, 3}}));
  EXPECT_EQ(read_tet_attribute(path("a.vtu"), "h"), (std::vector<double>{1, 2, 3, 4}));
  std::string raw =
      head +
      "<Points><DataArray type=\"Float64\" NumberOfComponents=\"3\" format=\"appended\" offset=\"0\"/></Points>\n"
      "<Cells><DataArray type=\"Int32\" Name=\"connectivity\" format=\"appended\" offset=\"100\"/>\n"
      "<DataArray type=\"Int32\" Name=\"offsets\" format=\"appended\" offset=\"120\"/>\n"
      "<DataArray type=\"UInt8\" Name=\"types\" format=\"appended\" offset=\"128\"/></Cells>\n"
      "</Piece></UnstructuredGrid><AppendedData encoding=\"raw\">\n_";
  put<std::uint32_t>(raw, 96);
  for (const double x : {0., 0., 0., 1., 0., 0., 0., 1., 0., 0., 0., 1.}) put(raw, x);
  put<std::uint32_t>(raw, 16);
  for (const std::int32_t v : {0, 1, 2, 3}) put(raw, v);
  put<std::uint32_t>(raw, 4);
  put<std::int32_t>(raw, 4);
  put<std::uint32_t>(raw, 1);
  put<std::uint8_t>(raw, 10);
  raw += "\n</AppendedData></VTKFile>\n";
  EXPECT_EQ(read("b.vtu", raw).tets, (std::vector<Tetrahedron>{{0, 1, 2, 3}}));
  for (std::size_t cut = head.size(); cut + 30 < raw.size(); cut += 7)
    EXPECT_THROW(read("c.vtu", raw.substr(0, cut)), Error) << cut;
}

TEST_F(TetIo, ReadsWhatMeditRequires) {
  const std::string square =
      "MeshVersionFormatted 2\nDimension 3\nVertices 4\n0 0 0 0\n1 0 0 0\n1 1 0 0\n0 1 0 0\n"
      "Triangles 2\n1 2 3 0\n1 3 4 0\nEdges 3\n1 2 0\n3 2 0\n2 1 0\n";
  store("a.mesh", square + "RequiredEdges 3\n3\n1\n2\nRequiredTriangles 2\n2\n2\nRequiredVertices\n1\n4\nEnd\n");
  const RequiredElements required = read_required(path("a.mesh"));
  EXPECT_EQ(required.vertices, std::vector<Index>{3});
  EXPECT_EQ(required.edges, (std::vector<std::array<Index, 2>>{{0, 1}, {1, 2}}));
  EXPECT_EQ(required.triangles, std::vector<Index>{1});
  store("b.mesh", square + "End\n");
  EXPECT_TRUE(read_required(path("b.mesh")).empty());
  EXPECT_TRUE(read_required(path("missing.off")).empty());
  EXPECT_THROW(read_required(path("missing.mesh")), Error);
  for (const char* bad : {"RequiredTriangles 1\n3\n", "RequiredVertices 1\n0\n", "RequiredEdges 1\n-1\n",
                          "RequiredVertices -1\n", "RequiredVertices 1000000\n1\n", "RequiredVertices 1\nx\n"}) {
    store("c.mesh", square + bad + "End\n");
    EXPECT_THROW(read_required(path("c.mesh")), Error) << bad;
  }
}

TEST_F(TetIo, ReadsMeditWithWhatOthersWrite) {
  const TetMesh mesh =
      read("a.mesh",
           "MeshVersionFormatted 1\n\nDimension\n3\n# a comment\nVertices 4\n0 0 0 1\n1 0 0 2\n0 1 0 3\n0 0 1e0 4\n"
           "Corners\n1\n1\nRequiredVertices 2\n1 2\nNormals 1\n0 0 1\nNormalAtVertices 1\n1 1\nRidges 1\n1\n"
           "Edges 2\n2 1 7\n1 2 7\nTriangles 1\n1 2 3 -4\nTetrahedra 1\n1 2 4 3 9\n\nEnd\n");
  EXPECT_EQ(mesh.tets, (std::vector<Tetrahedron>{{0, 1, 2, 3}}));
  EXPECT_EQ(mesh.regions, std::vector<std::int32_t>{9});
  EXPECT_EQ(mesh.boundary, (std::vector<Triangle>{{0, 2, 1}}));
  EXPECT_EQ(mesh.boundary_labels, std::vector<std::int32_t>{-4});
  EXPECT_EQ(mesh.feature_edges, (std::vector<std::array<Index, 2>>{{0, 1}}));
  EXPECT_EQ(read_required(path("a.mesh")).vertices, (std::vector<Index>{0, 1}));
  store("a.sol",
        "MeshVersionFormatted 2\nDimension 3\nSolAtVertices\n4\n2 2 1\n1 1 1 0.5\n1 1 1 1.5\n1 1 1 2.5\n1 1 1 "
        "3.5\nEnd\n");
  EXPECT_EQ(read_tet_attribute(path("a.mesh"), ""), (std::vector<double>{0.5, 1.5, 2.5, 3.5}));
  store("a.sol", "MeshVersionFormatted 2\nDimension 3\nSolAtVertices\n3\n1 1\n1 2 3\nEnd\n");
  EXPECT_THROW(read_tet_attribute(path("a.mesh"), ""), Error);
}

TEST_F(TetIo, RefusesBadFilesInOneLine) {
  const std::string medit = "MeshVersionFormatted 2\nDimension 3\nVertices 4\n0 0 0 0\n1 0 0 0\n0 1 0 0\n0 0 1 0\n";
  expect_error("a.mesh", medit + "Tetrahedra 1\n1 2 3 5 0\nEnd\n", ":9: index 5 is out of range");
  expect_error("a.mesh", medit + "Tetrahedra 1\n0 2 3 1 0\nEnd\n", "index 0 is out of range");
  expect_error("a.mesh", medit + "Tetrahedra 1\n1 2 3 3 0\nEnd\n", "tetrahedron 0: vertex 2 occurs twice");
  expect_error("a.mesh", medit + "Tetrahedra 4000000000\n1 2 3 4 0\nEnd\n", "more than the file can hold");
  expect_error("a.mesh", medit + "Tetrahedra 2\n1 2 3 4 0\n", "truncated");
  expect_error("a.mesh", medit + "Hexahedra 1\n1 2 3 4 1 2 3 4 0\n", "only tetrahedra");
  expect_error("a.mesh", medit + "TetrahedraP2 1\n1 2 3 4 1 2 3 4 1 1 0\n", "only tetrahedra");
  expect_error("a.mesh", medit + "End\n", "neither tetrahedra nor triangles");
  expect_error("a.mesh", "MeshVersionFormatted 2\nDimension 2\n", "dimension is 2");
  expect_error("a.mesh", "MeshVersionFormatted 2\nDimension 3\nVertices 1\nnan 0 0 0\n", "not finite");
  expect_error("a.mesh", " \n", "empty");
  expect_error("a.mesh", "\x01\x02\x03", "ASCII");
  expect_error("a.meshc", "x", "unknown format");
  EXPECT_THROW(read_tet_mesh(path("missing.msh")), Error);

  for (const bool binary : {false, true})
    for (const std::string& bytes : {gmsh_22(binary, false), gmsh_41(binary, false)})
      for (std::size_t cut = 1; cut < bytes.find("$EndElements") + 5; cut += 7)
        EXPECT_THROW(read("cut.msh", bytes.substr(0, cut)), Error) << bytes.substr(0, 30) << cut;
  const auto replaced = [](std::string text, std::string_view from, std::string_view to) {
    const std::size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    return text.replace(at, from.size(), to);
  };
  const std::string gmsh = gmsh_22(false, false);
  expect_error("a.msh", replaced(gmsh, "4 4 2 5 9 10 20 30 40", "4 5 2 5 9 10 20 30 40"), "type 5");
  expect_error("a.msh", replaced(gmsh, "4 4 2 5 9 10 20 30 40", "4 4 2 5 9 10 20 30 50"), "no node 50");
  expect_error("a.msh", replaced(gmsh, "4 4 2 5 9 10 20 30 40", "4 4 2 5 9 10 20 25 40"), "no node 25");
  expect_error("a.msh", replaced(gmsh, "2.2 0 8", "4 0 8"), "version 4");
  expect_error("a.msh", replaced(gmsh, "$Nodes\n4", "$Nodes\n400000000"), "more than the file can hold");
  expect_error("a.msh", replaced(gmsh, "40 0 0 1", "30 0 0 1"), "two nodes have the tag 30");
  expect_error("a.msh", replaced(gmsh, "40 0 0 1", "40 0 0 inf"), "not finite");

  for (const bool binary : {false, true})
    for (const bool cells : {false, true}) {
      const std::string bytes = vtk(binary, cells);
      for (std::size_t cut = 1; cut <= bytes.find("CELL_DATA") - 3; cut += 5)
        EXPECT_THROW(read("cut.vtk", bytes.substr(0, cut)), Error) << binary << cells << cut;
    }
  const std::string legacy = vtk(false, false);
  expect_error("a.vtk", replaced(legacy, "4 0 2 1 3", "4 0 2 1 4"), "cell 0: index 4 is out of range");
  expect_error("a.vtk", replaced(legacy, "4 0 2 1 3", "4 0 2 1 -3"), "cell 0: index -3 is out of range");
  expect_error("a.vtk", replaced(legacy, "10 5 3", "12 5 3"), "cell 0: its type is 12");
  for (const std::string section : {"POINTS 1 double\n0 0 0\n", "CELLS 1 2\n1 0\n", "CELL_TYPES 1\n1\n"}) {
    const std::string word = section.substr(0, section.find(' '));
    expect_error("a.vtk", legacy + section, "'" + word + "' occurs twice");
    if (word != "CELL_TYPES")
      expect_error("a.vtk", replaced(legacy, word + " ", "CELL_DATA 3\n" + word + " "), "data of 3 items, but 0 items");
  }
  expect_error("a.vtk", replaced(legacy, "4 0 2 1 3", "5 0 2 1 3"), "cell 0: it has 5 vertices");
  expect_error("a.vtk", replaced(legacy, "CELLS 3 12", "CELLS 3 1200000000"), "more than the file can hold");
  expect_error("a.vtk", replaced(legacy, "UNSTRUCTURED_GRID", "STRUCTURED_POINTS"), "UNSTRUCTURED_GRID");
  expect_error("a.vtu", "<VTKFile type='ImageData'><ImageData/></VTKFile>", "UnstructuredGrid");
  expect_error("a.vtu", "<VTKFile type='UnstructuredGrid' compressor='vtkLZ4DataCompressor'>", "vtkLZ4DataCompressor");
  write_tet_mesh(path("good.vtu"), marked_cube(1));
  std::string twice = slurp("good.vtu");
  const std::size_t array = twice.find("<DataArray", twice.find("<Points>")), end = twice.find("</Points>");
  twice.insert(end, twice.substr(array, end - array));
  expect_error("a.vtu", twice, "the points have several arrays");
}

TEST_F(TetIo, RefusesToWriteWhatIsUnsound) {
  const TetMesh good = marked_cube(1);
  TetMesh mesh = good;
  mesh.tets[0][1] = 8;
  EXPECT_THROW(write_tet_mesh(path("a.msh"), mesh), Error);
  mesh = good;
  mesh.vertices[3].y = std::nan("");
  EXPECT_THROW(write_tet_mesh(path("a.mesh"), mesh), Error);
  mesh = good;
  mesh.regions.pop_back();
  EXPECT_THROW(write_tet_mesh(path("a.vtu"), mesh), Error);
  EXPECT_THROW(write_tet_mesh(path("a.vtk"), good), Error);
  EXPECT_TRUE(fs::is_empty(folder_));
}

TEST_F(TetIo, TetrahedraOfNoVolumeStayWithAWarning) {
  const TetMesh mesh =
      read("a.mesh",
           "MeshVersionFormatted 2\nDimension 3\nVertices 5\n0 0 0 0\n1 0 0 0\n0 1 0 0\n0 0 1 0\n1 1 0 0\n"
           "Tetrahedra 2\n1 2 3 4 0\n1 2 3 5 0\nEnd\n");
  EXPECT_EQ(mesh.tets.size(), 2u);
  ASSERT_EQ(warnings_.size(), 1u);
  EXPECT_NE(warnings_[0].find("1 tetrahedron has no volume"), std::string::npos);
}

int python(const std::string& script) {
  return std::system(("/usr/bin/python3 -c '" + script + "' > /dev/null 2>&1").c_str());
}

TEST_F(TetIo, MeshioReadsWhatIsWritten) {
  if (python("import meshio") != 0) GTEST_SKIP() << "meshio is not there";
  const TetMesh mesh = marked_cube(2);
  for (const char* name : {"a.mesh", "a.msh", "a.vtu"}) write_tet_mesh(path(name), mesh);
  for (const auto& [name, region, label] : {std::array<std::string, 3>{"a.mesh", "medit:ref", "medit:ref"},
                                            {"a.msh", "gmsh:physical", "gmsh:physical"},
                                            {"a.vtu", "region", "label"}}) {
    const std::string script =
        "import meshio, sys, numpy as np\nm = meshio.read(\"" + path(name) + "\")\n" +
        "c = m.cells_dict\nassert len(m.points) == 27, len(m.points)\n"
        "assert len(c[\"tetra\"]) == 48 and len(c[\"triangle\"]) == 48 and len(c[\"line\"]) == 24\n"
        "r = m.cell_data_dict[\"" +
        region + "\"][\"tetra\"]\nl = m.cell_data_dict[\"" + label +
        "\"][\"triangle\"]\n"
        "assert len(np.unique(r)) == 2 and len(np.unique(l)) == 6\n";
    std::ofstream(path("check.py")) << script;
    EXPECT_EQ(std::system(("/usr/bin/python3 " + path("check.py") + " > " + path("log") + " 2>&1").c_str()), 0)
        << name << slurp("log");
  }
  // And the other way, with what meshio compresses. Its Gmsh 4.1 takes one kind of cell only.
  for (const auto& [name, change, options] :
       {std::array<std::string, 3>{"b.mesh", "", ""},
        {"b.vtu", "", ""},
        {"b.vtk", "", ""},
        {"b.msh", "", ", file_format=\"gmsh22\", binary=True"},
        {"c.msh", "m = meshio.Mesh(m.points, {\"tetra\": m.cells_dict[\"tetra\"]})\n", ", file_format=\"gmsh\""}}) {
    std::ofstream(path("convert.py")) << "import meshio\nm = meshio.read(\"" + path("a.vtu") + "\")\n" + change +
                                             "m.write(\"" + path(name) + "\"" + options + ")\n";
    ASSERT_EQ(std::system(("/usr/bin/python3 " + path("convert.py") + " > " + path("log") + " 2>&1").c_str()), 0)
        << name << slurp("log");
    const TetMesh back = read_tet_mesh(path(name));
    EXPECT_EQ(back.tets, mesh.tets) << name;
    ASSERT_EQ(back.vertices.size(), mesh.vertices.size()) << name;
    for (std::size_t v = 0; v < mesh.vertices.size(); ++v) EXPECT_TRUE(back.vertices[v] == mesh.vertices[v]) << name;
    if (!change.empty()) continue;
    EXPECT_EQ(back.boundary, mesh.boundary) << name;
    EXPECT_EQ(back.feature_edges, mesh.feature_edges) << name;
  }
}

TEST_F(TetIo, GmshReadsWhatIsWritten) {
  if (std::system("gmsh --version > /dev/null 2>&1") != 0) GTEST_SKIP() << "gmsh is not there";
  const TetMesh mesh = marked_cube(2);
  write_tet_mesh(path("a.msh"), mesh);
  for (const auto& [format, binary] :
       {std::pair{"msh41", ""}, {"msh41", "-bin"}, {"msh22", ""}, {"msh22", "-bin"}, {"mesh", ""}, {"vtk", ""}}) {
    const std::string name = std::string("b.") + (std::string(format).starts_with("msh") ? "msh" : format);
    ASSERT_EQ(std::system(("gmsh " + path("a.msh") + " -save -format " + format + " " + binary + " -o " + path(name) +
                           " > " + path("log") + " 2>&1")
                              .c_str()),
              0);
    EXPECT_EQ(slurp("log").find("Error"), std::string::npos) << slurp("log");
    EXPECT_EQ(slurp("log").find("Warning"), std::string::npos) << slurp("log");
    const TetMesh back = read_tet_mesh(path(name));
    EXPECT_EQ(back.tets.size(), mesh.tets.size()) << format << binary;
    EXPECT_EQ(back.boundary.size(), mesh.boundary.size()) << format << binary;
    EXPECT_EQ(back.feature_edges.size(), mesh.feature_edges.size()) << format << binary;
    EXPECT_TRUE(analyse_tet_topology(back).conforming);
    if (!std::string(format).starts_with("msh")) continue;
    std::vector<std::int32_t> a = back.boundary_labels, b = mesh.boundary_labels, c = back.regions, d = mesh.regions;
    for (auto* list : {&a, &b, &c, &d}) std::sort(list->begin(), list->end());
    EXPECT_EQ(a, b) << format << binary;
    EXPECT_EQ(c, d) << format << binary;
  }
}

}  // namespace
}  // namespace bisector::test
