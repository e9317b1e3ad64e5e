#include "distributed/distributed_backend.h"

#include <fmt/format.h>

#include <atomic>
#include <cmath>
#include <map>
#include <string>
#include <utility>

#include "checkpoint/bytes.h"
#include "core/parallel.h"
#include "core/processor.h"

namespace bisector {
namespace {

// First halos, in edges of squares as large as a cell. Corners of cells are mostly nearer than one, the sixth nearest
// seed than two.
constexpr double kFirstHalo = 3;

struct Command {
  enum class Kind { divide, read, evaluate, project, figures, drop, end };
  Kind kind = Kind::end;
  std::uint64_t domain = 0;
  NeighbourSource source = NeighbourSource::nearest;
  Want want = Want::moments;
  double halo = 0;
  unsigned threads = 0;
  std::uint64_t number = 0;  // of a diagram; of vertices that are wanted
};

std::string bytes_of(const Command& command) { return ByteWriter().put(command).take(); }
Command command_of(const std::string& bytes) { return ByteReader(bytes).get<Command>(); }

std::uint64_t next_domain() {
  static std::atomic<std::uint64_t> next = 0;
  return next++;
}

std::string bytes_of(const SurfacePart& part, const Regions& regions) {
  return ByteWriter()
      .put_all(regions.nodes())
      .put_all(part.mesh.vertices)
      .put_all(part.mesh.triangles)
      .put_all(part.density)
      .put_all(part.triangle)
      .take();
}

std::unique_ptr<PartDiagram> part_of(const std::string& bytes, int rank) {
  ByteReader reader(bytes);
  std::vector<Regions::Node> nodes;
  SurfacePart part;
  reader.get_all(nodes);
  reader.get_all(part.mesh.vertices);
  reader.get_all(part.mesh.triangles);
  reader.get_all(part.density);
  reader.get_all(part.triangle);
  reader.end();
  return std::make_unique<PartDiagram>(std::move(part), Regions(std::move(nodes)), rank);
}

// Facets weigh by their number and by their mass, for each brings a pair and each cell some more.
Regions divide(const Surface& surface, int ranks) {
  const std::size_t n = surface.facets.size();
  std::vector<Vec3> centres(n);
  std::vector<double> weights(n);
  parallel_each(n, [&](std::size_t k) {
    const Vec3* corners = surface.facets[k].corners;
    centres[k] = kThird * (corners[0] + corners[1] + corners[2]);
    weights[k] = 1 / static_cast<double>(n) + surface.summaries[k].moments.mass / surface.mass;
  });
  return Regions(centres, weights, ranks);
}

SurfacePart part_of(const Surface& surface, const Regions& regions, int rank) {
  SurfacePart part;
  std::vector<Index> place(surface.mesh.vertices.size(), kNone);
  for (Index t = 0; t < surface.facet_of.size(); ++t) {
    if (surface.facet_of[t] == kNone) continue;
    const Vec3* corners = surface.facets[surface.facet_of[t]].corners;
    if (regions.at(kThird * (corners[0] + corners[1] + corners[2])) != rank) continue;
    part.triangle.push_back(t);
    for (const Index v : surface.mesh.triangles[t]) place[v] = 0;
  }
  for (Index v = 0; v < place.size(); ++v) {
    if (place[v] == kNone) continue;
    place[v] = static_cast<Index>(part.mesh.vertices.size());
    part.mesh.vertices.push_back(surface.mesh.vertices[v]);
    if (!surface.density.empty()) part.density.push_back(surface.density[v]);
  }
  for (const Index t : part.triangle) {
    const Triangle& v = surface.mesh.triangles[t];
    part.mesh.triangles.push_back({place[v[0]], place[v[1]], place[v[2]]});
  }
  return part;
}

// The parts that a rank other than 0 has.
class Server {
 public:
  explicit Server(Ranks& ranks) : ranks_(ranks) {}

  // False at the end.
  bool follow(const Command& command) {
    const ThreadLimit limit(std::min(command.threads, thread_count()));
    switch (command.kind) {
      case Command::Kind::divide:
        parts_[command.domain] = part_of(ranks_.exchange(nothing()).front(), ranks_.rank());
        break;
      case Command::Kind::read:
        parts_[command.domain] = read_divided(ranks_, ranks_.broadcast({}), command.number).part;
        break;
      case Command::Kind::evaluate:
        part(command).evaluate(ranks_, {}, command.source, command.want, command.halo, command.number, diagram_);
        break;
      case Command::Kind::project: part(command).project(ranks_, command.number, {}); break;
      case Command::Kind::figures: ranks_.gather(part(command).figures()); break;
      case Command::Kind::drop: parts_.erase(command.domain); break;
      case Command::Kind::end: return false;
    }
    return true;
  }

 private:
  std::vector<std::string> nothing() const { return std::vector<std::string>(static_cast<std::size_t>(ranks_.size())); }
  PartDiagram& part(const Command& command) {
    const auto found = parts_.find(command.domain);
    if (found == parts_.end()) throw Error("this part of the surface could not be set up");
    return *found->second;
  }

  Ranks& ranks_;
  std::map<std::uint64_t, std::unique_ptr<PartDiagram>> parts_;
  Diagram diagram_;
};

}  // namespace

DistributedBackend::DistributedBackend(const Surface& surface, NeighbourSource source, Ranks& ranks)
    : Backend(surface, surface.mass, Want::polygons | Want::dual), ranks_(ranks), source_(source),
      domain_(next_domain()), area_(surface.area) {
  ranks.together([&] {
    ranks.broadcast(bytes_of(Command{Command::Kind::divide, domain_, source, {}, 0, thread_count()}));
    const Regions regions = divide(surface, ranks.size());
    std::vector<std::string> parts;
    for (int rank = 0; rank < ranks.size(); ++rank) parts.push_back(bytes_of(part_of(surface, regions, rank), regions));
    part_ = part_of(ranks.exchange(std::move(parts)).front(), 0);
  });
}

DistributedBackend::DistributedBackend(const std::string& path, std::size_t wanted, NeighbourSource source,
                                       Ranks& ranks)
    : DistributedBackend(read(path, wanted, ranks), source, ranks) {}

DistributedBackend::DistributedBackend(ReadSurface surface, NeighbourSource source, Ranks& ranks)
    : Backend(surface.divided.area, Want::polygons | Want::dual), ranks_(ranks), source_(source),
      domain_(surface.domain), stays_(true), area_(surface.divided.area), divided_(std::move(surface.divided)),
      part_(std::move(divided_.part)) {}

DistributedBackend::ReadSurface DistributedBackend::read(const std::string& path, std::size_t wanted, Ranks& ranks) {
  ReadSurface result{{}, next_domain()};
  ranks.together([&] {
    ranks.broadcast(bytes_of(Command{Command::Kind::read, result.domain, {}, {}, 0, thread_count(), wanted}));
    result.divided = read_divided(ranks, ranks.broadcast(path), wanted);
  });
  return result;
}

DistributedBackend::~DistributedBackend() {
  try {
    ranks_.together([&] { ranks_.broadcast(bytes_of(Command{Command::Kind::drop, domain_, {}, {}, 0, 1})); });
  } catch (...) {
    // Ranks keep a part that nobody asks for again.
  }
}

BackendDescription DistributedBackend::description() const {
  return {fmt::format("{}, {} ranks", processor_name(), ranks_.size()), "cpu", "double", {}};
}

std::vector<PartFigures> DistributedBackend::figures() {
  std::vector<PartFigures> figures;
  ranks_.together([&] {
    ranks_.broadcast(bytes_of(Command{Command::Kind::figures, domain_, {}, {}, 0, 1}));
    figures = ranks_.gather(part_->figures());
  });
  return figures;
}

EvaluationReport DistributedBackend::compute(const std::vector<Vec3>& seeds, Want want, Diagram& diagram) {
  EvaluationReport report;
  const double halo = kFirstHalo * std::sqrt(area_ / static_cast<double>(seeds.size()));
  const std::uint64_t number = stays_ ? ++diagrams_ : 0;
  ranks_.together([&] {
    ranks_.broadcast(bytes_of(Command{Command::Kind::evaluate, domain_, source_, want, halo, thread_count(), number}));
    const PairCounts counts = part_->evaluate(ranks_, seeds, source_, want, halo, number, diagram);
    report.certification.pairs = counts.pairs;
    report.certification.uncertain = report.certification.cpu = counts.uncertain;
    report.certification.wider = counts.wider;
  });
  return report;
}

void DistributedBackend::project(const CellMoments& cells, std::span<const SeedPlace> places, std::span<Vec3> seeds,
                                 std::vector<Vec3>& normals) {
  if (!stays_) return Backend::project(cells, places, seeds, normals);
  std::vector<Foot> feet;
  ranks_.together([&] {
    ranks_.broadcast(bytes_of(Command{Command::Kind::project, domain_, {}, {}, 0, thread_count(), cells.number}));
    feet = part_->project(ranks_, cells.number, {seeds.begin(), seeds.end()});
  });
  normals.resize(seeds.size());
  parallel_each(feet.size(), [&](std::size_t k) {
    const Foot& foot = feet[k];
    if (!places.empty() && places[foot.seed].kind == SeedPlace::Kind::interior) return;
    seeds[foot.seed] = foot.at;
    normals[foot.seed] = foot.normal;
  });
}

void serve(Ranks& ranks) {
  Server server(ranks);
  for (bool more = true; more;) try {
      ranks.together([&] { more = server.follow(command_of(ranks.broadcast({}))); });
    } catch (...) {
      // Rank 0 has been told, or has told this one.
    }
}

void end_serving(Ranks& ranks) noexcept {
  for (;;) try {
      ranks.together([&] { ranks.broadcast(bytes_of(Command{})); });
      return;
    } catch (...) {
      // Of what was computed last, or here: the command was lost with it.
    }
}

}  // namespace bisector
