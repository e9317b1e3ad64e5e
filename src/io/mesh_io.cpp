#include "bisector/io.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <iterator>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "bisector/error.h"
#include "core/degenerate.h"
#include "core/temporary_name.h"
#include "io/attributes.h"
#include "io/files.h"
#include "io/formats.h"
#include "io/mesh_formats.h"
#include "io/text.h"
#include "mesh/attribute_sizes.h"
#include "mesh/polygon.h"

namespace bisector {

namespace {

class File {
 public:
  File(const std::string& path, int flags) : descriptor_(::open(path.c_str(), flags | O_CLOEXEC, 0666)) {}
  ~File() {
    if (is_open()) ::close(descriptor_);
  }
  File(const File&) = delete;
  File& operator=(const File&) = delete;

  bool is_open() const { return descriptor_ >= 0; }
  int descriptor() const { return descriptor_; }
  bool write(std::string_view bytes) {
    while (!bytes.empty()) {
      const ssize_t n = ::write(descriptor_, bytes.data(), bytes.size());
      if (n < 0 && errno == EINTR) continue;
      if (n < 0) return false;
      bytes.remove_prefix(static_cast<std::size_t>(n));
    }
    return true;
  }
  // Until it is on the disk, for a file that is to replace another is not to be empty after a power cut. What is no
  // file on a disk has nothing to wait for.
  bool flush() { return ::fdatasync(descriptor_) == 0 || errno == EINVAL || errno == ENOTSUP; }
  // Gives a name to a file without one.
  bool link_to(const std::string& path) {
    const std::string self = "/proc/self/fd/" + std::to_string(descriptor_);
    return ::linkat(AT_FDCWD, self.c_str(), AT_FDCWD, path.c_str(), AT_SYMLINK_FOLLOW) == 0;
  }
  // A full disk may show only here.
  bool close() { return ::close(std::exchange(descriptor_, -1)) == 0; }

 private:
  int descriptor_;
};

}  // namespace

namespace io {

std::string printable(std::string_view text, std::size_t limit) {
  std::string shown(text.substr(0, limit));
  for (char& c : shown)
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) c = '?';
  if (text.size() > limit) shown += "...";
  return shown;
}

std::string name_of(const std::string& path) { return printable(path, 4096); }

void fail(const std::string& path, const std::string& what) { throw Error(name_of(path) + ": " + what); }

std::string quantity(std::size_t n, const char* one, const char* many) {
  return fmt::format("{} {}", n, n == 1 ? one : many);
}

std::string lower_extension(const std::string& path) {
  const std::size_t slash = path.find_last_of('/'), dot = path.find_last_of('.');
  if (dot == std::string::npos || (slash != std::string::npos && dot < slash)) return "";
  std::string extension = path.substr(dot);
  for (char& c : extension)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return extension;
}

std::string read_bytes(const std::string& path) {
  const File file(path, O_RDONLY);
  struct stat status {};
  if (!file.is_open() || ::fstat(file.descriptor(), &status) != 0)
    fail(path, fmt::format("cannot be opened: {}; check the name and its permissions", std::strerror(errno)));
  if (S_ISDIR(status.st_mode)) fail(path, "is a directory; name a file");
  std::string bytes;
  std::size_t size = 0;
  for (;;) {
    // One byte more than expected shows the end; a pipe does not tell its size and is read in growing pieces.
    if (size == bytes.size())
      bytes.resize(size > 0 ? 2 * size : status.st_size > 0 ? static_cast<std::size_t>(status.st_size) + 1 : 1 << 16);
    const ssize_t n = ::read(file.descriptor(), bytes.data() + size, bytes.size() - size);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) fail(path, fmt::format("cannot be read: {}; check the disk", std::strerror(errno)));
    if (n == 0) break;
    size += static_cast<std::size_t>(n);
  }
  bytes.resize(size);
  if (bytes.find_first_not_of(" \t\r\n") == std::string::npos)
    fail(path, std::string("the file is empty; ") + kExportAgain);
  return bytes;
}

}  // namespace io

using namespace io;

namespace {

// --- from what a file holds to triangles ---

void split_faces(const std::string& path, const Soup& soup, TriangleMesh& mesh, const Context& context) {
  const std::size_t faces = soup.faces.rows(), triangles = soup.faces.values.size() - 2 * faces;
  if (triangles >= kNone) fail(path, fmt::format("{} triangles are too many; split the model", triangles));
  mesh.triangles.reserve(triangles);
  const bool split = triangles > faces;
  if (split) mesh.face_of_triangle.reserve(triangles);
  if (!soup.labels.empty()) mesh.labels.reserve(triangles);
  PolygonSplitter splitter(mesh.vertices, mesh.triangles);
  std::size_t polygons = 0, fans = 0;
  for (std::size_t i = 0; i < faces; ++i) {
    const Index* corners = soup.faces.begin(i);
    const std::size_t degree = soup.faces.size(i);
    if (degree == 3) {
      mesh.triangles.push_back({corners[0], corners[1], corners[2]});
    } else {
      ++polygons;
      if (!splitter.split(corners, degree)) ++fans;
    }
    if (split) mesh.face_of_triangle.resize(mesh.triangles.size(), static_cast<Index>(i));
    if (!soup.labels.empty()) mesh.labels.resize(mesh.triangles.size(), soup.labels[i]);
  }
  if (polygons > 0)
    context.warn(fmt::format("{}: {} split into triangles{}", name_of(path),
                             quantity(polygons, "polygon was", "polygons were"),
                             fans > 0 ? fmt::format(", {} of them degenerate", fans) : ""));
}

using Edge = std::array<Index, 2>;

void make_ascending(std::vector<Edge>& edges) {
  for (Edge& e : edges) std::sort(e.begin(), e.end());
  std::sort(edges.begin(), edges.end());
  edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
}

// For each of ascending edges whether a triangle of three corners has it.
std::vector<char> find_mesh_edges(const std::vector<Edge>& edges, const std::vector<Triangle>& triangles) {
  std::vector<char> found(edges.size(), 0);
  if (edges.empty()) return found;
  for (const Triangle& t : triangles) {
    if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) continue;
    for (std::size_t k = 0; k < 3; ++k) {
      const Edge e{std::min(t[k], t[(k + 1) % 3]), std::max(t[k], t[(k + 1) % 3])};
      const auto at = std::lower_bound(edges.begin(), edges.end(), e);
      if (at != edges.end() && *at == e) found[static_cast<std::size_t>(at - edges.begin())] = 1;
    }
  }
  return found;
}

void keep_mesh_edges(const std::string& path, std::vector<Edge> edges, TriangleMesh& mesh, const Context& context) {
  make_ascending(edges);
  const std::vector<char> found = find_mesh_edges(edges, mesh.triangles);
  for (std::size_t i = 0; i < edges.size(); ++i)
    if (found[i]) mesh.feature_edges.push_back(edges[i]);
  const std::size_t strangers = edges.size() - mesh.feature_edges.size();
  if (strangers > 0)
    context.warn(fmt::format("{}: {} off the surface ignored", name_of(path),
                             quantity(strangers, "marked edge", "marked edges")));
}

void warn_of_leftovers(const std::string& path, const TriangleMesh& mesh, const Context& context) {
  std::vector<char> used(mesh.vertices.size(), 0);
  std::size_t flat = 0;
  for (const Triangle& t : mesh.triangles) {
    for (const Index v : t) used[v] = 1;
    if (collinear(mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]])) ++flat;
  }
  const auto unused = static_cast<std::size_t>(std::count(used.begin(), used.end(), 0));
  if (unused > 0)
    context.warn(fmt::format("{}: {} used by no face", name_of(path), quantity(unused, "vertex is", "vertices are")));
  if (flat > 0)
    context.warn(fmt::format("{}: {} no area", name_of(path), quantity(flat, "triangle has", "triangles have")));
}

// --- writing ---

void check_points(const std::string& path, const std::vector<Vec3>& vertices) {
  for (std::size_t v = 0; v < vertices.size(); ++v)
    for (int k = 0; k < 3; ++k)
      if (!std::isfinite(vertices[v][k]))
        fail(path, fmt::format("vertex {}: a coordinate is not finite; nothing was written", v));
}

void check_face(const std::string& path, std::size_t face, const Index* begin, const Index* end, std::size_t vertices) {
  for (const Index* v = begin; v != end; ++v)
    if (*v >= vertices)
      fail(path, fmt::format("face {}: index {} is out of range, the mesh has {} vertices; nothing was written", face,
                             *v, vertices));
}

// Each label has a name if any has, and a colour.
template <class Label>
void check_label_names(const std::string& path, const std::vector<Label>& labels, const WriteOptions& options) {
  const auto check = [&](std::size_t count, const char* what) {
    if (count == 0) return;
    for (const Label label : labels)
      if (std::cmp_less(label, 0) || std::cmp_greater_equal(label, count))
        fail(path, fmt::format("label {} has no {}, there are {}; nothing was written", label, what, count));
  };
  check(options.names.size(), "name");
  check(options.colours.size(), "colour");
}

[[noreturn]] void fail_write(const std::string& path, int error) {
  fail(path, fmt::format("cannot be written: {}; check the folder, its permissions and the free space",
                         std::strerror(error)));
}

}  // namespace

TriangleMesh io::mesh_of(const std::string& path, Soup soup, const Context& context) {
  if (soup.faces.rows() == 0) fail(path, "face 0: there is no face at all; export a surface");
  if (!soup.ignored.empty())
    context.warn(fmt::format("{}: {} after the end of the mesh ignored", name_of(path), soup.ignored));
  TriangleMesh mesh;
  mesh.vertices = std::move(soup.vertices);
  mesh.label_names = std::move(soup.label_names);
  mesh.unit = soup.unit;
  mesh.material_files = std::move(soup.material_files);
  mesh.label_materials = std::move(soup.label_materials);
  split_faces(path, soup, mesh, context);
  split_attributes(soup, mesh);
  keep_mesh_edges(path, std::move(soup.edges), mesh, context);
  warn_of_leftovers(path, mesh, context);
  return mesh;
}

TriangleMesh read_mesh(const std::string& path, const Context& context) {
  const Format& format = format_of(path, &FileFormat::reads_surfaces, "meshes");
  const std::string bytes = read_bytes(path);
  Soup soup = format.read ? format.read(path, bytes) : surface_of(path, format.read_tets(path, bytes));
  return mesh_of(path, std::move(soup), context);
}

void write_mesh(const std::string& path, const TriangleMesh& mesh, const WriteOptions& options) {
  check_points(path, mesh.vertices);
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
    check_face(path, i, mesh.triangles[i].data(), mesh.triangles[i].data() + 3, mesh.vertices.size());
  if (!mesh.labels.empty() && mesh.labels.size() != mesh.triangles.size())
    fail(path, fmt::format("{} labels for {} triangles; give one each", mesh.labels.size(), mesh.triangles.size()));
  check_label_names(path, mesh.labels, options);
  check_attributes(mesh);
  for (const Edge& e : mesh.feature_edges)
    if (std::max(e[0], e[1]) >= mesh.vertices.size())
      fail(path, fmt::format("feature edge {} {} is out of range, the mesh has {} vertices; nothing was written", e[0],
                             e[1], mesh.vertices.size()));
  const Format& format = format_of(path, &FileFormat::writes_surfaces, "meshes");
  if (format.bytes_of) return write_file(path, format.bytes_of(path, mesh, options));
  write_file(path,
             format.bytes_of_tets(
                 {mesh.vertices, {}, {}, mesh.triangles, mesh.labels, mesh.feature_edges, {}, mesh.label_names}, {}));
}

void write_polygons(const std::string& path, const PolygonMesh& mesh, const WriteOptions& options) {
  const std::size_t faces = mesh.polygons.rows();
  const Format& format = format_of(path, &FileFormat::writes_polygons, "polygons");
  if ((!mesh.labels.empty() && mesh.labels.size() != faces) || (!mesh.colours.empty() && mesh.colours.size() != faces))
    fail(path, fmt::format("{} labels and {} colours for {} polygons; give one each", mesh.labels.size(),
                           mesh.colours.size(), faces));
  check_points(path, mesh.vertices);
  for (std::size_t i = 0; i < faces; ++i)
    check_face(path, i, mesh.polygons.begin(i), mesh.polygons.end(i), mesh.vertices.size());
  check_label_names(path, mesh.labels, options);
  write_file(path, format.bytes_of_polygons(mesh, options));
}

void write_polyhedra(const std::string& path, const PolyhedronMesh& mesh) {
  if (lower_extension(path) != ".vtu")
    fail(path, fmt::format("unknown format '{}' of polyhedra; use .vtu", printable(lower_extension(path))));
  const std::size_t n = mesh.polyhedra.rows();
  if (mesh.cells.size() != n || mesh.tets.size() != n)
    fail(path, fmt::format("{} cells and {} tetrahedra for {} polyhedra; give one each", mesh.cells.size(),
                           mesh.tets.size(), n));
  check_points(path, mesh.vertices);
  for (std::size_t f = 0; f < mesh.faces.rows(); ++f)
    check_face(path, f, mesh.faces.begin(f), mesh.faces.end(f), mesh.vertices.size());
  for (const Index f : mesh.polyhedra.values)
    if (f >= mesh.faces.rows())
      fail(path, fmt::format("face {} is out of range, the mesh has {}; nothing was written", f, mesh.faces.rows()));
  write_file(path, format_vtu(mesh));
}

std::vector<double> read_vertex_attribute(const std::string& path, const std::string& name) {
  const std::string extension = lower_extension(path);
  if (extension == ".vtp") return read_vtp_attribute(path, read_bytes(path), name);
  if (extension != ".ply")
    fail(path, fmt::format("there is no vertex property '{}', {} files have none; use a .ply or .vtp file that has it",
                           printable(name), extension.empty() ? "such" : printable(extension)));
  return read_ply_attribute(path, read_bytes(path), name);
}

std::vector<Edge> read_feature_edges(const std::string& path, const TriangleMesh& mesh) {
  const std::string bytes = read_bytes(path);
  TextReader in(path, bytes, '#');
  std::vector<Edge> edges;
  std::vector<std::size_t> lines;
  while (in.next_line()) {
    Edge e{};
    for (Index& v : e) {
      const std::string_view word = in.word();
      if (word.empty()) in.fail("an edge has one vertex; give two");
      const std::int64_t i = in.integer(word);
      if (i < 0 || i >= static_cast<std::int64_t>(mesh.vertices.size()))
        in.fail(
            fmt::format("index {} is out of range, the mesh has {} vertices; mend the edge", i, mesh.vertices.size()));
      v = static_cast<Index>(i);
    }
    edges.push_back(e);
    lines.push_back(in.line());
  }
  std::vector<Edge> ascending = edges;
  make_ascending(ascending);
  const std::vector<char> found = find_mesh_edges(ascending, mesh.triangles);
  for (std::size_t i = 0; i < edges.size(); ++i) {
    const Edge e{std::min(edges[i][0], edges[i][1]), std::max(edges[i][0], edges[i][1])};
    const auto at = std::lower_bound(ascending.begin(), ascending.end(), e) - ascending.begin();
    if (!found[static_cast<std::size_t>(at)])
      in.fail_at(lines[i],
                 fmt::format("{} {} is not an edge of the mesh; mend or remove it", edges[i][0], edges[i][1]));
  }
  return ascending;
}

void write_feature_edges(const std::string& path, const std::vector<Edge>& edges) {
  std::string out = "# feature edges: two vertices each, counted from 0\n";
  for (const Edge& e : edges) out += fmt::format("{} {}\n", e[0], e[1]);
  write_file(path, out);
}

// A file that has all of its bytes, but not yet its name.
class FilesTogether::File {
 public:
  // `target`: `path` without links. Throws Error.
  File(const std::string& path, const std::filesystem::path& target, const std::string& bytes)
      : path_(path), target_(target) {
    temporary_ = target.parent_path() / temporary_name();
    // Nothing is left of a file without a name if the program is killed; not all file systems have such.
    const std::string folder = target.has_parent_path() ? target.parent_path().string() : ".";
    file_.emplace(folder, O_WRONLY | O_TMPFILE);
    named_ = !file_->is_open() || ::access("/proc/self/fd", X_OK) != 0;
    if (named_) file_.emplace(temporary_.string(), O_WRONLY | O_CREAT | O_EXCL);
    if (!file_->is_open()) fail_write(path, errno);
    if (!file_->write(bytes) || !file_->flush()) give_up();
  }
  ~File() {
    if (named_) ::unlink(temporary_.c_str());
  }
  File(const File&) = delete;
  File& operator=(const File&) = delete;

  void put_in_place() {
    if (!named_ && !file_->link_to(temporary_.string())) give_up();
    named_ = true;
    if (!file_->close() || ::rename(temporary_.c_str(), target_.c_str()) != 0) give_up();
    named_ = false;
  }

 private:
  [[noreturn]] void give_up() {
    const int reason = errno;
    if (std::exchange(named_, false)) ::unlink(temporary_.c_str());
    fail_write(path_, reason);
  }

  std::string path_;
  std::filesystem::path target_, temporary_;
  std::optional<bisector::File> file_;
  bool named_ = false;  // is there under its temporary name
};

namespace {

thread_local FilesTogether* together = nullptr;

}  // namespace

FilesTogether::FilesTogether() { together = this; }

FilesTogether::~FilesTogether() { together = nullptr; }

void FilesTogether::put_in_place() {
  for (const std::unique_ptr<File>& file : files_) file->put_in_place();
  files_.clear();
}

void write_file(const std::string& path, const std::string& bytes) {
  namespace fs = std::filesystem;
  std::error_code error;
  fs::path target = path;
  if (fs::is_symlink(target, error)) {
    const fs::path resolved = fs::canonical(target, error);
    if (!error) target = resolved;
  }
  const fs::file_status status = fs::status(target, error);
  if (fs::is_directory(status)) fail(path, "is a directory; name a file");
  if (fs::exists(status) && !fs::is_regular_file(status)) {
    File device(path, O_WRONLY);
    if (!device.is_open() || !device.write(bytes) || !device.close()) fail_write(path, errno);
    return;
  }
  auto file = std::make_unique<FilesTogether::File>(path, target, bytes);
  if (together) together->files_.push_back(std::move(file));
  else file->put_in_place();
}

}  // namespace bisector
