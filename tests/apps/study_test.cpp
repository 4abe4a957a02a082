// topple study and topple worker as processes that are killed, stopped and started again.

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "../collapse/plans.h"
#include "study_program.h"

namespace topple::study {
namespace {

using json = nlohmann::json;

class StudyReference : public StudyProgram, public testing::WithParamInterface<int> {};

TEST_P(StudyReference, IsMetThroughAnEvaluator) {
  const cases::Case c = cases::make_all().at(static_cast<std::size_t>(GetParam()));
  write_inputs(folder / "in.toml", c.inputs);
  ASSERT_EQ(run(study("out", "'" + c.name + "'", {"--batch", "50", "--samples", "10000"})), 0) << read(folder / "log");
  const json r = json::parse(read(folder / "out/results.json"));
  EXPECT_LE(r["runs"].get<int>(), 10000);
  EXPECT_EQ(r["failed"], 0);
  ASSERT_EQ(r["outputs"].size(), c.outputs.size());
  for (std::size_t o = 0; o < c.outputs.size(); ++o) {
    const auto& at = c.outputs[o].at;
    // the references have six decimals
    const double tolerance = std::max(c.tolerance * (at[0][1] - at[0][0]), 6e-7);
    for (int k = 0; k < 4; ++k) {
      const json& level = r["outputs"][o]["levels"][static_cast<std::size_t>(k)];
      EXPECT_EQ(level["alpha"], 0.25 * k);
      EXPECT_NEAR(level["lower"].get<double>(), at[k][0], tolerance) << c.name << " output " << o << " level " << k;
      EXPECT_NEAR(level["upper"].get<double>(), at[k][1], tolerance) << c.name << " output " << o << " level " << k;
    }
  }
  if (c.name == "jump") {
    EXPECT_EQ(r["outcomes"][1]["name"], "falls");
    EXPECT_NEAR(r["outcomes"][1]["possibility"].get<double>(), .456598936, 1e-3);
  }
}

INSTANTIATE_TEST_SUITE_P(Cases, StudyReference, testing::Range(0, 8));

TEST(StudyReferences, AreAllThere) { EXPECT_EQ(cases::make_all().size(), 8u); }

using StudyReferenceBoxes = StudyProgram;

// Reference case "jump": the permissible part of R = x1 x2 / 100 >= 8 is .879201442 of the support, its largest box has
// the corner (20.225996, 39.553059) and the area 1200.224726 of 35 x 54.4. As an outcome, and as a limit of a number.
TEST_F(StudyReferenceBoxes, OfAnEvaluatorComeNearTheLargest) {
  write_inputs(folder / "in.toml", cases::make_jump_inputs());
  const double whole = 35 * 54.4;
  // z = R - 8, less 10 where R < 8
  for (const std::string requirement : {"stands", "z0 >= 0"}) {
    const std::string out = requirement.substr(0, 2);
    ASSERT_EQ(run(study(out, "jump", {"--batch", "50", "--samples", "8000", "--permissible", requirement})), 0)
        << read(folder / "log");
    const json r = json::parse(read(folder / out + "/results.json"));
    EXPECT_LE(r["runs"].get<int>(), 8000);
    const json& boxes = r["boxes"];
    EXPECT_EQ(boxes["requirement"], requirement);
    EXPECT_NEAR(boxes["permissible_part"].get<double>(), .879201442, 3 * boxes["permissible_part_error"].get<double>());
    ASSERT_FALSE(boxes["list"].empty());
    const json& best = boxes["list"][0];
    EXPECT_TRUE(best["kept"].get<bool>());
    const auto side = [&](int input, const char* end) {
      return best["inputs"][static_cast<std::size_t>(input)][end].get<double>();
    };
    EXPECT_GE(side(0, "lower") * side(1, "lower"), 800) << "every point of the box is permissible";
    const double area = (side(0, "upper") - side(0, "lower")) * (side(1, "upper") - side(1, "lower"));
    EXPECT_LE(area, 1200.224726);
    // a margin of 0.5 % of each width on both axes
    EXPECT_NEAR(area / whole, 1200.224726 / whole, 0.02) << requirement;
    EXPECT_NEAR(best["volume"].get<double>(), area / whole, 1e-9);
    // a row for each input and box, below the names
    const std::string csv = read(folder / out + "/boxes.csv");
    EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 1 + 2 * static_cast<long>(boxes["list"].size()));
  }
}

using StudyFaults = StudyProgram;

TEST_F(StudyFaults, LeaveAStudyOnAServerAsItWouldBe) {
  const auto server = Server::make();
  if (!server) GTEST_SKIP() << "PostgreSQL is not installed";
  write_inputs(folder / "in.toml", cases::make_jump_inputs());
  ASSERT_EQ(run(study("whole", "jump 0 crash", {"--samples", "800"})), 0) << read(folder / "log");
  EXPECT_NE(read(folder / "whole/results.json").find("signal 6"), std::string::npos) << "a job crashes";

  const auto manage = [&] {
    return start(study("faulty", "jump 10 crash",
                       {"--samples", "800", "--store", server->url(), "--jobs", "0", "--lease", "1 s"}));
  };
  const auto work = [&] { return start({TOPPLE_PROGRAM, "worker", server->url(), "--jobs", "1", "--lease", "1 s"}); };
  pid_t manager = manage(), killed = work();
  const pid_t stopped = work(), steady = work();
  auto db = open_database(server->url());
  wait_until([&] { return number(*db, "SELECT count(*) FROM pg_tables WHERE tablename = 'result'") == 1; });
  wait_until([&] { return results(*db) > 60; });
  // a worker that holds a job stops past its lease
  const std::string held =
      "SELECT count(*) FROM job WHERE state = 'running' AND worker LIKE '%:" + std::to_string(stopped) + ":%'";
  wait_until([&] {
    kill(stopped, SIGSTOP);
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
    if (number(*db, held) == 1) return true;
    kill(stopped, SIGCONT);
    return false;
  });
  wait_until([&] { return results(*db) > 150; });
  kill(killed, SIGKILL);
  EXPECT_EQ(wait_for(killed), -SIGKILL);
  killed = work();
  wait_until([&] { return results(*db) > 250; });
  kill(manager, SIGKILL);
  EXPECT_EQ(wait_for(manager), -SIGKILL);
  manager = manage();
  const long before = results(*db);
  server->stop(SIGKILL);
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  server->start();
  db = open_database(server->url());
  EXPECT_GE(results(*db), before) << "what was committed is there";
  wait_until([&] { return results(*db) > 400; });
  // its job has long been done by another
  EXPECT_EQ(number(*db, held), 0);
  kill(stopped, SIGCONT);

  EXPECT_EQ(wait_for(manager), 0) << read(folder / "log");
  for (const pid_t worker : {killed, stopped, steady}) EXPECT_EQ(wait_for(worker), 0) << "they end with the study";
  expect_one_result_each(*db);
  EXPECT_NE(read(folder / "log").find("came too late"), std::string::npos) << "the stopped worker was refused";
  expect_same("whole", "faulty");
}

TEST_F(StudyFaults, LeaveAStudyInAFileAsItWouldBe) {
  write_inputs(folder / "in.toml", cases::make_jump_inputs());
  ASSERT_EQ(run(study("whole", "jump 0 crash", {"--samples", "600"})), 0) << read(folder / "log");
  const auto words = study("faulty", "jump 10 crash", {"--samples", "600", "--jobs", "1", "--lease", "1 s"});
  pid_t manager = start(words);
  wait_until([&] { return std::filesystem::exists(folder / "faulty/study.sqlite"); });
  const auto db = open_database(folder / "faulty/study.sqlite");
  wait_until([&] { return number(*db, "SELECT count(*) FROM sqlite_master WHERE name = 'result'") == 1; });
  wait_until([&] { return results(*db) > 40; });
  pid_t worker = start({TOPPLE_PROGRAM, "worker", folder / "faulty", "--jobs", "1", "--lease", "1 s"});
  wait_until([&] { return results(*db) > 120; });
  kill(worker, SIGKILL);
  wait_for(worker);
  wait_until([&] { return results(*db) > 150; });
  kill(manager, SIGKILL);
  wait_for(manager);
  EXPECT_EQ(run({TOPPLE_PROGRAM, "study", "show", folder / "faulty"}), 0);
  EXPECT_NE(read(folder / "log").find("not finished"), std::string::npos);
  manager = start(words);
  wait_until([&] { return results(*db) > 250; });
  kill(manager, SIGINT);
  EXPECT_EQ(wait_for(manager), 1);
  EXPECT_NE(read(folder / "log").find("The same command goes on"), std::string::npos);
  EXPECT_EQ(number(*db, "SELECT count(*) FROM job WHERE state = 'running'"), 0) << "interrupted runs went back";
  EXPECT_EQ(run(words), 0) << read(folder / "log");
  expect_one_result_each(*db);
  expect_same("whole", "faulty");
  // and once more: nothing is left to do
  const long count = results(*db);
  EXPECT_EQ(run(words), 0);
  EXPECT_EQ(results(*db), count);
}

// More kills than attempts of a model that breaks off.
TEST_F(StudyFaults, LeaveARunThatIsKilledOftenAsItWouldBe) {
  write_inputs(folder / "in.toml", cases::make_jump_inputs());
  ASSERT_EQ(run(study("whole", "jump 0", {"--samples", "12"})), 0) << read(folder / "log");
  const auto words = study("faulty", "jump 500", {"--samples", "12", "--jobs", "1"});
  for (int kills = 0; kills < 5; ++kills) {
    const pid_t manager = start(words);
    wait_until([&] { return std::filesystem::exists(folder / "faulty/study.sqlite"); });
    const auto db = open_database(folder / "faulty/study.sqlite");
    wait_until([&] { return number(*db, "SELECT count(*) FROM sqlite_master WHERE name = 'job_refused'") == 1; });
    const std::string held =
        "SELECT count(*) FROM job WHERE state = 'running' AND worker LIKE '%:" + std::to_string(manager) + ":%'";
    wait_until([&] { return number(*db, held) == 1; });
    kill(manager, SIGKILL);
    EXPECT_EQ(wait_for(manager), -SIGKILL);
  }
  EXPECT_EQ(run(words), 0) << read(folder / "log");
  const auto db = open_database(folder / "faulty/study.sqlite");
  EXPECT_EQ(number(*db, "SELECT max(vanished) FROM job"), 5) << "always the same run";
  expect_one_result_each(*db);
  expect_same("whole", "faulty");
}

TEST_F(StudyFaults, LeaveTheStoreToWorkersWhenTheStudyStops) {
  write_inputs(folder / "in.toml", cases::make_jump_inputs());
  // answers that cannot be understood, until it is mended
  std::ofstream(folder / "model.sh") << "while read -r line; do if [ -e " << folder / "mended"
                                     << " ]; then echo '{\"z\": 1}'; else echo '{}'; fi; done\n";
  const std::vector<std::string> words = {
      TOPPLE_PROGRAM, "study", folder / "in.toml", "-o", folder / "out", "--evaluator", "sh " + (folder / "model.sh"),
      "--samples",    "30"};
  std::vector<std::string> manage = words;
  manage.insert(manage.end(), {"--jobs", "0"});
  // with nobody else nothing is left behind
  EXPECT_EQ(run(words), 2);
  EXPECT_FALSE(std::filesystem::exists(folder / "out"));
  const pid_t manager = start(manage);
  wait_until([&] { return std::filesystem::exists(folder / "out/study.sqlite"); });
  {
    const auto db = open_database(folder / "out/study.sqlite");
    wait_until([&] { return number(*db, "SELECT count(*) FROM sqlite_master WHERE name = 'job_refused'") == 1; });
    wait_until([&] { return number(*db, "SELECT count(*) FROM job") > 0; });
  }
  const pid_t worker = start({TOPPLE_PROGRAM, "worker", folder / "out", "--jobs", "1"});
  EXPECT_EQ(wait_for(manager), 2) << read(folder / "log");
  ASSERT_TRUE(std::filesystem::exists(folder / "out/study.sqlite")) << "the worker waits in it";
  std::ofstream(folder / "mended") << "\n";
  EXPECT_EQ(run(manage), 0) << read(folder / "log");
  EXPECT_EQ(wait_for(worker), 0) << "it did the runs";
  const std::string log = read(folder / "log");
  EXPECT_NE(log.find("30 runs done here, "), std::string::npos) << log;
  EXPECT_NE(log.find(" not understood; every study is finished"), std::string::npos) << log;
  EXPECT_NE(log.find("The study it belongs to stops."), std::string::npos) << log;
}

// x2 is spread evenly between x1 and 90; the model crashes where x1 > 44 and x2 > 80.
TEST_F(StudyFaults, LeaveAStudyWithRandomInputsAsItWouldBe) {
  std::ofstream(folder / "in.toml") << R"toml([inputs]
x1 = { triangular = [10, 25, 45] }
[random]
x2 = { uniform = ["x1", 90] }
[randomness]
runs = 20
statistics = ["mean(z0)", "q90(z0)", "p(falls)"]
)toml";
  ASSERT_EQ(run(study("whole", "jump 0 crash", {"--samples", "150", "--jobs", "1"})), 0) << read(folder / "log");
  EXPECT_NE(read(folder / "log").find("each point takes 20 runs of the model, 150 points take at most 3000 runs"),
            std::string::npos);
  EXPECT_NE(read(folder / "whole/results.json").find("4 of 20 inner runs failed: the evaluator ended"),
            std::string::npos)
      << "of x1 = 45 and the middles of strata of 2.25 those above 80";
  const auto words = study("faulty", "jump 1 crash", {"--samples", "150", "--jobs", "1", "--lease", "1 s"});
  pid_t manager = start(words);
  wait_until([&] { return std::filesystem::exists(folder / "faulty/study.sqlite"); });
  const auto db = open_database(folder / "faulty/study.sqlite");
  wait_until([&] { return number(*db, "SELECT count(*) FROM sqlite_master WHERE name = 'result'") == 1; });
  wait_until([&] { return results(*db) > 20; });
  pid_t worker = start({TOPPLE_PROGRAM, "worker", folder / "faulty", "--jobs", "2", "--lease", "1 s"});
  wait_until([&] { return results(*db) > 50; });
  kill(worker, SIGKILL);
  wait_for(worker);
  kill(manager, SIGKILL);
  wait_for(manager);
  EXPECT_EQ(run(words), 0) << read(folder / "log");
  expect_one_result_each(*db);
  expect_same("whole", "faulty");
  // another distribution is another study
  std::ofstream(folder / "in.toml", std::ios::app) << "seed = 2\n";
  EXPECT_EQ(run(words), 2);
  EXPECT_NE(read(folder / "log").find("E822"), std::string::npos);
}

TEST_F(StudyFaults, LeaveACondensedStudyOfAPlanAsItWouldBe) {
  std::ofstream(folder / "plan.toml") << collapse::house(
      collapse::charge("C-A*-0") + collapse::charge("C-B*-0", "0.2 s") +
      "[fuzzy]\nconcrete.C25.fc = { triangular = [\"15 N/mm2\", \"25 N/mm2\", \"45 N/mm2\"] }\n");
  const auto words = [&](const std::string& out) {
    return std::vector<std::string>{
        TOPPLE_PROGRAM, "study", folder / "plan.toml", "-o",        folder / out, "--samples", "60", "--jobs", "1",
        "--alpha",      "0,1",   "--condensed",        "--confirm", "10"};
  };
  ASSERT_EQ(run(words("whole")), 0) << read(folder / "log");
  const json r = json::parse(read(folder / "whole/results.json"));
  EXPECT_EQ(r["confirmation"]["runs"].size(), 10u);

  // killed while it searches, later, and while whole runs confirm it
  for (const long after : {5, 35, 63}) {
    const pid_t manager = start(words("faulty"));
    wait_until([&] { return std::filesystem::exists(folder / "faulty/study.sqlite"); });
    const auto db = open_database(folder / "faulty/study.sqlite");
    wait_until([&] { return number(*db, "SELECT count(*) FROM sqlite_master WHERE name = 'result'") == 1; });
    wait_until([&] { return results(*db) > after; });
    kill(manager, SIGKILL);
    EXPECT_EQ(wait_for(manager), -SIGKILL);
  }
  EXPECT_EQ(run(words("faulty")), 0) << read(folder / "log");
  const auto db = open_database(folder / "faulty/study.sqlite");
  expect_one_result_each(*db);
  expect_same("whole", "faulty");
  EXPECT_EQ(read(folder / "whole/confirmation.csv"), read(folder / "faulty/confirmation.csv"));
  EXPECT_EQ(read(folder / "whole/trajectories.csv"), read(folder / "faulty/trajectories.csv"));
  // what was found says how, and a study of whole runs does not go on with it
  EXPECT_EQ(run({TOPPLE_PROGRAM, "study", "show", folder / "faulty"}), 0);
  EXPECT_NE(read(folder / "log").find("Runs were condensed; 10 whole runs beside them"), std::string::npos);
  std::vector<std::string> other = words("faulty");
  other.resize(other.size() - 3);
  EXPECT_EQ(run(other), 2);
  EXPECT_NE(read(folder / "log").find("E822"), std::string::npos);
}

TEST_F(StudyFaults, OfOneCommandInTwoPlacesShareNoRunsOnAServer) {
  const auto server = Server::make();
  if (!server) GTEST_SKIP() << "PostgreSQL is not installed";
  const auto in = [&](const std::string& place, const std::string& words) {
    return std::vector<std::string>{"/bin/sh", "-c",
                                    "cd '" + (folder / place) + "' && exec " + TOPPLE_PROGRAM + " " + words};
  };
  const auto study_of = [&](const std::string& out, const std::string& more = "") {
    return "study inputs.toml --evaluator ./model -o " + out + " --store " + server->url() + " --samples 150 " + more;
  };
  for (const std::string place : {"a", "b"}) {
    std::filesystem::create_directory(folder / place);
    write_inputs(folder / place + "/inputs.toml", cases::make_jump_inputs());
    const std::string model = folder / place + "/model";
    std::ofstream(model) << "#!/bin/sh\n"
                         << TOPPLE_STUDY_MODEL << " jump" << (place == "b" ? " | sed -u s/falls/lies/" : "") << "\n";
    std::filesystem::permissions(model, std::filesystem::perms::owner_all);
  }
  ASSERT_EQ(run(in("a", study_of("of-a"))), 0) << read(folder / "log");
  ASSERT_EQ(run(in("b", study_of("of-b"))), 0) << read(folder / "log");
  const auto has = [&](const std::string& out, const char* outcome) {
    return read(folder / out + "/results.json").find(outcome) != std::string::npos;
  };
  EXPECT_TRUE(has("a/of-a", "\"falls\"") && !has("a/of-a", "\"lies\""));
  EXPECT_TRUE(has("b/of-b", "\"lies\"") && !has("b/of-b", "\"falls\""));
  // nor does a new folder in the other place go on with a study that has the same name, inputs and command
  EXPECT_EQ(run(in("b", study_of("again", "--name of-a"))), 2);
  EXPECT_NE(read(folder / "log").find("holds another study \"of-a\""), std::string::npos) << read(folder / "log");
  EXPECT_EQ(run(in("a", study_of("again", "--name of-a"))), 0) << read(folder / "log");
  expect_same("a/of-a", "a/again");

  // a worker of one study leaves those of others alone
  const pid_t other = start(in("a", study_of("open-a", "--jobs 0"))),
              own = start(in("b", study_of("open-b", "--jobs 0")));
  const auto db = open_database(server->url());
  wait_until([&] { return number(*db, "SELECT count(*) FROM study WHERE name IN ('open-a', 'open-b')") == 2; });
  EXPECT_EQ(run(in("b", "worker " + server->url() + " --name open-b --jobs 1")), 0);
  EXPECT_EQ(wait_for(own), 0) << read(folder / "log");
  EXPECT_TRUE(has("b/open-b", "\"lies\"") && !has("b/open-b", "\"falls\""));
  EXPECT_EQ(number(*db, "SELECT count(*) FROM result r JOIN study s ON s.model = r.model WHERE s.name = 'open-a'"), 0);
  // nor does one of a plan's study, whose whole runs it does, too
  std::ofstream(folder / "b/plan.toml") << collapse::house(
      collapse::charge("C-A*-0") +
      "[fuzzy]\nconcrete.C25.fc = { triangular = [\"15 N/mm2\", \"25 N/mm2\", \"45 N/mm2\"] }\n");
  const pid_t planned = start(in("b", "study plan.toml -o plan --store " + server->url() +
                                          " --jobs 0 --samples 20 --alpha 0,1 --condensed --confirm 4 --no-drivers"));
  wait_until([&] { return number(*db, "SELECT count(*) FROM study WHERE name = 'plan'") == 1; });
  EXPECT_EQ(run(in("b", "worker " + server->url() + " --name plan --jobs 1")), 0) << read(folder / "log");
  EXPECT_EQ(wait_for(planned), 0) << read(folder / "log");
  EXPECT_EQ(number(*db, "SELECT count(*) FROM result r JOIN study s ON s.model = r.model WHERE s.name = 'open-a'"), 0);
  kill(other, SIGINT);
  EXPECT_EQ(wait_for(other), 1);
  EXPECT_EQ(run({TOPPLE_PROGRAM, "worker", server->url(), "--name", "none"}), 2);
  EXPECT_NE(read(folder / "log").find("there is no study \"none\""), std::string::npos);
}

TEST_F(StudyFaults, LeaveAFinishedStudyWhereItsRepetitionIsInterrupted) {
  write_inputs(folder / "in.toml", cases::make_jump_inputs());
  const auto words = study("out", "jump", {"--batch", "50", "--samples", "6000", "--permissible", "stands"});
  ASSERT_EQ(run(words), 0) << read(folder / "log");
  std::filesystem::copy(folder / "out", folder / "before", std::filesystem::copy_options::recursive);
  const auto db = open_database(folder / "out/study.sqlite");
  for (const int wait : {50, 150, 300}) {
    const pid_t again = start(words);
    std::this_thread::sleep_for(std::chrono::milliseconds(wait));
    kill(again, SIGINT);
    const int ending = wait_for(again);
    // on a busy machine it may not have begun to listen
    EXPECT_TRUE(ending == 0 || ending == 1 || ending == -SIGINT) << ending;
    expect_same("out", "before");
    EXPECT_EQ(read(folder / "out/boxes.csv"), read(folder / "before/boxes.csv"));
    EXPECT_EQ(number(*db, "SELECT count(*) FROM study WHERE state = 'finished'"), 1);
  }
  // what is exported removes nothing that only has the name of a table
  std::filesystem::create_directory(folder / "mine");
  for (const char* name : {"limits.csv", "debris.csv", "trajectories.csv", "confirmation.csv"})
    std::ofstream(folder / (std::string("mine/") + name)) << "my own data\n";
  EXPECT_EQ(run({TOPPLE_PROGRAM, "study", "export", folder / "out", "-o", folder / "mine"}), 0);
  for (const char* name : {"limits.csv", "debris.csv", "trajectories.csv", "confirmation.csv"})
    EXPECT_EQ(read(folder / (std::string("mine/") + name)), "my own data\n") << name;
  // what is exported replaces nothing of another study
  EXPECT_EQ(run(study("other", "jump", {"--samples", "50"})), 0);
  EXPECT_EQ(run({TOPPLE_PROGRAM, "study", "export", folder / "other", "-o", folder / "out"}), 2);
  EXPECT_NE(read(folder / "log").find("holds another study, whose files these would replace"), std::string::npos);
  expect_same("out", "before");
  EXPECT_EQ(run({TOPPLE_PROGRAM, "study", "export", folder / "other", "-o", folder / "tables", "--json"}), 0);
  EXPECT_NE(read(folder / "log").find(read(folder / "tables/results.json")), std::string::npos);
}

TEST_F(StudyFaults, DoNotMixBuilds) {
  std::ofstream(folder / "plan.toml") << collapse::house(
      collapse::charge("C-A*-0") +
      "[fuzzy]\nconcrete.C25.fc = { triangular = [\"15 N/mm2\", \"25 N/mm2\", \"45 N/mm2\"] }\n");
  const std::vector<std::string> words = {
      TOPPLE_PROGRAM, "study", folder / "plan.toml", "-o", folder / "out", "--samples", "10",
      "--alpha",      "0,1",   "--no-drivers"};
  ASSERT_EQ(run(words), 0) << read(folder / "log");
  const auto db = open_database(folder / "out/study.sqlite");
  const long count = results(*db);
  // as an older program would have left it
  db->run("UPDATE model SET hash = 'old', definition = replace(definition, '\"topple\":\"', '\"topple\":\"0.0.9 of ')",
          {});
  db->run("UPDATE study SET model = 'old', state = 'open'", {});
  db->run("UPDATE job SET model = 'old'", {});
  db->run("DELETE FROM result WHERE hash = (SELECT hash FROM job WHERE number = 1)", {});
  db->run("UPDATE job SET state = 'waiting' WHERE number = 1", {});
  for (const auto& asked : {words, {TOPPLE_PROGRAM, "worker", folder / "out", "--idle", "1 s"}}) {
    EXPECT_EQ(run(asked), 2);
    const std::string log = read(folder / "log");
    EXPECT_TRUE(log.find("E826") != std::string::npos && log.find("0.0.9 of ") != std::string::npos) << log;
  }
  EXPECT_EQ(results(*db), count - 1);
  EXPECT_EQ(number(*db, "SELECT count(*) FROM job WHERE state = 'waiting'"), 1) << "for one who may";
  EXPECT_EQ(run({TOPPLE_PROGRAM, "study", "show", folder / "out"}), 0) << "what it found can be read";
}

}  // namespace
}  // namespace topple::study
