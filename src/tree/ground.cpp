#include "tree/ground.h"

#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "core/disjoint_sets.h"
#include "core/parallel.h"
#include "spatial/kd_tree.h"
#include "tree/polyline.h"

namespace bisector {
namespace {

constexpr double kCoarsest = 8;          // cells along the scan, of the first plate
constexpr double kPointsPerCell = 4;     // of the last one, on average
constexpr double kMostCells = 128;       // along the scan
constexpr double kRise = 0.5;            // of a cell: points higher above the last plate don't carry the next one
constexpr int kRounds = 10;              // of fitting with new weights
constexpr double kPlateStiffness = 0.1;  // of second differences, beside the pull of a point; where cells have one each
constexpr double kStiffness = 1;         // where all points pull
constexpr double kAbove = 2.5;           // deviations above the plate at which a point counts half
constexpr double kBand = 3;              // deviations off it, of the ground's points
constexpr std::size_t kLocalPoints = 10;  // that tell the noise around them
constexpr double kLone = 10;  // distance from the fourth neighbour, in the median one: strays carry no plate
constexpr std::size_t kLonePoints = 4;
constexpr std::uint8_t kGroundClass = 2;  // of LAS

// A block of cells shows the ground if points lie in at least three of its quarters, the layer is thin beside its width
// and holds more points than what is above it as far as half a block.
constexpr std::size_t kLeastPoints = 4, kLeastQuarters = 3;
constexpr double kPointsPerBlock = 10;    // of the layer, if they were spread evenly
constexpr std::size_t kWidest = 8;        // blocks, in cells
constexpr double kThin = 0.15;            // of kBand deviations in the block's width
constexpr std::size_t kLeastBlocks = 25;  // that hang together
constexpr std::size_t kFewBlocks = 4;     // that do, beside them
constexpr std::ptrdiff_t kReach = 2;      // blocks from those that show the ground, in which points near it are its

double squared(double x) { return x * x; }

// Where a point is in a grid: the cell and the place in it.
struct Place {
  std::size_t column = 0, row = 0;
  double s = 0, t = 0;
};

Place place_in(const HeightField& field, double x, double y) {
  Place place;
  const auto along = [&](double at, std::size_t corners, std::size_t& cell, double& rest) {
    const double most = static_cast<double>(corners - 1);
    const double u = std::clamp(at / field.cell, 0.0, most);
    cell = std::min(static_cast<std::size_t>(u), corners - 2);
    rest = u - static_cast<double>(cell);
  };
  along(x - field.x, field.columns, place.column, place.s);
  along(y - field.y, field.rows, place.row, place.t);
  return place;
}

HeightField make_field(const Box& box, double cell) {
  HeightField field;
  field.cell = cell;
  field.x = box.lo.x;
  field.y = box.lo.y;
  field.columns = static_cast<std::size_t>((box.hi.x - box.lo.x) / cell) + 2;
  field.rows = static_cast<std::size_t>((box.hi.y - box.lo.y) / cell) + 2;
  field.heights.assign(field.columns * field.rows, 0);
  return field;
}

// The plate that weighted points carry.
void fit_plate(const std::vector<Vec3>& points, const std::vector<double>& weights, double stiffness,
               HeightField& field) {
  const auto n = static_cast<Eigen::Index>(field.heights.size());
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(16 * points.size() + 30 * field.heights.size());
  Eigen::VectorXd right = Eigen::VectorXd::Zero(n);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Place p = place_in(field, points[i].x, points[i].y);
    const auto first = static_cast<Eigen::Index>(p.row * field.columns + p.column);
    const auto up = static_cast<Eigen::Index>(field.columns);
    const std::array<Eigen::Index, 4> corner{first, first + 1, first + up, first + up + 1};
    const std::array<double, 4> share{(1 - p.s) * (1 - p.t), p.s * (1 - p.t), (1 - p.s) * p.t, p.s * p.t};
    for (std::size_t a = 0; a < 4; ++a) {
      right[corner[a]] += weights[i] * share[a] * points[i].z;
      for (std::size_t b = 0; b < 4; ++b) entries.emplace_back(corner[a], corner[b], weights[i] * share[a] * share[b]);
    }
  }
  const auto bend = [&](const std::array<Eigen::Index, 4>& corner, const std::array<double, 4>& share, double weight) {
    for (std::size_t a = 0; a < 4; ++a)
      for (std::size_t b = 0; b < 4; ++b)
        if (share[a] != 0 && share[b] != 0) entries.emplace_back(corner[a], corner[b], weight * share[a] * share[b]);
  };
  const auto columns = static_cast<Eigen::Index>(field.columns), rows = static_cast<Eigen::Index>(field.rows);
  for (Eigen::Index r = 0; r < rows; ++r)
    for (Eigen::Index c = 0; c < columns; ++c) {
      const Eigen::Index i = r * columns + c;
      if (c > 0 && c + 1 < columns) bend({i - 1, i, i + 1, i}, {1, -2, 1, 0}, stiffness);
      if (r > 0 && r + 1 < rows) bend({i - columns, i, i + columns, i}, {1, -2, 1, 0}, stiffness);
      if (c + 1 < columns && r + 1 < rows)
        bend({i, i + 1, i + columns, i + columns + 1}, {1, -1, -1, 1}, 2 * stiffness);
      entries.emplace_back(i, i, 1e-9 * stiffness);  // for plates that fewer than three points carry
    }
  Eigen::SparseMatrix<double> matrix(n, n);
  matrix.setFromTriplets(entries.begin(), entries.end());
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver(matrix);
  const Eigen::VectorXd heights = solver.solve(right);
  for (Eigen::Index i = 0; i < n; ++i) field.heights[static_cast<std::size_t>(i)] = heights[i];
}

std::vector<double> heights_above(const std::vector<Vec3>& points, const HeightField& field) {
  std::vector<double> above(points.size());
  parallel_each(points.size(), [&](std::size_t i) { above[i] = points[i].z - field.at(points[i].x, points[i].y); });
  return above;
}

// Standard deviation by the points below, where nothing but noise is.
double deviation_below(const std::vector<double>& above) {
  constexpr double kNormal = 1.4826;
  std::vector<double> below;
  for (const double r : above)
    if (r < 0) below.push_back(-r);
  return kNormal * quantile(std::move(below), 0.5);
}

// Fits again and again, with weights that fall above the plate; the deviation.
double fit_from_below(const std::vector<Vec3>& points, double stiffness, double least, HeightField& field) {
  std::vector<double> weights(points.size(), 1);
  double deviation = 0;
  for (int round = 0; round < kRounds; ++round) {
    fit_plate(points, weights, stiffness, field);
    const std::vector<double> above = heights_above(points, field);
    const double before = deviation;
    deviation = std::max(deviation_below(above), least);
    for (std::size_t i = 0; i < points.size(); ++i)
      weights[i] = above[i] <= 0 ? 1 : 1 / (1 + squared(squared(above[i] / (kAbove * deviation))));
    if (round > 0 && std::abs(deviation - before) < 1e-3 * deviation) break;
  }
  return deviation;
}

// The lowest point of each cell.
std::vector<Vec3> lowest_of_cells(const std::vector<Vec3>& points, const HeightField& field) {
  std::vector<Index> lowest(field.heights.size(), kNone);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Place p = place_in(field, points[i].x, points[i].y);
    Index& low = lowest[p.row * field.columns + p.column];
    if (low == kNone || points[i].z < points[low].z) low = static_cast<Index>(i);
  }
  std::vector<Vec3> result;
  for (const Index i : lowest)
    if (i != kNone) result.push_back(points[i]);
  return result;
}

// Without those that are far from all others, such as echoes from below the ground.
std::vector<Vec3> without_lone_points(const std::vector<Vec3>& points) {
  const PointSet set{points};
  const KdTree tree(3, set);
  const std::size_t k = std::min(kLonePoints + 1, points.size());
  std::vector<double> reach(points.size());
  parallel_chunks(points.size(), 1024, [&](std::size_t, std::size_t begin, std::size_t end) {
    std::vector<Index> near(k);
    std::vector<double> distances(k);
    for (std::size_t i = begin; i < end; ++i) {
      const double at[3] = {points[i].x, points[i].y, points[i].z};
      tree.knnSearch(at, k, near.data(), distances.data());
      reach[i] = std::sqrt(distances[k - 1]);
    }
  });
  const double most = kLone * quantile(reach, 0.5);
  std::vector<Vec3> result;
  for (std::size_t i = 0; i < points.size(); ++i)
    if (reach[i] <= most) result.push_back(points[i]);
  return result;
}

// A grid of wider cells over a field, to look at what lies in each.
class Blocks {
 public:
  // So wide that `points`, evenly spread, would be some to a block.
  Blocks(const HeightField& field, std::size_t points) : field_(field) {
    const double cells = kPointsPerBlock * static_cast<double>(field.heights.size()) / static_cast<double>(points);
    width_ = std::clamp<std::size_t>(static_cast<std::size_t>(std::ceil(std::sqrt(cells))), 2, kWidest);
    columns_ = (field.columns + width_ - 1) / width_;
    rows_ = (field.rows + width_ - 1) / width_;
  }
  std::size_t size() const { return columns_ * rows_; }
  std::size_t columns() const { return columns_; }
  double width() const { return static_cast<double>(width_) * field_.cell; }
  std::size_t of(const Vec3& p) const {
    const Place place = place_in(field_, p.x, p.y);
    return place.row / width_ * columns_ + place.column / width_;
  }
  // 0 to 3: which quarter of its block a point lies in.
  std::size_t quarter(const Vec3& p) const {
    const Place place = place_in(field_, p.x, p.y);
    const auto half = [&](std::size_t cell) { return static_cast<std::size_t>(2 * (cell % width_) >= width_); };
    return 2 * half(place.row) + half(place.column);
  }
  template <class Visit>
  void visit_around(std::size_t block, std::ptrdiff_t reach, const Visit& visit) const {
    const auto columns = static_cast<std::ptrdiff_t>(columns_), rows = static_cast<std::ptrdiff_t>(rows_);
    const auto r = static_cast<std::ptrdiff_t>(block) / columns, c = static_cast<std::ptrdiff_t>(block) % columns;
    for (std::ptrdiff_t y = std::max<std::ptrdiff_t>(0, r - reach); y <= std::min(rows - 1, r + reach); ++y)
      for (std::ptrdiff_t x = std::max<std::ptrdiff_t>(0, c - reach); x <= std::min(columns - 1, c + reach); ++x)
        visit(static_cast<std::size_t>(y * columns + x));
  }

 private:
  const HeightField& field_;
  std::size_t width_ = 2;  // in cells
  std::size_t columns_ = 0, rows_ = 0;
};

// Standard deviation around each block, where points below the plate tell it: noise grows with the angle of the beam.
std::vector<double> local_noise(const std::vector<Vec3>& points, const std::vector<double>& above, double noise,
                                const Blocks& blocks) {
  std::vector<std::vector<double>> below(blocks.size());
  for (std::size_t i = 0; i < points.size(); ++i)
    if (above[i] < 0 && above[i] > -kRise * blocks.width()) below[blocks.of(points[i])].push_back(above[i]);
  std::vector<double> result(blocks.size(), noise);
  parallel_each(
      blocks.size(),
      [&](std::size_t b) {
        std::vector<double> around;
        blocks.visit_around(
            b, 1, [&](std::size_t other) { around.insert(around.end(), below[other].begin(), below[other].end()); });
        if (around.size() >= kLocalPoints) result[b] = deviation_below(around);
      },
      256);
  return result;
}

// The blocks in which points near the plate are the ground's: those that show it and hang together with others, and
// those around.
std::vector<char> blocks_of_ground(const std::vector<Vec3>& points, const std::vector<double>& above,
                                   const std::vector<double>& noise, const Blocks& blocks) {
  struct Content {
    std::size_t layer = 0, over = 0;
    std::array<char, 4> quarters{};
  };
  std::vector<Content> contents(blocks.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const std::size_t b = blocks.of(points[i]);
    if (std::abs(above[i]) <= kBand * noise[b]) {
      ++contents[b].layer;
      contents[b].quarters[blocks.quarter(points[i])] = 1;
    } else if (above[i] > 0 && above[i] < kRise * blocks.width()) {
      ++contents[b].over;
    }
  }
  std::vector<char> shows(blocks.size(), 0);
  DisjointSets<> sets(blocks.size());
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    const Content& content = contents[b];
    const auto quarters = static_cast<std::size_t>(std::count(content.quarters.begin(), content.quarters.end(), 1));
    shows[b] = content.layer >= std::max(kLeastPoints, content.over) && quarters >= kLeastQuarters &&
               kBand * noise[b] < kThin * blocks.width();
    if (!shows[b]) continue;
    if (b % blocks.columns() > 0 && shows[b - 1]) sets.join(b, b - 1);
    if (b >= blocks.columns() && shows[b - blocks.columns()]) sets.join(b, b - blocks.columns());
  }
  std::vector<std::size_t> size(blocks.size(), 0);
  for (std::size_t b = 0; b < blocks.size(); ++b)
    if (shows[b]) ++size[sets.root(b)];
  if (*std::max_element(size.begin(), size.end()) < kLeastBlocks) return {};
  std::vector<char> near(blocks.size(), 0);
  for (std::size_t b = 0; b < blocks.size(); ++b)
    if (shows[b] && size[sets.root(b)] >= kFewBlocks)
      blocks.visit_around(b, kReach, [&](std::size_t other) { near[other] = 1; });
  return near;
}

double finest_cell(const Box& box, std::size_t points) {
  const double width = box.hi.x - box.lo.x, depth = box.hi.y - box.lo.y, longer = std::max(width, depth);
  return std::max(std::sqrt(kPointsPerCell * width * depth / static_cast<double>(points)), longer / kMostCells);
}

Ground ground_of_classes(const std::vector<Vec3>& points, const std::vector<std::uint8_t>& classes, const Box& box) {
  Ground ground;
  std::vector<Vec3> own;
  for (std::size_t i = 0; i < points.size(); ++i) {
    ground.is_ground.push_back(classes[i] == kGroundClass);
    if (ground.is_ground.back()) own.push_back(points[i]);
  }
  ground.found = !own.empty();
  if (!ground.found) return ground;
  ground.surface = make_field(box, finest_cell(box, own.size()));
  fit_plate(own, std::vector<double>(own.size(), 1), kStiffness, ground.surface);
  ground.noise = deviation_below(heights_above(own, ground.surface));
  return ground;
}

}  // namespace

double HeightField::at(double px, double py) const {
  const Place p = place_in(*this, px, py);
  const double* h = heights.data() + p.row * columns + p.column;
  return (1 - p.t) * ((1 - p.s) * h[0] + p.s * h[1]) + p.t * ((1 - p.s) * h[columns] + p.s * h[columns + 1]);
}

Ground find_ground(const std::vector<Vec3>& points, const std::vector<std::uint8_t>& classes, const Context& context) {
  Ground ground;
  ground.is_ground.assign(points.size(), 0);
  const Box box = bounding_box(points);
  const double extent = std::max(box.hi.x - box.lo.x, box.hi.y - box.lo.y);
  if (points.empty() || !(box.hi.x > box.lo.x && box.hi.y > box.lo.y)) return ground;
  if (std::count(classes.begin(), classes.end(), kGroundClass) > 0) return ground_of_classes(points, classes, box);

  const std::vector<Vec3> carriers = without_lone_points(points);
  const double finest = finest_cell(box, points.size()), least = 1e-7 * extent;
  HeightField field;
  for (double cell = extent / kCoarsest;; cell *= 0.5) {
    context.check();
    cell = std::max(cell, finest);
    HeightField next = make_field(box, cell);
    std::vector<Vec3> low = lowest_of_cells(carriers, next);
    if (field.cell > 0) std::erase_if(low, [&](const Vec3& p) { return p.z - field.at(p.x, p.y) > kRise * cell; });
    fit_from_below(low, kPlateStiffness, least, next);
    field = std::move(next);
    if (cell == finest) break;
  }
  std::vector<Vec3> layer;
  for (const Vec3& p : carriers)
    if (std::abs(p.z - field.at(p.x, p.y)) < kRise * finest) layer.push_back(p);
  if (layer.empty()) return ground;
  ground.noise = fit_from_below(layer, kStiffness, least, field);
  context.check();

  const std::vector<double> above = heights_above(points, field);
  const auto near_plate =
      std::count_if(above.begin(), above.end(), [&](double r) { return std::abs(r) < kBand * ground.noise; });
  const Blocks blocks(field, std::max<std::size_t>(static_cast<std::size_t>(near_plate), 1));
  const std::vector<double> noise = local_noise(points, above, ground.noise, blocks);
  const std::vector<char> near = blocks_of_ground(points, above, noise, blocks);
  ground.found = !near.empty();
  if (ground.found)
    for (std::size_t i = 0; i < points.size(); ++i) {
      const std::size_t b = blocks.of(points[i]);
      ground.is_ground[i] = near[b] && above[i] <= kBand * noise[b];
    }
  ground.surface = std::move(field);
  return ground;
}

}  // namespace bisector
