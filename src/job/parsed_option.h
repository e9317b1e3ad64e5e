// Options of a command line whose values are words: what cannot be read is bad usage. Values that can be listed are
// kept with the option, for completion.
#pragma once

#include <CLI/CLI.hpp>

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "bisector/error.h"
#include "core/words.h"

namespace bisector::job {

// What completion offers for the value of an option.
struct OptionValues {
  std::vector<std::string> words;  // more may follow one that ends with a colon
  bool file = false;
  std::vector<std::string> extensions;  // of files, with the dot; empty: any name
};

// The validator with values that values_of() finds.
CLI::Validator with_values(CLI::Validator validator, const OptionValues& values);
OptionValues values_of(CLI::Option& option);

// What a parser takes that throws Error for anything else.
template <class Parse>
CLI::Validator parsed_by(const Parse& parse) {
  return CLI::Validator(
      [parse](std::string& text) -> std::string {
        try {
          parse(text);
          return {};
        } catch (const Error& error) {
          return error.what();
        }
      },
      "");
}

// An option whose word a parser turns into a value; `words` are those that can be listed.
template <class Value, class Parse>
CLI::Option* add_parsed(CLI::App* app, const char* name, Value& value, const Parse& parse, const char* help,
                        std::vector<std::string> words) {
  return app
      ->add_option_function<std::string>(
          name, [&value, parse](const std::string& word) { value = parse(word); }, help)
      ->type_name("WORD")
      ->check(with_values(parsed_by(parse), {std::move(words), false, {}}));
}

// An option whose words a table lists.
template <class E, std::size_t N>
CLI::Option* add_words(CLI::App* app, const char* name, E& value, const WordTable<E, N>& words, const char* help) {
  std::vector<std::string> listed;
  for (const auto& entry : words.entries) listed.emplace_back(entry.second);
  return add_parsed(
      app, name, value, [words](const std::string& word) { return words.parse(word); }, help, std::move(listed));
}

}  // namespace bisector::job
