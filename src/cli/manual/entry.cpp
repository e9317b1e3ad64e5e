#include "cli/manual/entry.h"

#include <algorithm>
#include <cctype>
#include <iterator>
#include <memory>
#include <sstream>

#include "step/command_line.h"

namespace bisector::cli::manual {
namespace {

std::string joined_lines(std::string text) {
  std::replace(text.begin(), text.end(), '\n', ' ');
  return text;
}

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

Option make_option(CLI::Option& option) {
  Option made;
  made.name = option.get_positional() ? option.get_name(true) : option.get_name();
  if (!option.get_lnames().empty() && !option.get_snames().empty()) made.alias = "-" + option.get_snames().front();
  // What CLI11 adds after a colon are the words that are allowed.
  if (!option.get_positional() && option.get_items_expected_max() > 0)
    made.type = option.get_type_name().substr(0, option.get_type_name().find(':'));
  made.help = made.name == "--help" ? "print the options and exit" : joined_lines(option.get_description());
  made.group = option.get_group();
  made.required = option.get_required();
  made.optional_value = option.get_items_expected_max() > 0 && option.get_expected_min() == 0;
  made.values = job::values_of(option);
  return made;
}

std::vector<Option> make_options(CLI::App& app) {
  std::vector<Option> options;
  for (CLI::Option* option : app.get_options()) options.push_back(make_option(*option));
  std::stable_partition(options.begin(), options.end(), [](const Option& option) { return option.is_argument(); });
  return options;
}

Entry make_entry(const std::string& name, const CommandText& text) {
  Entry entry;
  entry.name = name;
  entry.about = joined_lines(text.about);
  entry.usage = text.usage;
  entry.description = lines_of(text.description);
  entry.examples = text.examples;
  return entry;
}

Entry make_entry(const std::string& name, CLI::App& app, const CommandText& text) {
  Entry entry = make_entry(name, text);
  entry.options = make_options(app);
  entry.exit_codes = {std::begin(kExitCodes), std::end(kExitCodes)};
  return entry;
}

Entry make_step_entry() {
  step::Options options;
  const std::unique_ptr<CLI::App> app = step::make_command_line(options);
  Entry entry = make_entry(
      "bisector-step", *app,
      {"Write the regions of a segmentation as STEP or IGES.",
       "bisector-step REGIONS.json -o OUT.step [--unit mm|cm|m|in|ft] [--tolerance T]",
       "Reads what bisector segment --json wrote, and makes a face of each region, trimmed by the region's borders. "
       "Planes, cylinders, cones, spheres and tori are such surfaces, general cylinders are extrusions and other "
       "quadrics exact rational B-splines. Faces share their edges; where they close they are a solid.\n"
       "A region whose face is not valid, or is off its region's area by more than 5 %, is a warning.",
       {{"bisector segment part.stl -o regions.ply --proxies 22 --json regions.json", "Find the regions of a part."},
        {"bisector-step regions.json -o part.step", "Make faces of them, in millimetres."}}});
  for (Option& option : entry.options) {
    if (option.name == "REGIONS") option.values = {{}, true, {".json"}};
    if (option.name == "-o") {
      option.type = "FILE";
      option.values = {{}, true, step::kFormats};
    }
    if (option.name == "--tolerance") option.type = "T";
    if (option.name == "--unit") {
      option.type = "WORD";
      option.help += "; mm (default), cm, m, in or ft";
      for (const step::Unit& unit : step::kUnits) option.values.words.emplace_back(unit.word);
    }
  }
  entry.exit_codes.pop_back();  // it does not catch interrupts
  return entry;
}

// It has no options: its requests come through a socket.
Entry make_tetgen_entry() {
  return make_entry(
      "bisector-tetgen",
      {"Fill a surface with tetrahedra for bisector.",
       "bisector-tetgen",
       "Is run by bisector tet, and by programs that use Bisector's library, to fill a closed surface by TetGen. It "
       "reads one request from the socket that is its standard input and writes the reply there; it is not made to be "
       "called by hand.\n"
       "It is a program of its own because TetGen may crash, and because TetGen is under the AGPL, version 3. Bisector "
       "looks for it beside itself, or where the environment variable BISECTOR_TETGEN says.",
       {}});
}

// Its options are those of bisector.
Entry make_mpi_entry() {
  return make_entry(
      "bisector-mpi",
      {"Share the work of bisector among ranks of MPI.",
       "mpirun -n RANKS bisector COMMAND ...",
       "Is what bisector makes way for where Open MPI's mpirun starts it as one of several ranks; it is not made to be "
       "called by hand. The first rank is the program: it reads, writes and prints. The others compute for it. The "
       "result is the same, to the last byte, for any number of ranks.\n"
       "It is a program of its own because only it links MPI. It lies beside bisector.",
       {{"mpirun -n 8 bisector remesh scan.ply -o mesh.ply -n 1000000",
         "Remesh a surface whose diagrams eight processes compute."},
        {"mpirun -n 4 bisector remesh-parts huge.ply -o mesh.ply -n 1000000",
         "Remesh a surface of which each process reads and keeps a part."}}});
}

}  // namespace

std::vector<Entry> make_entries() {
  const Program program = make_program();
  std::vector<Entry> entries{make_entry("bisector", *program.app, program.text)};
  Entry& front = entries.front();
  front.description.insert(front.description.begin(), front.about);
  front.about = "High-quality meshes of surfaces and solids, and trees from laser scans.";
  front.no_output = program.text.notes;
  for (const Command& command : program.commands) {
    Entry entry = make_entry("bisector-" + command.app->get_name(), *command.app, command.text);
    entry.command = command.app->get_name();
    if (*command.text.notes) entry.description.push_back(joined_lines(command.text.notes));
    entry.no_output = program.text.notes;
    entries.push_back(std::move(entry));
  }
  entries.push_back(make_step_entry());
  entries.push_back(make_tetgen_entry());
  entries.push_back(make_mpi_entry());
  return entries;
}

}  // namespace bisector::cli::manual
