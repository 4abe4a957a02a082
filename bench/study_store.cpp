// Jobs a second that a study's store hands out and takes back: topple_store_bench [jobs] [runs a claim].

#include <fmt/format.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <thread>
#include <vector>

#include "../tests/study/server.h"
#include "study/store.h"

namespace {

using namespace topple::study;
using Clock = std::chrono::steady_clock;

double since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

void measure(const char* kind, const std::string& address, int jobs, int batch) {
  int round = 0;
  for (const int workers : {1, 2, 8}) {
    const std::string model = fmt::format("m{}", round++);
    std::vector<std::pair<std::string, Point>> points;
    for (int i = 0; i < jobs; ++i) {
      const Point x = {1.0 / (i + 1), 2.0 / (i + 1), 3.0 / (i + 1), 4.0 / (i + 1), 5.0 / (i + 1)};
      points.emplace_back(calc_job_hash(model, x), x);
    }
    Store store(address);
    const auto start = Clock::now();
    store.add_jobs(model, points);
    const double added = since(start);
    const auto begin = Clock::now();
    std::vector<std::thread> threads;
    for (int w = 0; w < workers; ++w)
      threads.emplace_back([&, w] {
        Store own(address);
        const std::string name = fmt::format("w{}", w);
        for (;;) {
          const std::vector<Job> claimed = own.claim(name, batch, 60);
          if (claimed.empty()) return;
          for (const Job& job : claimed)
            own.finish(job, name,
                       {Answer::Kind::Done, {{"a", job.inputs[0]}, {"b", job.inputs[1]}}, "stands", {}, "", 0});
        }
      });
    for (std::thread& t : threads) t.join();
    const double done = since(begin);
    const auto read = Clock::now();
    const std::size_t count = store.load_results(model).size();
    std::printf("%-24s %2d workers: add %8.0f/s, claim and finish %7.0f/s, read %8.0f/s\n", kind, workers, jobs / added,
                static_cast<double>(count) / done, static_cast<double>(count) / since(read));
    std::fflush(stdout);
  }
}

}  // namespace

int main(int argc, char** argv) {
  const int jobs = argc > 1 ? std::atoi(argv[1]) : 5000, batch = argc > 2 ? std::atoi(argv[2]) : 1;
  const Folder folder;
  measure("SQLite", folder / "study.sqlite", jobs, batch);
  const auto server = Server::make(true);
  if (!server) return 0;
  measure("PostgreSQL", server->url(), jobs, batch);
  open_database(server->url())->run("TRUNCATE model, study, job, result");
  measure("PostgreSQL, not waiting", server->url() + "&options=-csynchronous_commit%3Doff", jobs, batch);
}
