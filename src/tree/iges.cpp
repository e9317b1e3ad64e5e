#include "tree/iges.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <string_view>
#include <utility>

#include "bisector/error.h"
#include "bisector/io.h"
#include "core/geometry.h"
#include "io/files.h"

namespace bisector {
namespace {

constexpr std::size_t kTextWidth = 72,
                      kDataWidth = 64;         // columns of a line for the start and global, the parameter section
constexpr std::size_t kMostLines = 9'999'999;  // that sequence numbers have digits for
constexpr std::string_view kDate = "19700101.000000";

bool printable(char c) { return c >= ' ' && c <= '~'; }

void check_input(const std::vector<BranchSurface>& surfaces, const std::vector<std::string>& names) {
  if (surfaces.empty()) throw Error("IGES: there are no surfaces; give one or more");
  if (surfaces.size() != names.size())
    throw Error(fmt::format("IGES: {} names for {} surfaces; give one each", names.size(), surfaces.size()));
  for (std::size_t i = 0; i < surfaces.size(); ++i) {
    if (names[i].empty() || !std::all_of(names[i].begin(), names[i].end(), printable))
      throw Error(fmt::format("IGES: the name of surface {} is not printable ASCII; choose another", i));
    for (const Vec3& c : surfaces[i].control)
      if (!std::isfinite(c.x) || !std::isfinite(c.y) || !std::isfinite(c.z))
        throw Error(fmt::format("IGES: surface {} has control points that are not finite; mend it", i));
  }
}

// With a decimal point, as reals need, and the exponent of a double.
std::string real(double value) {
  std::string text = fmt::format("{}", value == 0 ? 0.0 : value);
  const std::size_t exponent = text.find('e');
  if (text.find('.') == std::string::npos) text.insert(std::min(exponent, text.size()), ".");
  if (exponent != std::string::npos) text[text.find('e')] = 'D';
  return text;
}

std::string hollerith(std::string_view text) { return fmt::format("{}H{}", text.size(), text); }

// Fields one after the other, in lines that break between them; only strings longer than a line are broken themselves.
class FieldLines {
 public:
  explicit FieldLines(std::size_t width) : width_(width) {}

  void add(const std::string& field, char delimiter = ',') {
    std::string text = field + delimiter;
    if (lines_.empty() || (lines_.back().size() + text.size() > width_ && !lines_.back().empty()))
      lines_.emplace_back();
    for (; text.size() > width_; text.erase(0, width_)) {
      lines_.back() = text.substr(0, width_);
      lines_.emplace_back();
    }
    lines_.back() += text;
  }

  const std::vector<std::string>& lines() const { return lines_; }

 private:
  std::size_t width_;
  std::vector<std::string> lines_;
};

struct Entity {
  int type, form;
  std::string status, label;
  std::vector<std::string> parameters;  // lines
};

struct ClampedSurface {
  std::vector<double> knots_v;
  std::vector<Vec3> control;
};

// The same surface with the domain's end knots of v fourfold: not all systems read others. Blossoms of the uniform
// cubic at the first three and the last three knots (Ramshaw 1989).
ClampedSurface clamp_around(const BranchSurface& s) {
  ClampedSurface clamped;
  clamped.knots_v = s.knots_v;
  std::fill_n(clamped.knots_v.begin(), 4, s.knots_v[3]);
  std::fill_n(clamped.knots_v.end() - 4, 4, s.knots_v[s.columns]);
  clamped.control = s.control;
  for (std::size_t i = 0; i < s.rows; ++i) {
    const Vec3* from = &s.control[i * s.columns];
    Vec3* to = &clamped.control[i * s.columns];
    const std::size_t last = s.columns - 1;
    to[0] = (1 / 6.0) * (from[0] + 4 * from[1] + from[2]);
    to[1] = (1 / 3.0) * (2 * from[1] + from[2]);
    to[last - 1] = (1 / 3.0) * (2 * from[last - 1] + from[last - 2]);
    to[last] = to[0];
  }
  return clamped;
}

std::vector<std::string> surface_parameters(const BranchSurface& s, std::size_t name_entry) {
  const ClampedSurface clamped = clamp_around(s);
  FieldLines fields(kDataWidth);
  for (const std::size_t n : {std::size_t{128}, s.rows - 1, s.columns - 1, std::size_t{3}, std::size_t{3}})
    fields.add(fmt::format("{}", n));
  for (const int flag : {0, 1, 1, 0, 0}) fields.add(fmt::format("{}", flag));  // closed in v, polynomial, not periodic
  for (const double knot : s.knots_u) fields.add(real(knot));
  for (const double knot : clamped.knots_v) fields.add(real(knot));
  for (std::size_t i = 0; i < clamped.control.size(); ++i) fields.add(real(1));  // weights
  for (std::size_t j = 0; j < s.columns; ++j)
    for (std::size_t i = 0; i < s.rows; ++i)
      for (int k = 0; k < 3; ++k) fields.add(real(clamped.control[i * s.columns + j][k]));
  for (const double end : {s.knots_u.front(), s.knots_u.back(), clamped.knots_v.front(), clamped.knots_v.back()})
    fields.add(real(end));
  fields.add("0");  // associated entities
  fields.add("1");  // properties
  fields.add(fmt::format("{}", name_entry), ';');
  return fields.lines();
}

std::vector<std::string> name_parameters(const std::string& name) {
  FieldLines fields(kDataWidth);
  fields.add("406");
  fields.add("1");
  fields.add(hollerith(name), ';');
  return fields.lines();
}

// Each surface, followed by its name. An entity's number in the directory is that of its first line.
std::vector<Entity> collect_entities(const std::vector<BranchSurface>& surfaces,
                                     const std::vector<std::string>& names) {
  std::vector<Entity> entities;
  for (std::size_t i = 0; i < surfaces.size(); ++i) {
    const std::string label = names[i].size() <= 8 ? names[i] : "";
    entities.push_back({128, 0, "00000000", label, surface_parameters(surfaces[i], 4 * i + 3)});
    entities.push_back({406, 15, "00010300", "", name_parameters(names[i])});
  }
  return entities;
}

std::vector<std::string> global_lines(const std::string& path, const std::vector<BranchSurface>& surfaces,
                                      IgesUnit unit) {
  double largest = 0;
  for (const BranchSurface& s : surfaces)
    for (const Vec3& c : s.control) largest = std::max({largest, std::abs(c.x), std::abs(c.y), std::abs(c.z)});
  std::string file = path.substr(path.find_last_of('/') + 1);
  for (char& c : file)
    if (!printable(c)) c = '?';
  static constexpr std::array<std::pair<int, std::string_view>, 5> kUnits{
      {{2, "MM"}, {10, "CM"}, {6, "M"}, {1, "INCH"}, {4, "FT"}}};
  const auto& [flag, unit_name] = kUnits[static_cast<std::size_t>(unit)];

  const std::vector<std::string> values{hollerith(","),
                                        hollerith(";"),
                                        hollerith("branches"),
                                        hollerith(file),
                                        hollerith("Bisector"),  // system
                                        hollerith("Bisector"),  // preprocessor
                                        "32",                   // bits of an integer
                                        "38",                   // powers of ten and digits of a float
                                        "6",
                                        "308",  // and of a double
                                        "17",
                                        hollerith("branches"),
                                        real(1),  // scale
                                        fmt::format("{}", flag),
                                        hollerith(unit_name),
                                        "1",  // line weights and their width
                                        real(1e-9 * largest),
                                        hollerith(kDate),
                                        real(1e-9 * largest),  // resolution
                                        real(largest),
                                        "",    // author
                                        "",    // organisation
                                        "11",  // version 5.3
                                        "0"};  // no drafting standard
  FieldLines fields(kTextWidth);
  for (const std::string& value : values) fields.add(value);
  fields.add(hollerith(kDate), ';');
  return fields.lines();
}

class Writer {
 public:
  // A line of `text`, at most 72 columns wide, in a section.
  void add(std::string_view text, char section, std::size_t number) {
    if (number > kMostLines)
      throw Error("IGES: the surfaces need more than 9999999 lines; write them to several files");
    fmt::format_to(std::back_inserter(bytes_), "{:<72}{}{:>7}\n", text, section, number);
  }

  const std::string& bytes() const { return bytes_; }

 private:
  std::string bytes_;
};

std::string directory_lines(const Entity& e, std::size_t parameter_line, int half) {
  if (half == 0)
    return fmt::format("{:>8}{:>8}{:>8}{:>8}{:>8}{:>8}{:>8}{:>8}{:>8}", e.type, parameter_line, 0, 0, 0, 0, 0, 0,
                       e.status);
  return fmt::format("{:>8}{:>8}{:>8}{:>8}{:>8}{:>8}{:>8}{:>8}{:>8}", e.type, 0, 0, e.parameters.size(), e.form, "", "",
                     e.label, 0);
}

}  // namespace

void write_iges(const std::string& path, const std::vector<BranchSurface>& surfaces,
                const std::vector<std::string>& names, IgesUnit unit) {
  check_input(surfaces, names);
  const std::vector<Entity> entities = collect_entities(surfaces, names);
  const std::vector<std::string> global = global_lines(path, surfaces, unit);

  Writer writer;
  writer.add("Branch surfaces", 'S', 1);
  for (std::size_t i = 0; i < global.size(); ++i) writer.add(global[i], 'G', i + 1);
  std::size_t parameter_lines = 0;
  for (std::size_t e = 0; e < entities.size(); ++e) {
    for (const int half : {0, 1})
      writer.add(directory_lines(entities[e], parameter_lines + 1, half), 'D',
                 2 * e + 1 + static_cast<std::size_t>(half));
    parameter_lines += entities[e].parameters.size();
  }
  std::size_t line = 0;
  for (std::size_t e = 0; e < entities.size(); ++e)
    for (const std::string& text : entities[e].parameters)
      writer.add(fmt::format("{:<64}{:>8}", text, 2 * e + 1), 'P', ++line);
  writer.add(fmt::format("S{:>7}G{:>7}D{:>7}P{:>7}", 1, global.size(), 2 * entities.size(), parameter_lines), 'T', 1);
  write_file(path, writer.bytes());
}

}  // namespace bisector
