#include "tetmesh/tetgen.h"

#include <dlfcn.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <limits>
#include <numeric>
#include <tuple>
#include <utility>

#include "bisector/error.h"
#include "core/memory_limit.h"
#include "core/orientation.h"
#include "core/parallel.h"
#include "core/stopwatch.h"
#include "mesh/tet_adjacency.h"
#include "mesh/tet_topology.h"
#include "tetgen/protocol.h"
#include "tetmesh/carve.h"
#include "tetmesh/tetgen_reply.h"

extern char** environ;

namespace bisector {

namespace {

namespace fs = std::filesystem;

#ifndef BISECTOR_TETGEN_PROGRAM
#define BISECTOR_TETGEN_PROGRAM ""
#endif

constexpr const char* kSimplify = "simplify or remesh the surface first, or give a tetrahedral mesh";

class Descriptor {
 public:
  Descriptor() = default;
  ~Descriptor() { close(); }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;

  void set(int descriptor) { descriptor_ = descriptor; }
  int get() const { return descriptor_; }
  void close() {
    if (descriptor_ >= 0) ::close(descriptor_);
    descriptor_ = -1;
  }

 private:
  int descriptor_ = -1;
};

// A running program; killed, if it still runs, and collected at the end.
class Child {
 public:
  explicit Child(const std::string& program) {
    int channel[2], messages[2];
    if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, channel) != 0) fail_start(program, errno);
    channel_.set(channel[0]);
    Descriptor far_channel, far_messages;
    far_channel.set(channel[1]);
    if (::pipe2(messages, O_CLOEXEC) != 0) fail_start(program, errno);
    messages_.set(messages[0]);
    far_messages.set(messages[1]);
    posix_spawn_file_actions_t actions;
    ::posix_spawn_file_actions_init(&actions);
    ::posix_spawn_file_actions_adddup2(&actions, channel[1], STDIN_FILENO);
    ::posix_spawn_file_actions_adddup2(&actions, messages[1], STDOUT_FILENO);
    ::posix_spawn_file_actions_adddup2(&actions, messages[1], STDERR_FILENO);
    std::string name = program;
    char* arguments[] = {name.data(), nullptr};
    const int error = ::posix_spawn(&id_, program.c_str(), &actions, nullptr, arguments, environ);
    ::posix_spawn_file_actions_destroy(&actions);
    if (error != 0) {
      id_ = -1;
      fail_start(program, error);
    }
    share_memory_limit(id_);
    for (const int descriptor : {channel_.get(), messages_.get()})
      ::fcntl(descriptor, F_SETFL, ::fcntl(descriptor, F_GETFL) | O_NONBLOCK);
  }
  ~Child() {
    if (id_ < 0) return;
    ::kill(id_, SIGKILL);
    wait();
  }
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;

  // Sends the request and reads the reply to its end.
  std::string talk(const std::string& request, double time_limit, const Context& context) {
    const Stopwatch watch;
    std::string reply;
    std::size_t sent = 0;
    bool listening = true, hearing = true;
    while (listening) {
      context.check();
      if (time_limit > 0 && watch.seconds() > time_limit)
        throw Error(fmt::format("TetGen took longer than {} s; {}", time_limit, kSimplify));
      pollfd polls[2] = {{channel_.get(), static_cast<short>(POLLIN | (sent < request.size() ? POLLOUT : 0)), 0},
                         {hearing ? messages_.get() : -1, POLLIN, 0}};
      if (::poll(polls, 2, 50) < 0 && errno != EINTR)
        throw Error(fmt::format("waiting for TetGen failed: {}", std::strerror(errno)));
      if (polls[1].revents) hearing = receive(messages_.get(), said_);
      if (said_.size() > 8192) said_.erase(0, said_.size() - 4096);
      if (polls[0].revents & POLLOUT) {
        const ssize_t n = ::send(channel_.get(), request.data() + sent, request.size() - sent, MSG_NOSIGNAL);
        if (n > 0) sent += static_cast<std::size_t>(n);
        else if (errno != EAGAIN && errno != EINTR) sent = request.size();
        if (sent == request.size()) ::shutdown(channel_.get(), SHUT_WR);
      }
      if (polls[0].revents & (POLLIN | POLLHUP | POLLERR)) listening = receive(channel_.get(), reply);
    }
    while (hearing && receive(messages_.get(), said_)) {
      pollfd rest{messages_.get(), POLLIN, 0};
      if (::poll(&rest, 1, 50) <= 0) break;
    }
    return reply;
  }

  // The status of waitpid.
  int wait() {
    int status = 0;
    while (::waitpid(id_, &status, 0) < 0 && errno == EINTR) {
    }
    id_ = -1;
    return status;
  }

  // The last line that it printed, for an error message; "" if there is none.
  std::string last_words() const {
    std::string text = said_;
    while (!text.empty() && std::isspace(static_cast<unsigned char>(text.back()))) text.pop_back();
    text.erase(0, text.find_last_of('\n') + 1);
    for (char& c : text)
      if (static_cast<unsigned char>(c) < 0x20) c = ' ';
    if (text.size() > 120) text.replace(0, text.size() - 120, "...");
    return text.empty() ? "" : " (\"" + text + "\")";
  }

 private:
  [[noreturn]] static void fail_start(const std::string& program, int error) {
    throw Error(fmt::format("{}: cannot be started: {}; set BISECTOR_TETGEN to the path of bisector-tetgen", program,
                            std::strerror(error)));
  }
  // False at the end.
  static bool receive(int descriptor, std::string& out) {
    char buffer[1 << 16];
    for (;;) {
      const ssize_t n = ::read(descriptor, buffer, sizeof buffer);
      if (n > 0) {
        out.append(buffer, static_cast<std::size_t>(n));
        continue;
      }
      if (n < 0 && errno == EINTR) continue;
      return n < 0 && errno == EAGAIN;
    }
  }

  pid_t id_ = -1;
  Descriptor channel_, messages_;
  std::string said_;
};

void explain(int status, const Child& child) {
  using namespace tetgen;
  if (WIFSIGNALED(status)) {
    if (WTERMSIG(status) == SIGKILL)
      throw Error(fmt::format("TetGen was killed, most likely because memory ran out; free some, or {}", kSimplify));
    if (memory_limit() > 0)
      throw Error(
          fmt::format("TetGen crashed ({}), most likely for want of memory, of which it has what is left of {} "
                      "MiB; allow more, or {}",
                      ::strsignal(WTERMSIG(status)), memory_limit() >> 20, kSimplify));
    throw Error(fmt::format("TetGen crashed on this surface ({}){}; {}", ::strsignal(WTERMSIG(status)),
                            child.last_words(), kSimplify));
  }
  const int code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  if (code == 0) return;
  if (code == kOutOfMemory) throw Error(fmt::format("TetGen ran out of memory; free some, or {}", kSimplify));
  if (code == kTetgenFailed + 3)
    throw Error(fmt::format("TetGen found that the surface intersects itself{}; {}", child.last_words(), kSimplify));
  if (code == kTetgenFailed + 4 || code == kTetgenFailed + 5)
    throw Error(fmt::format("TetGen cannot tell parts of the surface apart that are very close{}; {}",
                            child.last_words(), kSimplify));
  if (code >= kTetgenFailed && code < kTetgenFailed + 16)
    throw Error(fmt::format("TetGen failed on this surface, code {}{}; {}", code - kTetgenFailed, child.last_words(),
                            kSimplify));
  throw Error(fmt::format("the program that calls TetGen failed, code {}{}; check that it belongs to this version",
                          code, child.last_words()));
}

template <class T>
void append(std::string& out, const T* data, std::size_t n) {
  out.append(reinterpret_cast<const char*>(data), n * sizeof(T));
}

// The surface's vertices that triangles use, ascending.
std::vector<Index> used_vertices(const TriangleMesh& surface) {
  std::vector<char> used(surface.vertices.size(), 0);
  for (const Triangle& t : surface.triangles)
    for (const Index v : t) {
      if (v >= used.size())
        throw Error(fmt::format("index {} is out of range, the surface has {} vertices; mend it", v, used.size()));
      used[v] = 1;
    }
  std::vector<Index> vertices;
  for (Index v = 0; v < used.size(); ++v)
    if (used[v]) vertices.push_back(v);
  return vertices;
}

std::string make_request(const TriangleMesh& surface, const std::vector<Index>& used) {
  std::vector<std::int32_t> index(surface.vertices.size(), -1);
  std::string out;
  tetgen::Request request;
  request.points = used.size();
  request.triangles = surface.triangles.size();
  append(out, &request, 1);
  for (std::size_t i = 0; i < used.size(); ++i) {
    index[used[i]] = static_cast<std::int32_t>(i);
    append(out, &surface.vertices[used[i]], 1);
  }
  for (const Triangle& t : surface.triangles) {
    const std::int32_t corners[3] = {index[t[0]], index[t[1]], index[t[2]]};
    append(out, corners, 3);
  }
  return out;
}

// The index among `vertices` of each of TetGen's points, which come in an order of its own; its Steiner points are
// appended.
std::vector<Index> identify(const std::vector<Vec3>& points, std::vector<Vec3>& vertices,
                            const std::vector<char>& wanted) {
  const auto key = [](const Vec3& p) { return std::tuple(p.x, p.y, p.z); };
  std::vector<Index> order;
  for (Index v = 0; v < vertices.size(); ++v)
    if (wanted[v]) order.push_back(v);
  std::sort(order.begin(), order.end(),
            [&](Index a, Index b) { return std::pair(key(vertices[a]), a) < std::pair(key(vertices[b]), b); });
  std::vector<Index> index(points.size());
  const std::size_t given = vertices.size();
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto at = std::lower_bound(order.begin(), order.end(), points[i],
                                     [&](Index v, const Vec3& p) { return key(vertices[v]) < key(p); });
    if (at != order.end() && *at < given && vertices[*at] == points[i]) {
      index[i] = *at;
      continue;
    }
    index[i] = static_cast<Index>(vertices.size());
    vertices.push_back(points[i]);
  }
  return index;
}

void turn_positive(const std::vector<Vec3>& vertices, std::vector<Tetrahedron>& tets, std::size_t& flat) {
  std::vector<signed char> sign(tets.size());
  parallel_each(tets.size(), [&](std::size_t i) {
    const Tetrahedron& t = tets[i];
    sign[i] = static_cast<signed char>(orientation(vertices[t[0]], vertices[t[1]], vertices[t[2]], vertices[t[3]]));
  });
  // TetGen orients its tetrahedra alike, and the majority shows which way. One of the other sign is inverted.
  const auto positive = std::count(sign.begin(), sign.end(), 1), negative = std::count(sign.begin(), sign.end(), -1);
  if (positive > 0 && negative > 0)
    throw Error(fmt::format("TetGen gave {} inverted tetrahedra; {}", std::min(positive, negative), kSimplify));
  if (negative > 0)
    for (Tetrahedron& t : tets) std::swap(t[2], t[3]);
  flat = static_cast<std::size_t>(std::count(sign.begin(), sign.end(), 0));
}

// Numbers from 1 for parts that share no facet; empty if there is one only.
std::vector<std::int32_t> number_parts(const std::vector<Tetrahedron>& tets) {
  const std::vector<Index> part = tet_parts(tet_adjacency(tets), [](Index, std::size_t) { return true; });
  std::vector<std::int32_t> number;
  if (std::all_of(part.begin(), part.end(), [](Index p) { return p == 0; })) return number;
  for (const Index p : part) number.push_back(static_cast<std::int32_t>(p) + 1);
  return number;
}

// Leaves out Steiner points that no tetrahedron uses, which lie in cavities. Returns how many stay.
std::size_t drop_unused(std::vector<Vec3>& vertices, std::vector<Tetrahedron>& tets, std::size_t given) {
  std::vector<Index> index(vertices.size(), kNone);
  for (const Tetrahedron& t : tets)
    for (const Index v : t) index[v] = 0;
  Index next = static_cast<Index>(given);
  for (std::size_t v = 0; v < vertices.size(); ++v) {
    if (v < given) index[v] = static_cast<Index>(v);
    if (v < given || index[v] == kNone) continue;
    vertices[next] = vertices[v];
    index[v] = next++;
  }
  vertices.resize(next);
  for (Tetrahedron& t : tets)
    for (Index& v : t) v = index[v];
  return next - given;
}

}  // namespace

std::string find_tetgen() {
  if (const char* given = std::getenv("BISECTOR_TETGEN"); given && *given) return given;
  std::error_code error;
  const auto runs = [](const fs::path& path) { return ::access(path.c_str(), X_OK) == 0; };
  std::vector<fs::path> folders;  // of the shared library that this is part of, and of the program
  Dl_info here{};
  if (::dladdr(reinterpret_cast<const void*>(&find_tetgen), &here) != 0 && here.dli_fname[0] == '/')
    folders.push_back(fs::path(here.dli_fname).parent_path());
  const fs::path own = fs::read_symlink("/proc/self/exe", error);
  if (!error) folders.push_back(own.parent_path());
  // Beside them; above the tests of a build; in bin/ beside lib/ and beside lib/x86_64-linux-gnu/.
  for (const fs::path& folder : folders)
    for (const char* place : {"", "..", "../bin", "../../bin"})
      if (const fs::path program = (folder / place / "bisector-tetgen").lexically_normal(); runs(program))
        return program;
  return runs(BISECTOR_TETGEN_PROGRAM) ? BISECTOR_TETGEN_PROGRAM : "";
}

namespace {

// What TetGen makes of a surface: positive tetrahedra on its vertices, followed by those that TetGen added.
struct Filled {
  std::vector<Vec3> vertices;
  std::vector<Tetrahedron> tets;
  std::size_t flat = 0;  // tetrahedra without volume
};

Filled run_tetgen(const TriangleMesh& surface, const TetgenOptions& options, const Context& context) {
  const std::string program = options.program.empty() ? find_tetgen() : options.program;
  if (program.empty())
    throw Error(
        "tetrahedra of a surface need TetGen, and the program bisector-tetgen is nowhere; build with BISECTOR_TETGEN, "
        "set BISECTOR_TETGEN to its path, or give a tetrahedral mesh");
  const std::vector<Index> used = used_vertices(surface);
  for (std::size_t v = 0; v < surface.vertices.size(); ++v)
    for (int k = 0; k < 3; ++k)
      if (!std::isfinite(surface.vertices[v][k]))
        throw Error(fmt::format("vertex {}: a coordinate is not finite; mend it", v));
  constexpr std::size_t kMost = std::numeric_limits<std::int32_t>::max() / 4;
  if (surface.triangles.empty() || surface.triangles.size() > kMost || used.size() > kMost)
    throw Error(fmt::format("TetGen cannot take {} triangles and {} vertices; simplify the surface",
                            surface.triangles.size(), used.size()));

  Child child(program);
  const std::string reply = child.talk(make_request(surface, used), options.time_limit, context);
  explain(child.wait(), child);
  TetgenReply given = parse_reply(reply);

  Filled filled;
  filled.vertices = surface.vertices;
  std::vector<char> wanted(filled.vertices.size(), 0);
  for (const Index v : used) wanted[v] = 1;
  const std::vector<Index> index = identify(given.points, filled.vertices, wanted);
  filled.tets = std::move(given.tets);
  for (Tetrahedron& t : filled.tets)
    for (Index& v : t) v = index[v];
  turn_positive(filled.vertices, filled.tets, filled.flat);
  return filled;
}

[[noreturn]] void fail_for_lost_triangles(std::size_t lost, std::size_t first, std::size_t all) {
  throw Error(
      fmt::format("TetGen did not keep {} of {} boundary triangles (first: {}); {}", lost, all, first, kSimplify));
}

TetgenResult with_marks(const TriangleMesh& surface, Filled filled) {
  TetgenResult result;
  result.zero_volume = filled.flat;
  result.steiner_points = drop_unused(filled.vertices, filled.tets, surface.vertices.size());
  result.mesh.vertices = std::move(filled.vertices);
  result.mesh.tets = std::move(filled.tets);
  result.mesh.boundary = surface.triangles;
  result.mesh.boundary_labels = surface.labels;
  result.mesh.feature_edges = surface.feature_edges;
  return result;
}

// The triangle that each facet of each tetrahedron is, or kNone.
std::vector<std::array<Index, 4>> triangles_of_facets(const std::vector<Tetrahedron>& tets,
                                                      const std::vector<Triangle>& triangles) {
  const auto ascending = [](Triangle t) {
    std::sort(t.begin(), t.end());
    return t;
  };
  std::vector<std::pair<Triangle, Index>> order;
  for (Index i = 0; i < triangles.size(); ++i) order.push_back({ascending(triangles[i]), i});
  std::sort(order.begin(), order.end());
  std::vector<std::array<Index, 4>> found(tets.size());
  parallel_each(tets.size(), [&](std::size_t t) {
    for (int k = 0; k < 4; ++k) {
      const Triangle facet = ascending(facet_of(tets[t], k));
      const auto at = std::lower_bound(order.begin(), order.end(), std::pair{facet, Index{0}});
      found[t][static_cast<std::size_t>(k)] = at != order.end() && at->first == facet ? at->second : kNone;
    }
  });
  return found;
}

// Whether a triangle has the corners of a facet in the facet's order, which is that seen from outside.
bool faces_away(const Triangle& triangle, Triangle facet) {
  while (facet[0] != triangle[0]) std::rotate(facet.begin(), facet.begin() + 1, facet.end());
  return facet == triangle;
}

// What hangs together through facets that are no walls.
std::vector<Index> parts_between(const std::vector<std::array<Index, 4>>& adjacent,
                                 const std::vector<std::array<Index, 4>>& wall) {
  for (std::size_t t = 0; t < wall.size(); ++t)
    for (std::size_t k = 0; k < 4; ++k)
      if (wall[t][k] == kNone && adjacent[t][k] == kNone)
        throw Error(fmt::format("TetGen's tetrahedra have holes; {}", kSimplify));
  return tet_parts(adjacent, [&](Index t, std::size_t k) { return wall[t][k] == kNone; });
}

}  // namespace

TetgenResult tetgen_tets(const TriangleMesh& surface, const TetgenOptions& options, const Context& context) {
  Filled filled = run_tetgen(surface, options, context);
  Carved carved = carve(filled.tets, surface.triangles);
  if (!carved.missing.empty())
    fail_for_lost_triangles(carved.missing.size(), carved.missing.front(), surface.triangles.size());
  filled.tets = std::move(carved.tets);
  TetgenResult result = with_marks(surface, std::move(filled));
  if (boundary_facets(result.mesh.tets).size() != surface.triangles.size())
    throw Error(fmt::format("TetGen's tetrahedra have holes; {}", kSimplify));
  result.mesh.regions = number_parts(result.mesh.tets);
  return result;
}

TetgenResult tetgen_regions(const TriangleMesh& walls, const TetgenOptions& options, const Context& context) {
  Filled filled = run_tetgen(walls, options, context);
  const std::vector<std::array<Index, 4>> wall = triangles_of_facets(filled.tets, walls.triangles);
  const std::vector<Index> part = parts_between(tet_adjacency(filled.tets), wall);
  // Of each triangle the part that it faces away from, and the one beyond.
  std::vector<std::array<Index, 2>> sides(walls.triangles.size(), {kNone, kNone});
  for (std::size_t t = 0; t < wall.size(); ++t)
    for (int k = 0; k < 4; ++k) {
      const Index i = wall[t][static_cast<std::size_t>(k)];
      if (i != kNone) sides[i][faces_away(walls.triangles[i], facet_of(filled.tets[t], k)) ? 0 : 1] = part[t];
    }
  std::vector<std::size_t> lost;
  std::vector<std::int32_t> number(part.empty() ? 0 : *std::max_element(part.begin(), part.end()) + 1, 0);
  std::int32_t count = 0;
  for (std::size_t i = 0; i < sides.size(); ++i) {
    if (sides[i][0] == kNone && sides[i][1] == kNone) lost.push_back(i);
    else if (sides[i][0] == sides[i][1])
      throw Error(fmt::format("triangle {} has the same enclosed part on both sides; remove what divides nothing", i));
    for (const Index side : sides[i])
      if (side != kNone && number[side] == 0) number[side] = ++count;
  }
  if (!lost.empty()) fail_for_lost_triangles(lost.size(), lost.front(), walls.triangles.size());
  TetgenResult result = with_marks(walls, std::move(filled));
  if (count > 1)
    for (const Index p : part) result.mesh.regions.push_back(number[p]);
  return result;
}

}  // namespace bisector
