#include "job/messages.h"

#include <fmt/format.h>

#include <system_error>

namespace bisector::job {

std::string one_line(std::string_view text) {
  std::string line(text);
  for (char& c : line)
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) c = ' ';
  return line;
}

std::string counted(std::size_t n, const char* one, const char* many) {
  return fmt::format("{} {}", n, n == 1 ? one : many);
}

std::string describe(const MeshTopology& topology) {
  return fmt::format("{}, {}, {}, {}, Euler characteristic {}", topology.manifold ? "manifold" : "not manifold",
                     topology.closed ? "closed" : "open", topology.oriented ? "oriented" : "not oriented",
                     counted(topology.components, "component", "components"), topology.euler);
}

std::string with_advice(const Error& error) {
  const std::string what = error.what();
  switch (error.reason()) {
    case Reason::other: break;
    case Reason::no_such_device: return "--device " + what + "; see 'bisector devices'";
    // Some say already after a semicolon what would help.
    case Reason::device_failed:
      return what + (what.find("; ") == std::string::npos ? "; use --device cpu" : ", or use --device cpu");
    case Reason::no_single_precision: return "--precision single: " + what + "; use --precision double or a device";
    case Reason::no_double_precision: return what + "; use --precision single";
    case Reason::open_surface: return what + " (--weld), or wrap it (--wrap)";
    case Reason::no_solid: return what + ", or wrap it (--wrap)";
  }
  return what;
}

bool wants_thread(const std::exception& error) {
  if (const auto* system = dynamic_cast<const std::system_error*>(&error))
    return system->code() == std::errc::resource_unavailable_try_again;
  return std::string_view(error.what()).starts_with("pthread_create");  // TBB's, of no type of its own
}

}  // namespace bisector::job
