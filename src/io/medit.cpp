// Medit's format (Frey, MEDIT: An interactive mesh visualization software, INRIA RT-0253, 2001), its binary form of
// versions 1 to 4 (Marechal, libMeshb, The GMF format, github.com/LoicMarechal/libMeshb) and its solutions.
#include <algorithm>
#include <limits>
#include <map>
#include <utility>

#include "io/tet_formats.h"

namespace bisector::io {

namespace {

// The numbers of either form, with the widths of the binary one.
struct MeditReader {
  MixedReader in;
  int version = 0;

  std::int64_t integer() {
    return in.binary && version < 4 ? std::int64_t{in.value<std::int32_t>()} : in.value<std::int64_t>();
  }
  std::int32_t ref() {
    const std::int64_t n = integer();
    if (!std::in_range<std::int32_t>(n)) in.fail(fmt::format("the reference {} is out of range; mend the file", n));
    return static_cast<std::int32_t>(n);
  }
  double real() { return in.binary && version == 1 ? double{in.value<float>()} : in.value<double>(); }
  double coordinate() {
    const double x = real();
    if (const char* flaw = coordinate_flaw(x)) in.fail(flaw);
    return x;
  }
  // A number of items, for each of which so many numbers follow.
  std::size_t count(std::size_t reals, std::size_t integers, const char* things) {
    const std::int64_t n = in.binary ? integer() : static_cast<std::int64_t>(in.count(things));
    if (n < 0) in.fail(fmt::format("the number of {} is negative; {}", things, kExportAgain));
    const std::size_t size = (version == 1 ? 4 : 8) * reals + (version < 4 ? 4 : 8) * integers;
    if (in.binary) in.need_room(static_cast<std::size_t>(n), 1, size, things);
    else in.need_room(static_cast<std::size_t>(n), reals + integers, 0, things);
    return static_cast<std::size_t>(n);
  }
};

template <std::size_t N>
void read_elements(MeditReader& medit, const char* kind, std::size_t vertices,
                   std::vector<std::array<Index, N>>& elements, std::vector<std::int32_t>* refs) {
  const std::size_t n = medit.count(0, N + 1, kind);
  elements.reserve(elements.size() + n);
  for (std::size_t i = 0; i < n; ++i) {
    std::array<Index, N> corners{};
    for (Index& corner : corners) {
      const std::int64_t v = medit.integer();
      if (v < 1 || v > static_cast<std::int64_t>(vertices))
        medit.in.fail(fmt::format(
            "index {} is out of range, the file has {} vertices, counted from 1; mend the element", v, vertices));
      corner = static_cast<Index>(v - 1);
    }
    elements.push_back(corners);
    const std::int32_t ref = medit.ref();
    if (refs) refs->push_back(ref);
  }
}

// The list of a keyword Required...; null of others.
std::vector<std::int64_t>* required_list(std::string_view keyword, TetSoup& soup) {
  if (keyword == "RequiredVertices") return &soup.required_vertices;
  if (keyword == "RequiredEdges") return &soup.required_edges;
  return keyword == "RequiredTriangles" ? &soup.required_triangles : nullptr;
}

// Reads one of the keywords that matter; false if it is none of these.
bool read_keyword(MeditReader& medit, std::string_view keyword, TetSoup& soup, bool& vertices_seen) {
  if (keyword == "Vertices") {
    if (vertices_seen) medit.in.fail(std::string("'Vertices' occurs twice; ") + kExportAgain);
    vertices_seen = true;
    soup.vertices.resize(medit.count(3, 1, "vertices"));
    for (Vec3& p : soup.vertices) {
      for (int k = 0; k < 3; ++k) p[k] = medit.coordinate();
      medit.integer();
    }
    return true;
  }
  if (std::vector<std::int64_t>* const required = required_list(keyword, soup)) {
    const std::size_t n = medit.count(0, 1, "elements");
    for (std::size_t i = 0; i < n; ++i) required->push_back(medit.integer());
    return true;
  }
  const bool element = keyword == "Tetrahedra" || keyword == "Triangles" || keyword == "Edges";
  if (element && !vertices_seen)
    medit.in.fail("'" + std::string(keyword) + "' comes before 'Vertices'; " + kExportAgain);
  const std::size_t vertices = soup.vertices.size();
  if (keyword == "Tetrahedra") read_elements(medit, "tetrahedra", vertices, soup.tets, &soup.regions);
  else if (keyword == "Triangles") read_elements(medit, "triangles", vertices, soup.triangles, &soup.labels);
  else if (keyword == "Edges") read_elements(medit, "edges", vertices, soup.edges, nullptr);
  return element;
}

bool is_other_element(std::string_view keyword) {
  return keyword == "Quadrilaterals" || keyword == "Hexahedra" || keyword == "Hexaedra" || keyword == "Prisms" ||
         keyword == "Pyramids" || keyword.ends_with("P2") || keyword.ends_with("Q2");
}

// Numbers per item of the keywords that are passed over.
int numbers_of(std::string_view keyword) {
  static const std::map<std::string_view, int> kNumbers{{"Corners", 1},
                                                        {"Ridges", 1},
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
    in.fail("'" + printable(first) + "' is not 'MeshVersionFormatted'; check that this is an ASCII Medit file");
  const std::int64_t version = in.integer("the version");
  if (version < 0 || version > 4) in.fail(fmt::format("version {} is not known; save as version 2", version));
  const std::string_view dimension = in.need_word("'Dimension'");
  if (dimension != "Dimension") in.fail("'" + printable(dimension) + "' is not 'Dimension'; " + kExportAgain);
  if (const std::int64_t d = in.integer("the dimension"); d != 3)
    in.fail(fmt::format("the dimension is {}; export in 3 dimensions", d));
}

// --- the binary form: a file is a chain of keywords, each with the place of the next one ---

enum GmfCode : std::int32_t {
  kGmfDimension = 3,
  kGmfVertices = 4,
  kGmfEdges = 5,
  kGmfTriangles = 6,
  kGmfTetrahedra = 8,
  kGmfRidges = 14,
  kGmfEnd = 54,
  kGmfSolAtVertices = 62
};

// The name of a keyword that is read or refused.
std::string_view keyword_of(std::int32_t code) {
  static const std::map<std::int32_t, std::string_view> kNames{{kGmfVertices, "Vertices"},
                                                               {kGmfEdges, "Edges"},
                                                               {kGmfTriangles, "Triangles"},
                                                               {7, "Quadrilaterals"},
                                                               {kGmfTetrahedra, "Tetrahedra"},
                                                               {9, "Prisms"},
                                                               {10, "Hexahedra"},
                                                               {15, "RequiredVertices"},
                                                               {16, "RequiredEdges"},
                                                               {17, "RequiredTriangles"},
                                                               {24, "TrianglesP2"},
                                                               {25, "EdgesP2"},
                                                               {27, "QuadrilateralsQ2"},
                                                               {30, "TetrahedraP2"},
                                                               {33, "HexahedraQ2"},
                                                               {49, "Pyramids"}};
  const auto found = kNames.find(code);
  return found == kNames.end() ? std::string_view{} : found->second;
}

// Walks along the chain.
class GmfChain {
 public:
  GmfChain(const std::string& path, std::string_view bytes)
      : medit_{MixedReader(path, bytes)}, begin_(bytes.data()), size_(bytes.size()) {
    MixedReader& in = medit_.in;
    in.binary = true;
    const auto one = in.value<std::int32_t>();
    if (one == 0x01000000) in.big_endian = true;
    else if (one != 1) in.fail("does not begin with the number 1; check that this is a binary Medit file");
    medit_.version = in.value<std::int32_t>();
    if (medit_.version < 1 || medit_.version > 4)
      in.fail(fmt::format("version {} is not known; save as version 2", medit_.version));
  }

  MeditReader& medit() { return medit_; }

  // Goes to the next keyword; its code, or kGmfEnd.
  std::int32_t next() {
    MixedReader& in = medit_.in;
    if (at_ != 0) in.seek(begin_ + at_);
    if (at_ == 0 && started_) return kGmfEnd;
    started_ = true;
    const auto code = in.value<std::int32_t>();
    const std::uint64_t next =
        medit_.version < 3 ? std::uint64_t{in.value<std::uint32_t>()} : in.value<std::uint64_t>();
    const auto here = static_cast<std::uint64_t>(in.position() - begin_);
    if (code == kGmfEnd) return code;
    if (next != 0 && (next < here || next > size_))
      in.fail(fmt::format("the keyword after {} is said to be at byte {} of {}; the file is damaged, {}", code, next,
                          size_, kExportAgain));
    at_ = next;
    if (code == kGmfDimension) check_dimension();
    return code;
  }

 private:
  void check_dimension() {
    if (const auto d = medit_.in.value<std::int32_t>(); d != 3)
      medit_.in.fail(fmt::format("the dimension is {}; export in 3 dimensions", d));
  }

  MeditReader medit_;
  const char* begin_;
  std::size_t size_, at_ = 0;  // of the next keyword; 0: there is none
  bool started_ = false;
};

// The first scalar of solutions at vertices, whose number has been read.
std::vector<double> read_scalars(MeditReader& medit, std::size_t n) {
  constexpr std::size_t kNumbers[4] = {0, 1, 3, 6};  // of a scalar, a vector, a symmetric matrix
  MixedReader& in = medit.in;
  const bool binary = in.binary;
  const auto small = [&] { return binary ? in.value<std::int32_t>() : static_cast<std::int32_t>(medit.integer()); };
  const std::int32_t solutions = small();
  if (solutions < 0) in.fail(std::string("the number of solutions is negative; ") + kExportAgain);
  in.need_room(static_cast<std::size_t>(solutions), 1, 4, "solutions");
  std::size_t stride = 0, scalar = static_cast<std::size_t>(-1);
  for (std::int32_t s = 0; s < solutions; ++s) {
    const std::int32_t type = small();
    if (type < 1 || type > 3) in.fail(fmt::format("{} is not a type of solution; {}", type, kExportAgain));
    if (type == 1 && scalar > stride) scalar = stride;
    stride += kNumbers[type];
  }
  if (scalar == static_cast<std::size_t>(-1)) in.fail("none of the solutions is a scalar; give one number per vertex");
  in.need_room(n, stride, medit.version == 1 ? 4 : 8, "values");
  std::vector<double> values(n);
  for (double& value : values)
    for (std::size_t k = 0; k < stride; ++k) {
      const double x = medit.real();
      if (k != scalar) continue;
      if (!std::isfinite(x)) in.fail("a value is not finite; mend it");
      value = x;
    }
  return values;
}

}  // namespace

TetSoup read_medit(const std::string& path, std::string_view bytes) {
  MeditReader medit{MixedReader(path, bytes, '#')};
  MixedReader& in = medit.in;
  read_header(in);
  TetSoup soup;
  bool vertices_seen = false;
  for (std::string_view keyword = in.word(); !keyword.empty() && keyword != "End"; keyword = in.word()) {
    if (read_keyword(medit, keyword, soup, vertices_seen)) continue;
    if (is_other_element(keyword)) {
      if (in.count("elements") > 0) in.fail("the file has " + printable(keyword) + "; " + kStraightOnly);
    } else if (const int numbers = numbers_of(keyword); numbers > -2) {
      skip_items(in, keyword, numbers);
    } else {
      in.fail("'" + printable(keyword) + "' is not known here; " + kExportAgain);
    }
  }
  if (!vertices_seen) in.fail(std::string("there are no 'Vertices'; ") + kExportAgain);
  return soup;
}

TetSoup read_medit_binary(const std::string& path, std::string_view bytes) {
  GmfChain chain(path, bytes);
  MeditReader& medit = chain.medit();
  TetSoup soup;
  bool vertices_seen = false;
  for (std::int32_t code = chain.next(); code != kGmfEnd; code = chain.next()) {
    const std::string_view keyword = keyword_of(code);
    if (read_keyword(medit, keyword, soup, vertices_seen)) continue;
    if (is_other_element(keyword) && medit.integer() > 0)
      medit.in.fail("the file has " + std::string(keyword) + "; " + kStraightOnly);
  }
  if (!vertices_seen) medit.in.fail(std::string("there are no 'Vertices'; ") + kExportAgain);
  return soup;
}

std::vector<double> read_medit_solution(const std::string& path, std::string_view bytes) {
  MeditReader medit{MixedReader(path, bytes, '#')};
  read_header(medit.in);
  const std::string_view keyword = medit.in.word();
  if (keyword.empty() || keyword == "End") medit.in.fail(std::string("there is no 'SolAtVertices'; ") + kExportAgain);
  if (keyword != "SolAtVertices")
    medit.in.fail("'" + printable(keyword) + "' is not 'SolAtVertices'; give values at vertices");
  return read_scalars(medit, medit.in.count("vertices"));
}

std::vector<double> read_medit_solution_binary(const std::string& path, std::string_view bytes) {
  GmfChain chain(path, bytes);
  for (std::int32_t code = chain.next(); code != kGmfEnd; code = chain.next())
    if (code == kGmfSolAtVertices) return read_scalars(chain.medit(), chain.medit().count(0, 0, "vertices"));
  chain.medit().in.fail("there is no 'SolAtVertices'; give values at vertices");
}

std::string format_medit(const TetMesh& mesh, const SecondOrder&) {
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

namespace {

// Version 2 has places of 32 bits, version 3 of 64, and in version 4 integers have 64, too.
int version_for(const TetMesh& mesh) {
  const std::size_t size = 256 + 28 * mesh.vertices.size() + 20 * mesh.tets.size() + 16 * mesh.boundary.size() +
                           16 * mesh.feature_edges.size();
  constexpr std::size_t kLargest = std::numeric_limits<std::int32_t>::max();
  return size <= kLargest ? 2 : mesh.vertices.size() <= kLargest ? 3 : 4;
}

class GmfWriter {
 public:
  explicit GmfWriter(const TetMesh& mesh) : mesh_(mesh), version_(version_for(mesh)) {}

  std::string write() {
    append_bytes(out_, std::int32_t{1});
    append_bytes(out_, std::int32_t{version_});
    begin(kGmfDimension, 4);
    append_bytes(out_, std::int32_t{3});
    begin_items(kGmfVertices, mesh_.vertices.size(), 24 + width());
    for (const Vec3& p : mesh_.vertices) {
      for (int k = 0; k < 3; ++k) append_bytes(out_, p[k]);
      integer(0);
    }
    elements(kGmfEdges, mesh_.feature_edges, {});
    if (!mesh_.feature_edges.empty()) {
      begin_items(kGmfRidges, mesh_.feature_edges.size(), width());
      for (std::size_t i = 1; i <= mesh_.feature_edges.size(); ++i) integer(static_cast<std::int64_t>(i));
    }
    elements(kGmfTriangles, mesh_.boundary, mesh_.boundary_labels);
    elements(kGmfTetrahedra, mesh_.tets, mesh_.regions);
    append_bytes(out_, std::int32_t{kGmfEnd});
    place(0);
    return std::move(out_);
  }

 private:
  std::size_t width() const { return version_ < 4 ? 4 : 8; }
  void integer(std::int64_t n) {
    if (version_ < 4) append_bytes(out_, static_cast<std::int32_t>(n));
    else append_bytes(out_, n);
  }
  void place(std::size_t at) {
    if (version_ < 3) append_bytes(out_, static_cast<std::int32_t>(at));
    else append_bytes(out_, static_cast<std::int64_t>(at));
  }
  // A keyword, after which so many bytes follow.
  void begin(std::int32_t code, std::size_t size) {
    append_bytes(out_, code);
    place(out_.size() + (version_ < 3 ? 4 : 8) + size);
  }
  void begin_items(std::int32_t code, std::size_t n, std::size_t bytes_each) {
    begin(code, width() + n * bytes_each);
    integer(static_cast<std::int64_t>(n));
  }
  template <std::size_t N>
  void elements(std::int32_t code, const std::vector<std::array<Index, N>>& corners,
                const std::vector<std::int32_t>& refs) {
    if (corners.empty()) return;
    begin_items(code, corners.size(), (N + 1) * width());
    for (std::size_t i = 0; i < corners.size(); ++i) {
      for (const Index v : corners[i]) integer(std::int64_t{v} + 1);
      integer(refs.empty() ? 0 : refs[i]);
    }
  }

  const TetMesh& mesh_;
  int version_;
  std::string out_;
};

}  // namespace

std::string format_medit_binary(const TetMesh& mesh, const SecondOrder&) { return GmfWriter(mesh).write(); }

}  // namespace bisector::io
