// What is included once for each set of instructions, each time in a namespace that has kWidth: that many numbers in one
// register, and truth values as all or no bits of 64. Every operation rounds each lane as it does single numbers,
// whatever the width.

typedef double Numbers __attribute__((vector_size(kWidth * sizeof(double)), may_alias));
typedef std::int64_t Masks __attribute__((vector_size(kWidth * sizeof(std::int64_t)), may_alias));
struct Lanes3 {
  Numbers x, y, z;
};

inline Lanes3 operator+(const Lanes3& a, const Lanes3& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline Lanes3 operator-(const Lanes3& a, const Lanes3& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline Lanes3 times(const Numbers& s, const Lanes3& a) { return {s * a.x, s * a.y, s * a.z}; }
inline Numbers dot(const Lanes3& a, const Lanes3& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline Lanes3 cross(const Lanes3& a, const Lanes3& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline Numbers norm2(const Lanes3& a) { return dot(a, a); }
inline Numbers largest(const Numbers& a, const Numbers& b) { return a < b ? b : a; }
inline Numbers least(const Numbers& a, const Numbers& b) { return b < a ? b : a; }
inline Numbers absolute(const Numbers& a) { return a < 0 ? -a : a; }
inline Lanes3 select(const Masks& mask, const Lanes3& a, const Lanes3& b) {
  return {mask ? a.x : b.x, mask ? a.y : b.y, mask ? a.z : b.z};
}
