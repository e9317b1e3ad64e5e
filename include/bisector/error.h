// The exceptions that leave the library.
#pragma once

#include <stdexcept>
#include <string>

#include "bisector/export.h"

namespace bisector {

// Why a run failed, where other options would help: the caller knows what its users call them.
enum class Reason {
  other,                // what() says all that is known
  no_such_device,       // there is none that fits the request, or it cannot be used
  device_failed,        // the device was lost, or lacks memory, capacity or a driver
  no_single_precision,  // the CPU computes in double precision only
  no_double_precision,  // the device computes in single precision only
  open_surface,         // the surface has borders, which welding or wrapping may close
  no_solid,             // the surface bounds no solid for another reason; wrapping gives one that does
};

// Bad input or a failed run. what() is one line: what is wrong, where, and what to do.
class BISECTOR_API Error : public std::runtime_error {
 public:
  explicit Error(const std::string& what, Reason reason = Reason::other) : std::runtime_error(what), reason_(reason) {}
  Reason reason() const { return reason_; }

 private:
  Reason reason_;
};

// A compute device is missing, was lost, or has run out of memory. Nothing it computed is used.
class BISECTOR_API DeviceError : public Error {
 public:
  explicit DeviceError(const std::string& what, Reason reason = Reason::device_failed) : Error(what, reason) {}
};

// The caller's cancel flag was set; nothing was written.
class BISECTOR_API Cancelled : public std::runtime_error {
 public:
  Cancelled() : std::runtime_error("cancelled") {}
};

}  // namespace bisector
