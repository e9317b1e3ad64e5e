#include "io/vtk_grid.h"

#include <algorithm>
#include <utility>

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

template <std::size_t N>
std::vector<std::int32_t> find_marks(const std::string& path, const VtkArrays& cell_data, const char* const (&names)[N],
                                     const std::vector<std::size_t>& cells) {
  if (cells.empty()) return {};
  for (const char* name : names)
    if (const auto found = cell_data.find(name); found != cell_data.end())
      return marks_of(path, name, found->second, cells);
  return {};
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

TetSoup soup_of_grid(const std::string& path, VtkGrid grid) {
  const std::size_t n = grid.types.size();
  if (grid.cells.offsets.size() != n + 1)
    fail(path, fmt::format("there are {} cells, but {} types; {}", grid.cells.size(), n, kExportAgain));
  TetSoup soup;
  std::vector<std::size_t> tets, triangles;
  for (std::size_t i = 0; i < n; ++i) {
    const std::int64_t type = grid.types[i];
    const bool read = type == kTetrahedron || type == kTriangle || type == kLine || type == kPolyLine;
    if (!read && type != kVertex && type != kPolyVertex)
      fail(path, fmt::format("cell {}: its type is {}; {}", i, type, kLinearOnly));
    if (!read) continue;
    const std::vector<Index> v = corners_of(path, grid.cells, i, grid.points.size());
    const auto need = [&](std::size_t corners) {
      if (v.size() != corners)
        fail(path, fmt::format("cell {}: it has {} vertices where its type {} has {}; {}", i, v.size(), type, corners,
                               kExportAgain));
    };
    if (type == kTetrahedron) {
      need(4);
      soup.tets.push_back({v[0], v[1], v[2], v[3]});
      tets.push_back(i);
    } else if (type == kTriangle) {
      need(3);
      soup.triangles.push_back({v[0], v[1], v[2]});
      triangles.push_back(i);
    } else {
      for (std::size_t k = 0; k + 1 < v.size(); ++k) soup.edges.push_back({v[k], v[k + 1]});
    }
  }
  for (const auto& [name, values] : grid.cell_data)
    if (values.size() != n)
      fail(path, fmt::format("the cell data '{}' has {} values for {} cells; {}", printable(name), values.size(), n,
                             kExportAgain));
  soup.regions = find_marks(path, grid.cell_data, kRegionNames, tets);
  soup.labels = labels_of_cells(path, grid.cell_data, triangles);
  soup.vertices = std::move(grid.points);
  return soup;
}

std::vector<double> point_data_of(const std::string& path, VtkArrays point_data, std::size_t points,
                                  const std::string& name) {
  const auto found = point_data.find(name);
  if (found == point_data.end()) {
    std::string known;
    for (const auto& [other, values] : point_data) known += (known.empty() ? "" : ", ") + printable(other);
    fail(path, fmt::format("there is no scalar point data '{}'; {}", printable(name),
                           known.empty() ? "the file has none" : "use one of " + known));
  }
  if (found->second.size() != points)
    fail(path, fmt::format("the point data '{}' has {} values for {} points; {}", printable(name), found->second.size(),
                           points, kExportAgain));
  for (std::size_t i = 0; i < found->second.size(); ++i)
    if (!std::isfinite(found->second[i]))
      fail(path, fmt::format("vertex {}: '{}' is not finite; mend the value", i, printable(name)));
  return std::move(found->second);
}

std::vector<std::int64_t> integers(const std::vector<double>& values) {
  std::vector<std::int64_t> result;
  result.reserve(values.size());
  for (const double x : values) result.push_back(std::abs(x) < 0x1p53 ? static_cast<std::int64_t>(x) : -1);
  return result;
}

}  // namespace bisector::io
