/// topple steer as a process that is killed.

#include <gtest/gtest.h>

#include <filesystem>
#include <regex>
#include <thread>

#include "../collapse/plans.h"
#include "../server/test_client.h"
#include "../study/server.h"
#include "base/file.h"
#include "collapse/action_log.h"
#include "server/frame.h"

namespace topple::server {
namespace {

using collapse::Branch;

class SteerProgramReplay : public testing::Test {
 protected:
  void SetUp() override {
    replace_file(folder / "plan.toml",
                 collapse::house(collapse::charge("C-A*-0", "0.2 s") + collapse::charge("C-B*-0", "0.6 s"), "1 s"));
  }
  void TearDown() override {
    if (pid > 0 && waitpid(pid, nullptr, WNOHANG) == 0) kill(pid, SIGKILL), waitpid(pid, nullptr, 0);
  }

  /// Starts the server and connects; empty if it said no address within a minute.
  std::unique_ptr<TestClient> start(const std::vector<std::string>& more = {}) {
    const std::string said = folder / "said";
    std::filesystem::remove(said);
    std::vector<std::string> words{TOPPLE_PROGRAM, "steer", folder / "plan.toml", "--no-open", "-o", folder / "logs"};
    words.insert(words.end(), more.begin(), more.end());
    pid = study::spawn(words, said);
    const std::regex address("http://127\\.0\\.0\\.1:(\\d+)/([0-9a-f]{32})/");
    for (int i = 0; i < 600; ++i) {
      std::smatch found;
      output = std::filesystem::exists(said) ? read_file(said) : "";
      if (std::regex_search(output, found, address)) {
        auto c = std::make_unique<TestClient>(static_cast<std::uint16_t>(std::stoi(found[1])));
        token = found[2];
        EXPECT_TRUE(c->upgrade(token));
        return c;
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
    }
    ADD_FAILURE() << output;
    return nullptr;
  }
  /// A hello with a model behind it.
  static TestJson wait_until_built(TestClient& c) {
    return c.wait_for([](const TestJson& j) {
      return (j["type"] == "hello" && j["session"].is_object() && !j["session"]["active"].is_null()) ||
             (j["type"] == "state" && j["phase"] == "paused");
    });
  }
  void end(int signal) {
    kill(pid, signal);
    waitpid(pid, nullptr, 0);
    pid = -1;
  }
  TestJson session(TestClient& c) const {
    TestClient http(c.port());
    return http.get("/" + token + "/api/sessions/1").json();
  }

  study::Folder folder;
  pid_t pid = -1;
  std::string token, output;
};

/// Whether the frames that came over the wire hold what the branch holds; how many were looked at.
int compare_frames(const std::vector<std::string>& frames, const Branch& b) {
  int compared = 0;
  for (const std::string& f : frames) {
    std::uint32_t branch = 0, frame = 0;
    std::memcpy(&branch, &f[12], 4), std::memcpy(&frame, &f[20], 4);
    if (static_cast<int>(branch) != b.id || frame < b.first_frame || frame >= b.frames()) continue;
    const auto [piece, row] = b.find_frame(frame);
    const record::Record& r = piece->run->record();
    const FrameBody again = make_frame_body(r, row, r.bodies.size(), {});
    EXPECT_TRUE(f.size() == kFrameHeader + again.bytes.size() &&
                std::memcmp(f.data() + kFrameHeader, again.bytes.data(), again.bytes.size()) == 0)
        << "frame " << frame;
    ++compared;
  }
  return compared;
}

TEST_F(SteerProgramReplay, WhatWasKilledIsDoneAgainAndGoneOnWith) {
  auto c = start();
  ASSERT_TRUE(c);
  ASSERT_TRUE(wait_until_built(*c).is_object());
  EXPECT_TRUE(session(*c)["earlier"].is_null());
  c->result("run", {{"until", 0.3}});
  c->wait_for([](const TestJson& j) { return j["type"] == "state" && j["phase"] == "paused" && j["time"] > 0.25; });
  c->result("rewind", {{"time", 0.22}});
  ASSERT_EQ(c->result("set_delay", {{"stage", 1}, {"time", 0.5}, {"name", "sooner"}})["branch"], 2);
  // slowly, so that it is under way when it is killed
  c->result("speed", {{"factor", 0.1}});
  c->result("run");
  const TestJson noted = c->wait_for([](const TestJson& j) {
    return j["type"] == "log" && j["entry"]["action"] == "reached" && j["entry"]["branch"] == 2 &&
           j["entry"]["time"] > 0.31;
  });
  ASSERT_TRUE(noted.is_object());
  end(SIGKILL);
  c->is_cut_off();
  std::vector<std::string> frames = c->frames;

  // the same bits up to the last line of the log
  const std::string path = folder / "logs/plan.steer.jsonl", log = read_file(path);
  const std::string program = TestJson::parse(log.substr(0, log.find('\n')))["program"];
  collapse::SteeringOptions options;
  options.run.program_version = program.substr(std::string("topple ").size());
  collapse::ReplayResult again = collapse::replay(log, "log", collapse::default_knowledge(), options, {});
  EXPECT_EQ(again.actions, 1) << "set_delay; what was reached is nobody's action";
  const Branch& branch = again.steering->steering().branch(2);
  EXPECT_GE(branch.frontier(), noted["entry"]["time"].get<double>());
  EXPECT_LT(branch.frontier(), 0.9) << "it was killed under way";
  EXPECT_GT(compare_frames(frames, branch), 2);
  EXPECT_EQ(study::wait_for(study::spawn({TOPPLE_PROGRAM, "replay", path, "-o", folder / "again", "--no-report"},
                                         folder / "replayed")),
            0);
  EXPECT_TRUE(std::filesystem::exists(folder / "again/branch-2/record.h5"));

  // the next start offers to go on with it
  c = start();
  ASSERT_TRUE(c);
  EXPECT_NE(output.find("holds an earlier session"), std::string::npos) << output;
  ASSERT_TRUE(wait_until_built(*c).is_object());
  const TestJson earlier = session(*c)["earlier"];
  ASSERT_TRUE(earlier.is_object());
  EXPECT_EQ(earlier["log"], "plan.steer.jsonl");
  EXPECT_EQ(earlier["actions"], 1);
  EXPECT_EQ(earlier["branches"], 2);
  EXPECT_EQ(earlier["time"], branch.frontier());
  c->forget();
  const TestJson continued = c->result("session.continue");
  EXPECT_EQ(continued["branch"], 2) << continued;
  EXPECT_EQ(continued["time"], branch.frontier());
  EXPECT_EQ(c->code("session.continue"), "E930");
  EXPECT_EQ(read_file(path), log) << "the old log stays as it is";
  c->frames.clear();
  c->result("run");
  c->result("run");
  ASSERT_TRUE(c->wait_for_phase("finished").is_object());

  // as without the interruption
  const product::Plan plan = collapse::read(read_file(folder / "plan.toml"));
  collapse::Steering whole(collapse::default_knowledge(), options);
  ASSERT_TRUE(whole.begin(whole.add_root(plan, "main")));
  while (whole.active().frontier() < 0.3 && whole.advance()) {}
  whole.rewind(0.22);
  collapse::Edit sooner;
  sooner.kind = collapse::Edit::Kind::SetDelay;
  sooner.stage = 1;
  sooner.time = 0.5;
  whole.edit(sooner);
  while (whole.advance()) {}
  EXPECT_GT(compare_frames(c->frames, whole.active()), 0);
  TestClient http(c->port());
  const TestJson record = http.get("/" + token + "/api/sessions/1/branches/2/record.json").json();
  const TestJson expected = TestJson::parse(record::to_report_json(whole.make_record(whole.active())));
  for (const char* key : {"time", "position", "orientation", "zone_state"})
    EXPECT_EQ(record[key], expected[key]) << key;
  end(SIGINT);

  // by the command line
  c = start({"--continue"});
  ASSERT_TRUE(c);
  EXPECT_NE(output.find("It goes on from there"), std::string::npos) << output;
  const TestJson end = c->wait_for([](const TestJson& j) {
    return (j["type"] == "hello" && j["session"].is_object() && j["session"]["branches"].size() == 2) ||
           (j["type"] == "state" && j["phase"] == "finished");
  });
  EXPECT_TRUE(end.is_object());
  EXPECT_EQ(session(*c)["branches"].size(), 2U);
}

}  // namespace
}  // namespace topple::server
