// The topological ball property of a restricted Voronoi diagram, read off its labels (thesis 4.2.3, 4.4.4; Edelsbrunner
// and Shah, Triangulating topological spaces, 1997).
//
// If every restricted cell is a disk, every restricted Voronoi edge a segment and every triple of cells meets in at
// most one point, the dual is homeomorphic to the surface. Where the surface has a border, cells must meet it in
// nothing or one segment and edges in nothing or one point. All of this is combinatorial: a vertex of the diagram is a
// mesh vertex, a mesh edge with two cells, or a facet with three, and coordinates, areas and coinciding points play no
// part.
#pragma once

#include <vector>

#include "core/geometry.h"
#include "voronoi/restricted.h"

namespace bisector {

// What fails. Polygons and entries are indices into the diagram given.
struct BallReport {
  using Groups = std::vector<std::vector<std::size_t>>;
  struct Cell {
    Index seed;
    long long euler;  // characteristic; 1 for a disk, as are the next two
    std::size_t components;
    std::size_t loops;         // of the cell's boundary
    std::size_t border_parts;  // of the surface's border in the cell
    long long border_euler;    // of those: as many as parts, less where a whole border loop lies in the cell
    Groups parts;              // polygons of each component
    Groups loop_parts;         // entries on each loop
  };
  struct Edge {
    Index a, b;       // a < b
    long long euler;  // components less closed loops
    std::size_t components;
    std::size_t ends;           // 2 for a segment
    std::size_t border_points;  // of the ends, those on the surface's border
    Groups parts;               // entries of each component, in the polygons of a
  };
  struct Vertex {
    Triangle seeds;                   // ascending
    std::vector<std::size_t> places;  // entries, in the polygons of the lowest
  };

  bool holds = false;
  bool manifold = false;  // no mesh edge has more than two triangles; see check_ball_property
  std::size_t cells_checked = 0, edges_checked = 0, vertices_checked = 0;
  long long euler = 0;  // of the surface: the sum over cells, less that over edges, plus the vertices
  // Exactly collinear triangles that the diagram leaves out and whose division is unknown: their edges count as border.
  std::size_t unread = 0;
  std::vector<Cell> cells;  // ascending
  std::vector<Edge> edges;
  std::vector<Vertex> vertices;

  std::size_t failures() const { return cells.size() + edges.size() + vertices.size(); }
};

// Triangles are neighbours where they share both vertex indices of an edge, whatever their orientation. An exactly
// collinear triangle has no polygons, but the cells cross it in the order in which they cross its longest edge: it is
// divided in that way, so that it leaves no crack.
//
// Along a mesh edge of more than two triangles cells are sheets glued together: there, and wherever such a cell or edge
// is involved, disk and segment are replaced by what is left of being contractible, connected and of Euler
// characteristic 1. Cells of seeds that own nothing are not looked at.
BallReport check_ball_property(const Surface& surface, const RestrictedPolygons& polygons);

}  // namespace bisector
