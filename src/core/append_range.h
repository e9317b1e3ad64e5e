// A part of one vector at the end of another.
#pragma once

#include <cstddef>
#include <vector>

namespace bisector {

template <class T>
void append_range(std::vector<T>& to, const std::vector<T>& from, std::size_t begin, std::size_t end) {
  const auto at = [](std::size_t k) { return static_cast<std::ptrdiff_t>(k); };
  to.insert(to.end(), from.begin() + at(begin), from.begin() + at(end));
}

}  // namespace bisector
