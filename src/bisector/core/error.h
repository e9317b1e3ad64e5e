// The two exceptions that leave the library.
#pragma once

#include <stdexcept>
#include <string>

namespace bisector {

// Bad input or a failed run. what() is one line: what is wrong, where, and what to do.
class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// The caller's cancel flag was set; nothing was written.
class Cancelled : public std::runtime_error {
 public:
  Cancelled() : std::runtime_error("cancelled") {}
};

}  // namespace bisector
