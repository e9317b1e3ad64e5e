// remesh: a high-quality triangle mesh of a surface.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "bisector/attributes.h"
#include "bisector/quality.h"
#include "bisector/remesh.h"
#include "job/job.h"
#include "job/outputs.h"
#include "job/saved_run.h"

namespace bisector::job {

class RemeshJob final : public Job {
 public:
  const char* command() const override { return "remesh"; }
  InputKind input_kind() const override { return {"IN", "surface to remesh", kMeshInputs}; }
  std::vector<OutputKind> outputs() const override;
  void add_options(CLI::App* app) override;
  void check_usage(const Usage& usage) override;
  std::vector<std::string> input_files() const override {
    return {input, seeds_, feature_file_, keep_vertices_, keep_faces_};
  }
  void plan(std::string_view output, const std::string& name) override;
  void read(Journal& journal) override;
  void check_format(std::string_view output, const std::string& path, Journal& journal) const override;
  void compute(Journal& journal) override;
  Json report(Journal& journal) override;
  view::Scene scene(const std::string& output) override;
  void write(std::string_view output, const std::string& path, const std::vector<std::string>& warnings) override;
  std::vector<ArrayView> arrays() override;
  const std::vector<Attribute>& attributes() const override { return result.mesh.attributes; }
  std::string goes_on_from() const override { return saved_.path(); }
  std::string checkpoint_file() const override { return saved_.wanted_path(); }
  void finish() override { saved_.remove(); }

  std::shared_ptr<const TriangleMesh> surface;  // the input
  RemeshResult result;
  QualityReport quality;  // of the result

 private:
  void add_distance_options(CLI::App* app);
  void complete_options();
  void check_distance(const Usage& usage) const;
  void keep();
  Fingerprint fingerprint() const;
  void carry(Journal& journal);
  std::string map_text() const;
  Index face_of(Index triangle) const {
    return surface->face_of_triangle.empty() ? triangle : surface->face_of_triangle[triangle];
  }
  const TriangleMesh& remeshed_surface() const { return wrapped_.is_null() ? *surface : wrap_mesh_; }

  std::string seeds_, feature_file_;
  std::string keep_vertices_, keep_faces_;
  std::string attribute_;             // of the input's vertices, a density
  double edge_length_relative_ = 0;   // of the input's diagonal; 0: not given
  double distance_max_relative_ = 0;  // likewise
  double weld_ = -1;                  // not given
  bool wants_feature_edges_ = false;  // --feature-output is given
  bool wants_map_ = false;            // --map is
  SurfaceMap map_;                    // of the result's vertices, where it is wanted or there are attributes
  std::vector<Index> map_faces_;      // for arrays(); none if it is not wanted
  WrapOption wrap_;
  RemeshOptions options_;
  SavedRun saved_;
  TriangleMesh wrap_mesh_;
  Json wrapped_;  // null: no wrap
};

}  // namespace bisector::job
