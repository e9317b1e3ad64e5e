// The file of a checkpoint: what was kept comes back, whatever happened to the file's end.
#include "checkpoint/step_store.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <csignal>
#include <filesystem>
#include <string>
#include <vector>

#include "bisector/error.h"
#include "checkpoint/bytes.h"
#include "checkpoint/fingerprint.h"
#include "support/files.h"

namespace bisector::test {
namespace {

namespace fs = std::filesystem;

class StepStoreFile : public FileTest {
 protected:
  static CheckpointOptions options(bool resume) {
    CheckpointOptions options;
    options.every = 0;
    options.resume = resume;
    return options;
  }
  std::string file() const { return path("run.ckpt"); }
  StepStore open(bool resume, const std::string& identity = "a run") const {
    return StepStore(file(), identity, options(resume));
  }
};

TEST_F(StepStoreFile, GivesBackWhatWasKept) {
  StepKey first, second;
  {
    StepStore kept = open(false);
    first = kept.begin(11);
    kept.keep_state(first, "early", {});
    kept.keep_state(first, "later", {});
    EXPECT_EQ(kept.state(first), "later");
    EXPECT_FALSE(kept.result(first));
    kept.keep_result(first, "done", 1, {});
    EXPECT_FALSE(kept.state(first)) << "of a step that has ended";
    second = kept.begin(12);
    kept.keep_state(second, std::string(3, '\0'), {});
    EXPECT_FALSE(kept.empty());
  }
  StepStore kept = open(true);
  EXPECT_FALSE(kept.empty());
  EXPECT_EQ(kept.begin(11), first);
  EXPECT_EQ(kept.result(first), "done");
  EXPECT_FALSE(kept.state(first));
  EXPECT_FALSE(kept.result({0, 12})) << "a step that starts from something else";
  EXPECT_EQ(kept.begin(12), second);
  EXPECT_EQ(kept.state(second), std::string(3, '\0'));
  kept.remove();
  EXPECT_FALSE(fs::exists(file()));
}

// However long it takes to write it.
TEST_F(StepStoreFile, EachStateIsDueWhereAllAreWanted) {
  StepStore all = open(false);
  const StepKey step = all.begin(1);
  for (int k = 0; k < 5; ++k) {
    EXPECT_TRUE(all.state_is_due());
    all.keep_state(step, std::string(1 << 20, 'x'), {});
  }
  CheckpointOptions some;
  some.every = 1000;
  StepStore rare(path("rare.ckpt"), "a run", some);
  rare.begin(1);
  EXPECT_FALSE(rare.state_is_due());
}

TEST_F(StepStoreFile, CutOffAnywhereKeepsWhatIsWhole) {
  std::vector<std::uintmax_t> ends;
  {
    StepStore kept = open(false);
    ends.push_back(fs::file_size(file()));
    for (std::uint64_t k = 0; k < 4; ++k) {
      kept.keep_result(kept.begin(k), std::string(10 * k, 'x'), 1, {});
      ends.push_back(fs::file_size(file()));
    }
  }
  const std::string whole = slurp("run.ckpt");
  for (std::size_t size = 0; size <= whole.size(); ++size) {
    store("run.ckpt", whole.substr(0, size));
    {
      StepStore kept = open(true);
      for (std::uint64_t k = 0; k < 4; ++k)
        EXPECT_EQ(kept.result(kept.begin(k)).has_value(), ends[k + 1] <= size) << size << ' ' << k;
      kept.keep_result(kept.begin(9), "more", 1, {});
    }
    StepStore again = open(true);
    EXPECT_EQ(again.result({4, 9}), "more") << size;
  }
  // A damaged byte costs its record and those behind it.
  for (std::size_t at = ends[1]; at < ends[3]; ++at) {
    std::string damaged = whole;
    damaged[at] = static_cast<char>(damaged[at] ^ 4);
    store("run.ckpt", damaged);
    StepStore kept = open(true);
    EXPECT_TRUE(kept.result(kept.begin(0))) << at;
    EXPECT_EQ(kept.result(kept.begin(1)).has_value(), at >= ends[2]) << at;
    EXPECT_FALSE(kept.result(kept.begin(2))) << at;
    EXPECT_FALSE(kept.result(kept.begin(3))) << at;
    EXPECT_EQ(kept.found(),
              fmt::format("{} done; the last {} bytes are damaged or half written and left out",
                          at < ends[2] ? "1 step" : "2 steps", whole.size() - ends[at < ends[2] ? 1 : 2]));
  }
  store("run.ckpt", whole);
  EXPECT_EQ(open(true).found(), "4 steps done");
  store("run.ckpt", "");
  EXPECT_EQ(open(true).found(), "nothing that could be gone on from");
}

TEST_F(StepStoreFile, OfAnotherRunIsRefused) {
  { StepStore(file(), "a run", options(false)).keep_result({}, "x", 1, {}); }
  const auto refuses = [&](bool resume, const std::string& identity, const std::string& part) {
    expect_error_line([&] { StepStore kept = open(resume, identity); }, file(), part);
  };
  refuses(false, "a run", "is there already");
  refuses(true, "another run", "another input or other options");
  {
    const StepStore held = open(true);
    refuses(true, "a run", "in use by another process");
  }
  std::string text = slurp("run.ckpt");
  text.replace(text.find("form 1"), 6, "form 2");
  store("run.ckpt", text);
  refuses(true, "a run", "another version");
  store("run.ckpt", "OFF\n3 1 0\n");
  refuses(true, "a run", "is no checkpoint");
  EXPECT_EQ(slurp("run.ckpt"), "OFF\n3 1 0\n") << "what is no checkpoint stays as it is";
  expect_error_line([&] { StepStore kept(path("none/run.ckpt"), "", options(false)); }, path("none/run.ckpt"),
                    "cannot be written");
}

TEST_F(StepStoreFile, IsRemovedIfThereIsNothingInIt) {
  { StepStore kept = open(false); }
  EXPECT_FALSE(fs::exists(file()));
}

TEST_F(StepStoreFile, DoesNotGrowWithStatesThatNobodyNeeds) {
  const std::string state(1 << 20, 's');
  {
    StepStore kept = open(false);
    kept.keep_result(kept.begin(1), "first", 1, {});
    const StepKey step = kept.begin(2);
    for (int k = 0; k < 100; ++k) kept.keep_state(step, state, {});
    EXPECT_LT(fs::file_size(file()), 40u << 20);
    EXPECT_EQ(kept.result({0, 1}), "first");
    EXPECT_EQ(kept.state(step), state);
  }
  StepStore kept = open(true);
  EXPECT_EQ(kept.result({0, 1}), "first");
  EXPECT_EQ(kept.state({1, 2}), state);
}

// The limit stands for a full disk.
TEST_F(StepStoreFile, ThatCannotGrowIsAWarningAndStaysWhole) {
  {
    StepStore kept = open(false);
    kept.keep_result(kept.begin(1), "first", 1, {});
    const auto before = signal(SIGXFSZ, SIG_IGN);
    rlimit limit{};
    getrlimit(RLIMIT_FSIZE, &limit);
    const rlimit small{1000, limit.rlim_max};
    setrlimit(RLIMIT_FSIZE, &small);
    const Context context = collecting();
    kept.keep_result(kept.begin(2), std::string(2000, 'x'), 1, context);
    kept.keep_result(kept.begin(3), std::string(2000, 'x'), 1, context);
    setrlimit(RLIMIT_FSIZE, &limit);
    signal(SIGXFSZ, before);
    ASSERT_EQ(warnings_.size(), 1u);
    EXPECT_NE(warnings_[0].find("cannot be written: File too large; the run goes on"), std::string::npos);
  }
  StepStore kept = open(true);
  EXPECT_EQ(kept.result({0, 1}), "first");
  EXPECT_FALSE(kept.result({1, 2}));
}

TEST_F(StepStoreFile, ThatCannotBeBegunIsNotThere) {
  const auto before = signal(SIGXFSZ, SIG_IGN);
  rlimit limit{};
  getrlimit(RLIMIT_FSIZE, &limit);
  const rlimit small{10, limit.rlim_max};
  setrlimit(RLIMIT_FSIZE, &small);
  EXPECT_THROW(open(false), Error);
  setrlimit(RLIMIT_FSIZE, &limit);
  signal(SIGXFSZ, before);
  EXPECT_NO_THROW(open(false));
}

TEST(CheckpointBytes, ComeBackAndAreChecked) {
  ByteWriter out;
  out.put(7).put_all(std::vector<double>{1, 2, 3});
  const std::string bytes = out.take();
  ByteReader in(bytes);
  EXPECT_EQ(in.get<int>(), 7);
  std::vector<double> values;
  in.get_all(values);
  EXPECT_EQ(values, (std::vector<double>{1, 2, 3}));
  in.end();
  EXPECT_THROW(in.get<char>(), Error);
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    ByteReader cut(std::string_view(bytes).substr(0, size));
    EXPECT_THROW(
        {
          cut.get<int>();
          cut.get_all(values);
        },
        Error)
        << size;
  }
  ByteReader left(bytes);
  left.get<int>();
  EXPECT_THROW(left.end(), Error);
}

TEST(FingerprintOfBytes, TellsApartAndDoesNotMindPieces) {
  const std::string text(64, 'a');
  const auto of = [](std::string_view bytes) { return Fingerprint().add(bytes).value(); };
  EXPECT_EQ(Fingerprint().add(std::string_view(text).substr(0, 16)).add(std::string_view(text).substr(16)).value(),
            of(text));
  EXPECT_NE(of(text), of(text.substr(1)));
  EXPECT_NE(of(std::string(1, '\0')), of(""));
  for (std::size_t k = 0; k < text.size(); ++k) {
    std::string other = text;
    other[k] = 'b';
    EXPECT_NE(of(text), of(other)) << k;
  }
}

}  // namespace
}  // namespace bisector::test
