// Handles of the C interface. What a caller holds is a number that looks like a pointer and is never used twice, so a
// handle that was freed, or is of another kind, is recognised; what it stands for lives until nobody uses it.
#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <stdexcept>
#include <string>
#include <unordered_map>

namespace bisector::c {

// A fault of the calling program.
class Misuse : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

class Object {
 public:
  virtual ~Object() = default;
};

class Handles {
 public:
  // Lives as long as the process: threads may still run while it ends.
  static Handles& all() {
    static auto* const handles = new Handles;
    return *handles;
  }

  void* add(std::shared_ptr<Object> object) {
    const std::lock_guard lock(mutex_);
    objects_.emplace(++last_, std::move(object));
    return pointer(last_);
  }

  // Throws Misuse.
  template <class Kind>
  std::shared_ptr<Kind> get(const void* handle, const char* kind) {
    const std::lock_guard lock(mutex_);
    const auto at = objects_.find(number(handle));
    auto object = at == objects_.end() ? nullptr : std::dynamic_pointer_cast<Kind>(at->second);
    if (!object) throw Misuse("this is no handle of " + std::string(kind) + ", or it was freed");
    return object;
  }

  template <class Kind>
  void remove(const void* handle, const char* kind) {
    if (!handle) return;
    const std::shared_ptr<Kind> object = get<Kind>(handle, kind);  // destroyed without the lock
    const std::lock_guard lock(mutex_);
    objects_.erase(number(handle));
  }

 private:
  static constexpr std::uintptr_t kStep = 16;

  static void* pointer(std::uintptr_t n) { return reinterpret_cast<void*>(n * kStep); }
  static std::uintptr_t number(const void* handle) {
    const auto address = reinterpret_cast<std::uintptr_t>(handle);
    return address % kStep == 0 ? address / kStep : 0;
  }

  std::mutex mutex_;
  std::uintptr_t last_ = 0;
  std::unordered_map<std::uintptr_t, std::shared_ptr<Object>> objects_;
};

}  // namespace bisector::c
