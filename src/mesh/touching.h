// Parts of a surface that touch in points or along edges, made manifold by giving each its own vertices there.
#pragma once

#include <array>
#include <vector>

#include "bisector/mesh.h"

namespace bisector {

// An edge of four or more triangles is one where solids touch if no part that hangs together with it has a border or
// neighbours that run in the same direction, and if as many of its triangles run along it one way as the other. Each
// triangle then goes with the next across the solid (Gueziec, Taubin, Lazarus and Horn 2001, "Cutting and stitching",
// IEEE TVCG 7(2), pair them in this way). Other edges of more than two triangles are where sheets meet, and stay. Where
// a surface goes through itself and was cut there, parts with borders have such edges, too.
enum class Touching { solids, sheets };

// Halves the edges where solids touch that would still be one edge after separate_touching, because the surface around
// both ends hangs together. Labels, face_of_triangle and feature edges follow. Returns the ends of the edge that each
// new vertex is in the middle of; these come after the old ones.
std::vector<std::array<Index, 2>> halve_touching_edges(TriangleMesh& mesh, Touching touching = Touching::solids);

// Gives each but the first of the fans of triangles around a vertex that share no edge there, or only edges where
// solids touch, a copy of the vertex. Feature edges are renamed with their triangles. Returns the vertex that each was,
// old ones being what they were.
std::vector<Index> separate_touching(TriangleMesh& mesh, Touching touching = Touching::solids);

// Whether a surface is that of several solids, some of which have faces in common: once each has vertices of its own,
// by the two above, it is closed and manifold, triangles that are there twice are on two components each, and each
// component has others, too. A sheet that is to be seen from both sides is there twice on one component, a solid that
// is written twice has no triangle that its copy has not.
bool has_solids_with_common_faces(TriangleMesh mesh);

// Edges that were named before halve_touching_edges, which returned `halved` and left `count` vertices.
std::vector<std::array<Index, 2>> edges_after_halving(const std::vector<std::array<Index, 2>>& edges,
                                                      const std::vector<std::array<Index, 2>>& halved,
                                                      std::size_t count);
// The edges of a mesh whose ends were these, `original` being what separate_touching gave, and those that are no edges
// of it.
std::vector<std::array<Index, 2>> edges_after_separating(const TriangleMesh& mesh, const std::vector<Index>& original,
                                                         const std::vector<std::array<Index, 2>>& edges);

}  // namespace bisector
