// The program: command line to commands, exceptions to exit codes.
#include <CLI/CLI.hpp>

#include <charconv>
#include <cmath>
#include <exception>
#include <functional>
#include <memory>
#include <new>
#include <string>
#include <vector>

#include "bisector/error.h"
#include "commands.h"
#include "console.h"

namespace {

using namespace bisector::cli;
using bisector::SizingOptions;

constexpr std::uint64_t kMostSeeds = 100'000'000;

// The help of one command, with its usage written out.
class Help : public CLI::Formatter {
 public:
  explicit Help(std::string usage) : usage_(std::move(usage)) {
    column_width(32);
    label("REQUIRED", "(required)");
    label("Positionals", "Arguments");
  }
  std::string make_usage(const CLI::App*, std::string) const override { return "\nUsage: " + usage_ + "\n\n"; }
  // One blank line between groups, where CLI11 leaves two.
  std::string make_group(std::string name, bool is_positional, std::vector<const CLI::Option*> options) const override {
    const std::string group = CLI::Formatter::make_group(name, is_positional, options).substr(1);
    return is_positional ? group + "\n" : group;
  }

 private:
  std::string usage_;
};

// Decimal digits only: CLI11 alone would read 010 as eight and skip over much else.
CLI::Validator whole_number(std::uint64_t least, std::uint64_t most) {
  return CLI::Validator(
      [=](std::string& text) -> std::string {
        std::uint64_t value = 0;
        const auto [stop, error] = std::from_chars(text.data(), text.data() + text.size(), value);
        if (error != std::errc{} || stop != text.data() + text.size() || value < least || value > most)
          return "'" + text + "' is not a whole number from " + std::to_string(least) + " to " + std::to_string(most);
        text = std::to_string(value);
        return {};
      },
      "");
}

CLI::Validator number_below(double most) {
  return CLI::Validator(
      [=](std::string& text) -> std::string {
        double value = 0;
        const auto [stop, error] = std::from_chars(text.data(), text.data() + text.size(), value);
        if (error == std::errc{} && stop == text.data() + text.size() && value >= 0 && value < most) return {};
        return "'" + text + "' is not a number of at least 0 and less than " + CLI::detail::to_string(most);
      },
      "");
}

CLI::Validator number_above_zero() {
  return CLI::Validator(
      [](std::string& text) -> std::string {
        double value = 0;
        const auto [stop, error] = std::from_chars(text.data(), text.data() + text.size(), value);
        if (error == std::errc{} && stop == text.data() + text.size() && value > 0 && std::isfinite(value)) return {};
        return "'" + text + "' is not a positive number";
      },
      "");
}

// What a parser that throws bisector::Error takes.
template <class Parse>
CLI::Validator parsed_by(const Parse& parse) {
  return CLI::Validator(
      [parse](std::string& text) -> std::string {
        try {
          parse(text);
          return {};
        } catch (const bisector::Error& error) {
          return error.what();
        }
      },
      "");
}

CLI::Validator one_of(const std::vector<std::string>& words) {
  return CLI::Validator(
      [=](std::string& text) -> std::string {
        for (const std::string& word : words)
          if (text == word) return {};
        return "'" + text + "' is none of " + CLI::detail::join(words, ", ");
      },
      "");
}

CLI::Validator device_name() {
  return CLI::Validator(
      [](std::string& text) -> std::string {
        if (text == "auto" || text == "cpu" || text == "vulkan" || text.rfind("vulkan:", 0) == 0) return {};
        return "'" + text + "' is none of auto, cpu, vulkan, vulkan:INDEX, vulkan:UUID";
      },
      "");
}

CLI::Validator not_empty() {
  return CLI::Validator([](std::string& text) { return std::string(text.empty() ? "the name is empty" : ""); }, "");
}

CLI::Option* add_file(CLI::App* app, const char* name, std::string& path, const char* type, const char* help) {
  return app->add_option(name, path, help)->type_name(type)->check(not_empty());
}

void add_compute_options(CLI::App* app, ComputeWords& options) {
  app->add_option("--device", options.device,
                  "what computes: auto (the best GPU, or the CPU; default),\n"
                  "cpu, vulkan (the best device), vulkan:INDEX or\n"
                  "vulkan:UUID as 'bisector devices' lists them")
      ->type_name("DEVICE")->check(device_name())->group("Computation");
  app->add_option("--precision", options.precision,
                  "auto (double where the device has it), single or double;\n"
                  "the CPU has double only")
      ->type_name("WORD")->check(one_of({"auto", "single", "double"}))->group("Computation");
  app->add_option("--neighbors", options.neighbours,
                  "where neighbours of seeds come from: auto, nearest or\n"
                  "delaunay; the result is the same")
      ->type_name("WORD")->check(one_of({"auto", "delaunay", "nearest"}))->group("Computation");
}

void add_common_options(CLI::App* app, CommonOptions& options, const char* about) {
  app->add_option("--threads", options.threads, "at most so many; default: all cores. The result is the same")
      ->type_name("N")->check(whole_number(1, 1024))->group("Computation");
  add_file(app, "--report", options.report, "FILE", about)->group("Output");
  app->add_flag("--quiet", options.quiet, "print errors only")->group("Output");
  app->add_flag("--verbose", options.verbose, "print the seconds of each phase")->group("Output");
}

void add_random_seed(CLI::App* app, std::uint64_t& random_seed) {
  app->add_option("--random-seed", random_seed, "another number, another start; default 1")
      ->type_name("N")->check(whole_number(0, UINT64_MAX))->group("Seeds");
}

void add_edge_length(CLI::App* app, double& length, double& relative) {
  app->add_option("--edge-length", length,
                  "mean edge length of the result, in the mesh's unit,\n"
                  "instead of -n")
      ->type_name("L")->check(number_above_zero())->group("Size");
  app->add_option("--edge-length-relative", relative,
                  "the same as a share of the bounding box's diagonal")
      ->type_name("R")->check(number_above_zero())->group("Size");
}

void add_edge_bounds(CLI::App* app, SizingOptions& sizing) {
  app->add_option("--edge-min", sizing.min_edge, "edges aimed at are no shorter, in the mesh's unit")
      ->type_name("L")->check(number_above_zero())->group("Size");
  app->add_option("--edge-max", sizing.max_edge, "and no longer")
      ->type_name("L")->check(number_above_zero())->group("Size");
}

void add_feature_file(CLI::App* app, std::string& path) {
  add_file(app, "--feature-file", path, "FILE",
           "also keep these edges: lines of two vertex numbers,\n"
           "counted from 0 in the input")
      ->group("Features");
}

void add_weld(CLI::App* app, double& tolerance) {
  app->add_option("--weld", tolerance,
                  "join borders that are no farther apart, in the mesh's\n"
                  "unit; default: only what lies at the same point")
      ->type_name("T")->check(number_below(1e100))->group("Features");
}

CLI::App* add_command(CLI::App& program, const char* name, const char* about, const char* usage, const char* footer) {
  CLI::App* app = program.add_subcommand(name, about);
  app->group("Commands")->footer(footer);
  app->formatter(std::make_shared<Help>(usage));
  app->get_help_ptr()->description("print this and exit")->group("Output");
  return app;
}

CLI::App* add_remesh(CLI::App& program, RemeshCommand& command) {
  CLI::App* app = add_command(
      program, "remesh", "Make a high-quality triangle mesh of a surface.",
      "bisector remesh IN -o OUT -n N|--edge-length L [options]",
      "Examples:\n"
      "  bisector remesh bunny.off -o out.obj -n 10000\n"
      "  bisector remesh part.stl -o out.ply -n 5000 --report out.json --preview out.png\n"
      "  bisector remesh part.stl -o out.ply --edge-length 0.5 --features 30\n\n"
      "Meshes are read and written by extension: .off, .obj, .ply, .stl. Ctrl-C stops the run; nothing is written.");
  add_file(app, "IN", command.input, "FILE", "surface to remesh")->required();
  add_file(app, "-o", command.output, "FILE", "mesh to write")->required()->group("Output");
  add_file(app, "--preview", command.preview, "FILE.png", "draw a picture of the result")->group("Output");
  app->add_option("-n", command.options.vertices, "vertices of the result, at least 4")
      ->type_name("N")->check(whole_number(4, kMostSeeds))->group("Seeds");
  add_file(app, "--seeds", command.seeds, "FILE.xyz",
           "start from these points (\"x y z\" lines) in one level;\n"
           "-n is then not needed")
      ->group("Seeds");
  add_random_seed(app, command.options.random_seed);
  add_edge_length(app, command.options.edge_length, command.edge_length_relative);
  app->add_option("--density", command.density,
                  "where triangles are smaller: uniform (default),\n"
                  "lfs[:EXP] (local feature size to the power -EXP,\n"
                  "default 2), curvature[:EXP] (the larger principal one,\n"
                  "default 1) or attribute:NAME (a vertex property of a\n"
                  "PLY file); edges are as long as density^(-1/4)")
      ->type_name("WORD")->check(parsed_by(parse_density))->group("Size");
  app->add_option("--gradation", command.options.sizing.gradation,
                  "edge lengths change by at most so much per length;\n"
                  "0: no bound; default 0.2. Not for uniform density")
      ->type_name("G")->check(number_below(10))->group("Size");
  add_edge_bounds(app, command.options.sizing);
  app->add_option("--features", command.features,
                  "sharp edges to keep: auto (default), none, or all with a\n"
                  "dihedral deviation of so many degrees. Borders and\n"
                  "non-manifold edges are always kept, edges between face\n"
                  "labels unless none")
      ->type_name("WORD")->check(parsed_by(parse_features))->group("Features");
  add_feature_file(app, command.feature_file);
  add_file(app, "--feature-output", command.feature_output, "FILE",
           "write the result's feature edges likewise; .ply and .obj\n"
           "outputs hold them too")
      ->group("Features");
  add_weld(app, command.weld);
  app->add_option("--topology", command.topology,
                  "where the result's topology is not the input's:\n"
                  "enforce (mend it; default), check (warn) or off")
      ->type_name("WORD")->check(one_of({"enforce", "check", "off"}))->group("Optimisation");
  app->add_option("--energy", command.energy,
                  "ccvt (seeds on the surface), rcvt (free) or auto (ccvt\n"
                  "unless the input is noise at this edge length; default)")
      ->type_name("WORD")->check(one_of({"auto", "rcvt", "ccvt"}))->group("Optimisation");
  app->add_option("--min-angle", command.options.min_angle,
                  "degrees that the last pass tries to get all angles\n"
                  "above; 0: no such pass; default 40")
      ->type_name("A")->check(number_below(60))->group("Optimisation");
  app->add_flag("--fit", command.options.fit,
                "move the result's vertices off the surface, to where\n"
                "its triangles are nearest to the input")
      ->group("Optimisation");
  app->add_option("--iterations", command.options.iterations, "at most so many per level; default 100")
      ->type_name("N")->check(whole_number(0, 1'000'000))->group("Optimisation");
  app->add_option("--tolerance", command.options.tolerance,
                  "end a level when the energy falls by less than this\n"
                  "share per iteration; default 1e-6")
      ->type_name("T")->check(number_below(1))->group("Optimisation");
  app->add_option("--levels", command.options.levels,
                  "coarse-to-fine levels, 1 to 8; default: as many as the\n"
                  "count allows, at most 3")
      ->type_name("N")->check(whole_number(1, 8))->group("Optimisation");
  add_compute_options(app, command.compute);
  add_common_options(app, command.common,
                     "write a JSON report with quality, distance to the\n"
                     "input and timings; - for stdout");
  return app;
}

CLI::App* add_rvd(CLI::App& program, RvdCommand& command) {
  CLI::App* app = add_command(
      program, "rvd", "Compute one restricted Voronoi diagram of a surface.",
      "bisector rvd IN --seeds FILE.xyz|-n N [-o CELLS.ply] [options]",
      "Examples:\n"
      "  bisector rvd bunny.off -n 500 -o cells.ply --preview cells.png\n"
      "  bisector rvd bunny.off --seeds points.xyz --report -");
  add_file(app, "IN", command.input, "FILE", "surface: .off, .obj, .ply or .stl")->required();
  add_file(app, "-o", command.output, "FILE.ply", "write the cells as coloured polygons")->group("Output");
  add_file(app, "--pairs", command.pairs, "FILE",
           "write \"face seed\" lines, one for each face (counted\n"
           "from 0 in the input) and cell that meet, sorted")
      ->group("Output");
  add_file(app, "--preview", command.preview, "FILE.png", "draw a picture of the cells")->group("Output");
  add_file(app, "--seeds", command.seeds, "FILE.xyz", "the seeds, as \"x y z\" lines")->group("Seeds");
  app->add_option("-n", command.count, "so many random seeds instead")
      ->type_name("N")->check(whole_number(1, kMostSeeds))->group("Seeds");
  add_random_seed(app, command.random_seed);
  add_compute_options(app, command.compute);
  add_common_options(app, command.common,
                     "write a JSON report with all cells and the restricted\n"
                     "Delaunay triangulation (rdt); - for stdout");
  return app;
}

CLI::App* add_tet(CLI::App& program, TetCommand& command) {
  CLI::App* app = add_command(
      program, "tet", "Make a high-quality tetrahedral mesh of a solid.",
      "bisector tet IN -o OUT -n N|--edge-length L [options]",
      "Examples:\n"
      "  bisector tet bunny.off -o out.msh -n 10000\n"
      "  bisector tet part.stl -o out.vtu --edge-length 0.5 --report out.json\n"
      "  bisector tet coarse.mesh -o fine.mesh -n 50000 --sizes sizes.vtu:h\n\n"
      "The input is a closed surface (.off, .obj, .ply, .stl) or tetrahedra (.mesh, .msh, .vtk, .vtu). Ctrl-C stops the run;\n"
      "nothing is written.");
  add_file(app, "IN", command.input, "FILE", "closed surface or tetrahedral mesh")->required();
  add_file(app, "-o", command.output, "FILE", "mesh to write: .mesh, .msh or .vtu")->required()->group("Output");
  add_file(app, "--boundary", command.boundary, "FILE", "also write the boundary's triangles: .off, .obj, .ply\nor .stl")
      ->group("Output");
  add_file(app, "--preview", command.preview, "FILE.png", "draw a picture of the result, cut open")->group("Output");
  app->add_option("-n", command.options.vertices, "vertices of the result, about; at least 8")
      ->type_name("N")->check(whole_number(8, kMostSeeds))->group("Seeds");
  add_file(app, "--seeds", command.seeds, "FILE.xyz",
           "start from these points (\"x y z\" lines) inside the\n"
           "solid; -n is then not needed")
      ->group("Seeds");
  add_random_seed(app, command.options.random_seed);
  add_edge_length(app, command.options.edge_length, command.edge_length_relative);
  app->add_option("--density", command.density,
                  "where tetrahedra are smaller: uniform (default),\n"
                  "lfs[:EXP] or curvature[:EXP] of the boundary, with the\n"
                  "edge lengths that 'bisector remesh' has for them, or\n"
                  "attribute:NAME (of the input's vertices; edges are as\n"
                  "long as its power -1/5)")
      ->type_name("WORD")->check(parsed_by(parse_density))->group("Size");
  add_file(app, "--sizes", command.sizes, "FILE[:NAME]",
           "edge lengths at the vertices of a mesh (.vtk, .vtu with\n"
           "point data NAME; .mesh with a .sol beside it), instead\n"
           "of a density; -n makes them a matter of proportion")
      ->group("Size");
  app->add_option("--gradation", command.options.sizing.field.gradation,
                  "edge lengths grow by at most so much per length into\n"
                  "the solid; default 0.2. Not for uniform density")
      ->type_name("G")->check(number_below(10))->group("Size");
  add_edge_bounds(app, command.options.sizing.field);
  app->add_option("--features", command.features,
                  "sharp edges to keep: auto (default), none, or all with a\n"
                  "dihedral deviation of so many degrees. Edges between face\n"
                  "labels are kept unless none")
      ->type_name("WORD")->check(parsed_by(parse_features))->group("Features");
  add_feature_file(app, command.feature_file);
  add_weld(app, command.weld);
  app->add_option("--min-angle", command.options.min_angle,
                  "degrees that all angles of the boundary's triangles\n"
                  "should exceed; 0: as they are; default 40")
      ->type_name("A")->check(number_below(60))->group("Optimisation");
  app->add_option("--min-dihedral", command.options.min_dihedral,
                  "degrees that all dihedral angles should exceed; 0: keep\n"
                  "slivers; default 30")
      ->type_name("A")->check(number_below(55))->group("Optimisation");
  app->add_option("--iterations", command.options.iterations, "steps, of which each phase may make a share; default 100")
      ->type_name("N")->check(whole_number(0, 1'000'000))->group("Optimisation");
  app->add_option("--tolerance", command.options.tolerance,
                  "end a phase when the energy falls by less than this\n"
                  "share per iteration; default 1e-6")
      ->type_name("T")->check(number_below(1))->group("Optimisation");
  add_compute_options(app, command.compute);
  add_common_options(app, command.common,
                     "write a JSON report with quality, distance of the\n"
                     "boundary to the input and timings; - for stdout");
  return app;
}

CLI::App* add_segment(CLI::App& program, SegmentCommand& command) {
  CLI::App* app = add_command(
      program, "segment", "Divide a surface into planes, quadrics and tori.",
      "bisector segment IN -o OUT [--proxies N|--error E] [options]",
      "Examples:\n"
      "  bisector segment part.stl -o regions.ply --proxies 22 --preview regions.png\n"
      "  bisector segment part.stl -o regions.obj --error 0.05 --report regions.json\n"
      "  bisector segment bunny.off -o regions.ply --proxies 28 --smooth 5 --fuzzy-rings 2\n\n"
      ".ply and .obj files hold the regions, as face labels and colours and as groups. Ctrl-C stops the run; nothing is\n"
      "written.");
  bisector::SegmentOptions& options = command.options;
  add_file(app, "IN", command.input, "FILE", "surface: .off, .obj, .ply or .stl")->required();
  add_file(app, "-o", command.output, "FILE", "mesh to write, with the region of each triangle")
      ->required()->group("Output");
  add_file(app, "--preview", command.preview, "FILE.png", "draw a picture of the regions")->group("Output");
  app->add_flag("--project", options.project, "move the vertices onto the surfaces found")->group("Output");
  app->add_option("--proxies", options.proxies, "so many regions")
      ->type_name("N")->check(whole_number(1, kMostSeeds))->group("Regions");
  app->add_option("--error", options.error,
                  "as few regions as keep the root mean square distance to\n"
                  "their surfaces below E percent of the bounding box's\n"
                  "diagonal; default 0.1")
      ->type_name("E")->check(number_above_zero())->group("Regions");
  app->add_option("--surfaces", command.surfaces,
                  "what a region may be: planes, quadrics (planes too), or\n"
                  "all (tori too; default)")
      ->type_name("WORD")->check(one_of({"planes", "quadrics", "all"}))->group("Regions");
  app->add_option("--start", command.start,
                  "merging (of small pieces, the cheapest first; default),\n"
                  "insertion (of one region after the other where the error\n"
                  "is largest) or random (all regions at random triangles)")
      ->type_name("WORD")->check(one_of({"merging", "insertion", "random"}))->group("Regions");
  app->add_option("--random-seed", options.random_seed, "another number, another random start; default 1")
      ->type_name("N")->check(whole_number(0, UINT64_MAX))->group("Regions");
  app->add_option("--iterations", options.iterations, "Lloyd steps at most, each time; default 30")
      ->type_name("N")->check(whole_number(0, 100'000))->group("Regions");
  app->add_option("--smooth", options.smooth,
                  "weight of the borders' length against distances; 0:\n"
                  "borders are left as they are; default 1, up to 10 for\n"
                  "free forms")
      ->type_name("LAMBDA")->check(number_below(1e6))->group("Borders");
  app->add_option("--fuzzy-rings", options.fuzzy_rings,
                  "triangles up to so many steps from a border may change\n"
                  "sides; default 1, 2 or 3 for free forms")
      ->type_name("K")->check(whole_number(1, 1000))->group("Borders");
  add_common_options(app, command.common,
                     "write a JSON report with type, parameters and error of\n"
                     "each region; - for stdout");
  return app;
}

CLI::App* add_tree(CLI::App& program, TreeCommand& command) {
  CLI::App* app = add_command(
      program, "tree", "Reconstruct the branches of a leafless tree from a laser scan.",
      "bisector tree POINTS -o OUT [options]",
      "Examples:\n"
      "  bisector tree scan.xyz -o tree.obj --report tree.json --preview tree.png\n"
      "  bisector tree scan.ply -o tree.igs --unit mm --skeleton skeleton.ply\n\n"
      "POINTS is a .ply file or \"x y z\" lines, z up, without leaves. Ctrl-C stops the run; nothing is written.");
  add_file(app, "POINTS", command.input, "FILE", "points of a tree's surface")->required();
  add_file(app, "-o", command.output, "FILE", "surfaces to write: .obj, .ply, .off, .stl, or as B-splines\n.igs")
      ->required()->group("Output");
  add_file(app, "--skeleton", command.skeleton, "FILE.ply", "also write the branches' axes with radii")->group("Output");
  add_file(app, "--labels", command.labels, "FILE.ply", "also write the points with the branch that each is of")
      ->group("Output");
  add_file(app, "--preview", command.preview, "FILE.png", "draw points and surfaces side by side")->group("Output");
  app->add_option("--unit", command.unit, "of the points, for .igs: mm, cm, m (default) or in")
      ->type_name("WORD")->check(one_of({"mm", "cm", "m", "in"}))->group("Output");
  app->add_option("--ground", command.options.ground, "leave out points with z below this")->type_name("Z")->group("Scan");
  app->add_option("--components", command.components,
                  "parts of the scan that are apart: bridge (join them over\n"
                  "their gaps; default) or separate (a tree each)")
      ->type_name("WORD")->check(one_of({"bridge", "separate"}))->group("Scan");
  app->add_option("--clusters", command.options.clusters, "at most so many; default: as many as it takes")
      ->type_name("N")->check(whole_number(1, kMostSeeds))->group("Clusters");
  app->add_option("--delta", command.options.delta,
                  "split clusters whose points are farther, rms, from a\n"
                  "cylinder, in the largest extent; default 0.004")
      ->type_name("D")->check(number_above_zero())->group("Clusters");
  app->add_option("--max-cluster-points", command.options.max_cluster_points, "split clusters of more points too")
      ->type_name("M")->check(whole_number(24, kMostSeeds))->group("Clusters");
  add_common_options(app, command.common,
                     "write a JSON report with branches, volume, distances of\n"
                     "the points and timings; - for stdout");
  return app;
}

CLI::App* add_quality(CLI::App& program, QualityCommand& command) {
  CLI::App* app = add_command(
      program, "quality", "Measure angles, topology and distance to another mesh.",
      "bisector quality MESH [--reference IN] [options]",
      "Example:\n"
      "  bisector quality out.obj --reference bunny.off");
  add_file(app, "MESH", command.mesh, "FILE",
           "surface to measure: .off, .obj, .ply or .stl; or\n"
           "tetrahedra: .mesh, .msh, .vtk or .vtu")->required();
  add_file(app, "--reference", command.reference, "IN", "also measure the two-sided distance to this mesh")
      ->group("Output");
  add_common_options(app, command.common, "write a JSON report; - for stdout");
  return app;
}

CLI::App* add_devices(CLI::App& program, DevicesCommand& command) {
  CLI::App* app = add_command(program, "devices", "List what Bisector can compute on here.",
                              "bisector devices [--report FILE]", "Example:\n  bisector devices");
  add_file(app, "--report", command.report, "FILE", "write a JSON report; - for stdout")->group("Output");
  return app;
}

CLI::App* add_check(CLI::App& program, CheckCommand& command) {
  CLI::App* app = add_command(
      program, "check", "Compare a device's diagrams with the CPU's.", "bisector check [--device DEVICE] [options]",
      "Examples:\n"
      "  bisector check\n"
      "  bisector check --device vulkan:1 --precision single --report check.json\n\n"
      "Prints one line for each case, and exits with 1 if any does not agree.");
  app->add_option("--device", command.device,
                  "what to check: auto (the best GPU; default), cpu (against\n"
                  "itself), vulkan, vulkan:INDEX or vulkan:UUID")
      ->type_name("DEVICE")->check(device_name())->group("Computation");
  app->add_option("--precision", command.precision, "auto (both, where the device has double), single or double")
      ->type_name("WORD")->check(one_of({"auto", "single", "double"}))->group("Computation");
  add_common_options(app, command.common, "write a JSON report with one row for each case; - for\nstdout");
  return app;
}

// What options ask of each other: an option that would change nothing is an error.
void check_usage(const RemeshCommand& command, const CLI::App& app) {
  const auto given = [&](const char* option) { return app.count(option) > 0; };
  const auto refuse = [&](const char* option, const char* why) {
    if (given(option)) throw CLI::ValidationError(std::string(option) + ": " + why);
  };
  const int sizes = given("-n") + given("--edge-length") + given("--edge-length-relative");
  if (!given("--seeds") && sizes == 0)
    throw CLI::ValidationError("how many vertices? give -n N, --edge-length L or --seeds FILE.xyz");
  if (sizes > 1) throw CLI::ValidationError("-n, --edge-length and --edge-length-relative: give one of them");
  if (given("--seeds")) {
    for (const char* option : {"--edge-length", "--edge-length-relative", "--edge-min", "--edge-max"})
      refuse(option, "seeds from a file have their own number; leave one of the two out");
    refuse("--random-seed", "seeds from a file are not random; leave one of the two out");
    if (command.options.levels > 1) throw CLI::ValidationError("--levels: seeds from a file imply one level");
  }
  const SizingOptions& sizing = command.options.sizing;
  if (sizing.max_edge > 0 && sizing.min_edge > sizing.max_edge)
    throw CLI::ValidationError("--edge-min is more than --edge-max");
  const double length = command.options.edge_length;
  if (length > 0 && (length < sizing.min_edge || (sizing.max_edge > 0 && length > sizing.max_edge)))
    throw CLI::ValidationError("--edge-length is not between --edge-min and --edge-max");
  if (command.density == "uniform")
    for (const char* option : {"--gradation", "--edge-min", "--edge-max"})
      refuse(option, "a uniform density has edges of one length; choose another --density");
  if (command.energy == "rcvt" && command.options.min_angle > 0)
    refuse("--min-angle", "seeds have to be on the surface for that; leave out --energy rcvt");
}

void check_usage(const TetCommand& command, const CLI::App& app) {
  const auto given = [&](const char* option) { return app.count(option) > 0; };
  const auto refuse = [&](const char* option, const char* why) {
    if (given(option)) throw CLI::ValidationError(std::string(option) + ": " + why);
  };
  const int sizes = given("-n") + given("--edge-length") + given("--edge-length-relative");
  if (!given("--seeds") && sizes == 0)
    throw CLI::ValidationError("how many vertices? give -n N, --edge-length L or --seeds FILE.xyz");
  if (sizes > 1) throw CLI::ValidationError("-n, --edge-length and --edge-length-relative: give one of them");
  if (given("--seeds")) {
    for (const char* option : {"--edge-length", "--edge-length-relative"})
      refuse(option, "seeds from a file have their own number; leave one of the two out");
    refuse("--random-seed", "seeds from a file are not random; leave one of the two out");
  }
  if (given("--sizes")) refuse("--density", "sizes come from --sizes; leave one of the two out");
  const SizingOptions& sizing = command.options.sizing.field;
  if (given("--gradation") && sizing.gradation == 0)
    throw CLI::ValidationError("--gradation: sizes inside a solid grow from its boundary; it must not be 0");
  if (sizing.max_edge > 0 && sizing.min_edge > sizing.max_edge)
    throw CLI::ValidationError("--edge-min is more than --edge-max");
  if (command.density == "uniform" && !given("--sizes"))
    for (const char* option : {"--gradation", "--edge-min", "--edge-max"})
      refuse(option, "a uniform density has edges of one length; choose another --density");
}

void check_usage(const TreeCommand& command, const CLI::App& app) {
  const std::string extension = command.output.substr(std::min(command.output.size(), command.output.rfind('.')));
  if (app.count("--unit") > 0 && extension != ".igs" && extension != ".iges")
    throw CLI::ValidationError("--unit: only .igs files tell a unit; leave it out");
}

void check_usage(const RvdCommand& command, const CLI::App& app) {
  if (command.seeds.empty() && command.count == 0)
    throw CLI::ValidationError("which seeds? give --seeds FILE.xyz or -n N");
  if (!command.seeds.empty() && app.count("--random-seed"))
    throw CLI::ValidationError("--random-seed: seeds from a file are not random; leave one of the two out");
}

void check_usage(const SegmentCommand& command, const CLI::App& app) {
  if (app.count("--proxies") && app.count("--error"))
    throw CLI::ValidationError("--proxies and --error: give one of them");
  if (command.start != "random" && app.count("--random-seed"))
    throw CLI::ValidationError("--random-seed: only --start random is; add that or leave it out");
  if (command.options.smooth == 0 && app.count("--fuzzy-rings"))
    throw CLI::ValidationError("--fuzzy-rings: borders are not smoothed with --smooth 0; leave one of the two out");
}

int fail_usage(const std::string& message, const CLI::App* command) {
  const std::string help = command ? "bisector " + command->get_name() + " --help" : "bisector --help";
  print_error(message + "; see " + help);
  return kUsage;
}

// Runs the command and maps what it throws to an exit code.
int run_guarded(const std::function<void()>& command) {
  try {
    command();
    return kSuccess;
  } catch (const bisector::Cancelled&) {
    std::fputs("bisector: cancelled\n", stderr);
    return kInterrupted;
  } catch (const std::bad_alloc&) {
    print_error("not enough memory; ask for fewer vertices or use a larger machine");
  } catch (const std::exception& error) {
    print_error(error.what());
  }
  return kFailure;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App program{
      "Bisector makes high-quality triangle meshes of surfaces and tetrahedral meshes of solids by optimising certified\n"
      "Voronoi diagrams, and reconstructs trees from laser scans."};
  program.name("bisector");
  program.formatter(std::make_shared<Help>("bisector COMMAND ..."));
  program.footer(
      "Start with:\n"
      "  bisector remesh IN.off -o OUT.obj -n 10000     remesh with 10,000 vertices\n"
      "  bisector tet IN.off -o OUT.msh -n 10000        fill it with tetrahedra\n"
      "  bisector segment IN.off -o OUT.ply             find its planes, cylinders, ...\n"
      "  bisector tree SCAN.xyz -o OUT.obj              reconstruct a tree from a laser scan\n"
      "  bisector quality OUT.obj --reference IN.off    see how good the result is\n"
      "  bisector remesh --help                         all options of a command\n\n"
      "Exit codes: 0 success, 1 bad input or a failed run, 2 bad usage, 130 cancelled. If not 0, nothing is written.");
  program.set_version_flag("--version", std::string("bisector ") + BISECTOR_VERSION, "print the version and exit");
  program.get_help_ptr()->description("print this and exit");
  program.require_subcommand(0, 1);

  RemeshCommand remesh;
  RvdCommand rvd;
  TetCommand tet;
  SegmentCommand segment;
  TreeCommand tree;
  QualityCommand quality;
  DevicesCommand devices;
  CheckCommand check;
  CLI::App* const remesh_app = add_remesh(program, remesh);
  CLI::App* const rvd_app = add_rvd(program, rvd);
  CLI::App* const tet_app = add_tet(program, tet);
  CLI::App* const segment_app = add_segment(program, segment);
  CLI::App* const tree_app = add_tree(program, tree);
  CLI::App* const quality_app = add_quality(program, quality);
  CLI::App* const devices_app = add_devices(program, devices);
  CLI::App* const check_app = add_check(program, check);
  const auto chosen = [&]() -> const CLI::App* {
    const auto parsed = program.get_subcommands();
    return parsed.empty() ? nullptr : parsed.front();
  };

  try {
    program.parse(argc, argv);
    if (remesh_app->parsed()) check_usage(remesh, *remesh_app);
    if (rvd_app->parsed()) check_usage(rvd, *rvd_app);
    if (tet_app->parsed()) check_usage(tet, *tet_app);
    if (segment_app->parsed()) check_usage(segment, *segment_app);
    if (tree_app->parsed()) check_usage(tree, *tree_app);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return program.exit(error);
    return fail_usage(error.what(), chosen());
  }
  if (!chosen()) {
    std::fputs(program.help().c_str(), stdout);
    return fail_usage("no command given", nullptr);
  }

  watch_interrupts();
  return run_guarded([&] {
    if (remesh_app->parsed()) run(remesh);
    if (rvd_app->parsed()) run(rvd);
    if (tet_app->parsed()) run(tet);
    if (segment_app->parsed()) run(segment);
    if (tree_app->parsed()) run(tree);
    if (quality_app->parsed()) run(quality);
    if (devices_app->parsed()) run(devices);
    if (check_app->parsed()) run(check);
  });
}
