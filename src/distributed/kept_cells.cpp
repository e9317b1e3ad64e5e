#include "distributed/kept_cells.h"

#include <algorithm>
#include <stdexcept>
#include <string>
#include <tuple>
#include <utility>

#include "backend/project.h"
#include "checkpoint/bytes.h"
#include "core/parallel.h"

namespace bisector {
namespace {

constexpr std::size_t kSeedsAtOnce = 256;

}  // namespace

void KeptCells::keep(std::uint64_t number, std::vector<Index> ids, Csr<Index> triangles,
                     std::vector<std::vector<Index>> known_by) {
  std::erase_if(kept_, [&](const Cells& kept) { return kept.number != projected_; });
  kept_.push_back({number, std::move(ids), std::move(triangles), std::move(known_by)});
}

std::vector<Foot> KeptCells::project(Ranks& ranks, std::uint64_t number, std::span<const Vec3> seeds,
                                     const Surface* surface, const std::vector<Index>& triangle) {
  const auto kept = std::find_if(kept_.begin(), kept_.end(), [&](const Cells& k) { return k.number == number; });
  if (kept == kept_.end()) throw std::logic_error("seeds are projected to cells that are no longer known");
  projected_ = number;
  std::vector<std::string> positions;
  for (const std::vector<Index>& known : kept->known_by) {
    std::vector<Vec3> some;
    for (const Index id : known) some.push_back(seeds[id]);
    positions.push_back(ByteWriter().put_all(some).take());
  }
  std::vector<Vec3> mine;
  ByteReader(ranks.scatter(std::move(positions))).get_all(mine);

  std::vector<Foot> feet(mine.size());
  parallel_each(
      feet.size(),
      [&](std::size_t k) {
        feet[k].seed = kNone;
        const Csr<Index>& cells = kept->triangles;
        if (k >= cells.rows() || cells.size(k) == 0) return;
        const SurfacePoint foot = nearest_on_triangles(*surface, {cells.begin(k), cells.end(k)}, mine[k]);
        const auto facet = static_cast<std::size_t>(foot.facet - surface->facets.data());
        feet[k] = {kept->ids[k], triangle[surface->summaries[facet].triangle], norm2(foot.at - mine[k]), foot.at,
                   foot.facet->normal};
      },
      kSeedsAtOnce);
  std::erase_if(feet, [](const Foot& foot) { return foot.seed == kNone; });
  std::vector<Foot> all = ranks.collect(feet);
  // Of equally near ones that of the first triangle.
  sort_in_parallel(all, [](const Foot& a, const Foot& b) {
    return std::tie(a.seed, a.squared, a.triangle) < std::tie(b.seed, b.squared, b.triangle);
  });
  all.erase(std::unique(all.begin(), all.end(), [](const Foot& a, const Foot& b) { return a.seed == b.seed; }),
            all.end());
  return all;
}

}  // namespace bisector
