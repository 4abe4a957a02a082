#pragma once
/// Threads that take jobs from a store, run them and write their results; and one that keeps their leases alive.

#include <atomic>
#include <condition_variable>
#include <exception>
#include <map>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "study/store.h"

namespace topple::study {

struct PoolOptions {
  int jobs = 1;                     // at the same time
  int batch = 1;                    // points that a runner gets at once
  double lease = 30;                // a job is given to another worker so long after a sign of life [s]
  std::vector<std::string> models;  // the only ones whose jobs are taken, in this order; empty: any
  double patience = 300;            // with a server that is away [s]
};

class Pool {
 public:
  Pool(std::string address, const RunnerFactories&, const PoolOptions&);
  /// Stops; jobs under way go back to the store, not counted as attempts.
  ~Pool();
  Pool(const Pool&) = delete;
  Pool& operator=(const Pool&) = delete;

  void stop();
  /// Until all have ended, behind `stop`.
  void join();
  /// Whether runs under way could not be given back: they go to others when their leases run out.
  bool has_kept() const { return has_kept_; }
  /// There may be jobs.
  void wake();
  /// Until a job was finished here after the last call, or so long.
  void wait_for_news(double seconds);
  /// Throws what ended one of the threads.
  void check();

  /// Of this process and pool; those of workers have a number behind it.
  const std::string& name() const { return name_; }
  int running() const { return running_; }
  long finished() const { return finished_; }  // results written
  long too_late() const { return too_late_; }  // results of jobs that others had taken over
  /// Answers that were not understood, and stopped their studies; what is wrong with the last one.
  long refused() const { return refused_; }
  std::string get_refusal() const;
  /// Since a job was under way [s].
  double calc_idle_time() const;

 private:
  void work(const std::string& name);
  void keep_alive();
  void sleep(double seconds);
  /// The answer, or Refused where its form is not that of the model's other points.
  Answer compare(Store&, const std::string& model, const Answer&);
  void run_jobs(Store&, const std::string& name, std::vector<Job>, std::map<std::string, Runner>&);

  std::string address_, name_;
  const RunnerFactories& factories_;
  PoolOptions options_;
  std::vector<std::string> names_;
  std::atomic<bool> stop_ = false, has_kept_ = false;
  std::atomic<bool> has_suspect_ = false;  // a thread holds one, or may be about to
  std::atomic<int> running_ = 0;
  std::atomic<long> finished_ = 0, too_late_ = 0, refused_ = 0, news_count_ = 0;
  std::atomic<double> last_work_ = 0;
  mutable std::mutex mutex_;
  std::condition_variable news_, wakes_;
  long seen_ = 0, wake_count_ = 0;
  std::string refusal_;
  std::exception_ptr failure_;
  std::mutex forms_mutex_;
  std::map<std::string, AnswerForm> forms_;  // by model
  std::vector<std::thread> threads_;
};

/// Lets go of jobs whose worker was a process of this machine that is gone, without waiting for their leases.
void release_dead_workers(Store&);

}  // namespace topple::study
