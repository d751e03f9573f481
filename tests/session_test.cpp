// The stopping loop by itself: frames that are made up, and estimates as a test wants them.
#include "session/session.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "session/statistics.hpp"
#include "session/warnings.hpp"

namespace parian {
namespace {

/// Makes no pictures, and has an estimate after some of its frames; at others it knows none.
class MadeUp : public FrameSource {
 public:
  explicit MadeUp(std::map<std::uint32_t, double> estimates = {}) : estimates_(std::move(estimates)) {}
  void frame() override {
    ++frames_;
    std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
  }
  [[nodiscard]] bool estimate_due() const override { return estimates_.contains(frames_); }
  double estimate() override {
    estimated_at_.push_back(frames_);
    return estimate_due() ? estimates_.at(frames_) : -1.0;
  }
  [[nodiscard]] std::uint32_t frames() const { return frames_; }
  [[nodiscard]] const std::vector<std::uint32_t>& estimated_at() const { return estimated_at_; }

  double seconds = 0;  ///< that a frame takes

 private:
  std::map<std::uint32_t, double> estimates_;
  std::uint32_t frames_ = 0;
  std::vector<std::uint32_t> estimated_at_;
};

using Frames = std::vector<std::uint32_t>;

TEST(Session, StopsAtTheErrorAfterTwoCheckpointsInARow) {
  MadeUp once({{1, 0.5}, {2, 0.05}, {4, 0.2}, {8, 0.09}, {16, 0.08}, {32, 0.01}});
  EXPECT_EQ(render_frames(once, {.error = 0.1, .frames = 100}), StoppedBy::error);
  EXPECT_EQ(once.frames(), 16U) << "2 frames were below, 4 were not";
  EXPECT_EQ(once.estimated_at(), (Frames{1, 2, 4, 8, 16})) << "what stops it is estimated, and not again";
  MadeUp equal({{1, 0.1}, {2, 0.1}, {3, 0.1}});
  EXPECT_EQ(render_frames(equal, {.error = 0.1, .frames = 5}), StoppedBy::frames) << "as large isn't below";
}

TEST(Session, WhatIsNotKnownIsNotBelow) {
  MadeUp unknown({{1, -1.0}, {2, -1.0}, {3, NAN}, {4, NAN}, {5, 0.0}, {6, -1.0}, {7, 0.0}, {8, 0.0}});
  EXPECT_EQ(render_frames(unknown, {.error = 0.1, .frames = 20}), StoppedBy::error);
  EXPECT_EQ(unknown.frames(), 8U);
  MadeUp never({{1, 0.0}, {2, 0.0}, {3, 0.0}});
  EXPECT_EQ(render_frames(never, {.error = 0, .frames = 3}), StoppedBy::frames) << "0: never";
}

TEST(Session, StopsAfterItsFramesWithAnEstimate) {
  MadeUp between({{1, 0.5}, {4, 0.5}});
  EXPECT_EQ(render_frames(between, {.frames = 6}), StoppedBy::frames);
  EXPECT_EQ(between.frames(), 6U);
  EXPECT_EQ(between.estimated_at(), (Frames{1, 4, 6}));
  MadeUp at({{1, 0.5}, {4, 0.5}});
  render_frames(at, {.frames = 4});
  EXPECT_EQ(at.estimated_at(), (Frames{1, 4})) << "once is enough";
  MadeUp none({{1, 0.01}, {2, 0.01}, {4, 0.01}});
  EXPECT_EQ(render_frames(none, {.error = 0.1, .frames = 5, .checkpoints = false}), StoppedBy::frames);
  EXPECT_EQ(none.estimated_at(), Frames{5});
}

TEST(Session, StopsAfterItsTime) {
  MadeUp slow;
  slow.seconds = 0.02;
  double seconds = 0;
  EXPECT_EQ(render_frames(slow, {.frames = 1000, .time = 0.1}, [&](const Progress& p) { seconds = p.seconds; }),
            StoppedBy::time);
  EXPECT_GE(seconds, 0.1);
  EXPECT_GE(slow.frames(), 1U);
  EXPECT_LE(slow.frames(), 5U) << "each takes 0.02 s or more";
  EXPECT_EQ(slow.estimated_at(), Frames{slow.frames()});
}

TEST(Session, FinishesTheFrameThatIsCancelled) {
  CancelToken cancel;
  MadeUp source;
  const auto third = [&](const Progress& p) {
    if (p.frames == 3) cancel.cancel();
  };
  EXPECT_EQ(render_frames(source, {.frames = 100, .cancel = &cancel}, third), StoppedBy::interrupt);
  EXPECT_EQ(source.frames(), 3U);
  EXPECT_EQ(source.estimated_at(), Frames{3});
  MadeUp one;
  EXPECT_EQ(render_frames(one, {.frames = 100, .cancel = &cancel}), StoppedBy::interrupt);
  EXPECT_EQ(one.frames(), 1U) << "there is always a picture";
  MadeUp other;
  other.seconds = 0.001;
  CancelToken late;
  std::thread thread([&] { late.cancel(); });
  EXPECT_EQ(render_frames(other, {.frames = 10000, .cancel = &late}), StoppedBy::interrupt);
  thread.join();
}

TEST(Session, WhatStopsFirstIsNamed) {
  CancelToken cancel;
  cancel.cancel();
  MadeUp all({{1, 0.01}, {2, 0.01}});
  EXPECT_EQ(render_frames(all, {.error = 0.1, .frames = 2}), StoppedBy::error);
  MadeUp rest({{1, 1.0}});
  EXPECT_EQ(render_frames(rest, {.error = 0.1, .frames = 1, .time = 1e-9, .cancel = &cancel}), StoppedBy::interrupt);
  MadeUp last;
  EXPECT_EQ(render_frames(last, {.frames = 1, .time = 1e-9}), StoppedBy::frames);
  EXPECT_STREQ(word_of(StoppedBy::error), "error");
  EXPECT_STREQ(word_of(StoppedBy::frames), "frames");
  EXPECT_STREQ(word_of(StoppedBy::time), "time");
  EXPECT_STREQ(word_of(StoppedBy::interrupt), "interrupt");
}

TEST(Session, TellsEachFrameHowFarItIs) {
  MadeUp source({{2, 0.5}, {4, 0.3}});
  std::vector<Progress> told;
  const Stopping stopping{.error = 0.1, .frames = 5};
  render_frames(source, stopping, [&](const Progress& p) { told.push_back(p); });
  ASSERT_EQ(told.size(), 5U);
  const double errors[] = {-1, 0.5, 0.5, 0.3, 0.3};
  for (std::size_t i = 0; i < told.size(); ++i) {
    EXPECT_EQ(told[i].frames, i + 1);
    EXPECT_EQ(told[i].error, errors[i]) << i;
    EXPECT_GE(told[i].seconds, i > 0 ? told[i - 1].seconds : 0.0);
  }
  EXPECT_EQ(told.back().share, 1.0);
  EXPECT_EQ(told.back().left, 0.0);
}

TEST(Session, TheNearestLimitTellsTheTimeLeft) {
  const Stopping stopping{.error = 0.01, .frames = 100, .time = 20};
  const Progress by_frames = progress_of(stopping, 50, -1, 4);
  EXPECT_EQ(by_frames.share, 0.5);
  EXPECT_EQ(by_frames.left, 4.0);
  EXPECT_EQ(progress_of(stopping, 10, -1, 5).share, 0.25) << "time";
  EXPECT_EQ(progress_of(stopping, 10, -1, 5).left, 15.0);
  EXPECT_DOUBLE_EQ(progress_of(stopping, 10, 0.0125, 5).share, 0.8) << "error";
  EXPECT_EQ(progress_of(stopping, 10, 0.001, 5).share, 1.0) << "it may still lack a second checkpoint";
  EXPECT_EQ(progress_of(stopping, 10, 0.001, 5).left, 0.0);
  EXPECT_EQ(progress_of(stopping, 10, 0.0, 5).share, 0.25) << "of a black picture nothing is known";
  EXPECT_LT(progress_of(Stopping(), 0, -1, 1).left, 0) << "not known";
}

TEST(Session, FailuresPassThrough) {
  struct Broken : MadeUp {
    void frame() override { throw std::runtime_error("lost"); }
  } broken;
  EXPECT_THROW(render_frames(broken, {.frames = 3}), std::runtime_error);
  MadeUp source;
  const auto fail = [](const Progress&) { throw std::runtime_error("closed"); };
  EXPECT_THROW(render_frames(source, {.frames = 3}, fail), std::runtime_error);
  EXPECT_EQ(source.frames(), 1U);
}

TEST(Session, PrintsNothing) {
  testing::internal::CaptureStdout();
  testing::internal::CaptureStderr();
  MadeUp source({{1, 0.5}, {2, -1.0}, {3, 0.0}});
  render_frames(source, {.error = 0.1, .frames = 4}, [](const Progress&) {});
  Warnings warnings({"thin"}, "a.ply");
  warnings.add({"thin", "dark"});
  Statistics statistics;
  statistics.warnings = warnings.all();
  EXPECT_FALSE(statistics_json(statistics, {}, {1, 1}).empty());
  EXPECT_EQ(testing::internal::GetCapturedStdout(), "");
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

using Lines = std::vector<std::string>;

TEST(Session, WarnsOfEachThingOnceWithItsFile) {
  Warnings warnings({"3 holes", "thin"}, "bust.ply");
  EXPECT_EQ(warnings.add({"3 holes", "dark"}), (Lines{"bust.ply: 3 holes", "dark"}));
  EXPECT_EQ(warnings.add({"dark", "bright", "3 holes", "bright", "thin"}), (Lines{"bright", "bust.ply: thin"}));
  EXPECT_EQ(warnings.add({"dark"}), Lines());
  EXPECT_EQ(warnings.all(), (Lines{"bust.ply: 3 holes", "dark", "bright", "bust.ply: thin"}));
}

TEST(Session, StatisticsKeepTheirKeysInOrder) {
  Statistics statistics;
  statistics.frames = 7;
  statistics.left_out.push_back({"clipping", "nothing is near", "triangles", 3, true});
  const nlohmann::ordered_json json = statistics_json(statistics, {}, {4, 3});
  Lines keys;
  for (const auto& [key, value] : json.items()) keys.push_back(key);
  EXPECT_EQ(keys,
            (Lines{"schema", "version", "device", "film", "frames", "stopped_by", "estimated_relmse",
                   "estimated_bias_relmse", "evaluations", "bias_evaluations", "seconds", "kernel_seconds", "layers",
                   "further_view_seconds", "fallback_pixels", "bytes", "left_out", "nonfinite", "warnings"}));
  EXPECT_EQ(json["frames"], 7);
  EXPECT_TRUE(json["stopped_by"].is_null());
  EXPECT_TRUE(json["estimated_relmse"].is_null()) << "not known";
  EXPECT_TRUE(json["kernel_seconds"].contains("total"));
  EXPECT_FALSE(json["kernel_seconds"].contains("load")) << "of the host alone";
  EXPECT_EQ(json["left_out"][0]["saves"]["count"], 3.0);
}

}  // namespace
}  // namespace parian
