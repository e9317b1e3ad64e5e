#include "core/temporary_name.h"

#include <fmt/format.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdint>
#include <system_error>

namespace bisector {

std::string temporary_name() {
  // Not std::random_device: current C++ libraries call a function for it that older systems lack.
  std::array<std::uint64_t, 2> words{};
  if (getentropy(words.data(), sizeof words) != 0)
    throw std::system_error(errno, std::generic_category(), "the system gives no random numbers");
  return fmt::format(".bisector-{:016x}{:016x}.tmp", words[0], words[1]);
}

}  // namespace bisector
