// The SPIR-V modules that the library was built with.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>

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

}  // namespace bisector::host
