// The program: command line to commands, exceptions to exit codes.
#include <CLI/CLI.hpp>

#include <algorithm>
#include <cstdio>
#include <exception>
#include <functional>
#include <memory>
#include <new>
#include <string>
#include <vector>

#include "bisector/error.h"
#include "commands.h"
#include "console.h"
#include "front.h"
#include "job/messages.h"

namespace {

using namespace bisector::cli;

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
    print_error(bisector::job::kNoMemory);
  } catch (const bisector::Error& error) {
    print_error(bisector::job::with_advice(error));
  } catch (const std::exception& error) {
    print_error(error.what());
  }
  return kFailure;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App program{
      "Bisector makes high-quality triangle meshes of surfaces and tetrahedral meshes of solids by optimising "
      "certified\n"
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

  const std::vector<Command> commands{add_remesh(program),  add_rvd(program),  add_tet(program),
                                      add_segment(program), add_tree(program), add_quality(program),
                                      add_devices(program), add_check(program)};
  const auto chosen = [&]() -> const Command* {
    const auto found = std::find_if(commands.begin(), commands.end(), [](const Command& c) { return c.app->parsed(); });
    return found == commands.end() ? nullptr : &*found;
  };

  try {
    program.parse(argc, argv);
    if (chosen() && chosen()->check_usage) chosen()->check_usage();
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return program.exit(error);
    return fail_usage(error.what(), chosen() ? chosen()->app : nullptr);
  }
  if (!chosen()) {
    std::fputs(program.help().c_str(), stdout);
    return fail_usage("no command given", nullptr);
  }

  watch_interrupts();
  return run_guarded(chosen()->run);
}
