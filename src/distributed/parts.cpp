#include "distributed/parts.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <functional>
#include <numbers>
#include <unordered_map>
#include <unordered_set>
#include <utility>
#include <vector>

#include "bisector/error.h"
#include "checkpoint/bytes.h"
#include "core/append_range.h"
#include "core/magnitude.h"
#include "core/parallel.h"
#include "distributed/unordered_sum.h"
#include "io/ply_parts.h"

namespace bisector {
namespace {

constexpr std::size_t kSamples = std::size_t{1} << 20;  // of all triangles, to divide them by
constexpr double kCube = 2.0 / 3;                       // of an edge that is wanted
constexpr int kCubeBits = 21;                           // of each coordinate of a cube
constexpr std::size_t kTrianglesAtOnce = 1 << 16;

using Cube = std::uint64_t;

struct Corner {
  Cube cube;
  Index vertex;
  Vec3 at;
};

struct CubeTriangle {
  std::array<Cube, 3> cubes;
  Index triangle;
};

std::array<Cube, 3> ascending(std::array<Cube, 3> cubes) {
  std::sort(cubes.begin(), cubes.end());
  return cubes;
}

struct HashOfCubes {
  std::size_t operator()(const std::array<Cube, 3>& cubes) const {
    std::uint64_t hash = 0;
    for (const Cube cube : cubes) hash = (std::rotl(hash, 23) ^ cube) * 0x9e3779b97f4a7c15u;
    return hash ^ hash >> 29;
  }
};

struct NamedTriangle {
  Index triangle;
  Triangle vertices;
};

class PartReader {
 public:
  PartReader(Ranks& ranks, const std::string& path) : ranks_(ranks), file_(path) {
    const std::size_t n = file_.triangles(), size = static_cast<std::size_t>(ranks.size()),
                      rank = static_cast<std::size_t>(ranks.rank());
    begin_ = n / size * rank + std::min(rank, n % size);
    end_ = begin_ + n / size + (rank < n % size);
  }

  const io::PlyParts& file() const { return file_; }
  struct Extent {
    Box box;
    double area;
  };
  // Of the whole surface, the same for any number of ranks.
  Extent measure() const;
  // The stand-in, on rank 0.
  TriangleMesh join(double cube, const Box& box) const;
  Regions divide() const;
  SurfacePart fetch_part(const Regions& regions) const;

 private:
  using Corners = std::array<Vec3, 3>;
  Corners corners(std::size_t t) const {
    const Triangle v = file_.triangle(t);
    return {file_.vertex(v[0]), file_.vertex(v[1]), file_.vertex(v[2])};
  }
  static Vec3 centre(const Corners& c) { return kThird * (c[0] + c[1] + c[2]); }
  static double area(const Corners& c) { return 0.5 * norm(twice_area_normal(c[0], c[1], c[2])); }
  TriangleMesh merge(const std::vector<std::string>& messages) const;

  Ranks& ranks_;
  io::PlyParts file_;
  std::size_t begin_, end_;  // triangles that this rank reads
};

PartReader::Extent PartReader::measure() const {
  std::vector<double> areas(end_ - begin_);
  std::vector<Box> boxes((areas.size() + kTrianglesAtOnce - 1) / kTrianglesAtOnce + 1);
  const Vec3 first = corners(0)[0];
  boxes.back() = {first, first};
  parallel_chunks(areas.size(), kTrianglesAtOnce, [&](std::size_t c, std::size_t from, std::size_t to) {
    std::vector<Vec3> points{first};
    for (std::size_t k = from; k < to; ++k) {
      const Corners found = corners(begin_ + k);
      areas[k] = area(found);
      points.insert(points.end(), found.begin(), found.end());
    }
    boxes[c] = bounding_box(points);
  });
  std::vector<Vec3> ends;
  for (const Box& box : boxes) ends.insert(ends.end(), {box.lo, box.hi});
  const Box mine = bounding_box(ends);
  for (const Box& box : ranks_.gather(mine)) ends.insert(ends.end(), {box.lo, box.hi});
  const double sum = sum_of_all(ranks_, areas.size(), [&](std::size_t k) { return areas[k]; });
  if (!(sum > 0)) throw Error("the mesh has no triangle with area; there is nothing to mesh");
  const Box box = bounding_box(ends);
  require_moderate_model({box.lo, box.hi}, "vertex");
  return {box, sum};
}

// Every so many triangles stand for those about them.
Regions PartReader::divide() const {
  struct Sample {
    Vec3 at;
    double area;
  };
  const std::size_t stride = std::max<std::size_t>(1, file_.triangles() / kSamples);
  std::vector<Sample> samples;
  for (std::size_t t = (begin_ + stride - 1) / stride * stride; t < end_; t += stride) {
    const Corners c = corners(t);
    samples.push_back({centre(c), area(c)});
  }
  samples = ranks_.collect(samples);
  std::string nodes;
  if (ranks_.is_root()) {
    std::vector<Vec3> points;
    std::vector<double> weights;
    for (const Sample& sample : samples) {
      points.push_back(sample.at);
      weights.push_back(sample.area);
    }
    const double sum = fixed_sum(weights.size(), [&](std::size_t k) { return weights[k]; });
    for (double& weight : weights) weight = (sum > 0 ? weight / sum : 0) + 1 / static_cast<double>(points.size());
    nodes = ByteWriter().put_all(Regions(points, weights, ranks_.size()).nodes()).take();
  }
  std::vector<Regions::Node> found;
  ByteReader(ranks_.broadcast(std::move(nodes))).get_all(found);
  return Regions(std::move(found));
}

SurfacePart PartReader::fetch_part(const Regions& regions) const {
  std::vector<std::vector<NamedTriangle>> leaving(static_cast<std::size_t>(ranks_.size()));
  for (std::size_t t = begin_; t < end_; ++t) {
    const int rank = regions.at(centre(corners(t)));
    leaving[static_cast<std::size_t>(rank)].push_back({static_cast<Index>(t), file_.triangle(t)});
  }
  // Ranks read ascending ranges, so triangles come in their order.
  std::vector<NamedTriangle> mine;
  for (const std::vector<NamedTriangle>& some : ranks_.exchange(std::move(leaving)))
    append_range(mine, some, 0, some.size());

  SurfacePart part;
  std::vector<Index> used;
  used.reserve(3 * mine.size());
  for (const NamedTriangle& t : mine) used.insert(used.end(), t.vertices.begin(), t.vertices.end());
  sort_in_parallel(used, std::less<>());
  used.erase(std::unique(used.begin(), used.end()), used.end());
  part.mesh.vertices.resize(used.size());
  parallel_each(used.size(), [&](std::size_t k) { part.mesh.vertices[k] = file_.vertex(used[k]); });
  part.mesh.triangles.resize(mine.size());
  part.triangle.resize(mine.size());
  parallel_each(mine.size(), [&](std::size_t k) {
    part.triangle[k] = mine[k].triangle;
    for (int m = 0; m < 3; ++m)
      part.mesh.triangles[k][m] =
          static_cast<Index>(std::lower_bound(used.begin(), used.end(), mine[k].vertices[m]) - used.begin());
  });
  return part;
}

TriangleMesh PartReader::join(double cube, const Box& box) const {
  constexpr double kMost = (std::uint64_t{1} << kCubeBits) - 1;
  const auto cube_of = [&](const Vec3& p) {
    Cube key = 0;
    for (int k = 0; k < 3; ++k)
      key = key << kCubeBits | static_cast<Cube>(std::clamp(std::floor((p[k] - box.lo[k]) / cube), 0.0, kMost));
    return key;
  };
  std::unordered_map<Cube, Index> first;
  std::unordered_set<std::array<Cube, 3>, HashOfCubes> known;
  std::vector<CubeTriangle> triangles;
  for (std::size_t t = begin_; t < end_; ++t) {
    const Triangle v = file_.triangle(t);
    CubeTriangle joined{{}, static_cast<Index>(t)};
    for (int m = 0; m < 3; ++m) {
      joined.cubes[m] = cube_of(file_.vertex(v[m]));
      const auto [at, fresh] = first.try_emplace(joined.cubes[m], v[m]);
      if (!fresh) at->second = std::min(at->second, v[m]);
    }
    const auto [a, b, c] = joined.cubes;
    if (a != b && b != c && c != a && known.insert(ascending(joined.cubes)).second) triangles.push_back(joined);
  }
  known = {};
  std::vector<Corner> corners;
  for (const auto& [key, vertex] : first) corners.push_back({key, vertex, file_.vertex(vertex)});
  return merge(ranks_.collect(ByteWriter().put_all(corners).put_all(triangles).take()));
}

TriangleMesh PartReader::merge(const std::vector<std::string>& messages) const {
  std::vector<Corner> corners, some_corners;
  std::vector<CubeTriangle> triangles, some_triangles;
  for (const std::string& message : messages) {
    ByteReader reader(message);
    reader.get_all(some_corners);
    reader.get_all(some_triangles);
    append_range(corners, some_corners, 0, some_corners.size());
    append_range(triangles, some_triangles, 0, some_triangles.size());
  }
  sort_in_parallel(corners, [](const Corner& a, const Corner& b) {
    return a.cube != b.cube ? a.cube < b.cube : a.vertex < b.vertex;
  });
  corners.erase(
      std::unique(corners.begin(), corners.end(), [](const Corner& a, const Corner& b) { return a.cube == b.cube; }),
      corners.end());
  sort_in_parallel(triangles, [](const CubeTriangle& a, const CubeTriangle& b) {
    const auto p = ascending(a.cubes), q = ascending(b.cubes);
    return p != q ? p < q : a.triangle < b.triangle;
  });
  triangles.erase(std::unique(triangles.begin(), triangles.end(),
                              [](const CubeTriangle& a, const CubeTriangle& b) {
                                return ascending(a.cubes) == ascending(b.cubes);
                              }),
                  triangles.end());
  sort_in_parallel(triangles, [](const CubeTriangle& a, const CubeTriangle& b) { return a.triangle < b.triangle; });

  TriangleMesh mesh;
  for (const Corner& corner : corners) mesh.vertices.push_back(corner.at);
  const auto place = [&](Cube cube) {
    const auto at = std::lower_bound(corners.begin(), corners.end(), cube,
                                     [](const Corner& corner, Cube key) { return corner.cube < key; });
    return static_cast<Index>(at - corners.begin());
  };
  for (const CubeTriangle& t : triangles)
    mesh.triangles.push_back({place(t.cubes[0]), place(t.cubes[1]), place(t.cubes[2])});
  return mesh;
}

}  // namespace

DividedSurface read_divided(Ranks& ranks, const std::string& path, std::size_t wanted) {
  const PartReader reader(ranks, path);
  DividedSurface result;
  result.vertices = reader.file().vertices();
  result.triangles = reader.file().triangles();
  const auto [box, area] = reader.measure();
  const double edge = std::sqrt(2 / std::numbers::sqrt3 * area / static_cast<double>(wanted));
  const double least = box.diagonal() / (std::uint64_t{1} << (kCubeBits - 1));
  result.stand_in = reader.join(std::max(kCube * edge, least), box);
  const Regions regions = reader.divide();
  result.part = std::make_unique<PartDiagram>(reader.fetch_part(regions), regions, ranks.rank());
  // As the diagram's cells sum it.
  result.area = result.part->total_mass(ranks);
  return result;
}

}  // namespace bisector
