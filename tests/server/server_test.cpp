#include "server/server.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <set>
#include <thread>

#include "../collapse/plans.h"
#include "../product/plan_text.h"
#include "../study/small_fuzzy_plan.h"
#include "base/file.h"
#include "base/hash.h"
#include "test_client.h"

namespace topple::server {
namespace {

namespace fs = std::filesystem;

constexpr int kRings = 5, kRingCorners = 200;  // of neighbours

std::string two_stages(const std::string& duration = "1 s") {
  return collapse::house(collapse::charge("C-A*-0", "0.2 s") + collapse::charge("C-B*-0", "0.6 s"), duration);
}

std::string one_stage(const std::string& duration) {
  return collapse::house(collapse::charge("C-A*-0", "0.1 s"), duration);
}

/// Neighbours all around a house, with corners by the hundred: their clearances take seconds of findings.
std::string surrounded(const std::string& duration) {
  std::string plan = collapse::house(collapse::charge("C-A*-0", "0.1 s"), duration);
  for (int k = 0; k < kRings; ++k) {
    std::string corners;
    // a ring that is open towards +x, so that all parts lie inside its bounds
    const int n = kRingCorners / 2;
    for (int i = 0; i < 2 * n; ++i) {
      const double r = (i < n ? 30.0 : 31.0) + k, a = 0.1 + 6.0 * (i < n ? i : 2 * n - 1 - i) / (n - 1);
      corners += fmt::format("{}[\"{:.4f} m\", \"{:.4f} m\"]", i > 0 ? ", " : "", r * std::cos(a), r * std::sin(a));
    }
    plan += fmt::format("[[site.neighbour]]\nname = \"Ring {}\"\nfootprint = [{}]\n", k, corners);
  }
  return plan;
}

/// A server over a folder of its own.
class ServerTest : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("topple-server-" + std::to_string(getpid()) + "-" +
                                           ::testing::UnitTest::GetInstance()->current_test_info()->name());
    fs::remove_all(folder_);
    fs::create_directories(folder_ / "plans");
    plan_path_ = (folder_ / "plans" / "house.toml").string();
  }
  void TearDown() override {
    server_.reset();
    hub_.reset();
    fs::remove_all(folder_);
  }
  void start(const std::string& text, ServerOptions serving = {}) {
    replace_file(plan_path_, text);
    HubOptions o;
    o.session.knowledge = collapse::default_knowledge();
    o.session.steering.run.program_version = "test";
    o.session.folder = (folder_ / "out").string();
    o.plans = (folder_ / "plans").string();
    o.page = page_;
    o.report = "<html><!--TOPPLE-DATA--></html>";
    o.demo = {"A house", "", one_stage("0.3 s")};
    o.study = "<title>study</title><!--TOPPLE-DATA-->";
    hub_ = std::make_unique<Hub>(o);
    server_ = std::make_unique<Server>(*hub_, serving);
    hub_->open({"house.toml", plan_path_, text});
  }
  std::string at(const std::string& path) const { return "/" + server_->token() + path; }
  std::uint16_t port() const { return server_->port(); }
  /// A watcher that has heard hello and that the plan is ready.
  std::unique_ptr<TestClient> watcher() {
    auto c = std::make_unique<TestClient>(port());
    EXPECT_TRUE(c->upgrade(server_->token()));
    hello_ = c->wait_for_type("hello");
    EXPECT_TRUE(hello_.is_object());
    if (hello_["session"]["phase"] == "building" || hello_["session"]["phase"] == "equilibrium")
      c->wait_for_phase("paused");
    return c;
  }

  fs::path folder_;
  std::string plan_path_, page_ = "<!doctype html><title>steer</title>";
  std::unique_ptr<Hub> hub_;
  std::unique_ptr<Server> server_;
  TestJson hello_;
};

TEST_F(ServerTest, RefusesWhoDoesNotKnowTheToken) {
  start(two_stages());
  for (const std::string& path :
       {std::string("/"), std::string("/api/server"), "/" + std::string(32, '0') + "/", at("x/api/server"),
        "/" + server_->token().substr(1) + "/api/server", std::string("/ws")}) {
    TestClient c(port());
    const HttpAnswer a = c.get(path);
    EXPECT_EQ(a.status, 403) << path;
    EXPECT_EQ(a.json()["error"]["code"], "E901") << path;
  }
  TestClient c(port());
  EXPECT_FALSE(c.upgrade(std::string(32, 'a')));
}

TEST_F(ServerTest, RefusesOtherHostsAndOrigins) {
  start(two_stages());
  for (const char* host : {"example.org", "127.0.0.1.example.org", "localhost.example.org:80", "127.0.0.1:80:80",
                           "127.0.0.1:", "10.0.0.1", "[::1"}) {
    TestClient c(port());
    EXPECT_EQ(c.get(at("/api/server"), "", host).json()["error"]["code"], "E902") << host;
  }
  for (const char* host : {"localhost:1", "127.0.0.1", "[::1]:8080"}) {
    TestClient c(port());
    EXPECT_EQ(c.get(at("/api/server"), "", host).status, 200) << host << ": a tunnel has a port of its own";
  }
  TestClient none(port());
  none.send_raw("GET " + at("/api/server") + " HTTP/1.1\r\n\r\n");
  EXPECT_EQ(none.read_answer().status, 403);
  TestClient two(port());
  EXPECT_EQ(two.get(at("/api/server"), "Host: 127.0.0.1\r\n").status, 403);
  for (const char* origin : {"null", "http://example.org", "https://127.0.0.1", "http://127.0.0.1:1"}) {
    TestClient c(port()), w(port());
    EXPECT_EQ(c.get(at("/api/server"), std::string("Origin: ") + origin + "\r\n").json()["error"]["code"], "E902")
        << origin;
    EXPECT_FALSE(w.upgrade(server_->token(), "", origin)) << origin;
  }
  TestClient own(port());
  EXPECT_TRUE(own.upgrade(server_->token(), "", "http://" + own.host()));
}

TEST_F(ServerTest, AnswersRequestsThatAreWrong) {
  start(two_stages());
  const auto status = [&](const std::string& raw) {
    TestClient c(port());
    c.send_raw(raw);
    return c.read_answer().status;
  };
  const std::string host = "Host: 127.0.0.1\r\n";
  EXPECT_EQ(status("nonsense\r\n\r\n"), 400);
  EXPECT_EQ(status("GET / HTTP/9.9\r\n" + host + "\r\n"), 400);
  EXPECT_EQ(status("POST " + at("/api/server") + " HTTP/1.1\r\n" + host + "\r\n"), 405);
  EXPECT_EQ(status("DELETE " + at("/api/server") + " HTTP/1.1\r\n" + host + "\r\n"), 405);
  EXPECT_EQ(status("GET " + at("/api/server") + " HTTP/1.1\r\n" + host + "Content-Length: 5\r\n\r\nhello"), 413);
  EXPECT_EQ(status("GET " + at("/api/server") + " HTTP/1.1\r\n" + host + "Transfer-Encoding: chunked\r\n\r\n0\r\n\r\n"),
            413);
  EXPECT_EQ(status("GET " + at("/") + std::string(20000, 'a') + " HTTP/1.1\r\n" + host + "\r\n"), 431);
  EXPECT_EQ(status("GET " + at("/api/server") + " HTTP/1.1\r\n" + host + "X: " + std::string(9000, 'a') + "\r\n\r\n"),
            431);
  EXPECT_EQ(status("GET " + at("/ws") + " HTTP/1.1\r\n" + host + "\r\n"), 426);
  // one connection, several requests
  TestClient c(port());
  EXPECT_EQ(c.get(at("/api/server")).status, 200);
  EXPECT_EQ(c.get(at("/api/templates")).status, 200);
  const HttpAnswer head = c.get(at("/"), "", "", "HEAD");
  EXPECT_EQ(head.status, 200);
  EXPECT_NE(head.head.find("nosniff"), std::string::npos);
}

TEST_F(ServerTest, NoPathLeadsToFiles) {
  start(two_stages());
  std::ofstream(folder_ / "secret.toml") << "title = \"secret\"";
  for (const char* path :
       {"/../secret.toml", "/%2e%2e/secret.toml", "/api/../../secret.toml", "/house.toml",
        "/api/sessions/1/../../plans", "/..\\secret.toml", "/api/sessions/1/branches/1/../../../x", "/api/sessions/-1",
        "/api/sessions/1e9", "/api/sessions/99", "/api/sessions/1/branches/1/passwd", "/api", "//api/server", "/api/",
        "/api/studies/1/results.json"}) {
    TestClient c(port());
    EXPECT_EQ(c.get(at(path)).status, 404) << path;
  }
  const auto c = watcher();
  for (const char* path :
       {"../secret.toml", "/etc/passwd", "./house.toml", "a/../../secret.toml", "house.toml/../../secret.toml", ""})
    EXPECT_EQ(c->code("session.open", {{"path", path}}), "E904") << path;
  fs::create_symlink(folder_ / "secret.toml", folder_ / "plans" / "link.toml");
  EXPECT_EQ(c->code("session.open", {{"path", "link.toml"}}), "E904");
  TestClient h(port());
  const TestJson plans = h.get(at("/api/plans")).json();
  ASSERT_EQ(plans["plans"].size(), 1U);
  EXPECT_EQ(plans["plans"][0]["path"], "house.toml");
  EXPECT_EQ(plans["plans"][0]["title"], "Test building");
}

TEST_F(ServerTest, WhatFiresAtOnceCanBeMovedBeforeTheFirstStep) {
  start(collapse::house(collapse::charge("C-A*-0", "0 s", "") + collapse::charge("C-B*-0", "0.6 s", "")));
  const auto c = watcher();
  const auto fired = [&] {
    int n = 0;
    TestClient h(port());
    const TestJson session = h.get(at("/api/sessions/1")).json();
    EXPECT_EQ(session["branches"][0]["charges"].size(), 6U);
    for (const TestJson& charge : session["branches"][0]["charges"]) n += charge["fired"].get<bool>();
    return n;
  };
  EXPECT_EQ(fired(), 0);
  EXPECT_EQ(c->result("set_delay", {{"stage", 0}, {"time", 0.2}})["branch"], 1);
  EXPECT_EQ(c->result("remove_charge", {{"charge", 0}})["branch"], 1);
  EXPECT_EQ(fired(), 0);
  c->result("run", {{"until", 0.3}});
  c->wait_for([](const TestJson& j) { return j["type"] == "state" && j["phase"] == "paused" && j["time"] > 0.2; });
  EXPECT_EQ(fired(), 2);
}

TEST_F(ServerTest, ReadsTitlesAsTomlDoes) {
  start(two_stages());
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"title=\"Mill\"", "Mill"},
      {"title = 'Mill'", "Mill"},
      {"title  =  \"Mill\"  # old\n[site]\n", "Mill"},
      {"\"title\" = \"Mill\"", "Mill"},
      {"\xEF\xBB\xBFtitle = \"Mill\"\r\n[site]\r\n", "Mill"},
      {"# title = \"Old\"\ntitle = \"Mill\"", "Mill"},
      {"# title = \"Old\"\n", ""},
      {"subtitle = \"Old\"\n[site]\ntitle = \"Ground\"", ""},
      {"title = \"The \\\"Old\\\" Mill\"", "The \"Old\" Mill"},
      {"title = \"\"\"\nMill\"\"\"", "Mill"},
      {"list = [\n[1],\n[2]]\ntitle = \"Mill\"", "Mill"},
      {"title = \"Mill\"\n[site]\nfriction = \n", "Mill"},  // of a plan with errors
      {"title = 3", ""},
      {"title = \"Mill", ""},
      {"", ""}};
  for (std::size_t i = 0; i < cases.size(); ++i)
    std::ofstream(folder_ / "plans" / ("case" + std::to_string(i) + ".toml"), std::ios::binary) << cases[i].first;
  TestClient h(port());
  const TestJson plans = h.get(at("/api/plans")).json();
  ASSERT_EQ(plans["plans"].size(), cases.size() + 1);
  for (std::size_t i = 0; i < cases.size(); ++i) {
    const std::string name = "case" + std::to_string(i) + ".toml";
    for (const auto& p : plans["plans"]) {
      if (p["path"] != name) continue;
      EXPECT_EQ(p["title"], cases[i].second) << cases[i].first;
    }
  }
}

TEST_F(ServerTest, ComparesABranchWithWhatItsParentLacks) {
  start(two_stages());
  const auto c = watcher();
  const auto run_until = [&](double time) {
    c->forget();
    c->result("run", {{"until", time}});
    c->wait_for(
        [&](const TestJson& j) { return j["type"] == "state" && j["phase"] == "paused" && j["time"] > time - 0.05; });
  };
  run_until(0.3);
  c->result("rewind", {{"time", 0.2}});
  c->result("add_cable", {{"member", "C-A2-1"},
                          {"position", 1.5},
                          {"anchor", {-15, 4, 0}},
                          {"stiffness", 2e6},
                          {"pretension", 5e4},
                          {"name", "pulled"}});
  run_until(0.3);
  c->result("add_charge", {{"member", "C-B2-1"}, {"position", 1}, {"destroyed_length", 0.6}, {"time", 0.35}});
  run_until(0.5);
  for (const auto& [a, b] : {std::pair{1, 2}, std::pair{2, 1}}) {
    const TestJson compared = c->result("compare", {{"a", a}, {"b", b}, {"frames", 20}});
    ASSERT_EQ(compared["time"].size(), 20U) << compared;
    EXPECT_EQ(compared["largest"]["distance"][0], 0);
    EXPECT_GT(compared["bodies"][0]["distance"], 0);
    ASSERT_FALSE(compared["series"].empty());
    for (const TestJson& s : compared["series"]) EXPECT_EQ(s["a"].size(), s["b"].size()) << s["id"];
  }
}

TEST_F(ServerTest, ABranchThatIsRefusedLeavesTheCursorWhereItIs) {
  start(two_stages());
  const auto c = watcher();
  c->result("run", {{"until", 0.3}});
  c->wait_for([](const TestJson& j) { return j["type"] == "state" && j["phase"] == "paused" && j["time"] > 0.25; });
  EXPECT_EQ(c->code("branch", {{"name", "main"}, {"time", 0.1}}), "E912");
  EXPECT_GT(c->result("set_friction", {{"ground", 0.4}})["edit"]["time"], 0.25);
}

TEST_F(ServerTest, TellsWhatCablesHold) {
  start(two_stages());
  const auto c = watcher();
  c->result(
      "add_cable",
      {{"member", "C-A2-1"}, {"position", 1.5}, {"anchor", {-15, 4, 0}}, {"stiffness", 2e6}, {"pretension", 5e4}});
  c->result("run", {{"until", 0.1}});
  c->wait_for([](const TestJson& j) { return j["type"] == "state" && j["phase"] == "paused" && j["time"] > 0.08; });
  c->forget();
  c->result("remove_cable", {{"cable", "added 1"}, {"in_place", true}});
  const auto is_told = [](const TestJson& j) { return j["type"] == "branch" && j["branch"]["cables"].size() == 1; };
  const TestJson cable = c->wait_for(is_told)["branch"]["cables"][0];
  EXPECT_EQ(cable["let_go"], true) << cable;
}

TEST_F(ServerTest, SteersAPlanToItsEnd) {
  start(two_stages());
  const auto c = watcher();
  TestClient http(port());
  const TestJson session = http.get(at("/api/sessions/1")).json();
  ASSERT_EQ(session["branches"].size(), 1U) << session;
  EXPECT_EQ(session["branches"][0]["charges"].size(), 6U);
  EXPECT_TRUE(c->result("run", {{"until", 0.3}}).empty());
  const TestJson stopped =
      c->wait_for([](const TestJson& j) { return j["type"] == "state" && j["phase"] == "paused" && j["time"] > 0.2; });
  EXPECT_NEAR(stopped["time"].get<double>(), 0.3, 0.01);
  EXPECT_FALSE(c->frames.empty());

  // an edit in the past makes a branch there
  const TestJson place = c->result("rewind", {{"time", 0.25}});
  EXPECT_LE(place["time"], 0.25);
  const TestJson edit = c->result("set_delay", {{"stage", 1}, {"time", 0.5}, {"name", "sooner"}});
  EXPECT_EQ(edit["branch"], 2) << edit;
  EXPECT_EQ(edit["edit"]["text"], "Stage at 0.6 s fires at 0.5 s instead of 0.6 s");
  c->result("run");
  const TestJson end = c->wait_for_phase("finished");
  EXPECT_EQ(end["branch"], 2);
  EXPECT_EQ(end["ending"]["kind"], "time_limit");
  EXPECT_EQ(end["ending"]["text"], "Stopped by the time limit of 1.00 s.") << "as the report says it";

  // what is known of the instant 0, which they share, does not hang on which of them has ended
  const TestJson early = c->result("compare", {{"a", 1}, {"b", 2}, {"frames", 5}});
  std::set<std::string> differ;
  for (const TestJson& f : early["findings"]) differ.insert(f["id"].get<std::string>());
  EXPECT_EQ(differ.count("mechanism"), 1U) << early["findings"];
  EXPECT_EQ(differ.count("stability.start"), 0U) << early["findings"];

  // both branches side by side, once the first has come as far
  c->result("switch", {{"branch", 1}});
  c->result("run");
  c->forget();
  c->wait_for_phase("finished");
  const TestJson compared = c->result("compare", {{"a", 1}, {"b", 2}, {"frames", 40}});
  ASSERT_EQ(compared["time"].size(), 40U) << compared;
  // all frames of both: no peak is lost
  const TestJson all = c->result("compare", {{"a", 1}, {"b", 2}}), of = c->result("series", {{"branch", 1}});
  for (const TestJson& s : of["series"])
    for (const TestJson& pair : all["series"])
      if (s["id"] == "ground_force" && pair["id"] == s["id"]) {
        double most = 0, seen = 0;
        for (std::size_t i = 0; i < of["time"].size(); ++i)
          if (of["time"][i] <= all["time"].back()) most = std::max(most, s["value"][i].get<double>());
        for (const TestJson& v : pair["a"]) seen = std::max(seen, v.get<double>());
        EXPECT_GT(most, 0);
        EXPECT_EQ(seen, most);
      }
  EXPECT_GT(compared["bodies"][0]["distance"], 0);
  EXPECT_EQ(compared["largest"]["distance"][0], 0);
  EXPECT_EQ(compared["edits"]["b"].size(), 1U);

  // undo of an edit that made its branch goes back to the parent
  c->result("switch", {{"branch", 2}});
  EXPECT_EQ(c->result("undo")["branch"], 1);
  EXPECT_EQ(c->code("undo"), "E934");

  // documents, behind longer than an idle connection is kept
  TestClient later(port());
  const TestJson findings = later.get(at("/api/sessions/1/branches/2/findings")).json();
  EXPECT_FALSE(findings["findings"].empty());
  const TestJson record = later.get(at("/api/sessions/1/branches/2/record.json")).json();
  EXPECT_EQ(record["format"], "topple-report");
  EXPECT_NEAR(record["time"].back().get<double>(), compared["time"].back().get<double>(), 1e-3)
      << "as far as both have come";
  EXPECT_EQ(
      later.get(at("/api/sessions/1/branches/2/report.html")).body.rfind("<html><script type=\"application/json\"", 0),
      0U);
  // it goes through no other file
  const char* const folder = std::getenv("TMPDIR");
  const std::string before = folder == nullptr ? "/tmp" : folder;
  setenv("TMPDIR", (folder_ / "none").c_str(), 1);
  EXPECT_EQ(later.get(at("/api/sessions/1/branches/2/record.h5")).body.substr(1, 3), "HDF");
  setenv("TMPDIR", before.c_str(), 1);
  EXPECT_EQ(later.get(at("/api/sessions/1/branches/7/findings")).status, 404);
  const TestJson series = c->result("series", {{"branch", 2}, {"from", 3}});
  EXPECT_EQ(series["time"].size(), record["time"].size() - 3);

  // the log gives the same bits
  TestClient after(port());  // an error ends the connection
  const std::string log = after.get(at("/api/sessions/1/log")).body;
  EXPECT_EQ(log, read_file((folder_ / "out" / "house.steer.jsonl").string()));
  collapse::SteeringOptions options;
  options.run.program_version = "test";
  const collapse::ReplayResult again = collapse::replay(log, "log", collapse::default_knowledge(), options, {});
  const record::Record same = again.steering->steering().make_record(again.steering->steering().branch(2));
  EXPECT_EQ(TestJson::parse(record::to_report_json(same))["position"], record["position"]);
}

TEST_F(ServerTest, FramesHoldWhatTheRecordHolds) {
  start(one_stage("0.4 s"));
  const auto c = watcher();
  c->result("run");
  c->wait_for_phase("finished");
  TestClient http(port());
  const TestJson record = http.get(at("/api/sessions/1/branches/1/record.json")).json();
  const std::size_t B = record["bodies"].size(), Z = record["zones"].size(), V = hello_["scene"]["series"].size(),
                    S = record["time"].size();
  c->frames.clear();
  EXPECT_EQ(c->result("frames", {{"branch", 1}, {"from", 0}, {"count", 4000}})["count"], S);
  ASSERT_EQ(c->frames.size(), S);
  for (std::size_t i = 0; i < S; ++i) {
    const std::string& f = c->frames[i];
    std::uint32_t receded = 0;
    std::memcpy(&receded, &f[44], 4);
    ASSERT_EQ(f.size(), 48 + 28 * B + 4 * V + 5 * Z + 12 * receded);
    EXPECT_EQ(f.substr(0, 4), "TPLF");
    std::uint32_t frame = 0, bodies = 0;
    std::uint16_t flags = 0;
    double time = 0;
    std::memcpy(&flags, &f[6], 2), std::memcpy(&frame, &f[20], 4), std::memcpy(&time, &f[24], 8),
        std::memcpy(&bodies, &f[32], 4);
    EXPECT_EQ(flags, i + 1 == S ? 6 : 2);
    EXPECT_EQ(frame, i);
    EXPECT_EQ(time, record["time"][i].get<double>());
    EXPECT_EQ(bodies, B);
    float tilt = 0;
    std::memcpy(&tilt, &f[48 + 28 * B], 4);
    EXPECT_EQ(tilt, record["series"][0]["value"][i].get<float>());
  }
  EXPECT_EQ(c->result("frames", {{"from", 1}, {"count", 3}, {"stride", 2}})["count"], 3);
  EXPECT_EQ(c->result("frames", {{"from", 99999}, {"count", 3}})["count"], 0);
}

/// Places of zones are those at the start: with a later frame a page would put their signs beside the members.
TEST_F(ServerTest, AScenesFrameIsTheStart) {
  start(two_stages("0.8 s"));
  const auto first = watcher();
  first->result("run");
  first->wait_for_phase("finished");
  TestClient http(port());
  const TestJson record = http.get(at("/api/sessions/1/branches/1/record.json")).json();
  // debris of an added charge stands among the others of its branch
  const auto B = static_cast<std::size_t>(std::count_if(record["bodies"].begin(), record["bodies"].end(),
                                                        [](const TestJson& b) { return b["kind"] != "debris"; }));
  const auto c = watcher();
  const auto starts = [&](const TestJson& scene) {
    ASSERT_EQ(scene["time"].size(), 1U);
    EXPECT_EQ(scene["time"][0], record["time"][0]);
    // base64 of whole triples of bytes
    EXPECT_EQ(scene["position"].get<std::string>().substr(0, 16 * B),
              record["position"].get<std::string>().substr(0, 16 * B));
    EXPECT_EQ(scene["zone_state"].get<std::string>().find_first_not_of("A="), std::string::npos) << "all elastic";
  };
  EXPECT_EQ(hello_["frame"], 0);
  starts(hello_["scene"]);
  starts(c->result("scene", {{"branch", 1}})["scene"]);

  // also of a branch whose own frames begin later and whose bodies are more
  c->result("rewind", {{"time", 0.4}});
  c->result("add_charge", {{"member", "C-B2-1"}, {"position", 1}, {"destroyed_length", 0.6}, {"time", 0.5}});
  const TestJson scene = c->result("scene", {{"branch", 2}})["scene"];
  EXPECT_GT(scene["bodies"].size(), record["bodies"].size());
  starts(scene);
}

TEST_F(ServerTest, ARunHeldToASpeedTellsHowFarItIs) {
  start(one_stage("1 s"));
  const auto c = watcher();
  c->result("speed", {{"factor", 0.2}});
  c->result("run");
  double last = 0;
  for (int told = 0; told < 4; ++told) {
    const TestJson s = c->wait_for(
        [&](const TestJson& j) { return j["type"] == "state" && j["phase"] == "running" && j["time"] > last; });
    ASSERT_TRUE(s.is_object());
    last = s["time"];
    EXPECT_TRUE(s["eta"].is_null() || s["eta"] >= 0) << s;
  }
  EXPECT_LT(last, 0.9);
  // and the log hears of it while it goes on
  EXPECT_TRUE(c->wait_for([](const TestJson& j) {
                 return j["type"] == "log" && j["entry"]["action"] == "reached" && j["entry"]["time"] < 0.9;
               }).is_object());
  c->result("speed", {{"factor", nullptr}});
  const TestJson over = c->wait_for_phase("finished");
  ASSERT_TRUE(over.is_object());
  EXPECT_TRUE(over["real_time_factor"].is_null() && over["eta"].is_null()) << over;
}

TEST_F(ServerTest, TellsAZonesPath) {
  start(one_stage("0.4 s"));
  const auto c = watcher();
  const std::string zone = hello_["scene"]["zones"][0]["name"];
  const TestJson watched = c->result("zone", {{"zone", zone}});
  EXPECT_FALSE(watched["law"]["moment_z"]["plastic_rotation"].empty()) << watched;
  c->result("run");
  c->wait_for_phase("finished");
  std::size_t points = 0;
  while (points < 20) {
    const TestJson e = c->wait_for_type("zone");
    ASSERT_TRUE(e.is_object());
    EXPECT_EQ(e["zone"], zone);
    for (const TestJson& p : e["points"]) EXPECT_EQ(p.size(), 8U);
    // under dead load the column is pressed, and its moment has the sign of its rotation
    if (const TestJson& p = e["points"][0]; points == 0) {
      EXPECT_EQ(p[0], 0);
      EXPECT_LT(p[1], 0);
      EXPECT_GT(p[3].get<double>() * p[5].get<double>(), 0);
    }
    points += e["points"].size();
  }
  // its top is a hinge, and bears as much
  std::string top = zone;
  top.replace(top.rfind('/'), std::string::npos, "/top");
  c->result("zone", {{"zone", top}});
  const TestJson e = c->wait_for_type("zone");
  ASSERT_EQ(e["zone"], top);
  const TestJson& p = e["points"][0];
  EXPECT_LT(p[1], 0);
  EXPECT_TRUE(p[2].is_null() && p[4].is_null()) << p;
  EXPECT_TRUE(p[3].is_number() && p[5].is_number()) << p;
  EXPECT_EQ(c->code("zone", {{"zone", "none"}}), "E920");
}

TEST_F(ServerTest, TellsAMembersReinforcement) {
  start(one_stage("0.4 s"));
  const auto c = watcher();
  const product::Plan plan = collapse::read(one_stage("0.4 s"));
  std::set<std::string> kinds;
  for (const product::Member& m : plan.members) {
    const TestJson told = c->result("member", {{"member", m.name}})["member"];
    ASSERT_EQ(told["name"], m.name);
    kinds.insert(told["kind"].get<std::string>());
    if (m.section < 0) continue;
    const product::Section& s = plan.sections[static_cast<std::size_t>(m.section)];
    EXPECT_EQ(told["section"]["width"], s.width);
    EXPECT_EQ(told["section"]["bars"].size(), s.bars.size());
    EXPECT_EQ(told["section"]["bars"][0]["diameter"], s.bars[0].diameter);
    EXPECT_EQ(told["section"]["cover"], s.cover);
    EXPECT_EQ(told["steel"]["fy"], plan.steels[static_cast<std::size_t>(s.steel)].fy);
  }
  EXPECT_TRUE(kinds.contains("column") && kinds.contains("beam"));
  EXPECT_TRUE(c->result("member", {{"member", "N-A1-0"}})["member"].is_null());
  EXPECT_EQ(c->code("member", {}), "E912");
  // edits belong to the branch
  c->result("add_pre_cut", {{"member", "C-B1-0"}, {"at", 0}, {"cut_bars", 0.5}, {"cut_concrete", 0}});
  EXPECT_EQ(c->result("member", {{"member", "C-B1-0"}})["member"]["cuts"][0]["cut_bars"], 0.5);
}

TEST_F(ServerTest, AZonesPathWaitsForWhoComesBack) {
  start(one_stage("0.4 s"));
  auto c = watcher();
  const std::string resume = hello_["resume"], zone = hello_["scene"]["zones"][0]["name"];
  c->result("zone", {{"zone", zone}});
  const TestJson first = c->wait_for_type("zone");
  const long seq = c->last_seq;
  c->close();
  const auto other = watcher();
  other->result("run");
  other->wait_for_phase("finished");
  const std::size_t frames = other->result("series", {{"branch", 1}, {"from", 0}})["time"].size();
  TestClient back(port());
  ASSERT_TRUE(back.upgrade(server_->token(), "?resume=" + resume + "&seq=" + std::to_string(seq)));
  ASSERT_TRUE(back.wait_for_type("resumed").is_object());
  std::size_t points = first["points"].size();
  while (points < frames) {
    const TestJson e = back.wait_for_type("zone");
    ASSERT_TRUE(e.is_object()) << points << " of " << frames;
    points += e["points"].size();
  }
  EXPECT_EQ(points, frames);
}

TEST_F(ServerTest, AReplyLastsAsLongAsItGetsOn) {
  page_ = std::string(std::size_t{24} << 20, 'x');
  ServerOptions serving;
  serving.standstill = 1.5;
  start(one_stage("0.3 s"), serving);
  TestClient slow(port());
  slow.read_slowly(std::chrono::milliseconds(5));  // 64 kB each: 24 MB take 2 s
  const HttpAnswer all = slow.get(at("/"));
  EXPECT_EQ(all.status, 200);
  EXPECT_EQ(all.body.size(), page_.size());
  TestClient stuck(port());
  stuck.read_slowly(std::chrono::milliseconds(5));
  stuck.send_raw("GET " + at("/") + " HTTP/1.1\r\nHost: " + stuck.host() + "\r\n\r\n");
  std::this_thread::sleep_for(std::chrono::milliseconds(4000));
  EXPECT_EQ(stuck.read_answer().status, 0) << "who takes nothing is let go";
}

TEST_F(ServerTest, AnswersMessagesThatAreWrong) {
  start(two_stages());
  const auto c = watcher();
  for (const char* text : {"", "nonsense", "[]", "5", "{}", R"({"command": "run"})", R"({"id": "1", "command": "run"})",
                           R"({"id": -1, "command": "run"})", R"({"id": 1e300, "command": "run"})",
                           R"({"id": 1.5, "command": "run"})", "\xc3\x28"}) {
    ASSERT_TRUE(c->send_text(text)) << text;
    if (std::string(text) == "\xc3\x28") break;  // text that is not UTF-8 ends the connection
    const TestJson e = c->wait_for_type("error");
    ASSERT_TRUE(e.is_object()) << text;
    EXPECT_TRUE(e["id"].is_null()) << text;
    EXPECT_EQ(e["error"]["code"], "E910") << text;
  }
  EXPECT_TRUE(c->is_cut_off());
  const auto nested = watcher();
  ASSERT_TRUE(nested->send_text(R"({"id": 1, "command": "x", "a": )" + std::string(200000, '[')));
  EXPECT_EQ(nested->wait_for_type("error")["error"]["code"], "E910");
  const auto d = watcher();
  ASSERT_TRUE(d->send_text(R"({"id": 1, "command": "run", "until": 1e999})"));
  EXPECT_EQ(d->wait_for_type("error")["error"]["message"], "a number is larger than any (1.8e308)");
  EXPECT_EQ(d->code("step", {{"frames", 1}, {"steps", 1}}), "E912");
  EXPECT_EQ(d->code("session.open", {{"template", "tower"}, {"demo", true}}), "E912");
  EXPECT_EQ(d->code("session.open", {{"demo", true}, {"title", "x"}}), "E912");
  EXPECT_EQ(d->code("rename", {{"branch", 1}, {"name", "   "}}), "E912");
  EXPECT_EQ(d->code("rnu"), "E911");
  EXPECT_EQ(d->command("paus")["error"]["help"], "did you mean \"pause\"?");
  EXPECT_EQ(d->code("run", {{"untill", 3}}), "E912");
  EXPECT_EQ(d->code("run", {{"until", "3"}}), "E912");
  EXPECT_EQ(d->code("run", {{"until", -5}}), "E912");
  EXPECT_EQ(d->code("speed", {{"factor", 0}}), "E912");
  EXPECT_EQ(d->code("rewind"), "E912");
  EXPECT_EQ(d->code("switch", {{"branch", 7}}), "E920");
  EXPECT_EQ(d->code("run", {{"session", 9}}), "E920");
  EXPECT_EQ(d->code("fire", {{"charge", 99}}), "E920");
  EXPECT_EQ(d->code("study.start"), "E950");
  EXPECT_EQ(d->code("compare", {{"a", 1}, {"b", 9}}), "E920");
  // what is no WebSocket any more
  const auto large = watcher(), unmasked = watcher(), reserved = watcher(), binary = watcher();
  large->send_frame(1, std::string((std::size_t{2} << 20) + 1, 'x'));
  EXPECT_TRUE(large->is_cut_off());
  unmasked->send_frame(1, "{}", false);
  EXPECT_TRUE(unmasked->is_cut_off());
  reserved->send_frame(11, "{}");
  EXPECT_TRUE(reserved->is_cut_off());
  binary->send_frame(2, "{\"id\": 1, \"command\": \"run\"}");
  EXPECT_EQ(binary->wait_for_type("error")["error"]["code"], "E910");
  EXPECT_TRUE(d->result("ping").contains("time")) << "the others go on";
}

TEST_F(ServerTest, DoesCommandsThatComeBeforeHello) {
  start(two_stages());
  (void)watcher();
  for (int i = 0; i < 20; ++i) {
    TestClient c(port());
    ASSERT_TRUE(c.upgrade(server_->token()));
    EXPECT_TRUE(c.result("log").contains("entries"));
  }
}

TEST_F(ServerTest, DoesACommandOnce) {
  start(two_stages());
  const auto c = watcher();
  const std::string text = R"({"id": 100, "command": "branch", "name": "once"})";
  const auto is_answer = [](const TestJson& j) { return j["type"] == "ack" && j["id"] == 100; };
  c->send_text(text);
  EXPECT_EQ(c->wait_for(is_answer)["result"]["branch"], 2);
  c->send_text(text);
  EXPECT_EQ(c->wait_for(is_answer)["result"]["branch"], 2);
  TestClient http(port());
  EXPECT_EQ(http.get(at("/api/sessions/1")).json()["branches"].size(), 2U);
}

TEST_F(ServerTest, AClientComesBack) {
  start(two_stages());
  auto c = watcher();
  const std::string resume = hello_["resume"];
  c->result("branch", {{"name", "one"}});
  const long seq = c->last_seq;
  // it vanishes in the middle of a command
  c->send_text(R"({"id": 50, "command": "branch", "name": "two"})");
  c->close();
  const auto other = watcher();
  other->result("rename", {{"branch", 1}, {"name", "first"}});
  TestClient back(port());
  ASSERT_TRUE(back.upgrade(server_->token(), "?resume=" + resume + "&seq=" + std::to_string(seq)));
  EXPECT_EQ(back.wait_for_type("resumed")["from"], seq);
  const TestJson renamed =
      back.wait_for([](const TestJson& j) { return j["type"] == "branch" && j["branch"]["name"] == "first"; });
  EXPECT_GT(renamed["seq"], seq);
  // it does not know whether that command was done: once more does it at most once
  back.send_text(R"({"id": 50, "command": "branch", "name": "two"})");
  EXPECT_EQ(back.wait_for([](const TestJson& j) { return j["type"] == "ack" && j["id"] == 50; })["result"]["branch"],
            3);
  for (const std::string& query : {std::string("?resume=") + std::string(32, '0') + "&seq=1",
                                   "?resume=" + resume + "&seq=999999", std::string("?resume=&seq=x")}) {
    TestClient strange(port());
    ASSERT_TRUE(strange.upgrade(server_->token(), query));
    EXPECT_TRUE(strange.wait_for_type("hello").is_object()) << query;
  }
}

TEST_F(ServerTest, ASlowReaderLosesFramesAndNothingElse) {
  start(two_stages("3 s"));
  const auto slow = watcher(), quick = watcher();
  // it asks for a lot, and reads nothing while the run goes to its end
  quick->result("run");
  ASSERT_TRUE(slow->send_text(R"({"id": 7, "command": "ping"})"));
  quick->wait_for_phase("finished");
  const TestJson last = quick->result("rename", {{"branch", 1}, {"name", "done"}});
  EXPECT_FALSE(last.contains("refused"));
  EXPECT_TRUE(slow->wait_for([](const TestJson& j) { return j["type"] == "ack" && j["id"] == 7; }).is_object());
  slow->wait_for([](const TestJson& j) { return j["type"] == "branch" && j["branch"]["name"] == "done"; });
  quick->wait_for([](const TestJson& j) { return j["type"] == "branch" && j["branch"]["name"] == "done"; });
  // both heard the same events
  const auto seqs = [](const TestClient& c) {
    std::vector<long> list;
    for (const TestJson& j : c.later())
      if (j.contains("seq") && j["type"] != "hello") list.push_back(j["seq"]);
    return list;
  };
  const std::vector<long> slow_seqs = seqs(*slow);
  for (std::size_t i = 1; i < slow_seqs.size(); ++i) EXPECT_LT(slow_seqs[i - 1], slow_seqs[i]);
  // every frame that it did get is whole, and the last one came
  ASSERT_FALSE(slow->frames.empty());
  for (const std::string& f : slow->frames) {
    std::uint32_t count[4] = {};  // bodies, zones, series, crushed ends
    std::memcpy(count, &f[32], sizeof count);
    EXPECT_EQ(f.size(), 48 + 28 * count[0] + 5 * count[1] + 4 * count[2] + 12 * count[3]);
  }
}

TEST_F(ServerTest, TwentyWatch) {
  start(one_stage("0.5 s"));
  std::vector<std::unique_ptr<TestClient>> all;
  for (int i = 0; i < 20; ++i) all.push_back(watcher());
  all[0]->result("run");
  for (auto& c : all) {
    const TestJson end = c->wait_for_phase("finished");
    ASSERT_TRUE(end.is_object());
    EXPECT_NEAR(end["time"].get<double>(), 0.5, 0.01);
    EXPECT_FALSE(c->frames.empty());
  }
  // half of them vanish without a word
  for (std::size_t i = 0; i < 10; ++i) all[i]->close();
  EXPECT_EQ(all[15]->result("rename", {{"branch", 1}, {"name", "still here"}})["branch"], 1);
}

TEST_F(ServerTest, ManyConnectionsAreTurnedAway) {
  ServerOptions few;
  few.most_connections = 8;
  few.request_timeout = 0.5;
  start(two_stages(), few);
  std::vector<std::unique_ptr<TestClient>> idle;
  for (int i = 0; i < 8; ++i) {
    idle.push_back(std::make_unique<TestClient>(port()));
    EXPECT_EQ(idle.back()->get(at("/api/server")).status, 200);
  }
  TestClient late(port());
  EXPECT_EQ(late.get(at("/api/server")).json()["error"]["code"], "E905");
  // who says nothing is let go, and there is room again
  for (auto& c : idle) EXPECT_EQ(c->read_answer().status, 0);
  for (int i = 0; i < 600; ++i) {
    TestClient again(port());
    if (again.get(at("/api/server")).status == 200) return;
    usleep(100000);
  }
  FAIL() << "no room was made";
}

TEST_F(ServerTest, SavesAPlanUnlessTheFileHasChanged) {
  const std::string text = two_stages();
  start(text);
  const auto c = watcher();
  const std::string mine = text + "# mine\n", theirs = text + "# theirs\n";
  const std::string base = hello_["plan"]["sha256"];
  EXPECT_EQ(base, calc_sha256(text));
  EXPECT_EQ(c->result("plan.save", {{"text", mine}, {"base_sha256", base}})["sha256"], calc_sha256(mine));
  EXPECT_EQ(read_file(plan_path_), mine);
  replace_file(plan_path_, theirs);
  EXPECT_EQ(c->wait_for([&](const TestJson& j) {
               return j["type"] == "plan_changed" && j["sha256"] == calc_sha256(theirs);
             }).is_object(),
            true);
  const TestJson conflict = c->command("plan.save", {{"text", mine}, {"base_sha256", calc_sha256(mine)}});
  EXPECT_EQ(conflict["error"]["code"], "E941");
  EXPECT_EQ(conflict["error"]["text"], theirs);
  EXPECT_EQ(read_file(plan_path_), theirs);
  EXPECT_TRUE(c->result("plan.save", {{"text", mine}, {"base_sha256", "x"}, {"force", true}}).contains("sha256"));
  EXPECT_EQ(read_file(plan_path_), mine);
}

TEST_F(ServerTest, APlanWithErrorsIsMendedInThePage) {
  start(two_stages() + "[analysys]\n");
  auto c = std::make_unique<TestClient>(port());
  ASSERT_TRUE(c->upgrade(server_->token()));
  TestJson state = c->wait_for([](const TestJson& j) {
    return (j["type"] == "state" || j["type"] == "hello") &&
           j.value("phase", j.contains("session") && j["session"].is_object() ? j["session"]["phase"].get<std::string>()
                                                                              : "") == "failed";
  });
  ASSERT_TRUE(state.is_object());
  EXPECT_EQ(c->code("run"), "E930");
  const TestJson checked = c->result("plan.check", {{"text", two_stages() + "[analysys]\n"}});
  ASSERT_EQ(checked["diagnostics"].size(), 1U) << checked;
  EXPECT_GT(checked["diagnostics"][0]["line"], 1);
  EXPECT_NE(checked["diagnostics"][0]["help"].get<std::string>().find("analysis"), std::string::npos);
  EXPECT_EQ(c->result("plan.check", {{"text", collapse::house()}})["removes_support"], false);
  EXPECT_EQ(c->command("plan.apply", {{"text", "nonsense"}, {"name", "a"}})["type"], "error");
  EXPECT_EQ(c->result("plan.apply", {{"text", one_stage("0.3 s")}, {"name", "a"}})["branch"], 1);
  c->result("run");
  EXPECT_TRUE(c->wait_for_phase("finished").is_object());
  // another one beside it
  EXPECT_EQ(c->result("plan.apply", {{"text", one_stage("0.2 s")}, {"name", "short"}})["branch"], 2);
}

TEST_F(ServerTest, ALogThatCannotBeWrittenIsNoFaultOfThePlan) {
  replace_file((folder_ / "out").string(), "in the way");
  start(one_stage("0.3 s"));
  auto c = std::make_unique<TestClient>(port());
  ASSERT_TRUE(c->upgrade(server_->token()));
  const TestJson hello = c->wait_for_type("hello");
  const TestJson state =
      hello["state"].is_object() && hello["state"]["phase"] == "failed" ? hello["state"] : c->wait_for_phase("failed");
  ASSERT_TRUE(state.is_object());
  EXPECT_EQ(state["ending"]["kind"], "failed");
  EXPECT_EQ(state["ending"]["code"], "E940");
  const TestJson error = c->command("run")["error"];
  EXPECT_EQ(error["code"], "E940");
  EXPECT_NE(error["message"].get<std::string>().find("the action log cannot be written: Not a directory"),
            std::string::npos)
      << error;
  EXPECT_EQ(c->command("plan.apply", {{"text", one_stage("0.3 s")}})["error"]["code"], "E940");
  fs::remove(folder_ / "out");
  EXPECT_EQ(c->result("plan.apply", {{"text", one_stage("0.3 s")}})["branch"], 1);
  c->result("run");
  EXPECT_TRUE(c->wait_for_phase("finished").is_object());
}

TEST_F(ServerTest, CommandsDoNotWaitForFindings) {
  start(surrounded("1 s"));
  const auto c = watcher();
  c->result("run");
  c->wait_for_phase("finished");
  c->forget();
  // all at once: findings first, then an edit in the past, and its branch runs
  ASSERT_TRUE(c->send_text(R"({"id": 101, "command": "findings"})"));
  ASSERT_TRUE(c->send_text(R"({"id": 102, "command": "rewind", "time": 0.5})"));
  ASSERT_TRUE(c->send_text(R"({"id": 103, "command": "set_friction", "ground": 0.4})"));
  ASSERT_TRUE(c->send_text(R"({"id": 104, "command": "run"})"));
  const auto is_answer = [](const TestJson& j) { return j["type"] == "ack" || j["type"] == "error"; };
  for (const int id : {102, 103, 104}) {
    const TestJson answer = c->wait_for(is_answer);
    EXPECT_EQ(answer["id"], id) << "waited for the findings";
    EXPECT_EQ(answer["type"], "ack") << answer;
  }
  const TestJson moving = c->wait_for([&](const TestJson& j) {
    return is_answer(j) || (j["type"] == "state" && j["branch"] == 2 && j["time"] > 0.55);
  });
  EXPECT_EQ(moving["type"], "state") << "the run waited for the findings";
  const TestJson findings = c->wait_for(is_answer);
  EXPECT_EQ(findings["id"], 101);
  EXPECT_EQ(findings["result"]["branch"], 1) << "of the branch that was active then";
  EXPECT_NEAR(findings["result"]["time"].get<double>(), 1, 0.01) << "at the time when they were asked for";
  EXPECT_EQ(findings["result"]["ending"]["kind"], "time_limit");
  // those of the other branch, and both together
  c->wait_for_phase("finished");
  EXPECT_EQ(c->result("findings")["branch"], 2);
  EXPECT_EQ(c->result("compare", {{"a", 1}, {"b", 2}})["edits"]["b"].size(), 1U);
}

TEST_F(ServerTest, FindingsEndWithTheirSession) {
  start(surrounded("1 s"));
  const auto c = watcher();
  c->result("run");
  c->wait_for_phase("finished");
  // more than are done before the session is closed: one under way, others in line
  const int asked = 8;
  for (int k = 0; k < asked; ++k)
    ASSERT_TRUE(c->send_text(R"({"id": )" + std::to_string(101 + k) + R"(, "command": "findings"})"));
  ASSERT_TRUE(c->send_text(R"({"id": 201, "command": "compare", "a": 1, "b": 1})"));
  TestClient http(port());
  ASSERT_TRUE(http.send_raw("GET " + at("/api/sessions/1/branches/1/findings") + " HTTP/1.1\r\nHost: " + http.host() +
                            "\r\n\r\n"));
  (void)c->result("session.list");  // all of them are in line
  const auto other = watcher();
  EXPECT_EQ(other->result("session.close", {{"session", 1}})["session"], 1);
  int ended = 0;
  for (int k = 0; k <= asked; ++k) {
    const TestJson answer = c->wait_for([](const TestJson& j) { return j["type"] == "ack" || j["type"] == "error"; });
    if (answer["type"] == "error") {
      EXPECT_EQ(answer["error"]["code"], "E930");
      ++ended;
    } else {
      EXPECT_EQ(ended, 0) << "computed after the session was closed: " << answer;
    }
  }
  EXPECT_GE(ended, 2) << "the findings were waited for";
  EXPECT_EQ(http.read_answer().status, 409);
}

TEST_F(ServerTest, SessionsComeAndGo) {
  start(one_stage("0.3 s"));
  const auto c = watcher();
  const int second = c->result("session.open", {{"template", "frame"}})["session"];
  EXPECT_EQ(second, 2);
  const TestJson hello =
      c->wait_for([&](const TestJson& j) { return j["type"] == "hello" && j["session"]["id"] == second; });
  EXPECT_FALSE(hello["plan"]["text"].get<std::string>().empty());
  EXPECT_EQ(c->result("session.list")["sessions"].size(), 2U);
  // the first one still answers
  EXPECT_EQ(c->result("rename", {{"session", 1}, {"branch", 1}, {"name", "old"}})["branch"], 1);
  EXPECT_EQ(c->result("session.close", {{"session", 2}})["session"], 2);
  EXPECT_EQ(c->code("run", {{"session", 2}}), "E920");
  c->result("session.attach", {{"session", 1}});
  c->wait_for([&](const TestJson& j) { return j["type"] == "hello" && j["session"]["id"] == 1; });
  EXPECT_FALSE(c->result("run").contains("refused"));
  EXPECT_TRUE(c->wait_for_phase("finished").is_object());
  for (int i = 0; i < 7; ++i)
    EXPECT_TRUE(c->result("session.open", {{"text", "title = 3"}, {"title", "x"}}).contains("session"));
  EXPECT_EQ(c->code("session.open", {{"text", "title = 3"}}), "E905");
}

TEST_F(ServerTest, ImportsAndShowsADemoWithNothingOpen) {
  start(one_stage("0.3 s"));
  const auto c = watcher();
  c->result("session.close");
  const std::string square =
      "0\nSECTION\n2\nENTITIES\n0\nLWPOLYLINE\n8\nHOUSE\n90\n4\n70\n1\n10\n20\n20\n0\n10\n30\n20\n0\n10\n30\n20\n10\n10"
      "\n"
      "20\n20\n10\n0\nENDSEC\n0\nEOF\n";
  const TestJson site = c->result("plan.import", {{"name", "site.dxf"}, {"text", square}, {"unit", 1}});
  EXPECT_NE(site["text"].get<std::string>().find("[[site.neighbour]]"), std::string::npos) << site;
  EXPECT_FALSE(site["taken"].empty());
  EXPECT_EQ(c->code("plan.import", {{"name", "site.txt"}, {"text", square}}), "E114");
  EXPECT_EQ(c->code("plan.import", {{"name", "b.ifc"}, {"text", "nonsense"}})[0], 'E');
  EXPECT_EQ(c->code("plan.import", {{"name", "b.ifc"}, {"text", "nonsense"}, {"unit", 1}}), "E912");
  EXPECT_EQ(c->code("plan.import", {{"name", "site.dxf"}, {"text", square}, {"unit", -1}}), "E912");
  TestClient http(port());
  const TestJson templates = http.get(at("/api/templates")).json();
  EXPECT_GE(templates["templates"].size(), 1U);
  EXPECT_EQ(templates["demo"]["title"], "A house");
  c->forget();
  EXPECT_EQ(c->result("session.open", {{"demo", true}})["session"], 2);
  EXPECT_FALSE(c->result("run").contains("refused"));
  EXPECT_TRUE(c->wait_for_phase("finished").is_object());
}

TEST_F(ServerTest, AStudyGrowsAndASampleIsPlayed) {
  start(product::small_plan() + study::strengths);
  const auto c = watcher();
  const TestJson started = c->result("study.start", {{"samples", 12}});
  ASSERT_EQ(started["study"], 1) << started;
  std::size_t samples = 0;
  TestJson study;
  do {
    const TestJson e = c->wait_for_type("study");
    ASSERT_TRUE(e.is_object());
    samples += e["samples"].size();
    study = e["study"];
  } while (study["state"] == "running");
  EXPECT_EQ(study["state"], "finished") << study["text"];
  EXPECT_EQ(samples, 12U);
  EXPECT_EQ(study["done"], 12);
  EXPECT_FALSE(study["inputs"].empty());
  EXPECT_FALSE(study["bounds"].empty());
  EXPECT_FALSE(study["possibilities"].empty());
  EXPECT_EQ(study["fans"]["alpha"].size(), study["fans"]["low"].size());
  for (const char* key : {"low", "high"})
    for (const TestJson& row : study["fans"][key]) EXPECT_EQ(row.size(), study["fans"]["time"].size());
  const TestJson watched = c->result("study.watch", {{"study", 1}});
  EXPECT_EQ(watched["samples"].size(), 12U);
  const TestJson played = c->result("study.play", {{"study", 1}, {"sample", 3}});
  EXPECT_EQ(played["branch"], 2) << played;
  EXPECT_EQ(c->code("study.play", {{"study", 1}, {"sample", 99}}), "E920");
  c->result("run");
  EXPECT_TRUE(c->wait_for_phase("finished").is_object());
  TestClient http(port());
  const auto results = http.get(at("/api/studies/1/results.json"));
  ASSERT_EQ(results.status, 200);
  // in the units that are shown, like the results
  const TestJson written = TestJson::parse(results.body)["outputs"];
  ASSERT_EQ(written.size(), study["bounds"].size());
  for (std::size_t i = 0; i < written.size(); ++i) {
    EXPECT_EQ(study["outputs"][i]["unit"], written[i]["unit"]);
    EXPECT_EQ(study["bounds"][i]["high"][0], written[i]["levels"][0]["upper"]) << written[i]["name"];
  }
  const HttpAnswer page = http.get(at("/api/studies/1/study.html"));
  EXPECT_EQ(page.status, 200);
  EXPECT_NE(page.head.find("text/html"), std::string::npos);
  EXPECT_EQ(page.body.rfind("<title>study</title><script type=\"application/json\"", 0), 0U) << page.body.substr(0, 99);
  EXPECT_NE(page.body.find("membership"), std::string::npos);
}

TEST_F(ServerTest, StudiesThatHaveEndedGiveWay) {
  start(product::small_plan() + study::strengths);
  const auto c = watcher();
  for (int k = 1; k <= 18; ++k) {
    const TestJson started = c->result("study.start", {{"samples", 2}, {"seed", k}});
    ASSERT_EQ(started["study"], k) << started;
    c->result("study.cancel", {{"study", k}});
    c->wait_for([&](const TestJson& j) {
      return j["type"] == "study" && j["study"]["id"] == k && j["study"]["state"] != "running";
    });
  }
  const TestJson list = c->result("study.list")["studies"];
  ASSERT_EQ(list.size(), 16U);
  EXPECT_EQ(list.front()["id"], 3);
  EXPECT_EQ(c->code("study.watch", {{"study", 1}}), "E920");
}

TEST_F(ServerTest, AStudyTakesTheEditsOfTheBranch) {
  start(product::small_plan() + study::strengths);
  const auto c = watcher();
  EXPECT_EQ(c->result("plan.text", {{"edits", true}})["text"], read_file(plan_path_));
  EXPECT_EQ(c->result("set_delay", {{"stage", 1}, {"time", 1.9}})["branch"], 1);
  c->result("run", {{"until", 0.005}});
  c->wait_for([](const TestJson& j) { return j["type"] == "state" && j["phase"] == "paused" && j["time"] > 0; });
  c->result("set_friction", {{"ground", 0.31}, {"bodies", 0.31}, {"in_place", true}});
  const TestJson plan = c->result("plan.text", {{"edits", true}});
  EXPECT_EQ(plan["taken"].size(), 1U) << plan;
  EXPECT_EQ(plan["left_out"].size(), 1U) << plan;
  EXPECT_NE(plan["text"].get<std::string>().find("\"1.9 s\""), std::string::npos);
  const TestJson with = c->result("study.start", {{"samples", 2}}),
                 without = c->result("study.start", {{"samples", 2}, {"edits", false}});
  EXPECT_EQ(with["taken"], plan["taken"]) << with;
  EXPECT_EQ(with["left_out"], plan["left_out"]);
  EXPECT_TRUE(without["taken"].empty());
  EXPECT_NE(with["state"]["folder"], without["state"]["folder"]) << "another plan is another study";
  c->result("study.cancel", {{"study", 1}});
  c->result("study.cancel", {{"study", 2}});
}

}  // namespace
}  // namespace topple::server
