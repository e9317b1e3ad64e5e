// The SPIR-V modules that the library was built with.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

namespace bisector::host {

struct Module {
  std::string_view name;
  std::span<const std::uint32_t> words;
};

// Those of kernels/; generated.
extern const std::span<const Module> kernel_modules;

// Adds modules, for tests with kernels of their own; they must outlive every use.
void register_modules(std::span<const Module> modules);

// Throws std::logic_error if there is no such module.
std::span<const std::uint32_t> module_words(std::string_view name);

// The module without what its loops ask for, such as to be unrolled (SPIR-V 1.5, section 3.23, Loop Control).
std::vector<std::uint32_t> without_loop_control(std::span<const std::uint32_t> words);

}  // namespace bisector::host
