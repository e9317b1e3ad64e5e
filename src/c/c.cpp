#include "bisector/c.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>

#include <algorithm>
#include <atomic>
#include <cstring>
#include <exception>
#include <memory>
#include <mutex>
#include <new>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "bisector/error.h"
#include "c/handles.h"
#include "c/mesh_arrays.h"
#include "core/parallel.h"
#include "core/stopwatch.h"
#include "core/threads.h"
#include "job/devices.h"
#include "job/job.h"
#include "job/messages.h"
#include "job/outputs.h"

namespace bisector::c {
namespace {

using job::Job;
using job::Journal;
using job::Json;

// --- what handles stand for ---

struct Mesh : Object {
  std::string path;                             // a file, or
  std::shared_ptr<const job::GivenMesh> given;  // arrays
};

struct Options : Object {
  std::mutex mutex;
  std::string command;
  std::vector<std::pair<std::string, std::optional<std::string>>> values;  // by name, each once
  job::Given given;
  std::string reference_file;
};

struct Result : Object {
  std::mutex mutex;  // of all below: what is asked for later is made by whoever asks first
  std::unique_ptr<Job> job;
  std::vector<std::string> warnings;  // of the run
  Json report;                        // null: not made yet, as below
  std::string report_text;
  std::vector<job::ArrayView> arrays;
};

struct Cancel : Object {
  std::atomic<bool> requested = false;
};

// --- errors ---

thread_local std::string last_error;
thread_local std::string last_text;

bisector_status fail(bisector_status status, const char* what) noexcept {
  try {
    last_error = job::one_line(what);
  } catch (...) {
    last_error.clear();
  }
  return status;
}

template <class Body>
bisector_status guarded(const Body& body) noexcept {
  try {
    body();
    return BISECTOR_OK;
  } catch (const Misuse& error) {
    return fail(BISECTOR_MISUSE, error.what());
  } catch (const Cancelled& error) {
    return fail(BISECTOR_CANCELLED, error.what());
  } catch (const CLI::ParseError& error) {
    return fail(BISECTOR_USAGE, error.what());
  } catch (const std::bad_alloc&) {
    return fail(BISECTOR_NO_MEMORY, job::kNoMemory);
  } catch (const Error& error) {
    const bool device = dynamic_cast<const DeviceError*>(&error) != nullptr;
    try {
      return fail(device ? BISECTOR_DEVICE : BISECTOR_FAILED, job::with_advice(error).c_str());
    } catch (...) {
      return fail(BISECTOR_NO_MEMORY, job::kNoMemory);
    }
  } catch (const std::exception& error) {
    return fail(BISECTOR_FAILED, job::wants_thread(error) ? job::kNoThread : error.what());
  } catch (...) {
    return fail(BISECTOR_FAILED, "an unknown error; please report this as a bug");
  }
}

void require(const void* pointer, const char* what) {
  if (!pointer) throw Misuse(std::string(what) + " is a null pointer");
}

// A caller's struct, whose first member is its size, with what an older caller does not know left at 0.
template <class Struct>
Struct sized(const Struct* given, const char* what) {
  require(given, what);
  if (given->size == 0 || given->size > sizeof(Struct) || given->size % alignof(Struct) != 0)
    throw Misuse(std::string(what) + ".size is not that of the struct; set it, or load the library of this header");
  Struct own{};
  std::memcpy(&own, given, given->size);
  return own;
}

// --- options ---

// The options of a command as the command line has them, but for files to write and what concerns the terminal.
struct Parser {
  explicit Parser(Job& job) {
    app.set_help_flag();
    job.add_options(&app);
    for (const job::OutputKind& kind : job.outputs())
      if (kind.planned) app.add_flag(kind.option, kind.help)->group("Output");
  }

  static std::string dashed(const std::string& name) { return (name.size() == 1 ? "-" : "--") + name; }

  CLI::Option& option(const std::string& name) {
    CLI::Option* found =
        name.empty() || name.find_first_of("-,") == 0 ? nullptr : app.get_option_no_throw(dashed(name));
    if (!found) throw CLI::ValidationError("there is no option '" + name + "'; there are " + names());
    return *found;
  }

  std::string names() const {
    std::string list;
    for (const CLI::Option* option : app.get_options()) list += (list.empty() ? "" : ", ") + option->get_single_name();
    return list;
  }

  // Throws CLI::ParseError.
  void parse(const Options& options) {
    std::vector<std::string> words;
    for (const auto& [name, value] : options.values) {
      if (!value) {
        words.push_back(dashed(name));
      } else if (name.size() == 1) {
        words.push_back(dashed(name));
        words.push_back(*value);
      } else {
        words.push_back(dashed(name) + "=" + *value);
      }
    }
    if (!options.reference_file.empty()) words.push_back("--reference=" + options.reference_file);
    if (!options.given.density.empty()) words.push_back("--density=attribute:given");
    std::reverse(words.begin(), words.end());
    app.parse(std::move(words));
  }

  CLI::App app;
};

bool is_switch(const CLI::Option& option) { return option.get_expected_min() == 0; }

std::unique_ptr<Job> job_of(const std::string& command) {
  std::unique_ptr<Job> job = job::make_job(command);
  if (!job) throw CLI::ValidationError("there is no command '" + command + "'; there are " + job::known_commands());
  return job;
}

bool has_value(const Options& options, const char* name) {
  return std::any_of(options.values.begin(), options.values.end(), [&](const auto& v) { return v.first == name; });
}

// A job with the options, checked.
std::unique_ptr<Job> prepare(const Options& options) {
  std::unique_ptr<Job> job = job_of(options.command);
  Parser parser(*job);
  std::set<std::string> in_memory;
  const auto note = [&](bool is_given, const char* name) {
    if (!is_given) return;
    if (has_value(options, name)) throw CLI::ValidationError(std::string(name) + ": give an array or a word, not both");
    parser.option(name);
    in_memory.insert(Parser::dashed(name));
  };
  note(options.given.seeds.has_value(), "seeds");
  note(!options.given.density.empty(), "density");
  note(!options.given.sizes.lengths.empty(), "sizes");
  note(options.given.reference || !options.reference_file.empty(), "reference");
  if (!options.given.sizes.lengths.empty() && !options.given.density.empty())
    throw CLI::ValidationError("--density: sizes come from --sizes; leave one of the two out");
  parser.parse(options);
  for (const job::OutputKind& kind : job->outputs())
    if (kind.planned && parser.app.count(kind.option) > 0) job->plan(kind.name, kind.name);
  job->check_usage(job::Usage(parser.app, in_memory));
  job->given = options.given;
  return job;
}

// --- callbacks ---

class Callbacks {
 public:
  explicit Callbacks(const bisector_callbacks* given) {
    if (!given) return;
    callbacks_ = sized(given, "callbacks");
    if (callbacks_.cancel) cancel_ = Handles::all().get<Cancel>(callbacks_.cancel, "a cancel flag");
  }

  job::Listener listener() const {
    job::Listener listener;
    if (callbacks_.progress) {
      listener.phase = [this](const std::string& what) {
        const bisector_progress progress{what.c_str(), 0, 0, 0, 0, -1};
        callbacks_.progress(callbacks_.user, &progress);
      };
      listener.progress = [this](const Progress& p) {
        const bisector_progress progress{p.phase.c_str(), p.iteration,     p.iterations,
                                         p.energy,        p.gradient_norm, std::clamp(p.fraction, 0.0, 1.0)};
        callbacks_.progress(callbacks_.user, &progress);
      };
    }
    if (callbacks_.warning)
      listener.warning = [this](const std::string& line) { callbacks_.warning(callbacks_.user, line.c_str()); };
    if (cancel_) listener.cancel = &cancel_->requested;
    return listener;
  }

 private:
  bisector_callbacks callbacks_{};
  std::shared_ptr<Cancel> cancel_;
};

std::shared_ptr<Mesh> mesh_of(const bisector_mesh* handle) { return Handles::all().get<Mesh>(handle, "a mesh"); }
std::shared_ptr<Options> options_of(const bisector_options* handle) {
  return Handles::all().get<Options>(handle, "options");
}
std::shared_ptr<Result> result_of(const bisector_result* handle) {
  return Handles::all().get<Result>(handle, "a result");
}

template <class Handle>
void hand_out(Handle** to, std::shared_ptr<Object> object) {
  *to = static_cast<Handle*>(Handles::all().add(std::move(object)));
}

// Takes indices of what is to be kept.
bisector_status keep(bisector_options* options, std::vector<Index> job::Given::*which, const char* option,
                     const std::int64_t* indices, std::size_t count) {
  return guarded([&] {
    const std::shared_ptr<Options> object = options_of(options);
    std::vector<Index> kept = indices_of(option, indices, count);
    const std::lock_guard lock(object->mutex);
    object->given.*which = std::move(kept);
  });
}

bisector_type type_of(job::ArrayView::Type type) {
  switch (type) {
    case job::ArrayView::Type::double_: return BISECTOR_DOUBLE;
    case job::ArrayView::Type::uint32: return BISECTOR_UINT32;
    case job::ArrayView::Type::int32: break;
  }
  return BISECTOR_INT32;
}

// The report without the warnings of the run.
const Json& report_of(Result& result, Journal& journal) {
  if (!result.report.is_null()) return result.report;
  Job& job = *result.job;
  const ThreadLimit limit(job.threads);
  result.report = job.report(journal);
  result.report["seconds"] = job.seconds;
  return result.report;
}

void save_report(Result& result, const char* path, Journal& journal) {
  job::check_outputs({{path, {}}}, {});
  const Json& report = report_of(result, journal);
  journal.phase("writing " + std::string(path));
  const ThreadLimit limit(result.job->threads);
  job::write_report(path, report, result.warnings, job::is_page(path) ? result.job->scene("") : view::Scene{});
}

void save_output(Result& result, const char* what, const char* path, Journal& journal) {
  Job& job = *result.job;
  std::string known = "report";
  for (const job::OutputKind& kind : job.outputs()) {
    known += ", " + std::string(kind.name);
    if (std::strcmp(kind.name, what) != 0) continue;
    job::check_outputs({{path, kind.extensions}}, {});
    journal.phase("writing " + std::string(path));
    job.check_format(kind.name, path, journal);
    return job.write(kind.name, path, result.warnings);
  }
  throw CLI::ValidationError("a result of " + std::string(job.command()) + " has no '" + what + "' to write; it has " +
                             known);
}

Json describe(const std::string& command) {
  const std::unique_ptr<Job> job = job_of(command);
  Parser parser(*job);
  Json options = Json::array();
  for (const CLI::Option* option : parser.app.get_options()) {
    std::string help = option->get_description(), name = option->get_single_name();
    std::replace(help.begin(), help.end(), '\n', ' ');
    options.push_back({{"name", name},
                       {"type", option->get_type_name()},
                       {"help", help},
                       {"group", option->get_group()},
                       {"is_switch", is_switch(*option)}});
  }
  return options;
}

}  // namespace
}  // namespace bisector::c

using namespace bisector::c;
namespace job = bisector::job;

int32_t bisector_c_version(void) { return BISECTOR_C_VERSION; }
const char* bisector_version(void) { return BISECTOR_VERSION; }
const char* bisector_last_error(void) { return last_error.c_str(); }

bisector_status bisector_mesh_from_arrays(const bisector_mesh_arrays* arrays, bisector_mesh** mesh) {
  return guarded([&] {
    require(mesh, "mesh");
    auto object = std::make_shared<Mesh>();
    object->given = bisector::c::mesh_of(sized(arrays, "arrays"));
    hand_out(mesh, std::move(object));
  });
}

bisector_status bisector_mesh_from_file(const char* path, bisector_mesh** mesh) {
  return guarded([&] {
    require(path, "path");
    require(mesh, "mesh");
    if (!*path) throw bisector::Error("the name of the mesh's file is empty");
    auto object = std::make_shared<Mesh>();
    object->path = path;
    hand_out(mesh, std::move(object));
  });
}

bisector_status bisector_mesh_free(bisector_mesh* mesh) {
  return guarded([&] { Handles::all().remove<Mesh>(mesh, "a mesh"); });
}

bisector_status bisector_options_new(const char* command, bisector_options** options) {
  return guarded([&] {
    require(command, "command");
    require(options, "options");
    auto object = std::make_shared<Options>();
    object->command = job_of(command)->command();
    hand_out(options, std::move(object));
  });
}

bisector_status bisector_options_set(bisector_options* options, const char* name, const char* value) {
  return guarded([&] {
    const std::shared_ptr<Options> object = options_of(options);
    require(name, "name");
    const std::unique_ptr<Job> job = job_of(object->command);
    Parser parser(*job);
    const CLI::Option& option = parser.option(name);
    if (!value && !is_switch(option)) throw CLI::ValidationError(std::string(name) + ": a value is missing");
    if (value && !*value) throw CLI::ValidationError(std::string(name) + ": the value is empty");
    const std::lock_guard lock(object->mutex);
    std::erase_if(object->values, [&](const auto& v) { return v.first == name; });
    object->values.emplace_back(name, value ? std::optional<std::string>(value) : std::nullopt);
  });
}

bisector_status bisector_options_seeds(bisector_options* options, const double* points, size_t count) {
  return guarded([&] {
    const std::shared_ptr<Options> object = options_of(options);
    if (count == 0) throw bisector::Error("--seeds: there is no point; give some");
    auto seeds = points_of("--seeds", points, count);
    const std::lock_guard lock(object->mutex);
    object->given.seeds = std::move(seeds);
  });
}

bisector_status bisector_options_density(bisector_options* options, const double* values, size_t count) {
  return guarded([&] {
    const std::shared_ptr<Options> object = options_of(options);
    require(values, "values");
    if (count == 0) throw bisector::Error("--density: there is no value; give one for each vertex");
    std::vector<double> density(values, values + count);
    const std::lock_guard lock(object->mutex);
    object->given.density = std::move(density);
  });
}

bisector_status bisector_options_sizes(bisector_options* options, const double* points, const double* lengths,
                                       size_t count, const int64_t* tets, size_t tet_count) {
  return guarded([&] {
    const std::shared_ptr<Options> object = options_of(options);
    require(lengths, "lengths");
    if (count == 0) throw bisector::Error("--sizes: there is no point; give some");
    bisector::SizeSamples sizes{points_of("--sizes", points, count),
                                {lengths, lengths + count},
                                tets_of("tetrahedron of --sizes", tets, tet_count, count)};
    const std::lock_guard lock(object->mutex);
    object->given.sizes = std::move(sizes);
  });
}

bisector_status bisector_options_reference(bisector_options* options, const bisector_mesh* mesh) {
  return guarded([&] {
    const std::shared_ptr<Options> object = options_of(options);
    const std::shared_ptr<Mesh> reference = mesh_of(mesh);
    const std::lock_guard lock(object->mutex);
    object->given.reference = reference->given;
    object->reference_file = reference->path;
  });
}

bisector_status bisector_options_keep_vertices(bisector_options* options, const int64_t* indices, size_t count) {
  return keep(options, &job::Given::keep_vertices, "--keep-vertices", indices, count);
}

bisector_status bisector_options_keep_faces(bisector_options* options, const int64_t* indices, size_t count) {
  return keep(options, &job::Given::keep_faces, "--keep-faces", indices, count);
}

bisector_status bisector_options_free(bisector_options* options) {
  return guarded([&] { Handles::all().remove<Options>(options, "options"); });
}

bisector_status bisector_describe(const char* command, const char** json) {
  return guarded([&] {
    require(command, "command");
    require(json, "json");
    last_text = describe(command).dump();
    *json = last_text.c_str();
  });
}

bisector_status bisector_cancel_new(bisector_cancel** cancel) {
  return guarded([&] {
    require(cancel, "cancel");
    hand_out(cancel, std::make_shared<Cancel>());
  });
}

bisector_status bisector_cancel_request(bisector_cancel* cancel) {
  return guarded([&] { Handles::all().get<Cancel>(cancel, "a cancel flag")->requested = true; });
}

bisector_status bisector_cancel_free(bisector_cancel* cancel) {
  return guarded([&] { Handles::all().remove<Cancel>(cancel, "a cancel flag"); });
}

bisector_status bisector_run(const bisector_options* options, const bisector_mesh* mesh,
                             const bisector_callbacks* callbacks, bisector_result** result) {
  return guarded([&] {
    const bisector::Stopwatch total;
    require(result, "result");
    const std::shared_ptr<Options> given = options_of(options);
    const std::shared_ptr<Mesh> input = mesh_of(mesh);
    const Callbacks called(callbacks);
    auto object = std::make_shared<Result>();
    {
      const std::lock_guard lock(given->mutex);
      object->job = prepare(*given);
    }
    Job& job = *object->job;
    job.given.mesh = input->given;
    job.input = input->given ? "mesh" : input->path;
    if (job.threads != 1) bisector::start_threads();
    const bisector::ThreadLimit limit(job.threads);
    Journal journal(called.listener());
    journal.phase("reading " + job.input);
    job.read(journal);
    job.compute(journal);
    job.seconds["total"] = total.seconds();
    object->warnings = journal.warnings();
    hand_out(result, std::move(object));
  });
}

bisector_status bisector_result_array(const bisector_result* result, const char* name, bisector_array* array) {
  return guarded([&] {
    const std::shared_ptr<Result> object = result_of(result);
    require(name, "name");
    require(array, "array");
    const std::lock_guard lock(object->mutex);
    if (object->arrays.empty()) object->arrays = object->job->arrays();
    const auto found = std::find_if(object->arrays.begin(), object->arrays.end(),
                                    [&](const job::ArrayView& view) { return std::strcmp(view.name, name) == 0; });
    if (found == object->arrays.end())
      throw bisector::Error("a result of " + std::string(object->job->command()) + " has no array '" + name + "'");
    *array = {found->rows > 0 ? found->data : nullptr, type_of(found->type), found->rows, found->columns};
  });
}

bisector_status bisector_result_attribute_count(const bisector_result* result, size_t* count) {
  return guarded([&] {
    const std::shared_ptr<Result> object = result_of(result);
    require(count, "count");
    *count = object->job->attributes().size();
  });
}

bisector_status bisector_result_attribute(const bisector_result* result, size_t index, bisector_attribute* attribute) {
  return guarded([&] {
    const std::shared_ptr<Result> object = result_of(result);
    require(attribute, "attribute");
    const std::vector<bisector::Attribute>& all = object->job->attributes();
    if (index >= all.size()) throw bisector::Error(fmt::format("there is no attribute {}, but {}", index, all.size()));
    const bisector::Attribute& found = all[index];
    *attribute = {found.name.c_str(),
                  static_cast<std::int32_t>(found.site),
                  static_cast<std::int32_t>(found.type),
                  found.components,
                  found.values.data(),
                  found.values.size()};
  });
}

bisector_status bisector_result_report(const bisector_result* result, const bisector_callbacks* callbacks,
                                       const char** json) {
  return guarded([&] {
    const std::shared_ptr<Result> object = result_of(result);
    require(json, "json");
    const Callbacks called(callbacks);
    const std::lock_guard lock(object->mutex);
    Journal journal(called.listener());
    if (object->report_text.empty())
      object->report_text = job::report_text(report_of(*object, journal), object->warnings);
    *json = object->report_text.c_str();
  });
}

bisector_status bisector_result_save(const bisector_result* result, const char* what, const char* path,
                                     const bisector_callbacks* callbacks) {
  return guarded([&] {
    const std::shared_ptr<Result> object = result_of(result);
    require(what, "what");
    require(path, "path");
    const Callbacks called(callbacks);
    const std::lock_guard lock(object->mutex);
    if (!*path) throw bisector::Error("the name of the file to write is empty");
    Journal journal(called.listener());
    if (std::strcmp(what, "report") == 0) save_report(*object, path, journal);
    else save_output(*object, what, path, journal);
  });
}

bisector_status bisector_result_free(bisector_result* result) {
  return guarded([&] { Handles::all().remove<Result>(result, "a result"); });
}

bisector_status bisector_devices(const char** json) {
  return guarded([&] {
    require(json, "json");
    last_text = job::report_text(job::devices_report(bisector::list_devices()), {});
    *json = last_text.c_str();
  });
}
