#include "job/remesh_parts.h"

#include <fmt/format.h>

#include "bisector/io.h"
#include "bisector/preview.h"
#include "core/stopwatch.h"
#include "job/inputs.h"
#include "job/messages.h"
#include "job/options.h"
#include "job/report.h"
#include "job/words.h"

namespace bisector::job {
namespace {

Json ranks_json(const std::vector<PartFigures>& ranks) {
  Json all = Json::array();
  for (const PartFigures& rank : ranks)
    all.push_back({{"triangles", rank.facets},
                   {"vertices", rank.home_seeds},
                   {"halo_vertices", rank.halo_seeds},
                   {"halo", rank.halo},
                   {"bytes_sent", rank.bytes_sent},
                   {"memory", rank.memory}});
  return all;
}

}  // namespace

std::vector<OutputKind> RemeshPartsJob::outputs() const {
  return {{"output", "-o", "FILE", with_extensions("mesh to write", kMeshFormats), kMeshFormats, true},
          {"preview", "--preview", "FILE.png", "draw a picture of the result", {".png"}, false, false, "preview"}};
}

void RemeshPartsJob::add_options(CLI::App* app) {
  app->add_option("-n", options_.vertices, "vertices of the result, at least 4")
      ->type_name("N")
      ->transform(whole_number(4, kMostSeeds))
      ->required()
      ->group("Seeds");
  add_random_seed(app, options_.random_seed, "another number, another start; default 1")->group("Seeds");
  add_words(app, "--energy", options_.energy, kPlainEnergyWords, "ccvt (seeds on the surface; default) or rcvt (free)")
      ->group("Optimisation");
  add_iterations(app, options_.iterations,
                 "at most so many per level, and no more than 30 on the\n"
                 "whole surface; default 100");
  add_tolerance(app, options_.tolerance,
                "end a level when the energy falls by less than this\n"
                "share per iteration; default 1e-6");
  add_words(app, "--neighbors", options_.compute.neighbours, kNeighbourWords,
            "where neighbours of seeds come from: auto, nearest or\n"
            "delaunay; the result is the same")
      ->group("Computation");
  add_threads(app, threads);
}

void RemeshPartsJob::compute(Journal& journal) {
  journal.phase("reading " + input + " in parts");
  result = remesh_parts(input, options_, journal.context());
  if (result.untiled > 0)
    throw Error(fmt::format("the final diagram does not tile {} of the input; please report this as a bug",
                            counted(result.untiled, "triangle", "triangles")));
  if (result.mesh.triangles.empty())
    throw Error("the seeds are too few to span a triangle of this surface; ask for more vertices");
  if (!result.topology.manifold) journal.warn("the output is not manifold; ask for more vertices");
  const Stopwatch measuring;
  quality = measure_quality(result.mesh);
  seconds = {{"total", 0.0},
             {"reading", result.seconds_reading},
             {"stand_in", result.seconds_stand_in},
             {"whole", result.seconds_on_all},
             {"quality", measuring.seconds()},
             {"io", 0.0}};
}

Json RemeshPartsJob::report(Journal&) {
  Json report = start_report(command());
  report["device"] = device_json(result.device);
  report["input"] = {{"vertices", result.input_vertices}, {"faces", result.input_triangles}, {"area", result.area}};
  report["output"] = output_json(result.mesh);
  report["stand_in"] = {{"faces", result.stand_in_triangles}};
  report["iterations"] = result.iterations;
  report["iterations_whole"] = result.iterations_on_all;
  report["energy"] = result.energy;
  report["seconds"] = nullptr;
  report["certification"] = certification_json(result.certification);
  report["quality"] = quality_json(quality);
  report["topology"] = topology_json(result.topology);
  report["ranks"] = ranks_json(result.ranks);
  return report;
}

view::Scene RemeshPartsJob::scene(const std::string& output) {
  view::Scene scene;
  scene.models = {view::surface_model("Result", output, result.mesh)};
  view::measure_shapes(scene);
  return scene;
}

void RemeshPartsJob::write(std::string_view output, const std::string& path, const std::vector<std::string>&) {
  if (output == "output") write_mesh(path, result.mesh);
  else write_preview(path, result.mesh);
}

}  // namespace bisector::job
