// A study whose workers Slurm places, cancels and loses.

#include "slurm.h"

#include "study_program.h"

namespace topple::study {
namespace {

using StudySlurm = StudyProgram;

TEST_F(StudySlurm, IsTheSameAsOnOneMachineWhateverHappensToItsWorkers) {
  const auto slurm = Slurm::make();
  if (!slurm) GTEST_SKIP() << "Slurm (slurm-wlm, munge) is not installed";
  const auto server = Server::make();
  if (!server) GTEST_SKIP() << "PostgreSQL is not installed";
  write_inputs(folder / "in.toml", cases::make_jump_inputs());
  ASSERT_EQ(run(study("whole", "jump 0 crash", {"--samples", "600"})), 0) << read(folder / "log");

  // as docs/study.md shows it: the study here, an array of workers there
  const pid_t manager = start(study("cluster", "jump 10 crash",
                                    {"--samples", "600", "--store", server->url(), "--jobs", "0", "--lease", "1 s"}));
  auto db = open_database(server->url());
  wait_until([&] { return number(*db, "SELECT count(*) FROM pg_tables WHERE tablename = 'result'") == 1; });
  const auto submit = [&](const std::string& array) {
    return slurm->submit("#!/bin/bash\n#SBATCH --job-name=topple-worker\n#SBATCH --array=" + array +
                         "\n#SBATCH --cpus-per-task=1\n#SBATCH --requeue\nexec " + TOPPLE_PROGRAM + " worker '" +
                         server->url() + "' --jobs \"$SLURM_CPUS_PER_TASK\" --lease '1 s' --idle '2 min'\n");
  };
  const std::string array = submit("1-4");
  ASSERT_FALSE(array.empty());
  wait_until([&] { return results(*db) > 60; });
  const auto workers = [&](const std::string& states) {
    const std::string list = slurm->ask("squeue --noheader --array --states=" + states + " --format=%i");
    return std::count(list.begin(), list.end(), '\n');
  };
  EXPECT_EQ(workers("RUNNING"), 2) << "one on each node; the others wait";

  // one that is cancelled gives its run back, and the next of the array takes its node
  slurm->ask("scancel " + array + "_1");
  wait_until([&] { return results(*db) > 150 && workers("RUNNING") == 2; });
  EXPECT_NE(slurm->read_log(array + "_1").find("interrupted; its runs went back"), std::string::npos)
      << slurm->read_log(array + "_1");

  // one that is killed while it holds a job
  pid_t lost = 0;
  wait_until([&] {
    const Rows rows = db->run("SELECT worker FROM job WHERE state = 'running' LIMIT 1");
    if (rows.empty() || !rows[0][0]) return false;
    // host:pid:thread
    const std::string name = *rows[0][0];
    const std::size_t begin = name.find(':') + 1;
    lost = std::stoi(name.substr(begin, name.find(':', begin) - begin));
    return kill(lost, SIGKILL) == 0;
  });
  wait_until([&] { return results(*db) > 250; });
  submit("1-2");

  EXPECT_EQ(wait_for(manager), 0) << read(folder / "log");
  expect_one_result_each(*db);
  expect_same("whole", "cluster");
  wait_until([&] { return workers("RUNNING,PENDING") == 0; });  // workers end with the study
}

}  // namespace
}  // namespace topple::study
