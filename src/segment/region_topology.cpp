#include "segment/region_topology.h"

#include <algorithm>
#include <numeric>
#include <utility>

#include "core/grouping.h"

namespace bisector {

namespace {

class DisjointSets {
 public:
  explicit DisjointSets(std::size_t n) : parent_(n), count_(n) {
    std::iota(parent_.begin(), parent_.end(), std::size_t{0});
  }

  std::size_t count() const { return count_; }
  std::size_t root(std::size_t i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  // The new root; the other one is left.
  std::size_t join(std::size_t i, std::size_t j) {
    i = root(i);
    j = root(j);
    if (i != j) --count_;
    parent_[std::max(i, j)] = std::min(i, j);
    return std::min(i, j);
  }

 private:
  std::vector<std::size_t> parent_;
  std::size_t count_;
};

template <class T>
void sort_once(std::vector<T>& list) {
  std::sort(list.begin(), list.end());
  list.erase(std::unique(list.begin(), list.end()), list.end());
}

void forget(std::map<Index, std::size_t>& contacts, Index region) {
  const auto at = contacts.find(region);
  if (--at->second == 0) contacts.erase(at);
}

}  // namespace

RegionTopology::RegionTopology(const DualGraph& graph, const std::vector<Triangle>& triangles,
                               std::vector<Index>& labels)
    : graph_(graph), labels_(labels), triangles_(triangles), front_(triangles.size(), kNone),
      tree_(triangles.size(), kNone), parent_(triangles.size(), kNone), rooted_(triangles.size(), 0) {
  std::size_t regions = 0;
  for (const Index label : labels) regions = std::max(regions, label + std::size_t{1});
  sizes_.resize(regions, 0);
  contacts_.resize(regions);
  for (std::size_t t = 0; t < labels.size(); ++t) {
    ++sizes_[labels[t]];
    for (const Index* u = graph.neighbours.begin(t); u != graph.neighbours.end(t); ++u)
      if (labels[*u] != labels[t]) ++contacts_[labels[t]][labels[*u]];
  }

  std::size_t vertices = 0;
  for (const Triangle& triangle : triangles)
    for (const Index v : triangle) vertices = std::max(vertices, v + std::size_t{1});
  table_ = edge_table(triangles, vertices);
  seen_.resize(table_.edges.size(), 0);
  edge_of_.resize(3 * triangles.size());
  for (std::size_t e = 0; e < table_.edges.size(); ++e)
    for (const std::size_t* h = table_.half_edges.begin(e); h != table_.half_edges.end(e); ++h) edge_of_[*h] = e;

  at_vertex_ = items_at_vertices<Index>(triangles, vertices);

  root_.resize(regions, kNone);
  std::vector<std::vector<Index>> members(regions);
  for (std::size_t t = 0; t < labels.size(); ++t) members[labels[t]].push_back(static_cast<Index>(t));
  for (Index r = 0; r < regions; ++r) settle(r, members[r]);
}

void RegionTopology::relabel(Index triangle, Index label) {
  const Index before = labels_[triangle];
  --sizes_[before];
  ++sizes_[label];
  labels_[triangle] = label;
  for (const Index* u = graph_.neighbours.begin(triangle); u != graph_.neighbours.end(triangle); ++u) {
    const Index other = labels_[*u];
    if (other != before) {
      forget(contacts_[before], other);
      forget(contacts_[other], before);
    }
    if (other != label) {
      ++contacts_[label][other];
      ++contacts_[other][label];
    }
  }
}

void RegionTopology::settle(Index region, const std::vector<Index>& triangles) {
  Index& root = root_[region];
  if (root == kNone || labels_[root] != region) root = innermost(region, triangles);
  if (root == kNone) return;
  for (const Index t : triangles)
    if (labels_[t] == region) tree_[t] = kNone;
  tree_[root] = region;
  parent_[root] = root;
  queue_.assign(1, root);
  for (std::size_t next = 0; next < queue_.size(); ++next) {
    const Index t = queue_[next];
    for (const Index* u = graph_.neighbours.begin(t); u != graph_.neighbours.end(t); ++u) {
      if (labels_[*u] != region || tree_[*u] == region) continue;
      tree_[*u] = region;
      parent_[*u] = t;
      queue_.push_back(*u);
    }
  }
}

// A triangle that takes most steps to the region's border, where it has one; kNone if the region is empty.
Index RegionTopology::innermost(Index region, const std::vector<Index>& triangles) {
  ++search_;
  queue_.clear();
  Index any = kNone;
  const auto reach = [&](Index t) {
    rooted_[t] = 2 * search_;
    queue_.push_back(t);
  };
  for (const Index t : triangles) {
    if (labels_[t] != region) continue;
    if (any == kNone) any = t;
    const Index *begin = graph_.neighbours.begin(t), *end = graph_.neighbours.end(t);
    if (end - begin < 3 || std::any_of(begin, end, [&](Index u) { return labels_[u] != region; })) reach(t);
  }
  for (std::size_t next = 0; next < queue_.size(); ++next)
    for (const Index* u = graph_.neighbours.begin(queue_[next]); u != graph_.neighbours.end(queue_[next]); ++u)
      if (labels_[*u] == region && rooted_[*u] != 2 * search_) reach(*u);
  return queue_.empty() ? any : queue_.back();
}

bool RegionTopology::is_rooted(Index triangle, Index region) {
  way_.clear();
  std::uint64_t answer = 2 * search_;
  for (Index t = triangle;; t = parent_[t]) {
    if (labels_[t] != region || tree_[t] != region) break;
    if (rooted_[t] / 2 == search_ || t == root_[region]) {
      answer = t == root_[region] ? 2 * search_ + 1 : rooted_[t];
      break;
    }
    way_.push_back(t);
  }
  for (const Index t : way_) rooted_[t] = answer;
  return answer % 2 == 1;
}

// Searches from all the region's triangles about the changes that have lost their way to its middle, until each has met
// one that has not, or the end. Where the middle itself has changed sides, until only one front is left that has met
// neither the others nor its end: what is behind the others are the crumbs.
std::vector<Index> RegionTopology::crumbs(Index region, const std::vector<Index>& changed) {
  std::vector<Index> found;  // also the queue
  const auto start = [&](Index t) {
    if (labels_[t] != region || front_[t] != kNone) return;
    front_[t] = static_cast<Index>(found.size());
    found.push_back(t);
  };
  for (const Index t : changed) start(t);
  const std::size_t joined = found.size();
  for (const Index t : changed)
    for (const Index* u = graph_.neighbours.begin(t); u != graph_.neighbours.end(t); ++u) start(*u);
  // The rest of the region is whole and a front of its own, always open: what has a way to the middle, or all where no
  // other triangle of the region is next to a change.
  const bool has_root = labels_[root_[region]] == region;
  const bool has_rest = has_root || (found.size() == joined && joined < sizes_[region]);
  ++search_;

  const std::size_t starts = found.size(), rest = starts;
  DisjointSets fronts(starts + 1);
  std::vector<std::size_t> queued(starts + 1, 1), size(starts + 1, 1);
  std::size_t open = starts + has_rest;
  const auto join = [&](std::size_t a, std::size_t b) {
    const std::size_t both = fronts.join(a, b), gone = a + b - both;
    queued[both] += queued[gone];
    size[both] += size[gone];
    --open;
    return both;
  };
  for (std::size_t f = joined; f < starts && has_root; ++f)
    if (is_rooted(found[f], region)) join(f, fronts.root(rest));
  for (std::size_t next = 0; next < found.size() && open > 1; ++next) {
    const Index t = found[next];
    std::size_t front = fronts.root(front_[t]);
    const auto is_rest = [&] { return has_rest && front == fronts.root(rest); };
    if (is_rest()) continue;
    for (const Index* u = graph_.neighbours.begin(t); u != graph_.neighbours.end(t) && !is_rest(); ++u) {
      if (labels_[*u] != region) continue;
      if (front_[*u] == kNone) {
        if (has_root && is_rooted(*u, region)) {
          front = join(front, fronts.root(rest));
          continue;
        }
        front_[*u] = static_cast<Index>(front);
        found.push_back(*u);
        ++queued[front];
        ++size[front];
        continue;
      }
      const std::size_t other = fronts.root(front_[*u]);
      if (other != front) front = join(front, other);
    }
    if (--queued[front] == 0) --open;
  }

  // Most of the region is behind the front that is still open, or is the largest part.
  const auto rank = [&](std::size_t front) { return std::pair(queued[front] > 0, size[front]); };
  std::size_t most = fronts.root(rest);
  if (!has_rest) {
    most = starts;
    for (std::size_t f = 0; f < starts; ++f)
      if (fronts.root(f) == f && (most == starts || rank(f) > rank(most))) most = f;
  }
  std::vector<Index> result;
  for (const Index t : found)
    if (fronts.root(front_[t]) != most) result.push_back(t);
  for (const Index t : found) front_[t] = kNone;
  return result;
}

std::vector<Index> RegionTopology::vertices_of(const std::vector<Index>& changed) const {
  std::vector<Index> vertices;
  for (const Index t : changed) vertices.insert(vertices.end(), triangles_[t].begin(), triangles_[t].end());
  sort_once(vertices);
  return vertices;
}

long long RegionTopology::local_euler(Index region, const std::vector<Index>& changed) {
  long long sum = 0;
  std::vector<std::size_t> edges;
  for (const Index t : changed) {
    sum += labels_[t] == region;
    for (std::size_t k = 0; k < 3; ++k) edges.push_back(edge_of_[3 * std::size_t{t} + k]);
  }
  sort_once(edges);
  for (const std::size_t edge : edges) sum -= triangles_at(edge, region) > 0;
  std::vector<Fan> fans;
  for (const Index v : vertices_of(changed)) sum += static_cast<long long>(find_fans(v, region, fans));
  return sum;
}

std::size_t RegionTopology::local_loops(Index region, const std::vector<Index>& changed) {
  std::vector<std::size_t> followed;
  std::vector<Fan> fans;
  std::size_t count = 0;
  for (const std::size_t start : border_edges_at(region, vertices_of(changed))) {
    if (seen_[start]) continue;
    ++count;
    std::vector<std::size_t> stack{start};
    while (!stack.empty()) {
      const std::size_t edge = stack.back();
      stack.pop_back();
      if (std::exchange(seen_[edge], 1)) continue;
      followed.push_back(edge);
      const std::size_t* h = table_.half_edges.begin(edge);
      while (labels_[*h / 3] != region) ++h;
      for (const Index v : table_.edges[edge]) {
        find_fans(v, region, fans);
        const auto mine = std::find_if(fans.begin(), fans.end(), [&](const Fan& f) { return f.triangle == *h / 3; });
        for (const Fan& fan : fans)
          if (fan.root == mine->root) add_border_edges(v, region, fan.triangle, stack);
      }
    }
  }
  for (const std::size_t edge : followed) seen_[edge] = 0;
  return count;
}

std::vector<std::vector<std::size_t>> RegionTopology::border_chains(Index region, const std::vector<Index>& changed) {
  const std::vector<Index> vertices = vertices_of(changed);
  const std::vector<std::size_t> edges = border_edges_at(region, vertices);
  DisjointSets sets(edges.size());
  std::vector<Fan> fans;
  std::vector<std::size_t> of_triangle, first;
  for (const Index v : vertices) {
    find_fans(v, region, fans);
    first.assign(fans.size(), edges.size());  // a border edge of each fan
    for (const Fan& fan : fans) {
      of_triangle.clear();
      add_border_edges(v, region, fan.triangle, of_triangle);
      for (const std::size_t edge : of_triangle) {
        const auto at = static_cast<std::size_t>(std::lower_bound(edges.begin(), edges.end(), edge) - edges.begin());
        if (first[fan.root] == edges.size()) first[fan.root] = at;
        else sets.join(first[fan.root], at);
      }
    }
  }
  // Edges with one end at the vertices are of no changed triangle, so they are the same before and after.
  std::vector<std::vector<std::size_t>> leaving(edges.size()), result;
  for (std::size_t i = 0; i < edges.size(); ++i) {
    const auto is_inside = [&](Index v) { return std::binary_search(vertices.begin(), vertices.end(), v); };
    const auto [a, b] = table_.edges[edges[i]];
    if (!is_inside(a) || !is_inside(b)) leaving[sets.root(i)].push_back(edges[i]);
  }
  for (std::size_t i = 0; i < edges.size(); ++i)
    if (sets.root(i) == i) result.push_back(std::move(leaving[i]));
  std::sort(result.begin(), result.end());
  return result;
}

// Ascending.
std::vector<std::size_t> RegionTopology::border_edges_at(Index region, const std::vector<Index>& vertices) const {
  std::vector<std::size_t> edges;
  for (const Index v : vertices)
    for (const Index* t = at_vertex_.begin(v); t != at_vertex_.end(v); ++t) add_border_edges(v, region, *t, edges);
  sort_once(edges);
  return edges;
}

// The region's triangles about a vertex, ascending, joined across the edges that end there; the number of fans.
std::size_t RegionTopology::find_fans(Index vertex, Index region, std::vector<Fan>& fans) {
  fans.clear();
  spokes_.clear();
  for (const Index* t = at_vertex_.begin(vertex); t != at_vertex_.end(vertex); ++t) {
    if (labels_[*t] != region || (!fans.empty() && fans.back().triangle == *t)) continue;
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t edge = edge_of_[3 * std::size_t{*t} + k];
      if (table_.edges[edge][0] == vertex || table_.edges[edge][1] == vertex) spokes_.push_back({edge, fans.size()});
    }
    fans.push_back({*t, fans.size()});
  }
  std::sort(spokes_.begin(), spokes_.end());
  const auto root = [&](std::size_t i) {
    while (fans[i].root != i) i = fans[i].root = fans[fans[i].root].root;
    return i;
  };
  std::size_t count = fans.size();
  for (std::size_t i = 1; i < spokes_.size(); ++i) {
    if (spokes_[i].first != spokes_[i - 1].first) continue;
    const std::size_t a = root(spokes_[i].second), b = root(spokes_[i - 1].second);
    count -= a != b;
    fans[std::max(a, b)].root = std::min(a, b);
  }
  for (std::size_t i = 0; i < fans.size(); ++i) fans[i].root = root(i);
  return count;
}

// The edges of a triangle of the region, if it is one, that end at a vertex and have no other triangle of the region.
void RegionTopology::add_border_edges(Index vertex, Index region, Index triangle,
                                      std::vector<std::size_t>& edges) const {
  if (labels_[triangle] != region) return;
  for (std::size_t k = 0; k < 3; ++k) {
    const std::size_t edge = edge_of_[3 * std::size_t{triangle} + k];
    const auto [a, b] = table_.edges[edge];
    if ((a == vertex || b == vertex) && triangles_at(edge, region) == 1) edges.push_back(edge);
  }
}

std::size_t RegionTopology::triangles_at(std::size_t edge, Index region) const {
  const std::size_t *begin = table_.half_edges.begin(edge), *end = table_.half_edges.end(edge);
  std::size_t count = 0;
  for (const std::size_t* h = begin; h != end; ++h)
    count += labels_[*h / 3] == region && (h == begin || *h / 3 != *(h - 1) / 3);
  return count;
}

}  // namespace bisector
