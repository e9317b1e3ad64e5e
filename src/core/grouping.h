// Sorting values into the rows of a Csr by counting; within a row they keep the order in which they come. Triangles as
// rows.
#pragma once

#include <atomic>
#include <cstddef>
#include <numeric>
#include <vector>

#include "bisector/mesh.h"
#include "core/parallel.h"

namespace bisector {

// `list(put)` calls put(row, value) for every value, row being below `rows`. It is called twice, to count and to fill,
// and must list the same both times.
template <class T, class List>
Csr<T> group_into_rows(std::size_t rows, const List& list) {
  Csr<T> grouped;
  grouped.offsets.assign(rows + 1, 0);
  list([&](std::size_t row, const T&) { ++grouped.offsets[row + 1]; });
  std::partial_sum(grouped.offsets.begin(), grouped.offsets.end(), grouped.offsets.begin());
  grouped.values.resize(grouped.offsets.back());
  std::vector<std::size_t> next(grouped.offsets.begin(), grouped.offsets.end() - 1);
  list([&](std::size_t row, const T& value) { grouped.values[next[row]++] = value; });
  return grouped;
}

// The same in parallel for values 0 to count - 1; the order within a row is any.
template <class T, class RowOf, class ValueOf>
Csr<T> scatter_into_rows(std::size_t rows, std::size_t count, const RowOf& row_of, const ValueOf& value_of) {
  constexpr std::size_t kChunk = 16384;
  Csr<T> grouped;
  grouped.offsets.assign(rows + 1, 0);
  const auto take = [](std::size_t& counter) {
    return std::atomic_ref<std::size_t>(counter).fetch_add(1, std::memory_order_relaxed);
  };
  parallel_each(
      count, [&](std::size_t i) { take(grouped.offsets[row_of(i) + 1]); }, kChunk);
  std::partial_sum(grouped.offsets.begin(), grouped.offsets.end(), grouped.offsets.begin());
  grouped.values.resize(grouped.offsets.back());
  std::vector<std::size_t> next(grouped.offsets.begin(), grouped.offsets.end() - 1);
  parallel_each(
      count, [&](std::size_t i) { grouped.values[take(next[row_of(i)])] = value_of(i); }, kChunk);
  return grouped;
}

// A row of three corners for each triangle.
inline Csr<Index> rows_of(const std::vector<Triangle>& triangles) {
  Csr<Index> rows;
  rows.values.reserve(3 * triangles.size());
  rows.offsets.reserve(triangles.size() + 1);
  for (const Triangle& t : triangles) {
    rows.values.insert(rows.values.end(), t.begin(), t.end());
    rows.offsets.push_back(rows.values.size());
  }
  return rows;
}

// For each vertex the indices of the items (edges, triangles, tetrahedra) that have it as a corner, ascending.
template <class T, class Item>
Csr<T> items_at_vertices(const std::vector<Item>& items, std::size_t vertex_count) {
  return group_into_rows<T>(vertex_count, [&](const auto& put) {
    for (std::size_t i = 0; i < items.size(); ++i)
      for (const Index v : items[i]) put(v, static_cast<T>(i));
  });
}

// For each label below `label_count` the indices of the items that have it, ascending.
template <class T>
Csr<T> items_of_labels(const std::vector<Index>& labels, std::size_t label_count) {
  return group_into_rows<T>(label_count, [&](const auto& put) {
    for (std::size_t i = 0; i < labels.size(); ++i) put(labels[i], static_cast<T>(i));
  });
}

}  // namespace bisector
