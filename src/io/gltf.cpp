// glTF 2.0 in one binary file (Khronos Group, glTF 2.0 Specification, section 4, "GLB File Format").
#include <fmt/format.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include "core/colour.h"
#include "io/attributes.h"
#include "io/bytes.h"
#include "io/colours.h"
#include "io/labels.h"
#include "io/mesh_formats.h"

namespace bisector::io {

namespace {

using Json = nlohmann::ordered_json;

// What the format's numbers mean.
enum : int { kUnsignedInt = 5125, kFloat = 5126, kArrayBuffer = 34962, kElementArrayBuffer = 34963, kTriangles = 4 };
constexpr std::uint32_t kMagic = 0x46546c67, kVersion = 2, kJsonChunk = 0x4e4f534a, kBinaryChunk = 0x004e4942;

class GlbWriter {
 public:
  GlbWriter(const std::string& path, const TriangleMesh& mesh, const WriteOptions& options)
      : path_(path), mesh_(mesh), options_(options) {
    const auto find = [&](Attribute::Site site, AttributeMeaning meaning) {
      return find_attribute(mesh.attributes, site, meaning);
    };
    colours_ = find(Attribute::Site::vertex, AttributeMeaning::colour);
    normals_ = find(Attribute::Site::vertex, AttributeMeaning::normal);
    texture_ = find(Attribute::Site::corner, AttributeMeaning::texture);
    if (texture_) {
      table_ = tell_corners_apart(mesh, *texture_);
      return;
    }
    texture_ = find(Attribute::Site::vertex, AttributeMeaning::texture);
    table_.vertex.resize(mesh.vertices.size());
    std::iota(table_.vertex.begin(), table_.vertex.end(), Index{0});
    for (const Triangle& t : mesh.triangles) table_.index.insert(table_.index.end(), t.begin(), t.end());
  }

  std::string write() {
    json_["asset"] = {{"version", "2.0"}, {"generator", "bisector"}};
    json_["scene"] = 0;
    json_["scenes"] = Json::array({{{"nodes", {0}}}});
    Json node{{"mesh", 0}};
    // Lengths are in metres.
    if (mesh_.unit > 0 && mesh_.unit != 1) node["scale"] = {mesh_.unit, mesh_.unit, mesh_.unit};
    json_["nodes"] = Json::array({std::move(node)});
    add_positions();
    add_attributes();
    add_triangles();
    json_["buffers"] = Json::array({{{"byteLength", buffer_.size()}}});
    return joined();
  }

 private:
  void add_positions() {
    std::array<float, 3> low, high;
    low.fill(std::numeric_limits<float>::max());
    high.fill(std::numeric_limits<float>::lowest());
    for (const Index v : table_.vertex)
      for (std::size_t k = 0; k < 3; ++k) {
        const double x = mesh_.vertices[v][static_cast<int>(k)];
        if (std::abs(x) > std::numeric_limits<float>::max())
          fail(path_, fmt::format("vertex {}: a coordinate is beyond glTF's range; write another format", v));
        const auto rounded = static_cast<float>(x);
        low[k] = std::min(low[k], rounded);
        high[k] = std::max(high[k], rounded);
        append_bytes(buffer_, rounded);
      }
    attributes_["POSITION"] = 0;
    add_accessor(kFloat, "VEC3", table_.vertex.size(), 0, kArrayBuffer);
    json_["accessors"].back()["min"] = low;
    json_["accessors"].back()["max"] = high;
  }

  void add_attributes() {
    const auto add_floats = [&](const char* name, const char* type, std::size_t components, const auto& value) {
      const std::size_t start = buffer_.size();
      for (std::size_t i = 0; i < table_.vertex.size(); ++i)
        for (std::size_t c = 0; c < components; ++c) append_bytes(buffer_, static_cast<float>(value(i, c)));
      attributes_[name] = json_["accessors"].size();
      add_accessor(kFloat, type, table_.vertex.size(), start, kArrayBuffer);
    };
    if (normals_)
      add_floats("NORMAL", "VEC3", 3,
                 [&](std::size_t i, std::size_t c) { return normals_->values[3 * table_.vertex[i] + c]; });
    if (texture_) {
      const bool corners = texture_->site == Attribute::Site::corner;
      // The origin of a picture is its upper left corner.
      add_floats("TEXCOORD_0", "VEC2", 2, [&](std::size_t i, std::size_t c) {
        const double x = texture_->values[2 * (corners ? table_.corner[i] : table_.vertex[i]) + c];
        return c == 0 ? x : 1 - x;
      });
    }
    if (!colours_) return;
    // Colours are amounts of light.
    const std::vector<std::uint8_t> bytes = colour_bytes(*colours_);
    add_floats("COLOR_0", "VEC4", 4, [&](std::size_t i, std::size_t c) {
      if (c >= colours_->components) return 1.0;
      const std::uint8_t x = bytes[colours_->components * table_.vertex[i] + c];
      return c == 3 ? x / 255.0 : light_of_srgb(x);
    });
  }

  // A primitive for each label, all over the same vertices.
  void add_triangles() {
    const LabelNames names = names_of_labels(mesh_.labels, mesh_.label_names, options_);
    std::map<std::int32_t, std::vector<std::size_t>> members;
    for (std::size_t i = 0; i < mesh_.triangles.size(); ++i)
      members[mesh_.labels.empty() ? 0 : mesh_.labels[i]].push_back(i);
    Json primitives = Json::array();
    for (const auto& [label, triangles] : members) {
      const std::size_t start = buffer_.size();
      for (const std::size_t i : triangles)
        for (std::size_t k = 0; k < 3; ++k) append_bytes(buffer_, table_.index[3 * i + k]);
      add_accessor(kUnsignedInt, "SCALAR", 3 * triangles.size(), start, kElementArrayBuffer);
      Json primitive{{"attributes", attributes_}, {"indices", json_["accessors"].size() - 1}, {"mode", kTriangles}};
      if (!names.empty()) {
        primitive["material"] = json_.contains("materials") ? json_["materials"].size() : 0;
        json_["materials"].push_back(material(label, names.at(label)));
      }
      primitives.push_back(std::move(primitive));
    }
    json_["meshes"] = Json::array({{{"primitives", std::move(primitives)}}});
  }

  Json material(std::int32_t label, const std::string& name) const {
    const std::array<unsigned char, 3> c = colour_of_label(label, options_);
    return {{"name", name},
            {"doubleSided", true},
            {"pbrMetallicRoughness",
             {{"baseColorFactor", {light_of_srgb(c[0]), light_of_srgb(c[1]), light_of_srgb(c[2]), 1}},
              {"metallicFactor", 0},
              {"roughnessFactor", 1}}}};
  }

  // Of the bytes from `start` to the end, which get a view of their own.
  void add_accessor(int component, const char* type, std::size_t count, std::size_t start, int target) {
    const std::size_t view = json_.contains("bufferViews") ? json_["bufferViews"].size() : 0;
    json_["bufferViews"].push_back(
        {{"buffer", 0}, {"byteOffset", start}, {"byteLength", buffer_.size() - start}, {"target", target}});
    json_["accessors"].push_back(
        {{"bufferView", view}, {"componentType", component}, {"count", count}, {"type", type}});
  }

  std::string joined() const {
    // Names from files may be anything; JSON has Unicode only.
    std::string text = json_.dump(-1, ' ', false, Json::error_handler_t::replace);
    text.resize((text.size() + 3) / 4 * 4, ' ');
    constexpr std::size_t kHeader = 12, kChunkHeader = 8;
    const std::size_t size = kHeader + 2 * kChunkHeader + text.size() + buffer_.size();
    if (size > std::numeric_limits<std::uint32_t>::max())
      fail(path_, "the file would be larger than the 4 GiB of a binary glTF file; use another format");
    std::string out;
    out.reserve(size);
    append_bytes(out, kMagic);
    append_bytes(out, kVersion);
    append_bytes(out, static_cast<std::uint32_t>(size));
    append_bytes(out, static_cast<std::uint32_t>(text.size()));
    append_bytes(out, kJsonChunk);
    out += text;
    append_bytes(out, static_cast<std::uint32_t>(buffer_.size()));
    append_bytes(out, kBinaryChunk);
    return out + buffer_;
  }

  const std::string& path_;
  const TriangleMesh& mesh_;
  const WriteOptions& options_;
  const Attribute *colours_ = nullptr, *normals_ = nullptr, *texture_ = nullptr;
  CornerTable table_;  // vertices with several texture coordinates are several
  Json json_;
  Json attributes_;  // accessors of the vertices
  std::string buffer_;
};

}  // namespace

std::string format_glb(const std::string& path, const TriangleMesh& mesh, const WriteOptions& options) {
  return GlbWriter(path, mesh, options).write();
}

}  // namespace bisector::io
