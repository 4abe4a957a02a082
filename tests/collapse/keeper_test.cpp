#include "collapse/keeper.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <filesystem>
#include <functional>

#include "../base/own_folder.h"
#include "../record/same_record.h"
#include "base/error.h"
#include "base/file.h"
#include "mbs/model_json.h"
#include "plans.h"

namespace topple::collapse {
namespace {

using record::expect_same;

using Runner = std::function<record::Record(const RunOptions&, const RunCallbacks&)>;

/// A folder of its own, and runs that are cancelled at the first frame behind a time.
class KeeperReplay : public testing::Test {
 protected:
  KeeperReplay() { kept_.checkpoint = folder_ / "checkpoint.bin"; }

  record::Record cancel_at(const Runner& run, double time, const RunOptions& options) {
    std::atomic<bool> cancel = false;
    RunCallbacks callbacks;
    callbacks.progress.report = [&](double done, double) { cancel = done > time; };
    callbacks.progress.cancel = &cancel;
    callbacks.on_checkpoint = [this] { ++checkpoints_; };
    return run(options, callbacks);
  }
  record::Record resume(const Runner& run, RunOptions options) {
    options.resume = true;
    RunCallbacks callbacks;
    callbacks.on_resume = [this](double time) { resumed_at_ = time; };
    return run(options, callbacks);
  }
  std::string complaint(const Runner& run, const RunOptions& options) {
    try {
      (void)resume(run, options);
    } catch (const InputError& e) {
      EXPECT_EQ(e.diagnostics()[0].code, "E674");
      return e.diagnostics()[0].message;
    }
    return "";
  }

  OwnFolder folder_;
  RunOptions kept_;
  int checkpoints_ = 0;
  double resumed_at_ = -1;
};

/// Columns shot, one charge that fails, neighbours that shake.
std::string shot_house(const std::string& duration = "1.2 s") {
  return house(charge("C-A*-0", "0.1 s") + charge("C-B2-0", "0.35 s", "fails = true"), duration) + R"([site.vibration]
velocity = "2 mm/s"
energy = "1 MJ"
distance = "10 m"
energy_exponent = 0.5
distance_exponent = 1.5
factor = 2
source = "report 12"
frequency = ["5 Hz", "25 Hz"]
[[site.neighbour]]
name = "School"
footprint = [["30 m", "0 m"], ["40 m", "0 m"], ["40 m", "10 m"]]
building_class = "sensitive"
)";
}
Runner run_of(const std::string& plan) {
  return [plan](const RunOptions& o, const RunCallbacks& c) { return run_plan(read(plan), default_knowledge(), o, c); };
}

TEST_F(KeeperReplay, APlanGoesOnWithTheSameBits) {
  const auto run = run_of(shot_house());
  const record::Record whole = run({}, {});
  EXPECT_EQ(cancel_at(run, 0.05, kept_).ending, "cancelled");
  EXPECT_EQ(checkpoints_, 1);
  // once more behind the charge, and again in the debris
  for (const double time : {0.3, 0.8}) {
    RunOptions again = kept_;
    again.resume = true;
    EXPECT_EQ(cancel_at(run, time, again).ending, "cancelled");
  }
  expect_same(whole, resume(run, kept_));
  EXPECT_GT(resumed_at_, 0.8);
  EXPECT_LT(resumed_at_, 0.9);
}

/// Boxes that fall on each other and lie, a plate on a spring, a ball that rolls; samples at rates that no frame has.
constexpr const char* kMixed = R"({
  "format": "topple-mbs", "version": 2, "name": "mixed",
  "bodies": [
    {"name": "low", "mass": 800, "inertia": [33, 33, 33], "X_WB": {"p": [0, 0, 0.3]}, "shapes": [{"box": [0.25, 0.25, 0.25]}]},
    {"name": "high", "mass": 500, "inertia": [20, 20, 20], "X_WB": {"p": [0.1, 0.05, 1.2], "axis": [1, 2, 0], "angle": 0.2}, "shapes": [{"box": [0.25, 0.25, 0.25]}]},
    {"name": "plate", "mass": 100, "inertia": [8, 8, 16], "X_WB": {"p": [3, 0, 1]}, "shapes": [{"box": [0.5, 0.5, 0.05]}]},
    {"name": "ball", "mass": 50, "inertia": [2, 2, 2], "X_WB": {"p": [-3, 0, 2]}, "shapes": [{"sphere": 0.3}]}
  ],
  "springs": [{"name": "s", "a": "ground", "b": "plate", "p_A": [3, 0, 2], "p_B": [0, 0, 0], "spring": 4000, "damper": 60}],
  "contact": {"friction": 0.5, "body_friction": 0.5},
  "outputs": [{"name": "high", "body": "high", "quantity": "position", "rate": 77},
              {"name": "plate", "body": "plate", "quantity": "velocity", "rate": 1000}]
})";

Runner run_mixed(double duration) {
  return [duration, model = mbs::model_from_json(kMixed, "mixed")](RunOptions o, const RunCallbacks& c) {
    o.duration = duration, o.equilibrium = false, o.rest_speed = 0.02;
    return run_model(model, o, c);
  };
}

TEST_F(KeeperReplay, GoesOnFromWhatWasWrittenLastBeforeAnEndWithoutWarning) {
  const auto run = run_mixed(0.2);
  RunOptions often = kept_;
  often.checkpoint_interval = 1e-9;  // after every step
  const record::Record whole = run({}, {});
  expect_same(whole, run(often, {}));
  ASSERT_TRUE(std::filesystem::exists(kept_.checkpoint));
  expect_same(whole, resume(run, kept_));
  EXPECT_GT(resumed_at_, 0.19);
  EXPECT_LT(resumed_at_, 0.2);
}

TEST_F(KeeperReplay, AModelWithOutputsComesToRestAtTheSameStep) {
  const auto run = run_mixed(60);
  const record::Record whole = run({}, {});
  EXPECT_EQ(whole.ending, "at_rest") << whole.ending_text;
  EXPECT_EQ(cancel_at(run, 0.4, kept_).ending, "cancelled");
  RunOptions again = kept_;
  again.resume = true;
  EXPECT_EQ(cancel_at(run, whole.time.back() - 0.2, again).ending, "cancelled");  // while it counts quiet steps
  expect_same(whole, resume(run, kept_));
}

TEST_F(KeeperReplay, ARunOutlivesCheckpointsThatCannotBeWritten) {
  const auto run = run_mixed(0.1);
  kept_.checkpoint = folder_.str();  // a folder
  kept_.checkpoint_interval = 1e-9;
  std::vector<std::string> told;
  RunCallbacks callbacks;
  callbacks.on_lost_checkpoint = [&](const std::string& why) { told.push_back(why); };
  expect_same(run({}, {}), run(kept_, callbacks));
  ASSERT_GT(told.size(), 10u);
  EXPECT_THAT(told[0], testing::HasSubstr("cannot write " + folder_.str()));
}

TEST_F(KeeperReplay, GoesOnToALaterTime) {
  (void)cancel_at(run_of(shot_house("0.4 s")), 0.3, kept_);
  RunOptions later = kept_;
  later.duration = 0.6;
  const auto run = run_of(shot_house("0.4 s"));
  RunOptions whole;
  whole.duration = 0.6;
  expect_same(run(whole, {}), resume(run, later));
}

TEST_F(KeeperReplay, RefusesWhatItCannotGoOnFrom) {
  const auto run = run_of(shot_house("0.4 s"));
  (void)cancel_at(run, 0.3, kept_);
  EXPECT_THAT(complaint(run_of(shot_house("0.6 s")), kept_), testing::HasSubstr("of another plan or model, step"));
  RunOptions other = kept_;
  other.step = 1e-4;
  EXPECT_THAT(complaint(run, other), testing::HasSubstr("of another plan or model, step"));
  other = kept_;
  other.duration = 0.2;
  EXPECT_THAT(complaint(run, other), testing::HasSubstr("and is to end at 0.2 s"));
  const std::string whole = read_file(kept_.checkpoint);
  for (const size_t place : {whole.size() / 3, whole.size() - 1}) {
    std::string bytes = whole;
    bytes[place] = static_cast<char>(bytes[place] ^ 1);
    replace_file(kept_.checkpoint, bytes);
    EXPECT_THAT(complaint(run, kept_), testing::HasSubstr("damaged")) << place;
  }
  replace_file(kept_.checkpoint, whole.substr(0, whole.size() - 100));
  EXPECT_THAT(complaint(run, kept_), testing::HasSubstr("cut off"));
  replace_file(kept_.checkpoint, "topple");
  EXPECT_THAT(complaint(run, kept_), testing::HasSubstr("not a checkpoint"));
  replace_file(kept_.checkpoint, whole);
  EXPECT_EQ(complaint(run, kept_), "");
}

}  // namespace
}  // namespace topple::collapse
