// Projection of seeds to the triangles of their cells, which are on several ranks.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "bisector/mesh.h"
#include "core/geometry.h"
#include "distributed/ranks.h"
#include "voronoi/surface.h"

namespace bisector {

// The point of a cell's triangles that is nearest to its seed, and the normal there.
struct Foot {
  Index seed, triangle;
  double squared;  // distance
  Vec3 at, normal;
};

// What triangles of a rank's part the cells have, in the last diagram that was kept and in the one that seeds were
// projected to last.
class KeptCells {
 public:
  // `triangles`: of the cells of the seeds `ids`. `known_by`: on rank 0, the seeds of each rank.
  void keep(std::uint64_t number, std::vector<Index> ids, Csr<Index> triangles,
            std::vector<std::vector<Index>> known_by);
  // Takes part in projecting `seeds`, which only rank 0 knows. Returns there one foot for each seed whose cell has
  // triangles, in ascending order. `surface`: this rank's, or null, with the index of each of its triangles in the
  // whole mesh.
  std::vector<Foot> project(Ranks& ranks, std::uint64_t number, std::span<const Vec3> seeds, const Surface* surface,
                            const std::vector<Index>& triangle);

 private:
  struct Cells {
    std::uint64_t number = 0;
    std::vector<Index> ids;
    Csr<Index> triangles;
    std::vector<std::vector<Index>> known_by;
  };

  std::vector<Cells> kept_;
  std::uint64_t projected_ = 0;  // the number that was projected to last
};

}  // namespace bisector
