// A run of one of the program's commands: options in words, inputs from files or from memory, results in memory, a
// report and the files that they can be written to. The program and the C interface are front ends of it.
#pragma once

#include <CLI/CLI.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "bisector/mesh.h"
#include "bisector/tetmesh.h"
#include "job/journal.h"
#include "job/options.h"
#include "job/report.h"
#include "view/scene.h"

namespace bisector::job {

// A mesh or points that a caller has in memory.
struct GivenMesh {
  std::optional<TriangleMesh> surface;
  std::optional<TetMesh> tets;
  std::vector<Vec3> points;           // where there is neither
  std::vector<std::string> warnings;  // about what it was made of
};

// What a caller has in memory where the command line names files. What is missing is read from files, if they are
// named.
struct Given {
  std::shared_ptr<const GivenMesh> mesh, reference;
  std::optional<std::vector<Vec3>> seeds;
  std::vector<double> density;  // of the vertices, instead of an attribute's name
  SizeSamples sizes;
  std::vector<Index> keep_vertices, keep_faces;
};

// What a command reads: a positional argument of the command line.
struct InputKind {
  const char* name;
  const char* help;                          // the extensions are added
  std::vector<std::string> extensions = {};  // the formats that can be read; empty: any name
};

// A file that a run can write.
struct OutputKind {
  const char* name;    // "output", "preview", ...
  const char* option;  // of the command line
  const char* type;    // of its value
  std::string help;
  std::vector<std::string> extensions;  // the formats that can be written; empty: any name
  bool required = false;                // on the command line
  bool planned = false;                 // has to be asked for before the run
  const char* seconds = "io";           // of the report, that writing counts as
};

// A table of numbers that lives as long as the job: rows of `columns` numbers each.
struct ArrayView {
  enum class Type { double_, uint32, int32 };
  const char* name;
  Type type;
  const void* data;
  std::size_t rows, columns;
};

inline ArrayView array_of(const char* name, const std::vector<Vec3>& rows) {
  return {name, ArrayView::Type::double_, rows.data(), rows.size(), 3};
}
template <std::size_t N>
ArrayView array_of(const char* name, const std::vector<std::array<Index, N>>& rows) {
  return {name, ArrayView::Type::uint32, rows.data(), rows.size(), N};
}
inline ArrayView array_of(const char* name, const std::vector<double>& rows) {
  return {name, ArrayView::Type::double_, rows.data(), rows.size(), 1};
}
inline ArrayView array_of(const char* name, const std::vector<Index>& rows) {
  return {name, ArrayView::Type::uint32, rows.data(), rows.size(), 1};
}
inline ArrayView array_of(const char* name, const std::vector<std::int32_t>& rows) {
  return {name, ArrayView::Type::int32, rows.data(), rows.size(), 1};
}

class Job {
 public:
  Job() = default;
  virtual ~Job() = default;
  Job(const Job&) = delete;
  Job& operator=(const Job&) = delete;

  // --- what it is ---
  virtual const char* command() const = 0;
  virtual InputKind input_kind() const = 0;
  virtual std::vector<OutputKind> outputs() const = 0;
  // All options but those that name outputs, and --report and what concerns the terminal.
  virtual void add_options(CLI::App* app) = 0;
  // What options ask of each other. Throws CLI::ValidationError.
  virtual void check_usage(const Usage&) {}

  // --- what it is given ---
  std::string input;  // a file, unless a mesh is given
  Given given;
  unsigned threads = 0;  // 0: all cores
  // Files that it reads, where it does: no output other than the first may replace one. Empty names stand for none.
  virtual std::vector<std::string> input_files() const { return {input}; }
  // Says before the run that an output of OutputKind::planned will be wanted; the name is for warnings.
  virtual void plan(std::string_view output, const std::string& name) {
    static_cast<void>(output);
    static_cast<void>(name);
  }

  // --- the run, in this order; all throw Error and Cancelled ---
  virtual void read(Journal& journal) = 0;
  // Warns of what a format does not hold.
  virtual void check_format(std::string_view output, const std::string& path, Journal& journal) const {
    static_cast<void>(output);
    static_cast<void>(path);
    static_cast<void>(journal);
  }
  virtual void compute(Journal& journal) = 0;
  // Measures what only reports tell. `seconds` is null in it.
  virtual Json report(Journal& journal) = 0;
  // Writes an output, one of those that outputs() names; `warnings` are those of the run.
  virtual void write(std::string_view output, const std::string& path, const std::vector<std::string>& warnings) = 0;
  // Input and result for the page of a report; `output`: the name of the file that holds the result, for its title.
  virtual view::Scene scene(const std::string& output) = 0;
  // What the result consists of.
  virtual std::vector<ArrayView> arrays() { return {}; }
  // What it has from the input's.
  virtual const std::vector<Attribute>& attributes() const {
    static const std::vector<Attribute> none;
    return none;
  }

  // A file from which a run that was cancelled can go on; empty if there is none.
  virtual std::string goes_on_from() const { return {}; }
  // The checkpoint asked for; empty if none is.
  virtual std::string checkpoint_file() const { return {}; }
  // Once all results are where they are wanted.
  virtual void finish() {}

  Json seconds = {{"total", 0.0}};  // of the report

 protected:
  double io_ = 0;  // seconds of reading
};

// Null if there is no such command.
std::unique_ptr<Job> make_job(std::string_view command);
// "remesh, tet, ..."
std::string known_commands();

}  // namespace bisector::job
