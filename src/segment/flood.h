// Partitions of the triangles among proxies.
#pragma once

#include <cstddef>
#include <functional>
#include <vector>

#include "core/geometry.h"
#include "segment/proxy.h"
#include "segment/segment_domain.h"

namespace bisector {

struct FloodSeed {
  Index triangle, region;
};

// Distortion-minimising flooding (thesis 2.3.1; Cohen-Steiner, Alliez and Desbrun 2004): regions grow from one seed
// triangle each, always by the triangle of least distance to the proxy that reaches it. Its arrays are as large as the
// mesh and kept from one flooding to the next, so that one in a small part costs as much as that part has triangles.
class Flooding {
 public:
  explicit Flooding(const SegmentDomain& domain) : domain_(domain), offered_(domain.triangles.size(), kNone) {}

  // Fills the triangles labelled kNone that can be reached; others are left alone. `distances` gets each filled
  // triangle's distance_to its proxy. Adds the distances it takes to `evaluations`.
  void fill(const std::vector<Proxy>& proxies, const std::vector<FloodSeed>& seeds, std::vector<Index>& labels,
            std::vector<double>& distances, std::size_t& evaluations);

 private:
  struct Offer {
    double distance;
    Index triangle, region;
  };
  // The least distance first; ties by triangle, then region.
  static bool later(const Offer& a, const Offer& b) {
    if (a.distance != b.distance) return a.distance > b.distance;
    return a.triangle != b.triangle ? a.triangle > b.triangle : a.region > b.region;
  }

  const SegmentDomain& domain_;
  std::vector<Index> offered_;  // to each triangle, the region that reached it last; kNone between floodings
  std::vector<Index> filled_;
  std::vector<Offer> queue_;
};

// Single triangles that change sides at borders.
class BorderMoves {
 public:
  explicit BorderMoves(const SegmentDomain& domain) : domain_(domain), seen_(domain.triangles.size(), 0) {}

  // Moves triangles to the region across where they are nearer to its proxy and no region comes apart, until there are
  // none; of the given triangles and what is around those that move. Calls before_move(triangle, region, distance)
  // ahead of each move, the latter two being those it gets. Returns how many it moved.
  std::size_t relax(
      const std::vector<Proxy>& proxies, std::vector<Index> triangles, std::vector<Index>& labels,
      std::vector<double>& distances, std::size_t& evaluations,
      const std::function<void(Index, Index, double)>& before_move = [](Index, Index, double) {});

 private:
  // Whether a region stays connected without one of its triangles; searched for among few triangles around it only, so
  // a region may be said to come apart where it has a long way round.
  bool removable(const std::vector<Index>& labels, Index triangle);

  const SegmentDomain& domain_;
  std::vector<std::uint32_t> seen_;  // the last search that came by
  std::uint32_t search_ = 0;
  std::vector<Index> own_, queue_;
};

}  // namespace bisector
