#include "tetmesh/tetgen_reply.h"

#include <cmath>
#include <cstring>

#include "bisector/error.h"
#include "tetgen/protocol.h"

namespace bisector {

TetgenReply parse_reply(const std::string& bytes) {
  tetgen::Reply reply;
  const auto damaged = [] {
    throw Error("the program that calls TetGen gave an incomplete answer; check that it belongs to this version");
  };
  if (bytes.size() < sizeof reply) damaged();
  std::memcpy(&reply, bytes.data(), sizeof reply);
  if (reply.magic != tetgen::kMagic || reply.points > bytes.size() || reply.tets > bytes.size() ||
      bytes.size() != sizeof reply + reply.points * sizeof(Vec3) + reply.tets * sizeof(Tetrahedron))
    damaged();
  TetgenReply result{std::vector<Vec3>(reply.points), std::vector<Tetrahedron>(reply.tets)};
  if (reply.points) std::memcpy(result.points.data(), bytes.data() + sizeof reply, reply.points * sizeof(Vec3));
  if (reply.tets)
    std::memcpy(result.tets.data(), bytes.data() + sizeof reply + reply.points * sizeof(Vec3),
                reply.tets * sizeof(Tetrahedron));
  for (const Vec3& p : result.points)
    if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z)) damaged();
  for (const Tetrahedron& t : result.tets)
    for (const Index v : t)
      if (v >= reply.points) damaged();
  return result;
}

}  // namespace bisector
