#include <fmt/format.h>
#include <sqlite3.h>

#include <unordered_map>

#include "base/error.h"
#include "study/database.h"

namespace topple::study {
namespace {

constexpr int most_wait = 60000;  // for other writers [ms]

class SqliteDatabase final : public Database {
 public:
  explicit SqliteDatabase(const std::string& path) {
    constexpr int flags = SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE | SQLITE_OPEN_NOMUTEX;
    if (sqlite3_open_v2(path.c_str(), &db_, flags, nullptr) != SQLITE_OK) {
      const std::string why = db_ ? sqlite3_errmsg(db_) : "out of memory";
      sqlite3_close(db_);
      throw InputError("E820", fmt::format("cannot open {}: {}", path, why));
    }
    sqlite3_busy_timeout(db_, most_wait);
    try {
      run("PRAGMA journal_mode = WAL");
      run("PRAGMA synchronous = NORMAL");
    } catch (const std::exception& e) {
      close();
      throw InputError("E820", fmt::format("{} is no study: {}", path, e.what()));
    }
    dialect_.now = "((julianday('now') - 2440587.5) * 86400.0)";
    dialect_.begin = "BEGIN IMMEDIATE";
    dialect_.number = "INTEGER PRIMARY KEY AUTOINCREMENT";
    dialect_.real = "REAL";
    dialect_.listed = "(SELECT value FROM json_each($1))";
    dialect_.pairs = "(SELECT json_extract(value, '$[0]') AS a, json_extract(value, '$[1]') AS b FROM json_each($1))";
  }
  ~SqliteDatabase() override { close(); }
  SqliteDatabase(const SqliteDatabase&) = delete;
  SqliteDatabase& operator=(const SqliteDatabase&) = delete;

  Rows run(const std::string& sql, const std::vector<Value>& parameters = {}) override {
    sqlite3_stmt* s = prepare(sql);
    for (std::size_t i = 0; i < parameters.size(); ++i) {
      const int place = sqlite3_bind_parameter_index(s, fmt::format("${}", i + 1).c_str());
      if (place == 0) continue;
      if (const Value& v = parameters[i])
        sqlite3_bind_text(s, place, v->data(), static_cast<int>(v->size()), SQLITE_TRANSIENT);
      else
        sqlite3_bind_null(s, place);
    }
    Rows rows;
    int code = 0;
    while ((code = sqlite3_step(s)) == SQLITE_ROW) {
      Row row;
      for (int k = 0; k < sqlite3_column_count(s); ++k) {
        if (sqlite3_column_type(s, k) == SQLITE_NULL) {
          row.emplace_back();
          continue;
        }
        const auto* text = reinterpret_cast<const char*>(sqlite3_column_text(s, k));
        row.emplace_back(std::string(text, static_cast<std::size_t>(sqlite3_column_bytes(s, k))));
      }
      rows.push_back(std::move(row));
    }
    const std::string why = code == SQLITE_DONE ? "" : sqlite3_errmsg(db_);
    sqlite3_reset(s);
    sqlite3_clear_bindings(s);
    if (code == SQLITE_DONE) return rows;
    if (code == SQLITE_BUSY || code == SQLITE_LOCKED) throw TryAgain(why);
    throw std::runtime_error(fmt::format("SQLite: {}", why));
  }

  const Dialect& dialect() const override { return dialect_; }
  void reconnect() override {}

 private:
  sqlite3_stmt* prepare(const std::string& sql) {
    const auto known = statements_.find(sql);
    if (known != statements_.end()) return known->second;
    sqlite3_stmt* s = nullptr;
    const int code = sqlite3_prepare_v2(db_, sql.c_str(), static_cast<int>(sql.size()), &s, nullptr);
    if (code == SQLITE_BUSY || code == SQLITE_LOCKED) throw TryAgain(sqlite3_errmsg(db_));
    if (code != SQLITE_OK) throw std::runtime_error(fmt::format("SQLite: {}", sqlite3_errmsg(db_)));
    statements_.emplace(sql, s);
    return s;
  }
  void close() {
    for (const auto& [sql, s] : statements_) sqlite3_finalize(s);
    statements_.clear();
    sqlite3_close(db_);
    db_ = nullptr;
  }

  sqlite3* db_ = nullptr;
  std::unordered_map<std::string, sqlite3_stmt*> statements_;
  Dialect dialect_;
};

}  // namespace

std::unique_ptr<Database> open_sqlite(const std::string& path) { return std::make_unique<SqliteDatabase>(path); }

}  // namespace topple::study
