// The version of the headers. CMakeLists.txt reads it from here. Versions with the same major and minor number link
// alike.
#pragma once

#define BISECTOR_VERSION_MAJOR 0
#define BISECTOR_VERSION_MINOR 1
#define BISECTOR_VERSION_PATCH 0
