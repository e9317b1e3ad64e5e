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
  std::uint64_t number = 0;  // of a diagram
  std::size_t wanted = 0;    // vertices
  unsigned threads = thread_count();
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

std::unique_ptr<PartDiagram> part_diagram_of(const std::string& bytes, int rank) {
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

// What each rank gets. Facets weigh by their number and by their mass, for each brings a pair and each cell some more.
std::vector<std::string> divide(const Surface& surface, int ranks) {
  const std::size_t n = surface.facets.size();
  std::vector<Vec3> centres(n);
  std::vector<double> weights(n);
  parallel_each(n, [&](std::size_t k) {
    const Vec3* corners = surface.facets[k].corners;
    centres[k] = kThird * (corners[0] + corners[1] + corners[2]);
    weights[k] = 1 / static_cast<double>(n) + surface.summaries[k].moments.mass / surface.mass;
  });
  const Regions regions(centres, weights, ranks);
  std::vector<std::vector<Index>> triangles(static_cast<std::size_t>(ranks));
  for (Index t = 0; t < surface.facet_of.size(); ++t) {
    const Index facet = surface.facet_of[t];
    if (facet != kNone) triangles[static_cast<std::size_t>(regions.at(centres[facet]))].push_back(t);
  }
  std::vector<std::string> parts;
  for (std::vector<Index>& some : triangles) parts.push_back(bytes_of(part_of(surface, std::move(some)), regions));
  return parts;
}

// The parts that a rank other than 0 has.
class Server {
 public:
  explicit Server(Ranks& ranks) : ranks_(ranks) {}

  // False at the end.
  bool follow(const Command& command) {
    const ThreadLimit limit(std::min(command.threads, thread_count()));
    switch (command.kind) {
      case Command::Kind::divide: parts_[command.domain] = part_diagram_of(ranks_.scatter({}), ranks_.rank()); break;
      case Command::Kind::read:
        parts_[command.domain] = read_divided(ranks_, ranks_.broadcast({}), command.wanted).part;
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

FileOfRanks read_on_all(const std::string& path, std::size_t wanted, Ranks& ranks) {
  FileOfRanks file;
  file.domain = next_domain();
  ranks.together([&] {
    ranks.broadcast(bytes_of({.kind = Command::Kind::read, .domain = file.domain, .wanted = wanted}));
    static_cast<DividedSurface&>(file) = read_divided(ranks, ranks.broadcast(path), wanted);
  });
  return file;
}

DistributedBackend::DistributedBackend(const Surface& surface, NeighbourSource source, Ranks& ranks)
    : Backend(surface, surface.mass, Want::polygons | Want::dual), ranks_(ranks), source_(source),
      domain_(next_domain()), area_(surface.area) {
  ranks.together([&] {
    ranks.broadcast(bytes_of({.kind = Command::Kind::divide, .domain = domain_}));
    part_ = part_diagram_of(ranks.scatter(divide(surface, ranks.size())), ranks.rank());
  });
}

DistributedBackend::DistributedBackend(FileOfRanks& file, NeighbourSource source, Ranks& ranks)
    : Backend(file.area, Want::polygons | Want::dual), ranks_(ranks), source_(source), domain_(file.domain),
      stays_(true), area_(file.area), part_(std::move(file.part)) {}

DistributedBackend::~DistributedBackend() {
  try {
    ranks_.together([&] { ranks_.broadcast(bytes_of({.kind = Command::Kind::drop, .domain = domain_})); });
  } catch (...) {
    // Ranks keep a part that nobody asks for again.
  }
}

BackendDescription DistributedBackend::description() const {
  return {fmt::format("{}, {} {}", processor_name(), ranks_.size(), ranks_.size() == 1 ? "rank" : "ranks"),
          "ranks",
          "double",
          {}};
}

std::vector<PartFigures> DistributedBackend::figures() {
  std::vector<PartFigures> figures;
  ranks_.together([&] {
    ranks_.broadcast(bytes_of({.kind = Command::Kind::figures, .domain = domain_}));
    figures = ranks_.gather(part_->figures());
  });
  return figures;
}

EvaluationReport DistributedBackend::compute(const std::vector<Vec3>& seeds, Want want, Diagram& diagram) {
  EvaluationReport report;
  const double halo = kFirstHalo * std::sqrt(area_ / static_cast<double>(seeds.size()));
  const std::uint64_t number = stays_ ? ++diagrams_ : 0;
  ranks_.together([&] {
    ranks_.broadcast(bytes_of({.kind = Command::Kind::evaluate,
                               .domain = domain_,
                               .source = source_,
                               .want = want,
                               .halo = halo,
                               .number = number}));
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
    ranks_.broadcast(bytes_of({.kind = Command::Kind::project, .domain = domain_, .number = cells.number}));
    feet = part_->project(ranks_, cells.number, seeds);
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
