#include <fmt/format.h>
#include <sqlite3.h>
#include <unistd.h>

#include <filesystem>
#include <unordered_map>

#include "base/error.h"
#include "study/database.h"

namespace topple::study {
namespace {

constexpr int most_wait = 60000;  // for other writers [ms]

class SqliteDatabase final : public Database {
 public:
  // behind the other constructor the destructor closes what this one leaves by an error
  SqliteDatabase(const std::string& path, bool is_read_only) : SqliteDatabase(path) {
    if (is_read_only) {
      open_to_read();
    } else {
      open(path, SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE);
      try {
        run("PRAGMA journal_mode = WAL");
        run("PRAGMA synchronous = NORMAL");
      } catch (const InputError&) {
        throw;  // it says all
      } catch (const DiskFailed&) { throw; } catch (const std::exception& e) {
        refuse(e.what());
      }
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
    complain(code, why);
  }

  const Dialect& dialect() const override { return dialect_; }
  void reconnect() override {}

 private:
  explicit SqliteDatabase(const std::string& path) : path_(path) {}

  void open(const std::string& name, int flags) {
    if (sqlite3_open_v2(name.c_str(), &db_, flags | SQLITE_OPEN_NOMUTEX, nullptr) != SQLITE_OK) {
      const std::string why = db_ ? sqlite3_errmsg(db_) : "out of memory";
      close();
      throw InputError("E820", fmt::format("cannot open {}: {}", path_, why));
    }
    sqlite3_busy_timeout(db_, most_wait);
  }

  /// A reader leaves nothing behind where it may write: readers and writers agree by files beside the store, which the
  /// last one takes away. A folder that may not be written to may have none: then nobody else is writing there.
  void open_to_read() {
    const std::string folder = std::filesystem::path(path_).parent_path().string();
    const bool is_writable =
        access(path_.c_str(), W_OK) == 0 && access(folder.empty() ? "." : folder.c_str(), W_OK) == 0;
    if (is_writable) {
      open(path_, SQLITE_OPEN_READWRITE);
      try {
        if (!holds_studies()) refuse("it has no table of studies");
        return;
      } catch (const DiskFailed&) {
        // no room for what they agree by
        close();
      }
    }
    open(path_, SQLITE_OPEN_READONLY);
    try {
      if (holds_studies()) return;
    } catch (const std::exception&) {
      // it cannot agree with writers
    }
    close();
    std::error_code unknown;
    if (const auto size = std::filesystem::file_size(path_ + "-wal", unknown); !unknown && size > 0)
      throw InputError(
          "E820",
          fmt::format("{} is not all of its study: runs of one that was interrupted lie in {}-wal", path_, path_),
          "copy both files to a folder that may be written to, and read it there");
    std::string name = "file:";
    for (const char c : path_) {
      if (c == '%' || c == '?' || c == '#')
        name += fmt::format("%{:02X}", static_cast<unsigned char>(c));
      else
        name += c;
    }
    open(name + "?immutable=1", SQLITE_OPEN_READONLY | SQLITE_OPEN_URI);
    if (!holds_studies()) refuse("it has no table of studies");
  }

  bool holds_studies() {
    try {
      return !run("SELECT 1 FROM sqlite_master WHERE name = 'study'").empty();
    } catch (const InputError&) { throw; } catch (const TryAgain&) {
      throw;
    } catch (const DiskFailed&) { throw; } catch (const std::exception& e) {
      refuse(e.what());
    }
  }

  [[noreturn]] void refuse(const std::string& why) {
    close();
    throw InputError("E820", fmt::format("{} is no study: {}", path_, why));
  }

  [[noreturn]] void complain(int code, const std::string& why) const {
    if (code == SQLITE_BUSY || code == SQLITE_LOCKED) throw TryAgain(why);
    if (code == SQLITE_CORRUPT)
      throw InputError(
          "E820", fmt::format("{} is damaged: {}", path_, why),
          "take a copy that is whole; or save what can be read (sqlite3 FILE .recover), or begin in another "
          "folder");
    if (code == SQLITE_READONLY)
      throw InputError("E820", fmt::format("{} may not be written to: {}", path_, why), "topple study show reads it");
    if (code == SQLITE_FULL) throw DiskFailed(fmt::format("{} could not be written: {}", path_, why));
    if (code == SQLITE_IOERR) throw DiskFailed(fmt::format("{} could not be written or read: {}", path_, why));
    throw std::runtime_error(fmt::format("SQLite: {}: {}", path_, why));
  }

  sqlite3_stmt* prepare(const std::string& sql) {
    const auto known = statements_.find(sql);
    if (known != statements_.end()) return known->second;
    sqlite3_stmt* s = nullptr;
    const int code = sqlite3_prepare_v2(db_, sql.c_str(), static_cast<int>(sql.size()), &s, nullptr);
    if (code != SQLITE_OK) complain(code, sqlite3_errmsg(db_));
    statements_.emplace(sql, s);
    return s;
  }
  void close() {
    for (const auto& [sql, s] : statements_) sqlite3_finalize(s);
    statements_.clear();
    sqlite3_close(db_);
    db_ = nullptr;
  }

  std::string path_;
  sqlite3* db_ = nullptr;
  std::unordered_map<std::string, sqlite3_stmt*> statements_;
  Dialect dialect_;
};

}  // namespace

std::unique_ptr<Database> open_sqlite(const std::string& path, bool is_read_only) {
  return std::make_unique<SqliteDatabase>(path, is_read_only);
}

bool is_open_elsewhere(const std::string& path) {
  sqlite3* db = nullptr;
  int code = sqlite3_open_v2(path.c_str(), &db, SQLITE_OPEN_READWRITE | SQLITE_OPEN_NOMUTEX, nullptr);
  // only who is alone may leave the write-ahead log, which the next one turns on again
  for (const char* sql : {"SELECT 1 FROM sqlite_master", "PRAGMA journal_mode = DELETE"})
    if (code == SQLITE_OK) code = sqlite3_exec(db, sql, nullptr, nullptr, nullptr);
  sqlite3_close(db);
  return code == SQLITE_BUSY || code == SQLITE_LOCKED;
}

}  // namespace topple::study
