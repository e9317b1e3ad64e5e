// Gmsh's MSH format, versions 2.2 and 4.1, ASCII and binary (Gmsh reference manual, "MSH file format").
#include <algorithm>
#include <charconv>
#include <map>
#include <numeric>
#include <optional>
#include <set>
#include <utility>

#include "core/grouping.h"
#include "io/labels.h"
#include "io/nodes.h"
#include "io/tet_formats.h"

namespace bisector::io {

namespace {

constexpr const char* kRegionPrefix = "region_";
constexpr const char* kLabelPrefix = "label_";
constexpr const char* kUnmarked[] = {"volume", "boundary", "features"};

// Types of elements.
enum { kEdge = 1, kTriangle = 2, kTetrahedron = 4, kEdge3 = 8, kTriangle6 = 9, kTetrahedron10 = 11, kPoint = 15 };

using EntityKey = std::pair<int, int>;  // dimension, tag

// Elements of one dimension, the two tags that may mark them and the one that numbers them.
template <std::size_t N>
struct Marked {
  std::vector<std::array<Index, N>> elements;
  std::vector<std::int32_t> physical, elementary;
  std::vector<std::uint64_t> tags;

  void sort_by_tag() {
    if (std::is_sorted(tags.begin(), tags.end())) return;
    std::vector<std::size_t> order(tags.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::sort(order.begin(), order.end(),
              [&](std::size_t a, std::size_t b) { return std::pair(tags[a], a) < std::pair(tags[b], b); });
    const auto apply = [&](auto& values) {
      auto sorted = values;
      for (std::size_t i = 0; i < order.size(); ++i) sorted[i] = values[order[i]];
      values = std::move(sorted);
    };
    apply(elements);
    apply(physical);
    apply(elementary);
  }
};

class GmshReader {
 public:
  GmshReader(const std::string& path, std::string_view bytes) : path_(path), in_(path, bytes) {}

  TetSoup read() {
    read_format();
    bool elements = false;
    for (std::string_view section = in_.word(); !section.empty(); section = in_.word()) {
      if (section == "$PhysicalNames") {
        read_names();
      } else if (section == "$Entities" && !old_) {
        start_values();
        read_entities();
      } else if (section == "$Nodes") {
        old_ ? read_nodes_2() : read_nodes_4();
      } else if (section == "$Elements") {
        if (tags_.empty()) in_.fail(std::string("$Elements comes before $Nodes; ") + kExportAgain);
        old_ ? read_elements_2() : read_elements_4();
        elements = true;
      } else if (section[0] != '$') {
        in_.fail("'" + printable(section) + "' is not the start of a section; " + kExportAgain);
      } else {
        if (!in_.find_past("$End" + std::string(section.substr(1))))
          in_.fail("the section '" + printable(section) + "' has no end; the file is truncated, " + kExportAgain);
        continue;
      }
      in_.binary = false;
      const std::string_view end = in_.word();
      if (end != "$End" + std::string(section.substr(1)))
        in_.fail("'" + printable(end) + "' is not the end of '" + std::string(section) + "'; the file is damaged, " +
                 kExportAgain);
    }
    if (!elements) in_.fail(std::string("there are no $Elements; the file is truncated, ") + kExportAgain);
    tets_.sort_by_tag();
    triangles_.sort_by_tag();
    TetSoup soup;
    soup.vertices = std::move(vertices_);
    soup.regions = choose_marks(3, tets_, kRegionPrefix, soup.region_names);
    soup.labels = choose_marks(2, triangles_, kLabelPrefix, soup.label_names);
    soup.tets = std::move(tets_.elements);
    soup.triangles = std::move(triangles_.elements);
    soup.edges = std::move(edges_.elements);
    soup.curved = curved_;
    return soup;
  }

 private:
  void read_format() {
    if (in_.word() != "$MeshFormat") in_.fail(std::string("a Gmsh file starts with $MeshFormat; ") + kExportAgain);
    const std::string_view version = in_.need_word("the version");
    if (version == "2.2" || version == "2.1" || version == "2") old_ = true;
    else if (version != "4.1")
      in_.fail("version " + printable(version) + " is not read; save as version 4.1 or 2.2 (gmsh -save -format msh41)");
    const std::int64_t binary = in_.integer("the file type");
    if (binary < 0 || binary > 1) in_.fail(std::string("the file type is neither 0 nor 1; ") + kExportAgain);
    binary_ = binary == 1;
    if (in_.integer("the data size") != 8) in_.fail("the data size is not 8; save with numbers of 8 bytes");
    if (binary_) {
      start_values();
      const auto one = in_.value<std::int32_t>();
      if (one == 0x01000000) in_.big_endian = true;
      else if (one != 1) in_.fail(std::string("the byte order is not given; ") + kExportAgain);
      in_.binary = false;
    }
    if (in_.word() != "$EndMeshFormat") in_.fail(std::string("$EndMeshFormat is missing; ") + kExportAgain);
  }

  // From the next line on numbers are in the file's form.
  void start_values() {
    if (!binary_) return;
    in_.line();
    in_.binary = true;
  }

  void read_names() {
    const std::size_t n = in_.count("names");
    in_.need_room(n, 3, 1, "names");
    for (std::size_t i = 0; i < n; ++i) {
      const int dimension = static_cast<int>(in_.value<std::int32_t>());
      const int tag = in_.value<std::int32_t>();
      const std::string_view rest = in_.line();
      const std::size_t open = rest.find('"'), close = rest.rfind('"');
      if (open == std::string_view::npos || close == open)
        in_.fail(std::string("a name lacks its quotes; ") + kExportAgain);
      names_[{dimension, tag}] = rest.substr(open + 1, close - open - 1);
    }
  }

  void read_entities() {
    std::array<std::size_t, 4> counts{};
    for (std::size_t& count : counts) {
      count = in_.value<std::uint64_t>();
      in_.need_room(count, 5, 4, "entities");
    }
    for (int dimension = 0; dimension < 4; ++dimension)
      for (std::size_t i = 0; i < counts[static_cast<std::size_t>(dimension)]; ++i) {
        const int tag = in_.value<std::int32_t>();
        for (int k = 0; k < (dimension == 0 ? 3 : 6); ++k) in_.value<double>();
        const std::size_t groups = in_.value<std::uint64_t>();
        in_.need_room(groups, 1, 4, "physical groups");
        for (std::size_t g = 0; g < groups; ++g) {
          const int group = in_.value<std::int32_t>();
          if (g == 0) physical_of_[{dimension, tag}] = std::abs(std::max(group, -0x7fffffff));  // negative: turned over
        }
        if (dimension == 0) continue;
        const std::size_t bounds = in_.value<std::uint64_t>();
        in_.need_room(bounds, 1, 4, "bounding entities");
        for (std::size_t b = 0; b < bounds; ++b) in_.value<std::int32_t>();
      }
  }

  void read_nodes_2() {
    const std::size_t n = in_.count("nodes");
    start_values();
    in_.need_room(n, 4, 7, "nodes");
    std::vector<std::uint64_t> tags(n);
    std::vector<Vec3> points(n);
    for (std::size_t i = 0; i < n; ++i) {
      tags[i] = static_cast<std::uint32_t>(in_.value<std::int32_t>());
      for (int k = 0; k < 3; ++k) points[i][k] = in_.coordinate();
    }
    order_nodes(tags, points);
  }

  void read_nodes_4() {
    start_values();
    const std::size_t blocks = in_.value<std::uint64_t>(), n = in_.value<std::uint64_t>();
    in_.value<std::uint64_t>();
    in_.value<std::uint64_t>();
    in_.need_room(blocks, 4, 5, "blocks of nodes");
    in_.need_room(n, 4, 8, "nodes");
    std::vector<std::uint64_t> tags;
    std::vector<Vec3> points;
    tags.reserve(n);
    points.reserve(n);
    for (std::size_t b = 0; b < blocks; ++b) {
      const int dimension = in_.value<std::int32_t>();
      in_.value<std::int32_t>();
      const int parametric = in_.value<std::int32_t>();
      if (dimension < 0 || dimension > 3 || parametric < 0 || parametric > 1)
        in_.fail(std::string("a block of nodes has no sound head; ") + kExportAgain);
      const std::size_t size = in_.value<std::uint64_t>();
      in_.need_room(size, 4, 8, "nodes");
      for (std::size_t i = 0; i < size; ++i) tags.push_back(in_.value<std::uint64_t>());
      for (std::size_t i = 0; i < size; ++i) {
        Vec3 p;
        for (int k = 0; k < 3; ++k) p[k] = in_.coordinate();
        for (int k = 0; k < parametric * dimension; ++k) in_.value<double>();
        points.push_back(p);
      }
    }
    if (points.size() != n)
      in_.fail(fmt::format("{} nodes are declared, but the blocks have {}; {}", n, points.size(), kExportAgain));
    order_nodes(tags, points);
  }

  // A vertex's index is the rank of its tag.
  void order_nodes(const std::vector<std::uint64_t>& tags, const std::vector<Vec3>& points) {
    if (!tags_.empty()) in_.fail(std::string("$Nodes occurs twice; ") + kExportAgain);
    std::vector<std::size_t> order(tags.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    if (!std::is_sorted(tags.begin(), tags.end()))
      std::sort(order.begin(), order.end(),
                [&](std::size_t a, std::size_t b) { return std::pair(tags[a], a) < std::pair(tags[b], b); });
    for (const std::size_t i : order) {
      if (!tags_.empty() && tags_.back() == tags[i])
        in_.fail(fmt::format("two nodes have the tag {}; {}", tags[i], kExportAgain));
      tags_.push_back(tags[i]);
      vertices_.push_back(points[i]);
    }
  }

  Index vertex(std::uint64_t tag) const {
    std::size_t at = static_cast<std::size_t>(tag - tags_.front());
    if (at >= tags_.size() || tags_[at] != tag)
      at = static_cast<std::size_t>(std::lower_bound(tags_.begin(), tags_.end(), tag) - tags_.begin());
    if (at >= tags_.size() || tags_[at] != tag)
      in_.fail(fmt::format("there is no node {}, which an element names; mend the element", tag));
    return static_cast<Index>(at);
  }

  // How many nodes a type of element has, and how many of these, the first ones, are corners.
  struct Shape {
    std::size_t corners, nodes;
  };
  Shape shape_of(std::int64_t type) const {
    switch (type) {
      case kEdge: return {2, 2};
      case kTriangle: return {3, 3};
      case kTetrahedron: return {4, 4};
      case kEdge3: return {2, 3};
      case kTriangle6: return {3, 6};
      case kTetrahedron10: return {4, 10};
      case kPoint: return {1, 1};
      default: in_.fail(fmt::format("an element has type {}; {}", type, kUpToSecondOrder));
    }
  }
  // Reads the nodes of an element; `next` gives the next tag of one.
  template <class Next>
  std::array<Index, 4> read_corners(const Shape& shape, const Next& next) {
    std::array<Index, 4> corners{};
    for (std::size_t k = 0; k < shape.nodes; ++k) {
      const Index v = vertex(next());
      if (k < shape.corners) corners[k] = v;
    }
    curved_ += shape.nodes > shape.corners;
    return corners;
  }

  void add(std::uint64_t tag, std::int64_t type, const std::array<Index, 4>& v, std::int32_t physical,
           std::int32_t elementary) {
    const auto append = [&](auto& marked, const auto& corners) {
      marked.elements.push_back(corners);
      marked.physical.push_back(physical);
      marked.elementary.push_back(elementary);
      marked.tags.push_back(tag);
    };
    if (type == kEdge || type == kEdge3) append(edges_, std::array<Index, 2>{v[0], v[1]});
    if (type == kTriangle || type == kTriangle6) append(triangles_, Triangle{v[0], v[1], v[2]});
    if (type == kTetrahedron || type == kTetrahedron10) append(tets_, v);
  }

  void read_elements_2() {
    const std::size_t n = in_.count("elements");
    start_values();
    in_.need_room(n, 3, 2, "elements");
    std::int64_t type = 0;
    std::int32_t tags = 0, in_block = 0;
    for (std::size_t i = 0; i < n; ++i) {
      if (!binary_) {
        in_.value<std::int64_t>();
        type = in_.value<std::int64_t>();
        tags = in_.value<std::int32_t>();
      } else {
        if (in_block == 0) {
          type = in_.value<std::int32_t>();
          in_block = in_.value<std::int32_t>();
          tags = in_.value<std::int32_t>();
          if (in_block < 1) in_.fail(std::string("a block of elements is empty; ") + kExportAgain);
        }
        --in_block;
        in_.value<std::int32_t>();
      }
      if (tags < 0) in_.fail(std::string("an element has a negative number of tags; ") + kExportAgain);
      const Shape shape = shape_of(type);
      std::int32_t mark[2] = {0, 0};
      for (std::int32_t k = 0; k < tags; ++k) {
        const auto tag = in_.value<std::int32_t>();
        if (k < 2) mark[k] = tag;
      }
      const auto next = [&] { return static_cast<std::uint32_t>(in_.value<std::int32_t>()); };
      add(i, type, read_corners(shape, next), mark[0], mark[1]);
    }
  }

  void read_elements_4() {
    start_values();
    const std::size_t blocks = in_.value<std::uint64_t>(), n = in_.value<std::uint64_t>();
    in_.value<std::uint64_t>();
    in_.value<std::uint64_t>();
    in_.need_room(blocks, 4, 5, "blocks of elements");
    in_.need_room(n, 2, 8, "elements");
    std::size_t read = 0;
    for (std::size_t b = 0; b < blocks; ++b) {
      const int dimension = in_.value<std::int32_t>(), entity = in_.value<std::int32_t>();
      const std::int64_t type = in_.value<std::int32_t>();
      const std::size_t size = in_.value<std::uint64_t>();
      const Shape shape = shape_of(type);
      in_.need_room(size, 1 + shape.nodes, 8, "elements");
      const auto group = physical_of_.find({dimension, entity});
      for (std::size_t i = 0; i < size; ++i) {
        const auto tag = in_.value<std::uint64_t>();
        const auto corners = read_corners(shape, [&] { return in_.value<std::uint64_t>(); });
        add(tag, type, corners, group == physical_of_.end() ? 0 : group->second, entity);
      }
      read += size;
    }
    if (read != n) in_.fail(fmt::format("{} elements are declared, but the blocks have {}; {}", n, read, kExportAgain));
  }

  // Physical groups and their names where there are any, else elementary entities. Where all groups are named as
  // format_gmsh names what has no name, the numbers in the names.
  template <std::size_t N>
  std::vector<std::int32_t> choose_marks(int dimension, const Marked<N>& marked, std::string_view prefix,
                                         LabelNames& names) const {
    const std::set<std::int32_t> groups(marked.physical.begin(), marked.physical.end());
    if (groups.empty() || (groups.size() == 1 && *groups.begin() == 0)) return marked.elementary;
    std::map<std::int32_t, std::int32_t> numbers;
    for (const std::int32_t group : groups) {
      const auto found = names_.find({dimension, group});
      if (found == names_.end()) continue;
      const std::string& name = found->second;
      if (groups.size() == 1 && name == kUnmarked[3 - dimension]) return {};
      if (const std::optional<std::int32_t> number = number_in(name, prefix)) numbers[group] = *number;
      if (name != fmt::format("{}{}", prefix, group)) names[group] = name;
    }
    if (numbers.size() < groups.size()) return marked.physical;
    names.clear();
    std::vector<std::int32_t> marks;
    marks.reserve(marked.physical.size());
    for (const std::int32_t group : marked.physical) marks.push_back(numbers[group]);
    return marks;
  }

  // K of "prefixK".
  static std::optional<std::int32_t> number_in(std::string_view name, std::string_view prefix) {
    if (!name.starts_with(prefix)) return {};
    std::int32_t number = 0;
    const char* end = name.data() + name.size();
    const auto [stop, error] = std::from_chars(name.data() + prefix.size(), end, number);
    if (error != std::errc{} || stop != end) return {};
    return number;
  }

  const std::string& path_;
  std::size_t curved_ = 0;  // elements of second order
  MixedReader in_;
  bool old_ = false, binary_ = false;
  std::map<EntityKey, std::string> names_;
  std::map<EntityKey, int> physical_of_;
  std::vector<std::uint64_t> tags_;  // ascending
  std::vector<Vec3> vertices_;
  Marked<4> tets_;
  Marked<3> triangles_;
  Marked<2> edges_;
};

// --- writing ---

// The entities of one dimension: a tag from 1 and a name for each mark.
struct Entities {
  std::vector<std::int32_t> marks;  // ascending, without repetition
  std::vector<std::vector<std::size_t>> members;
  std::vector<int> tags;
};

Entities group_by_mark(std::size_t n, const std::vector<std::int32_t>& marks) {
  Entities entities;
  if (n == 0) return entities;
  entities.marks = marks.empty() ? std::vector<std::int32_t>{1} : marks;
  std::sort(entities.marks.begin(), entities.marks.end());
  entities.marks.erase(std::unique(entities.marks.begin(), entities.marks.end()), entities.marks.end());
  entities.members.resize(entities.marks.size());
  for (std::size_t i = 0; i < n; ++i) {
    const std::int32_t mark = marks.empty() ? 1 : marks[i];
    const auto at = std::lower_bound(entities.marks.begin(), entities.marks.end(), mark) - entities.marks.begin();
    entities.members[static_cast<std::size_t>(at)].push_back(i);
  }
  // Tags must be positive: the marks themselves where they are.
  for (std::size_t e = 0; e < entities.marks.size(); ++e)
    entities.tags.push_back(entities.marks.front() > 0 ? entities.marks[e] : static_cast<int>(e) + 1);
  return entities;
}

// Chains of edges between vertices where not exactly two meet; closed ones start at their lowest vertex.
std::vector<std::vector<Index>> chain_edges(const std::vector<std::array<Index, 2>>& edges, std::size_t vertex_count,
                                            std::vector<Index>& ends) {
  const Csr<std::size_t> around = items_at_vertices<std::size_t>(edges, vertex_count);
  std::vector<std::vector<Index>> chains;
  std::vector<char> used(edges.size(), 0);
  const auto follow = [&](Index from, std::size_t edge) {
    std::vector<Index> chain{from};
    for (;;) {
      used[edge] = 1;
      const Index to = edges[edge][0] == chain.back() ? edges[edge][1] : edges[edge][0];
      chain.push_back(to);
      if (around.size(to) != 2 || to == from) break;
      const std::size_t next = around.begin(to)[0] == edge ? around.begin(to)[1] : around.begin(to)[0];
      if (used[next]) break;
      edge = next;
    }
    chains.push_back(std::move(chain));
  };
  for (Index v = 0; v < vertex_count; ++v) {
    if (around.size(v) == 0 || around.size(v) == 2) continue;
    ends.push_back(v);
    for (const std::size_t* e = around.begin(v); e != around.end(v); ++e)
      if (!used[*e]) follow(v, *e);
  }
  for (Index v = 0; v < vertex_count; ++v)
    for (const std::size_t* e = around.begin(v); e != around.end(v); ++e)
      if (!used[*e]) {
        ends.push_back(v);
        follow(v, *e);
      }
  std::sort(ends.begin(), ends.end());
  ends.erase(std::unique(ends.begin(), ends.end()), ends.end());
  return chains;
}

class GmshWriter {
 public:
  GmshWriter(const TetMesh& mesh, const SecondOrder& order)
      : mesh_(mesh), order_(order), volumes_(group_by_mark(mesh.tets.size(), mesh.regions)),
        surfaces_(group_by_mark(mesh.boundary.size(), mesh.boundary_labels)),
        curves_(chain_edges(mesh.feature_edges, mesh.vertices.size(), corners_)) {}

  std::string write() {
    out_ = "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n";
    write_names();
    write_entities();
    write_nodes();
    write_elements();
    return std::move(out_);
  }

 private:
  template <class... Args>
  void print(fmt::format_string<Args...> format, Args&&... args) {
    fmt::format_to(std::back_inserter(out_), format, std::forward<Args>(args)...);
  }

  void write_names() {
    const std::size_t names = volumes_.tags.size() + surfaces_.tags.size() + (curves_.empty() ? 0 : 1);
    print("$PhysicalNames\n{}\n", names);
    if (!curves_.empty()) print("1 1 \"{}\"\n", kUnmarked[2]);
    write_names(2, surfaces_, mesh_.boundary_labels.empty(), kLabelPrefix, mesh_.label_names);
    write_names(3, volumes_, mesh_.regions.empty(), kRegionPrefix, mesh_.region_names);
    out_ += "$EndPhysicalNames\n";
  }
  void write_names(int dimension, const Entities& entities, bool unmarked, const char* prefix,
                   const LabelNames& names) {
    for (std::size_t e = 0; e < entities.tags.size(); ++e) {
      const auto name = names.find(entities.marks[e]);
      if (unmarked) print("{} {} \"{}\"\n", dimension, entities.tags[e], kUnmarked[3 - dimension]);
      else if (name == names.end()) print("{} {} \"{}{}\"\n", dimension, entities.tags[e], prefix, entities.marks[e]);
      else print("{} {} \"{}\"\n", dimension, entities.tags[e], cleaned(name->second, "\""));
    }
  }

  void append_box(const std::vector<Vec3>& points) {
    const Box box = bounding_box(points);
    for (const Vec3& p : {box.lo, box.hi}) {
      append_point(out_, p);
      out_.back() = ' ';
    }
  }
  template <class Elements>
  void write_group(const Entities& entities, const Elements& elements) {
    for (std::size_t e = 0; e < entities.tags.size(); ++e) {
      std::vector<Vec3> points;
      for (const std::size_t i : entities.members[e])
        for (const Index v : elements[i]) points.push_back(mesh_.vertices[v]);
      print("{} ", entities.tags[e]);
      append_box(points);
      print("1 {} 0\n", entities.tags[e]);
    }
  }
  int point_tag(Index corner) const {
    return static_cast<int>(std::lower_bound(corners_.begin(), corners_.end(), corner) - corners_.begin()) + 1;
  }

  void write_entities() {
    print("$Entities\n{} {} {} {}\n", corners_.size(), curves_.size(), surfaces_.tags.size(), volumes_.tags.size());
    for (const Index corner : corners_) {
      print("{} ", point_tag(corner));
      append_point(out_, mesh_.vertices[corner]);
      out_.back() = ' ';
      out_ += "0\n";
    }
    for (std::size_t c = 0; c < curves_.size(); ++c) {
      std::vector<Vec3> points;
      for (const Index v : curves_[c]) points.push_back(mesh_.vertices[v]);
      print("{} ", c + 1);
      append_box(points);
      print("1 1 2 {} -{}\n", point_tag(curves_[c].front()), point_tag(curves_[c].back()));
    }
    write_group(surfaces_, mesh_.boundary);
    write_group(volumes_, mesh_.tets);
    out_ += "$EndEntities\n";
  }

  // Every vertex and node belongs to the entity of lowest dimension that has it; one of no element to the first there
  // is.
  void write_nodes() {
    const std::vector<Vec3> points = vertices_and_nodes(mesh_, order_);
    std::vector<EntityKey> owner(points.size(), {4, 0});
    const auto claim_element = [&](const auto& element, const EntityKey& entity) {
      for (const Index v : corners_and_nodes(element, order_, mesh_.vertices.size()))
        owner[v] = std::min(owner[v], entity);
    };
    const auto claim = [&](const Entities& entities, const auto& elements, int dimension) {
      for (std::size_t e = 0; e < entities.tags.size(); ++e)
        for (const std::size_t i : entities.members[e]) claim_element(elements[i], {dimension, entities.tags[e]});
    };
    claim(volumes_, mesh_.tets, 3);
    claim(surfaces_, mesh_.boundary, 2);
    each_edge([&](std::size_t c, const std::array<Index, 2>& e) { claim_element(e, {1, static_cast<int>(c) + 1}); });
    for (const Index v : corners_) owner[v] = {0, point_tag(v)};
    const EntityKey first = !volumes_.tags.empty()    ? EntityKey{3, volumes_.tags[0]}
                            : !surfaces_.tags.empty() ? EntityKey{2, surfaces_.tags[0]}
                                                      : EntityKey{1, 1};
    std::map<EntityKey, std::vector<Index>> blocks;
    for (Index v = 0; v < owner.size(); ++v) blocks[owner[v].first == 4 ? first : owner[v]].push_back(v);
    print("$Nodes\n{} {} {} {}\n", blocks.size(), owner.size(), owner.empty() ? 0 : 1, owner.size());
    for (const auto& [entity, vertices] : blocks) {
      print("{} {} 0 {}\n", entity.first, entity.second, vertices.size());
      for (const Index v : vertices) print("{}\n", std::size_t{v} + 1);
      for (const Index v : vertices) append_point(out_, points[v]);
    }
    out_ += "$EndNodes\n";
  }

  // Calls visit(curve, edge) for the edges of all curves.
  template <class Visit>
  void each_edge(const Visit& visit) const {
    for (std::size_t c = 0; c < curves_.size(); ++c)
      for (std::size_t i = 0; i + 1 < curves_[c].size(); ++i)
        visit(c, std::array<Index, 2>{curves_[c][i], curves_[c][i + 1]});
  }

  template <std::size_t N>
  void write_element(std::size_t tag, const std::array<Index, N>& corners) {
    std::vector<Index> nodes = corners_and_nodes(corners, order_, mesh_.vertices.size());
    if (nodes.size() == 10) std::swap(nodes[8], nodes[9]);  // VTK has the last two edges the other way round
    append_index(out_, tag);
    for (const Index v : nodes) {
      out_ += ' ';
      append_index(out_, std::size_t{v} + 1);
    }
    out_ += '\n';
  }
  template <class Elements>
  void write_elements(int dimension, int straight, int curved, const Entities& entities, const Elements& elements,
                      std::size_t first_tag) {
    const int type = order_.empty() ? straight : curved;
    for (std::size_t e = 0; e < entities.tags.size(); ++e) {
      print("{} {} {} {}\n", dimension, entities.tags[e], type, entities.members[e].size());
      for (const std::size_t i : entities.members[e]) write_element(first_tag + i, elements[i]);
    }
  }
  // Tags number edges, triangles and tetrahedra in the mesh's order, which they bring back.
  void write_elements() {
    const std::size_t blocks = curves_.size() + surfaces_.tags.size() + volumes_.tags.size();
    const std::size_t elements = mesh_.feature_edges.size() + mesh_.boundary.size() + mesh_.tets.size();
    print("$Elements\n{} {} {} {}\n", blocks, elements, elements == 0 ? 0 : 1, elements);
    std::size_t tag = 1;
    for (std::size_t c = 0; c < curves_.size(); ++c) {
      print("1 {} {} {}\n", c + 1, order_.empty() ? +kEdge : +kEdge3, curves_[c].size() - 1);
      for (std::size_t i = 0; i + 1 < curves_[c].size(); ++i)
        write_element(tag++, std::array<Index, 2>{curves_[c][i], curves_[c][i + 1]});
    }
    write_elements(2, kTriangle, kTriangle6, surfaces_, mesh_.boundary, tag);
    write_elements(3, kTetrahedron, kTetrahedron10, volumes_, mesh_.tets, tag + mesh_.boundary.size());
    out_ += "$EndElements\n";
  }

  const TetMesh& mesh_;
  const SecondOrder& order_;
  Entities volumes_, surfaces_;
  std::vector<Index> corners_;  // ends of curves, ascending
  std::vector<std::vector<Index>> curves_;
  std::string out_;
};

}  // namespace

TetSoup read_gmsh(const std::string& path, std::string_view bytes) { return GmshReader(path, bytes).read(); }

std::string format_gmsh(const TetMesh& mesh, const SecondOrder& order) { return GmshWriter(mesh, order).write(); }

}  // namespace bisector::io
