// The targets for libFuzzer: BISECTOR_FUZZ_TARGET names the one to run.
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>

#include "fuzz/target.h"

namespace {

const bisector::fuzz::Target* chosen = nullptr;

}  // namespace

extern "C" int LLVMFuzzerInitialize(int*, char***) {
  const char* name = std::getenv("BISECTOR_FUZZ_TARGET");
  for (const bisector::fuzz::Target& target : bisector::fuzz::targets())
    if (name && target.name == name) chosen = &target;
  if (!chosen) {
    std::fprintf(stderr, "BISECTOR_FUZZ_TARGET has to be one of:\n");
    for (const bisector::fuzz::Target& target : bisector::fuzz::targets())
      std::fprintf(stderr, "%s\n", target.name.c_str());
    std::exit(2);
  }
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  chosen->run({reinterpret_cast<const char*>(data), size});
  return 0;
}
