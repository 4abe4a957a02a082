#ifdef TOPPLE_POSTGRESQL

#include <fmt/format.h>
#include <libpq-fe.h>

#include <algorithm>
#include <initializer_list>
#include <unordered_map>

#include "base/error.h"
#include "study/database.h"

namespace topple::study {
namespace {

struct Clear {
  void operator()(PGresult* r) const { PQclear(r); }
};
using Answered = std::unique_ptr<PGresult, Clear>;

std::string trim(std::string text) {
  while (!text.empty() && (text.back() == '\n' || text.back() == ' ')) text.pop_back();
  return text;
}

class PostgresqlDatabase final : public Database {
 public:
  explicit PostgresqlDatabase(std::string url) : url_(std::move(url)) {
    dialect_.now = "extract(epoch FROM clock_timestamp())::double precision";
    dialect_.begin = "BEGIN";
    dialect_.skip_locked = "FOR UPDATE SKIP LOCKED";
    dialect_.writes_within = true;
    dialect_.number = "bigserial PRIMARY KEY";
    dialect_.real = "double precision";
    dialect_.listed = "(SELECT json_array_elements_text($1::json))";
    dialect_.pairs = "(SELECT e->>0 AS a, e->>1 AS b FROM json_array_elements($1::json) AS e)";
    connect();
  }
  ~PostgresqlDatabase() override { PQfinish(db_); }
  PostgresqlDatabase(const PostgresqlDatabase&) = delete;
  PostgresqlDatabase& operator=(const PostgresqlDatabase&) = delete;

  Rows run(const std::string& sql, const std::vector<Value>& parameters = {}) override {
    if (!db_) throw ConnectionLost("not connected");
    std::vector<const char*> values;
    for (const Value& v : parameters) values.push_back(v ? v->c_str() : nullptr);
    const int count = static_cast<int>(values.size());
    const auto [known, is_new] = statements_.try_emplace(sql, fmt::format("s{}", statements_.size()));
    if (is_new) {
      const Answered prepared(PQprepare(db_, known->second.c_str(), sql.c_str(), count, nullptr));
      if (PQresultStatus(prepared.get()) != PGRES_COMMAND_OK) {
        statements_.erase(known);
        fail(prepared.get());
      }
    }
    const Answered r(PQexecPrepared(db_, known->second.c_str(), count, values.data(), nullptr, nullptr, 0));
    const ExecStatusType status = PQresultStatus(r.get());
    if (status != PGRES_COMMAND_OK && status != PGRES_TUPLES_OK) fail(r.get());
    Rows rows(static_cast<std::size_t>(PQntuples(r.get())));
    for (std::size_t i = 0; i < rows.size(); ++i)
      for (int k = 0; k < PQnfields(r.get()); ++k) {
        const int row = static_cast<int>(i);
        if (PQgetisnull(r.get(), row, k))
          rows[i].emplace_back();
        else
          rows[i].emplace_back(std::string(PQgetvalue(r.get(), row, k), PQgetlength(r.get(), row, k)));
      }
    return rows;
  }

  const Dialect& dialect() const override { return dialect_; }
  void reconnect() override { connect(); }

 private:
  void connect() {
    PQfinish(db_);
    statements_.clear();
    const char* keywords[] = {"dbname", "application_name", "connect_timeout", "client_encoding", nullptr};
    const char* values[] = {url_.c_str(), "topple", "10", "UTF8", nullptr};
    db_ = PQconnectdbParams(keywords, values, 1);
    if (PQstatus(db_) == CONNECTION_OK) {
      PQsetNoticeProcessor(
          db_, [](void*, const char*) {}, nullptr);  // "exists already"
      // a process that is stopped within a transaction must not hold its rows
      run("SET idle_in_transaction_session_timeout = 5000");
      was_there_ = true;
      return;
    }
    std::string why = trim(PQerrorMessage(db_));
    PQfinish(db_);
    db_ = nullptr;
    if (const std::size_t at = why.find(url_); at != std::string::npos)
      why.replace(at, url_.size(), hide_password(url_));
    if (is_refused(why))
      throw InputError("E820", fmt::format("{} lets nobody in so: {}", hide_password(url_), why),
                       "`createdb` makes a database; see docs/study.md, \"Many machines\"");
    if (!was_there_ && is_misspelt(why))
      throw InputError("E820", fmt::format("{} leads nowhere: {}", hide_password(url_), why),
                       "an address is postgresql://user@host:port/name?setting=value");
    throw ConnectionLost(why);
  }

  // libpq has no codes for why it does not connect; waiting helps against neither
  static bool has_one_of(const std::string& text, std::initializer_list<const char*> words) {
    return std::any_of(words.begin(), words.end(), [&](const char* w) { return text.find(w) != std::string::npos; });
  }
  static bool is_refused(const std::string& why) {
    if (has_one_of(why, {"no password supplied", "does not support SSL", "certificate"})) return true;
    return has_one_of(why, {"FATAL:"}) &&
           has_one_of(why, {"\" does not exist", "authentication failed", "no pg_hba.conf entry", "permission denied",
                            "is not permitted to log in"});
  }
  /// What is said before any server is spoken to; a name that cannot be looked up just now may come back.
  static bool is_misspelt(const std::string& why) {
    return !has_one_of(
        why, {"connection to server", "could not connect", "timeout expired", "Temporary failure", "out of memory"});
  }

  [[noreturn]] void fail(const PGresult* r) {
    const std::string why = trim(PQerrorMessage(db_));
    const char* found = PQresultErrorField(r, PG_DIAG_SQLSTATE);
    const std::string state = found ? found : "";
    // 57P0x: the server stops or starts; 08: the connection; no code: libpq itself, which could not send and may still
    // take the connection for whole because of what the server said before it went
    if (PQstatus(db_) != CONNECTION_OK || state.empty() || state.starts_with("57P") || state.starts_with("08"))
      throw ConnectionLost(why);
    if (state.starts_with("40")) throw TryAgain(why);
    throw std::runtime_error("PostgreSQL: " + why);
  }

  std::string url_;
  PGconn* db_ = nullptr;
  bool was_there_ = false;  // once connected, the address is right
  std::unordered_map<std::string, std::string> statements_;
  Dialect dialect_;
};

}  // namespace

std::unique_ptr<Database> open_postgresql(const std::string& url) { return std::make_unique<PostgresqlDatabase>(url); }

}  // namespace topple::study

#endif
