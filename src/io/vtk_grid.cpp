#include "io/vtk_grid.h"

#include <algorithm>
#include <utility>

#include "mesh/attribute_sizes.h"

namespace bisector::io {

namespace {

// Arrays that mark cells, the first that is there counts.
constexpr const char* kRegionNames[] = {"region",           "label",         "medit:ref", "gmsh:physical",
                                        "gmsh:geometrical", "CellEntityIds", "material"};
constexpr const char* kLabelNames[] = {"label", "medit:ref", "gmsh:physical", "gmsh:geometrical", "CellEntityIds"};

std::vector<std::int32_t> marks_of(const std::string& path, const std::string& name, const std::vector<double>& values,
                                   const std::vector<std::size_t>& cells) {
  std::vector<std::int32_t> marks;
  for (const std::size_t i : cells) {
    const double x = values[i];
    if (!(x >= -0x1p31 && x < 0x1p31 && x == std::floor(x)))
      fail(path, fmt::format("cell {}: {} in '{}' is not an integer of 32 bits; mend it", i, x, name));
    marks.push_back(static_cast<std::int32_t>(x));
  }
  return marks;
}

const Attribute* find_scalar(const VtkArrays& arrays, const std::string& name) {
  for (const Attribute& array : arrays)
    if (array.name == name && array.components == 1) return &array;
  return nullptr;
}

template <std::size_t N>
const Attribute* first_of(const VtkArrays& arrays, const char* const (&names)[N]) {
  for (const char* name : names)
    if (const Attribute* found = find_scalar(arrays, name)) return found;
  return nullptr;
}

template <std::size_t N>
std::vector<std::int32_t> find_marks(const std::string& path, const VtkArrays& cell_data, const char* const (&names)[N],
                                     const std::vector<std::size_t>& cells) {
  const Attribute* found = cells.empty() ? nullptr : first_of(cell_data, names);
  return found ? marks_of(path, found->name, found->values, cells) : std::vector<std::int32_t>{};
}

}  // namespace

std::vector<Index> corners_of(const std::string& path, const VtkCells& cells, std::size_t i, std::size_t points,
                              std::size_t first) {
  const std::int64_t begin = cells.offsets[i], end = cells.offsets[i + 1];
  if (begin < 0 || end < begin || end > static_cast<std::int64_t>(cells.connectivity.size()))
    fail(path, fmt::format("cell {}: its offsets {} and {} are out of range; {}", first + i, begin, end, kExportAgain));
  std::vector<Index> corners;
  corners.reserve(static_cast<std::size_t>(end - begin));
  for (std::int64_t at = begin; at < end; ++at) {
    const std::int64_t v = cells.connectivity[static_cast<std::size_t>(at)];
    if (v < 0 || v >= static_cast<std::int64_t>(points)) fail_index(path, "cell", first + i, v, points);
    corners.push_back(static_cast<Index>(v));
  }
  return corners;
}

std::vector<std::int32_t> labels_of_cells(const std::string& path, const VtkArrays& cell_data,
                                          const std::vector<std::size_t>& cells) {
  return find_marks(path, cell_data, kLabelNames, cells);
}

void put_array(VtkArrays& arrays, Attribute array) {
  const auto same =
      std::find_if(arrays.begin(), arrays.end(), [&](const Attribute& a) { return a.name == array.name; });
  if (same == arrays.end()) arrays.push_back(std::move(array));
  else *same = std::move(array);
}

std::vector<Attribute> attributes_of_points(VtkArrays point_data) {
  for (Attribute& array : point_data) array.site = Attribute::Site::vertex;
  return point_data;
}

std::vector<Attribute> attributes_of_cells(const VtkArrays& cell_data, const std::vector<std::size_t>& cells,
                                           bool solid) {
  std::vector<Attribute> attributes;
  const Attribute *label = first_of(cell_data, kLabelNames),
                  *region = solid ? first_of(cell_data, kRegionNames) : label;
  for (const Attribute& array : cell_data) {
    // Where there are labels and regions, each has zeros where the other one counts.
    if (&array == label || &array == region || array.name == "region" || array.name == "label") continue;
    attributes.push_back(picked(array, cells));
    attributes.back().site = Attribute::Site::element;
  }
  return attributes;
}

TetSoup soup_of_grid(const std::string& path, VtkGrid grid) {
  const std::size_t n = grid.types.size();
  if (grid.cells.offsets.size() != n + 1)
    fail(path, fmt::format("there are {} cells, but {} types; {}", grid.cells.size(), n, kExportAgain));
  TetSoup soup;
  std::vector<std::size_t> tets, triangles;
  for (std::size_t i = 0; i < n; ++i) {
    const std::int64_t type = grid.types[i];
    if (type == kVertex || type == kPolyVertex) continue;
    const std::vector<Index> v = corners_of(path, grid.cells, i, grid.points.size());
    const auto need = [&](std::size_t corners) {
      if (v.size() != corners)
        fail(path, fmt::format("cell {}: it has {} vertices where its type {} has {}; {}", i, v.size(), type, corners,
                               kExportAgain));
    };
    switch (type) {
      case kQuadraticTetrahedron:
      case kTetrahedron:
        need(type == kTetrahedron ? 4 : 10);
        soup.tets.push_back({v[0], v[1], v[2], v[3]});
        tets.push_back(i);
        break;
      case kQuadraticTriangle:
      case kTriangle:
        need(type == kTriangle ? 3 : 6);
        soup.triangles.push_back({v[0], v[1], v[2]});
        triangles.push_back(i);
        break;
      case kQuadraticEdge:
        need(3);
        soup.edges.push_back({v[0], v[1]});
        break;
      case kLine:
      case kPolyLine:
        for (std::size_t k = 0; k + 1 < v.size(); ++k) soup.edges.push_back({v[k], v[k + 1]});
        break;
      default: fail(path, fmt::format("cell {}: its type is {}; {}", i, type, kUpToSecondOrder));
    }
    soup.curved += type >= kQuadraticEdge;
  }
  for (const Attribute& array : grid.cell_data)
    if (array.values.size() != array.components * n)
      fail(path, fmt::format("the cell data '{}' has {} values for {} cells; {}", printable(array.name),
                             array.values.size(), n, kExportAgain));
  soup.regions = find_marks(path, grid.cell_data, kRegionNames, tets);
  soup.labels = labels_of_cells(path, grid.cell_data, triangles);
  soup.vertices = std::move(grid.points);
  soup.attributes = attributes_of_points(std::move(grid.point_data));
  for (Attribute& attribute : attributes_of_cells(grid.cell_data, tets, true))
    soup.attributes.push_back(std::move(attribute));
  soup.triangle_attributes = attributes_of_cells(grid.cell_data, triangles, true);
  return soup;
}

std::vector<double> point_data_of(const std::string& path, VtkArrays point_data, std::size_t points,
                                  const std::string& name) {
  const Attribute* found = find_scalar(point_data, name);
  if (!found) {
    std::string known;
    for (const Attribute& array : point_data)
      if (array.components == 1) known += (known.empty() ? "" : ", ") + printable(array.name);
    fail(path, fmt::format("there is no scalar point data '{}'; {}", printable(name),
                           known.empty() ? "the file has none" : "use one of " + known));
  }
  if (found->values.size() != points)
    fail(path, fmt::format("the point data '{}' has {} values for {} points; {}", printable(name), found->values.size(),
                           points, kExportAgain));
  for (std::size_t i = 0; i < points; ++i)
    if (!std::isfinite(found->values[i]))
      fail(path, fmt::format("vertex {}: '{}' is not finite; mend the value", i, printable(name)));
  return found->values;
}

std::vector<std::int64_t> integers(const std::vector<double>& values) {
  std::vector<std::int64_t> result;
  result.reserve(values.size());
  for (const double x : values) result.push_back(std::abs(x) < 0x1p53 ? static_cast<std::int64_t>(x) : -1);
  return result;
}

}  // namespace bisector::io
