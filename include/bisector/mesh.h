// Points, triangle meshes, tetrahedral meshes and sparse rows: plain data without arithmetic, so that results never
// depend on how the including program is compiled.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace bisector {

using Index = std::uint32_t;
inline constexpr Index kNone = 0xffffffffu;

// A point or a vector.
struct Vec3 {
  double x = 0, y = 0, z = 0;

  double operator[](int k) const { return k == 0 ? x : k == 1 ? y : z; }
  double& operator[](int k) { return k == 0 ? x : k == 1 ? y : z; }
  friend bool operator==(const Vec3& a, const Vec3& b) { return a.x == b.x && a.y == b.y && a.z == b.z; }
};

using Triangle = std::array<Index, 3>;

// What labels are called, where a file or a caller names them: "inlet", "steel". A label may lack a name.
using LabelNames = std::map<std::int32_t, std::string>;

// Numbers of each vertex, triangle or corner of a mesh, under a name: a temperature, a colour, texture coordinates.
struct Attribute {
  // Elements are the triangles of a TriangleMesh and the tetrahedra of a TetMesh; a corner is one of three of each
  // triangle.
  enum class Site { vertex, element, corner };
  // Of the numbers in files. Integers beyond 2^53 lose digits.
  enum class Type { int8, uint8, int16, uint16, int32, uint32, int64, uint64, float32, float64 };

  std::string name;
  Site site = Site::vertex;
  Type type = Type::float64;
  std::size_t components = 1;
  std::vector<double> values = {};  // `components` of the first vertex, element or corner, those of the next one, ...
};

// Triangles over shared vertices. Any soup is valid: open, non-manifold, with zero-area triangles.
struct TriangleMesh {
  std::vector<Vec3> vertices;
  std::vector<Triangle> triangles;
  // Input face of each triangle where faces with more than three corners were split; empty: the same index.
  std::vector<Index> face_of_triangle = {};
  std::vector<std::int32_t> labels = {};  // of each triangle, e.g. its CAD patch; or empty
  // Edges marked as features, by a file or a caller.
  std::vector<std::array<Index, 2>> feature_edges = {};
  LabelNames label_names = {};
  double unit = 0;  // of the coordinates, in metres; 0: not known
  // What a caller or a file brings; results have those that carry_attributes (attributes.h) gives them.
  std::vector<Attribute> attributes = {};
  // What materials or textures are in, as files name them: `mtllib` of OBJ, `TextureFile` of PLY.
  std::vector<std::string> material_files = {};
  // OBJ: the materials of the labels in these files; without labels that of 0 is that of all triangles.
  LabelNames label_materials = {};
};

using Tetrahedron = std::array<Index, 4>;

// Tetrahedra over shared vertices. Facet k of a tetrahedron is the one opposite its corner k.
struct TetMesh {
  std::vector<Vec3> vertices;
  std::vector<Tetrahedron> tets;           // det(b - a, c - a, d - a) > 0 unless said otherwise
  std::vector<std::int32_t> regions = {};  // of each tetrahedron, e.g. its material; or empty
  std::vector<Triangle> boundary =
      {};  // marked triangles, on the boundary counter-clockwise seen from outside; or empty
  std::vector<std::int32_t> boundary_labels = {};        // of each marked triangle, or empty
  std::vector<std::array<Index, 2>> feature_edges = {};  // edges marked as features
  LabelNames region_names = {}, label_names = {};
  std::vector<Attribute> attributes = {};  // of vertices and tetrahedra
};

// Compressed sparse rows: row i is values[offsets[i] .. offsets[i + 1]).
template <class T>
struct Csr {
  std::vector<std::size_t> offsets{0};
  std::vector<T> values;

  std::size_t rows() const { return offsets.size() - 1; }
  const T* begin(std::size_t i) const { return values.data() + offsets[i]; }
  const T* end(std::size_t i) const { return values.data() + offsets[i + 1]; }
  std::size_t size(std::size_t i) const { return offsets[i + 1] - offsets[i]; }
};

}  // namespace bisector
