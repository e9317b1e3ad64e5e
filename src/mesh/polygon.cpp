#include "mesh/polygon.h"

#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

namespace bisector {

bool PolygonSplitter::split(const Index* corners, std::size_t n) {
  corners_ = corners;
  if (!project(n)) {
    for (std::size_t i = 2; i < n; ++i) emit(0, i - 1, i);
    return false;
  }
  if (n == 4 && split_convex_quad()) return true;
  return clip_ears(n);
}

bool PolygonSplitter::project(std::size_t n) {
  Vec3 normal;
  for (std::size_t i = 2; i < n; ++i) normal += cross(position(i - 1) - position(0), position(i) - position(0));
  int axis = 0;
  for (int k = 1; k < 3; ++k)
    if (std::abs(normal[k]) > std::abs(normal[axis])) axis = k;
  if (normal[axis] == 0) return false;
  int x = (axis + 1) % 3, y = (axis + 2) % 3;
  if (normal[axis] < 0) std::swap(x, y);
  plane_.resize(n);
  for (std::size_t i = 0; i < n; ++i) plane_[i] = {position(i)[x], position(i)[y]};
  return true;
}

bool PolygonSplitter::split_convex_quad() {
  for (std::size_t i = 0; i < 4; ++i)
    if (!(turn(i, (i + 1) % 4, (i + 2) % 4) > 0)) return false;
  if (norm2(position(2) - position(0)) <= norm2(position(3) - position(1))) {
    emit(0, 1, 2);
    emit(0, 2, 3);
  } else {
    emit(0, 1, 3);
    emit(1, 2, 3);
  }
  return true;
}

bool PolygonSplitter::clip_ears(std::size_t n) {
  previous_.resize(n);
  next_.resize(n);
  blocks_.assign(n, 0);
  blocking_.clear();
  for (std::size_t i = 0; i < n; ++i) {
    previous_[i] = i == 0 ? n - 1 : i - 1;
    next_[i] = i + 1 == n ? 0 : i + 1;
  }
  for (std::size_t i = 0; i < n; ++i)
    if (!(turn(previous_[i], i, next_[i]) > 0)) {
      blocks_[i] = 1;
      blocking_.push_back(i);
    }
  tests_ = 0;

  std::size_t i = 0, refused = 0;
  for (std::size_t left = n; left > 3;) {
    if (!is_ear(i)) {
      i = next_[i];
      if (++refused < left && tests_ < kMostTests) continue;
      for (std::size_t j = next_[i]; next_[j] != i; j = next_[j]) emit(i, j, next_[j]);
      return false;
    }
    const std::size_t p = previous_[i], q = next_[i];
    emit(p, i, q);
    next_[p] = q;
    previous_[q] = p;
    blocks_[i] = 0;
    for (const std::size_t j : {p, q}) blocks_[j] = !(turn(previous_[j], j, next_[j]) > 0);
    i = next_[q];
    --left;
    refused = 0;
  }
  emit(previous_[i], i, next_[i]);
  return true;
}

bool PolygonSplitter::is_ear(std::size_t i) {
  const std::size_t p = previous_[i], q = next_[i];
  if (blocks_[i]) return false;
  for (std::size_t k = 0; k < blocking_.size();) {
    const std::size_t v = blocking_[k];
    if (!blocks_[v]) {
      blocking_[k] = blocking_.back();
      blocking_.pop_back();
      continue;
    }
    ++k;
    ++tests_;
    if (v == p || v == q || position(v) == position(p) || position(v) == position(i) || position(v) == position(q))
      continue;
    if (turn(p, i, v) >= 0 && turn(i, q, v) >= 0 && turn(q, p, v) >= 0) return false;
  }
  return true;
}

}  // namespace bisector
