#include "tetgen_pq.h"

#define TETLIBRARY
#include <tetgen.h>

#include <cmath>
#include <cstdio>
#include <string>

namespace bisector::bench {

TetMesh tetgen_pq(const TriangleMesh& surface, double edge) {
  tetgenio in, out;
  in.numberofpoints = static_cast<int>(surface.vertices.size());
  in.pointlist = new REAL[3 * surface.vertices.size()];
  for (std::size_t v = 0; v < surface.vertices.size(); ++v)
    for (int k = 0; k < 3; ++k) in.pointlist[3 * v + static_cast<std::size_t>(k)] = surface.vertices[v][k];
  in.numberoffacets = static_cast<int>(surface.triangles.size());
  in.facetlist = new tetgenio::facet[surface.triangles.size()];
  for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
    tetgenio::facet& facet = in.facetlist[t];
    tetgenio::init(&facet);
    facet.numberofpolygons = 1;
    facet.polygonlist = new tetgenio::polygon[1];
    tetgenio::init(facet.polygonlist);
    facet.polygonlist[0].numberofvertices = 3;
    facet.polygonlist[0].vertexlist = new int[3];
    for (std::size_t k = 0; k < 3; ++k) facet.polygonlist[0].vertexlist[k] = static_cast<int>(surface.triangles[t][k]);
  }
  char volume[32];
  std::snprintf(volume, sizeof volume, "%.17f", edge * edge * edge / (6 * std::sqrt(2.0)));
  std::string switches = std::string("pqa") + volume + "Q";
  tetrahedralize(switches.data(), &in, &out);
  TetMesh mesh;
  for (int v = 0; v < out.numberofpoints; ++v)
    mesh.vertices.push_back({out.pointlist[3 * v], out.pointlist[3 * v + 1], out.pointlist[3 * v + 2]});
  for (int t = 0; t < out.numberoftetrahedra; ++t) {
    const int* v = out.tetrahedronlist + 4 * t;
    mesh.tets.push_back(
        {static_cast<Index>(v[0]), static_cast<Index>(v[1]), static_cast<Index>(v[2]), static_cast<Index>(v[3])});
  }
  return mesh;
}

}  // namespace bisector::bench
