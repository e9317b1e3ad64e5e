// The page of a report: one file that needs no network.
#pragma once

#include <string>

#include "view/scene.h"

namespace bisector::view {

// HTML. `report` is the report as JSON.
std::string report_page(const std::string& title, const std::string& report, const Scene& scene);

}  // namespace bisector::view
