// Attributes in files: what a format is said to hold comes back, and nothing else.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <string>

#include "bisector/attributes.h"
#include "bisector/io.h"
#include "io/bytes.h"
#include "mesh/attribute_sizes.h"
#include "mesh/tet_topology.h"
#include "support/files.h"
#include "support/models.h"
#include "support/solids.h"

namespace bisector::test {
namespace {

using Site = Attribute::Site;
using Type = Attribute::Type;
using AttributeFiles = FileTest;

// Numbers that the type holds without loss.
Attribute random_attribute(const std::string& name, Site site, Type type, std::size_t components, std::size_t sites) {
  SplitMix64 random(components + 10 * static_cast<std::size_t>(type));
  Attribute attribute{name, site, type, components};
  for (std::size_t i = 0; i < components * sites; ++i) {
    if (type >= Type::float32) attribute.values.push_back(static_cast<double>(random.below(1 << 20)) * 0x1p-20);
    else attribute.values.push_back(static_cast<double>(random.below(128)));
  }
  return attribute;
}

// One of each kind that some format has a place of its own for, and of each type.
std::vector<Attribute> of_every_kind(const TriangleMesh& mesh) {
  std::vector<Attribute> all;
  const auto add = [&](const char* name, Site site, Type type, std::size_t components) {
    all.push_back(random_attribute(name, site, type, components, site_count(mesh, site)));
  };
  add("heat", Site::vertex, Type::float64, 1);
  add("color", Site::vertex, Type::uint8, 3);
  add("normal", Site::vertex, Type::float32, 3);
  add("texcoord", Site::vertex, Type::float32, 2);
  add("part", Site::vertex, Type::int32, 1);
  add("flow", Site::vertex, Type::float32, 4);
  for (const auto& [name, type] :
       {std::pair{"a", Type::int8}, {"b", Type::int16}, {"c", Type::uint16}, {"d", Type::uint32}})
    add(name, Site::vertex, type, 1);
  add("stress", Site::element, Type::float64, 1);
  add("color", Site::element, Type::uint8, 4);
  add("texcoord", Site::corner, Type::float32, 2);
  add("weight", Site::corner, Type::float64, 1);
  return all;
}

// Each attribute by itself, so that none stands in another's place.
TEST_F(AttributeFiles, WhatAFormatHoldsComesBack) {
  const TriangleMesh surface = torus(7, 5);
  for (const FileFormat& format : file_formats()) {
    if (!format.writes_surfaces || !format.reads_surfaces) continue;
    const std::string name = path("surface" + std::string(format.extension));
    for (const Attribute& attribute : of_every_kind(surface)) {
      SCOPED_TRACE(name + " " + attribute.name + " " + std::to_string(static_cast<int>(attribute.site)));
      TriangleMesh mesh = surface;
      mesh.attributes = {attribute};
      write_mesh(name, mesh);
      const TriangleMesh read = read_mesh(name);
      const bool held = lost_attributes(name, mesh.attributes).empty();
      ASSERT_EQ(read.attributes.size(), held ? 1u : 0u);
      if (!held) continue;
      const Attribute& back = read.attributes[0];
      EXPECT_EQ(back.name, attribute.name);
      EXPECT_EQ(back.site, attribute.site);
      EXPECT_EQ(back.components, attribute.components);
      if (format.extension == ".obj") {  // texts of floats, and colours from 0 to 1
        const double scale = attribute.name == "color" ? 255 : 1;
        EXPECT_EQ(back.type, Type::float64);
        for (std::size_t i = 0; i < attribute.values.size(); ++i)
          EXPECT_NEAR(scale * back.values[i], attribute.values[i], scale * 1e-7);
        continue;
      }
      EXPECT_EQ(back.type, attribute.type);
      EXPECT_EQ(back.values, attribute.values);
    }
  }
}

TEST_F(AttributeFiles, AllOfThemAtOnce) {
  TriangleMesh mesh = torus(7, 5);
  mesh.attributes = of_every_kind(mesh);
  for (const char* extension : {".ply", ".vtp"}) {
    const std::string name = path("all" + std::string(extension));
    write_mesh(name, mesh);
    const TriangleMesh read = read_mesh(name);
    const std::vector<std::string> lost = lost_attributes(name, mesh.attributes);
    ASSERT_EQ(read.attributes.size() + lost.size(), mesh.attributes.size());
    EXPECT_EQ(lost, extension == std::string(".ply") ? std::vector<std::string>{"weight"}
                                                     : (std::vector<std::string>{"texcoord", "weight"}));
    for (const Attribute& back : read.attributes) {
      const auto same = std::find_if(mesh.attributes.begin(), mesh.attributes.end(), [&](const Attribute& a) {
        return a.name == back.name && a.site == back.site && a.type == back.type && a.values == back.values;
      });
      EXPECT_NE(same, mesh.attributes.end()) << back.name;
    }
  }
}

TEST_F(AttributeFiles, OfTetrahedra) {
  TetMesh mesh = marked_cube(2);
  mesh.attributes = {random_attribute("heat", Site::vertex, Type::float64, 1, mesh.vertices.size()),
                     random_attribute("flow", Site::vertex, Type::float32, 3, mesh.vertices.size()),
                     random_attribute("stress", Site::element, Type::float32, 2, mesh.tets.size()),
                     random_attribute("age", Site::element, Type::int64, 1, mesh.tets.size())};
  write_tet_mesh(path("solid.vtu"), mesh);
  const TetMesh read = read_tet_mesh(path("solid.vtu"));
  ASSERT_EQ(read.attributes.size(), 4u);
  for (std::size_t k = 0; k < 4; ++k) {
    EXPECT_EQ(read.attributes[k].name, mesh.attributes[k].name);
    EXPECT_EQ(read.attributes[k].type, mesh.attributes[k].type);
    EXPECT_EQ(read.attributes[k].values, mesh.attributes[k].values);
  }
  EXPECT_EQ(read.regions, mesh.regions);
  EXPECT_EQ(read_tet_attribute(path("solid.vtu"), "heat"), mesh.attributes[0].values);
  EXPECT_EQ(lost_attributes("a.msh", mesh.attributes).size(), 4u);
}

// Corners come back with a warning; nodes stay as vertices, and have the mean of their edge's ends.
TEST_F(AttributeFiles, OfNodesOnEdges) {
  TetMesh mesh = marked_cube(2);
  mesh.attributes = {random_attribute("heat", Site::vertex, Type::float64, 1, mesh.vertices.size()),
                     random_attribute("part", Site::vertex, Type::int32, 1, mesh.vertices.size())};
  const SecondOrder order = second_order(mesh, boundary_surface(mesh), {});
  for (const char* name : {"nodes.vtu", "nodes.msh"}) {
    write_tet_mesh(path(name), mesh, order);
    const TetMesh read = read_tet_mesh(path(name), collecting());
    ASSERT_EQ(warnings_.size(), 1u);
    EXPECT_NE(warnings_[0].find("of second order taken by their corners"), std::string::npos);
    EXPECT_EQ(read.tets, mesh.tets);
    EXPECT_EQ(read.boundary, mesh.boundary);
    EXPECT_EQ(read.feature_edges, mesh.feature_edges);
    ASSERT_EQ(read.vertices.size(), mesh.vertices.size() + order.nodes.size());
    if (read.attributes.empty()) continue;
    for (std::size_t e = 0; e < order.edges.size(); ++e) {
      const auto [a, b] = order.edges[e];
      const std::vector<double>&heat = read.attributes[0].values, &part = read.attributes[1].values;
      EXPECT_EQ(heat[mesh.vertices.size() + e], 0.5 * (heat[a] + heat[b]));
      EXPECT_EQ(part[mesh.vertices.size() + e], part[a]);
    }
  }
  EXPECT_THROW(write_tet_mesh(path("nodes.mesh"), mesh, order), Error);
  SecondOrder part = order;
  part.edges.pop_back();
  EXPECT_THROW(write_tet_mesh(path("nodes.vtu"), mesh, part), Error);
  part.nodes.pop_back();
  EXPECT_THROW(write_tet_mesh(path("nodes.vtu"), mesh, part), Error);
}

TEST_F(AttributeFiles, LegacyVtkHasVectorsAndColours) {
  const std::string name = store("old.vtk", R"(# vtk DataFile Version 3.0
old
ASCII
DATASET UNSTRUCTURED_GRID
POINTS 4 double
0 0 0 1 0 0 0 1 0 0 0 1
CELLS 2 9
4 0 1 2 3
3 0 2 1
CELL_TYPES 2
10 5
POINT_DATA 4
VECTORS wind float
1 2 3 4 5 6 7 8 9 10 11 12
SCALARS heat double 1
LOOKUP_TABLE default
1 2 3 4
CELL_DATA 2
SCALARS region int 1
LOOKUP_TABLE default
5 0
FIELD more 1
pair 2 2 double
1 2 3 4
)");
  const TetMesh mesh = read_tet_mesh(name);
  ASSERT_EQ(mesh.attributes.size(), 3u);
  EXPECT_EQ(mesh.attributes[0].name, "wind");
  EXPECT_EQ(mesh.attributes[0].components, 3u);
  EXPECT_EQ(mesh.attributes[0].values[11], 12);
  EXPECT_EQ(mesh.attributes[1].name, "heat");
  EXPECT_EQ(mesh.attributes[2].name, "pair");
  EXPECT_EQ(mesh.attributes[2].site, Site::element);
  EXPECT_EQ(mesh.attributes[2].values, (std::vector<double>{1, 2}));
  EXPECT_EQ(mesh.regions, (std::vector<std::int32_t>{5}));
}

// --- OBJ ---

TEST_F(AttributeFiles, ObjTextureOfVerticesOrCorners) {
  const std::string square = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0.25 0\nvt 1 0 0\nvt 1 1\nvt 0 1\nvt 0.5 0.5\n";
  const TriangleMesh one = read_mesh(store("one.obj", square + "f 1/1 2/2 3/3\nf 1/1/1 3/3/1 4/-2/1\n"));
  ASSERT_EQ(one.attributes.size(), 1u);
  EXPECT_EQ(one.attributes[0].name, "texcoord");
  EXPECT_EQ(one.attributes[0].site, Site::vertex);
  EXPECT_EQ(one.attributes[0].values, (std::vector<double>{0.25, 0, 1, 0, 1, 1, 0, 1}));
  const TriangleMesh several = read_mesh(store("several.obj", square + "f 1/1 2/2 3/3\nf 1/5 3/3 4\n"));
  ASSERT_EQ(several.attributes.size(), 1u);
  EXPECT_EQ(several.attributes[0].site, Site::corner);
  EXPECT_EQ(several.attributes[0].values, (std::vector<double>{0.25, 0, 1, 0, 1, 1, 0.5, 0.5, 1, 1, 0, 0}));
  EXPECT_TRUE(read_mesh(store("none.obj", square + "f 1 2 3//2\n")).attributes.empty());
  EXPECT_TRUE(read_mesh(store("left-out.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1/1 2/-2 3/3\n")).attributes.empty());
  expect_error_line([&] { read_mesh(store("far.obj", square + "f 1/1 2/2 3/9\n")); }, path("far.obj") + ":10",
                    "index 9 is out of range, the file has 5 texture coordinates");
  expect_error_line([&] { read_mesh(store("zero.obj", square + "f 1/0 2/2 3/3\n")); }, path("zero.obj") + ":10",
                    "index 0");
}

TEST_F(AttributeFiles, ObjColours) {
  const auto colours_of = [&](const char* name, const char* text) {
    const TriangleMesh mesh = read_mesh(store(name, text));
    return mesh.attributes.empty() ? Attribute{} : mesh.attributes[0];
  };
  const Attribute shares = colours_of("a.obj", "v 0 0 0 1 0 0.5\nv 1 0 0 0 0 0\nv 0 1 0 0 1 0\nf 1 2 3\n");
  EXPECT_EQ(shares.name, "color");
  EXPECT_EQ(shares.type, Type::float64);
  EXPECT_EQ(shares.values, (std::vector<double>{1, 0, 0.5, 0, 0, 0, 0, 1, 0}));
  EXPECT_EQ(colours_of("b.obj", "v 0 0 0 255 0 9\nv 1 0 0 0 0 0\nv 0 1 0 0 1 0\nf 1 2 3\n").type, Type::uint8);
  EXPECT_EQ(colours_of("c.obj", "v 0 0 0 1\nv 1 0 0 1\nv 0 1 0 1\nf 1 2 3\n").name, "");        // a weight
  EXPECT_EQ(colours_of("d.obj", "v 0 0 0 1 1 1\nv 1 0 0\nv 0 1 0 1 1 1\nf 1 2 3\n").name, "");  // not of all
}

TEST_F(AttributeFiles, ObjMaterialsComeThrough) {
  const std::string corners = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";
  const TriangleMesh two = read_mesh(
      store("two.obj", "mtllib a b.mtl\n" + corners + "g front\nusemtl red\nf 1 2 3\ng back\nusemtl red\nf 1 3 4\n"));
  EXPECT_EQ(two.material_files, (std::vector<std::string>{"a b.mtl"}));
  EXPECT_EQ(two.label_names, (LabelNames{{0, "front"}, {1, "back"}}));
  EXPECT_EQ(two.label_materials, (LabelNames{{0, "red"}, {1, "red"}}));
  const TriangleMesh one = read_mesh(store("one.obj", "mtllib a.mtl\n" + corners + "usemtl skin\nf 1 2 3 4\n"));
  EXPECT_TRUE(one.labels.empty());
  for (const TriangleMesh& mesh : {one, two}) {
    write_mesh(path("again.obj"), mesh);
    const TriangleMesh again = read_mesh(path("again.obj"));
    EXPECT_EQ(again.material_files, mesh.material_files);
    EXPECT_EQ(again.label_materials, mesh.label_materials);
    EXPECT_EQ(again.label_names, mesh.label_names);
    EXPECT_EQ(again.labels, mesh.labels);
  }
}

// --- PLY ---

TEST_F(AttributeFiles, PlyOfPolygons) {
  const TriangleMesh mesh = read_mesh(store("quad.ply", R"(ply
format ascii 1.0
comment TextureFile bark and leaves.png
element vertex 4
property float x
property float y
property uchar red
property uchar green
property uchar blue
property float z
property float quality
property list uchar int ring
element face 2
property list uchar int vertex_indices
property list uchar float texcoord
property int patch
end_header
0 0 1 2 3 0 nan 2 7 7
1 0 4 5 6 0 inf 0
1 1 7 8 9 0 -1.5 0
0 1 10 11 12 0 2 0
4 0 1 2 3 8 0 0 1 0 1 1 0 1 5
3 0 2 1 0 6
)"));
  ASSERT_EQ(mesh.triangles.size(), 3u);
  EXPECT_EQ(mesh.material_files, (std::vector<std::string>{"bark and leaves.png"}));
  ASSERT_EQ(mesh.attributes.size(), 4u);
  const Attribute &colour = mesh.attributes[0], &quality = mesh.attributes[1], &patch = mesh.attributes[2],
                  &uv = mesh.attributes[3];
  EXPECT_EQ(colour.name, "color");
  EXPECT_EQ(colour.values, (std::vector<double>{1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12}));
  EXPECT_EQ(quality.name, "quality");
  EXPECT_TRUE(std::isnan(quality.values[0]) && std::isinf(quality.values[1]));
  EXPECT_EQ(patch.values, (std::vector<double>{5, 5, 6}));
  EXPECT_EQ(uv.site, Site::corner);
  for (std::size_t t = 0; t < 2; ++t)  // of the quad: the coordinates themselves
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3& p = mesh.vertices[mesh.triangles[t][k]];
      EXPECT_EQ(uv.values[6 * t + 2 * k], p.x);
      EXPECT_EQ(uv.values[6 * t + 2 * k + 1], p.y);
    }
  for (std::size_t i = 12; i < 18; ++i) EXPECT_EQ(uv.values[i], 0);
  write_mesh(path("again.ply"), mesh);
  EXPECT_EQ(read_mesh(path("again.ply")).material_files, mesh.material_files);

  expect_error_line(
      [&] {
        read_mesh(store("bad.ply",
                        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float "
                        "z\nelement face 1\nproperty list uchar int vertex_indices\nproperty list uchar float "
                        "texcoord\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2 4 0 0 1 1\n"));
      },
      path("bad.ply") + ":14", "'texcoord' has 4 numbers for 3 corners");
}

TEST_F(AttributeFiles, NamesThatAFormatCannotHave) {
  TriangleMesh mesh = torus(5, 4);
  const std::size_t n = mesh.vertices.size();
  mesh.attributes = {random_attribute("x", Site::vertex, Type::float64, 1, n),
                     random_attribute("two words", Site::vertex, Type::float64, 1, n),
                     random_attribute("a<b>\"&\"", Site::vertex, Type::float64, 1, n),
                     random_attribute("label", Site::element, Type::int32, 1, mesh.triangles.size())};
  for (const char* name : {"names.ply", "names.vtp"}) {
    write_mesh(path(name), mesh);
    const TriangleMesh read = read_mesh(path(name));
    EXPECT_EQ(read.vertices, mesh.vertices);
    EXPECT_TRUE(read.labels.empty());
    ASSERT_EQ(read.attributes.size(), 4u) << name;
    for (std::size_t k = 0; k < 4; ++k) EXPECT_EQ(read.attributes[k].values, mesh.attributes[k].values) << name;
  }
  mesh.attributes = {{"short", Site::vertex, Type::float64, 1, {1}}};
  EXPECT_THROW(write_mesh(path("short.ply"), mesh), Error);
}

// Vertices with several texture coordinates are several; what they have is at the right places.
TEST_F(AttributeFiles, GltfDividesVerticesAtSeams) {
  TriangleMesh mesh = grid_patch(2, 1);
  mesh.attributes = {random_attribute("color", Site::vertex, Type::uint8, 3, mesh.vertices.size()),
                     {"texcoord", Site::corner, Type::float32, 2}};
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    for (const Index v : mesh.triangles[t])
      mesh.attributes[1].values.insert(mesh.attributes[1].values.end(),
                                       {mesh.vertices[v].x + (t < 2 ? 0 : 10), mesh.vertices[v].y});
  write_mesh(path("seam.glb"), mesh);
  const std::string bytes = slurp("seam.glb");
  const auto length = io::load<std::uint32_t>(bytes.data() + 12, false);
  const auto json = nlohmann::json::parse(bytes.substr(20, length));
  const std::string binary = bytes.substr(28 + length);
  const auto floats = [&](std::size_t accessor, std::size_t i) {
    const auto& view = json["bufferViews"][json["accessors"][accessor]["bufferView"].get<std::size_t>()];
    return io::load<float>(binary.data() + view["byteOffset"].get<std::size_t>() + 4 * i, false);
  };
  const auto& primitive = json["meshes"][0]["primitives"][0];
  const std::size_t position = primitive["attributes"]["POSITION"], uv = primitive["attributes"]["TEXCOORD_0"],
                    colour = primitive["attributes"]["COLOR_0"], indices = primitive["indices"];
  EXPECT_EQ(json["accessors"][position]["count"], 8);  // two of six vertices are on the seam
  EXPECT_EQ(json["accessors"][uv]["count"], 8);
  EXPECT_EQ(json["accessors"][colour]["count"], 8);
  const auto& view = json["bufferViews"][json["accessors"][indices]["bufferView"].get<std::size_t>()];
  for (std::size_t c = 0; c < 12; ++c) {
    const auto i = io::load<std::uint32_t>(binary.data() + view["byteOffset"].get<std::size_t>() + 4 * c, false);
    const Vec3& p = mesh.vertices[mesh.triangles[c / 3][c % 3]];
    EXPECT_EQ(floats(position, 3 * i), p.x);
    EXPECT_EQ(floats(uv, 2 * i), mesh.attributes[1].values[2 * c]);
    EXPECT_EQ(floats(uv, 2 * i + 1), 1 - mesh.attributes[1].values[2 * c + 1]);
    EXPECT_EQ(floats(colour, 4 * i + 3), 1);
  }
}

}  // namespace
}  // namespace bisector::test
