#include "distributed/part_diagram.h"

#include <sys/resource.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <limits>
#include <span>
#include <utility>

#include "checkpoint/bytes.h"
#include "core/append_range.h"
#include "core/degenerate.h"
#include "core/parallel.h"
#include "distributed/unordered_sum.h"
#include "voronoi/clip.h"
#include "voronoi/dual.h"
#include "voronoi/fixed_tree_sum.h"
#include "voronoi/step_mass.h"
#include "voronoi/tiling.h"

namespace bisector {
namespace {

constexpr double kFar = std::numeric_limits<double>::infinity();
constexpr std::size_t kSlotsAtOnce = 256;
// Seeds move from one diagram to the next: a halo is somewhat wider than it has to be.
constexpr double kSpare = 1.25;
// Relative error of a distance, with room to spare.
constexpr double kDistanceError = 1e-12;

double largest_of(std::span<const double> values) {
  double largest = -kFar;
  for (const double value : values) largest = std::max(largest, value);
  return largest;
}

double cpu_seconds() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

std::uint64_t peak_memory() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<std::uint64_t>(usage.ru_maxrss) * 1024;
}

// The greatest of value(begin, end) over runs of [0, n).
template <class Value>
double greatest(std::size_t n, std::size_t run, const Value& value) {
  std::vector<double> found((n + run - 1) / run, -kFar);
  parallel_chunks(n, run, [&](std::size_t c, std::size_t begin, std::size_t end) { found[c] = value(begin, end); });
  return largest_of(found);
}

bool has_area(const TriangleMesh& mesh) {
  return std::any_of(mesh.triangles.begin(), mesh.triangles.end(), [&](const Triangle& t) {
    return !collinear(mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]);
  });
}

}  // namespace

PartDiagram::PartDiagram(SurfacePart part, Regions regions, int rank)
    : triangle_(std::move(part.triangle)), regions_(std::move(regions)), rank_(rank), box_(regions_.box(rank)) {
  if (has_area(part.mesh)) {
    surface_.emplace(std::move(part.mesh), std::move(part.density));
    for (int k = 0; k < 3; ++k) {
      box_.lo[k] = std::min(box_.lo[k], surface_->box.lo[k]);
      box_.hi[k] = std::max(box_.hi[k], surface_->box.hi[k]);
    }
    voronoi_.emplace(*surface_);
  }
  double largest = 0;
  for (const Box& box : {box_, surface_ ? surface_->box : Box{}})
    for (int k = 0; k < 3; ++k)
      for (const double side : {box.lo[k], box.hi[k]})
        if (std::isfinite(side)) largest = std::max(largest, std::abs(side));
  rounding_ = kDistanceError * largest;
}

double PartDiagram::total_mass(Ranks& ranks) const {
  return sum_of_all(ranks, surface_ ? surface_->facets.size() : 0,
                    [&](std::size_t k) { return surface_->summaries[k].moments.mass; });
}

PairCounts PartDiagram::evaluate(Ranks& ranks, const std::vector<Vec3>& seeds, NeighbourSource source, Want want,
                                 double halo, std::uint64_t number, Diagram& diagram) {
  const std::uint64_t sent = ranks.bytes_sent();
  const double started = cpu_seconds();
  if (halo_ == 0) halo_ = halo;
  const std::size_t count = ranks.gather(seeds.size()).front();
  SeedShares shares = std::exchange(shares_, {});  // forgotten if a rank fails
  const bool wants_dual = includes(want, Want::dual), wants_polygons = includes(want, Want::labels);
  meet_seeds(ranks, shares, seeds, source, wants_dual ? want | Want::labels : want);
  shares_ = std::move(shares);
  // Without facets no diagram fills the list again: it has to stay one, of no rows.
  if (number != 0) kept_.keep(number, ids_, std::exchange(local_.moments.triangles, {}), shares_.all());
  sum_cells(fetch_terms(ranks), includes(want, Want::triangles));
  set_step_masses(ranks);
  collect_cells(ranks, at_home_, count, includes(want, Want::triangles), diagram.moments);
  diagram.moments.number = number;
  figures_.untiled = wants_dual && surface_ ? count_untiled(*surface_, local_.polygons) : 0;
  if (wants_dual || wants_polygons) rename_polygons();
  if (wants_dual) collect_dual(ranks, extract_dual(local_.polygons), diagram.dual);
  if (wants_polygons) collect_polygons(ranks, std::move(local_.polygons), diagram.polygons);
  local_.polygons = {};
  PairCounts counts;
  for (const PairCounts& of_rank : ranks.gather(counts_)) counts += of_rank;
  figures_.facets = surface_ ? surface_->facets.size() : 0;
  figures_.home_seeds = home_.size();
  figures_.halo_seeds = ids_.size() - home_.size();
  figures_.halo = halo_;
  figures_.bytes_sent = ranks.bytes_sent() - sent;
  figures_.cpu_seconds = cpu_seconds() - started;
  figures_.memory = peak_memory();
  return counts;
}

// --- Seeds ---

// Fetches seeds until the diagram of these is that of all on the facets here.
void PartDiagram::meet_seeds(Ranks& ranks, SeedShares& to_share, const std::vector<Vec3>& all, NeighbourSource source,
                             Want want) {
  struct Request {
    Box box;
    double halo;
    std::size_t seeds;
    bool waits;
  };
  figures_.rounds = 0;
  for (bool waits = true;;) {
    const std::vector<Request> requests = ranks.gather(Request{box_, halo_, all.size(), waits});
    if (std::none_of(requests.begin(), requests.end(), [](const Request& r) { return r.waits; })) return;
    std::vector<std::string> shares;
    if (ranks.is_root())
      for (std::size_t r = 0; r < requests.size(); ++r) {
        const Request& request = requests[r];
        shares.push_back(request.waits ? to_share.share(static_cast<int>(r), request.box, request.halo, all) : "");
      }
    const std::string received = ranks.scatter(std::move(shares));
    if (!waits) continue;
    receive(received);
    ++figures_.rounds;
    trace(source, want);
    const double needed = needed_halo(requests.front().seeds);
    waits = needed > halo_;
    if (waits || kSpare * kSpare * needed < halo_) halo_ = std::max(kSpare * needed, rounding_);
  }
}

void PartDiagram::receive(const std::string& message) {
  ByteReader reader(message);
  if (reader.get<bool>()) reader.get_all(ids_);
  reader.get_all(x_);
  reader.end();
}

void PartDiagram::trace(NeighbourSource source, Want want) {
  counts_ = {};
  home_.clear();
  if (x_.empty()) {
    local_ = {};
    return;
  }
  if (voronoi_) {
    counts_ = voronoi_->trace(x_, source, want, local_).counts;
  } else {
    sorted_ = sort_seeds(x_);
    lists_.build(sorted_, NeighbourSource::nearest);
  }
  for (Index slot = 0; slot < seeds().x.size(); ++slot)
    if (regions_.at(seeds().x[slot]) == rank_) home_.push_back(slot);
}

// How far p is from the nearest side of the box that has something beyond.
double PartDiagram::depth(const Vec3& p) const {
  double least = kFar;
  for (int k = 0; k < 3; ++k) least = std::min({least, p[k] - box_.lo[k], box_.hi[k] - p[k]});
  return least - rounding_;
}

// The width of the halo beyond which no seed matters. Wider than it is now: it has to be that wide.
double PartDiagram::needed_halo(std::size_t all_seeds) const {
  if (x_.size() == all_seeds) return 0;
  if (x_.empty()) return surface_ ? std::max(2 * halo_, surface_->box.diagonal()) : 0;
  return std::max({0.0, halo_of_polygons(), halo_of_nearest(all_seeds)});
}

// Each corner of a polygon is nearer to its seed than to the outside of the halo.
double PartDiagram::halo_of_polygons() const {
  if (!voronoi_) return 0;
  struct Scratch {
    Clipper clipper;
    std::vector<CellPolygon> polygons;
    bool knows_seeds = false;
  };
  ThreadLocal<Scratch> scratches;
  const SortedSeeds& s = seeds();
  return greatest(s.x.size(), kSlotsAtOnce, [&](std::size_t begin, std::size_t end) {
    Scratch& scratch = scratches.local();
    double needed = 0;
    for (std::size_t slot = begin; slot < end; ++slot) {
      voronoi_->polygons_of(static_cast<Index>(slot), scratch.polygons);
      for (const CellPolygon& polygon : scratch.polygons) {
        // Mostly the facet's corners tell.
        const Facet& facet = surface_->facets[polygon.facet];
        double reach = 0, deep = kFar;
        for (const Vec3& corner : facet.corners) {
          reach = std::max(reach, norm2(corner - s.x[slot]));
          deep = std::min(deep, depth(corner));
        }
        const double facet_needs = std::sqrt(reach) * (1 + kDistanceError) - deep;
        if (facet_needs <= needed) continue;
        if (polygon.labels.empty() || facet_needs <= halo_ / (kSpare * kSpare)) {
          needed = facet_needs;
          continue;
        }
        if (!scratch.knows_seeds) scratch.clipper.reset(s);
        scratch.knows_seeds = true;
        scratch.clipper.begin(*surface_, polygon.facet);
        scratch.clipper.take(static_cast<Index>(slot), polygon.labels.data(), polygon.labels.size());
        for (std::size_t k = 0; k < scratch.clipper.size(); ++k) {
          const Vec3 corner = scratch.clipper.vertex(k);
          const double far = norm(corner) * (1 + kDistanceError) + 4 * scratch.clipper.slack(k);
          needed = std::max(needed, far - depth(s.x[slot] + corner) + 2 * scratch.clipper.slack(k));
        }
      }
    }
    return needed;
  });
}

// The nearest seeds of those at home here are the nearest of all.
double PartDiagram::halo_of_nearest(std::size_t all_seeds) const {
  const SortedSeeds& s = seeds();
  if (s.x.size() <= kStepNeighbours && x_.size() < all_seeds) return std::max(2 * halo_, s.extent);
  return greatest(home_.size(), kSlotsAtOnce, [&](std::size_t begin, std::size_t end) {
    double needed = 0;
    for (std::size_t h = begin; h < end; ++h) {
      const Index slot = home_[h];
      const double deep = depth(s.x[slot]);
      const auto needs = [&](Index other) { return norm(s.x[other] - s.x[slot]) * (1 + kDistanceError) - deep; };
      const NeighbourList list = neighbours().list(slot);
      if (list.end - list.begin >= static_cast<std::ptrdiff_t>(kStepNeighbours) &&
          needs(list.begin[kStepNeighbours - 1]) <= needed)
        continue;
      Index near[kStepNeighbours];
      if (neighbours().nearest_to(slot, kStepNeighbours, near) == kStepNeighbours)
        needed = std::max(needed, needs(near[kStepNeighbours - 1]));
    }
    return needed;
  });
}

// --- Cells ---

// Sends the moments of polygons of cells that are at home elsewhere. Returns those that others have of the cells here.
std::vector<PartDiagram::Term> PartDiagram::fetch_terms(Ranks& ranks) const {
  std::vector<std::vector<Term>> terms(static_cast<std::size_t>(ranks.size()));
  if (voronoi_) {
    std::vector<CellPolygon> polygons;
    for (Index slot = 0; slot < seeds().x.size() && !x_.empty(); ++slot) {
      const int home = regions_.at(seeds().x[slot]);
      if (home == rank_) continue;
      voronoi_->polygons_of(slot, polygons);
      for (const CellPolygon& polygon : polygons)
        terms[static_cast<std::size_t>(home)].push_back(
            {id_of(slot), triangle_[surface_->summaries[polygon.facet].triangle], polygon.moments});
    }
  }
  std::vector<Term> fetched;
  for (const std::vector<Term>& some : ranks.exchange(std::move(terms))) append_range(fetched, some, 0, some.size());
  sort_in_parallel(fetched, [](const Term& a, const Term& b) {
    return a.seed != b.seed ? a.seed < b.seed : a.triangle < b.triangle;
  });
  return fetched;
}

void PartDiagram::sum_cells(const std::vector<Term>& fetched, bool list_triangles) {
  at_home_.ids.resize(home_.size());
  at_home_.cells.resize(home_.size());
  std::vector<std::vector<Index>> lists((home_.size() + kSlotsAtOnce - 1) / kSlotsAtOnce);
  at_home_.triangles.offsets.assign(home_.size() + 1, 0);
  parallel_chunks(home_.size(), kSlotsAtOnce, [&](std::size_t c, std::size_t begin, std::size_t end) {
    FixedTreeSum sum;
    std::vector<CellPolygon> polygons;
    std::vector<Term> terms;
    for (std::size_t h = begin; h < end; ++h) {
      const Index id = at_home_.ids[h] = id_of(home_[h]);
      terms.clear();
      if (voronoi_) {
        voronoi_->polygons_of(home_[h], polygons);
        for (const CellPolygon& polygon : polygons)
          terms.push_back({id, triangle_[surface_->summaries[polygon.facet].triangle], polygon.moments});
      }
      const auto before = [](const Term& term, Index seed) { return term.seed < seed; };
      const auto from = std::lower_bound(fetched.begin(), fetched.end(), id, before);
      const auto to = std::find_if(from, fetched.end(), [&](const Term& term) { return term.seed != id; });
      const auto own = static_cast<std::ptrdiff_t>(terms.size());
      terms.insert(terms.end(), from, to);
      std::inplace_merge(terms.begin(), terms.begin() + own, terms.end(),
                         [](const Term& a, const Term& b) { return a.triangle < b.triangle; });
      for (const Term& term : terms) sum.add(term.moments);
      at_home_.cells[h] = sum.finish();
      at_home_.triangles.offsets[h + 1] = terms.size();
      if (list_triangles)
        for (const Term& term : terms) lists[c].push_back(term.triangle);
    }
  });
  for (std::size_t h = 0; h < home_.size(); ++h) at_home_.triangles.offsets[h + 1] += at_home_.triangles.offsets[h];
  at_home_.triangles.values.clear();
  for (const std::vector<Index>& list : lists) append_range(at_home_.triangles.values, list, 0, list.size());
}

// As voronoi/step_mass does, with the masses of cells that are at home elsewhere.
void PartDiagram::set_step_masses(Ranks& ranks) {
  double largest = 0;
  for (const Moments& cell : at_home_.cells) largest = std::max(largest, cell.mass);
  largest = std::max(0.0, largest_of(ranks.gather(largest)));

  const SortedSeeds& s = seeds();
  std::vector<Index> cell_of(x_.empty() ? 0 : s.x.size(), kNone);
  for (Index h = 0; h < home_.size(); ++h) cell_of[home_[h]] = h;
  struct Nearby {
    Index cell;
    std::size_t count;
    Index slots[kStepNeighbours];
  };
  std::vector<Nearby> small;
  for (Index h = 0; h < home_.size(); ++h)
    if (at_home_.cells[h].mass < kStepShare * largest) small.push_back({h, 0, {}});
  parallel_each(small.size(), [&](std::size_t k) {
    small[k].count = neighbours().nearest_to(home_[small[k].cell], kStepNeighbours, small[k].slots);
  });

  std::vector<std::vector<Index>> asked(static_cast<std::size_t>(ranks.size()));  // seeds, by the rank they are at
  for (const Nearby& nearby : small)
    for (const Index slot : std::span(nearby.slots, nearby.count))
      if (cell_of[slot] == kNone) asked[static_cast<std::size_t>(regions_.at(s.x[slot]))].push_back(id_of(slot));
  for (std::vector<Index>& ids : asked) {
    std::sort(ids.begin(), ids.end());
    ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
  }
  const auto slot_of = [&](Index id) {
    return s.slot[static_cast<std::size_t>(std::lower_bound(ids_.begin(), ids_.end(), id) - ids_.begin())];
  };
  std::vector<std::vector<double>> masses_here;
  for (const std::vector<Index>& ids : ranks.exchange(asked)) {
    std::vector<double>& masses = masses_here.emplace_back();
    for (const Index id : ids) masses.push_back(at_home_.cells[cell_of[slot_of(id)]].mass);
  }
  std::vector<double> mass_elsewhere(cell_of.size());  // of slots that were asked for
  const std::vector<std::vector<double>> answers = ranks.exchange(std::move(masses_here));
  for (std::size_t r = 0; r < answers.size(); ++r)
    for (std::size_t k = 0; k < answers[r].size(); ++k) mass_elsewhere[slot_of(asked[r][k])] = answers[r][k];

  at_home_.step_mass.resize(home_.size());
  for (std::size_t h = 0; h < home_.size(); ++h) at_home_.step_mass[h] = at_home_.cells[h].mass;
  for (const Nearby& nearby : small) {
    double masses[kStepNeighbours];
    for (std::size_t k = 0; k < nearby.count; ++k) {
      const Index slot = nearby.slots[k], cell = cell_of[slot];
      masses[k] = cell == kNone ? mass_elsewhere[slot] : at_home_.cells[cell].mass;
    }
    at_home_.step_mass[nearby.cell] = step_mass(at_home_.cells[nearby.cell].mass, masses, nearby.count);
  }
}

// By the indices of the whole mesh and of all seeds.
void PartDiagram::rename_polygons() {
  RestrictedPolygons& mine = local_.polygons;
  for (RestrictedPolygons::Pair& pair : mine.pairs) pair = {triangle_[pair.triangle], ids_[pair.cell]};
  for (Index& label : mine.labels)
    if (!is_edge(label)) label = ids_[label];
}

}  // namespace bisector
