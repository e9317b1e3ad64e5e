#include "features/select_creases.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <optional>
#include <queue>
#include <set>
#include <utility>

#include "features/curve_network.h"
#include "features/edge_ways.h"
#include "spatial/kd_tree.h"

namespace bisector {
namespace {

// Creases go if more than this part of them runs beside others.
constexpr double kBeside = 0.5;
// So long, in widths, are parts of curves that go by themselves: two curves that leave a corner at less than 30 degrees
// are nearer to each other than the width as far as that.
constexpr double kStretch = 2;

// A run of samples that are all beside something, or all not.
struct Stretch {
  std::size_t begin, end;
  bool beside;
};

// Those shorter than kStretch become like what is around them, the shortest first.
std::vector<Stretch> stretches_of(const std::vector<char>& beside) {
  std::vector<Stretch> stretches;
  for (std::size_t k = 0; k < beside.size(); ++k) {
    if (stretches.empty() || stretches.back().beside != (beside[k] != 0)) stretches.push_back({k, k, beside[k] != 0});
    ++stretches.back().end;
  }
  const auto size = [](const Stretch& s) { return s.end - s.begin; };
  while (stretches.size() > 1) {
    const auto shortest = std::min_element(stretches.begin(), stretches.end(),
                                           [&](const Stretch& a, const Stretch& b) { return size(a) < size(b); });
    if (KeptCurves::kStep * static_cast<double>(size(*shortest)) >= kStretch) break;
    shortest->beside = !shortest->beside;
    std::vector<Stretch> merged;
    for (const Stretch& s : stretches) {
      if (!merged.empty() && merged.back().beside == s.beside) merged.back().end = s.end;
      else merged.push_back(s);
    }
    stretches = std::move(merged);
  }
  return stretches;
}

// An arc length, and how far from it a vertex may be.
struct Cut {
  double position, reach;
};

// Divides a candidate at its vertices that are nearest to these places, but not into parts shorter than `least`. A
// closed one then begins at the first of them.
std::vector<Candidate> parts_of(const Candidate& whole, const std::vector<Cut>& places,
                                const std::vector<Vec3>& vertices, double least) {
  std::vector<Index> chain = whole.curve.vertices;
  if (whole.curve.closed) chain.push_back(chain.front());
  const std::vector<double> at = arc_lengths(chain, vertices);
  const std::size_t last = chain.size() - 1;
  std::set<std::size_t> nearest;
  for (const auto& [position, reach] : places) {
    auto k = static_cast<std::size_t>(std::lower_bound(at.begin(), at.end(), position) - at.begin());
    k = std::min(k, last);
    if (k > 0 && position - at[k - 1] < at[k] - position) --k;
    if (std::abs(at[k] - position) > reach) continue;
    if (whole.curve.closed) nearest.insert(k % last);
    else if (at[k] >= least && at[last] - at[k] >= least) nearest.insert(k);
  }
  for (auto k = nearest.begin(); k != nearest.end();) {
    const auto next = std::next(k);
    if (next != nearest.end() && at[*next] - at[*k] < least) nearest.erase(next);
    else k = next;
  }
  if (nearest.empty()) return {whole};
  std::vector<std::size_t> cuts(nearest.begin(), nearest.end());
  if (whole.curve.closed) {
    const std::size_t first = cuts.front();
    chain.pop_back();
    std::rotate(chain.begin(), chain.begin() + static_cast<std::ptrdiff_t>(first), chain.end());
    chain.push_back(chain.front());
    cuts.erase(cuts.begin());
    for (std::size_t& k : cuts) k -= first;
  }
  std::vector<Candidate> parts;
  for (std::vector<Index>& part : divided(chain, cuts)) {
    const double length = length_of(part, false, vertices);
    parts.push_back({{std::move(part), false, whole.curve.kind}, whole.weight * length / whole.length, length});
  }
  return parts;
}

// Which candidates, or parts of them, stay: the heavier first, each but for stretches beside what stays already.
class Selection {
 public:
  Selection(const std::vector<Vec3>& vertices, double width, const Csr<Index>& neighbours)
      : vertices_(vertices), width_(width), neighbours_(neighbours), kept_(vertices, width) {}
  Selection(const Selection&) = delete;

  void choose(std::vector<Candidate> candidates) {
    const auto later = [](const Item& a, const Item& b) {
      const bool crease_a = is_crease(a.candidate.curve), crease_b = is_crease(b.candidate.curve);
      if (crease_a != crease_b) return crease_a;
      if (a.candidate.weight != b.candidate.weight) return a.candidate.weight < b.candidate.weight;
      return a.order > b.order;
    };
    std::priority_queue<Item, std::vector<Item>, decltype(later)> queue(later);
    std::size_t order = 0;
    stays_.assign(candidates.size(), 0);
    for (std::size_t c = 0; c < candidates.size(); ++c) queue.push({std::move(candidates[c]), c, order++, false});
    while (!queue.empty()) {
      const Item item = queue.top();
      queue.pop();
      if (!is_crease(item.candidate.curve)) {
        keep(item.candidate, item.origin);
        continue;
      }
      if (!item.divided) {
        bool winds = false;
        std::vector<Candidate> parts = apart_from_itself(item.candidate, winds);
        if (parts.size() > 1) {
          for (Candidate& part : parts) queue.push({std::move(part), item.origin, order++, !winds});
          continue;
        }
      }
      const std::vector<char> beside = kept_.beside(item.candidate, kept_.samples(item.candidate));
      std::vector<Candidate> parts = divided_between(item.candidate, stretches_of(beside));
      const bool whole = parts.size() == 1;
      for (Candidate& part : parts) {
        if (share(whole ? beside : kept_.beside(part, kept_.samples(part))) > kBeside)
          dropped_.push_back({std::move(part), item.origin});
        else keep(part, item.origin);
      }
    }
    attach_ends();
  }

  SelectedCreases result() && {
    const auto gone = static_cast<std::size_t>(std::count(stays_.begin(), stays_.end(), 0));
    return {std::move(chosen_), std::move(kept_), gone};
  }

 private:
  struct Item {
    Candidate candidate;
    std::size_t origin;  // the candidate that it is part of
    std::size_t order;
    bool divided;  // where it runs beside itself
  };
  struct Dropped {
    Candidate candidate;  // without vertices once it has come back
    std::size_t origin;

    bool ends_at(Index v) const {
      const std::vector<Index>& chain = candidate.curve.vertices;
      return !chain.empty() && (chain.front() == v || chain.back() == v);
    }
    Index end_beyond(Index v) const {
      const std::vector<Index>& chain = candidate.curve.vertices;
      return chain.front() == v ? chain.back() : chain.front();
    }
  };

  void keep(const Candidate& candidate, std::size_t origin) {
    stays_[origin] = 1;
    kept_.keep(candidate);
    chosen_.push_back(candidate);
  }

  static double share(const std::vector<char>& beside) {
    return static_cast<double>(std::count(beside.begin(), beside.end(), 1)) / static_cast<double>(beside.size());
  }

  std::vector<Candidate> divided_at(const Candidate& whole, const std::vector<Cut>& places) {
    std::vector<Candidate> parts = parts_of(whole, places, vertices_, kStretch * width_);
    for (std::size_t k = 0; k < parts.size() && !parts[k].curve.closed; ++k) {
      if (k > 0 || whole.curve.closed) cuts_.insert(parts[k].curve.vertices.front());
      if (k + 1 < parts.size() || whole.curve.closed) cuts_.insert(parts[k].curve.vertices.back());
    }
    return parts;
  }

  std::vector<Candidate> divided_between(const Candidate& whole, const std::vector<Stretch>& stretches) {
    // A vertex may be as far beyond the end of a stretch that goes as that is long.
    const double step = KeptCurves::kStep * width_;
    std::vector<Cut> places;
    for (std::size_t k = 0; k < stretches.size(); ++k) {
      const std::size_t before = k == 0 ? stretches.size() - 1 : k - 1;
      if (k == 0 && (!whole.curve.closed || stretches[k].beside == stretches[before].beside)) continue;
      const Stretch& goes = stretches[stretches[k].beside ? k : before];
      places.push_back(
          {step * static_cast<double>(stretches[k].begin), step * static_cast<double>(goes.end - goes.begin)});
    }
    return divided_at(whole, places);
  }

  // Divides a curve where it comes beside itself and leaves itself. One that is beside itself all along winds, like a
  // thread, and is halved.
  std::vector<Candidate> apart_from_itself(const Candidate& whole, bool& winds) {
    if (whole.length < 2 * kStretch * width_) return {whole};
    const std::vector<Sample> samples = kept_.samples(whole);
    const bool loop = is_loop(whole.curve);
    std::vector<Vec3> points;
    for (const Sample& sample : samples) points.push_back(sample.point);
    const PointSet set{points};
    const KdTree tree(3, set);
    std::vector<char> beside(samples.size(), 0);
    std::vector<std::pair<Index, double>> near;
    for (std::size_t k = 0; k < samples.size(); ++k) {
      const double q[3] = {points[k].x, points[k].y, points[k].z};
      tree.radiusSearch(q, width_ * width_, near, nanoflann::SearchParams(32, 0, false));
      for (const auto& [other, squared] : near) {
        double way = std::abs(samples[k].position - samples[other].position);
        if (loop) way = std::min(way, whole.length - way);
        if (std::sqrt(squared) < kHairpin * way) beside[k] = 1;
      }
    }
    const std::vector<Stretch> stretches = stretches_of(beside);
    winds = stretches.size() == 1 && stretches[0].beside;
    if (winds) return divided_at(whole, {{0, whole.length}, {0.5 * whole.length, whole.length}});
    return divided_between(whole, stretches);
  }

  struct Where {
    std::size_t curve, vertex;
  };

  void put(std::size_t c) {
    const std::vector<Index>& chain = chosen_[c].curve.vertices;
    for (std::size_t k = 0; k < chain.size(); ++k) at_[chain[k]].push_back({c, k});
  }

  // Leads what ends where its continuation went to what stays. Where there is no way the continuation comes back, for
  // what it joined at its other end as well.
  void attach_ends() {
    for (std::size_t c = 0; c < chosen_.size(); ++c) put(c);
    std::vector<Index> open(cuts_.begin(), cuts_.end());
    while (!open.empty()) {
      const Index v = open.back();
      open.pop_back();
      const std::optional<std::vector<Index>> way = way_from(v);
      if (!way) continue;
      if (!way->empty() && !is_wanted_beyond(v)) {
        extend(v, *way);
        continue;
      }
      for (Dropped& dropped : dropped_) {
        if (!dropped.ends_at(v)) continue;
        const Index other = dropped.end_beyond(v);
        keep(dropped.candidate, dropped.origin);
        put(chosen_.size() - 1);
        dropped.candidate.curve.vertices.clear();
        if (cuts_.contains(other)) open.push_back(other);
      }
    }
  }

  // Where a single curve ends, the way from there to what stays, empty if there is none.
  std::optional<std::vector<Index>> way_from(Index v) const {
    const auto uses = at_.find(v);
    if (uses == at_.end() || uses->second.size() != 1) return std::nullopt;
    const std::size_t c = uses->second[0].curve;
    const bool from_start = chosen_[c].curve.vertices.front() == v;
    if (chosen_[c].curve.closed || (!from_start && chosen_[c].curve.vertices.back() != v)) return std::nullopt;
    return way_to_kept(v, c, from_start);
  }

  // Whether what went at this vertex leads to an end that has no other way.
  bool is_wanted_beyond(Index v) const {
    return std::any_of(dropped_.begin(), dropped_.end(), [&](const Dropped& dropped) {
      if (!dropped.ends_at(v) || !cuts_.contains(dropped.end_beyond(v))) return false;
      const std::optional<std::vector<Index>> way = way_from(dropped.end_beyond(v));
      return way && way->empty();
    });
  }

  // The curve that ends at v, by a way from there.
  void extend(Index v, const std::vector<Index>& way) {
    const std::size_t c = at_.at(v)[0].curve;
    std::vector<Index>& chain = chosen_[c].curve.vertices;
    const bool from_start = chain.front() == v;
    for (const Index u : chain) std::erase_if(at_.at(u), [&](const Where& where) { return where.curve == c; });
    if (from_start) std::reverse(chain.begin(), chain.end());
    for (std::size_t k = 1; k < way.size(); ++k) chain.push_back(way[k]);
    chosen_[c].length = length_of(chain, false, vertices_);
    put(c);
  }

  // From an end of a curve along edges to a vertex of another, or to a far one of its own; empty if there is none near.
  std::vector<Index> way_to_kept(Index from, std::size_t curve, bool from_start) const {
    if (neighbours_.rows() == 0) return {};
    return shortest_edge_way(from, kLoopWidths * width_, vertices_, neighbours_, [&](Index v, double length) {
      const auto uses = at_.find(v);
      if (v == from || uses == at_.end() || uses->second.empty()) return EdgeWay::goes_on;
      const bool arrives = std::any_of(uses->second.begin(), uses->second.end(),
                                       [&](const Where& where) { return is_target(where, curve, from_start, length); });
      return arrives ? EdgeWay::arrives : EdgeWay::ends;
    });
  }

  // Not so near to a corner that what is left in between is shorter than the width.
  bool is_target(const Where& where, std::size_t curve, bool from_start, double way) const {
    const Candidate& candidate = chosen_[where.curve];
    const std::vector<double> at = arc_lengths(candidate.curve.vertices, vertices_);
    const double position = at[where.vertex];
    if (where.curve == curve && std::abs(position - (from_start ? 0 : at.back())) < kDetour * way) return false;
    if (candidate.curve.closed || where.vertex == 0 || where.vertex + 1 == at.size()) return true;
    return position >= width_ && at.back() - position >= width_;
  }

  const std::vector<Vec3>& vertices_;
  double width_;
  const Csr<Index>& neighbours_;  // along edges of the mesh, for each vertex
  KeptCurves kept_;
  std::vector<Candidate> chosen_;
  std::vector<Dropped> dropped_;
  std::vector<char> stays_;                 // of each candidate, whether any of it does
  std::set<Index> cuts_;                    // vertices where candidates were divided
  std::map<Index, std::vector<Where>> at_;  // of what was chosen
};

}  // namespace

SelectedCreases select_creases(std::vector<Candidate> candidates, const std::vector<Vec3>& vertices, double width,
                               const Csr<Index>& neighbours) {
  Selection selection(vertices, width, neighbours);
  selection.choose(std::move(candidates));
  return std::move(selection).result();
}

}  // namespace bisector
