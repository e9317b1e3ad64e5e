// Options of a command line whose values are words: what cannot be read is bad usage.
#pragma once

#include <CLI/CLI.hpp>

#include <cstddef>
#include <string>

#include "bisector/error.h"
#include "core/words.h"

namespace bisector::job {

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

// An option whose word a parser turns into a value.
template <class Value, class Parse>
CLI::Option* add_parsed(CLI::App* app, const char* name, Value& value, const Parse& parse, const char* help) {
  return app
      ->add_option_function<std::string>(
          name, [&value, parse](const std::string& word) { value = parse(word); }, help)
      ->type_name("WORD")
      ->check(parsed_by(parse));
}

// An option whose words a table lists.
template <class E, std::size_t N>
CLI::Option* add_words(CLI::App* app, const char* name, E& value, const WordTable<E, N>& words, const char* help) {
  return add_parsed(
      app, name, value, [words](const std::string& word) { return words.parse(word); }, help);
}

}  // namespace bisector::job
