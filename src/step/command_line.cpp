#include "step/command_line.h"

namespace bisector::step {

std::unique_ptr<CLI::App> make_command_line(Options& options) {
  std::vector<std::string> units;
  for (const Unit& unit : kUnits) units.emplace_back(unit.word);
  auto app = std::make_unique<CLI::App>(
      "The surfaces of a segmentation as STEP or IGES, each trimmed by the borders of its region.");
  app->add_option("REGIONS", options.input, "what bisector segment --json wrote")->required();
  app->add_option("-o", options.output, "file to write: .step, .stp, .iges or .igs")->required();
  app->add_option("--tolerance", options.tolerance,
                  "edges are so near to the surfaces beside them, in the\n"
                  "mesh's unit; default: as near as the regions are")
      ->check(CLI::PositiveNumber);
  app->add_option("--unit", options.unit, "of the coordinates; they are not converted")
      ->check(CLI::IsMember(units))
      ->capture_default_str();
  return app;
}

}  // namespace bisector::step
