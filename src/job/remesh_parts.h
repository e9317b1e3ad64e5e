// remesh-parts: a surface that is too large for one process.
#pragma once

#include <string>
#include <vector>

#include "bisector/quality.h"
#include "job/job.h"
#include "job/outputs.h"
#include "remesh/remesh_parts.h"

namespace bisector::job {

class RemeshPartsJob final : public Job {
 public:
  RemeshPartsJob() { options_.energy = Energy::constrained; }
  const char* command() const override { return "remesh-parts"; }
  InputKind input_kind() const override { return {"IN", "surface, binary, of triangles only", {".ply"}}; }
  std::vector<OutputKind> outputs() const override;
  void add_options(CLI::App* app) override;
  void read(Journal&) override {}
  void compute(Journal& journal) override;
  Json report(Journal& journal) override;
  view::Scene scene(const std::string& output) override;
  void write(std::string_view output, const std::string& path, const std::vector<std::string>& warnings) override;

  PartsResult result;
  QualityReport quality;

 private:
  RemeshOptions options_;
};

}  // namespace bisector::job
