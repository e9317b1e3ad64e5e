#include "host/device/selftest.h"

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "host/device/commands.h"
#include "kernels/layout/push.h"

namespace bisector::host {
namespace {

// Fixed bits that look random: splitmix64.
std::uint64_t next_bits(std::uint64_t& state) {
  state += 0x9e3779b97f4a7c15;
  std::uint64_t z = state;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9;
  z = (z ^ (z >> 27)) * 0x94d049bb133111eb;
  return z ^ (z >> 31);
}

// Signed, with all bits of the significand and magnitudes from 2^-spread to 2^spread.
template <class Real>
Real random_value(std::uint64_t& state, int spread) {
  const double fraction = std::ldexp(static_cast<double>(next_bits(state) >> 11), -53) + 1;
  const int exponent = static_cast<int>(next_bits(state) % (2 * spread + 1)) - spread;
  return static_cast<Real>(std::ldexp(next_bits(state) & 1 ? -fraction : fraction, exponent));
}

template <class Real>
std::vector<std::array<Real, 2>> random_pairs(std::size_t count, int spread) {
  std::vector<std::array<Real, 2>> pairs;
  std::uint64_t state = 1;
  for (std::size_t i = 0; i < count; ++i) {
    const Real a = random_value<Real>(state, spread);
    pairs.push_back({a, random_value<Real>(state, spread)});
  }
  return pairs;
}

// Pairs whose results are subnormal, halfway cases, or sums that lose bits.
std::vector<std::array<double, 2>> telling_pairs() {
  constexpr double kSmallest = std::numeric_limits<double>::denorm_min();
  constexpr double kNormal = std::numeric_limits<double>::min();
  constexpr double kUlp = std::numeric_limits<double>::epsilon();
  return {{kNormal, -1.5 * kNormal},
          {kNormal, 0.5},
          {kSmallest, kSmallest},
          {kSmallest, 1},
          {1, kUlp / 2},
          {1 + kUlp, kUlp / 2},
          {1, -kUlp / 4},
          {1 + kUlp, 1 - kUlp / 2},
          {1 + kUlp, 1 + kUlp},
          {0x1p53, 1},
          {0x1p53, 3},
          {0x1p100, -0x1p-100},
          {1, -1},
          {-0.0, 0.0},
          {-0.0, -0.0},
          {1.0 / 3, 3},
          {0.1, 10},
          {1e-160, 1e-160},
          {-1e-155, 3e-155},
          {1 + 0x1p-27, 1 + 0x1p-26}};
}

template <class Result, class Pair>
std::vector<Result> run(Device& device, const char* kernel, const std::vector<Pair>& pairs) {
  std::vector<Result> results(pairs.size());
  Buffer input(device), output(device);
  input.reserve(pairs.size() * sizeof(Pair));
  output.reserve(results.size() * sizeof(Result));
  Commands commands(device);
  commands.upload(input, 0, pairs.data(), pairs.size() * sizeof(Pair));
  commands.dispatch({kernel, {}}, {reads(input), writes(output)}, CountPush{static_cast<std::uint32_t>(pairs.size())},
                    pairs.size());
  commands.download(output, 0, results.data(), results.size() * sizeof(Result));
  commands.run();
  return results;
}

double two_sum_error(double a, double b) {
  const double sum = a + b;
  const double virtual_b = sum - a;
  const double virtual_a = sum - virtual_b;
  return (a - virtual_a) + (b - virtual_b);
}

std::array<double, 2> split(double a) {
  const double c = 134217729.0 * a;
  const double high = c - (c - a);
  return {high, a - high};
}

double two_product_error(double a, double b) {
  const auto [a_high, a_low] = split(a);
  const auto [b_high, b_low] = split(b);
  return a_high * b_high - a * b + a_low * b_high + a_high * b_low + a_low * b_low;
}

// What kernels/real.glsl says of it.
double reciprocal(double d) { return d == 0 || std::abs(std::ilogb(d)) > 1000 ? 0.0 : 1 / d; }

// The words that kernels/selftest.comp writes for a pair in double precision.
std::array<std::uint64_t, 9> expected(double a, double b) {
  const auto first_word = static_cast<std::int32_t>(static_cast<std::uint32_t>(std::bit_cast<std::uint64_t>(a)));
  const auto second_word = static_cast<std::int32_t>(static_cast<std::uint32_t>(std::bit_cast<std::uint64_t>(b)));
  const auto cut = static_cast<std::uint32_t>(static_cast<std::int32_t>(second_word * 0.25));
  const double product = a * b;
  return {std::bit_cast<std::uint64_t>(a + b),
          std::bit_cast<std::uint64_t>(a - b),
          std::bit_cast<std::uint64_t>(product),
          std::bit_cast<std::uint64_t>(product + b),
          std::bit_cast<std::uint64_t>(two_sum_error(a, b)),
          std::bit_cast<std::uint64_t>(two_product_error(a, b)),
          std::bit_cast<std::uint64_t>(static_cast<double>(first_word)),
          std::uint64_t{a < b} << 32 | cut,
          std::bit_cast<std::uint64_t>(reciprocal(a))};
}

constexpr float kSmallestNormal = std::numeric_limits<float>::min();

float flushed(float x) { return std::abs(x) < kSmallestNormal ? std::copysign(0.0f, x) : x; }

// Whether a result is right to one ulp, in whatever direction it was rounded. Subnormal numbers may be flushed to 0,
// which no bound relies on.
template <class Operation>
bool is_near(float result, const SinglePair& pair, Operation operation) {
  for (const bool flushes : {false, true}) {
    const double a = flushes ? flushed(pair[0]) : pair[0], b = flushes ? flushed(pair[1]) : pair[1];
    const double exact = operation(a, b), size = std::abs(exact);
    if (std::abs(result - exact) <= 0x1p-23 * size + (size < kSmallestNormal ? 0x1p-149 : 0)) return true;
    if (flushes && size < kSmallestNormal && result == 0) return true;
  }
  return false;
}

bool is_subnormal(double x) { return x != 0 && std::abs(x) < kSmallestNormal; }

// Nine sums and products of pairs make what kernels/clipper.glsl allows an error of 4e-12 for.
bool is_pair_near(const std::array<float, 2>& pair, double exact, double size) {
  return std::abs((static_cast<double>(pair[0]) - exact) + pair[1]) <= 0x1p-42 * size;
}

}  // namespace

std::string fault_in_single(const SinglePair& pair, const SingleResults& r) {
  const double a = pair[0], b = pair[1];
  const auto plus = [](double x, double y) { return x + y; };
  const auto minus = [](double x, double y) { return x - y; };
  const auto times = [](double x, double y) { return x * y; };
  const bool tiny =
      is_subnormal(a) || is_subnormal(b) || is_subnormal(a + b) || is_subnormal(a - b) || is_subnormal(a * b);
  const std::string which =
      tiny ? "with subnormal numbers in single precision are wrong" : "in single precision are wrong";
  if (!is_near(r.sum, pair, plus)) return "its sums " + which;
  if (!is_near(r.difference, pair, minus)) return "its differences " + which;
  if (!is_near(r.product, pair, times)) return "its products " + which;
  // The parts of pairs are far from where numbers end, or their low halves would be subnormal.
  constexpr double kLeast = 0x1p-70;
  if (std::abs(a) < kLeast || std::abs(b) < kLeast || std::abs(a * b) < kLeast) return {};
  if (!is_pair_near(r.pair_sum, a + b, std::abs(a) + std::abs(b)) ||
      !is_pair_near(r.pair_product, a * b, std::abs(a * b)))
    return "its error terms in single precision are wrong";
  if (!(std::abs(r.reciprocal * a - 1) <= 2.5 * 0x1p-23)) return "its reciprocals in single precision are wrong";
  return {};
}

std::vector<SinglePair> single_pairs() {
  constexpr float kSmallest = std::numeric_limits<float>::denorm_min();
  auto pairs = random_pairs<float>(1024, 30);
  const std::vector<SinglePair> tiny{{kSmallestNormal, -1.5f * kSmallestNormal},
                                     {kSmallestNormal, 0.5f},
                                     {kSmallestNormal, 0.375f},
                                     {3 * kSmallest, kSmallest},
                                     {3 * kSmallest, 0x1p40f},
                                     {kSmallest, 1.0f},
                                     {0x1p-70f, 0x1.8p-60f},
                                     {-0x1p-75f, 0x1p-74f}};
  pairs.insert(pairs.end(), tiny.begin(), tiny.end());
  return pairs;
}

std::string selftest_single(Device& device) {
  const std::vector<SinglePair> pairs = single_pairs();
  const auto results = run<SingleResults>(device, "selftest_single", pairs);
  for (std::size_t i = 0; i < pairs.size(); ++i)
    if (std::string fault = fault_in_single(pairs[i], results[i]); !fault.empty()) return fault;
  return {};
}

bool selftest_double(Device& device) {
  auto pairs = random_pairs<double>(1024, 40);
  const auto telling = telling_pairs();
  pairs.insert(pairs.end(), telling.begin(), telling.end());
  const auto results = run<std::array<std::uint64_t, 9>>(device, "selftest_double", pairs);
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (results[i] != expected(pairs[i][0], pairs[i][1])) return false;
  }
  return true;
}

}  // namespace bisector::host
