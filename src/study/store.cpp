#include "study/store.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <mutex>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <thread>

#include "base/error.h"
#include "base/hash.h"

namespace topple::study {
namespace {

using json = nlohmann::ordered_json;
using Clock = std::chrono::steady_clock;

json to_json(double x) {
  if (std::isfinite(x)) return x;
  if (std::isnan(x)) return nullptr;
  return x > 0 ? "inf" : "-inf";
}
/// Throws json::exception or std::invalid_argument where it is no number.
double to_number(const json& j) {
  if (j.is_number()) return j.get<double>();
  if (j.is_null()) return std::numeric_limits<double>::quiet_NaN();
  const double infinite = std::numeric_limits<double>::infinity();
  const std::string word = j.get<std::string>();
  if (word == "inf") return infinite;
  if (word == "-inf") return -infinite;
  throw std::invalid_argument("a number is wanted");
}

/// Texts from elsewhere may hold bytes that are no UTF-8, which a database refuses.
std::string to_clean(const std::string& text) {
  std::string clean = json(text).dump(-1, ' ', false, json::error_handler_t::replace);
  clean = json::parse(clean).get<std::string>();
  std::erase(clean, '\0');
  return clean;
}

std::string outputs_text(const Answer& a) {
  json j = json::object();
  for (const auto& [name, value] : a.outputs) j[name] = to_json(value);
  return j.dump();
}

/// Throws json::exception or std::invalid_argument.
std::vector<std::pair<std::string, double>> to_outputs(const std::string& text) {
  const json j = json::parse(text);
  if (!j.is_object()) throw std::invalid_argument("an object is wanted");
  std::vector<std::pair<std::string, double>> outputs;
  for (const auto& [name, value] : j.items()) outputs.emplace_back(name, to_number(value));
  return outputs;
}

/// A row of a table of the store, for complaints.
struct Place {
  const std::string& address;
  const char* table;
  std::string hash;
};

/// What `read` makes of a column. Throws InputError E820 where that is damaged.
template <class F>
auto read_column(const Place& row, const char* column, F read) {
  try {
    return read();
  } catch (const json::exception&) {
    // not what was written
  } catch (const std::logic_error&) {
    // likewise
  }
  throw InputError("E820",
                   fmt::format("{} is damaged: the row {} of the table {} has no valid {}", hide_password(row.address),
                               row.hash, row.table, column),
                   "take a copy that is whole, or begin in another store");
}

/// From the columns status, outcome, outputs, trajectory, message, seconds; the row begins with the hash.
Answer read_answer(const std::string& address, const Row& row, std::size_t first) {
  const Place place{address, "result", *row[0]};
  Answer a;
  a.kind = *row[first] == "done" ? Answer::Kind::Done : Answer::Kind::Failed;
  a.outcome = row[first + 1].value_or("");
  a.outputs = read_column(place, "outputs", [&] { return to_outputs(row[first + 2].value_or("{}")); });
  a.trajectory = read_column(place, "trajectory", [&] { return to_numbers(row[first + 3].value_or("[]")); });
  a.text = row[first + 4].value_or("");
  a.seconds = read_column(place, "seconds", [&] { return std::stod(row[first + 5].value_or("0")); });
  return a;
}

Point read_inputs(const std::string& address, const std::string& hash, const std::string& text) {
  return read_column(Place{address, "job", hash}, "inputs", [&] { return to_numbers(text); });
}

constexpr const char* result_columns =
    "hash, model, status, outcome, outputs, trajectory, message, attempt, worker, seconds, finished";

/// Columns of a result but hash and model, and the last.
std::vector<Value> make_values(const Job& job, const std::string& worker, const Answer& a) {
  return {a.kind == Answer::Kind::Done ? "done" : "failed",
          to_clean(a.outcome),
          outputs_text(a),
          to_text(a.trajectory),
          to_clean(a.text),
          std::to_string(job.attempt),
          worker,
          fmt::format("{}", a.seconds)};
}

void insert_result(Database& db, const Job& job, const std::string& worker, const Answer& a) {
  std::vector<Value> values = make_values(job, worker, a);
  values.push_back(job.hash);
  values.push_back(job.model);
  db.run(
      fmt::format("INSERT INTO result({}) VALUES ($9, $10, $1, $2, $3, $4, $5, $6, $7, $8, {}) ON CONFLICT (hash) DO "
                  "NOTHING",
                  result_columns, db.dialect().now),
      values);
}

void make_schema(Database& db) {
  const Dialect& d = db.dialect();
  for (const std::string& sql : {
           std::string("CREATE TABLE IF NOT EXISTS model(hash text PRIMARY KEY, definition text NOT NULL)"),
           std::string(
               "CREATE TABLE IF NOT EXISTS study(name text PRIMARY KEY, model text NOT NULL, definition text NOT "
               "NULL, state text NOT NULL, summary text NOT NULL)"),
           fmt::format("CREATE TABLE IF NOT EXISTS job(number {}, hash text NOT NULL UNIQUE, model text NOT NULL, "
                       "inputs text NOT NULL, state text NOT NULL, attempt integer NOT NULL DEFAULT 0, lease_until {}, "
                       "worker text, message text, vanished integer NOT NULL DEFAULT 0)",
                       d.number, d.real),
           fmt::format(
               "CREATE TABLE IF NOT EXISTS result(hash text PRIMARY KEY, model text NOT NULL, status text NOT "
               "NULL, outcome text NOT NULL, outputs text NOT NULL, trajectory text NOT NULL, message text NOT "
               "NULL, attempt integer NOT NULL, worker text NOT NULL, seconds {} NOT NULL, finished {} NOT NULL)",
               d.real, d.real),
           std::string("CREATE INDEX IF NOT EXISTS job_open ON job(number) WHERE state IN ('waiting', 'running')"),
           std::string("CREATE INDEX IF NOT EXISTS job_refused ON job(model) WHERE state = 'refused'"),
       })
    db.run(sql);
}

/// Whether the last that make_schema makes is there.
bool has_schema(Database& db, bool is_on_server) {
  const char* find = is_on_server ? "SELECT 1 FROM pg_attribute WHERE attrelid = to_regclass('job') AND attname = "
                                    "'vanished' AND to_regclass('job_refused') IS NOT NULL"
                                  : "SELECT 1 FROM pragma_table_info('job') WHERE name = 'vanished' AND EXISTS "
                                    "(SELECT 1 FROM sqlite_master WHERE name = 'job_refused')";
  return !db.run(find).empty();
}

/// Of the process that a worker is a thread of: its name up to the last colon.
std::string find_process(const std::string& worker) { return worker.substr(0, worker.rfind(':')); }

/// That a job whose lease has run out is held by others than the process of the parameter.
std::string is_of_others(const char* parameter) {
  return fmt::format("substr(worker, 1, length(CAST({0} AS text))) <> CAST({0} AS text)", parameter);
}

void roll_back(Database& db) {
  try {
    db.run("ROLLBACK");
  } catch (const std::exception&) {
    // it is rolled back already; the error that led here is the one to tell
  }
}

/// Tells once that a server is waited for, until it is there again.
class Waiting {
 public:
  void listen(std::function<void(const std::string&)> tell) {
    const std::lock_guard lock(mutex_);
    tell_ = std::move(tell);
  }
  void begin(const std::string& address, std::string why) {
    const std::lock_guard lock(mutex_);
    if (is_told_ || !tell_) return;
    is_told_ = true;
    std::erase(why, '\t');
    std::replace(why.begin(), why.end(), '\n', ' ');
    tell_("waiting for " + hide_password(address) + ": " + why);
  }
  void end() {
    const std::lock_guard lock(mutex_);
    is_told_ = false;
  }

 private:
  std::mutex mutex_;
  std::function<void(const std::string&)> tell_;
  bool is_told_ = false;
};
Waiting& waiting() {
  static Waiting one;
  return one;
}

std::unique_ptr<Database> open_patiently(const std::string& address, const std::atomic<bool>* cancel, double patience,
                                         bool is_read_only) {
  const auto start = Clock::now();
  for (;;) try {
      auto db = open_database(address, is_read_only);
      waiting().end();
      return db;
    } catch (const ConnectionLost& e) {
      if ((cancel && cancel->load()) || std::chrono::duration<double>(Clock::now() - start).count() > patience) throw;
      waiting().begin(address, e.what());
      std::this_thread::sleep_for(std::chrono::milliseconds(200));
    }
}

}  // namespace

void on_waiting(std::function<void(const std::string&)> tell) { waiting().listen(std::move(tell)); }

std::string calc_job_hash(const std::string& model, const Point& x) {
  std::string bytes = model;
  for (const double v : x) {
    const auto bits = std::bit_cast<std::uint64_t>(v == 0 ? 0.0 : v);
    for (int k = 0; k < 64; k += 8) bytes += static_cast<char>(bits >> k & 255U);
  }
  return calc_sha256(bytes);
}

std::string to_text(const std::vector<double>& numbers) {
  json j = json::array();
  for (const double x : numbers) j.push_back(to_json(x));
  return j.dump();
}

std::vector<double> to_numbers(const std::string& text) {
  const json list = json::parse(text);
  if (!list.is_array()) throw std::invalid_argument("a list is wanted");
  std::vector<double> numbers;
  for (const json& j : list) numbers.push_back(to_number(j));
  return numbers;
}

/// A transaction, repeated from its start when others or a lost connection ended it. One statement is a transaction of
/// its own, which no process can hold open.
template <class F>
auto Store::transact(F work, bool is_one_statement) {
  const auto start = Clock::now();
  for (bool again = false;; again = true) {
    try {
      if (!is_one_statement) db_->run(db_->dialect().begin);
      auto result = work(again);
      if (!is_one_statement) db_->run("COMMIT");
      return result;
    } catch (const TryAgain&) {
      if (!is_one_statement) roll_back(*db_);
      if (std::chrono::duration<double>(Clock::now() - start).count() > patience_) throw;
    } catch (const ConnectionLost& e) {
      for (;;) {
        if ((cancel_ && cancel_->load()) || std::chrono::duration<double>(Clock::now() - start).count() > patience_)
          throw;
        waiting().begin(address_, e.what());
        try {
          db_->reconnect();
          waiting().end();
          break;
        } catch (const ConnectionLost&) { std::this_thread::sleep_for(std::chrono::milliseconds(200)); }
      }
    } catch (...) {
      if (!is_one_statement) roll_back(*db_);
      throw;
    }
  }
}

Store::Store(const std::string& address, const std::atomic<bool>* cancel, double patience, bool is_read_only)
    : address_(address),
      db_(open_patiently(address, cancel, patience, is_read_only)),
      cancel_(cancel),
      patience_(patience) {
  if (is_read_only) return;
  // making what is there would wait for others, and let others wait
  const bool is_on_server = is_server(address);
  const auto is_there = [&](bool) { return has_schema(*db_, is_on_server); };
  if (transact(is_there, true)) return;
  transact([&](bool) {
    if (is_on_server) db_->run("SELECT pg_advisory_xact_lock(7086719)");  // two may create at once
    make_schema(*db_);
    // stores of earlier versions
    if (!has_schema(*db_, is_on_server)) db_->run("ALTER TABLE job ADD COLUMN vanished integer NOT NULL DEFAULT 0");
    return 0;
  });
}

void Store::put_model(const std::string& hash, const std::string& definition) {
  transact([&](bool) {
    db_->run(
        "INSERT INTO model(hash, definition) VALUES ($1, $2) ON CONFLICT (hash) DO UPDATE SET definition = "
        "excluded.definition",
        {hash, definition});
    return 0;
  });
}

std::optional<std::string> Store::find_model(const std::string& hash) {
  return transact(
      [&](bool) {
        const Rows rows = db_->run("SELECT definition FROM model WHERE hash = $1", {hash});
        return rows.empty() ? std::nullopt : rows[0][0];
      },
      true);
}

void Store::put_study(const StudyRow& s) {
  transact([&](bool) {
    db_->run(
        "INSERT INTO study(name, model, definition, state, summary) VALUES ($1, $2, $3, $4, $5) ON CONFLICT (name) DO "
        "UPDATE SET model = excluded.model, definition = excluded.definition, state = excluded.state, summary = "
        "excluded.summary",
        {s.name, s.model, s.definition, s.state, s.summary});
    return 0;
  });
}

bool Store::begin_study(const StudyRow& s, const std::optional<StudyRow>& there) {
  std::vector<Value> values = {s.name, s.model, s.definition, s.state, s.summary};
  const char* statement =
      "INSERT INTO study(name, model, definition, state, summary) VALUES ($1, $2, $3, $4, $5) ON CONFLICT (name) DO "
      "NOTHING RETURNING name";
  if (there) {
    values.insert(values.end(), {there->model, there->definition, there->state});
    statement =
        "UPDATE study SET model = $2, definition = $3, state = $4, summary = $5 WHERE name = $1 AND model = $6 AND "
        "definition = $7 AND state = $8 RETURNING name";
  }
  return transact([&](bool) { return !db_->run(statement, values).empty(); }, true);
}

std::optional<StudyRow> Store::find_study(const std::string& name) {
  return transact(
      [&](bool) -> std::optional<StudyRow> {
        const Rows rows = db_->run("SELECT name, model, definition, state, summary FROM study WHERE name = $1", {name});
        if (rows.empty()) return std::nullopt;
        const Row& r = rows[0];
        return StudyRow{*r[0], *r[1], *r[2], *r[3], *r[4]};
      },
      true);
}

std::pair<long, long> Store::count_studies() {
  return transact(
      [&](bool) {
        const Rows rows = db_->run("SELECT count(*), sum(CASE WHEN state = 'finished' THEN 0 ELSE 1 END) FROM study");
        return std::pair(std::stol(*rows[0][0]), std::stol(rows[0][1].value_or("0")));
      },
      true);
}

void Store::add_jobs(const std::string& model, const std::vector<std::pair<std::string, Point>>& jobs) {
  constexpr std::size_t most = 1000;  // in one statement
  for (std::size_t first = 0; first < jobs.size(); first += most) {
    json pairs = json::array();
    for (std::size_t i = first; i < std::min(first + most, jobs.size()); ++i)
      pairs.push_back({jobs[i].first, to_text(jobs[i].second)});
    transact(
        [&](bool) {
          db_->run(
              fmt::format("INSERT INTO job(hash, model, inputs, state) SELECT a, $2, b, 'waiting' FROM {} AS p WHERE "
                          "true ON CONFLICT (hash) DO NOTHING",
                          db_->dialect().pairs),
              {pairs.dump(), model});
          return 0;
        },
        true);
  }
}

void Store::add_impossible(const std::string& model, const std::vector<StoredResult>& results) {
  transact([&](bool) {
    for (const StoredResult& r : results) {
      db_->run(
          "INSERT INTO job(hash, model, inputs, state) VALUES ($1, $2, $3, 'impossible') ON CONFLICT (hash) DO NOTHING",
          {r.hash, model, to_text(r.inputs)});
      insert_result(*db_, {r.hash, model, {}}, "", r.answer);
    }
    return 0;
  });
}

std::vector<Job> Store::claim(const std::string& worker, int count, double lease, const std::string& model,
                              bool suspects) {
  const Dialect& d = db_->dialect();
  constexpr const char* columns = "number, hash, model, inputs, attempt, vanished";
  constexpr const char* losses = "vanished + CASE WHEN state = 'running' THEN 1 ELSE 0 END";  // with this one
  std::vector<Value> values = {worker, find_process(worker)};
  if (!model.empty()) values.emplace_back(model);
  Rows rows = transact(
      [&](bool again) {
        if (again) {
          // the transaction that was lost may have been committed
          Rows held =
              db_->run(fmt::format("SELECT {} FROM job WHERE state = 'running' AND worker = $1", columns), {worker});
          if (!held.empty()) return held;
        }
        return db_->run(
            fmt::format("WITH open AS MATERIALIZED (SELECT number, {10} AS losses FROM job WHERE state IN ('waiting', "
                        "'running') AND (state = 'waiting' OR (lease_until < {0} AND vanished + 1 < {1} AND {6})) {5} "
                        "{8} ORDER BY number LIMIT {2} {3}), first AS (SELECT number, losses FROM open ORDER BY number "
                        "LIMIT 1), chosen AS (SELECT number FROM open WHERE number = (SELECT number FROM first) OR "
                        "(losses < {9} AND (SELECT losses FROM first) < {9})) UPDATE job SET vanished = {10}, state = "
                        "'running', attempt = attempt + 1, worker = $1, lease_until = {0} + {4} WHERE number IN "
                        "(SELECT number FROM chosen) RETURNING {7}",
                        d.now, most_vanished, count, d.skip_locked, lease, model.empty() ? "" : "AND model = $3",
                        is_of_others("$2"), columns,
                        suspects ? std::string() : fmt::format("AND {} < {}", losses, suspect_vanished),
                        suspect_vanished, losses),
            values);
      },
      true);
  std::sort(rows.begin(), rows.end(), [](const Row& a, const Row& b) { return std::stoll(*a[0]) < std::stoll(*b[0]); });
  std::vector<Job> jobs;
  for (const Row& r : rows)
    jobs.push_back({*r[1], *r[2], read_inputs(address_, *r[1], *r[3]), std::stoi(*r[4]), std::stoi(*r[5])});
  return jobs;
}

void Store::renew(const std::vector<std::string>& workers, double lease) {
  const Dialect& d = db_->dialect();
  transact(
      [&](bool) {
        db_->run(fmt::format("UPDATE job SET lease_until = {} + {} WHERE state = 'running' AND worker IN {}", d.now,
                             lease, d.listed),
                 {json(workers).dump()});
        return 0;
      },
      true);
}

std::vector<std::string> Store::list_workers() {
  return transact(
      [&](bool) {
        std::vector<std::string> names;
        for (const Row& r : db_->run("SELECT DISTINCT worker FROM job WHERE state = 'running'"))
          if (r[0]) names.push_back(*r[0]);
        return names;
      },
      true);
}

bool Store::is_result(const Job& job, const Answer& answer) {
  using Kind = Answer::Kind;
  const bool is_lost = answer.kind == Kind::Crashed && job.attempt - job.vanished < most_attempts;
  return answer.kind == Kind::Done || answer.kind == Kind::Failed || (answer.kind == Kind::Crashed && !is_lost);
}

bool Store::finish(const Job& job, const std::string& worker, const Answer& answer) {
  using Kind = Answer::Kind;
  const bool counts = is_result(job, answer);
  std::string state = answer.kind == Kind::Done ? "done" : counts ? "failed" : "waiting";
  if (answer.kind == Kind::Refused) state = "refused";
  const int attempt = answer.kind == Kind::Cancelled ? job.attempt - 1 : job.attempt;
  const std::vector<Value> change = {state,  std::to_string(attempt),    to_clean(answer.text), job.hash,
                                     worker, std::to_string(job.attempt)};
  // an answer is as good as another's; the last attempt of a crash is the holder's to tell
  const char* held = answer.kind == Kind::Done || answer.kind == Kind::Failed
                         ? "state IN ('waiting', 'running') AND attempt >= $6"
                         : "state = 'running' AND worker = $5 AND attempt = $6";
  const std::string update = fmt::format(
      "UPDATE job SET state = $1, attempt = $2, message = $3, lease_until = NULL, worker = $5 WHERE hash = $4 AND {} "
      "RETURNING hash, model",
      held);
  if (!counts) return transact([&](bool) { return !db_->run(update, change).empty(); }, true);
  if (!db_->dialect().writes_within) {
    return transact([&](bool) {
      const bool is_ours = !db_->run(update, change).empty();
      if (is_ours) insert_result(*db_, job, worker, answer);
      return is_ours;
    });
  }
  std::vector<Value> values = change;
  for (Value& v : make_values(job, worker, answer)) values.push_back(std::move(v));
  const std::string both = fmt::format(
      "WITH mine AS ({}), kept AS (INSERT INTO result({}) SELECT hash, model, $7, $8, $9, $10, $11, $12::integer, $13, "
      "$14::double precision, {} FROM mine ON CONFLICT (hash) DO NOTHING) SELECT hash FROM mine",
      update, result_columns, db_->dialect().now);
  return transact([&](bool) { return !db_->run(both, values).empty(); }, true);
}

int Store::quarantine(const std::string& process) {
  const Dialect& d = db_->dialect();
  const std::vector<Value> values = process.empty() ? std::vector<Value>{} : std::vector<Value>{process};
  return transact([&](bool) {
    const Rows rows = db_->run(
        fmt::format("WITH chosen AS MATERIALIZED (SELECT number FROM job WHERE state IN ('waiting', 'running') AND "
                    "state = 'running' AND lease_until < {0} AND vanished + 1 >= {1} {3} ORDER BY number LIMIT 1000 "
                    "{2}) UPDATE job SET state = 'failed', vanished = vanished + 1 WHERE number IN (SELECT number FROM "
                    "chosen) RETURNING hash, model, attempt, worker, vanished",
                    d.now, most_vanished, d.skip_locked, process.empty() ? "" : "AND " + is_of_others("$1")),
        values);
    for (const Row& r : rows) {
      Answer a;
      a.kind = Answer::Kind::Failed;
      a.text = fmt::format("its worker vanished {} times", *r[4]);
      insert_result(*db_, {*r[0], *r[1], {}, std::stoi(*r[2])}, r[3].value_or(""), a);
    }
    return static_cast<int>(rows.size());
  });
}

std::vector<StoredResult> Store::find_results(const std::vector<std::string>& hashes) {
  return transact(
      [&](bool) {
        std::vector<StoredResult> results;
        for (const Row& r : db_->run(fmt::format("SELECT hash, status, outcome, outputs, trajectory, message, seconds "
                                                 "FROM result WHERE hash IN {}",
                                                 db_->dialect().listed),
                                     {json(hashes).dump()}))
          results.push_back({*r[0], {}, read_answer(address_, r, 1)});
        return results;
      },
      true);
}

std::vector<StoredResult> Store::load_results(const std::string& model) {
  return transact(
      [&](bool) {
        std::vector<StoredResult> results;
        for (const Row& r :
             db_->run("SELECT j.hash, j.inputs, r.status, r.outcome, r.outputs, r.trajectory, r.message, "
                      "r.seconds FROM job j JOIN result r ON r.hash = j.hash WHERE j.model = $1 ORDER BY "
                      "j.number",
                      {model}))
          results.push_back({*r[0], read_inputs(address_, *r[0], *r[1]), read_answer(address_, r, 2)});
        return results;
      },
      true);
}

Counts Store::count(const std::string& model) {
  return transact(
      [&](bool) {
        Counts c;
        // a lease that has run out is of a worker that is gone: its run waits
        for (const Row& r : db_->run(fmt::format("SELECT s, count(*) FROM (SELECT CASE WHEN state = 'running' AND "
                                                 "lease_until < {} THEN 'waiting' ELSE state END AS s FROM job WHERE "
                                                 "model = $1) AS j GROUP BY s",
                                                 db_->dialect().now),
                                     {model})) {
          const long n = std::stol(*r[1]);
          if (*r[0] == "waiting" || *r[0] == "refused") c.waiting += n;
          if (*r[0] == "running") c.running = n;
          if (*r[0] == "done") c.done = n;
          if (*r[0] == "failed" || *r[0] == "impossible") c.failed += n;
        }
        return c;
      },
      true);
}

long Store::count_running(const std::string& model) {
  return transact(
      [&](bool) {
        // a lease that has run out is of a worker that is gone
        return std::stol(*db_->run(fmt::format("SELECT count(*) FROM job WHERE state = 'running' AND model = $1 AND "
                                               "lease_until >= {}",
                                               db_->dialect().now),
                                   {model})[0][0]);
      },
      true);
}

std::optional<std::string> Store::find_refusal(const std::string& model) {
  return transact(
      [&](bool) {
        const Rows rows =
            db_->run("SELECT message FROM job WHERE model = $1 AND state = 'refused' ORDER BY number LIMIT 1", {model});
        return rows.empty() ? std::nullopt : std::optional<std::string>(rows[0][0].value_or(""));
      },
      true);
}

void Store::forget_refusals(const std::string& model) {
  transact([&](bool) {
    db_->run("UPDATE job SET state = 'waiting', attempt = 0, vanished = 0 WHERE model = $1 AND state = 'refused'",
             {model});
    return 0;
  });
}

std::optional<AnswerForm> Store::find_form(const std::string& model) {
  return transact(
      [&](bool) -> std::optional<AnswerForm> {
        const Rows rows =
            db_->run("SELECT hash, outputs FROM result WHERE model = $1 AND status = 'done' LIMIT 1", {model});
        if (rows.empty()) return std::nullopt;
        AnswerForm form;
        const auto outputs = read_column(Place{address_, "result", *rows[0][0]}, "outputs",
                                         [&] { return to_outputs(rows[0][1].value_or("{}")); });
        for (const auto& [name, value] : outputs) form.outputs.push_back(name);
        std::sort(form.outputs.begin(), form.outputs.end());
        const Rows curves = db_->run(
            "SELECT hash, trajectory FROM result WHERE model = $1 AND status = 'done' AND trajectory <> '[]' LIMIT 1",
            {model});
        if (!curves.empty())
          form.ordinates = read_column(Place{address_, "result", *curves[0][0]}, "trajectory", [&] {
                             return to_numbers(curves[0][1].value_or("[]"));
                           }).size();
        return form;
      },
      true);
}

void Store::rerun(const std::vector<std::string>& hashes) {
  const std::string list = json(hashes).dump();
  transact([&](bool) {
    db_->run(fmt::format("UPDATE study SET state = 'open', summary = '' WHERE model IN (SELECT model FROM job WHERE "
                         "hash IN {})",
                         db_->dialect().listed),
             {list});
    db_->run(fmt::format("DELETE FROM result WHERE hash IN {}", db_->dialect().listed), {list});
    db_->run(fmt::format("UPDATE job SET state = 'waiting', attempt = 0, vanished = 0, worker = NULL, message = NULL "
                         "WHERE hash IN {}",
                         db_->dialect().listed),
             {list});
    return 0;
  });
}

int Store::rerun_failed(const std::string& model) {
  return transact([&](bool) {
    db_->run(
        "UPDATE study SET state = 'open', summary = '' WHERE model = $1 AND EXISTS (SELECT 1 FROM job WHERE model "
        "= $1 AND state = 'failed')",
        {model});
    db_->run("DELETE FROM result WHERE hash IN (SELECT hash FROM job WHERE model = $1 AND state = 'failed')", {model});
    return static_cast<int>(
        db_->run("UPDATE job SET state = 'waiting', attempt = 0, vanished = 0, worker = NULL, message = NULL WHERE "
                 "model = $1 AND state = 'failed' RETURNING hash",
                 {model})
            .size());
  });
}

}  // namespace topple::study
