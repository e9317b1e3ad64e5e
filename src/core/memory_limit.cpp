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

rlimit limit_of_data() {
  rlimit limit{};
  ::getrlimit(RLIMIT_DATA, &limit);
  return limit;
}

}  // namespace

void limit_memory(std::uint64_t bytes) {
  rlimit limit = limit_of_data();
  limit.rlim_cur = std::min<rlim_t>(bytes, limit.rlim_cur);
  ::setrlimit(RLIMIT_DATA, &limit);
}

std::uint64_t memory_limit() {
  const rlimit limit = limit_of_data();
  return limit.rlim_cur == RLIM_INFINITY ? 0 : limit.rlim_cur;
}

void share_memory_limit(pid_t child) {
  rlimit limit = limit_of_data();
  if (limit.rlim_cur == RLIM_INFINITY) return;
  limit.rlim_cur -= std::min<rlim_t>(limit.rlim_cur, bytes_held());
  ::prlimit(child, RLIMIT_DATA, &limit, nullptr);
}

}  // namespace bisector
