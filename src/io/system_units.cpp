// Units of coordinate systems as LAS files tell them (GeoTIFF 1.1, OGC 19-008; WKT: OGC 01-009 and 18-010).
#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "io/bytes.h"
#include "io/point_formats.h"

namespace bisector::io {

namespace {

bool is_length(double metres) { return std::isfinite(metres) && metres > 0; }

// --- GeoTIFF ---

constexpr std::uint16_t kModelType = 1024, kProjectedSystem = 3072, kLinearUnit = 3076, kLinearUnitSize = 3077,
                        kVerticalUnit = 4099;
constexpr std::uint16_t kGeographic = 2, kDoubleParams = 34736;

double metres_of_code(std::uint16_t code) {
  static constexpr std::array<std::pair<std::uint16_t, double>, 6> kCodes{
      {{9001, 1}, {9002, 0.3048}, {9003, 1200.0 / 3937}, {9036, 1000}, {1025, 1e-3}, {1033, 1e-2}}};
  for (const auto& [known, metres] : kCodes)
    if (known == code) return metres;
  return 0;
}

// Transverse Mercator zones are in metres: of WGS 84, ETRS89 and NAD83.
bool is_utm(std::uint16_t system) {
  return (system > 32600 && system <= 32660) || (system > 32700 && system <= 32760) ||
         (system >= 25828 && system <= 25838) || (system > 26900 && system <= 26923);
}

// --- WKT ---

bool is_one_of(std::string_view word, std::initializer_list<std::string_view> words) {
  return std::find(words.begin(), words.end(), word) != words.end();
}

bool is_horizontal(std::string_view word) {
  return is_one_of(word, {"PROJCS", "PROJCRS", "PROJECTEDCRS", "LOCAL_CS", "ENGCRS", "ENGINEERINGCRS"});
}
bool is_vertical(std::string_view word) { return is_one_of(word, {"VERT_CS", "VERTCS", "VERTCRS", "VERTICALCRS"}); }
bool is_geographic(std::string_view word) { return is_one_of(word, {"GEOGCS", "GEOGCRS", "GEOGRAPHICCRS"}); }

bool is_named_foot(std::string_view name) {
  std::string lower(name);
  for (char& c : lower)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return lower.find("foot") != std::string::npos || lower.find("feet") != std::string::npos;
}

// Of what follows the bracket of UNIT["metre",1]; 0 if that is no length. Some files have feet of 1 m, which tells
// nothing.
double metres_of_unit(std::string_view text) {
  const std::size_t begin = text.find('"');
  const std::size_t end = begin == std::string_view::npos ? begin : text.find('"', begin + 1);
  if (end == std::string_view::npos) return 0;
  const std::size_t number = text.find_first_not_of(", \t\r\n", end + 1);
  if (number == std::string_view::npos) return 0;
  double metres = 0;
  const auto [stop, error] = std::from_chars(text.data() + number, text.data() + text.size(), metres);
  if (error != std::errc{} || !is_length(metres)) return 0;
  return metres == 1 && is_named_foot(text.substr(begin, std::min<std::size_t>(end - begin, 80))) ? 0 : metres;
}

}  // namespace

SystemUnits units_of_geo_keys(std::string_view keys, std::string_view doubles) {
  SystemUnits units;
  constexpr std::size_t kEntry = 8;  // four shorts; the first entry is the head
  if (keys.size() < kEntry) return units;
  const std::size_t count =
      std::min<std::size_t>(load<std::uint16_t>(keys.data() + 6, false), keys.size() / kEntry - 1);
  double linear = 0, size = 0;
  bool utm = false;
  for (std::size_t k = 1; k <= count; ++k) {
    std::array<std::uint16_t, 4> entry;
    for (std::size_t i = 0; i < 4; ++i) entry[i] = load<std::uint16_t>(keys.data() + kEntry * k + 2 * i, false);
    const auto& [id, location, values, value] = entry;
    if (id == kModelType) units.degrees = value == kGeographic;
    if (id == kProjectedSystem) utm = is_utm(value);
    if (id == kLinearUnit) linear = metres_of_code(value);
    if (id == kVerticalUnit) units.vertical = metres_of_code(value);
    if (id == kLinearUnitSize && location == kDoubleParams && 8 * (std::size_t{value} + 1) <= doubles.size())
      size = load<double>(doubles.data() + 8 * std::size_t{value}, false);
  }
  units.horizontal = linear > 0 ? linear : is_length(size) ? size : utm ? 1 : 0;
  return units;
}

SystemUnits units_of_wkt(std::string_view text) {
  constexpr std::size_t kDeepest = 64;  // real ones have a fifth of it
  SystemUnits units;
  bool horizontal = false, geographic = false;
  std::vector<std::string_view> open;  // keywords of the brackets around
  std::string_view word;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (c == '"') {
      i = std::min(text.find('"', i + 1), text.size() - 1);
      word = {};
    } else if (c == '[' || c == '(') {
      if (open.size() == kDeepest) return {};
      horizontal = horizontal || is_horizontal(word);
      geographic = geographic || is_geographic(word);
      if ((word == "UNIT" || word == "LENGTHUNIT") && !open.empty()) {
        const std::string_view around = open.back() == "AXIS" && open.size() > 1 ? open[open.size() - 2] : open.back();
        double* unit = is_horizontal(around) ? &units.horizontal : is_vertical(around) ? &units.vertical : nullptr;
        if (unit && *unit == 0) *unit = metres_of_unit(text.substr(i + 1));
      }
      open.push_back(word);
      word = {};
    } else if (c == ']' || c == ')') {
      if (!open.empty()) open.pop_back();
      word = {};
    } else if ((c >= 'A' && c <= 'Z') || c == '_') {
      word = word.empty() ? text.substr(i, 1) : std::string_view(word.data(), word.size() + 1);
    } else {
      word = {};
    }
  }
  units.degrees = geographic && !horizontal;
  return units;
}

}  // namespace bisector::io
