// Candidate neighbours of every seed, from either source, each list with its own certificate of what it leaves out.
#pragma once

#include <atomic>
#include <memory>
#include <vector>

#include "bisector/cells.h"
#include "core/geometry.h"
#include "spatial/seed_tree.h"

namespace bisector {

// The distinct seeds in a spatial order. Internal indices ("slots") index `x`; `id` maps them to the caller's indices,
// which alone decide ties. A seed equal to one of lower index owns nothing and has no slot.
struct SortedSeeds {
  std::vector<Vec3> x;
  std::vector<Index> id;
  std::vector<Index> slot;  // of each caller index, or kNone
  double extent = 0;        // diagonal of the bounding box
};

SortedSeeds sort_seeds(const std::vector<Vec3>& seeds);

// A list of neighbours (slots) in ascending distance. Every seed that is not listed and could bound the cell lies at
// `radius` or more from the seed; infinite if there is none. `level` counts how often the list was grown.
struct NeighbourList {
  const Index* begin = nullptr;
  const Index* end = nullptr;
  double radius = 0;
  int level = 0;
};

// How long first lists are: at most `most`, from searches whose radius aims at `mean`. A planar cell has six neighbours
// and is certified by about 16 nearest seeds; a cell in space has 15 and needs about 42.
struct ListLength {
  static constexpr std::size_t kMost = 96;
  std::size_t most = 40;
  double mean = 28;
  double power = 0.5;  // the inverse of the seeds' dimension, about: of the radius in terms of their number
  double longest = 5;  // diagonal of the box of seeds that share a search, in radii
};
inline constexpr ListLength kListsInSpace{88, 72, 1.0 / 3, 3};

class Neighbours {
 public:
  explicit Neighbours(ListLength length = {});
  ~Neighbours();

  // Builds the lists of all slots. `seeds` must outlive their use.
  void build(const SortedSeeds& seeds, NeighbourSource source);
  // No lists at first: each is grown on demand, from about `radius` on.
  void build_on_demand(const SortedSeeds& seeds, double radius);
  // For the same slots at new positions: sorts the lists of the last build anew and shortens them and their
  // certificates by how far they and seeds around them have moved since. False if that is not worth it and build() has
  // to be called.
  bool update();

  NeighbourList list(Index slot) const;
  // A list that reaches farther than `shorter` did. Safe to call from many threads; depends on the seeds alone.
  NeighbourList wider(Index slot, const NeighbourList& shorter) const;
  // A slot whose distance to q is the least up to rounding.
  Index nearest(const Vec3& q) const { return tree_.nearest(q); }
  // Writes the `count` (at least 1) slots nearest to `slot`, or all others if there are fewer, in ascending distance;
  // ties go to the lower index of the caller. Returns how many. Depends on the seeds alone.
  std::size_t nearest_to(Index slot, std::size_t count, Index* slots) const;
  // All slots within `radius` of q, and some of the others.
  std::vector<Index> around(const Vec3& q, double radius) const;

 private:
  struct Candidate;
  struct Grown;
  struct LastRung;
  struct Search;
  bool list_run(std::size_t begin, std::size_t end, const Box& box, Search& search);
  const LastRung& last_rung() const;
  std::unique_ptr<Grown> grow(Index slot, int level, double radius) const;
  double distance_in_order(Index slot, std::size_t count) const;
  void drop_grown();
  void start(const SortedSeeds& seeds);

  const SortedSeeds* seeds_ = nullptr;
  SeedTree tree_;
  ListLength length_;
  std::vector<Index> first_;          // room for length_.most per slot
  std::vector<unsigned char> count_;  // of the lists of first_
  std::vector<double> radius_;
  SeedTree built_tree_;
  std::vector<Vec3> built_x_;  // positions and radii of the last build
  std::vector<double> built_radius_;
  std::vector<unsigned char> built_count_;
  bool use_rings_ = false;  // the first lists are Delaunay rings
  bool on_demand_ = false;  // there are no first lists, and they grow from first_radius_ on
  double first_radius_ = 0;
  std::unique_ptr<LastRung> last_rung_;
  std::unique_ptr<std::atomic<Grown*>[]> heads_;  // grown lists of each slot, the longest first
  std::size_t head_count_ = 0;
};

}  // namespace bisector
