// What a device can do at most: bandwidths, the time of a submission and of a dispatch, and rates of arithmetic. The
// floor that evaluations are held against.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <functional>
#include <string>
#include <vector>

#include "bisector/error.h"
#include "common.h"
#include "core/stopwatch.h"
#include "host/device/commands.h"
#include "host/device/modules.h"
#include "io/files.h"
#include "kernels/layout/push.h"

namespace bisector::host {
extern const std::span<const Module> rate_modules;
}

namespace {

using namespace bisector;
using namespace bisector::bench;
using namespace bisector::host;

constexpr std::size_t kMebibyte = std::size_t{1} << 20;
constexpr std::size_t kRateInvocations = std::size_t{1} << 17;  // of kernels/rate.comp
constexpr double kRateOperations = 16;                          // of each of its steps
constexpr double kLongEnough = 0.05;                            // seconds of a measurement
// llvmpipe ends an invocation's loops, without a word, once they have run 65,535 times.
constexpr std::size_t kMostRepeats = std::size_t{1} << 15;
constexpr std::size_t kCommands = 1000;  // of the recording that tells a dispatch's time
constexpr int kRounds = 5;

struct Options {
  DeviceRequest device{.kind = DeviceRequest::Kind::vulkan};
  std::size_t mebibytes = 1024;
  std::string json;
};

// The device's own clock where it has one, else the host's.
double seconds_of(Commands& commands, const std::function<void()>& record) {
  commands.take_seconds();
  commands.phase(&DeviceSeconds::clip);
  record();
  const Stopwatch watch;
  commands.run();
  const double wall = watch.seconds(), own = commands.take_seconds().clip;
  return own > 0 ? own : wall;
}

double fastest(const std::function<double()>& measure) {
  double least = measure();
  for (int round = 1; round < kRounds; ++round) least = std::min(least, measure());
  return least;
}

// Repeats until it takes long enough; the seconds of one.
double of_one(const std::function<double(std::size_t repeats)>& measure) {
  std::size_t repeats = 1;
  while (measure(repeats) < kLongEnough && repeats < kMostRepeats) repeats *= 2;
  return fastest([&] { return measure(repeats); }) / static_cast<double>(repeats);
}

// By a kernel, as drivers may leave copies to engines of their own, which are slower. Each byte is read and written.
double copy_rate(Commands& commands, const Buffer& a, const Buffer& b, std::size_t bytes) {
  const auto words = static_cast<std::uint32_t>(bytes / 16);
  const double seconds = of_one([&](std::size_t repeats) {
    return seconds_of(commands, [&] {
      for (std::size_t k = 0; k < repeats; ++k)
        commands.dispatch({"copy", {}}, {reads(k % 2 ? b : a), writes(k % 2 ? a : b)}, CountPush{words}, words);
    });
  });
  return 2 * static_cast<double>(bytes) / seconds;
}

double fill_rate(Commands& commands, const Buffer& a, std::size_t bytes) {
  const double seconds = of_one([&](std::size_t repeats) {
    return seconds_of(commands, [&] {
      for (std::size_t k = 0; k < repeats; ++k) commands.fill(a, 0, bytes, static_cast<std::uint32_t>(k));
    });
  });
  return static_cast<double>(bytes) / seconds;
}

// From and to the caller's memory, staging included.
double transfer_rate(Commands& commands, const Buffer& a, std::size_t bytes, bool up) {
  std::vector<std::byte> data(bytes);
  const auto once = [&] {
    const Stopwatch watch;
    if (up) commands.upload(a, 0, data.data(), bytes);
    else commands.download(a, 0, data.data(), bytes);
    commands.run();
    return watch.seconds();
  };
  once();
  return static_cast<double>(bytes) / fastest(once);
}

double submit_seconds(Commands& commands, const Buffer& a) {
  return of_one([&](std::size_t repeats) {
    const Stopwatch watch;
    for (std::size_t k = 0; k < repeats; ++k) {
      commands.fill(a, 0, 4, 0);
      commands.run();
    }
    return watch.seconds();
  });
}

// Each waits for the one before it.
double dispatch_seconds(Commands& commands, const Buffer& a) {
  const CountPush push{0};
  return fastest([&] {
           return seconds_of(commands, [&] {
             for (std::size_t k = 0; k < kCommands; ++k) commands.dispatch({"rate_single", {}}, {updates(a)}, push, 1);
           });
         }) /
         static_cast<double>(kCommands);
}

double operation_rate(Commands& commands, const Buffer& a, const char* precision) {
  const Kernel kernel{std::string("rate_") + precision, {}};
  const double seconds = of_one([&](std::size_t repeats) {
    return seconds_of(commands, [&] {
      commands.dispatch(kernel, {writes(a)}, CountPush{static_cast<std::uint32_t>(repeats)}, kRateInvocations);
    });
  });
  return kRateOperations * static_cast<double>(kRateInvocations) / seconds;
}

void run(const Options& options) {
  register_modules(rate_modules);
  const auto device = Device::open(options.device);
  const DeviceDescription& about = device->description();
  const std::size_t bytes =
      std::min({options.mebibytes * kMebibyte, device->limits().storage_range / kMebibyte * kMebibyte,
                static_cast<std::size_t>(about.memory / 8) / kMebibyte * kMebibyte});
  Buffer a(*device), b(*device);
  a.reserve(bytes);
  b.reserve(bytes);
  Commands commands(*device);
  commands.fill(a, 0, bytes, 1);
  commands.fill(b, 0, bytes, 1);
  commands.run();

  Table table{{"device", "kind", "driver", "MiB", "copy GB/s", "fill GB/s", "up GB/s", "down GB/s", "submit us",
               "dispatch us", "single Gop/s", "double Gop/s"},
              {}};
  const auto giga = [](double rate) { return fmt::format("{:.4g}", 1e-9 * rate); };
  const auto micro = [](double seconds) { return fmt::format("{:.4g}", 1e6 * seconds); };
  const std::size_t moved = std::min(bytes, 256 * kMebibyte);
  table.rows.push_back({about.name, about.kind, about.driver, std::to_string(bytes / kMebibyte),
                        giga(copy_rate(commands, a, b, bytes)), giga(fill_rate(commands, a, bytes)),
                        giga(transfer_rate(commands, a, moved, true)), giga(transfer_rate(commands, a, moved, false)),
                        micro(submit_seconds(commands, a)), micro(dispatch_seconds(commands, a)),
                        giga(operation_rate(commands, a, "single")),
                        about.float64 ? giga(operation_rate(commands, a, "double")) : ""});
  fmt::print("{}", table.markdown());
  if (!options.json.empty()) write_file(options.json, table.json());
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
  CLI::App app{"Measures what a device can do at most: bandwidths, the time of a submission, rates of arithmetic."};
  job::add_parsed(&app, "--device", options.device, parse_device, "vulkan (default), vulkan:INDEX or vulkan:UUID",
                  {"vulkan", "vulkan:"});
  app.add_option("--size", options.mebibytes, "MiB of a buffer, at most an eighth of the memory; default 1024")
      ->check(CLI::Range(1, 16384));
  app.add_option("--json", options.json, "also write the table to this file");
  CLI11_PARSE(app, argc, argv);
  try {
    run(options);
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "bench_device: %s\n", error.what());
    return 1;
  }
}
