#include "study/store.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <bit>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <limits>
#include <set>
#include <thread>

#include "base/error.h"
#include "server.h"

namespace topple::study {
namespace {

using Kind = Answer::Kind;

/// The same claims of both kinds of store.
class Stores : public testing::TestWithParam<const char*> {
 protected:
  static void SetUpTestSuite() { server_ = Server::make().release(); }
  static void TearDownTestSuite() {
    delete server_;
    server_ = nullptr;
  }
  void SetUp() override {
    if (std::string(GetParam()) == "SQLite") {
      address = folder / "study.sqlite";
      return;
    }
    if (!server_) GTEST_SKIP() << "PostgreSQL is not installed";
    address = server_->url();
    open_database(address)->run("DROP TABLE IF EXISTS model, study, job, result");
  }
  /// Numbers of jobs that are `state`.
  static Answer done(double value) { return {Kind::Done, {{"z", value}}, "falls", {}, "", 0.5}; }

  Folder folder;
  std::string address;
  inline static Server* server_ = nullptr;
};

TEST_P(Stores, KeepEveryBitOfANumber) {
  Store store(address);
  const double tiny = std::numeric_limits<double>::denorm_min(), third = 1.0 / 3;
  const double nan = std::numeric_limits<double>::quiet_NaN(), infinite = std::numeric_limits<double>::infinity();
  store.add_jobs("m", {{"h", {third, -tiny, 1e300}}});
  const std::vector<Job> jobs = store.claim("w", 1, 60);
  ASSERT_EQ(jobs.size(), 1u);
  EXPECT_EQ(jobs[0].inputs, (Point{third, -tiny, 1e300}));
  Answer a = done(std::nextafter(0.1, 1));
  a.outputs.emplace_back("-0 \"ü\"", -0.0);
  a.trajectory = {third, infinite, -infinite, nan, 5e-324};
  a.outcome = "vertical 'collapse'";
  EXPECT_TRUE(store.finish(jobs[0], "w", a));
  const std::vector<StoredResult> found = store.find_results({"h", "unknown"});
  ASSERT_EQ(found.size(), 1u);
  const Answer& b = found[0].answer;
  EXPECT_EQ(b.outcome, a.outcome);
  EXPECT_EQ(b.outputs, a.outputs);
  EXPECT_TRUE(std::signbit(b.outputs[1].second));
  ASSERT_EQ(b.trajectory.size(), 5u);
  for (const int i : {0, 1, 2, 4}) EXPECT_EQ(b.trajectory[i], a.trajectory[i]);
  EXPECT_TRUE(std::isnan(b.trajectory[3]));
  EXPECT_EQ(b.seconds, 0.5);
}

TEST_P(Stores, GiveAJobToOneWorkerOnly) {
  Store store(address);
  store.add_jobs("m", {{"a", {1}}, {"b", {2}}, {"a", {1}}});
  store.add_jobs("m", {{"b", {2}}, {"c", {3}}});
  Store other(address);
  const std::vector<Job> first = store.claim("w1", 2, 60), second = other.claim("w2", 2, 60);
  ASSERT_EQ(first.size(), 2u);
  EXPECT_EQ(first[0].hash, "a");
  EXPECT_EQ(first[1].hash, "b");
  ASSERT_EQ(second.size(), 1u);
  EXPECT_EQ(second[0].hash, "c");
  EXPECT_EQ(second[0].attempt, 1);
  EXPECT_TRUE(other.claim("w3", 1, 60).empty());
  EXPECT_EQ(store.count("m").running, 3);
}

TEST_P(Stores, GiveJobsOfOneModelToThoseWhoWantNoOther) {
  Store store(address);
  store.add_jobs("m", {{"a", {1}}});
  store.add_jobs("n", {{"b", {1}}});
  EXPECT_EQ(store.claim("w", 5, 60, "n").at(0).hash, "b");
  EXPECT_TRUE(store.claim("x", 5, 60, "n").empty());
  EXPECT_EQ(store.claim("x", 5, 60).at(0).hash, "a");
}

TEST_P(Stores, TakeAnExpiredLeaseAndTheAnswerThatIsFirst) {
  Store store(address);
  store.add_jobs("m", {{"a", {1}}, {"b", {1}}});
  const std::vector<Job> slow = store.claim("slow", 2, 0);
  std::this_thread::sleep_for(std::chrono::milliseconds(20));
  const std::vector<Job> quick = store.claim("quick", 2, 60);  // both are lost once only
  ASSERT_EQ(quick.size(), 2u);
  EXPECT_EQ(quick[0].attempt, 2);
  EXPECT_EQ(quick[0].vanished, 1);
  store.renew({"slow"}, 60);
  EXPECT_TRUE(store.finish(quick[0], "quick", done(2)));
  EXPECT_FALSE(store.finish(slow[0], "slow", done(1))) << "it came too late";
  EXPECT_FALSE(store.finish(quick[0], "quick", done(3))) << "a second time";
  EXPECT_EQ(store.find_results({"a"}).at(0).answer.outputs[0].second, 2);
  // who was silent and is not dead
  for (const Kind kind : {Kind::Cancelled, Kind::Crashed, Kind::Refused})
    EXPECT_FALSE(store.finish(slow[1], "slow", {kind, {}, "", {}, "", 0})) << "it tells nothing";
  EXPECT_EQ(store.count("m").running, 1);
  EXPECT_TRUE(store.finish(slow[1], "slow", done(1)));
  for (const Kind kind : {Kind::Cancelled, Kind::Crashed, Kind::Failed, Kind::Done})
    EXPECT_FALSE(store.finish(quick[1], "quick", {kind, {}, "", {}, "", 0}));
  EXPECT_EQ(store.find_results({"b"}).at(0).answer.outputs[0].second, 1);
  EXPECT_EQ(store.count("m").done, 2);
  // an answer to a question of before
  store.rerun({"a"});
  EXPECT_FALSE(store.finish(slow[0], "slow", done(1)));
}

// As a clock that jumps does it, or a machine that slept.
TEST_P(Stores, LeaveAJobToItsThreadWhateverItsLeaseSays) {
  Store store(address);
  store.add_jobs("m", {{"a", {1}}});
  const Job job = store.claim("host:1:aa:0", 1, 0).at(0);
  std::this_thread::sleep_for(std::chrono::milliseconds(20));
  for (const char* mine : {"host:1:aa:0", "host:1:aa:1", "host:1:aa:10"}) EXPECT_TRUE(store.claim(mine, 1, 60).empty());
  EXPECT_TRUE(store.finish(job, "host:1:aa:0", done(1)));
}

TEST_P(Stores, KeepALeaseThatIsRenewed) {
  Store store(address);
  store.add_jobs("m", {{"a", {1}}});
  store.claim("w", 1, 0);
  store.renew({"w", "other"}, 60);
  EXPECT_TRUE(store.claim("x", 1, 60).empty());
}

TEST_P(Stores, PutAsideWhatCrashesThreeTimes) {
  Store store(address);
  store.add_jobs("m", {{"a", {1}}, {"b", {1}}});
  for (int attempt = 1; attempt <= most_attempts; ++attempt) {
    const Job job = store.claim("w", 1, 60).at(0);
    EXPECT_EQ(job.hash, "a");
    EXPECT_EQ(job.attempt, attempt);
    EXPECT_TRUE(store.find_results({"a"}).empty());
    EXPECT_TRUE(store.finish(job, "w", {Kind::Crashed, {}, "", {}, "signal 11", 0}));
  }
  EXPECT_EQ(store.find_results({"a"}).at(0).answer.kind, Kind::Failed);
  EXPECT_EQ(store.find_results({"a"}).at(0).answer.text, "signal 11");
  // workers that vanish
  for (int k = 1; k <= most_vanished; ++k) {
    EXPECT_EQ(store.quarantine(), 0);
    EXPECT_EQ(store.claim("gone:" + std::to_string(k) + ":0", 1, 0).at(0).hash, "b");
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  EXPECT_TRUE(store.claim("w", 1, 60).empty());
  EXPECT_EQ(store.quarantine("gone:" + std::to_string(most_vanished)), 0) << "it is there still";
  EXPECT_EQ(store.quarantine("gone"), 0);
  EXPECT_EQ(store.quarantine("elsewhere"), 1);
  EXPECT_EQ(store.quarantine(), 0);
  EXPECT_EQ(store.find_results({"b"}).at(0).answer.text, "its worker vanished 10 times");
  EXPECT_EQ(store.count("m").failed, 2);
  // a second chance
  EXPECT_EQ(store.rerun_failed("m"), 2);
  EXPECT_TRUE(store.find_results({"a", "b"}).empty());
  EXPECT_EQ(store.claim("w", 5, 60).size(), 2u);
}

// One of them ends whoever runs it: no other is to be taken for it.
TEST_P(Stores, GiveWhatWasLostTwiceAlone) {
  Store store(address);
  store.add_jobs("m", {{"a", {1}}, {"b", {1}}, {"c", {1}}, {"d", {1}}});
  int name = 0;
  const auto lose = [&](int count) {
    const std::vector<Job> jobs = store.claim("gone:" + std::to_string(++name) + ":0", count, 0);
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
    return jobs.size();
  };
  EXPECT_EQ(lose(3), 3u);
  EXPECT_EQ(lose(3), 3u) << "lost once, as with a machine that went";
  // a process takes one suspect at a time, and fresh ones beside it
  const std::vector<Job> suspect = store.claim("w:0", 4, 60);
  ASSERT_EQ(suspect.size(), 1u);
  EXPECT_EQ(suspect[0].hash, "a");
  EXPECT_EQ(suspect[0].vanished, suspect_vanished);
  const std::vector<Job> fresh = store.claim("w:1", 4, 60, {}, false);
  ASSERT_EQ(fresh.size(), 1u);
  EXPECT_EQ(fresh[0].hash, "d");
  EXPECT_TRUE(store.claim("w:2", 4, 60, {}, false).empty());
  EXPECT_EQ(store.claim("v:0", 4, 60).at(0).hash, "b");
  EXPECT_EQ(store.claim("u:0", 4, 60).at(0).hash, "c");
}

// Workers that were killed say nothing of a model that breaks off, and the other way round.
TEST_P(Stores, CountWorkersThatVanishApartFromCrashes) {
  Store store(address);
  store.add_jobs("m", {{"a", {1}}, {"b", {1}}});
  int name = 0;
  const auto vanish = [&] {
    store.claim("gone:" + std::to_string(++name) + ":0", 1, 0);
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  };
  for (int k = 0; k < most_attempts + 2; ++k) vanish();
  EXPECT_EQ(store.quarantine(), 0);
  Job job = store.claim("w", 1, 60).at(0);
  EXPECT_EQ(job.vanished, most_attempts + 2);
  EXPECT_TRUE(store.finish(job, "w", done(1)));
  EXPECT_EQ(store.find_results({"a"}).at(0).answer.kind, Kind::Done);
  for (int crash = 1; crash <= most_attempts; ++crash) {
    EXPECT_TRUE(store.find_results({"b"}).empty());
    vanish();
    job = store.claim("w", 1, 60).at(0);
    EXPECT_EQ(job.hash, "b");
    EXPECT_TRUE(store.finish(job, "w", {Kind::Crashed, {}, "", {}, "signal 11", 0}));
  }
  EXPECT_EQ(store.find_results({"b"}).at(0).answer.text, "signal 11");
}

TEST_P(Stores, TakeTablesOfEarlierVersions) {
  {
    const auto db = open_database(address);
    Store store(address);
    store.add_jobs("m", {{"a", {1}}, {"b", {2}}});
    EXPECT_TRUE(store.finish(store.claim("w", 1, 60).at(0), "w", done(1)));
    db->run("ALTER TABLE job DROP COLUMN vanished");
  }
  {
    Store seen(address, nullptr, 10, true);
    EXPECT_EQ(seen.load_results("m").size(), 1u) << "it is read as it is";
  }
  for (int k = 0; k < 2; ++k) {
    Store store(address);
    EXPECT_EQ(store.load_results("m").size(), 1u);
    const Job job = store.claim("w", 1, 60).at(0);
    EXPECT_EQ(job.hash, "b");
    EXPECT_EQ(job.vanished, 0);
    EXPECT_TRUE(store.finish(job, "w", {}));
  }
}

TEST_P(Stores, CountNoAttemptForACancelledRun) {
  Store store(address);
  store.add_jobs("m", {{"a", {1}}});
  for (int i = 0; i < 5; ++i) {
    const Job job = store.claim("w", 1, 60).at(0);
    EXPECT_EQ(job.attempt, 1);
    EXPECT_TRUE(store.finish(job, "w", {}));
  }
  EXPECT_EQ(store.count("m").waiting, 1);
}

TEST_P(Stores, HoldARefusedJobUntilItIsForgotten) {
  Store store(address);
  store.add_jobs("m", {{"a", {1}}});
  EXPECT_TRUE(store.finish(store.claim("w", 1, 60).at(0), "w", {Kind::Refused, {}, "", {}, "line 3", 0}));
  EXPECT_EQ(store.find_refusal("m"), "line 3");
  EXPECT_EQ(store.find_refusal("other"), std::nullopt);
  EXPECT_TRUE(store.claim("w", 1, 60).empty());
  store.forget_refusals("m");
  EXPECT_EQ(store.claim("w", 1, 60).at(0).attempt, 1);
}

TEST_P(Stores, NameTheRowThatIsDamaged) {
  Store store(address);
  store.add_jobs("m", {{"abc", {1, 2}}});
  store.finish(store.claim("w", 1, 60).at(0), "w", done(3));
  const auto db = open_database(address);
  const auto complaint = [](const std::function<void()>& read) -> std::string {
    try {
      read();
    } catch (const InputError& e) {
      const Diagnostic& d = e.diagnostics().front();
      return d.code + " " + d.message + (d.help.empty() ? " without help" : "");
    }
    return "none";
  };
  for (const auto& [column, whole, wrong] :
       std::vector<std::array<std::string, 3>>{{"outputs", R"({"z":3.0})", R"({"z":3.)"},
                                               {"outputs", R"({"z":3.0})", "[3.0]"},
                                               {"outputs", R"({"z":3.0})", R"({"z":"3"})"},
                                               {"outputs", R"({"z":3.0})", ""},
                                               {"trajectory", "[]", "[1,"},
                                               {"trajectory", "[]", R"({"a":1})"}}) {
    db->run("UPDATE result SET " + column + " = $1", {wrong});
    const std::string expected =
        "E820 " + hide_password(address) + " is damaged: the row abc of the table result has no valid " + column;
    EXPECT_EQ(complaint([&] { store.find_results({"abc"}); }), expected) << wrong;
    EXPECT_EQ(complaint([&] { store.load_results("m"); }), expected) << wrong;
    EXPECT_EQ(complaint([&] { store.find_form("m"); }), expected) << wrong;
    db->run("UPDATE result SET " + column + " = $1", {whole});
  }
  EXPECT_EQ(store.find_results({"abc"}).at(0).answer.outputs, done(3).outputs);
  db->run("UPDATE job SET inputs = '[1, 2', state = 'waiting'");
  const std::string expected =
      "E820 " + hide_password(address) + " is damaged: the row abc of the table job has no valid inputs";
  EXPECT_EQ(complaint([&] { store.load_results("m"); }), expected);
  EXPECT_EQ(complaint([&] { store.claim("w", 1, 60); }), expected);
}

TEST_P(Stores, RememberStudiesAndModels) {
  Store store(address);
  store.put_model("m", "{}");
  store.put_model("m", "{\"timeout\": 3}");
  EXPECT_EQ(store.find_model("m"), "{\"timeout\": 3}");
  EXPECT_EQ(store.find_model("n"), std::nullopt);
  store.put_study({"s", "m", "{}", "open", ""});
  store.put_study({"s", "m", "{}", "finished", "{}"});
  EXPECT_EQ(store.count_studies(), std::pair(1L, 0L));
  store.put_study({"open", "m", "{}", "open", ""});
  EXPECT_EQ(store.count_studies(), std::pair(2L, 1L));
  EXPECT_EQ(Store(address).find_study("s")->state, "finished");
  EXPECT_FALSE(store.find_study("t"));
}

TEST_P(Stores, BeginAStudyForOneOfThoseWhoSawNone) {
  Store store(address), other(address);
  const StudyRow first{"s", "m", "{\"a\": 1}", "open", ""}, second{"s", "n", "{\"b\": 2}", "open", ""};
  EXPECT_TRUE(store.begin_study(first, std::nullopt));
  EXPECT_FALSE(other.begin_study(second, std::nullopt));
  EXPECT_EQ(store.find_study("s")->definition, first.definition);
  const StudyRow finished{"s", "m", first.definition, "finished", "{}"};
  store.put_study(finished);
  EXPECT_FALSE(other.begin_study(second, first)) << "it was finished meanwhile";
  EXPECT_TRUE(other.begin_study(second, finished));
  EXPECT_EQ(store.find_study("s")->model, "n");
  EXPECT_EQ(store.find_study("s")->state, "open");
  EXPECT_FALSE(store.begin_study(first, first));
  EXPECT_EQ(store.find_study("s")->definition, second.definition);
}

TEST_P(Stores, FinishEveryJobOnceAmongManyWorkers) {
  constexpr int count = 300, threads = 6;
  {
    Store store(address);
    std::vector<std::pair<std::string, Point>> jobs;
    for (int i = 0; i < count; ++i) jobs.emplace_back(calc_job_hash("m", {1.0 * i}), Point{1.0 * i});
    store.add_jobs("m", jobs);
  }
  std::vector<std::thread> workers;
  std::atomic<int> finished = 0, claimed = 0;
  for (int t = 0; t < threads; ++t)
    workers.emplace_back([&, t] {
      Store store(address);
      const std::string name = "w" + std::to_string(t);
      for (;;) {
        const std::vector<Job> jobs = store.claim(name, 1 + t % 3, 60);
        if (jobs.empty()) return;
        for (const Job& job : jobs) ++claimed, finished += store.finish(job, name, done(job.inputs[0]));
      }
    });
  for (std::thread& w : workers) w.join();
  EXPECT_EQ(claimed, count);
  EXPECT_EQ(finished, count);
  Store store(address);
  const std::vector<StoredResult> results = store.load_results("m");
  ASSERT_EQ(results.size(), static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) {
    EXPECT_EQ(results[i].inputs, Point{1.0 * i}) << "in the order in which they were added";
    EXPECT_EQ(results[i].answer.outputs[0].second, i);
  }
}

INSTANTIATE_TEST_SUITE_P(Both, Stores, testing::Values("SQLite", "PostgreSQL"),
                         [](const auto& kind) { return std::string(kind.param); });

TEST(Store, NamesAJobByTheBitsOfItsPoint) {
  EXPECT_EQ(calc_job_hash("m", {0.0}), calc_job_hash("m", {-0.0}));
  EXPECT_NE(calc_job_hash("m", {1.0}), calc_job_hash("m", {std::nextafter(1.0, 2)}));
  EXPECT_NE(calc_job_hash("m", {1.0}), calc_job_hash("n", {1.0}));
}

TEST(Store, HidesPasswords) {
  EXPECT_EQ(hide_password("postgresql://me:secret@host:5432/db"), "postgresql://me@host:5432/db");
  EXPECT_EQ(hide_password("postgresql://host:5432/db?a=b@c"), "postgresql://host:5432/db?a=b@c");
  EXPECT_EQ(hide_password("postgresql://me@host/db?password=secret&sslmode=disable"),
            "postgresql://me@host/db?password=...&sslmode=disable");
  EXPECT_EQ(hide_password("folder/a:b@c"), "folder/a:b@c");
}

TEST(Store, IsReadWhereNothingCanBeWritten) {
  const Folder folder;
  const std::string path = folder / "s 100%?.sqlite";
  { Store(path).put_study({"main", "m", "{}", "open", ""}); }
  const auto count = [](const std::string& where) {
    long n = 0;
    for (const auto& entry : std::filesystem::directory_iterator(where)) n += entry.exists();
    return n;
  };
  const std::filesystem::path place = std::filesystem::path(path).parent_path();
  const long before = count(place);
  std::filesystem::permissions(path, std::filesystem::perms::owner_read);
  std::filesystem::permissions(place, std::filesystem::perms::owner_read | std::filesystem::perms::owner_exec);
  {
    Store store(path, nullptr, 1, true);
    EXPECT_TRUE(store.find_study("main").has_value());
    if (geteuid() != 0) { EXPECT_THROW(store.put_study({"other", "m", "{}", "open", ""}), InputError); }
  }
  std::filesystem::permissions(place, std::filesystem::perms::owner_all);
  EXPECT_EQ(count(place), before);
  EXPECT_THROW(Store(folder / "none", nullptr, 1, true), InputError) << "nothing is made";
}

TEST(Store, KnowsWhoElseHasItOpen) {
  const Folder folder;
  const std::string path = folder / "s.sqlite";
  EXPECT_FALSE(is_open_elsewhere(path)) << "there is none";
  EXPECT_FALSE(std::filesystem::exists(path));
  {
    Store store(path);
    store.put_study({"main", "m", "{}", "open", ""});
    EXPECT_TRUE(is_open_elsewhere(path));
    const pid_t other = fork();
    if (other == 0) _exit(is_open_elsewhere(path) ? 1 : 0);
    EXPECT_EQ(wait_for(other), 1);
    store.put_study({"main", "m", "{}", "finished", ""});
  }
  EXPECT_FALSE(is_open_elsewhere(path));
  EXPECT_EQ(Store(path).find_study("main")->state, "finished");
  EXPECT_EQ(open_database(path)->run("PRAGMA journal_mode").at(0).at(0), "wal");
}

TEST(Store, SaysWhichFileIsDamaged) {
  const Folder folder;
  const std::string path = folder / "s.sqlite";
  {
    Store store(path);
    for (int i = 0; i < 300; ++i)
      store.put_study({"study " + std::to_string(i), "m", std::string(500, 'x'), "open", ""});
  }
  {
    std::fstream file(path, std::ios::in | std::ios::out | std::ios::binary);
    for (int page = 2; page < 30; ++page) file.seekp(4096 * page), file << std::string(2000, 'y');
  }
  for (const bool is_read_only : {true, false}) try {
      Store store(path, nullptr, 1, is_read_only);
      for (int i = 0; i < 300; ++i) store.find_study("study " + std::to_string(i));
      ADD_FAILURE() << "read";
    } catch (const InputError& e) {
      EXPECT_EQ(e.diagnostics().front().code, "E820");
      EXPECT_NE(e.diagnostics().front().message.find("s.sqlite"), std::string::npos);
      EXPECT_FALSE(e.diagnostics().front().help.empty());
    }
}

TEST(Store, SaysOnceThatTheHeadOfAFileIsDamaged) {
  const Folder folder;
  const std::string path = folder / "s.sqlite";
  { Store store(path); }
  std::fstream(path, std::ios::in | std::ios::out | std::ios::binary).seekp(100) << std::string(3000, 'y');
  for (const bool is_read_only : {true, false}) try {
      Store(path, nullptr, 1, is_read_only);
      ADD_FAILURE() << "read";
    } catch (const InputError& e) {
      const std::string message = e.diagnostics().front().message;
      EXPECT_NE(message.find("is damaged"), std::string::npos) << message;
      EXPECT_EQ(message.find("E820"), std::string::npos) << message;
    }
}

TEST(Store, SaysAtOnceThatADatabaseIsMissing) {
  const auto server = Server::make();
  if (!server) GTEST_SKIP() << "PostgreSQL is not installed";
  const std::string url = server->url();
  try {
    Store store(url.substr(0, url.rfind('/')) + "/nobody_made_it", nullptr, 5);
    FAIL() << "opened";
  } catch (const InputError& e) {
    EXPECT_EQ(e.diagnostics().front().code, "E820");
    EXPECT_NE(e.diagnostics().front().message.find("nobody_made_it"), std::string::npos);
  }
}

#ifdef TOPPLE_POSTGRESQL
TEST(Store, SaysAtOnceThatSettingsAreWrong) {
  for (const char* rest : {":1/db?sslmode=never", ":1x/db", ":1/db?nothing=1"}) try {
      Store store(std::string("postgresql://me:secret@127.0.0.1") + rest, nullptr, 5);
      FAIL() << "opened";
    } catch (const InputError& e) {
      EXPECT_EQ(e.first_error().code, "E820");
      EXPECT_EQ(std::string(e.what()).find("secret"), std::string::npos) << e.what();
    }
}

TEST(Store, SaysOnceThatItWaitsForAServer) {
  std::vector<std::string> told;
  on_waiting([&](const std::string& what) { told.push_back(what); });
  EXPECT_THROW(Store("postgresql://me:secret@127.0.0.1:1/db", nullptr, 0.5), ConnectionLost);
  on_waiting(nullptr);
  ASSERT_EQ(told.size(), 1U);
  EXPECT_EQ(told[0].rfind("waiting for postgresql://me@127.0.0.1:1/db: ", 0), 0U) << told[0];
  EXPECT_NE(told[0].find("refused"), std::string::npos) << told[0];
}
#endif

TEST(Store, RefusesAFileThatIsNone) {
  const Folder folder;
  std::ofstream(folder / "notes.txt") << std::string(5000, 'x');
  EXPECT_THROW(Store(folder / "notes.txt"), InputError);
  EXPECT_THROW(Store(folder / "missing/study.sqlite"), InputError);
}

TEST(Store, IsNotHeldUpByATransactionThatStandsStill) {
  const auto server = Server::make();
  if (!server) GTEST_SKIP() << "PostgreSQL is not installed";
  Store store(server->url());
  store.add_jobs("m", {{"a", {1}}, {"b", {2}}});
  const Job a = store.claim("stopped", 1, 0).at(0);
  // as a process does that is stopped while it finishes
  const auto stopped = open_database(server->url());
  stopped->run("BEGIN");
  stopped->run("UPDATE job SET state = 'done' WHERE hash = 'a'");
  Store other(server->url());  // makes nothing that would wait
  EXPECT_EQ(other.claim("w", 5, 60).at(0).hash, "b");
  const auto start = std::chrono::steady_clock::now();
  std::vector<Job> jobs;
  while (jobs.empty() && std::chrono::steady_clock::now() - start < std::chrono::seconds(20)) {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    jobs = other.claim("w2", 5, 60);
  }
  ASSERT_EQ(jobs.size(), 1u) << "the server ended that transaction";
  EXPECT_EQ(jobs[0].hash, "a");
  EXPECT_THROW(stopped->run("COMMIT"), ConnectionLost);
  EXPECT_TRUE(other.finish(jobs[0], "w2", {Kind::Done, {{"z", 1}}, "", {}, "", 0}));
  EXPECT_FALSE(store.finish(a, "stopped", {Kind::Done, {{"z", 1}}, "", {}, "", 0}));
}

// A server that is stopped at once says so before it goes: whoever writes then has both a warning to read and a broken
// connection.
TEST(Store, SurvivesAServerThatIsStoppedAtOnce) {
  const auto server = Server::make();
  if (!server) GTEST_SKIP() << "PostgreSQL is not installed";
  const std::string much(20000, 'x');  // sent in two pieces: the second one fails
  for (int round = 0; round < 3; ++round) {
    const auto db = open_database(server->url());
    db->run("SELECT length($1)", {"little"});  // so that it is prepared
    server->stop(SIGQUIT);
    EXPECT_THROW(db->run("SELECT length($1)", {much}), ConnectionLost);
    server->start();
    db->reconnect();
    EXPECT_EQ(db->run("SELECT length($1)", {much}).at(0).at(0), std::to_string(much.size()));
  }
}

TEST(Store, SurvivesAServerThatIsKilled) {
  const auto server = Server::make();
  if (!server) GTEST_SKIP() << "PostgreSQL is not installed";
  Store store(server->url());
  store.add_jobs("m", {{"a", {1}}, {"b", {2}}});
  const Job a = store.claim("w", 1, 600).at(0);
  server->stop(SIGKILL);
  std::thread later([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
    server->start();
  });
  EXPECT_TRUE(store.finish(a, "w", {Kind::Done, {{"z", 1}}, "", {}, "", 0}));
  later.join();
  server->stop(SIGQUIT);
  server->start();
  EXPECT_EQ(store.find_results({"a"}).size(), 1u);
  EXPECT_EQ(store.claim("w", 5, 600).at(0).hash, "b");
}

}  // namespace
}  // namespace topple::study
