#pragma once
/// The queue and the results of studies, in a SQLite file or a PostgreSQL database of the same schema
/// (docs/decisions/0027-study-store.md). Any number of processes may work on it and die at any moment: a job is held by
/// a lease on the database's clock, and each has exactly one result.

#include <atomic>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "study/database.h"
#include "study/model.h"

namespace topple::study {

/// Attempts that a model broke off after which a job counts as failed.
inline constexpr int most_attempts = 3;
/// Workers that vanished with a job after which it counts as failed: it may be what ends them, but healthy ones are
/// killed too.
inline constexpr int most_vanished = 10;
/// From so many on a job is a suspect: it is held alone, and a process holds one of them at a time, so that what ends
/// workers takes no others with it again and again.
inline constexpr int suspect_vanished = 2;

struct Job {
  std::string hash, model;
  Point inputs;
  int attempt = 0;   // this one, from 1
  int vanished = 0;  // so many of those before ended without a word
};

struct StoredResult {
  std::string hash;
  Point inputs;  // only from `load_results`
  Answer answer;
};

struct StudyRow {
  std::string name;        // unique in the store
  std::string model;       // hash
  std::string definition;  // JSON: inputs, levels, seed, options, version
  std::string state;       // "open" or "finished"
  std::string summary;     // JSON, empty until finished
};

struct Counts {
  long waiting = 0, running = 0, done = 0, failed = 0;
};

/// A name of a point under a model: the same for the same bits.
std::string calc_job_hash(const std::string& model, const Point&);

/// Numbers as a JSON array, back with the same bits (but for the payload of NaN). Another text is an exception.
std::string to_text(const std::vector<double>&);
std::vector<double> to_numbers(const std::string&);

/// Hears, once until it is back and in any thread, that a server is away and why.
void on_waiting(std::function<void(const std::string&)>);

/// One connection; belongs to one thread. Operations wait for a server that is away, up to `patience`, and are repeated
/// where that is safe; then they throw ConnectionLost. Rows that cannot be read are an InputError E820.
class Store {
 public:
  /// Creates what is missing, unless it is only read. Throws InputError E820, E821.
  explicit Store(const std::string& address, const std::atomic<bool>* cancel = nullptr, double patience = 300,
                 bool is_read_only = false);

  void put_model(const std::string& hash, const std::string& definition);
  std::optional<std::string> find_model(const std::string& hash);
  /// Adds a study, or replaces that of the same name.
  void put_study(const StudyRow&);
  /// The same, if that of this name is still what it was: none, or one of its model, definition and state. Otherwise
  /// false, and nothing is changed.
  bool begin_study(const StudyRow&, const std::optional<StudyRow>& there);
  std::optional<StudyRow> find_study(const std::string& name);
  /// Numbers of studies, and of those that are not finished.
  std::pair<long, long> count_studies();

  /// Jobs that are there already stay as they are.
  void add_jobs(const std::string& model, const std::vector<std::pair<std::string, Point>>& jobs);
  /// Points that no model is asked for, with their (failed) results; `rerun_failed` leaves them alone.
  void add_impossible(const std::string& model, const std::vector<StoredResult>&);
  /// Takes up to `count` jobs that wait, or whose lease has run out, oldest first; raises their attempt before anything
  /// is run. `worker` holds nothing else. What threads of its process hold (names with the same part up to the last
  /// colon) is left to them, whatever their leases say.
  ///   model     the only one that is wanted; empty: any
  ///   suspects  whether to take a suspect, which then comes alone
  std::vector<Job> claim(const std::string& worker, int count, double lease, const std::string& model = {},
                         bool suspects = true);
  /// Leases of all jobs that these workers still hold.
  void renew(const std::vector<std::string>& workers, double lease);
  /// Who holds jobs.
  std::vector<std::string> list_workers();
  /// Writes a result if there is none, also of a job that was given to another since; false if it came too late. All
  /// else counts only while the job is the worker's. Crashed: the job waits again, or failed after its last attempt.
  /// Refused: the job stops until `forget_refusals`. Cancelled: it waits again, not counted.
  bool finish(const Job&, const std::string& worker, const Answer&);
  /// Whether an answer to a job is a result: all but what is tried again or stops the study.
  static bool is_result(const Job&, const Answer&);
  /// Jobs whose workers vanished too often become failed results. Returns how many.
  ///   process  what workers of this name and a number hold does not count
  int quarantine(const std::string& process = {});

  std::vector<StoredResult> find_results(const std::vector<std::string>& hashes);
  /// All results of a model, in the order in which the jobs were added.
  std::vector<StoredResult> load_results(const std::string& model);
  Counts count(const std::string& model);
  /// Jobs that run, quick at any size.
  long count_running(const std::string& model);
  /// What was said of a refused job of the model.
  std::optional<std::string> find_refusal(const std::string& model);
  void forget_refusals(const std::string& model);
  /// That of the points of the model that were done; none: there is no such point.
  std::optional<AnswerForm> find_form(const std::string& model);
  /// Results are taken out and their jobs wait again.
  void rerun(const std::vector<std::string>& hashes);
  /// Failed results are taken out and their jobs wait again. Returns how many.
  int rerun_failed(const std::string& model);

 private:
  template <class F>
  auto transact(F work, bool is_one_statement = false);

  std::string address_;
  std::unique_ptr<Database> db_;
  const std::atomic<bool>* cancel_;
  double patience_;
};

}  // namespace topple::study
