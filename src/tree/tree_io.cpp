#include "bisector/tree.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "bisector/error.h"
#include "bisector/io.h"
#include "bisector/preview.h"
#include "core/colour.h"
#include "core/geometry.h"
#include "core/random.h"
#include "io/bytes.h"
#include "io/files.h"
#include "io/mesh_formats.h"
#include "tree/iges.h"

namespace bisector {
namespace {

using Colour = std::array<unsigned char, 3>;

constexpr Colour kNoBranch{150, 150, 150};
constexpr Colour kLeafColour{120, 180, 90};
constexpr std::int32_t kLeafLabel = -2;
constexpr double kPointSize = 5e-4;  // half the edge of a drawn point, in the points' diagonal
constexpr double kApart = 1.1;       // of the two views, in widths of the tree

// The trees' trunks are in ascending order.
std::size_t tree_of_branch(const TreeResult& tree, std::size_t branch) {
  const auto next = std::upper_bound(tree.trees.begin(), tree.trees.end(), branch,
                                     [](std::size_t b, const ScannedTree& t) { return b < t.trunk; });
  return static_cast<std::size_t>(next - tree.trees.begin()) - 1;
}

// `hue` in turns.
Colour colour_of(double hue, double bright) {
  const std::array<double, 3> shares = shares_of_hue(hue);
  Colour colour;
  for (std::size_t k = 0; k < 3; ++k) colour[k] = static_cast<unsigned char>(255 * bright * (0.35 + 0.65 * shares[k]));
  return colour;
}

// Bark brown for trunks, other hues for what grows on them; in a scene a hue for each tree.
Colour branch_colour(const TreeResult& tree, Index branch) {
  if (branch == kNone) return kNoBranch;
  if (!tree.tree.empty()) {
    const double hue = spread_hue(static_cast<double>(tree_of_branch(tree, branch)));
    return colour_of(hue, 0.65 + 0.25 * Random(1, branch).uniform());
  }
  if (tree.branches[branch].parent == kNone) return {142, 112, 86};
  Random random(1, branch);
  const double hue = random.uniform(), bright = 0.65 + 0.25 * random.uniform();
  return colour_of(hue, bright);
}

// What a point that is left out is called and drawn like; nothing: it is not.
struct PointLook {
  std::int32_t label = 0;
  Colour colour{};
};
std::optional<PointLook> left_out(const TreeResult& tree, std::size_t point) {
  if (tree.part.empty()) return std::nullopt;
  switch (tree.part[point]) {
    case ScanPart::ground: return PointLook{-3, {190, 165, 120}};
    case ScanPart::wall: return PointLook{-4, {130, 140, 165}};
    case ScanPart::low_plant: return PointLook{-5, {150, 170, 60}};
    case ScanPart::tree:
    case ScanPart::stray: break;
  }
  return std::nullopt;
}

std::string branch_name(std::size_t branch) { return fmt::format("branch_{}", branch); }

// z up to the preview's y up.
Vec3 upright(const Vec3& p) { return {p.x, p.z, -p.y}; }

struct Scene {
  std::vector<Vec3> vertices;
  Csr<Index> polygons;
  std::vector<Colour> colours;

  void add(const std::array<Vec3, 3>& corners, const Colour& colour) {
    for (const Vec3& p : corners) {
      polygons.values.push_back(static_cast<Index>(vertices.size()));
      vertices.push_back(p);
    }
    polygons.offsets.push_back(polygons.values.size());
    colours.push_back(colour);
  }
  void add_point(const Vec3& p, double size, const Colour& colour) {
    const std::array<Vec3, 4> c{p + Vec3{size, size, size}, p + Vec3{-size, -size, size}, p + Vec3{-size, size, -size},
                                p + Vec3{size, -size, -size}};
    add({c[0], c[1], c[2]}, colour);
    add({c[0], c[3], c[1]}, colour);
    add({c[0], c[2], c[3]}, colour);
    add({c[1], c[3], c[2]}, colour);
  }
};

}  // namespace

void write_tree(const std::string& path, const TreeResult& tree, const TriangleMesh& mesh, IgesUnit unit) {
  const std::string extension = io::lower_extension(path);
  if (extension != ".igs" && extension != ".iges") {
    std::vector<std::string> names;
    for (std::size_t b = 0; !tree.tree.empty() && b < tree.branches.size(); ++b)
      names.push_back(fmt::format("tree_{}", tree_of_branch(tree, b)));
    write_mesh(path, mesh, {"branch", names});
    return;
  }
  std::vector<BranchSurface> surfaces;
  std::vector<std::string> names;
  for (std::size_t b = 0; b < tree.branches.size(); ++b) {
    surfaces.push_back(tree.branches[b].surface);
    names.push_back(branch_name(b) + (tree.tree.empty() ? "" : fmt::format("_tree_{}", tree_of_branch(tree, b))));
  }
  write_iges(path, surfaces, names, unit);
}

void write_skeleton(const std::string& path, const TreeResult& tree) {
  std::size_t edges = 0;
  for (const TreeNode& node : tree.skeleton) edges += node.parent != kNone;
  std::string out = fmt::format(
      "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty double x\nproperty double y\nproperty double "
      "z\n"
      "property double radius\nproperty int branch\nproperty int order\n"
      "element edge {}\nproperty int vertex1\nproperty int vertex2\nend_header\n",
      tree.skeleton.size(), edges);
  for (const TreeNode& node : tree.skeleton) {
    for (int k = 0; k < 3; ++k) io::append_bytes(out, node.position[k]);
    io::append_bytes(out, node.radius);
    io::append_bytes(out, static_cast<std::int32_t>(node.branch));
    io::append_bytes(out, static_cast<std::int32_t>(tree.branches[node.branch].order));
  }
  for (std::size_t k = 0; k < tree.skeleton.size(); ++k)
    if (tree.skeleton[k].parent != kNone) {
      io::append_bytes(out, static_cast<std::int32_t>(tree.skeleton[k].parent));
      io::append_bytes(out, static_cast<std::int32_t>(k));
    }
  write_file(path, out);
}

void write_tree_labels(const std::string& path, const std::vector<Vec3>& points, const TreeResult& tree) {
  if (tree.branch.size() != points.size())
    throw Error(fmt::format("{}: {} labels for {} points; give the points that the tree was made from",
                            io::name_of(path), tree.branch.size(), points.size()));
  std::string out = fmt::format(
      "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty double x\nproperty double y\nproperty double "
      "z\n"
      "property uchar red\nproperty uchar green\nproperty uchar blue\nproperty int label\n{}end_header\n",
      points.size(), tree.tree.empty() ? "" : "property int tree\n");
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (int k = 0; k < 3; ++k) io::append_bytes(out, points[i][k]);
    const bool is_leaf = !tree.leaf.empty() && tree.leaf[i];
    PointLook look{static_cast<std::int32_t>(tree.branch[i]), branch_colour(tree, tree.branch[i])};
    if (is_leaf) look = {kLeafLabel, kLeafColour};
    if (const auto special = left_out(tree, i)) look = *special;
    for (const unsigned char c : look.colour) io::append_bytes(out, c);
    io::append_bytes(out, look.label);
    if (!tree.tree.empty()) io::append_bytes(out, static_cast<std::int32_t>(tree.tree[i]));
  }
  write_file(path, out);
}

void write_tree_preview(const std::string& path, const std::vector<Vec3>& points, const TreeResult& tree,
                        const TriangleMesh& mesh) {
  std::vector<Colour> colours;
  for (std::size_t b = 0; b < tree.branches.size(); ++b) colours.push_back(branch_colour(tree, static_cast<Index>(b)));
  Box box = bounding_box(points);
  const Box surface = bounding_box(mesh.vertices);
  for (int k = 0; k < 3; ++k) {
    box.lo[k] = std::min(box.lo[k], surface.lo[k]);
    box.hi[k] = std::max(box.hi[k], surface.hi[k]);
  }
  const Vec3 centre = 0.5 * (box.lo + box.hi), apart{kApart * (box.hi.x - box.lo.x), 0, 0};
  Scene scene;
  for (std::size_t i = 0; i < points.size(); ++i)
    if (const auto other = left_out(tree, i))
      scene.add_point(upright(points[i] - centre), kPointSize * box.diagonal(), other->colour);
    else if (const Index b = tree.branch[i]; b != kNone)
      scene.add_point(upright(points[i] - centre), kPointSize * box.diagonal(), colours[b]);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    std::array<Vec3, 3> corners;
    for (std::size_t k = 0; k < 3; ++k) corners[k] = upright(mesh.vertices[mesh.triangles[t][k]] - centre) + apart;
    scene.add(corners, colours[static_cast<std::size_t>(mesh.labels[t])]);
  }
  PreviewOptions options;
  options.width = 1600;
  options.height = 1000;
  options.azimuth = 0;
  options.elevation = 4;
  options.edges = false;
  options.colours = std::move(scene.colours);
  write_preview(path, scene.vertices, scene.polygons, options);
}

}  // namespace bisector
