// Medit's ASCII format (Frey, MEDIT: An interactive mesh visualization software, INRIA RT-0253, 2001) and its
// solutions.
#include <algorithm>
#include <map>
#include <utility>

#include "io/tet_formats.h"

namespace bisector::io {

namespace {

template <std::size_t N>
void read_elements(MixedReader& in, const char* kind, std::size_t vertices, std::vector<std::array<Index, N>>& elements,
                   std::vector<std::int32_t>* refs) {
  const std::size_t n = in.count(kind);
  in.need_room(n, N + 1, 4, kind);
  elements.reserve(elements.size() + n);
  for (std::size_t i = 0; i < n; ++i) {
    std::array<Index, N> corners{};
    for (Index& corner : corners) {
      const auto v = in.value<std::int64_t>();
      if (v < 1 || v > static_cast<std::int64_t>(vertices))
        in.fail(fmt::format("index {} is out of range, the file has {} vertices, counted from 1; mend the element", v,
                            vertices));
      corner = static_cast<Index>(v - 1);
    }
    elements.push_back(corners);
    const auto ref = in.value<std::int32_t>();
    if (refs) refs->push_back(ref);
  }
}

// Numbers per item of the keywords that are passed over.
int numbers_of(std::string_view keyword) {
  static const std::map<std::string_view, int> kNumbers{{"Corners", 1},
                                                        {"Ridges", 1},
                                                        {"RequiredVertices", 1},
                                                        {"RequiredEdges", 1},
                                                        {"RequiredTriangles", 1},
                                                        {"RequiredTetrahedra", 1},
                                                        {"Normals", 3},
                                                        {"Tangents", 3},
                                                        {"NormalAtVertices", 2},
                                                        {"TangentAtVertices", 2},
                                                        {"TangentAtEdges", 3},
                                                        {"NormalAtTriangleVertices", 3},
                                                        {"Geometry", 0},
                                                        {"VertexOnGeometricVertex", 2},
                                                        {"VertexOnGeometricEdge", 3},
                                                        {"EdgeOnGeometricEdge", 2},
                                                        {"AngleOfCornerBound", -1},
                                                        {"ParallelVertices", 2},
                                                        {"ParallelEdges", 2},
                                                        {"ParallelTriangles", 2}};
  const auto found = kNumbers.find(keyword);
  return found == kNumbers.end() ? -2 : found->second;
}

void skip_items(MixedReader& in, std::string_view keyword, int numbers) {
  if (numbers < 0) {
    in.value<double>();
    return;
  }
  if (numbers == 0) {
    in.need_word("a file name");
    return;
  }
  const std::size_t n = in.count("items");
  in.need_room(n, static_cast<std::size_t>(numbers), 8, std::string(keyword).c_str());
  for (std::size_t i = 0; i < n * static_cast<std::size_t>(numbers); ++i) in.value<double>();
}

void read_header(MixedReader& in) {
  const std::string_view first = in.word();
  if (first != "MeshVersionFormatted")
    in.fail("'" + printable(first) +
            "' is not 'MeshVersionFormatted'; only ASCII Medit files are read, convert the mesh");
  const std::int64_t version = in.integer("the version");
  if (version < 0 || version > 4) in.fail(fmt::format("version {} is not known; save as version 2", version));
  const std::string_view dimension = in.need_word("'Dimension'");
  if (dimension != "Dimension") in.fail("'" + printable(dimension) + "' is not 'Dimension'; " + kExportAgain);
  if (const std::int64_t d = in.integer("the dimension"); d != 3)
    in.fail(fmt::format("the dimension is {}; export in 3 dimensions", d));
}

}  // namespace

TetSoup read_medit(const std::string& path, std::string_view bytes) {
  MixedReader in(path, bytes, '#');
  read_header(in);
  TetSoup soup;
  bool vertices_seen = false;
  for (std::string_view keyword = in.word(); !keyword.empty() && keyword != "End"; keyword = in.word()) {
    if (keyword == "Vertices") {
      if (vertices_seen) in.fail(std::string("'Vertices' occurs twice; ") + kExportAgain);
      vertices_seen = true;
      const std::size_t n = in.count("vertices");
      in.need_room(n, 4, 8, "vertices");
      soup.vertices.resize(n);
      for (Vec3& p : soup.vertices) {
        for (int k = 0; k < 3; ++k) p[k] = in.coordinate();
        in.value<std::int64_t>();
      }
      continue;
    }
    const bool element = keyword == "Tetrahedra" || keyword == "Triangles" || keyword == "Edges";
    if (element && !vertices_seen) in.fail("'" + std::string(keyword) + "' comes before 'Vertices'; " + kExportAgain);
    if (keyword == "Tetrahedra") {
      read_elements(in, "tetrahedra", soup.vertices.size(), soup.tets, &soup.regions);
    } else if (keyword == "Triangles") {
      read_elements(in, "triangles", soup.vertices.size(), soup.triangles, &soup.labels);
    } else if (keyword == "Edges") {
      read_elements(in, "edges", soup.vertices.size(), soup.edges, nullptr);
    } else if (keyword == "Quadrilaterals" || keyword == "Hexahedra" || keyword == "Hexaedra" || keyword == "Prisms" ||
               keyword == "Pyramids" || keyword.ends_with("P2") || keyword.ends_with("Q2")) {
      if (in.count("elements") > 0) in.fail("the file has " + printable(keyword) + "; " + kLinearOnly);
    } else if (const int numbers = numbers_of(keyword); numbers > -2) {
      skip_items(in, keyword, numbers);
    } else {
      in.fail("'" + printable(keyword) + "' is not known here; " + kExportAgain);
    }
  }
  if (!vertices_seen) in.fail(std::string("there are no 'Vertices'; ") + kExportAgain);
  return soup;
}

std::vector<double> read_medit_solution(const std::string& path, std::string_view bytes) {
  MixedReader in(path, bytes, '#');
  read_header(in);
  constexpr std::size_t kNumbers[4] = {0, 1, 3, 6};  // of a scalar, a vector, a symmetric matrix
  for (std::string_view keyword = in.word(); !keyword.empty() && keyword != "End"; keyword = in.word()) {
    if (keyword != "SolAtVertices")
      in.fail("'" + printable(keyword) + "' is not 'SolAtVertices'; give values at vertices");
    const std::size_t n = in.count("vertices");
    const std::size_t solutions = in.count("solutions");
    in.need_room(solutions, 1, 4, "solutions");
    std::size_t stride = 0, scalar = static_cast<std::size_t>(-1);
    for (std::size_t s = 0; s < solutions; ++s) {
      const auto type = in.value<std::int32_t>();
      if (type < 1 || type > 3) in.fail(fmt::format("{} is not a type of solution; {}", type, kExportAgain));
      if (type == 1 && scalar > stride) scalar = stride;
      stride += kNumbers[type];
    }
    if (scalar == static_cast<std::size_t>(-1))
      in.fail("none of the solutions is a scalar; give one number per vertex");
    in.need_room(n, stride, 8, "values");
    std::vector<double> values(n);
    for (double& value : values)
      for (std::size_t k = 0; k < stride; ++k) {
        const double x = in.value<double>();
        if (k != scalar) continue;
        if (!std::isfinite(x)) in.fail("a value is not finite; mend it");
        value = x;
      }
    return values;
  }
  in.fail(std::string("there is no 'SolAtVertices'; ") + kExportAgain);
}

std::string format_medit(const TetMesh& mesh) {
  std::string out = fmt::format("MeshVersionFormatted 2\nDimension 3\nVertices\n{}\n", mesh.vertices.size());
  for (const Vec3& p : mesh.vertices) {
    append_point(out, p);
    out.back() = ' ';
    out += "0\n";
  }
  const auto append = [&](const char* keyword, const auto& elements, const std::vector<std::int32_t>& refs) {
    if (elements.empty()) return;
    out += fmt::format("{}\n{}\n", keyword, elements.size());
    for (std::size_t i = 0; i < elements.size(); ++i) {
      for (const Index v : elements[i]) {
        append_index(out, std::size_t{v} + 1);
        out += ' ';
      }
      fmt::format_to(std::back_inserter(out), "{}\n", refs.empty() ? 0 : refs[i]);
    }
  };
  append("Edges", mesh.feature_edges, {});
  if (!mesh.feature_edges.empty()) {
    out += fmt::format("Ridges\n{}\n", mesh.feature_edges.size());
    for (std::size_t i = 1; i <= mesh.feature_edges.size(); ++i) {
      append_index(out, i);
      out += '\n';
    }
  }
  append("Triangles", mesh.boundary, mesh.boundary_labels);
  append("Tetrahedra", mesh.tets, mesh.regions);
  return out + "End\n";
}

}  // namespace bisector::io
