// Calls TetGen for the library: reads a request from the socket that is standard input, and writes the reply there.
#define TETLIBRARY
#include <sys/prctl.h>
#include <sys/resource.h>
#include <tetgen.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <new>
#include <vector>

#include "tetgen/protocol.h"

namespace {

using namespace bisector::tetgen;

void read_all(void* data, std::size_t size) {
  for (char* at = static_cast<char*>(data); size > 0;) {
    const ssize_t n = ::read(STDIN_FILENO, at, size);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) std::_Exit(kBadRequest);
    at += n;
    size -= static_cast<std::size_t>(n);
  }
}

void write_all(const void* data, std::size_t size) {
  for (const char* at = static_cast<const char*>(data); size > 0;) {
    const ssize_t n = ::write(STDIN_FILENO, at, size);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) std::_Exit(kBadRequest);
    at += n;
    size -= static_cast<std::size_t>(n);
  }
}

void read_points(tetgenio& io, std::size_t n) {
  io.numberofpoints = static_cast<int>(n);
  if (n == 0) return;
  io.pointlist = new REAL[3 * n];
  read_all(io.pointlist, 3 * n * sizeof(double));
}

void read_triangles(tetgenio& io, std::size_t n) {
  std::vector<std::int32_t> corners(3 * n);
  read_all(corners.data(), corners.size() * sizeof(std::int32_t));
  for (const std::int32_t corner : corners)
    if (corner < 0 || corner >= io.numberofpoints) std::_Exit(kBadRequest);
  io.numberoffacets = static_cast<int>(n);
  io.facetlist = new tetgenio::facet[n];
  for (std::size_t i = 0; i < n; ++i) {
    tetgenio::facet& facet = io.facetlist[i];
    tetgenio::init(&facet);
    facet.numberofpolygons = 1;
    facet.polygonlist = new tetgenio::polygon[1];
    facet.polygonlist[0].numberofvertices = 3;
    facet.polygonlist[0].vertexlist = new int[3]{corners[3 * i], corners[3 * i + 1], corners[3 * i + 2]};
  }
}

int run() {
  Request request;
  read_all(&request, sizeof request);
  constexpr std::uint64_t kMost = std::numeric_limits<std::int32_t>::max() / 3;
  if (request.magic != kMagic || request.points > kMost || request.triangles > kMost) return kBadRequest;
  tetgenio surface, result;
  read_points(surface, request.points);
  read_triangles(surface, request.triangles);

  // Vertices that are close are not merged (M, T): the surfaces of thin plates would be.
  char switches[] = "pYMT1e-14Q";
  tetgenbehavior options;
  if (!options.parse_commandline(switches)) return kBadRequest;
  tetrahedralize(&options, &surface, &result);

  const Reply reply{kMagic, static_cast<std::uint64_t>(result.numberofpoints),
                    static_cast<std::uint64_t>(result.numberoftetrahedra)};
  write_all(&reply, sizeof reply);
  write_all(result.pointlist, 3 * sizeof(double) * reply.points);
  write_all(result.tetrahedronlist, 4 * sizeof(std::int32_t) * reply.tets);
  return 0;
}

}  // namespace

int main() {
  // Ctrl-C reaches the whole group of processes; the parent decides.
  std::signal(SIGINT, SIG_IGN);
  std::signal(SIGPIPE, SIG_IGN);
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  const rlimit no_core{0, 0};
  ::setrlimit(RLIMIT_CORE, &no_core);
  // What TetGen allocated is left to the system: its destructors trip over their own failures.
  try {
    std::_Exit(run());
  } catch (const std::bad_alloc&) {
    std::_Exit(kOutOfMemory);
  } catch (int code) {
    std::_Exit(code == 1 ? kOutOfMemory : kTetgenFailed + (code & 15));
  } catch (...) {
    std::_Exit(kTetgenFailed);
  }
}
