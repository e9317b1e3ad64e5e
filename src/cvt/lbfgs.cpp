#include "cvt/lbfgs.h"

#include <algorithm>
#include <cmath>
#include <iterator>

namespace bisector {

void Lbfgs::push(double sy, double ss, double yy) {
  if (!(sy > 1e-10 * std::sqrt(ss * yy))) return;
  if (pairs_.size() == memory_) pairs_.pop_front();
  pairs_.push_back({next_, sy, 1 / sy});
  next_ = (next_ + 1) % (memory_ + 1);
}

std::vector<std::size_t> Lbfgs::numbers() const {
  std::vector<std::size_t> numbers;
  for (const Pair& pair : pairs_) numbers.push_back(pair.number);
  return numbers;
}

void Lbfgs::write(ByteWriter& out) const { out.put(next_).put_all(std::vector<Pair>(pairs_.begin(), pairs_.end())); }

void Lbfgs::read(ByteReader& in) {
  std::vector<Pair> pairs;
  in.get(next_);
  in.get_all(pairs);
  const auto is_wrong = [&](const Pair& pair) { return pair.number > memory_; };
  if (next_ > memory_ || pairs.size() > memory_ || std::any_of(pairs.begin(), pairs.end(), is_wrong))
    throw Error("the checkpoint's optimiser remembers more steps than this one");
  pairs_.assign(pairs.begin(), pairs.end());
}

void Lbfgs::set_direction(DescentVectors& vectors) const {
  vectors.start_direction();
  for (auto pair = pairs_.rbegin(); pair != pairs_.rend(); ++pair) {
    vectors.project(pair->number, PairPart::step, pair->rho, false);
    vectors.add(pair->number, PairPart::change);
  }
  if (pairs_.empty()) vectors.weigh({}, 0);
  else vectors.weigh(pairs_.back().number, pairs_.back().sy);
  for (const Pair& pair : pairs_) {
    vectors.project(pair.number, PairPart::change, pair.rho, true);
    vectors.add(pair.number, PairPart::step);
  }
}

}  // namespace bisector
