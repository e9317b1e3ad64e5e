// The exceptions that leave the library.
#pragma once

#include <stdexcept>
#include <string>

namespace bisector {

// Bad input or a failed run. what() is one line: what is wrong, where, and what to do.
class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// A compute device is missing, was lost, or has run out of memory. Nothing it computed is used.
class DeviceError : public Error {
 public:
  using Error::Error;
};

// The caller's cancel flag was set; nothing was written.
class Cancelled : public std::runtime_error {
 public:
  Cancelled() : std::runtime_error("cancelled") {}
};

}  // namespace bisector
