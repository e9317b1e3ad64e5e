#include "host/passes/tet_pairs.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "host/passes/packing.h"
#include "kernels/layout/counters.h"
#include "kernels/layout/pairs.h"
#include "mesh/tet_adjacency.h"

namespace bisector::host {
namespace {

constexpr uint kWidePlanes = 64;  // of a polyhedron, on the rungs after the first

static_assert(kFacetLabel == LAYOUT_BORDER_LABEL);

uint word(std::size_t n) { return static_cast<uint>(n); }

// Cells that a tetrahedron meets, of `density` per volume: those balls of a cell's volume that do, by Steiner's
// formula, edges being as sharp as a regular one's.
double expected_cells(const TetFrame& tet, double volume, double density) {
  double area = 0, length = 0;
  for (int k = 0; k < 4; ++k) {
    const int* f = kFacetCorners[k];
    area += 0.5 * norm(cross(tet.corners[f[1]] - tet.corners[f[0]], tet.corners[f[2]] - tet.corners[f[0]]));
    for (int l = 0; l < k; ++l) length += norm(tet.corners[k] - tet.corners[l]);
  }
  const double radius = 0.62 * std::cbrt(1 / density);
  return density * (volume + area * radius + 0.96 * length * radius * radius) + 1;
}

}  // namespace

TetPairs::TetPairs(bool is_double, DeviceSolid& solid, const OwnerPass& corners, ExactRung& exact, double batch_pairs)
    : double_(is_double), solid_(solid), corners_(corners), exact_(exact), batch_pairs_(batch_pairs) {}

void TetPairs::plan(std::size_t cells) {
  const Solid& solid = solid_.solid;
  const double density = static_cast<double>(cells) / solid.volume;
  batches_ = {{0, 0}};
  expected_pairs_ = 0;
  double batch = 0;
  for (std::size_t t = 0; t < solid_.frames.size(); ++t) {
    if (!(solid.six_volumes[t] > 0)) {
      ++batches_.back().count;
      continue;
    }
    const double expected = expected_cells(solid_.frames[t], solid.six_volumes[t] / 6, density);
    expected_pairs_ += expected;
    if (batch > 0 && batch + expected > batch_pairs_) {
      batches_.push_back({t, 0});
      batch = 0;
    }
    batch += expected;
    ++batches_.back().count;
  }
}

void TetPairs::plan_whole(std::vector<Index> starts, std::vector<Index> marks) {
  batches_ = {{0, 1}};
  starts_ = std::move(starts);
  marks_ = std::move(marks);
  for (const Index slot : starts_) marks_[slot] |= kMarkMet;
  expected_pairs_ = static_cast<double>(marks_.size());
}

void TetPairs::start(const PairJob& job, const PairBuffers& buffers, std::size_t index) {
  if (solid_.whole) return start_whole(job, buffers);
  const Batch& batch = batches_[index];
  const StartTetsPush push{word(batch.first), word(batch.count), word(buffers.proposal_capacity)};
  job.commands.dispatch(
      {"start_tets", {}},
      {updates(solid_.meta), reads(corners_.owners()), updates(buffers.proposals), updates(job.counters)}, push,
      batch.count);
}

// Marks the cells that are not to be proposed any more, and proposes those to start from.
void TetPairs::start_whole(const PairJob& job, const PairBuffers& buffers) const {
  constexpr std::size_t kWord = sizeof(uint);
  job.commands.upload(buffers.cell_errors, kCellErrorWords * job.seeds.count() * kWord, marks_.data(),
                      marks_.size() * kWord);
  if (starts_.size() > buffers.proposal_capacity)
    return job.commands.fill(job.counters, kOverflow * kWord, kWord, kOverflowProposals);
  std::vector<PairName> proposals;
  for (const Index slot : starts_) proposals.push_back({0, slot});
  if (!proposals.empty())
    job.commands.upload(buffers.proposals, 0, proposals.data(), proposals.size() * sizeof(PairName));
  job.commands.fill(job.counters, kProposals * kWord, kWord, word(proposals.size()));
}

void TetPairs::clip(const PairJob& job, const PairBuffers& buffers, std::size_t, const ClipKind& kind, ClipPush push,
                    const Buffer& labels, const ClipDispatch& dispatch) {
  const bool doubled = kind.rung == kRungDouble;
  const std::uint32_t planes = kind.labels || kind.rung == kRungFirst ? kMostPlanes : kWidePlanes;
  const PairStore& store = job.store;
  dispatch(kernel("clip_tet", double_ || doubled,
                  {planes, 2 * planes - 4, solid_.solid.density.empty(), kind.rung, kind.listed, kind.labels, doubled,
                   !doubled && double_next(), solid_.whole}),
           {reads(doubled ? job.seeds.doubles : job.seeds.words), reads(job.seeds.ids),
            reads(doubled ? solid_.double_words : solid_.words), reads(solid_.meta), reads(job.neighbours.info()),
            updates(buffers.cell_errors), reads(job.neighbours.lists()), reads(job.neighbours.wide_lists()),
            reads(store.pairs), updates(store.status), updates(store.mass_second), updates(store.first),
            updates(buffers.proposals), updates(job.counters), updates(buffers.flagged), writes(labels)},
           push);
}

std::vector<ExactPair> TetPairs::clip_exactly(const PairJob& job, const std::vector<PairName>& names) {
  std::vector<ExactPair> pairs(names.size());
  const bool uniform = solid_.solid.density.empty();
  exact_.for_each<TetClipper>(names.size(), [&](std::size_t k, TetClipper& clipper) {
    const auto [tet, slot] = names[k];
    ExactPair& pair = pairs[k];
    clipper.begin(slot);
    if (!clipper.clip(solid_.frames[tet])) return;
    pair.empty = false;
    pair.moments = scaled(uniform ? clipper.integrate<true>() : clipper.integrate<false>(), job.seeds.scale, true);
    for (const Index label : clipper.labels())
      if (!is_facet(label)) pair.proposals.push_back({tet, label});
  });
  if (solid_.whole)
    for (ExactPair& pair : pairs) {
      for (const PairName& name : pair.proposals) marks_[name.slot] |= kMarkMet;
      std::erase_if(pair.proposals, [&](const PairName& name) { return marks_[name.slot] & kMarkBoundary; });
    }
  return pairs;
}

}  // namespace bisector::host
