#include "host/passes/tet_pairs.h"

#include <algorithm>
#include <cmath>

#include "host/passes/packing.h"
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

TetPairs::TetPairs(bool is_double, DeviceSolid& solid, const OwnerPass& corners, ExactRung& exact, bool inner_whole,
                   double batch_pairs)
    : double_(is_double), solid_(solid), corners_(corners), exact_(exact), inner_whole_(inner_whole),
      batch_pairs_(batch_pairs) {}

void TetPairs::set_shell(const PairStore& pairs, const CellMoments& moments, std::size_t cells) {
  shell_ = &pairs;
  shell_moments_ = &moments;
  const Solid& solid = solid_.solid;
  const double density = static_cast<double>(cells) / solid.volume;
  batches_ = {{0, 0}};
  expected_pairs_ = 0;
  double batch = 0;
  for (std::size_t t = 0; t < solid_.tets(); ++t) {
    if (!(solid.six_volumes[t] > 0)) {
      ++batches_.back().count;
      continue;
    }
    const double expected = expected_cells(solid_.frames[t], solid.six_volumes[t] / 6, density);
    expected_pairs_ += expected;
    if (!inner_whole_ && batch > 0 && batch + expected > batch_pairs_) {
      batches_.push_back({t, 0});
      batch = 0;
    }
    batch += expected;
    ++batches_.back().count;
  }
  if (!inner_whole_) return;
  std::size_t on_boundary = 0;
  for (std::size_t i = 0; i < moments.triangles.rows(); ++i) on_boundary += moments.triangles.size(i) > 0;
  const double share = static_cast<double>(on_boundary) / static_cast<double>(cells);
  expected_pairs_ = share * expected_pairs_ + (1 - share) * static_cast<double>(cells);
}

void TetPairs::start(const PairJob& job, const PairBuffers& buffers, std::size_t index) {
  const Batch& batch = batches_[index];
  const StartTetsPush push{word(batch.first), word(batch.count), word(buffers.proposal_capacity)};
  job.commands.dispatch(
      {"start_tets", {!inner_whole_}},
      {updates(solid_.meta), reads(corners_.owners()), updates(buffers.proposals), updates(job.counters)}, push,
      batch.count);
  if (!inner_whole_) return;
  const StartBoundaryPush shell{word(shell_->count), word(job.seeds.count()), word(buffers.proposal_capacity)};
  job.commands.dispatch({"start_boundary", {}},
                        {reads(shell_->pairs), reads(shell_->status), reads(solid_.tet_of_facet),
                         updates(buffers.cell_errors), updates(buffers.proposals), updates(job.counters)},
                        shell, shell_->count);
}

void TetPairs::clip(const PairJob& job, const PairBuffers& buffers, std::size_t, const ClipKind& kind, ClipPush push,
                    const Buffer& labels, const ClipDispatch& dispatch) {
  const bool doubled = kind.rung == kRungDouble;
  push.element_base = solid_.enclosure();
  const std::uint32_t planes = kind.labels || kind.rung == kRungFirst ? kMostPlanes : kWidePlanes;
  const PairStore& store = job.store;
  dispatch(kernel("clip_tet", double_ || doubled,
                  {planes, 2 * planes - 4, solid_.solid.density.empty(), kind.rung, kind.listed, kind.labels, doubled,
                   !doubled && double_next(), inner_whole_}),
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
    for (const Index label : clipper.labels()) {
      if (is_facet(label)) {
        const Index across = !inner_whole_ || tet == solid_.enclosure() ? kNone : solid_.solid.adjacent[tet][label & 3];
        if (across != kNone) pair.proposals.push_back({across, slot});
      } else if (!inner_whole_) {
        pair.proposals.push_back({tet, label});
      } else if (shell_moments_->triangles.size(job.seeds.sorted.id[label]) == 0) {
        pair.proposals.push_back({solid_.enclosure(), label});
      }
    }
  });
  return pairs;
}

}  // namespace bisector::host
