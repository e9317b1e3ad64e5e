#include "host/device/modules.h"

#include <algorithm>
#include <cstddef>
#include <mutex>
#include <stdexcept>
#include <string>
#include <vector>

namespace bisector::host {
namespace {

struct Tables {
  std::mutex mutex;
  std::vector<std::span<const Module>> all{kernel_modules};
};

Tables& tables() {
  static Tables instance;
  return instance;
}

}  // namespace

void register_modules(std::span<const Module> modules) {
  const std::lock_guard lock(tables().mutex);
  tables().all.push_back(modules);
}

std::span<const std::uint32_t> module_words(std::string_view name) {
  const std::lock_guard lock(tables().mutex);
  for (const std::span<const Module> table : tables().all) {
    const auto found = std::ranges::find(table, name, &Module::name);
    if (found != table.end()) return found->words;
  }
  throw std::logic_error("no kernel is called " + std::string(name));
}

std::vector<std::uint32_t> without_loop_control(std::span<const std::uint32_t> words) {
  constexpr std::size_t kHeader = 5;
  constexpr std::uint32_t kLoopMerge = 246, kOpcodeMask = 0xffff, kLengthShift = 16;
  std::vector<std::uint32_t> result(words.begin(), words.end());
  for (std::size_t at = kHeader; at < result.size(); at += result[at] >> kLengthShift) {
    // The merge block, the block to continue at, the control.
    if ((result[at] & kOpcodeMask) == kLoopMerge) result[at + 3] = 0;
  }
  return result;
}

}  // namespace bisector::host
