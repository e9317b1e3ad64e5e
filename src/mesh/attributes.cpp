#include "bisector/attributes.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <string_view>
#include <unordered_set>
#include <utility>

#include "core/geometry.h"
#include "core/parallel.h"
#include "mesh/attribute_sizes.h"
#include "mesh/locate.h"
#include "mesh/tet_adjacency.h"
#include "mesh/tet_topology.h"
#include "mesh/topology.h"
#include "spatial/nearest.h"

namespace bisector {

namespace {

using Site = Attribute::Site;

// Of points between two looks at whether the run is cancelled.
constexpr std::size_t kAtOnce = 65536;

template <class Body>
void each_cancellable(std::size_t n, const Context& context, const Body& body) {
  for (std::size_t begin = 0; begin < n; begin += kAtOnce) {
    context.check();
    parallel_each(std::min(kAtOnce, n - begin), [&](std::size_t i) { body(begin + i); });
  }
}

// The weights of corner k.
template <std::size_t N>
std::array<double, N> all_at(std::size_t k) {
  std::array<double, N> weights{};
  weights[k] = 1;
  return weights;
}

// Barycentric coordinates of a point of a triangle by the areas opposite to its corners.
std::array<double, 3> weights_in(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) {
  for (const Vec3* corner : {&a, &b, &c})
    if (p == *corner) return all_at<3>(corner == &a ? 0 : corner == &b ? 1 : 2);
  const Vec3 normal = twice_area_normal(a, b, c);
  std::array<double, 3> w{dot(normal, twice_area_normal(p, b, c)), dot(normal, twice_area_normal(p, c, a)),
                          dot(normal, twice_area_normal(p, a, b))};
  for (double& x : w) x = std::max(x, 0.0);
  const double sum = w[0] + w[1] + w[2];
  if (!(sum > 0 && std::isfinite(sum))) {  // a needle whose areas are lost to rounding
    const std::array<double, 3> d{norm2(p - a), norm2(p - b), norm2(p - c)};
    return all_at<3>(static_cast<std::size_t>(std::min_element(d.begin(), d.end()) - d.begin()));
  }
  for (double& x : w) x /= sum;
  return w;
}

std::array<Vec3, 3> corners_of(const TriangleMesh& mesh, std::size_t t) {
  const Triangle& v = mesh.triangles[t];
  return {mesh.vertices[v[0]], mesh.vertices[v[1]], mesh.vertices[v[2]]};
}

std::vector<Vec3> centroids(const TriangleMesh& mesh) {
  std::vector<Vec3> points(mesh.triangles.size());
  parallel_each(points.size(), [&](std::size_t t) {
    const auto [a, b, c] = corners_of(mesh, t);
    points[t] = (1.0 / 3) * (a + b + c);
  });
  return points;
}

std::vector<Vec3> centroids(const TetMesh& mesh) {
  std::vector<Vec3> points(mesh.tets.size());
  parallel_each(points.size(), [&](std::size_t t) {
    for (const Index v : mesh.tets[t]) points[t] += 0.25 * mesh.vertices[v];
  });
  return points;
}

template <std::size_t N>
std::size_t greatest(const std::array<double, N>& weights) {
  return static_cast<std::size_t>(std::max_element(weights.begin(), weights.end()) - weights.begin());
}

// The numbers of one element, of those of its corners. `first(k)`: where the values of corner k begin.
template <std::size_t N, class First>
void interpolate(const Attribute& from, const std::array<double, N>& weights, const First& first, double* to) {
  const AttributeMeaning meaning = meaning_of(from);
  if (!has_fractions(from) && meaning != AttributeMeaning::colour) {
    const double* values = from.values.data() + first(greatest(weights));
    std::copy(values, values + from.components, to);
    return;
  }
  for (std::size_t c = 0; c < from.components; ++c) {
    double sum = 0;
    // A corner without weight does not count, for its number may be none.
    for (std::size_t k = 0; k < N; ++k)
      if (weights[k] > 0) sum += weights[k] * from.values[first(k) + c];
    to[c] = has_fractions(from) ? sum : std::round(sum);
  }
  if (meaning != AttributeMeaning::normal) return;
  const Vec3 direction = unit({to[0], to[1], to[2]});
  for (int k = 0; k < 3; ++k) to[k] = direction[k];
}

Attribute like(const Attribute& from, Site site, std::size_t sites) {
  return {from.name, site, from.type, from.components, std::vector<double>(from.components * sites)};
}

// Attributes of vertices at places in elements of N corners.
template <std::size_t N>
Attribute carry_vertices(const Attribute& from, const std::vector<std::array<Index, N>>& elements,
                         const std::vector<Index>& element, const std::vector<std::array<double, N>>& weights) {
  Attribute to = like(from, Site::vertex, element.size());
  const std::size_t n = from.components;
  parallel_each(element.size(), [&](std::size_t i) {
    interpolate(
        from, weights[i], [&](std::size_t k) { return n * elements[element[i]][k]; }, to.values.data() + n * i);
  });
  return to;
}

// Numbers of corners, which may be those of vertices.
struct CornerValues {
  const Attribute* attribute;
  const std::vector<Triangle>* triangles;

  std::size_t first(std::size_t t, std::size_t k) const {
    return attribute->components * (attribute->site == Site::corner ? 3 * t + k : (*triangles)[t][k]);
  }
  bool same(std::size_t t, std::size_t k, std::size_t u, std::size_t l) const {
    const double *a = attribute->values.data() + first(t, k), *b = attribute->values.data() + first(u, l);
    return std::equal(a, a + attribute->components, b);
  }
};

// For each side 3 t + k of a triangle, from corner k to the next, the triangle on the other side, if the numbers agree
// along it; else, at seams and borders and where more triangles meet, kNone.
std::vector<Index> find_neighbours(const TriangleMesh& mesh, const std::vector<CornerValues>& values) {
  std::vector<Index> neighbours(3 * mesh.triangles.size(), kNone);
  const auto corner_at = [&](std::size_t t, Index vertex) {
    const Triangle& v = mesh.triangles[t];
    return static_cast<std::size_t>(std::find(v.begin(), v.end(), vertex) - v.begin());
  };
  const EdgeTable table = edge_table(mesh.triangles, mesh.vertices.size());
  for (std::size_t e = 0; e < table.edges.size(); ++e) {
    if (table.half_edges.size(e) != 2) continue;
    const std::size_t a = table.half_edges.begin(e)[0], b = table.half_edges.begin(e)[1], t = a / 3, u = b / 3;
    const bool joined = std::all_of(values.begin(), values.end(), [&](const CornerValues& v) {
      return std::all_of(table.edges[e].begin(), table.edges[e].end(),
                         [&](Index end) { return v.same(t, corner_at(t, end), u, corner_at(u, end)); });
    });
    if (!joined) continue;
    neighbours[a] = static_cast<Index>(u);
    neighbours[b] = static_cast<Index>(t);
  }
  return neighbours;
}

// Whether vertices at one place have other values.
bool differs_at_doubles(const TriangleMesh& mesh, const Attribute& attribute) {
  std::vector<Index> order(mesh.vertices.size());
  std::iota(order.begin(), order.end(), Index{0});
  const auto place = [&](Index v) {
    const Vec3& p = mesh.vertices[v];
    return std::array{p.x, p.y, p.z};
  };
  sort_in_parallel(order, [&](Index a, Index b) { return std::pair(place(a), a) < std::pair(place(b), b); });
  const std::size_t n = attribute.components;
  for (std::size_t i = 1; i < order.size(); ++i) {
    const Index a = order[i - 1], b = order[i];
    if (mesh.vertices[a] == mesh.vertices[b] &&
        !std::equal(attribute.values.begin() + static_cast<std::ptrdiff_t>(n * a),
                    attribute.values.begin() + static_cast<std::ptrdiff_t>(n * (a + 1)),
                    attribute.values.begin() + static_cast<std::ptrdiff_t>(n * b)))
      return true;
  }
  return false;
}

// Where the corners of a mesh's triangles lie on another one, those of a triangle on the same side of all seams: on
// what can be reached from the place of its centroid without crossing one, within a ball about it.
class CornerPlaces {
 public:
  CornerPlaces(const TriangleMesh& from, const std::vector<Index>& neighbours, const SurfaceMap& map,
               const TriangleMesh& to)
      : from_(from), neighbours_(neighbours), map_(map),
        to_(to), places_{std::vector<Index>(3 * to.triangles.size()),
                         std::vector<std::array<double, 3>>(3 * to.triangles.size())} {}

  SurfaceMap find(const std::vector<Index>& nearest_to_centroids, const Context& context) {
    ThreadLocal<std::vector<Index>> reached;
    each_cancellable(to_.triangles.size(), context, [&](std::size_t t) {
      std::vector<Index>& patch = reached.local();
      reach(t, nearest_to_centroids[t], patch);
      for (std::size_t k = 0; k < 3; ++k) place(t, k, patch);
    });
    return std::move(places_);
  }

 private:
  // The triangles, in the order of their numbers.
  void reach(std::size_t t, Index start, std::vector<Index>& patch) const {
    constexpr double kReach = 1.5;  // of the farthest corner: a bent surface is longer than its chord
    const auto [a, b, c] = corners_of(to_, t);
    const Vec3 centre = (1.0 / 3) * (a + b + c);
    const double farthest = std::max({norm2(a - centre), norm2(b - centre), norm2(c - centre)});
    const double limit = kReach * kReach * farthest;
    std::unordered_set<Index> known{start};
    patch.assign(1, start);
    for (std::size_t i = 0; i < patch.size(); ++i)
      for (std::size_t k = 0; k < 3; ++k) {
        const Index next = neighbours_[3 * std::size_t{patch[i]} + k];
        if (next == kNone || !known.insert(next).second) continue;
        const auto [p, q, r] = corners_of(from_, next);
        if (norm2(nearest_on_triangle(centre, p, q, r) - centre) <= limit) patch.push_back(next);
      }
    std::sort(patch.begin(), patch.end());
  }

  void place(std::size_t t, std::size_t k, const std::vector<Index>& patch) {
    const Index v = to_.triangles[t][k];
    const std::size_t corner = 3 * t + k;
    if (std::binary_search(patch.begin(), patch.end(), map_.triangles[v])) {
      places_.triangles[corner] = map_.triangles[v];
      places_.weights[corner] = map_.weights[v];
      return;
    }
    const Vec3& p = to_.vertices[v];
    double least = std::numeric_limits<double>::infinity();
    for (const Index u : patch) {
      const auto [a, b, c] = corners_of(from_, u);
      const Vec3 q = nearest_on_triangle(p, a, b, c);
      const double distance = norm2(q - p);
      if (!(distance < least)) continue;
      least = distance;
      places_.triangles[corner] = u;
      places_.weights[corner] = weights_in(q, a, b, c);
    }
  }

  const TriangleMesh& from_;
  const std::vector<Index>& neighbours_;
  const SurfaceMap& map_;
  const TriangleMesh& to_;
  SurfaceMap places_;
};

Attribute carry_corners(const CornerValues& from, const SurfaceMap& places) {
  Attribute to = like(*from.attribute, Site::corner, places.triangles.size());
  parallel_each(places.triangles.size(), [&](std::size_t i) {
    interpolate(
        *from.attribute, places.weights[i], [&](std::size_t k) { return from.first(places.triangles[i], k); },
        to.values.data() + to.components * i);
  });
  return to;
}

void check_map(std::size_t places, std::size_t weights, std::size_t vertices) {
  if (places != vertices || weights != vertices)
    throw Error(fmt::format("a map of {} places and {} weights is not one of {} vertices", places, weights, vertices));
}

}  // namespace

AttributeMeaning meaning_of(const Attribute& attribute) {
  std::string name;
  for (const char c : attribute.name) {
    if (c == ' ' || c == '-' || c == '_') continue;
    name += c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  }
  const auto is_one_of = [&](std::initializer_list<std::string_view> names) {
    return std::find(names.begin(), names.end(), name) != names.end();
  };
  const bool colours = has_fractions(attribute) || attribute.type == Attribute::Type::uint8;
  if (colours && (attribute.components == 3 || attribute.components == 4) &&
      is_one_of({"color", "colors", "rgb", "rgba"}))
    return AttributeMeaning::colour;
  if (!has_fractions(attribute)) return AttributeMeaning::other;
  if (attribute.components == 3 && is_one_of({"normal", "normals"})) return AttributeMeaning::normal;
  if (attribute.components == 2 && is_one_of({"texcoord", "uv", "tcoords", "texturecoordinates"}))
    return AttributeMeaning::texture;
  return AttributeMeaning::other;
}

namespace {

// The facets of one tetrahedron, and which one that is.
struct Boundary {
  TriangleMesh surface;
  std::vector<Index> tets;
};

Boundary boundary_of(const TetMesh& solid) {
  Boundary boundary{{solid.vertices, boundary_facets(solid.tets)}, {}};
  const std::vector<Triangle>& facets = boundary.surface.triangles;
  boundary.tets.reserve(facets.size());
  for (std::size_t t = 0; t < solid.tets.size(); ++t)
    for (int k = 0; k < 4 && boundary.tets.size() < facets.size(); ++k)
      if (facet_of(solid.tets[t], k) == facets[boundary.tets.size()]) boundary.tets.push_back(static_cast<Index>(t));
  return boundary;
}

}  // namespace

SurfaceMap map_to_surface(const std::vector<Vec3>& points, const TriangleMesh& surface, const Context& context) {
  const NearestOnMesh nearest(surface);
  SurfaceMap map{std::vector<Index>(points.size()), std::vector<std::array<double, 3>>(points.size())};
  each_cancellable(points.size(), context, [&](std::size_t i) {
    const NearestPoint found = nearest.nearest(points[i]);
    const auto [a, b, c] = corners_of(surface, found.triangle);
    map.triangles[i] = found.triangle;
    map.weights[i] = weights_in(found.point, a, b, c);
  });
  return map;
}

SolidMap map_to_solid(const std::vector<Vec3>& points, const TetMesh& solid, const Context& context) {
  if (solid.tets.empty()) throw Error("there are no tetrahedra to find points in");
  constexpr double kOutside = -1e-12;  // of a weight; rounding makes smaller ones
  const TetLocator locator(solid);
  SolidMap map{std::vector<Index>(points.size()), std::vector<std::array<double, 4>>(points.size())};
  std::vector<char> outside(points.size(), 0);
  each_cancellable(points.size(), context, [&](std::size_t i) {
    map.tets[i] = locator.nearest(points[i]);
    map.weights[i] = locator.weights(map.tets[i], points[i]);
    outside[i] = !(*std::min_element(map.weights[i].begin(), map.weights[i].end()) >= kOutside);
    double sum = 0;
    for (double& w : map.weights[i]) sum += w = std::max(w, 0.0);
    for (double& w : map.weights[i]) w /= sum;
    const Tetrahedron& corners = solid.tets[map.tets[i]];
    for (std::size_t k = 0; k < 4; ++k)
      if (solid.vertices[corners[k]] == points[i]) map.weights[i] = all_at<4>(k);
  });
  if (std::find(outside.begin(), outside.end(), 1) == outside.end()) return map;
  const Boundary boundary = boundary_of(solid);
  const NearestOnMesh nearest(boundary.surface);
  each_cancellable(points.size(), context, [&](std::size_t i) {
    if (!outside[i]) return;
    const NearestPoint found = nearest.nearest(points[i]);
    const auto [a, b, c] = corners_of(boundary.surface, found.triangle);
    const std::array<double, 3> w = weights_in(found.point, a, b, c);
    map.tets[i] = boundary.tets[found.triangle];
    map.weights[i] = {};
    const Tetrahedron& corners = solid.tets[map.tets[i]];
    for (std::size_t k = 0; k < 3; ++k) {
      const auto at = std::find(corners.begin(), corners.end(), boundary.surface.triangles[found.triangle][k]);
      map.weights[i][static_cast<std::size_t>(at - corners.begin())] = w[k];
    }
  });
  return map;
}

std::vector<Attribute> carried_attributes(const TriangleMesh& from) {
  std::vector<Attribute> carried;
  for (const Attribute& attribute : from.attributes) {
    const bool seams = attribute.site == Site::vertex && meaning_of(attribute) == AttributeMeaning::texture &&
                       differs_at_doubles(from, attribute);
    carried.push_back({attribute.name, seams ? Site::corner : attribute.site, attribute.type, attribute.components});
  }
  return carried;
}

void carry_attributes(const TriangleMesh& from, const SurfaceMap& map, TriangleMesh& to, const Context& context) {
  check_map(map.triangles.size(), map.weights.size(), to.vertices.size());
  check_attributes(from);
  std::vector<Attribute> carried = carried_attributes(from);
  std::vector<CornerValues> corners;
  std::vector<std::size_t> corner_slots;
  bool of_elements = false;
  for (std::size_t i = 0; i < carried.size(); ++i) {
    const Attribute& attribute = from.attributes[i];
    if (carried[i].site == Site::corner) {
      corners.push_back({&attribute, &from.triangles});
      corner_slots.push_back(i);
    } else if (carried[i].site == Site::vertex) {
      carried[i] = carry_vertices(attribute, from.triangles, map.triangles, map.weights);
    } else {
      of_elements = true;
    }
  }
  if (of_elements || !corners.empty()) {
    const SurfaceMap nearest = map_to_surface(centroids(to), from, context);
    for (std::size_t i = 0; i < carried.size(); ++i)
      if (carried[i].site == Site::element) carried[i] = picked(from.attributes[i], nearest.triangles);
    if (!corners.empty()) {
      const std::vector<Index> neighbours = find_neighbours(from, corners);
      const SurfaceMap places = CornerPlaces(from, neighbours, map, to).find(nearest.triangles, context);
      for (std::size_t k = 0; k < corners.size(); ++k) carried[corner_slots[k]] = carry_corners(corners[k], places);
    }
  }
  to.attributes = std::move(carried);
}

void carry_attributes(const TriangleMesh& from, const SurfaceMap& map, TetMesh& to, const Context&) {
  check_map(map.triangles.size(), map.weights.size(), to.vertices.size());
  check_attributes(from);
  to.attributes.clear();
  for (const Attribute& attribute : from.attributes)
    if (attribute.site == Site::vertex)
      to.attributes.push_back(carry_vertices(attribute, from.triangles, map.triangles, map.weights));
}

void carry_attributes(const TetMesh& from, const SolidMap& map, TetMesh& to, const Context& context) {
  check_map(map.tets.size(), map.weights.size(), to.vertices.size());
  check_attributes(from);
  std::vector<Index> tets;
  std::vector<Attribute> carried;
  for (const Attribute& attribute : from.attributes) {
    if (attribute.site == Site::vertex) {
      carried.push_back(carry_vertices(attribute, from.tets, map.tets, map.weights));
      continue;
    }
    if (tets.empty()) tets = map_to_solid(centroids(to), from, context).tets;
    carried.push_back(picked(attribute, tets));
  }
  to.attributes = std::move(carried);
}

}  // namespace bisector
