// One table of words for each choice: what is parsed, what help lists and what reports say come from it.
#pragma once

#include <array>
#include <cstddef>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>

#include "bisector/error.h"

namespace bisector {

// The words of an enumeration, in the order in which they are listed. Made by word_table().
template <class E, std::size_t N>
struct WordTable {
  std::array<std::pair<E, std::string_view>, N> entries;

  // Throws std::logic_error for a value that the table lacks.
  std::string_view word_of(E value) const {
    for (const auto& [known, word] : entries)
      if (known == value) return word;
    throw std::logic_error("a value has no word");
  }

  // Throws Error, listing the words, for one that the table lacks.
  E parse(std::string_view text) const {
    for (const auto& [value, word] : entries)
      if (word == text) return value;
    throw Error("'" + std::string(text) + "' is none of " + list());
  }

  // "auto, single, double"
  std::string list() const {
    std::string words;
    for (const auto& [value, word] : entries) words += (words.empty() ? "" : ", ") + std::string(word);
    return words;
  }
};

// word_table<Precision>({{Precision::automatic, "auto"}, {Precision::single, "single"}})
template <class E, std::size_t N>
constexpr WordTable<E, N> word_table(const std::pair<E, std::string_view> (&entries)[N]) {
  return {std::to_array(entries)};
}

}  // namespace bisector
