#include "features/placed_seeds.h"

#include <string>
#include <utility>

#include "bisector/error.h"

namespace bisector {

PlacedSeeds::PlacedSeeds(std::vector<Vec3> positions, const SeedPlace& place)
    : positions_(std::move(positions)), places_(positions_.size(), place) {}

PlacedSeeds::PlacedSeeds(std::vector<Vec3> positions, std::vector<SeedPlace> places)
    : positions_(std::move(positions)), places_(std::move(places)) {
  if (places_.empty()) places_.resize(positions_.size());
  if (places_.size() != positions_.size())
    throw Error("there are " + std::to_string(places_.size()) + " places for " + std::to_string(positions_.size()) +
                " seeds; give one for each");
}

void PlacedSeeds::put(std::size_t i, const Vec3& position, const SeedPlace& place) {
  positions_[i] = position;
  places_[i] = place;
}

void PlacedSeeds::add(const Vec3& position, const SeedPlace& place) {
  positions_.push_back(position);
  places_.push_back(place);
}

void PlacedSeeds::add(const std::vector<Vec3>& positions, const SeedPlace& place) {
  positions_.insert(positions_.end(), positions.begin(), positions.end());
  places_.resize(positions_.size(), place);
}

void PlacedSeeds::add(const PlacedSeeds& seeds) {
  positions_.insert(positions_.end(), seeds.positions_.begin(), seeds.positions_.end());
  places_.insert(places_.end(), seeds.places_.begin(), seeds.places_.end());
}

void PlacedSeeds::remove(const std::vector<char>& marks) {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < positions_.size(); ++i) {
    if (marks[i]) continue;
    positions_[kept] = positions_[i];
    places_[kept++] = places_[i];
  }
  positions_.resize(kept);
  places_.resize(kept);
}

void PlacedSeeds::remove(const std::vector<Index>& seeds) {
  std::vector<char> marks(positions_.size(), 0);
  for (const Index i : seeds) marks[i] = 1;
  remove(marks);
}

}  // namespace bisector
