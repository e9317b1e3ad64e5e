// Plain data shared by every module: vectors, meshes, sparse rows.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

namespace bisector {

using Index = std::uint32_t;
inline constexpr Index kNone = 0xffffffffu;

// Three doubles with a fixed order of operations, so that sums and products round alike on every backend.
struct Vec3 {
  double x = 0, y = 0, z = 0;

  double operator[](int k) const { return k == 0 ? x : k == 1 ? y : z; }
  double& operator[](int k) { return k == 0 ? x : k == 1 ? y : z; }
  Vec3& operator+=(const Vec3& b) { x += b.x; y += b.y; z += b.z; return *this; }
  Vec3& operator-=(const Vec3& b) { x -= b.x; y -= b.y; z -= b.z; return *this; }
  Vec3& operator*=(double s) { x *= s; y *= s; z *= s; return *this; }
  friend Vec3 operator+(Vec3 a, const Vec3& b) { return a += b; }
  friend Vec3 operator-(Vec3 a, const Vec3& b) { return a -= b; }
  friend Vec3 operator-(const Vec3& a) { return {-a.x, -a.y, -a.z}; }
  friend Vec3 operator*(double s, Vec3 a) { return a *= s; }
  friend bool operator==(const Vec3& a, const Vec3& b) { return a.x == b.x && a.y == b.y && a.z == b.z; }
};

inline double dot(const Vec3& a, const Vec3& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline Vec3 cross(const Vec3& a, const Vec3& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline double norm2(const Vec3& a) { return dot(a, a); }
inline double norm(const Vec3& a) { return std::sqrt(norm2(a)); }

using Triangle = std::array<Index, 3>;

// Triangles over shared vertices. Any soup is valid: open, non-manifold, with zero-area triangles.
struct TriangleMesh {
  std::vector<Vec3> vertices;
  std::vector<Triangle> triangles;
  // Input face of each triangle where faces with more than three corners were split; empty: the same index.
  std::vector<Index> face_of_triangle = {};
  std::vector<std::int32_t> labels = {};  // of each triangle, e.g. its CAD patch; or empty
  // Edges marked as features, by a file or a caller.
  std::vector<std::array<Index, 2>> feature_edges = {};
};

using Tetrahedron = std::array<Index, 4>;

// Tetrahedra over shared vertices. Facet k of a tetrahedron is the one opposite its corner k.
struct TetMesh {
  std::vector<Vec3> vertices;
  std::vector<Tetrahedron> tets;  // det(b - a, c - a, d - a) > 0 unless said otherwise
  std::vector<std::int32_t> regions = {};  // of each tetrahedron, e.g. its material; or empty
  std::vector<Triangle> boundary = {};     // marked triangles, on the boundary counter-clockwise seen from outside; or empty
  std::vector<std::int32_t> boundary_labels = {};       // of each marked triangle, or empty
  std::vector<std::array<Index, 2>> feature_edges = {}; // edges marked as features
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

struct Box {
  Vec3 lo, hi;
  double diagonal() const { return norm(hi - lo); }
};

// Bounding box of points; the zero box if there are none.
inline Box bounding_box(const std::vector<Vec3>& points) {
  if (points.empty()) return {};
  Box box{points[0], points[0]};
  for (const Vec3& p : points)
    for (int k = 0; k < 3; ++k) {
      if (p[k] < box.lo[k]) box.lo[k] = p[k];
      if (p[k] > box.hi[k]) box.hi[k] = p[k];
    }
  return box;
}

}  // namespace bisector
