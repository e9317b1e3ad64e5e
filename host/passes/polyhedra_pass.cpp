#include "host/passes/polyhedra_pass.h"

#include <algorithm>

#include "core/parallel.h"
#include "voronoi/polyhedra.h"

namespace bisector::host {
namespace {

constexpr std::size_t kWindow = std::size_t{1} << 14;  // pairs that are labelled at once
constexpr std::size_t kStride = kPolyhedronHeader + TetPairs::kMostPlanes + TetPairs::kMostVertices;
constexpr std::size_t kChunk = 256;  // polyhedra that one task completes

// What the device says of a pair.
struct Found {
  Index tet, slot;
  bool exactly = false;       // it is to be clipped anew
  std::vector<Index> labels;  // none: the whole tetrahedron
  std::vector<std::array<Index, 3>> triples;
};

void append(const ClippedPolyhedra& part, ClippedPolyhedra& polyhedra) {
  const std::size_t labels = polyhedra.labels.size(), triples = polyhedra.triples.size();
  const auto add = [](auto& to, const auto& from) { to.insert(to.end(), from.begin(), from.end()); };
  add(polyhedra.pairs, part.pairs);
  add(polyhedra.labels, part.labels);
  add(polyhedra.triples, part.triples);
  add(polyhedra.vertices, part.vertices);
  for (std::size_t k = 1; k < part.label_offsets.size(); ++k) {
    polyhedra.label_offsets.push_back(labels + part.label_offsets[k]);
    polyhedra.vertex_offsets.push_back(triples + part.vertex_offsets[k]);
  }
}

}  // namespace

void PolyhedraPass::run(PairPass& pairs, const PairJob& job, TetPairs& domain, ExactRung& exact,
                        ClippedPolyhedra& polyhedra) {
  const PairStore& store = job.store;
  labels_.reserve(kWindow * kStride * sizeof(Index));
  std::vector<PairName> names(store.count);
  std::vector<Index> status(store.count), window;
  job.commands.phase(&DeviceSeconds::transfer);
  if (store.count) {
    job.commands.download(store.pairs, 0, names.data(), names.size() * sizeof(PairName));
    job.commands.download(store.status, 0, status.data(), status.size() * sizeof(Index));
    job.commands.run();
  }

  std::vector<Found> found;
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
        Found entry;
        entry.tet = names[pair].element;
        entry.slot = names[pair].slot;
        const Index* words = window.data() + k * kStride;
        entry.exactly = words[0] == kNone;
        if (words[0] != kNone && words[0] != 0) {
          const Index* labels = words + kPolyhedronHeader;
          entry.labels.assign(labels, labels + words[0]);
          const Index* vertices = labels + TetPairs::kMostPlanes;
          for (Index v = 0; v < words[1]; ++v)
            entry.triples.push_back({vertices[v] & 255, vertices[v] >> 8 & 255, vertices[v] >> 16 & 255});
        }
        found.push_back(std::move(entry));
      }
    }

  const SortedSeeds& seeds = job.seeds.on_host();
  sort_in_parallel(found, [&](const Found& a, const Found& b) {
    return a.tet != b.tet ? a.tet < b.tet : seeds.id[a.slot] < seeds.id[b.slot];
  });
  std::vector<ClippedPolyhedra> parts((found.size() + kChunk - 1) / kChunk);
  exact.for_each<TetClipper>(
      parts.size(),
      [&](std::size_t c, TetClipper& clipper) {
        for (std::size_t k = c * kChunk; k < std::min(found.size(), (c + 1) * kChunk); ++k) {
          const Found& entry = found[k];
          const TetFrame& frame = domain.solid().frames[entry.tet];
          clipper.begin(entry.slot);
          if (entry.exactly) clipper.clip(frame);
          else if (entry.labels.empty()) clipper.take(frame);
          else clipper.take(frame, entry.labels, entry.triples);
          append_polyhedron(clipper, seeds, domain.solid().whole ? kNone : entry.tet, entry.slot, parts[c]);
        }
      },
      1);
  polyhedra = {};
  for (const ClippedPolyhedra& part : parts) append(part, polyhedra);
}

}  // namespace bisector::host
