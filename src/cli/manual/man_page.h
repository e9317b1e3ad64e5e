// Manual pages in man(7).
#pragma once

#include <string>
#include <vector>

#include "cli/manual/entry.h"
#include "cli/manual/environment.h"

namespace bisector::cli::manual {

// The page of entries[which]; `date` is YYYY-MM-DD.
std::string man_page(const std::vector<Entry>& entries, std::size_t which,
                     const std::vector<EnvironmentVariable>& environment, const std::string& date);

}  // namespace bisector::cli::manual
