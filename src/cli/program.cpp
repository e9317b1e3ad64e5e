#include "program.h"

#include <fmt/format.h>

#include <string>

#include "front.h"

namespace bisector::cli {
namespace {

std::string footer_of(const CommandText& text) {
  std::string footer = "Start with:\n";
  for (const Example& example : text.examples) footer += fmt::format("  {:<46} {}\n", example.line, example.about);
  std::string codes;
  for (const ExitCode& code : kExitCodes)
    codes += fmt::format("{}{} {}", codes.empty() ? "" : ", ", code.code, code.meaning);
  return footer + "\nExit codes: " + codes + ". " + text.notes;
}

}  // namespace

Program make_program() {
  Program program;
  program.text = {
      "Bisector makes high-quality triangle meshes of surfaces and tetrahedral meshes of solids by optimising "
      "certified\n"
      "Voronoi diagrams, and reconstructs trees from laser scans.",
      "bisector COMMAND ...",
      "It takes meshes as scanners and CAD systems leave them. Every combinatorial decision of a diagram, who meets "
      "whom, is certified by an error bound or taken in exact arithmetic, so that flat, gridded or nearly degenerate "
      "input yields a diagram without gaps or overlaps.\n"
      "A run gives the same bytes on any number of threads, and its diagrams are the same on a GPU as on the CPU.\n"
      "Files are read and written by their extensions. Results go to standard output, warnings and errors, one line "
      "each, to standard error.",
      {{"bisector remesh IN.off -o OUT.obj -n 10000", "remesh with 10,000 vertices"},
       {"bisector tet IN.off -o OUT.msh -n 10000", "fill it with tetrahedra"},
       {"bisector segment IN.off -o OUT.ply", "find its planes, cylinders, ..."},
       {"bisector tree SCAN.xyz -o OUT.obj", "reconstruct a tree from a laser scan"},
       {"bisector quality OUT.obj --reference IN.off", "see how good the result is"},
       {"bisector remesh --help", "all options of a command"}},
      "If not 0, nothing is written."};
  program.app = std::make_unique<CLI::App>(program.text.about);
  CLI::App& app = *program.app;
  app.name("bisector");
  app.formatter(std::make_shared<Help>(program.text.usage));
  app.footer(footer_of(program.text));
  app.set_version_flag("--version", std::string("bisector ") + BISECTOR_VERSION, "print the version and exit");
  app.get_help_ptr()->description("print this and exit");
  app.require_subcommand(0, 1);
  program.commands = {add_remesh(app),  add_rvd(app),     add_tet(app),   add_segment(app), add_tree(app),
                      add_quality(app), add_devices(app), add_check(app), add_batch(app),   add_remesh_parts(app)};
  return program;
}

}  // namespace bisector::cli
