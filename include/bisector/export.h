// Marks what leaves the library; everything else is hidden. Classes that are thrown carry the mark, too: a handler in
// another shared object then recognises them.
#pragma once

#if defined(__GNUC__)
#define BISECTOR_API __attribute__((visibility("default")))
#else
#define BISECTOR_API
#endif
