#include "c/mesh_arrays.h"

#include <fmt/format.h>

#include <array>
#include <limits>
#include <string>
#include <utility>

#include "bisector/error.h"
#include "c/handles.h"
#include "io/tet_formats.h"

namespace bisector::c {
namespace {

constexpr const char* kName = "mesh";  // in messages, where files have theirs

void require(const void* array, std::size_t count, const char* what) {
  if (!array && count > 0) throw Misuse(fmt::format("{}: the array is a null pointer, and the count is not 0", what));
}

Index index_of(const char* kind, std::size_t element, std::int64_t index, std::size_t vertices) {
  if (index < 0 || std::cmp_greater_equal(index, vertices))
    throw Error(fmt::format("{}: {} {}: index {} is out of range, the mesh has {} vertices; mend it", kName, kind,
                            element, index, vertices));
  return static_cast<Index>(index);
}

template <std::size_t N>
std::vector<std::array<Index, N>> rows_of(const char* kind, const std::int64_t* rows, std::size_t count,
                                          std::size_t vertices) {
  require(rows, count, kind);
  std::vector<std::array<Index, N>> result(count);
  for (std::size_t i = 0; i < count; ++i)
    for (std::size_t k = 0; k < N; ++k) result[i][k] = index_of(kind, i, rows[N * i + k], vertices);
  return result;
}

std::vector<std::int32_t> marks_of(const char* what, const std::int64_t* marks, std::size_t count, std::size_t elements,
                                   const char* kind) {
  require(marks, count, what);
  if (count > 0 && count != elements)
    throw Error(fmt::format("{}: {} {} for {} {}; give one each", kName, count, what, elements, kind));
  std::vector<std::int32_t> result(count);
  for (std::size_t i = 0; i < count; ++i) {
    if (!std::in_range<std::int32_t>(marks[i]))
      throw Error(fmt::format("{}: {} {}: {} does not fit 32 bits; number them anew", kName, what, i, marks[i]));
    result[i] = static_cast<std::int32_t>(marks[i]);
  }
  return result;
}

Csr<Index> faces_of(const bisector_mesh_arrays& arrays) {
  Csr<Index> faces;
  const std::int64_t* offsets = arrays.face_offsets;
  if (offsets && offsets[0] != 0) throw Misuse("face_offsets: the first one is not 0");
  for (std::size_t i = 0; i < arrays.face_count; ++i) {
    const auto begin = offsets ? offsets[i] : static_cast<std::int64_t>(3 * i);
    const auto end = offsets ? offsets[i + 1] : begin + 3;
    if (end < begin) throw Misuse("face_offsets: they descend");
    if (end - begin < 3) throw Error(fmt::format("{}: face {}: it has fewer than three corners; remove it", kName, i));
    for (auto k = begin; k < end; ++k)
      faces.values.push_back(index_of("face", i, arrays.faces[k], arrays.vertex_count));
    faces.offsets.push_back(faces.values.size());
  }
  return faces;
}

std::vector<Triangle> triangles_of(const Csr<Index>& faces) {
  std::vector<Triangle> triangles;
  for (std::size_t i = 0; i < faces.rows(); ++i) {
    if (faces.size(i) != 3)
      throw Error(fmt::format("{}: face {}: beside tetrahedra faces are triangles; divide it", kName, i));
    triangles.push_back({faces.begin(i)[0], faces.begin(i)[1], faces.begin(i)[2]});
  }
  return triangles;
}

std::vector<Attribute> attributes_of(const bisector_mesh_arrays& arrays, const Csr<Index>& faces) {
  require(arrays.attributes, arrays.attribute_count, "attributes");
  std::vector<Attribute> attributes;
  for (std::size_t i = 0; i < arrays.attribute_count; ++i) {
    const bisector_attribute& given = arrays.attributes[i];
    if (!given.name || !*given.name) throw Misuse(fmt::format("attribute {} has no name", i));
    require(given.values, given.count, given.name);
    const bool solid = arrays.tet_count > 0;
    std::size_t sites = 0;
    switch (given.site) {
      case BISECTOR_VERTEX: sites = arrays.vertex_count; break;
      case BISECTOR_ELEMENT: sites = solid ? arrays.tet_count : faces.rows(); break;
      case BISECTOR_CORNER: sites = solid ? 0 : faces.values.size(); break;
      default: throw Misuse(fmt::format("attribute '{}': {} is no bisector_site", given.name, given.site));
    }
    if (given.number < BISECTOR_NUMBER_INT8 || given.number > BISECTOR_NUMBER_FLOAT64)
      throw Misuse(fmt::format("attribute '{}': {} is no bisector_number", given.name, given.number));
    if (given.components == 0 || given.count != given.components * sites)
      throw Error(fmt::format("{}: attribute '{}' has {} values, where {} places have {} each; give as many", kName,
                              given.name, given.count, sites, given.components));
    attributes.push_back({given.name,
                          static_cast<Attribute::Site>(given.site),
                          static_cast<Attribute::Type>(given.number),
                          given.components,
                          {given.values, given.values + given.count}});
  }
  return attributes;
}

}  // namespace

std::vector<Vec3> points_of(const char* what, const double* points, std::size_t count) {
  require(points, count, what);
  if (count >= kNone) throw Error(fmt::format("{}: {} points are too many; split them", what, count));
  std::vector<Vec3> result(count);
  for (std::size_t i = 0; i < count; ++i) {
    result[i] = {points[3 * i], points[3 * i + 1], points[3 * i + 2]};
    for (int k = 0; k < 3; ++k)
      if (const char* flaw = io::coordinate_flaw(result[i][k]))
        throw Error(fmt::format("{}: vertex {}: {}", what, i, flaw));
  }
  return result;
}

std::vector<Tetrahedron> tets_of(const char* what, const std::int64_t* tets, std::size_t count, std::size_t vertices) {
  return rows_of<4>(what, tets, count, vertices);
}

std::vector<Index> indices_of(const char* what, const std::int64_t* indices, std::size_t count) {
  require(indices, count, what);
  std::vector<Index> result;
  for (std::size_t i = 0; i < count; ++i) {
    if (indices[i] < 0 || indices[i] >= kNone)
      throw Error(fmt::format("{}: {} is no index; mend or remove it", what, indices[i]));
    result.push_back(static_cast<Index>(indices[i]));
  }
  return result;
}

std::shared_ptr<const job::GivenMesh> mesh_of(const bisector_mesh_arrays& arrays) {
  require(arrays.faces, arrays.face_count, "faces");
  const std::size_t n = arrays.vertex_count;
  auto mesh = std::make_shared<job::GivenMesh>();
  Context context;
  context.warning = [&](const std::string& line) { mesh->warnings.push_back(line); };
  std::vector<Vec3> vertices = points_of(kName, arrays.vertices, n);
  Csr<Index> faces = faces_of(arrays);
  auto labels = marks_of("labels", arrays.labels, arrays.label_count, faces.rows(), "faces");
  auto edges = rows_of<2>("feature edge", arrays.feature_edges, arrays.edge_count, n);
  auto regions = marks_of("regions", arrays.regions, arrays.region_count, arrays.tet_count, "tetrahedra");
  auto attributes = attributes_of(arrays, faces);
  if (arrays.tet_count > 0) {
    io::TetSoup soup{std::move(vertices), rows_of<4>("tetrahedron", arrays.tets, arrays.tet_count, n),
                     triangles_of(faces), std::move(edges),
                     std::move(regions),  std::move(labels)};
    soup.attributes = std::move(attributes);
    mesh->tets = io::mesh_of(kName, std::move(soup), context);
  } else if (faces.rows() > 0) {
    io::Soup soup{std::move(vertices), std::move(faces), std::move(labels), std::move(edges), ""};
    soup.attributes = std::move(attributes);
    mesh->surface = io::mesh_of(kName, std::move(soup), context);
  } else {
    mesh->points = std::move(vertices);
  }
  return mesh;
}

}  // namespace bisector::c
