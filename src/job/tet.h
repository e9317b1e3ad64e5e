// tet: a high-quality tetrahedral mesh of a solid.
#pragma once

#include <string>
#include <vector>

#include "bisector/quality.h"
#include "bisector/second_order.h"
#include "bisector/tetmesh.h"
#include "job/inputs.h"
#include "job/job.h"
#include "job/outputs.h"
#include "job/saved_run.h"

namespace bisector::job {

class TetJob final : public Job {
 public:
  struct Measures {
    TetQualityReport tets;
    QualityReport boundary;
    TetTopology topology;
  };

  const char* command() const override { return "tet"; }
  InputKind input_kind() const override { return {"IN", "closed surface or tetrahedral mesh", kMeshInputs}; }
  std::vector<OutputKind> outputs() const override;
  void add_options(CLI::App* app) override;
  void check_usage(const Usage& usage) override;
  std::vector<std::string> input_files() const override;
  void read(Journal& journal) override;
  void check_format(std::string_view output, const std::string& path, Journal& journal) const override;
  void compute(Journal& journal) override;
  Json report(Journal& journal) override;
  view::Scene scene(const std::string& output) override;
  void write(std::string_view output, const std::string& path, const std::vector<std::string>& warnings) override;
  std::vector<ArrayView> arrays() override;
  std::string goes_on_from() const override { return saved_.path(); }
  std::string checkpoint_file() const override { return saved_.wanted_path(); }
  void finish() override { saved_.remove(); }
  const std::vector<Attribute>& attributes() const override { return result.mesh.attributes; }

  Domain domain;  // the input
  TetResult result;
  SecondOrder order;  // of the result, if that is asked for
  Measures measures;  // of the result

 private:
  void complete_options();
  // What the walls of the result follow: the input's surface with the interfaces between its regions, or its wrap.
  const TriangleMesh& walls() const { return wrapped_.is_null() ? *walls_ : wrap_mesh_; }
  Fingerprint fingerprint() const;
  void carry(Journal& journal);
  void curve(Journal& journal);

  std::string seeds_, sizes_, feature_file_;
  std::string attribute_;            // of the input's vertices, a density
  double edge_length_relative_ = 0;  // of the input's diagonal; 0: not given
  double weld_ = -1;                 // not given
  WrapOption wrap_;
  TetOptions options_;
  SavedRun saved_;
  std::shared_ptr<const TriangleMesh> walls_;  // on the input's vertices
  TriangleMesh wrap_mesh_;
  Json wrapped_;  // null: no wrap
  int order_ = 1;
  SecondOrderReport curved_;
};

}  // namespace bisector::job
