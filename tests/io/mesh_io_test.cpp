// Mesh files: what is written reads back bit for bit; what is malformed is refused in one line that names its place.
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <sstream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "bisector/error.h"
#include "bisector/io.h"
#include "bisector/quality.h"
#include "core/degenerate.h"
#include "core/geometry.h"
#include "io/bytes.h"
#include "io/files.h"
#include "mesh/topology.h"
#include "support/allocations.h"
#include "support/files.h"
#include "support/models.h"

namespace bisector::test {
namespace {

namespace fs = std::filesystem;

class Io : public FileTest {
 protected:
  TriangleMesh read(const std::string& name, std::string_view bytes) {
    return read_mesh(store(name, bytes), collecting());
  }
  std::vector<std::string> files() const {
    std::vector<std::string> names;
    for (const auto& entry : fs::directory_iterator(folder_)) names.push_back(entry.path().filename().string());
    return names;
  }
};

bool same_bits(const Vec3& a, const Vec3& b) {
  for (int k = 0; k < 3; ++k)
    if (std::bit_cast<std::uint64_t>(a[k]) != std::bit_cast<std::uint64_t>(b[k])) return false;
  return true;
}

void expect_same(const TriangleMesh& a, const TriangleMesh& b) {
  ASSERT_EQ(a.vertices.size(), b.vertices.size());
  for (std::size_t v = 0; v < a.vertices.size(); ++v) EXPECT_TRUE(same_bits(a.vertices[v], b.vertices[v])) << v;
  EXPECT_EQ(a.triangles, b.triangles);
  EXPECT_EQ(a.face_of_triangle, b.face_of_triangle);
  EXPECT_EQ(a.labels, b.labels);
  EXPECT_EQ(a.feature_edges, b.feature_edges);
  EXPECT_EQ(a.label_names, b.label_names);
  EXPECT_EQ(a.unit, b.unit);
}

TriangleMesh awkward_numbers() {
  TriangleMesh mesh;
  mesh.vertices = {{1.0 / 3, 0.1 + 0.2, -0.0},
                   {5e-324, -2.2250738585072014e-308, 1e100},
                   {-1e100, 1e-30, 4503599627370497.5},
                   {123456789.123456789, 1e22, 1e23}};
  mesh.triangles = {{0, 1, 2}, {2, 1, 3}, {3, 0, 2}};
  SplitMix64 random(5);
  for (int i = 0; i < 300; ++i) {
    Vec3 p;
    for (int k = 0; k < 3; ++k) {
      do p[k] = std::bit_cast<double>(random.next());
      while (!(std::abs(p[k]) <= 1e100));
    }
    mesh.vertices.push_back(p);
    mesh.triangles.push_back({static_cast<Index>(random.below(mesh.vertices.size())),
                              static_cast<Index>(random.below(mesh.vertices.size())),
                              static_cast<Index>(mesh.vertices.size() - 1)});
  }
  return mesh;
}

template <class T>
void put(std::string& bytes, T value, bool big_endian = false) {
  std::string raw(sizeof(T), '\0');
  std::copy_n(reinterpret_cast<const char*>(&value), sizeof(T), raw.begin());
  if (big_endian != (std::endian::native == std::endian::big)) std::reverse(raw.begin(), raw.end());
  bytes += raw;
}

// A tetrahedron's PLY with properties of other types around those that matter, and other elements around it.
std::string rich_ply(bool big_endian) {
  std::string bytes = "ply\nformat binary_" + std::string(big_endian ? "big" : "little") +
                      "_endian 1.0\ncomment made by hand\nobj_info nothing\n"
                      "element camera 1\nproperty list int double view\nproperty short id\n"
                      "element vertex 4\nproperty uchar red\nproperty double z\nproperty list uchar short tags\n"
                      "property float y\nproperty int x\n"
                      "element face 4\nproperty float area\nproperty list ushort uint vertex_index\n"
                      "property list char uchar flags\nelement edge 1\nproperty char a\nend_header\n";
  const auto add = [&](auto value) { put(bytes, value, big_endian); };
  add(std::int32_t{2});
  add(1.0);
  add(2.0);
  add(std::int16_t{-7});
  for (int v = 0; v < 4; ++v) {
    add(std::uint8_t{200});
    add(v == 3 ? 0.1 : 0.0);
    add(static_cast<std::uint8_t>(v));
    for (int k = 0; k < v; ++k) add(std::int16_t{-1});
    add(v == 2 ? 1.5f : 0.0f);
    add(std::int32_t{v == 1 ? -3 : 0});
  }
  for (const Triangle& t : {Triangle{0, 1, 2}, Triangle{0, 3, 1}, Triangle{1, 3, 2}, Triangle{2, 3, 0}}) {
    add(0.5f);
    add(std::uint16_t{3});
    for (const Index v : t) add(v);
    add(std::int8_t{1});
    add(std::uint8_t{9});
  }
  add(std::int8_t{0});
  return bytes;
}

std::string binary_stl(const std::vector<std::array<float, 9>>& facets) {
  std::string header = "solid binary in disguise";
  header.resize(80, ' ');
  put(header, static_cast<std::uint32_t>(facets.size()));
  for (const auto& facet : facets) {
    for (int k = 0; k < 3; ++k) put(header, 0.0f);
    for (const float x : facet) put(header, x);
    put(header, std::uint16_t{0});
  }
  return header;
}

const std::vector<std::array<float, 9>> kTwoFacets{{0, 0, 0, 1, 0, 0, 0, 1, 0}, {1, 0, 0, 1, 1, 0, -0.0f, 1, -0.0f}};

constexpr const char* kOff = "OFF\n4 2 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2\n3 0 2 3\n";
constexpr const char* kObj = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3\nf 1/1/1 3//2 4/3\n";
constexpr const char* kPly =
    "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
    "property float z\nelement face 2\nproperty list uchar int vertex_indices\nend_header\n"
    "0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2\n3 0 2 3\n";
constexpr const char* kStl =
    "solid square\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 1 1 0\n"
    "endloop\nendfacet\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 1 0\n"
    "vertex 0 1 0\nendloop\nendfacet\nendsolid square\n";

const TriangleMesh kSquare{{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}, {{0, 1, 2}, {0, 2, 3}}, {}};

TriangleMesh marked_square() {
  TriangleMesh mesh = kSquare;
  mesh.labels = {-3, 2000000000};
  mesh.feature_edges = {{0, 1}, {0, 2}, {2, 3}};
  return mesh;
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  for (std::size_t at = text.find(from); at != std::string::npos; at = text.find(from, at + to.size()))
    text.replace(at, from.size(), to);
  return text;
}

TEST_F(Io, RoundTripsAreBitExact) {
  for (const TriangleMesh& mesh : {awkward_numbers(), icosphere(3), collinear_among_good()})
    for (const char* name : {"a.off", "a.obj", "a.ply", "A.OFF", "A.Obj", "A.PLY"}) {
      write_mesh(path(name), mesh);
      expect_same(read_mesh(path(name)), mesh);
      const std::string bytes = slurp(name);
      write_mesh(path(name), mesh);
      EXPECT_TRUE(slurp(name) == bytes);
    }
}

// Far from the origin rounding turns small triangles; their normals are those of the corners that are written.
TEST_F(Io, StlNormalsAreOfTheRoundedCorners) {
  TriangleMesh mesh = icosphere(2);
  for (Vec3& p : mesh.vertices) p = {1000.1 + 0.01 * p.x, 2000.3 + 0.01 * p.y, 3000.7 + 0.01 * p.z};
  write_mesh(path("far.stl"), mesh);
  const std::string bytes = slurp("far.stl");
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    std::array<Vec3, 4> v;  // normal and corners
    for (std::size_t i = 0; i < 4; ++i)
      for (int k = 0; k < 3; ++k)
        v[i][k] = io::load<float>(bytes.data() + 84 + 50 * t + 12 * i + 4 * static_cast<std::size_t>(k), false);
    EXPECT_LT(norm(v[0] - unit(cross(v[2] - v[1], v[3] - v[1]))), 1e-6) << t;
  }
}

TEST_F(Io, StlRoundTripsToFloat) {
  const TriangleMesh mesh = icosphere(3);
  write_mesh(path("a.stl"), mesh);
  const TriangleMesh back = read_mesh(path("a.stl"));
  ASSERT_EQ(back.triangles.size(), mesh.triangles.size());
  EXPECT_EQ(back.vertices.size(), mesh.vertices.size());
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3 &p = mesh.vertices[mesh.triangles[i][k]], &q = back.vertices[back.triangles[i][k]];
      for (int axis = 0; axis < 3; ++axis) EXPECT_EQ(static_cast<double>(static_cast<float>(p[axis])), q[axis]);
    }
  write_mesh(path("b.stl"), back);
  EXPECT_TRUE(slurp("a.stl") == slurp("b.stl"));
}

TEST_F(Io, ReadsEveryFormat) {
  expect_same(read("a.off", kOff), kSquare);
  expect_same(read("a.obj", kObj), kSquare);
  expect_same(read("a.ply", kPly), kSquare);
  expect_same(read("a.stl", kStl), kSquare);
  EXPECT_TRUE(warnings_.empty());
}

TEST_F(Io, ToleratesHowTextIsLaidOut) {
  for (const auto& [name, text] : {std::pair{"a.off", kOff}, {"a.obj", kObj}, {"a.ply", kPly}, {"a.stl", kStl}}) {
    const std::string plain = text;
    for (const std::string& variant :
         {replaced(plain, "\n", "\r\n"), replaced(plain, "\n", "\r"), plain.substr(0, plain.size() - 1),
          "\xef\xbb\xbf" + plain, plain + "\n \n\t\n", replaced(replaced(plain, " ", "\t"), "\t\t", "\t"),
          replaced(plain, "1 1 0", "+1 +1.0e0 0.00"), replaced(plain, "1 1 0", "1. 10e-1 1e-999"),
          replaced(plain, "\n", " \n")})
      expect_same(read(name, variant), kSquare);
  }
  expect_same(read("a.off",
                   "# head\n\nOFF # magic\n#\n4 2 0#counts\n0 0 0\n\n#\n1 0 0 # x\n1 1 0\n0 1 0\n"
                   "3 0 1 2\n3 0 2 3 255 0 0"),
              kSquare);
  expect_same(read("a.off", "OFF 4 2\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2 0.5 0.5 0.5\n3 0 2 3\n"), kSquare);
  for (const char* header : {"COFF", "NOFF", "STOFF", "STCNOFF"})
    expect_same(read("a.off", std::string(header) + "\n4 2 0\n0 0 0 1 2 3 4\n1 0 0 1 2 3 4\n1 1 0 1 2 3 4\n"
                                                    "0 1 0 1 2 3 4\n3 0 1 2\n3 0 2 3\n"),
                kSquare);
  expect_same(read("a.obj",
                   "mtllib a.mtl\no thing\nv 0 0 0 1\nv 1 0 \\\n 0\nv 1 1 0 0.5 0.5 0.5\n# path C:\\\n"
                   "v 0 1 0\nvt 0 0\nvn 0 0 1\ng a\ns off\nusemtl m\nf -4 -3/1 \\\r\n -2//1\n"
                   "p 1\nf 1/1/1 3/1/1 4/1/1\n"),
              kSquare);
  expect_same(read("a.obj", "f 1 2 3\nf 1 3 4\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"), kSquare);
  expect_same(read("a.stl", replaced(replaced(kStl, "facet", "FACET"), "solid", "Solid")), kSquare);
  expect_same(read("a.stl", replaced(kStl, "endfacet\nfacet", "endfacet\nendsolid\nsolid square\nfacet")), kSquare);
  EXPECT_TRUE(warnings_.empty());
}

TEST_F(Io, ReadsPlyOfAnyTypeAndOrder) {
  const TriangleMesh little = read("a.ply", rich_ply(false));
  EXPECT_TRUE(warnings_.empty());
  expect_same(read("a.ply", rich_ply(true)), little);
  const TriangleMesh expected{
      {{0, 0, 0}, {-3, 0, 0}, {0, 1.5, 0}, {0, 0, 0.1}}, {{0, 1, 2}, {0, 3, 1}, {1, 3, 2}, {2, 3, 0}}, {}};
  expect_same(little, expected);
  const std::string binary = rich_ply(false);
  const std::size_t body = binary.find("end_header\n") + 11;
  expect_same(read("a.ply", replaced(binary.substr(0, body), "\n", "\r") + binary.substr(body)), little);
  expect_same(read("a.ply", replaced(kPly, "element vertex", "Created by hand, of: nothing\nelement vertex")), kSquare);
  // Faces before vertices.
  expect_same(read("a.ply",
                   "ply\nformat ascii 1.0\nelement face 2\nproperty list int int vertex_indices\n"
                   "element vertex 4\nproperty double z\nproperty double x\nproperty double y\n"
                   "property int extra\nend_header\n3 0 1 2\n3 0 2 3\n0 0 0 7\n0 1 0 7\n0 1 1 7\n0 0 1 7\n"),
              kSquare);
}

TEST_F(Io, ReadsBinaryStlThatBeginsWithSolid) {
  const TriangleMesh mesh = read("a.stl", binary_stl(kTwoFacets));
  EXPECT_EQ(mesh.vertices.size(), 4u);  // -0.0 equals 0.0
  EXPECT_EQ(mesh.triangles, (std::vector<Triangle>{{0, 1, 2}, {1, 3, 2}}));
  EXPECT_TRUE(warnings_.empty());
  EXPECT_EQ(read("a.stl", binary_stl(kTwoFacets) + "tail").triangles.size(), 2u);
  ASSERT_EQ(warnings_.size(), 1u);
  EXPECT_NE(warnings_[0].find("4 bytes"), std::string::npos) << warnings_[0];
}

TEST_F(Io, CountsWhatItToleratesInOneWarningEach) {
  const TriangleMesh mesh = read("a.off",
                                 "OFF\n7 4 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n2 0 0\n9 9 9\n8 8 8\n"
                                 "4 0 1 2 3\n3 0 1 2\n3 0 1 4\n3 2 2 3\nmore\nand more\n");
  EXPECT_EQ(mesh.vertices.size(), 7u);
  EXPECT_EQ(mesh.triangles.size(), 5u);
  EXPECT_EQ(mesh.face_of_triangle, (std::vector<Index>{0, 0, 1, 2, 3}));
  ASSERT_EQ(warnings_.size(), 4u);
  const std::string name = path("a.off");
  EXPECT_EQ(warnings_[0], name + ": 2 lines after the end of the mesh ignored");
  EXPECT_EQ(warnings_[1], name + ": 1 polygon was split into triangles");
  EXPECT_EQ(warnings_[2], name + ": 2 vertices are used by no face");
  EXPECT_EQ(warnings_[3], name + ": 2 triangles have no area");
}

TEST_F(Io, DecidesZeroAreaExactly) {
  // Multiples of (1, 1, 1) / 10 are not collinear in doubles; multiples by powers of two are, whatever the rounding.
  const Vec3 u{0.1, 0.7, 1.3};
  EXPECT_TRUE(collinear(u, 2 * u, 4 * u));
  EXPECT_TRUE(collinear(1e-300 * u, 2 * (1e-300 * u), 4 * (1e-300 * u)));
  EXPECT_TRUE(collinear(u, u, {5, 5, 5}));
  EXPECT_FALSE(collinear(u, 2 * u, {0.4, 2.8, std::nextafter(5.2, 6)}));
  EXPECT_FALSE(collinear({0, 0, 0}, {5e-324, 0, 0}, {0, 5e-324, 0}));
  EXPECT_FALSE(collinear({0, 0, 0}, {1e100, 0, 0}, {1e100, 5e-324, 0}));
  EXPECT_EQ(triangle_area(u, 2 * u, 4 * u), 0);
  EXPECT_DOUBLE_EQ(triangle_area({0, 0, 0}, {3, 0, 0}, {0, 4, 0}), 6);
  EXPECT_DOUBLE_EQ(triangle_area({0, 0, 0}, {3e100, 0, 0}, {0, 4e100, 0}), 6e200);
  EXPECT_DOUBLE_EQ(triangle_area({0, 0, 0}, {3e-100, 0, 0}, {0, 4e-100, 0}), 6e-200);
  EXPECT_GT(triangle_area({0, 0, 0}, {5e-324, 0, 0}, {0, 5e-324, 0}), 0);
}

// Area and border of a planar polygon must survive its splitting, and no triangle may be turned over.
void expect_tiles(const TriangleMesh& mesh, double area) {
  double sum = 0;
  Vec3 total;
  for (const Triangle& t : mesh.triangles) {
    const Vec3 n = cross(mesh.vertices[t[1]] - mesh.vertices[t[0]], mesh.vertices[t[2]] - mesh.vertices[t[0]]);
    sum += 0.5 * norm(n);
    total += 0.5 * n;
  }
  EXPECT_NEAR(sum, area, 1e-12 * area);
  EXPECT_NEAR(norm(total), area, 1e-12 * area);
  const MeshTopology topology = analyse_topology(mesh.triangles, mesh.vertices.size());
  EXPECT_TRUE(topology.manifold);
  EXPECT_TRUE(topology.oriented);
  EXPECT_EQ(topology.boundary_edges, mesh.vertices.size());
}

TEST_F(Io, SplitsPolygons) {
  const auto polygon = [&](const std::vector<Vec3>& corners) {
    std::string text = "OFF\n" + std::to_string(corners.size()) + " 1 0\n";
    std::ostringstream out;
    out.precision(17);
    for (const Vec3& p : corners) out << p.x << ' ' << p.y << ' ' << p.z << '\n';
    out << corners.size();
    for (std::size_t i = 0; i < corners.size(); ++i) out << ' ' << i;
    return read("a.off", text + out.str());
  };
  // The shorter diagonal of a convex quad, whichever it is.
  EXPECT_EQ(polygon({{0, 0, 0}, {2, -3, 0}, {4, 0, 0}, {2, 3, 0}}).triangles,
            (std::vector<Triangle>{{0, 1, 2}, {0, 2, 3}}));
  EXPECT_EQ(polygon({{0, 0, 0}, {3, -2, 0}, {6, 0, 0}, {3, 2, 0}}).triangles,
            (std::vector<Triangle>{{0, 1, 3}, {1, 2, 3}}));
  // A dart has only one, from any start and on either side.
  const std::vector<Vec3> dart{{0, 0, 0}, {3, -1, 0}, {1, 0, 0}, {3, 1, 0}};
  for (std::size_t start = 0; start < 4; ++start)
    for (const bool back : {false, true}) {
      std::vector<Vec3> turned;
      for (std::size_t i = 0; i < 4; ++i) turned.push_back(dart[(start + (back ? 4 - i : i)) % 4]);
      const TriangleMesh mesh = polygon(turned);
      EXPECT_EQ(mesh.triangles.size(), 2u);
      expect_tiles(mesh, 1);
    }
  // A comb with collinear points on its back, tilted in space.
  std::vector<Vec3> comb;
  for (int i = 0; i <= 20; ++i) comb.push_back({static_cast<double>(i), i % 2 ? 1.0 : 10.0, 0});
  for (int i = 20; i >= 0; i -= 5) comb.push_back({static_cast<double>(i), 0, 0});
  double comb_area = 0;
  for (std::size_t i = 0; i < comb.size(); ++i) {
    const Vec3 &p = comb[i], &q = comb[(i + 1) % comb.size()];
    comb_area += 0.5 * (q.x * p.y - p.x * q.y);
  }
  for (Vec3& p : comb) p = {p.x, p.y, p.x + 2 * p.y};  // scales every area by sqrt(6)
  expect_tiles(polygon(comb), comb_area * std::sqrt(6.0));
  // A regular 500-gon, and a star that is not convex.
  for (const double inner : {1.0, 0.3}) {
    std::vector<Vec3> star;
    const int n = 500;
    for (int i = 0; i < n; ++i) {
      const double angle = 2 * 3.141592653589793 * i / n, r = i % 2 ? inner : 1.0;
      star.push_back({0.5, r * std::cos(angle), r * std::sin(angle)});
    }
    expect_tiles(polygon(star), 0.5 * n * inner * std::sin(2 * 3.141592653589793 / n));
  }
  EXPECT_EQ(warnings_.size(), 1u);
  // Nothing sensible to split: a line, a figure of eight.
  EXPECT_EQ(polygon({{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}, {1.5, 0, 0}}).triangles.size(), 3u);
  EXPECT_EQ(polygon({{0, 0, 0}, {1, 1, 0}, {1, 0, 0}, {0, 1, 0}}).triangles.size(), 2u);
  EXPECT_NE(warnings_[0].find("1 of them degenerate"), std::string::npos) << warnings_[0];
}

struct Malformed {
  const char* name;
  std::string bytes;
  const char* place;  // what follows the path
};

TEST_F(Io, RefusesMalformedFilesInOneLine) {
  const std::string off = kOff, obj = kObj, ply = kPly, stl = kStl;
  const std::string bstl = binary_stl(kTwoFacets), bply = rich_ply(false);
  const std::string bply_head =
      "ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty float x\n"
      "property float y\nproperty float z\nelement face 1\n"
      "property list uint int vertex_indices\nend_header\n";
  const auto bply_with = [&](float x, std::uint32_t degree, std::int32_t index) {
    std::string bytes = bply_head;
    for (int i = 0; i < 9; ++i) put(bytes, i == 4 ? x : static_cast<float>(i * i));
    put(bytes, degree);
    for (const std::int32_t v : {0, 1, index}) put(bytes, v);
    return bytes;
  };
  auto bstl_with = [&](float x) {
    auto facets = kTwoFacets;
    facets[1][4] = x;
    return binary_stl(facets);
  };
  std::string bstl_many = bstl;
  for (std::size_t i = 80; i < 84; ++i) bstl_many[i] = '\xff';
  const float nan = std::nanf(""), inf = HUGE_VALF;
  const std::string labelled = replaced(ply, "end_header", "property int label\nend_header");
  const std::string edged =
      replaced(ply, "end_header", "element edge 1\nproperty int vertex1\nproperty int vertex2\nend_header");

  const std::vector<Malformed> cases{
      {"a.off", "", ": the file is empty"},
      {"a.obj", "", ": the file is empty"},
      {"a.ply", " \n\n", ": the file is empty"},
      {"a.stl", "", ": the file is empty"},
      {"a.xyz", off, ": unknown format '.xyz' of meshes"},
      {"a", off, ": no file name extension"},
      // OFF
      {"a.off", "# only a comment\n", ":2: "},
      {"a.off", "PLY\n1 1 1\n", ":1: does not begin with OFF"},
      {"a.off", "OFF BINARY\n", ": byte 0 after the header: 1 numbers are declared"},
      {"a.off", "4OFF\n1 1 0\n", ":1: "},
      {"a.off", "OFF\n", ":2: "},
      {"a.off", "OFF\n4\n", ":2: the number of faces is missing"},
      {"a.off", "OFF\n-4 2 0\n", ":2: the number of vertices is negative"},
      {"a.off", "OFF\n4 -2 0\n", ":2: the number of faces is negative"},
      {"a.off", "OFF\n4.5 2 0\n", ":2: '4.5' is not an integer"},
      {"a.off", replaced(off, "4 2 0", "4294967294 2 0"), ":9: the file ends after 6 of 4294967294 vertices"},
      {"a.off", replaced(off, "4 2 0", "4294967295 2 0"), ":2: "},
      {"a.off", replaced(off, "4 2 0", "99999999999999999999 2 0"), ":2: "},
      {"a.off", replaced(off, "4 2 0", "4 4000000000 0"), ":9: the file ends after 2 of 4000000000 faces"},
      {"a.off", replaced(off, "3 0 1 2", "2000000000 0 1 2"), ":7: a face of 2000000000 corners ends after 3"},
      {"a.off", replaced(off, "3 0 1 2", "-3 0 1 2"), ":7: "},
      {"a.off", replaced(off, "3 0 1 2", "2 0 1"), ":7: a face has 2 corners"},
      {"a.off", replaced(off, "3 0 1 2", "0"), ":7: a face has 0 corners"},
      {"a.off", replaced(off, "3 0 1 2", "3 0 1 4"), ":7: index 4 is out of range"},
      {"a.off", replaced(off, "3 0 1 2", "3 0 -1 2"), ":7: index -1 is out of range"},
      {"a.off", replaced(off, "3 0 1 2", "3 0 1 x"), ":7: 'x' is not an integer"},
      {"a.off", replaced(off, "1 1 0", "1 nan 0"), ":5: a coordinate is not finite"},
      {"a.off", replaced(off, "1 1 0", "1 -inf 0"), ":5: a coordinate is not finite"},
      {"a.off", replaced(off, "1 1 0", "1 1e101 0"), ":5: a coordinate is beyond 1e100"},
      {"a.off", replaced(off, "1 1 0", "1 1e999 0"), ":5: '1e999' is too large"},
      {"a.off", replaced(off, "1 1 0", "1 1"), ":5: a number is missing"},
      {"a.off", replaced(off, "1 1 0", "1 1 0x1"), ":5: '0x1' is not a number"},
      {"a.off", replaced(off, "1 1 0", "1 1 1,5"), ":5: '1,5' is not a number"},
      {"a.off", replaced(off, "1 1 0", "1 1 +-1"), ":5: '+-1' is not a number"},
      {"a.off", replaced(off, "1 1 0", std::string("1 1 \0\x1b\xff", 7)), ":5: "},
      {"a.off", "OFF\n3 0 0\n0 0 0\n1 0 0\n0 1 0\n", ": face 0: there is no face"},
      {"a.off", off.substr(0, off.find("0 1 0")), ":6: the file ends after 3 of 4 vertices"},
      // OBJ
      {"a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n", ": face 0: there is no face"},
      {"a.obj", "nothing of use\n", ": face 0: there is no face"},
      {"a.obj", replaced(obj, "f 1 2 3", "f 0 2 3"), ":5: index 0 is out of range"},
      {"a.obj", replaced(obj, "f 1 2 3", "f 1 2 5"), ":5: index 5 is out of range"},
      {"a.obj", replaced(obj, "f 1 2 3", "f -5 2 3"), ":5: index -5 is out of range"},
      {"a.obj", replaced(obj, "f 1 2 3", "f 1 2 99999999999999999999"), ":5: "},
      {"a.obj", replaced(obj, "f 1 2 3", "f 1 2 4294967296"), ":5: "},
      {"a.obj", replaced(obj, "f 1 2 3", "f 1 2 6\nf 1 2 5"), ":5: index 6 is out of range"},
      {"a.obj", replaced(obj, "f 1 2 3", "f 1 2"), ":5: a face has 2 corners"},
      {"a.obj", replaced(obj, "f 1 2 3", "f"), ":5: a face has 0 corners"},
      {"a.obj", replaced(obj, "f 1 2 3", "f 1 2 /3"), ":5: '' is not an integer"},
      {"a.obj", replaced(obj, "f 1 2 3", "f 1 2 3.5"), ":5: '3.5' is not an integer"},
      {"a.obj", replaced(obj, "v 1 1 0", "v 1 1"), ":3: a number is missing"},
      {"a.obj", replaced(obj, "v 1 1 0", "v 1 1 NaN"), ":3: a coordinate is not finite"},
      {"a.obj", replaced(obj, "v 1 1 0", "v 1 1 -2e100"), ":3: a coordinate is beyond 1e100"},
      // PLY
      {"a.ply", "plyx\n", ":1: does not begin with 'ply'"},
      {"a.ply", "ply\nformat ascii 1.0\nelement vertex 3\n", ":4: the file ends after a part of the header"},
      {"a.ply", replaced(ply, "ascii", "utf8"), ":2: unknown PLY format"},
      {"a.ply", replaced(ply, "format ascii 1.0\n", ""), ":8: the header has no format line"},
      {"a.ply", replaced(ply, "vertex 4", "vertex -4"), ":3: the number of items is negative"},
      {"a.ply", replaced(ply, "vertex 4", "vertex 4e9"), ":3: '4e9' is not an integer"},
      {"a.ply", replaced(ply, "vertex 4", "vertex 4000000000"), ":16: the file ends after 6 of 4000000000 items"},
      {"a.ply", replaced(ply, "face 2", "face 4000000000"), ":16: the file ends after 2 of 4000000000 items of 'face'"},
      {"a.ply", replaced(ply, "face 2", "face 0"), ": face 0: there is no face"},
      {"a.ply", replaced(ply, "face", "fact"), ":9: the header has no element 'face'"},
      {"a.ply", replaced(ply, "vertex 4", "vertices 4"), ":9: the header has no element 'vertex'"},
      {"a.ply", replaced(ply, "float z", "float w"), ":9: element 'vertex' needs one property 'z'"},
      {"a.ply", replaced(ply, "float z", "list uchar float z"), ":9: element 'vertex' needs one property 'z'"},
      {"a.ply", replaced(ply, "float z", "quad z"), ":6: 'quad' is not a PLY type"},
      {"a.ply", replaced(ply, "float z", "float"), ":6: a property has no name"},
      {"a.ply", replaced(ply, "list uchar", "list float"), ":8: a list is counted by floats"},
      {"a.ply", replaced(ply, "vertex_indices", "corners"), ":9: element 'face' needs one list"},
      {"a.ply", replaced(ply, "element face", "element vertex"), ":7: element 'vertex' appears twice"},
      {"a.ply", replaced(ply, "property float x", "prop x"), ":4: unknown header line 'prop'"},
      {"a.ply", "ply\nproperty int x\n", ":2: a property comes before all elements"},
      {"a.ply", replaced(ply, "1 1 0", "1 1 nan"), ":12: a coordinate is not finite"},
      {"a.ply", replaced(ply, "1 1 0", "1 1"), ":12: a number is missing"},
      {"a.ply", replaced(ply, "3 0 1 2", "3 0 1 4"), ":14: index 4 is out of range"},
      {"a.ply", replaced(ply, "3 0 1 2", "3 0 1 -1"), ":14: index -1 is out of range"},
      {"a.ply", replaced(ply, "3 0 1 2", "3 0 1 1.5"), ":14: index 1.5 is out of range"},
      {"a.ply", replaced(ply, "3 0 1 2", "4000000000 0 1 2"), ":14: a number is missing"},
      {"a.ply", replaced(ply, "3 0 1 2", "-3 0 1 2"), ":14: a list cannot have -3 entries"},
      {"a.ply", replaced(ply, "3 0 1 2", "2 0 1"), ":14: has 2 corners"},
      {"a.ply", bply_with(nan, 3, 2), ": vertex 1: a coordinate is not finite"},
      {"a.ply", bply_with(inf, 3, 2), ": vertex 1: a coordinate is not finite"},
      {"a.ply", bply_with(1, 3, 3), ": face 0: index 3 is out of range"},
      {"a.ply", bply_with(1, 3, -1), ": face 0: index -1 is out of range"},
      {"a.ply", bply_with(1, 2, 2), ": face 0: has 2 corners"},
      {"a.ply", bply_with(1, 4000000000u, 2), ": face 0: the file ends here"},
      {"a.ply", bply_with(1, 3, 2).substr(0, bply_head.size() + 20), ": vertex 1: the file ends here, of 3 declared"},
      {"a.ply", replaced(bply_with(1, 3, 2), "vertex 3", "vertex 4000000000"), ": vertex 4: the file ends here"},
      {"a.ply", bply.substr(0, bply.size() - 3), ": face 3: the file ends here"},
      {"a.ply", replaced(labelled, "3 0 1 2", "3 0 1 2 0.5"), ":15: 0.5 is not a label"},
      {"a.ply", replaced(labelled, "3 0 1 2", "3 0 1 2 4294967296"), ":15: 4294967296 is not a label"},
      {"a.ply", replaced(labelled, "end_header", "property int label\nend_header"),
       ":11: element 'face' has several properties 'label'"},
      {"a.ply", edged + "0 4\n", ":19: index 4 is out of range"},
      {"a.ply", replaced(edged, "edge 1", "edge 4000000000") + "0 1\n",
       ":20: the file ends after 1 of 4000000000 items of 'edge'"},
      {"a.obj", replaced(obj, "f 1 2 3", "l 1 5\nf 1 2 3"), ":5: index 5 is out of range"},
      {"a.obj", replaced(obj, "f 1 2 3", "l 1\nf 1 2 3"), ":5: a line has 1 vertex"},
      {"a.obj", replaced(obj, "f 1 2 3", "l 1 0\nf 1 2 3"), ":5: index 0 is out of range"},
      // STL
      {"a.stl", "solid nothing\nendsolid nothing\n", ": face 0: there is no face"},
      {"a.stl", "solid", ":1: the file ends after 0 faces"},
      {"a.stl", stl.substr(0, stl.find("endsolid")), ":16: the file ends after 2 faces"},
      {"a.stl", stl.substr(0, stl.find("endfacet") + 9), ":9: the file ends after 1 face"},
      {"a.stl", replaced(stl, "vertex 1 0 0", "vertex 1 0"), ":5: a number is missing"},
      {"a.stl", replaced(stl, "vertex 1 0 0", "vertex 1 0 nan"), ":5: a coordinate is not finite"},
      {"a.stl", replaced(stl, "vertex 1 0 0\n", ""), ":7: a facet has 2 corners"},
      {"a.stl", replaced(stl, "endfacet\n", ""), ":8: a facet begins inside another"},
      {"a.stl", replaced(stl, "endfacet\nendsolid", "endsolid"), ":15: the solid ends inside a facet"},
      {"a.stl", replaced(stl, "endfacet", "endfacet\nendfacet"), ":9: endfacet without a facet"},
      {"a.stl", replaced(stl, "endfacet", "endfacet\nvertex 0 0 0"), ":9: a vertex outside any facet"},
      {"a.stl", replaced(stl, "endloop", "endlop"), ":7: 'endlop' is not an STL keyword"},
      {"a.stl", "too short for a header", ": byte 22: the file ends in the header"},
      {"a.stl", replaced(bstl.substr(0, 83), "solid", "shell"), ": byte 83: the file ends in the header"},
      {"a.stl", bstl.substr(0, bstl.size() - 1), ": face 1: the file ends here, of 2 declared"},
      {"a.stl", bstl_many, ": face 2: the file ends here, of 4294967295 declared"},
      {"a.stl", bstl_with(nan), ": face 1: a coordinate is not finite"},
      {"a.stl", bstl_with(inf), ": face 1: a coordinate is not finite"},
      {"a.stl", binary_stl({}), ": face 0: there is no face"},
  };
  for (const Malformed& c : cases) {
    const std::string file = store(c.name, c.bytes), begin = file + c.place;
    largest_allocation = 0;
    try {
      read_mesh(file);
      ADD_FAILURE() << begin << " was not refused";
    } catch (const Error& error) {
      const std::string what = error.what();
      EXPECT_EQ(what.substr(0, begin.size()), begin);
      EXPECT_NE(what.find("; "), std::string::npos) << "says what to do: " << what;
      for (const char x : what) EXPECT_GE(static_cast<unsigned char>(x), 0x20) << what;
    }
    EXPECT_LE(largest_allocation, std::size_t{1} << 18) << begin;
  }
}

TEST_F(Io, RefusesWhatIsNotAFile) {
  for (const std::string& name : {path("missing.off"), path("no/such/folder.ply"), std::string()})
    EXPECT_THROW(read_mesh(name), Error);
  fs::create_directory(path("folder.off"));
  EXPECT_THROW(read_mesh(path("folder.off")), Error);
  EXPECT_THROW(read_points(path("missing.xyz")), Error);
  try {
    read_mesh(path("line\nbreak.off"));
    ADD_FAILURE();
  } catch (const Error& error) {
    EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
  }
}

TEST_F(Io, SurvivesTruncationAndDamage) {
  WriteOptions lines;
  lines.lines = true;
  write_mesh(path("marked.obj"), marked_square(), lines);
  write_mesh(path("marked.ply"), marked_square());
  const std::vector<std::pair<const char*, std::string>> valid{
      {"a.obj", slurp("marked.obj")},
      {"a.ply", slurp("marked.ply")},
      {"a.off", kOff},
      {"a.off", replaced(kOff, "3 0 1 2\n3 0 2 3", "4 0 1 2 3\n4 3 2 1 0")},
      {"a.obj", kObj},
      {"a.ply", kPly},
      {"a.ply", rich_ply(false)},
      {"a.ply", rich_ply(true)},
      {"a.stl", kStl},
      {"a.stl", binary_stl(kTwoFacets)}};
  SplitMix64 random(1);
  std::size_t refused = 0, accepted = 0;
  for (const auto& [name, bytes] : valid)
    for (int round = 0; round < 1000; ++round) {
      std::string damaged = bytes;
      if (round % 3 == 0) damaged.resize(random.below(bytes.size()));
      const std::size_t flips = round % 3 == 0 ? random.below(2) : 1 + random.below(4);
      for (std::size_t i = 0; i < flips && !damaged.empty(); ++i) {
        const std::size_t at = random.below(damaged.size());
        constexpr std::string_view kTelling = "0123456789-+.enfa#/\\ \n\r\t\xff";
        damaged[at] = round % 2 ? kTelling[random.below(kTelling.size())]
                                : static_cast<char>(damaged[at] ^ static_cast<char>(1u << random.below(8)));
      }
      const std::string file = store(name, damaged);
      largest_allocation = 0;
      try {
        const TriangleMesh mesh = read_mesh(file);
        ++accepted;
        EXPECT_FALSE(mesh.triangles.empty());
        for (const Vec3& p : mesh.vertices)
          for (int k = 0; k < 3; ++k) EXPECT_LE(std::abs(p[k]), 1e100);
        for (const Triangle& t : mesh.triangles)
          for (const Index v : t) EXPECT_LT(v, mesh.vertices.size());
        EXPECT_TRUE(mesh.face_of_triangle.empty() || mesh.face_of_triangle.size() == mesh.triangles.size());
        EXPECT_TRUE(mesh.labels.empty() || mesh.labels.size() == mesh.triangles.size());
        for (const auto& e : mesh.feature_edges) EXPECT_LT(e[0], e[1]);
      } catch (const Error& error) {
        ++refused;
        EXPECT_EQ(std::string(error.what()).rfind(file, 0), 0u) << error.what();
        EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << error.what();
      }
      EXPECT_LE(largest_allocation, std::size_t{1} << 18) << name;
    }
  EXPECT_GT(refused, 1000u);
  EXPECT_GT(accepted, 1000u);
}

using Edges = std::vector<std::array<Index, 2>>;

TEST_F(Io, LabelsAndFeatureEdgesRoundTrip) {
  TriangleMesh several = icosphere(2);
  for (std::size_t t = 0; t < several.triangles.size(); ++t)
    several.labels.push_back(static_cast<std::int32_t>(t % 5) - 2);
  TriangleMesh one = kSquare, only_edges = kSquare;
  one.labels = {7, 7};
  only_edges.feature_edges = {{1, 2}};
  WriteOptions lines;
  lines.lines = true;
  for (const TriangleMesh& mesh : {marked_square(), several, one, only_edges})
    for (const char* name : {"a.ply", "a.obj"}) {
      write_mesh(path(name), mesh, lines);
      expect_same(read_mesh(path(name)), mesh);
    }
  write_mesh(path("a.obj"), only_edges);
  EXPECT_TRUE(read_mesh(path("a.obj")).feature_edges.empty());
  EXPECT_EQ(slurp("a.obj").find("\nl "), std::string::npos);
  one.labels = {1, 0};
  for (const char* name : {"a.ply", "a.obj"}) {
    write_mesh(path(name), one, {"region", {"plane", "plane_pair"}});
    expect_same(read_mesh(path(name)), one);
    EXPECT_THROW(write_mesh(path(name), one, {"region", {"plane"}}), Error);
    EXPECT_THROW(write_mesh(path(name), several, {"region", {"a", "b", "c"}}), Error);
  }
  for (const char* name : {"a.off", "a.stl"}) {
    write_mesh(path(name), marked_square());
    const TriangleMesh back = read_mesh(path(name));
    EXPECT_TRUE(back.labels.empty());
    EXPECT_TRUE(back.feature_edges.empty());
  }
}

TEST_F(Io, ReadsLabelsOfPly) {
  const std::string head =
      "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
      "property float z\nelement face 2\nproperty TYPE label\n"
      "property list uchar int vertex_indices\nelement edge 2\nproperty float length\n"
      "property uchar vertex2\nproperty short vertex1\nend_header\n"
      "0 0 0\n1 0 0\n1 1 0\n0 1 0\n";
  for (const char* type : {"char", "uchar", "short", "ushort", "int", "uint"}) {
    const TriangleMesh mesh =
        read("a.ply", replaced(head, "TYPE", type) + "5 4 0 1 2 3\n9 3 0 1 2\n1.5 3 2\n2.5 1 2\n");
    EXPECT_EQ(mesh.labels, (std::vector<std::int32_t>{5, 5, 9}));  // both halves of the quad
    EXPECT_EQ(mesh.feature_edges, (Edges{{1, 2}, {2, 3}}));
  }
  // Of other types it is something else.
  EXPECT_TRUE(read("a.ply", replaced(head, "TYPE", "float") + "5 3 0 1 2\n9 3 0 2 3\n1 3 2\n1 1 2\n").labels.empty());
  for (const bool big_endian : {false, true}) {
    std::string bytes = std::string("ply\nformat binary_") + (big_endian ? "big" : "little") +
                        "_endian 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
                        "element edge 2\nproperty ushort vertex1\nproperty int vertex2\nproperty uchar flag\n"
                        "element face 2\nproperty list uchar int vertex_indices\nproperty short label\nend_header\n";
    for (const Vec3& p : kSquare.vertices)
      for (int k = 0; k < 3; ++k) put(bytes, static_cast<float>(p[k]), big_endian);
    for (const auto& [a, b] : {std::pair{3, 2}, {1, 3}}) {  // the second is not an edge
      put(bytes, static_cast<std::uint16_t>(a), big_endian);
      put(bytes, std::int32_t{b}, big_endian);
      put(bytes, std::uint8_t{1}, big_endian);
    }
    for (std::size_t t = 0; t < 2; ++t) {
      put(bytes, std::uint8_t{3}, big_endian);
      for (const Index v : kSquare.triangles[t]) put(bytes, v, big_endian);
      put(bytes, static_cast<std::int16_t>(t == 0 ? -5 : 300), big_endian);
    }
    const TriangleMesh mesh = read("a.ply", bytes);
    EXPECT_EQ(mesh.labels, (std::vector<std::int32_t>{-5, 300}));
    EXPECT_EQ(mesh.feature_edges, (Edges{{2, 3}}));
    ASSERT_EQ(warnings_.size(), 1u);
    EXPECT_NE(warnings_[0].find("1 marked edge off the surface"), std::string::npos) << warnings_[0];
  }
}

TEST_F(Io, ReadsGroupsAndLinesOfObj) {
  const std::string vertices = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";
  const auto labels = [&](const std::string& rest) { return read("a.obj", vertices + rest).labels; };
  using Labels = std::vector<std::int32_t>;
  EXPECT_EQ(labels("g b\nf 1 2 3\ng a\nf 1 3 4\ng b\nf 1 2 4\n"), (Labels{0, 1, 0}));
  EXPECT_EQ(labels("usemtl red\nf 1 2 3\nusemtl blue\nf 1 2 3 4\n"), (Labels{0, 1, 1}));
  EXPECT_EQ(labels("f 1 2 3\ng  a  b\nf 1 3 4\nusemtl m\nf 1 2 4\ng a b\nf 1 2 4\n"), (Labels{0, 1, 2, 2}));
  EXPECT_EQ(labels("g empty\ng a\nf 1 2 3\nf 1 3 4\n"), Labels{});
  EXPECT_EQ(labels("g label_5\nf 1 2 3\ng label_-7\nf 1 3 4\n"), (Labels{5, -7}));
  EXPECT_EQ(labels("g label_5\nf 1 2 3\ng label_x\nf 1 3 4\n"), (Labels{0, 1}));
  EXPECT_EQ(labels("g label_5\nf 1 2 3\ng label_99999999999\nf 1 3 4\n"), (Labels{0, 1}));
  EXPECT_EQ(labels("g region_5_plane\nf 1 2 3\ng region_2_plane_pair\nf 1 3 4\n"), (Labels{5, 2}));
  EXPECT_EQ(labels("g region_5_plane\nf 1 2 3\ng region_5_cone\nf 1 3 4\n"), (Labels{0, 1}));
  EXPECT_EQ(labels("g region_5\nf 1 2 3\ng region_6_cone\nf 1 3 4\n"), (Labels{5, 6}));
  // Lines of several vertices, from the end, before the vertices, with texture coordinates, closed, off the surface.
  EXPECT_EQ(read("a.obj", "l 4/1 1/2 2/\n" + vertices + "f 1 2 3 4\nl -2 -1\nl 2 1 \\\n3\nl 2 4 4\n").feature_edges,
            (Edges{{0, 1}, {0, 2}, {0, 3}, {2, 3}}));
  ASSERT_EQ(warnings_.size(), 2u);
  EXPECT_NE(warnings_[1].find("2 marked edges off the surface"), std::string::npos) << warnings_[1];
}

TEST_F(Io, ReadsFeatureEdges) {
  EXPECT_EQ(read_feature_edges(store("e.txt", "# edges\n2 0\n\n 1 2 # again\r\n0 2 7\n"), kSquare),
            (Edges{{0, 2}, {1, 2}}));
  write_feature_edges(path("e.txt"), {{0, 1}, {2, 3}});
  EXPECT_EQ(read_feature_edges(path("e.txt"), kSquare), (Edges{{0, 1}, {2, 3}}));
  write_feature_edges(path("e.txt"), {});
  EXPECT_TRUE(read_feature_edges(path("e.txt"), kSquare).empty());
  for (const auto& [text, place] : {std::pair{"0 1\n1\n", ":2: an edge has one vertex"},
                                    {"0 4\n", ":1: index 4 is out of range"},
                                    {"-1 0\n", ":1: index -1 is out of range"},
                                    {"0 1\n# no\n3 1\n", ":3: 3 1 is not an edge"},
                                    {"1 1\n", ":1: 1 1 is not an edge"},
                                    {"a b\n", ":1: 'a' is not an integer"},
                                    {"", ": the file is empty"}}) {
    const std::string file = store("e.txt", text);
    try {
      read_feature_edges(file, kSquare);
      ADD_FAILURE() << text;
    } catch (const Error& error) {
      EXPECT_EQ(std::string(error.what()).rfind(file + place, 0), 0u) << error.what();
    }
  }
}

TEST_F(Io, ReadsVertexAttributes) {
  EXPECT_EQ(read_vertex_attribute(store("a.ply", rich_ply(false)), "red"), (std::vector<double>{200, 200, 200, 200}));
  EXPECT_EQ(read_vertex_attribute(store("a.ply", rich_ply(true)), "z"), (std::vector<double>{0, 0, 0, 0.1}));
  const std::string text =
      "ply\nformat ascii 1.0\nelement face 1\nproperty list uchar int vertex_indices\n"
      "element vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
      "property double size\nend_header\n3 0 1 2\n0 0 0 1.5\n1 0 0 -2\n0 1 0 1e-3\n";
  EXPECT_EQ(read_vertex_attribute(store("a.ply", text), "size"), (std::vector<double>{1.5, -2, 1e-3}));
  const auto message = [&](const std::string& file, const char* name) -> std::string {
    largest_allocation = 0;
    try {
      read_vertex_attribute(file, name);
    } catch (const Error& error) {
      EXPECT_EQ(std::string(error.what()).rfind(file, 0), 0u) << error.what();
      EXPECT_LE(largest_allocation, std::size_t{1} << 18);
      return std::string(error.what()).substr(file.size());
    }
    return "nothing";
  };
  EXPECT_NE(message(store("a.ply", text), "tags").find("use one of x, y, z, size"), std::string::npos);
  const auto begins = [&](const std::string& bytes, const char* what) {
    EXPECT_EQ(message(store("a.ply", bytes), "size").rfind(what, 0), 0u) << what;
  };
  begins(replaced(text, "-2", "nan"), ": vertex 1: 'size' is not finite");
  begins(replaced(text, "-2", ""), ":13: a number is missing");
  begins(replaced(text, "vertex 3", "vertex 4000000000"), ":15: the file ends");
  EXPECT_NE(message(store("a.off", kOff), "size").find(".off files have none"), std::string::npos);
}

TEST_F(Io, ReadsPoints) {
  const std::vector<Vec3> expected{{1, 2, 3}, {-0.5, 1e-3, 4}};
  EXPECT_EQ(read_points(store("a.xyz", "# seeds\n1 2 3\n\n -5e-1\t+0.001 4 0 0 1 # normal\r\n")), expected);
  for (const auto& [text, place] : {std::pair{"", ": the file is empty"},
                                    {"# none\n", ":2: there is no point"},
                                    {"1 2 3\n1 2\n", ":2: a number is missing"},
                                    {"1 2 inf\n", ":1: a coordinate is not finite"},
                                    {"x y z\n", ":1: 'x' is not a number"}}) {
    const std::string file = store("a.xyz", text);
    try {
      read_points(file);
      ADD_FAILURE() << text;
    } catch (const Error& error) {
      EXPECT_EQ(std::string(error.what()).rfind(file + place, 0), 0u) << error.what();
    }
  }
}

TEST_F(Io, WritesPolygons) {
  PolygonMesh mesh;
  mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0.5, 2, 0.1}};
  mesh.polygons.values = {0, 1, 2, 3, 3, 2, 4};
  mesh.polygons.offsets = {0, 4, 7};
  mesh.labels = {7, 4000000000u};
  mesh.colours = {{255, 0, 1}, {2, 3, 4}};
  write_polygons(path("a.ply"), mesh);
  const TriangleMesh back = read_mesh(path("a.ply"));
  EXPECT_EQ(back.vertices, mesh.vertices);
  EXPECT_EQ(back.triangles, (std::vector<Triangle>{{0, 1, 2}, {0, 2, 3}, {3, 2, 4}}));
  EXPECT_EQ(back.face_of_triangle, (std::vector<Index>{0, 0, 1}));
  EXPECT_EQ(back.labels, (std::vector<std::int32_t>{7, 7, static_cast<std::int32_t>(4000000000u)}));
  std::string tail;
  put(tail, std::uint8_t{3});
  for (const Index v : {3u, 2u, 4u}) put(tail, v);
  put(tail, 4000000000u);
  tail += std::string("\x02\x03\x04", 3);
  EXPECT_TRUE(slurp("a.ply").ends_with(tail));

  PolygonMesh wheel;  // more corners than a byte counts
  for (int i = 0; i < 300; ++i) {
    wheel.vertices.push_back({std::cos(i / 50.0), std::sin(i / 50.0), 0});
    wheel.polygons.values.push_back(static_cast<Index>(i));
  }
  wheel.polygons.offsets.push_back(300);
  write_polygons(path("a.ply"), wheel);
  EXPECT_EQ(read_mesh(path("a.ply")).triangles.size(), 298u);

  EXPECT_THROW(write_polygons(path("b.ply"), mesh, {"region", {"one", "two"}}), Error);  // 7 has no name
  mesh.labels.pop_back();
  EXPECT_THROW(write_polygons(path("b.ply"), mesh), Error);
  EXPECT_THROW(write_polygons(path("b.stl"), wheel), Error);
  EXPECT_FALSE(fs::exists(path("b.ply")));
}

TEST_F(Io, WritesNothingThatCannotBeRead) {
  TriangleMesh mesh = kSquare;
  mesh.vertices[2].y = std::nan("");
  EXPECT_THROW(write_mesh(path("a.off"), mesh), Error);
  mesh.vertices[2].y = 1e39;
  EXPECT_THROW(write_mesh(path("a.stl"), mesh), Error);
  mesh.triangles[1][1] = 4;
  EXPECT_THROW(write_mesh(path("a.obj"), mesh), Error);
  mesh = kSquare;
  mesh.labels = {1};
  EXPECT_THROW(write_mesh(path("a.ply"), mesh), Error);
  mesh = kSquare;
  mesh.feature_edges = {{0, 4}};
  EXPECT_THROW(write_mesh(path("a.obj"), mesh), Error);
  EXPECT_THROW(write_mesh(path("a.txt"), kSquare), Error);
  EXPECT_TRUE(files().empty());
}

TEST_F(Io, ReplacesFilesAtOnce) {
  write_file(path("a.txt"), "one");
  write_file(path("a.txt"), "two");
  EXPECT_EQ(slurp("a.txt"), "two");
  EXPECT_EQ(files(), std::vector<std::string>{"a.txt"});

  fs::create_symlink("a.txt", path("link.txt"));
  write_file(path("link.txt"), "three");
  EXPECT_TRUE(fs::is_symlink(path("link.txt")));
  EXPECT_EQ(slurp("a.txt"), "three");

  fs::create_directory(path("folder"));
  EXPECT_THROW(write_file(path("folder"), "x"), Error);
  EXPECT_THROW(write_file(path("missing/a.txt"), "x"), Error);
  EXPECT_NO_THROW(write_file("/dev/null", "x"));
  EXPECT_FALSE(fs::is_regular_file("/dev/null"));
  EXPECT_EQ(files().size(), 3u);
}

TEST_F(Io, LeavesTheOldFileWhenTheFolderIsReadOnly) {
  if (::geteuid() == 0) GTEST_SKIP() << "root writes anywhere";
  write_file(path("a.txt"), "old");
  fs::permissions(folder_, fs::perms::owner_read | fs::perms::owner_exec);
  EXPECT_THROW(write_file(path("a.txt"), "new"), Error);
  fs::permissions(folder_, fs::perms::owner_all);
  EXPECT_EQ(slurp("a.txt"), "old");
}

TEST_F(Io, LeavesTheOldFileWhenWritingFailsHalfway) {
  write_file(path("a.txt"), "old");
  struct rlimit before {};
  ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &before), 0);
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  struct rlimit small = before;
  small.rlim_cur = 1 << 16;
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &small), 0);
  EXPECT_THROW(write_file(path("a.txt"), std::string(1 << 20, 'x')), Error);
  ::setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, handler);
  EXPECT_EQ(slurp("a.txt"), "old");
  EXPECT_EQ(files(), std::vector<std::string>{"a.txt"});
}

TEST_F(Io, RealModelsRoundTrip) {
  for (const char* name : {"bunny.off", "igea.ply", "homer.obj", "beetle.obj"}) {
    const std::string model = shared_model(name);
    if (model.empty()) continue;
    const TriangleMesh mesh = read_mesh(model);
    for (const char* copy : {"a.off", "a.obj", "a.ply"}) {
      write_mesh(path(copy), mesh);
      const TriangleMesh back = read_mesh(path(copy));
      EXPECT_EQ(back.vertices, mesh.vertices) << name << copy;
      EXPECT_EQ(back.triangles, mesh.triangles) << name << copy;
    }
  }
}

}  // namespace
}  // namespace bisector::test
