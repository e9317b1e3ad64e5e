#include "job/options.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <memory>
#include <optional>
#include <utility>

#include "job/words.h"

namespace bisector::job {
namespace {

// The number that the whole text is, or nothing.
template <class Number>
std::optional<Number> number_in(const std::string& text) {
  Number value{};
  const auto [stop, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || stop != text.data() + text.size()) return {};
  return value;
}

std::optional<double> positive_number_in(const std::string& text) {
  const std::optional<double> value = number_in<double>(text);
  return value && *value > 0 && std::isfinite(*value) ? value : std::nullopt;
}

CLI::Validator not_empty() {
  return CLI::Validator([](std::string& text) { return std::string(text.empty() ? "the name is empty" : ""); }, "");
}

struct Density {
  DensityKind kind = DensityKind::uniform;
  double exponent = SizingOptions{}.exponent;
  std::string attribute;  // NAME of "attribute:NAME"
};

Density parse_density(const std::string& word) {
  const std::size_t colon = word.find(':');
  const std::string kind = word.substr(0, colon), rest = colon == std::string::npos ? "" : word.substr(colon + 1);
  Density density;
  if (word == "uniform") return density;
  if (kind == "attribute" && !rest.empty()) {
    density.kind = DensityKind::attribute;
    density.attribute = rest;
    return density;
  }
  if (kind == "lfs") density.kind = DensityKind::lfs;
  else if (kind == "curvature") density.kind = DensityKind::curvature;
  else throw Error("'" + word + "' is none of uniform, lfs[:EXP], curvature[:EXP], attribute:NAME");
  if (colon == std::string::npos) return density;
  const std::optional<double> exponent = number_in<double>(rest);
  if (!exponent || !(*exponent > 0 && *exponent <= 8))
    throw Error("'" + word + "': the exponent is not a number above 0 and at most 8");
  density.exponent = *exponent;
  return density;
}

FeatureOptions parse_features(const std::string& word) {
  FeatureOptions options;
  if (word == "auto") return options;
  if (word == "none") {
    options.mode = FeatureMode::none;
    return options;
  }
  const std::optional<double> angle = number_in<double>(word);
  if (!angle || !(*angle > 0 && *angle < 180))
    throw Error("'" + word + "' is none of auto, none, or degrees above 0 and below 180");
  options.mode = FeatureMode::degrees;
  options.angle = *angle;
  return options;
}

}  // namespace

CLI::Validator whole_number(std::uint64_t least, std::uint64_t most) {
  return CLI::Validator(
      [=](std::string& text) -> std::string {
        const std::optional<std::uint64_t> value = number_in<std::uint64_t>(text);
        if (!value || *value < least || *value > most)
          return "'" + text + "' is not a whole number from " + std::to_string(least) + " to " + std::to_string(most);
        text = std::to_string(*value);
        return {};
      },
      "");
}

CLI::Validator number_below(double most) {
  return CLI::Validator(
      [=](std::string& text) -> std::string {
        const std::optional<double> value = number_in<double>(text);
        if (value && *value >= 0 && *value < most) return {};
        return "'" + text + "' is not a number of at least 0 and less than " + CLI::detail::to_string(most);
      },
      "");
}

CLI::Validator number_above_zero() {
  return CLI::Validator(
      [](std::string& text) -> std::string {
        return positive_number_in(text) ? "" : "'" + text + "' is not a positive number";
      },
      "");
}

CLI::Option* add_file(CLI::App* app, const char* name, std::string& path, const char* type, const char* help,
                      std::vector<std::string> extensions) {
  return app->add_option(name, path, help)
      ->type_name(type)
      ->check(with_values(not_empty(), {{}, true, std::move(extensions)}));
}

CLI::Option* add_device(CLI::App* app, DeviceRequest& device, const char* help) {
  return add_parsed(app, "--device", device, parse_device, help, {"auto", "cpu", "vulkan", "vulkan:"})
      ->type_name("DEVICE")
      ->group("Computation");
}

void add_compute_options(CLI::App* app, ComputeOptions& options) {
  add_device(app, options.device,
             "what computes: auto (the best GPU, or the CPU; default),\n"
             "cpu, vulkan (the best device), vulkan:INDEX or\n"
             "vulkan:UUID as 'bisector devices' lists them");
  add_words(app, "--precision", options.precision, kPrecisionWords,
            "auto (double where the device has it), single or double;\n"
            "the CPU has double only")
      ->group("Computation");
  add_words(app, "--neighbors", options.neighbours, kNeighbourWords,
            "where neighbours of seeds come from: auto, nearest or\n"
            "delaunay; the result is the same")
      ->group("Computation");
}

void add_threads(CLI::App* app, unsigned& threads) {
  app->add_option("--threads", threads, "at most so many; default: all cores. The result is the same")
      ->type_name("N")
      ->transform(whole_number(1, 1024))
      ->group("Computation");
}

CLI::Option* add_random_seed(CLI::App* app, std::uint64_t& random_seed, const char* help) {
  return app->add_option("--random-seed", random_seed, help)->type_name("N")->transform(whole_number(0, UINT64_MAX));
}

void add_edge_length(CLI::App* app, double& length, double& relative) {
  app->add_option("--edge-length", length,
                  "mean edge length of the result, in the mesh's unit,\n"
                  "instead of -n")
      ->type_name("L")
      ->check(number_above_zero())
      ->group("Size");
  app->add_option("--edge-length-relative", relative, "the same as a share of the bounding box's diagonal")
      ->type_name("R")
      ->check(number_above_zero())
      ->group("Size");
}

void add_edge_bounds(CLI::App* app, SizingOptions& sizing) {
  app->add_option("--edge-min", sizing.min_edge, "edges aimed at are no shorter, in the mesh's unit")
      ->type_name("L")
      ->check(number_above_zero())
      ->group("Size");
  app->add_option("--edge-max", sizing.max_edge, "edges aimed at are no longer")
      ->type_name("L")
      ->check(number_above_zero())
      ->group("Size");
}

void add_iterations(CLI::App* app, int& iterations, const char* help) {
  app->add_option("--iterations", iterations, help)
      ->type_name("N")
      ->transform(whole_number(0, 1'000'000))
      ->group("Optimisation");
}

void add_tolerance(CLI::App* app, double& tolerance, const char* help) {
  app->add_option("--tolerance", tolerance, help)->type_name("T")->check(number_below(1))->group("Optimisation");
}

void add_density(CLI::App* app, SizingOptions& sizing, std::string& attribute, const char* help) {
  const auto set = [&](const std::string& word) {
    const Density density = parse_density(word);
    sizing.kind = density.kind;
    sizing.exponent = density.exponent;
    attribute = density.attribute;
  };
  app->add_option_function<std::string>("--density", set, help)
      ->type_name("WORD")
      ->check(with_values(parsed_by(parse_density),
                          {{"uniform", "lfs", "lfs:", "curvature", "curvature:", "attribute:"}, false, {}}))
      ->group("Size");
}

void add_features(CLI::App* app, FeatureOptions& features, const char* help) {
  add_parsed(app, "--features", features, parse_features, help, {"auto", "none"})->group("Features");
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
                  "unit; default: what rounding has parted")
      ->type_name("T")
      ->check(number_below(1e100))
      ->group("Features");
}

void add_wrap(CLI::App* app, WrapOption& wrap) {
  app->add_option_function<std::string>(
         "--wrap",
         [&wrap](const std::string& word) {
           wrap.on = true;
           if (word.empty()) return;
           const std::optional<double> alpha = positive_number_in(word);
           if (!alpha)
             throw CLI::ValidationError("--wrap: '" + word + "' is no number above 0; put files before the option");
           wrap.alpha = *alpha;
         },
         "first make a closed manifold around whatever triangles\n"
         "there are, as a ball of the radius ALPHA sees them from\n"
         "outside (default: about the edge length asked for)")
      ->type_name("[ALPHA]")
      ->expected(0, 1)
      ->group("Features");
}

void Usage::refuse(const char* option, const char* why) const {
  if (given(option)) throw CLI::ValidationError(std::string(option) + ": " + why);
}

namespace {

// A number as it reads shortest, 1000 for 1e3; other words as they are.
std::string plain(const std::string& value) {
  // Of these a double has not all digits.
  if (const std::optional<std::uint64_t> whole = number_in<std::uint64_t>(value)) return fmt::format("{}", *whole);
  const std::optional<double> number = number_in<double>(value);
  return number ? fmt::format("{}", *number) : value;
}

}  // namespace

std::string Usage::words_of_result() const {
  static const std::set<std::string> none = {"device", "threads", "neighbors", "memory"};
  std::set<std::string> words;
  for (const CLI::Option* option : app_.get_options()) {
    const std::string name = option->get_single_name(), group = option->get_group();
    if (option->count() == 0 || option->get_positional() || group == "Output" || group == "Checkpoint" ||
        none.count(name) > 0)
      continue;
    for (const std::string& value : option->results()) words.insert(name + '=' + plain(value) + '\n');
  }
  std::string all;
  for (const std::string& word : words) all += word;
  return all;
}

void Usage::check_number_of_vertices() const {
  const int sizes = given("-n") + given("--edge-length") + given("--edge-length-relative");
  if (!given("--seeds") && sizes == 0)
    throw CLI::ValidationError("how many vertices? give -n N, --edge-length L or --seeds FILE.xyz");
  if (sizes > 1) throw CLI::ValidationError("-n, --edge-length and --edge-length-relative: give one of them");
  if (!given("--seeds")) return;
  for (const char* option : {"--edge-length", "--edge-length-relative"})
    refuse(option, "seeds from a file have their own number; leave one of the two out");
  refuse("--random-seed", "seeds from a file are not random; leave one of the two out");
}

void Usage::check_edge_bounds(const SizingOptions& sizing) const {
  if (sizing.max_edge > 0 && sizing.min_edge > sizing.max_edge)
    throw CLI::ValidationError("--edge-min is more than --edge-max");
}

void Usage::check_uniform_density() const {
  for (const char* option : {"--gradation", "--edge-min", "--edge-max"})
    refuse(option, "it is for edge lengths that follow a density; choose another than uniform");
}

void Usage::check_wrap(const std::string& attribute) const {
  if (!given("--wrap")) return;
  if (!attribute.empty())
    throw CLI::ValidationError("--density: a wrap has other vertices than its input; leave out attribute: or --wrap");
  refuse("--weld", "--wrap closes what welding would; leave one of the two out");
  for (const std::string option : {"--feature-file", "--keep-vertices", "--keep-faces"})
    refuse(option.c_str(), ("a wrap has other vertices than its input; leave out " + option + " or --wrap").c_str());
}

}  // namespace bisector::job
