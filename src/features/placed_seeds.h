// Seeds and where each of them may be. All that adds, removes or moves seeds goes through here, so that positions and
// places stay parallel.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "features/curves.h"

namespace bisector {

class PlacedSeeds {
 public:
  PlacedSeeds() = default;
  // All with the same place.
  explicit PlacedSeeds(std::vector<Vec3> positions, const SeedPlace& place = {});
  // One place for each position, or none at all: then all are on the surface. Throws Error for any other number.
  PlacedSeeds(std::vector<Vec3> positions, std::vector<SeedPlace> places);

  std::size_t size() const { return positions_.size(); }
  bool empty() const { return positions_.empty(); }
  const std::vector<Vec3>& positions() const { return positions_; }
  const std::vector<SeedPlace>& places() const { return places_; }
  const Vec3& position(std::size_t i) const { return positions_[i]; }
  const SeedPlace& place(std::size_t i) const { return places_[i]; }
  SeedPlace::Kind kind(std::size_t i) const { return places_[i].kind; }
  // Whether the seed may be anywhere on the surface. Only such seeds are removed to change a count.
  bool on_surface(std::size_t i) const { return places_[i].kind == SeedPlace::Kind::surface; }

  // To move seeds by, and to change what they are held on; neither changes their number.
  std::span<Vec3> edit_positions() { return positions_; }
  std::span<SeedPlace> edit_places() { return places_; }
  void put(std::size_t i, const Vec3& position, const SeedPlace& place);

  void add(const Vec3& position, const SeedPlace& place = {});
  void add(const std::vector<Vec3>& positions, const SeedPlace& place = {});
  void add(const PlacedSeeds& seeds);
  // Removes the seeds with a nonzero mark, one for each seed; the others keep their order.
  void remove(const std::vector<char>& marks);
  // Removes the seeds named, which are ascending.
  void remove(const std::vector<Index>& seeds);

 private:
  std::vector<Vec3> positions_;
  std::vector<SeedPlace> places_;  // as many
};

}  // namespace bisector
