#include "tree/iges.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <map>
#include <sstream>

#include "bisector/error.h"
#include "core/geometry.h"
#include "tree/bspline.h"
#include "tree/loft.h"

namespace bisector {
namespace {

struct DirectoryEntry {
  std::array<std::string, 18> fields;  // two lines of nine
};

struct IgesFile {
  std::map<char, std::vector<std::string>> sections;  // columns 1 to 72
  std::vector<std::string> global;                    // fields
  std::vector<DirectoryEntry> directory;
};

std::string trimmed(const std::string& s) {
  const std::size_t from = s.find_first_not_of(' ');
  return from == std::string::npos ? "" : s.substr(from, s.find_last_not_of(' ') - from + 1);
}

// Fields up to the record's end; strings (nH...) may hold delimiters.
std::vector<std::string> fields_of(const std::string& text) {
  std::vector<std::string> fields(1);
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == 'H' && !fields.back().empty() &&
        fields.back().find_first_not_of("0123456789") == std::string::npos) {
      const std::size_t length = std::stoul(fields.back());
      fields.back() = text.substr(i + 1, length);
      i += length;
    } else if (text[i] == ';') {
      return fields;
    } else if (text[i] == ',') {
      fields.emplace_back();
    } else if (text[i] != ' ') {
      fields.back() += text[i];
    }
  }
  ADD_FAILURE() << "a record without an end";
  return fields;
}

double number(std::string text) {
  EXPECT_NE(text.find('.'), std::string::npos) << text;
  const std::size_t exponent = text.find('D');
  if (exponent != std::string::npos) text[exponent] = 'e';
  return std::stod(text);
}

IgesFile parse(const std::filesystem::path& path) {
  IgesFile file;
  std::ifstream in(path);
  std::string line, order;
  while (std::getline(in, line)) {
    EXPECT_EQ(line.size(), 80u);
    if (line.size() != 80) return file;
    const char section = line[72];
    if (order.empty() || order.back() != section) order += section;
    file.sections[section].push_back(line.substr(0, 72));
    EXPECT_EQ(std::stoul(line.substr(73)), file.sections[section].size());
  }
  EXPECT_EQ(order, "SGDPT");
  std::string global;
  for (const std::string& text : file.sections['G']) global += text;
  file.global = fields_of(global);
  const std::vector<std::string>& directory = file.sections['D'];
  EXPECT_EQ(directory.size() % 2, 0u);
  for (std::size_t d = 0; d + 1 < directory.size(); d += 2) {
    DirectoryEntry entry;
    for (std::size_t k = 0; k < 18; ++k) entry.fields[k] = trimmed(directory[d + k / 9].substr(8 * (k % 9), 8));
    file.directory.push_back(entry);
  }
  return file;
}

// The fields of the entity whose directory entry begins at a line, counted from 1.
std::vector<std::string> parameters_of(const IgesFile& file, std::size_t directory_line) {
  EXPECT_EQ(directory_line % 2, 1u);
  const DirectoryEntry& entry = file.directory.at((directory_line - 1) / 2);
  const std::size_t first = std::stoul(entry.fields[1]), count = std::stoul(entry.fields[12]);
  std::string text;
  for (std::size_t p = first - 1; p < first - 1 + count; ++p) {
    const std::string& line = file.sections.at('P').at(p);
    EXPECT_EQ(std::stoul(line.substr(64)), directory_line);
    text += line.substr(0, 64);
  }
  const std::vector<std::string> fields = fields_of(text);
  EXPECT_EQ(fields[0], entry.fields[0]);
  return fields;
}

struct Surface {
  std::size_t rows = 0, columns = 0;
  std::vector<double> knots_u, knots_v, weights;
  std::vector<Vec3> control;
  std::string name;

  Vec3 point(double u, double v) const {
    const BasisFunctions a = basis_functions(knots_u, 3, u), b = basis_functions(knots_v, 3, v);
    Vec3 sum;
    for (std::size_t i = 0; i < 4; ++i)
      for (std::size_t j = 0; j < 4; ++j)
        sum += a.values[i] * b.values[j] * control[(a.first + i) * columns + b.first + j];
    return sum;
  }
};

Surface surface_of(const IgesFile& file, std::size_t directory_line) {
  const std::vector<std::string> fields = parameters_of(file, directory_line);
  Surface s;
  EXPECT_EQ(fields[0], "128");
  s.rows = std::stoul(fields[1]) + 1;
  s.columns = std::stoul(fields[2]) + 1;
  EXPECT_EQ(fields[3] + fields[4], "33");
  EXPECT_EQ(fields[5] + fields[6] + fields[7] + fields[8] + fields[9], "01100");
  std::size_t at = 10;
  for (std::size_t i = 0; i < s.rows + 4; ++i) s.knots_u.push_back(number(fields.at(at++)));
  for (std::size_t i = 0; i < s.columns + 4; ++i) s.knots_v.push_back(number(fields.at(at++)));
  for (std::size_t i = 0; i < s.rows * s.columns; ++i) s.weights.push_back(number(fields.at(at++)));
  s.control.resize(s.rows * s.columns);
  for (std::size_t j = 0; j < s.columns; ++j)
    for (std::size_t i = 0; i < s.rows; ++i)
      for (int k = 0; k < 3; ++k) s.control[i * s.columns + j][k] = number(fields.at(at++));
  EXPECT_EQ(number(fields.at(at)), s.knots_u.front());
  EXPECT_EQ(number(fields.at(at + 1)), s.knots_u.back());
  EXPECT_EQ(number(fields.at(at + 2)), s.knots_v.front());
  EXPECT_EQ(number(fields.at(at + 3)), s.knots_v.back());
  EXPECT_EQ(fields.at(at + 4) + fields.at(at + 5), "01");
  const std::size_t property = std::stoul(fields.at(at + 6));
  EXPECT_EQ(fields.size(), at + 7);
  const std::vector<std::string> name = parameters_of(file, property);
  EXPECT_EQ(name[0] + ',' + name[1], "406,1");
  EXPECT_EQ(file.directory[(property - 1) / 2].fields[13], "15");
  s.name = name.at(2);
  return s;
}

std::vector<BranchSurface> some_branches() {
  return {loft_branch({{0, 0, 0}, {0.1, 0, 2}, {0.5, 0, 4}, {0.5, 0.2, 8}}, {1, 0.9, 0.8, 0.5}, 0.01),
          loft_branch({{1e6, -2e6, 4}, {1e6 + 3, -2e6, 5}, {1e6 + 5, -2e6 + 1, 7}}, {0.3, 0.2, 0}, 0.01),
          loft_branch({{1e-7, 0, 0}, {1e-7, 2e-7, 3e-7}}, {1e-8, 1e-8}, 0)};
}

class Iges : public testing::Test {
 protected:
  std::filesystem::path path_ = std::filesystem::path(testing::TempDir()) / "iges_test.igs";
  void TearDown() override { std::filesystem::remove(path_); }
};

TEST_F(Iges, SurfacesAreReadBack) {
  const std::vector<BranchSurface> branches = some_branches();
  const std::vector<std::string> names{
      "trunk", "a branch; with, delimiters 3H and a name longer than a line of the section", "x"};
  write_iges(path_.string(), branches, names);
  const IgesFile file = parse(path_);
  ASSERT_EQ(file.directory.size(), 6u);
  std::vector<std::size_t> surfaces;
  for (std::size_t d = 0; d < file.directory.size(); ++d)
    if (file.directory[d].fields[0] == "128") surfaces.push_back(2 * d + 1);
  ASSERT_EQ(surfaces.size(), 3u);
  for (std::size_t b = 0; b < 3; ++b) {
    const Surface s = surface_of(file, surfaces[b]);
    const BranchSurface& original = branches[b];
    EXPECT_EQ(s.name, names[b]);
    EXPECT_EQ(s.rows, original.rows);
    EXPECT_EQ(s.columns, original.columns);
    EXPECT_TRUE(s.knots_u == original.knots_u);
    for (const double w : s.weights) EXPECT_EQ(w, 1);
    // Clamped in v at both ends, with the same control points but for two at each.
    for (std::size_t k = 0; k < 4; ++k) {
      EXPECT_EQ(s.knots_v[k], 0);
      EXPECT_EQ(s.knots_v[s.columns + k], 1);
    }
    for (std::size_t i = 0; i < s.rows; ++i) {
      for (std::size_t j = 2; j + 2 < s.columns; ++j)
        EXPECT_TRUE(s.control[i * s.columns + j] == original.control[i * s.columns + j]);
      EXPECT_TRUE(s.control[i * s.columns] == s.control[(i + 1) * s.columns - 1]);
    }
    const double size = bounding_box(original.control).diagonal(), far = norm(original.control[0]);
    for (const double u : {-1.0, -0.4, 0.0, 0.33, 0.8, 1.0, 1.6, 2.0})
      for (int j = 0; j <= 40; ++j)
        EXPECT_LT(norm(s.point(u, j / 40.0) - original.point(u, j / 40.0)), 1e-13 * size + 1e-15 * far);
  }
}

TEST_F(Iges, FileIsAsTheStandardSays) {
  const std::vector<BranchSurface> branches = some_branches();
  const std::vector<std::pair<IgesUnit, std::array<std::string, 2>>> units{{IgesUnit::millimetre, {"2", "MM"}},
                                                                           {IgesUnit::centimetre, {"10", "CM"}},
                                                                           {IgesUnit::metre, {"6", "M"}},
                                                                           {IgesUnit::inch, {"1", "INCH"}},
                                                                           {IgesUnit::foot, {"4", "FT"}}};
  for (const auto& [unit, written] : units) {
    write_iges(path_.string(), branches, {"a", "b", "c"}, unit);
    const IgesFile file = parse(path_);
    ASSERT_EQ(file.global.size(), 25u);
    EXPECT_EQ(file.global[0], ",");
    EXPECT_EQ(file.global[1], ";");
    EXPECT_EQ(file.global[3], "iges_test.igs");
    EXPECT_EQ(file.global[13], written[0]);
    EXPECT_EQ(file.global[14], written[1]);
    EXPECT_EQ(file.global[22], "11");
    EXPECT_GE(number(file.global[19]), 2e6);
  }
  const IgesFile file = parse(path_);
  std::size_t next = 1;
  for (std::size_t d = 0; d < file.directory.size(); ++d) {
    const auto& fields = file.directory[d].fields;
    EXPECT_EQ(fields[0], fields[9]);
    EXPECT_EQ(fields[8].size(), 8u);
    EXPECT_EQ(std::stoul(fields[1]), next);
    next += std::stoul(fields[12]);
  }
  EXPECT_EQ(next, file.sections.at('P').size() + 1);
  const std::string& end = file.sections.at('T').at(0);
  std::size_t column = 0;
  for (const char section : {'S', 'G', 'D', 'P'}) {
    EXPECT_EQ(end[column], section);
    EXPECT_EQ(std::stoul(end.substr(column + 1, 7)), file.sections.at(section).size());
    column += 8;
  }
  EXPECT_EQ(file.sections.at('T').size(), 1u);
}

TEST_F(Iges, NumbersAreNotBrokenBetweenLines) {
  write_iges(path_.string(), some_branches(), {"a", "b", "c"});
  const IgesFile file = parse(path_);
  for (const std::string& line : file.sections.at('P')) {
    const std::string text = trimmed(line.substr(0, 64));
    EXPECT_TRUE(text.back() == ',' || text.back() == ';') << text;
  }
}

TEST_F(Iges, BadInputIsRefused) {
  std::vector<BranchSurface> branches = some_branches();
  EXPECT_THROW(write_iges(path_.string(), {}, {}), Error);
  EXPECT_THROW(write_iges(path_.string(), branches, {"a"}), Error);
  EXPECT_THROW(write_iges(path_.string(), branches, {"a", "", "c"}), Error);
  EXPECT_THROW(write_iges(path_.string(), branches, {"a", "b\n", "c"}), Error);
  EXPECT_THROW(write_iges("/no/such/folder/x.igs", branches, {"a", "b", "c"}), Error);
  branches[1].control[5].y = std::numeric_limits<double>::infinity();
  EXPECT_THROW(write_iges(path_.string(), branches, {"a", "b", "c"}), Error);
  EXPECT_FALSE(std::filesystem::exists(path_));
}

}  // namespace
}  // namespace bisector
