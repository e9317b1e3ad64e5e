// What VTK's files of cells hold, whichever form they have (VTK file formats, docs.vtk.org).
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "io/tet_formats.h"

namespace bisector::io {

enum VtkCell {
  kVertex = 1,
  kPolyVertex = 2,
  kLine = 3,
  kPolyLine = 4,
  kTriangle = 5,
  kTetrahedron = 10,
  kQuadraticEdge = 21,
  kQuadraticTriangle = 22,
  kQuadraticTetrahedron = 24,
  kPolyhedron = 42
};

// Arrays of the cells or of the points, in the file's order and with different names; what they are of is not told.
using VtkArrays = std::vector<Attribute>;

// In place of one of that name.
void put_array(VtkArrays& arrays, Attribute array);
// Of all points.
std::vector<Attribute> attributes_of_points(VtkArrays point_data);
// Of those cells, without the arrays that mark tetrahedra, if `solid`, and triangles.
std::vector<Attribute> attributes_of_cells(const VtkArrays& cell_data, const std::vector<std::size_t>& cells,
                                           bool solid);

// Cells, of which i has the corners connectivity[offsets[i] .. offsets[i + 1]).
struct VtkCells {
  std::vector<std::int64_t> offsets, connectivity;

  std::size_t size() const { return offsets.empty() ? 0 : offsets.size() - 1; }
};

struct VtkGrid {
  std::vector<Vec3> points;
  VtkCells cells;
  std::vector<std::int64_t> types;  // of the cells
  VtkArrays cell_data, point_data;
};

// Checks cells and their corners. Throws Error, naming the file and the cell.
TetSoup soup_of_grid(const std::string& path, VtkGrid grid);

// The corners of cell i of those, checked; `first`: what the file calls the first of them.
std::vector<Index> corners_of(const std::string& path, const VtkCells& cells, std::size_t i, std::size_t points,
                              std::size_t first = 0);

// What labels the cells, by the first array of a known name; none if there is none.
std::vector<std::int32_t> labels_of_cells(const std::string& path, const VtkArrays& cell_data,
                                          const std::vector<std::size_t>& cells);

// The array `name` of one number for each point. Throws Error, listing those that are there, if it is not.
std::vector<double> point_data_of(const std::string& path, VtkArrays point_data, std::size_t points,
                                  const std::string& name);

// Numbers that should be integers; -1, which no index is, for those beyond 2^53.
std::vector<std::int64_t> integers(const std::vector<double>& values);

}  // namespace bisector::io
