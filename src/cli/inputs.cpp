#include "inputs.h"

#include <fmt/format.h>

#include "bisector/error.h"
#include "bisector/io.h"
#include "console.h"

namespace bisector::cli {

std::vector<Vec3> read_seeds(const std::string& path, std::size_t count) {
  std::vector<Vec3> seeds = read_points(path);
  if (count != 0 && count != seeds.size())
    throw Error(fmt::format("{}: {} in the file, but -n asks for {}; leave -n out", path,
                            counted(seeds.size(), "seed", "seeds"), count));
  return seeds;
}

}  // namespace bisector::cli
