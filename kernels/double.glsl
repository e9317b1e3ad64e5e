// Arithmetic in double precision, for kernels that are built in it alone.
#define BISECTOR_DOUBLE 1
#include "real.glsl"
