// What the library and bisector-tetgen say to each other, in the machine's own byte order: a request, then a reply.
#pragma once

#include <cstdint>

namespace bisector::tetgen {

inline constexpr std::uint64_t kMagic = 0x3247455442534942;

// Followed by the surface's points (3 doubles each), then its triangles (3 int32 each).
struct Request {
  std::uint64_t magic = kMagic;
  std::uint64_t points = 0, triangles = 0;
};

// Followed by the points (3 doubles each), then the tetrahedra (4 int32 each).
struct Reply {
  std::uint64_t magic = kMagic;
  std::uint64_t points = 0, tets = 0;
};

// Exit codes: those of TetGen are added to the first.
inline constexpr int kTetgenFailed = 64;
inline constexpr int kOutOfMemory = 96;
inline constexpr int kBadRequest = 97;

}  // namespace bisector::tetgen
