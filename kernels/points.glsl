// Points as they lie in buffers. Beside each seed's index (`ids`) are the low words of its coordinates as doubles: with
// them equality is told in single precision too.

bool same_coordinate(Point a, uvec3 low_a, Point b, uvec3 low_b, int k) {
#if BISECTOR_DOUBLE
  return a.high[k] == b.high[k];
#else
  return a.high[k] == b.high[k] && a.low[k] == b.low[k] && low_a[k] == low_b[k];
#endif
}

#if BISECTOR_DOUBLE
#define LOAD_POINT(name, data)                                                                                    \
  Point name(uint i) {                                                                                            \
    Point p;                                                                                                      \
    p.high = real3(data[kPointWords * i], data[kPointWords * i + 1], data[kPointWords * i + 2]);                  \
    return p;                                                                                                     \
  }
#else
#define LOAD_POINT(name, data)                                                                                    \
  Point name(uint i) {                                                                                            \
    Point p;                                                                                                      \
    p.high = real3(data[kPointWords * i], data[kPointWords * i + 1], data[kPointWords * i + 2]);                  \
    p.low = real3(data[kPointWords * i + 3], data[kPointWords * i + 4], data[kPointWords * i + 5]);               \
    return p;                                                                                                     \
  }
#endif
