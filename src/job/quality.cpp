#include "job/quality.h"

#include <fmt/format.h>

#include <utility>

#include "bisector/error.h"
#include "core/magnitude.h"
#include "core/stopwatch.h"
#include "mesh/tet_topology.h"

namespace bisector::job {
namespace {

// Squares of lengths are doubles without loss between these.
constexpr double kLeastMeasured = 1e-150, kMostMeasured = 1e150;

// Throws Error.
void require_measurable(const Domain& domain, const std::string& path) {
  const double largest = largest_coordinate(domain.tets ? domain.tets->vertices : domain.surface->vertices);
  if (largest > kMostMeasured || (0 < largest && largest < kLeastMeasured))
    throw Error(fmt::format("{}the largest coordinate is {:g}, where areas are no longer numbers; scale the mesh",
                            path.empty() ? "" : path + ": ", largest));
}

}  // namespace

Json measured_size_json(const Domain& domain) {
  return domain.tets ? size_json(*domain.tets) : input_json(*domain.surface);
}

void QualityJob::add_options(CLI::App* app) {
  add_file(app, "--reference", reference_file, "IN", "also measure the two-sided distance to this mesh", kMeshInputs)
      ->group("Output");
  add_threads(app, threads);
}

void QualityJob::read(Journal& journal) {
  const Stopwatch reading;
  mesh = read_domain(input, given.mesh, true, journal);
  if (given.reference || !reference_file.empty())
    reference = read_domain(reference_file, given.reference, true, journal);
  require_measurable(mesh, input);
  if (reference.surface) require_measurable(reference, reference_file);
  seconds["io"] = reading.seconds();
}

void QualityJob::compute(Journal& journal) {
  const Stopwatch measuring;
  measures.quality = measure_quality(*mesh.surface);
  if (mesh.tets) {
    measures.tets = measure_tet_quality(*mesh.tets);
    measures.tet_topology = analyse_tet_topology(*mesh.tets);
  }
  journal.phase("looking for self-intersections");
  measures.self_intersections = count_self_intersections(*mesh.surface, journal.context());
  if (reference.surface) {
    journal.phase("measuring the distance to " + (reference_file.empty() ? "the reference" : reference_file));
    measures.distance = measure_distance(*mesh.surface, *reference.surface, journal.context());
  }
  seconds["quality"] = measuring.seconds();
}

Json QualityJob::report(Journal&) {
  Json report = start_report(command());
  report["input"] = measured_size_json(mesh);
  if (reference.surface) report["reference"] = measured_size_json(reference);
  report["seconds"] = nullptr;
  Json quality = quality_json(measures.quality);
  if (mesh.tets) add_tets(quality, measures.tets);
  quality["self_intersections"] = measures.self_intersections;
  if (reference.surface) add_distance(quality, measures.distance);
  report["quality"] = std::move(quality);
  report["topology"] = topology_json(measures.quality.topology);
  if (mesh.tets) add_tets(report["topology"], measures.tet_topology);
  return report;
}

view::Scene QualityJob::scene(const std::string&) {
  view::Scene scene;
  std::vector<std::vector<std::int32_t>> labels, regions;
  const auto add = [&](const std::string& title, const std::string& file, const Domain& domain) {
    scene.models.push_back(domain.tets
                               ? view::solid_model(title, file, *domain.tets, boundary_facets(domain.tets->tets))
                               : view::surface_model(title, file, *domain.surface));
    labels.push_back(domain.tets ? std::vector<std::int32_t>{} : domain.surface->labels);
    regions.push_back(domain.tets ? domain.tets->regions : std::vector<std::int32_t>{});
  };
  if (reference.surface) add("Reference", reference_file, reference);
  add("Mesh", input, mesh);
  view::measure_shapes(scene);
  if (reference.surface) view::measure_distances(scene);
  view::add_labels(scene, {"label", "Face label", "", view::Element::triangle}, labels);
  view::add_labels(scene, {"region", "Region", "", view::Element::tet}, regions);
  return scene;
}

}  // namespace bisector::job
