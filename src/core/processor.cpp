#include "core/processor.h"

#include <fstream>

namespace bisector {

std::string processor_name() {
  std::ifstream info("/proc/cpuinfo");
  for (std::string line; std::getline(info, line);)
    if (line.starts_with("model name"))
      if (const std::size_t begin = line.find_first_not_of(" \t:", 10); begin != std::string::npos)
        return line.substr(begin);
  return "CPU";
}

}  // namespace bisector
