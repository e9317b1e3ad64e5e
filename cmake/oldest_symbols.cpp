// Functions of glibc in versions that older systems have, too. hypot() of glibc 2.35 differs from the one before in
// not setting errno by way of a handler, which nothing here installs; on one system both give the same bits.
extern "C" double oldest_hypot(double x, double y);
__asm__(".symver oldest_hypot, hypot@GLIBC_2.2.5");

// The linker's --wrap=hypot sends all calls here.
extern "C" double __wrap_hypot(double x, double y);
extern "C" double __wrap_hypot(double x, double y) { return oldest_hypot(x, y); }
