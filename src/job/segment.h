// segment: the planes, quadrics and tori that make up a surface.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "bisector/polygonise.h"
#include "bisector/region_borders.h"
#include "bisector/segment.h"
#include "job/job.h"
#include "job/outputs.h"

namespace bisector::job {

class SegmentJob final : public Job {
 public:
  const char* command() const override { return "segment"; }
  InputKind input_kind() const override { return {"IN", "surface", kMeshInputs}; }
  std::vector<OutputKind> outputs() const override;
  void add_options(CLI::App* app) override;
  void check_usage(const Usage& usage) override;
  void plan(std::string_view output, const std::string& name) override;
  void read(Journal& journal) override;
  void check_format(std::string_view output, const std::string& path, Journal& journal) const override;
  void compute(Journal& journal) override;
  Json report(Journal& journal) override;
  view::Scene scene(const std::string& output) override;
  void write(std::string_view output, const std::string& path, const std::vector<std::string>& warnings) override;
  std::vector<ArrayView> arrays() override;

  const SegmentOptions& options() const { return options_; }

  std::shared_ptr<const TriangleMesh> surface;  // the input
  double diagonal = 0;                          // of its bounding box
  SegmentResult result;
  TriangleMesh mesh;  // the input, labelled by region and moved where that was asked for
  std::optional<PolygonisedMesh> polygons;

 private:
  using Colour = std::array<unsigned char, 3>;

  void polygonise(Journal& journal);
  const RegionBorders& borders();

  SegmentOptions options_;
  PolygoniseOptions polygonise_;
  bool triangulate_ = false;
  std::string polygons_name_;  // for warnings; empty: not wanted
  std::optional<RegionBorders> borders_;
  std::vector<Colour> colours_;         // of regions
  std::vector<Index> polygon_offsets_;  // for arrays()
};

Json polygons_json(const PolygonisedMesh& polygons);

}  // namespace bisector::job
