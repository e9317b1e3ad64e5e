#include "host/passes/facet_pairs.h"

#include "host/passes/packing.h"
#include "kernels/layout/pairs.h"
#include "voronoi/clip.h"

namespace bisector::host {
namespace {

constexpr uint kWideCorners = 48;  // of a polygon, on the rungs after the first

static_assert(kEdgeLabel == LAYOUT_BORDER_LABEL && kNone == LAYOUT_NONE);

uint word(std::size_t n) { return static_cast<uint>(n); }

}  // namespace

FacetPairs::FacetPairs(Device& device, bool is_double, const SurfaceBuffers& surface, const OwnerPass& sites,
                       const OwnerPass& samples, ExactRung& exact)
    : double_(is_double), surface_(surface), sites_(sites), owners_of_samples_(samples), exact_(exact),
      sample_facets_(device) {}

void FacetPairs::plan(Commands& commands, std::size_t seeds, double batch_pairs) {
  plan_ = plan_batches(surface(), surface_.facets, seeds, batch_pairs);
  sample_facets_.reserve(sizeof(Index));
  upload(commands, sample_facets_, plan_.facets);
}

std::size_t FacetPairs::chunk_of(std::size_t batch) const {
  std::size_t chunk = 0;
  while (plan_.batches[batch].first >= surface_.facets[chunk].first + surface_.facets[chunk].count) ++chunk;
  return chunk;
}

void FacetPairs::start(const PairJob& job, const PairBuffers& buffers, std::size_t index) {
  const FacetBatch& batch = plan_.batches[index];
  const FacetChunk& facets = surface_.facets[chunk_of(index)];
  const PairStore& store = job.store;
  const StartFacetsPush push{word(facets.first), word(batch.first), word(batch.count), word(buffers.proposal_capacity),
                             word(store.capacity)};
  job.commands.dispatch(
      kernel("start_facets", double_),
      {reads(job.seeds.words), reads(facets.words), reads(facets.meta), reads(facets.wholes), reads(sites_.owners()),
       updates(store.pairs), updates(store.status), updates(store.mass_second), updates(store.first),
       writes(buffers.proposals), updates(job.counters)},
      push, batch.count);
  if (batch.sample_count == 0) return;
  const StartSamplesPush samples{word(facets.first), word(batch.first_sample), word(batch.sample_count),
                                 word(buffers.proposal_capacity)};
  job.commands.dispatch({"start_samples", {}},
                        {reads(sample_facets_), reads(owners_of_samples_.owners()), updates(buffers.proposals),
                         updates(job.counters), reads(sites_.owners()), reads(facets.meta)},
                        samples, batch.sample_count);
}

void FacetPairs::clip(const PairJob& job, const PairBuffers& buffers, std::size_t chunk, const ClipKind& kind,
                      ClipPush push, const Buffer& labels, const ClipDispatch& dispatch) {
  const bool doubled = kind.rung == kRungDouble;
  const FacetChunk& facets = (doubled ? surface_.double_facets : surface_.facets)[chunk];
  push.element_base = word(facets.first);
  const std::uint32_t corners = kind.labels || kind.rung == kRungFirst ? kMostCorners : kWideCorners;
  const PairStore& store = job.store;
  dispatch(kernel("clip", double_ || doubled,
                  {corners, surface().density.empty(), kind.rung, kind.listed, kind.labels, doubled,
                   !doubled && double_next()}),
           {reads(doubled ? job.seeds.doubles : job.seeds.words), reads(job.seeds.ids), reads(facets.words),
            reads(facets.meta), reads(job.neighbours.info()), updates(buffers.cell_errors),
            reads(job.neighbours.lists()), reads(job.neighbours.wide_lists()), reads(store.pairs),
            updates(store.status), updates(store.mass_second), updates(store.first), updates(buffers.proposals),
            updates(job.counters), updates(buffers.flagged), writes(labels)},
           push);
}

std::vector<ExactPair> FacetPairs::clip_exactly(const PairJob& job, const std::vector<PairName>& names) {
  std::vector<ExactPair> pairs(names.size());
  exact_.for_each<Clipper>(names.size(), [&](std::size_t k, Clipper& clipper) {
    clipper.begin(surface(), names[k].element);
    if (!clipper.clip(exact_.neighbours(), names[k].slot)) return;
    pairs[k].empty = false;
    pairs[k].moments = scaled(clipper.integrate(), job.seeds.scale);
    for (std::size_t e = 0; e < clipper.size(); ++e)
      if (!is_edge(clipper.label(e))) pairs[k].proposals.push_back({names[k].element, clipper.label(e)});
  });
  return pairs;
}

std::vector<std::vector<Index>> FacetPairs::label_exactly(const std::vector<PairName>& pairs) {
  std::vector<std::vector<Index>> labels(pairs.size());
  exact_.for_each<Clipper>(pairs.size(), [&](std::size_t k, Clipper& clipper) {
    clipper.begin(surface(), pairs[k].element);
    if (!clipper.clip(exact_.neighbours(), pairs[k].slot)) return;
    for (std::size_t e = 0; e < clipper.size(); ++e) labels[k].push_back(clipper.label(e));
  });
  return labels;
}

}  // namespace bisector::host
