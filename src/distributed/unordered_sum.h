// Sums over ranks that do not depend on how their terms are divided among these.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "distributed/ranks.h"

namespace bisector {

// A sum of whole multiples of a unit that is 2^-60 of the largest term or less.
class UnorderedSum {
 public:
  explicit UnorderedSum(double largest) : exponent_(std::ilogb(largest) - kBits) {}
  void add(double term) { sum_ += static_cast<Whole>(std::llround(std::ldexp(term, -exponent_))); }

  struct Words {
    std::uint64_t high, low;
  };
  Words words() const { return {static_cast<std::uint64_t>(sum_ >> 64), static_cast<std::uint64_t>(sum_)}; }
  void add(const Words& words) { sum_ += static_cast<Whole>(words.high) << 64 | words.low; }
  double value() const { return std::ldexp(static_cast<double>(sum_), exponent_); }

 private:
  __extension__ using Whole = __int128;
  static constexpr int kBits = 60;
  int exponent_;
  Whole sum_ = 0;
};

// Of term(k) for k below this rank's n, over all ranks; 0 if no term is positive.
template <class Term>
double sum_of_all(Ranks& ranks, std::size_t n, const Term& term) {
  double largest = 0;
  for (std::size_t k = 0; k < n; ++k) largest = std::max(largest, std::abs(term(k)));
  for (const double of_rank : ranks.gather(largest)) largest = std::max(largest, of_rank);
  if (!(largest > 0)) return 0;
  UnorderedSum mine(largest), all(largest);
  for (std::size_t k = 0; k < n; ++k) mine.add(term(k));
  for (const UnorderedSum::Words& words : ranks.gather(mine.words())) all.add(words);
  return all.value();
}

}  // namespace bisector
