// rvd: one restricted Voronoi diagram.
#pragma once

#include <string>
#include <vector>

#include "bisector/device.h"
#include "bisector/io.h"
#include "job/inputs.h"
#include "job/job.h"
#include "job/outputs.h"
#include "voronoi/diagram.h"

namespace bisector::job {

class RvdJob final : public Job {
 public:
  const char* command() const override { return "rvd"; }
  InputKind input_kind() const override { return {"IN", "surface, or tetrahedra", kMeshInputs}; }
  std::vector<OutputKind> outputs() const override;
  void add_options(CLI::App* app) override;
  void check_usage(const Usage& usage) override;
  std::vector<std::string> input_files() const override { return {input, seeds_file_}; }
  void read(Journal& journal) override;
  void check_format(std::string_view output, const std::string& path, Journal& journal) const override;
  void compute(Journal& journal) override;
  Json report(Journal& journal) override;
  view::Scene scene(const std::string& output) override;
  void write(std::string_view output, const std::string& path, const std::vector<std::string>& warnings) override;
  std::vector<ArrayView> arrays() override;

  Domain domain;  // the input
  std::vector<Vec3> seeds;
  BackendDescription device;  // that computed
  EvaluationReport evaluation;
  Diagram diagram;  // of tetrahedra: polygons and dual triangles are those of the boundary

 private:
  void compute_surface(Journal& journal);
  void compute_solid(Journal& journal);
  // Whether the cells' masses add up to that of the domain.
  void check_mass(double mass, double tolerance, const char* what, Journal& journal) const;
  void note_seconds(double computing);
  const PolygonMesh& cells();
  const ClippedPolyhedra& pieces();
  std::vector<std::array<Index, 2>> element_pairs();

  std::string seeds_file_;
  std::size_t count_ = 0;
  std::uint64_t random_seed_ = 1;
  ComputeOptions compute_;
  // Made when they are asked for.
  PolygonMesh cells_;
  ClippedPolyhedra pieces_;  // of cells cut up by the tetrahedra
  std::vector<std::array<Index, 2>> pairs_;
  // For arrays().
  std::vector<double> masses_, energies_;
  std::vector<Vec3> centroids_;
  std::vector<Triangle> rdt_;
  std::vector<Tetrahedron> dual_tets_;
  std::vector<Index> cell_offsets_;
};

}  // namespace bisector::job
