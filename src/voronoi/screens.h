// The screens of the cells that a thread clips to, kept from facet to facet.
#pragma once

#include <vector>

#include "voronoi/neighbours.h"
#include "voronoi/screen.h"

namespace bisector {

// The first neighbours of one cell, four to a block, built as far as they were asked for.
struct CellScreen {
  static constexpr std::size_t kBlocks = 10, kListed = 4 * kBlocks;

  const Index* list = nullptr;
  std::size_t built = 0;
  ScreenBlock blocks[kBlocks];
};

class Screens {
 public:
  Screens() : screens_(kScreens) {}

  // Forgets what is kept; to be called whenever the seeds or their neighbours change.
  void reset(const SortedSeeds& seeds) {
    seeds_ = &seeds;
    scale_ = screen_scale(seeds.extent);
    for (CellScreen& screen : screens_) screen.list = nullptr;
  }
  // Of the screens' coordinates.
  double scale() const { return scale_; }

  CellScreen& of(Index slot, const NeighbourList& list) {
    CellScreen& screen = screens_[slot % kScreens];
    if (screen.list != list.begin) {
      screen.list = list.begin;
      screen.built = 0;
    }
    return screen;
  }
  // Blocks have to be asked for in their order.
  const ScreenBlock& block(CellScreen& screen, Index slot, const NeighbourList& list, std::size_t index) const {
    if (index == screen.built) build(screen, slot, list);
    return screen.blocks[index];
  }

 private:
  static constexpr std::size_t kScreens = 512;  // each for the last cell whose slot leads to it

  void build(CellScreen& screen, Index slot, const NeighbourList& list) const {
    const std::size_t index = screen.built++;
    ScreenBlock& block = screen.blocks[index];
    const Vec3 x = seeds_->x[slot];
    for (std::size_t m = 0; m < 4; ++m) {
      const Index* j = list.begin + 4 * index + m;
      if (j >= list.end) {
        block.set_none(m);
        continue;
      }
      const Vec3 d = scale_ * (seeds_->x[*j] - x);
      block.set(m, d, 0.5 * norm2(d));
    }
  }

  const SortedSeeds* seeds_ = nullptr;
  double scale_ = 1;
  std::vector<CellScreen> screens_;
};

}  // namespace bisector
