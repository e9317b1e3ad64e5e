// A descent whose vectors stay on the device, in double precision, in lengths of the device (ResidentDescent).
#pragma once

#include <array>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "backend/seed_descent.h"
#include "host/passes/cell_pass.h"
#include "host/passes/surface_stage.h"

namespace bisector::host {

// An evaluation of resident seeds. `begin` gives them to the seed stage; `read` is called once the sums of cells are
// recorded, runs that and returns the sum of the masses, or nothing if all has to be recorded again.
using EvaluateResident = std::function<EvaluationReport(const std::function<void()>& begin,
                                                        const std::function<std::optional<double>()>& read)>;

class DeviceDescent : public ResidentDescent, private DescentVectors {
 public:
  // Whether the device and the start allow it: double precision for the vectors, room for them, all facets within one
  // binding where seeds are held on them, and lengths that leave room for products.
  static bool is_possible(SeedStage& stage, SurfaceStage& surface, const DescentStart& start);

  // Asks for all memory, and for no more later. All but the start must outlive the descent. Throws DeviceError.
  DeviceDescent(SeedStage& stage, SurfaceStage& surface, CellPass& cells, const DescentStart& start,
                EvaluateResident evaluate);
  // Takes the start to the device; before all else.
  void begin(const DescentStart& start);

  DescentVectors& vectors() override { return *this; }
  StepResult step(double length, std::size_t pair) override;
  void accept() override;
  const Kept& kept() const override { return kept_; }
  void bring_back(PlacedSeeds& seeds, CellMoments& moments, std::vector<Vec3>& gradient,
                  std::vector<Vec3>& normals) override;

 private:
  void start_direction() override;
  void project(std::size_t pair, PairPart part, double rho, bool onto) override;
  void add(std::size_t pair, PairPart part) override;
  void weigh(std::optional<std::size_t> pair, double sy) override;

  // What the direction is still to be changed by.
  struct Update {
    uint kind;
    const Buffer* by;
    uint coefficient;
  };
  // Vectors and lists of an iterate.
  struct Point {
    explicit Point(Device& device)
        : gradient(device), weights(device), positions(device), normals(device), cells(device), ranges(device),
          triangles(device) {}
    Buffer gradient, weights;
    Buffer positions;          // along each seed's curve
    Buffer normals;            // where seeds are held on the surface, like the rest
    Buffer cells;              // as CellPass leaves them
    Buffer ranges, triangles;  // of each seed
  };

  void upload_start(const DescentStart& start);
  void upload_curves(const FeatureCurves& curves);
  void update(const Update& next);
  void direct(uint product, const Buffer& factor);
  void sum_up(uint use, std::size_t kinds, const FinishPush& push);
  void move(double length);
  void measure(std::size_t pair);
  void download(const Buffer& from, std::vector<Vec3>& to, double scale);
  void download_positions(std::vector<double>& to);
  PlacedSeeds placed(std::vector<Vec3> seeds, const std::vector<double>& positions) const;
  const Buffer& part(std::size_t pair, PairPart which) const {
    return (which == PairPart::step ? steps_ : changes_)[pair];
  }
  // Lengths, areas, ... on the device to the caller's.
  double to_caller(double value, int power) const;

  SeedStage& stage_;
  SurfaceStage& surface_;
  CellPass& cells_;
  EvaluateResident evaluate_;
  Commands& commands_;
  std::size_t n_;
  bool on_triangles_;
  double mean_mass_;  // of a cell, on the device
  Buffer seeds_, place_words_, curves_, segments_, facet_of_, direction_, numbers_, beyond_, block_sums_[2];
  std::vector<Buffer> steps_, changes_;
  Point now_, next_;
  std::optional<Update> update_;
  int accepted_ = 0;
  Kept kept_;
};

}  // namespace bisector::host
