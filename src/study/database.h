#pragma once
/// The little that a study needs of a database: statements with parameters, rows of text, transactions. Two kinds:
/// a SQLite file and a PostgreSQL server. One connection belongs to one thread.

#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

namespace topple::study {

using Value = std::optional<std::string>;  // empty: NULL
using Row = std::vector<Value>;
using Rows = std::vector<Row>;

/// The server does not answer, or broke the connection: what was under way may or may not be committed.
struct ConnectionLost : std::runtime_error {
  using std::runtime_error::runtime_error;
};
/// The transaction was rolled back because of others; it may be tried again.
struct TryAgain : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Where the dialects differ.
struct Dialect {
  std::string now;             // seconds since 1970 by the database's clock
  std::string begin;           // starts a transaction that will write
  std::string skip_locked;     // behind a SELECT whose rows are to be changed
  std::string number;          // type of a column that counts rows
  std::string real;            // type of a double
  std::string listed;          // of texts of the JSON array $1: "hash IN (...)" takes it
  bool writes_within = false;  // WITH may hold statements that write
  std::string pairs;           // rows (a, b) of the JSON array $1 of pairs, in its order
};

/// The disk is full, or does not take or give what is written: nothing of the statement is kept.
struct DiskFailed : std::runtime_error {
  using std::runtime_error::runtime_error;
};

class Database {
 public:
  virtual ~Database() = default;
  /// Runs one statement; parameters are $1, $2, ... as text. Throws ConnectionLost, TryAgain,
  /// DiskFailed, std::runtime_error.
  virtual Rows run(const std::string& sql, const std::vector<Value>& parameters = {}) = 0;
  virtual const Dialect& dialect() const = 0;
  /// Connects anew, if it can be lost. Throws ConnectionLost.
  virtual void reconnect() = 0;
};

/// Whether an address is that of a server ("postgresql://..." or "postgres://...") rather than a file.
bool is_server(const std::string& address);
/// The address without its password, for people to read.
std::string hide_password(const std::string& address);

/// Connects. Throws InputError E820 if the file cannot be opened, DiskFailed if it cannot be begun, E821 if this
/// program was built without PostgreSQL; ConnectionLost if the server does not answer.
///   is_read_only  of a file: it may lie where nothing can be written
std::unique_ptr<Database> open_database(const std::string& address, bool is_read_only = false);
std::unique_ptr<Database> open_sqlite(const std::string& path, bool is_read_only = false);
std::unique_ptr<Database> open_postgresql(const std::string& url);

/// Whether another connection has the file of a store open, here or in another process. False where it cannot be told
/// (no store, no room on the disk).
bool is_open_elsewhere(const std::string& path);

}  // namespace topple::study
