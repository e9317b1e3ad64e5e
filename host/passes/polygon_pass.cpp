#include "host/passes/polygon_pass.h"

#include <algorithm>

#include "core/parallel.h"
#include "voronoi/clip.h"
#include "voronoi/polygons.h"

namespace bisector::host {
namespace {

constexpr std::size_t kWindow = std::size_t{1} << 16;  // pairs that are labelled at once
constexpr std::size_t kStride = kPolygonHeader + FacetPairs::kMostCorners;
constexpr std::size_t kChunk = 1024;  // polygons that one task completes

// Where the labels of a pair are; none if the pair is to be clipped exactly or is whole.
struct Found {
  Index facet, slot;
  Index count = 0;  // of labels
  std::size_t first_label = 0;
};

}  // namespace

void PolygonPass::run(PairPass& pairs, const PairJob& job, FacetPairs& domain, bool with_vertices,
                      RestrictedPolygons& polygons) {
  const PairStore& store = job.store;
  labels_.reserve(kWindow * kStride * sizeof(Index));
  std::vector<PairName> names(store.count);
  std::vector<Index> status(store.count);
  job.commands.phase(&DeviceSeconds::transfer);
  if (store.count) {
    job.commands.download(store.pairs, 0, names.data(), names.size() * sizeof(PairName));
    job.commands.download(store.status, 0, status.data(), status.size() * sizeof(Index));
    job.commands.run();
  }

  std::vector<Found> found;
  std::vector<Index> labels, window;
  std::vector<std::size_t> doubtful;  // of `found`
  for (const PairStore::Range& range : store.ranges)
    for (std::size_t first = range.begin; first < range.end; first += kWindow) {
      const std::size_t count = std::min(kWindow, range.end - first);
      pairs.label(job, range.chunk, first, count, labels_);
      window.resize(count * kStride);
      job.commands.download(labels_, 0, window.data(), window.size() * sizeof(Index));
      job.commands.run();
      for (std::size_t k = 0; k < count; ++k) {
        const std::size_t pair = first + k;
        if (status[pair] == kStatusEmpty) continue;
        Found entry{names[pair].element, names[pair].slot};
        const Index* words = window.data() + k * kStride;
        entry.first_label = labels.size();
        if (words[0] == kNone) {
          doubtful.push_back(found.size());
        } else {
          entry.count = words[0];
          labels.insert(labels.end(), words + kPolygonHeader, words + kPolygonHeader + words[0]);
        }
        found.push_back(entry);
      }
    }
  std::vector<PairName> items;
  for (const std::size_t k : doubtful) items.push_back({found[k].facet, found[k].slot});
  const std::vector<std::vector<Index>> exact = domain.label_exactly(items);
  for (std::size_t k = 0; k < doubtful.size(); ++k) {
    Found& entry = found[doubtful[k]];
    entry.first_label = labels.size();
    entry.count = static_cast<Index>(exact[k].size());
    labels.insert(labels.end(), exact[k].begin(), exact[k].end());
  }

  const Surface& surface = domain.surface();
  const SortedSeeds& seeds = job.seeds.on_host();
  const auto triangle = [&](const Found& f) { return surface.summaries[f.facet].triangle; };
  sort_in_parallel(found, [&](const Found& a, const Found& b) {
    return triangle(a) != triangle(b) ? triangle(a) < triangle(b) : seeds.id[a.slot] < seeds.id[b.slot];
  });
  std::vector<RestrictedPolygons> parts((found.size() + kChunk - 1) / kChunk);
  parallel_chunks(found.size(), kChunk, [&](std::size_t c, std::size_t begin, std::size_t end) {
    Clipper clipper;
    clipper.reset(seeds);
    for (std::size_t k = begin; k < end; ++k) {
      const auto [facet, slot, count, first_label] = found[k];
      if (!with_vertices) {
        append_labels(surface.facets[facet], seeds, triangle(found[k]), slot, {labels.data() + first_label, count},
                      parts[c]);
        continue;
      }
      clipper.begin(surface, facet);
      clipper.take(slot, labels.data() + first_label, count);
      append_polygon(clipper, seeds, triangle(found[k]), slot, parts[c]);
    }
  });
  polygons = {};
  for (const RestrictedPolygons& part : parts) {
    const std::size_t before = polygons.labels.size();
    polygons.pairs.insert(polygons.pairs.end(), part.pairs.begin(), part.pairs.end());
    polygons.labels.insert(polygons.labels.end(), part.labels.begin(), part.labels.end());
    polygons.vertices.insert(polygons.vertices.end(), part.vertices.begin(), part.vertices.end());
    for (std::size_t k = 1; k < part.offsets.size(); ++k) polygons.offsets.push_back(before + part.offsets[k]);
  }
}

}  // namespace bisector::host
