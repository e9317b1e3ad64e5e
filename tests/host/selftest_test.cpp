// The judgement of a device's arithmetic in single precision: what devices may do passes, what they may not is named.
#include "host/device/selftest.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <vector>

namespace bisector::host {
namespace {

using Flush = std::function<float(float)>;

float kept(float x) { return x; }
float flushed(float x) { return std::abs(x) < std::numeric_limits<float>::min() ? std::copysign(0.0f, x) : x; }

float next(float x) { return std::nextafter(x, std::numeric_limits<float>::infinity()); }

// One that rounds to nearest, with or without subnormal numbers.
SingleResults answers(const SinglePair& pair, const Flush& flush) {
  const float a = flush(pair[0]), b = flush(pair[1]), sum = flush(a + b), product = flush(a * b);
  const double exact_sum = static_cast<double>(a) + b, exact_product = static_cast<double>(a) * b;
  return {sum,
          flush(a - b),
          product,
          {sum, flush(static_cast<float>(exact_sum - sum))},
          {product, flush(static_cast<float>(exact_product - product))},
          flush(1 / a)};
}

std::string fault_of(const Flush& flush, const std::function<void(const SinglePair&, SingleResults&)>& change) {
  for (const SinglePair& pair : single_pairs()) {
    SingleResults results = answers(pair, flush);
    change(pair, results);
    if (std::string fault = fault_in_single(pair, results); !fault.empty()) return fault;
  }
  return {};
}

TEST(Selftest, SubnormalNumbersMayBeFlushed) {
  EXPECT_EQ(fault_of(kept, [](const SinglePair&, SingleResults&) {}), "");
  EXPECT_EQ(fault_of(flushed, [](const SinglePair&, SingleResults&) {}), "");
}

TEST(Selftest, TheDirectionOfRoundingIsFree) {
  const auto to_zero = [](double x) {
    const float near = static_cast<float>(x);
    return std::abs(near) > std::abs(x) ? std::nextafter(near, 0.0f) : near;
  };
  const auto upwards = [](double x) {
    const float near = static_cast<float>(x);
    return near < x ? next(near) : near;
  };
  for (const auto& rounded : std::vector<std::function<float(double)>>{to_zero, upwards}) {
    EXPECT_EQ(fault_of(kept,
                       [&](const SinglePair& pair, SingleResults& r) {
                         const double a = pair[0], b = pair[1];
                         r.sum = rounded(a + b);
                         r.difference = rounded(a - b);
                         r.product = rounded(a * b);
                         r.pair_sum = {r.sum, rounded(a + b - r.sum)};
                         r.pair_product = {r.product, rounded(a * b - r.product)};
                       }),
              "");
  }
}

TEST(Selftest, WhatIsWrongIsNamed) {
  const auto named = [](const std::string& what, const std::function<void(const SinglePair&, SingleResults&)>& change) {
    const std::string fault = fault_of(kept, change);
    EXPECT_EQ(fault.find("its " + what), 0u) << fault;
  };
  named("sums", [](const SinglePair&, SingleResults& r) { r.sum = next(next(r.sum)); });
  named("differences", [](const SinglePair&, SingleResults& r) { r.difference = next(next(r.difference)); });
  named("products", [](const SinglePair&, SingleResults& r) { r.product = next(next(r.product)); });
  // As a compiler that reorders sums, and one that fuses products with sums, leave them.
  named("error terms", [](const SinglePair&, SingleResults& r) { r.pair_sum[1] = 0; });
  named("error terms", [](const SinglePair&, SingleResults& r) { r.pair_product[1] = 0; });
  named("reciprocals", [](const SinglePair&, SingleResults& r) { r.reciprocal *= 1 + 0x1p-20f; });
  named("products with subnormal", [](const SinglePair&, SingleResults& r) {
    if (r.product != 0 && std::abs(r.product) < std::numeric_limits<float>::min()) r.product *= 2;
  });
}

}  // namespace
}  // namespace bisector::host
