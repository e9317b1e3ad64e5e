// quality: angles, topology and distance of a mesh.
#pragma once

#include <string>
#include <vector>

#include "bisector/quality.h"
#include "job/inputs.h"
#include "job/job.h"
#include "job/outputs.h"

namespace bisector::job {

class QualityJob final : public Job {
 public:
  struct Measures {
    QualityReport quality;
    std::size_t self_intersections = 0;
    DistanceReport distance;  // if there is a reference
    TetQualityReport tets;    // if there are tetrahedra; then the others are the boundary's
    TetTopology tet_topology;
  };

  const char* command() const override { return "quality"; }
  InputKind input_kind() const override { return {"MESH", "surface or tetrahedral mesh to measure", kMeshInputs}; }
  std::vector<OutputKind> outputs() const override { return {}; }
  void add_options(CLI::App* app) override;
  std::vector<std::string> input_files() const override { return {input, reference_file}; }
  void read(Journal& journal) override;
  void compute(Journal& journal) override;
  Json report(Journal& journal) override;
  view::Scene scene(const std::string& output) override;
  void write(std::string_view, const std::string&, const std::vector<std::string>&) override {}

  std::string reference_file;
  Domain mesh, reference;  // the reference's surface is null if there is none
  Measures measures;
};

Json measured_size_json(const Domain& domain);

}  // namespace bisector::job
