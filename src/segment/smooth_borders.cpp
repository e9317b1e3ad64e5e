#include "segment/smooth_borders.h"

#include <algorithm>
#include <boost/graph/boykov_kolmogorov_max_flow.hpp>
#include <boost/graph/compressed_sparse_row_graph.hpp>
#include <cmath>
#include <cstdint>
#include <map>
#include <numeric>
#include <set>
#include <utility>

#include "bisector/error.h"
#include "segment/region_topology.h"

namespace bisector {

namespace {

// Energies are fixed-point numbers: sums and flows are exact, and no residue of rounding keeps a path open.
using Cost = std::int64_t;
constexpr double kUnit = 0x1p40;        // of Cost, to the energy at the start
constexpr double kMostBorder = 0x1p50;  // of one edge, so that sums fit; no cut pays for it

constexpr double kFar = 1e100;  // squared distances from here on are no numbers to add up
constexpr int kSplits = 4;      // of connected changes that the topology forbids
constexpr int kPasses = 4;      // that take changes back by a row of triangles each, later ones by ever more
constexpr int kFirstRings = 4;  // width of a strip that is widened where its cut asks for more

// Triangles along a region's borders, and the energy of a labelling x of them: 0 for the region, 1 for another one that
// each triangle has for itself.
struct Strip {
  struct Link {
    Index i, j;        // positions in `triangles`
    Cost forth, back;  // if x_i = 0 and x_j = 1, and the other way round
  };
  std::vector<Index> triangles, others;
  std::vector<Cost> differences;  // in cost between the other region and this one, of the triangles alone
  std::vector<Cost> costs;        // of x_i = 1 over x_i = 0, links to triangles beside the strip included
  std::vector<Link> links;
};

// The labelling of least energy, by maximum flow from label 0 to label 1 (Boykov and Kolmogorov 2004).
std::vector<char> minimum_cut(const Strip& strip) {
  using Node = std::uint32_t;
  const auto n = static_cast<Node>(strip.triangles.size());
  const Node source = n, sink = n + 1;
  std::vector<Node> offsets(n + 3, 0);  // of each node's arcs
  const auto for_each_pair = [&](const auto& visit) {
    for (Node i = 0; i < n; ++i) {
      if (strip.costs[i] > 0) visit(source, i, strip.costs[i], Cost{0});
      if (strip.costs[i] < 0) visit(i, sink, -strip.costs[i], Cost{0});
    }
    for (const Strip::Link& link : strip.links) visit(link.i, link.j, link.forth, link.back);
  };
  for_each_pair([&](Node i, Node j, Cost, Cost) {
    ++offsets[i + 1];
    ++offsets[j + 1];
  });
  std::partial_sum(offsets.begin(), offsets.end(), offsets.begin());
  using Network = boost::compressed_sparse_row_graph<boost::directedS, boost::no_property, boost::no_property,
                                                     boost::no_property, Node, Node>;
  using Arc = boost::graph_traits<Network>::edge_descriptor;
  std::vector<std::pair<Node, Node>> arcs(offsets.back());  // sorted by the node that they come from
  std::vector<Cost> capacities(arcs.size());
  std::vector<Arc> reverses(arcs.size());
  std::vector<Node> next(offsets.begin(), offsets.end() - 1);
  for_each_pair([&](Node i, Node j, Cost forth, Cost back) {
    const Node to = next[i]++, fro = next[j]++;
    arcs[to] = {i, j};
    arcs[fro] = {j, i};
    capacities[to] = forth;
    capacities[fro] = back;
    reverses[to] = Arc(j, fro);
    reverses[fro] = Arc(i, to);
  });
  const Network network(boost::edges_are_sorted, arcs.begin(), arcs.end(), n + 2);
  std::vector<Cost> residuals(arcs.size());
  std::vector<Arc> predecessors(n + 2);
  std::vector<boost::default_color_type> colours(n + 2);
  std::vector<int> distances(n + 2);
  const auto number = get(boost::edge_index, network);
  const auto vertex = get(boost::vertex_index, network);
  const auto of_arcs = [&](auto& list) { return boost::make_iterator_property_map(list.begin(), number); };
  const auto of_vertices = [&](auto& list) { return boost::make_iterator_property_map(list.begin(), vertex); };
  boykov_kolmogorov_max_flow(network, of_arcs(capacities), of_arcs(residuals), of_arcs(reverses),
                             of_vertices(predecessors), of_vertices(colours), of_vertices(distances), vertex, source,
                             sink);
  std::vector<char> x(n);
  for (std::size_t i = 0; i < n; ++i) x[i] = colours[i] == boost::black_color ? 0 : 1;
  return x;
}

class BorderSmoother {
 public:
  BorderSmoother(const DualGraph& graph, const std::vector<Triangle>& triangles,
                 const std::function<double(Index, Index)>& distance, const SmoothBordersOptions& options,
                 std::vector<Index>& labels)
      : graph_(graph), distance_(distance), options_(options), labels_(labels), topology_(graph, triangles, labels),
        members_(topology_.regions()), meets_(topology_.regions()), position_(labels.size(), kNone),
        before_(labels.size(), kNone), next_(labels.size(), kNone) {
    for (std::size_t t = 0; t < labels.size(); ++t) members_[labels[t]].push_back(static_cast<Index>(t));
    for (Index r = 0; r < topology_.regions(); ++r)
      for (const auto& [other, count] : topology_.contacts(r)) meets_[r].push_back(other);
    measure_energy();
  }

  SmoothBordersResult run(const Context& context) {
    SmoothBordersResult result;
    // Regions are tried again where they or one beside them changed since.
    const std::size_t regions = topology_.regions();
    std::vector<std::size_t> changed(regions, 1), tried(regions, 0);
    std::size_t now = 1;
    for (int sweep = 0; sweep < options_.sweeps; ++sweep) {
      bool any = false;
      for (Index region = 0; region < regions; ++region) {
        std::size_t latest = changed[region];
        for (const Index other : meets_[region]) latest = std::max(latest, changed[other]);
        if (latest <= tried[region]) continue;
        context.check();
        tried[region] = now;
        const Outcome outcome = improve(region);
        result.refused += outcome == Outcome::refused;
        if (outcome != Outcome::cut) continue;
        ++result.cuts;
        ++now;
        for (const Index r : touched_) changed[r] = now;
        any = true;
      }
      if (!any) break;
    }
    return result;
  }

 private:
  enum class Outcome { same, cut, refused };
  using Triangles = std::vector<Index>;

  // Moves triangles between a region and those it meets, all at once, so that the energy falls the most.
  Outcome improve(Index region) {
    int rings = options_.rings > 0 ? options_.rings : kFirstRings;
    Strip strip;
    std::vector<char> x;
    begin_strip(region, strip);
    std::vector<Index> ends = strip.triangles;
    for (int steps = rings - 1;; steps = rings, rings *= 2) {
      widen(region, ends, steps, strip);
      fill(region, strip);
      x = minimum_cut(strip);
      if (options_.rings > 0) break;
      ends = changed_ends(region, strip, x);
      if (ends.empty()) break;
    }
    for (const Index t : strip.triangles) position_[t] = kNone;
    touched_.clear();
    for (std::size_t i = 0; i < x.size(); ++i) {
      const Index t = strip.triangles[i];
      before_[t] = labels_[t];
      next_[t] = labels_[t] == region ? strip.others[i] : region;
    }
    std::vector<Triangles> groups = connected_changes(region, strip, x);
    const bool same = groups.empty();
    // What the topology forbids it may allow once others have moved, or together with others.
    std::size_t moved = 0, last;
    do {
      last = groups.size();
      moved += std::erase_if(groups, [&](const Triangles& group) { return move(group, true, 0); });
    } while (!groups.empty() && groups.size() < last);
    Triangles left;
    for (const Triangles& group : groups) left.insert(left.end(), group.begin(), group.end());
    if (groups.size() > 1 && move(left, true, 0)) {
      ++moved;
      groups.clear();
    }
    for (const Triangles& group : groups) moved += move(group, true, kSplits);
    for (const Index t : strip.triangles) before_[t] = kNone;
    for (const Index r : touched_) topology_.settle(r, members_[r]);
    return moved > 0 ? Outcome::cut : same ? Outcome::same : Outcome::refused;
  }

  // The triangles at the strip's end that a labelling moves: beside them more might move.
  Triangles changed_ends(Index region, const Strip& strip, const std::vector<char>& x) const {
    Triangles ends;
    for (std::size_t i = 0; i < x.size(); ++i) {
      const Index t = strip.triangles[i];
      if ((labels_[t] == region) == (x[i] == 0)) continue;
      if (std::any_of(graph_.neighbours.begin(t), graph_.neighbours.end(t),
                      [&](Index u) { return position_[u] == kNone && may_change(u, region); }))
        ends.push_back(t);
    }
    return ends;
  }

  bool may_change(Index t, Index region) const { return labels_[t] == region || meet(region, labels_[t]); }

  // --- The strip and its energy ---

  void measure_energy() {
    for (Index t = 0; t < labels_.size(); ++t) {
      const double d = distance_(t, labels_[t]);
      if (d < kFar) energy_ += d;
      for (std::size_t k = graph_.neighbours.offsets[t]; k < graph_.neighbours.offsets[t + 1]; ++k) {
        const Index u = graph_.neighbours.values[k];
        if (t < u && labels_[u] != labels_[t])
          energy_ += graph_.edge_length[k] * (options_.weights[labels_[t]] + options_.weights[labels_[u]]) / 2;
      }
    }
    unit_ = energy_ > 0 ? kUnit / energy_ : 0;
  }

  // The triangles at a region's borders, on both sides. Until the strip is finished, `position_` is where each is in
  // it.
  void begin_strip(Index region, Strip& strip) {
    std::erase_if(members_[region], [&](Index t) { return labels_[t] != region; });
    for (const Index t : members_[region])
      for (const Index* u = graph_.neighbours.begin(t); u != graph_.neighbours.end(t); ++u)
        if (labels_[*u] != region) {
          add(t, strip);
          add(*u, strip);
        }
    find_others(region, strip);
  }

  // Adds the triangles within so many steps from some of the strip's, in the order of steps.
  void widen(Index region, std::vector<Index> from, int steps, Strip& strip) {
    for (int step = 0; step < steps && !from.empty(); ++step) {
      const std::size_t begin = strip.triangles.size();
      for (const Index t : from)
        for (const Index* u = graph_.neighbours.begin(t); u != graph_.neighbours.end(t); ++u)
          if (may_change(*u, region)) add(*u, strip);
      find_others(region, strip);
      from.assign(strip.triangles.begin() + static_cast<std::ptrdiff_t>(begin), strip.triangles.end());
    }
  }

  void add(Index t, Strip& strip) {
    if (position_[t] != kNone) return;
    position_[t] = static_cast<Index>(strip.triangles.size());
    strip.triangles.push_back(t);
  }

  // For the triangles last added, the region that each may be of instead: its own, or of this region's that which is
  // nearest among those across the border.
  void find_others(Index region, Strip& strip) {
    for (std::size_t i = strip.others.size(); i < strip.triangles.size(); ++i) {
      const Index t = strip.triangles[i];
      strip.others.push_back(other_region(t, region, strip));
      strip.differences.push_back(cost_of(t, strip.others[i]) - cost_of(t, region));
    }
  }

  Index other_region(Index t, Index region, const Strip& strip) const {
    if (labels_[t] != region) return labels_[t];
    Index nearest = kNone;
    double least = 0;
    for (const Index* u = graph_.neighbours.begin(t); u != graph_.neighbours.end(t); ++u) {
      Index other = labels_[*u];
      if (other == region) {
        if (position_[*u] >= strip.others.size()) continue;
        other = strip.others[position_[*u]];
      }
      if (other == nearest) continue;
      const double d = distance_(t, other);
      if (nearest != kNone && !(d < least || (d == least && other < nearest))) continue;
      nearest = other;
      least = d;
    }
    return nearest;
  }

  void fill(Index region, Strip& strip) {
    const std::size_t n = strip.triangles.size();
    strip.costs = strip.differences;
    strip.links.clear();
    for (std::size_t i = 0; i < n; ++i) {
      const Index t = strip.triangles[i], own = strip.others[i];
      strip.costs[i] += labels_[t] == region ? 1 : -1;  // of equally good labellings that of fewest changes
      for (std::size_t k = graph_.neighbours.offsets[t]; k < graph_.neighbours.offsets[t + 1]; ++k) {
        const Index u = graph_.neighbours.values[k], j = position_[u];
        const Index other = j == kNone ? labels_[u] : strip.others[j];
        const double length = graph_.edge_length[k];
        const Cost of_region = half_cost(length, region), of_own = half_cost(length, own);
        if (j == kNone) {
          if (other == region) strip.costs[i] += of_region + of_own;
          else strip.costs[i] -= other == own ? of_region + of_own : of_region - of_own;
        } else if (i < j) {
          if (other == own) {
            strip.links.push_back({static_cast<Index>(i), j, of_region + of_own, of_region + of_own});
          } else {
            // A border on each side of the region costs no less than one between the two others.
            strip.costs[i] += of_region + of_own;
            strip.costs[j] += half_cost(length, other) - of_region;
            strip.links.push_back({static_cast<Index>(i), j, 2 * of_region, 0});
          }
        }
      }
    }
  }

  // What is no number, or more than all there is, is as much as all there is: no cut pays for it.
  Cost cost_of(Index t, Index region) const {
    const double d = distance_(t, region);
    return static_cast<Cost>(std::llround(unit_ * (d < energy_ ? d : energy_)));
  }

  // A region's share in the cost of a piece of its border, so that costs obey the triangle inequality exactly.
  Cost half_cost(double length, Index region) const {
    const double cost = unit_ * length * options_.weights[region] / 2;
    return static_cast<Cost>(std::llround(cost < kMostBorder ? cost : kMostBorder));
  }

  // --- Changes that keep the topology ---

  // The triangles that change sides, those that are connected together.
  std::vector<Triangles> connected_changes(Index region, const Strip& strip, const std::vector<char>& x) {
    Triangles pending;
    for (std::size_t i = 0; i < x.size(); ++i)
      if ((labels_[strip.triangles[i]] == region) != (x[i] == 0)) pending.push_back(strip.triangles[i]);
    for (const Index t : pending) position_[t] = 0;
    std::vector<Triangles> groups;
    for (const Index first : pending) {
      if (position_[first] == kNone) continue;
      position_[first] = kNone;
      Triangles group{first};
      for (std::size_t next = 0; next < group.size(); ++next)
        for (const Index* u = graph_.neighbours.begin(group[next]); u != graph_.neighbours.end(group[next]); ++u)
          if (std::exchange(position_[*u], kNone) != kNone) group.push_back(*u);
      groups.push_back(std::move(group));
    }
    return groups;
  }

  // Moves connected triangles to the other side, less what would leave crumbs, where that lowers the energy and keeps
  // the topology; otherwise tries either half, so many times over. `lowers`: all of them together are known to lower
  // the energy. False: all stay.
  bool move(const Triangles& wanted, bool lowers, int splits) {
    Triangles changed = wanted;
    apply(changed);
    int steps = 0;
    for (int pass = 1; give_back(changed, steps); ++pass)
      if (pass >= kPasses) steps = 2 * steps + 1;
    const bool better = !changed.empty() && ((lowers && changed.size() == wanted.size()) || lowers_energy(changed));
    if (better && keeps_topology(changed)) {
      for (const Index t : changed) {
        members_[next_[t]].push_back(t);
        touched_.insert({before_[t], next_[t]});
      }
      return true;
    }
    undo(changed);
    if (splits == 0 || wanted.size() < 2) return false;
    const auto middle = wanted.begin() + static_cast<std::ptrdiff_t>(wanted.size() / 2);
    const bool first = move({wanted.begin(), middle}, false, splits - 1);
    const bool second = move({middle, wanted.end()}, false, splits - 1);
    return first || second;
  }

  bool lowers_energy(const Triangles& changed) {
    const Cost after = energy_about(changed);
    undo(changed);
    const Cost before = energy_about(changed);
    apply(changed);
    return after < before;
  }

  // What triangles and their borders cost.
  Cost energy_about(const Triangles& triangles) {
    for (const Index t : triangles) position_[t] = 0;
    Cost sum = 0;
    for (const Index t : triangles) {
      sum += cost_of(t, labels_[t]);
      for (std::size_t k = graph_.neighbours.offsets[t]; k < graph_.neighbours.offsets[t + 1]; ++k) {
        const Index u = graph_.neighbours.values[k];
        if (labels_[u] == labels_[t] || (position_[u] != kNone && u < t)) continue;
        sum += half_cost(graph_.edge_length[k], labels_[t]) + half_cost(graph_.edge_length[k], labels_[u]);
      }
    }
    for (const Index t : triangles) position_[t] = kNone;
    return sum;
  }

  void apply(const Triangles& changed) {
    for (const Index t : changed) topology_.relabel(t, next_[t]);
  }
  void undo(const Triangles& changed) {
    for (const Index t : changed) topology_.relabel(t, before_[t]);
  }

  // The changed triangles of each region that they left or joined.
  std::map<Index, Triangles> by_region(const Triangles& changed) const {
    std::map<Index, Triangles> result;
    for (const Index t : changed) {
      result[before_[t]].push_back(t);
      result[next_[t]].push_back(t);
    }
    return result;
  }

  bool meet(Index a, Index b) const { return std::binary_search(meets_[a].begin(), meets_[a].end(), b); }

  // Takes back the changes that leave crumbs, or make regions meet or part, and those within so many steps from them;
  // true if there were any and some are left. Each call makes the changes fewer, so calls come to an end.
  bool give_back(Triangles& changed, int steps) {
    Triangles crumbs;
    for (const auto& [r, triangles] : by_region(changed)) {
      const Triangles of_region = topology_.crumbs(r, triangles);
      crumbs.insert(crumbs.end(), of_region.begin(), of_region.end());
    }
    for (const Index t : crumbs) position_[t] = 0;
    const auto breaks = [&](Index t) {
      const Index before = before_[t], now = labels_[t];
      const auto parted = [&](Index other) {
        return other != kNone && other != before && meet(before, other) && !topology_.contacts(before).contains(other);
      };
      if (position_[t] != kNone) return true;
      return std::any_of(graph_.neighbours.begin(t), graph_.neighbours.end(t), [&](Index u) {
        const Index other = labels_[u];
        if (other == before && position_[u] != kNone) return true;
        return (other != now && !meet(now, other)) || parted(other) || parted(before_[u]);
      });
    };
    Triangles kept, undone;
    for (const Index t : changed) (breaks(t) ? undone : kept).push_back(t);
    for (const Index t : crumbs) position_[t] = kNone;
    if (steps > 0) {
      for (const Index t : kept) position_[t] = 0;
      for (std::size_t begin = 0, step = 0; step < static_cast<std::size_t>(steps) && begin < undone.size(); ++step) {
        const std::size_t end = undone.size();
        for (; begin < end; ++begin)
          for (const Index* u = graph_.neighbours.begin(undone[begin]); u != graph_.neighbours.end(undone[begin]); ++u)
            if (std::exchange(position_[*u], kNone) != kNone) undone.push_back(*u);
      }
      std::erase_if(kept, [&](Index t) { return position_[t] == kNone; });
      for (const Index t : kept) position_[t] = kNone;
    }
    undo(undone);
    changed = std::move(kept);
    return !undone.empty() && !changed.empty();
  }

  bool keeps_topology(const Triangles& changed) {
    const std::map<Index, Triangles> of_regions = by_region(changed);
    for (const auto& [r, triangles] : of_regions) {
      const auto& contacts = topology_.contacts(r);
      const bool same = std::equal(meets_[r].begin(), meets_[r].end(), contacts.begin(), contacts.end(),
                                   [](Index other, const auto& contact) { return other == contact.first; });
      if (topology_.triangle_count(r) == 0 || !same) return false;
    }
    const auto measured = [&](const auto& measure) {
      std::vector<decltype(measure(Index{}, changed))> result;
      for (const auto& [r, triangles] : of_regions) result.push_back(measure(r, triangles));
      return result;
    };
    const auto is_kept = [&](const auto& measure) {
      const auto after = measured(measure);
      undo(changed);
      const auto before = measured(measure);
      apply(changed);
      return after == before;
    };
    return is_kept([&](Index r, const Triangles& t) { return topology_.local_euler(r, t); }) &&
           (is_kept([&](Index r, const Triangles& t) { return topology_.border_chains(r, t); }) ||
            is_kept([&](Index r, const Triangles& t) { return topology_.local_loops(r, t); }));
  }

  const DualGraph& graph_;
  const std::function<double(Index, Index)>& distance_;
  const SmoothBordersOptions& options_;
  std::vector<Index>& labels_;
  RegionTopology topology_;
  std::vector<Triangles> members_;         // of each region, and some that have left it
  std::vector<std::vector<Index>> meets_;  // the regions that each met at first, ascending
  std::vector<Index> position_;            // of a triangle in the strip, or any mark; else kNone
  std::vector<Index> before_;              // region of a triangle of the strip when that was made; else kNone
  std::vector<Index> next_;                // region that it has once it changes sides
  std::set<Index> touched_;                // regions that the last strip changed
  double energy_ = 0, unit_ = 0;           // at the start; Cost in it
};

}  // namespace

SmoothBordersResult smooth_borders(const DualGraph& graph, const std::vector<Triangle>& triangles,
                                   const std::function<double(Index, Index)>& distance,
                                   const SmoothBordersOptions& options, std::vector<Index>& labels,
                                   const Context& context) {
  for (const Index label : labels)
    if (label >= options.weights.size())
      throw Error("there are " + std::to_string(options.weights.size()) + " weights of borders, but a region " +
                  std::to_string(label) + ": give one for each region");
  for (const double weight : options.weights)
    if (!(weight >= 0) || !std::isfinite(weight))
      throw Error("a weight of the borders' length is " + std::to_string(weight) + "; it has to be a number from 0 on");
  return BorderSmoother(graph, triangles, distance, options, labels).run(context);
}

}  // namespace bisector
