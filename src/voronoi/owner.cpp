#include "voronoi/owner.h"

#include <algorithm>
#include <cmath>

#include "voronoi/exact.h"

namespace bisector {
namespace {

// Whether q belongs to slot i rather than to slot j.
bool owns(const SortedSeeds& seeds, const Vec3& q, Index i, Index j) {
  const Vec3 d = seeds.x[j] - seeds.x[i], p = q - seeds.x[i];
  const double h = d.x * (d.x - 2 * p.x) + d.y * (d.y - 2 * p.y) + d.z * (d.z - 2 * p.z);
  const double largest = std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)});
  const double scale = (std::abs(d.x) + std::abs(d.y) + std::abs(d.z)) *
                       (std::max({std::abs(d.x), std::abs(d.y), std::abs(d.z)}) + 2 * largest);
  const double bound = 0x1p-50 * scale + 0x1p-1000;
  if (h > bound) return true;
  if (h < -bound) return false;
  return exact_side(q, seeds.x[i], seeds.id[i], seeds.x[j], seeds.id[j]) > 0;
}

// Whether every seed that could be nearer to q than `owner` is listed and certain not to be.
bool certainly_owns(const SortedSeeds& seeds, const NeighbourList& list, const Vec3& q, Index owner) {
  const Vec3 x = seeds.x[owner], p = q - x;
  const double r2 = norm2(p), reach = 4 * r2 * (1 + 1e-9);
  // With |d| <= 2 |p| the bound of owns() is below 2^-45 |p|^2.
  const double bound = 0x1p-45 * r2 + 0x1p-1000;
  for (const Index* j = list.begin; j != list.end; ++j) {
    const Vec3 d = seeds.x[*j] - x;
    const double squared = norm2(d);
    if (squared > reach) return true;
    if (!(squared - 2 * dot(d, p) > bound)) return false;
  }
  return list.radius * list.radius > reach;
}

}  // namespace

Index find_owner(const SortedSeeds& seeds, const Neighbours& neighbours, const Vec3& q, Index guess) {
  Index owner = guess;
  for (;;) {
    const NeighbourList list = neighbours.list(owner);
    if (certainly_owns(seeds, list, q, owner)) return owner;
    // The nearest of those listed, if it is nearer; else exactly, among those that may be as near.
    Index better = kNone;
    double best = norm2(q - seeds.x[owner]);
    const double reach = 4 * best * (1 + 1e-9);
    best *= 1 - 1e-9;
    for (const Index* j = list.begin; j != list.end; ++j) {
      const double squared = norm2(q - seeds.x[*j]);
      if (squared < best) {
        best = squared;
        better = *j;
      }
    }
    if (better == kNone) {
      for (const Index* j = list.begin; j != list.end && better == kNone; ++j)
        if (!owns(seeds, q, owner, *j)) better = *j;
      if (better == kNone) {
        if (list.radius * list.radius > reach) return owner;
        break;
      }
    }
    owner = better;
  }
  // The list is too short for a certificate: take the best of all seeds that are nearest up to rounding.
  owner = neighbours.nearest(q);
  for (Index k : neighbours.around(q, norm(q - seeds.x[owner]) * (1 + 1e-9)))
    if (k != owner && !owns(seeds, q, owner, k)) owner = k;
  return owner;
}

}  // namespace bisector
