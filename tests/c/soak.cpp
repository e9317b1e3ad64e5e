// Many runs of all commands in one process, two at a time: each gives what its like gave, and memory does not grow.
// Usage: soak EXAMPLES FOLDER [ROUNDS]; a round is twenty runs.
#include <bisector/c.h>
#include <malloc.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <mutex>
#include <random>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

namespace {

using Words = std::vector<std::pair<const char*, const char*>>;

void require(bool condition, const std::string& what) {
  if (!condition) throw std::runtime_error(what + ": " + bisector_last_error());
}

template <class Handle, bisector_status (*kFree)(Handle*)>
class Owned {
 public:
  Owned() = default;
  ~Owned() { kFree(handle_); }
  Owned(const Owned&) = delete;
  Owned& operator=(const Owned&) = delete;
  Handle** out() { return &handle_; }
  Handle* get() const { return handle_; }

 private:
  Handle* handle_ = nullptr;
};
using Mesh = Owned<bisector_mesh, bisector_mesh_free>;
using Options = Owned<bisector_options, bisector_options_free>;
using Outcome = Owned<bisector_result, bisector_result_free>;
using Cancel = Owned<bisector_cancel, bisector_cancel_free>;

// FNV-1a over the bytes of arrays.
std::uint64_t fingerprint(const bisector_result* result, const std::vector<const char*>& names) {
  std::uint64_t hash = 14695981039346656037u;
  for (const char* name : names) {
    bisector_array array{};
    require(bisector_result_array(result, name, &array) == BISECTOR_OK, name);
    const std::size_t bytes = array.rows * array.columns * (array.type == BISECTOR_DOUBLE ? 8 : 4);
    for (std::size_t k = 0; k < bytes; ++k)
      hash = (hash ^ static_cast<const unsigned char*>(array.data)[k]) * 1099511628211u;
  }
  return hash;
}

std::uint64_t run(const char* command, const bisector_mesh* mesh, const Words& words,
                  const std::vector<const char*>& arrays, const std::string& file = "") {
  Options options;
  require(bisector_options_new(command, options.out()) == BISECTOR_OK, command);
  for (const auto& [name, value] : words)
    require(bisector_options_set(options.get(), name, value) == BISECTOR_OK, name);
  Outcome result;
  require(bisector_run(options.get(), mesh, nullptr, result.out()) == BISECTOR_OK, command);
  const char* report = nullptr;
  require(bisector_result_report(result.get(), nullptr, &report) == BISECTOR_OK, "report");
  if (!file.empty()) {
    require(bisector_result_save(result.get(), "output", file.c_str(), nullptr) == BISECTOR_OK, file);
    ::unlink(file.c_str());
  }
  return fingerprint(result.get(), arrays);
}

void expect_failure(const char* command, const bisector_mesh* mesh, const Words& words) {
  Options options;
  require(bisector_options_new(command, options.out()) == BISECTOR_OK, command);
  for (const auto& [name, value] : words) bisector_options_set(options.get(), name, value);
  Outcome result;
  require(bisector_run(options.get(), mesh, nullptr, result.out()) != BISECTOR_OK, "no failure");
}

void cancelled_run(const bisector_mesh* mesh, int calls) {
  struct Counter {
    Cancel cancel;
    int left;
  } counter{{}, calls};
  require(bisector_cancel_new(counter.cancel.out()) == BISECTOR_OK, "cancel");
  bisector_callbacks callbacks = BISECTOR_CALLBACKS_INIT;
  callbacks.user = &counter;
  callbacks.cancel = counter.cancel.get();
  callbacks.progress = [](void* user, const bisector_progress*) {
    auto& c = *static_cast<Counter*>(user);
    if (c.left-- == 0) bisector_cancel_request(c.cancel.get());
  };
  Options options;
  require(bisector_options_new("remesh", options.out()) == BISECTOR_OK, "remesh");
  bisector_options_set(options.get(), "n", "600");
  Outcome result;
  require(bisector_run(options.get(), mesh, &callbacks, result.out()) == BISECTOR_CANCELLED, "not cancelled");
}

void stem(Mesh& mesh) {
  std::vector<double> points;
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> turn(0, 6.283185307179586), up(0, 3);
  for (int k = 0; k < 2000; ++k) {
    const double angle = turn(random);
    points.insert(points.end(), {0.1 * std::cos(angle), 0.1 * std::sin(angle), up(random)});
  }
  bisector_mesh_arrays arrays = BISECTOR_MESH_ARRAYS_INIT;
  arrays.vertices = points.data();
  arrays.vertex_count = points.size() / 3;
  require(bisector_mesh_from_arrays(&arrays, mesh.out()) == BISECTOR_OK, "stem");
}

class Soak {
 public:
  Soak(const std::string& examples, std::string folder) : folder_(std::move(folder)) {
    const auto open = [&](Mesh& mesh, const std::string& path) {
      require(bisector_mesh_from_file(path.c_str(), mesh.out()) == BISECTOR_OK, path);
    };
    open(part_, examples + "/part.off");
    open(smooth_, examples + "/smooth.off");
    open(missing_, examples + "/none.off");
    stem(stem_);
  }

  // One of kKinds runs. Throws if it is not as the first of its kind was.
  void one(std::size_t kind, const std::string& name) {
    std::uint64_t found = 0;
    const bisector_mesh *part = part_.get(), *smooth = smooth_.get();
    const std::string file = folder_ + '/' + name;
    switch (kind) {
      case 0: found = run("remesh", part, {{"n", "400"}, {"iterations", "10"}}, {"vertices", "faces"}); break;
      case 1: found = run("remesh", smooth, {{"n", "300"}, {"density", "lfs"}}, {"vertices"}, file + ".ply"); break;
      case 2: found = run("rvd", part, {{"n", "100"}}, {"centroids", "rdt"}, file + ".ply"); break;
      case 3:
        found = run("tet", smooth, {{"n", "200"}, {"iterations", "5"}}, {"vertices", "tets"}, file + ".vtu");
        break;
      case 4: found = run("segment", part, {{"proxies", "8"}}, {"labels"}, file + ".obj"); break;
      case 5: found = run("tree", stem_.get(), {}, {"vertices", "point_branches"}, file + ".obj"); break;
      case 6: run("quality", part, {}, {}); break;
      case 7: cancelled_run(smooth, 3 + static_cast<int>(runs_ % 40)); break;
      case 8: expect_failure("remesh", missing_.get(), {{"n", "100"}}); break;
      default: expect_failure("tet", part, {{"n", "many"}});
    }
    ++runs_;
    const std::lock_guard lock(mutex_);
    std::uint64_t& expected = expected_[kind];
    if (expected == 0) expected = found;
    if (found != expected) throw std::runtime_error("run of kind " + std::to_string(kind) + " is not like the first");
  }

  // Each of two threads goes through all kinds, in an order of its own.
  void round(std::uint64_t number) {
    std::array<std::thread, 2> threads;
    for (std::size_t t = 0; t < threads.size(); ++t)
      threads[t] = std::thread([=, this] {
        try {
          for (std::size_t k = 0; k < kKinds; ++k)
            one((k * (t ? 3 : 7) + number) % kKinds, "soak-" + std::to_string(t));
        } catch (const std::exception& error) {
          std::fprintf(stderr, "soak: %s\n", error.what());
          failed_ = true;
        }
      });
    for (std::thread& thread : threads) thread.join();
  }

  bool failed() const { return failed_; }
  std::size_t runs() const { return runs_; }
  static constexpr std::size_t kKinds = 10;

 private:
  std::string folder_;
  Mesh part_, smooth_, missing_, stem_;
  std::mutex mutex_;
  std::array<std::uint64_t, kKinds> expected_{};
  std::atomic<std::size_t> runs_ = 0;
  std::atomic<bool> failed_ = false;
};

// Kibibytes that are allocated, in all arenas: what is resident also has holes, which come and go by tens of MiB.
long allocated() {
  char* text = nullptr;
  std::size_t size = 0;
  std::FILE* out = ::open_memstream(&text, &size);
  require(out && ::malloc_info(0, out) == 0 && std::fclose(out) == 0, "malloc_info");
  const std::string all(text, size);
  std::free(text);
  // The totals of all arenas are the last of their kinds.
  const auto total = [&](const std::string& kind) {
    const std::size_t at = all.find("size=\"", all.rfind(kind));
    require(at != std::string::npos, kind);
    return std::atol(all.c_str() + at + 6);
  };
  return (total("<system type=\"current\"") + total("<total type=\"mmap\"") - total("<total type=\"rest\"") -
          total("<total type=\"fast\"")) /
         1024;
}

}  // namespace

int main(int argc, char** argv) try {
  if (argc < 3) throw std::runtime_error("usage: soak EXAMPLES FOLDER [ROUNDS]");
  const int rounds = argc > 3 ? std::atoi(argv[3]) : 3;
  Soak soak(argv[1], argv[2]);
  // Arenas and caches fill up at first.
  const int settled = std::max(2, rounds / 4);
  long before = 0, now = 0;
  for (int k = 0; k < rounds && !soak.failed(); ++k) {
    soak.round(static_cast<std::uint64_t>(k));
    now = allocated();
    if (k + 1 == settled) before = now;
    std::printf("%zu runs, %ld KiB allocated\n", soak.runs(), now);
  }
  if (soak.failed()) return 1;
  const long grown = now - before;
  std::printf("grown by %ld KiB since %d runs\n", grown, settled * 20);
  return grown < 1024 ? 0 : 1;
} catch (const std::exception& error) {
  std::fprintf(stderr, "soak: %s\n", error.what());
  return 1;
}
