// tree: the branches of a tree from a laser scan.
#pragma once

#include <limits>
#include <string>
#include <vector>

#include "bisector/io.h"
#include "bisector/tree.h"
#include "job/job.h"
#include "tree/coverage.h"

namespace bisector::job {

class TreeJob final : public Job {
 public:
  // Of all branches together, and of the points.
  struct Measures {
    double length = 0, fitted_length = 0, volume = 0, area = 0, height = 0;
    int order = 0;
    std::size_t trunks = 0, unassigned = 0;
    std::vector<PointCoverage> coverage;  // of the points that are not left out
    double bare = 0;                      // share of the surface farther than 2 % of the height from them
  };

  const char* command() const override { return "tree"; }
  InputKind input_kind() const override { return {"POINTS", "points of a tree's surface"}; }
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

  PointCloud cloud;  // the input
  TreeResult result;
  TriangleMesh mesh;  // of the branches
  Measures measures;

 private:
  // Where the ground is: below a height, or where it is found.
  struct Ground {
    double height = -std::numeric_limits<double>::infinity();
    bool find = false;
  };
  static Ground parse_ground(const std::string& text);
  IgesUnit unit() const;

  IgesUnit unit_ = IgesUnit::metre;
  bool has_unit_ = false;    // asked for
  std::string output_name_;  // empty: not known
  Ground ground_;
  TreeOptions options_;
  std::vector<Vec3> node_positions_;  // for arrays(), and what follows
  std::vector<double> node_radii_;
  std::vector<std::int32_t> node_parents_, node_branches_, point_branches_;
};

double share_of_height(const TreeJob::Measures& measures);

}  // namespace bisector::job
