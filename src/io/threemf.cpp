// 3MF (3MF Consortium, Core Specification 1.3, with materials and colours of the Materials and Properties Extension 1.2
// and objects in other parts of the Production Extension 1.1). Own because lib3mf's reader tells neither the place of
// an error nor bounds what it allocates, and what is needed here is small.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "bisector/quality.h"
#include "core/geometry.h"
#include "io/colours.h"
#include "io/labels.h"
#include "io/mesh_formats.h"
#include "io/text.h"
#include "io/xml.h"
#include "io/zip.h"

namespace bisector::io {

namespace {

struct Unit {
  std::string_view name;
  double metres;
};
constexpr std::array<Unit, 6> kUnits{
    {{"millimeter", 1e-3}, {"micron", 1e-6}, {"centimeter", 1e-2}, {"inch", 0.0254}, {"foot", 0.3048}, {"meter", 1}}};

constexpr const char* kModelPart = "3D/3dmodel.model";
constexpr std::string_view kModelRelationship = "http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel";

// A row vector times this, of three columns, moves a point.
struct Transform {
  std::array<double, 12> m{1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0};
  bool identity = true;

  Vec3 operator()(const Vec3& p) const {
    if (identity) return p;
    Vec3 moved;
    for (int k = 0; k < 3; ++k) {
      const auto c = static_cast<std::size_t>(k);
      moved[k] = p.x * m[c] + p.y * m[3 + c] + p.z * m[6 + c] + m[9 + c];
    }
    return moved;
  }
  // First this, then the other.
  Transform then(const Transform& other) const {
    if (identity) return other;
    if (other.identity) return *this;
    Transform both;
    both.identity = false;
    for (std::size_t r = 0; r < 4; ++r)
      for (std::size_t c = 0; c < 3; ++c)
        both.m[3 * r + c] = m[3 * r] * other.m[c] + m[3 * r + 1] * other.m[3 + c] + m[3 * r + 2] * other.m[6 + c] +
                            (r == 3 ? other.m[9 + c] : 0);
    return both;
  }
  bool mirrors() const {
    return m[0] * (m[4] * m[8] - m[5] * m[7]) - m[1] * (m[3] * m[8] - m[5] * m[6]) +
               m[2] * (m[3] * m[7] - m[4] * m[6]) <
           0;
  }
};

// A material or colour of a group of these.
struct Property {
  int group = -1;  // -1: none
  std::int64_t index = 0;
};

struct Component {
  std::string part;
  std::int64_t object = 0;
  Transform transform;
};

struct Object {
  std::string name;
  Property property;  // of triangles that have none of their own
  std::vector<Vec3> vertices;
  std::vector<Triangle> triangles;
  std::vector<Property> properties;  // one per triangle
  std::vector<Component> components;
};

// A model part of the archive.
struct Part {
  std::map<std::int64_t, Object> objects;
  std::map<std::int64_t, std::vector<std::string>> materials;  // names by group
  std::vector<Component> items;
  double unit = 1e-3;
};

// Reads one part; the path of messages is the archive's.
class PartReader {
 public:
  PartReader(const std::string& path, const std::string& name, std::string_view text)
      : path_(path), name_(name), xml_(path, text) {}

  Part read() {
    bool model = false;
    Tag tag;
    while (xml_.next_tag(tag)) {
      const std::string name = local_name(tag.name);
      if (name == "model") {
        model = true;
        part_.unit = unit_of(tag);
      } else if (name == "basematerials" || name == "colorgroup") {
        group_ = &part_.materials[integer(tag, "id")];
      } else if (name == "base" || name == "color") {
        if (group_) group_->push_back(unescaped(name == "base" ? tag["name"] : tag["color"]));
      } else if (name == "object") {
        begin_object(tag);
      } else if (name == "vertex") {
        take_vertex(tag);
      } else if (name == "triangle") {
        take_triangle(tag);
      } else if (name == "component") {
        if (object_) object_->components.push_back(component(tag));
      } else if (name == "item") {
        part_.items.push_back(component(tag));
      } else if (name == "/object") {
        end_object();
      } else if (name == "/basematerials" || name == "/colorgroup") {
        group_ = nullptr;
      }
    }
    if (!model) refuse("it has no model");
    if (object_) refuse("an object has no end; the file is truncated");
    return std::move(part_);
  }

 private:
  [[noreturn]] void refuse(const std::string& what) const {
    fail(path_, fmt::format("{}: {}; {}", printable(name_), what, kExportAgain));
  }
  std::string place() const { return fmt::format("object {}", id_); }

  double unit_of(const Tag& tag) const {
    const std::string_view name = tag["unit"];
    if (name.empty()) return kUnits[0].metres;
    for (const Unit& unit : kUnits)
      if (unit.name == name) return unit.metres;
    refuse("the unit '" + printable(name) + "' is none of 3MF's");
  }

  std::int64_t integer(const Tag& tag, const char* key) const {
    const auto bad = [&](const std::string& what) { refuse(fmt::format("{} of a {}: {}", key, tag.name, what)); };
    if (tag[key].empty()) bad("is missing");
    return parse_integer(tag[key], bad);
  }
  double number(std::string_view text, const char* key) const {
    const auto bad = [&](const std::string& what) { refuse(fmt::format("{}: {}: {}", place(), key, what)); };
    if (text.empty()) bad("is missing");
    return parse_number(text, bad);
  }

  void begin_object(const Tag& tag) {
    id_ = integer(tag, "id");
    const auto [at, added] = part_.objects.try_emplace(id_);
    if (!added) refuse(place() + " occurs twice");
    object_ = &at->second;
    object_->name = unescaped(tag["name"]);
    if (!tag["pid"].empty()) object_->property = property(tag, "pindex");
    if (tag.closed) end_object();
  }
  void end_object() {
    if (!object_) return;
    const std::size_t vertices = object_->vertices.size();
    for (std::size_t t = 0; t < object_->triangles.size(); ++t)
      for (const Index v : object_->triangles[t])
        if (v >= vertices)
          refuse(fmt::format("{}: triangle {}: index {} is out of range, the object has {} vertices", place(), t, v,
                             vertices));
    object_ = nullptr;
  }

  void take_vertex(const Tag& tag) {
    if (!object_) return;
    Vec3 p;
    int axis = 0;
    for (const char* key : {"x", "y", "z"}) {
      p[axis] = number(tag[key], key);
      if (const char* flaw = coordinate_flaw(p[axis]))
        refuse(fmt::format("{}: vertex {}: {}", place(), object_->vertices.size(), flaw));
      ++axis;
    }
    object_->vertices.push_back(p);
  }
  void take_triangle(const Tag& tag) {
    if (!object_) return;
    Triangle t;
    std::size_t k = 0;
    for (const char* key : {"v1", "v2", "v3"}) {
      const std::int64_t v = integer(tag, key);
      if (v < 0 || v >= kNone)
        refuse(fmt::format("{}: triangle {}: index {} is out of range", place(), object_->triangles.size(), v));
      t[k++] = static_cast<Index>(v);
    }
    object_->triangles.push_back(t);
    const bool own = !tag["p1"].empty();
    if (!tag["pid"].empty() && own) object_->properties.push_back(property(tag, "p1"));
    else if (own && object_->property.group >= 0)
      object_->properties.push_back({object_->property.group, integer(tag, "p1")});
    else object_->properties.push_back(object_->property);
  }
  Property property(const Tag& tag, const char* index) const {
    const std::int64_t group = integer(tag, "pid");
    if (part_.materials.count(group) == 0) return {};  // textures and what else is not told apart here
    return {static_cast<int>(group), tag[index].empty() ? 0 : integer(tag, index)};
  }

  Component component(const Tag& tag) const {
    Component component;
    component.object = integer(tag, "objectid");
    for (const auto& [key, value] : tag.attributes)
      if (local_name(key) == "path") component.part = unescaped(value);
    if (tag["transform"].empty()) return component;
    MatrixWords words{tag["transform"]};
    for (double& x : component.transform.m) {
      x = number(words.next(), "transform");
      if (!std::isfinite(x)) refuse("a transform is not finite");
    }
    component.transform.identity = component.transform.m == Transform{}.m;
    return component;
  }

  struct MatrixWords {
    std::string_view text;
    std::string_view next() {
      constexpr std::string_view kBlank = " \t\r\n";
      const std::size_t begin = std::min(text.find_first_not_of(kBlank), text.size());
      const std::size_t end = std::min(text.find_first_of(kBlank, begin), text.size());
      const std::string_view word = text.substr(begin, end - begin);
      text.remove_prefix(end);
      return word;
    }
  };

  const std::string &path_, &name_;
  XmlReader xml_;
  Part part_;
  Object* object_ = nullptr;
  std::int64_t id_ = 0;
  std::vector<std::string>* group_ = nullptr;
};

class ThreeMfReader {
 public:
  ThreeMfReader(const std::string& path, std::string_view bytes)
      : path_(path), zip_(path, bytes), size_(bytes.size()) {}

  Soup read() {
    const std::string root = find_model();
    const Part& model = part(root);
    soup_.unit = model.unit;
    if (model.items.empty())
      fail(path_, "nothing is to be built; add an object to the plate and export the file again");
    for (const Component& item : model.items) add(item, root, {}, 0);
    labels_.take(soup_);
    return std::move(soup_);
  }

 private:
  // The part that the archive says its model is.
  std::string find_model() {
    constexpr const char* kRelationships = "_rels/.rels";
    if (zip_.has(kRelationships)) {
      const std::string text = zip_.unpack(kRelationships);
      XmlReader xml(path_, text);
      Tag tag;
      while (xml.next_tag(tag))
        if (tag["Type"] == kModelRelationship) return without_slash(unescaped(tag["Target"]));
    }
    return kModelPart;
  }
  static std::string without_slash(std::string name) {
    if (name.starts_with('/')) name.erase(0, 1);
    return name;
  }

  const Part& part(const std::string& name) {
    const auto found = parts_.find(name);
    if (found != parts_.end()) return found->second;
    const std::string text = zip_.unpack(name);
    return parts_.emplace(name, PartReader(path_, name, text).read()).first->second;
  }

  void add(const Component& wanted, const std::string& part_name, const Transform& around, int depth) {
    constexpr int kDeepest = 64;                     // parts within parts
    constexpr std::size_t kMostInstances = 1000000;  // of objects
    const std::string name = wanted.part.empty() ? part_name : without_slash(wanted.part);
    const Part& from = part(name);
    const auto found = from.objects.find(wanted.object);
    if (found == from.objects.end())
      fail(path_, fmt::format("{}: object {} is to be built, but is not there; {}", printable(name), wanted.object,
                              kExportAgain));
    if (depth > kDeepest || ++instances_ > kMostInstances)
      fail(path_, fmt::format("{}: object {} has too many components, or has itself; {}", printable(name),
                              wanted.object, kExportAgain));
    const Transform transform = wanted.transform.then(around);
    for (const Component& component : found->second.components) add(component, name, transform, depth + 1);
    add_mesh(from, found->second, transform);
  }

  void add_mesh(const Part& from, const Object& object, const Transform& transform) {
    if (object.triangles.empty()) return;
    check_room(object);
    const auto first = static_cast<Index>(soup_.vertices.size());
    for (const Vec3& p : object.vertices) {
      soup_.vertices.push_back(transform(p));
      for (int k = 0; k < 3; ++k)
        if (const char* flaw = coordinate_flaw(soup_.vertices.back()[k]))
          fail(path_, fmt::format("vertex {}: {}", soup_.vertices.size() - 1, flaw));
    }
    labels_.set_part(name_of_instance(object.name));
    const bool mirrored = transform.mirrors();
    const Property* last = nullptr;
    for (std::size_t t = 0; t < object.triangles.size(); ++t) {
      Triangle corners = object.triangles[t];
      if (mirrored) std::swap(corners[1], corners[2]);
      for (const Index v : corners) soup_.faces.values.push_back(first + v);
      soup_.end_face();
      const Property& property = object.properties[t];
      if (!last || last->group != property.group || last->index != property.index)
        labels_.set_material(material(from, property));
      last = &property;
      labels_.add_face();
    }
  }
  // The object's name, which further objects of that name have with a number.
  std::string name_of_instance(const std::string& name) {
    const std::size_t n = ++taken_[name];
    return n == 1 ? name : fmt::format("{}_{}", name.empty() ? "object" : name, n);
  }
  // Objects may be built several times, but not so often that a small file fills the memory.
  void check_room(const Object& object) const {
    constexpr std::size_t kFree = 1000000, kPerByte = 100;
    const std::size_t vertices = soup_.vertices.size() + object.vertices.size(),
                      faces = soup_.faces.rows() + object.triangles.size();
    if (vertices + faces > kFree + kPerByte * size_ || vertices >= kNone)
      fail(path_, "objects are built so often that the mesh would be too large; export one of each");
  }
  static std::string material(const Part& from, const Property& property) {
    const auto group = from.materials.find(property.group);
    if (group == from.materials.end()) return {};
    const std::vector<std::string>& names = group->second;
    const auto i = static_cast<std::size_t>(property.index);
    if (property.index < 0 || i >= names.size()) return {};
    return names[i].empty() ? fmt::format("material {}", i) : names[i];
  }

  const std::string& path_;
  ZipReader zip_;
  std::size_t size_, instances_ = 0;
  std::map<std::string, Part> parts_;
  std::map<std::string, std::size_t> taken_;  // how many objects have a name
  GroupLabels labels_;
  Soup soup_;
};

// The unit's name, or millimetres, which are the format's default.
std::string_view unit_name(double metres) {
  constexpr double kEqual = 1e-5;  // survey feet are 2e-6 longer than feet
  for (const Unit& unit : kUnits)
    if (metres > 0 && std::abs(metres / unit.metres - 1) < kEqual) return unit.name;
  return kUnits[0].name;
}

bool is_degenerate(const Triangle& t) { return t[0] == t[1] || t[1] == t[2] || t[2] == t[0]; }

std::string model_of(const TriangleMesh& mesh, const WriteOptions& options) {
  const LabelNames names = names_of_labels(mesh.labels, mesh.label_names, options);
  std::string out = fmt::format(
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<model unit=\"{}\" xml:lang=\"en-US\" "
      "xmlns=\"http://schemas.microsoft.com/3dmanufacturing/core/2015/02\">\n<resources>\n",
      unit_name(mesh.unit));
  std::map<std::int32_t, std::size_t> material_of;
  if (!names.empty()) {
    out += "<basematerials id=\"1\">\n";
    for (const auto& [label, name] : names) {
      const std::array<unsigned char, 3> c = colour_of_label(label, options);
      out += fmt::format("<base name=\"{}\" displaycolor=\"#{:02X}{:02X}{:02X}\"/>\n", escaped(name), c[0], c[1], c[2]);
      material_of.emplace(label, material_of.size());
    }
    out += "</basematerials>\n";
  }
  // An object of the type "model" must be closed.
  const MeshTopology topology = analyse_topology(mesh.triangles, mesh.vertices.size());
  out += fmt::format("<object id=\"2\" type=\"{}\"{}>\n<mesh>\n<vertices>\n",
                     topology.closed && topology.manifold && topology.oriented ? "model" : "surface",
                     names.empty() ? "" : " pid=\"1\" pindex=\"0\"");
  for (const Vec3& p : mesh.vertices) {
    out += "<vertex x=\"";
    append_number(out, p.x);
    out += "\" y=\"";
    append_number(out, p.y);
    out += "\" z=\"";
    append_number(out, p.z);
    out += "\"/>\n";
  }
  out += "</vertices>\n<triangles>\n";
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const Triangle& t = mesh.triangles[i];
    if (is_degenerate(t)) continue;  // which the format forbids
    out += "<triangle v1=\"";
    append_index(out, t[0]);
    out += "\" v2=\"";
    append_index(out, t[1]);
    out += "\" v3=\"";
    append_index(out, t[2]);
    if (!names.empty()) {
      out += "\" pid=\"1\" p1=\"";
      append_index(out, material_of.at(mesh.labels[i]));
    }
    out += "\"/>\n";
  }
  return out + "</triangles>\n</mesh>\n</object>\n</resources>\n<build>\n<item objectid=\"2\"/>\n</build>\n</model>\n";
}

}  // namespace

Soup read_3mf(const std::string& path, std::string_view bytes) { return ThreeMfReader(path, bytes).read(); }

std::string format_3mf(const std::string& path, const TriangleMesh& mesh, const WriteOptions& options) {
  const std::string types =
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
      "<Types xmlns=\"http://schemas.openxmlformats.org/package/2006/content-types\">\n"
      "<Default Extension=\"rels\" ContentType=\"application/vnd.openxmlformats-package.relationships+xml\"/>\n"
      "<Default Extension=\"model\" ContentType=\"application/vnd.ms-package.3dmanufacturing-3dmodel+xml\"/>\n"
      "</Types>\n";
  const std::string relationships = fmt::format(
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
      "<Relationships xmlns=\"http://schemas.openxmlformats.org/package/2006/relationships\">\n"
      "<Relationship Target=\"/{}\" Id=\"rel0\" Type=\"{}\"/>\n</Relationships>\n",
      kModelPart, kModelRelationship);
  return zipped(
      path, {{"[Content_Types].xml", types}, {"_rels/.rels", relationships}, {kModelPart, model_of(mesh, options)}});
}

}  // namespace bisector::io
