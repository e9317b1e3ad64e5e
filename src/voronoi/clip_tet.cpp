#include "voronoi/clip_tet.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "core/parallel.h"
#include "mesh/tet_adjacency.h"
#include "voronoi/error_bounds.h"
#include "voronoi/surface.h"

namespace bisector {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// Facets that meet in corner m, counter-clockwise seen from outside.
constexpr Index kCornerFacets[4][3] = {{1, 3, 2}, {0, 2, 3}, {0, 3, 1}, {0, 1, 2}};
// The two corners that are not in the set, by the bits of a set of two.
constexpr unsigned char kOtherCorners[13][2] = {{}, {}, {},     {2, 3}, {}, {1, 3}, {0, 3},
                                                {}, {}, {1, 2}, {0, 2}, {}, {0, 1}};
constexpr unsigned char kBefore[3] = {2, 0, 1}, kAfter[3] = {1, 2, 0};
constexpr Index kFirstSeedKey = 4;

}  // namespace

TetFrame::TetFrame(const std::array<Vec3, 4>& given, const Tetrahedron& ranks, const double* given_density,
                   double six_volume) {
  for (unsigned char k = 0; k < 4; ++k) {
    corners[k] = given[k];
    density[k] = given_density ? given_density[k] : 1.0;
    rank[k] = 0;
    for (unsigned char l = 0; l < 4; ++l) rank[k] = static_cast<unsigned char>(rank[k] + (ranks[l] < ranks[k]));
    order[rank[k]] = k;
  }
  for (int k = 0; k < 4; ++k) {
    unsigned char on[3];
    std::size_t n = 0;
    for (const unsigned char corner : order)
      if (corner != k) on[n++] = corner;
    anchor[k] = on[0];
    normals[k] = facet_normal(corners[on[0]], corners[on[1]], corners[on[2]]);
  }
  const unsigned char first = order[0];
  const int* others = kFacetCorners[first];
  const Vec3 a = corners[others[0]] - corners[first], b = corners[others[1]] - corners[first],
             c = corners[others[2]] - corners[first];
  const double r = density[first], ra = density[others[0]], rb = density[others[1]], rc = density[others[2]];
  if (given_density) {
    moments = scaled_terms<false>(tet_terms(a, b, c, r, ra, rb, rc, six_volume));
    gradient = (1 / six_volume) * ((ra - r) * cross(b, c) + (rb - r) * cross(c, a) + (rc - r) * cross(a, b));
    // So flat that it has no mass to speak of: what is clamped to the densities of the corners need not be right.
    if (!(max_coordinate(gradient) < 1e200)) gradient = {};
  } else {
    moments = scaled_terms<true>(tet_terms(a, b, c, six_volume));
  }
}

TetFrame enclosure_frame(const Solid& solid) { return {solid.enclosure, {0, 1, 2, 3}, nullptr, 0}; }

std::vector<TetFrame> tet_frames(const Solid& solid) {
  std::vector<TetFrame> frames(solid.mesh.tets.size());
  parallel_each(frames.size(), [&](std::size_t t) {
    if (!(solid.six_volumes[t] > 0)) return;
    const Tetrahedron& v = solid.mesh.tets[t];
    const auto& q = solid.mesh.vertices;
    double density[4];
    for (std::size_t m = 0; m < 4; ++m) density[m] = solid.density.empty() ? 1.0 : solid.density[v[m]];
    frames[t] = TetFrame({q[v[0]], q[v[1]], q[v[2]], q[v[3]]}, v, solid.density.empty() ? nullptr : density,
                         solid.six_volumes[t]);
  });
  return frames;
}

TetClipper::TetClipper() : planes_(64), starting_(64), ending_(64) { reserve(64); }

void TetClipper::reset(const SortedSeeds& seeds, const Neighbours& neighbours) {
  seeds_ = &seeds;
  neighbours_ = &neighbours;
  scale_ = screen_scale(seeds.extent);
}

void TetClipper::begin(Index slot) {
  slot_ = slot;
  seed_ = seeds_->x[slot];
  list_ = neighbours_->list(slot);
  shortened_ = false;
  loaded_ = 0;
}

void TetClipper::set_plane(Plane& plane, Index other) const {
  plane.n = seeds_->x[other] - seed_;
  plane.squared = norm2(plane.n);
  plane.k = 0.5 * plane.squared;
  plane.length = std::sqrt(plane.squared) * (1 + 4 * kUnit);
  plane.key = kFirstSeedKey + seeds_->id[other];
  plane.slot = other;
}

// Loads neighbours up to `count`, by blocks of four.
void TetClipper::load(std::size_t count) {
  const std::size_t listed = static_cast<std::size_t>(list_.end - list_.begin);
  if (listed_.size() < count + 4) listed_.resize(2 * (count + 4));
  if (blocks_.size() < count / 4 + 2) blocks_.resize(2 * (count / 4 + 2));
  for (; loaded_ < std::min(count, listed); loaded_ += 4) {
    ScreenBlock& block = blocks_[loaded_ / 4];
    for (std::size_t m = 0; m < 4; ++m) {
      if (loaded_ + m >= listed) {
        block.set_none(m);
        continue;
      }
      const Index other = list_.begin[loaded_ + m];
      Plane& plane = listed_[loaded_ + m];
      set_plane(plane, other);
      block.set(m, scale_ * plane.n, scale_ * scale_ * plane.k);
    }
  }
}

void TetClipper::reserve(std::size_t vertices) {
  if (vertices_.size() >= vertices) return;
  const std::size_t n = 2 * vertices;
  vertices_.resize(n);
  sides_.resize(n);
  removed_.resize(n);
  boundary_.resize(3 * n);
}

inline void TetClipper::set_vertex(Vertex& v, const Vec3& at, double slack) const {
  v.at = at;
  v.slack = slack;
  v.scaled[0] = static_cast<float>(scale_ * at.x);
  v.scaled[1] = static_cast<float>(scale_ * at.y);
  v.scaled[2] = static_cast<float>(scale_ * at.z);
}

inline void TetClipper::start(const TetFrame& tet) {
  tet_ = &tet;
  uncertain_ = wider_ = bounded_ = collected_ = labelled_ = false;
  largest_ = tet_squared_ = 0;
  for (int m = 0; m < 4; ++m) {
    local_[m] = tet.corners[m] - seed_;
    largest_ = std::max(largest_, max_coordinate(local_[m]));
    tet_squared_ = std::max(tet_squared_, norm2(local_[m]) * (1 + 1e-12));
  }
  for (Index k = 0; k < 4; ++k) {
    Plane& plane = planes_[k];
    plane.n = tet.normals[k];
    plane.k = dot(plane.n, local_[tet.anchor[k]]);
    plane.length = 1 + 64 * kUnit;
    plane.squared = 1;
    plane.key = Index{3} - tet.rank[k];
    plane.slot = kFacetLabel | k;
  }
  plane_count_ = 4;
  size_ = 4;
  for (Index m = 0; m < 4; ++m) {
    set_vertex(vertices_[m], local_[m], kCornerSlack * largest_);
    for (std::size_t e = 0; e < 3; ++e) {
      vertices_[m].on[e] = kCornerFacets[m][e];
      vertices_[m].adjacent[e] =
          kCornerFacets[m][e];  // leaving a facet along the edge of the other two leads to the corner opposite it
    }
  }
}

void TetClipper::take(const TetFrame& tet) { start(tet); }

// Which vertices are adjacent is not known then; moments are what needs it.
void TetClipper::take(const TetFrame& tet, const std::vector<Index>& labels,
                      const std::vector<std::array<Index, 3>>& triples) {
  start(tet);
  reserve(triples.size());
  if (planes_.size() < labels.size() + 4) planes_.resize(labels.size() + 4);
  std::vector<Index> planes;
  for (const Index label : labels) {
    planes.push_back(is_facet(label) ? label & ~kFacetLabel : static_cast<Index>(plane_count_));
    if (!is_facet(label)) set_plane(planes_[plane_count_++], label);
  }
  size_ = triples.size();
  for (Index v = 0; v < size_; ++v) {
    Vertex& vertex = vertices_[v];
    for (std::size_t e = 0; e < 3; ++e) vertex.on[e] = planes[triples[v][e]];
    if (std::max({vertex.on[0], vertex.on[1], vertex.on[2]}) < 4)
      set_vertex(vertex, local_[6 - vertex.on[0] - vertex.on[1] - vertex.on[2]], kCornerSlack * largest_);
    else place(vertex);
  }
}

// Cuts by the neighbours from k on that may cut, up to four of the `count` listed. False if the polyhedron is empty
// then.
inline bool TetClipper::cut_by_block(std::size_t k, std::size_t count) {
  if (k >= loaded_) load(k + 4);
  if (!bounded_) bound();
  const unsigned present = (1u << std::min<std::size_t>(4, count - k)) - 1;
  for (unsigned planes = planes_that_may_cut(blocks_[k / 4]) & present; planes; planes &= planes - 1) {
    const std::size_t neighbour = k + static_cast<unsigned>(std::countr_zero(planes));
    if (wider_ && bounded_by(list_.begin[neighbour])) continue;
    if (!cut(neighbour)) return false;
  }
  return true;
}

bool TetClipper::clip(const TetFrame& tet) {
  start(tet);
  for (;;) {
    const std::size_t count = static_cast<std::size_t>(list_.end - list_.begin);
    for (std::size_t k = 0; k < count; k += 4) {
      if (k >= loaded_) load(k + 4);
      if (!bounded_) bound();
      if (reach_.is_safe_from(blocks_[k / 4])) return true;
      if (!cut_by_block(k, count)) return false;
    }
    if (!bounded_) bound();
    if (list_.radius == kInfinity || reach_.is_safe_from(list_.radius * list_.radius)) return true;
    wider_ = true;
    widen();
  }
}

void TetClipper::shorten(std::size_t most) {
  if (static_cast<std::size_t>(list_.end - list_.begin) <= most) return;
  shortened_ = true;
  unshortened_ = list_;
  list_.end = list_.begin + most;
  // Those that follow are as far, or farther by what sorting may have missed.
  list_.radius = std::min(list_.radius, (1 - 1e-9) * norm(seeds_->x[*list_.end] - seed_));
}

void TetClipper::widen() {
  if (shortened_) list_ = unshortened_;
  else list_ = neighbours_->wider(slot_, list_);
  shortened_ = false;
  loaded_ = 0;
}

void TetClipper::cut_by_listed(const TetFrame& around) {
  start(around);
  const std::size_t count = static_cast<std::size_t>(list_.end - list_.begin);
  for (std::size_t k = 0; k < count; k += 4)
    if (!cut_by_block(k, count)) return;
}

bool TetClipper::lists_all() const { return list_.radius == kInfinity; }

bool TetClipper::is_certain(std::size_t v) const {
  const Reach reach(norm2(vertices_[v].at), vertices_[v].slack, tet_squared_, scale_);
  return lists_all() || reach.is_safe_from(list_.radius * list_.radius);
}

void TetClipper::narrow(const TetFrame& around) {
  cut_by_listed(around);
  if (size_ == 0) return;
  collect();
  std::sort(bounding_.begin(), bounding_.end(), [&](Index a, Index b) {
    return planes_[a].squared != planes_[b].squared ? planes_[a].squared < planes_[b].squared
                                                    : planes_[a].key < planes_[b].key;
  });
  narrowed_.clear();
  for (const Index plane : bounding_)
    if (plane >= 4) narrowed_.push_back(planes_[plane].slot);
  list_.begin = narrowed_.data();
  list_.end = narrowed_.data() + narrowed_.size();
  loaded_ = 0;
}

inline unsigned TetClipper::planes_that_may_cut(const ScreenBlock& block) const {
  return may_cut(block, reach_.margin, [&](const auto& test) {
    for (const Vertex *v = vertices_.data(), *end = v + size_; v != end; ++v)
      test(v->scaled[0], v->scaled[1], v->scaled[2]);
  });
}

inline void TetClipper::bound() {
  bounded_ = true;
  double squared = 0, slack = 0;
  for (const Vertex *v = vertices_.data(), *end = v + size_; v != end; ++v) {
    slack = std::max(slack, v->slack);
    squared = std::max(squared, norm2(v->at));
  }
  reach_ = Reach(squared, slack, tet_squared_, scale_);
}

bool TetClipper::bounded_by(Index slot) const {
  for (std::size_t v = 0; v < size_; ++v)
    for (const Index plane : vertices_[v].on)
      if (planes_[plane].slot == slot) return true;
  return false;
}

// Decides for every vertex on which side it is; lists those outside in removed_.
inline std::size_t TetClipper::count_outside(const Plane& by) {
  const double one_norm = taxicab(by.n);
  const BisectorLimits limits(by.k);
  signed char* sides = sides_.data();
  Index* removed = removed_.data();
  std::size_t count = 0;
  bool certain = true;
  for (std::size_t v = 0; v < size_; ++v) {
    const Vertex& vertex = vertices_[v];
    const double along = dot(vertex.at, by.n), error = vertex.slack * one_norm;
    const bool inside = along + error<limits.before, outside = along - error> limits.behind;
    certain &= inside | outside;
    sides[v] = static_cast<signed char>(inside - outside);
    removed[count] = static_cast<Index>(v);
    count += outside;
  }
  if (certain) return count;
  uncertain_ = true;
  count = 0;
  for (std::size_t v = 0; v < size_; ++v) {
    const Vertex& vertex = vertices_[v];
    if (sides[v] == 0)
      sides[v] =
          static_cast<signed char>(exact_side(frame(), exact(planes_[vertex.on[0]]), exact(planes_[vertex.on[1]]),
                                              exact(planes_[vertex.on[2]]), exact(by)));
    if (sides[v] < 0) removed[count++] = static_cast<Index>(v);
  }
  return count;
}

// Cuts by one neighbour. False if the polyhedron is empty then.
bool TetClipper::cut(std::size_t neighbour) {
  const Plane& by = listed_[neighbour];
  const std::size_t outside = count_outside(by);
  if (outside == 0) return true;
  if (outside == size_) {
    size_ = 0;
    return false;
  }
  bounded_ = false;
  if (planes_.size() == plane_count_) {
    planes_.resize(2 * plane_count_);
  }
  if (starting_.size() < planes_.size()) {
    starting_.resize(planes_.size());
    ending_.resize(planes_.size());
  }
  const Index plane = static_cast<Index>(plane_count_++);
  planes_[plane] = by;

  // The edges that leave what is outside. Each end outside has the edge's planes in the order that its new end will
  // have.
  Boundary* boundary = boundary_.data();
  std::size_t fresh = 0;
  for (std::size_t k = 0; k < outside; ++k) {
    const Index t = removed_[k];
    const Vertex& vertex = vertices_[t];
    for (std::size_t e = 0; e < 3; ++e) {
      const Index inside = vertex.adjacent[e];
      const Vertex& other = vertices_[inside];
      const std::uint64_t place = std::uint64_t{other.adjacent[1] == t} + 2 * std::uint64_t{other.adjacent[2] == t};
      boundary[fresh].planes = vertex.on[e == 2 ? 0 : e + 1] | std::uint64_t{vertex.on[e == 0 ? 2 : e - 1]} << 32;
      boundary[fresh].inside = inside | place << 32;
      fresh += sides_[inside] > 0;
    }
  }
  // New vertices take the places of those removed, then further ones.
  const std::size_t before = size_;
  if (fresh > outside) {
    reserve(size_ += fresh - outside);
    boundary = boundary_.data();
  }
  const auto place_of = [&](std::size_t k) {
    return k < outside ? removed_[k] : static_cast<Index>(before + k - outside);
  };
  for (std::size_t k = 0; k < fresh; ++k) starting_[boundary[k].u()] = ending_[boundary[k].v()] = place_of(k);
  for (std::size_t k = 0; k < fresh; ++k) {
    const Index u = boundary[k].u(), v = boundary[k].v(), at = place_of(k);
    const Index inside = static_cast<Index>(boundary[k].inside);
    Vertex& vertex = vertices_[at];
    vertex.on[0] = u;
    vertex.on[1] = v;
    vertex.on[2] = plane;
    vertex.adjacent[0] = starting_[v];
    vertex.adjacent[1] = ending_[u];
    vertex.adjacent[2] = inside;
    vertices_[inside].adjacent[boundary[k].inside >> 32] = at;
    place(vertex);
  }
  for (std::size_t k = outside; k-- > fresh;) erase(removed_[k]);
  return true;
}

// Puts the last vertex in its place.
void TetClipper::erase(Index v) {
  const Index last = static_cast<Index>(--size_);
  if (v == last) return;
  vertices_[v] = vertices_[last];
  for (const Index next : vertices_[v].adjacent)
    for (Index& back : vertices_[next].adjacent)
      if (back == last) back = v;
}

inline void TetClipper::place(Vertex& v) {
  // By key; planes of one vertex have different keys.
  const auto keyed = [&](Index plane) { return std::uint64_t{planes_[plane].key} << 32 | plane; };
  const std::uint64_t p = keyed(v.on[0]), q = keyed(v.on[1]), r = keyed(v.on[2]);
  const std::uint64_t low = std::min(p, q), high = std::max(p, q);
  const Index a = static_cast<Index>(std::min(low, r)), c = static_cast<Index>(std::max(high, r));
  const Index b = static_cast<Index>(std::max(low, std::min(high, r)));
  if (a >= 4) place_at_planes(v, planes_[a], planes_[b], planes_[c]);
  else if (b >= 4) place_on_facet(v, planes_[a], planes_[b], planes_[c]);
  else place_on_edge(v, planes_[a], planes_[b], planes_[c]);
}

// The edge is q_0 + t e, from its first end in order, and t = (k - n . q_0) / (n . e). All data are within the
// tetrahedron's distance P of the seed, so with rounded data and operations t is off by less than 20 u P |n| / |n . e|.
inline void TetClipper::place_on_edge(Vertex& v, const Plane& f, const Plane& g, const Plane& bisector) {
  // The facets opposite two corners meet along the edge of the other two.
  const unsigned pair = (1u << (f.slot & ~kFacetLabel)) | (1u << (g.slot & ~kFacetLabel));
  unsigned ends[2] = {kOtherCorners[pair][0], kOtherCorners[pair][1]};
  if (tet_->rank[ends[1]] < tet_->rank[ends[0]]) std::swap(ends[0], ends[1]);
  const Vec3 e = tet_->corners[ends[1]] - tet_->corners[ends[0]];
  const double slope = dot(bisector.n, e);
  if (!(slope * slope > kSteep * (bisector.squared * norm2(e)))) return place_exactly(v, f, g, bisector);
  const double inverse = 1 / slope;
  const double t = inverse * (bisector.k - dot(bisector.n, local_[ends[0]]));
  set_vertex(v, local_[ends[0]] + t * e, 200 * kUnit * largest_ * (bisector.length * taxicab(e) * std::abs(inverse)));
}

// As Clipper::meet: in the facet's plane with origin at the seed's foot, where the bisectors are the lines with the
// directions t = n x m, which cross at (c_b t_a - c_a t_b) / (t_a . m_b). Data and operations are those bounded there.
// However small the angle, the vertex stays in the facet.
inline void TetClipper::place_on_facet(Vertex& v, const Plane& f, const Plane& a, const Plane& b) {
  const Vec3 along_a = cross(f.n, a.n), along_b = cross(f.n, b.n);
  const double determinant = dot(along_a, b.n);
  const double square = determinant * determinant, squares = a.squared * b.squared;
  if (!(square > kSteep * squares)) return place_exactly(v, f, a, b);
  const double inverse = 1 / determinant;
  const double offset_a = a.k - f.k * dot(f.n, a.n), offset_b = b.k - f.k * dot(f.n, b.n);
  Vec3 w = inverse * (offset_b * along_a - offset_a * along_b);
  if (!(square > kShallow * squares)) {
    // The determinant's error takes w off both lines; what is left then is an error along them, which hardly changes a
    // volume.
    const double left_a = offset_a - dot(cross(along_a, f.n), w), left_b = offset_b - dot(cross(along_b, f.n), w);
    w += inverse * (left_b * along_a - left_a * along_b);
  }
  set_vertex(v, f.k * f.n + w, 2000 * kUnit * largest_ * (a.length * b.length * std::abs(inverse)));
}

// Cramer's rule. All data are within the tetrahedron's distance P of the seed, and with rounded data and operations
// each term of the numerator is off by less than 20 u P |a| |b| |c| and the determinant by 20 u |a| |b| |c|, which
// bounds the error of the quotient as coded.
inline void TetClipper::place_at_planes(Vertex& v, const Plane& a, const Plane& b, const Plane& c) {
  const Vec3 bc = cross(b.n, c.n), ca = cross(c.n, a.n), ab = cross(a.n, b.n);
  const double determinant = dot(a.n, bc);
  const double square = determinant * determinant, squares = a.squared * b.squared * c.squared;
  if (!(square > kSteep * squares)) return place_exactly(v, a, b, c);
  const double inverse = 1 / determinant;
  Vec3 p = inverse * (a.k * bc + b.k * ca + c.k * ab);
  if (!(square > kShallow * squares)) {
    // The rounding of the determinant and the products takes p off the planes; what is left then is an error along
    // them, which hardly changes a volume.
    const double left_a = a.k - dot(a.n, p), left_b = b.k - dot(b.n, p), left_c = c.k - dot(c.n, p);
    p += inverse * (left_a * bc + left_b * ca + left_c * ab);
  }
  set_vertex(v, p, 400 * kUnit * largest_ * (a.length * b.length * c.length * std::abs(inverse)));
}

void TetClipper::place_exactly(Vertex& v, const Plane& a, const Plane& b, const Plane& c) {
  set_vertex(v, exact_vertex(frame(), exact(a), exact(b), exact(c)), kExactSlack * largest_);
}

ExactTetFrame TetClipper::frame() const {
  return {{tet_->corners[0], tet_->corners[1], tet_->corners[2], tet_->corners[3]}, seed_, seeds_->id[slot_]};
}

ExactPlane TetClipper::exact(const Plane& plane) const {
  if (is_facet(plane.slot)) return ExactPlane::tet_facet(static_cast<int>(plane.slot & ~kFacetLabel));
  return ExactPlane::bisector(seeds_->x[plane.slot], seeds_->id[plane.slot]);
}

// The planes that bound the polyhedron, by their keys, and a vertex on each.
void TetClipper::collect() {
  if (collected_) return;
  collected_ = true;
  a_vertex_.assign(plane_count_, kNone);
  for (Index v = 0; v < size_; ++v)
    for (const Index plane : vertices_[v].on) a_vertex_[plane] = v;
  bounding_.clear();
  for (Index plane = 0; plane < plane_count_; ++plane) {
    if (a_vertex_[plane] == kNone) continue;
    bounding_.push_back(plane);
    std::size_t k = bounding_.size() - 1;
    for (; k > 0 && planes_[bounding_[k - 1]].key > planes_[plane].key; --k) bounding_[k] = bounding_[k - 1];
    bounding_[k] = plane;
  }
}

const std::vector<Index>& TetClipper::labels() {
  collect();
  if (labelled_) return labels_;
  labelled_ = true;
  position_.resize(std::max(position_.size(), plane_count_));
  labels_.clear();
  for (const Index plane : bounding_)
    if (plane >= 4) {
      position_[plane] = static_cast<Index>(labels_.size());
      labels_.push_back(planes_[plane].slot);
    }
  for (Index plane = 0; plane < 4; ++plane)
    if (a_vertex_[plane] != kNone) {
      position_[plane] = static_cast<Index>(labels_.size());
      labels_.push_back(planes_[plane].slot);
    }
  return labels_;
}

std::array<Index, 3> TetClipper::triple(std::size_t v) {
  labels();
  const Index* on = vertices_[v].on;
  const Index a = position_[on[0]], b = position_[on[1]], c = position_[on[2]];
  if (a < b && a < c) return {a, b, c};
  return b < c ? std::array<Index, 3>{b, c, a} : std::array<Index, 3>{c, a, b};
}

double TetClipper::density(const Vertex& v) const {
  const double* r = tet_->density;
  const Index* on = v.on;
  if (on[0] < 4 && on[1] < 4 && on[2] < 4) return r[6 - on[0] - on[1] - on[2]];
  const unsigned first = tet_->order[0];
  const double value = r[first] + dot(tet_->gradient, v.at - local_[first]);
  return std::min(std::max(value, std::min({r[0], r[1], r[2], r[3]})), std::max({r[0], r[1], r[2], r[3]}));
}

// Tetrahedra from one vertex, the apex, to the triangles that each facet is fanned into from where its edge with the
// least key starts; the apex is where the first facet's fan starts. Facets in order of their keys.
template <bool kUniform>
Moments TetClipper::integrate() {
  if (whole()) return moved(tet_->moments, local_[tet_->order[0]]);
  collect();
  if (relative_.size() < size_) {
    relative_.resize(vertices_.size());
    polygon_.resize(vertices_.size());
  }
  if constexpr (!kUniform) {
    densities_.resize(std::max(densities_.size(), size_));
    for (Index v = 0; v < size_; ++v) densities_[v] = density(vertices_[v]);
  }
  Index apex = kNone, at_apex[3] = {kNone, kNone, kNone};
  Moments sum;
  for (const Index plane : bounding_) {
    if (plane == at_apex[0] || plane == at_apex[1] || plane == at_apex[2]) continue;
    std::size_t n = 0, start_at = 0;
    Index least = kNone;
    Index v = a_vertex_[plane];
    do {
      const Vertex& vertex = vertices_[v];
      const std::size_t here = std::size_t{vertex.on[1] == plane} + 2 * std::size_t{vertex.on[2] == plane};
      // The edge that starts here, counter-clockwise seen from outside, is that with the plane before this one.
      const Index key = planes_[vertex.on[kBefore[here]]].key;
      start_at = key < least ? n : start_at;
      least = std::min(key, least);
      polygon_[n++] = v;
      v = vertex.adjacent[kAfter[here]];
    } while (v != polygon_[0]);
    if (apex == kNone) {
      apex = polygon_[start_at];
      std::copy_n(vertices_[apex].on, 3, at_apex);
      const Vec3 origin = vertex(apex);
      for (std::size_t k = 0; k < size_; ++k) relative_[k] = vertex(k) - origin;
      continue;
    }
    const auto next = [n](std::size_t k) { return k + 1 == n ? 0 : k + 1; };
    const Index a = polygon_[start_at];
    for (std::size_t k = next(start_at), l = next(k); l != start_at; k = l, l = next(l)) {
      const Index b = polygon_[k], c = polygon_[l];
      const Vec3 &p = relative_[a], &q = relative_[b], &r = relative_[c];
      const double six_volume = dot(p, cross(q, r));
      if constexpr (kUniform) sum += tet_terms(p, q, r, six_volume);
      else sum += tet_terms(p, q, r, densities_[apex], densities_[a], densities_[b], densities_[c], six_volume);
    }
  }
  return moved(scaled_terms<kUniform>(sum), vertex(apex));
}

template Moments TetClipper::integrate<true>();
template Moments TetClipper::integrate<false>();

}  // namespace bisector
