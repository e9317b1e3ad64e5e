#include "segment/smooth_borders.h"

#include <algorithm>
#include <boost/graph/boykov_kolmogorov_max_flow.hpp>
#include <boost/graph/compressed_sparse_row_graph.hpp>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <utility>

#include "bisector/error.h"
#include "segment/region_topology.h"

namespace bisector {

namespace {

// Energies are fixed-point numbers: sums and flows are exact, and no residue of rounding keeps a path open.
using Cost = std::int64_t;
constexpr double kUnit = 0x1p40;  // of Cost, to an energy of 1

// The triangles that may change sides, and the energy of a labelling x of them with 0 and 1.
struct Strip {
  struct Link {
    Index i, j;  // positions in `triangles`
    Cost cost;   // if x_i != x_j
  };
  std::vector<Index> triangles;
  std::vector<std::array<Cost, 2>> costs;  // of x_i = 0 and x_i = 1, links to triangles beside the strip included
  std::vector<Link> links;

  Cost energy(const std::vector<char>& x) const {
    Cost sum = 0;
    for (std::size_t i = 0; i < triangles.size(); ++i) sum += costs[i][static_cast<std::size_t>(x[i])];
    for (const Link& link : links)
      if (x[link.i] != x[link.j]) sum += link.cost;
    return sum;
  }
};

// The labelling of least energy, by maximum flow from label 0 to label 1 (Boykov and Kolmogorov 2004).
std::vector<char> minimum_cut(const Strip& strip) {
  const std::size_t n = strip.triangles.size(), source = n, sink = n + 1;
  std::vector<std::pair<std::size_t, std::size_t>> arcs;  // 2 k and 2 k + 1 run against each other
  std::vector<Cost> capacities;
  const auto connect = [&](std::size_t from, std::size_t to, Cost forth, Cost back) {
    arcs.insert(arcs.end(), {{from, to}, {to, from}});
    capacities.insert(capacities.end(), {forth, back});
  };
  for (std::size_t i = 0; i < n; ++i) {
    const Cost surplus = strip.costs[i][1] - strip.costs[i][0];
    if (surplus > 0) connect(source, i, surplus, 0);
    if (surplus < 0) connect(i, sink, -surplus, 0);
  }
  for (const Strip::Link& link : strip.links) connect(link.i, link.j, link.cost, link.cost);

  using Network = boost::compressed_sparse_row_graph<boost::directedS, boost::no_property, std::size_t>;
  std::vector<std::size_t> numbers(arcs.size());
  std::iota(numbers.begin(), numbers.end(), std::size_t{0});
  Network network(boost::edges_are_unsorted_multi_pass, arcs.begin(), arcs.end(), numbers.begin(), n + 2);
  std::vector<Network::edge_descriptor> reverses(arcs.size()), predecessors(n + 2);
  const auto [begin, end] = edges(network);
  for (auto e = begin; e != end; ++e) reverses[network[*e] ^ 1] = *e;
  std::vector<Cost> residuals(arcs.size());
  std::vector<boost::default_color_type> colours(n + 2);
  std::vector<long> distances(n + 2);
  const auto number = get(boost::edge_bundle, network);
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
        members_(topology_.regions()), meets_(topology_.regions()), position_(labels.size(), kNone) {
    for (std::size_t t = 0; t < labels.size(); ++t) members_[labels[t]].push_back(static_cast<Index>(t));
    for (Index r = 0; r < topology_.regions(); ++r)
      for (const auto& [other, count] : topology_.contacts(r)) meets_[r].push_back(other);
  }

  SmoothBordersResult run() {
    SmoothBordersResult result;
    for (int sweep = 0; sweep < options_.sweeps; ++sweep) {
      bool changed = false;
      for (Index a = 0; a < meets_.size(); ++a)
        for (const Index b : meets_[a]) {
          if (b < a) continue;
          const Outcome outcome = smooth_pair(a, b);
          result.cuts += outcome == Outcome::cut;
          result.refused += outcome == Outcome::refused;
          changed |= outcome == Outcome::cut;
        }
      if (!changed) break;
    }
    return result;
  }

 private:
  enum class Outcome { same, cut, refused };
  using Triangles = std::vector<Index>;

  Outcome smooth_pair(Index a, Index b) {
    const Strip strip = make_strip(a, b);
    const std::vector<char> x = minimum_cut(strip);
    if (strip.energy(x) >= strip.energy(sides(strip, b))) return Outcome::same;
    const std::vector<Triangles> groups = connected_changes(strip, x, b);
    return move(strip, groups, 0, groups.size(), a, b) ? Outcome::cut : Outcome::refused;
  }

  std::vector<char> sides(const Strip& strip, Index b) const {
    std::vector<char> x(strip.triangles.size());
    for (std::size_t i = 0; i < x.size(); ++i) x[i] = labels_[strip.triangles[i]] == b;
    return x;
  }

  // --- The strip and its energy (thesis 2.3.3) ---

  Strip make_strip(Index a, Index b) {
    Strip strip;
    gather(a, b, strip.triangles);
    for (std::size_t i = 0; i < strip.triangles.size(); ++i) position_[strip.triangles[i]] = static_cast<Index>(i);
    const double unit = kUnit / std::max(1.0, options_.lambda);
    const auto fixed = [&](double cost) { return static_cast<Cost>(std::llround(unit * cost)); };
    for (std::size_t i = 0; i < strip.triangles.size(); ++i) {
      const Index t = strip.triangles[i];
      const double d0 = distance_(t, a), d1 = distance_(t, b), sum = d0 + d1;
      const double share = sum > 0 && std::isfinite(sum) ? d0 / sum : 0.5;
      std::array<Cost, 2> costs{fixed(share), fixed(1 - share)};
      ++costs[labels_[t] == a ? 1 : 0];  // of equally good labellings the one with the fewest changes
      for (std::size_t k = graph_.neighbours.offsets[t]; k < graph_.neighbours.offsets[t + 1]; ++k) {
        const Index u = graph_.neighbours.values[k];
        if (labels_[u] != a && labels_[u] != b) continue;
        const double length = graph_.edge_length[k], scale = length + graph_.mean_edge_length;
        const Cost cost = scale > 0 ? fixed(options_.lambda * (length / scale)) : 0;
        if (position_[u] == kNone) costs[labels_[u] == a ? 1 : 0] += cost;
        else if (t < u) strip.links.push_back({static_cast<Index>(i), position_[u], cost});
      }
      strip.costs.push_back(costs);
    }
    for (const Index t : strip.triangles) position_[t] = kNone;
    return strip;
  }

  // The triangles of a and b within `rings` steps from their border, ascending.
  void gather(Index a, Index b, std::vector<Index>& out) {
    const auto touches = [&](Index t, Index region) {
      return std::any_of(graph_.neighbours.begin(t), graph_.neighbours.end(t),
                         [&](Index u) { return labels_[u] == region; });
    };
    const auto add = [&](Index t) {
      if (position_[t] != kNone) return;
      position_[t] = 0;
      out.push_back(t);
    };
    const bool a_is_small = topology_.triangle_count(a) <= topology_.triangle_count(b);
    const Index small = a_is_small ? a : b, large = a_is_small ? b : a;
    std::erase_if(members_[small], [&](Index t) { return labels_[t] != small; });
    if (options_.rings > 0)
      for (const Index t : members_[small]) {
        if (!touches(t, large)) continue;
        add(t);
        for (const Index* u = graph_.neighbours.begin(t); u != graph_.neighbours.end(t); ++u)
          if (labels_[*u] == large) add(*u);
      }
    std::size_t begin = 0;
    for (int ring = 1; ring < options_.rings; ++ring) {
      const std::size_t end = out.size();
      for (std::size_t i = begin; i < end; ++i) {
        const Index t = out[i];
        for (const Index* u = graph_.neighbours.begin(t); u != graph_.neighbours.end(t); ++u)
          if (labels_[*u] == a || labels_[*u] == b) add(*u);
      }
      begin = end;
    }
    std::sort(out.begin(), out.end());
  }

  // --- Changes that keep the topology ---

  // The triangles that change sides, those that are connected together.
  std::vector<Triangles> connected_changes(const Strip& strip, const std::vector<char>& x, Index b) {
    Triangles pending;
    for (std::size_t i = 0; i < x.size(); ++i)
      if ((labels_[strip.triangles[i]] == b) != (x[i] != 0)) pending.push_back(strip.triangles[i]);
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

  // Moves groups [begin, end) to the other side, less what would leave crumbs, where that lowers the energy and keeps
  // the topology; otherwise tries either half. True if anything changed.
  bool move(const Strip& strip, const std::vector<Triangles>& groups, std::size_t begin, std::size_t end, Index a,
            Index b) {
    const Cost energy_before = strip.energy(sides(strip, b));
    Triangles changed;
    for (std::size_t g = begin; g < end; ++g) changed.insert(changed.end(), groups[g].begin(), groups[g].end());
    change_sides(changed, a, b);
    while (give_back(changed, a, b)) {
    }
    if (!changed.empty() && strip.energy(sides(strip, b)) < energy_before && keeps_topology(changed, a, b)) {
      for (const Index t : changed) members_[labels_[t]].push_back(t);
      return true;
    }
    change_sides(changed, a, b);
    if (end - begin <= 1) return false;
    const std::size_t middle = begin + (end - begin) / 2;
    const bool first = move(strip, groups, begin, middle, a, b);
    const bool second = move(strip, groups, middle, end, a, b);
    return first || second;
  }

  void change_sides(const Triangles& changed, Index a, Index b) {
    for (const Index t : changed) topology_.relabel(t, labels_[t] == a ? b : a);
  }

  // Takes back the changes that leave crumbs, or meet or leave third regions anew; true if there were any and some are
  // left. Each call makes the changes fewer, so calls come to an end.
  bool give_back(Triangles& changed, Index a, Index b) {
    Triangles crumbs = topology_.crumbs(a, changed);
    const Triangles of_b = topology_.crumbs(b, changed);
    crumbs.insert(crumbs.end(), of_b.begin(), of_b.end());
    for (const Index t : crumbs) position_[t] = 0;
    const auto breaks = [&](Index t) {
      const Index now = labels_[t], before = now == a ? b : a;
      if (position_[t] != kNone) return true;
      return std::any_of(graph_.neighbours.begin(t), graph_.neighbours.end(t), [&](Index u) {
        const Index other = labels_[u];
        if (other == a || other == b) return other == before && position_[u] != kNone;
        return !std::binary_search(meets_[now].begin(), meets_[now].end(), other) ||
               !topology_.contacts(before).contains(other);
      });
    };
    Triangles kept, undone;
    for (const Index t : changed) (breaks(t) ? undone : kept).push_back(t);
    for (const Index t : crumbs) position_[t] = kNone;
    change_sides(undone, a, b);
    changed = std::move(kept);
    return !undone.empty() && !changed.empty();
  }

  bool keeps_topology(const Triangles& changed, Index a, Index b) {
    for (const Index r : {a, b}) {
      const auto& contacts = topology_.contacts(r);
      const bool same = std::equal(meets_[r].begin(), meets_[r].end(), contacts.begin(), contacts.end(),
                                   [](Index other, const auto& contact) { return other == contact.first; });
      if (topology_.triangle_count(r) == 0 || !same) return false;
    }
    const RegionTopology::Local after[] = {topology_.local(a, changed), topology_.local(b, changed)};
    change_sides(changed, a, b);
    const RegionTopology::Local before[] = {topology_.local(a, changed), topology_.local(b, changed)};
    change_sides(changed, a, b);
    return after[0] == before[0] && after[1] == before[1];
  }

  const DualGraph& graph_;
  const std::function<double(Index, Index)>& distance_;
  const SmoothBordersOptions& options_;
  std::vector<Index>& labels_;
  RegionTopology topology_;
  std::vector<Triangles> members_;         // of each region, and some that have left it
  std::vector<std::vector<Index>> meets_;  // the regions that each met at first, ascending
  std::vector<Index> position_;            // of a triangle in the strip, or any mark; else kNone
};

}  // namespace

SmoothBordersResult smooth_borders(const DualGraph& graph, const std::vector<Triangle>& triangles,
                                   const std::function<double(Index, Index)>& distance,
                                   const SmoothBordersOptions& options, std::vector<Index>& labels) {
  if (!(options.lambda >= 0) || !std::isfinite(options.lambda))
    throw Error("the weight of the borders' length is " + std::to_string(options.lambda) +
                "; it has to be a number from 0 on");
  return BorderSmoother(graph, triangles, distance, options, labels).run();
}

}  // namespace bisector
