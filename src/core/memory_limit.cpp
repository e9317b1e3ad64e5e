#include "core/memory_limit.h"

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>

namespace bisector {
namespace {

std::uint64_t bytes_held() {
  std::ifstream file("/proc/self/statm");
  std::uint64_t size = 0, resident = 0, shared = 0, text = 0, library = 0, data = 0;
  file >> size >> resident >> shared >> text >> library >> data;
  return data * static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
}

}  // namespace

void limit_memory(std::uint64_t bytes) {
  rlimit limit{};
  ::getrlimit(RLIMIT_DATA, &limit);
  limit.rlim_cur = std::min<rlim_t>(bytes, limit.rlim_max);
  ::setrlimit(RLIMIT_DATA, &limit);
}

std::uint64_t memory_limit() {
  rlimit limit{};
  ::getrlimit(RLIMIT_DATA, &limit);
  return limit.rlim_cur == RLIM_INFINITY ? 0 : limit.rlim_cur;
}

void share_memory_limit(pid_t child) {
  const std::uint64_t limit = memory_limit();
  if (limit == 0) return;
  rlimit rest{};
  ::getrlimit(RLIMIT_DATA, &rest);
  rest.rlim_cur = limit - std::min(limit, bytes_held());
  ::prlimit(child, RLIMIT_DATA, &rest, nullptr);
}

}  // namespace bisector
