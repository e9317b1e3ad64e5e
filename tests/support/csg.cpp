#include "support/csg.h"

#include <CGAL/Delaunay_triangulation_2.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Triangulation_vertex_base_with_info_2.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <unordered_map>
#include <utility>

#include "bisector/repair.h"
#include "core/geometry.h"
#include "mesh/topology.h"
#include "support/models.h"
#include "support/primitive_parameters.h"

namespace bisector::test {
namespace {

using std::numbers::pi;
using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Triangulation = CGAL::Delaunay_triangulation_2<
    Kernel, CGAL::Triangulation_data_structure_2<CGAL::Triangulation_vertex_base_with_info_2<Index, Kernel>>>;

struct Frame {
  Vec3 origin, x, y, z;  // orthonormal

  Vec3 at(double u, double v, double w) const { return origin + u * x + v * y + w * z; }
  Frame moved(double u, double v, double w) const { return {at(u, v, w), x, y, z}; }
};

// No axis of a part is one of the coordinates'.
Frame tilted() {
  const Vec3 z = unit({0.3, -0.5, 0.8}), x = unit(cross({0.2, 0.9, 0.1}, z));
  return {{3, -2, 1.5}, x, cross(z, x), z};
}

// A piece of the half plane (r, z) beside an axis, that is revolved about it: a line, or an arc about (rc, zc).
struct Piece {
  double r0, z0, r1, z1;
  double rc = 0, zc = 0, radius = 0, from = 0, to = 0;  // arc: its angles at the ends

  bool is_arc() const { return radius > 0; }
  double length() const { return is_arc() ? radius * std::abs(to - from) : std::hypot(r1 - r0, z1 - z0); }
  std::array<double, 2> at(double t) const {
    if (!is_arc()) return {r0 + t * (r1 - r0), z0 + t * (z1 - z0)};
    const double angle = from + t * (to - from);
    return {rc + radius * std::cos(angle), zc + radius * std::sin(angle)};
  }
  // Pappus.
  double area() const {
    if (!is_arc()) return pi * (r0 + r1) * length();
    return 2 * pi * std::abs(radius * (rc * (to - from) + radius * (std::sin(to) - std::sin(from))));
  }
  Primitive primitive(const Frame& frame) const {
    if (is_arc() && rc == 0) return make_sphere(frame.at(0, 0, zc), radius);
    if (is_arc()) return make_torus(frame.at(0, 0, zc), frame.z, rc, radius);
    if (z0 == z1) return make_plane(frame.z, dot(frame.z, frame.at(0, 0, z0)));
    if (r0 == r1) return make_cylinder(frame.origin, frame.z, r0);
    const double apex = z0 - r0 * (z1 - z0) / (r1 - r0);
    const double side = 0.5 * (z0 + z1) > apex ? 1 : -1;
    return make_cone(frame.at(0, 0, apex), side * frame.z, std::atan2(std::abs(r1 - r0), std::abs(z1 - z0)));
  }
};

Piece line(double r0, double z0, double r1, double z1) { return {r0, z0, r1, z1}; }
Piece arc(double rc, double zc, double radius, double from, double to) {
  return {rc + radius * std::cos(from),
          zc + radius * std::sin(from),
          rc + radius * std::cos(to),
          zc + radius * std::sin(to),
          rc,
          zc,
          radius,
          from,
          to};
}

double total_area(const std::vector<Piece>& profile) {
  double sum = 0;
  for (const Piece& piece : profile) sum += piece.area();
  return sum;
}

// Meshes patches one by one. Each is triangulated by Delaunay's rule in a plane that it is mapped to conformally; its
// border's vertices are given, those inside are thrown at random, no two nearer than `gap`.
class Builder {
 public:
  // `gap` such that patches of this area come out as so many triangles.
  Builder(double area, std::size_t triangles, std::uint64_t seed)
      : gap_(std::sqrt(1.27 * area / static_cast<double>(triangles))), random_(seed) {}

  CsgModel model;

  double spacing() const { return 1.1 * gap_; }

  Index add_vertex(const Vec3& p) {
    model.mesh.vertices.push_back(p);
    cells_[cell(p)].push_back(p);
    return static_cast<Index>(model.mesh.vertices.size() - 1);
  }

  // Vertices at equal angles.
  std::vector<Index> circle(const Frame& frame, double r, double z) {
    const int n = std::max(12, static_cast<int>(std::lround(2 * pi * r / spacing())));
    std::vector<Index> ring;
    for (int i = 0; i < n; ++i)
      ring.push_back(add_vertex(frame.at(r * std::cos(2 * pi * i / n), r * std::sin(2 * pi * i / n), z)));
    return ring;
  }

  // The pieces from `start`, a circle of the profile's beginning, or none if that is on the axis; the last one ends on
  // the axis.
  void revolve(const Frame& frame, const std::vector<Piece>& profile, std::vector<Index> start) {
    for (std::size_t i = 0; i < profile.size(); ++i) {
      std::vector<Index> end;
      if (i + 1 < profile.size()) end = circle(frame, profile[i].r1, profile[i].z1);
      add_ring(frame, profile[i], start, end);
      start = end;
    }
  }

  // A rectangle in the plane w = 0 of the frame, less round holes about (u, v).
  struct Hole {
    double u, v, r;
    std::vector<Index> ring;
  };
  void add_rectangle(const Frame& frame, double width, double height, const std::vector<Index>& border,
                     const std::vector<Hole>& holes) {
    Patch patch;
    const auto snapped = [](double x, double side) {  // so that the rectangle's sides are straight in the plane
      return std::abs(x) < 1e-9 ? 0 : std::abs(x - side) < 1e-9 ? side : x;
    };
    const auto add = [&](Index v, int ring) {
      const Vec3 d = model.mesh.vertices[v] - frame.origin;
      patch.add(v, snapped(dot(d, frame.x), width), snapped(dot(d, frame.y), height), ring);
    };
    for (const Index v : border) add(v, kOuter);
    double area = width * height;
    for (std::size_t h = 0; h < holes.size(); ++h) {
      for (const Index v : holes[h].ring) add(v, static_cast<int>(h));
      area -= pi * holes[h].r * holes[h].r;
    }
    throw_points(area, patch, [&](double& u, double& v) {
      u = width * random_.unit();
      v = height * random_.unit();
      for (const Hole& hole : holes)
        if (std::hypot(u - hole.u, v - hole.v) <= hole.r) return Candidate{};
      return Candidate{true, frame.at(u, v, 0)};
    });
    close(patch, make_plane(frame.z, dot(frame.z, frame.origin)), area);
  }

  // Along a segment, ends included.
  std::vector<Index> segment(Index a, Index b) {
    const Vec3 p = model.mesh.vertices[a], q = model.mesh.vertices[b];
    const int n = static_cast<int>(std::lround(norm(q - p) / spacing()));
    std::vector<Index> all{a};
    for (int i = 1; i < n; ++i) all.push_back(add_vertex(p + (static_cast<double>(i) / n) * (q - p)));
    all.push_back(b);
    return all;
  }

 private:
  static constexpr int kInside = -1, kOuter = -2;
  struct Patch {
    std::vector<std::pair<Kernel::Point_2, Index>> points;  // and positions below
    std::vector<Index> vertices;
    std::vector<int> rings;  // kInside, kOuter, or a hole's number

    void add(Index vertex, double u, double v, int ring) {
      points.push_back({Kernel::Point_2(u, v), static_cast<Index>(vertices.size())});
      vertices.push_back(vertex);
      rings.push_back(ring);
    }
  };
  struct Candidate {
    bool inside = false;
    Vec3 p{};
  };

  void add_ring(const Frame& frame, const Piece& piece, const std::vector<Index>& start,
                const std::vector<Index>& end) {
    const double scale = plane_radius(piece, start.empty() ? 1 : 0);
    const bool outward = plane_radius(piece, 0.75) > plane_radius(piece, 0.25);
    Patch patch;
    const auto add_circle = [&](const std::vector<Index>& ring, double t, bool outer) {
      const double radius = plane_radius(piece, t) / scale;
      for (std::size_t i = 0; i < ring.size(); ++i) {
        const double angle = 2 * pi * static_cast<double>(i) / static_cast<double>(ring.size());
        patch.add(ring[i], radius * std::cos(angle), radius * std::sin(angle), outer ? kOuter : 0);
      }
    };
    add_circle(start, 0, !outward);
    add_circle(end, 1, outward);
    const double widest = std::max({piece.r0, piece.r1, piece.is_arc() ? piece.rc + piece.radius : 0});
    throw_points(piece.area(), patch, [&](double& u, double& v) {
      const double t = random_.unit(), angle = 2 * pi * random_.unit();
      const auto [r, z] = piece.at(t);
      if (random_.unit() * widest > r) return Candidate{};
      const double radius = plane_radius(piece, t) / scale;
      u = radius * std::cos(angle);
      v = radius * std::sin(angle);
      return Candidate{true, frame.at(r * std::cos(angle), r * std::sin(angle), z)};
    });
    close(patch, piece.primitive(frame), piece.area());
  }

  // exp(int ds / r): with the angle, polar coordinates to which the revolved piece is mapped conformally. Closed forms
  // where the piece may reach the axis.
  static double plane_radius(const Piece& piece, double t) {
    const auto [r, z] = piece.at(t);
    if (!piece.is_arc() && piece.z0 == piece.z1) return r;
    if (piece.is_arc() && piece.rc == 0)
      return std::tan(0.5 * std::abs(pi / 2 - (piece.from + t * (piece.to - piece.from))));
    constexpr int kSteps = 32;
    double sum = 0;
    for (int i = 0; i < kSteps; ++i) sum += 1 / piece.at((i + 0.5) / kSteps * t)[0];
    return std::exp(sum * t * piece.length() / kSteps);
  }

  template <class Draw>
  void throw_points(double area, Patch& patch, const Draw& draw) {
    const auto tries = static_cast<std::size_t>(25 * area / (gap_ * gap_));
    for (std::size_t i = 0; i < tries; ++i) {
      double u = 0, v = 0;
      const Candidate candidate = draw(u, v);
      if (candidate.inside && is_free(candidate.p)) patch.add(add_vertex(candidate.p), u, v, kInside);
    }
  }

  void close(const Patch& patch, const Primitive& primitive, double area) {
    Triangulation triangulation(patch.points.begin(), patch.points.end());
    const auto label = static_cast<Index>(model.primitives.size());
    for (auto f = triangulation.finite_faces_begin(); f != triangulation.finite_faces_end(); ++f) {
      const Index a = f->vertex(0)->info(), b = f->vertex(1)->info(), c = f->vertex(2)->info();
      if (patch.rings[a] >= 0 && patch.rings[a] == patch.rings[b] && patch.rings[a] == patch.rings[c]) continue;
      model.mesh.triangles.push_back({patch.vertices[a], patch.vertices[b], patch.vertices[c]});
      model.labels.push_back(label);
    }
    model.primitives.push_back(primitive);
    model.areas.push_back(area);
  }

  std::uint64_t cell(const Vec3& p, int di = 0, int dj = 0, int dk = 0) const {
    const auto index = [&](double x, int d) {
      return static_cast<std::uint64_t>(static_cast<std::int64_t>(std::floor(x / gap_)) + d + (1 << 20));
    };
    return index(p.x, di) << 42 | index(p.y, dj) << 21 | index(p.z, dk);
  }

  bool is_free(const Vec3& p) const {
    for (int i = -1; i <= 1; ++i)
      for (int j = -1; j <= 1; ++j)
        for (int k = -1; k <= 1; ++k) {
          const auto found = cells_.find(cell(p, i, j, k));
          if (found == cells_.end()) continue;
          for (const Vec3& q : found->second)
            if (norm2(p - q) < gap_ * gap_) return false;
        }
    return true;
  }

  double gap_;
  SplitMix64 random_;
  std::unordered_map<std::uint64_t, std::vector<Vec3>> cells_;
};

void orient_outward(TriangleMesh& mesh) {
  orient(mesh.triangles, mesh.vertices.size());
  double volume = 0;
  for (const auto& [a, b, c] : mesh.triangles)
    volume += dot(mesh.vertices[a] - mesh.vertices[0],
                  cross(mesh.vertices[b] - mesh.vertices[0], mesh.vertices[c] - mesh.vertices[0]));
  if (volume > 0) return;
  for (Triangle& t : mesh.triangles) std::swap(t[1], t[2]);
}

// Perpendicular to the surface, to either side.
Vec3 normal_at(const Primitive& primitive, const Vec3& p) {
  const PrimitiveParameters s = parameters_of(primitive);
  const Vec3 d = p - s.centre, radial = d - dot(d, s.axis) * s.axis;
  switch (s.type) {
    case SurfaceType::sphere: return unit(d);
    case SurfaceType::cylinder: return unit(radial);
    case SurfaceType::cone: return std::cos(s.angle) * unit(radial) - std::sin(s.angle) * s.axis;
    case SurfaceType::torus: return unit(d - s.radius * unit(radial));
    default: return s.axis;
  }
}

void add_noise(CsgModel& model, double noise, std::uint64_t seed) {
  if (noise == 0) return;
  TriangleMesh& mesh = model.mesh;
  std::vector<std::map<Index, Vec3>> sides(mesh.vertices.size());  // of each vertex, a normal for each surface there
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto& [a, b, c] = mesh.triangles[t];
    const Vec3 facing = cross(mesh.vertices[b] - mesh.vertices[a], mesh.vertices[c] - mesh.vertices[a]);
    for (const Index v : mesh.triangles[t]) {
      const Vec3 n = normal_at(model.primitives[model.labels[t]], mesh.vertices[v]);
      sides[v][model.labels[t]] = dot(n, facing) > 0 ? n : -n;
    }
  }
  const double sigma = noise * bounding_box(mesh.vertices).diagonal();
  SplitMix64 random(seed ^ 0x5bd1e995);
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    Vec3 normal;
    for (const auto& [label, n] : sides[v]) normal += n;
    const double gauss = std::sqrt(-2 * std::log(1 - random.unit())) * std::cos(2 * pi * random.unit());
    mesh.vertices[v] += sigma * gauss * unit(normal);
  }
}

CsgModel finished(Builder& builder, double noise, std::uint64_t seed) {
  orient_outward(builder.model.mesh);
  add_noise(builder.model, noise, seed);
  return std::move(builder.model);
}

}  // namespace

std::vector<Index> matching_regions(const CsgModel& model, const std::vector<Index>& labels) {
  std::vector<std::map<Index, std::size_t>> counts(model.primitives.size());
  for (std::size_t t = 0; t < labels.size(); ++t) ++counts[model.labels[t]][labels[t]];
  std::vector<Index> best;
  for (const auto& count : counts) {
    const auto most =
        std::max_element(count.begin(), count.end(), [](const auto& p, const auto& q) { return p.second < q.second; });
    best.push_back(most == count.end() ? kNone : most->first);
  }
  return best;
}

double share_right(const CsgModel& model, const std::vector<Index>& labels) {
  const std::vector<Index> regions = matching_regions(model, labels);
  std::size_t right = 0;
  for (std::size_t t = 0; t < labels.size(); ++t)
    right += labels[t] == regions[model.labels[t]] && std::count(regions.begin(), regions.end(), labels[t]) == 1;
  return static_cast<double>(right) / static_cast<double>(labels.size());
}

double parameter_difference(const Primitive& first, const Primitive& second, double unit_length) {
  const PrimitiveParameters a = parameters_of(first), b = parameters_of(second);
  if (a.type != b.type) return std::numeric_limits<double>::infinity();
  const double side = dot(a.axis, b.axis) < 0 ? -1 : 1;
  const double turn = unit_length * norm(cross(a.axis, b.axis));
  const double apart = norm(a.centre - b.centre), radii = std::abs(a.radius - b.radius);
  switch (a.type) {
    case SurfaceType::plane: return std::max(turn, std::abs(dot(a.axis, a.centre) - side * dot(b.axis, b.centre)));
    case SurfaceType::sphere: return std::max(apart, radii);
    case SurfaceType::cylinder: {
      const Vec3 d = b.centre - a.centre;
      return std::max({turn, norm(d - dot(d, a.axis) * a.axis), radii});
    }
    case SurfaceType::cone: return std::max({turn, apart, unit_length * std::abs(a.angle - b.angle)});
    case SurfaceType::torus: return std::max({turn, apart, radii, std::abs(a.minor_radius - b.minor_radius)});
    default: return std::numeric_limits<double>::infinity();
  }
}

CsgModel csg_part(std::size_t triangles, double noise, std::uint64_t random_seed) {
  constexpr std::array<double, 3> size{4, 3, 2};
  const Frame base = tilted();
  const double crown = 1 - std::sqrt(0.9 * 0.9 - 0.7 * 0.7);  // of the dome's centre
  const std::vector<Piece> boss{arc(0.9, 0.2, 0.2, -pi / 2, -pi), line(0.7, 0.2, 0.7, 1),
                                arc(0, crown, 0.9, std::asin((1 - crown) / 0.9), pi / 2)};
  const std::vector<Piece> hole{line(0.75, 0, 0.55, 0.2), line(0.55, 0.2, 0.55, 1.4), line(0.55, 1.4, 0.25, 1.7),
                                line(0.25, 1.7, 0, 1.7)};
  const double block = 2 * (size[0] * size[1] + size[1] * size[2] + size[2] * size[0]);
  const double area = block - pi * (0.9 * 0.9 + 0.75 * 0.75) + total_area(boss) + total_area(hole);
  Builder builder(area, triangles, random_seed);

  std::array<Index, 8> corners{};
  for (std::size_t c = 0; c < 8; ++c)
    corners[c] = builder.add_vertex(base.at(c & 1 ? size[0] : 0, c & 2 ? size[1] : 0, c & 4 ? size[2] : 0));
  std::map<std::pair<std::size_t, std::size_t>, std::vector<Index>> edges;  // by their corners
  for (std::size_t c = 0; c < 8; ++c)
    for (const std::size_t bit : {1, 2, 4})
      if (!(c & bit)) edges[{c, c | bit}] = builder.segment(corners[c], corners[c | bit]);

  const std::array<Vec3, 3> axes{base.x, base.y, base.z};
  for (std::size_t k = 0; k < 3; ++k)
    for (const bool far : {false, true}) {
      const std::size_t i = (k + 1) % 3, j = (k + 2) % 3;
      const std::size_t low = far ? std::size_t{1} << k : 0, bi = std::size_t{1} << i, bj = std::size_t{1} << j;
      Frame face{builder.model.mesh.vertices[corners[low]], axes[i], axes[j], axes[k]};
      std::vector<Index> border;
      for (const auto& edge : {std::pair{low, low | bi}, std::pair{low, low | bj}, std::pair{low | bj, low | bi | bj},
                               std::pair{low | bi, low | bi | bj}})
        border.insert(border.end(), edges.at(edge).begin(), edges.at(edge).end());
      std::sort(border.begin(), border.end());
      border.erase(std::unique(border.begin(), border.end()), border.end());
      std::vector<Builder::Hole> holes;
      if (far && k == 2) {
        const Frame stand = face.moved(1.3, 1.5, 0);
        holes.push_back({1.3, 1.5, 0.9, builder.circle(stand, 0.9, 0)});
        builder.revolve(stand, boss, holes[0].ring);
      }
      if (far && k == 0) {
        const Frame at = face.moved(1.5, 1, 0), inward{at.origin, at.y, at.x, -at.z};
        holes.push_back({1.5, 1, 0.75, builder.circle(inward, 0.75, 0)});
        builder.revolve(inward, hole, holes[0].ring);
      }
      builder.add_rectangle(face, size[i], size[j], border, holes);
    }
  return finished(builder, noise, random_seed);
}

CsgModel turned_part(std::size_t triangles, double noise, std::uint64_t random_seed) {
  const double ball = 2.8 + std::sqrt(0.6 * 0.6 - 0.5 * 0.5);
  const std::vector<Piece> profile{line(0, 0, 1.2, 0),
                                   line(1.2, 0, 1.2, 0.8),
                                   arc(1, 0.8, 0.2, 0, pi / 2),
                                   line(1, 1, 0.8, 1),
                                   line(0.8, 1, 0.5, 2.2),
                                   line(0.5, 2.2, 0.5, 2.8),
                                   arc(0, ball, 0.6, std::asin((2.8 - ball) / 0.6), pi / 2)};
  Builder builder(total_area(profile), triangles, random_seed);
  builder.revolve(tilted(), profile, {});
  return finished(builder, noise, random_seed);
}

}  // namespace bisector::test
