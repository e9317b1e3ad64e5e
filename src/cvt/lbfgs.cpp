#include "cvt/lbfgs.h"

#include "core/parallel.h"

namespace bisector {
namespace {

void add_scaled(std::vector<Vec3>& a, double t, const std::vector<Vec3>& b) {
  parallel_each(
      a.size(), [&](std::size_t i) { a[i] += t * b[i]; }, 4096);
}

}  // namespace

double inner(const std::vector<Vec3>& a, const std::vector<Vec3>& b) {
  return fixed_sum(a.size(), [&](std::size_t i) { return dot(a[i], b[i]); });
}

void Lbfgs::push(std::vector<Vec3> s, std::vector<Vec3> y) {
  const double sy = inner(s, y);
  if (!(sy > 1e-10 * std::sqrt(inner(s, s) * inner(y, y)))) return;
  if (pairs_.size() == memory_) pairs_.pop_front();
  pairs_.push_back({std::move(s), std::move(y), sy});
}

std::vector<Vec3> Lbfgs::direction(const std::vector<Vec3>& g, const std::vector<double>& d) const {
  std::vector<Vec3> q = g;
  std::vector<double> alpha(pairs_.size());
  for (std::size_t k = pairs_.size(); k-- > 0;) {
    alpha[k] = inner(pairs_[k].s, q) / pairs_[k].sy;
    add_scaled(q, -alpha[k], pairs_[k].y);
  }
  double gamma = 1;
  if (!pairs_.empty()) {
    const Pair& last = pairs_.back();
    gamma = last.sy / fixed_sum(d.size(), [&](std::size_t i) { return norm2(last.y[i]) / d[i]; });
  }
  parallel_each(
      q.size(), [&](std::size_t i) { q[i] *= gamma / d[i]; }, 4096);
  for (std::size_t k = 0; k < pairs_.size(); ++k)
    add_scaled(q, alpha[k] - inner(pairs_[k].y, q) / pairs_[k].sy, pairs_[k].s);
  parallel_each(
      q.size(), [&](std::size_t i) { q[i] = -q[i]; }, 4096);
  return q;
}

}  // namespace bisector
