#include "tetmesh/improve.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "bisector/error.h"
#include "core/stopwatch.h"
#include "mesh/tet_quality.h"
#include "tetmesh/smooth.h"
#include "tetmesh/tet_edit.h"
#include "tetmesh/tet_insert.h"
#include "tetmesh/tet_shape.h"
#include "tetmesh/tet_swap.h"

namespace bisector {
namespace {

constexpr double kGain = 1e-3;             // by which a change must at least raise the least sine of a dihedral angle
constexpr double kMeanGain = 2e-3;         // of the mean radius ratio by a round, below which no further one follows
constexpr int kLastSweeps = 2;             // of smoothing for the mean, at the end
constexpr std::size_t kCheckEvery = 1024;  // vertices or tetrahedra between two checks for cancellation
// Shares of TetImproveOptions::insert_below, up to which tetrahedra may get a new vertex. The stages follow each other:
// new vertices are few, and the worst tetrahedra have the first choice.
constexpr std::array<double, 4> kInsertStages{0, 0.5, 0.75, 1};
constexpr std::size_t kTrials = 4;  // places for a new vertex that are tried for each tetrahedron
// Fractions of the improvement for progress: where each of its three parts begins, and how much the first two take.
constexpr double kSmoothingFrom = 0.1, kClimbingFrom = 0.5, kLastFrom = 0.9, kPart = 0.4;

double sine(double degrees) { return std::sin(degrees * std::numbers::pi / 180); }

// Tetrahedra and their shapes, ascending.
using Shapes = std::vector<std::pair<Index, double>>;

class Improver {
 public:
  Improver(const TetMesh& mesh, const TetImproveOptions& options, TetImproveReport& report, const Context& context)
      : edit_(mesh), smoother_(edit_, options.slide), options_(options), report_(report), context_(context),
        goal_(sine(options.goal)),
        insertions_left_(static_cast<std::size_t>(options.insertions * static_cast<double>(mesh.vertices.size()))),
        touched_(mesh.vertices.size(), 0) {}

  void run();
  TetMesh mesh(std::vector<Index>& slots) const { return edit_.mesh(slots); }

 private:
  void report_progress(const char* phase, int round, double fraction) const;
  void smooth_all(double floor, bool steep);
  double least_shape() const;
  double mean_ratio() const;
  // Tries to improve all tetrahedra with a shape below the goal, worst first; returns how many it could.
  std::size_t climb();
  bool mend(Index t);
  bool swap(Index t);
  bool smooth(Index t);
  bool contract(Index t);
  bool may_insert(Index t) const { return insertions_left_ && edit_.tet(t).shape < insert_below_; }
  bool insert_vertex(Index t);
  // The tetrahedra at the vertices whose shape is `beat` or less.
  Shapes poor_around(const std::vector<Index>& vertices, double beat);
  // Whether each changed tetrahedron has a shape above `beat`, or was among the poor ones before and is no worse.
  bool worth_keeping(const std::vector<Index>& changed, const Shapes& poor, double beat) const;
  // Notes that something changed at the tetrahedra's vertices.
  void touch(const std::vector<Index>& tets);
  // Whether everything was tried on the tetrahedron in vain and nothing has changed at its vertices since.
  bool tried(Index t) const;

  TetEdit edit_;
  TetSmoother smoother_;
  const TetImproveOptions& options_;
  TetImproveReport& report_;
  const Context& context_;
  double goal_;
  double insert_below_ = 0;  // tetrahedra with a smaller shape may get a vertex now
  std::size_t insertions_left_;

  // Of everything that could be tried on a tetrahedron.
  struct Failure {
    Tetrahedron corners;  // of the tetrahedron that was in the slot then
    std::uint64_t time;
    bool insert;  // a new vertex was tried, too
  };
  std::uint64_t time_ = 1;
  std::vector<std::uint64_t> touched_;  // of each vertex, when something around it changed
  std::vector<Failure> failures_;       // of each slot
};

void Improver::report_progress(const char* phase, int round, double fraction) const {
  context_.check();
  Progress progress;
  progress.phase = phase;
  progress.iteration = round;
  progress.iterations = options_.rounds;
  progress.fraction = fraction;
  context_.report(progress);
}

void Improver::smooth_all(double floor, bool steep) {
  for (Index v = 0; v < edit_.points(); ++v) {
    if (v % kCheckEvery == 0) context_.check();
    if (!smoother_.raise_ratios(v, floor, steep)) continue;
    touch(edit_.star(v));
    ++report_.moves;
  }
}

double Improver::least_shape() const {
  double least = 1;
  for (Index t = 0; t < edit_.size(); ++t)
    if (edit_.tet(t).alive) least = std::min(least, edit_.tet(t).shape);
  return least;
}

double Improver::mean_ratio() const {
  double sum = 0;
  std::size_t count = 0;
  for (Index t = 0; t < edit_.size(); ++t) {
    if (!edit_.tet(t).alive) continue;
    const Tetrahedron& c = edit_.tet(t).corners;
    sum += radius_ratio(edit_.point(c[0]), edit_.point(c[1]), edit_.point(c[2]), edit_.point(c[3]));
    ++count;
  }
  return count ? sum / static_cast<double>(count) : 0;
}

bool Improver::swap(Index t) {
  TetSwap best;
  best.shape = edit_.tet(t).shape + kGain;
  const bool edge = find_edge_removal(edit_, t, best);
  const bool face = find_face_removal(edit_, t, best);
  if (!(edge || face) || !edit_.replace(best.old, best.fresh)) return false;
  touch(edit_.added());
  ++(face ? report_.face_removals : report_.edge_removals);
  return true;
}

bool Improver::smooth(Index t) {
  const double before = edit_.tet(t).shape;
  for (const Index v : Tetrahedron(edit_.tet(t).corners))
    if (smoother_.raise_minimum(v, goal_)) {
      touch(edit_.star(v));
      ++report_.moves;
    }
  return edit_.tet(t).shape > before + kGain;
}

bool Improver::contract(Index t) {
  TetSwap best;
  best.shape = edit_.tet(t).shape + kGain;
  if (!find_contraction(edit_, t, best) || !edit_.replace(best.old, best.fresh)) return false;
  touch(edit_.added());
  ++report_.contractions;
  return true;
}

void Improver::touch(const std::vector<Index>& tets) {
  touched_.resize(edit_.points(), 0);
  ++time_;
  for (const Index t : tets)
    for (const Index v : edit_.tet(t).corners) touched_[v] = time_;
}

bool Improver::tried(Index t) const {
  if (t >= failures_.size()) return false;
  const Failure& failure = failures_[t];
  const Tetrahedron& corners = edit_.tet(t).corners;
  return failure.corners == corners && (failure.insert || !may_insert(t)) &&
         std::all_of(corners.begin(), corners.end(), [&](Index v) { return touched_[v] <= failure.time; });
}

Shapes Improver::poor_around(const std::vector<Index>& vertices, double beat) {
  Shapes poor;
  for (const Index v : vertices)
    for (const Index t : edit_.star(v))
      if (edit_.tet(t).shape <= beat) poor.push_back({t, edit_.tet(t).shape});
  std::sort(poor.begin(), poor.end());
  return poor;
}

bool Improver::worth_keeping(const std::vector<Index>& changed, const Shapes& poor, double beat) const {
  return std::all_of(changed.begin(), changed.end(), [&](Index t) {
    const double shape = edit_.tet(t).shape;
    if (shape > beat) return true;
    const auto before = std::lower_bound(poor.begin(), poor.end(), std::pair(t, 0.0));
    return before != poor.end() && before->first == t && shape >= before->second;
  });
}

bool Improver::insert_vertex(Index t) {
  const double beat = edit_.tet(t).shape + kGain;
  std::size_t tries = 0;
  for (const TetInsertion& insertion : find_insertions(edit_, t)) {
    if (++tries > kTrials) break;
    edit_.begin();
    const Index v = edit_.add_point(insertion.point);
    std::vector<Tetrahedron> fresh;
    std::vector<Index> around;
    for (const Triangle& f : insertion.facets) {
      fresh.push_back({v, f[0], f[1], f[2]});
      around.insert(around.end(), f.begin(), f.end());
    }
    std::sort(around.begin(), around.end());
    around.erase(std::unique(around.begin(), around.end()), around.end());
    const Shapes poor = poor_around(around, beat);
    if (edit_.replace(insertion.old, fresh)) {
      smoother_.raise_minimum(v, goal_);
      for (const Index w : around) smoother_.raise_minimum(w, goal_);
      smoother_.raise_minimum(v, goal_);
      if (const std::vector<Index> changed = edit_.changed(); worth_keeping(changed, poor, beat)) {
        edit_.keep();
        touch(changed);
        ++report_.insertions;
        --insertions_left_;
        return true;
      }
    }
    edit_.undo();
  }
  return false;
}

bool Improver::mend(Index t) { return swap(t) || smooth(t) || contract(t) || (may_insert(t) && insert_vertex(t)); }

std::size_t Improver::climb() {
  struct Item {
    double shape;
    Index tet;
    Tetrahedron corners;
  };
  std::vector<Item> queue;
  for (Index t = 0; t < edit_.size(); ++t)
    if (const TetEdit::Tet& tet = edit_.tet(t); tet.alive && tet.shape < goal_)
      queue.push_back({tet.shape, t, tet.corners});
  std::sort(queue.begin(), queue.end(),
            [](const Item& a, const Item& b) { return a.shape != b.shape ? a.shape < b.shape : a.tet < b.tet; });
  std::size_t mended = 0, done = 0;
  for (const Item& item : queue) {
    if (done++ % kCheckEvery == 0) context_.check();
    const TetEdit::Tet& tet = edit_.tet(item.tet);
    if (!tet.alive || tet.corners != item.corners || tet.shape >= goal_ || tried(item.tet)) continue;
    if (mend(item.tet)) {
      ++mended;
    } else {
      failures_.resize(edit_.size(), {});
      failures_[item.tet] = {item.corners, time_, may_insert(item.tet)};
    }
  }
  return mended;
}

void Improver::run() {
  // First the mean is raised, as long as it rises enough.
  double mean = 0;
  for (int round = 0; round < options_.rounds; ++round) {
    report_progress("smoothing", round, kSmoothingFrom + kPart * round / options_.rounds);
    smooth_all(least_shape(), true);
    climb();
    const double before = std::exchange(mean, mean_ratio());
    if (mean < before + kMeanGain) break;
  }
  std::size_t stage = 0;
  for (int round = 0; round < options_.rounds && stage < kInsertStages.size(); ++round) {
    report_progress("removing slivers", round, kClimbingFrom + kPart * round / options_.rounds);
    ++report_.rounds;
    insert_below_ = sine(kInsertStages[stage] * options_.insert_below);
    if (!climb()) ++stage;
  }
  for (int round = 0; round < kLastSweeps; ++round) {
    report_progress("smoothing", round, kLastFrom);
    smooth_all(goal_, false);
  }
}

}  // namespace

TetShapes measure_shapes(const TetMesh& mesh, double goal) {
  if (mesh.tets.empty()) return {};
  TetShapes shapes{180, 0, 1, 0, 0};
  double sum = 0;
  for (const Tetrahedron& t : mesh.tets) {
    const Vec3 &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]], &d = mesh.vertices[t[3]];
    const DihedralRange range = dihedral_range(a, b, c, d);
    shapes.dihedral_min = std::min(shapes.dihedral_min, range.min);
    shapes.dihedral_max = std::max(shapes.dihedral_max, range.max);
    shapes.below += range.min < goal;
    const double ratio = radius_ratio(a, b, c, d);
    shapes.radius_ratio_min = std::min(shapes.radius_ratio_min, ratio);
    sum += ratio;
  }
  shapes.radius_ratio_mean = sum / static_cast<double>(mesh.tets.size());
  return shapes;
}

TetImproveResult improve_tets(const TetMesh& mesh, const TetImproveOptions& options, const Context& context) {
  if (!(options.goal > 0 && options.goal <= 60))
    throw Error("the goal for dihedral angles is " + std::to_string(options.goal) +
                " degrees: give one above 0 and up to 60");
  if (!(options.insert_below >= 0 && options.insert_below <= 60))
    throw Error("new vertices are wanted for dihedral angles below " + std::to_string(options.insert_below) +
                " degrees: give 0 to 60");
  if (!(options.insertions >= 0 && options.insertions <= 10))
    throw Error("the share of new vertices is " + std::to_string(options.insertions) + ": give 0 to 10");
  const Stopwatch watch;
  TetImproveResult result;
  Improver improver(mesh, options, result.report, context);
  result.report.before = measure_shapes(mesh, options.goal);
  improver.run();
  result.mesh = improver.mesh(result.source);
  for (Index& v : result.source)
    if (v >= mesh.vertices.size()) v = kNone;
  result.report.after = measure_shapes(result.mesh, options.goal);
  result.report.seconds = watch.seconds();
  return result;
}

}  // namespace bisector
