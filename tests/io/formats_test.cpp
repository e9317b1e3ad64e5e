// Formats beyond the common ones, and what all of them keep: labels, names, units. Malformed, truncated and hostile
// files are refused in one line, and none makes a reader allocate much more than the file's size.
#include <gtest/gtest.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <locale>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "bisector/error.h"
#include "bisector/io.h"
#include "core/geometry.h"
#include "io/xml.h"
#include "io/zip.h"
#include "mesh/tet_topology.h"
#include "support/allocations.h"
#include "support/files.h"
#include "support/models.h"

namespace bisector::test {
namespace {

using Edges = std::vector<std::array<Index, 2>>;
using Labels = std::vector<std::int32_t>;

class Formats : public FileTest {
 protected:
  TriangleMesh read(const std::string& name, std::string_view bytes) {
    return read_mesh(store(name, bytes), collecting());
  }
  TriangleMesh written_and_read(const std::string& name, const TriangleMesh& mesh, const WriteOptions& options = {}) {
    write_mesh(path(name), mesh, options);
    return read_mesh(path(name));
  }
  void expect_error(const std::string& name, std::string_view bytes, const std::string& part) {
    expect_error_line([&] { read(name, bytes); }, path(name), part);
  }
  // What is read of any part of the bytes, or of bytes with damage, is sound or refused in one line, and takes at most
  // `most` times the file's size in one piece, or 128 kB.
  void expect_robust(const std::string& name, const std::string& bytes, std::size_t most);
};

void Formats::expect_robust(const std::string& name, const std::string& bytes, std::size_t most) {
  SplitMix64 random(3);
  std::size_t refused = 0;
  const auto attempt = [&](const std::string& damaged) {
    const std::string file = store(name, damaged);
    largest_allocation = 0;
    try {
      const TriangleMesh mesh = read_mesh(file);
      EXPECT_FALSE(mesh.triangles.empty());
      for (const Triangle& t : mesh.triangles)
        for (const Index v : t) EXPECT_LT(v, mesh.vertices.size());
      EXPECT_TRUE(mesh.labels.empty() || mesh.labels.size() == mesh.triangles.size());
    } catch (const Error& error) {
      ++refused;
      EXPECT_EQ(std::string(error.what()).rfind(file, 0), 0u) << error.what();
      EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << error.what();
    }
    EXPECT_LE(largest_allocation, std::max<std::size_t>(1 << 17, most * damaged.size())) << name;
  };
  const std::size_t step = bytes.size() / 80 + 1;
  for (std::size_t cut = 0; cut < bytes.size(); cut += step) attempt(bytes.substr(0, cut));
  for (int round = 0; round < 80; ++round) {
    std::string damaged = bytes;
    for (std::size_t i = 0; i < 1 + random.below(4); ++i)
      damaged[random.below(damaged.size())] ^= static_cast<char>(1u << random.below(8));
    attempt(damaged);
    // Counts of 32 bits, wherever they are.
    damaged = bytes;
    const std::size_t at = random.below(std::max<std::size_t>(1, damaged.size() - 4));
    damaged.replace(at, std::min<std::size_t>(4, damaged.size() - at), 4, round % 2 ? '\x7f' : '\xff');
    attempt(damaged);
  }
  EXPECT_GT(refused, 0u) << name;
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  for (std::size_t at = text.find(from); at != std::string::npos; at = text.find(from, at + to.size()))
    text.replace(at, from.size(), to);
  return text;
}

template <class T>
void put(std::string& out, T value, bool big_endian = false) {
  std::string raw(sizeof(T), '\0');
  std::memcpy(raw.data(), &value, sizeof(T));
  if (big_endian) std::reverse(raw.begin(), raw.end());
  out += raw;
}

void expect_same(const TriangleMesh& a, const TriangleMesh& b) {
  EXPECT_EQ(a.vertices, b.vertices);
  EXPECT_EQ(a.triangles, b.triangles);
  EXPECT_EQ(a.labels, b.labels);
  EXPECT_EQ(a.feature_edges, b.feature_edges);
  EXPECT_EQ(a.label_names, b.label_names);
  EXPECT_EQ(a.unit, b.unit);
}

const TriangleMesh kSquare{{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}, {{0, 1, 2}, {0, 2, 3}}, {}};

// A cube's surface with coordinates that need all digits, a label for each side and its edges as features.
TriangleMesh marked_box() {
  TriangleMesh mesh = box(2);
  for (const Triangle& t : mesh.triangles)
    for (int k = 0; k < 3; ++k)
      for (const double side : {0.0, 1.0})
        if (std::all_of(t.begin(), t.end(), [&](Index v) { return mesh.vertices[v][k] == side; }))
          mesh.labels.push_back(2 * k + (side > 0) + 1);
  std::set<std::array<Index, 2>> edges;
  const auto on_edge = [&](Index a, Index b) {
    int shared = 0;
    for (int k = 0; k < 3; ++k)
      shared += mesh.vertices[a][k] == mesh.vertices[b][k] && (mesh.vertices[a][k] == 0 || mesh.vertices[a][k] == 1);
    return shared == 2;
  };
  for (const Triangle& t : mesh.triangles)
    for (std::size_t k = 0; k < 3; ++k)
      if (const Index a = t[k], b = t[(k + 1) % 3]; on_edge(a, b)) edges.insert({std::min(a, b), std::max(a, b)});
  mesh.feature_edges.assign(edges.begin(), edges.end());
  for (Vec3& p : mesh.vertices) p = {p.x / 3, p.y / 7 + 0.1, p.z * 1e3 / 9};
  return mesh;
}

TriangleMesh rounded_to_float(TriangleMesh mesh) {
  for (Vec3& p : mesh.vertices)
    for (int k = 0; k < 3; ++k) {
      const volatile float rounded = static_cast<float>(p[k]);  // g++ 12 -O3 leaves the rounding out
      p[k] = rounded;
    }
  return mesh;
}

// --- the table ---

TEST_F(Formats, EverySurfaceFormatBringsBackWhatItHolds) {
  TriangleMesh mesh = marked_box();
  WriteOptions lines;
  lines.lines = true;
  std::size_t exact = 0;
  for (const FileFormat& format : file_formats()) {
    if (!format.writes_surfaces || !format.reads_surfaces) continue;
    const std::string extension(format.extension);
    const TriangleMesh back = written_and_read("a" + extension, mesh, lines);
    ASSERT_EQ(back.triangles.size(), mesh.triangles.size()) << extension;
    EXPECT_EQ(back.labels, format.labels == FileFormat::Labels::all ? mesh.labels : Labels{}) << extension;
    if (extension == ".stl") continue;  // floats, vertices numbered anew
    ++exact;
    EXPECT_EQ(back.vertices, mesh.vertices) << extension;
    EXPECT_EQ(back.triangles, mesh.triangles) << extension;
    const bool has_edges = extension != ".off" && extension != ".3mf";
    EXPECT_EQ(back.feature_edges, has_edges ? mesh.feature_edges : Edges{}) << extension;
    EXPECT_TRUE(back.label_names.empty()) << extension;
    const std::string bytes = slurp("a" + extension);
    write_mesh(path("a" + extension), mesh, lines);
    EXPECT_TRUE(slurp("a" + extension) == bytes) << extension << ": not the same bytes again";
  }
  EXPECT_GE(exact, 9u);
  EXPECT_EQ(listed({".a"}), ".a");
  EXPECT_EQ(listed({".a", ".b"}), ".a or .b");
  EXPECT_EQ(listed({".a", ".b", ".c"}), ".a, .b or .c");
}

TEST_F(Formats, TellsWhatCanBeReadAndWritten) {
  for (const FileFormat& format : file_formats()) {
    const std::string name = path("x" + std::string(format.extension));
    EXPECT_EQ(is_tet_format(name), format.reads_tets);
    const auto refused = [&](const auto& call) {
      try {
        call();
        return false;
      } catch (const Error& error) {
        return std::string(error.what()).find("unknown format") != std::string::npos;
      }
    };
    EXPECT_NE(refused([&] { read_mesh(name); }), format.reads_surfaces) << name;
    EXPECT_NE(refused([&] { write_mesh(name, kSquare); }), format.writes_surfaces) << name;
    EXPECT_NE(refused([&] { read_tet_mesh(name); }), format.reads_tets) << name;
    EXPECT_NE(refused([&] {
                write_tet_mesh(name, {kSquare.vertices, {}, {}, kSquare.triangles});
              }),
              format.writes_tets)
        << name;
    EXPECT_NE(refused([&] {
                write_polygons(name, {kSquare.vertices, {{0, 4}, {0, 1, 2, 3}}, {}, {}});
              }),
              format.writes_polygons)
        << name;
  }
}

TEST_F(Formats, NamesOfLabelsAreKept) {
  TriangleMesh mesh = marked_box();
  mesh.label_names = {{1, "inlet"}, {2, "outer wall <&\">"}, {3, "läuft"}, {4, "#5"}, {6, "inlet"}};
  // By name: numbers may change, and 5 has none.
  const auto faces_by_name = [](const TriangleMesh& m) {
    std::map<std::string, std::size_t> faces;
    for (const std::int32_t label : m.labels) {
      const auto name = m.label_names.find(label);
      ++faces[name == m.label_names.end() ? "label_" + std::to_string(label) : name->second];
    }
    return faces;
  };
  for (const char* name : {"a.obj", "a.stl", "a.3mf"}) {
    const std::map<std::string, std::size_t> back = faces_by_name(written_and_read(name, mesh));
    EXPECT_EQ(back.size(), 6u) << name;
    for (const char* label : {"inlet", "läuft", "label_5", "inlet_6"})
      EXPECT_EQ(back.count(label), 1u) << name << label;
    EXPECT_EQ(back.count("outer wall <&\">"), 1u) << name;
    for (const auto& [label, n] : back) EXPECT_EQ(n, 8u) << name << label;
  }
  const TriangleMesh gmsh = written_and_read("a.msh", mesh);
  EXPECT_EQ(gmsh.labels, mesh.labels);
  EXPECT_EQ(gmsh.label_names,
            (LabelNames{{1, "inlet"}, {2, "outer wall <&_>"}, {3, "läuft"}, {4, "#5"}, {6, "inlet"}}));
  // Where labels are not positive, groups are numbered anew.
  mesh.label_names = {{0, "zero"}};
  for (std::int32_t& label : mesh.labels) --label;
  const TriangleMesh shifted = written_and_read("b.msh", mesh);
  EXPECT_EQ(shifted.label_names.at(1), "zero");
  EXPECT_EQ(shifted.label_names.at(2), "label_1");
}

TEST_F(Formats, NamesOfTetrahedraAreKept) {
  TetMesh mesh;
  mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 1, 1}};
  mesh.tets = {{0, 1, 2, 3}, {1, 4, 2, 3}};
  mesh.regions = {4, 9};
  mesh.boundary = boundary_facets(mesh.tets);
  mesh.boundary_labels = {1, 1, 2, 2, 3, 3};
  mesh.region_names = {{4, "steel"}, {9, "copper \\ tin"}};
  mesh.label_names = {{2, "hot"}};
  write_tet_mesh(path("a.msh"), mesh);
  const TetMesh back = read_tet_mesh(path("a.msh"));
  EXPECT_EQ(back.regions, mesh.regions);
  EXPECT_EQ(back.boundary_labels, mesh.boundary_labels);
  EXPECT_EQ(back.region_names, mesh.region_names);
  EXPECT_EQ(back.label_names, mesh.label_names);
  EXPECT_EQ(surface_of_marks(back).label_names, mesh.label_names);
  EXPECT_EQ(boundary_surface(back).label_names, mesh.label_names);
  // A surface is asked for where there are tetrahedra.
  expect_error("b.msh", slurp("a.msh"), "it holds 2 tetrahedra, where a surface is needed");
}

// --- OFF ---

TEST_F(Formats, OffIsAStreamOfNumbers) {
  const std::vector<std::string> same{
      "OFF\n4 2 0\n0 0 0 1 0 0\n1 1 0 0 1 0\n3 0 1 2 3 0 2 3\n",
      "OFF 4 2 0 0 0 0 1 0 0 1 1 0 0 1 0 3 0 1 2 3 0 2 3",
      "OFF # magic\n4 # vertices\n2\n# none\n0\n0 0\n0\n1 0 0\n1 1 0\n0 1 0\n3\n0 1\n2 # first\n3 0\n#\n2\n3\n",
      "OFF\n4 2 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0\n1 2 255 0 0\n3\n0 2 3 0 255 0 128\n",
      "OFF\n4 2\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n3\n0 1 2\n3\n0 2 3\n",
      "NOFF\n4 2 0\n0 0 0 0 0 1 1 0 0 0 0 1 1 1 0 0 0 1\n0 1 0 0 0 1\n3 0 1 2 3 0 2 3\n",
      "STCNOFF\n4 2 0\n" + replaced("0 0 0X1 0 0X1 1 0X0 1 0X", "X", " 0 0 1\n.1 .2 .3 .4 5 6 ") + "3 0 1 2\n3 0 2 3\n",
  };
  for (const std::string& text : same)
    for (const std::string& variant : {text, replaced(text, "\n", "\r\n"), replaced(text, " ", "\t ")}) {
      expect_same(read("a.off", variant), kSquare);
      EXPECT_TRUE(warnings_.empty()) << text;
    }
  // Quads over two lines each, as libigl's tutorial has them.
  const TriangleMesh quads =
      read("q.off", "OFF\n6 2 0\n0 0 0\n1 0 0\n2 0 0\n0 1 0\n1 1 0\n2 1 0\n4\n0 1 4 3\n4\n1 2 5 4\n");
  EXPECT_EQ(quads.triangles.size(), 4u);
  EXPECT_EQ(quads.face_of_triangle, (std::vector<Index>{0, 0, 1, 1}));
  // Neither lines nor a stream: told as what is wrong with the line.
  expect_error("a.off", "OFF\n4 2 0\n0 0 0\n1 0 0\n1 1\n0 1 0\n3 0 1 2\n3 0 2 3\n", ":5: a number is missing");
  expect_error("a.off", "OFF\n4 2 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1\n3 0 2 3\n", ":7: a face of 3 corners ends");
}

std::string binary_off(const std::string& header, std::size_t extra, std::int32_t faces) {
  std::string out = header + " BINARY\n";
  for (const std::int32_t n : {4, static_cast<int>(faces), 0}) put(out, n, true);
  for (const Vec3& p : kSquare.vertices) {
    for (int k = 0; k < 3; ++k) put(out, static_cast<float>(p[k]), true);
    for (std::size_t k = 0; k < extra; ++k) put(out, 0.5f, true);
  }
  for (const Triangle& t : kSquare.triangles) {
    put(out, std::int32_t{3}, true);
    for (const Index v : t) put(out, static_cast<std::int32_t>(v), true);
    const std::int32_t colours = t[1] == 1 ? 0 : 4;
    put(out, colours, true);
    for (std::int32_t k = 0; k < colours; ++k) put(out, 1.0f, true);
  }
  return out;
}

TEST_F(Formats, ReadsBinaryOff) {
  for (const auto& [header, extra] : {std::pair{"OFF", 0}, {"NOFF", 3}, {"COFF", 4}, {"STOFF", 2}, {"STCNOFF", 9}})
    expect_same(read("a.off", binary_off(header, static_cast<std::size_t>(extra), 2)), kSquare);
  expect_error("a.off", binary_off("OFF", 0, 2000000000), "2000000000 faces are declared");
  expect_error("a.off", binary_off("OFF", 0, 3), "truncated");
  expect_robust("a.off", binary_off("COFF", 4, 2), 8);
}

// --- PLY strips ---

std::string strip_ply(bool binary, bool big) {
  std::string out = std::string("ply\nformat ") +
                    (!binary ? "ascii"
                     : big   ? "binary_big_endian"
                             : "binary_little_endian") +
                    " 1.0\nelement vertex 6\nproperty float x\nproperty float y\nproperty float z\n"
                    "element tristrips 1\nproperty list int int vertex_indices\nend_header\n";
  const std::vector<std::array<float, 3>> points{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}, {0, 2, 0}, {1, 2, 0}};
  const std::vector<std::int32_t> strips{0, 1, 2, 3, 4, -1, 3, 5, 4, -1};
  std::ostringstream text;
  for (const auto& p : points) {
    text << p[0] << ' ' << p[1] << ' ' << p[2] << '\n';
    if (binary)
      for (const float x : p) put(out, x, big);
  }
  text << strips.size();
  if (binary) put(out, static_cast<std::int32_t>(strips.size()), big);
  for (const std::int32_t v : strips) {
    text << ' ' << v;
    if (binary) put(out, v, big);
  }
  return binary ? out : out + text.str() + '\n';
}

TEST_F(Formats, ReadsStripsOfPly) {
  const std::vector<Triangle> expected{{0, 1, 2}, {1, 3, 2}, {2, 3, 4}, {3, 5, 4}};
  for (const auto& [binary, big] : {std::pair{false, false}, {true, false}, {true, true}}) {
    EXPECT_EQ(read("a.ply", strip_ply(binary, big)).triangles, expected) << binary << big;
    EXPECT_TRUE(warnings_.empty());
  }
  const std::string text = strip_ply(false, false);
  EXPECT_EQ(read("a.ply", replaced(text, "\n", "\r\n")).triangles, expected);
  // A corner twice leads on to another part; the order of turns goes on.
  EXPECT_EQ(read("a.ply", replaced(text, "10 0 1 2 3 4 -1 3 5 4 -1", "8 0 1 2 2 1 3 5 4")).triangles,
            (std::vector<Triangle>{{0, 1, 2}, {2, 3, 1}, {1, 3, 5}, {3, 4, 5}}));
  expect_error("a.ply", replaced(text, "-1 3 5 4 -1", "-1 3 6 4 -1"), "index 6 is out of range");
  expect_error("a.ply", replaced(text, "-1 3 5 4 -1", "-2 3 5 4 -1"), "index -2 is out of range");
  expect_error("a.ply", replaced(text, "10 0 1", "2000000000 0 1"), "missing");
  expect_error("a.ply", replaced(text, "vertex_indices", "indices"), "'tristrips' needs one list 'vertex_indices'");
  // Faces beside strips, with labels.
  const std::string both =
      replaced(replaced(text, "end_header\n",
                        "element face 1\nproperty list uchar int vertex_indices\nproperty int label\nend_header\n"),
               "-1\n", "-1\n3 0 2 4 7\n");
  EXPECT_EQ(read("a.ply", both).labels, (Labels{0, 0, 0, 0, 7}));
  expect_robust("a.ply", strip_ply(true, false), 40);
  expect_robust("a.ply", text, 40);
}

// --- STL ---

TEST_F(Formats, SolidsOfStlAreLabels) {
  const std::string facet =
      "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 1 1 0\nendloop\nendfacet\n";
  const std::string other = replaced(facet, "vertex 1 0 0", "vertex 0 1 0");
  const auto solid = [](const std::string& name, const std::string& facets) {
    return "solid " + name + "\n" + facets + "endsolid " + name + "\n";
  };
  const TriangleMesh two = read("a.stl", solid("hot wall", facet) + solid("in", other) + solid("hot wall", facet));
  EXPECT_EQ(two.labels, (Labels{0, 1, 0}));
  EXPECT_EQ(two.label_names, (LabelNames{{0, "hot wall"}, {1, "in"}}));
  EXPECT_TRUE(read("a.stl", solid("part", facet + other)).labels.empty());
  EXPECT_TRUE(read("a.stl", solid("", facet) + solid("", other)).labels.empty());
  EXPECT_EQ(read("a.stl", replaced(solid("label_7", facet) + solid("label_-2", other), "\n", "\r\n")).labels,
            (Labels{7, -2}));

  TriangleMesh mesh = marked_box();
  EXPECT_TRUE(written_and_read("b.stl", mesh).labels.empty());
  EXPECT_EQ(slurp("b.stl").size(), 84 + 50 * mesh.triangles.size());
  mesh.label_names = {{3, "three"}};
  const TriangleMesh named = rounded_to_float(written_and_read("b.stl", mesh));
  const TriangleMesh rounded = rounded_to_float(mesh);
  EXPECT_EQ(named.label_names.size(), 6u);
  std::multiset<std::array<double, 9>> a, b;  // triangles come in the order of labels
  for (const auto& [m, set] : {std::pair{&named, &a}, {&rounded, &b}})
    for (const Triangle& t : m->triangles) {
      std::array<double, 9> corners;
      for (std::size_t k = 0; k < 9; ++k) corners[k] = m->vertices[t[k / 3]][static_cast<int>(k % 3)];
      set->insert(corners);
    }
  EXPECT_EQ(a, b);
}

// --- 3MF ---

constexpr const char* kModelHead =
    "<?xml version='1.0'?><model unit='inch' xmlns='http://schemas.microsoft.com/3dmanufacturing/core/2015/02'>";

std::string mesh_xml(const TriangleMesh& mesh, const std::string& properties = "") {
  std::ostringstream out;
  out << "<mesh><vertices>";
  for (const Vec3& p : mesh.vertices) out << "<vertex x='" << p.x << "' y='" << p.y << "' z='" << p.z << "'/>";
  out << "</vertices><triangles>";
  for (const Triangle& t : mesh.triangles)
    out << "<triangle v1='" << t[0] << "' v2='" << t[1] << "' v3='" << t[2] << "'" << properties << "/>";
  out << "</triangles></mesh>";
  return out.str();
}

std::string archive(const std::string& model) { return io::zipped("a.3mf", {{"3D/3dmodel.model", model}}); }

TEST_F(Formats, ThreeMfKeepsUnitsAndNames) {
  TriangleMesh mesh = marked_box();
  for (const auto& [metres, kept] : {std::pair{0.0, 1e-3},
                                     {1e-3, 1e-3},
                                     {1e-6, 1e-6},
                                     {0.01, 0.01},
                                     {0.0254, 0.0254},
                                     {0.3048, 0.3048},
                                     {1.0, 1.0}}) {
    mesh.unit = metres;
    TriangleMesh back = written_and_read("a.3mf", mesh);
    EXPECT_EQ(back.unit, kept);
    EXPECT_EQ(back.vertices, mesh.vertices);
    EXPECT_EQ(back.labels, mesh.labels);
    EXPECT_TRUE(back.label_names.empty());
  }
  mesh.labels.assign(mesh.triangles.size(), 5);
  EXPECT_EQ(written_and_read("a.3mf", mesh).labels, mesh.labels);
  mesh.labels.clear();
  EXPECT_TRUE(written_and_read("a.3mf", mesh).labels.empty());
  // A closed surface is a model, an open one a surface.
  const auto model = [&] { return io::ZipReader("a.3mf", slurp("a.3mf")).unpack("3D/3dmodel.model"); };
  EXPECT_NE(model().find("type=\"model\""), std::string::npos);
  write_mesh(path("a.3mf"), kSquare);
  EXPECT_NE(model().find("type=\"surface\""), std::string::npos);
}

TEST_F(Formats, ThreeMfIsReadAsBuilt) {
  // Two objects; the first twice, moved and mirrored, in an object of components.
  const std::string objects =
      "<resources><basematerials id='9'><base name='red &amp; hot' displaycolor='#FF0000'/>"
      "<base name='blue' displaycolor='#0000FF'/></basematerials>"
      "<object id='1' name='plate' pid='9' pindex='1'>" +
      mesh_xml(kSquare) +
      "</object>"
      "<object id='2'><components><component objectid='1'/>"
      "<component objectid='1' transform='-1 0 0 0 1 0 0 0 1 5 0 0'/></components></object>"
      "<object id='3'>" +
      mesh_xml(single_triangle(), " pid='9' p1='0'") + "</object></resources>";
  const TriangleMesh mesh = read("a.3mf", archive(kModelHead + objects +
                                                  "<build><item objectid='2' transform='1 0 0 0 1 0 0 0 1 0 0 2'/>"
                                                  "<item objectid='3'/></build></model>"));
  EXPECT_EQ(mesh.unit, 0.0254);
  ASSERT_EQ(mesh.vertices.size(), 11u);
  EXPECT_EQ(mesh.vertices[2], (Vec3{1, 1, 2}));
  EXPECT_EQ(mesh.vertices[5], (Vec3{4, 0, 2}));
  EXPECT_EQ(mesh.triangles, (std::vector<Triangle>{{0, 1, 2}, {0, 2, 3}, {4, 6, 5}, {4, 7, 6}, {8, 9, 10}}));
  EXPECT_EQ(mesh.labels, (Labels{0, 0, 1, 1, 2}));
  EXPECT_EQ(mesh.label_names.at(0), "plate");
  EXPECT_EQ(mesh.label_names.at(1), "plate_2");
  EXPECT_EQ(mesh.label_names.at(2), "red & hot");
  // An object in another part, as slicers have it.
  const std::string head = kModelHead;
  const TriangleMesh apart = read(
      "b.3mf",
      io::zipped("b.3mf",
                 {{"_rels/.rels",
                   "<Relationships><Relationship Target='/3D/main.model' Id='r' "
                   "Type='http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel'/></Relationships>"},
                  {"3D/main.model", head + "<build><item p:path='/3D/Objects/o.model' objectid='4'/></build></model>"},
                  {"3D/Objects/o.model",
                   head + "<resources><object id='4'>" + mesh_xml(kSquare) + "</object></resources></model>"}}));
  EXPECT_EQ(apart.triangles, kSquare.triangles);
}

TEST_F(Formats, RefusesBadThreeMf) {
  const std::string head = kModelHead,
                    object = "<resources><object id='1'>" + mesh_xml(kSquare) + "</object></resources>",
                    build = "<build><item objectid='1'/></build></model>", good = head + object + build;
  expect_same(read("a.3mf", archive(replaced(good, "unit='inch'", ""))), [] {
    TriangleMesh square = kSquare;
    square.unit = 1e-3;
    return square;
  }());
  expect_error("a.3mf", "not an archive at all", "is no ZIP archive");
  expect_error("a.3mf", io::zipped("a.3mf", {{"readme", "hello"}}), "there is no '3D/3dmodel.model'");
  expect_error("a.3mf", archive(replaced(good, "inch", "ell")), "the unit 'ell' is none of 3MF's");
  expect_error("a.3mf", archive(replaced(good, "v1='0'", "v1='4'")), "object 1: triangle 0: index 4 is out of range");
  expect_error("a.3mf", archive(replaced(good, "v1='0'", "v1='-1'")), "index -1 is out of range");
  expect_error("a.3mf", archive(replaced(good, "x='1'", "x='nan'")), "vertex 1: a coordinate is not finite");
  expect_error("a.3mf", archive(replaced(good, "x='1'", "x='1,5'")), "'1,5' is not a number");
  expect_error("a.3mf", archive(replaced(good, "x='1'", "")), "x: is missing");
  expect_error("a.3mf", archive(replaced(good, "objectid='1'", "objectid='2'")), "object 2 is to be built, but");
  expect_error("a.3mf", archive(replaced(good, build, "<build></build></model>")), "nothing is to be built");
  expect_error("a.3mf", archive(good.substr(0, good.find("</object>"))), "truncated");
  expect_error("a.3mf",
               archive(head +
                       "<resources><object id='1'><components><component objectid='1'/></components>"
                       "</object></resources>" +
                       build),
               "has itself");
  // Components of components: 2^40 squares in a small file.
  std::string bomb = head + "<resources><object id='0'>" + mesh_xml(kSquare) + "</object>";
  for (int k = 1; k <= 40; ++k)
    bomb += "<object id='" + std::to_string(k) + "'><components>" +
            replaced("<component objectid='K'/><component objectid='K'/>", "K", std::to_string(k - 1)) +
            "</components></object>";
  expect_error("a.3mf", archive(bomb + "</resources><build><item objectid='40'/></build></model>"), "");
  std::string damaged = archive(good);
  damaged[damaged.find("3dmodel.model") + 40] ^= 0x10;
  expect_error("a.3mf", damaged, "is damaged");
  expect_robust("a.3mf", archive(good), 1100);
}

// --- glTF ---

TEST_F(Formats, WritesGlb) {
  TriangleMesh mesh = marked_box();
  mesh.unit = 1e-3;
  mesh.label_names = {{2, "wing \xff"}};  // no Unicode
  write_mesh(path("a.glb"), mesh);
  const std::string bytes = slurp("a.glb");
  const auto word = [&](std::size_t at) {
    std::uint32_t n = 0;
    std::memcpy(&n, bytes.data() + at, 4);
    return n;
  };
  ASSERT_EQ(bytes.substr(0, 4), "glTF");
  EXPECT_EQ(word(8), bytes.size());
  const std::size_t json_size = word(12);
  EXPECT_EQ(json_size % 4, 0u);
  const auto json = nlohmann::json::parse(bytes.substr(20, json_size));
  const std::string buffer = bytes.substr(20 + json_size + 8);
  EXPECT_EQ(json["buffers"][0]["byteLength"], buffer.size());
  EXPECT_EQ(json["nodes"][0]["scale"], (std::vector<double>{1e-3, 1e-3, 1e-3}));
  EXPECT_EQ(json["materials"].size(), 6u);
  EXPECT_EQ(json["materials"][0]["name"], "label_1");
  const auto view = [&](std::size_t accessor) {
    const auto& v = json["bufferViews"][json["accessors"][accessor]["bufferView"].get<std::size_t>()];
    return buffer.substr(v["byteOffset"], v["byteLength"]);
  };
  const std::string points = view(0);
  ASSERT_EQ(points.size(), 12 * mesh.vertices.size());
  const TriangleMesh rounded = rounded_to_float(mesh);
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v)
    for (std::size_t k = 0; k < 3; ++k) {
      float x = 0;
      std::memcpy(&x, points.data() + 12 * v + 4 * k, 4);
      EXPECT_EQ(static_cast<double>(x), rounded.vertices[v][static_cast<int>(k)]);
    }
  std::multiset<Triangle> triangles;
  for (const auto& primitive : json["meshes"][0]["primitives"]) {
    const std::string indices = view(primitive["indices"]);
    for (std::size_t at = 0; at < indices.size(); at += 12) {
      Triangle t;
      std::memcpy(t.data(), indices.data() + at, 12);
      triangles.insert(t);
    }
  }
  EXPECT_EQ(triangles, std::multiset<Triangle>(mesh.triangles.begin(), mesh.triangles.end()));
  mesh.vertices[0].x = 1e39;
  EXPECT_THROW(write_mesh(path("a.glb"), mesh), Error);
  EXPECT_EQ(slurp("a.glb"), bytes);
}

// --- binary Medit ---

// Two triangles with refs 3 and 4 in each version, with a keyword that is passed over.
std::string meshb(int version, bool big, std::int32_t dimension = 3, std::int64_t triangles = 2,
                  std::int64_t corner = 3) {
  std::string out;
  const auto integer = [&](std::int64_t n) {
    version < 4 ? put(out, static_cast<std::int32_t>(n), big) : put(out, n, big);
  };
  const auto real = [&](double x) { version == 1 ? put(out, static_cast<float>(x), big) : put(out, x, big); };
  std::size_t patch = 0;
  const auto begin = [&](std::int32_t code) {
    put(out, code, big);
    patch = out.size();
    out.append(version < 3 ? 4 : 8, '\0');
  };
  const auto end = [&] {
    std::string place;
    version < 3 ? put(place, static_cast<std::int32_t>(out.size()), big)
                : put(place, static_cast<std::int64_t>(out.size()), big);
    out.replace(patch, place.size(), place);
  };
  put(out, std::int32_t{1}, big);
  put(out, std::int32_t{version}, big);
  begin(3);
  put(out, dimension, big);
  end();
  begin(4);
  integer(4);
  for (const Vec3& p : kSquare.vertices) {
    for (int k = 0; k < 3; ++k) real(p[k]);
    integer(0);
  }
  end();
  begin(13);  // corners of the model
  integer(1);
  integer(1);
  end();
  begin(15);  // vertices that are to stay
  for (const int n : {2, 4, 1}) integer(n);
  end();
  begin(17);  // and a triangle
  for (const int n : {1, 2}) integer(n);
  end();
  begin(6);
  integer(triangles);
  for (const std::int64_t n : {std::int64_t{1}, std::int64_t{2}, corner, std::int64_t{3}, std::int64_t{1},
                               std::int64_t{3}, std::int64_t{4}, std::int64_t{4}})
    integer(n);
  end();
  put(out, std::int32_t{54}, big);
  version < 3 ? put(out, std::int32_t{0}) : put(out, std::int64_t{0});
  return out;
}

TEST_F(Formats, ReadsEveryVersionOfBinaryMedit) {
  for (int version = 1; version <= 4; ++version)
    for (const bool big : {false, true}) {
      const TriangleMesh mesh = read("a.meshb", meshb(version, big));
      EXPECT_EQ(mesh.vertices, kSquare.vertices);
      EXPECT_EQ(mesh.triangles, kSquare.triangles);
      EXPECT_EQ(mesh.labels, (Labels{3, 4}));
      const RequiredElements required = read_required(path("a.meshb"));
      EXPECT_EQ(required.vertices, (std::vector<Index>{0, 3}));
      EXPECT_EQ(required.triangles, std::vector<Index>{1});
      EXPECT_TRUE(required.edges.empty());
      expect_error("b.meshb", meshb(version, big, 2), "the dimension is 2");
      expect_error("b.meshb", meshb(version, big, 3, 2000000000), "2000000000 triangles are declared");
      expect_error("b.meshb", meshb(version, big, 3, -5), "is negative");
      expect_error("b.meshb", meshb(version, big, 3, 2, 5), "index 5 is out of range");
      expect_error("b.meshb", meshb(version, big, 3, 2, 0), "index 0 is out of range");
      expect_robust("c.meshb", meshb(version, big), 8);
    }
  expect_error("b.meshb", meshb(5, false), "version 5 is not known");
  expect_error("b.meshb", "MeshVersionFormatted 2\nDimension 3\n", "check that this is a binary Medit file");
}

TEST_F(Formats, ReadsSolutionsOfBinaryMedit) {
  write_mesh(path("a.meshb"), kSquare);
  store("a.sol", "MeshVersionFormatted 2\nDimension 3\nSolAtVertices\n4\n1 1\n5 6 7 8\nEnd\n");
  EXPECT_EQ(read_tet_attribute(path("a.meshb"), ""), (std::vector<double>{5, 6, 7, 8}));
  std::string solution;
  put(solution, std::int32_t{1});
  put(solution, std::int32_t{2});
  for (const std::int32_t n : {3, 20, 3}) put(solution, n);
  for (const std::int32_t n : {62, 0, 4, 2, 2, 1}) put(solution, n);  // a vector and a scalar
  for (int v = 0; v < 4; ++v)
    for (const double x : {0.0, 0.0, 0.0, 0.5 + v}) put(solution, x);
  store("a.solb", solution);
  EXPECT_EQ(read_tet_attribute(path("a.meshb"), ""), (std::vector<double>{0.5, 1.5, 2.5, 3.5}));
  store("a.solb", solution.substr(0, solution.size() - 1));
  EXPECT_THROW(read_tet_attribute(path("a.meshb"), ""), Error);
}

// --- PolyData ---

TEST_F(Formats, ReadsVtp) {
  const std::string text =
      "<?xml version='1.0'?>\n<VTKFile type='PolyData' byte_order='LittleEndian'>\n<PolyData>\n"
      "<Piece NumberOfPoints='6' NumberOfVerts='1' NumberOfLines='1' NumberOfStrips='1' NumberOfPolys='2'>\n"
      "<PointData><DataArray type='Float32' Name='h' format='ascii'>1 2 3 4 5 6</DataArray></PointData>\n"
      "<CellData><DataArray type='Int32' Name='label' format='ascii'>0 0 7 8 9</DataArray></CellData>\n"
      "<Points><DataArray type='Float64' NumberOfComponents='3' format='ascii'>\n"
      "0 0 0 1 0 0 0 1 0 1 1 0 0 2 0 1 2 0\n</DataArray></Points>\n"
      "<Verts><DataArray Name='connectivity' type='Int64' format='ascii'>5</DataArray>\n"
      "<DataArray Name='offsets' type='Int64' format='ascii'>1</DataArray></Verts>\n"
      "<Lines><DataArray Name='connectivity' type='Int64' format='ascii'>0 1 3</DataArray>\n"
      "<DataArray Name='offsets' type='Int64' format='ascii'>3</DataArray></Lines>\n"
      "<Strips><DataArray Name='connectivity' type='Int64' format='ascii'>2 3 4 5</DataArray>\n"
      "<DataArray Name='offsets' type='Int64' format='ascii'>4</DataArray></Strips>\n"
      "<Polys><DataArray Name='connectivity' type='Int64' format='ascii'>0 1 3 0 3 2</DataArray>\n"
      "<DataArray Name='offsets' type='Int64' format='ascii'>3 6</DataArray></Polys>\n"
      "</Piece>\n</PolyData>\n</VTKFile>\n";
  for (const std::string& variant : {text, replaced(text, "\n", "\r\n"), replaced(text, "'", "\"")}) {
    const TriangleMesh mesh = read("a.vtp", variant);
    EXPECT_EQ(mesh.triangles, (std::vector<Triangle>{{0, 1, 3}, {0, 3, 2}, {2, 3, 4}, {4, 3, 5}}));
    EXPECT_EQ(mesh.labels, (Labels{7, 8, 9, 9}));
    EXPECT_EQ(mesh.feature_edges, (Edges{{0, 1}, {1, 3}}));
    EXPECT_EQ(read_vertex_attribute(path("a.vtp"), "h"), (std::vector<double>{1, 2, 3, 4, 5, 6}));
  }
  expect_error("a.vtp", replaced(text, "0 1 3 0 3 2", "0 1 3 0 3 6"), "index 6 is out of range");
  expect_error("a.vtp", replaced(text, ">3 6<", ">3 7<"), "offsets 3 and 7 are out of range");
  expect_error("a.vtp", replaced(text, ">3 6<", ">6 3<"), "out of range");
  expect_error("a.vtp", replaced(text, ">3 6<", ">2 6<"), "a polygon has 2 corners");
  expect_error("a.vtp", replaced(text, "NumberOfPoints='6'", "NumberOfPoints='4000000000'"), "instead of");
  expect_error("a.vtp", replaced(text, "NumberOfPolys='2'", "NumberOfPolys='3'"), "instead of");
  expect_error("a.vtp", replaced(text, "PolyData", "ImageData"), "there is no PolyData");
  expect_error("a.vtp", replaced(text, "1 2 0\n", "1 2 inf\n"), "vertex 5: a coordinate is not finite");
  EXPECT_THROW(read_vertex_attribute(store("a.vtp", text), "k"), Error);
  expect_robust("a.vtp", text, 40);
  write_mesh(path("b.vtp"), marked_box());
  expect_robust("b.vtp", slurp("b.vtp"), 40);

  PolygonMesh quad;
  quad.vertices = kSquare.vertices;
  quad.polygons.values = {0, 1, 2, 3};
  quad.polygons.offsets = {0, 4};
  quad.labels = {6};
  write_polygons(path("q.vtp"), quad);
  const TriangleMesh back = read_mesh(path("q.vtp"));
  EXPECT_EQ(back.labels, (Labels{6, 6}));
  EXPECT_EQ(back.face_of_triangle, (std::vector<Index>{0, 0}));
}

// --- all ---

TEST_F(Formats, SurviveDamage) {
  TriangleMesh mesh = marked_box();
  mesh.label_names = {{1, "one"}};
  for (const char* name : {"a.mesh", "a.msh", "a.vtu", "a.stl", "a.3mf"}) {
    write_mesh(path(name), mesh);
    expect_robust(name, slurp(name), std::string(name) == "a.3mf" ? 1100 : 40);
  }
}

struct DecimalComma : std::numpunct<char> {
  char do_decimal_point() const override { return ','; }
  char do_thousands_sep() const override { return '.'; }
  std::string do_grouping() const override { return "\3"; }
};

TEST_F(Formats, DoNotDependOnTheLocale) {
  TriangleMesh mesh = marked_box();
  mesh.label_names = {{1, "one"}};
  while (mesh.vertices.size() < 1500) mesh.vertices.push_back({0.5, 1234.5, 0});  // counts that a locale would group
  for (const FileFormat& format : file_formats()) {
    if (!format.writes_surfaces) continue;
    const std::string name = "a" + std::string(format.extension);
    write_mesh(path(name), mesh);
    const std::string bytes = slurp(name);
    const std::locale before = std::locale::global(std::locale(std::locale(), new DecimalComma));
    write_mesh(path(name), mesh);
    EXPECT_TRUE(slurp(name) == bytes) << name;
    if (format.reads_surfaces) {
      EXPECT_EQ(read_mesh(path(name)).triangles.size(), mesh.triangles.size()) << name;
    }
    std::locale::global(before);
  }
}

TEST_F(Formats, XmlIsScanned) {
  const std::string name = "a.xml", text = "<?xml a='>'?><!-- <no> --><a b = 'x>y' c=\"'\"/><d:e>t &lt; u</d:e>";
  io::XmlReader xml(name, text);
  io::Tag tag;
  ASSERT_TRUE(xml.next_tag(tag));
  EXPECT_EQ(tag.name, "a");
  EXPECT_TRUE(tag.closed);
  EXPECT_EQ(tag["b"], "x>y");
  EXPECT_EQ(tag["c"], "'");
  ASSERT_TRUE(xml.next_tag(tag));
  EXPECT_EQ(io::local_name(tag.name), "e");
  EXPECT_EQ(io::unescaped(xml.text_ahead()), "t < u");
  ASSERT_TRUE(xml.next_tag(tag));
  EXPECT_EQ(io::local_name(tag.name), "/e");
  EXPECT_FALSE(xml.next_tag(tag));
  EXPECT_EQ(io::unescaped("&#65;&#x20ac;&amp;&nope;&#xffffffff;&"), "A€&&nope;&#xffffffff;&");
  EXPECT_EQ(io::unescaped(io::escaped("<a b=\"'&'\">")), "<a b=\"'&'\">");
}

}  // namespace
}  // namespace bisector::test
