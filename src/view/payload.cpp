#include "view/payload.h"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <vector>

#include "bisector/error.h"
#include "core/geometry.h"
#include "view/simplify.h"

namespace bisector::view {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kGridSteps = 1 << 20;  // of coordinates, along the longest side of all models
constexpr std::size_t kBinSteps = 64;   // of values, in a bin of their histogram
constexpr std::size_t kMostBars = 64;   // groups are counted up to so many
constexpr std::size_t kWorst = 10;      // elements that are listed

class Arrays {
 public:
  // Where the array of n integers lies, and n.
  template <class At>
  Json add(std::size_t n, std::size_t stride, const At& at) {
    const std::size_t offset = bytes_.size();
    for (std::size_t i = 0; i < n; ++i) {
      const std::int64_t difference = at(i) - (i < stride ? 0 : at(i - stride));
      auto rest = static_cast<std::uint64_t>(difference < 0 ? -2 * difference - 1 : 2 * difference);
      for (; rest > 127; rest >>= 7) bytes_ += static_cast<char>((rest & 127) | 128);
      bytes_ += static_cast<char>(rest);
    }
    return {offset, n};
  }

  Json add(const std::string& text) {
    bytes_ += text;
    return {bytes_.size() - text.size(), text.size()};
  }

  template <std::size_t N>
  Json add_rows(const std::vector<std::array<Index, N>>& rows) {
    return add(N * rows.size(), N, [&](std::size_t i) { return std::int64_t{rows[i / N][i % N]}; });
  }

  const std::string& bytes() const { return bytes_; }

 private:
  std::string bytes_;
};

// Integer coordinates, from the corner of all models.
struct Grid {
  Vec3 origin;
  double step = 1;

  explicit Grid(const std::vector<Model>& models) {
    std::vector<Vec3> corners;
    for (const Model& model : models) {
      if (model.vertices.empty()) continue;
      const Box box = bounding_box(model.vertices);
      corners.insert(corners.end(), {box.lo, box.hi});
    }
    const Box box = bounding_box(corners);
    const Vec3 sides = box.hi - box.lo;
    origin = box.lo;
    if (const double side = std::max({sides.x, sides.y, sides.z}); side > 0) step = side / kGridSteps;
  }

  std::int64_t coordinate(const Vec3& p, int k) const { return std::llround((p[k] - origin[k]) / step); }
};

std::size_t bin_of(const Measure& measure, double value) {
  const double at = (value - measure.least) / (measure.most - measure.least) * static_cast<double>(measure.bins);
  return static_cast<std::size_t>(std::clamp(std::floor(at), 0.0, static_cast<double>(measure.bins - 1)));
}

// 0 where there is no value; else 1 and a group's number, or so many steps of the scale.
std::int64_t code_of(const Measure& measure, double value) {
  if (std::isnan(value)) return 0;
  if (measure.is_group()) return 1 + static_cast<std::int64_t>(value);
  const double steps = static_cast<double>(measure.bins * kBinSteps);
  const double at = (value - measure.least) / (measure.most - measure.least) * steps;
  return 1 + static_cast<std::int64_t>(std::clamp(std::floor(at), 0.0, steps - 1));
}

Json counts_json(const Measure& measure, const std::vector<double>& values) {
  std::vector<std::size_t> counts(measure.is_group() ? measure.names.size() : measure.bins, 0);
  for (const double value : values)
    if (!std::isnan(value)) ++counts[measure.is_group() ? static_cast<std::size_t>(value) : bin_of(measure, value)];
  return counts;
}

std::vector<Vec3> corners_of(const Model& model, Element element, std::size_t i) {
  std::vector<Vec3> corners;
  if (element == Element::vertex) corners.push_back(model.vertices[i]);
  if (element == Element::triangle)
    for (const Index v : model.triangles[i]) corners.push_back(model.vertices[v]);
  if (element == Element::tet)
    for (const Index v : model.tets[i]) corners.push_back(model.vertices[v]);
  return corners;
}

Json worst_json(const Model& model, const Measure& measure, const std::vector<double>& values) {
  Json rows = Json::array();
  for (const std::size_t i : worst_elements(measure, values, kWorst)) {
    const bool is_face = measure.element == Element::triangle && !model.face_of_triangle.empty();
    Json corners = Json::array();
    for (const Vec3& p : corners_of(model, measure.element, i)) corners.push_back({p.x, p.y, p.z});
    rows.push_back({{"number", is_face ? model.face_of_triangle[i] : i}, {"value", values[i]}, {"corners", corners}});
  }
  return rows;
}

const char* name_of(Element element) {
  constexpr std::array<const char*, 3> kNames{"vertex", "triangle", "tet"};
  return kNames[static_cast<std::size_t>(element)];
}

const char* name_of(Worst worst) {
  constexpr std::array<const char*, 4> kNames{"none", "low", "high", "off_six"};
  return kNames[static_cast<std::size_t>(worst)];
}

Json measure_json(const Measure& measure, Arrays& arrays) {
  Json json{{"key", measure.key},
            {"label", measure.label},
            {"unit", measure.unit},
            {"element", name_of(measure.element)},
            {"worst", name_of(measure.worst)}};
  if (!measure.is_group()) {
    json["least"] = measure.least;
    json["most"] = measure.most;
    json["bins"] = measure.bins;
    return json;
  }
  json["groups"] = measure.names.size();
  if (measure.names.size() <= kMostBars) json["names"] = measure.names;
  if (!measure.colours.empty())
    json["colours"] = arrays.add(3 * measure.colours.size(), 3,
                                 [&](std::size_t i) { return std::int64_t{measure.colours[i / 3][i % 3]}; });
  return json;
}

// What is shown of a model: itself, or less.
std::optional<Model> lessened(const Model& model, const std::vector<Measure>& measures, const Limits& limits) {
  const bool points = model.triangles.empty() && model.tets.empty();
  if (points && model.vertices.size() > limits.points) return thinned(model, limits.points);
  if (model.triangles.size() > limits.triangles || model.tets.size() > limits.tets)
    return simplified(model, measures, limits.triangles);
  return std::nullopt;
}

Json sizes_json(const Model& model) {
  return {{"vertices", model.vertices.size()}, {"triangles", model.triangles.size()}, {"tets", model.tets.size()}};
}

Json model_json(const Model& model, const std::vector<Measure>& measures, const Limits& limits, const Grid& grid,
                Arrays& arrays) {
  const std::optional<Model> less = lessened(model, measures, limits);
  const Model& shown = less ? *less : model;
  Json json{{"title", model.title}, {"file", model.file}, {"sizes", sizes_json(model)}};
  if (less) json["shown"] = sizes_json(shown);
  json["edges"] = model.edges;
  json["vertices"] = arrays.add(3 * shown.vertices.size(), 3, [&](std::size_t i) {
    return grid.coordinate(shown.vertices[i / 3], static_cast<int>(i % 3));
  });
  json["triangles"] = arrays.add_rows(shown.triangles);
  json["tets"] = arrays.add_rows(shown.tets);
  json["lines"] = arrays.add_rows(shown.lines);
  json["values"] = Json::object();
  for (const Measure& measure : measures) {
    const auto of_measure = [&](const Values& values) { return values.key == measure.key; };
    const auto all = std::find_if(model.values.begin(), model.values.end(), of_measure);
    if (all == model.values.end()) continue;
    Json& entry = json["values"][measure.key] = Json::object();
    if (!measure.is_group() || measure.names.size() <= kMostBars) entry["counts"] = counts_json(measure, all->at);
    if (measure.worst != Worst::none) entry["worst"] = worst_json(model, measure, all->at);
    const auto some = std::find_if(shown.values.begin(), shown.values.end(), of_measure);
    if (some == shown.values.end()) continue;
    entry["codes"] = arrays.add(some->at.size(), 1, [&](std::size_t i) { return code_of(measure, some->at[i]); });
  }
  return json;
}

std::string deflated(const std::string& bytes) {
  uLongf size = compressBound(bytes.size());
  std::string out(size, '\0');
  if (compress2(reinterpret_cast<Bytef*>(out.data()), &size, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size(),
                Z_DEFAULT_COMPRESSION) != Z_OK)
    throw Error("not enough memory to compress the report; write a .json report instead");
  out.resize(size);
  return out;
}

}  // namespace

std::string encode(const Scene& scene, const std::string& report, const Limits& limits) {
  Arrays arrays;
  const Grid grid(scene.models);
  Json header{{"report", arrays.add(report)},
              {"origin", {grid.origin.x, grid.origin.y, grid.origin.z}},
              {"step", grid.step},
              {"bin_steps", kBinSteps},
              {"measures", Json::array()},
              {"models", Json::array()}};
  for (const Measure& measure : scene.measures) header["measures"].push_back(measure_json(measure, arrays));
  for (const Model& model : scene.models)
    header["models"].push_back(model_json(model, scene.measures, limits, grid, arrays));
  const std::string text = header.dump(-1, ' ', false, Json::error_handler_t::replace);
  std::string bytes;
  for (int shift = 0; shift < 32; shift += 8) bytes += static_cast<char>((text.size() >> shift) & 255);
  return deflated(bytes + text + arrays.bytes());
}

}  // namespace bisector::view
